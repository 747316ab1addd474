"""A policy as plain arrays: what is kept of an actor after training, and all that a skill needs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pbcs_ompl.agents.kernels.network import Shape, outputs, shape_of
from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.types import Array, IndexArray

Float32Array = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Policy:
    """A deterministic actor: ReLU layers, a tanh, and an affine map onto the action box. Immutable.

    Attributes:
        layers: One tuple for each layer: weight [in, out], bias [out], and gain [out], shift [out] where the
            layer is normalised; float32.
        action_low, action_high: The box [A].
    """

    layers: tuple[tuple[Float32Array, ...], ...]
    action_low: Array
    action_high: Array

    def __post_init__(self) -> None:
        for array in _all_arrays(self.layers, self.action_low, self.action_high):
            array.setflags(write=False)

    @property
    def observation_size(self) -> int:
        """Length O of an observation."""
        return int(self.layers[0][0].shape[0])

    @property
    def sizes(self) -> tuple[int, ...]:
        """Widths of the layers, from the observation to the action."""
        return (self.observation_size, *(layer[0].shape[1] for layer in self.layers))

    @property
    def is_plain(self) -> bool:
        """Whether no layer is normalised; if not, all hidden ones are."""
        return all(len(layer) == 2 for layer in self.layers)

    @property
    def shape(self) -> Shape:
        """The shape of the network."""
        return shape_of(self.sizes, not self.is_plain)

    @cached_property
    def parameters(self) -> Float32Array:
        """All parameters, layer by layer [P]."""
        return np.concatenate([array.ravel() for layer in self.layers for array in layer])

    def act(self, observations: Array) -> Array:
        """Return the actions [B, A] for observations [B, O]."""
        values = observations.astype(np.float32)
        first = np.zeros(len(values), np.int64)
        raw = outputs(self.shape, self.parameters[None], values, first)
        return to_box(np.tanh(raw), self.action_low, self.action_high)

    def blended(self, other: "Policy", share: float) -> "Policy":
        """Return the policy of the same sizes with the parameters (1 - share) p + share q.

        Args:
            other: The policy of q.
            share: Within [0, 1].
        """
        layers = tuple(tuple(np.asarray((1.0 - share) * mine + share * its, dtype=np.float32)
                             for mine, its in zip(*pair, strict=True))
                       for pair in zip(self.layers, other.layers, strict=True))
        return Policy(layers, self.action_low, self.action_high)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return the policy as named arrays: low, high, weight_0, bias_0 (gain_0, shift_0), weight_1, ..."""
        arrays: dict[str, np.ndarray] = {"low": self.action_low.copy(), "high": self.action_high.copy()}
        for index, layer in enumerate(self.layers):
            names = ("weight", "bias", "gain", "shift")
            arrays |= {f"{name}_{index}": array.copy() for name, array in zip(names, layer, strict=False)}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, Any]) -> "Policy":
        """Return the policy of `to_arrays()`.

        Raises:
            DamagedFile: arrays are missing, do not fit together, or hold values that are not finite.
        """
        count = sum(name.startswith("weight_") for name in arrays)
        try:
            layers = tuple(
                tuple(np.array(arrays[f"{name}_{index}"], dtype=np.float32)
                      for name in ("weight", "bias", "gain", "shift")
                      if name in ("weight", "bias") or f"{name}_{index}" in arrays)
                for index in range(count))
            low, high = (np.array(arrays[name], dtype=np.float64) for name in ("low", "high"))
        except KeyError as error:
            raise DamagedFile(f"policy without the array {error}") from error
        except (TypeError, ValueError) as error:
            raise DamagedFile(f"policy with an array that has no numbers: {error}") from error
        _check(layers, low, high)
        return cls(layers, low, high)


class PolicyStack:
    """N policies of one action box that act together: compiled where their layers are alike."""

    def __init__(self, policies: Sequence[Policy]):
        self._policies = policies
        self._low, self._high = policies[0].action_low, policies[0].action_high
        self._shape = policies[0].shape
        alike = all(policy.shape == self._shape for policy in policies)
        self._parameters = np.array([policy.parameters for policy in policies]) if alike else None

    def act(self, observations: Array, chosen: IndexArray) -> Array:
        """Return the actions [B, A] of the policies `chosen` [B] for observations [B, O]."""
        if self._parameters is not None:
            raw = outputs(self._shape, self._parameters, observations.astype(np.float32), chosen)
            return to_box(np.tanh(raw), self._low, self._high)
        actions = np.empty((len(observations), len(self._low)))
        for index in set(chosen.tolist()):
            mine = chosen == index
            actions[mine] = self._policies[index].act(observations[mine])
        return actions


def to_box(squashed: np.ndarray, low: Array, high: Array) -> Array:
    """Map values in [-1, 1] onto the box, as float64; rounding never leaves the box."""
    actions = (squashed.astype(np.float64) + 1.0) * (0.5 * (high - low)) + low
    return np.minimum(np.maximum(actions, low, out=actions), high, out=actions)


def _all_arrays(layers: tuple[tuple[Float32Array, ...], ...], low: Array, high: Array) -> list[np.ndarray]:
    return [*(array for layer in layers for array in layer), low, high]


def _check(layers: tuple[tuple[Float32Array, ...], ...], low: Array, high: Array) -> None:
    widths = [layer[0].shape for layer in layers]
    chained = all(len(shape) == 2 for shape in widths) and bool(widths) and all(
        before[1] == after[0] for before, after in pairwise(widths))
    if not chained or any(array.shape != (layer[0].shape[1],) for layer in layers for array in layer[1:]):
        raise DamagedFile(f"policy whose layers do not fit together: weights {widths}")
    if {len(layer) for layer in layers[:-1]} not in ({2}, {4}, set()) or len(layers[-1]) != 2:
        raise DamagedFile("policy with layers of which some are normalised, expected all hidden ones or none")
    if low.shape != (widths[-1][1],) or high.shape != low.shape:
        raise DamagedFile(f"policy with {widths[-1][1]} outputs and action bounds {low.shape}, {high.shape}")
    if not all(np.isfinite(array).all() for array in _all_arrays(layers, low, high)):
        raise DamagedFile("policy with values that are not finite")
