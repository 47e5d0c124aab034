"""Momenta in place of speeds: which coordinates are cyclic, and what is left of T and V.

In: a mechanism, its symbols, the speeds that momenta replace. Out: the reduction in sympy, found over exact quotients,
whose common factors cancel, and written in book form; past these over Nodes, whose shared parts get names.
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
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Quotient
from multibody_sym.algebra.simplify import Subexpressions, WrittenOut
from multibody_sym.derivation.lagrange import known_nodes
from multibody_sym.derivation.notation import Symbols
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.errors import ExpressionError, ModelError
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy, split
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.state import slot_state
from multibody_sym.mechanics.variable_mass import varies
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative, gradient
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.sympy_bridge import from_sympy, to_sympy
from multibody_sym.scalars.vectors import S, factorize
from multibody_sym.text.printer import text

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
    (rest,) = evaluate([kinetic], lambda leaf: at_rest.get(leaf, leaf))
    matrix = [[as_node(x) for x in row] for row in mass_matrix(motion)]
    return EnergyTerms(matrix, [as_node(x) for x in linear], as_node(rest), as_node(potential_energy(motion)))


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
    groups: list[set[int]] = []
    for i in range(len(free)):
        row = terms.mass_matrix[left.replaced[i]]
        joined = {j for j, k in enumerate(left.replaced) if not row[k].is_zero} | {i}
        groups, apart = [g for g in groups if not g & joined], [g for g in groups if g & joined]
        groups.append(joined.union(*apart))
    found = []
    for group in sorted(map(sorted, groups)):
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
    """Return a record of Nodes in sympy, each scalar by itself."""
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
