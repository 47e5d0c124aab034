"""Runs through positions in which rows become dependent: the motion goes on as by hand, or the run stops by name."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from singular_mechanisms import MECHANISMS, Mechanism

import multibody_sym as mbs
from multibody_sym.errors import NoSolutionError
from multibody_sym.motion.prepare import problem
from multibody_sym.motion.runs.run import FailedRunError

NAMES = list(MECHANISMS)


def error(run: mbs.Trajectory, mechanism: Mechanism, phi: np.ndarray, drift: float = 1e-6) -> float:
    """Return how far a run's crank is from the motion by hand; what must follow the crank does so but for the drift."""
    assert np.isfinite(run.q).all()
    assert np.isfinite(run.u).all()
    branch = max(np.abs(run[name] - follow(run["phi"])).max() for name, follow in mechanism.others.items())
    assert branch < drift
    return float(np.abs(run["phi"] - phi[: len(run)]).max())


def crossings(mechanism: Mechanism, t: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Return when a motion by hand passes singular positions, between samples linearly."""
    side = mechanism.crossing(phi)
    k = np.flatnonzero(side[1:] * side[:-1] < 0)
    return t[k] + (t[k + 1] - t[k]) * side[k] / (side[k] - side[k + 1])


def passed(run: mbs.Trajectory) -> list[float]:
    return [event["t"] for event in run.events if event["kind"] == "singular position"]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-11])
def test_free_motion_in_weight_goes_on_along_its_branch(name: str, rtol: float) -> None:
    mechanism = MECHANISMS[name]
    run = mbs.simulate(mechanism.system(g=9.81), t_end=3, rtol=rtol, atol=rtol, samples=3001)
    phi = mechanism.by_hand(run.t, g=9.81)
    assert error(run, mechanism, phi) < 3e3 * rtol
    assert passed(run) == pytest.approx(crossings(mechanism, run.t, phi), abs=1e-5 + 1e3 * rtol)


METHODS = [
    ({"rtol": 1e-8, "atol": 1e-8}, 1e-5),
    ({"rtol": 1e-8, "atol": 1e-8, "constraints": "baumgarte"}, 1e-5),
    ({"method": "dormand_prince_8", "rtol": 1e-10, "atol": 1e-10}, 1e-7),
    ({"method": "rk4", "step": 0.005}, 1e-4),
    ({"method": "stoermer_6", "step": 0.005}, 1e-3),
    ({"method": "adams_bashforth_moulton", "step": 0.005}, 1e-3),
    ({"method": "gauss_4", "step": 0.005}, 1e-4),
    ({"method": "radau_5", "rtol": 1e-6, "atol": 1e-6}, 1e-3),
]


@pytest.mark.parametrize("name", NAMES[1:])
@pytest.mark.parametrize(("settings", "bound"), METHODS, ids=str)
def test_a_torque_drives_it_forth_and_back(name: str, settings: dict[str, object], bound: float) -> None:
    mechanism = MECHANISMS[name]
    side = "cos" if mechanism.crossing is np.cos else "-sin"
    run = mbs.simulate(mechanism.system(f"20*{side}(phi)", speed=0), t_end=4, samples=401, **settings)
    slope = np.cos if side == "cos" else lambda phi: -np.sin(phi)
    phi = mechanism.by_hand(run.t, lambda t, phi: 20 * slope(phi), speed=0)
    assert error(run, mechanism, phi) < bound
    assert len(passed(run)) == len(crossings(mechanism, run.t, phi)) >= 6


EVERY_METHOD = [
    *({"method": "dormand_prince", "rtol": 10.0**-k, "atol": 10.0**-k} for k in range(4, 12)),
    *({"method": "dormand_prince_8", "rtol": 10.0**-k, "atol": 10.0**-k} for k in range(4, 12)),
    *({"rtol": 10.0**-k, "atol": 10.0**-k, "constraints": "baumgarte"} for k in (5, 8, 11)),
    *({"method": "radau_5", "rtol": 10.0**-k, "atol": 10.0**-k} for k in (4, 6, 9)),
    *({"method": m, "step": 0.005} for m in ("rk4", "gauss_4", "gauss_6", "stoermer_6", "adams_bashforth_moulton")),
    *({"method": m, "step": 0.001} for m in ("heun", "midpoint", "implicit_midpoint", "trapezoid", "stoermer_verlet")),
]


def attempted(system: mbs.System, **settings: object) -> tuple[mbs.Trajectory, str]:
    """Return a run as far as it got, and why it got no further."""
    try:
        return mbs.simulate(system, **settings), ""
    except FailedRunError as failure:
        return failure.trajectory, str(failure)


CASES = [("0", 0.0, 3.0), ("0", 9.81, 8.0), ("swing", 0.0, 0.0), ("3*cos(3*t)", 9.81, 0.0)]


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_method_goes_on_along_the_branch_or_stops_by_name(name: str, case: tuple[str, float, float]) -> None:
    """Twenty times forth and back by torque; nothing is wrong unnoticed, and hardly any run stops."""
    mechanism, (torque, g, speed) = MECHANISMS[name], case
    side = "20*cos(phi)" if mechanism.crossing is np.cos else "-20*sin(phi)"
    system, stops = mechanism.system(side if torque == "swing" else torque, g=g, speed=speed), 0
    for settings in EVERY_METHOD:
        run, stop = attempted(system, t_end=20, samples=501, **settings)
        assert not stop or "singular position at t = " in stop
        stops += bool(stop)
        between = max(1e-6, settings.get("rtol", 0.0))  # a sample in a singular position stays as interpolated
        error(run, mechanism, run["phi"], drift=1e-3 if "constraints" in settings else between)
        if "constraints" not in settings and g == 0.0 and torque == "0":
            assert np.ptp(run.energy) < (0.3 if settings.get("rtol", 1.0) > 1e-6 else 0.02) * run.energy[0]
    assert stops <= 3


@pytest.mark.parametrize("name", NAMES)
def test_both_loops_step_across_alike(name: str) -> None:
    system = MECHANISMS[name].system(g=9.81)
    one, two = (mbs.simulate(system, t_end=1.5, rtol=1e-6, samples=31, backend=which) for which in ("c", "python"))
    assert np.abs(one.q - two.q).max() < 1e-6
    assert passed(one) == pytest.approx(passed(two), abs=1e-6)
    assert one.statistics["steps"] == pytest.approx(two.statistics["steps"], abs=2)


@pytest.mark.parametrize("name", NAMES)
def test_a_prescribed_motion_leads_through(name: str) -> None:
    mechanism = MECHANISMS[name]
    driven = "constraints:\n  turn: {type: motion, joint: A, value: start + speed*t}\n"
    run = mbs.simulate(mbs.loads(mbs.dumps(mechanism.system()) + driven), t_end=10, rtol=1e-7, samples=101)
    phi = 1.0 + 3.0 * run.t
    assert error(run, mechanism, phi) < 1e-9
    assert passed(run) == pytest.approx(crossings(mechanism, run.t, phi), abs=1e-2)


@pytest.mark.parametrize("name", NAMES)
def test_a_start_in_a_singular_position_is_refused_by_name(name: str) -> None:
    mechanism = MECHANISMS[name]
    system = mechanism.system(start="0" if mechanism.crossing is np.sin else "pi/2", speed=0)
    refused = r"the start is a singular position: .*choose one beside it"
    for method in ("dormand_prince", "radau_5", "BDF"):
        with pytest.raises(NoSolutionError, match=refused):
            mbs.simulate(system, t_end=1, method=method, backend="python")
    with pytest.raises(NoSolutionError, match=refused):
        mbs.linearize(system)
    assert "the start is a singular position" in mbs.check(system).failure


def test_windows_of_four_bars_swing_as_one_pendulum() -> None:
    """N = 2, cranks and couplers of 1 m and 1 kg, from upright with 1 m/s: where a coupler ends after 10 s is known."""
    bar = "{shape: {rod: 1, mass: 1}, points: {end: [1, 0, 0]}}"
    system = mbs.loads(f"""
multibody_sym: 1
name: windows
gravity: [0, -9.81, 0]
bodies:
  ground: {{points: {{p1: [1, 0, 0], p2: [2, 0, 0]}}}}
{"".join(f"  {body}: {bar}" + chr(10) for body in ("crank0", "crank1", "crank2", "coupler0", "coupler1"))}
joints:
  A0: {{type: revolute, parent: ground, child: crank0, axis: z, q: phi, initial: {{q: 90 deg, u: -1, known: true}}}}
  A1: {{type: revolute, parent: ground.p1, child: crank1, axis: z, initial: {{q: 90 deg}}}}
  A2: {{type: revolute, parent: ground.p2, child: crank2, axis: z, initial: {{q: 90 deg}}}}
  B0: {{type: revolute, parent: crank0.end, child: coupler0, axis: z, initial: {{q: -90 deg}}}}
  B1: {{type: revolute, parent: crank1.end, child: coupler1, axis: z, initial: {{q: -90 deg}}}}
  C0: {{type: revolute, parent: coupler0.end, child: crank1.end, axis: z, cut: true}}
  C1: {{type: revolute, parent: coupler1.end, child: crank2.end, axis: z, cut: true}}
outputs: {{x: "position(crank0.end, x)", y: "position(crank0.end, y)"}}
""")
    run = mbs.simulate(system, t_end=10, rtol=1e-11, atol=1e-11, samples=11)
    assert (run["x"][-1], run["y"][-1]) == pytest.approx((0.328458112, 0.944518538), abs=2e-8)
    assert len(passed(run)) == 10


LOCKED = r"J_1 and J_3 turn b about one axis there.*leave out angles: of joint J"


def turned_past_a_lock(beside: float, **more: object) -> mbs.System:
    """A ball that turns uniformly passes that position after 1 s, beside it by an angle."""
    turned, end = np.array([0.5, 1.0, 0.3]), Rotation.from_euler("XYZ", [0.3, np.pi / 2 - beside, 0.0])
    q = (Rotation.from_rotvec(-turned) * end).as_euler("XYZ")
    axes = [
        [1, 0, 0],
        Rotation.from_euler("X", q[0]).apply([0, 1, 0]),
        Rotation.from_euler("XY", q[:2]).apply([0, 0, 1]),
    ]
    joint = mbs.Spherical(
        "ground",
        "b",
        angles="xyz",
        initial={"q": q.tolist(), "u": np.linalg.solve(np.transpose(axes), turned).tolist()},
    )
    body = mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})
    return mbs.System("ball", bodies={"b": body}, joints={"J": joint}, **more)


def test_angles_whose_first_and_third_turn_about_one_axis_are_named() -> None:
    with pytest.raises(FailedRunError, match=LOCKED):
        mbs.simulate(turned_past_a_lock(1e-10), t_end=2, backend="python")


def test_a_damped_angle_that_locks_takes_all_steps_and_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """A torque follows its rate along a table with knots, at which nothing jumps."""
    monkeypatch.setattr(problem, "_MOST_STEPS", 20_000)
    system = turned_past_a_lock(
        1e-5,
        inputs={"w": {"table": [[-2, 0], [0, 0.1], [9, 1]], "of": "u_J_3"}},
        forces={
            "rub": {"type": "damper", "joint": "J", "freedom": "J_3", "damping": 20},
            "turn": {"type": "torque", "on": "b", "value": [0, 0, "w/100"]},
        },
    )
    with pytest.raises(FailedRunError, match=f"largest number of steps.*{LOCKED}"):
        mbs.simulate(system, t_end=2)


@pytest.mark.parametrize(("middle", "starts"), [(90, False), (89, True)])
def test_a_start_where_the_first_and_the_third_turn_about_one_axis_is_named(middle: float, starts: bool) -> None:
    """The inertia is there; beside that position, and with a quaternion in it, the same body starts."""
    box = mbs.Body(mass=2, inertia={"Ixx": 0.1, "Iyy": 0.2, "Izz": 0.3})
    begin = {"q": [0, 0, 0, 0, math.radians(middle), 0]}
    joint = mbs.Free("ground", "b", angles="xyz", q=["x", "y", "z", "a", "m", "c"], initial=begin)
    system = mbs.System("box", bodies={"b": box}, joints={"j": joint})
    if starts:
        assert mbs.check(system).failure is None
        return
    cause = "no inertia resists the speed u_a in this position: a and c turn b about one axis there"
    failure = mbs.check(system).failure or ""
    assert cause in failure
    assert "leave out angles: of joint j" in failure
    turned = {"q": [0, 0, 0, math.cos(math.pi / 4), 0, math.sin(math.pi / 4), 0]}
    free = mbs.Free("ground", "b", initial=turned)
    assert mbs.check(mbs.System("box", bodies={"b": box}, joints={"j": free})).failure is None
