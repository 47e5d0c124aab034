"""Expressions as a person would write them: terms merged, sin^2 + cos^2 gone, angles added, like terms grouped.

Works on sums of products and only where they stay small; everything larger is left as it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import combinations, product
from typing import Any, Final

import sympy
from sympy.logic.boolalg import Boolean

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.sums import (
    Monomial,
    Terms,
    add_to,
    expanded_size,
    group_by_denominator,
    is_count,
    is_whole,
    replace_parts,
    terms_of,
    with_exponents,
    with_numbers_outside,
    with_signs,
    with_sizes,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.sympy_bridge import SYMPY_OPERATIONS, from_sympy, to_sympy

LARGEST_SUM: Final = 600
"""Terms that an expression may have when its products are multiplied out; past it nothing is rewritten."""

_REWRITTEN_POWERS: Final = range(2, 7)


@dataclass(frozen=True)
class Readable:
    """Rewrites expressions. `speeds` are grouped last; `circles` are the tuples of symbols whose squares add to one."""

    speeds: frozenset[Any]
    circles: tuple[tuple[Any, ...], ...] = ()
    known: dict[Any, Any] = field(default_factory=dict)

    def __call__(self, expression: Any) -> Any:
        """Return the expression as a person would write it; itself where no term vanishes and it is shorter."""
        if expression not in self.known:
            form = self._rewritten(expression) if expanded_size(expression) <= LARGEST_SUM else expression
            self.known[expression] = self.known[form] = form
        return self.known[expression]

    def _rewritten(self, expression: Any) -> Any:
        inside = replace_parts(
            expression,
            lambda e: is_whole(e) or bool(e.is_Function and e.args[0].is_Add),
            lambda outer: outer.func(*(self(part) for part in outer.args)),
        )
        before = terms_of(inside)
        after = with_sizes(with_angle_sums(self._reduced(with_signs(before))))
        form = group_by_denominator(with_squares(after, self.speeds, inside), self.speeds)
        vanished = len(after) < len(before)
        return with_numbers_outside(inside if not vanished and inside.count_ops() < form.count_ops() else form)

    def _reduced(self, terms: Terms) -> Terms:
        """Return the terms with sin^2 + cos^2 = 1, and each quaternion's squares, used wherever fewer terms remain."""
        angles = {b.args[0]: None for key in terms for b, _ in key if isinstance(b, (sympy.sin, sympy.cos))}
        circles = [(sympy.sin(a), sympy.cos(a)) for a in sorted(angles, key=str)] + list(self.circles)
        for _ in range(len(circles) + 1):
            candidates = [_without_square(terms, c[k], (*c[:k], *c[k + 1 :])) for c in circles for k in range(len(c))]
            best = min(candidates, key=len, default=terms)
            if len(best) >= len(terms):
                break
            terms = best
        return terms


def _without_square(terms: Terms, gone: Any, others: Sequence[Any]) -> Terms:
    """Return the terms with gone^2 = 1 - (sum of the squares of others), in powers that a person would rewrite."""
    result: Terms = {}
    pending = list(terms.items())
    while pending:
        key, factor = pending.pop()
        exponent = dict(key).get(gone, 0)
        if exponent not in _REWRITTEN_POWERS:
            add_to(result, key, factor)
            continue
        pending.append((with_exponents(key, {gone: -2}), factor))
        pending.extend((with_exponents(key, {gone: -2, other: 2}), -factor) for other in others)
    return result


def with_angle_sums(terms: Terms) -> Terms:
    """Return the terms with cos a cos b - sin a sin b = cos(a + b) and its like put together."""
    result = dict(terms)
    while (pair := next(_pairs_of_waves(result), None)) is not None:
        first, second, joined, factor = pair
        del result[first], result[second]
        add_to(result, joined, factor)
    return result


def _pairs_of_waves(terms: Terms) -> Iterator[tuple[Monomial, Monomial, Monomial, Any]]:
    """Yield two terms that make the cosine or sine of a sum or difference, and the term that they make."""
    for key, factor in terms.items():
        cosines = [b.args[0] for b, e in key if isinstance(b, sympy.cos) and is_count(e)]
        sines = [b.args[0] for b, e in key if isinstance(b, sympy.sin) and is_count(e)]
        for a, b in combinations(cosines, 2):
            partner = with_exponents(key, {sympy.cos(a): -1, sympy.cos(b): -1, sympy.sin(a): 1, sympy.sin(b): 1})
            if abs(terms.get(partner, 0)) == abs(factor):
                angle = a + b if terms[partner] == -factor else a - b
                yield key, partner, *_with(key, {sympy.cos(a): -1, sympy.cos(b): -1}, sympy.cos(angle), factor)
        for a, b in product(sines, cosines):
            partner = with_exponents(key, {sympy.sin(a): -1, sympy.cos(b): -1, sympy.cos(a): 1, sympy.sin(b): 1})
            if a != b and abs(terms.get(partner, 0)) == abs(factor):
                angle = a + b if terms[partner] == factor else a - b
                yield key, partner, *_with(key, {sympy.sin(a): -1, sympy.cos(b): -1}, sympy.sin(angle), factor)


def _with(key: Monomial, changes: Mapping[Any, int], function: Any, factor: Any) -> tuple[Monomial, Any]:
    """Return the term with some factors changed and a function put in; sympy turns sin(-x) into -sin x."""
    sign, plain = function.as_coeff_Mul()
    return with_exponents(key, {**changes, plain: 1}), sign * factor


def with_squares(terms: Terms, speeds: frozenset[Any], written: Any = sympy.S.Zero) -> Terms:
    """Return the terms with k x^2 - 2 k x y + k y^2 as k (x - y)^2, and the rest of a larger square beside it.

    x and y are symbols that are no speeds: m (R - r)^2 + 2 m r^2/5 for m R^2 - 2 m R r + 7 m r^2/5. A difference that
    has a power in `written` keeps its sign.
    """
    squared = {b for key in terms for b, e in key if b.is_Symbol and e == 2 and b not in speeds}
    if len(squared) < 2:
        return terms
    result = dict(terms)
    known = {power.base for power in written.atoms(sympy.Pow) if power.base.is_Add}
    for key, factor in terms.items():
        plain = [b for b, e in key if b in squared and e == 1]
        for x, y in combinations(plain, 2):
            squares = [with_exponents(key, {x: 1, y: -1}), with_exponents(key, {x: -1, y: 1})]
            sizes = [result.get(square, sympy.S.Zero) * sympy.sign(result.get(squares[0], 1)) for square in squares]
            if result.get(key) != factor or min(sizes) != abs(factor) / 2:
                continue
            half = abs(factor) / 2 * sympy.sign(result[squares[0]])
            del result[key]
            for square in squares:
                add_to(result, square, -half)
            first, second = (x, y) if sizes[1] >= sizes[0] else (y, x)
            together = first + second * sympy.sign(factor * half)
            together = -together if -together in known else together
            add_to(result, with_exponents(key, {x: -1, y: -1, together: 2}), half)
            break
    return result


# ----------------------------------------------------------------------------------------------------------------------
# Named sub-expressions in sympy, and exact derivatives by the chain rule over the names.
#
# Every shared sub-expression gets a name once and is differentiated once; the derivation never writes names out.
# Numbers that are not simple are symbols too, so that no arithmetic is done with them.


_LARGEST_SIMPLE: Final = 12
_EXACT: Final = ("number", "pi", "neg", "add", "mul", "div", "sin", "cos", "sqrt")
_EXACT_BITS: Final = 48


class Subexpressions:
    """Named sub-expressions in an order of evaluation; their number grows during a derivation.

    `definitions` maps each name to its expression in leaves and earlier names, `numbers` each symbol of a number to the
    number.
    """

    def __init__(self, prefix: str, budget: Budget) -> None:
        self.definitions: dict[sympy.Symbol, Any] = {}
        self.numbers: dict[sympy.Symbol, Node] = {}
        self.budget = budget
        self._prefix = prefix
        self._names: dict[Any, sympy.Symbol] = {}
        self._number_symbols: dict[Node, sympy.Symbol] = {}
        self._partials: dict[sympy.Symbol, dict[sympy.Symbol, Any]] = {}

    # --- from Nodes ------------------------------------------------------------------------------------------------

    def translated(self, nodes: Sequence[Any], known: Mapping[Node, Any]) -> list[Any]:
        """Return Nodes (or plain numbers) as sympy expressions, with names for shared parts.

        `known` holds the expressions of their leaves, and of any Node to be replaced.
        """
        roots = [as_node(node) for node in nodes]
        values: dict[Node, Any] = dict(known)
        order = [n for n in postorder(roots) if n not in known]
        uses = Counter(a for n in order for a in n.args)
        uses.update(n.args[0] for n in order if n.op == "pow")  # a square is a product with itself
        for n in order:
            if n.shadow is not None:  # a constant
                values[n] = self.number(n)
                continue
            value = SYMPY_OPERATIONS[n.op](*n.own, *(values[a] for a in n.args))
            values[n] = self.shared(value) if uses[n] > 1 else value
        return [values[root] for root in roots]

    def number(self, node: Node) -> Any:
        """Return a constant: itself where it is simple, else a symbol that stands for it."""
        if self.is_simple(node):
            return to_sympy(node, {})
        if node.shadow is not None and node.shadow < 0:
            return -self.number(-node)
        if node not in self._number_symbols:
            symbol = sympy.Symbol(f"{self._prefix}_{len(self.numbers) + 1}", positive=True)
            self.numbers[symbol] = node
            self._number_symbols[node] = symbol
        return self._number_symbols[node]

    def is_simple(self, node: Node) -> bool:
        """Return whether a constant may stand in expressions as itself."""
        return node.op == "number" and max(abs(node.data.numerator), node.data.denominator) <= _LARGEST_SIMPLE

    # --- names -----------------------------------------------------------------------------------------------------

    def shared(self, expression: Any) -> Any:
        """Return the name of an expression that several Nodes use."""
        return self.name(expression)

    def name(self, expression: Any) -> Any:
        """Return a name for an expression, or the expression itself where a name would not be shorter."""
        args = expression.args
        is_scaled_name = expression.is_Mul and len(args) == 2 and args[0].is_Number and args[1].is_Symbol
        if not args or is_scaled_name:
            return expression
        name = self._names.get(expression)
        if name is None:
            name = sympy.Symbol(f"{self._prefix}{len(self.definitions) + 1}", real=True)
            self._names[expression] = name
            self.definitions[name] = expression
            self.budget.spend(len(args))
        return name

    def sum(self, terms: Iterable[Any]) -> Any:
        """Return the sum of terms, named."""
        return self.name(sympy.Add(*terms))

    # --- derivatives -----------------------------------------------------------------------------------------------

    def gradient(self, expression: Any, leaves: Sequence[sympy.Symbol]) -> list[Any]:
        """Return the partial derivatives of one expression with respect to each leaf, in one backward pass."""
        known = list(self.definitions)
        weights = {symbol: [part] for symbol, part in partials(expression).items()}
        for symbol in reversed(known):
            if symbol not in weights:
                continue
            weight = self.sum(weights.pop(symbol))
            for operand, partial in self.partials(symbol).items():
                weights.setdefault(operand, []).append(weight * partial)
        return [self.sum(weights.get(leaf, ())) for leaf in leaves]

    def tangents(self, expressions: Sequence[Any], seeds: Mapping[sympy.Symbol, Any]) -> list[Any]:
        """Return the derivatives of expressions along `seeds` (leaf -> its rate), in one forward pass.

        With {q: qdot, t: 1} this is the derivative in time, by the chain rule over the names.
        """
        rates: dict[sympy.Symbol, Any] = {leaf: rate for leaf, rate in seeds.items() if rate != 0}
        for symbol in needed_names(self.definitions, expressions):
            rate = self._rate(self.partials(symbol), rates)
            if rate != 0:
                rates[symbol] = rate
        return [self._rate(partials(e), rates) for e in expressions]

    def _rate(self, parts: Mapping[sympy.Symbol, Any], rates: Mapping[sympy.Symbol, Any]) -> Any:
        return self.sum(partial * rates[operand] for operand, partial in parts.items() if operand in rates)

    def partials(self, symbol: sympy.Symbol) -> dict[sympy.Symbol, Any]:
        """Return the partial derivatives of a name's expression with respect to the symbols it contains."""
        if symbol not in self._partials:
            self._partials[symbol] = partials(self.definitions[symbol])
        return self._partials[symbol]

    # --- back to Nodes ---------------------------------------------------------------------------------------------

    def lowered(self, expressions: Iterable[Any], leaves: Mapping[sympy.Symbol, Node]) -> list[Node]:
        """Return expressions as Nodes: the names become shared sub-expressions, the numbers themselves."""
        roots = list(expressions)
        known: dict[Any, Node] = {**leaves, **self.numbers}
        for symbol in needed_names(self.definitions, roots):
            known[symbol] = from_sympy(self.definitions[symbol], known)
        return [from_sympy(e, known) for e in roots]


def needed_names(definitions: Mapping[sympy.Symbol, Any], expressions: Iterable[Any]) -> list[sympy.Symbol]:
    """Return the names on which expressions depend, in the order of their definitions."""
    names: set[sympy.Symbol] = set()
    stack = [s for e in expressions for s in e.free_symbols if s in definitions]
    while stack:
        symbol = stack.pop()
        if symbol not in names:
            names.add(symbol)
            stack.extend(s for s in definitions[symbol].free_symbols if s in definitions)
    return [symbol for symbol in definitions if symbol in names]


class WrittenOut(Subexpressions):
    """The same derivation for small systems, without names; every result is rewritten as a person would."""

    def __init__(self, prefix: str, budget: Budget, readable: Callable[[Any], Any]) -> None:
        super().__init__(prefix, budget)
        self._readable = readable

    def is_simple(self, node: Node) -> bool:
        """Return whether sympy takes a constant exactly: rationals, multiples of pi, square roots of small numbers."""
        return _is_exact(node)

    def shared(self, expression: Any) -> Any:
        """Return the expression itself."""
        return expression

    def name(self, expression: Any) -> Any:
        """Return the expression, rewritten."""
        self.budget.spend(0)
        return self._readable(expression)


def _is_exact(node: Node) -> bool:
    """Return whether sympy evaluates a constant exactly without effort."""
    return all(
        n.op in _EXACT and (n.op != "number" or n.data.denominator.bit_length() <= _EXACT_BITS)
        for n in postorder([node])
    )


def value_of(number: Node) -> Any:
    """Return a constant in sympy: exactly where that costs nothing, else as a float."""
    return to_sympy(number, {}) if _is_exact(number) else sympy.Float(number.shadow)


def tidy_definitions(
    definitions: Mapping[sympy.Symbol, Any], roots: Sequence[Any], prefix: str
) -> tuple[list[tuple[sympy.Symbol, Any]], dict[sympy.Symbol, Any]]:
    """Return the definitions that roots need, renumbered, without those used once; and the substitute of each name."""
    wanted = needed_names(definitions, roots)
    uses: Counter[sympy.Symbol] = Counter()
    stack = [*dict.fromkeys(roots), *(definitions[name] for name in wanted)]
    while stack:
        e = stack.pop()
        if e.is_Symbol:
            uses[e] += 1
        stack.extend(e.args)
    kept: list[tuple[sympy.Symbol, Any]] = []
    replaced: dict[sympy.Symbol, Any] = {}
    for name in wanted:
        expression = definitions[name].xreplace(replaced)
        if uses[name] > 1:
            replaced[name] = sympy.Symbol(f"{prefix}{len(kept) + 1}", real=True)
            kept.append((replaced[name], expression))
        else:
            replaced[name] = expression
    return kept, replaced


def partials(expression: Any) -> dict[sympy.Symbol, Any]:
    """Return the derivatives of an expression with respect to each symbol it contains.

    Sums, products and powers are taken apart here, as their terms are few and their symbols many; sympy does the rest.
    At a kink (sign, abs, min, max) the derivative is that of either side; conditions have none.
    """
    if expression.is_Symbol:
        return {expression: sympy.S.One}
    if isinstance(expression, Boolean):
        return {}
    if expression.is_Add:
        return _merge_parts(partials(term).items() for term in expression.args)
    if expression.is_Mul:
        pairs = []
        for k, factor in enumerate(expression.args):
            if not factor.is_Number:
                others = sympy.Mul(*expression.args[:k], *expression.args[k + 1 :])
                pairs.append([(s, others * part) for s, part in partials(factor).items()])
        return _merge_parts(pairs)
    if expression.is_Pow and expression.exp.is_Number:
        outer = expression.exp * expression.base ** (expression.exp - 1)
        return {s: outer * part for s, part in partials(expression.base).items()}
    derivatives = {}
    for s in sorted(expression.free_symbols, key=str):
        derivative = expression.diff(s)
        if derivative.has(sympy.DiracDelta, sympy.Heaviside):  # at a kink
            smooth = derivative.replace(sympy.DiracDelta, lambda *_: sympy.S.Zero)
            derivative = smooth.replace(sympy.Heaviside, lambda x, *_: sympy.Piecewise((1, x > 0), (0, True)))
        derivatives[s] = derivative
    return derivatives


def _merge_parts(parts: Iterable[Iterable[tuple[sympy.Symbol, Any]]]) -> dict[sympy.Symbol, Any]:
    terms: dict[sympy.Symbol, list[Any]] = {}
    for pairs in parts:
        for s, part in pairs:
            terms.setdefault(s, []).append(part)
    return {s: own[0] if len(own) == 1 else sympy.Add(*own) for s, own in terms.items()}
