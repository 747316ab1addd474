"""Agents: DDPG, TD3, SAC, PPO and two variants of DDPG, stacked over seeds. Subpackages below it need no torch.

Raises:
    MissingDependency: at import, when torch or safetensors is not installed.
"""

from pbcs_ompl.core.errors import MissingDependency

try:
    import safetensors  # noqa: F401 - skills save with it; a missing library is reported before training
    import torch  # noqa: F401
except ModuleNotFoundError as error:
    raise MissingDependency(
        f'agents need {error.name!r}, which is not installed: pip install "pbcs-ompl[rl]"') from error

from pbcs_ompl.agents.ddpg import DDPG, DDPGSettings
from pbcs_ompl.agents.ddpg_argmax import DDPGArgmax, DDPGArgmaxSettings
from pbcs_ompl.agents.ddpg_regression import DDPGRegression, DDPGRegressionSettings
from pbcs_ompl.agents.noise import EpsilonGreedy, Gaussian, OrnsteinUhlenbeck, make_noise
from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.agents.ppo import PPO, PPOSettings
from pbcs_ompl.agents.rollout import Rollout, advantages
from pbcs_ompl.agents.sac import SAC, SACSettings
from pbcs_ompl.agents.settings import AgentSettings, preset_names, preset_version
from pbcs_ompl.agents.stacked_agent import NonFiniteData, StackedAgent
from pbcs_ompl.agents.td3 import TD3, TD3Settings

__all__ = [
    "DDPG",
    "PPO",
    "SAC",
    "TD3",
    "AgentSettings",
    "DDPGArgmax",
    "DDPGArgmaxSettings",
    "DDPGRegression",
    "DDPGRegressionSettings",
    "DDPGSettings",
    "EpsilonGreedy",
    "Gaussian",
    "NonFiniteData",
    "OrnsteinUhlenbeck",
    "PPOSettings",
    "Policy",
    "Rollout",
    "SACSettings",
    "StackedAgent",
    "TD3Settings",
    "advantages",
    "make_noise",
    "preset_names",
    "preset_version",
]
