"""Antiderivatives of exact quotients by a symbol, of these elementary kinds:

    rational functions of t or of exp(r t + p)
    P(t) exp(r t) sin(w t), P(t) (e + f t)^c, log(e + f t), and c g'(t) exp(g(t))
    (alpha s + beta)/sqrt(a s^2 + b s + c), s a power of t
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce
from math import prod
from typing import Final

from multibody_sym.algebra.quotient_functions import book_node, exact, sign, sqrt
from multibody_sym.algebra.quotients import Field, NoClosedFormError, Quotient, factors_of
from multibody_sym.algebra.roots import Roots, put_in_place, shift_powers
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import (
    ONE,
    PI,
    ZERO,
    Node,
    add,
    divide,
    multiply,
    negate,
    number,
    subtract,
)

_UNKNOWN: Final = "an integral is no elementary function that is known"
_LINEAR, _QUADRATIC = 2, 3

Powers = list[Quotient]
"""The coefficients of the powers 0, 1, .. of a letter."""


@dataclass(frozen=True, eq=False)
class Antiderivative:
    """The sum of `plain` and of factors times logarithms of ratios that are 1 where the symbol is 0.

    `divisors` are not zero at the sample, but may be for other values of letters.
    """

    plain: Node
    logarithms: tuple[tuple[Quotient, Quotient], ...] = ()
    divisors: tuple[Quotient, ...] = ()

    @property
    def node(self) -> Node:
        logarithms = (multiply(book_node(x), BUILD["log"](book_node(ratio))) for x, ratio in self.logarithms)
        return reduce(add, logarithms, self.plain)

    def __add__(self, other: Antiderivative) -> Antiderivative:
        logarithms, divisors = (*self.logarithms, *other.logarithms), (*self.divisors, *other.divisors)
        return Antiderivative(add(self.plain, other.plain), logarithms, divisors)


_NOTHING: Final = Antiderivative(ZERO)


def antiderivative(a: Quotient, by: Node) -> Antiderivative:
    """Return a function of a symbol whose derivative is a quotient. Raises NoClosedFormError where none is known."""
    return _Integration(a.field, by, a.field.constant(0)).of(a)


def definite_integral(a: Quotient, by: Node, start: Quotient) -> tuple[Node, tuple[Quotient, ...]]:
    """Return the integral of a quotient by a symbol from `start` on, and the divisors that are not zero.

    Raises NoClosedFormError where none is known.
    """
    integration = _Integration(a.field, by, start)
    found = integration.of(a)
    whole = found.plain if not integration.functions(a) else found.node  # logarithms of ratios are zero at the start
    first = put_in_place(whole, by, book_node(start))
    return add(found.node, multiply(number(-1), first)), found.divisors


@dataclass(frozen=True, eq=False)
class _Integration:
    """Integrals by a symbol; logarithms in those of rational functions are zero at the `start`."""

    field: Field
    by: Node
    start: Quotient

    def of(self, a: Quotient) -> Antiderivative:
        if a.is_zero:
            return _NOTHING
        functions = self.functions(a)
        if not functions:
            return self.rational(a, self.place, self.start)
        if len(functions) == 1:
            k = functions[0]
            node = self.field.letters[k].node
            alone = node is not None and node.op == "exp" and not self.uses(a, self.place)
            if alone and node is not None and self.slope(node.args[0]) is not None:
                return self.of_exponential(a, k, node.args[0])
        return reduce(lambda total, term: total + self.of_term(*term), self.terms(a, functions), _NOTHING)

    # --- letters --------------------------------------------------------------------------------------------------

    @property
    def place(self) -> int:
        """The place of the symbol among the letters."""
        place = self.field.position(self.by)
        assert place is not None
        return place

    def uses(self, a: Quotient, k: int) -> bool:
        return any(m[k] for p in (a.above, a.below) for m in self.field.in_ring(p))

    def functions(self, a: Quotient) -> list[int]:
        """Return the places of the letters in a quotient that are functions of the symbol."""
        roots = Roots(self.field, self.by)
        places = range(len(self.field.letters))
        return [k for k in places if k != self.place and self.uses(a, k) and roots.depends(k)]

    def free(self, a: Quotient) -> bool:
        """Return whether a quotient is independent of the symbol."""
        return self.by not in a.symbols

    def quotient(self, node: Node) -> Quotient:
        letters = [(x.node, x) for x in self.field.letters if x.node is not None]
        return exact(self.field, [node], {node: self.field.letter(node, x) for node, x in letters})[0]

    def slope(self, node: Node) -> Quotient | None:
        """Return the derivative of an expression that is linear in the symbol, else None."""
        found = self.quotient(derivative(node, self.by))
        return found if self.free(found) else None

    def gen(self, k: int) -> Quotient:
        return self.field.whole(self.field.ring.gens[k])

    def powers(self, a: Quotient, k: int) -> Powers:
        """Return the coefficients of a polynomial in a letter. Raises NoClosedFormError for other quotients."""
        below = self.field.whole(a.below)
        if any(m[k] for m in self.field.in_ring(a.below)):
            raise NoClosedFormError(_UNKNOWN)
        return [x / below for x in self.field.coefficients(a.above, k)]

    # --- rational functions ---------------------------------------------------------------------------------------

    def rational(self, a: Quotient, k: int, start: Quotient, logarithm: Node | None = None) -> Antiderivative:
        """Return the integral of a rational function by a letter, which begins at `start`; `logarithm`: its own."""
        z = self.gen(k)
        below = self.field.coefficients(a.below, k)
        whole, rest = divide_polynomials(self.field.coefficients(a.above, k), below)
        total = sum((x * z.power(n + 1) / (n + 1) for n, x in enumerate(whole)), self.field.constant(0))
        found = Antiderivative(book_node(total))
        if not rest:
            return found
        parts = [p for p, _ in self.factors(a, k)]
        if all(len(p) == _LINEAR for p in parts):
            fractions = (self.simple(rest, below, p, k, start, logarithm) for p in parts)
            return reduce(lambda x, y: x + y, fractions, found)
        slope = [x * n for n, x in enumerate(below)][1:]
        if len(rest) == len(slope):
            share = rest[-1] / slope[-1]
            if all((x - share * y).is_zero for x, y in zip(rest, slope, strict=True)):
                return found + Antiderivative(ZERO, ((share, self.ratio(below, z, start)),))
        if len(below) == _QUADRATIC:
            return found + self.by_quadratic(rest, below, z, start)
        return found + self.by_square(rest, below, k, start)

    def ratio(self, powers: Powers, z: Quotient, start: Quotient) -> Quotient:
        """Return a polynomial by its value at `start`, where that is not zero."""
        value, first = (sum((x * y.power(n) for n, x in enumerate(powers)), y * 0) for y in (z, start))
        return value if first.is_zero else value / first

    def by_square(self, rest: Powers, below: Powers, k: int, start: Quotient) -> Antiderivative:
        """Return the integral of z f(z^2) by y = z^2. Raises NoClosedFormError for other functions."""
        odd = next(n % 2 for n, x in enumerate(below) if not x.is_zero)
        powers = ((n % 2 == parity, x) for parity, each in ((odd, below), (1 - odd, rest)) for n, x in enumerate(each))
        if k != self.place or not all(even or x.is_zero for even, x in powers):
            raise NoClosedFormError(_UNKNOWN)
        y = self.gen(k)  # stands for z^2; z dz = dy/2
        above, under = rest[1 - odd :: 2], [y * 0, *below[1::2]] if odd else below[0::2]
        quotient, divisor = (sum((x * y.power(n) for n, x in enumerate(each)), y * 0) for each in (above, under))
        found = self.rational(quotient / (2 * divisor), k, start * start)
        plain = put_in_place(found.plain, self.by, multiply(self.by, self.by))
        logarithms = tuple((x, self.with_squares(ratio)) for x, ratio in found.logarithms)
        return Antiderivative(plain, logarithms, found.divisors)

    def with_squares(self, a: Quotient) -> Quotient:
        """Return a rational function of the symbol with its square put in."""
        k, field = self.place, self.field
        parts = ({(*m[:k], 2 * m[k], *m[k + 1 :]): c for m, c in field.in_ring(p).items()} for p in (a.above, a.below))
        above, below = (field.whole(field.ring.from_dict(part)) for part in parts)
        return above / below

    def factors(self, a: Quotient, k: int) -> Iterator[tuple[Powers, int]]:
        """Yield the factors of a divisor that name a letter, as polynomials of it."""
        for p, times in factors_of(self.field.in_ring(a.below))[1]:
            powers = self.field.coefficients(p, k)
            if len(powers) > 1:
                yield powers, times

    def simple(
        self, rest: Powers, below: Powers, factor: Powers, k: int, start: Quotient, logarithm: Node | None
    ) -> Antiderivative:
        """Return the integral of the partial fractions of one linear factor, by Heaviside's way."""
        e, f = factor
        root = -(e / f)
        above, divisor = shift_powers(rest, root), shift_powers(below, root)
        times = next(n for n, x in enumerate(divisor) if not x.is_zero)
        zero, series = divisor[times] * 0, list[Quotient]()  # of the quotient of two power series
        for n in range(times):
            known = sum((series[j] * divisor[times + n - j] for j in range(n) if times + n - j < len(divisor)), zero)
            series.append(((above[n] if n < len(above) else zero) - known) / divisor[times])
        linear = e + f * self.gen(k)
        total = self.field.constant(0)
        for n, x in enumerate(series[:-1]):  # x y^(n - times), y = linear/f
            total = total + x * (linear / f).power(n - times + 1) / (n - times + 1)
        found, residue = Antiderivative(book_node(total), (), (divisor[times],)), series[-1]
        if residue.is_zero:
            return found
        if logarithm is not None and e.is_zero:
            return found + Antiderivative(multiply(book_node(residue), logarithm))
        return found + Antiderivative(ZERO, ((residue, linear / (e + f * start)),))

    def by_quadratic(self, rest: Powers, below: Powers, z: Quotient, start: Quotient) -> Antiderivative:
        """Return the integral of (n + m z)/(a z^2 + b z + c)."""
        c, b, a = below
        n, m = [*rest, z * 0][:2]
        half = m / (2 * a)
        other = n - half * b
        inside = 4 * (a * c) - b * b
        value, first = (c + x * (b + x * a) for x in (z, start))
        logarithms = () if half.is_zero else ((half, value / first),)
        if inside.sample < 0:  # two real places at which it vanishes
            root = sqrt(-inside)
            low, high = (self.ratio([b + x, 2 * a], z, start) for x in (-root, root))
            return Antiderivative(ZERO, (*logarithms, *(() if other.is_zero else ((other / root, low / high),))))
        root = sqrt(inside)
        angle = BUILD["atan"](book_node((2 * a * z + b) / root))
        plain = ZERO if other.is_zero else multiply(book_node(2 * other / root), angle)
        return Antiderivative(plain, logarithms)

    # --- substitutions --------------------------------------------------------------------------------------------

    def of_exponential(self, a: Quotient, k: int, exponent: Node) -> Antiderivative:
        """Return the integral of a rational function of z = exp(r t + p), dt = dz/(r z)."""
        slope = self.slope(exponent)
        assert slope is not None
        start = self.quotient(BUILD["exp"](put_in_place(exponent, self.by, ZERO)))
        return self.rational(a / (slope * self.gen(k)), k, start, multiply(book_node(slope), self.by))

    def linear(self, a: Quotient) -> tuple[Quotient, Quotient]:
        """Return e and f of e + f t. Raises NoClosedFormError for other quotients."""
        powers = self.powers(a, self.place)
        if len(powers) != _LINEAR or not all(map(self.free, powers)):
            raise NoClosedFormError(_UNKNOWN)
        return powers[0], powers[1]

    # --- products of functions ------------------------------------------------------------------------------------

    def terms(self, a: Quotient, functions: Sequence[int]) -> Iterator[tuple[Quotient, dict[int, int]]]:
        """Yield the factor of each term of a sum, and its powers of functions by their places."""
        field = self.field
        below, above = dict[tuple[int, ...], Quotient](), dict[tuple[int, ...], Quotient]()
        for p, factors in ((a.below, below), (a.above, above)):
            parts: dict[tuple[int, ...], dict[tuple[int, ...], int]] = {}
            for m, c in field.in_ring(p).items():
                rest = tuple(0 if k in functions else n for k, n in enumerate(m))
                parts.setdefault(tuple(m[k] for k in functions), {})[rest] = c
            factors |= {powers: field.whole(field.ring.from_dict(part)) for powers, part in parts.items()}
        if len(below) != 1:
            raise NoClosedFormError(_UNKNOWN)
        ((least, divisor),) = below.items()
        for powers, factor in above.items():
            yield factor / divisor, {k: n - m for k, n, m in zip(functions, powers, least, strict=True) if n != m}

    def of_term(self, a: Quotient, powers: dict[int, int]) -> Antiderivative:
        """Return the integral of a rational function of the symbol times powers of functions."""
        if not powers:
            return self.rational(a, self.place, self.start)
        whole = self.by_inner(a, powers)
        if whole is not None:
            return whole
        nodes = {k: self.field.letters[k].node for k in powers}
        kinds = sorted(node.op if node is not None else "" for node in nodes.values())
        if kinds == ["pow"]:
            return self.of_power(a, *powers.items())
        if kinds == ["log"] and next(iter(powers.values())) == 1:
            return self.of_logarithm(a, next(iter(powers)))
        waves = [k for k, node in nodes.items() if node is not None and node.op in ("sin", "cos")]
        others = [k for k in powers if k not in waves]
        known = all(node is not None and node.op in ("exp", "sin", "cos") for node in nodes.values())
        if not known or len(waves) > 1 or any(powers[k] != 1 for k in waves):
            raise NoClosedFormError(_UNKNOWN)
        return self.of_waves(a, {k: powers[k] for k in others}, waves)

    def by_inner(self, a: Quotient, powers: dict[int, int]) -> Antiderivative | None:
        """Return the integral of c g' exp(n g); None for other terms."""
        for k, n in powers.items():
            node = self.field.letters[k].node
            if node is None or node.op != "exp":
                continue
            others = prod((self.gen(j).power(m) for j, m in powers.items() if j != k), start=a)
            inner = self.quotient(derivative(node.args[0], self.by)) * n
            if not inner.is_zero and self.free(others / inner):
                return Antiderivative(book_node(others / inner * self.gen(k).power(n)))
        return None

    def of_power(self, a: Quotient, power: tuple[int, int]) -> Antiderivative:
        """Return the integral of P(t) (e + f t)^(c n), P divided by powers of e + f t if at all."""
        k, n = power
        node = self.field.letters[k].node
        assert node is not None
        base, exponent = (self.quotient(x) for x in node.args)
        e, f = self.linear(base)
        if not self.free(exponent):
            raise NoClosedFormError(_UNKNOWN)
        above, below = (shift_powers(self.field.coefficients(p, self.place), -(e / f)) for p in (a.above, a.below))
        times = next(n for n, x in enumerate(below) if not x.is_zero)
        if any(not x.is_zero for x in below[times + 1 :]):
            raise NoClosedFormError(_UNKNOWN)
        total, divisors = self.field.constant(0), []
        for m, x in enumerate(above):  # x y^(m - times), y = base/f
            grown = exponent * n + (m - times + 1)
            if not x.is_zero:
                divisors.append(grown)
                total = total + x / below[times] * (base / f).power(m - times) * base / (f * grown)
        return Antiderivative(book_node(total * self.gen(k).power(n)), (), tuple(divisors))

    def of_logarithm(self, a: Quotient, k: int) -> Antiderivative:
        """Return the integral of P(t) log(g), by parts."""
        node = self.field.letters[k].node
        assert node is not None
        whole = self.quotient(self.rational(a, self.place, self.field.constant(0)).node)
        inner = self.quotient(derivative(node, self.by))
        return Antiderivative(book_node(whole * self.gen(k))) + self.of(-(whole * inner))

    def of_waves(self, a: Quotient, exponentials: dict[int, int], waves: Sequence[int]) -> Antiderivative:
        """Return the integral of P(t) exp(r t), times a sine or cosine of w t if there is one, by parts."""
        r, w = self.field.constant(0), self.field.constant(0)
        for k, n in exponentials.items():
            r = r + self.pace(k) * n
        if waves:
            w = self.pace(waves[0])
        size = r * r + w * w
        outside = prod((self.gen(k).power(n) for k, n in exponentials.items()), start=self.field.constant(1))
        left, polynomial, total = (outside, outside * 0), self.powers(a, self.place), self.field.constant(0)
        sine, cosine = self.wave(waves)
        sign = 1
        while polynomial:
            left = (r * left[0] + w * left[1]) / size, (r * left[1] - w * left[0]) / size
            value = sum((x * self.gen(self.place).power(n) for n, x in enumerate(polynomial)), self.field.constant(0))
            total = total + sign * value * (left[0] * sine + left[1] * cosine)
            polynomial = [x * n for n, x in enumerate(polynomial)][1:]
            sign = -sign
        return Antiderivative(book_node(total), (), () if waves else (r,))

    def wave(self, waves: Sequence[int]) -> tuple[Quotient, Quotient]:
        """Return a wave and its derivative by its angle: (sin, cos) or (cos, -sin); (1, 0) without one."""
        if not waves:
            return self.field.constant(1), self.field.constant(0)
        node = self.field.letters[waves[0]].node
        assert node is not None
        sine, cosine = (self.quotient(BUILD[op](node.args[0])) for op in ("sin", "cos"))
        return (sine, cosine) if node.op == "sin" else (cosine, -sine)

    def pace(self, k: int) -> Quotient:
        """Return the derivative of a function's argument, which is constant. Raises NoClosedFormError for others."""
        node = self.field.letters[k].node
        found = None if node is None else self.slope(node.args[0])
        if found is None:
            raise NoClosedFormError(_UNKNOWN)
        return found


# ----------------------------------------------------------------------------------------------------------------------
# Integrals of R(t)/sqrt(w(t)) dt = (beta + alpha s)/sqrt(Q(s)) ds, Q = c + b s + a s^2, by s = t^n:
#
#     (alpha/a) sqrt(Q) + (beta - alpha b/(2 a)) J(s),    J = acos((2 a s + b)/sqrt(b^2 - 4 a c))/sqrt(-a)   for a < 0
#
# and between the two zeros of Q, a < 0, for any powers of s above the root.


_SUBSTITUTIONS: Final = (1, 2, -1, -2)
_FACTORS: Final = (0, 1, -1, 2, -2)


@dataclass(frozen=True, eq=False)
class RootIntegral:
    """(beta + alpha s)/sqrt(c + b s + a s^2) in s = `by`^`power`; `linear` is (beta, alpha), `square` (c, b, a)."""

    by: Node
    power: int
    linear: tuple[Quotient, Quotient]
    square: tuple[Quotient, Quotient, Quotient]

    @classmethod
    def of(cls, factor: Quotient, square: Quotient, by: Node) -> RootIntegral | None:
        """Return the integrand factor/sqrt(square) by a symbol; None where no substitution gives it this form."""
        for n, linear, inside in _substituted(factor, square, by, range(2)):
            return cls(by, n, (linear[0], linear[1]), (inside[0], inside[1], inside[2]))
        return None

    @property
    def share(self) -> Quotient:
        """The factor of J."""
        (beta, alpha), (_, b, a) = self.linear, self.square
        return beta - alpha * b / (2 * a)

    @property
    def pace(self) -> Quotient:
        """sqrt(-a). Raises NoClosedFormError where nothing swings between two places."""
        return sqrt(-self.square[2])

    def angle(self, s: Quotient) -> Quotient:
        """Return (2 a s + b)/sqrt(b^2 - 4 a c), between -1 and 1."""
        c, b, a = self.square
        return (2 * a * s + b) / sqrt(b * b - 4 * a * c)

    def node(self, start: Quotient) -> Node:
        """Return the integral from a start on. Raises NoClosedFormError."""
        (beta, alpha), (c, b, a) = self.linear, self.square
        field = beta.field
        q = field.letter(self.by, field.letters[field.position(self.by) or 0])
        s, first = q.power(self.power), start.power(self.power)
        root, before = (BUILD["sqrt"](book_node(c + b * x + a * x * x)) for x in (s, first))
        if a.is_zero:
            if b.is_zero:
                raise NoClosedFormError(_UNKNOWN)
            now, then = (book_node(2 * (beta + alpha * (b * x - 2 * c) / (3 * b)) / b) for x in (s, first))
            return subtract(multiply(now, root), multiply(then, before))
        found = multiply(book_node(alpha / a), subtract(root, before))
        share = self.share
        if share.is_zero:
            return found
        if a.sample < 0:
            turned = self._turned(self.angle(s), self.angle(first))
            return add(found, multiply(book_node(share / self.pace), turned))
        pace = sqrt(a)
        both = ((s, root), (first, before))
        now, then = (add(multiply(book_node(2 * pace), y), book_node(2 * a * x + b)) for x, y in both)
        return add(found, multiply(book_node(share / pace), BUILD["log"](divide(now, then))))

    @staticmethod
    def _turned(now: Quotient, first: Quotient) -> Node:
        """Return asin(first) - asin(now)."""
        one = now.field.constant(1)
        if (first - one).is_zero:
            return BUILD["acos"](book_node(now))
        if (first + one).is_zero:
            return negate(BUILD["acos"](book_node(-now)))
        if first.is_zero:
            return negate(BUILD["asin"](book_node(now)))
        return subtract(BUILD["asin"](book_node(first)), BUILD["asin"](book_node(now)))

    def inverse(self, start: Quotient, value: Node) -> Node:
        """Return the symbol by the `value` of the integral from a start on.

        Raises NoClosedFormError where alpha is not zero, or Q has no two zeros.
        """
        (_, alpha), (_, b, a) = self.linear, self.square
        if not alpha.is_zero or a.is_zero or a.sample > 0:
            raise NoClosedFormError(_UNKNOWN)
        first = self.angle(start.power(self.power))
        one = first.field.constant(1)
        turned = multiply(book_node(self.pace / self.linear[0]), value)
        found = multiply(book_node(first), BUILD["cos"](turned))
        if not (first * first - one).is_zero:
            found = subtract(found, multiply(book_node(sqrt(one - first * first)), BUILD["sin"](turned)))
        c = self.square[0]
        size = book_node(sqrt(b * b - 4 * a * c))
        s = divide(subtract(multiply(size, found), book_node(b)), book_node(2 * a))
        root = s if abs(self.power) == 1 else BUILD["sqrt"](s)
        return root if self.power > 0 else divide(ONE, root)


def _substituted(
    factor: Quotient, square: Quotient, by: Node, powers: range
) -> Iterator[tuple[int, dict[int, Quotient], Powers]]:
    """Yield factor/sqrt(square) as P(s)/sqrt(c + b s + a s^2) in s = `by`^n: n, the `powers` of s in P, and c, b, a."""
    field = factor.field
    place = field.position(by)
    solver = Roots(field, by)
    parts = (factor.above, factor.below, square.above, square.below)
    used = {k for p in parts for m in p for k, n in enumerate(m) if n}
    if place is None or any(k != place and solver.depends(k) for k in used):
        return
    q = field.whole(field.ring.gens[place])
    is_negative = bool(q.sample < 0)
    for n in _SUBSTITUTIONS:
        for m in _FACTORS:
            size = -n if is_negative and m % 2 else n  # sqrt(q^(2 m)) is positive
            moved = factor * q.power(1 - n + m - n * powers.start) / size
            found = powers_of_step(moved, place, n, len(powers) - 1)
            inside = powers_of_step(square * q.power(2 * m), place, n, 2)
            if found is not None and inside is not None:
                yield n, dict(zip(powers, found, strict=True)), inside


_POWERS: Final = (range(2), range(-2, 5))
"""Powers of s in the integrals between turns: those that have an antiderivative here, and all."""


def integral_between_turns(factor: Quotient, square: Quotient, by: Node) -> Quotient:
    """Return the size of the integral of factor/sqrt(square) by a symbol between the zeros of the square around it.

    The integrals I_n of s^n/sqrt(c + b s + a s^2) follow from each other, as s^n sqrt(..) vanishes at both ends:

        n c I_(n-1) + (n + 1/2) b I_n + (n + 1) a I_(n+1) = 0        I_0 = pi/sqrt(-a)        |I_-1| = pi/sqrt(-c)

    Raises NoClosedFormError where no substitution gives it this form, or nothing swings between two places.
    """
    for powers in _POWERS:
        for n, above, (c, b, a) in _substituted(factor, square, by, powers):
            used = [k for k, x in above.items() if not x.is_zero]
            if not (a.sample < 0 and (c.sample < 0 or (n == 1 and min(used, default=0) >= 0))):
                continue  # s = 0 lies between the zeros
            pi = a.field.letter(PI, a.field.letters[0])
            known = {0: pi / sqrt(-a), 1: -b / (2 * a) * pi / sqrt(-a)}
            if min(used, default=0) < 0:
                known[-1] = pi / sqrt(-c) * (1 if b.sample > 0 else -1)
                known[-2] = -b / (2 * c) * known[-1]
            for k in range(1, max(used, default=0)):
                known[k + 1] = -(k * c * known[k - 1] + (2 * k + 1) * b * known[k] / 2) / ((k + 1) * a)
            total = sum((above[k] * known[k] for k in used), a.field.constant(0))
            return total * sign(total)
    raise NoClosedFormError(_UNKNOWN)


def powers_of(a: Quotient, by: Node, highest: int) -> Powers | None:
    """Return the coefficients of the powers 0, 1, .. of a symbol in a quotient; None where it has others."""
    place = a.field.position(by)
    depends = Roots(a.field, by).depends
    used = {k for p in (a.above, a.below) for m in p for k, n in enumerate(m) if n}
    if place is None:
        return [a, *([a * 0] * highest)]
    return None if any(k != place and depends(k) for k in used) else powers_of_step(a, place, 1, highest)


def powers_of_step(a: Quotient, k: int, n: int, highest: int) -> Powers | None:
    """Return the coefficients of z^0, z^n, .. of a letter in a quotient; None where it has other powers."""
    field = a.field
    below = field.coefficients(a.below, k)
    least = len(below) - 1
    if any(not x.is_zero for x in below[:-1]):
        return None
    found = [field.constant(0)] * (highest + 1)
    for power, x in enumerate(field.coefficients(a.above, k)):
        if x.is_zero:
            continue
        degree, rest = divmod(power - least, n)
        if rest or not 0 <= degree <= highest:
            return None
        found[degree] = x / below[-1]
    return found


def divide_polynomials(above: Powers, below: Powers) -> tuple[Powers, Powers]:
    """Return the whole part and the rest of a division of polynomials; no rest is an empty list."""
    rest, whole = list(above), list(above[:0])
    while len(rest) >= len(below):
        factor = rest[-1] / below[-1]
        whole.insert(0, factor)
        gap = len(rest) - len(below)
        rest = [x - factor * below[n - gap] if n >= gap else x for n, x in enumerate(rest)][:-1]
    while rest and rest[-1].is_zero:
        rest.pop()
    return whole, rest
