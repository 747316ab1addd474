"""What a robot's follower sees: its body and the line ahead in its own frame, from the side that leads."""

from dataclasses import dataclass

import numpy as np

from pbcs_ompl.core.robot import Robot
from pbcs_ompl.core.types import Array, IndexArray
from pbcs_ompl.skills.path_following.follower import Progress
from pbcs_ompl.skills.path_following.line import Line
from pbcs_ompl.skills.policy import ObservationTransform
from pbcs_ompl.skills.robots.lines import Lines
from pbcs_ompl.skills.robots.places import dimensions, places_of

KEEP_SIDE = np.pi / 3
"""A side leads as long as the line is less than this off its heading (ours): halfway between two sides is no border."""
LARGEST = 10.0
"""Bound of the inputs of a policy (ours)."""


@dataclass(frozen=True, eq=False)
class RobotView:
    """The body in its own frame, the line some distances ahead, and how long there was no progress, side by side.

    A robot with several symmetries has as many sides. The one that leads looks along the line: the policy sees the
    robot as if that were its front, and so needs to know one direction only.

    Attributes:
        robot: What the environment declares.
        normaliser: Of the body, that is the observation in its own frame without the place [O - 2].
        distances: How far the policy looks ahead along the line, lengths [K].
        window: The longest move of a pointer in a step, a length.
        patience: Steps without progress after which training gives up.
    """

    robot: Robot
    normaliser: ObservationTransform
    distances: Array
    window: float
    patience: int

    @property
    def size(self) -> int:
        """Number I of inputs."""
        return len(self.normaliser.origin) + dimensions(self.robot) * len(self.distances) + 1

    def places(self, observations: Array) -> Array:
        """Return the places [B, F] on lines that observations [B, O] show."""
        return places_of(self.robot, observations)

    def leading(self, observations: Array, line: Line | Lines, progress: Progress, before: IndexArray) -> IndexArray:
        """Return which side leads now [B].

        Args:
            observations: [B, O].
            line: The line, or that of each.
            progress: On it.
            before: The side that led before [B]; -1 where none did.
        """
        if len(self.robot.symmetries) == 1:
            return np.zeros(len(observations), dtype=np.int64)
        far = line.ahead(self.places(observations), progress.pointers, np.median(self.distances, keepdims=True))[:, 0]
        direction = np.arctan2(far[:, 1], far[:, 0])
        headings = np.stack([self.robot.heading(observations @ one.observation.T) for one in self.robot.symmetries])
        off = np.abs(np.angle(np.exp(1j * (direction - headings))))
        kept = np.take_along_axis(off, np.maximum(before, 0)[None], axis=0)[0] <= KEEP_SIDE
        return np.where(kept & (before >= 0), before, off.argmin(axis=0))

    def body(self, observations: Array, sides: IndexArray) -> tuple[Array, Array]:
        """Return the bodies [B, O - 2] in their own frames, and their headings [B]."""
        seen = observations.copy()
        for side in np.unique(sides):
            mine = sides == side
            seen[mine] = observations[mine] @ self.robot.symmetries[side].observation.T
        headings = self.robot.heading(seen)
        return np.delete(self.robot.turned(seen, -headings), self.robot.place, axis=1), headings

    def inputs(self, observations: Array, line: Line | Lines, progress: Progress, sides: IndexArray) -> Array:
        """Return the inputs [B, I] of a policy.

        Args:
            observations: [B, O].
            line: The line, or that of each.
            progress: On it.
            sides: Those that lead [B].
        """
        body, headings = self.body(observations, sides)
        ahead = line.ahead(self.places(observations), progress.pointers, self.distances)
        c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
        x, y = ahead[..., 0], ahead[..., 1]
        turned = np.stack([c * x + s * y, c * y - s * x], axis=2)
        own = np.concatenate([turned, ahead[..., 2:]], axis=2).reshape(len(observations), -1)
        stalled = np.minimum(progress.stalled / self.patience, 1.0)[:, None]
        inputs: Array = np.clip(np.concatenate([self.normaliser(body), own, stalled], axis=1), -LARGEST, LARGEST)
        return inputs

    def controls(self, actions: Array, sides: IndexArray) -> Array:
        """Return the controls [B, A] of the robot for the actions of a policy that sees it from these sides [B]."""
        controls = actions.copy()
        for side in np.unique(sides):
            mine = sides == side
            controls[mine] = actions[mine] @ self.robot.symmetries[side].action
        return controls
