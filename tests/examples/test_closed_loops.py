"""Closed loops and rolling among the examples: published figures, closed forms, motions of fewer freedoms by hand."""

from __future__ import annotations

import numpy as np
import pytest
from runs import G, by_hand, simulated
from scipy.integrate import simpson
from scipy.optimize import minimize_scalar
from twins import from_file

import multibody_sym as mbs

SQUEEZER = {
    "beta": 15.81077119629904,
    "theta": -15.75637105984298,
    "gamma": 0.04082224013073101,
    "phi": -0.5347301163226948,
    "delta": 0.5244099658805303,
    "omega": 0.5347301163226948,
    "epsilon": 1.048080741042263,
}
"""Angles at 0.03 s, good to 1.5e-9. Source: Test Set for Initial Value Problem Solvers, problem Andrews' squeezer."""


@pytest.mark.parametrize(
    ("method", "constraints", "coordinates"),
    [
        ("dormand_prince", None, "relative"),
        ("dormand_prince_8", None, "relative"),
        ("radau_5", None, "relative"),
        ("radau_5", "index_2", "relative"),
        ("dormand_prince", None, "absolute"),
        ("dormand_prince_8", None, "absolute"),
    ],
)
def test_squeezer_ends_where_published(method: str, constraints: str | None, coordinates: str) -> None:
    settings = {"method": method, "constraints": constraints, "coordinates": coordinates}
    run = mbs.simulate(from_file("andrews_squeezer"), samples=2, **settings)
    assert {name: run[name][-1] for name in SQUEEZER} == pytest.approx(SQUEEZER, rel=0, abs=2e-9)
    assert run.drift["position"] < 1e-13


def test_crank_rocker_is_closed_and_the_motor_s_work_is_its_energy() -> None:
    a, b, c, d = 0.2, 0.5, 0.4, 0.5
    run = simulated("four_bar", 0.5, samples=501)
    crank, rocker = run["crank_angle"], run["rocker_angle"]
    x, y = d - a * np.cos(crank), -a * np.sin(crank)  # from the crank's end to the rocker's pivot
    diagonal = np.hypot(x, y)
    inside = np.arccos((diagonal**2 + c**2 - b**2) / (2 * diagonal * c))
    angle = np.arctan2(-y, -x) - inside
    assert np.abs(np.exp(1j * angle) - np.exp(1j * rocker)).max() < 1e-10
    power = 0.5 * np.cos(run.t) * run["u_crank_angle"]
    assert run.energy[-1] - run.energy[0] == pytest.approx(simpson(power, x=run.t), rel=1e-8)


def test_slider_follows_its_closed_form() -> None:
    r, l = 0.1, 0.3
    run = simulated("slider_crank", 0.3, samples=31)
    assert np.abs(run["s"] - r * np.cos(run["phi"]) - np.sqrt(l**2 - (r * np.sin(run["phi"])) ** 2)).max() < 1e-11


def test_three_cranks_move_as_one_with_the_reduced_inertia() -> None:
    r, m, M = 0.3, 1.0, 4.0
    run = simulated("three_cranks", 1.0, samples=21)
    (phi,) = by_hand(
        lambda t, q, u: [-G * (1.5 * m + M) * np.cos(q[0]) / ((m + M) * r)], [-np.pi / 3], run.t, [1.0]
    )
    for name in ("phi", "phi2", "phi3"):
        assert np.abs(run[name] - phi).max() < 1e-7
    found = mbs.check(from_file("three_cranks"))
    assert {"A1", "A2", "A3"} <= set(found.not_unique)


def test_bennett_s_linkage_moves() -> None:
    """tan(theta1/2) tan(theta2/2) = sin((alpha + beta)/2) / sin((alpha - beta)/2). Source: G. T. Bennett (1903)."""
    a, b, alpha = 0.5, 0.3, np.pi / 3
    beta = np.arcsin(b * np.sin(alpha) / a)
    run = simulated("spatial_four_bar", 0.7, samples=31)
    assert np.ptp(run["theta1"]) > 0.1
    product = np.tan(run["theta1"] / 2) * np.tan(run["theta2"] / 2)
    assert np.abs(product - np.sin((alpha + beta) / 2) / np.sin((alpha - beta) / 2)).max() < 1e-9
    assert np.abs(run["theta1"] + run["theta3"]).max() < 1e-10
    found = mbs.check(from_file("spatial_four_bar"))
    assert found.degrees_of_freedom == 1
    assert len(found.redundant) == 3
    assert all(name.startswith("D.") for name in found.redundant)


def test_coin_rolls_steadily_in_a_circle() -> None:
    r, lean, turn = 0.012, np.radians(70), 10.0
    run = simulated("rolling_coin", 1.0, samples=51)
    spin = -5 / 6 * turn * np.cos(lean) - 2 / 3 * G / r * np.cos(lean) / (turn * np.sin(lean))
    assert np.abs(run["lean"] - lean).max() < 1e-8
    assert np.abs(run["heading"] - turn * run.t).max() < 1e-7
    speed = -r * (spin + turn * np.cos(lean))
    assert np.abs(run["x"] - speed / turn * np.sin(turn * run.t)).max() < 1e-8
    assert np.abs(run["normal_force"] - 0.008 * G).max() < 1e-7


def test_coin_that_nutates_stays_on_the_table_and_keeps_its_energy() -> None:
    run = mbs.simulate(
        from_file("rolling_coin"), t_end=0.5, rtol=1e-10, parameters={"spin": -30.0}, samples=51, backend="python"
    )
    assert np.ptp(run["lean"]) > 0.1
    assert np.abs(run["z"] - 0.012 * np.sin(run["lean"])).max() < 1e-12
    assert run.drift["energy"] < 1e-8 * run.energy[0]


def test_sleigh_turns_by_chaplygin_s_angle_and_keeps_its_energy() -> None:
    """v' = a w^2, (J + m a^2) w' = -m a v w: v = V tanh s, w = W sech s, and theta goes with the gudermannian of s."""
    m, J, a, v, w = 1.0, 0.1, 0.2, -1.0, 0.1
    run = simulated("chaplygin_sleigh", 60.0, samples=101)
    inertia = J + m * a**2
    V = np.sqrt(v**2 + inertia / m * w**2)
    angle = np.sqrt(inertia / m) / a * (np.pi / 2 - np.arcsin(v / V))
    assert run["theta"][-1] == pytest.approx(angle, abs=1e-7)
    assert run["u_x"][-1] == pytest.approx(V * np.cos(angle), abs=1e-7)
    assert np.ptp(run["energy"]) < 1e-9


def test_cart_drives_as_its_wheels_turn_and_gains_what_the_torques_do() -> None:
    r, b = 0.1, 0.25
    run = simulated("two_wheeled_cart", 4.0, samples=801)
    left, right = run["u_phi_left"], run["u_phi_right"]
    assert np.abs(run["u_theta"] - r * (right - left) / (2 * b)).max() < 1e-10
    assert np.abs(run["u_x"] - r * (left + right) / 2 * np.cos(run["theta"])).max() < 1e-10
    assert np.abs(run["u_y"] - r * (left + right) / 2 * np.sin(run["theta"])).max() < 1e-10
    power = 0.1 * left + 0.1 * (1 + 0.5 * np.sin(run.t)) * right
    assert run.energy[-1] - run.energy[0] == pytest.approx(simpson(power, x=run.t), rel=1e-8)


WEAVE = -0.775341882195845 + 4.46486771378823j
BICYCLE = {
    5.0: [WEAVE, WEAVE.conjugate(), -0.322866429004087, -14.0783896927982],
    0.0: [3.13164324790656, -3.13164324790656, 5.53094371765393, -5.53094371765393],
}
"""Source: J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Proc. R. Soc. A 463 (2007), table 2."""


@pytest.mark.parametrize("speed", BICYCLE)
def test_bicycle_has_the_published_eigenvalues(speed: float) -> None:
    system = from_file("bicycle")
    text = mbs.dumps(system).replace("5 m/s", f"{speed} m/s")
    found = mbs.linearize(mbs.loads(text))
    assert max(map(abs, found.accelerations.values())) < 1e-9
    moving = [x for x in found.eigenvalues if abs(x) > 1e-3]
    assert len(moving) == 4
    for value in BICYCLE[speed]:
        assert min(abs(x - value) for x in moving) < 1e-9


def test_stewart_platform_settles_where_its_energy_is_least_and_carries_its_weight() -> None:
    M, lower, upper, s, k, l0 = 40.0, 2.0, 1.0, 0.2, 20_000.0, 0.72
    base, plate = 0.5 * np.exp(-1j * np.radians(10)), 0.3 * np.exp(-1j * np.radians(50))

    def energy(h: float) -> float:
        length = np.hypot(h, abs(plate - base))
        halves = lower * s * h / length + upper * (h - s * h / length)
        return float(3 * k * (length - l0) ** 2 + M * G * h + 6 * G * halves)

    run = mbs.simulate(from_file("stewart_platform"), t_end=2.0, samples=3, backend="python")
    lowest = minimize_scalar(energy, bounds=(0.5, 0.8), method="bounded", options={"xatol": 1e-12})
    assert run["height"][-1] == pytest.approx(lowest.x, abs=1e-6)
    assert run["carried"][-1] == pytest.approx((M + 6 * (lower + upper)) * G, rel=1e-5)


def test_a_stiff_rod_moves_like_a_rigid_one_in_steps_a_hundred_times_longer_than_explicit_ones() -> None:
    """Rigid, with the rod's angle psi(phi): (I phidot)' - I' phidot^2 / 2 + V' = 0; derivatives by complex steps."""
    system = from_file("elastic_rod")
    fastest = np.abs(np.linalg.eigvals(mbs.linearize(system).A)).max()
    assert 1e8 / fastest**2 == pytest.approx(0.01, rel=0.1)  # the reduced mass
    r, l, m1, m2, m3 = 0.1, 0.3, 1.0, 0.1, 0.006

    def inertia_and_potential(phi: complex) -> tuple[complex, complex]:
        psi = np.arcsin(-r / l * np.sin(phi))
        turn = -r * np.cos(phi) / (l * np.cos(psi))
        rod = (-r * np.sin(phi) - l / 2 * np.sin(psi) * turn) ** 2 + (r * np.cos(phi) / 2) ** 2
        slider = (-r * np.sin(phi) - l * np.sin(psi) * turn) ** 2
        inertia = m1 * r**2 / 3 + m2 * (rod + l**2 / 12 * turn**2) + m3 * slider
        return inertia, G * (m1 + m2) * r / 2 * np.sin(phi)

    def acceleration(t: float, q: np.ndarray, u: np.ndarray) -> list[float]:
        inertia, potential = inertia_and_potential(q[0] + 1e-30j)
        return [-(inertia.imag * u[0] ** 2 / 2 + potential.imag) / 1e-30 / inertia.real]

    run = mbs.simulate(system, samples=41)
    (phi,) = by_hand(acceleration, [-np.pi / 3], run.t, [0.0])
    assert np.abs(run["phi"] - phi).max() < 1e-6
    explicit = mbs.simulate(system, t_end=0.05, method="dormand_prince", constraints="projection", samples=2)
    assert run.statistics["mean_step"] > 100 * explicit.statistics["mean_step"]
