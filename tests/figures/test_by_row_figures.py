"""Rows hold the numbers they are drawn from."""

import pytest

from pbcs_ompl.core.statistics import median_interval, wilson
from pbcs_ompl.figures.by_row import rows_figure


def test_rows_are_named_once_and_hold_rates_and_medians():
    figure = rows_figure({"solved": {"2x2": {"first": (1, 4), "second": (0, 0)}, "3x3": {"second": (2, 2)}}},
                         {"cost": {"2x2": {"first": [1.0, 2.0, 9.0], "second": []}}})
    rates, values = figure.axes
    assert [text.get_text() for text in rates.get_yticklabels()] == ["first", "second"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["2x2 (N = 0 to 4)", "3x3 (N = 2)"]
    bar, other = (lines.get_segments()[0] for lines in rates.collections)
    assert tuple(bar[:, 0]) == pytest.approx(wilson(1, 4))
    assert bar[0, 1] == pytest.approx(0.0, abs=0.3)
    assert (tuple(other[:, 0]), round(other[0, 1])) == (pytest.approx(wilson(2, 2)), 1)
    dots, median = values.lines
    assert list(dots.get_xdata()) == [1.0, 2.0, 9.0]
    assert list(median.get_xdata()) == [2.0]
    assert tuple(values.collections[0].get_segments()[0][:, 0]) == pytest.approx(median_interval([1.0, 2.0, 9.0]))
