"""Diagnostics of an actor and a critic: saturation, drift, flat critics, the deadlock index.

All are functions of stacks, axis S first: `agent.act` and `agent.value` of any agent fit, and so do plain functions. No
torch is needed.
"""

from pbcs_ompl.diagnostics.actor_critic import (
    Act,
    Value,
    action_gradient,
    deadlock_index,
    flat_share,
    largest_actions,
    largest_values,
    saturation,
    value_slices,
)
from pbcs_ompl.diagnostics.rewards import distance_to_returns, returns_of, rewarded_share

__all__ = ["Act", "Value", "action_gradient", "deadlock_index", "distance_to_returns", "flat_share", "largest_actions",
           "largest_values", "returns_of", "rewarded_share", "saturation", "value_slices"]
