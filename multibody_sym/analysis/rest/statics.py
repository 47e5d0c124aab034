"""The conditions of rest: forces in balance, each within its limits.

In: a mechanism, its declared position, values of a parameter. Out: the conditions in floats or over any scalar.

    f + C^T z = 0        gamma = D z  (rows that define forces)        limits: sums of multiples of z >= 0

z are the multipliers of all rows, of one-way elements too; limits are normal forces, tensions, and the reserves of
friction mu N -+ t. A limit with the size of a reaction is one for each of its signs (`PressingSides`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import product
from math import cos, pi, sin
from typing import Final

import numpy as np

from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.closing import normalize
from multibody_sym.dynamics.contact.contact_problem import Numbered, OneWayRows, Scale
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.start.initial_geometry import measured_rows, with_constants
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.errors import MultibodyError, NoSolutionError, Where
from multibody_sym.mechanics.contact_geometry import reach
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.law_elements import ElementKind, FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import every_row, taut_ropes
from multibody_sym.mechanics.motion import Motion, motion_of, slot_state, state_of
from multibody_sym.mechanics.points import direction, position
from multibody_sym.mechanics.ropes import wrap_angle
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.row_records import Marker, PlaneSurface, Row
from multibody_sym.model.bodies import Pose
from multibody_sym.program.runtime_constants import TOUCHING
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.limits import Kind, most
from multibody_sym.scalars.linear_inequalities import Conditions
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, negate, slot
from multibody_sym.scalars.sign_changes import switching_functions
from multibody_sym.scalars.vectors import S, dot, subtract

Direction = tuple[float, float]
_DIRECTIONS: Final[tuple[Direction, ...]] = tuple(
    (round(cos(2 * pi * k / 8), 15), round(sin(2 * pi * k / 8), 15)) for k in range(8)
)
"""Along which the circle of friction in space is first cut, and those of a reaction first tried."""
Cuts = Mapping[str, tuple[Direction, ...]]
"""By friction part in space, the directions in which its circle is cut."""
_AT_END: Final = 1e-2
"""The part of the allowed gap within which a point beyond the end of a face is at the end."""
_SAME: Final = 1e-12
_BEYOND: Final = 1e-14
"""The part of the model's size by which a centre of mass may seem to be beyond a plane."""
_ONE: Final = 1e-12


@dataclass(frozen=True)
class FrictionCurve:
    """The curved limit that cuts stand for: t . t <= coefficient^2 N . N, t and N being multipliers by number."""

    rubbing: tuple[int, ...]
    coefficient: Node
    pressing: tuple[int, ...]


@dataclass(frozen=True)
class RestLimit:
    """The sum of factors times multipliers (by number) that is >= 0 at rest.

    `part` is the friction part or the element, `group` the declared element that it belongs to, `of` its kind; `along`
    the direction in which a circle of friction is cut. The limit is a tangent of `curve`. `idle`: the multipliers that
    vanish with this normal force.
    """

    kind: Kind
    of: ElementKind
    group: str
    part: str
    terms: tuple[tuple[int, Node], ...]
    along: Direction | None = None
    curve: FrictionCurve | None = None
    idle: tuple[int, ...] = ()

    def turned_to(self, along: Direction) -> RestLimit:
        """Return the tangent of the same circle in another direction."""
        assert self.curve is not None
        normals = tuple(term for term in self.terms if term[0] not in self.curve.rubbing)
        tangents = zip(self.curve.rubbing, along, strict=True)
        return replace(self, along=along, terms=(*normals, *((k, as_node(-x)) for k, x in tangents if x)))


@dataclass(frozen=True)
class PressingSides:
    """Which side of joints presses: for each such reaction, by its first row, a sign or a direction."""

    sides: Mapping[int, int] = field(default_factory=dict)
    directions: Mapping[int, Direction] = field(default_factory=dict)


@dataclass(frozen=True)
class Balance:
    """Over a scalar: `equal` E (e x m), `right` r (e) and `limits` G (g x m) of E z = r, G z >= 0."""

    equal: list[list[S]]
    right: list[S]
    limits: list[list[S]]


@dataclass(frozen=True)
class Statics:
    """A mechanism with the rows of all its one-way elements, as if all touched and stuck, and where each row is.

    `cuts` are the first ones.
    """

    mechanism: Mechanism
    numbered: Numbered
    places: Mapping[int, int]
    cuts: Cuts = field(default_factory=dict)

    def place(self, row: Row) -> int:
        """Return the number of a row."""
        return self.places[id(row)]

    # --- limits -------------------------------------------------------------------------------------------------

    def limits(self, choice: PressingSides, cuts: Cuts | None = None) -> tuple[RestLimit, ...]:
        """Return all limits, with the sides that press of joints; `cuts` in place of the first ones."""
        found: list[RestLimit] = []
        for k, row in taut_ropes(self.mechanism):
            found.append(RestLimit("force", "rope", row.name, row.name, ((k, ONE),)))
        for element in self.mechanism.one_way:
            found += self._of_element(element, choice, cuts or self.cuts)
        return tuple(found)

    def _of_element(self, element: LawElement, choice: PressingSides, cuts: Cuts) -> Iterator[RestLimit]:
        group = element.group or element.name
        if element.unilateral:
            idle = tuple(self.place(row) for part in element.frictions for row in part.rows)
            terms = ((self.place(element.normals[0]), ONE),)
            yield RestLimit("force", element.kind, group, element.name, terms, idle=idle)
        for normal in () if element.unilateral else element.normals:
            place = self.place(normal)
            if place in choice.sides:
                yield RestLimit("side", element.kind, group, element.name, ((place, as_node(choice.sides[place])),))
        for part in element.frictions:
            if not part.enough:
                yield from self._of_friction(element, part, choice, cuts)

    def _of_friction(
        self, element: LawElement, part: FrictionPart, choice: PressingSides, cuts: Cuts
    ) -> Iterator[RestLimit]:
        """Yield mu N - d . t >= 0, d being both ways of a line or the directions in which a circle is cut."""
        rows = [self.place(row) for row in part.rows]
        pressing = tuple(map(self.place, element.normals_of(part)))
        factors = choice.directions.get(pressing[0]) or [choice.sides.get(place, 1) for place in pressing]
        normals = [(k, most(part.static, as_node(x))) for k, x in zip(pressing, factors, strict=False)]
        curved = len(rows) == 2 or (part.norm and len(pressing) > 1)
        curve = FrictionCurve(tuple(rows), part.static, pressing) if curved else None
        ways: Sequence[Direction] = ((1, 0), (-1, 0)) if len(rows) == 1 else cuts[part.name]
        for way in ways:
            against = tuple((k, negate(as_node(x))) for k, x in zip(rows, way, strict=False) if x)
            along = way if len(rows) == 2 else None
            group, terms = element.group or element.name, (*normals, *against)
            yield RestLimit("cone", element.kind, group, part.name, terms, along, curve)

    # --- choices ------------------------------------------------------------------------------------------------

    def choices(self) -> list[PressingSides]:
        """Return all choices of the sides that press, and some of their directions."""
        signs: list[int] = []
        circles: list[int] = []
        for element in self.mechanism.one_way:
            for part in () if element.unilateral else element.frictions:
                places = list(map(self.place, element.normals_of(part)))
                if part.norm and len(places) > 1:
                    circles.append(places[0])
                else:
                    signs += [place for place in places if place not in signs]
        ways = product(_DIRECTIONS, repeat=len(circles))
        chosen = product(product((1, -1), repeat=len(signs)), ways)
        return [
            PressingSides(dict(zip(signs, sides, strict=True)), dict(zip(circles, directions, strict=True)))
            for sides, directions in chosen
        ]

    # --- balance ------------------------------------------------------------------------------------------------

    def balance(self, motion: Motion, limits: Sequence[RestLimit], rows: Sequence[RowMotion]) -> Balance:
        """Return the conditions at a state at rest; `rows` are all rows there."""
        forces = applied_generalized_forces(motion, applied_forces(motion))
        needed = inverse_dynamics(motion, [0] * len(forces))
        equal = [[row.forces[k] for row in rows] for k in range(len(forces))]
        right = [c - q for q, c in zip(forces, needed, strict=True)]
        for row in rows:
            if not row.kinematic:
                equal.append([row.coupling.get(k, 0) for k in range(len(rows))])
                right.append(row.gamma)
        factors = iter(
            motion.state.values([factor for limit in limits for _, factor in limit.terms], self.wraps(motion))
        )
        cone = []
        for limit in limits:
            line: list[S] = [0] * len(rows)
            for (k, _), factor in zip(limit.terms, factors, strict=False):
                line[k] = line[k] + factor
            cone.append(line)
        return Balance(equal, right, cone)

    def wraps(self, motion: Motion) -> dict[Node, S]:
        """Return the angles over which ropes touch rough wheels, by their Nodes."""
        slips = [row.rope_slip for row in self.mechanism.rows if row.rope_slip is not None]
        return {row.wrap: wrap_angle(motion, row.rope, row.bend) for row in slips}


def statics(mechanism: Mechanism) -> Statics:
    """Return the conditions of rest of a mechanism, which is in no mode.

    Raises NoSolutionError where forces with three components rub or press.
    """
    for element in mechanism.one_way:
        for part in element.frictions:
            if len(part.rows) > 2 or (part.norm and len(part.normals) > 2):
                raise NoSolutionError(
                    f"ranges of rest are found for friction along lines and in planes; {part.name} rubs with, or is "
                    "pressed by, a vector in space: ask solve for one value of the parameter after the other",
                    where=Where(path=element.path),
                    number="N110",
                )
    rows = every_row(mechanism)
    cuts = {
        part.name: _DIRECTIONS
        for element in mechanism.one_way
        for part in element.frictions
        if len(part.rows) == 2 and not part.enough
    }
    whole = replace(mechanism, rows=rows)
    return Statics(whole, Numbered(mechanism), {id(row): k for k, row in enumerate(rows)}, cuts)


# --- contacts in a position: how near is touching, and on which side of planes bodies are ----------------------------


def size_of(motion: Motion) -> float:
    """Return the largest distance of a body's origin from ground's along an axis (m), 1 where there is none."""
    return max((float(np.abs(np.array(p, dtype=float)).max()) for _, p in motion.poses), default=0.0) or 1.0


def out_of_touch(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> frozenset[int] | None:
    """Return the rows of elements that do not touch; None where a body is inside what it may only touch."""
    standing = list(standings(statics, motion, rows))
    if any(how == "inside" for _, how in standing):
        return None
    return frozenset(statics.place(row) for element, how in standing if how == "open" for row in element.rows)


@dataclass(frozen=True, eq=False)
class _AtRest(OneWayRows):
    """The rows in a position at rest, where the ends of faces are taken more sharply."""

    def past_end(self, element: LawElement) -> float:
        return _AT_END * self.allowed_gap(element)


def standings(statics: Statics, motion: Motion, rows: Sequence[RowMotion]) -> Iterator[tuple[LawElement, str]]:
    """Yield the unilateral elements, each with its standing in a position at rest."""
    there = _AtRest(statics.numbered, Scale(size_of(motion), 0.0), motion, tuple(rows))
    yield from ((x, "open" if x.open else there.standing(x)) for x in statics.mechanism.one_way if x.unilateral)


def height(motion: Motion, com: Marker, plane: PlaneSurface) -> float:
    """Return how far a centre of mass is from a plane, along its normal (m)."""
    away = subtract(position(motion, com), position(motion, plane.place))
    return float(dot(direction(motion, plane.place, plane.normal), away))


# --- the declared position at values of a parameter, at rest, and the conditions of rest there in floats -------------


def start_at_rest(
    mechanism: Mechanism, values: Mapping[str, float] | None = None, *, project: bool = False
) -> Start:
    """Return the start of a mechanism, in which massless bodies are free to move as well: at rest no inertia resists.

    Raises NoSolutionError.
    """
    massless = massless_speeds(mechanism)
    try:
        return start(mechanism, values, project=project)
    except NoSolutionError:
        if not massless:
            raise
    bodies = []
    for body in mechanism.bodies:
        own = body.mass
        if not set(massless).isdisjoint(body.u):  # the start does not depend on how large these are
            inertia = own.inertia if any(x is not ZERO for x in own.inertia) else (ONE,) * 3 + (ZERO,) * 3
            own = replace(own, mass=ONE if own.mass is ZERO else own.mass, inertia=inertia)
        bodies.append(replace(body, mass=own))
    return start(replace(mechanism, bodies=tuple(bodies)), values, project=project)


@dataclass(frozen=True)
class Position:
    """A mechanism at rest in its declared position, for any values of some parameters by name.

    `formalism`: by whose equations forces balance; None projects them directly.
    """

    mechanism: Mechanism
    begin: Start
    formalism: str | None = None

    @cached_property
    def statics(self) -> Statics:
        """The conditions of rest, whatever the values are."""
        return statics(self.mechanism)

    @cached_property
    def value(self) -> dict[str, float]:
        """The values of all parameters as they are declared."""
        return dict(zip((entry.name for entry in self.mechanism.parameters), self.begin.parameters, strict=True))

    @cached_property
    def kinks(self) -> list[Node]:
        """Functions, over slots, at whose zeros loads bend or jump: those of parameters alone, too."""
        motion = motion_of(self.mechanism, slot_state(self.mechanism))
        return switching_functions(map(as_node, applied_generalized_forces(motion, applied_forces(motion))))

    @cached_property
    def _moving(self) -> dict[str, bool]:
        return {}

    def moves_with(self, name: str) -> bool:
        """Return whether the position is another one, or none, at another value of a parameter."""
        if name not in self._moving:
            value = self.value[name]
            try:
                found = start_at_rest(self.mechanism, {name: value * (1 + 2.0**-7) + 2.0**-9 * (value == 0.0)})
                self._moving[name] = not np.allclose(found.q, self.begin.q, rtol=_SAME, atol=_SAME)
            except (*UNDEFINED, MultibodyError):
                self._moving[name] = True
        return self._moving[name]

    def has_start(self, values: Mapping[str, float]) -> bool:
        """Return whether the model has a start at these values: no inertia is missing, constraints close."""
        try:
            start_at_rest(self.mechanism, values)
        except (*UNDEFINED, MultibodyError):
            return False
        return True

    def motion(self, values: dict[str, float], moves: bool) -> Motion | None:
        """Return the motion at rest for values of parameters, None where they allow no such position."""
        try:
            whole = self.statics.mechanism
            if moves and not self.is_declared:
                begin = start_at_rest(self.mechanism, values)
                q, parameters = begin.q, list(begin.parameters)
            else:
                declared = parameter_values(self.mechanism, values)
                q = self.declared(declared) if moves else self.begin.q
                parameters = with_constants(self.mechanism, declared, np.array(q, dtype=float))
            state = state_of(whole, float, 0.0, q, [0.0] * len(whole.speeds), parameters)
            return motion_of(whole, state)
        except (*UNDEFINED, MultibodyError):
            return None

    @cached_property
    def is_declared(self) -> bool:
        """Whether declarations alone say where bodies are: there is no constraint that a position could violate."""
        restricted = len(self.mechanism.rows) - len(measured_rows(self.mechanism))
        found = {c.name for c in self.mechanism.coordinates} & set(self.begin.assembled)
        return restricted == 0 and not found

    def declared(self, parameters: list[float]) -> tuple[float, ...]:
        """Return the coordinates as declared, with unit quaternions."""
        known = {slot("parameters", k): x for k, x in enumerate(parameters)}
        q = np.array(evaluate_float([c.initial for c in self.mechanism.coordinates], known), dtype=float)
        normalize(self.mechanism, q)
        return tuple(q.tolist())

    @cached_property
    def _known(self) -> dict[tuple[object, ...], tuple[Motion, list[RowMotion]] | None]:
        return {}

    def moved(self, values: dict[str, float], moves: bool) -> tuple[Motion, list[RowMotion]] | None:
        """Return the motion at rest for values of parameters and its rows, once computed; None where there is none."""
        key = moves, *sorted(values.items())
        if key not in self._known:
            motion = self.motion(values, moves)
            try:
                self._known[key] = None if motion is None else (motion, row_motions(motion))
            except UNDEFINED:
                self._known[key] = None
        return self._known[key]

    def rows(self, motion: Motion, found: list[RowMotion]) -> list[RowMotion] | None:
        """Return all rows, without force where elements do not touch; None where bodies would cross each other."""
        apart = out_of_touch(self.statics, motion, found)
        if apart is None or self.inside_out(motion) is not None:
            return None
        nothing = [0.0] * len(motion.state.u)
        return [replace(row, jacobian=nothing, exerts=nothing) if k in apart else row for k, row in enumerate(found)]

    def ways(self, values: dict[str, float], moves: bool) -> tuple[Floats, Floats] | None:
        """Return the gaps (m) of unilateral elements, and how far they are inside the ends of faces, for values."""
        moved, gaps = self.moved(values, moves), self.gaps(values, moves)
        if moved is None or gaps is None:
            return None
        try:
            return gaps, np.array([float(way) for row in self._normals for way in reach(row, moved[0])])
        except UNDEFINED:
            return None

    def gaps(self, values: dict[str, float], moves: bool) -> Floats | None:
        """Return the gaps (m) of unilateral elements for values; None where there are no rows."""
        moved = self.moved(values, moves)
        return None if moved is None else np.array([float(moved[1][self.statics.place(x)].gap) for x in self._normals])

    @cached_property
    def _normals(self) -> list[Row]:
        """The row along the normal of each unilateral element."""
        return [element.normals[0] for element in self.statics.mechanism.one_way if element.unilateral]

    @cached_property
    def sides(self) -> tuple[tuple[Marker, PlaneSurface], ...]:
        """Contacts with endless planes: the other body's centre of mass, outside as declared, and the plane."""
        motion = self.motion({}, moves=False)
        found = []
        for element in self.mechanism.one_way if motion is not None else ():
            for surfaces in (row.surfaces or () for row in element.normals):
                planes = [x.plane for x in surfaces if x.plane is not None and x.plane.ends is None]
                others = [x for x in surfaces if x.plane is None]
                if planes and others and others[0].place.body >= 0:
                    body = others[0].place.body
                    com = Marker(element.group or element.name, body, Pose(self.mechanism.bodies[body].mass.com))
                    found.append((com, planes[0]))
        return tuple(p for p in found if motion is not None and height(motion, *p) > TOUCHING * size_of(motion))

    def inside_out(self, motion: Motion) -> str | None:
        """Return the contact where a body's centre of mass is inside the plane that it is declared outside, if any."""
        inside = (com.name for com, flat in self.sides if height(motion, com, flat) < -_BEYOND * size_of(motion))
        return next(inside, None)

    def crossing(self, motion: Motion) -> str | None:
        """Return the declared contact, rope or stop at which bodies would cross each other, if any."""
        standing = standings(self.statics, motion, row_motions(motion))
        inside = next((x.group or x.name for x, how in standing if how == "inside"), None)
        return inside or self.inside_out(motion)

    def conditions(self, values: dict[str, float], limits: Sequence[RestLimit], moves: bool) -> Conditions | None:
        """Return the conditions of rest in floats for values of parameters; None where there is no such position."""
        moved = self.moved(values, moves)
        try:
            rows = None if moved is None else self.rows(*moved)
            if moved is None or rows is None:
                return None
            motion = moved[0]
            found = self.statics.balance(motion, limits, rows)
            right = found.right
            if self.formalism is not None:  # the forces of the formalism in place of those projected directly
                forcing = FORMALISMS[self.formalism](self.statics.mechanism, motion.state).forcing
                right = [*(-f for f in forcing), *right[len(forcing) :]]
        except UNDEFINED:
            return None
        count = len(rows)
        equal, cone = (np.array(x, dtype=float).reshape(len(x), count) for x in (found.equal, found.limits))
        forces: Floats = np.array(right, dtype=float)
        finite = all(np.isfinite(x).all() for x in (equal, cone, forces))
        return Conditions(equal, forces, cone) if finite else None


# --- ends of ranges in which rest is possible, and ranges put together -----------------------------------------------


@dataclass(frozen=True)
class RestEnd:
    """An end of a range: its value, infinite where there is none, and the conditions that contradict beyond it.

    `equal` are places of the equations of balance, `limits` limits, each with its share in the contradiction, with this
    `choice` of pressing sides. All are empty where the search, or the values that the parameter may have, end.
    `on_circles`: limits are friction's circles themselves, not tangents near them.
    """

    value: float
    equal: tuple[int, ...] = ()
    limits: tuple[RestLimit, ...] = ()
    choice: PressingSides = field(default_factory=PressingSides)
    shares: tuple[float, ...] = ()
    on_circles: bool = False


Range = tuple[RestEnd, RestEnd]


def unite_ranges(ranges: Sequence[Range]) -> list[Range]:
    """Return ranges that overlap or touch as one, ascending."""
    found: list[Range] = []
    for low, high in sorted(ranges, key=lambda each: each[0].value):
        if found and low.value <= found[-1][1].value + _ONE * abs(low.value):
            if high.value > found[-1][1].value:
                found[-1] = (found[-1][0], high)
        else:
            found.append((low, high))
    return found


def join_about_pi(ranges: Sequence[Range]) -> tuple[Sequence[Range], tuple[float, float]]:
    """Return ranges of an angle with the halves of the one about pi as one, and the turn that has all within."""
    if len(ranges) < 2:
        return ranges, (-pi, pi)
    (first, end), (begin, last) = ranges[0], ranges[-1]
    if first.value > -pi or last.value < pi or begin.value == last.value:
        return ranges, (-pi, pi)
    past = end.value + 2 * pi
    return [*ranges[1:-1], (begin, replace(end, value=past))], (past - 2 * pi, past)
