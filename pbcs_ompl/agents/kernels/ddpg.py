"""Updates of DDPG for one seed on a CPU; see `ddpg.py` of the agents."""

import numpy as np

from pbcs_ompl.agents.kernels.actor_critic import (
    Constants,
    Stack,
    critic_step,
    least_values,
    new_scratch,
    policy_step,
    run_actor,
    set_actions,
    set_targets,
    update_targets,
)
from pbcs_ompl.core.compiled import njit


@njit(nogil=True)
def update_seed(rows: np.ndarray, inputs: tuple[np.ndarray, np.ndarray], networks: tuple[Stack, Stack],
                constants: Constants, losses: np.ndarray, seed: int) -> None:
    """Make K updates of one seed; see `updates.Kernel`.

    Args:
        rows: Mini-batches [K, S, B, W].
        inputs: Rates of critic and actor [K, 2].
        networks: Actor and critic.
        constants: What does not change.
        losses: Filled with the critic's and the actor's losses [K, S, 2].
        seed: Which one.
    """
    critic_rates, actor_rates = inputs
    actor, critic = networks
    pair, without_noise, chosen = critic.shape.sizes[0], np.empty((0, 0), np.float32), np.ones(1, np.bool_)
    scratch = new_scratch(actor, critic, rows.shape[2])
    for k in range(len(rows)):
        batch = rows[k, seed]
        run_actor(actor, actor.target, seed, batch, pair + 2, pair, scratch)
        set_actions(actor, without_noise, pair, constants, scratch)
        least_values(critic, critic.target, seed, chosen, scratch)
        set_targets(batch, pair, constants, scratch)
        losses[k, seed, 0] = critic_step(batch, seed, critic, critic_rates[k], scratch)
        losses[k, seed, 1] = policy_step(batch, seed, actor, critic, actor_rates[k], constants, scratch)
        update_targets(actor, seed, 1, constants.tau)
        update_targets(critic, seed, 1, constants.tau)
