"""How do I write my own algorithm? DDPG whose critic minimises the Huber loss instead of the squared error.

    python examples/ddpg_huber.py
    pbcs train --env pbcs/Maze-v0 --env-kwargs '{"size": 2}' --agent examples.ddpg_huber:DDPGHuber

An algorithm is its settings, one loss for each network, and the order of the steps. Gradients come from autograd.
"""

from collections.abc import Callable
from dataclasses import dataclass

from torch import Tensor
from torch.nn.functional import huber_loss

import pbcs_ompl
from pbcs_ompl.agents import AgentSettings, StackedAgent
from pbcs_ompl.agents.losses import policy_loss
from pbcs_ompl.agents.replay import Batch
from pbcs_ompl.core.options import check_range


@dataclass(frozen=True)
class DDPGHuberSettings(AgentSettings):
    """Those that every algorithm has, and where the loss of an error becomes linear."""

    algorithm = "ddpg-huber"

    huber_delta: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_range("huber_delta", self.huber_delta, self.huber_delta > 0.0, "a positive number")


def huber_critic_loss(critic: Callable[[Tensor], Tensor], obs_actions: Tensor, targets: Tensor, delta: float) -> Tensor:
    """Return the mean Huber loss [S] of Q(s, a) - y, from s and a [S, B, O + A] and y [S, B, 1]."""
    return huber_loss(critic(obs_actions), targets, reduction="none", delta=delta).mean(dim=(1, 2))


class DDPGHuber(StackedAgent):
    """S agents as one stack; actor, critic, targets, replay, saving and loading are those of every agent."""

    settings_type = DDPGHuberSettings
    settings: DDPGHuberSettings

    def update(self, batch: Batch, critic_rate: Tensor, actor_rate: Tensor) -> dict[str, Tensor]:
        """Minimise the critic's loss, then the actor's, then move the targets."""
        critic_loss = self.minimise(self.critic, critic_rate, huber_critic_loss,
                                    batch.obs_actions, self.td_targets(batch), self.settings.huber_delta)
        actor_loss = self.minimise(self.actor, actor_rate, policy_loss,
                                   self.critic.weights, batch.observations, self.box)
        self.update_targets()
        return {"critic_loss": critic_loss, "actor_loss": actor_loss}


if __name__ == "__main__":
    result = pbcs_ompl.train("pbcs/Maze-v0", env_kwargs={"size": 2}, agent="ddpg_huber:DDPGHuber")
    print(f"solved: {result.solved}, {result.updates:,} updates")
