"""Pictures of comparisons hold the numbers they are drawn from."""

import numpy as np
import pytest

from pbcs_ompl.figures.canvas import save
from pbcs_ompl.figures.compare import coverage_figure, distribution_figure, length_figure


def run(transitions, solved=True, coverage=(0.1, 0.5)):
    progress = {"transitions": [1, transitions], "coverage": list(coverage)}
    return {"solved": solved, "transitions": transitions, "path_length": 7, "improvement": None, "progress": progress}


BROKEN = {"solved": False, "transitions": None, "progress": None}
PLANNERS = {"Ex": [run(10), run(20), run(50, solved=False), run(40)], "EST": [BROKEN, run(50, solved=False)],
            "SST": [BROKEN, BROKEN]}


def test_a_distribution_ends_at_the_solved_share(tmp_path):
    figure = distribution_figure({"maze": PLANNERS}, title="some seeds")
    ex, est, sst = figure.axes[0].lines
    assert ex.get_ydata()[-1] == 0.75
    assert list(ex.get_xdata()[1:-1]) == [10, 20, 40]
    assert list(est.get_ydata()) == list(sst.get_ydata()) == [0, 0]
    assert save(figure, tmp_path / "compare.png").exists()


def test_coverage_is_the_median_run_and_ended_runs_keep_theirs():
    figure = coverage_figure({"maze": {"Ex": [run(10, coverage=(0.0, 0.2)), run(100, coverage=(0.0, 0.4)),
                                              run(1000, coverage=(0.0, 0.8))], "SST": [BROKEN]}})
    (curve,) = figure.axes[0].lines
    assert list(curve.get_xdata()) == [1, 10, 100, 1000]
    assert curve.get_ydata()[-1] == pytest.approx(0.4)
    assert (np.diff(curve.get_ydata()) >= 0).all()


def improved(transitions, lengths, solved=True):
    """Return a run whose plan has the given lengths after 0, 10, 20, ... more transitions than its search."""
    progress = {"transitions": [10 * number for number in range(len(lengths))], "length": list(lengths)}
    note = {"before": lengths[0], "after": lengths[-1], "transitions": 10 * len(lengths), "progress": progress}
    return run(transitions, solved) | {"path_length": lengths[-1], "improvement": note if solved else None}


def test_lengths_are_those_of_the_median_run_and_begin_where_half_of_the_runs_have_a_plan():
    figure = length_figure({"maze": {"Ex": [improved(100, [50, 20]), improved(200, [40, 30, 10]),
                                            improved(900, [99], solved=False)], "SST": [BROKEN]}})
    (curve,) = figure.axes[0].lines
    assert list(curve.get_xdata()) == [200, 210, 220, 230]
    assert list(curve.get_ydata()) == [40, 30, 20, 20]


def test_runs_that_were_not_improved_have_one_length():
    figure = length_figure({"maze": {"Ex": [run(10)]}})
    (curve,) = figure.axes[0].lines
    assert (list(curve.get_xdata()), list(curve.get_ydata())) == ([10], [7])


@pytest.mark.parametrize("draw", [distribution_figure, coverage_figure, length_figure])
@pytest.mark.parametrize(("environments", "panels"), [(1, 1), (2, 2), (4, 4), (7, 7)])
def test_every_environment_has_a_panel(draw, environments, panels):
    figure = draw({f"maze {number}": PLANNERS for number in range(environments)})
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert [axes.get_title() for axes in shown] == [f"maze {number}" for number in range(panels)]
