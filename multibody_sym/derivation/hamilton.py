"""Hamilton's canonical equations, from the same T and V as Lagrange's.

    p = dT/du        H(q, p, t) = p . u - L = (p - b) . M^-1 (p - b)/2 - T0 + V
    q' = N dH/dp     p' = -N^T dH/dq - (what quasi-velocities add) + Q + H^T lambda

Where u = q' they are canonical. Of angular velocities in body axes, p are the momenta along these axes, and the
equations are Poincare's: p' = -N^T dH/dq - omega x p + Q, of a free body Euler's (Lie-Poisson). Rows keep multipliers.
Sources: Goldstein, Classical Mechanics, sections 8.1 and 8.2; Poincare (1901).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import is_dataclass, replace
from typing import Any, Final

import sympy

from multibody_sym.algebra.simplify import Subexpressions, WrittenOut, needed, tidied, value_of
from multibody_sym.derivation.lagrange import Energies, RowTerms, projected, rows_terms, totals, turning
from multibody_sym.derivation.legendre import Transformed, momentum_symbols, transformed
from multibody_sym.derivation.notation import Equation, Label, Notation, Step, Symbols, dotted, latex_name, notation_of
from multibody_sym.derivation.prepare import Prepared, constants_step
from multibody_sym.derivation.steps import coordinate_step, energy_steps, lettered, position_steps
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, in_order
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import coordinate_rates, motion_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import slot_state
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, as_node, slot

FUNCTION: Final = "Hamilton's function"
EQUATIONS: Final = "Canonical equations"
MOMENTA: Final = "Canonical momenta"


@dataclass(frozen=True)
class _Found:
    """What is derived, in sympy: p(q, u), u(q, p), H, the rates of q and p without rows, and the rows."""

    by_speeds: list[Any]
    speeds: list[Any]
    function: Any
    qdot: list[Any]
    pdot: list[Any]
    forces: list[Any]
    rows: list[RowTerms]


def hamilton(ready: Prepared, names: Subexpressions, given: Energies) -> CanonicalEquations:
    """Return Hamilton's equations of a prepared mechanism.

    Raises ModelError where friction defines forces, or speeds move nothing with mass.
    """
    mechanism, symbols = ready.mechanism, ready.symbols
    verify_rows(mechanism)
    momenta = momentum_symbols(mechanism, symbols)
    left = transformed(mechanism, symbols, momenta, range(len(momenta)), names)
    found = _found(mechanism, symbols, momenta, left, names, given)
    book, (parts, shown) = named_parts(names, (found, without_rows(given)), symbols)
    notation = momentum_notation(ready, book, momenta, names)
    equations = _equations(mechanism, symbols, momenta, parts, notation)
    return CanonicalEquations(
        "hamilton",
        **common_parts(ready, names, shown, book),
        momenta=momenta,
        function=parts.function,
        speeds=dict(zip(symbols.speeds, parts.speeds, strict=True)),
        rates=(tuple(parts.qdot), tuple(parts.pdot)),
        constraints=tuple(row.phidot if row.phi is None else row.phi for row in parts.rows),
        equations=equations,
        steps=lettered(_steps(ready, names, shown, parts, left, book, momenta, notation, equations), mechanism),
        notation=notation,
        energy=None if left.moves else parts.function,
    )


def common_parts(ready: Prepared, names: Subexpressions, shown: Energies, named: Named) -> dict[str, Any]:
    """Return those fields of equations in momenta that all methods fill alike."""
    return {
        "mechanism": ready.mechanism,
        "symbols": ready.symbols,
        "kinetic_energy": shown.kinetic,
        "potential_energy": sympy.Add(*shown.potential),
        "generalized_forces": tuple(totals(shown.forces, len(ready.symbols.speeds))),
        "definitions": named.definitions,
        "numbers": {symbol: value_of(node) for symbol, node in names.numbers.items()},
        "constants": ready.told.constants,
    }


def verify_rows(mechanism: Mechanism) -> None:
    """Raise ModelError where rows exert other forces than H^T lambda, as what rubs does."""
    name = rubbing(mechanism)
    if name is not None:
        raise ModelError(
            f"{name!r} rubs or slides: its forces follow from reactions and are no part of canonical equations; choose "
            "the method multipliers",
            number="M120",
        )


def rubbing(mechanism: Mechanism) -> str | None:
    """Return the name of the first row that exerts other forces than H^T lambda, None where there is none."""
    rows = row_motions(motion_of(mechanism, slot_state(mechanism))) if mechanism.rows else []
    pairs = zip(mechanism.rows, rows, strict=True)
    return next((row.name for row, moved in pairs if moved.exerts is not None or not moved.kinematic), None)


def _found(
    mechanism: Mechanism,
    symbols: Symbols,
    momenta: Sequence[Any],
    left: Transformed,
    names: Subexpressions,
    given: Energies,
) -> _Found:
    names.budget.enter("the canonical equations")
    speeds = left.reduction.constant
    by_speeds = names.gradient(given.kinetic, symbols.speeds)
    put = dict(zip(symbols.speeds, speeds, strict=True)) if isinstance(names, WrittenOut) else {}
    forces = [names.name(x.xreplace(put)) for x in totals(given.forces, len(momenta))]
    slopes = projected(mechanism, symbols.coordinates, left.gradient, Plain(names) if put else names)
    turned = turning(mechanism, speeds if put else symbols.speeds, momenta)
    pdot = [sympy.Add(force, -slope, -turn) for force, slope, turn in zip(forces, slopes, turned, strict=True)]
    rates = coordinate_rates(mechanism, symbols.coordinates, speeds if put else symbols.speeds)
    rows = [_in_momenta(row, put, names) for row in rows_terms(mechanism, symbols, names, given)]
    return _Found(
        by_speeds, list(speeds), left.reduction.potential, [sympy.S.Zero + x for x in rates], pdot, forces, rows
    )


class Plain(Subexpressions):
    """Sums as they are, where books' forms have been found already."""

    def __init__(self, names: Subexpressions) -> None:
        super().__init__("", names.budget)

    def name(self, expression: Any) -> Any:
        """Return the expression itself."""
        return expression


def _in_momenta(row: RowTerms, put: Mapping[Any, Any], names: Subexpressions) -> RowTerms:
    return replace(row, phidot=names.name(row.phidot.xreplace(put))) if put else row


# --- names -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Named:
    """The definitions that results rest on, numbered anew, and what stands for each former name."""

    definitions: tuple[tuple[Any, Any], ...]
    replaced: Mapping[Any, Any]

    def of(self, expression: Any) -> Any:
        """Return an expression in the new names."""
        return expression.xreplace(self.replaced)

    def names_any(self, expressions: Sequence[Any], wanted: Sequence[Any]) -> bool:
        """Return whether expressions name any of some symbols, or rest on what does."""
        known = dict(self.definitions)
        rests = [*expressions, *(known[s] for s in needed(known, expressions))]
        return any(e.free_symbols & set(wanted) for e in rests)


def named_parts(names: Subexpressions, part: Any, symbols: Symbols) -> tuple[Named, Any]:
    """Return the definitions that a record's expressions need, and the record in them."""
    roots: list[Any] = []

    def keep(e: Any) -> Any:
        roots.append(e)
        return e

    mapped(part, keep)
    definitions, new = tidied(names.definitions, roots, symbols.free_prefix)
    named = Named(tuple(in_order(dict(definitions))), new)
    return named, mapped(part, named.of)


def without_rows(given: Energies) -> Energies:
    """Return the energies without rows, which have their own terms."""
    return replace(given, constraints=(), held={})


def mapped(part: Any, change: Any) -> Any:
    """Return a record, list or tuple with every sympy expression in it changed."""
    if isinstance(part, sympy.Basic):
        return change(part)
    if is_dataclass(part) and not isinstance(part, type):
        return replace(part, **{name: mapped(x, change) for name, x in vars(part).items()})
    return type(part)(mapped(x, change) for x in part) if type(part) in (list, tuple) else part


def momentum_notation(ready: Prepared, named: Named, momenta: Sequence[Any], names: Subexpressions) -> Notation:
    """Return the notation with the momenta's letters: p with the coordinate's."""
    mechanism, symbols = ready.mechanism, ready.symbols
    plain = notation_of(mechanism, symbols, [name for name, _ in named.definitions], names.numbers, ready.told.labels)
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    spelling = dict(plain.spelling)
    for k, p in enumerate(momenta):
        of = plain.latex(symbols.coordinates[pairs[k]]) if k in pairs else latex_name(symbols.speeds[k].name)
        spelling[p] = Label(p.name, f"p_{{{of}}}")
    kind = max((place for place, _ in plain.places.values()), default=0)
    places = {**plain.places, **{p: (min(5, kind), 10_000 + k) for k, p in enumerate(momenta)}}
    return replace(plain, spelling=spelling, places=places)


# --- equations and steps ---------------------------------------------------------------------------------------------


def rate_label(notation: Notation, symbol: Any) -> Label:
    """Return a quantity's rate: with a prime in text, a dot in LaTeX."""
    return Label(f"{notation.text(symbol)}'", dotted(notation.latex(symbol), "dot"))


def _equations(
    mechanism: Mechanism, symbols: Symbols, momenta: Sequence[Any], found: _Found, notation: Notation
) -> tuple[Equation, ...]:
    rates = [Equation(rate_label(notation, q), x) for q, x in zip(symbols.coordinates, found.qdot, strict=True)]
    changes = [
        Equation(
            rate_label(notation, p),
            sympy.Add(x, *(row.jacobian[k] * s for row, s in zip(found.rows, symbols.multipliers, strict=True))),
        )
        for k, (p, x) in enumerate(zip(momenta, found.pdot, strict=True))
    ]
    demands = [row.phidot if row.phi is None else row.phi for row in found.rows]
    return (*rates, *changes, *(Equation(x, sympy.S.Zero) for x in demands if x != 0))


def _steps(
    ready: Prepared,
    names: Subexpressions,
    shown: Energies,
    found: _Found,
    left: Transformed,
    named: Named,
    momenta: Sequence[Any],
    notation: Notation,
    equations: tuple[Equation, ...],
) -> tuple[Step, ...]:
    mechanism, symbols = ready.mechanism, ready.symbols
    note = _meaning_of_function(mechanism, found, left, symbols, named)
    by_speed = [Equation(p, x) for p, x in zip(momenta, found.by_speeds, strict=True)]
    by_momenta = [Equation(u, x) for u, x in zip(symbols.speeds, found.speeds, strict=True)]
    return (
        coordinate_step(mechanism),
        *(() if named.definitions else position_steps(mechanism, symbols, names)),
        *energy_steps(mechanism, symbols, shown, notation),
        Step(MOMENTA, tuple(by_speed), "by definition: p = dT/du"),
        Step("Speeds by momenta", tuple(by_momenta)),
        *constants_step(mechanism, symbols, ready.told.constants),
        Step(FUNCTION, (Equation(Label("H", "H"), found.function),), note),
        Step(EQUATIONS, equations, _meaning_of_equations(mechanism, found)),
    )


def _gives_speeds(mechanism: Mechanism) -> bool:
    """Return whether constraints of speeds demand that something moves."""
    at_rest = {slot("u", k): ZERO for k in range(len(mechanism.speeds))}
    rows = zip(mechanism.rows, row_motions(motion_of(mechanism, slot_state(mechanism))), strict=True)
    given = [as_node(row.phidot) for declared, row in rows if not declared.is_holonomic]
    return any(x is not ZERO for x in evaluate(given, lambda leaf: at_rest.get(leaf, leaf)))


def _meaning_of_function(
    mechanism: Mechanism, found: _Found, left: Transformed, symbols: Symbols, named: Named
) -> str:
    """Return what H is, and how it changes."""
    what = "H = p u - L is not the energy T + V, as T is not quadratic in the speeds" if left.moves else "H = T + V"
    timed = named.names_any([found.function], (symbols.time, *symbols.inputs))
    forced = any(x != 0 for x in found.forces)
    moved = named.names_any([row.phi for row in found.rows if row.phi is not None], (symbols.time, *symbols.inputs))
    moved = moved or _gives_speeds(mechanism)
    whole = ("Q u", forced), ("dH/dt at constant q and p", timed), ("the power of constraints that time moves", moved)
    rates = [word for word, there in whole if there]
    how = "its rate is " + " + ".join(rates) if rates else "it is constant"
    return f"{what}; {how}"


def _meaning_of_equations(mechanism: Mechanism, found: _Found) -> str:
    lines = ["in general: q' = dH/dp, p' = -dH/dq" + (" + Q" if any(x != 0 for x in found.forces) else "")]
    if found.rows:
        lines[0] += " + H^T lambda, with the constraints"
    if any(body.quaternions for body in mechanism.bodies):
        lines.append(_POINCARE)
    return "\n".join(lines)


_POINCARE: Final = (
    "Momenta of angular velocities in body axes are not canonical; their equations are Poincare's, "
    "p' = -N^T dH/dq - omega x p (Lie-Poisson where nothing depends on the attitude)."
)
