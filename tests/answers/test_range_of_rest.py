"""Ranges of rest in numbers at many parameters, the digits of their ends, and how they are printed."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.analysis.hints import declared_hints
from multibody_sym.analysis.rest.range_of_rest import RestBound
from multibody_sym.documents.analysis import rest_text
from multibody_sym.errors import ArgumentError, InputError, NoSolutionError

INCLINE = """\
multibody_sym: 1
name: incline
gravity: [0, -g, 0]
parameters:
  {g: 10 m/s^2, alpha: 45 deg, mu: 0.02, m1: {value: 6 kg, positive: true}, m2: {value: 4 kg, positive: true}}
bodies:
  ground: {surfaces: {face: {plane: [0, 0, 0], normal: [-sin(alpha), cos(alpha), 0]}}, points: {top: [0, 0, 0]}}
  block: {mass: m1}
  load: {mass: m2}
joints:
  J: {type: point, parent: ground, child: block, initial: {q: [-2*cos(alpha), -2*sin(alpha)]}}
  L: {type: prismatic, parent: ground, child: load, axis: -y, q: depth, initial: {q: 0.5}}
pulleys: {P: {at: ground.top}}
constraints: {string: {type: rope, path: [block, P, load], slack: false}}
contacts: {c1: {between: [block, ground.face], static: mu}}
"""

BOX = """\
multibody_sym: 1
name: box
gravity: [0, -g, 0]
parameters: {g: 10, a: 0.1, mu: 0.6, b: 0.4, h: 1.0, y: 0.9, F: 1 N, m: {value: 3, positive: true}}
bodies:
  ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  box: {shape: {box: [b, h, 1], mass: m}, points: {hook: [b/2, y - h/2, 0]}}
joints: {B: {type: planar, parent: ground, child: box, initial: {q: [-h/2*sin(a), h/2*cos(a), a]}}}
forces: {pull: {type: force, on: box, at: hook, value: [F, 0, 0]}}
contacts: {c1: {between: [box, ground.ramp], static: mu}}
"""

LADDER = """\
multibody_sym: 1
name: ladder
gravity: [0, -g, 0]
parameters: {g: 10, a: 60 deg, mu: 0.4, nu: 0.3, l: 3.0, m: {value: 12, positive: true}}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  ladder: {mass: m, com: [0, 0, 0], inertia: {Izz: m*l^2/12}, points: {foot: [-l/2, 0, 0], head: [l/2, 0, 0]}}
joints: {B: {type: planar, parent: ground, child: ladder, initial: {q: [l/2*cos(a), l/2*sin(a), pi - a]}}}
contacts:
  floor: {between: [ladder.foot, ground.floor], static: mu}
  wall: {between: [ladder.head, ground.wall], static: nu}
"""


def found(file: str, vary: str, **parameters: float) -> mbs.RangeOfRest:
    return mbs.range_of_rest(mbs.loads(file), vary, parameters=parameters)


def test_an_end_has_the_value_of_its_formula_and_the_digits_that_hold():
    low, high = found(LADDER, "a").ends[0]
    assert low.value == pytest.approx(math.atan((1 - 0.4 * 0.3) / (2 * 0.4)), rel=4e-16)
    assert (low.error, low.as_json().get("error")) == (0.0, None)
    assert abs(high.value - math.pi / 2) <= high.error == high.as_json()["error"] < 1e-10
    flat = mbs.RangeOfRest("F", ((RestBound(1 / 3, error=1e-6), RestBound(2 / 3, error=2e-4)),), (None, None), unit="N")
    assert rest_text(flat) == "rest is possible for F from 0.33333 N to 0.67 N"


def test_one_value_and_all_of_them_are_told_as_such():
    one, turn = mbs.RangeOfRest("F", ((RestBound(2.5), RestBound(2.5 + 1e-13)),), (None, None), unit="N"), math.pi
    assert rest_text(one) == "rest is possible only for F = 2.5 N"
    whole = mbs.RangeOfRest("a", ((RestBound(-turn), RestBound(turn)),), (-turn, turn), unit="rad")
    assert rest_text(whole).startswith("rest is possible at every value of a\nnote: looked for through a whole turn")


def test_an_angle_may_have_several_ranges():
    """A load that changes with the angle holds the block where the curves of both forces cross."""
    system = mbs.loads(INCLINE.replace("mu: 0.02", "mu: 0.1").replace("mass: m2", "mass: m2*(1 + 0.45*cos(8*alpha))"))
    answer = mbs.range_of_rest(system, "alpha")

    def slack(a: float, sense: float) -> float:
        return 6 * (math.sin(a) + sense * 0.1 * math.cos(a)) - 4 * (1 + 0.45 * math.cos(8 * a))

    rests = [a for a in np.linspace(-math.pi / 2, math.pi / 2, 20001) if slack(a, 1) >= 0 >= slack(a, -1)]
    starts = [a for a, b in zip(rests, [-9.0, *rests], strict=False) if a - b > 1e-3]
    assert len(answer.rest) == len(starts) == 2
    for (low, high), start in zip(answer.rest, starts, strict=True):
        assert low == pytest.approx(start, abs=1e-3)
        assert min(abs(slack(low, s)) for s in (1, -1)) < 1e-12
        assert min(abs(slack(high, s)) for s in (1, -1)) < 1e-12


@pytest.mark.parametrize("count", [12, pytest.param(40, marks=pytest.mark.long)])
def test_rest_in_numbers_at_random_parameters(count: int) -> None:
    """Inside its range a box stays, outside it does not: forces at two corners by hand, `count` parameter sets."""
    rng, system, inside = np.random.default_rng(3), mbs.loads(BOX), 0
    for _ in range(count):
        b, h, mu, y, F, a = rng.uniform((0.2, 0.3, 0.1, 0.1, -20, -0.5), (1.0, 1.5, 0.9, 1.0, 20, 0.5))
        y = y * h
        weight = 30 * np.array([-math.sin(a), -math.cos(a)])  # along and across the ramp
        pull = F * np.array([math.cos(a), -math.sin(a)])
        along, across = weight + pull
        # moment about the middle of the base, of the weight and the pull
        moment = -(h / 2) * weight[0] + b / 2 * pull[1] - y * pull[0]
        press = -across
        rests = press >= 0 and abs(along) <= mu * press and abs(moment) <= press * b / 2
        inside += rests
        low_high = mbs.range_of_rest(system, "F", parameters={"b": b, "h": h, "mu": mu, "y": y, "a": a}).rest
        assert any((low or -math.inf) <= F <= (high or math.inf) for low, high in low_high) == rests
    assert count / 8 < inside < count * 7 / 8


MASSLESS = """\
multibody_sym: 1
name: massless_ladder
gravity: [0, -g, 0]
parameters: {g: 10, a: 60 deg, mu: 0.4, nu: 0.3, l: 3.0, s: 1.0, m: {value: 12, positive: true}}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  ladder: {points: {foot: [-l/2, 0, 0], head: [l/2, 0, 0], load: [s - l/2, 0, 0]}}
joints: {B: {type: planar, parent: ground, child: ladder, initial: {q: [l/2*cos(a), l/2*sin(a), pi - a]}}}
forces: {weight: {type: force, on: ladder, at: load, value: [0, -m*g, 0]}}
contacts:
  floor: {between: [ladder.foot, ground.floor], static: mu}
  wall: {between: [ladder.head, ground.wall], static: nu}
"""


def test_what_has_no_mass_rests_by_forces_alone() -> None:
    """A load on a massless ladder, and one wedged between two walls; by hand, and as with a billionth of a kilogram."""
    system, (sine, cosine) = mbs.loads(MASSLESS), (math.sin(math.pi / 3), math.cos(math.pi / 3))
    ((low, high),) = mbs.range_of_rest(system, "mu").ends  # at the wall N2*(l*sin + nu*l*cos) = m*g*s*cos, mu*N1 = N2
    assert low.value == pytest.approx(cosine / (3 * sine + 0.3 * 2 * cosine), rel=1e-14)
    assert low.expression is not None
    assert not any("no mass" in hint for hint in declared_hints(system))
    assert (low.gives_way, high.value) == (("slips at floor", "slips at wall"), None)
    light = mbs.loads(MASSLESS.replace("{points: {foot", "{mass: 1e-9, inertia: {Izz: 1e-9}, points: {foot"))
    for name in ("mu", "s", "nu", "a"):
        here, there = (np.array(mbs.range_of_rest(each, name).rest, dtype=float) for each in (system, light))
        assert here == pytest.approx(there, rel=1e-8, abs=1e-8, nan_ok=True), name
    walls = MASSLESS.replace("floor: {plane: [0, 0, 0], normal: y}", "floor: {plane: [l*cos(a), 0, 0], normal: -x}")
    walls = walls.replace("nu: 0.3, ", "").replace("static: nu", "static: mu").replace("60 deg", "15 deg")
    ((least, most),) = mbs.range_of_rest(mbs.loads(walls), "mu").rest
    assert (least, most) == (pytest.approx(math.tan(math.radians(15))), None)


def test_nothing_holds_a_massless_arm_that_is_free_to_turn() -> None:
    """Its torque is zero where it rests; a model without any mass by the value of a parameter has no start."""
    arm = (
        "multibody_sym: 1\nname: arm\nparameters: {M: 5 N*m, m: 2 kg}\nbodies: {block: {mass: m}, arm: {}}\n"
        "joints: {J: {type: point, parent: ground, child: block}, H: {type: revolute, parent: block, child: arm}}\n"
        "forces: {T: {type: torque, joint: H, value: M}}\n"
    )
    found = mbs.range_of_rest(mbs.loads(arm), "M")
    assert found.rest == [(0.0, 0.0)]
    assert found.ends[0][0].gives_way == ("nothing holds it at other values",)
    with pytest.raises(NoSolutionError, match="no inertia resists"):
        mbs.range_of_rest(mbs.loads(arm.replace("arm: {}", "arm: {mass: m}")), "M", parameters={"m": 0.0})


def test_what_cannot_be_varied_is_told() -> None:
    system = mbs.loads(INCLINE)
    with pytest.raises(InputError, match="there is no parameter 'm3'"):
        mbs.range_of_rest(system, "m3")
    with pytest.raises(ArgumentError, match="the name of a parameter"):
        mbs.range_of_rest(system, 3)
