"""What `solve` found, as text: formulas with their values, and the conditions under which they hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from multibody_sym.answers.records import ImpactFound, OtherState, RowKind, Solution, StageFound
from multibody_sym.documents.notes import forces_text, redundancy_lines, shifts_text, withheld_lines, withheld_text
from multibody_sym.scalars.node import negate
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import AT
from multibody_sym.text.values import SI, Units, Value, number_within

if TYPE_CHECKING:
    from multibody_sym.analysis.check import CheckReport
    from multibody_sym.motion.results.integrals import Miss

# ----------------------------------------------------------------------------------------------------------------------
# Forces and impulses by their names, as lines.


NOT_UNIQUE: Final = "not unique, because constraints depend on each other"
_ROUNDING: Final = 1e-12


def not_unique_lines(values: Iterable[tuple[str, Value]]) -> list[str]:
    """Return the names of those values that are not unique, in a line; nothing where all are."""
    unsure = [name for name, value in values if not value.unique]
    return [forces_text(unsure)] if unsure else []


def joint_lines(
    joints: Mapping[str, Mapping[str, Value]], others: Mapping[str, Mapping[str, Value]], units: Units
) -> list[str]:
    """Return what joints transmit, without parts that are zero beside these and those of `others`."""
    sizes = [abs(x.value or 0.0) for parts in (*joints.values(), *others.values()) for x in parts.values()]
    least = _ROUNDING * max(sizes, default=0.0)
    return [
        f"{force_name(name, component)} = {value.told(units)}"
        for name, parts in joints.items()
        for component, value in parts.items()
        if abs(value.value or 0.0) > least
    ]


# ----------------------------------------------------------------------------------------------------------------------
# What an impact does, as text.


_STEPS: Final = 50
"""So many impacts one after the other are told; JSON has all."""
_JOINTS: Final = "impulses in joints, on the child, in the axes of the joint's frame on the parent (zeros left out)"


def impact_lines(found: ImpactFound, units: Units = SI) -> dict[str, list[str]]:
    """Return the parts of what is told of an impact by their titles."""
    several = len(found.steps) > 1
    energies = {f"kinetic energy {name}": value for name, value in found.kinetic_energy.items()}
    energies |= {} if found.energy_given is None else {"energy given": found.energy_given}
    energies["energy lost"] = found.energy_lost
    if len(found.lost_by) > 1:
        energies |= {f"lost at {name}": value for name, value in found.lost_by.items()}
    return {
        "impact": [
            f"by {found.law.capitalize()}'s law, {found.sequence.replace('_', ' ')}; speeds jump, nothing moves",
            *(f"{name} {word}" for name, word in found.states.items()),
        ],
        "one after the other": [
            f"{k}. {', '.join(f'{name} with {impulse:.6g} N*s' for name, impulse in step.impulses.items())}"
            for k, step in enumerate(found.steps[: _STEPS * several], 1)
        ],
        "impulses": [
            f"{_impulse_name(name, part)} = {value.told(units)}"
            for name, parts in found.impulses.items()
            for part, value in parts.items()
        ],
        "jumps of speeds": _equations(found.jumps, units, "jump of "),
        "speeds after": _equations(found.after, units),
        _JOINTS: joint_lines(found.joint_impulses, found.impulses, units),
        NOT_UNIQUE: not_unique_lines(
            (_impulse_name(name, part), value)
            for name, parts in (*found.impulses.items(), *found.joint_impulses.items())
            for part, value in parts.items()
        ),
        "apparent masses along the normals": _equations(found.apparent_mass, units),
        "speeds of closing before": _equations(found.closing, units),
        "speeds of opening after": _equations(found.opening, units),
        "enough friction, at least": _equations(found.needed, units),
        "energy": _equations(energies, units),
        "instantaneous centres": list(_centres(found)),
        "centres of percussion": _equations(found.centres_of_percussion, units),
    }


def _impulse_name(name: str, part: str) -> str:
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


def _centres(found: ImpactFound) -> Iterable[str]:
    for name, told in found.instantaneous_centres.items():
        if "centre" in told:
            x, y = told["centre"]
            yield f"{name} turns about ({x:.6g}, {y:.6g}) m"
        else:
            x, y = told["direction"]
            yield f"{name} does not turn and moves along ({x:.6g}, {y:.6g})"


# ----------------------------------------------------------------------------------------------------------------------

SEVERAL_MOTIONS: Final = "the laws leave several motions: this is one of them, and nothing says which one happens"
_IDLE: Final = ("open", "free")
_STATES: Final = "the state, by the laws of contact and friction"
_WHERE: Final = "where, as formulas name it"
_REACTIONS: Final = "reactions of joints, on the child, in the axes of the joint's frame on the parent (zeros left out)"


def solution_text(solution: Solution, units: Units = SI) -> str:
    """Return a solution for people to read, in chosen units."""
    units = replace(units, angles=units.angles or solution.angles)
    parts = [f"{solution.name} at t = 0", *_solution_lines(solution, units)]
    return "\n".join((*parts, *(line for each in solution.stages for line in _stage_lines(each, units))))


def _stage_lines(found: StageFound, units: Units) -> Iterator[str]:
    """Yield when a stage begins, with which coordinates and speeds, and what holds then."""
    yield f"stage {found.number}, {found.begins}"
    if found.solution is None:
        yield "  never begins"
        return
    yield "begins with"
    yield from (f"  {line}" for line in _equations({"t": found.t, **found.start}, units))
    yield from _solution_lines(found.solution, units)


def _solution_lines(solution: Solution, units: Units) -> list[str]:
    """Return what is found of one stage, section by section."""
    primes = {name: "''" if name in solution.coordinates else "'" for name in solution.accelerations}
    several = [f"searched: {solution.searched}", *(f"another: {_other_motion(x)}" for x in solution.others)]
    several = several if solution.verdict == "several" else []
    limits = {condition: broken for condition, broken in solution.limits.items() if broken is not None}
    sections: dict[str, Iterable[str]] = {
        SEVERAL_MOTIONS: several,
        "answers": _equations(solution.answers, units),
        _STATES: [*solution.found, *(f"{how}: a little further on {x}" for x, how in solution.at_limit.items())],
        **({} if solution.impact is None else impact_lines(solution.impact, units)),
        "at rest": ["constraints leave no freedom"] if solution.at_rest else [],
        "accelerations": [
            f"{name + primes[name]} = {value.told(units)}"
            for name, value in ({} if solution.at_rest else solution.accelerations).items()
        ],
        "rates of the states": [f"{name}' = {value.told(units)}" for name, value in solution.rates.items()],
        "tensions": _constraint_lines(solution, units, "rope"),
        "forces of contacts, stops and friction": _one_way_lines(solution, units),
        "forces of constraints": _constraint_lines(solution, units, "rod", "force"),
        "multipliers": _constraint_lines(solution, units, "multiplier"),
        _REACTIONS: joint_lines(
            {name: x for name, x in solution.reactions.items() if "fx" in x}, solution.reactions, units
        ),
        NOT_UNIQUE: not_unique_lines(
            (_force_name(solution, name, component), value)
            for name, components in solution.reactions.items()
            for component, value in components.items()
            if component not in AT
        ),
        "withheld, because constraints do not say where their forces act": withheld_lines(
            solution.withheld, solution.withheld_reasons
        ),
        "conditions": [f"{x}, else {limits[x]}" if x in limits else x for x in solution.conditions],
        "start values that follow from the constraints": _equations(solution.assembled, units),
        _WHERE: list(_where(solution, primes, units)),
        "notes": solution.notes,
    }
    parts = ["\n".join([title, *(f"  {line}" for line in lines)]) for title, lines in sections.items() if lines]
    return [*shifts_text(solution.shifts, solution.units, units), *parts]


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


def _force_name(solution: Solution, name: str, component: str) -> str:
    """Return the name of a force in expressions; of constraints other than ropes and rods it is the multiplier."""
    return force_name(name, "multiplier" if solution.kinds.get(name) in ("force", "multiplier") else component)


def _constraint_lines(solution: Solution, units: Units, *kinds: RowKind) -> list[str]:
    return [
        _member_line(name, value, units)
        if kind == "rod" and solution.at_rest and value.value is not None
        else f"{_force_name(solution, name, part)} = {value.told(units)}"
        for name, kind in solution.kinds.items()
        if kind in kinds
        for part, value in solution.reactions[name].items()
    ]


def _member_line(name: str, value: Value, units: Units) -> str:
    """Return the force of a rod of a structure: a positive number, of tension or compression."""
    if not value.value:
        return f"{name} = 0 N, a zero-force member"
    word = "tension" if value.value > 0.0 else "compression"
    if value.value < 0.0:
        expression = None if value.expression is None else negate(value.expression)
        value = replace(value, value=-value.value, expression=expression)
    return f"{word}({name}) = {value.told(units)}"


def _other_motion(other: OtherState) -> str:
    states = ", ".join(f"{name} {word}" for name, word in other.states.items())
    errors = other.errors
    moved = ", ".join(f"{name} {number_within(x, errors.get(name, 0.0), 6)}" for name, x in other.accelerations.items())
    return f"{states}: accelerations {moved}"


def _one_way_lines(solution: Solution, units: Units) -> list[str]:
    """Return the forces of contacts, stops and friction, without those of open ones, and their unique sums."""
    lines: list[str] = []
    for name, kind in solution.kinds.items():
        if kind in ("contact", "stop", "friction") and solution.states.get(name) not in _IDLE:
            forces = solution.reactions[name]
            lines += [f"{force_name(name, x)} = {value.told(units)}" for x, value in forces.items() if x not in AT]
            lines += [f"{force_name(name, x)} = {forces[x].told(units)}" for x in AT if x in forces]
    return [*lines, *(f"{name} = {value.told(units)}" for name, value in solution.sums.items())]


# ----------------------------------------------------------------------------------------------------------------------
# What `check` found, as text.


def check_text(found: CheckReport, units: Units = SI) -> str:
    """Return the report for a person to read, in chosen units."""
    hints = [f"hint: {hint}" for hint in found.hints]
    if found.failure is not None:
        return "\n".join([f"no motion: {found.failure}", *hints])
    agree, differ = f"all agree ({len(found.agreement)} formalisms, and the theorems)", ", ".join(found.missing)
    lines = [f"verdict: {agree if found.agrees else f'THEY DISAGREE: {differ}'}", *_freedom(found)]
    lines += [f"held at the start: {', '.join(found.held)}"] if found.held else []
    lines += [f"assembled: {', '.join(found.assembled)}"] if found.assembled else []
    lines += shifts_text(found.shifts, found.units, units)
    if found.verdict == "several":
        lines.append(f"{SEVERAL_MOTIONS}; all this is of {_states(found.states)}")
        lines += [f"  another: {_states(other)}" for other in found.others]
    ratios = ", ".join(f"{name} {ratio:.2g}" for name, ratio in found.agreement.items())
    bounds = "scaled residuals; rounding stays below 10, with constraints below 100"
    lines.append(f"formalisms ({bounds}): {ratios}")
    residuals = ", ".join(f"{name.replace('_', ' ')} {x:.1e}" for name, x in found.theorems.items())
    nothing = "nothing has mass and nothing acts, all forces are zero"
    lines.append(f"theorems (relative residuals): {residuals or nothing}")
    lines += [f"conserved: {name} ({found.symmetries[name]})" for name in found.conserved]
    return "\n".join([*lines, *hints])


def _freedom(found: CheckReport) -> list[str]:
    lines = [f"degrees of freedom: {found.degrees_of_freedom}"]
    if found.rank or found.redundant:
        lines[0] += f" ({found.degrees_of_freedom + found.rank} speeds, constraints of rank {found.rank})"
    if found.doubles:
        more = sum(found.doubles.values())
        speeds, rank = found.degrees_of_freedom + found.rank + more, found.rank + more
        keeps = f"keep{'s its' if len(found.doubles) == 1 else ' their'} coordinates beside them"
        lines.append(
            f"  {', '.join(found.doubles)} {keeps}, by massless doubles of their children "
            f"(with these: {speeds} speeds, constraints of rank {rank})"
        )
    return [*lines, *redundancy_lines(found), *withheld_text(found.withheld, found.withheld_reasons)]


def _states(states: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {word}" for name, word in states.items())


# ----------------------------------------------------------------------------------------------------------------------
# How well the general theorems hold along a run, as text.


def theorems_text(misses: Mapping[str, Miss], units: Units = SI) -> list[str]:
    """Return a line for each theorem: its largest miss beside the sum of absolute terms, and when."""
    width = max(map(len, misses))
    head = "theorems along the run (largest miss, relative to the sum of absolute terms):"
    words = {name: name.replace("_", " ") for name in misses}
    lines = (f"  {words[x]:{width}} {m.relative:.1e} at t = {units.said(m.t, 's')}" for x, m in misses.items())
    return [head, *lines]
