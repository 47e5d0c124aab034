"""Forward dynamics: known accelerations, dependent rows, freedoms without inertia."""

from __future__ import annotations

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state

from multibody_sym.analysis.check import dalembert
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics, verify_inertia
from multibody_sym.dynamics.formalisms.equations import vanishing_pivots
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import NoSolutionError
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import Distance, Expression
from multibody_sym.model.joints import Initial, Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.scalars.rank import PIVOT


def pendulum_in_x_y(rods: int = 1) -> System:
    return System(
        "pendulum",
        gravity=[0, -9.81, 0],
        bodies={"slide": Body(mass=0), "bob": Body(mass=2)},
        joints={
            "X": Prismatic("ground", "slide", axis="x", q="x", initial=Initial(q=0.6, u=0)),
            "Y": Prismatic("slide", "bob", axis="y", q="y", initial=Initial(q=-0.8, u=0)),
        },
        constraints={f"rod{k}": Distance(["ground", "bob"], 1) for k in range(rods)},
    )


def accelerations(system: System):
    resolved = mechanism(system)
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    return forward_dynamics(composite_body(resolved, state))


def test_hanging_mass_pins_the_sign_of_the_multiplier() -> None:
    """phi = L0 - length: lambda is the tension, positive where the rod pulls."""
    system = System(
        "hanging",
        gravity=[0, -9.81, 0],
        bodies={"load": Body(mass=3)},
        joints={"Y": Prismatic("ground", "load", axis="y", initial=Initial(q=-2))},
        constraints={"rod": Distance(["ground", "load"], 2)},
    )
    found = accelerations(system)
    assert found.udot == pytest.approx([0], abs=1e-14)
    assert found.multipliers == pytest.approx([3 * 9.81])


def test_pendulum_in_x_y_released_from_rest() -> None:
    found = accelerations(pendulum_in_x_y())
    along = 9.81 * 0.6  # tangential acceleration g sin(angle) at sin = 0.6, cos = 0.8
    assert found.udot == pytest.approx([-along * 0.8, -along * 0.6])
    assert found.multipliers == pytest.approx([2 * 9.81 * 0.8])


def test_dependent_rows_share_nothing_and_change_nothing() -> None:
    once, twice = accelerations(pendulum_in_x_y(1)), accelerations(pendulum_in_x_y(3))
    np.testing.assert_allclose(twice.udot, once.udot, rtol=1e-13)
    assert twice.report[0] == 1.0
    assert twice.multipliers == pytest.approx([2 * 9.81 * 0.8, 0.0, 0.0])


def test_light_body_between_heavy_ones_keeps_its_row() -> None:
    """Without rows the light body would accelerate with 1e9 m/s^2: what that rounds away is brought back."""
    system = System(
        "held",
        bodies={"light": Body(mass="1e-6"), "heavy": Body(mass="1e6")},
        joints={"A": Prismatic("ground", "light", axis="x", q="a"), "B": Prismatic("ground", "heavy", axis="x", q="b")},
        forces={"push": {"type": "force", "on": "light", "value": [1e3, 0, 0]}},
        constraints={"stick": Expression("a - b/3")},
    )
    found = accelerations(system)
    a, b = found.udot
    assert a == pytest.approx(b / 3, rel=1e-12)
    assert b == pytest.approx(1e3 / 3 / 1e6, rel=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_whole_matrix_solved_by_numpy(seed: int) -> None:
    """[[M, -H^T], [H, 0]] (udot, lambda) = (f, gamma), dense."""
    case = random_case(seed, bodies=(1, 5), rows=True)
    state = case.state(*random_state(np.random.default_rng(seed), case))
    reference = dalembert(case.motion(*random_state(np.random.default_rng(seed), case)))
    H, M = reference.constraint_jacobian, reference.mass_matrix
    size = 1 / np.sqrt(M.diagonal())
    matrix = np.block([[size[:, None] * M * size, -(H * size).T], [H * size, np.zeros((len(H), len(H)))]])
    right = np.concatenate([size * (reference.applied - reference.velocity_terms), reference.constraint_forcing])
    solution = np.linalg.solve(matrix, right)
    found = forward_dynamics(composite_body(case.mechanism, state))
    count = len(M)
    tolerance = 1e-9 * np.abs(solution).max()
    np.testing.assert_allclose(found.udot / size, solution[:count], atol=tolerance)
    np.testing.assert_allclose(found.multipliers, solution[count:], atol=tolerance)


@pytest.mark.parametrize(
    ("joints", "speed"),
    [
        ({"hinge": Revolute("ground", "bob", q="phi")}, "u_phi"),
        ({"ball": Spherical("ground", "bob")}, "ball_wz"),
    ],
)
def test_particle_does_not_resist_turning_about_itself(joints, speed: str) -> None:
    system = System("particle", bodies={"bob": Body(mass=1)}, joints=joints)
    with pytest.raises(NoSolutionError, match=f"no inertia resists the speed {speed}") as caught:
        start(mechanism(system))
    assert caught.value.where.path == ("joints", *joints)
    assert caught.value.exit_code == 3


def test_direction_without_inertia_in_a_chain() -> None:
    """Two hinges about one axis with nothing between them: only the sum of their speeds meets inertia."""
    system = System(
        "coaxial",
        bodies={"ring": Body(mass=1), "disc": Body(mass=1, inertia={"Izz": 1})},
        joints={"A": Revolute("ground", "ring"), "B": Revolute("ring", "disc")},
    )
    with pytest.raises(NoSolutionError, match="u_A"):
        start(mechanism(system))


def test_pivots_are_judged_beside_their_own_diagonal() -> None:
    def found(*rows: list[float]) -> list[int]:
        return list(vanishing_pivots(np.array(rows), PIVOT * len(rows)))

    assert found([1e-12, 0.0], [0.0, 1e12]) == []
    assert found([1.0, 1.0], [1.0, 1.0]) == [0]
    assert found([1.0, 0.0], [0.0, -1.0]) == [1]
    assert found() == []


def test_random_mechanisms_have_inertia() -> None:
    for seed in range(20):
        case: Case = random_case(seed)
        verify_inertia(case.motion(*random_state(np.random.default_rng(seed), case)))
