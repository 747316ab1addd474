"""What a human sees: progress with rates, a closing summary; and what a script reads: one JSON line."""

import json
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pbcs_ompl.cli.streams import print_error, print_output
from pbcs_ompl.core.formatting import format_duration, format_number, one_line, printable
from pbcs_ompl.core.plain import plain

if TYPE_CHECKING:
    from pbcs_ompl.cli.bar import Bar

SECONDS_BETWEEN_LINES = 10.0
FORESEEN, SETTLED = 0.05, 5.0
"""The time left is shown once this share is done, or after this many seconds: before, it is a wild guess."""
FIRST_COLUMN = 9
"""Characters, unless a name is longer."""
AT_ONCE = 1.0
"""What is reported in fewer seconds was there before: runs that were read, for instance."""


class ProgressDisplay:
    """Progress of one run, shown as a live bar on a terminal and as a line every ten seconds elsewhere.

    It is called with the plain numbers of a `ProgressCallback`. The time left follows from "covered", the
    share that is done, where it is among them; else from the budgets, and a search usually ends earlier. Where there is
    a "table", a list of dictionaries with the same keys, it is shown below.

    Args:
        label: What is being done.
        count: The number that grows towards the budget, "transitions" for instance.
        budget: Its largest value, None when there is none.
        max_seconds: The wall time that may be used, None for any.
    """

    def __init__(self, label: str, *, count: str = "transitions", budget: int | None = None,
                 max_seconds: float | None = None):
        self._label, self._count, self._budget, self._max_seconds = label, count, budget, max_seconds
        self._bar = _bar(label)
        self._before: tuple[float, float] | None = None

    def __enter__(self) -> "ProgressDisplay":
        self._start = self._last_line = time.monotonic()
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            with suppress(OSError):  # the terminal is gone
                self._bar.stop()

    def __call__(self, numbers: dict[str, Any]) -> None:
        now = time.monotonic()
        seconds = now - self._start
        share = self._share(numbers, seconds)
        if self._before is None:
            self._before = (numbers.get(self._count, 0), share or 0.0) if seconds < AT_ONCE else (0, 0.0)
        text = f"{self._label}: {self._describe(numbers, seconds, share)}"
        if self._bar is not None:
            self._bar.show(text, share, numbers.get("table", []))
        elif now - self._last_line > SECONDS_BETWEEN_LINES:
            self._last_line = now
            rows = ("  " + ", ".join(f"{name} {format_number(value)}" for name, value in row.items())
                    for row in numbers.get("table", []))
            print_error(*map(printable, [text, *rows]))

    def _share(self, numbers: dict[str, Any], seconds: float) -> float | None:
        """Return the share that is done, in [0, 1]; None if unknown."""
        if "covered" in numbers:
            return float(numbers["covered"])
        shares = [numbers.get(self._count, 0) / self._budget] if self._budget else []
        shares += [seconds / self._max_seconds] if self._max_seconds else []
        return min(1.0, max(shares)) if shares else None

    def _describe(self, numbers: dict[str, Any], seconds: float, share: float | None) -> str:
        count_before, share_before = self._before or (0, 0.0)
        parts = [f"{name.replace('_', ' ')} {format_number(value)}" for name, value in numbers.items()
                 if name not in ("seconds", "covered", "table")]
        if seconds > 0 and self._count in numbers:
            parts.append(f"{format_number((numbers[self._count] - count_before) / seconds)} {self._count}/s")
        if share and "covered" in numbers:
            parts.append(f"{share:.0%} of the plan covered")
        done = (share or 0.0) - share_before
        if share and done > 0.0 and (done >= FORESEEN or seconds >= SETTLED):
            bound = "about" if "covered" in numbers else "at most"
            parts.append(f"{bound} {format_duration(seconds * (1 - share) / done)} left")
        return ", ".join(parts)


def _bar(label: str) -> "Bar | None":
    """Return a live bar where the standard error is a terminal."""
    if sys.stderr is None or not sys.stderr.isatty():
        return None
    from pbcs_ompl.cli.bar import Bar

    return Bar(label)


def print_summary(result: dict[str, Any], lines: Sequence[tuple[str, str]], *, as_json: bool) -> None:
    """Print the closing summary, and the JSON object as the last line on stdout if it was asked for."""
    show = print_error if as_json else print_output
    width = max([FIRST_COLUMN, *(len(name) for name, _ in lines)])
    show(*(printable(f"{name:<{width}} {text}") for name, text in lines))
    if as_json:
        print_output(json.dumps(result, default=plain))


def warn(message: str) -> None:
    """Print one line on stderr."""
    print_error(f"pbcs: {one_line(message)}")


def list_files(folder: Path) -> str:
    """Name a result folder and what lies in it."""
    names = sorted(entry.name for entry in folder.iterdir() if not entry.name.startswith("."))
    return f"{folder}/ ({', '.join(names)})"
