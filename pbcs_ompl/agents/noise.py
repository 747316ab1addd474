"""Exploration noise: makes the actions of an episode from those of the actor, [Matheron2020] section 6.2.2.

    noise = make_noise("ornstein-uhlenbeck", sigma=0.3)
    draws = draw_all(noise, generators, (steps, copies), action_size)      # [S, T, B, n], of many steps at once
    actions = noise.apply(agent.act(observations), draws[:, t], starts, low, high)

All random numbers of a seed come from its own generator, and how many does not depend on the actions: a stack of S
seeds explores as S separate agents do.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import Any, Protocol

import numpy as np

from pbcs_ompl.core.errors import UnknownName
from pbcs_ompl.core.options import check_names, check_range
from pbcs_ompl.core.types import Array, BoolArray


class Noise(Protocol):
    """Turns the actors' actions into those of an episode."""

    def keep(self, indices: Sequence[int]) -> None:
        """Continue with some of the seeds, by their indices: the next `apply` is for them only."""
        ...

    def draw(self, generator: np.random.Generator, shape: tuple[int, ...], action_size: int) -> Array:
        """Return the random numbers [*shape, n] that `apply` takes.

        Args:
            generator: Of one seed.
            shape: Steps, copies of the environment, or whatever else.
            action_size: A.
        """
        ...

    def apply(self, actions: Array, draws: Array, starts: BoolArray, low: Array, high: Array) -> Array:
        """Return the noisy actions [S, B, A].

        Args:
            actions: The actors' [S, B, A].
            draws: The numbers of this step [S, B, n].
            starts: Whether an episode begins with this step [S, B].
            low, high: The action box [A].
        """
        ...


@dataclass(frozen=True)
class EpsilonGreedy:
    """With probability `epsilon` a uniformly random action; "probabilistic noise" in [Matheron2020] 6.2.2."""

    epsilon: float = 0.1

    def __post_init__(self) -> None:
        check_range("epsilon", self.epsilon, 0.0 <= self.epsilon <= 1.0, "a probability in [0, 1]")

    def keep(self, indices: Sequence[int]) -> None:
        """Do nothing: this noise has no memory."""

    def draw(self, generator: np.random.Generator, shape: tuple[int, ...], action_size: int) -> Array:
        """Draw whether the action is replaced, and by which."""
        return generator.random((*shape, 1 + action_size))

    def apply(self, actions: Array, draws: Array, starts: BoolArray, low: Array, high: Array) -> Array:
        """Replace some of the actions."""
        return np.where(draws[..., :1] < self.epsilon, low + draws[..., 1:] * (high - low), actions)


@dataclass(frozen=True)
class Gaussian:
    """Independent normal noise of standard deviation `sigma`, in half-widths of the box; as in Spinning Up (2018)."""

    sigma: float = 0.1

    def __post_init__(self) -> None:
        check_range("sigma", self.sigma, self.sigma >= 0.0, "at least 0")

    def keep(self, indices: Sequence[int]) -> None:
        """Do nothing: this noise has no memory."""

    def draw(self, generator: np.random.Generator, shape: tuple[int, ...], action_size: int) -> Array:
        """Draw normal numbers."""
        return generator.standard_normal((*shape, action_size))

    def apply(self, actions: Array, draws: Array, starts: BoolArray, low: Array, high: Array) -> Array:
        """Add the noise; the sum is clipped to the box."""
        return np.clip(actions + self.sigma * draws * (high - low) / 2.0, low, high)


class OrnsteinUhlenbeck:
    """Add x to the action, in half-widths of the box: x <- x - theta x dt + sigma sqrt(dt) N(0, 1).

    x is 0 before the first step of an episode. Source: Lillicrap et al. 2015; the values are those of OpenAI Baselines
    (2018), [Matheron2020] 6.2.2 gives none.

    Args:
        sigma: Standard deviation of the noise in a unit of time.
        theta: How fast x decays.
        dt: Time of one step.
    """

    def __init__(self, sigma: float = 0.2, theta: float = 0.15, dt: float = 1e-2):
        check_range("sigma", sigma, sigma >= 0.0, "at least 0")
        check_range("dt", dt, dt > 0.0, "a positive number")
        check_range("theta", theta, 0.0 <= theta * dt <= 1.0, "theta dt in [0, 1]")
        self.sigma, self.theta, self.dt = sigma, theta, dt
        self._x: Array | None = None

    def keep(self, indices: Sequence[int]) -> None:
        """Continue with the x of these seeds."""
        self._x = None if self._x is None else self._x[list(indices)]

    def draw(self, generator: np.random.Generator, shape: tuple[int, ...], action_size: int) -> Array:
        """Draw normal numbers."""
        return generator.standard_normal((*shape, action_size))

    def apply(self, actions: Array, draws: Array, starts: BoolArray, low: Array, high: Array) -> Array:
        """Move x by one step and add it; the sum is clipped to the box."""
        before: Array | float = 0.0 if self._x is None else np.where(starts[..., None], 0.0, self._x)
        x: Array = before * (1.0 - self.theta * self.dt) + self.sigma * np.sqrt(self.dt) * draws
        self._x = x
        return np.clip(actions + x * (high - low) / 2.0, low, high)


NOISES: dict[str, Callable[..., Noise]] = {
    "epsilon-greedy": EpsilonGreedy, "gaussian": Gaussian, "ornstein-uhlenbeck": OrnsteinUhlenbeck}


def make_noise(name: str, **options: Any) -> Noise:
    """Return the noise called `name`.

    Raises:
        UnknownName: no such noise.
        InvalidOption: no such option of this noise, or a value out of its range.
    """
    if name not in NOISES:
        raise UnknownName("noise", name, NOISES)
    check_names(f"noise {name!r}", "option", options, signature(NOISES[name]).parameters)
    return NOISES[name](**options)


def draw_all(noise: Noise, generators: Sequence[np.random.Generator], shape: tuple[int, ...],
             action_size: int) -> Array:
    """Return the draws [S, *shape, n] of all seeds, each from its own generator.

    Args:
        noise: What takes the draws.
        generators: One for each seed.
        shape: Of what one seed draws.
        action_size: A.
    """
    return np.stack([noise.draw(generator, shape, action_size) for generator in generators])
