"""Runs of bodies of variable mass: burnt out, in loops, with contacts, in absolute coordinates, with nothing left."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs

FINE: dict[str, Any] = {"rtol": 1e-11, "atol": 1e-13, "backend": "python"}


def rocket(value: str, **more: Any) -> mbs.System:
    return mbs.System(
        "rocket",
        gravity=[0, -9.81, 0],
        bodies={"rocket": mbs.Body(mass=mbs.VariableMass(value, relative_velocity=[0, -2000, 0]))},
        joints={"way": mbs.Prismatic("ground", "rocket", axis="y", q="y")},
        **more,
    )


@pytest.mark.parametrize("method", ["dormand_prince", "rk4"])
def test_nothing_left(method: str) -> None:
    step = {"step": 0.5} if method == "rk4" else {}
    with pytest.raises(mbs.RunError, match=r"the mass of rocket is used up at t = .*max\(m0 - k\*t, m1\)"):
        mbs.simulate(rocket("100 - 2*t"), t_end=60, method=method, backend="python", **step)


def test_what_holds_on_to_a_mass_that_passes_zero_is_told_where_it_did() -> None:
    body = mbs.Body(mass=mbs.VariableMass("1 - t", relative_velocity=[0, 0, 0]))
    carrier = mbs.Body(mass=2)
    joints = {"way": mbs.Prismatic("ground", "cart", axis="x", q="x"), "on": mbs.Fixed("cart", "load")}
    system = mbs.System("cart", bodies={"cart": carrier, "load": body}, joints=joints)
    with pytest.raises(mbs.RunError, match=r"the mass of load is used up at t = 1 s"):
        mbs.simulate(system, t_end=2, backend="python")


def test_a_rocket_burns_out_and_flies_on() -> None:
    run = mbs.simulate(rocket("max(100 - 2*t, 20)"), t_end=60, samples=2, rtol=1e-11, atol=1e-13)
    assert run["u_y"][-1] == pytest.approx(2000 * math.log(5) - 9.81 * 60, rel=1e-9)
    assert max(miss.relative for miss in run.verified().values()) < 1e-9


def leaking_four_bar(**settings: Any) -> mbs.System:
    """A four-bar whose coupler fills with what falls in at rest, and whose crank loses mass through its end."""
    crank = mbs.VariableMass("2 - 0.4*t", relative_velocity=[1, 0.5, 0], at="end")
    coupler = mbs.VariableMass("1 + 0.3*t + 0.2*sin(phi)", absolute_velocity=[0, 0, 0])
    return mbs.System(
        "four_bar",
        gravity=[0, -9.81, 0],
        bodies={
            "ground": mbs.Body(points={"pivot": [1, 0, 0]}),
            "crank": mbs.Body(mass=crank, com=["0.2 - 0.02*t", 0, 0], inertia={"Izz": "0.05 - 0.01*t"},
                              points={"end": [0.4, 0, 0]}),
            "coupler": mbs.Body(mass=coupler, com=[0.4, 0, 0], inertia={"Izz": 0.06}, points={"end": [0.9, 0, 0]}),
            "rocker": mbs.Body(mass=1.5, com=[0.3, 0, 0], inertia={"Izz": 0.05}, points={"end": [0.6, 0, 0]}),
        },
        joints={
            "A": mbs.Revolute("ground", "crank", q="phi", initial={"q": 1.2, "u": 2, "known": True}),
            "B": mbs.Revolute("crank.end", "coupler", q="beta"),
            "D": mbs.Revolute("ground.pivot", "rocker", q="psi", initial={"q": 1.6}),
            "C": mbs.Revolute("coupler.end", "rocker.end", cut=True),
        },
        **settings,
    )


def test_a_loop_in_joint_and_in_absolute_coordinates() -> None:
    runs = [
        mbs.simulate(leaking_four_bar(), t_end=0.1, samples=3, coordinates=how, backend="python")
        for how in ("relative", "absolute")
    ]
    for q in ("phi", "beta", "psi"):
        np.testing.assert_allclose(runs[1][q], runs[0][q], rtol=0, atol=1e-7)
    np.testing.assert_allclose(runs[1].reactions["A"]["fx"], runs[0].reactions["A"]["fx"], rtol=0, atol=1e-5)


def test_all_routes_agree_on_the_loop() -> None:
    report = mbs.check(leaking_four_bar())
    assert len(report.agreement) >= 6
    assert max(report.agreement.values()) < 100
    assert max(report.theorems.values()) < 1e-9


def test_energy_account_closes_with_friction() -> None:
    sled = mbs.Body(
        mass=mbs.VariableMass("10 - 0.5*t", relative_velocity=[-40, 0, 0]), surfaces={"p": mbs.Surface(point=[0, 0, 0])}
    )
    system = mbs.System(
        "sled",
        gravity=[0, -9.81, 0],
        bodies={"ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")}), "sled": sled},
        joints={"free": mbs.PointJoint("ground", "sled", axes="xy", q=["x", "y"])},
        contacts={"c": mbs.Contact(between=["sled.p", "ground.floor"], static=0.2, kinetic=0.2)},
    )
    run = mbs.simulate(system, t_end=1, samples=3, rtol=1e-10, atol=1e-12)
    assert run["u_x"][-1] == pytest.approx(40 * math.log(10 / 9.5) - 0.2 * 9.81, abs=1e-8)
    assert abs(run.energy_residual) < 1e-8 * max(1.0, abs(float(run.energy[-1])))


def test_exported_and_compiled_functions_know_the_mass() -> None:
    system = rocket("100 - 2*t")
    for backend in ("c", "python"):
        derivative = mbs.compile(mbs.state_derivative(system), backend=backend)
        assert derivative(10.0, [0.0, 0.0])[1] == pytest.approx(2 * 2000 / 80 - 9.81, rel=1e-14)


def test_an_impact_is_one_of_the_mass_of_the_moment() -> None:
    """A wagon fills until it strikes a stop without loss: what is in it then turns round."""
    wagon = mbs.Body(mass=mbs.VariableMass("1 + t", absolute_velocity=[0, 0, 0]))
    limits = mbs.Limits(lower=-10, upper=1, restitution=1)
    track = mbs.Prismatic("ground", "wagon", axis="x", q="x", initial={"u": 2}, limits=limits)
    system = mbs.System("wagon", bodies={"wagon": wagon}, joints={"track": track})
    run = mbs.simulate(system, t_end=1.5, samples=3, **FINE)
    struck = math.exp(1 / 2) - 1  # x = 2*ln(1 + t)
    (hit,) = [event for event in run.events if "impulse" in event]
    assert hit["t"] == pytest.approx(struck, rel=1e-9)
    assert abs(hit["impulse"]) == pytest.approx(2 * (1 + struck) * 2 / (1 + struck), rel=1e-9)
    assert run["u_x"][-1] == pytest.approx(-2 / 2.5, rel=1e-9)


def test_reactions_about_a_joint_whose_body_s_centre_moves_in_it() -> None:
    """A slider driven in its joint, whose centre of mass moves across the guide: the same in both coordinates."""
    mass = mbs.VariableMass("2 + t", absolute_velocity=[0, 0, 0])
    body = mbs.Body(mass=mass, com=[0, "0.5 + t", 0], inertia={"Izz": 1})
    system = mbs.System(
        "slider",
        gravity=[0, -10, 0],
        bodies={"slider": body},
        joints={"guide": mbs.Prismatic("ground", "slider", axis="x", q="x")},
        forces={"drive": mbs.Torque(joint="guide", value=3)},
    )
    told = [
        mbs.simulate(system, t_end=0.5, samples=2, coordinates=how, **FINE).reactions["guide"]
        for how in ("relative", "absolute")
    ]
    for component in ("fx", "fy", "mz"):
        assert told[1][component].tolist() == pytest.approx(told[0][component].tolist(), abs=1e-8)
    assert told[0]["fx"][0] == pytest.approx(3.0)
