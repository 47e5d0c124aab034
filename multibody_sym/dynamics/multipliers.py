"""Lagrange's equations with multipliers (of the first kind): any tree with rows, derived with sympy.

    N(q)^T ( d/dt dT/dqdot - dT/dq + dV/dq ) = Q + H^T lambda        H = (dphi/dq) N,   H udot = gamma

The tree's terms come from `lagrange`; H and gamma from phi(q, t) alone, by differentiation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from multibody_sym.dynamics.budget import Budget
from multibody_sym.dynamics.equations import EquationsOfMotion
from multibody_sym.dynamics.lagrange import (
    Lowered,
    derived_once,
    energies,
    lagrange_terms,
    lowered,
    projected,
    time_rates,
)
from multibody_sym.dynamics.subexpressions import Subexpressions
from multibody_sym.dynamics.symbols import Symbols, numbered_symbols
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism import Mechanism


def multipliers(mechanism: Mechanism, state: State) -> EquationsOfMotion:
    """Return the equations of motion at a state, with the rows' multipliers as further unknowns."""
    return derived_once(mechanism, _lowered).at(mechanism, state)


def _lowered(mechanism: Mechanism) -> Lowered:
    symbols = numbered_symbols(mechanism)
    names = Subexpressions(symbols.free_prefix, Budget())
    given = energies(mechanism, symbols, names)
    terms = lagrange_terms(mechanism, symbols, names, given)
    rows = [row_terms(phi, mechanism, symbols, names) for phi in given.constraints]
    return lowered(symbols, names, terms, [(row.phi, row.phidot, row.gamma, *row.jacobian) for row in rows])


@dataclass(frozen=True)
class RowTerms:
    """One row in sympy: phi, phidot = H u + phi_t, the row H_j (nu), and gamma = H udot - d/dt phidot."""

    phi: Any
    phidot: Any
    jacobian: list[Any]
    gamma: Any


def row_terms(phi: Any, mechanism: Mechanism, symbols: Symbols, names: Subexpressions) -> RowTerms:
    """Derive a row from phi(q, t)."""
    names.budget.enter("the constraints' derivatives")
    *by_coordinate, explicit = names.gradient(phi, [*symbols.coordinates, symbols.time])
    jacobian = projected(mechanism, symbols.coordinates, by_coordinate, names)
    phidot = names.sum([h * u for h, u in zip(jacobian, symbols.speeds, strict=True)] + [explicit])
    rate = names.tangents([phidot], time_rates(mechanism, symbols, names))[0]
    return RowTerms(phi, phidot, jacobian, -rate)
