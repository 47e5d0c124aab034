"""Linearisation: matrices by hand, and finite differences of the rates along the constraints' surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mechanisms import random_case, random_state

import multibody_sym as mbs
from multibody_sym.dynamics.closing import Rows, closed_near
from multibody_sym.dynamics.linearization import Flow
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import state_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_cart_pole_upright_by_hand() -> None:
    M, m, l, g = 1.0, 0.2, 1.0, 9.81
    text = (EXAMPLES / "cart_pole.yaml").read_text().replace("95 deg", "90 deg").replace("F: 2 N", "F: 0 N")
    found = mbs.linearize(mbs.loads(text))
    # (M + m) x'' - m l/2 theta'' = w, -m l/2 x'' + m l^2/3 theta'' = m g l/2 theta, theta from upright
    inverse = np.linalg.inv([[M + m, -m * l / 2], [-m * l / 2, m * l**2 / 3]])
    assert found.states == ("x", "theta", "u_x", "u_theta")
    assert found.inputs == ("push",)
    assert found.A[:2] == pytest.approx(np.eye(4)[2:])
    assert found.A[2:, 1] == pytest.approx(inverse[:, 1] * m * g * l / 2)
    assert np.abs(found.A[2:, [0, 2, 3]]).max() < 1e-12
    assert found.B[:, 0] == pytest.approx([0, 0, *inverse[:, 0]])
    assert found.accelerations == pytest.approx({"u_x": 0.0, "u_theta": 0.0}, abs=1e-12)


def pendulum(damping: float) -> mbs.System:
    return mbs.System(
        "pendulum",
        gravity=[0, -9.81, 0],
        bodies={"bob": mbs.Body(mass=2, com=[0, -0.5, 0])},
        joints={"hinge": mbs.Revolute("ground", "bob", q="theta")},
        forces={"bearing": mbs.Damper(damping, joint="hinge")},
    )


def test_damped_pendulum_has_the_roots_of_its_quadratic() -> None:
    """2 l^2 theta'' + c theta' + 2 g l theta = 0."""
    found = mbs.linearize(pendulum(0.3))
    roots = np.roots([2 * 0.25, 0.3, 2 * 9.81 * 0.5])
    assert sorted(found.eigenvalues, key=np.imag) == pytest.approx(sorted(roots, key=np.imag), rel=1e-12)
    assert found.eigenvalues.tolist() == [complex(*pair) for pair in found.as_json()["eigenvalues"]]


def test_a_loop_is_linearised_in_what_is_marked_known() -> None:
    found = mbs.linearize(mbs.load(EXAMPLES / "three_cranks.yaml"))
    assert found.states[0] == "phi"
    assert len(found.states) == 2


@pytest.mark.parametrize("seed", [40, 42, 43, 44, 45, 46, 47, 49, 50, 51])
def test_random_mechanisms_with_rows_against_finite_differences(seed: int) -> None:
    """dz/dt beside a state, on the constraints: z is moved along X, put back onto them, and the flow compared."""
    case = random_case(seed, bodies=(1, 3), rows=True)
    _, guess, _ = random_state(np.random.default_rng(seed), case)
    rows = Rows(case.mechanism, case.parameters, range(len(case.mechanism.rows)))
    q = closed_near(rows, np.array(guess))
    assert q is not None, "choose a seed with a closed position near its random one"
    u = admissible(case, q, np.zeros(len(case.mechanism.speeds)))
    flow = Flow(case.mechanism, case.parameters)
    found, tangents = flow.linearized(q, u), flow.tangents(q, u)
    z = np.concatenate([q, u])

    def rates(at: np.ndarray) -> np.ndarray:
        return np.concatenate(flow._rates(*flow.known(at[: len(q)], at[len(q) :]))[:2])

    step = 1e-5
    for column, direction in zip(found.A.T, tangents.X.T, strict=True):
        ahead, behind = (rates(z + sign * step * direction)[tangents.places] for sign in (1, -1))
        size = max(1.0, float(np.abs(column).max()))
        assert (ahead - behind) / (2 * step) == pytest.approx(column, rel=1e-5, abs=1e-5 * size)
    moved = tangents.X @ np.full(len(tangents.places), 1e-6)
    residual = restricted(case, z + moved) - restricted(case, z)
    assert np.abs(residual).max() < 1e-9 * max(1.0, float(np.abs(tangents.X).max()) ** 2)


def admissible(case, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the speeds nearest to u that the rows allow."""
    moving = row_motions(motion_of(case.mechanism, state_of(case.mechanism, float, 0.0, q, u, case.parameters)))
    jacobian = np.array([row.jacobian for row in moving], dtype=float)
    return u - np.linalg.lstsq(jacobian, np.array([row.phidot for row in moving], dtype=float), rcond=None)[0]


def restricted(case, z: np.ndarray) -> np.ndarray:
    count = len(case.mechanism.coordinates)
    state = state_of(case.mechanism, float, 0.0, z[:count], z[count:], case.parameters)
    moving = row_motions(motion_of(case.mechanism, state))
    lengths = [sum(z[k] ** 2 for k in body.quaternion) for body in case.mechanism.bodies if body.ball]
    return np.array([*(r.phi for r in moving if r.holonomic), *lengths, *(r.phidot for r in moving)], dtype=float)


def test_the_states_of_a_loop_are_a_coordinate_and_its_own_speed() -> None:
    """A governor that turns steadily: two arms in a plane carry a sleeve, and xi' is u in the first row of A."""
    system = mbs.loads("""
multibody_sym: 1
name: governor
gravity: [0, 0, -9.81]
bodies:
  spindle: {}
  arm: {points: {e: [0, 0, -0.4]}}
  ball: {mass: 1.5}
  rod: {points: {e: [0, 0, -0.4]}}
  sleeve: {mass: 2}
joints:
  S: {type: revolute, parent: ground, child: spindle, axis: z, motion: 12*t}
  A: {type: revolute, parent: spindle, child: arm, axis: y, q: th, initial: {q: -0.8963318164379938, known: true}}
  F: {type: fixed, parent: arm.e, child: ball}
  B: {type: revolute, parent: arm.e, child: rod, axis: y, q: ps, initial: {q: 2}}
  D: {type: prismatic, parent: spindle, child: sleeve, axis: z, q: z, initial: {q: -0.5}}
  C: {type: revolute, parent: rod.e, child: sleeve, axis: y, cut: true}
simulation: {t_end: 3, coordinates: absolute}
""")
    found = mbs.linearize(system)
    assert found.states == ("th", "u_th")
    assert found.A[0] == pytest.approx([0, 1])
    assert max(map(abs, found.accelerations.values())) < 1e-9
