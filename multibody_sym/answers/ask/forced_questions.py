"""Steady motions under a harmonic input, `ask: {A: {amplitude: x, of: F}}`, and how free motions fade.

In: a question. Out: its number by the linear equations, and its formula where these have one with that number; its
lines. In steps one freedom is solved by sines and cosines, undamped ones by amplitudes with a sign, damped ones by
complex amplitudes.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import Final, Generic, Self, TypeVar

import numpy as np

from multibody_sym.algebra.inequalities import Condition, reduced, surely_positive
from multibody_sym.algebra.quotient_functions import absolute, sqrt
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient, factors_of, why_none
from multibody_sym.algebra.roots import Roots, rate
from multibody_sym.analysis.deviations import deviation_names
from multibody_sym.analysis.modes.forced import ForcedMotion, at_frequency, with_mean_inputs
from multibody_sym.analysis.modes.matrices import WORK, Matrices, Matrix
from multibody_sym.analysis.modes.record import determinant
from multibody_sym.analysis.modes.small_motion import SmallMotion, state_values
from multibody_sym.answers.ask.question import AskedMotion, NeverError, NumberQuestion, RunNumbers
from multibody_sym.answers.ask.working import IMAGINARY, OMEGA, OMEGA_0, ZETA, Working, equation, written
from multibody_sym.answers.instant.letters import put_in
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.errors import ExpressionError, NoSolutionError
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, ZERO, Node, as_node, multiply, symbol
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

# --- steps of steady motions: linear equations, the motion put in, what follows for amplitude and phase ---------------

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
    turned = IMAGINARY * written(imaginary)
    return turned if real.is_zero else written(real) + turned


def free_equations(given: Matrices, names: Sequence[str]) -> list[Node]:
    """Return M x'' + C x' + K x row by row."""
    return [
        sum((
            written(x) * symbol(name + dots)
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
                written(force[k]) * symbol(drive + dots)
                for force, dots in zip(self.forced.forces, ("", "'", "''"), strict=True)
                if not force[k].is_zero
            )
            yield equation(left, sum(right, ZERO))
        less = "with" if self.forced.drive.mean is ZERO else "less its mean"
        yield equation(symbol(drive), self.forced.drive.amplitude * self._wave, less)

    @property
    def _wave(self) -> Node:
        return BUILD["sin" if self.forced.drive.is_sine else "cos"](self.forced.drive.angle)

    def _by_sines(self) -> Iterator[Line]:
        """Yield x = X sin(w t - phi) put in, and the factors of sine and cosine compared."""
        drive, (x,), (name,) = self.forced.drive, self.amplitudes, self.names
        (a, b), (p, q) = self._stiffness[0][0], self._force[0]
        same, other = ("sin", "cos") if drive.is_sine else ("cos", "sin")
        yield equation(symbol(name), x * BUILD[same](self.angle), "in steady motion")
        yield equation(self.angle, drive.angle - self.phase, "with")
        rate = drive.frequency * x * BUILD[other](self.angle)
        yield equation(symbol(f"{name}'"), rate if drive.is_sine else -rate, "so")
        square = drive.frequency * drive.frequency
        yield equation(symbol(f"{name}''"), -(square * symbol(name)), "and")
        sine, cosine = BUILD["sin"](self.phase), BUILD["cos"](self.phase)
        parts = [_sum((cosine, p), (-sine, q)), _sum((sine, p), (cosine, q))]
        yield equation(x * written(a), parts[0], f"put in, factors of {same}({text(self.angle)})")
        yield equation(x * written(b), parts[1], f"factors of {other}({text(self.angle)})")

    def amplitude_lines(self) -> Iterator[Line]:
        """Yield how the amplitude follows from these equations."""
        if self.has_phase:
            (a, b), (p, q), (x,) = self._stiffness[0][0], self._force[0], self.amplitudes
            left = x * x * _squares(a, b)
            yield equation(left, _squares(p, q), "squared and added")
        else:
            yield Sentence(("the amplitude is the modulus of ", self._letter()))

    def phase_lines(self) -> Iterator[Line]:
        """Yield how the phase follows from these equations."""
        if self.has_phase:
            (a, b), (p, q) = self._stiffness[0][0], self._force[0]
            tangent = written(b * p - a * q) / written(a * p + b * q)
            yield equation(BUILD["tan"](self.phase), tangent, "divided by each other")
            yield Sentence((self.phase, " has the signs of numerator and denominator as those of its sine and cosine",))
        elif self.is_in_phase:
            yield Sentence((f"{self.coordinate} is in phase where ", self._letter(), " is positive, else pi behind",))
        else:
            yield Sentence((f"{self.coordinate} lags behind {self.forced.drive.name} by the argument of 1/",
                            self._letter()))

    def _letter(self) -> Node:
        found = [x for x, follows in zip(self.amplitudes, self._follows, strict=True) if not follows.is_zero]
        return found[0] if len(found) == 1 else symbol("X")

    def _in_phase(self) -> Iterator[Line]:
        """Yield x = X sin(w t) put in, and Cramer's rule."""
        for name, x in zip(self.names, self.amplitudes, strict=True):
            yield equation(symbol(name), x * self._wave, "in steady motion")
        yield from self._rows("put in")

    def _by_complex_amplitudes(self) -> Iterator[Line]:
        """Yield x as a part of X exp(i w t) put in, and Cramer's rule."""
        drive = self.forced.drive
        turning = BUILD["exp"](IMAGINARY * drive.angle)
        part = "imaginary" if drive.is_sine else "real"
        for name, x in zip(self.names, self.amplitudes, strict=True):
            yield Sentence((f"in steady motion {name} is the {part} part of ", x * turning))
        yield Sentence((f"and {drive.name} that of ", drive.amplitude * turning))
        yield from self._rows("put in")

    def _rows(self, first: str) -> Iterator[Line]:
        for row, force in zip(self._stiffness, self._force, strict=True):
            pairs = zip(row, self.amplitudes, strict=True)
            left = (as_complex(a) * x for a, x in pairs if not (a[0].is_zero and a[1].is_zero))
            yield equation(sum(left, ZERO), as_complex(force), first)
            first = ""
        if len(self.names) > 1 and self.is_in_phase:
            yield Sentence(("by Cramer's rule, over the determinant ", written(self._determinant)))
        transfer = self.forced.transfer(self.coordinate)
        above, below = (at_frequency(part, self._omega) for part in transfer)
        whole = self.forced.drive.amplitude * (as_complex(above) / as_complex(below))
        yield equation(self._letter(), whole, "so")

    @property
    def _determinant(self) -> Quotient:
        return determinant([[a for a, _ in row] for row in self._stiffness])


def _sum(*pairs: tuple[Node, Quotient]) -> Node:
    return sum((written(x) * node for node, x in pairs if not x.is_zero), ZERO)


def _squares(a: Quotient, b: Quotient) -> Node:
    parts = (written(x * x) if len(x.above) == 1 else multiply(*[written(x)] * 2) for x in (a, b) if not x.is_zero)
    return sum(parts, ZERO)


def damping_lines(small: SmallMotion) -> Iterator[Line]:
    """Yield the equation of one freedom by its natural frequency and damping ratio. Raises NoClosedFormError."""
    given = small.matrices
    if given is None or len(given.places) > 1:
        yield Sentence(("a mode that swings as exp((-zeta*w0 + i*w)*t) has the damping ratio zeta",))
        return
    (name,), (left,) = small.names, free_equations(given, small.names)
    (m,), (c,), (k,) = given.mass[0], given.rates[0], given.stiffness[0]
    yield equation(left, ZERO)
    standard = sum((
        symbol(f"{name}''"),
        2 * (ZETA * OMEGA_0) * symbol(f"{name}'"),
        OMEGA_0 * OMEGA_0 * symbol(name),
    ), ZERO)
    yield equation(standard, ZERO, "by the mass, as")
    yield equation(OMEGA_0 * OMEGA_0, written(k / m), "compared")
    yield equation(2 * ZETA * OMEGA_0, written(c / m), "and")


_AGREEMENT: Final = 1e-9
_LONGEST: Final = 1000
"""Letters of a formula that is given: three damped freedoms have about 600 for an amplitude."""
_ROUNDING: Final = 1e-12
"""The part of a complex number below which its real or imaginary part is rounding."""
_DRIVE: Final = symbol("omega of an input")

M = TypeVar("M", ForcedMotion, SmallMotion)


# --- numbers that follow from linear equations, and their formulas ---------------------------------------------------


class _LinearQuestion(NumberQuestion, Generic[M]):
    """A question about a linear motion, whose number follows from its matrices, without a run."""

    @abstractmethod
    def motion_of(self, system: System) -> M:
        """Return the linear motion of a system. Raises NoSolutionError."""

    @abstractmethod
    def known_motion(self, motion: AskedMotion) -> M:
        """Return the linear motion of the system that is asked. Raises NoSolutionError."""

    @abstractmethod
    def value(self, linear: M) -> float:
        """Return the answer as a number. Raises NoSolutionError where it has none."""

    @abstractmethod
    def formula(self, linear: M, notes: list[str]) -> Node:
        """Return the answer as a formula; `notes` take in what it rests on. Raises NoClosedFormError."""

    @abstractmethod
    def lines(self, linear: M) -> Iterator[Line]:
        """Yield the lines that lead to the answer. Raises NoClosedFormError."""

    @property
    def is_of_small_motion(self) -> bool:
        return True

    @abstractmethod
    def remarks(self, linear: M) -> list[str]:
        """Return what the answer rests on, whether it has a formula or not."""

    def number(self, numbers: RunNumbers) -> Value:
        try:
            return Value(self.value(self.motion_of(numbers.motion.system)))
        except NoSolutionError as reason:
            raise NeverError(reason.message) from None

    def answer(self, motion: AskedMotion, working: Working) -> Value:
        unit = self.unit(motion)
        try:
            linear = self.known_motion(motion)
            number = self.value(linear)
        except NoSolutionError as reason:
            working.notes.append(reason.message)
            return Value(None, unit=unit)
        working.notes.extend(self.remarks(linear))
        working.steps.append(lambda: self.lines(linear))
        if not np.isfinite(number):
            working.notes.append("the input is at a resonance of undamped motion, whose amplitude grows without bound")
            return Value(None, unit=unit)
        found = motion.with_formula(Value(number), self._confirmed(motion, linear, number, working.notes))
        return replace(found, unit=unit)

    def _confirmed(self, motion: AskedMotion, linear: M, number: float, notes: list[str]) -> Node | None:
        reasons = motion.solved.reasons
        granted: list[str] = []
        try:
            found = self.formula(linear, granted)
            again = evaluate_float([found], motion.solved.sample)[0]
        except (NoClosedFormError, ExpressionError, *UNDEFINED) as reason:
            reasons.setdefault(why_none(reason))
            return None
        if abs(again - number) > _AGREEMENT * abs(number):
            reasons.setdefault("formula and number are not the same at the declared parameters")
            return None
        if len(text(found)) > _LONGEST:
            reasons.setdefault("the closed form is too long")
            return None
        notes.extend(granted)
        return found


# --- steady motions under a harmonic input ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _ForcedQuestion(_LinearQuestion[ForcedMotion]):
    """A question about a coordinate under the input `of`."""

    coordinate: str
    of: str

    def motion_of(self, system: System) -> ForcedMotion:
        return ForcedMotion.of(system, self.of)

    def known_motion(self, motion: AskedMotion) -> ForcedMotion:
        return motion.forced(self.of)

    def remarks(self, linear: ForcedMotion) -> list[str]:
        place = linear.small.place
        found = list(linear.small.left_out)
        if place.found or not linear.is_linear:
            how = "of the motion about" if linear.is_linear else "of small motions, linearised about"
            found.append(f"{how} {place_of_motion(linear.small)}")
        if max(place.linear.eigenvalues.real, default=0.0) > _ROUNDING:
            found.append("free motions grow, and this steady motion is not approached")
        return found

    def omega(self, forced: ForcedMotion) -> float:
        return abs(forced.value(forced.drive.frequency))

    def response(self, forced: ForcedMotion, omega: Quotient | None = None) -> tuple[Complex, Complex]:
        """Return numerator and denominator of X/F0 at a frequency, that of the input where none is given."""
        transfer = forced.transfer(self.coordinate)
        at = forced.exact(forced.drive.frequency) if omega is None else omega
        return at_frequency(transfer.above, at), at_frequency(transfer.below, at)

    def lines(self, linear: ForcedMotion) -> Iterator[Line]:
        yield from SteadySteps(linear, self.coordinate).lines()


def _modulus(part: Complex) -> tuple[Quotient, Node | None]:
    """Return |a + i b| as a factor and a root: 1 and sqrt((k - m*w^2)^2 + c^2*w^2), or abs(k - m*w^2)."""
    a, b = part
    one = a.field.constant(1)
    if a.is_zero or b.is_zero:
        whole = a if b.is_zero else b
        if surely_positive(whole) or surely_positive(-whole):
            return absolute(whole), None
        return one, BUILD["abs"](written(whole))
    ratio = b / a
    below = a.field.whole(ratio.below)
    outside = a / below
    if not surely_positive(outside):
        outside = -outside if surely_positive(-outside) else one
    return absolute(outside), BUILD["sqrt"](_squares(a / outside, b / outside))


def _size(factor: Quotient, above: Complex, below: Complex) -> Node:
    """Return factor*|above|/|below|, the factor taken as positive."""
    (p, root), (q, other) = _modulus(above), _modulus(below)
    outside = absolute(factor) * p / q
    field = outside.field
    top, bottom = (written(field.whole(x)) for x in (outside.above, outside.below))
    return (top if root is None else top * root) / (bottom if other is None else bottom * other)


def _argument(part: Complex) -> Node:
    """Return the argument of a + i b from -pi to pi, without factors that are surely positive."""
    a, b = part
    if b.is_zero and surely_positive(a):
        return ZERO
    if not (a.is_zero or b.is_zero):
        ratio = b / a
        below = ratio.field.whole(ratio.below)
        outside = a / below
        if surely_positive(-outside):
            outside, below = -outside, -below
        if surely_positive(outside):
            a, b = below, b / outside
    return BUILD["atan2"](written(b), written(a))


def _granted(conditions: Sequence[Condition]) -> list[str]:
    return [str(each) for each in reduced(conditions)]


class AmplitudeQuestion(_ForcedQuestion):
    """The amplitude of a coordinate in steady motion."""

    keys = ("amplitude", "of")

    def words(self) -> str:
        return f"amplitude of {self.coordinate} in steady motion under {self.of}"

    def unit(self, motion: AskedMotion) -> str:
        return motion.unit_of(symbol(self.coordinate))

    def value(self, linear: ForcedMotion) -> float:
        return abs(linear.number(self.coordinate, self.omega(linear)) * linear.value(linear.drive.amplitude))

    def formula(self, linear: ForcedMotion, _notes: list[str]) -> Node:
        return _size(linear.exact(linear.drive.amplitude), *self.response(linear))

    def lines(self, linear: ForcedMotion) -> Iterator[Line]:
        yield from super().lines(linear)
        yield from SteadySteps(linear, self.coordinate).amplitude_lines()


class TransmissibilityQuestion(_ForcedQuestion):
    """The amplitude of a coordinate by that of an input of the same unit."""

    keys = ("transmissibility", "of")

    def words(self) -> str:
        return f"transmissibility from {self.of} to {self.coordinate}"

    def value(self, linear: ForcedMotion) -> float:
        return abs(linear.number(self.coordinate, self.omega(linear)))

    def formula(self, linear: ForcedMotion, _notes: list[str]) -> Node:
        above, below = self.response(linear)
        return _size(above[0].field.constant(1), above, below)

    def lines(self, linear: ForcedMotion) -> Iterator[Line]:
        yield from super().lines(linear)
        yield from SteadySteps(linear, self.coordinate).amplitude_lines()
        yield Sentence(("the transmissibility is this amplitude by ", linear.drive.amplitude))


class PhaseQuestion(_ForcedQuestion):
    """The angle (rad) by which a coordinate lags behind an input, from -pi to pi."""

    keys = ("phase", "of")
    si_unit = "rad"

    def words(self) -> str:
        return f"phase by which {self.coordinate} lags behind {self.of} in steady motion"

    def value(self, linear: ForcedMotion) -> float:
        x = linear.number(self.coordinate, self.omega(linear))
        if x == 0.0:
            raise NoSolutionError(f"{self.coordinate} rests, and has no phase", number="N111")
        if not np.isfinite(x):
            return float("inf")
        return float(-np.angle(x)) if abs(x.imag) > _ROUNDING * abs(x) else float(np.pi * (x.real < 0.0))

    def formula(self, linear: ForcedMotion, notes: list[str]) -> Node:
        above, below = self.response(linear)
        (a, b), (c, d) = above, below
        if b.is_zero and d.is_zero:
            along = a * c
            notes.extend(f"while {each}" for each in _granted([Condition(absolute(along), strict=True)]))
            return ZERO if along.sample > 0 else PI
        with suppress(NoClosedFormError):  # products of two determinants
            form = _argument((c * a + d * b, d * a - c * b))
            if len(text(form)) <= _LONGEST:
                return form
        form = _argument(below) + -_argument(above)
        sample = {x.node: float(x.sample) for x in a.field.letters if x.node is not None}
        turns = round((self.value(linear) - evaluate_float([form], sample)[0]) / (2 * np.pi))
        found = form + as_node(2 * turns) * PI if turns else form
        notes.append(f"while -pi < {text(found)} <= pi; elsewhere 2*pi is added or subtracted")
        return found

    def lines(self, linear: ForcedMotion) -> Iterator[Line]:
        yield from super().lines(linear)
        yield from SteadySteps(linear, self.coordinate).phase_lines()


class _FrequencyQuestion(_ForcedQuestion):
    """A frequency of the input (rad/s) at which the steady motion of a coordinate is a special one."""

    si_unit = "rad/s"

    def unknown(self, forced: ForcedMotion) -> Node:
        """Return the letter of the frequency: a parameter where the input names one."""
        pace = forced.drive.frequency
        return pace if forced.matrices.field.position(pace) is not None else _DRIVE

    def at_unknown(self, forced: ForcedMotion) -> tuple[Complex, Complex]:
        """Return numerator and denominator of X/F0 at the frequency that is looked for."""
        pace = forced.exact(forced.drive.frequency)
        if self.unknown(forced) is _DRIVE:
            field = forced.matrices.field
            pace = field.letter(_DRIVE, Letter(_DRIVE, PRECISE.mpf(self.value(forced)), True))
        return self.response(forced, pace)

    @abstractmethod
    def vanishing(self, forced: ForcedMotion) -> Quotient:
        """Return what vanishes at the frequency."""

    def formula(self, linear: ForcedMotion, notes: list[str]) -> Node:
        _, root = self._solved(linear)
        notes.extend(f"while {each}" for each in _granted([Condition(root * root, strict=True)]))
        return written(root)

    def _solved(self, linear: ForcedMotion) -> tuple[Quotient, Quotient]:
        """Return the factor that vanishes at the frequency, and the frequency. Raises NoClosedFormError."""
        number, unknown, vanishing = self.value(linear), self.unknown(linear), self.vanishing(linear)
        field = vanishing.field
        field.work = max(field.work, WORK)
        place, solver = field.position(unknown), Roots(field, unknown)
        if place is None:
            raise NoClosedFormError("the equation does not name the frequency")
        for factor, _ in factors_of(field.in_ring(vanishing.above))[1]:
            powers = field.coefficients(factor, place)
            for root in solver.polynomial_roots(powers):
                if abs(float(root.sample) - number) <= _AGREEMENT * number:
                    return field.whole(factor), root
        raise NoClosedFormError("the equation of the frequency has no known roots")

    def vanishing_line(self, linear: ForcedMotion) -> Line:
        factor, _ = self._solved(linear)
        written_out = put_in(written(factor), {_DRIVE: OMEGA})
        return equation(written_out, ZERO)


class ResonanceQuestion(_FrequencyQuestion):
    """The frequency of the greatest amplitude of a coordinate."""

    keys = ("resonance", "of")

    def words(self) -> str:
        return f"frequency of {self.of} with the greatest amplitude of {self.coordinate}"

    def value(self, linear: ForcedMotion) -> float:
        return linear.resonance(self.coordinate)

    def formula(self, linear: ForcedMotion, notes: list[str]) -> Node:
        number = self.value(linear)
        if linear.matrices.is_damped:
            return super().formula(linear, notes)
        modes = linear.small.as_modes()
        forms = (x.expression for x in modes.frequencies if abs((x.value or 0.0) - number) <= _AGREEMENT * number)
        return next((form for form in forms if form is not None), None) or super().formula(linear, notes)

    def vanishing(self, forced: ForcedMotion) -> Quotient:
        (a, b), (c, d) = self.at_unknown(forced)
        if d.is_zero:
            return c
        force = forced.exact(forced.drive.amplitude)
        unknown = self.unknown(forced)
        above, below = force * force * (a * a + b * b), c * c + d * d
        return rate(above, unknown) * below - above * rate(below, unknown)

    def lines(self, linear: ForcedMotion) -> Iterator[Line]:
        yield from super().lines(linear)
        (a, b), (c, d) = self.at_unknown(linear)
        if d.is_zero:
            yield Sentence(("without damping the amplitude is infinite where the denominator vanishes",))
        else:
            force = written(linear.exact(linear.drive.amplitude))
            square = force * force * (written(a * a + b * b) / written(c * c + d * d))
            yield Sentence(("the amplitude is greatest where the derivative of its square vanishes, of ", square))
        yield self.vanishing_line(linear)
        push = linear.exact(linear.drive.amplitude) * a
        if len(linear.small.names) == 1 and b.is_zero and not d.is_zero and self.unknown(linear) not in push.symbols:
            yield Sentence(("such a frequency exists for a damping ratio below 1/sqrt(2)",))


class AntiresonanceQuestion(_FrequencyQuestion):
    """The frequency at which a coordinate rests: that of an absorber."""

    keys = ("antiresonance", "of")

    def words(self) -> str:
        return f"frequency of {self.of} at which {self.coordinate} rests"

    def value(self, linear: ForcedMotion) -> float:
        return linear.antiresonance(self.coordinate)

    def vanishing(self, forced: ForcedMotion) -> Quotient:
        a, b = self.at_unknown(forced)[0]
        return b if a.is_zero else a

    def lines(self, linear: ForcedMotion) -> Iterator[Line]:
        yield from super().lines(linear)
        yield Sentence((f"{self.coordinate} rests where the numerator vanishes",))
        yield self.vanishing_line(linear)


# --- how free motions fade -------------------------------------------------------------------------------------------


class _FadingQuestion(_LinearQuestion[SmallMotion]):
    """A question about the damping of a mode."""

    def motion_of(self, system: System) -> SmallMotion:
        return SmallMotion.of(with_mean_inputs(system))

    def known_motion(self, motion: AskedMotion) -> SmallMotion:
        return self.motion_of(motion.solved.system)

    def remarks(self, linear: SmallMotion) -> list[str]:
        return list(linear.left_out)

    def lines(self, linear: SmallMotion) -> Iterator[Line]:
        yield from damping_lines(linear)


def _rayleigh(M: Matrix, C: Matrix, K: Matrix) -> tuple[Quotient, Quotient]:
    """Return alpha and beta of C = alpha M + beta K. Raises NoClosedFormError where C is no such sum."""
    triples = [t for rows in zip(M, C, K, strict=True) for t in zip(*rows, strict=True)]
    first, *others = triples
    for other in others:
        area = first[0] * other[2] - other[0] * first[2]
        if area.vanishes:
            continue
        alpha = (first[1] * other[2] - other[1] * first[2]) / area
        beta = (first[0] * other[1] - other[0] * first[1]) / area
        if all((c - alpha * m - beta * k).is_zero for m, c, k in triples):
            return alpha, beta
        break
    raise NoClosedFormError("damping couples the modes, and a damping ratio has no closed form")


@dataclass(frozen=True)
class DampingQuestion(_FadingQuestion):
    """The damping ratio of a mode, by its number."""

    mode: int

    @classmethod
    def parse(cls, ask: Ask) -> Self | None:
        return None if ask.damping is None else cls(int(ask.damping.shadow or 0))

    def words(self) -> str:
        return f"damping ratio of mode {self.mode}"

    def value(self, linear: SmallMotion) -> float:
        mode, values = self.mode, np.linalg.eigvals(linear.place.linear.A)
        if len(values) == 2:
            square = (values[0] * values[1]).real
            if square > 0.0 and mode == 1:
                return float(-(values[0] + values[1]).real / (2.0 * np.sqrt(square)))
        swinging = sorted((x for x in values if x.imag > 0.0), key=abs)
        if not 1 <= mode <= len(swinging):
            count = {0: "no mode oscillates", 1: "one mode oscillates"}.get(len(swinging))
            raise NoSolutionError(f"mode {mode}: {count or f'{len(swinging)} modes oscillate'}", number="N111")
        return float(-swinging[mode - 1].real / abs(swinging[mode - 1]))

    def formula(self, linear: SmallMotion, _notes: list[str]) -> Node:
        """Return the damping ratio: C = alpha M + beta K fades each mode alone. Raises NoClosedFormError."""
        given = linear.matrices
        if given is None:
            raise NoClosedFormError(next(iter(linear.reasons), "the equations have no closed form"))
        if len(given.places) == 1:
            return written(given.rates[0][0] / (2 * sqrt(given.mass[0][0] * given.stiffness[0][0])))
        alpha, beta = _rayleigh(given.mass, given.rates, given.stiffness)
        found = linear.spectrum
        swinging = [] if found is None else [root for root in found.roots if float(PRECISE.re(root.value)) > 0.0]
        squares = [root.quotient for root in swinging]
        square = squares[self.mode - 1] if self.mode <= len(squares) else None
        if square is None:
            raise NoClosedFormError("the frequency has no closed form")
        return written((alpha + beta * square) / (2 * sqrt(square)))


@dataclass(frozen=True)
class DecrementQuestion(_FadingQuestion):
    """The logarithmic decrement of a coordinate that swings in one mode."""

    keys = ("decrement",)

    coordinate: str

    def words(self) -> str:
        return f"logarithmic decrement of {self.coordinate}"

    def value(self, linear: SmallMotion) -> float:
        swinging = [x for x in np.linalg.eigvals(linear.place.linear.A) if x.imag > 0.0]
        if len(swinging) != 1:
            several = f"{self.coordinate} swings in {len(swinging)} modes; ask for the damping of one: {{damping: 1}}"
            raise NoSolutionError(several if swinging else f"{self.coordinate} does not oscillate", number="N111")
        return float(-2.0 * np.pi * swinging[0].real / swinging[0].imag)

    def formula(self, linear: SmallMotion, notes: list[str]) -> Node:
        given = linear.matrices
        if given is None or len(given.places) != 1:
            raise NoClosedFormError("a decrement has a formula where one freedom is left")
        M, C, K = (x[0][0] for x in (given.mass, given.rates, given.stiffness))
        swings = 4 * M * K - C * C
        notes.extend(f"while {each}" for each in _granted([Condition(swings, strict=True)]))
        return 2 * PI * written(C) / BUILD["sqrt"](written(swings))

    def lines(self, linear: SmallMotion) -> Iterator[Line]:
        yield from super().lines(linear)
        yield Sentence(("maxima are a period of the damped oscillation apart, whose logarithmic ratio is ",
                        2 * PI * ZETA / BUILD["sqrt"](1 - ZETA * ZETA)))


FORCED_QUESTIONS: Final[tuple[type[NumberQuestion], ...]] = (
    AmplitudeQuestion,
    PhaseQuestion,
    ResonanceQuestion,
    AntiresonanceQuestion,
    TransmissibilityQuestion,
    DecrementQuestion,
    DampingQuestion,
)
"""The kinds of this file."""
