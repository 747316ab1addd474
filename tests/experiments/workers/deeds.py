"""Runs that behave and misbehave, found as `deeds:NAME` by worker processes. A job is (name, anything)."""

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path


def do(job):
    name, value = job
    return {"name": name, "value": DEEDS[name](value), "pid": os.getpid()}


def broken(job, reason):
    return {"name": job[0], "value": job[1], "reason": reason}


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
    "exit": sys.exit,
    "segfault": lambda _: ctypes.string_at(0),
    "kill": lambda _: os.kill(os.getpid(), signal.SIGKILL),
    "lambda": lambda _: lambda: None,
}
