"""The places of a body that the model names: where joints hold it, where ropes and springs are fixed, its points."""

from __future__ import annotations

from collections.abc import Iterator
from functools import singledispatch
from typing import Final

import numpy as np

from multibody_sym.errors import ModelError
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
)
from multibody_sym.model.declaration.fields import Element
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.scene.forms import Vector
from multibody_sym.scene.stage import Stage

_SAME: Final = 1e-9
"""How far places of a model (m, by its size) may be apart and are drawn as one."""


def places(stage: Stage) -> dict[str, list[Vector]]:
    """Return by body where it is joined, held and marked, each place once, in the order of the declaration."""
    found: dict[str, list[Vector]] = {GROUND: [], **{name: [] for name in stage.system.bodies}}
    for reference in references(stage):
        try:
            body, place = stage.body(reference), stage.place(reference)
        except ModelError:  # a reference to a surface, which is no place
            continue
        add_place(found[body], place.point)
    for name, declared in stage.system.bodies.items():
        for point in declared.points.values():
            add_place(found[name], stage.vector(point))
    return found


def references(stage: Stage) -> Iterator[str]:
    """Yield what joints, constraints, pulleys and forces name of bodies."""
    system = stage.system
    for joint in system.joints.values():
        yield from (joint.parent, joint.child)
    for element in system.constraints.values():
        yield from ends(element, stage)
    for pulley in system.pulleys.values():
        yield pulley.at or pulley.body or GROUND
    for force in system.forces.values():
        yield from getattr(force, "between", None) or ()


@singledispatch
def ends(element: Element, stage: Stage) -> tuple[str, ...]:
    """Return the points that a constraint holds."""
    raise TypeError(f"no points are known of {type(element).__name__}")


@ends.register(Coupler)
@ends.register(Expression)
@ends.register(Gear)
@ends.register(PrescribedMotion)
@ends.register(Rolling)
@ends.register(VelocityConstraint)
def _(element: Element, stage: Stage) -> tuple[str, ...]:
    return ()


@ends.register
def _(element: Distance, stage: Stage) -> tuple[str, ...]:
    return element.between


@ends.register
def _(element: Rope, stage: Stage) -> tuple[str, ...]:
    return tuple(name for name in element.path if name not in stage.system.pulleys)


@ends.register
def _(element: PointOnLine, stage: Stage) -> tuple[str, ...]:
    return element.point, element.line.through


@ends.register
def _(element: PointInPlane, stage: Stage) -> tuple[str, ...]:
    return element.point, element.plane.through


@ends.register
def _(element: OnCurve, stage: Stage) -> tuple[str, ...]:
    return (element.point,)


def add_place(found: list[Vector], place: Vector) -> None:
    """Add a place to a list unless it is there."""
    if not any(same(place, other) for other in found):
        found.append(place)


def same(a: Vector, b: Vector) -> bool:
    """Return whether two places are one."""
    return float(np.abs(np.subtract(a, b)).max()) <= _SAME * (1.0 + float(np.abs(a).max()))
