"""Laws of the rows: censored medians, intervals that contain the rate."""

from hypothesis import given
from hypothesis import strategies as st

from pbcs_ompl.experiments.planner_statistics import row
from pbcs_ompl.experiments.planning_run import Job, broken

JOB = Job("1-Maze-v0/P-0", "P", 0, "env", {}, {}, 1000, None)


def record(solved, transitions=10, seconds=1.0):
    return {**broken(JOB, ""), "solved": solved, "transitions": transitions, "seconds": seconds, "reason": None,
            "collision_checks": 2 * transitions, "path_length": 5 if solved else None, "coverage": 0.5}


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 1000)), min_size=1, max_size=20))
def test_rows_hold_together(runs):
    summary = row("P", [record(solved, transitions) for solved, transitions in runs], 1000)
    low, high = summary["wilson"]
    assert 0 <= low <= summary["solved"] / summary["runs"] <= high <= 1
    first, third = summary["transitions_quartiles"]
    assert first <= summary["transitions_median"] <= third <= 1000
    if 2 * summary["solved"] < len(runs):
        assert summary["transitions_median"] == 1000
    assert summary["path_length_median"] == (5 if summary["solved"] else None)


def test_unsolved_runs_count_as_the_whole_budget():
    runs = [record(True, 100), record(True, 300), record(False, 500)]
    assert row("P", runs, 1000)["transitions_median"] == 300
    assert row("P", [*runs, record(False, 500)], 1000)["transitions_median"] == 650
    assert row("P", runs, 1000)["collision_checks_median"] == 600


def test_failed_runs_have_no_seconds_and_say_why():
    summary = row("P", [broken(JOB, "first\nreason"), broken(JOB, "second")], 1000)
    assert (summary["failed"], summary["reason"], summary["transitions_median"], summary["seconds_median"]) == \
        (2, "first reason", None, None)
    mixed = row("P", [broken(JOB, "why"), record(True, 10, 2.0)], 1000)
    assert (mixed["failed"], mixed["seconds_median"], mixed["transitions_median"], mixed["reason"]) == \
        (1, 2.0, 505.0, "why")
