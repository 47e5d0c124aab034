"""Multipliers of least norm: by another route, and loads shared in equal parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics, in_floats, least_multipliers
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.motion import state_of
from multibody_sym.scalars.least_norm import solve

BACKENDS = ["c", "python"]


@pytest.mark.parametrize("seed", range(20))
def test_shared_multipliers_are_those_of_the_pseudo_inverse(seed: int) -> None:
    rng = np.random.default_rng(seed)
    independent = rng.normal(size=(3, 6)) * 10.0 ** rng.uniform(-3, 3, size=(3, 1))
    matrix = np.vstack([independent, rng.normal(size=(2, 3)) @ independent])
    lengths = np.linalg.norm(matrix, axis=1)
    x = independent.T @ rng.normal(size=3)
    scaled = np.linalg.pinv((matrix / lengths[:, None]).T, rcond=1e-10) @ x
    found = np.array(least_multipliers(matrix, x, in_floats)) * lengths
    assert found == pytest.approx(scaled, rel=1e-9, abs=1e-9 * np.abs(scaled).max())


def test_independent_rows_leave_nothing_to_share() -> None:
    matrix, right = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 3.0]]), np.array([1.0, -2.0])
    found = solve(matrix, right)
    assert np.array(least_multipliers(matrix, found.solution, in_floats)) == pytest.approx(found.multipliers, rel=1e-14)


def door(multipliers: str, coordinates: str = "absolute") -> mbs.System:
    """A door on two equal hinges, its centre of mass halfway between them."""
    points = {"low": [0, 0, 0.2], "high": [0, 0, 1.8]}
    leaf = mbs.Body(mass=20, com=[0.4, 0, 1], inertia={"Ixx": 7, "Iyy": 8, "Izz": 2}, points=points)
    hinges = {name: mbs.Revolute(f"ground.{name}", f"door.{name}", axis="z") for name in points}
    return mbs.System(
        "door",
        gravity=[0, 0, -10],
        bodies={"door": leaf, "ground": mbs.Body(points=points)},
        joints={name: replace(hinge, initial=mbs.Initial(q=0, u=1)) for name, hinge in hinges.items()},
        simulation={"multipliers": multipliers, "coordinates": coordinates, "step": 0.01, "method": "rk4"},
    )


@pytest.mark.parametrize("backend", BACKENDS)
def test_two_equal_hinges_share_the_weight_of_a_door(backend: str) -> None:
    run = mbs.simulate(door("minimum_norm"), t_end=0.1, samples=3, backend=backend)
    (low, high) = ({c: float(x[0]) for c, x in run.reactions[name].items()} for name in ("low", "high"))
    half = 20 * 0.4 * 1**2 / 2  # what keeps the centre of mass on its circle
    assert low["fx"] + half == pytest.approx(-(high["fx"] + half))
    assert (low["fz"], high["fz"]) == pytest.approx((100, 100))
    assert low["my"] == pytest.approx(high["my"])
    assert [low[c] for c in ("fy", "mx", "mz")] == pytest.approx([0, 0, 0], abs=1e-9)
    assert 0.8 * (high["fx"] - low["fx"]) + 2 * low["my"] == pytest.approx(-20 * 10 * 0.4)


def test_a_joint_of_the_tree_takes_what_rows_leave() -> None:
    """In relative coordinates the second hinge holds what nothing could move, and carries nothing."""
    run = mbs.simulate(door("minimum_norm", "relative"), t_end=0.1, samples=3)
    assert run.reactions["low"]["fz"] == pytest.approx(np.full(3, 200.0))
    assert run.reactions["high"]["fz"] == pytest.approx(np.zeros(3))


def test_what_is_shared_moves_nothing_and_is_the_same_everywhere() -> None:
    runs = [mbs.simulate(door(m), t_end=0.1, samples=3, backend=b) for m in ("basic", "minimum_norm") for b in BACKENDS]
    for run in runs[1:]:
        np.testing.assert_allclose(run.q, runs[0].q, atol=1e-13)
    in_c, in_python = (np.array(list(run.multipliers.values())) for run in runs[2:])
    np.testing.assert_allclose(in_c, in_python, rtol=1e-11, atol=1e-10)
    resolved = mbs.mechanism(door("minimum_norm"))
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(composite_body(resolved, state), minimum_norm=True).multipliers
    np.testing.assert_allclose(found, in_c[:, 0], rtol=1e-11, atol=1e-10)
    assert np.linalg.norm(runs[0].reactions["low"]["fz"]) == pytest.approx(200 * np.sqrt(3)), "basic: one carries all"


def test_outer_rods_of_three_share_equally() -> None:
    system = mbs.System(
        "platform",
        gravity=[0, -10, 0],
        bodies={
            "plate": mbs.Body(mass=3, inertia={"Izz": 2}, points={f"r{k + 1}": [k, 0, 0] for k in (-1, 0, 1)}),
            "ground": mbs.Body(points={f"r{k + 1}": [k, 2, 0] for k in (-1, 0, 1)}),
        },
        joints={"j": mbs.Planar("ground", "plate")},
        constraints={f"rod{k}": mbs.Distance([f"ground.r{k}", f"plate.r{k}"], 2) for k in range(3)},
        simulation={"multipliers": "minimum_norm"},
    )
    tension = mbs.simulate(system, t_end=0.1, samples=2).multipliers
    weights = np.sqrt([1 / 3 + 1 / 2, 1 / 3, 1 / 3 + 1 / 2])  # lengths of the rows: rods lift and turn the plate
    forces = np.linalg.pinv(np.array([[1, 1, 1], [-1, 0, 1]]) / weights) @ [30, 0] / weights
    assert [float(tension[f"rod{k}"][0]) for k in range(3)] == pytest.approx(forces, rel=1e-12)
    assert forces[0] == pytest.approx(forces[2])


def test_a_word_that_is_no_choice() -> None:
    with pytest.raises(ModelError, match="minimum_norm"):
        mbs.System("s", simulation={"multipliers": "minimum_nrom"})
