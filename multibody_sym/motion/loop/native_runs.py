"""Runs that differ in numbers alone, integrated by one call of the loop in C."""

from __future__ import annotations

import ctypes
from functools import cached_property, partial
from typing import Any, Final

import numpy as np

from multibody_sym.motion.loop.integrate import Integration, loop_for
from multibody_sym.motion.loop.native_loop import native_loop, piece_of, statistics_of
from multibody_sym.motion.loop.native_problem import NativeProblem, address
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.program.native import StateStruct
from multibody_sym.program.runtime_constants import Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

_STATE: Final = np.dtype(StateStruct)


@dataclass(frozen=True, eq=False)
class Each:
    """What came of n runs that are `like` one: samples (n, m, nq + nu), the states (n, nq + nu) and what they reached.

    `done`: of which that is all; one that is not done within a few steps, meets an event or fails is for `integrate`.
    """

    like: Problem
    samples: Floats
    ends: Floats
    states: Any
    done: list[bool]

    @cached_property
    def t(self) -> Floats:
        """The times of samples (m,)."""
        return self.like.times()

    @cached_property
    def q(self) -> Floats:
        """Coordinates (n, m, nq)."""
        return self.samples[:, :, : len(self.like.q0)]

    @cached_property
    def u(self) -> Floats:
        """Speeds (n, m, nu)."""
        return self.samples[:, :, len(self.like.q0) :]

    def integration(self, k: int) -> Integration:
        """Return what `integrate` does of run number k, if it is done."""
        q_final, u_final = np.split(self.ends[k], [len(self.like.q0)])
        taken = partial(statistics_of, self.like, self.states[k])
        return Integration(self.t, self.q[k], self.u[k], self.states[k].t, q_final, u_final, taken, None)


def integrate_each(like: Problem, parameters: Floats, q0: Floats, u0: Floats) -> Each | None:
    """Return what comes of the problem with other numbers: parameters (n, np), q0 (n, nq), u0 (n, nu).

    None where no single call does it.
    """
    count = len(parameters)
    if loop_for(like) is not native_loop or like.begun or like.jump or like.course or any(like.terminal):
        return None
    native, x0 = NativeProblem(like.again()), np.hstack([q0, u0])
    width = x0.shape[1]
    samples, ends = np.empty((count, like.sample_count, width)), np.empty((count, width))
    states, work = (StateStruct * count)(), np.empty(native.work)
    given = np.ascontiguousarray(parameters)
    native.library.mbs_integrate_each(
        native.handle,
        ctypes.c_longlong(count),
        None,
        address(given),
        ctypes.c_longlong(given.shape[1]),
        address(x0),
        ctypes.byref(states),
        address(work),
        ctypes.c_longlong(piece_of(like)),
        address(samples),
        address(ends),
    )
    found: Any = np.frombuffer(memoryview(states), dtype=_STATE)
    done = (found["status"] == Status.DONE) & (found["event"] < 0) & (found["passed"] == 0)
    done &= found["sample"] == like.sample_count
    return Each(like, samples, ends, states, done.tolist())
