"""The letters that a start has: parameters, and coordinates and speeds that are not plainly zero or a parameter."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

from multibody_sym.algebra.quotients import PRECISE, Letter
from multibody_sym.answers.in_letters.coordinates import TIME, Coordinates, at_start
from multibody_sym.answers.in_letters.letters import Letters, substituted
from multibody_sym.answers.in_letters.record import Definition
from multibody_sym.dynamics.start.start import Start
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, ZERO, Node, as_node, symbol

_ASIDE: Final = 0.001
"""Time (s) at which formulas are looked at before they are differentiated: nothing vanishes there by chance."""


def free_name(wanted: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: the wanted one, or that with a number."""
    plain = wanted.replace(".", "_")
    numbered = (plain, *(f"{plain}_{k}" for k in range(2, len(taken) + 3)))
    return next(name for name in numbered if name not in taken)


def acceleration_letters(mechanism: Mechanism, taken: Collection[str]) -> list[str]:
    """Return a letter for each speed's rate: a_phi for that of the speed of phi."""
    names = [speed.name for speed in mechanism.speeds]
    for body in mechanism.bodies:
        for i, k in body.rate_pairs:
            names[k] = mechanism.coordinates[i].name
    return [free_name(f"a_{name}", taken) for name in names]


def letters_of_start(
    coordinates: Coordinates, begin: Start, udot: Sequence[float]
) -> tuple[Letters, dict[Node, Definition]]:
    """Return all letters with their values, and those of the state and accelerations with what was declared for them.

    What is declared as zero, right angles or a parameter stands for itself.
    """
    letters = _letters_of_model(coordinates, begin, udot)
    definitions, plain = dict[Node, Definition](), dict[Node, Node]()
    state, mechanism = coordinates.symbolic.state, coordinates.mechanism
    for x in coordinates.all:
        declared = as_node(state.q[x.q]), as_node(state.u[x.u])
        units = mechanism.coordinates[x.q].unit, mechanism.speeds[x.u].unit
        for k, (node, unit) in enumerate(zip(declared, units, strict=True)):
            if _stands_for_itself(node, x.own[k]):
                letters.put_in(x.letters[k], x.before[k] + x.sense * node)
                plain[x.own[k]] = node
            else:
                given = None if node is x.own[k] else node
                definitions[x.own[k]] = Definition(letters.values[x.own[k]], given, unit=unit)
    letters.shown = {letter: substituted(shown, plain) for letter, shown in letters.shown.items()}
    return letters, definitions


def _letters_of_model(coordinates: Coordinates, begin: Start, udot: Sequence[float]) -> Letters:
    """Return letters for the parameters, the time, and all coordinates with their rates."""
    letters, mechanism = Letters(coordinates.in_names), coordinates.mechanism
    named = {symbol(c.name) for c in mechanism.coordinates} | {symbol(s.name) for s in mechanism.speeds}
    for node, letter in coordinates.symbolic.letters.items():
        if node not in named:
            letters.add(node, float(letter.sample), letter)
    letters.add(TIME, 0.0, Letter(TIME, PRECISE.mpf(_ASIDE)))
    letters.known[TIME] = letters.field.constant(0)
    for x in coordinates.all:
        letters.values.update(zip(x.own, (begin.q[x.q], begin.u[x.u], float(udot[x.u])), strict=True))
    for x in coordinates.all:
        for node, shown in zip(x.letters, x.shown, strict=True):
            letters.add(node, evaluate_float([at_start(shown)], letters.values)[0])
    return letters


def _stands_for_itself(node: Node, own: Node) -> bool:
    """Return whether what is declared is zero, right angles, or a parameter."""
    size = node.args[0] if node.op == "neg" else node
    right_angles = node.shadow is not None and (2 * node / PI).shadow in range(-8, 9)
    return node is ZERO or right_angles or (size.op == "symbol" and size is not own)
