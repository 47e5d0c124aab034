"""The state about which small motions are told: the declared one where its speeds stay, else one found beside it.

Beside a start in which something moves that nothing depends on, a steady motion with its momenta is looked for: there
the motion from the start, which swings about it, would come to rest but for these (Routh's effective potential).
"""

from __future__ import annotations

import time
from contextlib import suppress
from itertools import islice, takewhile
from typing import Any, Final, Literal

import numpy as np

from multibody_sym.analysis.deviations import Flow
from multibody_sym.analysis.linearization import At, Linearization, flow_at, settled
from multibody_sym.analysis.places_asked import REST, told_of
from multibody_sym.analysis.resting.closings import stands
from multibody_sym.analysis.resting.search import guesses, search_from
from multibody_sym.analysis.steadiness import displaced
from multibody_sym.dynamics.constraints.closing import Rows, closed_near
from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.start.start import Start, start_beside
from multibody_sym.errors import NoSolutionError, Where
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.declaration.system import System
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.rank import ROUNDED, least_squares
from multibody_sym.records import dataclass

_MISSED: Final = 1e-8
"""How far the numbers of a start may be from a state in which nothing is accelerated, beside 1 (m, rad)."""
_LEFT: Final = 1e-10
_CONVERGED: Final = 1e-14
_STEPS: Final = 60
_LARGEST_STEP: Final = 0.2
_GUESSES: Final = 24
_SECONDS: Final = 3.0
"""CPU time after which no other guess for a stable equilibrium is begun."""
_SINGULAR: Final = 1e-12


@dataclass(frozen=True, eq=False)
class Place:
    """A state in which speeds keep their values: an equilibrium, or a steady motion if something moves in it.

    `found`: it is not the declared one but was found beside it; `stopped`: it is at rest although the start moves.
    """

    flow: Flow
    begin: Start
    linear: Linearization
    found: bool
    stopped: bool = False

    @property
    def kind(self) -> Literal["equilibrium", "steady motion"]:
        """What the state is; one that only drives move is an equilibrium (of a moving frame)."""
        return "steady motion" if any(self.begin.u) else "equilibrium"


def place_of(system: System, formalism: str | None, at: At = None) -> Place:
    """Return the declared state if speeds keep their values there, else the equilibrium or steady motion beside it.

    An equilibrium that is found is a stable one if a few guesses find any. Raises InputError, and NoSolutionError where
    there is none, or with `at` where that state is none.
    """
    flow, begin = flow_at(system, formalism, at)
    if balanced(flow, begin):
        with suppress(*((NoSolutionError,) if at is None and any(begin.u) else ())):  # it may pass a rest on its way
            return _settled_at(flow, begin, at)
    if at is not None:
        why = "the state is no equilibrium and no steady motion: speeds change in it"
        raise NoSolutionError(f"{why}; name others, or write {REST}", where=Where(path=("at",)), number="N111")
    if any(begin.u):
        with suppress(NoSolutionError, np.linalg.LinAlgError, *UNDEFINED):
            steady = _Steady(flow, begin).found()
            if steady is not None:
                return _settled_at(flow, steady, None, found=True)
    moves = any(begin.u)
    first = flow_at(system, formalism, REST)
    found = _settled_at(*first, None, found=True, stopped=moves)
    if max(found.linear.eigenvalues.real, default=0.0) > 0.0:
        names = _stable_beside(flow, begin, formalism)
        if names is not None:
            return _settled_at(*flow_at(system, formalism, names), None, found=True, stopped=moves)
    return found


def _stable_beside(flow: Flow, begin: Start, formalism: str | None) -> dict[str, float] | None:
    """Return the coordinates of the stable equilibrium nearest to a start, as far as a few guesses find one."""
    until, search = time.process_time() + _SECONDS, search_from(flow.mechanism, begin, formalism)
    around = islice(guesses(search.places, search.places.start), _GUESSES)
    reached = (search.reached(guess) for guess in takewhile(lambda _: time.process_time() < until, around))
    found = [q for q in reached if q is not None and search.stable(q) and stands(search, q)]
    if not found:
        return None
    nearest = min(found, key=lambda q: float(np.linalg.norm(q - np.array(begin.q))))
    rest = {speed.name: 0.0 for speed in flow.mechanism.speeds}
    return dict(zip((c.name for c in flow.mechanism.coordinates), nearest.tolist(), strict=True)) | rest


def _settled_at(flow: Flow, begin: Start, at: Any, *, found: bool = False, stopped: bool = False) -> Place:
    with told_of(at):
        linear = settled(flow, np.array(begin.q, dtype=float), np.array(begin.u, dtype=float))
    return Place(flow, begin, linear, found, stopped)


def balanced(flow: Flow, begin: Start) -> bool:
    """Return whether no speed changes, but for what the rounding of the numbers of a state makes of it."""
    q, u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
    udot = flow.accelerations(q, u)
    if not udot.any():
        return True
    slopes = flow.derivatives(flow.known(q, u))[0][len(u) :] @ flow.tangents(q, u).X
    step = least_squares(slopes, -udot, ROUNDED)
    left = np.abs(slopes @ step + udot).max()
    size = max(1.0, float(np.abs(q).max(initial=0.0)))
    steepest = max(1.0, float(np.abs(slopes).max(initial=0.0)))
    return bool(np.abs(step).max(initial=0.0) <= _MISSED * size and left <= _LEFT * steepest)


class _Steady:
    """Looks for the steady motion beside a start: coordinates that move at the start keep their momenta.

    Newton's method in the other independent coordinates x, with u_c(x) of the moving ones from their momenta:
    udot(x, u_c(x)) = 0, where du_c/dx is the slope of udot_c by the speed of x, as u_c' = (du_c/dx) x'.
    """

    def __init__(self, flow: Flow, begin: Start) -> None:
        self.flow, self.begin = flow, begin
        self.q, self.u = np.array(begin.q, dtype=float), np.array(begin.u, dtype=float)
        self.size = len(self.u)
        self.places = flow.tangents(self.q, self.u).places
        speeds = [k - self.size for k in self.places if k >= self.size]
        self.moving = [k for k in speeds if self.u[k]]
        self.others = [k for k in speeds if not self.u[k] and k in self.places]
        self.momenta = self._masses(self.q) @ self.u[self.moving]

    def found(self) -> Start | None:
        """Return the state, None where there is none near."""
        rows = Rows(self.flow.mechanism, self.flow.parameters, range(len(self.flow.mechanism.rows)))
        q, u = self.q, self.u
        for _ in range(_STEPS):
            step, moved = self._step(q, u)
            near = closed_near(rows, displaced(self.flow.mechanism, q, moved))
            if near is None:
                return None
            q, u = near, self._with_momenta(near)
            if float(np.abs(step).max(initial=0.0)) <= _CONVERGED:
                break
        names = [*(c.name for c in self.flow.mechanism.coordinates), *(s.name for s in self.flow.mechanism.speeds)]
        values = dict(zip(names, [*q.tolist(), *u.tolist()], strict=True))
        steady = start_beside(self.flow.mechanism, self.begin, values)
        return steady if balanced(self.flow, steady) and any(steady.u) else None

    def _step(self, q: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Return a step of the other independent coordinates, and how all deviations move with it."""
        known = self.flow.known(q, u)
        X = self.flow.span(known, self.places)
        slopes = self.flow.derivatives(known)[0][self.size :] @ X
        by = [self.places.index(k) for k in self.others]
        by_rate = [self.places.index(self.size + k) for k in self.others]
        by_moving = [self.places.index(self.size + k) for k in self.moving]
        turning = slopes[np.ix_(self.moving, by_rate)]
        matrix = slopes[:, by] + slopes[:, by_moving] @ turning
        step = least_squares(matrix[self.others], -self.flow.accelerations(q, u)[self.others], ROUNDED)
        step = step * min(1.0, _LARGEST_STEP / max(float(np.abs(step).max(initial=0.0)), 1e-300))
        return np.asarray(step, dtype=float), np.asarray(X[:, by] @ step, dtype=float)[: self.size]

    def _masses(self, q: Floats) -> Floats:
        """Return the inertia of the moving coordinates, what moves with them included."""
        flow = self.flow
        known = flow.known(q, np.zeros(self.size))
        X = flow.span(known, self.places)[self.size :, [self.places.index(self.size + k) for k in self.moving]]
        state = state_of(flow.mechanism, float, 0.0, q.tolist(), [0.0] * self.size, list(flow.parameters))
        M = np.array(mass_matrix(motion_of(flow.mechanism, state)), dtype=float)
        return np.asarray(X.T @ M @ X)

    def _with_momenta(self, q: Floats) -> Floats:
        """Return the speeds with which the moving coordinates have their momenta."""
        masses = self._masses(q)
        if abs(np.linalg.det(masses)) <= _SINGULAR * np.abs(masses).max() ** len(masses):
            raise np.linalg.LinAlgError("no inertia is left")
        u = np.zeros(self.size)
        u[self.moving] = np.linalg.solve(masses, self.momenta)
        return self.flow.completed(q, u, 0.0, self.places)
