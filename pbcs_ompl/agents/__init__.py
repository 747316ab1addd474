"""Agents: DDPG, stacked over seeds. Everything that needs torch lies here or above.

Raises:
    MissingDependency: at import, when torch or safetensors is not installed.
"""

from pbcs_ompl.core.errors import MissingDependency

try:
    import safetensors  # noqa: F401 - skills save with it; better to know before a training than after it
    import torch  # noqa: F401
except ModuleNotFoundError as error:
    raise MissingDependency(
        f'agents need {error.name!r}, which is not installed: pip install "pbcs-ompl[rl]"') from error

from pbcs_ompl.agents.ddpg import DDPG, DDPGSettings
from pbcs_ompl.agents.noise import epsilon_greedy
from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.agents.presets import preset_names
from pbcs_ompl.agents.stacked_agent import NonFiniteData, StackedAgent

__all__ = [
    "DDPG",
    "DDPGSettings",
    "NonFiniteData",
    "Policy",
    "StackedAgent",
    "epsilon_greedy",
    "preset_names",
]
