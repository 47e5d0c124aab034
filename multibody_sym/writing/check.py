"""What `check` found, as text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from multibody_sym.checking.check import CheckReport
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.writing.redundancy import redundancy_lines
from multibody_sym.writing.shifts import shifts_text
from multibody_sym.writing.solution import SEVERAL_MOTIONS
from multibody_sym.writing.withheld import withheld_text


def check_text(found: CheckReport, units: Units = SI) -> str:
    """Return the report for a person to read, in chosen units."""
    if found.failure is not None:
        return "\n".join([f"no motion: {found.failure}", *_hints(found.hints)])
    begun = [*_freedom(found), *_start(found, units), *_several(found)]
    return "\n".join([*begun, *_agreement(found), *_theorems(found), *_hints(found.hints)])


def _freedom(found: CheckReport) -> list[str]:
    lines = [f"degrees of freedom: {found.degrees_of_freedom}"]
    if found.rank or found.redundant:
        lines[0] += f" ({found.degrees_of_freedom + found.rank} speeds, constraints of rank {found.rank})"
    if found.doubles:
        more = sum(found.doubles.values())
        speeds, rank = found.degrees_of_freedom + found.rank + more, found.rank + more
        keeps = f"keep{'s its' if len(found.doubles) == 1 else ' their'} coordinates beside them"
        lines.append(
            f"  {_listed(list(found.doubles))} {keeps}, by massless doubles of their children "
            f"(with these: {speeds} speeds, constraints of rank {rank})"
        )
    return [*lines, *redundancy_lines(found), *withheld_text(found.withheld, found.withheld_reasons)]


def _start(found: CheckReport, units: Units) -> list[str]:
    lines = [f"held at the start: {_listed(found.held)}"] if found.held else []
    assembled = [f"assembled: {_listed(found.assembled)}"] if found.assembled else []
    return [*lines, *assembled, *shifts_text(found.shifts, found.units, units)]


def _several(found: CheckReport) -> list[str]:
    if found.verdict != "several":
        return []
    taken = f"{SEVERAL_MOTIONS}; all this is of {_states(found.states)}"
    return [taken, *(f"  another: {_states(other)}" for other in found.others)]


def _states(states: Mapping[str, str]) -> str:
    return _listed([f"{name} {word}" for name, word in states.items()])


def _agreement(found: CheckReport) -> list[str]:
    verdict = "all agree" if found.agrees else f"THEY DISAGREE: {_listed(found.missing)}"
    ratios = ", ".join(f"{name} {ratio:.2g}" for name, ratio in found.agreement.items())
    return [f"formalisms (scaled residuals; rounding stays below 10, with constraints below 100): {ratios}: {verdict}"]


def _theorems(found: CheckReport) -> list[str]:
    residuals = ", ".join(f"{name.replace('_', ' ')} {x:.1e}" for name, x in found.theorems.items())
    lines = [f"theorems (relative residuals): {residuals or 'nothing has mass and nothing acts, all forces are zero'}"]
    return [*lines, *(f"conserved: {name} ({found.symmetries[name]})" for name in found.conserved)]


def _hints(hints: Sequence[str]) -> list[str]:
    return [f"hint: {hint}" for hint in hints]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)
