"""The workers of a study: runs from their numbers to rows, by threads or any executor."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import field
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from threading import Event, Lock
from typing import Any, Final

from multibody_sym.derivation.routes import formalism_name
from multibody_sym.errors import ArgumentError, MultibodyError, OutputError, short_repr
from multibody_sym.mechanics.model_files import dumps
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.system import System
from multibody_sym.motion.prepare.settings import run_settings
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError, Progressed
from multibody_sym.motion.simulate import Prepared
from multibody_sym.motion.sweep.plan import Plan
from multibody_sym.motion.sweep.rows import Row, Rows, Span
from multibody_sym.program.backend import Native
from multibody_sym.program.cache import digest
from multibody_sym.records import dataclass

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
    """The study of a run was stopped."""


@dataclass(frozen=True, eq=False)
class Task:
    """What all workers of a study need: the prepared run, the plan, and `reduce`.

    `reduce` makes the numbers of a row from a Trajectory, or its failure; without it they are ends and extremes.
    """

    asked: Prepared
    plan: Plan
    reduce: Reduce | None = None

    @property
    def system(self) -> System:
        """What is run, with its settings."""
        return self.asked.system

    @cached_property
    def about(self) -> dict[str, Any]:
        """The description of a table: model, plan, version."""
        model = digest(dumps(self.system))
        varied = [*map(str, self.plan.axes), *self.plan.words]
        try:
            release = version("multibody-sym")
        except PackageNotFoundError:
            release = ""
        return {"system": self.system.name, "model": model, "varied": varied, "version": release}

    @property
    def units(self) -> dict[str, str]:
        """The SI units of what is varied, and of coordinates, speeds and outputs, as far as they are known."""
        told = MechanismUnits(mechanism(self.system))
        declared = {name: each.dimension for name, each in self.system.parameters.items()}
        varied = {axis.name: str(declared[axis.name]) for axis in self.plan.axes if declared.get(axis.name) is not None}
        return {name: unit for name, unit in {**varied, **told.outputs, **told.state}.items() if unit}

    @cached_property
    def key(self) -> str:
        """A hash of everything that the runs follow from."""
        how = self.asked.formalism, self.asked.backend, self.asked.native
        return digest(json.dumps(self.about), self.plan.text, *map(str, how))

    def rows(self, first: int, count: int, stop: Event | None = None) -> Rows:
        """Return the rows of the runs from number `first` on; fewer where it is asked to `stop`."""
        found: list[Row] = []
        values = self.plan.values(first, count)
        columns: dict[str, dict[str, list[float]]] = {"parameters": {}, "initial": {}}
        for axis, column in zip(self.plan.axes, values.T.tolist(), strict=True):
            columns[axis.kind][axis.name] = column

        def look(*_: Any) -> None:
            if stop is not None and stop.is_set():
                raise StoppedError

        try:
            for run in self.prepared.runs(**columns):
                look()
                found.append(self._row(run, look))
        except StoppedError:
            pass
        return Rows.of(first, found)

    def verify(self) -> None:
        """Raise InputError for what is wrong whatever the values are: the formalism, the backend, settings."""
        Native(backend=self.asked.backend).verify()
        formalism_name(self.asked.formalism, mechanism(self.system))
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
                found = self.asked
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
        return Row(ends_and_extremes(run), events_text(run.events)) if self.reduce is None else self._reduced(run)

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
    """`reduce` returned no map of numbers."""


def ends_and_extremes(run: Trajectory) -> dict[str, float]:
    """Return the end time of a run, and end, min and max of each coordinate, speed and output."""
    found = {TIME: run.t_final}
    columns = [*run.coordinates.items(), *run.speeds.items()]
    taken = {name for name, _ in columns}
    columns += [(f"output {name}" if name in taken else name, values) for name, values in run.outputs.items()]
    for name, values in columns:
        ends = (float(values[-1]), float(values.min()), float(values.max())) if len(values) else (math.nan,) * 3
        found[f"{name} end"], found[f"{name} min"], found[f"{name} max"] = ends
    return found


def events_text(events: list[dict[str, Any]]) -> str:
    """Return events as text: kind, element and time of each."""
    words = [f"{event['kind']} {event['element']} at {event['t']!r}" for event in events[:_MOST_EVENTS]]
    more = len(events) - len(words)
    return "; ".join([*words, f"and {more} more"] if more else words)


def _numbers(found: Any) -> dict[str, float]:
    """Return what `reduce` gave as floats by name. Raises _WrongResultError."""
    if type(found) is not dict and not isinstance(found, Mapping):
        raise _WrongResultError(f"it is to return a map from names to numbers, got {short_repr(found)}")
    numbers: dict[str, float] = {}
    for name, value in found.items():
        if type(name) is not str or not name or not name.isprintable():
            raise _WrongResultError(f"it is to name its numbers by text, not {short_repr(name)}")
        try:
            numbers[name] = float(value)
        except (TypeError, ValueError):
            raise _WrongResultError(f"it is to return numbers; {name} is {short_repr(value)}") from None
        except OverflowError:
            raise _WrongResultError(f"{name} is larger than any float") from None
    return numbers


# ----------------------------------------------------------------------------------------------------------------------
# Workers: threads of this process, or those of any executor.


Answer = tuple[Rows, float]
_SECONDS: Final = 0.25
"""About how long a task lasts: the work that is lost if a worker is killed."""
_MOST: Final = 2000
"""The most rows of a task, which bounds memory."""
_GROWTH: Final = 8
_AHEAD: Final = 2
"""Tasks given to each thread: the current one and the next."""
_OUT: Final = 64
"""Tasks given to an executor, whose number of workers is unknown."""


def processors() -> int:
    """Return how many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        return os.cpu_count() or 1


@dataclass(eq=False)
class Crew:
    """The workers: `submit(first, count)` gives a task to one; at most `most` are given out."""

    task: Task
    submit: Callable[[int, int], Future[Answer]]
    most: int
    stop: Callable[[], None]
    size: int = 1
    given: dict[Future[Answer], Span] = field(default_factory=dict)

    def work(self, spans: Sequence[Span]) -> Iterator[Rows]:
        """Yield the rows of all numbers in the spans, as they come."""
        left = list(reversed(spans))
        while left or self.given:
            while left and len(self.given) < self.most:
                first, end = left.pop()
                if end - first > self.size:
                    left.append((first + self.size, end))
                    end = first + self.size
                self.given[self._submitted(first, end - first)] = first, end
            for future in wait(self.given, return_when=FIRST_COMPLETED).done:
                span = self.given.pop(future)
                rows, seconds = self._answer(future)
                self._adapt(span, seconds)
                yield rows

    def finished(self) -> Iterator[Rows]:
        """Yield the rows that stopped workers had done."""
        for future in self.given:
            future.cancel()
        for future in [future for future in self.given if not future.cancelled()]:
            with suppress(Exception):
                rows, _ = future.result()
                if len(rows):
                    yield rows

    def _submitted(self, first: int, count: int) -> Future[Answer]:
        """Submit a task. Raises OutputError if the executor refuses it."""
        try:
            return self.submit(first, count)
        except RuntimeError as problem:
            raise OutputError(f"the executor takes no work: {_line(problem)}") from problem

    def _answer(self, future: Future[Answer]) -> Answer:
        """Return the rows of a task.

        Raises ArgumentError if `reduce` cannot be pickled, OutputError if the workers are gone.
        """
        try:
            return future.result()
        except MultibodyError:
            raise
        except Exception as problem:
            if self.task.reduce is not None and " pickle " in str(problem):
                sent = "reduce cannot be sent to workers, who take what is pickled; define it at the top of a module"
                raise ArgumentError(f"{sent} ({_line(problem)})") from problem
            raise OutputError(f"the workers do not answer any more: {_line(problem)}") from problem

    def _adapt(self, span: Span, seconds: float) -> None:
        """Choose the size of tasks by the time that one took."""
        fitting = int((span[1] - span[0]) * _SECONDS / max(seconds, 1e-6))
        self.size = max(1, min(fitting, _GROWTH * self.size, _MOST))


def _line(problem: Exception) -> str:
    return f"{type(problem).__name__}: {problem}".splitlines()[0]


@contextmanager
def crew(task: Task, workers: int, executor: Executor | None) -> Iterator[Crew]:
    """Give the workers: threads that stop between two runs, or those of an executor."""
    if executor is not None:
        lent = executor
        yield Crew(task, lambda first, count: lent.submit(task.timed, first, count), most=_OUT, stop=lambda: None)
        return
    stop = Event()
    with ThreadPoolExecutor(workers, thread_name_prefix="study") as pool:
        most = _AHEAD * workers
        yield Crew(task, lambda first, count: pool.submit(task.timed, first, count, stop), most=most, stop=stop.set)
