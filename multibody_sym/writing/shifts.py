"""What constraints changed of the start values that were given, as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from multibody_sym.expressions.chosen_units import SI, Units

_MOST: Final = 6


def shifts_text(shifts: Mapping[str, float], known: Mapping[str, str], units: Units = SI) -> list[str]:
    """Return one line with the largest changes, none where nothing changed; `known` is the SI unit of each by name."""
    if not shifts:
        return []
    largest = sorted(shifts.items(), key=lambda item: -abs(item[1]))
    named = ", ".join(f"{name} by {units.said(change, known[name], 3)}" for name, change in largest[:_MOST])
    more = f" and {len(shifts) - _MOST} more by less" if len(shifts) > _MOST else ""
    return [f"given start values were changed to satisfy the constraints: {named}{more}"]
