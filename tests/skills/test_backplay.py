"""Backplay's loop against Alg. 7, with a trainer whose success is scripted."""

import numpy as np
import pytest

from pbcs_ompl.skills.backplay import Backplay, SkillSettings


class ScriptedTrainer:
    """Succeeds as a function of the start point and of the sessions spent there; records the calls."""

    def __init__(self, end_index, success):
        self.end_index, self.success = end_index, success
        self.sessions = {}
        self.log = []
        self.restarts = 0

    def test(self, index):
        self.log.append(("test", index))
        return self.success(index, self.sessions.get(index, 0))

    def session(self, index, rehearsal_fraction):
        self.log.append(("train", index))
        self.sessions[index] = self.sessions.get(index, 0) + 1
        return self.success(index, self.sessions[index])

    def restart(self):
        self.restarts += 1
        self.sessions.clear()

    def policy(self):
        return f"policy after {len(self.log)}"


def run(goal, success, steps=10_000, min_index=0, **changes):
    trainer = ScriptedTrainer(goal, success)
    backplay = Backplay(trainer, SkillSettings().updated(changes), min_index)
    for _ in range(steps):
        if backplay.done:
            break
        backplay.step()
    return backplay, trainer


def test_every_pretest_passes():
    backplay, trainer = run(5, lambda index, sessions: 1.0)
    assert backplay.done
    assert backplay.state.saved == 0
    assert trainer.log == [("test", index) for index in (4, 3, 2, 1, 0)]


def test_the_last_successful_skill_is_returned_at_zero_percent():
    """Alg. 7 line 13: alpha sessions without improvement, a test at 0 %, and the skill of K + 1 is the answer."""
    backplay, trainer = run(6, lambda index, sessions: float(index >= 3), alpha=4)
    assert backplay.done
    assert backplay.state.saved == 3
    assert backplay.saved_policy == "policy after 3"
    # the first session sets the maximum (0 > -1), the next alpha do not improve on it
    assert trainer.log[3:] == [("test", 2)] + [("train", 2)] * 5 + [("test", 2)]


def test_training_continues_until_it_no_longer_improves():
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
    backplay, _ = run(5, half_at_3, alpha=2, skip_unsolved=False)
    assert backplay.done
    assert backplay.state.saved == 4


def test_without_any_skill_training_continues_with_the_same_segment():
    """Settlement: at 0 % and with no skill yet, the same segment is trained again."""
    backplay, trainer = run(3, lambda index, sessions: float(index < 2 or sessions >= 30), alpha=4)
    assert backplay.done
    assert backplay.state.saved == 0
    assert trainer.sessions[2] == 30


def test_a_skill_that_never_starts_gets_fresh_networks():
    """Once for the first start point; then all of them are passed over; then once more, and so on."""
    backplay, trainer = run(9, lambda index, sessions: 0.4, steps=200, alpha=3, skip_unsolved=False, min_stride=2,
                            max_stride=4)
    assert not backplay.done
    assert backplay.saved_policy is None
    assert trainer.restarts > 3
    tested = [index for kind, index in trainer.log if kind == "test"]
    assert list(dict.fromkeys(tested)) == [7, 5, 3, 1, 0]


@pytest.mark.parametrize("hopeless", [{7}, {7, 5}])
def test_with_fresh_networks_a_start_that_stays_partly_solved_is_passed_over(hopeless):
    partly = lambda index, sessions: 0.6 if index in hopeless else 1.0  # noqa: E731
    backplay, trainer = run(9, partly, alpha=2, skip_unsolved=False, min_stride=2, max_stride=2)
    assert backplay.done
    assert backplay.state.saved == 0
    assert trainer.restarts == 1


def test_without_any_success_nothing_is_passed_over():
    _, trainer = run(9, lambda index, sessions: 0.0, steps=100, alpha=2, skip_unsolved=False, min_stride=2,
                     max_stride=2)
    assert {index for _, index in trainer.log} == {7}
    assert trainer.restarts > 3


def test_the_stride_doubles_while_tests_pass_and_halves_when_they_fail():
    _, trainer = run(40, lambda index, sessions: float(index >= 20 or sessions >= 2), min_stride=2, max_stride=8)
    assert [index for kind, index in trainer.log if kind == "test"][:7] == [38, 36, 32, 24, 16, 20, 12]


@pytest.mark.parametrize("min_index", [0, 3, 5])
def test_a_skill_ends_at_its_min_index(min_index):
    backplay, trainer = run(6, lambda index, sessions: 1.0, min_index=min_index)
    assert backplay.done
    assert backplay.state.saved == min_index
    assert min(index for _, index in trainer.log) == min_index


def test_the_loop_can_stop_anywhere_and_resume():
    rng = np.random.default_rng(0)
    table = rng.random((30, 40)) < 0.3
    success = lambda index, sessions: 1.0 if table[index, :sessions].any() else 0.2  # noqa: E731
    whole, log = run(25, success, alpha=2)
    trainer = ScriptedTrainer(25, success)
    backplay = Backplay(trainer, whole.settings)
    while not backplay.done:
        backplay.step()
        again = Backplay(trainer, whole.settings)
        again.restore(backplay.to_dict(), backplay.saved_policy)
        again.done = backplay.done
        backplay = again
    assert trainer.log == log.log
    assert backplay.state == whole.state
