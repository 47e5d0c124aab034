"""Equilibrium by virtual work: positions at which the forces do no work on any admissible displacement.

In such a position a system at rest has no acceleration. With the constraints' tangents X (see `deviations`), xi the
independent deviations, eta the independent speeds, dxi/dt = S eta, and G(xi) the accelerations deta/dt at rest,
equilibria are the roots of G, and one is stable where all eigenvalues of dG/dxi S are real and negative: for forces
with a potential V where the Hessian of V is positive definite on the admissible displacements. Friction has no part.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import field
from itertools import count
from typing import Any, Final

import numpy as np

from multibody_sym.analysis.all_rest import are_all
from multibody_sym.analysis.deviations import Flow, Tangents
from multibody_sym.analysis.none_found import none_found
from multibody_sym.analysis.places import Mask, Places
from multibody_sym.analysis.springs_passed import passed
from multibody_sym.analysis.steadiness import displaced
from multibody_sym.dynamics.constraints.closing import Rows, closed_near
from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import examined, on_numbers
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.kinematics.masses.rates import verify_kept
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.numerics.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.numerics.rank import ALIKE, FLAT, least_squares, null_space
from multibody_sym.records import dataclass

_GUESSES: Final = 24
"""How many guesses around the start are tried, and how many on end must find nothing before the search ends."""
MOST: Final = 400
_STEPS: Final = 25
_HALVINGS: Final = 6
_LARGEST_STEP: Final = 0.5
_CONVERGED: Final = 1e-11
_TURNED: Final = 4
"""How many positions of a family are tried with half-turns of each of its angles."""
_POLISHING: Final = 60
_POLISHED: Final = 1e-9
_SAME: Final = 1e-6
_BESIDE: Final = 0.1
_EDGE: Final = 1e-5
"""How far beside a position forces are to have values, in m and rad: farther than it may be from their edge."""
SECONDS: Final = 10.0
"""CPU time after which no other guess is begun, less than half of it where none led to a position of rest."""
_LESS: Final = 6.0
_SEED: Final = 3


@dataclass(frozen=True)
class Equilibrium:
    """Positions of equilibrium, each with its coordinates by name, and whether they are stable.

    `stable` is None where a position is indifferent, and where it is `one_sided`: beside it a force has no real value.

    `free`: for each position the coordinates along which the positions beside it are equilibria too; `beyond`: the
    springs whose end lies beyond their other end. `complete`: whether it is proved that there are no others;
    `cut_short`: whether the time of the search was up before it found nothing new; `guesses`: how many it tried.
    `speeds_left_out`: speeds of the start, which is taken at rest. `units`: the unit of each coordinate.
    """

    positions: tuple[Mapping[str, float], ...]
    stable: tuple[bool | None, ...]
    free: tuple[tuple[str, ...], ...]
    complete: bool
    beyond: tuple[tuple[str, ...], ...] = ()
    cut_short: bool = False
    guesses: int = 0
    speeds_left_out: tuple[str, ...] = ()
    one_sided: tuple[bool, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `equilibrium --json` prints."""
        return {
            "positions": [dict(position) for position in self.positions],
            "stable": list(self.stable),
            "free": [list(names) for names in self.free],
            "beyond": [list(names) for names in self.beyond],
            "complete": self.complete,
            "cut_short": self.cut_short,
            "guesses": self.guesses,
            "speeds_left_out": list(self.speeds_left_out),
            "one_sided": list(self.one_sided),
            "units": dict(self.units),
        }


def equilibrium(
    system: System,
    *,
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
) -> Equilibrium:
    """Return the positions of equilibrium that are found from the start and from positions all around it, at t = 0.

    The system is taken at rest: speeds of the start are left out. Positions are told apart by where bodies are.
    `parameters` .. `project`: what the call changes of the system (`Changes`); `formalism` by name, None for the
    cheapest. Raises InputError, and NoSolutionError where there is no start or none is found.
    """
    return _equilibrium(Changes(parameters, initial, inputs, coordinates, project).of(system), formalism)


@on_numbers
def _equilibrium(system: System, formalism: str | None) -> Equilibrium:
    verify_formalism(formalism)
    resolved = examined(system)
    begin = start(resolved, project=system.simulation.project)
    search = search_from(resolved, begin, formalism)
    found = _found(search, np.array(begin.q, dtype=float))
    if not found.positions:
        raise none_found(search.flow, search.rows, guesses(search.places, search.places.start), in_time=found.cut_short)
    names, places = [c.name for c in resolved.coordinates], search.places
    one_sided = tuple(search.one_sided(q) for q in found.positions)
    return Equilibrium(
        tuple(dict(zip(names, search.told(q), strict=True)) for q in found.positions),
        tuple(None if edge else search.stable(q) for q, edge in zip(found.positions, one_sided, strict=True)),
        tuple(tuple(names[k] for k in np.flatnonzero(free)) for free in found.free),
        are_all(places, found.positions, found.free),
        tuple(passed(places, q) for q in found.positions),
        found.cut_short,
        found.guesses,
        _moving(system, resolved, begin),
        one_sided,
        {c.name: c.unit for c in resolved.coordinates},
    )


def search_from(resolved: Mechanism, begin: Start, formalism: str | None) -> _Search:
    """Return the search for positions of equilibrium from a start."""
    verify_kept(resolved)
    rows = Rows(resolved, begin.parameters, range(len(resolved.rows)))
    flow = Flow(resolved, begin.parameters, formalism)
    return _Search(resolved, flow, rows, Places(flow, rows, np.array(begin.q, dtype=float)))


def _moving(system: System, resolved: Mechanism, begin: Start) -> tuple[str, ...]:
    """Return the speeds of the start that are not zero, in coordinates of joints as they are declared."""
    if resolved.relative is not None:
        begin = start(resolved.relative, project=system.simulation.project)
        resolved = resolved.relative
    size = max(map(abs, begin.u), default=0.0)
    return tuple(s.name for s, u in zip(resolved.speeds, begin.u, strict=True) if abs(u) > _SAME * size)


@dataclass
class _Found:
    """Positions found so far, what is free in each, their potential energies, and how the search went."""

    positions: list[Floats] = field(default_factory=list)
    energies: list[float] = field(default_factory=list)
    free: list[Mask] = field(default_factory=list)
    guesses: int = 0
    cut_short: bool = False

    def takes(self, search: _Search, q: Floats) -> bool:
        """Take a position, and return whether it is new; of two that are one, the one more like the start stays."""
        energy = search.places.energy(q)
        each = zip(self.positions, self.free, self.energies, strict=True)
        for k, (other, free, level) in enumerate(each):
            if search.places.level(energy, level) and search.one(q, other, free):
                if search.places.nearer(q, other):
                    self.positions[k], self.free[k] = q, search.free(q)
                return False
        self.positions.append(q)
        self.free.append(search.free(q))
        self.energies.append(energy)
        return True


def _found(search: _Search, start: Floats) -> _Found:
    """Return the positions found, that from the start first: from what is found its mirror images and half-turns."""
    found, fruitless, until = _Found(), 0, time.process_time() + SECONDS
    images: deque[Floats] = deque()
    around = guesses(search.places, start)
    while images or (found.guesses < MOST and fruitless <= _GUESSES):
        if time.process_time() > until - (0.0 if found.positions else _LESS) and found.guesses:
            found.cut_short = True
            break
        fruitless += not images
        guess = images.popleft() if images else next(around)
        found.guesses += 1
        q = search.reached(guess)
        if q is not None and found.takes(search, q):
            fruitless = 0
            images.extend(search.images(q))
    return found


def guesses(places: Places, q: Floats) -> Iterator[Floats]:
    """Yield the start and positions around it, ever farther away, whose rows may be open."""
    rng, mechanism = np.random.default_rng(_SEED), places.mechanism
    scale = np.array([places.length if speed.unit == "m/s" else 1.0 for speed in mechanism.speeds])
    yield q
    for k in count(1):
        part = min(k, _GUESSES) / _GUESSES
        yield displaced(mechanism, q, rng.uniform(-1.0, 1.0, len(scale)) * np.pi * part * scale)


@dataclass(frozen=True)
class _Search:
    """Newton's method for positions without acceleration."""

    mechanism: Mechanism
    flow: Flow
    rows: Rows
    places: Places

    def reached(self, guess: Floats) -> Floats | None:
        """Return the position of equilibrium that a guess, closed or not, leads to; None where it leads to none."""
        near = closed_near(self.rows, guess)
        return None if near is None else self.root(near)

    def root(self, q: Floats) -> Floats | None:
        """Return the position of equilibrium that Newton's method reaches from a closed position, None if it fails."""
        try:
            return self._root(q)
        except (*UNDEFINED, np.linalg.LinAlgError):
            return None

    def _root(self, q: Floats) -> Floats | None:
        first = size = self._size(q)
        for _ in range(_STEPS):
            if size <= _CONVERGED * (1.0 + first):
                return self._polished(q)
            step = self._newton_step(q)
            step *= min(1.0, _LARGEST_STEP / max(float(np.abs(step).max()), _LARGEST_STEP))
            ahead = self._line_search(q, step, size)
            if ahead is None:
                return q if size <= _CONVERGED * 1e3 * (1.0 + first) else None
            q, size = ahead
        return None

    def _newton_step(self, q: Floats) -> Floats:
        """Return the deviations (nu) by which Newton's method moves on."""
        tangents, slope = self._slope(q)
        target = -self.flow.accelerations(q, np.zeros(len(self.mechanism.speeds)))[self._speeds(tangents)]
        if not (np.isfinite(slope).all() and np.isfinite(target).all()):
            raise FloatingPointError("the slope of the accelerations is not finite")
        found: Floats = self._columns(tangents) @ least_squares(slope, target)
        return found

    def _polished(self, q: Floats) -> Floats:
        """Return a position brought nearer to a root where several meet: there Newton's method gains little a step."""
        before = np.inf
        for _ in range(_POLISHING):
            step = self._newton_step(q)
            size = float(np.abs(step).max(initial=0.0))
            if size <= _POLISHED or size >= before:
                break
            ahead = closed_near(self.rows, displaced(self.mechanism, q, step))
            if ahead is None or self._size(ahead) > self._size(q):
                break
            q, before = ahead, size
        return q

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
        values = np.linalg.eigvals(slope @ self._rates(tangents))
        least = FLAT * max(float(np.abs(values).max(initial=0.0)), 1e-300)
        if (values.real > least).any() or (np.abs(values.imag) > least).any():
            return False
        regular = slope.shape[0] == slope.shape[1]  # with rows of speeds alone some displacements change no force
        return True if regular and (values.real < -least).all() else None

    def one_sided(self, q: Floats) -> bool:
        """Return whether some acceleration has no real value a little beside a position, along a free direction."""
        for column in self._columns(self.flow.tangents(q, np.zeros(len(self.mechanism.speeds)))).T:
            for side in (_EDGE, -_EDGE):
                near = closed_near(self.rows, displaced(self.mechanism, q, side * column / np.abs(column).max()))
                try:
                    if near is not None and not np.isfinite(self._size(near)):
                        return True
                except UNDEFINED:
                    return True
        return False

    def free(self, q: Floats) -> Mask:
        """Return the coordinates (nq) that change along those displacements on which all positions are equilibria."""
        tangents, slope = self._slope(q)
        found = np.zeros(len(q), dtype=bool)
        for direction in (self._columns(tangents) @ null_space(slope, FLAT)).T:
            step = direction / np.abs(direction).max()
            beside = displaced(self.mechanism, q, _BESIDE * step)
            if self._rests(beside, FLAT * (1.0 + float(np.abs(slope).max()))):
                found |= np.abs(beside - q) > _SAME
        return found

    def told(self, q: Floats) -> list[float]:
        """Return a position as it is told, with zeros beside which it rests no better to what Newton's method asks."""
        found = np.array(self.places.told(q))
        clear = np.where(np.abs(found) < _POLISHED, 0.0, found)
        near = closed_near(self.rows, clear)
        closed = near is not None and np.abs(near - clear).max(initial=0.0) <= EPSILON
        rests = closed and self._rests(clear, max(_CONVERGED, self._size(q)))
        return [float(x) for x in (clear if rests else found)]

    def _rests(self, q: Floats, allowed: float) -> bool:
        """Return whether no acceleration beside a position is larger than allowed."""
        near = closed_near(self.rows, q)
        try:
            return near is not None and self._size(near) <= allowed
        except UNDEFINED:
            return False

    def meet(self, a: Floats, b: Floats) -> bool:
        """Return whether two positions are one to rounding: close together, and all between them rest as well."""
        between = self.places.between(a, b)
        return between is not None and self._rests(between, _CONVERGED * 1e2)

    def one(self, a: Floats, b: Floats, free: Mask) -> bool:
        """Return whether two positions are one, or of one family."""
        return self.places.same(a, b, free) or self.meet(a, b) or self.joined(a, b, free)

    def joined(self, a: Floats, b: Floats, free: Mask) -> bool:
        """Return whether positions beside each other that all rest lead from one to the other."""
        if not free.any():
            return False
        turned = [b]
        for k in np.flatnonzero(free & self.places.angles):
            turned += [np.where(np.arange(len(b)) == k, q + np.pi, q) for q in turned[:_TURNED]]
        return any(self._leads(q, a) for q in turned)

    def _leads(self, q: Floats, target: Floats) -> bool:
        """Return whether moving on, nearer to a target, through positions that rest ends there."""
        for _ in range(_STEPS):
            missing = self.places.apart(q, target)
            if np.abs(missing).max() <= _SAME:
                return True
            tangents, slope = self._slope(q)
            free = self._columns(tangents) @ null_space(slope, FLAT)
            if not free.shape[1]:
                return False
            step = free @ least_squares(self.places.slopes(q) @ free, missing, ALIKE)
            size = float(np.abs(step).max())
            ahead = closed_near(self.rows, displaced(self.mechanism, q, step * min(1.0, _LARGEST_STEP / (size or 1.0))))
            if size <= _SAME or ahead is None:
                return False
            q = ahead
        return False

    def images(self, q: Floats) -> list[Floats]:
        """Return a position with its angles or lengths turned about, and with half a turn in each place."""
        units = [c.unit for c in self.mechanism.coordinates]
        found = [np.where([x == unit for x in units], -q, q) for unit in ("rad", "m") if unit in units]
        for body in self.mechanism.bodies:
            for place in (u for u in body.u if self.mechanism.speeds[u].unit == "rad/s"):
                half = np.zeros(len(self.mechanism.speeds))
                half[place] = np.pi
                found.append(displaced(self.mechanism, q, half))
        return found
