"""Deep deterministic policy gradient, [Matheron2020] section 1.2.5, Eqs. 1.2-1.5 (Lillicrap et al., 2015).

Differs: losses are means over the mini-batch, not (half) sums; Adam does not see the factor.
"""

from dataclasses import dataclass

from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.kernels.updates import DDPG_KERNEL
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent


@dataclass(frozen=True)
class DDPGSettings(AgentSettings):
    """Settings of DDPG: those that every algorithm has."""

    algorithm = "ddpg"


class DDPG(StackedAgent):
    """S DDPG agents as one stack; see `StackedAgent` for the arguments and methods.

    Example:
        >>> agent = DDPG(2, [-1.0], [1.0], seeds=(0, 1))
        >>> agent.act(np.zeros((2, 5, 2))).shape
        (2, 5, 1)
    """

    settings_type = DDPGSettings
    settings: DDPGSettings
    gradients = GRADIENTS
    kernel = DDPG_KERNEL

    def update(self, batch: Batch, critic_rate: Tensor, actor_rate: Tensor) -> dict[str, Tensor]:
        """Make one update; see `StackedAgent.update`."""
        critic_loss = self.minimise(self.critic, critic_rate, losses.critic_loss,
                                    batch.obs_actions, self.td_targets(batch))
        actor_loss = self.minimise(self.actor, actor_rate, losses.policy_loss,
                                   self.critic.weights, batch.observations, self.box)
        self.update_targets()
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}
