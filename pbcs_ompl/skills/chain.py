"""A chain of skills that acts as one policy, can be saved, loaded and evaluated."""

from collections.abc import Sequence
from dataclasses import dataclass

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.skills.activation_sets import ActivationSet, Target, from_arrays, kind_of, to_arrays
from pbcs_ompl.skills.chain_files import ChainContent
from pbcs_ompl.skills.controller import ChainController
from pbcs_ompl.skills.observed_sets import Entry, entry_from_arrays, entry_kinds, entry_to_arrays
from pbcs_ompl.skills.policy import SkillPolicy
from pbcs_ompl.skills.trained_controller import TaskValues, TrainedController, actions_of
from pbcs_ompl.skills.waypoints import Waypoints


@dataclass(frozen=True, eq=False)
class Skill:
    """A policy, where it may start and where it leads.

    Attributes:
        policy: What it does.
        activation: The states in which it may start.
        target: Where it leads.
        entry: The activation set as a controller sees it; everywhere for the first skill.
    """

    policy: SkillPolicy
    activation: ActivationSet
    target: Target
    entry: Entry


@dataclass(frozen=True, eq=False)
class SkillChain(TrainedController):
    """Ordered skills, from the environment's start to its goal; [Matheron2020] section 7.2.

    The chain switches to a later skill as soon as that skill's entry is observed, and never goes back.

    Attributes:
        skills: In the order of execution.
        start: The state it was trained to start from [D].
        environment: The environment it was trained in.
        time_limit: Steps after which an execution counts as failed.
        actions: The environment's action space.
        reset_seed: The seed of the reset that leads to the start; None where none is known to.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", method="pbcs", seed=0)
        >>> type(result.chain).__name__, len(result.chain.skills) > 0
        ('SkillChain', True)
    """

    kind = "skill chain"
    skills: tuple[Skill, ...]
    start: Array
    environment: EnvSpec
    time_limit: int
    actions: ActionMap
    reset_seed: int | None = None

    @classmethod
    def of(cls, skills: list[Skill], waypoints: Waypoints, steps_per_skill: int) -> "SkillChain":
        """Return a chain of trained skills.

        Args:
            skills: In the order of execution.
            waypoints: Those that they were trained along.
            steps_per_skill: Time limit of an execution, in steps for each skill.
        """
        model = waypoints.model
        return cls(tuple(skills), waypoints.states[0], model.spec, steps_per_skill * len(skills), actions_of(model),
                   waypoints.reset_seed)

    @property
    def circles(self) -> Sequence[tuple[Array, float]]:
        """The activation sets, for pictures: states [D] and radii."""
        return [(skill.activation.center, skill.activation.radius) for skill in self.skills]

    @property
    def num_policies(self) -> int:
        """Number of skills."""
        return len(self.skills)

    def controller(self) -> ChainController:
        """Return the chain as a controller of observations, for one episode until its `reset` says otherwise."""
        return ChainController([skill.policy for skill in self.skills], [skill.entry for skill in self.skills],
                               self.actions)

    @property
    def content(self) -> ChainContent:
        """Activation sets, targets and entries as arrays, their kinds in the structure."""
        arrays: dict[str, Array] = {}
        for index, skill in enumerate(self.skills):
            arrays |= to_arrays(skill.activation, f"activation{index}") | to_arrays(skill.target, f"target{index}")
            arrays |= entry_to_arrays(skill.entry, f"entry{index}")
        structure = {"skills": [{"activation": kind_of(skill.activation), "target": kind_of(skill.target),
                                 "entry": entry_kinds(skill.entry)} for skill in self.skills]}
        return ChainContent(structure, arrays, [skill.policy for skill in self.skills])

    @classmethod
    def from_content(cls, content: ChainContent, task: TaskValues) -> "SkillChain":
        """Return the chain of `content` for a task."""
        structure, arrays, policies = content
        skills = tuple(
            Skill(policy, from_arrays(entry["activation"], arrays, f"activation{index}"),
                  from_arrays(entry["target"], arrays, f"target{index}"),
                  entry_from_arrays(entry["entry"], arrays, f"entry{index}"))
            for index, (policy, entry) in enumerate(zip(policies, structure["skills"], strict=True)))
        return cls(skills=skills, **task)
