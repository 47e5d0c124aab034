"""The search for positions in which a mechanism, all of whose rows hold, has no acceleration at rest.

Newton's method on the accelerations, from the start and from positions all around it; images of what was found.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import field
from itertools import count
from typing import Final

import numpy as np

from multibody_sym.analysis.deviations import Flow, Tangents
from multibody_sym.analysis.places import Mask, Places
from multibody_sym.analysis.steadiness import displaced
from multibody_sym.dynamics.constraints.closing import Rows, closed_near
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.start.start import Start
from multibody_sym.kinematics.masses.rates import verify_kept
from multibody_sym.model.mechanism.mechanism import Mechanism
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
_DESCENTS: Final = 64
"""How many steps down are made at most: after 1, 2, 4, .. of them Newton's method is tried again."""
_TRIALS: Final = 40
_FAR_ENOUGH: Final = 1.25
"""How near the end of a step down comes to where the forces turn back."""
_TURNED: Final = 4
"""How many positions of a family are tried with half-turns of each of its angles."""
_POLISHING: Final = 60
_POLISHED: Final = 1e-9
_SAME: Final = 1e-6
_MEETING: Final = 8
"""More roots than meet in a position that anyone asks for."""
_BESIDE: Final = 0.1
_EDGE: Final = 1e-5
"""How far beside a position forces are to have values, in m and rad: farther than it may be from their edge."""
SECONDS: Final = 10.0
"""CPU time after which no other guess is begun, less than half of it where none led to a position of rest."""
_LESS: Final = 6.0
_SEED: Final = 3
_ROUNDED: Final = 1e-13
"""The part of the slopes that forces of rows may bring about that rounding leaves where there are none."""


def search_from(resolved: Mechanism, begin: Start, formalism: str | None) -> Search:
    """Return the search for positions of equilibrium from a start."""
    verify_kept(resolved)
    rows = Rows(resolved, begin.parameters, range(len(resolved.rows)))
    flow = Flow(resolved, begin.parameters, formalism)
    return Search(resolved, flow, rows, Places(flow, rows, np.array(begin.q, dtype=float)))


@dataclass
class Found:
    """Positions found so far, what is free in each, their potential energies, and how the search went."""

    positions: list[Floats] = field(default_factory=list)
    energies: list[float] = field(default_factory=list)
    free: list[Mask] = field(default_factory=list)
    guesses: int = 0
    cut_short: bool = False

    def takes(self, search: Search, q: Floats) -> bool:
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


def found_from(
    search: Search, start: Floats, seconds: float = SECONDS, most: int = _GUESSES, *, falls: bool = True
) -> Found:
    """Return the positions found, that from the start first: from what is found its mirror images and half-turns.

    `falls`: whether the system falls from the start where Newton's method fails, which may take all the time.
    """
    found, fruitless, until = Found(), 0, time.process_time() + seconds
    images: deque[Floats] = deque()
    around = guesses(search.places, start)
    while images or (found.guesses < MOST and fruitless <= most):
        if time.process_time() > until - (0.0 if found.positions else _LESS * seconds / SECONDS) and found.guesses:
            found.cut_short = True
            break
        fruitless += not images
        guess = images.popleft() if images else next(around)
        q = search.reached(guess, until if falls and not found.guesses else -np.inf)
        found.guesses += 1
        if q is not None and found.takes(search, q):
            fruitless = 0
            images.extend(search.images(q))
    return found


def guesses(places: Places, q: Floats) -> Iterator[Floats]:
    """Yield the start and positions around it, ever farther away, whose rows may be open."""
    rng, mechanism, scale = np.random.default_rng(_SEED), places.mechanism, places.scale
    yield q
    for k in count(1):
        part = min(k, _GUESSES) / _GUESSES
        yield displaced(mechanism, q, rng.uniform(-1.0, 1.0, len(scale)) * np.pi * part * scale)


@dataclass(frozen=True)
class Search:
    """Newton's method for positions without acceleration."""

    mechanism: Mechanism
    flow: Flow
    rows: Rows
    places: Places

    def reached(self, guess: Floats, until: float = -np.inf) -> Floats | None:
        """Return the position of equilibrium that a guess, closed or not, leads to; None where it leads to none.

        Where Newton's method fails, it begins anew, `until` a CPU time, from where forces push the system from rest.
        Callers ask for that at starts alone: a fall without end takes long.
        """
        near = closed_near(self.rows, guess)
        found = None if near is None else self.root(near)
        return found if near is None or found is not None else self._fallen(near, until)

    def _fallen(self, q: Floats, until: float) -> Floats | None:
        """Return the position of equilibrium at or near which the system comes to rest from a closed position."""
        for number in range(1, _DESCENTS + 1):
            lower = self._lower(q) if time.process_time() < until else None
            if lower is None:
                return None
            q = lower
            found = self.root(q) if number & (number - 1) == 0 else None
            if found is not None:
                return found
        return None

    def _lower(self, q: Floats) -> Floats | None:
        """Return a closed position as far along the acceleration at rest as forces do work; None where they always do.

        That needs no potential, and neither kinks nor slack springs end it.
        """
        try:
            way = self.flow.accelerations(q, np.zeros(len(self.mechanism.speeds)))
        except UNDEFINED:
            return None
        if not np.isfinite(way).all() or not way.any():
            return None
        within, beyond, found = 0.0, np.inf, q
        step = _LARGEST_STEP / float((np.abs(way) / self.places.scale).max())
        for _ in range(_TRIALS):
            ahead = closed_near(self.rows, displaced(self.mechanism, q, step * way))
            if ahead is not None and self._power(ahead, way) > 0.0:
                within, found = step, ahead
            else:
                beyond = step
            if beyond <= _FAR_ENOUGH * within:
                return found
            step = 2.0 * step if np.isinf(beyond) else (within + beyond) / 2.0
        return None

    def _power(self, q: Floats, way: Floats) -> float:
        """Return the power of all forces at rest on speeds (nu); 0 where they have no value."""
        try:
            exerted = np.array(mass_matrix(self.places.motion(q)), dtype=float) @ self.flow.accelerations(q, 0.0 * way)
        except UNDEFINED:
            return 0.0
        return float(way @ exerted)

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

    def _clear_slope(self, q: Floats) -> tuple[Tangents, Floats]:
        """Return the same without what is rounding of the forces of rows alone, where nothing resists."""
        tangents, slope = self._slope(q)
        size = float(np.abs(slope).max(initial=0.0))
        return tangents, np.zeros_like(slope) if size <= _ROUNDED * self._held(q) else slope

    def _held(self, q: Floats) -> float:
        """Return the slope (1/s^2) of what accelerations rows take away, over the model's size or 1 rad."""
        if not self.mechanism.rows:
            return 0.0
        inertia = np.diag(np.array(mass_matrix(self.places.motion(q)), dtype=float))
        exerted = np.abs(self.flow.jacobian(q).T @ self.flow.multipliers(q))
        held = float((exerted[inertia > 0.0] / inertia[inertia > 0.0]).max(initial=0.0))
        return held * max(1.0, 1.0 / self.places.length)

    def _rates(self, tangents: Tangents) -> Floats:
        """Return S in dxi/dt = S eta, with eta the independent speeds, which need not be those of xi."""
        size, count = len(self.mechanism.speeds), self._columns(tangents).shape[1]
        return tangents.X[size:, count:][tangents.places[:count]]

    def stable(self, q: Floats) -> bool | None:
        """Return whether a position of equilibrium is stable; None where some displacement meets no resistance."""
        tangents, slope = self._clear_slope(q)
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
        tangents, slope = self._clear_slope(q)
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

    def errors(self, q: Floats) -> list[float]:
        """Return how far each coordinate (nq) may be off: what a step of Newton's method moves, and rounding.

        Where several roots meet, a step goes but a part of the way: `_MEETING` steps are taken for it.
        """
        try:
            moved = np.abs(displaced(self.mechanism, q, self._newton_step(q)) - q)
        except (*UNDEFINED, np.linalg.LinAlgError):
            return [_SAME] * len(q)
        found: list[float] = (_MEETING * (moved + EPSILON * np.maximum(1.0, np.abs(q)))).tolist()
        return found

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
            tangents, slope = self._clear_slope(q)
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
