"""Roots in closed form, near the sample; then finished formulas with one form of each root, and shorter ones.

A root is a value of a symbol at which an exact quotient vanishes.

The vanishing factor of its numerator is solved where it is of the first or second degree in the symbol, in one function
of it (tanh, exp, ..), in its sine or cosine alone, in their quotient, or of the first degree in both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from fractions import Fraction
from functools import cached_property, reduce
from math import comb, pi
from typing import Final

import sympy
from sympy.simplify.fu import TR8

from multibody_sym.algebra.book_form import book_form, exact_root, product_node, with_doubles
from multibody_sym.algebra.inequalities import surely_positive
from multibody_sym.algebra.quotient_functions import book_node, exact, odd_root, sqrt
from multibody_sym.algebra.quotients import (
    PRECISE,
    Field,
    Letter,
    NoClosedFormError,
    Poly,
    Quotient,
    factors_of,
    known_angle,
)
from multibody_sym.algebra.trigonometry import trigonometric_forms
from multibody_sym.errors import ExpressionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, PI, TWO, ZERO, Node, add, as_node, divide, multiply, negate, number
from multibody_sym.scalars.sympy_bridge import from_sympy, to_sympy
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

_VANISHING: Final = PRECISE.mpf(10) ** -12
"""Part of the sum of its terms' sizes up to which a factor vanishes at the sample, which has the digits of a double."""
_MOST_ROOTS: Final = 2
_MOST_TERMS: Final = 4
_HIGHEST: Final = 4
_LITTLE: Final = 1000
_TURNED: Final = 1e-9


def _log(x: Node) -> Node:
    """Return the logarithm, -log(2) for log(1/2)."""
    small = x.op == "number" and 0 < x.data < 1
    return negate(BUILD["log"](divide(ONE, x))) if small else BUILD["log"](x)


_INVERSES: Final[dict[str, Callable[[Node], Node]]] = {
    "exp": _log,
    "log": BUILD["exp"],
    "tanh": lambda x: divide(BUILD["log"](divide(add(ONE, x), add(ONE, negate(x)))), TWO),
    "atan": BUILD["tan"],
    "asin": BUILD["sin"],
    "acos": BUILD["cos"],
    "sinh": lambda x: BUILD["log"](add(x, BUILD["sqrt"](add(multiply(x, x), ONE)))),
    "asinh": BUILD["sinh"],
    "acosh": BUILD["cosh"],
    "atanh": BUILD["tanh"],
}


def roots(equation: Quotient, unknown: Node) -> Iterator[Node]:
    """Yield values of a symbol at which a quotient vanishes, as expressions of the others; some may miss the sample.

    Raises NoClosedFormError where an expression is too long, or a choice is undecided at the sample.
    """
    field = equation.field
    yield from Roots(field, unknown).of(field.in_ring(equation.above), _MOST_ROOTS)


def linear_parts(equation: Quotient, unknown: Node) -> Iterator[tuple[Quotient, Quotient]]:
    """Yield (A, B) of each factor A x + B of the numerator that vanishes at the sample, x being a symbol."""
    field = equation.field
    solver, k = Roots(field, unknown), field.position(unknown)
    for factor, _ in factors_of(field.in_ring(equation.above))[1] if k is not None else ():
        p = field.in_ring(factor)
        if k is not None and max(m[k] for m in p) == 1 and solver.vanishes(p):
            constant, slope = field.coefficients(p, k)
            yield slope, constant


def rate(a: Quotient, unknown: Node) -> Quotient:
    """Return the derivative by a symbol that stands alone, and in sines and cosines of linear expressions."""
    field = a.field
    above, below = (_polynomial_rate(field, field.in_ring(p), unknown) for p in (a.above, a.below))
    return (above * field.whole(a.below) - below * field.whole(a.above)) / field.whole(a.below).power(2)


def _polynomial_rate(field: Field, p: Poly, unknown: Node) -> Quotient:
    total = field.constant(0)
    solver = Roots(field, unknown)
    for k, letter in enumerate(field.letters):
        if k >= p.ring.ngens or not any(m[k] for m in p) or not solver.depends(k):
            continue
        slope, node = field.whole(p.diff(p.ring.gens[k])), letter.node
        if node is unknown:
            total = total + slope
            continue
        inner = derivative(node.args[0], unknown) if node is not None and node.op in ("sin", "cos") else None
        if node is None or inner is None or inner.op not in ("number", "neg") or inner.shadow is None:
            raise NoClosedFormError("a function has no derivative here")
        other = field.letter(("cos" if node.op == "sin" else "sin", node.args[0]), letter)
        turned = other if node.op == "sin" else -other
        total = total + slope * (turned * field.constant(Fraction(inner.shadow)))
    return total


class Roots:
    """Solves polynomials of a field for a symbol."""

    def __init__(self, field: Field, unknown: Node) -> None:
        self.field = field
        self.unknown = unknown

    def of(self, p: Poly, left: int) -> Iterator[Node]:
        forms = trigonometric_forms(self.field, p)
        factors = [self.field.in_ring(factor) for form in forms for factor, _ in factors_of(form)[1]]
        for factor in sorted(dict.fromkeys(factors), key=lambda f: max(map(sum, f))):
            root = self.alone(self.field.in_ring(factor))
            if root is not None:
                yield from self.of(self.without_root(self.field.in_ring(factor), root), left)
            elif self.vanishes(self.field.in_ring(factor)):
                yield from self.of_factor(factor, left)

    def alone(self, p: Poly) -> int | None:
        """Return the place of a root that is the whole factor; its square vanishes with it, but for rounding."""
        if len(p) != 1:
            return None
        (exponents,) = p
        places = [k for k, exponent in enumerate(exponents) if exponent]
        return places[0] if len(places) == 1 and self.field.letters[places[0]].node is None else None

    def vanishes(self, p: Poly) -> bool:
        sizes = PRECISE.mpf(0)
        for m, c in p.items():
            term = PRECISE.mpf(abs(int(c)))
            for k, exponent in enumerate(m):
                node = self.field.letters[k].node
                if exponent and (node is None or node.op not in ("sin", "cos")):  # their zeros have samples of rounding
                    term *= abs(self.field.letters[k].sample) ** exponent
            sizes += term
        return bool(abs(self.field.value(p)) <= _VANISHING * sizes)

    def of_factor(self, p: Poly, left: int) -> Iterator[Node]:
        p = self.field.in_ring(p)
        places = [k for k in range(len(self.field.letters)) if any(m[k] for m in p) and self.depends(k)]
        root = next((k for k in places if self.field.letters[k].node is None), None)
        if root is not None and left:
            yield from self.of(self.without_root(p, root), left - 1)
        elif len(places) == 1:
            letter = self.field.letters[places[0]]
            assert letter.node is not None
            for value in self.polynomial_roots(self.field.coefficients(p, places[0])):
                yield from self.inverted(letter.node, value)
        elif len(places) == 2:
            pair = self.sine_and_cosine(places)
            if pair is not None:
                yield from self.of_circle(p, *pair)

    def depends(self, k: int) -> bool:
        """Return whether a letter depends on the symbol."""
        letter = self.field.letters[k]
        if letter.node is not None:
            return self.unknown in leaves([letter.node], "symbol")
        return any(self.depends(j) for m in letter.square for j, exponent in enumerate(m) if exponent)

    def without_root(self, p: Poly, k: int) -> Poly:
        """Return A^2 - B^2 r^2 for p = A + B r, r being a root."""
        field = self.field
        plain = field.ring.from_dict({m: c for m, c in p.items() if not m[k]})
        other = field.ring.from_dict({(*m[:k], 0, *m[k + 1 :]): c for m, c in p.items() if m[k]})
        field.spend(len(plain) ** 2 + len(other) ** 2)
        return field.reduced(plain**2 - other**2 * field.in_ring(field.letters[k].square))

    def polynomial_roots(self, coefficients: list[Quotient]) -> Iterator[Quotient]:
        """Yield the roots of a polynomial of the first or second degree, of the letter or its square, or c + a x^n."""
        while coefficients and coefficients[-1].is_zero:
            coefficients = coefficients[:-1]
        if len(coefficients) in (3, 5) and all(x.is_zero for x in coefficients[1::2]):
            for square in self.polynomial_roots(coefficients[::2]):
                with suppress(NoClosedFormError):
                    root = sqrt(square)
                    yield from (root, -root)
            return
        if len(coefficients) == 2:
            yield -(coefficients[0] / coefficients[1])
        elif len(coefficients) == 3:
            c, b, a = coefficients
            try:
                root = sqrt(b * b - 4 * (a * c))
            except NoClosedFormError:
                return
            for signed in (root, -root):
                yield (signed - b) / (2 * a)
        elif len(coefficients) % 2 == 0 and all(x.is_zero for x in coefficients[1:-1]):
            with suppress(NoClosedFormError):
                yield odd_root(-(coefficients[0] / coefficients[-1]), len(coefficients) - 1)

    # --- functions of the symbol ----------------------------------------------------------------------------------

    def inverted(self, node: Node, value: Quotient) -> Iterator[Node]:
        """Yield the symbol's values at which a function of it has a value."""
        if node is self.unknown:
            yield shortest_node(value)
        elif node.op in ("sin", "cos"):
            angle = BUILD[f"a{node.op}"](shortest_node(value))
            other = add(PI, negate(angle)) if node.op == "sin" else negate(angle)
            for one in (angle, other):
                yield from self.of_argument(node.args[0], one, 2)
        elif node.op == "cosh":
            one = shortest_node(value)
            grown = BUILD["log"](add(one, BUILD["sqrt"](shortest_node(value * value - 1))))
            for both in (grown, negate(grown)):
                yield from self.of_argument(node.args[0], both)
        elif node.op in _INVERSES:
            yield from self.of_argument(node.args[0], _INVERSES[node.op](shortest_node(value)))

    def of_argument(self, argument: Node, value: Node, turns: int = 0) -> Iterator[Node]:
        """Yield the symbol for a value of a linear expression of it, an angle up to whole multiples of `turns` x pi.

        Of nested functions the outer one is inverted first.
        """
        letters = [letter for letter in self.field.letters if letter.node is not None and letter.node.op == "symbol"]
        known = {letter.node: self.field.letter(letter.node, letter) for letter in letters if letter.node is not None}
        found = exact(self.field, [argument], known)[0]
        k = self.field.position(self.unknown)
        if argument.op in (*_INVERSES, "cosh") and not turns:
            yield from self.inverted(argument, exact(self.field, [value], known)[0])
            return
        if turns:
            value = self.turned(found, value, turns)
        parts = self.field.coefficients(found.above, k) if k is not None else []
        if k is None or any(m[k] for m in self.field.in_ring(found.below)) or len(parts) != 2:
            (wanted,) = exact(self.field, [value], known)
            yield from self.of(self.field.in_ring((found - wanted).above), 1)
            return
        constant, factor = parts[0] / self.field.whole(found.below), parts[1] / self.field.whole(found.below)
        shifted = with_one_pi(value if constant.is_zero else add(value, negate(shortest_node(constant))))
        yield shifted if factor.sample == 1 and not factor.symbols else divide(shifted, shortest_node(factor))

    def turned(self, argument: Quotient, value: Node, turns: int) -> Node:
        """Return an angle with the multiple of `turns` x pi added that brings it to the argument's sample."""
        sample = {x.node: float(x.sample) for x in self.field.letters if x.node is not None and x.node.op == "symbol"}
        apart = (float(argument.sample) - evaluate_float([value], sample)[0]) / (turns * pi)
        count = round(apart)
        if count == 0 or abs(apart - count) > _TURNED:
            return value
        return add(value, multiply(number(turns * count), PI))

    # --- sines and cosines ----------------------------------------------------------------------------------------

    def sine_and_cosine(self, places: list[int]) -> tuple[int, int] | None:
        """Return the places of the sine and cosine of one angle, None for other letters."""
        for s, c in (places, places[::-1]):
            if self.field.letters[s].cosine == c:
                return s, c
        return None

    def of_circle(self, p: Poly, s: int, c: int) -> Iterator[Node]:
        """Yield the roots of a polynomial in the sine and cosine of an angle."""
        terms: dict[tuple[int, int], Quotient] = {}
        for m, coefficient in p.items():
            rest = self.field.ring.from_dict({tuple(0 if k in (s, c) else e for k, e in enumerate(m)): coefficient})
            key = (m[s], m[c])
            terms[key] = terms.get(key, self.field.constant(0)) + self.field.whole(rest)
        highest = max(i + j for i, j in terms)
        node = self.field.letters[s].node
        if highest > _HIGHEST or node is None:
            return
        if len({(i + j) % 2 for i, j in terms}) == 1:
            for tangent in self.polynomial_roots(self.in_tangent(terms, highest)):
                yield from self.of_argument(node.args[0], BUILD["atan"](shortest_node(tangent)), 1)
        elif highest == 1:
            yield from self.of_line(node.args[0], *(terms[key] for key in ((1, 0), (0, 1), (0, 0))))

    def in_tangent(self, terms: dict[tuple[int, int], Quotient], highest: int) -> list[Quotient]:
        """Return the coefficients of the polynomial in tan = sin / cos, terms made of one degree by sin^2 + cos^2."""
        found = [self.field.constant(0)] * (highest + 1)
        for (i, j), coefficient in terms.items():
            pairs = (highest - i - j) // 2
            for k in range(pairs + 1):
                found[i + 2 * k] = found[i + 2 * k] + comb(pairs, k) * coefficient
        return found

    def of_line(self, angle: Node, a: Quotient, b: Quotient, d: Quotient) -> Iterator[Node]:
        """Yield the angles with a sin + b cos + d = 0."""
        length = sqrt(a * a + b * b)
        length = length if a.sample > 0 else -length
        sine = BUILD["asin"](shortest_node(-d / length))
        ahead = negate(known_angle(b / length, a / length) or BUILD["atan"](shortest_node(b / a)))
        for one in (sine, add(PI, negate(sine))):
            yield from self.of_argument(angle, add(one, ahead), 2)


def with_one_pi(total: Node) -> Node:
    """Return a sum with its multiples of pi as one: asin(x) - pi for asin(x) + pi - 2 pi."""
    turns, others = Fraction(0), []
    for term in flatten("add", total):
        found = exact(Field(_LITTLE), [term], {})[0] if not leaves([term], "symbol", "slot") else None
        if found is not None and found.below.is_ground and [*found.above] == [found.field.ring.gens[0].LM]:
            turns += Fraction(int(found.above.LC), int(found.below.LC))
        else:
            others.append(term)
    if turns:
        others.append(multiply(number(turns), PI))
    ordered = sorted(others, key=lambda x: x.op == "neg" or (turns < 0 and x is others[-1]))
    return reduce(add, ordered) if len(ordered) < len(flatten("add", total)) else total


def has_value(node: Node, value: float, sample: Mapping[Node, float], part: float, least: float = 0.0) -> bool:
    """Return whether an expression, as it is printed, has a value to a part of that, or of the `least` size."""
    try:
        again = evaluate_float([parse(text(node))], sample)[0]
    except (ExpressionError, *UNDEFINED):
        return False
    return abs(again - value) <= part * max(abs(value), least)


def put_in_place(node: Node, unknown: Node, value: Node) -> Node:
    """Return an expression with a value in the place of a symbol."""
    return as_node(evaluate([node], lambda leaf: value if leaf is unknown else leaf)[0])


def shift_powers(powers: Sequence[Quotient], by: Quotient) -> list[Quotient]:
    """Return the coefficients of a polynomial in y = x - by (Horner's scheme)."""
    found = list(powers)
    for start in range(len(found) - 1):
        for k in range(len(found) - 2, start - 1, -1):
            found[k] = found[k] + by * found[k + 1]
    return found


def shortest_node(a: Quotient) -> Node:
    """Return a quotient as a book prints it, a number in single terms where that is shorter: 1 - 2*sqrt(2)/3."""
    form = book_node(a)
    if a.symbols or not a.below.is_ground or not 1 < len(a.above) <= _MOST_TERMS:
        return form
    ring = a.above.ring
    parts = [book_form(a.field.whole(ring.from_dict({m: c})) / a.field.whole(a.below)) for m, c in a.above.items()]
    apart = reduce(add, sorted(parts, key=lambda part: (part.op == "neg", part.op != "number", text(part))))
    return min(form, apart, key=lambda node: len(text(node)))


# ----------------------------------------------------------------------------------------------------------------------
# One form of a root in all formulas of a problem: where one has sqrt(k/m), another has m*sqrt(k/m) for sqrt(k*m).
#
# Two roots are forms of one where their radicands differ by the square of a product of positive factors. Roots and
# other functions are letters here without a square, so that nothing but the form of a root changes.


_ARITHMETIC: Final = frozenset({"number", "real", "add", "mul", "neg", "div"})
_WITHOUT_LETTER: Final = frozenset({"symbol", "slot", "quantity", "declared", "less", "less_equal"})
_WORK: Final = 20_000
_SHARED_ROOTS_MOST_ROOTS: Final = 16
_MOST_TRIED: Final = 4
_LONGEST_RATIO: Final = 24
_AGREEMENT: Final = 1e-9


def values_with_shared_roots(values: Sequence[Value], letters: Mapping[Node, Letter]) -> list[Value]:
    """Return values with one form of each root in all their expressions; `letters` as for `with_shared_roots`."""
    forms = list(dict.fromkeys(each.expression for each in values if each.expression is not None))
    changed = dict(zip(forms, with_shared_roots(forms, letters), strict=True))
    return [x if x.expression is None else replace(x, expression=changed[x.expression]) for x in values]


def with_shared_roots(forms: Sequence[Node], letters: Mapping[Node, Letter]) -> list[Node]:
    """Return expressions, all different, with one form of each root wherever that makes none of their texts longer.

    `letters`: symbols with their samples, and which are positive. The first form that leaves the fewest others is
    taken. An expression with other symbols stays.
    """
    roots = list(dict.fromkeys(n for n in postorder(forms) if n.op == "sqrt"))
    if not 2 <= len(roots) <= _SHARED_ROOTS_MOST_ROOTS:
        return list(forms)
    comparison = _Roots({n: x for n, x in letters.items() if n.op == "symbol"})
    shared = list(forms)
    for group in comparison.groups(roots):
        shared = comparison.with_one(group, shared)
    return shared


@dataclass
class _Roots:
    """Roots over one field; `known`: the letters of symbols and functions, `ratios`: those of pairs of roots."""

    letters: Mapping[Node, Letter]
    known: dict[Node, Quotient] = field(default_factory=dict)
    ratios: dict[tuple[Node, Node], Quotient | None] = field(default_factory=dict)
    field: Field = field(default_factory=lambda: Field(_WORK))

    def __post_init__(self) -> None:
        self.known = {node: self.field.letter(node, letter) for node, letter in self.letters.items()}
        self.sample = {node: float(letter.sample) for node, letter in self.letters.items()}

    def groups(self, roots: Sequence[Node]) -> list[list[Node]]:
        """Return the forms of each root that has more than one."""
        found: list[list[Node]] = []
        for root in roots:
            own = next((group for group in found if self.ratio(root, group[0]) is not None), None)
            if own is not None:
                own.append(root)
            else:
                found.append([root])
        return [group for group in found if len(group) > 1]

    def ratio(self, root: Node, other: Node) -> Quotient | None:
        """Return root / other where that is a product of positive factors."""
        if (root, other) not in self.ratios:
            self.ratios[root, other] = None
            a, b = self.exact(root.args[0]), self.exact(other.args[0])
            self.field.work = _WORK
            if a is not None and b is not None:
                with suppress(NoClosedFormError):
                    self.ratios[root, other] = _positive_root(a / b)
        return self.ratios[root, other]

    def exact(self, node: Node, changed: Mapping[Node, Quotient] | None = None) -> Quotient | None:
        """Return an expression over the field, in which functions are letters but for those `changed`."""
        self.field.work = _WORK
        try:
            if not all(self._has_letter(n) for n in postorder([node])):
                return None
            return exact(self.field, [node], {**self.known, **(changed or {})})[0]
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None

    def _has_letter(self, n: Node) -> bool:
        """Return whether a node is of arithmetic or known; a function becomes so."""
        whole = n.op == "pow" and n.args[1].op == "number" and Fraction(n.args[1].data).denominator == 1
        if n in self.known or n is PI or n.op in _ARITHMETIC or whole:
            return True
        if n.op in _WITHOUT_LETTER:
            return False
        sample = PRECISE.mpf(float(evaluate_float([n], self.sample)[0]))
        self.known[n] = self.field.letter(n, Letter(n, sample, n.op in ("sqrt", "exp") and sample > 0))
        return True

    # --- one form -------------------------------------------------------------------------------------------------

    def with_one(self, group: Sequence[Node], forms: Sequence[Node]) -> list[Node]:
        """Return expressions with that form of a root which leaves the fewest others, if fewer than before."""
        ways = [list(forms), *([self._in_form(n, group, kept) for n in forms] for kept in group[:_MOST_TRIED])]
        return min(ways, key=lambda way: len(_roots_in(way, group)))

    def _in_form(self, node: Node, group: Sequence[Node], kept: Node) -> Node:
        """Return an expression with one form of a root for the others, itself where that is longer."""
        others = [root for root in _roots_in([node], group) if root is not kept]
        ratios = {root: self.ratio(root, kept) for root in others}
        if not others or self.exact(node) is None or self.exact(kept) is None:
            return node
        changed = {root: s * self.known[kept] for root, s in ratios.items() if s is not None}
        quotient = self.exact(node, changed)
        try:
            found = node if quotient is None else with_doubles(book_form(quotient))
        except (NoClosedFormError, ExpressionError):
            return node
        squared = any(n.op == "pow" and n.args[0].op == "sqrt" for n in postorder([found]))
        return node if squared or len(text(found)) > len(text(node)) or not self._equal(found, node) else found

    def _equal(self, a: Node, b: Node) -> bool:
        """Return whether the text of an expression reads back as the value of another one."""
        try:
            x, y = (float(evaluate_float([n], self.sample)[0]) for n in (parse(text(a)), b))
        except (ExpressionError, *UNDEFINED):
            return False
        return abs(x - y) <= _AGREEMENT * abs(y)


def _roots_in(forms: Sequence[Node], group: Sequence[Node]) -> list[Node]:
    met = {n for n in postorder(forms) if n.op == "sqrt"}
    return [root for root in group if root in met]


def _positive_root(a: Quotient) -> Quotient | None:
    """Return the root of a quotient that is the square of a product of positive factors; else None."""
    if a.size > _LONGEST_RATIO:
        return None
    root = a.field.constant(1)
    for p, side in ((a.above, 1), (a.below, -1)):
        content, factors = factors_of(a.field.in_ring(p))
        number = exact_root(Fraction(content)) if content > 0 else None
        if not number:
            return None
        root = root * a.field.constant(number).power(side)
        for factor, exponent in factors:
            whole = a.field.whole(factor)
            if exponent % 2 or not surely_positive(whole):
                return None
            root = root * whole.power(side * exponent // 2)
    return root


# ----------------------------------------------------------------------------------------------------------------------
# Angles at which a product of sines and cosines vanishes that is one sine or cosine: cos(a) cos(b) - sin(a) sin(b).


def angles_of_one_wave(equation: Node, unknown: Node) -> Iterator[Node]:
    """Yield angles at which an expression vanishes whose sines and cosines add up to one, of a linear argument.

    Half turns apart; there are none where no such sum is known.
    """
    x = sympy.Symbol("unknown angle", real=True)
    above = sympy.numer(sympy.together(to_sympy(equation, {unknown: x})))
    summed = sympy.factor_terms(TR8(sympy.expand(above)))
    for factor in sympy.Mul.make_args(summed):
        argument = factor.args[0] if factor.func in (sympy.sin, sympy.cos) else sympy.S.Zero
        slope = argument.diff(x)
        if slope.is_Integer and slope != 0:
            rest = sympy.expand(argument - slope * x)
            first = sympy.pi / 2 if factor.func is sympy.cos else sympy.S.Zero
            for turns in range(-int(abs(slope)), int(abs(slope)) + 1):
                yield from_sympy(sympy.expand((first + turns * sympy.pi - rest) / slope))


# ----------------------------------------------------------------------------------------------------------------------
# Shorter writings of a formula's parts, equal for all parameters: |x| as x, nested roots as sums, acos(..) as atan.
#
# In: a Node in letters with samples. Out: a Node of the same value, never longer. Each rule is exact.


_LONGEST: Final = 150
"""Letters of a part that is looked at."""
_NESTED: Final = 3
"""Letters by which one fraction in place of fractions in each other may be longer."""
_SAME_NUMBER: Final = 1e-12
_NEVER_NEGATIVE: Final = ("sqrt", "exp", "abs", "cosh", "acos", "acosh")
_OF_PARTS: Final = ("add", "mul", "div", "min", "sinh", "tanh", "atan", "asin", "asinh", "atanh")
"""Never negative where their arguments are."""


@dataclass
class ShortForms:
    """Shorter writings of expressions in `letters`: symbols with their samples, and which are positive."""

    letters: Mapping[Node, Letter]
    _positive: dict[Node, bool] = field(default_factory=dict)

    @cached_property
    def _sample(self) -> dict[Node, float]:
        return {node: float(letter.sample) for node, letter in self.letters.items()}

    def shortest(self, form: Node) -> Node:
        """Return an expression in its shortest writing that is known; itself where it names other symbols."""
        if not self.letters.keys() >= {*leaves([form], "symbol")} or leaves([form], "quantity"):
            return form
        found = min((self._by_rules(x) for x in (form, *self._expanded(form))), key=lambda x: len(text(x)))
        return found if len(text(found)) < len(text(form)) and self._agree(found, form) else form

    def _expanded(self, form: Node) -> Iterator[Node]:
        """Yield an expression with sums of angles multiplied out where they cancel, else put together."""
        sums = (n for n in postorder([form]) if n.op in ("sin", "cos", "tan") and len(leaves(n.args, "symbol")) > 1)
        if next(sums, None) is not None and len(text(form)) <= _LONGEST:
            try:
                yield book_node(self._exact(form, expands=True))
            except (NoClosedFormError, ExpressionError, *UNDEFINED):
                return

    def _by_rules(self, form: Node) -> Node:
        made: dict[Node, Node] = {}
        for n in postorder([form]):
            made[n] = self._shorter(BUILD[n.op](*n.own, *(made[x] for x in n.args)) if n.args else n)
        return made[form]

    def _shorter(self, node: Node) -> Node:
        rule = self._rules.get(node.op)
        if rule is None or len(text(node)) > _LONGEST:
            return node
        try:
            found = min(rule(node), key=lambda x: len(text(x)), default=node)
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return node
        nested = node.op in ("mul", "div") and any(x.op == "div" for x in node.args)
        return found if len(text(found)) < len(text(node)) + _NESTED * nested else node

    @cached_property
    def _rules(self) -> Mapping[str, Callable[[Node], Iterator[Node]]]:
        return {
            "abs": self._absolute,
            "sqrt": self._root,
            "acos": self._angle,
            "asin": self._angle,
            "atan": self._arc,
            "atan2": self._direction,
            "log": self._logarithm,
            "mul": self._fraction,
            "div": self._fraction,
        }

    def _agree(self, a: Node, b: Node) -> bool:
        try:
            x, y = evaluate_float([a, b], self._sample)
        except (ExpressionError, *UNDEFINED):
            return False
        return abs(x - y) <= _SAME_NUMBER * abs(y)

    def _exact(self, node: Node, *, expands: bool = False) -> Quotient:
        over = Field(_WORK, expands)
        (found,) = exact(over, [node], {x: over.letter(x, letter) for x, letter in self.letters.items()})
        return found

    def _never_negative(self, node: Node) -> bool:
        """Return whether an expression is zero or more for all parameters, as its parts show."""
        for n in postorder([node]):
            if n in self._positive:
                continue
            if n.op in _OF_PARTS:
                found = all(self._positive[x] for x in n.args)
            elif n.op == "pow":
                exponent = n.args[1].data if n.args[1].op == "number" else Fraction(1)
                found = exponent.denominator > 1 or exponent % 2 == 0 or self._positive[n.args[0]]
            elif n.op == "symbol":
                found = self.letters[n].positive
            else:
                found = n is PI or n.op in _NEVER_NEGATIVE or (n.shadow is not None and n.shadow >= 0.0)
            self._positive[n] = found
        return self._positive[node]

    # --- rules: each yields expressions that equal a node for all parameters ----------------------------------------

    def _absolute(self, node: Node) -> Iterator[Node]:
        """Yield |a b/c| without what is never negative outside the bars."""
        above, below = _factors(node.args[0])
        inside, under = ([x for x in each if not self._never_negative(x)] for each in (above, below))
        outside, divisor = ([x for x in each if self._never_negative(x)] for each in (above, below))
        over, divided = (BUILD["abs"](_product(each)) if each else ONE for each in (inside, under))
        yield divide(multiply(_product(outside), over), multiply(_product(divisor), divided))
        if inside:
            size = BUILD["abs"](divide(_product(inside), _product(under)))
            yield divide(multiply(_product(outside), size), _product(divisor))

    def _root(self, node: Node) -> Iterator[Node]:
        """Yield sqrt((A + D)/2) +- sqrt((A - D)/2) for sqrt(A +- B sqrt(C)), D = sqrt(A^2 - B^2 C) without a root."""
        inside = self._exact(node.args[0])
        over = inside.field
        places = [k for k, letter in enumerate(over.letters) if letter.node is None]
        for k in (k for k in places if any(m[k] for m in over.in_ring(inside.above))):
            above = over.in_ring(inside.above)
            parts = [over.ring.from_dict({m: c for m, c in above.items() if m[k] == e}) for e in (0, 1)]
            a, b = (over.whole(p) / over.whole(inside.below) for p in parts)
            square, roots = a * a - b * b, len(over.letters)
            d = sqrt(square)
            grown = len(over.letters) > roots or any(m[k] for m in over.in_ring(d.above))
            sides = [b * side for side in (1, -1) if surely_positive(b * side)]
            if not grown and sides and (square.is_zero or surely_positive(d)):
                first, second = (book_node(sqrt((a + d * side) / 2)) for side in (1, -1))
                yield add(first, second if b.sample > 0 else -second)

    def _angle(self, node: Node) -> Iterator[Node]:
        """Yield atan(..) for asin(x) and acos(x), where x is never negative."""
        if self._never_negative(node.args[0]):
            square = self._exact(multiply(node.args[0], node.args[0]))
            ratio = square / (-square + 1)
            tangent = sqrt(ratio if node.op == "asin" else ratio.power(-1))
            yield BUILD["atan"](book_node(tangent))

    def _arc(self, node: Node) -> Iterator[Node]:
        """Yield pi/4 + atan(x)/2 for atan(x + sqrt(x^2 + 1)), and acos(..) and asin(..) where x is never negative."""
        (x,) = node.args
        terms = flatten("add", x)
        for k, term in enumerate(terms):
            if term.op == "sqrt":
                rest = reduce(add, [*terms[:k], *terms[k + 1 :]], ZERO)
                if self._exact(term.args[0] - rest * rest - 1).is_zero:
                    yield add(PI / 4, BUILD["atan"](rest) / 2)
        if self._never_negative(x):
            square = self._exact(multiply(x, x))
            for op, part in (("acos", square + 1), ("asin", (square + 1) / square)):
                yield BUILD[op](book_node(sqrt(part.power(-1))))

    def _direction(self, node: Node) -> Iterator[Node]:
        """Yield acos(x/h) for atan2(y, x), where y is never negative and h = sqrt(x^2 + y^2) is no root."""
        y, x = node.args
        if self._never_negative(y):
            square = self._exact(x * x + y * y)
            over = square.field
            roots = len(over.letters)
            h = sqrt(square)
            if surely_positive(h) and len(over.letters) == roots:
                along = exact(over, [x], {n: over.letter(n, letter) for n, letter in self.letters.items()})[0]
                yield BUILD["acos"](book_node(along / h))

    def _logarithm(self, node: Node) -> Iterator[Node]:
        """Yield asinh((x - 1/x)/2), 2 atanh((x - 1)/(x + 1)) for log(x), and acosh((x + 1/x)/2) where x >= 1."""
        (x,) = node.args
        if x.op == "div" or any(n.op == "sqrt" for n in postorder([x])):
            a = self._exact(x)
            quotients = (a - a.power(-1)) / 2, (a + a.power(-1)) / 2, (a - 1) / (a + 1)
            odd, even, ratio = map(book_node, quotients)
            yield BUILD["asinh"](odd)
            yield multiply(TWO, BUILD["atanh"](ratio))
            if self._never_negative(odd) or surely_positive(a - 1):
                yield BUILD["acosh"](even)

    def _fraction(self, node: Node) -> Iterator[Node]:
        """Yield one fraction, with sin(x + atan(p/q)) for a sum of waves over its amplitude."""
        above, below = _factors(node)
        yield divide(_product(above), _product(below))
        yield from self._wave(above, below)

    def _wave(self, above: list[Node], below: list[Node]) -> Iterator[Node]:
        """Yield sin(x + atan(p/q)) for (p cos(x) + q sin(x))/sqrt(p^2 + q^2), where p and q are never negative."""
        for k, total in enumerate(above):
            waves = {op: _wave_of(total, op) for op in ("cos", "sin")} if total.op == "add" else {}
            pair = [x for x in waves.values() if x is not None]
            if len(pair) < 2 or pair[0][1] is not pair[1][1] or not all(self._never_negative(p) for p, _ in pair):
                continue
            (p, angle), (q, _) = pair
            for j, root in enumerate(below):
                if root.op == "sqrt" and self._exact(root.args[0] - p * p - q * q).is_zero:
                    rest = divide(_product([*above[:k], *above[k + 1 :]]), _product([*below[:j], *below[j + 1 :]]))
                    yield multiply(rest, BUILD["sin"](add(angle, BUILD["atan"](divide(p, q)))))
                    yield multiply(rest, BUILD["cos"](add(angle, -BUILD["atan"](divide(q, p)))))


def _factors(node: Node) -> tuple[list[Node], list[Node]]:
    """Return the factors above and below of products and quotients in each other."""
    if node.op not in ("mul", "div"):
        return [] if node is ONE else [node], []
    (above, below), (other, under) = map(_factors, node.args)
    if node.op == "div":
        other, under = under, other
    return [*above, *other], [*below, *under]


def _product(factors: Sequence[Node]) -> Node:
    return product_node([(x, 1) for x in factors])


def _wave_of(total: Node, op: str) -> tuple[Node, Node] | None:
    """Return (p, x) of the term p cos(x) (or p sin(x)) of a sum of two terms; None where it has none."""
    terms = flatten("add", total)
    for term in terms if len(terms) == 2 else ():
        factors = flatten("mul", term)
        wave = next((x for x in factors if x.op == op), None)
        if wave is not None:
            return _product([x for x in factors if x is not wave]), wave.args[0]
    return None
