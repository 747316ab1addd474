"""A blank figure, and writing it whole or not at all."""

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pbcs_ompl.results.files import write_atomically

RED, GREEN, PURPLE, WALL = "#d62728", "#2ca02c", "#8e44ad", "#3b3b3b"


def new_figure(width: float = 6.4, height: float = 6.4) -> tuple[Figure, Axes]:
    """Return an empty figure of `width` x `height` inches, and its axes. No window, no global state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def new_panels(rows: int, columns: int) -> tuple[Figure, list[Axes]]:
    """Return an empty figure of rows x columns panels, and their axes row by row."""
    figure = Figure(figsize=(7.2 if columns == 1 else 5.4 * columns, 4.6 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)


def save(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG, atomically, and return its path.

    Raises:
        RunFolderError: the file cannot be written.
    """
    path = Path(path)
    write_atomically(path, lambda file: figure.savefig(file, format="png", dpi=150))
    return path
