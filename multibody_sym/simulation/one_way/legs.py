"""The legs of a run, what each began with, and what the impacts within them did: what a finished run is asked is here.

A leg is a part of a run in one mode. A run is its legs in the order of time, and the places at which one went on though
its mode might have ended.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.programs.switching import Switching
from multibody_sym.model.mechanism.mode_words import SEVERAL
from multibody_sym.model.mechanism.one_way import Mode
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime import chain
from multibody_sym.simulation.along.fine import FineLeg
from multibody_sym.simulation.one_way.decision import NextState
from multibody_sym.simulation.one_way.facts import Facts
from multibody_sym.simulation.one_way.impact import ImpactOutcome
from multibody_sym.simulation.one_way.modes import ModeProgram
from multibody_sym.simulation.parts import Part, parts_of
from multibody_sym.simulation.runs.told import Alone, Told

IMPACT: Final = "impact"
COLLAPSE: Final = "collapse"


@dataclass(frozen=True)
class Change:
    """What a switch changed: at a time, the state of an element, or of a part of it.

    Of what was struck also its `impulse` (N s, or N m s), and the energy that was `lost` there (J). Where the laws
    leave several states of an element, `taken` is the one in which the run goes on.
    """

    time: float
    element: str
    word: str
    impulse: float | None = None
    lost: float = 0.0
    taken: str = ""

    @property
    def told(self) -> dict[str, Any]:
        """The change as `Trajectory.events` tells it."""
        known = {"t": self.time, "kind": self.word, "element": self.element}
        known |= {"taken": self.taken} if self.taken else {}
        return known if self.impulse is None else known | {"impulse": self.impulse, "lost": self.lost}


@dataclass(frozen=True, eq=False)
class Cause:
    """What happened at a `time` (s) where a leg begins, or within one: an impact, if there was one, and what rests.

    Of what struck some has `collapsed`, or would still have bounced for `late` (s). Of elements of which the laws leave
    `several` states: the one that was taken.
    """

    time: float
    blow: ImpactOutcome | None = None
    late: Mapping[str, float] = field(default_factory=dict)
    collapsed: frozenset[str] = frozenset()
    several: Mapping[str, str] = field(default_factory=dict)

    @staticmethod
    def of(found: NextState, time: float) -> Cause:
        """Return what happens where a leg begins in a mode that was found, at a time or at that of the impact."""
        time = time if found.blow is None else found.blow.t
        return Cause(time, found.blow, found.late, found.collapsed, found.undecided)

    def changes(self, changed: Mapping[str, str]) -> list[Change]:
        """Return what happened to elements, of which some have `changed` their states, to these words."""
        several = [Change(self.time, name, SEVERAL, taken=word) for name, word in self.several.items()]
        hits, struck = [], {} if self.blow is None else self.blow.impulses
        for name, impulse in struck.items():
            word = changed.get(name, COLLAPSE if name in self.collapsed else IMPACT)
            lost = 0.0 if self.blow is None else self.blow.lost.get(name, 0.0)
            if impulse or lost or word != IMPACT:
                hits.append(Change(self.time + self.late.get(name, 0.0), name, word, impulse, lost))
        return [*several, *hits, *(Change(self.time, *each) for each in changed.items() if each[0] not in struck)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Leg(chain.Leg):
    """A part of a run in a `mode`, by its Programs; `cause` is what it begins with, but for another mode."""

    program: ModeProgram
    mode: Mode
    cause: Cause | None = None

    @property
    def parameters(self) -> list[float]:
        """The parameters (np) of the mechanism in the mode."""
        of, problem = self.program.mechanism, self.problem
        known = {entry.name: x for entry, x in zip(of.parameters, problem.parameters.tolist(), strict=True)}
        known |= zip(of.mode_numbers, problem.modes.tolist(), strict=True)  # where slip in space starts
        return [known.get(entry.name, 0.0) for entry in self.program.entered.parameters]

    @property
    def active(self) -> tuple[str, ...]:
        """The unilateral elements that are closed."""
        return self.program.active

    def switching(self, index: int) -> Switching:
        """Return a switching function at which the mode may end, by its number."""
        found = self.program.switchings[index]
        assert found is not None  # others never become positive
        return found

    def rates_at(self, at: Facts) -> tuple[Floats, Floats]:
        """Return the rates of coordinates (nq,) and speeds (nu,) in the mode."""
        rates = self.of.rates(at.t, np.concatenate([at.q, at.u]))
        qdot, udot = np.split(rates, [len(at.q)])
        return qdot, udot

    def udot_at(self, at: Facts) -> Floats:
        """Return the accelerations (nu,) in the mode."""
        return self.rates_at(at)[1]

    def stops_at(self, t: float, x: Floats) -> Floats:
        """Return the functions of declared stops (ns,) at a state, positive where the run stops, nan for kinks."""
        count = self.of.switches
        values = self.of.switching(t, x)[:count]
        return np.where(self.of.terminal[:count], values, np.nan)


@dataclass(frozen=True, eq=False)
class Jump(chain.Answer):
    """Where a leg went on: from a state that had `moved`, and after what struck, if that is the `cause`."""

    moved: bool = False
    cause: Cause | None = None


@dataclass(eq=False)
class Legs:
    """The legs of a run so far and the jumps within them; `ahead`: the leg that a stop kept the run from."""

    legs: list[Leg] = field(default_factory=list)
    jumps: list[Jump] = field(default_factory=list)
    ahead: Leg | None = None

    @property
    def changes(self) -> list[Change]:
        """The changes at switches in the order of time; rest that an impact predicts comes by the next switch."""
        found: list[Change] = []
        for cause, changed in happened([*self.legs, self.ahead] if self.ahead else self.legs, self.jumps):
            late = next((k for k in reversed(range(len(found))) if found[k].time <= cause.time), -1) + 1
            found[late:] = [replace(each, time=cause.time) for each in found[late:]]
            found += sorted(cause.changes(changed), key=lambda each: each.time)
        return found

    @cached_property
    def events(self) -> list[dict[str, Any]]:
        """What switches changed, as `Trajectory.events` tells it, once the run is done."""
        return [each.told for each in self.changes]

    @cached_property
    def blows(self) -> list[ImpactOutcome]:
        """All impacts of the run, once it is done."""
        return [cause.blow for cause, _ in happened(self.legs, self.jumps) if cause.blow is not None]

    @property
    def lost(self) -> dict[str, float]:
        """What impacts took (J), by element."""
        lost: dict[str, float] = {}
        for blow in self.blows:
            lost |= {name: lost.get(name, 0.0) + each for name, each in blow.lost.items()}
        return lost

    @property
    def lost_at_start(self) -> float:
        """What impacts took in all (J) before the first sample."""
        cause = self.legs[0].cause
        return sum(cause.blow.lost.values()) if cause is not None and cause.blow is not None else 0.0

    @property
    def along(self) -> list[FineLeg]:
        """The legs between jumps of speeds as they are run once more, for what adds up along them."""
        jumps = list(reversed(self.jumps))
        return [part for number, leg in enumerate(self.legs) for part in between_jumps(leg, _within(number, jumps))]

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[Part, ...]:
        """Return samples, which begin with number `first` of the run, by the modes they are in."""
        return parts_of(((leg, Told(Alone(leg.program.mechanism))) for leg in self.legs), (t, q, u), first)


def happened(legs: Iterable[Leg], jumps: Iterable[Jump]) -> Iterator[tuple[Cause, dict[str, str]]]:
    """Yield what happened in a run, in this order, with the states of elements, in words, that changed by it."""
    words, left = dict[str, str](), list(jumps)[::-1]
    for number, leg in enumerate(legs):
        now = leg.program.words
        changed = {name: word for name, word in now.items() if words and words.get(name) != word}
        yield leg.cause or Cause(leg.start), changed
        words = now
        yield from ((jump.cause, {}) for jump in _within(number, left) if jump.cause is not None)


def _within(number: int, left: list[Jump]) -> Iterator[Jump]:
    """Yield the jumps within a leg of those that are left, the last of which come first."""
    while left and left[-1].leg == number:
        yield left.pop()


def between_jumps(leg: Leg, jumps: Iterable[Jump]) -> Iterator[FineLeg]:
    """Yield the parts of a leg between jumps: their times, with the states (nq + nu,) after them."""
    program, problem = leg.program, replace(leg.problem, jump=None, course=None)
    nq, lasted = len(problem.q0), leg.until - problem.start
    after = [(jump.time, jump.after) for jump in jumps if jump.moved or jump.cause is not None]
    for until, x in [*after, (leg.until, None)]:
        steps = math.ceil(leg.steps * (until - problem.start) / lasted) if lasted > 0.0 else 0
        yield FineLeg(program.mechanism, program.compiled, problem, until, steps)
        if x is not None:
            problem = replace(problem, begun=None, t0=until, q0=x[:nq], u0=x[nq:])
