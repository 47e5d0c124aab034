"""Named sub-expressions in sympy, and exact derivatives by the chain rule over the names.

Every shared sub-expression is given a name once and differentiated once; what a name stands for is never written out
while deriving. Numbers that are not simple stand as symbols of their own, so that no arithmetic is done with them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import sympy
from sympy.logic.boolalg import Boolean

from multibody_sym.algebra.budget import Budget
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.sympy_bridge import SYMPY_OPERATIONS, from_sympy, to_sympy
from multibody_sym.scalars.traversal import postorder

_LARGEST_SIMPLE: Final = 12
_EXACT: Final = ("number", "pi", "neg", "add", "mul", "div", "sin", "cos", "sqrt")
_EXACT_BITS: Final = 48


class Subexpressions:
    """Names and what they stand for, in an order in which they can be evaluated; grows while something is derived.

    `definitions` maps each name to its expression in leaves and earlier names, `numbers` each symbol that stands for a
    number to that number.
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
        """Return Nodes (or plain numbers) as sympy expressions; what they share is named.

        `known` holds the expressions of their leaves, and of any Node that is to be replaced.
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
            made = sympy.Symbol(f"{self._prefix}_{len(self.numbers) + 1}", positive=True)
            self.numbers[made] = node
            self._number_symbols[node] = made
        return self._number_symbols[node]

    def is_simple(self, node: Node) -> bool:
        """Return whether a constant may stand in expressions as itself."""
        return node.op == "number" and max(abs(node.data.numerator), node.data.denominator) <= _LARGEST_SIMPLE

    # --- names -----------------------------------------------------------------------------------------------------

    def shared(self, expression: Any) -> Any:
        """Return what stands for an expression that is used several times while Nodes are translated."""
        return self.name(expression)

    def name(self, expression: Any) -> Any:
        """Return a name for an expression, or the expression itself where a name would not be shorter."""
        if not expression.args or _is_scaled_name(expression):
            return expression
        made = self._names.get(expression)
        if made is None:
            made = sympy.Symbol(f"{self._prefix}{len(self.definitions) + 1}", real=True)
            self._names[expression] = made
            self.definitions[made] = expression
            self.budget.spend(len(expression.args))
        return made

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
        for symbol in self._needed(expressions):
            rate = self._rate(self.partials(symbol), rates)
            if rate != 0:
                rates[symbol] = rate
        return [self._rate(partials(e), rates) for e in expressions]

    def _rate(self, parts: Mapping[sympy.Symbol, Any], rates: Mapping[sympy.Symbol, Any]) -> Any:
        return self.sum(partial * rates[operand] for operand, partial in parts.items() if operand in rates)

    def partials(self, symbol: sympy.Symbol) -> dict[sympy.Symbol, Any]:
        """Return the partial derivatives of what a name stands for, with respect to the symbols it contains."""
        if symbol not in self._partials:
            self._partials[symbol] = partials(self.definitions[symbol])
        return self._partials[symbol]

    def _needed(self, expressions: Iterable[Any]) -> list[sympy.Symbol]:
        """Return the names that expressions rest on, in order of definition."""
        return needed(self.definitions, expressions)

    # --- back to Nodes ---------------------------------------------------------------------------------------------

    def lowered(self, expressions: Iterable[Any], leaves: Mapping[sympy.Symbol, Node]) -> list[Node]:
        """Return expressions as Nodes: the names become shared sub-expressions, the numbers themselves."""
        roots = list(expressions)
        known: dict[Any, Node] = {**leaves, **self.numbers}
        for symbol in self._needed(roots):
            known[symbol] = from_sympy(self.definitions[symbol], known)
        return [from_sympy(e, known) for e in roots]


def needed(definitions: Mapping[sympy.Symbol, Any], expressions: Iterable[Any]) -> list[sympy.Symbol]:
    """Return the names that expressions rest on, in the order of their definitions."""
    found: set[sympy.Symbol] = set()
    stack = [s for e in expressions for s in e.free_symbols if s in definitions]
    while stack:
        symbol = stack.pop()
        if symbol not in found:
            found.add(symbol)
            stack.extend(s for s in definitions[symbol].free_symbols if s in definitions)
    return [symbol for symbol in definitions if symbol in found]


class WrittenOut(Subexpressions):
    """The same derivation for what stays small: nothing is named, and every result is rewritten as a person would."""

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


def tidied(
    definitions: Mapping[sympy.Symbol, Any], roots: Sequence[Any], prefix: str
) -> tuple[list[tuple[sympy.Symbol, Any]], dict[sympy.Symbol, Any]]:
    """Return the definitions that roots need, numbered anew, without those used once; and what to put for each name."""
    wanted = needed(definitions, roots)
    uses = Counter(s for e in (*dict.fromkeys(roots), *(definitions[name] for name in wanted)) for s in _occurrences(e))
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


def _occurrences(expression: Any) -> Iterator[sympy.Symbol]:
    stack = [expression]
    while stack:
        e = stack.pop()
        if e.is_Symbol:
            yield e
        stack.extend(e.args)


def _is_scaled_name(expression: Any) -> bool:
    if not expression.is_Mul or len(expression.args) != 2:
        return False
    factor, rest = expression.args
    return bool(factor.is_Number and rest.is_Symbol)


def partials(expression: Any) -> dict[sympy.Symbol, Any]:
    """Return the derivatives of an expression with respect to each symbol it contains.

    Sums, products and powers are taken apart here, because their terms are few and their symbols many; all else is
    sympy's. At a kink (sign, abs, min, max) the derivative is that of either side; conditions have none.
    """
    if expression.is_Symbol:
        return {expression: sympy.S.One}
    if isinstance(expression, Boolean):
        return {}
    if expression.is_Add:
        return _merged(partials(term).items() for term in expression.args)
    if expression.is_Mul:
        return _merged(_product_rule(expression.args, k) for k in range(len(expression.args)))
    if expression.is_Pow and expression.exp.is_Number:
        outer = expression.exp * expression.base ** (expression.exp - 1)
        return {s: outer * part for s, part in partials(expression.base).items()}
    return {s: _away_from_kinks(expression.diff(s)) for s in sorted(expression.free_symbols, key=str)}


def _product_rule(factors: Sequence[Any], k: int) -> Iterable[tuple[sympy.Symbol, Any]]:
    if factors[k].is_Number:
        return []
    others = sympy.Mul(*factors[:k], *factors[k + 1 :])
    return [(s, others * part) for s, part in partials(factors[k]).items()]


def _merged(parts: Iterable[Iterable[tuple[sympy.Symbol, Any]]]) -> dict[sympy.Symbol, Any]:
    terms: dict[sympy.Symbol, list[Any]] = {}
    for pairs in parts:
        for s, part in pairs:
            terms.setdefault(s, []).append(part)
    return {s: found[0] if len(found) == 1 else sympy.Add(*found) for s, found in terms.items()}


def _away_from_kinks(derivative: Any) -> Any:
    if not derivative.has(sympy.DiracDelta, sympy.Heaviside):
        return derivative
    smooth = derivative.replace(sympy.DiracDelta, lambda *_: sympy.S.Zero)
    return smooth.replace(sympy.Heaviside, lambda x, *_: sympy.Piecewise((1, x > 0), (0, True)))
