"""The policy of one skill: an actor, and how it observes the world."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.errors import DamagedFile, MissingDependency
from pbcs_ompl.core.types import Array
from pbcs_ompl.results.files import read_bytes, write_atomically


@dataclass(frozen=True, eq=False)
class ObservationTransform:
    """What a policy sees of observations: (o - origin) / scale, with origin and scale [O]."""

    origin: Array
    scale: Array

    def __call__(self, observations: Array) -> Array:
        """Return the transformed observations [B, O]."""
        return (observations - self.origin) / self.scale

    @classmethod
    def identity(cls, size: int) -> "ObservationTransform":
        """Return the transform that changes nothing."""
        return cls(np.zeros(size), np.ones(size))

    @classmethod
    def relative(cls, origin: Array, observations: Array, horizon: int) -> "ObservationTransform":
        """Return the transform to observations relative to a goal.

        Args:
            origin: The observation of the goal [O].
            observations: Those along a plan [T+1, O]; the largest movement in a step is the unit.
            horizon: Number of such steps that have the length 1.
        """
        largest = np.abs(np.diff(observations, axis=0)).max(axis=0)
        return cls(origin, np.where(largest > 0, horizon * largest, 1.0))


@dataclass(frozen=True, eq=False)
class SkillPolicy:
    """An immutable actor and the transform it was trained with."""

    actor: Policy
    transform: ObservationTransform

    def act(self, observations: Array) -> Array:
        """Return the actions [B, A] for plain observations [B, O]."""
        return self.actor.act(self.transform(observations))


def policy_to_arrays(policy: SkillPolicy) -> dict[str, np.ndarray]:
    """Return a policy as named arrays."""
    return policy.actor.to_arrays() | {"origin": policy.transform.origin, "scale": policy.transform.scale}


def policy_from_arrays(arrays: dict[str, np.ndarray]) -> SkillPolicy:
    """Return the policy of `policy_to_arrays`.

    Raises:
        KeyError: an array of the transform is missing.
        DamagedFile: arrays of the actor are missing or do not fit.
    """
    return SkillPolicy(Policy.from_arrays({name: array for name, array in arrays.items()
                                           if name not in ("origin", "scale")}),
                       ObservationTransform(arrays["origin"], arrays["scale"]))


def save_policies(path: Path, policies: list[SkillPolicy]) -> None:
    """Write the policies of a chain into one safetensors file, atomically."""
    save, _ = _safetensors()
    tensors: dict[str, np.ndarray] = {}
    for index, policy in enumerate(policies):
        tensors |= {f"{index}.{name}": np.ascontiguousarray(array)
                    for name, array in policy_to_arrays(policy).items()}
    write_atomically(path, lambda file: file.write(save(tensors)))


def load_policies(path: Path, count: int) -> list[SkillPolicy]:
    """Read `count` policies.

    Raises:
        DamagedFile: the file is missing, truncated, or holds other policies.
    """
    _, load = _safetensors()
    try:
        tensors = load(read_bytes(path))
    except FileNotFoundError as error:
        raise DamagedFile(f"{path} does not exist") from error
    except Exception as error:  # safetensors raises its own SafetensorError, which is no public base class
        raise DamagedFile(f"{path} is damaged: {error}") from error
    try:
        return [policy_from_arrays({name.partition(".")[2]: array for name, array in tensors.items()
                                    if name.partition(".")[0] == str(index)}) for index in range(count)]
    except KeyError as error:
        raise DamagedFile(f"{path} is damaged: it lacks {error}") from error
    except DamagedFile as error:
        raise DamagedFile(f"{path} is damaged: {error}") from error


def _safetensors() -> tuple[Callable[..., bytes], Callable[..., dict[str, np.ndarray]]]:
    """Return the functions that write and read tensors."""
    try:
        from safetensors.numpy import load, save
    except ModuleNotFoundError as error:
        raise MissingDependency('skills are saved with safetensors: pip install "pbcs-ompl[rl]"') from error
    return save, load
