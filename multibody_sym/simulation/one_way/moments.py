"""Moments that a run in modes looks at, as what depends on time alone moves there: nothing tells it where all rests.

A body that sticks has no derivative that a force would change, so that a pulse between two looks is stepped over.
Expressions of time alone are therefore sampled before the run, closely between the moments at which they switch or
fade, and more closely where they move: from one moment to the next none changes by more than a part of its range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import reduce
from itertools import islice, pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.model.declaration.system import System, expressions_in
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.sign_changes import zeros
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.kinks import fading_functions, known_zeros, switching_functions
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import leaves, postorder

SAMPLES: Final = 20_000
"""Evenly spaced times of a run at which expressions of time are sampled: what is narrower may not be seen."""
_BETWEEN: Final = 256  # between two moments at which they switch or fade
_MOST_SWITCHES: Final = 200  # of one function
_PART: Final = 0.25  # of its range, by which an expression may change from one look to the next
_FINEST: Final = 1e-11  # part of a run between looks
_MOST: Final = 400_000  # samples
_MOST_LOOKS: Final = 50_000  # at one expression: what moves faster moves too fast to be followed

_T: Final = symbol("t")
_ARRAYS: Final[Mapping[str, Callable[..., Any]]] = {
    "neg": np.negative,
    "add": lambda *x: reduce(np.add, x),
    "mul": lambda *x: reduce(np.multiply, x),
    "div": np.divide,
    "pow": np.power,
    "atan2": np.arctan2,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "min": lambda *x: reduce(np.minimum, x),
    "max": lambda *x: reduce(np.maximum, x),
    "less": lambda a, b: np.less(a, b).astype(float),
    "less_equal": lambda a, b: np.less_equal(a, b).astype(float),
    "where": lambda c, a, b: np.where(c != 0.0, a, b),
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "sign")},
    "abs": np.abs,
    "table": lambda function, order, a: np.asarray(function.values(order, np.ravel(a))),
}


def moments(system: System, values: Mapping[Node, float], t_end: float) -> Floats:
    """Return the times in (0, t_end) at which a run looks, rising, given the values of parameters by their symbols."""
    laws = list(dict.fromkeys(_laws(system, frozenset(values))))
    if not laws:
        return np.zeros(0)
    with np.errstate(all="ignore"):
        times = _refined(laws, values, _sampled(laws, values, t_end), t_end)
        looked = [_looked(times, _values(law, values, times)) for law in laws]
    found: Floats = times[np.unique(np.concatenate(looked))]
    return found


def _laws(system: System, fixed: frozenset[Node]) -> Iterator[Node]:
    """Yield what depends on time and parameters alone, the terms of sums each for itself."""
    for written in expressions_in(system, ("forces", "constraints", "inputs", "joints", "bodies")):
        if written.node.shadow is not None:  # numbers, which most are
            continue
        timed: dict[Node, bool] = {}
        for n in postorder([written.node]):
            known = n is _T or n in fixed or n.shadow is not None
            timed[n] = known or (bool(n.args) and all(timed[a] for a in n.args))
        yield from (n for n in _largest(written.node, timed) if n is not _T and _T in leaves([n], "symbol"))


def _largest(node: Node, timed: Mapping[Node, bool]) -> Iterator[Node]:
    stack, seen = [node], set[Node]()
    while stack:
        n = stack.pop()
        if n in seen:
            continue
        seen.add(n)
        if timed[n] and n.op not in ("add", "neg"):
            yield n
        else:
            stack.extend(n.args)


def _values(law: Node, values: Mapping[Node, float], times: Floats) -> Floats:
    """Return an expression of time at many times; 0 where it has no value: the run itself will tell."""
    found: dict[Node, Any] = {}
    for n in postorder([law]):
        if n is _T:
            found[n] = times
        elif n.args and n.shadow is None:
            found[n] = _ARRAYS[n.op](*n.own, *(found[a] for a in n.args))
        else:
            found[n] = np.float64(values[n] if n.shadow is None else n.shadow)
    result = np.broadcast_to(np.asarray(found[law], dtype=float), times.shape)
    return np.where(np.isfinite(result), result, 0.0)


def _sampled(laws: Sequence[Node], values: Mapping[Node, float], t_end: float) -> Floats:
    """Return the times at which to sample: evenly spaced, and between moments at which the laws switch or fade."""
    known = {0.0, t_end}
    for g in (*switching_functions(laws), *fading_functions(laws)):
        if _T in leaves([g], "symbol"):
            told = known_zeros(g, _T, values)
            known.update(islice(zeros(_of_time(g, values), t_end), _MOST_SWITCHES) if told is None else told)
    ends = sorted(x for x in known if 0.0 <= x <= t_end)
    even, pieces = np.linspace(0.0, t_end, SAMPLES + 1), max(1, min(_BETWEEN, _MOST // (2 * len(ends))))
    between = [np.linspace(a, b, pieces + 1) for a, b in pairwise(ends)]
    return np.unique(np.concatenate([even, *between]))


def _of_time(g: Node, values: Mapping[Node, float]) -> Callable[[float], float]:
    def function(t: float) -> float:
        try:
            return evaluate_float([g], {**values, _T: t})[0]
        except (ArithmeticError, ValueError):
            return 0.0

    return function


def _refined(laws: Sequence[Node], values: Mapping[Node, float], times: Floats, t_end: float) -> Floats:
    """Return the times with more of them between those from which to the next a law changes by much."""
    while len(times) < _MOST:
        moving = np.zeros(len(times) - 1, dtype=bool)
        for law in laws:
            x = _values(law, values, times)
            change = np.abs(np.diff(x))
            moving |= (change > _PART * np.ptp(x)) & (np.diff(times) > _FINEST * t_end)
        if not moving.any():
            break
        times = np.sort(np.concatenate([times, 0.5 * (times[:-1] + times[1:])[moving]]))
    return times


def _looked(times: Floats, values: Floats) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return at which of the times to look at a law: whenever it has changed by a part of its range."""
    span = float(np.ptp(values))
    if not span > 0.0:
        return np.zeros(0, dtype=np.intp)
    way = np.floor(np.cumsum(np.abs(np.diff(values))) / (_PART * span))
    found = 1 + np.flatnonzero(np.diff(way, prepend=0.0))
    return found[found < len(times) - 1] if len(found) <= _MOST_LOOKS else np.zeros(0, dtype=np.intp)
