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
from itertools import pairwise
from typing import ClassVar, Final, Protocol, assert_never

import numpy as np
import numpy.typing as npt

from multibody_sym.errors import MultibodyError
from multibody_sym.records import dataclass
from multibody_sym.scalars.least_norm import Span, row_spans
from multibody_sym.scalars.node import ZERO, Node, as_node, slots
from multibody_sym.scalars.vectors import S

# ----------------------------------------------------------------------------------------------------------------------
# Progressions of integers, and the windows on arrays whose places they give.


Integers = npt.NDArray[np.int64]
_LONGEST_PERIOD: Final = 64


@dataclass(frozen=True)
class Progression:
    """Integers `pattern[k % p] + step * (k // p)`, p = len(pattern): constant, arithmetic, periodic, or any table."""

    pattern: tuple[int, ...]
    step: int = 0

    def at(self, k: int) -> int:
        """Return number k."""
        turns, place = divmod(k, len(self.pattern))
        return self.pattern[place] + self.step * turns

    def values(self, count: int) -> Integers:
        """Return the first `count` numbers."""
        k = np.arange(count)
        return np.array(self.pattern, dtype=np.int64)[k % len(self.pattern)] + self.step * (k // len(self.pattern))


def progression(values: Sequence[int] | Integers) -> Progression:
    """Return the progression of the shortest period that begins with `values`; a long period is a table."""
    array = np.asarray(values, dtype=np.int64)
    listed = array.tolist()
    for period in range(1, min(len(listed), _LONGEST_PERIOD + 1)):
        step = listed[period] - listed[0]
        if listed[-1] - listed[-1 - period] == step and (array[period:] - array[:-period] == step).all():
            return Progression(tuple(listed[:period]), step)
    return Progression(tuple(listed) or (0,))


def progression_through(places: Integers, values: Integers) -> Progression:
    """Return the progression of the shortest period that has `values` at `places` (ascending), whatever it has between.

    A long period is a table.
    """
    if len(places) == 0 or places[-1] == len(places) - 1:
        return progression(values)
    for period in range(1, _LONGEST_PERIOD + 1):
        turns, residues = np.divmod(places, period)
        order = np.argsort(residues, kind="stable")
        alike = np.nonzero(np.diff(residues[order]) == 0)[0]
        first, next_one = order[alike[:1]], order[alike[:1] + 1]
        step = int(((values[next_one] - values[first]) // (turns[next_one] - turns[first])).sum())
        pattern = np.zeros(period, dtype=np.int64)
        pattern[residues] = values - step * turns
        if (pattern[residues] + step * turns == values).all():
            return Progression(tuple(pattern.tolist()), step)
    table = np.zeros(places[-1] + 1, dtype=np.int64)
    table[places] = values
    return Progression(tuple(table.tolist()))


@dataclass(frozen=True)
class Window:
    """The elements from `first` on of array number `array`; a kernel's output is stored there, or added if it `adds`.

    Arrays count from the given ones on to the results and to those that only work.
    """

    array: int
    first: Progression
    adds: bool = False


def reversed_progression(given: Progression, count: int) -> Progression:
    """Return the first `count` numbers of a progression, last first."""
    return progression(given.values(count)[::-1])


# ----------------------------------------------------------------------------------------------------------------------
# Where the matrix of a solve may differ from zero, and where its elimination in the order of the rows does.


def column_order(rows: Sequence[Sequence[int]], columns: int) -> list[int]:
    """Return the columns in the order in which rows first use them, which keeps spans short; last those never used."""
    first: dict[int, int] = {}
    for j, places in enumerate(rows):
        for k in places:
            first.setdefault(k, j)
    return sorted(range(columns), key=lambda k: first.get(k, len(rows)))


# ----------------------------------------------------------------------------------------------------------------------

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
    """Find the minimum-norm x with A x = r, and lambda with x = A^T lambda, as `scalars/least_norm.py` does.

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
        return [] if self.acting else row_spans([[row[k] is not ZERO for k in self.order] for row in rows])


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

    @property
    def side_by_side(self) -> bool:
        """Whether each turn writes the next numbers of rows that no turn reads, so that several can run at once."""
        if self.gate is not None or len(self.kernels) > 1:
            return False
        (kernel,) = self.kernels
        shapes = [part.shape for parts in (kernel.program.inputs, kernel.program.outputs) for part in parts]
        windows, read = (*kernel.reads, *kernel.writes), {window.array for window in kernel.reads}
        rows = sorted((window.array, window.first.pattern[0]) for window in kernel.writes)
        return (
            all(len(window.first.pattern) == 1 for window in windows)
            and all(w.first.step == 0 or (w.first.step == 1 and not x) for w, x in zip(windows, shapes, strict=True))
            and all(window.first.step == 1 and not window.adds for window in kernel.writes)
            and not any(array in read for array, _ in rows)
            and all(a[0] < b[0] or a[1] + self.count <= b[1] for a, b in pairwise(rows))
        )

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

    Results and work space are zero at first; of the results whose numbers are `unread` nobody reads an element that
    only closed gates leave out, and it may hold anything.
    """

    given: tuple[tuple[Node, ...], ...]
    targets: tuple[tuple[Node, ...], ...]
    work: tuple[int, ...]
    loops: tuple[Loop, ...]
    unread: tuple[int, ...] = ()

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


def records_of(statements: Iterable[Statement]) -> list[Record]:
    """Return calls, solves and scans among statements, which assign no values by expressions."""
    return [statement for statement in statements if not isinstance(statement, Assign)]


def callees(statement: Statement) -> tuple[Callee, ...]:
    """Return the Programs that a statement runs."""
    if isinstance(statement, Call):
        return (statement.program,)
    if isinstance(statement, Scan):
        return tuple(kernel.program for loop in statement.loops for kernel in loop.kernels)
    if isinstance(statement, Assign | Solve):
        return ()
    assert_never(statement)


# ----------------------------------------------------------------------------------------------------------------------
# When the elements of a scan's arrays are read and written, and whether each is written before it is read.


@dataclass(frozen=True)
class Access:
    """How an array's elements are used: by time (iterations counted through all loops), -1 and `never` if they are not.

    `read` first, `written` last, `stored` how often, `surely` behind no gate; `added` whether anything is added.
    """

    read: Integers
    written: Integers
    stored: Integers
    surely: npt.NDArray[np.bool_]
    added: npt.NDArray[np.bool_]

    def needs_zeros(self, result: bool) -> bool:
        """Whether an element is read or added to that may hold nothing; of a result all are read afterwards."""
        return bool((self.added | (((self.read < _NEVER) | result) & ~self.surely)).any())


_NEVER: Final = np.iinfo(np.int64).max


def accesses(scan: Scan) -> list[Access]:
    """Return the use of every array; raises IndexError where there is no such window or kernel."""
    found = [
        Access(np.full(n, _NEVER), np.full(n, -1), np.zeros(n, dtype=np.int64), *np.zeros((2, n), dtype=bool))
        for n in scan.sizes
    ]
    begun = 0
    for loop in scan.loops:
        if loop.gate is not None:
            every = np.arange(loop.count)
            np.minimum.at(found[loop.gate.array].read, _places(loop.gate, every, 1, found).ravel(), begun + every)
        for kernel, iterations in loop.turns():
            times = begun + iterations
            for window, array in zip(kernel.reads, kernel.program.inputs, strict=True):
                where = _places(window, iterations, array.size, found)
                np.minimum.at(found[window.array].read, where.ravel(), np.repeat(times, array.size))
            for window, output in zip(kernel.writes, kernel.program.outputs, strict=True):
                size = len(output.values)
                where, use = _places(window, iterations, size, found), found[window.array]
                np.maximum.at(use.written, where.ravel(), np.repeat(times, size))
                if window.adds:
                    use.added[where] = True
                else:
                    np.add.at(use.stored, where.ravel(), 1)
                    use.surely[where] = loop.gate is None
        begun += loop.count
    return found


def _places(window: Window, iterations: Integers, size: int, found: Sequence[Access]) -> Integers:
    """Return the places (iterations, size) of a window."""
    if not 0 <= window.array < len(found):
        raise IndexError(f"there is no array {window.array}")
    where = window.first.values(int(iterations[-1]) + 1 if len(iterations) else 0)[iterations, None] + np.arange(size)
    if where.size and not (where.min() >= 0 and where.max() < len(found[window.array].read)):
        raise IndexError(f"a window reaches beyond array {window.array}")
    return where


def conflict(scan: Scan) -> str:
    """Return what contradicts the rule that elements are stored once, or added to, before they are read, or ''."""
    for number, use in enumerate(accesses(scan)):
        if number < len(scan.given) and (use.written >= 0).any():
            return f"array {number} is given and written"
        if (use.stored > 1).any() or ((use.stored == 1) & use.added).any():
            return f"an element of array {number} is stored twice"
        if number - len(scan.given) in scan.unread and use.added.any():
            return f"array {number} is added to, and undefined where gates are closed"
        if (use.written >= use.read).any():
            return f"an element of array {number} is written after it is read"
    return ""
