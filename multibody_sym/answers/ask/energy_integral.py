"""Motions of one freedom by another variable than the time: of a place by the energy, of a speed by separation.

    by a place    M(q) q'^2/2 + U(q) = E; other coordinates follow from constraints, or their momenta are conserved
                  where work is done that depends on the place, K = M q'^2/2 has K' = -U' + g(q) + k(q) K
                  t = integral of dq/q', other coordinates: integral of their rate by q', over the same way
    by a speed    u' = f(u): t = integral of du/f(u), x = integral of u du/f(u)

In: equations of motion at any state (`Anywhere`). Out: `MotionFormulas` of that variable.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property
from typing import Final

from multibody_sym.algebra.antiderivatives import RootIntegral, definite_integral, integral_between_turns, powers_of
from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import exact_solve
from multibody_sym.algebra.quotients import PRECISE, Letter, NoClosedFormError, Quotient, factors_of
from multibody_sym.algebra.roots import rate, roots
from multibody_sym.answers.ask.courses import FITS, InTime
from multibody_sym.answers.ask.later_formulas import MotionFormulas, in_book_form, in_letters
from multibody_sym.answers.ask.named_answers import Anywhere, Granted, anywhere
from multibody_sym.answers.ask.working import OMEGA_0, acceleration, equation, integral_line, written
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME, put_in, state_names
from multibody_sym.answers.records import Line, Sentence
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import BUILD, leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ONE, PI, ZERO, Node, add, as_node, symbol

_SAME: Final = 1e-6
"""How near a root is to the coordinate that it is taken for."""

_WORK: Final = symbol("W")
_MODULI: Final = ("k", "kappa", "k_0")
"""Letters of the modulus of elliptic integrals, in the order of preference: the first that the model does not have."""
NEAR_REST: Final = "by elliptic integrals: runs lose a swing that turns so near to a place of unstable rest"
_ENERGIES: Final = ("E", "E_0", "E_total")
"""Letters of the energy, in the order of preference: the first that the model does not have."""

State = tuple[Sequence[float], Sequence[float]]


@dataclass(frozen=True, eq=False)
class OneFreedom:
    """The one freedom left, by its `variable` with the rate `speed`.

    `places` and `rates`: other coordinates and speeds as formulas of both. `held`: the lines that tell why.
    `momenta`: the speeds of coordinates on which nothing depends, which follow by an integral. `values`: a state near
    the moment, at which formulas of constraints are simplified; empty where they are fractions of no zeros.
    `alone`: the acceleration of a coordinate whose equation names no other one; energies are those of a unit mass then.
    `energy`: a letter in place of the energy at the start.
    """

    there: Anywhere
    variable: Node
    speed: Node
    places: Mapping[Node, Node] = field(default_factory=dict)
    rates: Mapping[Node, Node] = field(default_factory=dict)
    momenta: Mapping[Node, Node] = field(default_factory=dict)
    held: Sequence[Line] = ()
    values: Mapping[Node, float] = field(default_factory=dict)
    alone: Quotient | None = None
    energy: Node | None = None
    granted: Granted = field(default_factory=Granted)

    # --- the energy at any place ----------------------------------------------------------------------------------

    @cached_property
    def energies(self) -> tuple[Node, Node]:
        """Kinetic and potential energy at any state."""
        if self.alone is not None:
            return self.speed * self.speed / 2, ZERO
        motion = self.there.instant.motion
        return as_node(kinetic_energy(motion)), as_node(potential_energy(motion))

    @cached_property
    def level(self) -> Node:
        """The energy at the start, or its letter."""
        if self.energy is not None:
            return self.energy
        if self.alone is not None:
            return put_in(self.energies[0], {self.speed: self.at_start(self.speed)})
        motion = self.there.solved.nodes.motion
        return as_node(kinetic_energy(motion)) + as_node(potential_energy(motion))

    @cached_property
    def start(self) -> Node:
        """The variable at the start."""
        return self.at_start(self.variable)

    def at_start(self, node: Node) -> Node:
        """Return a coordinate or speed at the start."""
        mechanism, state = self.there.solved.mechanism, self.there.solved.nodes.motion.state
        return as_node((*state.q, *state.u)[state_names(mechanism).index(str(node.data))])

    def here(self, node: Node) -> Node:
        """Return an expression of the state by the variable and its rate."""
        return put_in(node, {**self.places, **self.rates})

    def of(self, node: Node) -> Quotient:
        """Return an expression of the variable and its rate as a quotient. Raises NoClosedFormError."""
        if not self.values:
            return self.there.forms.of([node])[0]
        return in_letters(self.there, node, self.values)

    def written(self, node: Node) -> Node:
        if not self.values:
            return node
        return in_book_form(self.there, node, self.values)

    @cached_property
    def mass(self) -> Node:
        """M(q). Raises NoClosedFormError where the kinetic energy is of another kind."""
        moving, stored = (self.here(x) for x in self.energies)
        at_rest, mass = put_in(moving, {self.speed: ZERO}), put_in(moving, {self.speed: ONE})
        if self.momenta:
            mass = mass - at_rest
        elif at_rest is not ZERO and not self.of(at_rest).is_zero:
            raise NoClosedFormError("the kinetic energy has other parts than the square of one speed")
        if mass is ZERO or TIME in leaves([mass, stored], "symbol"):
            raise NoClosedFormError("the energy depends on time")
        return 2 * mass

    @cached_property
    def inertia(self) -> Node:
        """The momentum of the variable, less what it is at rest, by its rate: M(q), whatever energies stand for it."""
        momentum = self.here(derivative(as_node(kinetic_energy(self.there.instant.motion)), self.speed))
        return put_in(momentum, {self.speed: ONE}) - put_in(momentum, {self.speed: ZERO})

    @cached_property
    def potential(self) -> Node:
        """U(q): the potential energy, and the kinetic energy of momenta that are conserved."""
        moving, stored = (self.here(x) for x in self.energies)
        return put_in(moving, {self.speed: ZERO}) + stored if self.momenta else stored

    @cached_property
    def whole_potential(self) -> Node:
        """U(q), less the work that is done by the place. Raises NoClosedFormError where it depends on the speed."""
        return self.potential if self.power is None else self.level - self._by_work

    @cached_property
    def power(self) -> Quotient | None:
        """The rate of the energy by the variable: what does work by the place; None where the energy is conserved."""
        if self.alone is not None:
            return self.alone
        mechanism = self.there.solved.mechanism
        speeds = [symbol(x.name) for x in mechanism.speeds]
        names = [*(symbol(x.name) for x in mechanism.coordinates), *speeds]
        energy = add(*self.energies)
        try:
            moved = zip(names, (*map(self.there.letter, speeds), *self.there.forms.udot), strict=True)
            zero = self.there.forms.field.constant(0)
            found = sum((self.there.forms.of([derivative(energy, x)])[0] * r for x, r in moved), zero)
            timed = TIME in found.symbols
            if not (found.is_zero or timed):
                found = self.of(self.here(book_form(found)))
        except NoClosedFormError:
            return None  # numbers confirm what follows, or not
        if timed:
            raise NoClosedFormError("the work depends on the time")
        factors = (found.field.whole(found.field.in_ring(p)) for p, _ in factors_of(found.above)[1])
        if found.is_zero or any(self.there.constant(x) and self.granted.vanishes(x) for x in factors):
            return None
        if self.values or found.symbols & (self.there.variables - {self.variable, self.speed}):
            raise NoClosedFormError("the work depends on more than the place")
        return found / self.there.letter(self.speed)

    @cached_property
    def square(self) -> Node:
        """The square of the speed by the place. Raises NoClosedFormError."""
        mass = self.mass
        if self.power is None:
            return self.written(2 * (self.level - self.potential) / mass)
        return written(self.there.forms.of([2 * self._by_work / mass])[0])

    @cached_property
    def _by_work(self) -> Node:
        """K = M q'^2/2 of K' = -U' + g(q) + k(q) K. Raises NoClosedFormError."""
        assert self.power is not None
        parts = powers_of(self.power, self.speed, 2)
        if parts is None or not parts[1].is_zero:
            raise NoClosedFormError("the work depends on the speed")
        start = self.there.forms.of([self.start])[0]
        if parts[2].is_zero:
            return self.level + self._integral(parts[0], start) - self.potential
        first = self.level - put_in(self.potential, {self.variable: self.start})
        slope, mass = self.there.forms.of([derivative(self.potential, self.variable), self.mass])
        decay = BUILD["exp"](self._integral(2 * parts[2] / mass, start))
        forced = self.there.forms.of([written(parts[0] - slope) / decay])[0]
        return decay * (first + self._integral(forced, start))

    def _integral(self, a: Quotient, start: Quotient) -> Node:
        found, divisors = definite_integral(a, self.variable, start)
        for divisor in divisors:
            self.granted.differs(divisor)
        return found

    # --- along the way --------------------------------------------------------------------------------------------

    def course(self, q: float, u: float) -> MotionFormulas:
        """Return the motion by the variable, which has the value q and the rate u at the moment.

        Raises NoClosedFormError.
        """
        square = self.square
        root = BUILD["sqrt"](square)
        along = ZERO if u == 0.0 else (root if u > 0.0 else -root)
        rates = {x: put_in(each, {self.speed: along}) for x, each in self.rates.items()}
        formulas = {self.speed: along, **self.places, **rates}
        known = {x: InTime(formula, self.granted) for x, formula in formulas.items()}

        def of(node: Node) -> InTime | None:
            if node not in known and (node is TIME or node in self.momenta):
                rate = ONE if node is TIME else self.rates[self.momenta[node]]
                first = ZERO if node is TIME else self.at_start(node)
                known[node] = InTime(first + self.integral(rate, self.sign), self.granted)
            return known.get(node)

        near = self.values.get(self.variable)
        turning = square if u == 0.0 else None
        used = {} if self.momenta else dict(known)
        return MotionFormulas(self.there, self.variable, of, q, turning, near, used=used, law=self.lines)

    @property
    def sign(self) -> int:
        """The direction in which the variable leaves its start."""
        begin, mechanism = self.there.solved.begin, self.there.solved.mechanism
        k = next(k for k, x in enumerate(mechanism.speeds) if x.name == self.speed.data)
        speed = begin.u[k] or self.there.solved.numbers.udot[k]
        return 1 if speed > 0.0 else -1

    def root_integral(self, rate: Node) -> RootIntegral:
        """Return the integrand of a rate over the speed. Raises NoClosedFormError where it is of no known kind."""
        factor, square = self.there.forms.of([rate, self.square])
        found = RootIntegral.of(factor, square, self.variable)
        if found is None:
            raise NoClosedFormError("an integral is no elementary function that is known")
        return found

    def integral(self, rate: Node, sign: int) -> Node:
        """Return the integral of a rate over the speed from the start on. Raises NoClosedFormError."""
        with self.there.assuming(self.granted):
            found = self.root_integral(rate).node(self.there.forms.of([self.start])[0])
        return found if sign > 0 else -found

    def lines(self, used: Collection[Node]) -> Iterator[Line]:
        """Yield the theorem that gives the speed, and the integrals of what else was used."""
        yield from self.held
        left, right = (written(x) for x in self.there.forms.of([add(*self.energies), self.level]))
        if self.power is None:
            yield equation(left, right, "energy is conserved")
        else:
            yield equation(left, right + _WORK, "work and energy")
            force = written(self.power)
            yield Sentence((_WORK, " is the integral of ", force, " by ", self.variable, " from ", self.start))
        square = self.square if self.values else written(self.there.forms.of([self.square])[0])
        yield equation(self.speed * self.speed, square, "so")
        for node in (x for x in used if x is TIME or x in self.momenta):
            rate = ONE if node is TIME else self.rates[self.momenta[node]]
            yield integral_line(node, rate / BUILD["sqrt"](square), self.variable, self.start)


@dataclass(frozen=True, eq=False)
class ToAndFro:
    """The motion of one freedom to and fro between two places, from a solved start."""

    freedom: OneFreedom

    @classmethod
    def of(cls, solved: SolvedInstant, coordinate: str) -> ToAndFro | None:
        """Return the swing of a coordinate, None where it is no freedom with known equations."""
        state = solved.begin.q, solved.begin.u
        there = anywhere(solved, *state)
        with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
            freedom = None if there is None else freedom_of(there, symbol(coordinate), state)
            return None if freedom is None else cls(freedom)
        return None

    def whole(self, node: Node) -> Node:
        """Return the size of the period (the time), or of the growth of a coordinate in a period.

        Raises NoClosedFormError.
        """
        return self._there_and_back(self._rate(node))

    def action(self) -> Node:
        """Return the integral of p dq over a period, divided by 2 pi. Raises NoClosedFormError."""
        return self._there_and_back(self.freedom.inertia * self.freedom.square / (2 * PI))

    def by_energy(self) -> ToAndFro:
        """Return the same motion with a letter in place of its energy. Raises NoClosedFormError."""
        freedom, there = self.freedom, self.freedom.there
        if freedom.alone is not None or freedom.power is not None:
            raise NoClosedFormError("the energy of the coordinate has no level of its own")
        letter = next(x for x in map(symbol, _ENERGIES) if x not in there.solved.mechanism.symbols)
        if letter not in there.forms.known:
            level = PRECISE.mpf(evaluate_float([freedom.level], there.solved.sample)[0])
            there.forms.known[letter] = there.forms.field.letter(letter, Letter(letter, level))
        return ToAndFro(replace(freedom, energy=letter, granted=Granted()))

    def rate_by_energy(self, action: Node) -> Node:
        """Return dE/dJ of an action by the letter of the energy. Raises NoClosedFormError."""
        assert self.freedom.energy is not None
        return written(self.freedom.there.forms.of([1 / derivative(action, self.freedom.energy)])[0])

    def _pendulum(self) -> tuple[Quotient, Quotient, Quotient] | None:
        """Return M, omega_0^2 and k^2 of a swing with q'^2 = 4 omega_0^2 (k^2 - sin(q/2)^2) and M constant.

        None for other motions. Raises NoClosedFormError.
        """
        freedom, q, moving = self.freedom, self.freedom.variable, self.freedom.there.variables
        waves = BUILD["sin"](q), BUILD["cos"](q)
        square, mass, sine, cosine = freedom.there.forms.of([freedom.square, freedom.inertia, *waves])
        wave = -rate(square, q) / sine
        if (wave.symbols | mass.symbols) & moving or not wave.sample > 0:
            return None
        modulus = (square - wave * (cosine - 1)) / (2 * wave)
        if modulus.symbols & moving or not modulus.sample < 1:
            return None
        return mass, wave / 2, modulus

    def elliptic(self) -> tuple[Node, Node, Node] | None:
        """Return M, omega_0^2 and k^2 of a pendulum's swing as a book writes them, None for other motions."""
        parts = self._pendulum()
        return None if parts is None else (written(parts[0]), written(parts[1]), written(parts[2]))

    def by_elliptic_integrals(self) -> tuple[float, float] | None:
        """Return T (s) and J of a pendulum's swing, however near to upright it turns; None for other motions."""
        with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
            parts = self._pendulum()
            if parts is not None and parts[2].sample > 0:
                mass, square, modulus = (x.sample for x in parts)
                K, E, omega = PRECISE.ellipk(modulus), PRECISE.ellipe(modulus), PRECISE.sqrt(square)
                return float(4 * K / omega), float(8 / PRECISE.pi * mass * omega * (E - (1 - modulus) * K))
        return None

    def elliptic_lines(self) -> Iterator[Line]:
        """Yield period and action of a pendulum by elliptic integrals; nothing for other motions."""
        parts = self.elliptic()
        if parts is None:
            return
        mass, square, modulus = parts
        yield equation(OMEGA_0 * OMEGA_0, square, "a pendulum with")
        k = next(x for x in _MODULI if symbol(x) not in self.freedom.there.solved.mechanism.symbols)
        yield equation(symbol(k) * symbol(k), modulus)
        yield Sentence((f"J = 8/pi*M*omega_0*(E({k}) - (1 - {k}^2)*K({k})), T = 4*K({k})/omega_0, M = ", mass))
        yield Sentence((f"K and E are the complete elliptic integrals of the modulus {k}",))

    def square_at_rest(self) -> Quotient:
        """Return omega^2 of small swings about the start, at which the coordinate rests, negative where they grow.

        q'^2 = omega^2 (a^2 - x^2) has the second derivative -2 omega^2. Raises NoClosedFormError.
        """
        q = self.freedom.variable
        bent = derivative(derivative(self.freedom.square, q), q)
        (found,) = self.freedom.there.forms.of([put_in(bent, {q: self.freedom.start})])
        return -found / 2

    def _there_and_back(self, rate: Node) -> Node:
        """Return the size of the integral of a rate by the time over a period. Raises NoClosedFormError."""
        freedom = self.freedom
        with freedom.there.assuming(freedom.granted):
            factor, square = freedom.there.forms.of([rate, freedom.square])
            return freedom.granted.written(2 * integral_between_turns(factor, square, freedom.variable))

    def _rate(self, node: Node) -> Node:
        if node is not TIME and node not in self.freedom.momenta:
            raise NoClosedFormError("the coordinate follows by no integral")
        return ONE if node is TIME else self.freedom.rates[self.freedom.momenta[node]]

    def confirmed(self, find: Callable[[], Node], value: float) -> Node | None:
        """Return a formula of a size, which has a value that is known, with its sign; None where it has another."""
        solved = self.freedom.there.solved
        try:
            size = find()
            near = evaluate_float([size], solved.sample)[0]
        except (NoClosedFormError, ExpressionError, *UNDEFINED):
            return None
        if abs(near - abs(value)) > FITS * abs(value):
            return None
        return size if value > 0.0 else -size

    def lines(self, node: Node) -> Iterator[Line]:
        """Yield the energy integral, and twice the integral between the places where the motion turns."""
        freedom = self.freedom
        yield from freedom.lines([])
        square = written(freedom.there.forms.of([freedom.square])[0])
        integrand = 2 * self._rate(node) / BUILD["sqrt"](square)
        name = symbol("T") if node is TIME else node
        grown = "" if node is TIME else "the advance of "
        where = (" by ", freedom.variable, " from one place where ", freedom.speed, " = 0 to the other")
        yield Sentence((grown, name, " is the integral of ", integrand, *where))


# ----------------------------------------------------------------------------------------------------------------------
# Which freedom is left: of one coordinate, on a curve of constraints, or beside conserved momenta.


def courses_by_place(there: Anywhere, at: State, beside: State) -> Iterator[MotionFormulas]:
    """Yield the motion by each coordinate by which the state is known.

    `at`: coordinates and speeds (n each) at the moment, `beside` those a little before, where constraints are regular.
    """
    mechanism = there.solved.mechanism
    for k, coordinate in enumerate(mechanism.coordinates):
        with suppress(NoClosedFormError, ExpressionError, *UNDEFINED):
            freedom = freedom_of(there, symbol(coordinate.name), beside)
            if freedom is not None:
                yield freedom.course(at[0][k], at[1][k])


def freedom_of(there: Anywhere, variable: Node, beside: State) -> OneFreedom | None:
    """Return the one freedom by a coordinate, None where others are free. Raises NoClosedFormError."""
    mechanism = there.solved.mechanism
    coordinates = [symbol(x.name) for x in mechanism.coordinates]
    speeds = [symbol(x.name) for x in mechanism.speeds]
    if mechanism.drives or len(coordinates) != len(speeds) or variable not in coordinates:
        return None
    speed = speeds[coordinates.index(variable)]
    if len(coordinates) == 1:
        return OneFreedom(there, variable, speed)
    if mechanism.rows:
        values = dict(zip((*coordinates, *speeds), (*beside[0], *beside[1]), strict=True))
        if (found := _on_curve(there, variable, speed, values)) is not None:
            return found
    acceleration = there.forms.udot[coordinates.index(variable)]
    if mechanism.rows and variable not in acceleration.symbols:
        return None
    if not acceleration.symbols & (there.variables - {variable, speed}):
        return OneFreedom(there, variable, speed, alone=acceleration)
    return None if mechanism.rows else _beside_momenta(there, variable, speed)


def _on_curve(there: Anywhere, variable: Node, speed: Node, values: Mapping[Node, float]) -> OneFreedom | None:
    """Return the freedom on the curve of positions that constraints allow, near `values` of the state."""
    mechanism = there.solved.mechanism
    pairs = {symbol(q.name): symbol(u.name) for q, u in zip(mechanism.coordinates, mechanism.speeds, strict=True)}
    start = there.solved.nodes.motion.state
    resting = {
        x: as_node(start.q[k])
        for k, x in enumerate(pairs)
        if x is not variable and as_node(start.u[k]) is ZERO and there.forms.udot[k].is_zero
    }
    places = dict(resting)
    rows = row_motions(there.instant.motion)
    waiting = [as_node(row.phi) for row in rows if row.holonomic]
    while waiting:
        count = len(waiting)
        for zero in list(waiting):
            zero_here = put_in(zero, places)
            unknown = [x for x in leaves([zero_here], "symbol") if x in pairs and x is not variable]
            if len(unknown) == 1:
                places[unknown[0]] = _place(there, zero_here, {x: values[x] for x in (variable, unknown[0])})
                waiting.remove(zero)
        if len(waiting) == count:
            break
    rates = {pairs[x]: derivative(place, variable) * speed for x, place in places.items()}
    held = [equation(x, place, "the constraint gives") for x, place in places.items() if x not in resting]
    for row in (row for row in rows if not row.holonomic and row.kinematic):  # rolling
        slip = put_in(as_node(row.phidot), {**places, **rates})
        if in_letters(there, slip, values).is_zero:  # of what is at rest
            continue
        unknown = [x for x in leaves([slip], "symbol") if x in pairs.values() and x is not speed]
        if len(unknown) != 1:
            return None
        rolling = -(put_in(slip, {unknown[0]: ZERO}) / derivative(slip, unknown[0]))
        rates[unknown[0]] = in_book_form(there, rolling, values)
        held.append(equation(unknown[0], rates[unknown[0]], "without slip"))
    if set(rates) != set(pairs.values()) - {speed}:
        return None
    return OneFreedom(there, variable, speed, places, rates, held=held, values=values)


def _place(there: Anywhere, zero: Node, near: Mapping[Node, float]) -> Node:
    """Return the root of an equation of the variable and one unknown, the last of those with values `near` it."""
    unknown = list(near)[-1]
    sample = {**there.solved.sample, **near}
    for root in roots(in_letters(there, zero, near), unknown):
        if abs(evaluate_float([root], sample)[0] - near[unknown]) <= _SAME * max(1.0, abs(near[unknown])):
            return root
    raise NoClosedFormError("a coordinate that constraints hold has no formula of another")


def _beside_momenta(there: Anywhere, variable: Node, speed: Node) -> OneFreedom | None:
    """Return the freedom beside coordinates whose momenta are conserved, None where one is not."""
    mechanism, forms, start = there.solved.mechanism, there.forms, there.solved.nodes.motion.state
    pairs = {symbol(q.name): symbol(u.name) for q, u in zip(mechanism.coordinates, mechanism.speeds, strict=True)}
    others = {q: u for q, u in pairs.items() if q is not variable}
    energy, zero = as_node(kinetic_energy(there.instant.motion)), forms.field.constant(0)
    moved = {**{q: there.letter(u) for q, u in pairs.items()}, **dict(zip(pairs.values(), forms.udot, strict=True))}
    momenta = []
    for u in others.values():
        momentum = derivative(energy, u)
        quotient = forms.of([momentum])[0]
        named = quotient.symbols
        rates = (forms.of([derivative(momentum, x)])[0] * each for x, each in moved.items() if x in named)
        if named & {*others, TIME} or not sum(rates, zero).is_zero:
            return None
        momenta.append(quotient)
    at_start = dict(zip(moved, map(as_node, (*start.q, *start.u)), strict=True))
    levels = forms.of([put_in(written(p), at_start) for p in momenta])
    matrix = [[rate(p, u) for u in others.values()] for p in momenta]
    at_rest = forms.of([put_in(written(p), dict.fromkeys(others.values(), ZERO)) for p in momenta])
    found = exact_solve(matrix, [level - x for level, x in zip(levels, at_rest, strict=True)])
    speeds = {u: written(x) for u, x in zip(others.values(), found, strict=True)}
    held: list[Line] = []
    for (q, u), p, level in zip(others.items(), momenta, levels, strict=True):
        held.append(equation(written(p), written(level), f"the momentum of {q.data} is conserved"))
        held.append(equation(u, speeds[u], "so"))
    return OneFreedom(there, variable, speed, {}, speeds, others, held)


# ----------------------------------------------------------------------------------------------------------------------
# u' = f(u): places and times by the speed.


def courses_by_speed(there: Anywhere, u: Sequence[float]) -> Iterator[MotionFormulas]:
    """Yield the motion by each speed whose rate depends on itself alone; u (n): the speeds at the moment."""
    mechanism, state = there.solved.mechanism, there.solved.nodes.motion.state
    if len(mechanism.coordinates) != len(mechanism.speeds):
        return
    for k, each in enumerate(mechanism.speeds):
        acceleration, speed = there.forms.udot[k], symbol(each.name)
        if acceleration.is_zero or there.constant(acceleration) or acceleration.symbols & (there.variables - {speed}):
            continue
        place, q0 = symbol(mechanism.coordinates[k].name), as_node(state.q[k])
        yield _BySpeed(there, k, speed, place, q0, as_node(state.u[k])).course(u[k])


@dataclass(frozen=True, eq=False)
class _BySpeed:
    """The motion of coordinate k, `place`, by its `speed`, from `q0` and `u0` on."""

    there: Anywhere
    k: int
    speed: Node
    place: Node
    q0: Node
    u0: Node
    granted: Granted = field(default_factory=Granted)

    def course(self, u: float) -> MotionFormulas:
        known: dict[Node, InTime] = {}

        def of(node: Node) -> InTime | None:
            if node not in known and node in (TIME, self.place):
                known[node] = InTime(self._integral(node), self.granted)
            return known.get(node)

        return MotionFormulas(self.there, self.speed, of, u, law=self._lines)

    def _integrand(self, node: Node) -> Quotient:
        acceleration = self.there.forms.udot[self.k]
        return (self.there.letter(self.speed) if node is self.place else acceleration.field.constant(1)) / acceleration

    def _integral(self, node: Node) -> Node:
        """Return a place or the time by the speed. Raises NoClosedFormError."""
        with self.there.assuming(self.granted):
            start = self.there.forms.of([self.u0])[0]
            found, divisors = definite_integral(self._integrand(node), self.speed, start)
        for divisor in divisors:
            self.granted.differs(divisor)
        return (self.q0 if node is self.place else ZERO) + found

    def _lines(self, used: Collection[Node]) -> Iterator[Line]:
        mechanism = self.there.solved.mechanism
        yield equation(acceleration(mechanism, self.k), written(self.there.forms.udot[self.k]))
        for node in (x for x in used if x in (TIME, self.place)):
            yield integral_line(node, written(self._integrand(node)), self.speed, self.u0)
