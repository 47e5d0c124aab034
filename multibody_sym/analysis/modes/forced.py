"""Steady motions under a harmonic input F = mean + F0 sin(w t), linear about the state that its mean leaves at rest.

    M x'' + C x' + K x = f0 F + f1 F' + f2 F'',    x = Re(X exp(i w t))
    (K - w^2 M + i w C) X = (f0 + i w f1 - w^2 f2) F0

In: a System and the name of an input. Out: a ForcedMotion with X/F0 as a number, and as a quotient of polynomials in
s = i w where M, C and K have formulas. F' and F'' act where the input moves a joint. Source: J. P. Den Hartog,
Mechanical Vibrations (1956), chapters 2 and 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient
from multibody_sym.analysis.deviations import deviation_names
from multibody_sym.analysis.modes.matrices import WORK, Matrices
from multibody_sym.analysis.modes.record import determinant
from multibody_sym.analysis.modes.small_motion import SmallMotion
from multibody_sym.derivation.symbolic_start import linear_equations
from multibody_sym.dynamics.start.initial_geometry import fix_directions
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.spanning_tree import free_name
from multibody_sym.model.fields import Names
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.calculus import derivative, tangents
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import apply, evaluate, evaluate_float
from multibody_sym.scalars.node import ONE, TWO, ZERO, Node, add, as_node, divide, multiply, nodes_among, slot, symbol
from multibody_sym.scalars.rank import ROUNDED, least_squares

_T: Final = symbol("t")
_WAVE: Final = symbol("wave of an input")
_S: Final = symbol("s of an input")
_ASIDE: Final = PRECISE.mpf("0.8310585786300049")
_SAME: Final = 1e-9
_UNDAMPED: Final = 1e-10
"""The damping ratio below which a mode is undamped, as rounding of eigenvalues is no damping."""
_NEAR, _POLE = 1e-7, 5.0
"""Ten times nearer to a resonance the amplitude is at least five times as large."""
_DECADES, _POINTS, _WIDTH = 100.0, 400, 6
_RESTS: Final = 1e-8
_STILL: Final = 1e-14
"""The part of the largest amplitude below which one is rounding."""
_LARGE: Final = 1e6
MOST_LETTERED: Final = 3
"""The most freedoms for which amplitudes are formulas."""


@dataclass(frozen=True)
class HarmonicInput:
    """An input `mean` + `amplitude` sin(`angle`), or cos, with expressions of parameters; `angle` is linear in time."""

    name: str
    mean: Node
    amplitude: Node
    angle: Node
    is_sine: bool

    @property
    def frequency(self) -> Node:
        """The rate of the angle (rad/s)."""
        return derivative(self.angle, _T)

    @classmethod
    def of(cls, system: System, name: str) -> HarmonicInput:
        """Return an input of a system. Raises NoSolutionError where it is not harmonic."""
        for expression in nodes_among([system.inputs[name]]):
            waves = {x for x in postorder([expression]) if x.op in ("sin", "cos") and _T in leaves([x], "symbol")}
            if len(waves) == 1:
                (wave,) = waves
                mean, (angle,) = _waves_replaced(expression, wave, ZERO), wave.args
                amplitude = derivative(_waves_replaced(expression, wave, _WAVE), _WAVE)
                found = cls(name, mean, amplitude, angle, wave.op == "sin")
                if not {_WAVE, _T}.intersection(leaves([mean, amplitude, found.frequency], "symbol")):
                    return found
        raise NoSolutionError(
            f"{name} is no harmonic input: declare it with one wave, such as {name}: F0*sin(w*t)", number="N111"
        )


def _waves_replaced(given: Node, wave: Node, by: Node) -> Node:
    made: dict[Node, Node] = {}
    for n in postorder([given]):
        made[n] = by if n is wave else apply(n.op, *(made[a] for a in n.args), own=n.own) if n.args else n
    return as_node(made[given])


class Transfer(NamedTuple):
    """X/F0 = `above` / `below`, polynomials in s = i w: coefficients of s^0, s^1, .. each."""

    above: tuple[Quotient, ...]
    below: tuple[Quotient, ...]


def at_frequency(powers: Sequence[Quotient], omega: Quotient) -> tuple[Quotient, Quotient]:
    """Return the real and the imaginary part of a polynomial in s at s = i omega."""
    real = imaginary = omega * 0
    for k, c in enumerate(powers):
        term = c * omega.power(k) * (-1 if k % 4 > 1 else 1)
        real, imaginary = (real, imaginary + term) if k % 2 else (real + term, imaginary)
    return real, imaginary


@dataclass(frozen=True, eq=False)
class ForcedMotion:
    """The steady motion of a system under one harmonic input, `drive`; `small`: the free motions about its middle.

    `driven` is the mechanism with parameters `rates` in place of the input's wave, its rate and its second rate.
    """

    drive: HarmonicInput
    small: SmallMotion
    driven: Mechanism
    parameters: tuple[float, ...]
    rates: tuple[Node, Node, Node]

    @classmethod
    def of(cls, system: System, name: str) -> ForcedMotion:
        """Return the motion under an input of a system, other waves of time being left out.

        Raises NoSolutionError where the input is not harmonic, moves a constraint, or nothing stands still.
        """
        drive = HarmonicInput.of(system, name)
        small = SmallMotion.of(_with_input(system, name, drive.mean))
        names = [free_name(f"{name}_{k}", (*system.parameters, *system.inputs)) for k in range(3)]
        wave, rate, second = (symbol(x) for x in names)
        later = add(multiply(rate, _T), divide(multiply(second, multiply(_T, _T)), TWO))
        course = add(drive.mean, add(wave, later))
        parameters = Names({**system.parameters, **{x: Parameter(ZERO) for x in names}})
        driven, first = examined_state(_with_input(replace(system, parameters=parameters), name, course)).in_joints
        begin = small.place.begin
        formal, _ = fix_directions(driven, begin.q, begin.u, first.parameters)
        rates = tuple(formal.symbols[x] for x in (wave, rate, second))
        return cls(drive, small, formal, first.parameters, rates)  # type: ignore[arg-type]

    @cached_property
    def _equations(self) -> tuple[list[list[Node]], list[list[Node]]]:
        """The matrix [[M, -C^T], [H, D]] and the right sides by F, F' and F''. Raises NoSolutionError."""
        mechanism = self.driven
        q, u, parameters = (
            [slot(kind, k) for k in range(len(each))]
            for kind, each in (
                ("q", mechanism.coordinates), ("u", mechanism.speeds), ("parameters", mechanism.parameters),
            )
        )
        matrix, right = linear_equations(motion_of(mechanism, state_of(mechanism, Node, TIME, q, u, parameters)))
        matrix, right = [[as_node(x) for x in row] for row in matrix], [as_node(x) for x in right]
        size, columns = len(u), [tangents(right, {x: ONE}) for x in self.rates]
        rows = [*(x for row in matrix[size:] for x in row), *right[size:]]
        if any(set(self.rates).intersection(leaves([x], "slot")) for x in rows):
            raise NoSolutionError(
                f"{self.drive.name} moves a constraint, and steady motions are those under forces and moved joints; "
                f"declare it as the motion of a joint",
                number="N111",
            )
        return matrix, columns

    # --- numbers --------------------------------------------------------------------------------------------------

    @cached_property
    def _columns(self) -> Floats:
        """The accelerations (nu x 3) by F, F' and F''."""
        matrix, columns = self._equations
        begin = self.small.place.begin
        known = {TIME: 0.0}
        for kind, values in (("q", begin.q), ("u", begin.u), ("parameters", self.parameters)):
            known.update((slot(kind, k), x) for k, x in enumerate(values))
        left = np.array([evaluate_float(row, known) for row in matrix])
        right = np.array([evaluate_float(column, known) for column in columns])
        solved = [least_squares(left, column, ROUNDED) for column in right]
        return np.array(solved).T[: len(begin.u)]

    def value(self, node: Node) -> float:
        """Return the value of an expression of parameters."""
        symbols = self.driven.symbols
        known = {slot("parameters", k): x for k, x in enumerate(self.parameters)}
        return evaluate_float(evaluate([node], lambda leaf: symbols.get(leaf, leaf)), known)[0]

    def number(self, name: str, omega: float) -> complex:
        """Return X/F0 of a coordinate at a frequency (rad/s)."""
        return self.number_and_slope(name, omega)[0]

    def number_and_slope(self, name: str, omega: float) -> tuple[complex, complex]:
        """Return X/F0 of a coordinate at a frequency (rad/s), and its derivative by that; infinite at a resonance."""
        A, B, row = self._state_space(name)
        s = 1j * omega
        left = s * np.eye(len(A)) - A
        try:
            x = np.linalg.solve(left, B @ [1.0, s, s * s])
            slope = np.linalg.solve(left, 1j * (B @ [0.0, 1.0, 2 * s] - x))
        except np.linalg.LinAlgError:
            return complex(np.inf), complex(np.inf)
        found = complex(row @ x)
        return found if abs(found) > _STILL * np.abs(x).max(initial=0.0) else 0j, complex(row @ slope)

    def _state_space(self, name: str) -> tuple[Floats, Floats, Floats]:
        """Return A, the columns of B by F, F' and F'', and the row by which a coordinate follows the states."""
        place, begin = self.small.place, self.small.place.begin
        speeds = [s.name for s in self.driven.speeds]
        B = np.zeros((len(place.linear.states), 3))
        for k, state in enumerate(place.linear.states):
            if state in speeds:
                B[k] = self._columns[speeds.index(state)]
        X = place.flow.tangents(np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)).X
        return place.linear.A, B, X[deviation_names(self.small.mechanism).index(name)]

    def resonance(self, name: str) -> float:
        """Return the frequency (rad/s) of a coordinate's greatest amplitude; of infinite ones the lowest.

        Raises NoSolutionError where the amplitude only falls, or only rises, with the frequency.
        """
        A = self._state_space(name)[0]
        values = np.linalg.eigvals(A)
        undamped = sorted(x.imag for x in values if x.imag > 0.0 and abs(x.real) <= _UNDAMPED * abs(x))
        for omega in undamped:
            near, far = (abs(self.number(name, omega * (1.0 + a))) for a in (_NEAR, 10 * _NEAR))
            if near > _POLE * far:
                return float(omega)
        sizes = np.abs(values)[np.abs(values) > 0.0]
        if not len(sizes):
            raise NoSolutionError(f"nothing holds {name}: no frequency has a greatest amplitude", number="N111")
        grid = [np.geomspace(sizes.min() / _DECADES, sizes.max() * _DECADES, _POINTS)]
        grid += [x.imag + abs(x.real) * np.linspace(-_WIDTH, _WIDTH, 4 * _WIDTH + 1) for x in values if x.imag > 0.0]
        tried = np.unique(np.concatenate(grid))
        tried = tried[tried > 0.0]
        if not any(self.number(name, w) for w in tried):
            raise NoSolutionError(f"{self.drive.name} does not move {name}", number="N111")
        slopes = np.array([self._steepness(name, w) for w in tried])
        tops = np.flatnonzero((slopes[:-1] > 0.0) & (slopes[1:] <= 0.0))
        if not len(tops):
            way = "falls" if slopes[len(slopes) // 2] <= 0.0 else "rises"
            raise NoSolutionError(
                f"the amplitude of {name} {way} with the frequency all along: there is no resonance; one freedom has "
                "one where its damping ratio is below 1/sqrt(2)",
                number="N111",
            )
        from scipy.optimize import brentq  # scipy takes longer to import than most answers take

        exactly = {"xtol": 1e-300, "rtol": 1e-14}
        found = [brentq(lambda w: self._steepness(name, w), tried[k], tried[k + 1], **exactly) for k in tops]
        return float(max(found, key=lambda w: abs(self.number(name, w)) * self._amplitude(w)[0]))

    def _steepness(self, name: str, omega: float) -> float:
        """Return the derivative of log |X| by the frequency."""
        x, slope = self.number_and_slope(name, omega)
        if x == 0.0:
            return 0.0
        amplitude, rate = self._amplitude(omega)
        return (slope / x).real + rate / amplitude

    def _amplitude(self, omega: float) -> tuple[float, float]:
        """Return F0 at a frequency, and its derivative by that where the frequency is a parameter."""
        amplitude, pace = self.drive.amplitude, self.drive.frequency
        if pace.op != "symbol":
            return self.value(amplitude), 0.0
        nodes = [amplitude, derivative(amplitude, pace)]
        known = {x: omega if x == pace else self.value(x) for x in leaves(nodes, "symbol")}
        value, rate = evaluate_float(nodes, known)
        return abs(value), rate if value >= 0.0 else -rate

    def antiresonance(self, name: str) -> float:
        """Return the lowest frequency (rad/s) at which a coordinate rests. Raises NoSolutionError without one."""
        A, B, row = self._state_space(name)
        b0, b1, b2 = B.T
        size = len(A)
        pencil, ones = np.zeros((size + 1, size + 1)), np.diag([*[1.0] * size, 0.0])
        pencil[:size, :size], pencil[:size, size] = A, b0 + A @ (b1 + A @ b2)
        pencil[size, :size], pencil[size, size] = row, row @ b1 + row @ A @ b2
        from scipy.linalg import eigvals  # scipy takes longer to import than most answers take

        zeros = eigvals(pencil, ones)
        largest = float(np.abs(A).max(initial=0.0)) * _LARGE
        zeros = zeros[np.isfinite(zeros) & (np.abs(zeros) < max(largest, 1.0))]
        still = sorted(x.imag for x in zeros if x.imag > 0.0 and abs(x.real) <= _RESTS * abs(x))
        if not still:
            raise NoSolutionError(f"{name} rests at no frequency of {self.drive.name}", number="N111")
        return float(still[0])

    @property
    def is_linear(self) -> bool:
        """Whether the equations are linear, so that the motion may be of any size."""
        matrix, columns = self._equations
        if set(self.rates).intersection(leaves([x for row in (*matrix, *columns) for x in row], "slot")):
            return False
        flow, begin = self.small.place.flow, self.small.place.begin
        q, u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
        states = [(q + a * np.cos(1.7 * np.arange(len(q))), u + a * np.sin(1 + np.arange(len(u)))) for a in (0.0, 0.37)]
        try:
            here, there = (flow.derivatives(flow.known(*state))[0] for state in states)
        except UNDEFINED:
            return False
        return bool(np.abs(here - there).max(initial=0.0) <= _SAME * max(1.0, float(np.abs(here).max(initial=0.0))))

    # --- formulas -------------------------------------------------------------------------------------------------

    @property
    def matrices(self) -> Matrices:
        """M, C and K. Raises NoClosedFormError where there are none, or formulas would be too long."""
        given = self.small.matrices
        if given is None:
            raise NoClosedFormError(next(iter(self.small.reasons), "the equations have no closed form"))
        if self.small.held or len(given.places) > MOST_LETTERED:
            raise NoClosedFormError(f"amplitudes of more than {MOST_LETTERED} freedoms are numbers")
        return given

    def exact(self, node: Node) -> Quotient:
        """Return an expression of parameters as a quotient. Raises NoClosedFormError."""
        known = dict(self.matrices.known)
        in_slots = evaluate([node], lambda leaf: self.driven.symbols.get(leaf, leaf))
        return exact(self.matrices.field, in_slots, known)[0]

    @cached_property
    def forces(self) -> tuple[tuple[Quotient, ...], ...]:
        """f0, f1 and f2 along the independent deviations. Raises NoClosedFormError."""
        given = self.matrices
        _, columns = self._equations
        known = dict(given.known) | dict.fromkeys(self.rates, given.field.constant(0))
        known.setdefault(TIME, given.field.constant(0))
        size, zero = len(self.driven.speeds), given.field.constant(0)
        found = []
        for column in columns:
            pushes = exact(given.field, column[:size], known)
            found.append(tuple(sum((a * f for a, f in zip(x, pushes, strict=True)), zero) for x in given.tangents))
        return tuple(found)

    def transfer(self, name: str) -> Transfer:
        """Return X/F0 of a coordinate, by Cramer's rule. Raises NoClosedFormError."""
        given, forces = self.matrices, self.forces
        field = given.field
        field.work = max(field.work, WORK)
        s = field.letter(_S, Letter(_S, _ASIDE * abs(PRECISE.mpf(self.exact(self.drive.frequency).sample))))
        place = field.position(_S)
        assert place is not None
        triples = zip(given.mass, given.rates, given.stiffness, strict=True)
        entries = [[c + s * (b + s * a) for a, b, c in zip(*rows, strict=True)] for rows in triples]
        right = [a + s * (b + s * c) for a, b, c in zip(*forces, strict=True)]
        coordinate = deviation_names(self.small.mechanism).index(name)
        total = field.constant(0)
        for k, x in enumerate(given.tangents):
            if not x[coordinate].is_zero:
                pairs = zip(entries, right, strict=True)
                changed = [[f if j == k else a for j, a in enumerate(row)] for row, f in pairs]
                total = total + x[coordinate] * determinant(changed)
        whole = total / determinant(entries)
        above, below = (field.coefficients(p, place) for p in (whole.above, whole.below))
        return Transfer(tuple(above), tuple(below))


def with_mean_inputs(system: System) -> System:
    """Return a system whose inputs have no waves."""
    inputs: dict[str, object] = {}
    for name, given in system.inputs.items():
        varies = _T in leaves(nodes_among([given]), "symbol")
        try:
            inputs[name] = HarmonicInput.of(system, name).mean if varies else given
        except NoSolutionError:
            inputs[name] = given
    return replace(system, inputs=Names(inputs))


def _with_input(system: System, name: str, course: Node) -> System:
    """Return a system with another course of one input, and no waves in the others."""
    mean = with_mean_inputs(system)
    return replace(mean, inputs=Names({**mean.inputs, name: course}))
