"""Standard output and error, which may be closed, full, or of an encoding that lacks our characters."""

import io
import os
import sys
from contextlib import suppress
from typing import TextIO

from pbcs_ompl.core.errors import PbcsError


class OutputClosed(Exception):
    """The reader of the standard output has gone, as after `pbcs doctor | head -1`."""


def survive_encodings() -> None:
    """Show characters that the encoding of the terminal lacks as escapes, instead of raising."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def print_output(*lines: str) -> None:
    """Print lines on the standard output.

    Raises:
        OutputClosed, PbcsError: see `flush_output`.
    """
    _write(sys.stdout, "".join(f"{line}\n" for line in lines))


def flush_output() -> None:
    """Write what was printed so far.

    Raises:
        OutputClosed: the reader has gone.
        PbcsError: it cannot be written, because its disk is full for instance.
    """
    _write(sys.stdout, "")


def print_error(*lines: str) -> None:
    """Print lines on the standard error, if it is still there."""
    with suppress(OSError, ValueError):
        print(*lines, sep="\n", file=sys.stderr, flush=True)


def _write(stream: TextIO | None, text: str) -> None:
    if stream is None:  # the program was started without one
        return
    try:
        stream.write(text)
        stream.flush()
    except BrokenPipeError:
        _discard(stream)
        raise OutputClosed from None
    except (OSError, ValueError) as error:
        _discard(stream)
        raise PbcsError(f"cannot write to the standard output: {getattr(error, 'strerror', None) or error}") from None


def _discard(stream: TextIO) -> None:
    """Let what is left in a stream go nowhere: Python writes it at its end, and would complain once more."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
