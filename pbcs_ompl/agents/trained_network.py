"""One network of an agent with all that its training needs: target, gradient, Adam's moments."""

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.network_kernels import BETA_1, BETA_2
from pbcs_ompl.agents.networks import MLP, Weights

ADAM_EPSILON = 1e-8


class TrainedNetwork:
    """A stack of S networks of one shape, trained by Adam and followed by a slowly moving target."""

    def __init__(self, network: MLP, generators: Sequence[torch.Generator], device: torch.device):
        self.network = network
        initial = network.initial(generators).to(device)
        self.weights = Weights(network, initial)
        self.target = Weights(network, initial.clone())
        self.gradient = Weights(network, torch.zeros_like(initial))
        self.mean = torch.zeros_like(initial)
        self.square = torch.zeros_like(initial)

    def tensors(self) -> dict[str, Tensor]:
        """Return everything that must be saved, each [S * P]."""
        return {"weights": self.weights.flat, "target": self.target.flat,
                "mean": self.mean, "square": self.square}

    def descend(self, rate: Tensor) -> None:
        """Make one step of Adam against `gradient`; `rate` is one row of `adam_rates`."""
        step_size, epsilon = rate.unbind()
        gradient = self.gradient.flat
        self.mean.lerp_(gradient, 1.0 - BETA_1)
        self.square.mul_(BETA_2).addcmul_(gradient, gradient, value=1.0 - BETA_2)
        self.weights.flat.sub_(self.mean.div(self.square.sqrt().add_(epsilon)).mul_(step_size))

    def follow(self, polyak: float) -> None:
        """Move the target: target <- polyak target + (1 - polyak) weights."""
        self.target.flat.lerp_(self.weights.flat, 1.0 - polyak)


def adam_rates(learning_rate: float, first: int, count: int, device: torch.device) -> Tensor:
    """Return step sizes and epsilons [count, 2] of Adam's steps first, first + 1, ... (counted from 1).

    Kingma and Ba's own reordering takes both bias corrections out of the loop over the parameters.
    """
    steps = np.arange(first, first + count, dtype=np.float64)
    correction = np.sqrt(1.0 - BETA_2**steps)
    rates = np.stack([learning_rate * correction / (1.0 - BETA_1**steps), ADAM_EPSILON * correction], axis=1)
    return torch.from_numpy(rates.astype(np.float32)).to(device)
