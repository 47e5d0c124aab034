"""Centres of an impact: about which points bodies turn just after it, and where a blow spares the hinge."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from multibody_sym.answers.impact.resting import ImpactInstant
from multibody_sym.answers.instant import Solved
from multibody_sym.expressions.values import Value
from multibody_sym.kinematics.motion import Motion, pose
from multibody_sym.kinematics.points import velocity
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import Pose
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import S, apply, dot, scale, subtract

_TURNS: Final = 1e-9
"""The angular velocity (rad/s, times the largest if that is more) up to which a body does not turn."""
_NOTHING: Final = 1e-12
_ROUNDED: Final = 1e-14

Centres = dict[str, dict[str, tuple[float, float]]]


def instantaneous_centres(system: System, instant: ImpactInstant) -> Centres:
    """Return for each body of a plane system its `centre` (x, y) just after, or the `direction` if it does not turn.

    What stands still has neither.
    """
    if not in_plane(system):
        return {}
    motion = instant.later
    turning = [float(body.w_WB[2]) for body in motion.bodies]
    least = _TURNS * max(1.0, *map(abs, turning)) if turning else 0.0
    moving = [velocity(motion, Marker("", k, Pose())) for k in range(len(turning))]
    fastest = max((abs(float(x)) for v in moving for x in v), default=0.0)
    found: Centres = {}
    for k, (body, omega, v) in enumerate(zip(motion.mechanism.bodies, turning, moving, strict=True)):
        x, y = float(v[0]), float(v[1])
        speed = float((x * x + y * y) ** 0.5)
        if body.is_double:
            continue
        if abs(omega) > least:
            _, p = motion.poses[k]
            centre = float(p[0]) - y / omega, float(p[1]) + x / omega
            made_of = max(abs(float(p[0])), abs(float(p[1])), fastest / abs(omega))
            found[body.name] = {"centre": (_cleared(centre[0], made_of), _cleared(centre[1], made_of))}
        elif speed > _NOTHING * fastest:
            found[body.name] = {"direction": (_cleared(x / speed, 1.0), _cleared(y / speed, 1.0))}
    return found


def _cleared(x: float, made_of: float) -> float:
    """Return 0 for what is rounding beside the largest of what it is made of."""
    return x if abs(x) > _ROUNDED * made_of else 0.0


def centres_of_percussion(solved: Solved) -> dict[str, Value]:
    """Return for each body that hangs on ground by a hinge, and carries nothing, how far from it a blow spares it.

    That is the length J_A/(m s) from the hinge A through the centre of mass, s away from it.
    """
    mechanism = solved.mechanism
    found: dict[str, Value] = {}
    for k, body in _hung(mechanism):
        number = _length(solved.numbers.motion, k, body)
        if number is None:
            continue
        node = _length(solved.nodes.motion, k, body) if solved.forms is not None else None
        known = Value(float(number)) if node is None else solved.value(as_node(node), float(number))
        found[body.name] = Value(known.value, known.expression, "m")
    return found


def _hung(mechanism: Mechanism) -> Iterator[tuple[int, TreeBody]]:
    parents = {body.parent for body in mechanism.bodies}
    for k, body in enumerate(mechanism.bodies):
        free = [step for step in body.steps if step.motion is None]
        if body.parent < 0 and k not in parents and len(body.steps) == len(free) == 1:
            (step,) = free
            if len(step.turns) == 1 and not step.slides:
                yield k, body


def _length(motion: Motion, index: int, body: TreeBody) -> S | None:
    """Return J_A/(m s) over the motion's scalar, None where the centre of mass lies on the axis or there is no mass."""
    mass, (rotation, hinge) = motion.masses[index], pose(motion.state, body.frame_on_body)
    x, y, z = motion.state.values(body.steps[0].turns[0])
    axis = apply(rotation, (x, y, z))
    arm = subtract(mass.com, hinge)
    across = subtract(arm, scale(dot(arm, axis), axis))
    square = dot(across, across)
    static = mass.mass * sqrt(square)
    if isinstance(static, float | int) and static <= 0:
        return None
    return (dot(axis, apply(mass.inertia, axis)) + mass.mass * square) / static
