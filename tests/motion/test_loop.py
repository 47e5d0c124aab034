"""The stepping loop in Python: measured orders, exact ends, step control, and failures that say where."""

import math

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from multibody_sym.motion.integrator.flow import Events, Flow, StepError
from multibody_sym.motion.integrator.loop import sample_times, solution, step_count, steps
from multibody_sym.motion.methods import table
from multibody_sym.motion.methods.multistep import IMPLICIT
from multibody_sym.motion.methods.table import LIBRARY
from multibody_sym.program.runtime_constants import Status
from multibody_sym.scalars.tabulated import Tabulated, TabulatedRows

OTHERS = {*IMPLICIT, *LIBRARY, table.AUTO, table.MOREAU}
METHODS = {name: method for name, method in table.METHODS.items() if name not in OTHERS}
AMPLITUDE = 2.0
FINEST = {"explicit_euler": 6000, "midpoint": 1600, "heun": 1600, "rk4": 800, "bogacki_shampine": 800,
          "adams_bashforth_moulton": 1600}  # fmt: skip


def pendulum(t, x):
    return np.array([x[1], -math.sin(x[0])])


def pendulum_angle(t):
    """The angle of theta'' = -sin(theta) let go at AMPLITUDE, by elliptic functions."""
    k = math.sin(AMPLITUDE / 2)
    sn = ellipj(ellipk(k * k) - np.asarray(t), k * k)[0]
    return 2 * np.arcsin(k * sn)


def error(method, steps, samples, t_end=5.0):
    t, x = solution(METHODS[method], pendulum, 0.0, t_end, [AMPLITUDE, 0.0], step=t_end / steps, samples=samples)
    return np.abs(x[:, 0] - pendulum_angle(t)).max()


@pytest.mark.parametrize("method", [name for name, method in METHODS.items() if method.order <= 6])
@pytest.mark.parametrize("samples", [11, 98], ids=["at steps", "between steps"])
def test_the_measured_order_is_the_nominal_one(method, samples):
    finest = FINEST.get(method, 400)
    slope = math.log2(error(method, finest // 2, samples) / error(method, finest, samples))
    assert slope == pytest.approx(METHODS[method].order, abs=0.05)


@pytest.mark.parametrize("samples", [5, 98], ids=["at steps", "between steps"])
def test_the_measured_order_of_order_eight_between_errors_of_1e_6_and_1e_12_is_at_least_7_8(samples):
    coarse, fine = (error("dormand_prince_8", count, samples, 8.0) for count in (14, 56))
    assert coarse < 1e-6
    assert fine > 1e-12
    assert math.log(coarse / fine) / math.log(56 / 14) > 7.8


def pumped(t, x):
    """q = exp(sin t) as a motion: q'' = q' cos t - q sin t."""
    return np.array([x[1], x[1] * math.cos(t) - x[0] * math.sin(t)])


def test_functions_beside_the_one_that_crosses_cost_no_further_looks():
    """A crossing is looked for in all functions at once, however many there are."""

    def looks(others):
        seen = []

        def values(t, x):
            seen.append(t)
            return np.array([x[0] - 0.5, *[-1.0] * others])

        events = Events(values, (True,) * (1 + others))
        flow = Flow(METHODS["dormand_prince"], pendulum, 0.0, 5.0, np.array([0.0, 1.0]), events=events)
        assert list(steps(flow))[-1].event == 0
        return len(seen)

    assert looks(60) == looks(1)


@pytest.mark.parametrize("place", [0.5, 0.3217, 1 / 3, 0.123456789, 2.7])
def test_a_crossing_on_a_straight_way_takes_few_looks_to_round_off(place):
    """The first guess is the crossing but for round-off: halving what is left on its other side would take fifty."""
    seen = []

    def values(t, x):
        seen.append(t)
        return np.array([x[0] - place])

    def moves(t, x):
        return np.array([x[1], 0.0])

    events = Events(values, (True,))
    flow = Flow(METHODS["dormand_prince"], moves, 0.0, 5.0, np.array([0.0, 1.0]), events=events)
    assert list(steps(flow))[-1].t_new == pytest.approx(place, rel=4e-16)
    assert len(seen) < 45


@pytest.mark.parametrize("method", METHODS)
def test_explicit_time_is_seen_by_every_stage(method):
    nominal = METHODS[method].order
    errors = []
    for count in (8, 16) if nominal == 8 else (100, 200):
        t, x = solution(METHODS[method], pumped, 0.0, 2.0, [1.0, 1.0], step=2.0 / count, samples=2)
        errors.append(abs(x[-1, 0] - math.exp(math.sin(t[-1]))))
    assert math.log2(errors[0] / errors[1]) > nominal - 0.2


@pytest.mark.parametrize(("step", "count"), [(0.1, 10), (0.3, 4), (1.0, 1), (7.0, 1), (1 / 3, 3), (0.7, 2)])
def test_fixed_steps_end_exactly_at_t_end(step, count):
    flow = Flow(METHODS["rk4"], pendulum, 0.0, 1.0, np.array([1.0, 0.0]), step=step)
    taken = list(steps(flow))
    assert len(taken) == step_count(0.0, 1.0, step) == count
    assert taken[-1].t_new == 1.0
    assert all(done.h == step for done in taken[:-1])
    assert math.fsum(done.h for done in taken) == pytest.approx(1.0, abs=1e-15)


def test_samples_are_evenly_spaced_with_both_ends_exact():
    times = sample_times(0.1, 0.7, 7)
    assert times[0] == 0.1
    assert times[-1] == 0.7
    np.testing.assert_allclose(np.diff(times), 0.1, rtol=1e-14)


@pytest.mark.parametrize("method", ["bogacki_shampine", "dormand_prince", "dormand_prince_8"])
def test_the_error_follows_the_tolerance(method):
    errors = []
    for tolerance in (1e-5, 1e-7, 1e-9):
        t, x = solution(METHODS[method], pendulum, 0.0, 10.0, [AMPLITUDE, 0.0], rtol=tolerance, atol=tolerance)
        errors.append(np.abs(x[:, 0] - pendulum_angle(t)).max())
        assert errors[-1] < 100 * tolerance
    assert errors[0] > 10 * errors[1] > 100 * errors[2]


@pytest.mark.parametrize(("method", "same"), [("dormand_prince", "RK45"), ("dormand_prince_8", "DOP853")])
def test_scipy_needs_as_many_evaluations(method, same):
    """Another implementation of the same method needs about as many evaluations for the same tolerance."""
    from scipy.integrate import solve_ivp

    calls = []
    start = np.array([AMPLITUDE, 0.0])
    flow = Flow(METHODS[method], lambda t, x: calls.append(t) or pendulum(t, x), 0.0, 50.0, start)
    last = list(steps(flow))[-1]
    other = solve_ivp(pendulum, (0, 50), [AMPLITUDE, 0], method=same, rtol=1e-8, atol=1e-8)
    assert last.t_new == 50.0
    assert abs(last.x_new[0] - pendulum_angle(50.0)) < 2e-6
    assert 0.7 < len(calls) / other.nfev < 1.3


def test_a_changed_end_gets_a_slope_of_its_own():
    slopes = []

    def derivative(t, x):
        slopes.append(x.copy())
        return -x

    for name, kept in (("dormand_prince", 1 + 6 * 4), ("rk4", 1 + 4 * 4)):
        for settle, more in ((None, 0), (lambda _, x: x, 0), (lambda _, x: x * 1.01, 4 if name != "rk4" else 0)):
            slopes.clear()
            taken = list(steps(Flow(METHODS[name], derivative, 0.0, 1.0, np.ones(1), settle, step=0.25)))
            assert len(slopes) == kept + more
            assert taken[-1].slope_new == -taken[-1].x_new
            assert slopes[-1] == taken[-1].x_new


def test_a_pole_is_met_with_the_time_and_the_component():
    method, pole = METHODS["dormand_prince"], lambda _, x: np.array([1.0, x[1] ** 2])
    flow = Flow(method, pole, 0.0, 2.0, np.ones(2), rtol=1e-6, atol=1e-6)
    with pytest.raises(StepError) as met:
        list(steps(flow))
    assert met.value.status in (Status.STEP_UNDERFLOW, Status.NOT_FINITE)
    assert met.value.time == pytest.approx(1.0, abs=1e-4)
    assert met.value.component == 1


@pytest.mark.parametrize("method", METHODS)
def test_what_is_not_finite_is_met_in_its_step(method):
    flow = Flow(METHODS[method], lambda t, _: np.array([0.0, np.sqrt(0.5 - t)]), 0.0, 1.0, np.zeros(2), step=0.2)
    with np.errstate(invalid="ignore"), pytest.raises(StepError) as met:
        list(steps(flow))
    assert (met.value.status, met.value.component) == (Status.NOT_FINITE, 1)
    assert 0.5 < met.value.time <= 0.6 + 1e-12


def test_a_trial_that_cannot_be_evaluated_is_shortened_first():
    """The root exists up to t = 1, and the motion ends there: the step must not fail because a stage looks beyond."""
    method, root = METHODS["dormand_prince"], lambda t, x: np.sqrt(1.0 - t) + 0 * x
    flow = Flow(method, root, 0.0, 1.0, np.zeros(1), rtol=1e-10, atol=1e-10)
    with np.errstate(invalid="ignore"):
        taken = list(steps(flow))
    assert taken[-1].t_new == 1.0
    assert taken[-1].x_new[0] == pytest.approx(2 / 3, abs=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_no_kink_is_passed_over_behind_one_at_the_very_start_of_a_step(seed):
    """One function tells 200 kinks of lines through random rows, whose integral the trapezoidal rule gives exactly."""
    t, y = np.linspace(1e4, 1e4 + 1, 201), np.cumsum(np.random.default_rng(seed).normal(size=201))
    lines = Tabulated("f", TabulatedRows(t, y, {}), "linear")
    events = Events(lambda time, x: np.array([lines.bends.value(0, time)]), (False,))
    flow = Flow(
        METHODS["dormand_prince"], lambda time, x: np.array([lines.value(0, time)]), t[0], t[-1], np.zeros(1),
        rtol=1e-4, atol=1e-4, events=events,
    )
    *_, last = steps(flow)
    assert last.x_new[0] == pytest.approx(np.trapezoid(y, t), abs=1e-8)
