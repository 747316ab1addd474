"""Find states near a state where most vectors are no states: by short random rollouts from it."""

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, Counter

MAX_ROUNDS = 50


def reached_in_ball(model: ResettableModel, state: Array, radius: float, count: int, rng: np.random.Generator, *,
                    before: Array | None = None, rollout_steps: int = 5, counter: Counter | None = None) -> Array:
    """Return states [count, D] within `radius` of `state` [D] that few random steps reach from it or from `before`.

    Source: [Matheron2020] 7.2.4 perturbs in a ball, and proposes to run the environment backwards at random within it,
    which finds what is about to arrive at the state. Differs: a vector near the state of a simulator may have legs in
    the floor, what the simulator itself reaches has not; and instead of backwards it runs forwards from the states
    `before` [N, D]. From `state` alone it would only find what has passed it.

    Args:
        before: States [N, D] that lead to `state`.
        rollout_steps: The most steps of a rollout.
        counter: Where the steps are counted.

    Raises:
        InvalidOption: the radius is negative or not finite.
        InvalidState: too few rollouts stay in the ball.
    """
    if not (np.isfinite(radius) and radius >= 0.0):
        raise InvalidOption(f"radius={radius!r}: expected a finite number >= 0")
    sources = state[None] if before is None else np.concatenate([before, state[None]])
    found = np.empty((0, len(state)))
    for _ in range(MAX_ROUNDS):
        if len(found) >= count:
            return found[:count]
        reached = _roll(model, sources[rng.integers(0, len(sources), count)], rng, rollout_steps, counter or Counter())
        found = np.concatenate([found, reached[model.distance(reached, state) <= radius]])
    if len(found) < count:
        raise InvalidState(f"random rollouts leave the ball of radius {radius:g} around the state; take a larger one")
    return found[:count]


def _roll(model: ResettableModel, states: Array, rng: np.random.Generator, most: int, counter: Counter) -> Array:
    """Return what `states` [B, D] become in 0 to `most` random steps each; ended episodes are left out."""
    steps = rng.integers(0, most + 1, len(states))
    ended = np.zeros(len(states), dtype=np.bool_)
    for step in range(most):
        moving = np.flatnonzero((steps > step) & ~ended)
        if not len(moving):
            break
        controls = rng.uniform(model.action_low, model.action_high, (len(moving), len(model.action_low)))
        outcome = model.transition(states[moving], controls)
        counter.count += len(moving)
        states[moving] = outcome.states
        ended[moving] = outcome.terminated
    return states[~ended]
