"""Versions of the packages that a step of an environment depends on."""

from pbcs_ompl.results.provenance import installed

ENVIRONMENT = ("pbcs-ompl", "gymnasium")
PLANNING = ("ompl", "numpy", "numba", "python-fcl")


def environment_versions() -> dict[str, str]:
    """Return the versions that a trajectory depends on: ours, Gymnasium's, and MuJoCo's where installed."""
    return installed((*ENVIRONMENT, "mujoco"))


def planning_versions() -> dict[str, str]:
    """Return the versions that a plan depends on."""
    return installed((*ENVIRONMENT, "mujoco", *PLANNING))
