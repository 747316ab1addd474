"""Names of code that stand in files: a file of another person must not decide what is imported.

Environments, planners, agents and rules may be called `module:name`, which imports `module`. A user who types such a
name means it. A name that was read from a file is refused, unless the user says that the file is trusted.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pbcs_ompl.core.errors import UntrustedModule

NAME = re.compile(r"[\w.\-]+:[^\W\d][\w./\-]*")
"""What may be `module:name` among the options of an environment or of a planner; "cuda:0" is not."""


def is_module_name(name: str | None) -> bool:
    """Return whether the id of an environment, the name of a planner or an agent, or a rule imports a module."""
    return name is not None and ":" in name and "[" not in name  # obs[0:2] is a rule without a module


def module_names(values: Any) -> Iterator[str]:
    """Yield every text in plain values, however deep, that may be `module:name`."""
    waiting = [values]
    while waiting:
        value = waiting.pop()
        if isinstance(value, str) and NAME.fullmatch(value.strip()):
            yield value
        elif isinstance(value, dict):
            waiting += value.values()
        elif isinstance(value, list | tuple):
            waiting += value


def config_modules(values: Mapping[str, Any]) -> list[str]:
    """Return the names in a config.toml, but for its environment, that import a module."""
    direct = [values.get("planner"), values.get("agent")]
    named = [name for name in direct if isinstance(name, str) and is_module_name(name)]
    return [*named, *module_names([values.get(key) for key in ("planner_kwargs", "agent_settings", "settings")])]


def refuse_modules(source: str, names: Iterable[str]) -> None:
    """Refuse what a file names if that would import a module.

    Args:
        source: The file, or what was read from it, in words.
        names: Those that would import one.

    Raises:
        UntrustedModule: there is one.
    """
    for name in names:
        module = name.partition(":")[0].strip()
        raise UntrustedModule(f"{source} names {name!r}, which would run the code of the module {module!r}; nothing "
                              "was imported. If you trust whoever wrote it, add --trust to the command, or trust=True "
                              "in Python")
