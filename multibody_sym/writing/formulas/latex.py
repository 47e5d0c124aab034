"""Formulas in LaTeX in as many lines as the page needs, broken between terms."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final

import sympy

from multibody_sym.dynamics.derivation.notation import Notation
from multibody_sym.dynamics.derivation.record import Label
from multibody_sym.expressions.latex_width import latex_width

ROOM: Final = 420.0
"""Points of a line that are filled: 13/15 of the text of an A4 page with margins of 2 cm, as widths are estimates."""
_INDENT: Final = 20.0
_SIGN: Final = 12.5
_HERE: Final = "\0"
_WIDEST_MATRIX: Final = 1.1 * ROOM


def filled(pieces: Iterable[tuple[float, str]], room: float, gap: float = 0.0) -> list[str]:
    """Return pieces (their widths, what is written) joined to lines no wider than `room`, as far as pieces allow."""
    lines: list[list[str]] = [[]]
    size = 0.0
    for width, piece in pieces:
        if lines[-1] and size + width > room:
            lines.append([])
            size = 0.0
        lines[-1].append(piece)
        size += width + gap
    return [" ".join(line) for line in lines]


def equation_lines(notation: Notation, left: Any, right: Any, align: str = "") -> list[str]:
    """Return `left` = `right` in lines; `align` stands before the sign, lines that go on are to be indented."""
    if isinstance(right, sympy.MatrixBase) and latex_width(notation.latex(right)) > _WIDEST_MATRIX:
        return [line for e in _elements(notation, left, right) for line in _broken(notation, *e, align)]
    return _broken(notation, left, right, align)


def _broken(notation: Notation, left: Any, right: Any, align: str) -> list[str]:
    """Return an equation in lines, aligned at its sign where that is in the first one, else at its beginning."""
    room = ROOM - _INDENT
    (width, first), *others = notation.latex_pieces(right, room)
    pieces = [*notation.latex_pieces(left, room), (_SIGN + width, f"{_HERE}= {first}"), *others]
    start, *more = filled(pieces, room)
    if _HERE in start:
        return [start.replace(_HERE, align), *more]
    return [align + start, *(line.replace(_HERE, "") for line in more)]


def _elements(notation: Notation, left: Any, matrix: Any) -> list[tuple[Label, Any]]:
    """Return the elements of a matrix that are not zero, each with its place: of a symmetric one the upper triangle."""
    half = matrix.rows > 1 and matrix.is_symmetric(simplify=False)
    places = [(i, j) for i in range(matrix.rows) for j in range(i if half else 0, matrix.cols) if matrix[i, j] != 0]
    name, column = notation.latex(left), matrix.cols == 1
    under = [f"{i + 1}" if column else f"{i + 1},{j + 1}" for i, j in places]
    names = [Label(f"{notation.text(left)}[{place}]", f"{{{name}}}_{{{place}}}") for place in under]
    return [(label, matrix[i, j]) for label, (i, j) in zip(names, places, strict=True)]
