"""The scalars of closed forms: quotients of polynomials in parameters, sines, cosines and roots, exact, with a sample.

Each sum and product is brought to lowest terms at once, so that what vanishes is seen to vanish and no formula depends
on the order of elimination. Each quotient carries its value at the sample with 50 digits: it chooses signs and pivots.
sin^2 is written as 1 - cos^2, the square of a root as its radicand.
"""

from __future__ import annotations

from dataclasses import field
from fractions import Fraction
from typing import Any, Final

from mpmath import MPContext
from sympy.polys.domains import ZZ
from sympy.polys.heuristicgcd import HeuristicGCDFailed
from sympy.polys.orderings import lex

from multibody_sym.algebra.angles.half_angles import shared_degree, turning_degree, with_half, with_whole
from multibody_sym.algebra.factors import Poly, cofactors, polynomial_ring
from multibody_sym.errors import MultibodyError
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, Node, negate
from multibody_sym.scalars.traversal import leaves

PRECISE: Final = MPContext()
PRECISE.dps = 50
_NOTHING: Final = PRECISE.mpf(10) ** -30
_UNITS: Final = (1, -1)
_MOST_TERMS: Final = 400
_MOST_BITS: Final = 1000
"""Of an integer coefficient, so that it is a floating-point number: eighteen numbers of sixteen digits, multiplied."""
_HIGHEST_POWER: Final = 24


class NoClosedFormError(Exception):
    """There is no closed form of bearable size; the message says why. Numbers are given instead."""


def why_none(reason: Exception) -> str:
    """Return why there is no closed form: what an error says that is one of ours, of arithmetic that it failed."""
    ours = isinstance(reason, (NoClosedFormError, MultibodyError))
    return str(reason) if ours else "a formula on the way has no value at the declared numbers"


@dataclass(frozen=True)
class Letter:
    """A letter of the polynomials: what it stands for, its value at the sample, and whether it is known to be positive.

    `square` is set for a root (its radicand; then `node` is None) and for a sine (1 - cos^2, `cosine` its position).
    One that `turns` may have the other sign than at the sample, as a force that pushes may pull.
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
        """Whether this is the constant 0."""
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
        found: set[Node] = set()
        polynomials = [self.above, self.below]
        while polynomials:
            for m in polynomials.pop():
                for letter in (self.field.letters[k] for k, exponent in enumerate(m) if exponent):
                    if letter.node is None:
                        polynomials.append(letter.square)
                    else:
                        found.update(leaves([letter.node], "symbol"))
        return found


@dataclass
class Field:
    """The letters of one calculation, the ring they make, and the signs that the sample has decided.

    `work` is what may still be spent, counted in products of terms; when it has run out, NoClosedFormError says so.
    Sines of sums of angles are written out if `expands`. `inverses` holds the arguments of angles such as acos(x),
    `multiples` the whole numbers by which base angles have been multiplied. `arguments`: angles with letters by their
    own expressions, exponents by exp(x); `logarithms`: what log(x) is of. `remembered` is for what is found out about
    the letters there are.
    """

    work: int
    expands: bool = False
    letters: list[Letter] = field(default_factory=list)
    positive: list[Quotient] = field(default_factory=list)
    inverses: dict[Node, tuple[Quotient, ...]] = field(default_factory=dict)
    multiples: dict[Node, set[int]] = field(default_factory=dict)
    arguments: dict[Node, Quotient] = field(default_factory=dict)
    logarithms: dict[Node, Quotient] = field(default_factory=dict)
    remembered: dict[Any, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._position: dict[Any, int] = {}
        self.letter(PI, Letter(PI, +PRECISE.pi, True))

    # --- letters and constants -----------------------------------------------------------------------------------

    def constant(self, value: Quotient | int | Fraction) -> Quotient:
        """Return a number as a quotient."""
        if isinstance(value, Quotient):
            return value
        exact = Fraction(value)
        sample = PRECISE.mpf(exact.numerator) / exact.denominator
        return Quotient(self, self.ring(exact.numerator), self.ring(exact.denominator), sample)

    def letter(self, identity: Any, letter: Letter) -> Quotient:
        """Return the letter known by `identity`, made from `letter` when it is met for the first time."""
        k = self.position(identity)
        if k is None:
            k = self._position[identity] = len(self.letters)
            self.letters.append(letter)
            self.ring = polynomial_ring(ZZ, lex, k + 1)
            self.remembered.clear()
        return Quotient(self, self.ring.gens[k], self.ring.one, self.letters[k].sample)

    def position(self, identity: Any) -> int | None:
        """Return the position of a letter, None where it has not been met."""
        return self._position.get(identity)

    def whole(self, p: Poly) -> Quotient:
        """Return a polynomial as a quotient."""
        return Quotient(self, p, self.ring.one, self.value(p))

    def value(self, p: Poly) -> Any:
        """Return a polynomial's value at the sample."""
        total = PRECISE.mpf(0)
        for m, c in p.items():
            term = PRECISE.mpf(int(c))
            for k, exponent in enumerate(m):
                if exponent:
                    term *= self.letters[k].sample ** exponent
            total += term
        return total

    def in_ring(self, p: Poly) -> Poly:
        """Return a polynomial as one in all letters that there are by now."""
        missing = self.ring.ngens - p.ring.ngens
        return self.ring.from_dict({m + (0,) * missing: c for m, c in p.items()}) if missing else p

    # --- arithmetic -----------------------------------------------------------------------------------------------

    def sum_of(self, a: Quotient, b: Quotient) -> Quotient:
        """Return a + b."""
        if a.is_zero or b.is_zero:
            return b if a.is_zero else a
        above, below, other, other_below = (self.in_ring(p) for p in (a.above, a.below, b.above, b.below))
        if below == other_below:
            return self.made(above + other, below, a.sample + b.sample)
        self.spend(len(above) * len(other_below) + len(other) * len(below) + len(below) * len(other_below))
        return self.made(above * other_below + other * below, below * other_below, a.sample + b.sample)

    def product_of(self, a: Quotient, b: Quotient) -> Quotient:
        """Return a b."""
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
        if any(int(c).bit_length() > _MOST_BITS for c in (*above.values(), *below.values())):
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
        """Return a quotient without what its sides share as sin^2 + cos^2 = 1, where it has fewer terms then."""
        for s, letter in enumerate(self.letters):
            c = letter.cosine
            if c is None or not any(m[s] or m[c] for m in below):
                continue
            n = max(turning_degree(p, s, c) for p in (above, below))
            self.spend(len(above) + len(below))
            if n <= _HIGHEST_POWER and shared_degree(above, below, s, c, n) > 1:
                found = self._cancelled_by_half(above, below, s, c, n)
                if sum(map(len, found)) < len(above) + len(below):
                    above, below = found
        return above, below

    def _cancelled_by_half(self, above: Poly, below: Poly, s: int, c: int, n: int) -> tuple[Poly, Poly]:
        """Return a quotient in lowest terms in tan(angle/2), written in the angle's sine and cosine."""
        above, below = self.cancelled(*(with_half(p, s, c, n) for p in (above, below)))
        left = (max(m[s] for p in (above, below) for m in p) + 1) // 2
        return self.cancelled(*(with_whole(p, s, c, left) for p in (above, below)))


# --- angles that are known by their sine and cosine --------------------------------------------------------------

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
"""What atan2(y, x) is for plus or minus functions of an angle: so many times the angle, and so many right angles."""


def known_angle(y: Quotient, x: Quotient) -> Node | None:
    """Return atan2(y, x), but for full turns, where y and x are up to signs the sine and cosine of one angle."""
    across, along = _function(y), _function(x)
    if across is None or along is None or across[0].args != along[0].args:
        return None
    found = _QUARTERS.get((across[0].op, across[1], along[0].op, along[1]))
    if found is None:
        return None
    times, quarters = found
    (angle,) = across[0].args
    own = angle if times > 0 else negate(angle)
    return own + quarters * PI / 2 if quarters else own


def _function(a: Quotient) -> tuple[Node, int] | None:
    """Return the sine or cosine that a quotient is up to its sign, and that sign."""
    terms = dict(a.above.items())
    if not a.below.is_ground or int(a.below.LC) != 1 or len(terms) != 1:
        return None
    ((powers, coefficient),) = terms.items()
    if sum(powers) != 1 or abs(int(coefficient)) != 1:
        return None
    node = a.field.letters[powers.index(1)].node
    return (node, int(coefficient)) if node is not None and node.op in ("sin", "cos") else None
