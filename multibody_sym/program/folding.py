"""Programs in which an input has become constants, folded into every expression; the input itself stays declared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from multibody_sym.program.program import Program
from multibody_sym.program.progressions import Integers
from multibody_sym.program.statements import Assign, Call, Callee, Kernel, Loop, Scan, with_operands
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
        if isinstance(statement, Assign):
            continue
        changed = with_operands(statement, constant)
        if isinstance(statement, Call) and isinstance(changed, Call):
            changed = replace(changed, program=_callee(statement, input, numbers, values))
        elif isinstance(changed, Scan):
            changed = replace(changed, loops=tuple(_loop(loop, changed.given) for loop in changed.loops))
        trace.adopt(changed)
    return trace.finish({output.name: (output.shape, constant(output.values)) for output in program.outputs})


def _callee(call: Call, input: str, numbers: dict[Node, Node], values: Sequence[float | Node]) -> Callee:
    """Return what a call runs; it is folded too where it is handed that input as a whole, under the same name."""
    for array, arguments in zip(call.program.inputs, call.arguments, strict=True):
        if array.name == input and arguments == tuple(numbers):
            return folded(call.program, input, values)
    return call.program


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
