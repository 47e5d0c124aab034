"""States over Nodes for closed forms, in the names of the model: what one is, its parameters, and any state."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from math import inf
from typing import Final

from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter
from multibody_sym.dynamics.constraints.held import held_coordinates
from multibody_sym.dynamics.start.start import Start
from multibody_sym.expressions.units import ENERGY, FORCE
from multibody_sym.kinematics.state import State, state_of
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.parameters import ParameterEntry
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, as_node, slot, symbol
from multibody_sym.scalars.traversal import leaves

_WORK: Final = 10_000
_ASIDE: Final = Fraction(1, 1009)


@dataclass(frozen=True)
class SymbolicState:
    """A state over Nodes, and for each symbol that occurs in it the letter that stands for it in closed forms."""

    state: State
    letters: Mapping[Node, Letter]

    def translated(self, mechanism: Mechanism, node: Node) -> Node:
        """Return an expression in the names of the model as one in this state's symbols; quantities stay."""
        in_slots = evaluate([node], lambda leaf: mechanism.symbols.get(leaf, leaf))
        return as_node(evaluate(in_slots, lambda leaf: self.state.slots.get(leaf, leaf))[0])


def any_state(mechanism: Mechanism, begin: Start, start: State | None = None) -> SymbolicState:
    """Return the state in which time, coordinates and speeds keep their names; the sample is near the start.

    Coordinates that constraints hold stay what they are at a `start` over Nodes, at rest, and have no names.
    """
    parameters, letters = parameter_letters(mechanism)
    q = [symbol(c.name) for c in mechanism.coordinates]
    u = [symbol(s.name) for s in mechanism.speeds]
    time = symbol("t")
    held = {} if start is None else _held(mechanism, begin, start)
    for k, (node, value) in enumerate(zip((time, *q, *u), (0.0, *begin.q, *begin.u), strict=True)):
        # a little aside, where nothing vanishes by chance
        aside = PRECISE.mpf(_ASIDE.numerator) / (_ASIDE.denominator + 97 * k)
        letters[node] = Letter(node, PRECISE.mpf(value) + aside)
    for k, place in held.items():
        del letters[q[k]], letters[u[k]]
        q[k], u[k] = place, ZERO
    return SymbolicState(state_of(mechanism, Node, time, q, u, parameters), letters)


def _held(mechanism: Mechanism, begin: Start, start: State) -> dict[int, Node]:
    """Return where constraints hold coordinates, by their places."""
    return {k: as_node(start.q[k]) for k in held_coordinates(mechanism, begin.q, begin.parameters)}


def parameter_letters(mechanism: Mechanism) -> tuple[list[Node], dict[Node, Letter]]:
    """Return the parameter vector over Nodes (those given by others written out), and the letters of the free ones.

    What a run measures or chooses, on which no acceleration depends, is zero: lengths of ropes, angles of tangents,
    Baumgarte's coefficients.
    """
    entries = mechanism.parameters
    known: dict[Node, Node] = {}
    letters: dict[Node, Letter] = {}
    masses = {body.mass.mass for body in mechanism.bodies}
    never_negative = masses | _coefficients(mechanism)
    turning = _turning(mechanism)
    waiting = list(range(len(entries)))
    while waiting:
        index = waiting.pop(0)
        place, value = slot("parameters", index), entries[index].value
        needed = leaves([value], "slot") if value is not None else []
        if value is None:
            known[place] = ZERO
        elif not needed:
            known[place] = symbol(entries[index].name)
            sample = exact(Field(_WORK), [value], {})[0].sample
            positive = entries[index].positive or (place in never_negative and sample > 0)
            turns = place in turning and not positive
            letters[known[place]] = Letter(known[place], sample, positive, turns=turns)
        elif all(leaf in known for leaf in needed):
            known[place] = as_node(evaluate([value], known)[0])
        else:
            waiting.append(index)
    return [known[slot("parameters", i)] for i in range(len(entries))], letters


def _coefficients(mechanism: Mechanism) -> set[Node]:
    """Return the slots of parameters that are coefficients of friction or restitution: no model has negative ones."""
    alone = [leaves([x], "slot") for x in (*_rubbing(mechanism), *_bouncing(mechanism))]
    return {slots[0] for slots in alone if len(slots) == 1}


def _rubbing(mechanism: Mechanism) -> list[Node]:
    parts = [part for element in _one_way(mechanism) for part in element.frictions]
    return [as_node(x) for part in parts for x in (part.static, part.kinetic)]


def _bouncing(mechanism: Mechanism) -> list[Node]:
    struck = mechanism.impact
    given = [*struck.restitutions.values(), *struck.tangential.values()] if struck is not None else []
    own = [x for element in _one_way(mechanism) for x in (element.restitution, element.tangential_restitution)]
    return [as_node(x) for x in (*own, *given)]


def _one_way(mechanism: Mechanism) -> list[OneWay]:
    return [*mechanism.one_way, *(mechanism.impact.meetings if mechanism.impact is not None else ())]


def limits_of(mechanism: Mechanism, name: str) -> tuple[float, float]:
    """Return the least and the greatest value that a parameter may have, as what it is, or is declared."""
    place = mechanism.symbols[symbol(name)]
    if place in _bouncing(mechanism):
        return 0.0, 1.0
    positive = any(entry.positive for entry in mechanism.parameters if entry.name == name)
    return (0.0 if positive or place in _rubbing(mechanism) else -inf), inf


def _turning(mechanism: Mechanism) -> set[Node]:
    """Return the slots of parameters with which loads are in proportion: what pushes may as well pull.

    Weights, and what has another dimension than a force or a torque, keep the sign that they have.
    """
    weights = {body.mass.mass for body in mechanism.bodies} | set(leaves(map(as_node, mechanism.gravity), "slot"))
    values = [value for load in mechanism.loads for value in _components(getattr(load, "value", ()))]
    slots = {x for value in values for x in _in_proportion(value) if x not in weights}
    entries = {slot("parameters", k): entry for k, entry in enumerate(mechanism.parameters)}
    return {x for x in slots if x in entries and _is_load(entries[x])}


def _components(value: Node | tuple[Node, ...]) -> tuple[Node, ...]:
    return value if isinstance(value, tuple) else (value,)


def _in_proportion(value: Node) -> list[Node]:
    """Return the slots that are factors of the terms of a sum."""
    found, waiting = [], [value]
    while waiting:
        node = waiting.pop()
        if node.op == "slot":
            found.append(node)
        elif node.op in ("neg", "add", "mul"):
            waiting.extend(node.args)
        elif node.op == "div":
            waiting.append(node.args[0])
    return found


def _is_load(entry: ParameterEntry) -> bool:
    return entry.dimension in (None, FORCE, ENERGY)
