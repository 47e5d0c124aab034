"""Windows of four bars pass ten singular positions, in which each window might fold, by every method and tolerance."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from singular_mechanisms import MECHANISMS
from windows import GRAVITY as G
from windows import windows

import multibody_sym as mbs
from multibody_sym.mechanics.changes import with_settings
from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.prepare.problem import prepare_system, problem_of, settings_of

END = 10.0
EXAMPLE = Path(__file__).parents[2] / "examples" / "spatial_four_bar.yaml"
WAYS = [
    ("dormand_prince_8", {"projection": True}),
    ("radau_5", {"projection": True}),
    ("radau_5", {"index_2": True}),
]


def by_hand(count: int, t: np.ndarray) -> np.ndarray:
    """Return the angle of all cranks: the couplers only shift, so that it is one pendulum."""
    inertia, weight = (count + 1) / 3 + count, G * ((count + 1) / 2 + count)

    def rate(_: float, x: np.ndarray) -> list[float]:
        return [x[1], -weight * np.cos(x[0]) / inertia]

    return solve_ivp(rate, (0, END), [np.pi / 2, -1.0], "DOP853", t, rtol=1e-13, atol=1e-13).y[0]


def problem(system: mbs.System, method: str, constraints: dict[str, bool]) -> Problem:
    ready = prepare_system(with_settings(system, {"method": method, "constraints": constraints}))
    return problem_of(ready, settings_of(ready))


def verify(compiled: Problem, count: int, rtol: float) -> None:
    """Verify a run: ten crossings, on the one branch on which all cranks are parallel, with the energy and the way."""
    run = integrate(replace(compiled, rtol=rtol, atol=rtol, samples=201))
    assert run.failure is None
    assert len(run.singular) == 10
    exact = by_hand(count, run.t)[:, None]
    cranks = run.u[:1] < 0.0  # turn forward at first; couplers turn back as much against them
    assert np.abs(run.q - np.where(cranks, exact, -exact)).max() < 3e3 * rtol + 1e-6
    parts = compiled.compiled.map("energy", run.t, run.q, run.u, compiled.parameters, [], compiled.modes)
    energy = sum(parts)
    assert np.ptp(energy) < (1e3 * rtol + 1e-8) * energy[0]


@pytest.mark.parametrize(("method", "constraints"), WAYS, ids=str)
def test_two_windows_at_every_tolerance(method: str, constraints: dict[str, bool]) -> None:
    compiled = problem(windows(2), method, constraints)
    for k in range(6, 12):
        verify(compiled, 2, 10.0**-k)


@pytest.mark.parametrize("count", [1, 2, pytest.param(3, marks=pytest.mark.long)])
@pytest.mark.parametrize("between", [0.1, pytest.param(0.02, marks=pytest.mark.long)])
def test_rows_in_the_equations_are_watched_at_stages_too(count: int, between: float) -> None:
    """Steps so long that they might pass a singular position between their ends, or be wrong behind it."""
    compiled = replace(problem(windows(count), *WAYS[2]), samples=201)
    exact = by_hand(count, np.linspace(0, END, 201))[:, None]
    for k in np.arange(2, 5, between):
        run = integrate(replace(compiled, rtol=10.0**-k, atol=10.0**-k))
        assert run.failure is None
        assert len(run.singular) == 10
        assert np.abs(run.q - np.where(run.u[:1] < 0.0, exact, -exact)).max() < 3e3 * 10.0**-k


def test_round_off_of_many_windows_stops_no_iteration_and_no_stage() -> None:
    """Tolerances beside which round-off in the slopes, or in states put onto the constraints, is large."""
    compiled = replace(problem(windows(8), *WAYS[2]), t_end=3.0, samples=61)
    for tolerance in (10.0**-11.4, 10.0**-11.8):
        run = integrate(replace(compiled, rtol=tolerance, atol=tolerance))
        assert run.failure is None
        assert len(run.singular) == 3
        exact = by_hand(8, run.t)[:, None]
        assert np.abs(run.q - np.where(run.u[:1] < 0.0, exact, -exact)).max() < 1e-8


def test_steps_across_are_laid_before_they_are_tried() -> None:
    """Nearly no trial fails, and no step is worse for being the first after a singular position."""
    compiled = problem(windows(2), "radau_5", {"index_2": True})
    run = integrate(replace(compiled, rtol=1e-11, atol=1e-11, samples=201))
    exact = by_hand(2, run.t)[:, None]
    assert run.statistics.rejected < 25
    assert np.abs(run.q - np.where(run.u[:1] < 0.0, exact, -exact)).max() < 1e-7


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "constraints", "count", "finest", "between"),
    [
        (*WAYS[0], 40, 11, 0.2),
        (*WAYS[1], 40, 11, 1),
        (*WAYS[1], 12, 11, 1),
        (*WAYS[2], 40, 11, 1),
        (*WAYS[2], 20, 11.5, 0.25),
    ],
)
def test_many_windows_at_many_tolerances(
    method: str, constraints: dict[str, bool], count: int, finest: float, between: float
) -> None:
    compiled = problem(windows(count), method, constraints)
    for k in np.arange(6, finest + 0.1, between):
        verify(compiled, count, 10.0**-k)


def verify_bennett_s(compiled: Problem, rtol: float) -> None:
    """Verify the angles by G. T. Bennett (1903), and the energy."""
    run = integrate(replace(compiled, rtol=rtol, atol=rtol, samples=501))
    assert run.failure is None
    a, b, alpha = 0.5, 0.3, np.pi / 3
    beta = np.arcsin(b * np.sin(alpha) / a)
    product = np.tan(run.q[:, 0] / 2) * np.tan(run.q[:, 1] / 2)
    assert np.abs(product - np.sin((alpha + beta) / 2) / np.sin((alpha - beta) / 2)).max() < 1e-9 + 10 * rtol
    assert np.abs(run.q[:, 0] + run.q[:, 2]).max() < 1e-9 + rtol
    energy = sum(compiled.compiled.map("energy", run.t, run.q, run.u, compiled.parameters, [], compiled.modes))
    assert np.ptp(energy) < 10 * rtol * energy[0]


@pytest.mark.parametrize(("method", "constraints"), WAYS, ids=str)
@pytest.mark.parametrize("between", [2.5, pytest.param(0.125, marks=pytest.mark.long)])
def test_bennett_s_linkage_at_every_tolerance(method: str, constraints: dict[str, bool], between: float) -> None:
    """In all of its positions three of its five rows depend on the others, by lengths and twists alone."""
    compiled = problem(mbs.load(EXAMPLE), method, constraints)
    for k in np.arange(6, 11.1, between):
        verify_bennett_s(compiled, 10.0**-k)


@pytest.mark.parametrize("drive", ["0", "1e5*(1 + 3*t - phi) + 1e3*(3 - u_phi)"], ids=["free", "stiff"])
@pytest.mark.parametrize("name", MECHANISMS)
def test_rows_as_part_of_the_equations_are_left_and_taken_again(name: str, drive: str) -> None:
    """Stages found by iteration reach the finest tolerances; where forces are stiff with a Jacobian of such slopes."""
    mechanism = MECHANISMS[name]
    compiled = problem(with_settings(mechanism.system(drive, g=9.81), {"t_end": 2}), "radau_5", {"index_2": True})
    for k in (4, 8, 11) if drive == "0" else (6, 8):
        run = integrate(replace(compiled, rtol=10.0**-k, atol=10.0**-k, samples=101))
        assert run.failure is None
        assert run.statistics.rejected < 0.5 * run.statistics.steps + 100
        phi = run.q[:, 0]
        side = mechanism.crossing(phi)
        assert len(run.singular) == np.count_nonzero(side[1:] * side[:-1] < 0) >= 2


@cache
def stiffly_driven(name: str) -> np.ndarray:
    """Return phi at 101 samples of 2 s, of the motion by hand with a drive that is stiff."""
    mechanism = MECHANISMS[name]

    def rate(t: float, x: np.ndarray) -> list[float]:
        drive = 1e5 * (1 + 3 * t - x[0]) + 1e3 * (3 - x[1])
        push = drive - G * mechanism.weight(x[0]) - 0.5 * mechanism.slope(x[0]) * x[1] ** 2
        return [x[1], push / mechanism.inertia(x[0])]

    samples: np.ndarray = np.linspace(0, 2, 101)
    found: np.ndarray = solve_ivp(rate, (0, 2), [1.0, 3.0], "Radau", samples, rtol=1e-12, atol=1e-12).y[0]
    return found


@pytest.mark.parametrize("constraints", [{"projection": True}, {"index_2": True}], ids=str)
@pytest.mark.parametrize("name", MECHANISMS)
def test_stiff_forces_at_singular_positions_get_a_jacobian(name: str, constraints: dict[str, bool]) -> None:
    """Against the motion by hand, with few trials in vain: the drive holds the speed within half a millisecond."""
    mechanism = MECHANISMS[name]
    system = mechanism.system("1e5*(1 + 3*t - phi) + 1e3*(3 - u_phi)", g=G)
    compiled = problem(with_settings(system, {"t_end": 2}), "radau_5", constraints)
    exact = stiffly_driven(name)
    for k in (5, 8, 11):
        run = integrate(replace(compiled, rtol=10.0**-k, atol=10.0**-k, samples=101))
        assert run.failure is None
        assert np.abs(run.q[:, 0] - exact).max() < 3 * 10.0**-k + 1e-10
        assert run.statistics.rejected < 0.5 * run.statistics.steps + 20
