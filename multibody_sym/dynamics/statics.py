"""Equilibrium by virtual work: positions at which the forces do no work on any admissible displacement.

In such a position a system at rest has no acceleration. With the constraints' tangents X (see `linearization`), xi the
independent deviations, eta the independent speeds, dxi/dt = S eta, and G(xi) the accelerations deta/dt at rest,
equilibria are the roots of G, and one is stable where all eigenvalues of S dG/dxi are real and negative: for forces
with a potential V where the Hessian of V is positive definite on the admissible displacements. Friction, which needs a
speed to act against, is not considered.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from scipy.linalg import null_space

from multibody_sym.dynamics.closing import Rows, closed_near, moved
from multibody_sym.dynamics.forward_dynamics import UNDEFINED
from multibody_sym.dynamics.linearization import Flow, Tangents
from multibody_sym.dynamics.start import start
from multibody_sym.dynamics.steadiness import displaced
from multibody_sym.errors import NoSolutionError
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.model.resolve import mechanism
from multibody_sym.model.system import System

Floats = npt.NDArray[np.float64]

_GUESSES: Final = 24
_STEPS: Final = 25
_HALVINGS: Final = 6
_LARGEST_STEP: Final = 0.5
_CONVERGED: Final = 1e-11
_SAME: Final = 1e-6
_INDIFFERENT: Final = 1e-8
_BESIDE: Final = 0.1
_SECONDS: Final = 10.0
"""CPU time after which no other guess is begun; that from the start always is."""
_SEED: Final = 3


@dataclass(frozen=True)
class Equilibrium:
    """Positions of equilibrium, each with its coordinates by name, and whether they are stable (None: indifferent).

    `free`: for each position the coordinates along which the positions beside it are equilibria too. `complete`:
    whether the search tried all its guesses before its time was up.
    """

    positions: tuple[Mapping[str, float], ...]
    stable: tuple[bool | None, ...]
    free: tuple[tuple[str, ...], ...]
    complete: bool

    def as_json(self) -> dict[str, Any]:
        """Return the object that `equilibrium --json` prints."""
        return {
            "positions": [dict(position) for position in self.positions],
            "stable": list(self.stable),
            "free": [list(names) for names in self.free],
            "complete": self.complete,
        }


def equilibrium(system: System) -> Equilibrium:
    """Return the positions of equilibrium that are found from the start and from positions all around it, at t = 0.

    Raises InputError, and NoSolutionError where there is no start or none is found.
    """
    resolved = mechanism(system)
    begin = start(resolved, project=system.simulation.project)
    rows = Rows(resolved, begin.parameters, range(len(resolved.rows)))
    search = _Search(resolved, Flow(resolved, begin.parameters), rows)
    found, complete = _found(search, np.array(begin.q, dtype=float))
    if not found:
        raise NoSolutionError("no position of equilibrium was found near the start; give other initial coordinates")
    names = [c.name for c in resolved.coordinates]
    positions = tuple(dict(zip(names, search.principal(q).tolist(), strict=True)) for q in found)
    free = tuple(tuple(names[k] for k in np.flatnonzero(search.free(q))) for q in found)
    return Equilibrium(positions, tuple(search.stable(q) for q in found), free, complete)


def _found(search: _Search, start: Floats) -> tuple[list[Floats], bool]:
    """Return the positions found, that from the start first, and whether all guesses could be tried in time."""
    found: list[Floats] = []
    free: list[npt.NDArray[np.bool_]] = []
    until = time.process_time() + _SECONDS
    guesses = deque(_guesses(search.rows.mechanism, start))
    while guesses and time.process_time() < until:
        near = closed_near(search.rows, guesses.popleft())
        q = None if near is None else search.root(near)
        if q is not None and not any(search.same(q, *other) for other in zip(found, free, strict=True)):
            found.append(q)
            free.append(search.free(q))
            guesses.extend(search.mirrored(q))
    return found, not guesses


def _guesses(mechanism: Mechanism, q: Floats) -> list[Floats]:
    """Return the start and positions around it, ever farther away, whose rows may be open."""
    rng = np.random.default_rng(_SEED)
    changes = [rng.uniform(-1.0, 1.0, len(mechanism.speeds)) * np.pi * (k + 1) / _GUESSES for k in range(_GUESSES)]
    return [q, *(moved(mechanism, q, change) for change in changes)]


@dataclass(frozen=True)
class _Search:
    """Newton's method for positions without acceleration."""

    mechanism: Mechanism
    flow: Flow
    rows: Rows

    def root(self, q: Floats) -> Floats | None:
        """Return the position of equilibrium that Newton's method reaches from a closed position, None if it fails."""
        try:
            return self._root(q)
        except (*UNDEFINED, np.linalg.LinAlgError):
            return None

    def _root(self, q: Floats) -> Floats | None:
        at_rest = np.zeros(len(self.mechanism.speeds))
        first = size = self._size(q)
        for _ in range(_STEPS):
            if size <= _CONVERGED * (1.0 + first):
                return q
            tangents, slope = self._slope(q)
            target = -self.flow.accelerations(q, at_rest)[self._speeds(tangents)]
            step = self._columns(tangents) @ np.linalg.lstsq(slope, target, rcond=None)[0]
            step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max()), _LARGEST_STEP))
            ahead = self._line_search(q, step, size)
            if ahead is None:
                return q if size <= _CONVERGED * 1e3 * (1.0 + first) else None
            q, size = ahead
        return None

    def _line_search(self, q: Floats, step: Floats, size: float) -> tuple[Floats, float] | None:
        for halving in range(_HALVINGS):
            ahead = closed_near(self.rows, displaced(self.mechanism, q, step / 2**halving))
            there = np.inf if ahead is None else self._size(ahead)
            if ahead is not None and there < size:
                return ahead, there
        return None

    def _size(self, q: Floats) -> float:
        return float(np.abs(self.flow.accelerations(q, np.zeros(len(self.mechanism.speeds)))).max())

    def _columns(self, tangents: Tangents) -> Floats:
        """Return how all deviations (nu) follow from the independent ones."""
        size = len(self.mechanism.speeds)
        return tangents.X[:size, : sum(k < size for k in tangents.places)]

    def _speeds(self, tangents: Tangents) -> list[int]:
        """Return the independent speeds."""
        size = len(self.mechanism.speeds)
        return [k - size for k in tangents.places if k >= size]

    def _slope(self, q: Floats) -> tuple[Tangents, Floats]:
        """Return the tangents at rest and dG/dxi, of independent accelerations by independent deviations."""
        u = np.zeros(len(self.mechanism.speeds))
        tangents = self.flow.tangents(q, u)
        by_state, _ = self.flow.derivatives(self.flow.known(q, u))
        columns = self._columns(tangents)
        rows = [len(u) + k for k in self._speeds(tangents)]
        return tangents, by_state[rows, : len(u)] @ columns

    def _rates(self, tangents: Tangents) -> Floats:
        """Return S in dxi/dt = S eta, with eta the independent speeds, which need not be those of xi."""
        size, count = len(self.mechanism.speeds), self._columns(tangents).shape[1]
        return tangents.X[size:, count:][tangents.places[:count]]

    def stable(self, q: Floats) -> bool | None:
        """Return whether a position of equilibrium is stable; None where some displacement meets no resistance."""
        tangents, slope = self._slope(q)
        if slope.shape[0] != slope.shape[1]:
            return None
        values = np.linalg.eigvals(self._rates(tangents) @ slope)
        least = _INDIFFERENT * max(float(np.abs(values).max(initial=0.0)), 1e-300)
        if (values.real > least).any() or (np.abs(values.imag) > least).any():
            return False
        return True if (values.real < -least).all() else None

    def free(self, q: Floats) -> npt.NDArray[np.bool_]:
        """Return the coordinates (nq) that change along those displacements on which all positions are equilibria."""
        tangents, slope = self._slope(q)
        found = np.zeros(len(q), dtype=bool)
        for direction in (self._columns(tangents) @ null_space(slope, rcond=_INDIFFERENT)).T:
            step = direction / np.abs(direction).max()
            beside = displaced(self.mechanism, q, _BESIDE * step)
            if self._rests(beside, _INDIFFERENT * (1.0 + float(np.abs(slope).max()))):
                found |= np.abs(beside - q) > _SAME
        return found

    def _rests(self, q: Floats, allowed: float) -> bool:
        """Return whether no acceleration beside a position is larger than allowed."""
        near = closed_near(self.rows, q)
        try:
            return near is not None and self._size(near) <= allowed
        except UNDEFINED:
            return False

    def mirrored(self, q: Floats) -> list[Floats]:
        """Return a position with its angles or its lengths turned about: mechanisms are often symmetric."""
        units = [c.unit for c in self.mechanism.coordinates]
        return [np.where([x == unit for x in units], -q, q) for unit in ("rad", "m") if unit in units]

    def principal(self, q: Floats) -> Floats:
        """Return coordinates with angles between -pi and pi."""
        angles = np.array([c.unit == "rad" for c in self.mechanism.coordinates], dtype=bool)
        turned = q - 2 * np.pi * np.round(q / (2 * np.pi))
        return np.where(angles, turned, q)

    def same(self, a: Floats, b: Floats, free: npt.NDArray[np.bool_]) -> bool:
        """Return whether two positions are the same up to whole turns and to what is free in the second."""
        angles = np.array([c.unit == "rad" for c in self.mechanism.coordinates], dtype=bool)
        difference = np.where(free, 0.0, np.where(angles, 2 * np.sin((a - b) / 2), a - b))
        return bool(np.abs(difference).max(initial=0.0) <= _SAME * (1.0 + np.abs(b).max(initial=0.0)))
