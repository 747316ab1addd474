"""The survey of environments as a Markdown page."""

from collections import Counter
from collections.abc import Sequence
from itertools import groupby

from pbcs_ompl.resettable.survey import MEMORY, VERDICTS, Record

HEAD = """\
# Environments that were checked

Made by `{command}`, with {versions}; do not edit. Each id in its latest version was made, adapted and checked
(`check_resettable`) in a process of its own; {seconds:g} s and {memory} GiB at the most.

- **exact**: any state that was saved is restored from its numbers alone, and continues bit for bit;
- **visited only**: only states that were visited in the same process are restored (copies, or replayed actions);
- **refused**: `make` says why it cannot be restored, or is not supported;
- **failed**: it cannot be made without options, raises, takes longer or more memory, or does not continue as before.

"""


def survey_page(records: Sequence[Record], command: str, seconds: float) -> str:
    """Return the page.

    Args:
        records: Of `survey`.
        command: What made them.
        seconds: The time-out.
    """
    shown = sorted((record for record in records if record["verdict"] != "not installed"),
                   key=lambda record: (record["package"], record["id"]))
    versions = ", ".join(dict.fromkeys(record["version"] for record in shown))
    parts = [HEAD.format(command=command, versions=versions, seconds=seconds, memory=MEMORY >> 30),
             _counts(records), ""]
    for package, group in groupby(shown, key=lambda record: record["package"]):
        parts += [f"## {package}", "", "| id | verdict | adapter | numbers in a state | restore | why |",
                  "|---|---|---|---|---|---|", *map(_row, group), ""]
    return "\n".join(parts)


def _counts(records: Sequence[Record]) -> str:
    counts = Counter(record["verdict"] for record in records)
    return ", ".join(f"{counts[verdict]} {verdict}" for verdict in VERDICTS if counts[verdict]) + "."


def _row(record: Record) -> str:
    cost = "" if record["restore_us"] is None else f"{record['restore_us']:,.0f} µs"
    cells = (f"`{record['id']}`", record["verdict"], record["adapter"] or "", record["state_size"] or "", cost,
             _cell(record["why"]))
    return f"| {' | '.join(map(str, cells))} |"


def _cell(text: str) -> str:
    """Return a text that stays in its cell."""
    short = text if len(text) <= 240 else f"{text[:237]}..."
    return " ".join(short.replace("|", "\\|").replace("<", "&lt;").split())
