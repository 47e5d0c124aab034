"""What do the names of bodies, points, frames and joints stand for in a system, and does it stay in a plane?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, singledispatch
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.mechanism import Measure, ParameterVector, TreeBody
from multibody_sym.mechanics.row_records import AngleRow, Drive, Marker, RopeBend, Row
from multibody_sym.mechanics.spanning_tree import body_part, rate_pairs, speed_names
from multibody_sym.model.bodies import (
    COM,
    GROUND,
    ORIGIN,
    OWN_POINTS,
    Body,
    Pose,
    centre_moves,
    mass_of,
    pose_of,
    unit_vector,
)
from multibody_sym.model.constraints import PointInPlane, PointOnLine
from multibody_sym.model.fields import Element, Point, holds_vectors
from multibody_sym.model.forces import Distributed, Force, Potential, Torque
from multibody_sym.model.joints import CurveJoint, PointJoint
from multibody_sym.model.steps import is_flat, is_upright
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.node import ONE, ZERO, Node, symbol
from multibody_sym.scalars.vectors import apply, cross

BARE: Final = Body()


def moving_centre(body: str) -> ModelError:
    """Return the error for something fixed to a centre of mass that moves in its body."""
    return ModelError(
        f"the centre of mass of {body} moves in it as its mass varies, and nothing is fixed there: name a point of the "
        "body (a force without at: acts at the centre of mass)"
    )


def no_part(name: str, part: str, body: Body) -> ModelError:
    """Return the error for a point or frame that a body does not have."""
    known = [f"{name}.{each}" for each in (*body.points, *body.frames)]
    declare = "" if known else f"; declare it: {name}: {{points: {{{part}: [x, y, z]}}}}"
    told = f"{name!r} has no point or frame {part!r}{declare}"
    return ModelError(told, number="M106", word=f"{name}.{part}", known=known)


@dataclass(frozen=True)
class JointFreedom:
    """A freedom of a joint: its coordinate (None: a ball has none for it) and its rate, which is linear in u."""

    joint: str
    coordinate: Node | None
    rate: Node


@dataclass(frozen=True)
class StartConstant:
    """A constant that is measured at the start: the slot that stands for it, and its measure."""

    slot: Node
    measure: Measure


@dataclass(frozen=True)
class References:
    """A system whose expressions are written in slots, the numbers of its bodies, the joints `carrying` them, the
    numbers of the doubles that cut joints carry, and the `parameters` that rows may take.

    In the `plane` rows that restrict motion out of it are left out. `measured` coordinates of joints without their own
    stay symbols, which show on which joint something acts. `constants` of the start stand by the constraints that have
    them; from then on the `bodies` of the tree and the `pulleys` are known.
    """

    system: System
    numbers: Mapping[str, int]
    slots: Mapping[Node, Node]
    parameters: ParameterVector = ParameterVector(())
    plane: bool = False
    measured: Mapping[Node, Node] = field(default_factory=dict)
    carrying: frozenset[str] = frozenset()
    doubles: Mapping[str, int] = field(default_factory=dict)
    constants: Mapping[str, StartConstant] = field(default_factory=dict)
    bodies: tuple[TreeBody, ...] = ()
    pulleys: Mapping[str, RopeBend] = field(default_factory=dict)

    @cached_property
    def flat(self) -> bool:
        """Whether nothing leaves the xy-plane."""
        return self.plane or in_plane(self.system)

    def marker(self, reference: str) -> Marker:
        """Return the marker of a body's origin, or of a point or frame of it, `body.point`.

        Every body has the points `origin` and `com`, its centre of mass, unless it declares others of these names.
        """
        name, part = body_part(reference, self.system.bodies)
        body = self.system.bodies.get(name, BARE)
        if part in body.frames:
            return Marker(reference, self.numbers[name], pose_of(body.frames[part]))
        if part in OWN_POINTS and part not in body.points:
            if part == COM and centre_moves(body, self.system.parameters):
                raise moving_centre(name)
            return Marker(reference, self.numbers[name], Pose(mass_of(body).com if part == COM else ORIGIN))
        if part and part not in body.points:
            raise no_part(name, part, body)
        return Marker(reference, self.numbers[name], Pose(body.points[part] if part else ORIGIN))

    def own_marker(self, name: str, part: str, *, chosen: bool = True) -> Marker:
        """Return the marker of a body's point or frame, which stands beside the body: `point`, or `body.point`.

        `chosen`: the body stands under `on`, where another one may stand too.
        """
        bodies = self.system.bodies
        body, plain = bodies.get(name, BARE), part.removeprefix(f"{name}.")
        own = (*body.points, *body.frames, *OWN_POINTS)
        if (name in bodies or name == GROUND) and part not in own and plain not in own:
            other, _, last = part.rpartition(".")
            if other in bodies and last in (*bodies[other].points, *bodies[other].frames):
                cure = f"write on: {other}, at: {last}" if chosen else f"name one of {name}"
                message = f"{name!r} has no point or frame {part!r}, which is one of {other}: {cure}"
                raise ModelError(message, number="M106", word=part)
            known = [*body.points, *body.frames]
            declare = "" if known else f"; declare it: {name}: {{points: {{{plain}: [x, y, z]}}}}"
            message = f"{name!r} has no point or frame {plain!r}{declare}"
            raise ModelError(message, number="M106", word=plain, known=known)
        return self.marker(f"{name}.{part if part in own else plain}")

    def markers(self) -> dict[str, Marker]:
        """Return every named point and frame."""
        made = {}
        for name, body in {GROUND: BARE, **self.system.bodies}.items():
            for reference in (name, *(f"{name}.{p}" for p in (*body.points, *body.frames))):
                made[reference] = self.marker(reference)
        return made

    def frames(self, name: str) -> tuple[Marker, Marker]:
        """Return frame F on a joint's parent and M on its child."""
        joint = self.system.joints[name]
        with at("joints", name, "parent"):
            on_parent = self.marker(joint.parent)
        with at("joints", name, "child"):
            return on_parent, self.marker(joint.child)

    def carried_frames(self, name: str) -> tuple[Marker, Marker]:
        """Return frame F on a joint's parent and M on the child that it carries, or the child's massless double."""
        on_parent, on_child = self.frames(name)
        return on_parent, replace(on_child, body=self.doubles.get(name, on_child.body))

    def pair(self, references: tuple[str, ...]) -> tuple[Marker, Marker]:
        """Return the markers of both ends of something."""
        ends = []
        for i, reference in enumerate(references):
            with at("between", i):
                ends.append(self.marker(reference))
        return ends[0], ends[1]

    def along(self, frame: str, components: Point) -> tuple[int, Point]:
        """Return the body that carries the axes meant, of a body or of a point or frame of it, and a vector in its own.

        `components` are those along the axes meant.
        """
        with at("frame"):
            marker = self.marker(frame)
        x, y, z = apply(marker.pose.rotation, components)
        return marker.body, (x, y, z)

    def coordinate(self, joint: str) -> Node:
        (freedom,) = self._one_freedom(joint).values()
        assert freedom.coordinate is not None
        return freedom.coordinate

    def freedom(self, joint: str, name: str | None) -> JointFreedom:
        """Return a joint's freedom; without a name, its only one."""
        with at("joint"):
            known = self.freedoms(joint) if name is not None else self._one_freedom(joint)
        if name is None:
            return next(iter(known.values()))
        by_coordinate = {q: known[u] for q, u in rate_pairs(joint, self.system.joints[joint])}
        named = {**known, **by_coordinate}
        if name not in named:
            with at("freedom"):
                raise ModelError(f"joint {joint!r} has no freedom {name!r}", number="M106", word=name, known=named)
        return named[name]

    def _one_freedom(self, joint: str) -> dict[str, JointFreedom]:
        found = self.freedoms(joint)
        if len(found) != 1:
            raise ModelError(f"joint {joint!r} has {len(found)} degrees of freedom; one is needed here")
        return found

    def verify_joint(self, joint: str) -> None:
        """Raise ModelError where no joint has this name."""
        if joint not in self.system.joints:
            raise ModelError(f"no joint is called {joint!r}", number="M106", word=joint, known=self.system.joints)

    def verify_turns(self, body: int) -> None:
        """Raise ModelError where a couple would act on a particle, to which a joint on ground gives no attitude."""
        for name, joint in self.system.joints.items():
            placed = isinstance(joint, PointJoint) or (isinstance(joint, CurveJoint) and joint.turns is None)
            particle = body_part(joint.child, self.system.bodies)[0]
            on_ground = body_part(joint.parent, self.system.bodies)[0] == GROUND
            if not (placed and on_ground and self.numbers[particle] == body):
                continue
            declared = self.system.bodies[particle]
            if declared.inertia is None and declared.shape is None:
                raise ModelError(
                    f"{particle!r} is a particle, which joint {name!r} never turns, so a couple does nothing to it; "
                    "leave it out, or give the body an inertia and a joint that lets it turn, such as planar",
                    number="M110",
                )

    def freedoms(self, joint: str) -> dict[str, JointFreedom]:
        """Return the freedoms of a joint by the names of their speeds."""
        self.verify_joint(joint)
        speeds = speed_names(joint, self.system.joints[joint])
        found = {u: JointFreedom(joint, None, self._slot_or_symbol(u)) for u in speeds}
        for q, u in rate_pairs(joint, self.system.joints[joint]):
            found[u] = JointFreedom(joint, self._slot_or_symbol(q), self._slot_or_symbol(u))
        return found

    def _slot_or_symbol(self, name: str) -> Node:
        """Return the slot of a name, or its symbol where it is yet to be measured."""
        return self.slots.get(symbol(name), symbol(name))

    def drives(self, joint: str, rows: Sequence[Row]) -> tuple[Drive, ...]:
        """Return the drives by which rows of expressions act on the freedoms of a cut joint that they name."""
        found = []
        for freedom in self.freedoms(joint).values():
            for k, row in enumerate(rows):
                named = freedom.coordinate if row.is_holonomic else freedom.rate
                if named is not None and row.expression is not None:
                    factor = derivative(row.expression, named)
                    found += [Drive(k, freedom.rate, factor)] if factor is not ZERO else []
        return tuple(found)


# ----------------------------------------------------------------------------------------------------------------------
# The two directions across the normal of a plane in which friction and rolling have components.

_PARALLEL: Final = 1e-9
_X: Final[Point] = (ONE, ZERO, ZERO)


def surface_tangents(normal: Point, *, flat: bool) -> tuple[Point, Point]:
    """Return unit vectors t1 and t2 = normal x t1 across a unit `normal`, all in the axes of the plane's body.

    In a model that stays in the xy-plane (`flat`) t1 = normal x z: along a floor it is x, on a ramp it leads uphill. In
    space t1 is x as far as it lies in the plane, or y where the normal is x. Both vary continuously with the normal and
    do not depend on how it is written. In space these are the tangents of planes whose body's axes are ground's.
    """
    t1 = (normal[1], -normal[0], ZERO) if flat else _axis_on_plane(normal)
    return t1, cross(normal, t1)


def across(normal: Point) -> Point:
    """Return a unit vector across a unit normal: x as far as it lies in the plane, wherever this has a simple form.

    Of a normal without a component along an axis it has one whatever the parameters are.
    """
    x, y, z = normal
    if x is ZERO:
        return _X
    if y is ZERO:
        return (z, ZERO, -x)
    if z is ZERO:
        return (y, -x, ZERO)
    return _axis_on_plane(normal)


def _axis_on_plane(normal: Point) -> Point:
    """Return normal x (x x normal) / |..|, or the same with y: a coordinate axis on the plane."""
    if all(c.shadow is not None and abs(c.shadow) < _PARALLEL for c in normal[1:]):
        return unit_vector(cross(normal, cross((ZERO, ONE, ZERO), normal)))
    return unit_vector(cross(normal, cross(_X, normal)))


# ----------------------------------------------------------------------------------------------------------------------
# Systems that everything declared keeps in the xy-plane: their absolute coordinates are x, y and an angle.


def in_plane(system: System) -> bool:
    """Return whether a system stays in the plane z = 0: all that is declared lies in it, or turns about its normal."""
    if not all(step.stays_in_plane for joint in system.joints.values() for step in joint.steps):
        return False
    vectors = [system.gravity, *(v for body in system.bodies.values() for v in _vectors(body))]
    axes = [axis for body in system.bodies.values() for axis in _axes(body)]
    axes += [pulley.axis for pulley in system.pulleys.values()]
    vectors += [contact.tangent for contact in system.contacts.values() if contact.tangent is not None]
    for element in (*system.forces.values(), *system.constraints.values()):
        lying, upright = _vectors_and_axes(element)
        vectors += lying
        axes += upright
    return all(map(is_flat, vectors)) and all(map(is_upright, axes))


def moves_in_plane(system: System) -> bool:
    """Return whether nothing moves out of the plane z = 0 of its joints, whatever acts on it across that."""
    if not all(step.stays_in_plane for joint in system.joints.values() for step in joint.steps):
        return False
    bodies = system.bodies.values()
    motions = [(b.motion.x, b.motion.y, b.motion.z) for b in bodies if b.motion is not None]
    return all(map(is_flat, motions)) and all(is_upright(axis) for body in bodies for axis in _axes(body))


@singledispatch
def _vectors_and_axes(element: Element) -> tuple[Sequence[Point], Sequence[Point]]:
    """Return the vectors in the plane and those normal to it where a force or constraint keeps bodies there."""
    if not isinstance(element, Element) or holds_vectors(type(element)):
        raise TypeError(f"nothing says which vectors of {type(element).__name__} lie in the plane")
    return (), ()


@_vectors_and_axes.register
def _(element: Force) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.value,), ()


@_vectors_and_axes.register
def _(element: Distributed) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.value,), ()


@_vectors_and_axes.register
def _(element: Torque) -> tuple[Sequence[Point], Sequence[Point]]:
    return (), () if element.on_body is None else (element.on_body,)


@_vectors_and_axes.register
def _(element: Potential) -> tuple[Sequence[Point], Sequence[Point]]:
    """Return the slope along the normal, which pushes out of the plane."""
    return ((ZERO, ZERO, derivative(element.value, symbol("z"))),) if element.on is not None else (), ()


@_vectors_and_axes.register
def _(element: PointOnLine) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.line.direction,), ()


@_vectors_and_axes.register
def _(element: PointInPlane) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.plane.normal,), ()


def _vectors(body: Body) -> Iterator[Point]:
    """Yield the vectors of a body that lie in the plane where it stays there, (0, 0, product of inertia) among them."""
    mass = mass_of(body)
    yield mass.com
    yield from ((0 * mass.mass, 0 * mass.mass, product) for product in mass.inertia[4:])
    yield from body.points.values()
    yield from (frame.position for frame in body.frames.values())
    for surface in body.surfaces.values():
        yield surface.centre
        if surface.plane is not None:
            yield from (surface.plane, surface.normal)
        yield from body.ends((*(surface.between or ()), *(surface.segment or ())))
        if surface.point is not None:
            yield surface.point
        if surface.revolution is not None:
            yield surface.axis
    if body.motion is not None:
        yield body.motion.x, body.motion.y, body.motion.z


def _axes(body: Body) -> Iterator[Point]:
    """Yield the axes of a body that are normal to the plane where it stays there."""
    turns = [turn for frame in body.frames.values() for turn in frame.rotate]
    turns += body.motion.turn if body.motion is not None else ()
    yield from (turn.axis for turn in turns)
    yield from (surface.axis for surface in body.surfaces.values() if surface.disc is not None)


def rows_in_plane(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that restrict motion in the plane; others restrict motion that never happens.

    Rows of angles do not distinguish a body turned over, which in the plane is one turned by pi about the normal.
    """
    kept = [row for row in rows if row.acts_in_plane]
    return [replace(row, shared=row.directions[1]) if isinstance(row, AngleRow) else row for row in kept]
