"""derive: equations of motion in closed form by all methods, with the steps that lead to them.

In: a System or a Mechanism, and a method. Out: SymbolicEquations, or CanonicalEquations in momenta.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, Literal, TypedDict, Unpack, overload

import sympy

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions, value_of
from multibody_sym.derivation.free_bodies import FreeBodies, force_letters, free_bodies
from multibody_sym.derivation.lagrange import (
    Energies,
    LagrangeTerms,
    RowTerms,
    known_nodes,
    lagrange_terms,
    rows_terms,
    state_rates,
    totals,
    verify_free,
    with_friction,
)
from multibody_sym.derivation.notation import (
    Derivation,
    Equation,
    Notation,
    Step,
    Symbols,
    notation_of,
    rate_label,
    with_free_letters,
)
from multibody_sym.derivation.prepare import (
    SIDES,
    DerivationInput,
    budget_of,
    constants_step,
    coordinate_step,
    energy_steps,
    free_body_steps,
    lagrange_steps,
    map_expressions,
    matrix_step,
    position_steps,
    prepare,
    row_steps,
    shortest,
    tidy_record,
)
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, SymbolicEquations
from multibody_sym.dynamics.formalisms.composite_body import inverse_dynamics, mass_matrix, without_reactions
from multibody_sym.errors import InputError, at, short_repr
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, motion_of, slot_state
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import length
from multibody_sym.scalars.node import as_node
from multibody_sym.scalars.vectors import S
from multibody_sym.stages import doing, stage

IN_MOMENTA: Final = ("hamilton", "routh")
"""Methods whose equations are in momenta."""
RATES: Final = "Rates of the states"
"""The title of the step with the equations of declared states."""
_ELIMINATED: Final = "what remains when the reactions are eliminated"


class Changes(TypedDict, total=False):
    """Changes of a system for one derivation, and its budget."""

    parameters: Mapping[str, Any] | None
    initial: Mapping[str, Any] | None
    inputs: Mapping[str, Any] | None
    coordinates: str | None
    project: bool | None
    budget: Budget | float | None


@overload
def derive(
    model: System | Mechanism,
    method: Literal["hamilton", "routh"],
    *,
    formalism: None = None,
    **changes: Unpack[Changes],
) -> CanonicalEquations: ...


@overload
def derive(
    model: System | Mechanism,
    method: Literal["lagrange", "multipliers", "newton_euler", "composite_body"] | None = None,
    *,
    formalism: str | None = None,
    **changes: Unpack[Changes],
) -> SymbolicEquations: ...


@overload
def derive(
    model: System | Mechanism,
    method: str | None = None,
    *,
    formalism: str | None = None,
    **changes: Unpack[Changes],
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
    `parameters` to `project` change the system for this call. The equations hold for all values and states, so these
    only select which joint of a loop is cut. `budget`: the seconds it may take, 60 by default.
    Short results are written out and simplified; in long ones shared sub-expressions have names. Raises InputError for
    an unknown method, ModelError where a method does not apply, NoSolutionError past the budget.
    """
    changes = Overrides(parameters, initial, inputs, coordinates, project)
    ready, route = prepare(model, changes), formalism if method is None else method
    if not isinstance(route, str) or route not in IN_MOMENTA:
        limits, chosen = budget_of(budget), _method(method, formalism, ready.mechanism)
        with stage("derive"):
            doing(f"derive {ready.mechanism.name} by {chosen}")
            return shortest(ready, limits, lambda names, given: _equations_of_motion(ready, chosen, names, given))
    if formalism is not None and formalism != route:
        raise InputError(_two_routes(method, formalism), number="M120")
    from multibody_sym.derivation.canonical import hamilton, routh, with_first_integrals
    from multibody_sym.derivation.symbolic_equations import with_separation

    make = hamilton if route == "hamilton" else routh
    with stage("derive"):
        doing(f"derive {ready.mechanism.name} by {route}")
        canonical = shortest(ready, budget_of(budget), lambda names, given: make(ready, names, given))
    project = isinstance(model, System) and changes.of(model).simulation.project
    return with_separation(with_first_integrals(canonical, project=project))


def _two_routes(method: object, formalism: object) -> str:
    return f"method {short_repr(method)} and formalism {short_repr(formalism)} are two routes: give one of them"


def _method(method: str | None, formalism: str | None, mechanism: Mechanism) -> str:
    """Return the method's name. Raises InputError, ModelError where it does not apply."""
    if None not in (method, formalism) and method != formalism:
        raise InputError(_two_routes(method, formalism), number="M120")
    word, asked = ("formalism", formalism) if method is None else ("method", method)
    with at(word):
        chosen = ("multipliers" if mechanism.rows else "lagrange") if asked is None else asked
        if not isinstance(chosen, str) or chosen not in METHODS:
            known = isinstance(chosen, str) and chosen in FORMALISMS
            what = f"{chosen!r} gives no closed form" if known else f"there is no {word} {short_repr(chosen)}"
            raise InputError(f"{what}: choose {', '.join((*METHODS, *IN_MOMENTA))}", number="M120")
    if chosen == "lagrange":
        verify_free(mechanism)
    return chosen


# --- the methods -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class EquationParts:
    """The parts of equations of motion, by speed (nu): M, c, dV/dq where it is kept apart, Q of the other loads; rows.

    `rates` are those of the declared states (ns), `terms` those of Lagrange's equations, `bodies` those cut free, where
    the method has them.
    """

    energies: Energies
    mass_matrix: list[list[Any]]
    velocity_terms: list[Any]
    potential_gradient: list[Any]
    forces: list[Any]
    rows: list[RowTerms]
    terms: LagrangeTerms | None = None
    bodies: FreeBodies | None = None
    rates: Sequence[Any] = ()


def _by_multipliers(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> EquationParts:
    terms = lagrange_terms(mechanism, symbols, names, given)
    rows = rows_terms(mechanism, symbols, names, given)
    rows = with_friction(rows, motion_of(mechanism, slot_state(mechanism)), symbols, names)
    parts = terms.mass_matrix, terms.velocity_terms, terms.potential_gradient, terms.forces
    return EquationParts(given, *parts, rows, terms)


def _by_newton_euler(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> EquationParts:
    bodies = free_bodies(mechanism, symbols, names)
    names.budget.enter("the elimination of the reactions")
    motion = motion_of(mechanism, slot_state(mechanism))
    return replace(_from_nodes(motion, *without_reactions(motion), symbols, names, given), bodies=bodies)


def _by_composite_body(mechanism: Mechanism, symbols: Symbols, names: Subexpressions, given: Energies) -> EquationParts:
    names.budget.enter("the composite bodies' equations")
    motion = motion_of(mechanism, slot_state(mechanism))
    velocity_terms = inverse_dynamics(motion, [0] * len(symbols.speeds))
    return _from_nodes(motion, mass_matrix(motion), velocity_terms, symbols, names, given)


def _from_nodes(
    motion: Motion,
    matrix: list[list[S]],
    velocity_terms: list[S],
    symbols: Symbols,
    names: Subexpressions,
    given: Energies,
) -> EquationParts:
    """Return the parts of equations of motion whose M and c are over Nodes."""
    forces = applied_generalized_forces(motion, applied_forces(motion))
    rows = [[row.gap, row.phidot, row.gamma, *row.jacobian] for row in row_motions(motion)]
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
    return EquationParts(given, expressions[:n], expressions[n], [sympy.S.Zero] * n, expressions[n + 1], row_parts)


METHODS: Final[Mapping[str, Callable[[Mechanism, Symbols, Subexpressions, Energies], EquationParts]]] = {
    "lagrange": _by_multipliers,
    "multipliers": _by_multipliers,
    "newton_euler": _by_newton_euler,
    "composite_body": _by_composite_body,
}


# --- put together ----------------------------------------------------------------------------------------------------


def _equations_of_motion(
    ready: DerivationInput, method: str, names: Subexpressions, given: Energies
) -> SymbolicEquations:
    mechanism, symbols, n = ready.mechanism, ready.symbols, len(ready.symbols.speeds)
    own = replace(METHODS[method](mechanism, symbols, names, given), rates=state_rates(mechanism, symbols, names))
    raw = map_expressions(own, lambda e: e.xreplace(given.held))
    written = {name: e.xreplace(given.held) for name, e in names.definitions.items()}
    parts: EquationParts
    definitions, parts = tidy_record(written, raw, symbols.free_prefix)
    M, f, H, gamma, C, D = _matrices(parts, n)
    plain = notation_of(mechanism, symbols, [name for name, _ in definitions], names.numbers, ready.labels)
    notation = plain
    if parts.bodies:  # the forces have the letters of books
        letters = force_letters(mechanism, symbols, {*symbols.multipliers, *parts.bodies.unknown})
        notation = replace(plain, spelling={**plain.spelling, **letters})
    numbers = {symbol: value_of(node) for symbol, node in names.numbers.items()}
    equations = _equations(parts, symbols)
    states = symbols.coordinates[len(symbols.coordinates) - len(parts.rates) :]
    rates = tuple(Equation(rate_label(notation, s), x) for s, x in zip(states, parts.rates, strict=True))
    steps = [
        *_first_steps(ready, names, parts, notation),
        Step("Equations of motion", equations, _ELIMINATED if parts.bodies else ""),
        *((Step(RATES, rates),) if rates else ()),
        matrix_step(M, f, H, gamma, C, D),
    ]
    if parts.bodies:
        equations = (*parts.bodies.equations, *_defined_forces(parts, symbols))
    equations = (*equations, *rates)
    return SymbolicEquations(
        method,
        mechanism,
        symbols,
        kinetic_energy=parts.energies.kinetic,
        potential_energy=sympy.Add(*parts.energies.potential),
        generalized_forces=tuple(totals(parts.energies.forces, n)),
        mass_matrix=M,
        forcing=f,
        constraint_jacobian=H,
        constraint_forcing=gamma,
        constraints=tuple(row.phidot if row.phi is None else row.phi for row in parts.rows),
        equations=equations,
        reactions=parts.bodies.unknown if parts.bodies else (),
        definitions=tuple(definitions),
        numbers=numbers,
        steps=with_free_letters(tuple(steps), mechanism),
        notation=notation,
        constants=ready.constants,
        exerted=C,
        coupling=D,
        beside={k: row.beside for k, row in enumerate(parts.rows) if row.beside},
        dissipation=parts.energies.dissipation,
        state_rates=tuple(parts.rates),
    )


def _matrices(parts: EquationParts, n: int) -> tuple[Any, Any, Any, Any, Any, Any]:
    rows, count = parts.rows, len(parts.rows)
    balance = zip(parts.forces, parts.potential_gradient, parts.velocity_terms, strict=True)
    M = sympy.ImmutableMatrix(n, n, [x for row in parts.mass_matrix for x in row])
    f = sympy.ImmutableMatrix(n, 1, [force - pull - c for force, pull, c in balance])
    H = sympy.ImmutableMatrix(count, n, [x for row in rows for x in row.jacobian])
    gamma = sympy.ImmutableMatrix(count, 1, [row.gamma for row in rows])
    if all(row.exerts is None and row.coupling is None for row in rows):
        return M, f, H, gamma, None, None
    C = sympy.ImmutableMatrix(count, n, [x for row in rows for x in row.forces])
    coupling = [row.coupling or [sympy.S.Zero] * count for row in rows]
    return M, f, H, gamma, C, sympy.ImmutableMatrix(count, count, [x for row in coupling for x in row])


def _first_steps(ready: DerivationInput, names: Subexpressions, parts: EquationParts, notation: Notation) -> Derivation:
    mechanism, symbols, sides = ready.mechanism, ready.symbols, ready.sides
    translated = names.translated([side.length for side in sides], known_nodes(mechanism, symbols))
    lengths = [notation.text(names.name(length)) for length in translated]
    # the sides on which ropes and springs lie, as equations hold only there
    notes = [
        f"{side.element}, {side.ends[0]} to {side.ends[1]}: {length} > 0"
        for side, length in zip(sides, lengths, strict=True)
    ]
    return (
        coordinate_step(mechanism),
        *(() if names.definitions else position_steps(mechanism, symbols, names)),
        *(() if parts.bodies else energy_steps(mechanism, symbols, parts.energies, notation)),
        *(lagrange_steps(mechanism, symbols, notation, parts.terms) if parts.terms else ()),
        *((Step(SIDES, (), "\n".join(notes)),) if notes else ()),
        *constants_step(mechanism, symbols, ready.constants),
        *row_steps(mechanism, parts.rows),
        *(free_body_steps(mechanism, symbols, parts.bodies, parts.rows, notation) if parts.bodies else ()),
    )


def _equations(parts: EquationParts, symbols: Symbols) -> tuple[Equation, ...]:
    """Return each speed's equation: inertia, velocity terms and dV/dq on the left, forces and rows on the right."""
    found = []
    # the factor of each row's force: its multiplier, once the length of multipliers that make a vector
    multipliers = list(symbols.multipliers)
    for k, terms in enumerate(parts.rows):
        if terms.beside and min(terms.beside) > k:
            multipliers[k] = length([multipliers[k], *(multipliers[other] for other in terms.beside)])
        elif terms.beside:
            multipliers[k] = sympy.S.Zero
    for k, row in enumerate(parts.mass_matrix):
        inertia = [m * a for m, a in zip(row, symbols.accelerations, strict=True)]
        left = sympy.Add(*inertia, parts.velocity_terms[k], parts.potential_gradient[k])
        pulls = [row.forces[k] * x for row, x in zip(parts.rows, multipliers, strict=True)]
        found.append(Equation(left, sympy.Add(parts.forces[k], *pulls)))
    return (*found, *_defined_forces(parts, symbols))


def _defined_forces(parts: EquationParts, symbols: Symbols) -> tuple[Equation, ...]:
    """Return the equations of rows that define forces: each force by accelerations, loads and other multipliers."""
    found = []
    for k, row in enumerate(parts.rows):
        if row.coupling is None:
            continue
        inertia = [h * a for h, a in zip(row.jacobian, symbols.accelerations, strict=True)]
        others = [d * x for j, (d, x) in enumerate(zip(row.coupling, symbols.multipliers, strict=True)) if j != k]
        found.append(Equation(-row.coupling[k] * symbols.multipliers[k], sympy.Add(*inertia, *others, -row.gamma)))
    return tuple(found)
