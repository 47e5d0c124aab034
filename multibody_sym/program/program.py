"""Program: a straight-line calculation with named inputs and outputs, as data that verifies itself when it is made."""

from __future__ import annotations

import hashlib
import math
import re
import struct
import sys
from array import array as words_array
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, MutableMapping, Sequence
from functools import cached_property, reduce
from operator import or_
from typing import Any, Final, TypeVar, assert_never

import numpy as np
import numpy.typing as npt

from multibody_sym.program.statements import (
    TARGETS,
    Array,
    Assign,
    Call,
    Callee,
    DefinedTwiceError,
    Loop,
    Output,
    ProgramError,
    Progression,
    Record,
    Scan,
    ShapeError,
    Solve,
    Statement,
    UndefinedError,
    Window,
    conflict,
    operands,
    targets,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars import floats
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.least_norm import solve_lists, solve_some
from multibody_sym.scalars.node import FLOAT_OPERATIONS, Node

# ----------------------------------------------------------------------------------------------------------------------
# The operations of Nodes on floats that may be infinite or nan, as C performs them.


_LARGEST_EXPONENT: Final = 2**31


def integer_exponent(node: Node) -> int | None:
    """Return n where `node` is a power x^n that is computed by multiplication, else None."""
    exponent = node.args[1]
    if exponent.op == "number" and isinstance(exponent.data, int) and 0 < exponent.data < _LARGEST_EXPONENT:
        return exponent.data
    return None


_OF_ARRAYS: Final = "pow sqrt sin cos tan asin acos exp log sinh cosh acosh atanh sign"
OPERATIONS: Final[dict[str, Callable[..., float]]] = (
    FLOAT_OPERATIONS | {"div": floats.divide} | {op: getattr(floats, op) for op in _OF_ARRAYS.split()}
)
"""Every operation of a Node on floats that may be infinite or nan; `abs`, `min` and `max` are Python's own."""


# ----------------------------------------------------------------------------------------------------------------------
# Infix: prints the operations of an Assign as one expression of a language, with no parenthesis too many.


PRODUCTS: Final = (2, 3)
"""Exponents that are written as products of the operand, which must be an atom for it."""
_SUM: Final = 1
_PRODUCT: Final = 2
_ATOM: Final = 3


@dataclass(frozen=True)
class Language:
    """How a language writes what differs: names of functions, a choice, a comparison as a number, a truth.

    `functions` maps an operation to the name of its function where that is not the operation's own; `choice` has the
    fields condition, yes and no; `power`, for an integer n that is not written as a product, x and n; `truth`, for a
    number that serves as a condition, x. Division is an operator unless `functions` has a name for it. `table` returns
    the text of a tabulated function, or its derivative of an order, of x.
    """

    functions: Mapping[str, str]
    choice: str
    power: str
    truth: str
    table: Callable[..., str]


_COMPARISONS: Final = {"less": "<", "less_equal": "<="}


def expression(nodes: tuple[Node, ...], names: MutableMapping[Node, str], language: Language) -> str:
    """Return the text of the last of `nodes` with the others inline; `names` holds the text of every atom.

    The order of operations is that of the Nodes, so that the result is the same to the last bit.
    """
    levels: dict[Node, int] = {}
    for node in nodes:
        op = node.op
        if op == "mul":
            a, b = node.args
            left = f"({names[a]})" if a in levels and levels[a] < _PRODUCT else names[a]
            names[node] = f"{left}*({names[b]})" if b in levels and levels[b] < _ATOM else f"{left}*{names[b]}"
            levels[node] = _PRODUCT
        elif op == "add":
            a, b = node.args
            sign, b = ("-", b.args[0]) if b.op == "neg" and b in levels else ("+", b)
            right = f"({names[b]})" if b in levels and levels[b] < _PRODUCT else names[b]
            names[node] = f"{names[a]} {sign} {right}"
            levels[node] = _SUM
        else:
            names[node], levels[node] = _rarer(node, names, levels, language)
    return names[nodes[-1]]


def _operand(node: Node, least: int, names: Mapping[Node, str], levels: Mapping[Node, int]) -> str:
    text = names[node]
    return text if levels.get(node, _ATOM) >= least else f"({text})"


def _rarer(node: Node, names: Mapping[Node, str], levels: Mapping[Node, int], language: Language) -> tuple[str, int]:
    op, args = node.op, node.args
    if op == "neg":
        return "-" + _operand(args[0], _ATOM, names, levels), _PRODUCT
    if op == "div" and op not in language.functions:
        return f"{_operand(args[0], _PRODUCT, names, levels)}/{_operand(args[1], _ATOM, names, levels)}", _PRODUCT
    if op == "where":
        compared = args[0] in levels and args[0].op in _COMPARISONS
        condition = _comparison(args[0], names) if compared else language.truth.format(x=names[args[0]])
        return language.choice.format(condition=condition, yes=names[args[1]], no=names[args[2]]), _ATOM
    if op == "table":
        return language.table(*node.own, names[args[0]]), _ATOM
    if op in _COMPARISONS:
        return language.choice.format(condition=_comparison(node, names), yes="1.0", no="0.0"), _ATOM
    exponent = integer_exponent(node) if op == "pow" else None
    if exponent is None:
        return f"{language.functions.get(op, op)}({', '.join(names[a] for a in args)})", _ATOM
    if exponent in PRODUCTS and args[0] not in levels:
        return "*".join([names[args[0]]] * exponent), _PRODUCT
    return language.power.format(x=names[args[0]], n=exponent), _ATOM


def _comparison(node: Node, names: Mapping[Node, str]) -> str:
    return f"{names[node.args[0]]} {_COMPARISONS[node.op]} {names[node.args[1]]}"


class Texts(dict[Node, str]):
    """The text of every Node that has one by now; constants are written as floats that read back the same."""

    def __missing__(self, node: Node) -> str:
        if node.shadow is None:
            raise KeyError(node)
        return repr(node.shadow)


# ----------------------------------------------------------------------------------------------------------------------
# The verifier of Programs: one function a statement type.


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
                raise _undefined_error(a)
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
            raise _undefined_error(node)


def _undefined_error(node: Node) -> UndefinedError:
    what = f"a {node.op}" if node.args else repr(node)
    return UndefinedError(f"{what} is used, but no input and no earlier statement gives it")


_VERIFIERS: Final[dict[type[Statement], Callable[..., None]]] = {
    Assign: _verify_assign,
    Call: _verify_call,
    Solve: _verify_solve,
    Scan: _verify_scan,
}


# ----------------------------------------------------------------------------------------------------------------------
# The readable text of a Program: one line a statement.


_LANGUAGE: Final = Language(
    functions={},
    choice="where({condition}, {yes}, {no})",
    power="power({x}, {n})",
    truth="{x} != 0",
    table=lambda function, order, x: f"{function.called(order)}({x})",
)


def program_text(program: Callee) -> str:
    """Return `program` for people: inputs with shapes, one numbered value a line, outputs."""
    texts = Texts()
    for given in program.inputs:
        names = [given.name] if given.shape == () else [f"{given.name}[{k}]" for k in range(given.size)]
        texts.update(zip(given.slots, names, strict=True))
    counter = _Counter(texts)
    lines = [f"program {program.name}({', '.join(_shape_text(a) for a in program.inputs)})"]
    lines += [f"  {_statement_text(statement, counter)}" for statement in program.statements]
    lines += [f"  {_shape_text(o)} = {_list_text(o.values, texts)}" for o in program.outputs]
    return "\n".join(lines)


class _Counter:
    """Numbers values as they are defined."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts
        self.count = 0

    def define(self, node: Node) -> str:
        self.texts[node] = f"{TARGETS}{self.count}"
        self.count += 1
        return self.texts[node]


def _shape_text(array: Array | Output) -> str:
    return f"{array.name}[{', '.join(map(str, array.shape))}]" if array.shape else array.name


def _list_text(nodes: Iterable[Node], texts: Texts) -> str:
    return f"({', '.join(texts[n] for n in nodes)})"


def _statement_text(statement: Statement, counter: _Counter) -> str:
    if isinstance(statement, Assign):
        text = expression(statement.nodes, counter.texts, _LANGUAGE)
        return f"{counter.define(statement.value)} = {text}"
    if isinstance(statement, Call):
        arguments = ", ".join(_list_text(atoms, counter.texts) for atoms in statement.arguments)
        return f"{_definition_text(statement.targets, counter)} = {statement.program.name}({arguments})"
    if isinstance(statement, Solve):
        return _solve_text(statement, counter)
    given = ", ".join(_list_text(atoms, counter.texts) for atoms in statement.given)
    loops = "".join(f"\n    {_loop_text(loop)}" for loop in statement.loops)
    unread = f", unread {statement.unread}" if statement.unread else ""
    return f"{_definition_text(statement.targets, counter)} = scan({given}) with work {statement.work}{unread}{loops}"


def _solve_text(statement: Solve, counter: _Counter) -> str:
    width = len(statement.solution)
    rows = ", ".join(_list_text(row, counter.texts) for row in statement.matrix.lists(width))
    right = _list_text(statement.right, counter.texts)
    unknown = _definition_text((statement.solution, statement.multipliers, statement.report), counter)
    most = "" if statement.most.shadow == len(statement.right) else f", most {counter.texts[statement.most]}"
    forces = ", ".join(_list_text(row, counter.texts) for row in statement.exerted.lists(width))
    exerted = f", exerted ({forces})" if forces else ""
    acting = f", acting {_list_text(statement.acting, counter.texts)}" if statement.acting else ""
    return f"{unknown} = solve(({rows}), {right}{most}{acting}{exerted})"


def _loop_text(loop: Loop) -> str:
    kernels = [
        f"{', '.join(map(_window, kernel.writes))} = {kernel.program.name}({', '.join(map(_window, kernel.reads))})"
        for kernel in loop.kernels
    ]
    chosen = f", kernel {_progression(loop.choice)} of" if len(kernels) > 1 else ":"
    gate = f" where {_window(loop.gate)}" if loop.gate is not None else ""
    return f"for k < {loop.count}{gate}{chosen} {'; '.join(kernels)}"


def _window(window: Window) -> str:
    return f"{'+' if window.adds else ''}a{window.array}[{_progression(window.first)}]"


def _progression(given: Progression) -> str:
    if len(given.pattern) == 1:
        return f"{given.pattern[0]} + {given.step}k" if given.step else f"{given.pattern[0]}"
    return f"{given.pattern} by {given.step}"


def _definition_text(leaves: tuple[tuple[Node, ...], ...], counter: _Counter) -> str:
    return ", ".join(f"({', '.join(counter.define(leaf) for leaf in part)})" for part in leaves)


# ----------------------------------------------------------------------------------------------------------------------
# Measures of a Program: how many operations it does, and a hash of its structure.


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
    return OperationCount(**_count_operations(program, {}))


def elements_read(program: Callee) -> dict[str, tuple[frozenset[Node], ...]]:
    """Return for each element of each output, by its name, the elements of inputs that it is computed from."""
    slots = [x for array in program.inputs for x in array.slots]
    read = _slots_read(program, {})
    sets = [frozenset(x for k, x in enumerate(slots) if mask >> k & 1) for mask in read]
    parts = iter(sets)
    return {output.name: tuple(next(parts) for _ in output.values) for output in program.outputs}


def _slots_read(program: Callee, known: dict[int, list[int]]) -> list[int]:
    """Return for each element of the outputs a bit for each element of the inputs that it is computed from."""
    if id(program) not in known:
        slots = [x for array in program.inputs for x in array.slots]
        found = {x: 1 << k for k, x in enumerate(slots)}

        def read(nodes: Iterable[Node]) -> int:
            return reduce(or_, (found.get(x, 0) for x in nodes), 0)

        for statement in program.statements:
            if isinstance(statement, Assign):
                for node in statement.nodes:
                    found[node] = read(node.args)
                continue
            given = [found.get(x, 0) for atoms in operands(statement) for x in atoms]
            filled = [x for part in targets(statement) for x in part]
            if isinstance(statement, Call):
                inner = _slots_read(statement.program, known)
                found |= {
                    x: reduce(or_, (mask for k, mask in enumerate(given) if on >> k & 1), 0)
                    for x, on in zip(filled, inner, strict=True)
                }
            else:
                found |= dict.fromkeys(filled, reduce(or_, given, 0))
        known[id(program)] = [found.get(x, 0) for output in program.outputs for x in output.values]
    return known[id(program)]


def _count_operations(program: Callee, known: dict[int, Counter[str]]) -> Counter[str]:
    if id(program) not in known:
        nodes = [node for s in program.statements if isinstance(s, Assign) for node in s.nodes]
        counts = _counted_nodes(nodes)
        for statement in program.statements:
            if isinstance(statement, Call):
                counts += _count_operations(statement.program, known)
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
            for name, times in _count_operations(kernel.program, known).items():
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
        if isinstance(statement, Assign):
            _hash_assign(statement, numbers)
        else:
            head = _words_of(statement)
            atoms = [numbers[atom] for part in operands(statement) for atom in part]
            numbers.words += head
            numbers.words += atoms
            for leaves in targets(statement):
                numbers.define(leaves)
    for output in program.outputs:
        numbers.words += (_OUTPUT, len(output.shape), *output.shape)
        numbers.words += [numbers[value] for value in output.values]
    words = words_array("Q", numbers.words)
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
            # of a table its numbers and the order of the derivative, beside the operand
            own = (*struct.unpack("<4Q", node.own[0].digest), node.own[1]) if node.own else ()
            words += (_WORDS[node.op], *own, *[numbers[a] for a in args])
        if node not in numbers:  # a change of sign may stand in several statements
            numbers[node] = len(numbers)


def _words_of(statement: Record) -> list[int]:
    """Return what is hashed of a record beside its operands."""
    if isinstance(statement, Call):
        return [_CALL, *struct.unpack("<4Q", statement.program.digest)]
    if isinstance(statement, Solve):
        head = [_SOLVE, len(statement.right), len(statement.solution), len(statement.acting), len(statement.exerted)]
        for rows in (statement.matrix, statement.exerted):
            for columns in rows.columns:
                head += (len(columns), *columns)
        return head
    parts = statement.given, statement.targets
    head = [_SCAN, *map(len, parts), len(statement.work), len(statement.loops), *statement.sizes]
    head += (len(statement.unread), *statement.unread)
    for loop in statement.loops:
        head += (loop.count, len(loop.kernels), *_hashed_progression(loop.choice))
        head += (0,) if loop.gate is None else (1, *_hashed_window(loop.gate))
        for kernel in loop.kernels:
            head += struct.unpack("<4Q", kernel.program.digest)
            for window in (*kernel.reads, *kernel.writes):
                head += _hashed_window(window)
    return head


def _hashed_window(window: Window) -> tuple[int, ...]:
    return (window.array, int(window.adds), *_hashed_progression(window.first))


def _hashed_progression(given: Progression) -> tuple[int, ...]:
    return (len(given.pattern), *(x % _WORD for x in (*given.pattern, given.step)))


# ----------------------------------------------------------------------------------------------------------------------

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
            verify(self)
        except ProgramError as error:
            raise error.located(path=(f"program {self.name}",)) from None

    def __repr__(self) -> str:
        return f"<Program {self.name}: {len(self.statements)} statements>"

    def __str__(self) -> str:
        return program_text(self)

    @cached_property
    def digest(self) -> bytes:
        """The hash of structure, shapes and constants (see `multibody_sym.program.program`)."""
        return digest(self)

    def output(self, name: str) -> Output:
        """Return the output called `name`; raises UndefinedError if there is none."""
        return _find_named(name, self.outputs, "output")

    def input(self, name: str) -> Array:
        """Return the input called `name`; raises UndefinedError if there is none."""
        return _find_named(name, self.inputs, "input")


_Part = TypeVar("_Part", Array, Output)


def _find_named(name: str, things: Iterable[_Part], kind: str) -> _Part:
    for thing in things:
        if thing.name == name:
            return thing
    raise UndefinedError(f"no {kind} is called {name!r}; there are {', '.join(t.name for t in things) or 'none'}")


# ----------------------------------------------------------------------------------------------------------------------
# The interpreter: runs a Program on numbers, statement by statement; every backend must agree with it.


class Values(dict[Node, Any]):
    """The value of every Node that has one by now; constants know theirs."""

    def __missing__(self, node: Node) -> float:
        if node.shadow is None:
            raise KeyError(node)
        return node.shadow

    def of(self, parts: Iterable[Iterable[Node]]) -> list[list[Any]]:
        return [[self[atom] for atom in atoms] for atoms in parts]


class Interpreter:
    """Runs Programs over floats; those over other scalars have operations and solves of their own."""

    def run(self, program: Callee, arrays: Sequence[Sequence[Any]]) -> list[list[Any]]:
        """Return the elements of each output for the elements of each input."""
        values = Values()
        for declared, given in zip(program.inputs, arrays, strict=True):
            values.update(zip(declared.slots, given, strict=True))
        for statement in program.statements:
            if isinstance(statement, Assign):
                for node in statement.nodes:
                    values[node] = self.operate(node, [values[a] for a in node.args])
                continue
            if isinstance(statement, Call):
                results = self.run(statement.program, values.of(statement.arguments))
            elif isinstance(statement, Solve):
                results = self.solve(statement, values)
            else:
                results = self._scan(statement, values)
            for leaves, found in zip(targets(statement), results, strict=True):
                values.update(zip(leaves, found, strict=True))
        return values.of(output.values for output in program.outputs)

    def operate(self, node: Node, arguments: Sequence[Any]) -> Any:
        """Return the value of an operation."""
        exponent = integer_exponent(node) if node.op == "pow" else None
        return OPERATIONS[node.op](*node.own, *arguments) if exponent is None else floats.power(arguments[0], exponent)

    def solve(self, statement: Solve, values: Values) -> list[list[Any]]:
        """Return solution, multipliers and report."""
        order, most = statement.order, values[statement.most]
        right, acting = values.of((statement.right, statement.acting))
        if acting:
            matrix, exerted = (
                [{k: values[atom] for k, atom in row} for row in rows] for rows in (statement.matrix, statement.exerted)
            )
            solution, *others = solve_some(matrix, right, len(order), most, acting, exerted)
        else:
            whole = [[values[row[k]] for k in order] for row in statement.matrix.lists(len(order))]
            solution, *others = solve_lists(whole, right, len(order), most, statement.spans)
        return [[x for _, x in sorted(zip(order, solution, strict=True))], *others]

    def choose(self, gate: Any, new: Any, old: Any) -> Any:
        """Return a result behind a gate that is not the number zero."""
        return new

    def _scan(self, statement: Scan, values: Values) -> list[list[Any]]:
        memory = values.of(statement.given)
        results = range(len(memory), len(memory) + len(statement.targets))
        memory += [[0.0] * size for size in statement.sizes[len(memory) :]]
        for number in statement.unread:
            memory[results[number]] = [math.nan] * len(memory[results[number]])
        for loop in statement.loops:
            for k in range(loop.count):
                self._turn(loop, k, memory)
        return [memory[place] for place in results]

    def _turn(self, loop: Loop, k: int, memory: list[list[Any]]) -> None:
        """Run iteration k of a loop."""
        gate: Any = 1.0 if loop.gate is None else memory[loop.gate.array][loop.gate.first.at(k)]
        if isinstance(gate, float) and gate == 0.0:
            return
        kernel = loop.kernels[loop.choice.at(k)]
        read = []
        for window, declared in zip(kernel.reads, kernel.program.inputs, strict=True):
            first = window.first.at(k)
            read.append(memory[window.array][first : first + declared.size])
        for window, found in zip(kernel.writes, self.run(kernel.program, read), strict=True):
            for place, x in enumerate(found, window.first.at(k)):
                old = memory[window.array][place]
                memory[window.array][place] = self.choose(gate, old + x if window.adds else x, old)


_OVER_FLOATS: Final = Interpreter()


def interpret(program: Callee, *arrays: npt.ArrayLike) -> tuple[Floats, ...]:
    """Return the outputs of `program` for `arrays`, one for each input; raises ShapeError where one does not fit."""
    if len(arrays) != len(program.inputs):
        raise ShapeError(f"program {program.name} has {len(program.inputs)} inputs, not {len(arrays)}")
    given = []
    for declared, array in zip(program.inputs, arrays, strict=True):
        numbers = np.asarray(array, dtype=float)
        if numbers.shape != declared.shape:
            needed = f"has the shape {declared.shape}, not {numbers.shape}"
            raise ShapeError(f"input {declared.name} of {program.name} {needed}")
        given.append(numbers.ravel().tolist())
    found = _OVER_FLOATS.run(program, given)
    return tuple(np.array(x, dtype=float).reshape(o.shape) for x, o in zip(found, program.outputs, strict=True))
