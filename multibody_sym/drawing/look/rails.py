"""Rails of sliders: a line with hatching below the block, two where nothing presses it down, a thin one on a body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.drawing.look.pulleys import wheels_on
from multibody_sym.drawing.look.settle import MASS, WHEEL
from multibody_sym.drawing.look.shapes import capsule, wedge
from multibody_sym.drawing.look.sheet import Sheet, left, unit2
from multibody_sym.drawing.look.wedges import LEVEL, slope_of, wedge_under
from multibody_sym.drawing.picture import Hatch, Mark, Stroke
from multibody_sym.drawing.style import AXIS, BLOCK, BODY, BOLD, INK, LAYER_GROUND
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import Barrel, Block, Disc, Face, Polyline, Rail, Symbol, Vector, vector
from multibody_sym.scene.items import Item

_BEYOND: Final = 20.0
"""How far a rail goes on behind the last place of its block (pt)."""


_PARALLEL: Final = 0.99
_SLEEVE: Final = 16.0
"""How far (pt) a slider in space is shown from the sign of another joint."""
_HALF: Final = 12.0
"""Half the length of a block (pt)."""


def block_size(sheet: Sheet, item: Item) -> tuple[float, float]:
    """Return the length and height (pt) of a block: that of a mass of its own, or of a slider on a larger body."""
    own = item.role == "body" or any(
        other.role == "body" and isinstance(other.form, Symbol) and other.form.kind == "block"
        for other in sheet.touched.get(item.body, ())
    )
    return MASS if own else BLOCK


def is_covered(sheet: Sheet, item: Item) -> bool:
    """Return whether a slider's body shows itself at the slider: by a block, a box or another form that is no rod."""
    for other in sheet.touched.get(item.body, ()):
        if other.role not in ("body", "surface"):
            continue
        if isinstance(other.form, Polyline) and not other.form.closed:
            continue
        return True
    return False


def sleeve_place(sheet: Sheet, item: Item, symbol: Symbol) -> Vector:
    """Return where on its body a slider is shown in space: towards what it slides on where another joint's sign is."""
    at = sheet.at(item.body, symbol.at)
    others = (i for i in sheet.scene.items if i.role == "joint" and i.path != item.path and item.body in i.bodies)
    signs = (sheet.at(i.body, i.form.at) for i in others if isinstance(i.form, Symbol))
    rail = next((i for i in sheet.scene.items if i.path == item.path and isinstance(i.form, Rail)), None)
    if rail is None or all(float(np.linalg.norm(sign - at)) > _SLEEVE for sign in signs):
        return symbol.at
    back = sheet.at(rail.body, rail.form.bounds[0]) - at
    way = np.sign(float(back @ sheet.way(item.body, symbol.axis))) * sheet.metres(_SLEEVE)
    return vector(np.add(symbol.at, way * np.array(symbol.axis)))


def rail_marks(sheet: Sheet, item: Item, rail: Rail) -> Iterator[Mark]:
    """Yield what a slider runs along."""
    along = unit2(sheet.way(item.body, rail.axis))
    if float(np.linalg.norm(sheet.way(item.body, rail.axis))) < 0.05:
        return
    named, points = sheet.named(item, LAYER_GROUND, rail.at), rail_ends(sheet, item, rail)
    named["role"] = "joint"
    if rail.light and not item.on_ground:
        return  # the spring or rope is seen on which something hangs
    if rail.light or not sheet.flat or not item.on_ground:
        if item.on_ground and not rail.light:
            below = 1 if float(left(points[1] - points[0]) @ sheet.down) > 0.0 else -1
            yield Hatch(points, sheet.pen(item, BOLD), side=below, **named)
            return
        yield Stroke(points, sheet.pen(item, AXIS if rail.light else INK), **named)
        return
    for side, shifted in _lines(sheet, item, along, points):
        turn = 1 if float(left(shifted[1] - shifted[0]) @ side) > 0.0 else -1
        yield Hatch(shifted, sheet.pen(item, BOLD), side=turn, **named)
        for centre in wheels_on(sheet, item):
            near = min(shifted, key=lambda end: float(np.linalg.norm(end - centre)))
            yield bracket(sheet, item, near, centre)


def rail_lines(sheet: Sheet, item: Item) -> list[Floats]:
    """Return the lines (2, 2) by which a rail is seen in the plane."""
    assert isinstance(item.form, Rail)
    along, points = unit2(sheet.way(item.body, item.form.axis)), rail_ends(sheet, item, item.form)
    if item.form.light or not item.on_ground:
        return [points]
    return [line for _, line in _lines(sheet, item, along, points)]


def _lines(sheet: Sheet, item: Item, along: Floats, points: Floats) -> list[tuple[Floats, Floats]]:
    return [(side, points + offset * side) for side, offset in _sides(sheet, item, along)]


def bracket(sheet: Sheet, item: Item, end: Floats, centre: Floats) -> Mark:
    """Return the bar that holds a wheel at the end of what a block slides on."""
    return Stroke(capsule(end, centre, 3.0), sheet.pen(item), closed=True, fill=BODY, **sheet.named(item, LAYER_GROUND))


def rail_ends(sheet: Sheet, item: Item, rail: Rail) -> Floats:
    """Return from where to where (2, 2) a rail is drawn: near a slider alone where a joint stands at its beginning."""
    ends, along = sheet.page(item.body, rail.bounds), unit2(sheet.way(item.body, rail.axis))
    shift = sheet.settled.bodies.get(_child(item), np.zeros(2)) if rail.light else np.zeros(2)
    places = [float((place - shift) @ along) for place in _block_places(sheet, item)]
    if not places or not (_is_taken(sheet, item, rail) or _is_sprung(sheet, item, along)):
        places += list(ends @ along)
    base = ends[0] - float(ends[0] @ along) * along + shift
    back, ahead = _reach(sheet, item, along)
    low, high = min(places) + back - _BEYOND, max(places) + ahead + _BEYOND
    for centre in wheels_on(sheet, item):
        way = float(centre @ along)
        if way > (low + high) / 2:
            high = way - WHEEL - 3.0
        else:
            low = way + WHEEL + 3.0
    return np.array([base + low * along, base + high * along])


def _reach(sheet: Sheet, item: Item, along: Floats) -> tuple[float, float]:
    """Return how far what slides reaches along its rail beyond half a block, back and ahead (pt)."""
    child = _child(item)
    here = next(iter(_block_places(sheet, item)), None)
    low, high = 0.0, 0.0
    for other in sheet.touched.get(child, ()):
        if here is None or other.role != "body" or not isinstance(other.form, (Face, Block, Barrel, Disc, Symbol)):
            continue
        form = other.form
        if isinstance(form, Symbol):
            points = wedge_corners(sheet, other, form)
        else:
            points = wedge(sheet, other, form) if isinstance(form, Face) else sheet.page(child, form.bounds)
        ways = (points - here) @ along
        low, high = min([low, *(ways + _HALF)]), max([high, *(ways - _HALF)])
    return low, high


def _is_sprung(sheet: Sheet, item: Item, along: Floats) -> bool:
    """Return whether a spring or damper runs along the rail: it would be hidden between two lines."""
    for placed in sheet.placed.strands:
        bodies = {anchor.body for anchor in placed.strand.anchors}
        if bodies == {item.body, _child(item)} and placed.strand.kind in ("spring", "damper", "spring_damper"):
            first, last = sheet.projection.page(placed.pieces[0][0]), sheet.projection.page(placed.pieces[-1][1])
            return abs(float(unit2(last - first) @ along)) > _PARALLEL
    return False


def _is_taken(sheet: Sheet, item: Item, rail: Rail) -> bool:
    """Return whether another joint stands on ground where the rail begins."""
    at = sheet.at(item.body, rail.at)
    others = (i for i in sheet.scene.items if i.role == "joint" and i.body == item.body and i.path != item.path)
    places = (sheet.at(i.body, i.form.at) for i in others if isinstance(i.form, Symbol))
    return any(float(np.linalg.norm(place - at)) < 3.0 for place in places)


def _child(item: Item) -> int:
    """Return the body that slides on a rail."""
    return item.bodies[1] if item.bodies and item.bodies[1] != item.body else item.bodies[0]


def _sides(sheet: Sheet, item: Item, along: Floats) -> list[tuple[Floats, float]]:
    """Return the sides on which a block is guided, with how far from its middle: below, or both where it hangs."""
    across = left(along)
    pressed = float(across @ sheet.down)
    if pressed < 0.0:
        across, pressed = -across, -pressed
    has_gravity = bool(np.any(sheet.scene.gravity))
    low, high = _extent(sheet, item, across)
    if has_gravity and pressed < 0.2:
        return [(across, high), (-across, -low)]
    return [(across, high)]


def _extent(sheet: Sheet, item: Item, across: Floats) -> tuple[float, float]:
    """Return from where to where the block reaches across its rail (pt, from the rail's middle)."""
    child = _child(item)
    assert isinstance(item.form, Rail)
    middle = float(sheet.at(item.body, item.form.at) @ across)
    found: list[float] = []
    blocks = False
    for other in sheet.touched.get(child, ()):
        if other.role not in ("body", "surface"):
            continue
        if isinstance(other.form, Face):
            found += list(wedge(sheet, other, other.form) @ across - middle)
        elif isinstance(other.form, Symbol):
            blocks = blocks or other.form.kind == "block"
            found += list(wedge_corners(sheet, other, other.form) @ across - middle)
        elif not isinstance(other.form, Polyline) or other.form.closed:
            found += list(sheet.page(child, other.form.bounds) @ across - middle)
    if found:
        return min(found), max(found)
    half = (MASS if blocks else BLOCK)[1] / 2
    return -half, half


def wedge_corners(sheet: Sheet, item: Item, symbol: Symbol) -> Floats:
    """Return the corners (3, 2) of a mass that is drawn as a wedge, none (0, 2) of others."""
    slope = slope_of(sheet, item) if symbol.kind == "block" and sheet.flat else None
    if slope is None or abs(float(slope @ sheet.down)) <= LEVEL:
        return np.zeros((0, 2))
    return wedge_under(sheet, item, sheet.at(item.body, symbol.at), slope)


def _block_places(sheet: Sheet, item: Item) -> list[Floats]:
    """Return where the block of a rail is on the page, where it was at the start, and in a motion is on the way."""
    found = []
    for other in sheet.scene.items:
        if other.path == item.path and other is not item and isinstance(other.form, Symbol):
            own, shift = np.array([other.form.at]), sheet.settled.bodies.get(other.body, np.zeros(2))
            ways = (each.world(other.body, own) for each in (sheet.home, *sheet.others))
            found += [sheet.at(other.body, other.form.at), *(sheet.projection.page(way)[0] + shift for way in ways)]
    return found
