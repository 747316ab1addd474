"""Laws of one run of a comparison: its record is complete, plain, and does not depend on earlier runs."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest

from pbcs_ompl.core.errors import InvalidOption
from pbcs_ompl.experiments.planning_run import MEASURED, failed_record, folder_of, is_record_of, run_planner
from pbcs_ompl.experiments.run import Failure, Run
from pbcs_ompl.results.schema import RunOfComparison, check

RUN = Run("1-Maze-v0/Ex-3", {"planner": "Ex", "planner_kwargs": {}, "seed": 3, "max_transitions": 5000,
                             "max_seconds": None, "improve": None,
                             "environment": {"id": "pbcs/Maze-v0", "kwargs": {"size": 2}}})


def changed(**settings):
    return replace(RUN, settings=RUN.settings | settings)


def test_a_record_has_everything_and_is_plain():
    record = run_planner(RUN)
    failed = failed_record(RUN, Failure("why\n  not"))
    assert record.keys() == failed.keys()
    assert record.keys() == {"name", "planner", "seed", "environment", "solved", "reason", *MEASURED}
    assert [name for name in MEASURED if record[name] is None] == ["improvement"]
    assert json.loads(json.dumps(record)) == record
    assert folder_of(record) == "1-Maze-v0"
    assert is_record_of(RUN, record)
    assert is_record_of(RUN, failed)
    assert (failed["reason"], failed["seconds"]) == ("why not", None)
    assert record["planner_settings"]["bin_size"] == [0.15, 0.15]


def test_progress_ends_with_the_run():
    record = run_planner(RUN)
    curve = record["progress"]
    assert {len(values) for values in curve.values()} == {len(curve["transitions"])}
    assert [values[-1] for values in curve.values()] == [record["transitions"], record["seconds"], record["coverage"]]


def test_a_planner_that_continues_records_its_first_solution_and_what_followed():
    name = "pbcs_ompl.planners:SSTCompiled"
    run = replace(changed(planner=name, max_transitions=9000), name="1-Maze-v0/SST-3")
    record = run_planner(run)
    note = record["improvement"]
    assert is_record_of(run, record)
    assert record["transitions"] + note["transitions"] == 9000 == record["progress"]["transitions"][-1]
    assert record["path_length"] == note["after"] < note["before"]
    check(Path("record"), record, RunOfComparison)


def test_an_unsolved_run_says_why():
    record = run_planner(changed(max_transitions=10))
    assert (record["solved"], record["transitions"], record["path_length"]) == (False, 10, None)
    assert record["reason"] == "the budget ended before the goal was reached"


def test_a_refused_option_is_a_named_error():
    with pytest.raises(InvalidOption, match="did you mean 'bin_size'"):
        run_planner(changed(planner_kwargs={"bin_sise": 1.0}))


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux reports the peak since a moment")
def test_memory_of_earlier_runs_does_not_count():
    np.ones(50_000_000).sum()  # 400 MB, freed again
    resident = psutil.Process().memory_info().rss / 1e6
    assert 0 < run_planner(RUN)["memory"] < resident + 300
