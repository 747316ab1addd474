"""Backplay's loop against Alg. 7, with a learner whose success is scripted."""

import numpy as np
import pytest

from pbcs_ompl.skills.backplay import Backplay
from pbcs_ompl.skills.settings import SkillSettings


class ScriptedLearner:
    """Succeeds as a function of the start point and of the sessions spent there; remembers what was asked."""

    def __init__(self, goal_index, settings, success):
        self.goal_index, self.settings, self.success = goal_index, settings, success
        self.sessions = {}
        self.log = []
        self.restarts = 0

    def test(self, index):
        self.log.append(("test", index))
        return self.success(index, self.sessions.get(index, 0))

    def session(self, index):
        self.log.append(("train", index))
        self.sessions[index] = self.sessions.get(index, 0) + 1
        return self.success(index, self.sessions[index])

    def restart(self):
        self.restarts += 1
        self.sessions.clear()

    def policy(self):
        return f"policy after {len(self.log)}"


def run(goal, success, steps=10_000, floor=0, **settings):
    learner = ScriptedLearner(goal, SkillSettings(**{"min_stride": 1, "max_stride": 1} | settings), success)
    backplay = Backplay(learner, floor)
    for _ in range(steps):
        if backplay.done:
            break
        backplay.step()
    return backplay, learner


def test_every_pretest_passes():
    backplay, learner = run(5, lambda index, sessions: 1.0)
    assert backplay.done
    assert backplay.state.saved == 0
    assert learner.log == [("test", index) for index in (4, 3, 2, 1, 0)]


def test_the_last_successful_skill_is_returned_at_zero_percent():
    """Alg. 7 line 13: alpha sessions without improvement, a test at 0 %, and the skill of K + 1 is the answer."""
    backplay, learner = run(6, lambda index, sessions: float(index >= 3), alpha=4)
    assert backplay.done
    assert backplay.state.saved == 3
    assert backplay.saved_policy == "policy after 3"
    # the first session sets the maximum (0 > -1), the next alpha do not improve on it
    assert learner.log[3:] == [("test", 2)] + [("train", 2)] * 5 + [("test", 2)]


def test_training_goes_on_until_it_no_longer_improves():
    """The rule of Alg. 7 to the letter: with stop_at_success off, alpha sessions follow the best one."""
    rising = lambda index, sessions: min(1.0, sessions / 3)  # noqa: E731
    _, literal = run(1, rising, alpha=5, stop_at_success=False)
    assert literal.log == [("test", 0)] + [("train", 0)] * (3 + 5) + [("test", 0)]
    _, stopping = run(1, rising, alpha=5)
    assert stopping.log == [("test", 0)] + [("train", 0)] * 3 + [("test", 0)]


def test_a_partly_solved_start_is_passed_over_but_not_saved():
    half_at_3 = lambda index, sessions: 0.5 if index == 3 else 1.0  # noqa: E731
    backplay, _ = run(5, half_at_3, alpha=2)
    assert backplay.done
    assert backplay.state.saved == 0
    backplay, _ = run(5, half_at_3, alpha=2, keep_partial=False)
    assert backplay.done
    assert backplay.state.saved == 4


def test_without_any_skill_training_goes_on_with_the_same_segment():
    """Settlement: at 0 % and with no skill yet, the same segment is trained again."""
    backplay, learner = run(3, lambda index, sessions: float(index < 2 or sessions >= 30), alpha=4)
    assert backplay.done
    assert backplay.state.saved == 0
    assert learner.sessions[2] == 30


def test_a_skill_that_never_starts_gets_fresh_networks():
    """Once for the first start point; then all of them are passed over; then once more, and so on."""
    backplay, learner = run(9, lambda index, sessions: 0.4, steps=200, alpha=3, keep_partial=False, min_stride=2,
                            max_stride=4)
    assert not backplay.done
    assert backplay.saved_policy is None
    assert learner.restarts > 3
    tested = [index for kind, index in learner.log if kind == "test"]
    assert list(dict.fromkeys(tested)) == [7, 5, 3, 1, 0]


@pytest.mark.parametrize("hopeless", [{7}, {7, 5}])
def test_with_fresh_networks_a_start_that_stays_partly_solved_is_passed_over(hopeless):
    partly = lambda index, sessions: 0.6 if index in hopeless else 1.0  # noqa: E731
    backplay, learner = run(9, partly, alpha=2, keep_partial=False, min_stride=2, max_stride=2)
    assert backplay.done
    assert backplay.state.saved == 0
    assert learner.restarts == 1


def test_without_any_success_nothing_is_passed_over():
    _, learner = run(9, lambda index, sessions: 0.0, steps=100, alpha=2, keep_partial=False, min_stride=2, max_stride=2)
    assert {index for _, index in learner.log} == {7}
    assert learner.restarts > 3


def test_the_stride_doubles_while_tests_pass_and_halves_when_they_fail():
    _, learner = run(40, lambda index, sessions: float(index >= 20 or sessions >= 2), min_stride=2, max_stride=8)
    assert [index for kind, index in learner.log if kind == "test"][:7] == [38, 36, 32, 24, 16, 20, 12]


@pytest.mark.parametrize("floor", [0, 3, 5])
def test_a_skill_ends_at_its_floor(floor):
    backplay, learner = run(6, lambda index, sessions: 1.0, floor=floor)
    assert backplay.done
    assert backplay.state.saved == floor
    assert min(index for _, index in learner.log) == floor


def test_the_loop_can_stop_anywhere_and_go_on():
    rng = np.random.default_rng(0)
    table = rng.random((30, 40)) < 0.3
    success = lambda index, sessions: 1.0 if table[index, :sessions].any() else 0.2  # noqa: E731
    whole, log = run(25, success, alpha=2)
    learner = ScriptedLearner(25, whole.settings, success)
    backplay = Backplay(learner)
    while not backplay.done:
        backplay.step()
        again = Backplay(learner)
        again.restore(backplay.to_dict(), backplay.saved_policy)
        again.done = backplay.done
        backplay = again
    assert learner.log == log.log
    assert backplay.state == whole.state
