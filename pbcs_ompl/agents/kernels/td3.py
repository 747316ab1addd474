"""Updates of TD3 for one seed on a CPU; see `td3.py` of the agents."""

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
def update_seed(rows: np.ndarray, inputs: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
                networks: tuple[Stack, Stack], constants: Constants, losses: np.ndarray, seed: int) -> None:
    """Make K updates of one seed; see `updates.Kernel`.

    Args:
        rows: Mini-batches [K, S, B, W].
        inputs: Rates of critic and actor [K, 2], noise on the target's actions [K, S, B, A], which critics give
            the targets [K, S, C], and whether actor and targets are updated [K].
        networks: Actor and critics.
        constants: What does not change.
        losses: Filled with the critics' and the actor's losses [K, S, 2].
        seed: Which one.
    """
    critic_rates, actor_rates, noise, chosen, full = inputs
    actor, critic = networks
    pair = critic.shape.sizes[0]
    scratch = new_scratch(actor, critic, rows.shape[2])
    for k in range(len(rows)):
        batch = rows[k, seed]
        run_actor(actor, actor.target, seed, batch, pair + 2, pair, scratch)
        set_actions(actor, noise[k, seed], pair, constants, scratch)
        least_values(critic, critic.target, seed, chosen[k, seed], scratch)
        set_targets(batch, pair, constants, scratch)
        losses[k, seed, 0] = critic_step(batch, seed, critic, critic_rates[k], scratch)
        losses[k, seed, 1] = np.float32(0.0)
        if full[k]:
            losses[k, seed, 1] = policy_step(batch, seed, actor, critic, actor_rates[k], constants, scratch)
            update_targets(actor, seed, 1, constants.tau)
            update_targets(critic, seed, chosen.shape[2], constants.tau)
