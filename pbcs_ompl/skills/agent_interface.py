"""What skill training needs of an agent: the interface of registered agents, and of a class named as module:Class."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from pbcs_ompl.agents.policy import Policy
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.registry import load
from pbcs_ompl.core.types import Array, BoolArray


class Agent(Protocol):
    """A stack of agents, one for each seed, of which skill training uses one. Arrays are [S, B, ...].

    Attributes:
        num_updates: Gradient steps so far.
    """

    num_updates: int

    def act(self, observations: Array) -> Array:
        """Return the actions of the deterministic policy."""
        ...

    def explore(self, observations: Array) -> Array:
        """Return the actions that the agent itself would try; epsilon-greedy noise is added by the training."""
        ...

    def add_transitions(self, observations: Array, actions: Array, rewards: Array, next_observations: Array,
                        terminals: BoolArray) -> None:
        """Add transitions to the replay buffer."""
        ...

    def train(self, num_updates: int) -> Any:
        """Do gradient steps on the replay buffer."""
        ...

    def value(self, observations: Array, actions: Array) -> Array:
        """Return the values of the critic."""
        ...

    def policy(self, seed_index: int = 0) -> Policy:
        """Return a snapshot of the actor of one seed."""
        ...

    def clear_replay(self) -> None:
        """Empty the replay buffer."""
        ...

    def state_dict(self) -> dict[str, np.ndarray]:
        """Return everything that a resumed training needs."""
        ...

    def load_state_dict(self, state: dict[str, np.ndarray]) -> None:
        """Restore what `state_dict` returned."""
        ...


class AgentSettingsValues(Protocol):
    """The settings of an agent, such as a `pbcs_ompl.agents.DDPGSettings`."""

    def to_dict(self) -> dict[str, Any]:
        """Return all settings by name, as plain values."""
        ...


class SettingsType(Protocol):
    """The type of an agent's settings, such as `pbcs_ompl.agents.DDPGSettings`."""

    def from_preset(self, name: str, **changes: Any) -> AgentSettingsValues:
        """Return the settings of a preset ("fast", "thesis"), some of them changed."""
        ...

    def from_dict(self, values: Mapping[str, Any]) -> AgentSettingsValues:
        """Return the settings of `to_dict()`."""
        ...


class AgentFactory(Protocol):
    """Builds an agent, a stack of one, from a seed; `horizon` times as far-sighted as its settings say."""

    def __call__(self, seed: int, horizon: float = 1.0) -> Agent: ...


class AgentClass(Protocol):
    """What is registered as an agent, or named as module:Class: it builds an `Agent`."""

    settings_type: SettingsType

    def __call__(self, observation_size: int, action_low: Array, action_high: Array, *, settings: Any,
                 seeds: Sequence[int], device: str) -> Agent: ...


def far_sighted(settings: AgentSettingsValues, kind: SettingsType, horizon: float) -> AgentSettingsValues:
    """Return settings whose horizon 1 / (1 - discount) is longer; those without a discount as they are.

    Args:
        settings: Those of an agent.
        kind: Their type.
        horizon: How many times longer.
    """
    values = settings.to_dict()
    if horizon == 1.0 or "discount" not in values:
        return settings
    return kind.from_dict(values | {"discount": 1.0 - (1.0 - values["discount"]) / horizon})


METHODS = tuple(name for name in vars(Agent) if not name.startswith("_"))


def load_agent(name: str) -> AgentClass:
    """Return the class of an agent.

    Raises:
        UnknownName: no such agent; the message suggests the closest one.
        PbcsError: `module:Class` cannot be imported.
        InvalidOption: the class lacks something that skill training needs.
    """
    kind: Any = load("agent", name)
    missing = [method for method in METHODS if not callable(getattr(kind, method, None))]
    settings_type = getattr(kind, "settings_type", None)
    missing += [f"settings_type.{method}" for method in ("from_preset", "from_dict", "to_dict")
                if not callable(getattr(settings_type, method, None))]
    if missing:
        raise InvalidOption(f"{name} is not an agent for skill training: it lacks {', '.join(missing)} "
                            "(see pbcs_ompl.skills.agent_interface.Agent)")
    agent_class: AgentClass = kind
    return agent_class
