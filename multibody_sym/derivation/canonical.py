"""Equations of motion in momenta, from the same T and V as Lagrange's: Hamilton's and Routh's, with first integrals.

    p = dT/du        H(q, p, t) = p . u - L = (p - b) . M^-1 (p - b)/2 - T0 + V
    q' = N dH/dp     p' = -N^T dH/dq - (what quasi-velocities add) + Q + H^T lambda

Where u = q' they are canonical. Of angular velocities in body axes, p are the momenta along these axes, and the
equations are Poincare's: p' = -N^T dH/dq - omega x p + Q, of a free body Euler's (Lie-Poisson). Rows keep multipliers.

Routh's are Lagrange's, with R = L - sum p_c u_c in the place of L, for the coordinates that are not cyclic:

    d/dt dR/du - dR/dq = Q        p_c constant        u_c = M_cc^-1 (p_c - b_c - M_cs u_s)

Sources: Goldstein, Classical Mechanics, sections 8.1 to 8.3; Poincare (1901).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import Budget, NoClosedFormError
from multibody_sym.algebra.simplify import Subexpressions, WrittenOut, needed_names, value_of
from multibody_sym.derivation.lagrange import (
    Energies,
    RowTerms,
    known_nodes,
    project_gradient,
    rows_terms,
    totals,
    turning_terms,
)
from multibody_sym.derivation.legendre import BookForms, Transformed, cyclic_speeds, momentum_symbols, transform
from multibody_sym.derivation.notation import (
    Equation,
    Label,
    Notation,
    Step,
    Symbols,
    dotted,
    latex_name,
    notation_of,
    upright,
    with_free_letters,
)
from multibody_sym.derivation.prepare import DerivationInput, constants_step, readable, tidy_record
from multibody_sym.derivation.steps import coordinate_step, energy_steps, position_steps
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, FirstIntegral, in_order
from multibody_sym.dynamics.start.start import start
from multibody_sym.dynamics.theorems.conserved import Candidate, Conserved, candidates, find_conserved, freedom_name
from multibody_sym.errors import ExpressionError, ModelError, MultibodyError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import coordinate_rates, motion_of
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import slot_state
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, as_node, slot

_POINCARE: Final = (
    "Momenta of angular velocities in body axes are not canonical; their equations are Poincare's, "
    "p' = -N^T dH/dq - omega x p (Lie-Poisson where nothing depends on the attitude)."
)
_LARGEST: Final = 20_000
"""The denominator up to which a coefficient is taken for a fraction."""

# --- Hamilton's equations --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _HamiltonParts:
    """In sympy p(q, u), u(q, p), H, the rates of q and p without rows, the forces Q, and the rows."""

    by_speeds: list[Any]
    speeds: list[Any]
    function: Any
    qdot: list[Any]
    pdot: list[Any]
    forces: list[Any]
    rows: list[RowTerms]


def hamilton(ready: DerivationInput, names: Subexpressions, given: Energies) -> CanonicalEquations:
    """Return Hamilton's equations of a prepared mechanism.

    Raises ModelError where friction defines forces, or speeds move nothing with mass.
    """
    mechanism, symbols = ready.mechanism, ready.symbols
    name = _row_with_friction(mechanism)
    if name is not None:
        raise ModelError(
            f"{name!r} rubs or slides: its forces follow from reactions and are no part of canonical equations; choose "
            "the method multipliers",
            number="M120",
        )
    momenta = momentum_symbols(mechanism, symbols)
    left = transform(mechanism, symbols, momenta, range(len(momenta)), names)
    raw = _hamilton_parts(mechanism, symbols, momenta, left, names, given)
    definitions, parts, shown = _tidy(names, raw, given, symbols)
    notation = _momentum_notation(ready, definitions, momenta, names)
    rates = [Equation(_rate_label(notation, q), x) for q, x in zip(symbols.coordinates, parts.qdot, strict=True)]
    for k, (p, x) in enumerate(zip(momenta, parts.pdot, strict=True)):
        pulls = (row.jacobian[k] * s for row, s in zip(parts.rows, symbols.multipliers, strict=True))
        rates.append(Equation(_rate_label(notation, p), sympy.Add(x, *pulls)))
    constraints = tuple(row.phidot if row.phi is None else row.phi for row in parts.rows)
    equations = (*rates, *(Equation(x, sympy.S.Zero) for x in constraints if x != 0))
    steps = (
        Step("Canonical momenta", _paired_equations(momenta, parts.by_speeds), "by definition: p = dT/du"),
        Step("Speeds by momenta", _paired_equations(symbols.speeds, parts.speeds)),
        *constants_step(mechanism, symbols, ready.naming.constants),
        Step(
            "Hamilton's function",
            (Equation(Label("H", "H"), parts.function),),
            _meaning_of_function(mechanism, parts, left, symbols, dict(definitions)),
        ),
        Step("Canonical equations", equations, _meaning_of_equations(mechanism, parts)),
    )
    return CanonicalEquations(
        "hamilton",
        **_common_fields(ready, names, shown, definitions, steps, notation),
        momenta=momenta,
        function=parts.function,
        speeds=dict(zip(symbols.speeds, parts.speeds, strict=True)),
        rates=(tuple(parts.qdot), tuple(parts.pdot)),
        constraints=constraints,
        equations=equations,
        energy=None if left.moves else parts.function,
    )


def _hamilton_parts(
    mechanism: Mechanism,
    symbols: Symbols,
    momenta: Sequence[Any],
    left: Transformed,
    names: Subexpressions,
    given: Energies,
) -> _HamiltonParts:
    names.budget.enter("the canonical equations")
    speeds = left.reduction.constant
    by_speeds = names.gradient(given.kinetic, symbols.speeds)
    put = dict(zip(symbols.speeds, speeds, strict=True)) if isinstance(names, WrittenOut) else {}
    forces = [names.name(x.xreplace(put)) for x in totals(given.forces, len(momenta))]
    slopes = project_gradient(mechanism, symbols.coordinates, left.gradient, _Unnamed(names) if put else names)
    turned = turning_terms(mechanism, speeds if put else symbols.speeds, momenta)
    pdot = [sympy.Add(force, -slope, -turn) for force, slope, turn in zip(forces, slopes, turned, strict=True)]
    rates = coordinate_rates(mechanism, symbols.coordinates, speeds if put else symbols.speeds)
    rows = rows_terms(mechanism, symbols, names, given)
    if put:
        rows = [replace(row, phidot=names.name(row.phidot.xreplace(put))) for row in rows]
    qdot = [sympy.S.Zero + x for x in rates]
    return _HamiltonParts(by_speeds, list(speeds), left.reduction.potential, qdot, pdot, forces, rows)


def _rate_label(notation: Notation, symbol: Any) -> Label:
    """Return a quantity's rate: with a prime in text, a dot in LaTeX."""
    return Label(f"{notation.text(symbol)}'", dotted(notation.latex(symbol), "dot"))


def _meaning_of_function(
    mechanism: Mechanism, parts: _HamiltonParts, left: Transformed, symbols: Symbols, definitions: Mapping[Any, Any]
) -> str:
    """Return what H is, and how it changes."""
    what = "H = p u - L is not the energy T + V, as T is not quadratic in the speeds" if left.moves else "H = T + V"
    timed = {symbols.time, *symbols.inputs}
    depends = {}
    for word, expressions in (
        ("function", [parts.function]),
        ("rows", [row.phi for row in parts.rows if row.phi is not None]),
    ):
        rests = [*expressions, *(definitions[s] for s in needed_names(definitions, expressions))]
        depends[word] = any(e.free_symbols & timed for e in rests)
    # constraints of speeds that demand motion at rest
    at_rest = {slot("u", k): ZERO for k in range(len(mechanism.speeds))}
    rows = zip(mechanism.rows, row_motions(motion_of(mechanism, slot_state(mechanism))), strict=True)
    demanded = [as_node(row.phidot) for declared, row in rows if not declared.is_holonomic]
    moved = depends["rows"] or any(x is not ZERO for x in evaluate(demanded, lambda leaf: at_rest.get(leaf, leaf)))
    terms = (
        ("Q u", any(x != 0 for x in parts.forces)),
        ("dH/dt at constant q and p", depends["function"]),
        ("the power of constraints that time moves", moved),
    )
    rates = [word for word, there in terms if there]
    return f"{what}; {'its rate is ' + ' + '.join(rates) if rates else 'it is constant'}"


def _meaning_of_equations(mechanism: Mechanism, parts: _HamiltonParts) -> str:
    lines = ["in general: q' = dH/dp, p' = -dH/dq" + (" + Q" if any(x != 0 for x in parts.forces) else "")]
    if parts.rows:
        lines[0] += " + H^T lambda, with the constraints"
    if any(body.quaternions for body in mechanism.bodies):
        lines.append(_POINCARE)
    return "\n".join(lines)


# --- Routh's equations -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _RouthParts:
    """In sympy p_c(q, u), u_c(q, u_s; p), R, T + V, V_R, and both sides of each kept speed's equation."""

    by_speeds: list[Any]
    speeds: list[Any]
    function: Any
    energy: Any
    potential: Any
    left: list[Any]
    right: list[Any]


def routh(ready: DerivationInput, names: Subexpressions, given: Energies) -> CanonicalEquations:
    """Return Routh's equations of a prepared mechanism; raises ModelError where no coordinate is cyclic."""
    mechanism, symbols = ready.mechanism, ready.symbols
    cyclic = _verified_cyclic_speeds(mechanism)
    every = momentum_symbols(mechanism, symbols)
    momenta = tuple(every[k] for k in cyclic)
    left = transform(mechanism, symbols, momenta, cyclic, names)
    raw = _routh_parts(mechanism, symbols, left, names, given)
    definitions, parts, shown = _tidy(names, raw, given, symbols)
    notation = _momentum_notation(ready, definitions, every, names)
    speeds = dict(zip([symbols.speeds[k] for k in cyclic], parts.speeds, strict=True))
    equations = (*_paired_equations(parts.left, parts.right), *_paired_equations(list(speeds), parts.speeds))
    steps = (
        Step(
            "Canonical momenta",
            _paired_equations(momenta, parts.by_speeds),
            "constant: no energy depends on these coordinates, and no force acts along them",
        ),
        *constants_step(mechanism, symbols, ready.naming.constants),
        Step(
            "Routh's function",
            (Equation(Label("R", "R"), parts.function),),
            "by definition: R = L - p_c u_c, cyclic c",
        ),
        Step(
            "Effective potential",
            (Equation(Label("V_eff", r"V_{\mathrm{eff}}"), parts.potential),),
            "what R holds without speeds, V - T0 + (p - b) M^-1 (p - b)/2; steady motions are where its slope is Q",
        ),
        Step(
            "Reduced equations",
            equations,
            "in general: d/dt dR/du - dR/dq = Q, and what the cyclic coordinates do meanwhile",
        ),
    )
    return CanonicalEquations(
        "routh",
        **_common_fields(ready, names, shown, definitions, steps, notation),
        momenta=momenta,
        function=parts.function,
        speeds=speeds,
        rates=((), ()),
        constraints=(),
        equations=equations,
        energy=None if left.moves else parts.energy,
        effective_potential=parts.potential,
    )


def _verified_cyclic_speeds(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the speeds of cyclic coordinates. Raises ModelError where there are none, with what to do."""
    if mechanism.rows:
        others = "multipliers" if _row_with_friction(mechanism) else "hamilton or multipliers"
        raise ModelError(
            f"{mechanism.rows[0].name!r} restricts the coordinates, and its forces act along them: Routh's equations "
            f"need independent ones; choose {others}",
            number="M120",
        )
    speeds = cyclic_speeds(mechanism)
    if not speeds:
        raise ModelError(
            "no coordinate is cyclic: energies or forces depend on every one, or act along it; choose coordinates of "
            "which one turns or moves all together, or the method hamilton",
            number="M120",
        )
    return speeds


def _routh_parts(
    mechanism: Mechanism, symbols: Symbols, reduced: Transformed, names: Subexpressions, given: Energies
) -> _RouthParts:
    names.budget.enter("the reduced equations")
    left, written_out = reduced.reduction, isinstance(names, WrittenOut)
    kept = [symbols.speeds[k] for k in left.kept]
    half = [
        m * u * v / 2 for row, u in zip(left.mass_matrix, kept, strict=True) for m, v in zip(row, kept, strict=True)
    ]
    kinetic = names.sum([*half, *(g * u for g, u in zip(left.linear, kept, strict=True))])
    momenta = [
        names.sum([*(m * u for m, u in zip(row, kept, strict=True)), g])
        for row, g in zip(left.mass_matrix, left.linear, strict=True)
    ]
    # nothing depends on cyclic coordinates, whose rates are left out
    moving = [u if k in left.kept else sympy.S.Zero for k, u in enumerate(symbols.speeds)]
    qdot = coordinate_rates(mechanism, symbols.coordinates, moving)
    rates = names.tangents(momenta, {symbols.time: 1, **dict(zip(symbols.coordinates, qdot, strict=True))})
    every = [sympy.S.Zero] * len(symbols.speeds)
    for k, p in zip(left.kept, momenta, strict=True):
        every[k] = p
    turned = turning_terms(mechanism, symbols.speeds, every)
    slopes = project_gradient(mechanism, symbols.coordinates, names.gradient(kinetic, symbols.coordinates), names)
    plain = _Unnamed(names) if written_out else names
    pulls = project_gradient(mechanism, symbols.coordinates, reduced.gradient, plain)
    cyclic = left.replaced_speeds(kept)
    put = {symbols.speeds[k]: u for k, u in zip(left.replaced, cyclic, strict=True)} if written_out else {}
    forces = totals(given.forces, len(every))
    equations = []
    for n, k in enumerate(left.kept):
        inertia = [m * symbols.accelerations[j] for m, j in zip(left.mass_matrix[n], left.kept, strict=True)]
        velocity = names.sum([rates[n], turned[k], -slopes[k]])
        equations.append((sympy.Add(*inertia, velocity, pulls[k]), names.name(forces[k].xreplace(put))))
    by_speeds = names.gradient(given.kinetic, [symbols.speeds[k] for k in left.replaced])
    return _RouthParts(
        by_speeds,
        [names.name(x) if not put else x for x in cyclic],
        sympy.Add(kinetic, -left.potential),
        sympy.Add(names.sum(half), left.potential),
        left.potential,
        [balance for balance, _ in equations],
        [force for _, force in equations],
    )


# --- both ------------------------------------------------------------------------------------------------------------


class _Unnamed(Subexpressions):
    """Sums as they are, where books' forms have been found already."""

    def __init__(self, names: Subexpressions) -> None:
        super().__init__("", names.budget)

    def name(self, expression: Any) -> Any:
        """Return the expression itself."""
        return expression


def _row_with_friction(mechanism: Mechanism) -> str | None:
    """Return the name of the first row that exerts other forces than H^T lambda, None where there is none."""
    rows = row_motions(motion_of(mechanism, slot_state(mechanism))) if mechanism.rows else []
    pairs = zip(mechanism.rows, rows, strict=True)
    return next((row.name for row, moved in pairs if moved.exerts is not None or not moved.kinematic), None)


def _tidy(names: Subexpressions, raw: Any, given: Energies, symbols: Symbols) -> tuple[Any, Any, Energies]:
    """Return the definitions that parts and energies rest on, each after those that it names, and both in them."""
    record = raw, replace(given, constraints=(), held={})  # rows have their own terms
    definitions, (parts, shown) = tidy_record(names.definitions, record, symbols.free_prefix)
    return tuple(in_order(dict(definitions))), parts, shown


def _momentum_notation(
    ready: DerivationInput, definitions: Sequence[tuple[Any, Any]], momenta: Sequence[Any], names: Subexpressions
) -> Notation:
    """Return the notation with the momenta's letters: p with the coordinate's."""
    mechanism, symbols = ready.mechanism, ready.symbols
    plain = notation_of(mechanism, symbols, [name for name, _ in definitions], names.numbers, ready.naming.labels)
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    spelling = dict(plain.spelling)
    for k, p in enumerate(momenta):
        of = plain.latex(symbols.coordinates[pairs[k]]) if k in pairs else latex_name(symbols.speeds[k].name)
        spelling[p] = Label(p.name, f"p_{{{of}}}")
    kind = max((place for place, _ in plain.places.values()), default=0)
    places = {**plain.places, **{p: (min(5, kind), 10_000 + k) for k, p in enumerate(momenta)}}
    return replace(plain, spelling=spelling, places=places)


def _paired_equations(left: Sequence[Any], right: Sequence[Any]) -> tuple[Equation, ...]:
    return tuple(Equation(a, b) for a, b in zip(left, right, strict=True))


def _common_fields(
    ready: DerivationInput,
    names: Subexpressions,
    shown: Energies,
    definitions: tuple[tuple[Any, Any], ...],
    steps: Sequence[Step],
    notation: Notation,
) -> dict[str, Any]:
    """Return the fields that both methods fill alike; `steps` follow those of coordinates, positions and energies."""
    mechanism, symbols = ready.mechanism, ready.symbols
    numbers = {symbol: value_of(node) for symbol, node in names.numbers.items()}
    first = (
        coordinate_step(mechanism),
        *(() if definitions else position_steps(mechanism, symbols, names)),
        *energy_steps(mechanism, symbols, shown, notation),
    )
    return {
        "mechanism": mechanism,
        "symbols": symbols,
        "kinetic_energy": shown.kinetic,
        "potential_energy": sympy.Add(*shown.potential),
        "generalized_forces": tuple(totals(shown.forces, len(symbols.speeds))),
        "definitions": definitions,
        "numbers": numbers,
        "constants": ready.naming.constants,
        "steps": with_free_letters((*first, *steps), mechanism),
        "notation": notation,
    }


# --- first integrals: the conserved quantities (`dynamics.theorems.conserved`) as expressions in q and p -------------


def with_first_integrals(equations: CanonicalEquations, *, project: bool = False) -> CanonicalEquations:
    """Return the equations with the quantities that stay constant; none where there is no start to look from."""
    try:
        kept = find_conserved(equations.mechanism, start(equations.mechanism, project=project))
    except MultibodyError:
        return equations
    if not kept:
        return equations
    values = {each.name: each for each in candidates(equations.mechanism)}
    integrals = tuple(FirstIntegral(x.name, _conserved_expression(equations, x, values), x.symmetry) for x in kept)
    shown = [Equation(Label(x.name, upright(x.name)), x.expression) for x in integrals if x.expression is not None]
    note = "\n".join(f"{x.name}: {x.symmetry}" for x in integrals)
    steps = (*equations.steps, Step("First integrals", tuple(shown), note))
    return replace(equations, first_integrals=integrals, steps=steps)


def _conserved_expression(equations: CanonicalEquations, kept: Conserved, values: Mapping[str, Candidate]) -> Any:
    """Return a conserved quantity in coordinates and momenta; None where it adds up along a run, or is too large."""
    parts = [(values[name], c) for name, c in kept.coefficients.items()]
    if any(part.kind == "energy" and part.place for part, _ in parts):
        return None
    total = sympy.S.Zero
    for part, c in parts:
        near = Fraction(c).limit_denominator(_LARGEST)
        is_fraction = abs(float(near) - c) < 1e-12
        factor = sympy.Rational(near.numerator, near.denominator) if is_fraction else sympy.Float(c)
        total += _candidate_expression(equations, part) * factor
    return None if total is sympy.nan else total


def _candidate_expression(equations: CanonicalEquations, part: Candidate) -> Any:
    """Return a candidate in sympy, in momenta; nan where that would be too large."""
    hamilton = equations.method == "hamilton"
    if part.kind == "energy" and equations.energy is not None:
        return equations.energy
    if part.kind == "jacobi" and (hamilton or equations.energy is not None):
        return equations.function if hamilton else equations.energy
    if part.kind == "speed" and hamilton:
        return equations.momenta[part.place]
    if part.kind == "speed":
        momenta = {p.name: p for p in equations.momenta}
        name = f"p_{freedom_name(equations.mechanism, part.place)}"
        if name in momenta:
            return momenta[name]
    return sympy.nan if equations.definitions else _node_in_momenta(equations, part.value)


def _node_in_momenta(equations: CanonicalEquations, node: Node) -> Any:
    """Return a Node in coordinates and momenta, in book form where exact quotients give a shorter one."""
    symbols, mechanism = equations.symbols, equations.mechanism
    simplify = readable(symbols, mechanism)
    names = WrittenOut(symbols.free_prefix, Budget(), simplify)
    (raw,) = names.translated([node], known_nodes(mechanism, symbols))
    found = names.name(raw).xreplace({symbol: value_of(number) for symbol, number in names.numbers.items()})
    found = simplify(found.xreplace(dict(equations.speeds)))
    try:
        if any(body.quaternions for body in mechanism.bodies):
            return found
        forms = BookForms([found])
        written = forms.written(forms.of(found))
    except (NoClosedFormError, ExpressionError):
        return found
    return written if written.count_ops() < found.count_ops() else found
