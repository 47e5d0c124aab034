"""Contacts as elements that hold one way only: a normal row each, and rows along which they rub and roll."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Final

from multibody_sym.errors import ModelError, at, gathered
from multibody_sym.model.declaration.constraints import Rolling, row_names
from multibody_sym.model.declaration.contacts import ENOUGH, Contact, copies, without_number
from multibody_sym.model.declaration.joints import Fixed
from multibody_sym.model.declaration.steps import is_upright
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.contact_rows import (
    Bent,
    ContactDirection,
    ContactRow,
    Edge,
    Flat,
    Level,
    Rim,
    Round,
    Skin,
    TurningRow,
    is_curved,
    is_point,
)
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.model.mechanism.one_way import BOUNDLESS, FrictionPart, OneWay
from multibody_sym.model.mechanism.start_constants import TangentAngle
from multibody_sym.model.resolution.contacts.samples import sample_value
from multibody_sym.model.resolution.contacts.skins import Solid, solid_of
from multibody_sym.model.resolution.guides.rows import footed
from multibody_sym.model.resolution.plane import in_plane, moves_in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.model.resolution.surface_tangents import surface_tangents, turned_tangents
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.vectors import dot, negate, scale, subtract

_TANGENTS: Final[tuple[ContactDirection, ...]] = ("t1", "t2")
_ROLLING: Final[tuple[ContactDirection, ...]] = ("normal", "t1", "t2")
_TURNS: Final[tuple[ContactDirection, ...]] = ("roll1", "roll2")
_ALONG_NORMAL: Final = 1e-9
_ALONE: Final = "face"
"""The word for the face of a plane that ends, beside the words for its ends."""
_HOLLOW: Final = "name points, discs or spheres of the other one"


@dataclass(frozen=True)
class _Meeting:
    """Two skins that may touch: the name of their contact, and what its rows have in common."""

    name: str
    row: ContactRow
    flat: bool

    def rows(self, word: str, along: tuple[ContactDirection, ...], kind: type[ContactRow]) -> tuple[ContactRow, ...]:
        """Return the row along the first direction in a plane model, or rows along both."""
        if self.flat:
            along = along[:1]
        names = [f"{self.name}.{word}" + (str(k) if len(along) > 1 else "") for k in range(1, len(along) + 1)]
        r = self.row
        return tuple(kind(name, r.skins, d, r.across, r.upright, r.inner) for name, d in zip(names, along, strict=True))


def contacts(references: References) -> tuple[OneWay, ...]:
    """Return the contacts of a system. Raises ModelError, with the place, for what cannot touch."""
    system = references.system
    flat = references.plane or in_plane(system)
    found: list[OneWay] = []
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


def _together(declared: str, copies: Sequence[tuple[OneWay, ...]], taken: set[str]) -> Iterator[OneWay]:
    """Yield contacts that repeat, as the legs of one table: those of one part each between the same two bodies.

    Like corners their forces have a sum, under the name that is declared.
    """
    bodies = {_bodies(element) for copy in copies for element in copy}
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


def _rolling_skins(name: str, element: Rolling, references: References, flat: bool) -> tuple[Skin, Skin]:
    """Return the skins of what rolls, and of what it rolls on. Raises ModelError for what does not roll there."""
    wrong = gathered()
    with wrong, at("body"):
        wheels = [skin for _, skin in solid_of(element.body, references, flat=flat).skins]
        if len(wheels) != 1 or not (is_curved(wheels[0]) or isinstance(wheels[0], (Rim, Bent))):
            what = "a plane" if isinstance(wheels[0], Flat) else "neither a ball nor a disc"
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
    return footed(name, (wheel, under), references)


def _bodies(element: OneWay) -> tuple[int, ...]:
    return tuple(skin.place.body for row in element.normals if isinstance(row, ContactRow) for skin in row.skins)


def _elements(
    name: str, path: tuple[str, str], contact: Contact, references: References, flat: bool
) -> Iterator[OneWay]:
    """Yield the contacts of all parts of both ends that may meet."""
    with at("between"):
        verify_bodies(contact.between, references.system)
        solids = []
        for k, reference in enumerate(contact.between):
            with at(k):
                solids.append(solid_of(reference, references, flat=flat))
                _verify_crossed(reference, solids[-1], references.system)
        meeting = list(_meetings(solids[0], solids[1], contact.between))
        _verify_one(meeting)
    _verify_fields(contact, [skins for _, skins, _ in meeting])
    both_end = all(len(solid.skins) > 1 and "" in dict(solid.skins) for solid in solids)
    unnamed = _ALONE if both_end else ""
    for words, skins, inner in meeting:
        first, second = (word or unnamed for word in words)
        words, skins = (first, second), footed(name, skins, references)
        part = name if len(meeting) == 1 else ".".join((name, *(list(filter(None, words)) or [_ALONE])))
        across = _across(name, contact, skins, references, flat)
        both = _Meeting(part, ContactRow(part, skins, "normal", across, flat, inner), flat)
        yield OneWay(
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


def _verify_one(meeting: Sequence[tuple[tuple[str, str], tuple[Skin, Skin], Marker | None]]) -> None:
    """Raise ModelError for several parts that may touch one curve, which has one foot for each contact."""
    if len(meeting) > 1 and any(isinstance(skin, Bent) for _, skins, _ in meeting for skin in skins):
        names = ", ".join(filter(None, (word for words, _, _ in meeting for word in words)))
        raise ModelError(
            f"one part touches a curve in a contact, and here are {names}; give each a contact of its own",
            number="M114",
        )


def _meetings(
    first: Solid, second: Solid, between: tuple[str, ...]
) -> Iterator[tuple[tuple[str, str], tuple[Skin, Skin], Marker | None]]:
    """Yield which parts of two solids may touch: their names, skins, and a place inside what has the corner there."""
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
                if isinstance(face, Flat) and (face.ends or face.beside) and is_point(corner):
                    inner = solid.inner
            yield (word, other_word), _facing_once(a, b), inner
    for (word, edge), (other_word, ball) in product(first.edges, second.skins):
        if is_curved(ball) and _may_touch(edge, ball):
            yield (word, other_word), (edge, ball), None
    for (word, ball), (other_word, edge) in product(first.skins, second.edges):
        if is_curved(ball) and _may_touch(ball, edge):
            yield (word, other_word), (ball, edge), None


def _facing_once(a: Skin, b: Skin) -> tuple[Skin, Skin]:
    """Return two skins of which, if they are edges, one says on which side of it the other is.

    It is the second, unless its normal is the usual z and that of the first is another one.
    """
    if not (isinstance(a, Edge) and isinstance(b, Edge)):
        return a, b
    if _is_usual(b) and not _is_usual(a):
        return a, replace(b, facing=None)
    return replace(a, facing=None), b


def _is_usual(edge: Edge) -> bool:
    return edge.facing is None or is_upright(edge.facing)


def _verify_fields(contact: Contact, meeting: Sequence[tuple[Skin, Skin]]) -> None:
    """Raise ModelError for what is declared of a contact that has no use for it."""
    if contact.tangent is not None and not any(isinstance(skin, Flat) for skins in meeting for skin in skins):
        raise ModelError("a tangent is given for planes; other surfaces have none that stays", number="M114").under(
            "tangent"
        )
    if contact.rolling_resistance is not None and not any(map(_rolls, meeting)):
        message = "discs and spheres roll; nothing here does: give them a radius, or leave rolling_resistance out"
        raise ModelError(message, number="M114").under("rolling_resistance")


def _rolls(skins: tuple[Skin, Skin]) -> bool:
    return any(is_curved(skin) or isinstance(skin, Rim) for skin in skins)


def _frictions(meeting: _Meeting, contact: Contact) -> Iterator[FrictionPart]:
    enough = contact.static == ENOUGH
    given = [x for x in (contact.static, contact.kinetic) if isinstance(x, Node)]
    if enough or given:
        static = BOUNDLESS if enough else given[0]
        kinetic = given[-1] if given else BOUNDLESS
        rows = meeting.rows("friction", _TANGENTS, ContactRow)
        yield FrictionPart(meeting.name, rows, static, kinetic, enough)
    if contact.rolling_resistance is not None and _rolls(meeting.row.skins):
        rows = meeting.rows("rolling", _TURNS, TurningRow)
        yield FrictionPart(f"{meeting.name}.rolling", rows, contact.rolling_resistance, contact.rolling_resistance)


def _usual_across(name: str, skins: tuple[Skin, Skin], references: References, flat: bool) -> Point | None:
    """Return t1 in the axes of the plane as the start finds it there, None where neither skin is a plane."""
    plane = next((skin for skin in skins if isinstance(skin, Flat)), None)
    if plane is None:
        return None
    normal = plane.normal if plane is skins[1] else negate(plane.normal)
    constant = references.constants.get(name)
    if constant is None:
        return surface_tangents(normal, flat=flat)[0]
    assert isinstance(constant.measure, TangentAngle)
    return turned_tangents(plane.normal, constant.measure.across, constant.slot)[0]


def _across(name: str, contact: Contact, skins: tuple[Skin, Skin], references: References, flat: bool) -> Point | None:
    """Return t1 in the axes of the plane, None where neither skin is one."""
    plane = next((skin for skin in skins if isinstance(skin, Flat)), None)
    if plane is None:
        return None
    normal = plane.normal if plane is skins[1] else negate(plane.normal)
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
    return usual if side > 0 else negate(usual)


def verify_bodies(between: tuple[str, ...], system: System) -> None:
    """Raise ModelError for a body against itself, or against what it is welded to."""
    names = []
    for k, reference in enumerate(between):
        with at(k):
            names.append(body_part(reference, system.bodies)[0])
    first, second = names
    if first == second:
        raise ModelError(f"{first} cannot touch itself; name two bodies", number="M114")
    welds = _welds(system)
    if _rigid(first, welds) == _rigid(second, welds):
        raise ModelError(f"{first} and {second} are welded to each other and can neither touch nor part", number="M114")


def _verify_crossed(reference: str, solid: Solid, system: System) -> None:
    """Raise ModelError for a plane with the normal z where nothing moves along z, and so nothing can leave it."""
    (_, skin), *others = solid.skins
    if not others and isinstance(skin, Flat) and is_upright(skin.normal) and moves_in_plane(system):
        raise ModelError(
            f"{reference} has the normal z, and all joints here move in the xy-plane: nothing can leave it or press on "
            "it. Give it the normal that it has in that plane (surfaces: {..: {plane: .., normal: y}}; without one it "
            "is z), or a joint with a coordinate along z",
            number="M114",
        )


def _welds(system: System) -> Mapping[str, str]:
    """Return of each body that a weld carries which body it is welded to."""
    return {
        body_part(joint.child, system.bodies)[0]: body_part(joint.parent, system.bodies)[0]
        for joint in system.joints.values()
        if isinstance(joint, Fixed) and not joint.cut
    }


def _rigid(body: str, welds: Mapping[str, str]) -> str:
    seen: set[str] = set()
    while body in welds and body not in seen:
        seen.add(body)
        body = welds[body]
    return body


def _may_touch(a: Skin, b: Skin) -> bool:
    """Return whether two skins have a normal between them, and one place where they touch."""
    flats, hollow = (isinstance(a, Flat), isinstance(b, Flat)), [isinstance(x, Round) and x.inside for x in (a, b)]
    if isinstance(a, Level) or isinstance(b, Level):
        return is_point(a) or is_point(b)
    if isinstance(a, Edge) or isinstance(b, Edge):
        other = b if isinstance(a, Edge) else a
        return isinstance(other, Edge) or (is_curved(other) and not any(hollow))
    if isinstance(a, Bent) or isinstance(b, Bent):
        other = a if isinstance(b, Bent) else b
        endless = isinstance(other, Flat) and other.ends is None
        outlines = all(x.closed for x in (a, b) if isinstance(x, Bent))
        return endless or (isinstance(other, (Round, Bent)) and (outlines or not any(hollow)))
    if any(flats):
        return not all(flats) and not any(hollow)
    if isinstance(a, Rim) or isinstance(b, Rim):
        return False
    return not all(hollow) and not (is_point(a) and is_point(b))


def _cannot_touch(a: Skin, b: Skin, both: str) -> str:
    """Return why two skins that may not touch cannot."""
    if isinstance(a, Flat) and isinstance(b, Flat):
        return (
            f"{both} are two planes, which have no one place where they touch; name points or a round surface of one "
            "body, or give it shape: {box: ..}, whose corners touch"
        )
    if isinstance(a, (Edge, Flat)) and isinstance(b, (Edge, Flat)):
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
