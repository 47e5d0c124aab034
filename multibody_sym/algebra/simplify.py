"""Expressions as a person would write them: terms merged, sin^2 + cos^2 gone, angles added, like terms grouped.

Works on sums of products and only where they stay small; everything larger is left as it is.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from functools import lru_cache
from itertools import combinations, product
from math import comb, gcd
from typing import Any, Final

import sympy
from sympy.logic.boolalg import Boolean

from multibody_sym.algebra.quotients import Budget
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.sympy_bridge import SYMPY_OPERATIONS, from_sympy, to_sympy

# ----------------------------------------------------------------------------------------------------------------------
# Sums of products (sympy) as dictionaries, in which terms are looked up, merged and changed factor by factor.


Monomial = tuple[tuple[Any, Any], ...]
"""A product of powers: (base, exponent) pairs, ordered by the text of the base."""
Terms = dict[Monomial, Any]
"""A sum: the rational factor of each product."""


def expanded_size(expression: Any) -> int:
    """Return a bound of the number of terms of an expression with its products multiplied out."""
    if expression.is_Add:
        return sum(expanded_size(a) for a in expression.args)
    if expression.is_Mul:
        size = 1
        for a in expression.args:
            size *= expanded_size(a)
        return size
    if expression.is_Pow and is_count(expression.exp):
        return comb(expanded_size(expression.base) + int(expression.exp) - 1, int(expression.exp))
    return 1


def terms_of(expression: Any) -> Terms:
    """Return an expression, multiplied out, as terms; sums under roots and in denominators stay whole."""
    letters: dict[Any, Any] = {}

    def hide(e: Any) -> Any:
        return letters.setdefault(e.base, sympy.Symbol(f"sum {len(letters)}", positive=True)) ** e.exp

    hidden = replace_parts(expression, is_whole, hide)
    whole: dict[Any, Any] = {}
    for base, letter in letters.items():
        whole[letter] = base.xreplace(whole)
    terms: Terms = {}
    for term in sympy.Add.make_args(sympy.expand(hidden, power_base=False, power_exp=False, log=False)):
        factor, product = term.as_coeff_Mul()
        powers = dict(part.as_base_exp() for part in sympy.Mul.make_args(product) if part != 1)
        add_to(terms, monomial({base.xreplace(whole): exponent for base, exponent in powers.items()}), factor)
    return terms


def replace_parts(expression: Any, wanted: Callable[[Any], bool], made: Callable[[Any], Any]) -> Any:
    """Return an expression with made(part) for each wanted part, from the innermost on."""
    pending = [expression]
    while pending:  # most expressions have no such part, and this takes a fraction of the time of sympy's `replace`
        part = pending.pop()
        if wanted(part):
            return expression.replace(wanted, made)
        pending.extend(part.args)
    return expression


def is_whole(e: Any) -> bool:
    """Return whether an expression is a sum under a root or in a denominator, which is not multiplied out."""
    return bool(e.is_Pow and e.base.is_Add and not is_count(e.exp))


def expression_of(terms: Mapping[Monomial, Any]) -> Any:
    return sympy.Add(*(factor * product_of(key) for key, factor in terms.items()))


def product_of(key: Monomial) -> Any:
    return sympy.Mul(*(base**exponent for base, exponent in key))


def monomial(powers: Mapping[Any, Any]) -> Monomial:
    return tuple(sorted(((b, e) for b, e in powers.items() if e != 0), key=lambda power: _text(power[0])))


_text = lru_cache(maxsize=10_000)(str)


def with_exponents(key: Monomial, changes: Mapping[Any, int]) -> Monomial:
    """Return a product with the exponents of some factors changed."""
    powers = dict(key)
    for base, change in changes.items():
        powers[base] = powers.get(base, sympy.S.Zero) + change
    return monomial(powers)


def add_to(terms: Terms, key: Monomial, factor: Any) -> None:
    """Add a term to a sum; terms with the factor 0 are removed."""
    total = terms.get(key, sympy.S.Zero) + factor
    if total == 0:
        terms.pop(key, None)
    else:
        terms[key] = total


def is_count(exponent: Any) -> bool:
    """Return whether an exponent is a whole number above 0."""
    return bool(exponent.is_Integer and exponent > 0)


# ----------------------------------------------------------------------------------------------------------------------
# Absolute values and signs in sums of products, and the whole numbers that a factor's terms share.


def with_signs(terms: Terms) -> Terms:
    """Return the terms with |x| written as x sign(x), so that x^2 / |x| and |x| are one; sign(x)^2 is 1 beside an x."""
    if not _has(terms, sympy.Abs, sympy.sign):
        return terms
    result: Terms = {}
    for key, factor in terms.items():
        powers = dict(key)
        for x in {base.args[0] for base in powers if isinstance(base, (sympy.Abs, sympy.sign))}:
            size, sign = sympy.Abs(x), sympy.sign(x)
            plain, sizes, signs = exponents = [powers.get(base, sympy.S.Zero) for base in (x, size, sign)]
            alone = plain == sizes == 0  # sign(x)^2 is not 1 where x is 0
            if all(e.is_Integer for e in exponents) and not alone:
                powers |= {x: plain + sizes, size: sympy.S.Zero, sign: (sizes + signs) % 2}
        add_to(result, monomial(powers), factor)
    return result


def with_sizes(terms: Terms) -> Terms:
    """Return the terms with x sign(x) written as |x|, and sign(x) / x as 1 / |x|."""
    if not _has(terms, sympy.sign):
        return terms
    result: Terms = {}
    for key, factor in terms.items():
        powers = dict(key)
        for sign in [base for base, exponent in key if isinstance(base, sympy.sign) and exponent == 1]:
            (x,) = sign.args
            exponent = powers.get(x, sympy.S.Zero)
            if exponent.is_Integer and exponent != 0:
                outer = sympy.sign(exponent)
                powers |= {x: exponent - outer, sympy.Abs(x): outer, sign: sympy.S.Zero}
        add_to(result, monomial(powers), factor)
    return result


def _has(terms: Terms, *functions: Any) -> bool:
    return any(isinstance(base, functions) for key in terms for base, _ in key)


def with_numbers_outside(expression: Any) -> Any:
    """Return an expression with the whole numbers that the terms of a factor share before it: 4 (a - b)^2, 2 |a|."""
    return replace_parts(expression, _shares_number, _number_outside)


def _shares_number(e: Any) -> bool:
    return any(part.is_Add and _shared_number(part) != 1 for part in _factors_of(e))


def _factors_of(e: Any) -> tuple[Any, ...]:
    """Return the parts of a product, power or absolute value before which a number may be written."""
    is_power = e.is_Pow and e.exp.is_Integer
    return e.args if e.is_Mul else (e.args[0],) if is_power or isinstance(e, sympy.Abs) else ()


def _shared_number(total: Any) -> Any:
    number = total.primitive()[0]
    return number if number.is_Integer else sympy.S.One


def _number_outside(e: Any) -> Any:
    factor, parts = sympy.S.One, []
    for part in _factors_of(e):
        shared = _shared_number(part) if part.is_Add else sympy.S.One
        factor *= shared
        parts.append(part if shared == 1 else sympy.Add(*(x / shared for x in part.args)))
    inner = sympy.Mul(*parts) if e.is_Mul else e.func(parts[0], *e.args[1:])
    return (factor**e.exp if e.is_Pow else factor) * inner


# ----------------------------------------------------------------------------------------------------------------------
# Sums of products as one expression: terms that share a denominator, a factor or a number stand together.


_LARGEST_DENOMINATOR: Final = 12
_LONGEST_NUMBER: Final = 512
"""Bits of a number with which polynomials are still factorised; products of ten ordinary doubles have them."""
_LONGEST_NUMERATOR: Final = 12


def group_by_denominator(terms: Terms, speeds: frozenset[Any]) -> Any:
    """Return terms as one expression: those over one denominator together, factorised where that is shorter."""
    by_denominator: dict[Monomial, Terms] = {}
    for key, factor in terms.items():
        below = tuple(pair for pair in key if _is_quotient(pair))
        above = tuple(pair for pair in key if not _is_quotient(pair))
        by_denominator.setdefault(below, {})[above] = factor
    quotients = []
    for below, numerator in by_denominator.items():
        if not below or not 1 < len(numerator) <= _LONGEST_NUMERATOR:
            quotients.append(with_like_terms(numerator, speeds) * product_of(below))
            continue
        sign = -1 if all(factor < 0 for factor in numerator.values()) else 1
        positive = {key: sign * factor for key, factor in numerator.items()}
        plain, factorized = with_like_terms(positive, speeds), _product_of_factors(expression_of(positive))
        shorter = factorized if factorized.count_ops() < plain.count_ops() else plain
        quotients.append(sympy.Mul(sign, shorter, product_of(below)))
    return sympy.Add(*quotients)


def _is_quotient(power: tuple[Any, Any]) -> bool:
    base, exponent = power
    return bool(base.is_Add and exponent.is_negative)


def with_like_terms(terms: Terms, speeds: frozenset[Any]) -> Any:
    """Return terms as one expression: products of speeds that share a factor together, then sums of like parameters."""
    by_factor: dict[Monomial, Terms] = {}
    for key, factor in terms.items():
        still = tuple(pair for pair in key if pair[0] not in speeds)
        by_factor.setdefault(still, {})[tuple(pair for pair in key if pair[0] in speeds)] = factor
    by_motion: dict[Any, Terms] = {}
    for still, moving in by_factor.items():
        content, primitive = _factorize(expression_of(moving))
        by_motion.setdefault(primitive, {})[still] = content
    parts = []
    for motion, rests in by_motion.items():
        # before a sum: a minus sign, or the denominator that all terms share
        denominator = gcd(*(factor.q for factor in rests.values()))
        sign = -1 if all(factor < 0 for factor in rests.values()) else 1
        common = sympy.Rational(sign, denominator if denominator <= _LARGEST_DENOMINATOR else 1)
        parts.append(sympy.Mul(common, _with_sums({key: factor / common for key, factor in rests.items()}), motion))
    return sympy.Add(*parts)


@lru_cache(maxsize=1000)
def _factorize(whole: Any) -> tuple[Any, Any]:
    """Return a polynomial in speeds as a number and a factorised polynomial."""
    number, polynomial = (_product_of_factors(whole) if whole.is_Add else whole).as_coeff_Mul()
    return number, polynomial


def _product_of_factors(whole: Any) -> Any:
    """Return an expression factorised; itself where its numbers are so long that sympy looks for a longer prime.

    A root is one letter, as sympy splits it, sqrt(2*R*h - h^2) into sqrt(h)*sqrt(2*R - h), and may search for long.
    """
    longest = max((max(abs(x.p), x.q) for x in whole.atoms(sympy.Rational)), default=1)
    if longest.bit_length() > _LONGEST_NUMBER:
        return whole
    powers = sorted(whole.atoms(sympy.Pow), key=sympy.default_sort_key)
    roots = {power: sympy.Dummy(f"root_{k}") for k, power in enumerate(powers) if not power.exp.is_Integer}
    if not roots:
        return sympy.factor(whole)
    number, factors = sympy.factor(whole.xreplace(roots)).as_coeff_Mul()
    written = factors.xreplace({letter: root for root, letter in roots.items()})
    return number * written if number == 1 or not written.is_Add else sympy.Mul(number, written, evaluate=False)


def _with_sums(terms: Terms) -> Any:
    """Return the sum of terms with k m1 r + k m2 r written k (m1 + m2) r, the largest group first."""
    remaining, parts = dict(terms), list[Any]()
    while True:
        groups: dict[tuple[Monomial, Any], list[tuple[Monomial, Any]]] = {}
        for key, factor in remaining.items():
            for base, exponent in key:
                if exponent == 1 and base.is_Symbol:
                    groups.setdefault((with_exponents(key, {base: -1}), abs(factor)), []).append((key, base))
        (rest, size), members = max(groups.items(), key=lambda group: len(group[1]), default=(((), 1), []))
        if len(members) < 2:
            return sympy.Add(*parts, expression_of(remaining))
        signs = [remaining.pop(key) / size for key, _ in members]
        sign = -1 if all(s < 0 for s in signs) else 1
        like = sympy.Add(*(sign * s * base for s, (_, base) in zip(signs, members, strict=True)))
        parts.append(sympy.Mul(sign * size, product_of(rest), like))


# ----------------------------------------------------------------------------------------------------------------------
# Expressions as a person would write them: terms merged, sin^2 + cos^2 gone, angles added, like terms grouped.


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
        return expression

    def name(self, expression: Any) -> Any:
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
