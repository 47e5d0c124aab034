"""Runs that were prepared before: their numbers, their compiled Programs, and what results tell of them.

What is remembered is text and numbers. A run is recalled where all that it follows from is the same; else, and where
anything is odd, it is prepared anew.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.constraints.left_over import Redundancy
from multibody_sym.integrators.methods.methods import METHODS
from multibody_sym.integrators.pairing import Pairing
from multibody_sym.runtime import loading
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.runtime.problem import Problem
from multibody_sym.simulation.runs.runnable import Numbers, Runnable
from multibody_sym.simulation.runs.told import as_json
from multibody_sym.simulation.trajectory import Trajectory

_PLAIN: Final = (
    *("t0", "t_end", "step", "rtol", "atol", "samples", "project", "max_steps", "contradiction", "closure"),
    "independent",
)
"""Numbers of a problem that are remembered as they are."""
_STORED: Final = frozenset(
    {*_PLAIN, "compiled", "method", "q0", "u0", "parameters", "modes", "terminal", "pairs", "like"}
)


def remember(key: str, asked: str, done: Trajectory) -> None:
    """Let `recalled(key, asked, ..)` find how a run begins; `asked` is a hash of all that it follows from.

    It is left out where it is not in C, goes from mode to mode, comes from an impact or was interrupted.
    """
    ready, problem = done.ready, done.problem
    in_c = ready.compiled.backend == "c" and ready.compiled.notice is None
    begins_alone = not done.begun and done.modes is None and not ready.told.one_way and _is_plain(problem)
    if not in_c or not begins_alone or done.integration.failure is not None:
        return
    kept = {
        "formalism": ready.formalism,
        "numbers": [values.tolist() for values in ready.numbers],
        "problem": _of_problem(problem),
        "told": as_json(ready.told),
        "shifts": dict(ready.shifts),
        "redundancy": asdict(done.redundancy),
    }
    loading.remember(_key(key), ready.compiled, {"asked": asked, "run": json.dumps(kept)})  # a text keeps the order


def recalled(
    key: str,
    asked: str,
    again: Callable[[], Runnable],
    *,
    native: bool = False,
    backend: Backend | None = None,
) -> tuple[Runnable, Problem] | None:
    """Return what was remembered last under a key, if it is what is asked; None where there is nothing of use.

    `again` makes the same from the model, for what is seldom asked of a run.
    """
    if backend == "python":
        return None
    found = loading.recall(_key(key), native=native, backend=backend)
    if found is None or found.compiled.backend != "c" or found.metadata.get("asked") != asked:
        return None
    try:
        return _made(found.compiled, json.loads(found.metadata["run"]), again)
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _key(key: str) -> str:
    return f"run {key}"


def _is_plain(problem: Problem) -> bool:
    """Tell whether nothing of a problem is left out."""
    others = (field for field in fields(Problem) if field.name not in _STORED)
    return all(getattr(problem, field.name) == field.default for field in others)


def _of_problem(problem: Problem) -> dict[str, Any]:
    pairs = problem.pairs
    return {
        **{name: getattr(problem, name) for name in _PLAIN},
        "method": problem.method.name,
        "parameters": problem.parameters.tolist(),
        "modes": problem.modes.tolist(),
        "terminal": problem.terminal,
        "pairs": None if pairs is None else [pairs.nq, pairs.plain, pairs.balls],
    }


def _made(compiled: Compiled, kept: Mapping[str, Any], again: Callable[[], Runnable]) -> tuple[Runnable, Problem]:
    numbers = Numbers(*(np.array(values, dtype=float) for values in kept["numbers"]))
    known = {name: kept[name] for name in ("told", "shifts", "redundancy")}
    ready = Runnable(kept["formalism"], compiled, numbers, lambda: again().begin(), None, known)
    told, _left_over = ready.told, Redundancy(**known["redundancy"])  # which raise for what is something else
    if (len(told.coordinates), len(told.speeds)) != (len(ready.q0), len(ready.u0)):
        raise ValueError("names and numbers are not of one mechanism")
    given = kept["problem"]
    pairs = given["pairs"]
    problem = Problem(
        compiled=compiled,
        method=METHODS[given["method"]],
        q0=ready.q0,
        u0=ready.u0,
        parameters=np.array(given["parameters"], dtype=float),
        modes=np.array(given["modes"], dtype=float),
        terminal=tuple(given["terminal"]),
        pairs=None if pairs is None else Pairing(pairs[0], *(_pairs(part) for part in pairs[1:])),
        **{name: given[name] for name in _PLAIN},
    )
    return ready, problem


def _pairs(part: Any) -> tuple[tuple[int, int], ...]:
    return tuple((a, b) for a, b in part)
