"""d'Alembert's principle in Lagrange's form, body by body in world axes, in floats: an independent reference.

The active and inertia forces of all bodies do no work on virtual displacements. Projected on the partial velocities
J_C = dv_C/du and J_w = domega/du of each body:

    M = sum m J_C^T J_C + J_w^T I J_w,   c = sum J_C^T m a_C + J_w^T (I alpha + omega x I omega)   (for udot = 0)

Source: Wittenburg, Dynamics of Multibody Systems, section 5.2.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot

import numpy as np

from multibody_sym.kinematics.loads import apart, applied, span
from multibody_sym.kinematics.motion import Motion, accelerations, pose
from multibody_sym.kinematics.points import velocity
from multibody_sym.kinematics.row_sizes import row_terms
from multibody_sym.kinematics.rows import constraint_jacobian, exerted, row_motions
from multibody_sym.kinematics.wrenches import NO_WRENCH, Wrench
from multibody_sym.model.mechanism.loads import JointSpring, Load, PointSpring
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Reference:
    """M (n x n), Q (n), c (n), H (s x n), gamma (s), and the sums of absolute contributions to Q, c and gamma.

    Multipliers exert `forces` C^T lambda (C s x n), which is H but for friction, those of rows `beside` others along
    the vectors that they make with them, and are in rows that define forces by the `coupling` D (s x s). `exerted` (s):
    the largest force or moment that a unit multiplier exerts on a body, which H may hold nothing of.
    """

    mass_matrix: Floats
    applied: Floats
    velocity_terms: Floats
    constraint_jacobian: Floats
    constraint_forcing: Floats
    absolute_applied: Floats
    absolute_velocity_terms: Floats
    absolute_constraint_forcing: Floats
    exerted: Floats
    forces: Floats
    coupling: Floats
    beside: Mapping[int, tuple[int, ...]]


@dataclass(frozen=True)
class Partials:
    """One body in world axes: rotation R_WB, partial velocities of its origin and of its rotation (3 x nu)."""

    rotation: Floats
    linear: Floats
    angular: Floats

    def force(self, force: Floats, moment: Floats) -> tuple[Floats, Floats]:
        """Return the generalised forces of a wrench about the origin (world axes), and their absolute contributions."""
        value = self.linear.T @ force + self.angular.T @ moment
        return value, self.sizes(float(np.linalg.norm(force)), float(np.linalg.norm(moment)))

    def sizes(self, force: float, moment: float) -> Floats:
        """Return what a force and a moment of these lengths make of each generalised force at most.

        Products of lengths, as other axes make terms cancel where these do not.
        """
        found: Floats = np.linalg.norm(self.linear, axis=0) * force + np.linalg.norm(self.angular, axis=0) * moment
        return found


def dalembert(motion: Motion) -> Reference:
    """Return the equations of motion at a state over floats."""
    partials = partial_velocities(motion)
    count = len(motion.state.u)
    velocities, momenta = [np.zeros((0, count))], [np.zeros((0, count))]
    terms, absolute_terms = np.zeros(count), np.zeros(count)
    for index, (a, alpha) in enumerate(accelerations(motion, [0] * count)):
        at_com, tensor = _about_com(motion, partials[index], index)
        velocities += [at_com.linear, at_com.angular]
        momenta += [float(motion.masses[index].mass) * at_com.linear, tensor @ at_com.angular]
        (force, moment), sizes = _inertia_force(motion, at_com.rotation, tensor, index, a, alpha)
        terms += at_com.force(force, moment)[0]
        absolute_terms += at_com.sizes(*sizes)
    forces, absolute_forces = _applied(motion, partials)
    rows = row_motions(motion)
    jacobian = constraint_jacobian(rows).reshape(len(rows), count)
    gamma = np.array([row.gamma for row in rows], dtype=float)
    defining = [0.0 if row.kinematic else abs(float(row.gamma)) for row in rows]
    pushing = [row.forces if row.exerts is not None else h for row, h in zip(rows, jacobian, strict=True)]
    coupling = [[row.coupling.get(k, 0.0) for k in range(len(rows))] for row in rows]
    matrix = np.vstack(velocities).T @ np.vstack(momenta)
    absolutes = absolute_forces, absolute_terms, np.array(row_terms(motion), dtype=float) + defining
    square = (len(rows), len(rows))
    return Reference(
        matrix,
        forces,
        terms,
        jacobian,
        gamma,
        *absolutes,
        exerted(rows),
        np.array(pushing, dtype=float).reshape(jacobian.shape),
        np.array(coupling, dtype=float).reshape(square),
        {k: row.beside for k, row in enumerate(rows) if row.beside},
    )


def partial_velocities(motion: Motion) -> list[Partials]:
    """Return each body's partial velocities with respect to all speeds."""
    found: list[Partials] = []
    count = len(motion.state.u)
    world = Partials(np.eye(3), np.zeros((3, count)), np.zeros((3, count)))
    for index, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        parent = found[body.parent] if body.parent >= 0 else world
        rotation = _array(motion.rotation(index))
        linear = parent.linear - _skew(parent.rotation @ _array(moved.p_PB)) @ parent.angular
        angular = parent.angular.copy()
        for k, v, w in zip(body.u, moved.linear, moved.angular, strict=True):
            linear[:, k] += rotation @ _array(v)
            angular[:, k] += rotation @ _array(w)
        found.append(Partials(rotation, linear, angular))
    return found


def _about_com(motion: Motion, body: Partials, index: int) -> tuple[Partials, Floats]:
    """Return a body's partial velocities at its centre of mass, and its inertia in world axes."""
    mass, R = motion.masses[index], body.rotation
    linear = body.linear - _skew(R @ _array(mass.com)) @ body.angular
    return Partials(R, linear, body.angular), R @ _array(mass.inertia) @ R.T


def _inertia_force(
    motion: Motion, R: Floats, tensor: Floats, index: int, a: Sequence[float], alpha: Sequence[float]
) -> tuple[tuple[Floats, Floats], tuple[float, float]]:
    """Return m a_C and I alpha + omega x I omega in world axes, and the sums of the lengths of their terms.

    Of a ball omega x I omega is zero to the last bit here, and rounding where other routes add up its parts.
    """
    spin, turning, com = R @ _array(motion.bodies[index].w_WB), R @ _array(alpha), R @ _array(motion.masses[index].com)
    mass, momentum = float(motion.masses[index].mass), tensor @ spin
    a_com = R @ _array(a) + np.cross(turning, com) + np.cross(spin, np.cross(spin, com))
    w, arm = hypot(*spin), hypot(*com)
    force = mass * (hypot(*a) + (hypot(*turning) + w * w) * arm)
    moment = hypot(*(tensor @ turning)) + w * hypot(*momentum)
    return (mass * a_com, tensor @ turning + np.cross(spin, momentum)), (abs(force), moment)


def _applied(motion: Motion, partials: Sequence[Partials]) -> tuple[Floats, Floats]:
    """Return Q and its absolute contributions: each load's on each body, each weight, each drive."""
    total, absolute = np.zeros(len(motion.state.u)), np.zeros(len(motion.state.u))
    loads = motion.mechanism.loads
    acting = [(applied(motion, [x], weight=False), _cancelled(motion, x), _levers(motion, x)) for x in loads]
    for forces, larger, levers in [*acting, (applied(motion, []), 1.0, {})]:
        drives = np.array(forces.of_speed, dtype=float)
        total, absolute = total + drives, absolute + larger * np.abs(drives)
        acted_on = [k for k, wrench in enumerate(forces.of_body) if wrench != NO_WRENCH]
        for k, body in ((k, partials[k]) for k in acted_on):
            force, moment = _in_world(body.rotation, forces.of_body[k])
            pressed = float(np.linalg.norm(force))
            part = body.sizes(pressed, max(float(np.linalg.norm(moment)), levers.get(k, 0.0) * pressed))
            total, absolute = total + body.force(force, moment)[0], absolute + larger * part
    return total, absolute


def _levers(motion: Motion, load: Load) -> dict[int, float]:
    """Return how far from each body's origin a load acts: with no moment about it, that is a difference of terms."""
    found: dict[int, float] = {}
    for marker in load.points:
        lever = hypot(*pose(motion.state, marker.pose)[1])
        found[marker.body] = max(found.get(marker.body, 0.0), lever)
    return found


def _cancelled(motion: Motion, load: Load) -> float:
    """Return how much larger than a spring's force the terms are whose difference it is."""
    if load.spring is None:
        return 1.0
    if isinstance(load, JointSpring):
        k, d, rest = motion.state.values([load.stiffness, load.damping, load.rest])
        at, rate = motion.state.values([load.coordinate, load.rate])
        terms, force = abs(k) * (abs(at) + abs(rest)) + abs(d * rate), k * (at - rest) + d * rate
    elif isinstance(load, PointSpring):
        k, d, rest = motion.state.values([load.stiffness, load.damping, load.length])
        if not any(apart(motion, load.ends)):
            return 1.0  # a spring without rest length, whose ends meet
        length, direction = span(motion, load.ends)
        first, second = (np.array(velocity(motion, end), dtype=float) for end in load.ends)
        terms = abs(k) * (length + abs(rest)) + abs(d) * float(np.linalg.norm(first) + np.linalg.norm(second))
        force = k * (length - rest) + d * float(np.dot(direction, second - first))
    else:
        raise TypeError(f"nothing says of which terms the force of {type(load).__name__} is a difference")
    return float(terms / abs(force)) if force else 1.0


def _in_world(R: Floats, wrench: Wrench) -> tuple[Floats, Floats]:
    return R @ _array(wrench[0]), R @ _array(wrench[1])


def _array(vector: object) -> Floats:
    return np.array(vector, dtype=float)


def _skew(a: Floats) -> Floats:
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
