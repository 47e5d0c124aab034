"""The run that a command asks for: recalled where the same was made before, else prepared from the model."""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

if TYPE_CHECKING:  # a run that is recalled needs none of it
    from multibody_sym.model.system import System
    from multibody_sym.motion.prepare.records import Runnable
    from multibody_sym.motion.results.run_record import Beginning
    from multibody_sym.motion.results.trajectory import Trajectory
    from multibody_sym.motion.runs.run import Progressed
    from multibody_sym.motion.simulate import Prepared

Run = Callable[["Progressed"], "Trajectory"]
Settings = Mapping[str, Any]
Made = TypeVar("Made")

CHANGES: Final = ("parameters", "initial", "inputs", "coordinates", "project", "formalism")
"""The options that change the model or how it is solved: those that every command has."""
_LARGEST: Final = 1 << 20
"""The bytes of a model file, beyond which others tell what is wrong."""


@contextmanager
def asked_run(options: argparse.Namespace, settings: Settings) -> Iterator[Run]:
    """Give the function that makes a run by settings, told of its progress; errors name places as under `model`."""
    asked = _asked(options, settings)
    found = None if asked is None else _recalled(options, settings, asked)
    if found is not None:
        with _placed(options):
            yield found
        return
    from multibody_sym.cli.model import opened
    from multibody_sym.motion.runs.replay import remember

    with opened(options, None if asked is None else asked.content) as (system, tables):

        def made(on_progress: Progressed) -> Trajectory:
            prepared = _prepared(options, settings, system)
            done = prepared.run(on_progress=on_progress)
            if asked is not None and not tables:  # whose files are not looked at
                remember(asked.key, asked.digest, done, options.hints())
            return done

        yield made


class _Asked(NamedTuple):
    """A model file's content, the key under which its run is, and a hash of all that the run follows from."""

    content: bytes
    key: str
    digest: str


def _asked(options: argparse.Namespace, settings: Settings) -> _Asked | None:
    """Return what is asked for; None for what is no file on a disk, or cannot be read, which others tell."""
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

    given = {name: getattr(options, name) for name in (*CHANGES, "native", "backend")} | dict(settings)
    named = sorted(name for name, value in given.items() if value)
    key = digest(os.fsencode(place), *named)
    versions = sys.version, np.__version__
    return _Asked(content, key, digest(content, os.fsencode(options.file), json.dumps(given), *versions))


def _recalled(options: argparse.Namespace, settings: Settings, asked: _Asked) -> Run | None:
    from multibody_sym.motion.runs.replay import recalled

    anew = _Anew(options, settings, asked.content)
    found = recalled(asked.key, asked.digest, anew, native=options.native, backend=options.backend)
    if found is None:
        return None
    options.hints = lambda: found.hints
    from multibody_sym.motion.runs.run import run

    return partial(run, found)


class _Anew(NamedTuple):
    """What was recalled, made from the model."""

    options: argparse.Namespace
    settings: Settings
    content: bytes

    def ready(self) -> Runnable:
        from multibody_sym.motion.simulate import ready_of

        return self._made(ready_of)

    def begin(self) -> Beginning:
        from multibody_sym.motion.simulate import beginning

        return self._made(beginning)

    def _made(self, make: Callable[[Prepared], Made]) -> Made:
        from multibody_sym.cli.model import opened

        with opened(self.options, self.content) as (system, _tables):
            return make(_prepared(self.options, self.settings, system))


def _prepared(options: argparse.Namespace, settings: Settings, system: System) -> Prepared:
    from multibody_sym.cli.model import changed
    from multibody_sym.motion.simulate import Prepared, run_by

    by = {name: value for name, value in settings.items() if name != "constraints"}
    asked = run_by(changed(system, options), by, settings["constraints"])
    return Prepared(asked, options.formalism, options.native, options.backend)


@contextmanager
def _placed(options: argparse.Namespace) -> Iterator[None]:
    """Name the places of errors, for which the model is read only now."""
    try:
        yield
    except Exception as error:
        from multibody_sym.cli.model import opened

        with opened(options):
            raise error from error.__cause__
