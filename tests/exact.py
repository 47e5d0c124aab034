"""Exact derivatives of a case's kinematics as a second route: expressions in slots, differentiated as Nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from operator import add, mul, neg, truediv
from typing import Any

import numpy as np
from mechanisms import Case
from mpmath import mp, mpf

from multibody_sym.mechanics.mechanism import TIME
from multibody_sym.mechanics.motion import Motion, coordinate_rates, motion_of, slot_state
from multibody_sym.scalars.calculus import tangents
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import ONE, Node, as_node, slot, symbol

State = tuple[float, list[float], list[float]]


class Exact:
    """The motion of a case over Nodes, with rates along u and udot."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.q = [slot("q", i) for i in range(len(case.mechanism.coordinates))]
        self.u = [slot("u", i) for i in range(len(case.mechanism.speeds))]
        self.udot = [slot("udot", i) for i in range(len(case.mechanism.speeds))]

    @cached_property
    def motion(self) -> Motion:
        return motion_of(self.case.mechanism, slot_state(self.case.mechanism))

    def rates(self, nodes: Sequence[Any], *, time: bool = True) -> list[Node]:
        """Return d/dt of expressions, for given udot."""
        qdot = [as_node(rate) for rate in coordinate_rates(self.case.mechanism, self.q, self.u)]
        seeds = dict(zip([*self.q, *self.u], [*qdot, *self.udot], strict=True))
        return tangents(list(map(as_node, nodes)), {**seeds, TIME: ONE} if time else seeds)

    def values(self, nodes: Sequence[Any], state: State, udot: Sequence[float] = ()) -> np.ndarray:
        """Return expressions in numbers."""
        slots = dict(self.case.state(*state).slots)
        slots.update({leaf: float(x) for leaf, x in zip(self.udot, udot, strict=False)})
        return np.array(evaluate_float(list(map(as_node, nodes)), slots))


def flat(matrix: Any) -> list[Any]:
    """Return a nested tuple's elements in one list."""
    return [x for part in matrix for x in flat(part)] if isinstance(matrix, (tuple, list)) else [matrix]


def exactly(nodes: Sequence[Node], given: Mapping[str, str], t: Fraction) -> list[Any]:
    """Return values of expressions in names with decimal values, and t, with 50 digits."""
    numbers = {**{x: Fraction(y) for x, y in given.items()}, "t": t}
    work = {"pow": mp.power, "div": truediv, "mul": mul, "add": add, "neg": neg}
    with mp.workdps(50):
        values: dict[Node, Any] = {symbol(x): mpf(y.numerator) / y.denominator for x, y in numbers.items()}
        for node in postorder(nodes):
            if node not in values:
                values[node] = (
                    mpf(Fraction(node.data).numerator) / Fraction(node.data).denominator
                    if node.op == "number"
                    else (work.get(node.op) or getattr(mp, node.op))(*(values[x] for x in node.args))
                )
    return [values[node] for node in nodes]
