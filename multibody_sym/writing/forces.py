"""Forces and impulses by their names, as lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from multibody_sym.expressions.chosen_units import Units
from multibody_sym.expressions.quantities import force_name
from multibody_sym.expressions.values import Value

NOT_UNIQUE: Final = "not unique, because constraints depend on each other"
_ROUNDING: Final = 1e-12


def not_unique_lines(values: Iterable[tuple[str, Value]]) -> list[str]:
    """Return the names of those values that are not unique, in a line; nothing where all are."""
    unsure = [name for name, value in values if not value.unique]
    return [", ".join(unsure)] if unsure else []


def joint_lines(
    joints: Mapping[str, Mapping[str, Value]], others: Mapping[str, Mapping[str, Value]], units: Units
) -> list[str]:
    """Return what joints transmit, without parts that are zero beside these and those of `others`."""
    sizes = [abs(x.value or 0.0) for parts in (*joints.values(), *others.values()) for x in parts.values()]
    least = _ROUNDING * max(sizes, default=0.0)
    return [
        f"{force_name(name, component)} = {value.told(units)}"
        for name, parts in joints.items()
        for component, value in parts.items()
        if abs(value.value or 0.0) > least
    ]
