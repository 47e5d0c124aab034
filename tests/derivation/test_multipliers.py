"""Lagrange's equations with multipliers: the sign of lambda, and rows derived from phi against kinematics' rows."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from mechanisms import random_case, random_state
from test_lagrange import assert_same, assert_terms_agree, residuals, symbols
from textbook import DOWN, hanging_mass, pendulum_in_xy, positive

from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.lagrange import multipliers
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance
from multibody_sym.model.joints import Prismatic, Revolute
from multibody_sym.model.system import System


def initial(resolved: Mechanism) -> State:
    """Return the start over floats."""
    begin = start(resolved)
    return state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)


def test_a_hanging_mass_pulls_its_rod_with_its_weight() -> None:
    """M udot = f + H^T lambda with phi = l - length: lambda is the tension, m g, and positive."""
    resolved = mechanism(hanging_mass())
    found = forward_dynamics(multipliers(resolved, initial(resolved)))
    assert found.udot == pytest.approx([0.0], abs=1e-12)
    assert found.multipliers == pytest.approx([9.81])


def test_the_multiplier_stands_on_the_right() -> None:
    """m y'' + m g = H lambda: the rod pulls a mass upward, which starts below its support (y < 0)."""
    equations = derive(hanging_mass())
    s = symbols(equations)
    m, g, tension = s["m"], s["g"], s["lambda_rod"]
    assert_same(residuals(equations), [m * s["a_y"] + m * g - tension])


def test_pendulum_in_x_and_y() -> None:
    equations = derive(pendulum_in_xy())
    s = symbols(equations)
    m, L, g, x, y = (s[name] for name in ("m", "l", "g", "x", "y"))
    r = sympy.sqrt(x**2 + y**2)
    book = [
        m * s["a_x"] + x / r * s["lambda_rod"],
        m * s["a_y"] + m * g + y / r * s["lambda_rod"],
        m * L**2 * s["a_phi"] - s["lambda_still"],
    ]
    assert_same(residuals(equations), book)
    vx, vy = s["u_x"], s["u_y"]
    assert_same(equations.constraint_forcing, [(vx**2 + vy**2) / r - (x * vx + y * vy) ** 2 / r**3, 0])


@pytest.mark.parametrize("block", range(4))
def test_rows_agree_with_those_of_the_kinematics(block: int) -> None:
    """H and gamma follow from phi alone, for rods, ropes over pulleys, and expressions; M, Q, c as without rows."""
    for seed in range(3000 + 4 * block, 3004 + 4 * block):
        case = random_case(seed, bodies=(1, 4), rows=True)
        for sample in range(2):
            t, q, u = random_state(np.random.default_rng([seed, sample]), case)
            state = case.state(t, q, u)
            found, expected = multipliers(case.mechanism, state), composite_body(case.mechanism, state)
            assert_terms_agree(case, found, expected, state)
            for row, other in zip(found.rows, expected.rows, strict=True):
                assert row.holonomic == other.holonomic
                assert not row.holonomic or row.phi == pytest.approx(other.phi, rel=1e-10, abs=1e-12)
                assert row.phidot == pytest.approx(other.phidot, rel=1e-10, abs=1e-10)


def test_a_rod_whose_length_depends_on_a_coordinate() -> None:
    """A rope that winds on a drum of radius r turned by theta: H has r in the drum's column."""
    system = System(
        "drum",
        gravity=DOWN,
        parameters=positive("m J r l"),
        bodies={"load": Body(mass="m"), "drum": Body(mass=1, inertia={"Izz": "J"})},
        joints={
            "fall": Prismatic("ground", "load", axis="-y", q="s", initial={"q": 1}),
            "axle": Revolute("ground", "drum", axis="z", q="theta"),
        },
        constraints={"rope": Distance(between=["ground", "load"], value="l + r*theta^2/2")},
    )
    resolved = mechanism(system)
    state = state_of(resolved, float, 0.0, (1.18, 0.6), (0.3, 0.5), [1.0, 1.0, 1.0, 1.0, 9.81, 0.0, 0.0])
    for route in (multipliers, composite_body):
        found = route(resolved, state)
        assert found.constraint_jacobian[0] == pytest.approx([-1.0, 0.6])
        assert found.constraint_forcing == pytest.approx([-(0.5**2)])
