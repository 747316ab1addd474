"""What a policy just did in many environments side by side, and how much better each action was than expected."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.types import Array, BoolArray


@dataclass(frozen=True, eq=False)
class Rollout:
    """T transitions of N environments, for S seeds; arrays are [S, T, N, ...].

    Attributes:
        observations: [S, T, N, O].
        inner: Actions as they were drawn; see `Drawn` [S, T, N, A].
        log_densities: Of these under the policy that drew them [S, T, N].
        rewards: [S, T, N].
        values: Of the observations, by the critic [S, T, N].
        next_values: Of the observations after the transitions, whether or not the episode ended there [S, T, N].
        continues: How much of what follows counts, in [0, 1]: 0 where the transition is terminal, 1 where it is not,
            and something between for a discount by progress [S, T, N].
        ends: Whether the next transition belongs to another episode [S, T, N].
    """

    observations: Array
    inner: Array
    log_densities: Array
    rewards: Array
    values: Array
    next_values: Array
    continues: Array
    ends: BoolArray


def advantages(rollout: Rollout, discount: float, trace_decay: float) -> Array:
    """Return generalised advantage estimates [S, T, N].

        delta_t = r_t + gamma c_t V(s_t+1) - V(s_t)
        A_t     = delta_t + gamma c_t lambda A_t+1, the second term only within an episode

    Source: Schulman et al. (2016), Eq. 16, with a discount gamma c_t for each transition.

    Args:
        rollout: What was done.
        discount: gamma.
        trace_decay: lambda.
    """
    weights = discount * rollout.continues
    found = rollout.rewards + weights * rollout.next_values - rollout.values
    traces = np.where(rollout.ends, 0.0, trace_decay * weights)
    for step in reversed(range(found.shape[1] - 1)):
        found[:, step] += traces[:, step] * found[:, step + 1]
    return found
