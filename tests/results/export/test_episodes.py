"""Episodes that were exported are read by the tools that the formats belong to, and are what they were here."""

import json
from dataclasses import replace
from pathlib import Path

import gymnasium
import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.core.errors import InvalidOption, Mismatch, MissingDependency, RunFolderError, UnknownName
from pbcs_ompl.results.export import export
from tests.results.export.controllers import follow_chain
from tests.skills.test_chain import MODEL, round_the_corner

MAZE = {"size": 2}


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plan") / "run"
    assert pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs=MAZE, seed=0, out=folder).solved
    return folder


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("chain") / "chain"
    round_the_corner().save(folder)
    return folder


def test_minari_reads_them_and_recovers_the_environment(plan: Path, chain: Path, tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    assert export(plan, "minari", out=tmp_path / "data", episodes=3).successes >= 1
    export(chain, "minari", out=tmp_path / "more", episodes=2)
    planned, tree = minari.load_dataset("maze/plan-v0"), minari.load_dataset("maze/tree-v0")
    assert (planned.total_episodes, tree.total_episodes) == (1, 3)
    env = planned.recover_environment()
    for episode in (*planned.iterate_episodes(), *tree.iterate_episodes()):
        observation, _ = env.reset(seed=0)
        np.testing.assert_array_equal(observation, episode.observations[0])
        for step, action in enumerate(episode.actions):
            env.unwrapped.set_env_state(episode.infos["state"][step])  # a reset to any state of the episode
            observation, reward, *_ = env.step(action)
            np.testing.assert_array_equal(observation, episode.observations[step + 1])
            assert reward == episode.rewards[step]
    trajectory = pbcs_ompl.Trajectory.from_minari("maze/plan-v0")
    kept = pbcs_ompl.Trajectory.load(plan / "trajectory.npz")
    np.testing.assert_array_equal(trajectory.states, kept.states)
    np.testing.assert_array_equal(trajectory.actions, kept.actions)
    with pytest.raises(Mismatch, match="lead elsewhere"):
        pbcs_ompl.Trajectory.from_minari("maze/plan-v0", env=pbcs_ompl.EnvSpec("pbcs/Maze-v0", {"size": 3}))


def test_the_fields_that_reverse_curricula_read_are_there(plan: Path, chain: Path, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    done = export(chain, "maniskill", out=tmp_path / "data", episodes=3, epsilon=0.1)
    assert (done.episodes, done.successes) == (3, 3)
    words = json.loads((tmp_path / "data/trajectory.json").read_text())
    assert words["env_info"]["env_id"] == "pbcs/Maze-v0"
    with h5py.File(tmp_path / "data/trajectory.h5") as file:
        for episode in words["episodes"]:
            demonstration = file[f"traj_{episode['episode_id']}"]
            states, actions = demonstration["env_states"][:], demonstration["actions"][:]
            assert episode["success"]
            assert demonstration["success"][:].sum() == 1
            assert len(states) == len(actions) + 1 == episode["elapsed_steps"] + 1
            env = gymnasium.make(words["env_info"]["env_id"], **words["env_info"]["env_kwargs"])
            env.reset(**episode["reset_kwargs"])
            for action in actions:
                observation, *_ = env.step(action)
            np.testing.assert_array_equal(observation, demonstration["obs"][-1])


@pytest.mark.slow
def test_stable_baselines_continues_with_the_policy_and_the_transitions(tmp_path: Path) -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    from pbcs_ompl.skills.chain import SkillChain

    whole = round_the_corner()
    single = SkillChain(whole.skills[:1], whole.start, MODEL.spec, 30, whole.actions, 0)
    single.save(tmp_path / "chain")
    done = export(tmp_path / "chain", "sb3", out=tmp_path / "sb3", episodes=2)
    env = gymnasium.make("pbcs/Maze-v0", size=2)
    model = sb3.TD3.load(tmp_path / "sb3/model.zip", env=env)
    model.load_replay_buffer(tmp_path / "sb3/replay_buffer.pkl")
    assert (done.episodes, model.replay_buffer.size()) == (2, 60)
    observations = np.random.default_rng(0).uniform(0, 2, (200, 2))
    controller = single.controller()
    controller.reset(200)
    np.testing.assert_allclose(model.predict(observations, deterministic=True)[0], controller.act(observations),
                               rtol=0, atol=1e-6)
    stored = model.replay_buffer.sample(50)
    assert stored.dones.max() in (0.0, 1.0)
    before = model.actor.mu[0].weight.detach().clone()
    model.learn(20)
    assert model.replay_buffer.size() == 80
    assert not (before == model.actor.mu[0].weight).all()


def test_a_plan_fills_a_replay_buffer(plan: Path, tmp_path: Path) -> None:
    sb3 = pytest.importorskip("stable_baselines3")
    export(plan, "sb3", out=tmp_path / "sb3", episodes=0)
    model = sb3.TD3.load(tmp_path / "sb3/model.zip")
    model.load_replay_buffer(tmp_path / "sb3/replay_buffer.pkl")
    kept = pbcs_ompl.Trajectory.load(plan / "trajectory.npz")
    assert model.replay_buffer.size() == kept.length
    np.testing.assert_allclose(model.policy.unscale_action(model.replay_buffer.actions[:kept.length, 0]), kept.actions,
                               atol=1e-6)


def test_steps_and_runs_are_tables(plan: Path, tmp_path: Path) -> None:
    export(plan, "csv", out=tmp_path / "steps", episodes=0)
    kept = pbcs_ompl.Trajectory.load(plan / "trajectory.npz")
    table = np.genfromtxt(tmp_path / "steps/steps.csv", delimiter=",", names=True, deletechars="")
    assert len(table) == kept.length + 1
    np.testing.assert_array_equal(table["state[0]"], kept.states[:, 0])
    pbcs_ompl.compare(["Ex"], "pbcs/Maze-v0", env_kwargs=MAZE, seeds=1, out=tmp_path / "compared")
    export(tmp_path / "compared", "csv", out=tmp_path / "runs")
    lines = (tmp_path / "runs/runs.csv").read_text().splitlines()
    assert len(lines) == 2
    assert lines[1].startswith("pbcs/Maze-v0(size=2),Ex,0,True")
    export(tmp_path / "compared", "planner-arena", out=tmp_path / "arena")
    same = [(tmp_path / place / "comparison.db").read_bytes() for place in ("arena", "compared")]
    assert same[0] == same[1]


def test_what_does_not_fit_is_refused_in_one_line(plan: Path, chain: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="'onnx'"):
        export(chain, "onx", out=tmp_path / "a")
    with pytest.raises(InvalidOption, match="holds no controller"):
        export(plan, "numpy", out=tmp_path / "b")
    with pytest.raises(InvalidOption, match=r"has \d that take over from each other; .*pbcs distill"):
        export(chain, "sb3", out=tmp_path / "c")
    follower = follow_chain().controller
    replace(follower, policies=follower.policies[:1], firsts=(0,)).save(tmp_path / "f")
    with pytest.raises(InvalidOption, match=r"where it is on its line; .*pbcs distill"):
        export(tmp_path / "f", "sb3", out=tmp_path / "g", episodes=1)
    with pytest.raises(InvalidOption, match="pbcs compare"):
        export(plan, "planner-arena", out=tmp_path / "d")
    with pytest.raises(RunFolderError, match="not empty"):
        export(chain, "numpy", out=chain)


@pytest.mark.parametrize(("to", "module", "extra"), [("onnx", "onnx", "onnx"), ("minari", "minari", "minari"),
                                                     ("maniskill", "h5py", "maniskill"),
                                                     ("sb3", "stable_baselines3", "compare")])
def test_a_missing_library_is_named_with_its_command(to: str, module: str, extra: str, plan: Path, chain: Path,
                                                     tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(MissingDependency, match=rf'pip install "pbcs-ompl\[{extra}\]"'):
        export(plan if to == "sb3" else chain, to, out=tmp_path / "out", episodes=1)


def test_a_demonstration_is_a_trajectory_that_training_takes(plan: Path) -> None:
    kept = pbcs_ompl.Trajectory.load(plan / "trajectory.npz")
    longer = np.concatenate([kept.actions, kept.actions[:5]])
    made = pbcs_ompl.Trajectory.from_arrays("pbcs/Maze-v0", longer, reset_seed=kept.reset_seed, env_kwargs=MAZE)
    np.testing.assert_array_equal(made.states, kept.states)
    assert made.replays_exactly(pbcs_ompl.make("pbcs/Maze-v0", MAZE))
    trained = pbcs_ompl.train("pbcs/Maze-v0", method="pbcs", env_kwargs=MAZE, trajectory=made, max_transitions=2_000)
    assert trained.plan_transitions == 0
    state = pbcs_ompl.Trajectory.from_arrays("pbcs/Maze-v0", kept.actions, first_state=kept.states[0], env_kwargs=MAZE)
    assert state.reset_seed is None
    with pytest.raises(InvalidOption, match="and not both"):
        pbcs_ompl.Trajectory.from_arrays("pbcs/Maze-v0", kept.actions, env_kwargs=MAZE)
    with pytest.raises(InvalidOption, match=r"\[T, 2\]"):
        pbcs_ompl.Trajectory.from_arrays("pbcs/Maze-v0", kept.actions[:, :1], reset_seed=0, env_kwargs=MAZE)


def test_dictionaries_stay_dictionaries(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gymnasium_robotics")
    minari = pytest.importorskip("minari")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    made = pbcs_ompl.Trajectory.from_arrays("PointMaze_UMaze-v3", np.ones((20, 2), np.float32), reset_seed=3)
    made.save(tmp_path / "trajectory.npz")
    export(tmp_path, "minari", out=tmp_path / "data")
    (episode,) = minari.load_dataset("pointmaze-umaze/plan-v0").iterate_episodes()
    assert set(episode.observations) == {"achieved_goal", "desired_goal", "observation"}
    np.testing.assert_array_equal(episode.infos["state"], made.states)
    assert pbcs_ompl.Trajectory.from_minari("pointmaze-umaze/plan-v0").length == 20


