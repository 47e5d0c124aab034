"""Exact derivatives of Programs as Programs: forward (jacobian) and reverse (gradient), through every statement.

A solve is differentiated with the set of its kept rows held fixed. With full row rank that is the derivative of the
minimum-norm solution; where rows are dependent it is the derivative of what is computed as long as the same rows are
kept. The report of a solve counts as constant.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, Final

from multibody_sym.program.program import Program
from multibody_sym.program.progressions import Progression, Window, reversed_progression
from multibody_sym.program.statements import (
    Array,
    Assign,
    Call,
    Callee,
    Kernel,
    Loop,
    Output,
    Scan,
    ShapeError,
    Solve,
    Statement,
)
from multibody_sym.program.sweeps import (
    Layout,
    dot,
    known,
    resumed,
    taken,
    unused,
)
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.derivatives import pulled_back
from multibody_sym.scalars.node import ONE, ZERO, Node, add, multiply, subtract


def gradient(program: Program, output: str, input: str) -> Program:
    """Return the Program of d output / d input for an output of one element, in one backward pass.

    It has the inputs of `program` and one output, `gradient`, of the shape of the input.
    Raises UndefinedError where there is no such output or input, and ShapeError for an output of more elements.
    """
    wanted, given = program.output(output), program.input(input)
    if len(wanted.values) != 1:
        raise ShapeError(f"a gradient is of one number; output {output} has the shape {wanted.shape}")
    sweep = _Reverse(resumed(program, f"{program.name}_{output}_gradient_{input}", ()))
    weights = sweep.weights(program, [(wanted.values[0], ONE)])
    return sweep.trace.finish({"gradient": (given.shape, [weights.get(leaf, ZERO) for leaf in given.slots])})


# --- forward ------------------------------------------------------------------------------------------------------


# --- reverse ------------------------------------------------------------------------------------------------------


class _Reverse:
    """Pulls weights back through a Program, last statement first; what it needs is added to `trace`."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        self.callees: dict[tuple[int, tuple[bool, ...]], Program] = {}

    def weights(self, program: Callee, seeds: Iterable[tuple[Node, Node]]) -> dict[Node, Node]:
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
            for a, pulled in zip(node.args, pulled_back(node, weight), strict=True):
                _gather(weights, a, pulled)

    def call(self, statement: Call, weights: dict[Node, Node]) -> None:
        given = [taken(weights, leaves) for leaves in statement.targets]
        active = tuple(any(weight is not ZERO for weight in part) for part in given)
        if not any(active):
            return
        callee = self._adjoint(statement.program, active)
        arguments = (*statement.arguments, *(part for part, counts in zip(given, active, strict=True) if counts))
        found = self.trace.call(callee, arguments)
        for atoms, values, output in zip(statement.arguments, found, callee.outputs, strict=True):
            for atom, value, inner in zip(atoms, values, output.values, strict=True):
                _gather(weights, atom, known(value, inner))

    def _adjoint(self, program: Callee, active: tuple[bool, ...]) -> Program:
        """Return the Program of the weights of all inputs, given those of the active outputs."""
        if (id(program), active) not in self.callees:
            names = [array.name for array in program.inputs]
            counting = [output for output, counts in zip(program.outputs, active, strict=True) if counts]
            arrays = [Array(unused(o.name, "_weight", names), o.shape) for o in counting]
            sweep = _Reverse(resumed(program, f"{program.name}_weight", arrays))
            sweep.callees = self.callees
            found = sweep.weights(program, _seeds(counting, arrays))
            outputs = {x.name: (x.shape, [found.get(leaf, ZERO) for leaf in x.slots]) for x in program.inputs}
            self.callees[id(program), active] = sweep.trace.finish(outputs)
        return self.callees[id(program), active]

    def solve(self, statement: Solve, weights: dict[Node, Node]) -> None:
        """With A A^T mu = A wx + wlambda: wr = mu, wA = lambda (wx - A^T mu)^T - mu x^T."""
        if statement.exerted:
            raise TypeError("a solve in which rows exert other forces than their own has no derivative here")
        x, multipliers = statement.solution, statement.multipliers
        x_weights, multiplier_weights = taken(weights, x), taken(weights, multipliers)
        if all(weight is ZERO for weight in (*x_weights, *multiplier_weights)):
            return
        rows = statement.matrix.lists(len(x))
        right = [add(dot(row, x_weights), w) for row, w in zip(rows, multiplier_weights, strict=True)]
        found = self.trace.solve(statement.matrix, right, len(x), statement.most, statement.acting)
        rest = list(map(subtract, x_weights, found.solution))
        for k, row in enumerate(statement.matrix):
            mu = found.multipliers[k]
            _gather(weights, statement.right[k], mu)
            for j, atom in row:
                _gather(weights, atom, subtract(multiply(multipliers[k], rest[j]), multiply(mu, x[j])))

    def scan(self, statement: Scan, weights: dict[Node, Node]) -> None:
        """Run the scan, then its kernels' adjoints over the same windows, last iteration first.

        Every array has a second one for its weights; those of the results begin with what is given.
        """
        seeds = [taken(weights, leaves) for leaves in statement.targets]
        if all(weight is ZERO for part in seeds for weight in part):
            return
        first, every = len(statement.given), range(len(statement.sizes))
        layout = Layout(
            {number: number + (number >= first) * (len(seeds) + first) for number in every},
            {number: first + len(seeds) + number + (number >= first) * len(every[first:]) for number in every},
        )
        found = self.trace.scan(
            [*statement.given, *seeds],
            statement.sizes[:first],
            [*statement.sizes[first:], *statement.sizes[first:]],
            [
                *(_moved_loop(loop, layout) for loop in statement.loops),
                *(_copied(len(seed), first + k, layout.second[first + k]) for k, seed in enumerate(seeds)),
                *(self._returned(loop, layout) for loop in reversed(statement.loops)),
            ],
        )
        for atoms, values in zip(statement.given, found, strict=True):
            for atom, value in zip(atoms, values, strict=True):
                _gather(weights, atom, value)

    def _returned(self, loop: Loop, layout: Layout) -> Loop:
        kernels = []
        for kernel in loop.kernels:
            program = self._adjoint(kernel.program, (True,) * len(kernel.writes))
            reads = [*map(layout.kept, kernel.reads), *map(layout.other, kernel.writes)]
            writes = [replace(layout.other(window), adds=True) for window in kernel.reads]
            kernels.append(Kernel(program, _backward(reads, loop.count), _backward(writes, loop.count)))
        gate = layout.behind_gate(loop).gate
        (gate,) = (None,) if gate is None else _backward([gate], loop.count)
        return Loop(loop.count, tuple(kernels), reversed_progression(loop.choice, loop.count), gate)


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
    Scan: lambda statement, weights, sweep: sweep.scan(statement, weights),
}


# --- arrays of scans ----------------------------------------------------------------------------------------------


def _moved_loop(loop: Loop, layout: Layout) -> Loop:
    kernels = [
        Kernel(k.program, tuple(map(layout.kept, k.reads)), tuple(map(layout.kept, k.writes))) for k in loop.kernels
    ]
    return replace(layout.behind_gate(loop), kernels=tuple(kernels))


def _backward(windows: Iterable[Window], count: int) -> tuple[Window, ...]:
    return tuple(replace(window, first=reversed_progression(window.first, count)) for window in windows)


def _copied(count: int, source: int, target: int) -> Loop:
    """Return the loop that adds the elements of one array to those of another."""
    trace = Trace("copy", [Array("x")])
    one_by_one = Progression((0,), 1)
    copy = trace.finish({"y": ((), trace["x"])})
    return Loop(count, (Kernel(copy, (Window(source, one_by_one),), (Window(target, one_by_one, adds=True),)),))


# --- vectors of Nodes ---------------------------------------------------------------------------------------------


