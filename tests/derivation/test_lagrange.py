"""Lagrange's equations against books' closed forms, Euler's equations, and composite bodies term by term."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy
from mechanisms import Case, random_case, random_state
from textbook import (
    cart_pole,
    double_pendulum,
    elastic_pendulum,
    hanging_mass,
    pendulum,
    positive,
    spherical_pendulum,
    top,
)

from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.lagrange import lagrange
from multibody_sym.derivation.symbolic_equations import SymbolicEquations
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.equations import EquationsOfMotion
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.motion import State, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body
from multibody_sym.model.forces import SpringDamper
from multibody_sym.model.joints import Prismatic
from multibody_sym.model.system import System

sin, cos = sympy.sin, sympy.cos


def symbols(equations: SymbolicEquations) -> dict[str, Any]:
    """Return every symbol by name; accelerations as `a_<coordinate or speed>`."""
    s = equations.symbols
    groups = (s.coordinates, s.speeds, s.parameters, s.inputs, s.multipliers)
    known = {x.name: x for group in groups for x in group}
    return {**known, **{f"a_{u.name.removeprefix('u_')}": a for u, a in zip(s.speeds, s.accelerations, strict=True)}}


def residuals(equations: SymbolicEquations) -> list[Any]:
    """Return left - right of each equation."""
    return [e.left - e.right for e in equations.equations]


def assert_same(found: Sequence[Any], book: Sequence[Any]) -> None:
    for left, right in zip(found, book, strict=True):
        assert sympy.simplify(left - right) == 0, f"{left} is not {right}"


# --- closed forms of books -----------------------------------------------------------------------------------------


def test_pendulum() -> None:
    equations = derive(pendulum())
    s = symbols(equations)
    m, L, g, theta, a = (s[x] for x in ("m", "l", "g", "theta", "a_theta"))
    assert_same(residuals(equations), [m * L**2 * a + m * g * L * sin(theta)])


def test_cart_pole() -> None:
    equations = derive(cart_pole())
    s = symbols(equations)
    M, m, L, g, F, theta, w = (s[x] for x in ("M", "m", "l", "g", "F", "theta", "u_theta"))
    book = [
        (M + m) * s["a_x"] + m * L * cos(theta) * s["a_theta"] - m * L * sin(theta) * w**2 - F,
        m * L * cos(theta) * s["a_x"] + m * L**2 * s["a_theta"] + m * g * L * sin(theta),
    ]
    assert_same(residuals(equations), book)


def test_elastic_pendulum() -> None:
    equations = derive(elastic_pendulum())
    s = symbols(equations)
    m, k, c, r0, g, r, theta = (s[x] for x in ("m", "k", "c", "r0", "g", "r", "theta"))
    v, w = s["u_r"], s["u_theta"]
    book = [
        m * r**2 * s["a_theta"] + 2 * m * r * v * w + m * g * r * sin(theta),
        m * s["a_r"] - m * r * w**2 + k * (r - r0) - m * g * cos(theta) + c * v,
    ]
    assert_same(residuals(equations), book)


def test_double_pendulum_in_relative_angles() -> None:
    equations = derive(double_pendulum())
    s = symbols(equations)
    m1, m2, l1, l2, g, q1, q2 = (s[x] for x in ("m1", "m2", "l1", "l2", "g", "q1", "q2"))
    u1, u2, a1, a2 = s["u_q1"], s["u_q2"], s["a_q1"], s["a_q2"]
    outer = m2 * l2**2 + m2 * l1 * l2 * cos(q2)
    weight = m2 * g * l2 * sin(q1 + q2)
    book = [
        ((m1 + m2) * l1**2 + m2 * l2**2 + 2 * m2 * l1 * l2 * cos(q2)) * a1 + outer * a2
        - m2 * l1 * l2 * sin(q2) * (2 * u1 * u2 + u2**2) + (m1 + m2) * g * l1 * sin(q1) + weight,
        outer * a1 + m2 * l2**2 * a2 + m2 * l1 * l2 * sin(q2) * u1**2 + weight,
    ]
    assert_same(residuals(equations), book)


def test_spherical_pendulum() -> None:
    equations = derive(spherical_pendulum())
    s = symbols(equations)
    m, L, g, theta, v, w = (s[x] for x in ("m", "l", "g", "theta", "u_phi", "u_theta"))
    book = [
        m * L**2 * (sin(theta) ** 2 * s["a_phi"] + 2 * sin(theta) * cos(theta) * v * w),
        m * L**2 * (s["a_theta"] - sin(theta) * cos(theta) * v**2) + m * g * L * sin(theta),
    ]
    assert_same(residuals(equations), book)


def test_top_with_a_quaternion_obeys_eulers_equations() -> None:
    """J omega' + omega x J omega = r x m R^T g, J about the fixed point, R of a unit quaternion."""
    equations = derive(top())
    s = symbols(equations)
    m, L, g = s["m"], s["l"], s["g"]
    J = sympy.diag(s["A"] + m * L**2, s["B"] + m * L**2, s["C"])
    omega = sympy.Matrix([s["ball_wx"], s["ball_wy"], s["ball_wz"]])
    rate = sympy.Matrix([s["a_ball_wx"], s["a_ball_wy"], s["a_ball_wz"]])
    w, x, y, z = (s[f"ball_q{c}"] for c in "wxyz")
    up = sympy.Matrix([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)])  # R^T e_z
    moment = sympy.Matrix([0, 0, L]).cross(-m * g * up)
    assert_same(residuals(equations), list(J * rate + omega.cross(J * omega) - moment))


def test_projection_of_a_quaternions_terms_is_omega_cross_momentum() -> None:
    """N^T (d/dt (2 E^T) - (d(2 E q')/dq)^T) p = omega x p for N = E^T / 2 and q' = N omega, |q| = 1."""
    w, x, y, z = q = sympy.symbols("w x y z", real=True)
    omega = sympy.Matrix(sympy.symbols("o1:4", real=True))
    p = sympy.Matrix(sympy.symbols("p1:4", real=True))
    E = sympy.Matrix([[-x, w, z, -y], [-y, -z, w, x], [-z, y, -x, w]])
    rates = sympy.Matrix(sympy.symbols("r1:5", real=True))
    N, along = E.T / 2, E.T * omega / 2
    at_unit = {w**2: 1 - x**2 - y**2 - z**2}
    turned = 2 * E.subs(dict(zip(q, along, strict=True)), simultaneous=True)
    slope = (2 * E * rates).jacobian(q).subs(dict(zip(rates, along, strict=True)), simultaneous=True)
    projected = N.T * (turned.T - slope.T) * p
    difference = (projected - omega.cross(p)).applyfunc(lambda e: sympy.expand(sympy.expand(e).subs(at_unit)))
    assert difference == sympy.zeros(3, 1)


# --- term by term --------------------------------------------------------------------------------------------------


def assert_terms_agree(case: Case, found: EquationsOfMotion, expected: EquationsOfMotion, state: State) -> None:
    mass = np.array(expected.mass_matrix, dtype=float)
    square = max(1, *np.abs(state.u)) ** 2
    wrenches = applied_forces(motion_of(case.mechanism, state)).of_body
    largest = np.abs(mass).max()
    size = {"mass_matrix": largest, "velocity_terms": largest * square, "constraint_forcing": square}
    size["applied"] = np.abs(np.array(wrenches, dtype=float)).max()  # which cancel where a joint lets all move
    for part in ("mass_matrix", "applied", "velocity_terms", "constraint_jacobian", "constraint_forcing", "rates"):
        a, b = (np.array(getattr(e, part), dtype=float) for e in (found, expected))
        assert a.shape == b.shape
        scale = size.get(part, 0.0) + (np.abs(b).max() if b.size else 0.0)
        assert np.all(np.abs(a - b) <= 1e-10 * scale), f"seed {case.seed}: {part}"


@pytest.mark.parametrize("block", range(4))
def test_agrees_with_composite_bodies_term_by_term(block: int) -> None:
    """M, Q, c and N are the same for all joints and loads that the random systems know."""
    for seed in range(2000 + 5 * block, 2005 + 5 * block):
        case = random_case(seed, bodies=(1, 4))
        for sample in range(2):
            t, q, u = random_state(np.random.default_rng([seed, sample]), case)
            state = case.state(t, q, u)
            found, expected = lagrange(case.mechanism, state), composite_body(case.mechanism, state)
            assert_terms_agree(case, found, expected, state)


def test_a_spring_whose_stiffness_depends_on_a_coordinate_has_no_potential() -> None:
    """F = k(x) (x - l) is not the gradient of k(x) (x - l)^2 / 2."""
    system = System(
        "stiffening",
        parameters=positive("m k"),
        bodies={"block": Body(mass="m")},
        joints={"rail": Prismatic("ground", "block", axis="x", q="x")},
        forces={"spring": SpringDamper(joint="rail", stiffness="k*(1 + x^2)", length=1)},
    )
    equations = derive(system)
    s = symbols(equations)
    assert equations.potential_energy == 0
    assert_same(residuals(equations), [s["m"] * s["a_x"] + s["k"] * (1 + s["x"] ** 2) * (s["x"] - 1)])


def test_literal_numbers_are_exact() -> None:
    """0.1 kg at 0.3 m: the mass matrix is 9/1000, not a float near it."""
    declared = pendulum()
    light = replace(declared, parameters={}, gravity=[0, -10, 0], bodies={"bob": Body(mass=0.1, com=[0, -0.3, 0])})
    equations = derive(light)
    assert equations.mass_matrix[0, 0] == sympy.Rational(9, 1000)
    assert equations.equations[0].left.coeff(sin(symbols(equations)["theta"])) == sympy.Rational(3, 10)


def test_runs_over_every_scalar() -> None:
    """The derived equations evaluate over sympy expressions as they do over floats."""
    resolved = mechanism(double_pendulum())
    q = sympy.symbols("a b", real=True)
    values = [1.0, 0.5, 2.0, 0.7, 9.81]
    exact = lagrange(resolved, state_of(resolved, sympy.Expr, 0, q, (0, 0), [sympy.Rational(str(v)) for v in values]))
    numeric = lagrange(resolved, state_of(resolved, float, 0.0, (0.3, -0.8), (0.0, 0.0), values))
    at = {q[0]: 0.3, q[1]: -0.8}
    assert float(exact.mass_matrix[0][0].subs(at)) == pytest.approx(numeric.mass_matrix[0][0], rel=1e-12)
    assert float(exact.applied[0].subs(at)) == pytest.approx(numeric.applied[0], rel=1e-12)


def test_rows_ask_for_multipliers() -> None:
    resolved = mechanism(hanging_mass())
    with pytest.raises(ModelError, match="choose multipliers"):
        lagrange(resolved, state_of(resolved, float, 0.0, (-1.0,), (0.0,), [1.0, 1.0, 9.81, 0.0, 0.0]))


def test_the_table_of_formalisms_does_not_import_sympy() -> None:
    code = "import sys, multibody_sym.derivation.routes; sys.exit('sympy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


_PRINTED = """
import sys
sys.path[:0] = sys.argv[2:]
from textbook import chain
from multibody_sym.derivation.lagrange import lagrange
from multibody_sym.dynamics.programs.system import state_derivative
from multibody_sym.mechanics.motion import slot_state
from multibody_sym.mechanics.resolve import mechanism
names = [f"{letter}{k}" for letter in ("mk" if sys.argv[1] == "plain" else "za") for k in range(3)]
resolved = mechanism(chain(names[:3], names[3:]))
print(state_derivative(resolved, lagrange(resolved, slot_state(resolved))))
"""


def test_programs_do_not_depend_on_names_or_hash_seeds() -> None:
    printed = set()
    for seed, names in (("0", "plain"), ("1", "plain"), ("2", "other"), ("3", "other")):
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        words = [sys.executable, "-c", _PRINTED, names, *sys.path]
        printed.add(subprocess.run(words, capture_output=True, text=True, check=True, env=environment).stdout)
    assert len(printed) == 1
    assert "udot" in printed.pop()
