"""The readable text of a Program: one line a statement."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final

from multibody_sym.program.infix import Language, Texts, expression
from multibody_sym.program.progressions import Progression, Window
from multibody_sym.program.statements import (
    TARGETS,
    Array,
    Assign,
    Call,
    Callee,
    Kernel,
    Loop,
    Output,
    Scan,
    Solve,
    Statement,
)
from multibody_sym.scalars.node import Node

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
    for array in program.inputs:
        names = [array.name] if array.shape == () else [f"{array.name}[{k}]" for k in range(array.size)]
        texts.update(zip(array.slots, names, strict=True))
    counter = _Counter(texts)
    lines = [f"program {program.name}({', '.join(_shaped(a) for a in program.inputs)})"]
    for statement in program.statements:
        lines.append("  " + _PRINTERS[type(statement)](statement, counter))
    lines += [f"  {_shaped(o)} = {_listed(o.values, texts)}" for o in program.outputs]
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


def _shaped(array: Array | Output) -> str:
    return f"{array.name}[{', '.join(map(str, array.shape))}]" if array.shape else array.name


def _listed(nodes: Iterable[Node], texts: Texts) -> str:
    return f"({', '.join(texts[n] for n in nodes)})"


def _assign(statement: Assign, counter: _Counter) -> str:
    text = expression(statement.nodes, counter.texts, _LANGUAGE)
    return f"{counter.define(statement.value)} = {text}"


def _call(statement: Call, counter: _Counter) -> str:
    arguments = ", ".join(_listed(atoms, counter.texts) for atoms in statement.arguments)
    return f"{_defined(statement.targets, counter)} = {statement.program.name}({arguments})"


def _solve(statement: Solve, counter: _Counter) -> str:
    width = len(statement.solution)
    rows = ", ".join(_listed(row, counter.texts) for row in statement.matrix.lists(width))
    right = _listed(statement.right, counter.texts)
    unknown = _defined((statement.solution, statement.multipliers, statement.report), counter)
    most = "" if statement.most.shadow == len(statement.right) else f", most {counter.texts[statement.most]}"
    forces = ", ".join(_listed(row, counter.texts) for row in statement.exerted.lists(width))
    exerted = f", exerted ({forces})" if forces else ""
    acting = f", acting {_listed(statement.acting, counter.texts)}" if statement.acting else ""
    return f"{unknown} = solve(({rows}), {right}{most}{acting}{exerted})"


def _scan(statement: Scan, counter: _Counter) -> str:
    given = ", ".join(_listed(atoms, counter.texts) for atoms in statement.given)
    loops = "".join(f"\n    {_loop(loop)}" for loop in statement.loops)
    return f"{_defined(statement.targets, counter)} = scan({given}) with work {statement.work}{loops}"


def _loop(loop: Loop) -> str:
    runs = "; ".join(map(_kernel, loop.kernels))
    chosen = f", kernel {_progression(loop.choice)} of" if len(loop.kernels) > 1 else ":"
    gate = f" where {_window(loop.gate)}" if loop.gate is not None else ""
    return f"for k < {loop.count}{gate}{chosen} {runs}"


def _kernel(kernel: Kernel) -> str:
    reads = ", ".join(map(_window, kernel.reads))
    return f"{', '.join(map(_window, kernel.writes))} = {kernel.program.name}({reads})"


def _window(window: Window) -> str:
    return f"{'+' if window.adds else ''}a{window.array}[{_progression(window.first)}]"


def _progression(given: Progression) -> str:
    if len(given.pattern) == 1:
        return f"{given.pattern[0]} + {given.step}k" if given.step else f"{given.pattern[0]}"
    return f"{given.pattern} by {given.step}"


def _defined(leaves: tuple[tuple[Node, ...], ...], counter: _Counter) -> str:
    return ", ".join(f"({', '.join(counter.define(leaf) for leaf in part)})" for part in leaves)


_PRINTERS: Final[dict[type[Statement], Callable[[Any, _Counter], str]]] = {
    Assign: _assign,
    Call: _call,
    Solve: _solve,
    Scan: _scan,
}
