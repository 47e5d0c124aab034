"""Whether A is constant along the motion from a start: in equilibria, and in steady motions.

A system moves steadily where whatever A depends on keeps its value, although coordinates on which nothing depends may
move (a bicycle that rolls on, a top that spins about the vertical). Two looks decide it. The state is moved on
uniformly, far along everything that moves: A must not change at all, but for rounding. And it is moved as A itself
says it will move, over the time of each of its eigenvalues: what is accelerated must not change A either, but for the
little by which the numbers of a start miss a steady motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import Flow, Tangents
from multibody_sym.dynamics.constraints.closing import Rows, closed_near
from multibody_sym.kinematics.masses.rates import varies_with_time
from multibody_sym.kinematics.steps import displaced as step_displaced
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import Source
from multibody_sym.numerics.arrays import EPSILON, UNDEFINED, Floats
from multibody_sym.numerics.rounding import eigenvalues, least_rounding, without_rounding
from multibody_sym.records import dataclass

NO_EIGENVALUES: Final = "the state is no equilibrium and no steady motion, and A changes as soon as it is let go"
_ADVICE: Final = (
    "linearise about an equilibrium (`--at equilibrium`; `equilibrium` finds all), or about a motion in which only "
    "coordinates change on which nothing depends; `--period T` gives multipliers of a motion that repeats itself"
)
_PARTS: Final = (0.37, 1.13, 2.9)
"""How far the state is moved on, in times in which the fastest coordinate moves by one unit, or one eigenvalue acts."""
_REST: Final = 1e-6
"""A speed this small beside all eigenvalues moves nothing while these act."""
_SLOW: Final = 1e-3
"""Eigenvalues this small beside what moves are not waited for."""
_STEADY: Final = 1e-9
_MISSED: Final = 1e-5
"""The part of A by which it may change where numbers of the start miss a steady motion."""
_CLOSURE: Final = 1e3
"""How much more than rounding of the state loops leave that are closed again."""
_GROWTH: Final = 3.0
_SAMPLES: Final = 3
_SAFETY: Final = 16.0
_SEED: Final = 5


@dataclass(frozen=True, eq=False)
class Constancy:
    """Whether A is constant, without the states `left_out`; if not, and the system moves, the `reason`, by name.

    `rounding` (m x m): what rounding may make of A.
    """

    constant: bool
    left_out: frozenset[int]
    rounding: Floats
    reason: str = ""


def constancy_of(flow: Flow, q: Floats, u: Floats) -> Constancy:
    """Return whether A is constant along the motion from a state (q, u) at t = 0 that satisfies the constraints."""
    path = _Path(flow, q, u, flow.tangents(q, u))
    rounding = path.rounding(q, u)
    here = without_rounding(path.A(q, u), rounding)
    times = _Times.of(eigenvalues(here, rounding)[0], u, path.udot)
    left_out = path.varying(here, rounding, times.uniform)
    if left_out is None:
        return Constancy(False, frozenset(), rounding, path.reason(here, rounding, times.uniform))
    if path.accelerates(here, rounding, left_out, times):
        return Constancy(False, frozenset(), rounding, path.accelerated() if times.moves else "")
    return Constancy(True, left_out, rounding)


@dataclass(frozen=True)
class _Times:
    """How long states are moved on `uniform`ly, and as A says (`linear`); whether anything `moves` at all."""

    uniform: list[float]
    linear: list[float]
    moves: bool

    @staticmethod
    def of(values: npt.NDArray[np.complex128], u: Floats, udot: Floats) -> _Times:
        """Return the times for eigenvalues of A, speeds and accelerations."""
        sizes = np.abs(values)[np.abs(values) > 0.0]
        fastest = float(np.abs(u).max(initial=0.0))
        moves = fastest > _REST * (float(sizes.min()) if len(sizes) else _SLOW)
        natural = max(fastest if moves else 0.0, float(np.sqrt(np.abs(udot).max(initial=0.0)))) or 1.0
        acting = np.unique(np.round(np.log10(sizes[sizes > _SLOW * natural]), 1)) if len(sizes) else np.zeros(0)
        rates = [*(10.0**acting)] or [natural]
        growth = max(float(values.real.max(initial=0.0)), 0.0)
        limit = _GROWTH / growth if growth > 0.0 else np.inf
        scale = 1.0 / (fastest if moves else max(rates))
        return _Times(
            [part * scale for part in _PARTS],
            sorted({min(_PARTS[1] / x, limit) for x in rates}),
            moves,
        )


@dataclass(frozen=True, eq=False)
class _Path:
    """States along the motion from one."""

    flow: Flow
    q: Floats
    u: Floats
    tangents: Tangents

    @property
    def udot(self) -> Floats:
        """The accelerations (nu) at the start."""
        return self.flow.accelerations(self.q, self.u)

    def A(self, q: Floats, u: Floats, t: float = 0.0) -> Floats:
        """Return A at a state, in the independent components of the start."""
        return self._matrix(self.flow.known(q, u, t))

    def _matrix(self, known: Sequence[npt.ArrayLike]) -> Floats:
        by_state, _ = self.flow.derivatives(known)
        return by_state[self.tangents.places] @ self.flow.span(known, self.tangents.places)

    def rounding(self, q: Floats, u: Floats, t: float = 0.0) -> Floats:
        """Return what rounding of a state and of the parameters makes of A, seen at a few states beside it.

        Those at which A has no value tell nothing: a force may end at the state itself.
        """
        rng, here = np.random.default_rng(_SEED), self.A(q, u, t)
        found = np.zeros_like(here)
        for _ in range(_SAMPLES):
            with suppress(*UNDEFINED, np.linalg.LinAlgError):
                change = np.abs(self._matrix(self._rounded(q, u, t, rng)) - here)
                found = np.maximum(found, np.where(np.isfinite(change).all(), change, 0.0))
        return least_rounding(here, _SAFETY * (found + EPSILON * np.abs(here)))

    def _rounded(self, q: Floats, u: Floats, t: float, rng: np.random.Generator) -> tuple[npt.ArrayLike, ...]:
        """Return what programs know at a state with all numbers rounded in the last place, up or down."""

        def rounded(values: npt.ArrayLike) -> Floats:
            numbers = np.asarray(values, dtype=float)
            return numbers * (1.0 + EPSILON * rng.choice([-1.0, 1.0], numbers.shape))

        angles = np.array([speed.unit == "rad/s" for speed in self.flow.mechanism.speeds], dtype=bool)
        turned = EPSILON * rng.choice([-1.0, 1.0], angles.shape) * angles
        parameters = rounded(self.flow.parameters)
        chosen = self.flow.mechanism.parameters.places_from(Source.CHOSEN)
        parameters[chosen] = np.array(self.flow.parameters)[chosen]
        beside = displaced(self.flow.mechanism, rounded(q), turned)
        return self.flow.known(beside, rounded(u), t, parameters)

    def moved(self, sigma: Floats, du: Floats, t: float) -> tuple[Floats, Floats] | None:
        """Return the state at time t that is nearest to one displaced, None where there is none."""
        rows = Rows(self.flow.mechanism, self.flow.parameters, range(len(self.flow.mechanism.rows)), t)
        try:
            q = closed_near(rows, displaced(self.flow.mechanism, self.q, sigma))
            return None if q is None else (q, self.flow.completed(q, self.u + du, t, self.tangents.places))
        except (*UNDEFINED, np.linalg.LinAlgError):
            return None

    def along(self, sigma: Floats, du: Floats, t: float) -> tuple[Floats, Floats] | None:
        """Return A there and what rounding makes of it, None where it has no value."""
        state = self.moved(sigma, du, t)
        if state is None:
            return None
        try:
            found = self.A(*state, t), self.rounding(*state, t)
        except (*UNDEFINED, np.linalg.LinAlgError):
            return None
        return found if np.isfinite(found).all() else None

    # --- uniformly --------------------------------------------------------------------------------------------------

    def varying(self, here: Floats, rounding: Floats, times: Sequence[float]) -> frozenset[int] | None:
        """Return states whose rates change while all moves on uniformly; None where others depend on them."""
        seen, allowed = [here], rounding
        changing: set[int] = set()
        for t in times:
            there = self.along(self.u * t, np.zeros_like(self.u), t)
            if there is None:
                return None
            seen.append(there[0])
            allowed = np.maximum(allowed, there[1])
            changing |= set(np.flatnonzero(_changed(here, rounding, *there).any(axis=1)).tolist())
        kept = [k for k in range(len(here)) if k not in changing]
        depending = np.ix_(kept, sorted(changing))
        depends = any((np.abs(A) > _CLOSURE * allowed)[depending].any() for A in seen)
        return None if depends or (changing and not kept) else frozenset(changing)

    def reason(self, here: Floats, rounding: Floats, times: Sequence[float]) -> str:
        """Return on what that changes A depends."""
        moving = self._moving(here, rounding, times)
        if not moving and any(self._differs(here, rounding, np.zeros_like(self.u), t) for t in times):
            masses = [body.name for body in self.flow.mechanism.bodies if varies_with_time(body)]
            why = f", as the mass of {masses[0]} does," if masses else ""
            return f"A depends on time{why or ','} and has no eigenvalues that tell how small motions go on; {_ADVICE}"
        named = moving or [k for k in range(len(self.u)) if abs(self.u[k]) > _REST * np.abs(self.u).max()]
        return self._refused(self._named(named))

    def _moving(self, here: Floats, rounding: Floats, times: Sequence[float]) -> list[int]:
        """Return the deviations that move and of which each alone changes A."""
        found = []
        for places in self._freedoms():
            alone = np.zeros_like(self.u)
            alone[places] = self.u[places]
            if alone.any() and any(self._differs(here, rounding, alone * t, t) for t in times):
                found += places
        return found

    def _freedoms(self) -> Iterator[list[int]]:
        for body in self.flow.mechanism.bodies:
            yield from (list(free.u) for free in body.free_steps)

    def _differs(self, here: Floats, rounding: Floats, sigma: Floats, t: float) -> bool:
        there = self.along(sigma, np.zeros_like(self.u), t)
        return there is None or bool(_changed(here, rounding, *there).any())

    # --- as A says --------------------------------------------------------------------------------------------------

    def accelerates(self, here: Floats, rounding: Floats, left_out: frozenset[int], times: _Times) -> bool:
        """Return whether A changes on the way that the state takes by its accelerations."""
        keep = [k for k in range(len(here)) if k not in left_out]
        first = np.concatenate([self.u, self.udot])[self.tangents.places]
        size = len(self.u)
        kept = np.ix_(keep, keep)
        for t in times.linear:
            z = self.tangents.X @ _after(here, first, t)
            there = self.along(z[:size], z[size:], t)
            if there is None:
                return True
            noise, change = _CLOSURE * np.maximum(rounding, there[1])[kept], (there[0] - here)[kept]
            if (np.abs(change) > _MISSED * _sizes(here[kept]) + noise).any() or _tells(here[kept], change, noise):
                return True
        return False

    def accelerated(self) -> str:
        """Return which speeds change."""
        udot = self.udot
        places = [k for k in range(len(udot)) if abs(udot[k]) > _REST * np.abs(udot).max()]
        speeds = self.flow.mechanism.speeds
        what = ", ".join(f"{speeds[k].name}' = {udot[k]:.6g}" for k in places)
        return self._refused(f"speeds change ({what}), and A with them{self._angles_advice(places)}")

    # --- words ------------------------------------------------------------------------------------------------------

    def _named(self, places: Sequence[int]) -> str:
        mechanism, told = self.flow.mechanism, []
        for body in mechanism.bodies:
            for free in body.free_steps:
                if set(free.u).isdisjoint(places):
                    continue
                for q, u in free.rate_pairs:
                    told.append(f"{mechanism.coordinates[q].name} ({self.u[u]:.6g} {mechanism.speeds[u].unit})")
                if not free.step.speeds_are_rates:
                    rate = float(np.linalg.norm(self.u[list(free.u)]))
                    told.append(f"the attitude of joint {body.joint_name} ({rate:.6g} rad/s)")
        return f"A depends on what moves: {', '.join(told)}{self._angles_advice(places)}"

    def _angles_advice(self, places: Sequence[int]) -> str:
        """Return that three angles serve where a steady precession seen in a body's axes would not be constant."""
        balls = [
            body.joint_name
            for body in self.flow.mechanism.bodies
            for free in body.free_steps
            if free.step.unit_quaternion and not set(free.u).isdisjoint(places)
        ]
        if not balls:
            return ""
        joints = "joint " + balls[0] if len(balls) == 1 else "joints " + ", ".join(balls)
        return (
            f"; in the axes of a body with a quaternion a steady precession is not constant, in three angles it is: "
            f"declare `angles: zxz` or the like for {joints}"
        )

    def _refused(self, why: str) -> str:
        return f"the state is no equilibrium and no steady motion: {why}; {_ADVICE}"


def displaced(mechanism: Mechanism, q: Floats, sigma: Floats) -> Floats:
    """Return q (nq) displaced by sigma (nu): coordinates by theirs, quaternions turned by the rotation vector."""
    found = q.copy()
    for body in mechanism.bodies:
        for free in body.free_steps:
            found[list(free.q)] = step_displaced(free.step, q[list(free.q)], sigma[list(free.u)])
    return found


def _after(A: Floats, first: Floats, t: float) -> Floats:
    """Return x(t) of x' = A x + first, x(0) = 0."""
    from scipy.linalg import expm  # scipy takes longer to import than most answers take

    size = len(A)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = A, first
    found: Floats = expm(whole * t)[:size, size]
    return found


def _changed(here: Floats, rounding: Floats, there: Floats, rounding_there: Floats) -> npt.NDArray[np.bool_]:
    """Return which elements of A differ by more than rounding."""
    allowed = _STEADY * np.abs(here) + _CLOSURE * np.maximum(rounding, rounding_there)
    found: npt.NDArray[np.bool_] = np.abs(there - here) > allowed
    return found


def _tells(A: Floats, change: Floats, noise: Floats) -> bool:
    """Return whether a change of A tells on one of its eigenvalues, however small beside the others that is."""
    from scipy.linalg import eig  # as above

    values, left, right = eig(A, left=True, right=True)
    overlap = np.abs(np.sum(left.conj() * right, axis=0))
    moved = np.abs(np.einsum("ik,ij,jk->k", left.conj(), change, right))
    uncertain = np.einsum("ik,ij,jk->k", np.abs(left), noise, np.abs(right))
    return bool((moved > _MISSED * np.abs(values) * overlap + uncertain)[np.abs(values) > 0.0].any())


def _sizes(A: Floats) -> Floats:
    """Return beside what a change of each element counts: the largest of its row or column."""
    size = np.abs(A)
    rows, columns = (size.max(axis=axis, initial=0.0, keepdims=True) for axis in (1, 0))
    found: Floats = np.maximum(rows, columns)
    return found
