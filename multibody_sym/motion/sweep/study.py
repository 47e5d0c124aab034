"""`sweep`: many runs of one system, by workers; their table, its summary and figure."""

from __future__ import annotations

import json
import math
import os
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import field
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from itertools import takewhile
from threading import Event, Lock
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from multibody_sym.derivation.routes import formalism_name
from multibody_sym.errors import ArgumentError, InputError, MultibodyError, OutputError, Where, short_repr
from multibody_sym.mechanics.model_files import dumps
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.argument_checks import callback, door, flag, names, text
from multibody_sym.model.run_options import RunOptions, spelled_out
from multibody_sym.model.system import System
from multibody_sym.motion.prepare.settings import run_settings
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError, Progressed
from multibody_sym.motion.simulate import Prepared, prepared_by
from multibody_sym.motion.sweep import rows as tables
from multibody_sym.motion.sweep.plan import Plan, axes_of, digits, plan_of, plan_of_rows
from multibody_sym.motion.sweep.rows import (
    ENDING,
    FAILURE,
    TEXTS,
    Journal,
    Span,
    StudyRow,
    StudyRows,
    open_journal,
    results,
    unnamed_journal,
)
from multibody_sym.pictures.page.files import plain_style
from multibody_sym.pictures.plots import Panel, Plot, PlottedCurve, literal
from multibody_sym.pictures.plots import figure_of as plotted
from multibody_sym.program.backend import Native
from multibody_sym.program.cache import digest
from multibody_sym.records import ByName, dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.files import is_special, path_name
from multibody_sym.text.tables import data_package
from multibody_sym.text.values import Units, chosen_units

# ----------------------------------------------------------------------------------------------------------------------
# The workers of a study: runs from their numbers to rows, by threads or any executor.


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

    def rows(self, first: int, count: int, stop: Event | None = None) -> StudyRows:
        """Return the rows of the runs from number `first` on; fewer where it is asked to `stop`."""
        found: list[StudyRow] = []
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
        return StudyRows.of(first, found)

    def verify(self) -> None:
        """Raise InputError for what is wrong whatever the values are: the formalism, the backend, settings."""
        Native(backend=self.asked.backend).verify()
        formalism_name(self.asked.formalism, mechanism(self.system))
        settings = self.system.simulation
        if all(node.shadow is not None for node in settings.numbers):
            run_settings(settings, {})

    def timed(self, first: int, count: int, stop: Event | None = None) -> tuple[StudyRows, float]:
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

    def _row(self, made: Callable[[Progressed], Trajectory], look: Progressed) -> StudyRow:
        try:
            run = made(look)
        except FailedRunError as error:
            return StudyRow({TIME: error.trajectory.t_final}, failure=error.message)
        except MultibodyError as error:
            return StudyRow({}, failure=str(error).partition("\n")[0])
        if run.interrupted:
            raise StoppedError
        if self.reduce is not None:
            return self._reduced(run)
        return StudyRow(ends_and_extremes(run.whole), events_text(run.events))

    def _reduced(self, run: Trajectory) -> StudyRow:
        assert self.reduce is not None
        try:
            return StudyRow(_numbers(self.reduce(run)))
        except _WrongResultError as wrong:
            return StudyRow({}, failure=f"{REDUCE_FAILED}: {wrong}")
        except Exception as error:
            told = str(error).partition("\n")[0].encode(errors="backslashreplace").decode()
            return StudyRow({}, failure=f"{REDUCE_FAILED}: {type(error).__name__}: {told}"[:_LONGEST])


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


Answer = tuple[StudyRows, float]
_SECONDS: Final = 0.25
"""About how long a task lasts: the work that is lost if a worker is killed."""
_MOST_ROWS: Final = 2000
"""The most rows of a task, which bounds memory."""
_GROWTH: Final = 8
_AHEAD: Final = 2
"""Tasks given to each thread: the current one and the next."""
_OUT: Final = 64
"""Tasks given to an executor, whose number of workers is unknown."""


@dataclass(eq=False)
class Crew:
    """The workers: `submit(first, count)` gives a task to one; at most `most` are given out."""

    task: Task
    submit: Callable[[int, int], Future[Answer]]
    most: int
    stop: Callable[[], None]
    size: int = 1
    given: dict[Future[Answer], Span] = field(default_factory=dict)

    def work(self, spans: Sequence[Span]) -> Iterator[StudyRows]:
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

    def finished(self) -> Iterator[StudyRows]:
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
        self.size = max(1, min(fitting, _GROWTH * self.size, _MOST_ROWS))


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


# ----------------------------------------------------------------------------------------------------------------------
# `sweep`: many runs of one system, their table, its summary and figure.


_TOLD: Final = 100
"""The most failures that `as_json` lists."""


@dataclass(frozen=True, eq=False, repr=False)
class Study(ByName):
    """The rows of a study: `study["theta max"]` is a column (runs,), in SI units, nan where a run failed.

    `path` is the file of the table, None where there is none; `about` tells model, plan and version; `computed` is how
    many runs were done now, where others were found in a journal.
    """

    plan: Plan
    path: str | None
    about: Mapping[str, Any]
    computed: int
    content: Mapping[str, NDArray[Any]] | None = None

    def __len__(self) -> int:
        return len(self.plan)

    def __repr__(self) -> str:
        return f"<Study of {self.about['system']}: {len(self)} runs over {', '.join(self.varied)}>"

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column (runs,) by name, in SI units. Raises InputError for another name."""
        if not isinstance(name, str):
            raise ArgumentError(f"a study is asked by the name of a column, not by {short_repr(name)}")
        if name not in self.columns:
            raise InputError(f"no column of this study is called {name!r}", word=name, known=self.columns)
        return self.columns[name]

    def keys(self) -> tuple[str, ...]:
        """Return the names of the columns."""
        return tuple(self.columns)

    @property
    def varied(self) -> tuple[str, ...]:
        """What is varied."""
        return self.plan.names

    @cached_property
    def columns(self) -> Mapping[str, NDArray[Any]]:
        """All columns (runs,) by name, numbers and texts; read from the file if there is one."""
        if self.content is not None:
            return self.content
        assert self.path is not None
        return tables.read(self.path)[0]

    @property
    def failures(self) -> dict[int, str]:
        """Why runs have no result, by their numbers."""
        reasons = self.columns[FAILURE]
        return {int(k): str(reasons[k]) for k in np.flatnonzero(reasons != "")}

    @property
    def results(self) -> tuple[str, ...]:
        """The columns of numbers that runs gave."""
        return tables.results(self.plan, self.columns)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `sweep --json` prints; nan becomes None."""
        failures, table = self.failures, dict[str, Any]()
        if not self.path:
            plain = ((name, column.dtype.kind, column.tolist()) for name, column in self.columns.items())
            table = {
                "table": {
                    name: [x if math.isfinite(x) else None for x in values] if kind == "f" else values
                    for name, kind, values in plain
                }
            }
        return {
            "runs": len(self),
            "computed": self.computed,
            "failed": len(failures),
            "failures": dict(list(failures.items())[:_TOLD]),
            "varied": list(self.varied),
            "results": list(self.results),
            "about": dict(self.about),
            "output": self.path,
            **table,
        }

    @door
    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        show: str | Sequence[str] | None = None,
        units: str | Sequence[str] | Units | None = None,
    ) -> Any:
        """Return a matplotlib figure over one or two varied values, written to `path` if one is given.

        `show` names columns, as text with commas or a list; without it these are all that change, of maps ends alone.
        It has a panel for each unit, SI but for those that `units` chooses, such as `mm,deg`.
        Raises InputError, and OutputError where matplotlib is missing or the file cannot be written.
        """
        from multibody_sym.pictures.page.files import write_figure

        listed = [name.strip() for name in show.split(",")] if isinstance(show, str) else show
        asked = None if show is None else names("show", listed)
        figure = figure_of(self.plan, self.about, self.columns, asked, chosen_units(units))
        if path is not None:
            write_figure(figure, path)
        return figure

    def to_numpy(self) -> Floats:
        """Return the columns of numbers (runs, columns): the number of the run, what is varied, the results."""
        return np.column_stack([self.columns[name] for name in (tables.RUN, *self.varied, *self.results)])

    def to_dataframe(self) -> Any:
        """Return the table as a pandas DataFrame, by number of the run. Raises OutputError where pandas is missing."""
        pandas = data_package("pandas", "a DataFrame")
        frame = pandas.DataFrame(dict(self.columns)).astype({tables.RUN: int}).set_index(tables.RUN)
        frame.attrs.update(self.about)
        return frame

    def to_xarray(self) -> Any:
        """Return the table as an xarray Dataset: of a grid with a dimension for each varied value, else by run.

        A grid in which a value stands twice is by run, too: a dimension has each of its values once.
        Columns have their SI units, where they are known. Raises OutputError where xarray is missing.
        """
        axes: dict[str, NDArray[Any]] = {axis.name: axis.value(np.arange(axis.size)) for axis in self.plan.axes}
        found, shape = (*self.results, *TEXTS), self.plan.shape
        if self.plan.method != "grid" or any(len(np.unique(values)) < len(values) for values in axes.values()):
            axes, found, shape = {tables.RUN: np.arange(len(self))}, (*self.varied, *found), (len(self),)
        units = self.about.get("units", {})
        known = {name: {"units": units[_quantity(name)]} for name in (*axes, *found) if _quantity(name) in units}
        columns = {name: (tuple(axes), self.columns[name].reshape(shape), known.get(name)) for name in found}
        coordinates = {name: (name, values, known.get(name)) for name, values in axes.items()}
        return data_package("xarray", "a Dataset").Dataset(columns, coords=coordinates, attrs=dict(self.about))



# ----------------------------------------------------------------------------------------------------------------------
# The summary of a study.


_MOST_COLUMNS: Final = 24
_REASONS: Final = 5


def study_summary(study: Study) -> str:
    """Return how many runs were done, in what range their results are, and why some have none."""
    failures = study.failures
    again = "" if study.computed == len(study) else f", {len(study) - study.computed} of them before"
    lines = [f"{study.about['system']}: {len(study)} runs over {', '.join(study.varied)}{again}"]
    for name in study.results[:_MOST_COLUMNS]:
        values = study[name]
        found = values[np.isfinite(values)]
        missing = len(values) - len(found) - len(failures)
        without = f" ({missing} runs have no value)" if missing > 0 else ""
        if len(found):
            lines.append(f"  {name}: {found.min():.6g} to {found.max():.6g}{without}")
        elif missing > 0:
            lines.append(f"  {name}: no value in {missing} runs")
    if len(study.results) > _MOST_COLUMNS:
        lines.append(f"  and {len(study.results) - _MOST_COLUMNS} columns more")
    if failures:
        lines.append(f"{len(failures)} runs failed:")
        reasons = Counter(failures.values()).most_common()
        lines += [f"  {count} x {reason}" for reason, count in reasons[:_REASONS]]
        if len(reasons) > _REASONS:
            lines.append(f"  and {len(reasons) - _REASONS} reasons more")
    return "\n".join(lines)


# ----------------------------------------------------------------------------------------------------------------------
# A study as a figure: its results over one value that is varied, or as maps over two.


_DOTTED: Final = 200
"""Runs that are so few that each has a dot."""


@dataclass(frozen=True, eq=False)
class _Shown:
    """The `columns` of a study with these `names`, in `units`; `known`: their SI units."""

    plan: Plan
    system: str
    columns: Mapping[str, Floats]
    names: Sequence[str]
    known: Mapping[str, str]
    units: Units

    def __getitem__(self, name: str) -> Floats:
        found: Floats = self.columns[name] / self.units.size(self.known.get(_quantity(name), ""))
        return found

    def named(self, name: str) -> str:
        """Return a name with its unit."""
        return self.units.named(name, self.known.get(_quantity(name), ""))

    @property
    def title(self) -> str:
        """What the figure is of."""
        return f"{self.system}: {len(self.plan)} runs"


def figure_of(
    plan: Plan, about: Mapping[str, Any], columns: Mapping[str, Any], show: Sequence[str] | None, units: Units
) -> Any:
    """Return a matplotlib figure of the columns that are to be shown; by default of all that change, in maps of ends.

    Over one varied value it has a panel for each unit with all curves in it; over two a map of each column, as cells of
    a grid or as points of samples. Raises InputError for unknown columns, and for three values.
    """
    if len(plan.names) > 2:
        message = f"a figure is over one or two varied values; here are {len(plan.names)}: {', '.join(plan.names)}"
        raise InputError(message)
    known = results(plan, columns)
    for name in show or ():
        if name not in known:
            raise InputError(f"no column of results is called {name!r}", word=name, known=known)
    names = tuple(show or ())
    if not names:  # what is not the same in all runs, of maps the values at the end
        finite = {name: columns[name][np.isfinite(columns[name])] for name in known}
        names = tuple(name for name, values in finite.items() if len(values) and values.min() < values.max())
        names = names or tuple(known[:1])
        if len(plan.names) == 2:
            ends = tuple(name for name in names if _quantity(name) == name or name.endswith(" end"))
            names = ends or names
    if not names:
        failed = all(columns[FAILURE] != "")
        raise InputError(f"there is no result to plot: {'every run failed' if failed else 'no run gave a number'}")
    study = _Shown(plan, about["system"], columns, names, about.get("units", {}), units)
    if len(plan.names) == 1:
        return plotted(_curves(study))
    with plain_style():
        return _maps(study)


def _quantity(name: str) -> str:
    return name.removesuffix(" end").removesuffix(" min").removesuffix(" max")


def _curves(study: _Shown) -> Plot:
    """Return the curves over the one value that is varied, by panels; what has no known unit has one of its own."""
    (varied,) = study.plan.names
    order = np.argsort(study[varied], kind="stable")
    panels: dict[tuple[str, str], list[PlottedCurve]] = {}
    for name in study.names:
        quantity = _quantity(name)
        unit = study.units.of(study.known.get(quantity, ""))
        curve = PlottedCurve(name, study[varied][order], study[name][order])
        panels.setdefault((unit, "" if unit else quantity), []).append(curve)
    found = tuple(Panel(unit, tuple(curves)) for (unit, _), curves in panels.items())
    return Plot(study.title, study.named(varied), found, dots=len(study.plan) <= _DOTTED)


def _maps(study: _Shown) -> Any:
    from multibody_sym.pictures.notebook_figure import ShownFigure

    columns = study.names
    wide = min(len(columns), 3)
    high = -(-len(columns) // wide)
    figure = ShownFigure(figsize=(1.0 + 4.0 * wide, 0.6 + 3.2 * high), layout="constrained")
    axes = figure.subplots(high, wide, squeeze=False)
    x, y = study.plan.names
    for axis, name in zip(axes.flat, columns, strict=False):
        if study.plan.method == "grid":
            first, second = (study[name].reshape(study.plan.shape) for name in (x, y))
            drawn = axis.pcolormesh(first, second, study[name].reshape(study.plan.shape), shading="nearest")
        else:
            drawn = axis.scatter(study[x], study[y], c=study[name], s=8)
        figure.colorbar(drawn, ax=axis)
        axis.set_title(literal(study.named(name)), fontsize="medium")
        axis.set_xlabel(literal(study.named(x)))
        axis.set_ylabel(literal(study.named(y)))
    for axis in axes.flat[len(columns) :]:
        axis.set_visible(False)
    figure.suptitle(literal(study.title))
    return figure


# ----------------------------------------------------------------------------------------------------------------------
# `sweep`: many runs of one system, whose parameters and start values are varied.


class StudyNotice(UserWarning):
    """A study that is killed begins anew: nothing names what its `reduce` computes."""


class _WrongReduceError(Exception):
    """`reduce` makes a row of no run."""


Counted = Callable[[int, int], None]
_NOTHING_KEPT: Final = "no run is kept: a study with output= keeps those that are done"
_KEYLESS: Final = "give key=, a text that names what reduce computes, and the same call goes on from its runs"
_TRIED: Final = 20
"""Runs after which a `reduce` that failed for all is wrong."""


@spelled_out(RunOptions)
def sweep(
    system: System,
    vary: Mapping[str, Any] | None = None,
    *,
    rows: Sequence[Mapping[str, Any]] | None = None,
    sample: int | None = None,
    seed: int | None = None,
    sobol: bool = False,
    reduce: Reduce | None = None,
    key: str | None = None,
    output: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    on_progress: Counted | None = None,
    **options: Unpack[RunOptions],
) -> Study:
    """Return what many runs of a system give, one row a run, whatever happens to single ones.

    `vary`: parameters, coordinates and speeds at the start by name, each with a list of values, a range
    (low, high, count), or text as on the command line: `1:10:100`, `.5,1,2`, `10:60:6 deg`. All combinations are run;
    with `sample`, so many of them, drawn from a `seed` independently or evenly (`sobol`), from ranges (low, high) too.
    `rows`, in place of all these: the values of each run, such as `[{"m": 1, "l": "30 cm"}, {"m": 2, "l": 0.5}]`.
    `reduce`: a function from a Trajectory to a map of numbers, the columns of the table; without it these are end, min
    and max of each coordinate, speed and output, and what happened. `output`: the table, .csv, .npz or .parquet; rows
    are kept in `<output>.journal` meanwhile, from which the same call goes on if it was killed, or failed.
    `key`: a text that names what `reduce` computes; where `reduce` changes, so does `key`. Without one no row of
    `reduce` is kept, which a warning says.
    `workers`: threads, by default one a processor; `executor`: any of concurrent.futures in their place, such as Dask's
    `Client.get_executor()`, to which the system and `reduce` are sent pickled. `on_progress` is called with the number
    of runs that are done, and that of all. `t_end` .. `backend`: as for `simulate`.
    Raises InputError for what cannot be run at all, and OutputError. A run that fails is a row with its reason, and so
    is one for which `reduce` does, unless no other is among the first 20 runs: that ends the study with InputError.
    """
    prepared = prepared_by(system, options)
    if prepared.sampled is not None:
        message = "a sweep takes no functions: call `run` of what `prepare` returns in a loop"
        raise ArgumentError(message, where=Where(path=("inputs",)))
    sobol = flag("sobol", sobol)
    if rows is not None:
        plan = plan_of_rows(prepared.system, rows, vary=vary, sample=sample, seed=seed, sobol=sobol)
    else:
        plan = plan_of(axes_of(prepared.system, {} if vary is None else vary), sample, seed, sobol)
    task = Task(prepared, plan, callback("reduce", reduce))
    task.verify()
    if key is not None and (reduce is None or not text("key", key)):
        message = "key names what reduce computes: give it a text, with a reduce"
        raise InputError(message, where=Where(path=("key",)))
    many = _workers(workers)
    if executor is not None and not callable(getattr(executor, "submit", None)):
        raise ArgumentError(f"executor is to be one of concurrent.futures, got {short_repr(executor)}")
    return _done(task, key or "", output, many, executor, callback("on_progress", on_progress))


def _done(
    task: Task, key: str, output: Any, workers: int, executor: Executor | None, on_progress: Counted | None
) -> Study:
    """Do the runs that are not in the journal, and return the study."""
    journal = _journal(output, task, key)
    try:
        computed = _compute_runs(task, journal, workers, executor, on_progress)
        about = {**task.about, "units": task.units}
        content = tables.Content(task.plan, journal, about)
        if output is None:
            return Study(task.plan, None, about, computed, tables.gather_columns(content))
        path = tables.write(content, path_name(output))
        found = tables.gather_columns(content) if is_special(path) else None  # what went into a pipe is not read again
        journal.discard()
        return Study(task.plan, path, about, computed, found)
    except _WrongReduceError as wrong:
        journal.discard()
        raise InputError(str(wrong)) from None
    except MultibodyError as error:
        error.message += journal.told
        raise
    except KeyboardInterrupt:
        raise KeyboardInterrupt(journal.told.removeprefix("; ") or _NOTHING_KEPT) from None
    finally:
        journal.close()


def _compute_runs(
    task: Task, journal: Journal, workers: int, executor: Executor | None, on_progress: Counted | None
) -> int:
    """Do the runs that are not in the journal, keep them there, and return their number."""
    total, before = len(task.plan), len(journal)
    show = on_progress or (lambda _done, _total: None)
    left = list(journal.left(total))
    with crew(task, workers, executor) as hired:
        try:
            _verify_reduce(task, journal)
            for rows in hired.work(left):
                journal.add(rows)
                show(len(journal), total)
                if rows.first < _TRIED:
                    _verify_reduce(task, journal)
        finally:
            hired.stop()
            for rows in hired.finished():
                journal.add(rows)
    return len(journal) - before


def _verify_reduce(task: Task, journal: Journal) -> None:
    """Raise _WrongReduceError if `reduce` fails for all of the first runs, as soon as these are known."""
    first = min(_TRIED, len(task.plan))
    if task.reduce is None or any(begin < first for begin, _ in journal.left(len(task.plan))):
        return
    parts = takewhile(lambda rows: rows.first < first, journal)
    reasons = {rows.first + k: text for rows in parts for k, text in enumerate(rows.texts[FAILURE])}
    failed = [k for k in range(first) if reasons[k].startswith(REDUCE_FAILED)]
    if failed and all(reasons[k] for k in range(first)):
        values = zip(task.plan.names, task.plan.values(failed[0], 1)[0], strict=True)
        given = ", ".join(f"{name} = {x:g}" for name, x in values)
        raise _WrongReduceError(f"{REDUCE_FAILED} for {given}{reasons[failed[0]].removeprefix(REDUCE_FAILED)}")


def _journal(output: Any, task: Task, key: str) -> Journal:
    """Return the journal of a study: beside its table, or unnamed where there is none, a pipe, or no key."""
    if output is None:
        return unnamed_journal()
    name = path_name(output)
    tables.verify_format(name)
    if is_special(name):
        return unnamed_journal()
    if os.path.isdir(name):
        raise OutputError("the file cannot be written: it is a folder", where=Where(file=name))
    if task.reduce is not None and not key:
        warnings.warn(f"no run is kept until the table is whole: {_KEYLESS}", StudyNotice, stacklevel=6)
        return unnamed_journal(_KEYLESS)
    return open_journal(os.path.realpath(name) + ENDING, digest(task.key, key), len(task.plan))


def _workers(given: Any) -> int:
    """Return how many threads are asked for, by default one for each processor that this process may use."""
    if given is None:
        try:
            return len(os.sched_getaffinity(0))
        except AttributeError:  # not Linux
            return os.cpu_count() or 1
    if not digits(given) or not 1 <= int(given) <= 1000:
        message = f"expected a number of workers, from 1 to 1000, got {short_repr(given)}"
        raise InputError(message, where=Where(path=("workers",)))
    return int(given)
