"""Answers to `ask` just after an impact: expressions of the speeds then, and of impulses where they name reactions."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import add
from typing import Any, Final

from multibody_sym.answers.impact.resting import ImpactInstant, length, row_impulses
from multibody_sym.answers.instant import Solved, with_outputs_put_in
from multibody_sym.dynamics.programs.quantities import Instant, quantities
from multibody_sym.errors import at
from multibody_sym.expressions.values import Value
from multibody_sym.model.mechanism.one_way import exerted_by
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.traversal import leaves
from multibody_sym.scalars.vectors import S

_IMPULSES: Final = ("reaction", "tension", "multiplier")


def answered_after(solved: Solved) -> dict[str, Value]:
    """Return the answers to all questions of a system."""
    found: dict[str, Value] = {}
    solved = with_outputs_put_in(solved)
    for name, question in solved.system.ask.items():
        with at("ask", name):
            assert question.value is not None
            found[name] = _answer(solved, question.value)
    return found


def _along_rows(instant: Instant, leaf: Node) -> list[list[str]]:
    """Return the rows of what strikes, by component of an impulse that is asked; nothing for joints and constraints."""
    if leaf.data[0] != "reaction":
        return []
    name, component = leaf.data[1]
    found = (exerted_by(element).get(name, {}) for element in instant.motion.mechanism.one_way)
    along = [rows[component] for rows in found if component in rows]
    return [[row.name for row in rows] for rows in zip(*along, strict=True)]


def _impulse(instant: ImpactInstant, along: list[list[str]]) -> S:
    """Return the sum of impulses of rows, or the length of the sums where there are several components."""
    sums = [reduce(add, row_impulses(instant, rows)) for rows in along]
    return length(sums) if len(sums) > 1 else sums[0]


def _answer(solved: Solved, node: Node) -> Value:
    in_slots = evaluate([node], lambda leaf: solved.mechanism.symbols.get(leaf, leaf))
    asked = leaves(in_slots, "quantity")
    impulses = [leaf for leaf in asked if leaf.data[0] in _IMPULSES]
    others = [leaf for leaf in asked if leaf not in impulses]

    def ask(instant: Instant) -> Mapping[str, Any]:
        assert isinstance(instant, ImpactInstant)
        later = instant.later
        nothing = [0] * len(later.state.u), [0] * len(later.mechanism.rows)
        known = quantities(later, *nothing, others)
        of_rows = {leaf: _along_rows(instant, leaf) for leaf in impulses}
        known |= {leaf: _impulse(instant, rows) for leaf, rows in of_rows.items() if rows}
        named = [leaf for leaf, rows in of_rows.items() if not rows]
        known |= quantities(instant.motion, instant.udot, instant.multipliers, named)
        return {"": evaluate(in_slots, {**later.state.slots, **known}, later.state.scalar)[0]}

    (unit,) = MechanismUnits(solved.mechanism).of([node])
    if impulses:  # of a force alone it is that times s, of other expressions nobody knows
        unit = f"{unit}*s" if unit and in_slots[0] in impulses else ""
    return solved.values(ask, {"": unit})[""]
