"""Courses of x'' = a x + b x' + f(t) with constant a and b, f a sum of powers of t, exponentials, sines and cosines.

What each term of f drives is found by undetermined coefficients, in resonance with t before it; beside it the free
motion decays, swings or grows, and where its exponents are equal (critical damping) has t before one of its parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from typing import Final

from multibody_sym.algebra.quotient_functions import sign, sqrt
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.questions.anywhere import TIME, Anywhere, Granted, at_start
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import ONE, TWO, ZERO, Node, add, as_node, divide, multiply, negate, power, subtract
from multibody_sym.scalars.traversal import leaves

_WAVES: Final = ("sin", "cos")
_HIGHEST_POWER: Final = 6


@dataclass(frozen=True, eq=False)
class Linear:
    """x'' = a x + b x' + `rest`, of time alone; what its solutions take for granted is noted in `granted`."""

    there: Anywhere
    granted: Granted
    a: Quotient
    b: Quotient
    rest: Quotient

    def course(self, q0: Node, u0: Node) -> Node | None:
        """Return x(t) from x = q0, x' = u0: a particular solution and the free motion; None for other forces."""
        constant, particular = self._driven()
        if not self.there.constant(constant):
            particular = add(particular, self._emptying(constant))
            constant = constant * 0
        a, b = self.a, self.b
        q1 = subtract(q0, at_start(particular))
        u1 = subtract(u0, at_start(derivative(particular, TIME)))
        if a.is_zero and b.is_zero:
            fallen = multiply(self.granted.written(constant / 2), power(TIME, TWO))
            return add(add(q1, multiply(u1, TIME)), add(fallen, particular))
        if a.is_zero:
            return add(self._braked(constant, q1, u1), particular)
        middle = self.granted.written(-constant / a)
        return add(add(middle, particular), self._free(subtract(q1, middle), u1))

    def fading(self, q0: Quotient, u0: Quotient) -> Node:
        """Return x(t) of x'' = b x' + `rest`, with the constants that stay of it in one."""
        rest, particular = self._driven()
        if not self.there.constant(rest):
            raise NoClosedFormError("the force is no known function of time")
        particular = add(particular, multiply(self.granted.written(-rest / self.b), TIME))
        start, pace = self.there.forms.of([at_start(particular), at_start(derivative(particular, TIME))])
        faded = (u0 - pace) / self.b
        decay = BUILD["exp"](multiply(self.granted.written(self.b), TIME))
        stays = add(self.granted.written(q0 - start - faded), particular)
        return add(stays, multiply(self.granted.written(faded), decay))

    # --- without force --------------------------------------------------------------------------------------------

    def _free(self, q: Node, u: Node) -> Node:
        """Return the solution of x'' = a x + b x' that starts at x = q with x' = u."""
        half = self.b / 2
        square = -self.a - half * half
        decay = self.granted.written(half)
        along = subtract(u, multiply(decay, q))
        if self.granted.vanishes(square):
            swing = add(q, multiply(along, TIME))
        else:
            turns = sign(square) > 0
            rate = self.granted.written(sqrt(square if turns else -square))
            even, odd = (BUILD["cos"], BUILD["sin"]) if turns else (BUILD["cosh"], BUILD["sinh"])
            phase = multiply(rate, TIME)
            swing = add(multiply(q, even(phase)), multiply(divide(along, rate), odd(phase)))
        return swing if half.is_zero else multiply(BUILD["exp"](multiply(decay, TIME)), swing)

    def _braked(self, constant: Quotient, q: Node, u: Node) -> Node:
        """Return the solution of x'' = b x' + constant."""
        written = self.granted.written
        final = written(-constant / self.b)
        faded = subtract(ONE, BUILD["exp"](multiply(written(self.b), TIME)))
        gone = multiply(subtract(u, final), multiply(written(-self.b.power(-1)), faded))
        return add(q, add(multiply(final, TIME), gone))

    # --- particular solutions -------------------------------------------------------------------------------------

    def _driven(self) -> tuple[Quotient, Node]:
        """Return what is left of the force when known terms have been taken out, and what these drive."""
        left, driven = self.rest, ZERO
        for node, place in self._functions():
            amplitude = _coefficients(left, place).get(1)
            if amplitude is None or not self.there.constant(amplitude):
                continue
            left = left - amplitude * left.field.whole(left.field.ring.gens[place])
            answer = self._wave if node.op in _WAVES else self._growing
            driven = add(driven, answer(amplitude, node, derivative(node.args[0], TIME)))
        powers = self._powers(left)
        if len(powers) > 1:
            left = powers[0]
            driven = add(driven, self._of_powers(powers))
        return left, driven

    def _functions(self) -> Iterator[tuple[Node, int]]:
        """Yield the sines, cosines and exponentials of a multiple of time in the force, with their places as letters.

        Raises NoClosedFormError for others.
        """
        for k, letter in enumerate(tuple(self.rest.field.letters)):
            node = letter.node
            known = node is not None and node.op in (*_WAVES, "exp")
            if node is not None and known and TIME in _symbols(node) and _uses(self.rest, k):
                if _symbols(derivative(node.args[0], TIME)) & self.there.variables:
                    raise NoClosedFormError("the pace of the force is not constant")
                yield node, k

    def _wave(self, amplitude: Quotient, wave: Node, pace: Node) -> Node:
        """Return a particular solution for amplitude * wave."""
        (w,) = self.there.forms.of([pace])
        stiff, loss = -self.a - w * w, -self.b * w
        size = stiff * stiff + loss * loss
        angle = wave.args[0]
        other = negate(BUILD["cos"](angle)) if wave.op == "sin" else BUILD["sin"](angle)
        if size.vanishes:  # in resonance without damping: it grows with the time
            if not (self.b.is_zero or self.granted.vanishes(self.b)):
                raise NoClosedFormError("a divisor vanishes at the given values")
            self.granted.vanishes(stiff)
            return multiply(self.granted.written(amplitude * self.there.letter(TIME) / (2 * w)), other)
        if loss.is_zero and not self.a.is_zero:
            self.granted.differs(stiff)
        along, across = amplitude * stiff / size, amplitude * loss / size
        return add(multiply(self.granted.written(along), wave), multiply(self.granted.written(across), other))

    def _growing(self, amplitude: Quotient, wave: Node, pace: Node) -> Node:
        """Return a particular solution for amplitude * exp(r t + p)."""
        (r,) = self.there.forms.of([pace])
        divisors = [r * r - self.b * r - self.a, 2 * r - self.b, r.field.constant(2)]
        for k, divisor in enumerate(divisors):
            if not self.granted.vanishes(divisor):
                self.granted.differs(divisor)
                return multiply(self.granted.written(amplitude / divisor), multiply(power(TIME, as_node(k)), wave))
        raise AssertionError("2 is not zero")

    def _powers(self, force: Quotient) -> list[Quotient]:
        """Return the coefficients of the powers of time in a force, lowest first, one alone where it is no sum of such.

        Raises NoClosedFormError for high powers.
        """
        place = self.rest.field.position(TIME)
        found = {} if place is None else _coefficients(force, place)
        if not found or not all(self.there.constant(x) for x in found.values()):
            return [force]
        if max(found) > _HIGHEST_POWER:
            raise NoClosedFormError("the force is a high power of time")
        return [found.get(n, force * 0) for n in range(max(found) + 1)]

    def _of_powers(self, powers: list[Quotient]) -> Node:
        """Return a particular solution for powers of time from the first on: -a x - b x' + x'' = f, power by power."""
        a, b, zero = self.a, self.b, powers[0] * 0
        found = dict.fromkeys(range(len(powers) + 4), zero)
        shift = 0 if not a.is_zero else 1 if not b.is_zero else 2
        for n in range(len(powers) - 1, -1, -1):
            p = powers[n] if n else zero
            twice, once = (n + 2) * (n + 1) * found[n + 2], (n + 1) * found[n + 1]
            if shift == 0:
                found[n] = (twice - b * once - p) / a
            elif shift == 1:
                found[n + 1] = (twice - p) / (b * (n + 1))
            else:
                found[n + 2] = p / ((n + 2) * (n + 1))
        terms = (multiply(self.granted.written(x), power(TIME, as_node(n))) for n, x in found.items() if not x.is_zero)
        return reduce(add, terms, ZERO)

    def _emptying(self, force: Quotient) -> Node:
        """Return the particular solution, from rest at 0, for c + d/(e + f t): what pushes a mass that empties.

        Raises NoClosedFormError for other forces.
        """
        place = self.rest.field.position(TIME)
        below = {} if place is None else _powers_of(force.field.whole(force.below), place)
        alone = self.a.is_zero and self.b.is_zero
        if set(below) != {0, 1} or not (alone and all(map(self.there.constant, below.values()))):
            raise NoClosedFormError("the force is no known function of time")
        e, f = below[0], below[1]
        time = self.there.letter(TIME)
        above = _powers_of(force.field.whole(force.above), place or 0)
        d = reduce(lambda total, each: total + each[1] * (-e / f).power(each[0]), above.items(), e * 0)
        c = force - d / (e + f * time)
        if not (self.there.constant(c) and self.there.constant(d)):
            raise NoClosedFormError("the force is no known function of time")
        written = self.granted.written
        left = add(written(e / f), TIME)
        ratio = divide(written(e + f * time), written(e))
        emptied = subtract(multiply(left, BUILD["log"](ratio)), TIME)
        return add(multiply(written(c / 2), power(TIME, TWO)), multiply(written(d / f), emptied))


def _symbols(node: Node) -> frozenset[Node]:
    return frozenset(leaves([node], "symbol"))


def _uses(a: Quotient, k: int) -> bool:
    return any(m[k] for p in (a.above, a.below) for m in a.field.in_ring(p))


def _coefficients(a: Quotient, k: int) -> dict[int, Quotient]:
    """Return the coefficients of the powers of the letter at a place in a quotient; none where it stands below."""
    field = a.field
    if any(m[k] for m in field.in_ring(a.below)):
        return {}
    below = field.whole(a.below)
    return {n: x / below for n, x in _powers_of(field.whole(a.above), k).items()}


def _powers_of(a: Quotient, k: int) -> dict[int, Quotient]:
    """Return the coefficients of the powers of the letter at a place in a polynomial."""
    field = a.field
    parts: dict[int, dict[tuple[int, ...], int]] = {}
    for m, c in field.in_ring(a.above).items():
        parts.setdefault(m[k], {})[(*m[:k], 0, *m[k + 1 :])] = c
    return {n: field.whole(field.ring.from_dict(part)) for n, part in parts.items()}
