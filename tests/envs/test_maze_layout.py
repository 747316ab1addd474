"""Laws of the layouts: spanning trees, drawings that come back, few rectangles that cover the same walls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.envs.maze.layout import MazeLayout, passages_of, recursive_backtracker


@given(size=st.integers(2, 12), seed=st.integers(0, 2**31))
@settings(max_examples=30, deadline=None)
def test_a_generated_maze_is_a_spanning_tree(size: int, seed: int) -> None:
    passages = recursive_backtracker(size, np.random.default_rng(seed))
    assert len(passages) == size * size - 1
    assert all(abs(i - k) + abs(j - m) == 1 for (i, j), (k, m) in passages)
    reached = {(0, 0)}
    for a, b in passages:
        assert a in reached
        assert b not in reached
        reached.add(b)
    assert len(reached) == size * size


@given(size=st.integers(2, 12), seed=st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_a_drawing_comes_back(size: int, seed: int) -> None:
    layout = MazeLayout.from_size(size, seed)
    again = MazeLayout.from_drawing(layout.draw({(0, 0): "A", (1, 0): "G"}))
    np.testing.assert_array_equal(layout.rectangles, again.rectangles)
    assert again.draw() == layout.draw()


@given(size=st.integers(2, 10), seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_merged_rectangles_cover_exactly_the_walls(size: int, seed: int) -> None:
    layout = MazeLayout.from_size(size, seed)
    single = [(i - 0.05, j - 0.05, i + 0.05, j + 1.05) for i, j in np.argwhere(layout.vertical)]
    single += [(i - 0.05, j - 0.05, i + 1.05, j + 0.05) for i, j in np.argwhere(layout.horizontal)]
    points = np.random.default_rng(seed).uniform(-0.2, size + 0.2, (2000, 2))
    np.testing.assert_array_equal(_covered(points, layout.rectangles), _covered(points, np.array(single)))
    assert len(layout.rectangles) <= len(single)


def _covered(points: np.ndarray, rectangles: np.ndarray) -> np.ndarray:
    low, high = rectangles[:, :2], rectangles[:, 2:]
    return ((points[:, None] >= low) & (points[:, None] <= high)).all(axis=2).any(axis=1)


def test_the_seed_makes_the_maze_and_nothing_else() -> None:
    assert passages_of(7, 3) == passages_of(7, 3)
    assert passages_of(7, 3) != passages_of(7, 4)
    for fixed in (2, 3):
        assert passages_of(fixed, 3) == passages_of(fixed, 4)


def test_the_fixed_mazes_of_the_thesis() -> None:
    assert MazeLayout.from_size(2).draw() == ["+-+-+", "|   |", "+-+ +", "|   |", "+-+-+"]
    assert MazeLayout.from_size(3).draw() == [
        "+-+-+-+", "|     |", "+ +-+-+", "|     |", "+-+-+ +", "|     |", "+-+-+-+"]


def test_the_largest_maze_has_few_rectangles() -> None:
    layout = MazeLayout.from_size(50, 1)
    borders = int(layout.vertical.sum() + layout.horizontal.sum())
    assert len(layout.rectangles) < borders / 2


@pytest.mark.parametrize("size", [0, 1, -3, 51, 10_000, 2.0, "3", None, True])
def test_sizes_out_of_range(size: object) -> None:
    with pytest.raises(InvalidOption, match="from 2 to 50"):
        MazeLayout.from_size(size)  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", [-1, 0.5, "1"])
def test_seeds_out_of_range(seed: object) -> None:
    with pytest.raises(InvalidOption, match="maze_seed"):
        MazeLayout.from_size(5, seed)  # type: ignore[arg-type]


@pytest.mark.parametrize(("drawing", "complaint"), [
    ("+-+", "list of strings"),
    ([1, 2, 3], "list of strings"),
    (["+-+", "| |", "+-+"], "2 \\* size \\+ 1"),
    (["+-+-+", "|   |", "+-+ +", "|  |", "+-+-+"], "5 characters in row 3"),
    (["+-+-+", "|   |", "+#+ +", "|   |", "+-+-+"], "got '#'"),
    (["+-+ +", "|   |", "+-+ +", "|   |", "+-+-+"], "outer walls"),
])
def test_damaged_drawings(drawing: list[str], complaint: str) -> None:
    with pytest.raises(InvalidOption, match=complaint):
        MazeLayout.from_drawing(drawing)
