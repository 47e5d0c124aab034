"""The two directions across the normal of a plane in which friction and rolling have components."""

from __future__ import annotations

from typing import Final

from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import unit_vector
from multibody_sym.scalars.functions import cos, sin
from multibody_sym.scalars.node import ONE, ZERO, Node
from multibody_sym.scalars.vectors import add, cross, scale

_PARALLEL: Final = 1e-9
_X: Final[Point] = (ONE, ZERO, ZERO)


def surface_tangents(normal: Point, *, flat: bool) -> tuple[Point, Point]:
    """Return unit vectors t1 and t2 = normal x t1 across a unit `normal`, all in the axes of the plane's body.

    In a model that stays in the xy-plane (`flat`) t1 = normal x z: along a floor it is x, on a ramp it leads uphill. In
    space t1 is x as far as it lies in the plane, or y where the normal is x. Both vary continuously with the normal and
    do not depend on how it is written. In space these are the tangents of planes whose body's axes are ground's.
    """
    t1 = (normal[1], -normal[0], ZERO) if flat else _projected(normal)
    return t1, cross(normal, t1)


def turned_tangents(normal: Point, across: Point, angle: Node) -> tuple[Point, Point]:
    """Return t1, which leads the unit vector `across` by an angle about a unit `normal`, and t2 = normal x t1."""
    ahead = cross(normal, across)
    return (
        add(scale(cos(angle), across), scale(sin(angle), ahead)),
        add(scale(cos(angle), ahead), scale(-sin(angle), across)),
    )


def across(normal: Point) -> Point:
    """Return a unit vector across a unit normal: x as far as it lies in the plane, wherever this has a simple form.

    Of a normal without a component along an axis it has one whatever the parameters are.
    """
    x, y, z = normal
    if x is ZERO:
        return _X
    if y is ZERO:
        return (z, ZERO, -x)
    if z is ZERO:
        return (y, -x, ZERO)
    return _projected(normal)


def _projected(normal: Point) -> Point:
    """Return normal x (x x normal) / |..|, or the same with y: a coordinate axis on the plane."""
    if all(c.shadow is not None and abs(c.shadow) < _PARALLEL for c in normal[1:]):
        return unit_vector(cross(normal, cross((ZERO, ONE, ZERO), normal)))
    return unit_vector(cross(normal, cross(_X, normal)))
