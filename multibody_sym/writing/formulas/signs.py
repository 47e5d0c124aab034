r"""What LaTeX is told of letters that it has no sign for: each is declared once, and the text keeps the letter."""

from __future__ import annotations

import unicodedata
from typing import Final

from multibody_sym.expressions.letters import GREEK

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
_WORDS: Final = {
    "ο": "o", "–": "--", "—": "---", "…": r"\dots{}", "‘": "`", "’": "'", "“": "``", "”": "''", "•": r"\textbullet{}",
}  # fmt: skip
UNKNOWN: Final = r"\newcommand{\unknownsign}[1]{\fbox{\tiny #1}}"
"""How a letter is shown that is none of these: by its number in a box."""


def declared(text: str) -> str:
    """Return the declarations that inputenc needs of the letters in a text; `UNKNOWN` stands before them."""
    found = sorted({c for c in text if not _is_known(c)})
    return "\n".join([UNKNOWN, *(rf"\DeclareUnicodeCharacter{{{ord(c):04X}}}{{{_sign(c)}}}" for c in found)])


def harmless(text: str) -> str:
    """Return text without characters that no document may hold: controls and halves of pairs."""
    return "".join("\ufffd" if unicodedata.category(c) in ("Cc", "Cs") and c not in "\n\t" else c for c in text)


def _is_known(character: str) -> bool:
    return character <= "~" or ("\u00a0" <= character <= "\u017e" and character not in _LACKING)


def _sign(character: str) -> str:
    if character in _MATHEMATICS:
        return rf"\ensuremath{{{_MATHEMATICS[character]}}}"
    if character in _WORDS:
        return _WORDS[character]
    if unicodedata.combining(character) or unicodedata.category(character) == "Cf":
        return ""
    plain = "".join(c for c in unicodedata.normalize("NFKD", character) if c.isascii() and c.isalnum())
    return plain or rf"\unknownsign{{{ord(character):04X}}}"
