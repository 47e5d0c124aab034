"""One system's small motions: the state, its matrices, their spectrum, and the record of modes.

In: a System. Out: Modes. First the notes on what small motions and periods leave out: time, and friction that turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.algebra.book_form import with_doubles
from multibody_sym.algebra.inequalities import Condition, reduced, under_roots
from multibody_sym.algebra.quotient_functions import book_node, exact_solve, sqrt
from multibody_sym.algebra.quotients import PRECISE, NoClosedFormError, Quotient
from multibody_sym.algebra.roots import has_value, values_with_shared_roots
from multibody_sym.analysis.deviations import DeviationFlow, deviation_names
from multibody_sym.analysis.linearize import At, Linearization
from multibody_sym.analysis.modes.matrices import (
    Matrices,
    Matrix,
    SteadyState,
    formulas_of,
    matrices,
    place_of,
    with_momenta_held,
)
from multibody_sym.analysis.modes.record import Mode, Modes, Root, Rows, Spectrum, root_of, spectrum
from multibody_sym.derivation.symbolic_start import SymbolicState
from multibody_sym.dynamics.start.initial_geometry import fix_directions
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError, NoSolutionError
from multibody_sym.mechanics.mechanism import Coordinate, Mechanism, Speed
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.system import System, expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, TWO, Node, as_node, divide, multiply, negate, symbol
from multibody_sym.scalars.rank import least_directions
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# Small motions as formulas and numbers: frequencies, periods, shapes, modes, the state, the polynomial.
#
# In: matrices over quotients and their roots, or a linearisation. Out: values, each with the shortest of the forms that
# have its number.


AGREEMENT: Final = 1e-9
_LONGEST: Final = 600
_LONGEST_NUMBER: Final = 20
_SHAPES: Final = 100_000
_MOST_SHAPED: Final = 5
_ROOT_BELOW: Final = 3
_LOST: Final = 15
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
        return self.shortest(float(a.sample), [lambda: book_node(a)], unit)

    def shortest(self, number: float, forms: Sequence[Callable[[], Node]], unit: str) -> Value:
        """Return a number with the shortest of the forms that have its value, without one where none has."""
        nodes = [node for node in map(self._node, forms) if node is not None]
        found = [node for node in nodes if has_value(node, number, self.sample, AGREEMENT)]
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
            yield lambda: book_node(sqrt(inside))
            yield lambda: BUILD["sqrt"](book_node(inside))
        if root.frequency is not None:
            swings = root.frequency.power(-1) if turned else root.frequency
            yield lambda: book_node(swings)
        if not turned:
            yield from (lambda form=form: BUILD["sqrt"](form) for form in root.forms)
        if node is not None and not turned:
            yield lambda: BUILD["sqrt"](node)

    def _periods(self, root: Root) -> Iterator[Callable[[], Node]]:
        if root.quotient is not None:
            turned = root.quotient.power(-1)
            circle = self.given.field.letter(PI, self.given.field.letters[0]) * 2
            yield lambda: book_node(circle * sqrt(turned))
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
    """Return how long a form is to read, longer where a root divides it; 2 sqrt(a) is the shortest of equals.

    A root with letters that is subtracted below loses digits, and its limits.
    """
    divides = node.op == "div" and any(x.op == "sqrt" for x in (node.args[1], *node.args[1].args))
    quotient = node.args[0] if node.op == "sqrt" else node
    below = flatten("add", quotient.args[1]) if quotient.op == "div" else []
    loses = any(x.op == "neg" and x.args[0].op == "sqrt" and leaves([x], "symbol") for x in below)
    numbered = node.op == "mul" and node.args[0].op == "number" and node.args[1].op == "sqrt"
    return len(text(node)) + _ROOT_BELOW * divides + _LOST * loses, not numbered, node.op != "sqrt", text(node)


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


def damped_modes(given: Matrices, formulas: Formulas, name: str) -> tuple[Mode, ...]:
    """Return the modes of one freedom with a damper.

    M x'' + C x' + K x = 0 swings with sqrt(K/M - d^2), d = C/(2 M), and fades as -d.
    """
    M, C, K = (matrix[0][0] for matrix in (given.mass, given.rates, given.stiffness))
    fading = C / (2 * M)
    square = K / M - fading * fading
    shape = {name: Value(1.0)}
    if square.vanishes:
        return (Mode("decays", rate=formulas.value(-fading, "1/s"), shape=shape),)
    if square.sample > 0:
        root = root_of(square)
        rate = formulas.value(-fading, "1/s")
        return (Mode("oscillates", formulas.frequency(root), formulas.period(root), rate, shape),)
    spread = PRECISE.sqrt(-square.sample)
    rates = [Value(float(-fading.sample + side * spread), None, "1/s") for side in (1, -1)]
    words = ("grows" if x.value and x.value > 0.0 else "decays" for x in rates)
    return tuple(Mode(word, rate=rate, shape=shape) for word, rate in zip(words, rates, strict=True))  # type: ignore[arg-type]


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
                size = book_node(-powers[k] if negative else powers[k])
            except NoClosedFormError:
                return ""
            term = text(size) if not k else text(multiply(size, symbol(f"omega^{2 * k}")))
            sign = "-" if negative else "+"
            line += f" {sign} {term}" if line else term if sign == "+" else f"-{term}"
        factors.append(line)
    return "; ".join(f"{factor} = 0" for factor in factors)


# ----------------------------------------------------------------------------------------------------------------------
# One system's small motions: the state, its matrices, their spectrum, and the record of modes.


_TIME: Final = symbol("t")
_MOVING: Final = ("joints", "forces", "constraints", "bodies", "inputs", "gravity", "pulleys", "contacts")
_LATER: Final = (0.137, 1.913, 31.07)
"""Times (s) at which a system is compared with what it is at t = 0."""
_ASIDE: Final = (0.137, -0.291)
"""By how much coordinates and speeds are displaced to see whether A changes."""
_SAME: Final = 1e-9
"""The part of the largest omega^2 up to which one is zero."""
_AGREEMENT: Final = 1e-7
"""How near a root must come to the square of an eigenvalue, of which rounding takes more where two of them meet."""
_ROUNDED: Final = 1e-11
_WORK_OF_CONDITIONS: Final = 50_000
_STOPPED: Final = "the start moves, but no steady motion was found beside it: its speeds are left out"
_IN_ANGLES: Final = "; those of attitudes are found in angles: declare `angles: zxz` or the like"
_DAMPED: Final = "dampers act: frequencies and shapes are those without them, and eigenvalues those with them"

# --- what small motions and periods leave out of a model -------------------------------------------------------------


def named_with_time(system: System) -> dict[str, list[Node]]:
    """Return the expressions of a model that depend on t, by the place of their element, `forces.drive`."""
    found: dict[str, list[Node]] = {}
    for section in _MOVING:
        for path, node, _ in expressions(getattr(system, section), (section,)):
            if _TIME in leaves([node], "symbol"):
                found.setdefault(".".join(path[:2]), []).append(node)
    return found


def period_of_drive(system: System, parameters: dict[Node, float]) -> float | None:
    """Return the period (s) of all sines and cosines of t in a model, None where they are not of one period."""
    drives = [node for nodes in named_with_time(system).values() for node in nodes]
    waves = [n for n in postorder(drives) if n.op in ("sin", "cos") and _TIME in leaves([n], "symbol")]
    rates = [derivative(wave.args[0], _TIME) for wave in waves]
    try:
        paces = [abs(x) for x in evaluate_float(rates, parameters)] if rates else []
    except (ExpressionError, *UNDEFINED):
        return None
    same = paces and max(paces) - min(paces) <= _SAME * max(paces)
    return 2 * math.pi / paces[0] if same and paces[0] else None


def time_note(system: System, flow: DeviationFlow, begin: Start) -> str | None:
    """Return the note on a state that would not stay as it is, because time moves something."""
    named = named_with_time(system)
    if not named:
        return None
    states = []
    for t in (0.0, *_LATER):
        known = flow.known_at(begin.q, begin.u, t)
        states.append(np.concatenate([flow.rates(known)[1], np.ravel(flow.derivatives(known)[0])]))
    at_first, *later = states
    size = max(1.0, float(np.abs(at_first).max(initial=0.0)))
    if all(np.abs(x - at_first).max(initial=0.0) <= _SAME * size for x in later):
        return None
    names = " and ".join(named)
    return (
        f"{names} {'depends' if len(named) == 1 else 'depend'} on t, and small motions are those of the model as it is "
        "at t = 0; free oscillations are those of the model without it, and simulate follows time"
    )


def is_linear(flow: DeviationFlow, begin: Start) -> bool:
    """Return whether A is the same at other times and states: then small motions are those about any state."""
    if flow.mechanism.rows or flow.mechanism.mode is not None:
        return False
    q, u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
    states = [(q, u, t) for t in (0.0, *_LATER)]
    states += [(q + part * (1.0 + np.arange(len(q))), u + part, 0.0) for part in _ASIDE]
    here, *others = (np.ravel(flow.derivatives(flow.known_at(*state))[0]) for state in states)
    size = max(1.0, float(np.abs(here).max(initial=0.0)))
    return all(np.abs(x - here).max(initial=0.0) <= _SAME * size for x in others)


def friction_notes(flow: DeviationFlow) -> list[str]:
    """Return the notes on friction that acts in the mode of the start, by sliding and sticking elements."""
    mechanism = flow.mechanism
    if mechanism.mode is None:
        return []
    words = mode_words(mechanism.one_way, mechanism.mode)
    parts = dict.fromkeys(name for x in mechanism.one_way for name in (x.name, *(part.name for part in x.frictions)))
    sliding = [name for name in parts if words.get(name, "").startswith(("slide", "slip"))]
    sticking = [name for name in parts if words.get(name, "") in ("stick", "grip")]
    notes = []
    if sliding:
        notes.append(
            f"{', '.join(sliding)}: friction is taken as it pushes while this slides as it does at the start; where it "
            "turns back friction does too, about another place of rest, and the motion ends (simulate)"
        )
    if sticking:
        notes.append(f"{', '.join(sticking)}: it sticks, and small motions are those while it does")
    return notes


# --- small motions ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class SmallMotion:
    """Small motions about a `place`; `mechanism` and `state` for formulas, `matrices` without the `held` coordinates.

    Where there are no formulas `matrices` is None; `reasons` say why, of other missing formulas too. `left_out` are
    notes on parts of the model that do not act in them.
    """

    place: SteadyState
    mechanism: Mechanism
    state: SymbolicState | None
    matrices: Matrices | None
    held: tuple[int, ...]
    reasons: dict[str, None] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    @classmethod
    def of(cls, system: System, formalism: str | None = None, at: At = None) -> SmallMotion:
        """Return the small motions of a system. Raises InputError and NoSolutionError."""
        place = place_of(system, formalism, at)
        flow, begin = place.flow, place.begin
        if not place.linear.states:
            raise NoSolutionError("nothing is free to move: there are no small motions", number="N111")
        formal, _ = fix_directions(flow.mechanism, begin.q, begin.u, begin.parameters)
        size = len(formal.speeds)
        tangents = flow.tangents(np.array(begin.q, dtype=float), np.array(begin.u, dtype=float))
        places = [k - size for k in tangents.places if k >= size]
        reasons: dict[str, None] = {}
        state, found = None, None
        held: tuple[int, ...] = ()
        try:
            state = formulas_of(formal, begin, found=place.found or at is not None, places=places)
            found, held = with_momenta_held(matrices(formal, state, places))
        except NoClosedFormError as reason:
            reasons[str(reason)] = None
        except ExpressionError as reason:
            reasons[reason.message] = None
        time = time_note(system, flow, begin)
        left_out = (*([] if time is None else [time]), *friction_notes(flow))
        return cls(place, formal, state, found, held, reasons, left_out)

    # --- formulas -------------------------------------------------------------------------------------------------

    @cached_property
    def formulas(self) -> Formulas:
        """The maker of values over the field of the matrices."""
        assert self.matrices is not None
        return Formulas(self.matrices, self.reasons)

    @cached_property
    def spectrum(self) -> Spectrum | None:
        """The roots of the characteristic polynomial, None where they are not the eigenvalues."""
        given = self.matrices
        if given is None or not given.places:
            return None
        try:
            found = spectrum(given)
        except NoClosedFormError as reason:
            self.reasons[str(reason)] = None
            return None
        values = self.place.linear.eigenvalues
        if given.is_damped:  # those without dampers
            M, G, K = self._in_floats
            size, inverse = len(M), np.linalg.inv(M)
            A = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ K, -inverse @ G]])
            values = np.linalg.eigvals(A)
        squares = [complex(root.value) for root in found.roots if not root.rests]
        known = [-(complex(x) * complex(x)) for x in values]
        largest = max((abs(x) for x in squares), default=0.0)
        missed = [(min((abs(x - y) for y in known), default=math.inf), abs(x)) for x in squares]
        if any(not miss <= _AGREEMENT * own + _ROUNDED * largest for miss, own in missed):
            self.reasons["formulas and eigenvalues are not the same at the declared parameters"] = None
            return None
        return found

    @property
    def _in_floats(self) -> tuple[Floats, Floats, Floats]:
        given = self.matrices
        assert given is not None
        matrices = (given.mass, given.gyroscopic, given.stiffness)
        M, G, K = (np.array([[float(x.sample) for x in row] for row in a]) for a in matrices)
        return M, G, K

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The modes, those that oscillate first."""
        given = self.matrices
        if given is not None and len(given.places) == 1 and given.is_damped:
            return damped_modes(given, self.formulas, self.names[0])
        if self.spectrum is None:
            return modes_in_numbers(self.place.linear, deviation_names(self.mechanism))
        order = {"oscillates": 0, "free": 1, "grows": 2, "decays": 3}
        found = (mode for root in self.spectrum.roots for mode in self._modes(root))
        return tuple(sorted(found, key=lambda mode: order[mode.motion]))

    def _modes(self, root: Root) -> list[Mode]:
        vectors = shapes_in_numbers(*self._in_floats, complex(root.value), root.times)
        return [self._mode(root, *self._shape(root, v)) for v in vectors]

    def _mode(self, root: Root, shape: dict[str, Value], quarter: dict[str, Value]) -> Mode:
        assert self.spectrum is not None
        value = complex(root.value)
        if root.rests:
            return Mode("free", shape=shape, quarter=quarter)
        if value.imag:
            rate = complex(np.sqrt(-value))
            swings = Value(abs(rate.imag), None, "rad/s"), Value(2 * np.pi / abs(rate.imag), None, "s")
            return Mode("grows", *swings, Value(abs(rate.real), None, "1/s"), shape, quarter)
        if value.real > 0.0:
            return Mode("oscillates", self.formulas.frequency(root), self.formulas.period(root), None, shape, quarter)
        return Mode("grows", rate=self.formulas.rate(root), shape=shape, quarter=quarter)

    def _shape(self, root: Root, v: Vector) -> tuple[dict[str, Value], dict[str, Value]]:
        given = self.matrices
        assert given is not None
        exactly = not given.is_gyroscopic
        real = self.formulas.shape(root, [float(x.real) for x in v], exactly=exactly)
        quarter = dict(zip(self.names, (Value(float(x.imag)) for x in v), strict=True)) if any(v.imag) else {}
        return dict(zip(self.names, real, strict=True)), quarter

    @property
    def names(self) -> list[str]:
        """The names of the independent deviations."""
        names = deviation_names(self.mechanism)
        return [] if self.matrices is None else [names[k] for k in self.matrices.places]

    # --- stability ------------------------------------------------------------------------------------------------

    @property
    def stable(self) -> bool | None:
        """Whether small motions stay small; None where some move off uniformly."""
        rates = [x.real for x in self.place.linear.eigenvalues]
        motions = {mode.motion for mode in self.modes}
        if "grows" in motions or (self.matrices is None and max(rates, default=0.0) > 0.0):
            return False
        return None if "free" in motions else True

    def conditions(self) -> list[str]:
        """Return the conditions under which motions stay small, or grow where they do, without redundant ones."""
        if self.spectrum is None or self.matrices is None:
            return []
        field = self.matrices.field
        field.work = max(field.work, _WORK_OF_CONDITIONS)
        signs = self.spectrum.signs
        broken = [replace(each, value=-each.value) for each in signs if each.value.sample < 0]
        broken = broken[-1:] if self.matrices.is_gyroscopic else broken  # any of them is enough
        used = [x for a in (self.matrices.mass, self.matrices.rates, self.matrices.stiffness) for row in a for x in row]
        said = [*(broken or signs), *([] if self.matrices.is_gyroscopic else self._written_for()), *under_roots(used)]
        try:
            return [str(each) for each in reduced(said)]
        except NoClosedFormError:
            self.reasons["a condition is too long"] = None
            return []

    def _written_for(self) -> list[Condition]:
        """Return the choices of signs on which formulas rest."""
        return [] if self.matrices is None else [Condition(x, strict=True) for x in self.matrices.field.positive]

    def as_modes(self) -> Modes:
        given, place = self.matrices, self.place
        conditions = self.conditions()
        names = self.names or [name for name in deviation_names(self.mechanism) if name in place.linear.states]
        return Modes(
            name=self.mechanism.name,
            coordinates=tuple(names),
            about=place.kind,
            at=state_values(self.mechanism, place.begin, self.state),
            found=place.found,
            mass=self._values(None if given is None else given.mass),
            rates=self._values(None if given is None else given.rates),
            stiffness=self._values(None if given is None else given.stiffness),
            modes=tuple(self._with_shared_roots()),
            stable=self.stable,
            conditions=tuple(dict.fromkeys(conditions)),
            held=tuple(deviation_names(self.mechanism)[k] for k in self.held),
            characteristic="" if self.spectrum is None else polynomial_text(self.spectrum),
            notes=tuple(self._notes()),
            eigenvalues=tuple(complex(x) for x in place.linear.eigenvalues),
            eigenvalue_errors=tuple(float(x) for x in place.linear.eigenvalue_errors),
        )

    def _with_shared_roots(self) -> list[Mode]:
        """Return the modes with one form of each root in their frequencies, periods and rates."""
        if self.matrices is None:
            return list(self.modes)
        letters = {x.node: x for x in self.matrices.field.letters if x.node is not None}
        values = [x for mode in self.modes for x in (mode.frequency, mode.period, mode.rate) if x is not None]
        shared = dict(zip(values, values_with_shared_roots(values, letters), strict=True))

        def of(value: Value | None) -> Value | None:
            return None if value is None else shared[value]

        return [
            replace(mode, frequency=of(mode.frequency), period=of(mode.period), rate=of(mode.rate))
            for mode in self.modes
        ]

    def _values(self, matrix: Matrix | None) -> Rows:
        return () if matrix is None else tuple(tuple(self.formulas.value(x) for x in row) for row in matrix)

    def _notes(self) -> Sequence[str]:
        notes = [*self.left_out]
        if self.matrices is not None and self.matrices.is_damped and len(self.matrices.places) > 1:
            notes.append(_DAMPED)
        if self.matrices is not None and not self.matrices.balanced:
            notes.append("nothing is accelerated here for the declared parameters; formulas hold where that is so")
        if self.matrices is not None and self.matrices.is_gyroscopic and (chosen := reduced(self._written_for())):
            notes.append(f"formulas are written for {' and '.join(map(str, chosen))}")
        if self.place.stopped:
            turning = any(body.quaternions for body in self.mechanism.bodies)
            notes.append(_STOPPED + (_IN_ANGLES if turning else ""))
        return [*notes, *(f"numbers only, where no formula is given: {reason}" for reason in self.reasons)]
