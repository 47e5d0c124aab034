"""Ranges of rest as text."""

from __future__ import annotations

from math import isclose, pi
from typing import Final

from multibody_sym.answers.least_for_motion import LeastForMotion
from multibody_sym.answers.range_of_rest import RangeOfRest, RestBound
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.printer import text

_NOWHERE: Final = "rest is possible at no value of"


def rest_text(found: RangeOfRest, units: Units = SI) -> str:
    """Return the ranges for a person to read, in chosen units, each with its ends."""
    lines = [_range(found, low, high, units) for low, high in found.ends]
    if not lines:
        why = f" ({', '.join(found.gives_way)})" if found.gives_way else ""
        lines = [f"{_NOWHERE} {found.parameter}{why}"]
    return "\n".join([*lines, *_notes(found, units)])


def _range(found: RangeOfRest, low: RestBound, high: RestBound, units: Units) -> str:
    name = found.parameter
    if _is_all(found, low, high):
        return f"rest is possible at every value of {name}"
    if low.value is None or high.value is None:
        end, sign = (high, "<=") if low.value is None else (low, ">=")
        sign = sign[0] if end.open else sign
        return f"rest is possible for {name} {sign} {told(end, found.unit, units)}"
    first, last = (told(x, found.unit, units) + (", excluded" if x.open else "") for x in (low, high))
    if units.said(low.value, found.unit) == units.said(high.value, found.unit):
        return f"rest is possible only for {name} = {min(first, last, key=len)}"
    return f"rest is possible for {name} from {first}\n  to {last}"


def _is_all(found: RangeOfRest, low: RestBound, high: RestBound) -> bool:
    """Return whether a range is all values that were looked at: without ends, or a whole turn."""
    if low.value is None or high.value is None:
        return low.value is high.value
    return found.unit == "rad" and not low.gives_way + high.gives_way and isclose(high.value - low.value, 2 * pi)


def told(bound: RestBound, unit: str, units: Units = SI) -> str:
    """Return `formula = exact number = number unit (what gives way)`."""
    assert bound.value is not None
    number = units.said(bound.value, unit, error=bound.error)
    forms = [text(form) for form in (bound.expression, bound.exact) if form is not None]
    shown = [form for form in dict.fromkeys(forms) if form != f"{bound.value:.10g}"]
    formula = " = ".join([*shown, number])
    return f"{formula} ({', '.join(bound.gives_way)})" if bound.gives_way else formula


def least_text(found: LeastForMotion, units: Units = SI) -> str:
    """Return the least values that hold and that move and where they are least, in chosen units."""
    pairs = [("the least that holds is", found.holds, found.holds_at), ("rest ends first at", found.value, found.at)]
    lines = []
    for words, value, at in pairs:
        if value is not None and at is not None:
            lines.append(f"{words} {found.least} = {told(value, found.unit, units)}")
            lines.append(f"  where {found.vary} = {told(at, found.vary_unit, units)}")
    return "\n".join(lines)


def _notes(found: RangeOfRest, units: Units) -> list[str]:
    """Return from where to where values were looked at, where that is not everywhere."""
    low, high = found.searched
    if low in (None, 0.0) and high is None:
        return []
    told = [units.said(x or 0.0, found.unit, 6) for x in (low, high)]
    turn = found.unit == "rad" and low is not None and high is not None and isclose(high - low, 2 * pi)
    return [f"note: looked for {'through a whole turn, ' if turn else ''}from {told[0]} to {told[1]}"]
