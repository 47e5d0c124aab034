"""Kinetic and potential energy of a mechanism over any scalar, and what may change their sum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import singledispatch
from typing import Final

from multibody_sym.mechanics.forces import apart, own_leaves, span, span_rate, varies
from multibody_sym.mechanics.load_records import JointPotential, JointSpring, Load, PointDrag, PointSpring
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import BodyMass, BodyMotion, Motion
from multibody_sym.mechanics.points import velocity
from multibody_sym.mechanics.row_records import Multiplier, VelocityRow
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, nodes_among
from multibody_sym.scalars.vectors import Mat, S, Vec, add, apply, cross, dot

_ORDER: Final[tuple[Multiplier, ...]] = ("multiplier", "rod", "rope", "force")


def kinetic_energy(motion: Motion) -> S:
    """Return T = sum (m v_C^2 + omega . J_C omega) / 2."""
    return sum((body_kinetic_energy(b, m) for b, m in zip(motion.bodies, motion.masses, strict=True)), 0)


def body_kinetic_energy(body: BodyMotion, mass: BodyMass) -> S:
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
    """Return the loads that the potential energy V holds, and those that do work instead.

    V holds springs whose stiffness and rest are constant or given in time, and potentials without inputs; the springs'
    damping, and all else, does work.
    """
    stored: list[Load] = []
    working: list[Load] = []
    for load in loads:
        parts = _stored_by(load)
        allowed = ("parameters", "t", "q") if isinstance(load, JointPotential) else ("parameters", "t")
        if not parts or any(leaf.data[0] not in allowed for leaf in leaves(parts, "slot")):
            working.append(load)
            continue
        stored.append(load)
        if isinstance(load, (JointSpring, PointSpring)) and load.damping is not ZERO:
            working.append(replace(load, stiffness=ZERO))
    return tuple(stored), tuple(working)


def working_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of loads and rows that may change the total energy: they are not in V, or time moves them."""
    loads = [load.name for load in split(mechanism.loads)[1]]
    return tuple(dict.fromkeys((*loads, *_names_moved_by_time(mechanism))))


def driving_names(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of loads and rows that may raise the total energy: `working` but for dampers and drag.

    With rows of speeds among them that do not let everything rest.
    """
    loads = [load.name for load in split(mechanism.loads)[1] if not load.only_brakes]
    return tuple(dict.fromkeys((*loads, *_names_moved_by_time(mechanism), *_rows_with_given_speed(mechanism))))


def works_unseen(mechanism: Mechanism) -> bool:
    """Return whether work is done outside of loads: by drives, springs and rows that time moves, given speeds."""
    return bool(mechanism.drives or _names_moved_by_time(mechanism) or _rows_with_given_speed(mechanism))


def moved_by_time(mechanism: Mechanism) -> bool:
    """Return whether time, or an input, moves a load or a row that does work, or mass comes and goes."""
    held = (getattr(load, f.name) for load in mechanism.loads for f in fields(load))
    parts = (part for x in held for part in (x if isinstance(x, tuple) else (x,)))
    masses = any(map(varies, mechanism.bodies))
    return masses or bool(_names_moved_by_time(mechanism)) or _name_time(*nodes_among(parts))


def _names_moved_by_time(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of springs, potentials and rows that time moves."""
    springs = [load.name for load in mechanism.loads if _name_time(*_stored_by(load))]
    rows = sorted(mechanism.rows, key=lambda row: _ORDER.index(row.multiplier))
    return (*springs, *(row.name for row in rows if _name_time(*row.laws)))


def _rows_with_given_speed(mechanism: Mechanism) -> list[str]:
    """Return the names of rows of speeds that do not let everything rest."""
    rows = [row for row in mechanism.rows if isinstance(row, VelocityRow)]
    at_rest = evaluate([x.zero for x in rows], lambda leaf: ZERO if leaf.op == "slot" and leaf.data[0] == "u" else leaf)
    return [row.name for row, value in zip(rows, at_rest, strict=True) if value is not ZERO]


def _name_time(*expressions: Node) -> bool:
    return any(leaf.data[0] in ("t", "inputs") for leaf in leaves(expressions, "slot"))


def _stored_by(load: Load) -> tuple[Node, ...]:
    if load.spring is not None:
        return load.spring
    return () if load.energy is None else (load.energy,)


@singledispatch
def stored_energy(load: Load, motion: Motion) -> S:
    """Return the energy that a load stores: k (length - l0)^2 / 2 for springs, V for potentials, else 0."""
    if not isinstance(load, Load) or load.spring is not None:
        raise TypeError(f"nothing says what energy {type(load).__name__} stores")
    if load.energy is None:
        return 0
    return motion.state.values([load.energy], own_leaves(load, motion))[0]


@stored_energy.register
def _(load: PointSpring, motion: Motion) -> S:
    stiffness, rest = motion.state.values([load.stiffness, load.length])
    if stiffness == 0:
        return 0
    if load.length is ZERO:
        difference = apart(motion, load.ends)
        return stiffness * dot(difference, difference) / 2
    stretch = span(motion, load.ends, load.straight)[0] - rest
    return stiffness * (stretch * stretch) / 2


@stored_energy.register
def _(load: JointSpring, motion: Motion) -> S:
    stiffness, rest, coordinate = motion.state.values([load.stiffness, load.rest, load.coordinate])
    stretch = coordinate - rest
    return stiffness * (stretch * stretch) / 2


# --- dampers -------------------------------------------------------------------------------------------------------


def dissipation(motion: Motion) -> S | None:
    """Return Rayleigh's D = sum of c v^2/2 of all dampers and drags, whose force is -dD/du.

    None where there are none, or one is not linear in the speeds.
    """
    found: S | None = None
    for load in motion.mechanism.loads:
        coefficients = _coefficients(load)
        if all(x is ZERO for x in coefficients):
            continue
        squared = isinstance(load, PointDrag) and load.quadratic is not ZERO
        if squared or any(leaf.data[0] in ("u", "inputs") for leaf in leaves(coefficients, "slot")):
            return None
        (damping,) = motion.state.values(coefficients[:1])
        if isinstance(load, JointSpring):
            (rate,) = motion.state.values([load.rate])
            half = damping * (rate * rate) / 2
        elif isinstance(load, PointSpring):
            rate = span_rate(motion, load.ends, span(motion, load.ends, load.straight)[1])
            half = damping * (rate * rate) / 2
        elif isinstance(load, PointDrag):
            v = velocity(motion, load.at)
            half = damping * dot(v, v) / 2
        else:
            raise TypeError(f"nothing says what power {type(load).__name__} takes")
        found = half if found is None else found + half
    return found


def brakes(mechanism: Mechanism) -> bool:
    """Return whether there are dampers or drags."""
    return any(x is not ZERO for load in mechanism.loads for x in _coefficients(load))


def _coefficients(load: Load) -> tuple[Node, ...]:
    """Return the factors of the forces of a load that brakes."""
    if isinstance(load, (JointSpring, PointSpring)):
        return (load.damping,)
    return (load.linear, load.quadratic) if isinstance(load, PointDrag) else ()

