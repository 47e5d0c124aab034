"""Quantities that a system may conserve: expressions in slots, with their exact rates along the motion.

    P and L about the origin, the momenta p_k = dT/du_k of the speeds, T + V, Jacobi's integral sum p_k u_k - T + V

Constant combinations of these are what the named classes hold: momenta along fixed directions and about fixed axes,
cyclic coordinates, the energy, Jacobi's integral; and about the centre of mass L_C.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

from multibody_sym.dynamics.programs.exertions import power_of
from multibody_sym.dynamics.programs.momenta import (
    angular_momentum,
    body_momenta,
    centre_of_mass,
    generalized_momenta,
    jacobi_integral,
    momentum,
)
from multibody_sym.expressions.printer import text as in_model_language
from multibody_sym.kinematics.energy import kinetic_energy, potential_energy, split
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.kinematics.state import slot_state
from multibody_sym.model.declaration.values import AXES
from multibody_sym.model.mechanism.loads import Load, PointForce, PointPull, span_leaves
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import tangents
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, quantity, slot
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import S

Kind = Literal["momentum", "axis", "centre", "speed", "energy", "jacobi"]


@dataclass(frozen=True)
class Candidate:
    """A quantity by its name in expressions, of a kind, with its value and rate; `place` is an axis or a speed."""

    name: str
    kind: Kind
    place: int
    value: Node
    rate: Node


def candidates(mechanism: Mechanism) -> list[Candidate]:
    """Return all quantities that are looked at, in slots; rates name the accelerations as slots `udot`."""
    motion = motion_of(mechanism, slot_state(mechanism))
    parts = body_momenta(motion)
    named: list[tuple[str, Kind, int, S]] = []
    vectors: list[tuple[str, Kind, S]] = [
        ("momentum({})", "momentum", momentum(parts)),
        ("angular_momentum({})", "axis", angular_momentum(parts)),
    ]
    if as_node(sum(part.mass for part in parts)) is not ZERO:
        about_centre = angular_momentum(parts, centre_of_mass(parts))
        vectors.append(("angular_momentum(system, com, {})", "centre", about_centre))
    for pattern, kind, vector in vectors:
        named += [(pattern.format(axis), kind, k, vector[k]) for k, axis in enumerate(AXES)]
    named += [
        (in_model_language(quantity("generalized_momentum", [freedom_name(mechanism, k)])), "speed", k, p)
        for k, p in enumerate(generalized_momenta(motion))
    ]
    energy = kinetic_energy(motion) + potential_energy(motion)
    named += [("total_energy()", "energy", 0, energy), ("jacobi_integral()", "jacobi", 0, jacobi_integral(motion))]
    values = [as_node(value) for *_, value in named]
    rates = tangents(values, rates_of_state(mechanism))
    found = [
        Candidate(name, kind, place, value, as_node(rate))
        for (name, kind, place, _), value, rate in zip(named, values, rates, strict=True)
    ]
    potential = [load for load in split(mechanism.loads)[1] if _has_potential(load)]
    return [*found, _with_potentials(motion, found[-2], potential)] if potential else found


def _with_potentials(motion: Motion, energy: Candidate, loads: Sequence[Load]) -> Candidate:
    """Return the energy less the work of forces that have a potential, though V does not hold it."""
    power = power_of(motion, applied(motion, loads, weight=False).of_body)
    name = " - ".join([energy.name, *(in_model_language(quantity("work", [load.name])) for load in loads)])
    return replace(energy, name=name, place=1, rate=energy.rate - power)


def _has_potential(load: Load) -> bool:
    """Return whether a force depends on the distance of its points alone, or is the same everywhere and always."""
    if isinstance(load, PointPull):
        distance = span_leaves(load.name)[0]
        return all(leaf == distance or _is_parameter(leaf) for leaf in leaves([load.value], "slot", "quantity"))
    if isinstance(load, PointForce):
        return load.axes < 0 and all(map(_is_parameter, leaves(load.value, "slot", "quantity")))
    return False


def _is_parameter(leaf: Node) -> bool:
    return leaf.op == "slot" and leaf.data[0] == "parameters"


def rates_of_state(mechanism: Mechanism) -> dict[Node, Node]:
    """Return the rate of each slot that changes: qdot = N u, udot as slots, 1 of the time."""
    state = slot_state(mechanism)
    qdot = [as_node(rate) for rate in coordinate_rates(mechanism, state.q, state.u)]
    udot = [slot("udot", k) for k in range(len(mechanism.speeds))]
    return dict(zip([*state.q, *state.u, TIME], [*qdot, *udot, ONE], strict=True))


def freedom_name(mechanism: Mechanism, speed: int) -> str:
    """Return the coordinate whose rate a speed is; the speed's own name where it is the rate of none."""
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    return mechanism.coordinates[pairs[speed]].name if speed in pairs else mechanism.speeds[speed].name
