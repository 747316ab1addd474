"""The judge: executes actions and controllers in fresh environments, through Gymnasium's `reset` and `step` alone.

Everything that is called solved, and every success rate, comes from here. The resettable model, in which planners
search and agents train, has no part in it.
"""

import math
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import gymnasium
import numpy as np

from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import NotVerified
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.fresh import EnvMaker, close
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.rules import GoalRule, Outcome, goal_rule, granted_success
from pbcs_ompl.resettable.task_env import explored_actions

SIDE_BY_SIDE = 20
"""Episodes that a controller drives at the same time, each in an environment of its own; the next ones begin in these
environments with a reset. To make an environment takes MuJoCo longer than an episode."""
Ending = Literal["goal", "terminated", "truncated", "end of the actions", "time limit"]


class Controller(Protocol):
    """What drives an environment by its observations alone."""

    def reset(self, count: int | None = None) -> None:
        """Begin `count` episodes side by side; None for one, whose observations are vectors and not batches."""
        ...

    def act(self, observation: Any) -> Any:
        """Return actions [B, ...], members of the action space, for observations [B, O]; of one episode one for [O]."""
        ...


@dataclass(frozen=True)
class Execution:
    """One episode in a fresh environment.

    Attributes:
        success: Whether the environment granted the goal, in the reset or in a step before the episode was over.
        steps: How many steps were made.
        ending: Why the episode ended.
        rewards: The rewards [T].
        observations: The observations as vectors [T+1, O]; None where they were not asked for.
    """

    success: bool
    steps: int
    ending: Ending
    rewards: Array
    observations: Array | None = None


class Judge:
    """Executes in environments of one task.

    Args:
        spec: The task: its goal, its start seed and the options of its resets.
        make_env: Makes fresh environments; None where that is not possible.

    Raises:
        NotVerified: it is not possible.
        UntrustedModule: the goal was read from a file, and names a module.
    """

    def __init__(self, spec: EnvSpec, make_env: EnvMaker | None):
        if make_env is None:
            raise NotVerified(f"not verified: no fresh environment of {spec.id} can be made; register it with "
                              f"Gymnasium, or make it possible to copy it (copy.deepcopy)")
        spec.check_trusted(known=[spec.id])  # making an environment checks its id
        self._spec, self._make_env = spec, make_env
        self._rule: GoalRule = granted_success if spec.goal is None else goal_rule(spec.goal)

    @classmethod
    def of(cls, model: ResettableModel) -> "Judge":
        """Return the judge of a model's task.

        Raises:
            NotVerified: no fresh environment of it can be made.
        """
        return cls(model.spec, model.make_env)

    def execute(self, actions: Sequence[Any] | np.ndarray, reset_seed: int | None) -> Execution:
        """Execute actions [T, ...], members of the action space, in a fresh environment.

        Args:
            actions: One for each step.
            reset_seed: The seed of the reset; that of the task, where it has one, comes first.

        Raises:
            CallbackFailed: the environment raised.
        """
        episode = _Episode(self._make_env(), self._spec, self._rule, reset_seed)
        own = np.array(actions)  # whose rows the environment may change
        try:
            with code_of_others("the environment"):
                for action in own:
                    if episode.ending is not None:
                        break
                    episode.advance(action)
        finally:
            close(episode.env)
        return episode.execution("end of the actions", observed=True)

    def drive(self, controller: Controller, *, reset_seeds: Sequence[int | None], max_steps: int,
              epsilon: float = 0.0, seed: int = 0) -> list[Execution]:
        """Let a controller of observations drive episodes.

        Args:
            controller: Gets the observations as vectors.
            reset_seeds: The seed of the reset of each episode; that of the task, where it has one, comes first.
            max_steps: Steps after which an episode has failed, beside the limits of the environment itself.
            epsilon: Fraction of actions that are replaced by random ones.
            seed: Of these.

        Raises:
            CallbackFailed: the environment raised.
        """
        seeds = SeedTree(seed).child("evaluation")
        results: list[Execution] = []
        envs: list[gymnasium.Env[Any, Any]] = []
        try:
            while len(results) < len(reset_seeds):
                first = len(results)
                chosen = reset_seeds[first:first + SIDE_BY_SIDE]
                envs += [self._make_env() for _ in range(len(chosen) - len(envs))]
                begun = [_Episode(env, self._spec, self._rule, reset_seed)
                         for env, reset_seed in zip(envs, chosen, strict=False)]
                noise = [seeds.child(str(first + k)).generator() for k in range(len(chosen))]
                results += _drive(controller, begun, noise, epsilon, max_steps)
        finally:
            for env in envs:
                close(env)
        return results


class _Episode:
    """An episode in progress: the last outcome, and what has been seen so far."""

    def __init__(self, env: gymnasium.Env[Any, Any], spec: EnvSpec, rule: GoalRule, reset_seed: int | None):
        self.env, self._rule = env, rule
        self.ending: Ending | None = None
        self._rewards: list[float] = []
        with code_of_others("the environment"):
            observation, info = env.reset(seed=spec.reset_seed(reset_seed), options=deepcopy(spec.reset_options))
            self._bare = env.unwrapped
            outcome = Outcome(self._bare, observation, math.nan, False, info)
            if rule(outcome):
                self.ending = "goal"
            self._observations = [flat(observation)]

    @property
    def observation(self) -> Array:
        """The last observation [O]."""
        return self._observations[-1]

    def step(self, action: Any) -> None:
        """Make one step with a copy of an action."""
        with code_of_others("the environment"):
            self.advance(np.array(action)[()])

    def advance(self, action: Any) -> None:
        """Make one step with an action, which the environment may change; what it raises passes."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        gained = float(reward)
        success = self._rule(Outcome(self._bare, observation, gained, bool(terminated), info))
        self._rewards.append(gained)
        self._observations.append(flat(observation))
        if success:
            self.ending = "goal"
        elif terminated or truncated:
            self.ending = "terminated" if terminated else "truncated"

    def execution(self, otherwise: Ending, *, observed: bool = False) -> Execution:
        """Return what happened; the episode ended for the reason `otherwise` if for none of its own."""
        return Execution(self.ending == "goal", len(self._rewards), self.ending or otherwise,
                         np.array(self._rewards), np.array(self._observations) if observed else None)


def _drive(controller: Controller, episodes: list[_Episode], noise: list[np.random.Generator], epsilon: float,
           max_steps: int) -> list[Execution]:
    """Let a controller drive episodes side by side until all have ended."""
    actions = ActionMap.of(explored_actions(episodes[0].env))
    controller.reset(len(episodes))
    observations = np.array([episode.observation for episode in episodes])
    going = list(range(len(episodes)))
    for _ in range(max_steps):
        going = [k for k in going if episodes[k].ending is None]
        if not going:
            break
        chosen = controller.act(observations.copy())
        for k in going:
            by_chance = epsilon > 0 and noise[k].random() < epsilon
            episodes[k].step(actions.draw(noise[k]) if by_chance else chosen[k])
            observations[k] = episodes[k].observation
    return [episode.execution("time limit") for episode in episodes]
