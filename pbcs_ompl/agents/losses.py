"""The losses of all algorithms, as pure functions on autograd; and the targets that they are given.

Every loss is a mean over the mini-batch, [S] for a stack of S seeds. Its first argument is what is trained; networks
are functions of stacks of inputs [S, B, in], such as `Weights`. The tanh of an actor's outputs is an action in [-1, 1],
called squashed here; an `ActionBox` scales it to an action.
"""

from collections.abc import Callable
from math import inf, log, pi
from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn.functional import softplus

from pbcs_ompl.agents.kernels.sac import LOG_STD

Network = Callable[[Tensor], Tensor]
"""Outputs [S, B, out] for inputs [S, B, in]."""


class ActionBox(NamedTuple):
    """The box of actions, from centre - half to centre + half."""

    half: Tensor
    """[A]"""
    centre: Tensor
    """[A]"""

    def scale(self, squashed: Tensor) -> Tensor:
        """Return the actions [S, B, A] for values in [-1, 1]."""
        return torch.addcmul(self.centre, squashed, self.half)

    def squash(self, actions: Tensor) -> Tensor:
        """Return values in [-1, 1] for actions [S, B, A]."""
        return (actions - self.centre) / self.half

    def join(self, observations: Tensor, squashed: Tensor) -> Tensor:
        """Return observations and scaled actions side by side [S, B, O + A], as a critic takes them."""
        return torch.cat((observations, self.scale(squashed)), dim=2)


def td_targets(rewards: Tensor, not_done: Tensor, next_values: Tensor, discount: float) -> Tensor:
    """Return y = r + discount Q'(s', a') [S, B, 1], or r where the transition is terminal.

    Source: [Matheron2020] Eq. 1.2 (Lillicrap et al., 2015).

    Args:
        rewards: r [S, B, 1].
        not_done: 0 where the transition is terminal, else 1 [S, B, 1].
        next_values: Q'(s', a') of the target networks [S, B, 1].
        discount: In [0, 1).
    """
    return torch.addcmul(rewards, not_done, next_values, value=discount)


class CriticStack(NamedTuple):
    """A stack of several critics of each seed: the first ones of all seeds, then the second ones."""

    copies: int
    """How many C each seed has."""
    averaged: bool
    """Whether an actor learns from their mean, else from the least of their values."""

    def of(self, values: Tensor) -> Tensor:
        """Return the values [C, S, B, 1] of each critic for those of the stack [C S, B, 1]."""
        return values.view(self.copies, -1, *values.shape[1:])


def least_values(values: Tensor, chosen: Tensor) -> Tensor:
    """Return the least values [S, B, 1] of the chosen critics.

    Args:
        values: Those of a stack of critics, the first ones of all seeds first [C S, B, 1].
        chosen: Which critics of each seed count [S, C].
    """
    each = values.view(chosen.shape[1], -1, *values.shape[1:])
    return each.masked_fill(~chosen.T[:, :, None, None], inf).amin(dim=0)


def critic_loss(critic: Network, obs_actions: Tensor, targets: Tensor) -> Tensor:
    """Return the mean of (Q(s, a) - y)^2 [S]; [Matheron2020] Eq. 1.2.

    Args:
        critic: Q.
        obs_actions: s and a side by side [S, B, O + A].
        targets: y [S, B, 1].
    """
    return (critic(obs_actions) - targets).square().mean(dim=(1, 2))


def policy_loss(actor: Network, critic: Network, observations: Tensor, box: ActionBox) -> Tensor:
    """Return the mean of -Q(s, pi(s)) [S]; its gradient is the deterministic policy gradient.

    Source: [Matheron2020] Eqs. 1.3 and 1.5 (Silver et al., 2014).

    Args:
        actor: pi, before its tanh.
        critic: Q.
        observations: s [S, B, O].
        box: Of the actions.
    """
    return -critic(box.join(observations, actor(observations).tanh())).mean(dim=(1, 2))


def imitation_loss(actor: Network, observations: Tensor, squashed: Tensor) -> Tensor:
    """Return the mean of |pi(s) - c|^2 [S], in half-widths of the action box; [Matheron2020] 6.6.2.

    Args:
        actor: pi, before its tanh.
        observations: s [S, B, O].
        squashed: The actions c to be imitated, in [-1, 1] [S, B, A].
    """
    return (actor(observations).tanh() - squashed).square().sum(dim=2).mean(dim=1)


def improvement_loss(actor: Network, critic: Network, obs_actions: Tensor, targets: Tensor, box: ActionBox) -> Tensor:
    """Return the mean of [y > Q(s, pi(s))] |pi(s) - a|^2 [S], in half-widths of the action box.

    Source: [Matheron2020] Eq. 6.5 (CACLA, van Hasselt and Wiering, 2007).

    Args:
        actor: pi, before its tanh.
        critic: Q.
        obs_actions: s and a side by side [S, B, O + A].
        targets: y [S, B, 1].
        box: Of the actions.
    """
    size = obs_actions.shape[2] - len(box.half)
    observations, taken = obs_actions[..., :size], box.squash(obs_actions[..., size:])
    squashed = actor(observations).tanh()
    better = targets > critic(box.join(observations, squashed.detach()))
    return ((squashed - taken) * better).square().sum(dim=2).mean(dim=1)


def sample_squashed(outputs: Tensor, noise: Tensor) -> tuple[Tensor, Tensor]:
    """Return tanh(u) [S, B, A], u normal, and the logarithm of its density [S, B, 1].

    Densities are measured in half-widths of the action box. Source: Haarnoja et al., 2018, appendix C.

    Args:
        outputs: Mean and log standard deviation of u side by side [S, B, 2 A].
        noise: Standard normal numbers [S, B, A].
    """
    mean, log_std = outputs.chunk(2, dim=2)
    log_std = log_std.clamp(*LOG_STD)
    inner = torch.addcmul(mean, log_std.exp(), noise)
    return inner.tanh(), squashed_log_density(inner, log_std, noise)


def squashed_log_density(inner: Tensor, log_std: Tensor, noise: Tensor) -> Tensor:
    """Return the logarithm of the density of tanh(u) [S, B, 1] for u = mean + exp(log_std) noise.

    Args:
        inner: u [S, B, A].
        log_std: The logarithm of the standard deviation of u [S, B, A].
        noise: Standard normal numbers [S, B, A].
    """
    # log(1 - tanh(u)^2), without its cancellation for large u.
    log_squash = 2.0 * (log(2.0) - inner - softplus(-2.0 * inner))
    return (-0.5 * noise.square() - log_std - 0.5 * log(2.0 * pi) - log_squash).sum(dim=2, keepdim=True)


def soft_policy_loss(actor: Network, critics: Network, observations: Tensor, noise: Tensor, temperature: Tensor,
                     box: ActionBox, each: CriticStack) -> tuple[Tensor, Tensor]:
    """Return the mean of temperature log pi(a|s) - min_i Q_i(s, a) [S], a drawn from pi, and log pi(a|s) [S, B, 1].

    Where the critics are averaged, their mean takes the place of their minimum (REDQ, Chen et al., 2021).

    Source: Haarnoja et al., 2018, Eq. 7 of "Soft actor-critic algorithms and applications".

    Args:
        actor: Mean and log standard deviation of pi before its tanh.
        critics: Q_1 of all seeds, then Q_2, ..., as one stack [C S, B, 1].
        observations: s [S, B, O].
        noise: Standard normal numbers [S, B, A].
        temperature: [S].
        box: Of the actions.
        each: How many critics there are.
    """
    squashed, log_density = sample_squashed(actor(observations), noise)
    values = each.of(critics(box.join(observations, squashed).repeat(each.copies, 1, 1)))
    values = values.mean(dim=0) if each.averaged else values.amin(dim=0)
    return (temperature[:, None, None] * log_density - values).mean(dim=(1, 2)), log_density


def temperature_loss(log_temperature: Tensor, log_density: Tensor, target_entropy: float) -> Tensor:
    """Return -log temperature (log pi(a|s) + target entropy), a mean over the mini-batch [S].

    Source: Haarnoja et al., 2018, Eq. 18 of "Soft actor-critic algorithms and applications", for the logarithm.

    Args:
        log_temperature: [S].
        log_density: log pi(a|s) [S, B, 1].
        target_entropy: The entropy that the policy should have.
    """
    return -log_temperature * (log_density.mean(dim=(1, 2)) + target_entropy)


def normal_log_density(inner: Tensor, means: Tensor, log_std: Tensor) -> Tensor:
    """Return the logarithm of the density of a normal distribution [S, B].

    Args:
        inner: Where [S, B, A].
        means: [S, B, A].
        log_std: The logarithm of the standard deviation of each action [S, A].
    """
    wide = log_std[:, None]
    noise = (inner - means) * (-wide).exp()
    return (-0.5 * noise.square() - wide - 0.5 * log(2.0 * pi)).sum(dim=2)


def clipped_policy_loss(actor: Network, observations: Tensor, inner: Tensor, log_density: Tensor, gains: Tensor,
                        log_std: Tensor, clip: float) -> tuple[Tensor, Tensor, Tensor]:
    """Return PPO's loss of the actor [S], an estimate of the KL divergence [S], and the means [S, B, A].

        ratio = pi(a|s) / pi_before(a|s);  loss = -mean min(ratio A, clip(ratio, 1 - clip, 1 + clip) A)

    Source: Schulman et al. (2017), Eq. 7; the divergence is the mean of ratio - 1 - log ratio (Schulman 2020,
    "Approximating KL divergence", k3).

    Args:
        actor: The mean of pi, before its tanh.
        observations: s [S, B, O].
        inner: a, in half-widths of the action box [S, B, A].
        log_density: log pi_before(a|s) [S, B].
        gains: Advantages A [S, B].
        log_std: The logarithm of the standard deviation of pi [S, A].
        clip: How far a ratio counts.
    """
    means = actor(observations).tanh()
    log_ratio = normal_log_density(inner, means, log_std) - log_density
    return clipped_surrogate(log_ratio, gains, clip), (log_ratio.exp() - 1.0 - log_ratio).mean(dim=1), means


def clipped_spread_loss(log_std: Tensor, means: Tensor, inner: Tensor, log_density: Tensor, gains: Tensor, clip: float,
                        entropy_weight: float) -> Tensor:
    """Return PPO's loss [S] as a function of the standard deviation, with the bonus of the entropy.

    The entropy of a normal distribution is the sum of the logarithms of its standard deviations, and a constant.

    Args:
        log_std, means, inner, log_density, gains, clip: See `clipped_policy_loss`.
        entropy_weight: Of the bonus.
    """
    log_ratio = normal_log_density(inner, means, log_std) - log_density
    return clipped_surrogate(log_ratio, gains, clip) - entropy_weight * log_std.sum(dim=1)


def clipped_surrogate(log_ratio: Tensor, gains: Tensor, clip: float) -> Tensor:
    """Return -mean min(ratio A, clip(ratio, 1 - clip, 1 + clip) A) [S]; Schulman et al. (2017), Eq. 7.

    Args:
        log_ratio: The logarithm of the ratio [S, B].
        gains: Advantages A [S, B].
        clip: How far a ratio counts.
    """
    ratio = log_ratio.exp()
    return -torch.minimum(ratio * gains, ratio.clamp(1.0 - clip, 1.0 + clip) * gains).mean(dim=1)
