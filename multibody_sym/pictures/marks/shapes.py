"""Forms with a size in metres: rods, plates, balls, boxes, faces, rails, stops. A new form is one entry in FORMS."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.ropes import wheels_on
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
    points_drawn,
    unit2,
)
from multibody_sym.pictures.page.picture import (
    AXIS,
    BLOCK,
    BODY,
    BOLD,
    CHAIN,
    DARK,
    HIDDEN,
    INK,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_JOINT,
    PAPER,
    PIN,
    ROD,
    THIN,
    Arc,
    Hatch,
    Mark,
    Pen,
    Stroke,
)
from multibody_sym.pictures.scene.bodies import hull
from multibody_sym.pictures.scene.items import (
    BLOCKS,
    Axes,
    Barrel,
    Block,
    Bowl,
    ConeBody,
    Disc,
    Face,
    Item,
    Polyline,
    Rail,
    Sphere,
    Stop,
    Symbol,
    TurnStop,
    Vector,
    circle,
    vector,
)
from multibody_sym.pictures.scene.items import GROUND as WORLD
from multibody_sym.scalars.arrays import Floats

_FACES: Final = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
"""The faces of a box by its corners."""
_LEAST_SLOPE: Final = 52.0
"""Half the least length of a slope (pt)."""
_LEAST_FLOOR: Final = 36.0
"""The same of level faces."""
_MARGIN: Final = 14.0
"""How far faces without ends reach beyond what stands on them (pt)."""
_HALF, _PLATE = 34.0, 12.0
"""Half the length of a face of a moving body, and how thick that is at least (pt)."""
SLOPE: Final = 62.0
"""Half the length of the slope of a wedge (pt)."""
_SHEET: Final = 46.0
"""How far a plane in space reaches at least beyond what is near it (pt)."""
_CURVE: Final = 20
"""From so many points on an open polyline of a body is a wire, not a bar."""
_ALONG: Final = 0.999
"""The cosine of the angle between an axle and the normal of a turntable."""
_AXIS: Final = 0.45
"""How far the axis of a top is seen above it, in its heights."""
_TRUCK_WHEEL: Final = 7.0
"""The radius of the wheels of a plate (pt)."""
_TOOTH: Final = 5.0
"""About how far apart the tooth marks of a gear are (pt)."""
_THIN_BAR: Final = 3.5
"""The width of bars in space (pt)."""


def capsule(a: Floats, b: Floats, width: float) -> Floats:
    """Return the outline of a bar with round ends (n, 2)."""
    along = unit2(b - a)
    first = float(np.arctan2(along[1], along[0]))
    turn = np.linspace(-np.pi / 2, np.pi / 2, 9)
    ends = [(b, first + turn), (a, first + np.pi + turn)]
    return np.vstack([c + width / 2 * np.column_stack((np.cos(t), np.sin(t))) for c, t in ends])


def _polyline(sheet: Sheet, item: Item, form: Polyline) -> Iterator[Mark]:
    points = sheet.page(item.body, form.points)
    pen = sheet.pen(item)
    if form.closed:
        named = sheet.named(item, LAYER_BODY, np.mean(form.points, axis=0))
        yield Stroke(points, pen, closed=True, fill=BODY, **named)
    elif len(points) > _CURVE or (item.role in ("guide", "surface") and (len(points) > 2 or item.on_ground)):
        named, bold = sheet.named(item, LAYER_GROUND), sheet.pen(item, BOLD)
        if item.role == "surface" and sheet.flat and not (item.on_ground and item.body != WORLD):  # hatched below
            side = 1 if float(left(unit2(points[-1] - points[0])) @ sheet.down) > 1e-9 else -1
            yield Hatch(points, bold, side=side, **named)
        else:
            yield Stroke(points, bold, **named)
    elif np.ptp(points, axis=0).max() < 1e-9:
        return
    else:
        width = ROD if sheet.flat else _THIN_BAR
        ways = points - points[0]
        straight = np.all(np.abs(ways @ left(unit2(ways[-1]))) < 0.5)
        pairs = [(0, len(points) - 1)] if straight else [(k, k + 1) for k in range(len(points) - 1)]
        for first, last in pairs:
            middle = np.add(form.points[first], form.points[last]) / 2
            if form.thin or form.chain:
                pen = sheet.pen(item, CHAIN if form.chain else BOLD)
                if form.chain and item.body in sheet.settled.bodies:
                    yield from _fold(sheet, item, points[first], points[last])
                yield Stroke(points[[first, last]], pen, **sheet.named(item, LAYER_BODY, middle))
                continue
            outline = capsule(points[first], points[last], width)
            yield Stroke(outline, pen, closed=True, fill=BODY, **sheet.named(item, LAYER_BODY, middle))


def _fold(sheet: Sheet, item: Item, first: Floats, last: Floats) -> Iterator[Mark]:
    """Yield the bow by which the end of a chain goes on into that of another one, beside which it hangs."""
    aside = sheet.settled.bodies[item.body]
    start = float(np.arctan2(*-aside[::-1])) + np.pi * (float(left(-aside) @ (last - first)) < 0.0)
    radius = float(np.linalg.norm(aside)) / 2
    yield Arc(last - aside / 2, radius, sheet.pen(item, CHAIN), start, start + np.pi, **sheet.named(item, LAYER_BODY))


def _disc(sheet: Sheet, item: Item, form: Disc) -> Iterator[Mark]:
    rim = circle(form.centre, form.axis, form.radius, 73)
    fill = None if form.hollow else BODY
    named = sheet.named(item, LAYER_BODY, form.centre)
    across = abs(float(sheet.placed.turned(item.body, form.axis) @ sheet.projection.toward))
    centre, radius = sheet.at(item.body, form.centre), form.radius * sheet.projection.scale
    if item.role == "pulley":
        radius = sheet.settled.drums.get(item.body, radius)
    pen = sheet.pen(item)
    if across < 1.0 - 1e-9:
        yield Stroke(sheet.page(item.body, rim), pen, closed=True, fill=fill, **named)
        if form.hollow:
            inner = circle(form.centre, form.axis, max(form.radius - sheet.metres(3.0), 0.9 * form.radius), 73)
            yield Stroke(sheet.page(item.body, inner), pen, closed=True, **named)
        return
    if form.hollow and item.role == "surface":
        yield from _hollow(sheet, item, centre, radius)
        return
    yield Arc(centre, radius, THIN if form.teeth or item.role == "drum" else pen, fill=fill, **named)
    if form.hollow:
        yield Arc(centre, max(radius - 3.0, 0.8 * radius), pen, **named)
    elif form.teeth:  # marks across the pitch circle turn with the wheel
        count = max(8, round(2 * np.pi * radius / _TOOTH))
        for point in sheet.page(item.body, circle(form.centre, form.axis, form.radius, count)):
            along = 2.2 * unit2(point - centre)
            yield Stroke(np.array([point - along, point + along]), THIN, **named)
    elif item.role == "pulley":
        yield Arc(centre, max(radius - 2.5, 0.75 * radius), THIN, **named)
    elif radius > 12.0 and item.role in ("body", "surface") and sheet.others:
        tip = sheet.at(item.body, np.add(form.centre, [0.82 * form.radius, 0, 0]))
        yield Stroke(np.array([centre + 0.3 * (tip - centre), tip]), THIN, **named)  # shows how far it has turned


def _hollow(sheet: Sheet, item: Item, centre: Floats, radius: float) -> Iterator[Mark]:
    """Yield a drum or bowl that is touched inside, all around: with hatching outside, as a ring if it moves."""
    if item.on_ground:
        angles = np.linspace(0.0, 2.0 * np.pi, 145)
        points = centre + radius * np.column_stack((np.cos(angles), np.sin(angles)))
        yield Hatch(points, sheet.pen(item, BOLD), side=-1, **sheet.named(item, LAYER_GROUND))
        return
    for size in (radius, radius + 3.5):
        yield Arc(centre, size, sheet.pen(item), **sheet.named(item, LAYER_GROUND))


def _ball(sheet: Sheet, item: Item, form: Sphere) -> Iterator[Mark]:
    named = sheet.named(item, LAYER_BODY, form.centre)
    centre, radius = sheet.at(item.body, form.centre), form.radius * sheet.projection.scale
    if form.hollow and item.role == "surface" and sheet.flat:
        yield from _hollow(sheet, item, centre, radius)
        return
    yield Arc(centre, radius, sheet.pen(item), fill=None if form.hollow else BODY, **named)
    if not sheet.flat and radius > 6.0:
        rim = circle(form.centre, (0.0, 0.0, 1.0), form.radius, 49)
        yield Stroke(sheet.page(item.body, rim), THIN, closed=True, **named)


def _block(sheet: Sheet, item: Item, form: Block) -> Iterator[Mark]:
    corners, pen = form.bounds, sheet.pen(item)
    points, named = sheet.page(item.body, corners), sheet.named(item, LAYER_BODY, form.centre)
    for face in _FACES:
        normal = corners[list(face)].mean(axis=0) - np.array(form.centre)
        facing = float(sheet.placed.turned(item.body, normal) @ sheet.projection.toward)
        if facing > 1e-9 * np.linalg.norm(form.sizes):
            yield Stroke(points[list(face)], pen, closed=True, fill=BODY, **named)


def barrel(
    sheet: Sheet, body: int, form: Barrel, pen: Pen, named: Mapping[str, Any], fill: str = BODY
) -> Iterator[Mark]:
    """Yield a cylinder: its outline, and the end that faces the reader."""
    axis = np.array(form.axis)
    toward = float(sheet.placed.turned(body, axis) @ sheet.projection.toward)
    ends = [np.array(form.centre) + sign * form.length / 2 * axis for sign in (-1.0, 1.0)]
    if abs(toward) > 1.0 - 1e-9:
        yield Arc(sheet.at(body, form.centre), form.radius * sheet.projection.scale, pen, fill=fill, **named)
        return
    near = ends[1] if toward >= 0.0 else ends[0]
    both = np.vstack([sheet.page(body, circle(end, form.axis, form.radius, 48)) for end in ends])
    yield Stroke(outline(both), pen, closed=True, fill=fill, **named)
    if abs(toward) > 0.02:
        yield Stroke(sheet.page(body, circle(near, form.axis, form.radius, 48)), pen, closed=True, fill=fill, **named)


def _cone(sheet: Sheet, item: Item, form: ConeBody) -> Iterator[Mark]:
    """Yield a cone: its outline, and its top where that faces the reader."""
    named, pen = sheet.named(item, LAYER_BODY, form.tip), sheet.pen(item)
    rim = circle(np.array(form.tip) + form.height * np.array(form.axis), form.axis, form.radius, 73)
    points = sheet.page(item.body, np.vstack([form.tip, rim]))
    yield Stroke(outline(points), pen, closed=True, fill=BODY, **named)
    toward = float(sheet.placed.turned(item.body, form.axis) @ sheet.projection.toward)
    if abs(toward) > 0.02:
        yield Stroke(points[1:], pen, closed=True, fill=BODY if toward > 0.0 else None, **named)
    top = points[1:].mean(axis=0)
    yield Stroke(np.array([top, top + _AXIS * (top - points[0])]), sheet.pen(item, AXIS), **named)


def outline(points: Floats) -> Floats:
    """Return the points that bound others (n, 2), around."""
    return points[hull(points)]


def _face(sheet: Sheet, item: Item, form: Face) -> Iterator[Mark]:
    """Yield a plane: a line with hatching where it is seen from its edge, else a sheet."""
    normal = sheet.way(item.body, form.normal)
    if float(np.linalg.norm(normal)) < 0.99:
        yield from _plate(sheet, item, form)
        return
    if not item.on_ground and form.ends is None and sheet.flat:
        yield from _moving_face(sheet, item, form)
        return
    touched = any(i.role == "contact" and item.body in i.bodies for i in sheet.scene.items)
    guided = any(i.role == "guide" and i.on_ground for i in sheet.scene.items)
    if item.on_ground and form.ends is None and guided and not touched:
        return  # what stands there shows its own rail
    points = face_ends(sheet, item)
    assert points is not None
    yield hatched(points, sheet.pen(item, BOLD), -normal, **sheet.named(item, LAYER_GROUND))
    for centre in wheels_on(sheet, item):
        near = min(points, key=lambda end: float(np.linalg.norm(end - centre)))
        outline_points = capsule(near, centre, 3.0)
        yield Stroke(outline_points, sheet.pen(item), closed=True, fill=BODY, **sheet.named(item, LAYER_GROUND))


def _moving_face(sheet: Sheet, item: Item, form: Face) -> Iterator[Mark]:
    """Yield a body behind a face: a belt, a plate on wheels, a wedge or a plate that slides."""
    named, points = sheet.named(item, LAYER_BODY), wedge(sheet, item, form)
    if form.rides == "belt":
        yield from belt_marks(sheet, item, points[:2], _PLATE)
        return
    if form.rides == "wheels":
        up = unit2(points[1] - points[2])
        points = np.vstack([points[:2], points[2:] + _TRUCK_WHEEL * up])
        inset = min(0.25, 2.5 * _TRUCK_WHEEL / float(np.linalg.norm(points[1] - points[0]))) * (points[1] - points[0])
        for centre in (points[2] - inset, points[3] + inset):
            yield Arc(centre, _TRUCK_WHEEL, sheet.pen(item), fill=PAPER, **{**named, "layer": LAYER_BODY + 0.1})
    yield Stroke(points, sheet.pen(item), closed=True, fill=BODY, **named)


def belt_marks(sheet: Sheet, item: Item, top: Floats, height: float) -> Iterator[Mark]:
    """Yield a belt that runs over two rollers, below its upper side (2, 2)."""
    along = unit2(top[1] - top[0])
    below = left(along) if float(left(along) @ sheet.down) > 0.0 else -left(along)
    named, ends = sheet.named(item, LAYER_BODY), top + height / 2 * below
    yield Stroke(capsule(ends[0], ends[1], height), sheet.pen(item), closed=True, fill=PAPER, **named)
    for end in ends:
        for radius in (height / 2 - 2.0, 1.2):
            yield Arc(end, radius, THIN, fill=BODY, **named)
        foot = end + (height / 2 + 7.0) * below
        yield Stroke(np.array([end, foot]), sheet.pen(item), **{**named, "layer": LAYER_GROUND})
        line = foot + np.outer([-7.0, 7.0], along)
        yield hatched(line, sheet.pen(item), below, **{**named, "layer": LAYER_GROUND})


def face_ends(sheet: Sheet, item: Item) -> Floats | None:
    """Return from where to where (2, 2) a face seen from its edge is drawn, None for another form."""
    form = item.form
    if not isinstance(form, Face):
        return None
    if form.ends is not None:
        return sheet.page(item.body, form.ends)
    normal = unit2(sheet.way(item.body, form.normal))
    through, along = sheet.through(item, form), left(normal)
    # along what stands near it
    ways = (_near(sheet, item) - through) @ along
    start, stop = float(ways.min()), float(ways.max())
    inclined = min(abs(float(along @ sheet.down)), abs(float(normal @ sheet.down))) > 0.05
    margin = max(_MARGIN, (_LEAST_SLOPE if inclined else _LEAST_FLOOR) - (stop - start) / 2)
    low, high = start - margin, stop + margin
    for centre in wheels_on(sheet, item):
        way = float((centre - through) @ along)
        if way > (start + stop) / 2:
            high = way - WHEEL - 3.0
        else:
            low = way + WHEEL + 3.0
    room = 0.05 * (stop - start) + 1.0
    for other in sheet.scene.items:
        if not isinstance(other.form, Face) or other is item or other.body != item.body:
            continue
        across = sheet.way(other.body, other.form.normal)
        lean = float(along @ across)
        if abs(lean) < 0.05:
            continue
        crossing = float((sheet.through(other, other.form) - through) @ across) / lean
        if stop - room <= crossing < high:
            high = crossing
        elif low < crossing <= start + room:
            low = crossing
    return np.array([through + low * along, through + high * along])


def _near(sheet: Sheet, item: Item, *, rest: bool = True) -> Floats:
    """Return the places on the page (n, 2) of the bodies that touch a body's face; of the `rest` if none does."""
    touching = {b for i in sheet.scene.items if i.role == "contact" and item.body in i.bodies for b in i.bodies}
    found = []
    moments = (sheet.home, *(sheet.others if item.body == WORLD else ()))
    for body in touching - ({item.body} if rest else {item.body, WORLD}):
        for other in sheet.touched.get(body, ()):
            if not other.form.endless:
                found.append(sheet.page(body, other.form.bounds))
                found += [sheet.projection.page(each.world(body, other.form.bounds)) for each in moments]
    if not found and not rest:
        return np.zeros((0, 2))
    if not found:
        low, high = sheet.span
        return np.array([(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])])
    return np.vstack(found)


def outline_of(sheet: Sheet, item: Item) -> Floats:
    """Return what bounds an item on the page (n, 2): of the endless face of a moving body the wedge behind it."""
    if isinstance(item.form, Face):
        return wedge(sheet, item, item.form)
    return sheet.page(item.body, item.form.bounds)


def wedge(sheet: Sheet, item: Item, form: Face) -> Floats:
    """Return the outline (n, 2) of a moving body behind a face: a wedge below a slope, a plate where it faces else."""
    normal = unit2(sheet.way(item.body, form.normal))
    along, through = left(normal), sheet.through(item, form)
    ways = (_near(sheet, item, rest=False) - through) @ along
    level = abs(float(normal @ left(sheet.down))) < 0.02 or float(normal @ sheet.down) > -0.02
    half = _HALF if level else SLOPE
    low, high = min([-half, *(ways - 8.0)]), max([half, *(ways + 8.0)])
    centres = (i for i in sheet.touched.get(item.body, ()) if i.role == "mass centre" and i.symbol is not None)
    centre = next((float((sheet.at(i.body, i.form.bounds[0]) - through) @ along) for i in centres), None)
    if centre is not None:  # a plate is as long on either side of its centre of mass
        half = max(centre - low, high - centre)
        low, high = centre - half, centre + half
    held = [i.form.bounds for i in sheet.touched.get(item.body, ()) if i.role == "point" and level]
    reach = [float((sheet.at(item.body, each[0]) - through) @ along) for each in held]
    low, high = min([low, *(way - 8.0 for way in reach)]), max([high, *(way + 8.0 for way in reach)])
    points = np.array([through + low * along, through + high * along])
    if level:
        foot = sheet.at(item.body, (0.0, 0.0, 0.0)) + sheet.settled.seats.get(item.body, np.zeros(2))
        below = float((through - foot) @ normal)
        if below > 2.0 * _HALF:  # higher than long: a block, not a column
            points += np.outer([-1.0, 1.0], 0.6 * below * along)
        return np.vstack([points, points[::-1] - max(below, _PLATE) * normal])
    heights = points @ -sheet.down
    foot, top = points[np.argmin(heights)], points[np.argmax(heights)]
    return np.array([foot, top, top + sheet.down * float((foot - top) @ sheet.down)])


def _plate(sheet: Sheet, item: Item, form: Face) -> Iterator[Mark]:
    """Yield a plane in space: a sheet as large as what is near it, in a thin line."""
    normal = np.array(form.normal)
    e1 = np.cross(normal, (0.0, 0.0, 1.0) if abs(normal[2]) < 0.9 else (1.0, 0.0, 0.0))
    e1 = e1 / np.linalg.norm(e1)
    e2 = np.cross(normal, e1)
    pose = sheet.home.poses[item.body]
    base = np.array(form.through)
    points = (points_drawn(sheet.scene, sheet.home) - pose[:, 3]) @ pose[:, :3] - base
    half = max(0.15 * sheet.scene.size, sheet.metres(_SHEET))
    axle = _axle(sheet, item, normal)
    if axle is not None:
        reach = np.linalg.norm(points - np.outer(points @ normal, normal) - (axle - base), axis=1)
        rim = circle(axle, normal, max(1.25 * float(reach.max()), 0.5 * half), 97)
        named = sheet.named(item, LAYER_GROUND)
        yield Stroke(sheet.page(item.body, rim), sheet.pen(item), closed=True, fill=BODY, **named)
        return
    lows = [min(float((points @ e).min()), 0.0) - half for e in (e1, e2)]
    highs = [max(float((points @ e).max()), 0.0) + half for e in (e1, e2)]
    corners = [(lows[0], lows[1]), (highs[0], lows[1]), (highs[0], highs[1]), (lows[0], highs[1])]
    sheet_points = sheet.page(item.body, [base + a * e1 + b * e2 for a, b in corners])
    named = sheet.named(item, LAYER_GROUND)
    yield Stroke(sheet_points, sheet.pen(item, THIN), closed=True, fill=PAPER, **named)
    order = np.argsort(sheet_points[:, 1])
    near = sheet_points[[min(order[0], order[1]), max(order[0], order[1])]]
    side = -1 if float(left(near[1] - near[0])[1]) > 0.0 else 1
    yield Hatch(near, sheet.pen(item, INK), side=side, **named)


def _axle(sheet: Sheet, item: Item, normal: Floats) -> Floats | None:
    """Return where in its plane the hinge of a turntable is, in its axes; None of another plane."""
    for other in sheet.scene.items:
        symbol = other.symbol
        if other.role != "joint" or symbol is None or symbol.kind not in ("pin", "pivot") or item.on_ground:
            continue
        axis = sheet.home.turned(other.body, symbol.axis) @ sheet.home.poses[item.body][:, :3]
        if other.bodies[1] == item.body and abs(float(axis @ normal)) > _ALONG:
            pose = sheet.home.poses[item.body]
            at = (sheet.home.world(other.body, np.array([symbol.at]))[0] - pose[:, 3]) @ pose[:, :3]
            return np.asarray(at - float((at - np.array(item.form.bounds[0])) @ normal) * normal)
    return None


def _bowl(sheet: Sheet, item: Item, form: Bowl) -> Iterator[Mark]:
    """Yield sections through the axis, and circles about it: the edge in a bold line."""
    named, count = sheet.named(item, LAYER_GROUND), len(form.profile)
    for angle in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
        yield Stroke(sheet.page(item.body, form.section(float(angle))), sheet.pen(item, THIN), **named)
    for k in (count // 3, 2 * count // 3):
        yield Stroke(sheet.page(item.body, form.ring(k)), sheet.pen(item, THIN), closed=True, **named)
    yield Stroke(sheet.page(item.body, form.ring(count - 1)), sheet.pen(item, BOLD), closed=True, **named)


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
# Rails of sliders: a line with hatching below the block, two where nothing presses it down, a thin one on a body.


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
_HALF_BLOCK: Final = 12.0
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
        if item.role in ("body", "surface") and (item.form.open_line is None):
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
        back, ahead = min([back, *(ways + _HALF_BLOCK)]), max([ahead, *(ways - _HALF_BLOCK)])
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
        found.append(outline - at if len(outline) else _stopped_block(sheet, item, form, other))
    corners = np.vstack(found or [_stopped_block(sheet, item, form, None)])
    heights = corners @ left(along)
    foot = base + float((corners @ along).max()) * along
    return foot + np.outer([heights.min() - _STOPS_BEYOND, heights.max() + _STOPS_BEYOND], left(along))


def _stops_reach(sheet: Sheet, form: Stop) -> float:
    """Return how far what is stopped in space reaches ahead of its place (pt)."""
    return sheet.projection.scale * form.front or _STOPS_SLEEVE[0]


def _stopped_block(sheet: Sheet, item: Item, form: Stop, body: Item | None) -> Floats:
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


FORMS: Final[Mapping[type[Any], Callable[[Sheet, Item, Any], Iterator[Mark]]]] = {
    Axes: lambda sheet, item, form: iter(()),  # they stand beside the figure
    Rail: rail_marks,
    **dict.fromkeys((Stop, TurnStop), stop_marks),
    Polyline: _polyline,
    Bowl: _bowl,
    Disc: _disc,
    Sphere: _ball,
    Block: _block,
    Barrel: lambda sheet, item, form: barrel(
        sheet, item.body, form, sheet.pen(item), sheet.named(item, LAYER_BODY, form.centre)
    ),
    ConeBody: _cone,
    Face: _face,
}
"""How each form looks; symbols are in `symbols`."""
