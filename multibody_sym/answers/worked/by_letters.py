"""Accelerations of loops that grow too long to be eliminated, step by step in letters, each with what it stands for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import sympy

from multibody_sym.answers.in_letters.formulas import InLetters
from multibody_sym.answers.in_letters.record import Definition
from multibody_sym.answers.worked.record import Formula, Line
from multibody_sym.dynamics.derivation.notation import NAME, latex_name
from multibody_sym.dynamics.derivation.record import Label
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy

_OF_DEPENDENT = "from how loops close", "from the rate of that", "from the second rate of that"


class ByLetters:
    """What gives the accelerations of a start: where loops lead, ratios, inertias and loads by their letters.

    `spelling`, `places` and `values` are those of the letters that steps do not have otherwise.
    """

    def __init__(self, found: InLetters, mechanism: Mechanism, symbols: Symbols) -> None:
        every = found.coordinates.all
        found.instant  # noqa: B018 - defines the accelerations
        accelerations = {x.own[2]: symbols.accelerations[x.u] for x in every}
        self._needed = found.needed([node for node in accelerations if found.defined(node)])
        declared = (*mechanism.coordinates, *mechanism.speeds, *mechanism.parameters)
        made = (*symbols.coordinates, *symbols.speeds, *symbols.parameters)
        self._leaves: dict[Node, Any] = {symbol(each.name): s for each, s in zip(declared, made, strict=True)}
        self._leaves.update(accelerations)
        own = [node for node in self._needed if node not in self._leaves]
        self._leaves.update((node, sympy.Symbol(str(node.data), real=True)) for node in own)
        labels = {node: Label(str(node.data), latex_name(str(node.data))) for node in own}
        self.spelling = {self._leaves[node]: label for node, label in labels.items()}
        self.places = {self._leaves[node]: (NAME, k) for k, node in enumerate(own)}
        self.values = {self._leaves[node]: self._needed[node].value for node in own}
        dependent = [every[k].own for k in found.loops.dependent]
        self._says = {x[k]: _OF_DEPENDENT[k] for k in (0, 1) for x in dependent}
        self._says.update((node, self._needed[node].says) for node in own)
        self._says.update((every[k].own[2], "so") for k in found.loops.free)
        self._says.update((x[2], _OF_DEPENDENT[2]) for x in dependent)

    def lines(self) -> Iterator[Line]:
        """Yield what gives each letter, after what it is found from."""
        for node in self._says:
            one = self._needed.get(node)
            sides = self._sides(node, one) if one is not None else ()
            if sides:
                told = tuple(to_sympy(side, self._leaves) for side in sides)
                yield Formula(told, before=(self._says[node],))

    @staticmethod
    def _sides(node: Node, one: Definition) -> tuple[Node, ...]:
        """Return what is equal; nothing for what is told as a number."""
        return (node, one.expression) if one.expression is not None else one.equation or ()
