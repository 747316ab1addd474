"""Does an environment keep what reset-anywhere promises? A companion of Gymnasium's `check_env`."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.adapt import adapt
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv

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
    """The outcome of `check_resettable`."""

    env_id: str
    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether every check held."""
        return all(check.ok for check in self.checks)

    def __str__(self) -> str:
        verdict = "can be reset anywhere" if self.ok else "cannot be trusted to be reset anywhere"
        return "\n".join([f"{self.env_id}: {verdict}", *map(str, self.checks)])


@dataclass(frozen=True)
class _Roll:
    """States, observations, rewards and ends of a few steps, to be compared bit for bit."""

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
            if not np.array_equal(mine, theirs, equal_nan=True):
                gap = np.nanmax(np.abs(mine.astype(np.float64) - theirs.astype(np.float64)))
                return f"{name} differ by up to {gap:.3g}"
        return ""


def check_resettable(env: Any, *, seed: int = 0) -> ResetReport:
    """Check that `env` continues from a restored state as it did before, bit for bit.

    Args:
        env: A Gymnasium environment, or its adapted model. It is moved about.
        seed: Seed of the actions and states that are tried.
    """
    try:
        model: Any = adapt(env)
    except PbcsError as error:
        return ResetReport(type(env).__name__, (Check("has an adapter", False, str(error)),))
    except Exception as error:  # an author's mistake is a finding, not a crash
        return ResetReport(type(env).__name__, (Check("has an adapter", False, _describe(error)),))
    try:
        trial = _Trial(model, seed)
    except Exception as error:  # as above
        return ResetReport(model.spec.id, (Check("can be stepped", False, _describe(error)),))
    tests = [
        ("a restored state continues as before", trial.restored),
        ("so it does after other steps and another reset", trial.disturbed),
        ("so it does in a second instance", trial.elsewhere),
        ("returned arrays are copies", trial.copies),
        ("transition equals step", trial.transition_is_step),
        ("a batch equals a loop", trial.batch_is_loop),
        ("step_one equals transition", trial.step_one_is_transition),
    ]
    if "arbitrary" in model.capabilities:
        tests.append(("valid states within the bounds come back as set", trial.arbitrary))
    return ResetReport(model.spec.id, tuple(_run(name, test) for name, test in tests))


def _run(name: str, test: Callable[[], str]) -> Check:
    try:
        found = test()
    except Exception as error:  # an author's mistake is a finding, not a crash
        found = _describe(error)
    return Check(name, not found, found)


def _describe(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


class _Trial:
    """The checks on one model; each returns what it found wrong, or an empty string."""

    def __init__(self, model: Any, seed: int):
        self.model = model
        self.env: Any = model.env
        rng = np.random.default_rng(seed)
        self.start = model.initial_state(seed)
        self.controls = rng.uniform(model.action_low, model.action_high, (STEPS, len(model.action_low)))
        self.candidates = rng.uniform(model.state_low, model.state_high, (STEPS, len(model.state_low)))
        self.first = self.roll(self.env, self.start)

    def roll(self, env: Any, state: Array) -> _Roll:
        """Restore `state` in `env` and step until the controls or the episode end."""
        env.set_env_state(state.copy())
        rows = []
        for control in self.controls.astype(env.action_space.dtype):
            observation, reward, terminated, _, _ = env.step(control)
            rows.append((np.array(env.get_env_state()), np.array(observation), reward, terminated))
            if terminated:
                break
        return _Roll(*(np.array(column) for column in zip(*rows, strict=True)))

    def restored(self) -> str:
        return self.first.difference(self.roll(self.env, self.start))

    def disturbed(self) -> str:
        self.env.reset(seed=12345)
        for control in self.controls[::-1].astype(self.env.action_space.dtype):
            if self.env.step(control)[2]:
                break
        return self.first.difference(self.roll(self.env, self.start))

    def elsewhere(self) -> str:
        if self.env.spec is None:
            return self.first.difference(self.roll(deepcopy(self.env), self.start))
        other = self._second()
        other.reset(seed=54321)
        found = self.first.difference(self.roll(other, self.start))
        other.close()
        return found

    def _second(self) -> Any:
        fresh: Any = gymnasium.make(self.env.spec).unwrapped
        if not isinstance(self.env, RestorableEnv):
            return fresh
        again: Any = adapt(fresh, goal=self.env.goal_rule, feature=self.env.feature_rule)
        return again.env

    def copies(self) -> str:
        self.env.set_env_state(state := self.start.copy())
        state += 1.0
        if not np.array_equal(self.env.get_env_state(), self.start):
            return "set_env_state keeps the array it is given"
        taken = self.env.get_env_state()
        taken += 1.0
        if not np.array_equal(self.env.get_env_state(), self.start):
            return "get_env_state returns the environment's own array"
        before = self.model.transition(self.start[None], self.controls[:1]).states
        kept = before.copy()
        self.model.transition(self.first.states[:1], self.controls[:1])
        return "" if np.array_equal(before, kept) else "transition returns an array that it uses again"

    def _batch(self) -> tuple[Array, Array]:
        states = np.concatenate([self.start[None], self.first.states[:-1]])
        return states, self.controls[: len(states)]

    def transition_is_step(self) -> str:
        after, rewards, terminated, success = self.model.transition(*self._batch())
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
            if not np.array_equal(whole, np.concatenate(pieces)):
                return f"{name} differ"
        return ""

    def step_one_is_transition(self) -> str:
        states, controls = self._batch()
        after = self.model.transition(states, controls).states
        single = [self.model.step_one(s, c) for s, c in zip(states.tolist(), controls.tolist(), strict=True)]
        return "" if np.array_equal(after, np.array(single)) else "states differ"

    def arbitrary(self) -> str:
        for state in self.candidates[self.model.is_valid(self.candidates)]:
            self.env.set_env_state(state.copy())
            if not np.array_equal(self.env.get_env_state(), state):
                return f"{state.tolist()} came back as {np.asarray(self.env.get_env_state()).tolist()}"
        return ""
