"""Every method by name: a pendulum and a body on a ball joint, against elliptic functions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exact_motions import FREE_BODY, free_rotation
from scipy.special import ellipj, ellipk

import multibody_sym as mbs
from multibody_sym.errors import ModelError
from multibody_sym.motion.methods.table import AUTO, METHODS, MOREAU, SUMMARIES, SUNDIALS, LibraryMethod

PENDULUM = """
multibody_sym: 1
name: pendulum
gravity: [0, -1, 0]
bodies: {bob: {mass: 1, com: [0, -1, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 2}}}
"""
ROD = PENDULUM.replace("bob: {mass: 1, com: [0, -1, 0]}", "bob: {mass: 1}").partition("joints:")[0] + """
joints:
  x: {type: prismatic, parent: ground, child: slide, axis: x, q: x, initial: {q: sin(2), known: true}}
  y: {type: prismatic, parent: slide, child: bob, axis: y, q: y, initial: {q: -cos(2)}}
constraints: {rod: {type: distance, between: [bob, ground], value: 1}}
"""
ROD = ROD.replace("bodies: {", "bodies: {slide: {}, ")

SMOOTH = [name for name in SUMMARIES if name not in (AUTO, MOREAU)]
"""Those of smooth motions, without the default, which is one of them; contacts have tests of their own."""


def settings(name: str) -> dict[str, Any]:
    """Return settings for an error of a few millionths, if the order allows it."""
    method = METHODS[name]
    if isinstance(method, LibraryMethod) and method.package == SUNDIALS:
        pytest.importorskip("sksundae")
    if isinstance(method, LibraryMethod):
        return {"method": name, "rtol": 1e-8, "atol": 1e-8}
    if method.error_order:
        return {"method": name, "rtol": 1e-9, "atol": 1e-9}
    return {"method": name, "step": {1: 5e-5, 2: 1e-3}.get(method.order, 1e-2)}


def tolerance(name: str) -> float:
    if METHODS[name].order == 1:
        return 5e-4
    return 2e-5 if isinstance(METHODS[name], LibraryMethod) else 2e-6


def angle(t: Any) -> Any:
    k = np.sin(1.0)
    return 2 * np.arcsin(k * ellipj(ellipk(k * k) - t, k * k)[0])


@pytest.mark.parametrize("name", SMOOTH)
def test_a_pendulum(name: str) -> None:
    run = mbs.simulate(mbs.loads(PENDULUM), t_end=5, samples=51, **settings(name))
    assert len(run) == 51
    assert np.abs(run["theta"] - angle(run.t)).max() < tolerance(name)


@pytest.mark.parametrize("name", SMOOTH)
def test_a_body_on_a_ball(name: str) -> None:
    run = mbs.simulate(mbs.loads(FREE_BODY), t_end=2, samples=21, **settings(name))
    exact = free_rotation(1, 2, 3, 1, 0.7, run.t)
    assert np.abs(np.array([run[f"ball_w{axis}"] for axis in "xyz"]) - exact).max() < tolerance(name)
    quaternions = np.array([run[f"ball_q{letter}"] for letter in "wxyz"])
    assert np.abs(np.sum(quaternions**2, axis=0) - 1).max() < 1e-12
    momentum = np.array([A * w for A, w in zip((1, 2, 3), exact, strict=True)])
    turned = rotated(quaternions, momentum)
    assert np.abs(turned - turned[:, :1]).max() < 10 * tolerance(name)


def rotated(q: Any, v: Any) -> Any:
    w, axis = q[0], q[1:]
    first = np.cross(axis, v, axis=0)
    return v + 2 * (w * first + np.cross(axis, first, axis=0))


@pytest.mark.parametrize("name", SMOOTH)
def test_a_constraint(name: str) -> None:
    """A bob on a rod, in x and y: put back onto it after each step; other libraries stabilise it, or take it along."""
    run = mbs.simulate(mbs.loads(ROD), t_end=2, samples=21, **settings(name))
    assert np.abs(np.arctan2(run["x"], -run["y"]) - angle(run.t)).max() < 10 * tolerance(name)
    if name == "ida":
        assert run.statistics["index_2"]
        assert run.drift["position"] < 1e-7
    elif isinstance(METHODS[name], LibraryMethod):
        assert run.baumgarte is not None
        assert run.baumgarte["alpha"] > 0
    else:
        assert run.drift["position"] < 1e-12


@pytest.mark.parametrize("constraints", ["projection", "baumgarte"])
@pytest.mark.parametrize("name", [name for name in SMOOTH if not isinstance(METHODS[name], LibraryMethod)])
def test_either_stabilisation_in_either_loop(name: str, constraints: str) -> None:
    """The constraint holds by either, and C and Python take the same steps."""
    near = 1e-2 if METHODS[name].order == 1 else 1e-4
    how = settings(name) | ({"rtol": near / 100, "atol": near / 100} if METHODS[name].error_order else {"step": 0.01})
    runs = [
        mbs.simulate(mbs.loads(ROD), t_end=0.4, samples=5, constraints=constraints, backend=backend, **how)
        for backend in ("c", "python")
    ]
    for run in runs:
        assert np.abs(np.arctan2(run["x"], -run["y"]) - angle(run.t)).max() < near
        assert run.drift["position"] < (1e-12 if constraints == "projection" else near / 10)
    assert runs[0].statistics["steps"] == runs[1].statistics["steps"]
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("name", [name for name, method in METHODS.items() if isinstance(method, LibraryMethod)])
def test_what_another_library_cannot_do_is_said(name: str) -> None:
    with pytest.raises(ModelError, match="chooses its steps; give rtol and atol"):
        mbs.simulate(mbs.loads(PENDULUM), method=name, step=0.1)
    with pytest.raises(ModelError, match="cannot be put back onto constraints"):
        mbs.simulate(mbs.loads(ROD), method=name, constraints="projection")


@pytest.mark.parametrize("name", [*SMOOTH, MOREAU])
def test_the_table_says_what_the_records_say(name: str) -> None:
    method, words = METHODS[name], SUMMARIES[name]
    assert method.name == name
    assert ("fixed step" in words) == (method.error_order == 0)
    assert "order" in words or name == "LSODA"


def test_the_guide_lists_every_method() -> None:
    readme = (Path(__file__).parents[2] / "docs" / "guide" / "methods.md").read_text()
    assert [name for name in SUMMARIES if f"`{name}`" not in readme] == []
