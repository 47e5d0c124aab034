"""The letters of forces on bodies that are cut free: those that the equations of the same bodies have."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from multibody_sym.answers.cut_free.records import Key
from multibody_sym.dynamics.derivation.letters import (
    FRICTION,
    MOMENT,
    NORMAL,
    SPRING,
    TENSION,
    Lettered,
    component_label,
    force_unit,
    guide_normal,
    own_letter,
    row_letter,
    spelt,
)
from multibody_sym.dynamics.programs.tensions import ropes
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.parameters import in_letters, letters_of
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.loads import PointPull, PointSpring
from multibody_sym.model.mechanism.mass import mass_of
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.scene.arrows import letter_of


def force_names(system: System, mechanism: Mechanism, acting: Collection[Key]) -> Mapping[Key, str]:
    """Return the letter of each of the forces that act, as `solve --steps` has it: T, N1, F, A_x, M_A.

    What is zero just now acts too, so that the numbers of letters do not change with time. Weights are m*g where that
    is short, declared forces have the letter of their value, else their name; multipliers without a letter lambda_name.
    """
    guides = {key for key in map(_guide, mechanism.bodies) if key and key[1] not in system.joints}  # a moving ground's
    lettered = [each for each in _lettered(mechanism) if each.symbol in guides.union(acting)]
    joints = {key: component_label(*key[1:]) for key in acting if key[0] == "joint"}
    found = {key: label.text for key, label in spelt(mechanism, lettered, joints).items()}
    book = letters_of(system.parameters)
    return {key: found.get(key) or in_letters(_own(system, key), book) for key in acting}


def _lettered(mechanism: Mechanism) -> Iterator[Lettered]:
    """Yield all forces of rows, joints that guide, springs and ropes, in the order of the equations."""
    rubbing = [row for row in ropes(mechanism) if row.rubs]
    one_way = {row.name for element in mechanism.one_way for row in element.rows}
    for row in mechanism.rows:
        letter = row_letter(row, mechanism)
        if not letter or row.name in one_way:
            continue
        if not isinstance(row, RopeRow):
            yield Lettered(("row", row.name), letter, row.name)
        elif not row.rubs:
            yield _tension(row)
    for body in mechanism.bodies:
        guide = _guide(body)
        if guide:
            yield Lettered(guide, NORMAL, body.joint_name)
    for load in mechanism.loads:
        if isinstance(load, (PointSpring, PointPull)) and load.line is not None:
            yield Lettered(("load", load.name), SPRING, load.name)
    for row in rubbing:
        for k, asked in enumerate(row.asked):
            own = f"{row.label}{row.run + k}" if row.label else ""
            yield Lettered(("tension", asked), TENSION, row.told[0], own)
    for element in mechanism.one_way:
        yield from _of_element(mechanism, element)


def _guide(body: TreeBody) -> Key:
    """Return what the normal force of a joint that slides in the plane is, nothing for other joints."""
    across = guide_normal(body)
    return () if across is None else ("joint", body.joint_name, COMPONENTS[across])


def _of_element(mechanism: Mechanism, element: OneWay) -> Iterator[Lettered]:
    row = element.normals[0]
    if isinstance(row, RopeRow):
        if not row.rubs:
            yield _tension(row)
    elif element.unilateral:
        yield Lettered(("row", row.name), NORMAL, element.name)
    for part in (part for part in element.frictions if part.rubs):
        for each in part.rows:
            letter = MOMENT if force_unit(each, mechanism) == "N*m" else FRICTION
            yield Lettered(("row", each.name), letter, part.name)


def _tension(row: RopeRow) -> Lettered:
    return Lettered(("tension", row.asked[0]), TENSION, row.told[0], own_letter(row))


def _own(system: System, key: Key) -> str:
    """Return what forces are called that the equations have no letter for."""
    kind, name = key[0], key[1]
    if kind == "weight":
        return _weight(system, name)
    if kind == "friction":
        return f"{FRICTION}_{name}"
    if kind in ("load", "drive"):
        return letter_of(name, getattr(system.forces.get(name), "value", ()))
    return f"lambda_{re.sub(r'[^A-Za-z0-9_]+', '_', name)}" if kind == "row" else name


def _weight(system: System, body: str) -> str:
    """Return m*g where both are letters, else G with the body's name."""
    given: list[Any] = [node for node in system.gravity if node.shadow != 0]
    mass = text(mass_of(system.bodies[body]).mass) if body in system.bodies else ""
    g = text(given[0]).removeprefix("-") if len(given) == 1 else ""
    factors = mass.split("*")
    return f"{mass}*{g}" if g.isidentifier() and all(each.isidentifier() for each in factors) else f"G_{body}"
