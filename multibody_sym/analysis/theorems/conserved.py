"""What a system conserves: constant combinations of momenta, energy and Jacobi's integral whose rates vanish.

The rates are exact expressions, looked at in random positions, speeds and times that the constraints allow, not along a
run. Floats propose the combinations; 50 digits decide, and give their coefficients: what is left is below 1e-30 of its
terms, or it is not conserved. What has one value in all states, as the momentum across a plane, is not told.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.theorems.candidates import Candidate, Kind, candidates
from multibody_sym.analysis.theorems.precise import ZERO_BELOW, Number, Precise, evaluated, solved
from multibody_sym.analysis.theorems.symmetry import symmetry
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.start.sampling import sampled_states
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import MultibodyError, NoSolutionError
from multibody_sym.kinematics.state import State
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, slot

MOST: Final = 60
"""Speeds beyond which expressions of the rates would be too long."""
MANY: Final = 6
"""Speeds beyond which their momenta are looked at one by one, not in combinations."""
_SPARE: Final = 3
_PROPOSED: Final = 1e-7
"""The part of a column that combinations of others leave up to which 50 digits are asked."""
_BY_FLOATS: Final = 1e-11
"""The same part below which floats decide alone, where expressions have no value in 50 digits."""
_SAME: Final = 1e-6
"""The part of a combination that others leave below which it says nothing new."""
_SEED: Final = 11
_ORDER: Final[tuple[Kind, ...]] = ("momentum", "axis", "centre", "energy", "jacobi", "speed")
"""The plainest first."""
_COMBINED: Final[tuple[Kind, ...]] = ("momentum", "axis", "centre", "speed", "energy", "jacobi")
"""What is combined with what stands before it."""
_TOLD: Final[tuple[Kind, ...]] = ("energy", "jacobi", "momentum", "axis", "centre", "speed")


@dataclass(frozen=True)
class Conserved:
    """A quantity that stays constant: its `name`, an expression that outputs may have, and the `symmetry` behind it.

    `coefficients` of what it is made of, by name; `exact`: decided in 50 digits, not by floats alone.
    """

    name: str
    kind: Kind
    symmetry: str
    coefficients: Mapping[str, float]
    exact: bool = True


def conserved(mechanism: Mechanism, begin: Start) -> list[Conserved]:
    """Return what a mechanism conserves, in its mode at the start; energy first.

    Of more than `MOST` speeds nothing is told, which would take long.
    """
    if len(mechanism.speeds) > MOST:
        return []
    pool = candidates(mechanism)
    alone = len(mechanism.speeds) if len(mechanism.speeds) > MANY else 0
    states = sampled_states(mechanism, begin, len(pool) - alone + _SPARE, _SEED)[1:]
    table = _tabulated(mechanism, pool, states)
    if table is None:
        return []
    kinds = [x.kind for x in pool]
    columns = sorted(range(len(pool)), key=lambda k: (not alone or kinds[k] != "speed", _COMBINED.index(kinds[k])))
    decide = _Decision(mechanism, begin, pool, states)
    trivial = table.constant(columns, alone)
    known = [table.scaled(x) for x in trivial]
    proposed = [x for x in table.vanishing(columns, alone) if not _in_span(table.scaled(x), known)]
    chosen = _chosen(pool, table, [x for x in proposed if decide.confirms(x)], trivial)
    found = [_told(mechanism, pool, decide.precise_of(x), decide.exact) for x in chosen]
    return sorted(found, key=lambda x: _TOLD.index(x.kind))


def conserved_quantities(
    system: System,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> list[Conserved]:
    """Return what a system conserves, from its start on; nothing where it has no start.

    `parameters` .. `project`: what the call changes of the system (`Changes`); the formalism makes no difference.
    """
    asked = Changes(parameters, initial, inputs, coordinates, project).of(system)
    try:
        state = examined_state(asked)
    except NoSolutionError:
        return []
    return conserved(state.mechanism, state.start)


Combination = dict[int, float]
"""Coefficients by the numbers of candidates."""


@dataclass(frozen=True)
class _Table:
    """Values and rates (states x candidates), divided by the `sizes` (candidates) of either."""

    values: Floats
    rates: Floats
    sizes: Floats

    def vanishing(self, columns: Sequence[int], alone: int) -> list[Combination]:
        """Return the combinations whose rates vanish but for rounding."""
        return list(self._dependent(self.rates, columns, alone))

    def constant(self, columns: Sequence[int], alone: int) -> list[Combination]:
        """Return the combinations that have one value in all states."""
        return list(self._dependent(self.values - self.values[0], columns, alone))

    def _dependent(self, matrix: Floats, columns: Sequence[int], alone: int) -> Iterator[Combination]:
        """Yield each column that earlier ones combine to; the first `alone` of them are combined with none."""
        basis: list[int] = []
        for place, k in enumerate(columns):
            column = matrix[:, k]
            used = basis if place >= alone else []
            x = least_squares(matrix[:, used], column) if used else np.zeros(0)
            rest = column - matrix[:, used] @ x if used else column
            if np.abs(rest).max(initial=0.0) <= _PROPOSED:
                mixed = {j: -c * self.sizes[k] / self.sizes[j] for j, c in zip(used, x, strict=True) if _counts(c)}
                yield {k: 1.0, **mixed}
            elif place >= alone:
                basis.append(k)

    def scaled(self, combination: Combination) -> Floats:
        """Return a combination as a unit vector over the scaled candidates."""
        vector = np.zeros(len(self.sizes))
        for k, c in combination.items():
            vector[k] = c * self.sizes[k]
        vector /= np.abs(vector).max()  # squares of energies may pass all floats
        found: Floats = vector / np.linalg.norm(vector)
        return found


def _counts(coefficient: float) -> bool:
    return abs(coefficient) > _PROPOSED


def _tabulated(mechanism: Mechanism, pool: Sequence[Candidate], states: Sequence[State]) -> _Table | None:
    """Return the table over those states at which all has a value; None where these are too few to tell."""
    nodes = [x for each in pool for x in (each.value, each.rate)]
    rows = []
    for state in states:
        try:
            udot = forward_dynamics(composite_body(mechanism, state)).udot.tolist()
            rows.append(evaluate_float(nodes, {**state.slots, **{slot("udot", k): x for k, x in enumerate(udot)}}))
        except (*UNDEFINED, MultibodyError):
            continue
    if len(rows) < len(states) - _SPARE + 1 or not states:
        return None
    both = np.array(rows, dtype=float).reshape(len(rows), len(pool), 2)
    if not np.isfinite(both).all():
        return None
    sizes = np.abs(both).max(axis=(0, 2), initial=0.0)
    sizes[sizes == 0.0] = 1.0
    return _Table(both[:, :, 0] / sizes, both[:, :, 1] / sizes, sizes)


class _Decision:
    """Whether combinations' rates vanish in 50 digits, with the coefficients at which they do."""

    def __init__(
        self, mechanism: Mechanism, begin: Start, pool: Sequence[Candidate], states: Sequence[State]
    ) -> None:
        self._pool = pool
        self._precise = Precise(mechanism, begin.parameters)
        self._states = iter(states)
        self._slots: list[Mapping[Node, Number]] = []
        self._found: dict[int, Combination] = {}

    def confirms(self, proposed: Combination) -> bool:
        """Return whether a combination is conserved."""
        key = id(proposed)
        others = list(proposed)[1:]
        rows = self._rates(list(proposed), len(others) + 2)
        if rows is None:
            self._found[key] = proposed
            return True
        try:
            x = solved([row[1:] for row in rows[: len(others)]], [-row[0] for row in rows[: len(others)]])
        except MultibodyError:
            return False
        for row in rows:
            terms = [row[0], *(a * b for a, b in zip(row[1:], x, strict=True))]
            if abs(sum(terms)) > ZERO_BELOW * (1 + sum(map(abs, terms))):
                return False
        self._found[key] = dict(zip(proposed, [1.0, *map(float, x)], strict=True))
        return True

    def precise_of(self, proposed: Combination) -> Combination:
        """Return a confirmed combination with its coefficients."""
        return self._found[id(proposed)]

    @property
    def exact(self) -> bool:
        """Return whether 50 digits decided, not floats."""
        return bool(self._slots)

    def _rates(self, places: Sequence[int], count: int) -> list[list[Number]] | None:
        """Return the rates of candidates at so many states; None where they have no value in 50 digits."""
        while len(self._slots) < count:
            state = next(self._states, None)
            if state is None:
                return None
            try:
                self._slots.append(self._precise.at(state))
            except (*UNDEFINED, MultibodyError):
                continue
        try:
            return [evaluated([self._pool[k].rate for k in places], leaf) for leaf in islice(self._slots, count)]
        except (*UNDEFINED, MultibodyError):
            return None


def _chosen(
    pool: Sequence[Candidate], table: _Table, proposed: Sequence[Combination], trivial: Sequence[Combination]
) -> list[Combination]:
    """Return independent combinations, the plainest first, that do not follow from others or from constants."""

    def plainness(x: Combination) -> tuple[int, int, int]:
        first = pool[next(iter(x))]
        return len(x), _ORDER.index(first.kind), first.place

    turning = {pool[k].place for x in proposed for k in x if pool[k].kind == "axis"}
    turning -= {pool[k].place for x in trivial if len(x) == 1 for k in x if pool[k].kind == "axis"}
    known = [table.scaled(x) for x in trivial]
    found: list[Combination] = []
    for x in sorted(proposed, key=plainness):
        if any(pool[k].kind == "centre" and pool[k].place in turning for k in x) or _follows(pool, x, found):
            continue
        vector = table.scaled(x)
        if _in_span(vector, known):
            continue
        known.append(vector)
        found.append(x)
    return found


def _in_span(vector: Floats, known: Sequence[Floats]) -> bool:
    """Return whether a unit vector is a combination of others."""
    if not known:
        return False
    basis = np.array(known).T
    rest = vector - basis @ least_squares(basis, vector)
    return bool(np.linalg.norm(rest) <= _SAME)


def _follows(pool: Sequence[Candidate], x: Combination, found: Sequence[Combination]) -> bool:
    """Return whether a combination is of energies where one of energies is conserved already."""
    energies = [[k for k in each if pool[k].kind in ("energy", "jacobi")] for each in (x, *found)]
    return bool(energies[0]) and any(energies[1:])


def _told(mechanism: Mechanism, pool: Sequence[Candidate], combination: Combination, exact: bool) -> Conserved:
    named = {pool[k].name: c for k, c in combination.items()}
    parts = [(pool[k], c) for k, c in combination.items()]
    first = "energy" if any(p.kind == "energy" for p, _ in parts) else parts[0][0].kind
    return Conserved(_expression(named), first, symmetry(mechanism, parts), named, exact)


def _expression(named: Mapping[str, float]) -> str:
    """Return a combination in the language of expressions."""
    text = ""
    for name, c in named.items():
        sign = " - " if c < 0 else " + "
        size = abs(round(c, 12))
        term = name if size == 1.0 else f"{size:.12g}*{name}"
        text += f"{sign}{term}" if text else (f"-{term}" if c < 0 else term)
    return text
