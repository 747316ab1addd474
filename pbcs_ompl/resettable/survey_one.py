"""One environment of the survey, in this process: `python -m pbcs_ompl.resettable.survey_one MODULE:ID FILE`."""

import os
import resource
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

from pbcs_ompl.core.errors import MissingDependency, NotResettable, PbcsError, UnsupportedSpace
from pbcs_ompl.resettable.adapters.visited import VisitedEnv
from pbcs_ompl.resettable.check import check_resettable
from pbcs_ompl.resettable.make import make
from pbcs_ompl.resettable.memory.exploration import SEEDS, Changes, episodes
from pbcs_ompl.resettable.sampling import random_walk
from pbcs_ompl.resettable.survey import MEMORY, OUT_OF_MEMORY, Record, nothing
from pbcs_ompl.results.files import write_json

STATES = 20
SECONDS = 0.5


def classify(env_id: str) -> Record:
    """Return what the survey says of an environment."""
    began = time.perf_counter()
    record = _classify(env_id)
    return {**record, "seconds": round(time.perf_counter() - began, 1)}


def _classify(env_id: str) -> Record:
    try:
        model: Any = make(env_id)
    except MissingDependency as error:
        return nothing("not installed", str(error))
    except (NotResettable, UnsupportedSpace) as error:
        return nothing("refused", str(error))
    except PbcsError as error:
        if isinstance(error.__cause__, MemoryError):
            return nothing("failed", OUT_OF_MEMORY)
        return nothing("not installed" if isinstance(error.__cause__, ImportError) else "failed", str(error))
    except ModuleNotFoundError as error:
        return nothing("not installed", str(error))
    except MemoryError:
        return nothing("failed", OUT_OF_MEMORY)
    except Exception as error:  # a foreign environment may raise anything: a finding of the survey
        return nothing("failed", f"{type(error).__name__}: {error}")
    report = check_resettable(model)
    wrong = [check for check in report.checks if not check.ok]
    visited = isinstance(model.env, VisitedEnv)
    found = {"adapter": type(model.env).__name__, "state_size": len(model.state_low),
             "restore_us": None if wrong else restore_cost(model)}
    if wrong:
        return {"verdict": "failed", "why": f"{wrong[0].name}: {wrong[0].detail}", **found}
    if not visited:
        return {"verdict": "exact", "why": "", **found}
    return {"verdict": "visited only", "why": randomness(model.env.inner), **found}


def randomness(env: Any) -> str:
    """Return what is to be said of an environment whose steps draw random numbers; nothing of another one."""
    changes = Changes(env)
    for event in episodes(env, SEEDS[:1], STATES):
        changes.add(event)
    return f"steps draw random numbers from {changes.random}: a plan holds for one seed" if changes.random else ""


def restore_cost(model: Any) -> float:
    """Return the median microseconds of restoring one of the states of a short random walk."""
    rng = np.random.default_rng(0)
    states = random_walk(model, STATES, rng)
    costs: list[float] = []
    ends = time.perf_counter() + SECONDS
    while len(costs) < len(states) or time.perf_counter() < ends:
        state = states[int(rng.integers(len(states)))]
        begun = time.perf_counter()
        model.env.set_env_state(state)
        costs.append(time.perf_counter() - begun)
        if time.perf_counter() > ends:
            break
    return round(1e6 * float(np.median(costs)), 1)


def _end_with_parent() -> None:
    """End this process, whatever it does, when the survey is gone."""
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


if __name__ == "__main__":
    _end_with_parent()
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    write_json(Path(sys.argv[2]), classify(sys.argv[1]))
