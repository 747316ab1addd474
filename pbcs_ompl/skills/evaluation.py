"""How well a skill chain drives its environment."""

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.skills.chain import SkillChain

MOST_EPISODES = 1_000_000


@dataclass(frozen=True)
class Evaluation:
    """Executions of a chain from its start.

    Attributes:
        success_rate: Fraction of the episodes that reached the goal.
        wilson: Its 95 % Wilson interval.
        episodes: Number of executions.
        steps_median: Median steps of the successful ones; None when there are none.
        epsilon: Fraction of random actions.
    """

    success_rate: float
    wilson: tuple[float, float]
    episodes: int
    steps_median: float | None
    epsilon: float

    @property
    def successes(self) -> int:
        """Number of episodes that reached the goal."""
        return round(self.success_rate * self.episodes)

    def summary(self) -> dict[str, Any]:
        """Return plain values."""
        return {"success_rate": self.success_rate, "wilson": list(self.wilson), "episodes": self.episodes,
                "steps_median": self.steps_median, "epsilon": self.epsilon}


@checked
def evaluate(controller: SkillChain, env: str | EnvSpec | gymnasium.Env | ResettableModel | None = None, *,
             env_kwargs: dict[str, Any] | None = None, goal: str | GoalRule | None = None,
             feature: str | FeatureRule | None = None, start_seed: int | None = None, episodes: int = 100,
             epsilon: float = 0.0, seed: int = 0) -> Evaluation:
    """Execute a skill chain from the state it was trained to start from.

    In an environment that draws a new start or goal at each reset, that is one of many: a chain is a controller for
    one task, robust to disturbances, not a solution of all tasks.

    Args:
        controller: The chain, such as `TrainResult.chain` or `SkillChain.load(folder)`.
        env: A Gymnasium id, an `EnvSpec`, an environment, or its resettable model; None for the environment that the
            chain was trained in.
        env_kwargs: Options of the environment, when `env` is an id.
        goal, feature, start_seed: See `pbcs_ompl.make`.
        episodes: Number of executions.
        epsilon: Fraction of actions that are replaced by random ones.
        seed: Of the random actions.

    Raises:
        InvalidOption: `controller` is not a chain, no episodes, an epsilon outside [0, 1], or options without `env`.
        Mismatch: the chain was trained in another environment.
        UnknownName, NotResettable, UnsupportedSpace: the environment does not exist, or does not fit.
    """
    if not isinstance(controller, SkillChain):
        raise InvalidOption(f"controller is {controller!r}; expected a SkillChain, such as train(...).chain or "
                            "SkillChain.load(folder)")
    check_range("episodes", episodes, 1 <= episodes <= MOST_EPISODES, f"from 1 to {MOST_EPISODES}")
    check_range("epsilon", epsilon, 0 <= epsilon <= 1, "within [0, 1]")
    if env is None and (env_kwargs or goal is not None or feature is not None or start_seed is not None):
        raise InvalidOption("env is None; expected an environment beside env_kwargs, goal, feature and start_seed, "
                            "or none of them, for the environment that the chain was trained in")
    model = make(controller.environment if env is None else env, env_kwargs, goal=goal, feature=feature,
                 start_seed=start_seed)
    controller.check_belongs_to(model)
    starts = np.repeat(controller.start[None], episodes, axis=0)
    rollouts = controller.rollouts(model, starts, epsilon=epsilon, rng=SeedTree(seed).child("evaluation").generator())
    successes = int(rollouts.success.sum())
    steps = float(np.median(rollouts.steps[rollouts.success])) if successes else None
    return Evaluation(successes / episodes, wilson(successes, episodes), episodes, steps, epsilon)
