"""The search for positions in which a mechanism has no acceleration at rest.

In: a mechanism and its start. Out: positions with their stability. Newton's method on the accelerations begins at the
start and all around it, and at images of positions found; one-way elements are closed set by set, held to their laws.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import combinations, count, islice
from math import comb
from typing import Final

import numpy as np

from multibody_sym.analysis.deviations import DeviationFlow, Tangents, displaced
from multibody_sym.analysis.positions import SAME, Mask, Positions
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.contact.contact_problem import Scale, one_way_rows
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.dynamics.start.state import mechanism_in_mode, rows_at, start_in_mode
from multibody_sym.mechanics.forces import verify_kept
from multibody_sym.mechanics.law_elements import ACTIVE, LawElement, Mode
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.scalars.linear_inequalities import linear_program
from multibody_sym.scalars.rank import ALIKE, FLAT, SLOPES, leading_columns, least_squares, null_space
from multibody_sym.stages import doing

# --- Newton's method -------------------------------------------------------------------------------------------------

_GUESSES: Final = 24
"""How many guesses around the start are tried, and how many in a row must find nothing before the search ends."""
MOST: Final = 400
_DECADES: Final = 2
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
_MEETING: Final = 8
"""More roots than meet in a position that anyone asks for."""
_BESIDE: Final = 0.1
_EDGE: Final = 1e-5
"""How far beside a position forces must have values, in m and rad: farther than it may be from their edge."""
SECONDS: Final = 10.0
"""CPU time after which no other guess is begun, less than half of it where none led to a position of rest."""
_LESS: Final = 6.0
_SEARCH_SEED: Final = 3
_ROUNDED: Final = 1e-13
"""The part of the slopes by forces of rows that rounding leaves where there are none."""


def search_from(resolved: Mechanism, begin: Start, formalism: str | None) -> EquilibriumSearch:
    verify_kept(resolved)
    rows = ConstraintRows(resolved, begin.parameters, range(len(resolved.rows)))
    flow = DeviationFlow(resolved, begin.parameters, formalism)
    return EquilibriumSearch(resolved, flow, rows, Positions(flow, rows, np.array(begin.q, dtype=float)))


@dataclass
class FoundPositions:
    """Positions found so far, the free coordinates of each, their potential energies, and the course of the search."""

    positions: list[Floats] = field(default_factory=list)
    energies: list[float] = field(default_factory=list)
    free: list[Mask] = field(default_factory=list)
    guesses: int = 0
    cut_short: bool = False

    def takes(self, search: EquilibriumSearch, q: Floats) -> bool:
        """Take a position, and return whether it is new; of two equal ones the one more like the start stays."""
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


def search_positions(
    search: EquilibriumSearch, start: Floats, seconds: float = SECONDS, most: int = _GUESSES, *, falls: bool = True
) -> FoundPositions:
    """Return the positions found, that from the start first; each also leads to its mirror images and half-turns.

    `falls`: whether the system falls from the start where Newton's method fails, which may take all the time.
    """
    found, fruitless, until = FoundPositions(), 0, time.process_time() + seconds
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
        doing(f"{found.guesses} guesses, {len(found.positions)} positions")
        if q is not None and found.takes(search, q):
            fruitless = 0
            images.extend(search.images(q))
    return found


def guesses(places: Positions, q: Floats) -> Iterator[Floats]:
    """Yield the start and positions around it, ever farther away, whose rows may be open.

    Declared states, whose size is hardly known, change by up to `_DECADES` more than their units.
    """
    rng, mechanism, scale = np.random.default_rng(_SEARCH_SEED), places.mechanism, places.scale
    yield q
    for k in count(1):
        part = min(k, _GUESSES) / _GUESSES
        sigma = rng.uniform(-1.0, 1.0, len(scale)) * np.pi * part * scale
        sizes = places.units[len(scale) :] * 10.0 ** rng.uniform(0.0, _DECADES, len(mechanism.rates))
        yield displaced(mechanism, q, np.append(sigma, rng.uniform(-1.0, 1.0, len(sizes)) * part * sizes))


@dataclass(frozen=True)
class EquilibriumSearch:
    """Newton's method for positions without acceleration."""

    mechanism: Mechanism
    flow: DeviationFlow
    rows: ConstraintRows
    places: Positions

    def reached(self, guess: Floats, until: float = -np.inf) -> Floats | None:
        """Return the position of equilibrium to which a guess, closed or not, leads; None where it leads to none.

        Where Newton's method fails, it begins anew, `until` a CPU time, from where forces push the system from rest.
        Callers allow that at starts alone: a fall without end takes long.
        """
        near = closed_near(self.rows, guess)
        found = None if near is None else self.root(near)
        return found if near is None or found is not None else self._fallen(near, until)

    def reached_in_time(self, until: float, most: int, *, falls: bool = False) -> Iterator[Floats]:
        """Yield the positions of equilibrium that guesses lead to before a CPU time; the start `falls`.

        There are no more guesses than `most`.
        """
        for number, guess in enumerate(islice(guesses(self.places, self.places.start), most)):
            if time.process_time() >= until:
                break
            found = self.reached(guess, until if falls and not number else -np.inf)
            if found is not None:
                yield found

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

        The forces need no potential; kinks and slack springs do not end the step.
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
            first = size = self._size(q)
            for _ in range(_STEPS):
                if size <= _CONVERGED * (1.0 + first):
                    return self._polished(q)
                step = self._newton_step(q)
                moved = float(np.abs(step[: len(self.mechanism.speeds)]).max(initial=0.0))
                step *= min(1.0, _LARGEST_STEP / max(moved, _LARGEST_STEP))
                ahead = self._line_search(q, step, size)
                if ahead is None:
                    return q if size <= _CONVERGED * 1e3 * (1.0 + first) else None
                q, size = ahead
        except (*UNDEFINED, np.linalg.LinAlgError):
            pass
        return None

    def _newton_step(self, q: Floats) -> Floats:
        """Return the deviations (nu + ns) by which Newton's method moves on."""
        tangents, slope = self._slope(q)
        target = -(self._unbalanced(q) / self.places.rate_units)[self._speeds(tangents)]
        if not (np.isfinite(slope).all() and np.isfinite(target).all()):
            raise FloatingPointError("the slope of the accelerations is not finite")
        found: Floats = self._columns(tangents) @ least_squares(slope, target)
        return found

    def _polished(self, q: Floats) -> Floats:
        """Return a position nearer to a root where several meet: there Newton's method gains little in a step."""
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
        return float(np.abs(self._unbalanced(q) / self.places.rate_units).max())

    def _unbalanced(self, q: Floats) -> Floats:
        """Return the accelerations and the rates of declared states (nu + ns) at rest."""
        return self.flow.unbalanced(q, np.zeros(len(self.mechanism.speeds)))

    def _columns(self, tangents: Tangents) -> Floats:
        """Return how all deviations of positions and declared states (nu + ns) follow from the independent ones.

        Those of states are in their units.
        """
        size = len(self.mechanism.speeds)
        positions = {k: place for k, place in enumerate(tangents.places) if place < size or place >= 2 * size}
        units = [self.places.units[place - size] if place >= size else 1.0 for place in positions.values()]
        return tangents.X[np.r_[:size, 2 * size : len(tangents.X)]][:, list(positions)] * units

    def _speeds(self, tangents: Tangents) -> list[int]:
        """Return the independent speeds, and the places (nu ..) of the declared states behind all speeds."""
        size = len(self.mechanism.speeds)
        return [k - size for k in tangents.places if k >= size]

    def _slope(self, q: Floats) -> tuple[Tangents, Floats]:
        """Return the tangents at rest and dG/dxi, of independent accelerations by independent deviations.

        Behind them stand declared states and their rates, in units of `Positions`.
        """
        u = np.zeros(len(self.mechanism.speeds))
        tangents = self.flow.tangents(q, u)
        by_state, _ = self.flow.derivatives(self.flow.known(q, u))
        columns = self._columns(tangents)
        speeds = self._speeds(tangents)
        rows = by_state[[len(u) + k for k in speeds]][:, np.r_[: len(u), 2 * len(u) : len(by_state)]]
        return tangents, rows @ columns / self.places.rate_units[speeds, None]

    def _clear_slope(self, q: Floats) -> tuple[Tangents, Floats]:
        """Return the same, zero where it is but rounding of the forces of rows, and nothing resists."""
        tangents, slope = self._slope(q)
        size = float(np.abs(slope).max(initial=0.0))
        by_rows = 0.0  # slope (1/s^2) of the accelerations that rows take away, over the model's size or 1 rad
        if self.mechanism.rows:
            inertia = np.diag(np.array(mass_matrix(self.places.motion(q)), dtype=float))
            exerted = np.abs(self.flow.jacobian(q).T @ self.flow.multipliers(q))
            largest = float((exerted[inertia > 0.0] / inertia[inertia > 0.0]).max(initial=0.0))
            by_rows = largest * max(1.0, 1.0 / self.places.length)
        return tangents, np.zeros_like(slope) if size <= _ROUNDED * by_rows else slope

    def _rates(self, tangents: Tangents) -> Floats:
        """Return S in dxi/dt = S eta, with eta the independent speeds, which need not be those of xi."""
        size, count = len(self.mechanism.speeds), self._columns(tangents).shape[1]
        return tangents.X[size:, count:][tangents.places[:count]]

    def stable(self, q: Floats) -> bool | None:
        """Return whether a position of equilibrium is stable; None where some displacement meets no resistance."""
        if self.mechanism.rates:
            # by the eigenvalues of A: rates of states follow speeds, as dampers do
            values = np.linalg.eigvals(self.flow.linearized(q, np.zeros(len(self.mechanism.speeds))).A)
            least = FLAT * max(float(np.abs(values).max(initial=0.0)), 1e-300)
            return False if (values.real > least).any() else None if (np.abs(values) <= least).any() else True
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
            step = direction / np.abs(direction / self.places.units).max()
            beside = displaced(self.mechanism, q, _BESIDE * step)
            if self._rests(beside, FLAT * (1.0 + float(np.abs(slope).max(initial=0.0)))):
                found |= np.abs(beside - q) > SAME
        return found

    def told(self, q: Floats) -> list[float]:
        """Return a position as it is reported, with zeros for small coordinates where it rests there as well."""
        found = np.array(self.places.told(q))
        clear = np.where(np.abs(found) < _POLISHED, 0.0, found)
        near = closed_near(self.rows, clear)
        closed = near is not None and np.abs(near - clear).max(initial=0.0) <= EPSILON
        rests = closed and self._rests(clear, max(_CONVERGED, self._size(q)))
        return [float(x) for x in (clear if rests else found)]

    def errors(self, q: Floats) -> list[float]:
        """Return the possible error of each coordinate (nq): a step of Newton's method, and rounding.

        Where several roots meet, a step goes but a part of the way: `_MEETING` steps count instead.
        """
        try:
            moved = np.abs(displaced(self.mechanism, q, self._newton_step(q)) - q)
        except (*UNDEFINED, np.linalg.LinAlgError):
            return [SAME] * len(q)
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
            if np.abs(missing).max() <= SAME:
                return True
            tangents, slope = self._clear_slope(q)
            free = self._columns(tangents) @ null_space(slope, FLAT)
            if not free.shape[1]:
                return False
            step = free @ least_squares(self.places.slopes(q) @ free, missing, ALIKE)
            size = float(np.abs(step).max())
            ahead = closed_near(self.rows, displaced(self.mechanism, q, step * min(1.0, _LARGEST_STEP / (size or 1.0))))
            if size <= SAME or ahead is None:
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


# --- one-way elements: a search with each set of contacts, ropes and stops closed ------------------------------------
#
# A position counts where all closed elements of the set press or pull, and all others are open, or touch without force.
# Friction is left out: where it holds, positions beside such a one rest as well.

_MANY: Final = 6
"""With more unilateral elements only the set of the start, all, one at a time, or none is tried closed."""
_FRUITLESS: Final = 3
"""How many guesses in a row must find nothing with one set closed before its search ends, but for that of the start."""
_PRESSES: Final = 1e-9
"""The part of the largest force of a row that closed elements exert at least: less is rounding."""

Closed = tuple[str, ...]


@dataclass(frozen=True)
class UnilateralEquilibrium:
    """A position of rest (nq,): the `closed` elements press or pull, others touch, and some coordinates are `free`.

    `search` is that of the mechanism with the `closed` elements closed.
    """

    q: Floats
    closed: Closed
    touching: Closed
    free: Mask
    search: EquilibriumSearch

    @property
    def stable(self) -> bool | None:
        """Whether it is stable; None where it is indifferent, or contacts without force might decide."""
        found = self.search.stable(self.q)
        return found if found or not self.touching else None


@dataclass(frozen=True)
class UnilateralEquilibria:
    """All positions that were found, after so many `guesses`, and whether the search was `cut_short`.

    `first` is the search with the same closed as at the start; `sets`: how many sets were tried closed, and how many
    there are of no more elements than there are speeds, since more of them depend on each other.
    """

    found: tuple[UnilateralEquilibrium, ...]
    first: EquilibriumSearch
    guesses: int
    cut_short: bool
    sets: tuple[int, int]


def find_equilibria(resolved: Mechanism, begin: Start, formalism: str | None, *, project: bool) -> UnilateralEquilibria:
    """Return the positions of rest of a mechanism from its start. Raises NoSolutionError where there is no start.

    Where curves touch, whose points of contact are coordinates, nothing is tried closed.
    """
    if not any(x.unilateral for x in resolved.one_way) or any(body.is_foot for body in resolved.bodies):
        search = search_from(resolved, begin, formalism)
        found = search_positions(search, np.array(begin.q, dtype=float))
        pairs = zip(found.positions, found.free, strict=True)
        kept = tuple(UnilateralEquilibrium(q, (), (), free, search) for q, free in pairs)
        return UnilateralEquilibria(kept, search, found.guesses, found.cut_short, (1, _all_sets(resolved)))
    own = begin if resolved.relative is None else start(resolved.relative, project=project)
    return _Closings(resolved, begin, own, formalism).rests()


@dataclass(frozen=True)
class _Closings:
    """The search of a mechanism that `begin`s somewhere, with sets of elements closed; `own`: that start in joints."""

    resolved: Mechanism
    begin: Start
    own: Start
    formalism: str | None

    def rests(self) -> UnilateralEquilibria:
        """Return the positions of rest, those with the same closed as at the start first.

        Each of the other sets is searched before, for its share of half the time: with what is closed at the start a
        search may go on and on from position to position in which something would have to pull.
        """
        until = time.process_time() + SECONDS
        closed, *others = self._sets()
        closed = self._independent(closed, np.array(self.begin.q, dtype=float))
        founds: list[tuple[Closed, FoundPositions]] = []
        for number, names in enumerate(others):
            share = (until - 0.5 * SECONDS - time.process_time()) / (len(others) - number)
            if share <= 0.0:
                break
            search = self.search(names)
            found = search_positions(search, np.array(search.places.start), share, _FRUITLESS, falls=False)
            founds.append((names, found))
        first = self.search(closed)
        left = until - time.process_time()
        founds.insert(0, (closed, search_positions(first, np.array(first.places.start), left)))
        kept = list[UnilateralEquilibrium]()
        for names, found in founds:
            for q in found.positions:
                rest = self._rest(q, names)
                if rest is not None and not any(x.search.places.same(q, x.q, x.free) for x in kept):
                    kept.append(rest)
        tried, guesses = len(founds), sum(found.guesses for _, found in founds)
        cut_short = tried <= len(others) or any(found.cut_short for _, found in founds)
        sets = tried, max(tried, _all_sets(self.resolved))
        return UnilateralEquilibria(tuple(kept), first, guesses, cut_short, sets)

    @cached_property
    def elements(self) -> dict[str, LawElement]:
        """The unilateral elements by name."""
        return {x.name: x for x in self.resolved.one_way if x.unilateral}

    def _sets(self) -> list[Closed]:
        """Return the sets of elements that may be closed: that at the start, all, then small ones first.

        A robot above the floor stands on all of its feet, and sets of few, on which it falls, take the time.
        """
        rows = rows_at(self.resolved, self.begin)
        closed = tuple(name for name, x in self.elements.items() if rows.standing(x) not in ("open", "inside"))
        largest = min(len(self.elements), len(self.resolved.speeds))
        sizes = range(largest + 1) if len(self.elements) <= _MANY else (0, 1)
        whole = combinations(self.elements, len(self.elements)) if len(self.elements) == largest else ()
        every = (each for size in sizes for each in combinations(self.elements, size))
        return list(dict.fromkeys((closed, *whole, *every)))

    @cached_property
    def _scale(self) -> Scale:
        """The sizes at the start: in a position all may be at the origin."""
        return rows_at(self.resolved, self.begin).scale

    @cached_property
    def declared(self) -> Mechanism:
        """The mechanism without friction."""
        return _without_friction(self.resolved)

    @cached_property
    def _searches(self) -> dict[Closed, EquilibriumSearch]:
        return {}

    def search(self, closed: Closed) -> EquilibriumSearch:
        """Return the search in the mechanism in which some elements are closed, from the start or one beside it."""
        if closed not in self._searches:
            mechanism = mechanism_in_mode(self.declared, Mode(dict.fromkeys(closed, ACTIVE)))
            begun = start_in_mode(mechanism, self.declared.relative or self.declared, self.own)
            search = search_from(mechanism, begun, self.formalism)
            near = closed_near(search.rows, np.array(begun.q, dtype=float))
            self._searches[closed] = (
                search if near is None else replace(search, places=replace(search.places, start=near))
            )
        return self._searches[closed]

    def _rest(self, q: Floats, closed: Closed) -> UnilateralEquilibrium | None:
        """Return a position of rest; None where a body is inside another, or a closed element exerts nothing."""
        there = replace(self.begin, q=tuple(q.tolist()), u=(0.0,) * len(self.begin.u))
        rows = rows_at(self.resolved, there, self._scale)
        standing = {name: rows.standing(x) for name, x in self.elements.items()}
        if "inside" in standing.values() or any(standing[name] == "open" for name in closed):
            return None
        touching = tuple(name for name, how in standing.items() if how == "touching")
        pressing = next((names for names in (touching, closed) if self._presses(q, names)), None)
        if pressing is None:
            return None
        closed = pressing
        search = self.search(self._independent(closed, q))
        others = tuple(name for name in touching if name not in closed)
        return UnilateralEquilibrium(q, closed, others, search.free(q), search)

    def _independent(self, closed: Closed, q: Floats) -> Closed:
        """Return independent elements of a set at a position: where rows depend on each other slopes are noise."""
        search = self.search(closed)
        names = [row.name for row in search.mechanism.rows]
        own = [names.index(self.elements[name].normals[0].name) for name in closed]
        others = [k for k in range(len(names)) if k not in own]
        leading = leading_columns(search.flow.jacobian(q)[[*others, *own]].T, SLOPES) if own else []
        return tuple(name for k, name in enumerate(closed) if len(others) + k in leading)

    def _presses(self, q: Floats, closed: Closed) -> bool:
        """Return whether forces hold a position with which all of a set press or pull; they need not be unique."""
        search = self.search(closed)
        names = [row.name for row in search.mechanism.rows]
        places = [names.index(self.elements[name].normals[0].name) for name in closed]
        try:
            forces, jacobian = search.flow.multipliers(q), search.flow.jacobian(q)
        except UNDEFINED:
            return False
        size = float(np.abs(forces).max(initial=0.0))
        return bool((forces[places] > _PRESSES * size).all()) or _least(jacobian, forces, places) > _PRESSES * size


def _all_sets(mechanism: Mechanism) -> int:
    """Return how many sets of unilateral elements there are, of no more elements than there are speeds."""
    count = sum(x.unilateral for x in mechanism.one_way)
    return sum(comb(count, size) for size in range(min(count, len(mechanism.speeds)) + 1))


def _least(jacobian: Floats, forces: Floats, places: Sequence[int]) -> float:
    """Return the largest possible least force of some rows, among all forces (nr) that act alike."""
    size = float(np.abs(forces).max(initial=0.0)) or 1.0
    equal = np.hstack([jacobian.T, np.zeros((jacobian.shape[1], 1))])
    below = np.zeros((len(places), len(forces) + 1))
    below[range(len(places)), places], below[:, -1] = -1.0, 1.0
    found = linear_program(
        np.append(np.zeros(len(forces)), -1.0),
        [*[(None, None)] * len(forces), (None, 1.0)],
        below=(below, np.zeros(len(places))),
        equal=(equal, jacobian.T @ forces / size),
    )
    return float(found.x[-1]) * size if found.status == 0 else -np.inf


def keeps_mode(search: EquilibriumSearch, q: Floats) -> bool:
    """Return whether a position of rest keeps the mechanism's mode: elements open or closed as in it, none pulls."""
    mechanism = search.mechanism
    if mechanism.mode is None:
        return True
    scale = one_way_rows(mechanism, search.places.motion(search.places.start)).scale
    rows = one_way_rows(mechanism, search.places.motion(q), scale)
    names = [row.name for row in mechanism.rows]
    try:
        forces = search.flow.multipliers(q)
    except UNDEFINED:
        return False
    least = -_PRESSES * float(np.abs(forces).max(initial=0.0))
    for element in (x for x in mechanism.one_way if x.unilateral):
        closed = mechanism.mode.acts(element)
        how, row = rows.standing(element), element.normals[0].name
        if how == "inside" or (closed and (how == "open" or (row in names and not forces[names.index(row)] >= least))):
            return False
    return True


def _without_friction(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism without friction; rolling contacts (constraints) go on rolling."""
    relative = None if mechanism.relative is None else _without_friction(mechanism.relative)
    elements = tuple(
        x if x.kind == "contact" and x.path[0] == "constraints" else replace(x, frictions=())
        for x in mechanism.one_way
        if x.unilateral
    )
    return replace(mechanism, one_way=elements, relative=relative)
