"""State: the values of all slots of a mechanism at one instant, over one of the three scalars."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from multibody_sym.mechanics.law_elements import INSTANT, JUMPED
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.program.statements import Array
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, slot
from multibody_sym.scalars.vectors import S, Vec


@dataclass(frozen=True)
class State:
    """Time, coordinates q (nq), speeds u (nu), parameters and inputs over `scalar` (float, Node or sympy.Expr)."""

    scalar: type
    q: tuple[S, ...]
    u: tuple[S, ...]
    slots: Mapping[Node, S]

    def values(self, nodes: Sequence[Node], known: Mapping[Node, S] | None = None) -> list[Any]:
        """Return expressions in slots, and in further leaves that are `known`, over this state's scalar."""
        return evaluate(nodes, {**self.slots, **known} if known else self.slots, self.scalar)

    def vector(self, nodes: Sequence[Node]) -> Vec:
        """Return three expressions in slots as a vector over this state's scalar."""
        x, y, z = self.values(nodes)
        return x, y, z


def state_of(
    mechanism: Mechanism,
    scalar: type,
    t: S,
    q: Sequence[S],
    u: Sequence[S],
    parameters: Sequence[S],
    inputs: Sequence[S] | None = None,
) -> State:
    """Return the state with these values; inputs that are not given are computed from their declared expressions."""
    slots: dict[Node, S] = {slot("t", 0): t, INSTANT: t, JUMPED: 0}
    for array, values in (("q", q), ("u", u), ("parameters", parameters)):
        slots.update((slot(array, i), value) for i, value in enumerate(values))
    if inputs is None:
        inputs = evaluate(list(mechanism.inputs.values()), slots, scalar)
    slots.update((slot("inputs", i), value) for i, value in enumerate(inputs))
    return State(scalar, tuple(q), tuple(u), slots)


def slot_state(mechanism: Mechanism) -> State:
    """Return the state whose values are the slots themselves, from which Programs are made."""
    return state_of(
        mechanism,
        Node,
        slot("t", 0),
        [slot("q", i) for i in range(len(mechanism.coordinates))],
        [slot("u", i) for i in range(len(mechanism.speeds))],
        [slot("parameters", i) for i in range(len(mechanism.parameters))],
        [slot("inputs", i) for i in range(len(mechanism.inputs))],
    )


def arrays(mechanism: Mechanism) -> tuple[Array, ...]:
    """Return the inputs that every Program of a system has, in their order."""
    return (
        Array("t", ()),
        Array("q", (len(mechanism.coordinates),)),
        Array("u", (len(mechanism.speeds),)),
        Array("parameters", (len(mechanism.parameters),)),
        Array("inputs", (len(mechanism.inputs),)),
        Array("modes", (len(mechanism.mode_numbers),)),
    )
