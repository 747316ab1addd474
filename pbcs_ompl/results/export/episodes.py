"""Episodes as data sets hold them: what a fresh environment returned, and the simulator's whole state beside it."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.bridge.trajectory import Trajectory
from pbcs_ompl.core.callbacks import code_of_others
from pbcs_ompl.core.errors import Mismatch, NotVerified
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.resettable.actions import ActionMap, Actions, copied
from pbcs_ompl.resettable.fresh import close
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.rules import GoalRule, Outcome, goal_rule, granted_success
from pbcs_ompl.resettable.task_env import explored_actions
from pbcs_ompl.skills.trained_controller import TrainedController

LONGEST_EDGE = 100
"""Steps after which an edge of a tree counts as one that cannot be repeated."""


@dataclass(frozen=True, eq=False)
class Episode:
    """One episode in a fresh environment.

    Attributes:
        source: "plan", "tree" or "controller".
        reset_seed: The seed of its reset.
        observations: As the environment returned them, T+1.
        states: Those of the simulator [T+1, D]; a model of the same environment restores them.
        actions: Members of the action space [T, ...].
        rewards: [T].
        terminated, truncated: Whether the environment ended the episode in a step [T].
        success: Whether the goal was granted in the reset, or in a step [T+1].
    """

    source: str
    reset_seed: int | None
    observations: list[Any]
    states: Array
    actions: Actions
    rewards: Array
    terminated: BoolArray
    truncated: BoolArray
    success: BoolArray

    @property
    def length(self) -> int:
        """Number of steps T."""
        return len(self.rewards)

    @property
    def vectors(self) -> Array:
        """The observations as vectors [T+1, O]."""
        return np.array([flat(observation) for observation in self.observations])


class Recorder:
    """Makes episodes in fresh environments of a task; the model makes the same steps, and knows their states.

    Args:
        model: The task.

    Raises:
        NotVerified: no fresh environment can be made.
    """

    def __init__(self, model: ResettableModel):
        if model.make_env is None or model.env is None:
            raise NotVerified(f"no fresh environment of {model.spec.id} can be made, so nothing can be recorded")
        self.model = model
        self.env: gymnasium.Env[Any, Any] = model.make_env()
        self._rule: GoalRule = granted_success if model.spec.goal is None else goal_rule(model.spec.goal)

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_: object) -> None:
        close(self.env)

    def record(self, source: str, choose: Callable[[Array, int], Any], reset_seed: int | None,
               max_steps: int) -> Episode:
        """Return an episode that ends with the goal, when the environment ends it, or after `max_steps`.

        Args:
            source: What chooses.
            choose: The action for an observation as a vector [O] and the number of the step.
            reset_seed: Of the reset; that of the task, where it has one, comes first.
            max_steps: See above.

        Raises:
            Mismatch: the model and the fresh environment do not agree.
            CallbackFailed: the environment raised.
        """
        seed, model = self.model.spec.reset_seed(reset_seed), self.model
        states = [model.initial_state(reset_seed)]
        with code_of_others("the environment"):
            observation, info = self.env.reset(seed=seed, options=model.spec.reset_options)
            observations, actions = [observation], []
            steps: list[tuple[float, bool, bool]] = []
            success = [self._rule(Outcome(self.env.unwrapped, observation, math.nan, False, info))]
            while not success[-1] and len(steps) < max_steps and not (steps and (steps[-1][1] or steps[-1][2])):
                actions.append(copied(choose(flat(observation), len(steps))))
                observation, reward, terminated, truncated, info = self.env.step(copied(actions[-1]))
                success.append(self._rule(Outcome(self.env.unwrapped, observation, float(reward), bool(terminated),
                                                  info)))
                seen = model.env.step(copied(actions[-1]))[0]
                if not np.array_equal(flat(seen), flat(observation), equal_nan=True):
                    raise Mismatch(f"step {len(steps) + 1}: the model observes {flat(seen)}, a fresh environment "
                                   f"{flat(observation)}; run pbcs doctor --env {model.spec.id}")
                states.append(np.array(model.env.get_env_state(), dtype=np.float64))
                observations.append(observation)
                steps.append((float(reward), bool(terminated), bool(truncated)))
        kind = ActionMap.of(explored_actions(self.env))
        flags = np.array([step[1:] for step in steps], dtype=np.bool_).reshape(-1, 2)
        return Episode(source, seed, observations, np.array(states),
                       np.array(actions, kind.first.dtype).reshape(len(actions), *kind.shape),
                       np.array([step[0] for step in steps]), flags[:, 0], flags[:, 1], np.array(success, np.bool_))


def planned_episode(recorder: Recorder, trajectory: Trajectory) -> Episode:
    """Return the episode of a plan."""
    return recorder.record("plan", _sequence(trajectory.actions), trajectory.reset_seed, trajectory.length)


def _sequence(actions: Actions) -> Callable[[Array, int], Any]:
    """Return what chooses one action after the other."""
    return lambda _, step: actions[step]


def driven_episodes(recorder: Recorder, chain: TrainedController, *, count: int, epsilon: float,
                    seed: int) -> Iterator[Episode]:
    """Yield episodes that a controller drives from where it was trained to start.

    Args:
        recorder: Of its task.
        chain: The controller.
        count: How many.
        epsilon: Fraction of actions that are replaced by random ones.
        seed: Of these.
    """
    controller, kind = chain.controller(), ActionMap.of(explored_actions(recorder.env))
    for index in range(count):
        rng = SeedTree(seed).child("export").child(str(index)).generator()
        controller.reset()

        def choose(observation: Array, _: int, rng: np.random.Generator = rng) -> Any:
            action = controller.act(observation)
            return kind.draw(rng) if epsilon > 0 and rng.random() < epsilon else action

        yield recorder.record("controller", choose, chain.reset_seed, chain.time_limit)


def tree_episodes(recorder: Recorder, tree: Tree, reset_seed: int | None, count: int) -> Iterator[Episode]:
    """Yield the paths of a tree that end nearest to the goal, each at a leaf of its own.

    Args:
        recorder: Of the task.
        tree: What a planner has grown from the state after a reset; without controls, nothing is yielded.
        reset_seed: The seed of that reset.
        count: The most paths.
    """
    model = recorder.model
    if not tree.has_controls or not len(tree) or not np.array_equal(tree.states[0], model.initial_state(reset_seed)):
        return
    kind, used = ActionMap.of(explored_actions(recorder.env)), np.zeros(len(tree), dtype=bool)
    for node in np.argsort(model.goal_distance(tree.states), kind="stable"):
        if count <= 0:
            return
        if used[node]:
            continue
        path = tree.path_to(int(node))
        used[path] = True
        controls = _controls_along(model, tree, path)
        if controls is not None and len(controls):
            count -= 1
            yield recorder.record("tree", _sequence(kind.to_actions(controls)), reset_seed, len(controls))


def _controls_along(model: ResettableModel, tree: Tree, path: IndexArray) -> Array | None:
    """Return the controls [T, A] of all steps of a path; None where an edge leads elsewhere than to its node."""
    controls: list[Array] = []
    for before, after in pairwise(path):
        state, control, steps = tree.states[before][None], tree.controls[after][None], 0
        while steps == 0 or not np.array_equal(state[0], tree.states[after]):
            if steps == LONGEST_EDGE:
                return None
            state = model.transition(state, control).states
            controls.append(control[0])
            steps += 1
    return np.array(controls).reshape(-1, tree.controls.shape[1])


def stacked(observations: Sequence[Any]) -> Any:
    """Return observations as one array, or as a dictionary or a tuple of arrays, with the steps first."""
    first = observations[0]
    if isinstance(first, dict):
        return {name: stacked([one[name] for one in observations]) for name in first}
    if isinstance(first, tuple):
        return tuple(stacked([one[index] for one in observations]) for index in range(len(first)))
    return np.array(observations)
