"""Forces at a solved start: reactions of joints, tensions, normal forces and friction, by element and component."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from functools import reduce
from itertools import combinations, product
from operator import add
from typing import Any, Final

from multibody_sym.answers.instant.instant import AGREEMENT, SolvedInstant
from multibody_sym.derivation.symbolic_start import ActingForces
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.programs.reactions import held_pulleys
from multibody_sym.mechanics.law_elements import PRESSING, LawElement, component_names
from multibody_sym.mechanics.mechanism import NORMAL, Mechanism
from multibody_sym.mechanics.row_records import ExpressionRow, RopeRow, Row
from multibody_sym.mechanics.units import REACTION_UNITS, MechanismUnits
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO
from multibody_sym.stages import stage
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import AT
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# Values of a solved start with formulas in letters where they have none in what is given alone.


def with_letters(
    solved: SolvedInstant,
    ask: Callable[[StateQuantities], Mapping[str, Any]],
    units: Mapping[str, str],
    numbers: Collection[str] = (),
    least: float = 0.0,
) -> dict[str, Value]:
    """Return what `ask` finds at the instant as `Solved.values` does, with formulas in letters where there are none.

    What is in `numbers` gets none. Forces up to `least` (N) are none. Where motions alone are asked for,
    speeds that loops decide are no answers: what names them has formulas in letters too.
    """
    values = solved.values(ask, units, least)
    speeds = solved.speeds_of_loops
    for name, value in values.items():
        known = value.expression is not None and not speeds.intersection(leaves([value.expression], "symbol"))
        if name in numbers or known or not value.value or not value.unique:
            continue
        letters = solved.lettered.found
        form = None if letters is None else letters.of(ask, name)
        if letters is not None and form is not None and speeds:
            form = letters.without(form, speeds)
        if letters is not None and form is not None:
            number = evaluate_float([form], letters.letters.values)[0]
            if abs(number - value.value) <= AGREEMENT * abs(value.value):
                values[name] = replace(value, expression=form)
    return values


def is_lettered(solved: SolvedInstant, value: Value) -> bool:
    """Return whether a formula names letters that the model and its start do not have."""
    named = leaves([value.expression], "symbol") if value.expression is not None else []
    return any(x not in solved.symbolic.letters for x in named)


# ----------------------------------------------------------------------------------------------------------------------

Components = dict[str, Value]

_NOTHING: Final = 1e-12
"""The part of the largest force of corners up to which their sum is what rounding leaves of it."""


@stage("reactions")
def reactions_of(solved: SolvedInstant) -> dict[str, Components]:
    """Return the reactions of joints, cut ones too, the multipliers of constraints, and forces of one-way elements."""
    found: dict[str, Components] = {}
    for name in held_pulleys(solved.mechanism):  # massless ones that stand under no joint

        def of_pulley(instant: StateQuantities, name: str = name) -> Mapping[str, Any]:
            return instant.pulleys[name]

        found[name] = with_letters(solved, of_pulley, REACTION_UNITS)
    found |= _of_joints(solved)
    return {**found, **_of_constraints(solved), **_of_one_way(solved), **_of_groups(solved)}


def _of_joints(solved: SolvedInstant) -> dict[str, Components]:
    found: dict[str, Components] = {}
    mechanism = solved.mechanism
    for name in mechanism.joint_names:

        def of_joint(instant: StateQuantities, name: str = name) -> Mapping[str, Any]:
            return instant.reactions[name]

        # a joint's own freedoms leave components to what drives it, which needs no letters
        steps = [free.step for body in mechanism.bodies if body.joint_name == name for free in body.free_steps]
        axes = [(kind, axis) for x in steps for kind, every in (("m", x.turns), ("f", x.slides)) for axis in every]
        free = {f"{kind}{axis}" for kind, along in axes for axis, x in zip("xyz", along, strict=True) if x is not ZERO}
        values = with_letters(solved, of_joint, REACTION_UNITS, numbers=free)
        undetermined = mechanism.withheld[name].components if name in mechanism.withheld else ()
        if undetermined:
            undetermined = (*undetermined, NORMAL)
        found[name] = {c: Value(None, unit=REACTION_UNITS[c]) if c in undetermined else x for c, x in values.items()}
    return found


def place_of(row: Row) -> tuple[str, str]:
    """Return under which element, and as which component, a row's multiplier stands among the reactions."""
    if row.rope_run is not None:
        return row.rope_run.told
    return row.name, "multiplier" if isinstance(row, ExpressionRow) else "tension"


def _of_constraints(solved: SolvedInstant) -> dict[str, Components]:
    found: dict[str, Components] = {}
    units = MechanismUnits(solved.mechanism).multipliers
    one_way = {row.name for element in solved.mechanism.one_way for row in element.rows}
    for k, row in enumerate(solved.mechanism.rows):
        if row.name.rpartition(".")[0] in solved.mechanism.joint_names or row.name in one_way:
            continue
        name, component = place_of(row)

        def of_row(instant: StateQuantities, component: str = component, k: int = k) -> Mapping[str, Any]:
            return {component: instant.multipliers[k]}

        found.setdefault(name, {}).update(with_letters(solved, of_row, {component: units[row.name]}))
    return found


def _of_one_way(solved: SolvedInstant) -> dict[str, Components]:
    """Return for each element its normal force, tension or force, and its friction; of friction in space two parts.

    A run of rope that may slacken has two tensions where it rubs on a wheel.
    """
    found: dict[str, Components] = {}
    for element in solved.mechanism.one_way:
        rope = element.normals[0].rope_run if element.kind == "rope" else None
        if rope is not None:

            def of_rope(instant: StateQuantities, rope: RopeRow = rope) -> Mapping[str, Any]:
                return dict(zip(rope.components, (instant.tensions[name] for name in rope.asked), strict=True))

            tensions = with_letters(solved, of_rope, dict.fromkeys(rope.components, "N"))
            found.setdefault(rope.told[0], {}).update(tensions)
        else:

            def of_element(instant: StateQuantities, element: LawElement = element) -> Mapping[str, Any]:
                return ActingForces.at(instant).of(element)

            found[element.name] = with_letters(solved, of_element, _units(solved.mechanism, element))
    return found


def _units(mechanism: Mechanism, element: LawElement) -> dict[str, str]:
    units = dict.fromkeys(PRESSING.values(), "N")
    if element.kind == "friction":
        units[PRESSING["friction"]] = element.normals[0].unit or "N"
    for part in element.frictions:
        named = zip(component_names(element, part), part.rows, strict=True)
        units |= {name: unit_of(mechanism, row) for name, row in named}
    return units


def unit_of(mechanism: Mechanism, row: Row) -> str:
    """Return the unit of a row's force: what the row says, or what its speed tells."""
    return row.unit or MechanismUnits(replace(mechanism, rows=(row,))).multipliers[row.name]


def _of_groups(solved: SolvedInstant) -> dict[str, Components]:
    """Return for each contact of several corners the sum of their forces, and where the normal force acts.

    One of nothing acts nowhere.
    """
    groups: dict[str, list[LawElement]] = {}
    for element in solved.mechanism.one_way:
        if element.kind == "contact" and element.group not in ("", element.name):
            groups.setdefault(element.group, []).append(element)
    found: dict[str, Components] = {}
    for name, elements in groups.items():

        def of_group(instant: StateQuantities, elements: list[LawElement] = elements) -> Mapping[str, Any]:
            every = [ActingForces.at(instant).of(element) for element in elements]
            return {name: reduce(add, (forces[name] for forces in every if name in forces)) for name in every[0]}

        def places(instant: StateQuantities, elements: list[LawElement] = elements) -> Mapping[str, Any]:
            return ActingForces.at(instant).middle(elements)

        acting = ActingForces.at(solved.numbers)
        largest = max(abs(float(force)) for element in elements for force in acting.of(element).values())
        found[name] = with_letters(solved, of_group, _units(solved.mechanism, elements[0]), least=_NOTHING * largest)
        normal = found[name]["normal"]
        if not normal.unique and acting.presses_at(elements):  # it may be zero
            found[name] |= dict.fromkeys(AT, Value(None, unit="m", unique=False))
        elif normal.value:
            found[name] |= with_letters(solved, places, dict.fromkeys(AT, "m"))
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Sums of forces that are unique where the single ones of separate contacts are not: two feet share what they bear.


_MOST: Final = 4
"""How many forces are added at most: with either sign, and fewer of them where all together are not unique."""

Signed = tuple[tuple[LawElement, int], ...]


def unique_sums(solved: SolvedInstant, reactions: Mapping[str, Mapping[str, Value]]) -> dict[str, Value]:
    """Return the sums of one kind of force over separate contacts that are unique, though none of them is alone.

    By their words, such as `friction(c) + friction(d)`; the forces of one contact's corners stand together anyway.
    """
    found: dict[str, Value] = {}
    for word in ("normal", "friction", "tension"):
        separate = []
        for element in solved.mechanism.one_way:
            value = reactions.get(element.name, {}).get(word)
            together = element.group != element.name and word in reactions.get(element.group, {})
            if value is not None and not value.unique and not together:
                separate.append(element)
        if not 2 <= len(separate) <= _MOST:
            continue
        summed: set[str] = set()
        for chosen in (x for size in range(len(separate), 1, -1) for x in combinations(separate, size)):
            names = {element.name for element in chosen}
            unit = reactions[chosen[0].name][word].unit
            first = None if summed & names else next(_unique_sums_of(solved, chosen, word, unit), None)
            if first is not None:
                found[first[0]] = first[1]
                summed |= names
    return found


def _unique_sums_of(
    solved: SolvedInstant, chosen: tuple[LawElement, ...], word: str, unit: str
) -> Iterator[tuple[str, Value]]:
    """Yield the sums and differences of forces that are unique."""
    for signs in product((1, -1), repeat=len(chosen) - 1):
        signed: Signed = tuple(zip(chosen, (1, *signs), strict=True))
        name = "".join(f" {'+' if sign > 0 else '-'} {force_name(each.name, word)}" for each, sign in signed)[3:]

        def of_sum(instant: StateQuantities, signed: Signed = signed, name: str = name) -> Mapping[str, Any]:
            return {name: sum(sign * ActingForces.at(instant).of(element)[word] for element, sign in signed)}

        value = solved.values(of_sum, {name: unit})[name]
        if value.unique and value.value is not None:
            yield name, value
