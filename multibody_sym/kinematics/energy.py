"""Kinetic and potential energy of a mechanism over any scalar."""

from __future__ import annotations

from functools import singledispatch

from multibody_sym.kinematics.loads import span
from multibody_sym.kinematics.motion import BodyMass, BodyMotion, Motion
from multibody_sym.kinematics.vectors import S, add, apply, cross, dot
from multibody_sym.model.mechanism import JointSpring, Load, PointSpring


def kinetic_energy(motion: Motion) -> S:
    """Return T = sum (m v_C^2 + omega . J_C omega) / 2."""
    return sum((body_kinetic_energy(b, m) for b, m in zip(motion.bodies, motion.masses, strict=True)), 0)


def body_kinetic_energy(body: BodyMotion, mass: BodyMass) -> S:
    """Return one body's kinetic energy."""
    v_com = add(body.v_WB, cross(body.w_WB, mass.com))
    return (mass.mass * dot(v_com, v_com) + dot(body.w_WB, apply(mass.inertia, body.w_WB))) / 2


def potential_energy(motion: Motion) -> S:
    """Return V = - sum m g . p_C + the energy stored in springs."""
    total: S = 0
    for (R_WB, p_WB), mass in zip(motion.poses, motion.masses, strict=True):
        total = total - mass.mass * dot(motion.gravity, add(p_WB, apply(R_WB, mass.com)))
    return sum((stored_energy(load, motion) for load in motion.mechanism.loads), total)


@singledispatch
def stored_energy(load: Load, motion: Motion) -> S:
    """Return the energy that a load stores: k (length - l0)^2 / 2 for springs, nothing for the others."""
    return 0


@stored_energy.register
def _(load: PointSpring, motion: Motion) -> S:
    stiffness, rest = motion.state.values([load.stiffness, load.length])
    if stiffness == 0:
        return 0
    stretch = span(motion, load.ends)[0] - rest
    return stiffness * (stretch * stretch) / 2


@stored_energy.register
def _(load: JointSpring, motion: Motion) -> S:
    stiffness, rest = motion.state.values([load.stiffness, load.rest])
    stretch = motion.state.q[load.q] - rest
    return stiffness * (stretch * stretch) / 2
