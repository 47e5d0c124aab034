"""The statements of a Program as lines of C."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from multibody_sym.codegen.c_function import Printer
from multibody_sym.codegen.layout import wrapped
from multibody_sym.program.accesses import accesses
from multibody_sym.program.infix import expression
from multibody_sym.program.progressions import Progression
from multibody_sym.program.statements import Assign, Call, Kernel, Loop, Scan, Solve, Statement

_ON_STACK: Final = 4096
"""Numbers of an array of a scan up to which it lies on the stack: 32 KiB."""


def write(printer: Printer, statement: Statement) -> None:
    """Add a statement to the function that a printer writes."""
    _PRINTERS[type(statement)](printer, statement)


def _assign(printer: Printer, statement: Assign) -> None:
    text = expression(statement.nodes, printer.names, printer.language)
    name = f"z{len(printer.origins)}"
    printer.piece.lines.append(f"    const double {name} = {text};")
    printer.piece.size += len(statement.nodes)
    printer.define(statement.value, name)


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
    lines += ["    {", *arrays, wrapped(f"        {name}(", arguments, ");", indent=" " * 12), "    }"]
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
    spans = [f"{factors}_spans"] if statement.acting else []
    given = [f"&{printer.function.name}__{factors}", factors, *spans, right, *(f"r{number}_{k}" for k in range(3))]
    printer.piece.used |= {factors, *spans}
    called = wrapped(f"        {solver}(", given, ");", indent=" " * 12)
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
    called = wrapped(f"        mbs_factorise{printer.variant(factors)}(", given, ");", indent=" " * 12)
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
    given += [acting, printer.names[statement.most], factors, f"{factors}_spans"]
    printer.piece.used |= {factors, f"{factors}_spans"}
    called = wrapped(f"        mbs_factorise{printer.variant(factors)}(", given, ");", indent=" " * 12)
    printer.piece.lines += ["    {", *declared, called, "    }"]


def _scan(printer: Printer, statement: Scan) -> None:
    number, lines = printer.record(), printer.piece.lines
    pointers = [printer.pointer(f"a{number}_{k}", atoms) for k, atoms in enumerate(statement.given)]
    names = [name for name, _ in pointers]
    for k, leaves in enumerate(statement.targets):
        names.append(f"r{number}_{k}")
        printer.targets(names[-1], leaves, _storage(len(leaves)))
    work = []
    for k, size in enumerate(statement.work):
        names.append(f"s{number}_{k}")
        work.append(f"        {_storage(size)}double {names[-1]}[{max(1, size)}];")
    tables: dict[Progression, str] = {}
    loops = [line for loop in statement.loops for line in _loop(printer, loop, names, tables)]
    zeros = [
        f"        for (int k = 0; k < {size}; k++)\n            {name}[k] = 0.0;"
        for number, (name, size, use) in enumerate(zip(names, statement.sizes, accesses(statement), strict=True))
        if number >= len(pointers) and use.needs_zeros(number < len(pointers) + len(statement.targets))
    ]
    patterns = [
        wrapped(f"        static const int {name}[] = {{", map(str, given.pattern), "};", indent=" " * 12)
        for given, name in tables.items()
    ]
    lines += ["    {", *(declared for _, declared in pointers if declared), *work, *patterns, *zeros, *loops, "    }"]


def _storage(size: int) -> str:
    """Return where an array of a scan lies: on the stack, a large one in storage of the thread, which costs a call."""
    return "MBS_SCRATCH " if size > _ON_STACK else ""


def _loop(printer: Printer, loop: Loop, names: Sequence[str], tables: dict[Progression, str]) -> list[str]:
    lines = [f"        for (int k = 0; k < {loop.count}; k++) {{"]
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
    return [*declared, wrapped(called, arguments, ");", indent=" " * 20), *added]


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


_PRINTERS: Final[dict[type[Statement], Callable[[Printer, Any], None]]] = {
    Assign: _assign,
    Call: _call,
    Solve: _solve,
    Scan: _scan,
}
