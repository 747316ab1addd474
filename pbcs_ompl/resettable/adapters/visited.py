"""Adapters for environments that can only go back to where they were: copies, and replayed actions.

Actions are replayed after a reset, or in an instance of its own where what an instance has done before shows.

The saved state is a single number, a hash of the actions since `reset(seed)`: the seed stands for the start, and a
hash of the name before and of the action for what follows. So the same actions give the same numbers in every process,
and a trajectory found here can be replayed elsewhere.
"""

import struct
from abc import abstractmethod
from collections.abc import Callable
from copy import deepcopy
from hashlib import blake2b
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.types import Array
from pbcs_ompl.resettable.actions import ActionMap, copied
from pbcs_ompl.resettable.adapters.restorable import RestorableEnv
from pbcs_ompl.resettable.memory.owned import holds_resource
from pbcs_ompl.resettable.observations import flat
from pbcs_ompl.resettable.rewards import same_rewards
from pbcs_ompl.resettable.simulation import holds_compiled_model

FIRST_HASH, LAST_HASH = float(2**32), float(2**53)
"""Smaller numbers are seeds; up to the last, numbers of float64 are whole."""
PROOF_STEPS = 20


class VisitedEnv(RestorableEnv):
    """Names what was visited and finds it again; a subclass says how."""

    largest = LAST_HASH

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        self._name = 0.0
        self._observations: dict[float, Array] = {}
        super().__init__(inner, goal, feature)

    def attach(self) -> None:
        """Begin with nothing visited."""
        self._observations = {}

    def save(self) -> Array:
        """Return the name [1] of the present state."""
        return np.array([self._name])

    def load(self, saved: Array) -> None:
        """Go back to the state of a name [1]; a start that was not visited yet is one reset away."""
        name = float(saved[0])
        if name not in self._observations:
            if not 0 <= name < FIRST_HASH or name != int(name):
                raise InvalidState(f"{self._id()} can only go back to states it has visited, and {name} is none")
            head, distance = self._head, self._distance
            self.reset(seed=int(name))
            self._head, self._distance = head, distance
            return
        self.recall(name)
        self._name = name

    def observation(self) -> Any:
        """Return the observation that was made when the present state was visited."""
        return self._observations[self._name]

    def seen(self, observation: Any) -> Any:
        """Return an observation as it is: the wrappers saw it when it was made."""
        return observation

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Reset with a seed, a random one if need be, so that the start can be found again."""
        seed = int(np.random.default_rng().integers(2**32)) if seed is None else seed
        observation, info = super().reset(seed=seed, options=options)
        self._name = float(seed)
        self._visit(flat(observation), None, None)
        return observation, info

    def step(self, action: Array) -> Any:
        """Make one step, and name where it leads."""
        before, action = self._name, copied(action)
        outcome = super().step(action)
        self._name = child_hash(before, action)
        self._visit(flat(outcome[0]), before, action)
        return outcome

    def _visit(self, observation: Array, before: float | None, action: Array | None) -> None:
        """Keep the present state, unless it is never restored."""
        if not self.exploring:
            self._observations[self._name] = observation
            self.keep(self._name, before, action)

    @abstractmethod
    def keep(self, name: float, before: float | None, action: Array | None) -> None:
        """Make sure that the present state can be found again by its name."""

    @abstractmethod
    def recall(self, name: float) -> None:
        """Go back to the state of a name."""

    def _id(self) -> str:
        return type(self.inner).__name__


class CopiedEnv(VisitedEnv):
    """Keeps a deep copy of the environment for every state: only after `copies_are_faithful` has proved them."""

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        self._copies: dict[float, Any] = {}
        super().__init__(inner, goal, feature)

    def attach(self) -> None:
        """Begin with nothing visited."""
        super().attach()
        self._copies = {}

    def keep(self, name: float, before: float | None, action: Array | None) -> None:
        """Copy the environment."""
        if name not in self._copies:
            self._copies[name] = deepcopy(self.inner)

    def recall(self, name: float) -> None:
        """Go on with a copy of the copy."""
        self.inner = deepcopy(self._copies[name])


class ReplayedEnv(VisitedEnv):
    """Goes back by `reset(seed)` and the actions since: slow, O(depth), and right wherever steps are deterministic.

    Source: [Matheron2020] 1.3.
    """

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None):
        self._actions: dict[float, tuple[float, Array] | None] = {}
        super().__init__(inner, goal, feature)

    def attach(self) -> None:
        """Begin with nothing visited."""
        super().attach()
        self._actions = {}

    def keep(self, name: float, before: float | None, action: Array | None) -> None:
        """Store the action that led here."""
        self._actions[name] = None if before is None or action is None else (before, np.array(action))

    def recall(self, name: float) -> None:
        """Reset, and make the same actions again."""
        actions = []
        while (step := self._actions[name]) is not None:
            name, action = step
            actions.append(action)
        self.begin()
        self.inner.reset(seed=int(name))
        for action in reversed(actions):
            self.inner.step(copied(action))

    def begin(self) -> None:
        """Prepare for a reset."""


class FreshEnv(ReplayedEnv):
    """Goes back by a fresh instance, `reset(seed)` and the actions since: for environments whose past shows.

    Physics engines such as Box2D and pymunk keep caches that a reset does not empty.

    Args:
        inner: The environment without wrappers.
        goal, feature: See `RestorableEnv`.
        make_inner: Makes fresh instances.
    """

    def __init__(self, inner: Any, goal: Any = None, feature: Any = None, *, make_inner: Callable[[], Any]):
        self._make_inner = make_inner
        self._made: Any = None
        super().__init__(inner, goal, feature)

    def attach(self) -> None:
        """Begin with nothing visited."""
        super().attach()
        self._made = self.inner

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Reset a fresh instance."""
        self.begin()
        return super().reset(seed=seed, options=options)

    def begin(self) -> None:
        """Replace the instance."""
        if self._made is not None:
            self._made.close()
        self._made = self.inner = self._make_inner()


def child_hash(name: float, action: Array) -> float:
    """Return the name of what follows a state under an action: a hash of both in [FIRST_HASH, LAST_HASH)."""
    digest = blake2b(struct.pack("<d", name) + np.ascontiguousarray(action).tobytes(), digest_size=8).digest()
    return FIRST_HASH + float(int.from_bytes(digest, "little") % int(LAST_HASH - FIRST_HASH))


def copies_are_faithful(env: Any) -> bool:
    """Return whether a deep copy in the middle of an episode continues as the original does."""
    if holds_resource(env) or holds_compiled_model(env):
        return False
    rng = np.random.default_rng(0)
    env.reset(seed=0)
    for _ in range(PROOF_STEPS):
        if env.step(_action(env, rng))[2]:
            break
    actions = [_action(env, rng) for _ in range(PROOF_STEPS)]
    try:
        copy, spare = deepcopy(env), deepcopy(env)
        theirs = _walk(copy, actions)
        return _same(_walk(env, actions), theirs) and _same(_walk(spare, actions), theirs)
    except Exception:  # whatever a foreign class raises when it is copied: the proof has failed
        return False


def replays(env: Any) -> bool:
    """Return whether the same actions from the same seed lead to the same again in one instance."""
    rng = np.random.default_rng(0)
    actions = [_action(env, rng) for _ in range(2 * PROOF_STEPS)]
    walks = []
    for seed in (0, 1, 0):
        env.reset(seed=seed)
        walks.append(_walk(env, actions))
    return _same(walks[0], walks[2])


def _action(env: Any, rng: np.random.Generator) -> Any:
    return ActionMap.of(env.action_space).draw(rng)


def _walk(env: Any, actions: list[Array]) -> list[tuple[bytes, float]]:
    """Return what `env` says to each action: its observation and whether it terminated, as bytes, and the reward."""
    said = []
    for action in actions:
        observation, reward, terminated, _, _ = env.step(copied(action))
        said.append((flat(observation).tobytes() + struct.pack("?", bool(terminated)), float(reward)))
        if terminated:
            break
    return said


def _same(walk: list[tuple[bytes, float]], other: list[tuple[bytes, float]]) -> bool:
    return [seen for seen, _ in walk] == [seen for seen, _ in other] and same_rewards(
        [reward for _, reward in walk], [reward for _, reward in other])
