"""How flows of mass look: jets, leaks, hoppers, mist and heaps; and rockets, wagons, belts without a size."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.marks.place_symbols import CART_WHEEL, MASS, WAGON
from multibody_sym.pictures.marks.shapes import belt_marks, outline_of
from multibody_sym.pictures.marks.sheet import Sheet, left, unit2
from multibody_sym.pictures.page.picture import (
    BLACK,
    BODY,
    CHAIN,
    LAYER_ARROW,
    LAYER_BODY,
    LAYER_GROUND,
    LAYER_TEXT,
    PAPER,
    VELOCITY,
    Arc,
    Arrow,
    Mark,
    Pen,
    Stroke,
    Wish,
    formula,
)
from multibody_sym.pictures.scene.flows import rocket_outline
from multibody_sym.pictures.scene.items import BLOCKS, Disc, Item, Polyline, Sphere, Symbol
from multibody_sym.scalars.arrays import Floats

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
Look = Callable[[Sheet, Item, Symbol], Iterator[Mark]]


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
