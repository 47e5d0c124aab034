"""The rows that declared constraints and cut joints are."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import singledispatch
from typing import TypeGuard

from multibody_sym.errors import ModelError, at
from multibody_sym.model.declaration.constraints import (
    Coupler,
    Distance,
    Expression,
    Gear,
    OnCurve,
    PointInPlane,
    PointOnLine,
    PrescribedMotion,
    Rolling,
    Rope,
    VelocityConstraint,
    row_names,
)
from multibody_sym.model.declaration.fields import Element
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.model.mechanism.rows import (
    CutJoint,
    DistanceRow,
    ExpressionRow,
    GearRow,
    PositionRow,
    Row,
    VelocityRow,
)
from multibody_sym.model.resolution.contacts.elements import rolling_rows
from multibody_sym.model.resolution.cuts import cut_rows, normals_of, welded_rows
from multibody_sym.model.resolution.gear_teeth import gear_row
from multibody_sym.model.resolution.guides.rows import foot_rows, rows_on_curve
from multibody_sym.model.resolution.plane import rows_in_plane
from multibody_sym.model.resolution.references import References
from multibody_sym.model.resolution.ropes.runs import rope_rows
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ONE, Node, negate
from multibody_sym.scalars.traversal import leaves


def declared_rows(references: References) -> list[Row]:
    """Return the rows of all declared constraints."""
    made: list[Row] = []
    for name, element in references.system.constraints.items():
        with at("constraints", name):
            made += _rows(element, name, references)
    made += foot_rows(references)
    return rows_in_plane(made) if references.plane else made


def cut_joints(references: References, cut: Iterable[str], rows: list[Row]) -> list[CutJoint]:
    """Return the cut joints and add the rows that stand for them."""
    made = []
    for name in cut:
        found = cut_rows(name, references.system.joints[name], references.frames(name))
        found = rows_in_plane(found) if references.plane else found
        places = range(len(rows), len(rows) + len(found))
        teeth = tuple((k, dict(row.beside)[name]) for k, row in enumerate(rows) if _has_tooth_beside(row, name))
        made.append(CutJoint(name, references.frames(name), places, references.drives(name, rows), teeth))
        rows += found
    for name, number in references.doubles.items():
        on_body = references.frames(name)[1]
        welded = welded_rows(name, (replace(on_body, body=number), on_body))
        rows += rows_in_plane(welded) if references.plane else welded
    return made


def _has_tooth_beside(row: Row, joint: str) -> TypeGuard[GearRow]:
    return isinstance(row, GearRow) and joint in dict(row.beside)


@singledispatch
def _rows(element: Element, name: str, references: References) -> list[Row]:
    raise TypeError(f"no rows for {type(element).__name__}")


@_rows.register
def _(element: Distance, name: str, references: References) -> list[Row]:
    return [DistanceRow(name, references.pair(element.between), element.value)]


@_rows.register
def _(element: Expression, name: str, references: References) -> list[Row]:
    return [ExpressionRow(name, element.zero, element.acts is None)]


@_rows.register
def _(element: PrescribedMotion, name: str, references: References) -> list[Row]:
    with at("joint"):
        coordinate = references.coordinate(element.joint)
    return [ExpressionRow(name, coordinate - element.value)]


@_rows.register
def _(element: Gear, name: str, references: References) -> list[Row]:
    with at("joints", 0):
        driven = references.coordinate(element.joints[0])
    with at("joints", 1):
        driving = references.coordinate(element.joints[1])
    zero = driven - element.ratio * driving - element.value
    if element.radii is not None:
        return [gear_row(name, element, zero, references)]
    return [ExpressionRow(name, zero, element.acts is None)]


@_rows.register
def _(element: Coupler, name: str, references: References) -> list[Row]:
    total = negate(element.value)
    for joint, factor in element.joints.items():
        with at("joints", joint):
            total = total + factor * references.coordinate(joint)
    return [ExpressionRow(name, total, element.acts is None)]


@_rows.register
def _(element: VelocityConstraint, name: str, references: References) -> list[Row]:
    with at("zero"):
        _verify_linear(evaluate([element.zero], lambda leaf: references.measured.get(leaf, leaf))[0])
    return [VelocityRow(name, element.zero, element.acts is None)]


def _verify_linear(psi: Node) -> None:
    """Raise ModelError where an expression is not linear in the speeds."""
    speeds = [leaf for leaf in leaves([psi], "slot") if leaf.data[0] == "u"]
    if not speeds:
        raise ModelError(
            "no speed stands in it; a constraint of positions is {type: expression, zero: ...}", number="M113"
        )
    for speed in speeds:
        slope = tangents([psi], {speed: ONE})
        if any(leaf.data[0] == "u" for leaf in leaves(slope, "slot")):
            raise ModelError("it is not linear in the speeds, and a mechanical constraint is", number="M113")


@_rows.register
def _(element: PointOnLine, name: str, references: References) -> list[Row]:
    with at("point"):
        point = references.marker(element.point)
    with at("line", "through"):
        frames = references.marker(element.line.through), point
    normals = zip(row_names(name, element), normals_of(element.line.direction), strict=True)
    return [PositionRow(row, frames, normal) for row, normal in normals]


@_rows.register
def _(element: PointInPlane, name: str, references: References) -> list[Row]:
    with at("point"):
        point = references.marker(element.point)
    with at("plane", "through"):
        frames = references.marker(element.plane.through), point
    return [PositionRow(name, frames, unit_vector(element.plane.normal))]


@_rows.register
def _(element: OnCurve, name: str, references: References) -> list[Row]:
    return rows_on_curve(name, element, references)


@_rows.register
def _(element: Rolling, name: str, references: References) -> list[Row]:
    return [] if element.contact is not None else list(rolling_rows(name, element, references))


@_rows.register
def _(element: Rope, name: str, references: References) -> list[Row]:
    return [*rope_rows(references, name, element)]
