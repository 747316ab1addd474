"""How well a controller drives its environment: executions in fresh environments, by the judge."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, NotVerified
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.resettable.judge import Controller, Execution, Judge
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.resettable.task import Task, task_of
from pbcs_ompl.skills.trained_controller import TrainedController

EPISODE_STEPS = 1000
"""Length of an episode where neither the controller nor the environment has a limit."""
MOST_EPISODES = 1_000_000


@dataclass(frozen=True)
class Evaluation:
    """Executions of a controller in fresh environments.

    Attributes:
        success_rate: Fraction of the episodes in which the environment granted the goal.
        wilson: Its 95 % Wilson interval.
        episodes: Number of executions.
        steps_median: Median steps of the successful ones; None when there are none.
        epsilon: Fraction of random actions.
        endings: How many episodes ended for which reason: "goal", "terminated", "truncated", "time limit".

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0)
        >>> clean = pbcs_ompl.evaluate(result.chain, episodes=5)
        >>> clean.success_rate, clean.endings
        (1.0, {'goal': 5})
    """

    success_rate: float
    wilson: tuple[float, float]
    episodes: int
    steps_median: float | None
    epsilon: float
    endings: dict[str, int] = field(default_factory=dict)

    @classmethod
    def of(cls, executions: Sequence[Execution], epsilon: float) -> "Evaluation":
        """Return the numbers of some executions."""
        steps = [execution.steps for execution in executions if execution.success]
        count = len(executions)
        return cls(len(steps) / count, wilson(len(steps), count), count,
                   float(np.median(steps)) if steps else None, epsilon,
                   dict(sorted(Counter(execution.ending for execution in executions).items())))

    @property
    def successes(self) -> int:
        """Number of episodes that reached the goal."""
        return round(self.success_rate * self.episodes)

    def summary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"success_rate": self.success_rate, "wilson": list(self.wilson), "episodes": self.episodes,
                "steps_median": self.steps_median, "epsilon": self.epsilon, "endings": self.endings}


@checked
def evaluate(controller: TrainedController | Controller,
             env: str | EnvSpec | gymnasium.Env[Any, Any] | ResettableModel | None = None, *,
             env_kwargs: dict[str, Any] | None = None, goal: str | GoalRule | None = None,
             feature: str | FeatureRule | None = None, start_seed: int | None = None,
             reset_options: dict[str, Any] | None = None, max_episode_steps: int | None = None, episodes: int = 100,
             epsilon: float = 0.0, seed: int = 0) -> Evaluation:
    """Execute a controller in fresh environments, through `reset` and `step` alone.

    A chain starts where it was trained to. In an environment that draws a new start or goal at each reset, that is one
    of many: a chain is a controller for one task, robust to disturbances, not a solution of all tasks.

    Args:
        controller: A chain, such as `TrainResult.chain` or `SkillChain.load(folder)`; or any `Controller`, whose
            episodes have seeds of their own.
        env: A Gymnasium id, an `EnvSpec`, an environment, or its resettable model; None for the environment that the
            chain was trained in.
        env_kwargs: Options of the environment, when `env` is an id.
        goal, feature, start_seed, reset_options, max_episode_steps: See `pbcs_ompl.make`.
        episodes: Number of executions.
        epsilon: Fraction of actions that are replaced by random ones.
        seed: Of the random actions, and of the resets of a controller that is no chain.

    Raises:
        InvalidOption: `controller` is none, no episodes, an epsilon outside [0, 1], or options without `env`.
        Mismatch: the chain was trained in another environment.
        NotVerified: no fresh environment can be made, or none starts where the chain does.
        UnknownName, UnsupportedSpace: the environment does not exist, or does not fit.
        CallbackFailed: the environment raised.

    Example:
        >>> import pbcs_ompl
        >>> result = pbcs_ompl.train("pbcs/Maze-v0", seed=0)
        >>> pbcs_ompl.evaluate(result.chain, episodes=20, epsilon=0.1).episodes
        20
    """
    check_range("episodes", episodes, 1 <= episodes <= MOST_EPISODES, f"from 1 to {MOST_EPISODES}")
    check_range("epsilon", epsilon, 0 <= epsilon <= 1, "within [0, 1]")
    rules: dict[str, Any] = {"goal": goal, "feature": feature, "start_seed": start_seed,
                             "reset_options": reset_options, "max_episode_steps": max_episode_steps}
    if env is None and (env_kwargs or any(rule is not None for rule in rules.values())):
        raise InvalidOption("env is None; expected an environment beside env_kwargs, goal, feature, start_seed, "
                            "reset_options and max_episode_steps, or none of them, for the environment that the chain "
                            "was trained in")
    if isinstance(controller, TrainedController):
        task = task_of(controller.environment if env is None else env, env_kwargs, **rules)
        return evaluate_chain(controller, task, episodes=episodes, epsilon=epsilon, seed=seed)
    if not callable(getattr(controller, "act", None)) or not callable(getattr(controller, "reset", None)):
        raise InvalidOption(f"controller is {controller!r}; expected a SkillChain, such as train(...).chain or "
                            "SkillChain.load(folder), or an object with reset(count) and act(observations)")
    if env is None:
        raise InvalidOption("env is None; expected the environment that the controller is to drive")
    task = task_of(env, env_kwargs, **rules)
    seeds = SeedTree(seed).child("resets")
    executions = Judge(*task).drive(
        controller, reset_seeds=[seeds.child(str(k)).integer() for k in range(episodes)],
        max_steps=task.spec.max_episode_steps or EPISODE_STEPS, epsilon=epsilon, seed=seed)
    return Evaluation.of(executions, epsilon)


def evaluate_chain(chain: TrainedController, task: Task, *, episodes: int, epsilon: float, seed: int) -> Evaluation:
    """Return the numbers of `execute_chain`."""
    return Evaluation.of(execute_chain(chain, task, episodes=episodes, epsilon=epsilon, seed=seed), epsilon)


def execute_chain(chain: TrainedController, task: Task, *, episodes: int, epsilon: float,
                  seed: int) -> list[Execution]:
    """Execute a chain in fresh environments of a task; see `evaluate`.

    Args:
        chain: The chain.
        task: Where.
        episodes: Number of executions.
        epsilon: Fraction of actions that are replaced by random ones.
        seed: Of the random actions.

    Raises:
        Mismatch: the chain was trained in another environment.
        NotVerified: no fresh environment can be made, or none starts where the chain does.
        CallbackFailed: the environment raised.
    """
    chain.check_belongs_to(task.spec)
    judge = Judge(*task)
    if chain.reset_seed is None:
        raise NotVerified("not verified: the chain was trained from a state that no reset leads to")
    return judge.drive(chain.controller(), reset_seeds=[chain.reset_seed] * episodes, max_steps=chain.time_limit,
                       epsilon=epsilon, seed=seed)
