r"""How wide mathematics in LaTeX is on the page, near enough to say where a line must end.

Estimated in points of Computer Modern at 10 pt from what the writers of this package write: letters, `\frac`, indices,
parentheses, functions. What is estimated a little too wide ends a line a little early.
"""

from __future__ import annotations

import re
from typing import Final

_TOKEN: Final = re.compile(r"\\[A-Za-z]+|\\.|[{}_^]|\s+|.", re.DOTALL)
_LETTER, _DIGIT, _SIGN, _SMALL = 6.0, 5.0, 12.5, 0.75
_WORDS: Final = frozenset("sin cos tan sinh cosh tanh log exp min max arcsin arccos arctan".split())
_BARE: Final = {"left": 0.0, "right": 0.0, ",": 1.7, ";": 2.8, " ": 3.3, "quad": 10.0, "Bigl": 2.0, "Bigr": 2.0}


def latex_width(text: str) -> float:
    """Return the width of mathematics in a line of its own, in points."""
    return _Ruler(_TOKEN.findall(text)).until("")


class _Ruler:
    def __init__(self, tokens: list[str]) -> None:
        self.tokens = tokens
        self.next = 0

    def until(self, closing: str, scale: float = 1.0) -> float:
        """Return the width up to a closing token, which is passed over."""
        total = 0.0
        while self.next < len(self.tokens):
            token = self.tokens[self.next]
            self.next += 1
            if token == closing:
                break
            total += self._one(token, scale)
        return total

    def _group(self, scale: float) -> float:
        while self.next < len(self.tokens) and self.tokens[self.next].isspace():
            self.next += 1
        if self.next == len(self.tokens):
            return 0.0
        token = self.tokens[self.next]
        self.next += 1
        return self.until("}", scale) if token == "{" else self._one(token, scale)

    def _one(self, token: str, scale: float) -> float:
        if token == "{":
            return self.until("}", scale)
        if token in ("_", "^"):
            return self._group(_SMALL * scale) + 0.5
        if token.startswith("\\"):
            return self._command(token[1:], scale)
        if token.isspace() or token == "}":
            return 0.0
        return scale * (_SIGN if token in "+-=<>" else _DIGIT if token.isdigit() or token in "().,[]'|" else _LETTER)

    def _command(self, name: str, scale: float) -> float:
        if name == "frac":
            return max(self._group(scale), self._group(scale)) + 2.4
        if name == "sqrt":
            return self._group(scale) + 8.5
        if name in ("text", "mathrm", "operatorname"):
            return 0.82 * self._group(scale) + 1.7
        if name in ("dot", "ddot"):
            return self._group(scale)
        if name in _WORDS:
            return scale * (5.0 * len(name) + 1.7)
        if name in ("le", "ge"):
            return scale * _SIGN
        return scale * _BARE.get(name, _LETTER)
