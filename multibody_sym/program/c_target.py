"""The C target: Programs as C99 that allocates nothing, keeps no state and agrees with the interpreter to the bit."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import field
from itertools import accumulate, repeat
from types import MappingProxyType
from typing import Final

from multibody_sym.program.program import Language, Program, expression
from multibody_sym.program.statements import (
    Array,
    Assign,
    Call,
    Callee,
    Kernel,
    Loop,
    Output,
    Progression,
    Scan,
    Solve,
    Statement,
    accesses,
)
from multibody_sym.program.target_layout import (
    EXPORTED_PARTS,
    NUMBERS_FILE,
    RUNTIME_HEADERS,
    SHORTEST_RUN,
    TABLE_FUNCTIONS,
    TITLE,
    TOLERANCE,
    Function,
    Functions,
    NumbersApart,
    NumbersInText,
    Places,
    Samples,
    fill_template,
    functions,
    parameters,
    runs,
    runtime_files,
    runtime_sources,
    stored_numbers,
    strides,
    summary,
    wrap_items,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.least_norm import Span
from multibody_sym.scalars.node import ZERO, Node

# ----------------------------------------------------------------------------------------------------------------------
# One function of a generated C file: its pieces, the names that values have in them, where arrays stand.


_LONGEST: Final = 400
"""Operations after which a new C function begins: compilers take more than twice the time for twice the length."""
_LONGEST_WITH_LOOPS: Final = 16 * _LONGEST
"""The same where loops fill arrays, which pieces would hand on element by element, and in what loops inline."""
_LONG: Final = 20_000
"""Operations in the text of a function from which on its pieces are short, though it has loops: derivatives of Talos
compile in 26 s in place of 56."""
_GATHERED: Final = 64
"""Elements from which on an array of values that stand in others is filled by a loop."""
_STRIDES: Final = 16
"""Loops with equal distances that together write elements of an output at most; beyond them a table is read."""
_LONGEST_PERIOD: Final = 8
"""Elements after which the places of such elements move by equal distances at most."""
_UNROLLED: Final = 64
"""Elements of vectors that an elimination reads, about half of its products, up to which its loops are unrolled."""
_WORDS: Final = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
acos acosh asin asinh atan atanh cos cosh exp fabs log pow sin sinh sqrt tan tanh
"""
RESERVED: Final = frozenset([*_WORDS.split(), "w"])
_OWN_FUNCTIONS: Final = {"min": "minimum", "max": "maximum", "sign": "sign"}


def head_of(function: Function) -> str:
    """Return the head of a function's definition or declaration."""
    inputs, outputs = parameters(function.program, RESERVED)
    kind = "void" if function.exported else "MBS_INLINE void" if function.inlined else "static void"
    return _signature(function.name, [*_declarations(function.program, inputs, outputs).values()], kind)


def _signature(name: str, declarations: Sequence[str], kind: str) -> str:
    return wrap_items(f"{kind} {name}(", declarations or ["void"], ")", indent=" " * (len(kind) + len(name) + 2))


def _declarations(program: Callee, inputs: Sequence[str], outputs: Sequence[str]) -> dict[str, str]:
    """Return the declaration of each parameter by its identifier."""
    declared = {}
    for name, array in zip(inputs, program.inputs, strict=True):
        declared[name] = f"const double *{name}" if array.shape else f"double {name}"
    return declared | {name: f"double *{name}" for name in outputs}


@dataclass
class _Piece:
    """The inside of one C function: values loaded from the work space, statements, values stored there.

    `used` holds the identifiers of the parameters it needs, `size` is the number of operations and copies.
    """

    loads: list[str] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    stores: list[str] = field(default_factory=list)
    used: set[str] = field(default_factory=set)
    size: int = 0


class _Names(dict[Node, str]):
    """The text of what the current piece has used already; the printer is asked for the rest."""

    def __init__(self, text: Callable[[Node], str]) -> None:
        super().__init__()
        self.text = text

    def __missing__(self, node: Node) -> str:
        text = self.text(node)
        return text if node.shadow is not None else self.setdefault(node, text)


class Printer:
    """Prints one Program with its `constants`; a long one as static functions that share a work space w."""

    def __init__(self, function: Function, every: Functions, constants: NumbersInText | NumbersApart) -> None:
        self.function = function
        self.every = every
        self.constants = constants
        self.language = Language(
            functions={"abs": "fabs"} | {op: f"mbs__{name}" for op, name in _OWN_FUNCTIONS.items()},
            choice="({condition} ? {yes} : {no})",
            power="mbs__power({x}, {n})",
            truth="{x} != 0.0",
            table=lambda f, order, x: (
                f"mbs__{TABLE_FUNCTIONS[f.kind]}({constants.table(f)}, {len(f.columns[0])}, {order}, {x})"
            ),
        )
        program = function.program
        self.inputs, self.outputs = parameters(program, RESERVED)
        self.leaves: dict[Node, tuple[str, str]] = {}
        self.given: Places = {}
        for name, array in zip(self.inputs, program.inputs, strict=True):
            if array.shape:
                self.given |= {leaf: (name, k) for k, leaf in enumerate(array.slots)}
            self.leaves |= {leaf: (name, f"{name}[{k}]" if array.shape else name) for k, leaf in enumerate(array.slots)}
        self.wanted: Places = {}  # where values go in the outputs: to the first of several places
        for name, output in zip(self.outputs, program.outputs, strict=True):
            for k, value in enumerate(output.values if output.shape else ()):
                self.wanted.setdefault(value, (name, k))
        self.written: set[tuple[str, int]] = set()
        self.origins: dict[Node, tuple[_Piece, str]] = {}
        self.kept: dict[Node, int] = {}
        self.records = 0
        self.factors: dict[tuple[object, ...], str] = {}
        self.patterns: dict[str, tuple[Sequence[Span], int]] = {}
        self.masked: dict[str, tuple[list[tuple[tuple[int, ...], ...]], int]] = {}
        self.pieces: list[_Piece] = []
        loops = function.inlined or any(isinstance(x, Scan) for x in program.statements)
        size = sum(len(x.nodes) for x in program.statements if isinstance(x, Assign))
        self.longest = _LONGEST_WITH_LOOPS if loops and size < _LONG else _LONGEST
        self._cut()

    def text(self, write: Callable[[Printer, Statement], None]) -> str:
        """Return the definition of the function and of those that hold its pieces; `write` adds a statement."""
        program = self.function.program
        for statement in program.statements:
            if self.piece.size >= self.longest:
                self._cut()
            write(self, statement)
        for name, output in zip(self.outputs, program.outputs, strict=True):
            self._output(name, output)
        declared = _declarations(program, self.inputs, self.outputs)
        used = set().union(*(piece.used for piece in self.pieces))
        body = [f"    (void){name};" for name in declared if name not in used]
        patterns = list[str]()
        for name, (spans, columns) in self.patterns.items():
            body.append(f"    double {name}[MBS_FACTORS({len(spans)}, {columns})];")
            declared[name] = f"double *{name}"
            patterns.append(_pattern(f"{self.function.name}__{name}", spans, columns))
        for name, (matrices, columns) in self.masked.items():
            count, size = len(matrices[0]), "RUBBING" if len(matrices) > 1 else "ACTING"
            elements = sum(len(row) for rows in matrices for row in rows)
            room = {
                name: ("double ", f"MBS_{size}_FACTORS({count}, {columns})"),
                f"{name}_spans": ("mbs_span ", f"MBS_PLACES({count}, {columns})"),
                f"{name}_kept": ("int ", f"MBS_KEPT({count}, {columns}, {elements})"),
            }
            body.append("    MBS_SCRATCH struct {")
            body += [f"        {kind}{part}[{length}];" for part, (kind, length) in room.items()]
            body.append(f"    }} of_{name} = {{.{name}_kept = {{0}}}};")
            body += [f"    {kind}*{part} = of_{name}.{part};" for part, (kind, _) in room.items()]
            declared |= {part: f"{kind}*{part}" for part, (kind, _) in room.items()}
            own = f"{self.function.name}__{name}"
            patterns.append(_rows(f"{own}_joins", _joins(matrices), columns))
            kinds = zip((own, f"{own}_exerted"), matrices, strict=False)
            patterns += [_rows(kind, rows, columns, f"&{own}_joins") for kind, rows in kinds]
        head = f"{head_of(self.function)}\n{{"
        if len(self.pieces) == 1:
            return "\n".join([*patterns, head, *body, *self.piece.lines, "}"])
        names = [f"{self.function.name}__{k}" for k in range(1, len(self.pieces) + 1)]
        if self.kept:
            body.append(f"    double w[{len(self.kept)}];")
            declared["w"] = "double *w"
        parts = []
        for name, piece in zip(names, self.pieces, strict=True):
            signature = _signature(name, [text for d, text in declared.items() if d in piece.used], "static void")
            parts.append("\n".join([signature, "{", *piece.loads, *piece.lines, *piece.stores, "}", ""]))
            body.append(wrap_items(f"    {name}(", [d for d in declared if d in piece.used], ");", indent=" " * 8))
        return "\n".join([*patterns, *parts, head, *body, "}"])

    def _cut(self) -> None:
        if self.pieces:
            self._hand_out()
        self.piece = _Piece()
        self.pieces.append(self.piece)
        self.names = _Names(self._fetch)
        self.places = dict(self.given)

    def _hand_out(self) -> None:
        """Copy what fills arrays of this piece to outputs: pieces behind it would be handed it element by element."""
        for name, output in zip(self.outputs, self.function.program.outputs, strict=True):
            for start, end in runs(output.values, self.places):
                source = self.places.get(output.values[start])
                if self._is_written(name, start, end):
                    continue
                if end - start >= SHORTEST_RUN and source and source[0] not in self.inputs:
                    self._copy(name, start, end - start, source)
                    self.written |= {(name, k) for k in range(start, end)}

    def _fetch(self, node: Node) -> str:
        """Return the text of a constant, an input, or a value of an earlier piece: passed on in the work space."""
        if node.shadow is not None:
            return self.constants.named(node.shadow)
        if node in self.leaves:
            name, text = self.leaves[node]
            self.piece.used.add(name)
            return text
        origin, text = self.origins[node]
        if node not in self.kept:
            self.kept[node] = len(self.kept)
            origin.stores.append(f"    w[{self.kept[node]}] = {text};")
            origin.used.add("w")
        name = text if text.isidentifier() else f"w{self.kept[node]}"
        self.piece.loads.append(f"    const double {name} = w[{self.kept[node]}];")
        self.piece.used.add("w")
        return name

    def define(self, node: Node, text: str) -> None:
        """From here on `node` is called `text` in this piece."""
        self.names[node] = text
        self.origins[node] = (self.piece, text)

    def array(self, name: str, atoms: Sequence[Node]) -> str:
        """Return the declaration of a constant array; C has none of size zero."""
        gathered = self._gathered(name, atoms)
        if gathered:
            return gathered
        self.piece.size += len(atoms)
        texts = [self.names[atom] for atom in atoms] or ["0.0"]
        return wrap_items(f"        const double {name}[{len(texts)}] = {{", texts, "};", indent=" " * 12)

    def _gathered(self, name: str, atoms: Sequence[Node]) -> str:
        """Return loops that fill an array from those where its elements stand; empty for what is soon written out."""
        sources: dict[str, list[tuple[int, int]]] = {}
        for k, atom in enumerate(atoms):
            if atom in self.places:
                source, place = self.places[atom]
                sources.setdefault(source, []).append((k, place))
        others = [k for k, atom in enumerate(atoms) if atom not in self.places and atom is not ZERO]
        if len(atoms) < _GATHERED or not sources or len(others) > len(atoms) // 4:
            return ""
        lines = [f"        double {name}[{len(atoms)}] = {{0.0}};"]
        lines += [f"        {name}[{k}] = {self.names[atoms[k]]};" for k in others]
        for source, pairs in sources.items():
            self._use(source)
            table = f"of_{name}_{source}"
            lines.append(_table(f"static const int {table}", [str(x) for pair in pairs for x in pair]))
            lines += [
                f"        for (int k = 0; k < {len(pairs)}; k++)",
                f"            {name}[{table}[2 * k]] = {source}[{table}[2 * k + 1]];",
            ]
        self.piece.size += len(others) + 2 * len(sources)
        return "\n".join(lines)

    def pointer(self, name: str, atoms: Sequence[Node]) -> tuple[str, str]:
        """Return an expression for the address of `atoms`, and the declaration of array `name` where it needs one."""
        numbers = [atom.shadow for atom in atoms]
        if len(atoms) >= _GATHERED and None not in numbers:
            return self.constants.array([x for x in numbers if x is not None]), ""
        if next(runs(atoms, self.places), None) == (0, len(atoms)) and atoms[0] in self.places:
            whole, first = self.places[atoms[0]]
            self._use(whole)
            return (f"{whole} + {first}" if first else whole), ""
        return name, self.array(name, atoms)

    def _use(self, name: str) -> None:
        if name in self.inputs:
            self.piece.used.add(name)

    def targets(self, name: str, leaves: Sequence[Node], storage: str = "") -> None:
        """Declare the array that a call, solve or scan fills: what is part of an output stands there at once.

        Not in functions that others may call, with one array for what is given and what is found.
        """
        there = self.wanted.get(leaves[0]) if leaves and not self.function.exported else None
        if there and next(runs(leaves, self.wanted)) == (0, len(leaves)) and len(leaves) >= SHORTEST_RUN:
            output, first = there
            self.piece.used.add(output)
            self.written |= {(output, k) for k in range(first, first + len(leaves))}
            self.piece.lines.append(f"    double *{name} = {output}{f' + {first}' if first else ''};")
        else:
            self.piece.lines.append(f"    {storage}double {name}[{max(1, len(leaves))}];")
        texts = [f"{name}[{k}]" for k in range(len(leaves))]
        self.names.update(zip(leaves, texts, strict=True))
        self.origins.update(zip(leaves, zip(repeat(self.piece), texts), strict=True))
        self.places.update(zip(leaves, zip(repeat(name), range(len(leaves))), strict=True))

    def _is_written(self, name: str, start: int, end: int) -> bool:
        """Return whether some elements of an output stand there already."""
        return all((name, k) in self.written for k in range(start, end))

    def record(self) -> str:
        """Return a number for the local arrays of a call or solve."""
        self.records += 1
        return str(self.records)

    def variant(self, factors: str) -> str:
        """Return the ending of the functions that eliminate a matrix of this pattern."""
        if factors in self.masked:
            return "_acting"
        spans = self.patterns[factors][0]
        read = sum((span.high - span.low) * (j - span.low + 1) for j, span in enumerate(spans))
        return "_unrolled" if read <= _UNROLLED else ""

    def _output(self, name: str, output: Output) -> None:
        values = output.values
        parts = list(runs(values, self.places))
        short = (part for part in parts if part[1] - part[0] < SHORTEST_RUN)
        self._scatter(name, values, [k for part in short for k in range(*part)])
        for start, end in parts:
            if self._is_written(name, start, end):
                continue
            if end - start >= SHORTEST_RUN and values[start] in self.places:
                self._copy(name, start, end - start, self.places[values[start]])
                continue
            if end - start >= SHORTEST_RUN:
                self._fill(name, start, end - start, self.names[values[start]])
                continue
            for k in range(start, end):
                if (name, k) in self.written:
                    continue
                if self.piece.size >= self.longest:
                    self._cut()
                self.piece.size += 1
                place = f"{name}[{k}]" if output.shape else f"*{name}"
                self.piece.lines.append(f"    {place} = {self.names[values[k]]};")
                self.piece.used.add(name)

    def _scatter(self, name: str, values: Sequence[Node], elements: Sequence[int]) -> None:
        """Write elements of an output that are numbers, or stand in arrays, by loops; unless they are few."""
        sources: dict[str, list[int]] = {}
        for k in elements:
            if values[k] in self.places and (name, k) not in self.written:
                sources.setdefault(self.places[values[k]][0], []).append(k)
            elif values[k].shadow is not None:
                sources.setdefault("zeros" if values[k] is ZERO else "", []).append(k)
        blank = len(sources.get("zeros", ())) >= _GATHERED and not any(written == name for written, _ in self.written)
        if blank:
            self._fill(name, 0, len(values), self.names[ZERO])
            self.written |= {(name, k) for k in sources["zeros"]}
        for source, found in sources.items():
            if len(found) >= _GATHERED and source != "zeros":
                self._spread_out(name, source, found, values)

    def _spread_out(self, name: str, source: str, found: Sequence[int], values: Sequence[Node]) -> None:
        """Write elements of an output that stand in an array, or are numbers (no array)."""
        origins = [self.places[values[k]][1] for k in found] if source else []
        strided, lines = _strided_loops(found, origins) if source else [], list[str]()
        if strided:
            self._use(source)
            for count, to, at in strided:
                head = f"    for (int k = 0; k < {count}; k++)\n        " if count > 1 else "    "
                lines.append(f"{head}{name}[{_element_index(*to)}] = {source}[{_element_index(*at)}];")
        else:
            lines = self._by_table(name, source, found, origins or [self.names[values[k]] for k in found])
        self.piece.size += len(strided) or 1
        self.piece.used.add(name)
        self.piece.lines += lines
        self.written |= {(name, k) for k in found}

    def _by_table(self, name: str, source: str, found: Sequence[int], origins: Sequence[int | str]) -> list[str]:
        self._use(source)
        at, to = f"of_{name}_{source}", f"to_{name}_{source}"
        read = f"{source}[{at}[k]]" if source else f"{at}[k]"
        return [
            "    {",
            _table(f"{'static const int' if source else 'const double'} {at}", list(map(str, origins))),
            _table(f"static const int {to}", list(map(str, found))),
            f"        for (int k = 0; k < {len(found)}; k++)",
            f"            {name}[{to}[k]] = {read};",
            "    }",
        ]

    def _copy(self, name: str, start: int, count: int, source: tuple[str, int]) -> None:
        """Copy consecutive elements of an array to an output."""
        self.piece.size += 1
        self.piece.used.add(name)
        self._use(source[0])
        to, origin = (_element_index(i) for i in (start, source[1]))
        self.piece.lines += [f"    for (int k = 0; k < {count}; k++)", f"        {name}[{to}] = {source[0]}[{origin}];"]

    def _fill(self, name: str, start: int, count: int, text: str) -> None:
        """Write the same number to consecutive elements of an output."""
        self.piece.size += 1
        self.piece.used.add(name)
        element = f"{name}[{_element_index(start)}]"
        self.piece.lines += [f"    for (int k = 0; k < {count}; k++)", f"        {element} = {text};"]

    def spread(self, source: str, leaves: Sequence[Node]) -> None:
        """Write what a call has found down a column of a matrix at once, not element by element at the end."""
        for start, end, step in strides(leaves, self.wanted):
            name, first = self.wanted[leaves[start]]
            to, origin = _element_index(first, step), _element_index(start)
            self.piece.size += 1
            self.piece.used.add(name)
            self.piece.lines += [
                f"    for (int k = 0; k < {end - start}; k++)",
                f"        {name}[{to}] = {source}[{origin}];",
            ]
            self.written |= {(name, first + k * step) for k in range(end - start)}


def _table(declared: str, elements: Sequence[str]) -> str:
    """Return the declaration of an array of numbers."""
    return wrap_items(f"        {declared}[] = {{", elements, "};", indent=" " * 12)


def _strided_loops(to: Sequence[int], at: Sequence[int]) -> list[tuple[int, tuple[int, int], tuple[int, int]]]:
    """Return loops over pairs of places: how many, first and step of both; none where it takes more than a few."""
    loops: list[tuple[int, tuple[int, int], tuple[int, int]]] = []
    start = 0
    while start < len(to) and len(loops) <= _STRIDES:
        end, period = max((_regular(to, at, start, p), -p) for p in range(1, _LONGEST_PERIOD + 1))
        if end - start < -4 * period:
            end, period = start + 1, -1
        for j in range(start, min(start - period, end)):
            count, later = len(range(j, end, -period)), min(j - period, end - 1)
            loops.append((count, (to[j], to[later] - to[j]), (at[j], at[later] - at[j])))
        start = end
    return loops if len(loops) <= _STRIDES else []


def _regular(to: Sequence[int], at: Sequence[int], start: int, period: int) -> int:
    """Return up to where places move by equal distances in each period."""
    end = start + period
    if end >= len(to):
        return start + 1
    steps = to[end] - to[start], at[end] - at[start]
    while end < len(to) and (to[end] - to[end - period], at[end] - at[end - period]) == steps:
        end += 1
    return end


def _element_index(first: int, step: int = 1) -> str:
    """Return the index of element k."""
    moved = "k" if step == 1 else f"{step}*k"
    if step == 0:
        return str(first)
    return f"{first} + {moved}" if first else moved


def _rows(name: str, rows: Sequence[Sequence[int]], columns: int, joins: str = "0") -> str:
    """Return the constant that says in which columns the elements of each row of a matrix stand."""
    begins = list(map(str, accumulate(map(len, rows), initial=0)))
    places = [str(k) for row in rows for k in row] or ["0"]
    parts = ("begins", begins), ("places", places)
    tables = [wrap_items(f"static const int {name}_{part}[] = {{", texts, "};") for part, texts in parts]
    whole = f"static const mbs_rows {name} = {{{len(rows)}, {columns}, {name}_begins, {name}_places, {joins}}};\n"
    return "\n".join([*tables, whole])


def _joins(matrices: Sequence[Sequence[Sequence[int]]]) -> list[list[int]]:
    """Return the columns of each row in all matrices, of those that rows only have together the first."""
    rows_of: dict[int, list[int]] = {}
    for j, parts in enumerate(zip(*matrices, strict=True)):
        for k in set().union(*parts):
            rows_of.setdefault(k, []).append(j)
    found: list[list[int]] = [[] for _ in matrices[0]]
    for rows, k in {tuple(rows): k for k, rows in sorted(rows_of.items(), reverse=True)}.items():
        for j in rows:
            found[j].append(k)
    return found


def _pattern(name: str, spans: Sequence[Span], columns: int) -> str:
    """Return the constant that says where a matrix may differ from zero."""
    rows = [f"{{{span.first}, {span.end}, {span.low}, {span.high}}}" for span in spans] or ["{0, 0, 0, 0}"]
    table = wrap_items(f"static const mbs_span {name}_spans[] = {{", rows, "};")
    return f"{table}\nstatic const mbs_pattern {name} = {{{len(spans)}, {columns}, {name}_spans}};\n"


# ----------------------------------------------------------------------------------------------------------------------
# The statements of a Program as lines of C.


_ON_STACK: Final = 4096
"""Numbers of an array of a scan up to which it lies on the stack: 32 KiB."""


def write(printer: Printer, statement: Statement) -> None:
    """Add a statement to the function that a printer writes."""
    if isinstance(statement, Assign):
        text = expression(statement.nodes, printer.names, printer.language)
        name = f"z{len(printer.origins)}"
        printer.piece.lines.append(f"    const double {name} = {text};")
        printer.piece.size += len(statement.nodes)
        printer.define(statement.value, name)
    elif isinstance(statement, Call):
        _call(printer, statement)
    elif isinstance(statement, Solve):
        _solve(printer, statement)
    else:
        _scan(printer, statement)


def _call(printer: Printer, statement: Call) -> None:
    number, callee, lines = printer.record(), statement.program, printer.piece.lines
    arguments, arrays = [], []
    for k, (array, atoms) in enumerate(zip(callee.inputs, statement.arguments, strict=True)):
        if not array.shape:
            arguments.append(printer.names[atoms[0]])
        else:
            address, declared = printer.pointer(f"a{number}_{k}", atoms)
            arguments.append(address)
            arrays += [declared] if declared else []
    for k, leaves in enumerate(statement.targets):
        printer.targets(f"r{number}_{k}", leaves)
        arguments.append(f"r{number}_{k}")
    name = printer.every.names[id(callee)]
    lines += ["    {", *arrays, wrap_items(f"        {name}(", arguments, ");", indent=" " * 12), "    }"]
    for k, leaves in enumerate(statement.targets):
        printer.spread(f"r{number}_{k}", leaves)


def _solve(printer: Printer, statement: Solve) -> None:
    """Factorise the matrix, unless an earlier solve has, and substitute."""
    number, columns = printer.record(), len(statement.solution)
    known = statement.matrix, columns, statement.most, statement.acting, statement.exerted
    if known not in printer.factors:
        printer.factors[known] = f"f{number}"
        _factorise(printer, statement, f"f{number}")
    factors = printer.factors[known]
    solver = f"mbs_substitute{printer.variant(factors)}"
    right, declared = printer.pointer("right", statement.right)
    solution = [statement.solution[k] for k in statement.order]
    for k, leaves in enumerate((solution, statement.multipliers, statement.report)):
        printer.targets(f"r{number}_{k}", leaves)
    room = [f"{factors}_spans", f"{factors}_kept"] if statement.acting else []
    given = [f"&{printer.function.name}__{factors}", factors, *room, right, *(f"r{number}_{k}" for k in range(3))]
    printer.piece.used |= {factors, *room}
    called = wrap_items(f"        {solver}(", given, ");", indent=" " * 12)
    printer.piece.lines += ["    {", *([declared] if declared else []), called, "    }"]


def _factorise(printer: Printer, statement: Solve, factors: str) -> None:
    if statement.acting:
        _factorise_some(printer, statement, factors)
        return
    order, spans = statement.order, statement.spans
    rows = [[row[k] for k in order] for row in statement.matrix.lists(len(order))]
    printer.patterns[factors] = spans, len(order)
    inside = [x for row, span in zip(rows, spans, strict=True) for x in row[span.first : span.end]]
    matrix, name = printer.array("matrix", inside), f"{printer.function.name}__{factors}"
    given = [f"&{name}", "matrix", printer.names[statement.most], factors]
    printer.piece.used.add(factors)
    called = wrap_items(f"        mbs_factorise{printer.variant(factors)}(", given, ");", indent=" " * 12)
    printer.piece.lines += ["    {", matrix, called, "    }"]


def _factorise_some(printer: Printer, statement: Solve, factors: str) -> None:
    """Factorise a matrix of which some rows act, its elements one after the other as they stand in its rows."""
    matrices = [statement.matrix, *([statement.exerted] if statement.exerted else [])]
    printer.masked[factors] = [x.columns for x in matrices], len(statement.solution)
    given, declared = [], []
    for kind, name, rows in zip(("", "_exerted"), ("matrix", "exerted"), matrices, strict=False):
        pointer, array = printer.pointer(name, [x for row in rows.elements for x in row])
        given += [f"&{printer.function.name}__{factors}{kind}", pointer]
        declared += [array] if array else []
    given += [] if statement.exerted else ["0", "0"]
    acting, array = printer.pointer("acting", statement.acting)
    declared += [array] if array else []
    room = factors, f"{factors}_spans", f"{factors}_kept"
    given += [acting, printer.names[statement.most], *room]
    printer.piece.used |= {*room}
    called = wrap_items(f"        mbs_factorise{printer.variant(factors)}(", given, ");", indent=" " * 12)
    printer.piece.lines += ["    {", *declared, called, "    }"]


def _scan(printer: Printer, statement: Scan) -> None:
    number, lines = printer.record(), printer.piece.lines
    pointers = [printer.pointer(f"a{number}_{k}", atoms) for k, atoms in enumerate(statement.given)]
    names = [name for name, _ in pointers]
    kernels = [kernel for loop in statement.loops for kernel in loop.kernels]
    named = {window.array for kernel in kernels for window in (*kernel.reads, *kernel.writes)}
    for k, leaves in enumerate(statement.targets):
        names.append(f"r{number}_{k}")
        if leaves or len(names) - 1 in named:
            printer.targets(names[-1], leaves, _storage(len(leaves)))
    work = []
    for k, size in enumerate(statement.work):
        names.append(f"s{number}_{k}")
        work.append(f"        {_storage(size)}double {names[-1]}[{max(1, size)}];")
    tables: dict[Progression, str] = {}
    loops = [line for loop in statement.loops for line in _loop(printer, loop, names, tables)]
    zeros = [
        _zeros(name, size)
        for number, (name, size, use) in enumerate(zip(names, statement.sizes, accesses(statement), strict=True))
        if number >= len(pointers) and number - len(pointers) not in statement.unread
        and use.needs_zeros(number < len(pointers) + len(statement.targets))
    ]
    patterns = [
        wrap_items(f"        static const int {name}[] = {{", map(str, given.pattern), "};", indent=" " * 12)
        for given, name in tables.items()
    ]
    lines += ["    {", *(declared for _, declared in pointers if declared), *work, *patterns, *zeros, *loops, "    }"]


def _zeros(name: str, size: int) -> str:
    """Return what fills an array with zeros: a loop, of many a call."""
    if size >= _GATHERED:
        return f"        mbs_zeros({size}, {name});"
    return f"        for (int k = 0; k < {size}; k++)\n            {name}[k] = 0.0;"


def _storage(size: int) -> str:
    """Return where an array of a scan lies: on the stack, a large one in storage of the thread, which costs a call."""
    return "MBS_SCRATCH " if size > _ON_STACK else ""


def _loop(printer: Printer, loop: Loop, names: Sequence[str], tables: dict[Progression, str]) -> list[str]:
    lines = ["        MBS_SIDE_BY_SIDE"] if loop.side_by_side else []
    lines.append(f"        for (int k = 0; k < {loop.count}; k++) {{")
    if loop.gate is not None:
        closed = f"({names[loop.gate.array]})[{_place(loop.gate.first, tables, loop.count)}] == 0.0"
        lines += [f"            if ({closed}) {{", "                continue;", "            }"]
    if len(loop.kernels) == 1:
        return [*lines, *_kernel(printer, loop.kernels[0], names, tables, loop.count), "        }"]
    lines += [f"            switch ({_place(loop.choice, tables, loop.count)}) {{"]
    for k, kernel in enumerate(loop.kernels):
        inside = _kernel(printer, kernel, names, tables, loop.count)
        lines += [f"            case {k}: {{", *inside, "                break;", "            }"]
    return [*lines, "            }", "        }"]


def _kernel(
    printer: Printer, kernel: Kernel, names: Sequence[str], tables: dict[Progression, str], count: int
) -> list[str]:
    declared, arguments, added = [], [], []
    for window, array in zip(kernel.reads, kernel.program.inputs, strict=True):
        place = _place(window.first, tables, count)
        name = names[window.array]
        arguments.append(f"{name} + {place}" if array.shape else f"({name})[{place}]")
    for k, (window, output) in enumerate(zip(kernel.writes, kernel.program.outputs, strict=True)):
        target, size = f"{names[window.array]} + {_place(window.first, tables, count)}", len(output.values)
        if window.adds:
            declared.append(f"                double d{k}[{max(1, size)}];")
            added.append(f"                for (int i = 0; i < {size}; i++)")
            added.append(f"                    ({target})[i] += d{k}[i];")
        arguments.append(f"d{k}" if window.adds else target)
    called = f"                {printer.every.names[id(kernel.program)]}("
    return [*declared, wrap_items(called, arguments, ");", indent=" " * 20), *added]


def _place(given: Progression, tables: dict[Progression, str], count: int) -> str:
    """Return the expression of number k < count of a progression; one that is not arithmetic reads a table."""
    pattern, step = given.pattern, given.step
    if len(pattern) == 1:
        steps = {0: "", 1: "k"}.get(step, f"{step}*k")
        first = str(pattern[0]) if pattern[0] or not steps else ""
        return f"{first} + {steps}" if first and steps else first + steps
    table = tables.setdefault(given, f"p{len(tables)}")
    if len(pattern) >= count:
        return f"{table}[k]"
    periods = f" + {step}*(k / {len(pattern)})" if step else ""
    return f"{table}[k % {len(pattern)}]{periods}"


# ----------------------------------------------------------------------------------------------------------------------

_AS_WRITTEN: Final = '#pragma GCC push_options\n#pragma GCC optimize ("O0")'
_OWN_NAMES: Final = ("mbs_programs", "mbs_program_count", "mbs_numbers", "mbs_number_count", "mbs__numbers")
_AS_BEFORE: Final = "#pragma GCC pop_options"


def c_source(
    programs: Mapping[str, Program],
    *,
    samples: Samples | None = None,
    rare: Mapping[str, Program] = MappingProxyType({}),
    parts: Collection[str] = EXPORTED_PARTS,
    apart: bool = False,
) -> dict[str, str]:
    """Return model.c, model.h and the runtime's files for its `parts` by name, and selftest.c for given `samples`.

    With the numbers `apart` these are in a file of their own, and all else is the same for other numbers.

    Each program becomes the function `mbs_<name>`; `mbs_programs` lists them all under one type. Those that
    are `rare` come last: they are called so seldom that the compiler's work on them takes longer than it saves.
    The same Programs give the same bytes in every process.
    Raises ProgramError where there is no program, or a name is none.
    """
    files = runtime_files(parts)
    used = {name for header in RUNTIME_HEADERS for name in re.findall(r"\bmbs_\w+", files[header])}
    taken = [*_OWN_NAMES, *sorted(used)]
    every = functions({**programs, **rare}, taken)
    often = len(functions(programs, taken).functions) if rare else None
    numbers = NumbersApart() if apart else None
    model = _model(every, [*programs, *rare], often, runtime_sources(parts), numbers)
    files |= {"model.c": model, "model.h": _header(every)}
    if numbers is not None:
        files[NUMBERS_FILE] = numbers.file
    if samples is not None:
        files["selftest.c"] = _selftest(programs, samples)
    return files


def _model(
    every: Functions,
    names: Sequence[str],
    often: int | None,
    runtime: Sequence[str],
    numbers: NumbersApart | None,
) -> str:
    """Return model.c; from function number `often` on the compiler does not work on its code."""
    exported = list(zip(names, every.exported, strict=True))
    table = [
        f'    {{"{name}", {len(f.program.inputs)}, mbs__in_sizes_{k}, '
        f"{len(f.program.outputs)}, mbs__out_sizes_{k}, mbs__call_{k}}},"
        for k, (name, f) in enumerate(exported)
    ]
    constants = NumbersInText() if numbers is None else numbers
    printed = [Printer(function, every, constants).text(write) for function in every.functions]
    told = [line for name, f in exported for line in summary(name, f.program)] if numbers is None else []
    if often is not None:
        printed = [*printed[:often], _AS_WRITTEN, *printed[often:], _AS_BEFORE]
    return fill_template(
        "c/model.c.in",
        title=TITLE,
        runtime=" ".join(runtime),
        summary="\n".join(f" * {line}" for line in told or ["Numbers stand apart."]),
        numbers=constants.definitions,
        functions="\n\n".join(printed),
        adapters="\n\n".join(_adapter(k, f) for k, (_, f) in enumerate(exported)),
        table="\n".join(table),
        count=len(exported),
    )


def _header(every: Functions) -> str:
    sizes = []
    for f in every.exported:
        inputs, outputs = parameters(f.program, RESERVED)
        parts: list[Array | Output] = [*f.program.inputs, *f.program.outputs]
        for name, part in zip(inputs + outputs, parts, strict=True):
            sizes.append(f"#define {f'{f.name}_{name}'.upper()}_SIZE {math.prod(part.shape)}")
    prototypes = "\n".join(f"{head_of(f)};" for f in every.exported)
    return fill_template("c/model.h.in", title=TITLE, sizes="\n".join(sizes), prototypes=prototypes)


def _adapter(k: int, function: Function) -> str:
    program = function.program
    arguments = [f"in[{i}]" if array.shape else f"in[{i}][0]" for i, array in enumerate(program.inputs)]
    arguments += [f"out[{i}]" for i in range(len(program.outputs))]
    unused = [f"    (void){name};" for name, part in (("in", program.inputs), ("out", program.outputs)) if not part]
    lines = [
        f"static const int mbs__in_sizes_{k}[] = {{{_sizes([a.size for a in program.inputs])}}};",
        f"static const int mbs__out_sizes_{k}[] = {{{_sizes([len(o.values) for o in program.outputs])}}};",
        f"static void mbs__call_{k}(const double *const *in, double *const *out)",
        "{",
        *unused,
        wrap_items(f"    {function.name}(", arguments, ");", indent=" " * 8),
        "}",
    ]
    return "\n".join(lines)


def _sizes(sizes: Sequence[int]) -> str:
    return ", ".join(map(str, sizes or [0]))


def _selftest(programs: Mapping[str, Program], samples: Samples) -> str:
    texts = {math.inf: "INFINITY", -math.inf: "-INFINITY"}
    numbers = [
        "NAN" if math.isnan(x) else texts.get(x, repr(x))
        for name, program in programs.items()
        for x in stored_numbers(program, samples.get(name, ()))
    ]
    results = [sum(len(output.values) for output in program.outputs) for program in programs.values()]
    arrays = [len(part) for program in programs.values() for part in (program.inputs, program.outputs)]
    return fill_template(
        "c/selftest.c.in",
        tolerance=repr(TOLERANCE),
        largest=max([1, *results]),
        arrays=max([1, *arrays]),
        samples=", ".join(str(len(samples.get(name, ()))) for name in programs),
        stored=wrap_items("    ", numbers or ["0.0"], ""),
    )
