"""Bodies as they are seen: by their shape, by their surfaces, or as what joins their places."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.contacts import copies
from multibody_sym.model.declaration.joints import CurveJoint, Fixed, Prismatic, Screw
from multibody_sym.model.mechanism.mass import GROUND, mass_of
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import principal_axes
from multibody_sym.scene.forms import Barrel, Block, Disc, Face, Form, Polyline, Sphere, Symbol, Vector, vector
from multibody_sym.scene.items import Item
from multibody_sym.scene.joints import bounces, held, is_ball, is_led, wire_of
from multibody_sym.scene.places import same
from multibody_sym.scene.stage import Stage
from multibody_sym.scene.strands import anchor_behind
from multibody_sym.scene.surfaces import is_solid, surface_items

_Z: Final = (0.0, 0.0, 1.0)
_UNIT: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
Sizes = Sequence[float]
_SHAPES: Final[Mapping[str, Callable[[Vector, Sizes], Form]]] = {
    "rod": lambda c, s: Polyline(((c[0] - s[0] / 2, c[1], c[2]), (c[0] + s[0] / 2, c[1], c[2]))),
    "disc": lambda c, s: Disc(c, _Z, s[0]),
    "ring": lambda c, s: Disc(c, _Z, s[0], hollow=True),
    "cylinder": lambda c, s: Barrel(c, _Z, s[0], s[1]),
    "sphere": lambda c, s: Sphere(c, s[0]),
    "shell": lambda c, s: Sphere(c, s[0], hollow=True),
    "box": lambda c, s: Block(c, _UNIT, (s[0], s[1], s[2])),
}
"""The form of each shape of a body, from its centre of mass and its sizes."""


def body_items(stage: Stage, found: Mapping[str, list[Vector]]) -> Iterator[Item]:
    """Yield what is seen of each body but ground, given its places."""
    for name, body in stage.system.bodies.items():
        if name == GROUND:
            continue
        number, label, path = stage.number_of(name), body.label or name, ("bodies", name)
        surfaces = list(surface_items(stage, name))
        solid = body.shape is None and any(is_solid(item) for item in surfaces)
        own = list(_forms(stage, name, body, _up_to_springs(stage, name, found[name]), solid=solid))
        yield from (Item("body", name, label, path, number, form) for form in own)
        yield from _as_body(surfaces, name, label) if solid or not own else surfaces
        if (body.shape is not None or body.inertia is not None) and not _marks_centre(own, stage.centre(name)):
            yield Item("mass centre", name, "", path, number, Symbol("com", stage.centre(name)))


def _up_to_springs(stage: Stage, name: str, places: Sequence[Vector]) -> list[Vector]:
    """Return the places of a body, those of sliders with a spring where that begins: it is a part of the rod."""
    moved = {}
    for element in stage.system.forces.values():
        first = anchor_behind(stage, element)
        if first is not None and first.body == stage.number_of(name) and first.body >= 0:
            moved[held(stage, str(getattr(element, "joint", ""))).parent.point] = first.point
    return [moved.get(place, place) if len(places) > 1 else place for place in places]


def _as_body(surfaces: Sequence[Item], name: str, label: str) -> Iterator[Item]:
    """Yield surfaces, those that show all of a body under its name: its path is the beginning of theirs."""
    for item in surfaces:
        yield replace(item, role="body", name=name, label=label) if is_solid(item) else item


def _marks_centre(forms: Sequence[Form], centre: Vector) -> bool:
    """Return whether a symbol stands for all of the body already where its centre of mass is."""
    return any(isinstance(form, Symbol) and same(form.at, centre) for form in forms)


def _forms(stage: Stage, name: str, body: Body, places: Sequence[Vector], *, solid: bool) -> Iterator[Form]:
    """Yield the forms of one body."""
    if body.shape is not None:
        form = _SHAPES[body.shape.kind](stage.centre(name), [stage.number(size) for size in body.shape.sizes])
        yield form
        yield from _arms(form, places)
        return
    centre = stage.centre(name)
    wires = list(_wires(stage, name))
    yield from wires
    if solid:
        shown = next(item.form for item in surface_items(stage, name) if is_solid(item))
        if body.com is not None and not isinstance(shown, Face):
            yield from _arms(shown, [centre])
        return
    if wires and body.inertia is None and mass_of(body).mass.shadow == 0:
        return
    apart = [place for place in places if not same(place, centre)]
    if not apart:
        nut = isinstance(stage.carrying(name), Screw)  # which the joint's sign shows
        yield Symbol("nut_body" if nut else _particle(stage, name, body), centre)
        return
    if len(places) == 1 or body.inertia is None:
        yield from _with_bob(stage, name, body, places, centre)
        return
    yield link([*places, centre] if body.com is not None else places)


def _wires(stage: Stage, name: str) -> Iterator[Polyline]:
    """Yield the curves of a moving body along which joints guide others: it is these wires."""
    for joint_name, joint in stage.system.joints.items():
        if isinstance(joint, CurveJoint) and stage.body(joint.parent) == name and name != GROUND:
            yield wire_of(held(stage, joint_name))


def _arms(form: Form, places: Sequence[Vector]) -> Iterator[Polyline]:
    """Yield lines from the middle of a shape to places that are far from it, which it must hold."""
    bounds = form.bounds
    middle, low, high = bounds.mean(axis=0), bounds.min(axis=0), bounds.max(axis=0)
    slack = 0.01 * float(np.linalg.norm(high - low))
    for place in places:
        if np.any(np.subtract(place, high) > slack) or np.any(np.subtract(low, place) > slack):
            yield Polyline((vector(middle), place))


def _particle(stage: Stage, name: str, body: Body) -> str:
    """Return the symbol of what has one place only: a block on a slider, a rotor on a hinge, else a bob."""
    joint = stage.carrying(name)
    if body.inertia is None and mass_of(body).mass.shadow == 0 and joint is not None and joint.steps:
        return "nut_body"
    if isinstance(joint, Prismatic) and is_led(stage, joint):
        return "bob"
    if isinstance(joint, Prismatic):
        return "bob" if is_ball(stage, name) else "block"
    if body.inertia is not None and joint is not None and any(step.is_hinge for step in joint.steps):
        return "rotor"
    if isinstance(joint, Fixed) and stage.is_ground(joint.parent):
        return "block"
    return "bob" if not _touches_face(stage, name) else "block"


def _touches_face(stage: Stage, name: str) -> bool:
    """Return whether a particle lies on something, as a block does; what bounces without rubbing is a ball."""
    for _, _, contact in copies(stage.system.contacts):
        others = [end for end in contact.between if end != name]
        if name in contact.between and not bounces(contact) and any(_is_flat(stage, other) for other in others):
            return True
    return False


def _is_flat(stage: Stage, reference: str) -> bool:
    """Return whether what a reference leads to has faces to lie on."""
    body = stage.declared(stage.body(reference))
    surface = body.surfaces.get(reference.rpartition(".")[2])
    kinds = [surface.kind] if surface is not None else [each.kind for each in body.surfaces.values()]
    return "plane" in kinds or (body.shape is not None and body.shape.kind == "box")


def _with_bob(
    stage: Stage, name: str, body: Body, places: Sequence[Vector], centre: Vector
) -> Iterator[Form]:
    """Yield the rod from the places of a particle, or of a body that is held at one, to its centre of mass."""
    others = [place for place in places if not same(place, centre)]
    yield link([*others, centre])
    if body.inertia is None:
        held = any(same(place, centre) for place in places)
        yield Symbol(_particle(stage, name, body) if held else "bob", centre)


def link(places: Sequence[Vector]) -> Polyline:
    """Return a rod through places on a line, or the plate that they bound; in space a frame of bars from the middle."""
    points = np.array(places)
    middle = points.mean(axis=0)
    axes, dimensions = principal_axes(points - middle)
    if dimensions <= 1:
        order = np.argsort(points @ axes[0], kind="stable")
        if np.dot(points[order[0]] - points[0], points[0] - points[order[-1]]) == 0.0 and order[0] != 0:
            order = order[::-1]
        return Polyline(tuple(vector(points[k]) for k in order))
    if dimensions == 2:
        return Polyline(tuple(vector(points[k]) for k in hull(points @ axes[:2].T)), closed=True)
    bars = [bar for point in points for bar in (vector(middle), vector(point))]
    return Polyline(tuple(bars))


def hull(points: Floats) -> list[int]:
    """Return which of points in a plane (n, 2) bound them all, around (Andrew's monotone chain)."""
    order = sorted(range(len(points)), key=lambda k: (points[k][0], points[k][1]))

    def half(run: Sequence[int]) -> list[int]:
        found: list[int] = []
        for k in run:
            while len(found) > 1 and _turn(points[found[-2]], points[found[-1]], points[k]) <= 0.0:
                found.pop()
            found.append(k)
        return found[:-1]

    return half(order) + half(order[::-1])


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
