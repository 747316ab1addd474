"""How far a critic is from what its actor really earns: Q against Q^pi, by rollouts."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.diagnostics.actor import Act
from pbcs_ompl.diagnostics.critic import Value


def returns_of(model: ResettableModel, act: Act, states: Array, controls: Array, discount: float,
               horizon: int) -> Array:
    """Return Q^pi [S, B]: the discounted rewards of one control, then of the actor, for `horizon` steps.

    Exact in a deterministic environment up to discount^horizon max|r| / (1 - discount); [Matheron2020] Definition 1.

    Args:
        states: Where to begin [S, B, D].
        controls: The first actions there [S, B, A].
        discount: In [0, 1).
        horizon: The most steps, the first included.

    Raises:
        InvalidOption: a discount or a horizon out of its range.
    """
    if not 0.0 <= discount < 1.0 or horizon < 1:
        raise InvalidOption(f"discount={discount}, horizon={horizon}: expected [0, 1) and at least 1")
    seeds, count, _ = states.shape
    here, actions = states.reshape(seeds * count, -1), controls.reshape(seeds * count, -1)
    returns, running = np.zeros(len(here)), np.ones(len(here), dtype=np.bool_)
    for step in range(horizon):
        outcome = model.transition(here, actions)
        returns += np.where(running, discount**step * outcome.rewards, 0.0)
        running &= ~outcome.terminated
        if not running.any():
            break
        here = outcome.states
        actions = act(model.observe(here).reshape(seeds, count, -1)).reshape(len(here), -1)
    return returns.reshape(seeds, count)


def distance_to_returns(model: ResettableModel, act: Act, value: Value, states: Array, controls: Array,
                        discount: float, horizon: int) -> Array:
    """Return the mean of |Q(s, a) - Q^pi(s, a)| over states [S, B, D] and controls [S, B, A] [S].

    [Matheron2020] 6.4.1 shows that the critic comes to Q^pi when the actor no longer moves. See `returns_of`.
    """
    observations = model.observe(states.reshape(-1, states.shape[2])).reshape(*states.shape[:2], -1)
    returns = returns_of(model, act, states, controls, discount, horizon)
    return np.abs(value(observations, controls) - returns).mean(axis=1)
