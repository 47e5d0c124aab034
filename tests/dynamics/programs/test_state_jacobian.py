"""The Jacobian of the state derivative against differences of it: through inputs, rows and quaternions."""

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.program import derivatives
from multibody_sym.program.program import interpret

HELD = """
multibody_sym: 1
name: small
gravity: [0, -g, 0]
parameters: {g: 9.81, l: 1 m, k: 3}
bodies: {bob: {mass: 2 kg, inertia: {Izz: 1}}}
joints: {plane: {type: planar, parent: ground, child: bob, q: [x, y, turn], initial: {q: [l, 0, 0.3]}}}
forces: {push: {type: torque, on: bob, value: [0, 0, P]}}
constraints: {rod: {type: distance, between: [ground, bob], value: l}}
inputs: {P: k*sin(t)*turn - 2*u_x*x}
"""
TOP = """
multibody_sym: 1
name: small
gravity: [0, 0, -9.81]
bodies: {top: {mass: 1 kg, com: [0, 0, 0.1], inertia: {Ixx: 2, Iyy: 3, Izz: 4}}}
joints: {ball: {type: spherical, parent: ground, child: top}}
"""


@pytest.mark.parametrize("text", [HELD, TOP], ids=["rows and inputs", "quaternion"])
@pytest.mark.parametrize("formalism", ["composite_body", "block_ldl"])
@pytest.mark.parametrize("largest", [10_000, 0], ids=["inline", "called"])
def test_the_jacobian_is_the_limit_of_differences(text, formalism, largest, monkeypatch):
    monkeypatch.setattr(derivatives, "_LARGEST_INLINE", largest)
    system = mechanism(mbs.loads(text))
    made = programs(system, FORMALISMS[formalism], "implicit")
    begin = start(system)
    nq, size = made.nq, made.nq + made.nu
    x = np.array([*begin.q, *begin.u]) + 0.1 * np.sin(1.0 + np.arange(size))

    def arguments(x):
        given = (0.7, x[:nq], x[nq:], np.array(begin.parameters))
        return (*given, interpret(made.inputs, *given)[0], np.zeros(0))

    def rates(x):
        return np.concatenate(interpret(made.state_derivative, *arguments(x))[:2])

    (found,) = interpret(made.jacobian, *arguments(x))
    step = 1e-5
    wanted = [(rates(x + step * e) - rates(x - step * e)) / (2 * step) for e in np.eye(size)]
    np.testing.assert_allclose(found, np.array(wanted).T, atol=1e-7 * np.abs(found).max())


def test_it_is_derived_for_implicit_methods_only():
    system = mechanism(mbs.loads(TOP))
    assert programs(system, FORMALISMS["block_ldl"]).jacobian is None
