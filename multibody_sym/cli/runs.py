"""The run that a command asks for: recalled where the same was made before, else prepared from the model."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, TypeVar

from multibody_sym.cli.options import run_options

if TYPE_CHECKING:  # a run that is recalled needs none of it
    from multibody_sym.motion.prepare.records import PreparedSystem
    from multibody_sym.motion.results.run_record import RunStart
    from multibody_sym.motion.results.trajectory import Trajectory
    from multibody_sym.motion.runs.run import Progressed
    from multibody_sym.motion.simulate import Prepared

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
            if asked is not None and not tables:  # whose files are not looked at
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
