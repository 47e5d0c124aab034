"""Gears, couplers and limits of joints: closed forms, conservation, and how they are declared."""

from __future__ import annotations

from typing import Any

import pytest

from multibody_sym.analysis.check import check
from multibody_sym.answers.solve import solve
from multibody_sym.documents.runs import run_summary
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.model_files import dumps, loads
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Coupler, Gear
from multibody_sym.model.forces import Torque
from multibody_sym.model.joints import Initial, Limits, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.motion.simulate import simulate

WHEELS = {"a": Body(mass=1, inertia={"Izz": 2}), "b": Body(mass=1, inertia={"Izz": 5})}


def wheels(**declared: Any) -> System:
    joints = {"A": Revolute("ground", "a"), "B": Revolute("ground", "b")}
    drive = {"drive": Torque(7, joint="A")}
    return System("wheels", **{"bodies": WHEELS, "joints": joints, "forces": drive, **declared})


def test_gear_shares_the_moment_by_its_ratio() -> None:
    """With q_A = r q_B: (J_A + J_B / r^2) q_A'' = M, and the gear's moment on A is -J_B q_A'' / r^2."""
    found = solve(wheels(constraints={"mesh": Gear(["A", "B"], -2)}))
    acceleration = 7 / (2 + 5 / 4)
    assert found.accelerations["A"].value == pytest.approx(acceleration, rel=1e-14)
    assert found.accelerations["B"].value == pytest.approx(-acceleration / 2, rel=1e-14)
    assert found.reactions["mesh"]["multiplier"].value == pytest.approx(-5 / 4 * acceleration, rel=1e-14)


def test_gear_is_the_coupler_with_its_ratio() -> None:
    runs = [
        simulate(wheels(constraints={"c": tie}), t_end=1, samples=5)
        for tie in (Gear(["A", "B"], -2, "t^2/3"), Coupler({"A": 1, "B": 2}, "t^2/3"))
    ]
    assert runs[0].q.tolist() == runs[1].q.tolist()
    assert runs[0]["A"][-1] + 2 * runs[0]["B"][-1] == pytest.approx(1 / 3, abs=1e-12)


def test_differential_keeps_energy_and_its_tie() -> None:
    """q_A + q_B = 2 q_C with a weight on a rack: a pendulum drives two wheels."""
    bodies = {**WHEELS, "c": Body(mass=3, com=[0, -1, 0], inertia={"Izz": 1})}
    joints = {name.upper(): Revolute("ground", name) for name in "ab"}
    joints["C"] = Revolute("ground", "c", initial=Initial(q=1, known=True))
    tie = {"differential": Coupler({"A": 1, "B": 1, "C": -2})}
    run = simulate(System("s", gravity=[0, -9.81, 0], bodies=bodies, joints=joints, constraints=tie), t_end=5)
    assert run.drift["energy"] < 1e-7
    assert abs(run["A"] + run["B"] - 2 * run["C"]).max() < 1e-12
    assert run["A"][-1] / run["B"][-1] != pytest.approx(1, rel=1e-3)


def test_couplings_are_read_and_written() -> None:
    text = """\
multibody_sym: 1
name: s
bodies:
  a: {mass: 1, inertia: {Izz: 2}}
  b: {mass: 1}
joints:
  A: {type: revolute, parent: ground, child: a, limits: {lower: -90 deg, upper: 1.5, velocity: 3, effort: 20}}
  B: {type: prismatic, parent: ground, child: b, axis: x}
constraints:
  rack: {type: gear, joints: [B, A], ratio: 20 mm}
  more: {type: coupler, joints: {A: 1, B: 3}, value: 0.1}
"""
    system = loads(text)
    assert loads(dumps(system)) == system
    joints = {
        "A": Revolute("ground", "a", limits=Limits("-90 deg", 1.5, 3, 20)),
        "B": Prismatic("ground", "b", axis="x"),
    }
    rows = {"rack": Gear(["B", "A"], "20 mm"), "more": Coupler({"A": 1, "B": 3}, 0.1)}
    bodies = {"a": Body(mass=1, inertia={"Izz": 2}), "b": Body(mass=1)}
    assert System("s", bodies=bodies, joints=joints, constraints=rows) == system


@pytest.mark.parametrize(
    ("tie", "message", "path"),
    [
        (Gear(["A", "X"], 2), "no joint is called 'X'", ("constraints", "c", "joints", "1")),
        (Gear(["P", "A"], 2), "'P' has 3 degrees of freedom; one is needed", ("constraints", "c", "joints", "0")),
        (Coupler({"A": 1, "Q": 2}), "no joint is called 'Q'", ("constraints", "c", "joints", "Q")),
    ],
)
def test_joints_that_cannot_be_tied_are_named(tie: Any, message: str, path: tuple[str, ...]) -> None:
    joints = {"A": Revolute("ground", "a"), "P": Planar("ground", "b")}
    with pytest.raises(ModelError, match=message) as caught:
        mechanism(System("s", bodies=WHEELS, joints=joints, constraints={"c": tie}))
    assert caught.value.where.path == path


def test_coupler_without_joints_is_refused() -> None:
    with pytest.raises(ModelError, match="name the joints with their factors"):
        Coupler({})


def test_limits_need_one_freedom() -> None:
    with pytest.raises(ModelError, match="limits are for joints with one freedom"):
        Spherical("ground", "a", limits=Limits(lower=1))


def test_limits_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ModelError, match="the lower limit 2 is above the upper one 1"):
        Limits(lower=2, upper=1)


def test_a_joint_that_rests_at_its_limit_does_not_pass_it() -> None:
    start = Initial(q=0.5 + 1e-12)
    resting = {name: Revolute("ground", name.lower(), initial=start, limits=Limits(upper=0.5)) for name in "AB"}
    assert not simulate(wheels(joints=resting, forces={}), t_end=1, samples=11).events


def test_passed_limits_that_do_not_act_are_told_and_stop_nothing() -> None:
    limited = {"A": Revolute("ground", "a", limits=Limits(upper="u0", lower=-1, velocity=100, acts=False))}
    limited["B"] = Revolute("ground", "b", initial=Initial(q=2), limits=Limits(upper=1, acts=False))
    run = simulate(wheels(joints=limited, parameters={"u0": 0.5}), t_end=2, samples=201)
    assert [(event["element"], event["kind"]) for event in run.events] == [("B", "upper limit"), ("A", "upper limit")]
    assert run.events[1]["t"] == pytest.approx((2 * 0.5 * 2 / 7) ** 0.5, abs=0.01)
    assert "warning: joint A passes its upper limit at t = 0.54 s; nothing stops it there" in run_summary(run)
    assert "joint B starts beyond its upper limit, 1 rad" in check(wheels(joints=limited, parameters={"u0": 0.5})).hints
