"""DDPG with the regression update of the actor, [Matheron2020] Eq. 6.5 (as in CACLA, van Hasselt and Wiering, 2007).

The critic is that of DDPG (Eq. 1.2) with its targets y. Where a transition did better than the critic expects of the
actor, the actor is pulled towards its action; elsewhere it is left as it is:

    L = sum_i [y_i > Q(s_i, pi(s_i))] (pi(s_i) - a_i)^2

Differs: Eq. 6.5 lacks the square, without which it has no minimum. The loss is a mean over the whole mini-batch, and
distances are measured in half-widths of the action box. Actor and critic learn from the same weights, "simultaneously".
"""

from dataclasses import dataclass

from torch import Tensor

from pbcs_ompl.agents.kernels.gradients import GRADIENTS
from pbcs_ompl.agents.losses import critic_loss, improvement_loss
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
        targets, critic = self.td_targets(batch), self.critic.weights
        distance = self.minimise(self.actor, actor_rate, improvement_loss, critic, batch.obs_actions, targets, self.box)
        values = self.minimise(self.critic, critic_rate, critic_loss, batch.obs_actions, targets)
        self.update_targets()
        return {"critic_loss": values, "actor_loss": distance}
