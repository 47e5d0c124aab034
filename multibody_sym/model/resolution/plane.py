"""Systems that everything declared keeps in the xy-plane: their absolute coordinates are x, y and an angle."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import singledispatch

from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.constraints import PointInPlane, PointOnLine
from multibody_sym.model.declaration.fields import Element, holds_vectors
from multibody_sym.model.declaration.forces import Force, Potential, Torque
from multibody_sym.model.declaration.steps import is_flat, is_upright
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import mass_of
from multibody_sym.model.mechanism.rows import AngleRow, Row
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import ZERO, Node, symbol


def in_plane(system: System) -> bool:
    """Return whether a system stays in the plane z = 0: all that is declared lies in it, or turns about its normal."""
    if not all(step.stays_in_plane for joint in system.joints.values() for step in joint.steps):
        return False
    vectors = [system.gravity, *(v for body in system.bodies.values() for v in _vectors(body))]
    axes = [axis for body in system.bodies.values() for axis in _axes(body)]
    axes += [pulley.axis for pulley in system.pulleys.values()]
    vectors += [contact.tangent for contact in system.contacts.values() if contact.tangent is not None]
    for element in (*system.forces.values(), *system.constraints.values()):
        lying, upright = _vectors_and_axes(element)
        vectors += lying
        axes += upright
    return all(map(is_flat, vectors)) and all(map(is_upright, axes))


def moves_in_plane(system: System) -> bool:
    """Return whether nothing moves out of the plane z = 0 of its joints, whatever acts on it across that."""
    if not all(step.stays_in_plane for joint in system.joints.values() for step in joint.steps):
        return False
    bodies = system.bodies.values()
    motions = [(b.motion.x, b.motion.y, b.motion.z) for b in bodies if b.motion is not None]
    return all(map(is_flat, motions)) and all(is_upright(axis) for body in bodies for axis in _axes(body))


@singledispatch
def _vectors_and_axes(element: Element) -> tuple[Sequence[Point], Sequence[Point]]:
    """Return what lies in the plane and what is normal to it where a force or constraint keeps bodies there."""
    if not isinstance(element, Element) or holds_vectors(type(element)):
        raise TypeError(f"nothing says which vectors of {type(element).__name__} lie in the plane")
    return (), ()


@_vectors_and_axes.register
def _(element: Force) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.value,), ()


@_vectors_and_axes.register
def _(element: Torque) -> tuple[Sequence[Point], Sequence[Point]]:
    return (), () if isinstance(element.value, Node) else (element.value,)


@_vectors_and_axes.register
def _(element: Potential) -> tuple[Sequence[Point], Sequence[Point]]:
    """Return the slope along the normal, which pushes out of the plane."""
    return ((ZERO, ZERO, derivative(element.value, symbol("z"))),) if element.on is not None else (), ()


@_vectors_and_axes.register
def _(element: PointOnLine) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.line.direction,), ()


@_vectors_and_axes.register
def _(element: PointInPlane) -> tuple[Sequence[Point], Sequence[Point]]:
    return (element.plane.normal,), ()


def _vectors(body: Body) -> Iterator[Point]:
    """Yield what lies in the plane where a body stays in it; (0, 0, product of inertia) stands for the latter."""
    mass = mass_of(body)
    yield mass.com
    yield from ((0 * mass.mass, 0 * mass.mass, product) for product in mass.inertia[4:])
    yield from body.points.values()
    yield from (frame.position for frame in body.frames.values())
    for surface in body.surfaces.values():
        yield surface.centre
        if surface.plane is not None:
            yield from (surface.plane, surface.normal)
        yield from body.ends((*(surface.between or ()), *(surface.segment or ())))
        if surface.point is not None:
            yield surface.point
        if surface.revolution is not None:
            yield surface.axis
    if body.motion is not None:
        yield body.motion.x, body.motion.y, body.motion.z


def _axes(body: Body) -> Iterator[Point]:
    """Yield what is normal to the plane where a body stays in it."""
    turns = [turn for frame in body.frames.values() for turn in frame.rotate]
    turns += body.motion.turn if body.motion is not None else ()
    yield from (turn.axis for turn in turns)
    yield from (surface.axis for surface in body.surfaces.values() if surface.disc is not None)


def rows_in_plane(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that restrict motion in the plane; the others restrict what never moves.

    Turned over, which rows of angles do not tell from upright, is turned by pi about the normal here.
    """
    kept = [row for row in rows if row.acts_in_plane]
    return [replace(row, shared=row.directions[1]) if isinstance(row, AngleRow) else row for row in kept]

