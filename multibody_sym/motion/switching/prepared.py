"""What the runs of one prepared system share: laws, modes, and a memory of what was decided.

A run that chatters meets the same few switches again and again. The search would find the same state first.
Where a speed has come to zero it begins with the mode to which that led before, and takes it where all laws hold; where
a force has come to its limit, it flips what is there in the mode that ends as soon as that is clearly beyond. Here laws
have to hold clearly, by three times of what the search allows; ties, impacts, friction in joints and in space are left
to the search. `turns.c` does the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import takewhile
from typing import Final

import numpy as np

from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.dynamics.programs.reactions import Switching
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.law_elements import INACTIVE, STICKS, FrictionPart, LawElement, Mode
from multibody_sym.mechanics.modes import has_rim
from multibody_sym.motion.loop.integrate import runge_kutta_step
from multibody_sym.motion.loop.problem import ActiveRows, Course, CourseMode, KnownTurn, Passage, Problem, Reason, Rub
from multibody_sym.motion.loop.python_loop import put_back
from multibody_sym.motion.methods.table import LibraryMethod
from multibody_sym.motion.switching import impact, law_mechanism
from multibody_sym.motion.switching.decision import SOON, Before, NextState, next_state
from multibody_sym.motion.switching.impact import (
    BounceMemory,
    Hit,
    ImpactOutcome,
    Returns,
    Standstill,
    ceases,
    lone_bounce,
)
from multibody_sym.motion.switching.law_mechanism import VertexContacts, is_tip, rounded_meeting
from multibody_sym.motion.switching.law_values import Laws, LawValues
from multibody_sym.motion.switching.legs import Cause, Change, ModeLeg
from multibody_sym.motion.switching.modes import MOST_KEPT, Key, ModePrograms, keep, key_of
from multibody_sym.program.runtime_constants import CLEAR_BY, CLEAR_MOTION, DETERMINED, MOST_ACTIVE, WITHIN, MarginKind
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.least_norm import solve_lists
from multibody_sym.scalars.limits import most, room


@dataclass(frozen=True)
class KnownSwitch:
    """A switch that was decided: of what touches, with `signs` of slip of its parts, and the `mode` that followed.

    `cause` is the place of the row whose condition ended the mode `before`, None where a speed did.
    """

    mode: Mode
    touching: tuple[str, ...]
    signs: tuple[tuple[FrictionPart, int], ...]
    rows: tuple[int, ...]
    after: ActiveRows
    before: ActiveRows | None = None
    cause: int | None = None


@dataclass(frozen=True, eq=False)
class Solved:
    """Forces z (m) and what is left a (m) of all rows, with what these are measured by, at rows of length one."""

    z: Floats
    a: Floats
    force: float
    terms: Floats


def known_switch(found: NextState, before: Mode, cause: Switching) -> KnownSwitch | None:
    """Return the record that recognises a decided switch of `plain` elements; None for impacts and several states."""
    facts, mode, posed = found.facts, found.mode, found.posed
    if mode is None or posed is None or found.blow is not None or found.several or mode == before:
        return None
    if cause.ends not in ("stops", "slips", "opens") or posed.problem.coupling.any():
        return None
    if any(x.idle or x.carried or x.directions or x.shares for x in (mode, before)):
        return None
    signs = tuple((part, _sign(facts, part)) for part in posed.parts)
    touching = tuple(element.name for element in posed.elements)
    after = _active_rows(facts.laws, mode, posed.elements, dict(signs))
    rows = tuple(facts.laws.places[name] for name in posed.names)
    if after is None or len(after.active) > MOST_ACTIVE:
        return None
    if cause.ends == "stops":
        return KnownSwitch(mode, touching, signs, rows, after)
    acting = _active_rows(facts.laws, before, posed.elements, dict(signs))
    row = cause.element.normals[0] if cause.part is None else cause.part.rows[0]
    if acting is None or len(acting.active) > MOST_ACTIVE:
        return None
    # The modes may differ in what has come to its limit alone.
    if cause.part is None:
        own = {part.name for part in cause.element.frictions}
        slips = {part: slip for part, slip in before.slips.items() if part not in own}
        flips = {**before.sides, cause.element.name: INACTIVE} == mode.sides and slips == mode.slips
    else:
        slip = mode.slips.get(cause.part.name, STICKS)
        flips = slip != STICKS and {**before.slips, cause.part.name: slip} == mode.slips
        flips = flips and before.sides == mode.sides
    if not flips:
        return None
    return KnownSwitch(mode, touching, signs, rows, after, acting, facts.laws.places[row.name])


def plain(element: LawElement) -> bool:
    """Return whether an element touches or not, and rubs in lines if it does, with no rim that may come to lie flat."""
    lines = all(len(p.rows) == 1 and not (p.norm or p.enough) and p.regularised is None for p in element.frictions)
    return element.unilateral and len(element.normals) == 1 and lines and not (is_tip(element) or has_rim(element))


def _sign(facts: LawValues, part: FrictionPart) -> int:
    """Return which way a part slides, 0 at rest."""
    speed = float(facts.known["phidot"][facts.place(part.rows[0])])
    return 0 if abs(speed) <= facts.allowed_slip(part) else 1 if speed > 0.0 else -1


def _active_rows(
    laws: Laws, mode: Mode, touching: Sequence[LawElement], signs: Mapping[FrictionPart, int]
) -> ActiveRows | None:
    """Return the rows that act in a mode; None if it contradicts the signs of slip."""
    active, slides, sticks = [laws.places[row.name] for row in laws.mechanism.rows], list[Rub](), list[Rub]()
    pressing, apart = list[int](), list[int]()
    for element in touching:
        normal = laws.places[element.normals[0].name]
        if mode.sides.get(element.name, INACTIVE) == INACTIVE:
            apart.append(normal)
            continue
        pressing.append(normal)
        active.append(normal)
        for part in (part for part in element.frictions if part in signs):
            tangent, slip = laws.places[part.rows[0].name], mode.slips.get(part.name, STICKS)
            if signs[part] and slip != signs[part]:
                return None
            if slip == STICKS:
                sticks.append(Rub(normal, tangent, laws.parts[part.name]))
                active.append(tangent)
            else:
                slides.append(Rub(normal, tangent, laws.parts[part.name], slip, not signs[part]))
    return ActiveRows(tuple(active), tuple(slides), tuple(sticks), tuple(pressing), tuple(apart))


# --- verified ---------------------------------------------------------------------------------------------------------


def follow_known_switch(
    switch: KnownSwitch, facts: LawValues, closed: Collection[str], rates: tuple[Floats, Floats] | None = None
) -> NextState | None:
    """Return how a run goes on, None where it is not clear. `rates`: of coordinates and speeds in the mode before."""
    if tuple(facts.touching(closed)) != switch.touching:
        return None
    facts = impact.at_state(facts, q=impact.onto_rows(facts, switch.touching))
    if impact.approaching(facts, switch.touching):
        return None
    facts = impact.at_state(facts, u=impact.at_rest(facts, switch.touching))
    if switch.before is None or rates is None or switch.cause is None:
        solved = _holds(switch, facts, switch.after)
    else:
        solved = _holds_soon_after(switch, switch.before, switch.cause, facts, rates)
    if solved is None:
        return None
    largest = NextState.largest_of(solved.z, facts, list(switch.rows))
    return NextState(facts, switch.mode, largest, None, None)


def _holds_soon_after(
    switch: KnownSwitch, before: ActiveRows, cause: int, facts: LawValues, rates: tuple[Floats, Floats]
) -> Solved | None:
    """Return the forces soon after, where those of the mode before, which hold now, clearly exceed their limit."""
    for part in (0.0, *SOON):
        soon = part * facts.scale.time
        later = facts.laws.at(facts.t + soon, facts.q + soon * rates[0], facts.u + soon * rates[1], facts.scale)
        ended = _holds(switch, later, before, cause)
        if ended is None:
            return None
        # By how much the force at the row exceeds its limit, in the sense in which it gave way.
        size, over = float(np.linalg.norm(later.exerted[cause])), -float(ended.z[cause])
        for one in before.sticks:
            if one.tangent == cause:
                sense = next(slide.sense for slide in switch.after.slides if slide.tangent == cause)
                limit = float(most(later.known["coefficients"][one.part][0], ended.z[one.normal]))
                over = -sense * float(ended.z[cause]) - limit
                break
        over *= size
        if over > CLEAR_BY * ended.force:
            return _holds(switch, later, switch.after) if soon else None
        if over > WITHIN * CLEAR_BY * ended.force:
            return None
    return None


def _holds(switch: KnownSwitch, facts: LawValues, acting: ActiveRows, free: int | None = None) -> Solved | None:
    """Return the forces of what acts where its laws hold clearly, with static coefficients and then as it slides.

    What they say of the row `free` may be open.
    """
    if any(_sign(facts, part) != sign for part, sign in switch.signs):
        return None
    mu = facts.known["coefficients"]
    parts = [one.part for one in (*acting.slides, *acting.sticks)]
    if not all(float(mu[part, 0]) > 0.0 and float(mu[part, 1]) > 0.0 for part in parts):
        return None
    differ = any(one.begins and float(mu[one.part, 0]) != float(mu[one.part, 1]) for one in acting.slides)
    solved = None
    for static in (True, False) if differ else (False,):
        solved = _solve_forces(switch, facts, acting, static=static)
        if solved is None or not _hold_clearly(solved, facts, acting, free):
            return None
    return solved


def _solve_forces(switch: KnownSwitch, facts: LawValues, acting: ActiveRows, *, static: bool) -> Solved | None:
    """Return the forces of what acts; None where rows are nearly dependent."""
    known = facts.known
    A, C, right, active = facts.by_mass.whole, facts.exerted.whole, known["right"], list(acting.active)
    lengths, sizes = _lengths(A), _lengths(C)
    pushes = C[active].copy()
    for one in acting.slides:
        mu = known["coefficients"][one.part, 0 if static and one.begins else 1]
        pushes[active.index(one.normal)] -= one.sense * mu * C[one.tangent]
    z = np.zeros(len(right))
    if active:
        matrix = A[active] / lengths[active][:, None] @ (pushes / sizes[active][:, None]).T
        wanted = (right[active] / lengths[active]).tolist()
        forces, _, (rank, left, _) = solve_lists(matrix.tolist(), wanted, len(active), math.inf)
        if rank < len(active) or not left > DETERMINED:
            return None
        z[active] = np.array(forces) / sizes[active]
    for one in acting.slides:
        z[one.tangent] = -one.sense * known["coefficients"][one.part, 0 if static and one.begins else 1] * z[one.normal]
    x = pushes.T @ z[active]
    rows = list(switch.rows)
    terms = (np.abs(A) @ np.abs(x) + np.abs(right)) / lengths
    largest = float(np.linalg.norm(x)) + float(np.abs(right / lengths)[rows].max(initial=0.0))
    force = float(np.abs(z * sizes).max(initial=0.0)) + CLEAR_MOTION / CLEAR_BY * largest
    return Solved(z, (A @ x - right) / lengths, force, terms + CLEAR_MOTION / CLEAR_BY * largest)


def _lengths(rows: Floats) -> Floats:
    lengths = np.asarray(np.sqrt((rows * rows).sum(axis=1)), dtype=float)
    lengths[lengths == 0.0] = 1.0
    return lengths


def _hold_clearly(solved: Solved, facts: LawValues, acting: ActiveRows, free: int | None) -> bool:
    """Return whether all inequalities of what acts hold clearly but for those of the row `free`."""
    z, a, mu, sizes = solved.z, solved.a, facts.known["coefficients"], _lengths(facts.exerted.whole)
    forces = [(k, z[k] * sizes[k]) for k in acting.pressing]
    for stick in acting.sticks:
        left = room(mu[stick.part, 0], z[stick.normal], [z[stick.tangent]])
        forces.append((stick.tangent, sizes[stick.tangent] * left))
    ways = [(k, a[k]) for k in acting.apart]
    ways += [(slide.tangent, slide.sense * a[slide.tangent]) for slide in acting.slides if slide.begins]
    pressed = all(force > CLEAR_BY * solved.force for k, force in forces if k != free)
    return bool(pressed and all(way > CLEAR_BY * solved.terms[k] for k, way in ways if k != free))


# ----------------------------------------------------------------------------------------------------------------------
# What the runs of a prepared system remember: where switches led, in modes that the loop in C may follow as well.


_ROWS: Final = 48

_MOST_SWITCHES: Final = 4 * MOST_KEPT
"""Switches that runs remember."""
_MOST_ENTRIES: Final = 100_000
"""Elements of all rows, zeros too, up to which C follows switches: it looks at all of them."""


class SwitchMemory:
    """Where switching functions of modes led, and the modes that C can follow, each by the first leg in it.

    Whether a run goes that way is decided by the laws alone, so that it does not matter which run remembered it, nor
    what is forgotten: the switches that were decided longest ago; of modes C knows the first `MOST_KEPT`. Switches that
    come sooner than `least` (s) after another one are not for C.
    """

    def __init__(self, laws: Laws, template: Problem, least: float) -> None:
        self.laws = laws
        self.least = least
        self.legs: list[ModeLeg] = []
        self._led: dict[tuple[Key, int], tuple[KnownSwitch, ...]] = {}
        self._numbers: dict[Key, int] = {}
        self._modes: list[CourseMode] = []
        pairs, mechanism = template.pairing, laws.mechanism
        smooth = template.step is None and not isinstance(template.method, LibraryMethod)
        rates = not pairs.balls and len(pairs.plain) == len(mechanism.coordinates)
        self._plain = all(plain(x) for x in mechanism.one_way)
        follows = laws.compiled.backend == "c" and smooth and rates and self._plain
        few = len(laws.places) * len(mechanism.speeds) <= _MOST_ENTRIES
        # A declared stop may end a run where a mode ends without impact: by its state, or by forces, which jump.
        stops = bool(mechanism.state_stops or leaves(mechanism.stops.values(), "quantity"))
        self.follows = follows and few and not stops

    def known(self, leg: ModeLeg, index: int) -> tuple[KnownSwitch, ...]:
        """Return where a switching function of a leg's mode has led."""
        return self._led.get((leg.program.key, index), ())

    def learn(self, found: NextState, leg: ModeLeg, index: int) -> None:
        """Remember where a switch led: for forces at a limit all ways, for others the last one."""
        cause = leg.switching(index)
        switch = known_switch(found, leg.mode, cause) if self._plain else None
        others = self.known(leg, index) if cause.limits else ()
        others = tuple(x for x in others if switch is None or x.mode != switch.mode)
        led = (*others, *(() if switch is None else (switch,)))
        keep(self._led, (leg.program.key, index), led, _MOST_SWITCHES)

    # --- the loop in C ------------------------------------------------------------------------------------------------

    def course(self, passed: Callable[[Passage], None]) -> Course | None:
        """Return the course of a run, None where C cannot follow it; `passed` gets each turn that C takes."""
        laws, elements = self.laws, self.laws.mechanism.one_way
        if not self.follows:
            return None
        normals = tuple(laws.places[x.normals[0].name] for x in elements)
        angles = tuple(int(x.name in laws.turning) for x in elements)
        about = (laws.parameters, normals, angles, laws.slides, 1.0, self.least, passed)
        return Course(laws.compiled, laws.matrices, *about, modes=self._modes)

    def entered(self, leg: ModeLeg, course: Course | None, time: float, scale: Scale) -> Course | None:
        """Return the course of a run as a leg begins; None where C cannot follow it in its mode."""
        program, problem = leg.program, leg.of
        rows = program.entered.rows
        kept = problem.project or not rows
        if course is None or not kept or len(rows) > _ROWS or problem.independent < len(rows):
            return None
        number = self._numbers.get(program.key, len(self.legs))
        if number == MOST_KEPT:
            return None
        if number == len(self.legs):
            self._numbers[program.key] = number
            rules = tuple(self._rule(one) for one in program.switchings)
            closed = tuple(int(x.name in program.active) for x in self.laws.mechanism.one_way)
            turns: list[list[KnownTurn]] = [[] for _ in rules]
            self._modes.append(CourseMode(problem, rules, tuple(program.entered.held), closed, turns))
            self.legs.append(replace(leg, cause=None))
        course.mode, course.since = number, time
        course.length, course.speed = scale.length, scale.speed
        return course

    def tell_c(self, leg: ModeLeg, index: int) -> None:
        """Let C know where a switching function of a leg's mode leads, as far as it knows the modes."""
        if leg.program.key in self._numbers:
            known = [self._turn(switch) for switch in self.known(leg, index) if key_of(switch.mode) in self._numbers]
            self._modes[self._numbers[leg.program.key]].turns[index] = known

    def _rule(self, one: Switching | None) -> tuple[int, int]:
        if one is None or one.limits:
            return MarginKind.FORCE, -1
        if one.part is None:
            turns = one.element.name in self.laws.turning
            return (MarginKind.ANGLE if turns else MarginKind.LENGTH), -1
        return MarginKind.SPEED, self.laws.places[one.part.rows[0].name]

    def _turn(self, switch: KnownSwitch) -> KnownTurn:
        places, mechanism = self.laws.places, self.laws.mechanism
        touching = [x for x in mechanism.one_way if x.name in switch.touching]
        rows = (*mechanism.rows, *(x.normals[0] for x in touching))
        ways = [one.sense for one in switch.after.slides if one.tangent == switch.cause]
        return KnownTurn(
            to=self._numbers[key_of(switch.mode)],
            touching=tuple(int(x.name in switch.touching) for x in mechanism.one_way),
            kept=tuple(places[row.name] for row in rows),
            rows=switch.rows,
            signs=tuple((places[part.rows[0].name], sign) for part, sign in switch.signs),
            after=switch.after,
            before=switch.before or ActiveRows(),
            cause=-1 if switch.cause is None else switch.cause,
            way=ways[0] if ways else 0,
        )


# ----------------------------------------------------------------------------------------------------------------------
# What follows at the switches of a run: what is decided there, and what of the run before counts for it.


_PROMPT: Final = 1e-14
"""The part of the time up to which an impact is not too late."""

_FITS: Final = 4.0
"""The factor up to which the margin of a mode differs from that of points as fast as they are now."""


@dataclass(frozen=True, eq=False)
class Within:
    """How a mode goes on at a switch: the state `after` (nq + nu,), and the impact, if there was one, at `facts`.

    `moved`: it was put onto its face.
    """

    after: Floats
    moved: bool = False
    facts: LawValues | None = None
    cause: Cause | None = None


@dataclass
class Switches:
    """The decisions of a run by `laws`, which know the normals of points that have met, for a model of a `scale`.

    Of the run before count how fast it was, on which sides of `bars` no point is (`hidden`), what `bounces`, how often
    it stood still, and which mode mostly followed at a switching function.
    """

    laws: Laws
    scale: Scale
    bars: tuple[law_mechanism.ThinBar, ...]
    standstill: Standstill
    returns: Returns
    hidden: tuple[str, ...] = ()
    bounces: BounceMemory = field(default_factory=BounceMemory)
    _usual: dict[tuple[Key, int], Mode] = field(default_factory=dict)
    _last: tuple[tuple[float, int, bytes], NextState] | None = None

    @cached_property
    def tips(self) -> VertexContacts:
        """What is known of points that meet."""
        return VertexContacts.of(self.laws.mechanism)

    def at(self, t: float, x: Floats) -> LawValues:
        """Return the law values at a state (nq + nu,)."""
        nq = len(self.laws.mechanism.coordinates)
        return self.laws.at(t, x[:nq], x[nq:], self.scale)

    def first(self, t: float, x: Floats) -> NextState:
        """Return what is decided at the start. Raises ModelError where a point moves across a thin bar it touches."""
        facts = self.at(t, x)
        for bar in self.bars:
            bar.verify_leaving(facts)
        self.laws = self.tips.meeting(facts, ())
        facts = self.at(t, x)
        aside = self.tips.aside(facts, ())
        self.hidden = law_mechanism.hidden_sides(
            self.bars, facts, lambda known: next_state(facts, (), hidden=known, beyond=aside)
        )
        return self.tips.resting(next_state(facts, (), hidden=self.hidden, beyond=aside))

    def hindered(
        self, t: float, x: Floats, cause: Switching, changes: Callable[[], Sequence[Change]]
    ) -> Reason | None:
        """Return why nothing follows what has ended a mode, after some `changes`; None where it does."""
        if endless := self.standstill.lasts(t, len(self.laws.unilateral)):
            lately = takewhile(lambda each: each.time >= self.standstill.since, reversed(changes()))
            return Reason(f"{', '.join(sorted({cause.element.name, *(each.element for each in lately)}))}: {endless}")
        if cause.ends != "closes" or is_tip(cause.element) or not law_mechanism.is_behind(self.at(t, x), cause.element):
            return None
        name = cause.element.name
        for bar in self.bars:
            sides = [side.name for side in bar.sides]
            if name in sides:  # the point has come in from behind: it is on the other side from now on
                self.hidden = (*(x for x in self.hidden if x not in sides), name)
                return None
        return Reason(f"{name}: {law_mechanism.why_behind(cause.element)}")

    # --- what follows -------------------------------------------------------------------------------------------------

    def next_state(self, now: ModeLeg, t: float, x: Floats, index: int) -> NextState:
        """Return how a leg goes on from a state at which a switching function of it has crossed.

        An impact that ends the mode is asked for twice: whether the mode goes on behind it, and what follows.
        """
        asked = (t, index, x.tobytes())
        if self._last is not None and self._last[0] == asked:
            return self._last[1]
        cause = now.switching(index)
        guess = None if cause.limits else self._usual.get((now.program.key, index))
        facts, closed = self.closed_at(now, t, x, cause)
        beyond = [cause.element.name, *self._leaving(now, facts)] if cause.ends == "leaves" else []
        beyond += facts.taken_over(cause.element, now.active) if cause.ends == "closes" else []
        beyond += self.tips.aside(facts, now.active)
        before = Before(now.mode, now.udot_at(facts), now.of.rates, guess, self.bounces)
        found = self.tips.resting(next_state(facts, closed, before, beyond=beyond, hidden=self.hidden))
        self._last = asked, found
        return found

    def learn(self, now: ModeLeg, index: int, found: NextState) -> None:
        """Remember which mode followed: the next search begins with it."""
        if found.mode is not None:
            self._usual[now.program.key, index] = found.mode

    def beyond(self, now: ModeLeg, facts: LawValues, blow: ImpactOutcome | None = None) -> NextState:
        """Return what follows at an instant to which the mode does not lead, behind an impact if one is known."""
        before = Before(now.mode, now.udot_at(facts), None, None, self.bounces)
        aside = self.tips.aside(facts, now.active)
        return self.tips.resting(next_state(facts, now.active, before, beyond=aside, hidden=self.hidden, blow=blow))

    def soon_beyond(self, now: ModeLeg, limit: LawValues) -> NextState | None:
        """Return what follows just beyond the limit of a mode; None where that is a state like others, or not known.

        Friction with what presses either way may have two states on one side of where that turns, and none beyond.
        """
        found = self.beyond(now, self._later(now, limit, SOON[0]))
        proved = found.mode is None and found.found is not None and found.found.proved
        return found if found.blow is not None or proved else None

    def slid_out(self, now: ModeLeg, facts: LawValues) -> NextState | None:
        """Return what follows where all that touches rests, as its slip ends at once; None where it does not."""
        u = impact.slid_out(facts, now.active, now.udot_at(facts))
        found = None if u is None else self.beyond(now, impact.at_state(facts, u=u))
        return None if found is None or found.mode is None else found

    def tipped(self, now: ModeLeg, facts: LawValues) -> NextState | None:
        """Return what follows where forces that are not unique have no room left, so that something opens or slips."""
        if now.mode.shares is None:
            return None
        for part in SOON:
            found = self.beyond(now, self._later(now, facts, part))
            if found.mode is not None and not found.mode.alike(now.mode):
                return found if found.blow is not None else replace(found, facts=facts)
        return None

    def _leaving(self, now: ModeLeg, facts: LawValues) -> list[str]:
        """Return what gets past an edge at one instant: two corners of a box do side by side."""
        soon = self._later(now, facts, SOON[0])
        at_edge = (x for x in self.laws.unilateral if x.name in now.active and facts.reach(x) <= facts.allowed_gap(x))
        return [x.name for x in at_edge if soon.reach(x) < -soon.rounded_gap(x)]

    @staticmethod
    def _later(now: ModeLeg, facts: LawValues, part: float) -> LawValues:
        """Return what holds a part of the model's time later, as the mode has it."""
        soon, x = part * facts.scale.time, np.concatenate([facts.q, facts.u])
        q, u = np.split(runge_kutta_step(now.of.rates, facts.t, x, soon), [len(facts.q)])
        return facts.laws.at(facts.t + soon, q, u, facts.scale)

    def within(self, now: ModeLeg, t: float, x: Floats, index: int) -> Within | None:
        """Return how the mode goes on where it might end; None where it does end."""
        cause = now.switching(index)
        if cause.ends == "lies flat":
            return None if self.at(t, x).lying([cause.element]) else Within(x)
        if cause.ends != "closes" or self.standstill.lasts(t, len(self.laws.unilateral)):
            return None
        facts = self.seen(now, t, x)
        aside = self.tips.aside(facts, now.active)
        element = self.tips.striking(facts, cause.element, (*aside, *self.hidden))
        if element is None:
            return Within(x)
        if is_tip(element) and not self._fits(now, facts, element):
            return None
        if law_mechanism.is_behind(facts, element):
            return None
        leaving = self.bounces.leaving(facts, element)
        if leaving is not None:
            return Within(np.concatenate([leaving, facts.u]), moved=leaving is not facts.q)
        facts = self._touched(now, facts, element)
        blow = lone_bounce(facts, element, (*aside, *self.hidden))
        late, collapsed = dict[str, float](), frozenset[str]()
        udot = now.udot_at(facts) if ceases(facts, element) else facts.u  # nobody asks how what never rests falls
        before = Before(now.mode, udot, now.of.rates, None, self.bounces)
        if blow is not None and not before.late(facts, [element]):
            u = facts.u + blow.jump
        else:
            found = self.next_state(now, t, x, index)
            blow, facts, u, late, collapsed = found.blow, found.facts, found.facts.u, {**found.late}, found.collapsed
            if blow is None or found.mode is None or not found.mode.alike(now.mode) or found.several:
                return None
        after = np.concatenate([facts.q, u])
        if facts.t != t:
            after = runge_kutta_step(now.of.rates, facts.t, after, t - facts.t)
        return Within(after, facts=facts, cause=Cause(blow.t, blow, late, collapsed))

    @staticmethod
    def _fits(now: ModeLeg, facts: LawValues, element: LawElement) -> bool:
        """Return whether the margin of a mode is that of two points as fast as they meet now."""
        pairs = zip(now.program.switchings, now.problem.margins, strict=True)
        margins = {one.element.name: -margin for one, margin in pairs if one is not None and one.ends == "closes"}
        own = rounded_meeting(facts, element)
        return own / _FITS < margins.get(element.name, 0.0) < _FITS * own

    # --- what counts for what follows ---------------------------------------------------------------------------------

    def enter(self, leg: ModeLeg) -> ModeLeg:
        """Note a leg that begins, and return it."""
        self.forget()
        self.bounces.rhythm.mode(leg.start, leg.program.key)
        self.bounces.rested([name for name, side in leg.mode.sides.items() if side])
        return leg

    def forget(self) -> None:
        """Forget the latest decision, as forces have jumped."""
        self._last = None

    def hit(self, blow: ImpactOutcome, facts: LawValues) -> None:
        """Note an impact, and what holds after it."""
        taking = frozenset(name for name, impulse in blow.impulses.items() if impulse)
        self.bounces.hit(Hit(blow.t, taking, np.concatenate([blow.q, blow.u]), blow.gives_back))
        self.tips.struck(facts)

    # --- what holds at a switch ---------------------------------------------------------------------------------------

    def grown(self, u: Floats) -> None:
        """Note the speeds (nu,) that a run has come to."""
        slides = self.laws.slides
        fastest = np.abs(u) * (slides + (1.0 - slides) * self.scale.length)
        self.scale = replace(self.scale, speed=max(self.scale.speed, float(fastest.max(initial=0.0))))

    def seen(self, now: ModeLeg, t: float, x: Floats) -> LawValues:
        """Return the law values at a state, with the normals of points that meet there."""
        facts = self.at(t, x)
        self.laws = self.tips.meeting(facts, now.active)
        return facts if self.laws is facts.laws else self.at(t, x)

    def closed_at(self, now: ModeLeg, t: float, x: Floats, cause: Switching) -> tuple[LawValues, list[str]]:
        """Return what laws ask where a switching function of the mode has crossed, and the elements that are closed."""
        x = x if now.of.project else put_back(now.of, t, x)
        self.grown(x[len(now.of.q0) :])
        apart = {*now.mode.idle, *([cause.element.name] if cause.ends == "leaves" else [])}
        closed = [name for name in now.active if name not in apart]  # what is idle may have opened: its gap tells
        facts = self.seen(now, t, x)
        touches = cause.ends == "closes" and not is_tip(cause.element)
        touches = touches and not law_mechanism.is_behind(facts, cause.element)
        touches = touches or (cause.ends == "closes" and self.tips.strikes(facts, cause.element, now.active))
        closed += [cause.element.name] if touches else []
        return self._touched(now, facts, cause.element) if touches else facts, closed

    def _touched(self, now: ModeLeg, facts: LawValues, element: LawElement) -> LawValues:
        """Return what held when an element touched that strikes: a step ends where it is in by what rounding may make.

        That is late by a large part of a short flight; its parabola tells when it touched, after the last impact. Two
        points have not met yet by as much, and touch later.
        """
        gap, rate = facts.gap(element), facts.rate(element)
        most = facts.allowed_gap(element) if is_tip(element) else 0.0
        strikes = rate < -facts.allowed_speed(element.normals[0])  # a rope beside one that is taut has no flight
        if not (-2.0 * facts.rounded_gap(element) < gap < most and strikes):
            return facts
        room = max(rate * rate + 2.0 * gap * facts.falling(element, now.udot_at(facts)), 0.0)  # a face it grazes: none
        ago = -2.0 * gap / (math.sqrt(room) - rate)
        since = max(self.bounces.rhythm.last, now.start)
        if not (_PROMPT * abs(facts.t) < abs(ago) and ago < facts.t - since):
            return facts
        before = runge_kutta_step(now.of.rates, facts.t, np.concatenate([facts.q, facts.u]), -ago)
        q, u = np.split(before, [len(facts.q)])
        return facts.laws.at(facts.t - ago, q, u, facts.scale)


_AT_ONCE: Final = 1e-3
"""The part of a mean step within which a return to a mode is no motion."""
_UNSEEN: Final = 100.0
"""The multiple of a run's absolute tolerance below which a speed is rounding of its steps."""
_UNSEEN_MOST: Final = 1e-8
"""The largest such speed (m/s): a tenth of that up to which slip keeps the direction in which it starts."""


@dataclass(eq=False)
class PreparedRuns:
    """What the runs of one prepared system share, by `laws`: their first decision, modes, and where switches led.

    `template` is the problem of all, `scale` tells how large and fast the model is where they begin; `bars` have no
    thickness. Rows are put back after each step if the template's are, or `stabilised` by Baumgarte's alpha, beta
    (1/s).
    """

    laws: Laws
    modes: ModePrograms
    template: Problem
    scale: Scale
    stabilised: tuple[float, float] | None
    bars: tuple[law_mechanism.ThinBar, ...] = ()

    @property
    def soon(self) -> float:
        """The time (s) within which a return to a mode is no motion."""
        return _AT_ONCE * self.template.run_end / 200.0

    @cached_property
    def memory(self) -> SwitchMemory:
        """What runs have decided."""
        return SwitchMemory(self.laws, self.template, self.soon)

    def switches(self) -> Switches:
        """Return the decisions of a run that has not begun."""
        unseen = min(_UNSEEN * self.template.atol, _UNSEEN_MOST)
        scale = replace(self.scale, unseen=unseen, steps=0.0 if self.template.step else self.template.rtol)
        if isinstance(self.template.method, LibraryMethod):
            scale = replace(scale, rtol=self.template.rtol, atol=self.template.atol)
        standstill = Standstill(self.template.lasts)
        return Switches(self.laws, scale, self.bars, standstill, Returns(self.soon))

    @cached_property
    def first(self) -> tuple[ModeLeg, LawValues, tuple[str, ...]]:
        """The leg with which runs begin, what holds there, and the sides of bars on which no points are.

        Raises NoSolutionError where there is no mode, ModelError where a point moves across a thin bar that it touches.
        """
        switches = self.switches()
        found = switches.first(self.template.start, self.template.x0)
        if found.mode is None:
            raise NoSolutionError(f"{found.why_none.text} at the start")
        problem, program = self.modes.problem(found, None)
        first = ModeLeg(problem, program=program, mode=found.mode, cause=Cause.of(found, found.facts.t))
        return first, found.facts, switches.hidden
