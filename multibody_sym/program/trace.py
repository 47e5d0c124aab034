"""Trace: records calls, solves and scans while expressions are built, and turns what is asked for into a Program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from multibody_sym.program.program import PRODUCTS, Program, integer_exponent
from multibody_sym.program.statements import (
    NO_ROWS,
    TARGETS,
    Array,
    Assign,
    Call,
    Callee,
    Integers,
    Kernel,
    Loop,
    Output,
    Progression,
    Record,
    Rows,
    Scan,
    Solve,
    Statement,
    Window,
    operands,
    records_of,
    targets,
    with_operands,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, as_node, slots

_LONGEST: Final = 16
"""Operations of one statement at most, so that lines of generated code stay readable."""


class Trace:
    """A Program in the making: `trace["q"]` are the slots of an input; expressions are built with them as ever.

    Arguments: the name of the Program and its inputs, and the records that it will `adopt`.
    """

    def __init__(self, name: str, inputs: Iterable[Array], adopted: Iterable[Record] = ()) -> None:
        self.name = name
        self.inputs = tuple(inputs)
        self._slots = {array.name: array.slots for array in self.inputs}
        self._records: list[Record] = []
        self._makers: dict[Node, int] = {}
        self._next = 1 + max((x.data[1] for record in adopted for part in targets(record) for x in part), default=-1)

    def __getitem__(self, name: str) -> tuple[Node, ...]:
        return self._slots[name]

    def call(self, program: Callee, arguments: Sequence[Sequence[Node]]) -> tuple[tuple[Node, ...], ...]:
        """Return the outputs of `program` for `arguments` (one sequence for each of its inputs) as fresh leaves."""
        given = tuple(tuple(map(as_node, values)) for values in arguments)
        record = Call(program, given, tuple(self._fresh(len(output.values)) for output in program.outputs))
        self.adopt(record)
        return record.targets

    def call_where(
        self, gate: Node, program: Callee, arguments: Sequence[Sequence[Node]]
    ) -> tuple[tuple[Node, ...], ...]:
        """Return the outputs of `program` where `gate` is not zero, else zeros, as fresh leaves."""
        given = [*arguments, [gate]]
        begin = Progression((0,))
        reads = tuple(Window(k, begin) for k in range(len(arguments)))
        writes = tuple(Window(len(given) + k, begin) for k in range(len(program.outputs)))
        once = Loop(1, (Kernel(program, reads, writes),), gate=Window(len(arguments), begin))
        return self.scan(given, [len(output.values) for output in program.outputs], [], [once])

    def solve(
        self,
        matrix: Rows | Iterable[Mapping[int, Node] | Sequence[Node]],
        right: Sequence[Node],
        columns: int | None = None,
        most: Node | None = None,
        acting: Sequence[Node] = (),
        exerted: Rows | Iterable[Mapping[int, Node] | Sequence[Node]] = NO_ROWS,
    ) -> Solve:
        """Return the Solve of A x = r with fresh leaves for x, lambda and the report.

        Arguments: `matrix` A (s rows of n), `right` r (s), n where there may be no row to tell it, `most` rows to keep
        (all, if None), `acting` rows (all, if empty), and `exerted` forces C, if x is C^T lambda and not A^T lambda.
        """
        first = next(iter(matrix), ()) if columns is None and not isinstance(matrix, Rows) else ()
        size = len(first) if columns is None else columns
        rows, forces = (x if isinstance(x, Rows) else Rows.of(x) for x in (matrix, exerted))
        unknown = self._fresh(size), self._fresh(len(rows)), self._fresh(3)
        kept = as_node(len(rows)) if most is None else most
        record = Solve(rows, tuple(map(as_node, right)), kept, *unknown, tuple(acting), forces)
        self.adopt(record)
        return record

    def scan(
        self,
        given: Sequence[Sequence[Node]],
        results: Sequence[int],
        work: Sequence[int],
        loops: Sequence[Loop],
        unread: Sequence[int] = (),
    ) -> tuple[tuple[Node, ...], ...]:
        """Return the results of `loops` as fresh leaves.

        Arguments: the atoms of each array that is `given`, the sizes of the arrays that are `results` and of those
        that only `work`; windows number the arrays in this order. The numbers of the results that are `unread` where
        gates are closed.
        """
        atoms = tuple(tuple(map(as_node, values)) for values in given)
        record = Scan(atoms, tuple(self._fresh(size) for size in results), tuple(work), tuple(loops), tuple(unread))
        self.adopt(record)
        return record.targets

    def adopt(self, record: Record) -> None:
        """Take over a record whose targets are its own already."""
        for leaves in targets(record):
            self._makers.update(dict.fromkeys(leaves, len(self._records)))
            self._next = max([self._next, *(leaf.data[1] + 1 for leaf in leaves)])
        self._records.append(record)

    def _fresh(self, count: int) -> tuple[Node, ...]:
        first, self._next = self._next, self._next + count
        return slots(TARGETS, count, first)

    def finish(self, outputs: Mapping[str, tuple[tuple[int, ...], Sequence[Node]]]) -> Program:
        """Return the Program that computes `outputs`: name -> (shape, elements row by row).

        Expressions used more than once are computed once, the others stand inline; what no output needs is left out.
        Raises UndefinedError for a leaf that is no input, and ShapeError.
        """
        named = tuple(Output(name, shape, tuple(map(as_node, values))) for name, (shape, values) in outputs.items())
        roots = [value for output in named for value in output.values]
        return Program(self.name, self.inputs, _statements(_order_nodes(roots, self._records, self._makers)), named)


@dataclass(frozen=True)
class _Order:
    """What is needed, operands first: `items` are operations and records, `uses` counts the places that read each
    operation, and `atoms` are those that must have a statement of their own."""

    items: list[Any]
    uses: dict[Node, int]
    atoms: set[Node]


def _order_nodes(roots: list[Node], records: list[Record], makers: dict[Node, int]) -> _Order:
    """Walk from the roots down; None on the stack means that all operands of what lies below it are done."""
    items: list[Any] = []
    uses: dict[Node, int] = {}
    atoms = set(roots)
    done: set[int] = set()
    stack: list[Any] = roots[::-1]
    while stack:
        node = stack.pop()
        if node is None:
            items.append(stack.pop())
        elif node in uses:
            uses[node] += 1
            if node.op == "neg":  # a sign is never named: its users read the operand
                inner = node.args[0]
                uses[inner] = uses.get(inner, 0) + 1
        elif node.shadow is not None:
            continue
        elif node.args:
            uses[node] = 1
            stack += (node, None)
            stack += node.args[::-1]
            if node.op == "pow" and integer_exponent(node) in PRODUCTS:
                atoms.add(node.args[0])
        elif node in makers and makers[node] not in done:
            done.add(makers[node])
            record = records[makers[node]]
            needed = [atom for part in operands(record) for atom in part]
            atoms.update(needed)
            stack += (record, None)
            stack += [x for x in reversed(needed) if x.args or (x in makers and makers[x] not in done)]
    return _Order(items, uses, atoms)


def _statements(order: _Order) -> tuple[Statement, ...]:
    """Cut the items into statements; `pending` ends with what stands inline in the next item."""
    statements: list[Statement] = []
    pending: list[Node] = []
    sizes: dict[Node, int] = {}
    uses, atoms = order.uses, order.atoms
    for item in order.items:
        if type(item) is not Node:
            statements.append(item)
            continue
        if item.op == "neg" and item not in atoms:
            continue
        count = 1
        for a in item.args:
            if a in sizes:
                count += sizes[a]
            elif a.op == "neg" and a.shadow is None and a not in atoms:
                count += 1 + sizes.get(a.args[0], 0)
                pending.append(a)
        if uses[item] == 1 and count <= _LONGEST and item not in atoms:
            pending.append(item)
            sizes[item] = count
        elif count == 1:
            statements.append(Assign((item,)))
        else:
            pending.append(item)
            statements.append(Assign(tuple(dict.fromkeys(pending[-count:]))))
            del pending[-count:]
    return tuple(statements)


# ----------------------------------------------------------------------------------------------------------------------
# Programs in which an input has become constants, folded into every expression; the input itself stays declared.


Vector = tuple[Node, ...]


def fold_input(program: Callee, input: str, values: Sequence[float | Node]) -> Program:
    """Return `program` with the numbers `values` in place of its input `input`, also in the Programs it calls.

    Raises UndefinedError where there is no such input, ExpressionError where a constant part has no finite value.
    """
    numbers = dict(zip(program.input(input).slots, map(as_node, values), strict=True))

    def constant(nodes: Sequence[Node]) -> Vector:
        changed: list[Any] = evaluate(nodes, lambda leaf: numbers.get(leaf, leaf))
        return tuple(changed)

    trace = Trace(program.name, program.inputs)
    for statement in records_of(program.statements):
        changed = with_operands(statement, constant)
        if isinstance(statement, Call) and isinstance(changed, Call):
            # a callee is folded too where it is handed that input as a whole, under the same name
            pairs = zip(statement.program.inputs, statement.arguments, strict=True)
            if any(array.name == input and arguments == tuple(numbers) for array, arguments in pairs):
                changed = replace(changed, program=fold_input(statement.program, input, values))
        elif isinstance(changed, Scan):
            loops = (
                replace(loop, kernels=tuple(_kernel(kernel, turns, changed.given) for kernel, turns in loop.turns()))
                for loop in changed.loops
            )
            changed = replace(changed, loops=tuple(loops))
        trace.adopt(changed)
    return trace.finish({output.name: (output.shape, constant(output.values)) for output in program.outputs})


def _kernel(kernel: Kernel, iterations: Integers, given: Sequence[Vector]) -> Kernel:
    """Return a kernel in which the inputs that are the same constants in all iterations are folded."""
    program = kernel.program
    for window, array in zip(kernel.reads, program.inputs, strict=True):
        if window.array < len(given):
            read = {given[window.array][first:][: array.size] for first in map(window.first.at, iterations.tolist())}
            if len(read) == 1 and all(atom.shadow is not None for atom in next(iter(read))):
                program = fold_input(program, array.name, next(iter(read)))
    return replace(kernel, program=program)
