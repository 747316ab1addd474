"""Import matplotlib for pictures in files, whatever the surroundings say about windows and folders."""

import os
import sys
from contextlib import suppress
from pathlib import Path

from pbcs_ompl.core.scratch import can_be_written, scratch_folder


def import_matplotlib() -> None:
    """Import matplotlib even where MPLBACKEND names a backend that is not installed, or its folder cannot be written.

    `!pbcs` in a notebook hands on the backend of the notebook, for instance. Our pictures use Agg; a backend that does
    exist stays the choice of the host application.
    """
    if "matplotlib" in sys.modules:
        return
    _choose_folder()
    chosen = os.environ.pop("MPLBACKEND", None)
    import matplotlib

    if chosen is not None:
        os.environ["MPLBACKEND"] = chosen
        with suppress(ValueError):
            matplotlib.rcParams["backend"] = chosen


def _choose_folder() -> None:
    """Keep matplotlib's caches of fonts in a temporary folder where it finds no other; it would say so on stderr."""
    if "MPLCONFIGDIR" in os.environ:
        return
    try:
        usual = [Path(os.environ.get(name) or Path(f"~/{otherwise}").expanduser()) / "matplotlib"
                 for name, otherwise in (("XDG_CONFIG_HOME", ".config"), ("XDG_CACHE_HOME", ".cache"))]
    except RuntimeError:  # there is no home
        usual = []
    if not usual or not all(map(can_be_written, usual)):
        with suppress(OSError):
            os.environ["MPLCONFIGDIR"] = str(scratch_folder())
