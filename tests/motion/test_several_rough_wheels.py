"""Ropes that rub on several wheels between their ends: Euler's and Eytelwein's law at each, against closed forms."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from multibody_sym import derive, loads, range_of_rest, solve
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.text.printer import text

G = 9.81
HANGING = """\
multibody_sym: 1
name: two_drums
gravity: [0, -g, 0]
parameters:
  g: 9.81
  m: {value: 10, positive: true}
  M: {value: 40, positive: true}
  mu1: {value: 0.2, positive: true}
  mu2: {value: 0.3, positive: true}
bodies:
  ground: {points: {a: [0, 2, 0], b: [1, 2, 0], left: [-0.1, 0, 0], right: [1.1, 0, 0]}}
  one: {mass: m}
  two: {mass: M}
joints:
  B: {type: prismatic, parent: ground.left, child: one, axis: y, q: x}
  L: {type: prismatic, parent: ground.right, child: two, axis: -y, q: y}
pulleys:
  A: {at: ground.a, radius: 0.1, rough: mu1}
  C: {at: ground.b, radius: 0.1, rough: mu2}
constraints: {string: {type: rope, path: [one, A, C, two]}}
"""
TABLE = (
    HANGING.replace("left: [-0.1, 0, 0]", "left: [-2, 1.9, 0]")
    .replace("B: {type: prismatic, parent: ground.left, child: one, axis: y, q: x}",
             "B: {type: point, parent: ground.left, child: one, q: [x, h]}")
    .replace("right: [1.1, 0, 0]}}", "right: [1.1, 0, 0]}, surfaces: {top: {plane: [0, 1.9, 0], normal: y}}}")
    .replace("pulleys:", "contacts: {c: {between: [one, ground.top], static: 0.4}}\npulleys:")
    .replace("A: {at: ground.a", "A: {at: ground.low").replace("points: {a", "points: {low: [0.8, 2, 0], a")
    .replace("C: {at: ground.b", "C: {at: ground.high").replace("points: {low", "points: {high: [1, 3, 0], low")
)  # fmt: skip
EIGHTH = math.exp(0.5 * math.pi / 2)  # both coefficients over a quarter turn each


def test_ranges_of_rest_have_exact_ends() -> None:
    ((low, high),) = range_of_rest(loads(HANGING), "M").ends
    assert [low.value, high.value] == pytest.approx([10 / EIGHTH, 10 * EIGHTH], rel=1e-12)
    assert text(high.expression) == "m*exp(pi*(mu1 + mu2)/2)"
    ((least, _),) = range_of_rest(loads(HANGING), "mu1").ends
    assert least.value == pytest.approx(math.log(4) / (math.pi / 2) - 0.3, rel=1e-12)


def test_a_block_on_a_rough_table_is_held_by_the_table_and_both_drums() -> None:
    """Over a quarter turn below the first drum and half a turn over the second: M <= 0.4 m exp(mu1 pi/2 + mu2 pi)."""
    most = 0.4 * 10 * math.exp(0.2 * math.pi / 2 + 0.3 * math.pi)
    ((_, high),) = range_of_rest(loads(TABLE), "M").ends
    assert high.value == pytest.approx(most, rel=1e-12)
    assert solve(loads(TABLE), parameters={"M": most * 0.999}).states["c"] == "stick"
    found = solve(loads(TABLE), parameters={"M": most * 1.5})
    a = G * (1.5 * most - most) / (1.5 * most + most / 0.4)
    assert found.accelerations["x"].value == pytest.approx(a, rel=1e-12)


def test_all_routes_agree_over_three_drums() -> None:
    three = HANGING.replace("b: [1, 2, 0]", "b: [1, 2, 0], c: [0.5, 2.3, 0]").replace(
        "  C: {at: ground.b", "  S: {at: ground.c, radius: 0.1, rough: 0.1}\n  C: {at: ground.b"
    )
    three = three.replace("[one, A, C, two]", "[one, A, S, C, two]")
    slips = dict.fromkeys(("A", "S", "C"), 1)
    means = {f"string.{wheel}.mean": 1 for wheel in slips}
    resolved = in_mode(mechanism(loads(three)), Mode({"string": 1, **means}, slips))
    begin = start(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    found = solve(loads(three))
    values = [found.reactions["string"][f"tension{k}"].value or 0.0 for k in (1, 2, 3, 4)]
    ratios = [math.log(b / a) for a, b in pairwise(values)]
    # from straight up to straight down it turns by pi altogether, at the first and the last drum by the same angle
    assert ratios[0] / 0.2 + ratios[1] / 0.1 + ratios[2] / 0.3 == pytest.approx(math.pi, rel=1e-12)
    assert ratios[0] / 0.2 == pytest.approx(ratios[2] / 0.3, rel=1e-12)
    for name, route in FORMALISMS.items():
        if name != "lagrange":
            udot = forward_dynamics(route(resolved, state)).udot
            assert udot == pytest.approx([x.value for x in found.accelerations.values()], rel=1e-12)
    assert derive(resolved).lambdify()(begin.q, begin.u) == pytest.approx(udot, rel=1e-12)


@pytest.mark.parametrize("wheels", ["[one, A, C, two]", "[one, A, two]"])
def test_friction_of_ropes_may_be_smooth(wheels: str) -> None:
    """At rest there is none then; at a thousand times the speed below which it is smooth it is that of slip."""
    smooth = HANGING.replace("[one, A, C, two]", wheels) + "simulation: {friction: {regularised: 1e-4}}\n"
    if "C" not in wheels:
        smooth = smooth.replace("right: [1.1, 0, 0]", "right: [0.1, 0, 0]")
    rest = solve(loads(smooth))
    assert [x.value for x in rest.accelerations.values()] == pytest.approx([G * 30 / 50] * 2, rel=1e-12)
    fast = smooth.replace("q: x}", "q: x, initial: {u: 1}}").replace("q: y}", "q: y, initial: {u: 1}}")
    plain = solve(loads(fast.split("simulation")[0]))
    expected = [x.value for x in plain.accelerations.values()]
    assert [x.value for x in solve(loads(fast)).accelerations.values()] == pytest.approx(expected, rel=1e-7)
