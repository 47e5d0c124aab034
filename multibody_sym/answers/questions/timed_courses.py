"""Courses of x' = u, u' = f(t, u): linear in u, or separable into a function of the time and one of the speed.

    u' = a(t) u + f(t)      u = E (u0 + integral of f/E),   E = exp(integral of a)
    u' = f(t) g(u)          u = U(tau),   dU/dtau = g(U),   tau = integral of f

x is the integral of u, where that is a function that is known.
"""

from __future__ import annotations

from fractions import Fraction
from functools import reduce

from multibody_sym.algebra.factors import factored
from multibody_sym.algebra.quotients import Quotient
from multibody_sym.algebra.solving.antiderivatives import Antiderivative, antiderivative
from multibody_sym.algebra.solving.roots import rate
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted, at_start
from multibody_sym.answers.questions.naming import put_in
from multibody_sym.answers.questions.separable_courses import BySpeed
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import ZERO, Node, add, multiply, number, power, subtract


@dataclass(frozen=True, eq=False)
class WithTime:
    """A coordinate whose acceleration depends on time and on its speed `u`, from x = `q0`, u = `u0` on."""

    there: Anywhere
    granted: Granted
    u: Node
    q0: Node
    u0: Node

    def speed(self, acceleration: Quotient) -> Node | None:
        """Return u(t), None where u' is of no kind that is known. Raises NoClosedFormError."""
        by_u = rate(acceleration, self.u)
        if self.u in by_u.symbols:
            return self._separated(acceleration)
        return self._linear(by_u, acceleration - by_u * self.there.letter(self.u))

    def way(self, speed: Node) -> Node:
        """Return x(t) of u(t). Raises NoClosedFormError."""
        return add(self.q0, self._integral(self._quotient(speed)))

    # --- linear ---------------------------------------------------------------------------------------------------

    def _linear(self, a: Quotient, f: Quotient) -> Node:
        """Return u of u' = a u + f."""
        factor = self._exponential(self._found(a))
        forced = f / self._quotient(factor)
        return multiply(factor, add(self.u0, self._integral(forced)))

    def _exponential(self, exponent: Antiderivative) -> Node:
        """Return exp(exponent) that is 1 at the start: powers of what logarithms are of."""
        plain = BUILD["exp"](subtract(exponent.plain, at_start(exponent.plain)))
        return reduce(multiply, (self._power(ratio, x) for x, ratio in exponent.logarithms), plain)

    def _power(self, base: Quotient, exponent: Quotient) -> Node:
        node = self.granted.written(base)
        if exponent.above.is_ground and exponent.below.is_ground:
            value = Fraction(int(exponent.above.LC), int(exponent.below.LC))
            if value.denominator == 2:
                return power(BUILD["sqrt"](node), number(value * 2))
            return power(node, number(value))
        return power(node, self.granted.written(exponent))

    # --- separable ------------------------------------------------------------------------------------------------

    def _separated(self, acceleration: Quotient) -> Node | None:
        """Return u of u' = f(t) g(u), None where these are no factors or g is none that is known."""
        timed = self._timed(acceleration)
        rest = acceleration / timed
        if TIME in rest.symbols or self.u in timed.symbols:
            return None
        course = BySpeed(self.there, self.granted, self.u, ZERO, self.u0).course(rest)
        return None if course is None else put_in(course[1], {TIME: self._integral(timed)})

    def _timed(self, a: Quotient) -> Quotient:
        """Return the factors that depend on time."""
        field, found = a.field, a.field.constant(1)
        for p, exponent in ((a.above, 1), (a.below, -1)):
            for factor, times in factored(field.in_ring(p))[1]:
                whole = field.whole(field.in_ring(factor))
                if TIME in whole.symbols:
                    found = found * whole.power(exponent * times)
        return found

    # --- integrals ------------------------------------------------------------------------------------------------

    def _quotient(self, node: Node) -> Quotient:
        return self.there.forms.of([node])[0]

    def _integral(self, a: Quotient) -> Node:
        """Return the integral of a function of time from the start on. Raises NoClosedFormError."""
        found = self._found(a).node
        return subtract(found, at_start(found))

    def _found(self, a: Quotient) -> Antiderivative:
        found = antiderivative(a, TIME)
        for divisor in found.divisors:
            self.granted.differs(divisor)
        return found
