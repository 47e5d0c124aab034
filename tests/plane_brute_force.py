"""Runs of plane systems by brute force: all modes at each instant, DOP853 between them, switches by root finding.

It shares nothing with the package: maximal coordinates, W = A M^-1 C^T, every mode tried, each look ahead integrated.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise, product

import numpy as np
from plane_geometry import Geometry
from plane_impacts import SLOW, Blow, NotUniqueError, SeveralError, affine, least_room, roomiest
from plane_models import Model
from scipy.integrate import DOP853
from scipy.optimize import brentq

NEAR = 1e-9
"""The gap (m) up to which things touch that touched before, or do so at the start."""
MEETS = 1e-13
"""The gap (m) up to which others touch: bounces may be lower than the gap above."""
PARTS = 1e-7
"""The speed (m/s) up to which what meets does not part: it would be back at once."""
LOW = 1e-13
"""The height (m) of a bounce that is none."""
LOOKS = 4
"""Looks within a step."""
AHEAD = (1e-6, 1e-5, 1e-4, 1e-3)
"""How far (s) a run looks ahead where several modes fit."""
MOST = 400
"""Events of a run."""
MANY, SHORT = 16, 1e-6
"""So many events in so short a time (s) end a run: endlessly many bounces of several things."""

Mode = dict[int, str]
"""The state of each element that acts: `on`, `stick`, `slide+`, `slide-`; others are open."""


@dataclass(frozen=True)
class Event:
    t: float
    element: str
    kind: str
    impulse: float = 0.0


@dataclass
class Run:
    """Events, the steps with what interpolates them, and where and why it ended."""

    events: list[Event] = field(default_factory=list)
    steps: list[tuple[float, Callable[[float], np.ndarray]]] = field(default_factory=list)
    end: float = 0.0
    why: str = ""

    def at(self, t: float) -> np.ndarray:
        """Return the coordinates and speeds of all bodies at a time, before what happens then."""
        place = bisect_left([until for until, _ in self.steps], t)
        return self.steps[min(place, len(self.steps) - 1)][1](t)


class Motion:
    """A mode of a system: accelerations and forces at any state, and what is not to become negative."""

    def __init__(self, geometry: Geometry, mode: Mode, kinetic: frozenset[int]) -> None:
        self.geometry, self.mode, self.n = geometry, mode, geometry.size
        self.active = sorted(mode)
        words = [mode[k] for k in self.active]
        elements = [geometry.elements[k] for k in self.active]
        self.slips = np.array([{"slide+": 1.0, "slide-": -1.0}.get(word, 0.0) for word in words])
        self.stuck = [j for j, word in enumerate(words) if word == "stick"]
        self.mu = np.array(
            [x.kinetic if k in kinetic else x.static for k, x in zip(self.active, elements, strict=True)]
        )
        self.redundant = False

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[self.n :], self.solved(t, y)[0]])

    def equations(self, t: float, y: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return W, -a0, C, and the free accelerations: held rows, then normals, then tangents of what sticks."""
        q, u = y[: self.n], y[self.n :]
        _, held, held_rate = self.geometry.held(q, u)
        rows = self.geometry.rows(q, u, self.active)
        A = np.vstack([held, rows.normal, rows.tangent[self.stuck]])
        C = A.copy()
        b = len(held)
        C[b : b + len(self.active)] -= (self.slips * self.mu)[:, None] * rows.tangent
        rates = np.concatenate([held_rate, rows.normal_rate, rows.tangent_rate[self.stuck]])
        free = self.geometry.forces(t, q, u) / self.geometry.mass
        return A @ (C / self.geometry.mass).T, -rates - A @ free, C, free

    def solved(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return accelerations and forces; the shortest ones where some are open."""
        W, b, C, free = self.equations(t, y)
        if self.redundant:
            found = affine(W, b)
            z = np.linalg.lstsq(W, b, rcond=1e-10)[0] if found is None else found[0]
        else:
            z = np.linalg.solve(W, b) if len(b) else b
        return free + (C.T @ z) / self.geometry.mass, z

    def laws(self, count: int) -> np.ndarray:
        """Return G with G z >= 0 for forces z (count,): normals press, what sticks is within its cone."""
        k, b = len(self.active), count - len(self.active) - len(self.stuck)
        G = np.zeros((k + 2 * len(self.stuck), count))
        G[:k, b : b + k] = np.eye(k)
        for i, j in enumerate(self.stuck):
            G[k + 2 * i : k + 2 * i + 2, b + j] = self.mu[j]
            G[k + 2 * i : k + 2 * i + 2, b + k + i] = 1.0, -1.0
        return G

    def watched(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return what ends the mode where it gets negative: forces, room in cones, slip along its way."""
        q, u = y[: self.n], y[self.n :]
        W, b, _, _ = self.equations(t, y)
        G = self.laws(len(b))
        rows = self.geometry.rows(q, u, self.active)
        slip = (rows.tangent @ u * self.slips)[self.slips != 0]
        if not self.redundant:
            return np.concatenate([G @ np.linalg.solve(W, b) if len(b) else b, slip])
        found = affine(W, b)
        if found is None:
            return np.concatenate([-np.ones(len(G)), slip])
        return np.concatenate([roomiest(G, np.zeros(len(G)), *found)[1], slip])


@dataclass(frozen=True)
class Choice:
    """A mode that fits at an instant, its accelerations, and which contacts have their kinetic coefficient."""

    mode: Mode
    kinetic: frozenset[int]
    udot: np.ndarray
    redundant: bool


class Simulation:
    """A run of a model, from a state that may be disturbed."""

    def __init__(self, model: Model, disturbance: float = 0.0) -> None:
        self.model, self.geometry, self.run = model, Geometry(model), Run()
        self.n, self.every = self.geometry.size, list(range(len(self.geometry.elements)))
        rng = np.random.default_rng(1)
        q = self.geometry.start + disturbance * rng.standard_normal(self.n)
        u = self.geometry.speeds_at_start() + disturbance * rng.standard_normal(self.n)
        self.t, self.q, self.u = 0.0, q, u
        self.mode: Mode = {}
        self.since: dict[int, float] = {}

    def simulate(self) -> Run:
        rows = self.geometry.rows(self.geometry.start, self.u, self.every)
        touching = [k for k in self.every if abs(rows.gap[k]) < NEAR and abs(rows.normal[k] @ self.u) < 1e-6]
        try:
            self._settle(touching)
            motion = self._motion(touching, None)
            while self.t < self.model.t_end and len(self.run.events) < MOST:
                self._pass(motion)
                if len(self.run.events) > MANY and self.t - self.run.events[-MANY].t < SHORT:
                    raise SeveralError("several things bounce in turn without end")
                if self.t < self.model.t_end:
                    motion = self._switch(motion)
            if len(self.run.events) >= MOST:
                self.run.why = "too many events"
        except (SeveralError, np.linalg.LinAlgError, ValueError) as error:
            self.run.why = repr(error)
        self.run.end = self.t
        return self.run

    # --- an instant

    def _settle(self, touching: list[int]) -> None:
        """Put positions onto what touches and joints, and speeds to rest there, by the least change."""
        weight = 1.0 / np.sqrt(self.geometry.mass)
        for _ in range(3):
            phi, held, _ = self.geometry.held(self.q, self.u)
            rows = self.geometry.rows(self.q, self.u, touching)
            A, gaps = np.vstack([held, rows.normal]), np.concatenate([phi, rows.gap])
            if len(A):
                self.q = self.q - weight * (np.linalg.lstsq(A * weight, gaps, rcond=1e-9)[0])
        _, held, _ = self.geometry.held(self.q, self.u)
        rows = self.geometry.rows(self.q, self.u, touching)
        still = [i for i, k in enumerate(touching) if self._rubs(k) and abs(rows.tangent[i] @ self.u) < 10 * SLOW]
        A = np.vstack([held, rows.normal, rows.tangent[still]])
        if len(A):
            self.u = self.u - weight * (np.linalg.lstsq(A * weight, A @ self.u, rcond=1e-9)[0])

    def _rubs(self, k: int) -> bool:
        return self.geometry.elements[k].static > 0.0

    def _switch(self, motion: Motion) -> Motion:
        """Strike what closes, and return the mode that follows."""
        rows = self.geometry.rows(self.q, self.u, self.every)
        speeds = rows.normal @ self.u
        meets = [rows.gap[k] < MEETS and speeds[k] < PARTS for k in self.every]
        near = [k for k in self.every if meets[k] or (k in self.mode and rows.gap[k] < NEAR)]
        hits = dict[int, tuple[float, float]]()
        if any(speeds[k] < -SLOW for k in near):
            udot, _ = motion.solved(self.t, np.concatenate([self.q, self.u]))
            late = {k: left for k in near if (left := self._left(k, speeds[k], udot, rows)) is not None}
            hits = self._strike(near, late)
            after = self.geometry.rows(self.q, self.u, near).normal @ self.u
            near = [k for k, v in zip(near, after, strict=True) if v < PARTS]
        self._settle(near)
        return self._motion(near, hits)

    def _left(self, k: int, speed: float, udot: np.ndarray, rows: object) -> float | None:
        """Return how much longer (s) an element would bounce whose bounces are too low to count; else None."""
        e = self.geometry.elements[k].restitution
        falling = -(rows.normal[k] @ udot + rows.normal_rate[k])
        if speed >= -SLOW or not 0.0 < e < 1.0 or not falling > 0.0:
            return None
        low = (e * speed) ** 2 < 2 * falling * LOW
        return 2 * e * -speed / (falling * (1 - e)) if low else None

    def _strike(self, near: list[int], late: Mapping[int, float]) -> dict[int, tuple[float, float]]:
        """Change the speeds; return the impulse of each element that was struck, and how much later it rests."""
        rows = self.geometry.rows(self.q, self.u, near)
        elements = [self.geometry.elements[k] for k in near]
        R = np.vstack([rows.normal, rows.tangent])
        _, held, _ = self.geometry.held(self.q, self.u)
        inverse = np.diag(1.0 / self.geometry.mass)
        if len(held):
            G = held @ inverse
            inverse = inverse - G.T @ np.linalg.solve(G @ held.T, G)
        e = np.array([0.0 if k in late else x.restitution for k, x in zip(near, elements, strict=True)])
        static, kinetic = (np.array([getattr(x, name) for x in elements]) for name in ("static", "kinetic"))
        blow = Blow(R @ inverse @ R.T, R @ self.u, static, kinetic, e)
        blow.strike()
        self.u = self.u + inverse @ R.T @ blow.p
        told = np.where([i in blow.unsure for i in range(len(near))], np.nan, blow.p[: len(near)])
        least = 1e-12 * np.abs(blow.p).max()
        return {k: (float(told[i]), late.get(k, 0.0)) for i, k in enumerate(near) if blow.p[i] > least or k in late}

    def _motion(self, near: list[int], hits: Mapping[int, tuple[float, float]] | None) -> Motion:
        """Return the motion that follows, and note what has changed; `hits` are None at the start."""
        choice = self._chosen(near)
        motion = Motion(self.geometry, choice.mode, choice.kinetic)
        motion.redundant = choice.redundant
        if hits is not None:
            for k in sorted({*hits, *self.mode, *choice.mode}):
                before, now = self.mode.get(k, "open"), choice.mode.get(k, "open")
                impulse, late = hits.get(k, (0.0, 0.0))
                if before != now or impulse:
                    kind = now if before != now else "impact"
                    self._tell(Event(self.t + late, self.geometry.elements[k].name, kind, impulse))
        self.mode = choice.mode
        return motion

    def _tell(self, event: Event) -> None:
        """Note an event; what an element was said to do later it has done by now."""
        events = self.run.events
        for place, x in enumerate(events):
            if x.element == event.element and x.t > self.t:
                events[place] = replace(x, t=self.t)
        events.append(event)

    # --- which mode follows

    def _chosen(self, near: list[int]) -> Choice:
        """Return the mode that follows; what begins to slide has its kinetic coefficient from then on."""
        slips = self.geometry.rows(self.q, self.u, near).tangent @ self.u
        kinetic = frozenset(k for k, v in zip(near, slips, strict=True) if self._rubs(k) and abs(v) > SLOW)
        while True:
            choice = self._lasting(near, self._fitting(near, kinetic))
            slides = {k for k, word in choice.mode.items() if word[:5] == "slide"}
            if not self._unlike(slides - choice.kinetic):
                return choice
            kinetic |= choice.kinetic | slides

    def _unlike(self, contacts: set[int]) -> set[int]:
        """Return the contacts the two coefficients of which differ."""
        return {k for k in contacts if self.geometry.elements[k].static != self.geometry.elements[k].kinetic}

    def _lasting(self, near: list[int], found: list[Choice]) -> Choice:
        """Return that of the modes that fit which still fits a little later."""
        if not found:
            raise SeveralError("no mode fits")
        found.sort(key=lambda choice: -sum(2 if word in ("on", "stick") else 1 for word in choice.mode.values()))
        if len(found) == 1:
            return found[0]
        size = 1e-7 * (np.abs(found[0].udot).max() + 1.0)
        for ahead in AHEAD:
            rooms = [self._later(choice, near, ahead) for choice in found]
            good = [choice for choice, room in zip(found, rooms, strict=True) if room >= -1e-10]
            if good and max(np.abs(x.udot - good[0].udot).max() for x in good) <= size:
                return good[0]
            found = good or found
        apart = max(np.abs(x.udot - found[0].udot).max() for x in found)
        if apart <= size:  # they end alike, sooner than that
            return max(found, key=lambda choice: self._later(choice, near, AHEAD[0]))
        raise NotUniqueError(f"{len(found)} modes fulfil the laws, {AHEAD[-1]:g} s later too: {apart:.3g} m/s^2 apart")

    def _fitting(self, near: list[int], moving: frozenset[int]) -> list[Choice]:
        """Return all modes that fit: at rest by static coefficients first, what slips then has its kinetic one."""
        rows = self.geometry.rows(self.q, self.u, near)
        slips = rows.tangent @ self.u
        queue, seen, ends = [moving], set[frozenset[int]](), list[Choice]()
        while queue:
            kinetic = queue.pop()
            if kinetic in seen:
                continue
            seen.add(kinetic)
            for choice in self._modes(near, slips, kinetic):
                after = rows.tangent @ choice.udot + rows.tangent_rate
                new = self._unlike(
                    {
                        k
                        for k, a in zip(near, after, strict=True)
                        if choice.mode.get(k, "")[:5] == "slide" and k not in kinetic and abs(a) > 1e-7
                    }
                )
                if new:
                    queue.append(kinetic | new)
                else:
                    ends.append(choice)
        return ends

    def _modes(self, near: list[int], slips: np.ndarray, kinetic: frozenset[int]) -> list[Choice]:
        options = []
        for k, v in zip(near, slips, strict=True):
            if not self._rubs(k):
                options.append(["open", "on"])
            elif abs(v) > SLOW:
                options.append(["open", "slide+" if v > 0 else "slide-"])
            else:
                options.append(["open", "stick", "slide+", "slide-"])
        found = []
        y = np.concatenate([self.q, self.u])
        rows = self.geometry.rows(self.q, self.u, near)
        for words in product(*options):
            mode = {k: word for k, word in zip(near, words, strict=True) if word != "open"}
            choice = self._fits(Motion(self.geometry, mode, kinetic), y, near, slips, rows)
            if choice is not None:
                found.append(choice)
        return found

    def _fits(self, motion: Motion, y: np.ndarray, near: list[int], slips: np.ndarray, rows: object) -> Choice | None:
        W, b, C, free = motion.equations(self.t, y)
        found = affine(W, b)
        if found is None:
            return None
        z, idle = found
        G = motion.laws(len(b))
        if len(idle):
            z, _ = roomiest(G, np.zeros(len(G)), z, idle)
        if least_room(G, np.zeros(len(G)), z) < 0.0:
            return None
        udot = free + (C.T @ z) / self.geometry.mass
        size = np.abs(free).max() + np.abs(C.T @ z / self.geometry.mass).max(initial=0.0) + 1.0
        opening = rows.normal @ udot + rows.normal_rate
        starting = rows.tangent @ udot + rows.tangent_rate
        for i, k in enumerate(near):
            word = motion.mode.get(k, "open")
            sign = {"slide+": 1.0, "slide-": -1.0}.get(word, 0.0)
            if word == "open" and opening[i] < -1e-9 * size:
                return None
            if sign and abs(slips[i]) <= SLOW and sign * starting[i] < -1e-9 * size:
                return None
        if len(idle) and np.abs(idle @ C / self.geometry.mass).max() > 1e-7:
            raise SeveralError("the motion is not unique")
        kinetic = frozenset(
            k for k, mu in zip(motion.active, motion.mu, strict=True) if mu != self.geometry.elements[k].static
        )
        return Choice(motion.mode, kinetic, udot, bool(len(idle)))

    def _later(self, choice: Choice, near: list[int], ahead: float) -> float:
        """Return the least of what is not to be negative a little later in a mode."""
        motion = Motion(self.geometry, choice.mode, choice.kinetic)
        motion.redundant = choice.redundant
        t, y = self.t + ahead, self._advanced(motion, self.t, np.concatenate([self.q, self.u]), self.t + ahead)
        opened = [k for k in near if k not in choice.mode]
        rows = self.geometry.rows(y[: self.n], y[self.n :], opened)
        return float(np.concatenate([motion.watched(t, y), rows.normal @ y[self.n :]]).min(initial=np.inf))

    # --- between instants

    @staticmethod
    def _advanced(motion: Motion, t: float, y: np.ndarray, until: float) -> np.ndarray:
        """Return the state at a time by one step, more if the step is too long."""
        if until <= t:
            return y
        solver = DOP853(motion, t, y, until, rtol=1e-12, atol=1e-13, first_step=until - t)
        while solver.status == "running":
            solver.step()
        return solver.y

    def _pass(self, motion: Motion) -> None:
        """Go on in a mode up to the end or to the first switch."""
        watch = _Watch(self.geometry, motion, self.every)
        y = np.concatenate([self.q, self.u])
        solver = DOP853(motion, self.t, y, self.model.t_end, rtol=1e-12, atol=1e-13, max_step=0.02)
        while solver.status == "running":
            before, y0 = solver.t, solver.y.copy()
            solver.step()
            if solver.status == "failed":
                raise SeveralError("a step fails")
            dense = solver.dense_output()
            found = watch.first(before, solver.t, dense)
            if found is None:
                self.run.steps.append((solver.t, dense))
                continue
            t, g = found
            for _ in range(2):
                y = self._advanced(motion, before, y0, t)
                h = 1e-3 * (solver.t - before)
                slope = (g(t + h, dense(t + h)) - g(t - h, dense(t - h))) / (2 * h)
                step = g(t, y) / slope if slope else 0.0
                t = min(max(t - (step if abs(step) < h else 0.0), before), solver.t)
            y = self._advanced(motion, before, y0, t)
            self.run.steps.append((t, dense))
            self.t, self.q, self.u = t, y[: self.n], y[self.n :]
            return
        self.t, self.q, self.u = solver.t, solver.y[: self.n], solver.y[self.n :]


class _Watch:
    """What may end a mode, looked at from look to look within steps."""

    def __init__(self, geometry: Geometry, motion: Motion, every: list[int]) -> None:
        self.geometry, self.motion, self.n = geometry, motion, geometry.size
        self.open = [k for k in every if k not in motion.mode]
        self.last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self.older: tuple[float, np.ndarray] | None = None

    def _look(self, t: float, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows = self.geometry.rows(y[: self.n], y[self.n :], self.open)
        return rows.gap, rows.normal @ y[self.n :], self.motion.watched(t, y)

    def _gap(self, k: int) -> Callable[[float, np.ndarray], float]:
        return lambda t, y: float(self.geometry.rows(y[: self.n], y[self.n :], [k]).gap[0])

    def _rate(self, k: int) -> Callable[[float, np.ndarray], float]:
        return lambda t, y: float(self.geometry.rows(y[: self.n], y[self.n :], [k]).normal[0] @ y[self.n :])

    def _watched(self, j: int) -> Callable[[float, np.ndarray], float]:
        return lambda t, y: float(self.motion.watched(t, y)[j])

    def first(
        self, t0: float, t1: float, dense: Callable[[float], np.ndarray]
    ) -> tuple[float, Callable[[float, np.ndarray], float]] | None:
        """Return when the first function crosses zero in a step, and which."""
        times = np.linspace(t0, t1, LOOKS + 1)
        if self.last is None:
            self.last = self._look(t0, dense(t0))
        for a, b in pairwise(times):
            now = self._look(b, dense(b))
            found = [x for x in (*self._closing(a, b, now, dense), *self._ending(a, b, now, dense)) if x is not None]
            self.older, self.last = (a, self.last[2]), now
            if found:
                return min(found, key=lambda x: x[0])
        return None

    def _closing(self, a: float, b: float, now: tuple[np.ndarray, ...], dense: Callable[[float], np.ndarray]):
        (gap0, rate0, _), (gap1, rate1, _) = self.last, now
        for i, k in enumerate(self.open):
            if gap1[i] >= 0 and not (rate0[i] < 0 < rate1[i] and gap0[i] > 0):
                continue
            gap, rate = self._gap(k), self._rate(k)
            start, end = a, b
            if gap1[i] >= 0:
                end = _root(rate, dense, a, b)
                if gap(end, dense(end)) >= 0:
                    continue
            if gap0[i] <= MEETS / 10:
                if rate0[i] <= 0:
                    peak = self._turn(a, end, rate, dense)
                else:
                    peak = _root(rate, dense, a, end) if rate(end, dense(end)) < 0 else a
                if peak is None or gap(peak, dense(peak)) <= 0:
                    yield a, gap
                    continue
                start = peak
            yield _root(gap, dense, start, end), gap

    @staticmethod
    def _turn(a: float, b: float, rate: Callable, dense: Callable[[float], np.ndarray]) -> float | None:
        """Return a time after a at which something has risen, if it has."""
        for k in range(1, 12):
            t = a + (b - a) * 0.5**k
            if rate(t, dense(t)) > 0:
                return t
        return None

    def _ending(self, a: float, b: float, now: tuple[np.ndarray, ...], dense: Callable[[float], np.ndarray]):
        before, after = self.last[2], now[2]
        at = cache(lambda t: self.motion.watched(t, dense(t)))
        for j in range(len(after)):
            watched = self._watched(j)
            f = lambda t, j=j: at(t)[j]  # noqa: E731
            if after[j] < 0.0:
                start = a
                if before[j] <= 1e-12:
                    tries = [a + (b - a) * 0.5**k for k in range(1, 20)]
                    start = next((t for t in tries if f(t) > 0.0), a)
                    if start == a and before[j] <= 0.0:
                        if after[j] < -1e-11:
                            yield a, watched
                        continue
                yield _root(watched, dense, start, b), watched
            elif self.older is not None and len(self.older[1]) == len(after):
                middle = self._dip(j, a, b, after[j], f)
                if middle is not None:
                    yield _root(watched, dense, a, middle), watched

    def _dip(self, j: int, a: float, b: float, after: float, f: Callable[[float], float]) -> float | None:
        """Return a time between looks at which something is negative, if its parabola says so."""
        (t0, x0), x1 = self.older, self.last[2][j]
        slope0, slope1 = (x1 - x0[j]) / (a - t0), (after - x1) / (b - a)
        if not slope0 < 0 < slope1 or x1 <= 0:
            return None
        for low, high in ((t0, a), (a, b)):
            for t in np.linspace(low, high, 9)[1:-1]:
                if low == a and f(t) < 0:
                    return float(t)
        return None


def _root(f: Callable[[float, np.ndarray], float], dense: Callable[[float], np.ndarray], a: float, b: float) -> float:
    """Return where a function of a step changes its sign; the end nearest to that where rounding hides it."""
    at_a, at_b = f(a, dense(a)), f(b, dense(b))
    if at_a * at_b >= 0.0:
        return a if abs(at_a) < abs(at_b) else b
    return float(brentq(lambda t: f(t, dense(t)), a, b, xtol=1e-15))
