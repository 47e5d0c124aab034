"""The integration loop of runtime.c, driven from Python in pieces of about a tenth of a second."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import singledispatch
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.integrators.flow import Method, Status
from multibody_sym.integrators.runge_kutta import RungeKutta
from multibody_sym.runtime.native import MethodStruct, NativeFunction, ProblemStruct, StateStruct, SystemStruct
from multibody_sym.runtime.problem import Event, Problem, Progress, RunFailure, Statistics

Floats = NDArray[np.float64]

_FIRST_PIECE: Final = 200  # steps
_LARGEST_PIECE: Final = 10_000_000
_SECONDS: Final = 0.1
_PROGRAMS: Final = ("inputs", "state_derivative", "project_position", "project_velocity", "normalize", "events")


def native_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Integrate in C; see `Loop`. What was written before an interruption stays in `samples`."""
    parameters, modes = (np.array(values, dtype=float) for values in (problem.parameters, problem.modes))
    terminal = (ctypes.c_int * len(problem.terminal))(*problem.terminal)
    method, system = _method(problem.method), _system(problem, parameters, modes, terminal)
    structure = _problem(problem, method, system)
    x0 = problem.x0
    state, steps, done = StateStruct(), _FIRST_PIECE, False
    events: list[Event] = []
    derivative = problem.compiled["state_derivative"]
    assert isinstance(derivative, NativeFunction)
    library, handles = derivative.library, [ctypes.byref(s) for s in (structure, state)]
    work = np.zeros(library.mbs_work(handles[0]))
    library.mbs_start(handles[0], _address(x0), handles[1], _address(work))
    while not done:
        begin, before = time.perf_counter(), state.steps
        left = steps
        while left > 0 and not done:
            room = ctypes.c_longlong(problem.samples - state.sample)
            piece = ctypes.c_longlong(left)
            library.mbs_integrate(*handles, _address(work), piece, room, _address(samples[state.sample :]))
            done = state.status != Status.RUNNING
            left = before + steps - state.steps
            if state.event >= 0:
                events.append(Event(state.t, state.event, problem.terminal[state.event]))
        seconds = max(time.perf_counter() - begin, 1e-6)
        steps = max(1, min(10 * steps, int(steps * _SECONDS / seconds), _LARGEST_PIECE))
        yield replace(_progress(problem, state, work[: len(x0)]), events=tuple(events))


def _address(array: Floats) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


@singledispatch
def _method(method: Method) -> MethodStruct:
    """Return the method for C; it points into the method's arrays, which must live as long."""
    raise TypeError(f"{method!r} is no method")


@_method.register
def _explicit(method: RungeKutta) -> MethodStruct:
    tableau = method.tableau
    return MethodStruct(
        stages=tableau.stages,
        all_stages=len(tableau.c),
        order=tableau.order,
        error_order=tableau.error_order,
        dense_degree=tableau.dense.shape[1],
        a=_address(tableau.A),
        c=_address(tableau.c),
        error=None if tableau.error is None else _address(tableau.error),
        coarse_error=None if tableau.coarse_error is None else _address(tableau.coarse_error),
        dense=_address(tableau.dense),
    )


def _system(
    problem: Problem, parameters: Floats, modes: Floats, terminal: ctypes.Array[ctypes.c_int]
) -> SystemStruct:
    programs = {}
    for name in _PROGRAMS:
        if name in problem.compiled and (name != "inputs" or problem.inputs):
            function = problem.compiled[name]
            assert isinstance(function, NativeFunction)
            programs[name] = ctypes.addressof(function.structure)
    return SystemStruct(
        **programs,
        parameters=_address(parameters),
        modes=_address(modes),
        nq=len(problem.q0),
        nu=len(problem.u0),
        ns=problem.rows,
        nw=problem.inputs,
        terminal=ctypes.addressof(terminal),
        ng=len(terminal),
    )


def _problem(problem: Problem, method: MethodStruct, system: SystemStruct) -> ProblemStruct:
    return ProblemStruct(
        method=ctypes.pointer(method),
        system=ctypes.pointer(system),
        step=problem.step or 0.0,
        project=problem.project,
        **{
            name: getattr(problem, name)
            for name in ("t0", "t_end", "rtol", "atol", "contradiction", "closure", "max_steps", "samples")
        },
    )


def _progress(problem: Problem, state: StateStruct, x: Floats) -> Progress:
    return Progress(state.sample, state.t, x.copy(), _statistics(problem, state), _failure(state))


def _statistics(problem: Problem, state: StateStruct) -> Statistics:
    same = ("rejected", "evaluations", "drift_position", "drift_velocity", "removed_position", "removed_velocity")
    rows = math.isfinite(state.least_rank)
    return Statistics(
        steps=state.steps,
        mean_step=(state.t - problem.t0) / state.steps if state.steps else 0.0,
        quaternion_deviation=state.quaternion_deviation,
        least_rank=int(state.least_rank) if rows else 0,
        greatest_rank=int(state.greatest_rank),
        conditioning=state.conditioning if rows else 1.0,
        conditioning_time=state.conditioning_time,
        **{name: getattr(state, name) for name in same},
    )


def _failure(state: StateStruct) -> RunFailure | None:
    status = Status(state.status)
    if status in (Status.RUNNING, Status.DONE, Status.STOPPED):
        return None
    return RunFailure(status, state.failure_time, state.component if state.component >= 0 else None)
