"""Bodies that walk, land, topple and fall onto each other, each against mechanics by hand."""

from __future__ import annotations

import importlib.util
import math
import re
from math import cos, pi, sin, sqrt
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root
from twins import EXAMPLES, from_file

import multibody_sym as mbs
from multibody_sym.analysis import equilibrium_search

Floats = NDArray[np.float64]
G = 9.81
LEGS = {"lf": (1, 1), "rf": (1, -1), "lh": (-1, 1), "rh": (-1, -1)}
"""To which side of the trunk along x and y."""


# --- the rimless wheel ------------------------------------------------------------------------------------------------

A, M, L, J = pi / 6, 2.0, 0.5, 0.1
ABOUT_FOOT = J + M * L**2
LEFT = (J + M * L**2 * cos(2 * A)) / ABOUT_FOOT


def over_the_spoke(w: float, slope: float) -> float | None:
    """Return the angular velocity before the next impact, None where the wheel falls back."""
    if ABOUT_FOOT * w**2 / 2 <= M * G * L * (1 - cos(A - slope)):
        return None
    return sqrt(w**2 + 4 * M * G * L * sin(A) * sin(slope) / ABOUT_FOOT)


def test_a_rimless_wheel_walks_from_impact_to_impact_as_momentum_and_energy_say() -> None:
    slope = 12 * pi / 180
    run = mbs.simulate(from_file("rimless_wheel"), rtol=1e-11, atol=1e-12, samples=5)
    strikes = [event for event in run.events if event["kind"] == "stick"]
    assert [event["element"] for event in strikes[:7]] == [f"foot{k}" for k in (2, 3, 4, 5, 6, 1, 2)]
    w = 2.0
    for strike in strikes:
        before = over_the_spoke(w, slope)
        assert before is not None
        w = LEFT * before
        assert strike["lost"] == pytest.approx(ABOUT_FOOT * (before**2 - w**2) / 2, rel=1e-9)
    steady = LEFT * sqrt(4 * M * G * L * sin(A) * sin(slope) / (ABOUT_FOOT * (1 - LEFT**2)))
    assert w == pytest.approx(steady, rel=1e-7)
    assert len(strikes) == 17


@pytest.mark.parametrize(("slope", "walks"), [(8.3, True), (7.9, False)])
def test_a_rimless_wheel_stands_where_it_is_too_shallow(slope: float, walks: bool) -> None:
    """Near the slope at which it just gets over a spoke; what it lost is then what it had, and what it came down."""
    angle = slope * pi / 180
    steady = LEFT * sqrt(4 * M * G * L * sin(A) * sin(angle) / (ABOUT_FOOT * (1 - LEFT**2)))
    assert (over_the_spoke(steady, angle) is not None) == walks
    run = mbs.simulate(from_file("rimless_wheel"), parameters={"gamma": angle}, t_end=15, samples=5)
    if walks:
        assert run.events[-1]["t"] > 12
        return
    assert set(run.final["speeds"].values()) == {0.0}
    gone = run["s"][-1]
    assert gone == pytest.approx(round(gone / L) * L, abs=1e-9)  # whole steps, of 2*l*sin(a) = l
    lost = sum(event["lost"] for event in run.events)
    assert lost == pytest.approx(ABOUT_FOOT * 2.0**2 / 2 + M * G * gone * sin(angle), rel=1e-9)


# --- the toppling rod -------------------------------------------------------------------------------------------------


def forces(phi: float, start: float) -> tuple[float, float]:
    """Return F to the left and N at the foot of a rod of 1 kg, 1 m before it slips, from two balances at its centre."""
    turning, rate = 1.5 * G * sin(phi), 3 * G * (cos(start) - cos(phi))  # phi'' and phi'^2
    return (turning * cos(phi) - rate * sin(phi)) / 2, G - (turning * sin(phi) + rate * cos(phi)) / 2


@pytest.mark.parametrize(("mu", "way"), [(0.3, "slide+"), (0.37, "slide+"), (0.3708, "slide-"), (0.6, "slide-")])
def test_the_foot_of_a_toppling_rod_slips(mu: float, way: str) -> None:
    """To the right with less friction than 15*sqrt(10)/128 = 0.3706, else to the left, at an angle from N and F."""
    system = from_file("toppling_rod")
    slips = mbs.solve(system, parameters={"mu": mu}).answers["slips_at"].value
    start = pi / 180

    def beyond(phi: float) -> float:
        F, N = forces(phi, start)
        return (F if way == "slide+" else -F) - mu * N

    between = (start, math.acos(9 / 11)) if way == "slide+" else (math.acos(9 / 11), math.acos(1 / 3) - 1e-3)
    assert slips == pytest.approx(brentq(beyond, *between, xtol=1e-14), rel=1e-8)
    run = mbs.simulate(system, parameters={"mu": mu}, samples=3)
    assert (run.events[0]["element"], run.events[0]["kind"]) == ("foot", way)


def test_a_toppling_rod_slides_on_and_lies_at_last() -> None:
    """Its foot slides to the left from 0.6 on: motion by hand until the rod lies, with N of the sliding foot."""
    mu = 0.6
    run = mbs.simulate(from_file("toppling_rod"), parameters={"mu": mu}, samples=3)
    slips, *_, lies = run.events
    slip_angle = mbs.solve(from_file("toppling_rod"), parameters={"mu": mu}).answers["slips_at"].value
    assert slip_angle is not None
    rate = sqrt(3 * G * (cos(pi / 180) - cos(slip_angle)))
    centre = -sin(slip_angle) / 2, -cos(slip_angle) / 2 * rate

    def rates(t: float, x: Floats) -> list[float]:
        _, v, phi, w = x
        s, c = sin(phi), cos(phi)  # y = c/2, and phi''/12 = N*s/2 + F*c/2 with F = mu*N to the right
        N = (G - w**2 * c / 2) / (1 + 3 * s * (s + mu * c))
        return [v, mu * N, w, 6 * N * (s + mu * c)]

    def level(t: float, x: Floats) -> float:
        return float(x[2]) - pi / 2

    level.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(rates, (0, 1), [*centre, slip_angle, rate], events=level, rtol=1e-11, atol=1e-12)
    assert lies["t"] - slips["t"] == pytest.approx(found.t[-1], rel=1e-7)
    assert run["x"][-1] == pytest.approx(found.y[0, -1], abs=1e-8)
    assert set(run.final["speeds"].values()) == {0.0}


# --- the robot --------------------------------------------------------------------------------------------------------

TRUNK, THIGH, SHANK, LINK, STIFF = 8.0, 0.7, 0.3, 0.2, 60.0
"""Masses, the length of a link and the stiffness of drives."""
HELD = {f"{kind}_{leg}": x * angle for leg, (x, _) in LEGS.items() for kind, angle in (("pitch", 0.6), ("knee", -1.2))}
"""Angles without load; those of rolling are zero."""


def turned(axis: int, angle: float) -> Floats:
    c, s = cos(angle), sin(angle)
    return np.array([[[1, 0, 0], [0, c, -s], [0, s, c]], [[c, 0, s], [0, 1, 0], [-s, 0, c]]][axis])


def crossing(v: Floats) -> Floats:
    """Return the matrix by which the cross product of v and another vector is taken."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def feet_and_energy(place: Floats, turn: Floats, angles: dict[str, float]) -> tuple[Floats, float]:
    """Return the places of the feet (12) and the potential energy of the robot, from vectors along its links."""
    energy, feet = TRUNK * G * place[2], []
    down = np.array([0, 0, -LINK])
    for leg, (x, y) in LEGS.items():
        hip = place + turn @ [0.2 * x, 0.1 * y, 0]
        thigh = turn @ turned(0, angles[f"roll_{leg}"]) @ turned(1, angles[f"pitch_{leg}"])
        shank = thigh @ turned(1, angles[f"knee_{leg}"])
        knee = hip + thigh @ down
        energy += G * (THIGH * (hip + knee)[2] / 2 + SHANK * (knee + shank @ down / 2)[2])
        feet.append(knee + shank @ down)
    energy += sum(STIFF * (angle - HELD.get(name, 0.0)) ** 2 / 2 for name, angle in angles.items())
    return np.concatenate(feet), float(energy)


def slopes(run: mbs.Trajectory) -> tuple[Floats, Floats]:
    """Return how energy (18) and feet (12, 18) change as the trunk moves, turns, and as each joint does, at the end."""
    final = run.final["coordinates"]
    place = np.array([final[x] for x in "xyz"])
    e0, *e = (final[f"e{k}"] for k in range(4))
    across = crossing(np.array(e))
    turn = np.eye(3) + 2 * e0 * across + 2 * across @ across
    angles = {f"{kind}_{leg}": final[f"{kind}_{leg}"] for leg in LEGS for kind in ("roll", "pitch", "knee")}
    step = 1e-5

    def at(k: int, d: float) -> tuple[Floats, float]:
        if k < 3:
            return feet_and_energy(place + d * np.eye(3)[k], turn, angles)
        if k < 6:
            turning = crossing(d * np.eye(3)[k - 3])
            return feet_and_energy(place, (np.eye(3) + turning + turning @ turning / 2) @ turn, angles)
        name = list(angles)[k - 6]
        return feet_and_energy(place, turn, {**angles, name: angles[name] + d})

    both = [(at(k, step), at(k, -step)) for k in range(18)]
    energy = np.array([(more[1] - less[1]) / (2 * step) for more, less in both])
    return energy, np.array([(more[0] - less[0]) / (2 * step) for more, less in both]).T


def carried(run: mbs.Trajectory) -> Floats:
    return np.array([run[f"carried_{leg}"][-1] for leg in LEGS])


def test_a_level_robot_lands_on_four_feet_and_stands() -> None:
    """What strikes leaves one freedom, the bending of all legs; at rest its one balance of moments."""
    run = mbs.simulate(from_file("robot_on_feet"), t_end=4, samples=3)
    assert {event["kind"] for event in run.events} == {"stick"}
    assert [event["t"] for event in run.events] == pytest.approx([sqrt(2 * 0.05 / G)] * 4, rel=1e-9)
    quarter, s, c = TRUNK / 4, sin(0.6), cos(0.6)
    speed = sqrt(2 * G * 0.05)
    momentum = speed * LINK * s * (2 * quarter + 1.5 * THIGH + 0.5 * SHANK)
    inertia = quarter * 4 * s**2 + THIGH * (c**2 / 4 + 9 / 4 * s**2 + 1 / 12) + SHANK * (1 / 4 + 1 / 12)
    lost = (quarter + THIGH + SHANK) * speed**2 / 2 - momentum**2 / (2 * inertia * LINK**2)
    assert [event["lost"] for event in run.events] == pytest.approx([lost] * 4, rel=1e-9)
    weight = G * LINK * (2 * quarter + 1.5 * THIGH + 0.5 * SHANK)
    p = brentq(lambda p: 5 * STIFF * (p - 0.6) - weight * sin(p), 0.6, 1.0, xtol=1e-14)
    assert run["z"][-1] == pytest.approx(2 * LINK * cos(p), abs=1e-8)
    assert carried(run) == pytest.approx(np.full(4, 3 * G), rel=1e-7)
    assert run.energy_residual == pytest.approx(0, abs=1e-7)


def test_a_tilted_robot_comes_to_stand_where_virtual_work_says() -> None:
    """Feet land one by one and slip; at rest no motion that keeps them in place changes the energy."""
    tilt = {"e0": cos(0.1), "e1": sin(0.1), "z": 0.45}
    run = mbs.simulate(from_file("robot_on_feet"), initial=tilt, t_end=6, samples=3)
    assert any(event["kind"] == "slide" for event in run.events)
    energy, feet = slopes(run)
    pushes, *_ = np.linalg.lstsq(feet.T, energy, rcond=None)
    assert np.abs(feet.T @ pushes - energy).max() < 1e-5 * np.abs(energy).max()
    assert carried(run) == pytest.approx(pushes[2::3], rel=1e-5)
    assert carried(run).sum() == pytest.approx(12 * G, rel=1e-7)
    assert (np.hypot(pushes[::3], pushes[1::3]) <= 0.7 * pushes[2::3] * (1 + 1e-6)).all()


def test_a_robot_above_the_floor_stands_on_all_feet_in_little_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """Feet without friction only carry; thighs at p, shanks at s to the vertical balance moments about hip and knee."""
    monkeypatch.setattr(equilibrium_search, "SECONDS", 2.0)
    found = mbs.equilibrium(from_file("robot_on_feet"))
    above_knee, above_foot = TRUNK / 4 + THIGH / 2, TRUNK / 4 + THIGH + SHANK / 2

    def moments(angles: Floats) -> list[float]:
        p, s = angles
        knee = STIFF * (p + s - 1.2)
        return [STIFF * (p - 0.6) + knee - G * LINK * above_knee * sin(p), knee - G * LINK * above_foot * sin(s)]

    p, s = root(moments, [0.6, 0.6], tol=1e-13).x
    (place,), (closed,) = found.positions, found.closed
    assert closed == {f"foot_{leg}": "closed" for leg in LEGS}
    assert place["z"] == pytest.approx(LINK * (cos(p) + cos(s)), abs=1e-10)
    for leg, (ahead, _) in LEGS.items():
        angles = [place[f"{joint}_{leg}"] for joint in ("roll", "pitch", "knee")]
        assert angles == pytest.approx([0, ahead * p, -ahead * (p + s)], abs=1e-10)


# --- the box ----------------------------------------------------------------------------------------------------------


def example(name: str) -> ModuleType:
    """Return an example as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"feet/{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def box() -> ModuleType:
    """The box of a few discs."""
    return example("box_of_discs")


def test_a_heap_of_discs_comes_to_rest_by_steps(capsys: pytest.CaptureFixture[str]) -> None:
    """Two rows of the example: what it prints of overlap and of the energy account."""
    example("heap_of_discs").main(20)
    told = capsys.readouterr().out
    assert "20 discs, 250 contacts: 2000 steps" in told
    (overlap, speed), (missed,) = (
        [float(x) for x in re.findall(r"-?\d\.\de[+-]\d\d", line)] for line in told.splitlines()[1::2]
    )
    assert overlap < 1e-9
    assert speed < 1e-5
    assert abs(missed) < 5e-3


@pytest.mark.long
def test_a_heap_rests_once_its_energy_lifts_nothing_higher_than_the_tolerance(box: ModuleType) -> None:
    """Thirteen contacts and more rest at once; what they carry and what their positions show is exact then, too."""
    count, columns = 8, 4
    run = mbs.simulate(box.box_of_discs(count, columns), t_end=1.5, samples=21, rtol=1e-5)
    assert any(event["kind"] == "collapse" for event in run.events)
    assert set(run.final["speeds"].values()) == {0.0}
    assert max(box.overlap(each, columns) for each in run.q.reshape(-1, count, 3)) < 1e-9
    weight = count * box.MASS * box.GRAVITY
    assert run["held_up"][-1] == pytest.approx(weight, rel=1e-9)
    assert run["pushed_right"][-1] == pytest.approx(0.0, abs=1e-9 * weight)
    assert (np.diff(run.energy) <= 1e-6 * run.energy[0]).all()


def test_discs_in_a_box_come_to_rest_on_its_floor_and_each_other(
    box: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Balances of force and of energy hold for all discs together, whatever carries each."""
    monkeypatch.setattr("multibody_sym.motion.loop.integrate.SECONDS", 0.0)
    count, columns, come = 5, 3, list[float]()
    system = box.box_of_discs(count, columns)
    run = mbs.simulate(system, t_end=1.5, samples=21, on_progress=lambda _, part: come.append(part))
    assert sum(0.2 < part < 0.5 for part in come) > 3  # while impacts are decided, too
    assert come == sorted(come)
    assert set(run.final["speeds"].values()) == {0.0}
    assert any(event["element"].startswith("pair") for event in run.events)
    places = run.q.reshape(-1, count, 3)
    assert max(box.overlap(each, columns) for each in places) < 1e-9
    weight = count * box.MASS * box.GRAVITY
    assert run["held_up"][-1] == pytest.approx(weight, rel=1e-9)
    assert run["pushed_right"][-1] == pytest.approx(0.0, abs=1e-9 * weight)
    fallen = float((places[0, :, 1] - places[-1, :, 1]).sum()) * box.MASS * box.GRAVITY
    taken = sum(event.get("lost", 0.0) for event in run.events)
    taken -= sum(work.total for work in run.friction_work.values())
    assert taken == pytest.approx(fallen, rel=1e-8)
