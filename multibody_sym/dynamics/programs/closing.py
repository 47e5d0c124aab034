"""Programs that close loops at the start: rows and their sizes in numbers, at any state.

Over floats, Python walks through the kinematics of all bodies at each state; these are the same rows over Nodes. H and
H G^-1, with M = G^T G, consist of the elements that are not zero everywhere.
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
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import NO_WRENCH, direction, position
from multibody_sym.mechanics.row_kinematics import RowMotion, power_terms, row_motions
from multibody_sym.mechanics.row_records import AngleRow
from multibody_sym.mechanics.state import arrays, slot_state
from multibody_sym.program.loops import with_loops
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.functions import absolute, maximum, sqrt
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.rank import PIVOT, without_rounding
from multibody_sym.scalars.vectors import S, dot

CLOSING: Final = "closing"
PLACES: Final = "closing_places"
CHANGE: Final = "closing_change"
_LONG: Final = 400
"""Operations from which on loops are sooner compiled: these Programs run so seldom that only compiling counts."""

Elements = list[tuple[int, int, Node]]
"""Row, column and value of the elements of a matrix that are not zero everywhere."""


def closing_programs(mechanism: Mechanism) -> dict[str, Program]:
    """Return by name the Programs that close the rows of a mechanism; none where it has none to close.

    All take (t, q, u, parameters, inputs, modes). `closing`: of each row (ns) phi, phidot, gamma, the largest component
    of its wrenches, `exerted`, the terms of its `power`, and `aligned`, negative where a joint is turned over; `length`
    of the model; `shares` (nu): the pivots of M as parts of its diagonal; elements of H, `jacobian`, and of H G^-1,
    `weighted`. `closing_places`: rows and columns of those elements, and 1 for each row that does not vanish, else 0.
    `closing_change`: G^-1 x (nu) for one more input x (nu).
    """
    if not closes_by_programs(mechanism):
        return {}
    motion = economical_motion(mechanism, slot_state(mechanism))
    rows = row_motions(motion)
    acting = [
        k
        for k, row in enumerate(rows)
        if row.kinematic and {*map(as_node, row.jacobian), as_node(row.gamma), as_node(row.phidot)} != {ZERO}
    ]
    jacobian = [(k, j, as_node(x)) for k in acting for j, x in enumerate(rows[k].jacobian) if as_node(x) is not ZERO]
    factors = tree_factors(motion)
    lines = [(k, factors.weighted([as_node(x) for x in rows[k].jacobian])) for k in acting]
    weighted = [(k, j, as_node(x)) for k, line in lines for j, x in enumerate(line) if as_node(x) is not ZERO]
    pivots = [freedom.pivot for of_body in factors.freedoms for freedom in of_body]
    shares = [as_node(p) / d for p, d in zip(pivots, mass_diagonal(motion), strict=True)]
    matrices = {"jacobian": jacobian, "weighted": weighted}
    markers = [position(motion, marker) for marker in motion.mechanism.markers.values()]
    squares = dict.fromkeys(as_node(dot(p, p)) for p in (*markers, *(p for _, p in motion.poses)))
    closing = Trace(CLOSING, arrays(mechanism)).finish(
        {
            **{name: ((len(rows),), values) for name, values in _row_values(motion, rows).items()},
            "length": ((), [as_node(sqrt(reduce(maximum, squares, ZERO)))]),
            "shares": ((len(shares),), shares),
            **{name: ((len(elements),), [x for _, _, x in elements]) for name, elements in matrices.items()},
        }
    )
    acts = [ONE if k in acting else ZERO for k in range(len(rows))]
    pairs = {name: [as_node(x) for k, j, _ in elements for x in (k, j)] for name, elements in matrices.items()}
    places = Trace(PLACES, arrays(mechanism)).finish(
        {**{name: ((len(x) // 2, 2), x) for name, x in pairs.items()}, "acting": ((len(acts),), acts)}
    )
    count = len(mechanism.speeds)
    trace = Trace(CHANGE, (*arrays(mechanism), Array("x", (count,))))
    change = trace.finish({"change": ((count,), correction(factors, [], lambda _weighted: list(trace["x"])))})
    return {program.name: with_loops(program, _LONG) for program in (closing, places, change)}


def closes_by_programs(mechanism: Mechanism) -> bool:
    """Return whether Programs close the rows of a mechanism: it has no one-way elements and no massless freedoms."""
    special = mechanism.one_way or mechanism.mode is not None or mechanism.relative is not None
    return bool(mechanism.rows) and not special and not massless_speeds(mechanism)


def _row_values(motion: Motion, rows: Sequence[RowMotion]) -> dict[str, list[Node]]:
    """Return the outputs of `closing` that have a value for each row."""
    exerted, aligned = [], []
    for row, declared in zip(rows, motion.mechanism.rows, strict=True):
        wrenches = (wrench for wrench in row.of_body if wrench is not NO_WRENCH)
        parts = (as_node(absolute(as_node(x))) for wrench in wrenches for part in wrench for x in part)
        exerted.append(reduce(maximum, (x for x in dict.fromkeys(parts) if x is not ZERO), ZERO))
        cosine: S = ONE
        if isinstance(declared, AngleRow) and declared.shared is not None:
            cosine = dot(*(direction(motion, frame, declared.shared) for frame in declared.frames))
        aligned.append(cosine)
    values = {
        "phi": [row.phi if row.holonomic and row.kinematic else ZERO for row in rows],
        "phidot": [row.phidot for row in rows],
        "gamma": [row.gamma for row in rows],
        "exerted": exerted,
        "power": power_terms(motion, rows),
        "aligned": aligned,
    }
    return {name: [as_node(x) for x in own] for name, own in values.items()}


# ----------------------------------------------------------------------------------------------------------------------
# Rows of a mechanism in numbers at a state, by callable Programs (`closing_programs`).


Functions = Mapping[str, Callable[..., tuple[Floats, ...]]]
"""Programs by name, ready to be called with their inputs; `inputs` among them."""
_NO_MODES: Final = np.empty(0)
_REMEMBERED: Final = 4


@dataclass(frozen=True)
class ClosingRows:
    """The values of `closing` at a state, by the names of its outputs; H (ns x nu) and H G^-1 of all rows."""

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
    _latest: tuple[tuple[bytes, ClosingRows], ...] = field(default=(), init=False)

    def at(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> ClosingRows:
        """Return the rows at a state; numbers without a value are not finite."""
        key = np.concatenate([(t,), q, u, parameters]).tobytes()
        for known, rows in self._latest:  # several functions ask for the same state, one after the other
            if known == key:
                return rows
        with np.errstate(all="ignore"):
            values = self.functions[CLOSING](*self._arguments(t, q, u, parameters))
        phi, phidot, gamma, exerted, power, aligned, length, shares, jacobian, weighted = values
        H = without_rounding(self._dense(jacobian, self._places[0]), exerted)
        moves = H.any(axis=1, keepdims=True)
        by_mass = np.where(moves, self._dense(weighted, self._places[1]), 0.0)
        rows = ClosingRows(phi, phidot, gamma, power, aligned, float(length), shares, H, by_mass)
        object.__setattr__(self, "_latest", ((key, rows), *self._latest[: _REMEMBERED - 1]))
        return rows

    def change(self, t: float, q: Floats, u: Floats, parameters: Sequence[float], x: Floats) -> Floats:
        (change,) = self.functions[CHANGE](*self._arguments(t, q, u, parameters), x)
        return change

    @cached_property
    def acting(self) -> Floats:
        """1 for each row (ns) that does not vanish everywhere, 0 for the others."""
        return self._constants[2]

    def _arguments(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> tuple[float | Floats, ...]:
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
