"""Contacts as elements that hold one way only: a normal row each, and rows along which they rub and roll."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.contacts import ENOUGH, Contact
from multibody_sym.model.declaration.joints import Fixed
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.contact_rows import (
    ContactDirection,
    ContactRow,
    Flat,
    Rim,
    Round,
    Skin,
    TurningRow,
    is_curved,
)
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.resolution.contacts.samples import sample_value
from multibody_sym.model.resolution.contacts.skins import skins_of
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.model.resolution.surface_tangents import surface_tangents
from multibody_sym.scalars.node import ZERO, Node
from multibody_sym.scalars.vectors import dot, negate, scale, subtract

_TANGENTS: Final[tuple[ContactDirection, ...]] = ("t1", "t2")
_TURNS: Final[tuple[ContactDirection, ...]] = ("roll1", "roll2")
_ALONG_NORMAL: Final = 1e-9


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
        return tuple(kind(name, r.skins, d, r.across, r.upright) for name, d in zip(names, along, strict=True))


def contacts(references: References) -> tuple[OneWay, ...]:
    """Return the contacts of a system. Raises ModelError, with the place, for what cannot touch."""
    system = references.system
    flat = references.plane or in_plane(system)
    found: list[OneWay] = []
    taken = {*system.constraints, *system.joints}
    for declared, contact in system.contacts.items():
        with at("contacts", declared):
            for name, between in _copies(declared, contact):
                if name in taken:
                    raise ModelError(f"{name!r} is something else too, and results tell both by name; rename one")
                taken.add(name)
                found += _elements(name, declared, replace(contact, between=between, repeat=None), references, flat)
    return tuple(found)


def _copies(name: str, contact: Contact) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the contacts that repeat, `#` in their ends being their number, `#+1` the next."""
    if contact.repeat is None:
        yield name, contact.between
        return
    for k in range(1, contact.repeat + 1):
        yield f"{name}{k}", tuple(end.replace("#+1", str(k + 1)).replace("#", str(k)) for end in contact.between)


def _elements(
    name: str, declared: str, contact: Contact, references: References, flat: bool
) -> Iterator[OneWay]:
    """Yield the contacts of all parts of both ends that may meet."""
    with at("between"):
        _verify_bodies(contact.between, references.system)
    ends = []
    for k, reference in enumerate(contact.between):
        with at("between", k):
            ends.append(skins_of(reference, references, flat=flat))
    for (first, skin), (second, other) in product(*ends):
        part = ".".join(filter(None, (name, first, second)))
        skins = skin, other
        with at("between"):
            _verify_skins(skins, contact.between)
        across = _across(name, contact, skins, references, flat)
        meeting = _Meeting(part, ContactRow(part, skins, "normal", across, flat), flat)
        yield OneWay(
            part,
            "contact",
            ("contacts", declared),
            (replace(meeting.row, name=f"{part}.normal"),),
            frictions=tuple(_frictions(meeting, contact)),
            restitution=contact.restitution,
            group=name,
            open=contact.open,
        )


def _frictions(meeting: _Meeting, contact: Contact) -> Iterator[FrictionPart]:
    enough = contact.static == ENOUGH
    given = [x for x in (contact.static, contact.kinetic) if isinstance(x, Node)]
    if enough or given:
        static = ZERO if enough else given[0]
        kinetic = given[-1] if given else ZERO
        rows = meeting.rows("friction", _TANGENTS, ContactRow)
        yield FrictionPart(meeting.name, rows, static, kinetic, enough)
    if contact.rolling_resistance is not None:
        if not any(is_curved(skin) or isinstance(skin, Rim) for skin in meeting.row.skins):
            message = "discs and spheres roll; nothing here does: give them a radius, or leave rolling_resistance out"
            raise ModelError(message).under("rolling_resistance")
        rows = meeting.rows("rolling", _TURNS, TurningRow)
        yield FrictionPart(f"{meeting.name}.rolling", rows, contact.rolling_resistance, contact.rolling_resistance)


def _across(
    name: str, contact: Contact, skins: tuple[Skin, Skin], references: References, flat: bool
) -> Point | None:
    """Return t1 in the axes of the plane, None where neither skin is one."""
    plane = next((skin for skin in skins if isinstance(skin, Flat)), None)
    if plane is None:
        if contact.tangent is not None:
            raise ModelError("a tangent is given for planes; other surfaces have none that stays").under("tangent")
        return None
    normal = plane.normal if plane is skins[1] else negate(plane.normal)
    usual, _ = surface_tangents(normal, flat=flat)
    if contact.tangent is None:
        return usual
    with at("tangent"):
        if not flat:
            return unit_vector(subtract(contact.tangent, scale(dot(contact.tangent, normal), normal)))
        side = sample_value(dot(contact.tangent, usual), references.parameters)
        if not abs(side) > _ALONG_NORMAL:
            raise ModelError("it leads along the normal; give a direction along the surface")
    return usual if side > 0 else negate(usual)


def _verify_bodies(between: tuple[str, ...], system: System) -> None:
    """Raise ModelError for a body against itself, or against what it is welded to."""
    names = []
    for k, reference in enumerate(between):
        with at(k):
            names.append(body_part(reference, system.bodies)[0])
    first, second = names
    if first == second:
        raise ModelError(f"{first} cannot touch itself; name two bodies")
    welds = _welds(system)
    if _rigid(first, welds) == _rigid(second, welds):
        raise ModelError(f"{first} and {second} are welded to each other and can neither touch nor part")


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


def _verify_skins(skins: tuple[Skin, Skin], between: tuple[str, ...]) -> None:
    """Raise ModelError where two skins have no normal between them, or no place where they touch."""
    first, second = skins
    both = " and ".join(between)
    if isinstance(first, Flat) and isinstance(second, Flat):
        raise ModelError(
            f"{both} are two planes, which have no one place where they touch; name points or a round surface of one "
            "body, or give it shape: {box: ..}, whose corners touch"
        )
    if isinstance(first, Flat) or isinstance(second, Flat):
        return
    if isinstance(first, Rim) or isinstance(second, Rim):
        raise ModelError(f"{both}: in space the rim of a disc touches planes only; name a plane, or give it a sphere")
    if not is_curved(first) and not is_curved(second):
        raise ModelError(
            f"{both} are points, and between points there is no normal; give one of them a surface, such as "
            "surfaces: {face: {plane: [0, 0, 0], normal: y}}, and name it here"
        )
    if all(isinstance(skin, Round) and skin.inside for skin in skins):
        raise ModelError(f"{both} are both hollow; one is inside the other, and that one is touched from outside")
