"""An impact of a mechanism in numbers: the problem that its rows pose, and the mechanism at rest that has its impulses.

In: a mechanism, its state before, and the elements that touch. `pose` makes the problem of `strike`; `struck_rows`
takes from its result the rows that act, and the jump of each. With these `mechanics.impacts.impact_mechanism` is a
mechanism like any other, whose accelerations, multipliers and reactions are jumps and impulses.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Final, Protocol

import numpy as np

from multibody_sym.contact_laws.impact_problem import ImpactLaw, ImpactProblem, ImpactResult, Order
from multibody_sym.contact_laws.problem import FrictionLaw, LawProblem
from multibody_sym.contact_laws.routh_method import AT_REST
from multibody_sym.dynamics.contact.contact_problem import element_laws, friction_law, weighted_rows
from multibody_sym.dynamics.formalisms.articulated_body import tree_dynamics_of
from multibody_sym.dynamics.formalisms.equations import TreeDynamics
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.impacts import impact_mechanism, jumping_motions, state_in_impact, with_meetings
from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, Mode, StruckImpacts
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import mode_of_words, rows_in_mode
from multibody_sym.mechanics.motion import Motion, State, motion_of
from multibody_sym.mechanics.row_kinematics import RowMotion, coefficients, row_motions
from multibody_sym.mechanics.row_records import Row, Sliding, SlidingRow
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import where
from multibody_sym.scalars.functions import absolute, minimum, sign, sqrt
from multibody_sym.scalars.node import ZERO, Node, as_node, less
from multibody_sym.scalars.rank import ROUNDING
from multibody_sym.scalars.vectors import S

_ALIKE: Final = 1e-12
"""Impulses of several phases have one direction if their lengths add up to that of their sum but for this part."""
_AT_REST: Final = 1e-9
"""The part of the largest speed below which a part does not slide."""
_NOTHING: Final = 1e-13
"""The part of the largest impulse below which one is rounding."""


def friction_parts(element: LawElement) -> tuple[FrictionPart, ...]:
    """Return the friction parts of an element that rub at all."""
    return tuple(part for part in element.frictions if part.rubs)


@dataclass(frozen=True, eq=False)
class Blow:
    """The setup of an impact: a mechanism (its own rows, in no mode), its `state` before, the `elements` that touch.

    `loads`, `begins` and `jumps` are those of `impact`.
    """

    mechanism: Mechanism
    state: State
    impact: StruckImpacts
    elements: tuple[LawElement, ...]

    @property
    def jumping(self) -> tuple[str, ...]:
        """The mechanism's own rows that jump."""
        begun = (name for names in self.impact.begins.values() for name in names)
        return (*begun, *(jump.row for jump in self.impact.jumps if jump.row))

    @property
    def drives(self) -> dict[str, Node]:
        """The joints whose prescribed rates jump, and by how much."""
        return {jump.joint: jump.by for jump in self.impact.jumps if jump.joint}

    @cached_property
    def rough(self) -> tuple[LawElement, ...]:
        """The joints with friction, which the impulses in them press."""
        return tuple(x for x in self.mechanism.one_way if not x.unilateral and friction_parts(x))

    @property
    def striking(self) -> tuple[Row, ...]:
        """All rows of the elements and of rough joints: of each its normals, then those along which it rubs."""
        every = (*self.elements, *self.rough)
        return tuple(r for x in every for r in (*x.normals, *(r for p in friction_parts(x) for r in p.rows)))

    def before(self, state: State) -> Motion:
        """Return the motion before over the scalar of a state, with all rows that may act."""
        every = replace(self.mechanism, rows=(*self.mechanism.rows, *self.striking))
        motion = motion_of(jumping_motions(every, self.drives), state)
        return replace(motion, state=with_meetings(motion, self.elements))

    def resting(self, striking: Sequence[Row], given: Collection[str] = ()) -> Mechanism:
        """Return the mechanism of the impact in which some rows strike, and the impulses of some are `given`."""
        return impact_mechanism(
            self.mechanism,
            striking,
            self.impact.loads,
            jumping=self.jumping,
            drives=self.drives,
            elements=self.impact.meetings,
            given=given,
        )

    def bare(self, row: Row) -> Mechanism:
        """Return the mechanism at rest in which one row alone strikes."""
        return impact_mechanism(self.mechanism, [row], elements=self.impact.meetings)

    @cached_property
    def motion(self) -> Motion:
        return self.before(self.state)

    @cached_property
    def rows(self) -> list[RowMotion]:
        return row_motions(self.motion)

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(row.name for row in self.motion.mechanism.rows)

    @cached_property
    def places(self) -> dict[str, int]:
        """The number of each row."""
        return {name: k for k, name in enumerate(self.names)}

    @cached_property
    def parts(self) -> dict[str, int]:
        """The number of each friction part."""
        every = (part for x in (*self.elements, *self.rough) for part in friction_parts(x))
        return {part.name: k for k, part in enumerate(every)}

    @cached_property
    def dynamics(self) -> TreeDynamics:
        """The dynamics of the mechanism at rest with all rows, none of which jumps."""
        none = dict.fromkeys(range(len(self.names)), 0.0)
        return tree_dynamics_of(self.resting(self.striking), state_in_impact(self.motion.state, none))

    @cached_property
    def wanted(self) -> Floats:
        """The jump (m) of the speed of each own row; zero for rows that strike."""
        found = np.zeros(len(self.names))
        begun = {name for names in self.impact.begins.values() for name in names}
        by = {jump.row: jump.by for jump in self.impact.jumps if jump.row}
        for k, name in enumerate(self.names[: len(self.mechanism.rows)]):
            if name in begun:
                found[k] = -float(self.rows[k].phidot)
            elif name in by:
                found[k] = float(self.state.values([by[name]])[0])
        return found


def pose(blow: Blow, law: ImpactLaw, order: Order, coefficients_of: Mapping[str, tuple[float, float]]) -> ImpactProblem:
    """Return the problem of an impact; `coefficients_of` gives each element's restitution, normal and tangential."""
    dynamics = blow.dynamics
    A, C, D, right = weighted_rows(dynamics, dynamics.rows, range(len(dynamics.rows)))
    own = len(blow.mechanism.rows)
    before = np.array([0.0 if k < own else float(row.phidot) for k, row in enumerate(blow.rows)])
    before[:own] -= blow.wanted[:own]
    pushed, right = -right, right - before
    e, tangential = np.zeros(len(blow.names)), list[float]()
    places, elements = blow.places, (*blow.elements, *blow.rough)
    for element in elements:
        given_back = 0.0
        if element.unilateral:
            e[places[element.normals[0].name]], given_back = coefficients_of[element.name]
        tangential += [given_back if k == 0 else 0.0 for k in range(len(friction_parts(element)))]

    def friction(element: LawElement, part: FrictionPart, places: Mapping[str, int]) -> FrictionLaw:
        static, kinetic = map(float, coefficients(blow.motion, part.rows, [part.static, part.kinetic]))
        return friction_law(element, part, places, (static, kinetic))

    rows = LawProblem(A, C, D, right, *element_laws(((x, friction_parts(x)) for x in elements), places, friction))
    return ImpactProblem(rows, e, tuple(tangential), law, order, names=blow.names, pushed=pushed)


def plane_element(blow: Blow) -> LawElement | None:
    """Return the contact of an impact that has friction along one tangent, and is the only element; else None."""
    if len(blow.elements) != 1 or blow.rough:
        return None
    (element,) = blow.elements
    parts = friction_parts(element)
    alone = len(parts) == 1 and len(parts[0].rows) == 1 and parts[0].normals == (0,)
    if not alone or (parts[0].enough and element.tangential_restitution is not ZERO):
        return None
    return element


@dataclass(frozen=True, eq=False)
class StruckRows:
    """The rows that act in an impact, of the mechanism at rest, and the jump of each (by number).

    `acting` are the elements that strike, `rough` the joints with friction, `joints` their rows, the last of all. The
    `mode` has the slip of each friction part that slides one way throughout (0: it does not, and has impulses of its
    own along its rows), and the side from which joints press. Where friction changes during the impact the impulses of
    rows are `given`, among the jumps.
    """

    mechanism: Mechanism
    jumps: Mapping[int, float]
    acting: tuple[LawElement, ...]
    mode: Mode
    rough: tuple[LawElement, ...] = ()
    joints: tuple[Row, ...] = ()
    given: frozenset[str] = frozenset()


def struck_rows(blow: Blow, struck: ImpactResult) -> StruckRows:
    """Return the mechanism of an impact in the mode in which it was found."""
    places = blow.places
    acting = tuple(x for x in blow.elements if places[x.normals[0].name] in struck.closed)
    largest = float(np.abs(struck.impulses).max(initial=0.0))
    slips = {
        part.name: _constant(set(struck.course(blow.parts[part.name]))) for x in acting for part in friction_parts(x)
    }

    def sticks(part: FrictionPart) -> bool:
        return any(abs(struck.impulses[places[row.name]]) > _NOTHING * largest for row in part.rows)

    rows = [row for element in acting for row in _rows_of(element, slips, sticks)]
    mode, rough = _rough_mode(blow, struck, _NOTHING * largest)
    joints = tuple(r for x in rough for r in rows_in_mode(x, mode, blow.mechanism.parameters))
    slips |= mode.slips
    given = _with_own_impulses(blow, struck, slips)
    if plane_element(blow) in acting:
        back = any(phase.stage == "given back" for phase in struck.phases)
        if struck.impacts == 1 and (back or len(struck.course(0)) > 1):  # friction changes during the impact
            rows, given = list(blow.striking), frozenset(row.name for row in blow.striking)
    mechanism = blow.resting([*rows, *joints], given)
    jumps = {}
    for k, name in enumerate(row.name for row in mechanism.rows):
        place = places[name]
        if name in given:
            jumps[k] = float(struck.impulses[place])
        elif place < len(blow.mechanism.rows):
            jumps[k] = float(blow.wanted[place])
        else:
            jumps[k] = float(struck.after[place] - float(blow.rows[place].phidot))
    return StruckRows(mechanism, jumps, acting, replace(mode, slips=slips), rough, joints, given)


def _rows_of(element: LawElement, slips: Mapping[str, int], sticks: Callable[[FrictionPart], bool]) -> list[Row]:
    """Return the rows of an element that strikes: friction along a tangent rubs, what `sticks` has rows."""
    frictions: list[Sliding] = []
    along: list[Row] = []
    for part in friction_parts(element):
        if rubs_one_way(part) and slips.get(part.name):
            frictions.append(Sliding(part.rows, part.kinetic, slips[part.name]))
        elif sticks(part):
            along += part.rows
    normal, *others = element.normals
    return [SlidingRow(normal.name, normal, tuple(frictions)) if frictions else normal, *others, *along]


def rubs_one_way(part: FrictionPart) -> bool:
    """Return whether a part rubs along one tangent, pressed by the first normal of its element."""
    return len(part.rows) == 1 and part.normals == (0,)


def rows_in_words(blow: Blow, words: Mapping[str, str]) -> StruckRows:
    """Return the mechanism of an impact in a mode in words: open is not struck, friction slides one way or sticks.

    Raises InputError for unknown names and words, ModelError where a mode in words does not determine impulses.
    """
    mode = mode_of_words(blow.elements, words)
    acting = tuple(x for x in blow.elements if mode.acts(x))
    wide = [part.name for x in acting for part in friction_parts(x) if mode.slip(part) and not rubs_one_way(part)]
    wide += [x.name for x in blow.rough]
    if wide:
        raise ModelError(
            f'the impulse of friction in {wide[0]} has no one direction in words; say mode="found"', number="M110"
        )
    rows = [row for x in acting for row in _rows_of(x, mode.slips, lambda part: not mode.slip(part))]
    return StruckRows(blow.resting(rows), {}, acting, mode)


def _with_own_impulses(blow: Blow, struck: ImpactResult, slips: Mapping[str, int]) -> frozenset[str]:
    """Return the rows of parts that slide in the end, but not one way throughout, or in space."""
    places = blow.places
    speeds = [k for k, row in enumerate(blow.rows) if row.kinematic]
    small = _AT_REST * float(np.abs(np.concatenate([struck.before[speeds], struck.after[speeds]])).max(initial=0.0))
    found = set[str]()
    for part in (p for x in (*blow.elements, *blow.rough) for p in friction_parts(x) if not slips.get(p.name)):
        rows = [places[row.name] for row in part.rows]
        if float(np.linalg.norm(struck.after[rows])) > small and struck.impulses[rows].any():
            found |= {row.name for row in part.rows}
    return frozenset(found)


def _rough_mode(blow: Blow, struck: ImpactResult, small: float) -> tuple[Mode, tuple[LawElement, ...]]:
    """Return the mode of friction in joints, and the elements whose friction has more than a `small` impulse.

    A part that does not slide one way throughout, pressed from one side, sticks in the mode: it has its own impulse.
    """
    places = blow.places
    sides: dict[str, int] = {}
    slips: dict[str, int] = {}
    rough: list[LawElement] = []
    for element in blow.rough:
        own = [places[row.name] for part in friction_parts(element) for row in part.rows]
        if not (np.abs(struck.impulses[own]) > small).any():
            continue
        rough.append(element)
        for row in element.normals:
            pressed = float(struck.impulses[places[row.name]])
            sides[row.name] = -1 if pressed < 0.0 else 1
        sides[element.name] = sides[element.normals[0].name]
        for part in friction_parts(element):
            rows = [places[r.name] for r in element.normals_of(part)], [places[r.name] for r in part.rows]
            slips[part.name] = _joint_slip(struck, blow.parts[part.name], *rows)
    return Mode(sides, slips), tuple(rough)


def _joint_slip(struck: ImpactResult, part: int, normals: list[int], rows: list[int]) -> int:
    """Return the slip of a part with one row in all phases with friction, if reactions keep their direction; else 0."""
    if len(rows) > 1:
        return 0
    phases = [phase for phase in struck.phases if phase.impulses[rows].any()]
    pressed = np.array([phase.impulses[normals] for phase in phases]).reshape(len(phases), -1)
    total = pressed.sum(axis=0)
    sizes = np.linalg.norm(pressed, axis=1)
    alike = abs(float(sizes.sum()) - float(np.linalg.norm(total))) <= _ALIKE * float(sizes.sum())
    return _constant({phase.slips[part] for phase in phases}) if alike else 0


def _constant(course: set[int]) -> int:
    """Return the one slip of a course, 0 where there is none."""
    return next(iter(course)) if course in ({1}, {-1}) else 0


# ----------------------------------------------------------------------------------------------------------------------
# One contact in the plane through its impact, over any scalar: Routh's course written out.
#
# While it slips v_n and v_t change in proportion to p_n: v' = (K_nn - mu s K_nt, K_nt - mu s K_tt), s being the sign
# of v_t. Slip stops after p_1 = |v_t|/(-s v_t'), if it ever does, and then sticks (v_t' = 0), or is reversed. So an
# impact has two straight stretches at most, and ends on one of them, by each law of restitution. `Choose` takes the
# stretch: floats one, Programs both, closed forms the one that numbers have taken before.


Pair = tuple[S, S]
Way = Callable[[], Pair]


class Choose(Protocol):
    """Takes the first of two ways where a condition is positive; `broken` are words for where it fails.

    A condition that is rounding beside `near` counts as positive.
    """

    def __call__(self, condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair: ...


@dataclass
class Deciding:
    """The way that numbers take, and a record of it."""

    taken: list[bool] = field(default_factory=list)

    def __call__(self, condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair:
        self.taken.append(bool(condition > -ROUNDING * near))
        return first() if self.taken[-1] else second()


@dataclass
class Following:
    """The way that numbers have taken before, and its conditions: (expression > 0, words for where it fails)."""

    taken: list[bool]
    conditions: list[tuple[S, str]] = field(default_factory=list)

    def __call__(self, condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair:
        is_first = self.taken[len(self.conditions)]
        self.conditions.append((condition if is_first else -condition, broken[0 if is_first else 1]))
        return first() if is_first else second()


def both_ways(condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair:
    """Return both ways as one expression over Nodes."""
    holds, a, b = less(ZERO, as_node(condition + ROUNDING * near)), first(), second()
    return where(holds, as_node(a[0]), as_node(b[0])), where(holds, as_node(a[1]), as_node(b[1]))


@dataclass(frozen=True)
class PlaneContact:
    """A contact: its mobility (K_nn, K_nt, K_tt), its speeds (v_n, v_t) before, v_n < 0, and its laws.

    With `enough` friction it never slips. `e` is restitution by `law`, `returned` the tangential one. In numbers slip
    that is `slow` beside the normal speed is none, and a tangent that no impulse moves (`stiff` beside K_nn) sticks.
    """

    K: tuple[S, S, S]
    v: Pair
    static: S
    kinetic: S
    e: S
    returned: S | None = None
    enough: bool = False
    law: ImpactLaw = "newton"
    slow: float = 0
    stiff: float = 0

    @property
    def held(self) -> S:
        """The change of p_t with p_n that keeps v_t."""
        knn, knt, ktt = self.K
        return -knt * ktt / (ktt * ktt + self.stiff**2 * knn * knn) if self.stiff else -knt / ktt

    def slipping(self, s: int) -> S:
        """Return the change of p_t with p_n while it slips with sign s."""
        return limits.sliding(self.kinetic, [s])[0]

    def rate(self, along: S) -> S:
        """Return the change of v_n with p_n while p_t changes by `along` with it."""
        return self.K[0] + along * self.K[1]


def plane_contact(
    blow: Blow,
    element: LawElement,
    law: ImpactLaw,
    motions: tuple[Motion, Motion],
    solve: Callable[[Mechanism, State], Sequence[S]],
    *,
    in_numbers: bool = True,
) -> PlaneContact:
    """Return the contact for motions (before, and just before it strikes); `solve` finds the jumps of a mechanism."""
    before, pushed = motions
    (part,) = friction_parts(element)
    rows, own = (element.normals[0], part.rows[0]), len(blow.mechanism.rows)
    names = [row.name for row in rows]
    resting_ = impact_mechanism(blow.mechanism, rows, elements=blow.impact.meetings, given=names)
    found = {row.name: moved for row, moved in zip(pushed.mechanism.rows, row_motions(pushed), strict=True)}
    columns = []
    for unit in ((1, 0), (0, 1)):
        jumps: dict[int, S] = dict.fromkeys(range(own), 0) | dict(enumerate(unit, own))
        du = solve(resting_, state_in_impact(before.state, jumps))
        columns.append([sum((h * x for h, x in zip(found[name].jacobian, du, strict=True)), 0) for name in names])
    state = before.state
    static, kinetic = coefficients(before, part.rows, [part.static, part.kinetic])
    e, returned = state.values([element.restitution, element.tangential_restitution])
    v = found[names[0]].phidot, found[names[1]].phidot
    K = columns[0][0], columns[1][0], columns[1][1]
    given_back = None if element.tangential_restitution is ZERO else returned
    rounding = (AT_REST, ROUNDING) if in_numbers else (0.0, 0.0)
    return PlaneContact(K, v, static, kinetic, e, given_back, part.enough, law, *rounding)


def plane_course(contact: PlaneContact, choose: Choose) -> Pair:
    """Return the normal impulse and the one along the tangent."""
    if contact.enough:
        return _never_slipping(contact, choose)
    (vn, vt), (_, knt, ktt) = contact.v, contact.K

    def slipping(s: int) -> Pair:
        slows = -s * (contact.slipping(s) * ktt + knt)
        return choose(
            slows,
            lambda: _Stopping(contact, s, slows, choose).impulses(),
            lambda: _straight(contact, s),
            broken=("slip grows on the way", "slip becomes slower on the way"),
        )

    def back() -> Pair:
        return choose(contact.slow * vn - vt, lambda: slipping(-1), at_rest_, broken=("it slips the other way", ""))

    def at_rest_() -> Pair:
        return _Stopping(contact, 1, 1, choose).beyond(contact.K[0], 0)

    return choose(vt + contact.slow * vn, lambda: slipping(1), back, broken=("it slips the other way", ""))


def _straight(contact: PlaneContact, s: int) -> Pair:
    """Return the impulses of slip that never stops; all laws are one there."""
    along = contact.slipping(s)
    p = -(1 + contact.e) * contact.v[0] / contact.rate(along)
    return p, along * p


def _never_slipping(contact: PlaneContact, choose: Choose) -> Pair:
    """Return the impulses where slip stops at once, which may push along the normal, too."""
    (vn, vt), (_, knt, ktt) = contact.v, contact.K
    stop = -vt / ktt
    left, rate = vn + knt * stop, contact.rate(contact.held)
    p = (-contact.e * vn - left) / rate if contact.law == "newton" else -(1 + contact.e) * left / rate
    none: S = 0
    return choose(
        -left, lambda: (p, stop + contact.held * p), lambda: (none, stop), broken=("it parts at once", "it is pressed")
    )


@dataclass(frozen=True)
class _Stopping:
    """Slip of sign s that becomes slower, v_t' = -s slows."""

    contact: PlaneContact
    s: int
    slows: S
    choose: Choose

    def impulses(self) -> Pair:
        contact = self.contact
        rate = contact.rate(contact.slipping(self.s))
        stop = self.s * contact.v[1] / self.slows
        return self.choose(
            self._lasts(rate, stop),
            lambda: _straight(contact, self.s),
            lambda: self.beyond(rate, stop),
            broken=("slip stops on the way", "slip lasts all the while"),
        )

    def _lasts(self, rate: S, stop: S) -> S:
        """Return a value that is positive where the impact ends before slip stops."""
        contact, vn = self.contact, self.contact.v[0]
        if contact.law == "poisson":
            return stop * rate + (1 + contact.e) * vn
        return vn + rate * stop + contact.e * vn  # by the speed, or the square root of the work: they are one here

    def beyond(self, rate: S, stop: S) -> Pair:
        """Return the impulses where slip has stopped at p_n = stop: then the contact sticks, or slips back."""
        contact, (knn, knt, ktt) = self.contact, self.contact.K

        def ended(along: S) -> Pair:
            return self._ended(rate, stop, contact.rate(along), along)

        def back(s: int) -> Pair:
            return ended(contact.slipping(s))

        return self.choose(
            limits.room(contact.static, ktt, [knt]),
            lambda: self._stuck(*ended(contact.held), stop),
            lambda: self.choose(
                knt, lambda: back(1), lambda: back(-1), broken=("it slips back the other way",) * 2
            ),
            broken=("it slips back", "it sticks"),
            near=knn,
        )

    def _ended(self, rate: S, stop: S, then: S, along: S) -> Pair:
        """Return the impulses at the end, when v_n changes with `then` and p_t with `along` once slip has stopped."""
        contact, (vn, _) = self.contact, self.contact.v
        e, reached = contact.e, vn + rate * stop
        friction = contact.slipping(self.s) * stop
        if contact.law == "newton":
            more = (-e * vn - reached) / then
            return stop + more, friction + along * more

        def early() -> Pair:
            """Slip stops while things part again."""
            if contact.law == "poisson":
                more = -(1 + e) * vn / rate - stop
            else:
                more = (sqrt(reached * reached + then * (e * e * vn * vn - reached * reached) / rate) - reached) / then
            return stop + more, friction + along * more

        def late() -> Pair:
            """Slip stops while they still press each other."""
            pressed = -reached / then
            if contact.law == "poisson":
                more = (1 + e) * (stop + pressed) - stop
            else:
                work = -vn * stop - rate * stop * stop / 2 + reached * reached / (2 * then)
                more = pressed + e * sqrt(2 * work / then)
            return stop + more, friction + along * more

        return self.choose(
            reached, early, late, broken=("slip stops before things part", "slip stops when things part again")
        )

    def _stuck(self, p: S, along: S, stop: S) -> Pair:
        """Return the impulses with tangential restitution: a part of friction's own, up to the cone and to its work."""
        contact = self.contact
        if contact.returned is None:
            return p, along
        returned: S = contact.returned
        size = absolute(along)
        room = limits.room(contact.static, p, [along])
        most = sqrt(limits.most(contact.kinetic, stop) * absolute(contact.v[1]) / contact.K[2])

        def limited(back: S) -> Pair:
            return p, along + sign(along) * back

        def in_the_cone() -> Pair:
            return self.choose(
                most - wanted,
                lambda: (p, along + returned * along),
                lambda: limited(most),
                broken=("friction has taken less than it is to give back", "friction has taken more"),
                near=size,
            )

        wanted = returned * size
        return self.choose(
            room - wanted,
            in_the_cone,
            lambda: limited(minimum(room, most)),
            broken=("the cone lets less be given back", "the cone lets all be given back"),
            near=size,
        )
