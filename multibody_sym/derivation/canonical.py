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

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, Final

import sympy

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import exact, register_angles
from multibody_sym.algebra.quotients import PRECISE, Budget, Field, Letter, NoClosedFormError, Quotient
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
from multibody_sym.derivation.notation import (
    Equation,
    Label,
    Notation,
    Step,
    Symbols,
    latex_name,
    notation_of,
    rate_label,
    upright,
    with_free_letters,
)
from multibody_sym.derivation.prepare import (
    DerivationInput,
    constants_step,
    coordinate_step,
    energy_steps,
    position_steps,
    readable,
    tidy_record,
)
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, FirstIntegral, in_order
from multibody_sym.dynamics.conserved import Candidate, Conserved, candidates, find_conserved, freedom_name
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.equations import coupled_groups, massless_speeds
from multibody_sym.dynamics.programs.state_functions import OF_MOMENTA
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import ExpressionError, ModelError, MultibodyError
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy, split
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces, varies
from multibody_sym.mechanics.mechanism import Mechanism, verify_without_states
from multibody_sym.mechanics.motion import coordinate_rates, motion_of, slot_state
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative, gradient
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate, evaluate_float, substitute
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.sympy_bridge import from_sympy, to_sympy
from multibody_sym.scalars.vectors import S, factorize
from multibody_sym.text.printer import text

# ----------------------------------------------------------------------------------------------------------------------
# Momenta in place of speeds: which coordinates are cyclic, and what is left of T and V.
#
# In: a mechanism, its symbols, the speeds that momenta replace. Out: the reduction in sympy, found over exact
# quotients, whose common factors cancel, and written in book form; past these over Nodes, whose shared parts get names.


# --- Routh's reduction: cyclic coordinates leave the equations, and their momenta stay in them as constants ----------
#
#     T = u . M u/2 + b . u + T0        R = L - sum p_c u_c = u_s . M_R u_s/2 + g . u_s - V_R
#     M_R = M_ss - M_sc M_cc^-1 M_cs    g = b_s + M_sc M_cc^-1 (p - b_c)
#     V_R = V - T0 + (p - b_c) . M_cc^-1 (p - b_c)/2
#
# c are the speeds that momenta replace, s those that are kept. Replacing all of them is Legendre's transformation:
# then V_R is Hamilton's function H(q, p). Written once over any scalar: floats, Nodes, sympy, exact quotients.
# Sources: Goldstein, Classical Mechanics, sections 8.1 and 8.3.

_WORK = 20_000
"""How much is done to see that a derivative vanishes, in products of terms."""
_LONGEST = 4_000
"""Operations of a derivative past which only what folds to zero counts as zero."""
_NEARLY_ZERO = 1e-6
"""What rounding leaves of a derivative that vanishes, all letters being of order one."""
_UNDECIDED = frozenset({"abs", "sign", "min", "max", "where", "less", "less_equal", "table"})
"""Operations whose quotient holds on the sample's side only."""
_LEGENDRE_WORK: Final = 60_000
"""How much is done for closed forms, in products of terms: a second or so."""
_PLAIN: Final = frozenset({"neg", "add", "mul", "div", "pow", "sqrt", "sin", "cos", "tan"})
"""Operations that have one quotient whatever the values are."""


@dataclass(frozen=True)
class EnergyTerms:
    """T by powers of the speeds, and V: `mass_matrix` M (n x n), `linear` b (n), `rest` T0, `potential` V."""

    mass_matrix: Sequence[Sequence[S]]
    linear: Sequence[S]
    rest: S
    potential: S


@dataclass(frozen=True)
class Reduction:
    """The terms that are left when momenta p take the place of the speeds `replaced`; `kept` are the others (places).

    `mass_matrix` M_R and `linear` g (over the kept speeds), `potential` V_R(q; p); the replaced speeds are
    `constant` + `coupling` u_s (one row each). R = u_s . M_R u_s/2 + g . u_s - V_R. `quadratic` is the part
    (p - b) . M_cc^-1 (p - b)/2 of V_R.
    """

    kept: tuple[int, ...]
    replaced: tuple[int, ...]
    mass_matrix: list[list[S]]
    linear: list[S]
    potential: S
    quadratic: S
    constant: list[S]
    coupling: list[list[S]]

    def replaced_speeds(self, kept: Sequence[S]) -> list[S]:
        """Return the speeds that momenta replace, given the kept ones."""
        return [
            c + sum((a * u for a, u in zip(row, kept, strict=True)), 0)
            for c, row in zip(self.constant, self.coupling, strict=True)
        ]


def energy_terms(mechanism: Mechanism) -> EnergyTerms:
    """Return T by powers of the speeds, and V, over Nodes in slots; b = 0, T0 = 0 where nothing moves as prescribed."""
    motion = motion_of(mechanism, slot_state(mechanism))
    kinetic = as_node(kinetic_energy(motion))
    speeds = [slot("u", k) for k in range(len(mechanism.speeds))]
    at_rest = dict.fromkeys(speeds, ZERO)
    linear = evaluate(gradient(kinetic, speeds), lambda leaf: at_rest.get(leaf, leaf))
    rest = substitute(kinetic, at_rest)
    matrix = [[as_node(x) for x in row] for row in mass_matrix(motion)]
    return EnergyTerms(matrix, [as_node(x) for x in linear], rest, as_node(potential_energy(motion)))


def reduce_energies(terms: EnergyTerms, replaced: Sequence[int], momenta: Sequence[S]) -> Reduction:
    """Return T and V with `momenta` p in place of the speeds at the places `replaced`."""
    M, b = terms.mass_matrix, terms.linear
    kept = tuple(k for k in range(len(M)) if k not in set(replaced))
    factors = factorize([[M[i][j] for j in replaced] for i in replaced])
    free = [p - b[k] for p, k in zip(momenta, replaced, strict=True)]
    constant = factors.solve(free)
    columns = [factors.solve([M[i][j] for i in replaced]) for j in kept]
    return Reduction(
        kept,
        tuple(replaced),
        [[M[i][j] - _dot([M[i][k] for k in replaced], columns[n]) for n, j in enumerate(kept)] for i in kept],
        [b[i] + _dot([M[i][k] for k in replaced], constant) for i in kept],
        terms.potential - terms.rest + _dot(free, constant) / 2,
        _dot(free, constant) / 2,
        constant,
        [[-columns[n][k] for n in range(len(kept))] for k in range(len(replaced))],
    )


def _dot(a: Sequence[S], b: Sequence[S]) -> S:
    first, *others = [x * y for x, y in zip(a, b, strict=True)] or [0]
    return sum(others, first)


# --- which coordinates are cyclic ------------------------------------------------------------------------------------


def cyclic_speeds(mechanism: Mechanism) -> tuple[int, ...]:
    """Return the places of the speeds whose coordinates are cyclic: no energy depends on them, no force acts along.

    A derivative that does not fold to zero is examined exactly where that is soon done. Where rows restrict the tree
    nothing is cyclic here: their forces act along coordinates; nor where masses vary.
    """
    if mechanism.rows or any(varies(body) for body in mechanism.bodies):
        return ()
    motion = motion_of(mechanism, slot_state(mechanism))
    pairs = sorted((u, q) for body in mechanism.bodies for q, u in body.rate_pairs)
    lagrangian = as_node(kinetic_energy(motion) - potential_energy(motion))
    slopes = gradient(lagrangian, [slot("q", q) for _, q in pairs])
    working = applied_forces(motion, split(mechanism.loads)[1], weight=False)
    forces = [as_node(x) for x in applied_generalized_forces(motion, working)]
    return tuple(
        u for (u, _), slope in zip(pairs, slopes, strict=True) if forces[u] is ZERO and _vanishes(as_node(slope))
    )


def _vanishes(expression: Node) -> bool:
    """Return whether an expression in slots is zero whatever they are, as far as exact quotients tell."""
    if expression.shadow is not None or not expression.args:
        return expression is ZERO
    order = list(postorder([expression]))
    if len(order) > _LONGEST or any(n.op in _UNDECIDED for n in order):
        return False
    field = Field(_WORK)
    known = {}
    for k, leaf in enumerate(leaves([expression], "slot", "quantity")):
        named = symbol(f"x{k}")
        known[leaf] = field.letter(named, Letter(named, PRECISE.mpf(1) / 3 + PRECISE.mpf(k) / 7))
    try:
        register_angles(field, [expression], known)
        return exact(field, [expression], known)[0].is_zero and _vanishes_on_either_side(expression)
    except NoClosedFormError:
        return False


def _vanishes_on_either_side(expression: Node) -> bool:
    """Return whether an expression is nearly zero where coordinates have other signs than in the sample."""
    unknown = leaves([expression], "slot", "quantity")
    for n in range(4):
        given = {
            leaf: (1.0 if leaf.data[0] == "parameters" else (-1.0) ** n) * (0.41 + 0.3 * math.cos(3.0 * k + n))
            for k, leaf in enumerate(unknown)
        }
        try:
            if not abs(evaluate_float([expression], given)[0]) < _NEARLY_ZERO:
                return False
        except (ArithmeticError, ValueError):
            continue
    return True


# --- in sympy --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Transformed:
    """A reduction in sympy: `terms` of the energies, the `reduction`, and dV_R/dq by coordinate (nq).

    `moves`: T has parts that are not quadratic in the speeds, so that H is not the energy.
    """

    terms: EnergyTerms
    reduction: Reduction
    gradient: list[Any]
    moves: bool


def momentum_symbols(mechanism: Mechanism, symbols: Symbols) -> tuple[Any, ...]:
    """Return the symbols of the momenta of all speeds: p_ and the coordinate whose rate the speed is, or the speed."""
    taken = {s.name for s in (*symbols.slots.values(), *symbols.multipliers, *symbols.reactions)}
    pairs = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    found = []
    for k, speed in enumerate(symbols.speeds):
        name = f"p_{symbols.coordinates[pairs[k]].name if k in pairs else speed.name}"
        while name in taken:
            name += "_"
        taken.add(name)
        found.append(sympy.Symbol(name, real=True))
    return tuple(found)


def transform(
    mechanism: Mechanism, symbols: Symbols, momenta: Sequence[Any], replaced: Sequence[int], names: Subexpressions
) -> Transformed:
    """Return the reduction in which momenta (one symbol each) take the place of the speeds `replaced`.

    Raises ModelError where a mass varies, whose rate momenta would hold too, and for speeds that move nothing with
    mass.
    """
    names.budget.enter("the speeds by the momenta")
    for body in mechanism.bodies:
        if varies(body):
            others = "the method multipliers" if mechanism.rows else "the method lagrange or multipliers"
            raise ModelError(
                f"the mass of {body.name!r} varies, so that its momentum changes with it: choose {others}",
                number="M120",
            )
    for k in massless_speeds(mechanism):
        if k in replaced:
            raise ModelError(
                f"the speed {mechanism.speeds[k].name} moves nothing that has mass, so that no momentum determines it; "
                "give what it moves a mass or an inertia, or choose the method multipliers",
                number="M120",
            )
    nodes = energy_terms(mechanism)
    moves = any(x is not ZERO for x in (*nodes.linear, nodes.rest))
    known = known_nodes(mechanism, symbols)
    if isinstance(names, WrittenOut):
        try:
            terms = _in_sympy(nodes, names, known)
            return _in_book_form(terms, symbols, momenta, replaced, names, moves)
        except (NoClosedFormError, ExpressionError):
            pass
    slots = [slot("momenta", k) for k in range(len(momenta))]
    known |= dict(zip(slots, momenta, strict=True))
    terms, left = (_in_sympy(part, names, known) for part in (nodes, reduce_energies(nodes, replaced, slots)))
    return Transformed(terms, left, names.gradient(left.potential, symbols.coordinates), moves)


def _in_book_form(
    terms: EnergyTerms,
    symbols: Symbols,
    momenta: Sequence[Any],
    replaced: Sequence[int],
    names: WrittenOut,
    moves: bool,
) -> Transformed:
    """Return the reduction over quotients, in book form. Raises NoClosedFormError, ExpressionError without one."""
    forms = BookForms([x for row in terms.mass_matrix for x in row] + list(terms.linear), [*momenta, *symbols.speeds])
    exactly = replace(
        terms,
        mass_matrix=[[forms.of(x) for x in row] for row in terms.mass_matrix],
        linear=[forms.of(x) for x in terms.linear],
        rest=forms.field.constant(0),
        potential=forms.field.constant(0),
    )
    p = [forms.of(x) for x in momenta]
    left = reduce_energies(exactly, replaced, p)
    parts = _quadratic_parts(exactly, left, p, forms)
    stored = names.sum([terms.potential, -terms.rest])
    written = _map_scalars(replace(left, potential=forms.zero, quadratic=forms.zero), forms.written)
    total = sympy.Add(*(forms.written(x) for x in parts), stored)
    slopes = names.gradient(stored, symbols.coordinates)
    gradient = [
        sympy.Add(*(forms.slope(x, q) for x in parts), slope)
        for q, slope in zip(symbols.coordinates, slopes, strict=True)
    ]
    return Transformed(terms, replace(written, potential=total, quadratic=total - stored), gradient, moves)


def _quadratic_parts(
    terms: EnergyTerms, left: Reduction, momenta: Sequence[Quotient], forms: BookForms
) -> list[Quotient]:
    """Return (p - b) . M^-1 (p - b)/2 in parts: for each group of speeds that M couples the shorter of two forms.

    One is the whole, the other squares of L^-T (p - b): (p1 - p2 cos(a))^2/(2 A sin(a)^2) + p2^2/(2 C).
    """
    free = [p - terms.linear[k] for p, k in zip(momenta, left.replaced, strict=True)]
    rows = (terms.mass_matrix[k] for k in left.replaced)
    joined = ({j for j, k in enumerate(left.replaced) if not row[k].is_zero} | {i} for i, row in enumerate(rows))
    found = []
    for group in sorted(map(sorted, coupled_groups(joined))):
        whole = [sum((free[k] * left.constant[k] for k in group), forms.zero) / 2]
        M = [[terms.mass_matrix[left.replaced[i]][left.replaced[j]] for j in group] for i in group]
        factors = factorize(M)
        squares = [
            x * x / d / 2 for x, d in zip(factors.from_right([free[k] for k in group]), factors.pivots, strict=True)
        ]
        found += min(whole, squares, key=lambda parts: sum(map(forms.length, parts)))
    return found


class BookForms:
    """Sympy expressions as exact quotients, and these written as books do, with their slopes."""

    def __init__(self, expressions: Sequence[Any], further: Sequence[Any] = ()) -> None:
        self.field = Field(_LEGENDRE_WORK)
        self._names: dict[Node, Any] = {}
        self._known: dict[Node, Quotient] = {}
        free = {s for e in expressions for s in e.free_symbols} | set(further)
        for k, s in enumerate(sorted(free, key=lambda s: s.name)):
            node = symbol(s.name)
            sample = (PRECISE.mpf(2) + PRECISE.sqrt(PRECISE.mpf(k + 2))) / (3 + k % 5)
            self._names[node] = s
            self._known[node] = self.field.letter(node, Letter(node, sample, bool(s.is_positive)))
        nodes = [from_sympy(e) for e in expressions]
        self._positive = [node for node, s in self._names.items() if s.is_positive]
        _verify_plain(nodes, self._positive)
        register_angles(self.field, nodes, self._known)
        self.zero = self.field.constant(0)

    def of(self, expression: Any) -> Quotient:
        """Return an expression as a quotient; raises NoClosedFormError."""
        node = from_sympy(expression)
        _verify_plain([node], self._positive)
        return exact(self.field, [node], self._known)[0]

    def written(self, a: Quotient) -> Any:
        """Return a quotient in its book form; raises NoClosedFormError for one that is too long."""
        return to_sympy(book_form(a), self._names)

    def length(self, a: Quotient) -> int:
        """Return how long the book form of a quotient is, three more than its text."""
        return len(text(book_form(a))) + 3

    def slope(self, a: Quotient, by: Any) -> Any:
        """Return the derivative of a quotient by a symbol in its book form; where that is too long, differentiated."""
        slope = derivative(book_form(a), symbol(by.name))
        if slope is ZERO:
            return sympy.S.Zero
        try:
            return self.written(exact(self.field, [slope], self._known)[0])
        except NoClosedFormError:
            return to_sympy(slope, self._names)


def _verify_plain(nodes: Sequence[Node], positive: Collection[Node]) -> None:
    """Raise NoClosedFormError for what has one quotient on the sample's side only, or none."""
    for n in postorder(nodes):
        root = n.op == "sqrt" or (n.op == "pow" and Fraction(n.args[1].shadow or 0).denominator != 1)
        if n.args and (n.op not in _PLAIN or (root and not set(leaves([n], "symbol")) <= set(positive))):
            raise NoClosedFormError(f"{n.op} has no one quotient")


def _in_sympy(part: Any, names: Subexpressions, known: Mapping[Node, Any]) -> Any:
    found: dict[Node, Any] = {}

    def keep(x: Any) -> Any:
        return found.setdefault(x, x)

    _map_scalars(part, keep)
    translated = names.translated(list(found), known)
    found = {node: names.name(e) for node, e in zip(found, translated, strict=True)}
    return _map_scalars(part, found.__getitem__)


def _map_scalars(part: Any, change: Callable[[Any], Any]) -> Any:
    """Return a record of energies or a reduction with each of its scalars changed."""
    if isinstance(part, EnergyTerms | Reduction):
        places = ("kept", "replaced")
        return replace(part, **{name: _map_scalars(x, change) for name, x in vars(part).items() if name not in places})
    return [_map_scalars(x, change) for x in part] if isinstance(part, list | tuple) else change(part)


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

    Raises ModelError where friction defines forces, states are declared, or speeds move nothing with mass.
    """
    mechanism, symbols = ready.mechanism, ready.symbols
    verify_without_states(mechanism, OF_MOMENTA)
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
    rates = [Equation(rate_label(notation, q), x) for q, x in zip(symbols.coordinates, parts.qdot, strict=True)]
    for k, (p, x) in enumerate(zip(momenta, parts.pdot, strict=True)):
        pulls = (row.jacobian[k] * s for row, s in zip(parts.rows, symbols.multipliers, strict=True))
        rates.append(Equation(rate_label(notation, p), sympy.Add(x, *pulls)))
    constraints = tuple(row.phidot if row.phi is None else row.phi for row in parts.rows)
    equations = (*rates, *(Equation(x, sympy.S.Zero) for x in constraints if x != 0))
    lines = ["in general: q' = dH/dp, p' = -dH/dq" + (" + Q" if any(x != 0 for x in parts.forces) else "")]
    if parts.rows:
        lines[0] += " + H^T lambda, with the constraints"
    if any(body.quaternions for body in mechanism.bodies):
        lines.append(_POINCARE)
    steps = (
        Step("Canonical momenta", _paired_equations(momenta, parts.by_speeds), "by definition: p = dT/du"),
        Step("Speeds by momenta", _paired_equations(symbols.speeds, parts.speeds)),
        *constants_step(mechanism, symbols, ready.constants),
        Step(
            "Hamilton's function",
            (Equation(Label("H", "H"), parts.function),),
            _meaning_of_function(mechanism, parts, left, symbols, dict(definitions)),
        ),
        Step("Canonical equations", equations, "\n".join(lines)),
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
    """Return Routh's equations of a mechanism; raises ModelError where no coordinate is cyclic, or states are declared.
    """
    mechanism, symbols = ready.mechanism, ready.symbols
    verify_without_states(mechanism, OF_MOMENTA)
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
        *constants_step(mechanism, symbols, ready.constants),
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
    mechanism, symbols = ready.mechanism, ready.symbols
    plain = notation_of(mechanism, symbols, [name for name, _ in definitions], names.numbers, ready.labels)
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
        "constants": ready.constants,
        "steps": with_free_letters((*first, *steps), mechanism),
        "notation": notation,
    }


# --- first integrals: the conserved quantities (`dynamics.conserved`) as expressions in q and p ----------------------


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
