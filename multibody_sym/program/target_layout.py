"""What the targets have in common: which functions there are, what they and their arrays are called."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from string import Template
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.program.program import Program, interpret, operation_count, program_hash, verify_program_name
from multibody_sym.program.runtime_constants import GOLDEN, constants_header
from multibody_sym.program.statements import Callee, ProgramError, Scan, Solve, callees
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.tabulated import Tabulated

_WIDTH: Final = 110


@dataclass(frozen=True)
class Function:
    """A Program under the name that generated code gives it; others only call it unless it is `exported`.

    It is `inlined` where loops run it side by side for several numbers.
    """

    name: str
    program: Callee
    exported: bool
    inlined: bool = False


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
        for callee, inlined in _callees(program, names):
            identity = program_hash(callee)
            if identity not in by_hash:
                by_hash[identity] = f"{callee_prefix}{len(by_hash) + 1}"
                found.append(Function(by_hash[identity], callee, exported=False, inlined=inlined))
            names[id(callee)] = by_hash[identity]
        found.append(Function(exported[name], program, exported=True))
    return Functions(tuple(found), names)


def _callees(program: Callee, known: Mapping[int, str]) -> Iterator[tuple[Callee, bool]]:
    """Yield the Programs that `program` runs, directly or not, callees first, those not known yet.

    With each comes whether the statement that runs it does so side by side.
    """
    for statement in program.statements:
        loops = statement.loops if isinstance(statement, Scan) else ()
        inlined = {id(kernel.program) for loop in loops if loop.side_by_side for kernel in loop.kernels}
        for callee in callees(statement):
            if id(callee) not in known:
                yield from _callees(callee, known)
                yield callee, id(callee) in inlined


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


def wrap_items(start: str, items: Iterable[str], end: str, *, indent: str = "    ") -> str:
    """Return `start`, the items with commas between them, and `end`, broken into lines; the first may be broken off."""
    lines = [start]
    for item in items:
        if len(lines[-1]) + len(item) > _WIDTH:
            lines.append(indent)
        lines[-1] += item + ", "
    lines[-1] = lines[-1].removesuffix(", ") + end
    return "\n".join(line.rstrip() for line in lines)


# ----------------------------------------------------------------------------------------------------------------------
# Data in C: numbers, strings, arrays and structures.


def c_structure(kind: str, name: str, fields: Mapping[str, Any]) -> list[str]:
    """Return the declarations of a structure with numbers, arrays, and structures of the kind `mbs_<field>`."""
    lines, texts = [], []
    for field, x in fields.items():
        own = f"{name}_{field}"
        if isinstance(x, np.ndarray):
            lines.append(c_array("double", own, x.ravel().tolist()))
            texts.append(f".{field} = {own}")
        elif isinstance(x, Mapping):
            lines += c_structure(f"mbs_{field}", own, x)
            texts.append(f".{field} = &{own}")
        else:
            texts.append(f".{field} = {c_number(x)}")
    return [*lines, wrap_items(f"static const {kind} {name} = {{", texts, "};")]


def c_array(kind: str, name: str, values: Iterable[float | int | str]) -> str:
    """Return the definition of an array of numbers or strings; C has no empty ones."""
    texts = [c_number(x) if not isinstance(x, str) else c_string(x) for x in values]
    none = '""' if "char" in kind else "0"
    return wrap_items(f"static const {kind} {name}[] = {{", texts or [none], "};")


def c_number(x: float | int) -> str:
    """Return a number of C."""
    return repr(x) if isinstance(x, int) else repr(float(x))


def c_string(text: str) -> str:
    """Return a string of C: bytes that are no plain letters are octal."""
    plain = (chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in text.encode())
    return '"' + "".join(plain) + '"'


# ----------------------------------------------------------------------------------------------------------------------
# Templates: the layout of generated files, read as text.


_ALWAYS: Final = ("calls.c", "constraints.c", "slopes.c", "explicit.c", "trials.c", "runtime.c")
_PARTS: Final = {
    "rows": (("solve.c", "singular.c"), "no_rows.c"),
    "events": (("switching.c", "looks.c", "events.c", "turns.c"), "no_events.c"),
    "implicit": (("stages.c", "implicit.c"), "no_implicit.c"),
    "multistep": (("pairing.c", "multistep.c"), "no_multistep.c"),
    "laws": (("sweeps.c",), ""),
}
"""What only some models enter: its sources, and the one in their place for the others, which compile sooner."""
RUNTIME_PARTS: Final = frozenset(_PARTS)
EXPORTED_PARTS: Final = RUNTIME_PARTS - {"laws"}
"""What exported code enters: time stepping is driven from Python."""
RUNTIME_SOURCES: Final = (*_ALWAYS, *(name for sources, _ in _PARTS.values() for name in sources))
STAND_INS: Final = tuple(stand_in for _, stand_in in _PARTS.values() if stand_in)
RUNTIME_HEADERS: Final = ("in_order.h", "pairing.h", "runtime.h", "stages.h", "stepper.h", "turns.h", "vectors.h")
_PACKAGE = Path(__file__).resolve().parents[1]


def runtime_files(parts: Collection[str] = RUNTIME_PARTS) -> dict[str, str]:
    """Return the texts of the runtime that is compiled with models that enter these parts of it, by file name."""
    texts = {name: template_text(f"c/{name}") for name in (*runtime_sources(parts), *RUNTIME_HEADERS)}
    return {**texts, "constants.h": constants_header()}


def stand_in_files() -> dict[str, str]:
    """Return the texts of what is compiled in the place of parts of the runtime, by file name."""
    return {name: template_text(f"c/{name}") for name in STAND_INS}


def runtime_sources(parts: Collection[str]) -> tuple[str, ...]:
    """Return the names of the sources for models that enter these parts."""
    chosen = (sources if part in parts else (stand_in,) for part, (sources, stand_in) in _PARTS.items())
    return (*_ALWAYS, *(name for sources in chosen for name in sources if name))


def template_text(name: str) -> str:
    """Return the file `name` (such as `c/runtime.c`) of the installed templates, or of those of a checkout."""
    folder = _PACKAGE / "templates"
    return ((folder if folder.is_dir() else _PACKAGE.parent / "templates") / name).read_text(encoding="utf-8")


def fill_template(name: str, **parts: object) -> str:
    """Return the template `name` with its fields replaced by `parts`, which are printed already."""
    return Template(template_text(name)).substitute(parts)


# ----------------------------------------------------------------------------------------------------------------------
# Numbers of generated C: in its text, or as data beside it, so that Programs that differ in them alone are one text.
#
# Where they are written into the text a compiler loads them from memory as well: as data they cost next to no time,
# unless it packs several into one, as it does for a processor that it knows (`native`).


NUMBERS_FILE: Final = "numbers.json"
"""The file beside model.c that holds the numbers in their order."""
_IN_TEXT: Final = (0.0, 1.0, -1.0)


class NumbersInText:
    """Numbers in the text where they are met; tables are arrays of constants, each once, and so are other arrays."""

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._tables: dict[bytes, str] = {}
        self._arrays: list[str] = []

    def named(self, value: float) -> str:
        """Return the text of a number."""
        return repr(value)

    def array(self, values: Sequence[float]) -> str:
        """Return the address of numbers."""
        name = f"{self._prefix}__array_{len(self._arrays) + 1}"
        self._arrays.append(wrap_items(f"static const double {name}[] = {{", map(repr, values), "};"))
        return name

    def table(self, function: Tabulated) -> str:
        """Return the address of a table's columns, one after the other."""
        if function.digest not in self._tables:
            name = f"{self._prefix}__table_{len(self._tables) + 1}"
            values = (repr(x) for column in function.columns for x in column)
            start = f"static const double {name}[] = {{ /* {function.name} */\n    "
            self._arrays.append(wrap_items(start, values, "};"))
            self._tables[function.digest] = name
        return self._tables[function.digest]

    @property
    def definitions(self) -> str:
        """The arrays of tables."""
        return "".join(f"{text}\n\n" for text in self._arrays)


class NumbersApart:
    """The numbers that a text names as elements of an array, each by the next place where it is met.

    Zero, one and minus one stay in the text. Equal numbers do not share a place: other ones need not be equal.
    """

    def __init__(self, prefix: str) -> None:
        self._prefix = prefix
        self._values: list[float] = []
        self._tables: dict[bytes, int] = {}

    def named(self, value: float) -> str:
        """Return the text of a number."""
        if value in _IN_TEXT:
            return repr(value)
        self._values.append(value)
        return f"{self._prefix}__numbers[{len(self._values) - 1}]"

    def array(self, values: Sequence[float]) -> str:
        """Return the address of numbers, zero and one among them."""
        self._values += values
        return f"{self._prefix}__numbers + {len(self._values) - len(values)}"

    def table(self, function: Tabulated) -> str:
        """Return the address of a table's columns, one after the other, which share a place with equal ones."""
        if function.digest not in self._tables:
            self._tables[function.digest] = len(self._values)
            for column in function.columns:
                self._values += column
        return f"{self._prefix}__numbers + {self._tables[function.digest]}"

    @property
    def definitions(self) -> str:
        """The array, and by what name the loader of the library finds it, which alone writes it."""
        prefix, size = self._prefix, len(self._values)
        lines = (
            f"static double {prefix}__numbers[{max(1, size)}];",
            f"double *const {prefix}_numbers = {prefix}__numbers;",
            f"const int {prefix}_number_count = {size};",
        )
        return "\n".join(lines) + "\n\n"

    @property
    def file(self) -> str:
        """What `NUMBERS_FILE` holds."""
        return json.dumps(self._values)


# ----------------------------------------------------------------------------------------------------------------------
# Which parts of the runtime a model enters: the others are neither compiled nor linked.


def parts_of(programs: Mapping[str, Program], *, multistep: bool = True) -> frozenset[str]:
    """Return the parts that runs of some Programs may enter; a run with events may come into modes with rows.

    `multistep`: whether methods that look back are among those that run them.
    """
    implicit = bool({"jacobian", "index_2"} & programs.keys())
    events = "events" in programs
    rows = bool({"put_back", "project_position", "project_velocity"} & programs.keys())
    wanted = {"rows": rows or implicit or events or _solves(programs), "events": events, "implicit": implicit}
    wanted["multistep"] = multistep and "state_derivative" in programs
    wanted["laws"] = "laws" in programs
    return frozenset(part for part, enters in wanted.items() if enters)


def _solves(programs: Mapping[str, Program]) -> bool:
    """Tell whether one of the Programs, or of those that they run, solves equations of rows."""
    left: list[Callee] = list(programs.values())
    seen: set[int] = set()
    while left:
        program = left.pop()
        if id(program) not in seen:
            seen.add(id(program))
            if any(isinstance(statement, Solve) for statement in program.statements):
                return True
            left += [callee for statement in program.statements for callee in callees(statement)]
    return False


# ----------------------------------------------------------------------------------------------------------------------
# Stored inputs and results with which generated code tests itself.


Samples = Mapping[str, Sequence[Sequence[ArrayLike]]]
"""For each program the samples to test it with; a sample holds one array for each input."""

TOLERANCE: Final = 1e-9
"""How far results may lie apart, relative to the largest of an output, or to one: functions differ between systems."""


def spread_samples(programs: Mapping[str, Program], count: int = 3) -> Samples:
    """Return `count` samples for each program whose numbers lie spread between 0.25 and 0.75, the same every time."""
    samples: dict[str, list[list[np.ndarray]]] = {name: [] for name in programs}
    for name, program in programs.items():
        for k in range(count):
            arrays, first = [], 1 + 1009 * k
            for array in program.inputs:
                numbers = np.arange(first, first + array.size) * GOLDEN
                arrays.append((0.25 + 0.5 * (numbers % 1.0)).reshape(array.shape))
                first += array.size
            samples[name].append(arrays)
    return samples


def stored_numbers(program: Program, samples: Sequence[Sequence[ArrayLike]]) -> list[float]:
    """Return for each sample its inputs and the interpreter's results, all in one row."""
    numbers: list[float] = []
    for sample in samples:
        for values in (*sample, *interpret(program, *sample)):
            numbers += np.asarray(values, dtype=float).ravel().tolist()
    return numbers
