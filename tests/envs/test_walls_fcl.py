"""FCL and the kernel hold each other: thin walls, grazing passes, touching ends."""

import copy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.envs.maze import kernels
from pbcs_ompl.envs.maze.layout import MazeLayout
from pbcs_ompl.envs.walls_fcl import SEGMENT_RADIUS, WallsFcl

THICKNESSES = (1e-4, 1e-3, 0.1)
SLACK = 2.0 * SEGMENT_RADIUS

offset = st.sampled_from([0.0, 1e-3, -1e-3, 1e-6, -1e-6, 1e-8, -1e-8, 1e-10, -1e-10])
place = st.floats(-0.15, 0.15).map(lambda x: round(x, 3))
at_edge = st.sampled_from([-1.0, 1.0])


def wall(thickness: float) -> np.ndarray:
    return np.array([[-thickness / 2, -0.1, thickness / 2, 0.1]])


def kernel_hits(p: np.ndarray, q: np.ndarray, rectangle: np.ndarray, grown: float = 0.0) -> bool:
    left, bottom, right, top = rectangle
    return kernels.hits_rectangle(*p, *q, left - grown, bottom - grown, right + grown, top + grown)


def assert_agreement(p: np.ndarray, q: np.ndarray, rectangles: np.ndarray) -> None:
    """What touches a wall is a hit for both; what FCL hits comes within its capsule's radius of a wall."""
    fcl_hits = WallsFcl(rectangles).segment_hits(p, q)
    if any(kernel_hits(p, q, rectangle) for rectangle in rectangles):
        assert fcl_hits
    elif fcl_hits:
        assert any(kernel_hits(p, q, rectangle, grown=SLACK) for rectangle in rectangles)


@given(st.sampled_from(THICKNESSES), place, place, place, place)
@settings(max_examples=150, deadline=None)
def test_segments_near_a_wall(thickness: float, x0: float, y0: float, x1: float, y1: float) -> None:
    assert_agreement(np.array([x0, y0]), np.array([x1, y1]), wall(thickness))


@given(st.sampled_from(THICKNESSES), at_edge, offset, place, place)
@settings(max_examples=150, deadline=None)
def test_segments_that_end_at_a_face(thickness: float, side: float, gap: float, y: float, run: float) -> None:
    end = np.array([side * (thickness / 2 + gap), y])
    assert_agreement(end + np.array([side * 0.07, run]), end, wall(thickness))


@given(st.sampled_from(THICKNESSES), at_edge, at_edge, offset, st.floats(0.01, 3.0), st.floats(0.05, 0.95))
@settings(max_examples=150, deadline=None)
def test_segments_that_graze_a_corner(thickness: float, right: float, up: float, gap: float, steepness: float,
                                      part: float) -> None:
    corner = np.array([right * (thickness / 2 + gap), up * (0.1 + gap)])
    along = np.array([right, -up * steepness]) / np.hypot(1.0, steepness) * 0.1
    assert_agreement(corner - part * along, corner + (1.0 - part) * along, wall(thickness))


@pytest.mark.parametrize("thickness", THICKNESSES)
def test_segments_that_just_touch_a_corner(thickness: float) -> None:
    """FCL in the maze's own lengths misses a part of these, most of the long flat ones."""
    rng = np.random.default_rng(0)
    walls, rectangle = WallsFcl(wall(thickness)), wall(thickness)[0]
    signs, parts = rng.choice([-1.0, 1.0], (300, 2)), rng.uniform(0.05, 0.95, 300)
    along = signs * np.array([1.0, -0.01]) * 0.1
    starts = signs * rectangle[2:] - parts[:, None] * along
    touches = np.array([kernel_hits(p, q, rectangle) for p, q in zip(starts, starts + along, strict=True)])
    assert touches.sum() > 100
    assert walls.hit_by(starts, starts + along)[touches].all()


def test_segments_in_a_maze() -> None:
    rectangles = MazeLayout.from_size(6, 4).rectangles
    walls = WallsFcl(rectangles)
    rng = np.random.default_rng(0)
    starts = rng.uniform(0.0, 6.0, (500, 2))
    ends = starts + rng.uniform(-0.1, 0.1, starts.shape)
    expected = [any(kernel_hits(p, q, r) for r in rectangles) for p, q in zip(starts, ends, strict=True)]
    np.testing.assert_array_equal(walls.hit_by(starts, ends), expected)


@pytest.mark.parametrize("thickness", THICKNESSES)
def test_points_are_tested_to_the_last_bits(thickness: float) -> None:
    rectangle = wall(thickness)
    walls = WallsFcl(rectangle)
    left, bottom, right, top = rectangle[0]
    inside = np.array([[0.0, 0.0], [left, 0.0], [right, top], [left, bottom], [0.0, top]])
    assert walls.contains(inside).all()
    left, bottom, right, top = rectangle[0] + np.array([-1.0, -1.0, 1.0, 1.0]) * 1e-15
    outside = np.array([[left, 0.0], [right, 0.0], [0.0, top], [right, bottom]])
    assert not walls.contains(outside).any()


@given(st.integers(0, 2**31))
@settings(max_examples=10, deadline=None)
def test_points_agree_with_the_kernel(seed: int) -> None:
    rectangles = MazeLayout.from_size(4, seed).rectangles
    points = np.random.default_rng(seed).uniform(-0.1, 4.1, (100, 2))
    expected = [any(kernel_hits(p, p, r) for r in rectangles) for p in points]
    np.testing.assert_array_equal(WallsFcl(rectangles).contains(points), expected)


def test_a_copy_is_independent_and_equal() -> None:
    walls = WallsFcl(MazeLayout.from_size(3).rectangles)
    other = copy.deepcopy(walls)
    points = np.random.default_rng(0).uniform(0, 3, (50, 2))
    np.testing.assert_array_equal(walls.contains(points), other.contains(points))
