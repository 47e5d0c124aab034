"""Programs over the scalars of other tools, such as CasADi's symbols and JAX's tracers.

`replay` performs the statements of a Program one by one, as `interpret` does with floats. Callees run in line, loops
are unrolled, and operations on floats alone stay floats. A solve takes the rows in their order, without a choice of
pivots: where a row depends on those before it, all results are nan.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import partial, reduce
from typing import Any

from multibody_sym.errors import ModelError
from multibody_sym.program.arithmetic import OPERATIONS, integer_exponent, power
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Assign, Call, Callee, Kernel, Loop, Scan, Solve, targets
from multibody_sym.records import dataclass
from multibody_sym.scalars.between import cubic, line
from multibody_sym.scalars.least_norm import PLAIN, row_spans
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.rank import CLEAR
from multibody_sym.scalars.tabulated import Tabulated

Operations = Mapping[str, Callable[..., Any]]
"""The functions of a tool by the operation of a Node; `less` and `less_equal` return what `where` takes."""


@dataclass(frozen=True)
class Argument:
    """An argument of a tool's function: the elements of a Program's `array` at these places; a scalar or a vector."""

    name: str
    array: str
    places: tuple[int, ...]
    scalar: bool = False


@dataclass(frozen=True)
class ToolFunction:
    """A Program as a function of another tool: its name, arguments, and the values of arrays where they are known.

    Other elements are zero.
    """

    name: str
    program: Program
    arguments: tuple[Argument, ...]
    known: Mapping[str, tuple[float, ...]]

    def replayed(self, values: Sequence[Sequence[Any]], operations: Operations) -> list[list[Any]]:
        """Return the elements of each output for the elements of each argument."""
        arrays = {x.name: list[Any](self.known.get(x.name, [0.0] * x.size)) for x in self.program.inputs}
        for argument, elements in zip(self.arguments, values, strict=True):
            for place, element in zip(argument.places, elements, strict=True):
                arrays[argument.array][place] = element
        return replay(self.program, list(arrays.values()), operations)


def replay(program: Callee, arrays: Sequence[Sequence[Any]], operations: Operations) -> list[list[Any]]:
    """Return the elements of each output for the elements of each input.

    Raises ModelError where a solve has more rows than can be independent, or rows that act by a condition.
    """
    values = _Values(operations)
    for declared, given in zip(program.inputs, arrays, strict=True):
        values.update(zip(declared.slots, given, strict=True))
    for statement in program.statements:
        if isinstance(statement, Assign):
            values.assign(statement)
        elif isinstance(statement, Call):
            values.define(statement, replay(statement.program, values.of(statement.arguments), operations))
        elif isinstance(statement, Solve):
            values.define(statement, _solve(statement, values))
        else:
            values.define(statement, _scan(statement, values))
    return values.of(output.values for output in program.outputs)


class _Values(dict[Node, Any]):
    """The value of every Node that has one by now; constants are floats."""

    def __init__(self, operations: Operations) -> None:
        super().__init__()
        self.operations = operations

    def __missing__(self, node: Node) -> float:
        if node.shadow is None:
            raise KeyError(node)
        return float(node.shadow)

    def of(self, parts: Any) -> list[list[Any]]:
        return [[self[atom] for atom in atoms] for atoms in parts]

    def define(self, statement: Call | Solve | Scan, results: Sequence[Sequence[Any]]) -> None:
        for leaves, found in zip(targets(statement), results, strict=True):
            self.update(zip(leaves, found, strict=True))

    def assign(self, statement: Assign) -> None:
        for node in statement.nodes:
            arguments = [self[a] for a in node.args]
            exponent = integer_exponent(node) if node.op == "pow" else None
            if exponent is not None:
                self[node] = power(arguments[0], exponent)
            elif node.op == "table":
                function, order = node.own
                self[node] = _tabulated(function, order, arguments[0], self.operations)
            else:
                self[node] = _operated(self.operations, node.op, *arguments)


def _operated(operations: Operations, op: str, *arguments: Any) -> Any:
    """Return the result of an operation, a float if it has only floats."""
    if all(type(x) is float for x in arguments):
        return OPERATIONS[op](*arguments)
    if op == "where" and type(arguments[0]) is float:
        return arguments[1] if arguments[0] else arguments[2]
    return operations[op](*arguments)


def _tabulated(function: Tabulated, order: int, at: Any, operations: Operations) -> Any:
    """Return a tabulated function, or a derivative, of one piece for each interval of its arguments."""
    x, count = function.columns[0], len(function.columns[0])

    def piece(k: int) -> Any:
        if function.kind == "knots":
            side = 1.0 if k % 2 else -1.0
            before, after = ((side * (at - x[k - 1]) if order == 0 else side) if k else None), None
            if k < count:
                after = side * (x[k] - at) if order == 0 else -side
            if before is None or after is None:
                return before if after is None else after
            nearer = _operated(operations, "less_equal", at - x[k - 1], x[k] - at)
            return _operated(operations, "where", nearer, before, after)
        y = function.columns[1]
        if not 0 < k < count:
            return 0.0 if order else y[-1 if k else 0]
        d, h = at - x[k - 1], x[k] - x[k - 1]
        if function.kind == "linear":
            return line(order, d, h, y[k - 1], y[k])
        m = function.columns[2]
        return cubic(order, d, h, y[k - 1], y[k], m[k - 1], m[k])

    found = piece(count)
    for k in reversed(range(count)):
        found = _operated(operations, "where", _operated(operations, "less", at, x[k]), piece(k), found)
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Scans, unrolled.


def _scan(statement: Scan, values: _Values) -> list[list[Any]]:
    memory = values.of(statement.given)
    results = range(len(memory), len(memory) + len(statement.targets))
    memory += [[0.0] * size for size in statement.sizes[len(memory) :]]
    for number in statement.unread:
        memory[results[number]] = [math.nan] * len(memory[results[number]])
    for loop in statement.loops:
        for k in range(loop.count):
            _turn(loop, k, memory, values.operations)
    return [memory[place] for place in results]


def _turn(loop: Loop, k: int, memory: list[list[Any]], operations: Operations) -> None:
    """Run iteration k of a loop; behind a gate that is no number each result is chosen by it."""
    gate: Any = 1.0 if loop.gate is None else memory[loop.gate.array][loop.gate.first.at(k)]
    if type(gate) is float and gate == 0.0:
        return
    kernel: Kernel = loop.kernels[loop.choice.at(k)]
    read = []
    for window, declared in zip(kernel.reads, kernel.program.inputs, strict=True):
        first = window.first.at(k)
        read.append(memory[window.array][first : first + declared.size])
    for window, found in zip(kernel.writes, replay(kernel.program, read, operations), strict=True):
        for place, x in enumerate(found, window.first.at(k)):
            old = memory[window.array][place]
            new = old + x if window.adds else x
            memory[window.array][place] = _operated(operations, "where", gate, new, old)


# ----------------------------------------------------------------------------------------------------------------------
# Solves of independent rows: Householder's reflections in the order of the rows, as in `scalars/least_norm.py`.


@dataclass
class _Reflections:
    """R^T of A^T = Q R row by row, and the vectors of the reflections."""

    operations: Operations
    heads: list[list[Any]] = field(default_factory=list)
    lows: list[int] = field(default_factory=list)
    inverse: list[Any] = field(default_factory=list)
    factors: list[Any] = field(default_factory=list)
    vectors: list[list[Any]] = field(default_factory=list)
    squares: list[Any] = field(default_factory=list)
    """The squares of the rows, and of what those before leave of each."""
    left: list[Any] = field(default_factory=list)

    def add(self, row: Sequence[Any], low: int, high: int) -> None:
        """Add the next row, whose elements from `low` to `high` are not zero when it is eliminated."""
        k, rest, head = len(self.lows), list(row[low:high]), list[Any]()
        square = _dot(rest, rest)
        for i in range(low, k):
            _subtract(_times(self.factors[i], _dot(self.vectors[i], rest)), self.vectors[i], rest)
            head.append(rest.pop(0))
        left, first = _dot(rest, rest), rest[0]
        length = _operated(self.operations, "sqrt", left)
        clear = _operated(self.operations, "less", CLEAR * CLEAR * square, left)
        length = _operated(self.operations, "where", clear, length, math.nan)
        side = _operated(self.operations, "where", _operated(self.operations, "less", first, 0.0), -1.0, 1.0)
        rest[0] = first + side * length
        self.inverse.append(-side / length)
        self.factors.append(1.0 / (length * (length + side * first)))
        self.vectors.append(rest)
        self.heads.append(head)
        self.lows.append(low)
        self.squares.append(square)
        self.left.append(left)

    def solution(self, right: Sequence[Any], columns: int) -> tuple[list[Any], list[Any]]:
        """Return x and the multipliers."""
        y = list[Any]()
        for low, head, value, inverse in zip(self.lows, self.heads, right, self.inverse, strict=True):
            y.append((value - _dot(head, y[low:])) * inverse)
        rest, x, multipliers = y.copy(), [0.0] * (columns - len(y)), list[Any]()
        for k in reversed(range(len(y))):
            multipliers.insert(0, rest[k] * self.inverse[k])
            low = self.lows[k]
            rest[low:k] = [a - multipliers[0] * b for a, b in zip(rest[low:k], self.heads[k], strict=True)]
            x.insert(0, y[k])
            _subtract(_times(self.factors[k], _dot(self.vectors[k], x)), self.vectors[k], x)
        return x, multipliers

    def report(self, squares: Sequence[Any]) -> list[Any]:
        """Return the rank, the smallest part that is left of a row of these squares, and no residual."""
        least = self._extreme("min", [1.0, *(left / square for left, square in zip(self.left, squares, strict=True))])
        return [float(len(self.left)), _operated(self.operations, "sqrt", least), 0.0]

    def whole_report(self) -> list[Any]:
        """Return the report in which a row much shorter than others counts as one that little is left of."""
        rank, part, residual = self.report(self.squares)
        if not self.squares:
            return [rank, 0.0, residual]
        ratio = self._extreme("min", self.squares) / self._extreme("max", self.squares)
        return [rank, self._extreme("min", [part, _operated(self.operations, "sqrt", ratio)]), residual]

    def _extreme(self, op: str, numbers: Sequence[Any]) -> Any:
        return reduce(partial(_operated, self.operations, op), numbers)


def _solve(statement: Solve, values: _Values) -> tuple[list[Any], list[Any], list[Any]]:
    """Return what `solve` of `scalars/least_norm.py` does, of independent rows."""
    width, count = len(statement.solution), len(statement.right)
    acting = [values[atom] for atom in statement.acting] or [1.0] * count
    if any(type(x) is not float for x in acting):
        raise ModelError("which constraints act depends on the state there: give the function a mode", number="M110")
    places = [j for j, acts in enumerate(acting) if acts]
    rows, right = values.of(statement.matrix.lists(width)), [values[atom] for atom in statement.right]
    rows = [[rows[j][k] for k in statement.order] for j in places]
    if len(places) > min(width, _most(values[statement.most])):
        raise ModelError(
            "constraints depend on each other: functions of other tools need independent ones; drop the redundant",
            number="M110",
        )
    own, exerted = [right[j] for j in places], list[list[Any]]()
    if statement.exerted and statement.exerted != statement.matrix:
        forces = values.of(statement.exerted.lists(width))
        exerted = [[forces[j][k] for k in statement.order] for j in places]
    if exerted:
        lengths = [1.0 if PLAIN in acting else _operated(values.operations, "sqrt", _dot(c, c)) for c in exerted]
        unit = [[x / length for x in row] for row, length in zip(exerted, lengths, strict=True)]
        found = _eliminated([[_dot(a, c) for c in unit] for a in rows], values.operations)
        carried, _ = found.solution(own, len(places))
        solution = [_dot(carried, column) for column in zip(*unit, strict=True)]
        carried = [value / length for value, length in zip(carried, lengths, strict=True)]
        report = found.report([_dot(row, row) for row in rows])
    else:
        found = _eliminated(rows, values.operations)
        solution, carried = found.solution(own, width)
        report = found.whole_report()
    multipliers: list[Any] = [0.0] * count
    for j, value in zip(places, carried, strict=True):
        multipliers[j] = value
    at = dict(zip(statement.order, solution, strict=True))
    return [at[k] for k in range(width)], multipliers, report


def _most(value: Any) -> float:
    return value if type(value) is float else math.inf


def _eliminated(rows: Sequence[Sequence[Any]], operations: Operations) -> _Reflections:
    found = _Reflections(operations)
    spans = row_spans([[not (type(x) is float and x == 0.0) for x in row] for row in rows])
    for row, (_, _, low, high) in zip(rows, spans, strict=True):
        found.add(row, low, high)
    return found


def _times(a: Any, b: Any) -> Any:
    return 0.0 if any(type(x) is float and x == 0.0 for x in (a, b)) else a * b


def _dot(first: Sequence[Any], second: Sequence[Any]) -> Any:
    """Return the product of as many numbers as the shorter one has, those that are zero left out."""
    total: Any = 0.0
    for a, b in zip(first, second, strict=False):
        product = _times(a, b)
        total = total + product if not (type(product) is float and product == 0.0) else total
    return total


def _subtract(amount: Any, vector: Sequence[Any], row: list[Any]) -> None:
    row[: len(vector)] = [a - _times(amount, b) for a, b in zip(row, vector, strict=False)]
