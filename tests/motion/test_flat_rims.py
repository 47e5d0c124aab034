"""Cups whose rim comes to lie flat on a plane: falls and times by closed forms and by a rocking body of our own."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError

G, R, H, M = 9.81, 0.05, 0.2, 0.3
INERTIA = M * (3 * R**2 + H**2) / 12
FLAT = r"the rim of cup lies flat on ground.face and touches all around.*name points of it.*or end the run before"


def cup(q: list[float], u: list[float] | None = None, slope: float = 0.0, **contact: Any) -> mbs.System:
    """Return a cup in axes of a plane of some slope (rad): its middle, and a quaternion or angles about x, y, z."""
    angles = {"angles": "xyz"} if len(q) == 6 else {}
    initial = mbs.Initial(q=q) if u is None else mbs.Initial(q=q, u=u)
    return mbs.System(
        "cup",
        gravity=[-G * math.sin(slope), 0, -G * math.cos(slope)],
        bodies={
            "ground": mbs.Body(surfaces={"face": {"plane": [0, 0, 0], "normal": "z"}}),
            "cup": mbs.Body(shape={"cylinder": [R, H], "mass": M}),
        },
        joints={"J": mbs.Free("ground", "cup", initial=initial, **angles)},
        contacts={"c": mbs.Contact(["cup", "ground.face"], **contact)},
    )


def rocked(tilt: float, height: float) -> tuple[float, float]:
    """Return when a cup dropped at a tilt lands, and when its rim lies flat if it sticks where it lands.

    It turns about the lowest point P: I_P tilt'' = -m g a, a = R cos - H/2 sin being how far P is beside the middle.
    """
    lands = math.sqrt(2 * (height - R * math.sin(tilt) - H / 2 * math.cos(tilt)) / G)
    about = INERTIA + M * (R**2 + H**2 / 4)

    def beside(angle: float) -> float:
        return R * math.cos(angle) - H / 2 * math.sin(angle)

    def flat(_: float, x: np.ndarray) -> float:
        return float(x[0])

    flat.terminal = True  # type: ignore[attr-defined]
    begun = [tilt, -M * G * lands * beside(tilt) / about]
    run = solve_ivp(lambda _, x: [x[1], -M * G * beside(x[0]) / about], (0, 1), begun, events=flat, rtol=1e-11)
    return lands, lands + float(run.t_events[0][0])


@pytest.mark.parametrize("contact", [{"static": 0.6}, {"static": 0.6, "restitution": 0.3}, {"restitution": 0.3}])
def test_upright_cup_falls_until_it_lands(contact: dict[str, Any]) -> None:
    """Each point of the rim is as near to the plane as any other: it has a gap all the same."""
    system = cup([0, 0, 0.3, 1, 0, 0, 0], open=True, **contact)
    run = mbs.simulate(system, t_end=0.1)
    assert run["J_z"][-1] == pytest.approx(0.3 - G * 0.1**2 / 2, abs=1e-12)
    with pytest.raises(FailedRunError, match=rf"c.rim1: {FLAT}.*at t = {math.sqrt(0.4 / G):.6g} s"):
        mbs.simulate(system, t_end=1)


@pytest.mark.parametrize("turned", [0.0, 10.0, 30.0, 40.0])
def test_cup_falls_along_a_turned_plane(turned: float) -> None:
    """In a plane whose normal is the axis but for rounding."""
    half = math.radians(turned) / 2
    n = [math.sin(2 * half), 0.0, math.cos(2 * half)]
    system = cup([0.3 * n[0], 0, 0.3 * n[2], math.cos(half), 0, math.sin(half), 0], open=True, static=0.6)
    bodies = {**system.bodies, "ground": mbs.Body(surfaces={"face": {"plane": [0, 0, 0], "normal": n}})}
    falling = mbs.System("turned", gravity=[-G * x for x in n], bodies=bodies, joints=system.joints,
                         contacts=system.contacts)  # fmt: skip
    with pytest.raises(FailedRunError, match=rf"{FLAT}.*at t = {math.sqrt(0.4 / G):.6g} s"):
        mbs.simulate(falling, t_end=1)


@pytest.mark.parametrize("form", ["angles", "quaternion"])
def test_tilted_cup_falls_flat(form: str) -> None:
    """It sticks where it lands, and turns about that point as a rocking body does until its rim lies flat."""
    x, y = 0.1, 0.02
    tilt = math.acos(math.cos(x) * math.cos(y))
    q = [0, 0, 0.2, x, y, 0]
    if form == "quaternion":
        tilt, (x, y) = 2 * math.asin(math.hypot(0.05, 0.01)), (0.05, 0.01)
        q = [0, 0, 0.2, math.sqrt(1 - x * x - y * y), x, y, 0]
    with pytest.raises(FailedRunError, match=FLAT) as told:
        mbs.simulate(cup(q, open=True, static=0.6), t_end=1)
    assert told.value.trajectory.t[-1] <= rocked(tilt, 0.2)[1]
    assert f"at t = {rocked(tilt, 0.2)[1]:.6g} s" in str(told.value)


def test_rolling_disc_falls_flat() -> None:
    """Its angles lock there as well, which others would not: the rim is why the run ends."""
    disc = {"ground": mbs.Body(surfaces={"face": {"plane": [0, 0, 0], "normal": "z"}}),
            "cup": mbs.Body(shape={"disc": R, "mass": M})}  # fmt: skip
    for angles, q in (("zxz", [0.1, 0.3, 0.3]), ("xyz", [0.3, 0.0, 0.0])):
        joint = mbs.Free("ground", "cup", angles=angles, initial=mbs.Initial(q=[0, 0, R * math.sin(0.3), *q]))
        roll = mbs.Rolling("cup", "ground.face")
        system = mbs.System("disc", gravity=[0, 0, -G], bodies=disc, joints={"J": joint}, constraints={"roll": roll})
        with pytest.raises(FailedRunError, match=FLAT):
            mbs.simulate(system, t_end=1)


def test_bounced_cup_falls_flat() -> None:
    with pytest.raises(FailedRunError, match=FLAT):
        mbs.simulate(cup([0, 0, 0.2, 0.1, 0.02, 0], open=True, static=0.6, restitution=0.2), t_end=1)


@pytest.mark.parametrize("spin", [0.003, 0.03])
def test_cup_that_spins_passes_by(spin: float) -> None:
    """It comes near to lying flat, its lowest point runs around the rim, and it rises: energy and spin are kept."""
    system = cup([0, 0, 0.2, 0.1, 0.02, 0], [0, 0, 0, 0, 0, spin], open=True, static=0.6)
    runs = [mbs.simulate(system, t_end=0.25, samples=5001, rtol=rtol, atol=rtol / 100) for rtol in (1e-8, 1e-10)]
    tilt = np.arccos(np.cos(runs[1]["J_1"]) * np.cos(runs[1]["J_2"]))
    assert 1e-5 < tilt.min() < 1e-3
    assert tilt[-1] > 0.05
    assert runs[0]["J_1"][-1] == pytest.approx(runs[1]["J_1"][-1], abs=1e-5)
    assert runs[1].energy[-1] == pytest.approx(runs[1].energy[3000], rel=1e-9)


@pytest.mark.parametrize("friction", [{"static": 0.6}, {}])
def test_cup_rises_from_next_to_flat(friction: dict[str, Any]) -> None:
    """What begins as near to lying flat as it comes goes on: by energy, about the point on which it stands."""
    tilt, speed = 5e-4, 2.0
    z, beside = H / 2 * math.cos(tilt) + R * math.sin(tilt), R * math.cos(tilt) - H / 2 * math.sin(tilt)
    u = [0, -speed * z, speed * beside, speed, 0, 0] if friction else [0, 0, speed * beside, speed, 0, 0]
    run = mbs.simulate(cup([0, 0, z, tilt, 0, 0], u, **friction), t_end=0.02)
    rose = M * G * (run["J_z"][-1] - z)
    rates = run["u_J_1"][-1], run["u_J_y"][-1], run["u_J_z"][-1]
    kinetic = (INERTIA * rates[0] ** 2 + M * (rates[1] ** 2 + rates[2] ** 2)) / 2
    first = (INERTIA * u[3] ** 2 + M * (u[1] ** 2 + u[2] ** 2)) / 2
    assert run["J_1"][-1] > 0.02
    assert kinetic + rose == pytest.approx(first, rel=1e-9)


@pytest.mark.parametrize("slope", [0.0, 10.0, 30.0, 40.0])
def test_flat_start_is_told_on_each_slope(slope: float) -> None:
    """Rounding turns the axis beside the normal; it told of a rim 0.05 m inside the plane."""
    al = math.radians(slope)
    face = {"face": {"plane": [0, 0, 0], "normal": ["sin(al)", 0, "cos(al)"]}}
    system = mbs.System(
        "slope",
        gravity=[0, 0, -G],
        parameters={"al": al},
        bodies={
            "ground": mbs.Body(frames={"s": {"rotate": [{"axis": "y", "angle": "al"}]}}, surfaces=face),
            "cup": mbs.Body(shape={"cylinder": [R, H], "mass": M}),
        },
        joints={"J": mbs.Free("ground.s", "cup", initial=mbs.Initial(q=[0, 0, H / 2, 1, 0, 0, 0]))},
        contacts={"c": mbs.Contact(["cup", "ground.face"], static=0.6)},
    )
    with pytest.raises(mbs.ModelError, match=r"the rim of cup lies flat on ground.face .*, or tilt it"):
        mbs.solve(system)


def test_cup_stands_on_three_points() -> None:
    """Points of the rim, as the error advises, land at once and stay."""
    system = cup([0, 0, 0.3, 1, 0, 0, 0], open=True, static=0.6)
    around = {k: 2 * math.pi * k / 3 for k in (1, 2, 3)}
    points = {f"p{k}": [R * math.cos(angle), R * math.sin(angle), -H / 2] for k, angle in around.items()}
    bodies = {**system.bodies, "cup": mbs.Body(shape={"cylinder": [R, H], "mass": M}, points=points)}
    feet = mbs.Contact(["cup.p#", "ground.face"], open=True, static=0.6, repeat=3)
    run = mbs.simulate(
        mbs.System("feet", gravity=[0, 0, -G], bodies=bodies, joints=system.joints, contacts={"c": feet}), t_end=0.5
    )
    assert run["J_z"][-1] == pytest.approx(H / 2, abs=1e-12)
