"""States near a state, as activation sets need them: drawn in a ball, or reached by short random rollouts.

Source: [Matheron2020] 7.2.4.
"""

from collections.abc import Callable

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter

MAX_DRAWS = 200
MAX_ROLLOUTS = 50
PROPOSED_SHARE = 0.1
"""Share of the rollouts that stay in the ball that a message proposes."""


def uniform_in_ball(centre: Array, radius: float, count: int, rng: np.random.Generator) -> Array:
    """Return points [count, D], uniform in the Euclidean ball.

    Args:
        centre: [D].
        radius: In the units of the state.
        count: How many.
        rng: The random numbers.
    """
    directions = rng.standard_normal((count, len(centre)))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return centre + radius * rng.random((count, 1)) ** (1.0 / len(centre)) * directions


def draw_valid(draw: Callable[[int], Array], count: int, is_valid: Callable[[Array], BoolArray] | None,
               place: str) -> Array:
    """Return `count` states [count, D]; invalid ones are drawn again.

    Args:
        draw: Returns N states [N, D].
        count: How many.
        is_valid: Which states [N, D] are valid [N]; None to keep all.
        place: Where they are drawn, for the message.

    Raises:
        InvalidState: too few valid states were found in 200 rounds of draws.
    """
    states = draw(count)
    if is_valid is None:
        return states
    bad = np.flatnonzero(~is_valid(states))
    for _ in range(MAX_DRAWS):
        if not len(bad):
            return states
        states[bad] = draw(len(bad))
        bad = bad[~is_valid(states[bad])]
    if len(bad):
        raise InvalidState(f"no valid state within {place} in {MAX_DRAWS} draws")
    return states


def check_radius(radius: float) -> None:
    """Refuse a radius that is negative or not finite.

    Raises:
        InvalidOption: it is.
    """
    if not (np.isfinite(radius) and radius >= 0.0):
        raise InvalidOption(f"radius={radius!r}: expected a finite number >= 0")


def roll_near(model: ResettableModel, state: Array, radius: float, count: int, rng: np.random.Generator, *,
              before: Array | None = None, rollout_steps: int = 5, counter: Counter | None = None) -> Array:
    """Return states [count, D] near a state that few random steps reach from it or from states before it.

    Differs from [Matheron2020] 7.2.4, which draws in a ball and proposes to run the environment backwards at random: a
    vector near the state of a simulator may have legs in the floor, a state that the simulator reaches does not; and it
    runs forwards from states that lead to `state`. From `state` alone it would find only what follows it.

    Args:
        model: The environment.
        state: [D].
        radius: The largest `model.distance` to `state`.
        count: How many.
        rng: The random numbers.
        before: States [N, D] that lead to `state`.
        rollout_steps: The most steps of a rollout; their number is drawn from 0 to this one.
        counter: Counts the steps.

    Raises:
        InvalidState: too few rollouts stay in the ball.
    """
    sources = state[None] if before is None else np.concatenate([before, state[None]])
    found, distances = np.empty((0, len(state))), np.empty(0)
    for _ in range(MAX_ROLLOUTS):
        if len(found) >= count:
            return found[:count]
        reached = _roll(model, sources[rng.integers(0, len(sources), count)], rng, rollout_steps, counter or Counter())
        away = model.distance(reached, state)
        found, distances = np.concatenate([found, reached[away <= radius]]), np.concatenate([distances, away])
    if len(found) < count:
        holding = float(np.quantile(distances, PROPOSED_SHARE)) if len(distances) else radius
        raise InvalidState(
            f"random rollouts leave the ball of radius {radius:g} around the state: {len(found)} of {len(distances)} "
            f"end in it, expected {count}; {PROPOSED_SHARE:.0%} of them end within {holding:.2g}: take a larger radius "
            f"(of a training, --settings '{{\"radius\": {max(holding, 2.0 * radius):.2g}}}')")
    return found[:count]


def random_walk(model: ResettableModel, steps: int, rng: np.random.Generator) -> Array:
    """Return the states [steps + 1, D] of random steps from the start of seed 0, and from there again after an end."""
    states = [model.initial_state(0)]
    for control in rng.uniform(model.action_low, model.action_high, (steps, len(model.action_low))):
        outcome = model.transition(states[-1][None], control[None])
        states.append(model.initial_state(0) if outcome.ended[0] else outcome.states[0])
    return np.array(states)


def _roll(model: ResettableModel, states: Array, rng: np.random.Generator, most: int, counter: Counter) -> Array:
    """Return what `states` [B, D] become in 0 to `most` random steps each; ended episodes are left out."""
    steps = rng.integers(0, most + 1, len(states))
    ended = np.zeros(len(states), dtype=np.bool_)
    for step in range(most):
        moving = np.flatnonzero((steps > step) & ~ended)
        if not len(moving):
            break
        controls = rng.uniform(model.action_low, model.action_high, (len(moving), len(model.action_low)))
        counter.spend(len(moving))
        outcome = model.transition(states[moving], controls)
        states[moving] = outcome.states
        ended[moving] = outcome.ended
    return states[~ended]
