"""A trajectory: the arrays of a path, which any environment of the same kind can replay bit for bit."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import DamagedFile, InvalidOption, Mismatch, MissingDependency
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.ompl_access import path_control, value_reader
from pbcs_ompl.core.plain import plain
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable import make
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.results.arrays import NUMBERS, take, take_words
from pbcs_ompl.results.files import read_arrays, write_arrays
from pbcs_ompl.results.provenance import environment_versions
from pbcs_ompl.results.schema import TrajectoryWords, Versioned

FORMAT = 3


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States visited by a sequence of actions.

    Attributes:
        environment: What makes the model that it was found in.
        states: States [T+1, D], the first is the start.
        actions: Actions as they are executed [T, ...], members of the action space in its type, one for each step.
        rewards: Rewards [T].
        planner, seed: Where the trajectory comes from.
        reset_seed: The seed of the reset that leads to the first state; None where it is not the state of a reset, and
            the trajectory cannot be executed in a fresh environment.
        versions: Versions of the packages the steps depend on.

    Example:
        >>> import pbcs_ompl
        >>> plan = pbcs_ompl.plan("pbcs/Maze-v0", seed=0).trajectory
        >>> len(plan.states) == len(plan.actions) + 1
        True
        >>> path = plan.save("plan.npz")
        >>> bool((pbcs_ompl.Trajectory.load("plan.npz").states == plan.states).all())
        True
    """

    environment: EnvSpec
    states: Array
    actions: Actions
    rewards: Array
    planner: str = ""
    seed: int = 0
    reset_seed: int | None = None
    versions: dict[str, str] = field(default_factory=environment_versions)

    @property
    def length(self) -> int:
        """The number of steps T."""
        return len(self.actions)

    @property
    def controls(self) -> Array:
        """The actions as controls [T, A] of the model and of OMPL."""
        size = int(np.prod(self.actions.shape[1:]))
        return np.array(self.actions, dtype=np.float64).reshape(self.length, size)

    @checked
    def save(self, path: str | Path) -> None:
        """Write one npz, atomically and without pickle; the words lie in it as a JSON string.

        Raises:
            RunFolderError: the file cannot be written.
        """
        words = {"format": FORMAT, "environment": self.environment.to_dict(),
                 "planner": self.planner, "seed": self.seed, "reset_seed": self.reset_seed, "versions": self.versions}
        write_arrays(Path(path), metadata=np.array(json.dumps(words, default=plain)), states=self.states,
                     actions=self.actions, rewards=self.rewards)

    @classmethod
    @checked
    def load(cls, path: str | Path, *, trust: bool = False) -> "Trajectory":
        """Read what `save` has written.

        Args:
            path: The file.
            trust: Let the environment be made from what the file says where that imports a module.

        Raises:
            DamagedFile: the file is missing, truncated, of another version, or not ours.
        """
        path = Path(path)
        arrays = read_arrays(path)
        missing = {"metadata", "states", "actions", "rewards"} - set(arrays)
        if missing:
            raise DamagedFile(f"{path} is not a trajectory: it lacks {', '.join(sorted(missing))}")
        version = take_words(path, arrays, "metadata", Versioned)["format"]
        if version != FORMAT:
            raise DamagedFile(f"{path} has format {version}, this version of pbcs_ompl reads format {FORMAT}: "
                              "plan again, or install the version that wrote it")
        words = take_words(path, arrays, "metadata", TrajectoryWords)
        unknown = words.keys() - TrajectoryWords.__annotations__.keys() - Versioned.__annotations__.keys()
        if unknown:
            raise DamagedFile(f"{path} is not a trajectory of this version: it has {', '.join(sorted(unknown))}")
        rewards = take(path, arrays, "rewards", (None,), kinds=NUMBERS, finite=False)
        states = take(path, arrays, "states", (len(rewards) + 1, None), finite=False)
        actions = take(path, arrays, "actions", (len(rewards), *arrays["actions"].shape[1:2]), kinds=NUMBERS,
                       finite=False)
        return cls(EnvSpec.from_dict(words["environment"], trusted=trust), states, actions, rewards, words["planner"],
                   words["seed"], words["reset_seed"], words["versions"])

    @classmethod
    @checked
    def from_arrays(cls, env: str | EnvSpec | gymnasium.Env[Any, Any] | ResettableModel, actions: Any, *,
                    reset_seed: int | None = None, first_state: Any = None, env_kwargs: dict[str, Any] | None = None,
                    goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None,
                    source: str = "demonstration") -> "Trajectory":
        """Return the trajectory of a demonstration: the states that its actions lead to, up to the first success.

        Args:
            env: The environment, in any form that `pbcs_ompl.make` takes.
            actions: What was done [T, ...], members of the action space.
            reset_seed: The seed of the reset that the demonstration began with.
            first_state: The state [D] that it began with, in place of a reset. A fresh environment cannot start there,
                so that nothing trained along it is called solved.
            env_kwargs, goal, feature: See `pbcs_ompl.make`.
            source: Its name, in place of a planner's.

        Raises:
            InvalidOption: neither or both of `reset_seed` and `first_state`, or actions of another shape.
            CallbackFailed: the environment raised.
        """
        model = make(env, env_kwargs, goal=goal, feature=feature)
        if (reset_seed is None) == (first_state is None) and model.spec.start_seed is None:
            raise InvalidOption("expected reset_seed, the seed of the reset that the demonstration began with, or "
                                "first_state, and not both")
        controls = _controls(actions, model)
        kept = controls if model.env is None else ActionMap.of(model.env.action_space).to_actions(controls)
        seed = None if first_state is not None else model.spec.reset_seed(reset_seed)
        state = model.initial_state(seed) if first_state is None else np.array(first_state, dtype=np.float64)
        states, rewards = [state], []
        for control in controls:
            outcome = model.transition(states[-1][None], control[None])
            states.append(outcome.states[0])
            rewards.append(float(outcome.rewards[0]))
            if outcome.success[0] or outcome.ended[0]:
                break
        return cls(model.spec, np.array(states), kept[:len(rewards)], np.array(rewards), source, 0, seed)

    @classmethod
    @checked
    def from_minari(cls, dataset: Any, episode: int = 0, *, env: str | EnvSpec | None = None,
                    goal: str | GoalRule | None = None, feature: str | FeatureRule | None = None) -> "Trajectory":
        """Return the trajectory of an episode of a Minari data set.

        The episode begins with the reset whose seed the data set has, and its actions have to lead to its observations.

        Args:
            dataset: A `minari.MinariDataset`, or its id.
            episode: Which one.
            env: The environment, where it is not the one that the data set names.
            goal, feature: See `pbcs_ompl.make`.

        Raises:
            MissingDependency: minari is not installed.
            Mismatch: the data set names no environment or no seed, or its actions lead elsewhere here.
        """
        try:
            import minari
        except ModuleNotFoundError as error:
            raise MissingDependency('data sets of Minari need minari: pip install "pbcs-ompl[minari]"') from error
        opened = minari.load_dataset(dataset) if isinstance(dataset, str) else dataset
        if env is None:
            if opened.env_spec is None:
                raise Mismatch("the data set names no environment; give env")
            env = EnvSpec(opened.env_spec.id, opened.env_spec.kwargs)
        (found,) = opened.iterate_episodes([episode])
        (words,) = opened.storage.get_episode_metadata([episode])
        seed = words.get("seed")
        if seed is None:
            raise Mismatch(f"episode {episode} has no seed, so its start is unknown; use Trajectory.from_arrays with "
                           "first_state")
        made = cls.from_arrays(env, found.actions, reset_seed=int(seed), goal=goal, feature=feature,
                               source=f"minari episode {episode}")
        made._check_observed(make(made.environment), found.observations)
        return made

    def _check_observed(self, model: ResettableModel, observations: Any) -> None:
        """Raise Mismatch unless the states of the trajectory show the observations of an episode, but for rounding."""
        expected = _rows_of(observations)[:self.length + 1]
        seen = model.observe(self.states)
        if seen.shape != expected.shape or not np.allclose(seen, expected, rtol=1e-5, atol=1e-6):
            wrong = "their shape" if seen.shape != expected.shape else (
                f"step {np.flatnonzero(~np.isclose(seen, expected, rtol=1e-5, atol=1e-6).all(axis=1))[0]}")
            raise Mismatch(f"the actions of the episode lead elsewhere in {self.environment}: observations differ in "
                           f"{wrong}; it was recorded with other versions, or in another environment")

    def replay(self, model: ResettableModel) -> Array:
        """Return the states [T+1, D] that the actions lead to.

        From a reset, where there is one: step by step in the model's environment, without restoring a state. Else from
        the first state, by transitions.
        """
        if self.reset_seed is None or model.env is None:
            return self._replay_from_first(model)
        states = [model.initial_state(self.reset_seed)]
        for action in self.actions:
            model.env.step(np.array(action)[()])
            states.append(np.array(model.env.get_env_state(), dtype=np.float64))
        return np.array(states)

    def _replay_from_first(self, model: ResettableModel) -> Array:
        states = [self.states[0]]
        for control in self.controls:
            states.append(model.transition(states[-1][None], control[None]).states[0])
        return np.array(states)

    def first_difference(self, model: ResettableModel) -> int | None:
        """Return the first step whose state a replay does not give bit for bit, 0 for the start; None if all are equal.

        Args:
            model: An environment of the same kind, which is moved.
        """
        replayed = self.replay(model)
        if replayed.shape != self.states.shape:
            return 0
        unequal = [one.tobytes() != other.tobytes() for one, other in zip(replayed, self.states, strict=True)]
        return unequal.index(True) if any(unequal) else None

    def replays_exactly(self, model: ResettableModel) -> bool:
        """Return whether a replay gives the same states, bit for bit."""
        return self.first_difference(model) is None

    def check_belongs_to(self, model: ResettableModel) -> None:
        """Refuse a model that the trajectory was not made in.

        Raises:
            Mismatch: another environment, other options, or other versions of what its steps depend on.
        """
        if not self.environment.same_as(model.spec):
            raise Mismatch(f"the trajectory was made in {self.environment}, not in {model.spec}")
        installed = environment_versions()
        for package, version in self.versions.items():
            if installed.get(package) != version:
                raise Mismatch(f"the trajectory was made with {package} {version}, installed is "
                               f"{installed.get(package, 'none')}; plan again, or install that version")


def _controls(actions: Any, model: ResettableModel) -> Array:
    """Return actions as controls [T, A].

    Raises:
        InvalidOption: they are of another shape, or not finite.
    """
    controls = np.array(actions, dtype=np.float64)
    size = len(model.action_low)
    if controls.ndim < 1 or controls.size != len(controls) * size or not np.isfinite(controls).all():
        raise InvalidOption(f"actions of the shape {controls.shape}; expected finite ones [T, {size}]")
    return controls.reshape(len(controls), size)


def _rows_of(observations: Any) -> Array:
    """Return the observations of an episode as vectors [T+1, O]; parts of dictionaries follow each other by name."""
    if isinstance(observations, dict):
        return np.concatenate([_rows_of(observations[name]) for name in sorted(observations)], axis=1)
    if isinstance(observations, tuple):
        return np.concatenate([_rows_of(part) for part in observations], axis=1)
    return np.array(observations, dtype=np.float64).reshape(len(observations), -1)


def to_trajectory(path: Any, space_information: Any, model: ResettableModel, *, planner: str = "",
                  seed: int = 0, reset_seed: int | None = None) -> Trajectory:
    """Return the trajectory of a PathControl.

    A control that lasts k steps becomes k actions, and the states in between come from stepping the model.
    The path's own states are kept as they are, true or not: `Trajectory.replays_exactly` tests them.

    Args:
        path: An `ompl.control.PathControl` of the model's problem.
        space_information: That problem's `ompl.control.SpaceInformation`.
        model: The environment.
        planner, seed, reset_seed: Kept in the trajectory.

    Raises:
        Mismatch: a control lasts something else than a positive number of whole steps.
    """
    read = value_reader(space_information.getStateSpace())
    read_control = value_reader(space_information.getControlSpace())
    step_size = space_information.getPropagationStepSize()
    steps = np.array([_whole_steps(path.getControlDuration(index), step_size)
                      for index in range(path.getControlCount())], dtype=np.int64)
    ends = np.array([read(path.getState(index)) for index in range(len(steps) + 1)])
    held = np.array([read_control(path.getControl(index)) for index in range(len(steps))])
    held = held.reshape(len(steps), len(model.action_low))
    states, controls = _every_state(model, ends, held, steps), np.repeat(held, steps, axis=0)
    rewards = model.transition(states[:-1], controls).rewards if len(steps) else np.empty(0)
    return from_controls(model, states, controls, rewards, planner=planner, seed=seed, reset_seed=reset_seed)


def trajectory_of(tree: Tree, nodes: IndexArray, model: ResettableModel, *, planner: str = "", seed: int = 0,
                  reset_seed: int | None = None) -> Trajectory:
    """Return the trajectory through nodes of a tree whose every edge is one step.

    It is that of the PathControl through the same nodes, which takes ten times as long to read.

    Args:
        tree: A tree with controls.
        nodes: From a root to a leaf [T+1], each the parent of the next.
        model: The environment.
        planner, seed, reset_seed: Kept in the trajectory.
    """
    return from_controls(model, tree.states[nodes], tree.controls[nodes[1:]], tree.rewards[nodes[1:]], planner=planner,
                         seed=seed, reset_seed=reset_seed)


def from_controls(model: ResettableModel, states: Array, controls: Array, rewards: Array, *, planner: str = "",
                  seed: int = 0, reset_seed: int | None = None) -> Trajectory:
    """Return the trajectory of a model along states [T+1, D] under controls [T, A], as they are, true or not.

    Args:
        model: The environment.
        states, controls: The states [T+1, D], the first is the start, and the controls between them [T, A].
        rewards: The rewards [T].
        planner, seed, reset_seed: Kept in the trajectory.
    """
    actions = controls if model.env is None else ActionMap.of(model.env.action_space).to_actions(controls)
    return Trajectory(environment=model.spec, states=states, actions=actions,
                      rewards=np.asarray(rewards, dtype=np.float64), planner=planner, seed=seed, reset_seed=reset_seed)


def _every_state(model: ResettableModel, ends: Array, controls: Array, steps: IndexArray) -> Array:
    """Return the states at every step: those where controls end [T+1, D], and between them what the model says."""
    places = np.concatenate([[0], np.cumsum(steps)])
    states = np.empty((places[-1] + 1, ends.shape[1]))
    states[places] = ends
    for taken in range(1, int(steps.max(initial=1))):
        going = np.flatnonzero(steps > taken)
        before = places[going] + taken - 1
        states[before + 1] = model.transition(states[before], controls[going]).states
    return states


def to_path(trajectory: Trajectory, space_information: Any) -> Any:
    """Return the PathControl of a trajectory, with one control for each step."""
    return path_control(space_information, trajectory.states, trajectory.controls)


def _whole_steps(duration: float, step_size: float) -> int:
    steps = round(duration / step_size)
    if steps < 1 or abs(duration - steps * step_size) > 1e-9 * step_size:
        raise Mismatch(f"a control of the path lasts {duration}; expected a multiple of {step_size}")
    return steps
