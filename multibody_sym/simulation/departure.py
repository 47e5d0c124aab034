"""Runs that leave their constraints: what a method lets phi grow to, beside the size of the model."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.constraints.closing import Missed, Rows
from multibody_sym.integrators.flow import Status
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.integration import Integration
from multibody_sym.runtime.problem import Problem, RunFailure

_LEFT: Final = 1e-3
"""The part of a row's size, as `Missed` has it, by which a run that keeps it never misses it."""
_SIZED: Final = 20


def until_departure(mechanism: Mechanism, problem: Problem, done: Integration) -> Integration:
    """Return a run that kept its constraints, or one as failed at the first sample at which it had left them."""
    if done.failure is not None or done.statistics.drift_position <= problem.closure:
        return done
    rows = Rows(mechanism, problem.parameters.tolist(), range(len(mechanism.rows))).holonomic()
    allowed = _LEFT * _sizes(rows, done)
    for k in range(len(done.t)):
        missed = _missed(rows, done, k)
        left = np.zeros(0) if missed is None else np.flatnonzero(np.abs(missed.residuals) > allowed)
        if len(left):
            return _ended(done, k, rows.active[int(left[0])])
    return done


def _ended(done: Integration, k: int, row: int) -> Integration:
    """Return the run up to sample k, at which a row is broken."""
    t, q, u = done.t[: k + 1], done.q[: k + 1], done.u[: k + 1]
    failure = RunFailure(Status.LEFT, float(t[k]), row)
    return replace(done, t=t, q=q, u=u, t_final=float(t[k]), q_final=q[k], u_final=u[k], failure=failure)


def _sizes(rows: Rows, done: Integration) -> Floats:
    """Return the largest size of each row in the run, seen at a few samples; infinite where it has none."""
    places = np.unique(np.linspace(0, len(done.t) - 1, _SIZED).astype(int))
    seen = [missed.sizes for missed in (_missed(rows, done, int(k)) for k in places) if missed is not None]
    largest = np.max(seen, axis=0, initial=0.0)
    return np.where(largest > 0.0, largest, np.inf)


def _missed(rows: Rows, done: Integration, k: int) -> Missed | None:
    return replace(rows, t=float(done.t[k])).missed(done.q[k])
