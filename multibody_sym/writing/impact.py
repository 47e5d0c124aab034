"""What an impact does, as text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from multibody_sym.answers.impact.record import ImpactFound, ImpactStep
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.quantities import force_name
from multibody_sym.expressions.values import Value
from multibody_sym.writing.forces import NOT_UNIQUE, joint_lines, not_unique_lines

_STEPS: Final = 50
"""So many impacts one after the other are told; JSON has all."""
_JOINTS: Final = "impulses in joints, on the child, in the axes of the joint's frame on the parent (zeros left out)"


def impact_lines(found: ImpactFound, units: Units = SI) -> dict[str, list[str]]:
    """Return the parts of what is told of an impact by their titles."""
    several = len(found.steps) > 1
    return {
        "impact": [_how(found), *(f"{name} {word}" for name, word in found.states.items())],
        "one after the other": [f"{k}. {_struck(step)}" for k, step in enumerate(found.steps, 1)][: _STEPS * several],
        "impulses": [
            f"{_called(name, part)} = {value.told(units)}"
            for name, parts in found.impulses.items()
            for part, value in parts.items()
        ],
        "jumps of speeds": _equations(found.jumps, units, "jump of "),
        "speeds after": _equations(found.after, units),
        _JOINTS: joint_lines(found.joint_impulses, found.impulses, units),
        NOT_UNIQUE: not_unique_lines(
            (_called(name, part), value)
            for name, parts in (*found.impulses.items(), *found.joint_impulses.items())
            for part, value in parts.items()
        ),
        "apparent masses along the normals": _equations(found.apparent_mass, units),
        "speeds of closing before": _equations(found.closing, units),
        "speeds of opening after": _equations(found.opening, units),
        "enough friction, at least": _equations(found.needed, units),
        "energy": _energies(found, units),
        "instantaneous centres": list(_centres(found)),
        "centres of percussion": _equations(found.centres_of_percussion, units),
    }


def _struck(step: ImpactStep) -> str:
    return ", ".join(f"{name} with {impulse:.6g} N*s" for name, impulse in step.impulses.items())


def _how(found: ImpactFound) -> str:
    return f"by {found.law.capitalize()}'s law, {found.sequence.replace('_', ' ')}; speeds jump, nothing moves"


def _called(name: str, part: str) -> str:
    """Return the name of an impulse in questions, in which that of its force stands for it."""
    if part.startswith("impulse"):
        row = part.removeprefix("impulse_") if part != "impulse" else ""
        named = (name, f"tension{row}") if row.isdecimal() else (f"{name}.{row}".rstrip("."), "multiplier")
        return force_name(*named)
    pad, _, word = part.rpartition(".")
    numbered = f"{word[:-1]}_{word[-1]}" if word[-1].isdecimal() and "_" not in word else word
    return force_name(f"{name}.{pad}".rstrip("."), numbered)


def _equations(values: Mapping[str, Value], units: Units, before: str = "") -> list[str]:
    return [f"{before}{name} = {value.told(units)}" for name, value in values.items()]


def _energies(found: ImpactFound, units: Units) -> list[str]:
    lost = {f"lost at {name}": value for name, value in found.lost_by.items()} if len(found.lost_by) > 1 else {}
    told = {f"kinetic energy {name}": value for name, value in found.kinetic_energy.items()}
    given = {} if found.energy_given is None else {"energy given": found.energy_given}
    return _equations({**told, **given, "energy lost": found.energy_lost, **lost}, units)


def _centres(found: ImpactFound) -> Iterable[str]:
    for name, told in found.instantaneous_centres.items():
        if "centre" in told:
            x, y = told["centre"]
            yield f"{name} turns about ({x:.6g}, {y:.6g}) m"
        else:
            x, y = told["direction"]
            yield f"{name} does not turn and moves along ({x:.6g}, {y:.6g})"
