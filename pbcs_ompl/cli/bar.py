"""The live bar of a terminal; imported where there is one, because rich takes as long to import as a small plan."""

from collections.abc import Iterable, Sequence
from typing import Any

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from pbcs_ompl.core.formatting import format_number


class Bar(Progress):
    """A progress bar with a table under it.

    Args:
        label: What is being done.
    """

    def __init__(self, label: str):
        columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(20), TimeElapsedColumn())
        self._rows: Sequence[dict[str, Any]] = ()
        super().__init__(*columns, console=Console(stderr=True, highlight=False), transient=True)
        self._task = self.add_task(label, total=None)

    def show(self, text: str, share: float | None, rows: Sequence[dict[str, Any]] = ()) -> None:
        """Show a line, the share that is done (None if unknown) and a table of dictionaries with the same keys."""
        self._rows = rows
        self.update(self._task, description=text, total=None if share is None else 1.0, completed=share or 0)

    def get_renderables(self) -> Iterable[RenderableType]:
        """Return the bar, and the table where there is one."""
        yield from super().get_renderables()
        if self._rows:
            yield _table(self._rows)


def _table(rows: Sequence[dict[str, Any]]) -> Table:
    """Return a table with a column for each key of the rows."""
    table = Table(box=None, pad_edge=False)
    for name, value in rows[0].items():
        table.add_column(name, justify="left" if isinstance(value, str) else "right")
    for row in rows:
        table.add_row(*map(format_number, row.values()))
    return table
