"""Executions of controllers that read the simulator's state, which no robot can."""

from collections.abc import Callable
from typing import Any, Protocol

import gymnasium
import numpy as np

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.options import check_range
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.judge import Controller, Judge
from pbcs_ompl.skills.evaluation import MOST_EPISODES, Evaluation


class MakeController(Protocol):
    """Makes a controller from what reads the state [D] of the environment that it drives."""

    def __call__(self, read_state: Callable[[], Array]) -> Controller: ...


@checked
def evaluate_privileged(make_controller: MakeController, env: EnvSpec, *, reset_seed: int | None, max_steps: int,
                        episodes: int = 100, epsilon: float = 0.0, seed: int = 0) -> Evaluation:
    """Let a controller that reads states drive an environment through `reset` and `step`, one episode at a time.

    The environment is another instance than the controller's simulator. Its limit of steps is `max_steps`.

    Args:
        make_controller: Called for each episode.
        env: The environment.
        reset_seed: Of the resets.
        max_steps: Steps after which an episode has failed.
        episodes: Number of executions.
        epsilon: Fraction of actions that are replaced by random ones.
        seed: Of the random actions.

    Raises:
        InvalidOption: no episodes, or an epsilon outside [0, 1].
    """
    check_range("episodes", episodes, 1 <= episodes <= MOST_EPISODES, f"from 1 to {MOST_EPISODES}")
    check_range("epsilon", epsilon, 0 <= epsilon <= 1, "within [0, 1]")
    driven = make(env).env
    judge = Judge(env, lambda: _LeftOpen(driven))

    def read_state() -> Array:
        return np.array(driven.get_env_state(), dtype=np.float64)

    seeds = SeedTree(seed).child("privileged")
    executions = [execution for index in range(episodes) for execution in judge.drive(
        make_controller(read_state), reset_seeds=[reset_seed], max_steps=max_steps, epsilon=epsilon,
        seed=seeds.child(index).integer())]
    return Evaluation.of(executions, epsilon)


class _LeftOpen(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment that is driven again after the judge has closed it."""

    def close(self) -> None:
        """Leave it open."""
