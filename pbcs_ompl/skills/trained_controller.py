"""What every result of a training has in common: a controller for one task, executed in the model or by the judge."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol, Self, TypedDict

import numpy as np

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.skills.chain_files import ChainContent, read_chain, write_chain
from pbcs_ompl.skills.episodes import with_random_actions


class StagedController(Protocol):
    """A controller of observations whose policies take over from each other."""

    @property
    def current(self) -> IndexArray:
        """The index of the policy that each episode is in [B]."""
        ...

    def reset(self, count: int | None = None) -> None:
        """Begin `count` episodes side by side; None for one, whose observations are vectors and not batches."""
        ...

    def act(self, observation: Array, members: IndexArray | None = None) -> Actions:
        """Return actions, members of the action space, for observations of some episodes."""
        ...


@dataclass(frozen=True)
class Rollouts:
    """What a batch of executions did.

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


class TaskValues(TypedDict):
    """The attributes of a `TrainedController` that its task gives."""

    start: Array
    environment: EnvSpec
    time_limit: int
    actions: ActionMap
    reset_seed: int | None


class TrainedController(ABC):
    """A controller with the task it was trained for.

    Attributes:
        kind: What its files say that they hold.
        start: The state it was trained to start from [D].
        environment: The environment it was trained in.
        time_limit: Steps after which an execution counts as failed.
        actions: The environment's action space.
        reset_seed: The seed of the reset that leads to the start; None where none is known to.
    """

    kind: ClassVar[str]
    start: Array
    environment: EnvSpec
    time_limit: int
    actions: ActionMap
    reset_seed: int | None

    @property
    @abstractmethod
    def circles(self) -> Sequence[tuple[Array, float]]:
        """Where its policies take over, for pictures: states [D] and radii."""

    @property
    @abstractmethod
    def num_policies(self) -> int:
        """Number of policies that act one after the other."""

    @abstractmethod
    def controller(self) -> StagedController:
        """Return the controller of observations, for one episode until its `reset` says otherwise."""

    @property
    @abstractmethod
    def content(self) -> ChainContent:
        """What its files hold beside the task."""

    @classmethod
    @abstractmethod
    def from_content(cls, content: ChainContent, task: "TaskValues") -> Self:
        """Return the controller of `content` for a task; a KeyError, ValueError, TypeError or IndexError is damage."""

    @checked
    def save(self, folder: str | Path) -> None:
        """Write chain.json (structure), chain.npz (arrays) and chain.safetensors (policies)."""
        structure, arrays, policies = self.content
        own = {"environment": self.environment.to_dict(), "time_limit": self.time_limit, "reset_seed": self.reset_seed,
               "action_shape": list(self.actions.shape)}
        ends = {"start": self.start, "first_action": self.actions.first, "last_action": self.actions.last}
        write_chain(Path(folder), self.kind, ChainContent(own | structure, ends | arrays, policies))

    @classmethod
    @checked
    def load(cls, folder: str | Path, *, trust: bool = False) -> Self:
        """Read what `save` wrote.

        Args:
            folder: The folder.
            trust: Let its environment be made where that imports a module which the folder names.

        Raises:
            DamagedFile: a file is missing, truncated, or of another version.
        """
        content = read_chain(Path(folder), cls.kind, trust=trust)
        structure, arrays = content.structure, content.arrays
        try:
            task = TaskValues(
                start=arrays["start"], environment=EnvSpec.from_dict(structure["environment"], trusted=trust),
                time_limit=structure["time_limit"], reset_seed=structure["reset_seed"],
                actions=ActionMap(arrays["first_action"], arrays["last_action"], tuple(structure["action_shape"])))
            return cls.from_content(content, task)
        except (KeyError, ValueError, TypeError, IndexError) as error:
            raise DamagedFile(f"{folder} holds a damaged {cls.kind}: {error}") from error

    def check_belongs_to(self, environment: EnvSpec) -> None:
        """Raise Mismatch when it was trained in another environment."""
        if not self.environment.same_as(environment):
            raise Mismatch(f"the controller was trained in {self.environment}, not in {environment}")

    def rollouts(self, model: ResettableModel, starts: Array, *, epsilon: float = 0.0,
                 rng: np.random.Generator | None = None, max_steps: int | None = None,
                 counter: Counter | None = None) -> Rollouts:
        """Execute from several states side by side, in the model and not in a fresh environment.

        This is for training and for pictures; `evaluate` measures success.

        Args:
            model: The environment.
            starts: States [B, D].
            epsilon: Fraction of actions that are replaced by random ones.
            rng: Source of random actions.
            max_steps: Time limit in steps; None for its own.
            counter: Counts every transition.

        Raises:
            BudgetUsedUp: in the middle of the executions.
        """
        rng, counter = rng or np.random.default_rng(0), counter or Counter()
        limit = self.time_limit if max_steps is None else max_steps
        controller = self.controller()
        controller.reset(len(starts))
        states, trace = starts.copy(), [starts[0].copy()]
        success = np.zeros(len(starts), dtype=bool)
        steps = np.full(len(starts), limit, dtype=np.int64)
        alive = np.arange(len(starts))
        for step in range(1, limit + 1):
            actions = controller.act(model.observe(states[alive]), alive)
            controls = with_random_actions(model, self.actions.to_controls(actions), epsilon, rng)
            counter.spend(len(alive))
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
            state: Where it starts [D]; None for where it was trained to.
            epsilon, rng, max_steps: See `rollouts`.
        """
        first = self.start if state is None else state
        return self.rollouts(model, first[None], epsilon=epsilon, rng=rng, max_steps=max_steps).states


def actions_of(model: ResettableModel) -> ActionMap:
    """Return the action space of a model."""
    if model.env is None:
        return ActionMap(model.action_low, model.action_high, model.action_low.shape)
    return ActionMap.of(model.env.action_space)
