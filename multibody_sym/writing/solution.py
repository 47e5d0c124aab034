"""What `solve` found, as text: formulas with their values, and the conditions under which they hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from multibody_sym.answers.solution import RowKind, Solution, Value
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.writing.redundancy import grouped
from multibody_sym.writing.shifts import shifts_text
from multibody_sym.writing.withheld import withheld_lines

_ROUNDING: Final = 1e-12
_JOINTS: Final = "reactions of joints, on the child, in the axes of the joint's frame on the parent (zeros left out)"


def solution_text(solution: Solution, units: Units = SI) -> str:
    """Return a solution for people to read, in chosen units."""
    primes = {name: "''" if name in solution.coordinates else "'" for name in solution.accelerations}
    sections: dict[str, Iterable[str]] = {
        "start values that follow from the constraints": [
            f"{name} = {value.told(units)}" for name, value in solution.assembled.items()
        ],
        "accelerations": [
            f"{name + primes[name]} = {value.told(units)}" for name, value in solution.accelerations.items()
        ],
        "tensions": _constraint_lines(solution, units, "rope"),
        "forces of constraints": _constraint_lines(solution, units, "rod", "force"),
        "multipliers": _constraint_lines(solution, units, "multiplier"),
        _JOINTS: _joint_lines(solution.reactions, units),
        "not unique, because constraints depend on each other": _not_unique(solution.reactions),
        "withheld, because constraints do not say where their forces act": withheld_lines(
            solution.withheld, solution.withheld_reasons
        ),
        "conditions": solution.conditions,
        "answers": [f"{name} = {value.told(units)}" for name, value in solution.answers.items()],
        "notes": solution.notes,
    }
    parts = [f"{title}\n{_indented(lines)}" for title, lines in sections.items() if lines]
    return "\n".join([f"{solution.name} at t = 0", *shifts_text(solution.shifts, solution.units, units), *parts])


def _not_unique(reactions: Mapping[str, Mapping[str, Value]]) -> list[str]:
    """Return the components that are not unique; a constraint with one force is named alone."""
    pairs = [
        (name, component if component in COMPONENTS else "")
        for name, components in reactions.items()
        for component, value in components.items()
        if not value.unique
    ]
    return [grouped(pairs)] if pairs else []


def _indented(lines: Iterable[str]) -> str:
    return "\n".join(f"  {line}" for line in lines)


def _constraint_lines(solution: Solution, units: Units, *kinds: RowKind) -> list[str]:
    return [
        f"{' '.join((name, *[part] * (len(parts) > 1)))} = {value.told(units)}{' (a tension)' * (kind == 'rod')}"
        for name, kind in solution.kinds.items()
        if kind in kinds
        for parts in [solution.reactions[name]]
        for part, value in parts.items()
    ]


def _joint_lines(reactions: Mapping[str, Mapping[str, Value]], units: Units) -> list[str]:
    forces = [abs(x.value or 0.0) for values in reactions.values() for x in values.values()]
    least = _ROUNDING * max(forces, default=0.0)
    return [
        f"{name} {component} = {value.told(units)}"
        for name, values in reactions.items()
        for component, value in values.items()
        if component in COMPONENTS and abs(value.value or 0.0) > least
    ]
