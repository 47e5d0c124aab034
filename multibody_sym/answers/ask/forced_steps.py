"""The steps of steady motions: the linear equations, the motion put in, and what follows for amplitude and phase.

In: a ForcedMotion and a coordinate. Out: lines. One freedom is solved by sines and cosines, undamped ones by amplitudes
with a sign, damped ones by complex amplitudes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property, reduce
from typing import Final

from multibody_sym.algebra.quotients import Quotient
from multibody_sym.analysis.deviations import deviation_names
from multibody_sym.analysis.modes.forced import ForcedMotion, at_frequency
from multibody_sym.analysis.modes.matrices import Matrices
from multibody_sym.analysis.modes.record import determinant
from multibody_sym.analysis.modes.small_motion import SmallMotion, state_values
from multibody_sym.answers.ask.working import IMAGINARY, OMEGA_0, ZETA, equation, written
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import TWO, ZERO, Node, add, divide, multiply, negate, subtract, symbol
from multibody_sym.text.printer import text

Complex = tuple[Quotient, Quotient]
_PHASES: Final = ("phi", "beta", "delta", "eta")
"""Letters of a phase and of an angle, in the order of preference: the first two that the model does not have."""


def place_of_motion(small: SmallMotion) -> str:
    """Return the state about which motions are small, in words."""
    state = state_values(small.mechanism, small.place.begin, small.state)
    return f"the {small.place.kind} at {', '.join(f'{name} = {value}' for name, value in state.items())}"


def as_complex(part: Complex) -> Node:
    """Return a + i b as an expression."""
    real, imaginary = part
    if imaginary.is_zero:
        return written(real)
    turned = multiply(IMAGINARY, written(imaginary))
    return turned if real.is_zero else add(written(real), turned)


def free_equations(given: Matrices, names: Sequence[str]) -> list[Node]:
    """Return M x'' + C x' + K x row by row."""
    return [
        reduce(add, (
            multiply(written(x), symbol(name + dots))
            for row, dots in zip(rows, ("''", "'", ""), strict=True)
            for x, name in zip(row, names, strict=True)
            if not x.is_zero
        ), ZERO)
        for rows in zip(given.mass, given.rates, given.stiffness, strict=True)
    ]


class SteadySteps:
    """How a book finds the steady motion of a coordinate under one harmonic input."""

    def __init__(self, forced: ForcedMotion, coordinate: str) -> None:
        self.forced, self.coordinate = forced, coordinate
        self.given, self.names = forced.matrices, forced.small.names
        taken = {str(node.data) for node in forced.small.mechanism.symbols}
        free = [letter for letter in _PHASES if letter not in taken]
        self.phase, self.angle = map(symbol, [*free, free_name("lag", taken), free_name("angle", taken)][:2])
        self.amplitudes = [
            symbol(free_name("X" if len(self.names) == 1 else f"X_{name}", taken)) for name in self.names
        ]
        place = deviation_names(forced.small.mechanism).index(coordinate)
        self._follows = [tangent[place] for tangent in self.given.tangents]

    @cached_property
    def _omega(self) -> Quotient:
        return self.forced.exact(self.forced.drive.frequency)

    @cached_property
    def _stiffness(self) -> list[list[Complex]]:
        """K - w^2 M and w C."""
        w, given = self._omega, self.given
        triples = zip(given.mass, given.rates, given.stiffness, strict=True)
        return [[(c - w * w * a, w * b) for a, b, c in zip(*rows, strict=True)] for rows in triples]

    @cached_property
    def _force(self) -> list[Complex]:
        """(f0 - w^2 f2) F0 and w f1 F0."""
        w, size = self._omega, self.forced.exact(self.forced.drive.amplitude)
        return [(size * (a - w * w * c), size * w * b) for a, b, c in zip(*self.forced.forces, strict=True)]

    @property
    def is_in_phase(self) -> bool:
        """Whether all moves in phase with the input or against it: nothing is damped, and no damper moved."""
        return all(b.is_zero for row in (*self._stiffness, self._force) for _, b in row)

    @property
    def has_phase(self) -> bool:
        """Whether sines and cosines are compared, of the coordinate that is the one freedom."""
        return len(self.names) == 1 and self.names[0] == self.coordinate and not self.is_in_phase

    def lines(self) -> Iterator[Line]:
        """Yield the linear equations, the motion put in, and the equations of its amplitudes."""
        small = self.forced.small
        if not self.forced.is_linear:
            about = f"linearised about {place_of_motion(small)}, each coordinate counted from there"
            yield Sentence((f"{about}; products of small terms are left out, sines are angles, cosines 1",))
        elif small.place.found or any(small.place.begin.q):
            yield Sentence((f"coordinates counted from {place_of_motion(small)}",))
        yield from self._equations()
        if self.has_phase:
            yield from self._by_sines()
        elif self.is_in_phase:
            yield from self._in_phase()
        else:
            yield from self._by_complex_amplitudes()

    def _equations(self) -> Iterator[Line]:
        """Yield M x'' + C x' + K x = f0 F + f1 F' + f2 F'' row by row."""
        drive = self.forced.drive.name
        for k, left in enumerate(free_equations(self.given, self.names)):
            right = (
                multiply(written(force[k]), symbol(drive + dots))
                for force, dots in zip(self.forced.forces, ("", "'", "''"), strict=True)
                if not force[k].is_zero
            )
            yield equation(left, reduce(add, right, ZERO))
        less = "with" if self.forced.drive.mean is ZERO else "less its mean"
        yield equation(symbol(drive), multiply(self.forced.drive.amplitude, self._wave), less)

    @property
    def _wave(self) -> Node:
        return BUILD["sin" if self.forced.drive.is_sine else "cos"](self.forced.drive.angle)

    def _by_sines(self) -> Iterator[Line]:
        """Yield x = X sin(w t - phi) put in, and the factors of sine and cosine compared."""
        drive, (x,), (name,) = self.forced.drive, self.amplitudes, self.names
        (a, b), (p, q) = self._stiffness[0][0], self._force[0]
        same, other = ("sin", "cos") if drive.is_sine else ("cos", "sin")
        yield equation(symbol(name), multiply(x, BUILD[same](self.angle)), "in steady motion")
        yield equation(self.angle, subtract(drive.angle, self.phase), "with")
        rate = multiply(multiply(drive.frequency, x), BUILD[other](self.angle))
        yield equation(symbol(f"{name}'"), rate if drive.is_sine else negate(rate), "so")
        square = multiply(drive.frequency, drive.frequency)
        yield equation(symbol(f"{name}''"), negate(multiply(square, symbol(name))), "and")
        sine, cosine = BUILD["sin"](self.phase), BUILD["cos"](self.phase)
        parts = [_sum((cosine, p), (negate(sine), q)), _sum((sine, p), (cosine, q))]
        yield equation(multiply(x, written(a)), parts[0], f"put in, factors of {same}({text(self.angle)})")
        yield equation(multiply(x, written(b)), parts[1], f"factors of {other}({text(self.angle)})")

    def amplitude_lines(self) -> Iterator[Line]:
        """Yield how the amplitude follows from these equations."""
        if self.has_phase:
            (a, b), (p, q), (x,) = self._stiffness[0][0], self._force[0], self.amplitudes
            left = multiply(multiply(x, x), _squares(a, b))
            yield equation(left, _squares(p, q), "squared and added")
        else:
            yield Sentence(("the amplitude is the modulus of ", self._letter()))

    def phase_lines(self) -> Iterator[Line]:
        """Yield how the phase follows from these equations."""
        if self.has_phase:
            (a, b), (p, q) = self._stiffness[0][0], self._force[0]
            tangent = divide(written(b * p - a * q), written(a * p + b * q))
            yield equation(BUILD["tan"](self.phase), tangent, "divided by each other")
            yield Sentence((self.phase, " has the signs of numerator and denominator as those of its sine and cosine",))
        elif self.is_in_phase:
            yield Sentence((f"{self.coordinate} is in phase where ", self._letter(), " is positive, else pi behind",))
        else:
            yield Sentence((f"{self.coordinate} lags behind {self.forced.drive.name} by the argument of 1/",
                            self._letter()))

    def _letter(self) -> Node:
        """Return the letter of the coordinate's amplitude."""
        found = [x for x, follows in zip(self.amplitudes, self._follows, strict=True) if not follows.is_zero]
        return found[0] if len(found) == 1 else symbol("X")

    def _in_phase(self) -> Iterator[Line]:
        """Yield x = X sin(w t) put in, and Cramer's rule."""
        for name, x in zip(self.names, self.amplitudes, strict=True):
            yield equation(symbol(name), multiply(x, self._wave), "in steady motion")
        yield from self._rows("put in")

    def _by_complex_amplitudes(self) -> Iterator[Line]:
        """Yield x as a part of X exp(i w t) put in, and Cramer's rule."""
        drive = self.forced.drive
        turning = BUILD["exp"](multiply(IMAGINARY, drive.angle))
        part = "imaginary" if drive.is_sine else "real"
        for name, x in zip(self.names, self.amplitudes, strict=True):
            yield Sentence((f"in steady motion {name} is the {part} part of ", multiply(x, turning)))
        yield Sentence((f"and {drive.name} that of ", multiply(drive.amplitude, turning)))
        yield from self._rows("put in")

    def _rows(self, first: str) -> Iterator[Line]:
        for row, force in zip(self._stiffness, self._force, strict=True):
            pairs = zip(row, self.amplitudes, strict=True)
            left = (multiply(as_complex(a), x) for a, x in pairs if not (a[0].is_zero and a[1].is_zero))
            yield equation(reduce(add, left, ZERO), as_complex(force), first)
            first = ""
        if len(self.names) > 1 and self.is_in_phase:
            yield Sentence(("by Cramer's rule, over the determinant ", written(self._determinant)))
        transfer = self.forced.transfer(self.coordinate)
        above, below = (at_frequency(part, self._omega) for part in transfer)
        whole = multiply(self.forced.drive.amplitude, divide(as_complex(above), as_complex(below)))
        yield equation(self._letter(), whole, "so")

    @property
    def _determinant(self) -> Quotient:
        return determinant([[a for a, _ in row] for row in self._stiffness])


def _sum(*pairs: tuple[Node, Quotient]) -> Node:
    return reduce(add, (multiply(written(x), node) for node, x in pairs if not x.is_zero), ZERO)


def _squares(a: Quotient, b: Quotient) -> Node:
    parts = (written(x * x) if len(x.above) == 1 else multiply(*[written(x)] * 2) for x in (a, b) if not x.is_zero)
    return reduce(add, parts, ZERO)


def damping_lines(small: SmallMotion) -> Iterator[Line]:
    """Yield the equation of one freedom by its natural frequency and damping ratio. Raises NoClosedFormError."""
    given = small.matrices
    if given is None or len(given.places) > 1:
        yield Sentence(("a mode that swings as exp((-zeta*w0 + i*w)*t) has the damping ratio zeta",))
        return
    (name,), (left,) = small.names, free_equations(given, small.names)
    (m,), (c,), (k,) = given.mass[0], given.rates[0], given.stiffness[0]
    yield equation(left, ZERO)
    standard = reduce(add, (
        symbol(f"{name}''"),
        multiply(multiply(TWO, multiply(ZETA, OMEGA_0)), symbol(f"{name}'")),
        multiply(multiply(OMEGA_0, OMEGA_0), symbol(name)),
    ))
    yield equation(standard, ZERO, "by the mass, as")
    yield equation(multiply(OMEGA_0, OMEGA_0), written(k / m), "compared")
    yield equation(multiply(multiply(TWO, ZETA), OMEGA_0), written(c / m), "and")
