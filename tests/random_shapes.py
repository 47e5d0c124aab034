"""Runs of random shapes that strike, slide and rest, judged by geometry, energy and momentum of their own.

    python tests/random_shapes.py TABLE --first 0 --models 80 --folder FAILED

TABLE is a file of JSON lines, one for each model, each run in a process of its own. Even seeds have nice numbers:
sizes, places and speeds on a grid, so that corners meet corners and edges lie flush; odd seeds have random ones. Every
seventh model moves in space. `--folder` keeps the files of models that fail.
"""

from __future__ import annotations

import argparse
import collections
import json
import math
import os
import random
import resource
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from pathlib import Path
from typing import Any, Final

import numpy as np

import multibody_sym as mbs

SECONDS: Final = 30
"""CPU time of both runs of a model."""
DEPTH: Final = 1e-6
"""How deep shapes may lie in each other, relative to the size of the model (1 m)."""
RISE: Final = 1e-8
"""By how much energy may rise, relative to the greatest energy."""
KEPT: Final = 1e-9
"""By how much momentum may change, relative to the sum of masses times greatest speeds."""
SAME: Final = 1e-9
"""By how much times of impacts may differ between runs of unlike length, relative to the time."""
STRONG: Final = 1e-3
"""The part of the strongest impulse above which impacts are compared: what bounces ever less is lost in rounding."""
APART: Final = 1e-3
"""The least gap at a random start (m)."""
SAMPLES: Final = 200
SHARE: Final = 0.7
"""The part of the time in which the second run ends."""
FLOOR: Final = "floor"
GRAVITY: Final = 10.0


# --- shapes


@dataclass(frozen=True)
class Part:
    """All points within `radius` (m) of the convex hull of `points` (n, d), which is flat or a box in space.

    `name` is the end of a contact, empty for the body itself. A plane has a `normal` (d,) and is solid behind it; of
    what is `hollow` all is solid but the inside.
    """

    name: str
    points: np.ndarray
    radius: float = 0.0
    normal: np.ndarray | None = None
    hollow: bool = False

    @property
    def is_point(self) -> bool:
        return len(self.points) == 1 and self.radius == 0.0 and self.normal is None


@dataclass(frozen=True)
class Solid:
    """A body with its parts in body axes, or the ground: what it is, as a file says it, and how it moves at the start.

    `com` (d,) and the principal moments of `inertia` (1,) or (3,) are about the centre of mass, along body axes; q is
    (x, y, angle), (x, y) of a particle, or (x, y, z) and a unit quaternion.
    """

    name: str
    kind: str
    declared: str
    parts: tuple[Part, ...]
    mass: float = 0.0
    com: np.ndarray = field(default_factory=lambda: np.zeros(2))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros(1))
    q: tuple[float, ...] = ()
    u: tuple[float, ...] = ()


@dataclass(frozen=True)
class Model:
    """Solids, the ground first, with restitution and friction of each pair, and gravity along -y, in space -z."""

    seed: int
    solids: tuple[Solid, ...]
    pairs: dict[tuple[int, int], tuple[float, float]]
    gravity: float
    t_end: float

    @property
    def space(self) -> bool:
        return len(self.solids[-1].com) == 3

    @property
    def floats(self) -> bool:
        """Whether nothing but the bodies themselves acts on them."""
        return self.gravity == 0.0 and not self.solids[0].parts


def placed(part: Part, q: Sequence[float]) -> Part:
    """Return a part of a body in the axes of the ground."""
    if not len(q):
        return part
    turn, place = rotation(q), np.array(q[: part.points.shape[1]])
    normal = None if part.normal is None else turn @ part.normal
    return replace(part, points=part.points @ turn.T + place, normal=normal)


def rotation(q: Sequence[float]) -> np.ndarray:
    """Return the rotation matrix of the coordinates of a body."""
    if len(q) == 2:
        return np.eye(2)
    if len(q) == 3:
        c, s = math.cos(q[2]), math.sin(q[2])
        return np.array([[c, -s], [s, c]])
    w, *v = np.array(q[3:]) / np.linalg.norm(q[3:])
    x, y, z = v
    wide = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2.0 * w * wide + 2.0 * wide @ wide


def distance(a: Part, b: Part) -> float:
    """Return the signed distance (m) of two parts: where negative, how far one has to move to be outside the other."""
    if b.normal is not None or b.hollow:
        a, b = b, a
    if a.normal is not None:
        return float(((b.points - a.points[0]) @ a.normal).min()) - b.radius
    if a.hollow:
        return a.radius - b.radius - float(np.linalg.norm(b.points - a.points[0], axis=1).max())
    core = _flat_cores(a.points, b.points) if a.points.shape[1] == 2 else _cores_in_space(a.points, b.points)
    return core - a.radius - b.radius


def _flat_cores(a: np.ndarray, b: np.ndarray) -> float:
    """Return the signed distance of two convex polygons, of which segments and points are some."""
    best = -math.inf
    for first, second in ((a, b), (b, a)):
        for p, q in _edges(first):
            along = q - p
            n = np.array([along[1], -along[0]]) / np.linalg.norm(along)
            ours, theirs = first @ n, second @ n
            best = max(best, theirs.min() - ours.max(), ours.min() - theirs.max())
    if best > 0.0 or best == -math.inf:
        return min(_point_segment(x, p, q) for one, two in ((a, b), (b, a)) for x in one for p, q in _pieces(two))
    return float(best)


def _edges(points: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    n = len(points)
    yield from ((points[k], points[(k + 1) % n]) for k in range(n if n > 2 else n - 1))


def _pieces(points: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    yield from _edges(points) if len(points) > 1 else [(points[0], points[0])]


def _point_segment(x: np.ndarray, p: np.ndarray, q: np.ndarray) -> float:
    along = q - p
    square = float(along @ along)
    s = min(1.0, max(0.0, float((x - p) @ along) / square)) if square else 0.0
    return float(np.linalg.norm(x - p - s * along))


def _cores_in_space(a: np.ndarray, b: np.ndarray) -> float:
    """Return the distance of a point from a point, a segment or a box; signed from a box."""
    a, b = sorted((a, b), key=len)
    if len(a) != 1:
        raise ValueError("nothing says how far these are apart in space")
    if len(b) < 3:
        return _point_segment(a[0], b[0], b[-1])
    middle, axes = b.mean(axis=0), b[[4, 2, 1]] - b[0]
    sizes = np.linalg.norm(axes, axis=1)
    beyond = np.abs(axes @ (a[0] - middle)) / sizes - sizes / 2
    return float(np.linalg.norm(np.maximum(beyond, 0.0)) + min(0.0, beyond.max()))


# --- models


def random_shapes(seed: int) -> Model:
    """Return the model of a seed. Its shapes do not lie in each other, and touch at most where the grid is nice."""
    rng = random.Random(seed)
    return (_Space if seed % 7 == 6 else _Flat)(seed, rng).model()


class _Flat:
    """The plane: boxes, discs, rods, dumbbells, stars of points, particles and drums over a floor, within walls."""

    kinds = ("box", "box", "disc", "rod", "particle", "dumbbell", "star")
    size = 2

    def __init__(self, seed: int, rng: random.Random) -> None:
        self.seed, self.rng, self.nice, self.inward = seed, rng, seed % 2 == 0, False
        self.axis = rng.randrange(self.size) if self.nice and rng.random() < 0.7 else None

    def model(self) -> Model:
        rng = self.rng
        while True:
            around = rng.choice(["none", "none", "floor", "floor", "walls", "walls", "drum", "shell", "ledge"])
            gravity = GRAVITY if around != "none" and rng.random() < 0.7 else 0.0
            self.inward = gravity == 0.0
            if self.axis is not None and not self.inward:
                self.axis = self.size - 1
            solids = [self.ground(around)]
            if around == "shell":
                solids.append(self.shell())
            count = rng.choice([2, 2, 3, 4]) - (around == "shell")
            kinds = [rng.choice(self.kinds) for _ in range(max(1, count))]
            for kind in kinds:
                self.add(solids, kind)
            solids = self.at_rest(solids)
            if len(solids) > 2:
                break
        pairs = {pair: self.laws() for pair in combinations(range(len(solids)), 2)}
        return Model(self.seed, tuple(solids), pairs, gravity, rng.choice([1.0, 1.5, 2.0]))

    def laws(self) -> tuple[float, float]:
        return self.rng.choice([0.0, 0.3, 0.5, 1.0]), self.rng.choice([0.0, 0.3, 0.7])

    def number(self, low: float, high: float, step: float = 0.5) -> float:
        """Return a number of a range, a multiple of the step where numbers are nice."""
        if self.nice:
            return step * self.rng.randint(math.ceil(low / step), math.floor(high / step))
        return round(self.rng.uniform(low, high), 4)

    def ground(self, around: str) -> Solid:
        """Return the ground: nothing, a floor with a bar or a peg, a floor and walls, a ledge, or a drum."""
        parts, texts = list[Part](), list[str]()

        def plane(name: str, through: tuple[float, float], normal: tuple[int, int]) -> None:
            parts.append(Part(name, np.array([through]), normal=np.array(normal)))
            texts.append(f"{name}: {{plane: [{through[0]}, {through[1]}, 0], normal: [{normal[0]}, {normal[1]}, 0]}}")

        if around in ("floor", "walls", "shell"):
            plane(FLOOR, (0.0, 0.0), (0, 1))
        if around == "walls":
            plane("left", (-3.0, 0.0), (1, 0))
            plane("right", (3.0, 0.0), (-1, 0))
            plane("top", (0.0, 5.0), (0, -1))
        if around == "ledge":
            parts.append(Part("ledge", np.array([[-1.0, 0.0], [1.0, 0.0]])))
            texts.append("ledge: {plane: [0, 0, 0], normal: y, between: [[-1, 0, 0], [1, 0, 0]]}")
        if around == "drum":
            parts.append(Part("drum", np.array([[0.0, 2.5]]), 3.0, hollow=True))
            texts.append("drum: {disc: 3, centre: [0, 2.5, 0], inside: true}")
        if around in ("floor", "walls") and self.rng.random() < 0.4:
            if self.rng.random() < 0.5:
                parts.append(Part("peg", np.array([[0.0, 1.0]]), 0.5))
                texts.append("peg: {disc: 0.5, centre: [0, 1, 0]}")
            else:
                parts.append(Part("bar", np.array([[-1.0, 1.0], [1.0, 1.0]])))
                texts.append("bar: {segment: [[-1, 1, 0], [1, 1, 0]]}")
        return Solid("ground", "ground", f"surfaces: {{{', '.join(texts)}}}" if texts else "", tuple(parts))

    def shell(self) -> Solid:
        mass = self.number(1.0, 5.0, 1.0)
        parts = (Part("outside", np.zeros((1, 2)), 2.0), Part("inside", np.zeros((1, 2)), 1.75, hollow=True))
        inertia = np.array([4.0 * mass])
        surfaces = "outside: {disc: 2}, inside: {disc: 1.75, inside: true}"
        text = f"mass: {mass}, inertia: [{2.0 * mass}, {2.0 * mass}, {4.0 * mass}, 0, 0, 0], surfaces: {{{surfaces}}}"
        u = (self.number(-1.0, 1.0), 0.0, self.number(-1.0, 1.0))
        return Solid("shell", "shell", text, parts, mass, np.zeros(2), inertia, (0.0, 2.0, 0.0), u)

    def add(self, solids: list[Solid], kind: str) -> None:
        """Add a body where there is room for it."""
        body = self.body(f"b{len(solids)}", kind)
        for _ in range(60):
            place = self.start(body)
            moved = replace(body, q=place, u=self.speeds(body, place))
            gaps = [gap for other in solids for gap in gaps_between(other, moved) if gap is not None]
            least = min(gaps, default=1.0)
            if least >= APART or (self.nice and least > -1e-12):
                solids.append(moved)
                return

    def body(self, name: str, kind: str) -> Solid:
        mass = self.number(0.5, 4.0)
        if kind == "box":
            a, b = self.number(0.5, 1.5), self.number(0.5, 1.5)
            corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]]) / 2
            inertia = mass * (a**2 + b**2) / 12
            return self.solid(name, kind, f"shape: {{box: [{a}, {b}, 1], mass: {mass}}}", corners, mass, inertia)
        if kind == "disc":
            r = self.number(0.2, 0.8, 0.25)
            return self.solid(
                name, kind, f"shape: {{disc: {r}, mass: {mass}}}", np.zeros((1, 2)), mass, mass * r**2 / 2, radius=r
            )
        if kind == "rod":
            length = self.number(0.5, 2.0)
            ends, com = np.array([[0.0, 0.0], [length, 0.0]]), np.array([length / 2, 0.0])
            text = f"shape: {{rod: {length}, mass: {mass}}}"
            return self.solid(name, kind, text, ends, mass, mass * length**2 / 12, com)
        if kind == "particle":
            return self.solid(name, kind, f"mass: {mass}", np.zeros((1, 2)), mass, 0.0)
        inertia = self.number(0.5, 1.0) * mass / 2
        text = f"mass: {mass}, inertia: [1, 1, {inertia!r}, 0, 0, 0]"
        if kind == "dumbbell":
            r, s = self.number(0.25, 0.5, 0.25), self.number(0.25, 0.5, 0.25)
            ends = (Part("p", np.array([[-0.5, 0.0]]), r), Part("q", np.array([[0.5, 0.0]]), s))
            surfaces = ", ".join(f"{e.name}: {{disc: {e.radius}, centre: [{e.points[0, 0]}, 0, 0]}}" for e in ends)
            text += f", surfaces: {{{surfaces}}}"
        else:
            places = [(0.5, 0.0), (-0.5, 0.5), (-0.5, -0.5)]
            ends = tuple(Part(f"p{k}", np.array([place])) for k, place in enumerate(places))
            points = ", ".join(f"p{k}: [{x}, {y}, 0]" for k, (x, y) in enumerate(places))
            text += f", points: {{{points}}}"
        return Solid(name, kind, text, ends, mass, np.zeros(2), np.array([inertia]))

    def solid(
        self,
        name: str,
        kind: str,
        text: str,
        points: np.ndarray,
        mass: float,
        inertia: float,
        com: np.ndarray | None = None,
        radius: float = 0.0,
    ) -> Solid:
        """Return a body of one part, itself."""
        com = np.zeros(2) if com is None else com
        return Solid(name, kind, text, (Part("", points, radius),), mass, com, np.array([inertia]))

    def start(self, body: Solid) -> tuple[float, ...]:
        x, y = self.number(-2.5, 2.5), self.number(0.0, 4.5, self.rng.choice([0.25, 0.5]))
        if self.axis == 0:
            y = 2.0 + self.number(0.0, 0.75, 0.25)
        if self.axis == 1:
            x = self.number(0.0, 0.75, 0.25)
        if body.kind == "particle":
            return x, y
        steps = self.rng.choice([0, 0, 0, 1, 2, 3, 0.5])
        return x, y, math.pi / 2 * steps if self.nice else round(self.rng.uniform(-3.0, 3.0), 4)

    def along(self, place: Sequence[float]) -> list[float]:
        """Return the speed of a body's origin: towards the middle where nothing falls, along the axis if any."""
        if self.axis is not None:
            speed = math.copysign(self.number(1.0, 2.0, 1.0), (2.25 if self.axis else 0.0) - place[self.axis])
            return [0.0 + speed * (k == self.axis) * (self.inward or self.rng.random() < 0.3) for k in range(self.size)]
        if not self.inward:
            return [self.number(-2.0, 2.0, 1.0) for _ in range(self.size)]
        middle = [0.0] * (self.size - 1) + [2.25]
        return [math.copysign(self.number(0.0, 2.0, 1.0), m - x) for m, x in zip(middle, place, strict=False)]

    def speeds(self, body: Solid, place: Sequence[float]) -> tuple[float, ...]:
        along = self.along(place)
        if body.kind == "particle":
            return tuple(along)
        return *along, self.rng.choice([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -2.0]) if self.nice else self.number(-4.0, 4.0)

    def at_rest(self, solids: list[Solid]) -> list[Solid]:
        """Return solids of which those that touch something at the start are at rest."""
        touching = {
            k
            for pair in combinations(range(len(solids)), 2)
            for gap in gaps_between(solids[pair[0]], solids[pair[1]])
            if gap is not None and gap < APART
            for k in pair
        }
        return [replace(x, u=tuple(0.0 for _ in x.u)) if k in touching else x for k, x in enumerate(solids)]


class _Space(_Flat):
    """Space: spheres, boxes and rods over a floor, within walls or in a bowl."""

    kinds = ("sphere", "sphere", "box", "rod")
    size = 3

    def ground(self, around: str) -> Solid:
        parts, texts = list[Part](), list[str]()
        planes = {FLOOR: ((0, 0, 0), (0, 0, 1)), "left": ((-3, 0, 0), (1, 0, 0)), "right": ((3, 0, 0), (-1, 0, 0))}
        for name, (through, normal) in planes.items():
            if around == "walls" or (around in ("floor", "shell", "ledge") and name == FLOOR):
                parts.append(Part(name, np.array([through], dtype=float), normal=np.array(normal, dtype=float)))
                texts.append(f"{name}: {{plane: {list(through)}, normal: {list(normal)}}}")
        if around == "drum":
            parts.append(Part("bowl", np.array([[0.0, 0.0, 2.5]]), 3.0, hollow=True))
            texts.append("bowl: {sphere: 3, centre: [0, 0, 2.5], inside: true}")
        return Solid("ground", "ground", f"surfaces: {{{', '.join(texts)}}}" if texts else "", tuple(parts))

    def shell(self) -> Solid:
        mass = self.number(1.0, 5.0, 1.0)
        parts = (Part("outside", np.zeros((1, 3)), 2.0), Part("inside", np.zeros((1, 3)), 1.75, hollow=True))
        inertia = np.full(3, 2.5 * mass)
        surfaces = "outside: {sphere: 2}, inside: {sphere: 1.75, inside: true}"
        text = f"mass: {mass}, inertia: {[*map(float, inertia), 0, 0, 0]}, surfaces: {{{surfaces}}}"
        q = (0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0)
        return Solid("shell", "shell", text, parts, mass, np.zeros(3), inertia, q, (self.number(-1, 1), *5 * (0.0,)))

    def body(self, name: str, kind: str) -> Solid:
        mass = self.number(0.5, 4.0)
        if kind == "box":
            a, b, c = sizes = [self.number(0.5, 1.5) for _ in range(3)]
            points = np.array([[x, y, z] for x in (-a, a) for y in (-b, b) for z in (-c, c)]) / 2
            inertia = mass / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
            text = f"shape: {{box: {sizes}, mass: {mass}}}"
            return Solid(name, kind, text, (Part("", points),), mass, np.zeros(3), inertia)
        if kind == "sphere":
            r = self.number(0.2, 0.8, 0.25)
            inertia = np.full(3, 0.4 * mass * r**2)
            text = f"shape: {{sphere: {r}, mass: {mass}}}"
            return Solid(name, kind, text, (Part("", np.zeros((1, 3)), r),), mass, np.zeros(3), inertia)
        length = self.number(0.5, 2.0)
        points, moment = np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]]), mass * length**2 / 12
        # A rod of a shape has no inertia about its axis, and turns about it in no definite way.
        moments = np.array([moment / 10, moment, moment])
        text = (
            f"mass: {mass}, com: [{length / 2}, 0, 0], inertia: {[*map(float, moments), 0, 0, 0]}, "
            f"surfaces: {{s: {{segment: [[0, 0, 0], [{length}, 0, 0]]}}}}"
        )
        return Solid(name, kind, text, (Part("s", points),), mass, points.mean(axis=0), moments)

    def start(self, body: Solid) -> tuple[float, ...]:
        place = [self.number(-2.0, 2.0), self.number(-1.0, 1.0), self.number(0.0, 4.5, 0.25)]
        if self.axis is not None:
            middle = (0.0, 0.0, 2.0)
            place = [x if k == self.axis else middle[k] + self.number(0.0, 0.5, 0.25) for k, x in enumerate(place)]
        if self.nice:
            turns = [(1.0, 0.0, 0.0, 0.0), (0.5**0.5, 0.0, 0.5**0.5, 0.0), (0.5**0.5, 0.0, 0.0, 0.5**0.5)]
            return *place, *self.rng.choice(turns)
        turn = np.array([self.rng.gauss(0.0, 1.0) for _ in range(4)])
        return *place, *map(float, turn / np.linalg.norm(turn))

    def speeds(self, body: Solid, place: Sequence[float]) -> tuple[float, ...]:
        along = self.along(place)
        still = self.nice and self.rng.random() < 0.5
        return *along, *(0.0 if still else self.number(-2.0, 2.0, 1.0) for _ in range(3))


def touches(first: Solid, second: Solid, a: Part, b: Part) -> bool:
    """Return whether parts are declared to touch: all but planes of the ground, two points, and two of the hollow.

    What is in a hollow body touches its inside, and nothing its outside. In space spheres touch all, others the floor.
    """
    kinds = {first.kind, second.kind}
    if (a.is_point and b.is_point) or (a.hollow and b.hollow):
        return False
    if "shell" in kinds:
        outside, other = (a, second) if first.kind == "shell" else (b, first)
        return outside.hollow == (other.kind != "ground")
    if len(a.points[0]) == 3 and first.kind != "ground":
        return "sphere" in kinds
    return True


def gaps_between(first: Solid, second: Solid) -> list[float | None]:
    """Return the gaps of all parts of two solids at the start (m), None for those that are not declared to touch."""
    return [
        distance(placed(a, first.q), placed(b, second.q)) if touches(first, second, a, b) else None
        for a in first.parts
        for b in second.parts
    ]


def text(model: Model) -> str:
    """Return the model as a file."""
    down = [0.0, 0.0, 0.0 - model.gravity] if model.space else [0.0, 0.0 - model.gravity, 0.0]
    lines = ["multibody_sym: 1", f"name: shapes_{model.seed}", f"gravity: {down}", "bodies:"]
    lines += [f"  {solid.name}: {{{solid.declared}}}" for solid in model.solids]
    lines.append("joints:")
    for solid in model.solids[1:]:
        kind = {2: "point", 3: "planar", 7: "free"}[len(solid.q)]
        initial = f"{{q: {list(solid.q)}, u: {list(solid.u)}}}"
        lines.append(f"  J{solid.name}: {{type: {kind}, parent: ground, child: {solid.name}, initial: {initial}}}")
    lines.append("contacts:")
    for k, (a, b, restitution, friction) in enumerate(_contacts(model)):
        rubs = f", static: {friction}" if friction else ""
        lines.append(f"  c{k}: {{between: [{a}, {b}], restitution: {restitution}{rubs}}}")
    return "\n".join(lines) + "\n"


_SIDES: Final = (("left", "right"), ("bottom", "top"), ("back", "front"))


def _contacts(model: Model) -> Iterator[tuple[str, str, float, float]]:
    """Yield the ends of all contacts with their coefficients; edges of boxes in space have their own."""
    for (i, j), laws in model.pairs.items():
        first, second = model.solids[i], model.solids[j]
        for a in first.parts:
            for b in second.parts:
                if not touches(first, second, a, b):
                    continue
                ends = [f"{x.name}.{part.name}" if part.name else x.name for x, part in ((second, b), (first, a))]
                yield ends[0], ends[1], *laws
                for k in (0, 1):
                    if model.space and "sphere" in (first.kind, second.kind) and (second, first)[k].kind == "box":
                        for one, two in combinations(_SIDES, 2):
                            for p in one:
                                for q in two:
                                    edge = f"{ends[k]}.{p}_{q}"
                                    yield (edge, ends[1], *laws) if k == 0 else (ends[0], edge, *laws)


# --- the judge


@dataclass(frozen=True)
class Verdict:
    """What is wrong with a run, one text each, and how often something struck; `refused` if it was not made."""

    wrong: tuple[str, ...]
    events: int = 0
    refused: str = ""


def judge(model: Model, **options: Any) -> Verdict:
    """Return the verdict on the run of a model, and on a shorter one."""
    system = mbs.loads(text(model))
    settings = {"rtol": 1e-10, "atol": 1e-12, **options}
    try:
        run = mbs.simulate(system, t_end=model.t_end, samples=SAMPLES + 1, **settings)
    except mbs.MultibodyError as error:
        return Verdict((), refused=str(error))
    wrong = list(passed(model, run.t, run.q))
    wrong += _energy(model, run) + _momentum(model, run)
    if not wrong:
        wrong += _shorter(model, system, run, settings)
    return Verdict(tuple(wrong), len(run.events))


def _states(model: Model, row: np.ndarray, *, speeds: bool = False) -> list[np.ndarray]:
    """Return the coordinates or speeds of each solid."""
    sizes = [len(x.u if speeds else x.q) for x in model.solids]
    return np.split(row, np.cumsum(sizes)[:-1])


def passed(model: Model, times: np.ndarray, q: np.ndarray) -> Iterator[str]:
    """Yield which parts lie in each other or got through each other, and when this shows first."""
    pairs = [
        (i, j, a, b)
        for i, j in model.pairs
        for a in model.solids[i].parts
        for b in model.solids[j].parts
        if touches(model.solids[i], model.solids[j], a, b)
    ]
    found = set[int]()
    before: dict[int, tuple[int, ...]] = {}
    for t, row in zip(times, q, strict=True):
        states = _states(model, row)
        for k, (i, j, a, b) in enumerate(pairs):
            if k in found:
                continue
            one, two = placed(a, states[i]), placed(b, states[j])
            names = f"{model.solids[i].name}.{a.name} and {model.solids[j].name}.{b.name}"
            depth = -distance(one, two)
            if depth > DEPTH:
                found.add(k)
                yield f"overlap: {names} by {depth:.3g} m at t = {t:.6g} s"
            sides = _sides(one, two)
            last = before.get(k, sides)
            if any(x * y < 0 for x, y in zip(last, sides, strict=True)):
                found.add(k)
                yield f"through: {names} before t = {t:.6g} s"
            before[k] = sides


def _sides(a: Part, b: Part) -> tuple[int, ...]:
    """Return on which side of a thin bar each point is that may strike it, 0 beyond its ends."""
    if a.points.shape[1] != 2:
        return ()
    found = []
    for bar, other in ((a, b), (b, a)):
        if len(bar.points) == 2 and other.radius == 0.0 and other.normal is None:
            p, along = bar.points[0], bar.points[1] - bar.points[0]
            for x in other.points:
                s = float((x - p) @ along) / float(along @ along)
                side = float(along[0] * (x - p)[1] - along[1] * (x - p)[0])
                found.append(int(np.sign(side)) if 0.1 < s < 0.9 and abs(side) > DEPTH else 0)
    return tuple(found)


def _centre(solid: Solid, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return place and velocity of a centre of mass, and the spin about it."""
    n = len(solid.com)
    turn = rotation(q)
    arm = turn @ solid.com
    if len(u) == 2:
        return q, u, np.zeros(1)
    if n == 2:
        return q[:2] + arm, u[:2] + u[2] * np.array([-arm[1], arm[0]]), solid.inertia * u[2]
    w = turn @ u[3:]
    return q[:3] + arm, u[:3] + np.cross(w, arm), turn @ (solid.inertia * u[3:])


def _moving(model: Model, run: Any) -> Iterator[list[tuple[Solid, np.ndarray, np.ndarray]]]:
    """Yield the bodies with their coordinates and speeds at each sample."""
    for q, u in zip(run.q, run.u, strict=True):
        yield list(zip(model.solids, _states(model, q), _states(model, u, speeds=True), strict=True))[1:]


def _energy(model: Model, run: Any) -> list[str]:
    energies, size = [], 1.0
    for bodies in _moving(model, run):
        total = 0.0
        for solid, q, u in bodies:
            place, speed, _ = _centre(solid, q, u)
            spin = u[len(solid.com) :]
            kinetic = (solid.mass * speed @ speed + float((solid.inertia * spin) @ spin if len(spin) else 0.0)) / 2
            potential = solid.mass * model.gravity * place[-1]
            size = max(size, kinetic + abs(potential))
            total += kinetic + potential
        energies.append(total)
    rise = np.array(energies) - np.minimum.accumulate(energies)
    k = int(np.argmax(rise > RISE * size))
    if not rise[k] > RISE * size:
        return []
    return [f"energy rises by {rise[k]:.3g} J of {size:.3g} J before t = {run.t[k]:.6g} s"]


def _momentum(model: Model, run: Any) -> list[str]:
    if not model.floats:
        return []
    every = []
    for bodies in _moving(model, run):
        linear, angular = np.zeros(model.solids[-1].com.shape), np.zeros(len(model.solids[-1].inertia))
        for solid, q, u in bodies:
            place, speed, spin = _centre(solid, q, u)
            linear = linear + solid.mass * speed
            moment = np.cross(place, speed) if len(place) == 3 else place[0] * speed[1] - place[1] * speed[0]
            angular = angular + spin + solid.mass * moment
        every.append(np.concatenate([linear, np.atleast_1d(angular)]))
    missed = np.abs(np.array(every) - every[0]).max(axis=1)
    size = 1.0 + sum(x.mass * float(np.abs(x.u).max()) for x in model.solids[1:])
    k = int(np.argmax(missed > KEPT * size))
    return [f"momentum changes by {missed[k]:.3g} before t = {run.t[k]:.6g} s"] if missed[k] > KEPT * size else []


def _shorter(model: Model, system: mbs.System, run: Any, settings: dict[str, Any]) -> list[str]:
    """Return what differs in a run that ends earlier."""
    samples = round(SHARE * SAMPLES)
    end = model.t_end * samples / SAMPLES
    try:
        other = mbs.simulate(system, t_end=end, samples=samples + 1, **settings)
    except mbs.MultibodyError as error:
        return [f"a run to {end:.6g} s is refused, one to {model.t_end:.6g} s is not: {error}"]
    strongest = max((x.get("impulse", 0.0) for x in run.events), default=0.0)
    impacts = [
        sorted((x["t"], x["element"]) for x in each.events if x.get("impulse", 0.0) > STRONG * strongest)
        for each in (run, other)
    ]
    first, second = ([x for x in each if x[0] < end - APART] for each in impacts)
    margin = SAME * model.t_end
    lone = [x for x in first if not any(x[1] == y[1] and abs(x[0] - y[0]) <= margin for y in second)]
    lone += [x for x in second if not any(x[1] == y[1] and abs(x[0] - y[0]) <= margin for y in first)]
    if lone:
        t, element = min(lone)
        return [f"to {end:.6g} s impacts differ: {element} at {t:.12g} s is in one of both runs"]
    missed = float(np.abs(other.q[-1] - run.q[samples]).max())
    return [f"to {end:.6g} s the end differs by {missed:.3g}"] if missed > 1e-7 else []


# --- the command line


def outcome(seed: int, seconds: int = SECONDS, **options: Any) -> dict[str, Any]:
    """Judge the model of a seed in a process of its own, which ends after a time; return a row of the table."""
    model = random_shapes(seed)
    kinds = " ".join(solid.kind for solid in model.solids[1:])
    row = {"seed": seed, "kinds": kinds, "ground": " ".join(x.name for x in model.solids[0].parts)}
    begun, (reads, writes) = time.monotonic(), os.pipe()
    if not (child := os.fork()):
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
            verdict = judge(model, **options)
            told = {"wrong": verdict.wrong, "events": verdict.events, "refused": verdict.refused}
        except Exception as error:  # an error that is no refusal is a failure of its own
            told = {"wrong": (f"{type(error).__name__}: {error}",), "events": 0, "refused": ""}
        os.write(writes, json.dumps(told).encode())
        os._exit(0)
    os.close(writes)
    with os.fdopen(reads, "rb") as pipe:
        found = pipe.read()
    os.waitpid(child, 0)
    told = json.loads(found) if found else {"wrong": (), "events": 0, "refused": "", "late": True}
    word = "late" if not found else "wrong" if told["wrong"] else "refused" if told["refused"] else "good"
    return {**row, "class": word, "seconds": round(time.monotonic() - begun, 1), **told}


def main(words: Sequence[str] | None = None) -> int:
    """Run models, print each that is not good, and the table's counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=Path)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--models", type=int, default=80)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--seconds", type=int, default=SECONDS)
    parser.add_argument("--backend", default="python")
    given = parser.parse_args(words)
    counts = collections.Counter[str]()
    with given.table.open("a") as table:
        for seed in range(given.first, given.first + given.models):
            row = outcome(seed, given.seconds, backend=given.backend)
            counts[row["class"]] += 1
            table.write(json.dumps(row) + "\n")
            table.flush()
            if row["class"] != "good":
                told = "; ".join(row["wrong"]) or row["refused"]
                print(f"{seed} {row['class']} ({row['kinds']} in {row['ground'] or 'nothing'}): {told}", flush=True)
                if given.folder:
                    given.folder.mkdir(parents=True, exist_ok=True)
                    (given.folder / f"{seed}.yaml").write_text(text(random_shapes(seed)))
    print(dict(counts))
    return 1 if counts["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
