"""Random Programs: every operation, constants, nested calls, solves, arrays of size zero, outputs that are inputs."""

from __future__ import annotations

import random
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from random_scans import WIDTH, Passes

from multibody_sym.errors import ExpressionError
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import PI, Node, number, power, real

ROUNDED = ("add", "add", "mul", "mul", "div", "neg", "sqrt")
ARITHMETIC = (*ROUNDED, "abs", "min", "max", "sign", "less", "less_equal", "where")
FUNCTIONS = tuple("sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp log pow".split())
SMOOTH = ("add", "add", "mul", "mul", "sin", "cos", "tanh", "atan", "neg")
CONSTANTS = (number(1), number(-2), number(Fraction(1, 3)), real(0.1), real(-1e-3), PI, number(7), -PI)
ARITY = {"where": 3} | dict.fromkeys(["add", "mul", "div", "min", "max", "less", "less_equal", "atan2", "pow"], 2)
SHAPES: tuple[tuple[int, ...], ...] = ((), (3,), (0,), (2, 2), (1,), (6,))


class Maker:
    """Draws Programs from `operations` with a generator of its own."""

    def __init__(self, seed: int, operations: Sequence[str], *, solves: bool = True) -> None:
        self.random = random.Random(seed)
        self.operations = operations
        self.solves = solves
        self.used: set[Node] = set()

    def program(self, depth: int = 2, steps: int = 60) -> Program:
        """Return a Program that calls others down to `depth`."""
        inputs = [Array(name, self.random.choice(SHAPES)) for name in ("t", "q", "sin")]
        outputs = {name: self.random.choice(SHAPES) for name in ("x", "q", "y")}
        return self.function(f"random_{depth}", inputs, outputs, depth, steps)

    def function(
        self, name: str, inputs: Sequence[Array], outputs: dict[str, tuple[int, ...]], depth: int = 0, steps: int = 8
    ) -> Program:
        """Return a Program of random operations with these inputs and shapes of outputs."""
        trace = Trace(name, inputs)
        pool = [leaf for array in inputs for leaf in trace[array.name]] + list(self.random.sample(CONSTANTS, 4))
        callees = [self.program(depth - 1, steps // 2) for _ in range(2)] if depth else []
        for _ in range(steps):
            kind = self.random.random()
            if callees and kind < 0.08:
                pool += self._call(trace, self.random.choice(callees), pool)
            elif depth and kind < 0.09:
                pool += self._scan(trace, pool)
            elif self.solves and kind < 0.13:
                pool += self._solve(trace, pool)
            else:
                pool += self.operation(pool)
        sizes = {output: int(np.prod(shape, dtype=int)) for output, shape in outputs.items()}
        return trace.finish({output: (outputs[output], self._some(pool, size)) for output, size in sizes.items()})

    def arguments(self, program: Program) -> list[np.ndarray]:
        """Return numbers for the inputs: mostly harmless, some zero, signed, tiny or huge."""
        strange = (0.0, -0.0, 1.0, -1.0, 1e-200, 1e200, 5e-324)
        arrays = []
        for array in program.inputs:
            usual = [self.random.uniform(-2.0, 2.0) for _ in range(array.size)]
            values = [self.random.choice(strange) if self.random.random() < 0.1 else x for x in usual]
            arrays.append(np.array(values).reshape(array.shape))
        return arrays

    def _some(self, pool: Sequence[Node], count: int) -> list[Node]:
        """Return some of `pool`, rather those that nothing uses yet, so that little is computed in vain."""
        found = []
        for _ in range(count):
            unused = [node for node in pool[-30:] if node not in self.used]
            found.append(self.random.choice(unused if unused and self.random.random() < 0.7 else pool))
            self.used.add(found[-1])
        return found

    def operation(self, pool: Sequence[Node]) -> list[Node]:
        op = self.random.choice(self.operations)
        args = self._some(pool, ARITY.get(op, 1))
        try:
            if self.random.random() < 0.08:
                exponents = (2, 3, 4, 5, 7, -1, -2, -3) if "div" in self.operations else (2, 3, 4)
                return [power(args[0], number(self.random.choice(exponents)))]
            return [BUILD[op](*args)]
        except ExpressionError:  # of constants, such as 1/0
            return []

    def _call(self, trace: Trace, callee: Program, pool: Sequence[Node]) -> list[Node]:
        arguments = [self._some(pool, array.size) for array in callee.inputs]
        if self.random.random() < 0.3:  # a whole input of the same size
            arguments = [
                [*trace[mine.name]] if mine.size == its.size else given
                for mine, its, given in zip(trace.inputs, callee.inputs, arguments, strict=True)
            ]
        return [leaf for part in trace.call(callee, arguments) for leaf in part]

    def _scan(self, trace: Trace, pool: Sequence[Node]) -> list[Node]:
        count = self.random.randrange(4)
        passes = Passes.random(self.random, self.function, count, chain=self.random.random() < 0.3)
        return passes.scanned(trace, self._some(pool, WIDTH * count), self._some(pool, 1)[0])

    def _solve(self, trace: Trace, pool: Sequence[Node]) -> list[Node]:
        rows, columns = self.random.randrange(6), self.random.randrange(6)
        matrix = [self._some(pool, columns) for _ in range(rows)]
        matrix = [[x if self.random.random() < 0.7 else number(0) for x in row] for row in matrix]
        if rows > 1 and self.random.random() < 0.3:
            matrix[-1] = matrix[0]
        acting, exerted = list[Node](), list[list[Node]]()
        if self.random.random() < 0.5:
            of_plain = self.random.random() < 0.3  # 2 for one row that acts is 2 for all of them
            acts = [number(2)] if of_plain else [number(1), *self._some(pool, 1)]
            acting = [self.random.choice([number(0), *acts]) for _ in range(rows)]
        if acting and columns and self.random.random() < 0.5:
            exerted = [self._some(pool, columns) if self.random.random() < 0.5 else row for row in matrix]
        record = trace.solve(matrix, self._some(pool, rows), columns, None, acting, exerted)
        return [*record.solution, *record.multipliers, *record.report]
