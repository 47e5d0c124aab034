"""What sweeps through a Program share, forward with rates and backward with weights."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from multibody_sym.program.program import Program, operation_count
from multibody_sym.program.statements import (
    Array,
    Assign,
    Call,
    Callee,
    Kernel,
    Loop,
    Output,
    Progression,
    Scan,
    ShapeError,
    Solve,
    Statement,
    Window,
    records_of,
    reversed_progression,
)
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.calculus import partials, pulled_back
from multibody_sym.scalars.elementary import where
from multibody_sym.scalars.node import ONE, ZERO, Node, add, multiply, subtract

Vector = tuple[Node, ...]


def resume_trace(program: Callee, name: str, further: Iterable[Array]) -> Trace:
    """Return a Trace in which the calls, solves and scans of `program` are done already."""
    trace = Trace(name, (*program.inputs, *further))
    for record in records_of(program.statements):
        trace.adopt(record)
    return trace


def unused_name(name: str, suffix: str, names: Iterable[str]) -> str:
    """Return `name` with suffixes, so many that it is none of `names`."""
    used = set(names)
    name += suffix
    while name in used:
        name += suffix
    return name


def _arrays_beside(
    names: Iterable[str], suffix: str, wanted: Iterable[tuple[str, tuple[int, ...]]]
) -> list[Array]:
    """Return an array for each that is wanted, whose name with a suffix is that of no other."""
    used, found = set(names), []
    for name, shape in wanted:
        found.append(Array(unused_name(name, suffix, used), shape))
        used.add(found[-1].name)
    return found


def callee_value(value: Node, inner: Node) -> Node:
    """Return what a callee returns; a constant needs no call."""
    return value if inner.shadow is None else inner


@dataclass(frozen=True)
class ScanLayout:
    """Where the arrays of a scan are in its derivative, by their number, and where those of their rates or weights."""

    first: Mapping[int, int]
    second: Mapping[int, int]

    @staticmethod
    def of(scan: Scan, *moved: Sequence[int]) -> ScanLayout:
        """Return the layout in which the given arrays, results and work space are each followed by those `moved`."""
        first: dict[int, int] = {}
        second: dict[int, int] = {}
        parts = map(len, (scan.given, scan.targets, scan.work))
        for size, twice in zip(parts, moved, strict=True):
            first |= {len(first) + k: len(first) + len(second) + k for k in range(size)}
            second |= {number: len(first) + len(second) + k for k, number in enumerate(twice)}
        return ScanLayout(first, second)

    def kept(self, window: Window) -> Window:
        """Return the window on the array itself."""
        return replace(window, array=self.first[window.array])

    def behind_gate(self, loop: Loop) -> Loop:
        """Return a loop behind its gate in the derivative."""
        return loop if loop.gate is None else replace(loop, gate=self.kept(loop.gate))

    def other(self, window: Window) -> Window:
        """Return the window on the array of its rates or weights."""
        return replace(window, array=self.second[window.array])


def put(rates: dict[Node, Node], nodes: Sequence[Node], values: Sequence[Node]) -> None:
    """Set the rates of `nodes`; what is zero is left out."""
    rates.update((n, value) for n, value in zip(nodes, values, strict=True) if value is not ZERO)


def rates_of(rates: Mapping[Node, Node], nodes: Iterable[Node]) -> Vector:
    """Return the rates of `nodes`; what has none stands still."""
    return tuple(rates.get(node, ZERO) for node in nodes)


def dot(a: Iterable[Node], b: Iterable[Node]) -> Node:
    """Return the sum of the products of two vectors' elements."""
    total = ZERO
    for x, y in zip(a, b, strict=True):
        if x is not ZERO and y is not ZERO:
            total = add(total, multiply(x, y))
    return total


# ----------------------------------------------------------------------------------------------------------------------
# Derivatives of a Program as a Program, forward: rates are pushed through every statement.
#
# A solve is differentiated with the set of its kept rows held fixed. With full row rank that is the derivative of the
# minimum-norm solution; where rows are dependent it is the derivative of what is computed as long as the same rows are
# kept. The report of a solve counts as constant.


_LARGEST_INLINE: Final = 10_000
"""Operations times columns up to which a Jacobian is written out: it is quick then, and compiles in a few seconds."""
_LARGEST_SPARSE: Final = 400_000
"""The same of a derivative that is asked for by itself: written out, a column has what it moves alone. Of Talos (38
speeds) 72,000 operations are left of 300,000, which compile in 12 s."""


def jacobian(program: Program, output: str, input: str) -> Program:
    """Return the Program of d output / d input, forward; it has the inputs of `program` and one output, `jacobian`.

    Its shape is that of the output followed by that of the input.
    Raises UndefinedError where there is no such output or input.
    """
    wanted, given = program.output(output), program.input(input)
    sweep = _Forward(resume_trace(program, f"{program.name}_{output}_by_{input}", ()))
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
    sweep = _Forward(resume_trace(program, name, ()))
    columns = _columns(sweep, program, outputs, list(_directions(sweep.trace, program, inputs, given)), _LARGEST_INLINE)
    values = [column[row] for row in range(len(columns[0])) for column in columns] if columns else []
    size = sum(len(program.output(name).values) for name in outputs)
    return sweep.trace.finish({"jacobian": ((size, len(columns)), values)})


Direction = Mapping[str, Vector]
"""The rates of some inputs of a Program, by their names; others stand still."""


def jacobian_along(program: Program, directions: Sequence[Direction], *, name: str) -> Program:
    """Return the Program of the rates of all outputs along directions, over the inputs of `program`.

    Its outputs have the names of those of `program`, and one axis more, the last, as long as there are directions.
    """
    trace, columns = traced_rates(program, directions, name=name)
    found: dict[str, tuple[tuple[int, ...], list[Node]]] = {}
    first = 0
    for output in program.outputs:
        rows = range(first, first + len(output.values))
        found[output.name] = (*output.shape, len(columns)), [column[row] for row in rows for column in columns]
        first = rows.stop
    return trace.finish(found)


def traced_rates(program: Program, directions: Sequence[Direction], *, name: str) -> tuple[Trace, list[Vector]]:
    """Return a Trace in which `program` is done, and the rates of all elements of its outputs along each direction."""
    sweep = _Forward(resume_trace(program, name, ()))
    moving = list(dict.fromkeys(name for way in directions for name in way))
    still = {name: (ZERO,) * program.input(name).size for name in moving}
    outputs = [output.name for output in program.outputs]
    return sweep.trace, _columns(sweep, program, outputs, [{**still, **way} for way in directions], _LARGEST_SPARSE)


def _columns(
    sweep: _Forward, program: Program, outputs: Sequence[str], ways: Sequence[Direction], largest: int
) -> list[Vector]:
    """Return the rates of all elements of `outputs` along each direction, written out up to `largest` operations."""
    column = _inline if len(ways) * operation_count(program).total <= largest else _rates_of_call
    return [column(sweep, program, outputs, way) for way in ways]


def _directions(trace: Trace, program: Program, inputs: Sequence[str], given: Program) -> Iterator[Direction]:
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


def _inline(sweep: _Forward, program: Program, outputs: Sequence[str], way: Direction) -> Vector:
    """Return the rates of `outputs` along a direction, written out."""
    seeds: dict[Node, Node] = {}
    for name, part in way.items():
        put(seeds, program.input(name).slots, part)
    return sweep.rates(program, seeds, [value for name in outputs for value in program.output(name).values])


def _rates_of_call(sweep: _Forward, program: Program, outputs: Sequence[str], way: Direction) -> Vector:
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
        return rates_of(rates, wanted)

    def assign(self, statement: Assign, rates: dict[Node, Node]) -> None:
        for node in statement.nodes:
            if any(a in rates for a in node.args):
                if node.op == "where":
                    rate = where(node.args[0], *rates_of(rates, node.args[1:]))
                else:
                    rate = dot(partials(node), rates_of(rates, node.args))
                put(rates, (node,), (rate,))

    def call(self, statement: Call, rates: dict[Node, Node]) -> None:
        given = [rates_of(rates, atoms) for atoms in statement.arguments]
        active = tuple(any(rate is not ZERO for rate in part) for part in given)
        if not any(active):
            return
        callee = self.tangent(statement.program, active)
        arguments = (*statement.arguments, *(part for part, moves in zip(given, active, strict=True) if moves))
        found = self.trace.call(callee, arguments)
        for leaves, values, output in zip(statement.targets, found, callee.outputs, strict=True):
            put(rates, leaves, [callee_value(v, inner) for v, inner in zip(values, output.values, strict=True)])

    def tangent(self, program: Callee, active: tuple[bool, ...]) -> Program:
        """Return the Program of the rates of all outputs, given those of the active inputs."""
        if (id(program), active) not in self.callees:
            names = [array.name for array in program.inputs]
            moving = [array for array, moves in zip(program.inputs, active, strict=True) if moves]
            rates = _arrays_beside(names, "_rate", [(array.name, array.shape) for array in moving])
            sweep = _Forward(resume_trace(program, f"{program.name}_rate", rates))
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
        matrix_rates = [rates_of(rates, row) for row in matrix]
        right_rates = rates_of(rates, statement.right)
        if all(rate is ZERO for part in (*matrix_rates, right_rates) for rate in part):
            return
        columns = ([row[k] for row in matrix_rates] for k in range(len(statement.solution)))
        turned = [dot(column, statement.multipliers) for column in columns]
        rest = [
            subtract(subtract(r, dot(dA, statement.solution)), dot(A, turned))
            for r, dA, A in zip(right_rates, matrix_rates, matrix, strict=True)
        ]
        found = self.trace.solve(statement.matrix, rest, len(statement.solution), statement.most, statement.acting)
        put(rates, statement.solution, list(map(add, turned, found.solution)))
        put(rates, statement.multipliers, found.multipliers)

    def scan(self, statement: Scan, rates: dict[Node, Node]) -> None:
        """Run the kernels with their rates; every array that moves has a second one for its rates."""
        given = [rates_of(rates, atoms) for atoms in statement.given]
        moving = _moving_arrays(statement, [any(rate is not ZERO for rate in part) for part in given])
        first, last = len(statement.given), len(statement.given) + len(statement.targets)
        moved = [
            [number for number in range(*bounds) if moving[number]]
            for bounds in ((0, first), (first, last), (last, len(moving)))
        ]
        if not moved[1]:
            return
        layout = ScanLayout.of(statement, *moved)
        found = self.trace.scan(
            [*statement.given, *(given[number] for number in moved[0])],
            [statement.sizes[number] for number in (*range(first, last), *moved[1])],
            [statement.sizes[number] for number in (*range(last, len(moving)), *moved[2])],
            [self._moving_loop(loop, layout) for loop in statement.loops],
        )
        for number, values in zip(moved[1], found[len(statement.targets) :], strict=True):
            put(rates, statement.targets[number - first], values)

    def _moving_loop(self, loop: Loop, layout: ScanLayout) -> Loop:
        kernels = tuple(self._moving_kernel(kernel, layout) for kernel in loop.kernels)
        return replace(layout.behind_gate(loop), kernels=kernels)

    def _moving_kernel(self, kernel: Kernel, layout: ScanLayout) -> Kernel:
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
            outputs = dict(zip(names, _with_shapes(program.outputs, values), strict=True))
            further = [array.name for array in _arrays_beside(names, "_rate", [(name, ()) for name in names])]
            outputs |= dict(zip(further, _with_shapes(program.outputs, rates), strict=True))
            self.paired[id(program), active] = trace.finish(outputs)
        return self.paired[id(program), active]


_RATES: Final[dict[type[Statement], Callable[[Any, dict[Node, Node], _Forward], None]]] = {
    Assign: lambda statement, rates, sweep: sweep.assign(statement, rates),
    Call: lambda statement, rates, sweep: sweep.call(statement, rates),
    Solve: lambda statement, rates, sweep: sweep.solve(statement, rates),
    Scan: lambda statement, rates, sweep: sweep.scan(statement, rates),
}


def _moving_arrays(scan: Scan, given: Sequence[bool]) -> list[bool]:
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


def _with_shapes(outputs: Iterable[Output], values: Iterable[Vector]) -> list[tuple[tuple[int, ...], Vector]]:
    return [(output.shape, part) for output, part in zip(outputs, values, strict=True)]


# ----------------------------------------------------------------------------------------------------------------------
# Exact derivatives of Programs as Programs: forward (jacobian) and reverse (gradient), through every statement.
#
# A solve is differentiated with the set of its kept rows held fixed. With full row rank that is the derivative of the
# minimum-norm solution; where rows are dependent it is the derivative of what is computed as long as the same rows are
# kept. The report of a solve counts as constant.


def gradient(program: Program, output: str, input: str) -> Program:
    """Return the Program of d output / d input for an output of one element, in one backward pass.

    It has the inputs of `program` and one output, `gradient`, of the shape of the input.
    Raises UndefinedError where there is no such output or input, and ShapeError for an output of more elements.
    """
    wanted, given = program.output(output), program.input(input)
    if len(wanted.values) != 1:
        raise ShapeError(f"a gradient is of one number; output {output} has the shape {wanted.shape}")
    sweep = _Reverse(resume_trace(program, f"{program.name}_{output}_gradient_{input}", ()))
    weights = sweep.weights(program, [(wanted.values[0], ONE)])
    return sweep.trace.finish({"gradient": (given.shape, [weights.get(leaf, ZERO) for leaf in given.slots])})


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
        given = [rates_of(weights, leaves) for leaves in statement.targets]
        active = tuple(any(weight is not ZERO for weight in part) for part in given)
        if not any(active):
            return
        callee = self._adjoint(statement.program, active)
        arguments = (*statement.arguments, *(part for part, counts in zip(given, active, strict=True) if counts))
        found = self.trace.call(callee, arguments)
        for atoms, values, output in zip(statement.arguments, found, callee.outputs, strict=True):
            for atom, value, inner in zip(atoms, values, output.values, strict=True):
                _gather(weights, atom, callee_value(value, inner))

    def _adjoint(self, program: Callee, active: tuple[bool, ...]) -> Program:
        """Return the Program of the weights of all inputs, given those of the active outputs."""
        if (id(program), active) not in self.callees:
            names = [array.name for array in program.inputs]
            counting = [output for output, counts in zip(program.outputs, active, strict=True) if counts]
            arrays = _arrays_beside(names, "_weight", [(output.name, output.shape) for output in counting])
            sweep = _Reverse(resume_trace(program, f"{program.name}_weight", arrays))
            sweep.callees = self.callees
            pairs = zip(counting, arrays, strict=True)
            seeds = [pair for o, array in pairs for pair in zip(o.values, array.slots, strict=True)]
            found = sweep.weights(program, seeds)
            outputs = {x.name: (x.shape, [found.get(leaf, ZERO) for leaf in x.slots]) for x in program.inputs}
            self.callees[id(program), active] = sweep.trace.finish(outputs)
        return self.callees[id(program), active]

    def solve(self, statement: Solve, weights: dict[Node, Node]) -> None:
        """With A A^T mu = A wx + wlambda: wr = mu, wA = lambda (wx - A^T mu)^T - mu x^T."""
        if statement.exerted:
            raise TypeError("a solve in which rows exert other forces than their own has no derivative here")
        x, multipliers = statement.solution, statement.multipliers
        x_weights, multiplier_weights = rates_of(weights, x), rates_of(weights, multipliers)
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
        seeds = [rates_of(weights, leaves) for leaves in statement.targets]
        if all(weight is ZERO for part in seeds for weight in part):
            return
        first, every = len(statement.given), range(len(statement.sizes))
        layout = ScanLayout(
            {number: number + (number >= first) * (len(seeds) + first) for number in every},
            {number: first + len(seeds) + number + (number >= first) * len(every[first:]) for number in every},
        )
        one_by_one = Progression((0,), 1)
        copying = Trace("copy", [Array("x")])
        copy = copying.finish({"y": ((), copying["x"])})
        copies = [
            Loop(
                len(seed),
                (Kernel(copy, (Window(k, one_by_one),), (Window(layout.second[k], one_by_one, adds=True),)),),
            )
            for k, seed in enumerate(seeds, first)
        ]
        again = []
        for loop in statement.loops:
            kernels = (
                replace(k, reads=tuple(map(layout.kept, k.reads)), writes=tuple(map(layout.kept, k.writes)))
                for k in loop.kernels
            )
            again.append(replace(layout.behind_gate(loop), kernels=tuple(kernels)))
        found = self.trace.scan(
            [*statement.given, *seeds],
            statement.sizes[:first],
            [*statement.sizes[first:], *statement.sizes[first:]],
            [
                *again,
                *copies,
                *(self._returned(loop, layout) for loop in reversed(statement.loops)),
            ],
        )
        for atoms, values in zip(statement.given, found, strict=True):
            for atom, value in zip(atoms, values, strict=True):
                _gather(weights, atom, value)

    def _returned(self, loop: Loop, layout: ScanLayout) -> Loop:
        kernels = []
        for kernel in loop.kernels:
            program = self._adjoint(kernel.program, (True,) * len(kernel.writes))
            reads = [*map(layout.kept, kernel.reads), *map(layout.other, kernel.writes)]
            writes = [replace(layout.other(window), adds=True) for window in kernel.reads]
            kernels.append(Kernel(program, _backward(reads, loop.count), _backward(writes, loop.count)))
        gate = layout.behind_gate(loop).gate
        (gate,) = (None,) if gate is None else _backward([gate], loop.count)
        return Loop(loop.count, tuple(kernels), reversed_progression(loop.choice, loop.count), gate)


def _gather(weights: dict[Node, Node], node: Node, weight: Node) -> None:
    if weight is not ZERO and node.shadow is None:
        weights[node] = add(weights.get(node, ZERO), weight)


_WEIGHTS: Final[dict[type[Statement], Callable[[Any, dict[Node, Node], _Reverse], None]]] = {
    Assign: lambda statement, weights, sweep: sweep.assign(statement, weights),
    Call: lambda statement, weights, sweep: sweep.call(statement, weights),
    Solve: lambda statement, weights, sweep: sweep.solve(statement, weights),
    Scan: lambda statement, weights, sweep: sweep.scan(statement, weights),
}


def _backward(windows: Iterable[Window], count: int) -> tuple[Window, ...]:
    return tuple(replace(window, first=reversed_progression(window.first, count)) for window in windows)
