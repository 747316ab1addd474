"""How networks take observations and actions: as they are, or as in OpenAI Baselines.

"plain": the critic takes observation and action side by side in the environment's units: Spinning Up (2018).

"baselines": observations are normalised by their running mean and deviation, actions are in [-1, 1], and the critic's
action joins the values of its first hidden layer: OpenAI Baselines (2018), baselines/ddpg/ddpg.py and models.py, after
Lillicrap et al. (2015). Differs: normalised observations are not clipped to [-5, 5]; so a policy is a plain network.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.losses import ActionBox
from pbcs_ompl.core.types import Array, BoolArray

PRIOR_COUNT = 1e-2
"""Of an observation 0 with the square 1 before the first one; also the least variance (OpenAI Baselines, 2018)."""


class PlainInputs:
    """Observations and actions as they are.

    Attributes:
        box: The actions that networks take; a critic's inputs are scaled to it.
        late_actions: Whether the critic's action skips the first layer.
    """

    late_actions = False

    def __init__(self, seeds: int, observation_size: int, box: ActionBox):
        self.box = box

    def add(self, observations: Array, mask: BoolArray | None) -> None:
        """Learn from new observations [S, B, O], those of the mask [S, B]."""

    def observations(self, observations: Tensor) -> Tensor:
        """Return what networks take for observations [S, B, O]."""
        return observations

    def actions(self, actions: Tensor) -> Tensor:
        """Return what a critic takes for actions [S, B, A]."""
        return actions

    def rows(self, rows: Tensor) -> Tensor:
        """Return what networks take for rows of the replay buffer [K, S, B, W]; see `Replay.unpack`."""
        return rows

    def raw_layer(self, weight: np.ndarray, bias: np.ndarray, seed_index: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the weight [O, out] and bias [out] of a first layer that does the same with plain observations."""
        return weight, bias

    def state_dict(self, indices: Sequence[int]) -> dict[str, np.ndarray]:
        """Return what was learnt, of some seeds by their indices."""
        return {}

    def load_state_dict(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from `state_dict()`."""


class BaselinesInputs(PlainInputs):
    """Normalised observations, and actions in [-1, 1]; see the module."""

    late_actions = True

    def __init__(self, seeds: int, observation_size: int, box: ActionBox):
        self._action_box = box
        super().__init__(seeds, observation_size, ActionBox(torch.ones_like(box.half), torch.zeros_like(box.centre)))
        self._count = np.full(seeds, PRIOR_COUNT)
        self._sum = np.zeros((seeds, observation_size))
        self._squares = np.full((seeds, observation_size), PRIOR_COUNT)
        self._refresh()

    def _refresh(self) -> None:
        mean = self._sum / self._count[:, None]
        variance = self._squares / self._count[:, None] - mean**2
        self._mean, self._deviation = (
            torch.from_numpy(values.astype(np.float32))[:, None].to(self.box.half.device)
            for values in (mean, np.sqrt(np.maximum(variance, PRIOR_COUNT))))

    def add(self, observations: Array, mask: BoolArray | None) -> None:
        """Add observations to the means and deviations of each seed."""
        kept = np.ones(observations.shape[:2]) if mask is None else mask.astype(np.float64)
        values = np.where(kept[..., None] > 0.0, observations, 0.0)
        self._count += kept.sum(axis=1)
        self._sum += values.sum(axis=1)
        self._squares += (values**2).sum(axis=1)
        self._refresh()

    def observations(self, observations: Tensor) -> Tensor:
        """Return (o - mean) / deviation."""
        return (observations - self._mean) / self._deviation

    def actions(self, actions: Tensor) -> Tensor:
        """Return actions in [-1, 1]."""
        return self._action_box.squash(actions)

    def rows(self, rows: Tensor) -> Tensor:
        """Return rows with observations and actions as the networks take them."""
        size = self._mean.shape[2]
        taken, rest = rows[..., size : -size - 2], rows[..., -size - 2 : -size]
        return torch.cat((self.observations(rows[..., :size]), self.actions(taken), rest,
                          self.observations(rows[..., -size:])), dim=-1)

    def raw_layer(self, weight: np.ndarray, bias: np.ndarray, seed_index: int) -> tuple[np.ndarray, np.ndarray]:
        """Fold mean and deviation into the layer."""
        mean, deviation = (values[seed_index, 0].cpu().numpy() for values in (self._mean, self._deviation))
        raw = weight / deviation[:, None]
        return raw, bias - mean @ raw

    def state_dict(self, indices: Sequence[int]) -> dict[str, np.ndarray]:
        """Return count [S], sum and squares [S, O] of the observations so far."""
        chosen = list(indices)
        return {"count": self._count[chosen], "sum": self._sum[chosen], "squares": self._squares[chosen]}

    def load_state_dict(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from `state_dict()`."""
        self._count, self._sum, self._squares = (np.array(state[name], dtype=np.float64)
                                                 for name in ("count", "sum", "squares"))
        self._refresh()


INPUT_KINDS: dict[str, type[PlainInputs]] = {"plain": PlainInputs, "baselines": BaselinesInputs}
