"""Redundant constraints in words: which rows are left over, why, and which forces nobody can tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from multibody_sym.dynamics.redundancy import Redundancy

if TYPE_CHECKING:  # a run needs none of it
    from multibody_sym.simulation.check import CheckReport


def redundancy_lines(found: Redundancy | CheckReport) -> list[str]:
    """Return what redundant rows mean for the model and its author; nothing where there are none."""
    if not found.redundant:
        return []
    rows = "1 row is" if len(found.redundant) == 1 else f"{len(found.redundant)} rows are"
    lines = [f"redundant constraints: {_listed(found.redundant)} ({rows} left over; the motion is unique all the same)"]
    alone = [circuit[0] for circuit in found.dependencies if len(circuit) == 1]
    if alone:
        lines.append(f"  nothing could move against {_listed(alone)} anyway")
    for circuit in dict.fromkeys(circuit for circuit in found.dependencies if len(circuit) > 1):
        lines.append(f"  each of {_listed(circuit)} follows from the others")
    return [*lines, *_forces(found)]


def _forces(found: Redundancy | CheckReport) -> list[str]:
    named = [f"{name} ({' '.join(parts)})" if parts else name for name, parts in found.ambiguous.items()]
    if not named:
        return []
    return [
        f"forces that are not unique: {_listed(named)}",
        "  only elasticity could tell them: to make them definite leave a row out, let a joint go in such a direction "
        "(spherical or cylindrical in place of revolute), or put a spring in place of a constraint",
    ]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
