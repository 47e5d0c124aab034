"""Lagrange's equations of the second kind, and with multipliers of the first, derived with sympy from T, V and Q.

    N(q)^T ( d/dt dT/dqdot - dT/dq + dV/dq ) = Q + H^T lambda        H = (dphi/dq) N,   H udot = gamma

T and V are the energies of the kinematics; Q is the virtual work of all loads outside V. Derivatives are exact and by
the chain rule over named sub-expressions. The result is M udot = Q - c like every other formalism's, with dV/dq inside
Q; it is lowered to Nodes, so that what sympy derived is what is compiled.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions
from multibody_sym.derivation.notation import Symbols, numbered_symbols
from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion, equations
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.energy import brakes, dissipation, kinetic_energy, potential_energy, split, stored_energy
from multibody_sym.mechanics.forces import TINY, applied_forces, applied_generalized_forces, varies
from multibody_sym.mechanics.mechanism import Mechanism, once
from multibody_sym.mechanics.motion import (
    Motion,
    State,
    coordinate_rates,
    joint_rates,
    motion_of,
    slot_state,
    turning_momenta,
)
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.bodies import Mass
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, as_node, quantity, slot
from multibody_sym.scalars.vectors import S


def lagrange(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state; raises ModelError where rows restrict the tree."""
    verify_free(mechanism)
    return _lower_equations(mechanism).at(mechanism, state)


def multipliers(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state, with the rows' multipliers as further unknowns."""
    return _lower_equations(mechanism).at(mechanism, state)


def verify_free(mechanism: Mechanism) -> None:
    """Raise ModelError where rows restrict the tree, so that its coordinates are not independent."""
    if mechanism.rows:
        raise ModelError(
            f"{mechanism.rows[0].name!r} restricts the coordinates; Lagrange's equations of the second kind need "
            "independent ones: choose multipliers",
            number="M120",
        )


@dataclass(frozen=True)
class Energies:
    """The energies, forces and constraints from which equations are derived, in sympy.

    `kinetic` T(q, u); `potential` V(q, t), the weight's and each spring's; `forces` the generalised forces Q (nu) of
    each load that V does not hold; `constraints` phi(q, t) of each row, psi(q, u, t) of a nonholonomic one. In T and V
    masses that vary are `held`: letters, by which nothing is differentiated, with what they stand for. `dissipation`:
    Rayleigh's function D of dampers, where all are linear.
    """

    kinetic: Any
    potential: tuple[Any, ...]
    forces: tuple[tuple[Any, ...], ...]
    constraints: tuple[Any, ...]
    held: Mapping[Any, Any] = field(default_factory=dict)
    dissipation: Any = None


def energies(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> Energies:
    """Return T, V, the virtual work of loads outside V, and the rows' constraints.

    Springs belong to V where stiffness and rest are constant or given in time; all other loads, and the damping of
    every spring, to Q. Quaternions have length one here, which holds wherever the equations do.
    """
    names.budget.enter("the energies")
    parts, known = energy_nodes(mechanism), known_nodes(mechanism, symbols)
    letters = held_letters(mechanism, symbols)
    stood_for = names.translated([held_masses(mechanism)[leaf] for leaf in letters], known)
    held = dict(zip(letters.values(), map(names.name, stood_for), strict=True))
    translated = names.translated([x for part in parts for x in part], {**known, **letters})
    (T,), potential, constraints, *forces = _cut([names.name(e) for e in translated], parts)
    lost = dissipation(motion_of(mechanism, slot_state(mechanism))) if brakes(mechanism) else None
    D = None if lost is None else names.name(names.translated([as_node(lost)], known)[0])
    return Energies(T, tuple(potential), tuple(map(tuple, forces)), tuple(constraints), held, D)


def energy_nodes(mechanism: Mechanism) -> list[list[Node]]:
    """Return as Nodes in slots [T], the parts of V, phi or psi of the rows, and Q (nu) of each load outside V."""
    motion = motion_of(mechanism, slot_state(mechanism))
    stored, working = split(mechanism.loads)
    held = _motion_with_held_masses(mechanism)
    weight = potential_energy(replace(held, mechanism=replace(mechanism, loads=())))
    potential = [weight, *(stored_energy(load, motion) for load in stored)]
    constraints = [row.zero for row in row_motions(motion)]
    forces = [applied_generalized_forces(motion, applied_forces(motion, [load], weight=False)) for load in working]
    return [[as_node(x) for x in part] for part in ([kinetic_energy(held)], potential, constraints, *forces)]


def held_masses(mechanism: Mechanism) -> dict[Node, Node]:
    """Return the leaf of each part of a mass that varies, with what it stands for.

    The body that is left at an instant moves as one of constant mass: T is differentiated with it held, and so is V.
    """
    found: dict[Node, Node] = {}
    for index, body in enumerate(mechanism.bodies):
        if varies(body):
            parts = (body.mass.mass, *body.mass.com, *body.mass.inertia)
            moving = ((k, x) for k, x in enumerate(parts) if x.shadow is None)
            found.update((quantity("held", (str(index), str(k))), x) for k, x in moving)
    return found


def held_letters(mechanism: Mechanism, symbols: Symbols) -> dict[Node, Any]:
    """Return the symbols of the leaves of masses that vary."""
    leaves = held_masses(mechanism)
    return {
        leaf: sympy.Symbol("_".join((symbols.free_prefix, "m", *leaf.data[1])), real=True) for leaf in leaves
    }


def _motion_with_held_masses(mechanism: Mechanism) -> Motion:
    state, held = slot_state(mechanism), held_masses(mechanism)
    if not held:
        return motion_of(mechanism, state)
    by_place = {leaf.data[1]: leaf for leaf in held}
    bodies = []
    for index, body in enumerate(mechanism.bodies):
        parts = (body.mass.mass, *body.mass.com, *body.mass.inertia)
        m, x, y, z, *inertia = (by_place.get((str(index), str(k)), part) for k, part in enumerate(parts))
        bodies.append(replace(body, mass=Mass(m, (x, y, z), tuple(inertia))))
    known = replace(state, slots={**state.slots, **{leaf: leaf for leaf in held}})
    return motion_of(replace(mechanism, bodies=tuple(bodies)), known)


def known_nodes(mechanism: Mechanism, symbols: Symbols) -> dict[Node, Any]:
    """Return the symbol of every slot, and 1 for |q|^2 of every quaternion, built as the kinematics builds it.

    TINY, which keeps derivatives finite where a speed is zero, is zero in closed forms.
    """
    known = {**symbols.slots, as_node(TINY): sympy.S.Zero}
    for body in mechanism.bodies:
        for places in body.quaternions:
            w, x, y, z = (slot("q", k) for k in places)
            known[w * w + x * x + y * y + z * z] = sympy.S.One
    return known


# --- the equations ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LagrangeTerms:
    """The parts of the equations, in sympy, each by speed (nu), as a student writes them one after the other.

    `momenta` dT/du; `mass_matrix` M; `momentum_rates` d/dt dT/du without udot; `turning` the terms of quasi-velocities
    (omega x dT/domega); `kinetic_gradient` N^T dT/dq; `potential_gradient` N^T dV/dq; `forces` Q of loads outside V.
    Together: `velocity_terms` c, the left side without udot and V; `applied` Q - N^T dV/dq.
    """

    momenta: list[Any]
    mass_matrix: list[list[Any]]
    momentum_rates: list[Any]
    turning: list[Any]
    kinetic_gradient: list[Any]
    potential_gradient: list[Any]
    forces: list[Any]
    velocity_terms: list[Any]
    applied: list[Any]


def lagrange_terms(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> LagrangeTerms:
    """Derive the terms of Lagrange's equations."""
    q, u = symbols.coordinates, symbols.speeds
    names.budget.enter("the momenta dT/du and the gradient dT/dq")
    derivatives = names.gradient(given.kinetic, [*u, *q])
    momenta, kinetic = derivatives[: len(u)], derivatives[len(u) :]
    names.budget.enter("the mass matrix, d/dt dT/du")
    upper = [names.tangents(momenta[: k + 1], {u[k]: 1}) for k in range(len(u))]  # columns down to the diagonal
    mass_matrix = [[upper[max(i, j)][min(i, j)] for j in range(len(u))] for i in range(len(u))]
    names.budget.enter("the velocity terms of d/dt dT/du")
    rates = names.tangents(momenta, time_rates(mechanism, symbols, names))
    turned = [names.name(x) for x in turning_terms(mechanism, u, momenta)]
    gradient = project_gradient(mechanism, q, kinetic, names)
    names.budget.enter("the gradient dV/dq")
    pulls = [project_gradient(mechanism, q, names.gradient(part, q), names) for part in given.potential]
    potential, forces = totals(pulls, len(u)), totals(given.forces, len(u))
    return LagrangeTerms(
        momenta,
        mass_matrix,
        rates,
        turned,
        gradient,
        potential,
        forces,
        velocity_terms=[names.sum([a, b, -c]) for a, b, c in zip(rates, turned, gradient, strict=True)],
        applied=[force - pull for force, pull in zip(forces, potential, strict=True)],
    )


def totals(parts: Sequence[Sequence[Any]], size: int) -> list[Any]:
    """Return the sums over all parts, by element (`size`)."""
    return [sympy.Add(*(part[k] for part in parts)) for k in range(size)]


def time_rates(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> dict[Any, Any]:
    """Return the rates of t and q at constant u: the direction of d/dt without accelerations."""
    qdot = [names.sum([rate]) for rate in coordinate_rates(mechanism, symbols.coordinates, symbols.speeds)]
    states = state_rates(mechanism, symbols, names)
    return {symbols.time: 1, **dict(zip(symbols.coordinates, [*qdot[: len(qdot) - len(states)], *states], strict=True))}


def state_rates(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> list[Any]:
    """Return the rates of the declared states, which are the last of q."""
    translated = names.translated(list(mechanism.rates), known_nodes(mechanism, symbols))
    return [names.name(x) for x in translated]


def project_gradient(
    mechanism: Mechanism, q: Sequence[Any], gradient: Sequence[Any], names: Subexpressions
) -> list[Any]:
    """Return N(q)^T g (nu) of a gradient g (nq)."""
    found: list[Any] = []
    for body in mechanism.bodies:
        for k in body.u:
            column = joint_rates(body, q, [int(j == k) for j in range(len(mechanism.speeds))])
            found.append(names.sum(n * gradient[i] for n, i in zip(column, body.q, strict=True)))
    return found


def turning_terms(mechanism: Mechanism, u: Sequence[Any], momenta: Sequence[Any]) -> list[Any]:
    """Return the difference of N^T (d/dt dT/dqdot - dT/dq) and d/dt dT/du - N^T dT/dq: empty where u = qdot."""
    return [
        sympy.S.Zero + term
        for body in mechanism.bodies
        for free in body.free_steps
        for term in turning_momenta(free.step, [u[k] for k in free.u], [momenta[k] for k in free.u])
    ]


# --- what sympy derived, as Nodes ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lowered:
    """Derived equations as lists of Nodes in slots: the rows of M, Q, c (nu each); then (phi, phidot, gamma, H_j)."""

    lists: tuple[tuple[Node, ...], ...]

    def at(self, mechanism: Mechanism, state: State) -> EquationsOfMotion:
        """Return the equations of motion over the state's scalar."""
        n = len(mechanism.speeds)
        motion = motion_of(mechanism, state)
        values = _cut(state.values([x for part in self.lists for x in part]), self.lists)
        rows = [
            replace(row, phi=phi if row.holonomic else None, phidot=phidot, jacobian=jacobian, gamma=gamma)
            if row.kinematic
            else row
            for (phi, phidot, gamma, *jacobian), row in zip(values[n + 2 :], row_motions(motion), strict=True)
        ]
        return equations(motion, values[:n], values[n], values[n + 1], rows)


def _cut(flat: Sequence[Any], like: Sequence[Sequence[Any]]) -> list[list[Any]]:
    values = iter(flat)
    return [[next(values) for _ in part] for part in like]


# --- rows, from phi(q, t) alone by differentiation -------------------------------------------------------------------


@once
def _lower_equations(mechanism: Mechanism) -> Lowered:
    """Derive the equations by symbols that do not depend on any name, and lower them to Nodes."""
    symbols = numbered_symbols(mechanism)
    names = Subexpressions(symbols.free_prefix, Budget())
    given = energies(mechanism, symbols, names)
    terms = lagrange_terms(mechanism, symbols, names, given)
    rows = rows_terms(mechanism, symbols, names, given)
    by_row = [(row.phi or sympy.S.Zero, row.phidot, row.gamma, *row.jacobian) for row in rows]
    lists = [*terms.mass_matrix, terms.applied, terms.velocity_terms, *by_row]
    held, letters = held_masses(mechanism), held_letters(mechanism, symbols)
    leaves_of = {symbol: node for node, symbol in symbols.slots.items()}
    leaves_of |= {letter: held[leaf] for leaf, letter in letters.items()}
    nodes = names.lowered([x for part in lists for x in part], leaves_of)
    return Lowered(tuple(tuple(part) for part in _cut(nodes, lists)))


@dataclass(frozen=True)
class RowTerms:
    """One row in sympy: phi, phidot = H u + phi_t, the row H_j (nu), and gamma = H udot - d/dt phidot.

    A nonholonomic row has no phi (None). What slides `exerts` another force (nu) than H_j^T; a row that defines a force
    has a `coupling` (s) with the multipliers, H_j udot + D_j lambda = gamma_j.
    """

    phi: Any | None
    phidot: Any
    jacobian: list[Any]
    gamma: Any
    exerts: list[Any] | None = None
    coupling: list[Any] | None = None
    beside: tuple[int, ...] = ()

    @property
    def forces(self) -> list[Any]:
        """The generalised force (nu) of a unit multiplier."""
        return self.jacobian if self.exerts is None else self.exerts


def rows_terms(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> list[RowTerms]:
    """Derive all rows: holonomic ones from phi(q, t), others from psi(q, u, t), which is linear in u."""
    names.budget.enter("the constraints' derivatives")
    found = []
    for x, row in zip(given.constraints, mechanism.rows, strict=True):
        if row.is_holonomic:
            *by_coordinate, explicit = names.gradient(x, [*symbols.coordinates, symbols.time])
            jacobian = project_gradient(mechanism, symbols.coordinates, by_coordinate, names)
            phidot = names.sum([h * u for h, u in zip(jacobian, symbols.speeds, strict=True)] + [explicit])
            rate = names.tangents([phidot], time_rates(mechanism, symbols, names))[0]
            found.append(RowTerms(x, phidot, jacobian, -rate))
        else:
            rate = names.tangents([x], time_rates(mechanism, symbols, names))[0]
            found.append(RowTerms(None, x, names.gradient(x, symbols.speeds), -rate))
    return found


def with_friction(terms: Sequence[RowTerms], motion: Motion, symbols: Symbols, names: Subexpressions) -> list[RowTerms]:
    """Return rows with the forces that they exert where these are not H^T lambda, and rows that define forces.

    `motion` is over Nodes: both come from the kinematics.
    """
    rows = row_motions(motion)
    if all(row.exerts is None and row.kinematic for row in rows):
        return list(terms)
    known = known_nodes(motion.mechanism, symbols)

    def written(nodes: Sequence[S]) -> list[Any]:
        return [names.name(x) for x in names.translated([as_node(x) for x in nodes], known)]

    found = []
    for term, row in zip(terms, rows, strict=True):
        changed = term if row.exerts is None else replace(term, exerts=written(row.exerts), beside=row.beside)
        if not row.kinematic:
            gamma, *jacobian = written([row.gamma, *row.jacobian])
            coupling = written([row.coupling.get(k, 0) for k in range(len(rows))])
            changed = replace(changed, gamma=gamma, jacobian=jacobian, coupling=coupling)
        found.append(changed)
    return found
