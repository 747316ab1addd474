"""Curves and slices show the numbers they are given."""

import numpy as np
import pytest

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.diagnostics import critic_map_figure, curves_figure, slices_figure, success_figure

STEPS = np.arange(0, 40, 10)


def test_success_is_drawn_with_its_interval(tmp_path):
    success = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [1, 1, 0, 0], [1, 1, 1, 1]]) > 0
    figure = success_figure({"ours": (STEPS, success)}, title="a curve")
    (axes,) = figure.axes
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [0.0, 0.25, 0.5, 1.0])
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == pytest.approx((wilson(0, 4)[0], wilson(4, 4)[1]))
    assert "N = 4" in figure.legends[0].get_texts()[0].get_text()
    assert save(figure, tmp_path / "success.png").stat().st_size > 5000


def test_every_seed_has_a_line_in_every_panel():
    figure = curves_figure(STEPS, {"max |Q|": np.ones((4, 3)), "max |π|": np.zeros((4, 3))})
    assert [len(axes.lines) for axes in figure.axes] == [3, 3]


def test_a_slice_has_a_dot_where_the_actor_is():
    actions = np.linspace(-0.1, 0.1, 5)
    figure = slices_figure(actions, {"s = 0": 2.0 * actions}, {"s = 0": 0.025}, ylim=(-1.0, 1.0))
    (axes,) = figure.axes
    assert (axes.lines[1].get_xdata(), axes.lines[1].get_ydata()) == pytest.approx((0.025, 0.05))
    assert axes.get_ylim() == (-1.0, 1.0)


def test_a_map_of_a_critic_has_its_values_where_they_belong_and_the_actor_on_top():
    states, actions = np.linspace(0.0, 1.0, 4), np.linspace(-0.1, 0.1, 3)
    values = states[:, None] + 10.0 * actions
    figure = critic_map_figure(states, actions, values, np.full(4, 0.1))
    axes = figure.axes[0]
    np.testing.assert_allclose(axes.collections[0].get_array(), values.T)
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), np.full(4, 0.1))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("state", "action")
