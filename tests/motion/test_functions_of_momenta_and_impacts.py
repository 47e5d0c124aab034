"""Hamilton's equations and impacts as Functions: against accelerations, `solve`, differences and Hamilton's H."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from impact_problems import STONES
from rolling_and_loops import FOUR_BAR
from textbook import double_pendulum

import multibody_sym as mbs
from multibody_sym.scalars.arrays import Floats

PUSHED = """
multibody_sym: 1
name: pushed cart
gravity: [0, -9.81, 0]
parameters: {m: 0.7}
bodies:
  cart: {mass: 2}
  pole: {mass: m, com: [0.1, -0.25, 0], inertia: {Izz: 0.02}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  hinge: {type: revolute, parent: cart, child: pole, q: a}
forces: {drive: {type: force, on: cart, value: [push, 0, 0]}}
inputs: {push: -2*x - u_x*u_a + t}
"""  # an input that depends on speeds, which follow from momenta
BALL = """
multibody_sym: 1
name: ball
gravity: [0.3, 0, -9.81]
bodies: {top: {mass: 1.5, com: [0, 0.1, 0.3], inertia: {Ixx: 0.04, Iyy: 0.05, Izz: 0.03, Ixy: 0.002}}}
joints: {foot: {type: free, parent: ground, child: top}}
"""
ALONE = STONES.replace("b: {between", "# ").replace("u: [2, -3, 0]", "u: [2, -3, 0.4]")


def state_of(system: mbs.System, seed: int = 0) -> tuple[float, Floats, Floats]:
    """Return a state at random, or near the start where rows hold; quaternions have length one."""
    ready, rng = mbs.compile(mbs.state_derivative(system), backend="python").ready, np.random.default_rng(seed)
    q, u = ready.q0.copy(), ready.u0.copy()
    if not ready.mechanism.rows:
        q, u = q + 0.3 * rng.normal(size=q.size), u + rng.normal(size=u.size)
    for body in ready.mechanism.bodies:
        for places in body.quaternions:
            q[list(places)] /= np.linalg.norm(q[list(places)])
    return 0.2, q, u


def slopes(f: Callable[[Floats], Any], x: Floats) -> Floats:
    """Return the derivatives of a function by differences of fourth order."""
    step, columns = 1e-3, []
    for k in range(x.size):
        way = step * np.eye(x.size)[k]
        columns.append((8 * (f(x + way) - f(x - way)) - f(x + 2 * way) + f(x - 2 * way)) / (12 * step))
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("text", [PUSHED, BALL, FOUR_BAR])
def test_momenta_change_as_accelerations_say(text: str) -> None:
    """p' by the chain rule along the motion, with dp/dq, dp/du and udot of other Functions."""
    system = mbs.loads(text)
    f, momenta, motion = (
        mbs.function(system, what, backend="python")
        for what in ("canonical_equations", "generalized_momenta", "state_derivative")
    )
    t, q, u = state_of(system)
    p, along = momenta(t, q, u), motion(t, q, u)
    found = f(t, q, p)
    np.testing.assert_allclose(found.qdot, along.qdot, atol=1e-12)
    by_q, by_u, by_t = (momenta.derivative(by)(t, q, u) for by in ("q", "u", "t"))
    expected = by_q @ u + by_u @ along.udot + by_t[:, 0]
    np.testing.assert_allclose(found.pdot, expected, atol=1e-11 * (1 + np.abs(expected).max()))
    assert f.rows == motion.rows
    np.testing.assert_allclose(found.multipliers, along.multipliers, atol=1e-9)


def test_hamiltons_function_gives_both_rates() -> None:
    system = double_pendulum()
    f, energy = (mbs.function(system, what, backend="python") for what in ("canonical_equations", "hamiltonian"))
    t, q, p = state_of(system)
    found = f(t, q, p)
    np.testing.assert_allclose(energy.derivative("p")(t, q, p), found.qdot, rtol=1e-12)
    np.testing.assert_allclose(energy.derivative("q")(t, q, p), -found.pdot, rtol=1e-11)
    assert energy.arguments == ("t", "q", "p")
    assert energy.units == {"H": "J"}


def test_hamiltons_equations_are_differentiated_with_inputs_of_speeds() -> None:
    """By q, p and t against differences; with inputs given, free or held, in C and for many states."""
    system = mbs.loads(PUSHED)
    f = mbs.function(system, "canonical_equations")
    t, q, p = state_of(system)
    columns = {by: f.derivative(by)(t, q, p).pdot for by in ("q", "p", "t")}
    np.testing.assert_allclose(columns["q"], slopes(lambda x: f(t, x, p).pdot, q), atol=1e-9)
    np.testing.assert_allclose(columns["p"], slopes(lambda x: f(t, q, x).pdot, p), atol=1e-9)
    np.testing.assert_allclose(columns["t"], slopes(lambda x: f(float(x[0]), q, p).pdot, np.array([t])), atol=1e-9)
    held = f.derivative("p")(t, q, p, inputs={"push": 3.0}).pdot
    np.testing.assert_allclose(held, slopes(lambda x: f(t, q, x, inputs={"push": 3.0}).pdot, p), atol=1e-9)
    np.testing.assert_allclose(f.derivative("inputs")(t, q, p).pdot[:, 0], [1.0, 0.0], atol=1e-14)
    many = f(t, np.stack([q, q + 0.1]), p)
    np.testing.assert_array_equal(many.pdot[1], f(t, q + 0.1, p).pdot)
    again = pickle.loads(pickle.dumps(f))
    np.testing.assert_array_equal(again(t, q, p).pdot, f(t, q, p).pdot)
    with pytest.raises(mbs.InputError, match="known: t, q, p"):
        f.derivative("u")
    with pytest.raises(mbs.InputError, match=r"p has the shape \(1,\), not \(2,\)"):
        f(t, q, [1.0])


def test_momenta_of_what_may_let_go_need_a_mode() -> None:
    block = mbs.loads("""
multibody_sym: 1
name: block
gravity: [0, -9.81, 0]
bodies: {block: {mass: 1}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {P: {type: point, parent: ground, child: block, axes: xy, q: [x, y], initial: {u: [1, 0]}}}
contacts: {c: {between: [block, ground.floor]}}
""")
    with pytest.raises(mbs.ModelError, match=r'c may hold or let go.*mode="found"'):
        mbs.function(block, "canonical_equations", backend="python").names  # noqa: B018
    f = mbs.function(block, "canonical_equations", mode="found", backend="python")
    assert (f.mode, f.rows) == ({"c": "closed"}, ("c.normal",))
    np.testing.assert_allclose(f(0.0, [0, 0], [1, 0]).multipliers, [9.81])


# --- impacts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("text", "mode"), [(ALONE, None), (STONES, "found")])
def test_an_impact_is_that_of_solve_and_differentiated(text: str, mode: Any) -> None:
    system = mbs.loads(text)
    f, told = mbs.function(system, "impact", mode=mode, backend="python"), mbs.solve(system)
    q, u = (np.array(list(x.values())) for x in (told.coordinates, told.speeds))
    found, impact = f(0.0, q, u), told.impact
    assert impact is not None
    np.testing.assert_allclose(found.after, [x.value for x in impact.after.values()], atol=1e-12)
    for name, parts in impact.impulses.items():
        assert found.impulses[f.rows.index(f"{name}.normal")] == pytest.approx(parts["normal"].value, rel=1e-12)
    assert (found.holds >= 0).all()
    for by, moved in (("q", lambda x: f(0.0, x, u).after), ("u", lambda x: f(0.0, q, x).after)):
        np.testing.assert_allclose(
            f.derivative(by)(0.0, q, u).after, slopes(moved, q if by == "q" else u), atol=1e-9
        )
    by_m = f.derivative("parameters")(0.0, q, u).impulses[0, f.independent_parameters.index("m")]
    heavier = f(0.0, q, u, parameters={"m": 2.0}).impulses[0]
    assert (by_m, heavier) == (pytest.approx(found.impulses[0]), pytest.approx(2 * found.impulses[0]))


def test_a_mode_in_words_is_found_where_its_conditions_say_so() -> None:
    """Modes at 40 states at random: of all whose `holds` is positive the one that the compiled impact finds."""
    system = mbs.loads(STONES)
    words = ("open", "stick", "slide+", "slide-")
    modes = [{"a": a, "b": b} for a in words for b in words if {a, b} != {"stick"}]  # whose rows depend on each other
    every = mbs.functions(system, {str(k): {"what": "impact", "mode": mode} for k, mode in enumerate(modes)})
    reference, rng, met = mbs.compile(mbs.impact(system), backend="python"), np.random.default_rng(3), set()
    u = rng.normal(size=(40, 3)) * [1.0, 1.0, 8.0] - [0.0, 2.0, 0.0]
    found = [f(0.0, np.zeros(3), u) for f in every.values()]
    for k in range(len(u)):
        try:
            expected = reference(0.0, np.zeros(3), u[k]).u
        except mbs.NoSolutionError:
            continue
        fitting = [m for m, each in enumerate(found) if (each.holds[k] > 0).all() and np.abs(each.after[k]).max() > 0]
        met.update(fitting)
        near = [np.abs(found[m].after[k] - expected).max() < 1e-10 for m in fitting]
        assert not fitting or any(near), (u[k], [modes[m] for m in fitting])
    assert len(met) >= 3
    assert every["0"].mode == {"a": "open", "b": "open"}


def test_a_ball_that_does_not_slip_has_derivatives() -> None:
    """It sticks, and |p| of the impulses along the floor has the slope 0 where they vanish, as |x| has."""
    ball = mbs.loads("""
multibody_sym: 1
name: ball
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  ball: {shape: {sphere: 0.1, mass: 1}, surfaces: {skin: {sphere: 0.1}}}
joints: {free: {type: free, parent: ground, child: ball, initial: {q: [0, 0, 0.1, 1, 0, 0, 0], u: [0, 0, -1, 0, 0, 0]}}}
contacts: {c: {between: [ball.skin, ground.floor], restitution: 0.5, static: 0.3, kinetic: 0.3}}
impact: closing
""")
    f = mbs.function(ball, "impact", mode={"c": "stick"}, backend="python")
    found = f.derivative("u")(0.0, [0, 0, 0.1, 1, 0, 0, 0], [0, 0, -1, 0, 0, 0])
    np.testing.assert_allclose(found.after[0], [5 / 7, 0, 0, 0, 2 / 70, 0], atol=1e-14)
    np.testing.assert_allclose(found.holds[f.conditions.index("c sticks")], [0, 0, -0.45, 0, 0, 0], atol=1e-14)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, 'a, b may hold or let go.*mode="found"'),
        ({"mode": {"a": "up"}}, "mode: a is no 'up'; it may be open, slide"),
        ({"mode": {"c": "stick"}}, "mode: 'c' is nothing that holds or lets go; known: a, b"),
    ],
)
def test_an_impact_without_its_mode_is_an_error(options: Any, message: str) -> None:
    with pytest.raises(mbs.MultibodyError, match=message):
        mbs.function(mbs.loads(STONES), "impact", **options, backend="python")
    with pytest.raises(mbs.ModelError, match="has no impact"):
        mbs.function(mbs.loads(PUSHED), "impact", backend="python")
