"""Programs with 50 digits, and their derivatives by differences there: a second route for compiled derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from operator import add, mul, neg, truediv
from typing import Any

import numpy as np
from mpmath import mp, mpf

from multibody_sym.program.statements import Assign, Call, Callee, Solve, targets
from multibody_sym.scalars.node import Node

DIGITS = 50
_STEP = mpf(10) ** -20
_WORK = {
    "pow": lambda x, y: x ** int(y) if y == int(y) else mp.power(x, y),
    "div": truediv,
    "mul": mul,
    "add": add,
    "neg": neg,
    "lt": lambda x, y: x < y,
    "le": lambda x, y: x <= y,
    "where": lambda test, x, y: x if test else y,
    "abs": abs,
    "max": max,
    "min": min,
}


class _Values(dict[Node, Any]):
    def __missing__(self, node: Node) -> Any:
        assert node.shadow is not None, node
        return mpf(node.shadow)


def with_many_digits(program: Callee, *arrays: Sequence[Any]) -> list[list[Any]]:
    """Return the elements of each output; solves are those of independent rows, A x = r with x = A^T lambda."""
    values = _Values()
    for array, given in zip(program.inputs, arrays, strict=True):
        values.update(zip(array.slots, list(given), strict=True))
    with mp.workdps(DIGITS):
        for statement in program.statements:
            if isinstance(statement, Assign):
                for node in statement.nodes:
                    work = _WORK.get(node.op) or getattr(mp, node.op)
                    values[node] = work(*[values[x] for x in node.args])
            elif isinstance(statement, Call):
                given = [[values[x] for x in atoms] for atoms in statement.arguments]
                found = with_many_digits(statement.program, *given)
                for leaves, result in zip(targets(statement), found, strict=True):
                    values.update(zip(leaves, result, strict=True))
            else:
                assert isinstance(statement, Solve)
                _solve(statement, values)
        return [[values[v] for v in output.values] for output in program.outputs]


def _solve(statement: Solve, values: _Values) -> None:
    count = len(statement.solution)
    A = mp.matrix([[values[x] for x in row] for row in statement.matrix.lists(count)])
    multipliers = mp.lu_solve(A * A.T, mp.matrix([values[x] for x in statement.right]))
    values.update(zip(statement.solution, A.T * multipliers, strict=True))
    values.update(zip(statement.multipliers, multipliers, strict=True))
    values.update(zip(statement.report, [mpf(len(statement.right)), mpf(1), mpf(0)], strict=True))


def slopes(program: Callee, arrays: Sequence[Sequence[float]], place: int) -> list[np.ndarray]:
    """Return the derivatives of each output by the elements of an input, in floats: (elements, size)."""
    exact = [list(map(mpf, array)) for array in arrays]
    columns = []
    with mp.workdps(DIGITS):
        for k in range(len(arrays[place])):
            sides = []
            for sign in (1, -1):
                there = [list(array) for array in exact]
                there[place][k] += sign * _STEP
                sides.append(with_many_digits(program, *there))
            rates = [[(a - b) / (2 * _STEP) for a, b in zip(*both, strict=True)] for both in zip(*sides, strict=True)]
            columns.append(rates)
    return [np.array([[float(x) for x in column[n]] for column in columns]).T for n in range(len(program.outputs))]
