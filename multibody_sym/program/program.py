"""Program: a straight-line calculation with named inputs and outputs, as data that verifies itself when it is made."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final, TypeVar

from multibody_sym.errors import MultibodyError
from multibody_sym.program.scan import Scan, conflict
from multibody_sym.scalars.node import Node, slot

TARGETS: Final = "z"
"""The array whose slots stand for the results of calls, solves and scans."""
_ARRAY_NAME: Final = re.compile(r"[A-Za-z]+(_[A-Za-z]+)*")
_PROGRAM_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")


class ProgramError(MultibodyError):
    """A Program contradicts itself."""

    code: ClassVar[str] = "program"


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
        return tuple(slot(self.name, k) for k in range(self.size))


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

    program: Program
    arguments: tuple[tuple[Node, ...], ...]
    targets: tuple[tuple[Node, ...], ...]


@dataclass(frozen=True, repr=False)
class Solve:
    """Find the minimum-norm x with A x = r, and lambda with x = A^T lambda, as `numerics/least_norm.py` does.

    `matrix` holds the s rows of A, `right` r (s); the targets are `solution` x (n), `multipliers` lambda (s, zero for
    dependent rows) and `report` (rank, smallest part of a kept row, relative residual of the dependent rows). No more
    rows are kept than `most`.
    """

    matrix: tuple[tuple[Node, ...], ...]
    right: tuple[Node, ...]
    most: Node
    solution: tuple[Node, ...]
    multipliers: tuple[Node, ...]
    report: tuple[Node, ...]


Record = Call | Solve | Scan
"""What fills targets. Its operands are atoms: constants, input slots, values of earlier statements."""
Statement = Assign | Record


def operands(statement: Record) -> tuple[tuple[Node, ...], ...]:
    """Return the atoms that a record reads."""
    if isinstance(statement, Solve):
        return (*statement.matrix, statement.right, (statement.most,))
    return statement.arguments if isinstance(statement, Call) else statement.given


def targets(statement: Record) -> tuple[tuple[Node, ...], ...]:
    """Return the slots that a record fills."""
    if isinstance(statement, Solve):
        return (statement.solution, statement.multipliers, statement.report)
    return statement.targets


def callees(statement: Statement) -> tuple[Program, ...]:
    """Return the Programs that a statement runs."""
    if isinstance(statement, Call):
        return (statement.program,)
    if isinstance(statement, Scan):
        return tuple(kernel.program for loop in statement.loops for kernel in loop.kernels)
    return ()


@dataclass(frozen=True, repr=False)
class Output:
    """A named result: its elements row by row, as atoms. Shape () is a scalar."""

    name: str
    shape: tuple[int, ...]
    values: tuple[Node, ...]


@dataclass(frozen=True, repr=False)
class Program:
    """A function of arrays: `statements` compute what `outputs` name from `inputs`; every value is defined once.

    Raises ProgramError (UndefinedError, DefinedTwiceError, ShapeError) where the parts do not fit together.
    """

    name: str
    inputs: tuple[Array, ...]
    statements: tuple[Statement, ...]
    outputs: tuple[Output, ...]

    def __post_init__(self) -> None:
        try:
            _verify(self)
        except ProgramError as error:
            raise error.located(path=(f"program {self.name}",)) from None

    def __repr__(self) -> str:
        return f"<Program {self.name}: {len(self.statements)} statements>"

    def __str__(self) -> str:
        from multibody_sym.program.text import program_text

        return program_text(self)

    @cached_property
    def digest(self) -> bytes:
        """The hash of structure, shapes and constants (see `multibody_sym.program.measures`)."""
        from multibody_sym.program.measures import digest

        return digest(self)

    def output(self, name: str) -> Output:
        """Return the output called `name`; raises UndefinedError if there is none."""
        return _named(name, self.outputs, "output")

    def input(self, name: str) -> Array:
        """Return the input called `name`; raises UndefinedError if there is none."""
        return _named(name, self.inputs, "input")


_Part = TypeVar("_Part", Array, Output)


def _named(name: str, things: Iterable[_Part], kind: str) -> _Part:
    for thing in things:
        if thing.name == name:
            return thing
    raise UndefinedError(f"no {kind} is called {name!r}; there are {', '.join(t.name for t in things) or 'none'}")


# --- the verifier: one function a statement type -----------------------------------------------------------------


def _verify(program: Program) -> None:
    verify_program_name(program.name)
    _verify_names([a.name for a in program.inputs], "input")
    _verify_names([o.name for o in program.outputs], "output")
    known = {leaf for array in program.inputs for leaf in array.slots}
    for statement in program.statements:
        _VERIFIERS[type(statement)](statement, known)
    for output in program.outputs:
        if len(output.values) != math.prod(output.shape):
            raise ShapeError(f"output {output.name} of shape {output.shape} got {len(output.values)} values")
        _verify_atoms(output.values, known)


def verify_program_name(name: str) -> None:
    """Raise ProgramError unless `name` is an identifier that generated code can take over."""
    if not _PROGRAM_NAME.fullmatch(name):
        raise ProgramError(f"{name!r} is no name of a program: letters, digits, single underscores; a letter first")


def _verify_names(names: list[str], kind: str) -> None:
    for name in names:
        if not _ARRAY_NAME.fullmatch(name) or name == TARGETS:
            raise ProgramError(f"{name!r} is no name of an {kind}: letters and single underscores, and not {TARGETS!r}")
    if len(set(names)) != len(names):
        raise DefinedTwiceError(f"two {kind}s have the same name: {', '.join(names)}")


def _verify_assign(statement: Assign, known: set[Node]) -> None:
    nodes = statement.nodes
    for node in nodes:
        if node.shadow is not None or not node.args:
            raise ProgramError(f"{node.op}: an atom is not assigned")
        if node in known:
            raise DefinedTwiceError(f"the value of a {node.op} is computed a second time")
        for a in node.args:
            if a not in known and a.shadow is None:
                raise _undefined(a)
        known.add(node)
    if len(nodes) > 1:
        known.difference_update(nodes[:-1])


def _verify_call(statement: Call, known: set[Node]) -> None:
    callee = statement.program
    _verify_sizes(statement.arguments, [a.size for a in callee.inputs], f"the arguments of {callee.name}")
    _verify_sizes(statement.targets, [len(o.values) for o in callee.outputs], f"the targets of {callee.name}")
    _verify_operands_and_targets(statement, known)


def _verify_solve(statement: Solve, known: set[Node]) -> None:
    rows, columns = len(statement.right), len(statement.solution)
    _verify_sizes(statement.matrix, [columns] * rows, "the rows of a matrix to solve with")
    _verify_sizes((statement.multipliers, statement.report), [rows, 3], "multipliers and report of a solve")
    _verify_operands_and_targets(statement, known)


def _verify_scan(statement: Scan, known: set[Node]) -> None:
    for loop in statement.loops:
        for kernel in loop.kernels:
            counts = len(kernel.reads), len(kernel.writes)
            if counts != (len(kernel.program.inputs), len(kernel.program.outputs)):
                raise ShapeError(f"kernel {kernel.program.name} has {counts[0]} windows to read, {counts[1]} to write")
    try:
        problem = conflict(statement)
    except IndexError as error:
        raise ShapeError(f"in a scan {error}") from None
    if problem:
        raise DefinedTwiceError(f"in a scan {problem}")
    _verify_operands_and_targets(statement, known)


def _verify_operands_and_targets(statement: Record, known: set[Node]) -> None:
    for atoms in operands(statement):
        _verify_atoms(atoms, known)
    for leaves in targets(statement):
        for leaf in leaves:
            if leaf.op != "slot" or leaf.data[0] != TARGETS:
                raise ProgramError(f"{leaf.op}: a target is a slot of {TARGETS!r}")
            if leaf in known:
                raise DefinedTwiceError(f"{leaf!r} is defined a second time")
            known.add(leaf)


def _verify_sizes(got: tuple[tuple[Node, ...], ...], wanted: list[int], what: str) -> None:
    sizes = [len(values) for values in got]
    if sizes != wanted:
        raise ShapeError(f"{what} have the sizes {sizes}, not {wanted}")


def _verify_atoms(nodes: Iterable[Node], known: set[Node]) -> None:
    for node in nodes:
        if node not in known and node.shadow is None:
            raise _undefined(node)


def _undefined(node: Node) -> UndefinedError:
    what = f"a {node.op}" if node.args else repr(node)
    return UndefinedError(f"{what} is used, but no input and no earlier statement gives it")


_VERIFIERS: Final[dict[type[Statement], Callable[..., None]]] = {
    Assign: _verify_assign,
    Call: _verify_call,
    Solve: _verify_solve,
    Scan: _verify_scan,
}
