"""Cached runs: their numbers, their compiled Programs, and the labels of their results, as text and numbers.

A run is recalled if everything that it follows from is the same; else, or if an entry is damaged, it is prepared anew.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.motion.loop.integrate import End, Leg, LegAnswer, Switch, chain, integrate
from multibody_sym.motion.loop.problem import Event, Loop, Problem, Progress, Statistics
from multibody_sym.motion.prepare.records import (
    LegSamples,
    Numbers,
    PreparedSystem,
    ResolvedAlone,
    RunLabels,
    as_json,
    labels_from_json,
    leg_samples,
    problem_of,
    values_of,
)
from multibody_sym.motion.results.samples import Departed, EnergyAccount, FrictionWork, RunInModes, RunStart
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.program import loading
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import Compiled
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from multibody_sym.mechanics.mechanism import Mechanism
    from multibody_sym.motion.results.integrals import FineLeg, ImpactBalance
    from multibody_sym.motion.switching.legs import ModeLeg as LegInMode
    from multibody_sym.scalars.node import Node

# ----------------------------------------------------------------------------------------------------------------------
# A run from mode to mode that was made before: it goes the same way, which is verified at each switch.
#
# What laws decide at a switch follows from the state there. A run that comes to its switches at the times, to the last
# bit, at which it came to them before goes on as it did then, and nothing is decided anew. One that does not, as with
# other functions of the system's library, is made from its model after all.


MOST: Final = 1000
"""Switches and impacts of a run that are remembered: reading them takes some 10 ms."""


def recorded_legs(modes: RunInModes, stop: Event | None, taken: Statistics, number: Callable[[Compiled], int]) -> Any:
    """Return a run that was made as JSON values; None if it is too long.

    `stop` is what ended it, `taken` what it took, `number` the number of what a leg has compiled.
    """
    if len(modes.legs) + len(modes.jumps) > MOST:
        return None
    told: dict[int, tuple[int, RunLabels]] = {}
    legs: list[Any] = []
    first = values_of(modes.legs[0].problem) if modes.legs else {}
    for leg in modes.legs:
        mechanism = leg.program.mechanism
        mode, _ = told.setdefault(id(mechanism), (len(told), RunLabels(ResolvedAlone(mechanism))))
        own = {name: x for name, x in values_of(leg.problem).items() if not legs or x != first[name]}
        legs.append([mode, number(leg.of.compiled), float(leg.until), own])
    return {
        "legs": legs,
        "modes": [as_json(each) for _, each in told.values()],
        "answers": [[x.leg, float(x.time), int(x.index), x.after.tolist()] for x in modes.jumps],
        "stop": None if stop is None else [float(stop.time), int(stop.index)],
        "at_once": stop is not None and not modes.legs[-1].steps,
        "taken": asdict(taken),
        "outcome": {name: getattr(modes, name) for name in _OUTCOME},
        "account": asdict(modes.account),
    }


_OUTCOME: Final = ("events", "lost", "lost_at_start", "stabilised", "project")


@dataclass(frozen=True, eq=False)
class RecordedLegs:
    """The legs of a run: the problem of each, the number of its mode, its end; the stop that ended the run.

    `modes`: the labels of each; `answers`: switches at which a mode goes on; `taken`: steps of the whole run;
    `at_once`: whether the stop ends the last leg before its first step.
    """

    problems: Sequence[Problem]
    numbers: Sequence[int]
    ends: Sequence[float]
    modes: Sequence[Any]
    answers: Sequence[LegAnswer]
    stop: Event | None
    taken: Statistics
    at_once: bool

    @staticmethod
    def of(values: Any, compiled: Sequence[Compiled]) -> RecordedLegs:
        """Return what `recorded_legs` wrote; raises KeyError, TypeError, ValueError or IndexError for anything else."""
        legs, stop = values["legs"], values["stop"]
        first = legs[0][3] if legs else {}
        return RecordedLegs(
            [problem_of({**first, **own}, compiled[number]) for _, number, _, own in legs],
            [mode for mode, *_ in legs],
            [end for _, _, end, _ in legs],
            values["modes"],
            [LegAnswer(leg, t, index, np.array(x, dtype=float)) for leg, t, index, x in values["answers"]],
            None if stop is None else Event(stop[0], stop[1], terminal=True),
            Statistics(**values["taken"]),
            values["at_once"],
        )


@dataclass(eq=False)
class RecalledModes:
    """Replays a cached run; has the attributes of `ModeRun` that results read.

    `anew` makes the run from its model, for the attributes that are seldom read.
    """

    way: RecordedLegs
    anew: Callable[[], RunStart]
    account: EnergyAccount
    events: list[dict[str, Any]]
    lost: Mapping[str, float]
    lost_at_start: float
    stabilised: tuple[float, float] | None
    project: bool
    done: list[Leg] = field(default_factory=list)
    _answered: int = 0

    @staticmethod
    def of(values: Any, compiled: Sequence[Compiled], anew: Callable[[], RunStart]) -> RecalledModes:
        """Return the run that `recorded_legs` has told; raises as `RecordedLegs.of` does."""
        account, outcome = values["account"], values["outcome"]
        stabilised = outcome["stabilised"]
        friction = {name: FrictionWork(**work) for name, work in account["friction"].items()}
        return RecalledModes(
            RecordedLegs.of(values, compiled),
            anew,
            EnergyAccount(friction, account["loads"]),
            **{**outcome, "stabilised": None if stabilised is None else tuple(stabilised)},
        )

    def begun(self, problem: Problem) -> Problem:
        """Return a problem that asks this run what follows where a mode might end."""
        return replace(problem, jump=self.jump)

    def jump(self, t: float, _x: Floats, index: int) -> Floats | None:
        """Return the state after an impact from which the run goes on in its mode; None where that ends."""
        leg = len(self.done) - 1
        for answer in self.way.answers[self._answered : self._answered + 1]:
            if (answer.leg, answer.time, answer.index) == (leg, t, index):
                self._answered += 1
                return answer.after.copy()
        if t != self.way.ends[leg]:
            raise Departed(self.anew)
        return None

    def next_leg(self, _leg: Leg, switch: Switch) -> Leg | End[Leg]:
        """Return the leg that follows at a switch, or the stop that the run meets."""
        following = len(self.done)
        if switch.begun.time != self.way.ends[following - 1]:
            raise Departed(self.anew)
        stop = self.way.stop
        if following < len(self.way.problems):
            entered = Leg(self.begun(self.way.problems[following]))
            last = following == len(self.way.problems) - 1
            return End(stop=stop, leg=entered, behind=True) if last and self.way.at_once and stop else entered
        if stop is None:
            raise Departed(self.anew)
        return End(stop=stop)

    @property
    def loop(self) -> Loop:
        """The loop that goes from mode to mode."""
        return self._played

    def _played(self, problem: Problem, samples: Floats) -> Iterator[Progress]:
        taken = self.way.taken
        self.done.append(Leg(problem))
        for latest in chain(self.next_leg, self.done)(problem, samples):
            done = latest.statistics.steps == taken.steps  # all legs together, of which some were one in C
            yield replace(latest, statistics=taken) if done else latest

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[LegSamples, ...]:
        """Return samples, which begin with number `first` of the run, by the modes they are in."""
        told = (self._told[number] for number in self.way.numbers)
        return leg_samples(zip(self.done, told, strict=False), (t, q, u), first)

    @cached_property
    def _told(self) -> list[RunLabels]:
        return [labels_from_json(told, _Mode(self, number)) for number, told in enumerate(self.way.modes)]

    def passed_through(self, _t: Floats, _q: Floats, _u: Floats) -> str:
        """Return which point got through a bar without thickness: none, or it would not have been remembered."""
        return ""

    @cached_property
    def made(self) -> RunInModes:
        """The same run, made from its model."""
        begin = self.anew()
        assert begin.modes is not None
        integrate(begin.problem, loop=begin.modes.loop)
        return begin.modes

    @property
    def jumps(self) -> Sequence[LegAnswer]:
        """Where modes did not end."""
        return self.way.answers

    @property
    def legs(self) -> Sequence[LegInMode]:
        """The legs of the run."""
        return self.made.legs

    @property
    def along(self) -> list[FineLeg]:
        """The legs between jumps of speeds as they are run once more."""
        return self.made.along

    @property
    def passed(self) -> Iterable[ImpactBalance]:
        """Both sides of the general theorems at each impact."""
        return self.made.passed

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]:
        """Return the time of each impact, and what it adds to work and impulses (leaves)."""
        return self.made.added(leaves)


@dataclass(frozen=True, eq=False)
class _Mode:
    """A mode of a run, of which the mechanism is made where it is asked for."""

    run: RecalledModes
    number: int

    @property
    def mechanism(self) -> Mechanism:
        return self.run.legs[self.run.way.numbers.index(self.number)].program.mechanism


# ----------------------------------------------------------------------------------------------------------------------
# Cached runs: their numbers, their compiled Programs, and the labels of their results, as text and numbers.


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

    modes = RecalledModes.of(kept["modes"], compiled, anew.begin)
    return RunStart(ready, modes.begun(problem), modes, events, tuple(kept["hints"]))
