"""A follower: a controller of observations that moves along a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pbcs_ompl.agents.policy import Policy, PolicyStack
from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.resettable.actions import ActionMap, Actions
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.path_following.shown_feature import ShownFeature
from pbcs_ompl.skills.policy import ObservationTransform
from pbcs_ompl.skills.side_by_side import SideBySide


@dataclass(frozen=True, eq=False)
class Progress:
    """How far executions have come along a line.

    Attributes:
        pointers: Where they are on it [B].
        stalled: Steps since a pointer moved last [B].
    """

    pointers: IndexArray
    stalled: IndexArray

    @classmethod
    def at(cls, pointers: IndexArray) -> "Progress":
        """Return that of executions that begin at some pointers [B]."""
        return cls(pointers, np.zeros_like(pointers))

    def __getitem__(self, members: IndexArray) -> "Progress":
        return Progress(self.pointers[members], self.stalled[members])

    def advanced(self, line: Line, features: Array, window: float, lost_after: int = 0) -> "Progress":
        """Return the progress after a step that led to `features` [B, F]; see `Line.advance`.

        Args:
            line: The line.
            features: Where the executions are now.
            window: The longest move of a pointer, a length.
            lost_after: Steps without progress after which a pointer first goes back to the nearest point of those that
                it has passed; 0 for never.
        """
        lost = (self.stalled >= lost_after) & (lost_after > 0)
        before, waited = self.pointers, np.where(lost, -1, self.stalled)
        if lost.any():
            before = before.copy()
            before[lost] = line.nearest(features[lost], before[lost])
        pointers = line.advance(features, before, window)
        return Progress(pointers, np.where(pointers > before, 0, waited + 1))


class View(Protocol):
    """What a policy sees of the world and of the line."""

    @property
    def window(self) -> float:
        """The longest move of a pointer in a step, a length of the line."""
        ...

    @property
    def lost_after(self) -> int:
        """Steps without progress after which a pointer goes back; 0 for never."""
        ...

    def features(self, observations: Array) -> Array:
        """Return the features [B, F], in the unit of lines, that observations [B, O] show."""
        ...

    def inputs(self, observations: Array, line: Line, progress: Progress) -> Array:
        """Return the inputs [B, I] of a policy."""
        ...


@dataclass(frozen=True, eq=False)
class LineView:
    """The observation, the line some distances ahead, and how long there was no progress, side by side.

        (normaliser(o), line(pointer + distance_k) - f(o) for each k, min(stalled / patience, 1))

    Angles count whole turns as the line does at the pointer (`Line.unwound`), in the observation too where they are an
    entry of it: nothing that the policy sees jumps.

    Attributes:
        shown: Where the feature stands in the observation.
        unit: The unit of lines along each feature dimension [F]: f(o) = shown(o) / unit.
        normaliser: Of the observations.
        distances: How far the policy looks ahead along the line, lengths [K].
        window: The longest move of a pointer in a step, a length.
        patience: Steps without progress after which training gives up.
        lost_after: Steps without progress after which a pointer goes back to the nearest point that it has passed, so
            that the way from there is driven again; 0 for never.
    """

    shown: ShownFeature
    unit: Array
    normaliser: ObservationTransform
    distances: Array
    window: float
    patience: int
    lost_after: int = 0

    @property
    def size(self) -> int:
        """Number I of inputs."""
        return len(self.normaliser.origin) + len(self.distances) * len(self.unit) + 1

    def features(self, observations: Array) -> Array:
        """Return the features [B, F], in the unit of lines, that observations [B, O] show."""
        features: Array = self.shown(observations) / self.unit
        return features

    def inputs(self, observations: Array, line: Line, progress: Progress) -> Array:
        """Return the inputs [B, I] of a policy."""
        ahead = line.ahead(self.features(observations), progress.pointers, self.distances)
        seen = observed_along(line, progress.pointers, self.shown, self.unit, observations)
        return np.concatenate([self.normaliser(seen), ahead.reshape(len(observations), -1),
                               np.minimum(progress.stalled / self.patience, 1.0)[:, None]], axis=1)


def observed_along(line: Line, pointers: IndexArray, shown: ShownFeature, unit: Array, observations: Array) -> Array:
    """Return observations [B, O] whose angles count whole turns as a line does.

    Args:
        line: The line.
        pointers: Where the executions are on it [B].
        shown: Where the feature stands in the observation.
        unit: The unit of the line along each feature dimension [F].
        observations: [B, O].
    """
    if line.periods is None:
        return observations
    features = shown(observations) / unit
    return shown.moved(observations, (line.unwound(features, pointers) - features) * unit)


class Relay:
    """Policies that take over from each other at fixed places of a line.

    Args:
        policies: In the order of execution.
        firsts: The pointer from which each of them acts, in increasing order; 0 comes first.

    Raises:
        InvalidOption: there is no policy, or `firsts` does not fit.
    """

    def __init__(self, policies: Sequence[Policy], firsts: Sequence[int]):
        if not policies or len(firsts) != len(policies) or firsts[0] != 0 or any(np.diff(firsts) <= 0):
            raise InvalidOption(f"{len(policies)} policies that act from the pointers {list(firsts)}; expected at "
                                "least one, from 0 on, in increasing order")
        self._stack, self._firsts = PolicyStack(policies), np.array(firsts)

    def index(self, pointers: IndexArray) -> IndexArray:
        """Return the index of the policy that acts at each pointer [B]."""
        return np.searchsorted(self._firsts, pointers, side="right") - 1

    def act(self, inputs: Array, pointers: IndexArray) -> Array:
        """Return controls [B, A] for the inputs [B, I] of executions at pointers [B]."""
        return self._stack.act(inputs, self.index(pointers))


class Follower(SideBySide):
    """Drives along a line: a pointer for each episode moves forward on it, and a policy sees where the line leads.

    Where an episode makes no progress for long, its pointer goes back (`LineView.lost_after`).

    Where one policy does not lead to the end, others take over at fixed places of the line.

    Example:
        >>> controller = chain.controller()
        >>> controller.reset()
        >>> observation, info = env.reset()
        >>> observation, *rest = env.step(controller.act(observation))

    Attributes:
        line: The line; another one in the same unit may take its place between episodes.
        progress: How far each episode has come [B].

    Args:
        policies: In the order of execution.
        firsts: The pointer from which each of them acts, in increasing order; 0 comes first.
        line: Where to go.
        view: What the policies see.
        actions: The action space.

    Raises:
        InvalidOption: there is no policy, or `firsts` does not fit.
    """

    def __init__(self, policies: Sequence[Policy], firsts: Sequence[int], line: Line, view: View, actions: ActionMap):
        self._relay, self._view, self._actions = Relay(policies, firsts), view, actions
        self.line = line
        self.reset()

    def _begin(self, count: int) -> None:
        self.progress = Progress(np.zeros(count, dtype=np.int64), np.full(count, -1))

    @property
    def current(self) -> IndexArray:
        """The index of the policy that acts in each episode [B]."""
        return self._relay.index(self.progress.pointers)

    def _act(self, observations: Array, members: IndexArray) -> Actions:
        view = self._view
        moved = self.progress[members].advanced(self.line, view.features(observations), view.window, view.lost_after)
        self.progress.pointers[members], self.progress.stalled[members] = moved.pointers, moved.stalled
        inputs = view.inputs(observations, self.line, moved)
        return self._actions.to_actions(self._relay.act(inputs, moved.pointers))
