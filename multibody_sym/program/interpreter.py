"""The interpreter: runs a Program on numbers, statement by statement; every backend must agree with it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from multibody_sym.program.arithmetic import OPERATIONS, integer_exponent, power
from multibody_sym.program.statements import Assign, Call, Callee, Record, Scan, ShapeError, Solve, Statement, targets
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.least_norm import solve_lists, solve_some
from multibody_sym.scalars.node import Node


class _Values(dict[Node, float]):
    """The value of every Node that has one by now; constants know theirs."""

    def __missing__(self, node: Node) -> float:
        if node.shadow is None:
            raise KeyError(node)
        return node.shadow


def interpret(program: Callee, *arrays: npt.ArrayLike) -> tuple[Floats, ...]:
    """Return the outputs of `program` for `arrays`, one for each input; raises ShapeError where one does not fit."""
    if len(arrays) != len(program.inputs):
        raise ShapeError(f"program {program.name} has {len(program.inputs)} inputs, not {len(arrays)}")
    values = _Values()
    for array, given in zip(program.inputs, arrays, strict=True):
        numbers = np.asarray(given, dtype=float)
        if numbers.shape != array.shape:
            raise ShapeError(f"input {array.name} of {program.name} has the shape {array.shape}, not {numbers.shape}")
        values.update(zip(array.slots, numbers.ravel().tolist(), strict=True))
    for statement in program.statements:
        _run(statement, values)
    return tuple(np.array([values[v] for v in o.values], dtype=float).reshape(o.shape) for o in program.outputs)


def _run(statement: Statement, values: _Values) -> None:
    if isinstance(statement, Assign):
        for node in statement.nodes:
            exponent = integer_exponent(node) if node.op == "pow" else None
            if exponent is None:
                values[node] = OPERATIONS[node.op](*node.own, *[values[a] for a in node.args])
            else:
                values[node] = power(values[node.args[0]], exponent)
    elif isinstance(statement, Call):
        arguments = (
            np.array([values[atom] for atom in atoms], dtype=float).reshape(array.shape)
            for array, atoms in zip(statement.program.inputs, statement.arguments, strict=True)
        )
        _store(statement, interpret(statement.program, *arguments), values)
    elif isinstance(statement, Solve):
        _solve(statement, values)
    else:
        _scan(statement, values)


def _solve(statement: Solve, values: _Values) -> None:
    order, most = statement.order, values[statement.most]
    right, acting = ([values[atom] for atom in x] for x in (statement.right, statement.acting))
    if acting:
        matrix, exerted = (
            [{k: values[atom] for k, atom in row} for row in rows] for rows in (statement.matrix, statement.exerted)
        )
        found = solve_some(matrix, right, len(order), most, acting, exerted)
    else:
        whole = [[values[row[k]] for k in order] for row in statement.matrix.lists(len(order))]
        found = solve_lists(whole, right, len(order), most, statement.spans)
    solution = [statement.solution[k] for k in order]
    for leaves, numbers in zip((solution, statement.multipliers, statement.report), found, strict=True):
        values.update(zip(leaves, numbers, strict=True))


def _scan(statement: Scan, values: _Values) -> None:
    memory = [np.array([values[atom] for atom in atoms], dtype=float) for atoms in statement.given]
    memory += [np.zeros(size) for size in statement.sizes[len(memory) :]]
    for loop in statement.loops:
        for k in range(loop.count):
            if loop.gate is not None and memory[loop.gate.array][loop.gate.first.at(k)] == 0.0:
                continue
            kernel = loop.kernels[loop.choice.at(k)]
            read = []
            for window, array in zip(kernel.reads, kernel.program.inputs, strict=True):
                first = window.first.at(k)
                read.append(memory[window.array][first : first + array.size].reshape(array.shape))
            for window, result in zip(kernel.writes, interpret(kernel.program, *read), strict=True):
                place = memory[window.array][window.first.at(k) :][: result.size]
                place[:] = place + result.ravel() if window.adds else result.ravel()
    _store(statement, tuple(memory[len(statement.given) :][: len(statement.targets)]), values)


def _store(statement: Record, results: tuple[Floats, ...], values: _Values) -> None:
    for leaves, result in zip(targets(statement), results, strict=True):
        values.update(zip(leaves, result.ravel().tolist(), strict=True))
