"""Writer of sympy expressions as HTML without scripts or fonts: fractions, powers and roots by classes of a style."""

from __future__ import annotations

import re
from html import escape
from typing import Any, Final

from multibody_sym.algebra.script import ATOM, POWER, PRODUCT, Piece, TextScript
from multibody_sym.dynamics.derivation.notation import GREEK, Notation

STYLE: Final = (
    ".f{display:inline-block;vertical-align:middle;text-align:center;line-height:1.2;margin:0 .1em}"
    ".f>span{display:block;padding:0 .2em}.f>span+span{border-top:1px solid}"
    ".r{border-top:1px solid;padding:0 .1em}.m{white-space:nowrap}"
)
"""What a page needs beside the expressions."""
_SPACE: Final = "&#8201;"


class HtmlScript(TextScript):
    """HTML: `<span class="f">` is a fraction, `r` what stands under a root."""

    def quotient(self, before: list[str], above: list[Any], after: list[str], below: list[Any]) -> Piece:
        if not below and not after:
            return Piece(self._side(before, above), PRODUCT)
        over, under = self._side(before, above) or "1", self._side(after, below)
        return Piece(f'<span class="f"><span>{over}</span><span>{under}</span></span>', ATOM)

    def _side(self, numbers: list[str], factors: list[Any]) -> str:
        alone = len(numbers) + len(factors) == 1
        written = (self.piece(f).text if alone else self.within(f, POWER) for f in factors)
        return _SPACE.join([*numbers, *written])

    def power(self, base: Any, exponent: Any) -> Piece:
        return Piece(f"{self.within(base, ATOM)}<sup>{self.piece(exponent).text}</sup>", POWER)

    def root(self, radicand: Any) -> Piece:
        return Piece(f'&radic;<span class="r">{self.piece(radicand).text}</span>', ATOM)

    def matrix(self, rows: list[list[str]]) -> str:
        lines = "".join(f"<tr>{''.join(f'<td>{x}</td>' for x in row)}</tr>" for row in rows)
        return f"<table>{lines}</table>"


def html_script(notation: Notation) -> HtmlScript:
    """Return the writer of expressions in the letters and the order of a notation."""
    return HtmlScript({s: html_name(label.text) for s, label in notation.spelling.items()}, notation.places)


def html_name(name: str) -> str:
    """Return a name in HTML: theta_1' with a Greek letter, an index and a prime, words upright."""
    spelt = name.rstrip("'")
    primes = {0: "", 1: "&prime;", 2: "&Prime;"}[len(name) - len(spelt)]
    letter, rest = re.match(r"([A-Za-z]*)_*(.*)", spelt, re.DOTALL).groups()  # type: ignore[union-attr]
    head = f"<i>&{letter};</i>" if letter in GREEK else f"<i>{letter}</i>" if len(letter) == 1 else escape(letter)
    parts = [f"&{part};" if part in GREEK else escape(part) for part in rest.split("_") if part]
    return head + primes + (f"<sub>{','.join(parts)}</sub>" if parts else "")
