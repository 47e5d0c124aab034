"""The letters of unknown forces as a book has them: tensions T, rods S, normal forces N, friction F, A_x and M_A.

In: a Mechanism and the symbols of its forces. Out: a Label for each, and its meaning in words.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from multibody_sym.derivation.notation import Label, Symbols, latex_name
from multibody_sym.mechanics.mechanism import Mechanism, TreeBody
from multibody_sym.mechanics.row_records import AngleRow, DistanceRow, GearRow, PositionRow, RopeRow, Row, TurningRow
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.steps import is_flat
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO
from multibody_sym.text.printer import COMPONENTS

TENSION, ROD, NORMAL, FRICTION, TOOTH, MOMENT, SPRING = "T", "S", "N", "F", "Z", "M", "P"
_SHORT: Final = 2
_AXES: Final = "xyz"
_WORDS: Final = {
    TENSION: "tension of", ROD: "force of rod", NORMAL: "normal force at", FRICTION: "friction at",
    TOOTH: "force at the teeth of", MOMENT: "moment at",
}


@dataclass(frozen=True)
class LetteredForce:
    """A force that has a letter: its symbol, the letter, the element that names it where the letter is taken.

    `own` is the letter that the model gives it.
    """

    symbol: Any
    letter: str
    element: str
    own: str = ""


def force_letters(
    mechanism: Mechanism, symbols: Symbols, used: Collection[Any], further: Sequence[LetteredForce] = ()
) -> dict[Any, Label]:
    """Return how the unknown forces that are `used` are spelt; `further` are those that no row and joint has.

    One force of a kind has the letter alone. Several have numbers in the order of the model, friction that of its
    normal force. Where the model itself uses such a name, all of the kind have the letter with the element's name.
    """
    lettered = [*_forces_with_letters(mechanism, symbols), *further]
    joints = {}  # A_x and M_A, also for the rows of cut joints
    for index, body in enumerate(mechanism.bodies):
        for k, component in enumerate(COMPONENTS):
            joints[symbols.reactions[6 * index + k]] = component_label(body.joint_name, component)
    for row, s in zip(mechanism.rows, symbols.multipliers, strict=True):
        joint, dot, rest = row.name.rpartition(".")
        if isinstance(row, (PositionRow, AngleRow)) and dot and rest[-1:] in _AXES:
            joints[s] = component_label(joint, ("m" if isinstance(row, AngleRow) else "f") + rest[-1])
    own = {s: label for s, label in joints.items() if s in used}
    return spell_forces(mechanism, [each for each in lettered if each.symbol in used], own)


def spell_forces(
    mechanism: Mechanism, lettered: Sequence[LetteredForce], joints: Mapping[Any, Label]
) -> dict[Any, Label]:
    """Return how forces are spelt by their symbols, which may be anything: the one place that numbers their letters.

    `joints` are labels of joints' reactions, for those without a letter of their own. No two labels are equal, and
    none is a name of the model.
    """
    declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
    taken = {"t", *mechanism.inputs, *(each.name for each in declared)}
    found: dict[Any, Label] = {}
    found.update((each.symbol, Label(each.own, latex_name(each.own))) for each in lettered if each.own)
    lettered = [each for each in lettered if not each.own]
    order = {each.name: k for k, each in enumerate(mechanism.one_way)}
    lettered.sort(key=lambda each: order.get(each.element, -1))
    pressing: dict[str, str] = {}
    for letter in sorted({each.letter for each in lettered}, key=lambda letter: letter != NORMAL):
        kind = [each for each in lettered if each.letter == letter]
        numbers = [""] if len(kind) == 1 else [str(k + 1) for k in range(len(kind))]
        of_normals = [pressing.get(each.element, "") for each in kind]
        if letter == FRICTION and all(of_normals) and len(set(of_normals)) == len(kind):
            numbers = of_normals
        found.update(_spell_kind(kind, numbers, taken))
        if letter == NORMAL:
            elements = [each.element for each in kind]
            pressing = {name: k for name, k in zip(elements, numbers, strict=True) if elements.count(name) == 1}
    found.update((s, label) for s, label in joints.items() if s not in found)
    unique = {}
    for s, (text, latex) in found.items():
        while text in taken:
            text, latex = text + "_", latex + "{}'"
        taken.add(text)
        unique[s] = Label(text, latex)
    return unique


def describe_forces(mechanism: Mechanism, symbols: Symbols, unknown: Collection[Any]) -> dict[Any, str]:
    """Return what each multiplier, and each reaction among `unknown` ones, is in words."""
    named = {each.symbol: f"{_WORDS[each.letter]} {each.element}" for each in _forces_with_letters(mechanism, symbols)}
    rows = dict(zip(symbols.multipliers, mechanism.rows, strict=True))
    joints = [(body.joint_name, c) for body in mechanism.bodies for c in COMPONENTS]
    reactions = zip(symbols.reactions, joints, strict=True)
    found = {s: named.get(s, f"multiplier of {row.name}") for s, row in rows.items()}
    components = {s: f"component {c} of the reaction of {joint}" for s, (joint, c) in reactions if s in unknown}
    return {**found, **{s: named.get(s, words) for s, words in components.items()}}


def _spell_kind(
    kind: Sequence[LetteredForce], numbers: Sequence[str], taken: Collection[str]
) -> dict[Any, Label]:
    """Return T, or T1, T2 .., or T_string .. for the forces of one kind."""
    letter = kind[0].letter
    if any(letter + number in taken for number in numbers):
        elements = [each.element for each in kind]
        several = [elements[: k + 1].count(name) if elements.count(name) > 1 else "" for k, name in enumerate(elements)]
        return {each.symbol: _with_element(letter, each.element, str(k)) for each, k in zip(kind, several, strict=True)}
    subscripts = [f"_{{{number}}}" if number else "" for number in numbers]
    return {
        each.symbol: Label(letter + number, letter + subscript)
        for each, number, subscript in zip(kind, numbers, subscripts, strict=True)
    }


def _with_element(letter: str, element: str, axis: str = "") -> Label:
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", element)
    words = element.replace("\\", "").replace("_", r"\_")
    under = rf"\mathrm{{{words}}}" if element.isalnum() and len(element) > 1 else words
    if not element.isascii() or re.search(r"[^A-Za-z0-9_]", element):
        under = rf"\text{{{plain}}}".replace("_", r"\_")
    parts = [part for part in (under, axis) if part]
    return Label("_".join(part for part in (letter, plain, axis) if part), f"{letter}_{{{','.join(parts)}}}")


def _forces_with_letters(mechanism: Mechanism, symbols: Symbols) -> Iterable[LetteredForce]:
    """Yield the forces of rows that have a letter, and the normal forces of joints that slide in the plane."""
    elements = row_elements(mechanism)
    for row, s in zip(mechanism.rows, symbols.multipliers, strict=True):
        letter = row_letter(row, mechanism)
        if letter:
            plain = row.plain
            rope = plain if isinstance(plain, RopeRow) else None
            name = rope.told[0] if rope is not None else elements.get(row.name, row.name)
            yield LetteredForce(s, letter, name, own_letter(rope) if rope is not None else "")
    for index, body in enumerate(mechanism.bodies):
        across = guide_normal(body)
        if across is not None:
            yield LetteredForce(symbols.reactions[6 * index + across], NORMAL, body.joint_name)


def own_letter(rope: RopeRow) -> str:
    """Return the letter that a model gives the tension of a run of rope, with its number; none for a mean tension."""
    return "" if rope.rubs or not rope.label else f"{rope.label}{rope.run or ''}"


def row_elements(mechanism: Mechanism) -> dict[str, str]:
    """Return for each row of a one-way element the name of the element, or of its part that rubs."""
    found = {row.name: each.name for each in mechanism.one_way for row in each.normals}
    parts = (part for each in mechanism.one_way for part in each.frictions)
    return {**found, **{row.name: part.name for part in parts for row in part.rows}}


def row_letter(row: Row, mechanism: Mechanism) -> str:
    """Return the letter of a row's multiplier, empty where books have none."""
    if isinstance(row, TurningRow):
        return MOMENT
    if row.surfaces is not None:
        return NORMAL if row.is_holonomic else FRICTION
    for element in mechanism.one_way:
        if any(row.name == friction.name for part in element.frictions for friction in part.rows):
            return MOMENT if force_unit(row, mechanism) == "N*m" else FRICTION
        if any(row.name == normal.name for normal in element.normals):
            return TENSION if element.kind == "rope" else NORMAL
    kinds: dict[type[Row], str] = {RopeRow: TENSION, DistanceRow: ROD, GearRow: TOOTH}
    return next((letter for kind, letter in kinds.items() if isinstance(row, kind)), "")


def force_unit(row: Row, mechanism: Mechanism) -> str:
    """Return the unit of a row's multiplier, whether the row is among the mechanism's or not."""
    return MechanismUnits(replace(mechanism, rows=(row,))).multipliers[row.name]


def guide_normal(body: TreeBody) -> int | None:
    """Return which component of a joint's reaction is normal to the one axis in the plane along which it slides."""
    slides = [axis for step in body.steps for axis in step.slides]
    if len(slides) != 1 or len(body.steps) != 1 or not is_flat(slides[0]):
        return None
    zeros = [k for k in range(2) if slides[0][k] is ZERO]
    return zeros[0] if len(zeros) == 1 else None


def component_label(joint: str, component: str) -> Label:
    """Return A_x for fx of a joint A, M_A for mz and M_A_x for mx; R_hinge_x where the joint has a longer name."""
    turns, axis = component[0] == "m", component[1]
    if turns:
        return _with_element("M", joint, "" if axis == "z" else axis)
    if len(joint) <= _SHORT and joint.isalnum():
        return _with_element(joint, "", axis)
    return _with_element("R", joint, axis)
