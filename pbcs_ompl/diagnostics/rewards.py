"""Rewards in replay buffers and along rollouts: how often they occur, and how far a critic is from the returns."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.diagnostics.actor_critic import Act, Value


def rewarded_share(rewards: Array, mask: BoolArray | None = None) -> Array:
    """Return the fraction of transitions with a positive reward [S]; the same is expected of mini-batches.

    n updates on mini-batches of b transitions contain n b times this number ([Matheron2020] Fig. 6.3a).

    Args:
        rewards: The rewards in the replay buffers [S, N].
        mask: Which of them are filled [S, N]; None for all.

    Raises:
        InvalidOption: a buffer is empty.
    """
    mask = np.ones(rewards.shape, dtype=np.bool_) if mask is None else mask
    counts = mask.sum(axis=1)
    if not counts.all():
        raise InvalidOption("a replay buffer is empty; add transitions before asking for their rewards")
    fraction: Array = np.sum((rewards > 0.0) & mask, axis=1) / counts
    return fraction


def returns_of(model: ResettableModel, act: Act, states: Array, controls: Array, discount: float,
               horizon: int) -> Array:
    """Return Q^pi [S, B]: the discounted rewards of one control, then of the actor, for `horizon` steps.

    Exact in a deterministic environment up to discount^horizon max|r| / (1 - discount); [Matheron2020] Definition 1.

    Args:
        model: The environment.
        act: The actor.
        states: Where the rollouts start [S, B, D].
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
        running &= ~outcome.ended
        if not running.any():
            break
        here = outcome.states
        actions = act(model.observe(here).reshape(seeds, count, -1)).reshape(len(here), -1)
    return returns.reshape(seeds, count)


def distance_to_returns(model: ResettableModel, act: Act, value: Value, states: Array, controls: Array,
                        discount: float, horizon: int) -> Array:
    """Return the mean of |Q(s, a) - Q^pi(s, a)| [S].

    [Matheron2020] 6.4.1 shows that the critic converges to Q^pi when the actor no longer changes.

    Args:
        model: The environment.
        act, value: The actor and its critic.
        states, controls: Where they are compared [S, B, D] and [S, B, A].
        discount, horizon: See `returns_of`.
    """
    observations = model.observe(states.reshape(-1, states.shape[2])).reshape(*states.shape[:2], -1)
    returns = returns_of(model, act, states, controls, discount, horizon)
    distance: Array = np.abs(value(observations, controls) - returns).mean(axis=1)
    return distance
