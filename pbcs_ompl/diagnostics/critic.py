"""The shape of a critic along the actions: is there a slope that an actor could follow?"""

from collections.abc import Callable

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.diagnostics.actor import Act

Value = Callable[[Array, Array], Array]
"""Q-values [S, B] of actions [S, B, A] in observations [S, B, O]."""

STEP = 1e-2
"""Half the distance of the difference quotients, in units of half the action box: wide enough for float32."""


def largest_values(value: Value, observations: Array, actions: Array) -> Array:
    """Return max |Q(s, a)| over pairs of observations [S, B, O] and actions [S, B, A] [S]; Fig. 6.4(a)."""
    return np.abs(value(observations, actions)).max(axis=1)


def value_slices(value: Value, observations: Array, low: Array, high: Array, *, count: int = 101,
                 dimension: int = 0) -> tuple[Array, Array]:
    """Return actions [N] along one dimension, and Q there in each observation [S, B, N].

    The other dimensions of the action are in the middle of the box; [Matheron2020] Fig. 6.5(b).

    Args:
        observations: [S, B, O].
        low, high: The action box [A].
    """
    if not 0 <= dimension < len(low):
        raise InvalidOption(f"dimension is {dimension}, expected one of {len(low)}")
    line = np.linspace(low[dimension], high[dimension], count)
    actions = np.broadcast_to((low + high) / 2.0, (*observations.shape[:2], len(low))).copy()
    slices = np.empty((*observations.shape[:2], count))
    for index, position in enumerate(line):
        actions[..., dimension] = position
        slices[..., index] = value(observations, actions)
    return line, slices


def action_slope(value: Value, observations: Array, actions: Array, low: Array, high: Array) -> Array:
    """Return the gradient of Q along the actions [S, B, A], for each half width of the action box.

    By central difference quotients, which at the ends of the box become one-sided; `value` is asked inside it only.
    """
    half = (high - low) / 2.0
    slope = np.empty(actions.shape)
    for dimension in range(actions.shape[-1]):
        ends = np.stack([actions, actions])
        reach = STEP * half[dimension]
        ends[0, ..., dimension] = np.maximum(actions[..., dimension] - reach, low[dimension])
        ends[1, ..., dimension] = np.minimum(actions[..., dimension] + reach, high[dimension])
        distance = (ends[1] - ends[0])[..., dimension] / half[dimension]
        slope[..., dimension] = (value(observations, ends[1]) - value(observations, ends[0])) / distance
    return slope


def flat_share(value: Value, observations: Array, actions: Array, low: Array, high: Array, *,
               threshold: float = 0.05) -> Array:
    """Return the share of pairs (s, a) where the critic is flat along the actions [S].

    Flat means |grad_a Q| < threshold R: moving the action by half the box would, at this slope, change Q by less than
    that share of the range R of Q over all the pairs. 1 for a piecewise-constant critic, up to its steps.

    Args:
        observations, actions: The pairs [S, B, O] and [S, B, A]; uniform draws, for instance.
    """
    slope = np.linalg.norm(action_slope(value, observations, actions, low, high), axis=2)
    values = value(observations, actions)
    scale = values.max(axis=1) - values.min(axis=1)
    return (slope <= threshold * scale[:, None]).mean(axis=1)


def deadlock_index(act: Act, value: Value, observations: Array, low: Array, high: Array, *, threshold: float = 0.05,
                   candidates: int = 41, seed: int = 0) -> Array:
    """Return the share of states in which the actor is stuck although its critic knows better [S], in [0, 1].

    A state s is stuck when both hold, with R the range of Q over all states and candidate actions:

    * some candidate action a has Q(s, a) > Q(s, pi(s)) + threshold R: there is something to be gained;
    * the part of grad_a Q(s, a) at a = pi(s) that does not lead out of the action box is, for half the width of the
      box, shorter than threshold R: the deterministic policy gradient does not go there.

    The second is the fixed point of the actor's update of [Matheron2020] Theorem 2, the first tells it from a
    solved problem. The index itself is ours.

    Args:
        observations: The states that are asked [S, B, O].
        low, high: The action box [A].
        candidates: Uniformly random actions in each state, besides both ends of the box.
    """
    actions = act(observations)
    slope = action_slope(value, observations, actions, low, high)
    slope = np.linalg.norm(np.where(_leads_out(actions, slope, low, high), 0.0, slope), axis=2)
    own = value(observations, actions)
    others = _candidate_values(value, observations, low, high, candidates, seed)
    everything = np.concatenate([others.reshape(len(own), -1), own], axis=1)
    scale = (everything.max(axis=1) - everything.min(axis=1))[:, None]
    better = others.max(axis=2) > own + threshold * scale
    return (better & (slope <= threshold * scale)).mean(axis=1)


def _leads_out(actions: Array, slope: Array, low: Array, high: Array) -> BoolArray:
    """Tell where a gradient leads out of the box [S, B, A]; a tanh comes close to the end, never to it."""
    margin = 1e-3 * (high - low)
    return ((actions <= low + margin) & (slope < 0.0)) | ((actions >= high - margin) & (slope > 0.0))


def _candidate_values(value: Value, observations: Array, low: Array, high: Array, count: int, seed: int) -> Array:
    """Return Q of the same candidate actions in all observations [S, B, count + 2]."""
    drawn = np.random.default_rng(seed).uniform(low, high, (count, len(low)))
    shape = (*observations.shape[:2], len(low))
    return np.stack([value(observations, np.broadcast_to(action, shape)) for action in (low, high, *drawn)], axis=2)
