"""Coordinates and speeds as formulas: of the time, where equations of motion have a known solution.

One coordinate at a time, whose acceleration depends on no other one: linear with constant coefficients, or separable.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from fractions import Fraction
from functools import cached_property, reduce
from typing import Final

import numpy as np

from multibody_sym.algebra.antiderivatives import Antiderivative, antiderivative
from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.inequalities import Condition, comparison, reduced, relation
from multibody_sym.algebra.quotient_functions import sign, sqrt
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient, factors_of
from multibody_sym.algebra.roots import rate
from multibody_sym.answers.ask.from_runs import Simulated, state_at
from multibody_sym.answers.ask.named_answers import Anywhere, Granted, anywhere
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME, at_start, put_in
from multibody_sym.derivation.symbolic_start import WORK
from multibody_sym.errors import ExpressionError
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, Node, as_node, multiply, number, power, symbol

# ----------------------------------------------------------------------------------------------------------------------
# Courses of x'' = a x + b x' + f(t) with constant a and b, f a sum of powers of t, exponentials, sines and cosines.
#
# What each term of f drives is found by undetermined coefficients, in resonance with t before it; beside it the free
# motion decays, swings or grows, and where its exponents are equal (critical damping) has t before one of its parts.


_WAVES: Final = ("sin", "cos")
_HIGHEST_POWER: Final = 6


@dataclass(frozen=True, eq=False)
class LinearMotion:
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
            particular = particular + self._emptying(constant)
            constant = constant * 0
        a = self.a * 0 if self.granted.vanishes(self.a) else self.a
        b = self.b * 0 if a.is_zero and self.granted.vanishes(self.b) else self.b
        q1 = q0 - at_start(particular)
        u1 = u0 - at_start(derivative(particular, TIME))
        if a.is_zero and b.is_zero:
            fallen = self.granted.written(constant / 2) * TIME**2
            return q1 + u1 * TIME + (fallen + particular)
        if a.is_zero:
            return self._braked(constant, q1, u1) + particular
        middle = self.granted.written(-constant / a)
        return middle + particular + self._free(q1 - middle, u1)

    def fading(self, q0: Quotient, u0: Quotient) -> Node:
        """Return x(t) of x'' = b x' + `rest`, with the constants that stay of it in one."""
        rest, particular = self._driven()
        if not self.there.constant(rest):
            raise NoClosedFormError("the force is no known function of time")
        particular = particular + self.granted.written(-rest / self.b) * TIME
        start, pace = self.there.forms.of([at_start(particular), at_start(derivative(particular, TIME))])
        faded = (u0 - pace) / self.b
        decay = BUILD["exp"](self.granted.written(self.b) * TIME)
        stays = self.granted.written(q0 - start - faded) + particular
        return stays + self.granted.written(faded) * decay

    # --- without force --------------------------------------------------------------------------------------------

    def _free(self, q: Node, u: Node) -> Node:
        """Return the solution of x'' = a x + b x' that starts at x = q with x' = u."""
        half = self.b / 2
        square = -self.a - half * half
        decay = self.granted.written(half)
        along = u - decay * q
        if self.granted.vanishes(square):
            swing = q + along * TIME
        else:
            turns = sign(square) > 0
            rate = self.granted.written(sqrt(square if turns else -square))
            even, odd = (BUILD["cos"], BUILD["sin"]) if turns else (BUILD["cosh"], BUILD["sinh"])
            phase = rate * TIME
            swing = q * even(phase) + along / rate * odd(phase)
        return swing if half.is_zero else BUILD["exp"](decay * TIME) * swing

    def _braked(self, constant: Quotient, q: Node, u: Node) -> Node:
        written = self.granted.written
        final = written(-constant / self.b)
        faded = 1 - BUILD["exp"](written(self.b) * TIME)
        gone = (u - final) * (written(-self.b.power(-1)) * faded)
        return q + (final * TIME + gone)

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
            driven = driven + answer(amplitude, node, derivative(node.args[0], TIME))
        powers = self._powers(left)
        if len(powers) > 1:
            left = powers[0]
            driven = driven + self._of_powers(powers)
        return left, driven

    def _functions(self) -> Iterator[tuple[Node, int]]:
        """Yield the sines, cosines and exponentials of a multiple of time in the force, with their places as letters.

        Raises NoClosedFormError for others.
        """
        for k, letter in enumerate(tuple(self.rest.field.letters)):
            node = letter.node
            known = node is not None and node.op in (*_WAVES, "exp")
            parts = (self.rest.above, self.rest.below)
            used = any(m[k] for p in parts for m in self.rest.field.in_ring(p))
            if node is not None and known and TIME in _symbols(node) and used:
                if _symbols(derivative(node.args[0], TIME)) & self.there.variables:
                    raise NoClosedFormError("the pace of the force is not constant")
                yield node, k

    def _wave(self, amplitude: Quotient, wave: Node, pace: Node) -> Node:
        (w,) = self.there.forms.of([pace])
        stiff, loss = -self.a - w * w, -self.b * w
        size = stiff * stiff + loss * loss
        angle = wave.args[0]
        other = -BUILD["cos"](angle) if wave.op == "sin" else BUILD["sin"](angle)
        if size.vanishes:  # in resonance without damping: it grows with the time
            if not (self.b.is_zero or self.granted.vanishes(self.b)):
                raise NoClosedFormError("a divisor vanishes at the given values")
            self.granted.vanishes(stiff)
            return self.granted.written(amplitude * self.there.letter(TIME) / (2 * w)) * other
        if loss.is_zero and not self.a.is_zero:
            self.granted.differs(stiff)
        along, across = amplitude * stiff / size, amplitude * loss / size
        return self.granted.written(along) * wave + self.granted.written(across) * other

    def _growing(self, amplitude: Quotient, wave: Node, pace: Node) -> Node:
        (r,) = self.there.forms.of([pace])
        divisors = [r * r - self.b * r - self.a, 2 * r - self.b, r.field.constant(2)]
        for k, divisor in enumerate(divisors):
            if not self.granted.vanishes(divisor):
                self.granted.differs(divisor)
                return self.granted.written(amplitude / divisor) * (power(TIME, as_node(k)) * wave)
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
        terms = (self.granted.written(x) * power(TIME, as_node(n)) for n, x in found.items() if not x.is_zero)
        return sum(terms, ZERO)

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
        left = written(e / f) + TIME
        ratio = written(e + f * time) / written(e)
        emptied = left * BUILD["log"](ratio) - TIME
        return written(c / 2) * TIME**2 + written(d / f) * emptied


def _symbols(node: Node) -> frozenset[Node]:
    return frozenset(leaves([node], "symbol"))


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


# ----------------------------------------------------------------------------------------------------------------------
# Courses of u' = f(u), x' = u, by separating the variables.
#
#     u' = c + b u + s u^2    without c: 1/u is linear in exp(b t) (Bernoulli); else u + b/(2 s) goes by tanh, coth, tan
#     u' = s u^n              u^(1 - n) is linear in t: drag of any power, and the car of constant power (n = -1)


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
            c = acceleration - b * u - s * u * u
            if not self.granted.vanishes(s):
                return self._by_square(c, b, s)
            way = LinearMotion(self.there, self.granted, s * 0, b, c).course(self.q0, self.u0)
            return None if way is None else (way, derivative(way, TIME))
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
        start = self.u0 + self.granted.written(shift)
        if self.granted.vanishes(d):
            gone, speed = self._slowing(s, start)
        else:
            gone, speed = self._by_constant(d, s, start)
        drift = self.granted.written(shift)
        return self.q0 + gone - drift * TIME, speed - drift

    def _slowing(self, s: Quotient, w: Node) -> tuple[Node, Node]:
        left = 1 - self.granted.written(s) * w * TIME
        return self.granted.written(-s.power(-1)) * BUILD["log"](left), w / left

    def _bernoulli(self, b: Quotient, s: Quotient) -> tuple[Node, Node]:
        if self.u0 is ZERO:
            return self.q0, ZERO
        if b.is_zero or self.granted.vanishes(b):
            gone, speed = self._slowing(s, self.u0)
            return self.q0 + gone, speed
        fading = BUILD["exp"](self.granted.written(b) * TIME)
        left = 1 + self.granted.written(s / b) * self.u0 * (1 - fading)
        gone = self.granted.written(-s.power(-1)) * BUILD["log"](left)
        return self.q0 + gone, self.u0 * fading / left

    def _by_constant(self, d: Quotient, s: Quotient, w: Node) -> tuple[Node, Node]:
        """Return the way and the speed of w' = d + s w^2.

        w = V tanh(z), V coth(z) or V tan(z), where z grows at the pace sqrt(|d s|) and V = sqrt(|d / s|).
        """
        pace, final = sqrt(_positive(d * s)), sqrt(_positive(d / s))
        falls = sign(d * s) < 0
        most, is_coth = self.granted.written(final if sign(d) > 0 else -final), False
        if not falls:
            odd, even, inverse = BUILD["tan"], BUILD["cos"], BUILD["atan"](w / most)
        else:
            (start,) = self.there.forms.of([w])
            room = d / s + start * start  # negative below the final speed, where s and d have different signs
            if self.granted.vanishes(room):
                return w * TIME, w
            below = room.is_zero or sign(room) < 0
            odd, even = BUILD["tanh"], BUILD["cosh" if below else "sinh"]
            x = w / most if below else most / w
            is_coth, inverse = not below, ZERO
            if x is not ZERO:
                inverse = BUILD["log"]((1 + x) / (1 - x)) / 2  # artanh x
        phase = inverse + self.granted.written(pace) * TIME
        gone = BUILD["log"](even(phase) / even(inverse))
        ratio = 1 / odd(phase) if is_coth else odd(phase)
        return self.granted.written(-s.power(-1)) * gone, most * ratio

    # --- s u^n ----------------------------------------------------------------------------------------------------

    def _by_power(self, s: Quotient, n: int) -> tuple[Node, Node]:
        """Return x(t), u(t) of u' = s u^n for n other than 0, 1 and 2: u^(1 - n) = u0^(1 - n) + (1 - n) s t."""
        grown = power(self.u0, as_node(1 - n)) + self.granted.written(s * (1 - n)) * TIME
        speed = _power_of_positive(grown, Fraction(1, 1 - n))
        way = _power_of_positive(grown, Fraction(2 - n, 1 - n)) - power(self.u0, as_node(2 - n))
        return self.q0 + self.granted.written((s * (2 - n)).power(-1)) * way, speed


def _power_of_positive(base: Node, exponent: Fraction) -> Node:
    if exponent.denominator == 2:
        root = BUILD["sqrt"](base)
        return 1 / root**-exponent.numerator if exponent < 0 else root**exponent.numerator
    return power(base, number(exponent))


def _positive(a: Quotient) -> Quotient:
    """Return |a| by its sign at the sample."""
    return a if sign(a) > 0 else -a


# ----------------------------------------------------------------------------------------------------------------------
# Courses of x' = u, u' = f(t, u): linear in u, or separable into a function of the time and one of the speed.
#
#     u' = a(t) u + f(t)      u = E (u0 + integral of f/E),   E = exp(integral of a)
#     u' = f(t) g(u)          u = U(tau),   dU/dtau = g(U),   tau = integral of f
#
# x is the integral of u, where that is a function that is known.


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
        return self.q0 + self._integral(self._quotient(speed))

    # --- linear ---------------------------------------------------------------------------------------------------

    def _linear(self, a: Quotient, f: Quotient) -> Node:
        factor = self._exponential(self._found(a))
        forced = f / self._quotient(factor)
        return factor * (self.u0 + self._integral(forced))

    def _exponential(self, exponent: Antiderivative) -> Node:
        """Return exp(exponent) that is 1 at the start: powers of what logarithms are of."""
        plain = BUILD["exp"](exponent.plain - at_start(exponent.plain))
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
            for factor, times in factors_of(field.in_ring(p))[1]:
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
        return found - at_start(found)

    def _found(self, a: Quotient) -> Antiderivative:
        found = antiderivative(a, TIME)
        for divisor in found.divisors:
            self.granted.differs(divisor)
        return found


# ----------------------------------------------------------------------------------------------------------------------

_LOOKS: Final = 41
FITS: Final = 1e-7
"""To which part of the largest value a formula is what a run shows."""
_SIGNS: Final = 101
_NO_SPEED: Final = 1e-9
"""The part of its largest value below which what has a sign in the equations is zero."""
_NO_TIME: Final = 1e-12
"""The part of a run before whose end a state that changes has not lasted at all."""
_FIRST_LOOK: Final = 40
"""The first sample at which it is looked for equations whose signs hold from the start on."""


@dataclass(frozen=True, eq=False)
class InTime:
    """A coordinate or speed as a `formula` of t, which takes for granted what is `granted`.

    It holds until a time `until` (None: as long as was looked) at which the sign `ending` fails, as that of a speed.
    """

    formula: Node
    granted: Granted
    until: float | None = None
    ending: str = ""

    def conditions(self) -> Iterator[str]:
        """Yield what is to hold of parameters and of time, for people."""
        yield from map(str, least_conditions(self.granted.positive))
        for word, group in (("==", self.granted.equal), ("!=", self.granted.unequal)):
            yield from dict.fromkeys(relation(x, word) for x in group)
        if self.until is not None:
            yield f"while {self.ending}, until t = {self.until:.6g} s"


def formulas_of_time(there: Anywhere) -> Mapping[Node, InTime]:
    """Return coordinates and speeds, by their symbols, as formulas of t, where equations have a known solution."""
    mechanism, state = there.solved.mechanism, there.solved.nodes.motion.state
    found: dict[Node, InTime] = {}
    for k, (coordinate, speed) in enumerate(zip(mechanism.coordinates, mechanism.speeds, strict=True)):
        q, u = symbol(coordinate.name), symbol(speed.name)
        granted = Granted()
        with suppress(NoClosedFormError), there.assuming(granted):
            found |= _course(there, granted, k, (q, u), (as_node(state.q[k]), as_node(state.u[k])))
    return found


@dataclass(frozen=True, eq=False)
class ShownMotion:
    """A `run` up to its sample `last`, where a state changes first, and the equations `there` as they begin."""

    solved: SolvedInstant
    run: Trajectory
    last: int
    there: Anywhere | None
    _differ: dict[Quotient, bool] = field(default_factory=dict)

    @classmethod
    def of(cls, solved: SolvedInstant, motion: Simulated) -> ShownMotion:
        """Return what a run shows of a solved system: its equations half way, or earlier where signs differ."""
        run = motion.whole
        until = min((float(change["t"]) for change in run.changes), default=run.t_final)
        last = int(np.searchsorted(run.t, until, side="right")) - 1
        found = cls(solved, run, last, None)
        place = last // 2
        while until > _NO_TIME * run.t_final:
            there = anywhere(solved, *state_at(run, solved.mechanism, place))
            found = cls(solved, run, last, there)
            if there is None or place < _FIRST_LOOK or not found._ends_before(place):
                return found
            place //= 4
        return found

    def _ends_before(self, place: int) -> bool:
        return min(self._signs.values(), default=math.inf) <= float(self.run.t[place])

    @cached_property
    def _signs(self) -> dict[Quotient, float]:
        """The times from which on signs of what moves are others than in the equations, where they come to that."""
        found = {}
        for positive in self.there.forms.field.positive if self.there is not None else ():
            if self.there is not None and not self.there.constant(positive):
                time = self._fails(book_form(positive))
                if time is not None:
                    found[positive] = time
        return found

    def _fails(self, node: Node) -> float | None:
        """Return the time at which what is positive turns negative, None where it does not."""
        looked = np.unique(np.linspace(0, self.last, _SIGNS).astype(int))
        values = self._values(node, looked)
        little = _NO_SPEED * float(np.abs(values).max())
        others = np.flatnonzero(~(values >= -little))
        if not len(others):
            return None
        near = np.arange(looked[max(others[0] - 1, 0)], looked[others[0]] + 1)
        values = self._values(node, near)
        k = int(np.flatnonzero(~(values >= -little))[0])
        if k == 0:
            return 0.0
        t, (before, after) = self.run.t[near[k - 1 : k + 1]], values[k - 1 : k + 1]
        return float(t[0] + (t[1] - t[0]) * before / (before - after)) if np.isfinite(after) else float(t[0])

    def _values(self, node: Node, looked: Sequence[int] | Floats) -> Floats:
        assert self.there is not None
        named = {*leaves([node], "symbol")} & self.there.variables - {TIME}
        series = {TIME: self.run.t, **{x: self.run[str(x.data)] for x in named}}
        known = self.solved.sample
        return np.array(
            [evaluate_float([node], {**known, **{x: float(y[k]) for x, y in series.items()}})[0] for k in looked]
        )

    def _matters(self, positive: Quotient) -> bool:
        """Return whether the equations are others where a sign fails: that of the length of a damper has no say."""
        if positive not in self._differ:
            node, looked = book_form(positive), np.unique(np.linspace(0, self.last, _SIGNS).astype(int))
            place = int(looked[int(np.argmin(self._values(node, looked)))])
            other = anywhere(self.solved, *state_at(self.run, self.solved.mechanism, place))
            pairs = zip(self.there.forms.udot, other.forms.udot, strict=True) if self.there and other else None
            kept = other is None or any(book_form(x) is node for x in other.forms.field.positive)
            self._differ[positive] = kept or any(book_form(a) is not book_form(b) for a, b in pairs or ())
        return self._differ[positive]

    def confirmed(self, formulas: Mapping[Node, InTime]) -> dict[Node, InTime]:
        """Return formulas of time without those that are not what the run shows."""
        found = {}
        for node, each in formulas.items():
            until, ending = self._end(node)
            last = self.last if until is None else int(np.searchsorted(self.run.t, until)) - 1
            looked = np.unique(np.linspace(0, max(last, 0), _LOOKS).astype(int))
            shown = self.run[str(node.data)][looked]
            known = self.solved.sample
            try:
                told = [evaluate_float([each.formula], {**known, TIME: float(x)})[0] for x in self.run.t[looked]]
            except (ExpressionError, *UNDEFINED):
                continue
            if np.abs(np.array(told) - shown).max() <= FITS * max(1e-300, float(np.abs(shown).max())):
                found[node] = replace(each, until=until, ending=ending)
        return found

    def _end(self, node: Node) -> tuple[float | None, str]:
        """Return until when formulas of a coordinate, or a speed, hold for its signs, and the sign that fails then."""
        mechanism = self.solved.mechanism
        names = zip(mechanism.coordinates, mechanism.speeds, strict=True)
        own = next({symbol(q.name), symbol(u.name)} for q, u in names if node.data in (q.name, u.name))
        ends = [(time, comparison(x)) for x, time in self._signs.items() if own & x.symbols and self._matters(x)]
        return min(ends, default=(None, ""), key=lambda each: each[0] or 0.0)


def least_conditions(positive: Sequence[Quotient]) -> list[Condition]:
    """Return as few conditions as say that quotients are positive."""
    if not positive:
        return []
    positive[0].field.work += WORK
    conditions = [Condition(x, strict=True, under_root=True) for x in positive]
    try:
        return reduced(conditions)
    except NoClosedFormError:
        return conditions


def _course(
    there: Anywhere, granted: Granted, k: int, own: tuple[Node, Node], start: tuple[Node, Node]
) -> dict[Node, InTime]:
    """Return a coordinate and its speed, `own`, from a `start` on as formulas of time, as far as they are known."""
    acceleration, (q, u) = there.forms.udot[k], own
    if acceleration.symbols & (there.variables - {q, u, TIME}):
        return {}
    by_q, by_u = rate(acceleration, q), rate(acceleration, u)
    course: tuple[Node, Node] | None = None
    if there.constant(by_u) and there.constant(by_q):
        rest = acceleration - by_q * there.letter(q) - by_u * there.letter(u)
        with suppress(NoClosedFormError):
            way = LinearMotion(there, granted, by_q, by_u, rest).course(*start)
            course = None if way is None else (way, derivative(way, TIME))
    elif by_q.is_zero and TIME not in acceleration.symbols:
        course = BySpeed(there, granted, u, *start).course(acceleration)
    if course is not None:
        return {node: InTime(formula, granted) for node, formula in zip(own, course, strict=True)}
    speed = WithTime(there, granted, u, *start).speed(acceleration) if by_q.is_zero else None
    if speed is None:
        return {}
    found = {u: InTime(speed, granted)}
    more = replace(granted, equal=[*granted.equal], unequal=[*granted.unequal])
    with suppress(NoClosedFormError):  # where the integral of the speed is not known
        found[q] = InTime(WithTime(there, more, u, *start).way(speed), more)
    return found
