"""A chain of skills that acts as one policy, can be saved, loaded and evaluated."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.results.files import read_arrays, read_json, write_arrays, write_json
from pbcs_ompl.skills.activation_sets import ActivationSet, Target, from_arrays, kind_of, to_arrays
from pbcs_ompl.skills.episodes import with_random_actions
from pbcs_ompl.skills.policy import SkillPolicy, load_policies, save_policies
from pbcs_ompl.skills.waypoints import Waypoints

FORMAT = "pbcs_ompl skill chain"
VERSION = 3


@dataclass(frozen=True, eq=False)
class Skill:
    """A policy, the set of states in which it may start, and where it leads."""

    policy: SkillPolicy
    activation: ActivationSet
    target: Target


@dataclass(frozen=True)
class Rollouts:
    """What a batch of executions of a chain did.

    Attributes:
        success: Which executions reached the environment's goal [B].
        steps: Steps until then, or until the time limit [B].
        skills: The index of the skill each execution ended in [B].
        states: The states of the first execution, for pictures [T+1, D].
    """

    success: BoolArray
    steps: IndexArray
    skills: IndexArray
    states: Array


@dataclass(frozen=True, eq=False)
class SkillChain:
    """Ordered skills, from the environment's start to its goal; [Matheron2020] section 7.2.

    The chain switches to a later skill as soon as that skill's activation set is entered, and never goes back.

    Attributes:
        skills: In the order of execution.
        start: The state it was trained to start from [D].
        environment: The environment it was trained in.
        time_limit: Steps after which an execution counts as failed.
    """

    skills: tuple[Skill, ...]
    start: Array
    environment: EnvSpec
    time_limit: int

    @classmethod
    def of(cls, skills: list[Skill], waypoints: Waypoints, steps_per_skill: int) -> "SkillChain":
        """Return a chain of trained skills.

        Args:
            skills: In the order of execution.
            waypoints: Those that they were trained along.
            steps_per_skill: Time limit of an execution, in steps for each skill.
        """
        return cls(tuple(skills), waypoints.states[0], waypoints.model.spec, steps_per_skill * len(skills))

    def check_belongs_to(self, model: ResettableModel) -> None:
        """Raise Mismatch when the chain was trained in another environment."""
        if not self.environment.same_as(model.spec):
            raise Mismatch(f"the skill chain was trained in {self.environment}, not in {model.spec}")

    def controller(self, model: ResettableModel, count: int = 1) -> "ChainController":
        """Return a controller of `count` executions side by side."""
        return ChainController(self, model, count)

    def rollouts(self, model: ResettableModel, starts: Array, *, epsilon: float = 0.0,
                 rng: np.random.Generator | None = None, max_steps: int | None = None) -> Rollouts:
        """Execute the chain from several states side by side.

        Args:
            model: The environment.
            starts: States [B, D].
            epsilon: Fraction of actions that are replaced by random ones.
            rng: Source of random actions.
            max_steps: Time limit in steps; None for that of the chain.
        """
        rng = rng or np.random.default_rng(0)
        limit = self.time_limit if max_steps is None else max_steps
        controller = self.controller(model, len(starts))
        states, trace = starts.copy(), [starts[0].copy()]
        success = np.zeros(len(starts), dtype=bool)
        steps = np.full(len(starts), limit, dtype=np.int64)
        alive = np.arange(len(starts))
        for step in range(1, limit + 1):
            controls = with_random_actions(model, controller.act(states[alive], alive), epsilon, rng)
            outcome = model.transition(states[alive], controls)
            states[alive] = outcome.states
            if alive[0] == 0:
                trace.append(states[0].copy())
            success[alive] = outcome.success
            ended = outcome.success | outcome.ended
            steps[alive[ended]] = step
            alive = alive[~ended]
            if not len(alive):
                break
        return Rollouts(success, steps, controller.current, np.array(trace))

    def rollout(self, model: ResettableModel, state: Array | None = None, *, epsilon: float = 0.0,
                rng: np.random.Generator | None = None, max_steps: int | None = None) -> Array:
        """Return the states [T+1, D] of one execution.

        Args:
            model: The environment.
            state: Where it starts [D]; None for the chain's start.
            epsilon, rng, max_steps: See `rollouts`.
        """
        first = self.start if state is None else state
        return self.rollouts(model, first[None], epsilon=epsilon, rng=rng, max_steps=max_steps).states

    @checked
    def save(self, folder: str | Path) -> None:
        """Write chain.json (structure), chain.npz (activation sets and targets) and chain.safetensors (policies)."""
        folder = Path(folder)
        save_policies(folder / "chain.safetensors", [skill.policy for skill in self.skills])
        arrays = {"start": self.start}
        for index, skill in enumerate(self.skills):
            arrays |= to_arrays(skill.activation, f"activation{index}") | to_arrays(skill.target, f"target{index}")
        write_arrays(folder / "chain.npz", **arrays)
        write_json(folder / "chain.json", {
            "format": FORMAT, "version": VERSION, "environment": self.environment.to_dict(),
            "time_limit": self.time_limit,
            "skills": [{"activation": kind_of(s.activation), "target": kind_of(s.target)} for s in self.skills]})

    @classmethod
    @checked
    def load(cls, folder: str | Path) -> "SkillChain":
        """Read a chain that `save` wrote.

        Raises:
            DamagedFile: a file is missing, truncated, or of another version.
        """
        folder = Path(folder)
        structure = read_json(folder / "chain.json")
        if not isinstance(structure, dict) or structure.get("format") != FORMAT:
            raise DamagedFile(f"{folder / 'chain.json'} is not a skill chain")
        if structure["version"] != VERSION:
            raise DamagedFile(f"{folder / 'chain.json'} has version {structure['version']}, expected {VERSION}")
        arrays = read_arrays(folder / "chain.npz")
        policies = load_policies(folder / "chain.safetensors", len(structure["skills"]))
        try:
            skills = tuple(
                Skill(policy, from_arrays(entry["activation"], arrays, f"activation{index}"),
                      from_arrays(entry["target"], arrays, f"target{index}"))
                for index, (policy, entry) in enumerate(zip(policies, structure["skills"], strict=True)))
            return cls(skills, arrays["start"], EnvSpec.from_dict(structure["environment"]), structure["time_limit"])
        except (KeyError, ValueError) as error:
            raise DamagedFile(f"{folder} holds a damaged skill chain: {error}") from error


class ChainController:
    """Which skill each execution is in, and what to do there."""

    def __init__(self, chain: SkillChain, model: ResettableModel, count: int):
        if not chain.skills:
            raise InvalidOption("the skill chain is empty")
        self.chain = chain
        self.model = model
        self.current = np.zeros(count, dtype=np.int64)

    def act(self, states: Array, members: IndexArray | None = None) -> Array:
        """Return controls [B, A] for the states [B, D] of the given executions (default: all, in order)."""
        members = np.arange(len(states)) if members is None else members
        current = self.current[members]
        for index in range(1, len(self.chain.skills)):
            behind = np.flatnonzero(current < index)
            if len(behind):
                entered = self.chain.skills[index].activation.contains(self.model, states[behind])
                current[behind[entered]] = index
        self.current[members] = current
        observations = self.model.observe(states)
        controls = np.empty((len(states), len(self.model.action_low)))
        for index in np.unique(current):
            mine = current == index
            controls[mine] = self.chain.skills[index].policy.act(observations[mine])
        return controls
