"""A follower that was trained once drives along any line: its parts, its training on points, its files."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.agents.ppo import PPOSettings
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, InvalidState, Mismatch, RunFolderError
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.envs.planar_quadrotor import PlanarQuadrotorEnv
from pbcs_ompl.results.files import read_toml, write_toml
from pbcs_ompl.skills.path_following.follower import Progress
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.policy import ObservationTransform
from pbcs_ompl.skills.robots.evaluation import evaluate_follower
from pbcs_ompl.skills.robots.follower import LOST_AFTER, RobotFollower
from pbcs_ompl.skills.robots.free_space import FreeSpace
from pbcs_ompl.skills.robots.lines import Lines
from pbcs_ompl.skills.robots.settings import RobotSettings
from pbcs_ompl.skills.robots.starts import Pool
from pbcs_ompl.skills.robots.train import FollowerResult, _Run, resume_follower, train_follower
from pbcs_ompl.skills.robots.training import RobotTraining
from pbcs_ompl.skills.robots.view import KEEP_SIDE, RobotView
from pbcs_ompl.skills.robots.worlds import Worlds, free_space

POINT = {"lines_per_world": 20, "tests_per_world": 5, "longest": 6.0, "clearance": 0.1, "near": 0.1, "middle": 0.2,
         "far": 0.4, "window": 0.3, "goal_radius": 0.15, "patience": 15, "max_steps": 150, "advance": 0.5,
         "test_transitions": 20_000, "test_steps": 400, "effort": 0.0}
"""Settings for a point that moves 0.1 in a step."""
QUADROTOR = {"lines_per_world": 5, "tests_per_world": 1, "longest": 6.0, "clearance": 0.4, "stumbles": 10}
AGENT = {"hidden": [32, 32], "initial_std": 0.4}
WORLDS = [{"size": 3}, {"size": 4, "maze_seed": 5}, {"size": 4, "maze_seed": 6}]


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> FollowerResult:
    return train_follower("pbcs/Maze-v0", worlds=WORLDS, settings=POINT, agent_settings=AGENT, seed=0,
                          max_transitions=80_000, out=tmp_path_factory.mktemp("follower") / "run")


def test_lines_side_by_side_are_the_lines_one_by_one() -> None:
    rng = np.random.default_rng(0)
    lines = [Line.through(np.cumsum(rng.normal(size=(count, 2)), axis=0), 0.05) for count in (3, 8, 2, 20)]
    stack, rows = Lines.of(lines), rng.integers(0, 4, 300)
    pointers = np.array([rng.integers(0, lines[row].last + 1) for row in rows])
    features = stack[rows].at(pointers) + rng.normal(scale=0.3, size=(300, 2))
    distances = np.array([0.1, 0.5, 2.0])
    advanced, ahead = stack[rows].advance(features, pointers, 1.0), stack[rows].ahead(features, pointers, distances)
    assert (advanced > pointers).any()
    for k, row in enumerate(rows):
        one = lines[row]
        np.testing.assert_array_equal(advanced[k:k + 1], one.advance(features[k:k + 1], pointers[k:k + 1], 1.0))
        np.testing.assert_allclose(ahead[k:k + 1], one.ahead(features[k:k + 1], pointers[k:k + 1], distances))
        assert stack[rows].last[k] == one.last


def test_ways_keep_clear_of_walls_and_are_hardly_longer_than_they_must_be() -> None:
    walls = np.array([[1.9, 0.0, 2.1, 3.0]])
    space = FreeSpace(walls, np.zeros(2), np.full(2, 4.0), 0.3)
    line = space.line_between(np.array([0.5, 0.5]), np.array([3.5, 0.5]), 0.05)
    np.testing.assert_allclose(line.points[[0, -1]], [[0.5, 0.5], [3.5, 0.5]])
    assert space.distance(line.points).min() > 0.25
    around = 2 * np.hypot(1.4, 2.8) + 0.2
    assert around < line.length < 1.15 * around
    with pytest.raises(InvalidState, match="no way"):
        FreeSpace(np.array([[1.9, 0.0, 2.1, 4.0]]), np.zeros(2), np.full(2, 4.0), 0.3).line_between(
            np.array([0.5, 0.5]), np.array([3.5, 0.5]), 0.05)


def test_a_smoothed_plan_is_shorter_clear_of_walls_and_on_the_same_side_of_them() -> None:
    """The plan goes round a block by the longer way, with detours; so does its line."""
    space = FreeSpace(np.array([[1.5, 1.0, 2.5, 3.6]]), np.zeros(2), np.full(2, 4.0), 0.2)
    corners = np.array([[0.5, 1.5], [0.6, 2.4], [0.3, 2.0], [0.9, 3.79], [2.0, 3.79], [3.6, 3.7], [3.0, 3.0],
                        [3.5, 2.0]])
    places = Line.through(corners, 0.02).points
    line = space.smoothed(places, np.array([3.4, 1.5]), 0.05)
    np.testing.assert_allclose(line.points[[0, -1]], [[0.5, 1.5], [3.4, 1.5]])
    assert line.points[:, 1].max() > 3.6  # above the block, where the plan was; below would be shorter
    assert space.distance(line.points).min() > 0.15
    assert line.length < 0.85 * Line.through(corners, 0.02).length
    away = np.linalg.norm(line.points[:, None] - np.concatenate([places, line.points[-1:]]), axis=2).min(axis=1)
    assert away.max() < 2 * 1.5 * 0.2
    assert space.line_between(corners[0], np.array([3.4, 1.5]), 0.05).points[:, 1].min() < 1.0


def test_random_lines_are_free_long_and_differ() -> None:
    model = pbcs_ompl.make("pbcs/Maze-v0", {"size": 4, "maze_seed": 1})
    space = free_space(model, 0.1)
    lines = space.random_lines(10, np.random.default_rng(0), longest=6.0, spacing=0.05)
    assert len({line.points[0].tobytes() for line in lines}) > 5
    for line in lines:
        assert 1.2 < line.length <= 6.0
        assert space.distance(line.points).min() > 0.05
    with pytest.raises(InvalidState, match="choose shorter ones"):
        space.random_lines(2, np.random.default_rng(0), longest=1000.0, spacing=0.05)


class Fast(PlanarQuadrotorEnv):
    """What is explored are speeds."""

    feature_dims = (3, 4)


def test_lines_of_an_upright_robot_lie_in_its_plane_and_keep_clear_of_the_border() -> None:
    model = pbcs_ompl.make("pbcs/PlanarQuadrotor-v0")
    space = free_space(model, 0.4)
    for line in space.random_lines(10, np.random.default_rng(0), longest=6.0, spacing=0.05):
        assert line.points.min() > 0.3
        assert line.points.max() < 5.7
    with pytest.raises(Mismatch, match="begins with the robot's place"):
        free_space(pbcs_ompl.make(Fast()), 0.4)


@pytest.mark.parametrize(("cost", "expected"), [("stray_cost", "away"), ("crash_cost", "ended")])
def test_straying_and_crashing_cost_what_the_settings_say(cost: str, expected: str) -> None:
    """Two trainings that differ in a cost alone make the same first steps, and differ in these rewards alone."""
    model = pbcs_ompl.make("pbcs/PlanarQuadrotor-v0")
    kept: list[dict[str, Any]] = []
    for price in (0.0, 3.0):
        settings = RobotSettings().updated(QUADROTOR | {cost: price})
        training = RobotTraining(Worlds.of([model], settings.lines, SeedTree(0)), settings, PPOSettings(), 0)
        steps, inputs, sums = 200, training._inputs(training.walks), {"reward": 0.0, "away": 0.0, "ended": 0.0}
        advance = training._advance

        def watched(walks: Any, controls: Any, advance: Any = advance, sums: Any = sums,
                    training: Any = training) -> Any:
            found = advance(walks, controls)
            sums["ended"] += found[2].sum()
            sums["away"] += training._strayed().sum()
            return found

        training._advance = watched  # type: ignore[method-assign]
        for _ in range(steps):
            inputs, part = training._step(inputs)
            sums["reward"] += part[3].sum()
        kept.append(sums)
    free, costly = kept
    assert free[expected] == costly[expected] > 0
    assert free["reward"] - costly["reward"] == pytest.approx(3.0 * free[expected])


def test_training_and_test_lines_are_apart() -> None:
    models = [pbcs_ompl.make("pbcs/Maze-v0", world) for world in WORLDS]
    worlds = Worlds.of(models, RobotSettings().updated(POINT).lines, SeedTree(0))
    assert worlds.num_training == 60
    assert worlds.world_of.tolist() == sorted(worlds.world_of[:60].tolist()) + sorted(worlds.world_of[60:].tolist())
    training = {worlds.lines.points[k].tobytes() for k in range(60)}
    assert all(worlds.lines.points[k].tobytes() not in training for k in range(60, 75))


def test_a_full_pool_drops_the_oldest() -> None:
    pool = Pool.empty(5, 2)
    for first in (0, 3, 6):
        rows = np.arange(first, first + 3)
        pool.add(rows, np.stack([rows, rows], axis=1).astype(float), rows)
    assert (pool.size, pool.added) == (5, 9)
    drawn = pool.draw(200, np.random.default_rng(0))
    assert set(drawn.rows.tolist()) == {4, 5, 6, 7, 8}
    np.testing.assert_array_equal(drawn.states[:, 0], drawn.pointers)


def test_points_follow_lines_in_mazes_that_they_never_saw(trained: FollowerResult) -> None:
    assert trained.test_rate >= 0.9
    for seed in (21, 22):
        world = {"size": 5, "maze_seed": seed}
        assert evaluate_follower(trained.follower, "pbcs/Maze-v0", env_kwargs=world, episodes=5).success_rate == 1.0
        noisy = evaluate_follower(trained.follower, "pbcs/Maze-v0", env_kwargs=world, episodes=20, epsilon=0.1, seed=3)
        assert noisy.success_rate >= 0.8
        assert noisy.episodes == 20


def test_it_drives_along_a_plan(trained: FollowerResult) -> None:
    found = plan("pbcs/Maze-v0", "Ex", env_kwargs={"size": 4, "maze_seed": 9}, seed=1)
    assert found.trajectory is not None
    assert evaluate_follower(trained.follower, trajectory=found.trajectory, episodes=10).success_rate == 1.0


def test_a_pointer_that_waits_in_vain_goes_back(trained: FollowerResult) -> None:
    line = Line.through(np.array([[0.5, 0.5], [1.5, 0.5], [1.5, 1.5], [0.5, 1.5]]), 0.05)
    controller = trained.follower.controller(line)
    controller.progress.pointers[:] = line.last
    pointers = []
    for _ in range(LOST_AFTER + 2):
        controller.act(np.array([0.6, 0.5]))
        pointers.append(int(controller.progress.pointers[0]))
    assert set(pointers[:-1]) == {line.last}
    assert pointers[-1] == 2


def test_a_saved_follower_is_the_same_and_a_changed_one_is_refused(trained: FollowerResult, tmp_path: Path) -> None:
    trained.follower.save(tmp_path / "kept")
    again = RobotFollower.load(tmp_path / "kept")
    line = Line.through(np.array([[0.5, 0.5], [1.5, 0.5]]), 0.05)
    observation = np.array([0.5, 0.55])
    np.testing.assert_array_equal(again.controller(line).act(observation),
                                  trained.follower.controller(line).act(observation))
    assert again.training["transitions"] == trained.transitions
    words = json.loads((tmp_path / "kept/follower.json").read_text())
    (tmp_path / "kept/follower.json").write_text(json.dumps(words | {"window": 2.0}))
    with pytest.raises(DamagedFile, match="SHA-256"):
        RobotFollower.load(tmp_path / "kept")
    (tmp_path / "kept/follower.json").write_text(json.dumps(words))
    broken = bytearray((tmp_path / "kept/follower.safetensors").read_bytes())
    broken[-3] ^= 1
    (tmp_path / "kept/follower.safetensors").write_bytes(broken)
    with pytest.raises(DamagedFile, match="SHA-256"):
        RobotFollower.load(tmp_path / "kept")


def test_a_resumed_training_is_the_uninterrupted_one(tmp_path: Path) -> None:
    arguments = {"worlds": WORLDS[:1], "settings": POINT | {"test_transitions": 8000}, "agent_settings": AGENT}
    whole = train_follower("pbcs/Maze-v0", **arguments, max_transitions=45_000)
    first = train_follower("pbcs/Maze-v0", **arguments, max_transitions=28_000, out=tmp_path / "run")
    assert first.updates > 0
    resumed = resume_follower(tmp_path / "run", max_transitions=45_000)
    assert (resumed.transitions, resumed.updates) == (whole.transitions, whole.updates)
    assert resumed.updates > first.updates
    mine, theirs = resumed.follower.policy.to_arrays(), whole.follower.policy.to_arrays()
    for name in theirs:
        np.testing.assert_array_equal(mine[name], theirs[name])
    with pytest.raises(RunFolderError, match="already exists"):
        train_follower("pbcs/Maze-v0", **arguments, out=tmp_path / "run")


def test_worlds_keep_the_rest_of_the_task() -> None:
    """A state that resets are given is that of all bodies."""
    spec = pbcs_ompl.EnvSpec("pbcs/PlanarQuadrotor-v0", reset_options={"state": [3.0, 1.0, 0.2, 0.0, 0.0, 0.0]})
    worlds, settings = ({}, {"terminate_on_success": False}), RobotSettings().updated(QUADROTOR)
    training = _Run(spec, worlds, settings, PPOSettings(), 0, 10**6, None).training()
    assert (training.starts.standing[:, 2] == 0.2).all()
    assert [model.spec.kwargs for model in training.worlds.models] == [{}, {"terminate_on_success": False}]


def test_wrong_input_is_named(trained: FollowerResult) -> None:
    with pytest.raises(Mismatch, match="declares no robot"):
        train_follower("Pendulum-v1", settings=POINT)
    with pytest.raises(InvalidOption, match=r"goal and feature of .* would not be used"):
        train_follower(pbcs_ompl.EnvSpec("pbcs/Maze-v0", goal="obs[0]>1", feature="obs[0:2]"), settings=POINT)
    with pytest.raises(InvalidOption, match="worlds is empty"):
        train_follower("pbcs/Maze-v0", worlds=[])
    with pytest.raises(InvalidOption, match="'patience'"):
        train_follower("pbcs/Maze-v0", settings={"patence": 3})
    with pytest.raises(InvalidOption, match="stalled"):
        train_follower("pbcs/Maze-v0", settings={"standing": 0.9, "advanced": 0.9})
    with pytest.raises(Mismatch, match="observations or actions differ"):
        evaluate_follower(trained.follower, "pbcs/Maze-v0", env_kwargs={"normalize_actions": True})
    with pytest.raises(InvalidOption, match="expected an environment, or a plan"):
        evaluate_follower(trained.follower)
    with pytest.raises(InvalidOption, match="3 entries; expected the 2"):
        trained.follower.controller(Line(np.zeros((2, 2)), 0.1), entries=[0, 1, 2])
    with pytest.raises(InvalidOption, match="3 dimensions; expected 2"):
        trained.follower.controller(Line(np.zeros((2, 3)), 0.1))


@pytest.mark.parametrize("worlds", ['["evil:x"]', '["5"]', '[]', '["[[[["]'])
def test_worlds_of_a_config_that_was_changed(trained: FollowerResult, tmp_path: Path, worlds: str) -> None:
    assert trained.out is not None
    copy = Path(shutil.copytree(trained.out, tmp_path / "run"))
    config = read_toml(copy / "config.toml") | {"worlds": json.loads(worlds)}
    write_toml(copy / "config.toml", config)
    with pytest.warns(UserWarning, match="was changed"), pytest.raises(DamagedFile, match="worlds"):
        resume_follower(copy)


def test_the_command_line_trains_and_evaluates(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "run")
    settings = json.dumps(POINT | {"test_transitions": 8000, "lines_per_world": 5})
    train = ["train", "--method", "follow", "--lines", "random", "--env", "pbcs/Maze-v0"]
    assert main([*train, "--env-kwargs", '{"size": 3}', "--settings", settings, "--agent-settings",
                 json.dumps(AGENT), "--max-transitions", "19000", "--out", out, "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert 18_000 < summary["transitions"] <= 19_000
    assert main(["eval", out, "--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 3}', "--episodes", "3",
                 "--json"]) in (0, 1)
    assert json.loads(capsys.readouterr().out)["episodes"] == 3
    assert main(["report", str(tmp_path), "--json"]) == 0
    capsys.readouterr()
    assert main(["train", "--resume", out, "--max-transitions", "24000", "--json"]) == 0
    assert 19_000 < json.loads(capsys.readouterr().out)["transitions"] <= 24_000
    for wrong, message in ((["eval", out], "--path PLAN"), ([*train, "--agent", "td3"], "--agent says nothing"),
                           ([*train[:1], "--method", "pb", "--lines", "random", "--env", "pbcs/Maze-v0"],
                            "--method follow"),
                           ([*train[:1], "--env", "pbcs/Maze-v0", "--worlds", '[{"size": 3}]'], "--lines random")):
        assert main(wrong) == 2
        assert message in capsys.readouterr().err


@pytest.fixture(scope="module")
def ant_view() -> RobotView:
    pytest.importorskip("mujoco")
    model = pbcs_ompl.make("pbcs/AntMaze-v0", {"threads": 1})
    return RobotView(model.env.robot, ObservationTransform.identity(27), np.array([0.5, 1.5, 3.0]), 1.0, 30)


def test_an_ant_sees_the_same_whichever_way_it_walks(ant_view: RobotView) -> None:
    """The world and its line turned by any angle: the same inputs, and controls of the same motors after quarters."""
    model = pbcs_ompl.make("pbcs/AntMaze-v0", {"threads": 1})
    start = model.initial_state(3)[None]
    for angle in np.linspace(-3.0, 3.0, 9):
        seen = []
        for turn in (0.0, angle):
            states = ant_view.robot.put(start, np.zeros((1, 2)), np.array([turn]))
            c, s = np.cos(turn), np.sin(turn)
            corners = np.array([[0.0, 0.0], [2.0, 0.3], [4.0, 2.0]]) @ np.array([[c, s], [-s, c]])
            line, observations = Line.through(corners, 0.05), model.observe(states)
            progress = Progress.at(np.array([3]))
            sides = ant_view.leading(observations, line, progress, np.array([-1]))
            seen.append(ant_view.inputs(observations, line, progress, sides))
        np.testing.assert_allclose(*seen, atol=1e-12)


def test_the_side_that_looks_along_the_line_leads_and_keeps_leading(ant_view: RobotView) -> None:
    model = pbcs_ompl.make("pbcs/AntMaze-v0", {"threads": 1, "reset_noise": 0.0})
    state = ant_view.robot.put(model.initial_state(0)[None], np.zeros((1, 2)), np.zeros(1))
    observations, progress = model.observe(state), Progress.at(np.zeros(1, dtype=np.int64))
    ways = [Line.through(np.array([[0.0, 0.0], [5 * np.cos(a), 5 * np.sin(a)]]), 0.05)
            for a in np.linspace(0, 2 * np.pi, 73)[:-1]]
    first = [int(ant_view.leading(observations, way, progress, np.array([-1]))[0]) for way in ways]
    assert [first[k] for k in (0, 18, 36, 54)] == [0, 1, 2, 3]
    kept = [int(ant_view.leading(observations, way, progress, np.array([0]))[0]) for way in ways]
    angles = np.abs(np.angle(np.exp(1j * np.linspace(0, 2 * np.pi, 73)[:-1])))
    np.testing.assert_array_equal(np.array(kept) == 0, angles <= KEEP_SIDE + 1e-9)
    controls = ant_view.controls(np.arange(8.0)[None], np.array([2]))
    np.testing.assert_array_equal(np.sort(np.abs(controls[0])), np.arange(8.0))


@pytest.mark.parametrize("budget", [25_000, 31_000])
def test_the_budget_binds(budget: int) -> None:
    arguments = {"worlds": WORLDS[:1], "settings": POINT | {"test_transitions": 8000}, "agent_settings": AGENT}
    with pytest.raises(InvalidOption, match="expected at least"):
        train_follower("pbcs/Maze-v0", **arguments, max_transitions=100)
    assert budget - 5_000 < train_follower("pbcs/Maze-v0", **arguments, max_transitions=budget).transitions <= budget


def test_plan_lets_a_follower_drive_along_the_smoothed_plan(trained: FollowerResult, tmp_path: Path,
                                                            capsys: pytest.CaptureFixture[str]) -> None:
    out, env = str(tmp_path / "plan"), ["--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 3}', "--no-pictures"]
    follow = ["--follow", str(trained.out), "--episodes", "7", "--epsilon", "0.1", "--json"]
    assert main(["plan", *env, "--planner", "Rides", "--out", out, *follow]) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)["followed"]
    assert (found["episodes"], found["epsilon"]) == (7, 0.1)
    assert found["success_rate"] > 0.5
    assert "followed" in printed.err


@pytest.mark.parametrize(("words", "complaint"), [
    (["--episodes", "3"], "add --follow"),
    (["--follow", "nowhere"], "nowhere"),
    (["--follow", "ant"], "not for that of"),
])
def test_a_follower_that_does_not_fit_is_refused_before_planning(words: list[str], complaint: str, tmp_path: Path,
                                                                 capsys: pytest.CaptureFixture[str]) -> None:
    if "ant" in words:
        pytest.importorskip("mujoco")
    out = tmp_path / "plan"
    assert main(["plan", "--env", "pbcs/Maze-v0", "--out", str(out), *words]) == 2
    assert complaint in capsys.readouterr().err
    assert not out.exists()
