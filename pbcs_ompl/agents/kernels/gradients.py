"""Gradients of the losses of `losses.py`, derived by hand; see tests/benchmarks/gradient_step.py for what they save.

For networks 64 wide, recording a graph costs as much as the arithmetic. Each function takes the arguments of its loss,
with the `TrainedNetwork` in place of its weights, returns what the loss returns, and leaves the gradient in the
network. `GRADIENTS` maps each loss to its gradient; other losses are left to autograd.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import torch
from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.layer_norm import LAYER_NORM_EPSILON
from pbcs_ompl.agents.kernels.sac import LOG_STD
from pbcs_ompl.agents.losses import ActionBox, CriticStack, squashed_log_density
from pbcs_ompl.agents.networks import Layer, Loss, Norm, TrainedNetwork, TrainedScalar, Weights


class Activations(NamedTuple):
    """What a forward pass leaves for the backward pass."""

    inputs: list[Tensor]
    """The input of every layer [S, B, in]."""
    norms: list[tuple[Tensor, Tensor]]
    """Normalised values [S, B, out] and inverse deviations [S, B, 1] of every layer norm."""


def forward(weights: Weights, inputs: Tensor) -> tuple[Tensor, Activations]:
    """Return the outputs [S, B, out] for inputs [S, B, in], and what `backward` needs."""
    activations = Activations([], [])
    *hidden, last = weights.layers
    values, late = weights.network.divide(inputs)
    for index, (weight, bias, norm) in enumerate(hidden):
        activations.inputs.append(values)
        values = torch.baddbmm(bias, values, weight)
        if norm is not None:
            normal, _, deviation = torch.native_layer_norm(values, values.shape[-1:], None, None, LAYER_NORM_EPSILON)
            activations.norms.append((normal, deviation))
            values = torch.addcmul(norm.shift, normal, norm.gain)
        values = values.relu_()
        if index == 0 and late is not None:
            values = torch.cat((values, late), dim=2)
    activations.inputs.append(values)
    return torch.baddbmm(last.bias, values, last.weight), activations


def backward(weights: Weights, activations: Activations, grad: Tensor, gradient: Weights) -> None:
    """Fill `gradient` with the derivative of a loss by the parameters.

    Args:
        weights: The networks.
        activations: Of `forward` with these weights.
        grad: Derivative of the loss by the outputs [S, B, out].
        gradient: What is filled.
    """
    _through_layers(weights, activations, grad, gradient.layers)


def input_gradient(weights: Weights, activations: Activations, grad: Tensor) -> Tensor:
    """Return the derivative of a loss by the inputs [S, B, in]; see `backward`."""
    grad, late = _through_layers(weights, activations, grad, None)
    grad = torch.bmm(grad, weights.layers[0].weight.transpose(1, 2))
    return grad if late is None else torch.cat((grad, late), dim=2)


def _through_layers(weights: Weights, activations: Activations, grad: Tensor,
                    gradients: list[Layer] | None) -> tuple[Tensor, Tensor | None]:
    """Return the derivatives by the first layer's sums [S, B, hidden], and by the inputs that skip it, if any.

    Fill `gradients` on the way.
    """
    layers = weights.layers
    last, late = len(layers) - 1, None
    for index in range(last, -1, -1):
        into = None if gradients is None else gradients[index]
        norm = layers[index].norm
        if index < last:
            values = activations.inputs[index + 1]
            if index == 0:
                (grad, late), (values, _) = weights.network.divide(grad), weights.network.divide(values)
            grad = torch.ops.aten.threshold_backward(grad, values, 0.0)
        if norm is not None:
            learnt = None if into is None else into.norm
            grad = _norm_backward(norm.gain, activations.norms[index], grad, learnt)
        if into is not None:
            torch.bmm(activations.inputs[index].transpose(1, 2), grad, out=into.weight)
            torch.sum(grad, 1, keepdim=True, out=into.bias)
        if index > 0:
            grad = torch.bmm(grad, layers[index].weight.transpose(1, 2))
    return grad, late


def _norm_backward(gain: Tensor, norm: tuple[Tensor, Tensor], grad: Tensor, into: Norm | None) -> Tensor:
    normal, deviation = norm
    if into is not None:
        torch.sum(grad * normal, 1, keepdim=True, out=into.gain)
        torch.sum(grad, 1, keepdim=True, out=into.shift)
    grad = grad * gain
    along = (grad * normal).mean(-1, keepdim=True)
    return (grad - grad.mean(-1, keepdim=True)).addcmul(normal, along, value=-1.0).mul(deviation)


def critic_gradient(critic: TrainedNetwork, obs_actions: Tensor, targets: Tensor) -> Tensor:
    """Do `losses.critic_loss`."""
    values, activations = forward(critic.weights, obs_actions)
    errors = values - targets
    backward(critic.weights, activations, errors * (2.0 / errors.shape[1]), critic.gradient)
    return errors.square().mean(dim=(1, 2))


def policy_gradient(actor: TrainedNetwork, critic: Weights, observations: Tensor, box: ActionBox) -> Tensor:
    """Do `losses.policy_loss`: the critic's gradient along the actions, through the actor."""
    outputs, actor_activations = forward(actor.weights, observations)
    squashed = outputs.tanh()
    values, activations = forward(critic, box.join(observations, squashed))
    grad = input_gradient(critic, activations, torch.full_like(values, -1.0 / values.shape[1]))
    grad = torch.ops.aten.tanh_backward(grad[..., observations.shape[2] :] * box.half, squashed)
    backward(actor.weights, actor_activations, grad, actor.gradient)
    return -values.mean(dim=(1, 2))


def imitation_gradient(actor: TrainedNetwork, observations: Tensor, squashed: Tensor) -> Tensor:
    """Do `losses.imitation_loss`."""
    outputs, activations = forward(actor.weights, observations)
    actions = outputs.tanh()
    return _pull(actor, activations, actions, actions - squashed)


def improvement_gradient(actor: TrainedNetwork, critic: Weights, obs_actions: Tensor, targets: Tensor,
                         box: ActionBox) -> Tensor:
    """Do `losses.improvement_loss`."""
    size = obs_actions.shape[2] - len(box.half)
    observations, taken = obs_actions[..., :size], box.squash(obs_actions[..., size:])
    outputs, activations = forward(actor.weights, observations)
    squashed = outputs.tanh()
    better = targets > critic(box.join(observations, squashed))
    return _pull(actor, activations, squashed, (squashed - taken) * better)


def _pull(actor: TrainedNetwork, activations: Activations, squashed: Tensor, errors: Tensor) -> Tensor:
    """Return the mean squares [S] of the errors of squashed actions, both [S, B, A]; leave their gradient."""
    grad = torch.ops.aten.tanh_backward(errors * (2.0 / errors.shape[1]), squashed)
    backward(actor.weights, activations, grad, actor.gradient)
    return errors.square().sum(dim=2).mean(dim=1)


def soft_policy_gradient(actor: TrainedNetwork, critics: Weights, observations: Tensor, noise: Tensor,
                         temperature: Tensor, box: ActionBox, each: CriticStack) -> tuple[Tensor, Tensor]:
    """Do `losses.soft_policy_loss`."""
    weight = temperature[:, None, None]
    outputs, actor_activations = forward(actor.weights, observations)
    mean, free_log_std = outputs.chunk(2, dim=2)
    log_std = free_log_std.clamp(*LOG_STD)
    std = log_std.exp()
    inner = torch.addcmul(mean, std, noise)
    squashed, log_density = inner.tanh(), squashed_log_density(inner, log_std, noise)
    stacked, activations = forward(critics, box.join(observations, squashed).repeat(each.copies, 1, 1))
    values = each.of(stacked)
    part = 1.0 / values.shape[2]
    if each.averaged:
        value, grad = values.mean(dim=0), torch.full_like(values, -part / each.copies)
    else:
        value, least = values.min(dim=0)
        grad = torch.zeros_like(values).scatter_(0, least[None], -part)
    grad = each.of(input_gradient(critics, activations, grad.view_as(stacked))).sum(dim=0)
    grad = grad[..., observations.shape[2] :] * box.half
    # By u: the critic's gradient through the tanh, and that of the density's -log(1 - tanh(u)^2).
    by_inner = torch.ops.aten.tanh_backward(grad, squashed) + 2.0 * part * weight * squashed
    by_log_std = (by_inner * noise * std - part * weight) * (log_std == free_log_std)
    backward(actor.weights, actor_activations, torch.cat((by_inner, by_log_std), dim=2), actor.gradient)
    return (weight * log_density - value).mean(dim=(1, 2)), log_density


def temperature_gradient(log_temperature: TrainedScalar, log_density: Tensor, target_entropy: float) -> Tensor:
    """Do `losses.temperature_loss`."""
    excess = log_density.mean(dim=(1, 2)) + target_entropy
    torch.neg(excess, out=log_temperature.gradient)
    return -log_temperature.values * excess


Gradients = Mapping[Loss, Callable[..., Any]]
GRADIENTS: Gradients = {
    losses.critic_loss: critic_gradient,
    losses.policy_loss: policy_gradient,
    losses.imitation_loss: imitation_gradient,
    losses.improvement_loss: improvement_gradient,
    losses.soft_policy_loss: soft_policy_gradient,
    losses.temperature_loss: temperature_gradient,
}
"""The gradient of each loss."""
