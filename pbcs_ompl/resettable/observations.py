"""Observations as vectors: what the environment reports, as policies see it."""

from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.bounds import widened

EMPTY = np.empty(0)


def flat(observation: Any) -> Array:
    """Return an observation as one vector.

    The entries of a dictionary follow each other in the order of their names, those of a tuple in their order; each
    element of a `Discrete` space is one number (`gymnasium.wrappers.FlattenObservation` makes one-hot vectors of them).
    """
    if isinstance(observation, np.ndarray) and observation.ndim == 1:
        return observation.astype(np.float64)
    if isinstance(observation, dict | tuple):
        return np.concatenate([EMPTY, *_leaves(observation)])
    return np.array(observation, dtype=np.float64).ravel()


def parts(space: gymnasium.Space[Any]) -> list[gymnasium.Space[Any]]:
    """Return the spaces that `flat` puts one after the other."""
    if isinstance(space, spaces.Dict):
        return [part for key in sorted(space.spaces) for part in parts(space.spaces[key])]
    if isinstance(space, spaces.Tuple):
        return [part for inner in space.spaces for part in parts(inner)]
    return [space]


def flat_size(space: gymnasium.Space[Any]) -> int:
    """Return how many numbers `flat` makes of an observation."""
    return sum(int(np.prod(part.shape or ())) for part in parts(space))


def flat_bounds(space: gymnasium.Space[Any]) -> tuple[Array, Array]:
    """Return the bounds of the numbers that `flat` makes of an observation; infinite ones where there are none."""
    low, high = zip(*map(_part_bounds, parts(space)), strict=True)
    return np.concatenate(low), np.concatenate(high)


def rounded(vectors: Array, space: gymnasium.Space[Any]) -> Array:
    """Return observations [B, O] as an environment returns them: in float32 where a box of its space is."""
    ends = np.cumsum([flat_size(part) for part in parts(space)])
    if vectors.shape[1] != ends[-1]:
        return vectors
    pieces = [piece.astype(part.dtype).astype(np.float64) if isinstance(part, spaces.Box) and part.dtype.kind == "f"
              else piece for part, piece in zip(parts(space), np.split(vectors, ends[:-1], axis=1), strict=True)]
    return np.concatenate(pieces, axis=1)


def has_goals(env: Any) -> bool:
    """Return whether observations of an environment, below all wrappers, have an achieved goal (`GoalEnv`)."""
    space = env.unwrapped.observation_space
    return isinstance(space, spaces.Dict) and "achieved_goal" in space.spaces


def unflat(vector: Array, space: gymnasium.Space[Any]) -> Any:
    """Return the observation, a member of `space` but for rounding, that `flat` makes a vector of."""
    if isinstance(space, spaces.Dict | spaces.Tuple):
        inner = {key: space.spaces[key] for key in sorted(space.spaces)} if isinstance(space, spaces.Dict) else dict(
            enumerate(space.spaces))
        ends = np.cumsum([flat_size(part) for part in inner.values()])
        made = {key: unflat(piece, part) for (key, part), piece in
                zip(inner.items(), np.split(vector, ends[:-1]), strict=True)}
        return made if isinstance(space, spaces.Dict) else tuple(made.values())
    return np.asarray(vector).reshape(space.shape or ()).astype(space.dtype)[()]


def _part_bounds(space: gymnasium.Space[Any]) -> tuple[Array, Array]:
    if isinstance(space, spaces.Box):
        return widened(space.low, -np.inf).ravel(), widened(space.high, np.inf).ravel()
    size = flat_size(space)
    if isinstance(space, spaces.Discrete):
        return np.array([float(space.start)]), np.array([float(space.start + space.n - 1)])
    if isinstance(space, spaces.MultiDiscrete):
        return (np.array(space.start, np.float64).ravel(),
                np.array(space.start + space.nvec - 1, np.float64).ravel())
    if isinstance(space, spaces.MultiBinary):
        return np.zeros(size), np.ones(size)
    return np.full(size, -np.inf), np.full(size, np.inf)


def _leaves(observation: Any) -> Iterator[Array]:
    """Yield the vectors that `flat` puts one after the other."""
    if isinstance(observation, dict):
        for key in sorted(observation):
            yield from _leaves(observation[key])
    elif isinstance(observation, tuple):
        for part in observation:
            yield from _leaves(part)
    else:
        yield np.asarray(observation, dtype=np.float64).ravel()
