"""What a run shows that no real mechanism does is told, with its time; ordinary runs from rest tell nothing."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import check
from multibody_sym.documents.runs import run_summary

MASS = {"type": "prismatic", "parent": "ground", "child": "b", "axis": "x"}


def mass(*, rest: bool = False, **changes: Any) -> mbs.System:
    """Return a mass of 1 kg on a straight track, 1 m from 0 unless it rests there."""
    joints = {"j": {**MASS, "q": "x", "initial": {"q": 0 if rest else 1}}}
    return mbs.System("m", **{"bodies": {"b": {"mass": 1}}, "joints": joints, **changes})


def spring(stiffness: object = 100, damping: object = 0) -> dict[str, Any]:
    return {"s": {"type": "spring_damper", "joint": "j", "stiffness": stiffness, "damping": damping}}


def run(system: mbs.System, **settings: Any) -> mbs.Trajectory:
    return mbs.simulate(system, backend="python", **settings)


def oddities(found: mbs.Trajectory) -> list[tuple[str, str]]:
    return [(event["kind"], event["element"]) for event in found.events]


# --- outputs -------------------------------------------------------------------------------------------------------


def test_an_output_without_value_is_told_with_its_first_time() -> None:
    found = run(mass(outputs={"good": "x", "gone": "sqrt(1.5 - t)"}), t_end=2, samples=5)
    assert found.events == [{"t": 2.0, "kind": "no value", "element": "gone"}]
    assert "warning: output gone has no finite value, at t = 2 s for the first time" in run_summary(found)
    assert json.loads(json.dumps(found.as_json(), allow_nan=False))["events"] == found.events


# --- wheels --------------------------------------------------------------------------------------------------------


def wheel(lift: str, gravity: float = -9.81) -> mbs.System:
    """Return a disc of 2 kg that rolls on level ground with a force upwards at its centre."""
    return mbs.System(
        "w",
        gravity=[0, gravity, 0],
        bodies={
            "ground": {"surfaces": {"floor": {"plane": [0, 0, 0], "normal": "y"}}},
            "wheel": {"mass": 2, "inertia": {"Izz": 0.04}, "surfaces": {"rim": {"disc": 0.2, "axis": "z"}}},
        },
        joints={
            "j": {"type": "planar", "parent": "ground", "child": "wheel", "q": ["x", "y", "th"],
                  "initial": {"q": [0, 0.2, 0], "u": [1, 0, -5]}},
        },
        forces={"up": {"type": "force", "on": "wheel", "value": [0, lift, 0]}},
        constraints={"roll": {"type": "rolling", "body": "wheel.rim", "on": "ground.floor"}},
    )


def test_a_wheel_that_its_plane_would_hold_back_is_told_from_its_lift_off_on() -> None:
    found = run(wheel("19.62 + 10*(t - 0.55)"), t_end=1, samples=11)
    assert found.events == [{"t": pytest.approx(0.6), "kind": "wheel would pull", "element": "roll.n"}]
    assert "warning: from t = 0.6 s on multiplier(roll.n) is negative: the plane" in run_summary(found)


@pytest.mark.parametrize(("lift", "gravity"), [("19", -9.81), ("0", 0.0), ("19.62", -9.81)])
def test_a_wheel_that_stays_or_floats_is_not_told(lift: str, gravity: float) -> None:
    assert oddities(run(wheel(lift, gravity), t_end=0.5, samples=6)) == []


def test_a_wheel_pulled_at_the_start_is_a_hint_of_check_and_a_failed_condition_of_solve() -> None:
    hint = "multiplier(roll.n) is -0.38 N at the start: the plane would have to pull, and a real wheel lifts off"
    assert hint in check(wheel("20")).hints
    assert not any("lifts off" in each for each in check(wheel("19")).hints)
    told = "multiplier(roll.n) >= 0 fails: the plane would pull; in truth the wheel lifts off"
    assert told in mbs.solve(wheel("20")).conditions
    assert not any("roll.n" in each for each in mbs.solve(wheel("19")).conditions)


# --- coordinates past what floats tell apart ------------------------------------------------------------------------


@pytest.mark.parametrize("far", [1e17, 1e300])
def test_a_coordinate_that_moves_by_less_than_its_spacing_is_told(far: float) -> None:
    found = run(mass(), initial={"x": far, "u_x": 3.0}, t_end=1, samples=5)
    assert found["x"][-1] == far  # though it moves at 3 m/s
    assert found.events == [{"t": 0.0, "kind": "too far for its steps", "element": "x"}]
    assert "warning: coordinate x is so large, from t = 0 s on, that it moves by less" in run_summary(found)


@pytest.mark.parametrize(("far", "speed"), [(1e17, 0.0), (1e9, 3.0), (0.0, 1e-300)])
def test_a_coordinate_that_rests_or_moves_by_more_than_its_spacing_is_not_told(far: float, speed: float) -> None:
    assert oddities(run(mass(), initial={"x": far, "u_x": speed}, t_end=1, samples=5)) == []


# --- energy --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("system", [mass(forces=spring(100)), mass(forces=spring(100, 0.2))])
def test_energy_that_a_coarse_step_makes_is_told(system: mbs.System) -> None:
    found = run(system, t_end=20, method="rk4", step=0.3, samples=201)
    assert found.energy[-1] > 1e5 * found.energy[0]
    assert oddities(found) == [("energy grows", "total energy")]
    assert found.events[0]["t"] < 5
    assert "the energy grows from nowhere" in run_summary(found)


def test_energy_that_a_negative_damper_gives_is_told_when_it_is_a_tenth_of_the_largest() -> None:
    found = run(mass(forces=spring(100, -2)), t_end=8, samples=801)
    assert oddities(found) == [("energy grows", "total energy")]
    assert found.events[0]["t"] < math.pi / 10


def test_energy_that_grows_1e5_times_where_forces_do_work_is_told() -> None:
    pushed = {**spring(1), "f": {"type": "torque", "joint": "j", "value": "3*u_x"}}
    assert oddities(run(mass(forces=pushed), t_end=12, samples=121)) == [("energy grows", "total energy")]


FAR = {"j": {**MASS, "q": "x", "initial": {"q": 1e6}}}
ORDINARY = {
    "spring from rest": (mass(forces=spring(100)), {}),
    "spring at rest": (mass(rest=True, forces=spring(100, 1)), {}),
    "unstable spring from rest": (mass(forces=spring(-100)), {}),
    "rocket from rest": (mass(rest=True, forces={"f": {"type": "torque", "joint": "j", "value": 1e6}}), {}),
    "ramp from rest": (mass(rest=True, forces={"f": {"type": "torque", "joint": "j", "value": "1e6*t^2"}}), {}),
    "pushed late": (mass(rest=True, forces={"f": {"type": "torque", "joint": "j", "value": "where(t > 2, 9, 0)"}}), {}),
    "prescribed": (mass(joints={"j": {**MASS, "motion": "t^3"}}), {}),
    "fall from rest": (mass(rest=True, gravity=[9.81, 0, 0]), {}),
    "fall far from the origin": (mass(gravity=[9.81, 0, 0], joints=FAR), {}),
    "loose": (mass(forces=spring(100)), {"rtol": 1e-3, "atol": 1e-3}),
    "samples closer than steps": (mass(gravity=[9.81, 0, 0], forces=spring(100)), {"samples": 20001}),
}


@pytest.mark.parametrize("name", ORDINARY)
def test_ordinary_runs_tell_nothing(name: str) -> None:
    system, settings = ORDINARY[name]
    assert oddities(run(system, **{"t_end": 3, "samples": 31, **settings})) == []
