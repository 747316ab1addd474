"""Numbers as people read them."""

from collections.abc import Iterable, Sequence
from typing import Any
from unicodedata import category

HIDDEN = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Categories of Unicode that a terminal obeys instead of showing them: controls, directions, line ends."""


def is_printable(text: str) -> bool:
    """Return whether a terminal shows every character of a text, and obeys none."""
    return text.isprintable() or not any(category(letter) in HIDDEN for letter in text)


def printable(text: str) -> str:
    """Write what a terminal would obey, such as the codes for colours in the name of a folder, as escapes."""
    if is_printable(text):
        return text
    return "".join(letter.encode("unicode_escape").decode() if category(letter) in HIDDEN else letter
                   for letter in text)


def one_line(message: str) -> str:
    """Return a message as one line that a terminal shows; double spaces stay, they may be part of a name."""
    return printable(" ".join(filter(None, (line.strip() for line in message.splitlines()))))


def format_number(value: Any) -> str:
    """Write a number for reading: thousands separated, three digits after a small point."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    return f"{value:,.0f}" if isinstance(value, int) or abs(value) >= 100 else f"{value:.3g}"


def format_duration(seconds: float) -> str:
    """Write a duration for reading."""
    if seconds < 10:
        return f"{seconds:.2g} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s" if minutes else f"{rest} s"


def format_rate(rate: float, wilson: Sequence[float]) -> str:
    """Write a success rate with its 95 % Wilson interval."""
    return f"{rate:.0%} (95 % interval {wilson[0]:.0%} to {wilson[1]:.0%})"


def format_value(value: Any) -> str:
    """Write what decides a claim: a rate with its Wilson interval, other numbers, lists and tables of them."""
    if isinstance(value, dict) and "wilson" in value:
        rate, (low, high) = value["rate"], value["wilson"]
        interval = "" if rate is None else f" = {rate:.1%} (95 % interval {low:.1%} to {high:.1%})"
        return f"{value['successes']}/{value['n']}{interval}"
    if isinstance(value, dict):
        return ", ".join(f"{name} {format_value(part)}" for name, part in value.items())
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(format_value, value))}]"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    return str(value)


def format_interval(low: float, high: float) -> str:
    """Write an interval of rates for reading."""
    return f"{low:.0%} to {high:.0%}"


def format_seeds(seeds: Iterable[int]) -> str:
    """Write seeds for reading, as 0-9, 12."""
    runs: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if runs and seed == runs[-1][-1] + 1:
            runs[-1][1:] = [seed]
        else:
            runs.append([seed])
    return ", ".join("-".join(map(str, run)) for run in runs)
