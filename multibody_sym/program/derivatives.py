"""Exact derivatives of Programs as Programs: forward (jacobian) and reverse (gradient), through calls and solves.

A solve is differentiated with the set of its kept rows held fixed. With full row rank that is the derivative of the
minimum-norm solution; where rows are dependent it is the derivative of what is computed as long as the same rows are
kept. The report of a solve counts as constant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final

from multibody_sym.program.program import Array, Assign, Call, Output, Program, ShapeError, Solve, Statement
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.derivatives import partials
from multibody_sym.scalars.node import ONE, ZERO, Node, add, multiply, subtract, where

Vector = tuple[Node, ...]


def jacobian(program: Program, output: str, input: str) -> Program:
    """Return the Program of d output / d input, forward; it has the inputs of `program` and one output, `jacobian`.

    Its shape is that of the output followed by that of the input.
    Raises UndefinedError where there is no such output or input.
    """
    wanted, given = program.output(output), program.input(input)
    sweep = _Forward(_resumed(program, f"{program.name}_{output}_by_{input}", ()))
    columns = [sweep.rates(program, {leaf: ONE}, wanted.values) for leaf in given.slots]
    values = [column[row] for row in range(len(wanted.values)) for column in columns]
    return sweep.trace.finish({"jacobian": ((*wanted.shape, *given.shape), values)})


def gradient(program: Program, output: str, input: str) -> Program:
    """Return the Program of d output / d input for an output of one element, in one backward pass.

    It has the inputs of `program` and one output, `gradient`, of the shape of the input.
    Raises UndefinedError where there is no such output or input, and ShapeError for an output of more elements.
    """
    wanted, given = program.output(output), program.input(input)
    if len(wanted.values) != 1:
        raise ShapeError(f"a gradient is of one number; output {output} has the shape {wanted.shape}")
    sweep = _Reverse(_resumed(program, f"{program.name}_{output}_gradient_{input}", ()))
    weights = sweep.weights(program, [(wanted.values[0], ONE)])
    return sweep.trace.finish({"gradient": (given.shape, [weights.get(leaf, ZERO) for leaf in given.slots])})


def _resumed(program: Program, name: str, further: Iterable[Array]) -> Trace:
    """Return a Trace in which the calls and solves of `program` are done already."""
    trace = Trace(name, (*program.inputs, *further))
    for statement in program.statements:
        if not isinstance(statement, Assign):
            trace.adopt(statement)
    return trace


def _unused(name: str, suffix: str, taken: Iterable[str]) -> str:
    used = set(taken)
    name += suffix
    while name in used:
        name += suffix
    return name


# --- forward ------------------------------------------------------------------------------------------------------


class _Forward:
    """Pushes rates through a Program, statement by statement; what it needs is added to `trace`."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.callees: dict[tuple[int, tuple[bool, ...]], Program] = {}

    def rates(self, program: Program, seeds: Mapping[Node, Node], wanted: Sequence[Node]) -> Vector:
        """Return the derivatives of `wanted` along the direction `seeds` (leaf -> its rate)."""
        rates = dict(seeds)
        for statement in program.statements:
            _RATES[type(statement)](statement, rates, self)
        return _taken(rates, wanted)

    def assign(self, statement: Assign, rates: dict[Node, Node]) -> None:
        for node in statement.nodes:
            if any(a in rates for a in node.args):
                _put(rates, (node,), (_rate(node, rates),))

    def call(self, statement: Call, rates: dict[Node, Node]) -> None:
        given = [_taken(rates, atoms) for atoms in statement.arguments]
        active = tuple(any(rate is not ZERO for rate in part) for part in given)
        if not any(active):
            return
        callee = self._tangent(statement.program, active)
        arguments = (*statement.arguments, *(part for part, moves in zip(given, active, strict=True) if moves))
        found = self.trace.call(callee, arguments)
        for leaves, values, output in zip(statement.targets, found, callee.outputs, strict=True):
            _put(rates, leaves, [_known(v, inner) for v, inner in zip(values, output.values, strict=True)])

    def _tangent(self, program: Program, active: tuple[bool, ...]) -> Program:
        """Return the Program of the rates of all outputs, given those of the active inputs."""
        if (id(program), active) not in self.callees:
            names = [array.name for array in program.inputs]
            moving = [array for array, moves in zip(program.inputs, active, strict=True) if moves]
            rates = [Array(_unused(array.name, "_rate", names), array.shape) for array in moving]
            sweep = _Forward(_resumed(program, f"{program.name}_rate", rates))
            sweep.callees = self.callees
            pairs = zip(moving, rates, strict=True)
            seeds = {leaf: rate for x, dx in pairs for leaf, rate in zip(x.slots, dx.slots, strict=True)}
            found = {o.name: (o.shape, sweep.rates(program, seeds, o.values)) for o in program.outputs}
            self.callees[id(program), active] = sweep.trace.finish(found)
        return self.callees[id(program), active]

    def solve(self, statement: Solve, rates: dict[Node, Node]) -> None:
        """With p = dA^T lambda: A y = dr - dA x - A p gives dx = p + y, and the multipliers of y are dlambda."""
        matrix_rates = [_taken(rates, row) for row in statement.matrix]
        right_rates = _taken(rates, statement.right)
        if all(rate is ZERO for part in (*matrix_rates, right_rates) for rate in part):
            return
        turned = [_dot(column, statement.multipliers) for column in _transposed(matrix_rates, len(statement.solution))]
        rest = [
            subtract(subtract(r, _dot(dA, statement.solution)), _dot(A, turned))
            for r, dA, A in zip(right_rates, matrix_rates, statement.matrix, strict=True)
        ]
        found = self.trace.solve(statement.matrix, rest, columns=len(statement.solution))
        _put(rates, statement.solution, list(map(add, turned, found.solution)))
        _put(rates, statement.multipliers, found.multipliers)


def _rate(node: Node, rates: Mapping[Node, Node]) -> Node:
    if node.op == "where":
        return where(node.args[0], *_taken(rates, node.args[1:]))
    return _dot(partials(node), _taken(rates, node.args))


def _known(value: Node, inner: Node) -> Node:
    """Return what a callee returns; a constant needs no call."""
    return value if inner.shadow is None else inner


_RATES: Final[dict[type[Statement], Callable[[Any, dict[Node, Node], _Forward], None]]] = {
    Assign: lambda statement, rates, sweep: sweep.assign(statement, rates),
    Call: lambda statement, rates, sweep: sweep.call(statement, rates),
    Solve: lambda statement, rates, sweep: sweep.solve(statement, rates),
}


# --- reverse ------------------------------------------------------------------------------------------------------


class _Reverse:
    """Pulls weights back through a Program, last statement first; what it needs is added to `trace`."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.callees: dict[tuple[int, tuple[bool, ...]], Program] = {}

    def weights(self, program: Program, seeds: Iterable[tuple[Node, Node]]) -> dict[Node, Node]:
        """Return, for each leaf, the sum over `seeds` (node, weight) of weight times d node / d leaf."""
        weights: dict[Node, Node] = {}
        for node, weight in seeds:
            _gather(weights, node, weight)
        for statement in reversed(program.statements):
            _WEIGHTS[type(statement)](statement, weights, self)
        return weights

    def assign(self, statement: Assign, weights: dict[Node, Node]) -> None:
        for node in reversed(statement.nodes):
            weight = weights.pop(node, ZERO)
            if weight is ZERO:
                continue
            if node.op == "where":
                _gather(weights, node.args[1], where(node.args[0], weight, ZERO))
                _gather(weights, node.args[2], where(node.args[0], ZERO, weight))
                continue
            for a, partial in zip(node.args, partials(node), strict=True):
                _gather(weights, a, multiply(weight, partial))

    def call(self, statement: Call, weights: dict[Node, Node]) -> None:
        given = [_taken(weights, leaves) for leaves in statement.targets]
        active = tuple(any(weight is not ZERO for weight in part) for part in given)
        if not any(active):
            return
        callee = self._adjoint(statement.program, active)
        arguments = (*statement.arguments, *(part for part, counts in zip(given, active, strict=True) if counts))
        found = self.trace.call(callee, arguments)
        for atoms, values, output in zip(statement.arguments, found, callee.outputs, strict=True):
            for atom, value, inner in zip(atoms, values, output.values, strict=True):
                _gather(weights, atom, _known(value, inner))

    def _adjoint(self, program: Program, active: tuple[bool, ...]) -> Program:
        """Return the Program of the weights of all inputs, given those of the active outputs."""
        if (id(program), active) not in self.callees:
            names = [array.name for array in program.inputs]
            counting = [output for output, counts in zip(program.outputs, active, strict=True) if counts]
            arrays = [Array(_unused(o.name, "_weight", names), o.shape) for o in counting]
            sweep = _Reverse(_resumed(program, f"{program.name}_weight", arrays))
            sweep.callees = self.callees
            found = sweep.weights(program, _seeds(counting, arrays))
            outputs = {x.name: (x.shape, [found.get(leaf, ZERO) for leaf in x.slots]) for x in program.inputs}
            self.callees[id(program), active] = sweep.trace.finish(outputs)
        return self.callees[id(program), active]

    def solve(self, statement: Solve, weights: dict[Node, Node]) -> None:
        """With A A^T mu = A wx + wlambda: wr = mu, wA = lambda (wx - A^T mu)^T - mu x^T."""
        x, multipliers = statement.solution, statement.multipliers
        x_weights, multiplier_weights = _taken(weights, x), _taken(weights, multipliers)
        if all(weight is ZERO for weight in (*x_weights, *multiplier_weights)):
            return
        right = [add(_dot(row, x_weights), w) for row, w in zip(statement.matrix, multiplier_weights, strict=True)]
        found = self.trace.solve(statement.matrix, right, columns=len(x))
        rest = list(map(subtract, x_weights, found.solution))
        for k, row in enumerate(statement.matrix):
            mu = found.multipliers[k]
            _gather(weights, statement.right[k], mu)
            for j, atom in enumerate(row):
                _gather(weights, atom, subtract(multiply(multipliers[k], rest[j]), multiply(mu, x[j])))


def _seeds(outputs: Iterable[Output], arrays: Iterable[Array]) -> list[tuple[Node, Node]]:
    pairs = zip(outputs, arrays, strict=True)
    return [pair for output, array in pairs for pair in zip(output.values, array.slots, strict=True)]


def _gather(weights: dict[Node, Node], node: Node, weight: Node) -> None:
    if weight is not ZERO and node.shadow is None:
        weights[node] = add(weights.get(node, ZERO), weight)


_WEIGHTS: Final[dict[type[Statement], Callable[[Any, dict[Node, Node], _Reverse], None]]] = {
    Assign: lambda statement, weights, sweep: sweep.assign(statement, weights),
    Call: lambda statement, weights, sweep: sweep.call(statement, weights),
    Solve: lambda statement, weights, sweep: sweep.solve(statement, weights),
}


# --- vectors of Nodes ---------------------------------------------------------------------------------------------


def _put(rates: dict[Node, Node], nodes: Sequence[Node], values: Sequence[Node]) -> None:
    rates.update((n, value) for n, value in zip(nodes, values, strict=True) if value is not ZERO)


def _taken(rates: Mapping[Node, Node], nodes: Iterable[Node]) -> Vector:
    return tuple(rates.get(node, ZERO) for node in nodes)


def _dot(a: Iterable[Node], b: Iterable[Node]) -> Node:
    total = ZERO
    for x, y in zip(a, b, strict=True):
        if x is not ZERO and y is not ZERO:
            total = add(total, multiply(x, y))
    return total


def _transposed(rows: Sequence[Vector], columns: int) -> list[Vector]:
    return [tuple(row[k] for row in rows) for k in range(columns)]
