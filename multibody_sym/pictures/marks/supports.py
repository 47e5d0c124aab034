"""Supports: what stands on ground: triangles and stems that end on hatched lines, on the side where nothing is held."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.place_symbols import WHEEL
from multibody_sym.pictures.marks.ropes import drawn_pieces, place_of, wheel_centre
from multibody_sym.pictures.marks.sheet import Sheet, left, unit2
from multibody_sym.pictures.page.picture import (
    BODY,
    BOLD,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_JOINT,
    PAPER,
    PIN,
    ROD,
    SUPPORT,
    Arc,
    Hatch,
    Mark,
    Stroke,
)
from multibody_sym.pictures.scene.items import Face, Item, Polyline, Rail, Symbol
from multibody_sym.scalars.arrays import Floats

_STEP: Final = 46.0
"""How long a step of ground is drawn (pt)."""
_ROLLER: Final = 2.2
"""The radius of the wheels of a support (pt)."""
_STRUCK: Final = 8.0
"""Half the length of what is struck (pt)."""


def support(sheet: Sheet, item: Any, at: Floats, away: Floats, named: dict[str, Any]) -> Iterator[Mark]:
    """Yield a triangle on hatched ground under a place, for an item or a strand."""
    across, foot, pen = left(away), at + SUPPORT * away, sheet.pen(item)
    corners = np.array([at, foot + 0.6 * SUPPORT * across, foot - 0.6 * SUPPORT * across])
    yield Stroke(corners, pen, closed=True, fill=PAPER, **named)
    ends = np.array([foot - SUPPORT * across, foot + SUPPORT * across])
    yield Hatch(ends, pen, side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)


def support_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the support of a beam: a pin on a triangle, which stands on two wheels where it is a roller."""
    at, away = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along))
    named, pen, across = sheet.named(item, LAYER_GROUND + 0.5), sheet.pen(item), left(away)
    rolls = symbol.kind == "roller"
    foot = at + (SUPPORT - 2.0 * _ROLLER * rolls) * away
    corners = np.array([at, foot + 0.6 * SUPPORT * across, foot - 0.6 * SUPPORT * across])
    yield Stroke(corners, pen, closed=True, fill=PAPER, **named)
    for way in (-0.4, 0.4) if rolls else ():
        yield Arc(foot + _ROLLER * away + way * SUPPORT * across, _ROLLER, pen, fill=PAPER, **named)
    ends = at + SUPPORT * away + np.outer([SUPPORT, -SUPPORT], across)
    yield Hatch(ends, pen, side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)
    yield Arc(at, PIN, pen, fill=PAPER, **sheet.named(item, LAYER_JOINT))


def struck_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a hatched line where the edge of what strikes it comes to."""
    at, away = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along))
    rods = (i.form for i in sheet.touched.get(item.bodies[1], ()) if i.role == "body")
    half = ROD / 2 if any(isinstance(form, Polyline) and not form.closed for form in rods) else 0.0
    ends = at + (half + BOLD.width / 2) * away + np.outer([_STRUCK, -_STRUCK], left(away))
    side = 1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1
    yield Hatch(ends, sheet.pen(item, BOLD), side=side, **sheet.named(item, LAYER_GROUND))


def support_side(sheet: Sheet, item: Item, at: Floats) -> Floats:
    """Return the direction in which a support stands: down, or up where what it carries hangs."""
    hanging = 0.0
    for body in item.bodies:
        if body < 0:
            continue
        for other in sheet.touched.get(body, ()):
            points = sheet.projection.page(sheet.home.world(body, other.form.bounds)) - at
            hanging += float((points @ sheet.down).mean())
    return -sheet.down if hanging > 6.0 else sheet.down


def stand(sheet: Sheet, item: Item, at: Floats, away: Floats, length: float) -> Iterator[Mark]:
    """Yield a short stem that ends on hatched ground."""
    named, across, foot = sheet.named(item, LAYER_GROUND + 0.5), left(away), at + length * away
    yield Stroke(np.array([at, foot]), sheet.pen(item, BOLD), **named)
    ends = np.array([foot - 8.0 * across, foot + 8.0 * across])
    yield Hatch(ends, sheet.pen(item), side=1 if float(left(ends[1] - ends[0]) @ away) > 0 else -1, **named)


def step_marks(sheet: Sheet, item: Item, at: Floats) -> Iterator[Mark]:
    """Yield the step from a plane of ground up to a point of ground that a body touches, such as a kerb."""
    if not sheet.flat or item.body not in sheet.ground:
        return
    for contact in (i for i in sheet.scene.items if i.role == "contact" and item.name in i.touching):
        other = next((body for body in contact.bodies if body not in sheet.ground), None)
        for face in (i for i in sheet.scene.items if isinstance(i.form, Face) and i.body == item.body):
            if other is None or not isinstance(face.form, Face):
                continue
            normal = unit2(sheet.way(face.body, face.form.normal))
            height = float((at - sheet.through(face, face.form)) @ normal)
            away = left(normal) * (1.0 if float((at - sheet.at(other, (0.0, 0.0, 0.0))) @ left(normal)) > 0.0 else -1.0)
            if height > 1.0:
                points = np.array([at - height * normal, at, at + _STEP * away])
                inside = float(left(points[1] - points[0]) @ away) > 0.0
                named = sheet.named(item, LAYER_GROUND)
                yield Hatch(points, sheet.pen(item, BOLD), side=1 if inside else -1, **named)
                return


# ----------------------------------------------------------------------------------------------------------------------
# Pulleys: their axles and what holds them, and small wheels where a rope bends at a point.


def pulley_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a small wheel in the bend of the rope that runs over a point."""
    centre, named = wheel_centre(sheet, item), sheet.named(item, LAYER_BODY, symbol.at)
    at = place_of(sheet, item, symbol) if centre is None else centre
    if item.on_ground and not any(lies_on(sheet, item, other) for other in sheet.scene.items):
        yield from stand(sheet, item, at, _held_side(sheet, item, at), WHEEL + 6.0)
    yield Arc(at, WHEEL if centre is not None else 4.0, sheet.pen(item), fill=BODY, **named)
    yield Arc(at, 1.6, sheet.pen(item), fill=PAPER, **named)


def lies_on(sheet: Sheet, pulley: Item, line: Item) -> bool:
    """Return whether a pulley on ground is on the line of a rail or a face of ground, which holds it then."""
    if line.body != pulley.body or pulley.symbol is None or pulley.name in sheet.settled.pulleys:
        return False
    apart = np.subtract(pulley.symbol.at, getattr(line.form, "at", getattr(line.form, "through", (0.0, 0.0, 0.0))))
    if isinstance(line.form, Rail) and not line.form.light:
        across = apart - float(apart @ np.array(line.form.axis)) * np.array(line.form.axis)
    elif isinstance(line.form, Face) and line.form.ends is None and sheet.flat:
        across = float(apart @ np.array(line.form.normal)) * np.array(line.form.normal)
    else:
        return False
    return float(np.linalg.norm(across)) < 1e-6 * sheet.scene.size


def wheels_on(sheet: Sheet, line: Item) -> list[Floats]:
    """Return the centres (2) of the small wheels that a rail or face of ground holds."""
    found = []
    for item in sheet.scene.items:
        if item.role == "pulley" and item.symbol is not None and item.symbol.kind == "pulley":
            centre = wheel_centre(sheet, item) if lies_on(sheet, item, line) else None
            found += [] if centre is None else [centre]
    return found


def held_wheel(sheet: Sheet, at: Floats) -> Floats | None:
    """Return the centre (2) of the small wheel that ground holds at a place of the page, None where there is none."""
    for item in sheet.scene.items:
        if item.role != "pulley" or not item.on_ground or item.symbol is None:
            continue
        if item.symbol.kind == "pulley" and float(np.linalg.norm(sheet.at(item.body, item.symbol.at) - at)) < 1.0:
            return wheel_centre(sheet, item)
    return None


def axle_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the axle of a pulley, held by ground where it is fixed there."""
    named, at = sheet.named(item, LAYER_JOINT, symbol.at), sheet.at(item.body, symbol.at)
    if item.on_ground:
        wheel = next((i.form for i in sheet.scene.items if i.path == item.path and i is not item), None)
        radius = getattr(wheel, "radius", 0.0) * sheet.projection.scale
        side = _held_side(sheet, item, at)
        yield from stand(sheet, item, at, side, radius + 8.0)
    yield Arc(at, PIN, sheet.pen(item), fill=PAPER, **named)


def _held_side(sheet: Sheet, item: Item, at: Floats) -> Floats:
    """Return the side on which a pulley is held: where its ropes do not pull it to."""
    wheel = next((i.form for i in sheet.scene.items if i.path == item.path and i is not item), None)
    reach = float(getattr(wheel, "radius", 0.0)) * sheet.projection.scale + WHEEL
    pull = np.zeros(2)
    for rope in sheet.placed.strands:
        for piece in drawn_pieces(sheet, rope):
            for end, other in ((piece[0], piece[1]), (piece[1], piece[0])):
                if float(np.linalg.norm(end - at)) < 4.0 + reach:
                    pull += unit2(other - end, (0.0, 0.0))
    if float(np.linalg.norm(pull)) < 1e-6:
        return -sheet.down
    sides = [-sheet.down, left(sheet.down), -left(sheet.down), sheet.down]
    return max(sides, key=lambda side: -float(side @ pull) + 0.01 * float(side @ -sheet.down))
