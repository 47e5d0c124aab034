"""Derivatives of a Program as a Program, forward: rates are pushed through every statement.

A solve is differentiated with the set of its kept rows held fixed. With full row rank that is the derivative of the
minimum-norm solution; where rows are dependent it is the derivative of what is computed as long as the same rows are
kept. The report of a solve counts as constant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from multibody_sym.program.measures import operation_count
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array, Assign, Call, Callee, Kernel, Loop, Output, Scan, Solve, Statement
from multibody_sym.program.sweeps import (
    Layout,
    Vector,
    dot,
    known,
    put,
    resumed,
    taken,
    unused,
)
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.derivatives import partials
from multibody_sym.scalars.elementary import where
from multibody_sym.scalars.node import ONE, ZERO, Node, add, subtract

_LARGEST_INLINE: Final = 10_000
"""Operations times columns up to which a Jacobian is written out: it is quick then, and compiles in a few seconds."""


def jacobian(program: Program, output: str, input: str) -> Program:
    """Return the Program of d output / d input, forward; it has the inputs of `program` and one output, `jacobian`.

    Its shape is that of the output followed by that of the input.
    Raises UndefinedError where there is no such output or input.
    """
    wanted, given = program.output(output), program.input(input)
    sweep = _Forward(resumed(program, f"{program.name}_{output}_by_{input}", ()))
    columns = [sweep.rates(program, {leaf: ONE}, wanted.values) for leaf in given.slots]
    values = [column[row] for row in range(len(wanted.values)) for column in columns]
    return sweep.trace.finish({"jacobian": ((*wanted.shape, *given.shape), values)})


def total_jacobian(
    program: Program, outputs: Sequence[str], inputs: Sequence[str], given: Program, *, name: str = "jacobian"
) -> Program:
    """Return the Program of d outputs / d inputs, each of both in one row after the other, in its output `jacobian`.

    The only output of `given` is the input of `program` of the same name and counts as a function of the inputs that
    both have. Raises UndefinedError where there is no such output or input.
    """
    sweep = _Forward(resumed(program, name, ()))
    ways = list(_directions(sweep.trace, program, inputs, given))
    size = sum(len(program.output(name).values) for name in outputs)
    column = _inline if len(ways) * operation_count(program).total <= _LARGEST_INLINE else _called
    columns = [column(sweep, program, outputs, way) for way in ways]
    values = [column[row] for row in range(size) for column in columns]
    return sweep.trace.finish({"jacobian": ((size, len(columns)), values)})


_Direction = Mapping[str, Vector]
"""The rates of some inputs of a Program, by their names."""


def _directions(trace: Trace, program: Program, inputs: Sequence[str], given: Program) -> Iterator[_Direction]:
    """Yield for each element of `inputs` the direction in which it alone moves, and what is `given` with it."""
    (inner,) = given.outputs
    arguments = [program.input(array.name).slots for array in given.inputs]
    still = {name: (ZERO,) * program.input(name).size for name in (*inputs, inner.name)}
    for name in inputs:
        size = program.input(name).size
        rates: Vector = ()
        if inner.values:
            (rates,) = trace.call(jacobian(given, inner.name, name), arguments)
        for k in range(size):
            unit = tuple(ONE if i == k else ZERO for i in range(size))
            yield {**still, name: unit, inner.name: tuple(rates[k::size]) if inner.values else ()}


def _inline(sweep: _Forward, program: Program, outputs: Sequence[str], way: _Direction) -> Vector:
    """Return the rates of `outputs` along a direction, written out."""
    seeds: dict[Node, Node] = {}
    for name, part in way.items():
        put(seeds, program.input(name).slots, part)
    return sweep.rates(program, seeds, [value for name in outputs for value in program.output(name).values])


def _called(sweep: _Forward, program: Program, outputs: Sequence[str], way: _Direction) -> Vector:
    """Return the rates of `outputs` along a direction by a call of a Program that is the same for all directions."""
    callee = sweep.tangent(program, tuple(bool(way.get(array.name)) for array in program.inputs))
    arguments = [array.slots for array in program.inputs]
    moving = [way[array.name] for array in program.inputs if way.get(array.name)]
    found = sweep.trace.call(callee, [*arguments, *moving])
    parts = [values for values, output in zip(found, callee.outputs, strict=True) if output.name in outputs]
    return tuple(rate for part in parts for rate in part)


class _Forward:
    """Pushes rates through a Program, statement by statement; what it needs is added to `trace`."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.callees: dict[tuple[int, tuple[bool, ...]], Program] = {}
        self.paired: dict[tuple[int, tuple[bool, ...]], Program] = {}

    def rates(self, program: Callee, seeds: Mapping[Node, Node], wanted: Sequence[Node]) -> Vector:
        """Return the derivatives of `wanted` along the direction `seeds` (leaf -> its rate)."""
        rates = dict(seeds)
        for statement in program.statements:
            _RATES[type(statement)](statement, rates, self)
        return taken(rates, wanted)

    def assign(self, statement: Assign, rates: dict[Node, Node]) -> None:
        for node in statement.nodes:
            if any(a in rates for a in node.args):
                put(rates, (node,), (_rate(node, rates),))

    def call(self, statement: Call, rates: dict[Node, Node]) -> None:
        given = [taken(rates, atoms) for atoms in statement.arguments]
        active = tuple(any(rate is not ZERO for rate in part) for part in given)
        if not any(active):
            return
        callee = self.tangent(statement.program, active)
        arguments = (*statement.arguments, *(part for part, moves in zip(given, active, strict=True) if moves))
        found = self.trace.call(callee, arguments)
        for leaves, values, output in zip(statement.targets, found, callee.outputs, strict=True):
            put(rates, leaves, [known(v, inner) for v, inner in zip(values, output.values, strict=True)])

    def tangent(self, program: Callee, active: tuple[bool, ...]) -> Program:
        """Return the Program of the rates of all outputs, given those of the active inputs."""
        if (id(program), active) not in self.callees:
            names = [array.name for array in program.inputs]
            moving = [array for array, moves in zip(program.inputs, active, strict=True) if moves]
            rates = [Array(unused(array.name, "_rate", names), array.shape) for array in moving]
            sweep = _Forward(resumed(program, f"{program.name}_rate", rates))
            sweep.callees = self.callees
            pairs = zip(moving, rates, strict=True)
            seeds = {leaf: rate for x, dx in pairs for leaf, rate in zip(x.slots, dx.slots, strict=True)}
            found = {o.name: (o.shape, sweep.rates(program, seeds, o.values)) for o in program.outputs}
            self.callees[id(program), active] = sweep.trace.finish(found)
        return self.callees[id(program), active]

    def solve(self, statement: Solve, rates: dict[Node, Node]) -> None:
        """With p = dA^T lambda: A y = dr - dA x - A p gives dx = p + y, and the multipliers of y are dlambda."""
        if statement.exerted:
            raise TypeError("a solve in which rows exert other forces than their own has no derivative here")
        matrix = statement.matrix.lists(len(statement.solution))
        matrix_rates = [taken(rates, row) for row in matrix]
        right_rates = taken(rates, statement.right)
        if all(rate is ZERO for part in (*matrix_rates, right_rates) for rate in part):
            return
        turned = [dot(column, statement.multipliers) for column in _transposed(matrix_rates, len(statement.solution))]
        rest = [
            subtract(subtract(r, dot(dA, statement.solution)), dot(A, turned))
            for r, dA, A in zip(right_rates, matrix_rates, matrix, strict=True)
        ]
        found = self.trace.solve(statement.matrix, rest, len(statement.solution), statement.most, statement.acting)
        put(rates, statement.solution, list(map(add, turned, found.solution)))
        put(rates, statement.multipliers, found.multipliers)

    def scan(self, statement: Scan, rates: dict[Node, Node]) -> None:
        """Run the kernels with their rates; every array that moves has a second one for its rates."""
        given = [taken(rates, atoms) for atoms in statement.given]
        moving = _moving(statement, [any(rate is not ZERO for rate in part) for part in given])
        first, last = len(statement.given), len(statement.given) + len(statement.targets)
        moved = [
            [number for number in range(*bounds) if moving[number]]
            for bounds in ((0, first), (first, last), (last, len(moving)))
        ]
        if not moved[1]:
            return
        layout = Layout.of(statement, *moved)
        found = self.trace.scan(
            [*statement.given, *(given[number] for number in moved[0])],
            [statement.sizes[number] for number in (*range(first, last), *moved[1])],
            [statement.sizes[number] for number in (*range(last, len(moving)), *moved[2])],
            [self._moving_loop(loop, layout) for loop in statement.loops],
        )
        for number, values in zip(moved[1], found[len(statement.targets) :], strict=True):
            put(rates, statement.targets[number - first], values)

    def _moving_loop(self, loop: Loop, layout: Layout) -> Loop:
        kernels = tuple(self._moving_kernel(kernel, layout) for kernel in loop.kernels)
        return replace(layout.behind_gate(loop), kernels=kernels)

    def _moving_kernel(self, kernel: Kernel, layout: Layout) -> Kernel:
        active = tuple(window.array in layout.second for window in kernel.reads)
        reads = [*map(layout.kept, kernel.reads), *(layout.other(w) for w in kernel.reads if w.array in layout.second)]
        if not any(active):
            return replace(kernel, reads=tuple(reads), writes=tuple(map(layout.kept, kernel.writes)))
        writes = [*map(layout.kept, kernel.writes), *map(layout.other, kernel.writes)]
        return Kernel(self._paired(kernel.program, active), tuple(reads), tuple(writes))

    def _paired(self, program: Callee, active: tuple[bool, ...]) -> Program:
        """Return the Program of all outputs and then their rates."""
        if (id(program), active) not in self.paired:
            tangent = self.tangent(program, active)
            trace = Trace(f"{program.name}_and_rate", tangent.inputs)
            values = trace.call(program, [trace[array.name] for array in program.inputs])
            rates = trace.call(tangent, [trace[array.name] for array in tangent.inputs])
            names = [output.name for output in program.outputs]
            outputs = dict(zip(names, _shaped(program.outputs, values), strict=True))
            further = [unused(name, "_rate", names) for name in names]
            outputs |= dict(zip(further, _shaped(program.outputs, rates), strict=True))
            self.paired[id(program), active] = trace.finish(outputs)
        return self.paired[id(program), active]


def _rate(node: Node, rates: Mapping[Node, Node]) -> Node:
    if node.op == "where":
        return where(node.args[0], *taken(rates, node.args[1:]))
    return dot(partials(node), taken(rates, node.args))


_RATES: Final[dict[type[Statement], Callable[[Any, dict[Node, Node], _Forward], None]]] = {
    Assign: lambda statement, rates, sweep: sweep.assign(statement, rates),
    Call: lambda statement, rates, sweep: sweep.call(statement, rates),
    Solve: lambda statement, rates, sweep: sweep.solve(statement, rates),
    Scan: lambda statement, rates, sweep: sweep.scan(statement, rates),
}


def _moving(scan: Scan, given: Sequence[bool]) -> list[bool]:
    """Return which arrays have rates, where those `given` have."""
    moving = [*given, *[False] * (len(scan.sizes) - len(given))]
    before: list[bool] = []
    while before != moving:
        before = moving.copy()
        for loop in scan.loops:
            for kernel in loop.kernels:
                if any(moving[window.array] for window in kernel.reads):
                    for window in kernel.writes:
                        moving[window.array] = True
    return moving


def _shaped(outputs: Iterable[Output], values: Iterable[Vector]) -> list[tuple[tuple[int, ...], Vector]]:
    return [(output.shape, part) for output, part in zip(outputs, values, strict=True)]


def _transposed(rows: Sequence[Vector], columns: int) -> list[Vector]:
    return [tuple(row[k] for row in rows) for k in range(columns)]
