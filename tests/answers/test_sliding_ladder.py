"""A ladder that slides at the floor and at the wall: short forms, against Newton's law for the ladder cut free."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.node import Node
from multibody_sym.text.printer import text

LADDER = """
multibody_sym: 1
name: ladder
gravity: [0, -g, 0]
parameters:
  g: {{value: 10 m/s^2, positive: true}}
  m: {{value: 20 kg, positive: true}}
  l: {{value: 4 m, positive: true}}
  th: 45 deg
  mu1: {{value: 0.1, positive: true}}
  mu2: {{value: 0.2, positive: true}}
bodies:
  ground:
    surfaces: {{floor: {{plane: [0, 0, 0], normal: [0, 1, 0]}}, wall: {{plane: [0, 0, 0], normal: [1, 0, 0]}}}}
  rod: {{mass: m, inertia: {{Izz: m*l^2/12}}, points: {{a: [-l/2, 0, 0], b: [l/2, 0, 0]}}}}
joints: {{j: {{type: planar, parent: ground, child: rod, initial: {{q: [l/2*cos(th), l/2*sin(th), -th]}}}}}}
contacts:
  foot: {{between: [rod.b, ground.floor], static: mu1}}
  top: {{between: [rod.a, ground.wall], static: {wall}}}
"""
LONGEST = 120
PLAIN: dict[str, Any] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a ** int(b),
}


def value(root: Node, point: dict[str, Fraction]) -> Fraction:
    """Return a formula's exact value; `point` has also the values of sin(th) and cos(th)."""
    known: dict[Node, Fraction] = {}
    for node in postorder([root]):
        if node.op in ("symbol", "sin", "cos"):
            known[node] = point.get(node.op, Fraction(0)) if node.args else point.get(str(node), Fraction(0))
        elif node.op == "number":
            known[node] = Fraction(node.data)
        else:
            known[node] = PLAIN[node.op](*(known[a] for a in node.args))
    return known[root]


def cut_free(p: dict[str, Fraction], wall: str) -> dict[str, Fraction]:
    """Return what Newton's law gives for the ladder that turns with th'' from rest, both ends sliding down."""
    s, c, l, m, mu, nu = p["sin"], p["cos"], p["l"], p["m"], p["mu1"], p[wall]
    # m (-l s/2) th'' = W - mu F, m (l c/2) th'' = F + nu W - m g, m l^2/12 th'' = l/2 (mu s F - c F + nu c W + s W)
    rows = [
        [-m * l * s / 2, mu, Fraction(-1), Fraction(0)],
        [m * l * c / 2, Fraction(-1), -nu, -m * p["g"]],
        [m * l * l / 12, l / 2 * (c - mu * s), -l / 2 * (nu * c + s), Fraction(0)],
    ]
    for k in range(3):
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for j in range(3):
            if j != k:
                rows[j] = [x - rows[j][k] * y for x, y in zip(rows[j], rows[k], strict=True)]
    turning, floor, push = (row[3] for row in rows)
    return {
        "j_theta": -turning, "j_x": -l * s / 2 * turning, "j_y": l * c / 2 * turning,
        "foot normal": floor, "foot friction": -mu * floor, "top normal": push, "top friction": -nu * push,
    }  # fmt: skip


@pytest.mark.parametrize("wall", ["mu1", "mu2"])
def test_a_ladder_that_slides_at_both_ends_has_short_forms(wall: str) -> None:
    solution = mbs.solve(mbs.loads(LADDER.format(wall=wall)))
    found: dict[str, Any] = {
        **{name: x.expression for name, x in solution.accelerations.items()},
        **{f"{name} {force}": solution.reactions[name][force].expression
           for name in ("foot", "top") for force in ("normal", "friction")},
    }  # fmt: skip
    rng = random.Random(1)
    for _ in range(20):
        t = Fraction(rng.randint(1, 99), 100)
        point = {name: Fraction(rng.randint(1, 99), rng.randint(1, 99)) for name in ("g", "m", "l", "mu1", "mu2")}
        point |= {"sin": 2 * t / (1 + t * t), "cos": (1 - t * t) / (1 + t * t)}
        expected = cut_free(point, wall)
        assert {name: value(formula, point) for name, formula in found.items()} == expected
    assert max(len(text(formula)) for formula in found.values()) <= LONGEST
    assert not solution.notes
