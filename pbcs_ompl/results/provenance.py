"""What made a result: the versions of the libraries, Python and the machine."""

import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("pbcs-ompl", "ompl", "numpy", "scipy", "numba", "gymnasium", "python-fcl", "torch", "mujoco")
ENVIRONMENT = ("pbcs-ompl", "gymnasium", "mujoco")
PLANNING = ("ompl", "numpy", "numba", "python-fcl")


def installed(packages: tuple[str, ...]) -> dict[str, str]:
    """Return the versions of those packages that are installed."""
    found = {package: _version(package) for package in packages}
    return {package: number for package, number in found.items() if number is not None}


@cache
def _version(package: str) -> str | None:
    """Return a version, None where the package is not installed; read once in a process, for it takes 0.5 ms."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def environment_versions() -> dict[str, str]:
    """Return the versions that a trajectory depends on: ours, Gymnasium's, and MuJoCo's where installed."""
    return installed(ENVIRONMENT)


def planning_versions() -> dict[str, str]:
    """Return the versions that a plan depends on."""
    return installed((*ENVIRONMENT, *PLANNING))


def provenance() -> dict[str, str]:
    """Return the versions of this process, Python and the machine, as words."""
    return {**installed(PACKAGES), "python": platform.python_version(), "system": platform.platform(),
            "processor": f"{_processor()}, {os.cpu_count()} logical cores"}


def _processor() -> str:
    """Return the processor's name; `platform.processor` knows none on most Linux machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
