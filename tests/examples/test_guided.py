"""Beads on wires of the examples: times, forces and integrals that books give in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import Floats, G, by_hand, run_of
from twins import from_file

import multibody_sym as mbs
from multibody_sym.text.printer import text


@pytest.mark.parametrize("start", [0.05, 1.0, 2.5, 3.0])
def test_the_cycloid_is_isochronous(start: float) -> None:
    run = run_of("cycloid_pendulum", parameters={"start": start})
    assert run.t[-1] == pytest.approx(np.pi * np.sqrt(0.25 / G), rel=1e-10)


def test_the_brachistochrone_takes_the_time_of_its_closed_form_and_the_slope_longer() -> None:
    run = run_of("brachistochrone")
    R, first, last = 0.5, 0.1, 4.5
    assert run.t[-1] == pytest.approx((last - first) * np.sqrt(R / G), rel=1e-10)
    dx, dy = (R * np.diff([a(first), a(last)])[0] for a in (lambda s: s - np.sin(s), np.cos))
    along = np.hypot(dx, dy)
    assert run["left"][-1] > 0.1 * along
    v0, a = np.sqrt(2 * G * R * (1 - np.cos(first))), -G * dy / along
    system = replace(from_file("brachistochrone"), stop={"there": "r > along"})
    slope = mbs.simulate(system, rtol=1e-12, atol=1e-13, backend="python")
    assert slope.t[-1] == pytest.approx((np.sqrt(v0**2 + 2 * a * along) - v0) / a, rel=1e-10)
    assert slope.t[-1] > 1.1 * run.t[-1]


def test_the_parabola_presses_as_a_book_says() -> None:
    solution = mbs.solve(from_file("bead_on_a_parabola"))
    assert text(solution.reactions["wire"]["normal"].expression) == "m*(g*p + v^2)/sqrt(p^2 + x0^2)"
    assert text(solution.accelerations["x"].expression) == "-x0*(g*p + v^2)/(p^2 + x0^2)"
    run = run_of("bead_on_a_parabola", t_end=1.0, samples=41)
    p, m, x, v = 0.5, 0.2, run["x"], run["u_x"]
    speed = v * np.sqrt(1 + x**2 / p**2)
    radius = p * (1 + x**2 / p**2) ** 1.5
    assert run["normal"] == pytest.approx(m * (speed**2 / radius + G / np.sqrt(1 + x**2 / p**2)), rel=1e-12)
    assert np.ptp(run["energy"]) < 1e-10 * run["energy"][0]


def test_the_ring_on_the_moving_wire_moves_as_the_equation_by_hand_says() -> None:
    p, w, a, shaking, m = 0.5, 4.0, 5e-3, 20.0, 0.1

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        (x,), (v,) = q, u
        g = G - a * shaking**2 * np.sin(shaking * t)
        return [(w**2 * x - g * x / p - x * v**2 / p**2) / (1 + x**2 / p**2)]

    run = run_of("ring_on_a_moving_wire", t_end=2.0, samples=41)
    (x,) = by_hand(accelerations, [0.2], run.t)
    assert np.abs(run["x"] - x).max() < 1e-9
    assert run["push"] == pytest.approx(-2 * m * w * run["u_x"], abs=1e-12)
    assert run["motor"] == pytest.approx(2 * m * w * run["x"] * run["u_x"], abs=1e-12)


def test_at_one_speed_the_ring_rests_anywhere_on_the_turning_wire() -> None:
    still = {"a": 0.0, "w": np.sqrt(G / 0.5)}
    run = run_of("ring_on_a_moving_wire", t_end=2.0, parameters=still, samples=11)
    assert np.ptp(run["x"]) < 1e-12


def test_a_wire_that_bends_by_itself_is_one_that_is_carried() -> None:
    """The turning parabola, carried by a body or written out in t, moves its ring alike."""
    carried = run_of("ring_on_a_moving_wire", t_end=1.0, parameters={"a": 0.0}, samples=11)
    m, p, w = mbs.parameters("m p w", [0.1, 0.5, 4.0], positive=True)
    s, t = mbs.variable("s"), mbs.t
    bent = mbs.Curve(x=s * mbs.cos(w * t), y=s**2 / (2 * p), z=-s * mbs.sin(w * t), parameter="s", unit="m")
    system = mbs.System(
        "bent",
        gravity=[0, -G, 0],
        bodies={"ring": mbs.Body(mass=m)},
        joints={"guide": mbs.CurveJoint(parent="ground", child="ring", curve=bent, q="s", initial={"q": 0.2})},
    )
    run = mbs.simulate(system, t_end=1.0, samples=11, rtol=1e-12, atol=1e-13, backend="python")
    assert run["s"] == pytest.approx(carried["x"], rel=1e-9, abs=1e-12)


def test_a_bead_rests_on_a_rough_parabola_where_the_slope_is_below_mu_and_rubs_with_its_normal_force() -> None:
    (mu,) = mbs.parameters("mu", [0.2], positive=True)
    rub = mbs.Friction("wire", static=mu, kinetic=mu)
    system = replace(from_file("bead_on_a_parabola"), forces={"rub": rub})
    found = mbs.range_of_rest(system, "mu", parameters={"v": 0.0})
    assert list(found.rest) == [(pytest.approx(0.6, rel=1e-12), None)]
    solution = mbs.solve(system)
    assert text(solution.accelerations["x"].expression) == "-(g*p + v^2)*(mu*p + x0)/(p^2 + x0^2)"
    assert solution.reactions["rub"]["normal"].value == pytest.approx(solution.reactions["wire"]["normal"].value)
