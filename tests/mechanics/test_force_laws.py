"""Force laws against closed forms: drag, motors, pulls by any law, and what acts on one freedom of several."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.forces import applied_forces, applied_generalized_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.model_files import dumps, loads
from multibody_sym.mechanics.motion import motion_of, slot_state, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, Frame, Turn
from multibody_sym.model.forces import Damper, Drag, Force, Motor, Pull, SpringDamper, Torque
from multibody_sym.model.joints import Free, Initial, Planar, Prismatic, Revolute, Spherical
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.system import System
from multibody_sym.motion.simulate import simulate
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import as_node, slot
from multibody_sym.text.parser import parse

BALL = Body(mass=2, inertia={"Ixx": 0.2, "Iyy": 0.3, "Izz": 0.4}, points={"p": [0.5, 0, 0]})


def resolved(joint: Any, forces: dict[str, Any], **declared: Any) -> Mechanism:
    return mechanism(System("s", **{"bodies": {"b": BALL}, "joints": {"A": joint}, "forces": forces, **declared}))


def forces_at(found: Mechanism, q: list[float], u: list[float]) -> list[float]:
    motion = motion_of(found, state_of(found, float, 0.3, q, u, []))
    return [float(x) for x in applied_generalized_forces(motion, applied_forces(motion))]


def test_stone_falls_through_air_as_the_hyperbolic_tangent_tells() -> None:
    """v = v_end tanh(g t / v_end), v_end = sqrt(m g / c)."""
    fall = Prismatic("ground", "b", axis="-y", q="y")
    system = System(
        "s", gravity=[0, -9.81, 0], bodies={"b": BALL}, joints={"A": fall}, forces={"air": Drag("b", quadratic=0.25)}
    )
    run = simulate(system, t_end=3, samples=4, rtol=1e-11)
    end = math.sqrt(2 * 9.81 / 0.25)
    np.testing.assert_allclose(run["u_y"], end * np.tanh(9.81 * run.t / end), rtol=1e-9)


def test_drag_opposes_the_velocity_of_its_point() -> None:
    found = resolved(Planar("ground", "b"), {"air": Drag("b", "p", linear=3, quadratic=2)})
    v = np.array([1.0, 2.0 + 0.5 * 4])
    force = -(3 + 2 * np.linalg.norm(v)) * v
    assert forces_at(found, [0, 0, 0], [1, 2, 4]) == pytest.approx([*force, 0.5 * force[1]], rel=1e-14)


def test_drag_at_rest_is_nothing_and_has_derivatives() -> None:
    found = resolved(Free("ground", "b"), {"air": Drag("b", "p", linear=3, quadratic=2)})
    motion = motion_of(found, slot_state(found))
    nodes = [as_node(x) for x in applied_generalized_forces(motion, applied_forces(motion))]
    rest = {slot("q", k): float(k == 3) for k in range(7)} | {slot("u", k): 0.0 for k in range(6)}
    assert evaluate_float(nodes, rest) == [0.0] * 6
    for k in range(6):
        slopes = evaluate_float([derivative(x, slot("u", k)) for x in nodes], rest)
        assert all(map(math.isfinite, slopes))
        assert slopes[k] == pytest.approx([-3, -3, -3, 0, -0.75, -0.75][k])


def test_drag_in_closed_form_is_what_a_book_writes() -> None:
    bodies = {"b": Body(mass="m")}
    joints = {"A": Prismatic("ground", "b", axis="x", q="x")}
    parameters = {"m": 1, "c": 2}
    system = System("s", parameters=parameters, bodies=bodies, joints=joints, forces={"air": Drag("b", quadratic="c")})
    assert str(derive(system)) == "m*x'' = -c*x'*abs(x')"
    joints = {"A": Planar("ground", "b", motion=[None, None, 0])}
    flat = derive(System("s", parameters=parameters, bodies=bodies, joints=joints, forces=system.forces))
    assert "sqrt(A_x'^2 + A_y'^2)" in str(flat)
    assert "e-300" not in str(flat)


def test_motor_reaches_its_speed_without_load() -> None:
    """J u' = N K (V - K N u) / R: u = V / (K N) (1 - exp(-N^2 K^2 t / (J R)))."""
    motor = Motor("A", voltage=12, resistance=2, constant=0.1, gear=5)
    system = System("s", bodies={"b": BALL}, joints={"A": Revolute("ground", "b")}, forces={"motor": motor})
    run = simulate(system, t_end=5, samples=6, rtol=1e-11)
    np.testing.assert_allclose(run["u_A"], 24 * (1 - np.exp(-0.25 / 0.8 * run.t)), rtol=1e-9, atol=1e-9)


def test_pull_by_the_law_of_a_spring_is_the_spring() -> None:
    ends = ["ground", "b.p"]
    spring = SpringDamper(7, between=ends, damping=0.3, length=0.4)
    pull = Pull(ends, "7*(distance - 0.4) + 0.3*distance_rate")
    state = [0.3, 0.4, 0.5], [1.0, -2.0, 3.0]
    found = [forces_at(resolved(Planar("ground", "b"), {"f": force}), *state) for force in (spring, pull)]
    assert found[0] == pytest.approx(found[1], rel=1e-13)


@pytest.mark.parametrize("formalism", FORMALISMS)
def test_charges_repel_by_the_inverse_square(formalism: str) -> None:
    """m a = k / r^2 away from the other, in every formalism."""
    found = resolved(Prismatic("ground", "b", axis="x", q="x"), {"f": Pull(["ground", "b"], "-5/distance^2")})
    dynamics = FORMALISMS[formalism](found, state_of(found, float, 0.0, [0.5], [0.0], []))
    assert forward_dynamics(dynamics).udot.tolist() == pytest.approx([5 / 0.25 / 2], rel=1e-13)


def test_pull_on_one_side_only_stops_at_its_kink() -> None:
    """A rubber band: half a period of the spring, then free flight."""
    band = {"band": Pull(["ground.o", "b"], "max(0, 8*(distance - 1))")}
    bodies = {"b": BALL, "ground": Body(points={"o": [-1, 0, 0]})}
    joints = {"A": Prismatic("ground", "b", axis="x", q="x", initial=Initial(q=0.5))}
    run = simulate(System("s", bodies=bodies, joints=joints, forces=band), t_end=1.0, samples=2)
    quarter = math.pi / 4
    assert run["x"][-1] == pytest.approx(-1.0 * (1.0 - quarter), rel=1e-8)


def test_freedom_names_what_a_joint_force_acts_on() -> None:
    forces = {
        "push": Torque(3, joint="A", freedom="A_y"),
        "turn": Torque(5, joint="A", freedom="u_A_theta"),
        "spring": SpringDamper(2, joint="A", freedom="A_x", length=1),
        "brake": Damper(4, joint="A", freedom="A_theta"),
        "motor": Motor("A", voltage=6, resistance=2, constant=1, freedom="A_y"),
    }
    found = forces_at(resolved(Planar("ground", "b"), forces), [0.5, 0, 0], [1, 2, 3])
    assert found == pytest.approx([-2 * (0.5 - 1), 3 + (6 - 2) / 2, 5 - 4 * 3])
    ball = resolved(Spherical("ground", "b"), {"t": Torque(3, joint="A", freedom="A_wy")})
    assert forces_at(ball, [1, 0, 0, 0], [0, 0, 0]) == [0, 3, 0]


@pytest.mark.parametrize(
    ("joint", "force", "message"),
    [
        (Planar("ground", "b"), Torque(1, joint="A"), "'A' has 3 degrees of freedom; one is needed here"),
        (Planar("ground", "b"), Torque(1, joint="A", freedom="A_z"), "no freedom 'A_z'; did you mean A_"),
        (Spherical("ground", "b"), Damper(1, joint="A", freedom="A_wx"), "A_wx has no coordinate"),
        (Planar("ground", "b"), Pull(["ground", "b"], "1 + length"), "'length' is not declared"),
        (Planar("ground", "b"), Drag("b", linear="distance"), "'distance' is not declared"),
        (Planar("ground", "b"), Pull(["ground", "b"], "2*k"), "is a quantity in"),
    ],
)
def test_wrong_declarations_are_named(joint: Any, force: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message) as caught:
        resolved(joint, {"f": force}, parameters={"k": "3 N*m"})
    assert caught.value.where.path[:2] == ("forces", "f")


def test_names_of_spans_are_reserved_nowhere_else() -> None:
    parameters = {"distance": Parameter(2.0)}
    spring = {"f": SpringDamper("distance", between=["ground", "b"])}
    assert resolved(Planar("ground", "b"), spring, parameters=parameters).parameters[0].name == "distance"
    with pytest.raises(ModelError, match="'distance' is that of the points here and a parameter too"):
        resolved(Planar("ground", "b"), {"f": Pull(["ground", "b"], "distance")}, parameters=parameters)


def test_forces_turn_with_the_axes_of_any_body() -> None:
    """A force and a torque along the axes of a third body, which itself has turned by 0.7."""
    bodies = {"b": BALL, "c": BALL, "ground": Body(frames={"F": Frame(rotate=[Turn("x", 1.2)])})}
    joints = {"A": Free("ground", "b", angles="zxz"), "C": Revolute("ground.F", "c", axis="z")}
    forces = {"f": Force("b", [1, 2, 3], at="p", frame="c"), "t": Torque([4, 5, 6], on="b", frame="c")}
    found = mechanism(System("s", bodies=bodies, joints=joints, forces=forces))
    state = state_of(found, float, 0.0, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], [0.0] * 7, [])
    motion = motion_of(found, state)
    R = np.array(motion.rotation(found.body_index("c")), dtype=float)
    c, s = math.cos(0.7), math.sin(0.7)
    wanted = np.array([[1, 0, 0], [0, math.cos(1.2), -math.sin(1.2)], [0, math.sin(1.2), math.cos(1.2)]])
    wanted = wanted @ [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    np.testing.assert_allclose(R, wanted, atol=1e-15)
    arm = np.array(motion.rotation(found.body_index("b")), dtype=float) @ [0.5, 0, 0]
    moment = np.cross(arm, wanted @ [1, 2, 3]) + wanted @ [4, 5, 6]
    force = np.array(applied_generalized_forces(motion, applied_forces(motion)), dtype=float)
    np.testing.assert_allclose(force[:3], wanted @ [1, 2, 3], atol=1e-14)
    assert force[3] == pytest.approx(moment[2], rel=1e-13)  # the first angle turns about the parent's z


def test_laws_are_read_and_written() -> None:
    text = """\
multibody_sym: 1
name: s
bodies: {b: {mass: 1}}
joints: {A: {type: planar, parent: ground, child: b}}
forces:
  air: {type: drag, on: b, linear: 1, quadratic: 2 kg/m}
  motor: {type: motor, joint: A, voltage: 12, resistance: 2, constant: 0.1, gear: 5, freedom: A_theta}
  law: {type: pull, between: [ground, b], value: 3*(distance - 1)^3 + distance_rate}
"""
    system = loads(text)
    assert loads(dumps(system)) == system
    forces = {
        "air": Drag("b", linear=1, quadratic=2),
        "motor": Motor("A", voltage=12, resistance=2, constant=0.1, gear=5, freedom="A_theta"),
        "law": Pull(["ground", "b"], parse("3*(distance - 1)^3 + distance_rate")),
    }
    assert system == System("s", bodies={"b": Body(mass=1)}, joints={"A": Planar("ground", "b")}, forces=forces)


def test_drag_brakes_what_the_theorem_of_power_says() -> None:
    found = resolved(Planar("ground", "b"), {"air": Drag("b", linear=3, quadratic=2)})
    state = state_of(found, float, 0.0, [0, 0, 0], [3, 4, 0], [])
    udot = forward_dynamics(composite_body(found, state)).udot
    assert 2 * np.dot(udot[:2], [3, 4]) == pytest.approx(-(3 + 2 * 5) * 25, rel=1e-14)
