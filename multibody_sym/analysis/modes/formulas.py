"""Small motions as formulas and numbers: frequencies, periods, shapes, modes, the state, the polynomial.

In: matrices over quotients and their roots, or a linearisation. Out: values, each with the shortest of the forms that
have its number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.algebra.book_form import book_form, with_doubles
from multibody_sym.algebra.quotient_functions import exact_solve, sqrt, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, NoClosedFormError, Quotient
from multibody_sym.analysis.linearize import Linearization
from multibody_sym.analysis.modes.matrices import Matrices
from multibody_sym.analysis.modes.record import Mode
from multibody_sym.analysis.modes.spectrum import Root, Spectrum, root_of
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, TWO, Node, as_node, divide, multiply, negate, symbol
from multibody_sym.scalars.rank import least_directions
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

AGREEMENT: Final = 1e-9
_LONGEST: Final = 600
_LONGEST_NUMBER: Final = 20
_SHAPES: Final = 100_000
_MOST_SHAPED: Final = 5
_ROOT_BELOW: Final = 3
_STILL: Final = 1e-12


@dataclass
class Formulas:
    """Values of quotients over the field of matrices; `reasons` collects why a formula was left out."""

    given: Matrices
    reasons: dict[str, None] = field(default_factory=dict)

    @property
    def sample(self) -> dict[Node, float]:
        """The values of the symbols."""
        return {x.node: float(x.sample) for x in self.given.field.letters if x.node is not None and not x.node.args}

    def value(self, a: Quotient, unit: str = "") -> Value:
        """Return a quotient as a value."""
        return self.shortest(float(a.sample), [lambda: book_form(with_whole_angles(a))], unit)

    def shortest(self, number: float, forms: Sequence[Callable[[], Node]], unit: str) -> Value:
        """Return a number with the shortest of the forms that have its value, without one where none has."""
        found = [node for node in map(self._node, forms) if node is not None and self._is(node, number)]
        node = min(found, key=_reading_length, default=None)
        if node is None or (not leaves([node], "symbol") and len(text(node)) > _LONGEST_NUMBER):
            return Value(number, None, unit)
        return Value(number, node, unit)

    def _node(self, form: Callable[[], Node]) -> Node | None:
        try:
            node = with_doubles(form())
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
            return None
        except ExpressionError as reason:
            self.reasons[reason.message] = None
            return None
        if len(text(node)) > _LONGEST:
            self.reasons["the closed form is too long"] = None
            return None
        return node

    def _is(self, node: Node, number: float) -> bool:
        try:
            again = evaluate_float([parse(text(node))], self.sample)[0]
        except (ExpressionError, *UNDEFINED):
            return False
        return abs(again - number) <= AGREEMENT * abs(number)

    # --- frequencies ----------------------------------------------------------------------------------------------

    def frequency(self, root: Root) -> Value:
        """Return omega = sqrt(x)."""
        return self.shortest(float(PRECISE.sqrt(root.value)), list(self._roots_of(root, turned=False)), "rad/s")

    def period(self, root: Root) -> Value:
        """Return T = 2 pi / sqrt(x)."""
        return self.shortest(float(2 * PRECISE.pi / PRECISE.sqrt(root.value)), list(self._periods(root)), "s")

    def rate(self, root: Root) -> Value:
        """Return sqrt(-x), the rate with which an unstable mode grows."""
        turned = Root(
            -root.value,
            None if root.node is None else negate(root.node),
            None if root.quotient is None else -root.quotient,
            root.times,
        )
        found = self.frequency(turned)
        return Value(found.value, found.expression, "1/s")

    def _roots_of(self, root: Root, *, turned: bool) -> Iterator[Callable[[], Node]]:
        """Yield forms of sqrt(x), or of sqrt(1 / x)."""
        node, x = root.node, root.quotient
        if x is not None:
            inside = x.power(-1) if turned else x
            yield lambda: book_form(with_whole_angles(sqrt(inside)))
            yield lambda: BUILD["sqrt"](book_form(with_whole_angles(inside)))
        if root.frequency is not None:
            swings = root.frequency.power(-1) if turned else root.frequency
            yield lambda: book_form(with_whole_angles(swings))
        if not turned:
            yield from (lambda form=form: BUILD["sqrt"](form) for form in root.forms)
        if node is not None and not turned:
            yield lambda: BUILD["sqrt"](node)

    def _periods(self, root: Root) -> Iterator[Callable[[], Node]]:
        if root.quotient is not None:
            turned = root.quotient.power(-1)
            circle = self.given.field.letter(PI, self.given.field.letters[0]) * 2
            yield lambda: book_form(with_whole_angles(circle * sqrt(turned)))
        for form in self._roots_of(root, turned=True):
            yield lambda form=form: multiply(multiply(TWO, PI), form())  # type: ignore[misc]
        for form in self._roots_of(root, turned=False):
            yield lambda form=form: divide(multiply(TWO, PI), form())  # type: ignore[misc]

    # --- shapes ---------------------------------------------------------------------------------------------------

    def shape(self, root: Root, numbers: Sequence[float], *, exactly: bool) -> list[Value]:
        """Return the amplitudes of a mode without gyroscopic terms, formulas for its numbers where there are any."""
        lead = next((k for k, x in enumerate(numbers) if abs(x) > _STILL), None)
        if lead is None or root.quotient is None or root.times > 1 or not exactly or len(numbers) > _MOST_SHAPED:
            return [Value(x) for x in numbers]
        try:
            found = self._solved_shape(root.quotient, lead, len(numbers))
        except NoClosedFormError:
            return [Value(x) for x in numbers]
        return [
            self.value(a) if abs(float(a.sample) - x) <= AGREEMENT * max(1.0, abs(x)) else Value(x)
            for a, x in zip(found, numbers, strict=True)
        ]

    def _solved_shape(self, x: Quotient, lead: int, size: int) -> list[Quotient]:
        """Return v with (K - x M) v = 0 and v = 1 at the place `lead`."""
        field, M, K = self.given.field, self.given.mass, self.given.stiffness
        field.work = max(field.work, _SHAPES)
        rows = [[b - x * a for a, b in zip(*pair, strict=True)] for pair in zip(M, K, strict=True)]
        others = [k for k in range(size) if k != lead]
        if not others:
            return [field.constant(1)]
        solved = exact_solve([[row[k] for k in others] for row in rows], [-row[lead] for row in rows])
        found: list[Any] = [field.constant(1)] * size
        for k, v in zip(others, solved, strict=True):
            found[k] = v
        return found


def _reading_length(node: Node) -> tuple[int, bool, bool, str]:
    """Return how long a form is to read, longer where a root divides it; 2 sqrt(a) is the shortest of equals."""
    divides = node.op == "div" and any(x.op == "sqrt" for x in (node.args[1], *node.args[1].args))
    numbered = node.op == "mul" and node.args[0].op == "number" and node.args[1].op == "sqrt"
    return len(text(node)) + _ROOT_BELOW * divides, not numbered, node.op != "sqrt", text(node)


# --- modes in numbers, from eigenvalues and eigenvectors -------------------------------------------------------------

_IN_NUMBERS_STILL: Final = 1e-9
_APART: Final = 100.0
"""Eigenvalues at least this many errors apart count as different."""

Vector = npt.NDArray[np.complex128]


def shapes_in_numbers(M: Floats, G: Floats, K: Floats, square: complex, times: int) -> list[Vector]:
    """Return the vectors v of the motions v exp(i omega t), as many as omega is a root, each with 1 as its first part.

    Of several vectors none has the first part of another.
    """
    rate = 1j * np.sqrt(complex(square))
    found = least_directions(K + rate * G + rate * rate * M, times)
    for k in range(times):
        lead = int(np.argmax((np.abs(found[k:]) > _IN_NUMBERS_STILL).any(axis=0)))
        first = k + int(np.argmax(np.abs(found[k:, lead])))
        found[[k, first]] = found[[first, k]]
        found[k] = found[k] / found[k, lead]
        others = [j for j in range(times) if j != k]
        found[others] = found[others] - np.outer(found[others, lead], found[k])
    return [scaled(v) for v in found]


def scaled(v: Vector) -> Vector:
    """Return a vector with 1 as the first of its parts that does not vanish, rounding set to zero."""
    size = np.abs(v).max(initial=0.0)
    first = next((x for x in v if abs(x) > _IN_NUMBERS_STILL * size), None)
    found = v if first is None else v / first
    large = np.abs(found).max(initial=0.0)
    real = np.where(np.abs(found.real) <= _IN_NUMBERS_STILL * large, 0.0, found.real)
    imaginary = np.where(np.abs(found.imag) <= _IN_NUMBERS_STILL * large, 0.0, found.imag)
    return np.asarray(real + 1j * imaginary)


def modes_in_numbers(linear: Linearization, names: Sequence[str]) -> tuple[Mode, ...]:
    """Return the modes of eigenvalues and eigenvectors, deviations by `names`, oscillating ones first.

    Rounding turns an eigenvector by more where others have almost its eigenvalue; of eigenvalues that cannot be told
    apart every combination is a mode.
    """
    if not linear.steady or not len(linear.A):
        return ()
    values, vectors = np.linalg.eig(linear.A)
    clean = [int(np.argmin(np.abs(linear.eigenvalues - x))) for x in values]
    places = {name: k for k, name in enumerate(linear.states) if name in names}
    found = []
    for k, vector in zip(clean, vectors.T, strict=True):
        value, error = complex(linear.eigenvalues[k]), float(linear.eigenvalue_errors[k])
        if value.imag < 0.0:
            continue
        amplitudes = scaled(vector[list(places.values())])
        apart = np.abs(linear.eigenvalues - linear.eigenvalues[k])
        others = apart[apart > _APART * error]
        angle = error / float(others.min()) if others.size else 0.0  # rad
        turned = angle * float(np.abs(amplitudes).max(initial=0.0))
        found.append((value, _mode_in_numbers(value, error, dict(zip(places, amplitudes, strict=True)), turned)))
    found.sort(key=lambda pair: (pair[0].imag == 0.0, pair[0].imag, -pair[0].real))
    return tuple(mode for _, mode in found)


def _mode_in_numbers(value: complex, error: float, shape: dict[str, complex], turned: float) -> Mode:
    parts = {name: Value(float(x.real), error=turned) for name, x in shape.items()}
    ahead = {name: Value(float(x.imag), error=turned) for name, x in shape.items()}
    quarter = ahead if any(x.imag for x in shape.values()) else {}
    rate = Value(value.real, None, "1/s", error=error)
    if value.imag == 0.0:
        motion = "free" if value.real == 0.0 else "grows" if value.real > 0.0 else "decays"
        return Mode(motion, rate=None if motion == "free" else rate, shape=parts)  # type: ignore[arg-type]
    period = 2 * math.pi / value.imag
    swings = (
        Value(value.imag, None, "rad/s", error=error),
        Value(period, None, "s", error=period * error / value.imag),
    )
    return Mode("oscillates", *swings, rate if value.real else None, parts, quarter)


def damped_modes(given: Matrices, formulas: Formulas, name: str) -> tuple[list[Mode], list[Root]]:
    """Return the modes of one freedom with a damper, and omega^2 of the one that swings, if any.

    M x'' + C x' + K x = 0 swings with sqrt(K/M - d^2), d = C/(2 M), and fades as -d.
    """
    M, C, K = (matrix[0][0] for matrix in (given.mass, given.rates, given.stiffness))
    fading = C / (2 * M)
    square = K / M - fading * fading
    shape = {name: Value(1.0)}
    if square.vanishes:
        return [Mode("decays", rate=formulas.value(-fading, "1/s"), shape=shape)], []
    if square.sample > 0:
        root = root_of(square)
        rate = formulas.value(-fading, "1/s")
        return [Mode("oscillates", formulas.frequency(root), formulas.period(root), rate, shape)], [root]
    spread = PRECISE.sqrt(-square.sample)
    rates = [Value(float(-fading.sample + side * spread), None, "1/s") for side in (1, -1)]
    words = ("grows" if x.value and x.value > 0.0 else "decays" for x in rates)
    return [Mode(word, rate=rate, shape=shape) for word, rate in zip(words, rates, strict=True)], []  # type: ignore[arg-type]


# --- the state and the characteristic polynomial ---------------------------------------------------------------------

_ZERO: Final = 1e-12


def state_values(mechanism: Mechanism, begin: Start, state: SymbolicState | None) -> dict[str, Value]:
    """Return the coordinates, and the speeds that do not vanish: formulas with their values, else numbers."""
    units = MechanismUnits(mechanism).state
    count = len(mechanism.coordinates)
    formulas = [None] * (count + len(mechanism.speeds)) if state is None else [*state.state.q, *state.state.u]
    declared: list[Coordinate | Speed] = [*mechanism.coordinates, *mechanism.speeds]
    numbers = {each.name: x for each, x in zip(declared, (*begin.q, *begin.u), strict=True)}
    letters = {} if state is None else {node: float(letter.sample) for node, letter in state.letters.items()}
    sample = {symbol(name): x for name, x in numbers.items()} | letters
    found = {}
    for k, ((name, x), formula) in enumerate(zip(numbers.items(), formulas, strict=True)):
        node = None if formula is None or formula is symbol(name) else with_doubles(as_node(formula))
        number = x if node is None else evaluate_float([node], sample)[0]
        number = 0.0 if abs(number) <= _ZERO else number
        if k < count or number:
            found[name] = Value(number, node, units[name])
    return found


def polynomial_text(found: Spectrum) -> str:
    """Return the factors of the polynomial that are not linear, each of which vanishes; empty where too long.

    Each is written by falling powers of omega.
    """
    factors = []
    for powers in (powers for powers, _ in found.factors if len(powers) > 2):
        line = ""
        for k in range(len(powers) - 1, -1, -1):
            if powers[k].is_zero:
                continue
            negative = powers[k].sample < 0
            try:
                size = book_form(with_whole_angles(-powers[k] if negative else powers[k]))
            except NoClosedFormError:
                return ""
            term = text(size) if not k else text(multiply(size, symbol(f"omega^{2 * k}")))
            sign = "-" if negative else "+"
            line += f" {sign} {term}" if line else term if sign == "+" else f"-{term}"
        factors.append(line)
    return "; ".join(f"{factor} = 0" for factor in factors)
