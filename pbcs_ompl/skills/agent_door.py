"""The door through which agents come in: registered ones, and anybody's class as module:Class."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.registry import load
from pbcs_ompl.core.types import Array, BoolArray


class Agent(Protocol):
    """What skill training needs of an agent: a stack of seeds, of which it uses one. Arrays are [S, B, ...].

    `act` gives the actions of the deterministic policy, `explore` those the agent itself would try, `value` those of
    its critic; `policy` is a snapshot of the actor of one seed, a `pbcs_ompl.agents.Policy`.
    """

    num_updates: int

    def act(self, observations: Array) -> Array: ...
    def explore(self, observations: Array) -> Array: ...
    def add_transitions(self, observations: Array, actions: Array, rewards: Array, next_observations: Array,
                 terminals: BoolArray) -> None: ...
    def train(self, num_updates: int) -> Any: ...
    def value(self, observations: Array, actions: Array) -> Array: ...
    def policy(self, seed_index: int = 0) -> Any: ...
    def clear_replay(self) -> None: ...
    def state_dict(self) -> dict[str, np.ndarray]: ...
    def load_state_dict(self, state: dict[str, np.ndarray]) -> None: ...


class SettingsType(Protocol):
    """The type of an agent's settings, such as `pbcs_ompl.agents.DDPGSettings`."""

    def from_preset(self, name: str, **changes: Any) -> Any:
        """Return the settings of a preset ("fast", "thesis"), some of them changed."""
        ...


class AgentClass(Protocol):
    """What is registered as an agent, or named as module:Class: it builds an `Agent`."""

    settings_type: SettingsType

    def __call__(self, observation_size: int, action_low: Array, action_high: Array, *, settings: Any,
                 seeds: Sequence[int], device: str) -> Agent: ...


METHODS = ("act", "explore", "add_transitions", "train", "value", "policy", "clear_replay", "state_dict", "load_state_dict")


def load_agent(name: str) -> AgentClass:
    """Return the class of an agent.

    Raises:
        UnknownName: no such agent; the message suggests the closest one.
        PbcsError: `module:Class` cannot be imported.
        InvalidOption: the class lacks something that skill training needs.
    """
    kind = load("agent", name)
    missing = [method for method in METHODS if not callable(getattr(kind, method, None))]
    if not hasattr(getattr(kind, "settings_type", None), "from_preset"):
        missing.append("settings_type.from_preset")
    if missing:
        raise InvalidOption(f"{name} is no agent for skill training: it lacks {', '.join(missing)} "
                            "(see pbcs_ompl.skills.agent_door.Agent)")
    return kind
