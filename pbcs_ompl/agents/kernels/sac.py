"""Updates of SAC for one seed on a CPU; see `sac.py` of the agents."""

from math import log, pi
from typing import NamedTuple

import numpy as np

from pbcs_ompl.agents.kernels import network as nets
from pbcs_ompl.agents.kernels.actor_critic import (
    Constants,
    Scratch,
    Stack,
    actor_step,
    average_values,
    critic_step,
    least_values,
    new_scratch,
    run_actor,
    set_targets,
    update_targets,
)
from pbcs_ompl.core.compiled import njit

LOG_STD = -20.0, 2.0
"""Bounds of the log standard deviation of the policy; outside of them its gradient is 0 (Haarnoja et al., 2018)."""
_LOG_2, _HALF_LOG_2_PI = np.float32(log(2.0)), np.float32(0.5 * log(2.0 * pi))
_LEAST, _MOST = np.float32(LOG_STD[0]), np.float32(LOG_STD[1])


class Scalar(NamedTuple):
    """A `TrainedScalar` in plain arrays [S]."""

    values: np.ndarray
    mean: np.ndarray
    square: np.ndarray


@njit(nogil=True)
def update_seed(rows: np.ndarray, inputs: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
                networks: tuple[Stack, Stack, Scalar], constants: Constants, losses: np.ndarray, seed: int) -> None:
    """Make K updates of one seed; see `updates.Kernel`.

    Args:
        rows: Mini-batches [K, S, B, W].
        inputs: Rates of critic, actor and temperature [K, 2], and noise for the actions in the next and in the present
            states [K, S, 2, B, A], and which critics give the targets [K, S, C].
        networks: Actor, critics, and the logarithm of the temperature.
        constants: What does not change.
        losses: Filled with the critics' and the actor's losses, and the temperature [K, S, 3].
        seed: Which one.
    """
    critic_rates, actor_rates, temperature_rates, noise, chosen = inputs
    actor, critic, scalar = networks
    pair = critic.shape.sizes[0]
    scratch = new_scratch(actor, critic, rows.shape[2])
    density = np.empty(rows.shape[2], np.float32)
    averaged = not chosen[0, seed].all()  # see `sac.SAC.is_averaged`
    for k in range(len(rows)):
        batch, temperature = rows[k, seed], np.exp(scalar.values[seed])
        run_actor(actor, actor.weights, seed, batch, pair + 2, pair, scratch)
        draw_actions(actor, noise[k, seed, 0], pair, constants, scratch, density)
        least_values(critic, critic.target, seed, chosen[k, seed], scratch)
        for item in range(len(density)):
            scratch.values[item] -= temperature * density[item]
        set_targets(batch, pair, constants, scratch)
        losses[k, seed, 0] = critic_step(batch, seed, critic, critic_rates[k], scratch)
        losses[k, seed, 1] = soft_policy_step(batch, seed, actor, critic, actor_rates[k], noise[k, seed, 1],
                                              temperature, averaged, constants, scratch, density)
        losses[k, seed, 2] = temperature
        temperature_step(scalar, seed, temperature_rates[k], density, np.float32(-len(constants.half)))
        update_targets(critic, seed, chosen.shape[2], constants.tau)


@njit(inline="always")
def draw_actions(actor: Stack, noise: np.ndarray, pair: int, constants: Constants, scratch: Scratch,
                 density: np.ndarray) -> None:
    """Put actions tanh(u) into the pairs, u = mean + std noise, and fill the logarithms of their densities.

    In place of the outputs, mean and free log standard deviation, there are tanh(u) and the free one.

    Args:
        actor: Which has run.
        noise: Standard normal numbers [B, A].
        pair: Length of a pair.
        constants: What does not change.
        scratch: Working memory.
        density: Filled [B].
    """
    batch, actions, pairs = len(scratch.values), len(constants.half), scratch.critic_activations[0]
    out = nets.outputs_offset(actor.shape, batch)
    for item in range(batch):
        total, place = np.float32(0.0), out + item * 2 * actions
        for a in range(actions):
            log_std = min(max(scratch.actor_activations[place + actions + a], _LEAST), _MOST)
            inner = scratch.actor_activations[place + a] + np.exp(log_std) * noise[item, a]
            total += _log_density(inner, log_std, noise[item, a])
            squashed = np.tanh(inner)
            scratch.actor_activations[place + a] = squashed
            pairs[item * pair + pair - actions + a] = constants.centre[a] + constants.half[a] * squashed
        density[item] = total


@njit(inline="always")
def _log_density(inner: np.float32, log_std: np.float32, noise: np.float32) -> np.float32:
    """Return `losses.squashed_log_density` of one number."""
    twice = np.float32(-2.0) * inner
    softplus = twice if twice > np.float32(20.0) else np.log1p(np.exp(twice))
    log_squash = np.float32(2.0) * (_LOG_2 - inner - softplus)
    return np.float32(-0.5) * noise * noise - log_std - _HALF_LOG_2_PI - log_squash


@njit(inline="always")
def soft_policy_step(rows: np.ndarray, seed: int, actor: Stack, critic: Stack, rate: np.ndarray, noise: np.ndarray,
                     temperature: np.float32, averaged: bool, constants: Constants, scratch: Scratch,
                     density: np.ndarray) -> np.float32:
    """Make a step of a seed's actor against `losses.soft_policy_loss`; return it, and fill the densities [B]."""
    batch, pair, actions = len(rows), critic.shape.sizes[0], len(constants.half)
    run_actor(actor, actor.weights, seed, rows, 0, pair, scratch)
    draw_actions(actor, noise, pair, constants, scratch, density)
    copies = len(scratch.critic_activations)
    least_values(critic, critic.weights, seed, np.ones(copies, np.bool_), scratch)
    if averaged:
        average_values(critic, scratch)
    loss, part, two = np.float32(0.0), np.float32(1.0 / batch), np.float32(2.0)
    for item in range(batch):
        loss += temperature * density[item] - scratch.values[item]
    place = nets.outputs_offset(actor.shape, batch)
    for i in range(batch * 2 * actions):
        scratch.actor_grads[place + i] = np.float32(0.0)
    for copy in range(copies):
        _add_value_gradient(copy, seed, actor, critic, averaged, constants, scratch)
    for item in range(batch):
        for a in range(actions):
            squashed, free = scratch.actor_activations[place + a], scratch.actor_activations[place + actions + a]
            # By u: the critics' gradient through the tanh, and that of the density's -log(1 - tanh(u)^2).
            by_inner = scratch.actor_grads[place + a] * (np.float32(1.0) - squashed * squashed)
            by_inner += two * part * temperature * squashed
            by_log_std = by_inner * noise[item, a] * np.exp(free) - part * temperature
            scratch.actor_grads[place + a] = by_inner
            inside = _LEAST <= free <= _MOST
            scratch.actor_grads[place + actions + a] = by_log_std if inside else np.float32(0.0)
        place += 2 * actions
    actor_step(actor, seed, rate, scratch)
    return loss * part


@njit(inline="always")
def _add_value_gradient(copy: int, seed: int, actor: Stack, critic: Stack, averaged: bool, constants: Constants,
                        scratch: Scratch) -> None:
    """Add the derivative of -values by the squashed actions: this critic's part of the mean, or where it has the least.

    It is added to the gradients of the actor's outputs, where the means are.
    """
    copies = len(scratch.critic_activations)
    part = np.float32(-1.0 / (len(scratch.values) * (copies if averaged else 1)))
    batch, pair, actions = len(scratch.values), critic.shape.sizes[0], len(constants.half)
    out, place = nets.outputs_offset(critic.shape, batch), nets.outputs_offset(actor.shape, batch)
    for item in range(batch):
        counts = averaged or scratch.least[item] == copy
        scratch.critic_grads[out + item] = part if counts else np.float32(0.0)
    member = nets.Member(critic.total, copy * (critic.total // copies) + seed)
    nets.backward(critic.shape, critic.weights, member, scratch.critic_activations[copy], scratch.critic_grads, batch,
                  np.empty(0, np.float32))
    for item in range(batch):
        for a in range(actions):
            grad = scratch.critic_grads[item * pair + pair - actions + a] * constants.half[a]
            scratch.actor_grads[place + item * 2 * actions + a] += grad


@njit(inline="always")
def temperature_step(scalar: Scalar, seed: int, rate: np.ndarray, density: np.ndarray, target: np.float32) -> None:
    """Make a step of a seed's temperature; `losses.temperature_loss`."""
    total = np.float32(0.0)
    for item in range(len(density)):
        total += density[item]
    gradient = np.full(1, -(total / np.float32(len(density)) + target), np.float32)
    part = slice(seed, seed + 1)
    nets.adam(scalar.values[part], scalar.mean[part], scalar.square[part], gradient, rate[0], rate[1])
