"""What an actor does all over the state space, and the shape of its critic along the actions."""

from collections.abc import Callable

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, BoolArray

Act = Callable[[Array], Array]
"""Actions [S, B, A] for observations [S, B, O]."""

Value = Callable[[Array, Array], Array]
"""Q-values [S, B] of actions [S, B, A] in observations [S, B, O]."""

STEP = 1e-2
"""Half the distance of the difference quotients, in half-widths of the action box: wide enough for float32."""


def saturation(act: Act, observations: Array, low: Array, high: Array, *, margin: float = 0.01) -> Array:
    """Return the fraction of action components that lie at an end of the box [S].

    Args:
        act: The actor.
        observations: Where it is evaluated [S, B, O].
        low, high: The action box [A].
        margin: What counts as the end, as a fraction of the box's width.
    """
    unit = (act(observations) - low) / (high - low)
    ends: BoolArray = (unit <= margin) | (unit >= 1.0 - margin)
    ratio: Array = np.mean(ends, axis=(1, 2))
    return ratio


def largest_actions(act: Act, observations: Array) -> Array:
    """Return max |pi(s)| over the observations [S, B, O] and the components [S]; [Matheron2020] Fig. 6.4(b)."""
    largest: Array = np.abs(act(observations)).max(axis=(1, 2))
    return largest


def largest_values(value: Value, observations: Array, actions: Array) -> Array:
    """Return max |Q(s, a)| over pairs of observations [S, B, O] and actions [S, B, A] [S]; Fig. 6.4(a)."""
    largest: Array = np.abs(value(observations, actions)).max(axis=1)
    return largest


def value_slices(value: Value, observations: Array, low: Array, high: Array, *, count: int = 101,
                 dimension: int = 0) -> tuple[Array, Array]:
    """Return actions [N] along one dimension, and Q there in each observation [S, B, N].

    The other dimensions of the action are in the middle of the box; [Matheron2020] Fig. 6.5(b).

    Args:
        value: Q.
        observations: [S, B, O].
        low, high: The action box [A].
        count: Actions N.
        dimension: Of the action.

    Raises:
        InvalidOption: no such dimension.
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


def action_gradient(value: Value, observations: Array, actions: Array, low: Array, high: Array) -> Array:
    """Return the gradient of Q by the actions [S, B, A], in half-widths of the action box.

    By central difference quotients, which at the ends of the box become one-sided; `value` is evaluated inside it only.

    Args:
        value: Q.
        observations, actions: Where [S, B, O] and [S, B, A].
        low, high: The action box [A].
    """
    half = (high - low) / 2.0
    gradient = np.empty(actions.shape)
    for dimension in range(actions.shape[-1]):
        ends = np.stack([actions, actions])
        step = STEP * half[dimension]
        ends[0, ..., dimension] = np.maximum(actions[..., dimension] - step, low[dimension])
        ends[1, ..., dimension] = np.minimum(actions[..., dimension] + step, high[dimension])
        distance = (ends[1] - ends[0])[..., dimension] / half[dimension]
        gradient[..., dimension] = (value(observations, ends[1]) - value(observations, ends[0])) / distance
    return gradient


def flat_share(value: Value, observations: Array, actions: Array, low: Array, high: Array, *,
               threshold: float = 0.05) -> Array:
    """Return the fraction of pairs (s, a) where the critic is flat along the actions [S].

    Flat means |grad_a Q| < threshold R, R the range of Q over all the pairs: to first order, moving the action by half
    the box changes Q by less than that fraction of R. 1 for a piecewise-constant critic, up to its steps.

    Args:
        value: Q.
        observations, actions: The pairs [S, B, O] and [S, B, A]; uniform draws, for instance.
        low, high: The action box [A].
        threshold: What counts as flat.
    """
    norm = np.linalg.norm(action_gradient(value, observations, actions, low, high), axis=2)
    values = value(observations, actions)
    scale = values.max(axis=1) - values.min(axis=1)
    flat: Array = np.mean(norm <= threshold * scale[:, None], axis=1)
    return flat


def deadlock_index(act: Act, value: Value, observations: Array, low: Array, high: Array, *, threshold: float = 0.05,
                   candidates: int = 41, seed: int = 0) -> Array:
    """Return the fraction of states in which the actor is stuck although its critic knows a better action [S].

    A state s is stuck when both hold, with R the range of Q over all states and candidate actions:

    * some candidate action a has Q(s, a) > Q(s, pi(s)) + threshold R;
    * grad_a Q(s, a) at a = pi(s), in half-widths of the action box and without the components that lead out of the
      box, is shorter than threshold R: the deterministic policy gradient is close to 0.

    The second is the fixed point of the actor's update of [Matheron2020] Theorem 2, the first excludes
    solved problems. The index itself is ours.

    Args:
        act, value: The actor and its critic.
        observations: The states [S, B, O].
        low, high: The action box [A].
        threshold: What counts as better, and as flat.
        candidates: Uniformly random actions in each state, besides both ends of the box.
        seed: Of these actions.
    """
    actions = act(observations)
    gradient = action_gradient(value, observations, actions, low, high)
    norm = np.linalg.norm(np.where(_leads_out(actions, gradient, low, high), 0.0, gradient), axis=2)
    own = value(observations, actions)
    others = _candidate_values(value, observations, low, high, candidates, seed)
    everything = np.concatenate([others.reshape(len(own), -1), own], axis=1)
    scale = (everything.max(axis=1) - everything.min(axis=1))[:, None]
    better = others.max(axis=2) > own + threshold * scale
    stuck: Array = np.mean(better & (norm <= threshold * scale), axis=1)
    return stuck


def _leads_out(actions: Array, gradient: Array, low: Array, high: Array) -> BoolArray:
    """Return where a gradient leads out of the box [S, B, A]; a tanh comes close to the end, never to it."""
    margin = 1e-3 * (high - low)
    return ((actions <= low + margin) & (gradient < 0.0)) | ((actions >= high - margin) & (gradient > 0.0))


def _candidate_values(value: Value, observations: Array, low: Array, high: Array, count: int, seed: int) -> Array:
    """Return Q of the same candidate actions in all observations [S, B, count + 2]."""
    drawn = np.random.default_rng(seed).uniform(low, high, (count, len(low)))
    shape = (*observations.shape[:2], len(low))
    return np.stack([value(observations, np.broadcast_to(action, shape)) for action in (low, high, *drawn)], axis=2)
