"""Prescribed motions and laws of masses as functions of time: the first jump or pole, which is a mistake.

In: expressions, values of their symbols, the end of the run. Out: a jump, or ModelError with its path and time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Set
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
    bound_rounding,
    branches,
    known_zeros,
    poles,
    switching_functions,
    zeros,
)

# ----------------------------------------------------------------------------------------------------------------------
# Prescribed motions that jump, in position or in speed, or have poles: no finite force makes them.
#
# Prescribed motions are smooth between the zeros of their switching functions, their branch points and their poles. At
# each of these, values and rates a little before and a little after are compared.


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
    """A time at which there may be a jump, and the distances at which a motion is compared: each must show the jump."""

    time: float
    beside: tuple[float, ...]
    of_branch: bool = False


def verify_motions(system: System, values: Mapping[Node, float], t_end: float) -> None:
    """Raise ModelError, with path and time, where a prescribed motion jumps or has a pole, or its speed, before t_end.

    `values` are those of parameters, and of the coordinates at the start, by their symbols. Motions of joints and of
    ground are verified, and the expressions of constraints, which are taken to change with time alone.
    """
    fixed = {_T, *map(symbol, system.parameters)}
    for path, node, _ in expressions(with_driving_inputs(system)):
        of_constraint = path[0] == "constraints"
        if (of_constraint or path[2:3] == ("motion",)) and _T in leaves([node], "symbol"):
            of_speeds = of_constraint and isinstance(system.constraints[path[1]], VelocityConstraint)
            jump = first_jump(node, values, t_end, fixed, with_rate=not of_speeds)
            if jump is not None:
                with at(*path):
                    raise ModelError(
                        _message(jump, "expression" if of_constraint else "motion", of_speeds), number="M119"
                    )


def first_jump(
    node: Node, values: Mapping[Node, float], t_end: float, fixed: Set[Node], *, with_rate: bool = False
) -> Jump | None:
    """Return the first jump or pole of an expression of time, or of its rate, before t_end (s); None where none is.

    `values` by symbols; those that are `fixed` keep theirs, with the time. Results are remembered by the values that
    the expression names.
    """
    named = leaves([node], "symbol")
    known = tuple((leaf, values[leaf]) for leaf in named if leaf in values)
    return _first_jump(node, known, t_end, frozenset(fixed & set(named)), with_rate)


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
    where = f"t = {jump.time:.6g} s, from {jump.before:.6g} to {jump.after:.6g}"
    if jump.of == "value" and not of_speeds:
        return f"{subject} jumps at {where}: nothing moves so; let it pass through all that is between"
    return (
        f"{subject} jumps at {where}, and the speed of what it moves would: that takes an impact, which is not "
        "computed; let the speed change in a time that is not zero, as in where(t < 1, 0, (t - 1)^2)"
    )


@lru_cache(maxsize=64)
def _first_jump(
    node: Node, known_values: tuple[tuple[Node, float], ...], t_end: float, fixed: frozenset[Node], with_rate: bool
) -> Jump | None:
    values = dict(known_values)
    nodes = {"value": node, "rate": derivative(node, _T)} if with_rate else {"value": node}
    jumps = list(_jump_places(node, values, t_end))
    pole_places: list[_Place] = []
    for branch in poles(nodes.values(), _T):
        if _T in (named := set(leaves([branch.switch], "symbol"))) and named <= fixed:
            pole_places += _branch_places(branch, values, t_end)
    found: list[Jump] = []
    for of, n in nodes.items():
        knots = []  # where derivatives of tables may jump: tables do not
        for x in postorder([n]):
            if x.op == "table" and x.data[1] > 0 and _T in leaves([x], "symbol"):
                knots += [place for g in at_knots(x) for place in _switch_places(g, values, t_end)]
        places = sorted([*jumps, *knots], key=lambda place: place.time)
        if not places and not pole_places:
            continue
        f = _of_time(n, values)
        sizes = sorted(abs(f(t_end * k / PIECES)) for k in range(PIECES + 1))
        found += islice((jump for place in places if (jump := _jump(f, of, place, sizes)) is not None), 1)
        known = {**dict.fromkeys(leaves([n], "symbol"), 0.0), **values}
        found += [jump for place in pole_places if (jump := _pole(n, known, of, place, sizes)) is not None]
    first = min((jump.time for jump in found), default=0.0)
    earliest = (jump for jump in found if jump.time <= first + _BESIDE * t_end)
    return max(earliest, key=lambda jump: jump.pole, default=None)


def _jump_places(node: Node, values: Mapping[Node, float], t_end: float) -> Iterator[_Place]:
    tables = {g for n in postorder([node]) if n.op == "table" for g in at_knots(n)}
    for g in switching_functions([node]):
        if g not in tables and _T in leaves([g], "symbol"):
            yield from _switch_places(g, values, t_end)
    for branch in branches([node], _T):
        if _T in leaves([branch.switch], "symbol"):
            yield from _branch_places(branch, values, t_end)


def _switch_places(g: Node, values: Mapping[Node, float], t_end: float) -> Iterator[_Place]:
    exact = known_zeros(g, _T, values)
    times = islice(zeros(_of_time(g, values), t_end), _MOST_ZEROS) if exact is None else exact
    yield from (_Place(time, (_BESIDE * t_end,)) for time in times if 0.0 < time < t_end)


def _branch_places(branch: Branch, values: Mapping[Node, float], t_end: float) -> Iterator[_Place]:
    """Yield the times at which a branch's switch changes its sign and its `touching` function touches zero."""
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
    """Return an expression as a function of time, 0 where it has no value, which the run reports.

    Symbols without a value, as measured coordinates, count as zero.
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
    """Return the jump of f at a place: a change that does not go down with the distance. None where there is none.

    `sizes` are values of f, rising: beside a branch a usual one is the measure, as poles are none.
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
    """Return the pole of an expression at a place: large beside it, growing, not by rounding alone. None without."""
    beside = place.beside[-1]
    exact = {leaf: Bounded(x, 0.0) for leaf, x in known.items()}
    times = {x: Bounded(place.time + x * beside, 0.0) for x in (-1.0, -0.01, 0.01, 1.0)}
    near = {x: bound_rounding([node], {**exact, _T: time})[0] for x, time in times.items()}
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


def verify_mass_laws(system: System, values: Mapping[Node, float], t_end: float) -> None:
    """Raise ModelError, with path and place, where a mass, centre of mass or inertia jumps.

    `values` are those of parameters, and of the coordinates at the start, by their symbols. Laws of the time are looked
    at until `t_end` (s), those of a coordinate along it, all else as at the start.
    """
    named = {_T, *map(symbol, system.parameters)}
    for path, node, unit in expressions(system):
        if path[0] == "bodies" and any(path[2 : 2 + len(part)] == part for part in _PARTS):
            for along, jump in _jumps(node, values, t_end, frozenset(named)):
                name = str(along.data)
                change = f"from {jump.before:.6g} to {jump.after:.6g} {unit or ''}".rstrip()
                with at(*path):
                    raise ModelError(
                        f"it jumps at {name} = {jump.time:.6g}, {change}: what leaves or joins at once takes momentum "
                        "along, which no flow tells. Let it change over a stretch that is not zero, as with "
                        f"min(max(({name} - {jump.time:.6g})/0.01, 0), 1), or make what leaves a body of its own"
                    )


def _jumps(
    node: Node, values: Mapping[Node, float], t_end: float, named: frozenset[Node]
) -> Iterator[tuple[Node, Jump]]:
    """Yield the first jumps of a law, each with the symbol along which it jumps; `time` is that symbol's value."""
    switching = leaves(switching_functions([node]), "symbol")
    if _T in switching and t_end > 0.0:
        jump = first_jump(node, values, t_end, named)
        if jump is not None:
            yield _T, jump
    for along in (leaf for leaf in switching if leaf not in named):
        for width in _RANGES:
            place = number(width) * (_T - number(1) / 2)
            known = {leaf: place if leaf is along else leaf for leaf in leaves([node], "symbol") if leaf is not _T}
            (moved,) = evaluate([node], {**known, _T: number(0)})
            jump = first_jump(moved, values, 1.0, named)
            if jump is not None:
                yield along, Jump(width * (jump.time - 0.5), jump.of, jump.before, jump.after, jump.pole)
