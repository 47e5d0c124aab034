"""Rows of a mechanism in numbers at a state, by Programs (`closing_programs`) that somebody made callable."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, fields
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing_programs import CHANGE, CLOSING, PLACES
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import PIVOT, without_rounding
from multibody_sym.records import dataclass

Functions = Mapping[str, Callable[..., tuple[Floats, ...]]]
"""Programs by name, ready to be called with their inputs; `inputs` among them."""
_NO_MODES: Final = np.empty(0)
_REMEMBERED: Final = 4


@dataclass(frozen=True)
class RowNumbers:
    """What `closing` says at a state, by the names of its outputs; H (ns x nu) and H G^-1 of all rows."""

    phi: Floats
    phidot: Floats
    gamma: Floats
    power: Floats
    aligned: Floats
    length: float
    shares: Floats
    jacobian: Floats
    weighted: Floats

    @cached_property
    def finite(self) -> bool:
        """Whether all of them are."""
        return all(bool(np.isfinite(getattr(self, each.name)).all()) for each in fields(self))

    @property
    def has_inertia(self) -> bool:
        """Whether all pivots of the mass matrix are positive beside its diagonal."""
        return bool((self.shares > PIVOT * len(self.shares)).all())


@dataclass(frozen=True, eq=False)
class CompiledRows:
    """The rows of a `mechanism` by callable Programs."""

    mechanism: Mechanism
    functions: Functions
    _latest: tuple[tuple[bytes, RowNumbers], ...] = field(default=(), init=False)

    def at(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> RowNumbers:
        """Return the rows at a state; numbers that are not finite where they have no value."""
        key = np.concatenate([(t,), q, u, parameters]).tobytes()
        for known, found in self._latest:  # a state is looked at from several sides, one after the other
            if known == key:
                return found
        found = self._at(t, q, u, parameters)
        object.__setattr__(self, "_latest", ((key, found), *self._latest[: _REMEMBERED - 1]))
        return found

    def _at(self, t: float, q: Floats, u: Floats, parameters: Sequence[float]) -> RowNumbers:
        with np.errstate(all="ignore"):
            found = self.functions[CLOSING](*self._arguments(t, q, u, parameters))
        phi, phidot, gamma, exerted, power, aligned, length, shares, jacobian, weighted = found
        H = without_rounding(self._dense(jacobian, self._places[0]), exerted)
        moves = H.any(axis=1, keepdims=True)
        return RowNumbers(
            phi,
            phidot,
            gamma,
            power,
            aligned,
            float(length),
            shares,
            H,
            np.where(moves, self._dense(weighted, self._places[1]), 0.0),
        )

    def change(self, t: float, q: Floats, u: Floats, parameters: Sequence[float], x: Floats) -> Floats:
        """Return G^-1 x (nu) at a state."""
        (change,) = self.functions[CHANGE](*self._arguments(t, q, u, parameters), x)
        return change

    @cached_property
    def acting(self) -> Floats:
        """Return which rows (ns) do not vanish everywhere: 1, and 0 for the others."""
        return self._constants[2]

    def _arguments(
        self, t: float, q: Floats, u: Floats, parameters: Sequence[float]
    ) -> tuple[float | Floats, ...]:
        known = t, q, u, np.asarray(parameters, dtype=float)
        inputs = self.functions["inputs"](*known)[0] if self.mechanism.inputs else np.empty(0)
        return (*known, inputs, _NO_MODES)

    @cached_property
    def _constants(self) -> tuple[Floats, ...]:
        sizes = len(self.mechanism.coordinates), len(self.mechanism.speeds), len(self.mechanism.parameters)
        return self.functions[PLACES](0.0, *map(np.zeros, sizes), np.zeros(len(self.mechanism.inputs)), _NO_MODES)

    @cached_property
    def _places(self) -> list[tuple[Floats, Floats]]:
        found = [places.astype(int) for places in self._constants[:2]]
        return [(places[:, 0], places[:, 1]) for places in found]

    def _dense(self, values: Floats, places: tuple[Floats, Floats]) -> Floats:
        matrix = np.zeros((len(self.mechanism.rows), len(self.mechanism.speeds)))
        matrix[places] = values
        return matrix
