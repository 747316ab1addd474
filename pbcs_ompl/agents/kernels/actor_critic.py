"""The steps of which updates of actor-critic algorithms are made, for one seed on a CPU.

A critic takes observations and actions side by side, called pairs here. `rows` are those of a mini-batch [B, W], see
`Replay.unpack`; rates are rows of `adam_rates`. All functions are inlined in the update that calls them: LLVM optimises
a function again in each of its callers.
"""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.agents.kernels import network as nets
from pbcs_ompl.core.compiled import njit


class Stack(NamedTuple):
    """A `TrainedNetwork` in plain arrays [N * P]."""

    shape: nets.Shape
    total: int
    """Networks N: one of each seed, or the first ones of all seeds, then the second ones."""
    weights: np.ndarray
    target: np.ndarray
    mean: np.ndarray
    square: np.ndarray


class Constants(NamedTuple):
    """What does not change; float32. Actions are centre + half times what is in [-1, 1]."""

    half: np.ndarray
    centre: np.ndarray
    discount: np.float32
    tau: np.float32
    """1 - polyak"""


class Scratch(NamedTuple):
    """Working memory of one seed."""

    actor_activations: np.ndarray
    actor_grads: np.ndarray
    actor_gradient: np.ndarray
    critic_activations: np.ndarray
    """A row for each critic of the seed; the inputs of the first row are the pairs."""
    critic_grads: np.ndarray
    critic_gradient: np.ndarray
    values: np.ndarray
    """The least values of a seed's critics, or their means [B]."""
    least: np.ndarray
    """Which critic has it [B]."""
    targets: np.ndarray
    """[B]"""


@njit(inline="always")
def new_scratch(actor: Stack, critic: Stack, batch: int) -> Scratch:
    """Allocate working memory."""
    short, long = nets.num_activations(actor.shape, batch), nets.num_activations(critic.shape, batch)
    return Scratch(np.empty(short, np.float32), np.empty(short, np.float32),
                   np.empty(len(actor.weights) // actor.total, np.float32),
                   np.empty((critic.total // actor.total, long), np.float32), np.empty(long, np.float32),
                   np.empty(len(critic.weights) // critic.total, np.float32),
                   np.empty(batch, np.float32), np.empty(batch, np.int64), np.empty(batch, np.float32))


@njit(inline="always")
def run_actor(actor: Stack, flat: np.ndarray, seed: int, rows: np.ndarray, first: int, pair: int,
              scratch: Scratch) -> None:
    """Run an actor on observations, which are also put into the pairs.

    Args:
        actor: Of all seeds.
        flat: Its weights, or its target's.
        seed: Which one.
        rows: With the observations.
        first: The column where they begin.
        pair: Length of a pair.
        scratch: Working memory.
    """
    batch, size, pairs = len(rows), actor.shape.sizes[0], scratch.critic_activations[0]
    for item in range(batch):
        for i in range(size):
            scratch.actor_activations[item * size + i] = rows[item, first + i]
            pairs[item * pair + i] = rows[item, first + i]
    nets.forward(actor.shape, flat, nets.Member(actor.total, seed), scratch.actor_activations, batch)


@njit(inline="always")
def set_actions(actor: Stack, noise: np.ndarray, pair: int, constants: Constants, scratch: Scratch) -> None:
    """Put the actions tanh(outputs) + noise, at most 1, into the pairs; tanh(outputs) stays in place of the outputs.

    Args:
        actor: Which has run.
        noise: [B, A], or empty for none.
        pair: Length of a pair.
        constants: What does not change.
        scratch: Working memory.
    """
    batch, actions, pairs = len(scratch.values), len(constants.half), scratch.critic_activations[0]
    out, one = nets.outputs_offset(actor.shape, batch), np.float32(1.0)
    for item in range(batch):
        for a in range(actions):
            squashed = np.tanh(scratch.actor_activations[out + item * actions + a])
            scratch.actor_activations[out + item * actions + a] = squashed
            if len(noise) > 0:
                squashed = min(max(squashed + noise[item, a], -one), one)
            pairs[item * pair + pair - actions + a] = constants.centre[a] + constants.half[a] * squashed


@njit(inline="always")
def least_values(critic: Stack, flat: np.ndarray, seed: int, chosen: np.ndarray, scratch: Scratch) -> None:
    """Fill the least values of a seed's critics at the pairs.

    Args:
        critic: Of all seeds.
        flat: Their weights, or their targets'.
        seed: Which one.
        chosen: Which of its critics count [C].
        scratch: Working memory.
    """
    batch, copies, any_yet = len(scratch.values), len(chosen), False
    out, inputs = nets.outputs_offset(critic.shape, batch), batch * critic.shape.sizes[0]
    for copy in range(copies):
        if not chosen[copy]:
            continue
        activations = scratch.critic_activations[copy]
        for i in range(inputs if copy > 0 else 0):
            activations[i] = scratch.critic_activations[0, i]
        nets.forward(critic.shape, flat, nets.Member(critic.total, copy * (critic.total // copies) + seed), activations,
                     batch)
        for item in range(batch):
            # A value that is not a number stays the least.
            if not any_yet or not activations[out + item] >= scratch.values[item]:
                scratch.values[item], scratch.least[item] = activations[out + item], copy
        any_yet = True


@njit(inline="always")
def average_values(critic: Stack, scratch: Scratch) -> None:
    """Put the mean of a seed's critics in place of the least of their values, after `least_values` of all of them."""
    out, copies = nets.outputs_offset(critic.shape, len(scratch.values)), len(scratch.critic_activations)
    for item in range(len(scratch.values)):
        total = np.float32(0.0)
        for copy in range(copies):
            total += scratch.critic_activations[copy, out + item]
        scratch.values[item] = total / np.float32(copies)


@njit(inline="always")
def set_targets(rows: np.ndarray, pair: int, constants: Constants, scratch: Scratch) -> None:
    """Fill the targets r + discount values, or r at the end of an episode."""
    for item in range(len(rows)):
        future = constants.discount * rows[item, pair + 1] * scratch.values[item]
        scratch.targets[item] = rows[item, pair] + future


@njit(inline="always")
def critic_step(rows: np.ndarray, seed: int, critic: Stack, rate: np.ndarray, scratch: Scratch) -> np.float32:
    """Make a step of each critic of a seed towards the targets; return the sum of their losses."""
    batch, pair, twins = len(rows), critic.shape.sizes[0], len(scratch.critic_activations)
    activations, out = scratch.critic_activations[0], nets.outputs_offset(critic.shape, batch)
    for item in range(batch):
        for i in range(pair):
            activations[item * pair + i] = rows[item, i]
    loss = np.float32(0.0)
    for twin in range(twins):
        member = nets.Member(critic.total, twin * (critic.total // twins) + seed)
        nets.forward(critic.shape, critic.weights, member, activations, batch)
        for item in range(batch):
            error = activations[out + item] - scratch.targets[item]
            loss += error * error
            scratch.critic_grads[out + item] = error * np.float32(2.0 / batch)
        nets.backward(critic.shape, critic.weights, member, activations, scratch.critic_grads, batch,
                      scratch.critic_gradient)
        nets.adam_step(critic.shape, critic.weights, critic.mean, critic.square, member, scratch.critic_gradient, rate)
    return loss / np.float32(batch)


@njit(inline="always")
def policy_step(rows: np.ndarray, seed: int, actor: Stack, critic: Stack, rate: np.ndarray, constants: Constants,
                scratch: Scratch) -> np.float32:
    """Make a step of a seed's actor along the gradient of its first critic; return its loss."""
    batch, pair, actions = len(rows), critic.shape.sizes[0], len(constants.half)
    activations, out = scratch.critic_activations[0], nets.outputs_offset(critic.shape, batch)
    run_actor(actor, actor.weights, seed, rows, 0, pair, scratch)
    set_actions(actor, np.empty((0, 0), np.float32), pair, constants, scratch)
    member = nets.Member(critic.total, seed)
    nets.forward(critic.shape, critic.weights, member, activations, batch)
    loss = np.float32(0.0)
    for item in range(batch):
        loss -= activations[out + item]
        scratch.critic_grads[out + item] = np.float32(-1.0 / batch)
    nets.backward(critic.shape, critic.weights, member, activations, scratch.critic_grads, batch,
                  np.empty(0, np.float32))
    out = nets.outputs_offset(actor.shape, batch)
    for item in range(batch):
        for a in range(actions):
            squashed = scratch.actor_activations[out + item * actions + a]
            grad = scratch.critic_grads[item * pair + pair - actions + a] * constants.half[a]
            scratch.actor_grads[out + item * actions + a] = grad * (np.float32(1.0) - squashed * squashed)
    actor_step(actor, seed, rate, scratch)
    return loss / np.float32(batch)


@njit(inline="always")
def actor_step(actor: Stack, seed: int, rate: np.ndarray, scratch: Scratch) -> None:
    """Make a step of a seed's actor, for the gradients of its outputs."""
    member = nets.Member(actor.total, seed)
    nets.backward(actor.shape, actor.weights, member, scratch.actor_activations, scratch.actor_grads,
                  len(scratch.values), scratch.actor_gradient)
    nets.adam_step(actor.shape, actor.weights, actor.mean, actor.square, member, scratch.actor_gradient, rate)


@njit(inline="always")
def update_targets(stack: Stack, seed: int, copies: int, tau: np.float32) -> None:
    """Move the target networks of a seed, of which the stack has some copies."""
    for copy in range(copies):
        member = nets.Member(stack.total, copy * (stack.total // copies) + seed)
        nets.polyak_update(stack.shape, stack.weights, stack.target, member, tau)
