"""A linearisation as text: eigenvalues as people read them, then the matrices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from multibody_sym.dynamics.linearization import Linearization
from multibody_sym.report.shifts import shifts_text

_ROUNDING: Final = 1e-9


def linearization_text(found: Linearization) -> str:
    """Return the linearisation for a person to read."""
    moving = {name: x for name, x in found.accelerations.items() if abs(x) > _ROUNDING}
    lines = [f"linearised in {', '.join(found.states)}", *shifts_text(found.shifts)]
    if moving:
        rates = ", ".join(f"{name}' = {x:.6g}" for name, x in moving.items())
        lines.append(f"note: the state is no equilibrium and no steady motion: {rates}")
    lines += ["eigenvalues", *(f"  {text}" for text in _eigenvalues(found))]
    lines += ["A", *_matrix(found.A.tolist())]
    if found.inputs:
        lines += [f"B (by {', '.join(found.inputs)})", *_matrix(found.B.tolist())]
    return "\n".join(lines)


def _eigenvalues(found: Linearization) -> list[str]:
    """Return one line for each real eigenvalue and for each pair, with frequency and damping ratio."""
    lines = []
    size = max((abs(x) for x in found.eigenvalues), default=0.0)
    for x in found.eigenvalues:
        if abs(x.imag) <= _ROUNDING * size:
            lines.append(f"{_cleared(x.real, size):.9g}")
        elif x.imag > 0.0:
            frequency, damping = abs(x) / (2 * math.pi), -x.real / abs(x)
            lines.append(f"{x.real:.9g} +- {x.imag:.9g} i   ({frequency:.4g} Hz, damping ratio {damping:.4g})")
    return lines


def _matrix(rows: Sequence[Sequence[float]]) -> list[str]:
    size = max((abs(x) for row in rows for x in row), default=0.0)
    return ["  " + " ".join(f"{_cleared(x, size):12.6g}" for x in row) for row in rows]


def _cleared(x: float, size: float) -> float:
    """Return a number, zero if it is rounding beside others of this size."""
    return 0.0 if abs(x) <= _ROUNDING * size else x
