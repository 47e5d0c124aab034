"""Programs over the scalars of other tools: CasADi's symbols and JAX's tracers.

`replay` performs the statements of a Program one by one, as `interpret` does with floats. Callees run in line, loops
are unrolled, and operations on floats alone stay floats. A solve takes the rows in their order, without a choice of
pivots: where a row depends on those before it, all results are nan.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import partial, reduce
from itertools import product
from typing import Any, Final

from multibody_sym.errors import InputError, MissingPackageError, ModelError
from multibody_sym.program.program import OPERATIONS, Interpreter, Program, Values, integer_exponent
from multibody_sym.program.statements import Callee, Solve
from multibody_sym.program.target_layout import parameters
from multibody_sym.records import dataclass
from multibody_sym.scalars.floats import cubic, line
from multibody_sym.scalars.least_norm import PLAIN, row_spans
from multibody_sym.scalars.node import ZERO, Node
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
    return _Tool(operations).run(program, arrays)


class _Tool(Interpreter):
    """Runs Programs over the scalars of a tool."""

    def __init__(self, operations: Operations) -> None:
        self.operations = operations

    def operate(self, node: Node, arguments: Sequence[Any]) -> Any:
        if node.op == "table":
            function, order = node.own
            return _tabulated(function, order, arguments[0], self.operations)
        if node.op == "pow" and integer_exponent(node) is not None:
            return super().operate(node, arguments)
        return _operated(self.operations, node.op, *arguments)

    def choose(self, gate: Any, new: Any, old: Any) -> Any:
        return _operated(self.operations, "where", gate, new, old)

    def solve(self, statement: Solve, values: Values) -> list[list[Any]]:
        return _solve(statement, values, self.operations)


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


def _solve(statement: Solve, values: Values, operations: Operations) -> list[list[Any]]:
    """Return what `solve` of `scalars/least_norm.py` does, of independent rows."""
    width, count = len(statement.solution), len(statement.right)
    acting = [values[atom] for atom in statement.acting] or [1.0] * count
    if any(type(x) is not float for x in acting):
        raise ModelError("which constraints act depends on the state there: give the function a mode", number="M110")
    places = [j for j, acts in enumerate(acting) if acts]
    rows, right = values.of(statement.matrix.lists(width)), [values[atom] for atom in statement.right]
    rows = [[rows[j][k] for k in statement.order] for j in places]
    most = values[statement.most]
    if len(places) > min(width, most if type(most) is float else math.inf):
        raise ModelError(
            "constraints depend on each other: functions of other tools need independent ones; drop the redundant",
            number="M110",
        )
    own, exerted = [right[j] for j in places], list[list[Any]]()
    if statement.exerted and statement.exerted != statement.matrix:
        forces = values.of(statement.exerted.lists(width))
        exerted = [[forces[j][k] for k in statement.order] for j in places]
    if exerted:
        lengths = [1.0 if PLAIN in acting else _operated(operations, "sqrt", _dot(c, c)) for c in exerted]
        unit = [[x / length for x in row] for row, length in zip(exerted, lengths, strict=True)]
        found = _eliminated([[_dot(a, c) for c in unit] for a in rows], operations)
        carried, _ = found.solution(own, len(places))
        solution = [_dot(carried, column) for column in zip(*unit, strict=True)]
        carried = [value / length for value, length in zip(carried, lengths, strict=True)]
        report = found.report([_dot(row, row) for row in rows])
    else:
        found = _eliminated(rows, operations)
        solution, carried = found.solution(own, width)
        report = found.whole_report()
    multipliers: list[Any] = [0.0] * count
    for j, value in zip(places, carried, strict=True):
        multipliers[j] = value
    at = dict(zip(statement.order, solution, strict=True))
    return [[at[k] for k in range(width)], multipliers, report]


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


# ----------------------------------------------------------------------------------------------------------------------
# Functions of CasADi, which differentiates them, and of JAX, for `jit`, `vmap` and `grad` on its device.


_COMMON: Final = "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp log sqrt sign"


def _operations_of(tool: Any, own: Operations) -> Operations:
    """Return the functions of a tool by operation: its `own`, and those of the same name."""
    common = {op: getattr(tool, op) for op in _COMMON.split() if op not in own}
    return {"neg": operator.neg, "add": operator.add, "mul": operator.mul, "div": operator.truediv, **common, **own}


_RESERVED: Final = frozenset({"null", "jac", "hess"})


def casadi_function(function: ToolFunction) -> Any:
    """Return a `casadi.Function`: arguments as columns, results with their structural zeros left out.

    Raises InputError for a result of three axes, MissingPackageError without CasADi.
    """
    try:
        import casadi
    except ImportError:
        raise MissingPackageError("to_casadi needs CasADi: pip install 'multibody-sym[casadi]'") from None
    outputs = function.program.outputs
    for output in outputs:
        if len(output.shape) > 2:
            message = f"{output.name} has the shape {output.shape}, and CasADi has matrices only"
            raise InputError(f"{message}: differentiate in CasADi, by F.jacobian()")
    own: dict[str, Any] = {
        "pow": casadi.power, "abs": casadi.fabs, "min": casadi.fmin, "max": casadi.fmax, "where": casadi.if_else,
        "less": operator.lt, "less_equal": operator.le,
    }  # fmt: skip
    symbols = [casadi.SX.sym(each.name, len(each.places)) for each in function.arguments]
    found = function.replayed([symbol.elements() for symbol in symbols], _operations_of(casadi, own))
    results = []
    for output, values in zip(outputs, found, strict=True):
        rows, columns = (*output.shape, 1, 1)[:2]
        result = casadi.SX(rows, columns)
        for (i, j), node, value in zip(product(range(rows), range(columns)), output.values, values, strict=True):
            if node is not ZERO:
                result[i, j] = value
        results.append(result)
    taken = [each.name for each in function.arguments]
    _, named = parameters(function.program, _RESERVED | set(taken))
    return casadi.Function(function.name, symbols, results, taken, named)


def jax_function(function: ToolFunction, result: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of the arguments in their order; `result` makes a tuple of several arrays.

    Raises MissingPackageError without JAX; InputError unless JAX has 64 bits, in a call, too.
    """
    try:
        import jax
    except ImportError:
        raise MissingPackageError("to_jax needs JAX: pip install 'multibody-sym[jax]'") from None
    import jax.numpy as jnp

    own: dict[str, Any] = {
        "asin": jnp.arcsin, "acos": jnp.arccos, "atan": jnp.arctan, "atan2": jnp.arctan2, "pow": jnp.power,
        "asinh": jnp.arcsinh, "acosh": jnp.arccosh, "atanh": jnp.arctanh, "abs": jnp.abs,
        "min": jnp.minimum, "max": jnp.maximum,
        "less": lambda a, b: jnp.where(a < b, 1.0, 0.0), "less_equal": lambda a, b: jnp.where(a <= b, 1.0, 0.0),
        "where": lambda condition, a, b: jnp.where(condition != 0.0, a, b),
    }  # fmt: skip
    operations, arguments, outputs = _operations_of(jnp, own), function.arguments, function.program.outputs
    taken = ", ".join(each.name for each in arguments)
    _verify_bits(jax)

    def called(*given: Any) -> Any:
        _verify_bits(jax)
        if len(given) != len(arguments):
            raise InputError(f"{function.name} takes {len(arguments)} arguments ({taken}), not {len(given)}")
        values: list[list[Any]] = []
        for argument, array in zip(arguments, given, strict=True):
            known, shape = jnp.asarray(array, dtype=float), () if argument.scalar else (len(argument.places),)
            if known.shape != shape:
                message = f"{argument.name} has the shape {known.shape}, not {shape}"
                raise InputError(f"{message}: jax.vmap takes many states")
            values.append([known] if argument.scalar else [known[k] for k in range(len(argument.places))])
        found = function.replayed(values, operations)
        arrays = [
            jnp.stack([jnp.asarray(x, dtype=float) for x in elements]).reshape(output.shape)
            if elements
            else jnp.zeros(output.shape)
            for output, elements in zip(outputs, found, strict=True)
        ]
        return arrays[0] if len(arrays) == 1 else result(*arrays)

    called.__name__ = called.__qualname__ = function.name
    called.__doc__ = f"{function.name}({taken}) -> {', '.join(output.name for output in outputs)}"
    return called


def _verify_bits(jax: Any) -> None:
    if not jax.config.jax_enable_x64:
        raise InputError("JAX computes with 32 bits: jax.config.update('jax_enable_x64', True) before its first array")
