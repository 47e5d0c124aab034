"""Linearised at kinks: what has other slopes on two sides of a state is refused, by hand and by differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import multibody_sym as mbs

BLOCK = """
multibody_sym: 1
name: block
parameters: {k: 3, c: 2}
bodies: {block: {mass: 2}}
joints: {guide: {type: prismatic, parent: ground, child: block, axis: x, q: x}}
forces: {law: {type: force, on: block, value: ["FORCE", 0, 0]}}
inputs: {w: W}
outputs: {y: OUTPUT}
"""
INCLINE = """
multibody_sym: 1
name: incline
gravity: [0, -G, 0]
parameters: {a: 30 deg, mu: MU}
bodies:
  block: {mass: 2, points: {p: [0, 0, 0]}}
  ground: {surfaces: {face: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
joints: {J: {type: point, parent: ground, child: block, initial: {q: [0, 0], u: [0, 0]}}}
contacts: {c: {between: [block.p, ground.face], static: mu}}
"""
ARM = """
multibody_sym: 1
name: arm
gravity: [0, GRAVITY, 0]
bodies: {arm: {shape: {rod: 1, mass: 2}}}
joints: {J: {type: revolute, parent: ground, child: arm, q: a, limits: {lower: 0, upper: 1}}}
forces: {motor: {type: torque, joint: J, value: TORQUE}}
"""


def block(force: str, *, w: str = "0", output: str = "x") -> mbs.System:
    return mbs.loads(BLOCK.replace("FORCE", force).replace("W}", f"{w}}}").replace("OUTPUT", output))


LAWS: dict[str, Callable[[float, float], float]] = {
    "-k*abs(x)": lambda x, u: -3 * abs(x),
    "-k*max(x, 0)": lambda x, u: -3 * max(x, 0),
    "-k*where(x > 0, x, 2*x)": lambda x, u: -3 * (x if x > 0 else 2 * x),
    "-k*sign(x)": lambda x, u: -3 * np.sign(x),
    "-c*sign(u_x) - k*x": lambda x, u: -2 * np.sign(u) - 3 * x,
    "min(u_x, 3*u_x) + 1": lambda x, u: min(u, 3 * u) + 1,
    "-k*x*abs(x) - c*u_x*abs(u_x)": lambda x, u: -3 * x * abs(x) - 2 * u * abs(u),
    "-k*x - max(x, 0)^1.5": lambda x, u: -3 * x - max(x, 0) ** 1.5,
    "-k*where(x > 0, sin(x), x)": lambda x, u: -3 * (math.sin(x) if x > 0 else x),
    "-k*abs(x - 1)": lambda x, u: -3 * abs(x - 1),
}


@pytest.mark.parametrize("force", LAWS)
def test_a_state_is_linearised_where_differences_on_both_sides_agree(force: str) -> None:
    """Accelerations and their slopes by differences to both sides of the start, from the law by hand."""
    law, step = LAWS[force], 1e-7
    sides = []
    for way in (step, -step):
        here = law(way, way) / 2
        sides.append([here, *((law(a, b) / 2 - here) / way for a, b in ((2 * way, way), (way, 2 * way)))])
    if np.abs(np.subtract(*sides)).max() > 1e-2:
        with pytest.raises(mbs.NoSolutionError, match="A has two values in this state: law has a kink or a jump") as at:
            mbs.linearize(block(force), moving=True)
        assert at.value.where.path == ("forces", "law")
    else:
        found = mbs.linearize(block(force), moving=True)
        np.testing.assert_allclose(found.A, [[0, 1], sides[0][1:]], atol=1e-3)
    beside = mbs.linearize(block(force), at={"x": 0.2, "u_x": 0.3}, moving=True)
    slopes = [(law(0.2 + step, 0.3) - law(0.2, 0.3)) / 2 / step, (law(0.2, 0.3 + step) - law(0.2, 0.3)) / 2 / step]
    np.testing.assert_allclose(beside.A[1], slopes, atol=1e-6)


def test_a_kink_in_a_position_that_is_found_to_rounding_is_seen() -> None:
    for start in (0.3, -0.3):
        with pytest.raises(mbs.NoSolutionError, match="A has two values in this state: law has a kink or a jump"):
            mbs.linearize(block("-k*x - c*abs(x)"), initial={"x": start}, at="equilibrium")


def test_corners_of_tables_inputs_and_outputs_are_kinks() -> None:
    table = "{table: [[-1, -2], [0, 0], [1, -1], [2, -2]], of: x}"
    with pytest.raises(mbs.NoSolutionError, match="law has a kink or a jump"):
        mbs.linearize(block("w", w=table))
    assert mbs.linearize(block("w", w=table), at={"x": 1}).A[1, 0] == -0.5  # -1 on both sides
    with pytest.raises(mbs.NoSolutionError, match="law has a kink or a jump"):  # a motor that only pushes
        mbs.linearize(block("max(w, 0)"))
    assert mbs.linearize(block("max(w, 0)"), inputs={"w": 0.1}, moving=True).B[1, 0] == 0.5
    with pytest.raises(mbs.NoSolutionError, match=r"outputs\.y: C has two values .* y has a kink or a jump"):
        mbs.linearize(block("-k*x", output="abs(u_x)"))
    assert mbs.linearize(block("-k*x", output="x*abs(x) + u_x")).C.tolist() == [[0.0, 1.0]]


def test_a_contact_at_its_limit_has_no_linearisation() -> None:
    """At mu = tan(30 deg) it is about to slip; without weight it touches without force."""

    def incline(mu: str, g: str = "9.81") -> mbs.System:
        return mbs.loads(INCLINE.replace("MU", mu).replace("G,", f"{g},"))

    assert mbs.linearize(incline("0.6")).A.tolist() == [[0.0]]
    np.testing.assert_allclose(mbs.linearize(incline("0.5")).A, [[0, 1], [0, 0]], atol=1e-15)
    for system, why in ((incline("tan(a)"), "c is about to slip"), (incline("0.3", "0"), "c neither presses nor lets")):
        with pytest.raises(mbs.NoSolutionError, match=f"A has two values in this state: {why}") as at:
            mbs.linearize(system)
        assert at.value.where.path == ("contacts", "c")


def test_a_stop_that_neither_presses_nor_lets_go_has_no_linearisation() -> None:
    def arm(gravity: str, torque: str) -> mbs.System:
        return mbs.loads(ARM.replace("GRAVITY", gravity).replace("TORQUE", torque))

    assert mbs.linearize(arm("-9.81", "0")).states == ()  # it presses
    assert mbs.linearize(arm("9.81", "0"), moving=True).states == ("a", "u_a")
    for system in (arm("0", "0"), arm("-9.81", "9.81")):  # the moment of the weight is 2 * 9.81/2
        with pytest.raises(mbs.NoSolutionError, match=r"J\.lower neither presses nor lets go"):
            mbs.linearize(system)


def test_constant_friction_at_its_limit_has_no_linearisation() -> None:
    text = """
multibody_sym: 1
name: slider
bodies: {block: {mass: 2}}
joints: {guide: {type: prismatic, parent: ground, child: block, axis: x, q: x, initial: {u: SPEED}}}
forces: {rub: {type: friction, joint: guide, force: 2 N}, push: {type: force, on: block, value: [PUSH, 0, 0]}}
"""
    slider = [mbs.loads(text.replace("SPEED", u).replace("PUSH", push)) for u, push in (("0", "1"), ("1", "2"))]
    assert mbs.linearize(slider[0]).states == ("x",)
    assert mbs.linearize(slider[1]).A.tolist() == [[0.0, 1.0], [0.0, 0.0]]
    with pytest.raises(mbs.NoSolutionError, match="rub is about to slip"):
        mbs.linearize(mbs.loads(text.replace("SPEED", "0").replace("PUSH", "2")))


def test_rates_of_states_have_kinks_too() -> None:
    text = BLOCK.replace("FORCE", "p - k*x").replace("W}", "0}").replace("OUTPUT", "x")
    laws = ("-abs(p)", "-p*abs(p)")
    bent, smooth = (mbs.loads(f"{text}states: {{p: {{rate: {law}, initial: 0}}}}\n") for law in laws)
    with pytest.raises(mbs.NoSolutionError, match=r"states\.p: A has two values in this state: p has a kink"):
        mbs.linearize(bent)
    np.testing.assert_allclose(mbs.linearize(smooth).A, [[0, 1, 0], [-1.5, 0, 0.5], [0, 0, 0]], atol=1e-15)


def test_a_state_keeps_the_mode_of_the_start() -> None:
    """Above its hook a rope would push; a block that slides back is rubbed the other way than at the start."""
    text = """
multibody_sym: 1
name: hung
gravity: [0, -9.81, 0]
bodies: {bob: {mass: 2, points: {p: [0, 0, 0]}}, ground: {points: {hook: [0, 0, 0]}}}
joints: {J: {type: point, parent: ground, child: bob, q: [x, y], initial: {q: [0, -1]}}}
constraints: {rope: {type: rope, path: [ground.hook, bob.p], slack: true}}
inputs: {F: 0, G: 0}
forces: {f: {type: force, on: bob, value: [F, G, 0]}}
"""
    hung = mbs.loads(text)
    assert mbs.linearize(hung, at={"x": 0}).eigenvalues[0].imag == pytest.approx(-math.sqrt(9.81))
    assert mbs.trim(hung, {"x": 0.6}, unknown="F").inputs["F"] == pytest.approx(2 * 9.81 * 0.75)
    for question in (mbs.linearize, lambda system, at: mbs.trim(system, at, unknown="F")):
        with pytest.raises(mbs.NoSolutionError, match="rope would have to hold the other way in this state"):
            question(hung, at={"x": 0, "y": 1})
    sliding = mbs.loads(INCLINE.replace("MU", "0.3").replace("G,", "9.81,").replace("u: [0, 0]", "u: [1, tan(a)]"))
    assert mbs.linearize(sliding, at={"u_J_x": 2}).states == ("J_x", "u_J_x")
    with pytest.raises(mbs.NoSolutionError, match="c slips the other way in this state, unlike at the start"):
        mbs.linearize(sliding, at={"u_J_x": -2})
