"""An activation set that is learnt: the states from which a skill is likely to reach its goal."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray

REACH = 2.0
"""The set lies within so many times the radius of a ball: samples are drawn there, and nothing is known beyond."""
CONFIDENCE = 0.9
"""A state belongs to the set when the skill is that likely to reach its goal from there."""
HIDDEN, STEPS, RATE, DECAY = 16, 400, 0.03, 1e-3


@dataclass(frozen=True, eq=False)
class ClassifierSet:
    """States s with d(s, center) <= 2 radius and p(s) >= 0.9, where a small network tells the probability of success:

        p(s) = sigmoid(w_2 tanh(w_1 (o(s) - origin) / scale + b_1) + b_2)

    Unlike a ball it knows of all that the policy observes, such as speeds, which the distance between the states of a
    simulator leaves out.

    Attributes:
        center: The state in the middle [D]; distances are measured from there.
        radius: That of the ball in whose place it is.
        origin, scale: Mean and deviation of the observations it was learnt from [O].
        weights_1, bias_1, weights_2, bias_2: The network, [O, H], [H], [H, 1], [1].

    Source: [Matheron2020] 7.2.4 and the limitations of its conclusion. Differs: samples are drawn forwards from states
    around the centre, which needs no simulator that runs backwards, and the classifier learns from what came of each.
    """

    center: Array
    radius: float
    origin: Array
    scale: Array
    weights_1: Array
    bias_1: Array
    weights_2: Array
    bias_2: Array

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the centre."""
        return model.distance(states, self.center)

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] lie in the set."""
        inside = self.distance(model, states) <= REACH * self.radius
        if inside.any():  # observing a simulator's states is slow
            inside[inside] = self.probability(model.observe(states[inside])) >= CONFIDENCE
        return inside

    def probability(self, observations: Array) -> Array:
        """Return how likely the skill is to reach its goal [B] from where it observes `observations` [B, O]."""
        hidden = np.tanh((observations - self.origin) / self.scale @ self.weights_1 + self.bias_1)
        return 1.0 / (1.0 + np.exp(-(hidden @ self.weights_2 + self.bias_2)[:, 0]))


def learn_set(observations: Array, reached: BoolArray, center: Array, radius: float, seed: int) -> ClassifierSet:
    """Return the set around `center` [D] that tells observations [N, O] whence the goal was reached [N] from others.

    The network minimises the cross entropy and the squares of its weights, by Adam on all samples at once.
    """
    deviation = observations.std(axis=0)
    origin, scale = observations.mean(axis=0), np.where(deviation > 1e-9, deviation, 1.0)
    inputs = torch.from_numpy((observations - origin) / scale)
    parameters = _initial(inputs.shape[1], seed)
    labels = torch.from_numpy(reached.astype(np.float64))[:, None]
    optimizer = torch.optim.Adam(parameters, RATE)
    for _ in range(STEPS):
        weights_1, bias_1, weights_2, bias_2 = parameters
        logits = torch.tanh(inputs @ weights_1 + bias_1) @ weights_2 + bias_2
        loss = binary_cross_entropy_with_logits(logits, labels) + DECAY * (
            weights_1.square().mean() + weights_2.square().mean())
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return ClassifierSet(center, radius, origin, scale, *(values.detach().numpy() for values in parameters))


def _initial(size: int, seed: int) -> list[Tensor]:
    """Return random weights and zero biases."""
    random = torch.Generator().manual_seed(seed)
    weights_1 = torch.randn(size, HIDDEN, generator=random, dtype=torch.float64) / size**0.5
    weights_2 = torch.randn(HIDDEN, 1, generator=random, dtype=torch.float64) / HIDDEN**0.5
    parameters = [weights_1, torch.zeros(HIDDEN, dtype=torch.float64), weights_2, torch.zeros(1, dtype=torch.float64)]
    return [values.requires_grad_() for values in parameters]
