"""Measures of a Program: how many operations it does, and a hash of its structure."""

from __future__ import annotations

import hashlib
import struct
import sys
from array import array
from collections import Counter
from collections.abc import Callable
from typing import Any, Final, assert_never

from multibody_sym.program.arithmetic import integer_exponent
from multibody_sym.program.progressions import Progression, Window
from multibody_sym.program.statements import Assign, Call, Callee, Record, Scan, Solve, Statement, operands, targets
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import Node


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


def operation_count(program: Callee) -> OperationCount:
    """Return the operations of one run; those of callees count whenever they run, those inside a solve do not.

    A change of sign is free; x^n costs the multiplications that compute it; where, abs, min and comparisons are
    functions.
    """
    return OperationCount(**_counted(program, {}))


def _counted(program: Callee, known: dict[int, Counter[str]]) -> Counter[str]:
    if id(program) not in known:
        nodes = [node for s in program.statements if isinstance(s, Assign) for node in s.nodes]
        counts = _counted_nodes(nodes)
        for statement in program.statements:
            if isinstance(statement, Call):
                counts += _counted(statement.program, known)
            elif isinstance(statement, Solve):
                counts["solves"] += 1
            elif isinstance(statement, Scan):
                counts += _counted_scan(statement, known)
            elif not isinstance(statement, Assign):
                assert_never(statement)
        known[id(program)] = counts
    return known[id(program)]


def _counted_scan(scan: Scan, known: dict[int, Counter[str]]) -> Counter[str]:
    counts: Counter[str] = Counter()
    for loop in scan.loops:
        for kernel, iterations in loop.turns():
            for name, times in _counted(kernel.program, known).items():
                counts[name] += times * len(iterations)
            pairs = zip(kernel.writes, kernel.program.outputs, strict=True)
            added = sum(len(output.values) for window, output in pairs if window.adds)
            counts["additions"] += added * len(iterations)
    return counts


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


def program_hash(program: Callee) -> str:
    """Return 64 hexadecimal digits that depend on structure, shapes and constants only, not on any name.

    (The names of inputs decide the order of operands in a sum or product, which is part of the structure.)
    The same in every process. Programs with the same hash compute the same.
    """
    return program.digest.hex()


def digest(program: Callee) -> bytes:
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
_CONSTANT, _CALL, _SOLVE, _INPUT, _OUTPUT, _SCAN = range(1, 7)
_WORD: Final = 2**64


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
            words += (_WORDS[node.op], *_own_words(node), *[numbers[a] for a in args])
        if node not in numbers:  # a change of sign may stand in several statements
            numbers[node] = len(numbers)


def _own_words(node: Node) -> tuple[int, ...]:
    """Return what is hashed of a table beside its operand: its numbers and the order of the derivative."""
    if not node.own:
        return ()
    function, order = node.own
    return (*struct.unpack("<4Q", function.digest), order)


def _hash_call(statement: Call, numbers: _Numbers) -> None:
    callee = struct.unpack("<4Q", statement.program.digest)
    _hash_record((_CALL, *callee), statement, numbers)


def _hash_solve(statement: Solve, numbers: _Numbers) -> None:
    head = [_SOLVE, len(statement.right), len(statement.solution), len(statement.acting), len(statement.exerted)]
    for rows in (statement.matrix, statement.exerted):
        for columns in rows.columns:
            head += (len(columns), *columns)
    _hash_record(tuple(head), statement, numbers)


def _hash_scan(statement: Scan, numbers: _Numbers) -> None:
    parts = statement.given, statement.targets
    head = [_SCAN, *map(len, parts), len(statement.work), len(statement.loops), *statement.sizes]
    for loop in statement.loops:
        head += (loop.count, len(loop.kernels), *_hashed_progression(loop.choice))
        head += (0,) if loop.gate is None else (1, *_hashed_window(loop.gate))
        for kernel in loop.kernels:
            head += struct.unpack("<4Q", kernel.program.digest)
            for window in (*kernel.reads, *kernel.writes):
                head += _hashed_window(window)
    _hash_record(tuple(head), statement, numbers)


def _hashed_window(window: Window) -> tuple[int, ...]:
    return (window.array, int(window.adds), *_hashed_progression(window.first))


def _hashed_progression(given: Progression) -> tuple[int, ...]:
    return (len(given.pattern), *(x % _WORD for x in (*given.pattern, given.step)))


def _hash_record(head: tuple[int, ...], statement: Record, numbers: _Numbers) -> None:
    atoms = [numbers[atom] for part in operands(statement) for atom in part]
    numbers.words += head
    numbers.words += atoms
    for leaves in targets(statement):
        numbers.define(leaves)


_HASHERS: Final[dict[type[Statement], Callable[[Any, _Numbers], None]]] = {
    Assign: _hash_assign,
    Call: _hash_call,
    Solve: _hash_solve,
    Scan: _hash_scan,
}
