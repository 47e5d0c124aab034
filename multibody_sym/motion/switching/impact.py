"""Impacts of a run by their laws, and when bounces come to rest."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.contact_laws.problem import Equality, FrictionLaw
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import coordinate_rates, motion_of, state_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.motion.switching.law_values import LawValues
from multibody_sym.program.runtime_constants import (
    GOES_ON,
    INDEPENDENT,
    LOST_HEIGHT,
    MOST_PUT_BACK,
    MOST_SWITCHES,
    NOT_PUT_BACK,
    REMAINING,
    ROUNDED_GAP,
    SLIGHT,
    TICKS,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.least_norm import solve_lists
from multibody_sym.scalars.rank import SWITCHED, determined, least_squares, row_space

if TYPE_CHECKING:
    from multibody_sym.contact_laws.impact_problem import ImpactProblem, ImpactResult


# ----------------------------------------------------------------------------------------------------------------------
# What a switch does before forces are asked: what touches, positions on their rows, speeds of what stops at zero.


_COARSER: Final = (SWITCHED, 1e-7, 1e-5, 1e-3)
"""Tolerances of rows that bring to rest what hardly moves, until they change speeds slightly: near a dead centre what
stands still holds nothing else, and a crank does not stop for a slider that does."""
_NO_WAY: Final = 1e-9
"""The part of the model's size that is no way to slide."""


def at_state(facts: LawValues, *, q: Floats | None = None, u: Floats | None = None) -> LawValues:
    """Return the law values at other coordinates or speeds; the present ones where both are None."""
    if q is None and u is None:
        return facts
    there = facts.q if q is None else q, facts.u if u is None else u
    return facts.laws.at(facts.t, *there, facts.scale)


def approaching(facts: LawValues, touching: Collection[str]) -> list[LawElement]:
    """Return the elements that touch and close with a speed."""
    return [x for x in facts.laws.named(touching) if facts.sense(x) < 0]


def _places_of_rows(facts: LawValues, touching: Collection[str]) -> list[int]:
    """Return the places of constraints and of the normals of elements that touch."""
    mechanism = facts.laws.mechanism
    return [facts.place(row) for row in (*mechanism.rows, *(x.normals[0] for x in facts.laws.named(touching)))]


def onto_rows(facts: LawValues, touching: Collection[str]) -> Floats | None:
    """Return the coordinates put onto closed gaps, taut ropes and constraints; None if they are there."""
    places = _places_of_rows(facts, touching)
    phi = facts.known["phi"][places]
    if not np.abs(phi).max(initial=0.0) > NOT_PUT_BACK * facts.scale.length:
        return None
    there = np.flatnonzero(phi)
    rows, wanted = facts.by_mass[places][there], -phi[there]
    change = _least_change(facts, rows, wanted)
    if change is None:
        change = facts.speeds(least_squares(rows, wanted, SWITCHED))
    rates = coordinate_rates(facts.laws.mechanism, facts.q.tolist(), change.tolist())
    onto: Floats = facts.q + np.array(rates, dtype=float)
    return onto


def at_rest(facts: LawValues, touching: Collection[str]) -> Floats | None:
    """Return the speeds with what touches and does not slide at rest in its rows to the last bit; None if it is.

    Friction that is always enough stops little slip at once.
    """
    problem = facts.posed(touching)
    places, little = _places_of_rows(facts, touching), SLIGHT * facts.scale.speed
    for part, law in zip(problem.parts, problem.problem.parts, strict=True):
        if law.rests or (law.enough and float(np.abs(law.velocity).max()) <= little):
            places += [facts.place(row) for row in part.rows]
    speeds = facts.known["phidot"][places]
    if not np.abs(speeds).max(initial=0.0) > NOT_PUT_BACK * facts.scale.speed:
        return None
    sizes = facts.laws.slides * facts.scale.speed + (1.0 - facts.laws.slides) * facts.scale.turning
    for change in _changes(facts, places, -speeds):
        if (np.abs(change) <= SLIGHT * sizes).all():
            return facts.u + change
    return None


def slid_out(facts: LawValues, touching: Collection[str], udot: Floats) -> Floats | None:
    """Return the speeds with all that touches at rest, where accelerations (nu,) end slip at once; None elsewhere.

    It would get no further than a billionth of the model's size.
    """
    slips = [facts.place(row) for part in facts.posed(touching).parts for row in part.rows]
    speeds = facts.known["phidot"][slips]
    slower, size = -float(speeds @ facts.accelerations(slips, udot)), float(np.linalg.norm(speeds))
    if not 0.0 < size**3 <= 2.0 * slower * _NO_WAY * facts.scale.length:
        return None
    places = [*_places_of_rows(facts, touching), *slips]
    return facts.u + next(_changes(facts, places, -facts.known["phidot"][places]))


def _least_change(facts: LawValues, rows: Floats, wanted: Floats) -> Floats | None:
    """Return the least change of speeds that changes rows as wanted; None where rows are many or nearly dependent.

    `turns.c` gives the same bits.
    """
    if len(rows) > MOST_PUT_BACK:
        return None
    x, _, (rank, least, _) = solve_lists(rows.tolist(), wanted.tolist(), rows.shape[1], len(rows))
    if not (rank == len(rows) and least > INDEPENDENT):
        return None
    return facts.inverse.in_order(np.array(x))


def _changes(facts: LawValues, places: Sequence[int], wanted: Floats) -> Iterator[Floats]:
    """Yield changes of speeds (nu,) that change rows as wanted, by ever fewer of the rows."""
    rows = facts.by_mass[places]
    change = _least_change(facts, rows, wanted)
    if change is not None:
        yield change
    yield from (facts.speeds(least_squares(rows, wanted, independent)) for independent in _COARSER)


# ----------------------------------------------------------------------------------------------------------------------
# Limits of values that depend smoothly on a parameter as it goes to zero, from values beside it.


def at_zero(parameters: Floats, values: Floats, sizes: Floats) -> tuple[Floats, float]:
    """Return the limit (m,) of values (n, m) as their parameters (n,) go to zero, and its error by `sizes` (m,).

    Parameters grow from the first on. Of the polynomials through neighbouring values (Neville) that one is taken which
    differs least from the two of one degree less that make it: higher degrees amplify rounding. n is at least 2.
    """
    best, error, column = values[0], np.inf, values
    for degree in range(1, len(parameters)):
        near, far = parameters[:-degree, None], parameters[degree:, None]
        former, column = column, (far * column[:-1] - near * column[1:]) / (far - near)
        differ = np.maximum(np.abs(column - former[:-1]), np.abs(column - former[1:])) / sizes
        largest = differ.max(axis=1)
        least = int(np.argmin(largest))
        if largest[least] < error:
            best, error = column[least], float(largest[least])
    return best, error


_LOSSLESS: Final = 1e-9
"""The part of what closing speeds take from an impact that is rounding of the energy it gives back."""
_LONGEST: Final = 12
"""Impacts in a cycle of them."""
_CYCLES: Final = 4
"""Ends of cycles, the ratios of which have to agree."""
_KEPT: Final = 4096
"""Impacts that are kept."""
_APART: Final = 1.9
"""How much longer one cycle lasts than the next one from which the limit is taken: near ones amplify rounding."""
_DEGREES: Final = 10
"""Cycles from which the limit is taken."""
_SURE: Final = 1e-8
"""The part of the sizes of a run by which the limit may be off: what rests at its last impact is off by less."""
_EXPECTED: Final = 0.5
"""The part by which times that are left may differ, of several elements or from a geometric series."""
_ALIKE: Final = 1e-2
"""The part by which they may differ: rounding of where what is nearly at rest strikes is in them."""
_PRESSED: Final = 2.0
"""By how many times of what counts as touching without closing loads have made closing what wedges."""
_JAMS: Final = 10.0
"""How many times larger the impulses are with friction of what pulls, where this jams: it would act both ways."""
SHRINKS: Final = 0.99
"""Blocks of switches that are shorter than this part of those before end soon enough: 2,300 blocks make it 1e-10."""
_LESS: Final = 0.95
"""The part of what a block was shorter by than the one before, less than which the next one is: ..."""
_SLOWS: Final = 3
"""... so many times one after the other, and blocks do not shrink as a geometric series does: they do not end."""

_ADVICE: Final = (
    "let it lose energy (restitution below 1), give what touches a radius or a surface that reaches further, or begin "
    "from a state that differs a little"
)
ENDLESS: Final = f"it strikes or lets go again and again and time does not go on; {_ADVICE}"
TOO_FAST: Final = f"more often than a run can hold that goes on at this pace; ask for a shorter time, or {_ADVICE}"


@dataclass(frozen=True)
class ImpactOutcome:
    """An impact: the jump of the speeds (nu,), by element the impulses (N s) and the energy it took (J).

    `t` (s) is when it was, `q` (nq,) and `u` (nu,) are those before it. `rows`: the impulses (N s) of all that struck
    or held, friction too; `parameters` (np,) those of the mechanism then. `gives_back`: whether nothing is lost across
    what closes, so that it strikes on.
    """

    jump: Floats
    impulses: Mapping[str, float]
    lost: Mapping[str, float]
    t: float
    q: Floats
    u: Floats
    rows: Mapping[str, float]
    parameters: Floats
    notes: tuple[str, ...] = ()
    gives_back: bool = False

    def then(self, other: ImpactOutcome) -> ImpactOutcome:
        """Return both impacts as one, the other one after this."""

        def summed(one: Mapping[str, float], more: Mapping[str, float]) -> dict[str, float]:
            return {name: one.get(name, 0.0) + more.get(name, 0.0) for name in (*one, *more)}

        parts = ((self.impulses, other.impulses), (self.lost, other.lost), (self.rows, other.rows))
        impulses, lost, rows = (summed(*each) for each in parts)
        jump, notes = self.jump + other.jump, (*self.notes, *other.notes)
        both = self.gives_back and other.gives_back
        return replace(self, jump=jump, impulses=impulses, lost=lost, rows=rows, notes=notes, gives_back=both)


@dataclass
class Standstill:
    """How often what ends a mode, or strikes, has done so without time going on, or too fast for a run of `span` (s).

    Time goes on by more than rounding. What is too fast is told of blocks of ten times as many as let impacts collapse:
    a run of such blocks could not be kept. Where they get shorter they come to an end by themselves, as bounces do, but
    for those that shrink ever less, as where walls close in on what does not lose energy.
    """

    span: float = 0.0
    since: float = -np.inf
    _last: float = -np.inf
    _times: int = 0
    _begun: float = np.inf
    _number: int = 0
    _before: float = 0.0
    _shrunk: float = 1.0
    _slowed: int = 0
    _fast: bool = False

    def lasts(self, time: float, contacts: int) -> str:
        """Note such an end; return why the run is to end, in words, empty where it goes on; `since` tells from when."""
        most = 10 * _endless(contacts)
        on = time - self._last > GOES_ON * abs(time)
        self._last, self._times = time, 1 if on else self._times + 1
        if self._times > most:
            self.since = time
            return ENDLESS
        self._begun = min(self._begun, time)
        self._number += int(on)
        if self._number > most:
            self._verify_pace(time, most)
        return f"it strikes or lets go {most} times in {time - self.since:.3g} s, {TOO_FAST}" if self._fast else ""

    def _verify_pace(self, time: float, most: int) -> None:
        """End a block: too fast are two as long as each other where a run of such ones has too many."""
        took = time - self._begun
        shrunk = 1.0 - took / self._before if self._before else 1.0
        self._slowed = self._slowed + 1 if 0.0 < shrunk < _LESS * self._shrunk else 0
        lasts = 0.0 < SHRINKS * self._before < took or self._slowed >= _SLOWS
        self._fast = took * MOST_SWITCHES < most * self.span and lasts
        self._shrunk = shrunk
        self.since, self._begun, self._before, self._number = self._begun, time, took, 0


@dataclass
class Returns:
    """How often a run has come back to a mode as `soon` (s) as is no motion."""

    soon: float
    _recent: list[tuple[float, object]] = field(default_factory=list)

    def to(self, time: float, mode: object) -> int:
        """Note a mode, and return how often it was there lately."""
        self._recent = [(t, k) for t, k in self._recent if time - t <= self.soon]
        returns = sum(k == mode for _, k in self._recent)
        self._recent.append((time, mode))
        return returns


def _endless(contacts: int) -> int:
    """Return how many impacts may follow each other at once."""
    return 100 + 20 * contacts


@dataclass(frozen=True, eq=False)
class Hit:
    """An impact: its time (s), what took an impulse, and the coordinates and speeds (nq + nu,) before it.

    `gives_back` as in `ImpactOutcome`.
    """

    time: float
    names: frozenset[str]
    x: Floats
    gives_back: bool = False


@dataclass
class ImpactRhythm:
    """The last impacts of a run, and the modes between them: cycles that shrink end as a geometric series does.

    A load lands without a rebound, its counterweight flies on until their rope is taut and jerks it up again. Each of
    the two rests as the other strikes, so that no coefficient tells the ratio, but the times of the cycles do.
    """

    _hits: deque[Hit] = field(default_factory=lambda: deque(maxlen=_KEPT))
    _modes: deque[tuple[float, object]] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def hit(self, now: Hit) -> None:
        """Note an impact."""
        self._hits.append(now)

    def mode(self, time: float, key: object) -> None:
        """Note a mode that begins."""
        self._modes.append((time, key))

    @property
    def last(self) -> float:
        """The time (s) of the last impact."""
        return self._hits[-1].time if self._hits else -np.inf

    def ending(self, time: float, names: Iterable[str]) -> tuple[frozenset[str], float, float]:
        """Return what strikes in cycles that shrink, with an impact of `names` now, and how long (s) the last one was.

        Then how long (s) all that follow take together. No names where there is no such cycle of several elements.
        """
        recent = list(self._hits)[-_CYCLES * _LONGEST :]
        hits = [(each.time, name) for each in recent for name in sorted(each.names)]
        hits += ((time, name) for name in sorted(names))
        for size in range(2, min(_LONGEST, (len(hits) - 1) // (_CYCLES - 1)) + 1):
            ends = [hits[-1 - k * size] for k in range(_CYCLES)]
            a, b, c = (ends[k][0] - ends[k + 1][0] for k in range(_CYCLES - 1))
            if not (0.0 < a < b < c and abs(a * c - b * b) < _ALIKE * b * b):
                continue
            left = a * a / (b - a)
            same = all(hits[-1 - k][1] == hits[-1 - k - size][1] for k in range((_CYCLES - 2) * size))
            taking = frozenset(name for _, name in hits[-size:])
            if same and len(taking) > 1 and self._end_together(np.array([t for t, _ in hits]), size, time + left, left):
                return taking, a, left
        return frozenset(), 0.0, 0.0

    @staticmethod
    def _end_together(times: Floats, size: int, end: float, left: float) -> bool:
        """Return whether impacts at each place in a cycle have the same `end` (s), which is `left` (s) after the last.

        Elements that bounce by themselves have ends of their own.
        """
        last, before, first = (times[len(times) - k * size :][:size] for k in (1, 2, 3))
        a, b = last - before, before - first
        late = b - a
        return bool((late > 0.0).all()) and bool((np.abs(last + a * a / late - end) < _ALIKE * left).all())

    def limit(
        self, now: Hit, taking: tuple[frozenset[str], frozenset[str]], sizes: Floats
    ) -> tuple[float, Floats] | None:
        """Return when all that follow an impact `now` have struck, and the state (nq + nu,) then; None if unknown.

        `taking` are the elements that come to rest, which strike in each cycle, and those that rest: nothing else does.
        The state at the ends of cycles is a smooth function of how long these last. `sizes` (1 + nq + nu,) are those of
        the time and of the state.
        """
        ends = self._ends(now, *taking)
        lasted = -np.diff([each.time for each in ends])
        places = [0] if len(lasted) > 1 else []
        for k, each in enumerate(lasted):
            if each >= _APART * lasted[places[-1]]:
                places.append(k)
        if len(places) < 2:
            return None
        places = places[:_DEGREES]
        values = np.array([[ends[k].time - now.time, *ends[k].x] for k in places])
        (left, *x), error = at_zero(lasted[places], values, sizes)
        expected = lasted[0] ** 2 / (lasted[1] - lasted[0])
        known = error < _SURE and abs(left - expected) < _EXPECTED * expected
        return (now.time + float(left), np.array(x)) if known else None

    def _ends(self, now: Hit, ending: frozenset[str], resting: frozenset[str]) -> list[Hit]:
        """Return the ends of the cycles that are alike, the latest first, `now` the first.

        The same strikes at the end of each, in the same mode. What bounces within a cycle may come to rest there, after
        fewer and fewer impacts that are resolved.
        """
        hits, own = list(self._hits), self._mode_before(now.time)
        names, modes = [x.names for x in hits], [self._mode_before(x.time) for x in hits]
        ends = [k for k, mode in enumerate(modes) if now.names <= names[k] and mode == own]
        ends = [*ends, len(hits)][::-1]
        spans = [slice(first, end) for end, first in pairwise(ends)]
        within = [_CycleImpacts({*zip(names[span], modes[span], strict=True)}, {*names[span]}) for span in spans]
        for size in range(1, min(_LONGEST, len(within) // 2) + 1):
            taking = frozenset[str]().union(*(each for part in within[:size] for each in part.names))
            fewer = [one.is_fewer(before) for one, before in zip(within, within[size:], strict=False)]
            alike = size + next((k for k, each in enumerate(fewer) if not each), len(fewer))
            if alike >= 2 * size and ending <= taking <= ending | resting:
                return [now, *(hits[k] for k in ends[size : alike + 1 : size])]
        return [now]

    def _mode_before(self, time: float) -> object:
        """Return the mode that ended at a time, or went on."""
        place = bisect_left(self._modes, time, key=lambda each: each[0])
        return self._modes[place - 1][1] if place else None


@dataclass(frozen=True)
class _CycleImpacts:
    """What has struck in a cycle: `names`, and these by the modes in which they did."""

    by_modes: set[tuple[frozenset[str], object]]
    names: set[frozenset[str]]

    def is_fewer(self, before: _CycleImpacts) -> bool:
        """Return whether the same has struck as in a cycle before, in the same modes or fewer of them."""
        return self.names == before.names and self.by_modes <= before.by_modes


@dataclass
class BounceMemory:
    """Since when contacts have been bouncing, by element; what has come to rest begins anew.

    `lossless`: how many impacts, one after the other, have given all back.
    """

    since: dict[str, float] = field(default_factory=dict)
    rhythm: ImpactRhythm = field(default_factory=ImpactRhythm)
    lossless: int = 0
    _hits: deque[tuple[float, str]] = field(default_factory=deque)
    _first: float = np.inf
    _left: dict[str, float] = field(default_factory=dict)

    def leaving(self, facts: LawValues, element: LawElement) -> Floats | None:
        """Return the coordinates (nq,) from which what is only leaving goes on; None where it is not.

        A gap may cross zero by rounding, once a time; what is beyond its face is put onto it.
        """
        if not facts.rate(element) > 0.0:
            return None
        on = facts.t - self._left.get(element.name, -np.inf) > GOES_ON * abs(facts.t)
        if element.name in self.since and on:
            self._left[element.name] = facts.t
            return facts.q
        if facts.sense(element) <= 0 or facts.standing(element) == "open":
            return None
        onto = onto_rows(facts, [element.name])
        if onto is None and on:
            self._left[element.name] = facts.t
            return facts.q
        return onto

    def flying(self, facts: LawValues, closed: Collection[str]) -> set[str]:
        """Return what is not `closed` and off its face, however low it flies, but for what strikes at the same instant.

        What neither bounces nor moves, by more than counts as rest, touches where its height is lost in rounding.
        """
        closing = (x for x in approaching(facts, closed) if facts.gap(x) > 0.0)  # an event is found a little before
        left = max((-facts.gap(x) / facts.rate(x) for x in closing), default=0.0)
        found, ahead = set[str](), TICKS * abs(facts.t) + left
        for x in (x for x in facts.near if x.name not in closed):
            moves = x.name in self.since or facts.sense(x) != 0
            at_once = max(facts.allowed_gap(x, ROUNDED_GAP), ahead * abs(facts.rate(x)))
            high = facts.gap(x) > (at_once if moves else max(at_once, lost_height(facts, x)))
            found |= {x.name} if high else set()
        return found

    def hit(self, now: Hit) -> None:
        """Note an impact."""
        self.lossless = self.lossless + 1 if now.gives_back else 0
        self._first = min(self._first, now.time)
        self.rhythm.hit(now)
        self._hits.extend((now.time, name) for name in now.names)

    def limit(
        self, facts: LawValues, closing: Collection[LawElement], late: Mapping[str, float], resting: frozenset[str]
    ) -> LawValues | None:
        """Return what holds once all impacts have struck after which elements rest that are `late` (s).

        It follows from what held at the impacts before; None where these are too few, or not alike. What is 0 s late
        strikes as others do, and rests with them. Of the others only those take part that are `resting`.
        """
        own = [left for left in late.values() if left]
        if not min(own, default=0.0) > (1.0 - _EXPECTED) * max(own, default=0.0):
            return None
        now = Hit(facts.t, frozenset(x.name for x in closing), np.concatenate([facts.q, facts.u]))
        found = self.rhythm.limit(now, (frozenset(late), resting), facts.sizes)
        if found is None:
            return None
        q, u = np.split(found[1], [len(facts.q)])
        return facts.laws.at(found[0], q, u, facts.scale)

    def endless(self, contacts: int) -> bool:
        """Return whether impacts go on that give all back: no limit ends them."""
        return self.lossless > _endless(contacts)

    def collapsing(self, time: float, contacts: int) -> frozenset[str]:
        """Return the elements whose impacts follow each other so fast that they never end, some without weight.

        More than 100 + 20 of them for each contact in the last 1e-9 of the time since the first impact, or in a time
        that is not resolved.
        """
        lately = max(REMAINING * (time - self._first), TICKS * abs(time))
        while self._hits and time - self._hits[0][0] > lately:
            self._hits.popleft()
        many = len(self._hits) > _endless(contacts)
        return frozenset(name for _, name in self._hits) if many else frozenset()

    def dying(self, facts: LawValues, closing: Collection[LawElement]) -> dict[str, float]:
        """Return how much longer (s) elements would strike in turn, in cycles that shrink; none where they go on.

        They all touch, and none gets further away in a cycle than is lost in rounding, or what is left is less than
        1e-9 of the time since the first impact.
        """
        if not closing:
            return {}
        unseen, fastest = self._unseen(facts.t), max(-facts.rate(x) for x in closing)
        least = min((lost_height(facts, x) for x in facts.near), default=0.0)
        since = facts.t - self.rhythm.last
        if not (since < unseen or fastest * since < 4.0 * least):
            return {}
        names, cycle, left = self.rhythm.ending(facts.t, [x.name for x in closing])
        taking = [x for x in facts.near if x.name in names]
        low = all(abs(facts.rate(x)) * cycle < 4.0 * lost_height(facts, x) for x in taking)
        ends = len(taking) == len(names) and (low or max(cycle, left) < unseen)
        return {x.name: left for x in taking} if ends else {}

    def _unseen(self, time: float) -> float:
        return max(REMAINING * (time - self._first), TICKS * abs(time)) if self._first <= time else 0.0

    def remaining(self, facts: LawValues, element: LawElement, udot: Floats) -> float | None:
        """Return the time (s) for which an element would still bounce that is about to rest now; None if it goes on.

        A bouncing point with a rebound speed v that closes with an acceleration a under `udot` (nu,) has 2 v/(a (1-e))
        left in all.
        """
        if not ceases(facts, element) or not (falling := facts.falling(element, udot)) > 0.0:
            return None
        e = facts.restitution(element)
        rebound = -e * facts.rate(element)
        left = 2.0 * rebound / (falling * (1.0 - e))
        unseen = max(REMAINING * (facts.t - self.since.setdefault(element.name, facts.t)), TICKS * abs(facts.t))
        return left if left < unseen or low_bounce(facts, element, falling, rebound) else None

    def rested(self, names: Collection[str]) -> None:
        """Forget elements that rest or are apart for good."""
        for name in names:
            self.since.pop(name, None)


def low_bounce(facts: LawValues, element: LawElement, falling: float, rebound: float, steps: float = 0.0) -> bool:
    """Return whether the height of a bounce is lost in rounding, or in the errors of steps (`lost_height`)."""
    return rebound * rebound < 2.0 * falling * lost_height(facts, element, steps)


def low_together(facts: LawValues, touching: Collection[str], apart: Collection[str], steps: float) -> set[str]:
    """Return what touches or flies, and all moves so slowly that it may bounce lower than what is lost.

    None where anything touches that is faster. What acts on the rows tells how it falls: some fall by others alone.
    """
    near = [x for x in facts.near if x.name in touching or (x.name not in apart and facts.standing(x) != "open")]
    falling = max((abs(float(facts.known["right"][facts.place(x.normals[0])])) for x in near), default=0.0)
    slow = (x for x in near if low_bounce(facts, x, falling, facts.rate(x), steps))
    names = {x.name for x in slow if facts.gap(x) < lost_height(facts, x, steps)}
    return names if names.issuperset(touching) else set()


def lost_height(facts: LawValues, element: LawElement, steps: float = 0.0) -> float:
    """Return the height (m, or rad) below which a bounce is lost in rounding, or in errors of steps.

    These are the tolerances of another library, and the part `steps` of the farthest that is moved.
    """
    farthest, scale = facts.farthest(element), facts.scale
    return max(LOST_HEIGHT * farthest, scale.atol + scale.rtol * farthest, steps * farthest)


def ceases(facts: LawValues, element: LawElement) -> bool:
    """Return whether bounces of an element get lower and lower."""
    return 0.0 < facts.restitution(element) < 1.0


def lone_bounce(facts: LawValues, element: LawElement, hidden: Collection[str] = ()) -> ImpactOutcome | None:
    """Return the impact of one smooth element alone where nothing else touches and no row holds; None elsewhere.

    That of a rim that lies flat has no place. What is `hidden` takes no part; what does not close strikes nothing,
    however deep rounding has let it in.
    """
    laws, place, e = facts.laws, facts.place(element.normals[0]), facts.restitution(element)
    rubs = laws.two_sided_rub or laws.has_friction(element)
    if laws.mechanism.rows or not e > 0.0 or rubs or facts.lying([element]):
        return None
    row, speed = facts.by_mass[place], facts.rate(element)
    moved = float(row @ row)
    if not speed < 0.0 or not moved:
        return None
    impulse = -(1.0 + e) * speed / moved
    jump = facts.speeds(impulse * row)
    others = [x for x in facts.near if x is not element and x.name not in hidden]
    if others:
        before, after = facts.known["phidot"], facts.known["phidot"] + facts.by_speeds @ jump
        for x in others:  # none may touch and close before or after the impact
            normal, k = x.normals[0], facts.place(x.normals[0])
            touches = not facts.known["phi"][k] > facts.allowed_gap(x)
            if touches and min(before[k], after[k]) <= facts.allowed_speed(normal):
                return None
    lost = {element.name: 0.5 * impulse * (e - 1.0) * speed}
    rows = {element.normals[0].name: impulse}
    at = facts.t, facts.q, facts.u
    return ImpactOutcome(jump, {element.name: impulse}, lost, *at, rows, facts.laws.parameters, gives_back=e == 1.0)


def without_collision(facts: LawValues, touching: Collection[str]) -> ImpactOutcome:
    """Return the impact of what touches and rubs so that no forces fulfil the laws, though nothing closes (Painleve).

    It is the limit of what happens to what has been pressed together for a time that becomes zero: such impulses stop
    slip. Raises NoSolutionError if the laws of the impact have no solution.
    """
    normals = [x.normals[0] for x in facts.laws.named(touching)]
    pace = max(float(facts.known["right"][facts.place(row)]) / facts.allowed_speed(row) for row in normals)
    return impact_at(facts, touching, (), pressed=_PRESSED / pace if pace > 0.0 else 0.0)


def impact_at(
    facts: LawValues,
    touching: Collection[str],
    resting: Collection[str],
    held: Collection[str] = (),
    *,
    pressed: float = 0.0,
    most: int | None = None,
) -> ImpactOutcome:
    """Return the impact of what touches, without a rebound of what is `resting`.

    What is `held` stays together, whichever way its impulse acts; where it pulls and jams, it does not rub. Loads have
    `pressed` all together for so long (s), and all of it strikes at once then. `most` is that of the `ImpactProblem`.
    Raises NoSolutionError if its laws have no solution, or none is found.
    """
    from multibody_sym.contact_laws.impact_problem import (  # which a run without laws does not need
        ImpactLaw,
        ImpactProblem,
        Order,
    )
    from multibody_sym.contact_laws.impact_sequence import strike

    problem = facts.posed(touching)
    places, own = problem.places, [element for element in problem.elements if element.unilateral]
    bounces, allowed = np.zeros((2, len(problem.names)))
    for element in own:
        place = places[element.normals[0].name]
        bounces[place] = 0.0 if element.name in resting else facts.restitution(element)
        allowed[place] = facts.allowed_speed(element.normals[0])
    speeds = facts.known["phidot"][[facts.laws.places[name] for name in problem.names]]
    speeds[[row for part in problem.problem.parts if part.rests for row in part.rows]] = 0.0  # no slip of rounding
    right = pressed * problem.problem.right - speeds
    together = {places[x.normals[0].name] for x in own if x.name in held}
    laws = tuple(Equality() if k in together else law for k, law in enumerate(problem.problem.laws))
    rows = replace(problem.problem, right=right, laws=laws)
    law: ImpactLaw = "poisson" if problem.parts else "newton"
    sequence: Order = "one_by_one" if bounces.any() and not pressed else "simultaneous"
    firsts = {  # what rubs first at an element gives friction back, not what rolls
        next((p.name for p in x.frictions if p.name in facts.laws.parts), ""): facts.laws.elements[x.name]
        for x in problem.elements
    }
    returns: Floats = facts.known["returns"]
    returned = tuple(float(returns[firsts[p.name]]) if p.name in firsts else 0.0 for p in problem.parts)
    posed = ImpactProblem(rows, bounces, returned, law, sequence, allowed, names=problem.names)
    posed = posed if most is None else replace(posed, most=most)
    found = _without_jam(posed, strike(posed), together)
    taken = {x.name: [places[row.name] for row in x.rows if row.name in places] for x in problem.elements}
    normals = [places[x.normals[0].name] for x in own]
    return ImpactOutcome(
        facts.speeds(found.x) + pressed * facts.known["free"],
        {x.name: float(found.impulses[place]) for x, place in zip(own, normals, strict=True)},
        {name: float(np.nansum(found.lost[own_rows])) for name, own_rows in taken.items()},
        facts.t,
        facts.q,
        facts.u,
        dict(zip(problem.names, found.impulses.tolist(), strict=True)),
        facts.laws.parameters,
        found.notes,
        bool(abs(found.lost[normals].sum()) <= _LOSSLESS * np.abs(speeds * found.impulses)[normals].sum()),
    )


def _without_jam(posed: ImpactProblem, found: ImpactResult, together: set[int]) -> ImpactResult:
    """Return what is found; where friction of what is held `together` jams, that without it.

    What pulls rubs as if it pressed, so that such impulses and their friction may hold each other up, of any size. Then
    what pulls does not rub; where the others go on to jam, nothing that is held does.
    """
    from multibody_sym.contact_laws.impact_sequence import strike

    pulling = {k for k in together if found.impulses[k] < 0.0}
    if not any(pulling.intersection(part.normals) for part in posed.rows.parts):
        return found

    def smooth(normals: set[int]) -> ImpactProblem:
        parts = list[FrictionLaw]()
        for part in posed.rows.parts:
            pulls = normals.intersection(part.normals)
            parts.append(replace(part, static=0.0, kinetic=0.0, enough=False) if pulls else part)
        return replace(posed, rows=replace(posed.rows, parts=tuple(parts)))

    least = strike(smooth(together))
    most = _JAMS * np.abs(least.impulses).sum()
    if np.abs(found.impulses).sum() <= most:
        return found
    some = strike(smooth(pulling))
    return some if np.abs(some.impulses).sum() <= most else least


# ----------------------------------------------------------------------------------------------------------------------
# Speeds that stand still as long as a mode lasts: rows at rest hold them, wherever else the mechanism goes.


_HELD: Final = 1e-10
"""What the rows may leave of a unit speed that they hold."""
_ASIDE: Final = 1e-3
"""How far, as turns and against the model's size, the position lies aside at which the rows hold the same speeds."""


Holding = tuple[int, tuple[str, ...]]
"""A speed by its place, and the rows that would hold it, by their names."""


def held_speeds(
    mechanism: Mechanism, parameters: Floats, at: LawValues, known: dict[Holding, bool]
) -> tuple[int, ...]:
    """Return the places of the speeds that the rows of a mechanism in a mode hold at zero, here and beside.

    A speed is held if its unit vector lies in the space of rows that have no part of their own in motion, as a belt's
    or a drive's has: H u = 0 and H udot = 0 for u = 0. `known` are speeds of which other modes have shown it.
    """
    if not mechanism.rows:
        return ()
    rows = [row.plain for row in mechanism.rows]
    if not all(row.restricts for row in rows):
        return _held_beside_too(mechanism, parameters, at)
    shares = determined(at.by_speeds[[at.place(row) for row in rows]], _HELD)
    asked = {(k, tuple(rows[j].name for j in np.flatnonzero(np.abs(share) > _HELD))) for k, share in shares.items()}
    new = {name for one in asked if one not in known for name in one[1]}
    if new:
        own = tuple(row for row in rows if row.name in new)
        held = _held_beside_too(replace(mechanism, rows=own), parameters, at)
        known |= {one: one[0] in held for one in asked if one not in known}
    if all(known[one] for one in asked):
        return tuple(sorted(shares))
    return _held_beside_too(mechanism, parameters, at)


def _held_beside_too(mechanism: Mechanism, parameters: Floats, at: LawValues) -> tuple[int, ...]:
    here = _held_places(mechanism, parameters, at.t, at.q)
    if not here:
        return ()
    aside = np.array([np.sin(1.0 + 2.0 * k) for k in range(len(mechanism.speeds))]) * _ASIDE
    moved = np.array(coordinate_rates(mechanism, at.q.tolist(), aside.tolist()), dtype=float)
    states = len(mechanism.rates)  # which may drive a row, though they are zero now
    moved[len(moved) - states :] = _ASIDE
    return tuple(sorted(here & _held_places(mechanism, parameters, at.t + _ASIDE, at.q + moved)))


def _held_places(mechanism: Mechanism, parameters: Floats, t: float, q: Floats) -> set[int]:
    still = [0.0] * len(mechanism.speeds)
    motion = motion_of(mechanism, state_of(mechanism, float, t, q.tolist(), still, parameters.tolist()))
    rows = [
        row.jacobian
        for row in row_motions(motion)
        if row.kinematic and float(row.phidot) == 0.0 and float(row.gamma) == 0.0
    ]
    matrix = np.array(rows, dtype=float).reshape(len(rows), len(still))
    sizes = np.linalg.norm(matrix, axis=1)
    matrix = matrix[sizes > 0.0] / sizes[sizes > 0.0][:, None]
    if not len(matrix):
        return set()
    kept = row_space(matrix, _HELD)
    left = np.linalg.norm(np.eye(len(still)) - kept.T @ kept, axis=0)
    return set(np.flatnonzero(left <= _HELD).tolist())
