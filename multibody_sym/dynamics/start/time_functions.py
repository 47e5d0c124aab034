"""Masses that jump: what leaves or joins at once takes momentum along, which the rate of no flow tells."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Set
from functools import lru_cache
from itertools import islice
from typing import Final

from multibody_sym.errors import ModelError, at
from multibody_sym.mechanics.declared_rows import with_driving_inputs
from multibody_sym.model.constraints import VelocityConstraint
from multibody_sym.model.system import System, expressions
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, number, symbol
from multibody_sym.scalars.sign_changes import (
    PIECES,
    Bounded,
    Branch,
    Function,
    at_knots,
    bounded,
    branches,
    known_zeros,
    poles,
    switching_functions,
    zeros,
)

# ----------------------------------------------------------------------------------------------------------------------
# Prescribed motions that jump, in position or in speed, or have poles: no finite force makes them, nothing moves so.
#
# Between the zeros of their switching functions, their branch points and their poles prescribed motions are smooth; at
# each of these on the way the values and the rates a little before and a little after are compared.


_T: Final = symbol("t")
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
_GROWN: Final = 1.3  # times a hundred times nearer: weaker poles than of order 0.06 are not told


@dataclass(frozen=True)
class Jump:
    """At `time` a motion, or its speed (`of`), changes from `before` to `after`, or has a pole between them."""

    time: float
    of: str
    before: float
    after: float
    pole: bool = False


@dataclass(frozen=True)
class _Place:
    """A time at which there may be a jump, and how far before and after it a motion is compared: each must tell it."""

    time: float
    beside: tuple[float, ...]
    of_branch: bool = False


@dataclass(frozen=True)
class _Motion:
    """An expression of time, the values of other symbols, and those that keep theirs, with time."""

    node: Node
    known: tuple[tuple[Node, float], ...]
    t_end: float
    fixed: frozenset[Node]


def _motion(node: Node, values: Mapping[Node, float], t_end: float, fixed: Set[Node]) -> _Motion:
    """Return an expression of time with what it names alone: it is the same wherever nothing of that changes."""
    named = leaves([node], "symbol")
    known = tuple((leaf, values[leaf]) for leaf in named if leaf in values)
    return _Motion(node, known, t_end, frozenset(fixed & set(named)))


def verify_motions(system: System, values: Mapping[Node, float], t_end: float) -> None:
    """Raise ModelError, with path and time, where a prescribed motion jumps or has a pole, or its speed, before t_end.

    `values` are those of parameters, and of the coordinates at the start, by their symbols. Motions of joints and of
    ground are verified, and the expressions of constraints as they change with time alone.
    """
    fixed = {_T, *map(symbol, system.parameters)}
    for path, node, _ in expressions(with_driving_inputs(system)):
        of_constraint = path[0] == "constraints"
        if (of_constraint or path[2:3] == ("motion",)) and _T in leaves([node], "symbol"):
            of_speeds = of_constraint and isinstance(system.constraints[path[1]], VelocityConstraint)
            jump = _first_jump(_motion(node, values, t_end, fixed), with_rate=not of_speeds)
            if jump is not None:
                with at(*path):
                    raise ModelError(
                        _message(jump, "expression" if of_constraint else "motion", of_speeds), number="M119"
                    )


def first_jump(node: Node, values: Mapping[Node, float], t_end: float, fixed: Set[Node]) -> Jump | None:
    """Return the first jump or pole of an expression of time before t_end (s), None where there is none.

    `values` by symbols; those that are `fixed` keep theirs, with the time.
    """
    return _first_jump(_motion(node, values, t_end, fixed), with_rate=False)


def motions(system: System) -> list[Node]:
    """Return the expressions of prescribed motions of joints and of ground, inputs that drive them in their place."""
    return [node for path, node, _ in expressions(with_driving_inputs(system)) if path[2:3] == ("motion",)]


def _message(jump: Jump, what: str, of_speeds: bool) -> str:
    subject = f"this {what}" if of_speeds or jump.of == "value" else f"the rate of this {what}"
    if jump.pole:
        return (
            f"{subject} has a pole at t = {jump.time:.6g} s, where it passes every bound: nothing moves so; keep its "
            "denominators from zero, or let the run end before (t_end)"
        )
    told = f"t = {jump.time:.6g} s, from {jump.before:.6g} to {jump.after:.6g}"
    if jump.of == "value" and not of_speeds:
        return f"{subject} jumps at {told}: nothing moves so; let it pass through all that is between"
    return (
        f"{subject} jumps at {told}, and the speed of what it moves would: that takes an impact, which is not "
        "computed; let the speed change in a time that is not zero, as in where(t < 1, 0, (t - 1)^2)"
    )


@lru_cache(maxsize=64)
def _first_jump(motion: _Motion, *, with_rate: bool) -> Jump | None:
    """Return the first jump or pole of an expression of time, or of its rate; None where it has no value."""
    node, values, t_end = motion.node, dict(motion.known), motion.t_end
    nodes = {"value": node, "rate": derivative(node, _T)} if with_rate else {"value": node}
    jumping, poled = list(_jumping(motion)), list(_poled(motion, nodes.values()))
    found: list[Jump] = []
    for of, n in nodes.items():
        places = sorted([*jumping, *_at_knots(n, motion)], key=lambda place: place.time)
        if not places and not poled:
            continue
        f = _of_time(n, values)
        sizes = sorted(abs(f(t_end * k / PIECES)) for k in range(PIECES + 1))
        found += islice((jump for place in places if (jump := _jump(f, of, place, sizes)) is not None), 1)
        known = {**dict.fromkeys(leaves([n], "symbol"), 0.0), **values}
        found += [jump for place in poled if (jump := _pole(n, known, of, place, sizes)) is not None]
    first = min((jump.time for jump in found), default=0.0)
    earliest = (jump for jump in found if jump.time <= first + _BESIDE * t_end)
    return max(earliest, key=lambda jump: jump.pole, default=None)


def _jumping(motion: _Motion) -> Iterator[_Place]:
    """Yield where an expression and its rate may jump."""
    tables = {g for n in postorder([motion.node]) if n.op == "table" for g in at_knots(n)}
    for g in switching_functions([motion.node]):
        if g not in tables and _T in leaves([g], "symbol"):
            yield from _switching(g, dict(motion.known), motion.t_end)
    for branch in branches([motion.node], _T):
        if _T in leaves([branch.switch], "symbol"):
            yield from _branching(branch, dict(motion.known), motion.t_end)


def _at_knots(node: Node, motion: _Motion) -> Iterator[_Place]:
    """Yield the knots of tables whose derivatives stand in an expression: they may jump there, tables do not."""
    for n in postorder([node]):
        if n.op == "table" and n.data[1] > 0 and _T in leaves([n], "symbol"):
            for g in at_knots(n):
                yield from _switching(g, dict(motion.known), motion.t_end)


def _poled(motion: _Motion, nodes: Iterable[Node]) -> Iterator[_Place]:
    """Yield where an expression or its rate may have a pole, whatever else moves."""
    for branch in poles(nodes, _T):
        if _T in (named := set(leaves([branch.switch], "symbol"))) and named <= motion.fixed:
            yield from _branching(branch, dict(motion.known), motion.t_end)


def _switching(g: Node, values: Mapping[Node, float], t_end: float) -> Iterator[_Place]:
    """Yield where a switching function changes its sign."""
    told = known_zeros(g, _T, values)
    times = islice(zeros(_of_time(g, values), t_end), _MOST_ZEROS) if told is None else told
    yield from (_Place(time, (_BESIDE * t_end,)) for time in times if 0.0 < time < t_end)


def _branching(branch: Branch, values: Mapping[Node, float], t_end: float) -> Iterator[_Place]:
    """Yield where a branch is met: where its switch changes its sign and what must touch zero does so."""
    times = islice(zeros(_of_time(branch.switch, values), t_end), _MOST_ZEROS)
    if branch.touching is None:
        yield from (_Place(time, (_BESIDE * t_end, _BESIDE_POLE * t_end), of_branch=True) for time in times)
        return
    touching = _of_time(branch.touching, values)
    scale = branch.scale or max(abs(touching(t_end * k / PIECES)) for k in range(PIECES + 1))
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


def _pole(node: Node, known: Mapping[Node, float], of: str, place: _Place, sizes: list[float]) -> Jump | None:
    """Return that an expression has a pole at a place, if it is large beside it, grows, and not by rounding alone."""
    beside = place.beside[-1]
    exact = {leaf: Bounded(x, 0.0) for leaf, x in known.items()}
    times = {x: Bounded(place.time + x * beside, 0.0) for x in (-1.0, -0.01, 0.01, 1.0)}
    near = {x: bounded([node], {**exact, _T: time})[0] for x, time in times.items()}
    for side in (-1.0, 1.0):
        far, close = (abs(near[side * part].value) for part in (1.0, 0.01))
        told = near[0.01 * side].bound < 0.1 * close
        if told and close > _GROWN * far and far > sizes[len(sizes) // 2]:
            return Jump(place.time, of, near[-1.0].value, near[1.0].value, pole=True)
    return None


# ----------------------------------------------------------------------------------------------------------------------

_PARTS: Final = (("mass", "value"), ("shape", "mass", "value"), ("com",), ("inertia",))
_RANGES: Final = (20, 20_000)
"""Widths (m, rad) about zero in which a law of a coordinate is looked at: near by, and far for what is far."""


@dataclass(frozen=True)
class _Found:
    """The symbol along which a law jumps, and the jump, whose time is the value of the symbol."""

    along: Node
    jump: Jump


def verify_mass_laws(system: System, values: Mapping[Node, float], t_end: float) -> None:
    """Raise ModelError, with path and place, where a mass, centre of mass or inertia jumps.

    `values` are those of parameters, and of the coordinates at the start, by their symbols. Laws of the time are looked
    at until `t_end` (s), those of a coordinate along it, all else as at the start.
    """
    named = {_T, *map(symbol, system.parameters)}
    for path, node, unit in expressions(system):
        if path[0] == "bodies" and any(path[2 : 2 + len(part)] == part for part in _PARTS):
            for found in _jumps(node, values, t_end, frozenset(named)):
                with at(*path):
                    raise ModelError(_mass_jumps_message(found, "" if unit is None else unit))


def _jumps(node: Node, values: Mapping[Node, float], t_end: float, named: frozenset[Node]) -> Iterator[_Found]:
    switching = leaves(switching_functions([node]), "symbol")
    if _T in switching and t_end > 0.0:
        jump = first_jump(node, values, t_end, named)
        if jump is not None:
            yield _Found(_T, jump)
    for along in (leaf for leaf in switching if leaf not in named):
        for width in _RANGES:
            place = number(width) * (_T - number(1) / 2)
            known = {leaf: place if leaf is along else leaf for leaf in leaves([node], "symbol") if leaf is not _T}
            (moved,) = evaluate([node], {**known, _T: number(0)})
            jump = first_jump(moved, values, 1.0, named)
            if jump is not None:
                yield _Found(along, Jump(width * (jump.time - 0.5), jump.of, jump.before, jump.after, jump.pole))


def _mass_jumps_message(found: _Found, unit: str) -> str:
    jump, name = found.jump, str(found.along.data)
    told = f"it jumps at {name} = {jump.time:.6g}, from {jump.before:.6g} to {jump.after:.6g} {unit}".rstrip()
    return (
        f"{told}: what leaves or joins at once takes momentum along, which no flow tells. Let it change over "
        f"a stretch that is not zero, as with min(max(({name} - {jump.time:.6g})/0.01, 0), 1), or make what leaves a "
        "body of its own"
    )
