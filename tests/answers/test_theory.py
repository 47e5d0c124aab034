"""Actions, Poisson brackets, canonical transformations and phase portraits, against closed forms and slow runs."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import sympy
from mpmath import mp

import multibody_sym as mbs
from multibody_sym.analysis.phase_plane import PhasePlane
from multibody_sym.answers.ask.energy_integral import ToAndFro
from multibody_sym.answers.instant.instant import solved_start
from multibody_sym.derivation.symbolic_equations import ENERGY, separated
from multibody_sym.documents.diagrams import polhodes_of
from multibody_sym.errors import MultibodyError
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.text.printer import text

_EXAMPLES = Path(__file__).parents[2] / "examples"
_HEAD = "multibody_sym: 1\n"
_PENDULUM = f"""{_HEAD}name: p
gravity: [0, -g, 0]
parameters: {{m: 1.2, l: 0.5, g: 9.81, a: 2}}
bodies: {{bob: {{mass: m, com: [0, -l, 0]}}}}
joints: {{hinge: {{type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {{q: a}}}}}}
simulation: {{t_end: 2}}
"""
_WELL = f"""{_HEAD}name: w
gravity: [0, 0, 0]
parameters: {{m: 1, a: 2, b: 1, x0: 1.8}}
bodies: {{block: {{mass: m}}}}
joints: {{rail: {{type: prismatic, axis: x, parent: ground, child: block, q: x, initial: {{q: x0}}}}}}
forces: {{well: {{type: potential, joint: rail, value: -a*x^2/2 + b*x^4/4}}}}
simulation: {{t_end: 2}}
"""
_TOP = f"""{_HEAD}name: b
gravity: [0, 0, 0]
parameters: {{A: 1, B: 2, C: 2.5}}
bodies: {{b: {{mass: 1, inertia: {{Ixx: A, Iyy: B, Izz: C}}}}}}
joints:
  ball: {{type: custom, parent: ground, child: b, free: [{{rotate: z}}, {{rotate: x}}, {{rotate: z}}],
         q: [psi, th, phi], initial: {{q: [0.1, 1, 0.3], u: [1, 2, 0.5]}}}}
ask:
  x_y: {{bracket: [angular_momentum(x), angular_momentum(y)]}}
  z_H: {{bracket: [angular_momentum(z), total_energy()]}}
"""


@cache
def _solved(name: str) -> mbs.Solution:
    return mbs.solve(mbs.load(_EXAMPLES / "questions" / f"{name}.yaml"))


def test_actions_of_an_orbit_add_to_a_function_of_its_energy() -> None:
    """J_r + J_phi = k sqrt(m/(2 |E|)), and both frequencies are 2 pi/T of Kepler's third law."""
    found = _solved("actions_of_an_orbit").answers
    k, m, R, v = 3.0, 2.0, 1.5, 1.1
    energy = m * v * v / 2 - k / R
    value = {name: x.value or 0.0 for name, x in found.items()}
    assert value["J_r"] + value["J_phi"] == pytest.approx(k * math.sqrt(m / (2 * abs(energy))), rel=1e-12)
    a = k / (2 * abs(energy))
    assert value["J_r.frequency"] == pytest.approx(math.sqrt(k / m / a**3), rel=1e-12)
    assert value["J_phi.frequency"] == pytest.approx(math.sqrt(k / m / a**3), rel=1e-12)
    assert all(found[name].expression is not None for name in ("J_r", "J_r.frequency", "J_phi", "J_phi.frequency"))


def test_first_integrals_have_no_bracket_with_the_energy() -> None:
    found = _solved("actions_of_an_orbit").answers
    assert text(found["spin"].expression) == text(found["axis"].expression) == "0"
    assert found["spin"].value == found["axis"].value == 0.0


def test_an_oscillator_has_the_action_E_over_w_and_canonical_angle_and_action() -> None:
    solved = _solved("canonical_oscillator")
    found = solved.answers
    assert found["J"].value == pytest.approx(50 * 0.1**2 / 2 / 5, rel=1e-14)
    assert text(found["J.frequency"].expression) == "sqrt(k/m)"
    assert (found["angle.Q_P"].value, found["twice.Q_P"].value) == (1.0, 2.0)
    told = "; ".join(map(str, solved.conditions))
    assert "angle: canonical: {Q, P} = 1" in told
    assert "twice: not canonical: {Q, P} = 2" in told


@pytest.mark.parametrize("start", [0.7, 2.9])
def test_a_pendulum_has_its_action_by_elliptic_integrals(start: float) -> None:
    """J = 8 m l^2 w0 (E(k) - (1 - k^2) K(k))/pi, k = sin(a/2)."""
    m, l, g = 1.2, 0.5, 9.81
    k = mp.sin(mp.mpf(start) / 2)
    wanted = 8 * m * l**2 * math.sqrt(g / l) * (mp.ellipe(k * k) - (1 - k * k) * mp.ellipk(k * k)) / mp.pi
    model = mbs.loads(_PENDULUM + "ask: {J: {action: theta}}")
    found = mbs.solve(model, parameters={"a": start}).answers
    assert found["J"].value == pytest.approx(float(wanted), rel=1e-12)
    motion = solved_start(mbs.loads(_PENDULUM.replace("a: 2", f"a: {start}")))
    swing = ToAndFro.of(motion, "theta")
    assert swing is not None
    parts = swing.elliptic()
    assert parts is not None
    assert evaluate_float(parts, motion.sample) == pytest.approx([m * l**2, g / l, float(k * k)], rel=1e-12)
    frequency = mp.pi * math.sqrt(g / l) / 2 / mp.ellipk(k * k)
    assert found["J.frequency"].value == pytest.approx(float(frequency), rel=1e-12)


def test_an_action_stays_while_a_spring_grows_slowly() -> None:
    """E/w over 27 periods in which the stiffness doubles; the energy does not stay."""
    model = mbs.loads(
        _WELL.replace("-a*x^2/2 + b*x^4/4", "a*(1 + t/b)*x^2/2").replace("b: 1", "b: 100")
        + "outputs: {J: total_energy()/sqrt(a*(1 + t/b)/m), E: total_energy()}"
    )
    run = mbs.simulate(model, t_end=100, samples=2, backend="python")
    assert run["J"][-1] == pytest.approx(run["J"][0], rel=5e-3)
    assert run["E"][-1] > 1.4 * run["E"][0]


def test_angular_momenta_of_a_body_have_brackets_of_each_other() -> None:
    found = mbs.solve(mbs.loads(_TOP)).answers
    assert text(found["x_y"].expression) == "p_psi"  # which is angular_momentum(z)
    assert found["z_H"].value == 0.0


def test_the_phase_plane_of_a_double_well_has_its_fixed_points_and_separatrix() -> None:
    """H = p^2/2 - x^2 + x^4/4: centres at +-sqrt(2) with H = -1, a saddle at 0, through which p^2 = 2 x^2 - x^4/2."""
    plane = PhasePlane.of(mbs.loads(_WELL), "x").portrait()
    kinds = [(x.kind, round(x.q, 9), round(x.energy, 9)) for x in plane.fixed_points]
    root = round(math.sqrt(2), 9)
    assert kinds == [("centre", -root, -1.0), ("saddle", 0.0, 0.0), ("centre", root, -1.0)]
    for curve in (x for x in plane.curves if x.kind == "separatrix"):
        q, p = curve.points.T
        np.testing.assert_allclose(p**2, np.maximum(2 * q**2 - q**4 / 2, 0.0), atol=1e-9)
    start = next(x for x in plane.curves if x.kind == "start")
    assert start.closed
    assert start.points[:, 0].min() == pytest.approx(math.sqrt(4 - 1.8**2), rel=1e-9)


@pytest.mark.parametrize("start", [1.42, math.sqrt(2), 1.6, -1.3])
def test_a_phase_portrait_shows_the_well_behind_the_next_saddle(start: float) -> None:
    """A motion that stays in one well of H = p^2/2 - x^2 + x^4/4 has the other one beside it, with its curves."""
    plane = PhasePlane.of(mbs.loads(_WELL.replace("x0: 1.8", f"x0: {start!r}")), "x").portrait()
    root = math.sqrt(2)
    assert [x.kind for x in plane.fixed_points] == ["centre", "saddle", "centre"]
    assert [x.q for x in plane.fixed_points] == pytest.approx([-root, 0.0, root], abs=1e-9)
    for side in (-1.0, 1.0):
        assert any(x.kind == "orbit" and x.closed and np.all(side * x.points[:, 0] > 0.0) for x in plane.curves)
    begins = [x for x in plane.curves if x.kind == "start"]
    assert all(np.all(start * x.points[:, 0] > 0.0) for x in begins)


def test_a_bead_on_a_hoop_that_turns_fast_has_centres_beside_the_bottom() -> None:
    """cos(theta) = g/(R w^2), by Jacobi's integral; a slow hoop has one at the bottom."""
    model = mbs.load(_EXAMPLES / "bead_on_hoop.yaml")
    found = PhasePlane.of(model, "theta").fixed_points
    wanted = math.acos(9.81 / (0.3 * 64))
    assert [x.q for x in found if x.kind == "centre"] == pytest.approx([-wanted, wanted], rel=1e-9)
    assert [x.q for x in found if x.kind == "saddle"] == pytest.approx([-math.pi, 0.0, math.pi], rel=1e-9)
    figure = mbs.draw(model, phase="theta")
    assert "Centres at -1.035, 1.035. Saddles at -pi, 0, pi." in figure.description
    assert figure.svg.count("<svg") == 1


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ("{action: phi}", "no coordinate is called 'phi'"),
        ("{bracket: [theta]}", "expected a list of 2"),
        ("{bracket: [theta, p_phi]}", "'p_phi' is not declared"),
        ("{value: p_theta}", "'p_theta' is not declared"),
        ("{canonical: {Q: theta}}", "each coordinate before its momentum"),
        ("{canonical: {Q: theta, P: p_theta, R: theta, S: theta}}", "2 pairs for 1 coordinates"),
    ],
)
def test_what_does_not_fit_is_an_error(asked: str, message: str) -> None:
    with pytest.raises(MultibodyError, match=message):
        mbs.solve(mbs.loads(_PENDULUM + f"ask: {{b: {asked}}}"))


def test_a_coordinate_that_constraints_restrict_has_no_action() -> None:
    model = mbs.load(_EXAMPLES / "impacts" / "ballistic_pendulum.yaml").with_fields({"ask": {"J": mbs.Ask(action="x")}})
    found = mbs.solve(model)
    assert found.answers["J"].value is None
    assert any("independent coordinates" in str(x) for x in found.conditions)


def test_a_phase_portrait_needs_one_freedom_that_keeps_its_energy() -> None:
    damped = _PENDULUM + "forces: {d: {type: damper, joint: hinge, damping: 1}}"
    with pytest.raises(MultibodyError, match="d may do work"):
        mbs.draw(mbs.loads(damped), phase="theta")
    shaken = _PENDULUM + "forces: {V: {type: potential, joint: hinge, value: 3*sin(t)*theta^2}}"
    with pytest.raises(MultibodyError, match=r"V changes with time, and the energy with it(?!.*declare)"):
        mbs.draw(mbs.loads(shaken), phase="theta")
    with pytest.raises(MultibodyError, match="is free beside it"):
        mbs.draw(mbs.loads(_TOP.partition("ask")[0]), phase="th")
    with pytest.raises(MultibodyError, match="no coordinate is called 'x'"):
        mbs.draw(mbs.loads(_PENDULUM), phase="x")


def test_a_plate_and_a_weight_have_the_principal_axes_of_their_tensor() -> None:
    """Of numpy's eigenvalues of the plate's tensor and a mass at its corner; tan(2 a) = 2 J_xy/(J_xx - J_yy)."""
    found = _solved("plate_with_a_weight").answers
    m, a, b = 2.0, 0.3, 0.2
    reduced = m * (m / 5) / (m + m / 5)
    x, y = a / 2, b / 2
    tensor = np.diag([m * b * b, m * a * a, m * (a * a + b * b)]) / 12
    tensor += reduced * np.array([[y * y, -x * y, 0], [-x * y, x * x, 0], [0, 0, x * x + y * y]])
    moments = [found[f"both.{n}"].value for n in (1, 2, 3)]
    np.testing.assert_allclose(moments, np.linalg.eigvalsh(tensor), rtol=1e-12)
    angle = found["both.angle"].value or 0.0
    axis = np.array([math.cos(angle), math.sin(angle), 0.0])
    np.testing.assert_allclose(tensor @ axis, np.linalg.eigvalsh(tensor)[0] * axis, atol=1e-15)
    assert all(x.expression is not None for x in found.values())


def test_axes_in_space_are_those_of_the_tensor() -> None:
    model = """multibody_sym: 1
name: b
bodies: {b: {mass: 1, inertia: {Ixx: 3, Iyy: 4, Izz: 5, Ixy: 0.5, Ixz: -0.3, Iyz: 0.2}}}
joints: {f: {type: free, parent: ground, child: b, initial: {q: [0, 0, 0, 1, 0.2, 0.3, 0.4]}}}
ask: {J: {principal_axes: b}}
"""
    found = mbs.solve(mbs.loads(model)).answers
    axes = np.array([[found[f"J.{n}.{x}"].value for x in "xyz"] for n in (1, 2, 3)])
    moments = np.array([found[f"J.{n}"].value for n in (1, 2, 3)])
    tensor = np.array([[3, 0.5, -0.3], [0.5, 4, 0.2], [-0.3, 0.2, 5]])
    np.testing.assert_allclose(axes.T @ np.diag(moments) @ axes, tensor, atol=1e-12)


def _is_solved(H: sympy.Expr, pairs: list[tuple[sympy.Symbol, sympy.Symbol]], E: sympy.Symbol) -> bool:
    """Return whether the slopes of W, put in for the momenta, satisfy H = E."""
    parts = separated(H, pairs)
    left = H.subs({x.momentum: x.slope for x in reversed(parts)})
    return len(parts) == len(pairs) and sympy.simplify(left - E) == 0


def test_orbits_separate_in_spherical_and_in_parabolic_coordinates() -> None:
    """The slopes of W fulfil H(q, dW/dq) = E, in parabolic coordinates beside a uniform field too."""
    m, k, f, r, th, phi, x, y = sympy.symbols("m k f r theta phi xi eta", positive=True)
    p_r, p_th, p_phi, p_x, p_y = sympy.symbols("p_r p_theta p_phi p_xi p_eta", real=True)
    E = ENERGY
    kinetic = p_r**2 + p_th**2 / r**2 + p_phi**2 / (r**2 * sympy.sin(th) ** 2)
    assert _is_solved(kinetic / (2 * m) - k / r, [(r, p_r), (th, p_th), (phi, p_phi)], E)
    kinetic = 2 * (x * p_x**2 + y * p_y**2) / (m * (x + y)) + p_phi**2 / (2 * m * x * y)
    assert _is_solved(kinetic - 2 * k / (x + y) + f * (x - y), [(x, p_x), (y, p_y), (phi, p_phi)], E)
    assert not separated(p_x**2 + p_y**2 + k * x**2 * y, [(x, p_x), (y, p_y)])


def test_a_derivation_shows_the_separated_equations() -> None:
    found = mbs.derive(mbs.load(_EXAMPLES / "questions" / "actions_of_an_orbit.yaml"), method="hamilton")
    step = found.steps[-1]
    assert step.title == "Hamilton-Jacobi equation"
    assert len(step.equations) == 4  # H = E, the slope by phi, H with its constant, the slope by r
    assert "W = W_phi(phi) + W_r(r)" in step.note


def test_polhodes_keep_energy_and_angular_momentum() -> None:
    """Each curve has one T and one L; the racket's motion surrounds the axis that the signs of L^2 - 2 T B tell."""
    shown = polhodes_of(mbs.load(_EXAMPLES / "tennis_racket.yaml"), "racket")
    square, energy = shown.moments**2 @ shown.omega**2, shown.moments @ shown.omega**2
    assert shown.surrounded == (2 if square > energy * shown.moments[1] else 0)
    for kind, way in shown.curves():
        np.testing.assert_allclose(way**2 @ shown.moments, energy, rtol=1e-12)
        wanted = {"start": square, "separatrix": energy * shown.moments[1]}.get(kind, way[0] ** 2 @ shown.moments**2)
        np.testing.assert_allclose(way**2 @ shown.moments**2, wanted, rtol=1e-12)
    assert "axis 2 unstable" in mbs.draw(mbs.load(_EXAMPLES / "tennis_racket.yaml"), phase="racket").description
    with pytest.raises(MultibodyError, match="does not turn"):
        mbs.draw(mbs.loads(_PENDULUM), phase="bob")


@pytest.mark.parametrize(
    ("moments", "told"),
    [
        ("Ixx: 2, Iyy: 2, Izz: 3", "circles about axis 3. The declared motion surrounds axis 3"),
        ("Ixx: 1, Iyy: 3, Izz: 3", "circles about axis 1. The declared motion surrounds axis 1"),
        ("Ixx: 2, Iyy: 2, Izz: 2", "every polhode is a point. The declared motion turns steadily."),
    ],
)
def test_polhodes_of_two_equal_moments_are_circles_about_the_other_axis(moments: str, told: str) -> None:
    """Axes are numbered by their moments: about the axis of the other one omega keeps its component."""
    model = mbs.loads(
        f"{_HEAD}name: b\ngravity: [0, 0, 0]\nbodies: {{b: {{mass: 1, inertia: {{{moments}}}}}}}\n"
        "joints: {j: {type: free, parent: ground, child: b, initial: {u: [0, 0, 0, 1, 2, 3]}}}\n"
    )
    shown = polhodes_of(model, "b")
    assert told in shown.description
    for kind, way in shown.curves():
        axis = 2 if "axis 3" in told else 0
        np.testing.assert_allclose(way[:, axis], way[0, axis], rtol=1e-9, err_msg=kind)
