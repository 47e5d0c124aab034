"""Signs whose size is the page's: pins, sliders, blocks, bobs. A new kind of symbol is one entry in SYMBOLS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Final

import numpy as np

from multibody_sym.pictures.marks.flows import FLOWS
from multibody_sym.pictures.marks.forces import driven_points, round_radius
from multibody_sym.pictures.marks.place_symbols import BOB
from multibody_sym.pictures.marks.shapes import FORMS, barrel, outline
from multibody_sym.pictures.marks.sheet import UNSEEN, Sheet, left, unit2
from multibody_sym.pictures.marks.sliders import (
    LEVEL,
    block_size,
    hanging_width,
    is_covered,
    sleeve_place,
    slope_of,
    wedge_under,
    weld_marks,
)
from multibody_sym.pictures.marks.supports import (
    axle_marks,
    held_wheel,
    pulley_marks,
    stand,
    step_marks,
    struck_marks,
    support,
    support_marks,
    support_side,
)
from multibody_sym.pictures.page.layout import distances
from multibody_sym.pictures.page.picture import (
    AXIS,
    BLACK,
    BODY,
    BOLD,
    DARK,
    DOT,
    INK,
    LAYER_ARROW,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_JOINT,
    PAPER,
    PIN,
    SUPPORT,
    THIN,
    VELOCITY,
    Arc,
    Arrow,
    Mark,
    Pen,
    Stroke,
)
from multibody_sym.pictures.scene.items import (
    Barrel,
    Block,
    Disc,
    Face,
    Form,
    Item,
    Polyline,
    Rail,
    Sphere,
    Symbol,
    unit,
    vector,
)
from multibody_sym.scalars.arrays import Floats

# ----------------------------------------------------------------------------------------------------------------------
# Where bodies touch on the page: at a point, or where something round is nearest to a face or to something round.


_NEAR: Final = 4.0
_SURFACE: Final = 4
"""How many names lead to a surface: bodies, the body, surfaces, its own."""


def touching_place(sheet: Sheet, item: Item, symbol: Symbol) -> Floats | None:
    """Return where two bodies of a contact touch (2), None where their forms do not tell or they are apart."""
    if len(item.bodies) != 2:
        return None
    first, second = (_parts(sheet, item, k) for k in (0, 1))
    for one, two in ((first, second), (second, first)):
        for a in one:
            for b in two:
                found = _nearest(sheet, a, b)
                if found is not None:
                    return found
    at = sheet.at(item.body, symbol.at) - sheet.settled.bodies.get(item.body, np.zeros(2))
    at = at + sheet.settled.seats.get(item.body, np.zeros(2))
    faces = [(i, i.form) for i in second if isinstance(i.form, Face)]
    heights = [float((at - sheet.through(i, face)) @ sheet.way(i.body, face.normal)) for i, face in faces]
    if faces and min(map(abs, heights)) >= _NEAR:
        return None
    return at if any(symbol.at) or any(isinstance(i.form, (Face, Polyline)) for i in (*first, *second)) else None


def _parts(sheet: Sheet, item: Item, end: int) -> list[Item]:
    """Return what is seen of one of both ends: the surface that is named, else all of the body."""
    every = sheet.touched.get(item.bodies[end], [])
    named = item.touching[end] if item.touching else ""
    surfaces = [each for each in every if len(each.path) == 4 and named == f"{each.path[1]}.{each.path[3]}"]
    return surfaces or every


def _nearest(sheet: Sheet, a: Item, b: Item) -> Floats | None:
    """Return where something round touches a face or something round."""
    if isinstance(a.form, Block) and isinstance(b.form, Face):
        return _lowest(sheet, a, a.form, b, b.form)
    if isinstance(a.form, Polyline) and isinstance(b.form, Face) and a.form.closed and len(a.path) == _SURFACE:
        return _lowest(sheet, a, a.form, b, b.form)
    if not isinstance(a.form, (Disc, Sphere)):
        return None
    centre, radius = sheet.at(a.body, a.form.centre), a.form.radius * sheet.projection.scale
    if isinstance(b.form, Face) and not sheet.flat:
        return _rim_on_face(sheet, a, b)
    if isinstance(b.form, Face):
        normal = sheet.way(b.body, b.form.normal)
        apart = float((centre - sheet.through(b, b.form)) @ normal)
        near = abs(abs(apart) - radius) < _NEAR and float(np.linalg.norm(normal)) > 0.99
        return centre - radius * normal if near else None
    if isinstance(b.form, (Disc, Sphere)):
        other, size = sheet.at(b.body, b.form.centre), b.form.radius * sheet.projection.scale
        way, apart = unit2(other - centre), float(np.linalg.norm(other - centre))
        if abs(apart - radius - size) < _NEAR:
            return centre + radius * way
        if apart > 1.0 and abs(apart - abs(radius - size)) < _NEAR:
            return centre - radius * way if size > radius else centre + radius * way
    return _on_curve(sheet, centre, radius, b) if isinstance(b.form, Polyline) and sheet.flat else None


def _on_curve(sheet: Sheet, centre: Floats, radius: float, item: Item) -> Floats | None:
    """Return the place of a curve that is nearest to the middle of something round, None if that does not touch."""
    points = sheet.page(item.body, item.form.bounds)
    lines = np.hstack((points[:-1], points[1:]))
    line = lines[int(np.argmin(distances(centre[None], lines)[0]))]
    along = line[2:] - line[:2]
    part = float((centre - line[:2]) @ along) / max(float(along @ along), 1e-12)
    place = line[:2] + np.clip(part, 0.0, 1.0) * along
    return place if abs(float(np.linalg.norm(place - centre)) - radius) < _NEAR else None


def _rim_on_face(sheet: Sheet, a: Item, b: Item) -> Floats | None:
    """Return where a ball, or the rim of a disc, is nearest to a plane in space, None where it is not near."""
    assert isinstance(a.form, (Disc, Sphere))
    assert isinstance(b.form, Face)
    pose = sheet.placed.world
    centre, through = pose(a.body, np.array([a.form.centre]))[0], pose(b.body, np.array([b.form.through]))[0]
    normal = sheet.placed.turned(b.body, b.form.normal)
    down = -normal if float((centre - through) @ normal) > 0.0 else normal
    if isinstance(a.form, Disc):
        axis = sheet.placed.turned(a.body, a.form.axis)
        down = down - float(down @ axis) * axis
    size = float(np.linalg.norm(down))
    if size < 1e-6:
        return None
    place = centre + a.form.radius * down / size
    near = abs(float((place - through) @ normal)) * sheet.projection.scale < _NEAR
    return np.asarray(sheet.projection.page(place)) if near else None


def _lowest(sheet: Sheet, a: Item, box: Block | Polyline, b: Item, face: Face) -> Floats | None:
    """Return the middle of what of a box or an outline is nearest to a face, None if it is not near."""
    normal, corners = sheet.way(b.body, face.normal), sheet.page(a.body, box.bounds)
    heights = (corners - sheet.through(b, face)) @ normal
    low = float(heights.min())
    return np.asarray(corners[heights < low + 1.0].mean(axis=0)) if abs(low) < _NEAR else None


# ----------------------------------------------------------------------------------------------------------------------
# Signs whose size is the page's: pins, sliders, blocks, bobs. A new kind of symbol is one entry in SYMBOLS.


# ----------------------------------------------------------------------------------------------------------------------
# Hinges of rings in space: where their axis meets the ring, as gimbals have them, not in the empty middle.


_SAME: Final = 1e-6
_WIRE_POINTS: Final = 8
"""A curve of more points about a hinge is a ring if all are at one distance."""
_OUTSIDE: Final = 14.0
"""How far a ring's shaft reaches to its bearing in ground (pt)."""
_BUSH: Final = (2.6, 8.0)
"""Radius and length (pt) of a bearing."""


def ring_pins(sheet: Sheet, item: Item, symbol: Symbol) -> Floats | None:
    """Return from where to where (2, 3), along its axis on one side, a hinge's shaft is seen between rings.

    In the axes of the hinge's own body; None where neither body is a ring about whose diameter it turns.
    """
    radii = [radius for body in item.bodies for radius in _radii(sheet, item, symbol, body)]
    if not radii or sheet.flat:
        return None
    outer = max(radii)
    inner = min(radii) if len(radii) > 1 else 0.0
    if any(body in sheet.ground for body in item.bodies):
        inner, outer = outer, outer + sheet.metres(_OUTSIDE)
    axis, at = np.array(unit(symbol.axis)), np.array(symbol.at)
    return np.array([at + inner * axis, at + outer * axis])


def _radii(sheet: Sheet, item: Item, symbol: Symbol, body: int) -> Iterator[float]:
    """Yield the radii of rings of a body that have the hinge's axis as a diameter."""
    at = sheet.placed.world(item.body, np.array([symbol.at]))[0]
    axis = sheet.placed.turned(item.body, unit(symbol.axis))
    for other in sheet.touched.get(body, ()):
        if isinstance(other.form, Disc) and other.form.hollow:
            centre = sheet.placed.world(body, np.array([other.form.centre]))[0]
            across = abs(float(sheet.placed.turned(body, other.form.axis) @ axis))
            if float(np.linalg.norm(centre - at)) < _SAME * sheet.scene.size and across < _SAME:
                yield other.form.radius
        elif isinstance(other.form, Polyline) and len(other.form.points) > _WIRE_POINTS:
            ways = sheet.placed.world(body, other.form.bounds) - at
            reach = np.linalg.norm(ways, axis=1)
            if float(np.ptp(reach)) < _SAME * sheet.scene.size and float(np.abs(ways @ axis).max()) > 0.99 * reach[0]:
                yield float(reach[0])


# ----------------------------------------------------------------------------------------------------------------------

_UNIT: Final = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_COM: Final = 4.0
_RING: Final = (4.5, 10.0)
"""Half the width and height of a ring that is seen from its side (pt)."""
_WIRE: Final = Pen(2.2)
"""The wire of such a ring."""
_ROTOR: Final = 14.0
Look = Callable[[Sheet, Item, Symbol], Iterator[Mark]]


def _pin(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named, at = sheet.named(item, LAYER_JOINT, symbol.at), sheet.at(item.body, symbol.at)
    if sheet.flat:
        yield Arc(at, PIN, sheet.pen(item), fill=PAPER, **named)
        return
    pins = ring_pins(sheet, item, symbol)
    if pins is not None:
        # the shaft of a hinge on both sides, with a bearing where it ends, on a stem where that is ground
        for side in (1.0, -1.0):
            ends = np.array(symbol.at) + side * (pins - np.array(symbol.at))
            page, middle = sheet.page(item.body, ends), ends.mean(axis=0)
            if any(body in sheet.ground for body in item.bodies):
                yield from stand(sheet, item, page[1], unit2(page[1] - page[0], (0.0, -1.0)), 6.0)
            yield Stroke(page, sheet.pen(item, BOLD), **sheet.named(item, LAYER_BODY, middle))
            bearing = Barrel(vector(ends[1]), unit(symbol.axis), *map(sheet.metres, _BUSH))
            yield from barrel(
                sheet, item.body, bearing, sheet.pen(item), sheet.named(item, LAYER_JOINT, ends[1]), fill=PAPER
            )
        return
    form = Barrel(symbol.at, unit(symbol.axis), sheet.metres(3.2), sheet.metres(11.0))
    yield from barrel(sheet, item.body, form, sheet.pen(item), named, fill=PAPER)


def _pivot(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a pin on a triangle that stands on hatched ground, on the side where its bodies are not.

    On the wheel of a pulley on ground, which is held itself, it is the axle.
    """
    forms = (i.form for b in item.bodies for i in sheet.touched.get(b, ()) if i.role in ("body", "pulley", "gear"))
    at = sheet.at(item.body, symbol.at)
    hidden = any(isinstance(form, (Disc, Block, Barrel)) or _is_inside(sheet, item, form, at) for form in forms)
    layer = LAYER_JOINT - 0.3 if hidden else LAYER_GROUND + 0.5  # a wheel would hide what it turns on
    named = sheet.named(item, layer)
    wheel_at = held_wheel(sheet, at)
    if wheel_at is not None:
        yield Arc(wheel_at, PIN, sheet.pen(item), fill=PAPER, **sheet.named(item, LAYER_JOINT, symbol.at))
        return
    if not _is_held(sheet, item, at):
        yield from support(sheet, item, at, support_side(sheet, item, at), named)
    yield from _pin(sheet, item, symbol)


def _is_inside(sheet: Sheet, item: Item, form: Form, at: Floats) -> bool:
    """Return whether all of a support under a place of the page is within the outline of a body."""
    if not isinstance(form, Polyline) or not form.closed:
        return False
    around = outline(sheet.page(item.bodies[1], form.points))
    sides = np.roll(around, -1, axis=0) - around
    apart = at + SUPPORT * sheet.down - around
    return abs(float(np.sign(sides[:, 0] * apart[:, 1] - sides[:, 1] * apart[:, 0]).sum())) == len(sides)


def _is_held(sheet: Sheet, item: Item, at: Floats) -> bool:
    """Return whether the support of an earlier hinge stands at the same place of ground."""
    for other in sheet.scene.items:
        if other is item:
            return False
        if other.symbol is None or (other.symbol.kind, other.body) != ("pivot", item.body):
            continue
        if float(np.linalg.norm(sheet.at(other.body, other.symbol.at) - at)) < 1.0:
            return True
    return False


def _ball(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named, at = sheet.named(item, LAYER_JOINT, symbol.at), sheet.at(item.body, symbol.at)
    yield Arc(at, PIN + 3.0, sheet.pen(item), 0.75 * np.pi, 2.25 * np.pi, **named)
    yield Arc(at, PIN + 1.0, sheet.pen(item), fill=DARK, **named)


def _ball_pivot(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    at = sheet.at(item.body, symbol.at)
    away = support_side(sheet, item, at)
    yield from stand(sheet, item, at, away, 9.0)
    yield from _ball(sheet, item, symbol)


def _bush_marks(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a hinge on ground in space: a bush about its axis on a stem."""
    if sheet.flat:
        yield from _pivot(sheet, item, symbol)
        return
    if ring_pins(sheet, item, symbol) is not None:
        yield from _pin(sheet, item, symbol)
        return
    at = sheet.at(item.body, symbol.at)
    axis, away = sheet.way(item.body, symbol.axis), support_side(sheet, item, at)
    upright = abs(float(unit2(axis) @ away)) > 0.9 and float(np.linalg.norm(axis)) > 0.3
    yield from stand(sheet, item, at, away, 9.0 if upright else 12.0)
    yield from _pin(sheet, item, symbol)


def _cardan(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the cross of a universal joint: both axes with their bearings."""
    named, at = sheet.named(item, LAYER_JOINT, symbol.at), sheet.at(item.body, symbol.at)
    if item.on_ground:
        yield from stand(sheet, item, at, support_side(sheet, item, at), 12.0)
    yield Arc(at, 6.5, sheet.pen(item), fill=PAPER, **named)
    for axis in (symbol.axis, symbol.along):
        way = 6.5 * sheet.way(item.body, axis)
        if float(np.linalg.norm(way)) < 1.0:
            yield Arc(at, 1.6, sheet.pen(item), fill=BLACK, **named)
        else:
            yield Stroke(np.array([at - way, at + way]), sheet.pen(item, BOLD), **named)


def _slider(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the block of a slider on its rail, where the body does not show it by a form of its own."""
    if is_covered(sheet, item):
        return
    if not sheet.flat:
        place = sleeve_place(sheet, item, symbol)
        form = Barrel(place, unit(symbol.axis), sheet.metres(4.0), sheet.metres(13.0))
        bars = (i.form.bounds.mean(axis=0) for i in sheet.touched[item.body] if i.role == "body")
        named = sheet.named(item, LAYER_JOINT, next(bars, place))  # hidden by what hides its bar
        yield from barrel(sheet, item.body, form, sheet.pen(item), named, fill=DARK)
        return
    named = sheet.named(item, LAYER_BODY + 0.4, symbol.at)
    at, along = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.axis))
    corners = _rectangle(at, along, *block_size(sheet, item))
    yield Stroke(corners, sheet.pen(item), closed=True, fill=DARK, **named)


def _sleeve(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named = sheet.named(item, LAYER_JOINT, symbol.at)
    form = Barrel(symbol.at, unit(symbol.axis), sheet.metres(5.0), sheet.metres(20.0))
    yield from barrel(sheet, item.body, form, sheet.pen(item), named, fill=DARK)


def _screw(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a threaded rod through a nut."""
    named, along = sheet.named(item, LAYER_JOINT, symbol.at), sheet.way(item.body, symbol.axis)
    at, axis = sheet.at(item.body, symbol.at), unit2(along, (0.0, 1.0))
    across = left(axis)
    yield Stroke(_rectangle(at, axis, 52.0, 7.0), sheet.pen(item), closed=True, fill=PAPER, **named)
    for k in np.arange(-24.0, 25.0, 4.0):
        ends = np.array([at + k * axis - 3.5 * across, at + (k + 2.0) * axis + 3.5 * across])
        yield Stroke(ends, THIN, **named)
    yield Stroke(_rectangle(at, axis, 10.0, 16.0), sheet.pen(item), closed=True, fill=DARK, **named)


def _bead(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named = sheet.named(item, LAYER_JOINT, symbol.at)
    yield Arc(sheet.at(item.body, symbol.at), PIN, sheet.pen(item), fill=PAPER, **named)


def _bob(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named = sheet.named(item, LAYER_BODY + 0.5, symbol.at)
    yield Arc(sheet.at(item.body, symbol.at), BOB, sheet.pen(item), fill=DARK, **named)


def _ring(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a ring seen from its side, half of it behind the bar and half of it before."""
    at = sheet.at(item.body, symbol.at)
    if not sheet.flat:
        yield from _bob(sheet, item, symbol)
        return
    rails = (i for i in sheet.scene.items if isinstance(i.form, Rail) and item.body in i.bodies)
    ways = (unit2(sheet.way(i.body, i.form.axis)) for i in rails if isinstance(i.form, Rail))
    along = next(ways, np.array([1.0, 0.0]))
    half, high = np.array(_RING)
    for start, layer in ((0.5 * np.pi, LAYER_GROUND - 0.2), (-0.5 * np.pi, LAYER_BODY + 0.3)):
        turn = start + np.linspace(0.0, np.pi, 25)[:, None]
        points = at + half * np.cos(turn) * along + high * np.sin(turn) * left(along)
        yield Stroke(points, sheet.pen(item, _WIRE), **sheet.named(item, layer, symbol.at))


def _body_block(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a mass without a size: a block along its rail or on its face, a wedge where another one slides up it."""
    named = sheet.named(item, LAYER_BODY + 0.3, symbol.at)
    length, height = block_size(sheet, item)
    if not sheet.flat:
        sizes = (sheet.metres(length), sheet.metres(length), sheet.metres(height))
        yield from FORMS[Block](sheet, item, Block(symbol.at, _UNIT, sizes))
        return
    at = sheet.at(item.body, symbol.at)
    slope = slope_of(sheet, item)
    if slope is not None and abs(float(slope @ sheet.down)) > LEVEL:
        yield Stroke(wedge_under(sheet, item, at, slope), sheet.pen(item), closed=True, fill=BODY, **named)
        return
    pulleys = (i.form for i in sheet.touched.get(item.body, ()) if i.role == "pulley")
    if any(isinstance(form, Symbol) and form.at == symbol.at for form in pulleys):  # the mass hangs below it
        hook = at + 30.0 * sheet.down
        yield Stroke(np.array([at, hook]), sheet.pen(item), **named)
        at = hook
    others = (i.symbol for i in sheet.touched.get(item.body, ()) if i.symbol is not None)
    axes = (form.axis for form in others if form.kind in ("slider", "hanger"))
    along = sheet.settled.leans.get(item.body, unit2(sheet.way(item.body, next(axes, (1.0, 0.0, 0.0)))))
    if abs(float(along @ sheet.down)) > 1.0 - LEVEL:
        height = hanging_width(sheet, item, at, along, (length, height))
    corners = _rectangle(at, along, length * (1.9 if slope is not None else 1.0), height)
    yield Stroke(corners, sheet.pen(item), closed=True, fill=BODY, **named)


def _rectangle(at: Floats, along: Floats, length: float, height: float) -> Floats:
    """Return the corners (4, 2) of a rectangle about a place."""
    across = left(along)
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return np.array([at + i * length / 2 * along + j * height / 2 * across for i, j in signs])


def _rotor(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a wheel without a size on its axis."""
    named = sheet.named(item, LAYER_BODY, symbol.at)
    joint = next((i for i in sheet.scene.items if i.role == "joint" and item.body in i.bodies[1:]), None)
    if joint is None or sheet.flat or joint.symbol is None:
        yield Arc(sheet.at(item.body, symbol.at), _ROTOR, sheet.pen(item), fill=BODY, **named)
        return
    world = sheet.placed.turned(joint.body, joint.symbol.axis)
    axis = unit(world @ sheet.placed.poses[item.body][:, :3])
    form = Barrel(symbol.at, axis, sheet.metres(_ROTOR), sheet.metres(5.0))
    yield from barrel(sheet, item.body, form, sheet.pen(item), named)


def _com(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a circle with two of its quarters filled."""
    named, at = sheet.named(item, LAYER_JOINT, symbol.at), sheet.at(item.body, symbol.at)
    if 0.0 < round_radius(sheet, item.body, at) < 2.0 * _COM:
        return  # the body itself is hardly larger
    yield Arc(at, _COM, THIN, fill=PAPER, **named)
    for start in (0.0, np.pi):
        angles = np.linspace(start, start + np.pi / 2, 9)
        rim = at + _COM * np.column_stack((np.cos(angles), np.sin(angles)))
        yield Stroke(np.vstack([at, rim]), None, closed=True, fill=BLACK, **named)


def _point(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a dot where nothing else is, a step up to an edge of ground that something touches."""
    at = sheet.at(item.body, symbol.at)
    yield from step_marks(sheet, item, at)
    for other in sheet.touched.get(item.body, ()):
        if other.symbol is None or other.symbol.kind in UNSEEN:
            continue
        if float(np.linalg.norm(sheet.at(other.body, other.symbol.at) - at)) < 3.0:
            return
    yield Arc(at, 1.2, None, fill=BLACK, **sheet.named(item, LAYER_JOINT, symbol.at))


def _torsion_spring(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the spiral of a spring in a hinge."""
    named, at = sheet.named(item, LAYER_JOINT + 0.2, symbol.at), sheet.at(item.body, symbol.at)
    turn = np.linspace(0.0, 5.0 * np.pi, 90)
    radii = 4.0 + 7.0 * turn / turn[-1]
    yield Stroke(at + radii[:, None] * np.column_stack((np.cos(turn), np.sin(turn))), sheet.pen(item), **named)


def _torsion_damper(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the cup of a damper in a hinge."""
    named, at = sheet.named(item, LAYER_JOINT + 0.2, symbol.at), sheet.at(item.body, symbol.at)
    yield Arc(at, 8.0, sheet.pen(item), 0.2, np.pi - 0.2, **named)
    yield Arc(at, 10.5, sheet.pen(item), 0.6, np.pi + 0.2, **named)


def _skate(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the edge of a skate: a thin dark lens along the one direction in which it moves."""
    at, along = sheet.at(item.body, symbol.at), sheet.way(item.body, symbol.along)
    turn = np.linspace(0.0, 2.0 * np.pi, 40)[:, None]
    lens = at + 16.0 * np.cos(turn) * along + 2.6 * np.sin(turn) * np.abs(np.sin(turn)) * left(along)
    yield Stroke(lens, sheet.pen(item), closed=True, fill=BLACK, **sheet.named(item, LAYER_JOINT, symbol.at))


def _motor(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named, at = sheet.named(item, LAYER_JOINT - 0.1, symbol.at), sheet.at(item.body, symbol.at)
    yield Arc(at, 8.0, sheet.pen(item), fill=PAPER, **named)


def _rack(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    named, at = sheet.named(item, LAYER_BODY + 0.4, symbol.at), sheet.at(item.body, symbol.at)
    along = unit2(sheet.way(item.body, symbol.along))
    across = left(along)
    teeth = [at + k * 4.0 * along + (3.0 if k % 2 else 6.0) * across for k in range(-8, 9)]
    points = np.array([at - 32.0 * along, *teeth, at + 32.0 * along])
    yield Stroke(points, sheet.pen(item), closed=True, fill=BODY, **named)


def _gear(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a gear without a size."""
    named, at = sheet.named(item, LAYER_BODY, symbol.at), sheet.at(item.body, symbol.at)
    yield Arc(at, 12.0, AXIS, **named)
    for turn in np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False):
        way = np.array([np.cos(turn), np.sin(turn)])
        yield Stroke(np.array([at + 10.0 * way, at + 14.0 * way]), INK, **named)


def _drive(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield an arrow along the axis of what is driven, or most of a circle about it."""
    yield Arrow(driven_points(sheet, item, symbol), VELOCITY, head=5.0, open=True, **sheet.named(item, LAYER_ARROW))


def _origin(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the dot from which the distance of a free particle counts."""
    yield Arc(sheet.at(item.body, symbol.at), 2.0 * DOT, sheet.pen(item), fill=DARK, **sheet.named(item, LAYER_JOINT))


def _ring_if_marked(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield ink only where the item is marked: a ring about its place."""
    if sheet.is_marked(item.path):
        yield Arc(sheet.at(item.body, symbol.at), 9.0, sheet.pen(item), **sheet.named(item, LAYER_JOINT, symbol.at))


def _contact(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a dot where bodies touch, as far as that is known."""
    at = touching_place(sheet, item, symbol)
    if at is not None:
        yield Arc(at, 1.3, None, fill=BLACK, **sheet.named(item, LAYER_JOINT + 0.5, symbol.at))
    yield from _ring_if_marked(sheet, item, symbol)


def _edge(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield nothing for a point that a joint or what is fixed there shows, unless something touches it."""
    yield from step_marks(sheet, item, sheet.at(item.body, symbol.at))


SYMBOLS: Final[Mapping[str, Look]] = {
    **FLOWS,
    "pin": _pin,
    "origin": _origin,
    "pivot": _bush_marks,
    "ball_joint": _ball,
    "ball_pivot": _ball_pivot,
    "cardan": _cardan,
    "weld": weld_marks,
    "slider": _slider,
    "hanger": _ring_if_marked,
    "nut_body": _ring_if_marked,
    "sleeve": _sleeve,
    "nut": _screw,
    "bead": _bead,
    "bob": _bob,
    "block": _body_block,
    "ring": _ring,
    "rotor": _rotor,
    "com": _com,
    "support": support_marks,
    "roller": support_marks,
    "struck": struck_marks,
    "pulley": pulley_marks,
    "axle": axle_marks,
    "point": _point,
    "place": _point,
    "used_point": _edge,
    "torsion_spring": _torsion_spring,
    "torsion_damper": _torsion_damper,
    "motor": _motor,
    "skate": _skate,
    "rack": _rack,
    "gear": _gear,
    "drive_about": _drive,
    "drive_along": _drive,
    "tie": _ring_if_marked,
    "free": _ring_if_marked,
    "contact": _contact,
    "friction": _ring_if_marked,
}
"""How each kind of symbol looks."""
