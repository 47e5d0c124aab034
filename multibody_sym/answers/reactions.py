"""Forces at a solved start: reactions of joints, tensions, normal forces and friction, by element and component."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import reduce
from operator import add
from typing import Any, Final

from multibody_sym.answers.instant import Solved
from multibody_sym.answers.one_way import Acting, is_active, rubs
from multibody_sym.answers.solution import AT
from multibody_sym.dynamics.programs.pulleys import held_pulleys
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.mechanism import NORMAL, Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.model.mechanism.rows import ExpressionRow, RopeRow, Row
from multibody_sym.model.mechanism.units import REACTION_UNITS, MechanismUnits

Components = dict[str, Value]
Ask = Callable[[Instant], Mapping[str, Any]]

_FORCES: Final = {"contact": "normal", "rope": "tension", "stop": "force", "friction": "normal"}


def reactions_of(solved: Solved) -> dict[str, Components]:
    """Return the reactions of joints, cut ones too, the multipliers of constraints, and forces of one-way elements."""
    joints = {**_of_pulleys(solved), **_of_joints(solved)}
    return {**joints, **_of_constraints(solved), **_of_one_way(solved), **_of_groups(solved)}


def _of_joints(solved: Solved) -> dict[str, Components]:
    found: dict[str, Components] = {}
    withheld = solved.mechanism.withheld
    for name in solved.mechanism.joint_names:

        def of_joint(instant: Instant, name: str = name) -> Mapping[str, Any]:
            return instant.reactions[name]

        values = solved.values(of_joint, REACTION_UNITS)
        undetermined = withheld[name].components if name in withheld else ()
        if undetermined:
            undetermined = (*undetermined, NORMAL)
        found[name] = {c: Value(None, unit=REACTION_UNITS[c]) if c in undetermined else x for c, x in values.items()}
    return found


def _of_pulleys(solved: Solved) -> dict[str, Components]:
    """Return what holds massless pulleys that stand under no joint."""
    found: dict[str, Components] = {}
    for name in held_pulleys(solved.mechanism):

        def of_pulley(instant: Instant, name: str = name) -> Mapping[str, Any]:
            return instant.pulleys[name]

        found[name] = solved.values(of_pulley, REACTION_UNITS)
    return found


def place_of(row: Row) -> tuple[str, str]:
    """Return under which element, and as which component, a row's multiplier stands among the reactions."""
    if isinstance(row, RopeRow):
        return row.told
    return row.name, "multiplier" if isinstance(row, ExpressionRow) else "tension"


def _of_constraints(solved: Solved) -> dict[str, Components]:
    found: dict[str, Components] = {}
    units = MechanismUnits(solved.mechanism).multipliers
    one_way = {row.name for element in solved.mechanism.one_way for row in element.rows}
    for k, row in enumerate(solved.mechanism.rows):
        if row.name.rpartition(".")[0] in solved.mechanism.joint_names or row.name in one_way:
            continue
        name, component = place_of(row)

        def of_row(instant: Instant, component: str = component, k: int = k) -> Mapping[str, Any]:
            return {component: instant.multipliers[k]}

        unit = {component: units[row.name]}
        found.setdefault(name, {})[component] = solved.values(of_row, unit)[component]
    return found


# --- what holds one way only ---------------------------------------------------------------------------------------


def _of_one_way(solved: Solved) -> dict[str, Components]:
    """Return for each element its normal force, tension or force, and its friction; of friction in space two parts."""
    found: dict[str, Components] = {}
    for element in solved.mechanism.one_way:

        def of_element(instant: Instant, element: OneWay = element) -> Mapping[str, Any]:
            return _forces(Acting(instant), element)

        rope = element.normals[0] if element.kind == "rope" else None
        if isinstance(rope, RopeRow):
            found.setdefault(rope.told[0], {}).update(_of_rope(solved, rope))
        else:
            found[element.name] = solved.values(of_element, _units(solved.mechanism, element))
    return found


def _of_rope(solved: Solved, rope: RopeRow) -> Components:
    """Return the tensions of a run of rope that may slacken, two where it rubs on a wheel."""

    def of_rope(instant: Instant) -> Mapping[str, Any]:
        return dict(zip(rope.components, (instant.tensions[name] for name in rope.asked), strict=True))

    return solved.values(of_rope, dict.fromkeys(rope.components, "N"))


def _forces(acting: Acting, element: OneWay) -> dict[str, Any]:
    """Return the forces of an element over any scalar."""
    parts = [part for part in element.frictions if rubs(part)]
    found: dict[str, Any] = {}
    if element.unilateral:
        found[_FORCES[element.kind]] = acting.normal(element)
    elif parts and not parts[0].norm:
        found["normal"] = acting.pressing(element, parts[0])
    acts = is_active(acting.mechanism, element)
    for part in parts:
        forces = acting.friction(part) if acts else [0 for _ in part.rows]
        found |= dict(zip(_names(element, part), forces, strict=True))
    return found


def _names(element: OneWay, part: FrictionPart) -> Iterator[str]:
    """Yield the names of a part's components: `friction`, or `rolling`; with 1 and 2 where it has two."""
    word = "friction" if part is element.frictions[0] else part.name.rpartition(".")[2]
    return (f"{word}_{k}" if len(part.rows) > 1 else word for k in range(1, len(part.rows) + 1))


def _units(mechanism: Mechanism, element: OneWay) -> dict[str, str]:
    told = dict.fromkeys(_FORCES.values(), "N")
    for part in element.frictions:
        told |= {name: unit_of(mechanism, row) for name, row in zip(_names(element, part), part.rows, strict=True)}
    return told


def unit_of(mechanism: Mechanism, row: Row) -> str:
    """Return the unit of a row's force: what the row says, or what its speed tells."""
    return row.unit or MechanismUnits(replace(mechanism, rows=(row,))).multipliers[row.name]


# --- groups --------------------------------------------------------------------------------------------------------


def _of_groups(solved: Solved) -> dict[str, Components]:
    """Return for each contact of several corners the sum of their forces, and where the normal force acts."""
    groups: dict[str, list[OneWay]] = {}
    for element in solved.mechanism.one_way:
        if element.kind == "contact" and element.group not in ("", element.name):
            groups.setdefault(element.group, []).append(element)
    found: dict[str, Components] = {}
    for name, elements in groups.items():

        def of_group(instant: Instant, elements: list[OneWay] = elements) -> Mapping[str, Any]:
            return _summed(Acting(instant), elements)

        units = {**_units(solved.mechanism, elements[0]), **dict.fromkeys(AT, "m")}
        found[name] = solved.values(of_group, units)
        if not found[name]["normal"].unique:  # it may be zero, which acts nowhere
            found[name] |= {at: Value(None, unit="m", unique=False) for at in AT if at in found[name]}
    return found


def _summed(acting: Acting, elements: list[OneWay]) -> dict[str, Any]:
    every = [_forces(acting, element) for element in elements]
    total = {name: reduce(add, (forces[name] for forces in every if name in forces)) for name in every[0]}
    acts = [element for element in elements if is_active(acting.mechanism, element)]
    places = [acting.place(element) for element in acts]
    if acts and all(place is not None for place in places):
        pairs = [(acting.normal(x), place) for x, place in zip(acts, places, strict=True) if place is not None]
        for k, name in enumerate(AT):
            total[name] = sum(force * place[k] for force, place in pairs) / total["normal"]
    return total
