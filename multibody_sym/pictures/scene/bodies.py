"""Bodies as they are seen: by their shape, by their surfaces, or as what joins their places."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.bodies import GROUND, Body, mass_of
from multibody_sym.model.constraints import (
    Coupler,
    Distance,
    Expression,
    Gear,
    OnCurve,
    PointInPlane,
    PointOnLine,
    PrescribedMotion,
    Rolling,
    Rope,
    VelocityConstraint,
)
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.forces import Damper, Friction, Motor, Potential, SpringDamper
from multibody_sym.model.joints import CurveJoint, Fixed, Prismatic, Screw
from multibody_sym.pictures.scene.forces import anchor_behind
from multibody_sym.pictures.scene.items import (
    ZERO,
    Anchor,
    Barrel,
    Block,
    Disc,
    Face,
    Form,
    Item,
    NamedLength,
    Polyline,
    Rail,
    Sphere,
    Symbol,
    Vector,
    unit,
    vector,
)
from multibody_sym.pictures.scene.joints import bounces, is_led, is_particle, is_ring, placed_joint, wire_of
from multibody_sym.pictures.scene.letters import (
    asked_names,
    coefficients,
    is_titled,
    law_letters,
    letters,
    mass_letters,
    steady_speed,
)
from multibody_sym.pictures.scene.masses import (
    at_its_centre,
    is_upright,
    leads_on,
    on_an_arm,
    ride_of,
    rocket,
    rod_beyond,
    rubbing_length,
    top,
)
from multibody_sym.pictures.scene.stage import (
    FrameOnBody,
    PlacedSystem,
    curve_points,
    is_bead_on_ring,
    is_solid,
    references,
    same,
    surface_items,
)
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import principal_axes

_Z: Final = (0.0, 0.0, 1.0)
_BESIDE: Final = 0.25
"""The centre of mass of a bar is nearer to it than this part of its length."""
_WIDER: Final = 1.4
"""How much wider than its places a body between guides is."""
_SLEEVE: Final = 0.3
"""Half the width of a sleeve, in its length."""
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


def body_items(stage: PlacedSystem, found: Mapping[str, list[Vector]]) -> Iterator[Item]:
    """Yield what is seen of each body but ground, given its places."""
    for name, body in stage.system.bodies.items():
        if name == GROUND:
            continue
        number, label, path = stage.number_of(name), body.label or name, ("bodies", name)
        surfaces = list(surface_items(stage, name))
        solid = body.shape is None and any(is_solid(item) for item in surfaces)
        own = list(_forms(stage, name, body, _up_to_springs(stage, name, found[name]), solid=solid))
        named: dict[str, Any] = {"letters": mass_letters(stage, name), "titled": body.label is not None}
        named["heavy"] = mass_of(body).mass.shadow != 0
        yield from (Item("body", name, label, path, number, form, **named) for form in own)
        for item in surfaces:
            if isinstance(item.form, Face):
                item = replace(item, form=replace(item.form, rides=ride_of(stage, name)))
            # one that shows all of a body has its name: its path begins like that of the surface
            whole = is_solid(item) and (solid or not own)
            yield replace(item, role="body", name=name, label=label, **named) if whole else item
        signs = [form for form in own if isinstance(form, Symbol)]
        sized = body.shape is not None or body.inertia is not None
        if sized and named["heavy"] and not any(same(sign.at, stage.centre(name)) for sign in signs):
            yield Item("mass centre", name, "", path, number, Symbol("com", stage.centre(name)))


def _up_to_springs(stage: PlacedSystem, name: str, places: Sequence[Vector]) -> list[Vector]:
    """Return the places of a body, those of sliders with a spring where that begins: it is a part of the rod."""
    moved = {}
    for element in stage.system.forces.values():
        first = anchor_behind(stage, element)
        if first is not None and first.body == stage.number_of(name) and first.body >= 0:
            moved[placed_joint(stage, str(getattr(element, "joint", ""))).parent.point] = first.point
    return [moved.get(place, place) if len(places) > 1 else place for place in places]


def _forms(stage: PlacedSystem, name: str, body: Body, places: Sequence[Vector], *, solid: bool) -> Iterator[Form]:
    if body.shape is not None:
        form = _SHAPES[body.shape.kind](stage.centre(name), [stage.number(size) for size in body.shape.sizes])
        yield form
        yield from _arms(form, places)
        return
    centre = stage.centre(name)
    wires = [  # a body along whose curves joints guide others is these wires
        wire_of(placed_joint(stage, word))
        for word, joint in stage.system.joints.items()
        if isinstance(joint, CurveJoint) and stage.body(joint.parent) == name
    ]
    yield from wires
    if solid:
        shown = next(item.form for item in surface_items(stage, name) if is_solid(item))
        if shown.sized:
            held = places if isinstance(shown, (Disc, Sphere)) and not shown.hollow else ()
            yield from _arms(shown, [centre, *held] if body.com is not None else held)
        return
    if wires:
        return
    guided = _between_guides(stage, name, body, places)
    if guided is not None:
        yield guided
        yield from _arms(guided, places)
        return
    driven = rocket(stage, name, body)
    if driven is not None:
        yield driven
        return
    cone = top(stage, name, body)
    if cone is not None:
        yield cone
        return
    apart = [place for place in places if not same(place, centre)]
    if is_bead_on_ring(stage, name):
        yield Symbol("bob", centre)
        return
    if not apart:
        equal = at_its_centre(stage, name, body)
        if equal is not None:
            yield equal
            return
        nut = isinstance(stage.carrying(name), Screw)  # which the joint's sign shows
        yield Symbol("nut_body" if nut else _particle(stage, name, body), centre)
        return
    if len(places) == 1 or body.inertia is None:  # a rod from its places to its centre of mass
        if body.inertia is None and leads_on(stage, body):  # a chain that runs on or off
            yield Polyline((ZERO, vector(2.0 * np.array(centre))), chain=True)
            return
        sign = _particle(stage, name, body) if len(apart) < len(places) else "bob"
        if body.inertia is None:
            yield Symbol(sign, centre)
            yield replace(link([*apart, centre]), thin=sign == "bob")
        else:
            yield from on_an_arm(stage, name, body, apart[0], whole=not _slides(stage, name))
        return
    held = places if body.com is None or _is_bar(stage, places, centre) else [*places, centre]
    yield link(held if _slides(stage, name) else rod_beyond(stage, name, body, held))


def _slides(stage: PlacedSystem, name: str) -> bool:
    """Return whether a body is a part of what a slider lengthens."""
    sliders = (joint for joint in stage.system.joints.values() if isinstance(joint, Prismatic))
    return any(name in (stage.body(joint.parent), stage.body(joint.child)) for joint in sliders)


def _between_guides(stage: PlacedSystem, name: str, body: Body, places: Sequence[Vector]) -> Block | None:
    """Return the box of what rubs in a slider along a length: as long as that, and wide enough for its places.

    On an upright column it is a sleeve.
    """
    joint = stage.carrying(name)
    if not isinstance(joint, Prismatic) or body.inertia is not None or not moves_in_plane(stage.system):
        return None
    length, place = rubbing_length(stage, joint), stage.place(joint.child)
    along, middle = np.array(stage.axis(place, joint.steps[0].slides[0])), np.array(place.point)
    aside = np.cross(_Z, along)
    half = _WIDER * max((abs(float(np.subtract(point, middle) @ aside)) for point in places), default=0.0)
    if not length or not half:
        return None
    half = min(half, _SLEEVE * length) if is_upright(stage, joint) else half
    first, second, third = np.array([along, aside, _Z]).T
    return Block(vector(middle), (vector(first), vector(second), vector(third)), (length, 2.0 * half, half))


def guided_lengths(stage: PlacedSystem, bodies: Sequence[Item]) -> Iterator[NamedLength]:
    """Yield the letters of how far apart the pads are by which boxes rub between guides, along their sides."""
    for name, force in stage.system.frictions.items():
        if force.length is None or not letters(force.length):
            continue
        child = stage.number_of(stage.body(stage.system.joints[force.joint].child))
        for box in (item.form for item in bodies if item.body == child and isinstance(item.form, Block)):
            first, second, _ = np.array(box.rotation).T * np.array(box.sizes)[:, None] / 2.0
            low, high = (Anchor(child, vector(np.array(box.centre) - second + x * first)) for x in (-1.0, 1.0))
            yield NamedLength(name, letters(force.length), low, high)


def _is_bar(stage: PlacedSystem, places: Sequence[Vector], centre: Vector) -> bool:
    """Return whether a body in space is a bar from joint to joint, as links of robots are: its centre is near that."""
    if len(places) != 2 or moves_in_plane(stage.system):
        return False
    first, last = np.array(places)
    along, apart = last - first, np.array(centre) - first
    part = float(np.clip(apart @ along / float(along @ along), 0.0, 1.0))
    return float(np.linalg.norm(apart - part * along)) < _BESIDE * float(np.linalg.norm(along))


def _arms(form: Form, places: Sequence[Vector]) -> Iterator[Polyline]:
    """Yield lines from the middle of a shape to places that are far from it, which it must hold."""
    bounds = form.bounds
    middle, low, high = bounds.mean(axis=0), bounds.min(axis=0), bounds.max(axis=0)
    slack = 0.01 * float(np.linalg.norm(high - low))
    for place in places:
        if np.any(np.subtract(place, high) > slack) or np.any(np.subtract(low, place) > slack):
            yield Polyline((vector(middle), place))


def _particle(stage: PlacedSystem, name: str, body: Body) -> str:
    """Return the symbol of what has one place only: a block on a slider, a rotor on a hinge, else a bob."""
    joint = stage.carrying(name)
    light = body.inertia is None or not any(stage.number(node) for node in body.inertia)
    if light and mass_of(body).mass.shadow == 0 and joint is not None and joint.steps:
        return "nut_body"
    if isinstance(joint, Prismatic) and is_led(stage, joint):
        return "bob"
    if isinstance(joint, Prismatic):
        rides = {"wheels": "wagon", "belt": "belt"}.get(ride_of(stage, name), "block")
        return "ring" if is_ring(stage, joint) else "bob" if is_particle(stage, name) else rides
    if body.inertia is not None and joint is not None and any(step.is_hinge for step in joint.steps):
        return "rotor"
    if isinstance(joint, Fixed) and stage.is_ground(joint.parent):
        return "block" if body.varying is None else "pile"
    for _, _, contact in copies(stage.system.contacts):  # what bounces without rubbing is a ball
        others = [end for end in contact.between if end != name]
        if name in contact.between and not bounces(contact) and any(_is_flat(stage, other) for other in others):
            return "block"
    return "bob"


def _is_flat(stage: PlacedSystem, reference: str) -> bool:
    """Return whether what a reference leads to has faces to lie on."""
    body = stage.declared(stage.body(reference))
    surface = body.surfaces.get(reference.rpartition(".")[2])
    kinds = [surface.kind] if surface is not None else [each.kind for each in body.surfaces.values()]
    return "plane" in kinds or (body.shape is not None and body.shape.kind == "box")


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
            while len(found) > 1:
                a, b, c = (points[each] for each in (*found[-2:], k))
                if float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) > 0.0:
                    break
                found.pop()
            found.append(k)
        return found[:-1]

    return half(order) + half(order[::-1])


# ----------------------------------------------------------------------------------------------------------------------
# What else is declared and seen: pulleys, gears, guides of points, contacts, friction and springs in hinges.


def marker_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the frames and points of all bodies; those that are joined or held show themselves by what holds them."""
    named = set(references(stage))
    for name, body in stage.system.bodies.items():
        for word in body.frames:
            place = stage.place(f"{name}.{word}")
            sign, path = Symbol("point", place.point), ("bodies", name, "frames", word)
            yield Item("frame", f"{name}.{word}", word, path, place.body, sign, on_ground=name == GROUND)
        for word in body.points:
            place, used = stage.place(f"{name}.{word}"), f"{name}.{word}" in named
            sign = Symbol("used_point" if used else "point", place.point)
            yield Item("point", f"{name}.{word}", word, ("bodies", name, "points", word), place.body, sign)


def pulley_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the pulleys: their wheel, or a symbol where the rope bends at a point; and what holds those on ground."""
    for name, pulley in stage.system.pulleys.items():
        place = stage.place(pulley.at or pulley.body or GROUND)
        radius, axis = stage.number(pulley.radius), stage.axis(place, pulley.axis)
        grounded = pulley.body is None and stage.is_ground(pulley.at or GROUND)
        wheel = Disc(place.point, axis, radius) if radius > 0.0 else Symbol("pulley", place.point, axis)
        found = "" if pulley.rough is None else coefficients(pulley.rough.static, pulley.rough.kinetic)
        item = Item("pulley", name, name, ("pulleys", name), place.body, wheel, on_ground=grounded, letters=found)
        yield item
        if radius > 0.0 and pulley.body is None:
            yield replace(item, label="", letters="", form=Symbol("axle", place.point, axis))


# --- constraints ---------------------------------------------------------------------------------------------------


def constraint_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield what is seen of constraints that are no strands."""
    for name, element in stage.system.constraints.items():
        if type(element) not in _CONSTRAINTS:
            raise TypeError(f"no picture of constraints such as {type(element).__name__}")
        yield from _CONSTRAINTS[type(element)](stage, name, element)


def _gear(stage: PlacedSystem, name: str, gear: Gear) -> Iterator[Item]:
    """Yield the pitch circles on the children of both hinges; radii that are not given follow from the ratio."""
    path, made = ("constraints", name), [placed_joint(stage, joint) for joint in gear.joints]
    ratio = abs(stage.number(gear.ratio, 1.0)) or 1.0
    if gear.radii is not None:
        radii = [stage.number(radius) for radius in gear.radii]
    elif not all(each.turns for each in made):  # a rack: the ratio is a radius, or one over it
        radii = [1.0 / ratio if made[0].turns else 0.0, 0.0 if made[0].turns else ratio]
    else:
        first, second = (stage.world(each.parent.body, each.parent.point) for each in made)
        distance = float(np.linalg.norm(first - second))
        outside = stage.number(gear.ratio, 1.0) < 0.0
        total = ratio + 1.0 if outside else abs(ratio - 1.0)
        radii = [distance / total, ratio * distance / total] if total > 0.0 else [0.0, 0.0]
    for each, radius in zip(made, radii, strict=True):
        if not each.turns:
            sign = Symbol("rack", each.child.point, along=stage.axis(each.child, each.slides[0]))
            yield Item("gear", name, name, path, each.child.body, sign)
            continue
        axis = stage.axis(each.child, each.turns[0])
        form = Disc(each.child.point, axis, radius, teeth=True) if radius > 0.0 else None
        yield Item("gear", name, name, path, each.child.body, form or Symbol("gear", each.child.point, axis))


def _drive(stage: PlacedSystem, name: str, element: PrescribedMotion) -> Iterator[Item]:
    """Yield the direction in which a joint is driven."""
    each = placed_joint(stage, element.joint)
    axes = each.turns or each.slides
    axis = each.on_parent(axes[0]) if axes else _Z
    sign = Symbol("drive_about" if each.turns else "drive_along", each.parent.point, axis)
    body, path, found = each.parent.body, ("constraints", name), letters(element.value)
    if steady_speed(stage, element.value):
        return  # an arrow shows it
    yield Item("limit", name, name, path, body, sign, each.bodies, each.on_ground, letters=found)


def _tie(stage: PlacedSystem, name: str, element: Any) -> Iterator[Item]:
    yield Item("limit", name, name, ("constraints", name), -1, Symbol("tie", (0.0, 0.0, 0.0)))


def _skate(stage: PlacedSystem, name: str, element: VelocityConstraint) -> Iterator[Item]:
    """Yield the edge of a skate where a velocity in a plane has one direction left, else nothing to be seen."""
    rows = dict(zip((row.name for row in stage.mechanism.rows), row_motions(stage.motion), strict=True))
    jacobian = np.array(rows[name].jacobian, dtype=float) if name in rows else np.zeros(0)
    for k, body in enumerate(stage.mechanism.bodies):
        joint = stage.system.joints.get(body.joint_name)
        if joint is None or joint.kind != "planar" or len(body.u) != 3 or not jacobian.any():
            continue
        made = placed_joint(stage, body.joint_name)
        ways = [stage.turned(made.parent.body, made.parent.turned(axis)) for axis in np.eye(3)]
        across = jacobian[body.u[0]] * ways[0] + jacobian[body.u[1]] * ways[1]
        if float(np.linalg.norm(across)) < 0.5 * float(np.linalg.norm(jacobian)):
            continue
        own = stage.poses[k][:, :3].T
        sign = Symbol("skate", made.child.point, unit(own @ ways[2]), unit(own @ np.cross(across, ways[2])))
        yield Item("limit", name, name, ("constraints", name), k, sign)
        return
    yield from _tie(stage, name, element)


def _on_line(stage: PlacedSystem, name: str, element: PointOnLine) -> Iterator[Item]:
    place, other = stage.place(element.line.through), stage.place(element.point)
    axis = stage.axis(place, element.line.direction)
    apart = stage.world(other.body, other.point) - stage.world(place.body, place.point)
    way, reach = float(apart @ stage.turned(place.body, axis)), 0.5 * stage.lengths.get("size", 1.0)
    rail = Rail(place.point, axis, (min(way - reach, 0.0), max(way + reach, 0.0)))
    yield Item("guide", name, name, ("constraints", name), place.body, rail, (place.body, other.body), place.body < 0)
    yield _bead(stage, name, element.point)


def _bead(stage: PlacedSystem, name: str, point: str) -> Item:
    place = stage.place(point)
    return Item("joint", name, name, ("constraints", name), place.body, Symbol("bead", place.point))


def _in_plane(stage: PlacedSystem, name: str, element: PointInPlane) -> Iterator[Item]:
    place = stage.place(element.plane.through)
    axis = stage.axis(place, element.plane.normal)
    if place.body < 0 and _carries(stage, place, element.point):
        roller = Symbol("roller", place.point, along=vector(-np.array(axis)))
        titled, path = is_titled(element, name, roller.kind), ("constraints", name)
        yield Item("joint", name, name, path, place.body, roller, on_ground=True, titled=titled)
        return
    face = Face(place.point, axis)
    yield Item("surface", name, name, ("constraints", name), place.body, face, on_ground=place.body < 0)
    yield _bead(stage, name, element.point)


def _carries(stage: PlacedSystem, place: FrameOnBody, point: str) -> bool:
    """Return whether a plane of ground supports a structure at a point of it."""
    here, there = (vector(stage.world(each.body, each.point)) for each in (place, stage.place(point)))
    return stage.is_structure and same(here, there)


def _on_curve(stage: PlacedSystem, name: str, element: OnCurve) -> Iterator[Item]:
    place, other = stage.place(element.on), stage.place(element.point)
    points = curve_points(stage, element.curve, None)
    base = np.array(place.point)
    form = Polyline(tuple(vector(base + place.turned(point)) for point in points))
    yield Item("guide", name, name, ("constraints", name), place.body, form, (place.body, other.body), place.body < 0)
    yield _bead(stage, name, element.point)


_CONSTRAINTS: Final[Mapping[type[Any], Callable[[PlacedSystem, str, Any], Iterator[Item]]]] = {
    Gear: _gear,
    PrescribedMotion: _drive,
    PointOnLine: _on_line,
    PointInPlane: _in_plane,
    OnCurve: _on_curve,
    Rolling: lambda stage, name, element: iter(
        [_touch(stage, name, ("constraints", name), (element.body, element.on))]
    ),
    Expression: _tie,
    VelocityConstraint: _skate,
    **dict.fromkeys((Distance, Rope, Coupler), lambda stage, name, element: iter(())),  # drawn among the strands
}
"""The picture of each kind of constraint."""


# --- contacts and what acts in joints --------------------------------------------------------------------------------


def contact_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield a sign without ink at the first body of each contact, where marks and forces have their place."""
    asked = asked_names(stage.system)
    for declared, name, contact in copies(stage.system.contacts):
        found = coefficients(contact.static, contact.kinetic, contact.restitution)
        titled = is_titled(contact, name, "contact") and name in asked
        yield replace(_touch(stage, name, ("contacts", declared), contact.between), letters=found, titled=titled)


def _touch(stage: PlacedSystem, name: str, path: tuple[str, ...], between: tuple[str, ...]) -> Item:
    """Return the sign of a contact on the first of both bodies that names a place, else on the first."""
    bodies = [stage.number_of(stage.body(reference)) for reference in between]
    for k, reference in enumerate(between):
        try:
            place = stage.place(reference)
        except ModelError:  # a surface, which is no place
            continue
        pair, names = (place.body, bodies[1 - k]), (reference, between[1 - k])
        return Item("contact", name, name, path, place.body, Symbol("contact", place.point), pair, touching=names)
    sign = Symbol("contact", (0.0, 0.0, 0.0))
    return Item("contact", name, name, path, bodies[0], sign, (bodies[0], bodies[1]), touching=between)


def force_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield what is seen of forces in joints: springs and dampers in hinges, motors, friction."""
    for name, element in stage.system.forces.items():
        kind, joint = _IN_JOINTS.get(type(element)), getattr(element, "joint", None)
        if joint is None or kind is None:
            yield from _field_signs(stage, name, element)
            continue
        each = placed_joint(stage, joint)
        if kind in ("torsion_spring", "torsion_damper") and not each.turns:
            continue  # a strand along the slider
        sign = Symbol(kind, each.parent.point, each.on_parent(each.turns[0]) if each.turns else _Z)
        path, found = ("forces", name), law_letters(element)
        yield Item("force", name, name, path, each.parent.body, sign, each.bodies, each.on_ground, letters=found)


def _field_signs(stage: PlacedSystem, name: str, element: Any) -> Iterator[Item]:
    """Yield a sign without ink for a potential at a body or in joints, which has no form of its own."""
    if not isinstance(element, Potential) or element.between is not None:
        return
    if element.on is not None:
        body, point = stage.number_of(element.on), stage.centre(element.on)
    else:
        each = placed_joint(stage, element.joint or (element.joints or ("",))[0])
        body, point = each.child.body, each.child.point
    yield Item("force", name, "", ("forces", name), body, Symbol("tie", point))


_IN_JOINTS: Final[Mapping[type[Any], str]] = {
    SpringDamper: "torsion_spring",
    Damper: "torsion_damper",
    Motor: "motor",
    Friction: "friction",
}
"""The sign of each force in a joint."""
