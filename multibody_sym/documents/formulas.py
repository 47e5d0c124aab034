"""Formulas in LaTeX in as many lines as the page needs, broken between terms."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable
from html import escape
from typing import Any, ClassVar, Final
from xml.etree import ElementTree

import sympy

from multibody_sym.algebra.writers import ATOM, POWER, PRODUCT, SUM, Piece, Script
from multibody_sym.derivation.notation import Label, Notation, breakable, dotted, latex_name
from multibody_sym.text.printer import GREEK, SYMBOL, latex_width

ROOM: Final = 420.0
"""Points of a line that are filled: 13/15 of the text of an A4 page with margins of 2 cm, as widths are estimates."""
_INDENT: Final = 20.0
_SIGN: Final = 12.5
_HERE: Final = "\1"
_WIDEST_MATRIX: Final = 1.1 * ROOM


def fill_lines(pieces: Iterable[tuple[float, str]], room: float, gap: float = 0.0) -> list[str]:
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


_WIDEST: Final = 440.0
"""Points of a line that is not set in smaller letters."""
_SIZES: Final = ((0.85, r"\footnotesize"), (0.73, r"\scriptsize"), (0.0, r"\tiny"))
"""Sizes of letters for lines that are wider, each down to a part of their width."""


def fitted(latex: str) -> str:
    """Return a line of mathematics, one that no break makes narrow enough in smaller letters."""
    width = latex_width(latex)
    if width <= _WIDEST:
        return latex
    size = next(name for part, name in _SIZES if part * width <= _WIDEST or not part)
    return rf"\mbox{{{size}$\displaystyle {latex}$}}"


def equation_lines(notation: Notation, left: Any, right: Any, align: str = "") -> list[str]:
    """Return `left` = `right` in lines; `align` stands before the sign, lines that go on are to be indented."""
    if isinstance(right, sympy.MatrixBase) and latex_width(notation.latex(right)) > _WIDEST_MATRIX:
        name, column = notation.latex(left), right.cols == 1
        under = {(i, j): f"{i + 1}" if column else f"{i + 1},{j + 1}" for i, j in shown_places(right)}
        return [
            line
            for e in [
                (Label(f"{notation.text(left)}[{x}]", f"{{{name}}}_{{{x}}}"), right[ij]) for ij, x in under.items()
            ]
            for line in _break_equation(notation, *e, align)
        ]
    return _break_equation(notation, left, right, align)


def _break_equation(notation: Notation, left: Any, right: Any, align: str) -> list[str]:
    """Return an equation in lines, aligned at its sign where that is in the first one, else at its beginning."""
    room = ROOM - _INDENT
    (width, first), *others = notation.latex_pieces(right, room)
    pieces = [*notation.latex_pieces(left, room), (_SIGN + width, f"{_HERE}= {first}"), *others]
    start, *more = fill_lines(pieces, room)
    if _HERE in start:
        return [start.replace(_HERE, align), *more]
    return [align + start, *(line.replace(_HERE, "") for line in more)]


def shown_places(matrix: Any) -> list[tuple[int, int]]:
    """Return the places of elements that are not zero; of a symmetric matrix those of the upper triangle."""
    half = matrix.rows > 1 and matrix.is_symmetric(simplify=False)
    places = [(i, j) for i in range(matrix.rows) for j in range(i if half else 0, matrix.cols)]
    return [(i, j) for i, j in places if matrix[i, j] != 0]


# ----------------------------------------------------------------------------------------------------------------------
# Letters and left sides in LaTeX as MathML, so that what has a letter has the same one in both.
#
# What is read is what labels are made of: names with indices, dots, `\frac`, `\left(` `\right)`, upright words; a
# command that is none of these stands as text.


SPACE: Final = '<mspace width="0.17em"/>'
DOTS: Final = {"dot": "&#x2D9;", "ddot": "&#xA8;"}
ABOVE: Final = 'style="math-depth:0;padding-bottom:0.1em;font-weight:bold"'
"""How dots are set: in full size, bold, with a gap to their letter."""
_TOKEN: Final = re.compile(r"\\[A-Za-z]+ ?|\\.|[0-9.]+|.", re.DOTALL)
_SIGNS: Final = {"partial": "&#x2202;", "varphi": "&#x3C6;", "infty": "&#x221E;"}
_BETWEEN: Final = {"cdot": "&#xB7;", "le": "&#x2264;", "ge": "&#x2265;", "neq": "&#x2260;", "pm": "&#xB1;"}
_OPERATORS: Final = {"-": "&#x2212;", "'": "&#x2032;"}
_SPACES: Final = (r"\,", r"\ ", r"\;")
_WRITTEN: Final = {"textbackslash": "\\", "textasciicircum": "^", "textasciitilde": "~"}


def latex_in_mathml(latex: str) -> str:
    """Return the content of a `<math>` element that reads as a label in LaTeX does."""
    return "".join(_Reader(latex).all())


class _Reader:
    def __init__(self, latex: str) -> None:
        self.tokens = _TOKEN.findall(latex)
        self.next = 0

    def all(self, closing: str = "") -> list[str]:
        """Return the elements before a closing token, which is passed over."""
        found: list[str] = []
        while self.next < len(self.tokens):
            token = self._taken()
            if token == closing:
                break
            if token in "_^":
                base = found.pop() if found else "<mrow></mrow>"
                kind = "msub" if token == "_" else "msup"
                found.append(f"<{kind}>{base}<mrow>{''.join(self._group())}</mrow></{kind}>")
            else:
                found += self._one(token)
        return found

    def _taken(self) -> str:
        self.next += 1
        return self.tokens[self.next - 1].rstrip(" ") or " "

    def _group(self) -> list[str]:
        """Return the elements in the braces that follow, or the one that does."""
        while self.next < len(self.tokens) and self.tokens[self.next] == " ":
            self.next += 1
        if self.next == len(self.tokens):
            return []
        token = self._taken()
        return self.all("}") if token == "{" else self._one(token)

    def _one(self, token: str) -> list[str]:
        if token == "{":
            return self.all("}")
        if token == " ":
            return []
        if token[0] == "\\" and len(token) > 1:
            return [SPACE if token in _SPACES else self._command(token[1:])]
        if token[0].isdigit():
            return [f"<mn>{token}</mn>"]
        return [f"<mi>{escape(token)}</mi>" if token.isalpha() else f"<mo>{_OPERATORS.get(token, escape(token))}</mo>"]

    def _command(self, name: str) -> str:
        if name in GREEK:
            return f"<mi>{GREEK[name]}</mi>"
        if name in _SIGNS:
            return f"<mi>{_SIGNS[name]}</mi>"
        if name in _BETWEEN:
            return f"<mo>{_BETWEEN[name]}</mo>"
        if name in DOTS:
            # No accent: Chromium sets accents upon the letter, where nobody sees dots.
            return f'<mover>{_row(self._group())}<mo {ABOVE}>{DOTS[name]}</mo></mover>'
        if name == "frac":
            return f"<mfrac>{_row(self._group())}{_row(self._group())}</mfrac>"
        if name in ("left", "right"):
            return f"<mo>{escape(self._taken())}</mo>" if self.next < len(self.tokens) else ""
        if name in ("mathrm", "text"):
            return f"<mtext>{escape(self._words())}</mtext>"
        return f"<mtext>{escape(name)}</mtext>"

    def _words(self) -> str:
        """Return the text in the braces that follow."""
        found, depth = [], 0
        while self.next < len(self.tokens):
            token = self.tokens[self.next]
            self.next += 1
            depth += (token == "{") - (token == "}")
            if depth == 0:
                break
            if token[0] == "\\" and len(token) > 1:
                found.append(_WRITTEN.get(token[1:].strip(), token[1:]))
            elif token not in "{}":
                found.append(token)
        return "".join(found)


def _row(elements: list[str]) -> str:
    return elements[0] if len(elements) == 1 else f"<mrow>{''.join(elements)}</mrow>"


# ----------------------------------------------------------------------------------------------------------------------
# Writer of sympy expressions as MathML, which browsers show without scripts or fonts of ours.


_SHOWN: Final = re.compile("<[^>]*>|(?<=&)[^;]*;")
PIECE: Final = 70.0
"""Letters and signs in a piece of a formula past which it is taken apart, so that a narrow window breaks it."""
_OPENING: Final = '<mo form="prefix" lspace="0" rspace="0">(</mo>'
_CLOSING: Final = '<mo form="postfix" lspace="0" rspace="0">)</mo>'
_OPENING_AS_IT_IS, _CLOSING_AS_IT_IS = (x.replace("<mo", '<mo stretchy="false"') for x in (_OPENING, _CLOSING))
"""Parentheses around what is no higher than a line: stretched ones are set with space around them."""
_TALL: Final = ("<mfrac", "<msqrt", "<mtable", "<mover")
_ACCENTS: Final = ("dot", "ddot")
_COMPARISONS: Final = {
    sympy.StrictLessThan: "&lt;", sympy.LessThan: "&#x2264;", sympy.StrictGreaterThan: "&gt;",
    sympy.GreaterThan: "&#x2265;",
}  # fmt: skip
_WORDS: Final = {
    "asin": "arcsin", "acos": "arccos", "atan": "arctan", "asinh": "arsinh", "acosh": "arcosh",
    "atanh": "artanh", "Min": "min", "Max": "max",
}  # fmt: skip


class MathmlScript(Script):
    """Presentation MathML: the content of a `<math>` element."""

    plus: ClassVar[str] = '<mo form="infix">+</mo>'
    minus: ClassVar[str] = '<mo form="infix">&#x2212;</mo>'
    opposite: ClassVar[str] = "<mo>&#x2212;</mo>"
    times: ClassVar[str] = SPACE
    opening: ClassVar[str] = _OPENING

    def width(self, written: str) -> float:
        return float(len(_SHOWN.sub("", written)))

    def closing(self, exponent: Any) -> str:
        return _CLOSING if exponent == 1 else f"<msup>{_CLOSING}<mn>{exponent}</mn></msup>"

    def number(self, digits: str) -> str:
        return f"<mn>{escape(digits)}</mn>"

    def quotient(self, before: list[str], above: list[Any], after: list[str], below: list[Any]) -> Piece:
        if not below and not after:
            return Piece(self._side(before, above), PRODUCT)
        over, under = self._side(before, above) or "<mn>1</mn>", self._side(after, below)
        return Piece(f"<mfrac><mrow>{over}</mrow><mrow>{under}</mrow></mfrac>", ATOM)

    def _side(self, numbers: list[str], factors: list[Any]) -> str:
        alone = len(numbers) + len(factors) == 1
        return SPACE.join([*numbers, *(self.within(f, SUM if alone else POWER) for f in factors)])

    def power(self, base: Any, exponent: Any) -> Piece:
        raised = f"<mrow>{self.piece(exponent).text}</mrow>"
        if isinstance(base, (sympy.sin, sympy.cos, sympy.tan)):
            name = f"<msup><mi>{base.func.__name__}</mi>{raised}</msup>"
            return Piece(f"{name}<mo>&#x2061;</mo>{self.brackets(self.piece(base.args[0]).text)}", POWER)
        return Piece(f"<msup><mrow>{self.within(base, ATOM)}</mrow>{raised}</msup>", POWER)

    def root(self, radicand: Any) -> Piece:
        return Piece(f"<msqrt>{self.piece(radicand).text}</msqrt>", ATOM)

    def other(self, e: Any) -> Piece:
        if isinstance(e, sympy.Piecewise):
            return Piece(self._cases(e), ATOM)
        if e.func in _COMPARISONS:
            return Piece(f"<mo>{_COMPARISONS[e.func]}</mo>".join(self.piece(a).text for a in e.args), SUM)
        if isinstance(e, sympy.Abs):
            return Piece(f"<mrow><mo>|</mo>{self.piece(e.args[0]).text}<mo>|</mo></mrow>", ATOM)
        if not e.args:
            return Piece({sympy.pi: "<mi>&#x3C0;</mi>"}.get(e, f"<mtext>{escape(str(e))}</mtext>"), ATOM)
        name = _WORDS.get(e.func.__name__, e.func.__name__)
        given = "<mo>,</mo>".join(self.piece(a).text for a in e.args)
        return Piece(f"<mi>{escape(name)}</mi><mo>&#x2061;</mo>{self.brackets(given)}", POWER)

    def _cases(self, e: Any) -> str:
        rows = (
            f"<mtr><mtd>{self.piece(value).text}</mtd><mtd>{self._when(condition)}</mtd></mtr>"
            for value, condition in e.args
        )
        return f'<mrow><mo>{{</mo><mtable columnalign="left">{"".join(rows)}</mtable></mrow>'

    def _when(self, condition: Any) -> str:
        if condition == sympy.true:
            return "<mtext>else</mtext>"
        return f"<mtext>where&#xA0;</mtext>{self.piece(condition).text}"

    def brackets(self, text: str) -> str:
        tall = any(element in text for element in _TALL)
        opening, closing = (_OPENING, _CLOSING) if tall else (_OPENING_AS_IT_IS, _CLOSING_AS_IT_IS)
        return f"<mrow>{opening}{text}{closing}</mrow>"

    def matrix(self, rows: list[list[str]]) -> str:
        lines = "".join(f"<mtr>{''.join(f'<mtd>{x}</mtd>' for x in row)}</mtr>" for row in rows)
        return f"<mrow><mo>[</mo><mtable>{lines}</mtable><mo>]</mo></mrow>"


def math_element(content: str) -> str:
    """Return a `<math>` element, its fractions as large as in a line of their own; one that paper is too narrow for
    says to which part it is set there (`--part`)."""
    letters = len(_SHOWN.sub("", content))
    wide = _across(ElementTree.fromstring(f"<math>{content}</math>")) if letters > _PAPER else 0
    part = f' class="wide" style="--part:{_PAPER / wide:.2f}"' if wide > _PAPER else ""
    return f'<math displaystyle="true"{part}>{content}</math>'


_PAPER: Final = 75
"""Letters and signs that a line of paper has room for."""


def _across(element: ElementTree.Element) -> int:
    """Return how many letters stand beside each other, of a fraction those of its longer side."""
    each = [_across(child) for child in element]
    inside = max(each, default=0) if element.tag in ("mfrac", "mtable", "mover") else sum(each)
    return inside + len((element.text or "").strip())


def equation_elements(script: MathmlScript, left: Any, right: Any) -> str:
    """Return `left` = `right` as elements between which a browser may end the line."""
    first, *others = _side(script, right)
    *lead, last = _side(script, left)
    return " ".join(map(math_element, (*lead, f"{last}<mo>=</mo>{first}", *others)))


def _side(script: MathmlScript, side: Any) -> list[str]:
    return [latex_in_mathml(side.latex)] if isinstance(side, Label) else script.pieces(side, PIECE)


def mathml_name(name: str) -> str:
    """Return a name: theta_1'' as a Greek letter with two dots and an index, words upright; other text as it is."""
    spelt = name.rstrip("'")
    primes = len(name) - len(spelt)
    if primes > len(_ACCENTS) or not SYMBOL.fullmatch(spelt):
        return f"<mtext>{escape(name)}</mtext>"
    letter = latex_name(spelt)
    return latex_in_mathml(dotted(letter, _ACCENTS[primes - 1]) if primes else letter)


# ----------------------------------------------------------------------------------------------------------------------
# What LaTeX is told of letters that it has no sign for: each is declared once, and the text keeps the letter.


_LACKING: Final = frozenset("ĦħĸĿŀŉŦŧ")
"""Latin letters that inputenc does not know in T1."""
_MATHEMATICS: Final = {
    **{letter: rf"\{name}" for name, letter in GREEK.items()},
    "ϕ": r"\phi", "ϑ": r"\vartheta", "ϵ": r"\epsilon", "ℓ": r"\ell", "−": "-",
    "∂": r"\partial", "∇": r"\nabla", "∞": r"\infty", "√": r"\surd", "∑": r"\sum", "∫": r"\int", "≈": r"\approx",
    "≠": r"\neq", "≤": r"\le", "≥": r"\ge", "→": r"\to", "←": r"\leftarrow", "↔": r"\leftrightarrow", "∥": r"\parallel",
    "⊥": r"\perp", "∠": r"\angle", "∝": r"\propto", "∈": r"\in", "⋅": r"\cdot", "∙": r"\cdot", "′": "'", "″": "''",
    **{chr(0x2080 + k): f"_{k}" for k in range(10)}, **{chr(0x2070 + k): f"^{k}" for k in (0, 4, 5, 6, 7, 8, 9)},
}  # fmt: skip
_SIGNS_WORDS: Final = {
    "ο": "o", "–": "--", "—": "---", "…": r"\dots{}", "‘": "`", "’": "'", "“": "``", "”": "''", "•": r"\textbullet{}",
}  # fmt: skip
UNKNOWN: Final = r"\newcommand{\unknownsign}[1]{\fbox{\tiny #1}}"
"""How a letter is shown that is none of these: by its number in a box."""


def unicode_declarations(text: str) -> str:
    """Return the declarations that inputenc needs of the letters in a text; `UNKNOWN` stands before them."""
    found = sorted({c for c in text if _is_declared(c)})
    return "\n".join([UNKNOWN, *(rf"\DeclareUnicodeCharacter{{{ord(c):04X}}}{{{_sign(c)}}}" for c in found)])


def in_known_letters(text: str) -> str:
    r"""Return LaTeX whose letters any pdflatex knows: a fragment can declare none."""
    known = "".join(_sign(c) if _is_declared(c) else c for c in harmless(text))
    return f"{UNKNOWN.replace('newcommand', 'providecommand')}\n{known}"


def _is_declared(c: str) -> bool:
    return c > "~" and (not "\u00a0" <= c <= "\u017e" or c in _LACKING)


def harmless(text: str) -> str:
    """Return text without characters that no document may hold: controls and halves of pairs."""
    return "".join("\ufffd" if unicodedata.category(c) in ("Cc", "Cs") and c not in "\n\t" else c for c in text)


def _sign(character: str) -> str:
    if character in _MATHEMATICS:
        return rf"\ensuremath{{{_MATHEMATICS[character]}}}"
    if character in _SIGNS_WORDS:
        return _SIGNS_WORDS[character]
    if unicodedata.combining(character) or unicodedata.category(character) == "Cf":
        return ""
    plain = "".join(c for c in unicodedata.normalize("NFKD", character) if c.isascii() and c.isalnum())
    return plain or rf"\unknownsign{{{ord(character):04X}}}"


# ----------------------------------------------------------------------------------------------------------------------
# Whole documents: LaTeX that compiles as it is, and HTML that needs nothing beside it.


_FIRST_LINES: Final = r"""\documentclass[fleqn]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
"""
_SETTINGS: Final = r"""\usepackage[margin=2cm]{geometry}
\allowdisplaybreaks
\setcounter{secnumdepth}{0}
\setcounter{MaxMatrixCols}{99}
\setlength{\parindent}{0pt}
\sloppy
"""
_PAGE: Final = (
    "body{max-width:60em;margin:2em auto;padding:0 1em;font-family:serif}.n{float:right}"
    "p{overflow-x:auto;overflow-y:hidden}.formula{padding-left:2em;text-indent:-2em}math{text-indent:0}"
)


def latex_document(title: str, body: str) -> str:
    r"""Return a LaTeX document around a body that needs amsmath only."""
    return whole_document(f"\\section*{{{breakable(title)}}}\n{body.rstrip()}")


def whole_document(body: str, *packages: str) -> str:
    """Return a LaTeX document that uses `packages` beside amsmath, with declarations of letters that pdflatex lacks."""
    used = "".join(f"\\usepackage{{{name}}}\n" for name in ("amsmath", "graphicx", *packages))
    body = harmless(body)
    begin = f"{_FIRST_LINES}{used}{_SETTINGS}\n{unicode_declarations(body)}"
    return f"{begin}\n\\begin{{document}}\n{body}\n\\end{{document}}\n"


def html_document(title: str, body: str) -> str:
    """Return a page of HTML with its style around a body."""
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_PAGE}</style>'
    body = f"<h1>{escape(title)}</h1>\n{body}"
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}</body></html>\n'
