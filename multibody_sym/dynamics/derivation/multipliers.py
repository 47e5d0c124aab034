"""Lagrange's equations with multipliers (of the first kind): any tree with rows, derived with sympy.

    N(q)^T ( d/dt dT/dqdot - dT/dq + dV/dq ) = Q + H^T lambda        H = (dphi/dq) N,   H udot = gamma

The tree's terms come from `lagrange`; H and gamma from phi(q, t) alone, by differentiation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import sympy

from multibody_sym.algebra.budget import Budget
from multibody_sym.algebra.subexpressions import Subexpressions
from multibody_sym.dynamics.derivation.lagrange import (
    Energies,
    Lowered,
    energies,
    known_nodes,
    lagrange_terms,
    lowered,
    lowered_tree,
    projected,
    time_rates,
)
from multibody_sym.dynamics.derivation.symbols import Symbols, numbered_symbols
from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.once import once
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import length
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import S


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
