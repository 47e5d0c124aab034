"""Elements for whose rows together no positions are found: what is left when those that change nothing are out."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from multibody_sym.dynamics.closing import Rows, closed_from
from multibody_sym.numerics.arrays import Floats

_ELEMENTS: Final = 6
_SPEEDS: Final = 12
"""Larger systems are not searched: each element costs a search for positions from many guesses."""


def unclosable(rows: Rows, q: Floats) -> Rows | None:
    """Return those of rows that do not close which still do not, though they do without any one of their elements.

    None where there are too many to try.
    """
    elements = list(dict.fromkeys(rows.mechanism.row_path(k) for k in rows.active))
    if len(elements) > _ELEMENTS or len(rows.mechanism.speeds) > _SPEEDS:
        return None
    for element in elements:
        rest = replace(rows, active=[k for k in rows.active if rows.mechanism.row_path(k) != element])
        if not _closes(rest, q):
            rows = rest
    return rows


def _closes(rows: Rows, q: Floats) -> bool:
    return not rows.active or closed_from(rows, q, range(len(rows.mechanism.speeds)), weighted=False) is not None
