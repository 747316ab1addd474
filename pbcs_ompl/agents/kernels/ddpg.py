"""DDPG as one kernel for a CPU: seed by seed, many updates in one call."""

from typing import NamedTuple

import numpy as np

from pbcs_ompl.agents.kernels import network as nets
from pbcs_ompl.core.compiled import njit

# What `update_seed` runs through is inlined in it: LLVM optimises a function again in each of its callers.


class Stack(NamedTuple):
    """A `TrainedNetwork` in plain arrays [S * P]."""

    sizes: nets.Sizes
    seeds: int
    weights: np.ndarray
    target: np.ndarray
    mean: np.ndarray
    square: np.ndarray


class Constants(NamedTuple):
    """What does not change; float32. Actions are centre + half tanh(outputs)."""

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
    critic_grads: np.ndarray
    critic_gradient: np.ndarray
    targets: np.ndarray


@njit(nogil=True)
def update_seed(rows: np.ndarray, rates: np.ndarray, seed: int, actor: Stack, critic: Stack,
                constants: Constants, losses: np.ndarray) -> None:
    """Make K updates of one seed.

    Args:
        rows: Its mini-batches [K, B, W], see `Replay.unpack`.
        rates: [K, 2, 2], see `adam_rates`; the actor's first.
        seed: Which one.
        actor, critic: The networks of all seeds.
        constants: What does not change.
        losses: Filled with the critic's and the actor's losses [K, 2].
    """
    scratch = _scratch(actor, critic, rows.shape[1])
    for k in range(rows.shape[0]):
        losses[k, 0] = _critic_gradient(rows[k], seed, actor, critic, constants, scratch)
        nets.adam_step(critic.sizes, critic.weights, critic.mean, critic.square, critic.seeds, seed,
                     scratch.critic_gradient, rates[k, 1])
        losses[k, 1] = _actor_gradient(rows[k], seed, actor, critic, constants, scratch)
        nets.adam_step(actor.sizes, actor.weights, actor.mean, actor.square, actor.seeds, seed,
                     scratch.actor_gradient, rates[k, 0])
        nets.polyak_update(actor.sizes, actor.weights, actor.target, actor.seeds, seed, constants.tau)
        nets.polyak_update(critic.sizes, critic.weights, critic.target, critic.seeds, seed, constants.tau)


@njit(inline="always")
def _scratch(actor: Stack, critic: Stack, batch: int) -> Scratch:
    long, short = nets.num_activations(critic.sizes, batch), nets.num_activations(actor.sizes, batch)
    return Scratch(np.empty(short, np.float32), np.empty(short, np.float32),
                   np.empty(len(actor.weights) // actor.seeds, np.float32),
                   np.empty(long, np.float32), np.empty(long, np.float32),
                   np.empty(len(critic.weights) // critic.seeds, np.float32), np.empty(batch, np.float32))


@njit(inline="always")
def _act(actor: Stack, flat: np.ndarray, seed: int, observations: np.ndarray, constants: Constants,
         activations: np.ndarray, obs_actions: np.ndarray) -> None:
    """Run the actor `flat` on observations [B, O].

    tanh(outputs) stays at the end of its activations, the critic's inputs in `obs_actions`.
    """
    batch, width = observations.shape
    actions = actor.sizes[-1]
    for item in range(batch):
        for i in range(width):
            activations[item * width + i] = observations[item, i]
            obs_actions[item * (width + actions) + i] = observations[item, i]
    nets.forward(actor.sizes, flat, actor.seeds, seed, activations, batch)
    out = nets.outputs_offset(actor.sizes, batch)
    for item in range(batch):
        for a in range(actions):
            squashed = np.tanh(activations[out + item * actions + a])
            activations[out + item * actions + a] = squashed
            obs_actions[item * (width + actions) + width + a] = constants.centre[a] + constants.half[a] * squashed


@njit(inline="always")
def _critic_gradient(rows: np.ndarray, seed: int, actor: Stack, critic: Stack, constants: Constants,
                     scratch: Scratch) -> float:
    batch, pair = rows.shape[0], critic.sizes[0]
    activations, out = scratch.critic_activations, nets.outputs_offset(critic.sizes, batch)
    _act(actor, actor.target, seed, rows[:, pair + 2 :], constants, scratch.actor_activations, activations)
    nets.forward(critic.sizes, critic.target, critic.seeds, seed, activations, batch)
    for item in range(batch):
        future = constants.discount * rows[item, pair + 1] * activations[out + item]
        scratch.targets[item] = rows[item, pair] + future
        for i in range(pair):
            activations[item * pair + i] = rows[item, i]
    nets.forward(critic.sizes, critic.weights, critic.seeds, seed, activations, batch)
    loss = np.float32(0.0)
    for item in range(batch):
        error = activations[out + item] - scratch.targets[item]
        loss += error * error
        scratch.critic_grads[out + item] = error * np.float32(2.0 / batch)
    nets.backward(critic.sizes, critic.weights, critic.seeds, seed, activations, scratch.critic_grads, batch,
                  scratch.critic_gradient)
    mean: float = loss / batch
    return mean


@njit(inline="always")
def _actor_gradient(rows: np.ndarray, seed: int, actor: Stack, critic: Stack, constants: Constants,
                    scratch: Scratch) -> float:
    batch, size, pair = rows.shape[0], actor.sizes[0], critic.sizes[0]
    activations, out = scratch.critic_activations, nets.outputs_offset(critic.sizes, batch)
    _act(actor, actor.weights, seed, rows[:, :size], constants, scratch.actor_activations, activations)
    nets.forward(critic.sizes, critic.weights, critic.seeds, seed, activations, batch)
    loss = np.float32(0.0)
    for item in range(batch):
        loss -= activations[out + item]
        scratch.critic_grads[out + item] = np.float32(-1.0 / batch)
    nets.backward(critic.sizes, critic.weights, critic.seeds, seed, activations, scratch.critic_grads, batch,
                  np.empty(0, np.float32))
    out, actions = nets.outputs_offset(actor.sizes, batch), pair - size
    for item in range(batch):
        for a in range(actions):
            squashed = scratch.actor_activations[out + item * actions + a]
            grad = scratch.critic_grads[item * pair + size + a] * constants.half[a]
            scratch.actor_grads[out + item * actions + a] = grad * (np.float32(1.0) - squashed * squashed)
    nets.backward(actor.sizes, actor.weights, actor.seeds, seed, scratch.actor_activations, scratch.actor_grads,
                  batch, scratch.actor_gradient)
    mean: float = loss / batch
    return mean
