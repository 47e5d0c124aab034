"""Mass matrix, inverse and hybrid dynamics as a user compiles them, against the state derivative."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mechanisms import random_case, random_state

import multibody_sym as mbs

CART_POLE = """
multibody_sym: 1
name: cart_pole
gravity: [0, -g, 0]
parameters: {M: 2, m: 0.5, l: 0.8, g: 9.81}
bodies:
  cart: {mass: M}
  bob: {mass: m, com: [0, -l, 0]}
joints:
  slide: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: bob, axis: z, q: phi}
forces: {push: {type: torque, joint: slide, value: F}}
inputs: {F: 3*t}
"""
Q, U = [0.3, 0.7], [0.1, -0.4]


def cart_pole() -> mbs.System:
    return mbs.loads(CART_POLE)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_textbook_mass_matrix(backend) -> None:
    matrix = mbs.compile(mbs.mass_matrix(cart_pole()), backend=backend)
    coupling = 0.5 * 0.8 * np.cos(0.7)
    np.testing.assert_allclose(matrix(0.0, Q, U), [[2.5, coupling], [coupling, 0.5 * 0.64]], rtol=1e-14)
    assert matrix(0.0, Q, U, parameters={"M": 7})[0, 0] == pytest.approx(7.5)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_held_cart_leaves_a_pendulum(backend) -> None:
    """With the cart's acceleration given, l phi'' = -g sin(phi) - x'' cos(phi), and the force is Newton's less F."""
    hybrid = mbs.compile(mbs.hybrid_dynamics(cart_pole(), given=["slide"]), backend=backend)
    udot, forces = hybrid(2.0, Q, U, [1.5, np.nan if backend == "c" else 0.0])
    turning = (-9.81 * np.sin(0.7) - 1.5 * np.cos(0.7)) / 0.8
    needed = 2.5 * 1.5 + 0.4 * (turning * np.cos(0.7) - 0.4**2 * np.sin(0.7))
    np.testing.assert_allclose(udot, [1.5, turning], rtol=1e-13)
    np.testing.assert_allclose(forces, [needed - 6.0, 0.0], rtol=1e-13)
    assert hybrid(2.0, Q, U, [1.5, 0.0], inputs={"F": 0}).forces[0] == pytest.approx(needed)


def test_inverse_dynamics_undoes_the_state_derivative() -> None:
    """Accelerations that arise by themselves need no force; others need M times what they differ by."""
    for seed in (7, 8, 10):
        case = random_case(seed, bodies=(2, 5))
        t, q, u = random_state(np.random.default_rng(seed), case)
        free = mbs.compile(mbs.state_derivative(case.system), backend="python")(t, [*q, *u])[len(q) :]
        forces = mbs.compile(mbs.inverse_dynamics(case.system), backend="python")
        matrix = mbs.compile(mbs.mass_matrix(case.system), backend="python")(t, q, u)
        other = np.random.default_rng(seed).uniform(-1, 1, len(u))
        size = np.abs(matrix) @ (np.abs(free) + np.abs(other))
        assert (np.abs(forces(t, q, u, free)) <= 1e-9 * size + 1e-9).all()
        assert (np.abs(forces(t, q, u, free + other) - matrix @ other) <= 1e-9 * size + 1e-9).all()


def test_wrong_questions_are_answered_in_words() -> None:
    with pytest.raises(mbs.InputError, match=r"no joint .hing..*hinge"):
        mbs.hybrid_dynamics(cart_pole(), given=["hing"])
    forces = mbs.compile(mbs.inverse_dynamics(cart_pole()), backend="python")
    with pytest.raises(mbs.InputError, match="inverse_dynamics needs udot"):
        forces(0.0, Q, U)
    with pytest.raises(mbs.InputError, match=r"udot has the shape \(1,\), not \(2,\)"):
        forces(0.0, Q, U, [1])
    with pytest.raises(mbs.InputError, match="u is to be real numbers, got 'fast'"):
        forces(0.0, Q, "fast", U)
    with pytest.raises(mbs.InputError, match="q has the shape"):
        forces(0.0, [1], U, U)
    with pytest.raises(mbs.InputError, match="mass_matrix takes no udot"):
        mbs.compile(mbs.mass_matrix(cart_pole()), backend="python")(0.0, Q, U, U)


def test_constraints_and_missing_mass() -> None:
    held = mbs.loads(CART_POLE + "constraints: {tie: {type: expression, zero: x + phi}}\n")
    with pytest.raises(mbs.ModelError, match="'tie' restricts the joints"):
        mbs.compile(mbs.inverse_dynamics(held))
    assert mbs.compile(mbs.mass_matrix(held), backend="python")(0.0, Q, U)[0, 0] == pytest.approx(2.5)
    light = mbs.loads(CART_POLE.replace("{mass: m, com: [0, -l, 0]}", "{}"))
    with pytest.raises(mbs.NoSolutionError, match="joint 'hinge' moves nothing that has mass"):
        mbs.compile(mbs.hybrid_dynamics(light, given=["slide"]))
    hybrid = mbs.compile(mbs.hybrid_dynamics(light, given=["hinge"]), backend="python")
    assert hybrid(0.0, Q, U, [0.0, 1.0])[0] == pytest.approx([0.0, 1.0])


def test_compile_and_function_are_one_face() -> None:
    """What acts in contacts and by friction is part of Q: no question leaves it out."""
    compiled = mbs.compile(mbs.inverse_dynamics(cart_pole()), backend="python")
    asked = mbs.function(cart_pole(), "inverse_dynamics", backend="python")
    assert type(compiled) is mbs.Function
    np.testing.assert_array_equal(compiled(0.1, Q, U, U), asked(0.1, Q, U, U))
    rubs = cart_pole()
    rubs = replace(rubs, forces={**rubs.forces, "rub": mbs.Friction(joint="slide", static=0.2, kinetic=0.1)})
    for question in (mbs.inverse_dynamics(rubs), mbs.hybrid_dynamics(rubs, "slide")):
        with pytest.raises(mbs.ModelError, match="rub may hold or let go"):
            mbs.compile(question)
