"""The scalars of closed forms: quotients of polynomials in parameters, sines, cosines and roots, exact, with a sample.

Each sum and product is brought to lowest terms at once, so that zeros are seen and no formula depends on the order of
elimination. Each quotient carries its value at the sample with 50 digits, which chooses signs and pivots. sin^2 is
written as 1 - cos^2, the square of a root as its radicand.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from fractions import Fraction
from functools import lru_cache
from math import comb, gcd
from typing import Any, Final

from mpmath import MPContext
from sympy.polys.domains import ZZ
from sympy.polys.heuristicgcd import HeuristicGCDFailed
from sympy.polys.orderings import lex
from sympy.polys.rings import PolyRing

from multibody_sym.errors import MultibodyError, NoSolutionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import PI, Node, negate

# ----------------------------------------------------------------------------------------------------------------------
# Polynomials in irreducible factors, and what two of them share.
#
# A polynomial of the first degree in some letter, p = A x + B, is gcd(A, B) times an irreducible factor. Most
# polynomials of mechanics are such, and one greatest common divisor takes far less time than a general factorisation.
#
# Most pairs of polynomials share nothing, which the integers modulo a prime show. With numbers in place of all letters
# but one, x, the degree in x of a common divisor of f and g is no larger than that of the divisor of their images, if
# the leading coefficient of f or g in x has an image that is not 0. Where that degree is 0 for each letter of both, f
# and g share at most a number and powers of letters.
#
# Source: Geddes, Czapor, Labahn, Algorithms for Computer Algebra (1992), 7.4.


_REMEMBERED: Final = 1024
_MOST_BITS: Final = 512
"""Coefficients with more of them are products of measured numbers: primes beyond them take seconds to find."""
_PRIME: Final = 2**31 - 1
_MULTIPLIER: Final = 1_103_515_245
"""Spreads the numbers in place of letters over all residues; an unlucky one costs time and nothing else."""

Poly = Any
"""A polynomial of a sympy ring with integer coefficients: a map from tuples of exponents to coefficients."""
_Terms = frozenset[tuple[tuple[int, ...], Any]]


def factors_of(p: Poly) -> tuple[int, list[tuple[Poly, int]]]:
    """Return the integer content (with the sign) and the irreducible factors with their exponents."""
    content, rest = p.primitive()
    if rest.LC < 0:
        content, rest = -content, -rest
    shared = tuple(map(min, zip(*rest, strict=True)))
    if any(shared):
        terms = {tuple(e - s for e, s in zip(m, shared, strict=True)): c for m, c in rest.items()}
        rest = rest.ring.from_dict(terms)
    letters = ((p.ring.gens[k], exponent) for k, exponent in enumerate(shared) if exponent)
    exponents: dict[Poly, int] = {}
    for factor, exponent in (*letters, *_irreducible(rest)):
        exponents[factor] = exponents.get(factor, 0) + exponent
    return int(content), list(exponents.items())


def _irreducible(p: Poly) -> Iterator[tuple[Poly, int]]:
    """Yield the factors of a primitive polynomial that no single letter divides."""
    while not p.is_ground:
        degrees = [max(exponents) for exponents in zip(*p, strict=True)]
        if 1 not in degrees:
            long = any(int(c).bit_length() > _MOST_BITS for c in p.values())
            yield from [(p, 1)] if long else _in_general(p)
            return
        k = degrees.index(1)
        linear = p.ring.from_dict({(*m[:k], 0, *m[k + 1 :]): c for m, c in p.items() if m[k]})
        constant = p.ring.from_dict({m: c for m, c in p.items() if not m[k]})
        try:
            shared = cofactors(linear, constant)[0]
        except HeuristicGCDFailed:
            yield from _in_general(p)
            return
        factor = p.exquo(shared)
        yield factor if factor.LC > 0 else -factor, 1
        p = shared


def _in_general(p: Poly) -> Iterator[tuple[Poly, int]]:
    """Yield the factors found by sympy, in a ring of those letters only that occur."""
    used = _letters_in(p)
    for short, exponent in _factors_by_sympy(p.ring.domain, p.ring.order, len(used), _terms(p, used)):
        factor = _in_all_letters(short, used, p.ring)
        yield factor if factor.LC > 0 else -factor, exponent


@lru_cache(maxsize=_REMEMBERED)
def _factors_by_sympy(domain: Any, order: Any, letters: int, terms: _Terms) -> tuple[tuple[Poly, int], ...]:
    """Return the factors of a polynomial by its terms (kept: forms of one formula ask for the same ones)."""
    return tuple(polynomial_ring(domain, order, letters).from_dict(dict(terms)).factor_list()[1])


@lru_cache(maxsize=_REMEMBERED)
def polynomial_ring(domain: Any, order: Any, letters: int) -> Any:
    """Return the ring of polynomials in so many letters (kept: its construction takes longer than most products)."""
    return PolyRing([f"g{k}" for k in range(letters)], domain, order)


def _letters_in(*several: Poly) -> list[int]:
    """Return the places of the letters that occur."""
    return [k for k, exponents in enumerate(zip(*(m for p in several for m in p), strict=True)) if any(exponents)]


def _terms(p: Poly, used: Sequence[int]) -> _Terms:
    """Return the terms of a polynomial in these letters only."""
    return frozenset((tuple([m[k] for k in used]), c) for m, c in p.items())


def _in_all_letters(p: Poly, used: Sequence[int], ring: Any) -> Poly:
    """Return a polynomial in letters that are `used` as one in all letters of a ring."""
    whole = {}
    for m, c in p.items():
        exponents = [0] * ring.ngens
        for k, e in zip(used, m, strict=True):
            exponents[k] = e
        whole[tuple(exponents)] = c
    return ring.from_dict(whole)


def cofactors(f: Poly, g: Poly) -> tuple[Poly, Poly, Poly]:
    """Return the greatest common divisor h and f/h, g/h; raises HeuristicGCDFailed where it is not found."""
    if len(f) < 2 or len(g) < 2:  # as quick as the way below
        h, first, second = f.cofactors(g)
        return h, first, second
    image, other = _Image.of(f), _Image.of(g)
    if not all(image.is_prime_to(other, k) for k in range(f.ring.ngens)):
        used, ring = _letters_in(f, g), f.ring
        parts = _shared_by_sympy(ring.domain, ring.order, len(used), _terms(f, used), _terms(g, used))
        h, first, second = (_in_all_letters(p, used, ring) for p in parts)
        return h, first, second
    shared = tuple(map(min, image.least, other.least))
    number = gcd(*map(int, f.values()), *map(int, g.values()))
    return f.ring.from_dict({shared: f.ring.domain(number)}), _divide(f, shared, number), _divide(g, shared, number)


@lru_cache(maxsize=_REMEMBERED)
def _shared_by_sympy(domain: Any, order: Any, letters: int, *both: _Terms) -> tuple[Poly, Poly, Poly]:
    """Return the `cofactors` of two polynomials by their terms."""
    f, g = (polynomial_ring(domain, order, letters).from_dict(dict(terms)) for terms in both)
    h, first, second = f.cofactors(g)
    return h, first, second


def _divide(p: Poly, shared: Sequence[int], number: int) -> Poly:
    """Return a polynomial over a number and powers of letters, its terms in falling order."""
    if any(shared):
        terms = ((tuple(e - s for e, s in zip(m, shared, strict=True)), c) for m, c in p.items())
    else:
        terms = p.items()
    return p.ring.from_dict({m: c // number for m, c in sorted(terms, reverse=True)})


@dataclass(frozen=True)
class _Image:
    """A polynomial at numbers: the residue of each term, and the `least` and `most` of each letter in its terms."""

    terms: Sequence[tuple[Sequence[int], int]]
    least: tuple[int, ...]
    most: tuple[int, ...]

    @classmethod
    def of(cls, p: Poly) -> _Image:
        terms = []
        for m, c in p.items():
            value = int(c)
            for k, exponent in enumerate(m):
                if exponent:
                    value = value * pow(_number_for(k), exponent, _PRIME) % _PRIME
            terms.append((m, value))
        columns = list(zip(*p, strict=True))
        return cls(terms, tuple(map(min, columns)), tuple(map(max, columns)))

    def is_prime_to(self, other: _Image, k: int) -> bool:
        """Return whether the images show that no common divisor but powers of it has letter k."""
        if self.least[k] == self.most[k] or other.least[k] == other.most[k]:
            return True
        a, b = self._in_letter(k), other._in_letter(k)
        return bool(a[-1] or b[-1]) and _count_shared(a, b) == 1

    def _in_letter(self, k: int) -> list[int]:
        """Return the coefficients in letter k, without the powers of it that divide all, the lowest first."""
        coefficients, low = [0] * (self.most[k] - self.least[k] + 1), self.least[k]
        back = pow(_number_for(k), -1, _PRIME)
        for m, value in self.terms:
            coefficients[m[k] - low] += value * pow(back, m[k], _PRIME)
        return [x % _PRIME for x in coefficients]


def _number_for(k: int) -> int:
    return (k + 1) * _MULTIPLIER % _PRIME


def _count_shared(a: list[int], b: list[int]) -> int:
    """Return how many coefficients the common divisor of polynomials modulo the prime has, by Euclid's algorithm.

    The coefficients of the lowest powers come first.
    """
    while True:
        for p in (a, b):
            while p and not p[-1]:
                p.pop()
        if not a or not b:
            return len(a) + len(b)
        if len(a) < len(b):
            a, b = b, a
        factor, shift = a[-1] * pow(b[-1], -1, _PRIME), len(a) - len(b)
        a = [(x - factor * b[k - shift]) % _PRIME if k >= shift else x for k, x in enumerate(a)]


# ----------------------------------------------------------------------------------------------------------------------
# Fractions in the sine and cosine of an angle in lowest terms, sin^2 + cos^2 = 1 seen.
#
# Sines and cosines of an angle are forms of even degree in a = cos(angle/2) and b = sin(angle/2). Such forms have
# irreducible factors, which polynomials modulo sin^2 + cos^2 - 1 have not: sin^2 - 2 mu sin cos + mu^2 cos^2 is a
# square there, but not when sin^2 is written as 1 - cos^2. With a = 1 they are polynomials in t = tan(angle/2).


Exponents = tuple[int, ...]
Row = tuple[int, ...]
"""Coefficients of 1, t, t^2, ..."""

@lru_cache(maxsize=1000)
def _row(i: int, j: int, n: int) -> Row:
    """Return cos^i sin^j (1 + t^2)^n: the coefficients of (1 - t^2)^i (2 t)^j (1 + t^2)^(n - i - j)."""
    k = n - i - j
    row = [0] * (2 * n + 1)
    for x in range(i + 1):
        for y in range(k + 1):
            row[2 * (x + y) + j] += (-1) ** x * comb(i, x) * comb(k, y) * 2**j
    return tuple(row)


@lru_cache(maxsize=1000)
def _cosine_row(k: int, n: int) -> Row:
    """Return 2^n a^(2n - k) b^k without its sine: the coefficients of (1 + cos)^i (1 - cos)^j in cos."""
    i, j = n - (k + 1) // 2, k // 2
    row = [0] * (i + j + 1)
    for x in range(i + 1):
        for y in range(j + 1):
            row[x + y] += (-1) ** y * comb(i, x) * comb(j, y)
    return tuple(row)


def with_half(p: Poly, s: int, c: int, n: int) -> Poly:
    """Return p (1 + t^2)^n over one angle, written in t in the place of the sine."""
    return _in_powers(p, s, lambda m: ([*m[:c], 0, *m[c + 1 :]], _row(m[c], m[s], n)))


def with_whole(p: Poly, s: int, c: int, n: int) -> Poly:
    """Return 2^n p / (1 + t^2)^n, t in the place of the sine, written in the sine and cosine again."""
    return _in_powers(p, c, lambda m: ([*m[:s], m[s] % 2, *m[s + 1 :]], _cosine_row(m[s], n)))


def _in_powers(p: Poly, k: int, of_term: Callable[[Exponents], tuple[list[int], Row]]) -> Poly:
    """Return a polynomial with new powers of letter k: of each term the other exponents, and the new coefficients."""
    terms: dict[Exponents, int] = {}
    for m, coefficient in p.items():
        rest, row = of_term(m)
        for e, x in enumerate(row):
            if x:
                rest[k] = e
                key = tuple(rest)
                terms[key] = terms.get(key, 0) + coefficient * x
    return p.ring.from_dict({m: x for m, x in terms.items() if x})


def shared_degree(above: Poly, below: Poly, s: int, c: int, n: int) -> int:
    """Return the degree in a and b of the common divisor of two polynomials (1 + t^2)^n at some values of all letters.

    For nearly all values it is that of their greatest common divisor, else it is larger.
    """
    first, second = (_coefficients_of_t(p, s, c, n) for p in (above, below))
    highest = max((k for powers in (first, second) for k, x in enumerate(powers) if x), default=-1)
    return _count_shared(first, second) - 1 + 2 * n - highest


def _coefficients_of_t(p: Poly, s: int, c: int, n: int) -> list[int]:
    """Return the coefficients of p (1 + t^2)^n modulo a prime, the lowest first, with numbers for other letters."""
    total = [0] * (2 * n + 1)
    for m, coefficient in p.items():
        factor = int(coefficient) % _PRIME
        for k, e in enumerate(m):
            if e and k not in (s, c):
                factor = factor * pow(48_271 * k + 16_807, e, _PRIME) % _PRIME
        for k, x in enumerate(_row(m[c], m[s], n)):
            total[k] += factor * x
    return [x % _PRIME for x in total]


# ----------------------------------------------------------------------------------------------------------------------

PRECISE: Final = MPContext()
PRECISE.dps = 50
_NOTHING: Final = PRECISE.mpf(10) ** -30
_UNITS: Final = (1, -1)
_MOST_TERMS: Final = 400
_QUOTIENTS_MOST_BITS: Final = 1000
"""Of an integer coefficient, so that it is a floating-point number: eighteen numbers of sixteen digits, multiplied."""
_HIGHEST_POWER: Final = 24


class NoClosedFormError(Exception):
    """There is no closed form of bearable size; the message says why. Numbers are given instead."""


def why_none(reason: Exception) -> str:
    """Return the reason why there is no closed form: the message of an own error, for arithmetic that it failed."""
    ours = isinstance(reason, (NoClosedFormError, MultibodyError))
    return str(reason) if ours else "a formula on the way has no value at the declared numbers"


@dataclass(frozen=True)
class Letter:
    """A letter of the polynomials: its expression, its value at the sample, and whether it is known to be positive.

    `square` is set for a root (its radicand; then `node` is None) and for a sine (1 - cos^2, `cosine` its position).
    A letter that `turns` may have the other sign than at the sample, as a pushing force may pull.
    """

    node: Node | None
    sample: Any
    positive: bool = False
    square: Poly = None
    cosine: int | None = None
    turns: bool = False


@dataclass(frozen=True, eq=False)
class Quotient:
    """above / below, two polynomials without a common factor, and the value at the sample."""

    field: Field
    above: Poly
    below: Poly
    sample: Any

    def __add__(self, other: Quotient | int) -> Quotient:
        return self.field.sum_of(self, self.field.constant(other))

    def __mul__(self, other: Quotient | int) -> Quotient:
        return self.field.product_of(self, self.field.constant(other))

    def __neg__(self) -> Quotient:
        return Quotient(self.field, -self.above, self.below, -self.sample)

    def __sub__(self, other: Quotient | int) -> Quotient:
        return self + -self.field.constant(other)

    def __truediv__(self, other: Quotient | int) -> Quotient:
        return self * self.field.constant(other).power(-1)

    __radd__ = __add__
    __rmul__ = __mul__

    def power(self, exponent: int) -> Quotient:
        """Return the power with a whole exponent; raises NoClosedFormError for 1/0 and for high powers."""
        if abs(exponent) > _HIGHEST_POWER:
            raise NoClosedFormError(f"the power {exponent} is too high")
        base = self
        if exponent < 0:
            if self.vanishes:
                raise NoClosedFormError("a divisor vanishes at the given values")
            base = self.field.made(self.below, self.above, 1 / self.sample)
        result = self.field.constant(1)
        for _ in range(abs(exponent)):
            result = result * base
        return result

    @property
    def is_zero(self) -> bool:
        return not self.above

    @property
    def vanishes(self) -> bool:
        """Whether the value at the sample is zero."""
        return bool(abs(self.sample) < _NOTHING)

    @property
    def size(self) -> int:
        """The number of terms above and below."""
        return len(self.above) + len(self.below)

    @property
    def symbols(self) -> set[Node]:
        """The symbols on which the value depends."""
        symbols: set[Node] = set()
        polynomials = [self.above, self.below]
        while polynomials:
            for m in polynomials.pop():
                for letter in (self.field.letters[k] for k, exponent in enumerate(m) if exponent):
                    if letter.node is None:
                        polynomials.append(letter.square)
                    else:
                        symbols.update(leaves([letter.node], "symbol"))
        return symbols


@dataclass
class Field:
    """The letters of one calculation, the ring they make, and the signs that the sample has decided.

    `work` is the remaining budget in products of terms; NoClosedFormError is raised when it runs out. Sines of sums of
    angles are written out if `expands`. `inverses` holds the arguments of angles such as acos(x), `multiples` the whole
    numbers by which base angles have been multiplied. `arguments`: angles with letters by their own expressions,
    exponents by exp(x); `logarithms`: x by log(x); `bases`: x by x^(1/3). `remembered` keeps results that hold for the
    present letters.
    """

    work: int
    expands: bool = False
    letters: list[Letter] = field(default_factory=list)
    positive: list[Quotient] = field(default_factory=list)
    inverses: dict[Node, tuple[Quotient, ...]] = field(default_factory=dict)
    multiples: dict[Node, set[int]] = field(default_factory=dict)
    arguments: dict[Node, Quotient] = field(default_factory=dict)
    logarithms: dict[Node, Quotient] = field(default_factory=dict)
    bases: dict[Node, Quotient] = field(default_factory=dict)
    remembered: dict[Any, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._position: dict[Any, int] = {}
        self.letter(PI, Letter(PI, +PRECISE.pi, True))

    # --- letters and constants -----------------------------------------------------------------------------------

    def constant(self, value: Quotient | int | Fraction) -> Quotient:
        if isinstance(value, Quotient):
            return value
        exact = Fraction(value)
        sample = PRECISE.mpf(exact.numerator) / exact.denominator
        return Quotient(self, self.ring(exact.numerator), self.ring(exact.denominator), sample)

    def letter(self, identity: Any, letter: Letter) -> Quotient:
        """Return the letter known by `identity`; `letter` is entered for a new one."""
        k = self.position(identity)
        if k is None:
            k = self._position[identity] = len(self.letters)
            self.letters.append(letter)
            self.ring = polynomial_ring(ZZ, lex, k + 1)
            self.remembered.clear()
        return Quotient(self, self.ring.gens[k], self.ring.one, self.letters[k].sample)

    def position(self, identity: Any) -> int | None:
        """Return the position of a letter, None for an unknown one."""
        return self._position.get(identity)

    def whole(self, p: Poly) -> Quotient:
        return Quotient(self, p, self.ring.one, self.value(p))

    def value(self, p: Poly) -> Any:
        total = PRECISE.mpf(0)
        for m, c in p.items():
            term = PRECISE.mpf(int(c))
            for k, exponent in enumerate(m):
                if exponent:
                    term *= self.letters[k].sample ** exponent
            total += term
        return total

    def in_ring(self, p: Poly) -> Poly:
        """Return a polynomial as one in all present letters."""
        missing = self.ring.ngens - p.ring.ngens
        return self.ring.from_dict({m + (0,) * missing: c for m, c in p.items()}) if missing else p

    def coefficients(self, p: Poly, k: int) -> list[Quotient]:
        """Return the coefficients of the powers 0, 1, .. of the letter at a place in a polynomial."""
        parts: dict[int, dict[Exponents, Any]] = {}
        for m, c in self.in_ring(p).items():
            parts.setdefault(m[k], {})[(*m[:k], 0, *m[k + 1 :])] = c
        return [self.whole(self.ring.from_dict(parts.get(e, {}))) for e in range(max(parts, default=0) + 1)]

    # --- arithmetic -----------------------------------------------------------------------------------------------

    def sum_of(self, a: Quotient, b: Quotient) -> Quotient:
        if a.is_zero or b.is_zero:
            return b if a.is_zero else a
        above, below, other, other_below = (self.in_ring(p) for p in (a.above, a.below, b.above, b.below))
        if below == other_below:
            return self.made(above + other, below, a.sample + b.sample)
        self.spend(len(above) * len(other_below) + len(other) * len(below) + len(below) * len(other_below))
        return self.made(above * other_below + other * below, below * other_below, a.sample + b.sample)

    def product_of(self, a: Quotient, b: Quotient) -> Quotient:
        for one, other in ((a, b), (b, a)):
            if one.above in _UNITS and one.below == 1:
                return other if one.above == 1 else -other
        above, below, other, other_below = (self.in_ring(p) for p in (a.above, a.below, b.above, b.below))
        self.spend(len(above) * len(other) + len(below) * len(other_below))
        return self.made(above * other, below * other_below, a.sample * b.sample)

    def spend(self, products: int) -> None:
        """Take from the work that may still be done."""
        self.work -= products
        if self.work < 0:
            raise NoClosedFormError("the closed form is too long")

    def made(self, above: Poly, below: Poly, sample: Any) -> Quotient:
        """Return above / below as a quotient, without roots below."""
        above, below = self.reduced(above), self.reduced(below)
        if not above:
            return self.constant(0)
        above, below = self.cancelled(*self._without_roots_below(above, below))
        return Quotient(self, *self._lowest_terms(*self._without_sines_below(above, below)), sample)

    def cancelled(self, above: Poly, below: Poly) -> tuple[Poly, Poly]:
        """Return a quotient in lowest terms."""
        if len(above) > _MOST_TERMS or len(below) > _MOST_TERMS:
            raise NoClosedFormError("the closed form is too long")
        if any(int(c).bit_length() > _QUOTIENTS_MOST_BITS for c in (*above.values(), *below.values())):
            raise NoClosedFormError("the numbers of the closed form are too long")
        self.spend(10 * (len(above) + len(below)))
        try:
            _, above, below = cofactors(above, below)
        except HeuristicGCDFailed:
            raise NoClosedFormError("a common factor was not found") from None
        return (above, below) if below.LC > 0 else (-above, -below)

    def reduced(self, p: Poly) -> Poly:
        """Return a polynomial with each sine and each root at most once in a term."""
        p = self.in_ring(p)
        for k in range(len(self.letters) - 1, -1, -1):
            square = self.letters[k].square
            if square is not None and any(m[k] > 1 for m in p):
                p = self.replaced(p, k, self.in_ring(square))
        return p

    def replaced(self, p: Poly, k: int, square: Poly) -> Poly:
        """Return a polynomial in which the square of letter k is written as `square`."""
        parts: dict[int, dict[tuple[int, ...], Any]] = {}
        for m, c in p.items():
            parts.setdefault(m[k] // 2, {})[(*m[:k], m[k] % 2, *m[k + 1 :])] = c
        total = self.ring.zero
        for exponent, part in parts.items():
            self.spend(len(part) * len(square) ** exponent)
            total += self.ring.from_dict(part) * square**exponent
        return total

    def _without_roots_below(self, above: Poly, below: Poly) -> tuple[Poly, Poly]:
        """Return a quotient multiplied above and below by A - B r for each root r in below = A + B r."""
        for k in range(len(self.letters) - 1, -1, -1):
            if self.letters[k].node is None and any(m[k] for m in below):
                plain = self.ring.from_dict({m: c for m, c in below.items() if not m[k]})
                other = 2 * plain - below if plain else self.ring.gens[k]
                self.spend(len(other) * (len(above) + len(below)))
                above, below = self.reduced(above * other), self.reduced(below * other)
        return above, below

    def _without_sines_below(self, above: Poly, below: Poly) -> tuple[Poly, Poly]:
        """Return a quotient without sines that divide below, and above where 1 - cos^2 is written as sin^2."""
        for k, letter in enumerate(self.letters):
            if letter.cosine is None or not below or not all(m[k] for m in below):
                continue
            form = self.replaced(above, letter.cosine, 1 - self.ring.gens[k] ** 2)
            if all(m[k] for m in form):
                above, below = (self.reduced(p.exquo(self.ring.gens[k])) for p in (form, below))
                above, below = self.cancelled(above, below)
        return above, below

    def _lowest_terms(self, above: Poly, below: Poly) -> tuple[Poly, Poly]:
        """Return a quotient without common factors by sin^2 + cos^2 = 1, where it has fewer terms then."""
        for s, letter in enumerate(self.letters):
            c = letter.cosine
            if c is None or not any(m[s] or m[c] for m in below):
                continue
            n = max((m[s] + m[c] for p in (above, below) for m in p), default=0)
            self.spend(len(above) + len(below))
            if n <= _HIGHEST_POWER and shared_degree(above, below, s, c, n) > 1:
                half = self.cancelled(*(with_half(p, s, c, n) for p in (above, below)))
                left = (max(m[s] for p in half for m in p) + 1) // 2
                whole = self.cancelled(*(with_whole(p, s, c, left) for p in half))
                if sum(map(len, whole)) < len(above) + len(below):
                    above, below = whole
        return above, below


# --- angles by their sine and cosine -------------------------------------------------------------------------------

_QUARTERS: Final = {
    ("sin", 1, "cos", 1): (1, 0),
    ("sin", -1, "cos", 1): (-1, 0),
    ("sin", 1, "cos", -1): (-1, 2),
    ("sin", -1, "cos", -1): (1, 2),
    ("cos", 1, "sin", 1): (-1, 1),
    ("cos", 1, "sin", -1): (1, 1),
    ("cos", -1, "sin", 1): (1, -1),
    ("cos", -1, "sin", -1): (-1, -1),
}
"""atan2(y, x) for plus or minus functions of an angle: multiples of the angle and of a right angle."""


def known_angle(y: Quotient, x: Quotient) -> Node | None:
    """Return atan2(y, x), but for full turns, where y and x are up to signs the sine and cosine of one angle."""
    across, along = _signed_wave(y), _signed_wave(x)
    if across is None or along is None or across[0].args != along[0].args:
        return None
    parts = _QUARTERS.get((across[0].op, across[1], along[0].op, along[1]))
    if parts is None:
        return None
    times, quarters = parts
    (angle,) = across[0].args
    own = angle if times > 0 else negate(angle)
    return own + quarters * PI / 2 if quarters else own


def _signed_wave(a: Quotient) -> tuple[Node, int] | None:
    """Return the sine or cosine and the sign of a quotient that is plus or minus one; else None."""
    terms = dict(a.above.items())
    if not a.below.is_ground or int(a.below.LC) != 1 or len(terms) != 1:
        return None
    ((powers, coefficient),) = terms.items()
    if sum(powers) != 1 or abs(int(coefficient)) != 1:
        return None
    node = a.field.letters[powers.index(1)].node
    return (node, int(coefficient)) if node is not None and node.op in ("sin", "cos") else None


# ----------------------------------------------------------------------------------------------------------------------
# A budget of time and size for symbolic derivations, so that a large model ends in advice and not in a hang.


@dataclass
class Budget:
    """The cost that a derivation may have; past it an error names the stage and the sizes."""

    seconds: float = 60.0
    operations: int = 1_000_000
    stage: str = "start"
    spent: int = 0
    started: float = field(default_factory=time.monotonic)

    def enter(self, stage: str) -> None:
        """Name the stage that begins."""
        self.stage = stage
        self.spend(0)

    def spend(self, operations: int) -> None:
        """Count operations; raise NoSolutionError past either limit."""
        self.spent += operations
        elapsed = time.monotonic() - self.started
        if elapsed > self.seconds or self.spent > self.operations:
            raise NoSolutionError(
                f"the closed form is too large: stopped at {self.stage} after {elapsed:.0f} s (limit {self.seconds:g}) "
                f"with {self.spent} operations (limit {self.operations}); choose a recursive formalism, such as "
                "composite_body, which needs no closed form",
                number="N104",
            )
