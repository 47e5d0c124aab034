"""Closed forms of impacts whose slip stops, turns round, or is given back, with their conditions; energies lost."""

from __future__ import annotations

import math

import pytest
from impact_models import STRUCK, impact_of

import multibody_sym as mbs
from multibody_sym.dynamics.start.declared_impact import outcome, posed_impact
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.text.values import Value

ROD = """
parameters: {m: {value: 1 kg, positive: true}, l: {value: 1 m, positive: true}, v: {value: 3 m/s, positive: true},
  u: {value: 1.5 m/s, positive: true}, e: {value: 0.5, positive: true}, mu: {value: 0.2, positive: true}}
bodies:
  rod: {mass: m, inertia: {Izz: m*l^2/12}, points: {tip: [l/2, 0, 0]}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
joints: {P: {type: planar, parent: ground, child: rod, q: [x, y, a],
  initial: {q: [0, 0.4*l, 'asin(-0.8)'], u: [SPEED, -v, 0]}}}
contacts: {c: {between: [rod.tip, ground.floor], static: mu, kinetic: mu, restitution: e}}
impact: {contacts: c, law: LAW}
"""


def at(value: Value, **numbers: float) -> float:
    assert value.expression is not None
    names = {leaf: numbers[str(leaf.data)] for leaf in leaves([value.expression], "symbol")}
    return evaluate_float([value.expression], names)[0]


NUMBERS = {"m": 1.0, "l": 1.0, "v": 3.0, "u": 0.3, "e": 0.5, "mu": 0.2}


@pytest.mark.parametrize("law", ["newton", "poisson", "stronge"])
def test_a_rod_whose_tip_slips_back_has_rouths_formula(law: str) -> None:
    """K by hand: the tip is at r = (0.3 l, -0.4 l) from the centre, J = m l^2/12."""
    model = ROD.replace("LAW", law).replace("SPEED", "u")
    knn, ktt, knt = 1 + 12 * 0.09, 1 + 12 * 0.16, 12 * 0.3 * 0.4
    assert abs(knt) > 0.2 * ktt  # it does not stick
    mu, e, vn = 0.2, 0.5, -3.0
    back = impact_of(STRUCK + model.replace("u: {value: 1.5 m/s, positive: true}", "u: -0.3 m/s"))
    stop = 0.3 / (mu * ktt + knt)
    first, then = knn + mu * knt, knn - mu * knt
    reached = vn + first * stop
    assert reached < 0
    pressed = -reached / then
    work = -vn * stop - first * stop**2 / 2 + reached**2 / (2 * then)
    more = {
        "newton": (-e * vn - reached) / then,
        "poisson": (1 + e) * (stop + pressed) - stop,
        "stronge": pressed + e * (2 * work / then) ** 0.5,
    }[law]
    normal, friction = back.impulses["c"]["normal"], back.impulses["c"]["friction"]
    assert normal.value == pytest.approx(stop + more, rel=1e-12)
    assert friction.value == pytest.approx(mu * stop - mu * more, rel=1e-12)
    for value in (normal, friction, back.after["u_a"], *([back.energy_lost] if law == "newton" else [])):
        assert at(value, **NUMBERS | {"u": -0.3}) == pytest.approx(value.value, rel=1e-10)
    changed = {"v": 2.0, "u": -0.2, "e": 0.4}
    system = mbs.loads(STRUCK + model.replace("u: {value: 1.5 m/s, positive: true}", "u: -0.3 m/s"))
    again = outcome(posed_impact(Overrides(changed).of(system)))
    assert at(normal, **NUMBERS | changed) == pytest.approx(again.impulses[0], rel=1e-10)
    assert back.conditions


BALL_IN_SPACE = """
parameters: {m: {value: 0.1 kg, positive: true}, v: {value: 3 m/s, positive: true}, a: {value: 0.3 m/s, positive: true},
  b: {value: 0.4 m/s, positive: true}, e: {value: 0.5, positive: true}, mu: {value: 0.2, positive: true}}
bodies: {ball: {mass: m}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}}
joints: {free: {type: point, parent: ground, child: ball, axes: xyz, initial: {u: [a, b, -v]}}}
contacts: {c: {between: [ball, ground.floor], static: mu, restitution: e}}
impact: {contacts: c}
"""


def test_in_space_what_sticks_stays_within_its_cone() -> None:
    """A particle stops along the floor where m sqrt(a^2 + b^2) <= mu m (1 + e) v; 0.5 <= 0.9 here."""
    told = impact_of(STRUCK + BALL_IN_SPACE)
    assert [told.after[name].value for name in list(told.after)[:2]] == pytest.approx([0, 0], abs=1e-15)
    (condition,) = told.conditions
    assert told.limits[condition] == "c slips"
    for mu, holds in ((0.12, True), (0.1, False)):  # the limit is mu = 1/9
        left, _, right = condition.partition(" >= ")
        sides = [eval(side.replace("^", "**"), {"sqrt": math.sqrt, **NUMBERS, "a": 0.3, "b": 0.4, "mu": mu})
                 for side in (left, right)]
        assert (sides[0] >= sides[1]) is holds
    slid = impact_of(STRUCK + BALL_IN_SPACE, parameters={"mu": 0.1})
    assert slid.after[next(iter(slid.after))].value == pytest.approx(0.3 * (1 - 0.45 / 0.5), rel=1e-12)
    assert all("slips" not in broken for broken in slid.limits.values())
