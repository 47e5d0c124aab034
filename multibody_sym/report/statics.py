"""Positions of equilibrium as text."""

from __future__ import annotations

from typing import Final

from multibody_sym.dynamics.statics import Equilibrium

_WORDS: Final = {True: "stable", False: "unstable", None: "indifferent"}
_ROUNDING: Final = 1e-9


def equilibrium_text(found: Equilibrium) -> str:
    """Return the positions for a person to read."""
    lines = []
    for position, stable, free in zip(found.positions, found.stable, found.free, strict=True):
        values = ", ".join(f"{name} = {0.0 if abs(x) < _ROUNDING else x:.9g}" for name, x in position.items())
        along = f"; and so is every position beside it along {', '.join(free)}" if free else ""
        lines.append(f"{_WORDS[stable]}: {values}{along}")
    if not found.complete:
        lines.append("the search took too long and was cut short; there may be others")
    return "\n".join(lines)
