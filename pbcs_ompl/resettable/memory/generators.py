"""Random generators that steps draw from: a restored state would not bring their numbers back."""

import hashlib
import random
from collections.abc import Mapping
from typing import Any

import numpy as np

from pbcs_ompl.resettable.memory.owned import GENERATORS, Path, text_of


def states(generators: Mapping[Path, Any]) -> dict[str, bytes]:
    """Return what stands for the state of each generator, by name: of those given, numpy's global one, and `random`."""
    own = {text_of(path).replace("_np_random", "np_random"): _state(value) for path, value in generators.items()}
    return {**own, "numpy's global generator (np.random)": _state(np.random.mtrand._rand),
            "the module random": str(hash(random.getstate())).encode()}


def drawn(before: dict[str, bytes], after: dict[str, bytes]) -> str:
    """Return the name of a generator whose state has changed, or an empty string."""
    return next((name for name, state in after.items() if before.get(name, state) != state), "")


def _state(generator: Any) -> bytes:
    assert isinstance(generator, GENERATORS)
    if isinstance(generator, random.Random):
        return str(hash(generator.getstate())).encode()
    if isinstance(generator, np.random.RandomState):
        return _digest(generator.get_state(legacy=True))
    bits = generator.bit_generator if isinstance(generator, np.random.Generator) else generator
    return _digest(bits.state)


def _digest(state: Any) -> bytes:
    parts = [part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode() for part in _flat(state)]
    return hashlib.blake2b(b"|".join(parts), digest_size=16).digest()


def _flat(state: Any) -> list[Any]:
    if isinstance(state, dict):
        return [part for value in state.values() for part in _flat(value)]
    return [part for value in state for part in _flat(value)] if isinstance(state, tuple) else [state]
