"""Runs that differ in numbers alone, integrated by one call of the loop in C."""

from __future__ import annotations

import ctypes
from functools import partial
from typing import Any, Final

import numpy as np

from multibody_sym.integrators.flow import Status
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.integration import Integration, loop_for
from multibody_sym.runtime.native import StateStruct
from multibody_sym.runtime.native_loop import native_loop, piece_of, statistics_of
from multibody_sym.runtime.native_method import address
from multibody_sym.runtime.native_problem import NativeProblem
from multibody_sym.runtime.problem import Problem

_STATE: Final = np.dtype(StateStruct)


def integrate_each(like: Problem, parameters: Floats, q0: Floats, u0: Floats) -> list[Integration | None]:
    """Return what `integrate` does of the problem with other numbers: parameters (n, np), q0 (n, nq), u0 (n, nu).

    None of a run that is not done within a few steps, meets an event or fails: it is one for `integrate`.
    """
    count = len(parameters)
    if loop_for(like) is not native_loop or like.begun or like.jump or like.course or any(like.terminal):
        return [None] * count
    native, x0 = NativeProblem(like.again()), np.hstack([q0, u0])  # a copy: threads write their own
    width = x0.shape[1]
    samples, ends = np.empty((count, like.samples, width)), np.empty((count, width))
    states, work = (StateStruct * count)(), np.empty(native.work)
    given = np.ascontiguousarray(parameters)
    native.library.mbs_integrate_each(
        native.handle,
        native.system,
        ctypes.c_longlong(count),
        address(given),
        ctypes.c_longlong(given.shape[1]),
        address(x0),
        ctypes.byref(states),
        address(work),
        ctypes.c_longlong(piece_of(like)),
        address(samples),
        address(ends),
    )
    return _integrations(like, samples, ends, states)


def _integrations(like: Problem, samples: Floats, ends: Floats, states: Any) -> list[Integration | None]:
    """Return what came of each run; what all have in common is looked at once, since this is done for every run."""
    found = np.frombuffer(states, dtype=_STATE)
    done = (found["status"] == Status.DONE) & (found["event"] < 0) & (found["passed"] == 0)
    done &= found["sample"] == like.samples
    nq, times = len(like.q0), like.times()
    halves = samples[:, :, :nq], samples[:, :, nq:], ends[:, :nq], ends[:, nq:]
    runs = enumerate(zip(done.tolist(), found["t"].tolist(), *halves, strict=True))
    return [
        Integration(times, q, u, t, last_q, last_u, partial(statistics_of, like, states[k]), None) if fine else None
        for k, (fine, t, q, u, last_q, last_u) in runs
    ]
