"""A learnt activation set: it leaves out where the skill fails, is bounded, repeatable, and survives a file."""

import numpy as np
import pytest

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.errors import DamagedFile, InvalidOption
from pbcs_ompl.core.types import Counter
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.skills import SkillChain, resume, train
from pbcs_ompl.skills.activation_sets import (
    Ball,
    ClassifierSet,
    ClassifierSettings,
    EnvironmentGoal,
    from_arrays,
    kind_of,
    learn_set,
    to_arrays,
)
from pbcs_ompl.skills.chain import Skill
from pbcs_ompl.skills.episodes import run_episodes
from pbcs_ompl.skills.observed_sets import Entry, ObservedBall, ObservedClassifier
from pbcs_ompl.skills.pbcs import PBCSSettings
from pbcs_ompl.skills.policy import ObservationTransform, SkillPolicy

MODEL = make("pbcs/Maze-v0", {"size": 2})
CENTER, RADIUS = np.array([1.0, 0.9]), 0.15
BALL, SETTINGS = Ball(CENTER, RADIUS), ClassifierSettings()
TARGET = Ball(np.array([0.9, 1.2]), 0.1)


def straight_up(states):
    """A policy that walks to TARGET; a wall along y = 1 ends near x = 1, and to the left of that it stops the walk."""
    return np.clip(TARGET.center - states, -0.1, 0.1)


def tried(count, seed):
    """States around CENTER and whether the policy reaches TARGET from them."""
    rng = np.random.default_rng(seed)
    states = MODEL.perturb(CENTER, SETTINGS.reach * RADIUS, count, rng)
    return states, run_episodes(MODEL, straight_up, TARGET, states, epsilon=0.0, max_steps=30, rng=rng,
                                success_reward=None, counter=Counter()).reached


def learnt():
    states, reached = tried(400, 0)
    return learn_set(MODEL.observe(states), reached, BALL, SETTINGS, seed=0)


def test_states_that_the_skill_fails_from_are_left_out():
    states, reached = tried(400, 1)
    assert 0.2 < reached.mean() < 0.8
    inside = learnt().contains(MODEL, states)
    assert reached[inside].mean() >= 0.95
    assert inside[reached].mean() >= 0.5


def test_the_set_ends_where_nothing_was_tried():
    everywhere = learn_set(MODEL.observe(tried(50, 0)[0]), np.ones(50, dtype=bool), BALL, SETTINGS, seed=0)
    states = MODEL.perturb(CENTER, 0.5, 300, np.random.default_rng(2))
    near = everywhere.distance(MODEL, states) <= SETTINGS.reach * RADIUS
    assert 0 < near.sum() < len(near)
    np.testing.assert_array_equal(everywhere.contains(MODEL, states), near)


def test_speeds_count_although_the_distance_leaves_them_out():
    rng = np.random.default_rng(0)
    observations = np.column_stack([rng.uniform(-0.1, 0.1, 400), rng.uniform(-5.0, 5.0, 400)])
    fast = observations[:, 1] > 0.0
    found = learn_set(observations, fast, Ball(np.zeros(2), RADIUS), SETTINGS, seed=0)
    assert found.probability(np.array([[0.0, 2.0], [0.0, -2.0]])).round() == pytest.approx([1.0, 0.0])


def test_equal_seeds_give_equal_sets():
    one, other = to_arrays(learnt(), "set"), to_arrays(learnt(), "set")
    assert all(one[name].tobytes() == other[name].tobytes() for name in one)


@pytest.mark.parametrize("kind", ["ball", "goal", "classifier"])
def test_arrays_and_back(kind):
    part = {"ball": lambda: TARGET, "goal": lambda: EnvironmentGoal(0.2), "classifier": learnt}[kind]()
    assert kind_of(part) == kind
    arrays = to_arrays(part, "a")
    back = from_arrays(kind_of(part), arrays, "a")
    assert type(back) is type(part)
    states, _ = tried(100, 3)
    np.testing.assert_array_equal(back.contains(MODEL, states), part.contains(MODEL, states))
    arrays.popitem()
    with pytest.raises(DamagedFile, match="lacks"):
        from_arrays(kind_of(part), arrays, "a")


def test_a_chain_with_a_learnt_set_survives_a_file(tmp_path):
    actor = Policy(((np.eye(2, dtype=np.float32), np.zeros(2, np.float32)),), MODEL.action_low, MODEL.action_high)
    policy = SkillPolicy(actor, ObservationTransform.identity(2))
    part = learnt()
    entry = Entry((ObservedBall(CENTER, np.ones(2), part.reach * part.radius), ObservedClassifier.of(part)))
    skills = (Skill(policy, TARGET, part, Entry()), Skill(policy, part, EnvironmentGoal(0.2), entry))
    SkillChain(skills, CENTER, MODEL.spec, 50, ActionMap.of(MODEL.env.action_space)).save(tmp_path)
    loaded = SkillChain.load(tmp_path)
    assert [kind_of(skill.activation) for skill in loaded.skills] == ["ball", "classifier"]
    assert [kind_of(skill.target) for skill in loaded.skills] == ["classifier", "goal"]
    states, _ = tried(100, 4)
    inside = part.contains(MODEL, states)
    assert 0 < inside.sum() < len(states)
    np.testing.assert_array_equal(loaded.skills[1].entry.contains(MODEL.observe(states)), inside)
    assert loaded.skills[0].entry.contains(MODEL.observe(states)).all()
    np.testing.assert_array_equal(loaded.skills[1].activation.contains(MODEL, states),
                                  learnt().contains(MODEL, states))


class StopAfter:
    """A Ctrl-C at the first report of a training that has this number of skills."""

    def __init__(self, skills):
        self.skills = skills

    def __call__(self, numbers):
        if numbers["phase"] == "train" and numbers["skills"] >= self.skills:
            raise KeyboardInterrupt


def test_training_with_learnt_sets_solves_the_small_maze_and_resumes_after_a_stop(tmp_path):
    options = {"env_kwargs": {"size": 2}, "seed": 1, "settings": {"activation": "classifier"}}
    whole = train("pbcs/Maze-v0", method="pbcs", **options)
    assert whole.solved
    later = [skill.activation for skill in whole.chain.skills[1:]]
    assert later
    assert all(type(part) is ClassifierSet for part in later)
    with pytest.raises(KeyboardInterrupt):
        train("pbcs/Maze-v0", method="pbcs", **options, out=tmp_path / "run", on_progress=StopAfter(skills=1))
    resumed = resume(tmp_path / "run")
    assert (resumed.train_transitions, resumed.updates) == (whole.train_transitions, whole.updates)
    for mine, theirs in zip(whole.chain.skills, resumed.chain.skills, strict=True):
        one, other = to_arrays(mine.activation, "a"), to_arrays(theirs.activation, "a")
        assert all(one[name].tobytes() == other[name].tobytes() for name in one)


def test_an_unknown_kind_of_set_is_refused():
    with pytest.raises(InvalidOption, match="one of ball, classifier"):
        PBCSSettings(activation="box")
