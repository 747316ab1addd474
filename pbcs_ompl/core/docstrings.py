"""What docstrings say: their first line, and the meaning of each argument or attribute."""

import inspect
import re
from typing import Any

ENTRY = re.compile(r"^    (\w[\w, ]*): (.*)$")


def first_line(source: Any) -> str:
    """Return the first line of a docstring; "" where there is none."""
    return (inspect.getdoc(source) or "").partition("\n")[0]


def meanings(source: Any) -> dict[str, str]:
    """Return what the sections "Args:" and "Attributes:" of a docstring say of each name, in one line each.

    Args:
        source: A class or a function; of a class, those of its bases too, which it may change.
    """
    if inspect.isclass(source):
        found: dict[str, str] = {}
        for base in reversed(source.__mro__[:-1]):
            found |= _entries(base.__dict__.get("__doc__"))
        return found
    return _entries(source.__doc__)


def _entries(text: str | None) -> dict[str, str]:
    found: dict[str, str] = {}
    current: list[str] = []
    inside = False
    for line in inspect.cleandoc(text or "").splitlines():
        if not line.startswith(" "):
            inside = line in ("Args:", "Attributes:") if line else inside
        elif inside and (entry := ENTRY.match(line)):
            current = [name.strip() for name in entry[1].split(",")]
            found |= dict.fromkeys(current, entry[2])
        elif inside:
            found |= {name: f"{found[name]} {line.strip()}" for name in current}
    return found
