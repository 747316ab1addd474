"""What a report says of one result folder."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

UNFINISHED = "has not ended"
MOST_RUNS = 200
"""A table of single runs has so many rows at most."""


@dataclass(frozen=True)
class Table:
    """Numbers in rows.

    Attributes:
        title: One line above it.
        columns: Their names.
        rows: A value for each column: words, numbers, None for nothing.
        note: What a reader has to know beside it.
        folded: Show the title alone until it is opened.
    """

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    note: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Content:
    """What came out of a run, a comparison or a study.

    Attributes:
        title: What was run, in one line.
        outcome: What came of it, in a few words.
        good: Whether that is what one hopes for; None when it has not ended, or is neither.
        summary: Names and values that say most.
        seeds: The seeds, in words.
        claims: Claims of a study, as `studies.Claim.to_dict` has them.
        tables: Numbers.
        failures: What failed, and why.
    """

    title: str
    outcome: str
    good: bool | None
    summary: list[tuple[str, str]]
    seeds: str = ""
    claims: list[dict[str, Any]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    failures: list[tuple[str, str]] = field(default_factory=list)


def outline(record: dict[str, Any]) -> dict[str, Any]:
    """Return the words and numbers of a record, without its lists and tables."""
    return {name: value for name, value in record.items() if not isinstance(value, list | dict)}


def table_of_runs(records: Sequence[dict[str, Any]], where: Path) -> Table:
    """Return a folded table of runs, the first ones if there are many.

    Args:
        records: The outline of each run.
        where: The folder that holds them all.
    """
    shown = records[:MOST_RUNS]
    columns = list(dict.fromkeys(name for record in shown for name in record))
    total = f"{len(records):,}"
    note = f"The first {MOST_RUNS} of {total} runs; {where}/ holds them all." if len(records) > MOST_RUNS else ""
    return Table(f"Every run ({total})", columns, [[record.get(name) for name in columns] for record in shown], note,
                 folded=True)
