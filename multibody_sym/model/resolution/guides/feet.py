"""Feet: massless frames that follow the places where curves are touched, each with the curve's parameter as coordinate.

The contact of a curve with something else takes the curve's tangent and normal from its foot, whose row says that it is
where the other one is nearest. So all is made of known rows with exact derivatives, and nothing is solved for within.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field, replace

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.constraints import OnCurve, Rolling
from multibody_sym.model.declaration.contacts import copies
from multibody_sym.model.declaration.curves.curve import Curve
from multibody_sym.model.declaration.curves.foot import Foot
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.surfaces import Surface
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mass import GROUND, OWN_POINTS
from multibody_sym.model.resolution.references import BARE, no_part
from multibody_sym.model.resolution.spanning_tree import body_part, coordinate_names, speed_names
from multibody_sym.records import dataclass


def with_feet(system: System) -> System:
    """Return a system with the feet of all curves that are touched or guide points, each a body and a joint."""
    made = _Made(system, dict(system.bodies), dict(system.joints))
    for owner, between in _contacts(system):
        found = [(end, *guide) for end, reference in enumerate(between) if (guide := _guide(reference, system))]
        for end, body, surface in found:
            word = f"foot{end + 1}" if len(found) > 1 else "foot"
            made.add(owner, word, body, _centred(surface), between, end, turns="tangent")
    for owner, element in system.constraints.items():
        if isinstance(element, OnCurve):
            with at("constraints", owner, "on"):
                _verify_place(element.on, system)
            made.add(owner, "foot", element.on, element.curve, (element.point, element.on), 1, turns=None)
    if len(made.joints) == len(system.joints):
        return system
    return replace(system, bodies=Names(made.bodies), joints=Names(made.joints))


def _contacts(system: System) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the names of what touches or rolls, with both ends."""
    for _, name, contact in copies(system.contacts):
        yield name, contact.between
    for name, element in system.constraints.items():
        if isinstance(element, Rolling):
            yield name, (element.body, element.on)


def _guide(reference: str, system: System) -> tuple[str, Surface] | None:
    """Return the body and the surface of an end that is a curve: named, or the only one that its body has.

    What is no body is told where the contact is made of both ends.
    """
    try:
        name, part = body_part(reference, system.bodies)
    except ModelError:
        return None
    body = system.bodies.get(name)
    if body is None:
        return None
    surface = body.surfaces.get(part)
    if not part and body.shape is None:
        plain = "point" if name == GROUND else "plane"
        solid = [each for each in body.surfaces.values() if each.kind != plain]
        surface = solid[0] if len(solid) == 1 else None
    return None if surface is None or surface.guide is None else (name, surface)


def _verify_place(reference: str, system: System) -> None:
    """Raise ModelError for what carries a curve and is no body, nor a point or frame of one."""
    name, part = body_part(reference, system.bodies)
    body = system.bodies.get(name, BARE)
    if part and part not in (*OWN_POINTS, *body.points, *body.frames):
        raise no_part(name, part, body)


def _centred(surface: Surface) -> Curve:
    """Return the curve of a surface from its centre, as one of its parameter."""
    assert surface.guide is not None
    (x, y, _), (cx, cy, _) = surface.guide.place, surface.centre
    name, unit = surface.guide.leaf.data[1]
    return Curve(x=x + cx, y=y + cy, parameter=name, unit=unit)


@dataclass(frozen=True)
class _Made:
    """The bodies and joints of a system with those of its feet."""

    system: System
    bodies: dict[str, Body]
    joints: dict[str, Joint]
    taken: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        for name, joint in self.system.joints.items():
            self.taken.update((*coordinate_names(name, joint), *speed_names(name, joint)))
        self.taken.update((*self.system.parameters, *self.system.inputs, *self.system.outputs, "t"))

    def add(
        self, owner: str, word: str, parent: str, curve: Curve, between: tuple[str, ...], end: int, *, turns: str | None
    ) -> None:
        """Add the foot of one end, whose coordinate is called after its owner and the curve's parameter."""
        plain = re.sub(r"[^A-Za-z0-9_]", "_", owner)
        q = f"{plain if plain[0].isalpha() else f'at_{plain}'}_{curve.leaf.data[1][0]}{word.removeprefix('foot')}"
        while not self.taken.isdisjoint((q, f"u_{q}")):
            q += "_foot"
        self.taken.update((q, f"u_{q}"))
        body = f"{word} of {owner}"
        self.bodies[body] = Body()
        self.joints[f"{owner}.{word}"] = Foot(
            parent=parent, child=body, curve=curve, turns=turns, q=(q,), owner=owner, between=between, end=end
        )
