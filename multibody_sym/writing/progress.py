"""A progress bar on standard error, for runs that last and terminals that show it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final

_PATIENCE: Final = 0.5  # seconds before the bar appears
_WIDTH: Final = 40


@contextmanager
def progress_bar() -> Iterator[Callable[[float], None]]:
    """Give a function that shows a part from 0 to 1; what it drew is wiped at the end."""
    begin, drawn = time.monotonic(), 0
    stream = sys.stderr if sys.stderr is not None and sys.stderr.isatty() else None

    def show(part: float) -> None:
        nonlocal drawn
        elapsed = time.monotonic() - begin
        if stream is not None and elapsed > _PATIENCE and 0.0 < part < 1.0:
            line = bar(part, elapsed)
            stream.write("\r" + line.ljust(drawn))
            stream.flush()
            drawn = len(line)

    try:
        yield show
    finally:
        if drawn and stream is not None:
            stream.write("\r" + " " * drawn + "\r")
            stream.flush()


def bar(part: float, elapsed: float) -> str:
    """Return a bar with the part that is done and the time that is left, in s."""
    full = round(part * _WIDTH)
    return f"[{'#' * full}{'.' * (_WIDTH - full)}] {100 * part:3.0f} %, {elapsed * (1 - part) / part:.0f} s left"
