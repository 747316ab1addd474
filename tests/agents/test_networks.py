"""Networks, gradients, Adam and targets against those of torch."""

import numpy as np
import pytest
import torch

from pbcs_ompl.agents.kernels import network as kernels
from pbcs_ompl.agents.kernels.gradients import backward, forward, input_gradient
from pbcs_ompl.agents.networks import MLP, TrainedNetwork, Weights, adam_rates

CPU = torch.device("cpu")


def generators(*seeds: int) -> list[np.random.Generator]:
    return [np.random.default_rng(seed) for seed in seeds]


def reference(network: MLP, flat: torch.Tensor, inputs: torch.Tensor) -> torch.Tensor:
    """The same network in the simplest form, recorded for autograd."""
    layers = network.split(flat)
    inputs, late = inputs.split([network.sizes[0] - network.late_inputs, network.late_inputs], dim=2)
    for index, (weight, bias, norm) in enumerate(layers[:-1]):
        inputs = torch.cat((inputs, late), dim=2) if index == 1 else inputs
        inputs = inputs @ weight + bias
        if norm is not None:
            inputs = torch.nn.functional.layer_norm(inputs, inputs.shape[-1:]) * norm.gain + norm.shift
        inputs = torch.relu(inputs)
    inputs = torch.cat((inputs, late), dim=2) if len(layers) == 2 else inputs
    return inputs @ layers[-1].weight + layers[-1].bias


@pytest.mark.parametrize("late_inputs", [0, 1])
@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("sizes", [(3, 16, 8, 2), (5, 7, 1), (2, 20, 20, 20, 3)])
def test_outputs_and_gradients_equal_those_of_plain_torch(sizes: tuple[int, ...], layer_norm: bool,
                                                          late_inputs: int) -> None:
    network = MLP(sizes, layer_norm, late_inputs)
    flat = network.initial(generators(1, 2, 3)) + 0.1 * torch.randn(3 * network.num_parameters)
    inputs, grad = torch.randn(3, 11, sizes[0]), torch.randn(3, 11, sizes[-1])
    weights, gradient = Weights(network, flat), Weights(network, torch.zeros_like(flat))
    outputs, activations = forward(weights, inputs)
    backward(weights, activations, grad, gradient)

    flat_leaf, input_leaf = flat.clone().requires_grad_(), inputs.clone().requires_grad_()
    expected = reference(network, flat_leaf, input_leaf)
    by_weights, by_inputs = torch.autograd.grad((expected * grad).sum(), (flat_leaf, input_leaf))
    torch.testing.assert_close(outputs, expected.detach(), rtol=1e-5, atol=1e-5)
    torch.testing.assert_close(weights(inputs), outputs, rtol=0.0, atol=0.0)
    torch.testing.assert_close(gradient.flat, by_weights, rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(input_gradient(weights, activations, grad), by_inputs, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("sizes", [(3, 16, 8, 2), (4, 33, 40, 1)])
def test_kernels_equal_torch_for_every_seed_of_a_stack(sizes: tuple[int, ...], layer_norm: bool) -> None:
    network, shape, batch, seeds = MLP(sizes, layer_norm), kernels.shape_of(sizes, layer_norm), 13, 3
    flat = network.initial(generators(1, 2, 3)) + 0.1 * torch.randn(3 * network.num_parameters)
    inputs, grad = torch.randn(seeds, batch, sizes[0]), torch.randn(seeds, batch, sizes[-1])
    weights, gradient = Weights(network, flat), Weights(network, torch.zeros_like(flat))
    outputs, activations = forward(weights, inputs)
    backward(weights, activations, grad, gradient)
    into_inputs = input_gradient(weights, activations, grad)
    for seed in range(seeds):
        member, values = kernels.Member(seeds, seed), np.zeros(kernels.num_activations(shape, batch), np.float32)
        grads, own = np.zeros_like(values), np.zeros(network.num_parameters, np.float32)
        values[: batch * sizes[0]] = inputs[seed].numpy().ravel()
        kernels.forward(shape, flat.numpy(), member, values, batch)
        start = kernels.outputs_offset(shape, batch)
        there = slice(start, start + batch * sizes[-1])
        np.testing.assert_allclose(values[there], outputs[seed].numpy().ravel(), rtol=1e-5, atol=1e-5)
        grads[there] = grad[seed].numpy().ravel()
        kernels.backward(shape, flat.numpy(), member, values, grads.copy(), batch, own)
        kernels.backward(shape, flat.numpy(), member, values, grads, batch, np.empty(0, np.float32))
        expected = [part[seed].numpy().ravel() for layer in gradient.layers for part in layer.tensors()]
        np.testing.assert_allclose(own, np.concatenate(expected), rtol=1e-4, atol=1e-5)
        down = grads[: batch * sizes[0]]
        np.testing.assert_allclose(down, into_inputs[seed].numpy().ravel(), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("way", ["torch", "kernel"])
def test_adam_and_target_equal_torch_optim(way: str, layer_norm: bool) -> None:
    net = TrainedNetwork(MLP((2, 9, 1), layer_norm), generators(4, 5), CPU)
    leaf = net.weights.flat.clone().requires_grad_()
    target, optimiser = leaf.detach().clone(), torch.optim.Adam([leaf], lr=3e-3)
    rates = adam_rates(3e-3, range(1, 51), CPU)
    for step in range(50):
        net.gradient.flat.normal_()
        leaf.grad = net.gradient.flat.clone()
        optimiser.step()
        target = 0.9 * target + 0.1 * leaf.detach()
        if way == "torch":
            net.step(rates[step])
            net.update_target(0.9)
        else:
            for seed in range(2):
                step_with_kernel(net, seed, rates[step])
    torch.testing.assert_close(net.weights.flat, leaf.detach(), rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(net.target.flat, target, rtol=1e-5, atol=1e-6)


def step_with_kernel(net: TrainedNetwork, seed: int, rate: torch.Tensor) -> None:
    shape, member = kernels.shape_of(net.network.sizes, net.network.layer_norm), kernels.Member(2, seed)
    weights = net.weights.flat.numpy()
    own = torch.cat([part[seed].ravel() for layer in net.gradient.layers for part in layer.tensors()]).numpy()
    kernels.adam_step(shape, weights, net.mean.numpy(), net.square.numpy(), member, own, rate.numpy())
    kernels.polyak_update(shape, weights, net.target.flat.numpy(), member, np.float32(0.1))


def test_a_stack_is_initialised_like_its_seeds_alone() -> None:
    network = MLP((3, 8, 2), layer_norm=True)
    stack = network.split(network.initial(generators(7, 8, 9)))
    alone = network.split(network.initial(generators(8)))
    for together, single in zip(stack, alone, strict=True):
        assert torch.equal(together.weight[1], single.weight[0])
        assert torch.equal(together.bias[1], single.bias[0])
        assert single.weight.abs().max() <= single.weight.shape[1] ** -0.5


def test_the_first_networks_of_a_stack_are_views_of_it() -> None:
    net = TrainedNetwork(MLP((3, 8, 2), layer_norm=True), generators(1, 2, 3, 4), CPU)
    inputs = torch.randn(4, 5, 3)
    first = net.weights.first(2)
    torch.testing.assert_close(first(inputs[:2]), net.weights(inputs)[:2])
    net.weights.flat.mul_(2.0)
    torch.testing.assert_close(first(inputs[:2]), net.weights(inputs)[:2])


def test_autograd_takes_any_loss_and_what_it_returns_beside_it() -> None:
    net = TrainedNetwork(MLP((3, 8, 1)), generators(1, 2), CPU)
    inputs = torch.randn(2, 5, 3)

    def loss(weights: Weights, inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        values = weights(inputs)
        return values.abs().mean(dim=(1, 2)), values

    with torch.no_grad():
        losses, values = net.autograd(loss, inputs)
    leaf = net.weights.flat.clone().requires_grad_()
    (expected,) = torch.autograd.grad(reference(net.network, leaf, inputs).abs().mean(dim=(1, 2)).sum(), leaf)
    torch.testing.assert_close(net.gradient.flat, expected)
    torch.testing.assert_close(values, net.weights(inputs))
    assert not losses.requires_grad
    assert not values.requires_grad
