"""Implicit methods in both loops: orders, invariants, stiff problems, events, and what happens without a solution."""

import math

import numpy as np
import pytest
from hand_models import BLOW_UP, BRAKED, PENDULUM, HandModel
from test_loops import elliptic_angle, problem

from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.native_loop import native_loop
from multibody_sym.motion.loop.python_loop import python_loop
from multibody_sym.motion.methods.multistep import IMPLICIT
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.program.runtime_constants import Status

LOOPS = pytest.mark.parametrize("loop", [native_loop, python_loop])
ADAPTIVE = ["implicit_euler", "radau_3", "radau_5"]
FINEST = {1: 3000, 2: 800, 3: 800, 4: 400, 5: 160, 6: 80}


def with_jacobian(model, body):
    return HandModel(
        model.nq, model.nu, model.np, model.state_derivative, ng=model.ng, others=(*model.others, ("jacobian", body))
    )


# a light body on a stiff damped spring that hangs on a slow pendulum: p = stiffness, damping, mass
STIFF = HandModel(
    2,
    2,
    3,
    "out[0][0] = u[0]; out[0][1] = u[1]; out[1][0] = -sin(q[0]);"
    "out[1][1] = (-p[0]*(q[1] - sin(q[0])) - p[1]*(u[1] - cos(q[0])*u[0]))/p[2];",
    others=(
        (
            "jacobian",
            "for (int i = 0; i < 16; ++i) out[0][i] = 0.0; out[0][2] = out[0][7] = 1.0; out[0][8] = -cos(q[0]);"
            "out[0][12] = (p[0]*cos(q[0]) - p[1]*sin(q[0])*u[0])/p[2]; out[0][13] = -p[0]/p[2];"
            "out[0][14] = p[1]*cos(q[0])/p[2]; out[0][15] = -p[1]/p[2];",
        ),
    ),
)

# Euler's equations of a free body
FREE = HandModel(
    1,
    3,
    3,
    "out[0][0] = 0.0;"
    "out[1][0] = (p[1] - p[2])/p[0]*u[1]*u[2];"
    "out[1][1] = (p[2] - p[0])/p[1]*u[2]*u[0];"
    "out[1][2] = (p[0] - p[1])/p[2]*u[0]*u[1];",
    others=(
        (
            "jacobian",
            "double a = (p[1] - p[2])/p[0], b = (p[2] - p[0])/p[1], c = (p[0] - p[1])/p[2];"
            "for (int i = 0; i < 16; ++i) out[0][i] = 0.0;"
            "out[0][6] = a*u[2]; out[0][7] = a*u[1]; out[0][9] = b*u[2]; out[0][11] = b*u[0];"
            "out[0][13] = c*u[1]; out[0][14] = c*u[0];",
        ),
    ),
)


def swing(name, **options):
    return problem(PENDULUM, [2], [0], [1, 1], 5.0, METHODS[name], samples=options.pop("samples", 33), **options)


def stiff(name, **options):
    return problem(STIFF, [1, math.sin(1)], [0, 0], [1e8, 1e3, 0.01], 2.0, METHODS[name], samples=11, **options)


@pytest.mark.parametrize("name", IMPLICIT)
@pytest.mark.parametrize("samples", [11, 98])
def test_the_measured_order_is_the_nominal_one(name, samples):
    """Between the steps the order is that of the continuous extension, plus one where it does not add up."""
    method, errors = METHODS[name], []
    finest = FINEST[method.order]
    for steps in (finest // 2, finest):
        run = integrate(swing(name, step=5.0 / steps, samples=samples))
        errors.append(np.abs(run.q[:, 0] - elliptic_angle(run.t, 2.0, 1.0)).max())
    slope = math.log2(errors[0] / errors[1])
    if samples == 11:
        assert slope == pytest.approx(method.order, abs=0.05)
    else:
        assert slope > min(method.order, method.dense_order + 1) - 0.25


CASES = {
    **{name: lambda name=name: swing(name, step=0.13) for name in IMPLICIT},
    **{f"{name}, adaptive": lambda name=name: swing(name, rtol=1e-5, atol=1e-5) for name in ADAPTIVE},
    "stiff": lambda: stiff("radau_5", rtol=1e-6),
    "stiff, order 3": lambda: stiff("radau_3", rtol=1e-4),
    "no solution": lambda: problem(BURST, [1], [1], [], 4.0, METHODS["gauss_4"], step=2.0),
}
BURST = with_jacobian(BLOW_UP, "out[0][0] = 0.0; out[0][1] = 1.0; out[0][2] = 2.0*u[0]; out[0][3] = 2.0*q[0];")


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_both_loops_take_the_same_steps(case):
    in_c, in_python = integrate(case()), integrate(case(), loop=python_loop)
    assert in_c.statistics == in_python.statistics
    assert in_c.failure == in_python.failure
    for name in ("t", "q", "u", "q_final", "u_final"):
        np.testing.assert_allclose(getattr(in_c, name), getattr(in_python, name), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("name", ["gauss_4", "gauss_6", "implicit_midpoint"])
def test_gauss_methods_keep_quadratic_invariants(name):
    """Twice the energy and the square of the angular momentum of a free body, over 2,000 long steps."""
    inertia = np.array([1.0, 2.0, 3.0])
    case = problem(FREE, [0], [0.2, 2, 0.1], inertia, 200.0, METHODS[name], step=0.1, samples=2001)
    run = integrate(case)
    for invariant in ((run.u**2 * inertia).sum(axis=1), (run.u**2 * inertia**2).sum(axis=1)):
        assert np.abs(invariant / invariant[0] - 1).max() < 2e-13
    damped = integrate(problem(FREE, [0], [0.2, 2, 0.1], inertia, 200.0, METHODS["radau_3"], step=0.1, samples=2))
    assert abs((damped.u_final**2 * inertia).sum() / (run.u[0] ** 2 * inertia).sum() - 1) > 1e-6


@pytest.mark.parametrize("name", ["gauss_4", "gauss_6"])
def test_the_energy_of_a_pendulum_does_not_drift_under_gauss_methods(name):
    """It oscillates by a power of the step, the same in the first and the last tenth of 500 turns."""
    run = integrate(problem(PENDULUM, [2], [0], [1, 1], 4000.0, METHODS[name], step=0.5, samples=8001))
    energy = run.u[:, 0] ** 2 / 2 - np.cos(run.q[:, 0])
    change = np.abs(energy - energy[0])
    assert 1e-8 < change.max() < 5e-3
    assert change[-800:].max() < 1.05 * change[:800].max()


@pytest.mark.parametrize("name", ADAPTIVE)
def test_the_error_follows_the_tolerance(name):
    errors = []
    for tolerance in (1e-4, 1e-5, 1e-6):
        run = integrate(swing(name, rtol=tolerance, atol=tolerance))
        errors.append(np.abs(run.q[:, 0] - elliptic_angle(run.t, 2.0, 1.0)).max())
        assert errors[-1] < 2e4 * tolerance if name == "implicit_euler" else 200 * tolerance
    assert errors[0] > 2 * errors[1] > 4 * errors[2]


def test_a_stiff_problem_takes_a_hundredth_of_the_steps():
    """The heavy part is a pendulum; the light one follows the sine of its angle but for inertia and damping."""
    runs = {name: integrate(stiff(name, rtol=1e-6, atol=1e-8)) for name in ("radau_5", "dormand_prince")}
    steps = {name: run.statistics.steps for name, run in runs.items()}
    assert 100 * steps["radau_5"] < steps["dormand_prince"]
    angle = elliptic_angle(runs["radau_5"].t, 1.0, 1.0)
    for run in runs.values():
        np.testing.assert_allclose(run.q, np.array([angle, np.sin(angle)]).T, atol=2e-5)
    assert runs["radau_5"].statistics.jacobians < steps["radau_5"]


@LOOPS
def test_what_is_at_rest_may_be_moved_by_what_moves(loop):
    """q1'' = 1 and q2'' = q1^2 from zero: the first round of the iteration leaves q2 alone, the second does not."""
    model = HandModel(
        2,
        2,
        0,
        "out[0][0] = u[0]; out[0][1] = u[1]; out[1][0] = 1.0; out[1][1] = q[0]*q[0];",
        others=(
            (
                "jacobian",
                "for (int i = 0; i < 16; ++i) out[0][i] = 0.0;"
                "out[0][2] = out[0][7] = 1.0; out[0][12] = 2.0*q[0];",
            ),
        ),
    )
    run = integrate(problem(model, [0, 0], [0, 0], [], 1.0, METHODS["gauss_6"], step=0.01, samples=11), loop=loop)
    assert run.status is Status.DONE
    np.testing.assert_allclose(run.q, np.array([run.t**2 / 2, run.t**6 / 120]).T, rtol=1e-13, atol=1e-16)


@LOOPS
def test_an_iteration_without_a_solution_names_its_component(loop):
    """x' = x^2 has no solution beyond t = 1, nor has the step of length 2 one."""
    run = integrate(CASES["no solution"](), loop=loop)
    assert run.status is Status.NOT_CONVERGED
    assert run.failure.time == 0.0
    assert run.failure.component in (0, 1)


def test_a_pole_ends_an_adaptive_run_at_its_time():
    run = integrate(problem(BURST, [1], [1], [], 2.0, METHODS["radau_5"], rtol=1e-6))
    assert run.status in (Status.STEP_UNDERFLOW, Status.NOT_FINITE, Status.NOT_CONVERGED)
    assert run.failure.time == pytest.approx(1.0, abs=1e-5)


@LOOPS
@pytest.mark.parametrize(("name", "step"), [("radau_5", None), ("gauss_4", 0.07), ("trapezoid", 0.07)])
def test_kinks_restart_implicit_methods(loop, name, step):
    """Dry friction turns a spring's motion at multiples of half a period, about a centre that jumps."""
    model = with_jacobian(BRAKED, "out[0][0] = out[0][3] = 0.0; out[0][1] = 1.0; out[0][2] = -1.0;")
    case = problem(model, [10], [0], [0.3], 8.0, METHODS[name], terminal=(False,), step=step, rtol=1e-6, atol=1e-6)
    run = integrate(case, loop=loop)
    tolerance = 2e-2 if name == "trapezoid" else 1e-4
    assert run.status is Status.DONE
    np.testing.assert_allclose([e.time for e in run.events], np.arange(1, 3) * math.pi, atol=tolerance)


def test_an_implicit_method_needs_the_jacobian():
    with pytest.raises(ValueError, match="gauss_4 is implicit"):
        problem(BLOW_UP, [1], [1], [], 1.0, METHODS["gauss_4"], step=0.1)
