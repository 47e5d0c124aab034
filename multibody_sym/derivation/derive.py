"""derive: equations of motion in closed form by all methods, those in momenta with their first integrals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal, overload

from multibody_sym.algebra.quotients import Budget
from multibody_sym.derivation.derivation import equations_by
from multibody_sym.derivation.prepare import Prepared, budget_of, prepared, shortest
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, SymbolicEquations
from multibody_sym.errors import InputError, shown
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.model.system import System

CANONICAL: Final = ("hamilton", "routh")
"""Methods whose equations are in momenta."""


@overload
def derive(
    model: System | Mechanism,
    method: Literal["hamilton", "routh"],
    *,
    formalism: None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    budget: Budget | float | None = None,
) -> CanonicalEquations: ...


@overload
def derive(
    model: System | Mechanism,
    method: Literal["lagrange", "multipliers", "newton_euler", "composite_body"] | None = None,
    *,
    formalism: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    budget: Budget | float | None = None,
) -> SymbolicEquations: ...


@overload
def derive(
    model: System | Mechanism,
    method: str | None = None,
    *,
    formalism: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    budget: Budget | float | None = None,
) -> SymbolicEquations | CanonicalEquations: ...


def derive(
    model: System | Mechanism,
    method: str | None = None,
    *,
    formalism: str | None = None,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    budget: Budget | float | None = None,
) -> SymbolicEquations | CanonicalEquations:
    """Return the equations of motion in closed form.

    `method` (or `formalism`): "lagrange" (trees whose coordinates are independent), "multipliers" (any), "newton_euler"
    (any, every body cut free, with the reactions), "composite_body" (any, without T and V); by default the first that
    fits. "hamilton" gives p, H(q, p) and the canonical equations (any but with friction, with multipliers where there
    are constraints), "routh" those of the coordinates that are not cyclic, both with their first integrals.
    `parameters` .. `project`: what the call changes of the system (`Overrides`); as the equations hold for all
    values and states, these tell only which joint of a loop is cut. `budget`: the seconds it may take, 60 by default.
    What a person can read is written out and simplified; past that, shared sub-expressions have names. Raises
    InputError for an unknown method, ModelError where a method does not apply, NoSolutionError past the budget.
    """
    changes = Overrides(parameters, initial, inputs, coordinates, project)
    asked = formalism if method is None else method
    if not isinstance(asked, str) or asked not in CANONICAL:
        return equations_by(prepared(model, changes), method, formalism, budget)
    if formalism is not None and formalism != asked:
        raise InputError(
            f"method {asked!r} and formalism {shown(formalism)} are two routes: give one of them", number="M120"
        )
    found = _in_momenta(asked, prepared(model, changes), budget_of(budget))
    from multibody_sym.derivation.first_integrals import with_first_integrals

    return with_first_integrals(found, project=isinstance(model, System) and changes.of(model).simulation.project)


def _in_momenta(method: str, ready: Prepared, limits: Budget) -> CanonicalEquations:
    """Return Hamilton's or Routh's equations, whose modules are imported when they are asked for."""
    if method == "hamilton":
        from multibody_sym.derivation.hamilton import hamilton as make
    else:
        from multibody_sym.derivation.routhian import routh as make
    return shortest(ready, limits, lambda names, given: make(ready, names, given))
