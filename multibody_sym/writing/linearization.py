"""A linearisation as text: eigenvalues as people read them, then the matrices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.analysis.linearization import Linearization
from multibody_sym.analysis.periodic import Multipliers
from multibody_sym.analysis.steadiness import NO_EIGENVALUES
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.held_digits import held
from multibody_sym.numerics.arrays import Floats
from multibody_sym.writing.shifts import shifts_text

_DIGITS: Final = 9
_FEW: Final = 4
"""Digits of an eigenvalue, and of its frequency and damping ratio, without error."""
_ROUNDING: Final = 1e-9
_ZERO: Final = 1e-12
"""What a position that was looked for is near to zero at best."""


def linearization_text(found: Linearization, units: Units = SI) -> str:
    """Return the linearisation for a person to read.

    The rates that A and B give are those of the states in their chosen units, in a second.
    """
    if not found.states:
        return "nothing is free to move: there are no states"
    begun = [*_place(found, units), *shifts_text(found.shifts, found.units, units)]
    lines = [f"linearised in {_named(found, found.states, units)}", *begun, *_notes(found, units)]
    if found.steady:
        lines += [f"eigenvalues in {units.of('1/s')}", *(f"  {text}" for text in _eigenvalues(found, units))]
    states, inputs = (_sizes(found, names, units) for names in (found.states, found.inputs))
    lines += ["A", *_matrix((found.A * states / states[:, None]).tolist())]
    if found.inputs:
        by = _named(found, found.inputs, units)
        lines += [f"B (by {by})", *_matrix((found.B * inputs / states[:, None]).tolist())]
    return "\n".join(lines)


def _named(found: Linearization, names: Sequence[str], units: Units) -> str:
    return ", ".join(units.named(name, found.units[name]) for name in names)


def _sizes(found: Linearization, names: Sequence[str], units: Units) -> Floats:
    """Return how large the units are in which these are told, in SI units."""
    return np.array([units.size(found.units[name]) for name in names])


def multipliers_text(found: Multipliers, units: Units = SI) -> str:
    """Return the multipliers over one period, pure numbers, for a person to read."""
    period = units.said(found.period, "s", 6)
    lines = [f"in {', '.join(found.states)}, over one period of {period}", "multipliers"]
    for x in found.multipliers:
        if abs(x.imag) <= _ROUNDING * abs(x):
            lines.append(f"  {x.real:.6g}")
        elif x.imag > 0.0:
            lines.append(f"  {x.real:.6g} +- {x.imag:.6g} i   (size {abs(x):.6g})")
    return "\n".join(lines)


def _place(found: Linearization, units: Units) -> list[str]:
    """Return the state about which the system was linearised."""
    clear = {name: x if abs(x) > _ZERO else 0.0 for name, x in found.at.items()}
    told = [f"{name} = {units.said(x, found.units[name], 6)}" for name, x in clear.items()]
    return [f"about {', '.join(told)}"] if told else []


def _notes(found: Linearization, units: Units) -> list[str]:
    """Return what to know of the state and of what was held."""
    notes = []
    independent = {name: x for name, x in found.accelerations.items() if not found.steady or name in found.states}
    rates = {name: units.said(x, f"{found.units[name]}^2", 6) for name, x in independent.items()}
    moving = ", ".join(f"{name}' = {rates[name]}" for name, x in independent.items() if abs(x) > _ROUNDING)
    if not found.steady:
        notes.append(f"note: {NO_EIGENVALUES} ({moving}): its eigenvalues are not given")
    elif moving:
        notes.append(f"note: the state is no equilibrium and no steady motion, but A is constant: {moving}")
    if found.left_out:
        names = ", ".join(found.left_out)
        notes.append(f"note: left out, as nothing depends on them and their rates are not constant: {names}")
    if found.held_inputs:
        notes.append(f"note: held at the values of t = 0, although they change: {', '.join(found.held_inputs)}")
    if found.driving_inputs:
        names = ", ".join(found.driving_inputs)
        notes.append(f"note: without a column in B, as motions and constraints follow their rates too: {names}")
    return notes


def _eigenvalues(found: Linearization, units: Units) -> list[str]:
    """Return one line for each real eigenvalue and for each pair, with frequency and damping ratio."""
    lines, size = [], units.size("1/s")
    for x, error in zip(found.eigenvalues, found.eigenvalue_errors, strict=True):
        real, imaginary = (held(part / size, error / size, _DIGITS) for part in (x.real, x.imag))
        if imaginary == "0":
            lines.append(real)
        elif x.imag > 0.0:
            frequency = held(abs(x) / (2 * math.pi), error / (2 * math.pi), _FEW)
            damping = held(0.0 - x.real / abs(x), error / abs(x), _FEW)
            decays = f"{real} " if x.real else ""
            lines.append(f"{decays}+- {imaginary} i   ({frequency} Hz, damping ratio {damping})")
    return lines


def _matrix(rows: Sequence[Sequence[float]]) -> list[str]:
    return ["  " + " ".join(f"{x:12.6g}" for x in row) for row in rows]
