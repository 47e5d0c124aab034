"""On which side ropes and springs lie at the start, and which of their pieces keep their directions.

A load that is led along its rope hangs at the distance y_pulley - y, where in general there is a square root, as long
as it stays on its side. Formulas are written with that; programs are not, which hold on every side.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final, TypeVar

from multibody_sym.errors import MultibodyError
from multibody_sym.kinematics.loads import apart
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.ropes import Segment, segments, sides
from multibody_sym.kinematics.state import slot_state, state_of
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.loads import Load, PointPull, PointSpring
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rope_path import Bend
from multibody_sym.model.mechanism.rope_rows import RopeSlipRow
from multibody_sym.model.mechanism.rows import DistanceRow, RopeRow, Row
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import evaluate_float, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import Vec, cross, dot, scale, subtract

_TRIALS: Final = 4
_ROUNDING: Final = 1e-11

Line = TypeVar("Line", DistanceRow, PointSpring, PointPull)


@dataclass(frozen=True)
class Side:
    """What was decided: the `length` (in slots) of a piece between two markers, which is positive on its side."""

    element: str
    ends: tuple[str, str]
    length: Node


def straightened(
    mechanism: Mechanism, q: Sequence[float], u: Sequence[float], parameters: Sequence[float]
) -> tuple[Mechanism, tuple[Side, ...]]:
    """Return the mechanism with sides and directions as they are at a start (nq, nu, np), and what holds only there.

    A piece has its direction where that is the same whatever parameters and coordinates are, as random ones tell.
    """
    found: list[Side] = []
    try:
        there = motion_of(mechanism, state_of(mechanism, float, 0.0, list(q), list(u), list(parameters)))
        decider = _Decider(there, motion_of(mechanism, slot_state(mechanism)), found)
        rows = [decider.row(row) for row in mechanism.rows]
        loads = [decider.load(load) for load in mechanism.loads]
        one_way = [decider.element(element) for element in mechanism.one_way]
    except (*UNDEFINED, MultibodyError):
        return mechanism, ()
    decided = replace(mechanism, rows=tuple(rows), loads=tuple(loads), one_way=tuple(one_way))
    return decided, tuple(dict.fromkeys(found))


@dataclass
class _Decider:
    """The motion `there` in floats and `anywhere` in slots, and the sides that were found."""

    there: Motion
    anywhere: Motion
    found: list[Side]

    def row(self, row: Row) -> Row:
        """Return a row, a rope or rod with what was decided."""
        if isinstance(row, RopeRow):
            return self.rope(row)
        if isinstance(row, RopeSlipRow):
            return replace(row, rope=self.rope(row.rope))
        if isinstance(row, SlidingRow):
            frictions = tuple(replace(x, rows=tuple(map(self.row, x.rows))) for x in row.frictions)
            return replace(row, normal=self.row(row.normal), frictions=frictions)
        return self.line(row) if isinstance(row, DistanceRow) else row

    def element(self, element: OneWay) -> OneWay:
        """Return what holds one way only, a rope with what was decided."""
        if element.kind != "rope":
            return element
        frictions = tuple(replace(part, rows=tuple(map(self.row, part.rows))) for part in element.frictions)
        return replace(element, normals=tuple(map(self.row, element.normals)), frictions=frictions)

    def load(self, load: Load) -> Load:
        """Return a load, a spring or pull with what was decided."""
        if isinstance(load, PointSpring):
            return self.line(load)
        return self.line(load) if isinstance(load, PointPull) else load

    def rope(self, row: RopeRow) -> RopeRow:
        """Return a rope with the sides of its wheels, and directions of its pieces."""
        wheels = sides(self.there, row.path)
        path = tuple(
            bend if side is None else replace(bend, side=as_node(round(side)))
            for bend, side in zip(row.path, wheels, strict=True)
        )
        row = replace(row, path=path)
        here, everywhere = (segments(motion, path)[0] for motion in (self.there, self.anywhere))
        straight = tuple(self._direction(row.told[0], a, b.rims) for a, b in zip(here, everywhere, strict=True))
        ends = {0: straight[0], len(path) - 1: straight[-1]}
        path = tuple(_unturned(bend) if ends.get(k) is not None else bend for k, bend in enumerate(path))
        return replace(row, path=path, straight=straight if any(straight) else ())

    def line(self, part: Line) -> Line:
        """Return a rod or spring with its direction, if it keeps it."""
        d = apart(self.there, part.ends)
        length = float(sqrt(dot(d, d)))
        return replace(part, straight=self._direction(part.name, Segment(part.ends, length, scale(1 / length, d)), ()))

    def _direction(self, element: str, piece: Segment, rims: Sequence[Vec]) -> Point | None:
        """Return the direction (world) that a piece keeps, if it does; `rims` are radius times axis, signed."""
        d = apart(self.anywhere, piece.ends)
        for direction in self._candidates(d, piece.direction):
            along = dot(direction, d)
            rest = subtract(d, scale(along, direction))
            for rim in rims:
                rest = subtract(rest, cross(rim, direction))
            if self._vanish([as_node(x) for x in rest]):
                first, second = piece.ends
                self.found.append(Side(element, (first.name, second.name), as_node(along)))
                return direction
        return None

    def _candidates(self, d: Vec, here: Vec) -> Iterator[Point]:
        """Yield unit vectors of parameters along which coordinates move the second end relative to the first."""
        nodes = [as_node(x) for x in d]
        for leaf in leaves(nodes, "slot"):
            if leaf.data[0] != "q":
                continue
            way = tangents(nodes, {leaf: ONE})
            if any(x.data[0] != "parameters" for x in leaves(way, "slot")):
                continue
            square = dot(way, way)
            if not self._vanish([as_node(square - 1)]):
                way = [x / sqrt(square) for x in way]
            sense = dot(here, self.there.state.values(way))
            if abs(abs(sense) - 1.0) <= _ROUNDING:
                x, y, z = (as_node(x if sense > 0 else -x) for x in way)
                yield x, y, z

    def _vanish(self, nodes: Sequence[Node]) -> bool:
        """Return whether expressions are zero whatever parameters, coordinates and time are, as far as trials tell."""
        if all(node.shadow == 0 for node in nodes):
            return True
        chance = random.Random(1)
        named = leaves(nodes, "slot")
        for _ in range(_TRIALS):
            values = {leaf: self._beside(leaf, chance) for leaf in named}
            if any(abs(x) > _ROUNDING for x in evaluate_float(nodes, values)):
                return False
        return True

    def _beside(self, leaf: Node, chance: random.Random) -> float:
        """Return a value beside that at the start, for a slot."""
        here = float(self.there.state.slots.get(leaf, 0.0))
        if leaf.data[0] == "parameters" and here:
            return here * chance.uniform(0.7, 1.4)
        return here + chance.uniform(-0.5, 0.5)


def _unturned(bend: Bend) -> Bend:
    """Return a bend at which the rope keeps its direction, so that it does not matter which that was at the start."""
    return bend if bend.grip is None else replace(bend, grip=replace(bend.grip, start=ZERO))
