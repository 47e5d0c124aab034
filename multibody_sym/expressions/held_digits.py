"""Numbers as text, with the digits that hold."""

from __future__ import annotations

from typing import Final

MOST: Final = 10
"""Digits that are printed of a number without error."""


def held(number: float, error: float = 0.0, most: int = MOST) -> str:
    """Return a number that is off by at most `error` as text, right to half a unit of its last place.

    So many digits, at most `most`, are printed as both ends of number +- error round to alike, but one at least; a
    number within its error of 0 is 0.
    """
    if not error > 0.0:
        return f"{number:.{most}g}"
    if abs(number) <= error:
        return "0"
    low, high = number - error, number + error
    digits = next((n for n in range(most, 0, -1) if f"{low:.{n - 1}e}" == f"{high:.{n - 1}e}"), 1)
    return f"{number:.{digits}g}"
