"""Laws of one run: its record is complete, plain, and owes nothing to the runs before it."""

import json
import sys

import numpy as np
import psutil
import pytest

from pbcs_ompl.experiments.planning_run import MEASURED, Job, broken, folder_of, run

JOB = Job("1-Maze-v0/Ex-3", "Ex", 3, "pbcs/Maze-v0", {"size": 2}, {}, 5000, None)


def test_a_record_has_everything_and_is_plain():
    record = run(JOB)
    assert record.keys() == broken(JOB, "").keys()
    assert record.keys() == {"name", "planner", "seed", "env", "env_kwargs", "solved", "reason", *MEASURED}
    assert None not in [record[name] for name in MEASURED]
    assert json.loads(json.dumps(record)) == record
    assert folder_of(record) == "1-Maze-v0"


def test_progress_ends_with_the_run():
    record = run(JOB)
    curve = record["progress"]
    assert {len(values) for values in curve.values()} == {len(curve["transitions"])}
    assert [values[-1] for values in curve.values()] == [record["transitions"], record["seconds"], record["coverage"]]


def test_an_unsolved_run_says_why():
    record = run(JOB._replace(max_transitions=10))
    assert (record["solved"], record["transitions"], record["path_length"]) == (False, 10, None)
    assert record["reason"] == "the budget ended before the goal was reached"


def test_a_refused_option_is_a_failed_run():
    record = run(JOB._replace(planner_kwargs={"bin_sise": 1.0}))
    assert "did you mean 'bin_size'" in record["reason"]
    assert record["seconds"] is None


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells the peak since a moment")
def test_memory_of_earlier_runs_does_not_count():
    np.ones(50_000_000).sum()  # 400 MB, freed again
    resident = psutil.Process().memory_info().rss / 1e6
    assert 0 < run(JOB)["memory"] < resident + 300
