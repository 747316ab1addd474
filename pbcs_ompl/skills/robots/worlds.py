"""Worlds in which a robot follows lines: environments that differ in their walls only, and random lines in each."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from pbcs_ompl.core.errors import InvalidOption, Mismatch
from pbcs_ompl.core.interfaces import ResettableModel
from pbcs_ompl.core.robot import PARTS, Robot, missing_parts
from pbcs_ompl.core.seeding import SeedTree
from pbcs_ompl.core.types import Array, BoolArray, IndexArray
from pbcs_ompl.resettable.attributes import EnvAttributes
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.robots.branches import random_branches
from pbcs_ompl.skills.robots.free_space import WIDE, FreeSpace
from pbcs_ompl.skills.robots.lines import Lines
from pbcs_ompl.skills.robots.settings import RobotLineSettings, RobotStartSettings

BODIES = 64
"""Resets from which bodies are taken."""
ROUNDS = 4
"""How often they stumble."""
SPACING = 6
"""Steps between two bodies of a stumble."""


class WorldStep(NamedTuple):
    """What a step led to: states [B, D], observations [B, O], and which episodes ended [B], and terminated [B]."""

    states: Array
    observations: Array
    ended: BoolArray
    terminated: BoolArray


def robot_of(model: ResettableModel) -> Robot:
    """Return the robot that an environment declares.

    Raises:
        Mismatch: it declares none, or not all of one.
    """
    robot = EnvAttributes.of(model.env).robot
    if robot is None:
        raise Mismatch(f"{model.spec.id} declares no robot, so a policy cannot be trained for any line; give the "
                       "environment an attribute `robot` (see docs/environments.md), or train along one plan")
    missing = missing_parts(robot)
    if missing:
        raise Mismatch(f"the robot of {model.spec.id} has no {', '.join(missing)}; expected all of "
                       f"{', '.join(PARTS)} (see docs/environments.md)")
    return robot


def free_space(model: ResettableModel, clearance: float) -> FreeSpace:
    """Return the free space in the plane of the robot's place, with which the explored feature has to begin.

    Raises:
        Mismatch: it begins with something else.
    """
    state = model.initial_state(0)[None]
    place = model.observe(state)[0, list(robot_of(model).place)]
    if not np.array_equal(model.feature(state)[0, :2], place):
        raise Mismatch(f"{model.spec.id} explores {model.feature(state)[0].tolist()} in its first state, where the "
                       f"robot is at {place.tolist()}; lines need a feature that begins with the robot's place")
    return FreeSpace(model.walls, model.feature_low[:2], model.feature_high[:2], clearance)


@dataclass(frozen=True, eq=False)
class Worlds:
    """Models with lines.

    Attributes:
        models: One for each world.
        robot: The same in all of them.
        lines: All lines, those of tests behind those of training.
        world_of: The world of each line [L].
        num_training: How many lines are for training.
        wide: The pointers of each line at which a body has the space to begin.
    """

    models: tuple[ResettableModel, ...]
    robot: Robot
    lines: Lines
    world_of: IndexArray
    num_training: int
    wide: tuple[IndexArray, ...]

    @classmethod
    def of(cls, models: Sequence[ResettableModel], settings: RobotLineSettings, seeds: SeedTree) -> "Worlds":
        """Return worlds with random lines.

        Args:
            models: At least one; their observations and actions are the same.
            settings: Of the lines.
            seeds: Of the random numbers.

        Raises:
            InvalidOption: there is no model, or they differ in more than walls.
            Mismatch: they declare no robot, or explore no plane.
            InvalidState: one has no free space for lines.
        """
        sizes = {(model.observation_size, len(model.action_low), len(model.state_low)) for model in models}
        if len(sizes) != 1:
            raise InvalidOption(f"worlds with observations, actions and states of the sizes {sorted(sizes)}; expected "
                                "environments that differ in their walls only")
        training: list[tuple[int, Line, IndexArray]] = []
        tests: list[tuple[int, Line, IndexArray]] = []
        robot = robot_of(models[0])
        for number, model in enumerate(models):
            space, rng = free_space(model, settings.clearance), seeds.child(f"lines {number}").generator()
            draw = space.random_lines if robot.turning == 0.0 else partial(random_branches, model, robot)
            for kind, count in ((training, settings.lines_per_world), (tests, settings.tests_per_world)):
                drawn = draw(count, rng, longest=settings.longest, spacing=settings.spacing)
                kind += [(number, line, wide_pointers(space, line.points[:, :2])) for line in drawn]
        numbers, lines, wide = zip(*training, *tests, strict=True)
        return cls(tuple(models), robot, Lines.of(lines), np.array(numbers), len(training), wide)

    def step(self, rows: IndexArray, states: Array, controls: Array) -> WorldStep:
        """Make one step of executions on lines.

        Args:
            rows: The line of each [B].
            states: [B, D].
            controls: [B, A].
        """
        after, worlds = np.empty_like(states), self.world_of[rows]
        ended, terminated = np.zeros(len(rows), dtype=np.bool_), np.zeros(len(rows), dtype=np.bool_)
        for world in np.unique(worlds):
            mine = worlds == world
            outcome = self.models[world].transition(states[mine], controls[mine])
            after[mine], ended[mine], terminated[mine] = outcome.states, outcome.ended, outcome.terminated
        return WorldStep(after, self.models[0].observe(after), ended, terminated)


def wide_pointers(space: FreeSpace, points: Array) -> IndexArray:
    """Return the pointers of a line at which a body has the space to begin, without the last tenth; else the first."""
    wide = np.flatnonzero(space.distance(points[:max(1, len(points) * 9 // 10)]) > WIDE * space.clearance)
    return wide if len(wide) else np.zeros(1, dtype=np.int64)


def bodies(model: ResettableModel, settings: RobotStartSettings, seeds: SeedTree) -> tuple[Array, Array, int]:
    """Return states of standing robots and of stumbling ones [N, D], and how many transitions that took.

    The stumbling ones do random actions from the resets, as long as the environment does not end the episode.
    """
    rng = seeds.child("bodies").generator()
    standing = np.array([model.initial_state(seeds.child(f"body {index}").integer()) for index in range(BODIES)])
    found, spent = [], 0
    low, high = model.action_low, model.action_high
    for _ in range(ROUNDS):
        states, controls = standing, np.empty((0, len(low)))
        for step in range(settings.stumbles):
            if step % settings.control_duration == 0:
                controls = rng.uniform(low, high, (len(states), len(low)))
            outcome = model.transition(states, controls[:len(states)])
            spent += len(states)
            states = outcome.states[~outcome.ended]
            if step % SPACING == SPACING - 1:
                found.append(states)
            if not len(states):
                break
    stumbling = np.concatenate([*found, standing]) if sum(map(len, found)) < BODIES else np.concatenate(found)
    return standing, stumbling, spent
