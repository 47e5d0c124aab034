"""Joints and ground that move as prescribed: against closed forms, and against the same motion forced by a drive."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.model_files import dumps, loads
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, GroundMotion, Turn
from multibody_sym.model.joints import Fixed, Free, Initial, Planar, Prismatic, Revolute, Spherical, Universal
from multibody_sym.model.system import System

TENSOR = {"Ixx": 0.2, "Iyy": 0.3, "Izz": 0.4, "Ixy": 0.05, "Ixz": 0.02, "Iyz": -0.03}


def accelerations(resolved: Mechanism, t: float, q: list[float], u: list[float], name: str) -> list[float]:
    dynamics = FORMALISMS[name](resolved, state_of(resolved, float, t, q, u, []))
    return forward_dynamics(dynamics).udot.tolist()


def reaction(resolved: Mechanism, t: float, q: list[float], u: list[float], joint: str) -> dict[str, float]:
    state = state_of(resolved, float, t, q, u, [])
    udot = forward_dynamics(composite_body(resolved, state)).udot.tolist()
    return reactions(motion_of(resolved, state), udot, [], [])[joint]


def on_hoop(t: float, theta: float, w: float) -> float:
    """Return the acceleration of a bead on a hoop of radius 2 that turns by w t^2 / 2 about its vertical diameter."""
    return math.sin(theta) * math.cos(theta) * (w * t) ** 2 - 9.81 / 2 * math.sin(theta)


@pytest.mark.parametrize("formalism", FORMALISMS)
@pytest.mark.parametrize("carrier", ["joint", "ground"])
def test_bead_on_a_rotating_hoop(formalism: str, carrier: str) -> None:
    """theta'' = sin theta cos theta Omega^2 - (g/r) sin theta, whatever turns the hoop (Greenwood, section 2)."""
    bodies: dict[str, Any] = {"hoop": Body(), "bead": Body(mass=3, com=[0, 0, -2])}
    turning = "0.7*t^2/2"
    if carrier == "joint":
        joints: dict[str, Any] = {"spin": Revolute("ground", "hoop", axis="z", motion=turning)}
    else:
        bodies["ground"] = Body(motion=GroundMotion(turn=[Turn("z", turning)]))
        joints = {"weld": Fixed("ground", "hoop")}
    joints["slide"] = Revolute("hoop", "bead", axis="y")
    resolved = mechanism(System("hoop", gravity=[0, 0, -9.81], bodies=bodies, joints=joints))
    assert accelerations(resolved, 1.3, [0.6], [0.9], formalism) == pytest.approx([on_hoop(1.3, 0.6, 0.7)], rel=1e-12)


def test_moment_that_turns_the_hoop_is_the_rate_of_its_angular_momentum() -> None:
    bodies = {"hoop": Body(), "bead": Body(mass=3, com=[0, 0, -2])}
    joints = {"spin": Revolute("ground", "hoop", motion="0.7*t^2/2"), "slide": Revolute("hoop", "bead", axis="y")}
    resolved = mechanism(System("hoop", gravity=[0, 0, -9.81], bodies=bodies, joints=joints))
    t, theta, u = 1.3, 0.6, 0.9
    arm, arm_rate = 2 * math.sin(theta), 2 * u * math.cos(theta)
    wanted = 3 * (2 * arm * arm_rate * 0.7 * t + arm**2 * 0.7)
    assert reaction(resolved, t, [theta], [u], "spin")["mz"] == pytest.approx(wanted, rel=1e-12)


def test_person_on_a_scale_in_a_lift_weighs_what_the_lift_makes_of_them() -> None:
    bodies = {"ground": Body(motion=GroundMotion(y="0.6*t^2 - t")), "scale": Body(), "person": Body(mass=70)}
    joints = {"floor": Fixed("ground", "scale"), "feet": Prismatic("scale", "person", axis="x", motion=0)}
    resolved = mechanism(System("lift", gravity=[0, -9.81, 0], bodies=bodies, joints=joints))
    assert reaction(resolved, 2.0, [], [], "feet")["fy"] == pytest.approx(70 * (9.81 + 1.2), rel=1e-14)
    assert reaction(resolved, 2.0, [], [], "ground")["fy"] == pytest.approx(70 * (9.81 + 1.2), rel=1e-14)


def test_free_body_feels_nothing_of_a_moving_ground() -> None:
    """In ground's axes it has the apparent acceleration -a - 2 omega x v - omega x (omega x r)."""
    stone = Body(mass=2, inertia={"Izz": 1})
    bodies = {"ground": Body(motion=GroundMotion(x="t^2", turn=[Turn("z", "3*t")])), "stone": stone}
    resolved = mechanism(System("s", bodies=bodies, joints={"none": Planar("ground", "stone")}))
    wanted = [-2 + 6 * -0.4 + 9 * 0.5, -6 * 0.3 + 9 * 0.2, 0]
    found = accelerations(resolved, 0.0, [0.5, 0.2, 0.1], [0.3, -0.4, 0.7], "composite_body")
    assert found == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize("formalism", FORMALISMS)
def test_shaken_pendulum(formalism: str) -> None:
    """l theta'' = -(g + a) sin theta for a pivot that moves up with acceleration a (Kapitza)."""
    bodies = {"ground": Body(motion=GroundMotion(y="0.1*sin(20*t)")), "bob": Body(mass=2, com=[0, -0.5, 0])}
    resolved = mechanism(System("s", gravity=[0, -9.81, 0], bodies=bodies, joints={"A": Revolute("ground", "bob")}))
    t, theta = 0.13, 0.8
    wanted = -(9.81 - 40 * math.sin(20 * t)) * math.sin(theta) / 0.5
    assert accelerations(resolved, t, [theta], [2.0], formalism) == pytest.approx([wanted], rel=1e-12)


def test_prescribed_and_forced_motion_are_the_same() -> None:
    """With q1, q1', q1'' of a free joint as prescribed, the other joint accelerates alike, and the drive is Q1."""
    def resolved(motion: Any) -> Mechanism:
        body = Body(mass=2, com=[0.3, 0.1, -0.2], inertia=TENSOR, points={"end": [0.5, 0.2, 0.1]})
        arm = Universal("ground", "a", axes=["z", [1, 2, 2]], motion=motion)
        joints = {"A": arm, "B": Revolute("a.end", "b", axis=[2, -1, 2])}
        return mechanism(System("s", gravity=[0, 0, -9.81], bodies={"a": body, "b": body}, joints=joints))

    t = 0.7
    given = resolved([None, "0.3 + sin(2*t)"])
    q2, u2, a2 = 0.3 + math.sin(2 * t), 2 * math.cos(2 * t), -4 * math.sin(2 * t)
    udot = accelerations(given, t, [0.4, -0.6], [1.1, 0.8], "composite_body")
    free = resolved(None)
    at = composite_body(free, state_of(free, float, t, [0.4, q2, -0.6], [1.1, u2, 0.8], []))
    force = np.array(at.mass_matrix) @ [udot[0], a2, udot[1]] - at.forcing
    assert force[[0, 2]] == pytest.approx(0, abs=1e-12)
    moment = [reaction(given, t, [0.4, -0.6], [1.1, 0.8], "A")[c] for c in ("mx", "my", "mz")]
    c, s = math.cos(0.4), math.sin(0.4)
    axis = np.array([c - 2 * s, s + 2 * c, 2]) / 3
    assert np.dot(moment, axis) == pytest.approx(force[1], rel=1e-12)


def test_locked_joint_is_a_weld() -> None:
    body = Body(mass=2, com=[0.3, 0.1, -0.2], inertia=TENSOR, points={"end": [0.5, 0.2, 0.1]})
    found = []
    for lock in (Spherical("a.end", "b", angles="zxz", motion=[0, 0, 0]), Fixed("a.end", "b")):
        joints = {"A": Free("ground", "a"), "B": lock}
        resolved = mechanism(System("s", gravity=[1, 0, -9.81], bodies={"a": body, "b": body}, joints=joints))
        assert resolved.drives == ()
        found.append(accelerations(resolved, 0.2, [1, 2, 3, 0.5, 0.5, -0.5, 0.5], [1, -2, 3, 1, 2, 4], "block_ldl"))
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_derived_closed_form_holds_the_given_motion() -> None:
    bodies = {"hoop": Body(), "bead": Body(mass="m", com=[0, 0, "-r"])}
    joints = {"spin": Revolute("ground", "hoop", motion="w*t"), "slide": Revolute("hoop", "bead", axis="y", q="theta")}
    system = System("s", parameters={"m": 1, "r": 2, "w": 3}, bodies=bodies, joints=joints)
    assert str(derive(system)) == "m*r^2*theta'' - m*r^2*w^2*sin(theta)*cos(theta) = 0"


TEXT = """\
multibody_sym: 1
name: shaker
parameters: {w: 2}
bodies:
  ground: {motion: {x: sin(w*t), turn: [{axis: z, angle: t/2}]}}
  a: {mass: 1}
joints:
  A: {type: planar, parent: ground, child: a, motion: ["null", t^2, "null"], q: [x, phi]}
"""


def test_motion_is_read_and_written() -> None:
    system = loads(TEXT)
    assert [c.name for c in mechanism(system).coordinates] == ["x", "phi"]
    assert loads(dumps(system)) == system
    assert loads(TEXT.replace('"null"', "null")) == system
    twin = System(
        "shaker",
        parameters={"w": 2},
        bodies={"ground": Body(motion=GroundMotion(x="sin(w*t)", turn=Turn("z", "t/2"))), "a": Body(mass=1)},
        joints={"A": Planar("ground", "a", motion=[None, "t^2", None], q=["x", "phi"])},
    )
    assert twin == system


def test_default_names_stay_when_a_freedom_is_prescribed() -> None:
    joints = {"A": Planar("ground", "a", motion=["t", "null", 0]), "B": Planar("a", "b", motion=["t", 0, None])}
    resolved = mechanism(System("s", bodies={"a": Body(mass=1), "b": Body(mass=1)}, joints=joints))
    assert [c.name for c in resolved.coordinates] == ["A_y", "B_theta"]
    assert [s.name for s in resolved.speeds] == ["u_A_y", "u_B_theta"]


@pytest.mark.parametrize(
    ("make", "message", "path"),
    [
        (lambda: Spherical("ground", "a", motion="t"), "angles: xyz", ("motion",)),
        (lambda: Free("ground", "a", motion=[0] * 6), "angles: xyz", ("motion",)),
        (lambda: Planar("ground", "a", motion="t"), "3 translations and rotations", ("motion",)),
        (lambda: Revolute("ground", "a", motion="t", q="phi"), "has no coordinate to give a name", ("q",)),
        (lambda: Revolute("ground", "a", motion="t", initial=Initial(q=1)), "needs 0 initial values", ("initial", "q")),
    ],
)
def test_impossible_motions_are_named(make: Any, message: str, path: tuple[str, ...]) -> None:
    with pytest.raises(ModelError, match=message) as caught:
        make()
    assert caught.value.where.path == path


def test_motion_without_a_rate_at_the_start_is_named() -> None:
    joints = {"A": Revolute("ground", "a", motion="sqrt(t)"), "B": Revolute("a", "b")}
    bodies = {"a": Body(mass=1), "b": Body(mass=1, com=[1, 0, 0])}
    with pytest.raises(ModelError, match="no finite value at the start") as caught:
        start(mechanism(System("s", bodies=bodies, joints=joints)))
    assert caught.value.where.path == ("joints", "A", "motion")


def test_motion_depends_on_time_and_parameters_only() -> None:
    joints = {"A": Revolute("ground", "a"), "B": Revolute("a", "b", motion="sin(A)")}
    system = System("s", bodies={"a": Body(mass=1), "b": Body(mass=1)}, joints=joints)
    told = "'A' is a coordinate; here an expression names parameters, inputs, the time only"
    with pytest.raises(ModelError, match=told):
        mechanism(system)


def test_only_ground_moves_by_itself() -> None:
    bodies = {"a": Body(mass=1, motion=GroundMotion(x="t"))}
    with pytest.raises(ModelError, match="only ground moves by itself") as caught:
        mechanism(System("s", bodies=bodies, joints={"A": Revolute("ground", "a")}))
    assert caught.value.where.path == ("bodies", "a", "motion")
    taken = {"ground": Body(motion=GroundMotion(x="t")), "a": Body(mass=1)}
    with pytest.raises(ModelError, match="give the joint another name"):
        mechanism(System("s", bodies=taken, joints={"ground": Revolute("ground", "a")}))
