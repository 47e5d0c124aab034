"""derive: equations of motion in closed form, with the steps that lead to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions, tidied, value_of
from multibody_sym.derivation.free_bodies import FreeBodies, free_bodies
from multibody_sym.derivation.lagrange import (
    Energies,
    LagrangeTerms,
    RowTerms,
    known_nodes,
    lagrange_terms,
    pressing,
    rows_terms,
    totals,
    verify_free,
    with_friction,
)
from multibody_sym.derivation.notation import Derivation, Equation, Notation, Step, Symbols, notation_of
from multibody_sym.derivation.prepare import Prepared, Told, budget_of, constants_step, prepared, shortest, sides_step
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.derivation.steps import (
    coordinate_step,
    energy_steps,
    free_body_steps,
    lagrange_steps,
    lettered,
    matrix_step,
    position_steps,
    row_steps,
    with_letters,
)
from multibody_sym.derivation.symbolic_equations import SymbolicEquations
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics, mass_matrix
from multibody_sym.dynamics.formalisms.newton_euler import without_reactions
from multibody_sym.errors import InputError, at, shown
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, motion_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import slot_state
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import S


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
) -> SymbolicEquations:
    """Return the equations of motion in closed form.

    `method` (or `formalism`): "lagrange" (trees whose coordinates are independent), "multipliers" (any), "newton_euler"
    (any, every body cut free, with the reactions), "composite_body" (any, without T and V); by default the first that
    fits. `parameters` .. `project`: what the call changes of the system (`Overrides`); as the equations hold for all
    values and states, these tell only which joint of a loop is cut. `budget`: the seconds it may take, 60 by default.
    What a person can read is written out and simplified; past that, shared sub-expressions have names. Raises
    InputError for an unknown method, ModelError where "lagrange" does not apply, NoSolutionError past the budget.
    """
    ready = prepared(model, Overrides(parameters, initial, inputs, coordinates, project))
    return equations_by(ready, method, formalism, budget)


def equations_by(
    ready: Prepared, method: str | None, formalism: str | None, budget: Budget | float | None
) -> SymbolicEquations:
    """Return the equations of a prepared mechanism by a method; arguments and errors as for `derive`."""
    limits, chosen = budget_of(budget), _method(method, formalism, ready.mechanism)
    return shortest(ready, limits, lambda names, given: _derived(ready, chosen, names, given))


def _method(method: str | None, formalism: str | None, mechanism: Mechanism) -> str:
    """Return the method's name. Raises InputError, ModelError where it does not apply."""
    if None not in (method, formalism) and method != formalism:
        raise InputError(
            f"method {shown(method)} and formalism {shown(formalism)} are two routes: give one of them", number="M120"
        )
    word, asked = ("formalism", formalism) if method is None else ("method", method)
    with at(word):
        chosen = ("multipliers" if mechanism.rows else "lagrange") if asked is None else asked
        if not isinstance(chosen, str) or chosen not in METHODS:
            known = isinstance(chosen, str) and chosen in FORMALISMS
            what = f"{chosen!r} gives no closed form" if known else f"there is no {word} {shown(chosen)}"
            raise InputError(f"{what}: choose {', '.join((*METHODS, *IN_MOMENTA))}", number="M120")
    if chosen == "lagrange":
        verify_free(mechanism)
    return chosen


# --- the methods ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Parts:
    """What a method finds, by speed (nu): M, c, dV/dq where forces are kept apart, Q of the other loads, and the rows.

    `terms` are those of Lagrange's equations, `bodies` those cut free, where the method has them.
    """

    energies: Energies
    mass_matrix: list[list[Any]]
    velocity_terms: list[Any]
    potential_gradient: list[Any]
    forces: list[Any]
    rows: list[RowTerms]
    terms: LagrangeTerms | None = None
    bodies: FreeBodies | None = None


def _by_multipliers(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> Parts:
    terms = lagrange_terms(mechanism, symbols, names, given)
    rows = rows_terms(mechanism, symbols, names, given)
    rows = with_friction(rows, motion_of(mechanism, slot_state(mechanism)), symbols, names)
    parts = terms.mass_matrix, terms.velocity_terms, terms.potential_gradient, terms.forces
    return Parts(given, *parts, rows, terms)


def _by_newton_euler(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> Parts:
    bodies = free_bodies(mechanism, symbols, names)
    names.budget.enter("the elimination of the reactions")
    motion = motion_of(mechanism, slot_state(mechanism))
    return replace(_formed(motion, *without_reactions(motion), symbols, names, given), bodies=bodies)


def _by_composite_body(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> Parts:
    names.budget.enter("the composite bodies' equations")
    motion = motion_of(mechanism, slot_state(mechanism))
    velocity_terms = inverse_dynamics(motion, [0] * len(symbols.speeds))
    return _formed(motion, mass_matrix(motion), velocity_terms, symbols, names, given)


def _formed(
    motion: Motion,
    matrix: list[list[S]],
    velocity_terms: list[S],
    symbols: Symbols,
    names: Subexpressions,
    given: Energies,
) -> Parts:
    """Return the parts of equations of motion whose M and c were found over Nodes."""
    forces = applied_generalized_forces(motion, applied_forces(motion))
    rows = [[row.phi if row.holonomic else 0, row.phidot, row.gamma, *row.jacobian] for row in row_motions(motion)]
    lists = [*matrix, velocity_terms, forces, *rows]
    nodes = [as_node(x) for part in lists for x in part]
    flat = iter(names.translated(nodes, known_nodes(motion.mechanism, symbols)))
    expressions = [[names.name(next(flat)) for _ in part] for part in lists]
    n = len(symbols.speeds)
    row_parts = [
        RowTerms(phi if row.is_holonomic else None, phidot, jacobian, gamma)
        for row, (phi, phidot, gamma, *jacobian) in zip(motion.mechanism.rows, expressions[n + 2 :], strict=True)
    ]
    row_parts = with_friction(row_parts, motion, symbols, names)
    return Parts(given, expressions[:n], expressions[n], [sympy.S.Zero] * n, expressions[n + 1], row_parts)


IN_MOMENTA: Final = ("hamilton", "routh")
"""Further methods, of equations in momenta."""
METHODS: Final[Mapping[str, Callable[[Mechanism, Symbols, Subexpressions, Energies], Parts]]] = {
    "lagrange": _by_multipliers,
    "multipliers": _by_multipliers,
    "newton_euler": _by_newton_euler,
    "composite_body": _by_composite_body,
}


# --- put together --------------------------------------------------------------------------------------------------


def _derived(ready: Prepared, method: str, names: Subexpressions, given: Energies) -> SymbolicEquations:
    mechanism, symbols, told = ready.mechanism, ready.symbols, ready.told
    raw: Parts = _mapped(METHODS[method](mechanism, symbols, names, given), lambda e: e.xreplace(given.held))
    written = {name: e.xreplace(given.held) for name, e in names.definitions.items()}
    definitions, replaced = tidied(written, _expressions(raw), symbols.free_prefix)
    parts: Parts = _mapped(raw, lambda e: e.xreplace(replaced))
    matrices = _matrices(parts, len(symbols.speeds))
    plain = notation_of(mechanism, symbols, [name for name, _ in definitions], names.numbers, told.labels)
    notation = with_letters(plain, mechanism, symbols, parts.bodies)
    return SymbolicEquations(
        method,
        mechanism,
        symbols,
        parts.energies.kinetic,
        sympy.Add(*parts.energies.potential),
        tuple(totals(parts.energies.forces, len(symbols.speeds))),
        *matrices,
        tuple(row.phidot if row.phi is None else row.phi for row in parts.rows),
        (*parts.bodies.equations, *_defined_forces(parts, symbols)) if parts.bodies else _equations(parts, symbols),
        parts.bodies.unknown if parts.bodies else (),
        tuple(definitions),
        {symbol: value_of(node) for symbol, node in names.numbers.items()},
        lettered(_steps(mechanism, symbols, names, parts, matrices, notation, told), mechanism),
        notation,
        told.constants,
        *_friction_matrices(parts, len(symbols.speeds)),
        {k: row.beside for k, row in enumerate(parts.rows) if row.beside},
        parts.energies.dissipation,
    )


def _friction_matrices(parts: Parts, n: int) -> tuple[Any, Any]:
    """Return C and D where multipliers exert other forces than H^T lambda, or define some; else None."""
    if all(row.exerts is None and row.coupling is None for row in parts.rows):
        return None, None
    count = len(parts.rows)
    coupling = [row.coupling or [sympy.S.Zero] * count for row in parts.rows]
    return (
        sympy.ImmutableMatrix(count, n, [x for row in parts.rows for x in row.forces]),
        sympy.ImmutableMatrix(count, count, [x for row in coupling for x in row]),
    )


def _steps(
    mechanism: Mechanism,
    symbols: Symbols,
    names: Subexpressions,
    parts: Parts,
    matrices: Sequence[Any],
    notation: Notation,
    told: Told,
) -> Derivation:
    found = names.translated([side.length for side in told.sides], known_nodes(mechanism, symbols))
    lengths = [notation.text(names.name(length)) for length in found]
    positions = () if names.definitions else position_steps(mechanism, symbols, names)
    terms = lagrange_steps(mechanism, symbols, notation, parts.terms) if parts.terms else ()
    energies = () if parts.bodies else energy_steps(mechanism, symbols, parts.energies, notation)
    bodies = free_body_steps(mechanism, symbols, parts.bodies, parts.rows, notation) if parts.bodies else ()
    exerted, coupling = _friction_matrices(parts, len(symbols.speeds))
    return (
        coordinate_step(mechanism),
        *positions,
        *energies,
        *terms,
        *sides_step(told.sides, lengths),
        *constants_step(mechanism, symbols, told.constants),
        *row_steps(mechanism, parts.rows),
        *bodies,
        Step("Equations of motion", _equations(parts, symbols), _ELIMINATED if bodies else ""),
        matrix_step(*matrices, C=exerted, D=coupling),
    )


_ELIMINATED: Final = "what remains when the reactions are eliminated"


def _equations(parts: Parts, symbols: Symbols) -> tuple[Equation, ...]:
    """Return each speed's equation: inertia, velocity terms and dV/dq on the left, forces and rows on the right."""
    found = []
    for k, row in enumerate(parts.mass_matrix):
        inertia = [m * a for m, a in zip(row, symbols.accelerations, strict=True)]
        left = sympy.Add(*inertia, parts.velocity_terms[k], parts.potential_gradient[k])
        pulls = [row.forces[k] * x for row, x in zip(parts.rows, pressing(parts.rows, symbols), strict=True)]
        found.append(Equation(left, sympy.Add(parts.forces[k], *pulls)))
    return (*found, *_defined_forces(parts, symbols))


def _defined_forces(parts: Parts, symbols: Symbols) -> tuple[Equation, ...]:
    """Return what the rows say that define forces: each by accelerations, loads and other multipliers."""
    found = []
    for k, row in enumerate(parts.rows):
        if row.coupling is None:
            continue
        inertia = [h * a for h, a in zip(row.jacobian, symbols.accelerations, strict=True)]
        others = [d * x for j, (d, x) in enumerate(zip(row.coupling, symbols.multipliers, strict=True)) if j != k]
        found.append(Equation(-row.coupling[k] * symbols.multipliers[k], sympy.Add(*inertia, *others, -row.gamma)))
    return tuple(found)


def _matrices(parts: Parts, n: int) -> tuple[Any, Any, Any, Any]:
    """Return M, f, H and gamma."""
    balance = zip(parts.forces, parts.potential_gradient, parts.velocity_terms, strict=True)
    return (
        sympy.ImmutableMatrix(n, n, [x for row in parts.mass_matrix for x in row]),
        sympy.ImmutableMatrix(n, 1, [force - pull - c for force, pull, c in balance]),
        sympy.ImmutableMatrix(len(parts.rows), n, [x for row in parts.rows for x in row.jacobian]),
        sympy.ImmutableMatrix(len(parts.rows), 1, [row.gamma for row in parts.rows]),
    )


def _expressions(part: Any) -> list[Any]:
    found: list[Any] = []

    def keep(e: Any) -> Any:
        found.append(e)
        return e

    _mapped(part, keep)
    return found


def _mapped(part: Any, change: Callable[[Any], Any]) -> Any:
    """Return a record, list or tuple with every sympy expression in it changed."""
    if isinstance(part, sympy.Basic):
        return change(part)
    if is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{f.name: _mapped(getattr(part, f.name), change) for f in fields(part)})
    return type(part)(_mapped(x, change) for x in part) if type(part) in (list, tuple) else part
