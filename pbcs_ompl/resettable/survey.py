"""Every registered environment that installs here, checked in a process of its own: what `pbcs doctor --all` runs."""

import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import redirect_stderr, redirect_stdout
from importlib import import_module
from importlib.metadata import packages_distributions, version
from io import StringIO
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import gymnasium

from pbcs_ompl.core.registry import load_environments
from pbcs_ompl.results.files import read_json, write_json

Record = dict[str, Any]
"""`id`, `package`, `verdict`, `why`, `adapter`, `state_size`, `restore_us`, `seconds`, `version` of the package."""
FAMILIES = ("gymnasium_robotics", "highway_env", "PyFlyt.gym_envs", "panda_gym", "shimmy", "metaworld", "gym_pusht")
"""Packages that register environments when they are imported."""
VERDICTS = ("exact", "visited only", "refused", "failed", "not installed")
SIDE_BY_SIDE = 2
TIME_OUT = 60.0
MEMORY = 6 * 2**30
"""Bytes that a process may hold in private memory."""
OUT_OF_MEMORY = f"needs more than {MEMORY >> 30} GiB of memory"
ALLOCATION_FAILED = re.compile("MemoryError|bad_alloc|allocate memory|out of memory", re.IGNORECASE)
"""What Python, C++ and MuJoCo say when memory is refused."""
NUMBERED = re.compile(r"(.*)-v(\d+)")


def registered() -> dict[str, str]:
    """Return the ids of all environments that are registered here, each with the module that registers it.

    Of several versions the latest is taken; those that only have vector environments are left out. The ids of one
    package alternate with those of others.
    """
    load_environments()
    found = {name: "gymnasium" for name in gymnasium.registry if not name.startswith("pbcs/")}
    found |= {name: "pbcs_ompl.envs" for name in gymnasium.registry if name.startswith("pbcs/")}
    for module in FAMILIES:
        with redirect_stderr(StringIO()), redirect_stdout(StringIO()):
            try:
                import_module(module)
            except Exception:  # a package that is not installed, or that fails: it has nothing to be checked
                continue
        found |= {name: module for name in gymnasium.registry if name not in found}
    groups: dict[str, list[str]] = defaultdict(list)
    for name in _latest(found):
        if gymnasium.registry[name].entry_point is not None:
            groups[found[name]].append(name)
    order = chain.from_iterable(zip_longest(*groups.values()))
    return {name: found[name] for name in order if name is not None}


def survey(ids: dict[str, str], path: Path, *, seconds: float = TIME_OUT,
           on_record: Callable[[Record, int], None] | None = None) -> list[Record]:
    """Check environments, two at a time, and return a record of each; those in the file already are not repeated.

    Args:
        ids: Environments, with the modules that register them.
        path: The JSON file of the records, written after each.
        seconds: After how long a process is killed.
        on_record: Called with each new record and how many there are.

    Raises:
        DamagedFile: the file holds something else.
        RunFolderError: it cannot be written.
    """
    records: dict[str, Record] = {record["id"]: record for record in (read_json(path) if path.exists() else [])}
    known = {name: record for name, record in records.items()
             if name in ids and record["version"] == package_version(ids[name])}
    with ThreadPoolExecutor(SIDE_BY_SIDE) as pool:
        jobs = [pool.submit(_check_apart, name, ids[name], seconds) for name in ids if name not in known]
        try:
            for job in as_completed(jobs):
                record = job.result()
                known[record["id"]] = record
                write_json(path, [known[name] for name in ids if name in known])
                if on_record is not None:
                    on_record(record, len(known))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return [known[name] for name in ids if name in known]


def package_version(module: str) -> str:
    """Return the name and version of the package that a module belongs to."""
    top = module.partition(".")[0]
    package = (packages_distributions().get(top) or [top])[0]
    return f"{package} {version(package)}"


def _latest(names: Iterable[str]) -> list[str]:
    best: dict[str, tuple[int, str]] = {}
    for name in names:
        match = NUMBERED.fullmatch(name)
        base, number = (match[1], int(match[2])) if match else (name, 0)
        best[base] = max(best.get(base, (number, name)), (number, name))
    return [name for _, name in best.values()]


def _check_apart(name: str, module: str, seconds: float) -> Record:
    """Check an environment in a process of its own."""
    common = {"id": name, "package": module.partition(".")[0], "version": package_version(module)}
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "record.json"
        words = [sys.executable, "-W", "ignore", "-m", f"{__package__}.survey_one", f"{module}:{name}", str(answer)]
        try:
            ended = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, timeout=seconds, check=False)
        except subprocess.TimeoutExpired:
            return {**common, **nothing("failed", f"not done after {seconds:g} s"), "seconds": seconds}
        if answer.exists():
            return {**common, **read_json(answer)}
        return {**common, **nothing("failed", _last_words(ended)), "seconds": None}


def _last_words(ended: subprocess.CompletedProcess[bytes]) -> str:
    """Return why a process that left no record has ended."""
    said = ended.stderr.decode(errors="replace").strip()
    if ALLOCATION_FAILED.search(said):
        return OUT_OF_MEMORY
    last = (said.splitlines() or ["no word"])[-1]
    return f"the process ended with status {ended.returncode}: {last[:200]}"


def nothing(verdict: str, why: str) -> Record:
    """Return the part of a record that says why an environment has no adapter."""
    return {"verdict": verdict, "why": why, "adapter": None, "state_size": None, "restore_us": None}
