"""Motions whose accelerations never change: paths, times and speeds in closed form.

q = q0 + u0 t + a t^2/2        v = v0 + A t
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import reduce
from math import nan
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import absolute, sqrt
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.ask.working import acceleration, equation, written
from multibody_sym.answers.instant.instant import SolvedInstant
from multibody_sym.answers.instant.letters import TIME, state_names
from multibody_sym.answers.records import Formula, Line, Sentence
from multibody_sym.derivation.symbolic_start import ClosedForms, any_state, closed_forms, unknowns
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.model.fields import AXES
from multibody_sym.model.state_words import Moment
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, as_node, quantity, symbol

_DISPLACED: Final = 3
_FAR: Final = 1e-3
_SAME: Final = 1e-7
_MOMENTS: Final = 1001


@dataclass(frozen=True, eq=False)
class UniformMotion:
    """A motion in which no acceleration depends on time, coordinates or speeds; `anywhere` is the proof."""

    solved: SolvedInstant
    forms: ClosedForms
    anywhere: ClosedForms
    nodes: StateQuantities
    variables: frozenset[Node]

    # --- coordinates ----------------------------------------------------------------------------------------------

    def time_of(self, moment: Moment) -> Quotient | None:
        """Return the first time > 0 at which a coordinate has a value, 0 if it keeps it, None if it never has."""
        assert isinstance(moment, Mapping)
        ((coordinate, value),) = moment.items()
        k = self.place(coordinate)
        (u,) = self.forms.of([as_node(self.solved.nodes.motion.state.u[k])])
        # the smallest t > 0 with u t + a t^2/2 = way; 0 where that holds all the time
        way = self.way(coordinate, value)
        a = self.forms.udot[k]
        if way.is_zero:
            if a.is_zero:
                return way if u.is_zero else None
            return -2 * u / a if (u / a).sample < 0 else None
        if a.is_zero:
            return None if u.is_zero or (way / u).sample < 0 else way / u
        square = u * u + 2 * (a * way)
        if u.is_zero:
            return sqrt(2 * way / a) if square.sample > 0 else None
        if square.sample < 0 and not square.vanishes:
            return None
        root = sqrt(square) * (1 if a.sample > 0 else -1)
        times = [t for t in ((-u - root) / a, (-u + root) / a) if t.sample > 0]
        return min(times, key=lambda t: t.sample, default=None)

    def moment_lines(self, moment: Mapping[str, Node], time: Quotient) -> Iterator[Line]:
        """Yield q0 + u0 t + q'' t^2/2 = value, and its root."""
        ((coordinate, value),) = moment.items()
        k, start = self.place(coordinate), self.solved.nodes.motion.state
        q0, u0 = (written(x) for x in self.forms.of([as_node(start.q[k]), as_node(start.u[k])]))
        gone = acceleration(self.solved.mechanism, k) * (TIME * TIME) / 2
        yield equation(value, q0 + u0 * TIME + gone, f"{coordinate} is uniformly accelerated")
        yield equation(TIME, written(time), "so")

    def way(self, coordinate: str, value: Node) -> Quotient:
        """Return how far a value is from that of a coordinate at the start."""
        (q,) = self.forms.of([as_node(self.solved.nodes.motion.state.q[self.place(coordinate)])])
        return self.given(value) - q

    def place(self, coordinate: str) -> int:
        """Return the place of a coordinate among those of the mechanism."""
        return [c.name for c in self.solved.mechanism.coordinates].index(coordinate)

    def given(self, value: Node) -> Quotient:
        """Return an expression of parameters in closed form."""
        return self.forms.of([as_node(self.solved.asked(value)(self.solved.nodes)[""])])[0]

    @property
    def granted(self) -> list[Quotient]:
        """What is positive in this motion's equations, and may not stay so: it depends on time or on the state."""
        return [x for x in self.anywhere.field.positive if x.symbols & self.variables]

    def ends_before(self, until: float) -> bool:
        """Return whether what is granted fails before a time, from which on other accelerations may hold."""
        times = np.linspace(0.0, until, _MOMENTS)[:-1]
        for node in map(book_form, self.granted):
            values = np.array([self._value(node, t) for t in times.tolist()])
            # about when it is least between two samples, as parabolas through three of them tell
            before, here, after = values[:-2], values[1:-1], values[2:]
            places = np.flatnonzero((here <= before) & (here <= after) & (before + after > 2 * here))
            aside = (before - after)[places] / (before - 2 * here + after)[places] / 2
            lowest = times[1:-1][places] + (times[1] - times[0]) * aside
            if not all(value > 0.0 for value in (*values.tolist(), *(self._value(node, t) for t in lowest.tolist()))):
                return True
        return False

    def _value(self, node: Node, t: float) -> float:
        """Return the value of an expression of time, coordinates and speeds at a time, nan where it has none."""
        mechanism, begin, udot = self.solved.mechanism, self.solved.begin, np.array(self.solved.numbers.udot)
        q, u = np.array(begin.q), np.array(begin.u)
        values = np.concatenate([q + u * t + udot * t * t / 2, u + udot * t])
        moved = dict(zip(map(symbol, state_names(mechanism)), values.tolist(), strict=True))
        try:
            return evaluate_float([node], {**self.solved.sample, **moved, TIME: t})[0]
        except (ExpressionError, *UNDEFINED):
            return nan

    # --- points ---------------------------------------------------------------------------------------------------

    def path(self, point: str, duration: Quotient) -> Quotient | None:
        """Return the length of the path of a point, None where it is curved or not uniformly accelerated."""
        v, a = self._along(point)
        if a is None:
            return None
        if all(x.is_zero for x in v):
            return _length(a) * duration * duration / 2
        if all(x.is_zero for x in a):
            return _length(v) * duration
        if any(not (v[i] * a[j] - v[j] * a[i]).is_zero for i, j in ((0, 1), (1, 2), (0, 2))):
            return None
        speed = _length(v)
        rate = (v[0] * a[0] + v[1] * a[1] + v[2] * a[2]) / speed
        forth = speed * duration + rate * duration * duration / 2
        turns = rate.sample < 0 and -speed.sample / rate.sample < duration.sample
        return -(speed * speed / rate) - forth if turns else forth

    def speed_lines(self, point: str, moment: Mapping[str, Node], time: Quotient, speed: Quotient) -> Iterator[Line]:
        """Yield v^2 = u0^2 + 2 q'' (value - q0) where the point is as fast as the coordinate, else the time first."""
        ((coordinate, value),) = moment.items()
        k, way = self.place(coordinate), self.way(coordinate, value)
        (u,) = self.forms.of([as_node(self.solved.nodes.motion.state.u[k])])
        if not (speed * speed - u * u - 2 * (self.forms.udot[k] * way)).is_zero:
            yield from self.moment_lines(moment, time)
            yield from self.velocity_lines(point)
            return
        rate = symbol(self.solved.mechanism.speeds[k].name)
        gained = 2 * (acceleration(self.solved.mechanism, k) * written(way))
        yield equation(rate * rate, written(u * u) + gained, f"{coordinate} is uniformly accelerated")

    def velocity_lines(self, point: str) -> Iterator[Line]:
        """Yield the velocity of a point at the start, if it has one, and its acceleration, which stays."""
        v, a = self._along(point)
        for words, parts in ((f"velocity of {point} at the start", v), (f"acceleration of {point}", a or [])):
            moving = [(axis, x) for axis, x in zip(AXES, parts, strict=False) if not x.is_zero]
            if moving:
                along = [part for axis, x in moving for part in (f", along {axis} ", written(x))]
                yield Sentence((words, *along))

    def path_lines(self, point: str) -> Iterator[Line]:
        """Yield the acceleration of a point and its velocity at the start, and its way by them on a straight line."""
        yield from self.velocity_lines(point)
        v, a = self._along(point)
        if a is None:
            return
        speed, still = _length(v), all(x.is_zero for x in v)
        along = sum((x * y for x, y in zip(v, a, strict=True)), v[0] * 0)
        rate = _length(a) if still else along / speed
        way = written(speed) * TIME + written(rate) / 2 * TIME**2
        yield Formula((way,), before=("way on a straight line",))

    def speed(self, point: str, time: Quotient) -> Quotient | None:
        """Return the speed of a point at a time, None where it is not uniformly accelerated."""
        v, a = self._along(point)
        return None if a is None else _length([x + y * time for x, y in zip(v, a, strict=True)])

    def rates(self, point: str) -> tuple[Floats, Floats]:
        """Return the velocity and acceleration of a point at the start in floats."""
        v, a = (
            np.array([self.solved.number(quantity(f, (point, axis))) for axis in AXES])
            for f in ("velocity", "acceleration")
        )
        return v, a

    def _along(self, point: str) -> tuple[list[Quotient], list[Quotient] | None]:
        """Return a point's velocity at the start and its acceleration, None for that where it changes."""
        v, a, changing = [], [], []
        for axis in AXES:
            velocity = self.solved.asked(quantity("velocity", (point, axis)))(self.solved.nodes)[""]
            ask = self.solved.asked(quantity("acceleration", (point, axis)))
            v += self.forms.of([as_node(velocity)])
            a += self.forms.of([as_node(ask(self.solved.nodes)[""])])
            changing += self.anywhere.of([as_node(ask(self.nodes)[""])])
        return v, None if any(x.symbols & self.variables for x in changing) else a


def uniform_motion(solved: SolvedInstant) -> UniformMotion | None:
    """Return the motion if all accelerations are constant along it, None if they are not or this is not proved."""
    resolved, forms, begin, rng = solved.mechanism, solved.forms, solved.begin, np.random.default_rng(0)
    if forms is None or any(body.quaternions for body in resolved.bodies):
        return None
    here, size = _accelerations(solved, 0.0, np.array(begin.q), np.array(begin.u))
    for k in range(_DISPLACED):
        q, u = (np.array(x) + _FAR * rng.normal(size=len(x)) for x in (begin.q, begin.u))
        try:
            there, _ = _accelerations(solved, 0.1 * (k + 1), q, u)
        except UNDEFINED:
            return None
        if not bool((np.abs(there - here) <= _SAME * size).all()):
            return None
    general = any_state(resolved, begin, solved.nodes.motion.state)
    variables = frozenset((TIME, *map(symbol, state_names(resolved))))
    try:
        anywhere = closed_forms(resolved, general)
    except NoClosedFormError:
        return None
    if any(x.symbols & variables for x in anywhere.udot):
        return None
    nodes = StateQuantities(motion_of(resolved, general.state), *unknowns(resolved))
    return UniformMotion(solved, forms, anywhere, nodes, variables)


def _accelerations(solved: SolvedInstant, t: float, q: Floats, u: Floats) -> tuple[Floats, float]:
    """Return udot at a state in floats, and the size of what it is made of: the accelerations without rows."""
    resolved = solved.mechanism
    state = state_of(resolved, float, t, q.tolist(), u.tolist(), solved.begin.parameters)
    dynamics = composite_body(resolved, state)
    free = max((abs(x) for x in dynamics.bias_acceleration), default=0.0)
    udot = forward_dynamics(dynamics).udot
    return udot, max(free, float(np.abs(udot).max(initial=0.0)))


def _length(vector: Sequence[Quotient]) -> Quotient:
    parts = [x for x in vector if not x.is_zero]
    if len(parts) == 1:
        return absolute(parts[0])
    return sqrt(reduce(lambda total, x: total + x * x, parts, vector[0].field.constant(0)))
