"""Lagrange's equations with multipliers (of the first kind): any tree with rows, derived with sympy.

    N(q)^T ( d/dt dT/dqdot - dT/dq + dV/dq ) = Q + H^T lambda        H = (dphi/dq) N,   H udot = gamma

The tree's terms come from `lagrange`; H and gamma from phi(q, t) alone, by differentiation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy

from multibody_sym.algebra.budget import Budget
from multibody_sym.algebra.subexpressions import Subexpressions
from multibody_sym.dynamics.derivation.lagrange import (
    Energies,
    Lowered,
    derived_once,
    energies,
    lagrange_terms,
    lowered,
    projected,
    time_rates,
)
from multibody_sym.dynamics.derivation.symbols import Symbols, numbered_symbols
from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism


def multipliers(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state, with the rows' multipliers as further unknowns."""
    return derived_once(mechanism, _lowered).at(mechanism, state)


def _lowered(mechanism: Mechanism) -> Lowered:
    symbols = numbered_symbols(mechanism)
    names = Subexpressions(symbols.free_prefix, Budget())
    given = energies(mechanism, symbols, names)
    terms = lagrange_terms(mechanism, symbols, names, given)
    rows = rows_terms(mechanism, symbols, names, given)
    lists = [(row.phi or sympy.S.Zero, row.phidot, row.gamma, *row.jacobian) for row in rows]
    return lowered(symbols, names, terms, lists)


@dataclass(frozen=True)
class RowTerms:
    """One row in sympy: phi, phidot = H u + phi_t, the row H_j (nu), and gamma = H udot - d/dt phidot.

    A nonholonomic row has no phi (None).
    """

    phi: Any | None
    phidot: Any
    jacobian: list[Any]
    gamma: Any


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
