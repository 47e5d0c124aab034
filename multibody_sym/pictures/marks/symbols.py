"""Signs whose size is the page's: pins, sliders, blocks, flows. A new kind of symbol is one entry in SYMBOLS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.forces import driven_points, round_radius
from multibody_sym.pictures.marks.ropes import (
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
from multibody_sym.pictures.marks.shapes import (
    FORMS,
    LEVEL,
    barrel,
    belt_marks,
    block_size,
    bodies_with_a_size,
    hanging_width,
    outline,
    outline_of,
    sleeve_place,
    slope_of,
    wedge_under,
)
from multibody_sym.pictures.marks.sheet import BOB, CART_WHEEL, MASS, UNSEEN, WAGON, Sheet, left, unit2
from multibody_sym.pictures.page.layout import distances
from multibody_sym.pictures.page.picture import (
    AXIS,
    BLACK,
    BODY,
    BOLD,
    CHAIN,
    DARK,
    DOT,
    INK,
    LAYER_ARROW,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_JOINT,
    LAYER_TEXT,
    PAPER,
    PIN,
    SUPPORT,
    THIN,
    VELOCITY,
    Arc,
    Arrow,
    Hatch,
    Mark,
    Pen,
    Stroke,
    Wish,
    formula,
)
from multibody_sym.pictures.scene.items import (
    BLOCKS,
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
from multibody_sym.pictures.scene.masses import rocket_outline
from multibody_sym.scalars.arrays import Floats

Look = Callable[[Sheet, Item, Symbol], Iterator[Mark]]

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
        if (ring := other.form.hollow_disc) is not None:
            centre = sheet.placed.world(body, np.array([ring.centre]))[0]
            across = abs(float(sheet.placed.turned(body, ring.axis) @ axis))
            if float(np.linalg.norm(centre - at)) < _SAME * sheet.scene.size and across < _SAME:
                yield ring.radius
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
    if any(bodies_with_a_size(sheet, item.body)):
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


def _filled(radius: float, fill: str, layer: float) -> Look:
    """Return what draws a filled circle at the place of a symbol."""

    def look(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
        named = sheet.named(item, layer, symbol.at)
        yield Arc(sheet.at(item.body, symbol.at), radius, sheet.pen(item), fill=fill, **named)

    return look


_bob: Final = _filled(BOB, DARK, LAYER_BODY + 0.5)


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


# ----------------------------------------------------------------------------------------------------------------------
# Clamped ends: what is fixed to ground, or to another body.


_GROUND_BESIDE: Final = 19.0
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
        ends = np.array([below - _GROUND_BESIDE * across, below + _GROUND_BESIDE * across])
        yield Hatch(ends, sheet.pen(item, BOLD), side=-1, **{**named, "layer": LAYER_GROUND})
        return
    if item.on_ground:
        yield from stand(sheet, item, at, support_side(sheet, item, at), 3.0)
    square = np.array([(-2.6, -2.6), (2.6, -2.6), (2.6, 2.6), (-2.6, 2.6)])
    yield Stroke(at + square, sheet.pen(item), closed=True, fill=BLACK, **named)


# ----------------------------------------------------------------------------------------------------------------------
# Flows of mass: jets, leaks, hoppers, mist, heaps; rockets, wagons and belts without a size.


_ROCKET: Final = (46.0, 15.0)
"""The length of a rocket without a size, and its width at the fins (pt)."""
_SPRAY: Final = Pen(0.7, "#555555", dash=(4.0, 2.0))
"""Gas that leaves a nozzle."""
_JET, _ARROW = 20.0, (8.0, 34.0)
"""How long the gas of a jet is seen, and from where to where its speed (pt)."""
_GRAIN: Final = 0.8
"""The radius of a grain or a drop (pt)."""
_BELT: Final = (88.0, 13.0)
"""The length and height of a belt without a size (pt)."""
_FUNNEL: Final = np.array([(-15.0, 44.0), (-15.0, 37.0), (-3.0, 24.0), (3.0, 24.0), (15.0, 37.0), (15.0, 44.0)])
"""The corners of a hopper, from what it pours into (pt)."""
_FALLING: Final = tuple((1.7 * (k + 0.6), x) for k, x in enumerate((0.0, 0.9, -0.8, 0.6, -0.4, 1.0, -1.0)))
_ROW: Final = tuple((CART_WHEEL - 0.7, 1.7 * k) for k in range(-3, 4))
_HEAPED: Final = ((0.5, 0.2), (1.5, -0.4), *_ROW, (2.0, 1.5), (2.0, -2.0))
"""Where grains fall and lie (pt), below what loses them and beside that."""
_LINK: Final = 2.6
"""The radius of a link in a heap (pt)."""
_HEAP: Final = ((5, 0.0), (4, 3.6), (2, 7.2))
"""How many links lie in each row of a heap, and how high (pt)."""
_ASIDE: Final = 16.0
"""How far from an edge over which a chain runs its heap lies (pt)."""
_UNDER: Final = 1.0


def _rocket(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    at, nose = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along), (0.0, 1.0))
    points = at + rocket_outline(*_ROCKET) @ np.array([nose, left(nose)])
    yield Stroke(points, sheet.pen(item), closed=True, fill=BODY, **sheet.named(item, LAYER_BODY + 0.3, symbol.at))


def _wagon(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a box on two wheels; one that loses or takes in something is wider above."""
    named, at = sheet.named(item, LAYER_BODY + 0.3, symbol.at), sheet.at(item.body, symbol.at)
    along = _level(sheet, item)
    up, half = left(along), np.array(WAGON) / 2
    flare = 1.2 if any(i.role == "flow" for i in _own(sheet, item)) else 1.0
    corners = np.array([(-flare, 1.0), (-1.0, -1.0), (1.0, -1.0), (flare, 1.0)]) * half
    yield Stroke(at + corners @ np.array([along, up]), sheet.pen(item), closed=True, fill=BODY, **named)
    for way in (-0.6, 0.6):
        centre = at - half[1] * up + way * half[0] * along
        yield Arc(centre, CART_WHEEL, sheet.pen(item), fill=PAPER, **{**named, "layer": LAYER_BODY + 0.35})


def _belt(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    at, along = sheet.at(item.body, symbol.at), _level(sheet, item)
    top = at + _BELT[1] / 2 * left(along) + np.outer([-0.5, 0.5], _BELT[0] * along)
    yield from belt_marks(sheet, item, top, _BELT[1])


def _level(sheet: Sheet, item: Item) -> Floats:
    """Return the way (2) along which a body runs, to the right."""
    rails = (i.form for i in sheet.scene.items if i.role == "guide" and item.body in i.bodies)
    axes = [sheet.way(-1, axis) for form in rails if (axis := getattr(form, "axis", None)) is not None]
    along = unit2(axes[0]) if axes else np.array([1.0, 0.0])
    return along if float(left(along) @ sheet.down) <= 0.0 else -along


def _pile(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    foot = sheet.at(item.body, symbol.at) + MASS[1] / 2 * sheet.down
    yield from _links(sheet, item, foot)


def _links(sheet: Sheet, item: Item, foot: Floats) -> Iterator[Mark]:
    """Yield a heap of links that stands on a place."""
    named, along = sheet.named(item, LAYER_BODY + 0.4), left(sheet.down)
    for count, height in _HEAP:
        for k in range(count):
            aside = 4.2 * (k - (count - 1) / 2.0)
            centre = foot + aside * along - (height + _LINK) * sheet.down
            yield Arc(centre, _LINK, sheet.pen(item), fill=PAPER, **named)


def _heap(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield the heap of which a chain is taken, and the chain from there over an edge."""
    end = sheet.at(item.body, symbol.at)
    edges = [
        sheet.page(i.body, i.form.bounds)
        for i in sheet.scene.items
        if i.on_ground and i.role == "surface" and isinstance(i.form, Polyline)
    ]
    near = min((edge for line in edges for edge in line), key=lambda p: float(np.linalg.norm(p - end)), default=end)
    on_line = any(_between(line, end) for line in edges)
    if on_line or not edges:
        yield from _links(sheet, item, end)
        return
    line = next(line for line in edges if any(np.array_equal(near, edge) for edge in line))
    inward = unit2(line.mean(axis=0) - near)
    foot = near + _ASIDE * inward
    named = sheet.named(item, LAYER_BODY)
    yield Stroke(np.array([foot - _LINK * sheet.down, end - _LINK * sheet.down, end]), CHAIN, **named)
    yield from _links(sheet, item, foot)


def _between(line: Floats, at: Floats) -> bool:
    """Return whether a place is on a line between its ends (2, 2)."""
    first, last = line[0], line[-1]
    ways = [float((end - at) @ unit2(last - first)) for end in (first, last)]
    return abs(float((at - first) @ left(unit2(last - first)))) < _UNDER and ways[0] <= _UNDER and ways[1] >= -_UNDER


def _jet(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield gas that leaves a nozzle, with the letter of its speed at an arrow."""
    at, way = sheet.at(item.body, symbol.at), unit2(sheet.way(item.body, symbol.along), (0.0, -1.0))
    if any(i.role == "body" and i.symbol is not None and i.symbol.kind == "rocket" for i in _own(sheet, item)):
        at = at + _ROCKET[0] / 2 * way
    named = sheet.named(item, LAYER_BODY - 0.1, symbol.at)
    for turn in (-0.3, -0.1, 0.1, 0.3):
        ahead = np.cos(turn) * way + np.sin(turn) * left(way)
        yield Stroke(at + np.outer([2.0, _JET], ahead) + 4.0 * turn * left(way), _SPRAY, **named)
    if item.letters:
        points = at + np.outer(_ARROW, way) + 11.0 * left(way)
        mine: dict[str, Any] = {"role": "velocity", "name": item.name}
        yield Arrow(points, VELOCITY, open=True, layer=LAYER_ARROW, **mine)
        prefer = (float(way[0]), float(way[1]))
        text = formula(item.letters)
        yield Wish(points[1:], text, prefer=prefer, colour=VELOCITY.colour, layer=LAYER_TEXT, **mine)


def _own(sheet: Sheet, item: Item) -> list[Item]:
    return sheet.touched.get(item.body, [])


def _leak(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield grains that drop off below a body, in a heap on the ground under a wagon."""
    at, named = sheet.at(item.body, symbol.at) + _below(sheet, item) * sheet.down, sheet.named(item, LAYER_BODY + 0.36)
    wagons = any(i.symbol is not None and i.symbol.kind == "wagon" for i in _own(sheet, item))
    for down, aside in _HEAPED if wagons else _FALLING:
        yield Arc(at + down * sheet.down + aside * left(sheet.down), _GRAIN, None, fill=BLACK, **named)


def _below(sheet: Sheet, item: Item) -> float:
    """Return how far a body reaches below its place (pt)."""
    at, found = sheet.at(item.body, (0.0, 0.0, 0.0)), [0.0]
    for other in _own(sheet, item):
        if other.role == "body":
            blocks = other.symbol is not None and other.symbol.kind in BLOCKS
            found.append(MASS[1] / 2 if blocks else float(((outline_of(sheet, other) - at) @ sheet.down).max()))
    return max(found)


def _hopper(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield a hopper above a body and what it pours."""
    up, named = -sheet.down, sheet.named(item, LAYER_GROUND, symbol.at)
    at = sheet.at(item.body, symbol.at)
    axes = np.array([left(sheet.down), up])
    yield Stroke(at + _FUNNEL @ axes, sheet.pen(item), closed=True, fill=BODY, **named)
    low, high = MASS[1] / 2, float(_FUNNEL[:, 1].min())
    for k, aside in enumerate((0.0, 1.0, -1.2, 0.8, -0.5, 1.3, -1.0, 0.4)):
        place = at + (high - (k + 0.5) * (high - low) / 8.0) * up + aside * axes[0]
        yield Arc(place, _GRAIN, None, fill=BLACK, **named)


def _mist(sheet: Sheet, item: Item, symbol: Symbol) -> Iterator[Mark]:
    """Yield drops around a body and ahead of it."""
    at, named = sheet.at(item.body, symbol.at), sheet.named(item, LAYER_GROUND, symbol.at)
    balls = (i.form for i in _own(sheet, item) if isinstance(i.form, (Disc, Sphere)))
    radius = max((ball.radius * sheet.projection.scale for ball in balls), default=MASS[0] / 2)
    for k in range(42):  # spread evenly by the golden angle, none behind
        turn, out = 2.39996 * k, radius + 6.0 + 26.0 * np.sqrt((k + 0.5) / 42.0)
        way = np.cos(turn) * sheet.down + np.sin(turn) * left(sheet.down)
        if float(way @ sheet.down) > -0.3:
            yield Arc(at + out * way, _GRAIN, None, fill=BLACK, **named)


FLOWS: Final[Mapping[str, Look]] = {
    "rocket": _rocket,
    "wagon": _wagon,
    "belt": _belt,
    "pile": _pile,
    "heap": _heap,
    "jet": _jet,
    "leak": _leak,
    "hopper": _hopper,
    "mist": _mist,
}
"""How each flow of mass looks, and each body that has one or carries it."""


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
    "bead": _filled(PIN, PAPER, LAYER_JOINT),
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
    # a point that a joint or what is fixed there shows, unless something touches it
    "used_point": lambda sheet, item, symbol: step_marks(sheet, item, sheet.at(item.body, symbol.at)),
    "torsion_spring": _torsion_spring,
    "torsion_damper": _torsion_damper,
    "motor": _filled(8.0, PAPER, LAYER_JOINT - 0.1),
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
