"""Ground where bodies touch it: the supports of a beam, the risers of stairs, what an impact strikes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from typing import Final

import numpy as np

from multibody_sym.errors import ModelError
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.contacts_and_impacts import ENOUGH, Contact, copies
from multibody_sym.pictures.scene.items import Item, Polyline, Symbol, Vector, unit, vector
from multibody_sym.pictures.scene.stage import FrameOnBody, PlacedSystem
from multibody_sym.scalars.arrays import Floats

_NEAR: Final = 1e-6
"""How near to each other (m, by the size of the whole) places touch."""
_WORLD: Final = -1


def support_items(stage: PlacedSystem, bodies: list[Item]) -> Iterator[Item]:
    """Yield the supports of beams: a pin where a rod that lies on a plane never slips, a roller where that is smooth.

    Their items stand in place of the plane's, whose path they have. `bodies` are the items of bodies.
    """
    for word, surface in stage.declared(GROUND).surfaces.items():
        reference = f"{GROUND}.{word}"
        if surface.kind != "plane" or surface.plane is None or surface.between is not None:
            continue
        contacts = [contact for _, _, contact in copies(stage.system.contacts) if reference in contact.between]
        normal = np.array(unit(stage.vector(surface.normal)))
        places = [place for place in (_place(stage, each, reference) for each in contacts) if place is not None]
        if len(places) < max(len(contacts), 2) or len({body for body, _ in places}) != 1:
            continue
        if not all(_holds_still(contact) for contact in contacts) or all(c.static is None for c in contacts):
            continue
        if not _lies_still(stage, places[0][0], bodies, normal):
            continue
        for contact, (_, point) in zip(contacts, places, strict=True):
            if abs(float((np.array(point) - stage.vector(surface.plane)) @ normal)) < _NEAR * stage.lengths["size"]:
                sign = Symbol("roller" if contact.static is None else "support", point, along=vector(-normal))
                yield Item("ground", reference, "", (*_surfaces(), word), _WORLD, sign, on_ground=True)


def _surfaces() -> tuple[str, ...]:
    return "bodies", GROUND, "surfaces"


def _place(stage: PlacedSystem, contact: Contact, reference: str) -> tuple[int, Vector] | None:
    """Return the body and the place in the world of the point that touches a surface; None of a surface."""
    (end,) = (each for each in contact.between if each != reference)
    try:
        place = stage.place(end)
    except ModelError:
        return None
    return place.body, vector(stage.world(place.body, place.point))


def _holds_still(contact: Contact) -> bool:
    """Return whether a contact is that of a support: it never slips, or it is smooth, and nothing bounces from it."""
    return contact.static in (None, ENOUGH) and contact.kinetic is None and contact.restitution is None


def _lies_still(stage: PlacedSystem, body: int, bodies: list[Item], normal: Floats) -> bool:
    """Return whether a body is a rod along a plane that does not move at the start."""
    forms = [item.form for item in bodies if item.body == body and item.role == "body"]
    if len(forms) != 1 or not isinstance(forms[0], Polyline) or forms[0].closed:
        return False
    heights = [float(stage.world(body, point) @ normal) for point in forms[0].points]
    moving = stage.motion.bodies[body]
    still = float(np.abs([*moving.v_WB, *moving.w_WB]).max()) < _NEAR
    return still and float(np.ptp(heights)) < _NEAR * stage.lengths["size"]


def riser_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the upright faces of stairs: where a tread, a level segment of ground, ends above the end of the next."""
    down = -np.array([0.0, 1.0, 0.0]) if not np.any(stage.gravity) else np.array(unit(stage.gravity))
    treads = []
    for surface in stage.declared(GROUND).surfaces.values():
        if surface.segment is not None:
            ends = [np.array(stage.vector(end)) for end in stage.declared(GROUND).ends(surface.segment)]
            if abs(float((ends[1] - ends[0]) @ down)) < _NEAR * stage.lengths["size"]:
                treads.append(ends)
    for upper, lower in permutations(treads, 2):
        for top, other in permutations(upper):
            for foot, far in permutations(lower):
                height, onward = float((foot - top) @ down), float((top - other) @ (far - foot))
                aside = float(np.linalg.norm(foot - top - height * down))
                if height > 0.0 and onward > 0.0 and aside < _NEAR * stage.lengths["size"]:
                    # hatched, as all lines of ground are, to the right of its way, where the upper tread is
                    right = float(np.cross(foot - top, other - top)[2]) < 0.0
                    points = (vector(top), vector(foot)) if right else (vector(foot), vector(top))
                    yield Item("surface", "riser", "", ("bodies", GROUND), _WORLD, Polyline(points), on_ground=True)


def struck_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield what stands still and is struck by a point of a body in a declared impact."""
    for name, impact in (stage.system.impact.strikes if stage.system.impact is not None else {}).items():
        if impact.between is None:
            continue
        first, second = (stage.place(end) for end in impact.between)
        body, still, side = (first, second, -1.0) if second.body == _WORLD else (second, first, 1.0)
        if still.body != _WORLD or body.body == _WORLD:
            continue
        speed = velocity_of(stage, body)
        way = speed if impact.normal is None else side * np.array(stage.vector(impact.normal))
        ahead = unit(-way if float(way @ speed) < 0.0 else way)
        sign = Symbol("struck", still.point, along=ahead)
        assert stage.system.impact is not None
        yield Item("ground", name, "", stage.system.impact.path(name), _WORLD, sign, (_WORLD, body.body), True)


def edge_items(stage: PlacedSystem) -> Iterator[Item]:
    """Yield the edges of ground, such as of a table, that straight surfaces of bodies touch where no plane is."""
    if any(surface.kind == "plane" for surface in stage.declared(GROUND).surfaces.values()):
        return  # the edge is a step of that plane
    for declared, name, contact in copies(stage.system.contacts):
        for end, other in (contact.between, contact.between[::-1]):
            body, word = stage.body(other), other.rpartition(".")[2]
            surface = stage.declared(body).surfaces.get(word)
            point = stage.declared(GROUND).points.get(end.removeprefix(f"{GROUND}."))
            if point is not None and surface is not None and surface.kind in ("plane", "segment") and surface.normal:
                number = stage.number_of(body)
                away = vector(stage.turned(number, unit(stage.vector(surface.normal))))
                if abs(away[2]) < _NEAR:
                    sign = Symbol("struck", stage.vector(point), along=away)
                    yield Item("ground", name, "", ("contacts", declared), _WORLD, sign, (_WORLD, number), True)


def velocity_of(stage: PlacedSystem, place: FrameOnBody) -> Floats:
    """Return the velocity of a place of a body at the start (3), in the world."""
    moving = stage.motion.bodies[place.body]
    own = np.array(moving.v_WB, dtype=float) + np.cross(np.array(moving.w_WB, dtype=float), place.point)
    return stage.turned(place.body, own)
