"""Kinetic and potential energy of a mechanism over any scalar."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import singledispatch

from multibody_sym.kinematics.loads import apart, span
from multibody_sym.kinematics.motion import BodyMass, BodyMotion, Motion
from multibody_sym.model.mechanism import JointSpring, Load, PointSpring
from multibody_sym.scalars.node import ZERO, leaves
from multibody_sym.scalars.vectors import Mat, S, Vec, add, apply, cross, dot


def kinetic_energy(motion: Motion) -> S:
    """Return T = sum (m v_C^2 + omega . J_C omega) / 2."""
    return sum((body_kinetic_energy(b, m) for b, m in zip(motion.bodies, motion.masses, strict=True)), 0)


def body_kinetic_energy(body: BodyMotion, mass: BodyMass) -> S:
    """Return one body's kinetic energy."""
    v_com = add(body.v_WB, cross(body.w_WB, mass.com))
    return (mass.mass * dot(v_com, v_com) + dot(body.w_WB, apply(mass.inertia, body.w_WB))) / 2


def potential_energy(motion: Motion) -> S:
    """Return V = - sum m g . p_C + the energy stored in springs that have a potential."""
    bodies = zip(motion.poses, motion.masses, strict=True)
    return sum((weight_energy(pose, mass, motion.gravity) for pose, mass in bodies), 0) + springs_energy(motion)


def weight_energy(pose: tuple[Mat, Vec], mass: BodyMass, gravity: Vec) -> S:
    """Return one body's -m g . p_C."""
    R_WB, p_WB = pose
    return -mass.mass * dot(gravity, add(p_WB, apply(R_WB, mass.com)))


def springs_energy(motion: Motion) -> S:
    """Return the energy stored in springs that have a potential."""
    return sum((stored_energy(load, motion) for load in split(motion.mechanism.loads)[0]), 0)


def split(loads: Sequence[Load]) -> tuple[tuple[Load, ...], tuple[Load, ...]]:
    """Return the loads that the potential energy holds, and those that do work instead.

    Springs belong to V where stiffness and rest are constant or given in time; their damping, and all else, does work.
    """
    stored: list[Load] = []
    working: list[Load] = []
    for load in loads:
        if not isinstance(load, (JointSpring, PointSpring)) or not _has_potential(load):
            working.append(load)
            continue
        stored.append(load)
        if load.damping is not ZERO:
            working.append(replace(load, stiffness=ZERO))
    return tuple(stored), tuple(working)


def _has_potential(spring: JointSpring | PointSpring) -> bool:
    rest = spring.rest if isinstance(spring, JointSpring) else spring.length
    return all(leaf.data[0] in ("parameters", "t") for leaf in leaves([spring.stiffness, rest], "slot"))


@singledispatch
def stored_energy(load: Load, motion: Motion) -> S:
    """Return the energy that a load stores: k (length - l0)^2 / 2 for springs, nothing for the others."""
    return 0


@stored_energy.register
def _(load: PointSpring, motion: Motion) -> S:
    stiffness, rest = motion.state.values([load.stiffness, load.length])
    if stiffness == 0:
        return 0
    if load.length is ZERO:
        difference = apart(motion, load.ends)
        return stiffness * dot(difference, difference) / 2
    stretch = span(motion, load.ends)[0] - rest
    return stiffness * (stretch * stretch) / 2


@stored_energy.register
def _(load: JointSpring, motion: Motion) -> S:
    stiffness, rest, coordinate = motion.state.values([load.stiffness, load.rest, load.coordinate])
    stretch = coordinate - rest
    return stiffness * (stretch * stretch) / 2
