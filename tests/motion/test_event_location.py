"""Events: stops and kinks found at their times by both loops, with the order of the method across a kink."""

import ctypes
import math
from dataclasses import replace

import numpy as np
import pytest
from hand_models import BALL, BRAKED, PUSHED

import multibody_sym as mbs
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.native_loop import native_loop
from multibody_sym.motion.loop.problem import NO_MODE, Event, Problem
from multibody_sym.motion.loop.python_loop import python_loop
from multibody_sym.motion.methods.table import METHODS, MOREAU, LibraryMethod
from multibody_sym.program.runtime_constants import Status

LOOPS = pytest.mark.parametrize("loop", [native_loop, python_loop])
STEPS = pytest.mark.parametrize(("method", "step"), [("dormand_prince", None), ("rk4", 0.07), ("heun", 0.03)])
G = 9.81
JUMPS = """multibody_sym: 1
name: pushed
gravity: [0, 0, 0]
parameters: {a: 0.2, b: 0.3, c: 0.7}
bodies: {body: {mass: 1}}
joints: {rail: {type: prismatic, parent: ground, child: body, axis: x, q: x}}
inputs: {F: "where(t < a, 1, 3) + where(t <= b, 0, 2) + sign(t - c)"}
forces: {push: {type: force, on: body, value: [F, 0, 0]}}
simulation: {t_end: 1 s, samples: 2}
"""


def problem(model, q, u, parameters, terminal, t_end, method="dormand_prince", **options):
    q0, u0, given = (np.array(values, dtype=float) for values in ([q], [u], parameters))
    method = METHODS[method]
    return Problem(model.load(), method, 0.0, t_end, q0, u0, given, NO_MODE, terminal=terminal, **options)


def thrown(terminal, *, floor=0.0, q=0.0, u=10.0, when=99.0, **options):
    return problem(BALL, q, u, [G, floor, when], terminal, options.pop("t_end", 5.0), **options)


@LOOPS
@STEPS
def test_a_ball_that_starts_on_the_floor_flies_and_stops_there(loop, method, step):
    """The switching function is zero at the start: only the return counts. The motion is a parabola, hence exact."""
    run = integrate(thrown((True, False, False), method=method, step=step, samples=11), loop=loop)
    assert run.status is Status.STOPPED
    assert run.failure is None
    flight = 2 * 10.0 / G
    assert run.t_final == run.t[-1] == pytest.approx(flight, rel=4e-15)
    assert [e.index for e in run.events] == [1, 0]
    assert [e.terminal for e in run.events] == [False, True]
    assert run.events[0].time == pytest.approx(flight / 2, rel=1e-14)
    np.testing.assert_array_equal(run.t[:-1], np.arange(5) * 0.5)
    np.testing.assert_allclose(run.q[:, 0], 10 * run.t - G / 2 * run.t**2, atol=1e-12)
    np.testing.assert_array_equal(run.q[-1], run.q_final)


@LOOPS
def test_what_is_positive_from_the_start_is_no_stop_until_it_was_not(loop):
    run = integrate(thrown((True, False, False), floor=1.0, u=6.0, samples=3), loop=loop)
    assert run.status is Status.STOPPED
    assert run.t_final == pytest.approx((6 + math.sqrt(36 - 2 * G)) / G, rel=1e-14)


@LOOPS
def test_a_stop_is_only_crossed_upwards(loop):
    run = integrate(thrown((False, True, False), u=-1.0, q=5.0, t_end=0.3), loop=loop)
    assert run.status is Status.DONE
    assert run.events == ()


@LOOPS
def test_a_stop_at_a_sample_is_one_sample(loop):
    run = integrate(thrown((False, False, True), when=2.5, samples=11), loop=loop)
    assert run.status is Status.STOPPED
    np.testing.assert_allclose(run.t, np.arange(6) * 0.5, rtol=1e-15)
    assert run.events[-1] == Event(run.t[-1], 2, True)


@LOOPS
def test_of_two_events_at_once_the_stop_counts(loop):
    run = integrate(thrown((False, False, True), when=10.0 / G, u=10.0), loop=loop)
    assert run.status is Status.STOPPED
    assert run.t_final == pytest.approx(10.0 / G, rel=1e-14)


@LOOPS
def test_at_the_very_end_a_stop_leaves_all_samples(loop):
    run = integrate(thrown((False, False, True), when=5.0 - 1e-9, samples=6), loop=loop)
    assert run.status is Status.STOPPED
    assert len(run.t) == 6
    assert run.t_final == run.t[-1] == pytest.approx(5.0 - 1e-9, rel=1e-15)


def braked_motion(t, q0, friction):
    """The motion from rest at q0 > 0: half turns about +-friction; turning points at multiples of pi."""
    half = np.floor(t / math.pi)
    centre = friction * (-1) ** half
    amplitude = q0 - friction - 2 * friction * half
    return centre + amplitude * np.cos(t)


@LOOPS
@STEPS
def test_dry_friction_turns_at_multiples_of_half_a_period(loop, method, step):
    rtol = 1e-10
    case = problem(BRAKED, 10.0, 0.0, [0.3], (False,), 14.0, method, step=step, rtol=rtol, atol=rtol, samples=141)
    run = integrate(case, loop=loop)
    tolerance = {"dormand_prince": 1e-8, "rk4": 2e-4, "heun": 3e-2}[method]
    assert run.status is Status.DONE
    np.testing.assert_allclose([e.time for e in run.events], np.arange(1, 5) * math.pi, atol=tolerance)
    np.testing.assert_allclose(run.q[:, 0], braked_motion(run.t, 10.0, 0.3), atol=10 * tolerance)


@pytest.mark.parametrize("method", ["heun", "rk4", "bogacki_shampine", "dormand_prince"])
def test_no_order_is_lost_at_kinks(method):
    errors = []
    for steps in (70, 140):
        case = problem(BRAKED, 10.0, 0.0, [0.3], (False,), 14.0, method, step=14.0 / steps, samples=2)
        errors.append(abs(integrate(case).q_final[0] - braked_motion(14.0, 10.0, 0.3)))
    assert math.log2(errors[0] / errors[1]) > METHODS[method].order - 0.5


@LOOPS
@pytest.mark.parametrize("method", ["dormand_prince", "dormand_prince_8", "radau_5"])
def test_jumps_too_high_for_any_step_end_the_step_before_them(loop, method):
    """A force of 1e9 N begins at t = 5 s, or at x = 3 m, or acts for 1 ms: uniform motion and parabolas (by hand)."""
    late = 1e99

    def end(first, last, place):
        run = integrate(problem(PUSHED, 0.0, 1.0, [1e9, first, last, place], (False,) * 3, 6.0, method), loop=loop)
        assert run.status is Status.DONE
        return run.q_final[0], run.u_final[0]

    assert end(5.0, late, late) == pytest.approx((6 + 1e9 / 2, 1 + 1e9), rel=1e-12)
    assert end(late, late, 3.0) == pytest.approx((6 + 1e9 / 2 * 3**2, 1 + 3 * 1e9), rel=1e-12)
    assert end(2.5, 2.501, late) == pytest.approx((6 + 1e6 * (3.5 - 0.0005), 1 + 1e6), rel=1e-8)


@STEPS
@pytest.mark.parametrize("case", ["thrown", "braked", "pushed", "both"])
def test_both_loops_meet_the_same_events(method, step, case):
    cases = {
        "thrown": lambda: thrown((True, False, False), method=method, step=step, samples=11),
        "braked": lambda: problem(BRAKED, 10.0, 0.0, [0.3], (False,), 14.0, method, step=step, samples=21),
        "pushed": lambda: problem(PUSHED, 0.0, 1.0, [1e9, 2.5, 2.501, 1e99], (False,) * 3, 6.0, method, step=step),
        "both": lambda: thrown((False, False, True), when=10.0 / G, method=method, step=step, samples=11),
    }
    in_c, in_python = integrate(cases[case]()), integrate(cases[case](), loop=python_loop)
    assert in_c.statistics == in_python.statistics
    assert [e.index for e in in_c.events] == [e.index for e in in_python.events]
    assert in_c.status is in_python.status
    for name in ("t", "q", "u", "q_final", "u_final"):
        np.testing.assert_allclose(getattr(in_c, name), getattr(in_python, name), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("step", [None, 0.07])
def test_the_loop_in_c_resumes_around_events(step):
    """One step and one sample a call meet the events of one call, with the same bits."""
    cases = (
        thrown((True, False, False), step=step, method="dormand_prince", samples=11),
        problem(BRAKED, 10.0, 0.0, [0.3], (False,), 7.0, step=step, samples=21),
    )
    for case in cases:
        whole = integrate(case)
        library = case.compiled["state_derivative"].library
        functions = {key: replace(f, library=Piecemeal(library)) for key, f in case.compiled.functions.items()}
        pieces = integrate(replace(case, compiled=replace(case.compiled, functions=functions)))
        assert pieces.events == whole.events
        assert pieces.statistics == whole.statistics
        for name in ("t", "q", "u"):
            np.testing.assert_array_equal(getattr(pieces, name), getattr(whole, name))


class Piecemeal:
    """A library whose calls of the loop take one step and one sample at most."""

    def __init__(self, library):
        self.library = library
        self.mbs_start, self.mbs_work = library.mbs_start, library.mbs_work

    def mbs_integrate(self, problem, state, work, _, rows, samples):
        one, row = ctypes.c_longlong(1), ctypes.c_longlong(min(1, rows.value))
        return self.library.mbs_integrate(problem, state, work, one, row, samples)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_kink_just_behind_the_end_of_a_run_does_not_move_its_end(backend):
    """The torque of a motor grows with its speed up to a knot: slopes look beyond it, but the run ends before it."""
    text = """
multibody_sym: 1
name: motor
bodies: {rotor: {mass: 1, inertia: {Izz: 0.05}}}
joints: {A: {type: revolute, parent: ground, child: rotor, q: phi}}
inputs: {M: {table: [[0, 4], [50, 5], [90, 5.5], [110, 0]], of: u_phi}}
forces: {m: {type: torque, joint: A, value: M}}
"""
    system, first = mbs.loads(text), 2.5 * math.log(5 / 4)
    knot = first + 4.0 * math.log(5.5 / 5.0)
    for before in np.linspace(1.5e-9, 3e-9, 16):
        t = knot - before
        run = mbs.simulate(system, t_end=t, samples=2, rtol=1e-11, atol=1e-12, backend=backend)
        exact = 50.0 + 80.0 * (5.0 * math.exp((t - first) / 4.0) - 5.0)
        assert run["u_phi"][-1] == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_a_force_that_jumps_where_a_step_ends_acts_from_there_on(backend):
    """Constant forces: all methods are exact. 6 * 0.05 is later than 0.3 by rounding, 4 * 0.05 is not."""
    system, exact = mbs.loads(JUMPS), (0.2 + 3 * 0.8) + 2 * 0.7 + (0.3 - 0.7)
    for step in (0.05, 0.01):
        for method in METHODS:
            if method != MOREAU and not isinstance(METHODS[method], LibraryMethod):
                run = mbs.simulate(system, method=method, step=step, backend=backend)
                assert run["u_x"][-1] == pytest.approx(exact, rel=1e-13), method
