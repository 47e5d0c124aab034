"""The two directions across the normal of a plane in which friction and rolling have components."""

from __future__ import annotations

from typing import Final

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.scalars.node import ONE, ZERO
from multibody_sym.scalars.vectors import cross

_PARALLEL: Final = 1e-9


def surface_tangents(normal: Point, *, flat: bool) -> tuple[Point, Point]:
    """Return unit vectors t1 and t2 = normal x t1 across a unit `normal`, all in the axes of the plane's body.

    In a model that stays in the xy-plane (`flat`) t1 = normal x z: along a floor it is x, on a ramp it leads uphill. In
    space t1 is x as far as it lies in the plane, or y where the normal is x. Both vary continuously with the normal and
    do not depend on how it is written; they are carried along with the plane's body.
    """
    t1 = (normal[1], -normal[0], ZERO) if flat else _projected(normal)
    return t1, cross(normal, t1)


def _projected(normal: Point) -> Point:
    """Return normal x (x x normal) / |..|, or the same with y: a coordinate axis on the plane."""
    if all(c.shadow is not None and abs(c.shadow) < _PARALLEL for c in normal[1:]):
        return unit_vector(cross(normal, cross((ZERO, ONE, ZERO), normal)))
    return unit_vector(cross(normal, cross((ONE, ZERO, ZERO), normal)))
