"""Results written while they arise: what is in the file survives whatever happens to the process."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Final

from multibody_sym.errors import OutputError, Where
from multibody_sym.formats.tables import growing_csv, table_format, write_table

if TYPE_CHECKING:
    from multibody_sym.simulation.samples import Samples
    from multibody_sym.simulation.trajectory import Trajectory

_LONG: Final = 2.0  # seconds after which a result that does not grow by itself is kept as CSV beside it


def verify_target(path: str) -> None:
    """Raise InputError for an unknown ending and OutputError for a folder that cannot be written, before a run."""
    table_format(path)
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder) or os.path.isdir(path) or not os.access(folder, os.W_OK):
        reason = "is a folder" if os.path.isdir(path) else "its folder does not exist or cannot be written to"
        raise OutputError(f"the file cannot be written: {reason}", where=Where(file=path))


@contextmanager
def recorded(path: str) -> Iterator[Callable[[Samples], None]]:
    """Give a function that keeps new samples: in `<path>.partial`, or for other formats in `<path>.csv.partial`.

    CSV grows from the start; NPZ and Parquet, which cannot, have a CSV beside them while a long run lasts.
    """
    grows = table_format(path) == ".csv"
    begin, waiting = time.monotonic(), []
    with ExitStack() as stack:
        append = None

        def keep(new: Samples) -> None:
            nonlocal append
            waiting.append(new)
            if append is None and (grows or time.monotonic() - begin > _LONG):
                names = list(new.table().columns)
                append = stack.enter_context(growing_csv(path if grows else path + ".csv", names))
            if append is not None:
                for samples in waiting:
                    append(samples.table().rows())
                waiting.clear()

        yield keep


def finish(path: str, run: Trajectory) -> None:
    """Write what does not grow by itself, and a CSV that Ctrl-C may have torn. Raises OutputError."""
    if table_format(path) != ".csv" or run.interrupted:
        write_table(run.table(), path)
    beside = path + ".csv"
    if table_format(path) != ".csv" and os.path.exists(beside):
        os.unlink(beside)
