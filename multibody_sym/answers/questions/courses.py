"""Coordinates and speeds as formulas: of the time, where equations of motion have a known solution.

One coordinate at a time, whose acceleration depends on no other one:

    q'' = A q + B u + c + sum of s_i sin(w_i t + p_i) + r_i cos(w_i t + p_i)        A, B, c, s, r, w of parameters alone
    u' = c + K u^2                                                                  where A and B are zero

The first includes free fall, linear drag, damped and driven oscillators; the second drag that grows with the square.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.algebra.book_form import book_form
from multibody_sym.algebra.quotient_functions import doubled, sign, sqrt
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.algebra.solving.roots import rate
from multibody_sym.answers.closed_form import ClosedForms, closed_forms, unknowns
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.questions.simulated_motion import Simulated
from multibody_sym.answers.symbolic_state import any_state
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.errors import ExpressionError
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.model.declaration.states import VERBS
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import (
    ONE,
    PI,
    TWO,
    ZERO,
    Node,
    add,
    as_node,
    divide,
    multiply,
    negate,
    power,
    subtract,
    symbol,
)
from multibody_sym.scalars.traversal import leaves
from multibody_sym.simulation.trajectory import Trajectory

TIME: Final = symbol("t")
_LOOKS: Final = 41
_FITS: Final = 1e-7
"""To which part of the largest value a formula is what a run shows."""


@dataclass(frozen=True, eq=False)
class Anywhere:
    """The equations of motion in closed form at any state: time, coordinates and speeds keep their names."""

    solved: Solved
    forms: ClosedForms
    instant: Instant

    @property
    def variables(self) -> frozenset[Node]:
        """Time, coordinates and speeds."""
        mechanism = self.solved.mechanism
        coordinates = (symbol(x.name) for x in mechanism.coordinates)
        return frozenset((TIME, *coordinates, *(symbol(x.name) for x in mechanism.speeds)))

    def of(self, asked: Node) -> Quotient:
        """Return an expression of the model at any state. Raises NoClosedFormError."""
        return self.forms.of([as_node(self.solved.asked(asked)(self.instant)[""])])[0]


def anywhere(solved: Solved, q: Sequence[float], u: Sequence[float]) -> Anywhere | None:
    """Return a system's equations at any state like one that it comes to, whose signs of |u| and such they have.

    None where they have no closed form, or poses are quaternions.
    """
    mechanism = solved.mechanism
    if solved.forms is None or any(body.quaternions for body in mechanism.bodies):
        return None
    general = any_state(mechanism, replace(solved.begin, q=tuple(q), u=tuple(u)))
    try:
        forms = closed_forms(mechanism, general)
    except NoClosedFormError:
        return None
    return Anywhere(solved, forms, Instant(motion_of(mechanism, general.state), *unknowns(mechanism)))


def formulas_of_time(there: Anywhere) -> Mapping[Node, Node]:
    """Return coordinates and speeds, by their symbols, as formulas of t, where equations have a known solution."""
    mechanism, state = there.solved.mechanism, there.solved.nodes.motion.state
    found: dict[Node, Node] = {}
    for k, (coordinate, speed) in enumerate(zip(mechanism.coordinates, mechanism.speeds, strict=True)):
        q, u = symbol(coordinate.name), symbol(speed.name)
        try:
            course = _course(there, k, q, u, as_node(state.q[k]), as_node(state.u[k]))
        except NoClosedFormError:
            continue
        if course is not None:
            found[q], found[u] = course
    return found


def confirmed_formulas(solved: Solved, motion: Simulated) -> Mapping[Node, Node]:
    """Return coordinates and speeds as formulas of t, without those that are not what a run shows to its end.

    The run ends where a state changes first: the formulas hold until then.
    """
    shown = Shown.of(solved, motion)
    return {} if shown.there is None else shown.confirmed(formulas_of_time(shown.there))


@dataclass(frozen=True, eq=False)
class Shown:
    """Places `looked` at of a `run` up to where a state changes first, and the equations `there` half way."""

    solved: Solved
    run: Trajectory
    looked: list[int]
    there: Anywhere | None

    @classmethod
    def of(cls, solved: Solved, motion: Simulated) -> Shown:
        """Return what a run shows of a solved system."""
        run = motion.whole
        until = min((float(change["t"]) for change in run.changes), default=run.t_final)
        looked = [int(k) for k in np.linspace(0, len(run.t) - 1, _LOOKS).astype(int) if run.t[k] <= until]
        here, mechanism = looked[len(looked) // 2], solved.mechanism
        q, u = ([float(run[x.name][here]) for x in group] for group in (mechanism.coordinates, mechanism.speeds))
        return cls(solved, run, looked, anywhere(solved, q, u))

    def confirmed(self, formulas: Mapping[Node, Node]) -> dict[Node, Node]:
        """Return formulas of time without those that are not what the run shows."""
        t, sample = self.run.t[self.looked], self.solved.sample
        shown = {node: self.run[str(node.data)][self.looked] for node in formulas}
        return {node: formula for node, formula in formulas.items() if _fits(formula, sample, t, shown[node])}


def held_until(motion: Simulated) -> str:
    """Return until when formulas of time are those of a motion in which states may change, as a run shows it."""
    run = motion.whole
    if not run.changes:
        return f"of the motion without a change of state, of which there is none until t = {run.t_final:.6g} s"
    first = float(run.changes[0]["t"])
    begun = dict.fromkeys(_begun(each["element"], each["kind"]) for each in run.changes if float(each["t"]) == first)
    return f"of the motion until the first change of state: {', '.join(begun)} at t = {first:.6g} s"


def _begun(element: str, kind: str) -> str:
    """Return what an element begins to do, for people."""
    if kind == "impact":
        return f"{element} strikes"
    verb = min((verb for verb, words in VERBS.items() if kind in words), key=lambda x: len(VERBS[x]), default=kind)
    return f"{element} {verb} {kind[-1]}" if kind[-1] in "+-" else f"{element} {verb}"


def formula_of_period(solved: Solved, coordinate: str, number: float) -> Node | None:
    """Return 2 pi/sqrt(-A) for a coordinate with q'' = A q + c, where it has the number's value; else None."""
    names = [c.name for c in solved.mechanism.coordinates]
    there = anywhere(solved, solved.begin.q, solved.begin.u) if coordinate in names else None
    if there is None or len(names) != len(solved.mechanism.speeds):
        return None
    q, acceleration = symbol(coordinate), there.forms.udot[names.index(coordinate)]
    if acceleration.symbols & (there.variables - {q}):
        return None
    try:
        slope = rate(acceleration, q)
        if slope.symbols & there.variables or slope.is_zero or sign(slope) > 0:
            return None
        formula = multiply(multiply(TWO, PI), BUILD["sqrt"](_node(-slope.power(-1))))
        near = abs(evaluate_float([formula], solved.sample)[0] - number) <= _FITS * number
    except (NoClosedFormError, ExpressionError, *UNDEFINED):
        return None
    return formula if near else None


def _fits(formula: Node, sample: Mapping[Node, float], t: Floats, shown: Floats) -> bool:
    """Return whether a formula has the values of a run."""
    try:
        told = [evaluate_float([formula], {**sample, TIME: float(x)})[0] for x in t]
    except (ExpressionError, *UNDEFINED):
        return False
    return bool(np.abs(np.array(told) - shown).max() <= _FITS * max(1e-300, float(np.abs(shown).max())))


def _course(there: Anywhere, k: int, q: Node, u: Node, q0: Node, u0: Node) -> tuple[Node, Node] | None:
    """Return a coordinate that starts at q0 with speed u0, and the speed, as formulas of time; None without them."""
    acceleration = there.forms.udot[k]
    if acceleration.symbols & (there.variables - {q, u, TIME}):
        return None
    by_q, by_u = rate(acceleration, q), rate(acceleration, u)
    if not by_u.symbols & there.variables and not by_q.symbols & there.variables:
        rest = acceleration - by_q * _letter(there, q) - by_u * _letter(there, u)
        course = _linear(there, by_q, by_u, rest, q0, u0)
        return None if course is None else (course, derivative(course, TIME))
    if by_q.is_zero and TIME not in acceleration.symbols:
        square = rate(by_u, u) / 2
        constant = acceleration - square * _letter(there, u) * _letter(there, u)
        if not (square.symbols | constant.symbols) & there.variables and not constant.is_zero:
            return _by_square(constant, square, q0, u0)
    return None


def _letter(there: Anywhere, node: Node) -> Quotient:
    return there.forms.known[node]


def _node(a: Quotient) -> Node:
    return book_form(doubled(a))


# --- linear, with constant coefficients ------------------------------------------------------------------------------


def _linear(there: Anywhere, a: Quotient, b: Quotient, rest: Quotient, q0: Node, u0: Node) -> Node | None:
    """Return q(t) of q'' = a q + b u + rest(t): a particular solution and what decays, swings or grows beside it."""
    forced = _forced(there, a, b, rest)
    if forced is None:
        return None
    particular, constant = forced
    at_zero = _at_start(particular)
    if a.is_zero and b.is_zero:
        fallen = multiply(_node(constant / 2), power(TIME, TWO))
        away = subtract(u0, _at_start(derivative(particular, TIME)))
        return add(add(subtract(q0, at_zero), multiply(away, TIME)), add(fallen, particular))
    if a.is_zero:
        return _braked(b, constant, particular, q0, u0)
    middle = _node(-constant / a)
    q1 = subtract(subtract(q0, middle), at_zero)
    u1 = subtract(u0, _at_start(derivative(particular, TIME)))
    return add(add(middle, particular), _free(a, b, q1, u1))


def _at_start(node: Node) -> Node:
    found: Node = evaluate([node], lambda leaf: ZERO if leaf is TIME else leaf)[0]
    return found


def _free(a: Quotient, b: Quotient, q: Node, u: Node) -> Node:
    """Return the solution of x'' = a x + b x' that starts at x = q with x' = u."""
    half = b / 2
    square = -a - half * half
    decay = _node(half)
    along = subtract(u, multiply(decay, q))
    if square.is_zero:
        swing = add(q, multiply(along, TIME))
    else:
        turns = sign(square) > 0
        rate_ = _node(sqrt(square if turns else -square))
        even, odd = (BUILD["cos"], BUILD["sin"]) if turns else (BUILD["cosh"], BUILD["sinh"])
        phase = multiply(rate_, TIME)
        swing = add(multiply(q, even(phase)), multiply(divide(along, rate_), odd(phase)))
    return swing if half.is_zero else multiply(BUILD["exp"](multiply(decay, TIME)), swing)


def _braked(b: Quotient, constant: Quotient, particular: Node, q0: Node, u0: Node) -> Node:
    """Return q(t) of q'' = b q' + constant + what the particular solution is for."""
    final = -constant / b
    slower = subtract(subtract(u0, _node(final)), _at_start(derivative(particular, TIME)))
    gone = multiply(_node(-b.power(-1)), subtract(ONE, BUILD["exp"](multiply(_node(b), TIME))))
    drift = add(multiply(_node(final), TIME), multiply(slower, gone))
    return add(add(subtract(q0, _at_start(particular)), drift), particular)


def _forced(there: Anywhere, a: Quotient, b: Quotient, rest: Quotient) -> tuple[Node, Quotient] | None:
    """Return a particular solution for what is harmonic in `rest`, and the constant that is left; None for others."""
    field = rest.field
    particular, constant = ZERO, rest
    if TIME not in rest.symbols:
        return None if rest.symbols & there.variables else (particular, constant)
    for k, letter in enumerate(tuple(field.letters)):
        node = letter.node
        if node is None or node.op not in ("sin", "cos") or TIME not in _symbols(node):
            continue
        angle, wave = node.args[0], field.letter((node.op, node.args[0]), letter)
        amplitude = _coefficient(rest, k)
        pace = derivative(angle, TIME)
        if amplitude is None or amplitude.symbols & there.variables or _symbols(pace) & there.variables:
            return None
        if amplitude.is_zero:
            continue
        constant = constant - amplitude * wave
        particular = add(particular, _response(there, a, b, amplitude, node, pace))
    return None if constant.symbols & there.variables else (particular, constant)


def _symbols(node: Node) -> frozenset[Node]:
    return frozenset(leaves([node], "symbol"))


def _coefficient(a: Quotient, k: int) -> Quotient | None:
    """Return the coefficient of the letter at a place in a quotient, None where it does not stand there by itself."""
    field = a.field
    above, below = field.in_ring(a.above), field.in_ring(a.below)
    if any(m[k] for m in below) or any(m[k] > 1 for m in above):
        return None
    terms = {(*m[:k], 0, *m[k + 1 :]): c for m, c in above.items() if m[k]}
    return field.whole(field.ring.from_dict(terms)) / field.whole(below)


def _response(there: Anywhere, a: Quotient, b: Quotient, amplitude: Quotient, wave: Node, pace: Node) -> Node:
    """Return the steady answer of x'' = a x + b x' + amplitude * wave. Raises NoClosedFormError at resonance."""
    (w,) = there.forms.of([pace])
    stiff, loss = -a - w * w, -b * w
    size = stiff * stiff + loss * loss
    if size.is_zero:
        raise NoClosedFormError("the force is in resonance with the free motion")
    along, across = amplitude * stiff / size, amplitude * loss / size
    angle = wave.args[0]
    other = negate(BUILD["cos"](angle)) if wave.op == "sin" else BUILD["sin"](angle)
    return add(multiply(_node(along), wave), multiply(_node(across), other))


# --- drag that grows with the square ---------------------------------------------------------------------------------


def _by_square(constant: Quotient, square: Quotient, q0: Node, u0: Node) -> tuple[Node, Node]:
    """Return q(t) and u(t) of u' = constant + square u^2.

    u = V tanh(z) or V tan(z), where z grows at the pace sqrt(|constant square|) and V = sqrt(|constant / square|).
    """
    pace, final = sqrt(_positive(constant * square)), sqrt(_positive(constant / square))
    falls = sign(constant * square) < 0
    most = _node(final if sign(constant) > 0 else -final)
    ratio = divide(u0, most)
    inverse = _artanh(ratio) if falls else BUILD["atan"](ratio)
    phase = add(inverse, multiply(_node(pace), TIME))
    even, odd = (BUILD["cosh"], BUILD["tanh"]) if falls else (BUILD["cos"], BUILD["tan"])
    gone = BUILD["log"](divide(even(phase), even(inverse)))
    return add(q0, multiply(_node(-square.power(-1)), gone)), multiply(most, odd(phase))


def _positive(a: Quotient) -> Quotient:
    """Return |a| by its sign at the sample."""
    return a if sign(a) > 0 else -a


def _artanh(x: Node) -> Node:
    if x is ZERO:
        return ZERO
    return divide(BUILD["log"](divide(add(ONE, x), subtract(ONE, x))), TWO)
