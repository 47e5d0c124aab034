"""Forces of separate contacts that are unique together though not alone, against the balance of forces."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import solution_text
from multibody_sym.text.printer import text

ROD = """
multibody_sym: 1
name: rod
gravity: [0, -g, 0]
parameters:
  g: {{value: 10 m/s^2, positive: true}}
  m: {{value: 2 kg, positive: true}}
  l: {{value: 1 m, positive: true}}
  F: {{value: 3 N, positive: true}}
  mu: {{value: 0.4, positive: true}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  rod: {{mass: m, inertia: {{Izz: m*l^2/12}}, points: {{a: [-l/2, 0, 0], b: [l/2, 0, 0], o: [0, 0, 0]}}}}
joints: {{j: {{type: planar, parent: ground, child: rod, q: [x, y, phi]}}}}
contacts: {{{contacts}}}
forces: {{p: {{type: force, on: rod, value: [F, 0, 0]}}}}
"""
LEFT, RIGHT, MIDDLE = (
    f"{name}: {{between: [rod.{point}, ground.floor], static: mu}}"
    for name, point in {"c": "a", "d": "b", "e": "o"}.items()
)


def test_two_feet_hold_the_pull_together() -> None:
    solution = mbs.solve(mbs.loads(ROD.format(contacts=f"{LEFT}, {RIGHT}")))
    assert {name: text(x.expression) for name, x in solution.sums.items()} == {"friction(c) + friction(d)": "-F"}
    assert solution.sums["friction(c) + friction(d)"].value == pytest.approx(-3.0, abs=1e-12)
    assert "friction(c) + friction(d) = -F = -3 N" in solution_text(solution)
    assert solution.as_json()["sums"]["friction(c) + friction(d)"]["expression"] == "-F"


def test_three_feet_bear_the_weight_together() -> None:
    solution = mbs.solve(mbs.loads(ROD.format(contacts=f"{LEFT}, {RIGHT}, {MIDDLE}")))
    found = {name: text(x.expression) for name, x in solution.sums.items()}
    assert found == {"normal(c) + normal(d) + normal(e)": "g*m", "friction(c) + friction(d) + friction(e)": "-F"}


def test_what_is_unique_alone_has_no_sum() -> None:
    solution = mbs.solve(mbs.loads(ROD.format(contacts=f"{LEFT}, {RIGHT}").replace("[F, 0, 0]", "[5*F, 0, 0]")))
    assert set(solution.states.values()) == {"slide+"}
    assert solution.sums == {}
