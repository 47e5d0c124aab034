"""Forces at a solved start: reactions of joints, tensions, normal forces and friction, by element and component."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import reduce
from itertools import combinations, product
from operator import add
from typing import Any, Final

from multibody_sym.answers.instant.instant import AGREEMENT, Solved
from multibody_sym.answers.records import Definition
from multibody_sym.derivation.symbolic_start import ActingForces
from multibody_sym.dynamics.programs.quantities import Instant
from multibody_sym.dynamics.programs.reactions import held_pulleys
from multibody_sym.mechanics.law_elements import PRESSING, LawElement, component_names
from multibody_sym.mechanics.mechanism import NORMAL, Mechanism
from multibody_sym.mechanics.row_records import ExpressionRow, RopeRow, Row
from multibody_sym.mechanics.units import REACTION_UNITS, MechanismUnits
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ZERO, symbol
from multibody_sym.text.parser import force_name
from multibody_sym.text.printer import AT
from multibody_sym.text.values import Value

# ----------------------------------------------------------------------------------------------------------------------
# Values of a solved start with formulas in letters where they have none in what is given alone.


def told(
    solved: Solved,
    ask: Callable[[Instant], Mapping[str, Any]],
    units: Mapping[str, str],
    numbers: Collection[str] = (),
    least: float = 0.0,
) -> dict[str, Value]:
    """Return what `ask` finds at the instant as `Solved.values` does, with formulas in letters where there are none.

    What is in `numbers` gets none. Forces up to `least` (N) are none.
    """
    found = solved.values(ask, units, least)
    return {name: x if name in numbers else _in_letters(solved, ask, name, x) for name, x in found.items()}


def _in_letters(solved: Solved, ask: Callable[[Instant], Mapping[str, Any]], name: str, value: Value) -> Value:
    """Return a number with its formula in letters; what vanishes, and what is not unique, has none."""
    if value.expression is not None or not value.value or not value.unique:
        return value
    found = solved.lettered.found
    form = None if found is None else found.of(ask, name)
    if found is None or form is None:
        return value
    near = abs(evaluate_float([form], found.letters.values)[0] - value.value) <= AGREEMENT * abs(value.value)
    return replace(value, expression=form) if near else value


def told_of_state(solved: Solved, name: str, value: Value) -> Value:
    """Return the start value of a coordinate or speed that constraints determine with its formula in letters."""
    if value.expression is not None or not value.value:
        return value
    found = solved.lettered.found
    known = None if found is None else found.definitions.get(symbol(name))
    return value if known is None or known.expression is None else replace(value, expression=known.expression)


def is_lettered(solved: Solved, value: Value) -> bool:
    """Return whether a formula names letters that the model and its start do not have."""
    named = leaves([value.expression], "symbol") if value.expression is not None else []
    return any(x not in solved.symbolic.letters for x in named)


def definitions(solved: Solved, values: Iterable[Value]) -> dict[str, Definition]:
    """Return what the letters of formulas stand for, those of values and of these definitions."""
    forms = [x.expression for x in values if x.expression is not None and is_lettered(solved, x)]
    found = solved.lettered.found if forms else None
    return {} if found is None else {str(node.data): one for node, one in found.needed(forms).items()}


# ----------------------------------------------------------------------------------------------------------------------

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

        def of_element(instant: Instant, element: LawElement = element) -> Mapping[str, Any]:
            return ActingForces.at(instant).of(element)

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


def _units(mechanism: Mechanism, element: LawElement) -> dict[str, str]:
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
    groups: dict[str, list[LawElement]] = {}
    for element in solved.mechanism.one_way:
        if element.kind == "contact" and element.group not in ("", element.name):
            groups.setdefault(element.group, []).append(element)
    found: dict[str, Components] = {}
    for name, elements in groups.items():

        def of_group(instant: Instant, elements: list[LawElement] = elements) -> Mapping[str, Any]:
            return _summed(ActingForces.at(instant), elements)

        def places(instant: Instant, elements: list[LawElement] = elements) -> Mapping[str, Any]:
            return ActingForces.at(instant).middle(elements)

        acting = ActingForces.at(solved.numbers)
        largest = max(abs(float(force)) for element in elements for force in acting.of(element).values())
        found[name] = told(solved, of_group, _units(solved.mechanism, elements[0]), least=_NOTHING * largest)
        normal = found[name]["normal"]
        if not normal.unique and acting.presses_at(elements):  # it may be zero
            found[name] |= dict.fromkeys(AT, Value(None, unit="m", unique=False))
        elif normal.value:
            found[name] |= told(solved, places, dict.fromkeys(AT, "m"))
    return found


def _summed(acting: ActingForces, elements: list[LawElement]) -> dict[str, Any]:
    every = [acting.of(element) for element in elements]
    return {name: reduce(add, (forces[name] for forces in every if name in forces)) for name in every[0]}


# ----------------------------------------------------------------------------------------------------------------------
# Sums of forces that are unique where the single ones of separate contacts are not: two feet share what they bear.


_MOST: Final = 4
"""How many forces are added at most: with either sign, and fewer of them where all together are not unique."""

Signed = tuple[tuple[LawElement, int], ...]


def unique_sums(solved: Solved, reactions: Mapping[str, Mapping[str, Value]]) -> dict[str, Value]:
    """Return the sums of one kind of force over separate contacts that are unique, though none of them is alone.

    By their words, such as `friction(c) + friction(d)`; the forces of one contact's corners stand together anyway.
    """
    found: dict[str, Value] = {}
    for word in ("normal", "friction", "tension"):
        alone = [x for x in solved.mechanism.one_way if _is_open(reactions, x, word)]
        if 2 <= len(alone) <= _MOST:
            found |= _of_word(solved, alone, word, reactions)
    return found


def _is_open(reactions: Mapping[str, Mapping[str, Value]], element: LawElement, word: str) -> bool:
    """Return whether an element has a force that is not unique, and is no part of several that are told together."""
    value = reactions.get(element.name, {}).get(word)
    together = element.group != element.name and word in reactions.get(element.group, {})
    return value is not None and not value.unique and not together


def _of_word(
    solved: Solved, elements: list[LawElement], word: str, reactions: Mapping[str, Mapping[str, Value]]
) -> dict[str, Value]:
    found: dict[str, Value] = {}
    told: set[str] = set()
    for size in range(len(elements), 1, -1):
        for chosen in combinations(elements, size):
            if told & {element.name for element in chosen}:
                continue
            name, value = next(_unique(solved, chosen, word, reactions), ("", None))
            if value is not None:
                found[name] = value
                told |= {element.name for element in chosen}
    return found


def _unique(
    solved: Solved, chosen: tuple[LawElement, ...], word: str, reactions: Mapping[str, Mapping[str, Value]]
) -> Iterator[tuple[str, Value]]:
    """Yield the sums and differences of forces that are unique."""
    for signs in product((1, -1), repeat=len(chosen) - 1):
        signed: Signed = tuple(zip(chosen, (1, *signs), strict=True))
        name = "".join(f" {'+' if sign > 0 else '-'} {force_name(each.name, word)}" for each, sign in signed)[3:]

        def of_sum(instant: Instant, signed: Signed = signed, name: str = name) -> Mapping[str, Any]:
            return {name: sum(sign * ActingForces.at(instant).of(element)[word] for element, sign in signed)}

        value = solved.values(of_sum, {name: reactions[chosen[0].name][word].unit})[name]
        if value.unique and value.value is not None:
            yield name, value
