"""What several documents tell: constraints that are left over, reactions withheld, start values that were changed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import FORCE_NAMES
from multibody_sym.text.values import SI, Units

if TYPE_CHECKING:
    from multibody_sym.analysis.check import CheckReport

_ALONG: Final = {"x": "fx", "y": "fy", "z": "fz", "rx": "mx", "ry": "my", "rz": "mz"}
"""The components of a joint's reaction along the rows of a cut joint."""
_WHOLE: Final = ("force", "multiplier")
"""The forces of a row that is an element of its own, such as a stop."""


_FORCE: Final = re.compile(r"(\w+)\((.+)\)")
_MOST_NAMED: Final = 9
"""So many forces are named one by one."""


def forces_text(names: Sequence[str]) -> str:
    """Return names of forces, those of many by components: `fz, mx, my of A, B, C` for fz(A), mx(A) and so on."""
    parts = [(name, _FORCE.fullmatch(name)) for name in names]
    if len(names) <= _MOST_NAMED:
        return ", ".join(names)
    components: dict[str, list[str]] = {}
    for name, part in parts:
        components.setdefault(name if part is None else part[2], []).extend([] if part is None else [part[1]])
    owners: dict[tuple[str, ...], list[str]] = {}
    for owner, own in components.items():
        owners.setdefault(tuple(own), []).append(owner)
    return "; ".join(
        f"{', '.join(own)} of {', '.join(several)}" if own else ", ".join(several) for own, several in owners.items()
    )


def redundancy_lines(found: Redundancy | CheckReport) -> list[str]:
    """Return what redundant rows mean for the model and its author; nothing where there are none.

    Rows against which nothing could move anyway, as in every planar model with hinges, are no fault: two lines.
    """
    if not found.redundant:
        return []
    named, count = _forces_of(found.redundant, found), len(found.redundant)
    if all(len(circuit) == 1 for circuit in found.dependencies) and found.dependencies:
        rows = "1 row" if count == 1 else f"{count} rows"
        why = f"({rows}, against which nothing could move anyway; the motion is unique)"
        forces = forces_text(found.ambiguous_forces)
        told = [f"forces that are not unique: {forces}; all others are"] if forces else []
        return [f"redundant constraints: {named} {why}", *told]
    rows = "1 row is" if count == 1 else f"{count} rows are"
    moved = "the motion is unique all the same" if found.ambiguous_forces else "with friction what slides moves by them"
    lines = [f"redundant constraints: {named} ({rows} left over; {moved})"]
    alone = [circuit[0] for circuit in found.dependencies if len(circuit) == 1]
    if alone:
        lines.append(f"  nothing could move against {_forces_of(alone, found)} anyway")
    for circuit in dict.fromkeys(circuit for circuit in found.dependencies if len(circuit) > 1):
        lines.append(f"  each of {_forces_of(circuit, found)} follows from the others")
    if found.ambiguous_forces:
        lines += [
            f"forces that are not unique: {forces_text(found.ambiguous_forces)}",
            "  only elasticity could tell them: to make them definite leave a row out, let a joint go in such a "
            "direction (spherical or cylindrical in place of revolute), or put a spring in place of a constraint",
        ]
    return lines


def _forces_of(rows: Iterable[str], found: Redundancy | CheckReport) -> str:
    """Return the constraints that rows are, or their forces, as expressions name them: `rod, fz(C)`."""
    return ", ".join(_force_of(row, found.ambiguous_forces) for row in rows)


def _force_of(row: str, forces: Sequence[str]) -> str:
    """Return the name of the force of a row among some; a constraint of one row keeps its own name."""
    owner, _, along = row.rpartition(".")
    if not owner:
        return row
    word = along.rstrip("0123456789")
    parts = (_ALONG.get(along, ""), word, f"{word}_{along[len(word) :]}")
    names = [force_name(owner, part) for part in parts if part in FORCE_NAMES]
    return next((name for name in (*names, *(force_name(row, x) for x in _WHOLE)) if name in forces), row)


# ----------------------------------------------------------------------------------------------------------------------
# Withheld reactions in words: of which joints, which components, and what to declare so that they are determined.


def withheld_lines(withheld: Mapping[str, Sequence[str]], reasons: Sequence[str]) -> list[str]:
    """Return the names of joints' reactions that are not determined, then why; nothing for none."""
    if not withheld:
        return []
    named = (force_name(name, component) for name, components in withheld.items() for component in components)
    return [", ".join(named), *reasons]


def withheld_text(withheld: Mapping[str, Sequence[str]], reasons: Sequence[str]) -> list[str]:
    """Return the same as lines under a word of their own."""
    first, *others = withheld_lines(withheld, reasons) or [""]
    return [f"withheld: {first}", *(f"  {line}" for line in others)] if withheld else []


# ----------------------------------------------------------------------------------------------------------------------
# What constraints changed of the start values that were given, as text.


_MOST: Final = 6


def shifts_text(shifts: Mapping[str, float], known: Mapping[str, str], units: Units = SI) -> list[str]:
    """Return one line with the largest changes, none where nothing changed; `known` is the SI unit of each by name."""
    if not shifts:
        return []
    largest = sorted(shifts.items(), key=lambda item: -abs(item[1]))
    named = ", ".join(f"{name} by {units.said(change, known[name], digits=3)}" for name, change in largest[:_MOST])
    more = f" and {len(shifts) - _MOST} more by less" if len(shifts) > _MOST else ""
    return [f"given start values were changed to satisfy the constraints: {named}{more}"]
