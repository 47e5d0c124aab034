"""Rails of sliders: a line with hatching below the block, two where nothing presses it down, a thin one on a body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.pictures.marks.ropes import stand, support_side, wheels_on
from multibody_sym.pictures.marks.shapes import SLOPE, barrel, capsule, face_ends, outline_of
from multibody_sym.pictures.marks.sheet import (
    BOB,
    CART_WHEEL,
    MASS,
    STEEPEST,
    WAGON,
    WHEEL,
    Sheet,
    hatched,
    left,
    unit2,
)
from multibody_sym.pictures.page.picture import (
    BLACK,
    BLOCK,
    BODY,
    BOLD,
    DARK,
    HIDDEN,
    LAYER_GROUND,
    LAYER_JOINT,
    PAPER,
    PIN,
    ROD,
    Hatch,
    Mark,
    Stroke,
)
from multibody_sym.pictures.scene.items import (
    BLOCKS,
    Barrel,
    Item,
    Polyline,
    Rail,
    Sphere,
    Stop,
    Symbol,
    TurnStop,
    Vector,
    vector,
)
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Wedges: masses without a size on which another body slides up a slope.


LEVEL = 0.05
"""The slope up to which something is drawn as level."""


def slope_of(sheet: Sheet, item: Item) -> Floats | None:
    """Return the direction on the page of a rail on a block, on which another body slides."""
    for other in sheet.touched.get(item.body, ()):
        if isinstance(other.form, Rail) and other.bodies and other.bodies[0] == item.body:
            slope = unit2(sheet.way(item.body, other.form.axis))
            return slope if abs(float(slope @ left(sheet.down))) >= STEEPEST else None
    return None


def wedge_under(sheet: Sheet, item: Item, at: Floats, slope: Floats) -> Floats:
    """Return the corners (3, 2) of a wedge below a slope through a place, as long as what is fixed to it and slides."""
    up = slope if float(slope @ sheet.down) < 0.0 else -slope
    bodies = {i.bodies[1] for i in sheet.touched.get(item.body, ()) if isinstance(i.form, Rail) and len(i.bodies) > 1}
    anchors = [anchor for strand in sheet.scene.strands for anchor in strand.anchors if anchor.body == item.body]
    ways = [float((sheet.at(anchor.body, anchor.point) - at) @ up) for anchor in anchors]
    ways += [float((sheet.at(body, (0.0, 0.0, 0.0)) - at) @ up) for body in bodies]
    low, high = min([-SLOPE, *(way - 18.0 for way in ways)]), max([SLOPE, *(way + 20.0 for way in ways)])
    foot, top = at + low * up, at + high * up
    return np.array([foot, top, top + sheet.down * float((foot - top) @ sheet.down)])


# ----------------------------------------------------------------------------------------------------------------------

_BEYOND, _BEYOND_SLOPE = 24.0, 44.0
"""How far a rail goes on behind the last place of its block, and one that is inclined (pt)."""

_HELD: Final = 24.0
"""How far a bar reaches beyond the way of the ring on it (pt)."""
BAR: Final = 4.0
"""The width of a bar on which a ring slides (pt)."""
_BEAM: Final = 5.0
"""The width of the beam on which a wagon with a load runs (pt)."""
_PARALLEL: Final = 0.99
_SLEEVE: Final = 16.0
"""How far (pt) a slider in space is shown from the sign of another joint."""
_HALF: Final = 12.0
"""Half the length of a block (pt)."""


def block_size(sheet: Sheet, item: Item) -> tuple[float, float]:
    """Return the length and height (pt) of a block: that of a mass of its own, or of a slider on a larger body."""
    bodies = (other.symbol for other in sheet.touched.get(item.body, ()) if other.role == "body")
    kinds = {symbol.kind for symbol in bodies if symbol is not None}
    if "wagon" in kinds:
        return WAGON
    return BLOCK if item.role != "body" and kinds.isdisjoint(BLOCKS) else MASS


_APART, _NARROWEST = 6.0, 9.0
"""How far blocks that hang side by side are apart at least, and how narrow they get for that (pt)."""


def hanging_width(sheet: Sheet, item: Item, at: Floats, along: Floats, size: tuple[float, float]) -> float:
    """Return the width (pt) of a block that hangs along a way: less than that of its `size` beside another one."""
    length, width = size
    for other in sheet.scene.items:
        if other.body == item.body or other.role != "body" or other.symbol is None or other.symbol.kind not in BLOCKS:
            continue
        apart = sheet.at(other.body, other.symbol.at) - at
        aside = abs(float(apart @ left(along)))
        if aside > _NARROWEST and abs(float(apart @ along)) < length:
            width = min(width, max(aside - _APART, _NARROWEST))
    return width


def bodies_with_a_size(sheet: Sheet, body: int) -> Iterator[Item]:
    """Yield what a body and its surfaces are seen as, but for rods."""
    for item in sheet.touched.get(body, ()):
        if item.role in ("body", "surface") and (not isinstance(item.form, Polyline) or item.form.closed):
            yield item


def sleeve_place(sheet: Sheet, item: Item, symbol: Symbol) -> Vector:
    """Return where on its body a slider is shown in space: towards what it slides on where another joint's sign is."""
    at = sheet.at(item.body, symbol.at)
    others = (i for i in sheet.scene.items if i.role == "joint" and i.path != item.path and item.body in i.bodies)
    signs = (sheet.at(i.body, i.symbol.at) for i in others if i.symbol is not None)
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
    if rail.bar and sheet.flat:
        low, high = points + np.outer([-_HELD, _HELD], along)
        yield Stroke(capsule(low, high, BAR), sheet.pen(item), closed=True, fill=PAPER, **named)
        return
    if rail.polar:
        ends = np.array([sheet.at(item.body, rail.at), *_block_places(sheet, item)[:1]])
        yield Stroke(ends, sheet.pen(item, HIDDEN), **named)
        return
    if rail.light:
        return  # a spring or rope is seen on which something hangs, or it falls freely
    if not sheet.flat or not item.on_ground:
        if item.on_ground:
            yield hatched(points, sheet.pen(item, BOLD), sheet.down, **named)
            return
        yield Stroke(points, sheet.pen(item), **named)
        return
    for side, shifted in _lines(sheet, item, along, points):
        line = _joined(sheet, item, shifted)
        if line is None:
            continue
        if _is_overhead(sheet, item, side, line):
            first, last = line + _BEAM / 2 * side
            yield Stroke(capsule(first, last, _BEAM), sheet.pen(item), closed=True, fill=PAPER, **named)
            continue
        yield hatched(line, sheet.pen(item, BOLD), side, **named)
        for centre in wheels_on(sheet, item):  # a bar holds each wheel at the end
            near = min(shifted, key=lambda end: float(np.linalg.norm(end - centre)))
            bar = capsule(near, centre, 3.0)
            yield Stroke(bar, sheet.pen(item), closed=True, fill=BODY, **sheet.named(item, LAYER_GROUND))


def _is_overhead(sheet: Sheet, item: Item, side: Floats, line: Floats) -> bool:
    """Return whether a rail is a beam, as that of a crane: what a wagon on it carries hangs below it, at `side`."""
    child = _child(item)
    wagons = any(i.symbol is not None and i.symbol.kind == "wagon" for i in sheet.touched.get(child, ()))
    hung = (i.bodies[1] for i in sheet.scene.items if i.role == "joint" and i.bodies and i.bodies[0] == child)
    bounds = [sheet.page(i.body, i.form.bounds) for b in hung for i in sheet.touched.get(b, ()) if i.role == "body"]
    return wagons and any(float(((points - line[0]) @ side).max()) > _BEAM for points in bounds)


def _joined(sheet: Sheet, item: Item, line: Floats) -> Floats | None:
    """Return the line of a rail with those of other rails on ground in it; None if an earlier one has it."""
    along, before = unit2(line[1] - line[0]), True
    found = [line]
    for other in sheet.scene.items:
        if other is item:
            before = False
            continue
        if not isinstance(other.form, Rail) or other.form.light or other.form.bar or not other.on_ground:
            continue
        for each in rail_lines(sheet, other):
            if np.abs((each - line[0]) @ left(along)).max() < 0.5:
                if before:
                    return None
                found.append(each)
    ways = (np.vstack(found) - line[0]) @ along
    return np.asarray(line[0] + np.outer([ways.min(), ways.max()], along))


def rail_lines(sheet: Sheet, item: Item) -> list[Floats]:
    """Return the lines (2, 2) by which a rail is seen in the plane."""
    assert isinstance(item.form, Rail)
    along, points = unit2(sheet.way(item.body, item.form.axis)), rail_ends(sheet, item, item.form)
    if item.form.light or item.form.bar or not item.on_ground:
        return [points]
    return [line for _, line in _lines(sheet, item, along, points)]


def _lines(sheet: Sheet, item: Item, along: Floats, points: Floats) -> list[tuple[Floats, Floats]]:
    return [(side, points + offset * side) for side, offset in _sides(sheet, item, along)]


def line_ends(sheet: Sheet, item: Item) -> Floats | None:
    """Return from where to where (2, 2) a rail or face is drawn, None for what is neither and for light rails."""
    if isinstance(item.form, Rail):
        return None if item.form.light else rail_ends(sheet, item, item.form)
    return face_ends(sheet, item)


def rail_ends(sheet: Sheet, item: Item, rail: Rail) -> Floats:
    """Return from where to where (2, 2) a rail is drawn: near a slider alone where a joint stands at its beginning."""
    ends, along = sheet.page(item.body, rail.bounds), unit2(sheet.way(item.body, rail.axis))
    shift = sheet.settled.bodies.get(_child(item), np.zeros(2)) if rail.light else np.zeros(2)
    places = [float((place - shift) @ along) for place in _block_places(sheet, item)]
    at = sheet.at(item.body, rail.at)
    others = (i for i in sheet.scene.items if i.role == "joint" and i.body == item.body and i.path != item.path)
    signs = (sheet.at(i.body, i.symbol.at) for i in others if i.symbol is not None)
    taken = any(float(np.linalg.norm(sign - at)) < 3.0 for sign in signs)  # another joint stands where it begins
    if not places or not (taken or _is_sprung(sheet, item, along)):
        places += list(ends @ along)
    base = ends[0] - float(ends[0] @ along) * along + shift
    # how far the slider reaches beyond half a block, back and ahead (pt)
    here = next(iter(_block_places(sheet, item)), None)
    back, ahead = 0.0, 0.0
    for other in sheet.touched.get(_child(item), ()):
        if here is None or other.role != "body" or isinstance(other.form, (Sphere, Polyline)):
            continue
        ways = (_corners_of(sheet, other) - here) @ along
        back, ahead = min([back, *(ways + _HALF)]), max([ahead, *(ways - _HALF)])
    inclined = min(abs(float(along @ sheet.down)), abs(float(along @ left(sheet.down)))) > LEVEL
    beyond = _BEYOND_SLOPE if inclined and sheet.flat and item.on_ground and not rail.bar else _BEYOND
    low, high = min(places) + back - beyond, max(places) + ahead + beyond
    for centre in wheels_on(sheet, item):
        way = float(centre @ along)
        if way > (low + high) / 2:
            high = way - WHEEL - 3.0
        else:
            low = way + WHEEL + 3.0
    return np.array([base + low * along, base + high * along])


def _is_sprung(sheet: Sheet, item: Item, along: Floats) -> bool:
    """Return whether a spring or damper runs along the rail: it would be hidden between two lines."""
    for placed in sheet.placed.strands:
        bodies = {anchor.body for anchor in placed.strand.anchors}
        if bodies == {item.body, _child(item)} and placed.strand.kind in ("spring", "damper", "spring_damper"):
            first, last = sheet.projection.page(placed.pieces[0][0]), sheet.projection.page(placed.pieces[-1][1])
            return abs(float(unit2(last - first) @ along)) > _PARALLEL
    return False


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
    assert isinstance(item.form, Rail)
    middle = float(sheet.at(item.body, item.form.at) @ across)
    bodies = list(bodies_with_a_size(sheet, _child(item)))
    ways = [float(way) for other in bodies for way in _corners_of(sheet, other) @ across - middle]
    kinds = {other.symbol.kind for other in bodies if other.symbol is not None}
    half = (BLOCK if kinds.isdisjoint(BLOCKS) else MASS)[1] / 2 + CART_WHEEL * ("wagon" in kinds)
    signs = (i.symbol for i in sheet.scene.items if i.role == "force" and i.bodies == item.bodies)
    rubs = any(symbol is not None and symbol.kind == "friction" for symbol in signs)
    if (has_gravity and pressed < 0.2) or (not has_gravity and rubs and ways):
        return [(across, max(ways, default=half)), (-across, -min(ways, default=-half))]
    return [(across, max(ways, default=half))]


def _corners_of(sheet: Sheet, item: Item) -> Floats:
    """Return what bounds a body on the page (n, 2): of a mass without a size the corners of its wedge, if any."""
    if item.symbol is None:
        return outline_of(sheet, item)
    slope = slope_of(sheet, item) if item.symbol.kind == "block" and sheet.flat else None
    if slope is None or abs(float(slope @ sheet.down)) <= LEVEL:
        return np.zeros((0, 2))
    return wedge_under(sheet, item, sheet.at(item.body, item.symbol.at), slope)


def _block_places(sheet: Sheet, item: Item) -> list[Floats]:
    """Return where the block of a rail is on the page, where it was at the start, and in a motion is on the way."""
    found = []
    for other in sheet.scene.items:
        if other.path == item.path and other is not item and other.symbol is not None:
            own, shift = np.array([other.symbol.at]), sheet.settled.bodies.get(other.body, np.zeros(2))
            ways = (each.world(other.body, own) for each in (sheet.home, *sheet.others))
            found += [sheet.at(other.body, other.symbol.at), *(sheet.projection.page(way)[0] + shift for way in ways)]
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Stops: a bar across the way that it ends, a radial one beside the rod that it holds; hatched where ground has it.


_STOPS_SLEEVE: Final = (6.5, 7.0)
"""Half the length of a slider in space, and the radius of what stops it (pt)."""
_STOPS_BEYOND: Final = 1.5
"""How far a bar reaches beyond what it stops (pt)."""
_THICK: Final = 3.5
"""The thickness of a bar on a body that moves (pt)."""
_RADII: Final = (11.0, 30.0, 0.62)
"""How near to a hinge and how far from it a radial bar begins (pt), and at which part of the rod where it is short."""
_LONG: Final = 11.0
"""The length of a radial bar (pt)."""
_BAR: Final = 4.0
"""The width of a rod in space (pt)."""
_INSIDE: Final = 0.75 * np.pi
"""The angle (rad) from which on a plate is around its hinge, and no edge of it comes to a stop."""
_SEEN: Final = 0.05


def stop_marks(sheet: Sheet, item: Item, form: Stop | TurnStop) -> Iterator[Mark]:
    """Yield the bar of a stop: with hatching on its far side on ground, else of some thickness; in space a collar."""
    line = stop_line(sheet, item, form)
    if line is None:
        return
    if isinstance(form, Stop) and not sheet.flat:  # a disc across the way, behind the front of what comes there
        ahead = sheet.metres(_stops_reach(sheet, form) + _THICK / 2)
        centre = vector(np.array(form.at) + ahead * np.array(form.axis))
        disc = Barrel(centre, form.axis, sheet.metres(_STOPS_SLEEVE[1]), sheet.metres(_THICK))
        yield from barrel(sheet, item.body, disc, sheet.pen(item), sheet.named(item, LAYER_JOINT, centre), fill=DARK)
        return
    far = sheet.way(item.body, form.axis if isinstance(form, Stop) else np.cross(form.axis, form.way))
    side = 1 if float(left(line[1] - line[0]) @ far) > 0.0 else -1
    if item.on_ground:
        named = sheet.named(item, LAYER_GROUND + 0.2, form.at)
        yield Hatch(line, sheet.pen(item, BOLD), side=side, tick=4.0, gap=3.5, **named)
        return
    away = _THICK * side * left(unit2(line[1] - line[0]))
    corners = np.vstack([line, line[::-1] + away])
    named = sheet.named(item, LAYER_JOINT - 0.3, form.at)
    yield Stroke(corners, sheet.pen(item), closed=True, fill=DARK, **named)


def stop_line(sheet: Sheet, item: Item, form: Stop | TurnStop) -> Floats | None:
    """Return the ends (2, 2) of the line that what is stopped comes to; None of one that is seen along its way."""
    if float(np.linalg.norm(sheet.way(item.body, form.axis if isinstance(form, Stop) else form.way))) < _SEEN:
        return None
    return _across(sheet, item, form) if isinstance(form, Stop) else _radial(sheet, item, form)


def _across(sheet: Sheet, item: Item, form: Stop) -> Floats:
    """Return a line across a way, where the front of what comes there is, as high as that."""
    along = unit2(sheet.way(item.body, form.axis))
    base = sheet.at(item.body, form.at) + sheet.settled.bodies.get(item.bodies[1], np.zeros(2))
    if not sheet.flat:
        foot = base + _stops_reach(sheet, form) * sheet.way(item.body, form.axis)
        return foot + np.outer([-_STOPS_SLEEVE[1], _STOPS_SLEEVE[1]], left(along))
    at, found = sheet.at(item.bodies[1], form.point), []
    for other in bodies_with_a_size(sheet, item.bodies[1]):
        outline = _corners_of(sheet, other)
        found.append(outline - at if len(outline) else _block(sheet, item, form, other))
    corners = np.vstack(found or [_block(sheet, item, form, None)])
    heights = corners @ left(along)
    foot = base + float((corners @ along).max()) * along
    return foot + np.outer([heights.min() - _STOPS_BEYOND, heights.max() + _STOPS_BEYOND], left(along))


def _stops_reach(sheet: Sheet, form: Stop) -> float:
    """Return how far what is stopped in space reaches ahead of its place (pt)."""
    return sheet.projection.scale * form.front or _STOPS_SLEEVE[0]


def _block(sheet: Sheet, item: Item, form: Stop, body: Item | None) -> Floats:
    """Return the corners (4, 2) of a sign whose size is the page's: a mass, a slider, a bead or a bob."""
    if body is not None:
        kind = body.symbol.kind if body.symbol is not None else ""
        half = np.array(block_size(sheet, body)) / 2 if kind in BLOCKS else np.full(2, BOB)
    else:
        touched = sheet.touched.get(item.bodies[1], ())
        beads = (i for i in touched if i.role == "joint" and i.symbol is not None)
        bead = any(i.symbol.kind == "bead" for i in beads if i.symbol is not None)
        half = np.full(2, PIN) if bead else np.array(BLOCK) / 2
    along = unit2(sheet.way(item.body, form.axis))
    signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return np.asarray((signs * half) @ np.array([along, left(along)]))


def _radial(sheet: Sheet, item: Item, form: TurnStop) -> Floats:
    """Return a line away from a hinge along the edge of the rod that it stops."""
    at, way = sheet.at(item.body, form.at), sheet.way(item.body, form.way)
    barred = sheet.way(item.body, np.cross(form.axis, form.way))
    nearest, farthest, part = _RADII
    start = min(farthest, max(nearest, part * sheet.projection.scale * form.reach))
    turn, edge = _edge(sheet, item, form)
    ahead = np.cos(turn) * way + np.sin(turn) * barred
    beside = (edge + BOLD.width / 2) * (np.cos(turn) * barred - np.sin(turn) * way)
    return np.asarray(at + beside + np.outer([start, start + _LONG], ahead))


def _edge(sheet: Sheet, item: Item, form: TurnStop) -> tuple[float, float]:
    """Return by which angle (rad) the edge of what turns is ahead of its longest direction, and how far beside (pt)."""
    plates = [
        sheet.page(other.body, other.form.points) - sheet.at(item.body, form.at)
        for other in sheet.touched.get(item.bodies[1], ())
        if other.role == "body" and isinstance(other.form, Polyline) and other.form.closed and sheet.flat
    ]
    if not plates:
        return 0.0, (ROD if sheet.flat else _BAR) / 2
    own, barred = sheet.way(item.bodies[1], form.own), sheet.way(item.body, np.cross(form.axis, form.way))
    across = left(own) * (1.0 if float(left(sheet.way(item.body, form.way)) @ barred) > 0.0 else -1.0)
    corners = np.vstack(plates)
    corners = corners[np.linalg.norm(corners, axis=1) > PIN]
    ahead = float(np.arctan2(corners @ across, corners @ own).max())
    return (ahead, 0.0) if 0.0 <= ahead < _INSIDE else (0.0, 0.0)


# ----------------------------------------------------------------------------------------------------------------------
# Clamped ends: what is fixed to ground, or to another body.


_UNDER: Final = 19.0
"""How far ground reaches on either side of a mass that is fixed to it (pt)."""


def weld_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a clamped end: hatched ground through the place, or between bodies a filled corner.

    Under a mass without a size ground alone is seen.
    """
    at, named = sheet.at(item.body, symbol.at), sheet.named(item, LAYER_JOINT, symbol.at)
    if item.on_ground and sheet.flat and item.bodies[-1] in sheet.settled.leans:
        if item.bodies[-1] in sheet.settled.bodies:  # it stands on ground that is drawn
            return
        across = sheet.settled.leans[item.bodies[-1]]
        below = at - MASS[1] / 2 * left(across)
        ends = np.array([below - _UNDER * across, below + _UNDER * across])
        yield Hatch(ends, sheet.pen(item, BOLD), side=-1, **{**named, "layer": LAYER_GROUND})
        return
    if item.on_ground:
        yield from stand(sheet, item, at, support_side(sheet, item, at), 3.0)
    square = np.array([(-2.6, -2.6), (2.6, -2.6), (2.6, 2.6), (-2.6, 2.6)])
    yield Stroke(at + square, sheet.pen(item), closed=True, fill=BLACK, **named)
