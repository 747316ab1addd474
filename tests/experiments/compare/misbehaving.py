"""Planners that fail, found as `misbehaving:NAME` by the processes of a comparison."""

import os
import re
import signal
from pathlib import Path

from ompl import base as ob


class Broken(ob.Planner):
    """Raises when it is asked to plan."""

    def __init__(self, si):
        super().__init__(si, "Broken")

    def solve(self, ptc):
        raise RuntimeError("this planner\nis broken")


class Deadly(ob.Planner):
    """Takes the whole process down, as a bug in C++ does."""

    def __init__(self, si):
        super().__init__(si, "Deadly")

    def solve(self, ptc):
        os.kill(os.getpid(), signal.SIGKILL)


class Hanging(ob.Planner):
    """Never returns, and never lets another thread of Python work, as a loop in C++ does."""

    def __init__(self, si):
        super().__init__(si, "Hanging")

    def solve(self, ptc):
        re.match(r"(a+)+b", "a" * 64)


class Hungry(ob.Planner):
    """Takes more and more memory."""

    def __init__(self, si):
        super().__init__(si, "Hungry")

    def solve(self, ptc):
        hoard = []
        while True:
            hoard.append(bytearray(os.urandom(1)) * 10_000_000)


class Waiting(ob.Planner):
    """Writes the number of its process into a file, and waits for the end of its budget."""

    def __init__(self, si, file=""):
        super().__init__(si, "Waiting")
        self.file = file

    def solve(self, ptc):
        Path(self.file).write_text(str(os.getpid()))
        while not ptc():
            pass
        return ob.PlannerStatus(ob.PlannerStatus.TIMEOUT)
