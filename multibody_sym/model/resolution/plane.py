"""Systems that everything declared keeps in the xy-plane: their absolute coordinates are x, y and an angle."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.constraints import PointInPlane, PointOnLine
from multibody_sym.model.declaration.forces import Force, Torque
from multibody_sym.model.declaration.steps import is_flat, is_upright
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mass import mass_of
from multibody_sym.model.mechanism.rows import AngleRow, PositionRow, RollingRow, Row
from multibody_sym.scalars.node import Node


def in_plane(system: System) -> bool:
    """Return whether a system stays in the plane z = 0: all that is declared lies in it, or turns about its normal."""
    if not all(step.stays_in_plane for joint in system.joints.values() for step in joint.steps):
        return False
    vectors = [system.gravity, *(v for body in system.bodies.values() for v in _vectors(body))]
    axes = [axis for body in system.bodies.values() for axis in _axes(body)]
    axes += [pulley.axis for pulley in system.pulleys.values()]
    for element in (*system.forces.values(), *system.constraints.values()):
        if isinstance(element, Force):
            vectors.append(element.value)
        elif isinstance(element, Torque) and not isinstance(element.value, Node):
            axes.append(element.value)
        elif isinstance(element, PointOnLine):
            vectors.append(element.line.direction)
        elif isinstance(element, PointInPlane):
            vectors.append(element.plane.normal)
    return all(map(is_flat, vectors)) and all(map(is_upright, axes))


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
    kept = [row for row in rows if _acts_in_plane(row)]
    return [replace(row, shared=row.directions[1]) if isinstance(row, AngleRow) else row for row in kept]


def _acts_in_plane(row: Row) -> bool:
    if isinstance(row, PositionRow):
        return not is_upright(row.axis)
    if isinstance(row, RollingRow):
        return not is_upright(row.along)
    return not isinstance(row, AngleRow) or all(map(is_flat, row.directions))

