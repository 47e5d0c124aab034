"""Slip in space, whose direction turns on the way, by quadrature: to 1e-13.

With v_t = exp(l) (cos phi, sin phi), e its direction, and dp = |v_t| ds nothing is singular where slip stops:

    phi' = e_x (K_tn - mu K_tt e),  l' = e (K_tn - mu K_tt e),  v_n' = |v_t| (K_nn - mu K_nt e),  p_t' = -mu |v_t| e

phi' depends on phi alone and has its zeros where a quartic has them: phi comes to the next one, from where all is
straight. On the way there, phi = phi* - d exp(-tau), everything else is an integral over tau. (Battle, J. Appl. Mech.
63 (1996), Stronge, Impact Mechanics, 4.)
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, cached_property
from typing import Final

import numpy as np

from multibody_sym.dynamics.impacts.restitution import Goal, Normal
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

DEGREE: Final = 28
"""Of the polynomials by which integrands are integrated over a panel, ..."""
EXACT: Final = 1e-14
"""... whose last coefficients are no more than this part of the largest."""
STOPPED: Final = -34.0
"""The logarithm of 2e-15: what is left of v_t then is rounding of what there was."""
SETTLED: Final = 1e-14
"""A direction that turns at less than this part of its terms stays: the rest is straight."""
MOST: Final = 1000
"""Panels of one slip: some twenty are usual."""
PASSES: Final = 30
LONGEST: Final = 4.0
"""The largest panel in tau, ..."""
NARROWEST: Final = 1e-12
"""... and the smallest at whose first node an end is sought."""


@dataclass(frozen=True)
class Turned:
    """What slip has done: p_t (2) it added, v_t (2) at its end, the energy it took, and whether its stage has ended."""

    at: Normal
    impulse: Floats
    velocity: Floats
    lost: float
    ended: bool


def turns(K: Floats, mu: float, v: Floats) -> bool:
    """Return whether slip along v (2) turns."""
    e = v / np.linalg.norm(v)
    terms = np.linalg.norm(K[1:, 0]) + mu * np.linalg.norm(K[1:, 1:])
    a = K[1:, 0] - mu * (K[1:, 1:] @ e)
    return bool(abs(e[0] * a[1] - e[1] * a[0]) > SETTLED * terms)


def turned(K: Floats, mu: float, v: Floats, at: Normal, goal: Goal) -> Turned:
    """Return what slip at v (2) with K (3, 3) does until its stage ends, it stops, or its direction stays."""
    size, speed = float(np.trace(K)), float(np.linalg.norm(v))
    slip = _Slip(K / size, mu, size / speed, speed, at, goal, _Direction.of(K / size, mu, v))
    y = np.zeros(7)
    y[VN] = at.v / speed
    tau, width = 0.0, 1.0
    for _ in range(MOST):
        panel = slip.panel(tau, width, y)
        if panel is None:
            width /= 2.0
            continue
        ended = np.asarray(slip.goal.missing(slip.normal(panel.y)))[1:] <= 0.0
        if ended[0] and width > NARROWEST:  # rounding of the whole panel is much beside so small a part of it
            width *= 1.0 + float(_rules()[0][1])  # twice as far as that node
            continue
        if ended.any():
            return slip.told(*slip.end_in(panel, 1 + int(np.argmax(ended))), ended=True)
        tau, y = tau + width, panel.y[:, -1]
        width = min(LONGEST, 2.0 * width)
        if y[LOG] < STOPPED or not turns(K, mu, slip.way.along(tau)):
            return slip.told(y, slip.way.along(tau), ended=False)
    raise NoSolutionError(
        f"the end of slip that turns in space was not found in {MOST} parts of its way: a mass or a moment of inertia "
        "may be nearly zero",
        number="N108",
    )


# Places in the integrals.
LOG, VN, P, W, Q, L = 0, 1, 2, 3, slice(4, 6), 6


@dataclass(frozen=True)
class _Direction:
    """phi' = Re(p z + q z^2), z = exp(i phi), from `first` up or down (`sense`) to its next zero `last`."""

    p: complex
    q: complex
    first: float
    last: float
    sense: float

    @classmethod
    def of(cls, K: Floats, mu: float, v: Floats) -> _Direction:
        p, q = complex(K[2, 0], K[1, 0]), -mu * complex(K[1, 2], -(K[2, 2] - K[1, 1]) / 2.0)
        first = float(np.arctan2(v[1], v[0]))
        begun = cls(p, q, first, first, 1.0)
        sense = float(np.sign(begun.pace(np.array(first))))
        ahead = min(sense * (zero - first) % (2.0 * np.pi) for zero in begun.zeros())
        return replace(begun, last=first + sense * ahead, sense=sense)

    def pace(self, phi: Floats) -> Floats:
        z = np.exp(1j * phi)
        return np.asarray((self.p * z + self.q * z * z).real)

    def zeros(self) -> list[float]:
        """Return where phi' is zero: at two angles at least, for its mean is zero."""
        quartic = [self.q, self.p, 0.0, self.p.conjugate(), self.q.conjugate()]
        phi: Floats = np.asarray(np.angle(np.roots(quartic)), dtype=float)
        terms = abs(self.p) + abs(self.q)
        for _ in range(8):
            z = np.exp(1j * phi)
            slope = (1j * self.p * z + 2j * self.q * z * z).real
            phi = phi - np.divide(self.pace(phi), slope, out=np.zeros_like(phi), where=np.abs(slope) > 1e-9 * terms)
        return [float(x) for x in phi[np.abs(self.pace(phi)) <= 1e-13 * terms]]

    @cached_property
    def _far(self) -> float:
        return abs(self.last - self.first)

    def at(self, tau: float, ahead: Floats) -> tuple[Floats, Floats]:
        """Return e (2, n) at tau + ahead, and ds/dtau = -(phi* - phi)/phi', which has a limit at phi*.

        phi' is a difference from phi*, and its change from tau on where that is the smaller one: each is rounded by its
        own size, so that slip that leaves a direction in which it would stay is smooth.
        """
        begun, left = self._far * np.exp(-tau), self._far * np.exp(-(tau + ahead))
        gone = -begun * np.expm1(-ahead)
        pace = self._change(self.last, -self.sense * left)
        first = self._change(self.last, np.array(-self.sense * begun))
        near = first + self._change(self.last - self.sense * begun, self.sense * gone)
        x = self.last - self.sense * left
        return np.array([np.cos(x), np.sin(x)]), left / (self.sense * np.where(gone < left, near, pace))

    def _change(self, phi: float, x: Floats) -> Floats:
        """Return phi' at phi + x minus that at phi."""
        z = np.exp(1j * phi)
        once, twice = (-2.0 * np.sin(k * x / 2.0) ** 2 + 1j * np.sin(k * x) for k in (1.0, 2.0))  # exp(i k x) - 1
        return np.asarray((self.p * z * once + self.q * z * z * twice).real)

    def along(self, tau: float) -> Floats:
        return self.at(tau, np.zeros(1))[0][:, 0]


@dataclass(frozen=True)
class _Panel:
    """A part of the way: from tau on, so wide, with what is integrated (7, n) at its nodes."""

    tau: float
    width: float
    y: Floats

    def inside(self, x: float) -> Floats:
        """Return what is integrated at x from -1 to 1."""
        nodes, weights, *_ = _rules()
        apart = x - nodes
        if not apart.all():
            return np.asarray(self.y[:, int(np.argmin(np.abs(apart)))])
        parts = weights / apart
        return np.asarray(self.y @ parts / parts.sum())


@dataclass(frozen=True)
class _Slip:
    """Slip in numbers without units: speeds by `speed`, impulses times `mass`."""

    K: Floats
    mu: float
    mass: float
    speed: float
    begun: Normal
    goal: Goal
    way: _Direction

    def panel(self, tau: float, width: float, y: Floats) -> _Panel | None:
        """Return a panel from where y (7) is; None where polynomials do not reach over it."""
        nodes, _, integral, coefficients = _rules()
        e, pace = self.way.at(tau, width * (nodes + 1.0) / 2.0)
        a = self.K[1:, :1] - self.mu * (self.K[1:, 1:] @ e)
        half = width / 2.0
        growing = (e * a).sum(axis=0) * pace
        log = y[LOG] + half * (integral @ growing)
        if not (np.isfinite(log).all() and log.max() < 300.0):
            return None
        speed = np.exp(log)
        dp = speed * pace
        closing = (self.K[0, 0] - self.mu * (self.K[0, 1:] @ e)) * dp
        first = np.array([dp, closing, -self.mu * e[0] * dp, -self.mu * e[1] * dp, self.mu * speed * dp])
        terms, most = self.mu + float(np.abs(self.K).max()), float(np.abs(dp).max())  # what rounding falsifies
        sizes = terms * np.array([float(np.abs(pace).max()), most, most, most, most, most * float(speed.max())])
        tails = np.abs(np.vstack([growing, first]) @ coefficients.T)[:, -2:].max(axis=1)
        if (tails > EXACT * sizes).any():
            return None
        p, vn, qx, qy, lost = half * (first @ integral.T)
        vn = y[VN] + vn
        found = [log, vn, y[P] + p, y[W] + half * (integral @ (vn * dp)), y[Q][0] + qx, y[Q][1] + qy, y[L] + lost]
        return _Panel(tau, width, np.array(found))

    def end_in(self, panel: _Panel, node: int) -> tuple[Floats, Floats]:
        """Return what is integrated, and the direction, where the stage ends, before a node of a panel."""
        nodes, *_ = _rules()
        low, high = float(nodes[node - 1]), float(nodes[node])
        here = high
        for _ in range(PASSES):
            there, ahead = panel.inside(here), panel.width * (here + 1.0) / 2.0
            at = self.normal(there)
            missing = self.goal.missing(at)
            low, high = (here, high) if missing > 0.0 else (low, here)
            e, pace = self.way.at(panel.tau, np.array([ahead]))
            fast = float(np.exp(there[LOG]) * pace[0]) / self.mass * panel.width / 2.0  # dp/dx
            rate = float(self.K[0, 0] - self.mu * (self.K[0, 1:] @ e[:, 0])) * self.mass * self.speed
            slope = fast * self.goal.slope(at, rate)
            wanted = here + missing / slope if slope > 0.0 else (low + high) / 2.0
            if abs(wanted - here) <= 4e-16 or high - low <= 4e-16:
                break
            here = wanted if low < wanted < high else (low + high) / 2.0
        return there, e[:, 0]

    def normal(self, y: Floats) -> Normal:
        """Return the normal state, or those of several nodes, in the units of the problem."""
        begun, speed = self.begun, self.speed
        return Normal(y[VN] * speed, begun.p + y[P] / self.mass, begun.W + y[W] * speed / self.mass)

    def told(self, y: Floats, e: Floats, *, ended: bool) -> Turned:
        at = self.normal(y)
        velocity = np.zeros(2) if y[LOG] < STOPPED else self.speed * np.exp(y[LOG]) * e
        impulse, lost = y[Q] / self.mass, y[L] * self.speed / self.mass
        return Turned(self.goal.met(at) if ended else at, impulse, velocity, float(lost), ended)


@cache
def _rules() -> tuple[Floats, Floats, Floats, Floats]:
    """Return Chebyshev's nodes on (-1, 1), barycentric weights, integrals from -1 to each node, coefficients."""
    from numpy.polynomial import chebyshev

    k = np.arange(DEGREE + 1)
    nodes = -np.cos(np.pi * k / DEGREE)
    weights = (-1.0) ** k
    weights[[0, -1]] /= 2.0
    coefficients = np.linalg.inv(chebyshev.chebvander(nodes, DEGREE))
    integrals = np.array([chebyshev.chebint(row, lbnd=-1.0) for row in np.eye(DEGREE + 1)])
    integral = chebyshev.chebvander(nodes, DEGREE + 1) @ integrals.T @ coefficients
    return np.asarray(nodes), np.asarray(weights), np.asarray(integral), np.asarray(coefficients)
