"""`sweep`: many runs of one system, whose parameters and start values are varied."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from itertools import takewhile
from typing import Any, Final

from multibody_sym.errors import ArgumentError, InputError, MultibodyError, OutputError, Where, shown
from multibody_sym.formats.files import is_special, path_name
from multibody_sym.model.declaration.doors import callback, flag, text
from multibody_sym.model.declaration.system import System
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.runtime.cache import digest
from multibody_sym.runtime.loading import Backend
from multibody_sym.simulation.simulate import run_by
from multibody_sym.studies import tables
from multibody_sym.studies.axes import axes_of, digits
from multibody_sym.studies.journal import ENDING, Journal, opened, unnamed
from multibody_sym.studies.plan import plan_of
from multibody_sym.studies.rows import FAILURE
from multibody_sym.studies.study import Study
from multibody_sym.studies.task import REDUCE_FAILED, Reduce, Task
from multibody_sym.studies.workers import crew, processors


class StudyNotice(UserWarning):
    """A study that is killed begins anew: nothing names what its `reduce` computes."""


class _WrongReduceError(Exception):
    """There is no run of which `reduce` makes a row."""


Counted = Callable[[int, int], None]
_NOTHING_KEPT: Final = "no run is kept: a study with output= keeps those that are done"
_KEYLESS: Final = "give key=, a text that names what reduce computes, and the same call goes on from its runs"
_TRIED: Final = 20
"""Runs after which a `reduce` that has failed for all is taken to be wrong."""


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
    t_end: Any = None,
    method: str | None = None,
    step: Any = None,
    rtol: Any = None,
    atol: Any = None,
    samples: Any = None,
    constraints: Any = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
    native: bool = False,
    backend: Backend | None = None,
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
    changed = Changes(parameters, initial, inputs, coordinates, project).of(system)
    settings = {"t_end": t_end, "method": method, "step": step, "rtol": rtol, "atol": atol, "samples": samples}
    asked = run_by(changed, settings, constraints)
    plan = plan_of(axes_of(asked, vary), sample, seed, flag("sobol", sobol))
    task = Task(asked, plan, callback("reduce", reduce), formalism, flag("native", native), backend)
    task.verify()
    named = _key(key, reduce)
    return _done(task, named, output, _workers(workers), _executor(executor), callback("on_progress", on_progress))


def _done(
    task: Task, key: str, output: Any, workers: int, executor: Executor | None, on_progress: Counted | None
) -> Study:
    """Return the study when all its runs are done, those in its journal before."""
    journal = _journal(output, task, key)
    try:
        computed = _computed(task, journal, workers, executor, on_progress)
        return _study(task, journal, output, computed)
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


def _computed(
    task: Task, journal: Journal, workers: int, executor: Executor | None, on_progress: Counted | None
) -> int:
    """Let the runs be done that are not in the journal, and return their number. What is done by then is kept."""
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


def _study(task: Task, journal: Journal, output: Any, computed: int) -> Study:
    about = {**task.about, "units": task.units}
    content = tables.Content(task.plan, journal, about)
    if output is None:
        return Study(task.plan, None, about, computed, tables.gathered(content))
    path = tables.write(content, path_name(output))
    found = tables.gathered(content) if is_special(path) else None  # what went into a pipe is not read again
    journal.discard()
    return Study(task.plan, path, about, computed, found)


def _journal(output: Any, task: Task, key: str) -> Journal:
    """Return the journal of a study: beside its table, or unnamed where there is none, a pipe, or no key."""
    if output is None:
        return unnamed()
    name = path_name(output)
    tables.verify_format(name)
    if is_special(name):
        return unnamed()
    if os.path.isdir(name):
        raise OutputError("the file cannot be written: it is a folder", where=Where(file=name))
    if task.reduce is not None and not key:
        warnings.warn(f"no run is kept until the table is whole: {_KEYLESS}", StudyNotice, stacklevel=5)
        return unnamed(_KEYLESS)
    return opened(os.path.realpath(name) + ENDING, digest(task.key, key), len(task.plan))


def _key(key: Any, reduce: Reduce | None) -> str:
    """Return the name of what `reduce` computes; empty where there is none. Raises InputError for one of nothing."""
    if key is None:
        return ""
    if reduce is None or not text("key", key):
        message = "key names what reduce computes: give it a text, with a reduce"
        raise InputError(message, where=Where(path=("key",)))
    return str(key)


def _workers(given: Any) -> int:
    if given is None:
        return processors()
    if not digits(given) or not 1 <= int(given) <= 1000:
        message = f"expected a number of workers, from 1 to 1000, got {shown(given)}"
        raise InputError(message, where=Where(path=("workers",)))
    return int(given)


def _executor(given: Any) -> Executor | None:
    if given is not None and not callable(getattr(given, "submit", None)):
        raise ArgumentError(f"executor is to be one of concurrent.futures, got {shown(given)}")
    return given  # type: ignore[no-any-return]
