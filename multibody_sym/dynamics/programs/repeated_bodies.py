"""Programs of mechanisms with many like bodies, by scans with one kernel for each kind of body.

Bodies of a kind have the same declarations and forces of joints but for the slots that they name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from functools import partial
from itertools import accumulate, pairwise
from typing import Any, Final, TypeVar

from multibody_sym.dynamics.formalisms.articulated_body import eliminate_joint
from multibody_sym.dynamics.formalisms.composite_body import wrench_difference, wrench_sum
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.formalisms.inertia import TRIANGLE, Inertia, about_origin, articulated_inertia
from multibody_sym.dynamics.programs.quantities import Sources, column
from multibody_sym.mechanics.energy import body_kinetic_energy, springs_energy, weight_energy
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.load_records import JointForce, JointSpring, Load
from multibody_sym.mechanics.mechanism import ARRAY, Mechanism, TreeBody
from multibody_sym.mechanics.motion import (
    BodyMotion,
    Motion,
    PlacedMotion,
    State,
    arrays,
    body_acceleration,
    body_mass,
    body_motion,
    body_pose,
    from_parent,
    joint_rates,
    moving_parent,
    slot_state,
    spread,
)
from multibody_sym.mechanics.points import power, to_parent
from multibody_sym.mechanics.row_records import AngleRow, DistanceRow, ExpressionRow, Marker, PositionRow, VelocityRow
from multibody_sym.model.bodies import IDENTITY, ORIGIN, Pose
from multibody_sym.model.system import with_expressions
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace
from multibody_sym.program.tree_passes import Bodies, Pass, Result, Values, scan_tree
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD, postorder
from multibody_sym.scalars.functions import evaluate, maximum
from multibody_sym.scalars.node import ZERO, Node, as_node, slot
from multibody_sym.scalars.vectors import (
    UNIT_MATRIX,
    ZERO_VECTOR,
    Mat,
    Vec,
    negate,
    symmetric,
    unit_quaternion,
)

# ----------------------------------------------------------------------------------------------------------------------
# Literal numbers of many bodies as the constant part of the parameter vector: bodies alike in kind share one loop.
#
# A number in a model folds into the expressions with it, which keeps the code of few bodies short. With many bodies the
# code of each would be written out. Numbers of many bodies of few kinds are handed over as data, behind the named
# parameters: masses, centres, inertias, frames, axes, springs, dampers and forces of joints, gravity; points, lengths
# and factors of rows that close loops between them. Zero, one and minus one stay in the text, since they tell kinds
# apart and save operations.


_BODIES_WITH_DATA: Final = 8
"""Mean number of bodies of a kind from which on numbers are data."""
_ROWS: Final = (PositionRow, AngleRow, DistanceRow, ExpressionRow, VelocityRow)
"""Rows whose numbers become data."""
_IN_TEXT: Final = (0.0, 1.0, -1.0)
_FACTORS: Final = frozenset({"add", "mul", "div"})
"""Operations whose constant operands are data; others, powers above all, have other rules for each constant."""


def numbers_as_constants(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with literal numbers as constants where its bodies are many and of few kinds.

    The constants follow all other parameters, with their values. Numbers of closed loops become constants with those of
    the bodies that they join.
    """
    special = (mechanism.one_way, mechanism.relative, mechanism.impact, mechanism.parameters.constants)
    if any(special) or massless_speeds(mechanism):
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
    if len(bodies) < _BODIES_WITH_DATA * len(kinds):
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


@dataclass(frozen=True)
class BodyKind:
    """A kind of body as a mechanism of this one body on ground, in slots of its own; `state` has these as values."""

    mechanism: Mechanism
    state: State

    @property
    def body(self) -> TreeBody:
        return self.mechanism.bodies[0]


@dataclass(frozen=True)
class LikeBodies:
    """The kinds of a mechanism's bodies, and for each body its kind and the values of its slots (`bodies`)."""

    kinds: tuple[BodyKind, ...]
    bodies: Bodies


def like_bodies(mechanism: Mechanism) -> LikeBodies | None:
    """Return the kinds of bodies; None where a load acts on more than a joint's own speed."""
    places = places_of_loads(mechanism)
    if places is None:
        return None
    numbers: dict[Any, int] = {}
    kinds: list[BodyKind] = []
    leaves: list[tuple[Node, ...]] = []
    chosen, atoms = [], []
    for body, own in zip(mechanism.bodies, places, strict=True):
        local = _Local(body)
        q, u = tuple(range(len(body.q))), tuple(range(len(body.u)))
        renamed = local.of(replace(body, name="", joint_name="", parent=-1, q=q, u=u))  # the first on ground
        of_joint = (load for k in own if isinstance(load := mechanism.loads[k], JointForce | JointSpring))
        loads = local.of(tuple([replace(load, name="", joint="") for load in of_joint]))
        identity = renamed, loads, tuple(local.slots.values())
        if identity not in numbers:
            numbers[identity] = len(kinds)
            alone = replace(mechanism, bodies=(renamed,), loads=loads, rows=(), coordinates=(), speeds=())
            own_q, own_u = (tuple(leaf for leaf in identity[2] if leaf.data[0] == array) for array in "qu")
            kinds.append(BodyKind(alone, State(Node, own_q, own_u, {leaf: leaf for leaf in identity[2]})))
            leaves.append(identity[2])
        chosen.append(numbers[identity])
        atoms.append(tuple(local.slots))
    return LikeBodies(tuple(kinds), Bodies(tuple(chosen), tuple(leaves), tuple(atoms)))


T = TypeVar("T")


class _Local:
    """Renames the slots of one body: its own coordinates and speeds count from 0, then others by their occurrence."""

    def __init__(self, body: TreeBody) -> None:
        self.slots: dict[Node, Node] = {}
        self.counts: dict[str, int] = {}
        for array, places in (("q", body.q), ("u", body.u)):
            for place in places:
                self._leaf(slot(array, place))

    def of(self, part: T) -> T:
        """Return a part of the mechanism in its slots."""
        renamed: T = with_expressions(part, lambda node: evaluate([node], self._leaf)[0])
        return renamed

    def _leaf(self, leaf: Node) -> Node:
        if leaf not in self.slots:
            array = leaf.data[0]
            self.slots[leaf] = slot(array, self.counts.setdefault(array, 0))
            self.counts[array] += 1
        return self.slots[leaf]


# ----------------------------------------------------------------------------------------------------------------------
# The recursions of `block_ldl` as scans.
#
# A mechanism is scanned where its Programs would otherwise be long, its bodies are of few kinds (same joint, same
# expressions of parameters), and only the tree joins bodies: no rows, no loads but on a joint's own speed.


def scanned_sources(mechanism: Mechanism, like: LikeBodies) -> Sources:
    """Return the state derivative, the energies, and the motion of all bodies, by scans."""
    trace = Trace("energy", arrays(mechanism))
    once = (0,) * len(mechanism.bodies)
    results = [Result(name, 1, once, adds=True) for name in ("kinetic", "potential")]
    energies = scan_tree(
        trace, _inputs(trace), like.bodies, [_motion_pass(mechanism)], results, partial(_energies_of_body, like.kinds)
    )
    energy = trace.finish({name: ((), values) for name, values in energies.items()})
    return Sources(_state_derivative(mechanism, like), energy, partial(_scanned_motion, mechanism, like))


def _state_derivative(mechanism: Mechanism, like: LikeBodies) -> Program:
    """Return (t, q, u, ...) -> qdot, udot, multipliers, report by three passes along the tree.

    Outward angular velocities and the accelerations without udot, seen from free fall; inward articulated inertias and
    the remaining forces; outward the accelerations.
    """
    trace = Trace("state_derivative", arrays(mechanism))
    parents = tuple(body.parent for body in mechanism.bodies)
    passes = [
        Pass("motion", parents, 9, (*(ZERO,) * 3, *negate(mechanism.gravity), *(ZERO,) * 3)),
        Pass("carried", parents, 27),
        Pass("reached", parents, 6, (ZERO,) * 6),
    ]
    of_speeds = Result("udot", len(mechanism.speeds), tuple(min(body.u, default=0) for body in mechanism.bodies))
    results = [_of_coordinates("qdot", mechanism), of_speeds]
    found = scan_tree(trace, _inputs(trace), like.bodies, passes, results, partial(_dynamics_of_body, like.kinds))
    qdot = [*found["qdot"], *mechanism.rates]
    outputs = {"qdot": qdot, "udot": found["udot"], "multipliers": (), "report": (ZERO,) * 3}
    return trace.finish({name: column(values) for name, values in outputs.items()})


def _dynamics_of_body(kinds: Sequence[BodyKind], number: int, read: Values) -> Values:
    kind = kinds[number]
    body, state = kind.body, kind.state
    w, a, alpha = vectors(read["motion"])
    moved, mass = body_motion(body, moving_parent(w, ZERO_VECTOR, ZERO_VECTOR), state), body_mass(body, state)
    reached = body_acceleration(moved, w, (a, alpha), [0] * len(body.u))
    forces = applied_forces(Motion(kind.mechanism, state, (moved,), (mass,), ZERO_VECTOR), weight=False)
    rigid = about_origin(mass)
    needed = rigid.rate_of_momentum(reached[0], spread(reached[1], moved.w_WB))
    missing = wrench_difference(forces.of_body[0], needed)

    force, moment = vectors(read["carried"][:6])
    inertia = articulated_inertia(rigid).plus(unpack_inertia(read["carried"][6:]))
    joint, left = eliminate_joint(body.u, moved, inertia)
    remaining, wrench = joint.inward(forces.of_speed, wrench_sum(missing, (force, moment)))
    handed = to_parent(moved, wrench)

    first, second = vectors(read["reached"])
    udot, here = joint.outward(joint.pivot.solve(remaining), from_parent(moved, (first, second)))
    return {
        "motion": (*moved.w_WB, *reached[0], *reached[1]),
        "carried": (*handed[0], *handed[1], *pack_inertia(left.moved(moved.R_PB, moved.p_PB))),
        "reached": (*here[0], *here[1]),
        "qdot": joint_rates(body, state.q, state.u),
        "udot": udot,
    }


def _energies_of_body(kinds: Sequence[BodyKind], number: int, read: Values) -> Values:
    kind = kinds[number]
    moved, pose, gravity, handed = _motion_of_body(kind, read["motion"])
    mass = body_mass(kind.body, kind.state)
    springs = springs_energy(Motion(kind.mechanism, kind.state, (moved,), (mass,), gravity))
    return {
        "motion": handed,
        "kinetic": [body_kinetic_energy(moved, mass)],
        "potential": [weight_energy(pose, mass, gravity) + springs],
    }


def scanned_normalize(mechanism: Mechanism, like: LikeBodies) -> Program | None:
    """Return (t, q, u, ...) -> q with unit quaternions, largest deviation; None without quaternions."""
    if not any(body.quaternions for body in mechanism.bodies):
        return None
    trace, count = Trace("normalize", arrays(mechanism)), len(mechanism.bodies)
    largest = Pass("largest", tuple(range(-1, count - 1)), 1, (ZERO,))
    results = [_of_coordinates("q", mechanism), Result("deviation", count, tuple(range(count)))]
    found = scan_tree(trace, _inputs(trace), like.bodies, [largest], results, partial(_normalize_body, like.kinds))
    q = [*found["q"], *trace["q"][len(found["q"]) :]]
    return trace.finish({"q": column(q), "deviation": ((), found["deviation"][-1:])})


def _normalize_body(kinds: Sequence[BodyKind], number: int, read: Values) -> Values:
    body = kinds[number].body
    q = list(kinds[number].state.q[: len(body.q)])  # behind them stand those that its loads name
    largest = read["largest"][0]
    for places in body.quaternions:
        unit, off = unit_quaternion([q[k] for k in places])
        q[places[0] : places[-1] + 1], largest = unit, maximum(largest, off)
    return {"largest": [largest], "q": q, "deviation": [largest]}


# --- the motion of all bodies --------------------------------------------------------------------------------------


def _scanned_motion(mechanism: Mechanism, like: LikeBodies, trace: Trace) -> Motion:
    """Return the motion of all bodies over the results of a scan in the trace."""
    bodies = like.bodies
    found = [_motion_of_body(kind, _motion_pass(mechanism).slots) for kind in like.kinds]
    sizes = [len(_numbers((moved, pose))) for moved, pose, *_ in found]
    first = tuple(accumulate((sizes[kind] for kind in bodies.kinds), initial=0))

    def step(number: int, read: Values) -> Values:
        moved, pose, _, handed = _motion_of_body(like.kinds[number], read["motion"])
        return {"motion": handed, "numbers": _numbers((moved, pose))}

    result = Result("numbers", first[-1], first[:-1])
    numbers = scan_tree(trace, _inputs(trace), bodies, [_motion_pass(mechanism)], [result], step)["numbers"]
    placed = [
        _with_numbers(found[kind][:2], iter(numbers[begin:end]))
        for kind, (begin, end) in zip(bodies.kinds, pairwise(first), strict=True)
    ]
    state = slot_state(mechanism)
    masses = tuple(body_mass(body, state) for body in mechanism.bodies)
    motions, poses = zip(*placed, strict=True)
    return PlacedMotion(mechanism, state, motions, masses, mechanism.gravity, list(poses))


def _motion_pass(mechanism: Mechanism) -> Pass:
    """Return the pass that hands on velocities, gravity in body axes, pose, and gravity in world axes."""
    flat = tuple(as_node(x) for row in UNIT_MATRIX for x in row)
    root = (*(ZERO,) * 6, *mechanism.gravity, *flat, *(ZERO,) * 3, *mechanism.gravity)
    return Pass("motion", tuple(body.parent for body in mechanism.bodies), len(root), root)


def _motion_of_body(kind: BodyKind, read: Sequence[Node]) -> tuple[BodyMotion, tuple[Mat, Vec], Vec, list[Node]]:
    """Return a body's motion and pose, gravity in world axes, and the numbers that it hands on."""
    w, v, gravity, x, y, z, p, in_world = vectors(read)
    moved = body_motion(kind.body, moving_parent(w, v, gravity), kind.state)
    R_WB, p_WB = body_pose(moved, ((x, y, z), p))
    handed = (moved.w_WB, moved.v_WB, moved.gravity, *R_WB, p_WB, in_world)
    return moved, (R_WB, p_WB), in_world, [x for vector in handed for x in vector]


def _numbers(part: Any) -> list[Any]:
    """Return the numbers of a record of numbers, vectors and matrices, in order."""
    if is_dataclass(part):
        return [x for field in fields(part) for x in _numbers(getattr(part, field.name))]
    return [x for item in part for x in _numbers(item)] if isinstance(part, tuple) else [part]


def _with_numbers(part: Any, numbers: Iterator[Any]) -> Any:
    if is_dataclass(part) and not isinstance(part, type):
        new = {field.name: _with_numbers(getattr(part, field.name), numbers) for field in fields(part)}
        return replace(part, **new)
    return tuple(_with_numbers(item, numbers) for item in part) if isinstance(part, tuple) else next(numbers)


def _inputs(trace: Trace) -> list[tuple[Node, ...]]:
    return [trace[array.name] for array in trace.inputs]


def _of_coordinates(name: str, mechanism: Mechanism) -> Result:
    """Return the result that has an element for each coordinate of a joint."""
    count = len(mechanism.coordinates) - len(mechanism.rates)
    return Result(name, count, tuple(min(body.q, default=0) for body in mechanism.bodies))


def vectors(values: Sequence[Node]) -> list[Vec]:
    return [(values[k], values[k + 1], values[k + 2]) for k in range(0, len(values), 3)]


def pack_inertia(inertia: Inertia) -> tuple[Node, ...]:
    """Return the 21 elements of an inertia."""
    triangles = [[m[i][j] for i, j in TRIANGLE] for m in (inertia.linear, inertia.angular)]
    return (*triangles[0], *triangles[1], *(x for row in inertia.coupling for x in row))


def unpack_inertia(values: Sequence[Node]) -> Inertia:
    rows = vectors(values[12:])
    return Inertia(symmetric(values[:6]), (rows[0], rows[1], rows[2]), symmetric(values[6:12]))


# ----------------------------------------------------------------------------------------------------------------------
# Pivots of the mass matrix, by one pass inward: a long tree written out compiles for seconds.


_ARTICULATED: Final = 21
"""Numbers of an inertia that free joints are left out of."""


def scanned_pivots(mechanism: Mechanism, like: LikeBodies, trace: Trace, least: float) -> list[Node]:
    """Return each pivot of the mass matrix less the part `least` of its diagonal."""
    carried = Pass("carried", tuple(body.parent for body in mechanism.bodies), 2 * _ARTICULATED)
    result = Result("pivots", len(mechanism.speeds), tuple(min(body.u, default=0) for body in mechanism.bodies))
    step = partial(_pivots_of_body, like.kinds, least)
    return list(scan_tree(trace, _inputs(trace), like.bodies, [carried], [result], step)["pivots"])


def _pivots_of_body(kinds: Sequence[BodyKind], least: float, number: int, read: Values) -> Values:
    """Return the inertias that a body hands on, with free and with rigid joints, and its pivots."""
    kind = kinds[number]
    body, state = kind.body, kind.state
    moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
    own = articulated_inertia(about_origin(body_mass(body, state)))
    rigid = own.plus(unpack_inertia(read["carried"][_ARTICULATED:]))
    joint, left = eliminate_joint(body.u, moved, own.plus(unpack_inertia(read["carried"][:_ARTICULATED])))
    found = [
        as_node(pivot) - least * power(linear, angular, rigid.wrench(linear, angular))
        for pivot, linear, angular in zip(joint.pivot.pivots, moved.linear, moved.angular, strict=True)
    ]
    handed = (*pack_inertia(left.moved(moved.R_PB, moved.p_PB)), *pack_inertia(rigid.moved(moved.R_PB, moved.p_PB)))
    return {"carried": handed, "pivots": found}
