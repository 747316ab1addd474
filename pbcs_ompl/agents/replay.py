"""A replay buffer stacked over seeds: one ring of float32 rows for each seed."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pbcs_ompl.agents.kernels.counter_rng import hashed, stream_keys
from pbcs_ompl.core.compiled import njit
from pbcs_ompl.core.types import Array, BoolArray, IndexArray

FIRST_ALLOCATION = 4096


class Batch(NamedTuple):
    """Mini-batches of one update: views of rows [S, B, O + A + 2 + O]."""

    observations: Tensor
    obs_actions: Tensor
    """Observations and actions side by side [S, B, O + A], as a critic takes them."""
    rewards: Tensor
    """[S, B, 1]"""
    not_done: Tensor
    """1 - terminal [S, B, 1]"""
    next_observations: Tensor


class Replay:
    """Rings of transitions, sampled uniformly with replacement.

    Memory grows as it is filled. A seed's draws are a function of its seed and of how many were made before,
    so a stack of S seeds draws what S separate buffers draw, however many are made at once.

    Args:
        seeds: One number for each ring.
        capacity: The most transitions a ring holds; then the oldest are overwritten.
    """

    def __init__(self, observation_size: int, action_size: int, *, seeds: tuple[int, ...], capacity: int,
                 device: torch.device):
        self.observation_size, self.action_size, self.capacity = observation_size, action_size, capacity
        self._device = device
        self._keys = stream_keys(seeds, "replay")
        width = 2 * observation_size + action_size + 2
        self._rows = torch.zeros(len(seeds), min(FIRST_ALLOCATION, capacity), width, device=device)
        self.sizes: IndexArray = np.zeros(len(seeds), dtype=np.int64)
        self._written: IndexArray = np.zeros(len(seeds), dtype=np.int64)
        self._drawn = 0

    def add(self, observations: Array, actions: Array, rewards: Array, next_observations: Array,
            terminals: Array, mask: BoolArray | None = None) -> None:
        """Append transitions [S, B, ...], in order; `mask` [S, B] says which ones."""
        rows = np.concatenate([observations, actions, rewards[..., None], 1.0 - terminals[..., None],
                               next_observations], axis=-1, dtype=np.float32, casting="unsafe")
        mask = np.ones(rows.shape[:2], dtype=np.bool_) if mask is None else mask
        counts = mask.sum(axis=1)
        rank = np.cumsum(mask, axis=1) - 1
        kept = mask & (rank >= (counts - self.capacity)[:, None])
        self._reserve(int((self.sizes + counts).max()))
        seed, item = np.nonzero(kept)
        place = (self._written[seed] + rank[seed, item]) % self.capacity
        flat = torch.from_numpy(seed * self._rows.shape[1] + place).to(self._device)
        self._rows.view(-1, self._rows.shape[2])[flat] = torch.from_numpy(rows[seed, item]).to(self._device)
        self._written += counts
        self.sizes = np.minimum(self._written, self.capacity)

    def sample(self, count: int, batch_size: int) -> Tensor:
        """Return rows [count, S, batch_size, W] for `count` updates; see `unpack`. No ring may be empty."""
        seeds = len(self._keys)
        flat = np.empty((count, seeds, batch_size), dtype=np.int64)
        _draw(self._keys, self._drawn, self.sizes, self._rows.shape[1], flat)
        self._drawn += count * batch_size
        rows = self._rows.view(-1, self._rows.shape[2])
        picked = rows.index_select(0, torch.from_numpy(flat.reshape(-1)).to(self._device))
        return picked.view(count, seeds, batch_size, -1)

    def unpack(self, rows: Tensor) -> Batch:
        """Return the fields of rows [S, B, W] as views."""
        split = self.observation_size + self.action_size
        return Batch(rows[..., : self.observation_size], rows[..., :split], rows[..., split : split + 1],
                     rows[..., split + 1 : split + 2], rows[..., split + 2 :])

    def clear(self) -> None:
        """Empty all rings; the memory and the position in the stream of draws are kept."""
        self.sizes = np.zeros_like(self.sizes)
        self._written = np.zeros_like(self._written)

    def state_dict(self, seeds: Sequence[int] | None = None) -> dict[str, np.ndarray]:
        """Return the contents, up to the longest ring, and the position in the stream of draws.

        Args:
            seeds: Which rings, by their indices; None for all.
        """
        chosen = np.arange(len(self.sizes)) if seeds is None else np.array(seeds)
        rows = self._rows[torch.from_numpy(chosen).to(self._device), : int(self.sizes[chosen].max())]
        return {"rows": rows.cpu().numpy(), "written": self._written[chosen], "drawn": np.array(self._drawn)}

    def can_load(self, state: dict[str, np.ndarray]) -> bool:
        """Return whether `state` is of a buffer of this shape."""
        if set(state) != {"rows", "written", "drawn"}:
            return False
        rows = state["rows"].shape
        fits = len(rows) == 3 and (rows[0], rows[2]) == (self._rows.shape[0], self._rows.shape[2])
        return fits and rows[1] <= self.capacity and state["written"].shape == self.sizes.shape

    def load_state_dict(self, state: dict[str, np.ndarray]) -> None:
        """Continue from `state_dict()` of a buffer of the same shape, capacity and seeds."""
        rows = torch.from_numpy(np.ascontiguousarray(state["rows"], dtype=np.float32))
        self._reserve(rows.shape[1])
        self._rows[:, : rows.shape[1]] = rows.to(self._device)
        self._written = state["written"].astype(np.int64)
        self.sizes = np.minimum(self._written, self.capacity)
        self._drawn = int(state["drawn"])

    def _reserve(self, size: int) -> None:
        """Grow by doubling; a ring never wraps before it has its full capacity, so rows keep their positions."""
        allocated = self._rows.shape[1]
        if min(size, self.capacity) <= allocated:
            return
        while allocated < min(size, self.capacity):
            allocated *= 2
        larger = self._rows.new_zeros(self._rows.shape[0], min(allocated, self.capacity), self._rows.shape[2])
        larger[:, : self._rows.shape[1]] = self._rows
        self._rows = larger


@njit()
def _draw(keys: NDArray[np.uint64], start: int, sizes: IndexArray, stride: int, out: IndexArray) -> None:
    """Fill `out` [K, S, B] with flat row numbers; draw n of a seed is a function of its key and n."""
    count, seeds, batch_size = out.shape
    for k in range(count):
        for s in range(seeds):
            for b in range(batch_size):
                draw = hashed(keys[s], start + k * batch_size + b + 1)
                out[k, s, b] = s * stride + np.int64(draw * sizes[s])
