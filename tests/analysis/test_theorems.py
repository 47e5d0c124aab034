"""Theorems hold for right accelerations only; conserved quantities are those of the textbooks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import random_case, random_state

from multibody_sym.analysis.theorems import conserved, instant_of, rates_of, theorems
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.forward_dynamics import forward_dynamics
from multibody_sym.dynamics.start.sampling import sampled_states
from multibody_sym.dynamics.start.start import start
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.constraints import Distance, Expression
from multibody_sym.model.declaration.forces import Force, SpringDamper
from multibody_sym.model.declaration.joint import Initial
from multibody_sym.model.declaration.joints import Free, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.declaration.system import System
from multibody_sym.model.resolution.resolve import mechanism

TENSOR = {"Ixx": 2, "Iyy": 3, "Izz": 4, "Ixy": 0.5}


@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("seed", range(15))
def test_hold_at_random_states(seed: int, rows: bool) -> None:
    case = random_case(seed, rows=rows)
    state = case.state(*random_state(np.random.default_rng(seed), case))
    found = forward_dynamics(composite_body(case.mechanism, state))
    at = instant_of(case.mechanism, rates_of(case.mechanism), state, found)
    assert max(theorems([at]).values()) < 1e-11


@pytest.mark.parametrize("rows", [False, True])
def test_power_theorem_sees_wrong_accelerations(rows: bool) -> None:
    for seed in range(5):
        case = random_case(seed, rows=rows)
        state = case.state(*random_state(np.random.default_rng(seed), case))
        found = forward_dynamics(composite_body(case.mechanism, state))
        wrong = replace(found, udot=found.udot * (1 + 1e-5) + 1e-5)
        residuals = theorems([instant_of(case.mechanism, rates_of(case.mechanism), state, wrong)])
        assert residuals["power"] > 1e-9


def conserved_by(**declared: object) -> list[str]:
    resolved = mechanism(System("s", **declared))
    rates = rates_of(resolved)
    states = sampled_states(resolved, start(resolved), 4)
    assert len(states) == 5
    found = [forward_dynamics(composite_body(resolved, state)) for state in states]
    return conserved([instant_of(resolved, rates, state, x) for state, x in zip(states, found, strict=True)])


BALL = {"b": Body(mass=2, com=[0.1, 0.2, 0.3], inertia=TENSOR, points={"p": [0.5, 0.2, 0]})}
MOMENTA = [f"{name}({axis})" for name in ("momentum", "angular_momentum") for axis in "xyz"]


def test_free_body_keeps_everything() -> None:
    assert conserved_by(bodies=BALL, joints={"j": Free("ground", "b")}) == ["total_energy()", *MOMENTA]


def test_weight_leaves_what_is_across_it() -> None:
    joints = {"j": Free("ground", "b")}
    kept = ["total_energy()", "momentum(x)", "momentum(y)", "angular_momentum(z)"]
    assert conserved_by(gravity=[0, 0, -9.81], bodies=BALL, joints=joints) == kept


def test_heavy_top_keeps_its_vertical_angular_momentum() -> None:
    found = conserved_by(gravity=[0, 0, -9.81], bodies=BALL, joints={"j": Spherical("ground", "b")})
    assert found == ["total_energy()", "angular_momentum(z)"]


def test_cart_and_pendulum_keep_the_horizontal_momentum() -> None:
    bodies = {"cart": Body(mass=3), "rod": Body(mass=1, com=[0, -1, 0], inertia={"Izz": 1})}
    joints = {"A": Prismatic("ground", "cart", axis="x"), "B": Revolute("cart", "rod")}
    assert conserved_by(gravity=[0, -9.81, 0], bodies=bodies, joints=joints) == ["total_energy()", "momentum(x)"]


def test_damping_and_driving_change_the_energy() -> None:
    joints = {"j": Planar("ground", "b", initial=Initial(q=[1, 0, 0]))}
    spring = SpringDamper(stiffness=3, between=["ground", "b"])
    central = ["total_energy()", "angular_momentum(z)"]
    assert conserved_by(bodies=BALL, joints=joints, forces={"s": spring}) == central
    assert conserved_by(bodies=BALL, joints=joints, forces={"s": replace(spring, damping=1)}) == ["angular_momentum(z)"]
    by_time = SpringDamper(stiffness=3, length="sin(t)", between=["ground", "b"])
    assert conserved_by(bodies=BALL, joints=joints, forces={"s": by_time}) == ["angular_momentum(z)"]
    assert conserved_by(bodies=BALL, joints=joints, forces={"f": Force("b", ["cos(t)", 0, 0])}) == [
        "momentum(y)",
        "angular_momentum(x)",  # it is -z_C m v_y
    ]


def test_fixed_rod_keeps_the_energy_and_a_moving_one_does_not() -> None:
    joints = {"j": Planar("ground", "b", initial=Initial(q=[1, 0, 0]))}
    fixed, moving = Distance(["ground", "b"], 1), Distance(["ground", "b"], "1 + t/5")
    assert "total_energy()" in conserved_by(bodies=BALL, joints=joints, constraints={"rod": fixed})
    assert "total_energy()" not in conserved_by(bodies=BALL, joints=joints, constraints={"rod": moving})


def test_expression_rows_do_power_of_their_own() -> None:
    joints = {"j": Planar("ground", "b")}
    found = conserved_by(bodies=BALL, joints=joints, constraints={"drive": Expression("j_x - t^2")})
    assert "total_energy()" not in found
