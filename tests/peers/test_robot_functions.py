"""Functions of robots and their derivatives against Pinocchio, in every state also through our speeds of a free base.

Ours are those of the base along the world's axes, theirs along its own: v = S(q) u. So tau = S^T rnea(q, S u,
S udot + r) with r = -omega x R^T u, and derivatives follow by the product rule.
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.program.program import interpret

pin = pytest.importorskip("pinocchio", reason="the peer pinocchio (extra: peers) is not installed")

from test_robots import ROBOTS, path_of  # noqa: E402 - which needs pinocchio, too

MODELS = {**ROBOTS, "Solo12": ("solo_description/robots/solo12.urdf", True)}
STATES = 20
NEAR = 1e-10


@dataclass
class Pair:
    """A robot here and there."""

    name: str
    system: mbs.System
    model: Any
    data: Any
    floating: bool
    q_order: list[int]
    v_order: list[int]
    made: dict[Any, mbs.Function] = field(default_factory=dict)

    def asked(self, what: Any, at: State, by: tuple[Any, ...] = (), **options: Any) -> dict[str, np.ndarray]:
        """Return our values, by the interpreter."""
        key = (what, by, *options.items())
        if key not in self.made:
            f = mbs.function(self.system, what, **options)
            for variable in by:
                f = f.derivative(variable)
            self.made[key] = f
        f = self.made[key]
        given = [0.0, at.q, at.u, np.empty(0), np.empty(0), np.empty(0)]
        values = interpret(f.program, *given, *([at.udot] if "udot" in f.arguments else []))
        return dict(zip(f.names, values, strict=True))


@dataclass
class State:
    """A state in both conventions; columns of `S` and `r` as above."""

    q: np.ndarray
    u: np.ndarray
    udot: np.ndarray
    their_q: np.ndarray
    S: np.ndarray
    r: np.ndarray


@pytest.fixture(scope="module", params=MODELS)
def pair(request: pytest.FixtureRequest) -> Pair:
    file, floating = MODELS[request.param]
    path = path_of(file)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", mbs.UrdfNotice)
        system = mbs.load_urdf(path, floating=floating, damping=False, mimic=False)
    model = pin.buildModelFromUrdf(path, *([pin.JointModelFreeFlyer()] if floating else []))
    q_order, v_order = [], []
    for body in mbs.mechanism(system).bodies:
        if body.u:
            joint = model.joints[1 if body.quaternions else model.getJointId(body.joint_name)]
            q_order += range(joint.idx_q, joint.idx_q + joint.nq)
            v_order += range(joint.idx_v, joint.idx_v + joint.nv)
    return Pair(request.param, system, model, model.createData(), floating, q_order, v_order)


def states(pair: Pair) -> list[State]:
    rng = np.random.default_rng(5)
    return [random_state(pair, rng) for _ in range(STATES)]


def random_state(pair: Pair, rng: np.random.Generator) -> State:
    model = pair.model
    their_q = pin.integrate(model, pin.neutral(model), rng.uniform(-1.5, 1.5, model.nv))
    u, udot = rng.standard_normal((2, model.nv))
    q = their_q[pair.q_order]
    if pair.floating:
        q[3:7] = np.roll(q[3:7], 1)
    S = np.zeros((model.nv, model.nv))
    S[pair.v_order, range(model.nv)] = 1.0
    r = np.zeros(model.nv)
    if pair.floating:
        R = rotation(q)
        S[:3, :3] = R.T
        r[:3] = -np.cross(u[3:6], R.T @ u[:3])
    return State(q, u, udot, their_q, S, r)


def rotation(q: np.ndarray) -> np.ndarray:
    return pin.Quaternion(*q[3:7]).toRotationMatrix()


def spin(w: np.ndarray) -> np.ndarray:
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def assert_near(found: np.ndarray, wanted: np.ndarray, size: float | None = None) -> None:
    size = max(1.0, float(np.abs(wanted).max())) if size is None else size
    np.testing.assert_allclose(found, wanted, rtol=0, atol=NEAR * size)


def moved_base(pair: Pair, at: State, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Return dS and dr while our speed k alone is one."""
    dS, dr = np.zeros_like(at.S), np.zeros_like(at.r)
    if pair.floating and 3 <= k < 6:
        dS[:3, :3] = -spin(np.eye(3)[k - 3]) @ rotation(at.q).T
        dr[:3] = -np.cross(at.u[3:6], dS[:3, :3] @ at.u[:3])
    return dS, dr


def test_derivatives_of_inverse_dynamics(pair: Pair) -> None:
    for at in states(pair):
        v, a = at.S @ at.u, at.S @ at.udot + at.r
        pin.computeRNEADerivatives(pair.model, pair.data, at.their_q, v, a)
        by_q, by_v, M = pair.data.dtau_dq, pair.data.dtau_dv, pair.data.M
        M = np.triu(M) + np.triu(M, 1).T
        tau = pin.rnea(pair.model, pair.model.createData(), at.their_q, v, a)
        of_q, of_u = (pair.asked("inverse_dynamics", at, (by,))["forces"] for by in ("q", "u"))
        for k in range(len(at.u)):
            way = np.eye(len(at.u))[k]
            dS, dr = moved_base(pair, at, k)
            rate = by_q @ at.S @ way + by_v @ (dS @ at.u) + M @ (dS @ at.udot + dr)
            assert_near(of_q[:, k], at.S.T @ rate + dS.T @ tau)
            dr_du = np.zeros(len(at.u))
            if pair.floating:
                R = rotation(at.q)
                dr_du[:3] = -np.cross(way[3:6], R.T @ at.u[:3]) - np.cross(at.u[3:6], R.T @ way[:3])
            assert_near(of_u[:, k], at.S.T @ (by_v @ at.S @ way + M @ dr_du))


def test_derivatives_of_accelerations(pair: Pair) -> None:
    """M d(udot) = -d(tau) at fixed accelerations, here with Pinocchio's M and the derivatives tested before."""
    for at in states(pair)[:4]:
        found = {by: pair.asked("state_derivative", at, (by,)) for by in ("q", "u")}
        rates = pair.asked("state_derivative", at)
        there = State(at.q, at.u, rates["udot"], at.their_q, at.S, at.r)
        M = pin.crba(pair.model, pair.data, at.their_q)
        M = at.S.T @ (np.triu(M) + np.triu(M, 1).T) @ at.S
        for by, slopes in found.items():
            wanted = -pair.asked("inverse_dynamics", there, (by,))["forces"]
            assert_near(M @ slopes["udot"], wanted)
    if not pair.floating:
        pin.computeABADerivatives(pair.model, pair.data, at.their_q, at.S @ at.u, np.zeros(len(at.u)))
        order = np.ix_(pair.v_order, pair.v_order)
        assert_near(found["q"]["udot"], pair.data.ddq_dq[order])
        assert_near(found["u"]["udot"], pair.data.ddq_dv[order])


def test_terms_of_the_equations(pair: Pair) -> None:
    for at in states(pair)[:6]:
        v = at.S @ at.u
        assert_near(pair.asked("bias", at)["bias"], at.S.T @ pin.rnea(pair.model, pair.data, at.their_q, v, at.r))
        weight = pin.computeGeneralizedGravity(pair.model, pair.data, at.their_q)
        assert_near(pair.asked("gravity", at)["gravity"], at.S.T @ weight)
        M = pin.crba(pair.model, pair.data, at.their_q)
        assert_near(pair.asked("mass_matrix", at)["mass_matrix"], at.S.T @ (np.triu(M) + np.triu(M, 1).T) @ at.S)
        momentum = pin.computeCentroidalMomentum(pair.model, pair.data, at.their_q, v)
        com, fixed = pin.centerOfMass(pair.model, pair.data, at.their_q), pair.model.inertias[0]
        ours, whole = pair.asked("centroidal_momentum", at), pair.data.mass[0] + fixed.mass
        centre = (pair.data.mass[0] * com + fixed.mass * fixed.lever) / whole  # with what is fixed to ground
        assert_near(ours["centre_of_mass"], centre)
        shift = np.eye(6)
        shift[3:, :3] = spin(com - centre)
        assert_near(ours["momentum"], shift @ np.concatenate([momentum.linear, momentum.angular]))
        matrix = shift @ pin.computeCentroidalMap(pair.model, pair.data, at.their_q) @ at.S
        assert_near(pair.asked("centroidal_momentum", at, ("u",))["momentum"], matrix)
        energy = pin.computeKineticEnergy(pair.model, pair.data, at.their_q, v)
        assert_near(pair.asked("energies", at)["kinetic"], np.array(energy))


def test_regressors(pair: Pair) -> None:
    """Masses, first and second moments as Pinocchio orders them; of bodies, the columns of their joints."""
    if pair.floating:
        return  # whose base has other axes here
    joints = [pair.model.getJointId(body.joint_name) for body in mbs.mechanism(pair.system).bodies if body.u]
    moving = [k for k, body in enumerate(mbs.mechanism(pair.system).bodies) if body.u]
    for at in states(pair)[:6]:
        theirs = pin.computeJointTorqueRegressor(pair.model, pair.data, at.their_q, at.S @ at.u, at.S @ at.udot)
        ours = pair.asked("regressor", at)["regressor"]
        for body, joint in zip(moving, joints, strict=True):
            there = theirs[:, 10 * (joint - 1) : 10 * joint]
            assert_near(ours[:, 10 * body : 10 * (body + 1)], at.S.T @ there)


AXES = {"world": "WORLD", "local": "LOCAL", "local_world_aligned": "LOCAL_WORLD_ALIGNED"}
TOOLS = {
    "UR5": "wrist_3_link",
    "Panda": "panda_link7",
    "ANYmal": "LF_SHANK",
    "Talos": "arm_left_7_link",
    "Solo12": "FL_LOWER_LEG",
}


@pytest.mark.parametrize("axes", AXES)
def test_jacobians_of_frames_and_their_rates(pair: Pair, axes: Any) -> None:
    """The frame of a link is here that of the joint that carries it."""
    name = TOOLS[pair.name]
    (body,) = (body for body in mbs.mechanism(pair.system).bodies if body.name == name)
    joint, their_axes = pair.model.getJointId(body.joint_name), getattr(pin.ReferenceFrame, AXES[axes])
    for at in states(pair)[:6]:
        v = at.S @ at.u
        pin.computeJointJacobians(pair.model, pair.data, at.their_q)
        pin.computeJointJacobiansTimeVariation(pair.model, pair.data, at.their_q, v)
        columns = pin.getJointJacobian(pair.model, pair.data, joint, their_axes)
        rates = pin.getJointJacobianTimeVariation(pair.model, pair.data, joint, their_axes)
        S_rate = np.zeros_like(at.S)
        if pair.floating:
            S_rate[:3, :3] = -spin(at.u[3:6]) @ rotation(at.q).T
        ours = pair.asked("jacobian", at, frame=name, axes=axes)
        assert_near(ours["jacobian"], columns @ at.S)
        assert_near(ours["rate"], rates @ at.S + columns @ S_rate)
        place = pair.asked("frame", at, frame=name, axes=axes)
        pin.forwardKinematics(pair.model, pair.data, at.their_q, v)
        assert_near(place["position"], pair.data.oMi[joint].translation)
        assert_near(place["rotation"], pair.data.oMi[joint].rotation)
        assert_near(place["velocity"], pin.getVelocity(pair.model, pair.data, joint, their_axes).vector)
        theirs = pin.Quaternion(pair.data.oMi[joint].rotation).coeffs()  # w last
        assert_near(place["quaternion"], np.roll(theirs * (1.0 if theirs[3] >= 0.0 else -1.0), 1))
        pin.forwardKinematics(pair.model, pair.data, at.their_q, v, at.S @ at.udot + at.r)
        of = pin.getClassicalAcceleration if axes == "local_world_aligned" else pin.getAcceleration
        wanted = of(pair.model, pair.data, joint, their_axes).vector
        assert_near(pair.asked("acceleration", at, frame=name, axes=axes)["acceleration"], wanted)
        at_rest = ours["jacobian"] @ at.udot
        assert_near(at_rest + place["drift"], wanted)


def test_operational_space_inertia(pair: Pair) -> None:
    """(J M^-1 J^T)^-1 with Pinocchio's J and M."""
    name = TOOLS[pair.name]
    (body,) = (body for body in mbs.mechanism(pair.system).bodies if body.name == name)
    joint = pair.model.getJointId(body.joint_name)
    for at in states(pair)[:6]:
        pin.computeJointJacobians(pair.model, pair.data, at.their_q)
        J = pin.getJointJacobian(pair.model, pair.data, joint, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        M = pin.crba(pair.model, pair.data, at.their_q)
        mobility = J @ np.linalg.solve(np.triu(M) + np.triu(M, 1).T, J.T)
        ours = pair.asked("operational_space", at, frame=name, axes="local_world_aligned")
        assert_near(ours["mobility"], mobility)
        assert_near(ours["inertia"] @ mobility, np.eye(6), size=max(1.0, float(np.linalg.cond(mobility)) * 1e-2))


def test_the_order_of_pinocchio(pair: Pair) -> None:
    places_q, places_u = mbs.function(pair.system, "mass_matrix").to_pinocchio()
    at = states(pair)[0]
    np.testing.assert_array_equal(at.q[places_q], at.their_q)
    np.testing.assert_array_equal(np.argsort(places_u), pair.v_order)


def test_what_the_guide_says_pinocchio_calls_things_is_there() -> None:
    guide = (Path(__file__).parents[2] / "docs" / "guide" / "functions.md").read_text(encoding="utf-8")
    table = guide.partition("| here | Pinocchio | Drake |")[2].partition("\n\n")[0]
    column = " ".join(row.split("|")[2] for row in table.splitlines() if row.count("|") == 4)
    names = re.findall(r"`([\w.]+)`", column)
    assert len(names) > 20
    found = {"data.f": hasattr(pin.Model().createData(), "f")}
    assert [name for name in names if not (found.get(name) or hasattr(pin, name))] == []
