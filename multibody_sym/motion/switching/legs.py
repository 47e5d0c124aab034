"""The legs of a run, the cause of each, and the impacts within them: a finished run is asked here.

A leg is a part of a run in one mode. A run is its legs in the order of time, and the places at which one went on though
its mode might have ended.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial, reduce
from itertools import islice, pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.dynamics.programs.reactions import Switching
from multibody_sym.mechanics.law_elements import FrictionPart, Mode
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import changed_words
from multibody_sym.model.state_words import StateCondition
from multibody_sym.model.system import System, expressions_in
from multibody_sym.motion.loop import integrate
from multibody_sym.motion.loop.integrate import End, Switch
from multibody_sym.motion.loop.problem import SEVERAL, Event
from multibody_sym.motion.prepare.records import LegSamples, ResolvedAlone, RunLabels, leg_samples
from multibody_sym.motion.results.integrals import FineLeg
from multibody_sym.motion.switching.decision import NextState
from multibody_sym.motion.switching.impact import ImpactOutcome
from multibody_sym.motion.switching.law_values import LawValues
from multibody_sym.motion.switching.modes import ModeProgram
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sign_changes import fading_functions, known_zeros, switching_functions, zeros

IMPACT: Final = "impact"
COLLAPSE: Final = "collapse"


@dataclass(frozen=True)
class Change:
    """A change at a switch: at a time, the state of an element, or of a part of it.

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
    def event(self) -> dict[str, Any]:
        """The change as in `Trajectory.events`."""
        known = {"t": self.time, "kind": self.word, "element": self.element}
        known |= {"taken": self.taken} if self.taken else {}
        return known if self.impulse is None else known | {"impulse": self.impulse, "lost": self.lost}


@dataclass(frozen=True, eq=False)
class Cause:
    """The cause at a `time` (s) at which a leg begins, or goes on: an impact, if any, and the elements that rest.

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
class ModeLeg(integrate.Leg):
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

    def rates_at(self, at: LawValues) -> tuple[Floats, Floats]:
        """Return the rates of coordinates (nq,) and speeds (nu,) in the mode."""
        rates = self.of.rates(at.t, np.concatenate([at.q, at.u]))
        qdot, udot = np.split(rates, [len(at.q)])
        return qdot, udot

    def udot_at(self, at: LawValues) -> Floats:
        """Return the accelerations (nu,) in the mode."""
        return self.rates_at(at)[1]

    def stops_at(self, t: float, x: Floats) -> Floats:
        """Return the functions of declared stops (ns,) at a state, positive where the run stops, nan for kinks."""
        count = self.of.switches
        values = self.of.switching(t, x)[:count]
        return np.where(self.of.terminal[:count], values, np.nan)


@dataclass(frozen=True, eq=False)
class LegJump(integrate.LegAnswer):
    """Where a leg went on: from a state that had `moved`, and after what struck, if that is the `cause`."""

    moved: bool = False
    cause: Cause | None = None


@dataclass(eq=False)
class Legs:
    """The legs of a run so far and the jumps within them; `ahead`: the leg that a stop kept the run from."""

    legs: list[ModeLeg] = field(default_factory=list)
    jumps: list[LegJump] = field(default_factory=list)
    ahead: ModeLeg | None = None

    @property
    def changes(self) -> list[Change]:
        """The changes at switches in the order of time; rest that an impact predicts comes by the next switch."""
        found: list[Change] = []
        for cause, changed in causes_and_changes([*self.legs, self.ahead] if self.ahead else self.legs, self.jumps):
            late = next((k for k in reversed(range(len(found))) if found[k].time <= cause.time), -1) + 1
            found[late:] = [replace(each, time=cause.time) for each in found[late:]]
            found += sorted(cause.changes(changed), key=lambda each: each.time)
        return found

    @cached_property
    def events(self) -> list[dict[str, Any]]:
        """The changes at switches as in `Trajectory.events`, once the run is done."""
        return [each.event for each in self.changes]

    @cached_property
    def blows(self) -> list[ImpactOutcome]:
        """All impacts of the run, once it is done."""
        return [cause.blow for cause, _ in causes_and_changes(self.legs, self.jumps) if cause.blow is not None]

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

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[LegSamples, ...]:
        """Return samples, which begin with number `first` of the run, by the modes they are in."""
        labelled = ((leg, RunLabels(ResolvedAlone(leg.program.mechanism))) for leg in self.legs)
        return leg_samples(labelled, (t, q, u), first)


def causes_and_changes(legs: Iterable[ModeLeg], jumps: Iterable[LegJump]) -> Iterator[tuple[Cause, dict[str, str]]]:
    """Yield what happened in a run, in this order, with the states of elements, in words, that changed by it."""
    before, left = None, list(jumps)[::-1]
    for number, leg in enumerate(legs):
        now, changed = leg.program, dict[str, str]()
        if before is not None:
            changed = changed_words((now.every or now).mechanism, before.mode, now.mode)
        yield leg.cause or Cause(leg.start), changed
        before = now
        yield from ((jump.cause, {}) for jump in _within(number, left) if jump.cause is not None)


def _within(number: int, left: list[LegJump]) -> Iterator[LegJump]:
    """Yield the jumps within a leg of those that are left, the last of which come first."""
    while left and left[-1].leg == number:
        yield left.pop()


def between_jumps(leg: ModeLeg, jumps: Iterable[LegJump]) -> Iterator[FineLeg]:
    """Yield the parts of a leg between jumps: their times, with the states (nq + nu,) after them."""
    program, problem = leg.program, replace(leg.problem, jump=None, course=None)
    nq, lasted = len(problem.q0), leg.until - problem.start
    after = [(jump.time, jump.after) for jump in jumps if jump.moved or jump.cause is not None]
    for until, x in [*after, (leg.until, None)]:
        steps = math.ceil(leg.steps * (until - problem.start) / lasted) if lasted > 0.0 else 0
        yield FineLeg(program.mechanism, program.compiled, problem, until, steps)
        if x is not None:
            problem = replace(problem, begun=None, t0=until, q0=x[:nq], u0=x[nq:])


# ----------------------------------------------------------------------------------------------------------------------
# What a run finds at a switch: that slip in space stops a little later, and which declared stop it meets.
#
# A stop is met there by a state that begins, or by a comparison that an impact or the forces of another mode make
# true.


_MOST: Final = 1e-6
"""The part of a run's time within which slip that slows down must have stopped."""
_KNOWN: Final = 1e-9
"""The part of the largest speed up to which a jump of speeds is rounding."""
_NOTHING: Final = 1e-12
"""The value up to which a stop's function is zero, whatever it tells."""


def stop_of_slip(switch: Switch, now: ModeLeg, facts: LawValues, part: FrictionPart) -> Switch:
    """Return the switch at which a part stops that slides slowly at the `facts`, by its deceleration there.

    It is at the next sample at the latest, and as it is where slip does not slow down.
    """
    places, (rates, udot) = [facts.place(row) for row in part.rows], now.rates_at(facts)
    v, a = facts.known["phidot"][places], facts.accelerations(places, udot)
    slower, problem = -float(v @ a), now.of
    left = float(v @ v) / slower if slower > 0.0 else 0.0
    t, sample = switch.begun.time, switch.begun.written
    samples = problem.times()
    until = float(samples[sample]) if sample < len(samples) else problem.t_end
    left = min(left, until - t)
    if not 0.0 < left <= _MOST * problem.lasts:
        return switch
    x = np.concatenate([facts.q + left * rates, facts.u + left * udot])
    return replace(switch, begun=replace(switch.begun, time=t + left), x=x)


def stop_met(declared: Mechanism, legs: tuple[ModeLeg, ModeLeg], switch: Switch, speed: float) -> End[ModeLeg] | None:
    """Return the end of a run at a switch between two legs, if it meets a stop there.

    It is a state that begins or what strikes, whose number follows those of other stops, or what `stop_jumped` tells.
    It begins later than it struck if it is the limit of infinitely many impacts.
    """
    (before, now), time, cause = legs, switch.begun.time, legs[1].cause
    blow, late = (None, 0.0) if cause is None else (cause.blow, max(cause.late.values(), default=0.0))
    begins = time if blow is None or not late else blow.t + late
    for k, condition in enumerate(declared.state_stops.values()):
        met = Event(begins, len(declared.stops) + k, True)
        if strikes_now(condition, blow):
            return End(stop=replace(met, time=time), leg=now)
        before_words, words = before.program.words, now.program.words
        if condition.holds(words) and not condition.holds(before_words) and begins <= now.of.t_end:
            return End(stop=met, leg=now, behind=begins != time)
    jumped = stop_jumped(legs, time, (switch.x, now.of.x0), speed)
    return None if jumped is None else End(stop=Event(time, jumped, True), leg=now, behind=True)


def strikes_now(condition: StateCondition, blow: ImpactOutcome | None) -> bool:
    """Return whether a condition is that an element strikes, which takes an impulse in an impact."""
    return condition.strikes and blow is not None and bool(blow.impulses.get(condition.element))


def stop_jumped(legs: tuple[ModeLeg, ModeLeg], t: float, there: tuple[Floats, Floats], speed: float) -> int | None:
    """Return the number of the first stop whose condition a jump of speeds or forces makes true, None if none.

    `there` are the states (nq + nu,) before it and after it, `speed` the largest: what rounding of speeds brings about
    is no jump.
    """
    problem = legs[0].of
    if not any(problem.terminal[: problem.switches]):
        return None
    holds = list[NDArray[np.bool_]]()  # before and after, whatever rounding does to speeds
    for leg, x in zip(legs, there, strict=True):
        beside = np.where(np.arange(len(x)) < len(leg.of.q0), 0.0, _KNOWN * speed)
        here, *near = (leg.stops_at(t, each) for each in (x, x + beside, x - beside))
        rounding = np.max(np.abs(np.array(near) - here), axis=0)
        holds.append(here > np.maximum(rounding, _NOTHING))
    return next(iter(np.flatnonzero(holds[1] & ~holds[0]).tolist()), None)


# ----------------------------------------------------------------------------------------------------------------------
# Moments that a run in modes looks at, as what depends on time alone moves there: nothing tells it where all rests.
#
# A body that sticks has no derivative that a force would change, so that a pulse between two looks is stepped over.
# Expressions of time alone are therefore sampled before the run, closely between the moments at which they switch or
# fade, and more closely where they move: from one moment to the next none changes by more than a part of its range.


SAMPLES: Final = 20_000
"""Evenly spaced times of a run at which expressions of time are sampled: what is narrower may not be seen."""
_BETWEEN: Final = 256  # between two moments at which they switch or fade
_MOST_SWITCHES: Final = 200  # of one function
_PART: Final = 0.25  # of its range, by which an expression may change from one look to the next
_FINEST: Final = 1e-11  # part of a run between looks
_MOMENTS_MOST: Final = 400_000  # samples
_MOST_LOOKS: Final = 50_000  # at one expression: what moves faster moves too fast to be followed

_T: Final = symbol("t")
_ARRAYS: Final[Mapping[str, Callable[..., Any]]] = {
    "neg": np.negative,
    "add": lambda *x: reduce(np.add, x),
    "mul": lambda *x: reduce(np.multiply, x),
    "div": np.divide,
    "pow": np.power,
    "atan2": np.arctan2,
    "asinh": np.arcsinh,
    "acosh": np.arccosh,
    "atanh": np.arctanh,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "min": lambda *x: reduce(np.minimum, x),
    "max": lambda *x: reduce(np.maximum, x),
    "less": lambda a, b: np.less(a, b).astype(float),
    "less_equal": lambda a, b: np.less_equal(a, b).astype(float),
    "where": lambda c, a, b: np.where(c != 0.0, a, b),
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "sign")},
    "abs": np.abs,
    "table": lambda function, order, a: np.asarray(function.values(order, np.ravel(a))),
}


def times_to_check(system: System, values: Mapping[Node, float], t_end: float) -> Floats:
    """Return the times in (0, t_end) at which a run looks, rising, given the values of parameters by their symbols."""
    laws = list(dict.fromkeys(_terms_of_time(system, frozenset(values))))
    if not laws:
        return np.zeros(0)
    with np.errstate(all="ignore"):
        times = _refine_times(laws, values, _sample_times(laws, values, t_end), t_end)
        looks = [np.zeros(0, dtype=np.intp)]
        for law in laws:  # whenever it has changed by a part of its range
            x = _values(law, values, times)
            span = float(np.ptp(x))
            if not span > 0.0:
                continue
            way = np.floor(np.cumsum(np.abs(np.diff(x))) / (_PART * span))
            places = 1 + np.flatnonzero(np.diff(way, prepend=0.0))
            if len(places) <= _MOST_LOOKS:
                looks.append(places[places < len(times) - 1])
    found: Floats = times[np.unique(np.concatenate(looks))]
    return found


def _terms_of_time(system: System, fixed: frozenset[Node]) -> Iterator[Node]:
    """Yield the largest terms that depend on time and parameters alone, those of sums each for itself."""
    for written in expressions_in(system, ("forces", "constraints", "inputs", "joints", "bodies")):
        if written.node.shadow is not None:  # numbers, which most are
            continue
        timed: dict[Node, bool] = {}
        for n in postorder([written.node]):
            known = n is _T or n in fixed or n.shadow is not None
            timed[n] = known or (bool(n.args) and all(timed[a] for a in n.args))
        stack, seen = [written.node], set[Node]()
        while stack:
            n = stack.pop()
            if n in seen:
                continue
            seen.add(n)
            if not timed[n] or n.op in ("add", "neg"):
                stack.extend(n.args)
            elif n is not _T and _T in leaves([n], "symbol"):
                yield n


def _values(law: Node, values: Mapping[Node, float], times: Floats) -> Floats:
    """Return an expression of time at many times; 0 where it has no value: the run itself will tell."""
    found: dict[Node, Any] = {}
    for n in postorder([law]):
        if n is _T:
            found[n] = times
        elif n.args and n.shadow is None:
            found[n] = _ARRAYS[n.op](*n.own, *(found[a] for a in n.args))
        else:
            found[n] = np.float64(values[n] if n.shadow is None else n.shadow)
    result = np.broadcast_to(np.asarray(found[law], dtype=float), times.shape)
    return np.where(np.isfinite(result), result, 0.0)


def _sample_times(laws: Sequence[Node], values: Mapping[Node, float], t_end: float) -> Floats:
    """Return the times at which to sample: evenly spaced, and between moments at which the laws switch or fade."""
    known = {0.0, t_end}

    def value(g: Node, t: float) -> float:
        try:
            return evaluate_float([g], {**values, _T: t})[0]
        except (ArithmeticError, ValueError):
            return 0.0

    for g in (*switching_functions(laws), *fading_functions(laws)):
        if _T in leaves([g], "symbol"):
            told = known_zeros(g, _T, values)
            known.update(islice(zeros(partial(value, g), t_end), _MOST_SWITCHES) if told is None else told)
    ends = sorted(x for x in known if 0.0 <= x <= t_end)
    even, pieces = np.linspace(0.0, t_end, SAMPLES + 1), max(1, min(_BETWEEN, _MOMENTS_MOST // (2 * len(ends))))
    between = [np.linspace(a, b, pieces + 1) for a, b in pairwise(ends)]
    return np.unique(np.concatenate([even, *between]))


def _refine_times(laws: Sequence[Node], values: Mapping[Node, float], times: Floats, t_end: float) -> Floats:
    """Return the times with more of them between those from which to the next a law changes by much."""
    while len(times) < _MOMENTS_MOST:
        moving = np.zeros(len(times) - 1, dtype=bool)
        for law in laws:
            x = _values(law, values, times)
            change = np.abs(np.diff(x))
            moving |= (change > _PART * np.ptp(x)) & (np.diff(times) > _FINEST * t_end)
        if not moving.any():
            break
        times = np.sort(np.concatenate([times, 0.5 * (times[:-1] + times[1:])[moving]]))
    return times
