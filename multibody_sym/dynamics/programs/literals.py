"""Literal numbers of many bodies as the constant part of the parameter vector: bodies alike in kind share one loop.

A number in a model folds into the expressions with it, which keeps the code of few bodies short. With many bodies the
code of each would be written out. Numbers of many bodies of few kinds are handed over as data, behind the named
parameters: masses, centres, inertias, frames, axes, springs, dampers and forces of joints, gravity; points, lengths and
factors of rows that close loops between them. Zero, one and minus one stay in the text, since they tell kinds apart and
save operations.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any, Final

from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.mechanics.load_records import JointForce, JointSpring, Load
from multibody_sym.mechanics.mechanism import ARRAY, Mechanism, TreeBody
from multibody_sym.mechanics.row_records import AngleRow, DistanceRow, ExpressionRow, Marker, PositionRow, VelocityRow
from multibody_sym.model.bodies import IDENTITY, ORIGIN, Pose
from multibody_sym.scalars.elementary import BUILD, postorder
from multibody_sym.scalars.node import Node, slot

MANY_BODIES: Final = 48
"""From how many bodies on numbers are data (benchmarks/kinds.py): fewer compile in seconds, and are faster written out.

Robots have fewer.
"""
_BODIES_OF_A_KIND: Final = 8
"""Mean number of bodies of a kind from which on numbers are data."""
_ROWS: Final = (PositionRow, AngleRow, DistanceRow, ExpressionRow, VelocityRow)
"""Rows whose numbers become data."""
_IN_TEXT: Final = (0.0, 1.0, -1.0)
_FACTORS: Final = frozenset({"add", "mul", "div"})
"""Operations whose constant operands are data; others, powers above all, have other rules for each constant."""


def with_constants(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with literal numbers as constants where its bodies are many and of few kinds.

    The constants follow all other parameters, with their values. Numbers of closed loops become constants with those of
    the bodies that they join.
    """
    special = (mechanism.one_way, mechanism.relative, mechanism.impact, mechanism.parameters.constants)
    if len(mechanism.bodies) < MANY_BODIES or any(special) or massless_speeds(mechanism):
        return mechanism
    loads = places_of_loads(mechanism)
    if loads is None or not all(isinstance(row, _ROWS) for row in mechanism.rows):
        return mechanism
    constants, kinds = _Constants(len(mechanism.parameters)), set[Any]()
    gravity = constants.of("gravity", mechanism.gravity)
    bodies: list[TreeBody] = []
    pulling: dict[int, Load] = {}
    for body, own in zip(mechanism.bodies, loads, strict=True):
        constants.kind = [len(body.q)]
        bodies.append(constants.body(len(bodies), body))
        for place in own:
            pulling[place] = constants.of(f"{body.name} load {place}", mechanism.loads[place])
        kinds.add(tuple(constants.kind))
    if len(bodies) < _BODIES_OF_A_KIND * len(kinds):
        return mechanism
    closed = constants.closing(mechanism)
    if not constants.values:
        return mechanism
    return replace(
        closed,
        gravity=gravity,
        bodies=tuple(bodies),
        loads=tuple(pulling[place] for place in range(len(mechanism.loads))),
        parameters=mechanism.parameters.with_constants(constants.values),
    )


def places_of_loads(mechanism: Mechanism) -> list[list[int]] | None:
    """Return the places of the loads on each body's joint; None where one acts on more than a joint's own speed."""
    carried = {speed: index for index, body in enumerate(mechanism.bodies) for speed in body.u}
    found: list[list[int]] = [[] for _ in mechanism.bodies]
    for place, load in enumerate(mechanism.loads):
        if not isinstance(load, (JointForce, JointSpring)) or load.rate.op != "slot":
            return None
        found[carried[load.rate.data[1]]].append(place)
    return found


class _Constants:
    """Replaces literal numbers by slots behind the first `count` parameters, in the order of their occurrence.

    `values` are the numbers by name; `kind` gathers the features of a body's kind, without its numbers and places.
    A point that carries a joint has one set of numbers, whatever else is there, so that nothing is computed twice.
    """

    def __init__(self, count: int) -> None:
        self.values: dict[str, Node] = {}
        self.kind: list[Any] = []
        self._first = count
        self._fields: dict[type, tuple[str, ...]] = {}
        self._poses: dict[tuple[int, Pose], Pose] = {}

    def body(self, index: int, body: TreeBody) -> TreeBody:
        """Return a body of a mechanism, number `index`, with constants in place of its numbers."""
        made: TreeBody = self.of(body.name, body)
        self._poses[body.parent, body.frame_on_parent] = made.frame_on_parent
        self._poses[index, body.frame_on_body] = made.frame_on_body
        return made

    def closing(self, mechanism: Mechanism) -> Mechanism:
        """Return a mechanism, after its bodies, with constants in place of the numbers in rows and named points."""
        return replace(
            mechanism,
            rows=tuple(self.of(row.name, row) for row in mechanism.rows),
            cuts=tuple(self.of(cut.name, cut) for cut in mechanism.cuts),
            markers={name: self.of(name, marker) for name, marker in mechanism.markers.items()},
        )

    def of(self, name: str, part: Any) -> Any:
        """Return a part of a mechanism with constants in place of its numbers, by the path to each from `name`."""
        if isinstance(part, Node):
            return self._node(name, part)
        if part is ORIGIN or part is IDENTITY:
            self.kind.append(part)
            return part
        if type(part) is tuple:
            items = tuple([self.of(f"{name} {k}", x) for k, x in enumerate(part, 1)])
            return items if any(new is not old for new, old in zip(items, part, strict=True)) else part
        if isinstance(part, Marker):
            return self._marker(name, part)
        if type(part) in self._fields or (is_dataclass(part) and not isinstance(part, type)):
            self.kind.append(type(part))
            return self._record(name, part)
        self.kind.append(part)
        return part

    def _marker(self, name: str, marker: Marker) -> Marker:
        place = marker.body, marker.pose
        if place not in self._poses:
            self._poses[place] = self.of(f"{name} pose", marker.pose)
        found = self._poses[place]
        return marker if found is marker.pose else replace(marker, pose=found)

    def _record(self, name: str, part: Any) -> Any:
        kind = type(part)
        if kind not in self._fields:
            self._fields[kind] = tuple(field.name for field in fields(kind) if field.name not in _NAMES)
        changed = {}
        for field in self._fields[kind]:
            old = getattr(part, field)
            if (new := self.of(f"{name} {field}", old)) is not old:
                changed[field] = new
        return replace(part, **changed) if changed else part

    def _node(self, name: str, node: Node) -> Node:
        if node.shadow is not None:
            if node.shadow in _IN_TEXT:
                self.kind.append(node.shadow)
                return node
            self.kind.append(None)
            return self._constant(name, node)
        if not node.args:
            self.kind.append(node.data[0])
            return node
        return self._factors(name, node)

    def _factors(self, name: str, node: Node) -> Node:
        """Return an expression with constants in place of the numbers that it adds, multiplies or divides."""
        values: dict[Node, Node] = {}
        for n in postorder([node]):
            if n.shadow is not None:
                continue
            self.kind.append(n.op if n.args else n.data[0])
            operands = [self._operand(name, n.op, a) if a.shadow is not None else values[a] for a in n.args]
            values[n] = BUILD[n.op](*n.own, *operands) if operands else n
        return values[node]

    def _operand(self, name: str, op: str, constant: Node) -> Node:
        if op in _FACTORS:
            return self._node(name, constant)
        self.kind.append(constant.shadow)
        return constant

    def _constant(self, name: str, node: Node) -> Node:
        place = self._first + len(self.values)
        while name in self.values:
            name += "'"
        self.values[name] = node
        return slot(ARRAY, place)


_NAMES: Final = frozenset({"name", "joint", "joint_name", "parent", "q", "u"})
"""Fields in which bodies of a kind differ."""
