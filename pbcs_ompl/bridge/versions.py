"""Versions of the packages that a step of an environment depends on."""

from importlib.metadata import PackageNotFoundError, version

ENVIRONMENT = ("pbcs-ompl", "gymnasium")
PLANNING = ("ompl", "numpy", "numba", "python-fcl")


def environment_versions() -> dict[str, str]:
    """Return the versions that a trajectory depends on: ours, Gymnasium's, and MuJoCo's where installed."""
    return _installed((*ENVIRONMENT, "mujoco"))


def planning_versions() -> dict[str, str]:
    """Return the versions that a plan depends on."""
    return _installed((*ENVIRONMENT, "mujoco", *PLANNING))


def _installed(packages: tuple[str, ...]) -> dict[str, str]:
    found = {}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
