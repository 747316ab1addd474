"""Curves and slices show the numbers they are given."""

import numpy as np
import pytest

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.diagnostics import curves_figure, stuck_critic_figure, success_figure

STEPS = np.arange(0, 40, 10)


def test_success_is_drawn_with_its_interval(tmp_path):
    success = np.array([[0, 0, 0, 0], [1, 0, 0, 0], [1, 1, 0, 0], [1, 1, 1, 1]]) > 0
    figure = success_figure({"alone": {"ours": (STEPS, success)}, "beside": {"b": (STEPS, success), "ours": (
        STEPS, success)}}, title="two panels")
    axes, beside = figure.axes
    assert beside.lines[1].get_color() == axes.lines[0].get_color() != beside.lines[0].get_color()
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [0.0, 0.25, 0.5, 1.0])
    band = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert (band.min(), band.max()) == pytest.approx((wilson(0, 4)[0], wilson(4, 4)[1]))
    assert "N = 4" in figure.legends[0].get_texts()[0].get_text()
    assert save(figure, tmp_path / "success.png").stat().st_size > 5000


def test_every_seed_has_a_line_in_every_panel():
    figure = curves_figure(STEPS, {"max |Q|": np.ones((4, 3)), "max |π|": np.zeros((4, 3))})
    assert [len(axes.lines) for axes in figure.axes] == [3, 3]


def test_a_critic_is_drawn_whole_in_slices_and_enlarged_with_the_actor_on_top():
    states, actions = np.linspace(0.0, 1.0, 5), np.linspace(-0.1, 0.1, 3)
    values = states[:, None] + 10.0 * actions
    figure = stuck_critic_figure(states, actions, values, np.full(5, 0.05), sliced=(0.02, 0.5))
    whole, slices, enlarged, _ = figure.axes
    np.testing.assert_allclose(whole.collections[0].get_array(), values.T)
    np.testing.assert_array_equal(whole.lines[0].get_ydata(), np.full(5, 0.05))
    for axes in (slices, enlarged):
        np.testing.assert_allclose(axes.lines[2].get_ydata(), values[2])
        assert (axes.lines[3].get_xdata(), axes.lines[3].get_ydata()) == pytest.approx((0.05, 1.0))
    assert [text.get_text() for text in slices.get_legend().get_texts()] == ["s = 0", "s = 0.5"]
    assert enlarged.get_ylim() == pytest.approx((0.5 - 0.06, 1.0 + 0.06))
