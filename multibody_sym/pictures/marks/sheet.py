"""Sheet: a scene at a state, seen in a projection; what the functions that draw ask for places, directions and pens."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import combinations, pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.pictures.page.layout import distances
from multibody_sym.pictures.page.picture import (
    INK,
    LAYER_BODY,
    LAYER_JOINT,
    LAYER_STRAND,
    MARKED,
    ROD,
    Hatch,
    Pen,
    Projection,
)
from multibody_sym.pictures.scene.items import (
    BLOCKS,
    Axes,
    Disc,
    Face,
    Item,
    Path,
    Placed,
    PlacedStrand,
    Polyline,
    Rail,
    Symbol,
)
from multibody_sym.pictures.scene.scene import Scene
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import least_squares

Values = Sequence[float] | Floats
UNSEEN: Final = ("tie", "free", "contact", "point", "used_point", "drive_about", "drive_along", "friction")
"""Symbols whose place does not say how far a figure reaches."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A scene, where it is `placed`, where it begins (`home`), how it is seen; `marked` are paths with a word.

    In a motion `others` are places on the way, as far as which lines without ends are drawn.
    """

    scene: Scene
    placed: Placed
    home: Placed
    projection: Projection
    marked: Mapping[Path, str] = field(default_factory=dict)
    others: tuple[Placed, ...] = ()

    @property
    def flat(self) -> bool:
        """Whether a plane mechanism is seen across its plane."""
        return self.projection.flat

    def page(self, body: int, points: Any) -> Floats:
        """Return where points (n, 3) of a body are on the page (n, 2)."""
        found = self.projection.page(self.placed.world(body, np.asarray(points, dtype=float)))
        return found + self.settled.bodies[body] if body in self.settled.bodies else found

    def at(self, body: int, point: Values) -> Floats:
        """Return where a point of a body is on the page (2)."""
        return np.asarray(self.page(body, [point])[0])

    def through(self, item: Item, face: Face) -> Floats:
        """Return a place of a face on the page (2), which may lie lower than its plane."""
        lower = self.settled.lower.get(item.path, 0.0)
        return self.at(item.body, face.through) - lower * self.way(item.body, face.normal)

    def way(self, body: int, direction: Values) -> Floats:
        """Return a direction of a body on the page (2): of length 1 where it lies in the page, 0 across it."""
        turned = self.placed.turned(body, direction)
        return self.projection.page(turned) / self.projection.scale

    def depth(self, body: int, point: Values) -> float:
        """Return how far a point of a body is towards the reader (m)."""
        return float(self.projection.depth(self.placed.world(body, np.array([point])))[0])

    def metres(self, points: float) -> float:
        """Return a length on the page in metres."""
        return points / self.projection.scale

    def named(self, item: Any, layer: float, point: Values | None = None, *, body: int | None = None) -> dict[str, Any]:
        """Return what marks of an item say of themselves: role, name, layer and depth."""
        number = getattr(item, "body", -1) if body is None else body
        depth = 0.0 if self.flat or point is None else self.depth(number, point)
        if not self.flat and layer in (LAYER_BODY, LAYER_STRAND, LAYER_JOINT):
            depth += 1e-4 * self.scene.size * (layer - LAYER_BODY)
            layer = LAYER_BODY
        return {"role": getattr(item, "role", ""), "name": item.name, "layer": layer, "depth": depth}

    def pen(self, item: Any, pen: Pen = INK) -> Pen:
        """Return the pen for an item: another one if it is marked."""
        return MARKED if self.is_marked(item.path) else pen

    def is_marked(self, path: Path) -> bool:
        """Return whether a path, or what it is part of, is marked."""
        return any(path[: len(each)] == each for each in self.marked)

    @cached_property
    def ground(self) -> frozenset[int]:
        """The numbers of ground: that of the world, and of a ground that moves."""
        return frozenset({-1, *(k for k, name in enumerate(self.scene.bodies) if name == "ground")})

    @cached_property
    def settled(self) -> Settled:
        """How far things without a size are displaced on the page."""
        seen = self.projection
        return settle(self.scene, self.home, np.array(seen.right), np.array(seen.up), seen.scale)

    def moved(self, placed: Placed) -> Sheet:
        """Return the sheet of another instant, on which things without a size are displaced as on this one."""
        found = replace(self, placed=placed)
        found.__dict__["settled"] = self.settled  # as the cached property would have it
        return found

    @cached_property
    def span(self) -> Floats:
        """The lowest and highest places on the page of all that has ends (2, 2), now, at the start and on the way."""
        places = self.placed, self.home, *self.others
        points = [self.projection.page(points_drawn(self.scene, each)) for each in places]
        every = np.vstack(points)
        return np.array([every.min(axis=0), every.max(axis=0)])

    @cached_property
    def down(self) -> Floats:
        """The direction of gravity on the page (2), down where there is none in it."""
        found = self.projection.page(np.asarray(self.scene.gravity, dtype=float))
        size = float(np.linalg.norm(found))
        return np.array([0.0, -1.0]) if size == 0.0 else found / size

    @cached_property
    def touched(self) -> Mapping[int, list[Item]]:
        found: dict[int, list[Item]] = {}
        for item in self.scene.items:
            found.setdefault(item.body, []).append(item)
        return found


def points_drawn(scene: Scene, placed: Placed) -> Floats:
    """Return the points (n, 3) in the world between which a scene is drawn: all that has an end."""
    points = [np.zeros((0, 3))]
    for item in scene.items:
        if item.form.endless or isinstance(item.form, Axes):
            continue
        if item.symbol is not None and item.symbol.kind in UNSEEN:
            continue
        points.append(placed.world(item.body, item.form.bounds))
    for strand in placed.strands:
        points.append(strand.pieces.reshape(-1, 3))
    every = np.vstack(points)
    every = every[np.all(np.isfinite(every), axis=1)]
    if not len(every):
        every = np.vstack([placed.poses[:-1, :, 3], np.zeros((1, 3))])
    return every


def unit2(way: Values, otherwise: Values = (1.0, 0.0)) -> Floats:
    """Return a direction on the page (2) of length 1."""
    found = np.asarray(way, dtype=float)
    size = float(np.linalg.norm(found))
    return found / size if size > 1e-12 else np.asarray(otherwise, dtype=float)


def left(way: Values) -> Floats:
    """Return a direction (2) turned by a quarter to the left."""
    return np.array([-way[1], way[0]], dtype=float)


def hatched(points: Floats, pen: Pen, away: Floats, **fields: Any) -> Hatch:
    """Return a line (2, 2) of what stands still, with hatching on the side of a direction."""
    return Hatch(points, pen, side=1 if float(left(points[1] - points[0]) @ away) > 0.0 else -1, **fields)


# ----------------------------------------------------------------------------------------------------------------------
# Where things without a size stand on the page: on what they touch, beside what they would cover, as in a book.
#
# A mass without a size is drawn as a block, and its place is a point: on a plane it stands on that point, not half in
# it; two that hang on one rope over a wheel without a radius hang beside each other. Such displacements (pt) belong to
# bodies and are those of the start, so that nothing jumps while it moves; what has a size is never displaced.


MASS: Final = (24.0, 17.0)
"""Length and height of a mass without a size (pt)."""
WAGON: Final = (36.0, 17.0)
"""The same of one on wheels."""
BOB: Final = 5.0
"""The radius of a bob without a size (pt)."""
CART_WHEEL: Final = 3.5
"""The radius of the wheels of a wagon without a size (pt)."""
WHEEL: Final = 11.0
"""The radius of a pulley without one (pt)."""
_BESIDE: Final = 66.0
"""How far bodies without a size are apart that a spring of no length joins (pt)."""
STEEPEST: Final = 0.3
"""The cosine of the slope up to which something stands on it."""
_CLOSE: Final = 38.0
"""How far masses without a size are apart at least that a rope or spring joins (pt)."""
DRUM: Final = 6.0
"""The least radius of a drum on a body that hangs on its rope (pt)."""
_LEVEL: Final = 0.02
"""The sine of the angle to a plane up to which a rope runs along it."""
_PARTED: Final = 3.0 * ROD
"""How far rods are apart that would lie on each other (pt)."""
_SAME: Final = 1.0
_BACK: Final = 0.98
"""The cosine of the angle between two pieces of a rope above which it runs straight back."""
_SHARPEST: Final = float(np.arccos(_BACK)) / 2
"""Half of the angle between two pieces down to which a wheel lies in it; sharper ones run back."""


@dataclass(frozen=True, eq=False)
class Settled:
    """Displacements (pt) of `bodies` by number and of `pulleys` on ground by name; `leans` are directions of blocks.

    `folds` are, by rope, the displacements of the ends of its pieces where it runs straight back over wheels. `drums`
    are radii (pt), by body, of drums that would be too small to be seen. `lower` says how far (pt) faces, by path, lie
    below their planes, `seats` what of them is below the places of the bodies that stand there.
    """

    bodies: dict[int, Floats] = field(default_factory=dict)
    pulleys: dict[str, Floats] = field(default_factory=dict)
    leans: dict[int, Floats] = field(default_factory=dict)
    folds: dict[str, Floats] = field(default_factory=dict)
    drums: dict[int, float] = field(default_factory=dict)
    lower: dict[Path, float] = field(default_factory=dict)
    seats: dict[int, Floats] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Settling(Settled):
    """What was found so far, with the scene at its start on the page."""

    scene: Scene
    home: Placed
    axes: Floats
    scale: float

    def page(self, body: int, point: object) -> Floats:
        """Return where a point of a body is on the page (2)."""
        return np.asarray(self.scale * (self.axes @ self.home.world(body, np.array([point], dtype=float))[0]))

    def way(self, body: int, direction: object) -> Floats:
        """Return a direction of a body on the page (2)."""
        return np.asarray(self.axes @ self.home.turned(body, np.asarray(direction, dtype=float)))

    def mass(self, body: int) -> Symbol | None:
        """Return the symbol that stands for all of a body, None for one that has a size."""
        forms = [item.form for item in self.scene.items if item.body == body and item.role in ("body", "surface")]
        symbols = [form for form in forms if isinstance(form, Symbol) and form.kind in (*BLOCKS, "bob")]
        return symbols[0] if len(forms) == 1 and symbols else None


def settle(scene: Scene, home: Placed, right: Floats, up: Floats, scale: float) -> Settled:
    """Return where things without a size stand in a view."""
    made = _Settling(scene=scene, home=home, axes=np.array([right, up]), scale=scale)
    for strand in home.strands:
        _sink(made, strand)
    for strand in home.strands:
        _fold(made, strand)
    for strand in home.strands:
        _follow(made, strand)
    for _ in range(3):  # a block on a block on a block
        for item in scene.items:
            _stand(made, item)
    # rods, whose width is the page's affair, lie on what they touch in a plane, not half in it
    touching: dict[int, list[Floats]] = {}
    for item in made.scene.items if made.scene.plane else ():
        if item.role != "contact" or len(item.bodies) != 2:
            continue
        forms = [i.form for i in made.scene.items if i.body == item.body and i.role in ("body", "surface")]
        signs = (i for i in made.scene.items if i.role == "joint" and i.symbol is not None)
        alone = len(forms) == 1 and forms[0].open_line is not None
        if alone and not any(item.body in sign.bodies for sign in signs):  # a rod that no joint holds
            other = next((b for b in item.bodies if b != item.body), item.body)
            at = made.page(item.body, item.form.bounds[0])
            touching.setdefault(item.body, []).extend([*_normals(made, other, at)][:1])
    for body, normals in touching.items():
        if normals:
            way = least_squares(np.array(normals), np.full(len(normals), ROD / 2))
            if float(np.linalg.norm(way)) < ROD:  # between faces that leave it no room it stays where it is
                made.bodies[body] = way
    for strand in home.strands:
        _beside(made, strand)
        _widen(made, strand)
    _part(made)
    return made


def _widen(made: _Settling, rope: PlacedStrand) -> None:
    """Let the drum of a body that hangs on its own rope be large enough to be seen, with the rope along its rim."""
    for bow in rope.wound:
        centre, start = (made.scale * (made.axes @ np.array(place)) for place in (bow.centre, bow.start))
        radius = float(np.linalg.norm(centre - start))
        for item in made.scene.items:
            if item.role != "pulley" or item.body < 0 or not isinstance(item.form, Disc) or not 0.0 < radius < DRUM:
                continue
            hinged = any(i.role == "joint" and i.symbol is not None and item.body in i.bodies for i in made.scene.items)
            if not hinged and float(np.linalg.norm(made.page(item.body, item.form.centre) - centre)) < _SAME:
                made.drums[item.body] = DRUM
                made.bodies[item.body] = (DRUM - radius) * (centre - start) / radius


@dataclass(frozen=True, eq=False)
class _Rod:
    """A rod that one joint alone holds: its body, the parent, its ends on the page (2, 2), whether it is welded."""

    body: int
    parent: int
    ends: Floats
    welded: bool


def _part(made: _Settling) -> None:
    """Let a rod that lies along another one of the same parent, such as an arm of a folded chain, hang beside it."""
    for one, other in combinations(_held_once(made), 2):
        way, apart = other.ends[1] - other.ends[0], one.ends - other.ends[0]
        length = float(np.linalg.norm(way))
        along = way / max(length, _SAME)
        aside = np.abs(apart[:, 0] * along[1] - apart[:, 1] * along[0]).max()
        shared = min(float((apart @ along).max()), length) - max(float((apart @ along).min()), 0.0)
        if one.parent == other.parent and aside < _SAME and shared > _CLOSE:
            beside = np.array([along[1], -along[0]])
            right = beside if (beside[0], beside[1]) > (0.0, 0.0) else -beside
            made.bodies[other.body if one.welded else one.body] = _PARTED * right


def _held_once(made: _Settling) -> list[_Rod]:
    """Return the rods that one joint holds and nothing else."""
    found = []
    for item in made.scene.items if made.scene.plane else ():
        line = item.form.open_line
        if item.role != "body" or line is None or len(line.points) != 2:
            continue
        joints = [other for other in made.scene.items if other.role == "joint" and item.body in other.bodies]
        strands = [strand for strand in made.scene.strands if any(item.body == end.body for end in strand.anchors)]
        if len({joint.path for joint in joints}) == 1 and not strands and joints[0].bodies[1] == item.body:
            ends = np.array([made.page(item.body, point) for point in line.points])
            welded = any(joint.symbol is not None and joint.symbol.kind == "weld" for joint in joints)
            found.append(_Rod(item.body, joints[0].bodies[0], ends, welded))
    return found


def half_size(symbol: Symbol) -> float:
    """Return how high the middle of a mass without a size stands above what it touches (pt)."""
    return BOB if symbol.kind == "bob" else MASS[1] / 2


def _sink(made: _Settling, rope: PlacedStrand) -> None:
    """Let planes along which a rope runs to a wheel lie lower, under the masses without a size that it pulls.

    These would be lifted onto the planes else, and the rope, which is tangent to a wheel with a radius, would bend.
    """
    anchors = rope.strand.anchors
    if not rope.turns or len(anchors) < 2 or not made.scene.plane:
        return
    for anchor, piece in ((anchors[0], rope.pieces[0]), (anchors[-1], rope.pieces[-1])):
        way = made.axes @ (piece[1] - piece[0])
        forms = [i.form for i in made.scene.items if i.body == anchor.body and i.role in ("body", "surface")]
        if made.mass(anchor.body) is None and not all(isinstance(form, Face) for form in forms):
            continue
        contacts = [i for i in made.scene.items if i.role == "contact" and anchor.body in i.bodies]
        others = {body for contact in contacts for body in contact.bodies if body != anchor.body}
        for item in made.scene.items:
            if item.body not in others or not isinstance(item.form, Face) or item.form.ends is not None:
                continue
            normal = made.way(item.body, item.form.normal)
            height = (made.page(anchor.body, anchor.point) - made.page(item.body, item.form.through)) @ normal
            if abs(float(height)) < _SAME and abs(float(way @ normal)) < _LEVEL * float(np.linalg.norm(way)):
                made.lower[item.path] = MASS[1] / 2
                made.seats[anchor.body] = -MASS[1] / 2 * normal
                made.leans[anchor.body] = np.array([normal[1], -normal[0]])


def _stand(made: _Settling, item: Item) -> None:
    """Let a mass that touches a plane, or slides on another body, stand on it."""
    if item.role == "contact" and len(item.bodies) == 2 and item.symbol is not None:
        mass, other = made.mass(item.body), next((b for b in item.bodies if b != item.body), item.body)
        if item.body in made.seats:
            return
        normal = next(_normals(made, other, made.page(item.body, item.symbol.at)), None)
        if mass is not None and normal is not None:
            _lift(made, item.body, other, normal, half_size(mass))
    elif item.role == "joint" and item.on_ground and item.symbol is not None and item.symbol.kind == "weld":
        up = made.way(-1, made.scene.view.up)
        if len(item.bodies) == 2 and made.mass(item.bodies[1]) is not None and float(np.linalg.norm(up)) > 0.9:
            at = made.page(item.body, item.symbol.at)
            lines = [
                np.array([made.page(item.body, point) for point in item.form.points])
                for item in made.scene.items
                if item.on_ground and item.role == "surface" and isinstance(item.form, Polyline)
            ]
            on_segment = any(distances(at[None, :], np.hstack((x[:-1], x[1:]))).min() < _SAME for x in lines)
            drawn = on_segment or next(_normals(made, item.body, at), None) is not None
            _lift(made, item.bodies[1], item.bodies[0], up, MASS[1] / 2 if drawn else 0.0)
    elif item.role == "guide" and isinstance(item.form, Rail) and len(item.bodies) == 2 and not item.on_ground:
        parent, child = item.bodies
        mass, below = made.mass(child), made.mass(parent)
        along = made.way(parent, item.form.axis)
        if mass is None or below is None or below.kind not in BLOCKS or float(np.linalg.norm(along)) < 0.9:
            return
        normal = np.array([-along[1], along[0]])
        normal = normal if normal[1] > 0.0 else -normal
        if normal[1] < STEEPEST:
            return
        level = abs(float(normal[0])) < 0.05
        _lift(made, child, parent, normal, half_size(mass) + (MASS[1] / 2 if level else 0.0))


def _normals(made: _Settling, body: int, at: Floats) -> Iterator[Floats]:
    """Yield the directions away from the faces and rims of a body on which a place of the page lies."""
    for item in made.scene.items:
        if item.body == body and isinstance(item.form, Face):
            normal = made.way(body, item.form.normal)
            if abs(float((at - made.page(body, item.form.through)) @ normal)) < _SAME:
                yield normal
        elif item.body == body and isinstance(item.form, Disc):
            way = at - made.page(body, item.form.centre)
            apart = float(np.linalg.norm(way))
            if abs(apart - made.scale * item.form.radius) < _SAME < apart:
                yield (-way if item.form.hollow else way) / apart


def _lift(made: _Settling, body: int, carrier: int, normal: Floats, height: float) -> None:
    base = made.bodies.get(carrier, np.zeros(2))
    if height or np.any(base):
        made.bodies[body] = base + height * normal
    made.leans[body] = np.array([normal[1], -normal[0]])


# --- ropes ---------------------------------------------------------------------------------------------------------


def _fold(made: _Settling, rope: PlacedStrand) -> None:
    """Let the pieces of a rope that runs straight back over wheels without a radius hang beside each other."""
    if rope.strand.kind != "rope" or rope.turns or not np.all(np.isfinite(rope.pieces)):
        return
    pieces = made.scale * (rope.pieces @ made.axes.T)
    sides = [(before[0] - before[1], after[1] - after[0]) for before, after in pairwise(pieces)]
    sizes = [(float(np.linalg.norm(a)), float(np.linalg.norm(b))) for a, b in sides]
    folds = [
        min(size) > _SAME and float(a @ b) > _BACK * size[0] * size[1]
        for (a, b), size in zip(sides, sizes, strict=True)
    ]
    if not any(folds):
        return
    along = pieces[0][1] - pieces[0][0]
    across = np.array([1.0, 0.0]) if abs(along[1]) > abs(along[0]) else np.array([0.0, 1.0])
    ways = _ways(pieces, folds, across)
    made.folds[rope.strand.name] = ways
    first, last = rope.strand.anchors[0], rope.strand.anchors[-1]
    for anchor, way in ((first, ways[0][0]), (last, ways[-1][1])):
        if anchor.body >= 0:
            made.bodies[anchor.body] = way
    for k, fold in enumerate(folds):
        at = pieces[k][1]
        centre = None if fold else fillet(pieces[k][0], at, pieces[k + 1][1], WHEEL)
        for item in made.scene.items:
            if item.role != "pulley" or item.name in made.pulleys or item.symbol is None:
                continue
            if float(np.linalg.norm(made.page(item.body, item.symbol.at) - at)) >= _SAME:
                continue
            if fold:  # the first one moves with its body
                made.pulleys[item.name] = way = (ways[k][1] + ways[k + 1][0]) / 2
                if item.body >= 0:
                    made.bodies[item.body] = way
                break
            if centre is not None and made.mass(item.body) is not None and item.body not in made.bodies:
                shift = ways[k][1] + float((centre - at) @ across) * across
                made.pulleys[item.name] = made.bodies[item.body] = shift


def _ways(pieces: Floats, folds: list[bool], across: Floats) -> Floats:
    """Return the displacements of both ends of each piece (n, 2, 2).

    Pieces are a wheel apart where the rope runs back; the far end gives way by what the pieces come nearer there and
    by the wheel in a bend before them.
    """
    ways = np.zeros((len(pieces), 2))
    for k, fold in enumerate(folds):
        along, back = pieces[k][1] - pieces[k][0], pieces[k + 1][1] - pieces[k + 1][0]
        sine = abs(_cross(along, across)) / max(float(np.linalg.norm(along)), _SAME)
        wheel = 2.0 * WHEEL / max(sine, STEEPEST) * fold
        ways[k + 1] = ways[k][1] + wheel
        if fold:  # how much nearer the piece comes at the end of the shorter one
            longer, shorter = sorted((along, back), key=lambda piece: -float(np.linalg.norm(piece)))
            ways[k + 1][1] += max(-_cross(longer, shorter) / (_cross(longer, across) or np.inf), 0.0)
            ways[k + 1][1] += wheel if k and not folds[k - 1] else 0.0
    return np.asarray((ways - ways[-1][1] / 2)[:, :, None] * across)


def _cross(a: Floats, b: Floats) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def fillet(a: Floats, corner: Floats, b: Floats, radius: float) -> Floats | None:
    """Return the centre of the circle in the corner of two lines that touches both; None where they hardly bend."""
    one, two = ((end - corner) / max(float(np.linalg.norm(end - corner)), _SAME) for end in (a, b))
    half = 0.5 * float(np.arccos(np.clip(float(one @ two), -1.0, 1.0)))
    if half > 1.5 or half < _SHARPEST:
        return None
    middle = (one + two) / float(np.linalg.norm(one + two))
    return np.asarray(corner + middle * radius / np.sin(half))


def _follow(made: _Settling, strand: PlacedStrand) -> None:
    """Let what hangs on something that was displaced hang below it."""
    if strand.strand.name in made.folds or len(strand.strand.anchors) != 2 or len(strand.pieces) != 1:
        return
    first, second = (anchor.body for anchor in strand.strand.anchors)
    for one, other in ((first, second), (second, first)):
        if one in made.bodies and other >= 0 and other not in made.bodies:
            made.bodies[other] = made.bodies[one]
    a, b = made.scale * (strand.pieces[0] @ made.axes.T)
    apart = float(np.linalg.norm(b - a))
    if made.mass(first) and made.mass(second) and _SAME < apart < _CLOSE:
        made.bodies[second] = made.bodies.get(second, np.zeros(2)) + (_CLOSE - apart) * (b - a) / apart


def _beside(made: _Settling, strand: PlacedStrand) -> None:
    """Let bodies without a size that a strand of no length joins stand apart along their rail."""
    if len(strand.strand.anchors) != 2 or strand.strand.kind == "rope" or not len(strand.pieces):
        return
    first, second = (anchor.body for anchor in strand.strand.anchors)
    a, b = (made.page(anchor.body, anchor.point) for anchor in strand.strand.anchors)
    if min(first, second) < 0 or float(np.linalg.norm(a - b)) > _SAME or made.mass(second) is None:
        return
    rails = [i for i in made.scene.items if i.role == "guide" and isinstance(i.form, Rail) and second in i.bodies]
    way = made.way(rails[0].body, rails[0].form.axis) if rails and isinstance(rails[0].form, Rail) else (1.0, 0.0)
    made.bodies[second] = made.bodies.get(first, np.zeros(2)) + _BESIDE * np.asarray(way)
