"""The statements of a Program: assign, call, solve, scan. Of a Program they know what calling it takes, a `Callee`.

A *scan* runs kernels over arrays in loops, so that a thousand like bodies cost the code of one.
It owns arrays that its loops fill. In each iteration one kernel reads *windows*, consecutive elements that begin
where a progression says, and stores its outputs in others or adds them there. What a tree needs is said with windows:
the parent's row is a window whose places are the parents', what children hand to their parent is added there, up the
tree is a loop whose places descend, and different kinds of bodies are several kernels among which a progression
chooses. Behind a *gate* an iteration runs only where an element is not zero: what it would have written stays as it is,
zero at first. As no element changes once it has been read, the values at the end are those that every kernel saw, and a
scan is differentiated backwards by running the kernels' adjoints over the same windows in the opposite order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import ClassVar, Final, Protocol, assert_never

import numpy as np

from multibody_sym.errors import MultibodyError
from multibody_sym.numerics.least_norm import Span
from multibody_sym.program.profile import column_order, spans_of
from multibody_sym.program.progressions import Integers, Progression, Window
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO, Node, as_node, slots
from multibody_sym.scalars.vectors import S

TARGETS: Final = "z"
"""The array whose slots stand for the results of calls, solves and scans."""


class ProgramError(MultibodyError):
    """A Program contradicts itself."""

    code: ClassVar[str] = "program"

    number = "X101"


class UndefinedError(ProgramError):
    """A value is used that no input and no earlier statement gives."""


class DefinedTwiceError(ProgramError):
    """A name, or a value, is defined a second time."""


class ShapeError(ProgramError):
    """The number of values does not fit the shape, or the callee."""


@dataclass(frozen=True)
class Array:
    """A named input: its slots are the leaves that stand for its elements, row by row. Shape () is a scalar."""

    name: str
    shape: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """The number of elements."""
        return math.prod(self.shape)

    @property
    def slots(self) -> tuple[Node, ...]:
        """The leaves that stand for the elements."""
        return slots(self.name, self.size)


@dataclass(frozen=True, repr=False)
class Output:
    """A named result: its elements row by row, as atoms. Shape () is a scalar."""

    name: str
    shape: tuple[int, ...]
    values: tuple[Node, ...]



class Callee(Protocol):
    """What a call or a kernel runs, and all that statements know of it: a Program."""

    @property
    def name(self) -> str: ...
    @property
    def inputs(self) -> tuple[Array, ...]: ...
    @property
    def statements(self) -> tuple[Statement, ...]: ...
    @property
    def outputs(self) -> tuple[Output, ...]: ...
    @property
    def digest(self) -> bytes: ...
    def input(self, name: str, /) -> Array: ...


@dataclass(frozen=True, slots=True, repr=False)
class Assign:
    """Compute `nodes` in order; later statements may use the last one, `value`.

    Each node is an operation on constants, input slots, values of earlier statements and earlier `nodes`. As a Node is
    its expression, no name is needed: wherever `value` occurs later, it is not computed again.
    """

    nodes: tuple[Node, ...]

    @property
    def value(self) -> Node:
        """The Node that later statements may use."""
        return self.nodes[-1]


@dataclass(frozen=True, repr=False)
class Call:
    """Run `program` on `arguments`, one tuple for each of its inputs; its outputs become `targets`, one tuple each."""

    program: Callee
    arguments: tuple[tuple[Node, ...], ...]
    targets: tuple[tuple[Node, ...], ...]


@dataclass(frozen=True)
class Rows:
    """Rows of a matrix: `elements` of each that may differ from zero, and in which `columns` they stand."""

    columns: tuple[tuple[int, ...], ...]
    elements: tuple[tuple[Node, ...], ...]

    @staticmethod
    def of(matrix: Iterable[Mapping[int, S] | Sequence[S]]) -> Rows:
        """Return rows that are given as lists, or as what may differ from zero by its column."""
        columns, elements = [], []
        for row in matrix:
            pairs = row.items() if isinstance(row, Mapping) else enumerate(row)
            own = [(k, node) for k, node in ((k, as_node(x)) for k, x in pairs) if node is not ZERO]
            columns.append(tuple(k for k, _ in own))
            elements.append(tuple(node for _, node in own))
        return Rows(tuple(columns), tuple(elements))

    def __len__(self) -> int:
        return len(self.elements)

    def __iter__(self) -> Iterator[Iterator[tuple[int, Node]]]:
        """Return for each row its columns with what stands there."""
        return map(zip, self.columns, self.elements)

    def lists(self, width: int) -> list[list[Node]]:
        """Return the rows with all their elements."""
        found = [[ZERO] * width for _ in self.elements]
        for row, pairs in zip(found, self, strict=True):
            for k, node in pairs:
                row[k] = node
        return found

    def changed(self, change: Callable[[tuple[Node, ...]], tuple[Node, ...]]) -> Rows:
        """Return the rows with other elements in the same columns."""
        return replace(self, elements=tuple(map(change, self.elements)))


NO_ROWS: Final = Rows((), ())


@dataclass(frozen=True, repr=False)
class Solve:
    """Find the minimum-norm x with A x = r, and lambda with x = A^T lambda, as `numerics/least_norm.py` does.

    `matrix` holds the s rows of A, `right` r (s); the targets are `solution` x (n), `multipliers` lambda (s, zero for
    dependent rows) and `report` (rank, smallest part of a kept row, relative residual of the dependent rows). No more
    rows are kept than `most`. Rows that `acting` (s) has a zero for are left out, as if they were not there: their
    multipliers are zero. Without it all act. With `exerted` C (s rows of n) x = C^T lambda.
    """

    matrix: Rows
    right: tuple[Node, ...]
    most: Node
    solution: tuple[Node, ...]
    multipliers: tuple[Node, ...]
    report: tuple[Node, ...]
    acting: tuple[Node, ...] = ()
    exerted: Rows = NO_ROWS

    @cached_property
    def order(self) -> list[int]:
        """The columns in the order in which they are eliminated, which every backend keeps."""
        count = len(self.solution)
        return list(range(count)) if self.acting else column_order(self.matrix.columns, count)

    @cached_property
    def spans(self) -> list[Span]:
        """Where rows in this order may differ from zero; nothing where those that act are found as it runs."""
        rows = self.matrix.lists(len(self.order))
        return [] if self.acting else spans_of([[row[k] for k in self.order] for row in rows])


@dataclass(frozen=True)
class Kernel:
    """A Program, with a window for each of its inputs and of its outputs."""

    program: Callee
    reads: tuple[Window, ...]
    writes: tuple[Window, ...]


@dataclass(frozen=True)
class Loop:
    """`count` iterations; in iteration k kernel number `choice.at(k)` runs.

    With a `gate` it does so only where the element that this begins at is not zero.
    """

    count: int
    kernels: tuple[Kernel, ...]
    choice: Progression = Progression((0,))
    gate: Window | None = None

    def turns(self) -> Iterator[tuple[Kernel, Integers]]:
        """Yield each kernel with the iterations in which it runs; raises IndexError where there is no such kernel."""
        chosen = self.choice.values(self.count)
        if chosen.size and not (chosen.min() >= 0 and chosen.max() < len(self.kernels)):
            raise IndexError(f"a loop chooses among {len(self.kernels)} kernels one that is not there")
        for number, kernel in enumerate(self.kernels):
            yield kernel, np.nonzero(chosen == number)[0]


@dataclass(frozen=True, repr=False)
class Scan:
    """Run `loops` over arrays: `given` atoms, results (`targets`) and work space of the sizes `work`.

    Results and work space are zero at first.
    """

    given: tuple[tuple[Node, ...], ...]
    targets: tuple[tuple[Node, ...], ...]
    work: tuple[int, ...]
    loops: tuple[Loop, ...]

    @property
    def sizes(self) -> tuple[int, ...]:
        """The size of each array."""
        return (*map(len, self.given), *map(len, self.targets), *self.work)


Record = Call | Solve | Scan
"""What fills targets. Its operands are atoms: constants, input slots, values of earlier statements."""


Statement = Assign | Record


def operands(statement: Record) -> tuple[tuple[Node, ...], ...]:
    """Return the atoms that a record reads."""
    if isinstance(statement, Solve):
        rows = statement.matrix.elements, statement.exerted.elements
        return (*rows[0], statement.right, (statement.most,), statement.acting, *rows[1])
    if isinstance(statement, Call):
        return statement.arguments
    if isinstance(statement, Scan):
        return statement.given
    assert_never(statement)


def with_operands(statement: Record, change: Callable[[tuple[Node, ...]], tuple[Node, ...]]) -> Record:
    """Return a record that reads other atoms."""
    if isinstance(statement, Solve):
        return replace(
            statement,
            matrix=statement.matrix.changed(change),
            right=change(statement.right),
            most=change((statement.most,))[0],
            acting=change(statement.acting),
            exerted=statement.exerted.changed(change),
        )
    if isinstance(statement, Call):
        return replace(statement, arguments=tuple(map(change, statement.arguments)))
    if isinstance(statement, Scan):
        return replace(statement, given=tuple(map(change, statement.given)))
    assert_never(statement)


def targets(statement: Record) -> tuple[tuple[Node, ...], ...]:
    """Return the slots that a record fills."""
    if isinstance(statement, Solve):
        return (statement.solution, statement.multipliers, statement.report)
    if isinstance(statement, Call | Scan):
        return statement.targets
    assert_never(statement)


def callees(statement: Statement) -> tuple[Callee, ...]:
    """Return the Programs that a statement runs."""
    if isinstance(statement, Call):
        return (statement.program,)
    if isinstance(statement, Scan):
        return tuple(kernel.program for loop in statement.loops for kernel in loop.kernels)
    if isinstance(statement, Assign | Solve):
        return ()
    assert_never(statement)


def with_kernels(scan: Scan, programs: Sequence[Callee]) -> Scan:
    """Return a scan that runs other Programs over the same windows, in the order of `callees`."""
    left = iter(programs)
    loops = [
        replace(loop, kernels=tuple(replace(kernel, program=next(left)) for kernel in loop.kernels))
        for loop in scan.loops
    ]
    return replace(scan, loops=tuple(loops))
