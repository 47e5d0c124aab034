"""Programs from which the start values of closed loops are found: rows and their sizes in numbers, at any state.

Over floats the kinematics of all bodies are walked through in Python for each state that is looked at; these are the
same rows over Nodes. Only elements of H and H G^-1 are told that are not zero everywhere, M = G^T G.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, fields
from functools import cached_property, reduce
from typing import Final

import numpy as np

from multibody_sym.dynamics.formalisms.articulated_body import tree_factors
from multibody_sym.dynamics.formalisms.composite_body import mass_diagonal
from multibody_sym.dynamics.formalisms.constrained import correction
from multibody_sym.dynamics.formalisms.equations import MassFactors, massless_speeds
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import NO_WRENCH, direction, position
from multibody_sym.mechanics.row_kinematics import RowMotion, power_terms, row_motions
from multibody_sym.mechanics.row_records import AngleRow, Row
from multibody_sym.mechanics.state import arrays, slot_state
from multibody_sym.program.loops import rolled
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import absolute, maximum, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.rank import PIVOT, without_rounding
from multibody_sym.scalars.vectors import dot

CLOSING: Final = "closing"
PLACES: Final = "closing_places"
CHANGE: Final = "closing_change"
_LONG: Final = 400
"""Operations from which on loops are sooner compiled: these Programs run too seldom for anything else to count."""

Elements = list[tuple[int, int, Node]]
"""Row, column and value of what is not zero everywhere in a matrix."""


def closing_programs(mechanism: Mechanism) -> dict[str, Program]:
    """Return by name the Programs that closing the rows of a mechanism takes; none where it has none to close.

    All take (t, q, u, parameters, inputs, modes). `closing`: of each row (ns) phi, phidot, gamma, the largest component
    that it `exerted`, the terms of its `power`, and `aligned`, what is negative where a joint is turned over; `length`
    of the model; `shares` (nu): the pivots of M as parts of its diagonal; elements of H, `jacobian`, and of H G^-1,
    `weighted`. `closing_places`: rows and columns of those elements, and 1 for each row that does not vanish, else 0.
    `closing_change`: G^-1 x (nu) for one more input x (nu).
    """
    if not closes_by_programs(mechanism):
        return {}
    motion = economical_motion(mechanism, slot_state(mechanism))
    rows = row_motions(motion)
    acting = [k for k, row in enumerate(rows) if row.kinematic and _acts(row)]
    jacobian = [(k, j, as_node(x)) for k in acting for j, x in enumerate(rows[k].jacobian) if as_node(x) is not ZERO]
    factors = tree_factors(motion)
    lines = [(k, factors.weighted([as_node(x) for x in rows[k].jacobian])) for k in acting]
    weighted = [(k, j, as_node(x)) for k, line in lines for j, x in enumerate(line) if as_node(x) is not ZERO]
    pivots = [freedom.pivot for of_body in factors.freedoms for freedom in of_body]
    shares = [as_node(p) / d for p, d in zip(pivots, mass_diagonal(motion), strict=True)]
    found = (
        _closing(mechanism, motion, rows, jacobian, weighted, shares),
        _places(mechanism, acting, jacobian, weighted),
        _change(mechanism, factors),
    )
    return {program.name: rolled(program, _LONG) for program in found}


def closes_by_programs(mechanism: Mechanism) -> bool:
    """Return whether the rows of a mechanism are closed by Programs: nothing in it holds one way, all has mass."""
    special = mechanism.one_way or mechanism.mode is not None or mechanism.relative is not None
    return bool(mechanism.rows) and not special and not massless_speeds(mechanism)


def _acts(row: RowMotion) -> bool:
    return {*map(as_node, row.jacobian), as_node(row.gamma), as_node(row.phidot)} != {ZERO}


def _closing(
    mechanism: Mechanism,
    motion: Motion,
    rows: Sequence[RowMotion],
    jacobian: Elements,
    weighted: Elements,
    shares: Sequence[Node],
) -> Program:
    trace, count = Trace(CLOSING, arrays(mechanism)), (len(rows),)
    declared = motion.mechanism.rows
    of_rows: Mapping[str, Sequence[object]] = {
        "phi": [row.phi if row.holonomic and row.kinematic else ZERO for row in rows],
        "phidot": [row.phidot for row in rows],
        "gamma": [row.gamma for row in rows],
        "exerted": [_largest(row) for row in rows],
        "power": power_terms(motion, rows),
        "aligned": [_aligned(row, motion) for row in declared],
    }
    outputs = {name: (count, [as_node(x) for x in values]) for name, values in of_rows.items()}
    return trace.finish(
        {
            **outputs,
            "length": ((), [_length(motion)]),
            "shares": ((len(shares),), shares),
            "jacobian": ((len(jacobian),), [x for _, _, x in jacobian]),
            "weighted": ((len(weighted),), [x for _, _, x in weighted]),
        }
    )


def _largest(row: RowMotion) -> Node:
    """Return the largest component of the wrenches of a unit multiplier."""
    exerted = (wrench for wrench in row.of_body if wrench is not NO_WRENCH)
    parts = (as_node(absolute(as_node(x))) for wrench in exerted for part in wrench for x in part)
    return reduce(maximum, (x for x in dict.fromkeys(parts) if x is not ZERO), ZERO)


def _aligned(row: Row, motion: Motion) -> Node:
    if not isinstance(row, AngleRow) or row.shared is None:
        return ONE
    first, second = (direction(motion, frame, row.shared) for frame in row.frames)
    return as_node(dot(first, second))


def _length(motion: Motion) -> Node:
    """Return how far the farthest body or named point is from the origin."""
    markers = [position(motion, marker) for marker in motion.mechanism.markers.values()]
    squares = dict.fromkeys(as_node(dot(p, p)) for p in (*markers, *(p for _, p in motion.poses)))
    return as_node(sqrt(reduce(maximum, squares, ZERO)))


def _places(mechanism: Mechanism, acting: Sequence[int], jacobian: Elements, weighted: Elements) -> Program:
    trace = Trace(PLACES, arrays(mechanism))
    named = {"jacobian": jacobian, "weighted": weighted}
    acts = [ONE if k in set(acting) else ZERO for k in range(len(mechanism.rows))]
    places = {name: [as_node(x) for k, j, _ in found for x in (k, j)] for name, found in named.items()}
    return trace.finish(
        {
            **{name: ((len(values) // 2, 2), values) for name, values in places.items()},
            "acting": ((len(acts),), acts),
        }
    )


def _change(mechanism: Mechanism, factors: MassFactors) -> Program:
    """Return the Program of the change of the speeds from what the rows, in the mass matrix's norm, leave least."""
    count = len(mechanism.speeds)
    trace = Trace(CHANGE, (*arrays(mechanism), Array("x", (count,))))
    found = correction(factors, [], lambda _weighted: list(trace["x"]))
    return trace.finish({"change": ((count,), found)})


# ----------------------------------------------------------------------------------------------------------------------
# Rows of a mechanism in numbers at a state, by Programs (`closing_programs`) that somebody made callable.


Functions = Mapping[str, Callable[..., tuple[Floats, ...]]]
"""Programs by name, ready to be called with their inputs; `inputs` among them."""
_NO_MODES: Final = np.empty(0)
_REMEMBERED: Final = 4


@dataclass(frozen=True)
class RowNumbers:
    """What `closing` says at a state, by the names of its outputs; H (ns x nu) and H G^-1 of all rows."""

    phi: Floats
    phidot: Floats
    gamma: Floats
    power: Floats
    aligned: Floats
    length: float
    shares: Floats
    jacobian: Floats
    weighted: Floats

    @cached_property
    def finite(self) -> bool:
        """Whether all of them are."""
        return all(bool(np.isfinite(getattr(self, each.name)).all()) for each in fields(self))

    @property
    def has_inertia(self) -> bool:
        """Whether all pivots of the mass matrix are positive beside its diagonal."""
        return bool((self.shares > PIVOT * len(self.shares)).all())


@dataclass(frozen=True, eq=False)
class CompiledRows:
    """The rows of a `mechanism` by callable Programs."""

    mechanism: Mechanism
    functions: Functions
    _latest: tuple[tuple[bytes, RowNumbers], ...] = field(default=(), init=False)

    def at(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> RowNumbers:
        """Return the rows at a state; numbers that are not finite where they have no value."""
        key = np.concatenate([(t,), q, u, parameters]).tobytes()
        for known, found in self._latest:  # a state is looked at from several sides, one after the other
            if known == key:
                return found
        found = self._at(t, q, u, parameters)
        object.__setattr__(self, "_latest", ((key, found), *self._latest[: _REMEMBERED - 1]))
        return found

    def _at(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> RowNumbers:
        with np.errstate(all="ignore"):
            found = self.functions[CLOSING](*self._arguments(t, q, u, parameters))
        phi, phidot, gamma, exerted, power, aligned, length, shares, jacobian, weighted = found
        H = without_rounding(self._dense(jacobian, self._places[0]), exerted)
        moves = H.any(axis=1, keepdims=True)
        return RowNumbers(
            phi,
            phidot,
            gamma,
            power,
            aligned,
            float(length),
            shares,
            H,
            np.where(moves, self._dense(weighted, self._places[1]), 0.0),
        )

    def change(self, t: float, q: Floats, u: Floats, parameters: Sequence[float], x: Floats) -> Floats:
        """Return G^-1 x (nu) at a state."""
        (change,) = self.functions[CHANGE](*self._arguments(t, q, u, parameters), x)
        return change

    @cached_property
    def acting(self) -> Floats:
        """Return which rows (ns) do not vanish everywhere: 1, and 0 for the others."""
        return self._constants[2]

    def _arguments(
        self, t: float, q: Floats, u: Floats, parameters: Sequence[float]
    ) -> tuple[float | Floats, ...]:
        known = t, q, u, np.asarray(parameters, dtype=float)
        inputs = self.functions["inputs"](*known)[0] if self.mechanism.inputs else np.empty(0)
        return (*known, inputs, _NO_MODES)

    @cached_property
    def _constants(self) -> tuple[Floats, ...]:
        sizes = len(self.mechanism.coordinates), len(self.mechanism.speeds), len(self.mechanism.parameters)
        return self.functions[PLACES](0.0, *map(np.zeros, sizes), np.zeros(len(self.mechanism.inputs)), _NO_MODES)

    @cached_property
    def _places(self) -> list[tuple[Floats, Floats]]:
        found = [places.astype(int) for places in self._constants[:2]]
        return [(places[:, 0], places[:, 1]) for places in found]

    def _dense(self, values: Floats, places: tuple[Floats, Floats]) -> Floats:
        matrix = np.zeros((len(self.mechanism.rows), len(self.mechanism.speeds)))
        matrix[places] = values
        return matrix
