"""Small motions in LaTeX: the equations in matrices, and the frequencies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import sympy

from multibody_sym.algebra.script import LatexScript
from multibody_sym.dynamics.derivation.notation import dotted, latex_name
from multibody_sym.expressions.values import Value
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.sympy_bridge import to_sympy

Matrix = Sequence[Sequence[Value]]
_DIGITS = 6


def lines_latex(
    coordinates: Sequence[str], matrices: tuple[Matrix, Matrix, Matrix], swinging: Sequence[tuple[Value, Value]]
) -> list[str]:
    """Return M x'' + C x' + K x = 0 and each frequency with its period, as lines with the place at which they align."""
    names = [latex_name(name) for name in coordinates]
    lines = []
    if matrices[0]:
        terms = zip(matrices, ("ddot", "dot", ""), strict=True)
        kept = [(rows, dots) for rows, dots in terms if any(x.value for row in rows for x in row)]
        columns = [(rows, [dotted(name, dots) if dots else name for name in names]) for rows, dots in kept]
        written = (f"{_matrix(rows)} {_bracketed(column)}" for rows, column in columns)
        lines.append(f"{' + '.join(written)} &= 0")
    for k, (omega, duration) in enumerate(swinging, 1):
        place = f"_{{{k}}}" if len(swinging) > 1 else ""
        frequency, period = value_latex(omega, r"\mathrm{rad/s}"), value_latex(duration, r"\mathrm{s}")
        lines.append(rf"\omega{place} &= {frequency}, \quad T{place} = {period}")
    return lines


def value_latex(value: Value, unit: str = "") -> str:
    """Return a formula, or where there is none the number with its unit."""
    if value.expression is not None:
        return node_latex(value.expression)
    return rf"{value.value:.{_DIGITS}g}\,{unit}" if unit else f"{value.value:.{_DIGITS}g}"


def node_latex(node: Node, labels: Mapping[str, str] | None = None) -> str:
    """Return an expression; `labels` are the letters of parameters that have one."""
    book = labels or {}
    expression = to_sympy(node, {})
    letters = sorted(expression.free_symbols, key=lambda s: str(s.name))
    spelling = {s: latex_name(book.get(s.name, s.name)) for s in letters}
    script = LatexScript(spelling, {s: (2, k) for k, s in enumerate(letters)})
    return script.shown(expression) if isinstance(expression, sympy.Basic) else str(expression)


def _matrix(rows: Sequence[Sequence[Value]]) -> str:
    return _bracketed([" & ".join(value_latex(x) for x in row) for row in rows])


def _bracketed(lines: Sequence[str]) -> str:
    return r"\begin{bmatrix}" + r" \\ ".join(lines) + r"\end{bmatrix}"
