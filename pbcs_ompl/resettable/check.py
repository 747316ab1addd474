"""Is an environment resettable? A companion of Gymnasium's `check_env`."""

import warnings
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.callbacks import describe
from pbcs_ompl.core.checked import checked
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import InvalidOption, MissingDependency, PbcsError, UnknownName
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap
from pbcs_ompl.resettable.adapt import adapt
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.success_flag import SuccessFlagEnv
from pbcs_ompl.resettable.attributes import misspelt
from pbcs_ompl.resettable.branching import LONG, first_difference
from pbcs_ompl.resettable.make import make
from pbcs_ompl.resettable.rewards import same_rewards
from pbcs_ompl.resettable.rules import FeatureRule, GoalRule
from pbcs_ompl.resettable.supported import task_maker

STEPS = 30


@dataclass(frozen=True)
class Check:
    """The outcome of one check: what was tested, whether it held, and if not, what was found."""

    name: str
    ok: bool
    detail: str = ""

    def __str__(self) -> str:
        return f"  {'ok  ' if self.ok else 'FAIL'}  {self.name}{': ' if self.detail else ''}{self.detail}"


@dataclass(frozen=True)
class ResetReport:
    """The outcome of `check_resettable`.

    Example:
        >>> import pbcs_ompl
        >>> report = pbcs_ompl.check_resettable("pbcs/Toy1D-v0")
        >>> report.ok
        True
    """

    env_id: str
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether every check held."""
        return all(check.ok for check in self.checks)

    def __str__(self) -> str:
        verdict = "is resettable" if self.ok else "is not resettable"
        return "\n".join([f"{self.env_id}: {verdict}", *map(str, self.checks)])


@dataclass(frozen=True)
class _Roll:
    """States, observations, rewards and ends of a few steps, to be compared bit for bit (rewards: `same_rewards`)."""

    states: Array
    observations: Array
    rewards: Array
    terminated: Array

    def difference(self, other: "_Roll") -> str:
        """Return what differs first, or an empty string."""
        for name, mine in vars(self).items():
            theirs = vars(other)[name]
            if mine.shape != theirs.shape:
                return f"{name}: {len(mine)} steps against {len(theirs)}"
            if not _same(name, mine, theirs):
                gap = np.nanmax(np.abs(mine.astype(np.float64) - theirs.astype(np.float64)))
                return f"{name} differ by up to {gap:.3g}"
        return ""


@checked
def check_resettable(env: str | EnvSpec | gymnasium.Env | ResettableModel, *,
                     env_kwargs: dict[str, Any] | None = None, goal: str | GoalRule | None = None,
                     feature: str | FeatureRule | None = None, start_seed: int | None = None,
                     reset_options: dict[str, Any] | None = None, seed: int = 0,
                     on_check: Callable[[str], None] | None = None) -> ResetReport:
    """Check that an environment continues from a restored state as it did before, bit for bit.

    What is wrong with an environment is in the report; what is wrong with the arguments is raised.

    Args:
        env, env_kwargs, goal, feature, start_seed, reset_options: See `pbcs_ompl.make`. An environment that is given is
            moved about.
        seed: Seed of the actions and states that are tried.
        on_check: Gets the name of each check before it runs.

    Raises:
        UnknownName, InvalidOption, MissingDependency: see `pbcs_ompl.make`.

    Example:
        >>> import pbcs_ompl
        >>> report = pbcs_ompl.check_resettable("pbcs/Toy1D-v0")
        >>> [check.name for check in report.checks if not check.ok]
        []
    """
    name = env if isinstance(env, str) else type(env).__name__
    try:
        model = make(env, env_kwargs, goal=goal, feature=feature, start_seed=start_seed, reset_options=reset_options)
    except (UnknownName, InvalidOption, MissingDependency):
        raise
    except Exception as error:  # an author's mistake is a finding, not a crash
        if not isinstance(env, str | EnvSpec | gymnasium.Env):
            raise
        found = str(error) if isinstance(error, PbcsError) else describe(error)
        return ResetReport(name, (Check("has an adapter", False, found),))
    try:
        trial = _Trial(model, seed)
    except Exception as error:  # as above
        return ResetReport(model.spec.id, (Check("can be stepped", False, describe(error)),))
    tests = [
        ("a restored state continues as before", trial.restored),
        ("the same after other steps and another reset", trial.disturbed),
        ("the same in a second instance", trial.elsewhere),
        ("branches continue as in fresh instances", trial.branches),
        ("returned arrays are copies", trial.copies),
        ("optional attributes have the names that are read", trial.spelling),
        ("transition equals step", trial.transition_is_step),
        ("a batch equals a loop", trial.batch_is_loop),
        ("step_one equals transition", trial.step_one_is_transition),
    ]
    if "arbitrary" in model.capabilities:
        tests.append(("valid states within the bounds come back as set", trial.arbitrary))
    return ResetReport(model.spec.id, tuple(_run(name, test, on_check) for name, test in tests))


def _run(name: str, test: Callable[[], str], on_check: Callable[[str], None] | None) -> Check:
    if on_check is not None:
        on_check(name)
    try:
        found = test()
    except Exception as error:  # an author's mistake is a finding, not a crash
        found = describe(error)
    return Check(name, not found, found)


class _Trial:
    """The checks on one model; each returns what it found wrong, or an empty string."""

    def __init__(self, model: Any, seed: int):
        self.model, self.seed = model, seed
        self.env: Any = model.env
        self.actions = ActionMap.of(model.env.action_space)
        rng = np.random.default_rng(seed)
        self.start = model.initial_state(seed)
        self.controls = rng.uniform(model.action_low, model.action_high, (STEPS, len(model.action_low)))
        self.candidates = rng.uniform(model.state_low, model.state_high, (STEPS, len(model.state_low)))
        if isinstance(model.env, SuccessFlagEnv):
            self.candidates[:, -1] = 0.0
        self.first = self.roll(self.env, self.start)

    def roll(self, env: Any, state: Array) -> _Roll:
        """Restore `state` in `env` and step until the controls or the episode end."""
        env.set_env_state(state.copy())
        rows = []
        for action in self.actions.to_actions(self.controls):
            observation, reward, terminated, truncated, _ = env.step(action)
            rows.append((np.array(env.get_env_state()), np.array(observation), reward, terminated))
            if terminated or truncated:
                break
        return _Roll(*(np.array(column) for column in zip(*rows, strict=True)))

    def restored(self) -> str:
        return self.first.difference(self.roll(self.env, self.start))

    def disturbed(self) -> str:
        self.env.reset(seed=12345, options=self.model.spec.reset_options)
        for action in self.actions.to_actions(self.controls[::-1]):
            _, _, terminated, truncated, _ = self.env.step(action)
            if terminated or truncated:
                break
        return self.first.difference(self.roll(self.env, self.start))

    def elsewhere(self) -> str:
        other = self._second()
        other.reset(seed=54321, options=self.model.spec.reset_options)
        found = self.first.difference(self.roll(other, self.start))
        other.close()
        return found

    def _second(self) -> Any:
        if self.model.make_env is None:
            return deepcopy(self.env)
        spec = self.model.spec
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the first instance has warned
            return adapt(self.model.make_env(), goal=spec.goal, feature=spec.feature,
                         reset_options=spec.reset_options).env

    def branches(self) -> str:
        make_inner = task_maker(self.model.make_env, self.model.spec.reset_options)
        if make_inner is None:
            return ""
        return first_difference(self.env, make_inner, steps=LONG, seed=self.seed + 1)

    def spelling(self) -> str:
        return "; ".join(f"{name!r} is not read; did you mean {meant!r}?"
                         for name, meant in misspelt(_inner(self.env)).items())

    def copies(self) -> str:
        if isinstance(self.env, SuccessFlagEnv):
            return _copies(self.env.inner, self.start[:-1]) or self._transition_copies()
        return _copies(self.env, self.start) or self._transition_copies()

    def _transition_copies(self) -> str:
        before = self.model.transition(self.start[None], self.controls[:1]).states
        kept = before.copy()
        self.model.transition(self.first.states[:1], self.controls[:1])
        return "" if np.array_equal(before, kept) else "transition returns an array that it uses again"

    def _batch(self) -> tuple[Array, Array]:
        states = np.concatenate([self.start[None], self.first.states[:-1]])
        return states, self.controls[: len(states)]

    def transition_is_step(self) -> str:
        after, rewards, terminated, success, _ = self.model.transition(*self._batch())
        found = _Roll(after, self.first.observations, rewards, terminated).difference(self.first)
        if found:
            return found
        near = self.model.goal_distance(after) < self.model.goal_threshold
        return "" if np.array_equal(near, success) else "success is not goal_distance < goal_threshold"

    def batch_is_loop(self) -> str:
        states, controls = self._batch()
        batch = self.model.transition(states, controls)
        parts = [self.model.transition(states[k : k + 1], controls[k : k + 1]) for k in range(len(states))]
        for name, whole, pieces in zip(batch._fields, batch, zip(*parts, strict=True), strict=True):
            if whole is not None and not _same(name, whole, np.concatenate(pieces)):
                return f"{name} differ"
        return ""

    def step_one_is_transition(self) -> str:
        states, controls = self._batch()
        outcome = self.model.transition(states, controls)
        for row in range(len(states)):
            after = self.model.step_one(states[row].tolist(), controls[row].tolist())
            lost = bool(outcome.ended[row] and not outcome.success[row])
            if after != ([] if lost else outcome.states[row].tolist()):
                return f"step {row} differs"
        return ""

    def arbitrary(self) -> str:
        for state in self.candidates[self.model.is_valid(self.candidates)]:
            self.env.set_env_state(state.copy())
            if not np.array_equal(self.env.get_env_state(), state):
                return f"{state.tolist()} came back as {np.asarray(self.env.get_env_state()).tolist()}"
        return ""


def _same(name: str, one: Array, other: Array) -> bool:
    return same_rewards(one, other) if name == "rewards" else np.array_equal(one, other, equal_nan=True)


def _inner(env: Any) -> Any:
    """Return the environment as its author wrote it."""
    return env.inner if isinstance(env, RestorableEnv | SuccessFlagEnv) else env


def _copies(env: Any, start: Array) -> str:
    env.set_env_state(state := start.copy())
    state += 1.0
    if not np.array_equal(env.get_env_state(), start):
        return "set_env_state keeps the array it is given"
    taken = env.get_env_state()
    taken += 1.0
    return "" if np.array_equal(env.get_env_state(), start) else "get_env_state returns the environment's own array"
