"""The task of a worker: some runs of a study, from their numbers to rows."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from importlib.metadata import PackageNotFoundError, version
from threading import Event, Lock
from typing import Any, Final

from multibody_sym.errors import MultibodyError, shown
from multibody_sym.formats.writer import dumps
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.model.resolution.resolve import mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.cache import digest
from multibody_sym.runtime.loading import Backend, verify_backend
from multibody_sym.simulation.failures import FailedRunError
from multibody_sym.simulation.recall import formalism_name
from multibody_sym.simulation.runs.run import Progressed
from multibody_sym.simulation.settings import run_settings
from multibody_sym.simulation.simulate import Prepared
from multibody_sym.simulation.trajectory import Trajectory
from multibody_sym.studies.plan import Plan
from multibody_sym.studies.rows import Row, Rows

Reduce = Callable[[Trajectory], Mapping[str, float]]

TIME: Final = "t"
"""The column of the time that a run reached."""
REDUCE_FAILED: Final = "reduce failed"
"""How the reasons begin of runs of which `reduce` made no row."""
_LONGEST: Final = 500
_MOST_EVENTS: Final = 50
_KEPT: Final = 4
_prepared: dict[str, Prepared] = {}
_preparing = Lock()


class StoppedError(Exception):
    """A run was given up because its study is."""


@dataclass(frozen=True, eq=False)
class Task:
    """What all workers of a study need, wherever they are: the `system` with its settings, the plan, what is kept.

    `reduce` makes the numbers of a row from a Trajectory, or its failure; without it they are ends and extremes.
    """

    system: System
    plan: Plan
    reduce: Reduce | None = None
    formalism: str | None = None
    native: bool = False
    backend: Backend | None = None

    @cached_property
    def about(self) -> dict[str, Any]:
        """What a table says it is of."""
        model = digest(dumps(self.system))
        varied = [*map(str, self.plan.axes), *self.plan.words]
        return {"system": self.system.name, "model": model, "varied": varied, "version": _version()}

    @property
    def units(self) -> dict[str, str]:
        """The SI units of what is varied, and of coordinates, speeds and outputs, as far as they are known."""
        told = MechanismUnits(mechanism(self.system))
        declared = {name: each.dimension for name, each in self.system.parameters.items()}
        varied = {axis.name: str(declared[axis.name]) for axis in self.plan.axes if declared.get(axis.name) is not None}
        return {name: unit for name, unit in {**varied, **told.outputs, **told.state}.items() if unit}

    @cached_property
    def key(self) -> str:
        """What tells the runs of the study from those of every other, whatever is kept of them."""
        told = json.dumps(self.about), self.plan.text, str(self.formalism), str(self.backend)
        return digest(*told, str(self.native))

    def rows(self, first: int, count: int, stop: Event | None = None) -> Rows:
        """Return the rows of the runs from number `first` on; fewer where it is asked to `stop`."""
        found: list[Row] = []
        values = self.plan.values(first, count)
        columns: dict[str, dict[str, list[float]]] = {"parameters": {}, "initial": {}}
        for axis, column in zip(self.plan.axes, values.T.tolist(), strict=True):
            columns[axis.kind][axis.name] = column
        look = partial(_go_on, stop)
        try:
            for run in self.prepared.runs(**columns):
                look()
                found.append(self._row(run, look))
        except StoppedError:
            pass
        return Rows.of(first, found)

    def verify(self) -> None:
        """Raise InputError for what is wrong whatever the values are: the formalism, the backend, settings."""
        verify_backend(self.backend)
        formalism_name(self.formalism, mechanism(self.system))
        settings = self.system.simulation
        given = [getattr(settings, name) for name in ("t_end", "step", "rtol", "atol", "samples")]
        if all(node is None or node.shadow is not None for node in given):
            run_settings(settings, {})

    def timed(self, first: int, count: int, stop: Event | None = None) -> tuple[Rows, float]:
        """Return the same with the seconds that it took."""
        begin = time.perf_counter()
        return self.rows(first, count, stop), time.perf_counter() - begin

    @property
    def prepared(self) -> Prepared:
        """The system ready to run, once for each process."""
        with _preparing:
            found = _prepared.get(self.key)
            if found is None:
                found = Prepared(self.system, self.formalism, self.native, self.backend)
                while len(_prepared) >= _KEPT:
                    _prepared.pop(next(iter(_prepared)))
                _prepared[self.key] = found
            return found

    def _row(self, made: Callable[[Progressed], Trajectory], look: Progressed) -> Row:
        try:
            run = made(look)
        except FailedRunError as error:
            return Row({TIME: error.trajectory.t_final}, failure=error.message)
        except MultibodyError as error:
            return Row({}, failure=str(error).partition("\n")[0])
        if run.interrupted:
            raise StoppedError
        return Row(ends_and_extremes(run), told(run.events)) if self.reduce is None else self._reduced(run)

    def _reduced(self, run: Trajectory) -> Row:
        assert self.reduce is not None
        try:
            return Row(_numbers(self.reduce(run)))
        except _WrongResultError as wrong:
            return Row({}, failure=f"{REDUCE_FAILED}: {wrong}")
        except Exception as error:
            told = str(error).partition("\n")[0].encode(errors="backslashreplace").decode()
            return Row({}, failure=f"{REDUCE_FAILED}: {type(error).__name__}: {told}"[:_LONGEST])


class _WrongResultError(Exception):
    """What `reduce` returned is no map of numbers."""


def _go_on(stop: Event | None, *_: Any) -> None:
    """Raise StoppedError where somebody asks to stop."""
    if stop is not None and stop.is_set():
        raise StoppedError


def ends_and_extremes(run: Trajectory) -> dict[str, float]:
    """Return what a run reached and passed: the time, and of each coordinate, speed and output end, min and max."""
    found = {TIME: run.t_final}
    columns = [*run.coordinates.items(), *run.speeds.items()]
    taken = {name for name, _ in columns}
    columns += [(f"output {name}" if name in taken else name, values) for name, values in run.outputs.items()]
    for name, values in columns:
        found.update(zip(_named(name), _of(values), strict=True))
    return found


def _named(name: str) -> tuple[str, str, str]:
    return f"{name} end", f"{name} min", f"{name} max"


def _of(values: Floats) -> tuple[float, float, float]:
    if not len(values):
        return math.nan, math.nan, math.nan
    return float(values[-1]), float(values.min()), float(values.max())


def told(events: list[dict[str, Any]]) -> str:
    """Return events as text: kind, element and time of each."""
    words = [f"{event['kind']} {event['element']} at {event['t']!r}" for event in events[:_MOST_EVENTS]]
    more = len(events) - len(words)
    return "; ".join([*words, f"and {more} more"] if more else words)


def _numbers(found: Any) -> dict[str, float]:
    """Return what `reduce` gave as floats by name. Raises _WrongResultError."""
    if type(found) is not dict and not isinstance(found, Mapping):
        raise _WrongResultError(f"it is to return a map from names to numbers, got {shown(found)}")
    numbers: dict[str, float] = {}
    for name, value in found.items():
        if type(name) is not str or not name or not name.isprintable():
            raise _WrongResultError(f"it is to name its numbers by text, not {shown(name)}")
        try:
            numbers[name] = float(value)
        except (TypeError, ValueError):
            raise _WrongResultError(f"it is to return numbers; {name} is {shown(value)}") from None
        except OverflowError:
            raise _WrongResultError(f"{name} is larger than any float") from None
    return numbers


def _version() -> str:
    try:
        return version("multibody-sym")
    except PackageNotFoundError:
        return ""
