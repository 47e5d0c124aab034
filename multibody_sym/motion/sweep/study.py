"""`sweep`: many runs of one system, their table, its summary and figure."""

from __future__ import annotations

import math
import os
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import cached_property
from itertools import takewhile
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import ArgumentError, InputError, MultibodyError, OutputError, Where, short_repr
from multibody_sym.model.argument_checks import callback, door, flag, names, text
from multibody_sym.model.run_options import RunOptions, spelled_out
from multibody_sym.model.system import System
from multibody_sym.motion.simulate import prepared_by
from multibody_sym.motion.sweep import rows
from multibody_sym.motion.sweep import rows as tables
from multibody_sym.motion.sweep.plan import Plan, axes_of, digits, plan_of
from multibody_sym.motion.sweep.rows import ENDING, FAILURE, TEXTS, Journal, open_journal, results, unnamed_journal
from multibody_sym.motion.sweep.task import REDUCE_FAILED, Reduce, Task, crew, processors
from multibody_sym.pictures.page.plot_files import plain_style
from multibody_sym.pictures.plots import Panel, Plot, PlottedCurve, literal
from multibody_sym.pictures.plots import figure_of as plotted
from multibody_sym.program.cache import digest
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.files import is_special, path_name
from multibody_sym.text.values import Units, chosen_units

_TOLD: Final = 100
"""The most failures that `as_json` lists."""


@dataclass(frozen=True, eq=False, repr=False)
class Study:
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
        if not isinstance(name, str):
            raise ArgumentError(f"a study is asked by the name of a column, not by {short_repr(name)}")
        if name not in self.columns:
            raise InputError(f"no column of this study is called {name!r}", word=name, known=self.columns)
        return self.columns[name]

    def keys(self) -> tuple[str, ...]:
        """Return the names of the columns."""
        return tuple(self.columns)

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.columns

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
        return rows.read(self.path)[0]

    @property
    def failures(self) -> dict[int, str]:
        """Why runs have no result, by their numbers."""
        reasons = self.columns[FAILURE]
        return {int(k): str(reasons[k]) for k in np.flatnonzero(reasons != "")}

    @property
    def results(self) -> tuple[str, ...]:
        """The columns of numbers that runs gave."""
        return rows.results(self.plan, self.columns)

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
        from multibody_sym.pictures.page.plot_files import write_figure

        listed = [name.strip() for name in show.split(",")] if isinstance(show, str) else show
        asked = None if show is None else names("show", listed)
        figure = figure_of(self.plan, self.about, self.columns, asked, chosen_units(units))
        if path is not None:
            write_figure(figure, path)
        return figure

    def to_dataframe(self) -> Any:
        """Return the table as a pandas DataFrame, by number of the run. Raises OutputError where pandas is missing."""
        try:
            import pandas
        except ImportError:
            raise OutputError("a DataFrame needs pandas: pip install pandas") from None
        frame = pandas.DataFrame(dict(self.columns)).astype({rows.RUN: int}).set_index(rows.RUN)
        frame.attrs.update(self.about)
        return frame

    def to_xarray(self) -> Any:
        """Return the table as an xarray Dataset: of a grid with a dimension for each varied value, else by run.

        Raises OutputError where xarray is missing.
        """
        try:
            import xarray
        except ImportError:
            raise OutputError("a Dataset needs xarray: pip install xarray") from None
        shape = self.plan.shape
        if self.plan.method == "grid":
            axes: dict[str, NDArray[Any]] = {axis.name: axis.value(np.arange(axis.size)) for axis in self.plan.axes}
            found = (*self.results, *TEXTS)
        else:
            axes, found = {rows.RUN: np.arange(len(self))}, (*self.varied, *self.results, *TEXTS)
        columns = {name: (tuple(axes), self.columns[name].reshape(shape)) for name in found}
        return xarray.Dataset(columns, coords=axes, attrs=dict(self.about))



# ----------------------------------------------------------------------------------------------------------------------
# The summary of a study.


_MOST: Final = 24
_REASONS: Final = 5


def study_summary(study: Study) -> str:
    """Return how many runs were done, in what range their results are, and why some have none."""
    failures = study.failures
    again = "" if study.computed == len(study) else f", {len(study) - study.computed} of them before"
    lines = [f"{study.about['system']}: {len(study)} runs over {', '.join(study.varied)}{again}"]
    for name in study.results[:_MOST]:
        values = study[name]
        found = values[np.isfinite(values)]
        missing = len(values) - len(found) - len(failures)
        without = f" ({missing} runs have no value)" if missing > 0 else ""
        if len(found):
            lines.append(f"  {name}: {found.min():.6g} to {found.max():.6g}{without}")
        elif missing > 0:
            lines.append(f"  {name}: no value in {missing} runs")
    if len(study.results) > _MOST:
        lines.append(f"  and {len(study.results) - _MOST} columns more")
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
    vary: Mapping[str, Any],
    *,
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
    plan = plan_of(axes_of(prepared.system, vary), sample, seed, flag("sobol", sobol))
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
    if given is None:
        return processors()
    if not digits(given) or not 1 <= int(given) <= 1000:
        message = f"expected a number of workers, from 1 to 1000, got {short_repr(given)}"
        raise InputError(message, where=Where(path=("workers",)))
    return int(given)
