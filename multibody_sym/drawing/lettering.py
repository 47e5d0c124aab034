"""Letters of labels: runs of one style each, and their widths in the metrics of Times, which all backends keep to."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from typing import Final

from multibody_sym.expressions.letters import GREEK, SYMBOL, read_parts

Run = tuple[str, str]
"""Some letters and their style: roman, italic, or subscript (roman, smaller, lower)."""
HEIGHT: Final = 0.72
"""From the baseline to the top of tall letters, in sizes of the type."""
DESCENT: Final = 0.24
"""From the baseline down to the lowest letters and subscripts."""
SUBSCRIPT: Final = 0.8
"""Size of a subscript; 10 pt letters have subscripts of 8 pt, the least that is printed."""
DROP: Final = 0.16
"""How far a subscript stands below the baseline, in sizes of the type."""
LONGEST: Final = 40
"""Characters of a label that are shown; what is longer ends in an ellipsis."""
_OTHER: Final = 0.62
"""Width of a letter that has no entry: wide enough for Greek and Cyrillic."""
_WIDE: Final = 1.0

_ROMAN: Final = (
    "250 333 408 500 500 833 778 333 333 333 500 564 250 333 250 278 500 500 500 500 500 500 500 500 500 500 278 278 "
    "564 564 564 444 921 722 667 667 722 611 556 722 722 333 389 722 611 889 722 722 556 722 667 556 611 722 722 944 "
    "722 722 611 333 278 333 469 500 333 444 500 444 500 444 333 500 500 278 278 500 278 778 500 500 500 500 333 389 "
    "278 500 500 722 500 500 444 480 200 480 541"
)
_ITALIC: Final = (
    "250 333 420 500 500 833 778 333 333 333 500 675 250 333 250 278 500 500 500 500 500 500 500 500 500 500 333 333 "
    "675 675 675 500 920 611 611 667 722 611 611 722 722 333 444 667 556 833 667 722 611 722 611 500 556 722 611 833 "
    "611 556 556 389 278 389 422 500 333 500 500 444 500 444 278 500 500 278 278 444 278 722 500 500 500 500 389 389 "
    "278 500 444 667 444 444 389 400 275 400 541"
)
_WIDTHS: Final = {
    style: {chr(32 + i): int(w) / 1000 for i, w in enumerate(table.split())}
    for style, table in (("roman", _ROMAN), ("italic", _ITALIC), ("subscript", _ROMAN))
}
_THIN_SPACE: Final = "\u2009"
_SHORT: Final = rf"(?:{'|'.join(GREEK)}|[A-Za-z]{{1,2}})(?:_?[0-9]+)?"
_TERM: Final = rf"(?:(?:{_SHORT}|[0-9.]+)|(?:sin|cos|exp)\((?:{_SHORT}|[0-9.]+)(?: ?[-+*/] ?(?:{_SHORT}|[0-9.]+))*\))"
_FORMULA: Final = re.compile(rf"-?{_TERM}(?: ?[-+*/] ?{_TERM})+")
"""Sums and quotients of symbols of a letter or two, and of functions; names with a hyphen are longer words."""


_RELATION: Final = re.compile(r"(.+) ([≤≥]) (.+)")
"""A coordinate and a limit of it."""


def width_of(runs: Sequence[Run], size: float) -> float:
    """Return the width of letters of a size, in the unit of the size."""
    return sum(run_width(run, size) for run in runs)


def run_width(run: Run, size: float) -> float:
    """Return the width of one run in letters of a size."""
    text, style = run
    scale = size * (SUBSCRIPT if style == "subscript" else 1.0)
    table = _WIDTHS[style]
    return scale * sum(table.get(letter) or _unlisted(letter) for letter in text)


def _unlisted(letter: str) -> float:
    if unicodedata.combining(letter):
        return 0.0
    if letter == _THIN_SPACE:
        return 1.0 / 6.0
    return _WIDE if unicodedata.east_asian_width(letter) in "WF" else _OTHER


def letters(name: str) -> tuple[Run, ...]:
    """Return a symbol as a book writes it: theta_1 and theta1 as θ with the index 1, l as an italic l, words upright.

    Words that follow each other are read as such (crank_angle), and so are symbols in a formula, such as R - r or l/2.
    What is neither stands as it is.
    """
    shown = printable(name)
    if SYMBOL.fullmatch(shown):
        return _symbol(shown)
    limit = _RELATION.fullmatch(shown)
    if limit is not None:
        return (*letters(limit[1]), (f" {limit[2]} ", "roman"), *letters(limit[3]))
    return _formula(shown) if _FORMULA.fullmatch(shown) else words(shown)


def _formula(text: str) -> tuple[Run, ...]:
    """Return the runs of a formula of short symbols, with signs as they are set."""
    runs: list[Run] = []
    for part in re.findall(r"[A-Za-z]\w*|[^A-Za-z]+", text, re.ASCII):
        signs: Run = (part.replace("-", "−").replace("*", _THIN_SPACE), "roman")
        runs += _symbol(part) if SYMBOL.fullmatch(part) else [signs]
    return tuple(runs)


def _symbol(name: str) -> tuple[Run, ...]:
    letter, *below = read_parts(name)
    head: Run = (GREEK.get(letter, letter), "italic" if letter in GREEK or len(letter) == 1 else "roman")
    return (head, (",".join(GREEK.get(part, part) for part in below), "subscript")) if below else (head,)


def words(text: str) -> tuple[Run, ...]:
    """Return text as it stands, in upright letters."""
    return ((printable(text) or " ", "roman"),)


def printable(text: str) -> str:
    """Return text on one line without characters that control how others are shown, cut to a length that fits.

    Characters that no backend can show stand as a replacement character.
    """
    kept = [" " if c.isspace() else c if _shows(c) else "\ufffd" for c in text[: LONGEST + 1]]
    line = " ".join("".join(kept).split())
    return line if len(text) <= LONGEST else line[:LONGEST] + "…"


def _shows(character: str) -> bool:
    """Whether a character is a mark on paper: neither a control, a direction, a surrogate nor unassigned."""
    return unicodedata.category(character)[0] != "C"
