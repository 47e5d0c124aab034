"""Programs in which an input has become constants, folded into every expression; the input itself stays declared."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, assert_never

from multibody_sym.program.program import Program
from multibody_sym.program.progressions import Integers
from multibody_sym.program.statements import Assign, Call, Callee, Kernel, Loop, Scan, Solve
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, as_node

Vector = tuple[Node, ...]


def folded(program: Callee, input: str, values: Sequence[float | Node]) -> Program:
    """Return `program` with the numbers `values` in place of its input `input`, also in the Programs it calls.

    Raises UndefinedError where there is no such input, ExpressionError where a constant part has no finite value.
    """
    numbers = dict(zip(program.input(input).slots, map(as_node, values), strict=True))

    def constant(nodes: Sequence[Node]) -> Vector:
        changed: list[Any] = evaluate(nodes, lambda leaf: numbers.get(leaf, leaf))
        return tuple(changed)

    trace = Trace(program.name, program.inputs)
    for statement in program.statements:
        if isinstance(statement, Call):
            arguments = tuple(map(constant, statement.arguments))
            trace.adopt(Call(_callee(statement, input, numbers, values), arguments, statement.targets))
        elif isinstance(statement, Scan):
            trace.adopt(_scan(statement, constant))
        elif isinstance(statement, Solve):
            matrix, exerted = (rows.changed(constant) for rows in (statement.matrix, statement.exerted))
            right, (most,) = constant(statement.right), constant((statement.most,))
            acting = constant(statement.acting)
            trace.adopt(replace(statement, matrix=matrix, right=right, most=most, acting=acting, exerted=exerted))
        elif not isinstance(statement, Assign):
            assert_never(statement)
    return trace.finish({output.name: (output.shape, constant(output.values)) for output in program.outputs})


def _callee(call: Call, input: str, numbers: dict[Node, Node], values: Sequence[float | Node]) -> Callee:
    """Return what a call runs; it is folded too where it is handed that input as a whole, under the same name."""
    for array, arguments in zip(call.program.inputs, call.arguments, strict=True):
        if array.name == input and arguments == tuple(numbers):
            return folded(call.program, input, values)
    return call.program


def _scan(scan: Scan, constant: Callable[[Sequence[Node]], Vector]) -> Scan:
    given = tuple(map(constant, scan.given))
    return replace(scan, given=given, loops=tuple(_loop(loop, given) for loop in scan.loops))


def _loop(loop: Loop, given: Sequence[Vector]) -> Loop:
    return replace(loop, kernels=tuple(_kernel(kernel, turns, given) for kernel, turns in loop.turns()))


def _kernel(kernel: Kernel, iterations: Integers, given: Sequence[Vector]) -> Kernel:
    """Return a kernel in which the inputs that are the same constants in all iterations are folded."""
    program = kernel.program
    for window, array in zip(kernel.reads, program.inputs, strict=True):
        if window.array < len(given):
            read = {given[window.array][first:][: array.size] for first in map(window.first.at, iterations.tolist())}
            if len(read) == 1 and all(atom.shadow is not None for atom in next(iter(read))):
                program = folded(program, array.name, next(iter(read)))
    return replace(kernel, program=program)
