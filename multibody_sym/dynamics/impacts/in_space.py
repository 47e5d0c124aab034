"""Slip in space, whose direction turns on the way: an ODE in the normal impulse at 1e-12.

With v_t = exp(l) (cos phi, sin phi), e its direction, and dp = |v_t| ds nothing is singular where slip stops:

    phi' = e_x (K_tn - mu K_tt e),  l' = e (K_tn - mu K_tt e),  v_n' = |v_t| (K_nn - mu K_nt e),  p_t' = -mu |v_t| e

The direction comes to one that stays; from there on all is straight. (Battle, J. Appl. Mech. 63 (1996), Stronge,
Impact Mechanics, 4.)
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.impacts.restitution import Goal, Normal
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

EXACT: Final = 1e-13
"""Relative error of a step."""
STOPPED: Final = -34.0
"""The logarithm of 2e-15: what is left of v_t then is rounding of what there was."""
SETTLED: Final = 1e-14
"""A direction that turns at less than this part of its terms stays: the rest is straight."""
MOST: Final = 10_000
"""Steps of one slip: some fifty are usual."""
PASSES: Final = 30

# Places in the state of the ODE.
PHI, LOG, VN, P, W, Q, L = 0, 1, 2, 3, 4, slice(5, 7), 7


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
    return bool(abs(_rates(K, mu, e)[0]) > SETTLED * terms)


def _rates(K: Floats, mu: float, e: Floats) -> tuple[float, float]:
    """Return phi' and l' in the direction e."""
    a = K[1:, 0] - mu * (K[1:, 1:] @ e)
    return float(e[0] * a[1] - e[1] * a[0]), float(e @ a)


def turned(K: Floats, mu: float, v: Floats, at: Normal, goal: Goal) -> Turned:
    """Return what slip at v (2) with K (3, 3) does until its stage ends, it stops, or its direction stays."""
    size, speed = float(np.trace(K)), float(np.linalg.norm(v))
    slip = _Slip(K / size, mu, size / speed, speed, at, goal)
    y = np.zeros(8)
    y[PHI], y[VN] = np.arctan2(v[1], v[0]), at.v / speed
    solver = slip.solver(y, np.inf)
    for _ in range(MOST):
        solver.step()
        if slip.missing(solver.y) <= 0.0:
            return slip.told(slip.at_end(y, float(solver.t - solver.t_old)), ended=True)
        y = solver.y
        if y[LOG] < STOPPED or not turns(K, mu, slip.direction(y)):
            return slip.told(y, ended=False)
    raise NoSolutionError(
        "slip in space turns without end in an impact: a mass or a moment of inertia is nearly zero", number="N108"
    )


@dataclass(frozen=True)
class _Slip:
    """The ODE in numbers without units: speeds by `speed`, impulses times `mass`."""

    K: Floats
    mu: float
    mass: float
    speed: float
    begun: Normal
    goal: Goal

    def direction(self, y: Floats) -> Floats:
        return np.array([np.cos(y[PHI]), np.sin(y[PHI])])

    def rates(self, _: float, y: Floats) -> Floats:
        e, speed, K = self.direction(y), np.exp(y[LOG]), self.K
        rates = np.empty(8)
        rates[PHI], rates[LOG] = _rates(K, self.mu, e)
        rates[VN] = speed * (K[0, 0] - self.mu * float(K[0, 1:] @ e))
        rates[P], rates[W] = speed, y[VN] * speed
        rates[Q], rates[L] = -self.mu * speed * e, self.mu * speed * speed
        return rates

    def solver(self, y: Floats, s: float) -> Any:
        from scipy.integrate import DOP853  # scipy takes longer to import than a run without impacts

        atol = EXACT * np.maximum(np.abs(y), np.array([1.0, 1.0, *[abs(self.begun.v) / self.speed + 1e-3] * 6]))
        return DOP853(self.rates, 0.0, y, s, rtol=EXACT, atol=atol)

    def after(self, y: Floats, s: float) -> Floats:
        """Return the state s later."""
        if s <= 0.0:
            return y
        solver = self.solver(y, s)
        while solver.status == "running":
            solver.step()
        return np.asarray(solver.y, dtype=float)

    def at_end(self, y: Floats, s: float) -> Floats:
        """Return the state in which the stage ends, which is no more than s after y."""
        low, high, here = 0.0, s, s
        for _ in range(PASSES):
            there = self.after(y, here)
            missing, at = self.missing(there), self.normal(there)
            low, high = (here, high) if missing > 0.0 else (low, here)
            fast = np.exp(there[LOG]) / self.mass  # dp/ds
            slope = fast * self.goal.slope(at, self.rates(0.0, there)[VN] * self.speed / fast)
            wanted = here + missing / slope if slope > 0.0 else (low + high) / 2.0
            if abs(wanted - here) <= 4e-16 * here or high - low <= 4e-16 * high:
                return there
            here = wanted if low < wanted < high else (low + high) / 2.0
        return there

    def normal(self, y: Floats) -> Normal:
        """Return the normal state in the units of the problem."""
        begun, speed = self.begun, self.speed
        return Normal(y[VN] * speed, begun.p + y[P] / self.mass, begun.W + y[W] * speed / self.mass)

    def missing(self, y: Floats) -> float:
        return self.goal.missing(self.normal(y))

    def told(self, y: Floats, *, ended: bool) -> Turned:
        at = self.normal(y)
        stopped = y[LOG] < STOPPED
        velocity = np.zeros(2) if stopped else self.speed * np.exp(y[LOG]) * self.direction(y)
        impulse, lost = y[Q] / self.mass, y[L] * self.speed / self.mass
        return Turned(self.goal.met(at) if ended else at, impulse, velocity, float(lost), ended)
