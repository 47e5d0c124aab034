"""The state that follows a switch of a run.

Positions are put onto their rows, what closes strikes, speeds stop, and the laws decide which mode follows.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from multibody_sym.contact_laws.impact_problem import NoImpulsesError
from multibody_sym.contact_laws.problem import COLLIDE, LawState, LawStates
from multibody_sym.dynamics.contact.contact_problem import CLEAR, PosedLaws
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.contact_geometry import ON_POINTS
from multibody_sym.mechanics.law_elements import INACTIVE, STICKS, LawElement, Mode
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.motion import qdot_of
from multibody_sym.motion.loop.integrate import runge_kutta_step
from multibody_sym.motion.loop.problem import Reason
from multibody_sym.motion.switching import impact
from multibody_sym.motion.switching.impact import (
    BounceMemory,
    ImpactOutcome,
    at_rest,
    at_state,
    impact_at,
    lost_height,
    low_bounce,
    low_together,
    onto_rows,
    without_collision,
)
from multibody_sym.motion.switching.law_values import LawValues, basic_mode, rounded_up
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import SWITCHED, least_squares

# ----------------------------------------------------------------------------------------------------------------------
# What is left of infinitely many impacts, all lower than rounding of positions: each flight on its parabola.
#
# Gaps are added up by themselves, from impact to impact: a gap of 1e-20 m is known well that no position could tell.


_MOST: Final = 150
"""Impacts that are followed."""
_CYCLE: Final = 6
"""Flights that take as long, but for `_SHRINKS` of it, as those before them, and these too, do not come to an end.

Nor do so many that no longer move the time: one element hops in place while others fly on.
"""
_SHRINKS: Final = 0.99


@dataclass(frozen=True, eq=False)
class AfterImpact:
    """What holds once what touches has struck: `facts`, what stays closed, the laws, the accelerations (nu,), the mode.

    `udot` is None where the laws have no state.
    """

    facts: LawValues
    touching: list[str]
    problem: PosedLaws
    udot: Floats | None
    mode: Mode | None


Strike = Callable[[LawValues, list[str], Mode | None], AfterImpact]
"""Lets what touches strike, near a mode, if one was before."""


def rest_of(facts: LawValues, touching: Collection[str], taking: Collection[str], strike: Strike) -> LawValues | None:
    """Return the end of all impacts of `taking` that begin with those of what is `touching`; None where none is met."""
    gaps = {x.name: 0.0 if x.name in touching else max(facts.gap(x), 0.0) for x in facts.laws.named(taking)}
    now, flights, mode = facts, list[float](), None
    for _ in range(_MOST):
        met = strike(now, [name for name, gap in gaps.items() if gap == 0.0], mode)
        mode = met.mode
        if met.udot is None:
            return None
        off = [x for x in met.facts.laws.named(gaps) if gaps[x.name] or x.name not in met.touching]
        flying = {x.name: Fall.of(met.facts, x, gaps[x.name], met.udot) for x in off}
        if not flying:
            return met.facts
        first = min(flying, key=lambda name: flying[name].left)
        left = flying[first].left
        stops = _time_to_stop(met, left)
        flights.append(min(left, stops))
        oldest, before, last = (sum(flights[k * _CYCLE : (k + 1) * _CYCLE or None]) for k in (-3, -2, -1))
        goes_on = len(flights) >= 3 * _CYCLE and last > _SHRINKS * before and before > _SHRINKS * oldest
        hops = len(flights) >= _CYCLE and met.facts.t + last == met.facts.t
        if not math.isfinite(left) or goes_on or hops:
            return None
        now = _after_flight(met, flights[-1])
        gaps |= {name: fall.gap(flights[-1]) for name, fall in flying.items()}
        gaps |= {first: 0.0} if left <= stops else {}
    return None


@dataclass(frozen=True)
class Fall:
    """The gap (m) of an element that flies, its rate (m/s) and how fast this falls (m/s^2)."""

    start: float
    rate: float
    falling: float

    @staticmethod
    def of(facts: LawValues, element: LawElement, gap: float, udot: Floats) -> Fall:
        """Return how an element flies from a gap (m) on, under accelerations (nu,); what is rounding of rest rests."""
        rate = facts.rate(element) if gap > 0.0 or facts.sense(element) else 0.0
        return Fall(gap, rate, facts.falling(element, udot))

    @property
    def left(self) -> float:
        """How long (s) it flies on, infinitely long where it does not come back."""
        room = self.rate * self.rate + 2.0 * self.falling * self.start
        if room < 0.0 or not (self.falling > 0.0 or self.rate < 0.0):
            return math.inf
        root = math.sqrt(room)
        if self.rate > 0.0:
            return (self.rate + root) / self.falling
        return 2.0 * self.start / (root - self.rate) if root > self.rate else 0.0  # it touches already

    def gap(self, time: float) -> float:
        """Return the gap after a time (s)."""
        return max(self.start + self.rate * time - 0.5 * self.falling * time * time, 0.0)


def _after_flight(met: AfterImpact, time: float) -> LawValues:
    """Return the values of the laws after a flight of some time (s)."""
    facts, udot = met.facts, met.udot
    assert udot is not None
    mean, u = facts.u + 0.5 * time * udot, facts.u + time * udot
    rates = qdot_of(facts.state, facts.laws.mechanism, mean.tolist())
    return facts.laws.at(facts.t + time, facts.q + time * np.array(rates, dtype=float), u, facts.scale)


def _time_to_stop(met: AfterImpact, most: float) -> float:
    """Return after which time (s), up to `most`, slip in the plane stops first, `most` where none does."""
    facts, udot = met.facts, met.udot
    assert udot is not None
    for part, law in zip(met.problem.parts, met.problem.problem.parts, strict=True):
        if law.rests or len(part.rows) != 1:
            continue
        place = facts.place(part.rows[0])
        speed = float(facts.known["phidot"][place])
        rate = float(facts.accelerations([place], udot)[0])
        if speed * rate < 0.0:
            most = min(most, -speed / rate)
    return most


# ----------------------------------------------------------------------------------------------------------------------
# The state that follows a switch of a run.


SOON: Final = (1e-7, 1e-5, 1e-3)
"""Parts of the time in which the fastest passes the model's size: so soon it shows how forces at a limit change."""
_WEDGED: Final = 3
"""Impacts without collision at one instant."""
_CLOSES: Final = 4.0
"""The multiple of the depth at which a contact closes below which what rocks is made by the fall through that depth."""
_HEAP: Final = 12
"""The most elements that push each other and are no heap."""
_SMOOTH: Final = "simulation: {friction: {regularised: 1e-3}}"


@dataclass(frozen=True, eq=False)
class NextState:
    """How a run goes on from an instant: with the coordinates and speeds of `facts`, in a mode; None if there is none.

    Where something comes to rest after infinitely many impacts `facts` are those of their limit, later than the last
    that the run has resolved; those of this one where it has met too few to know the limit.
    `largest` is the largest force there, as forces are measured; `found` the states that are possible, of a problem as
    `posed`; both None where the mode was known before and verified. `blow`: what an impact did, None without one;
    `late`: how much longer (s) what rests now would still have bounced; of this has `collapsed` what struck in turn.
    `hindered` says why an impact could not be solved, or where else the laws have no forces: then there is no mode, for
    what strikes would go on into what it strikes.
    """

    facts: LawValues
    mode: Mode | None
    largest: float
    found: LawStates | None
    posed: PosedLaws | None
    blow: ImpactOutcome | None = None
    late: Mapping[str, float] = field(default_factory=dict)
    collapsed: frozenset[str] = frozenset()
    hindered: Reason | None = None

    @property
    def several(self) -> bool:
        """Whether the laws have several states."""
        return self.found is not None and self.found.verdict == "several"

    @property
    def undecided(self) -> dict[str, str]:
        """The elements in which the states differ that the laws leave, with the words of the state that is taken."""
        if not self.several or self.found is None or self.posed is None or self.mode is None:
            return {}
        posed, free = self.posed, self.found.free
        taken = mode_words(posed.elements, self.mode)
        states = [mode_words(posed.elements, posed.mode(state)) for state in self.found.states]
        open_forces = {x.name for x in posed.elements if any(posed.places.get(row.name) in free for row in x.rows)}
        return {x: y for x, y in taken.items() if x in open_forces or any(z.get(x) != y for z in states)} or taken

    @property
    def why_none(self) -> Reason:
        """Why there is no mode, and what to do."""
        none = "" if self.found is None else self.found.why_none
        touching = [x for x in (self.posed.elements if self.posed else ()) if x.unilateral]
        collide = "" if not touching or any(x.collides for x in touching) else f"{COLLIDE}, "
        cures = f"end the run before, lower the friction, {collide}or make it smooth by {_SMOOTH}"
        proved = self.found is not None and self.found.proved
        return self.hindered or Reason(f"{none} ({cures}),", ends=proved)

    @staticmethod
    def largest_of(forces: Floats, facts: LawValues, rows: Sequence[int]) -> float:
        """Return the largest force of rows at some places, and no less than what acts on all that they are joined to.

        Rounding is a part of it, also where weights leave nothing for a contact to carry, as in free fall. No less than
        a thousandth of what would move the rows; where nothing acts at all, what would stop the fastest soon counts as
        that. It is rounded up to a power of two, so that it does not hang on digits.
        """
        causes, scale = 1e-3 * np.abs(facts.known["right"][rows]), facts.scale
        largest = max(float(x.max(initial=0.0)) for x in (np.abs(forces), causes, facts.weights(rows)))
        return rounded_up(largest or 1e-3 * scale.speed / scale.time)

    def carried(self, element: LawElement) -> float:
        """Return the normal force (N) of an element in the first state that was found, 0 where it takes no part."""
        place = None if self.posed is None else self.posed.places.get(element.normals[0].name)
        states = () if self.found is None else self.found.states
        return 0.0 if place is None or not states else float(states[0].z[place])


@dataclass(frozen=True, eq=False)
class Before:
    """The mode in which a run came to a switch, its accelerations (nu,) there, a mode that may follow, what bounces.

    `rates` are those (nq + nu,) of the mode at a time and a state (nq + nu,), None where it leads no further.
    """

    mode: Mode
    udot: Floats
    rates: Callable[[float, Floats], Floats] | None
    guess: Mode | None
    bounces: BounceMemory

    @cached_property
    def resting(self) -> frozenset[str]:
        """The elements that act in the mode."""
        return frozenset(name for name, side in self.mode.sides.items() if side != INACTIVE)

    def late(self, facts: LawValues, closing: Collection[LawElement]) -> dict[str, float]:
        """Return the time (s) for which each element would still bounce that rests from now on, or collapses.

        An element that bounces by itself does not rest if another one strikes before.
        """
        left = {x.name: self.bounces.remaining(facts, x, self.udot) for x in closing}
        others = [x for x in facts.near if x not in closing and x.name not in self.resting]
        falls = (Fall.of(facts, x, max(facts.gap(x), 0.0), self.udot) for x in others)
        next_one = min((fall.left for fall in falls), default=math.inf)
        ending = dict.fromkeys(self.bounces.collapsing(facts.t, len(facts.laws.unilateral)), 0.0)
        ending |= self.bounces.dying(facts, closing)
        return ending | {name: time for name, time in left.items() if time is not None and time < next_one}


def next_state(
    facts: LawValues,
    closed: Collection[str],
    before: Before | None = None,
    *,
    beyond: Collection[str] = (),
    hidden: tuple[str, ...] = (),
    blow: ImpactOutcome | None = None,
) -> NextState:
    """Return how a run goes on from an instant at which the unilateral elements named `closed` touch.

    Others that touch there count as well, but for those that fly, however low, or have got `beyond` an edge, however
    near they still are. Those that are `hidden` take no part: sides of thin bars on which a point is not. Several
    events at once are one. `before` is None at the start. A `blow` that is known is the impact.
    """
    apart = {*beyond, *hidden}
    flying = before.bounces.flying(facts, closed) if before is not None else set[str]()
    touching = [name for name in facts.touching(closed) if name not in apart | flying]
    facts = at_state(facts, q=onto_rows(facts, touching))
    if lying := facts.lying(facts.laws.named(touching)):
        flat = Reason(f"{lying} ({ON_POINTS}, or end the run before),", ends=True)
        return NextState(facts, None, 0.0, None, None, hindered=flat)
    closing = impact.approaching(facts, touching)
    late = before.late(facts, closing) if before is not None else {}
    held = before.bounces.dying(facts, closing).keys() - apart if before is not None else set[str]()
    try:
        after = (
            _after(facts, touching, before, late, held)
            if blow is None
            else _after_impact(facts, touching, blow, before, late, held)
        )
        rest = None if before is None or blow is not None else _rest_unseen(after, facts, touching, before, apart)
        if rest is not None:
            after, held = rest.after, rest.moved
            late = dict.fromkeys(held, 0.0)
        while late and (back := _coming_back(after, apart | flying) - held):
            late, held = dict.fromkeys(back, 0.0) | late, held | back
            after = _after(facts, touching, before, late, held)
        end = before.bounces.limit(facts, closing, late, before.resting) if before is not None else None
        if end is not None and _alone(end, after.touching):
            late = dict.fromkeys(late, end.t - facts.t)
            end = at_state(end, q=onto_rows(end, after.touching))
            after = _states_after(end, after.touching, before, after.blow)
        elif before is not None and held and (rest is None or rest.followed):
            end = _end_of_impacts(facts, touching, after.touching, before)
            late = late if end is None else dict.fromkeys(late, end.t - facts.t)
    except NoSolutionError as error:
        ends = isinstance(error, NoImpulsesError)  # then it is proved that there is no solution
        hindered = Reason(f"the impact cannot be solved: {error}", ends=ends)
        return NextState(facts, None, 0.0, None, None, hindered=hindered)
    facts, touching, blow, problem, found = after.facts, after.touching, after.blow, after.problem, after.found
    state, mode = _lasting_state(problem, found, hidden)
    if before is not None and before.rates is not None and blow is None and _at_limit(facts, mode, before.mode):
        state, mode = _state_soon_after(facts, touching, before.mode, before.rates, (state, mode), hidden)
    rows = [facts.laws.places[name] for name in problem.names]
    largest = 0.0 if state is None else NextState.largest_of(state.z, facts, rows)
    return NextState(facts, mode, largest, found, problem, blow, late, frozenset(held))


@dataclass(frozen=True, eq=False)
class _After:
    """What holds after an impact, if there is one, what touches, and the states that are possible by its laws."""

    facts: LawValues
    touching: list[str]
    blow: ImpactOutcome | None
    problem: PosedLaws
    found: LawStates

    @property
    def wedged(self) -> bool:
        """Whether it is proved that no forces fulfil the laws of what touches and rests, some of which bounces."""
        return self.facts.wedged(self.facts.laws.named(self.touching), self.found)


def _after(
    facts: LawValues,
    touching: list[str],
    before: Before | None,
    late: Mapping[str, float],
    held: Collection[str],
    most: int | None = None,
) -> _After:
    """Return the state after the impact: `late` elements do not rebound, `held` ones stay at rest.

    Raises NoSolutionError if the laws of the impact have no solution.
    """
    if held:
        touching = [x.name for x in facts.laws.unilateral if x.name in held or x.name in touching]
        facts = at_state(facts, q=onto_rows(facts, touching))
    blow = impact_at(facts, touching, late, held, most=most) if impact.approaching(facts, touching) else None
    after = _after_impact(facts, touching, blow, before, late, held)
    for _ in range(_WEDGED):
        if not after.wedged:
            break
        again = without_collision(after.facts, after.touching)
        blow = again if after.blow is None else after.blow.then(again)
        after = replace(_after_impact(after.facts, after.touching, again, before, late, held), blow=blow)
    return after


def _after_impact(
    facts: LawValues,
    touching: list[str],
    blow: ImpactOutcome | None,
    before: Before | None,
    late: Mapping[str, float],
    held: Collection[str],
) -> _After:
    """Return the contacts, speeds and possible states after a jump of speeds."""
    if blow is not None:
        facts = at_state(facts, u=facts.u + blow.jump)
        leaving = [x.name for x in facts.laws.named(touching) if facts.standing(x) == "leaving"]
        if before is not None and late:  # where others rest, what hardly gets off does not leave
            off = (x for x in facts.laws.named(leaving))
            leaving = [x.name for x in off if not low_bounce(facts, x, facts.falling(x, before.udot), facts.rate(x))]
        touching = [name for name in touching if name in held or name not in leaving]
    return _states_after(facts, touching, before, blow)


def _states_after(facts: LawValues, touching: list[str], before: Before | None, blow: ImpactOutcome | None) -> _After:
    """Return the possible states of elements that touch after an impact."""
    facts = at_state(facts, u=at_rest(facts, touching))
    problem = facts.posed(touching)
    found = _find_states(problem, None if before is None else before.guess or before.mode)
    return _After(facts, touching, blow, problem, found)


@dataclass(frozen=True, eq=False)
class _Rest:
    """What follows `after` an impact once all rests that would bounce on unseen, and those of it that still `moved`.

    `followed`: whether the impacts that are left out may be followed to their end, for its time.
    """

    after: _After
    moved: set[str]
    followed: bool


def _rest_unseen(
    after: _After, facts: LawValues, touching: list[str], before: Before, apart: Collection[str]
) -> _Rest | None:
    """Return what follows once all rests that would bounce on unseen `after` an impact.

    None where nothing does, or it strikes in a cycle that shrinks: its end is known. Let all rest, with forces F.
    Impacts make no energy, and where nothing touches loads do the work of the forces that balance them: the energy of
    the speeds that the rest takes, and F times the gap, summed, fall. So nothing ever gets higher than that sum divided
    by its own F, whatever strikes next, with restitution 1 even. Nor do the impulses of all impacts differ, summed,
    from those of the rest: friction, too, is proportional to what presses while it slides one way. Many impacts that
    give all back have no end by themselves: there what bounces lower than steps err rests. So it does in a heap, where
    each impact sets off others of all that hangs together.
    """
    strikes = {x.name for x in impact.approaching(facts, touching)}
    if after.blow is None or before.bounces.rhythm.ending(facts.t, strikes)[0]:
        return None
    steps = facts.scale.steps
    low = _pushed_by(strikes, facts, low_together(facts, touching, apart, steps))
    heap = len(low) > _HEAP
    if not heap and not before.bounces.endless(len(facts.laws.unilateral)):
        steps, low = 0.0, _pushed_by(strikes, facts, low_together(facts, touching, apart, 0.0))
    leaving = {x.name for x in after.facts.laws.named(low) if after.facts.standing(x) == "leaving"}
    leaving |= low.difference(after.touching)
    while not low.isdisjoint(leaving):
        smooth = {x.name for x in facts.laws.named(low) if not facts.laws.has_friction(x)}
        held, late = smooth | low & (strikes | leaving), dict.fromkeys(low, 0.0)
        try:
            rest = _after(facts, touching, before, late, held, most=0)
            while heap and (off := low.difference(rest.touching)):  # the rest of some makes others leave
                held |= off
                rest = _after(facts, touching, before, late, held, most=0)
        except NoSolutionError:
            return None
        seen = _still_seen(facts, rest, low, steps, heap=heap) if low.issubset(rest.touching) else low
        if not seen:
            return _Rest(rest, {x.name for x in facts.laws.named(low) if facts.sense(x)}, not heap)
        if not seen.isdisjoint(strikes):
            return None
        low = low - seen
    return None


def _pushed_by(strikes: Collection[str], facts: LawValues, low: Collection[str]) -> set[str]:
    """Return the `low` elements that what strikes pushes, over any others of them."""
    from multibody_sym.contact_laws.impact_sequence import clusters  # which a run without laws does not need

    if not low:
        return set()
    problem = facts.posed(low)
    numbers = clusters(problem.problem)
    own = {x.name: numbers[problem.places[x.normals[0].name]] for x in facts.laws.named(low)}
    pushed = {own.get(name) for name in strikes}
    return {name for name, number in own.items() if number in pushed}


def _still_seen(facts: LawValues, rest: _After, low: Collection[str], steps: float, *, heap: bool) -> set[str]:
    """Return the `low` elements that might bounce higher than errors of steps.

    Where the rest has to hold together what rubs and separates, friction of no impulse would pull: then only that is
    lost which is about as low as a contact gets in before it closes, but in a `heap`. The fall through this depth makes
    such speeds, and a box would rock by them for ever. Of forces that are not unique the rest takes the most even ones.
    """
    if rest.blow is None or not rest.found.states:
        return set(low)
    elements, energy = facts.laws.named(low), 0.0
    pulls = not heap and any(rest.blow.impulses[x.name] < 0.0 for x in elements if facts.laws.has_friction(x))
    places = [rest.problem.places[x.normals[0].name] for x in elements]
    exerted = rest.problem.problem.exerted[places].T
    forces = least_squares(exerted, exerted @ rest.found.states[0].z[places], SWITCHED).tolist()
    for x, force in zip(elements, forces, strict=True):
        energy += abs(facts.rate(x) * rest.blow.impulses[x.name]) / 2.0 + force * max(facts.gap(x), 0.0)
    heights = (_CLOSES * facts.rounded_gap(x) if pulls else lost_height(facts, x, steps) for x in elements)
    triples = zip(elements, forces, heights, strict=True)
    return {x.name for x, force, height in triples if energy >= force * height}


def _alone(end: LawValues, touching: Collection[str]) -> bool:
    """Return whether nothing else touches at the limit of impacts: it would have struck before."""
    others = (x for x in end.laws.unilateral if x.name not in touching)
    return all(end.standing(x) == "open" for x in others)


def _end_of_impacts(
    facts: LawValues, touching: list[str], resting: Collection[str], before: Before
) -> LawValues | None:
    """Return the end of all impacts of what comes to rest together; None if that is not known."""
    try:
        end = rest_of(facts, touching, resting, partial(_instant, before))
    except NoSolutionError:
        return None
    return end if end is not None and _alone(end, resting) else None


def _instant(before: Before, facts: LawValues, touching: list[str], near: Mode | None) -> AfterImpact:
    """Return the state after an impact with the elements' own restitution, where it was `near` a mode before it."""
    met = _after(facts, touching, before if near is None else replace(before, guess=near), {}, ())
    state = met.found.states[0] if met.found.states else None
    if state is None:
        return AfterImpact(met.facts, [], met.problem, None, near)
    mode = met.problem.mode(state)
    active = [name for name in met.touching if mode.sides.get(name, INACTIVE) != INACTIVE]
    return AfterImpact(met.facts, active, met.problem, met.facts.udot(state.x), mode)


def _coming_back(after: _After, others: Collection[str]) -> set[str]:
    """Return the elements that leave but fall back from no higher than counts as touching.

    An element at rest while others struck did not fall before. It rises as they come to rest, and they rise as it does
    later: bodies that slide would rock on for ever, unseen.
    """
    facts, states = after.facts, after.found.states
    if after.blow is None:
        return set()
    leaving = [x for x in facts.near if x.name not in others and facts.standing(x) == "leaving"]
    back = {x.name for x in leaving if x.name in after.touching}
    if states:
        udot = facts.udot(states[0].x)
        back |= {x.name for x in leaving if low_bounce(facts, x, facts.falling(x, udot), facts.rate(x))}
    return back


def _at_limit(facts: LawValues, mode: Mode | None, before: Mode) -> bool:
    """Return whether the mode after a switch is at its own limit, so that only a later instant decides.

    It is where no mode was found, and in the mode before in which nothing is left to share in another way. So it is
    where a reaction that pressed on one side presses on none and is about to press on the other (components of a vector
    whose length presses have no sides), and where something slips that any normal force would hold. It is not where
    something sticks that slid before: the mode before would let it slip back soon after.
    """
    slips = {} if mode is None else mode.slips
    if any(slip != STICKS and slips.get(name, slip) == STICKS for name, slip in before.slips.items()):
        return False
    if mode is None or (mode.alike(before) and (mode.shares is None or mode.shares.room <= CLEAR)):
        return True
    two_sided = [x for x in facts.laws.mechanism.one_way if not x.unilateral]
    sided = [(x, row) for x in two_sided for part in x.frictions if not part.norm for row in x.normals_of(part)]
    parts = (part for element in facts.laws.mechanism.one_way for part in element.frictions)
    lets_go = any(part.enough and mode.slip(part) != STICKS for part in parts)
    return lets_go or any(before.side(*each) and not mode.side(*each) for each in sided)


def _find_states(problem: PosedLaws, previous: Mode | None) -> LawStates:
    """Return the possible states: all at the start of a run, later the one next to its mode."""
    from multibody_sym.contact_laws.search import find  # which a run without laws does not need

    return find(problem.problem, None if previous is None else problem.law_mode(previous), every=previous is None)


def _lasting_state(
    problem: PosedLaws, found: LawStates, hidden: tuple[str, ...]
) -> tuple[LawState | None, Mode | None]:
    """Return the first of the states whose forces can stay as they are for some time, with its mode.

    All are asked for where none of those that were found does; where none does at all, it is the first one.
    """
    if not found.states:
        return None, None

    def asked() -> Iterator[LawState]:
        yield from found.states
        yield from _find_states(problem, None).states

    basic = ((state, mode) for state in asked() if (mode := basic_mode(problem, state)) is not None)
    state, mode = next(basic, (found.states[0], problem.mode(found.states[0])))
    return state, replace(mode, idle=(*mode.idle, *hidden)) if hidden else mode


def _state_soon_after(
    facts: LawValues,
    touching: Collection[str],
    before: Mode,
    rates_of: Callable[[float, Floats], Floats],
    known: tuple[LawState | None, Mode | None],
    hidden: tuple[str, ...],
) -> tuple[LawState | None, Mode | None]:
    """Return the state, with its mode, in which a run goes on that is at the limit of its mode: that found soon after.

    It is the same where nothing else is found; on the way there the forces of the mode go on to change, and what sticks
    or touches in it goes on to do so. Where that leaves no state, it begins to slip: on a straight line.
    """
    state, mode = known
    now = np.concatenate([facts.q, facts.u])
    rates = rates_of(facts.t, now)
    for soon in (part * facts.scale.time for part in SOON):
        for x in (runge_kutta_step(rates_of, facts.t, now, soon), now + soon * rates):
            q, u = np.split(x, [len(facts.q)])
            there = facts.laws.at(facts.t + soon, q, u, facts.scale).posed(touching)
            found = _find_states(there, before)
            if found.states:
                break
        there_state, following = _lasting_state(there, found, hidden) if found.states else (state, mode)
        if following is None or mode is None or not following.alike(mode):
            return there_state, following
    return state, mode
