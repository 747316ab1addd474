"""What an actor and a critic have come to: saturation, drift, flat critics, the deadlock index.

Everything here works on functions of stacks, axis S first: `agent.act` and `agent.value` of any agent fit, and so do
plain functions. No torch is needed.
"""

from pbcs_ompl.diagnostics.actor import Act, largest_actions, saturation
from pbcs_ompl.diagnostics.critic import (
    Value,
    action_slope,
    deadlock_index,
    flat_share,
    largest_values,
    value_slices,
)
from pbcs_ompl.diagnostics.replay import rewarded_share
from pbcs_ompl.diagnostics.returns import distance_to_returns, returns_of

__all__ = ["Act", "Value", "action_slope", "deadlock_index", "distance_to_returns", "flat_share", "largest_actions",
           "largest_values", "returns_of", "rewarded_share", "saturation", "value_slices"]
