"""Results written while they arise: what is in the file survives whatever happens to the process."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Final

import numpy as np

from multibody_sym.errors import OutputError, Where
from multibody_sym.formats.tables import PARTIAL, growing_csv, table_format, write_table
from multibody_sym.simulation.failures import FailedRunError
from multibody_sym.simulation.samples import Samples
from multibody_sym.simulation.trajectory import Trajectory

_LONG: Final = 2.0  # seconds after which a result that does not grow by itself is kept as CSV beside it
_GROWS: Final = ".csv"


def verify_target(path: str) -> None:
    """Raise InputError for an unknown ending and OutputError for a folder that cannot be written, before a run."""
    table_format(path)
    folder = os.path.dirname(os.path.realpath(path))
    if os.path.isdir(path) or not os.access(folder, os.W_OK):
        reason = "it is a folder" if os.path.isdir(path) else "its folder does not exist or cannot be written to"
        raise OutputError(f"the file cannot be written: {reason}", where=Where(file=path))


@contextmanager
def recorded(path: str) -> Iterator[Callable[[Samples], None]]:
    """Give a function that keeps new samples: in `<path>.partial`, or for other formats in `<path>.csv.partial`.

    CSV grows from the start; NPZ and Parquet, which cannot, have a CSV beside them while a long run lasts. After a run
    that failed the partial file stays, and the error names it.
    """
    growing = _growing_name(path)
    begin, waiting = time.monotonic(), list[Samples]()
    with ExitStack() as stack:
        append: Callable[[np.ndarray], None] | None = None

        def write() -> None:
            nonlocal append
            for new in waiting:
                table = new.table()
                if append is None:
                    append = stack.enter_context(growing_csv(growing, list(table.columns)))
                append(table.rows())
            waiting.clear()

        def keep(new: Samples) -> None:
            waiting.append(new)
            if growing == path or time.monotonic() - begin > _LONG:
                write()

        try:
            yield keep
        except FailedRunError as error:
            write()
            message = f"{error.message}; what was computed until then is in {growing}{PARTIAL}"
            raise FailedRunError(message, error.trajectory) from None


def _growing_name(path: str) -> str:
    return path if table_format(path) == _GROWS else path + _GROWS


def finish(path: str, run: Trajectory) -> None:
    """Write what does not grow by itself, and a CSV that Ctrl-C may have torn. Raises OutputError."""
    growing = _growing_name(path)
    if growing != path or run.interrupted:
        write_table(run.table(), path)
    if growing != path and os.path.exists(growing):
        os.unlink(growing)
