"""Plans are executed in fresh environments; where transitions are functions of states, their replay is one batch."""

from dataclasses import replace

import numpy as np

from pbcs_ompl.bridge import verification
from pbcs_ompl.bridge.plan import plan
from pbcs_ompl.resettable import make


def test_a_plan_of_a_function_of_states_is_replayed_in_one_batch(monkeypatch):
    """The execution in the fresh environment is still made step by step, and a wrong state is still found."""

    result = plan("pbcs/Maze-v0", env_kwargs={"size": 3}, seed=2)
    model = make("pbcs/Maze-v0", {"size": 3})
    assert result.trajectory is not None
    slow = []
    original = verification._first_difference
    monkeypatch.setattr(verification, "_first_difference", lambda *given: slow.append(1) or original(*given))
    assert verification.verify(result.trajectory, model) == verification.Verification(True, True, None)
    assert not slow
    wrong = replace(result.trajectory, states=result.trajectory.states.copy())
    wrong.states[5, 0] = np.nextafter(wrong.states[5, 0], 9.0)
    verdict = verification.verify(wrong, model)
    assert (verdict.solved, verdict.replays) == (False, False)
    assert "differs from step 5 on" in verdict.reason
    assert slow
