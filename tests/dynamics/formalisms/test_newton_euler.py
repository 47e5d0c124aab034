"""Newton and Euler body by body: the whole linear system solved dense, and the equations as a student writes them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from mechanisms import Case, random_case, random_state
from textbook import cart_pole, pendulum_in_xy, spherical_pendulum, top

from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.symbolic_equations import SymbolicEquations
from multibody_sym.documents.derivation import derivation_data, derivation_document
from multibody_sym.documents.document import write_document
from multibody_sym.dynamics.formalisms.composite_body import free_bodies, joint_wrenches, newton_euler
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import to_parent
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.bodies import Body
from multibody_sym.model.constraints import VelocityConstraint
from multibody_sym.model.forces import Torque
from multibody_sym.model.joints import Prismatic, Revolute, Spherical
from multibody_sym.model.system import System
from multibody_sym.text.printer import COMPONENTS

SEEDS = range(15)


# --- the whole system ----------------------------------------------------------------------------------------------


def whole_system(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    """Return matrix and right side of 6 N balances and n joint equations for udot (n) and all R (6 N)."""
    count, forces = len(motion.state.u), applied_forces(motion)
    size = count + 6 * len(motion.bodies)
    matrix, right = np.zeros((size, size)), np.zeros(size)
    for index, (body, moved, momentum) in enumerate(
        zip(motion.mechanism.bodies, motion.bodies, free_bodies(motion), strict=True)
    ):
        here = slice(count + 6 * index, count + 6 * index + 6)
        for k, wrench in momentum.columns.items():
            matrix[here, k] += np.concatenate(wrench).astype(float)
        matrix[here, here] -= np.eye(6)
        right[here] = np.concatenate(forces.of_body[index]) - np.concatenate(momentum.rest)
        if body.parent >= 0:
            above = slice(count + 6 * body.parent, count + 6 * body.parent + 6)
            units = np.eye(6).tolist()
            matrix[above, here] += np.array([np.concatenate(to_parent(moved, (e[:3], e[3:]))) for e in units]).T
        for k, linear, angular in zip(body.u, moved.linear, moved.angular, strict=True):
            matrix[k, here] = [*linear, *angular]
            right[k] = forces.of_speed[k]
    return matrix, right


@pytest.mark.parametrize("seed", SEEDS)
def test_accelerations_and_all_reactions_at_once(seed: int) -> None:
    case = random_case(seed, bodies=(1, 6))
    motion = case.motion(*random_state(np.random.default_rng(seed), case))
    matrix, right = whole_system(motion)
    size = 1 / np.abs(matrix).max(axis=1, keepdims=True)
    solution = np.linalg.solve(size * matrix, size[:, 0] * right)
    udot = newton_euler(motion.mechanism, motion.state).bias_acceleration
    expected = np.array(joint_wrenches(motion, udot, applied_forces(motion).of_body), dtype=float).ravel()
    np.testing.assert_allclose(solution[: len(udot)], udot, atol=1e-7 * np.abs(udot).max())
    np.testing.assert_allclose(solution[len(udot) :], expected, atol=1e-7 * np.abs(expected).max(initial=1e-9))


# --- as a student writes them --------------------------------------------------------------------------------------


def assert_balances(equations: SymbolicEquations, case: Case, seed: int) -> None:
    """Put the accelerations, multipliers and reactions found in numbers into both sides of every equation."""
    t, q, u = random_state(np.random.default_rng(seed), case)
    motion = case.motion(t, q, u)
    found = forward_dynamics(newton_euler(case.mechanism, motion.state))
    in_joints = reactions(motion, found.udot.tolist(), row_motions(motion), found.multipliers.tolist())
    s = equations.symbols
    flat = [in_joints[body.joint_name][name] for body in case.mechanism.bodies for name in COMPONENTS]
    values = {s.time: t}
    groups = (s.coordinates, q), (s.speeds, u), (s.accelerations, found.udot), (s.parameters, case.parameters)
    for symbols, numbers in (*groups, (s.multipliers, found.multipliers), (s.reactions, flat)):
        values.update(zip(symbols, map(float, numbers), strict=True))
    values.update((symbol, motion.state.slots[slot]) for slot, symbol in s.slots.items() if symbol in s.inputs)
    values.update((symbol, float(number)) for symbol, number in equations.numbers.items())
    for name, expression in equations.definitions:
        values[name] = float(expression.xreplace(values))
    for equation in equations.equations:
        left, right = (float(side.xreplace(values)) for side in (equation.left, equation.right))
        assert left == pytest.approx(right, rel=1e-7, abs=1e-7 * max(1.0, *map(abs, flat)))


@pytest.mark.parametrize(("seed", "rows"), [*((k, False) for k in (0, 3, 6, 9, 11)), *((k, True) for k in (2, 7, 21))])
def test_every_equation_holds(seed: int, rows: bool) -> None:
    case = random_case(seed, bodies=(1, 2), rows=rows)
    assert_balances(derive(case.mechanism, "newton_euler"), case, seed)


def test_row_that_turns_a_ball_acts_through_it() -> None:
    """The moment of the ball's reaction is the row's, not zero: J omega' = lambda about the axis that it drives."""
    system = System(
        "driven_ball", bodies={"body": Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": "J"})}, parameters={"J": 2},
        joints={"ball": Spherical("ground", "body")}, constraints={"spin": VelocityConstraint("ball_wz - 3")},
    )
    last = derive(system, "newton_euler").equations[-1]
    assert (str(last.left), str(last.right)) == ("J*ball_wz_rate", "lambda_spin")


def test_cart_and_pole_as_in_a_book() -> None:
    assert str(derive(cart_pole(), "newton_euler")) == (
        "M*x'' = F - R_hinge_x\n"
        "0 = N - M*g - R_hinge_y\n"
        "m*x'' + m*l*theta''*cos(theta) - m*l*theta'^2*sin(theta) = R_hinge_x\n"
        "m*l*theta''*sin(theta) + m*l*theta'^2*cos(theta) = R_hinge_y - m*g\n"
        "0 = -l*R_hinge_x*cos(theta) - l*R_hinge_y*sin(theta)"
    )


def test_euler_s_equations_of_what_a_ball_carries() -> None:
    last = derive(top(), "newton_euler").equations[-1]
    assert str(last.right) == "0"
    assert str(last.left) == "C*ball_wz_rate + ball_wx*ball_wy*(-A + B)"


def test_drive_of_a_joint_is_no_unknown_and_acts_back_on_the_carrier() -> None:
    bodies = {"arm": Body(mass=1, inertia={"Izz": "J"}), "wheel": Body(mass=2, inertia={"Izz": "I"})}
    joints = {"A": Revolute("ground", "arm", q="a"), "B": Revolute("arm", "wheel", q="b")}
    system = System("driven", parameters={"J": 3, "I": 1, "tau": 2}, bodies=bodies, joints=joints,
                    forces={"motor": Torque("tau", joint="B")})
    found = derive(system, "newton_euler")
    assert "J*a'' = -tau" in str(found)
    assert "I*a'' + I*b'' = tau" in str(found)
    assert "B_mz" not in [symbol.name for symbol in found.reactions]


def test_slide_along_no_axis_keeps_two_components_and_says_so() -> None:
    system = System(
        "incline", gravity=[0, "-g", 0], parameters={"m": 1, "g": 9.81, "a": 0.3}, bodies={"block": Body(mass="m")},
        joints={"plane": Prismatic("ground", "block", axis=["cos(a)", "sin(a)", 0], q="s")},
    )
    found = derive(system, "newton_euler")
    assert [symbol.name for symbol in found.reactions] == ["plane_fx", "plane_fy"]
    assert "Free directions" in [step.title for step in found.steps]
    assert str(found).splitlines()[-1] == "R_plane_x*cos(a) + R_plane_y*sin(a) = 0"


def test_steps_and_data() -> None:
    found = derive(pendulum_in_xy(), "newton_euler")
    titles = [step.title for step in found.steps]
    assert titles[-4:] == ["Body bob", "Accelerations of the constraints", "Equations of motion", "Matrix form"]
    assert "Kinetic energy" not in titles
    data = json.loads(json.dumps(derivation_data(derive(spherical_pendulum(), "newton_euler"))))
    assert data["method"] == "newton_euler"
    assert "pin_fx" in data["reactions"]
    assert "post_mz" not in data["reactions"]
    assert "Body yoke" in write_document(derivation_document(derive(spherical_pendulum(), "newton_euler")), "text")
