"""What `solve` found, as text: formulas with their values, and the conditions under which they hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from multibody_sym.answers.solution import OtherState, RowKind, Solution
from multibody_sym.expressions.chosen_units import SI, Units
from multibody_sym.expressions.components import AT
from multibody_sym.expressions.held_digits import held
from multibody_sym.expressions.quantities import force_name
from multibody_sym.writing.forces import NOT_UNIQUE, joint_lines, not_unique_lines
from multibody_sym.writing.impact import impact_lines
from multibody_sym.writing.shifts import shifts_text
from multibody_sym.writing.withheld import withheld_lines

SEVERAL_MOTIONS: Final = "the laws leave several motions: this is one of them, and nothing says which one happens"
_IDLE: Final = ("open", "free")
_STATES: Final = "the state, found by the laws of contact and friction: nobody gave directions"
_WHERE: Final = "where, as formulas name it"
_JOINTS: Final = "reactions of joints, on the child, in the axes of the joint's frame on the parent (zeros left out)"


def solution_text(solution: Solution, units: Units = SI) -> str:
    """Return a solution for people to read, in chosen units."""
    primes = {name: "''" if name in solution.coordinates else "'" for name in solution.accelerations}
    sections: dict[str, Iterable[str]] = {
        _STATES: [*solution.found, *(f"{how}: a little further on {x}" for x, how in solution.at_limit.items())],
        SEVERAL_MOTIONS: _several(solution),
        "start values that follow from the constraints": [
            f"{name} = {value.told(units)}" for name, value in solution.assembled.items()
        ],
        **({} if solution.impact is None else impact_lines(solution.impact, units)),
        "accelerations": [
            f"{name + primes[name]} = {value.told(units)}" for name, value in solution.accelerations.items()
        ],
        "tensions": _constraint_lines(solution, units, "rope"),
        "forces of contacts, stops and friction": _one_way_lines(solution, units),
        "forces of constraints": _constraint_lines(solution, units, "rod", "force"),
        "multipliers": _constraint_lines(solution, units, "multiplier"),
        _JOINTS: joint_lines(
            {name: x for name, x in solution.reactions.items() if "fx" in x}, solution.reactions, units
        ),
        NOT_UNIQUE: not_unique_lines(
            (_named(solution, name, component), value)
            for name, components in solution.reactions.items()
            for component, value in components.items()
            if component not in AT
        ),
        "withheld, because constraints do not say where their forces act": withheld_lines(
            solution.withheld, solution.withheld_reasons
        ),
        "conditions": [_condition(solution, each) for each in solution.conditions],
        "answers": [f"{name} = {value.told(units)}" for name, value in solution.answers.items()],
        _WHERE: list(_where(solution, primes, units)),
        "notes": solution.notes,
    }
    parts = [f"{title}\n{_indented(lines)}" for title, lines in sections.items() if lines]
    return "\n".join([f"{solution.name} at t = 0", *shifts_text(solution.shifts, solution.units, units), *parts])


def _where(solution: Solution, primes: Mapping[str, str], units: Units) -> Iterator[str]:
    """Yield what letters of formulas stand for, but for what is told above by the same formula."""
    above = {x.expression: f"{name}{primes[name]}" for name, x in solution.accelerations.items()}
    for name, one in solution.where.items():
        told = solution.assembled.get(name)
        if told is not None and told.expression is not None and told.expression is one.expression:
            continue
        same = None if one.expression is None else above.get(one.expression)
        says = f" ({one.says})" if one.says else ""
        yield f"{name} = {same}" if same else f"{name} {one.told(units)}{says}"


def _indented(lines: Iterable[str]) -> str:
    return "\n".join(f"  {line}" for line in lines)


def _named(solution: Solution, name: str, component: str) -> str:
    """Return the name of a force in expressions; of constraints other than ropes and rods it is the multiplier."""
    return force_name(name, "multiplier" if solution.kinds.get(name) in ("force", "multiplier") else component)


def _constraint_lines(solution: Solution, units: Units, *kinds: RowKind) -> list[str]:
    return [
        f"{_named(solution, name, part)} = {value.told(units)}"
        for name, kind in solution.kinds.items()
        if kind in kinds
        for part, value in solution.reactions[name].items()
    ]


def _several(solution: Solution) -> list[str]:
    """Return that there are several motions, and those beside the one that is told."""
    if solution.verdict != "several":
        return []
    return [f"searched: {solution.searched}", *(f"another: {_other(other)}" for other in solution.others)]


def _other(other: OtherState) -> str:
    states = ", ".join(f"{name} {word}" for name, word in other.states.items())
    errors = other.errors
    moved = ", ".join(f"{name} {held(x, errors.get(name, 0.0), 6)}" for name, x in other.accelerations.items())
    return f"{states}: accelerations {moved}"


def _condition(solution: Solution, condition: str) -> str:
    broken = solution.limits.get(condition)
    return condition if broken is None else f"{condition}, else {broken}"


def _one_way_lines(solution: Solution, units: Units) -> list[str]:
    """Return the forces of contacts, stops and friction, without those of open ones, and their unique sums."""
    lines: list[str] = []
    for name, kind in solution.kinds.items():
        if kind in ("contact", "stop", "friction") and solution.states.get(name) not in _IDLE:
            forces = solution.reactions[name]
            lines += [f"{force_name(name, x)} = {value.told(units)}" for x, value in forces.items() if x not in AT]
            lines += [f"{force_name(name, x)} = {forces[x].told(units)}" for x in AT if x in forces]
    return [*lines, *(f"{name} = {value.told(units)}" for name, value in solution.sums.items())]
