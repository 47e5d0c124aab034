"""Measures of a Program: how many operations it does, and a hash of its structure."""

from __future__ import annotations

import hashlib
import struct
import sys
from array import array
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from multibody_sym.program.arithmetic import integer_exponent
from multibody_sym.program.program import Assign, Call, Program, Solve, Statement, operands, targets
from multibody_sym.scalars.node import BUILD, Node


@dataclass(frozen=True)
class OperationCount:
    """How often a Program adds, subtracts, multiplies, divides, calls a function, and solves a linear system."""

    additions: int = 0
    subtractions: int = 0
    multiplications: int = 0
    divisions: int = 0
    functions: int = 0
    solves: int = 0

    @property
    def total(self) -> int:
        """Additions, subtractions, multiplications and divisions together."""
        return self.additions + self.subtractions + self.multiplications + self.divisions


def operation_count(program: Program) -> OperationCount:
    """Return the operations of one run; those of callees count at each call, those inside a solve do not.

    A change of sign is free; x^n costs the multiplications that compute it; where, abs, min and comparisons are
    functions.
    """
    return OperationCount(**_counted(program, {}))


def _counted(program: Program, known: dict[int, Counter[str]]) -> Counter[str]:
    if id(program) not in known:
        nodes = [node for s in program.statements if isinstance(s, Assign) for node in s.nodes]
        counts = _counted_nodes(nodes)
        for statement in program.statements:
            if isinstance(statement, Call):
                counts += _counted(statement.program, known)
            elif isinstance(statement, Solve):
                counts["solves"] += 1
        known[id(program)] = counts
    return known[id(program)]


def _counted_nodes(nodes: list[Node]) -> Counter[str]:
    ops = Counter([node.op for node in nodes])
    differences = sum(1 for node in nodes if node.op == "add" and node.args[1].op == "neg")
    exponents = [integer_exponent(node) for node in nodes if node.op == "pow"]
    products = [n.bit_length() + n.bit_count() - 2 for n in exponents if n is not None]
    return Counter(
        additions=ops["add"] - differences,
        subtractions=differences,
        multiplications=ops["mul"] + sum(products),
        divisions=ops["div"],
        functions=len(nodes) - sum(ops[op] for op in ("add", "mul", "div", "neg")) - len(products),
    )


def program_hash(program: Program) -> str:
    """Return 64 hexadecimal digits that depend on structure, shapes and constants only, not on any name.

    (The names of inputs decide the order of operands in a sum or product, which is part of the structure.)
    The same in every process. Programs with the same hash compute the same.
    """
    return program.digest.hex()


def digest(program: Program) -> bytes:
    """Return the hash as `Program.digest` keeps it."""
    numbers = _Numbers()
    for given in program.inputs:
        numbers.words += (_INPUT, len(given.shape), *given.shape)
        numbers.define(given.slots)
    for statement in program.statements:
        _HASHERS[type(statement)](statement, numbers)
    for output in program.outputs:
        numbers.words += (_OUTPUT, len(output.shape), *output.shape)
        numbers.words += [numbers[value] for value in output.values]
    words = array("Q", numbers.words)
    if sys.byteorder == "big":
        words.byteswap()
    return hashlib.sha256(words.tobytes()).digest()


_WORDS: Final = {op: int.from_bytes(op.encode()[:8], "big") for op in BUILD}
_CONSTANT, _CALL, _SOLVE, _INPUT, _OUTPUT = range(1, 6)


class _Numbers(dict[Node, int]):
    """The words that are hashed, and the number of each Node that has one by now; constants get theirs when met."""

    def __init__(self) -> None:
        super().__init__()
        self.words: list[int] = []

    def __missing__(self, node: Node) -> int:
        self.words += (_CONSTANT, *struct.unpack("<Q", struct.pack("<d", node.shadow)))
        self[node] = len(self)
        return self[node]

    def define(self, leaves: tuple[Node, ...]) -> None:
        for leaf in leaves:
            self[leaf] = len(self)


def _hash_assign(statement: Assign, numbers: _Numbers) -> None:
    words = numbers.words
    for node in statement.nodes:
        args = node.args
        if len(args) == 2:
            words += (_WORDS[node.op], numbers[args[0]], numbers[args[1]])
        else:
            words += (_WORDS[node.op], *[numbers[a] for a in args])
        if node not in numbers:  # a change of sign may stand in several statements
            numbers[node] = len(numbers)


def _hash_call(statement: Call, numbers: _Numbers) -> None:
    callee = struct.unpack("<4Q", statement.program.digest)
    _hash_record((_CALL, *callee), statement, numbers)


def _hash_solve(statement: Solve, numbers: _Numbers) -> None:
    _hash_record((_SOLVE, len(statement.right), len(statement.solution)), statement, numbers)


def _hash_record(head: tuple[int, ...], statement: Call | Solve, numbers: _Numbers) -> None:
    atoms = [numbers[atom] for part in operands(statement) for atom in part]
    numbers.words += head
    numbers.words += atoms
    for leaves in targets(statement):
        numbers.define(leaves)


_HASHERS: Final[dict[type[Statement], Callable[[Any, _Numbers], None]]] = {
    Assign: _hash_assign,
    Call: _hash_call,
    Solve: _hash_solve,
}
