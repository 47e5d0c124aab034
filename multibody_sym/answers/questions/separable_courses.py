"""Courses of u' = f(u), x' = u, by separating the variables.

    u' = c + b u + s u^2    without c: 1/u is linear in exp(b t) (Bernoulli); else u + b/(2 s) goes by tanh, coth or tan
    u' = s u^n              u^(1 - n) is linear in t: drag of any power, and the car of constant power (n = -1)
"""

from __future__ import annotations

from fractions import Fraction
from typing import Final

from multibody_sym.algebra.quotient_functions import sign, sqrt
from multibody_sym.algebra.quotients import Quotient
from multibody_sym.algebra.solving.roots import rate
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import ONE, TWO, ZERO, Node, add, as_node, divide, multiply, number, power, subtract

_POWERS: Final = (-3, -2, -1, 3, 4, 5)


@dataclass(frozen=True, eq=False)
class BySpeed:
    """A coordinate whose acceleration depends on its speed `u` alone, from x = `q0`, u = `u0` on."""

    there: Anywhere
    granted: Granted
    u: Node
    q0: Node
    u0: Node

    def course(self, acceleration: Quotient) -> tuple[Node, Node] | None:
        """Return x(t) and u(t), None where f(u) is none that is known. Raises NoClosedFormError."""
        u, constant = self.there.letter(self.u), self.there.constant
        by_u = rate(acceleration, self.u)
        s = rate(by_u, self.u) / 2
        if constant(s) and not s.is_zero:
            b = by_u - 2 * s * u
            return self._by_square(acceleration - b * u - s * u * u, b, s)
        for n in _POWERS:
            factor = acceleration * u.power(-n)
            if constant(factor) and self.u0 is not ZERO:
                return self._by_power(factor, n)
        return None

    # --- c + b u + s u^2 ------------------------------------------------------------------------------------------

    def _by_square(self, c: Quotient, b: Quotient, s: Quotient) -> tuple[Node, Node]:
        if c.is_zero:
            return self._bernoulli(b, s)
        shift = b / (2 * s)
        d = c - b * shift / 2
        start = add(self.u0, self.granted.written(shift))
        if self.granted.vanishes(d):
            gone, speed = self._slowing(s, start)
        else:
            gone, speed = self._by_constant(d, s, start)
        drift = self.granted.written(shift)
        return subtract(add(self.q0, gone), multiply(drift, TIME)), subtract(speed, drift)

    def _slowing(self, s: Quotient, w: Node) -> tuple[Node, Node]:
        """Return the way and the speed of w' = s w^2."""
        left = subtract(ONE, multiply(multiply(self.granted.written(s), w), TIME))
        return multiply(self.granted.written(-s.power(-1)), BUILD["log"](left)), divide(w, left)

    def _bernoulli(self, b: Quotient, s: Quotient) -> tuple[Node, Node]:
        """Return x(t), u(t) of u' = b u + s u^2."""
        if self.u0 is ZERO:
            return self.q0, ZERO
        if b.is_zero or self.granted.vanishes(b):
            gone, speed = self._slowing(s, self.u0)
            return add(self.q0, gone), speed
        fading = BUILD["exp"](multiply(self.granted.written(b), TIME))
        left = add(ONE, multiply(multiply(self.granted.written(s / b), self.u0), subtract(ONE, fading)))
        gone = multiply(self.granted.written(-s.power(-1)), BUILD["log"](left))
        return add(self.q0, gone), divide(multiply(self.u0, fading), left)

    def _by_constant(self, d: Quotient, s: Quotient, w: Node) -> tuple[Node, Node]:
        """Return the way and the speed of w' = d + s w^2.

        w = V tanh(z), V coth(z) or V tan(z), where z grows at the pace sqrt(|d s|) and V = sqrt(|d / s|).
        """
        pace, final = sqrt(_positive(d * s)), sqrt(_positive(d / s))
        falls = sign(d * s) < 0
        most = self.granted.written(final if sign(d) > 0 else -final)
        if not falls:
            odd, even, inverse = BUILD["tan"], BUILD["cos"], BUILD["atan"](divide(w, most))
        else:
            (start,) = self.there.forms.of([w])
            room = d / s + start * start  # negative below the final speed, where s and d have different signs
            if self.granted.vanishes(room):
                return multiply(w, TIME), w
            below = room.is_zero or sign(room) < 0
            odd, even = (BUILD["tanh"], BUILD["cosh"]) if below else (_coth, BUILD["sinh"])
            inverse = _artanh(divide(w, most) if below else divide(most, w))
        phase = add(inverse, multiply(self.granted.written(pace), TIME))
        gone = BUILD["log"](divide(even(phase), even(inverse)))
        return multiply(self.granted.written(-s.power(-1)), gone), multiply(most, odd(phase))

    # --- s u^n ----------------------------------------------------------------------------------------------------

    def _by_power(self, s: Quotient, n: int) -> tuple[Node, Node]:
        """Return x(t), u(t) of u' = s u^n for n other than 0, 1 and 2: u^(1 - n) = u0^(1 - n) + (1 - n) s t."""
        grown = add(power(self.u0, as_node(1 - n)), multiply(self.granted.written(s * (1 - n)), TIME))
        speed = _rooted(grown, Fraction(1, 1 - n))
        way = subtract(_rooted(grown, Fraction(2 - n, 1 - n)), power(self.u0, as_node(2 - n)))
        return add(self.q0, multiply(self.granted.written((s * (2 - n)).power(-1)), way)), speed


def _rooted(base: Node, exponent: Fraction) -> Node:
    """Return a power of what is positive."""
    if exponent.denominator == 2:
        root = BUILD["sqrt"](base)
        return divide(ONE, _whole(root, -exponent.numerator)) if exponent < 0 else _whole(root, exponent.numerator)
    return power(base, number(exponent))


def _whole(base: Node, exponent: int) -> Node:
    return power(base, as_node(exponent)) if exponent != 1 else base


def _positive(a: Quotient) -> Quotient:
    """Return |a| by its sign at the sample."""
    return a if sign(a) > 0 else -a


def _artanh(x: Node) -> Node:
    if x is ZERO:
        return ZERO
    return divide(BUILD["log"](divide(add(ONE, x), subtract(ONE, x))), TWO)


def _coth(x: Node) -> Node:
    return divide(ONE, BUILD["tanh"](x))
