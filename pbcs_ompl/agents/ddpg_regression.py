"""DDPG with the regression update of the actor, [Matheron2020] Eq. 6.5 (as in CACLA, van Hasselt and Wiering, 2007).

The critic is that of DDPG (Eq. 1.2) with its targets y. Where a transition did better than the critic expects of the
actor, the actor is pulled towards its action; elsewhere it is left as it is:

    L = sum_i [y_i > Q(s_i, pi(s_i))] (pi(s_i) - a_i)^2

Differs: Eq. 6.5 lacks the square, without which it has no minimum. The loss is a mean over the whole mini-batch, and
distances are measured in half-widths of the action box. Actor and critic learn from the same weights, "simultaneously".
"""

from dataclasses import dataclass

from torch import Tensor

from pbcs_ompl.agents import losses
from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.agents.settings import AgentSettings
from pbcs_ompl.agents.stacked_agent import StackedAgent


@dataclass(frozen=True)
class DDPGRegressionSettings(AgentSettings):
    """Settings of DDPG with the regression update: those that every algorithm has."""

    algorithm = "ddpg-regression"


class DDPGRegression(StackedAgent):
    """S such agents as one stack; see `StackedAgent` for the arguments and methods."""

    settings_type = DDPGRegressionSettings
    settings: DDPGRegressionSettings
    gradients = GRADIENTS

    def update(self, batch: Batch, critic_rate: Tensor, actor_rate: Tensor) -> dict[str, Tensor]:
        """Make one update; see `StackedAgent.update`."""
        targets = self.td_targets(batch)
        actor_loss = self.minimise(self.actor, actor_rate, losses.improvement_loss,
                                   self.critic.weights, batch.obs_actions, targets, self.box)
        critic_loss = self.minimise(self.critic, critic_rate, losses.critic_loss, batch.obs_actions, targets)
        self.update_targets()
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}
