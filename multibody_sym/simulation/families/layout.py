"""Where the numbers of a plain mechanism come from, and which of them are fit to start with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from multibody_sym.dynamics.constraints.closing import normalize
from multibody_sym.dynamics.start.parameters import evaluation_order, value_or_nan
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import Source
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Compiled
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, slot
from multibody_sym.simulation.runs.runnable import Numbers

Values = Mapping[str, Sequence[float]]
"""Values of some runs by name: of each name as many."""


@dataclass(frozen=True, eq=False)
class Layout:
    """Where the numbers of a plain mechanism come from: those that are `varied`, those that follow, and all others."""

    mechanism: Mechanism
    formalism: str
    compiled: Compiled
    look: Compiled
    varied: tuple[str, ...]
    initial: tuple[str, ...]

    def numbers(self, parameters: Values, initial: Values, count: int) -> Numbers:
        """Return parameters (count, np), coordinates (count, nq) and speeds (count, nu); nan where there is none."""
        found = np.tile(self._constants, (count, 1))
        for name, values in parameters.items():
            found[:, self.mechanism.parameters.places[name]] = values
        state = np.tile(self._start, (count, 1))
        for name, values in initial.items():
            state[:, self._places[name]] = values
        for k in range(count) if self._following or self._named else ():
            self._follow(found[k], state[k])
        q, u = np.split(state, [len(self.mechanism.coordinates)], axis=1)
        q, u = np.ascontiguousarray(q), np.ascontiguousarray(u)
        if any(body.quaternions for body in self.mechanism.bodies):
            for k in range(count):
                normalize(self.mechanism, q[k])
        return Numbers(found, q, u)

    def cleared(self, numbers: Numbers) -> Any:
        """Return which starts (count,) are cleared."""
        inputs = np.zeros(len(self.mechanism.inputs))
        given = numbers.q0, numbers.u0, numbers.parameters
        finite, positive = self.look.map("quick_look", 0.0, *given, inputs, np.empty(0))
        fine = [np.isfinite(values).all(axis=1) for values in (*given, finite)]
        declared = numbers.parameters[:, self._positive] > 0.0
        return np.all([*fine, declared.all(axis=1), (positive > 0.0).all(axis=1)], axis=0)

    def _follow(self, parameters: Floats, state: Floats) -> None:
        """Fill in what follows from other parameters."""
        values = {slot("parameters", k): x for k, x in enumerate(parameters.tolist())}
        for k, node in self._following:
            parameters[k] = values[slot("parameters", k)] = value_or_nan(node, values)
        for k, node in self._named:
            state[k] = value_or_nan(node, values)

    @cached_property
    def _constants(self) -> Floats:
        chosen = [entry.value is None and entry.source is Source.CHOSEN for entry in self.mechanism.parameters]
        values = [entry.value for entry in self.mechanism.parameters]
        return np.array([0.0 if run else _constant(node) for run, node in zip(chosen, values, strict=True)])

    @cached_property
    def _following(self) -> list[tuple[int, Node]]:
        """The parameters that follow from others, each after those it names."""
        entries, given = self.mechanism.parameters, dict.fromkeys(self.varied, 0.0)
        order = evaluation_order(self.mechanism, given)
        pairs = [(k, entries[k].value) for k in order if entries[k].name not in given]
        return [(k, node) for k, node in pairs if node is not None and node.shadow is None]

    @cached_property
    def _state(self) -> list[Node]:
        begun = [coordinate.initial for coordinate in self.mechanism.coordinates]
        return begun + [speed.initial for speed in self.mechanism.speeds]

    @cached_property
    def _places(self) -> dict[str, int]:
        named = [coordinate.name for coordinate in self.mechanism.coordinates]
        return {name: k for k, name in enumerate([*named, *(speed.name for speed in self.mechanism.speeds)])}

    @cached_property
    def _start(self) -> Floats:
        return np.array([_constant(node) for node in self._state], dtype=float)

    @cached_property
    def _named(self) -> list[tuple[int, Node]]:
        """The places of coordinates and speeds that begin where an expression of parameters says."""
        varied = {self._places[name] for name in self.initial}
        return [(k, node) for k, node in enumerate(self._state) if node.shadow is None and k not in varied]

    @cached_property
    def _positive(self) -> list[int]:
        declared = enumerate(self.mechanism.parameters)
        return [k for k, entry in declared if entry.positive and entry.source is Source.DECLARED]


def _constant(node: Node | None) -> float:
    """Return the value of a constant, nan of what is none."""
    if node is None or node.shadow is None:
        return np.nan
    try:
        return evaluate_float([node], {})[0]
    except UNDEFINED:
        return np.nan
