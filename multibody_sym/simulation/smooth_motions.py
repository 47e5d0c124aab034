"""Prescribed motions that jump, in position or in speed: no finite force makes them, so that no run may begin.

Between the zeros of their switching functions, their branch points and their poles prescribed motions are smooth; at
each of these on the way the values and the rates a little before and a little after are compared.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice, pairwise
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.integrators.looks import PROBE, Look, first_seen
from multibody_sym.model.declaration.constraints import VelocityConstraint
from multibody_sym.model.declaration.system import System, expressions
from multibody_sym.scalars.branches import Branch, branches
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.kinks import switching_functions
from multibody_sym.scalars.node import Node, leaves, symbol

_T: Final = symbol("t")
_PIECES: Final = 64  # of the time, in which zeros are looked for
_MOST_ZEROS: Final = 200  # of one switching function, at which jumps are looked for
_BESIDE: Final = 1e-12  # of the time, so far before and after a zero a motion is evaluated ...
_FARTHER: Final = 100.0  # ... and so many times farther: what is no jump is larger there
_ROUNDING: Final = 1e-9  # of the largest value, which is no jump
_TOUCHED: Final = 1e-14  # of its size, less than which a function touches zero: round-off
_CLEAR: Final = 1e-9  # of its size, so far from zero it must be again for its root to be known to many digits
_BESIDE_TOUCHED: Final = (1e-6, 1e-5, 1e-4, 1e-3)  # of the time, the first is taken that is clear
_BESIDE_POLE: Final = 1e-5  # of the time: nearer, the round-off of small quotients may seem a jump
_FARTHER_BRANCH: Final = 10.0
_ROUNDING_BRANCH: Final = 1e-4  # of a usual value

Function = Callable[[float], float]


@dataclass(frozen=True)
class Jump:
    """At `time` a motion, or its speed (`of`), changes from `before` to `after`."""

    time: float
    of: str
    before: float
    after: float


@dataclass(frozen=True)
class _Place:
    """A time at which there may be a jump, and how far before and after it a motion is compared: each must tell it."""

    time: float
    beside: tuple[float, ...]
    of_branch: bool = False


def verify_motions(system: System, values: Mapping[Node, float], t_end: float) -> None:
    """Raise ModelError, with path, time and values, where a prescribed motion jumps, or its speed does, before t_end.

    `values` are those of parameters, and of the coordinates at the start, by their symbols. Motions of joints and of
    ground are verified, and the expressions of constraints as they change with time alone.
    """
    for path, node, _ in expressions(system):
        of_constraint = path[0] == "constraints"
        if (of_constraint or path[2:3] == ("motion",)) and _T in leaves([node], "symbol"):
            of_speeds = of_constraint and isinstance(system.constraints[path[1]], VelocityConstraint)
            jump = _first_jump(node, values, t_end, with_rate=not of_speeds)
            if jump is not None:
                with at(*path):
                    raise ModelError(_message(jump, "expression" if of_constraint else "motion", of_speeds))


def _message(jump: Jump, what: str, of_speeds: bool) -> str:
    told = f"t = {jump.time:.6g} s, from {jump.before:.6g} to {jump.after:.6g}"
    if jump.of == "value" and not of_speeds:
        return f"this {what} jumps at {told}: nothing moves so; let it pass through all that is between"
    subject = f"this {what}" if of_speeds else f"the rate of this {what}"
    return (
        f"{subject} jumps at {told}, and the speed of what it moves would: that takes an impact, which is not "
        "computed; let the speed change in a time that is not zero, as in where(t < 1, 0, (t - 1)^2)"
    )


def _first_jump(node: Node, values: Mapping[Node, float], t_end: float, *, with_rate: bool) -> Jump | None:
    """Return the first jump of an expression of time, or of its rate; None where it has no value."""
    switches = [g for g in switching_functions([node]) if _T in leaves([g], "symbol")]
    bends = [b for b in branches([node], _T) if _T in leaves([b.switch], "symbol")]
    if not switches and not bends:
        return None
    parts = {"value": _of_time(node, values)}
    if with_rate:
        parts["rate"] = _of_time(derivative(node, _T), values)
    places = [
        *(place for g in switches for place in _switching(_of_time(g, values), t_end)),
        *(place for b in bends for place in _branching(b, values, t_end)),
    ]
    if not places:
        return None
    sizes = {of: sorted(abs(f(t_end * k / _PIECES)) for k in range(_PIECES + 1)) for of, f in parts.items()}
    found = [
        jump for place in places for of, f in parts.items() if (jump := _jump(f, of, place, sizes[of])) is not None
    ]
    return min(found, key=lambda jump: jump.time, default=None)


def _switching(g: Function, t_end: float) -> Iterator[_Place]:
    """Yield where a switching function changes its sign."""
    for time in islice(_zeros(g, t_end), _MOST_ZEROS):
        yield _Place(time, (_BESIDE * t_end,))


def _branching(branch: Branch, values: Mapping[Node, float], t_end: float) -> Iterator[_Place]:
    """Yield where a branch is met: where its switch changes its sign and what must touch zero does so."""
    times = islice(_zeros(_of_time(branch.switch, values), t_end), _MOST_ZEROS)
    if branch.touching is None:
        yield from (_Place(time, (_BESIDE * t_end, _BESIDE_POLE * t_end), of_branch=True) for time in times)
        return
    touching = _of_time(branch.touching, values)
    scale = branch.scale or max(abs(touching(t_end * k / _PIECES)) for k in range(_PIECES + 1))
    for time in times:
        if abs(touching(time)) <= _TOUCHED * scale:
            for beside in (part * t_end for part in _BESIDE_TOUCHED):
                if min(touching(time - beside), touching(time + beside)) > _CLEAR * scale:
                    yield _Place(time, (beside,), of_branch=True)
                    break


def _of_time(node: Node, values: Mapping[Node, float]) -> Function:
    """Return an expression as a function of time that is 0 where it has no value: the run itself will tell.

    What is not known, as coordinates that are measured, counts as zero.
    """
    known = {**dict.fromkeys(leaves([node], "symbol"), 0.0), **values}

    def function(t: float) -> float:
        try:
            value = evaluate_float([node], {**known, _T: t})[0]
        except (ArithmeticError, ValueError):
            return 0.0
        return value if math.isfinite(value) else 0.0

    return function


def _jump(f: Function, of: str, place: _Place, sizes: list[float]) -> Jump | None:
    """Return the jump of f at a place, if it is one: a change that does not go down with the distance.

    `sizes` are values of f on the way, rising: beside a branch a usual one is what counts, as poles are no measure.
    """
    usual, rounding, ratio = sizes[-1], _ROUNDING, _FARTHER
    if place.of_branch:
        usual, rounding, ratio = sizes[len(sizes) * 9 // 10], _ROUNDING_BRANCH, _FARTHER_BRANCH
    for beside in place.beside:
        before, after = f(place.time - beside), f(place.time + beside)
        farther = abs(f(place.time + ratio * beside) - f(place.time - ratio * beside))
        change, size = abs(after - before), max(usual, abs(before), abs(after))
        if not (change > rounding * size and change > 0.5 * farther):
            return None
    nearest = place.beside[0]
    return Jump(place.time, of, f(place.time - nearest), f(place.time + nearest))


def _zeros(g: Function, t_end: float) -> Iterator[float]:
    """Yield the times in (0, t_end) at which g changes its sign, in their order."""
    side = 0.0
    for start, end in pairwise([t_end * k / _PIECES for k in range(_PIECES + 1)]):
        while start < end:
            side = side or _sign(g(start)) or _sign(g(start + PROBE * (end - start)))
            high = _seen(g, side, start, end)
            if high is None:
                break
            low = start
            while low < (middle := 0.5 * (low + high)) < high:
                low, high = (low, middle) if side * g(middle) < 0.0 else (middle, high)
            if 0.0 < low < t_end:
                yield high
            start, side = high, -side


def _seen(g: Function, side: float, start: float, end: float) -> float | None:
    """Return a time in [start, end] at which g is seen on the other side of zero; None if it never is."""
    width = end - start

    def value(theta: float) -> float:
        return side * g(start + theta * width)

    first, last = max(value(0.0), 0.0), value(1.0)
    rise, fall = (value(PROBE) - first) / PROBE, (last - value(1.0 - PROBE)) / PROBE
    theta = first_seen(value, Look(0.0, first, rise, rise), Look(1.0, last, fall, fall))
    return None if theta is None else start + theta * width


def _sign(value: float) -> float:
    return float((value > 0.0) - (value < 0.0))
