"""One network of an agent with all that its training needs: target, gradient, Adam's moments."""

from collections.abc import Iterable, Sequence

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

    def part(self, seeds: Sequence[int], count: int) -> dict[str, Tensor]:
        """Return copies of `tensors()` for some seeds, by their places among all `count`.

        Where there are several networks of each seed, the first ones of all seeds come first.
        """
        twins = self.weights.flat.numel() // self.network.num_parameters // count
        members = [twin * count + seed for twin in range(twins) for seed in seeds]
        return {name: self.network.take(flat, members) for name, flat in self.tensors().items()}

    def descend(self, rate: Tensor) -> None:
        """Make one step of Adam against `gradient`; `rate` is one row of `adam_rates`."""
        _adam_step(self.weights.flat, self.gradient.flat, self.mean, self.square, rate)

    def follow(self, polyak: float) -> None:
        """Move the target: target <- polyak target + (1 - polyak) weights."""
        self.target.flat.lerp_(self.weights.flat, 1.0 - polyak)

    def values(self, inputs: Tensor) -> Tensor:
        """Return the outputs [S, B, out] for inputs [S, B, in]."""
        return self.network.forward(self.weights, inputs)[0]

    def target_values(self, inputs: Tensor) -> Tensor:
        """Return the target's outputs [S, B, out] for inputs [S, B, in]."""
        return self.network.forward(self.target, inputs)[0]

    def regress(self, inputs: Tensor, targets: Tensor) -> Tensor:
        """Return the mean squared distances [S] of the outputs from `targets` [S, B, 1]; leave their gradient."""
        values, tape = self.network.forward(self.weights, inputs)
        errors = values - targets
        self.network.backward(self.weights, tape, errors * (2.0 / errors.shape[1]), self.gradient)
        return errors.square().mean(dim=(1, 2))


class TrainedTensor:
    """One number for each seed [S], trained by Adam."""

    def __init__(self, values: Tensor, device: torch.device):
        self.values = values.to(device)
        self.gradient, self.mean, self.square = (torch.zeros_like(self.values) for _ in range(3))

    def tensors(self) -> dict[str, Tensor]:
        """Return everything that must be saved, each [S]."""
        return {"values": self.values, "mean": self.mean, "square": self.square}

    def descend(self, rate: Tensor) -> None:
        """Make one step of Adam against `gradient`; `rate` is one row of `adam_rates`."""
        _adam_step(self.values, self.gradient, self.mean, self.square, rate)


def _adam_step(weights: Tensor, gradient: Tensor, mean: Tensor, square: Tensor, rate: Tensor) -> None:
    step_size, epsilon = rate.unbind()
    mean.lerp_(gradient, 1.0 - BETA_1)
    square.mul_(BETA_2).addcmul_(gradient, gradient, value=1.0 - BETA_2)
    weights.sub_(mean.div(square.sqrt().add_(epsilon)).mul_(step_size))


def adam_rates(learning_rate: float, numbers: Iterable[int], device: torch.device) -> Tensor:
    """Return step sizes and epsilons [K, 2] of Adam's steps with these K numbers (counted from 1).

    Kingma and Ba's own reordering takes both bias corrections out of the loop over the parameters.
    """
    steps = np.array(list(numbers), dtype=np.float64)
    correction = np.sqrt(1.0 - BETA_2**steps)
    rates = np.stack([learning_rate * correction / (1.0 - BETA_1**steps), ADAM_EPSILON * correction], axis=1)
    return torch.from_numpy(rates.astype(np.float32)).to(device)
