"""The task of a follower: a plan as a line, and executions along it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from pbcs_ompl.core.errors import InvalidState
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.types import Array, BoolArray, Counter, IndexArray
from pbcs_ompl.skills.episodes import with_random_actions
from pbcs_ompl.skills.path_following.follower import LineView, Progress, Relay, observed_along
from pbcs_ompl.skills.path_following.line import Line, arc_lengths, erase_loops, unwrapped
from pbcs_ompl.skills.path_following.shown_feature import ShownFeature
from pbcs_ompl.skills.policy import ObservationTransform
from pbcs_ompl.skills.settings import Settings

LOOKS = (1.0, 2.0, 4.0)
"""How far policies look ahead, in multiples of `LineSettings.look_ahead`."""
MOST_LOST = 4
"""How often executions may make no progress for as many steps as patience has, until they come further than before."""
STEP_QUANTILE = 0.9
"""Of the movements in a step along a plan, the one that is the unit: a blow against a wall is larger than a step."""


@dataclass(frozen=True)
class LineSettings(Settings):
    """How a plan becomes a line, and how far policies look ahead on it.

    Lengths are in steps: along each feature dimension, nine tenths of the steps of the plan move by at most 1. So the
    values hold in any environment.

    Attributes:
        spacing: Between the points of the line (ours, not tuned).
        look_ahead: Policies see the line 1, 2 and 4 times this ahead (ours; with 2, fewer mazes were solved).
        window: The longest move of a pointer in a step (ours; with 8, fewer mazes were solved).
        pass_radius: A pointer passes points of the line within this distance only, see `Line` (ours).
        patience: Steps without progress after which an episode of training has failed, and a pointer goes back to the
            nearest point of those that it has passed (ours; 20 and 40 were equal in mazes).
    """

    spacing: float = 0.5
    look_ahead: float = 1.0
    window: float = 4.0
    pass_radius: float = 1.0
    patience: int = 20

    def _check_ranges(self) -> None:
        self._check_positive("spacing", "look_ahead", "window", "pass_radius")
        self._check_counts("patience")


@dataclass(frozen=True, eq=False)
class Position:
    """Where executions are: states [B, D], what is observed there [B, O], and their progress on the line."""

    states: Array
    observations: Array
    progress: Progress

    def __getitem__(self, members: IndexArray) -> "Position":
        return Position(self.states[members], self.observations[members], self.progress[members])

    @classmethod
    def together(cls, positions: Sequence["Position"]) -> Self:
        """Return several as one."""
        return cls(np.concatenate([one.states for one in positions]),
                   np.concatenate([one.observations for one in positions]),
                   Progress(np.concatenate([one.progress.pointers for one in positions]),
                            np.concatenate([one.progress.stalled for one in positions])))

    def put(self, members: IndexArray, others: "Position") -> None:
        """Let some executions be others from now on."""
        self.states[members], self.observations[members] = others.states, others.observations
        self.progress.pointers[members] = others.progress.pointers
        self.progress.stalled[members] = others.progress.stalled


@dataclass(frozen=True, eq=False)
class FollowStep:
    """What one step of some executions did.

    Attributes:
        position: Where they are now.
        gains: Progress along the line, in steps [B].
        strayed: How much further from the line they are than before, in steps [B].
        success: Which reached the environment's goal [B].
        terminated, ended: Which episodes the environment terminated, and which it ended for whatever reason [B].
    """

    position: Position
    gains: Array
    strayed: Array
    success: BoolArray
    terminated: BoolArray
    ended: BoolArray


@dataclass(frozen=True, eq=False)
class Tries:
    """What executions did.

    Attributes:
        success: Which succeeded [B].
        pointers: How far they came on the line [B].
        retries: Where those that failed were in the steps around their last progress, as starts of new executions [N].
        before: Where each of those that failed was a patience before its last progress, or began [F].
    """

    success: BoolArray
    pointers: IndexArray
    retries: Position
    before: Position


@dataclass(frozen=True, eq=False)
class FollowTask:
    """A plan as a line, and executions along it.

    Attributes:
        model: The environment.
        line: Through the features of the plan without its loops, and a little beyond its end, in steps.
        view: What policies see.
        states: The states of the plan [T+1, D].
        pointers: Where they are on the line [T+1]; those of a loop are where it begins.
        hops: Number of states in the plan without its loops, less one.
    """

    model: ResettableModel
    line: Line
    view: LineView
    states: Array
    pointers: IndexArray
    hops: int

    @classmethod
    def of(cls, model: ResettableModel, states: Array, settings: LineSettings) -> Self:
        """Return the task of following the states of a plan [T+1, D].

        Raises:
            Mismatch: the observation does not show the feature.
            InvalidState: the plan is in the goal before its end.
        """
        early = np.flatnonzero(model.goal_distance(states[:-1]) < model.goal_threshold)
        if len(early):
            raise InvalidState(f"state {early[0]} of the plan is in the goal, where the episode ends, but the plan has "
                               f"{len(states) - 1} steps; cut it off there")
        observations = model.observe(states)
        shown = ShownFeature.of(model, states, observations)
        features, periods = shown(observations), shown.periods(model.feature_periods)
        steps = np.quantile(np.abs(np.diff(unwrapped(features, periods), axis=0)), STEP_QUANTILE, axis=0)
        unit = np.where(steps > 0, steps, 1.0)
        kept = erase_loops(features / unit, 1.0, periods / unit)
        corners = unwrapped(features[kept], periods) / unit
        line = Line.through(extended(corners, settings.look_ahead * max(LOOKS)), settings.spacing,
                            settings.pass_radius, periods / unit if periods.any() else None)
        hop = np.searchsorted(kept, np.arange(len(states)), side="right") - 1
        pointers = line.pointer_at(arc_lengths(corners))[hop]
        seen = observed_along(line, pointers, shown, unit, observations)
        deviation = seen.std(axis=0)
        normaliser = ObservationTransform(seen.mean(axis=0), np.where(deviation > 1e-9, deviation, 1.0))
        view = LineView(shown, unit, normaliser, settings.look_ahead * np.array(LOOKS), settings.window,
                        settings.patience, settings.patience)
        return cls(model, line, view, states, pointers, len(kept) - 1)

    def place(self, pointer: int) -> int:
        """Return the number of the first state of the plan that is at a pointer or beyond."""
        return min(int(np.searchsorted(self.pointers, pointer)), len(self.states) - 1)

    def at(self, places: IndexArray) -> Position:
        """Return executions that begin in the states of the plan number `places` [B]."""
        states = self.states[places]
        return Position(states, self.model.observe(states), Progress.at(self.pointers[places]))

    def inputs(self, position: Position) -> Array:
        """Return what a policy sees [B, I]."""
        return self.view.inputs(position.observations, self.line, position.progress)

    def step(self, position: Position, controls: Array) -> FollowStep:
        """Make one step with controls [B, A]."""
        outcome = self.model.transition(position.states, controls)
        observations = self.model.observe(outcome.states)
        progress = position.progress.advanced(self.line, self.view.features(observations), self.view.window,
                                              self.view.lost_after)
        gains = ((progress.pointers - position.progress.pointers) * self.line.spacing).astype(np.float64)
        after = Position(outcome.states, observations, progress)
        return FollowStep(after, gains, self._away(after) - self._away(position), outcome.success, outcome.terminated,
                          outcome.ended)

    def _away(self, position: Position) -> Array:
        """Return how far executions are from their places on the line, in steps [B]."""
        features, here = self.view.features(position.observations), np.zeros(1)
        lengths: Array = np.linalg.norm(self.line.ahead(features, position.progress.pointers, here)[:, 0], axis=1)
        return lengths

    def execute(self, relay: Relay, position: Position, *, until: IndexArray, epsilon: float, max_steps: int,
                rng: np.random.Generator, counter: Counter) -> Tries:
        """Let policies act, in the model, until the goal, the end of the episode, or until they are lost too often.

        Args:
            relay: The policies.
            position: Where executions begin.
            until: Pointers at which they have succeeded without the goal [B].
            epsilon: Fraction of random actions.
            max_steps: Steps after which an execution has failed.
            rng: Source of random actions.
            counter: Counts every transition.

        Raises:
            BudgetUsedUp: in the middle of the executions.
        """
        pointers, lost = position.progress.pointers.copy(), np.zeros(len(position.states), dtype=np.int64)
        success, alive, trail = np.zeros(len(pointers), dtype=np.bool_), np.arange(len(pointers)), []
        for _ in range(max_steps):
            trail.append((alive, position))
            controls = relay.act(self.inputs(position), position.progress.pointers)
            controls = with_random_actions(self.model, controls, epsilon, rng)
            counter.spend(len(alive))
            after = self.step(position, controls)
            now = after.position.progress
            lost[alive] = np.where(now.pointers > pointers[alive], 0, lost[alive] + (now.stalled >= self.view.patience))
            pointers[alive] = np.maximum(pointers[alive], now.pointers)
            success[alive] = after.success | (now.pointers >= until[alive])
            over = success[alive] | after.ended | (lost[alive] >= MOST_LOST)
            going = np.flatnonzero(~over)
            alive, position = alive[going], after.position[going]
            if not len(alive):
                break
        return Tries(success, pointers, *around_last_progress(trail, ~success, self.view.patience))


def around_last_progress(trail: Sequence[tuple[IndexArray, Position]], failed: BoolArray,
                         reach: int) -> tuple[Position, Position]:
    """Return where executions that failed were, as starts of new ones [N], and the first of these for each of them [F].

    Args:
        trail: For each step, the executions that made it and where they were before it.
        failed: Which of the executions failed [B].
        reach: The most steps before and after the last progress of each.
    """
    members, steps = (np.concatenate(parts) for parts in zip(*(
        (alive, np.full(len(alive), step)) for step, (alive, _) in enumerate(trail)), strict=True))
    stalled = np.concatenate([position.progress.stalled for _, position in trail])
    last = np.zeros(len(failed), dtype=np.int64)
    np.maximum.at(last, members, np.where(stalled == 0, steps, 0))
    kept = failed[members] & (np.abs(steps - last[members]) <= reach)
    states, observations, pointers = (np.concatenate(parts)[kept] for parts in zip(*(
        (position.states, position.observations, position.progress.pointers) for _, position in trail), strict=True))
    every = Position(states, observations, Progress.at(pointers))
    return every, every[np.unique(members[kept], return_index=True)[1]]


def extended(corners: Array, length: float) -> Array:
    """Return corners [N, F] and one more, further in the direction of the last hop: a policy need not stop at the end.

    A plan ends where it enters the goal, so that way leads into it.
    """
    hop = corners[-1] - corners[-2]
    size = float(np.linalg.norm(hop))
    return np.concatenate([corners, (corners[-1] + hop * (length / size))[None]]) if size > 0 else corners
