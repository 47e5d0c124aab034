"""Aligned mechanisms move as the declared ones do, and their joints turn about coordinate axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.analysis.check import LARGEST_ON_TREES, LARGEST_WITH_ROWS, compare_formalisms
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.mechanics.alignment import align_bodies
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.motion import motion_of
from multibody_sym.mechanics.points import position, velocity
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, Frame, Turn
from multibody_sym.model.joints import Fixed, Prismatic, Revolute
from multibody_sym.model.system import System


@pytest.mark.parametrize("seed", range(40))
def test_points_and_energies_are_those_declared(seed: int) -> None:
    case = random_case(seed, bodies=(1, 6))
    state = case.state(*random_state(np.random.default_rng(seed), case))
    declared = motion_of(case.mechanism, state)
    moved = motion_of(align_bodies(case.mechanism), state)
    for name, marker in case.mechanism.markers.items():
        same = moved.mechanism.markers[name]
        for of_point in (position, velocity):
            np.testing.assert_allclose(
                np.array(of_point(moved, same), dtype=float),
                np.array(of_point(declared, marker), dtype=float),
                atol=1e-11,
            )
    for energy in (kinetic_energy, potential_energy):
        assert float(energy(moved)) == pytest.approx(float(energy(declared)), rel=1e-10, abs=1e-9)


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("block", range(4))
def test_accelerations_and_multipliers_are_those_declared(block: int, rows: bool) -> None:
    routes = {
        name: lambda system, state, route=FORMALISMS[name]: route(align_bodies(system), state)
        for name in ("composite_body", "block_ldl")
    }
    for seed in range(8 * block, 8 * block + 8):
        case = random_case(seed, rows=rows)
        state = case.state(*random_state(np.random.default_rng(seed), case))
        worst = max(compare_formalisms(case.mechanism, [state], routes).values())
        assert worst <= (LARGEST_WITH_ROWS if rows else LARGEST_ON_TREES), f"seed {seed}"


def arm(lift: float = 0.25) -> System:
    """A base turned by a quarter, a hinge about y of a frame at an odd angle, a plate welded on, a slide."""
    odd, quarter = Turn([1, 2, 3], "0.7"), Turn("x", "pi/2")
    return System(
        "arm",
        gravity=[0, 0, -9.81],
        bodies={
            "ground": Body(frames={"foot": Frame([0.1, 0, lift], [quarter])}),
            "upper": Body(mass=2, com=[0.1, 0.2, 0.3], frames={"end": Frame([1, 2, 3], [odd])}),
            "lower": Body(mass=1, com=[0.3, 0, 0], frames={"tip": Frame([0, 0, 1], [quarter])}),
            "plate": Body(mass=1, com=[0, 0.1, 0]),
            "slider": Body(mass=3),
        },
        joints={
            "shoulder": Revolute("ground.foot", "upper", axis="z"),
            "elbow": Revolute("upper.end", "lower", axis="y"),
            "weld": Fixed("lower.tip", "plate"),
            "slide": Prismatic("plate", "slider", axis="x"),
        },
    )


def test_axes_become_coordinate_axes_and_origins_lie_on_the_joints() -> None:
    shoulder, elbow, weld, slide = align_bodies(mechanism(arm())).bodies
    unit = np.eye(3)

    def floats(nodes) -> np.ndarray:
        return np.array([x.shadow for x in nodes])

    assert [floats(row).tolist() for row in shoulder.frame_on_parent.rotation] == unit.tolist()
    np.testing.assert_allclose(floats(shoulder.steps[0].axis), [0, -1, 0], rtol=0, atol=0)
    assert sorted(abs(floats(elbow.steps[0].axis))) == [0, 0, 1]
    for body in (weld, slide):
        assert [floats(row).tolist() for row in body.frame_on_parent.rotation] == unit.tolist()
        assert floats(body.frame_on_parent.position).tolist() == [0, 0, 0]


def test_what_depends_on_parameters_is_kept() -> None:
    system = arm()
    frames = {"foot": Frame([0, 0, 0], [Turn("x", "tilt")])}
    tilted = replace(system, parameters={"tilt": 0.3}, bodies={**system.bodies, "ground": Body(frames=frames)})
    resolved = mechanism(tilted)
    kept = align_bodies(resolved).bodies[0]
    assert (kept.frame_on_parent, kept.frame_on_body, kept.mass) == (
        resolved.bodies[0].frame_on_parent,
        resolved.bodies[0].frame_on_body,
        resolved.bodies[0].mass,
    )
