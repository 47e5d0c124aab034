"""Programs as modules of languages that have lists, Python and JavaScript: one printer, a `Syntax` for each.

A function takes numbers and lists, and returns a list of the like. Python is for where there is no C compiler, to the
same bits, many times slower; JavaScript is an ES module for browsers and node.
"""

from __future__ import annotations

import keyword
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from multibody_sym.program.program import Language, Program, Texts, expression, interpret
from multibody_sym.program.statements import (
    Assign,
    Call,
    Kernel,
    Loop,
    ProgramError,
    Progression,
    Scan,
    Solve,
    Statement,
)
from multibody_sym.program.target_layout import (
    SHORTEST_RUN,
    TABLE_FUNCTIONS,
    TITLE,
    TOLERANCE,
    Function,
    Functions,
    Places,
    Samples,
    fill_template,
    functions,
    parameters,
    runs,
    summary,
    template_text,
    wrap_items,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars import arrays, floats, least_norm, rank
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.tabulated import Tabulated

_INDENT: Final = " " * 4


@dataclass(frozen=True)
class Syntax:
    """What differs between languages with lists; texts in braces are filled in.

    `opens` and `closes` stand around the lines of a block, behind its head and below them. `returned` stands before the
    results, `ends` behind a statement. `sparse` opens and closes a row by columns. `reserved` names are no arguments.
    """

    function: str
    opens: str
    closes: str
    ends: str
    define: str
    returned: tuple[str, str]
    spread: str
    part: str
    zeros: str
    append: str
    repeat: str
    skip_where_zero: str
    choose: str
    add_each: str
    progression: str
    sparse: tuple[str, str, str]
    table: tuple[str, str]
    comment: str
    reserved: frozenset[str]

    def block(self, head: str, inside: Iterable[str]) -> list[str]:
        return [f"{head}{self.opens}", *(_INDENT + line for line in inside), *([self.closes] if self.closes else [])]


class Tables:
    """The tables of a module, each once: `texts` define them."""

    def __init__(self, syntax: Syntax) -> None:
        self.syntax = syntax
        self.texts: list[str] = []
        self._names: dict[bytes, str] = {}

    def text(self, function: Tabulated, order: int, x: str) -> str:
        """Return a tabulated function, or its derivative of an order, of x."""
        if function.digest not in self._names:
            name = f"TABLE_{len(self._names) + 1}"
            columns = [wrap_items("    [", map(repr, column), "],", indent=" " * 8) for column in function.columns]
            opens, closes = self.syntax.table
            head = f"{opens.format(name=name)}  {self.syntax.comment} {function.name}"
            self.texts.append("\n".join([head, *columns, closes]))
            self._names[function.digest] = name
        return f"{TABLE_FUNCTIONS[function.kind]}({self._names[function.digest]}, {order}, {x})"


class ListPrinter:
    """Prints one Program as one function."""

    def __init__(self, function: Function, every: Functions, language: Language, syntax: Syntax) -> None:
        self.language, self.syntax, self.function, self.every = language, syntax, function, every
        program = function.program
        self.inputs, _ = parameters(program, syntax.reserved)
        self.names = Texts()
        self.places: Places = {}
        for name, array in zip(self.inputs, program.inputs, strict=True):
            self.define(name, array.shape, array.slots)
        self.lines: list[str] = []
        self.count = 0

    def text(self) -> str:
        """Return the definition of the function."""
        program = self.function.program
        for statement in program.statements:
            _write(self, statement)
        head = self.syntax.function.format(name=self.function.name)
        head = wrap_items(f"{head}(", self.inputs, ")", indent=" " * 8)
        values = [self.value(output.shape, output.values) for output in program.outputs]
        first, last = self.syntax.returned
        comma = "," if len(values) == 1 else ""
        result = f"{first}{', '.join(values)}{comma}{last}{self.syntax.ends}"
        return "\n".join(self.syntax.block(head, [*self.lines, result]))

    def define(self, name: str, shape: tuple[int, ...], leaves: Sequence[Node]) -> None:
        """Let `leaves` be the elements of `name`, or `name` itself where the shape is that of a scalar."""
        for k, leaf in enumerate(leaves):
            self.names[leaf] = f"{name}[{k}]" if shape else name
            if shape:
                self.places[leaf] = name, k

    def value(self, shape: tuple[int, ...], atoms: Sequence[Node]) -> str:
        """Return the text of a scalar, or of a list."""
        if not shape:
            return self.names[atoms[0]]
        texts: list[str] = []
        for start, end in runs(atoms, self.places):
            if end - start >= SHORTEST_RUN and atoms[start] in self.places:
                name, first = self.places[atoms[start]]
                part = self.syntax.part.format(name=name, first=first, end=first + end - start)
                texts.append(self.syntax.spread.format(list=part))
            else:
                texts += [self.names[atom] for atom in atoms[start:end]]
        return wrap_items("[", texts, "]", indent=" " * 8)

    def assign(self, kind: str, value: str) -> str:
        """Write a new name for a value; return it."""
        name = f"{kind}{self.count}"
        self.count += 1
        self.lines.append(self.defined(name, value))
        return name

    def defined(self, name: str, value: str) -> str:
        return self.syntax.define.format(name=name, value=value) + self.syntax.ends


def _write(printer: ListPrinter, statement: Statement) -> None:
    if isinstance(statement, Assign):
        text = expression(statement.nodes, printer.names, printer.language)
        printer.names[statement.value] = printer.assign("z", text)
    elif isinstance(statement, Call):
        callee = statement.program
        pairs = zip(callee.inputs, statement.arguments, strict=True)
        arguments = [printer.value(array.shape, atoms) for array, atoms in pairs]
        called = wrap_items(f"{printer.every.names[id(callee)]}(", arguments, ")", indent=" " * 8)
        name = printer.assign("r", called)
        for k, (output, leaves) in enumerate(zip(callee.outputs, statement.targets, strict=True)):
            printer.define(f"{name}[{k}]", output.shape, leaves)
    elif isinstance(statement, Solve):
        _solve(printer, statement)
    else:
        _scan(printer, statement)


def _solve(printer: ListPrinter, statement: Solve) -> None:
    order = statement.order

    def row(atoms: Sequence[Node]) -> str:
        return printer.value((len(atoms),), atoms)

    sizes = [row(statement.right), str(len(order)), printer.names[statement.most]]
    if statement.acting:
        opens, pair, closes = printer.syntax.sparse
        matrix, exerted = (
            wrap_items("[", texts, "]", indent=" " * 8)
            for texts in (
                [opens + ", ".join(pair.format(k=k, x=printer.names[atom]) for k, atom in row) + closes for row in rows]
                for rows in (statement.matrix, statement.exerted)
            )
        )
        called = wrap_items("solve_some(", [matrix, *sizes, row(statement.acting), exerted], ")", indent=" " * 8)
    else:
        rows = [row([atoms[k] for k in order]) for atoms in statement.matrix.lists(len(order))]
        spans = [str(list(span)) for span in statement.spans]
        given = [wrap_items("[", rows, "]", indent=" " * 8), *sizes]
        given.append(wrap_items("[", spans, "]", indent=" " * 8))
        called = wrap_items("solve_lists(", given, ")", indent=" " * 8)
    name = printer.assign("r", called)
    for k, leaves in enumerate(([statement.solution[k] for k in order], statement.multipliers, statement.report)):
        printer.define(f"{name}[{k}]", (len(leaves),), leaves)


def _scan(printer: ListPrinter, statement: Scan) -> None:
    syntax, lines = printer.syntax, printer.lines
    given = [printer.value((len(atoms),), atoms) for atoms in statement.given]
    name = printer.assign("m", wrap_items("[", given, "]", indent=" " * 8))
    zeros = (syntax.zeros.format(size=size) for size in statement.sizes[len(given) :])
    lines += [syntax.append.format(name=name, value=value) + syntax.ends for value in zeros]
    for loop in statement.loops:
        lines += _loop(printer, loop, name)
    for k, leaves in enumerate(statement.targets):
        printer.define(f"{name}[{len(given) + k}]", (len(leaves),), leaves)


def _loop(printer: ListPrinter, loop: Loop, memory: str) -> list[str]:
    syntax, inside = printer.syntax, list[str]()
    if loop.gate is not None:
        value = f"{memory}[{loop.gate.array}][{_place(printer, loop.gate.first)}]"
        inside += syntax.block(syntax.skip_where_zero.format(x=value), [f"continue{syntax.ends}"])
    if len(loop.kernels) == 1:
        inside += _kernel(printer, loop.kernels[0], memory)
    else:
        inside.append(printer.defined("kernel", _place(printer, loop.choice)))
        for number, kernel in enumerate(loop.kernels):
            inside += syntax.block(syntax.choose.format(k=number), _kernel(printer, kernel, memory))
    return syntax.block(syntax.repeat.format(count=loop.count), inside)


def _kernel(printer: ListPrinter, kernel: Kernel, memory: str) -> list[str]:
    syntax, arguments = printer.syntax, []
    for window, array in zip(kernel.reads, kernel.program.inputs, strict=True):
        place, name = _place(printer, window.first), f"{memory}[{window.array}]"
        part = syntax.part.format(name=name, first=place, end=f"{place} + {array.size}")
        arguments.append(part if array.shape else f"{name}[{place}]")
    called = wrap_items(f"{printer.every.names[id(kernel.program)]}(", arguments, ")", indent=" " * 12)
    lines = [printer.defined("results", called)]
    for k, (window, output) in enumerate(zip(kernel.writes, kernel.program.outputs, strict=True)):
        values = f"results[{k}]" if output.shape else f"[results[{k}]]"
        put = "+=" if window.adds else "="
        place, name = _place(printer, window.first), f"{memory}[{window.array}]"
        lines += syntax.add_each.format(values=values, first=place, name=name, put=put).splitlines()
    return lines


def _place(printer: ListPrinter, given: Progression) -> str:
    """Return the expression of number k of a progression."""
    pattern, step = given.pattern, given.step
    if len(pattern) == 1:
        return f"{pattern[0]} + {step}*k" if step else f"{pattern[0]}"
    return printer.syntax.progression.format(pattern=list(pattern), count=len(pattern), step=step)


def reserved_names(words: Iterable[str], functions: Collection[str]) -> frozenset[str]:
    """Return the names that no argument may have: words of a language, and functions that printed code calls."""
    return frozenset([*words, *functions, "k", "i", "x", "kernel", "results"])


def _functions_text(
    every: Functions, syntax: Syntax, between: str, names: Mapping[str, str], choice: str, truth: str
) -> str:
    """Return the definitions of all functions, and of their tables."""
    tables = Tables(syntax)
    language = Language(functions=names, choice=choice, power="power({x}, {n})", truth=truth, table=tables.text)
    printed = [ListPrinter(function, every, language, syntax).text() for function in every.functions]
    return between.join([*tables.texts, *printed])


def _stored(programs: Mapping[str, Program], samples: Samples, pair: str) -> str:
    """Return the entries of a map from names of Programs to pairs of inputs and results."""
    lines = []
    for name, program in programs.items():
        lines.append(f'    "{name}": [')
        for sample in samples.get(name, ()):
            inputs = [np.asarray(values, dtype=float) for values in sample]
            both = inputs, interpret(program, *inputs)
            values = ([x.ravel().tolist() if x.ndim else float(x) for x in part] for part in both)
            lines.append(f"        {pair.format(*values)},")
        lines.append("    ],")
    return "\n".join(lines)


# ----------------------------------------------------------------------------------------------------------------------
# Python.


_PYTHON_FUNCTIONS: Final = (
    "abs acos acosh asin asinh atan atan2 atanh cos cosh divide exp inf log max min nan on_lines on_spline power "
    "real_power sign sin sinh solve_lists solve_some sqrt tan tanh to_knot"
)
_PYTHON: Final = Syntax(
    function="def {name}",
    opens=":",
    closes="",
    ends="",
    define="{name} = {value}",
    returned=("return (", ")"),
    spread="*{list}",
    part="{name}[{first}:{end}]",
    zeros="[0.0] * {size}",
    append="{name}.append({value})",
    repeat="for k in range({count})",
    skip_where_zero="if {x} == 0.0",
    choose="if kernel == {k}",
    add_each="for i, x in enumerate({values}, {first}):\n    {name}[i] {put} x",
    progression="{pattern}[k % {count}] + {step}*(k // {count})",
    sparse=("{", "{k}: {x}", "}"),
    table=("{name} = (", ")"),
    comment="#",
    reserved=reserved_names(keyword.kwlist, _PYTHON_FUNCTIONS.split()),
)
_IMPORTED: Final = """\
from math import asinh, atan, atan2, inf, nan, tanh

from multibody_sym.scalars.floats import (
    acos, acosh, asin, atanh, cos, cosh, divide, exp, log, on_lines, on_spline, power, sign, sin, sinh, sqrt, tan,
    to_knot,
)
from multibody_sym.scalars.floats import pow as real_power
from multibody_sym.scalars.least_norm import solve_lists, solve_some"""
_OWN: Final = """\
from __future__ import annotations

from dataclasses import dataclass

{own}


from math import asinh, atan, atan2, inf, nan, tanh

real_power = pow"""
_NEEDED: Final = "\nNothing is needed beside this file but NumPy."
_FUTURE: Final = "from __future__ import annotations\n"
_PACKAGE: Final = "from multibody_sym."
OWN_ARITHMETIC: Final = (arrays, floats, rank, least_norm)
"""The modules whose text stands in exported Python."""


def python_source(programs: Mapping[str, Program], *, samples: Samples | None = None, alone: bool = False) -> str:
    """Return a module with a function `mbs_<name>` for each program, and all of them by name in `PROGRAMS`.

    It imports this package's arithmetic and solve, or holds their text where it is to stand `alone`, with nothing but
    NumPy beside it. With `samples` it tests itself when it is run. The same Programs give the same text in every
    process.
    Raises ProgramError where there is no program, or a name is none.
    """
    every = functions(programs)
    exported = list(zip(programs, every.exported, strict=True))
    names = {"div": "divide", "pow": "real_power"}
    text = fill_template(
        "python/model.py.in",
        title=TITLE,
        note=_NEEDED if alone else "",
        arithmetic=_own_arithmetic() if alone else _IMPORTED,
        summary="\n".join(line for name, f in exported for line in summary(name, f.program)),
        functions=_functions_text(every, _PYTHON, "\n\n\n", names, "({yes} if {condition} else {no})", "{x}"),
        table="\n".join(f'    "{name}": {f.name},' for name, f in exported),
    )
    if samples is None:
        return text
    stored = _stored(programs, samples, "({}, {})")
    return text + fill_template("python/selftest.py.in", tolerance=repr(TOLERANCE), stored=stored)


def _own_arithmetic() -> str:
    """Return the text of this package's arithmetic and solve, without the words at their heads."""
    texts = [Path(str(module.__file__)).read_text(encoding="ascii") for module in OWN_ARITHMETIC]
    bodies = [text.partition(_FUTURE)[2].splitlines() for text in texts]
    own = ["\n".join(line for line in body if not line.startswith(_PACKAGE)).strip() for body in bodies]
    return _OWN.format(own="\n\n\n".join(own))


# ----------------------------------------------------------------------------------------------------------------------
# JavaScript.


_JAVASCRIPT_WORDS: Final = (
    "arguments await break case catch class const continue debugger default delete do else enum eval export extends "
    "false finally for function if implements import in instanceof interface let new null package private protected "
    "public return static super switch this throw true try typeof var void while with yield"
)
_JAVASCRIPT_FUNCTIONS: Final = (
    "abs acos acosh asin asinh atan atan2 atanh copysign cos cosh dot exp inf log max min nan on_lines on_spline power "
    "real_power sign sin sinh solve_lists sqrt subtract tan tanh to_knot zeros"
)
_JAVASCRIPT: Final = Syntax(
    function="function {name}",
    opens=" {",
    closes="}",
    ends=";",
    define="const {name} = {value}",
    returned=("return [", "]"),
    spread="...{list}",
    part="{name}.slice({first}, {end})",
    zeros="zeros({size})",
    append="{name}.push({value})",
    repeat="for (let k = 0; k < {count}; k++)",
    skip_where_zero="if ({x} === 0.0)",
    choose="if (kernel === {k})",
    add_each="{values}.forEach((x, i) => {{\n    {name}[{first} + i] {put} x;\n}});",
    progression="{pattern}[k % {count}] + {step}*Math.floor(k / {count})",
    sparse=("", "", ""),
    table=("const {name} = [", "];"),
    comment="//",
    reserved=reserved_names(_JAVASCRIPT_WORDS.split(), _JAVASCRIPT_FUNCTIONS.split()),
)


def javascript_source(programs: Mapping[str, Program], samples: Samples) -> dict[str, str]:
    """Return model.mjs, with a function for each program by its name in `PROGRAMS`, selftest.mjs, and integrate.mjs.

    The last one simulates the model. The same Programs give the same text in every process. Raises ProgramError where
    there is no program, a name is none, and for solves of which some rows act, as in Programs of all modes.
    """
    every = functions(programs)
    solves = (s for f in every.functions for s in f.program.statements if isinstance(s, Solve))
    if any(solve.acting for solve in solves):
        raise ProgramError("JavaScript has no solve of which some rows act")
    exported, names = list(zip(programs, every.exported, strict=True)), {"pow": "real_power"}
    model = fill_template(
        "javascript/model.mjs.in",
        title=TITLE,
        summary="\n".join(f" * {line}" for name, f in exported for line in summary(name, f.program)),
        functions=_functions_text(every, _JAVASCRIPT, "\n\n", names, "({condition} ? {yes} : {no})", "({x}) !== 0.0"),
        table="\n".join(f"    {name}: {f.name}," for name, f in exported),
    )
    stored = _stored(programs, samples, "[{}, {}]")
    test = fill_template("javascript/selftest.mjs.in", tolerance=repr(TOLERANCE), stored=stored)
    return {"model.mjs": model, "selftest.mjs": test, "integrate.mjs": template_text("javascript/integrate.mjs")}
