"""What a robot does that has fallen, or is stuck: it swings all joints, each at a rate of its own, until it is free.

Nothing of this is learnt or random: the controls depend on the number of steps without progress alone, so that they
need no memory of their own, and an execution is the same in every run.
"""

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray, IndexArray

CYCLE = 128
"""Steps after which the controls come again (ours)."""
SLOWEST = 16
"""Control j changes its end `SLOWEST` + j times in half a cycle, so that no two swing together for long (ours).

Ants on their backs, in RK4 with 10 % random actions: 77 % of 64 had their torso up for three steps within 300 steps;
with `SLOWEST` 9, 12 and 21, 61 to 68 % of 64 to 96, and with one rate for all joints 3 %.
"""

BURST = 8
"""Steps for which a robot that is stuck swings, and for which its policy acts in between (ours).

Cars along 60 plans of RidesSST, five executions each with 10 % random actions: 268 of 300, without swinging 230; 53 and
46 of 60 without random actions. Other lengths and first steps differ by a few.
"""


def stuck(stalled: IndexArray, patience: int) -> BoolArray:
    """Return which robots swing after some steps without progress [B]: those that training would have given up.

    For robots whose heading counts on lines: they cannot turn away from what they touch.
    """
    over = stalled - patience
    swinging: BoolArray = (over >= 0) & (over // BURST % 2 == 0)
    return swinging


def waves(low: Array, high: Array) -> Array:
    """Return the controls of a cycle [CYCLE, A]: square waves between the ends of the box of controls [A]."""
    changes = np.arange(CYCLE)[:, None] * (SLOWEST + np.arange(len(low))) // (CYCLE // 2)
    controls: Array = np.where(changes % 2 == 0, high, low)
    return controls
