"""Lines: a loop over executions gives the same, and the laws that a follower relies on."""

from dataclasses import replace

import numpy as np
import pytest

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.skills.path_following.line import Line, arc_lengths, erase_loops, unwrapped

CORNERS = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]])


@pytest.fixture
def line() -> Line:
    return Line.through(CORNERS, 0.3)


def one_step(line: Line, feature: np.ndarray, pointer: int, window: float) -> int:
    """The definition, for one execution."""
    best = pointer
    nearest = before = np.inf
    for place in range(pointer, min(pointer + max(1, round(window / line.spacing)), line.last) + 1):
        distance = float(np.linalg.norm(line.points[place] - feature))
        if distance > before and distance > line.pass_radius:
            break
        before = distance
        if distance < nearest:
            best, nearest = place, distance
    return best


def test_points_are_evenly_spaced_along_the_line(line: Line) -> None:
    assert line.length == pytest.approx(8.0)
    assert line.spacing == pytest.approx(0.3, rel=0.1)
    np.testing.assert_allclose(line.points[[0, -1]], CORNERS[[0, -1]])
    straight = np.linalg.norm(np.diff(line.points, axis=0), axis=1)
    assert (straight <= line.spacing * (1 + 1e-12)).all()
    assert np.median(straight) == pytest.approx(line.spacing)


@pytest.mark.parametrize("pass_radius", [np.inf, 1.0, 0.1])
def test_a_batch_advances_as_one_execution_after_the_other(line: Line, pass_radius: float) -> None:
    line = replace(line, pass_radius=pass_radius)
    rng = np.random.default_rng(0)
    features = rng.uniform(-0.5, 3.5, (200, 2))
    pointers = rng.integers(0, line.last + 1, 200)
    for window in (0.01, 1.0, 100.0):
        expected = [one_step(line, feature, int(pointer), window)
                    for feature, pointer in zip(features, pointers, strict=True)]
        assert line.advance(features, pointers, window).tolist() == expected


def test_a_pointer_never_moves_back_nor_further_than_the_window(line: Line) -> None:
    rng = np.random.default_rng(1)
    pointers = np.zeros(50, dtype=np.int64)
    for _ in range(30):
        moved = line.advance(rng.uniform(-1.0, 4.0, (50, 2)), pointers, 1.0)
        assert (moved >= pointers).all()
        assert (moved <= np.minimum(pointers + round(1.0 / line.spacing), line.last)).all()
        pointers = moved
    assert (pointers == line.last).any()


def test_the_window_keeps_a_pointer_on_its_side_of_a_bend(line: Line) -> None:
    near_both = np.array([[1.0, 1.1]])  # nearer to the way back than to the way there
    start = line.pointer_at(np.array([1.0]))
    assert line.points[line.advance(near_both, start, 1.0)[0], 1] == 0.0
    assert line.points[line.advance(near_both, start, 100.0)[0], 1] == 2.0


def test_a_pointer_does_not_pass_the_end_of_a_wall_that_the_execution_has_not_passed() -> None:
    """The line leads around the end of a wall, which is at (3, 1); what is beyond it is nearer than the end."""
    around = np.array([[0.0, 0.9], [3.1, 0.9], [3.1, 1.1], [0.0, 1.1]])
    line, behind = Line.through(around, 0.1, pass_radius=0.5), np.array([[2.2, 1.02]])
    there, back = line.pointer_at(np.array([2.2, 4.2]))
    assert replace(line, pass_radius=np.inf).advance(behind, np.array([there]), 4.0)[0] == back
    assert line.advance(behind, np.array([there]), 4.0)[0] == there
    near = np.array([[2.9, 1.02]])
    assert line.points[line.advance(near, np.array([there]), 4.0)[0], 1] == pytest.approx(1.1)


def test_points_ahead_are_relative_and_end_at_the_end(line: Line) -> None:
    here = np.array([[0.0, 0.0], [0.5, 2.0]])
    pointers = np.array([0, line.last - 1])
    seen = line.ahead(here, pointers, np.array([0.0, 0.9, 1000.0]))
    assert seen.shape == (2, 3, 2)
    np.testing.assert_allclose(seen[0, :2, 0], [0.0, 3 * line.spacing])
    np.testing.assert_allclose(seen[:, 2], CORNERS[-1] - here)
    np.testing.assert_allclose(seen[1, 1], CORNERS[-1] - here[1])


def test_whole_periods_change_nothing() -> None:
    """An angle of period 3 beside a place: the line turns twice, executions count their turns as they like."""
    periods, rng = np.array([0.0, 3.0]), np.random.default_rng(3)
    way = np.stack([np.linspace(0.0, 2.0, 41), np.linspace(0.0, 6.0, 41)], axis=1)
    wrapped = way - [0.0, 3.0] * np.rint(way / [1.0, 3.0])
    assert np.abs(np.diff(wrapped, axis=0)).max() > 2.0
    np.testing.assert_allclose(unwrapped(wrapped, periods), way)
    line = Line.through(way, 0.1, 0.5, periods)
    pointers = rng.integers(0, line.last, 100)
    here = line.points[pointers] + rng.uniform(-0.3, 0.3, (100, 2))
    elsewhere = here + periods * rng.integers(-3, 4, (100, 1))
    plain = replace(line, periods=None)
    assert line.advance(elsewhere, pointers, 1.0).tolist() == plain.advance(here, pointers, 1.0).tolist()
    ahead = line.ahead(elsewhere, pointers, np.array([0.0, 0.5]))
    np.testing.assert_allclose(ahead, plain.ahead(here, pointers, np.array([0.0, 0.5])))
    loop = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [0.0, 3.05], [1.0, 3.05]])
    assert erase_loops(loop, 0.1, periods).tolist() == [0, 3, 4]
    assert erase_loops(loop, 0.1).tolist() == [0, 1, 2, 3, 4]


def test_loops_are_erased() -> None:
    there, loop = np.linspace(0, 1, 11), np.linspace(1, 3, 21)
    walk = np.concatenate([there, loop[1:], loop[::-1][1:], there[::-1][1:6]])
    plan = np.stack([walk, np.zeros_like(walk)], axis=1)
    kept = erase_loops(plan, 0.11)
    assert kept[0] == 0
    assert kept[-1] == len(plan) - 1
    assert (np.diff(kept) > 0).all()
    assert plan[kept].max() <= 0.5 + 1e-9
    assert arc_lengths(plan[kept])[-1] == pytest.approx(0.5)


def test_a_hop_is_short_in_every_dimension_or_one_of_the_plan() -> None:
    rng = np.random.default_rng(2)
    plan = np.cumsum(rng.normal(0, 0.1, (300, 3)), axis=0)
    gap = np.array([0.1, 0.2, 0.3])
    kept = erase_loops(plan, gap)
    hops = np.abs(np.diff(plan[kept], axis=0))
    assert ((hops <= gap).all(axis=1) | (np.diff(kept) == 1)).all()
    assert len(kept) < len(plan)
    assert erase_loops(plan, 0.0).tolist() == list(range(300))


def test_a_line_of_no_length_stays_where_it_is() -> None:
    line = Line.through(np.ones((4, 2)), 0.5)
    assert (line.last, line.length) == (0, 0.0)
    here, pointers = np.zeros((3, 2)), np.zeros(3, dtype=np.int64)
    assert line.advance(here, pointers, 1.0).tolist() == [0, 0, 0]
    np.testing.assert_array_equal(line.ahead(here, pointers, np.array([1.0])), np.ones((3, 1, 2)))
    assert line.pointer_at(np.array([7.0])).tolist() == [0]


def test_a_line_needs_finite_corners_and_a_spacing() -> None:
    for corners in (np.empty((0, 2)), np.zeros(3), np.array([[np.nan, 0.0]])):
        with pytest.raises(InvalidOption, match="expected finite ones"):
            Line.through(corners, 0.1)
    for spacing in (0.0, -1.0, np.nan):
        with pytest.raises(InvalidOption, match="expected greater than 0"):
            Line.through(np.zeros((2, 2)), spacing)
