"""States of a mechanism, its accelerations, and expressions there, in 50 digits: what vanishes to 30 is zero."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

from mpmath import MPContext

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.errors import UndefinedValueError
from multibody_sym.kinematics.motion import coordinate_rates
from multibody_sym.kinematics.state import State, slot_state
from multibody_sym.model.mechanism.mechanism import TIME, Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, Node, as_node, slot, symbol
from multibody_sym.scalars.rows import Tabulated
from multibody_sym.scalars.traversal import postorder

MP: Final = MPContext()
MP.dps = 50
ZERO_BELOW: Final = MP.mpf(10) ** -30
"""The part of the terms' sizes below which a result is rounding: 20 digits are left for what cancels."""
_CLOSED: Final = MP.mpf(10) ** -40
_STEPS: Final = 6
Number = Any
Matrix = list[list[Number]]


def _tabulated(function: Tabulated, order: int, a: Number) -> Number:
    x = symbol("x")
    return evaluated([function.piece(order, float(a), x)], {x: a})[0]


def _choose(condition: Number, a: Number, b: Number) -> Number:
    return a if condition else b


_OPERATIONS: Final[dict[str, Callable[..., Number]]] = {
    "neg": lambda a: -a, "add": lambda a, b: a + b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b,
    "pow": MP.power, "sin": MP.sin, "cos": MP.cos, "tan": MP.tan, "asin": MP.asin,
    "acos": MP.acos, "atan": MP.atan, "atan2": MP.atan2, "sinh": MP.sinh, "cosh": MP.cosh, "tanh": MP.tanh,
    "exp": MP.exp, "log": MP.log, "sqrt": MP.sqrt, "abs": abs, "sign": MP.sign, "min": min, "max": max,
    "less": lambda a, b: MP.mpf(a < b), "less_equal": lambda a, b: MP.mpf(a <= b), "where": _choose,
    "table": _tabulated,
}  # fmt: skip


def evaluated(nodes: Iterable[Node], leaf: Mapping[Node, Number]) -> list[Number]:
    """Return expressions in 50 digits, given their leaves. Raises what `UNDEFINED` names where one has no value."""
    roots = list(nodes)
    values: dict[Node, Number] = {}
    for n in postorder(roots):
        if n.args:
            values[n] = _real(_OPERATIONS[n.op](*n.own, *(values[a] for a in n.args)))
        elif n.op == "number":
            values[n] = MP.mpf(n.data.numerator) / n.data.denominator
        else:
            values[n] = +MP.pi if n is PI else MP.mpf(n.data) if n.op == "real" else leaf[n]
    return [values[n] for n in roots]


def _real(value: Number) -> Number:
    if isinstance(value, MP.mpc) or not MP.isfinite(value):
        raise UndefinedValueError("no real value")
    return value


@dataclass(frozen=True)
class Precise:
    """A mechanism's equations as expressions, to be evaluated in 50 digits; `parameters` (np) as the start has them."""

    mechanism: Mechanism
    parameters: Sequence[float]

    @cached_property
    def _known(self) -> dict[Node, Number]:
        """The values of the parameters: of their expressions where they have one, so that 1/3 is a third."""
        known: dict[Node, Number] = {}
        for k, (entry, value) in enumerate(zip(self.mechanism.parameters, self.parameters, strict=True)):
            found = MP.mpf(value)
            if entry.value is not None and all(leaf in known for leaf in postorder([entry.value]) if _named(leaf)):
                precise = evaluated([entry.value], known)[0]
                if abs(precise - found) <= 1e-12 * abs(found):
                    found = precise
            known[slot("parameters", k)] = found
        return known

    @cached_property
    def _equations(self) -> Any:
        return composite_body(self.mechanism, slot_state(self.mechanism))

    def at(self, state: State) -> dict[Node, Number]:
        """Return the slots at a state nearby that satisfies the constraints, the accelerations `udot` among them.

        Raises UndefinedValueError where that is not found, and what `evaluated` raises.
        """
        leaf = dict(self._known)
        leaf[TIME] = MP.mpf(state.slots[TIME])
        leaf.update((slot("q", k), MP.mpf(x)) for k, x in enumerate(state.q))
        leaf.update((slot("u", k), MP.mpf(x)) for k, x in enumerate(state.u))
        self._close(leaf)
        self._add_inputs(leaf)
        leaf.update((slot("udot", k), x) for k, x in enumerate(self._accelerations(leaf)))
        return leaf

    def _add_inputs(self, leaf: dict[Node, Number]) -> None:
        inputs = evaluated(self.mechanism.inputs.values(), leaf)
        leaf.update((slot("inputs", k), x) for k, x in enumerate(inputs))

    def _close(self, leaf: dict[Node, Number]) -> None:
        """Move coordinates, then speeds, by least steps until constraints hold."""
        self._normalize(leaf)
        if not self.mechanism.rows:
            return
        rows = [row for row, declared in zip(self._equations.rows, self.mechanism.rows, strict=True) if row.kinematic]
        closing = [row for row in rows if row.holonomic]
        for _ in range(_STEPS):
            self._add_inputs(leaf)
            phi = evaluated([as_node(row.phi) for row in closing], leaf)
            if all(abs(x) < _CLOSED for x in phi):
                break
            self._move(leaf, _least(self._matrix(closing, leaf), [-x for x in phi]))
        else:
            raise UndefinedValueError("the constraints are not closed")
        psi = evaluated([as_node(row.phidot) for row in rows], leaf)
        for k, change in enumerate(_least(self._matrix(rows, leaf), [-x for x in psi])):
            leaf[slot("u", k)] += change
        self._add_inputs(leaf)
        if any(abs(x) > _CLOSED for x in evaluated([as_node(row.phidot) for row in rows], leaf)):
            raise UndefinedValueError("the constraints are not kept")

    def _move(self, leaf: dict[Node, Number], change: Sequence[Number]) -> None:
        """Move the coordinates as speeds (nu) would in a unit of time."""
        state = slot_state(self.mechanism)
        rates = coordinate_rates(self.mechanism, state.q, state.u)
        there = {**leaf, **{slot("u", k): x for k, x in enumerate(change)}}
        for k, rate in enumerate(evaluated(map(as_node, rates), there)):
            leaf[slot("q", k)] += rate
        self._normalize(leaf)

    def _normalize(self, leaf: dict[Node, Number]) -> None:
        for places in (places for body in self.mechanism.bodies for places in body.quaternions):
            length = MP.sqrt(sum(leaf[slot("q", k)] ** 2 for k in places))
            for k in places:
                leaf[slot("q", k)] /= length

    def _matrix(self, rows: Sequence[Any], leaf: Mapping[Node, Number]) -> Matrix:
        flat = evaluated([as_node(x) for row in rows for x in row.jacobian], leaf)
        n = len(self.mechanism.speeds)
        return [flat[n * k : n * k + n] for k in range(len(rows))]

    def _accelerations(self, leaf: Mapping[Node, Number]) -> list[Number]:
        """Return udot of M udot - C^T lambda = f, H udot + D lambda = gamma."""
        found, n = self._equations, len(self.mechanism.speeds)
        s = len(found.rows)
        if any(row.beside for row in found.rows):
            raise UndefinedValueError("friction has a direction that is not linear in the forces")
        coupling = [[row.coupling.get(k, 0) for k in range(s)] for row in found.rows]
        matrix = [[*found.mass_matrix[i], *(-row.forces[i] for row in found.rows)] for i in range(n)]
        matrix += [[*row.jacobian, *coupling[k]] for k, row in enumerate(found.rows)]
        right = [*found.forcing, *(row.gamma for row in found.rows)]
        flat = evaluated([as_node(x) for row in (*matrix, right) for x in row], leaf)
        size = n + s
        rows = [flat[size * k : size * k + size] for k in range(size)]
        udot = solved(rows, flat[size * size :])[:n]
        return [MP.mpf(0) if k in self.mechanism.held else x for k, x in enumerate(udot)]


def _named(leaf: Node) -> bool:
    return leaf.op == "slot"


def _least(matrix: Matrix, right: Sequence[Number]) -> list[Number]:
    """Return the x of least norm with A x = r, for dependent rows too that agree."""
    count = len(matrix[0]) if matrix else 0
    products = [[MP.fdot(a, b) for b in matrix] for a in matrix]
    y = solved(products, right)
    return [MP.fdot(y, [row[k] for row in matrix]) for k in range(count)]


def solved(matrix: Matrix, right: Sequence[Number]) -> list[Number]:
    """Return a solution of A x = r, zero in what dependent columns leave open.

    Raises UndefinedValueError where there is none.
    """
    rows = [[*row, r] for row, r in zip(matrix, right, strict=True)]
    for row in rows:
        size = max(map(abs, row[:-1]), default=MP.mpf(0))
        row[:] = [x / size for x in row] if size else row
    pivots: list[tuple[int, int]] = []
    left = list(range(len(rows)))
    columns = list(range(len(right)))
    while left:
        size, i, j = max(((abs(rows[i][j]), i, j) for i in left for j in columns), default=(MP.mpf(0), 0, 0))
        if size < ZERO_BELOW:
            break
        left.remove(i)
        columns.remove(j)
        pivots.append((i, j))
        for k in left:
            factor = rows[k][j] / rows[i][j]
            rows[k] = [a - factor * b for a, b in zip(rows[k], rows[i], strict=True)]
    largest = max((abs(row[-1]) for row in rows), default=MP.mpf(0))
    if any(abs(rows[k][-1]) > ZERO_BELOW * (1 + largest) for k in left):
        raise UndefinedValueError("the equations contradict each other")
    x = [MP.mpf(0)] * len(right)
    for i, j in reversed(pivots):
        x[j] = (rows[i][-1] - MP.fdot(rows[i][:-1], x)) / rows[i][j]
    return x
