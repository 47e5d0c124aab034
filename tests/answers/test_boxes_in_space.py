"""A box on four corners in space: the formulas, conditions and limits of the same box in a plane, as short as there."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.expressions.printer import text
from multibody_sym.numerics.outline import outline

SPACE = """\
multibody_sym: 1
name: box
gravity: [g*sin(alpha), 0, -g*cos(alpha)]
parameters:
  g: {value: 10 m/s^2, positive: true}
  m: {value: 5 kg, positive: true}
  b: {value: 0.2 m, positive: true}
  c: {value: 0.3 m, positive: true}
  h: {value: 0.1 m, positive: true}
  mu: {value: 0.2, positive: true}
  nu: {value: 0.2, positive: true}
  F: {value: 0 N}
  alpha: 25 deg
bodies:
  ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [b, c, h], mass: m}, points: {hook: [b/2, 0, h/2]}}
joints: {J: {type: free, parent: ground, child: box, initial: {q: [0, 0, h/2, 1, 0, 0, 0]}}}
forces: {pull: {type: force, on: box, at: hook, value: [F, 0, 0]}}
contacts: {c1: {between: [box, ground.ramp], static: mu, kinetic: nu}}
"""
PLANE = (
    SPACE.replace("[g*sin(alpha), 0, -g*cos(alpha)]", "[g*sin(alpha), -g*cos(alpha), 0]")
    .replace("normal: z", "normal: y")
    .replace("[b, c, h]", "[b, h, c]")
    .replace("[b/2, 0, h/2]", "[b/2, h/2, 0]")
    .replace("type: free", "type: planar")
    .replace("[0, 0, h/2, 1, 0, 0, 0]", "[0, h/2, 0]")
)


def solved(model: str = SPACE, **values: float) -> mbs.Solution:
    return mbs.solve(mbs.loads(model), values)


def formulas(found: mbs.Solution) -> dict[str, str]:
    """Return the formulas of the accelerations and of the sum of the corners' forces that do not vanish."""
    values = {**found.accelerations, **found.reactions["c1"]}
    return {name: text(x.expression) for name, x in values.items() if x.expression is not None and x.value}


@pytest.mark.parametrize(
    ("values", "conditions"),
    [
        (
            {"mu": 0.4, "nu": 0.3},
            {
                "F + g*m*sin(alpha) > g*m*mu*cos(alpha)": "c1.corner1 sticks",
                "F + g*m*sin(alpha) > g*m*nu*cos(alpha)": "c1.corner1 does not slide",
                "F*h + b*g*m*cos(alpha) + g*h*m*nu*cos(alpha) >= 0": "c1 tips about corner1, corner4",
                "b*g*m*cos(alpha) >= F*h + g*h*m*nu*cos(alpha)": "c1 tips about corner2, corner3",
            },
        ),
        (
            {"mu": 0.6, "nu": 0.6},
            {
                "abs(F + g*m*sin(alpha)) <= g*m*mu*cos(alpha)": "c1 slips",
                "2*F*h + b*g*m*cos(alpha) + g*h*m*sin(alpha) >= 0": "c1 tips about corner1, corner4",
                "b*g*m*cos(alpha) >= 2*F*h + g*h*m*sin(alpha)": "c1 tips about corner2, corner3",
            },
        ),
    ],
)
def test_formulas_and_limits_are_those_of_the_plane(values: dict[str, float], conditions: dict[str, str]) -> None:
    """A box slides down a ramp or rests: what is unique is the sum of its corners and where that acts.

    In the plane each corner has a force, so that it opens where in space the box tips about two.
    """
    found, flat = solved(**values), solved(PLANE, **values)
    expected = {"friction_1" if name == "friction" else name: x for name, x in formulas(flat).items()}
    assert formulas(found) == expected
    assert {"normal", "friction_1", "at_x"} <= set(expected)
    assert found.limits == conditions
    assert set(conditions) <= set(flat.limits)
    assert max(map(len, (*expected.values(), *conditions))) <= 120
    assert found.verdict == "one"


def test_it_slides_along_where_it_moves_and_tips_over_either_side() -> None:
    """With speeds 3 and 4 friction has the parts 3/5 and 4/5, and acts h mu/2 ahead along both."""
    model = SPACE.replace("1, 0, 0, 0]}", "1, 0, 0, 0], u: [3, 4, 0, 0, 0, 0]}").replace("[F, 0, 0]", "[0, 0, 0]")
    found = solved(model)
    forces = found.reactions["c1"]
    normal = 50 * math.cos(math.radians(25))
    assert [forces[x].value for x in ("friction_1", "friction_2")] == pytest.approx([-0.12 * normal, -0.16 * normal])
    assert [forces[x].value for x in ("at_x", "at_y", "at_z")] == pytest.approx([0.006, 0.008, 0.0], abs=1e-12)
    assert found.limits == {
        "cos(alpha) >= 0": "c1 opens",
        "5*b >= 3*h*nu": "c1 tips about corner2, corner3",
        "5*c >= 4*h*nu": "c1 tips about corner3, corner4",
    }


def test_a_block_that_is_pulled_aside_slides_between_its_weight_and_the_force() -> None:
    """It begins along (m g sin(alpha), F): there friction is -mu m g cos(alpha) times that over its length."""
    found = mbs.solve(
        mbs.loads("""\
multibody_sym: 1
name: aside
gravity: [g*sin(alpha), 0, -g*cos(alpha)]
parameters: {g: 10 m/s^2, m: {value: 5 kg, positive: true}, mu: 0.2, alpha: 25 deg, F: 12 N}
bodies: {ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: z}}}, block: {mass: m}}
joints: {J: {type: point, parent: ground, child: block, axes: xyz, q: [x, y, z]}}
forces: {pull: {type: force, on: block, value: [0, F, 0]}}
contacts: {c1: {between: [block, ground.ramp], static: mu}}
""")
    )
    steep, normal = 50 * math.sin(math.radians(25)), 50 * math.cos(math.radians(25))
    whole = math.hypot(steep, 12)
    assert found.accelerations["x"].value == pytest.approx(steep * (1 - 0.2 * normal / whole) / 5, rel=1e-12)
    assert text(found.reactions["c1"]["friction_2"].expression) == (
        "-F*g*m*mu*cos(alpha)/sqrt(F^2 + g^2*m^2*sin(alpha)^2)"
    )
    assert found.limits["sqrt(F^2 + g^2*m^2*sin(alpha)^2) > g*m*mu*cos(alpha)"] == "c1 does not slide"


def test_the_outline_of_points() -> None:
    """Corners of a square with its middle and one on its side; of a line, and of a place."""
    square = np.array([[0, 0, 1], [2, 0, 1], [1, 1, 1], [2, 2, 1], [0, 2, 1], [1, 0, 1]], dtype=float)
    assert outline(square, np.array([0.0, 0.0, 1.0])) == [0, 1, 3, 4]
    assert outline(square, np.array([0.0, 0.0, -1.0])) == [0, 4, 3, 1]
    line = np.array([[0.0, 1, 0], [0, 3, 0], [0, 2, 0]])
    assert sorted(outline(line, np.array([0.0, 0.0, 1.0]))) == [0, 1]
    assert len(outline(line[[0, 0]], np.array([0.0, 0.0, 1.0]))) == 1
