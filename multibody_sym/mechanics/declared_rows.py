"""Which rows are declared constraints and cut joints, which stops joints have, and which expressions drive them?"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import singledispatch
from typing import Any, Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.mechanism import Measure, TangentAngle, TreeBody, measured_name
from multibody_sym.mechanics.references import References, StartConstant, across, rows_in_plane
from multibody_sym.mechanics.ropes import may_slacken, pulley_bends, rope_elements, rope_measures, rope_rows
from multibody_sym.mechanics.row_records import (
    CutJoint,
    DistanceRow,
    ExpressionRow,
    GearRow,
    PositionRow,
    Row,
    VelocityRow,
)
from multibody_sym.mechanics.spanning_tree import cut_rows, normals_of, welded_rows
from multibody_sym.model import constraints
from multibody_sym.model.bodies import GROUND, unit_vector
from multibody_sym.model.constraints import row_names
from multibody_sym.model.contacts_and_impacts import copies
from multibody_sym.model.fields import Element, Names
from multibody_sym.model.joints import Foot
from multibody_sym.model.parameters import Constant, Tabled
from multibody_sym.model.system import System, expressions, with_expressions
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import substitute
from multibody_sym.scalars.node import ONE, ZERO, Node, negate, symbol


def declared_rows(references: References) -> tuple[list[Row], list[LawElement]]:
    """Return the rows of declared constraints that hold at any time, and the elements of those that hold one way."""
    declared: list[Row | LawElement] = []
    for name, element in references.system.constraints.items():
        with at("constraints", name):
            declared += _declared(element, name, references)
    made = [x for x in declared if isinstance(x, Row)]
    if any(isinstance(joint, Foot) for joint in references.system.joints.values()):
        from multibody_sym.mechanics.contacts import foot_rows  # which few systems need

        made += foot_rows(references)
    rows = rows_in_plane(made) if references.plane else made
    return rows, [x for x in declared if isinstance(x, LawElement)]


def cut_joints(references: References, cut: Iterable[str], rows: list[Row]) -> list[CutJoint]:
    """Return the cut joints and add the rows that stand for them."""
    made = []
    for name in cut:
        found = cut_rows(name, references.system.joints[name], references.frames(name))
        found = rows_in_plane(found) if references.plane else found
        places = range(len(rows), len(rows) + len(found))
        gears = [(k, dict(row.beside)) for k, row in enumerate(rows) if isinstance(row, GearRow)]
        teeth = tuple((k, beside[name]) for k, beside in gears if name in beside)
        made.append(CutJoint(name, references.frames(name), places, references.drives(name, rows), teeth))
        rows += found
    for name, number in references.doubles.items():
        on_body = references.frames(name)[1]
        welded = welded_rows(name, (replace(on_body, body=number), on_body))
        rows += rows_in_plane(welded) if references.plane else welded
    return made


@singledispatch
def _declared(element: Element, name: str, references: References) -> Sequence[Row | LawElement]:
    """Return the rows of a constraint that hold at any time, the elements that hold one way."""
    raise TypeError(f"no rows for {type(element).__name__}")


@_declared.register
def _(element: constraints.Distance, name: str, references: References) -> list[Row]:
    return [DistanceRow(name, references.pair(element.between), element.value)]


@_declared.register
def _(element: constraints.Expression, name: str, references: References) -> list[Row]:
    return [ExpressionRow(name, element.zero, element.acts is None)]


@_declared.register
def _(element: constraints.PrescribedMotion, name: str, references: References) -> list[Row]:
    with at("joint"):
        coordinate = references.coordinate(element.joint)
    return [ExpressionRow(name, coordinate - element.value)]


@_declared.register
def _(element: constraints.Gear, name: str, references: References) -> list[Row]:
    with at("joints", 0):
        driven = references.coordinate(element.joints[0])
    with at("joints", 1):
        driving = references.coordinate(element.joints[1])
    zero = driven - element.ratio * driving - element.value
    if element.radii is not None:
        from multibody_sym.mechanics.gears import gear_row  # which few systems need

        return [gear_row(name, element, zero, references)]
    return [ExpressionRow(name, zero, element.acts is None)]


@_declared.register
def _(element: constraints.Coupler, name: str, references: References) -> list[Row]:
    total = negate(element.value)
    for joint, factor in element.joints.items():
        with at("joints", joint):
            total = total + factor * references.coordinate(joint)
    return [ExpressionRow(name, total, element.acts is None)]


@_declared.register
def _(element: constraints.VelocityConstraint, name: str, references: References) -> list[Row]:
    with at("zero"):
        psi = substitute(element.zero, references.measured)
        speeds = [leaf for leaf in leaves([psi], "slot") if leaf.data[0] == "u"]
        if not speeds:
            message = "no speed stands in it; a constraint of positions is {type: expression, zero: ...}"
            raise ModelError(message, number="M113")
        slopes = [slope for speed in speeds for slope in tangents([psi], {speed: ONE})]
        if any(leaf.data[0] == "u" for leaf in leaves(slopes, "slot")):
            raise ModelError("it is not linear in the speeds, and a mechanical constraint is", number="M113")
    return [VelocityRow(name, element.zero, element.acts is None)]


@_declared.register
def _(element: constraints.PointOnLine, name: str, references: References) -> list[Row]:
    with at("point"):
        point = references.marker(element.point)
    with at("line", "through"):
        frames = references.marker(element.line.through), point
    normals = zip(row_names(name, element), normals_of(element.line.direction), strict=True)
    return [PositionRow(row, frames, normal) for row, normal in normals]


@_declared.register
def _(element: constraints.PointInPlane, name: str, references: References) -> list[Row]:
    with at("point"):
        point = references.marker(element.point)
    with at("plane", "through"):
        frames = references.marker(element.plane.through), point
    return [PositionRow(name, frames, unit_vector(element.plane.normal))]


@_declared.register
def _(element: constraints.OnCurve, name: str, references: References) -> list[Row]:
    from multibody_sym.mechanics.contacts import rows_on_curve

    return rows_on_curve(name, element, references)


@_declared.register
def _(element: constraints.Rolling, name: str, references: References) -> list[Row]:
    from multibody_sym.mechanics.contacts import rolling_rows

    return [] if element.contact is not None else list(rolling_rows(name, element, references))


@_declared.register
def _(element: constraints.Rope, name: str, references: References) -> list[Row | LawElement]:
    rope = rope_elements if may_slacken(references, element) else rope_rows
    return list(rope(references, name, element))


# ----------------------------------------------------------------------------------------------------------------------
# Stops: the limits of joints that act, each a row phi >= 0 on the joint's coordinate.

FREE: Final = "free"


def stops(references: References) -> Iterator[LawElement]:
    """Yield the stops of all joints: below, then above."""
    for name, joint in references.system.joints.items():
        limits = joint.stops
        if limits is None:
            continue
        coordinate = references.coordinate(name)
        gaps = {
            "lower": None if limits.lower is None else coordinate - limits.lower,
            "upper": None if limits.upper is None else limits.upper - coordinate,
        }
        for side, gap in gaps.items():
            if gap is not None:
                yield LawElement(
                    f"{name}.{side}",
                    "stop",
                    ("joints", name),
                    (ExpressionRow(f"{name}.{side}", gap),),
                    restitution=limits.restitution or ZERO,
                    collides=limits.restitution is not None,
                    words=(side, FREE),
                    group=name,
                    joint=name,
                )


# ----------------------------------------------------------------------------------------------------------------------
# Constants of constraints that the start measures, and the slots among the parameters that hold them.


def with_constants(references: References, bodies: Sequence[TreeBody]) -> References:
    """Return the references with the constants that the start measures, which follow the declared parameters."""
    references = replace(references, bodies=tuple(bodies))
    references = replace(references, pulleys=pulley_bends(references))
    measures = dict(_start_measures(references))
    vector = references.parameters.with_measured(measures)
    constants = {name: StartConstant(vector.slot(measured_name(name, what)), what) for name, what in measures.items()}
    return replace(references, parameters=vector, constants=constants)


def _start_measures(references: References) -> Iterator[tuple[str, Measure]]:
    for name, element in references.system.constraints.items():
        with at("constraints", name):
            if type(element) in _MEASURED:
                yield from _MEASURED[type(element)](references, name, element)
    for _, name, contact in copies(references.system.contacts):
        if contact.tangent is None and not references.flat:
            yield from _tangent_angles(name, contact.between, references)


def _tangent_angles(name: str, ends: Sequence[str], references: References) -> Iterator[tuple[str, Measure]]:
    """Yield the angle of the tangents on the plane that one of some ends is, if its body turns."""
    from multibody_sym.mechanics.contacts import solid_of

    for end in ends:
        with suppress(ModelError):  # of references that name nothing, an error of the contact
            for _, skin in solid_of(end, references, flat=False).skins[:1]:
                if (plane := skin.plane) is not None and _may_turn(references.bodies, plane.place.body):
                    yield name, TangentAngle(plane.place, plane.normal, across(plane.normal))


def _rolling_tangents(references: References, name: str, rolling: constraints.Rolling) -> Iterator[tuple[str, Measure]]:
    if not references.flat:
        yield from _tangent_angles(name, (rolling.on,), references)


_MEASURED: Final[Mapping[type[Element], Callable[[References, str, Any], Iterator[tuple[str, Measure]]]]] = {
    constraints.Rope: rope_measures,
    constraints.Rolling: _rolling_tangents,
}
"""The kinds of constraints with constants that the start measures."""


def _may_turn(bodies: Sequence[TreeBody], index: int) -> bool:
    """Return whether a body's axes may differ from ground's: some joint between them is more than a slide."""
    while index >= 0 and bodies[index].name != GROUND:
        body = bodies[index]
        if any(step.turns for step in body.steps) or body.frame_on_parent.rotation != body.frame_on_body.rotation:
            return True
        index = body.parent
    return False


# ----------------------------------------------------------------------------------------------------------------------
# Inputs that drive motions and constraints, outputs that others name: there they stand for their expressions.
#
# A force follows from the value of an input. What moves as prescribed follows from its first and second derivative
# too, which a value does not have.


def driving_inputs(system: System) -> tuple[str, ...]:
    """Return the inputs that motions of joints and ground, and constraints, name."""
    nodes = [written.node for part in _driven_parts(system).values() for written in expressions(part)]
    found = {leaf.data for leaf in leaves(nodes, "symbol")}
    return tuple(name for name in system.inputs if name in found)


def with_driving_inputs(system: System) -> System:
    """Return the system with the expressions of inputs in their place where they drive motions and constraints."""
    meant = {symbol(name): expression_of(name, system.inputs[name]) for name in driving_inputs(system)}
    if not meant:
        return system
    changed: dict[str, Any] = {}
    for section, part in _driven_parts(system).items():
        new = {name: with_expressions(element, _put_in(meant)) for name, element in part.items()}
        changed[section] = Names({**getattr(system, section), **new})
    return replace(system, **changed)


def with_named_outputs(system: System, taken: Collection[str]) -> System:
    """Return the system with the expressions of outputs in the place of their names in outputs, stop and ask.

    What is `taken` as a name is none of an output there, nor is in a question the name of an answer to another one.
    Raises ModelError where outputs name each other in a circle.
    """
    known = {symbol(name): node for name, node in system.outputs.items() if name not in taken}
    if not known:
        return system
    meant = _without_names(known)
    answers = {symbol(name) for name in system.ask}

    def own(name: str) -> Callable[[Node], Node]:
        return _put_in({x: node for x, node in meant.items() if x not in answers - {symbol(name)}})

    changed: dict[str, Any] = {
        "outputs": with_expressions(system.outputs, _put_in(meant)),
        "stop": with_expressions(system.stop, _put_in(meant)),
        "ask": Names({name: with_expressions(x, own(name)) for name, x in system.ask.items()}),
    }
    return replace(system, **{key: new for key, new in changed.items() if new != getattr(system, key)})


def _without_names(known: Mapping[Node, Node]) -> dict[Node, Node]:
    """Return expressions of outputs in which no other output is named."""
    found: dict[Node, Node] = {}
    waiting = dict(known)
    while waiting:
        ready = {x: node for x, node in waiting.items() if not waiting.keys() & set(leaves([node], "symbol"))}
        if not ready:
            first = next(iter(waiting))
            with at("outputs", str(first.data)):
                names = ", ".join(str(x.data) for x in waiting)
                raise ModelError(f"outputs name each other, or themselves: {names}; none comes first", number="M110")
        for x, node in ready.items():
            found[x] = _put_in(found)(node)
            del waiting[x]
    return found


def _put_in(meant: Mapping[Node, Node]) -> Callable[[Node], Node]:
    """Return the function that puts expressions in the place of names."""
    return lambda node: substitute(node, meant)


def expression_of(name: str, given: Node | Tabled | Constant) -> Node:
    """Return the expression that the input `name` stands for."""
    if isinstance(given, Constant):
        return given.value
    return given.value(name) if isinstance(given, Tabled) else given


def _driven_parts(system: System) -> dict[str, Mapping[str, Any]]:
    """Return the parts of a system that move as prescribed, by section; none where there are no inputs."""
    if not system.inputs:
        return {}
    joints = {
        name: joint
        for name, joint in system.joints.items()
        if getattr(joint, "motion", None) is not None or any(step.curve is not None for step in joint.steps)
    }
    ground = {name: body for name, body in system.bodies.items() if name == GROUND}
    return {"joints": joints, "bodies": ground, "constraints": system.constraints}
