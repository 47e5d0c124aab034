"""Which contacts does a system have: elements that hold one way only, each with a normal row and rows of friction?

Also the rows of what rolls, and the feet that follow curves which are touched. How surfaces touch is in
`contact_geometry`, what the ends of a contact stand for in `contact_solids`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import product
from typing import Final

from multibody_sym.errors import ModelError, at, gathered
from multibody_sym.mechanics.contact_solids import Solid, sample_value, solid_of
from multibody_sym.mechanics.law_elements import BOUNDLESS, FrictionPart, LawElement
from multibody_sym.mechanics.mechanism import TangentAngle
from multibody_sym.mechanics.references import BARE, References, in_plane, moves_in_plane, no_part, surface_tangents
from multibody_sym.mechanics.row_records import (
    AngleRow,
    Bent,
    ContactDirection,
    ContactRow,
    ContactSurface,
    Edge,
    Level,
    Marker,
    PositionRow,
    Rim,
    RoundSurface,
    Row,
    SurfacePair,
    TurningRow,
    is_curved,
    is_point,
    plane_of,
)
from multibody_sym.mechanics.spanning_tree import body_part, coordinate_names, speed_names
from multibody_sym.model.bodies import GROUND, OWN_POINTS, Body, Surface, unit_vector
from multibody_sym.model.constraints import OnCurve, Rolling, row_names
from multibody_sym.model.contacts_and_impacts import ENOUGH, Contact, copies, without_number
from multibody_sym.model.fields import Names, Point
from multibody_sym.model.joints import Fixed, Foot, Joint
from multibody_sym.model.steps import Curve, is_upright
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import cos, sin
from multibody_sym.scalars.node import ONE, ZERO, negate, nodes_among
from multibody_sym.scalars.vectors import add, cross, dot, scale, subtract
from multibody_sym.scalars.vectors import negate as opposite

# ----------------------------------------------------------------------------------------------------------------------
# Rows of feet: each is where the other end is nearest to its curve.

_X: Final[Point] = (ONE, ZERO, ZERO)
_Y: Final[Point] = (ZERO, ONE, ZERO)
_Z: Final[Point] = (ZERO, ZERO, ONE)


def surfaces_with_feet(owner: str, skins: SurfacePair, references: References) -> SurfacePair:
    """Return the skins of a contact, curves with their feet."""
    feet = {joint.end: name for name, joint in feet_of(owner, references).items()}
    first, second = (
        replace(skin, foot=_foot(feet[k], references)) if isinstance(skin, Bent) else skin
        for k, skin in enumerate(skins)
    )
    return first, second


def feet_of(owner: str, references: References) -> Mapping[str, Foot]:
    """Return the joints of the feet of a contact or constraint, by their names."""
    joints = references.system.joints.items()
    return {name: joint for name, joint in joints if isinstance(joint, Foot) and joint.owner == owner}


def _foot(joint: str, references: References) -> Marker:
    return references.marker(references.system.joints[joint].child)


def foot_rows(references: References) -> Iterator[Row]:
    """Yield the rows of all feet that touch: across the way to the other end, or along a plane."""
    owners = {joint.owner: joint for joint in references.system.joints.values() if isinstance(joint, Foot)}
    for owner, joint in owners.items():
        if isinstance(references.system.constraints.get(owner), OnCurve):
            continue
        solids = (solid_of(end, references, flat=True) for end in joint.between)
        first, second = (solid.skins[0][1] for solid in solids)
        skins = surfaces_with_feet(owner, (first, second), references)
        names = list(feet_of(owner, references))
        bent = [skin for skin in skins if isinstance(skin, Bent)]
        if len(bent) == 2:
            facing = _facing_frame(bent[0].foot, _Y if bent[0].left != bent[1].left else opposite(_Y))
            yield AngleRow(f"{names[0]}.t", (facing, bent[1].foot), (_Y, _X), shared=_Y)
            yield PositionRow(f"{names[1]}.t", (bent[1].foot, bent[0].foot), _X)
            continue
        other = next(skin for skin in skins if not isinstance(skin, Bent))
        if (plane := other.plane) is not None:
            facing = _facing_frame(plane.place, opposite(plane.normal) if bent[0].left else plane.normal)
            yield AngleRow(f"{names[0]}.t", (facing, bent[0].foot), (_Y, _X), shared=_Y)
        else:
            yield PositionRow(f"{names[0]}.t", (bent[0].foot, other.place), _X)


def _facing_frame(marker: Marker, normal: Point) -> Marker:
    """Return a frame at a marker of which y is a unit vector of the marker's axes, in the plane.

    What faces a curve does so from one side: of two places where the tangent is along it, the one where y is y.
    """
    x, y, _ = normal
    rotation = ((y, x, ZERO), (negate(x), y, ZERO), _Z)
    return replace(marker, pose=replace(marker.pose, rotation=rotation))


def rows_on_curve(name: str, element: OnCurve, references: References) -> list[Row]:
    """Return the rows that keep a point at its foot on a curve, along the axes of the curve's body."""
    with at("point"):
        point = references.marker(element.point)
    (joint,) = feet_of(name, references)
    rows = zip(row_names(name, element), (_X, _Y, _Z), strict=True)
    made: list[Row] = [PositionRow(row, (_foot(joint, references), point), axis) for row, axis in rows]
    return made[:2] if in_plane(references.system) else made


# ----------------------------------------------------------------------------------------------------------------------

_TANGENTS: Final[tuple[ContactDirection, ...]] = ("t1", "t2")
_ROLLING: Final[tuple[ContactDirection, ...]] = ("normal", "t1", "t2")
_TURNS: Final[tuple[ContactDirection, ...]] = ("roll1", "roll2")
_ALONG_NORMAL: Final = 1e-9
_ALONE: Final = "face"
"""The word for the face of a plane that ends, beside the words for its ends."""
_HOLLOW: Final = "name points, discs or spheres of the other one"


@dataclass(frozen=True)
class _Meeting:
    """Two surfaces that may touch: the name of their contact, and a row from which all others follow."""

    name: str
    row: ContactRow
    flat: bool

    def rows(self, word: str, along: tuple[ContactDirection, ...], kind: type[ContactRow]) -> tuple[ContactRow, ...]:
        if self.flat:
            along = along[:1]
        names = [f"{self.name}.{word}" + (str(k) if len(along) > 1 else "") for k in range(1, len(along) + 1)]
        r = self.row
        return tuple(kind(name, r.skins, d, r.across, r.upright, r.inner) for name, d in zip(names, along, strict=True))


def contacts(references: References) -> tuple[LawElement, ...]:
    """Return the contacts of a system. Raises ModelError, with the place, for surfaces that cannot touch."""
    system = references.system
    flat = references.plane or in_plane(system)
    found: list[LawElement] = []
    taken = {*system.constraints, *system.joints}
    for declared, contact in system.contacts.items():
        with at("contacts", declared):
            every = []
            for _, name, copy in copies({declared: contact}):
                if name in taken:
                    raise ModelError(
                        f"{name!r} is something else too, and results tell both by name; rename one", number="M108"
                    )
                taken.add(name)
                every.append(tuple(_elements(name, ("contacts", declared), copy, references, flat)))
            found += _together(without_number(declared), every, taken)
    for name, element in system.constraints.items():
        if isinstance(element, Rolling) and element.contact is not None:
            with at("constraints", name):
                _rolling_skins(name, element, references, flat)
                found += _elements(name, ("constraints", name), element.contact, references, flat)
    return tuple(found)


def _together(declared: str, copies: Sequence[tuple[LawElement, ...]], taken: set[str]) -> Iterator[LawElement]:
    """Yield contacts that repeat, as the legs of one table: those of one part each between the same two bodies.

    Like corners their forces have a sum, under the name that is declared.
    """
    bodies = {tuple(x.place.body for x in element.surfaces or ()) for copy in copies for element in copy}
    legs = len(copies) > 1 and all(len(copy) == 1 for copy in copies) and len(bodies) == 1 and declared not in taken
    for element in (element for copy in copies for element in copy):
        yield replace(element, group=declared) if legs else element


def rolling_rows(name: str, element: Rolling, references: References) -> Iterator[ContactRow]:
    """Yield the rows of a ball or disc that rolls: along the normal, and along both tangents."""
    flat = references.plane or in_plane(references.system)
    skins = _rolling_skins(name, element, references, flat)
    across = _usual_across(name, skins, references, flat)
    for row, along in zip(row_names(name, element), _ROLLING, strict=True):
        yield ContactRow(row, skins, along, across, flat)


def _rolling_skins(name: str, element: Rolling, references: References, flat: bool) -> SurfacePair:
    """Return the surfaces of a wheel and of its track. Raises ModelError for a body that does not roll there."""
    wrong = gathered()
    with wrong, at("body"):
        wheels = [skin for _, skin in solid_of(element.body, references, flat=flat).skins]
        if len(wheels) != 1 or not (is_curved(wheels[0]) or isinstance(wheels[0], (Rim, Bent))):
            what = "a plane" if wheels[0].plane is not None else "neither a ball nor a disc"
            raise ModelError(f"{element.body} is {what}; a ball or a disc rolls", number="M112")
    with wrong, at("on"):
        word, under = solid_of(element.on, references, flat=flat).skins[0]
        if word or is_point(under):
            raise ModelError(f"{element.on} is neither a plane nor round; name a surface to roll on", number="M114")
    wrong.told()
    with at("on"):
        if not _may_touch(wheels[0], under):
            raise ModelError(_cannot_touch(wheels[0], under, f"{element.body} and {element.on}"), number="M114")
    wheel = replace(wheels[0], rolls=True) if isinstance(wheels[0], Rim) else wheels[0]
    return surfaces_with_feet(name, (wheel, under), references)


def _elements(
    name: str, path: tuple[str, str], contact: Contact, references: References, flat: bool
) -> Iterator[LawElement]:
    """Yield the contacts of all parts of both ends that may meet."""
    with at("between"):
        verify_bodies(contact.between, references.system)
        solids = []
        for k, reference in enumerate(contact.between):
            with at(k):
                solids.append(solid_of(reference, references, flat=flat))
                _verify_crossed(reference, solids[-1], references.system)
        meeting = list(_meetings(solids[0], solids[1], contact.between))
        if len(meeting) > 1 and any(isinstance(skin, Bent) for _, skins, _ in meeting for skin in skins):
            names = ", ".join(filter(None, (word for words, _, _ in meeting for word in words)))
            message = f"one part touches a curve in a contact, and here are {names}; give each a contact of its own"
            raise ModelError(message, number="M114")
    # fields that have no meaning for these surfaces
    pairs = [skins for _, skins, _ in meeting]
    if contact.tangent is not None and all(plane_of(skins) is None for skins in pairs):
        raise ModelError("a tangent is given for planes; other surfaces have none that stays", number="M114").under(
            "tangent"
        )
    if contact.rolling_resistance is not None and not any(map(_rolls, pairs)):
        message = "discs and spheres roll; nothing here does: give them a radius, or leave rolling_resistance out"
        raise ModelError(message, number="M114").under("rolling_resistance")
    both_end = all(len(solid.skins) > 1 and "" in dict(solid.skins) for solid in solids)
    unnamed = _ALONE if both_end else ""
    for words, skins, inner in meeting:
        first, second = (word or unnamed for word in words)
        words, skins = (first, second), surfaces_with_feet(name, skins, references)
        part = name if len(meeting) == 1 else ".".join((name, *(list(filter(None, words)) or [_ALONE])))
        across = _across(name, contact, skins, references, flat)
        both = _Meeting(part, ContactRow(part, skins, "normal", across, flat, inner), flat)
        yield LawElement(
            part,
            "contact",
            path,
            (replace(both.row, name=f"{part}.normal"),),
            frictions=tuple(_frictions(both, contact)),
            restitution=contact.restitution or ZERO,
            collides=contact.restitution is not None,
            tangential_restitution=contact.tangential_restitution or ZERO,
            group=name,
            open=contact.open,
        )


def _meetings(
    first: Solid, second: Solid, between: tuple[str, ...]
) -> Iterator[tuple[tuple[str, str], SurfacePair, Marker | None]]:
    """Yield pairs of parts of two solids that may touch: names, surfaces, and a place inside the body of a corner."""
    pairs = list(product(first.skins, second.skins))
    if len(pairs) == 1 and all(is_point(skin) for _, skin in pairs[0]):
        (_, a), (_, b) = pairs[0]
        yield ("", ""), (a, b), None
        return
    if not any(_may_touch(a, b) for (_, a), (_, b) in pairs):
        raise ModelError(_cannot_touch(pairs[0][0][1], pairs[0][1][1], " and ".join(between)), number="M114")
    for (word, a), (other_word, b) in pairs:
        if _may_touch(a, b):
            inner = None
            for face, corner, solid in ((a, b, second), (b, a, first)):
                if (plane := face.plane) is not None and (plane.ends or plane.beside) and is_point(corner):
                    inner = solid.inner
            yield (word, other_word), _facing_once(a, b), inner
    for (word, edge), (other_word, ball) in product(first.edges, second.skins):
        if is_curved(ball) and _may_touch(edge, ball):
            yield (word, other_word), (edge, ball), None
    for (word, ball), (other_word, edge) in product(first.skins, second.edges):
        if is_curved(ball) and _may_touch(ball, edge):
            yield (word, other_word), (ball, edge), None


def _facing_once(a: ContactSurface, b: ContactSurface) -> SurfacePair:
    """Return two skins of which, if they are edges, one says on which side of it the other is.

    It is the second, unless its normal is the usual z and that of the first is another one.
    """
    if not (isinstance(a, Edge) and isinstance(b, Edge)):
        return a, b
    first_usual, second_usual = (edge.facing is None or is_upright(edge.facing) for edge in (a, b))
    if second_usual and not first_usual:
        return a, replace(b, facing=None)
    return replace(a, facing=None), b


def _rolls(skins: SurfacePair) -> bool:
    return any(is_curved(skin) or isinstance(skin, Rim) for skin in skins)


def _frictions(meeting: _Meeting, contact: Contact) -> Iterator[FrictionPart]:
    enough = contact.static == ENOUGH
    given = nodes_among((contact.static, contact.kinetic))
    if enough or given:
        static = BOUNDLESS if enough else given[0]
        kinetic = given[-1] if given else BOUNDLESS
        rows = meeting.rows("friction", _TANGENTS, ContactRow)
        yield FrictionPart(meeting.name, rows, static, kinetic, enough)
    if contact.rolling_resistance is not None and _rolls(meeting.row.skins):
        rows = meeting.rows("rolling", _TURNS, TurningRow)
        yield FrictionPart(f"{meeting.name}.rolling", rows, contact.rolling_resistance, contact.rolling_resistance)


def _usual_across(name: str, skins: SurfacePair, references: References, flat: bool) -> Point | None:
    """Return t1 in the axes of the plane as the start finds it there, None where neither skin is a plane."""
    plane = plane_of(skins)
    if plane is None:
        return None
    normal = plane.normal if plane is skins[1] else opposite(plane.normal)
    constant = references.constants.get(name)
    if constant is None:
        return surface_tangents(normal, flat=flat)[0]
    assert isinstance(constant.measure, TangentAngle)
    across, angle = constant.measure.across, constant.slot  # t1 leads `across` by the angle about the normal
    return add(scale(cos(angle), across), scale(sin(angle), cross(plane.normal, across)))


def _across(name: str, contact: Contact, skins: SurfacePair, references: References, flat: bool) -> Point | None:
    """Return t1 in the axes of the plane, None where neither skin is one."""
    plane = plane_of(skins)
    if plane is None:
        return None
    normal = plane.normal if plane is skins[1] else opposite(plane.normal)
    if contact.tangent is None:
        return _usual_across(name, skins, references, flat)
    usual, _ = surface_tangents(normal, flat=flat)
    lying = subtract(contact.tangent, scale(dot(contact.tangent, normal), normal))
    side = sample_value(dot(contact.tangent, usual) if flat else dot(lying, lying), references.parameters)
    with at("tangent"):
        if not abs(side) > (_ALONG_NORMAL if flat else _ALONG_NORMAL**2):
            raise ModelError("it leads along the normal; give a direction along the surface", number="M114")
    if not flat:
        return unit_vector(lying)
    return usual if side > 0 else opposite(usual)


def verify_bodies(between: tuple[str, ...], system: System) -> None:
    """Raise ModelError for a body against itself, or against one that it is welded to."""
    names = []
    for k, reference in enumerate(between):
        with at(k):
            names.append(body_part(reference, system.bodies)[0])
    first, second = names
    if first == second:
        raise ModelError(f"{first} cannot touch itself; name two bodies", number="M114")
    welds = {
        body_part(joint.child, system.bodies)[0]: body_part(joint.parent, system.bodies)[0]
        for joint in system.joints.values()
        if isinstance(joint, Fixed) and not joint.cut
    }
    if _rigid(first, welds) == _rigid(second, welds):
        raise ModelError(f"{first} and {second} are welded to each other and can neither touch nor part", number="M114")


def _verify_crossed(reference: str, solid: Solid, system: System) -> None:
    """Raise ModelError for a plane with the normal z where nothing moves along z, and so nothing can leave it."""
    (_, skin), *others = solid.skins
    if not others and skin.plane is not None and is_upright(skin.plane.normal) and moves_in_plane(system):
        raise ModelError(
            f"{reference} has the normal z, and all joints here move in the xy-plane: nothing can leave it or press on "
            "it. Give it the normal that it has in that plane (surfaces: {..: {plane: .., normal: y}}; without one it "
            "is z), or a joint with a coordinate along z",
            number="M114",
        )


def _rigid(body: str, welds: Mapping[str, str]) -> str:
    seen: set[str] = set()
    while body in welds and body not in seen:
        seen.add(body)
        body = welds[body]
    return body


def _may_touch(a: ContactSurface, b: ContactSurface) -> bool:
    """Return whether two skins have a normal between them, and one place where they touch."""
    flats = a.plane is not None, b.plane is not None
    hollow = [isinstance(x, RoundSurface) and x.inside for x in (a, b)]
    if isinstance(a, Level) or isinstance(b, Level):
        return is_point(a) or is_point(b)
    if isinstance(a, Edge) or isinstance(b, Edge):
        other = b if isinstance(a, Edge) else a
        return isinstance(other, Edge) or (is_curved(other) and not any(hollow))
    if isinstance(a, Bent) or isinstance(b, Bent):
        other = a if isinstance(b, Bent) else b
        endless = other.plane is not None and other.plane.ends is None
        outlines = all(x.closed for x in (a, b) if isinstance(x, Bent))
        return endless or (isinstance(other, (RoundSurface, Bent)) and (outlines or not any(hollow)))
    if any(flats):
        return not all(flats) and not any(hollow)
    if isinstance(a, Rim) or isinstance(b, Rim):
        return False
    return not all(hollow) and not (is_point(a) and is_point(b))


def _cannot_touch(a: ContactSurface, b: ContactSurface, both: str) -> str:
    if a.plane is not None and b.plane is not None:
        return (
            f"{both} are two planes, which have no one place where they touch; name points or a round surface of one "
            "body, or give it shape: {box: ..}, whose corners touch"
        )
    if all(isinstance(x, Edge) or x.plane is not None for x in (a, b)):
        return (
            f"{both}: a plane is touched by points and round surfaces, not by an edge; name its body by itself, whose "
            "corners or ends touch"
        )
    if isinstance(a, Edge) or isinstance(b, Edge):
        return (
            f"{both}: in space the side of a bar and an edge touch other bars, edges and balls; name one of these, "
            "or give the other one {sphere: r}"
        )
    if isinstance(a, Bent) or isinstance(b, Bent):
        return (
            f"{both}: a curve is touched by points, discs and outlines of bodies, and by planes that do not end; the "
            "inside of a disc is touched by outlines, not by curves that end nowhere; name one of these"
        )
    if isinstance(a, Rim) or isinstance(b, Rim):
        return f"{both}: in space the rim of a disc touches planes only; name a plane, or give it a sphere"
    if isinstance(a, Level) or isinstance(b, Level):
        return f"{both}: points lie on a surface of revolution, nothing else does; name a point"
    return f"{both}: one of them is hollow, and what is inside it is touched from outside; {_HOLLOW}"


# ----------------------------------------------------------------------------------------------------------------------
# Feet: massless frames that follow the places where curves are touched, each with the curve's parameter as coordinate.
#
# The contact of a curve with something else takes the curve's tangent and normal from its foot, whose row says that it
# is where the other one is nearest. So all is made of known rows with exact derivatives, and nothing is solved for
# within.


def with_feet(system: System) -> System:
    """Return a system with the feet of all curves that are touched or guide points, each a body and a joint."""
    made = _Made(system, dict(system.bodies), dict(system.joints))
    constraints = system.constraints.items()
    pairs = [(name, contact.between) for _, name, contact in copies(system.contacts)]
    pairs += [(name, (element.body, element.on)) for name, element in constraints if isinstance(element, Rolling)]
    for owner, between in pairs:
        found = [(end, *guide) for end, reference in enumerate(between) if (guide := _guide(reference, system))]
        for end, body, surface in found:
            assert surface.guide is not None
            (x, y, _), (cx, cy, _) = surface.guide.place, surface.centre
            name, unit = surface.guide.leaf.data[1]
            curve = Curve(x=x + cx, y=y + cy, parameter=name, unit=unit)
            word = f"foot{end + 1}" if len(found) > 1 else "foot"
            made.add(owner, word, body, curve, between, end, turns="tangent")
    for owner, element in constraints:
        if isinstance(element, OnCurve):
            with at("constraints", owner, "on"):
                name, part = body_part(element.on, system.bodies)
                carrier = system.bodies.get(name, BARE)
                if part and part not in (*OWN_POINTS, *carrier.points, *carrier.frames):
                    raise no_part(name, part, carrier)
            made.add(owner, "foot", element.on, element.curve, (element.point, element.on), 1, turns=None)
    if len(made.joints) == len(system.joints):
        return system
    return replace(system, bodies=Names(made.bodies), joints=Names(made.joints))


def _guide(reference: str, system: System) -> tuple[str, Surface] | None:
    """Return the body and the surface of an end that is a curve: named, or the only one that its body has."""
    try:
        name, part = body_part(reference, system.bodies)
    except ModelError:  # raised where the contact is made of both ends
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
