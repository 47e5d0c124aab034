"""Forces at a solved start: reactions of joints, tensions, normal forces and friction, by element and component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import reduce
from operator import add
from typing import Any, Final

from multibody_sym.answers.in_letters.told import told
from multibody_sym.answers.instant import Solved
from multibody_sym.answers.one_way import Acting
from multibody_sym.dynamics.programs.pulleys import held_pulleys
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.expressions.components import AT
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.mechanism import NORMAL, Mechanism
from multibody_sym.model.mechanism.one_way import PRESSING, OneWay, component_names
from multibody_sym.model.mechanism.rows import ExpressionRow, RopeRow, Row
from multibody_sym.model.mechanism.units import REACTION_UNITS, MechanismUnits
from multibody_sym.scalars.node import ZERO

Components = dict[str, Value]
Ask = Callable[[Instant], Mapping[str, Any]]

_NOTHING: Final = 1e-12
"""The part of the largest force of corners up to which their sum is what rounding leaves of it."""


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

        values = told(solved, of_joint, REACTION_UNITS, numbers=_free_components(solved.mechanism, name))
        undetermined = withheld[name].components if name in withheld else ()
        if undetermined:
            undetermined = (*undetermined, NORMAL)
        found[name] = {c: Value(None, unit=REACTION_UNITS[c]) if c in undetermined else x for c, x in values.items()}
    return found


def _free_components(mechanism: Mechanism, joint: str) -> set[str]:
    """Return the components that a joint's own freedoms leave to what drives it, which needs no letters."""
    steps = [free.step for body in mechanism.bodies if body.joint_name == joint for free in body.free_steps]
    axes = [(kind, axis) for step in steps for kind, every in (("m", step.turns), ("f", step.slides)) for axis in every]
    return {f"{kind}{name}" for kind, axis in axes for name, x in zip("xyz", axis, strict=True) if x is not ZERO}


def _of_pulleys(solved: Solved) -> dict[str, Components]:
    """Return what holds massless pulleys that stand under no joint."""
    found: dict[str, Components] = {}
    for name in held_pulleys(solved.mechanism):

        def of_pulley(instant: Instant, name: str = name) -> Mapping[str, Any]:
            return instant.pulleys[name]

        found[name] = told(solved, of_pulley, REACTION_UNITS)
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
        found.setdefault(name, {})[component] = told(solved, of_row, unit)[component]
    return found


# --- what holds one way only ---------------------------------------------------------------------------------------


def _of_one_way(solved: Solved) -> dict[str, Components]:
    """Return for each element its normal force, tension or force, and its friction; of friction in space two parts."""
    found: dict[str, Components] = {}
    for element in solved.mechanism.one_way:

        def of_element(instant: Instant, element: OneWay = element) -> Mapping[str, Any]:
            return Acting.at(instant).of(element)

        rope = element.normals[0] if element.kind == "rope" else None
        if isinstance(rope, RopeRow):
            found.setdefault(rope.told[0], {}).update(_of_rope(solved, rope))
        else:
            found[element.name] = told(solved, of_element, _units(solved.mechanism, element))
    return found


def _of_rope(solved: Solved, rope: RopeRow) -> Components:
    """Return the tensions of a run of rope that may slacken, two where it rubs on a wheel."""

    def of_rope(instant: Instant) -> Mapping[str, Any]:
        return dict(zip(rope.components, (instant.tensions[name] for name in rope.asked), strict=True))

    return told(solved, of_rope, dict.fromkeys(rope.components, "N"))


def _units(mechanism: Mechanism, element: OneWay) -> dict[str, str]:
    told = dict.fromkeys(PRESSING.values(), "N")
    for part in element.frictions:
        named = zip(component_names(element, part), part.rows, strict=True)
        told |= {name: unit_of(mechanism, row) for name, row in named}
    return told


def unit_of(mechanism: Mechanism, row: Row) -> str:
    """Return the unit of a row's force: what the row says, or what its speed tells."""
    return row.unit or MechanismUnits(replace(mechanism, rows=(row,))).multipliers[row.name]


# --- groups --------------------------------------------------------------------------------------------------------


def _of_groups(solved: Solved) -> dict[str, Components]:
    """Return for each contact of several corners the sum of their forces, and where the normal force acts.

    One of nothing acts nowhere.
    """
    groups: dict[str, list[OneWay]] = {}
    for element in solved.mechanism.one_way:
        if element.kind == "contact" and element.group not in ("", element.name):
            groups.setdefault(element.group, []).append(element)
    found: dict[str, Components] = {}
    for name, elements in groups.items():

        def of_group(instant: Instant, elements: list[OneWay] = elements) -> Mapping[str, Any]:
            return _summed(Acting.at(instant), elements)

        def places(instant: Instant, elements: list[OneWay] = elements) -> Mapping[str, Any]:
            return Acting.at(instant).middle(elements)

        acting = Acting.at(solved.numbers)
        largest = max(abs(float(force)) for element in elements for force in acting.of(element).values())
        found[name] = told(solved, of_group, _units(solved.mechanism, elements[0]), least=_NOTHING * largest)
        normal = found[name]["normal"]
        if not normal.unique and acting.presses_at(elements):  # it may be zero
            found[name] |= dict.fromkeys(AT, Value(None, unit="m", unique=False))
        elif normal.value:
            found[name] |= told(solved, places, dict.fromkeys(AT, "m"))
    return found


def _summed(acting: Acting, elements: list[OneWay]) -> dict[str, Any]:
    every = [acting.of(element) for element in elements]
    return {name: reduce(add, (forces[name] for forces in every if name in forces)) for name in every[0]}


