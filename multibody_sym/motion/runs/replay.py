"""Cached runs: their numbers, their compiled Programs, and the labels of their results, as text and numbers.

A run is recalled if everything that it follows from is the same; else, or if an entry is damaged, it is prepared anew.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np

from multibody_sym.dynamics.constraints.left_over import Redundancy
from multibody_sym.motion.prepare.records import Numbers, PreparedSystem, problem_of, values_of
from multibody_sym.motion.prepare.run_labels import as_json
from multibody_sym.motion.results.run_record import RunStart
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.program import loading
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import Compiled
from multibody_sym.records import dataclass

_WRONG: Final = (KeyError, TypeError, ValueError, AttributeError, IndexError)
"""What damaged entries raise."""


class Anew(Protocol):
    """Makes a recalled run from its model, for attributes that are seldom read."""

    def ready(self) -> PreparedSystem: ...

    def begin(self) -> RunStart: ...


def remember(key: str, asked: str, done: Trajectory, hints: Sequence[str] = ()) -> None:
    """Let `recalled(key, asked, ..)` find how a run begins and goes on; `asked` is a hash of all that it follows from.

    `hints` about the model are kept with it. Left out are runs not in C, interrupted, or with very many switches.
    """
    ready, integration = done.ready, done.integration
    if integration.failure is not None:
        return
    libraries = _Libraries()
    libraries.number(ready.compiled)
    stop = integration.events[-1] if done.stop is not None else None
    modes = None
    if done.modes is not None:
        from multibody_sym.motion.runs.recalled_modes import recorded_legs  # which few runs need

        modes = recorded_legs(done.modes, stop, integration.statistics, libraries.number)
    kept = {
        "formalism": ready.formalism,
        "numbers": [values.tolist() for values in ready.numbers],
        "problem": [libraries.number(done.problem.compiled), values_of(done.problem)],
        "told": as_json(ready.told),
        "start": {**ready.begun_from, "shifts": dict(ready.shifts)},
        "wheels": dict(ready.wheels) if ready.told.rolls else {},
        "redundancy": asdict(done.redundancy),
        "events": [dict(event) for event in done.begun],
        "modes": modes,
        "libraries": len(libraries.known),
        "hints": list(hints),
    }
    if libraries.in_c and (done.modes is None or modes is not None):
        text = json.dumps(kept)  # which keeps the order
        for number, compiled in reversed(list(enumerate(libraries.known.values()))):
            loading.remember(_key(key, number), compiled, {"asked": asked, "run": "" if number else text})


@dataclass(eq=False)
class _Libraries:
    """The compiled Programs of a run, by file."""

    known: dict[Path | None, Compiled] = field(default_factory=dict)

    def number(self, compiled: Compiled) -> int:
        """Return the number of a library, in the order of the first calls."""
        self.known.setdefault(compiled.path, compiled)
        return list(self.known).index(compiled.path)

    @property
    def in_c(self) -> bool:
        return all(compiled.backend == "c" and compiled.notice is None for compiled in self.known.values())


def recall_run(key: str, asked: str, anew: Anew, code: Native) -> RunStart | None:
    """Return the run that was remembered last under a key, if it is the one asked for; else None."""
    if code.backend == "python":
        return None
    found = _Found(key, asked, code)
    try:
        compiled, metadata = found.library(0)
        kept = json.loads(metadata["run"])
        others = [found.library(number)[0] for number in range(1, kept["libraries"])]
        return _make_start([compiled, *others], kept, anew)
    except _WRONG:
        return None


@dataclass(frozen=True)
class _Found:
    """The entries of a cached run."""

    key: str
    asked: str
    code: Native

    def library(self, number: int) -> tuple[Compiled, Mapping[str, Any]]:
        """Return a library and what was stored with it; raises KeyError for none, or that of another run."""
        found = loading.recall(_key(self.key, number), self.code)
        if found is None or found.compiled.backend != "c" or found.metadata.get("asked") != self.asked:
            raise KeyError(number)
        return found.compiled, found.metadata


def _key(key: str, number: int) -> str:
    return f"run {key} {number}" if number else f"run {key}"


def _make_start(compiled: list[Compiled], kept: Mapping[str, Any], anew: Anew) -> RunStart:
    numbers = Numbers(*(np.array(values, dtype=float) for values in kept["numbers"]))
    known = {name: kept[name] for name in ("told", "start", "wheels", "redundancy")}
    ready = PreparedSystem(kept["formalism"], compiled[0], numbers, lambda: anew.ready().begin(), None, known)
    told, _left_over = ready.told, Redundancy(**known["redundancy"])  # which raise for what is something else
    if (len(told.coordinates), len(told.speeds)) != (len(ready.q0), len(ready.u0)):
        raise ValueError("names and numbers are not of one mechanism")
    library, values = kept["problem"]
    problem, events = problem_of(values, compiled[library]), tuple(kept["events"])
    if kept["modes"] is None:
        return RunStart(ready, problem, None, events, tuple(kept["hints"]))
    from multibody_sym.motion.runs.recalled_modes import RecalledModes  # as above

    modes = RecalledModes.of(kept["modes"], compiled, anew.begin)
    return RunStart(ready, modes.begun(problem), modes, events, tuple(kept["hints"]))
