"""FCL's word on walls: the reference for every collision test.

A moving point is one capsule around its segment, never continuous collision detection, which misses walls.
"""

from typing import Any

import fcl
import numpy as np

from pbcs_ompl.core.types import Array, BoolArray

SEGMENT_RADIUS = 1e-9
"""Radius of the capsule around a segment: FCL reports a hit where the segment comes this close to a wall.

With radius 0 FCL misses walls that the end of a segment merely touches. So its answer is on the safe side:
what touches a wall is a hit, and what stays 2e-9 away is none.
"""
SCALE = 2.0**14
"""FCL works in lengths that are this many times larger: it misses overlaps below about 1e-7.

Without it one in twenty segments that graze a corner is missed. A power of two keeps every bit of the coordinates.
"""


class WallsFcl:
    """Walls as FCL boxes.

    Args:
        rectangles: Walls [W, 4] (x0, y0, x1, y1).
    """

    def __init__(self, rectangles: Array):
        self.rectangles = rectangles
        self._boxes = [_box(*rectangle) for rectangle in rectangles]
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects(self._boxes)
        self._manager.setup()
        self._request = fcl.CollisionRequest()
        self._point = fcl.CollisionObject(fcl.Sphere(0.0), fcl.Transform())

    def __reduce__(self) -> tuple[Any, ...]:
        return WallsFcl, (self.rectangles,)

    def contains(self, points: Array) -> BoolArray:
        """Return which points [B, 2] lie in a wall, its border included [B].

        The point is a sphere of radius 0, which FCL tests against a box to the last bit of the box's pose.
        """
        inside = np.empty(len(points), dtype=np.bool_)
        place = np.zeros(3)
        for k, point in enumerate(points):
            place[:2] = SCALE * point
            self._point.setTranslation(place)
            inside[k] = self._collides(self._point)
        return inside

    def overlaps(self, poses: Array, half_edges: tuple[float, float]) -> BoolArray:
        """Return which rectangles overlap a wall [B].

        Args:
            poses: Centres and angles [B, 3] (x, y, angle).
            half_edges: Half of their edges, along the angle and across.
        """
        along, across = half_edges
        body = fcl.CollisionObject(fcl.Box(2 * SCALE * along, 2 * SCALE * across, SCALE), fcl.Transform())
        found = np.empty(len(poses), dtype=np.bool_)
        for k, (x, y, angle) in enumerate(poses.tolist()):
            c, s = np.cos(angle), np.sin(angle)
            body.setTransform(fcl.Transform(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]),
                                            np.array([SCALE * x, SCALE * y, 0.0])))
            found[k] = self._collides(body)
        return found

    def hit_by(self, starts: Array, ends: Array) -> BoolArray:
        """Return which segments from starts [B, 2] to ends [B, 2] touch a wall [B]."""
        return np.array([self.segment_hits(p, q) for p, q in zip(starts, ends, strict=True)], dtype=np.bool_)

    def segment_hits(self, start: Array, end: Array) -> bool:
        """Return whether the segment from start [2] to end [2] touches a wall."""
        start, end = SCALE * np.asarray(start), SCALE * np.asarray(end)
        along = end - start
        length = float(np.hypot(*along))
        x, y = along / length if length > 0.0 else (1.0, 0.0)
        rotation = np.array([[0.0, y, x], [0.0, -x, y], [1.0, 0.0, 0.0]])  # z, the axis, to (x, y)
        middle = np.array([*(start + end) / 2.0, 0.0])
        capsule = fcl.CollisionObject(fcl.Capsule(SCALE * SEGMENT_RADIUS, length), fcl.Transform(rotation, middle))
        return self._collides(capsule)

    def _collides(self, moving: Any) -> bool:
        data = fcl.CollisionData(request=self._request)  # new each time: FCL does not reset its result
        self._manager.collide(moving, data, fcl.defaultCollisionCallback)
        return bool(data.result.is_collision)


def _box(x0: float, y0: float, x1: float, y1: float) -> Any:
    x0, y0, x1, y1 = SCALE * x0, SCALE * y0, SCALE * x1, SCALE * y1
    centre = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0])
    return fcl.CollisionObject(fcl.Box(x1 - x0, y1 - y0, SCALE), fcl.Transform(centre))
