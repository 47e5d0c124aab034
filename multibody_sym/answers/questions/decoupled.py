"""Linear equations x'' = A x + B x' + f(t) taken apart into such of one unknown each, whose solutions are known."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import reduce
from typing import Final

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.factors import factored
from multibody_sym.algebra.quotient_functions import doubled, sqrt
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted, at_start
from multibody_sym.answers.questions.linear_courses import Linear
from multibody_sym.answers.small_motions.matrices import Matrices, Matrix
from multibody_sym.answers.small_motions.spectrum import coefficients, determinant, spectrum
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.node import ZERO, Node, add, symbol

_EXPONENT: Final = symbol("exponent of modes")
_LINEAR, _QUADRATIC, _QUARTIC = 1, 2, 4

Vector = list[Quotient]


@dataclass(frozen=True, eq=False)
class Factor:
    """s^2 - b s - a, or s - b where a is None."""

    b: Quotient
    a: Quotient | None

    def remainder(self, other: Factor) -> tuple[Quotient, Quotient]:
        """Return (c, d) with c + d s what is left of this one when the other vanishes."""
        if self.a is None:
            return -self.b, self.b.field.constant(1)
        if other.a is None:
            return other.b * other.b - self.b * other.b - self.a, self.b * 0
        return other.a - self.a, other.b - self.b

    def product(self, x: tuple[Quotient, Quotient], y: tuple[Quotient, Quotient]) -> tuple[Quotient, Quotient]:
        """Return (c + d s)(e + f s) where this vanishes."""
        if self.a is None:
            return (x[0] + x[1] * self.b) * (y[0] + y[1] * self.b), self.b * 0
        both = x[1] * y[1]
        return x[0] * y[0] + both * self.a, x[0] * y[1] + x[1] * y[0] + both * self.b

    def inverse(self, x: tuple[Quotient, Quotient]) -> tuple[Quotient, Quotient]:
        """Return what makes 1 with c + d s where this vanishes."""
        if self.a is None:
            return (x[0] + x[1] * self.b).power(-1), self.b * 0
        c, d = x
        size = c * c + c * d * self.b - d * d * self.a
        return (c + d * self.b) / size, -(d / size)


@dataclass(frozen=True, eq=False)
class Coupled:
    """x'' = A x + B x' + f from x = `x0`, x' = `u0`, over one field; solutions note in `granted` what they rest on."""

    there: Anywhere
    granted: Granted
    A: Matrix
    B: Matrix
    f: Vector
    x0: Vector
    u0: Vector

    def course(self, place: int) -> Node:
        """Return the unknown at a place as a formula of time. Raises NoClosedFormError."""
        parts = self._by_modes(place) if self._commutes() else self._by_factors(place)
        return reduce(add, parts, ZERO)

    # --- A and B commute ------------------------------------------------------------------------------------------

    def _commutes(self) -> bool:
        size = range(len(self.A))
        both = ((self._times(self.A, column, self.B), self._times(self.B, column, self.A)) for column in size)
        if not all((a - b).is_zero for x, y in both for a, b in zip(x, y, strict=True)):
            return False
        return all(values is not None for values in (self._values(self.A), self._values(self.B)))

    @staticmethod
    def _times(first: Matrix, column: int, second: Matrix) -> Vector:
        return applied(first, [row[column] for row in second])

    def _values(self, matrix: Matrix) -> Vector | None:
        """Return the different eigenvalues of a matrix, None where not all are real and have formulas."""
        field, size = self.there.forms.field, range(len(matrix))
        if all(x.is_zero for row in matrix for x in row):
            return [field.constant(0)]
        unit = [[field.constant(int(i == j)) for j in size] for i in size]
        none = [[field.constant(0) for _ in size] for _ in size]
        negative = [[-x for x in row] for row in matrix]
        roots = spectrum(Matrices(field, tuple(size), unit, none, negative, {}, balanced=True)).roots
        found = list({root.quotient: None for root in roots})
        return [-x for x in found if x is not None] if None not in found else None

    def _by_modes(self, place: int) -> Iterator[Node]:
        stiff, lossy = self._values(self.A), self._values(self.B)
        assert stiff is not None
        assert lossy is not None
        for alpha in stiff:
            parts = [part_of(self.A, alpha, stiff, vector) for vector in (self.x0, self.u0, self.f)]
            for beta in lossy:
                x, u, f = (part_of(self.B, beta, lossy, vector)[place] for vector in parts)
                if not (x.is_zero and u.is_zero and f.is_zero):
                    yield self._one(alpha, beta, x, u, f)

    def _one(self, a: Quotient, b: Quotient, x: Quotient, u: Quotient, f: Quotient) -> Node:
        """Return the solution of y'' = a y + b y' + f from y = x, y' = u."""
        course = Linear(self.there, self.granted, a, b, f).course(_node(x), _node(u))
        if course is None:
            raise NoClosedFormError("the force is no known function of time")
        return course

    # --- by factors of the characteristic polynomial --------------------------------------------------------------

    def _by_factors(self, place: int) -> Iterator[Node]:
        factors = list(self._factors())
        zero = [x * 0 for x in self.f]
        for factor in factors:
            z, force = (self._part(factor, factors, vector) for vector in ([*self.x0, *self.u0], [*zero, *self.f]))
            pushed, rate = force[place], self._moved(force)[place]
            x, u = z[place], self._moved(z)[place] + self._at_start(pushed)
            driven = rate + self._rate(pushed) - factor.b * pushed
            if x.is_zero and u.is_zero and driven.is_zero:
                continue
            if factor.a is None:
                yield Linear(self.there, self.granted, x * 0, factor.b, driven).fading(x, u)
            else:
                yield self._one(factor.a, factor.b, x, u, driven)

    def _moved(self, z: Vector) -> Vector:
        """Return N z."""
        n = len(self.A)
        x, u = z[:n], z[n:]
        return [*u, *(a + b for a, b in zip(applied(self.A, x), applied(self.B, u), strict=True))]

    def _part(self, factor: Factor, factors: Sequence[Factor], z: Vector) -> Vector:
        """Return P z, what z has of a factor."""
        left = factor.b.field.constant(1), factor.b * 0
        for other in factors:
            if other is not factor:
                moved = self._moved(z)
                if other.a is None:
                    z = [x - other.b * y for x, y in zip(moved, z, strict=True)]
                else:
                    twice = self._moved(moved)
                    z = [w - other.b * x - other.a * y for w, x, y in zip(twice, moved, z, strict=True)]
                left = factor.product(left, other.remainder(factor))
        c, d = factor.inverse(left)
        return [c * y + d * x for x, y in zip(self._moved(z), z, strict=True)]

    def _factors(self) -> Iterator[Factor]:
        """Yield the different factors of det(s^2 - s B - A). Raises NoClosedFormError for those of a higher degree."""
        field = self.there.forms.field
        sizes = (abs(x.sample) for matrix in (self.A, self.B) for row in matrix for x in row)
        s = field.letter(_EXPONENT, Letter(_EXPONENT, sum(sizes, PRECISE.mpf(1))))
        entries = [
            [s * s * int(i == j) - s * b - a for j, (a, b) in enumerate(zip(*rows, strict=True))]
            for i, rows in enumerate(zip(self.A, self.B, strict=True))
        ]
        place = field.position(_EXPONENT)
        assert place is not None
        for p, times in factored(determinant(entries).above)[1]:
            powers = coefficients(field, field.in_ring(p), place)
            if len(powers) > 1:
                yield from _of_degree(powers, times)

    def _rate(self, a: Quotient) -> Quotient:
        """Return the derivative of a function of time."""
        return self._again(derivative(_node(a), TIME)) if not self.there.constant(a) else a * 0

    def _at_start(self, a: Quotient) -> Quotient:
        return self._again(at_start(_node(a))) if not self.there.constant(a) else a

    def _again(self, node: Node) -> Quotient:
        return self.there.forms.of([node])[0]


def _of_degree(powers: Vector, times: int) -> Iterator[Factor]:
    degree = len(powers) - 1
    if degree == _LINEAR:
        root = -(powers[0] / powers[1])
        yield Factor(root, None) if times == 1 else Factor(2 * root, -(root * root))
    elif degree == _QUADRATIC:
        yield Factor(-(powers[1] / powers[2]), -(powers[0] / powers[2]))
    elif degree == _QUARTIC and powers[1].is_zero and powers[3].is_zero:
        half, product = powers[2] / (2 * powers[4]), powers[0] / powers[4]
        apart = half * half - product
        if apart.sample < 0:
            raise NoClosedFormError("the squares of the exponents are complex numbers")
        root = sqrt(apart)
        yield Factor(half * 0, -half - root)
        yield Factor(half * 0, -half + root)
    else:
        raise NoClosedFormError(f"its characteristic polynomial has a factor of degree {degree} without known roots")


def part_of(matrix: Matrix, value: Quotient, values: Vector, vector: Vector) -> Vector:
    """Return what a vector has of a matrix's eigenvalue."""
    for other in values:
        if other is not value:
            moved = applied(matrix, vector)
            vector = [(y - other * x) / (value - other) for x, y in zip(vector, moved, strict=True)]
    return vector


def applied(matrix: Matrix, vector: Vector) -> Vector:
    """Return the product of a matrix and a vector."""
    return [
        reduce(lambda s, pair: s + pair[0] * pair[1], zip(row, vector, strict=True), vector[0] * 0) for row in matrix
    ]


def _node(a: Quotient) -> Node:
    return book_form(doubled(a))
