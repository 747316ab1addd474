"""What a training is a function of."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from pbcs_ompl.agents.update import choose_device
from pbcs_ompl.bridge.planner_spec import PlannerSpec
from pbcs_ompl.core.errors import InvalidOption, UnknownName
from pbcs_ompl.core.interfaces import ResettableModel
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
        planner: What makes the plan: a registered planner, or module:Class.
        planner_kwargs: Options of the planner.
        agent: A registered agent, or module:Class.
        preset: Named settings of the skills and of the agent.
        settings: Skill settings that differ from the preset.
        agent_settings: Agent settings that differ from the preset.
        seed: Root of all random streams.
        max_transitions: Budget of environment steps, planning included.
        device: Where the agent learns, "cpu" or "cuda".

    Raises:
        UnknownName: no such method, planner, agent or preset.
        InvalidOption: a setting or an option that does not exist, a value out of its range, or a planner for a method
            that makes no plan.
    """

    method: str = "pbcs"
    planner: str = "Ex"
    planner_kwargs: dict[str, Any] = field(default_factory=dict)
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
        if self.chooses_planner and self.method in WITHOUT_PLAN:
            raise InvalidOption(f"method {self.method!r} trains without a plan; remove planner and planner_kwargs, or "
                                f"choose from {', '.join(METHODS.keys() - WITHOUT_PLAN)}")
        PlannerSpec(self.planner, self.planner_kwargs)
        self.skill_settings()
        self._agent_settings()
        choose_device(self.device)

    @property
    def chooses_planner(self) -> bool:
        """Whether the planner is another than Ex as it is."""
        return self.planner != "Ex" or bool(self.planner_kwargs)

    def skill_settings(self) -> SkillSettings:
        """Return the preset's skill settings with this run's changes."""
        return skill_preset(self.preset, self.method).updated(self.settings)

    def agent_factory(self, model: ResettableModel) -> Callable[[int], Agent]:
        """Return a function that builds an agent for `model` from a seed."""
        kind, settings = load_agent(self.agent), self._agent_settings()
        return lambda seed: kind(model.observation_size, model.action_low, model.action_high, settings=settings,
                                 seeds=(seed,), device=self.device)

    def _agent_settings(self) -> Any:
        return load_agent(self.agent).settings_type.from_preset(self.preset, **self.agent_settings)
