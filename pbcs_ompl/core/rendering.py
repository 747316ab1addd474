"""Where MuJoCo renders: it decides when it is imported, so this has to be asked before."""

import ctypes.util
import os
import sys
from functools import cache

from pbcs_ompl.core.errors import MissingDependency

LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"}
"""What renders without a display, by the value of MUJOCO_GL."""


def prefer_headless_rendering() -> None:
    """On Linux without a display, let MuJoCo render through EGL where it is installed, unless MUJOCO_GL is set.

    Does nothing when MuJoCo is imported already: it has decided then.
    """
    if "mujoco" in sys.modules:
        return
    if sys.platform == "linux" and not os.environ.get("DISPLAY") and _library("EGL"):
        os.environ.setdefault("MUJOCO_GL", "egl")


def renderer_is_missing() -> bool:
    """Return whether MUJOCO_GL names a library that is not there: MuJoCo then fails when it is imported."""
    library = LIBRARIES.get(os.environ.get("MUJOCO_GL", "").lower())
    return library is not None and _library(library) is None


@cache
def _library(name: str) -> str | None:
    """Return the file of a shared library, None where it is not installed; Linux starts a program to find out."""
    return ctypes.util.find_library(name)


def check_can_render() -> None:
    """Refuse to render where MuJoCo would abort the process.

    Raises:
        MissingDependency: neither a display nor a library for rendering without one.
    """
    without_display = sys.platform == "linux" and not os.environ.get("DISPLAY")
    if without_display and os.environ.get("MUJOCO_GL") not in ("egl", "osmesa"):
        raise MissingDependency("nothing can render here: there is no display; install EGL (on Debian: apt install "
                                "libegl1) and set MUJOCO_GL=egl before mujoco is imported")
