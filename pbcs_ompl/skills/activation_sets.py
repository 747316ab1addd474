"""Where a skill leads, its target, and where it may start: balls around states, learnt sets, the environment's goal."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from pbcs_ompl.core.errors import DamagedFile
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray
from pbcs_ompl.skills.settings import Settings


class Target(Protocol):
    """A set of states, with a distance to its centre."""

    @property
    def radius(self) -> float:
        """The distance within which a state belongs to the set."""
        ...

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the centre of the set."""
        ...

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] lie in the set."""
        ...


class ActivationSet(Target, Protocol):
    """A set of states in which a skill may start: a `Ball` or a `ClassifierSet`. The skill before it aims at it."""

    @property
    def center(self) -> Array:
        """The state in its middle [D]."""
        ...


@dataclass(frozen=True, eq=False)
class Ball:
    """The closed ball B_radius(center) by the environment's distance; [Matheron2020] section 7.2."""

    center: Array
    radius: float

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the centre."""
        return model.distance(states, self.center)

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] lie in the ball."""
        return self.distance(model, states) <= self.radius


@dataclass(frozen=True, eq=False)
class EnvironmentGoal:
    """The environment's own goal: `goal_distance < goal_threshold`."""

    radius: float

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the environment's goal."""
        return model.goal_distance(states)

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] the environment calls a success."""
        return model.goal_distance(states) < self.radius


@dataclass(frozen=True)
class ClassifierSettings(Settings):
    """How an activation set is learnt. [Matheron2020] only proposes it: all values are ours, and not tuned.

    Attributes:
        samples: Episodes that a finished skill is tried for.
        reach: The set ends at this multiple of the radius of a ball, where the samples end.
        confidence: Estimated probability of success from which a state belongs to the set.
        hidden_units: Width of the network's hidden layer.
        gradient_steps: Steps of Adam on all samples.
        learning_rate: Of Adam.
        weight_decay: Weight of the mean squares of the weights in the loss.
    """

    samples: int = 400
    reach: float = 2.0
    confidence: float = 0.9
    hidden_units: int = 16
    gradient_steps: int = 400
    learning_rate: float = 0.03
    weight_decay: float = 1e-3

    def _check_ranges(self) -> None:
        self._check_counts("samples", "hidden_units", "gradient_steps")
        self._check_positive("reach", "learning_rate")
        self._check_fractions("confidence")
        self._check_at_least(0, "weight_decay")


@dataclass(frozen=True, eq=False)
class SuccessNetwork:
    """A small network that says from which observations a skill reaches its target:

        p(o) = sigmoid(w_2 tanh(w_1 (o - origin) / scale + b_1) + b_2).

    Attributes:
        confidence: Probability from which an observation is accepted.
        origin, scale: Mean and deviation of the observations it was learnt from [O].
        weights_1, bias_1, weights_2, bias_2: The network, [O, H], [H], [H, 1], [1].
    """

    confidence: float
    origin: Array
    scale: Array
    weights_1: Array
    bias_1: Array
    weights_2: Array
    bias_2: Array

    def probability(self, observations: Array) -> Array:
        """Return how likely the skill is to reach its target [B] from where it observes `observations` [B, O]."""
        hidden = np.tanh((observations - self.origin) / self.scale @ self.weights_1 + self.bias_1)
        return 1.0 / (1.0 + np.exp(-(hidden @ self.weights_2 + self.bias_2)[:, 0]))

    def accepts(self, observations: Array) -> BoolArray:
        """Return at which observations [B, O] the probability is high enough [B]."""
        accepted: BoolArray = self.probability(observations) >= self.confidence
        return accepted


@dataclass(frozen=True, eq=False)
class ClassifierSet(SuccessNetwork):
    """States s with d(s, center) <= reach radius whose observations a network accepts.

    Unlike a ball it depends on all that the policy observes, such as speeds, which the distance between the states of a
    simulator leaves out.

    Attributes:
        center: The state in the middle [D]; distances are measured from there.
        radius: That of the ball in whose place it is.
        reach: See `ClassifierSettings`.

    Source: [Matheron2020] 7.2.4 and the limitations of its conclusion. Differs: samples are drawn forwards from states
    around the centre, which needs no simulator that runs backwards, and the classifier learns from their outcomes.
    """

    center: Array
    radius: float
    reach: float

    def distance(self, model: ResettableModel, states: Array) -> Array:
        """Return the distances [B] from states [B, D] to the centre."""
        return model.distance(states, self.center)

    def contains(self, model: ResettableModel, states: Array) -> BoolArray:
        """Return which of the states [B, D] lie in the set."""
        inside = self.distance(model, states) <= self.reach * self.radius
        if inside.any():  # observing a simulator's states is slow
            inside[inside] = self.accepts(model.observe(states[inside]))
        return inside


def learn_set(observations: Array, reached: BoolArray, ball: Ball, settings: ClassifierSettings,
              seed: int) -> ClassifierSet:
    """Return the set in place of `ball` that separates successes from failures.

    The network minimises the cross entropy and the squares of its weights, by Adam on all samples at once.

    Args:
        observations: What the skill observed where it started [N, O].
        reached: Whether it reached its target from there [N].
        ball: Centre and radius.
        settings: Size and training of the network.
        seed: Of its first weights.
    """
    deviation = observations.std(axis=0)
    origin, scale = observations.mean(axis=0), np.where(deviation > 1e-9, deviation, 1.0)
    inputs = torch.from_numpy((observations - origin) / scale)
    parameters = _initial(inputs.shape[1], settings.hidden_units, seed)
    labels = torch.from_numpy(reached.astype(np.float64))[:, None]
    optimizer = torch.optim.Adam(parameters, settings.learning_rate)
    for _ in range(settings.gradient_steps):
        weights_1, bias_1, weights_2, bias_2 = parameters
        logits = torch.tanh(inputs @ weights_1 + bias_1) @ weights_2 + bias_2
        loss = binary_cross_entropy_with_logits(logits, labels) + settings.weight_decay * (
            weights_1.square().mean() + weights_2.square().mean())
        optimizer.zero_grad()
        torch.autograd.backward(loss)
        optimizer.step()
    learnt = [np.asarray(values.detach().numpy(), dtype=np.float64) for values in parameters]
    network = dict(zip(("weights_1", "bias_1", "weights_2", "bias_2"), learnt, strict=True))
    return ClassifierSet(confidence=settings.confidence, origin=origin, scale=scale, center=ball.center,
                         radius=ball.radius, reach=settings.reach, **network)


def _initial(size: int, hidden: int, seed: int) -> list[Tensor]:
    """Return random weights and zero biases."""
    random = torch.Generator().manual_seed(seed)
    weights_1 = torch.randn(size, hidden, generator=random, dtype=torch.float64) / size**0.5
    weights_2 = torch.randn(hidden, 1, generator=random, dtype=torch.float64) / hidden**0.5
    parameters = [weights_1, torch.zeros(hidden, dtype=torch.float64), weights_2, torch.zeros(1, dtype=torch.float64)]
    return [values.requires_grad_() for values in parameters]


KINDS: dict[str, type[Any]] = {"ball": Ball, "classifier": ClassifierSet, "goal": EnvironmentGoal}
"""What a file may hold, by the name it has there."""


def kind_of(part: Any) -> str:
    """Return the name of the kind of a set: "ball", "classifier" or "goal"."""
    return next(name for name, kind in KINDS.items() if type(part) is kind)


def to_arrays(part: Any, name: str) -> dict[str, np.ndarray]:
    """Return the attributes of a set, arrays and numbers, as arrays called "<name>.<attribute>"."""
    return {f"{name}.{field.name}": np.asarray(getattr(part, field.name)) for field in fields(part)}


def from_arrays(kind: str, arrays: Mapping[str, np.ndarray], name: str) -> Any:
    """Return the set of `to_arrays`.

    Args:
        kind: Its name, as `kind_of` returns it.
        arrays: Those of `to_arrays`, perhaps among others.
        name: The one that was given to `to_arrays`.

    Raises:
        DamagedFile: an array is missing, or there is no such kind.
    """
    try:
        values = {field.name: arrays[f"{name}.{field.name}"] for field in fields(KINDS[kind])}
    except KeyError as error:
        raise DamagedFile(f"{name}, a set of the kind {kind!r}, lacks {error}") from error
    return KINDS[kind](**{key: value if value.ndim else float(value) for key, value in values.items()})
