"""Pictures: drawn without a display, whole on disk, and true to the arrays they are given."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.core.errors import Mismatch, RunFolderError
from pbcs_ompl.figures.canvas import new_figure, save
from pbcs_ompl.figures.chain import chain_figure
from pbcs_ompl.figures.critic import critic_figure
from pbcs_ompl.figures.maze import project_2d
from pbcs_ompl.figures.tree import MOST_EDGES, depth, tree_figure


class Plane:
    """A 2x2 square with one wall and states (x, y): the parts of a model that pictures look at."""

    spec = EnvSpec("Plane")
    state_low = feature_low = np.zeros(2)
    state_high = feature_high = np.full(2, 2.0)
    walls = np.array([[0.9, 0.0, 1.1, 1.0]])
    goal_circle = (1.5, 0.5, 0.2)

    def feature(self, states):
        return states[:, :2]

    def observe(self, states):
        return states

    def is_valid(self, states):
        return ~((states[:, 0] > 0.9) & (states[:, 0] < 1.1) & (states[:, 1] < 1.0))


class Corridor(Plane):
    """One dimension: nothing that could be drawn in a plane."""

    state_low = feature_low = np.zeros(1)
    state_high = feature_high = np.ones(1)


class PhasePlane(Plane):
    """A position, and a speed that is far smaller; neither walls nor a disc to reach."""

    feature_high = np.array([2.0, 0.1])
    walls, goal_circle = np.zeros((0, 4)), None


@pytest.fixture
def walk():
    return np.cumsum(np.random.default_rng(0).uniform(0, 0.1, (30, 2)), axis=0)


def parent_arrays():
    return st.integers(1, 60).flatmap(
        lambda n: st.tuples(*[st.integers(-1 if i == 0 else 0, max(i - 1, -1)) for i in range(n)])).map(
        lambda parents: np.array([-1, *parents[1:]]))


@given(parent_arrays())
def test_depth_is_one_more_than_the_parents(parents):
    depths = depth(parents)
    assert depths[0] == 0
    for node, parent in enumerate(parents[1:], start=1):
        assert depths[node] == depths[parent] + 1


def test_depth_of_a_long_chain_and_of_several_roots():
    assert np.array_equal(depth(np.arange(-1, 4999)), np.arange(5000))
    assert np.array_equal(depth(np.array([-1, -1, 1])), [0, 0, 1])


def test_tree_has_one_line_for_each_edge(walk):
    figure = tree_figure(Plane(), walk, np.arange(-1, 29), path=walk, title="a tree")
    (edges,) = [c for c in figure.axes[0].collections if c.get_array() is not None]
    assert len(edges.get_segments()) == 29
    assert np.array_equal(edges.get_array(), np.arange(1, 30))
    assert figure.axes[0].get_aspect() == 1


def test_large_tree_is_thinned_and_says_so():
    count = MOST_EDGES + 10
    figure = tree_figure(Plane(), np.random.default_rng(0).uniform(0, 2, (count, 2)), np.arange(-1, count - 1))
    assert "edges drawn" in figure.axes[0].get_title()


def test_a_tree_without_path_and_goal_needs_no_legend(walk, recwarn):
    """An environment without a goal, and nothing found: the picture has nothing to explain."""
    model = Plane()
    model.goal_circle = None
    tree_figure(model, walk, np.arange(-1, 29))
    assert not recwarn.list


def test_tree_of_a_single_node_is_drawn(tmp_path, walk):
    assert save(tree_figure(Plane(), walk[:1], np.array([-1])), tmp_path / "one.png").stat().st_size > 1000


def test_chain_shows_each_activation_set(tmp_path, walk):
    sets = [(walk[0], 0.1), (walk[10], 0.2)]
    figure = chain_figure(Plane(), trajectory=walk, rollout=walk[::2], activations=sets, title="a chain")
    circles = [patch for patch in figure.axes[0].patches if patch.get_label() != "goal"]
    assert [circle.get_radius() for circle in circles] == [0.1, 0.2]
    assert save(figure, tmp_path / "chain.png").read_bytes().startswith(b"\x89PNG")


def test_critic_field_holds_the_values_of_the_critic(tmp_path, walk):
    figure = critic_figure(Plane(), np.ones_like, lambda o, a: o[:, 0] + 10 * o[:, 1], rollout=walk)
    values = figure.axes[0].images[0].get_array()
    low, high = 2 / 240, 2 - 2 / 240
    assert values[0, 0] == pytest.approx(11 * low)
    assert values[0, -1] == pytest.approx(high + 10 * low)
    assert values[-1, 0] == pytest.approx(low + 10 * high)
    assert save(figure, tmp_path / "critic.png").exists()


def test_no_plane_is_a_clear_error():
    with pytest.raises(Mismatch, match="two feature dimensions"):
        chain_figure(Corridor(), trajectory=None, rollout=None, activations=[])


def test_a_failed_write_leaves_nothing_and_says_why(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="cannot write"):
        save(new_figure()[0], tmp_path / "file" / "picture.png")
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_plane_takes_one_state_or_many(walk):
    assert np.array_equal(project_2d(Plane(), walk[3]), walk[3:4])
    assert np.array_equal(project_2d(Plane(), walk), walk)


def test_dimensions_of_unlike_units_have_scales_of_their_own_and_a_path_an_end(walk):
    parents = np.arange(len(walk)) - 1
    plane, phases = (tree_figure(model, walk, parents, path=walk).axes[0] for model in (Plane(), PhasePlane()))
    assert (plane.get_aspect(), phases.get_aspect()) == (1.0, "auto")
    assert "its end" in phases.get_legend_handles_labels()[1]
    assert "its end" not in plane.get_legend_handles_labels()[1], "the goal is drawn"
