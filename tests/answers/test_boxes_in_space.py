"""A box on four corners in space: the formulas, conditions and limits of the same box in a plane, as short as there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import multibody_sym as mbs
from multibody_sym.contact_laws import search
from multibody_sym.contact_laws.search import States
from multibody_sym.documents.notes import redundancy_lines
from multibody_sym.documents.solution import solution_text
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.linear_inequalities import outline
from multibody_sym.scalars.node import symbol
from multibody_sym.text.printer import text

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
                "F*h + g*m*cos(alpha)*(b + h*nu) >= 0": "c1 tips about corner1, corner4",
                "g*m*cos(alpha)*(b - h*nu) >= F*h": "c1 tips about corner2, corner3",
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


TABLE = """\
multibody_sym: 1
name: table
gravity: [0, 0, -g]
parameters:
  {g: 10 m/s^2, m: {value: 5 kg, positive: true}, a: {value: 0.6 m, positive: true}, b: {value: 0.4 m, positive: true},
  h: 0.7 m, mu: 0.4, P: {value: 30 N, positive: true}, x: 0.2 m, y: 0.1 m}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  table:
    mass: m
    com: [0, 0, h]
    inertia: {Ixx: 0.3, Iyy: 0.5, Izz: 0.6}
    points: {l1: [-a, -b, 0], l2: [a, -b, 0], l3: [a, b, 0], l4: [-a, b, 0], load: [x, y, h]}
joints: {J: {type: free, parent: ground, child: table}}
forces: {P: {type: force, on: table, at: load, value: [0, 0, -P]}}
contacts: {L: {between: ["table.l#", ground.floor], static: mu, repeat: 4}}
"""


def test_a_table_stands_on_four_legs() -> None:
    """The single legs have no force that statics tells, their sum has; beyond two legs the load tips the table."""
    found = solved(TABLE)
    forces = found.reactions["L"]
    assert {name: text(x.expression) for name, x in forces.items() if x.value} == {
        "normal": "P + g*m",
        "at_x": "P*x/(P + g*m)",
        "at_y": "P*y/(P + g*m)",
    }
    assert set(found.states.values()) == {"stick"}
    assert all(x.value == 0.0 for x in found.accelerations.values())
    assert found.not_unique == ["L1", "L2", "L3", "L4"]
    assert found.limits == {
        "P*(a + x) + a*g*m >= 0": "L tips about L1, L4",
        "P*(b + y) + b*g*m >= 0": "L tips about L1, L2",
        "P*a + a*g*m >= P*x": "L tips about L2, L3",
        "P*b + b*g*m >= P*y": "L tips about L3, L4",
    }
    assert found.verdict == "one"


PULLED = TABLE.replace("value: [0, 0, -P]", "value: [H, 0, -P]").replace("mu: 0.4,", "mu: 0.3, H: 0 N,")


def test_forces_of_legs_that_cancel_are_nothing_and_those_that_are_not_unique_are_named() -> None:
    """The load pulls by 0 N: what rounding leaves of four legs' friction is none of it."""
    m, P, x, y = 12.0, 50.0, 0.1, 0.05
    found = solved(PULLED, g=9.81, m=m, P=P, b=0.6, x=x, y=y)
    assert found.reactions["L"]["friction_1"].value == 0.0
    assert found.reactions["L"]["friction_2"].value == 0.0
    named = (f"{part}(L{k})" for k in range(1, 5) for part in ("normal", "friction_1", "friction_2"))
    assert f"  {', '.join(named)}\n" in solution_text(found)


def test_that_nothing_fulfils_the_laws_is_not_said_of_slip_in_any_direction(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method finds directions of slip in space: where it found none, nothing is proved."""
    monkeypatch.setattr(States, "_locally", lambda *_: None)
    monkeypatch.setattr(search, "candidate_modes", lambda *_: iter(()))
    with pytest.raises(mbs.NoSolutionError, match=r"no state was found .* all \d+ modes.* not proved that"):
        solved(PULLED, H=50.0)


def test_a_tripod_has_a_force_in_each_leg() -> None:
    """Moments about the line of two legs: the third carries what they do not."""
    found = solved(TABLE.replace("l4: [-a, b, 0], ", "").replace("repeat: 4", "repeat: 3"))
    legs = [found.reactions[f"L{k}"]["normal"].value for k in (1, 2, 3)]
    assert legs == pytest.approx([35.0, 1.25, 43.75], rel=1e-12)  # 80 N; 6 Nm about y, 3 Nm about x
    assert set(found.limits.values()) == {"L1 opens", "L2 opens", "L3 opens"}  # no sign of x, y is declared


def test_limits_of_rest_in_space_have_closed_forms() -> None:
    """All corners slip along one tangent there; what a box on a ramp and a ladder need."""
    ((low, high),) = mbs.range_of_rest(mbs.loads(SPACE.replace(", kinetic: nu", "")), "mu").ends
    assert text(low.expression) == "(F + g*m*sin(alpha))/(g*m*cos(alpha))"
    assert low.value == pytest.approx(math.tan(math.radians(25)), rel=1e-12)
    assert high.value is None
    ladder = """\
multibody_sym: 1
name: ladder
gravity: [0, 0, -g]
parameters: {g: 10 m/s^2, m: 20 kg, l: 4 m, b: 0.4 m, phi: 65 deg, mu: 0.5}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}, wall: {plane: [0, 0, 0], normal: x}}}
  ladder:
    shape: {box: [l, b, 0.02 m], mass: m}
    points: {foot1: [l/2, -b/2, 0], foot2: [l/2, b/2, 0], top1: [-l/2, -b/2, 0], top2: [-l/2, b/2, 0]}
joints:
  J: {type: free, parent: ground, child: ladder,
      initial: {q: [l/2*cos(phi), 0, l/2*sin(phi), cos(phi/2), 0, sin(phi/2), 0]}}
contacts:
  foot: {between: ["ladder.foot#", ground.floor], static: mu, repeat: 2}
  top: {between: ["ladder.top#", ground.wall], repeat: 2}
"""
    ((low, high),) = mbs.range_of_rest(mbs.loads(ladder), "mu").ends
    assert text(low.expression) == "1/(2*tan(phi))"
    assert (low.gives_way, high.value) == (("slips at foot",), None)
    rubbing = ladder.replace("ground.wall], ", "ground.wall], static: 0.3, ")
    found = solved(rubbing)
    assert all(abs(x.value) < 1e-12 for x in found.accelerations.values())
    assert found.not_unique == ["foot1", "foot2", "top1", "top2", "foot", "top"]
    assert found.reactions["top"]["at_z"].value is None  # the feet alone may hold it: then the top presses nowhere


def test_what_is_dragged_across_a_slope_on_feet_slips_as_a_block_does() -> None:
    """Each foot could take what the other one may not: together they are held as their sum is."""
    model = """\
multibody_sym: 1
name: sledge
gravity: [g*sin(alpha), 0, -g*cos(alpha)]
parameters: {g: 10 m/s^2, m: 5 kg, mu: 0.6, alpha: 25 deg, F: {value: 12 N, positive: true}}
bodies:
  ground: {surfaces: {slope: {plane: [0, 0, 0], normal: z}}}
  sledge: {mass: m, points: {p1: [-0.1, 0, 0], p2: [0.1, 0, 0], p3: [0, 0.1, 0]}}
joints: {J: {type: point, parent: ground, child: sledge, axes: xyz}}
forces: {pull: {type: force, on: sledge, value: [0, F, 0]}}
contacts: {c: {between: ["sledge.p#", ground.slope], static: mu, repeat: 3}}
"""
    ((low, high),) = mbs.range_of_rest(mbs.loads(model), "F").ends
    c, s = math.cos(math.radians(25)), math.sin(math.radians(25))
    assert low.value == 0.0
    assert high.value == pytest.approx(50 * math.sqrt((0.6 * c) ** 2 - s**2), rel=1e-13)
    assert high.expression is not None
    assert text(high.expression) == "g*m*sqrt(mu^2*cos(alpha)^2 - sin(alpha)^2)"
    assert high.gives_way == ("slips at c",)


def pushed_aside(place: str, **values: float) -> mbs.RangeOfRest:
    """Return with which forces along y at a place of the box it rests on the ramp, or on the floor."""
    model = SPACE.replace("[b/2, 0, h/2]", place).replace("value: [F, 0, 0]", "value: [0, F, 0]")
    system = mbs.loads(model.replace(", kinetic: nu", "").replace("F: {value: 0 N}", "F: {value: 1 N, positive: true}"))
    return mbs.range_of_rest(system, "F", parameters={"mu": 0.6, **values})


def test_a_box_pushed_across_a_slope_slips_as_a_block_does_where_no_couple_turns_it() -> None:
    """The normal force then acts beside the middle along the way of slip, so that friction has no moment about it."""
    ((_, high),) = pushed_aside("[0, 0, 0]").ends
    c, s = math.cos(math.radians(25)), math.sin(math.radians(25))
    assert high.value == pytest.approx(50 * math.sqrt((0.6 * c) ** 2 - s**2), rel=1e-13)
    assert high.expression is not None
    assert text(high.expression) == "g*m*sqrt(mu^2*cos(alpha)^2 - sin(alpha)^2)"
    assert high.gives_way == ("slips at c1",)


def test_a_box_pushed_beside_its_middle_turns_as_it_slips() -> None:
    """On four equal forces of its corners; about the place where its moment and its force fit each other."""
    ((_, high),) = pushed_aside("[b/4, 0, -h/2]", alpha=0.0).ends
    load, (x, y) = 0.6 * 50 / 2, (0.1, 0.15)

    def force(centre: float) -> float:
        return load * sum((side - centre) / math.hypot(side - centre, y) for side in (x, -x))

    def moment(centre: float) -> float:
        return load * sum((side * (side - centre) + y * y) / math.hypot(side - centre, y) for side in (x, -x))

    centre = brentq(lambda at: moment(at) - x / 2 * force(at), -10.0, -0.01, xtol=1e-15, rtol=1e-15)
    assert high.value == pytest.approx(force(centre), rel=1e-12)
    assert (high.expression, high.gives_way) == (None, ("slips at c1, turning",))


LEVEL = (
    SPACE.replace("[g*sin(alpha), 0, -g*cos(alpha)]", "[0, 0, -g]")
    .replace("  alpha: 25 deg\n", "  T: {value: 1 N*m, positive: true}\n")
    .replace(", kinetic: nu", "")
    .replace("force, on: box, at: hook, value: [F, 0, 0]", "torque, on: box, value: [0, 0, T]")
)


def test_a_box_turned_by_a_couple_turns_about_its_middle() -> None:
    """All corners are as far from it, so that only the sum of their normal forces counts."""
    ((_, high),) = mbs.range_of_rest(mbs.loads(LEVEL), "T").ends
    assert high.value == pytest.approx(0.2 * 50 * math.hypot(0.2, 0.3) / 2, rel=1e-13)
    assert high.expression is not None
    assert text(high.expression) == "g*m*mu*sqrt(b^2 + c^2)/2"
    assert high.gives_way == ("slips at c1, turning",)
    ((low, _),) = mbs.range_of_rest(mbs.loads(LEVEL), "mu").ends
    assert low.value == pytest.approx(1 / 50 / (math.hypot(0.2, 0.3) / 2), rel=1e-12)
    assert low.expression is not None
    assert text(low.expression) == "2*T/(g*m*sqrt(b^2 + c^2))"


def test_a_couple_has_no_formula_where_a_parameter_would_move_the_middle() -> None:
    """On a ramp that is level by its value alone, whatever turns it does so about another place."""
    model = LEVEL.replace("[0, 0, -g]", "[g*sin(alpha), 0, -g*cos(alpha)]").replace("  T:", "  alpha: 0 deg\n  T:")
    ((_, high),) = mbs.range_of_rest(mbs.loads(model), "T").ends
    assert high.value == pytest.approx(0.2 * 50 * math.hypot(0.2, 0.3) / 2, rel=1e-12)
    assert (high.expression, high.exact is not None) == (None, True)


TRIPOD = """\
multibody_sym: 1
name: tripod
gravity: [0, 0, -g]
parameters:
  g: 10 m/s^2
  m: {value: 6 kg, positive: true}
  a: {value: 0.3 m, positive: true}
  b: {value: 0.4 m, positive: true}
  x: {value: 0.03 m, positive: true}
  y: {value: 0.05 m, positive: true}
  mu: {value: 0.5, positive: true}
  T: {value: 0.1 N*m, positive: true}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  stool: {mass: m, com: [x, y, 0.2], inertia: {Ixx: 1, Iyy: 1, Izz: 1},
          points: {p1: [0, 0, 0], p2: [a, 0, 0], p3: [0, b, 0]}}
joints: {J: {type: free, parent: ground, child: stool}}
forces: {turn: {type: torque, on: stool, value: [0, 0, T]}}
contacts: {c: {between: ["stool.p#", ground.floor], static: mu, repeat: 3}}
"""


def test_a_stool_that_stands_on_one_foot_above_all_turns_about_it() -> None:
    """The other feet carry m g x/a and m g y/b, and rub at a and b from the first: T = mu m g (x + y)."""
    ((_, high),) = mbs.range_of_rest(mbs.loads(TRIPOD), "T").ends
    assert high.value == pytest.approx(0.5 * 60 * 0.08, rel=1e-13)
    assert high.expression is not None
    assert text(high.expression) == "g*m*mu*(x + y)"
    skew = TRIPOD.replace("p3: [0, b, 0]", "p3: [-a, b, 0]").replace("[x, y, 0.2]", "[0, y, 0.2]")
    ((_, high),) = mbs.range_of_rest(mbs.loads(skew.replace("  x: {value: 0.03 m, positive: true}\n", "")), "T").ends
    # moments about the line of the first two feet: N3 = m g y/b; about y: N2 = N3
    load = 60 * 0.05 / 0.4
    assert high.value == pytest.approx(0.5 * load * (0.3 + 0.5), rel=1e-13)
    assert high.expression is not None
    values = {"g": 10.0, "m": 6.0, "a": 0.5, "b": 0.7, "y": 0.06, "mu": 0.3}
    found = evaluate_float([high.expression], {symbol(name): x for name, x in values.items()})[0]
    assert found == pytest.approx(0.3 * (60 * 0.06 / 0.7) * (0.5 + math.hypot(0.5, 0.7)), rel=1e-13)


def test_a_box_pushed_high_enough_tips() -> None:
    ((_, high),) = pushed_aside("[0, 0, 3*h]", mu=3.0).ends
    assert high.expression is not None
    assert text(high.expression) == "c*g*m*cos(alpha)/(7*h)"
    assert high.gives_way == ("box tips about its edge",)


ON_RAILS = """multibody_sym: 1
name: bar_on_rails
gravity: [0, 0, -10]
parameters: {m: {value: 2 kg, positive: true}, mu: {value: 0.5, positive: true}, F: {value: 3 N, positive: true}}
bodies:
  ground: {surfaces: {A: {segment: [[-1, -0.3, 0], [1, -0.3, 0]]}, B: {segment: [[-1, 0.3, 0], [1, 0.3, 0]]}}}
  bar: {mass: m, inertia: {Ixx: 0.1, Iyy: 0.01, Izz: 0.1}, surfaces: {side: {segment: [[0, -1, 0], [0, 1, 0]]}}}
joints: {J: {type: free, parent: ground, child: bar}}
contacts: {A: {between: [bar.side, ground.A], static: mu}, B: {between: [bar.side, ground.B], static: mu}}
forces: {push: {type: force, on: bar, value: [F, 0, 0]}}
"""


def test_a_bar_on_two_rails_says_that_slipping_is_not_decided() -> None:
    """The rails may press along the bar against each other, so that no formula tells which one gives way."""
    conditions = solved(ON_RAILS).conditions
    for name in "AB":
        size = f"sqrt(friction_1({name})^2 + friction_2({name})^2)"
        assert f"{size} <= mu*normal({name}) is not decided: the forces are not unique" in conditions


@pytest.mark.parametrize("off", [0.0, 0.1])
def test_a_box_pulled_off_its_middle_is_said_to_turn_before_it_slips(off: float) -> None:
    """All corners together could hold mu m g; with a couple they do not: what the condition on their sum leaves out."""
    hook = f"[b/2, {off}, -h/2]"
    model = SPACE.replace("[b/2, 0, h/2]", hook).replace("alpha: 25 deg", "alpha: 0")
    found = solved(model, F=1.0)
    assert set(found.states.values()) == {"stick", "open"}
    turns = [broken for condition, broken in found.limits.items() if "couple about its normal" in condition]
    assert turns == (["c1 turns"] if off else [])
    beyond = solved(model, F=0.97 * 0.2 * 5 * 9.81)
    assert ("slide" in beyond.states.values()) == bool(off)


PUSHED = """
multibody_sym: 1
name: box pushed at a corner
gravity: [0, 0, -9.81 m/s^2]
parameters: {m: 10 kg, F: 20 N, mu: 0.25}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [1, 0.6, 0.4], mass: m}, points: {hand: [0.5, 0.3, 0]}}
joints: {J: {type: free, parent: ground, child: box, initial: {q: [0, 0, 0.2, 1, 0, 0, 0], u: [%s]}}}
contacts: {c: {between: [box, ground.floor], static: mu}}
forces: {push: {type: force, on: box, at: box.hand, value: [0, F, 0]}}
"""


@pytest.mark.parametrize("speeds", ["0, 0, 0, 0, 0, 0", "1, 0.5, 0, 0, 0, 2"])
def test_a_motion_that_open_forces_change_fulfils_all_laws(speeds: str) -> None:
    """Four normal forces are open by one number, and with friction so is the motion: `solve` takes one."""
    found = mbs.solve(mbs.loads(PUSHED % speeds))
    assert found.verdict == "several"
    assert "forces that are not unique change how it slides" in found.searched
    u = np.array([float(x) for x in speeds.split(",")])
    a = np.array([found.accelerations[name].value for name in ("J_x", "J_y", "J_wz")])
    sums = np.zeros(3)
    for k, (x, y) in enumerate([(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)], 1):
        force = {name: value.value for name, value in found.reactions[f"c.corner{k}"].items()}
        rubs = np.array([force["friction_1"], force["friction_2"]])
        v = u[:2] + u[5] * np.array([-y, x])
        way = v if v.any() else a[:2] + a[2] * np.array([-y, x])
        assert force["normal"] >= 0.0
        assert np.linalg.norm(rubs) <= 0.25 * force["normal"] + 1e-9
        if np.linalg.norm(way) > 1e-9:
            np.testing.assert_allclose(rubs, -0.25 * force["normal"] * way / np.linalg.norm(way), atol=1e-8)
        sums += [*rubs, x * rubs[1] - y * rubs[0]]
    sums += [0.0, 20.0, 0.5 * 20.0]
    np.testing.assert_allclose(sums, [10 * a[0], 10 * a[1], 10 * (1 + 0.36) / 12 * a[2]], atol=1e-8)
    others = [tuple(other.accelerations.values()) for other in found.others]
    assert tuple(x.value for x in found.accelerations.values()) not in others


def test_what_redundant_rows_mean_is_told_of_a_box_that_starts_to_slide() -> None:
    """It starts in a direction that is known before it moves; a report ended with an internal error."""
    model = PUSHED % "0, 0, 0, 0, 0, 0"
    along = model.replace("at: box.hand, value: [0, F, 0]", "value: [2*F, 0, 0]")
    run = mbs.simulate(mbs.loads(along), t_end=0.1, samples=3)
    assert run.redundancy.rank == 3
    assert run.redundancy.ambiguous_forces == tuple(f"normal(c.corner{k})" for k in range(1, 5))
    turned = mbs.simulate(mbs.loads(model), t_end=0.1, samples=3)
    assert turned.redundancy.ambiguous_forces == ()
    assert "with friction what slides moves by them" in "\n".join(redundancy_lines(turned.redundancy))
