"""Whole updates as kernels: how an agent runs them on a CPU, seed by seed, on one thread or on several."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from pbcs_ompl.agents.kernels import ddpg, sac, td3
from pbcs_ompl.agents.kernels.actor_critic import Constants, Stack
from pbcs_ompl.agents.kernels.network import shape_of
from pbcs_ompl.agents.networks import TrainedNetwork, TrainedScalar


class Kernel(NamedTuple):
    """The updates of one algorithm."""

    update_seed: Callable[..., None]
    """update_seed(rows, inputs, networks, constants, losses, seed) makes K updates of one seed of a stack."""
    losses: tuple[str, ...]
    """Names of the losses, in their order."""


DDPG_KERNEL = Kernel(ddpg.update_seed, ("critic_loss", "actor_loss"))
TD3_KERNEL = Kernel(td3.update_seed, ("critic_loss", "actor_loss"))
SAC_KERNEL = Kernel(sac.update_seed, ("critic_loss", "actor_loss", "temperature"))


def run(kernel: Kernel, rows: Tensor, inputs: Sequence[Any], trained: Sequence[TrainedNetwork | TrainedScalar],
        constants: Constants) -> dict[str, np.ndarray]:
    """Make K updates of all seeds; return the losses [K, S] by name.

    Args:
        kernel: Of the algorithm.
        rows: Mini-batches [K, S, B, W].
        inputs: Of `StackedAgent.update_inputs`.
        trained: What is trained, in the order of the algorithm.
        constants: What does not change.
    """
    seeds = rows.shape[1]
    losses = np.empty((*rows.shape[:2], len(kernel.losses)), dtype=np.float32)
    one = partial(kernel.update_seed, rows.numpy(), tuple(np.asarray(values) for values in inputs),
                  tuple(_arrays(part) for part in trained), constants, losses)
    threads = min(torch.get_num_threads(), seeds)
    if threads == 1:
        for seed in range(seeds):
            one(seed)
    else:
        with ThreadPoolExecutor(threads, initializer=partial(torch.set_flush_denormal, True)) as pool:
            list(pool.map(one, range(seeds)))
    return dict(zip(kernel.losses, np.moveaxis(losses.astype(np.float64), 2, 0), strict=True))


def _arrays(trained: TrainedNetwork | TrainedScalar) -> Stack | sac.Scalar:
    arrays = [tensor.numpy() for tensor in trained.tensors().values()]
    if isinstance(trained, TrainedScalar):
        return sac.Scalar(*arrays)
    network = trained.network
    shape = shape_of(network.sizes, network.layer_norm)
    return Stack(shape, len(arrays[0]) // network.num_parameters, *arrays)
