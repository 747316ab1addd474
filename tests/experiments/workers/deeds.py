"""Runs that behave and misbehave, found as `deeds:NAME` by worker processes."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from pbcs_ompl.core.errors import PbcsError
from pbcs_ompl.experiments.run import Run


def deed(name, value):
    """Return a run."""
    return Run(f"{name}-{value}", {"deed": name, "value": value})


def do(run):
    return {"deed": run.settings["deed"], "value": DEEDS[run.settings["deed"]](run.settings["value"]),
            "pid": os.getpid()}


def note(path):
    """Leave one line for each time this run was made."""
    with open(path, "a") as file:
        file.write(f"{os.getpid()}\n")


def eat(megabytes):
    kept = [bytearray(os.urandom(1) * 1_000_000) for _ in range(megabytes)]
    time.sleep(60)
    return len(kept)


def keep(megabytes):
    KEPT.append(bytearray(os.urandom(1) * (megabytes * 1_000_000)))


def sleep(seconds):
    time.sleep(seconds)
    return seconds


def wait_with_a_child(path):
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    Path(path).write_text(str(child.pid))
    time.sleep(60)


def refuse(_):
    raise ValueError("this deed\nis refused")


def misuse(_):
    raise PbcsError("this deed does not exist")


if "DEEDS_FAIL" in os.environ:
    raise RuntimeError("deeds cannot be imported")
time.sleep(float(os.environ.get("SECONDS_TO_IMPORT", "0")))
KEPT: list[bytearray] = []
DEEDS = {
    "square": lambda value: value * value,
    "sleep": sleep,
    "note": note,
    "eat": eat,
    "keep": keep,
    "wait with a child": wait_with_a_child,
    "refuse": refuse,
    "misuse": misuse,
    "exit": sys.exit,
    "segfault": lambda _: ctypes.string_at(0),
    "kill": lambda _: os.kill(os.getpid(), signal.SIGKILL),
    "lambda": lambda _: lambda: None,
}
