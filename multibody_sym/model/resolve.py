"""From a System to its Mechanism: references, names, tree order, slots. A pure function; every error has a path."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from multibody_sym.errors import ExpressionError, ModelError
from multibody_sym.expressions.quantities import QUANTITIES
from multibody_sym.expressions.units import Dimension, dimension_of
from multibody_sym.model.bodies import GROUND, IDENTITY, NO_MASS, ORIGIN, Pose, mass_of, pose_of, unit_vector
from multibody_sym.model.constraints import (
    Coupler,
    Distance,
    Expression,
    Gear,
    Plane,
    PointInPlane,
    PointOnLine,
    PrescribedMotion,
    Rolling,
    Rope,
    VelocityConstraint,
    row_names,
)
from multibody_sym.model.cuts import cut_rows, has_rows, normals_of, welded_rows
from multibody_sym.model.elements import Body, Damper, Drag, Force, Motor, Pull, SpringDamper, Surface, Torque
from multibody_sym.model.joints import Joint, MovingJoint, Step
from multibody_sym.model.lookup import Table, bends, interpolated
from multibody_sym.model.mechanism import (
    COMPONENTS,
    TIME,
    Bend,
    BodyTorque,
    Coordinate,
    CutJoint,
    DistanceRow,
    ExpressionRow,
    JointForce,
    JointSpring,
    Limit,
    Load,
    Marker,
    Mechanism,
    ParameterEntry,
    PointDrag,
    PointForce,
    PointPull,
    PointSpring,
    PositionRow,
    RollingRow,
    RopeRow,
    Row,
    Speed,
    TreeBody,
    VelocityRow,
    span_leaves,
)
from multibody_sym.model.slots import AXES, Element, at, dimension_of_unit, suggestion
from multibody_sym.model.system import RESERVED, System, expressions, verify_symbol, verify_system, with_expressions
from multibody_sym.model.tree import SpanningTree, body_part, coordinate_names, spanning_tree, speed_names, used_joints
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.kinks import switching_function, switching_functions
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, leaves, negate, slot, symbol


def mechanism(system: System) -> Mechanism:
    """Return the mechanism that a system declares.

    Raises ModelError (with the path of the field) for unknown names, wrong dimensions, bodies that nothing joins, and
    whatever else contradicts itself.
    """
    verify_system(system)
    tree = spanning_tree(system)
    doubled = _doubled(system, tree)
    joints = [(name, system.joints[name]) for name in (*tree.carrying, *doubled)]
    coordinates = tuple(c for name, joint in joints for c in _coordinates(name, joint))
    speeds = tuple(s for name, joint in joints for s in _speeds(name, joint))
    names = _names(system, coordinates, speeds)
    spanned = _with_spans(system, names)
    _verify_expressions(spanned, names)
    slots = _slots(system, coordinates, speeds)

    def in_slots(part: Any) -> Any:
        return with_expressions(part, lambda node: _in(slots, node))

    resolved = in_slots(spanned)
    resolver = _Resolver(resolved, _body_numbers(tree, system), slots)
    bodies = (*resolver.ground(), *resolver.bodies(tree.carrying, doubled))
    rows = resolver.rows(bodies)
    cuts = resolver.cuts([name for name in tree.cut if name not in doubled], doubled, rows)
    return Mechanism(
        name=system.name,
        gravity=resolved.gravity,
        bodies=bodies,
        markers=resolver.markers(),
        coordinates=tuple(replace(c, initial=_in(slots, c.initial)) for c in coordinates),
        speeds=tuple(replace(s, initial=_in(slots, s.initial)) for s in speeds),
        parameters=_parameter_entries(system, slots, len(rows)),
        inputs={name: interpolated(x) if isinstance(x, Table) else x for name, x in resolved.inputs.items()},
        outputs=resolved.outputs,
        stops={name: switching_function(condition) for name, condition in resolved.stop.items()},
        kinks=_kinks(resolved),
        loads=tuple(resolver.loads(bodies)),
        rows=tuple(rows),
        limits=tuple(resolver.limits(bodies)),
        cuts=tuple(cuts),
        symbols=slots,
    )


def _changes(node: Node) -> bool:
    """Return whether an expression depends on more than parameters."""
    return bool(leaves([node], "quantity")) or any(leaf.data[0] != "parameters" for leaf in leaves([node], "slot"))


_SPANS: Final = (symbol("distance"), symbol("distance_rate"))


def _with_spans(system: System, names: Mapping[str, str]) -> System:
    """Return the system with `distance` and `distance_rate` in the laws of pulls replaced by what they stand for."""
    if not any(isinstance(element, Pull) for element in system.forces.values()):
        return system
    spanned = {
        name: _with_span(name, element, names) if isinstance(element, Pull) else element
        for name, element in system.forces.items()
    }
    return replace(system, forces=spanned)


def _with_span(name: str, pull: Pull, names: Mapping[str, str]) -> Pull:
    """Return a pull with the leaves of its own span. Raises ModelError where the model calls something else so."""
    spans = dict(zip(_SPANS, span_leaves(name), strict=True))
    for leaf in leaves([pull.value], "symbol"):
        if leaf in spans and leaf.data in names:
            with at("forces", name, "value"):
                also = names[leaf.data]
                raise ModelError(f"{leaf.data!r} is that of the points here and {also} too; rename the latter")
    return replace(pull, value=evaluate([pull.value], lambda leaf: spans.get(leaf, leaf))[0])


def _in(slots: Mapping[Node, Node], node: Node) -> Node:
    if not node.args:
        return slots.get(node, node)
    return as_node(evaluate([node], lambda leaf: slots.get(leaf, leaf))[0])


def _kinks(resolved: System) -> tuple[Node, ...]:
    """Return the switching functions of forces, constraints, motions and inputs that change with time or motion."""
    parts = (resolved.forces, resolved.constraints, resolved.inputs, resolved.joints, resolved.bodies)
    found = switching_functions([written.node for part in parts for written in expressions(part)])
    tables = [x for x in resolved.inputs.values() if isinstance(x, Table)]
    return tuple(g for g in (*found, *(g for table in tables for g in bends(table))) if _changes(g))


def _doubled(system: System, tree: SpanningTree) -> list[str]:
    """Return the cut joints that keep their coordinates, because these are used or no rows can stand for the joint.

    Such a joint carries a massless double of its child, which rows hold to the child itself.
    """
    used = used_joints(system)
    return [name for name in tree.cut if name in used or not has_rows(system.joints[name])]


def _body_numbers(tree: SpanningTree, system: System) -> dict[str, int]:
    """Return the places of the bodies in tree order; a moving ground comes first."""
    carried = [body_part(system.joints[name].child, system.bodies)[0] for name in tree.carrying]
    return {name: number for number, name in enumerate([GROUND, *carried], 0 if _moves(system.bodies) else -1)}


def _moves(bodies: Mapping[str, Body]) -> bool:
    """Return whether ground moves. Raises ModelError for a motion of another body, or a joint's name that it takes."""
    for name, body in bodies.items():
        if body.motion is not None and name != GROUND:
            with at("bodies", name, "motion"):
                raise ModelError("only ground moves by itself; prescribe the motion of the joint that carries the body")
    return GROUND in bodies and bodies[GROUND].motion is not None


# --- names ---------------------------------------------------------------------------------------------------------


def _coordinates(name: str, joint: Joint) -> list[Coordinate]:
    initial = joint.initial if isinstance(joint, MovingJoint) else None
    values = initial.q if initial and initial.q else None
    start = values or tuple(as_node(x) for x in joint.zero_coordinates)
    names = coordinate_names(name, joint)
    known = bool(initial and initial.known)
    return [
        Coordinate(q, name, unit, value, values is not None, known)
        for q, unit, value in zip(names, joint.coordinate_units, start, strict=True)
    ]


def _speeds(name: str, joint: Joint) -> list[Speed]:
    initial = joint.initial if isinstance(joint, MovingJoint) else None
    values = initial.u if initial and initial.u else None
    names = speed_names(name, joint)
    start = values or (ZERO,) * len(names)
    return [
        Speed(u, name, unit, value, values is not None)
        for u, unit, value in zip(names, joint.speed_units, start, strict=True)
    ]


def _names(system: System, coordinates: Iterable[Coordinate], speeds: Iterable[Speed]) -> dict[str, str]:
    """Return what each name in expressions stands for; raise where two things share one."""
    taken = {"t": "the time"}
    declared: list[tuple[str, str, tuple[str, ...]]] = [
        *((name, "a parameter", ("parameters", name)) for name in system.parameters),
        *((c.name, "a coordinate", ("joints", c.joint)) for c in coordinates),
        *((s.name, "a speed", ("joints", s.joint)) for s in speeds),
        *((name, "an input", ("inputs", name)) for name in system.inputs),
    ]
    for name, what, path in declared:
        with at(*path):
            if name not in RESERVED:
                _verify_name(name, what)
            if name in taken or name in RESERVED:
                raise ModelError(f"{name!r} cannot be {what}: it is {taken.get(name, 'reserved')}; choose another name")
        taken[name] = what
    return taken


def _verify_name(name: str, what: str) -> None:
    try:
        verify_symbol(name)
    except ModelError as error:
        hint = "; name the joint's coordinates with q:" if what in ("a coordinate", "a speed") else ""
        raise ModelError(error.message + hint) from None


def _slots(system: System, coordinates: Iterable[Coordinate], speeds: Iterable[Speed]) -> dict[Node, Node]:
    tables = {
        "parameters": list(system.parameters),
        "q": [c.name for c in coordinates],
        "u": [s.name for s in speeds],
        "inputs": list(system.inputs),
    }
    slots = {symbol(name): slot(array, i) for array, names in tables.items() for i, name in enumerate(names)}
    return {symbol("t"): TIME, **slots}


# --- what expressions may say --------------------------------------------------------------------------------------

_MOTION: Final = "motion"
_ONLY_PARAMETERS: Final = ("a parameter",)
_MAY_NAME: Final[Mapping[str, tuple[str, ...]]] = {
    "forces": ("a parameter", "a coordinate", "a speed", "an input", "the time"),
    "constraints": ("a parameter", "a coordinate", "the time"),
    "inputs": ("a parameter", "a coordinate", "a speed", "the time"),
    "outputs": ("a parameter", "a coordinate", "a speed", "an input", "the time"),
    "stop": ("a parameter", "a coordinate", "a speed", "an input", "the time"),
    "ask": ("a parameter", "a coordinate", "a speed", "an input", "the time"),
    _MOTION: ("a parameter", "the time"),
}
_MAY_ASK: Final = ("outputs", "stop", "ask")


def _verify_expressions(system: System, names: Mapping[str, str]) -> None:
    dimensions = _dimensions(system)
    vocabulary = _vocabulary(system)
    for path, node, unit in expressions(system):
        try:
            _verify_leaves(node, _may_name(system, path), names)
            for leaf in _asked(node):
                _verify_quantity(leaf, path[0], vocabulary)
            _verify_dimension(node, unit, dimensions)
        except (ModelError, ExpressionError) as error:
            raise ModelError(error.message, where=replace(error.where, path=path, column=None)) from None


def _may_name(system: System, path: Sequence[str]) -> tuple[str, ...]:
    """Return what an expression at a path may name."""
    allowed = _MAY_NAME.get(_MOTION if path[2:3] == (_MOTION,) else path[0], _ONLY_PARAMETERS)
    of_speeds = path[0] == "constraints" and isinstance(system.constraints[path[1]], VelocityConstraint)
    return (*allowed, "a speed") if of_speeds else allowed


def _verify_leaves(node: Node, allowed: tuple[str, ...], names: Mapping[str, str]) -> None:
    for leaf in leaves([node], "symbol"):
        if leaf.data not in names:
            raise ModelError(f"{leaf.data!r} is not declared{suggestion(leaf.data, names)}")
        if names[leaf.data] not in allowed:
            raise ModelError(f"{leaf.data!r} is {names[leaf.data]}; here an expression names {_listed(allowed)} only")


def _vocabulary(system: System) -> dict[str, list[str]]:
    """Return the names that each kind of argument of a quantity may be."""
    bodies = {GROUND: _BARE, **system.bodies}
    return {
        "point": [*bodies, *(f"{name}.{part}" for name, b in bodies.items() for part in (*b.points, *b.frames))],
        "body": list(bodies),
        "joint": [*system.joints, *([GROUND] if _moves(system.bodies) else ())],
        "rope": [name for name, c in system.constraints.items() if isinstance(c, (Rope, Distance))],
        "constraint": [row for name, element in system.constraints.items() for row in row_names(name, element)],
        "axis": list(AXES),
        "component": list(COMPONENTS),
    }


def _asked(node: Node) -> list[Node]:
    """Return the quantities that an expression names, other than the spans of pulls."""
    return [leaf for leaf in leaves([node], "quantity") if leaf.data[0] in QUANTITIES]


def _verify_quantity(leaf: Node, section: str, vocabulary: Mapping[str, list[str]]) -> None:
    function, arguments = leaf.data
    if section not in _MAY_ASK:
        raise ModelError(f"{leaf} can be asked in outputs, stop and ask only")
    for kind, name in zip(QUANTITIES[function].arguments, arguments, strict=True):
        if name not in vocabulary[kind]:
            raise ModelError(f"{leaf}: {name!r} is no {kind}{suggestion(name, vocabulary[kind])}")


def _listed(words: tuple[str, ...]) -> str:
    plain = [w.removeprefix("a ").removeprefix("an ") for w in words]
    return ", ".join("the time" if w == "the time" else w + "s" for w in plain)


def _dimensions(system: System) -> dict[Node, Dimension | None]:
    """Return the dimensions that were given with units. Time and motion have none: `5*sin(3*t)` may be a force."""
    return {symbol(name): parameter.dimension for name, parameter in system.parameters.items()}


def _verify_dimension(node: Node, unit: str | None, known: Mapping[Node, Dimension | None]) -> None:
    def of_leaf(leaf: Node) -> Dimension | None:
        asked = QUANTITIES.get(leaf.data[0]) if leaf.op == "quantity" else None
        return asked.dimension if asked else known.get(leaf)

    found = dimension_of(node, of_leaf)
    if found is not None and unit is not None and found != dimension_of_unit(unit) and node.shadow is None:
        raise ModelError(f"the expression is a quantity in {found}; here one in {unit or 'no unit'} is wanted")


def _parameter_entries(system: System, slots: Mapping[Node, Node], rows: int) -> tuple[ParameterEntry, ...]:
    """Return the declared parameters, the ropes' lengths at the start and, with rows, what a run chooses for them.

    That is the most rows to be independent anywhere (all of them, unless the start finds fewer), and Baumgarte's
    coefficients.
    """
    entries = [
        ParameterEntry(name, _in(slots, parameter.value), parameter.positive)
        for name, parameter in system.parameters.items()
    ]
    entries += [ParameterEntry(f"length of {name}", None, True) for name in _unmeasured_ropes(system)]
    if rows:
        entries.append(ParameterEntry("most independent rows", as_node(rows), False))
        entries += [ParameterEntry(f"Baumgarte {name}", None, False) for name in ("alpha", "beta")]
    return tuple(entries)


def _unmeasured_ropes(system: System) -> list[str]:
    return [name for name, c in system.constraints.items() if isinstance(c, Rope) and c.length is None]


# --- references ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Resolver:
    """The resolved system with its body numbers: turns references into markers, elements into loads and rows."""

    system: System
    numbers: Mapping[str, int]
    slots: Mapping[Node, Node]

    def marker(self, reference: str) -> Marker:
        name, part = body_part(reference, self.system.bodies)
        body = self.system.bodies.get(name, _BARE)
        if part in body.frames:
            return Marker(reference, self.numbers[name], pose_of(body.frames[part]))
        if part and part not in body.points:
            known = [f"{name}.{p}" for p in (*body.points, *body.frames)]
            raise ModelError(f"{name!r} has no point or frame {part!r}{suggestion(reference, known)}")
        return Marker(reference, self.numbers[name], Pose(body.points[part] if part else ORIGIN))

    def markers(self) -> dict[str, Marker]:
        made = {}
        for name, body in {GROUND: _BARE, **self.system.bodies}.items():
            for reference in (name, *(f"{name}.{p}" for p in (*body.points, *body.frames))):
                made[reference] = self.marker(reference)
        return made

    def ground(self) -> tuple[TreeBody, ...]:
        """Return a ground that moves as a body on prescribed steps."""
        body = self.system.bodies.get(GROUND, _BARE)
        if body.motion is None:
            return ()
        if GROUND in self.system.joints:
            raise ModelError("ground moves, and its own drive is called 'ground'; give the joint another name").under(
                "joints"
            )
        places = zip(IDENTITY, (body.motion.x, body.motion.y, body.motion.z), strict=True)
        moves = [Step("translate", axis, motion=place) for axis, place in places if place is not ZERO]
        turns = [Step("rotate", unit_vector(turn.axis), motion=turn.angle) for turn in body.motion.turn]
        return (TreeBody(GROUND, -1, GROUND, (*moves, *turns), False, Pose(), Pose(), mass_of(body), (), ()),)

    def frames(self, name: str) -> tuple[Marker, Marker]:
        """Return frame F on a joint's parent and M on its child."""
        joint = self.system.joints[name]
        with at("joints", name, "parent"):
            on_parent = self.marker(joint.parent)
        with at("joints", name, "child"):
            return on_parent, self.marker(joint.child)

    def bodies(self, carrying: Iterable[str], doubled: Iterable[str]) -> tuple[TreeBody, ...]:
        carried = [(name, body_part(self.system.joints[name].child, self.system.bodies)[0]) for name in carrying]
        wanted = [(name, child, mass_of(self.system.bodies[child])) for name, child in carried]
        wanted += [(name, f"double of {self.system.joints[name].child} at {name}", NO_MASS) for name in doubled]
        made, q, u = [], 0, 0
        for joint_name, name, mass in wanted:
            joint, (on_parent, on_body) = self.system.joints[joint_name], self.frames(joint_name)
            steps = tuple(replace(step, axis=unit_vector(step.axis)) for step in joint.moves)
            nq, nu = len(joint.coordinate_units), len(joint.speed_units)
            numbers = tuple(range(q, q + nq)), tuple(range(u, u + nu))
            ends = on_parent.pose, on_body.pose
            made.append(TreeBody(name, on_parent.body, joint_name, steps, joint.ball, *ends, mass, *numbers))
            q, u = q + nq, u + nu
        return tuple(made)

    def cuts(self, cut: Iterable[str], doubled: Sequence[str], rows: list[Row]) -> list[CutJoint]:
        """Return the cut joints and add the rows that stand for them."""
        made = []
        for name in cut:
            found = cut_rows(name, self.system.joints[name], self.frames(name))
            made.append(CutJoint(name, self.frames(name), range(len(rows), len(rows) + len(found))))
            rows += found
        first = max(self.numbers.values()) + 1
        for number, name in enumerate(doubled, first):
            on_body = self.frames(name)[1]
            rows += welded_rows(name, (replace(on_body, body=number), on_body))
        return made

    def pair(self, references: tuple[str, ...]) -> tuple[Marker, Marker]:
        ends = []
        for i, reference in enumerate(references):
            with at("between", i):
                ends.append(self.marker(reference))
        return ends[0], ends[1]

    def axes(self, name: str) -> int:
        if name not in self.numbers:
            raise ModelError(f"no body is called {name!r}{suggestion(name, self.numbers)}").under("frame")
        return self.numbers[name]

    def joint(self, name: str, bodies: tuple[TreeBody, ...]) -> TreeBody:
        for body in bodies:
            if body.joint_name == name and name in self.system.joints:
                return body
        raise ModelError(f"no joint is called {name!r}{suggestion(name, self.system.joints)}")

    def one_freedom(self, name: str, bodies: tuple[TreeBody, ...]) -> TreeBody:
        body = self.joint(name, bodies)
        if len(body.u) != 1:
            raise ModelError(f"joint {name!r} has {len(body.u)} degrees of freedom; one is needed here")
        return body

    def freedom(self, joint: str, name: str | None, bodies: tuple[TreeBody, ...]) -> tuple[int | None, int]:
        """Return the coordinate (None: a ball has none for it) and the speed of a joint's freedom, perhaps named."""
        if name is None:
            with at("joint"):
                body = self.one_freedom(joint, bodies)
            return body.q[0], body.u[0]
        with at("joint"):
            body = self.joint(joint, bodies)
        of_steps = list(zip(body.step_q, body.step_u, strict=True))
        places: dict[Node, tuple[int | None, int]] = {slot("u", u): (None, u) for u in body.u}
        places.update((slot("u", u), (q, u)) for q, u in of_steps)
        places.update((slot("q", q), (q, u)) for q, u in of_steps)
        known = {leaf.data: places[place] for leaf, place in self.slots.items() if place in places}
        if name not in known:
            with at("freedom"):
                raise ModelError(f"joint {joint!r} has no freedom {name!r}{suggestion(name, known)}")
        return known[name]

    def loads(self, bodies: tuple[TreeBody, ...]) -> list[Load]:
        made = []
        for name, element in self.system.forces.items():
            with at("forces", name):
                made.append(self.load(name, element, bodies))
        return made

    def load(self, name: str, element: Element, bodies: tuple[TreeBody, ...]) -> Load:
        if isinstance(element, Force):
            return PointForce(name, self.force_point(element), element.value, self.axes(element.frame))
        if isinstance(element, Torque):
            if isinstance(element.value, Node):
                return JointForce(name, self.freedom(element.joint or "", element.freedom, bodies)[1], element.value)
            with at("on"):
                return BodyTorque(name, self.marker(element.on or "").body, element.value, self.axes(element.frame))
        if isinstance(element, Motor):
            u = self.freedom(element.joint, element.freedom, bodies)[1]
            per_current = element.gear * element.constant
            current = (element.voltage - per_current * slot("u", u)) / element.resistance
            return JointForce(name, u, per_current * current)
        if isinstance(element, Drag):
            return PointDrag(name, self.force_point(element), element.linear, element.quadratic)
        if isinstance(element, Pull):
            return PointPull(name, self.pair(element.between), element.value)
        assert isinstance(element, (SpringDamper, Damper))
        stiffness = element.stiffness if isinstance(element, SpringDamper) else ZERO
        rest = element.length if isinstance(element, SpringDamper) else ZERO
        if element.joint is not None:
            q, u = self.freedom(element.joint, element.freedom, bodies)
            if q is None:
                with at("freedom"):
                    raise ModelError(f"{element.freedom} has no coordinate that a spring or damper could act on")
            return JointSpring(name, q, u, stiffness, element.damping, rest)
        return PointSpring(name, self.pair(element.between or ()), stiffness, element.damping, rest)

    def force_point(self, element: Force | Drag) -> Marker:
        with at("on"):
            marker = self.marker(element.on)
        if element.at is None:
            body = self.system.bodies.get(element.on)
            return marker if body is None else replace(marker, pose=Pose(mass_of(body).com))
        with at("at"):
            return self.marker(f"{element.on}.{element.at}")

    def pulleys(self) -> dict[str, Bend]:
        made = {}
        for name, pulley in self.system.pulleys.items():
            with at("pulleys", name, "at"):
                made[name] = Bend(self.marker(pulley.at), pulley.radius, unit_vector(pulley.axis))
        return made

    def limits(self, bodies: tuple[TreeBody, ...]) -> list[Limit]:
        declared = {name: getattr(joint, "limits", None) for name, joint in self.system.joints.items()}
        made = []
        for body in bodies:
            found = declared.get(body.joint_name)
            if found is not None and body.q:
                made.append(Limit(body.joint_name, body.q[0], body.u[0], found.lower, found.upper, found.velocity))
        return made

    def rows(self, bodies: tuple[TreeBody, ...]) -> list[Row]:
        made: list[Row] = []
        pulleys = self.pulleys()
        for name, element in self.system.constraints.items():
            with at("constraints", name):
                made += self.rows_of(name, element, bodies, pulleys)
        return made

    def rows_of(
        self, name: str, element: Element, bodies: tuple[TreeBody, ...], pulleys: Mapping[str, Bend]
    ) -> list[Row]:
        if isinstance(element, Distance):
            return [DistanceRow(name, self.pair(element.between), element.value)]
        if isinstance(element, Rope):
            length = element.length if element.length is not None else self.measured_length(name)
            return [RopeRow(name, tuple(self.bend(i, step, pulleys) for i, step in enumerate(element.path)), length)]
        if isinstance(element, VelocityConstraint):
            return [VelocityRow(name, self.linear_in_speeds(element.zero))]
        if isinstance(element, PrescribedMotion):
            coordinate = self.one_freedom(element.joint, bodies).q[0]
            return [ExpressionRow(name, slot("q", coordinate) - element.value)]
        if isinstance(element, (PointOnLine, PointInPlane)):
            return self.guided(name, element)
        if isinstance(element, Rolling):
            return self.rolling(name, element)
        if isinstance(element, Gear):
            with at("joints", 0):
                driven = self.coordinate(element.joints[0], bodies)
            with at("joints", 1):
                driving = self.coordinate(element.joints[1], bodies)
            return [ExpressionRow(name, driven - element.ratio * driving - element.value)]
        if isinstance(element, Coupler):
            return [ExpressionRow(name, self.coupled(element, bodies))]
        assert isinstance(element, Expression)
        return [ExpressionRow(name, element.zero)]

    def linear_in_speeds(self, psi: Node) -> Node:
        """Return an expression of a velocity constraint; raise where it is not linear in the speeds."""
        speeds = [leaf for leaf in leaves([psi], "slot") if leaf.data[0] == "u"]
        with at("zero"):
            if not speeds:
                raise ModelError("no speed stands in it; a constraint of positions is {type: expression, zero: ...}")
            for speed in speeds:
                slope = tangents([psi], {speed: ONE})
                if any(leaf.data[0] == "u" for leaf in leaves(slope, "slot")):
                    raise ModelError("it is not linear in the speeds, and a mechanical constraint is")
        return psi

    def guided(self, name: str, element: PointOnLine | PointInPlane) -> list[Row]:
        """Return the rows of a point that stays on a line or in a plane."""
        guide = element.line if isinstance(element, PointOnLine) else element.plane
        with at("point"):
            point = self.marker(element.point)
        with at("line" if isinstance(element, PointOnLine) else "plane", "through"):
            frames = self.marker(guide.through), point
        if isinstance(guide, Plane):
            return [PositionRow(name, frames, unit_vector(guide.normal))]
        normals = zip(row_names(name, element), normals_of(guide.direction), strict=True)
        return [PositionRow(row, frames, normal) for row, normal in normals]

    def rolling(self, name: str, element: Rolling) -> list[Row]:
        with at("body"):
            wheel, rim = self.surface(element.body)
            if rim.plane is not None:
                raise ModelError(f"{element.body} is a plane; a ball or a disc rolls")
        with at("on"):
            ground, plane = self.surface(element.on)
            if plane.plane is None:
                raise ModelError(f"{element.on} is no plane; rolling is possible on planes only")
        normal = unit_vector(plane.normal)
        axis = None if rim.disc is None else unit_vector(rim.axis)
        radius = rim.sphere if rim.disc is None else rim.disc
        assert radius is not None
        directions = (normal, *normals_of(normal))
        return [
            RollingRow(row, wheel, axis, radius, ground, normal, along)
            for row, along in zip(row_names(name, element), directions, strict=True)
        ]

    def surface(self, reference: str) -> tuple[Marker, Surface]:
        """Return a surface with the marker of its centre, or of a place in it if it is a plane."""
        name, part = body_part(reference, self.system.bodies)
        body = self.system.bodies.get(name, _BARE)
        if part not in body.surfaces:
            known = [f"{name}.{surface}" for surface in body.surfaces]
            raise ModelError(f"{reference!r} is no surface{suggestion(reference, known)}")
        surface = body.surfaces[part]
        place = surface.centre if surface.plane is None else surface.plane
        return Marker(reference, self.numbers[name], Pose(place)), surface

    def coupled(self, element: Coupler, bodies: tuple[TreeBody, ...]) -> Node:
        total = negate(element.value)
        for joint, factor in element.joints.items():
            with at("joints", joint):
                total = total + factor * self.coordinate(joint, bodies)
        return total

    def coordinate(self, joint: str, bodies: tuple[TreeBody, ...]) -> Node:
        """Return the coordinate of a joint with one freedom."""
        return slot("q", self.one_freedom(joint, bodies).q[0])

    def bend(self, index: int, step: str, pulleys: Mapping[str, Bend]) -> Bend:
        if step in pulleys:
            return pulleys[step]
        with at("path", index):
            try:
                return Bend(self.marker(step), ZERO, (ZERO, ZERO, ONE))
            except ModelError as error:
                near = suggestion(step, pulleys)
                if "mean" not in near:
                    raise
                raise ModelError(f"no body or pulley is called {step!r}{near}") from error

    def measured_length(self, name: str) -> Node:
        return slot("parameters", len(self.system.parameters) + _unmeasured_ropes(self.system).index(name))


_BARE: Final = Body()
