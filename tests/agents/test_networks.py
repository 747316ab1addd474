"""Networks, gradients, Adam and targets against torch's own."""

import numpy as np
import pytest
import torch

from pbcs_ompl.agents import network_kernels as kernels
from pbcs_ompl.agents.networks import MLP, Weights
from pbcs_ompl.agents.trained_network import TrainedNetwork, adam_rates

CPU = torch.device("cpu")


def generators(*seeds: int) -> list[torch.Generator]:
    return [torch.Generator().manual_seed(seed) for seed in seeds]


def reference(network: MLP, flat: torch.Tensor, inputs: torch.Tensor) -> torch.Tensor:
    """The same network in the plainest words of torch, recorded for autograd."""
    layers = network.split(flat)
    for weight, bias, norm in layers[:-1]:
        inputs = inputs @ weight + bias
        if norm is not None:
            inputs = torch.nn.functional.layer_norm(inputs, inputs.shape[-1:]) * norm.gain + norm.shift
        inputs = torch.relu(inputs)
    return inputs @ layers[-1].weight + layers[-1].bias


@pytest.mark.parametrize("layer_norm", [False, True])
@pytest.mark.parametrize("sizes", [(3, 16, 8, 2), (5, 7, 1), (2, 20, 20, 20, 3)])
def test_gradients_equal_autograd(sizes: tuple[int, ...], layer_norm: bool) -> None:
    network = MLP(sizes, layer_norm)
    flat = network.initial(generators(1, 2, 3)) + 0.1 * torch.randn(3 * network.num_parameters)
    inputs, slope = torch.randn(3, 11, sizes[0]), torch.randn(3, 11, sizes[-1])
    weights, gradient = Weights(network, flat), Weights(network, torch.zeros_like(flat))
    outputs, tape = network.forward(weights, inputs)
    network.backward(weights, tape, slope, gradient)

    flat_leaf, input_leaf = flat.clone().requires_grad_(), inputs.clone().requires_grad_()
    expected = reference(network, flat_leaf, input_leaf)
    by_weights, by_inputs = torch.autograd.grad((expected * slope).sum(), (flat_leaf, input_leaf))
    torch.testing.assert_close(outputs, expected.detach(), rtol=1e-5, atol=1e-5)
    torch.testing.assert_close(gradient.flat, by_weights, rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(network.input_slope(weights, tape, slope), by_inputs, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("sizes", [(3, 16, 8, 2), (4, 33, 40, 1)])
def test_kernels_equal_torch_for_every_seed_of_a_stack(sizes: tuple[int, ...]) -> None:
    network, batch, seeds = MLP(sizes), 13, 3
    flat = network.initial(generators(1, 2, 3))
    inputs, slope = torch.randn(seeds, batch, sizes[0]), torch.randn(seeds, batch, sizes[-1])
    weights, gradient = Weights(network, flat), Weights(network, torch.zeros_like(flat))
    outputs, tape = network.forward(weights, inputs)
    network.backward(weights, tape, slope, gradient)
    into_inputs = network.input_slope(weights, tape, slope)
    for seed in range(seeds):
        values = np.zeros(kernels.tape_length(sizes, batch), np.float32)
        slopes, own = np.zeros_like(values), np.zeros(network.num_parameters, np.float32)
        values[: batch * sizes[0]] = inputs[seed].numpy().ravel()
        kernels.forward(sizes, flat.numpy(), seeds, seed, values, batch)
        start = kernels.outputs_at(sizes, batch)
        np.testing.assert_allclose(values[start:], outputs[seed].numpy().ravel(), rtol=1e-5, atol=1e-5)
        slopes[start:] = slope[seed].numpy().ravel()
        kernels.backward(sizes, flat.numpy(), seeds, seed, values, slopes, batch, own, True)
        expected = [part[seed].numpy().ravel() for layer in gradient.layers for part in layer[:2]]
        np.testing.assert_allclose(own, np.concatenate(expected), rtol=1e-4, atol=1e-5)
        down = slopes[: batch * sizes[0]]
        np.testing.assert_allclose(down, into_inputs[seed].numpy().ravel(), rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("way", ["torch", "kernel"])
def test_adam_and_target_equal_torch_optim(way: str) -> None:
    net = TrainedNetwork(MLP((2, 9, 1)), generators(4, 5), CPU)
    leaf = net.weights.flat.clone().requires_grad_()
    target, optimiser = leaf.detach().clone(), torch.optim.Adam([leaf], lr=3e-3)
    rates = adam_rates(3e-3, range(1, 51), CPU)
    for step in range(50):
        net.gradient.flat.normal_()
        leaf.grad = net.gradient.flat.clone()
        optimiser.step()
        target = 0.9 * target + 0.1 * leaf.detach()
        if way == "torch":
            net.descend(rates[step])
            net.follow(0.9)
        else:
            for seed in range(2):
                descend_with_kernel(net, seed, rates[step])
    torch.testing.assert_close(net.weights.flat, leaf.detach(), rtol=1e-5, atol=1e-6)
    torch.testing.assert_close(net.target.flat, target, rtol=1e-5, atol=1e-6)


def descend_with_kernel(net: TrainedNetwork, seed: int, rate: torch.Tensor) -> None:
    sizes, weights = net.network.sizes, net.weights.flat.numpy()
    own = torch.cat([part[seed].ravel() for layer in net.gradient.layers for part in layer[:2]]).numpy()
    kernels.descend(sizes, weights, net.mean.numpy(), net.square.numpy(), 2, seed, own, rate.numpy())
    kernels.follow(sizes, weights, net.target.flat.numpy(), 2, seed, np.float32(0.1))


def test_a_stack_is_initialised_like_its_seeds_alone() -> None:
    network = MLP((3, 8, 2), layer_norm=True)
    stack = network.split(network.initial(generators(7, 8, 9)))
    alone = network.split(network.initial(generators(8)))
    for together, single in zip(stack, alone, strict=True):
        assert torch.equal(together.weight[1], single.weight[0])
        assert torch.equal(together.bias[1], single.bias[0])
        assert single.weight.abs().max() <= single.weight.shape[1] ** -0.5
