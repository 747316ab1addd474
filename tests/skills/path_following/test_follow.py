"""Path following: it solves a maze, resumes bit for bit, splits where a policy fails, and refuses what it cannot do."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pbcs_ompl
from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.cli import main
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, InvalidState, Mismatch
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.skills import load_chain, method_settings
from pbcs_ompl.skills.agent_interface import load_agent
from pbcs_ompl.skills.criterion import Outcome, judged
from pbcs_ompl.skills.evaluation import Evaluation
from pbcs_ompl.skills.method import Snapshot
from pbcs_ompl.skills.path_following.chain import FollowChain
from pbcs_ompl.skills.path_following.follow import Follow
from pbcs_ompl.skills.path_following.follower import Progress, Relay
from pbcs_ompl.skills.path_following.settings import FollowSettings
from pbcs_ompl.skills.path_following.shown_feature import observes_feature
from pbcs_ompl.skills.path_following.task import FollowTask, LineSettings, Position, around_last_progress, extended
from pbcs_ompl.skills.path_following.verdict import Trouble, Verdict
from pbcs_ompl.skills.train_result import TrainResult
from pbcs_ompl.skills.trainer import SkillTrainer
from pbcs_ompl.skills.waypoints import Waypoints

MAZE: dict[str, Any] = {"size": 2}
MODEL = make("pbcs/Maze-v0", MAZE)


@pytest.fixture(scope="module")
def plan() -> Trajectory:
    found = pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs=MAZE, seed=0).trajectory
    assert found is not None
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("follow") / "run"
    result = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, method="follow", seed=0, out=out)
    assert result.solved, result.reason
    assert result.chain is not None
    assert result.chain.num_policies == result.summary()["skills"] >= 1
    return out


def method(states: np.ndarray, settings: FollowSettings | None = None, budget: int = 100_000) -> Follow:
    chosen = settings or method_settings("follow")
    assert isinstance(chosen, FollowSettings)
    kind, spaces = load_agent("ddpg"), chosen.agent_spaces(MODEL)
    agent = kind.settings_type.from_preset("fast")
    trainer = SkillTrainer(lambda seed, horizon=1.0: kind(*spaces, settings=agent, seeds=(seed,), device="cpu"),
                           Waypoints.of_plan(states, MODEL, chosen), chosen.episodes, Counter(budget),
                           np.random.default_rng(0))
    return Follow(trainer, chosen)


def trained(plan: Trajectory, **options: Any) -> TrainResult:
    return pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, trajectory=plan, method="follow", seed=0, **options)


def test_training_continues_where_the_judge_refuses_what_passed(plan: Trajectory, tmp_path: Path,
                                                                monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = list[int]()

    def strict(chain: Any, trajectory: Any, model: Any, criterion: Any, seed: int) -> Outcome:
        seeds.append(seed)
        outcome = judged(chain, trajectory, model, criterion, seed)
        return outcome._replace(reason="refused", transitions=1000) if seed == 0 else outcome

    once = trained(plan)
    monkeypatch.setattr("pbcs_ompl.skills.training.judged", strict)
    result = trained(plan)
    assert (once.solved, result.solved, result.complete) == (True, True, True)
    assert len(set(seeds)) == len(seeds) == 2  # each judge has random actions of its own
    assert result.train_transitions > once.train_transitions + 1000
    refused = trained(plan, max_transitions=once.train_transitions + 900)  # too few for the judge's executions
    assert (refused.solved, refused.complete, refused.reason) == (False, True, "refused")
    stopped = trained(plan, max_transitions=result.train_transitions - 1, out=tmp_path / "run")
    assert not stopped.complete
    resumed = pbcs_ompl.resume(tmp_path / "run", max_transitions=result.train_transitions)
    assert (resumed.solved, resumed.train_transitions) == (True, result.train_transitions)
    assert resumed.robust == result.robust


@pytest.mark.parametrize("believed", [None, 1.0])
def test_training_ends_where_there_is_no_judge_or_the_model_is_untrue(plan: Trajectory, believed: float | None,
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    asked = list[int]()
    robust = None if believed is None else Evaluation(0.5, (0.4, 0.6), 100, 20.0, 0.1)

    def judge(chain: Any, trajectory: Any, model: Any, criterion: Any, seed: int) -> Outcome:
        asked.append(seed)
        return Outcome("no", None, robust, believed)

    monkeypatch.setattr("pbcs_ompl.skills.training.judged", judge)
    result = trained(plan)
    assert (result.solved, result.reason, asked) == (False, "no", [0])


def test_a_saved_follower_acts_as_the_one_that_was_saved(folder: Path, tmp_path: Path) -> None:
    loaded = load_chain(folder / "chain")
    assert isinstance(loaded, FollowChain)
    loaded.save(tmp_path / "again")
    for chain in (loaded, FollowChain.load(tmp_path / "again")):
        found = pbcs_ompl.evaluate(chain, episodes=20, epsilon=0.1)
        assert found.success_rate >= 0.9
    np.testing.assert_array_equal(loaded.rollout(MODEL), FollowChain.load(tmp_path / "again").rollout(MODEL))


def test_the_commands_take_it_as_they_take_a_chain(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    train = ["train", "--method", "follow", "--env", "pbcs/Maze-v0", "--env-kwargs", '{"size": 2}', "--out", "run"]
    assert main(train) == 0
    assert (tmp_path / "run" / "chain.png").stat().st_size > 5000
    assert main(["eval", "run", "--epsilon", "0.1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.strip().splitlines()[-1])["success_rate"] > 0.9
    assert main(["report", "run"]) == 0


def test_a_changed_follower_is_found_and_one_method_reads_not_the_other(folder: Path, tmp_path: Path) -> None:
    load_chain(folder / "chain").save(tmp_path)
    with pytest.raises(DamagedFile, match=r"that of a follower, not of a skill chain; read it with .*load_chain"):
        pbcs_ompl.SkillChain.load(tmp_path)
    arrays = (tmp_path / "chain.npz").read_bytes()
    (tmp_path / "chain.npz").write_bytes(arrays[:-1] + bytes([arrays[-1] ^ 1]))
    with pytest.raises(DamagedFile, match="SHA-256"):
        load_chain(tmp_path)


def test_resuming_gives_the_same_bits(plan: Trajectory) -> None:
    strict = FollowSettings().updated({"attempts": 2, "session_lengths": 1, "test_epsilon": 0.9})  # no policy passes
    whole, first, second = (method(plan.states, strict) for _ in range(3))
    for _ in range(5):
        whole.step()
        first.step()
    before = first.snapshot()
    second.restore(Snapshot(before.plain, {name: array.copy() for name, array in before.arrays.items()}))
    for _ in range(4):
        whole.step()
        second.step()
    one, two = whole.snapshot(), second.snapshot()
    assert one.plain == two.plain
    assert one.arrays.keys() == two.arrays.keys()
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(array, two.arrays[name], err_msg=name)


def test_a_plan_that_moves_do_not_make_shorter_is_searched_for_further() -> None:
    """A car turns on circles: making the plan of Rides shorter saves nothing, and RidesSST finds a shorter one."""
    found = pbcs_ompl.train("pbcs/CarPark-v0", method="follow", seed=4, max_transitions=8000)
    short = pbcs_ompl.train("pbcs/CarPark-v0", method="follow", seed=4, max_transitions=3000,
                            settings={"search_on": 0.0})
    assert found.trajectory is not None
    assert short.trajectory is not None
    assert (found.trajectory.planner, short.trajectory.planner) == ("RidesSST", "Rides")
    assert found.trajectory.length < short.trajectory.length
    first = short.plan_transitions / 1.5
    assert found.plan_transitions == pytest.approx(4.5 * first, abs=3)


def test_a_crash_costs_what_the_goal_is_worth() -> None:
    model = make("pbcs/PlanarQuadrotor-v0")
    states = np.array([model.initial_state(0)] * 3)
    states[1:, 0] += [0.1, 0.2]
    settings = FollowSettings().updated({"effort_cost": 0.0, "progress_reward": 1e-9, "success_reward": 7.0})
    kind, spaces = load_agent("ddpg"), settings.agent_spaces(model)
    trainer = SkillTrainer(lambda seed, horizon=1.0: kind(*spaces, settings=kind.settings_type.from_preset("fast"),
                                                          seeds=(seed,), device="cpu"),
                           Waypoints.of_plan(states, model, settings), settings.episodes, Counter(20_000),
                           np.random.default_rng(0))
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    add = trainer.agent.add_transitions
    trainer.agent.add_transitions = lambda *rows: (seen.append(rows[2:5:2]), add(*rows))  # type: ignore
    Follow(trainer, settings).step()
    rewards, terminals = (np.concatenate([rows[part][0] for rows in seen]) for part in (0, 1))
    assert set(np.rint(rewards[terminals]).tolist()) >= {-7.0}
    np.testing.assert_allclose(rewards[~terminals], 0.0, atol=1e-6)


def test_the_budget_binds_and_a_larger_one_continues(tmp_path: Path) -> None:
    planned = pbcs_ompl.plan("pbcs/Maze-v0", env_kwargs=MAZE, seed=0).trajectory
    short = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, trajectory=planned, method="follow", seed=0,
                            max_transitions=700, out=tmp_path / "run")
    assert (short.complete, short.solved) == (False, False)
    assert short.train_transitions <= 700
    assert "of the line" in str(short.reason)
    assert short.chain is not None
    longer = pbcs_ompl.skills.resume(tmp_path / "run", max_transitions=200_000)
    whole = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, trajectory=planned, method="follow", seed=0,
                            max_transitions=200_000)
    assert longer.solved
    assert longer.updates == whole.updates
    assert longer.chain is not None
    assert whole.chain is not None
    np.testing.assert_array_equal(longer.chain.rollout(MODEL), whole.chain.rollout(MODEL))


def test_after_its_attempts_the_best_policy_is_kept_from_where_it_passes(plan: Trajectory,
                                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    following = method(plan.states, FollowSettings().updated({"attempts": 2, "session_lengths": 1}))
    following.state.rounds = 1
    passes_from = following.task.line.last // 2
    tried: list[int] = []

    def verdict(self: Follow, policy: Any, first: int, stress: float = 1.0) -> Verdict:
        tried.append(first)
        return Verdict(first >= passes_from, 0.5, first + 10)

    monkeypatch.setattr(Follow, "_try", verdict)
    while not following.members:
        following.step()
    assert tried[:2] == [0, 0]
    assert tried[2:] == sorted(set(tried[2:]))
    assert following.members[0].first == tried[-1] == following.state.end
    assert tried[-2] < passes_from <= tried[-1]
    assert 0 < following.covered < 1
    assert (following.task.pointers[following.task.place(following.state.end)] >= following.state.end)
    restored = method(plan.states)
    restored.restore(following.snapshot())
    assert [member.first for member in restored.members] == [following.state.end]
    monkeypatch.setattr(Follow, "_try", lambda self, policy, first, stress: Verdict(True, 1.0, 0))
    while not following.done:
        following.step()
    chain = following.chain(100)
    assert chain.firsts == (0, following.members[1].first)
    assert (following.covered, chain.num_policies) == (1.0, 2)


def test_a_policy_that_passes_nowhere_begins_again(plan: Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    following = method(plan.states, FollowSettings().updated({"attempts": 1, "session_lengths": 1}))
    last = following.task.line.last
    monkeypatch.setattr(Follow, "_try", lambda self, policy, first, stress=1.0: Verdict(False, 0.0, last))
    agent = following.trainer.agent
    for _ in range(4):
        following.step()
    assert following.trainer.agent is not agent
    assert (following.members, following.state.end, following.state.tests) == ([], last + 1, 0)
    sessions = method(plan.states, following.settings)._session_transitions
    assert following._session_transitions == 2 * sessions


def test_starts_lie_all_along_the_plan_before_the_end(plan: Trajectory) -> None:
    following = method(plan.states)
    following.state.end = following.task.line.last // 2
    begun = following._fresh(500)
    assert begun.progress.pointers.max() < following.state.end
    assert len(np.unique(begun.progress.pointers)) > 5
    first = (begun.states == plan.states[0]).all(axis=1).mean()
    assert 0.05 < first < 0.4


def test_the_line_is_in_steps_of_the_plan_and_policies_see_it_in_the_observation(plan: Trajectory) -> None:
    task = FollowTask.of(MODEL, plan.states, LineSettings())
    np.testing.assert_allclose(task.line.points[0] * task.view.unit, plan.states[0])
    end = task.line.points[task.pointers[-1]]
    np.testing.assert_allclose(end * task.view.unit, plan.states[-1], atol=0.5 * task.line.spacing * 0.1)
    assert (task.line.last - task.pointers[-1]) * task.line.spacing == pytest.approx(4.0, abs=0.5)
    assert (np.diff(task.pointers) >= 0).all()
    assert task.hops < plan.length
    position = task.at(np.arange(plan.length))
    seen = task.inputs(position)
    assert np.abs(seen[:, :2].mean(axis=0)).max() < 0.2
    assert seen.shape == (plan.length, task.view.size)
    assert task.view.size == FollowSettings().agent_spaces(MODEL).observation_size
    tail = task.line.ahead(task.view.features(position.observations), np.full(plan.length, task.line.last),
                           task.view.distances)
    np.testing.assert_array_equal(tail[:, 0], tail[:, 2])


def test_a_line_continues_in_the_direction_in_which_the_plan_ends() -> None:
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5]])
    np.testing.assert_allclose(extended(corners, 4.0), [*corners, [1.0, 4.5]])
    still = np.zeros((2, 2))
    np.testing.assert_array_equal(extended(still, 4.0), still)


def test_what_policies_see_of_an_angle_does_not_jump() -> None:
    """A car turns by nearly a whole turn: whether it counts turns or not, the line leads on, and the policy sees it."""
    model = make("pbcs/CarPark-v0", {"obstacles": [], "start": [4.0, 4.0, 2.0]})
    states = [model.initial_state(0)[None]]
    for step in range(55):
        states.append(model.transition(states[-1], np.array([[float(step < 4), 1.0]])).states)
    plan = np.concatenate(states)
    assert np.abs(np.diff(plan[:, 2])).max() > 6.0
    task = FollowTask.of(model, plan, LineSettings())
    seen = task.inputs(task.at(np.arange(len(plan))))
    assert np.abs(np.diff(seen, axis=0))[5:].max() < 0.6
    assert np.abs(seen[:, 6:-1]).max() < 10.0
    turned = plan + 2.0 * np.pi * np.eye(4)[2]
    position = task.at(np.arange(len(plan)))
    other = Position(turned, model.observe(turned), position.progress)
    np.testing.assert_allclose(task.inputs(other), task.inputs(position), atol=1e-9)
    moved = task.line.advance(task.view.features(other.observations), position.progress.pointers, 4.0)
    np.testing.assert_array_equal(
        moved, task.line.advance(task.view.features(position.observations), position.progress.pointers, 4.0))


def of_no_entry(outcome: Any) -> np.ndarray:
    """The feature is the angle of a pendulum to the third power."""
    return np.array([outcome.env.state[0] ** 3, outcome.env.state[1]])


def swung(feature: Any = None) -> tuple[Any, np.ndarray]:
    """A pendulum, and states of it under full torque."""
    pendulum = make("Pendulum-v1", feature=feature)
    states = [pendulum.initial_state(0)[None]]
    for _ in range(60):
        states.append(pendulum.transition(states[-1], pendulum.action_high[None]).states)
    return pendulum, np.concatenate(states)


def test_a_feature_that_is_not_observed_is_refused() -> None:
    pendulum, states = swung(of_no_entry)
    assert not observes_feature(pendulum)
    with pytest.raises(Mismatch, match=r"Pendulum-v1: dimension 0 of the feature is no entry of the observation.*"
                                       r"--feature 'obs\[0:3\]'"):
        FollowTask.of(pendulum, states, LineSettings())


def test_an_angle_without_a_period_is_followed_within_a_turn() -> None:
    """The soft limits of the elbow let it pass half a turn, where its sine changes sign: the line continues there."""
    arm = make("Reacher-v5")
    states, push = [arm.initial_state(0)[None]], np.array([[0.0, 1.0]])
    for _ in range(40):
        states.append(arm.transition(states[-1], push).states)
    elbow = arm.feature(np.concatenate(states))[:, 1]
    assert arm.feature_periods[1] == 0.0
    assert np.abs(elbow).max() > np.pi
    task = FollowTask.of(arm, np.concatenate(states[:int(np.abs(elbow).argmax()) + 1]), LineSettings())
    along = task.line.points[:, 1] * task.view.unit[1]
    assert np.abs(np.diff(along)).max() < 0.5
    assert np.abs(along).max() > np.pi


def test_an_angle_is_observed_by_its_cosine_and_sine() -> None:
    pendulum, states = swung()
    assert observes_feature(pendulum)
    task = FollowTask.of(pendulum, states, LineSettings())
    away = task.view.shown(pendulum.observe(states)) - pendulum.feature(states)
    np.testing.assert_allclose(np.sin(away), 0.0, atol=1e-5)
    assert (np.cos(away) > 0).all()
    position = task.at(np.arange(len(states)))
    normal = task.view.normaliser
    np.testing.assert_allclose(task.inputs(position)[:, :3], (position.observations - normal.origin) / normal.scale)


def test_a_plan_through_a_terminal_state_is_refused(plan: Trajectory) -> None:
    """The goal ends episodes, so a plan that passes through it has steps that no episode has."""
    back = MODEL.transition(plan.states[-1:], -plan.controls[-1:])
    longer = replace(plan, states=np.concatenate([plan.states, back.states]), rewards=np.append(plan.rewards, 0.0),
                     actions=np.concatenate([plan.actions, -plan.actions[-1:]]))
    with pytest.raises(InvalidState, match=f"state {plan.length} of the plan is in the goal.*cut it off there"):
        pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, trajectory=longer, method="follow", seed=0)


def test_a_start_in_the_goal_needs_no_policy() -> None:
    result = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs={"size": 2, "start": [0.5, 1.5]}, method="follow", seed=0)
    assert (result.solved, result.chain, result.train_transitions) == (True, None, 0)


def test_a_checkpoint_of_another_method_is_refused(plan: Trajectory, tmp_path: Path) -> None:
    out = tmp_path / "run"
    pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, trajectory=plan, method="pb", seed=0, max_transitions=3_000,
                    out=out)
    config = out / "config.toml"
    config.write_text(config.read_text().replace('method = "pb"', 'method = "follow"'))
    with pytest.raises(DamagedFile):
        pbcs_ompl.skills.resume(out, max_transitions=10_000)


@pytest.mark.parametrize("changes", [{"spacing": 0.0}, {"look_ahead": -1.0}, {"window": 0.0}, {"patience": 0},
                                     {"attempts": 0}, {"action_noise": -0.1}, {"start_fraction": 1.5}])
def test_settings_out_of_range_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(InvalidOption, match=next(iter(changes))):
        method_settings("follow", changes=changes)


def test_other_agents_follow_too() -> None:
    result = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs=MAZE, method="follow", agent="td3", seed=0,
                             max_transitions=4_000)
    assert result.updates > 0
    assert result.chain is not None
    assert result.chain.num_policies >= 1


def test_executions_that_fail_are_tried_again_from_around_their_last_progress(plan: Trajectory) -> None:
    """Against a plain loop over each execution."""
    task = FollowTask.of(MODEL, plan.states, LineSettings())
    rng, reach = np.random.default_rng(0), 2
    stalls = np.array([[0, 0, 1, 0, 1, 2, 3, 4], [0, 1, 2, 3, 4, 5, 6, 7], [0, 0, 0, 0, 0, 0, 0, 0]])
    failed, lengths = np.array([True, True, False]), [8, 4, 8]
    trail = []
    for step in range(8):
        alive = np.flatnonzero(np.array(lengths) > step)
        begun = task.at(rng.integers(0, plan.length, len(alive)))
        trail.append((alive, Position(begun.states, begun.observations,
                                      Progress(begun.progress.pointers, stalls[alive, step]))))
    expected, members = [], []
    for step, (alive, position) in enumerate(trail):
        for row, member in enumerate(alive):
            last = max(index for index in range(lengths[member]) if stalls[member, index] == 0)
            if failed[member] and abs(step - last) <= reach:
                expected.append((*position.states[row], position.progress.pointers[row]))
                members.append(member)
    found, before = around_last_progress(trail, failed, reach)
    assert [(*state, pointer) for state, pointer in zip(found.states, found.progress.pointers, strict=True)] == expected
    assert not found.progress.stalled.any()
    first = {member: row for row, member in reversed(list(enumerate(members)))}
    np.testing.assert_array_equal(before.states, found.states[[first[0], first[1]]])


def test_a_refused_policy_is_trained_where_it_failed(plan: Trajectory) -> None:
    following = method(plan.states, FollowSettings().updated({"retry_fraction": 1.0, "session_lengths": 1}))
    following.step()
    assert following._retries is None
    start = following.task.at(np.array([0]))[np.zeros(3, dtype=np.int64)]
    beyond = np.full(3, following.task.line.last + 1)
    still = replace(following._present(), action_low=np.zeros(2), action_high=np.zeros(2))
    found = following._failures(Relay([still], [0]), start, beyond, 0.0)
    assert len(found.before.states) == len(found.ends) == 3
    assert following._retries is not None
    places = {tuple(state) for state in following._retries.states}
    assert {tuple(state) for state in following._fresh(50).states} <= places
    again = method(plan.states)
    again.restore(following.snapshot())
    assert again._retries is not None
    np.testing.assert_array_equal(again._retries.states, following._retries.states)


def test_a_policy_is_refused_where_the_last_one_failed_without_an_execution_of_the_whole_line(
        plan: Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Executions fail in the middle of the line until `learnt`."""
    following = method(plan.states)
    task, begun, learnt = following.task, list[int](), [False]
    middle = task.line.last // 2

    def failures(self: Follow, relay: Relay, starts: Position, until: np.ndarray, epsilon: float) -> Trouble:
        begun.extend(starts.progress.pointers.tolist())
        fail = (until > middle) & (not learnt[0]) & (epsilon > 0)
        shortly_before = task.at(np.full(fail.sum(), task.place(middle - 5)))
        return Trouble(shortly_before, np.full(fail.sum(), middle))

    monkeypatch.setattr(Follow, "_failures", failures)
    assert following._try(following._present(), 0) == Verdict(False, 0.0, middle)
    assert set(begun) == {0}
    begun.clear()
    assert not following._try(following._present(), 0).passed
    assert begun.count(0) == 1  # without noise
    assert set(begun[1:]) == {task.pointers[task.place(middle - 5)]}
    restored = method(plan.states)
    restored.restore(following.snapshot())
    begun.clear()
    learnt[0] = True
    assert restored._try(following._present(), 0).passed
    assert {0, task.pointers[task.place(middle - 5)]} == set(begun)


def test_a_test_ends_where_the_environment_ends_an_episode(plan: Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    follow = method(plan.states)
    longest = follow.longest_step
    monkeypatch.setattr(follow.trainer.model, "max_episode_steps", 7)
    assert follow.longest_step == (follow.settings.gate.most_trials + 1) * 7 < longest
    start = follow.task.at(np.array([0]))
    before = follow.trainer.counter.count
    follow._failures(Relay([follow._average], [0]), start, np.array([follow.task.line.last + 1]), 0.0)
    assert follow.trainer.counter.count - before <= 7


def test_a_session_takes_its_share_of_the_test_before(plan: Trajectory) -> None:
    following = method(plan.states, FollowSettings().updated({"test_share": 0.5, "session_lengths": 1}))
    shortest = following._session_transitions
    following.state.tested = 10 * shortest
    assert following._session_transitions == 5 * shortest


def test_a_new_policy_is_tested_under_stress_and_after_its_attempts_the_best_one_without(
        plan: Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Executions fail where there is more noise than the criterion has."""
    settings = method_settings("follow").updated({"attempts": 2, "stress": 3.0})
    following, noise = method(plan.states, settings), list[float]()
    usual = following.trainer.settings.test_epsilon

    def failures(self: Follow, relay: Relay, starts: Position, until: np.ndarray, epsilon: float) -> Trouble:
        noise.append(epsilon)
        lost = np.flatnonzero(np.full(len(until), epsilon > usual))
        return Trouble(starts[lost], starts.progress.pointers[lost])

    monkeypatch.setattr(Follow, "_failures", failures)
    monkeypatch.setattr(Follow, "_train_step", lambda self: None)
    while not following.done:
        following.step()
    assert following.state.tests == 2
    assert following.covered == 1.0
    assert [member.first for member in following.members] == [0]
    stressed = [epsilon > usual for epsilon in noise if epsilon > 0]
    assert max(noise) == pytest.approx(3.0 * usual)
    assert stressed.index(False) == sum(stressed) >= 2
    with pytest.raises(InvalidOption, match="refused_rate"):
        FollowSettings().updated({"stress": 20.0})
