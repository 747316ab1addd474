"""Rates and values by group hold the numbers they are drawn from."""

import numpy as np
import pytest

from pbcs_ompl.core.statistics import wilson
from pbcs_ompl.figures.by_group import rates_figure, values_figure
from pbcs_ompl.figures.canvas import save


def labels(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def groups(figure):
    return [text.get_text() for text in figure.axes[0].get_xticklabels()]


def test_rates_have_wilson_bars_and_their_n(tmp_path):
    figure = rates_figure({"one": {"2x2": (20, 20), "3x3": (5, 10)}, "other": {"3x3": (0, 5), "4x4": (0, 0)}})
    one, other = figure.axes[0].containers
    assert groups(figure) == ["2x2", "3x3", "4x4"]
    assert labels(figure) == ["one (N = 10 to 20)", "other (N = 5)"]
    assert list(one.lines[0].get_ydata()) == [1.0, 0.5]
    low, high = (end[1] for end in one.lines[2][0].get_segments()[0])
    assert (low, high) == pytest.approx(wilson(20, 20))
    assert list(other.lines[0].get_ydata()) == [0.0]
    assert other.lines[0].get_xdata()[0] == pytest.approx(1, abs=0.3)
    assert save(figure, tmp_path / "rates.png").stat().st_size > 5000


def test_values_are_dots_and_medians(tmp_path):
    figure = values_figure({"one": {"a": [1.0, 2.0, 9.0], "b": []}, "other": {"b": [4.0]}}, log=True, ylabel="cost")
    dots, bars, _, other = figure.axes[0].lines
    assert list(dots.get_ydata()) == [1.0, 2.0, 9.0]
    assert list(bars.get_ydata()) == [2.0]
    assert list(other.get_ydata()) == [4.0]
    assert labels(figure) == ["one (N = 3)", "other (N = 1)"]
    assert figure.axes[0].get_yscale() == "log"
    assert "medians" in figure.axes[0].get_ylabel()
    assert save(figure, tmp_path / "values.png").stat().st_size > 5000


def test_series_of_one_group_stand_side_by_side():
    figure = values_figure({name: {"a": [1.0]} for name in "xyz"})
    places = [line.get_xdata()[0] for line in figure.axes[0].lines[::2]]
    assert np.all(np.diff(places) > 0.1)
    assert np.mean(places) == pytest.approx(0.0)


@pytest.mark.parametrize("draw", [rates_figure, values_figure])
def test_nothing_to_draw_is_a_picture_too(draw, tmp_path):
    assert save(draw({"one": {}}), tmp_path / "empty.png").is_file()
