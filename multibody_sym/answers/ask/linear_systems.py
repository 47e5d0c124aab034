"""Coordinates of coupled linear equations as formulas of time, by normal modes.

    x'' = A x + B x' + f(t)        A, B constant

Where A and B commute (no damping, or Rayleigh's), what x has of each mode, P x with P a product of A - alpha_j and
B - beta_j, is a linear equation of its own, y'' = alpha y + beta y' + P f. Else z = (x, x') with z' = N z + F has such
parts by the factors s^2 - b s - a of its characteristic polynomial, as far as this has factors of that degree:

    y = (P z)_k,    y'' = a y + b y' + (N P F)_k + (P F')_k - b (P F)_k
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field
from functools import cached_property, reduce
from math import pi
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import book_form, product_node
from multibody_sym.algebra.book_form import text as kept_text
from multibody_sym.algebra.quotient_functions import sqrt, with_whole_angles
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient, factors_of
from multibody_sym.algebra.roots import rate
from multibody_sym.analysis.modes.matrices import WORK, Matrices, Matrix
from multibody_sym.analysis.modes.record import Modes, determinant, spectrum
from multibody_sym.analysis.modes.small_motion import SmallMotion, is_linear, time_note
from multibody_sym.answers.ask.courses import InTime, LinearMotion, ShownMotion, formulas_of_time
from multibody_sym.answers.ask.from_runs import Simulated
from multibody_sym.answers.ask.named_answers import Anywhere, Granted
from multibody_sym.answers.ask.working import OMEGA, acceleration, equation, integral_line, solving_lines, written
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME, at_start, quotient_of
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.errors import ExpressionError, NoSolutionError
from multibody_sym.model.settings import Ask
from multibody_sym.model.system import System, expressions, with_expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, flatten, leaves, postorder
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, add, as_node, divide, multiply, real, symbol
from multibody_sym.text.parser import QUANTITIES
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# Linear equations x'' = A x + B x' + f(t) taken apart into such of one unknown each, whose solutions are known.


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
        return sum(parts, ZERO)

    # --- A and B commute ------------------------------------------------------------------------------------------

    def _commutes(self) -> bool:
        size = range(len(self.A))
        both = ((self._times(self.A, column, self.B), self._times(self.B, column, self.A)) for column in size)
        if not all((a - b).is_zero for x, y in both for a, b in zip(x, y, strict=True)):
            return False
        return all(values is not None for values in (self._values(self.A), self._values(self.B)))

    @staticmethod
    def _times(first: Matrix, column: int, second: Matrix) -> Vector:
        return matrix_product(first, [row[column] for row in second])

    def _values(self, matrix: Matrix) -> Vector | None:
        """Return the different eigenvalues of a matrix, None where not all are real and have formulas."""
        field, size = self.there.forms.field, range(len(matrix))
        if all(x.is_zero for row in matrix for x in row):
            return [field.constant(0)]
        unit = [[field.constant(int(i == j)) for j in size] for i in size]
        none = [[field.constant(0) for _ in size] for _ in size]
        negative = [[-x for x in row] for row in matrix]
        roots = spectrum(Matrices(field, tuple(size), unit, none, negative, unit, {}, balanced=True)).roots
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
        course = LinearMotion(self.there, self.granted, a, b, f).course(written(x), written(u))
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
                yield LinearMotion(self.there, self.granted, x * 0, factor.b, driven).fading(x, u)
            else:
                yield self._one(factor.a, factor.b, x, u, driven)

    def _moved(self, z: Vector) -> Vector:
        n = len(self.A)
        x, u = z[:n], z[n:]
        return [*u, *(a + b for a, b in zip(matrix_product(self.A, x), matrix_product(self.B, u), strict=True))]

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
        for p, times in factors_of(determinant(entries).above)[1]:
            powers = field.coefficients(p, place)
            if len(powers) > 1:
                yield from _of_degree(powers, times)

    def _rate(self, a: Quotient) -> Quotient:
        return self._again(derivative(written(a), TIME)) if not self.there.constant(a) else a * 0

    def _at_start(self, a: Quotient) -> Quotient:
        return self._again(at_start(written(a))) if not self.there.constant(a) else a

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
            moved = matrix_product(matrix, vector)
            vector = [(y - other * x) / (value - other) for x, y in zip(vector, moved, strict=True)]
    return vector


def matrix_product(matrix: Matrix, vector: Vector) -> Vector:
    return [
        reduce(lambda s, pair: s + pair[0] * pair[1], zip(row, vector, strict=True), vector[0] * 0) for row in matrix
    ]


# ----------------------------------------------------------------------------------------------------------------------

_MOST: Final = 4
"""Coordinates whose equations hang together, and for which this is tried."""
_LONGEST: Final = 1000
"""Letters of a formula that tells more than its numbers do."""


_BY_SPEED: Final = "solved for it and integrated"


@dataclass(frozen=True, eq=False)
class Courses:
    """Coordinates and speeds of a solved system as formulas of time, by their symbols, where `motion` confirms them.

    They hold until a state changes first, or until a speed turns back on which accelerations depend by its sign.
    """

    solved: SolvedInstant
    motion: Simulated
    _found: dict[Node, InTime | None] = field(default_factory=dict)
    _why: dict[Node, str] = field(default_factory=dict)

    @cached_property
    def shown(self) -> ShownMotion:
        return ShownMotion.of(self.solved, self.motion)

    @cached_property
    def alone(self) -> Mapping[Node, InTime]:
        """Those whose equations name no other coordinate."""
        return {} if self.shown.there is None else self.shown.confirmed(formulas_of_time(self.shown.there))

    def of(self, node: Node) -> InTime | None:
        """Return a coordinate or speed as a formula of time; None where none is known, and `why` tells the reason."""
        if node in self.alone:
            return self.alone[node]
        if node not in self._found:
            self._found[node] = None
            try:
                self._found[node] = self._coupled(str(node.data))
            except NoClosedFormError as reason:
                self._why[node] = str(reason)
        return self._found[node]

    def equations(self, nodes: Collection[Node]) -> Iterator[Line]:
        """Yield, for coordinates and speeds, the equation of motion of each and its solution from the start."""
        mechanism, there = self.solved.mechanism, self.shown.there
        assert there is not None
        for k, (q, u) in enumerate(zip(mechanism.coordinates, mechanism.speeds, strict=False)):
            named = [node for node in (symbol(q.name), symbol(u.name)) if node in nodes]
            if named:
                moved = there.forms.udot[k]
                yield equation(acceleration(mechanism, k), written(moved))
                how = self._how(moved, symbol(q.name), symbol(u.name))
                if how == _BY_SPEED:
                    start = as_node(there.solved.nodes.motion.state.u[k])
                    yield integral_line(TIME, written(moved.power(-1)), symbol(u.name), start)
                found = [(node, each.formula) for node in named if (each := self.of(node)) is not None]
                letters = self.solved.symbolic.letters
                yield from (equation(node, shortest_course(formula, letters), how) for node, formula in found)

    def _how(self, moved: Quotient, q: Node, u: Node) -> str:
        there = self.shown.there
        assert there is not None
        named = moved.symbols & there.variables
        if named <= {TIME}:
            return "integrated from the start"
        if named == {u} and u in rate(moved, u).symbols:
            return _BY_SPEED
        if named - {q, u, TIME}:
            return "by normal modes, fitted to the start"
        if named <= {q, u} or not (rate(moved, u).symbols | rate(moved, q).symbols) & there.variables:
            return "linear: particular and free motion, fitted to the start"
        return "solved from the start"

    def why(self, node: Node) -> str:
        """Return why a coordinate or speed has no formula, empty where it is not what the motion shows."""
        return self._why.get(node, "")

    def _coupled(self, name: str) -> InTime | None:
        there = self.shown.there
        if there is None:
            raise NoClosedFormError("the equations have no closed form")
        pairs = zip(self.solved.mechanism.coordinates, self.solved.mechanism.speeds, strict=False)
        coordinate = next(q.name for q, u in pairs if name in (q.name, u.name))
        granted = Granted()
        with there.assuming(granted):
            formula = _coupled_course(there, granted, coordinate)
            formula = formula if name == coordinate else derivative(formula, TIME)
        if len(text(formula)) > _LONGEST:
            raise NoClosedFormError("the formula is too long")
        return self.shown.confirmed({symbol(name): InTime(formula, granted)}).get(symbol(name))


def _coupled_course(there: Anywhere, granted: Granted, coordinate: str) -> Node:
    """Return a coordinate as a formula of time. Raises NoClosedFormError, which says why it has none."""
    mechanism = there.solved.mechanism
    names = [c.name for c in mechanism.coordinates]
    if len(names) != len(mechanism.speeds):
        raise NoClosedFormError("coordinates have no speeds of their own")
    q, u = (list(map(symbol, each)) for each in (names, [s.name for s in mechanism.speeds]))
    place = names.index(coordinate)
    group = [place]  # the coordinates whose equations name each other's
    for k in group:
        named = there.forms.udot[k].symbols
        group += [j for j in range(len(q)) if named & {q[j], u[j]} and j not in group]
    group.sort()
    if len(group) > _MOST:
        raise NoClosedFormError(f"{len(group)} equations hang together")
    q = [q[k] for k in group]
    u = [u[k] for k in group]
    there.forms.field.work = max(there.forms.field.work, WORK)
    stiffness, losses, forces = [], [], []
    for k in group:
        acceleration = there.forms.udot[k]
        along, by_speed = ([rate(acceleration, x) for x in each] for each in (q, u))
        left = acceleration
        for x, slope in zip((*q, *u), (*along, *by_speed), strict=True):
            left = left - slope * there.letter(x)
        if not all(map(there.constant, (*along, *by_speed))) or left.symbols & (there.variables - {TIME}):
            raise NoClosedFormError("the equations are no x'' = A x + B x' + f(t) with constant A and B")
        stiffness.append(along)
        losses.append(by_speed)
        forces.append(left)
    state = there.solved.nodes.motion.state
    starts = [there.forms.of([as_node(values[k]) for k in group]) for values in (state.q, state.u)]
    return Coupled(there, granted, stiffness, losses, forces, *starts).course(group.index(place))


# ----------------------------------------------------------------------------------------------------------------------
# Frequencies and periods of small oscillations in questions: `ask: {omega: frequency(1), T: period(1)}`.


@dataclass(frozen=True)
class AskedModes:
    """What the small oscillations about the start of a system, or about the state beside it, are asked.

    `letters`: the symbols that formulas may name.
    """

    system: System
    letters: Collection[Node] = ()

    @cached_property
    def modes(self) -> Modes:
        """The small motions. Raises NoSolutionError where there are none."""
        return self._small.as_modes()

    @cached_property
    def _small(self) -> SmallMotion:
        return SmallMotion.of(self.system)

    def value(self, leaf: Node) -> Value:
        """Return the frequency or period that a quantity asks for. Raises NoSolutionError without such a mode."""
        found = self.modes.frequencies if leaf.data[0] == "frequency" else self.modes.periods
        number = int(leaf.data[1][0])
        if number > len(found):
            count = {0: "no mode oscillates", 1: "one mode oscillates"}.get(len(found), f"{len(found)} modes oscillate")
            growing = next((mode.rate for mode in self.modes.modes if mode.motion == "grows" and mode.rate), None)
            grows = "" if growing is None else f", and one grows, as exp({growing.value:.6g}/s*t): it is unstable"
            about = f"in small motions about the {self.modes.about}{grows}"
            raise NoSolutionError(f"{leaf}: {count} {about}", number="N111")
        return found[number - 1]

    def lines(self, leaf: Node) -> Iterator[Line]:
        """Yield M x'' + C x' + K x = 0 row by row, of which a frequency or period is asked."""
        modes = self.modes
        if not modes.stiffness:
            return
        for name, value in modes.at.items() if modes.found else ():
            if value.value:
                yield Formula((symbol(name), _known(value)), before=(f"the {modes.about} is at",))
        yield Sentence((f"small deviations from the {modes.about} swing as cos({OMEGA}*t):",))
        for mass, rates, stiffness in zip(modes.mass, modes.rates, modes.stiffness, strict=True):
            terms = [
                known * x
                for row, dots in ((mass, "''"), (rates, "'"), (stiffness, ""))
                for value, name in zip(row, modes.coordinates, strict=True)
                if value.value and (known := value.expression or real(value.value))
                for x in (symbol(name + dots),)
            ]
            yield equation(sum(terms, ZERO), ZERO)
        if len(modes.coordinates) > 1:
            yield from self._determinant(self.value(leaf), leaf)
            yield from self._shape(int(leaf.data[1][0]))
        elif not any(x.value for row in modes.rates for x in row):
            square = _known(modes.stiffness[0][0]) / _known(modes.mass[0][0])
            yield equation(OMEGA**2, min(square, *self._forms(square), key=lambda x: len(text(x))), "so")
        if leaf.data[0] == "period":
            yield Sentence((f"the period is 2*pi/{OMEGA}",))

    def _determinant(self, value: Value, leaf: Node) -> Iterator[Line]:
        """Yield the determinant of K - omega^2 M of two or three freedoms, in factors, and the root that is taken."""
        modes, square = self.modes, OMEGA**2
        number, rates = int(leaf.data[1][0]), np.array([[x.value or 0.0 for x in row] for row in modes.rates])
        least = _ROUNDED * float(np.abs(rates).max(initial=0.0))
        damped = bool((np.abs(rates + rates.T) > least).any())
        gyroscopic = bool((np.abs(rates - rates.T) > least).any())
        yield Sentence((f"amplitudes differ from zero where the determinant vanishes{' without dampers' * damped}:",))
        rows = [
            [_known(k) - _known(m) * square for m, k in zip(*row, strict=True)]
            for row in zip(modes.mass, modes.stiffness, strict=True)
        ]
        if len(rows) > (2 if gyroscopic else _MOST_WRITTEN_OUT):
            yield Sentence((f"a root in {OMEGA}^2 of degree {len(rows)}, found in numbers",))
            return
        whole = _by_cofactors(rows)
        if gyroscopic:  # (a + i omega g)*(a - i omega g) is a^2 + omega^2 g^2
            forth, back = _known(modes.rates[0][1]), _known(modes.rates[1][0])
            turning = (forth - back) / real(2.0) if damped else forth
            whole = whole - square * turning**2
        yield equation(whole, ZERO)
        if value.value is None:
            return
        at = value.value if leaf.data[0] == "frequency" else 2 * pi / value.value
        known = {x: letter for x, letter in self.samples.items() if x is not OMEGA}
        lines = solving_lines(whole, OMEGA, real(at), known, {x: float(y.sample) for x, y in known.items()})
        yield from (line for line in lines if line.sides[1] is ZERO)
        yield Sentence((f"of the roots {OMEGA} > 0 this is number {number} by size",))

    @property
    def samples(self) -> Mapping[Node, Letter]:
        """The symbols that formulas may name, with their values."""
        return self.letters if isinstance(self.letters, Mapping) else {}

    def _forms(self, node: Node) -> Iterator[Node]:
        with suppress(NoClosedFormError, ExpressionError):
            yield written(quotient_of(node, self.samples, _WORK))

    def _shape(self, number: int) -> Iterator[Line]:
        """Yield the amplitudes of a mode beside the first that moves; nothing where parts of it are ahead."""
        mode = self.modes.modes[number - 1]
        if mode.quarter or len(mode.shape) < 2:
            return
        first, *others = mode.shape
        if mode.shape[first].value != 1.0:
            return
        for name in others:
            ratio = mode.shape[name]
            known = ratio.expression or real(float(f"{ratio.value or 0.0:.6g}"))
            yield equation(symbol(name), known * symbol(first), "then the amplitudes are")

    def put_in(self, question: Ask) -> tuple[Ask, bool]:
        """Return a question with values in the place of frequencies and periods, and whether all had closed forms.

        Those that name coordinates of the state about which they are have none here: at the start these are others.
        """
        known: dict[Node, Node] = {}
        closed = True
        for leaf in modes_named(question):
            value = self.value(leaf)
            parts = leaves([value.expression], "symbol") if value.expression is not None else []
            whole = value.expression if all(x in self.letters for x in parts) else None
            closed = closed and whole is not None
            known[leaf] = whole if whole is not None else real(float(value.value or 0.0))
        changed: Ask = with_expressions(
            question, lambda node: evaluate([node], lambda leaf: known.get(leaf, leaf))[0]
        )
        return changed, closed

    def remarks(self) -> list[str]:
        """Return what the answers rest on: the state, where it is not the start, and the conditions of stability."""
        modes, place = self.modes, self._small.place
        found = [f"{condition}, else small motions grow" for condition in modes.conditions]
        driven = time_note(self.system, place.flow, place.begin)
        if driven is not None and is_linear(place.flow, place.begin):
            return [*found, *(x for x in modes.notes if "numbers only" not in x and x != driven)]  # about any state
        if modes.found:
            at = ", ".join(f"{name} = {value}" for name, value in modes.at.items())
            found.insert(0, f"small oscillations are those about the {modes.about} at {at}, beside the start")
        return [*found, *(note for note in modes.notes if "numbers only" not in note)]


def _by_cofactors(rows: Sequence[Sequence[Node]]) -> Node:
    if len(rows) == 1:
        return rows[0][0]
    minors = ([[*row[:k], *row[k + 1 :]] for row in rows[1:]] for k in range(len(rows)))
    terms = (x * _by_cofactors(minor) * (-1) ** k for k, (x, minor) in enumerate(zip(rows[0], minors, strict=True)))
    return sum(terms, ZERO)


def _known(value: Value) -> Node:
    """Return a value as its formula, or its number where it has none."""
    return value.expression if value.expression is not None else real(value.value or 0.0)


_ROUNDED: Final = 1e-9
"""Part of the largest rate up to which a difference of two is rounding."""
_MOST_WRITTEN_OUT: Final = 3
"""Freedoms up to which a determinant is written out."""


def modes_named(question: Ask) -> list[Node]:
    """Return the frequencies and periods that a question names."""
    named = leaves([written.node for written in expressions(question)], "quantity")
    return [leaf for leaf in named if QUANTITIES[leaf.data[0]].of_mode] if named else []


# ----------------------------------------------------------------------------------------------------------------------
# Courses of coordinates as a book writes them: forced parts over one divisor, what fades with one exponential.


_WORK: Final = 20_000
"""How much is done for one way to write a course, in products of terms."""

_PLAIN: Final = frozenset(("number", "pi", "symbol", "neg", "add", "mul", "div", "pow", "sqrt"))


def shortest_course(course: Node, letters: Mapping[Node, Letter]) -> Node:
    """Return a formula of time in the shortest of the ways to put its terms together; `letters`: its other symbols.

    The particular solution is one quotient, and so is what each exponential stands before.
    """
    shortest = _Shortest({**letters, TIME: Letter(TIME, PRECISE.mpf(1), True)})
    terms = flatten("add", course)
    fading = [term for term in terms if any(part.op == "exp" for part in postorder([term]))]
    lasting = sum((term for term in terms if term not in fading), ZERO)
    together = reduce(add, map(shortest, fading), shortest(lasting))
    return min((together, shortest(course)), key=_length)


def _length(node: Node) -> int:
    return len(kept_text(node))


@dataclass(frozen=True)
class _Shortest:
    """Writes a formula as one quotient or as what its parts are written as, whichever is shorter."""

    letters: Mapping[Node, Letter]
    known: dict[Node, Node] = field(default_factory=dict)

    def __call__(self, node: Node) -> Node:
        if node not in self.known:
            self.known[node] = min(self._ways(node), key=_length)
        return self.known[node]

    def _ways(self, node: Node) -> Iterator[Node]:
        """Yield the ways, among equals that one first which books prefer: c*t/(2*m), but m/k*log(x)."""
        if not node.args:
            yield node
            return
        quotient = self._quotient(node)
        if quotient is not None and all(part.op in _PLAIN for part in postorder([quotient])):
            yield quotient
        if node.op in ("add", "mul"):
            parts = [self(part) for part in flatten(node.op, node)]
            divisors = [part.args[1] for part in parts if part.op == "div"]
            if node.op == "add":
                yield sum(parts, ZERO)
            elif divisors and not any(part.op == "exp" for part in parts):  # m/k*log(x), but F*exp(-c*t)*(k - m)/S
                yield reduce(multiply, parts)
            else:
                whole = product_node((part.args[0] if part.op == "div" else part, 1) for part in parts)
                yield reduce(divide, divisors, whole)
        else:
            yield BUILD[node.op](*node.own, *map(self, node.args))
        yield node if quotient is None else quotient
        if node.op == "div" and node.args[1].op == "div":  # a/(b/c) as a c/b, each term of a by itself
            above, below = node.args[1].args
            terms = (self(below * term) for term in flatten("add", node.args[0]))
            yield sum(terms, ZERO) / self(above)

    def _quotient(self, node: Node) -> Node | None:
        used = set(leaves([node], "symbol"))  # monomials have an exponent for each letter
        letters = {x: letter for x, letter in self.letters.items() if x in used}
        try:
            return book_form(with_whole_angles(quotient_of(node, letters, _WORK)), apart=1.0)
        except NoClosedFormError:
            return None
