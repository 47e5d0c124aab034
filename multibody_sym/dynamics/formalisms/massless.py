"""Freedoms without mass that rows hold: the carrier of a massless movable pulley, the turning of a particle.

M is singular there, the equations are not. With H udot = gamma they are equivalent to

    (M + w H^T H) udot = f + w H^T gamma + H^T lambda        H udot = gamma

with the same udot and lambda and, for w > 0, a positive definite matrix: wherever [[M, -H^T], [H, 0]] is regular, and
with dependent rows as well.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from random import Random
from typing import Final

import numpy as np

from multibody_sym.errors import NoSolutionError
from multibody_sym.kinematics.motion import Motion, body_mass, body_motion, motion_of, moving_parent
from multibody_sym.kinematics.partial_velocities import partial_velocities
from multibody_sym.kinematics.rows import RowMotion
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.model.mechanism.once import once
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import DRAWN, vanishes
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, add, apply, cross

_SEED: Final = 3
_LIGHTER: Final = 1024
"""How many times lighter than all bodies together the rows' weight w is."""


@once
def massless_speeds(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the speeds that nothing resists, whatever the position and the values of the parameters.

    They move only bodies declared without mass and inertia, or turn the last body of a branch about axes about which
    it has none, as those of a particle's free joint; or they move what a body without mass carries, and freedoms
    beyond it move the same in the same way.
    """
    carriers: set[int] = set()
    found: list[int] = []
    shared: list[int] = []
    drawn = cache(lambda: _generic_state(mechanism))
    for index in range(len(mechanism.bodies) - 1, -1, -1):
        body = mechanism.bodies[index]
        massless = {body.mass.mass, *body.mass.inertia} == {ZERO}
        if index not in carriers:
            found += body.u if massless else _without_inertia(body, drawn)
        elif massless:
            shared += body.u
        if index in carriers or not massless:
            carriers.add(body.parent)
    return tuple(sorted({*found, *(_moved_alike(mechanism) & set(shared) if shared else ())}))


def _moved_alike(mechanism: Mechanism) -> set[int]:
    """Return the speeds at which M = L^T D L, begun at the tips, has no pivot where nothing vanishes by chance."""
    try:
        m = _generic_mass_matrix(mechanism)
    except UNDEFINED:
        return set()
    found, diagonal = set(), m.diagonal().copy()
    for k in range(len(m) - 1, -1, -1):
        if vanishes(m[k, k], diagonal[k], DRAWN):
            found.add(k)
        else:
            m[:k, :k] -= np.outer(m[:k, k], m[k, :k] / m[k, k])
    return found


def _generic_mass_matrix(mechanism: Mechanism) -> Floats:
    """Return M (n x n) at drawn coordinates and parameters: sum of J^T diag(m, I) J about the centres of mass."""
    motion = motion_of(mechanism, _generic_state(mechanism))
    found = np.zeros((len(mechanism.speeds), len(mechanism.speeds)))
    for partials, mass in zip(partial_velocities(motion), motion.masses, strict=True):
        speeds = list(partials)
        at_com = np.array([[*add(v, cross(w, mass.com)), *w] for v, w in partials.values()], dtype=float).reshape(-1, 6)
        momenta = at_com.copy()
        momenta[:, :3] *= float(mass.mass)
        momenta[:, 3:] = at_com[:, 3:] @ np.array(mass.inertia, dtype=float)
        found[np.ix_(speeds, speeds)] += at_com @ momenta.T
    return found


def _without_inertia(body: TreeBody, drawn: Callable[[], State]) -> list[int]:
    """Return the speeds of a body's joint that give the body no momentum which those before them do not give.

    Judged where nothing vanishes by chance: at `drawn` coordinates and parameters; none where that has no value.
    """
    if ZERO not in (body.mass.mass, *body.mass.inertia[:3]) or (_slides(body) and body.mass.mass is not ZERO):
        return []
    try:
        momenta = _momenta(body, drawn())
    except UNDEFINED:
        return []
    found, basis = [], np.zeros((6, 0))
    for k, momentum in zip(body.u, momenta, strict=True):
        rest = momentum - basis @ (basis.T @ momentum)
        length = float(np.linalg.norm(rest))
        if vanishes(length, max(1.0, float(np.linalg.norm(momentum))), DRAWN):
            found.append(k)
        else:
            basis = np.column_stack([basis, rest / length])
    return found


def _slides(body: TreeBody) -> bool:
    """Return whether its joint only moves it along one axis."""
    return len(body.u) == 1 and all(free.step.slides and not free.step.turns for free in body.free_steps)


def _momenta(body: TreeBody, state: State) -> list[Floats]:
    """Return momentum and angular momentum about the centre of mass (6) for each unit speed of a body's joint."""
    moved = body_motion(body, moving_parent(ZERO_VECTOR, ZERO_VECTOR, ZERO_VECTOR), state)
    mass = body_mass(body, state)
    return [
        np.array([*(mass.mass * x for x in add(v, cross(w, mass.com))), *apply(mass.inertia, w)], dtype=float)
        for v, w in zip(moved.linear, moved.angular, strict=True)
    ]


def _generic_state(mechanism: Mechanism) -> State:
    draw = Random(_SEED).uniform  # every run comes here, and importing NumPy's takes longer than all that is drawn
    sizes = len(mechanism.coordinates), len(mechanism.parameters)
    q, parameters = ([draw(0.5, 1.5) for _ in range(size)] for size in sizes)
    inputs, u = [0.0] * len(mechanism.inputs), [0.0] * len(mechanism.speeds)
    return state_of(mechanism, float, 0.5, q, u, parameters, inputs)


def verify_massive(mechanism: Mechanism, formalism: str) -> None:
    """Raise NoSolutionError where rows hold a freedom without mass, for a formalism that divides by it."""
    if massless_speeds(mechanism):
        raise NoSolutionError(f"{formalism} needs inertia in every direction; choose composite_body", number="N102")


def completed_matrix(motion: Motion, matrix: list[list[S]], rows: Sequence[RowMotion]) -> list[list[S]]:
    """Return M + w H^T H where there are massless speeds, else M."""
    if not rows or not massless_speeds(motion.mechanism):
        return matrix
    weight, held = _weight(motion), [row for row in rows if row.kinematic]
    return [
        [m + weight * sum((row.jacobian[i] * row.jacobian[j] for row in held), 0) for j, m in enumerate(line)]
        for i, line in enumerate(matrix)
    ]


def completed_forces(motion: Motion, forces: Sequence[S], rows: Sequence[RowMotion]) -> Sequence[S]:
    """Return Q + w H^T gamma where there are massless speeds, else Q."""
    if not rows or not massless_speeds(motion.mechanism):
        return forces
    weight, held = _weight(motion), [row for row in rows if row.kinematic]
    return [q + weight * sum((row.jacobian[k] * row.gamma for row in held), 0) for k, q in enumerate(forces)]


def _weight(motion: Motion) -> S:
    """Return w: small beside the masses, so that it rounds away little of what light bodies do."""
    return sum((mass.mass for mass in motion.masses), 0) / _LIGHTER if _has_mass(motion.mechanism) else 1


def _has_mass(mechanism: Mechanism) -> bool:
    return any(body.mass.mass != ZERO for body in mechanism.bodies)
