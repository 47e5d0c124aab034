"""What the targets have in common: which functions there are, what they and their arrays are called."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from typing import Final

from multibody_sym.program.measures import operation_count, program_hash
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Callee, ProgramError, callees
from multibody_sym.program.verify import verify_program_name
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node

_WIDTH: Final = 110


@dataclass(frozen=True)
class Function:
    """A Program under the name that generated code gives it; others only call it unless it is `exported`."""

    name: str
    program: Callee
    exported: bool


@dataclass(frozen=True)
class Functions:
    """All functions of a generated file, callees first; Programs that compute the same share one."""

    functions: tuple[Function, ...]
    names: Mapping[int, str]
    """The name of the function for each Program, by the Program's id."""

    @property
    def exported(self) -> tuple[Function, ...]:
        """Those that the file is made for, in the order in which they were given."""
        return tuple(f for f in self.functions if f.exported)


def functions(programs: Mapping[str, Program], prefix: str, callee_prefix: str, reserved: Collection[str]) -> Functions:
    """Return the functions for `programs` (`prefix` and name) and for all they call (`callee_prefix` and a number).

    A name that is reserved gets an underscore.

    Raises ProgramError if there is no program or a name is none.
    """
    if not programs:
        raise ProgramError("there is no program to print")
    exported = dict(zip(programs, _identifiers([prefix + name for name in programs], reserved), strict=True))
    names = {id(program): exported[name] for name, program in programs.items()}
    by_hash: dict[str, str] = {}
    found: list[Function] = []
    for name, program in programs.items():
        verify_program_name(name)
        for callee in _callees(program, names):
            identity = program_hash(callee)
            if identity not in by_hash:
                by_hash[identity] = f"{callee_prefix}{len(by_hash) + 1}"
                found.append(Function(by_hash[identity], callee, exported=False))
            names[id(callee)] = by_hash[identity]
        found.append(Function(exported[name], program, exported=True))
    return Functions(tuple(found), names)


def _callees(program: Callee, known: Mapping[int, str]) -> Iterator[Callee]:
    """Yield the Programs that `program` runs, directly or not, callees first, those not known yet."""
    for statement in program.statements:
        for callee in callees(statement):
            if id(callee) not in known:
                yield from _callees(callee, known)
                yield callee


def parameters(program: Callee, reserved: Collection[str]) -> tuple[list[str], list[str]]:
    """Return an identifier for each input and each output: its name, with underscores added where that is taken."""
    inputs = _identifiers([array.name for array in program.inputs], reserved)
    return inputs, _identifiers([output.name for output in program.outputs], {*reserved, *inputs})


def _identifiers(wanted: Iterable[str], reserved: Collection[str]) -> list[str]:
    used = set(reserved)
    names = []
    for name in wanted:
        while name in used:
            name += "_"
        used.add(name)
        names.append(name)
    return names


TABLE_FUNCTIONS: Final = {"linear": "on_lines", "cubic": "on_spline", "knots": "to_knot"}
"""The function of generated code that each kind of table is (`scalars/between.py`)."""
SHORTEST_RUN: Final = 8
"""Elements in a row from which on they are copied as a piece of their array."""
Places = dict[Node, tuple[str, int]]
"""The leaves that are elements of an array of the generated code, each with the array's name and its index."""


def runs(atoms: Sequence[Node], places: Places) -> Iterator[tuple[int, int]]:
    """Yield where atoms begin and end that are consecutive elements of one array, or all the same one."""
    start, wanted = 0, None
    for k, atom in enumerate(atoms):
        place = places.get(atom)
        if k > start and (atom is not atoms[k - 1] if place is None else place != wanted):
            yield start, k
            start = k
        wanted = None if place is None else (place[0], place[1] + 1)
    if atoms:
        yield start, len(atoms)


def strides(leaves: Sequence[Node], wanted: Places) -> Iterator[tuple[int, int, int]]:
    """Yield where leaves begin and end that are wanted in one array at equal distances, over 1, and that distance."""
    start = 0
    while start < len(leaves):
        here, end, step = wanted.get(leaves[start]), start + 1, 0
        while here is not None and end < len(leaves):
            name, place = wanted.get(leaves[end], ("", 0))
            step = step or place - here[1]
            if name != here[0] or step <= 1 or place != here[1] + (end - start) * step:
                break
            end += 1
        if end - start >= SHORTEST_RUN:
            yield start, end, step
        start = end


def summary(name: str, program: Callee) -> list[str]:
    """Return the lines for the head of a file that say what a Program costs and which one it is."""
    count = operation_count(program)
    parts = [f"{getattr(count, field.name)} {field.name}" for field in fields(count)]
    return [f"{name}: {', '.join(parts)};", f"    hash {program_hash(program)}"]


def wrapped(start: str, items: Iterable[str], end: str, *, indent: str = "    ") -> str:
    """Return `start`, the items with commas between them, and `end`, broken into lines; the first may be broken off."""
    lines = [start]
    for item in items:
        if len(lines[-1]) + len(item) > _WIDTH:
            lines.append(indent)
        lines[-1] += item + ", "
    lines[-1] = lines[-1].removesuffix(", ") + end
    return "\n".join(line.rstrip() for line in lines)
