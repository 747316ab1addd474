"""What a training is a function of."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pbcs_ompl.agents.update import choose_device
from pbcs_ompl.core.contracts import ResetAnywhere
from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.skills.agent_door import Agent, load_agent
from pbcs_ompl.skills.method import Method
from pbcs_ompl.skills.offline import Bootstrapped, Offline
from pbcs_ompl.skills.one_skill import PB, Plain, SlidingWindow
from pbcs_ompl.skills.pbcs import PBCS
from pbcs_ompl.skills.settings import SkillSettings, skill_preset

METHODS: dict[str, Callable[..., Method]] = {"pbcs": PBCS, "pb": PB, "backplay": SlidingWindow, "plain": Plain,
                                             "bootstrapped": Bootstrapped, "offline": Offline}
WITHOUT_PLAN = frozenset({"plain", "bootstrapped", "offline"})


@dataclass(frozen=True)
class TrainConfig:
    """Everything but the environment that a training depends on.

    Attributes:
        method: "pbcs", "pb", "backplay", "plain", "bootstrapped" or "offline".
        agent: A registered agent, or module:Class.
        preset: Named settings of the skills and of the agent.
        settings: Skill settings that differ from the preset.
        agent_settings: Agent settings that differ from the preset.
        seed: Root of all random streams.
        max_transitions: Budget of environment steps, planning included.
        device: Where the agent learns, "cpu" or "cuda".

    Raises:
        UnknownName: no such method, agent or preset.
        InvalidOption: a setting that does not exist, or a value out of its range.
    """

    method: str = "pbcs"
    agent: str = "ddpg"
    preset: str = "fast"
    settings: dict[str, Any] = field(default_factory=dict)
    agent_settings: dict[str, Any] = field(default_factory=dict)
    seed: int = 0
    max_transitions: int = 10_000_000
    device: str = "cpu"

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise UnknownName("method", self.method, METHODS)
        if self.max_transitions < 1:
            raise InvalidOption(f"max_transitions = {self.max_transitions}, expected at least 1")
        self.skill_settings()
        self._agent_settings()
        choose_device(self.device)

    def skill_settings(self) -> SkillSettings:
        """Return the preset's skill settings with this run's changes."""
        return skill_preset(self.preset, self.method).updated(self.settings)

    def agent_factory(self, model: ResetAnywhere) -> Callable[[int], Agent]:
        """Return a function that builds an agent for `model` from a seed."""
        kind, settings = load_agent(self.agent), self._agent_settings()
        return lambda seed: kind(model.observation_size, model.action_low, model.action_high, settings=settings,
                                 seeds=(seed,), device=self.device)

    def _agent_settings(self) -> Any:
        return load_agent(self.agent).settings_type.from_preset(self.preset, **self.agent_settings)
