"""Like statements as loops: what a Program says of each of many like parts is said once.

Values that are used more than once, or asked for, are classed by how they are computed: by the operations down to the
values that have names, whose classes count, and not which they are. The values of a class lie one behind the other, and
one loop computes them with those of other classes that go along, reading at the places that its members need. So the
length of a Program of many like parts, such as four-bar linkages in a row, follows the number of their kinds.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from multibody_sym.program.program import Program
from multibody_sym.program.statements import (
    Array,
    Assign,
    Call,
    Callee,
    Kernel,
    Loop,
    Record,
    Scan,
    Statement,
    Window,
    callees,
    operands,
    progression,
    targets,
    with_operands,
)
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD, flatten, postorder
from multibody_sym.scalars.node import Node

_LONG: Final = 2000
"""Operations from which on a Program may be worth rolling up: shorter ones compile soon (benchmarks/kinds.py)."""
_SHORTER: Final = 4
"""How many times fewer operations it then has to have in its text."""
_FACTORS: Final = frozenset({"add", "mul", "div"})
"""Operations whose constant operands are read like values."""
_LARGEST: Final = 48
"""Operations of a value without a name at most."""
_MOST_TOGETHER: Final = 60
"""Values that one loop computes at most."""
_LONG_SUM: Final = 8
_LAST: Final = (1 << 30, 0)


def with_loops(program: Program, long: int | None = None) -> Program:
    """Return a Program that computes the same by loops over like values; itself where that is not much shorter.

    Itself too where it has fewer operations than `long`.
    """
    size = sum(len(s.nodes) for s in program.statements if isinstance(s, Assign))
    if size < (_LONG if long is None else long):
        return program
    try:
        return rolled_up(program, size // _SHORTER)[0]
    except _TooLongError:
        return program


def all_rolled(programs: Mapping[str, Program]) -> dict[str, Program]:
    """Return Programs rolled up where that makes them much shorter, and so those that they run, each once."""
    done: dict[int, Program] = {}

    def once(program: Callee) -> Program:
        assert isinstance(program, Program)
        if id(program) not in done:
            statements = tuple(map(inside, program.statements))
            same = all(new is old for new, old in zip(statements, program.statements, strict=True))
            done[id(program)] = with_loops(program if same else replace(program, statements=statements))
        return done[id(program)]

    def inside(statement: Statement) -> Statement:
        before = callees(statement)
        after = tuple(map(once, before))
        if all(new is old for new, old in zip(after, before, strict=True)):
            return statement
        if isinstance(statement, Call):
            return replace(statement, program=after[0])
        assert isinstance(statement, Scan)
        left = iter(after)  # in the order of `callees`
        loops = [
            replace(loop, kernels=tuple(replace(kernel, program=next(left)) for kernel in loop.kernels))
            for loop in statement.loops
        ]
        return replace(statement, loops=tuple(loops))

    return {name: once(program) for name, program in programs.items()}


class _TooLongError(Exception):
    """The operations in the text are more than may be: what is left of the loops need not be made."""


def rolled_up(program: Program, most: float = math.inf) -> tuple[Program, int]:
    """Return a Program with its assignments by loops, and the operations in its text.

    Raises _TooLongError as soon as these are more than `most`.
    """
    rolling = _Rolling(program, most)
    return rolling.program(), rolling.size


Places = dict[Node, tuple[int, int]]
"""The array, by its number, in which a value stands, and its place there."""


@dataclass
class _Class:
    """Values that are computed alike: the first as a pattern, and of each the atoms that it reads, in one order."""

    level: int
    members: list[Node]
    reads: list[tuple[Node, ...]]


class _Rolling:
    """Builds the Program stage by stage: a scan of what the next record needs, the record, at the end the outputs.

    Records keep their targets; `atoms` are those that stand for computed values, `read` the leaves that these read.
    """

    def __init__(self, program: Program, most: float) -> None:
        self.given, self.most = program, most
        records = [statement for statement in program.statements if not isinstance(statement, Assign)]
        self.trace = Trace(program.name, program.inputs, records)
        self.atoms: dict[Node, Node] = {}
        self.uses = _uses(program)
        self.read = {node for node in self.uses if not node.args}
        self.places: Places = {}
        self.arrays: list[tuple[Node, ...]] = []
        for array in program.inputs:
            self._readable(array.slots)
        self.size = 0

    def program(self) -> Program:
        """Return the whole."""
        for statement in self.given.statements:
            if not isinstance(statement, Assign):
                self._record(statement)
        self._compute([value for output in self.given.outputs for value in output.values])
        return self.trace.finish(
            {output.name: (output.shape, [self._atom(x) for x in output.values]) for output in self.given.outputs}
        )

    def _record(self, statement: Record) -> None:
        asked = [x for x in _operands_of(statement) if x.args]
        if asked:
            self._compute(asked)
            statement = with_operands(statement, lambda atoms: tuple(map(self._atom, atoms)))
        self.trace.adopt(statement)
        for leaves in targets(statement):
            self._readable(leaves)

    def _readable(self, atoms: tuple[Node, ...], values: Sequence[Node] = ()) -> None:
        """Let scans read an array, whose atoms stand for values that are no leaves."""
        found = {leaf: (len(self.arrays), k) for k, leaf in enumerate(atoms) if leaf in self.read}
        found |= {node: (len(self.arrays), k) for k, node in enumerate(values)}
        if found:
            self.places |= found
            self.arrays.append(atoms)

    def _atom(self, node: Node) -> Node:
        return self.atoms.get(node, node)

    def _compute(self, wanted: Iterable[Node]) -> None:
        """Compute values, and what of those below them has a name, by one scan."""
        roots = [node for node in dict.fromkeys(wanted) if node.shadow is None and node.args and node not in self.atoms]
        if not roots:
            return
        classes = _Classes(roots, self.uses, self.places, self.most - self.size)
        self.size += classes.size
        stage = _Stage(classes.found, self.places, self._outside(roots))
        given = [*self.arrays, *([stage.constants] if stage.constants else [])]
        (found,) = self.trace.scan(given, [len(stage.stored)], [], stage.loops(len(self.arrays), len(given)))
        self.atoms.update(zip(stage.stored, found, strict=True))
        self._readable(found, stage.stored)

    def _outside(self, roots: Sequence[Node]) -> set[Node]:
        """Return what is asked for, or read by more than what the roots need."""
        read: dict[Node, int] = {}
        for node in _computed(roots, self.places):
            for a in node.args:
                inner = a.args[0] if a.op == "neg" else a
                read[inner] = read.get(inner, 0) + 1
        return {*roots, *(node for node, count in read.items() if self.uses[node] > count)} if read else set(roots)


class _Stage:
    """Classes in groups that one loop computes, member by member: what a member reads of its own group is at hand."""

    def __init__(self, classes: Sequence[_Class], places: Places, outside: set[Node]) -> None:
        self.constants = tuple(
            dict.fromkeys(x for c in classes for reads in c.reads for x in reads if x.shadow is not None)
        )
        self._places = places
        self._index: Places = {}
        self._group: list[int] = []
        self._counts: list[int] = []
        self._of_groups: list[list[int]] = []
        self.classes = sorted(classes, key=lambda c: c.level)
        for number, c in enumerate(self.classes):
            each = sorted(range(len(c.members)), key=lambda k: [self._place(x) for x in c.reads[k]])
            c.members[:], c.reads[:] = [c.members[k] for k in each], [c.reads[k] for k in each]
            self._index |= {node: (number, k) for k, node in enumerate(c.members)}
            self._join(number, c)
        kept = {number for number, c in enumerate(self.classes) if not outside.isdisjoint(c.members)}
        for number, c in enumerate(self.classes):
            for j in range(len(c.reads[0])):
                read = self._index.get(c.reads[0][j])
                if read is not None and not self._at_hand(number, j):
                    kept |= {self._index[row[j]][0] for row in c.reads}
        self.stored = [node for number, c in enumerate(self.classes) if number in kept for node in c.members]
        self._kept = kept

    def _place(self, node: Node) -> tuple[int, int]:
        if node in self._places:
            return self._places[node]
        number, k = self._index.get(node, _LAST)
        return number + _LAST[0], k

    def _join(self, number: int, c: _Class) -> None:
        """Put a class into the first group in which it can be."""
        first = 0
        for j in range(len(c.reads[0])):
            for k, row in enumerate(c.reads):
                read = self._index.get(row[j])
                if read is not None:
                    along = read[1] == k and len(self.classes[read[0]].members) == len(c.members)
                    first = max(first, self._group[read[0]] + (0 if along else 1))
        for group in range(first, len(self._counts)):
            if self._counts[group] == len(c.members) and len(self._of_groups[group]) < _MOST_TOGETHER:
                break
        else:
            group = len(self._counts)
            self._counts.append(len(c.members))
            self._of_groups.append([])
        self._of_groups[group].append(number)
        self._group.append(group)

    def _at_hand(self, number: int, j: int) -> bool:
        """Return whether each member reads there what the same turn of its own loop has computed."""
        found = [self._index.get(row[j]) for row in self.classes[number].reads]
        source = found[0]
        return (
            source is not None
            and self._group[source[0]] == self._group[number]
            and all(x == (source[0], k) for k, x in enumerate(found))
        )

    def loops(self, constants: int, results: int) -> list[Loop]:
        """Return the loops; `constants` and `results` are the numbers of these arrays."""
        places = self._places | {x: (constants, k) for k, x in enumerate(self.constants)}
        places |= {x: (results, k) for k, x in enumerate(self.stored)}
        return [self._loop(group, places, results) for group in self._of_groups]

    def _loop(self, group: Sequence[int], places: Places, results: int) -> Loop:
        values: dict[int, Node] = {}
        inputs: dict[tuple[tuple[int, int], ...], Array] = {}
        outputs: dict[str, tuple[tuple[int, ...], list[Node]]] = {}
        writes: list[Window] = []
        for number in group:
            c, known = self.classes[number], dict[Node, Node]()
            for j, first in enumerate(c.reads[0]):
                column = [row[j] for row in c.reads]
                if first.shadow is not None and all(x is first for x in column):
                    continue
                if self._at_hand(number, j):
                    known[first] = values[self._index[first][0]]
                    continue
                read = tuple(places[x] for x in column)
                array = inputs.setdefault(read, Array(f"given_{array_letters(len(inputs))}"))
                known[first] = array.slots[0]
            (values[number],) = replace_known([c.members[0]], known)
            if number in self._kept:
                outputs[f"value_{array_letters(len(outputs))}"] = ((), [values[number]])
                writes.append(
                    Window(results, progression(range(places[c.members[0]][1], places[c.members[-1]][1] + 1)))
                )
        reads = tuple(
            Window(read[0][0], progression(np.array([k for _, k in read], dtype=np.int64))) for read in inputs
        )
        program = Trace("part", inputs.values()).finish(outputs)
        return Loop(len(self.classes[group[0]].members), (Kernel(program, reads, tuple(writes)),))


def _operands_of(statement: Record) -> list[Node]:
    """Return the values that a statement needs."""
    return [x for atoms in operands(statement) for x in atoms]


def _uses(program: Program) -> dict[Node, int]:
    """Return how often each computed value is read; one that is asked for counts twice, a sign is no value."""
    asked = [x for output in program.outputs for x in output.values if x.args]
    for statement in program.statements:
        if not isinstance(statement, Assign):
            asked += [x for x in _operands_of(statement) if x.args]
    uses = dict.fromkeys(asked, 2)
    for node in postorder(dict.fromkeys(asked)):
        if node.shadow is None:
            for a in node.args:
                inner = a.args[0] if a.op == "neg" else a
                uses[inner] = uses.get(inner, 0) + 1
    return uses


class _Classes:
    """The classes of the values with names below roots, those that are `done` left aside.

    `size` are the operations in the texts of all. Raises _TooLongError as soon as these are more than `most`.
    Of each value without a name `_text` is the number of how it is computed, `_below` what it reads, `_levels` after
    how many others it can be.
    """

    def __init__(self, roots: Sequence[Node], uses: dict[Node, int], done: Places, most: float) -> None:
        self.found: list[_Class] = []
        self.size = 0
        self._most = most
        self._done = done
        self._numbers: dict[Any, int] = {}
        self._text: dict[Node, int] = {}
        self._below: dict[Node, tuple[Node, ...]] = {}
        self._levels: dict[Node, int] = {}
        self._order: dict[Node, tuple[int, int]] = {}
        self._of_text: dict[Any, int] = {}
        wanted = {*roots, *(term for root in roots for term in _terms(root))}
        for node in _computed(roots, done):
            text, reads, level = self._described(node)
            if node in wanted or (uses.get(node, 0) > 1 and node.op != "neg") or len(reads) > _LARGEST:
                text, reads, level = self._named(node, text, reads, level)
            self._text[node], self._below[node], self._levels[node] = text, reads, level

    def _named(self, node: Node, text: int, reads: tuple[Node, ...], level: int) -> tuple[int, tuple[Node, ...], int]:
        """Put a value into its class and return how others read it."""
        distinct = tuple(dict.fromkeys(reads))
        places = {x: k for k, x in enumerate(distinct)}
        whole = text, tuple(places[x] for x in reads), level
        number = self._numbers.setdefault(whole, len(self.found))
        if number == len(self.found):
            self.found.append(_Class(level, [], []))
            self.size += sum(1 for _ in _computed([node], dict.fromkeys(distinct)))
            if self.size > self._most:
                raise _TooLongError
        self.found[number].members.append(node)
        self.found[number].reads.append(distinct)
        self._order[node] = min(map(self._place, distinct))
        return self._number("value", number), (node,), level + 1

    def _number(self, *text: Any) -> int:
        return self._of_text.setdefault(text, len(self._of_text))

    def _described(self, node: Node) -> tuple[int, tuple[Node, ...], int]:
        """Return how a value is computed, what it reads for that, and its level; sums and products in one order."""
        parts = [self._operand(node.op, a) for a in node.args]
        if node.op in ("add", "mul"):
            parts.sort(key=lambda part: (part[0], [self._place(x) for x in part[1]]))
        reads = tuple(x for part in parts for x in part[1])
        return self._number(node.op, *node.own, *(part[0] for part in parts)), reads, max(part[2] for part in parts)

    def _place(self, node: Node) -> tuple[int, int]:
        """Return where the first of what a value depends on stands; constants come last."""
        return self._done[node] if node in self._done else self._order.get(node, _LAST)

    def _operand(self, op: str, a: Node) -> tuple[int, tuple[Node, ...], int]:
        if a.shadow is not None:
            return (self._number("constant"), (a,), 0) if op in _FACTORS else (self._number(a), (), 0)
        if a in self._text:
            return self._text[a], self._below[a], self._levels[a]
        return self._number("given", self._done[a][0]), (a,), 0


def _terms(root: Node) -> list[Node]:
    """Return the terms of a long sum, or of the negative of one, which are like each other."""
    whole = root.args[0] if root.op == "neg" else root
    found = [x.args[0] if x.op == "neg" else x for x in flatten("add", whole)]
    return [x for x in found if x.args and x.shadow is None] if len(found) >= _LONG_SUM else []


def _computed(roots: Iterable[Node], done: Container[Node]) -> Iterator[Node]:
    """Yield what is to be computed, operands first; what is done is not looked into."""
    return (node for node in postorder(roots, done) if node.shadow is None)


def replace_known(roots: Iterable[Node], known: Mapping[Node, Node]) -> list[Node]:
    """Return expressions in which `known` stand for what they are, numbers for factors and terms alone.

    Below what is known nothing is looked at.
    """
    wanted, values = list(roots), dict(known)
    for node in _computed(wanted, values):
        stays = node.op not in _FACTORS
        operands = (a if stays and a.shadow is not None else values.get(a, a) for a in node.args)
        values[node] = BUILD[node.op](*node.own, *operands)
    return [values.get(node, node) for node in wanted]


def array_letters(k: int) -> str:
    """Return a, b, ..., z, ba, bb, ...; names of arrays hold no digits."""
    head, last = divmod(k, 26)
    return (array_letters(head) if head else "") + chr(ord("a") + last)
