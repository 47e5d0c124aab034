"""What slips from rest in space under a load that grows and turns goes on, explicit methods and implicit ones alike."""

from __future__ import annotations

import pytest

import multibody_sym as mbs


def puck() -> mbs.System:
    """A particle on a rough table, static as kinetic, pushed by a force that turns as it grows."""
    return mbs.System(
        "puck",
        gravity=[0, 0, -10],
        bodies={"ground": mbs.Body(surfaces={"table": {"plane": [0, 0, 0], "normal": "z"}}), "puck": mbs.Body(mass=1)},
        joints={"free": mbs.PointJoint("ground", "puck", axes="xyz", q=["x", "y", "z"])},
        contacts={"c": mbs.Contact(["puck", "ground.table"], kinetic=0.2)},
        forces={"push": mbs.Force("puck", ["t", "0.5*t + 0.3*t^2", 0])},
    )


def test_a_turning_load_moves_what_it_has_just_overcome() -> None:
    explicit = mbs.simulate(puck(), t_end=4)
    implicit = mbs.simulate(puck(), t_end=4, method="radau_5", rtol=1e-11, atol=1e-13)
    assert explicit.statistics["steps"] < 20_000
    slips = explicit.changes[0]["t"]
    assert slips**2 + (0.5 * slips + 0.3 * slips**2) ** 2 == pytest.approx((0.2 * 10) ** 2, rel=1e-9)
    for name in "xy":
        assert explicit[name][-1] == pytest.approx(implicit[name][-1], rel=1e-7)
