"""Find plug-ins by entry point; ours are registered in the same way as those of others."""

from functools import cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from pbcs_ompl.core.callbacks import describe
from pbcs_ompl.core.errors import MissingDependency, PbcsError, UnknownName

GROUPS = {"planner": "pbcs_ompl.planners", "agent": "pbcs_ompl.agents", "environment package": "pbcs_ompl.envs"}


@cache
def _entries(kind: str) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=GROUPS[kind])}


def names(kind: str) -> list[str]:
    """Return the registered names of one kind ("planner", "agent"), sorted."""
    return sorted(_entries(kind))


def module_of(kind: str, name: str) -> str:
    """Return the module that a registered name is loaded from."""
    return _entries(kind)[name].module


def load(kind: str, name: str) -> Any:
    """Return the object registered as `name`, or the one that `module:attribute` names.

    Raises:
        UnknownName: no such plug-in; the message suggests the closest one.
        MissingDependency: the plug-in needs a library that is not installed.
    """
    if ":" in name:
        return _import(kind, name)
    by_lower_case = {known.lower(): entry for known, entry in _entries(kind).items()}
    entry = by_lower_case.get(name.lower())
    if entry is None:
        raise UnknownName(kind, name, _entries(kind))
    try:
        return entry.load()
    except ModuleNotFoundError as error:
        raise MissingDependency(
            f"{kind} {name!r} needs {error.name!r}, which is not installed: pip install {error.name}"
        ) from error
    except PbcsError:
        raise
    except (Exception, SystemExit) as error:
        raise PbcsError(f"cannot load the {kind} {name!r}: {describe(error)}") from error


def _import(kind: str, path: str) -> Any:
    module, _, attribute = path.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except PbcsError:
        raise
    except (Exception, SystemExit) as error:
        raise PbcsError(f"cannot load the {kind} {path!r}: {describe(error)} (expected module:attribute)") from error


@cache
def load_environments() -> None:
    """Import every package that registers Gymnasium environments, once."""
    for name in _entries("environment package"):
        load("environment package", name)
