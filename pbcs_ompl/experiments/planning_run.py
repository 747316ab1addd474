"""One run of a comparison: a planner in an environment, in a process that may have made other runs."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Any

from pbcs_ompl.bridge.coverage import Coverage
from pbcs_ompl.bridge.plan import PlanResult, plan
from pbcs_ompl.core.env_spec import EnvSpec
from pbcs_ompl.experiments.run import Failure, Record, Run

MEASURED = ("transitions", "collision_checks", "seconds", "nodes", "path_length", "replay_ok", "memory", "coverage",
            "progress", "planner_settings", "improvement")
"""What the record of a run has beside what identifies it (see docs/compare.md); None in a run that failed."""
IDENTITY = ("planner", "seed", "environment")


def run_planner(run: Run) -> Record:
    """Plan once and return the record of it.

    OMPL's objects are built again for every run, so a worker that has made other runs finds what a fresh process finds.

    Args:
        run: Its settings are the planner, its options, the seed, the environment (`EnvSpec.to_dict`) and the budgets.
    """
    _reset_peak_of_memory()
    result = _plan(run.settings)
    measured = {name: value for name, value in result.summary().items() if name in MEASURED}
    return {**_identity(run), "solved": result.solved, "improvement": None, **measured, "memory": _peak_megabytes(),
            **_coverage(result.coverage), "planner_settings": result.planner_settings, "reason": result.reason}


def failed_record(run: Run, failure: Failure) -> Record:
    """Return the record of a run that failed: a reason, and no measurements."""
    return {**_identity(run), "solved": False, **dict.fromkeys(MEASURED), "reason": failure.reason}


def is_record_of(run: Run, record: Record) -> bool:
    """Return whether a record is that of this run, and says no more than a run can find.

    Args:
        run: The run.
        record: A `RunOfComparison`, by its types.
    """
    same = all(record[name] == value for name, value in _identity(run).items())
    needed = ("transitions", "seconds", "path_length") if record["solved"] else ()
    lengths = {len(numbers) for numbers in (record["progress"] or {}).values()}
    return same and all(record[name] is not None for name in needed) and len(lengths) <= 1


def folder_of(record: Record) -> str:
    """Return the folder of a record, which stands for its environment."""
    return str(record["name"]).partition("/")[0]


def _identity(run: Run) -> Record:
    return {"name": run.name, **{name: run.settings[name] for name in IDENTITY}}


def _plan(settings: dict[str, Any], **limits: Any) -> PlanResult:
    names = ("planner_kwargs", "seed", "max_transitions", "max_seconds", "improve")
    chosen = {name: settings[name] for name in names} | limits
    return plan(EnvSpec.from_dict(settings["environment"], trusted=True), settings["planner"], coverage=True, **chosen)


def _coverage(coverage: Coverage | None) -> Record:
    """Return the last share, and the curve that led there."""
    if coverage is None or not len(coverage.share):
        return {"coverage": None, "progress": None}
    return {"coverage": float(coverage.share[-1]),
            "progress": {"transitions": coverage.transitions.tolist(), "seconds": coverage.seconds.tolist(),
                         "coverage": coverage.share.tolist()}}


def _reset_peak_of_memory() -> None:
    """Have Linux measure the peak of this process's memory from now on."""
    with suppress(OSError):  # another system
        Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")


def _peak_megabytes() -> float | None:
    """Return the most memory this process has had, in MB of 10^6 bytes; None where the system is not Linux."""
    try:
        status = Path("/proc/self/status").read_text(encoding="utf-8")
    except OSError:
        return None
    peak = re.search(r"VmHWM:\s*(\d+) kB", status)
    return None if peak is None else int(peak[1]) * 1024 / 1e6
