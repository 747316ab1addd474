"""A chain acts as one policy, and what is saved is what is loaded."""

import json

import gymnasium
import numpy as np
import pytest

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, Mismatch, UnknownName
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.skills.activation_sets import Ball, EnvironmentGoal
from pbcs_ompl.skills.chain import Skill, SkillChain
from pbcs_ompl.skills.evaluation import evaluate
from pbcs_ompl.skills.observed_sets import Entry, ObservedBall
from pbcs_ompl.skills.policy import ObservationTransform, SkillPolicy

MODEL = make("pbcs/Maze-v0", {"size": 2})
TURNS = [[0.5, 0.5], [1.5, 0.5], [1.5, 1.5]]
ENDS = [*TURNS[1:], [0.5, 1.5]]


def towards(point):
    """A policy that walks straight to `point`: one linear layer and the tanh."""
    actor = Policy(((-4 * np.eye(2, dtype=np.float32), np.zeros(2, np.float32)),), MODEL.action_low, MODEL.action_high)
    return SkillPolicy(actor, ObservationTransform(np.array(point), np.ones(2)))


def round_the_corner():
    """The hand-made chain of the 2x2 maze: right, up, left."""
    targets = [Ball(np.array(ENDS[0]), 0.15), Ball(np.array(ENDS[1]), 0.15), EnvironmentGoal(MODEL.goal_threshold)]
    entries = [Entry(), *(Entry((ObservedBall(np.array(turn), np.ones(2), 0.15),)) for turn in TURNS[1:])]
    skills = tuple(Skill(towards(end), Ball(np.array(start), 0.15), target, entry)
                   for start, end, target, entry in zip(TURNS, ENDS, targets, entries, strict=True))
    return SkillChain(skills, np.array(TURNS[0]), MODEL.spec, 200, ActionMap.of(MODEL.env.action_space), 0)


def test_the_chain_walks_round_the_corners():
    states = round_the_corner().rollout(MODEL)
    assert MODEL.goal_distance(states[-1:])[0] < MODEL.goal_threshold
    assert len(states) < 60


def test_a_batch_of_executions_equals_single_ones():
    chain, rng = round_the_corner(), np.random.default_rng(0)
    starts = rng.uniform(0.3, 0.7, (12, 2))
    together = chain.rollouts(MODEL, starts)
    for index, start in enumerate(starts):
        alone = chain.rollouts(MODEL, start[None])
        assert alone.success[0] == together.success[index]
        assert alone.steps[0] == together.steps[index]
    np.testing.assert_array_equal(together.states, chain.rollout(MODEL, starts[0]))


def test_the_controller_never_goes_back_and_may_skip():
    controller = round_the_corner().controller()
    controller.reset()
    for state, expected in ((TURNS[0], 0), (TURNS[2], 2), (TURNS[1], 2), (TURNS[0], 2)):
        assert controller.act(np.array(state)) in MODEL.env.action_space
        assert controller.current.tolist() == [expected]
    controller.reset()
    assert controller.current.tolist() == [0]


def test_the_controller_and_the_judge_need_no_model():
    env = gymnasium.make("pbcs/Maze-v0", size=2)
    controller, (observation, info), steps = round_the_corner().controller(), env.reset(seed=5), 0
    while not info["is_success"] and steps < 100:
        observation, _, _, _, info = env.step(controller.act(observation))
        steps += 1
    assert evaluate(round_the_corner(), episodes=1).steps_median == steps
    assert MODEL.goal_distance(observation[None])[0] < MODEL.goal_threshold


def test_the_time_limit_ends_an_execution():
    rollouts = round_the_corner().rollouts(MODEL, np.array([[0.5, 0.5]]), max_steps=5)
    assert not rollouts.success[0]
    assert rollouts.steps[0] == 5
    assert len(rollouts.states) == 6


def test_saving_and_loading_changes_nothing(tmp_path):
    chain = round_the_corner()
    chain.save(tmp_path / "chain")
    loaded = SkillChain.load(tmp_path / "chain")
    assert (loaded.environment, loaded.time_limit) == (chain.environment, chain.time_limit)
    for mine, theirs in zip(chain.skills, loaded.skills, strict=True):
        np.testing.assert_array_equal(mine.activation.center, theirs.activation.center)
        assert type(mine.target) is type(theirs.target)
        assert mine.target.radius == theirs.target.radius
    starts = np.random.default_rng(0).uniform(0.3, 0.7, (5, 2))
    rng = np.random.default_rng
    np.testing.assert_array_equal(chain.rollouts(MODEL, starts, epsilon=0.3, rng=rng(1)).states,
                                  loaded.rollouts(MODEL, starts, epsilon=0.3, rng=rng(1)).states)


@pytest.mark.parametrize("name", ["chain.json", "chain.npz", "chain.safetensors"])
@pytest.mark.parametrize("harm", ["missing", "truncated", "empty"])
def test_a_damaged_chain_is_named(tmp_path, name, harm):
    round_the_corner().save(tmp_path)
    path = tmp_path / name
    whole = path.read_bytes()
    path.write_bytes({"truncated": whole[:len(whole) // 2], "empty": b""}.get(harm, b""))
    if harm == "missing":
        path.unlink()
    with pytest.raises(DamagedFile, match=name):
        SkillChain.load(tmp_path)


@pytest.mark.parametrize("change", [{"version": 99}, {"format": "something else"}])
def test_another_format_is_refused(tmp_path, change):
    round_the_corner().save(tmp_path)
    words = json.loads((tmp_path / "chain.json").read_text()) | change
    (tmp_path / "chain.json").write_text(json.dumps(words))
    with pytest.raises(DamagedFile):
        SkillChain.load(tmp_path)


def test_evaluation_counts_and_bounds():
    evaluation = evaluate(round_the_corner(), MODEL, episodes=40, epsilon=0.1, seed=3)
    assert evaluation.episodes == 40
    assert evaluation.wilson[0] <= evaluation.success_rate <= evaluation.wilson[1]
    assert evaluation == evaluate(round_the_corner(), MODEL, episodes=40, epsilon=0.1, seed=3)
    with pytest.raises(InvalidOption, match="episodes"):
        evaluate(round_the_corner(), MODEL, episodes=0)
    with pytest.raises(InvalidOption, match="epsilon"):
        evaluate(round_the_corner(), MODEL, epsilon=1.2)
    with pytest.raises(Mismatch, match="trained in"):
        evaluate(round_the_corner(), make("pbcs/Maze-v0", {"size": 3}))


@pytest.mark.parametrize(("env", "options"), [
    (None, {}), ("pbcs/Maze-v0", {"env_kwargs": {"size": 2}}), (EnvSpec("pbcs/Maze-v0", {"size": 2}), {}),
    (gymnasium.make("pbcs/Maze-v0", size=2), {}), (MODEL, {})])
def test_an_environment_is_given_in_any_form(env, options):
    chain = round_the_corner()
    assert evaluate(chain, env, episodes=3, epsilon=0.1, **options) == evaluate(chain, MODEL, episodes=3, epsilon=0.1)


@pytest.mark.parametrize("controller", [None, "runs/demo", 3, MODEL, []])
def test_what_is_not_a_chain_is_refused(controller):
    with pytest.raises(InvalidOption, match="expected a SkillChain"):
        evaluate(controller)


def test_options_need_an_environment():
    with pytest.raises(InvalidOption, match="env is None"):
        evaluate(round_the_corner(), env_kwargs={"size": 2})
    with pytest.raises(UnknownName, match="did you mean 'pbcs/Maze-v0'"):
        evaluate(round_the_corner(), "pbcs/Mase-v0")
