"""References: what the names of bodies, points, frames, surfaces and joints stand for in a resolved system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.model.bodies import GROUND, ORIGIN, Pose, pose_of
from multibody_sym.model.elements import Body, Surface
from multibody_sym.model.mechanism import Bend, Marker, TreeBody
from multibody_sym.model.slots import at, suggestion
from multibody_sym.model.system import System
from multibody_sym.model.tree import body_part
from multibody_sym.scalars.node import Node, slot

BARE: Final = Body()


@dataclass(frozen=True)
class References:
    """A system whose expressions are written in slots, the numbers of its bodies, and what is made of it in turn."""

    system: System
    numbers: Mapping[str, int]
    slots: Mapping[Node, Node]
    bodies: tuple[TreeBody, ...] = ()
    pulleys: Mapping[str, Bend] = field(default_factory=dict)

    def marker(self, reference: str) -> Marker:
        """Return the marker of a body, or of a point or frame of it, `body.point`."""
        name, part = body_part(reference, self.system.bodies)
        body = self.system.bodies.get(name, BARE)
        if part in body.frames:
            return Marker(reference, self.numbers[name], pose_of(body.frames[part]))
        if part and part not in body.points:
            known = [f"{name}.{p}" for p in (*body.points, *body.frames)]
            raise ModelError(f"{name!r} has no point or frame {part!r}{suggestion(reference, known)}")
        return Marker(reference, self.numbers[name], Pose(body.points[part] if part else ORIGIN))

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

    def pair(self, references: tuple[str, ...]) -> tuple[Marker, Marker]:
        """Return the markers of both ends of something."""
        ends = []
        for i, reference in enumerate(references):
            with at("between", i):
                ends.append(self.marker(reference))
        return ends[0], ends[1]

    def axes(self, name: str) -> int:
        """Return the number of the body whose axes are meant."""
        if name not in self.numbers:
            raise ModelError(f"no body is called {name!r}{suggestion(name, self.numbers)}").under("frame")
        return self.numbers[name]

    def surface(self, reference: str) -> tuple[Marker, Surface]:
        """Return a surface with the marker of its centre, or of a place in it if it is a plane."""
        name, part = body_part(reference, self.system.bodies)
        body = self.system.bodies.get(name, BARE)
        if part not in body.surfaces:
            known = [f"{name}.{surface}" for surface in body.surfaces]
            raise ModelError(f"{reference!r} is no surface{suggestion(reference, known)}")
        surface = body.surfaces[part]
        place = surface.centre if surface.plane is None else surface.plane
        return Marker(reference, self.numbers[name], Pose(place)), surface

    def joint(self, name: str) -> TreeBody:
        """Return the body that a joint carries."""
        for body in self.bodies:
            if body.joint_name == name and name in self.system.joints:
                return body
        raise ModelError(f"no joint is called {name!r}{suggestion(name, self.system.joints)}")

    def one_freedom(self, name: str) -> TreeBody:
        """Return the body that a joint with one freedom carries."""
        body = self.joint(name)
        if len(body.u) != 1:
            raise ModelError(f"joint {name!r} has {len(body.u)} degrees of freedom; one is needed here")
        return body

    def coordinate(self, joint: str) -> Node:
        """Return the coordinate of a joint with one freedom."""
        return slot("q", self.one_freedom(joint).q[0])

    def freedom(self, joint: str, name: str | None) -> tuple[int | None, int]:
        """Return the coordinate (None: a ball has none for it) and the speed of a joint's freedom, perhaps named."""
        if name is None:
            with at("joint"):
                body = self.one_freedom(joint)
            return body.q[0], body.u[0]
        with at("joint"):
            body = self.joint(joint)
        of_steps = list(zip(body.step_q, body.step_u, strict=True))
        places: dict[Node, tuple[int | None, int]] = {slot("u", u): (None, u) for u in body.u}
        places.update((slot("u", u), (q, u)) for q, u in of_steps)
        places.update((slot("q", q), (q, u)) for q, u in of_steps)
        known = {leaf.data: places[place] for leaf, place in self.slots.items() if place in places}
        if name not in known:
            with at("freedom"):
                raise ModelError(f"joint {joint!r} has no freedom {name!r}{suggestion(name, known)}")
        return known[name]
