"""Ranges of rest: ends known by hand, in numbers and in closed form, and what gives way there."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import multibody_sym as mbs
from multibody_sym.analysis.rest.range_of_rest import RestBound
from multibody_sym.cli.main import main
from multibody_sym.documents.analysis import rest_text
from multibody_sym.errors import ArgumentError, InputError, NoSolutionError
from multibody_sym.text.printer import text
from multibody_sym.text.values import chosen_units

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

DOUBLE = """\
multibody_sym: 1
name: double_incline
gravity: [0, -g, 0]
parameters: {g: 10, k: 1.5, mu: 0.1, m: {value: 1 kg, positive: true}, a: 45 deg, b: 30 deg}
bodies:
  ground:
    points: {top: [0, 0, 0]}
    surfaces:
      left: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}
      right: {plane: [0, 0, 0], normal: [sin(b), cos(b), 0]}
  A: {mass: m}
  B: {mass: k*m}
joints:
  JA: {type: point, parent: ground, child: A, initial: {q: [-cos(a), -sin(a)]}}
  JB: {type: point, parent: ground, child: B, initial: {q: [cos(b), -sin(b)]}}
pulleys: {P: {at: ground.top}}
constraints: {string: {type: rope, path: [A, P, B], slack: false}}
contacts: {left: {between: [A, ground.left], static: mu}, right: {between: [B, ground.right], static: mu}}
"""

SLOPE = """\
multibody_sym: 1
name: slope
gravity: [0, 0, -g]
parameters: {g: {value: 10, positive: true}, mu: 0.3, F: 2 N, a: 0.2, m: {value: 5 kg, positive: true}}
bodies:
  ground: {surfaces: {slope: {plane: [0, 0, 0], normal: [-sin(a), 0, cos(a)]}}}
  block: {mass: m, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}
joints: {U: {type: free, parent: ground, child: block}}
forces: {pull: {type: force, on: block, value: [0, F, 0]}}
contacts: {c1: {between: [block, ground.slope], static: mu}}
"""


def found(file: str, vary: str, **parameters: float) -> mbs.RangeOfRest:
    return mbs.range_of_rest(mbs.loads(file), vary, parameters=parameters)


def test_a_block_held_by_a_load_over_a_pulley():
    answer = found(INCLINE, "mu")
    assert answer.rest == [(pytest.approx(1 - 2 * math.sqrt(2) / 3, rel=1e-14), None)]
    low, high = answer.ends[0]
    assert text(low.expression) == "(m1*sin(alpha) - m2)/(m1*cos(alpha))"
    assert text(low.exact) == "1 - 2*sqrt(2)/3"
    assert (low.gives_way, high.gives_way) == (("slips at c1",), ())


def test_an_angle_has_two_ends():
    answer = found(INCLINE, "alpha")
    turn, slant = math.asin(4 / 6 / math.hypot(1, 0.02)), math.atan(0.02)
    assert answer.rest == [pytest.approx((turn - slant, turn + slant), rel=1e-14)]
    assert [text(end.expression) for end in answer.ends[0]] == [
        "asin(m2/(m1*sqrt(mu^2 + 1))) - atan(mu)",
        "asin(m2/(m1*sqrt(mu^2 + 1))) + atan(mu)",
    ]
    assert answer.unit == "rad"


def test_masses_between_which_a_double_incline_rests():
    answer = found(DOUBLE, "k")
    s, r = math.sqrt(0.5), math.sqrt(3) / 2
    wanted = 0.9 * s / (0.5 + 0.1 * r), 1.1 * s / (0.5 - 0.1 * r)
    assert answer.rest == [pytest.approx(wanted, rel=1e-14)]
    low, high = answer.ends[0]
    assert text(low.expression) == "(sin(a) - mu*cos(a))/(mu*cos(b) + sin(b))"
    assert text(high.expression) == "(mu*cos(a) + sin(a))/(sin(b) - mu*cos(b))"
    assert low.gives_way == high.gives_way == ("slips at left", "slips at right")


@pytest.mark.parametrize(
    ("mu", "limit", "formula", "way"),
    [
        (0.6, math.atan(0.4), "atan(b/h)", "box tips about its lower edge"),
        (0.3, math.atan(0.3), "atan(mu)", "slips at c1"),
    ],
)
def test_a_box_on_a_ramp_tips_or_slips(mu, limit, formula, way):
    answer = found(BOX.replace("forces: {pull", "outputs: {}  # forces: {pull"), "a", mu=mu)
    assert answer.rest == [pytest.approx((-limit, limit), rel=1e-13)]
    assert (text(answer.ends[0][1].expression), answer.ends[0][1].gives_way) == (formula, (way,))


@pytest.mark.parametrize(
    ("y", "mu", "limit", "formula", "way"),
    [
        (0.9, 0.6, 30 * 0.2 / 0.9, "b*g*m/(2*y)", "box tips about its right edge"),
        (0.2, 0.6, 18.0, "g*m*mu", "slips at c1"),
    ],
)
def test_a_box_pulled_at_a_height_tips_or_slips(y, mu, limit, formula, way):
    answer = found(
        BOX.replace("a: 0.1, ", "").replace("sin(a)", "0").replace("cos(a)", "1").replace("h/2*1, a]", "h/2, 0]"),
        "F",
        y=y,
        mu=mu,
    )
    assert answer.rest == [pytest.approx((-limit, limit), rel=1e-13)]
    assert (text(answer.ends[0][1].expression), answer.ends[0][1].gives_way) == (formula, (way,))


OVERHANG = """\
multibody_sym: 1
name: overhang
gravity: [0, -9.81, 0]
parameters: {x: {value: 0.05 m}, w: 0.2 m}
bodies:
  ground: {surfaces: {table: {plane: [0, 0, 0], normal: y, between: [[-2, 0, 0], [0, 0, 0]]}}}
  low: {shape: {box: [w, 0.05, 0.1], mass: 1 kg}}
  top: {shape: {box: [0.2, 0.05, 0.1], mass: 1 kg}}
joints:
  L: {type: planar, parent: ground, child: low, q: [xl, yl, al], initial: {q: [-0.5, 0.025, 0]}}
  T: {type: planar, parent: ground, child: top, q: [xt, yt, at], initial: {q: [x - 0.5, 0.075, 0]}}
contacts: {c1: {between: [low, ground.table], static: 0.4}, c2: {between: [top, low], static: 0.4}}
"""


@pytest.mark.parametrize(
    ("text", "limit", "way"),
    [
        (OVERHANG, 0.1, "top tips about the right edge of low"),
        (OVERHANG.replace("w: 0.2", "w: 0.16"), 0.08, "top tips about the right edge of low"),
        (OVERHANG.replace("type: planar, parent: ground, child: low, q: [xl, yl, al], initial: {q: [-0.5, 0.025, 0]}",
                          "type: fixed, parent: ground.seat, child: low").replace(
             "ground: {", "ground: {points: {seat: [-0.5, 0.025, 0]}, ").replace(
             "c1: {between: [low, ground.table], static: 0.4}, ", ""), 0.1, "top tips about the right edge of low"),
        (OVERHANG.replace("-0.5, 0.025", "x - 0.05, 0.025").replace("x - 0.5, 0.075", "x - 0.05, 0.075"), 0.05,
         "low tips about the right edge of ground"),
    ],
)  # fmt: skip
def test_what_tips_is_the_body_that_turns(text, limit, way):
    """The corner that stays is one of the body below, which stands still."""
    ((_, high),) = found(text, "x").ends
    assert (high.value, high.gives_way[0]) == (pytest.approx(limit, rel=1e-8), way)


def test_a_ladder_against_a_rough_wall():
    """tan a = (1 - mu nu) / (2 mu)."""
    answer = found(LADDER, "a")
    assert answer.rest == [pytest.approx((math.atan((1 - 0.12) / 0.8), math.pi / 2), rel=1e-13)]
    assert answer.ends[0][0].gives_way == ("slips at floor", "slips at wall")
    assert answer.ends[0][1].gives_way == ("bodies would cross at wall",)
    assert text(answer.ends[0][0].exact) == "atan(1.1)"
    least = found(LADDER, "mu")
    assert least.rest == [(pytest.approx(1 / (0.3 + 2 * math.tan(math.pi / 3)), rel=1e-13), None)]
    assert text(least.ends[0][0].expression) == "cos(a)/(nu*cos(a) + 2*sin(a))"


def test_what_friction_is_no_matter_of():
    """A ladder's mass cancels: rest at every mass, or at none."""
    assert found(LADDER, "m").rest == [(0.0, None)]
    assert found(LADDER, "m", mu=0.2).rest == []
    assert rest_text(found(LADDER, "m", mu=0.2)) == "rest is possible at no value of m (slips at floor, slips at wall)"


def test_where_no_value_rests_what_gives_way_is_told():
    """Lifted by more than its weight a block leaves its ramp; above F = 8.34 N a tall box tips, whatever mu is."""
    lifted = INCLINE.replace("contacts:", "forces: {lift: {type: force, on: block, value: [0, 70, 0]}}\ncontacts:")
    assert found(lifted, "mu", m2=0.001).gives_way == ("lifts off at c1",)
    tall = found(BOX, "mu", F=30)
    assert (tall.rest, tall.gives_way) == ([], ("box tips about its upper edge",))
    rod = mbs.range_of_rest(mbs.loads(POINT_ON_A_ROD), "m")
    assert rest_text(rod) == "rest is possible at no value of m (nothing holds it)"
    assert rod.as_json()["gives_way"] == ["nothing holds it"]
    assert "gives_way" not in found(LADDER, "m").as_json()


def test_what_ends_a_range_without_forces_is_told():
    """A weight on a rough rail rests up to atan b, from 0 where the angle is declared positive."""
    rail = """
multibody_sym: 1
name: rail
gravity: [0, -g, 0]
parameters: {g: 10, m: 2, a: {value: 30 deg, positive: true}, b: 0.2}
bodies: {ground: {frames: {slope: {rotate: [{axis: z, angle: a}]}}}, w: {mass: m}}
joints: {j: {type: prismatic, parent: ground.slope, child: w, axis: x}}
forces: {rub: {type: friction, joint: j, static: b}}
"""
    low, high = found(rail, "a").ends[0]
    assert (low.value, low.gives_way) == (0.0, ("a is declared positive",))
    assert (high.value, high.gives_way) == (pytest.approx(math.atan(0.2), rel=1e-13), ("slips at rub",))


def test_an_end_has_the_value_of_its_formula_and_the_digits_that_hold():
    low, high = found(LADDER, "a").ends[0]
    assert low.value == pytest.approx(math.atan((1 - 0.4 * 0.3) / (2 * 0.4)), rel=4e-16)
    assert (low.error, low.as_json().get("error")) == (0.0, None)
    assert abs(high.value - math.pi / 2) <= high.error == high.as_json()["error"] < 1e-10
    flat = mbs.RangeOfRest("F", ((RestBound(1 / 3, error=1e-6), RestBound(2 / 3, error=2e-4)),), (None, None), unit="N")
    assert rest_text(flat) == "rest is possible for F from 0.33333 N\n  to 0.67 N"


def test_one_value_and_all_of_them_are_told_as_such():
    one, turn = mbs.RangeOfRest("F", ((RestBound(2.5), RestBound(2.5 + 1e-13)),), (None, None), unit="N"), math.pi
    assert rest_text(one) == "rest is possible only for F = 2.5 N"
    whole = mbs.RangeOfRest("a", ((RestBound(-turn), RestBound(turn)),), (-turn, turn), unit="rad")
    assert rest_text(whole).startswith("rest is possible at every value of a\nnote: looked for through a whole turn")


def test_friction_in_space_is_a_circle():
    answer = found(SLOPE, "F")
    limit = 50 * math.sqrt(0.09 * math.cos(0.2) ** 2 - math.sin(0.2) ** 2)
    assert answer.rest == [pytest.approx((-limit, limit), rel=1e-12)]
    assert text(answer.ends[0][1].expression) == "g*m*sqrt(mu^2*cos(a)^2 - sin(a)^2)"
    assert found(SLOPE, "mu").rest[0][0] == pytest.approx(
        math.hypot(50 * math.sin(0.2), 2) / 50 / math.cos(0.2), rel=1e-13
    )
    steep = brentq(lambda a: math.hypot(50 * math.sin(a), 2) - 15 * math.cos(a), 0.1, 0.5, xtol=1e-15)
    assert found(SLOPE, "a").rest == [pytest.approx((-steep, steep), rel=1e-12)]


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


@pytest.mark.parametrize("formalism", ["newton_euler", "dalembert_lagrange", "multipliers"])
@pytest.mark.parametrize(("file", "vary"), [(INCLINE, "m2"), (LADDER, "mu"), (BOX, "F"), (SLOPE, "F")])
def test_bodies_cut_free_and_virtual_work_say_the_same(file, vary, formalism):
    system = mbs.loads(file)
    direct, routed = (mbs.range_of_rest(system, vary, formalism=name) for name in (None, formalism))
    assert len(direct.rest) == len(routed.rest) == 1
    assert [x or 0.0 for x in routed.rest[0]] == pytest.approx([x or 0.0 for x in direct.rest[0]], rel=1e-12)


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


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "incline.yaml"
    file.write_text(INCLINE)
    assert main(["equilibrium", str(file), "--vary", "m1", "--json"]) == 0
    printed = capsys.readouterr()
    answer = json.loads(printed.out)
    wanted = [4 / (math.sqrt(0.5) * 1.02), 4 / (math.sqrt(0.5) * 0.98)]
    assert answer["parameter"] == "m1"
    assert answer["rest"] == [pytest.approx(wanted, rel=1e-14)]
    assert answer["ends"][0][0]["expression"] == "m2/(mu*cos(alpha) + sin(alpha))"
    assert answer["ends"][0][0]["gives_way"] == ["slips at c1"]
    assert (
        "rest is possible for m1 from m2/(mu*cos(alpha) + sin(alpha)) = 200*sqrt(2)/51 = 5.545935539 kg" in printed.err
    )
    assert main(["equilibrium", str(file), "--vary", "mu"]) == 0
    assert "rest is possible for mu >= " in capsys.readouterr().out


@pytest.mark.parametrize("angle", [0.0, 20.0])
def test_an_end_at_which_forces_are_infinite_does_not_belong_to_the_range(angle: float) -> None:
    """A bar between two walls rests for mu > tan(th): at mu each presses with m g/(2 (mu - tan(th))) at the least."""
    text = """
multibody_sym: 1
name: bar
gravity: [0, -9.81, 0]
parameters: {m: 2 kg, l: {value: 1 m, positive: true}, th: ANGLE deg, mu: 0.5}
bodies:
  ground: {surfaces: {left: {plane: [0, 0, 0], normal: x}, right: {plane: ["l*cos(th)", 0, 0], normal: -x}}}
  bar: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {a: [0, 0, 0], b: [l, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: bar, initial: {q: [0, 0, th]}}}
contacts:
  a: {between: [bar.a, ground.left], static: mu}
  b: {between: [bar.b, ground.right], static: mu}
"""
    found = mbs.range_of_rest(mbs.loads(text.replace("ANGLE", str(angle))), "mu")
    ((low, high),) = found.ends
    least = math.tan(math.radians(angle))
    assert low.open
    assert low.value == pytest.approx(least, abs=1e-11)
    assert high.value is None
    assert rest_text(found) == f"rest is possible for mu > {least:.10g} (slips at a, slips at b)"


def test_what_cannot_be_varied_is_told() -> None:
    system = mbs.loads(INCLINE)
    with pytest.raises(InputError, match="there is no parameter 'm3'"):
        mbs.range_of_rest(system, "m3")
    with pytest.raises(ArgumentError, match="the name of a parameter"):
        mbs.range_of_rest(system, 3)


def test_rest_on_what_moves_is_asked_for_beside_it() -> None:
    """A crate on a truck that brakes: its joint's parent is the truck, and mu >= b / g; else it is told."""
    truck = """\
multibody_sym: 1
name: truck
gravity: [0, -g, 0]
parameters: {g: {value: 10, positive: true}, mu: 0.5, b: 3}
bodies:
  truck: {mass: 1000, surfaces: {bed: {plane: [0, 1, 0], normal: y}}, points: {deck: [0, 1, 0]}}
  crate: {mass: 20}
joints:
  road: {type: prismatic, parent: ground, child: truck, axis: x, motion: -b*t^2/2}
  J: {type: point, parent: truck.deck, child: crate}
contacts: {c: {between: [crate, truck.bed], static: mu}}
"""
    found = mbs.range_of_rest(mbs.loads(truck), "mu")
    assert found.rest == [(pytest.approx(0.3, rel=1e-13), None)]
    assert text(found.ends[0][0].expression) == "b/g"
    free = truck.replace("parent: truck.deck, child: crate", "parent: ground, child: crate, initial: {q: [0, 1]}")
    with pytest.raises(NoSolutionError, match="carried along by a prescribed motion"):
        mbs.range_of_rest(mbs.loads(free), "mu")


def test_what_nothing_touches_rests_where_its_loads_balance() -> None:
    """A hinged rod that a moment holds at an angle: M = m g l sin(a) alone."""
    rod = """\
multibody_sym: 1
name: rod
gravity: [0, -g, 0]
parameters: {g: 10, m: 2, l: 0.5, M: 5, a: 0.3}
bodies: {rod: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: rod, axis: z, initial: {q: a}}}
forces: {drive: {type: torque, joint: hinge, value: M}}
"""
    (alone,) = mbs.range_of_rest(mbs.loads(rod), "M").rest
    assert alone == pytest.approx((10 * math.sin(0.3), 10 * math.sin(0.3)), rel=1e-13)
    angles = mbs.range_of_rest(mbs.loads(rod.replace("M: 5", "M: 4")), "a").rest
    low = math.asin(0.4)
    assert [x for pair in angles for x in pair] == pytest.approx([low, low, math.pi - low, math.pi - low], rel=1e-12)


POINT_ON_A_ROD = """\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, e: 0.1 m, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {H: {type: revolute, parent: ground, child: bob, q: th, initial: {q: 30 deg}}}
"""


def test_no_rest_is_told_at_a_value_at_which_the_model_has_no_start() -> None:
    """A mass point on its hinge resists no rotation: m*g*l*sin(th) = 0 has no root l of a pendulum that is aside."""
    rod = mbs.loads(POINT_ON_A_ROD)
    with pytest.raises(NoSolutionError, match="no inertia"):
        mbs.simulate(rod, t_end=0.1, parameters={"l": 0})
    assert [mbs.range_of_rest(rod, name).rest for name in "lmg"] == [[], [], [(0.0, 0.0)]]
    assert mbs.range_of_rest(rod, "l", initial={"th": 0}).rest == [(None, None)]
    aside = mbs.loads(POINT_ON_A_ROD.replace("[0, -l, 0]", "[0, -(l - e), 0]"))
    assert mbs.range_of_rest(aside, "l").rest == []


def test_an_end_at_which_the_model_has_no_start_does_not_belong_to_the_range() -> None:
    stop = mbs.loads(POINT_ON_A_ROD.replace("q: th", "q: th, limits: {lower: 30 deg}"))
    found = mbs.range_of_rest(stop, "l")
    assert [(low.value, low.open, high.value) for low, high in found.ends] == [(0.0, True, None)]
    assert rest_text(found) == "rest is possible for l > 0 m (H leaves its stop)"


@pytest.mark.parametrize(("slope", "least"), [("0", 0.0), ("0.1", 0.1)])
def test_a_coefficient_that_does_not_grow_for_ever_has_no_ray_of_rest(slope: str, least: float) -> None:
    """tan(a) >= tan(slope) up to pi/2, beyond which the coefficient is negative, and again in the third quadrant."""
    system = mbs.loads(f"""
multibody_sym: 1
name: flat
gravity: [0, -10, 0]
parameters: {{a: 0.3}}
bodies: {{p: {{mass: 2}}, ground: {{surfaces: {{t: {{plane: [0, 0, 0], normal: [-sin({slope}), cos({slope}), 0]}}}}}}}}
joints: {{free: {{type: point, parent: ground, child: p, q: [x, y]}}}}
contacts: {{c: {{between: [p, ground.t], static: tan(a)}}}}
""")
    ends = [(low.value, high.value) for low, high in mbs.range_of_rest(system, "a").ends if low.value < high.value]
    assert ends == [
        (pytest.approx(least - math.pi), pytest.approx(-math.pi / 2)),
        (pytest.approx(least, abs=1e-12), pytest.approx(math.pi / 2)),
    ]


ROUGH_HINGE = """
multibody_sym: 1
name: hinge
gravity: [0, -g, 0]
parameters:
  g: {value: 10 m/s^2, positive: true}
  m: {value: 1 kg, positive: true}
  l: {value: 0.5 m, positive: true}
  r: {value: 0.4 m, positive: true}
  mu: {value: 0.3, positive: true}
  th: 10 deg
bodies: {rod: {mass: m, com: [0, -l, 0]}}
joints: {A: {type: revolute, parent: ground, child: rod, axis: z, q: phi, initial: {q: th}}}
forces: {rub: {type: friction, joint: A, static: mu, radius: r}}
"""


@cache
def rough_hinge() -> mbs.RangeOfRest:
    return mbs.range_of_rest(mbs.loads(ROUGH_HINGE), "th")


def test_a_range_about_pi_is_told_as_one_with_one_multiple_of_pi() -> None:
    """A rod in a rough hinge rests where m g l |sin th| <= mu r m g: below it, and upside down as well."""
    found = rough_hinge()
    low, high = math.asin(0.24), math.pi - math.asin(0.24)
    expected = [-low, low, high, math.pi + low]
    assert [end.value for pair in found.ends for end in pair] == pytest.approx(expected, rel=1e-12)
    assert [text(end.expression) for pair in found.ends for end in pair] == [
        "-asin(mu*r/l)",
        "asin(mu*r/l)",
        "pi - asin(mu*r/l)",
        "asin(mu*r/l) + pi",
    ]


def test_the_turn_that_was_looked_through_has_all_ranges_within() -> None:
    """The range about pi ends past pi: the turn of which the note speaks ends there, and begins one turn before."""
    found = rough_hinge()
    begin, end = found.searched
    assert begin is not None
    assert end is not None
    assert end - begin == pytest.approx(2 * math.pi, rel=1e-13)
    assert all(begin <= bound.value <= end for pair in found.ends for bound in pair if bound.value is not None)
    past = math.asin(0.24) + math.pi
    told = rest_text(found).splitlines()[-1]
    assert told == f"note: looked for through a whole turn, from {past - 2 * math.pi:.6g} rad to {past:.6g} rad"
    told = rest_text(found, chosen_units("deg")).splitlines()[-1]
    assert told.endswith(f"from {math.degrees(past) - 360:.6g} deg to {math.degrees(past):.6g} deg")


def test_a_ladder_on_a_smooth_wall_slips_at_its_foot_alone():
    """mu = 1/(2 tan a); what is smooth slips anyway."""
    model = """
multibody_sym: 1
name: ladder
gravity: [0, -9.81, 0]
parameters: {L: 3, a: 1.0, mu: 0.4}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  ladder: {shape: {rod: L, mass: 10}, points: {foot: [0, 0, 0], top: [L, 0, 0]}}
joints: {j: {type: planar, parent: ground, child: ladder, q: [x, y, th], initial: {q: [L*cos(a), 0, pi - a]}}}
contacts:
  foot: {between: [ladder.foot, ground.floor], static: mu}
  top: {between: [ladder.top, ground.wall], static: 0}
"""
    ((low, _),) = found(model, "mu").ends
    assert low.value == pytest.approx(1.0 / (2.0 * math.tan(1.0)), rel=1e-9)
    assert low.gives_way == ("slips at foot",)


STRING = """\
multibody_sym: 1
name: a block on a slope that an elastic string holds, as far as it is taut
gravity: [0, -9.81, 0]
parameters: {a: 0.3 m, F: 30 N}
bodies: {m: {mass: 2 kg}, ground: {points: {l: [0, 0, 0]}, frames: {sl: {rotate: [{axis: z, angle: -30 deg}]}}}}
joints: {P: {type: prismatic, parent: ground.sl, child: m, axis: x, q: s, initial: {q: 0.45}}}
forces:
  f: {type: pull, between: [ground.l, m], value: "PULL"}
  r: {type: friction, joint: P, static: 0.3}
"""


@pytest.mark.parametrize("value", [0.3, 2.0])
@pytest.mark.parametrize(("length", "before"), [("a", ""), ("A", "A: {value: a}, ")])
def test_a_length_beyond_which_a_string_is_slack_is_no_angle(value: float, length: str, before: str) -> None:
    """|2 g sin 30 - 50 (0.45 - a)| <= 0.3 * 2 g cos 30; at all lengths > 0.45 m the conditions are the same."""
    model = STRING.replace("PULL", f"50*max(distance - {length}, 0)").replace("F: 30 N", f"{before}F: 30 N")
    found = mbs.range_of_rest(mbs.loads(model), "a", parameters={"a": value})
    weight, friction = 2 * 9.81 * 0.5, 0.3 * 2 * 9.81 * math.cos(math.pi / 6)
    (ends,) = found.rest
    assert ends == pytest.approx((0.45 - (weight + friction) / 50, 0.45 - (weight - friction) / 50), rel=1e-12)
    assert found.unit == "m"
    assert found.searched == pytest.approx((0.0, 1e4 * value))


def test_a_load_that_acts_beyond_a_threshold_is_found_there() -> None:
    found = mbs.range_of_rest(mbs.loads(STRING.replace("PULL", "max(F - 28, 0)")), "F", parameters={"F": 5.0})
    weight, friction = 2 * 9.81 * 0.5, 0.3 * 2 * 9.81 * math.cos(math.pi / 6)
    (ends,) = found.rest
    assert ends == pytest.approx((28 + weight - friction, 28 + weight + friction), rel=1e-12)
    assert found.unit == "N"


ON_A_SHELF = """\
multibody_sym: 1
name: on_a_shelf
gravity: [0, -10, 0]
parameters: {x0: X0 m}
bodies:
  ground:
    points: {s: [-2, -0.2, 0], left: [-4, 0, 0]}
    surfaces: {shelf: {plane: [0, 0, 0], normal: y, between: [left, [0, 0, 0]]}}
  shelf: {shape: {box: [4, 0.4, 1], mass: 5}}
  b: {shape: {box: [0.4, 0.2, 0.2], mass: 2}}
  p: {mass: 1}
joints:
  js: {type: fixed, parent: ground.s, child: shelf}
  jb: {type: planar, parent: ground, child: b, q: [x, y, turn], initial: {q: [BOX, 0.1, 0]}}
  jp: {type: point, parent: ground, child: p, q: [px, py], initial: {q: [POINT, 0]}}
contacts: {c: {between: [b, shelf.top], static: 0.3}, d: {between: [p, ground.shelf]}}
"""


@pytest.mark.parametrize(("declared", "box", "point"), [(-1, "x0", "-1"), (0.05, "x0", "-1"), (0.05, "-1", "x0")])
def test_what_lies_on_a_shelf_rests_from_one_end_of_it_to_the_other(declared: float, box: str, point: str) -> None:
    """Wherever it lies as declared, there too where that is past the end: what touches changes with the parameter."""
    model = ON_A_SHELF.replace("X0", str(declared)).replace("BOX", box).replace("POINT", point)
    found = mbs.range_of_rest(mbs.loads(model), "x0")
    assert len(found.rest) == 1
    assert found.rest[0] == pytest.approx((-4, 0), abs=1e-9)


@pytest.mark.parametrize("declared", [0.5, -0.05])
def test_the_end_of_a_face_is_at_most_where_what_lies_on_it_tips(declared: float) -> None:
    """No body moves with such a parameter, but what touches changes with it."""
    model = ON_A_SHELF.replace("BOX", "0.1").replace("POINT", "-1").replace("X0", str(declared))
    model = model.replace("between: [left, [0, 0, 0]]", "between: [left, [x0, 0, 0]]")
    found = mbs.range_of_rest(mbs.loads(model.replace("[b, shelf.top]", "[b, ground.shelf]")), "x0")
    ((low, high),) = found.rest
    assert low == pytest.approx(0.1, abs=1e-9)
    assert high == found.searched[1]


HUNG = """\
multibody_sym: 1
name: hung
gravity: [0, -10, 0]
parameters: {s0: DECLARED m}
bodies: {ground: {points: {top: [0, 3, 0]}}, b: {mass: 2}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: y, q: s, initial: {q: s0}}}
constraints: {r: {type: rope, path: [ground.top, b], length: 1.7 m, slack: true}}
"""


@pytest.mark.parametrize("declared", [1.3, 2, 0.7])
def test_a_load_rests_where_its_rope_is_just_taut_wherever_it_is_declared(declared: float) -> None:
    """No value that is looked at first is the one at which it hangs."""
    found = mbs.range_of_rest(mbs.loads(HUNG.replace("DECLARED", str(declared))), "s0")
    assert found.rest == [(pytest.approx(1.3, abs=1e-12), pytest.approx(1.3, abs=1e-12))]
    assert "rest is possible only for s0 = 1.3 m" in rest_text(found)
