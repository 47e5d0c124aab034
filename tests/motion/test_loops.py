"""The integration loop in C and its twin in Python: same steps, right motion, constraints, failures, resuming."""

import ctypes
import math
import signal
import time
from dataclasses import replace

import numpy as np
import pytest
from hand_models import (
    BLOW_UP,
    DOUBLE_PENDULUM,
    DRIVEN,
    OSCILLATOR,
    PENDULUM,
    ROOT,
    ROTATION,
    HandModel,
    planar_pendulum,
)
from scipy.special import ellipj, ellipk

from multibody_sym.motion.integrator.flow import Pairing
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.native_loop import (
    ActingStruct,
    CourseStruct,
    EntriesStruct,
    LawsStruct,
    ModeStruct,
    PassageStruct,
    TurnStruct,
    native_loop,
)
from multibody_sym.motion.loop.problem import NO_MODE, Problem
from multibody_sym.motion.loop.python_loop import python_loop
from multibody_sym.motion.methods.multistep import IMPLICIT
from multibody_sym.motion.methods.table import AUTO, LIBRARY, METHODS, MOREAU
from multibody_sym.program.native import (
    CollocationStruct,
    MethodStruct,
    ProblemStruct,
    ProgramStruct,
    StateStruct,
    SystemStruct,
)
from multibody_sym.program.runtime_constants import Status
from multibody_sym.program.target_layout import runtime_files

DP, RK4 = METHODS["dormand_prince"], METHODS["rk4"]
LOOPS = pytest.mark.parametrize("loop", [native_loop, python_loop])


def problem(model, q0, u0, parameters, t_end, method=DP, **options):
    q0, u0, parameters = (np.array(values, dtype=float) for values in (q0, u0, parameters))
    return Problem(model.load(), method, 0.0, t_end, q0, u0, parameters, NO_MODE, **options)


def hanging(copies=1, t_end=10.0, offset=0.0, **options):
    """The pendulum in x, y, let go from the horizontal."""
    return problem(planar_pendulum(copies=copies, offset=offset), [1, 0], [0, 0], [9.81, 1, 0, 0], t_end, **options)


def top(**options):
    return problem(ROTATION, [1, 0, 0, 0], [0.1, 3, 0.1], [1, 2, 3], options.pop("t_end", 5.0), **options)


def double(**options):
    return problem(DOUBLE_PENDULUM, [1.5, 1.0], [0, 0], [9.81], 5.0, samples=51, **options)


def single(method, t_end=5.0, **options):
    return problem(PENDULUM, [1.5], [0], [9.81, 1], t_end, method, samples=33, **options)


BS = METHODS["bogacki_shampine"]
BALL = Pairing(4, (), ((0, 0),))
CASES = {
    "double pendulum": double,
    "tolerance 1e-4": lambda: double(rtol=1e-4, atol=1e-4),
    "order 3": lambda: single(BS, rtol=1e-6),
    "fixed": lambda: single(RK4, step=0.07),
    "fixed with an error estimate": lambda: single(DP, step=0.07),
    "Euler": lambda: single(METHODS["explicit_euler"], 1.0, step=0.01),
    "driven": lambda: problem(DRIVEN, [1], [0], [0.3], 5.0, samples=21),
    "drifting": lambda: hanging(t_end=3.0, samples=21),
    "projected": lambda: hanging(t_end=3.0, samples=21, project=True),
    "projected, fixed": lambda: hanging(t_end=3.0, samples=21, project=True, method=RK4, step=0.01),
    "equal rows": lambda: hanging(copies=2, t_end=2.0, samples=21, project=True),
    "quaternion": lambda: top(samples=21),
    "quaternion, order 3": lambda: top(samples=21, method=BS, rtol=1e-6),
    "order 8": lambda: single(METHODS["dormand_prince_8"], rtol=1e-10, atol=1e-10),
    "order 8, projected": lambda: hanging(t_end=3.0, samples=21, project=True, method=METHODS["dormand_prince_8"]),
    "Adams": lambda: single(METHODS["adams_bashforth_moulton"], step=0.03),
    "Adams, projected": lambda: hanging(
        t_end=3.0, samples=21, project=True, method=METHODS["adams_bashforth_moulton"], step=0.01
    ),
    "Stoermer": lambda: single(METHODS["stoermer_6"], step=0.03),
    "Stoermer, projected": lambda: hanging(
        t_end=3.0, samples=21, project=True, method=METHODS["stoermer_6"], step=0.01
    ),
    "Stoermer, quaternion": lambda: top(samples=21, method=METHODS["stoermer_6"], step=0.02, pairs=BALL),
    "Stoermer, far turns": lambda: top(samples=21, method=METHODS["stoermer_6"], step=0.2, pairs=BALL),
    "Verlet": lambda: single(METHODS["stoermer_verlet"], step=0.03),
    "Verlet, quaternion": lambda: top(samples=21, method=METHODS["stoermer_verlet"], step=0.02, pairs=BALL),
    "pole": lambda: problem(BLOW_UP, [1], [1], [], 2.0, samples=21, rtol=1e-6),
    "root": lambda: problem(ROOT, [0], [0], [], 2.0, samples=21),
    "root, fixed": lambda: problem(ROOT, [0], [0], [], 2.0, RK4, samples=21, step=0.15),
    "contradiction": lambda: hanging(copies=2, offset=1.0, samples=21),
    "step limit": lambda: top(samples=21, max_steps=7),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_loops_take_the_same_steps(case):
    in_c, in_python = integrate(case()), integrate(case(), loop=python_loop)
    assert in_c.statistics == in_python.statistics
    assert in_c.failure == in_python.failure
    assert in_c.t_final == in_python.t_final
    for name in ("t", "q", "u", "q_final", "u_final"):
        np.testing.assert_allclose(getattr(in_c, name), getattr(in_python, name), rtol=1e-13, atol=1e-13)


@LOOPS
def test_the_oscillator_follows_the_cosine(loop):
    run = integrate(problem(OSCILLATOR, [1], [0], [2], 10.0, rtol=1e-10, atol=1e-10, samples=101), loop=loop)
    assert run.status is Status.DONE
    assert run.t_final == run.t[-1] == 10.0
    np.testing.assert_allclose(run.q[:, 0], np.cos(2 * run.t), atol=1e-8)
    np.testing.assert_allclose(run.u[:, 0], -2 * np.sin(2 * run.t), atol=2e-8)


def elliptic_angle(t, amplitude, frequency):
    k = math.sin(amplitude / 2)
    return 2 * np.arcsin(k * ellipj(ellipk(k * k) - frequency * np.asarray(t), k * k)[0])


def test_the_pendulum_follows_elliptic_functions():
    for amplitude in (0.1, 1.5, 3.0):
        run = integrate(problem(PENDULUM, [amplitude], [0], [9.81, 0.5], 20.0, rtol=1e-12, atol=1e-12))
        wanted = elliptic_angle(run.t, amplitude, math.sqrt(9.81 / 0.5))
        assert np.abs(run.q[:, 0] - wanted).max() < 2e-8


@pytest.mark.parametrize("name", sorted({*METHODS} - {*IMPLICIT, *LIBRARY, AUTO, MOREAU}))
@pytest.mark.parametrize("samples", [11, 98])
def test_the_loop_in_c_has_the_order_of_its_method(name, samples):
    method, errors = METHODS[name], []
    finest = {"explicit_euler": 6000, "dormand_prince": 400, "midpoint": 1600, "heun": 1600,
              "adams_bashforth_moulton": 1600, "stoermer_6": 400}.get(name, 800)  # fmt: skip
    coarse, fine, t_end = (20, 50, 8.0) if method.order == 8 else (finest // 2, finest, 5.0)
    for steps in (coarse, fine):
        run = integrate(problem(PENDULUM, [2], [0], [1, 1], t_end, method, step=t_end / steps, samples=samples))
        assert run.statistics.steps == steps
        errors.append(np.abs(run.q[:, 0] - elliptic_angle(run.t, 2.0, 1.0)).max())
    slope = math.log(errors[0] / errors[1]) / math.log(fine / coarse)
    assert slope > 7.8 if method.order == 8 else slope == pytest.approx(method.order, abs=0.05)


def test_declared_inputs_run_before():
    run = integrate(problem(DRIVEN, [0], [0], [0.3], 10.0, rtol=1e-10, atol=1e-10))
    np.testing.assert_allclose(run.q[:, 0], 0.1 * (np.cos(run.t) - np.cos(2 * run.t)), atol=1e-8)


# --- constraints ---------------------------------------------------------------------------------------------------


def test_projection_keeps_the_constraint_for_a_thousand_seconds():
    run = integrate(hanging(t_end=1000.0, project=True))
    assert run.failure is None
    assert run.statistics.drift_position <= 1e-13
    assert run.statistics.drift_velocity <= 1e-13
    assert 1e-12 < run.statistics.removed_position < 1e-6
    assert np.abs(np.hypot(*run.q.T) - 1).max() <= 1e-13
    assert np.abs((run.q * run.u).sum(axis=1)).max() <= 1e-12
    energy = (run.u**2).sum(axis=1) / 2 + 9.81 * run.q[:, 1]
    assert np.abs(energy).max() < 1e-3


def test_projected_motion_is_that_of_the_angle():
    run = integrate(hanging(project=True, rtol=1e-11, atol=1e-11))
    angle = np.arctan2(run.q[:, 0], -run.q[:, 1])
    np.testing.assert_allclose(angle, elliptic_angle(run.t, math.pi / 2, math.sqrt(9.81)), atol=1e-8)


def test_baumgarte_holds_drift_where_nothing_else_does():
    options = {"method": RK4, "step": 0.01, "samples": 501}
    free = integrate(hanging(t_end=50.0, **options))
    model = planar_pendulum(stabilised=True)
    held = integrate(problem(model, [1, 0], [0, 0], [9.81, 1, 5, 5], 50.0, **options))
    assert 0 < held.statistics.drift_position < 1e-5
    assert free.statistics.drift_position > 30 * held.statistics.drift_position
    assert np.abs(np.hypot(*held.q.T) - 1).max() == pytest.approx(held.statistics.drift_position)


@LOOPS
def test_equal_rows_change_nothing_but_the_rank(loop):
    one, two = (integrate(hanging(copies=copies, project=True, samples=51), loop=loop) for copies in (1, 2))
    np.testing.assert_allclose(one.q, two.q, atol=1e-9)
    assert (two.statistics.least_rank, two.statistics.greatest_rank) == (1, 1)
    assert one.statistics.conditioning == 1.0


@LOOPS
def test_contradicting_rows_end_the_run(loop):
    model = planar_pendulum(copies=2, offset=1.0)
    run = integrate(problem(model, [1, 0], [0, 0], [9.81, 1, 0, 0], 10.0), loop=loop)
    assert run.status is Status.CONTRADICTION
    assert run.failure.component == 1
    assert run.t_final < run.failure.time
    assert 0.04 < run.failure.time < 0.2  # |phidot| of the second row is t^2/2


@LOOPS
def test_round_off_between_unloaded_rows_is_no_contradiction(loop):
    """At rest without gravity both rows need no acceleration but for 1e-12, of which they have different opinions."""
    model = planar_pendulum(copies=2, offset=1e-12)
    run = integrate(problem(model, [1, 0], [0, 0], [0, 1, 0, 0], 10.0), loop=loop)
    assert run.status is Status.DONE


NEVER_CLOSED = HandModel(
    1,
    1,
    0,
    "out[0][0] = u[0]; out[1][0] = 0.0; out[2][0] = out[2][1] = 0.0; out[3][0] = out[3][1] = out[3][2] = 0.0;",
    ns=2,
    others=(("project_position", "out[0][0] = 0.0; out[0][1] = q[0] > 1.0 ? q[0] - 1.0 : 0.0; out[1][0] = 1e-3;"),),
)


@LOOPS
@pytest.mark.parametrize("step", [None, 0.3])
def test_a_loop_that_cannot_be_closed_names_its_row(loop, step):
    run = integrate(problem(NEVER_CLOSED, [0], [1], [], 10.0, step=step, project=True), loop=loop)
    assert run.status is Status.NOT_CLOSED
    assert run.failure.component == 1
    assert run.failure.time == pytest.approx(1.2 if step else 1.0, abs=1e-6)


@LOOPS
def test_quaternions_stay_of_unit_length(loop):
    run = integrate(top(t_end=20.0), loop=loop)
    np.testing.assert_allclose(np.linalg.norm(run.q, axis=1), 1.0, rtol=1e-15)
    assert 1e-14 < run.statistics.quaternion_deviation < 1e-7
    momentum = run.u * [1, 2, 3]
    np.testing.assert_allclose(np.linalg.norm(momentum, axis=1), np.linalg.norm(momentum[0]), rtol=1e-6)


# --- failures and limits -------------------------------------------------------------------------------------------


@LOOPS
def test_what_is_not_finite_is_found_in_its_step(loop):
    run = integrate(problem(ROOT, [0], [0], [], 2.0, RK4, step=0.15, samples=21), loop=loop)
    assert (run.status, run.failure.component) == (Status.NOT_FINITE, 1)
    assert 1.0 < run.failure.time <= 1.05 + 1e-12
    assert run.t_final == pytest.approx(0.9)
    assert len(run.t) == len(run.q) == len(run.u) == 10
    assert np.isfinite(run.q).all()


@LOOPS
def test_a_pole_ends_the_run_at_its_time(loop):
    run = integrate(problem(BLOW_UP, [1], [1], [], 2.0, rtol=1e-6), loop=loop)
    assert run.status in (Status.STEP_UNDERFLOW, Status.NOT_FINITE)
    assert run.failure.time == pytest.approx(1.0, abs=1e-5)
    assert run.failure.component in (0, 1)
    assert run.statistics.rejected > 0


@LOOPS
def test_a_start_that_is_not_finite_is_reported_at_once(loop):
    run = integrate(problem(ROOT, [2], [0], [], 2.0), loop=loop)
    assert (run.status, run.failure.time, run.failure.component) == (Status.NOT_FINITE, 0.0, 1)
    assert (len(run.t), run.t_final, run.statistics.steps) == (1, 0.0, 0)


@LOOPS
def test_the_step_limit_keeps_what_was_computed(loop):
    run = integrate(top(max_steps=10), loop=loop)
    assert run.status is Status.STEP_LIMIT
    assert run.statistics.steps == 10
    assert 0 < len(run.t) < 1001
    assert run.t[-1] <= run.t_final < 5.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"t_end": 0.0}, "t_end is later"),
        ({"step": 0.0}, "step is positive"),
        ({"step": -0.1}, "step is positive"),
        ({"method": RK4}, "rk4 has a step, no tolerances"),
        ({"atol": 0.0}, "atol is positive"),
        ({"samples": 1}, "two samples"),
        ({"max_steps": 0}, "max_steps"),
        ({"q0": np.zeros(3)}, r"q has the shape \(3,\), not \(4,\)"),
    ],
)
def test_a_problem_that_makes_no_sense_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        replace(top(), **options)


# --- resuming ------------------------------------------------------------------------------------------------------


@LOOPS
def test_ctrl_c_keeps_what_was_computed(loop, monkeypatch):
    for module in ("native_loop", "python_loop"):
        monkeypatch.setattr(f"multibody_sym.motion.loop.{module}.SECONDS", 1e-9)
    monkeypatch.setattr("multibody_sym.motion.loop.native_loop._SMALL", 0)
    seen = []

    def on_chunk(chunk):
        seen.append(chunk)
        if chunk.time > 2.0:
            raise KeyboardInterrupt

    whole = integrate(double(), loop=loop)
    run = integrate(double(), on_chunk=on_chunk, loop=loop)
    assert run.status is Status.INTERRUPTED
    assert 2.0 < run.t_final == run.failure.time < 5.0
    assert 0 < len(run.t) < len(whole.t)
    np.testing.assert_array_equal(run.q, whole.q[: len(run.q)])
    assert sum(len(chunk.t) for chunk in seen) == len(run.t)


@LOOPS
def test_a_signal_ends_a_long_run_soon(loop):
    def interrupt(*_):
        raise KeyboardInterrupt

    case = replace(double(), t_end=1e6, samples=3, max_steps=10**12)
    before = signal.signal(signal.SIGALRM, interrupt)
    begin = time.monotonic()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.4)
        run = integrate(case, loop=loop)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert run.status is Status.INTERRUPTED
    assert time.monotonic() - begin < 5.0
    assert run.t_final > 0.0
    assert run.statistics.steps > 0


def test_chunks_are_the_samples_in_order():
    chunks = []
    case = hanging(t_end=200.0, samples=3001)
    run = integrate(case, on_chunk=chunks.append)
    assert [chunk.first for chunk in chunks] == [0, *np.cumsum([len(chunk.t) for chunk in chunks])[:-1]]
    np.testing.assert_array_equal(np.concatenate([chunk.t for chunk in chunks]), run.t)
    np.testing.assert_array_equal(np.concatenate([chunk.q for chunk in chunks]), run.q)
    assert len(chunks) > 1


@pytest.mark.parametrize("name", ["double pendulum", "projected", "quaternion, order 3", "fixed", "pole"])
def test_the_loop_in_c_resumes_anywhere(name, monkeypatch):
    """One step and one sample a call give the bits of one call."""
    case = CASES[name]()
    whole = integrate(case)
    library = case.compiled["state_derivative"].library
    call = library.mbs_integrate

    class Library:
        mbs_start, mbs_work = library.mbs_start, library.mbs_work

        @staticmethod
        def mbs_integrate(problem, state, work, _, rows, samples):
            return call(problem, state, work, ctypes.c_longlong(1), ctypes.c_longlong(min(1, rows.value)), samples)

    functions = {key: replace(function, library=Library) for key, function in case.compiled.functions.items()}
    pieces = integrate(replace(case, compiled=replace(case.compiled, functions=functions)))
    assert pieces.statistics == whole.statistics
    assert pieces.failure == whole.failure
    np.testing.assert_array_equal(pieces.q, whole.q)
    np.testing.assert_array_equal(pieces.u, whole.u)


def test_the_structures_of_python_and_c_have_the_same_layout():
    lines = ['#include "turns.h"', "#include <stddef.h>", "const int layout[] = {"]
    wanted = []
    for structure, name in (
        (ProgramStruct, "mbs_program"),
        (CollocationStruct, "mbs_collocation"),
        (MethodStruct, "mbs_method"),
        (SystemStruct, "mbs_system"),
        (ProblemStruct, "mbs_problem"),
        (StateStruct, "mbs_state"),
        (ActingStruct, "mbs_acting"),
        (TurnStruct, "mbs_turn"),
        (ModeStruct, "mbs_mode"),
        (EntriesStruct, "mbs_entries"),
        (LawsStruct, "mbs_laws"),
        (PassageStruct, "mbs_passage"),
        (CourseStruct, "mbs_course"),
    ):
        lines.append(f"sizeof({name}),")
        wanted.append(ctypes.sizeof(structure))
        for field, _ in structure._fields_:
            lines.append(f"offsetof({name}, {field}),")
            wanted.append(getattr(structure, field).offset)
    found = _with_source("\n".join([*lines, "};"]))
    assert list((ctypes.c_int * len(wanted)).in_dll(found, "layout")) == wanted


def _with_source(text):
    from multibody_sym.program.loading import build_library, find_compiler

    return ctypes.CDLL(str(build_library(find_compiler(), {"model.c": text, **runtime_files()})))
