"""Components along the axes of a named frame: those that are worked out by hand along the axes of its body."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError

_A, _F = 0.3, 3.0
_COS, _SIN = np.cos(_A), np.sin(_A)
_SLOPE = {"slope": mbs.Frame(rotate=[mbs.Turn("z", "a")])}


def _particle(**more: Any) -> mbs.System:
    """A particle of 2 kg that falls, where ground has a slope at the angle a."""
    joint = mbs.PointJoint("ground", "b", q=["x", "y"], initial={"u": [0, -1]})
    return mbs.System(
        "particle",
        gravity=[0, -9.81, 0],
        parameters={"a": _A, "F": _F, "I": 1.2},
        bodies={"ground": mbs.Body(frames=_SLOPE), "b": mbs.Body(mass=2)},
        joints={"J": joint},
        **more,
    )


def test_a_force_along_a_slope_has_the_components_of_the_book() -> None:
    """By hand: m x'' = F cos(a), m y'' = F sin(a) - m g."""
    pushed = _particle(forces={"P": mbs.Force(on="b", value=["F", 0, 0], frame="ground.slope")})
    told = mbs.solve(pushed).accelerations
    assert told["x"].value == pytest.approx(_F * _COS / 2, abs=1e-14)
    assert told["y"].value == pytest.approx(_F * _SIN / 2 - 9.81, abs=1e-14)
    assert str(told["x"]).startswith("F*cos(a)/2 = ")


def test_an_impulse_and_a_normal_are_along_the_axes_of_a_frame() -> None:
    """By hand: I/m along the slope; and u+ = u - (1 + e) (n . u) n for what strikes the slope, e = 1/2."""
    blow = mbs.solve(_particle(impact=mbs.Impact(impulse=["I", 0, 0], at="b", frame="ground.slope"))).impact
    assert blow is not None
    assert [blow.after[x].value for x in ("u_x", "u_y")] == pytest.approx([0.6 * _COS, 0.6 * _SIN - 1])
    strike = mbs.Impact(between=["b", "ground"], normal="y", restitution=0.5, frame="ground.slope")
    struck = mbs.solve(_particle(impact=strike)).impact
    assert struck is not None
    n = np.array([-_SIN, _COS])
    after = np.array([0, -1]) + 1.5 * _COS * n
    assert [struck.after[x].value for x in ("u_x", "u_y")] == pytest.approx(after.tolist())


def test_a_couple_turns_with_the_frame_of_a_body_that_turns() -> None:
    """By Euler's equations: J omega' = R c, c along a frame that is turned by R in the body."""
    leaning = {"nose": mbs.Frame(rotate=[mbs.Turn("x", 0.4), mbs.Turn("z", 0.7)])}
    system = mbs.System(
        "couple",
        bodies={"b": mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 2, "Izz": 3}, frames=leaning)},
        joints={"J": mbs.Spherical("ground", "b", initial={"q": [0.5, 0.5, 0.5, 0.5], "u": [0.1, 0.2, 0.3]})},
        forces={"c": mbs.Torque(on="b", value=[5, 6, 7], frame="b.nose")},
    )
    turn = np.array([[1, 0, 0], [0, np.cos(0.4), -np.sin(0.4)], [0, np.sin(0.4), np.cos(0.4)]])
    turn = turn @ np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])
    inertia, omega = np.diag([1.0, 2, 3]), np.array([0.1, 0.2, 0.3])
    expected = np.linalg.solve(inertia, turn @ [5, 6, 7] - np.cross(omega, inertia @ omega))
    found = mbs.compile(mbs.state_derivative(system))(0.0, [0.5, 0.5, 0.5, 0.5, 0.1, 0.2, 0.3])
    assert found[4:] == pytest.approx(expected.tolist(), abs=1e-13)


def test_a_nozzle_may_point_along_a_frame() -> None:
    """By Meshchersky: m v' = m' w, w = c along the frame, m' = -k."""
    mass = mbs.VariableMass("10 - 0.5*t", relative_velocity=[-4, 0, 0], frame="b.nozzle")
    system = mbs.System(
        "rocket",
        bodies={"b": mbs.Body(mass=mass, frames={"nozzle": mbs.Frame(rotate=[mbs.Turn("z", _A)])})},
        joints={"J": mbs.PointJoint("ground", "b", q=["x", "y"])},
    )
    found = mbs.compile(mbs.state_derivative(system))(0.0, [0.0] * 4)
    assert found[2:] == pytest.approx([0.2 * _COS, 0.2 * _SIN], abs=1e-15)


def test_an_unknown_frame_is_told_with_those_that_there_are() -> None:
    with pytest.raises(ModelError, match=r"no point or frame 'slop'; did you mean ground.slope\?") as caught:
        mbs.solve(_particle(forces={"P": mbs.Force(on="b", value=["F", 0, 0], frame="ground.slop")}))
    assert caught.value.where.path == ("forces", "P", "frame")
