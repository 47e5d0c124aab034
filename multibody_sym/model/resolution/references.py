"""References: what the names of bodies, points, frames, surfaces and joints stand for in a resolved system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.joints import CurveJoint, PointJoint
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import COM, GROUND, ORIGIN, OWN_POINTS, Pose, centre_moves, mass_of, pose_of
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.model.mechanism.parameters import ParameterVector
from multibody_sym.model.mechanism.rope_path import Bend
from multibody_sym.model.mechanism.rows import Drive, ExpressionRow, Row, VelocityRow
from multibody_sym.model.mechanism.start_constants import Measure
from multibody_sym.model.resolution.spanning_tree import body_part, rate_pairs, speed_names
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import ZERO, Node, symbol
from multibody_sym.scalars.vectors import apply

BARE: Final = Body()


def moving_centre(body: str) -> ModelError:
    """Return the error for what would be fixed to a centre of mass that moves in its body."""
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


def no_own_part(name: str, part: str, bodies: Mapping[str, Body], *, chosen: bool) -> ModelError:
    """Return the error for a point or frame that a body does not have, where it stands by itself beside the body.

    `chosen`: the body stands under `on`, where another one may stand too.
    """
    own, (other, _, last) = bodies.get(name, BARE), part.rpartition(".")
    if other in bodies and last in (*bodies[other].points, *bodies[other].frames):
        cure = f"write on: {other}, at: {last}" if chosen else f"name one of {name}"
        told = f"{name!r} has no point or frame {part!r}, which is one of {other}: {cure}"
        return ModelError(told, number="M106", word=part)
    plain, known = part.removeprefix(f"{name}."), [*own.points, *own.frames]
    declare = "" if known else f"; declare it: {name}: {{points: {{{plain}: [x, y, z]}}}}"
    return ModelError(f"{name!r} has no point or frame {plain!r}{declare}", number="M106", word=plain, known=known)


@dataclass(frozen=True)
class Freedom:
    """A freedom of a joint: its coordinate (None: a ball has none for it) and its rate, which is linear in u."""

    joint: str
    coordinate: Node | None
    rate: Node


@dataclass(frozen=True)
class StartConstant:
    """A constant that is measured at the start: the slot that stands for it, and what is measured."""

    slot: Node
    measure: Measure


@dataclass(frozen=True)
class References:
    """A system whose expressions are written in slots, the numbers of its bodies, the joints `carrying` them, the
    numbers of the doubles that cut joints carry, and the `parameters` that rows may take.

    In the `plane` rows that restrict what never leaves it are left out. What is `measured` of joints without
    coordinates of their own still stands as symbols, so that one sees on which joint something acts. `constants` of
    the start stand by the constraints that have them; from then on the `bodies` of the tree and
    the `pulleys` are known.
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
    pulleys: Mapping[str, Bend] = field(default_factory=dict)

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

        `chosen` as for `no_own_part`.
        """
        bodies = self.system.bodies
        body, plain = bodies.get(name, BARE), part.removeprefix(f"{name}.")
        own = (*body.points, *body.frames, *OWN_POINTS)
        if (name in bodies or name == GROUND) and part not in own and plain not in own:
            raise no_own_part(name, part, bodies, chosen=chosen)
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
        """Return frame F on a joint's parent and M on what it carries: its child, or the child's massless double."""
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
        """Return the coordinate of a joint with one freedom."""
        (freedom,) = self._one_freedom(joint).values()
        assert freedom.coordinate is not None
        return freedom.coordinate

    def freedom(self, joint: str, name: str | None) -> Freedom:
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

    def _one_freedom(self, joint: str) -> dict[str, Freedom]:
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
            if placed and on_ground and self.numbers[particle] == body and self._is_point(particle):
                raise ModelError(
                    f"{particle!r} is a particle, which joint {name!r} never turns, so a couple does nothing to it; "
                    "leave it out, or give the body an inertia and a joint that lets it turn, such as planar",
                    number="M110",
                )

    def _is_point(self, body: str) -> bool:
        declared = self.system.bodies[body]
        return declared.inertia is None and declared.shape is None

    def freedoms(self, joint: str) -> dict[str, Freedom]:
        """Return the freedoms of a joint by the names of their speeds."""
        self.verify_joint(joint)
        speeds = speed_names(joint, self.system.joints[joint])
        found = {u: Freedom(joint, None, self._named(u)) for u in speeds}
        for q, u in rate_pairs(joint, self.system.joints[joint]):
            found[u] = Freedom(joint, self._named(q), self._named(u))
        return found

    def _named(self, name: str) -> Node:
        """Return the slot of a name, or its symbol where it is yet to be measured."""
        return self.slots.get(symbol(name), symbol(name))

    def drives(self, joint: str, rows: Sequence[Row]) -> tuple[Drive, ...]:
        """Return what rows with expressions exert on the freedoms of a joint that is cut, as far as these are named."""
        found = []
        for freedom in self.freedoms(joint).values():
            for k, row in enumerate(rows):
                named = freedom.coordinate if isinstance(row, ExpressionRow) else freedom.rate
                if named is not None and isinstance(row, (ExpressionRow, VelocityRow)):
                    factor = derivative(row.zero, named)
                    found += [Drive(k, freedom.rate, factor)] if factor is not ZERO else []
        return tuple(found)
