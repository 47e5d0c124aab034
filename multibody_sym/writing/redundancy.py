"""Redundant constraints in words: which rows are left over, why, and which forces nobody can tell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from multibody_sym.dynamics.constraints.left_over import Redundancy

if TYPE_CHECKING:  # a run needs none of it
    from multibody_sym.checking.check import CheckReport


def redundancy_lines(found: Redundancy | CheckReport) -> list[str]:
    """Return what redundant rows mean for the model and its author; nothing where there are none.

    Rows against which nothing could move anyway, as in every planar model with hinges, are no fault: two lines.
    """
    if not found.redundant:
        return []
    named, count = grouped(row.partition(".")[::2] for row in found.redundant), len(found.redundant)
    if all(len(circuit) == 1 for circuit in found.dependencies) and found.dependencies:
        rows = "1 row" if count == 1 else f"{count} rows"
        why = f"({rows}, against which nothing could move anyway; the motion is unique)"
        forces = _listed(found.ambiguous_forces)
        told = [f"forces that are not unique: {forces}; all others are"] if forces else []
        return [f"redundant constraints: {named} {why}", *told]
    rows = "1 row is" if count == 1 else f"{count} rows are"
    lines = [f"redundant constraints: {named} ({rows} left over; the motion is unique all the same)"]
    alone = [circuit[0] for circuit in found.dependencies if len(circuit) == 1]
    if alone:
        lines.append(f"  nothing could move against {grouped(row.partition('.')[::2] for row in alone)} anyway")
    for circuit in dict.fromkeys(circuit for circuit in found.dependencies if len(circuit) > 1):
        lines.append(f"  each of {_listed(circuit)} follows from the others")
    return [*lines, *_forces(found)]


def _forces(found: Redundancy | CheckReport) -> list[str]:
    named = _listed(found.ambiguous_forces)
    if not named:
        return []
    return [
        f"forces that are not unique: {named}",
        "  only elasticity could tell them: to make them definite leave a row out, let a joint go in such a direction "
        "(spherical or cylindrical in place of revolute), or put a spring in place of a constraint",
    ]


def grouped(pairs: Iterable[Sequence[str]]) -> str:
    """Return (element, component) as text, elements with the same components together: `fz mx my of A, B`."""
    parts: dict[str, list[str]] = {}
    for name, component in pairs:
        parts.setdefault(name, []).append(component)
    names: dict[str, list[str]] = {}
    for name, components in parts.items():
        names.setdefault(" ".join(components), []).append(name)
    return "; ".join(f"{which} of {_listed(each)}" if which else _listed(each) for which, each in names.items())


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
