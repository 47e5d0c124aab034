"""Angles of joints in space count whole turns in absolute coordinates, as in those of the joints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.model.joints import Joint

SHAFT = {"mass": 1, "inertia": {"Ixx": 0.3, "Iyy": 0.2, "Izz": 0.25}}


def shafts(
    name: str,
    count: int,
    joints: Mapping[str, Joint],
    ground: mbs.Body | None = None,
    outputs: Mapping[str, str] | None = None,
) -> mbs.System:
    """Return bodies b1 .. on joints, without gravity."""
    bodies = {"ground": ground or mbs.Body(), **{f"b{k + 1}": mbs.Body(**SHAFT) for k in range(count)}}
    return mbs.System(name, bodies=bodies, joints=joints, gravity=[0, 0, 0], outputs=outputs or {})


@pytest.mark.parametrize(("speed", "outputs"), [(5, {}), (-7.3, {}), (5, {"ang": "a"})])
def test_a_shaft_turns_on_whatever_names_its_angle(speed: float, outputs: Mapping[str, str]) -> None:
    """a = a0 + u t, at samples several turns apart too."""
    joint = mbs.Revolute("ground", "b1", axis="x", q="a", initial={"q": 9, "u": speed})
    system = shafts("shaft", 1, {"I": joint}, outputs=outputs)
    run = mbs.simulate(system, coordinates="absolute", t_end=6, samples=3, backend="python", rtol=1e-7)
    assert run["a"] == pytest.approx(9 + speed * run.t, abs=1e-4)
    assert run.final["coordinates"]["a"] == pytest.approx(9 + 6 * speed, abs=1e-4)
    assert run.table().columns["a"][-1] == run.as_json()["coordinates"]["a"][-1] == run["a"][-1]


def cardan() -> mbs.System:
    """Return two shafts half a radian askew, joined by a cross: c and d swing while a and b turn on."""
    joints = {
        "in": mbs.Revolute("ground", "b1", axis="x", q="a", initial={"u": -7, "known": True}),
        "cross": mbs.Universal("b1", "b2", axes=["y", "z"], q=["c", "d"], initial={"q": [0, 0.5]}),
        "out": mbs.Revolute("ground.askew", "b2", axis="x", q="b", cut=True),
    }
    askew = mbs.Body(frames={"askew": mbs.Frame(rotate=[mbs.Turn("z", 0.5)])})
    return shafts("cardan", 2, joints, ground=askew, outputs={"turned": "b"})


def gimbal() -> mbs.System:
    """Return a cross whose first angle turns on, and a top of three angles on it, the first and last of which do."""
    joints = {
        "cross": mbs.Universal("ground", "b1", axes=["x", "y"], q=["c", "d"], initial={"q": [-9, 0], "u": [-9, 0.1]}),
        "top": mbs.Spherical("b1", "b2", angles="zxz", q=["e", "f", "g"], initial={"q": [0, 1, 7], "u": [1, 0, 9]}),
    }
    return shafts("gimbal", 2, joints)


@pytest.mark.parametrize("system", [cardan(), gimbal()], ids=["cardan", "gimbal"])
def test_crosses_and_three_angles_count_turns_as_in_coordinates_of_joints(system: mbs.System) -> None:
    relative, absolute = (
        mbs.simulate(system, coordinates=which, t_end=2, samples=3, backend="python", rtol=1e-6)
        for which in ("relative", "absolute")
    )
    assert max(np.abs(x).max() for x in relative.coordinates.values()) > 4 * np.pi
    for name in (*relative.coordinates, *relative.speeds, *system.outputs):
        assert absolute[name] == pytest.approx(relative[name], abs=1e-3), name
