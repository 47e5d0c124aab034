"""Freedoms without mass that rows hold: the carrier of a massless movable pulley, a massless slider on a rod.

M is singular there, the equations are not. With H udot = gamma they are equivalent to

    (M + w H^T H) udot = f + w H^T gamma + H^T lambda        H udot = gamma

with the same udot and lambda and, for w > 0, a positive definite matrix.
"""

from __future__ import annotations

from collections.abc import Sequence

from multibody_sym.errors import NoSolutionError
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import S


def massless_speeds(mechanism: Mechanism) -> list[int]:
    """Return the speeds that move nothing but bodies declared without mass and inertia."""
    massive = {index for index, body in enumerate(mechanism.bodies) if {body.mass.mass, *body.mass.inertia} != {ZERO}}
    for index in range(len(mechanism.bodies) - 1, -1, -1):
        if index in massive:
            massive.add(mechanism.bodies[index].parent)
    return [k for index, body in enumerate(mechanism.bodies) if index not in massive for k in body.u]


def verify_massive(mechanism: Mechanism, formalism: str) -> None:
    """Raise NoSolutionError where rows hold a freedom without mass, for a formalism that divides by it."""
    if massless_speeds(mechanism):
        raise NoSolutionError(f"{formalism} needs inertia in every direction; choose composite_body")


def completed_matrix(motion: Motion, matrix: list[list[S]], rows: Sequence[RowMotion]) -> list[list[S]]:
    """Return M + w H^T H where there are massless speeds, else M; w is the mass of all bodies."""
    if not rows or not massless_speeds(motion.mechanism):
        return matrix
    weight = _weight(motion)
    return [
        [m + weight * sum((row.jacobian[i] * row.jacobian[j] for row in rows), 0) for j, m in enumerate(line)]
        for i, line in enumerate(matrix)
    ]


def completed_forces(motion: Motion, forces: Sequence[S], rows: Sequence[RowMotion]) -> Sequence[S]:
    """Return Q + w H^T gamma where there are massless speeds, else Q."""
    if not rows or not massless_speeds(motion.mechanism):
        return forces
    weight = _weight(motion)
    return [q + weight * sum((row.jacobian[k] * row.gamma for row in rows), 0) for k, q in enumerate(forces)]


def _weight(motion: Motion) -> S:
    return sum((mass.mass for mass in motion.masses), 0)
