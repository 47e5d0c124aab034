"""A linearisation as text: eigenvalues as people read them, then the matrices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from multibody_sym.analysis.linearization import Linearization
from multibody_sym.analysis.periodic import Multipliers
from multibody_sym.analysis.steadiness import NO_EIGENVALUES
from multibody_sym.writing.shifts import shifts_text

_ROUNDING: Final = 1e-9
_ZERO: Final = 1e-12
"""What a position that was looked for is near to zero at best."""


def linearization_text(found: Linearization) -> str:
    """Return the linearisation for a person to read."""
    if not found.states:
        return "nothing is free to move: there are no states"
    lines = [f"linearised in {', '.join(found.states)}", *_place(found), *shifts_text(found.shifts), *_notes(found)]
    if found.steady:
        lines += ["eigenvalues", *(f"  {text}" for text in _eigenvalues(found))]
    lines += ["A", *_matrix(found.A.tolist())]
    if found.inputs:
        lines += [f"B (by {', '.join(found.inputs)})", *_matrix(found.B.tolist())]
    return "\n".join(lines)


def multipliers_text(found: Multipliers) -> str:
    """Return the multipliers over one period for a person to read."""
    lines = [f"in {', '.join(found.states)}, over one period of {found.period:g} s", "multipliers"]
    for x in found.multipliers:
        if abs(x.imag) <= _ROUNDING * abs(x):
            lines.append(f"  {x.real:.9g}")
        elif x.imag > 0.0:
            lines.append(f"  {x.real:.9g} +- {x.imag:.9g} i   (size {abs(x):.9g})")
    return "\n".join(lines)


def _place(found: Linearization) -> list[str]:
    """Return the state about which the system was linearised."""
    told = [f"{name} = {x if abs(x) > _ZERO else 0.0:.6g}" for name, x in found.at.items()]
    return [f"about {', '.join(told)}"] if told else []


def _notes(found: Linearization) -> list[str]:
    """Return what to know of the state and of what was held."""
    notes = []
    independent = {name: x for name, x in found.accelerations.items() if not found.steady or name in found.states}
    moving = ", ".join(f"{name}' = {x:.6g}" for name, x in independent.items() if abs(x) > _ROUNDING)
    if not found.steady:
        notes.append(f"note: {NO_EIGENVALUES} ({moving}): its eigenvalues are not given")
    elif moving:
        notes.append(f"note: the state is no equilibrium and no steady motion, but A is constant: {moving}")
    if found.left_out:
        names = ", ".join(found.left_out)
        notes.append(f"note: left out, as nothing depends on them and their rates are not constant: {names}")
    if found.held_inputs:
        notes.append(f"note: held at the values of t = 0, although they change: {', '.join(found.held_inputs)}")
    return notes


def _eigenvalues(found: Linearization) -> list[str]:
    """Return one line for each real eigenvalue and for each pair, with frequency and damping ratio."""
    lines = []
    for x in found.eigenvalues:
        if x.imag == 0.0:
            lines.append(f"{x.real:.9g}")
        elif x.imag > 0.0:
            frequency, damping = abs(x) / (2 * math.pi), 0.0 - x.real / abs(x)
            real = f"{x.real:.9g} " if x.real else ""
            lines.append(f"{real}+- {x.imag:.9g} i   ({frequency:.4g} Hz, damping ratio {damping:.4g})")
    return lines


def _matrix(rows: Sequence[Sequence[float]]) -> list[str]:
    return ["  " + " ".join(f"{x:12.6g}" for x in row) for row in rows]
