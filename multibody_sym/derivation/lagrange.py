"""Lagrange's equations of the second kind, derived with sympy from T, V and the generalised forces.

    N(q)^T ( d/dt dT/dqdot - dT/dq + dV/dq ) = Q

T and V are the energies of the kinematics; Q is the virtual work of everything that V does not hold. Derivatives are
exact and by the chain rule over named sub-expressions. The result is M udot = Q - c like every other formalism's, with
dV/dq inside Q; it is lowered to Nodes, so that what sympy derived is what is compiled.
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
from multibody_sym.mechanics.forces import TINY, applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism, once
from multibody_sym.mechanics.motion import Motion, coordinate_rates, joint_rates, motion_of, turning_momenta
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions
from multibody_sym.mechanics.state import State, slot_state
from multibody_sym.mechanics.variable_mass import varies
from multibody_sym.model.bodies import Mass
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import length
from multibody_sym.scalars.node import Node, as_node, quantity, slot
from multibody_sym.scalars.vectors import S


def lagrange(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state; raises ModelError where rows restrict the tree."""
    verify_free(mechanism)
    return lowered_tree(mechanism).at(mechanism, state)


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
    """What the equations are derived from, in sympy.

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
    """Return T, V, the virtual work of what V does not hold, and what the rows restrict.

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
    """Return as Nodes in slots [T], the parts of V, what the rows restrict, and Q (nu) of each load outside V."""
    motion = motion_of(mechanism, slot_state(mechanism))
    stored, working = split(mechanism.loads)
    held = _held(mechanism)
    weight = potential_energy(replace(held, mechanism=replace(mechanism, loads=())))
    potential = [weight, *(stored_energy(load, motion) for load in stored)]
    forces = [applied_generalized_forces(motion, applied_forces(motion, [load], weight=False)) for load in working]
    parts = [[kinetic_energy(held)], potential, [_restricted(row) for row in row_motions(motion)], *forces]
    return [[as_node(x) for x in part] for part in parts]


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


def _held(mechanism: Mechanism) -> Motion:
    """Return the motion over Nodes with masses that vary held."""
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


def _restricted(row: RowMotion) -> Any:
    return row.phi if row.holonomic else row.phidot


def known_nodes(mechanism: Mechanism, symbols: Symbols) -> dict[Node, Any]:
    """Return the symbol of every slot, and 1 for |q|^2 of every quaternion, built as the kinematics builds it.

    What keeps derivatives finite where a speed is zero is left out of closed forms.
    """
    known = {**symbols.slots, as_node(TINY): sympy.S.Zero}
    for body in mechanism.bodies:
        for places in body.quaternions:
            w, x, y, z = (slot("q", k) for k in places)
            known[w * w + x * x + y * y + z * z] = sympy.S.One
    return known


# --- the equations -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class LagrangeTerms:
    """The parts of the equations, in sympy, each by speed (nu): what a student writes one after the other.

    `momenta` dT/du; `mass_matrix` M; `momentum_rates` d/dt dT/du without udot; `turning` what quasi-velocities add
    (omega x dT/domega); `kinetic_gradient` N^T dT/dq; `potential_gradient` N^T dV/dq; `forces` Q of loads outside V.
    Together: `velocity_terms` c, what the left side holds without udot and V; `applied` Q - N^T dV/dq.
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
    mass_matrix = _symmetric([names.tangents(momenta[: k + 1], {u[k]: 1}) for k in range(len(u))])
    names.budget.enter("the velocity terms of d/dt dT/du")
    rates = names.tangents(momenta, time_rates(mechanism, symbols, names))
    turned = [names.name(x) for x in turning(mechanism, u, momenta)]
    gradient = projected(mechanism, q, kinetic, names)
    names.budget.enter("the gradient dV/dq")
    pulls = [projected(mechanism, q, names.gradient(part, q), names) for part in given.potential]
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
    """Return the sums over all parts, element by element (`size` of them)."""
    return [sympy.Add(*(part[k] for part in parts)) for k in range(size)]


def time_rates(mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> dict[Any, Any]:
    """Return the rates of t and q at constant u: the direction of d/dt without accelerations."""
    qdot = [names.sum([rate]) for rate in coordinate_rates(mechanism, symbols.coordinates, symbols.speeds)]
    return {symbols.time: 1, **dict(zip(symbols.coordinates, qdot, strict=True))}


def projected(mechanism: Mechanism, q: Sequence[Any], gradient: Sequence[Any], names: Subexpressions) -> list[Any]:
    """Return N(q)^T g (nu) of a gradient g (nq)."""
    found: list[Any] = []
    for body in mechanism.bodies:
        for k in body.u:
            column = joint_rates(body, q, [int(j == k) for j in range(len(mechanism.speeds))])
            found.append(names.sum(n * gradient[i] for n, i in zip(column, body.q, strict=True)))
    return found


def turning(mechanism: Mechanism, u: Sequence[Any], momenta: Sequence[Any]) -> list[Any]:
    """Return what N^T (d/dt dT/dqdot - dT/dq) holds besides d/dt dT/du - N^T dT/dq: nothing where u = qdot."""
    return [
        sympy.S.Zero + term
        for body in mechanism.bodies
        for free in body.free_steps
        for term in turning_momenta(free.step, [u[k] for k in free.u], [momenta[k] for k in free.u])
    ]


def _symmetric(upper: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Return the matrix whose column k down to the diagonal is `upper[k]`."""
    size = len(upper)
    return [[upper[max(i, j)][min(i, j)] for j in range(size)] for i in range(size)]


# --- what sympy derived, as Nodes ----------------------------------------------------------------------------------


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


def lowered(
    mechanism: Mechanism,
    symbols: Symbols,
    names: Subexpressions,
    terms: LagrangeTerms,
    rows: Sequence[Sequence[Any]] = (),
) -> Lowered:
    """Return derived terms, and rows (phi, phidot, gamma, H_j ...), as Nodes."""
    lists = [*terms.mass_matrix, terms.applied, terms.velocity_terms, *rows]
    held, letters = held_masses(mechanism), held_letters(mechanism, symbols)
    leaves_of = {symbol: node for node, symbol in symbols.slots.items()}
    leaves_of |= {letter: held[leaf] for leaf, letter in letters.items()}
    nodes = names.lowered([x for part in lists for x in part], leaves_of)
    return Lowered(tuple(tuple(part) for part in _cut(nodes, lists)))


def _cut(flat: Sequence[Any], like: Sequence[Sequence[Any]]) -> list[list[Any]]:
    """Return one list cut into lists as long as those of `like`."""
    values = iter(flat)
    return [[next(values) for _ in part] for part in like]


@once
def lowered_tree(mechanism: Mechanism) -> Lowered:
    """Return the equations of a mechanism without rows."""
    symbols = numbered_symbols(mechanism)
    names = Subexpressions(symbols.free_prefix, Budget())
    given = energies(mechanism, symbols, names)
    return lowered(mechanism, symbols, names, lagrange_terms(mechanism, symbols, names, given))


# ----------------------------------------------------------------------------------------------------------------------
# Lagrange's equations with multipliers (of the first kind): any tree with rows, derived with sympy.
#
#     N(q)^T ( d/dt dT/dqdot - dT/dq + dV/dq ) = Q + H^T lambda        H = (dphi/dq) N,   H udot = gamma
#
# The tree's terms come from `lagrange`; H and gamma from phi(q, t) alone, by differentiation.


def multipliers(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state, with the rows' multipliers as further unknowns."""
    return _lowered(mechanism).at(mechanism, state)


@once
def _lowered(mechanism: Mechanism) -> Lowered:
    if not mechanism.rows:
        return lowered_tree(mechanism)
    symbols = numbered_symbols(mechanism)
    names = Subexpressions(symbols.free_prefix, Budget())
    given = energies(mechanism, symbols, names)
    terms = lagrange_terms(mechanism, symbols, names, given)
    rows = rows_terms(mechanism, symbols, names, given)
    lists = [(row.phi or sympy.S.Zero, row.phidot, row.gamma, *row.jacobian) for row in rows]
    return lowered(mechanism, symbols, names, terms, lists)


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
    """Derive all rows."""
    names.budget.enter("the constraints' derivatives")
    return [
        _row_terms(x, mechanism, symbols, names) if row.is_holonomic else _velocity_terms(x, mechanism, symbols, names)
        for x, row in zip(given.constraints, mechanism.rows, strict=True)
    ]


def _velocity_terms(psi: Any, mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> RowTerms:
    """Derive a nonholonomic row from psi(q, u, t), which is linear in u."""
    rate = names.tangents([psi], time_rates(mechanism, symbols, names))[0]
    return RowTerms(None, psi, names.gradient(psi, symbols.speeds), -rate)


def _row_terms(phi: Any, mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> RowTerms:
    """Derive a holonomic row from phi(q, t)."""
    *by_coordinate, explicit = names.gradient(phi, [*symbols.coordinates, symbols.time])
    jacobian = projected(mechanism, symbols.coordinates, by_coordinate, names)
    phidot = names.sum([h * u for h, u in zip(jacobian, symbols.speeds, strict=True)] + [explicit])
    rate = names.tangents([phidot], time_rates(mechanism, symbols, names))[0]
    return RowTerms(phi, phidot, jacobian, -rate)


def with_friction(terms: Sequence[RowTerms], motion: Motion, symbols: Symbols, names: Subexpressions) -> list[RowTerms]:
    """Return rows with what they exert where it is not their own force, and those that define forces, from kinematics.

    `motion` is over Nodes.
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


def pressing(rows: Sequence[RowTerms], symbols: Symbols) -> list[Any]:
    """Return what each row exerts its force times: its multiplier, of those that make a vector the length, once."""
    found = list(symbols.multipliers)
    for k, row in enumerate(rows):
        if row.beside and min(row.beside) > k:
            found[k] = length([found[k], *(found[other] for other in row.beside)])
        elif row.beside:
            found[k] = sympy.S.Zero
    return found
