"""The verifier of Programs: one function a statement type."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import Final

from multibody_sym.program.accesses import conflict
from multibody_sym.program.statements import (
    TARGETS,
    Assign,
    Call,
    Callee,
    DefinedTwiceError,
    ProgramError,
    Record,
    Scan,
    ShapeError,
    Solve,
    Statement,
    UndefinedError,
    operands,
    targets,
)
from multibody_sym.scalars.node import Node

_ARRAY_NAME: Final = re.compile(r"[A-Za-z]+(_[A-Za-z]+)*")
_PROGRAM_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")


def verify(program: Callee) -> None:
    """Raise ProgramError, of its three kinds, where the parts of a Program do not fit together."""
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
    for matrix in (statement.matrix, statement.exerted or statement.matrix):
        if len(matrix) != rows or any(not 0 <= k < columns for places in matrix.columns for k in places):
            raise ShapeError(f"{len(matrix)} rows of a matrix to solve {rows} equations for {columns} unknowns")
        _verify_sizes(matrix.elements, list(map(len, matrix.columns)), "the rows of a matrix to solve with")
    _verify_sizes((statement.multipliers, statement.report), [rows, 3], "multipliers and report of a solve")
    _verify_sizes((statement.acting or statement.right,), [rows], "which rows act in a solve")
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
