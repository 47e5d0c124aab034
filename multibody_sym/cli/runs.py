"""The run that a command asks for, recalled or prepared from the model, and its table, written while it runs."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

from multibody_sym.cli.options import run_options
from multibody_sym.errors import OutputError, Where
from multibody_sym.motion.results.samples import Samples
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.text.files import file_state, is_special
from multibody_sym.text.values import SI, Units

if TYPE_CHECKING:
    from multibody_sym.motion.prepare.records import PreparedSystem
    from multibody_sym.motion.results.samples import RunStart
    from multibody_sym.motion.runs.run import Progressed
    from multibody_sym.motion.simulate import Prepared
    from multibody_sym.text.tables import GrowingCsv, Table

# ----------------------------------------------------------------------------------------------------------------------
# Results written while they arise: what is in the file survives whatever happens to the process.


_LONG: Final = 2.0  # seconds after which a result that does not grow by itself is kept as CSV beside it
_GROWS: Final = ".csv"


def verify_target(path: str) -> str:
    """Return the ending of a file that can be written, before a run.

    Raises InputError for an unknown ending and OutputError for a folder that cannot be written.
    """
    from multibody_sym.text.tables import table_format  # which a run without a file does not need

    ending = table_format(path)
    folder = os.path.dirname(os.path.realpath(path))
    if os.path.isdir(path) or not (is_special(path) or os.access(folder, os.W_OK)):
        reason = "it is a folder" if os.path.isdir(path) else "its folder does not exist or cannot be written to"
        raise OutputError(f"the file cannot be written: {reason}", where=Where(file=path), number="O102")
    return ending


class Recording:
    """The table of a run in a file: made before the run, `recorded` during it, `finish`ed after it.

    CSV, which has no other place for units, is in those that were chosen, and its header names them then. NPZ and
    Parquet are SI.
    `place` is the file in the end: beside `path` where another run wrote that meanwhile.
    """

    def __init__(self, path: str, units: Units = SI) -> None:
        """Raise InputError for an unknown ending and OutputError for a folder that cannot be written."""
        self._grows = verify_target(path) == _GROWS
        self.path = self.place = path
        self.units = units
        self._begin, self._through = file_state(path), is_special(path)
        self._growing: GrowingCsv | None = None

    @property
    def lost(self) -> bool:
        """Whether another run was first."""
        return self.place != self.path

    @contextmanager
    def recorded(self) -> Iterator[Callable[[Samples], None]]:
        """Give a function that keeps new samples: in `<path>.partial`, or for other formats in `<path>.csv.partial`.

        CSV grows from the start; NPZ and Parquet, which cannot, have a CSV beside them while a long run lasts. After a
        run that failed the partial file stays, and the error names it.
        """
        begin, waiting = time.monotonic(), list[Samples]()
        with ExitStack() as stack:

            def write() -> None:
                for new in waiting:
                    table = self._table(new)
                    if self._growing is None:
                        self._growing = stack.enter_context(self._opened(list(table.columns)))
                    for rows in table.blocks():
                        self._growing(rows)
                waiting.clear()

            def keep(new: Samples) -> None:
                waiting.append(new)
                if self._grows or (not self._through and time.monotonic() - begin > _LONG):
                    write()

            try:
                yield keep
            except FailedRunError as error:
                write()
                kept = self._growing.partial if self._growing is not None else self.path
                named = os.path.join(os.path.dirname(self.path), os.path.basename(kept))  # as the user names the folder
                message = f"{error.message}; what was computed until then is in {named}"
                raise type(error)(message, error.trajectory) from None
        if self._grows and self._growing is not None:
            self.place = self._growing.place

    def _table(self, samples: Samples) -> Table:
        return samples.table(self.units).labelled() if self._grows and self.units.chosen else samples.table()

    def _opened(self, names: list[str]) -> AbstractContextManager[GrowingCsv]:
        from multibody_sym.text.tables import growing_csv

        if self._grows:
            return growing_csv(self.path, names, self._begin)
        return growing_csv(self.path + _GROWS, names, meanwhile=True)

    def finish(self, run: Trajectory) -> None:
        """Write what does not grow by itself, and a CSV that Ctrl-C may have torn or that tells work.

        Raises OutputError.
        """
        from multibody_sym.text.tables import write_table

        if not self._grows:
            self.place = write_table(self._table(run), self.path, self._begin)
            if self._growing is not None:
                self._growing.discard()
        elif (run.interrupted or run.ready.told.run_outputs) and not self._through:
            write_table(self._table(run), self.place)


# ----------------------------------------------------------------------------------------------------------------------
# The run that a command asks for: recalled where the same was made before, else prepared from the model.


Run = Callable[["Progressed"], "Trajectory"]
_T = TypeVar("_T")

_LARGEST: Final = 1 << 20
"""The bytes of a model file that is larger than all whose runs are remembered."""


@contextmanager
def asked_run(options: argparse.Namespace) -> Iterator[Run]:
    """Give the function that makes the run, told of its progress; errors name places as under `model`."""
    asked = _read_request(options)
    if asked is not None:
        from multibody_sym.motion.runs.replay import recall_run
        from multibody_sym.program.backend import Native

        anew = _Anew(options, asked.content)
        begin = recall_run(asked.key, asked.digest, anew, Native(options.native, options.backend))
        if begin is not None:
            from multibody_sym.motion.runs.run import run

            options.hints = lambda: begin.hints
            with _with_places(options):
                yield partial(run, begin)
            return
    from multibody_sym.cli.model import open_model
    from multibody_sym.motion.runs.replay import remember
    from multibody_sym.motion.simulate import prepared_by

    with open_model(options, None if asked is None else asked.content) as (system, tables):

        def make(on_progress: Progressed) -> Trajectory:
            done = prepared_by(system, run_options(options)).run(on_progress=on_progress)
            if asked is not None and not tables and not system.then:  # files of tables are not looked at
                remember(asked.key, asked.digest, done, options.hints())
            return done

        yield make


class _Request(NamedTuple):
    """A model file's content, the key under which its run is kept, and a hash of all that the run follows from."""

    content: bytes
    key: str
    digest: str


def _read_request(options: argparse.Namespace) -> _Request | None:
    """Return what is asked for; None for what is no file on a disk, or cannot be read, which others report."""
    try:
        if not os.path.isfile(options.file):
            return None
        with open(options.file, "rb") as file:
            content = file.read(_LARGEST + 1)
        place = os.path.realpath(options.file)
    except (OSError, ValueError):
        return None
    if len(content) > _LARGEST:
        return None
    import numpy as np

    from multibody_sym.program.cache import digest

    given = run_options(options)
    key = digest(os.fsencode(place), *sorted(name for name, value in given.items() if value))
    versions = sys.version, np.__version__
    return _Request(content, key, digest(content, os.fsencode(options.file), json.dumps(given), *versions))


class _Anew(NamedTuple):
    """What was recalled, made from the model."""

    options: argparse.Namespace
    content: bytes

    def ready(self) -> PreparedSystem:
        from multibody_sym.motion.simulate import system_to_run

        return self._made(system_to_run)

    def begin(self) -> RunStart:
        from multibody_sym.motion.simulate import run_start

        return self._made(run_start)

    def _made(self, make: Callable[[Prepared], _T]) -> _T:
        from multibody_sym.cli.model import open_model
        from multibody_sym.motion.simulate import prepared_by

        with open_model(self.options, self.content) as (system, _tables):
            return make(prepared_by(system, run_options(self.options)))


@contextmanager
def _with_places(options: argparse.Namespace) -> Iterator[None]:
    """Name the places of errors, for which the model is read only now."""
    try:
        yield
    except Exception as error:
        from multibody_sym.cli.model import open_model

        with open_model(options):
            raise error from error.__cause__
