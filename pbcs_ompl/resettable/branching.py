"""The branching test: what is executed from restored states is what fresh instances do, bit for bit.

Planners restore a state, step, restore another, and so on: sequences of actions are executed like that, with resets and
a long episode in between, and compared with the same sequences in instances in which nothing else has run.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap, copied
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.adapters.success_flag import SuccessFlagEnv
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.observing import state_observer
from pbcs_ompl.resettable.rewards import same_rewards
from pbcs_ompl.resettable.rules import Outcome, reported_success
from pbcs_ompl.resettable.supported import TaskMaker

SHORT, LONG = 12, 60
"""Steps of a sequence."""
HELD = 4
OTHER_SEED = 1_234_567


class Moment(NamedTuple):
    """What is compared after a reset or a step."""

    state: dict[str, Any]
    observation: Array
    reward: float = math.nan
    terminated: bool = False
    truncated: bool = False
    success: bool = False

    def difference(self, other: "Moment") -> str:
        """Return the name of the first component that differs, or an empty string."""
        for name in self.state.keys() & other.state.keys():
            found = _first_index(self.state[name], other.state[name])
            if found is not None:
                return f"state: {name}{found}"
        for name in ("observation", "terminated", "truncated", "success"):
            found = _first_index(getattr(self, name), getattr(other, name))
            if found is not None:
                return f"{name}{found}"
        return "" if same_rewards(self.reward, other.reward) else "reward"


def first_difference(env: Any, make_inner: TaskMaker, *, steps: int = SHORT, seed: int = 0) -> str:
    """Return what differs first between restored states and fresh instances, with its place; empty if nothing does.

    Args:
        env: An environment with `get_env_state` and `set_env_state`, adapted or an author's own. It is moved about.
        make_inner: Makes fresh instances of it.
        steps: The length of the sequences.
        seed: Of resets and actions.
    """
    rng = np.random.default_rng(seed)
    one, two = _sequence(env, rng, steps), _sequence(env, rng, steps)
    return _Branching(env, seed, one, fresh_episode(env, make_inner, seed, one), two,
                      fresh_episode(env, make_inner, seed, two), _sequence(env, rng, 3 * steps)).first_difference()


def fresh_difference(env: Any, make_inner: TaskMaker, *, steps: int = LONG, seed: int = 0) -> str:
    """Return what differs first between two fresh instances that do the same, or an empty string."""
    actions = _sequence(env, np.random.default_rng(seed), steps)
    return _difference(*(fresh_episode(env, make_inner, seed, actions) for _ in range(2)))


def repeats(env: Any, make_inner: TaskMaker, *, steps: int = LONG, seed: int = 0) -> bool:
    """Return whether one instance does the same twice."""
    actions, inner = _sequence(env, np.random.default_rng(seed), steps), make_inner()
    try:
        return not _difference(*(_episode(env, inner, seed, actions) for _ in range(2)))
    finally:
        inner.close()


def fresh_episode(env: Any, make_inner: TaskMaker, seed: int, actions: list[Any]) -> list[Moment]:
    """Return the moments of an episode in a fresh instance, from the reset to its end or that of the actions.

    Args:
        env: The environment that is tested, which says what is a success and a part of the state.
        make_inner: Makes the instance.
        seed: Of its reset.
        actions: What it is given.
    """
    inner = make_inner()
    try:
        return _episode(env, inner, seed, actions)
    finally:
        inner.close()


class _Branching:
    """Two sequences of actions from one start, what fresh instances made of them, and a third that only disturbs."""

    def __init__(self, env: Any, seed: int, one: list[Any], moments_one: list[Moment], two: list[Any],
                 moments_two: list[Moment], other: list[Any]):
        self._env, self._seed = env, seed
        self._one, self._two, self._other = (one, moments_one), (two, moments_two), other

    def first_difference(self) -> str:
        """Return what differs first, or an empty string."""
        return next((found for found in self._differences() if found), "")

    def _differences(self) -> Iterator[str]:
        self._disturb(self._seed)
        states: list[Array] = []
        yield from self._episode(states)
        self._disturb(OTHER_SEED)
        yield from self._branch(states[0], self._two, 0, [])
        middle = len(states) // 2
        self._disturb(OTHER_SEED)
        yield from self._branch(states[middle], self._one, middle, [])
        yield from self._interleaved(states)
        yield from self._observed(states)

    def _episode(self, states: list[Array]) -> Iterator[str]:
        """Compare the first sequence from a reset on, and append the states on the way to `states`."""
        observation, _ = self._env.reset(seed=self._seed)
        states.append(np.array(self._env.get_env_state()))
        found = self._one[1][0].difference(Moment(_named_state(self._env, self._inner), flat(observation)))
        yield f"{found} after a reset" if found else ""
        yield from self._steps(self._one, 0, states, "of an episode")

    def _branch(self, state: Array, sequence: tuple[list[Any], list[Moment]], at: int,
                states: list[Array]) -> Iterator[str]:
        """Compare a sequence from a restored state on."""
        self._env.set_env_state(state.copy())
        back = _first_index(state, self._env.get_env_state())
        yield f"state{back} right after it was restored" if back is not None else ""
        yield from self._steps(sequence, at, states, f"of a sequence restored at step {at}")

    def _interleaved(self, states: list[Array]) -> Iterator[str]:
        """Compare single steps of both sequences in turn, each from the state that the last one led to."""
        branches = [[states[0]], [states[0]]]
        for step in range(min(len(self._one[1]), len(self._two[1])) - 1):
            for branch, sequence in zip(branches, (self._one, self._two), strict=True):
                self._env.set_env_state(branch[-1].copy())
                yield self._step(sequence, step, "of single steps, each from a restored state")
                branch.append(np.array(self._env.get_env_state()))
        for step, (once, again) in enumerate(zip(states, branches[0], strict=False)):
            index = _first_index(once, again)
            yield "" if index is None else f"state{index} at step {step} of single steps, each from a restored state"

    def _observed(self, states: list[Array]) -> Iterator[str]:
        """Compare the observations of restored states; those that an author computes, in float32 or a shorter type."""
        observe = state_observer(self._env, EnvAttributes.of(self._env))
        if observe is None:
            return
        kind = np.dtype(np.float64 if isinstance(self._env, RestorableEnv) else np.float32)
        space = self._env.observation_space
        if isinstance(self._env, SuccessFlagEnv) and space.dtype is not None and space.dtype.kind == "f":
            kind = min(kind, space.dtype, key=lambda dtype: dtype.itemsize)
        rows = observe(np.array(states))
        for step, (row, moment) in enumerate(zip(rows, self._one[1], strict=False)):
            index = _first_index(moment.observation.astype(kind), flat(row).astype(kind))
            yield f"observation{index} of the restored state of step {step}" if index is not None else ""

    def _steps(self, sequence: tuple[list[Any], list[Moment]], at: int, states: list[Array],
               where: str) -> Iterator[str]:
        for step in range(at, len(sequence[1]) - 1):
            yield self._step(sequence, step, where)
            states.append(np.array(self._env.get_env_state()))

    def _step(self, sequence: tuple[list[Any], list[Moment]], step: int, where: str) -> str:
        observation, reward, terminated, truncated, info = self._env.step(copied(sequence[0][step]))
        if isinstance(self._env, RestorableEnv):
            success = bool(info["is_success"])
        else:
            success = _success(self._env, Outcome(self._inner, observation, float(reward), bool(terminated), info))
        found = sequence[1][step + 1].difference(Moment(_named_state(self._env, self._inner), flat(observation),
                                                        float(reward), bool(terminated), bool(truncated), success))
        return f"{found} at step {step + 1} {where}" if found else ""

    def _disturb(self, seed: int) -> None:
        """Reset, and run a long episode."""
        self._env.reset(seed=seed)
        for action in self._other:
            _, _, terminated, truncated, _ = self._env.step(copied(action))
            if terminated or truncated:
                break

    @property
    def _inner(self) -> Any:
        return self._env.inner if isinstance(self._env, RestorableEnv | SuccessFlagEnv) else self._env


def _episode(env: Any, inner: Any, seed: int, actions: list[Any]) -> list[Moment]:
    observation, _ = inner.reset(seed=seed)
    moments = [Moment(_named_state(env, inner), flat(observation))]
    for action in actions:
        if moments[-1].terminated or moments[-1].truncated:
            break
        observation, reward, terminated, truncated, info = inner.step(copied(action))
        outcome = Outcome(inner, observation, float(reward), bool(terminated), info)
        moments.append(Moment(_named_state(env, inner), flat(observation), float(reward), bool(terminated),
                              bool(truncated), _success(env, outcome)))
    return moments


def _difference(one: list[Moment], two: list[Moment]) -> str:
    """Return what differs first between two episodes, with its step, or an empty string."""
    return next((f"{found} at step {step}" for step, (mine, theirs) in enumerate(zip(one, two, strict=False))
                 if (found := mine.difference(theirs))), "" if len(one) == len(two) else f"the end at step {len(one)}")


def _sequence(env: Any, rng: np.random.Generator, steps: int) -> list[Any]:
    """Return actions, each of them a few times."""
    actions = ActionMap.of(env.action_space)
    controls = rng.uniform(actions.low, actions.high, (-(-steps // HELD), len(actions.low)))
    return list(actions.to_actions(np.repeat(controls, HELD, axis=0)[:steps]))


def _named_state(env: Any, inner: Any) -> dict[str, Any]:
    if isinstance(env, RestorableEnv):
        named: dict[str, Any] = {name: _kept(value) for name, value in env.named_state(inner).items()}
        return named
    return {"get_env_state()": np.array(inner.get_env_state(), dtype=np.float64)}


def _kept(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else repr(value) if not np.isscalar(value) else value


def _success(env: Any, outcome: Outcome) -> bool:
    if isinstance(env, RestorableEnv):
        return env.is_success(outcome)
    return reported_success(outcome)


def _first_index(one: Any, other: Any) -> str | None:
    """Return the place of the first number that differs, as `[3]`; None where both are equal, NaN included."""
    if np.shape(one) != np.shape(other):
        return ""
    same = np.asarray(one) == np.asarray(other)
    if np.asarray(one).dtype.kind == "f":
        same = same | (np.isnan(np.asarray(one)) & np.isnan(np.asarray(other)))
    if np.all(same):
        return None
    place = np.unravel_index(int(np.argmin(same)), np.shape(same)) if np.ndim(same) else ()
    return "".join(f"[{index}]" for index in place)
