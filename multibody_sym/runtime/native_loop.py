"""The integration loop of runtime.c, driven from Python in pieces of about a tenth of a second."""

from __future__ import annotations

import ctypes
import math
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.integrators.flow import Status
from multibody_sym.integrators.loop import steps_before
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.native import MethodStruct, NativeFunction, ProblemStruct, StateStruct, SystemStruct
from multibody_sym.runtime.native_method import address, method_struct
from multibody_sym.runtime.problem import Begun, Event, Problem, Progress, RunFailure, Statistics, chatters

Integers = NDArray[np.intc]

_FIRST_PIECE: Final = 200  # steps
_LARGEST_PIECE: Final = 10_000_000
_SECONDS: Final = 0.1
_STARTING: Final = 0  # the phase of a run in runtime.c
_PROGRAMS: Final = (
    "inputs",
    "state_derivative",
    "jacobian",
    "index_2",
    "index_2_by_state",
    "index_2_by_multipliers",
    "project_position",
    "project_velocity",
    "normalize",
    "events",
)


def native_loop(problem: Problem, samples: Floats) -> Iterator[Progress]:
    """Integrate in C; see `Loop`. What was written before an interruption stays in `samples`."""
    given = _given(problem)
    margins = given[2]
    method, whole = method_struct(problem.method), _whole_numbers(problem)
    system = _system(problem, given, whole)
    structure = _problem(problem, method, system)
    x0 = problem.x0
    state, steps, done = StateStruct(), _FIRST_PIECE, False
    events: list[Event] = []
    singular: list[float] = []
    derivative = problem.compiled["state_derivative"]
    assert isinstance(derivative, NativeFunction)
    library, handles = derivative.library, [ctypes.byref(s) for s in (structure, state)]
    work = np.zeros(library.mbs_work(handles[0]))
    library.mbs_start(handles[0], address(x0), handles[1], address(work))
    if problem.begun is not None:
        _go_on(problem, problem.begun, state)
    while not done:
        begin, before = time.perf_counter(), state.steps
        left = steps
        while left > 0 and not done:
            room = ctypes.c_longlong(problem.samples - state.sample)
            piece = ctypes.c_longlong(left)
            library.mbs_integrate(*handles, address(work), piece, room, address(samples[state.sample :]))
            done = state.status != Status.RUNNING
            left = before + steps - state.steps
            if state.event >= problem.switches and _jumped(problem, state, work, margins):
                done = False
            elif state.event >= 0:
                events.append(Event(state.t, state.event, problem.terminal[state.event]))
                if chatters(problem, events):
                    state.status, state.failure_time, state.component = Status.CHATTERS, state.t, -1
                    done = True
            singular += state.singular[: state.passed]
        seconds = max(time.perf_counter() - begin, 1e-6)
        steps = max(1, min(10 * steps, int(steps * _SECONDS / seconds), _LARGEST_PIECE))
        yield replace(_progress(problem, state, work[: len(x0)]), events=tuple(events), singular=tuple(singular))


def _go_on(problem: Problem, begun: Begun, state: StateStruct) -> None:
    state.t = state.t_new = state.pace_time = begun.time
    state.sample = begun.written
    if problem.step is not None:
        state.grid = steps_before(problem.t0, begun.time, problem.step)


def _jumped(problem: Problem, state: StateStruct, work: Floats, margins: Floats) -> bool:
    """Let a run that stands at a switch go on with the state after a jump, if there is one."""
    index, size = state.event - problem.switches, len(problem.x0)
    after = (
        None
        if problem.jump is None or not state.t < problem.t_end
        else problem.jump(state.t, work[:size].copy(), index)
    )
    if after is None:
        return False
    work[:size] = after
    margins[index] = min(margins[index], 0.0)
    state.status, state.phase, state.crossing, state.origin = Status.RUNNING, _STARTING, -1, -1
    return True


def _whole_numbers(problem: Problem) -> dict[str, Integers]:
    pairs = problem.pairing
    lists: dict[str, Sequence[Any]] = {"terminal": problem.terminal, "plain": pairs.plain, "ball": pairs.balls}
    return {name: np.array(values, dtype=np.intc).ravel() for name, values in lists.items()}


def _given(problem: Problem) -> tuple[Floats, ...]:
    """Return parameters, modes, margins and moments, which must live as long as the system for C."""
    given = (problem.parameters, problem.modes, problem.margins, problem.moments)
    return tuple(np.array(values, dtype=float) for values in given)


def _system(problem: Problem, given: tuple[Floats, ...], whole: dict[str, Integers]) -> SystemStruct:
    """Return the system for C; it points into the arrays, which must live as long."""
    parameters, modes, margins, moments = given
    programs = {}
    for name in _PROGRAMS:
        if name in problem.compiled and (name != "inputs" or problem.inputs):
            function = problem.compiled[name]
            assert isinstance(function, NativeFunction)
            programs[name] = ctypes.addressof(function.structure)
    return SystemStruct(
        **programs,
        parameters=address(parameters),
        modes=address(modes),
        nq=len(problem.q0),
        nu=len(problem.u0),
        ns=problem.rows,
        nw=problem.inputs,
        ng=len(problem.terminal),
        plains=len(problem.pairing.plain),
        balls=len(problem.pairing.balls),
        margins=address(margins),
        switches=len(margins),
        limiting=problem.limiting,
        moments=address(moments),
        moment_count=len(moments),
        **{name: address(values) for name, values in whole.items()},
    )


def _problem(problem: Problem, method: MethodStruct, system: SystemStruct) -> ProblemStruct:
    return ProblemStruct(
        method=ctypes.pointer(method),
        system=ctypes.pointer(system),
        step=problem.step or 0.0,
        project=problem.project,
        **{
            name: getattr(problem, name)
            for name in (
                *("t0", "t_end", "rtol", "atol"),
                *("contradiction", "closure", "independent", "max_steps", "samples"),
            )
        },
    )


def _progress(problem: Problem, state: StateStruct, x: Floats) -> Progress:
    return Progress(state.sample, state.t, x.copy(), _statistics(problem, state), _failure(state))


def _statistics(problem: Problem, state: StateStruct) -> Statistics:
    same = (
        *("rejected", "evaluations", "jacobians", "factorisations"),
        *("drift_position", "drift_velocity", "removed_position", "removed_velocity"),
    )
    rows = math.isfinite(state.least_rank)
    return Statistics(
        steps=state.steps,
        mean_step=(state.t - problem.start) / state.steps if state.steps else 0.0,
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
