"""Shorter plans, by resets and steps alone: any time, every result a real trajectory.

Three moves make a new plan of the best one so far. Where a step can lead to any state nearby, *short cuts* leave the
plan at one state and join it at another, exactly, so that the plan behind needs no new steps; which are tried is
decided by what the search has seen of free space (see `free_space`). A *pull* drives from the start along the plan as
along a rope that is pulled tight: it aims at the last state of the plan within reach. Where a ride towards that state
ends beside it, the next ride begins there; reach doubles with every ride that does, and halves with every one that does
not. So loops are left out and corners are cut wherever the environment lets a ride through. A *cut* leaves out some of
the controls, and replays the rest. Short cuts come first, while they save anything; then one of the other two, that
which has saved more for its transitions so far.
"""

import time
from dataclasses import dataclass, field
from math import isfinite, nan
from typing import Any, NamedTuple, Self

import numpy as np

from pbcs_ompl.bridge.free_motion import FreeMotion
from pbcs_ompl.bridge.free_space import FreeSpace, ShortCut
from pbcs_ompl.bridge.growing_path import GrowingPath
from pbcs_ompl.bridge.steering import Steering
from pbcs_ompl.bridge.trajectory import Trajectory, from_controls
from pbcs_ompl.core.callbacks import check_finite, code_of_others
from pbcs_ompl.core.errors import BudgetUsedUp, InvalidOption
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.tree import Tree
from pbcs_ompl.core.types import Array, Counter, Transition

BESIDE = 0.75
"""Bins from a state of the plan at which a ride has succeeded."""
FIRST_REACH, MOST_REACH = 8.0, 64.0
"""Bins within which a ride aims at a state of the plan."""
PATIENCE = 3
"""Steps of a ride without coming closer, after which it has failed."""
MOST_LEARNT, MOST_SEEN = 4096, 1 << 15
"""Transitions of the search that the dynamics are fitted to, and from which free space is known."""
MOST_FAILED = 3
"""How often in a row short cuts may save nothing until something else is tried."""
MOST_ROUNDED = 2
"""Steps more than planned that a short cut may need to join the plan to the last bit."""
MOST_ENDS = 128
"""States of the plan at which short cuts may begin or end."""
LONGEST_REPLAY = 8
"""Steps of the plan that are tried where no ride succeeds."""


class Allowance(NamedTuple):
    """What improving a plan may use: one of a number of transitions, a share of those of the search, wall time."""

    transitions: int | None = None
    share: float | None = None
    seconds: float | None = None

    @classmethod
    def of(cls, amount: int | str) -> Self:
        """Return what an amount stands for: 5000 transitions, "10%" of those of the search, "2s" of wall time.

        Raises:
            InvalidOption: it is none of these, or not above 0.
        """
        text = str(amount).strip()
        number = text.removesuffix("%").removesuffix("s")
        kind = text[len(number):]
        try:
            value = float(number)
        except ValueError:
            value = nan
        if not (isfinite(value) and value > 0) or kind == "%s" or (kind == "" and value != int(value)):
            raise InvalidOption(f"improve is {amount!r}; expected a number of transitions as 5000, a share of those of "
                                f"the search as '10%', or seconds as '2s'")
        if kind == "":
            return cls(transitions=int(value))
        return cls(share=value / 100.0) if kind == "%" else cls(seconds=value)

    def after(self, transitions: int) -> Self:
        """Return the allowance after a search with a number of transitions: a share of them becomes a number."""
        return self if self.share is None else type(self)(transitions=int(self.share * transitions))


@dataclass(frozen=True)
class Improvement:
    """What improving a plan has brought.

    Attributes:
        before, after: Steps of the plan.
        transitions: Environment steps that were made for it, beside those of the search.
        seconds: Wall time.
        progress: After how many of these transitions and seconds the plan had which length, first that of the search.
    """

    before: int
    after: int
    transitions: int
    seconds: float
    progress: dict[str, list[Any]] = field(default_factory=dict)


class _Anchor(NamedTuple):
    """A place that a pull has come to: its steps, the plan's state beside it, and the last state to aim at."""

    steps: int
    beside: int
    last: int


def improve(trajectory: Trajectory, model: ResettableModel, allowance: Allowance, *, seed: int = 0,
            tree: Tree | None = None) -> tuple[Trajectory, Improvement]:
    """Return the shortest trajectory that was found within an allowance, and what that took.

    Args:
        trajectory: A plan that ends in the goal.
        model: Where it was found; transitions are made in it.
        allowance: What may be used; a share is one of the nodes of the tree.
        seed: Of everything random.
        tree: That of the search, whose transitions show how controls work, where it has controls.
    """
    rng = SeedTree(seed).child("improve").generator()
    return _Improver(trajectory, model, allowance.after(0 if tree is None else len(tree)), rng, tree).run()


class _Improver:
    """The best plan so far, and what making it shorter has used."""

    def __init__(self, trajectory: Trajectory, model: ResettableModel, allowance: Allowance, rng: np.random.Generator,
                 tree: Tree | None):
        self._given, self._model, self._allowance, self._rng, self._tree = trajectory, model, allowance, rng, tree
        self._best = GrowingPath(list(trajectory.states), list(trajectory.controls), trajectory.rewards.tolist())
        self._counter, self._began = Counter(allowance.transitions), time.perf_counter()
        self._at_goal, self._pulled = False, False
        self._motion: FreeMotion | None = None
        self._progress: dict[str, list[Any]] = {"transitions": [], "seconds": [], "length": []}

    def run(self) -> tuple[Trajectory, Improvement]:
        """Make moves until the allowance is used up."""
        self._note()
        saved, spent = {self._pull: 1.0, self._cut: 1.0}, {self._pull: 1.0, self._cut: float(len(self._best) + 1)}
        try:
            with code_of_others():
                if len(self._best) > 1:  # a tree without a transition shows nothing
                    self._learn()
                while len(self._best) > 1 and self._counter.left:
                    self._cut_short()
                    move = max(saved, key=lambda one: saved[one] / spent[one])
                    before, made = len(self._best), self._counter.count
                    try:
                        move()
                    finally:
                        saved[move] += before - len(self._best)
                        spent[move] += self._counter.count - made
        except BudgetUsedUp:  # the allowance ended within a move: what was found before it stays
            pass
        best, given, seconds = self._best, self._given, time.perf_counter() - self._began
        found = Improvement(given.length, len(best), self._counter.count, seconds, self._progress)
        if len(best) == given.length:
            return given, found
        return from_controls(self._model, np.array(best.states), np.array(best.controls), np.array(best.rewards),
                             planner=given.planner, seed=given.seed, reset_seed=given.reset_seed), found

    def _learn(self) -> None:
        """Learn how controls work, and what is free, from what the search has shown."""
        given, tree = self._given, self._tree
        nodes = np.empty(0, np.int64)
        if tree is not None and tree.has_controls:
            nodes = np.flatnonzero(tree.parents >= 0)
        states, controls, after = given.states[:-1], given.controls, given.states[1:]

        def shown(most: int) -> tuple[Array, Array, Array]:
            if tree is None or not len(nodes):
                return states, controls, after
            some = nodes[::-(-len(nodes) // most)]
            return (np.vstack([states, tree.states[tree.parents[some]]]), np.vstack([controls, tree.controls[some]]),
                    np.vstack([after, tree.states[some]]))

        self._steering = Steering(self._model, *shown(MOST_LEARNT))
        self._motion = FreeMotion.shown_by(self._model, *shown(MOST_LEARNT))
        if self._motion is not None:
            self._space = FreeSpace(self._motion, *shown(MOST_SEEN))

    def _cut_short(self) -> None:
        """Where the motion is free, try short cuts until several times none has saved anything."""
        motion, failed = self._motion, 0
        while motion is not None and failed < MOST_FAILED and self._counter.left and len(self._best) > 1:
            before, states = len(self._best), np.array(self._best.states)
            self._splice(self._driven(motion, self._short_cuts(states), states))
            failed = 0 if len(self._best) < before else failed + 1

    def _short_cuts(self, states: Array) -> list[ShortCut]:
        """Return short cuts that are likely free; where not all can be afforded, those that save most for a step."""
        end = len(states) - 1
        index = np.arange(end + 1)
        if end > MOST_ENDS:
            index = np.unique([0, end, *self._rng.choice(end, MOST_ENDS, replace=False)])
        chosen, left = [], self._counter.left
        for cut in sorted(self._space.short_cuts(states, index), key=lambda one: one.steps / (one.last - one.first)):
            if cut.steps <= left:
                chosen.append(cut)
                left -= cut.steps
        return chosen

    def _driven(self, motion: FreeMotion, cuts: list[ShortCut], states: Array) -> list[tuple[ShortCut, GrowingPath]]:
        """Drive along short cuts side by side; return those that came through, each with its path."""
        paths, made = [GrowingPath([states[cut.first]]) for cut in cuts], []
        through, going, taken = [], np.arange(len(cuts)), 0
        first, last, steps = np.array(cuts, np.int64).reshape(-1, 3).T
        here, there = states[first], states[last]
        while len(going) and self._counter.left >= len(going):
            controls = motion.controls(here, there[going], np.maximum(steps[going] - taken, 1))
            outcome = self._advance(here, controls)
            made.append((here, controls, outcome.states))
            joined = (outcome.states == there[going]).all(axis=1) | outcome.success
            on = motion.is_free(here, controls, outcome.states) & ~outcome.ended
            taken += 1
            for row in np.flatnonzero(joined | on).tolist():
                paths[going[row]].append(outcome, controls, row)
            for row in np.flatnonzero(joined & (on | outcome.success)).tolist():
                cut, path = cuts[going[row]], paths[going[row]]
                joint = len(self._best) if outcome.success[row] else cut.last
                through.append((ShortCut(cut.first, joint, len(path)), path))
            on &= ~joined & (taken < steps[going] + MOST_ROUNDED)  # what rounding has left is a step more
            here, going = outcome.states[on], going[on]
        if made:
            self._space.note(*map(np.concatenate, zip(*made, strict=True)), certain=True)
        return through

    def _splice(self, through: list[tuple[ShortCut, GrowingPath]]) -> None:
        """Put paths in place of the parts of the best plan that they cut short, the last first."""
        best, begin = self._best, len(self._best) + 1
        for cut, path in sorted(through, key=lambda one: (one[0].first, one[0].last), reverse=True):
            if cut.last == len(self._best):  # the goal is reached: what was found behind it is not needed
                best, begin = self._best.spliced(cut, path), cut.first
            elif cut.last <= begin:
                best, begin = best.spliced(cut, path), cut.first
        self._keep(best)

    def _pull(self) -> None:
        """Drive along the best plan from one of its states, aiming as far ahead as rides succeed."""
        plan = self._best
        end, begin = len(plan), self._first_of_pull(len(plan))
        rope = self._features(np.array(plan.states))
        reach = FIRST_REACH * 2.0 ** self._rng.uniform(-2.0, 1.0) if self._pulled else FIRST_REACH
        self._pulled = True
        path, anchors = plan.first(begin), [_Anchor(begin, begin, end)]
        while anchors and len(path) < end:
            _, index, last = anchors[-1]
            target = self._farthest(rope, path.states[-1], index, last, reach)
            if target is not None and self._ride(path, rope[target], end - len(path), to_goal=target == end):
                anchors.append(_Anchor(len(path), target, end))
                reach = min(2.0 * reach, MOST_REACH)
            elif target is not None and reach > 1.0:
                reach /= 2.0
            elif (target := self._replay(path, plan, rope, index)) is not None:
                anchors.append(_Anchor(len(path), target, end))
                reach = 2.0
            else:  # what was aimed at before lies behind a wall, for instance
                wrong = anchors.pop().beside
                if anchors:
                    steps, index, _ = anchors[-1]
                    path.cut_to(steps)
                    anchors[-1] = _Anchor(steps, index, (index + wrong) // 2)
                    reach = FIRST_REACH / 2.0
            if anchors and self._at_goal:
                self._keep(path)
                return

    def _first_of_pull(self, steps: int) -> int:
        """Return where a pull begins: at the start, or later where it would use up more than is left."""
        begin = max(0, steps - self._counter.left)
        return begin if self._rng.random() < 0.5 or not self._pulled else int(self._rng.integers(begin, steps))

    def _farthest(self, rope: Array, state: Array, index: int, last: int, reach: float) -> int | None:
        """Return the last index of the plan behind `index`, at most `last`, whose feature is within reach."""
        ahead = rope[index + 1:last + 1]
        near = np.flatnonzero(np.abs(ahead - self._features(state[None])).max(axis=1) <= reach)
        return index + 1 + int(near[-1]) if len(near) else None

    def _ride(self, path: GrowingPath, target: Array, most: int, *, to_goal: bool) -> bool:
        """Drive on towards a feature in bins [F], for at most some steps; return whether it was reached, else undo."""
        first, least, waited = len(path), np.inf, 0
        for _ in range(most + PATIENCE * to_goal + 1):
            away = float(np.abs(target - self._features(path.states[-1][None])[0]).max())
            if away <= BESIDE and not to_goal:
                return True
            waited = 0 if away < least - 1e-9 else waited + 1
            least = min(least, away)
            if waited > PATIENCE or not self._step(path, self._steering.control(path.states[-1], target)):
                break
            if self._at_goal:
                return True
            if np.array_equal(path.states[-1], path.states[-2]):  # blocked
                break
        path.cut_to(first)
        return False

    def _replay(self, path: GrowingPath, plan: GrowingPath, rope: Array, index: int) -> int | None:
        """Apply some of the plan's own controls; return the index they led next to, else undo and return None."""
        first, steps = len(path), int(self._rng.integers(1, LONGEST_REPLAY + 1))
        for control in plan.controls[index:index + steps]:
            if not self._step(path, control):
                break
            if self._at_goal:
                return len(plan)
        made = len(path) - first
        here = self._features(path.states[-1][None])[0]
        if made and made == min(steps, len(plan) - index) and np.abs(here - rope[index + made]).max() <= 2 * BESIDE:
            return index + made
        path.cut_to(first)
        return None

    def _cut(self) -> None:
        """Leave out some controls, or hold one instead, and replay those behind them until the goal."""
        plan, rng = self._best, self._rng
        begin = int(rng.integers(len(plan)))
        width = 1 + int((len(plan) - begin) * rng.random() ** 4)
        path = plan.first(begin)
        held = [self._random_control()] * int(rng.integers(width)) if rng.random() < 0.5 else []
        for control in [*held, *plan.controls[begin + width:]]:
            if not self._step(path, control):
                return
            if self._at_goal:
                self._keep(path)
                return

    def _random_control(self) -> Array:
        """Return a control at a corner, an edge or within the bounds: uniform in twice their size, and clipped."""
        low, high = self._model.action_low, self._model.action_high
        return np.clip((low + high) / 2.0 + (high - low) * self._rng.uniform(-1.0, 1.0, len(low)), low, high)

    def _step(self, path: GrowingPath, control: Array) -> bool:
        """Make one step from the end of a path and append it; return False, and append none, where an episode ends.

        Raises:
            BudgetUsedUp: nothing is left of the allowance.
        """
        before = path.states[-1][None]
        outcome = self._advance(before, control[None])
        self._at_goal = bool(outcome.success[0])
        if outcome.ended[0] and not self._at_goal:
            return False
        path.append(outcome, control[None], 0)
        return True

    def _advance(self, states: Array, controls: Array) -> Transition:
        """Return what follows from states [B, D] under controls [B, A].

        Raises:
            BudgetUsedUp: less is left of the allowance.
        """
        seconds = self._allowance.seconds
        if seconds is not None and time.perf_counter() - self._began >= seconds:
            raise BudgetUsedUp(f"{seconds} seconds are over")
        self._counter.spend(len(states))
        outcome = self._model.transition(states, controls)
        check_finite(states, controls, outcome.states)
        return outcome

    def _features(self, states: Array) -> Array:
        """Return the features [B, F] of states [B, D], in bins."""
        scaled: Array = self._model.feature(states) / self._model.bin_size
        return scaled

    def _keep(self, path: GrowingPath) -> None:
        if len(path) < len(self._best):
            self._best = path
            self._note()

    def _note(self) -> None:
        for name, number in (("transitions", self._counter.count), ("seconds", time.perf_counter() - self._began),
                             ("length", len(self._best))):
            self._progress[name].append(number)
