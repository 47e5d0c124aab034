"""Writer of sympy expressions as MathML, which browsers show without scripts or fonts of ours."""

from __future__ import annotations

import re
from html import escape
from typing import Any, ClassVar, Final

import sympy

from multibody_sym.algebra.script import ATOM, POWER, PRODUCT, SUM, Piece, Script
from multibody_sym.dynamics.derivation.notation import Notation, dotted, latex_name
from multibody_sym.dynamics.derivation.record import Label
from multibody_sym.expressions.letters import SYMBOL
from multibody_sym.writing.formulas.latex_in_mathml import SPACE, latex_in_mathml

_SHOWN: Final = re.compile("<[^>]*>|(?<=&)[^;]*;")
PIECE: Final = 70.0
"""Letters and signs in a piece of a formula past which it is taken apart, so that a narrow window breaks it."""
_ACCENTS: Final = ("dot", "ddot")
_COMPARISONS: Final = {
    sympy.StrictLessThan: "&lt;", sympy.LessThan: "&#x2264;", sympy.StrictGreaterThan: "&gt;",
    sympy.GreaterThan: "&#x2265;",
}  # fmt: skip
_WORDS: Final = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "Min": "min", "Max": "max"}


class MathmlScript(Script):
    """Presentation MathML: the content of a `<math>` element."""

    plus: ClassVar[str] = '<mo form="infix">+</mo>'
    minus: ClassVar[str] = '<mo form="infix">&#x2212;</mo>'
    opposite: ClassVar[str] = "<mo>&#x2212;</mo>"
    times: ClassVar[str] = SPACE
    opening: ClassVar[str] = "<mo>(</mo>"

    def width(self, written: str) -> float:
        return float(len(_SHOWN.sub("", written)))

    def closing(self, exponent: Any) -> str:
        return "<mo>)</mo>" if exponent == 1 else f"<msup><mo>)</mo><mn>{exponent}</mn></msup>"

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
        return f"<mrow><mo>(</mo>{text}<mo>)</mo></mrow>"

    def matrix(self, rows: list[list[str]]) -> str:
        lines = "".join(f"<mtr>{''.join(f'<mtd>{x}</mtd>' for x in row)}</mtr>" for row in rows)
        return f"<mrow><mo>[</mo><mtable>{lines}</mtable><mo>]</mo></mrow>"


def mathml_script(notation: Notation) -> MathmlScript:
    """Return the writer of expressions in the letters and the order of a notation."""
    return MathmlScript({s: latex_in_mathml(label.latex) for s, label in notation.spelling.items()}, notation.places)


def element(content: str) -> str:
    """Return a `<math>` element, its fractions as large as in a line of their own."""
    return f'<math displaystyle="true">{content}</math>'


def elements(script: MathmlScript, left: Any, right: Any) -> str:
    """Return `left` = `right` as elements between which a browser may end the line."""
    first, *others = _side(script, right)
    *lead, last = _side(script, left)
    return " ".join(map(element, (*lead, f"{last}<mo>=</mo>{first}", *others)))


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
