"""One style for all figures: sizes, fonts, colours; and writing a figure whole or not at all.

Colours of categories are those of Okabe and Ito (2008) and two more, which the colour-blind can distinguish; quantities
have one perceptual colour map.
"""

from contextlib import AbstractContextManager
from pathlib import Path

from cycler import cycler
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pbcs_ompl.results.files import write_atomically

PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#4d4d4d", "#b8a800", "#882255")
RED, GREEN, PURPLE, WALL = PALETTE[1], PALETTE[2], "#7b3294", "#3b3b3b"
QUANTITIES = "viridis"
"""The colour map of quantities."""
BAND = 0.18
"""How opaque the band of an interval is."""
LETTERS, KEY = 14, 8
"""Letters of a legend in an inch, and those that a key takes."""


def style() -> AbstractContextManager[None]:
    """Return a context in which axes are made with our settings of matplotlib; text in a PDF stays text."""
    return rc_context({
        "font.family": "sans-serif", "font.size": 9, "axes.titlesize": 10, "axes.labelsize": 10,
        "axes.prop_cycle": cycler(color=PALETTE), "axes.spines.top": False, "axes.spines.right": False,
        "axes.axisbelow": True, "xtick.labelsize": 9, "ytick.labelsize": 9, "pdf.fonttype": 42})


def colour(index: int) -> str:
    """Return the colour of a category by its number."""
    return PALETTE[index % len(PALETTE)]


def shade(index: int, count: int) -> tuple[float, ...]:
    """Return the colour of one of `count` curves that differ in a growing quantity."""
    return tuple(colormaps[QUANTITIES](0.92 * index / max(1, count - 1)))


def new_figure(width: float = 6.4, height: float = 6.4) -> tuple[Figure, Axes]:
    """Return an empty figure of `width` x `height` inches, and its axes. No window, no global state."""
    figure, (axes,) = new_panels(1, 1, width, height)
    return figure, axes


def new_panels(rows: int, columns: int, width: float | None = None, height: float | None = None, *,
               share_x: bool = False) -> tuple[Figure, list[Axes]]:
    """Return an empty figure of rows x columns panels, and their axes row by row.

    Args:
        rows, columns: How many panels.
        width, height: Of the figure, in inches; None for as much as the panels need.
        share_x: Whether the panels of a column have one scale below.
    """
    usual = 7.2 if columns == 1 else 5.4 * columns
    with style():
        figure = Figure(figsize=(usual if width is None else width, 4.6 * rows if height is None else height),
                        layout="constrained")
        FigureCanvasAgg(figure)
        return figure, list(figure.subplots(rows, columns, squeeze=False, sharex="col" if share_x else "none").flat)


def legend_below(figure: Figure) -> None:
    """Put the legend of all axes below a figure, where it hides nothing, in as many columns as fit.

    What has the same name in several axes is there once.
    """
    named = {label: handle for axes in figure.axes for handle, label in
             zip(*axes.get_legend_handles_labels(), strict=True)}
    if named:
        columns = int(LETTERS * figure.get_figwidth()) // (max(map(len, named)) + KEY)
        figure.legend(list(named.values()), list(named), loc="outside lower center", ncols=max(1, min(4, columns)),
                      frameon=False, fontsize=9)


def save(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG, atomically, and return its path.

    Raises:
        RunFolderError: the file cannot be written.
    """
    path = Path(path)
    write_atomically(path, lambda file: figure.savefig(file, format="png", dpi=150))
    return path


def publish(figure: Figure, path: str | Path) -> Path:
    """Write the figure as PNG, and beside it as PDF for print; return the path of the PNG.

    Raises:
        RunFolderError: a file cannot be written.
    """
    with style():
        write_atomically(Path(path).with_suffix(".pdf"),
                         lambda file: figure.savefig(file, format="pdf", metadata={"CreationDate": None}))
    return save(figure, path)
