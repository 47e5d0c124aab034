"""Real robots against Pinocchio: what the import means, by forward and inverse dynamics, energies, centre of mass."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
import pytest

from multibody_sym.analysis.equilibrium import equilibrium
from multibody_sym.derivation.routes import FORMALISMS, cheapest
from multibody_sym.dynamics.formalisms.composite_body import composite_body, inverse_dynamics
from multibody_sym.dynamics.programs.quantities import quantities
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.mechanics.energy import kinetic_energy, potential_energy
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State, motion_of, slot_state, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.urdf import UrdfNotice, load_urdf
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program, interpret
from multibody_sym.scalars.node import quantity

pin = pytest.importorskip("pinocchio", reason="the peer pinocchio (extra: peers) is not installed")

ROBOTS = {
    "UR5": ("ur_description/urdf/ur5_robot.urdf", False),
    "Panda": ("panda_description/urdf/panda.urdf", False),
    "ANYmal": ("anymal_b_simple_description/robots/anymal.urdf", True),
    "Talos": ("talos_data/robots/talos_full_v2.urdf", True),
}
STATES = 20
RELATIVE = 1e-10


@dataclass
class Twins:
    """A robot here and there; `q_order`, `v_order`: their places of our joints' coordinates and speeds."""

    ours: Mechanism
    model: Any
    floating: bool
    q_order: list[int]
    v_order: list[int]


@pytest.fixture(scope="module", params=ROBOTS)
def twins(request: pytest.FixtureRequest) -> Twins:
    file, floating = ROBOTS[request.param]
    path = path_of(file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UrdfNotice)
        ours = mechanism(load_urdf(path, floating=floating, damping=False, mimic=False))
    model = pin.buildModelFromUrdf(path, *([pin.JointModelFreeFlyer()] if floating else []))
    q_order, v_order = [], []
    for body in ours.bodies:
        if body.u:
            joint = model.joints[1 if body.quaternions else model.getJointId(body.joint_name)]
            q_order += range(joint.idx_q, joint.idx_q + joint.nq)
            v_order += range(joint.idx_v, joint.idx_v + joint.nv)
    return Twins(ours, model, floating, q_order, v_order)


def path_of(name: str) -> str:
    """Return a file of the installed package example-robot-data."""
    try:
        listed = files("example-robot-data") or []
    except PackageNotFoundError:
        pytest.skip("the robots of example-robot-data (extra: peers) are not installed")
    return str(next(file.locate() for file in listed if str(file).endswith(name)))


@dataclass
class Instant:
    """A state in both conventions. A speed v of theirs is `rotations` times ours, in their order of joints; the
    acceleration of their floating base has `rate` added: a_B = R^T pddot - omega x v_B."""

    state: State
    their_q: np.ndarray
    their_v: np.ndarray
    rotations: np.ndarray
    rate: np.ndarray

    def their_rates(self, udot: np.ndarray) -> np.ndarray:
        """Return our accelerations as theirs."""
        return self.rotations @ udot + self.rate


def instants(twins: Twins) -> list[Instant]:
    rng = np.random.default_rng(1)
    return [random_instant(twins, rng) for _ in range(STATES)]


def random_instant(twins: Twins, rng: np.random.Generator) -> Instant:
    model = twins.model
    their_q = pin.integrate(model, pin.neutral(model), rng.uniform(-1.5, 1.5, model.nv))
    u = rng.normal(size=model.nv)
    rotations, rate = np.zeros((model.nv, model.nv)), np.zeros(model.nv)
    rotations[twins.v_order, range(model.nv)] = 1
    q = their_q[twins.q_order]
    if twins.floating:
        q[3:7] = np.roll(their_q[3:7], 1)  # theirs is (x, y, z, w)
        R = pin.Quaternion(*q[3:7]).toRotationMatrix()
        rotations[:3, :3] = R.T
        rate[:3] = -np.cross(u[3:6], R.T @ u[:3])
    state = state_of(twins.ours, float, 0.0, q.tolist(), u.tolist(), [], [])
    return Instant(state, their_q, rotations @ u, rotations, rate)


def assert_near(found: Any, wanted: Any) -> None:
    """Compare by the largest element."""
    wanted = np.asarray(wanted, dtype=float)
    np.testing.assert_allclose(np.asarray(found, dtype=float), wanted, rtol=0, atol=RELATIVE * np.abs(wanted).max())


@pytest.mark.parametrize("formalism", ["composite_body", "block_ldl"])
def test_forward_dynamics(twins: Twins, formalism: str) -> None:
    data, rng = twins.model.createData(), np.random.default_rng(2)
    for at in instants(twins):
        torques = rng.normal(size=twins.model.nv)
        dynamics = FORMALISMS[formalism](twins.ours, at.state)
        udot = np.array(dynamics.factors.solve(list(np.array(dynamics.forcing) + at.rotations.T @ torques)))
        assert_near(at.their_rates(udot), pin.aba(twins.model, data, at.their_q, at.their_v, torques))


def test_inverse_dynamics_and_mass_matrix(twins: Twins) -> None:
    data, rng = twins.model.createData(), np.random.default_rng(3)
    for at in instants(twins):
        equations, udot = composite_body(twins.ours, at.state), rng.normal(size=twins.model.nv)
        needed = np.array(inverse_dynamics(motion_of(twins.ours, at.state), udot.tolist())) - equations.applied
        wanted = pin.rnea(twins.model, data, at.their_q, at.their_v, at.their_rates(udot))
        assert_near(needed, at.rotations.T @ wanted)
        upper = np.triu(pin.crba(twins.model, data, at.their_q, pin.Convention.WORLD))
        matrix = upper + np.triu(upper, 1).T
        assert_near(equations.mass_matrix, at.rotations.T @ matrix @ at.rotations)


def test_energies_and_centre_of_mass(twins: Twins) -> None:
    """What is fixed to ground is no part of Pinocchio's sums, only of ours."""
    data, fixed = twins.model.createData(), twins.model.inertias[0]
    names = [quantity("center_of_mass", axis) for axis in "xyz"]
    for at in instants(twins):
        motion = motion_of(twins.ours, at.state)
        kinetic = pin.computeKineticEnergy(twins.model, data, at.their_q, at.their_v)
        potential = pin.computePotentialEnergy(twins.model, data, at.their_q) + 9.81 * fixed.mass * fixed.lever[2]
        com, moving = pin.centerOfMass(twins.model, data, at.their_q), data.mass[0]
        assert kinetic_energy(motion) == pytest.approx(kinetic, rel=RELATIVE)
        assert potential_energy(motion) == pytest.approx(potential, rel=RELATIVE)
        wanted = (moving * com + fixed.mass * fixed.lever) / (moving + fixed.mass)
        assert_near(list(quantities(motion, [0.0] * twins.model.nv, [], names).values()), wanted)


def test_an_arm_rests_where_gravity_asks_no_torque() -> None:
    """From a lift where Newton's method ends at no rest, the arm falls to one; Pinocchio's g(q) vanishes in each."""
    path = path_of(ROBOTS["UR5"][0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UrdfNotice)
        found = equilibrium(load_urdf(path, damping=False), initial={"shoulder_lift_joint": 1.396})
    model = pin.buildModelFromUrdf(path)
    data = model.createData()
    assert len(found.positions) == 8
    for position in found.positions:
        torques = pin.computeGeneralizedGravity(model, data, np.array([position[name] for name in model.names[1:]]))
        assert np.abs(torques).max() < 1e-8


def derivative_of(twins: Twins, formalism: str) -> Program:
    return state_derivative(twins.ours, FORMALISMS[formalism](twins.ours, slot_state(twins.ours)))


def assert_falls_alike(twins: Twins, derivative: Callable[..., Any]) -> None:
    """Compare a state derivative with Pinocchio's accelerations without torques."""
    data, nothing = twins.model.createData(), np.zeros(twins.model.nv)
    for at in instants(twins):
        _, udot, *_ = derivative(0.0, at.state.q, at.state.u, [], [], [])
        assert_near(at.their_rates(np.array(udot)), pin.aba(twins.model, data, at.their_q, at.their_v, nothing))


def test_the_default_program(twins: Twins) -> None:
    assert_falls_alike(twins, partial(interpret, derivative_of(twins, cheapest(twins.ours))))


@pytest.mark.long
@pytest.mark.parametrize("formalism", ["composite_body", "block_ldl"])
def test_generated_code(twins: Twins, formalism: str) -> None:
    compiled = load({"state_derivative": derivative_of(twins, formalism)}, Native(backend="c"))
    assert_falls_alike(twins, compiled["state_derivative"])
