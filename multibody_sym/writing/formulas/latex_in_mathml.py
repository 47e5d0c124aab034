r"""Letters and left sides in LaTeX as MathML, so that what has a letter has the same one in both.

What is read is what labels are made of: names with indices, dots, `\frac`, `\left(` `\right)`, upright words; a command
that is none of these stands as text.
"""

from __future__ import annotations

import re
from html import escape
from typing import Final

from multibody_sym.expressions.letters import GREEK

SPACE: Final = '<mspace width="0.17em"/>'
DOTS: Final = {"dot": "&#x2D9;", "ddot": "&#xA8;"}
ABOVE: Final = 'style="math-depth:0;padding-bottom:0.1em"'
"""How dots are set: in full size, with a gap to their letter."""
_TOKEN: Final = re.compile(r"\\[A-Za-z]+ ?|\\.|[0-9.]+|.", re.DOTALL)
_SIGNS: Final = {"partial": "&#x2202;", "varphi": "&#x3C6;", "infty": "&#x221E;"}
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
        return [f"<mi>{escape(token)}</mi>" if token.isalpha() else f"<mo>{_operator(token)}</mo>"]

    def _command(self, name: str) -> str:
        if name in GREEK:
            return f"<mi>{GREEK[name]}</mi>"
        if name in _SIGNS:
            return f"<mi>{_SIGNS[name]}</mi>"
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


def _operator(token: str) -> str:
    return {"-": "&#x2212;", "'": "&#x2032;"}.get(token, escape(token))
