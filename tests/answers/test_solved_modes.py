"""A start solved in a given mode: formulas, forces of contacts, states in words, conditions as books have them."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

import multibody_sym as mbs
from multibody_sym.answers.instant.instant import Decided, solved_in
from multibody_sym.answers.solve import solution_of
from multibody_sym.documents.solution import solution_text
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.modes import in_mode

HEAD = "multibody_sym: 1\nname: problem\ngravity: [0, -g, 0]\n"

RAMP = """
parameters: {g: 10 m/s^2, a: 30 deg, mu: 0.8, nu: 0.5, m: 2 kg}
bodies:
  ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  block: {mass: m}
joints: {J: {type: point, parent: ground, child: block}}
contacts: {c1: {between: [block, ground.ramp], static: mu, kinetic: nu}}
"""

PULLED = """
parameters: {g: 10 m/s^2, alpha: 30 deg, beta: 20 deg, mu: 0.1, m1: 2 kg, m2: 3 kg, F1: 30 N, F2: 5 N}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b1: {mass: m1}, b2: {mass: m2}}
joints:
  J: {type: point, parent: ground, child: b1}
  K: {type: point, parent: ground, child: b2, initial: {q: [1 m, 0]}}
constraints: {string: {type: rope, path: [b1, b2]}}
forces:
  f1: {type: force, on: b1, value: [-F1*cos(alpha), F1*sin(alpha), 0]}
  f2: {type: force, on: b2, value: [F2*cos(beta), F2*sin(beta), 0]}
contacts: {c1: {between: [b1, ground.floor], static: mu}, c2: {between: [b2, ground.floor], static: mu}}
"""

RIDGE = """
parameters: {g: 10 m/s^2, a: 45 deg, b: 30 deg, mu: 0.1, m1: 1 kg, m2: 1 kg}
bodies:
  ground:
    surfaces:
      left: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}
      right: {plane: [0, 0, 0], normal: [sin(b), cos(b), 0]}
  b1: {mass: m1}
  b2: {mass: m2}
joints:
  J: {type: point, parent: ground, child: b1, initial: {q: [-cos(a), -sin(a)]}}
  K: {type: point, parent: ground, child: b2, initial: {q: [cos(b), -sin(b)]}}
pulleys: {P: {at: ground}}
constraints: {string: {type: rope, path: [b1, P, b2]}}
contacts: {c1: {between: [b1, ground.left], static: mu}, c2: {between: [b2, ground.right], static: mu}}
"""


def solved(model: str, slips: dict[str, int], *, at_limit: tuple[str, ...] = (), opened: str = "") -> mbs.Solution:
    """Return the solution in a mode in which all touch but what is `opened`."""
    system = mbs.loads(HEAD + model)
    declared = check_numbers(system)
    names = [element.name for element in declared.one_way]
    mode = Mode({name: int(name != opened) for name in names}, slips)
    mechanism = in_mode(declared, mode)
    decided = Decided(touching=frozenset(names), at_limit=at_limit)
    return solution_of(solved_in(system, mechanism, start(mechanism), decided=decided))


def expression(solution: mbs.Solution, element: str, component: str) -> str | None:
    return solution.reactions[element][component].as_json()["expression"]


def test_two_blocks_pulled_apart_slide_to_the_left() -> None:
    solution = solved(PULLED, {"c1": -1, "c2": -1})
    assert solution.accelerations["J_x"].value == pytest.approx(-3.5906618162532906, rel=1e-12)
    assert solution.reactions["string"]["tension"].value == pytest.approx(18.29943848102658, rel=1e-12)
    assert expression(solution, "c1", "normal") == "g*m1 - F1*sin(alpha)"
    assert expression(solution, "c2", "friction") == "mu*(g*m2 - F2*sin(beta))"
    assert solution.limits == {
        "g*m1 >= F1*sin(alpha)": "c1 opens",
        "F1*cos(alpha) + F1*mu*sin(alpha) + F2*mu*sin(beta) > F2*cos(beta) + g*mu*(m1 + m2)": (
            "c1 does not slide backward"
        ),
        "g*m2 >= F2*sin(beta)": "c2 opens",
        "F1*m2*cos(alpha) + F2*m1*cos(beta) + F1*m2*mu*sin(alpha) >= F2*m1*mu*sin(beta)": "string slackens",
    }
    assert solution.conditions == tuple(solution.limits)
    assert max(len(str(value.as_json()["expression"])) for value in solution.accelerations.values()) <= 120


def test_two_blocks_on_a_ridge_have_formulas_without_common_factors() -> None:
    """The equations are divided by sines on the way; no formula keeps them."""
    solution = solved(RIDGE, {"c1": -1, "c2": -1})
    along = "(m1*mu*cos(a) + m2*mu*cos(b) + m2*sin(b) - m1*sin(a))/(m1 + m2)"
    assert solution.as_json()["accelerations"]["J_x"]["expression"] == f"g*cos(a)*{along}"
    assert solution.as_json()["accelerations"]["J_y"]["expression"] == f"g*sin(a)*{along}"
    tension = solution.reactions["string"]["tension"]
    assert tension.value == pytest.approx(6.114993217231683, rel=1e-12)
    assert expression(solution, "string", "tension") == "g*m1*m2*(mu*(cos(b) - cos(a)) + sin(a) + sin(b))/(m1 + m2)"
    assert "m1*sin(a) > m1*mu*cos(a) + m2*mu*cos(b) + m2*sin(b)" in solution.conditions


def test_what_sticks_says_how_far_it_is_from_slipping() -> None:
    solution = solved(RAMP, {"c1": 0})
    assert solution.limits == {"abs(sin(a)) <= mu*cos(a)": "c1 slips"}
    assert solution_text(solution).splitlines()[:8] == [
        "problem at t = 0",
        "the state, found by the laws of contact and friction: nobody gave directions",
        "  c1 sticks: friction 10 N of at most 13.8564 N",
        "accelerations",
        "  J_x'' = 0 m/s^2",
        "  J_y'' = 0 m/s^2",
        "forces of contacts, stops and friction",
        "  normal(c1) = g*m*cos(a) = 17.32050808 N",
    ]
    told = solution.as_json()
    assert told["states"] == {"c1": "stick"}
    assert told["reactions"]["c1"]["friction"] == {"value": 10.0, "expression": "g*m*sin(a)", "unit": "N"}


def test_what_slips_from_rest_does_so_under_its_static_coefficient() -> None:
    """It goes on for tan a > nu; that it starts needs tan a > mu, which says that too: no nu is above its mu."""
    solution = solved(RAMP.replace("a: 30 deg", "a: 40 deg"), {"c1": -1})
    assert solution.limits == {"cos(a) >= 0": "c1 opens", "sin(a) > mu*cos(a)": "c1 sticks"}
    assert solution.states == {"c1": "slide-"}


IN_SPACE = """
multibody_sym: 1
name: in_space
gravity: [0, 0, -g]
parameters:
  g: {{value: 9.81, positive: true}}
  m: {{value: 2, positive: true}}
  mu: {{value: 0.5, positive: true}}
  a: {{value: 0.2, positive: true}}
  P: 3
  Q: 2
bodies: {{p: {{mass: m}}, ground: {{surfaces: {{table: {{plane: [0, 0, 0], normal: [-sin(a), 0, cos(a)]}}}}}}}}
joints: {{free: {{type: point, parent: ground, child: p, axes: xyz, q: [x, y, z]}}}}
contacts: {{c: {{between: [p, ground.table], static: mu}}}}
forces: {{push: {{type: force, on: p, value: {force}}}}}
"""


@pytest.mark.parametrize(
    ("force", "limit"),
    [
        ("[P*cos(a), Q, P*sin(a)]", "sqrt((g*m*sin(a) - P)^2 + Q^2) <= g*m*mu*cos(a)"),
        ("[0, Q, 0]", "sqrt((g*m*sin(a))^2 + Q^2) <= g*m*mu*cos(a)"),
        ("[0, 0, 0]", "abs(sin(a)) <= mu*cos(a)"),
    ],
)
def test_the_cone_in_space_is_told_as_the_size_of_friction(force: str, limit: str) -> None:
    """Not squared; and it says already that the contact presses, so that this is no condition of its own."""
    assert mbs.solve(mbs.loads(IN_SPACE.format(force=force))).limits == {limit: "c slips"}


@pytest.mark.parametrize(("mu", "how"), [("1", "at the limit"), ("tan(a)", "at the limit")])
def test_a_block_at_the_angle_of_friction_is_at_the_limit_exactly(mu: str, how: str) -> None:
    ramp = RAMP.replace("a: 30 deg", "a: 45 deg").replace("mu: 0.8", f"mu: {mu}")
    solution = solved(ramp, {"c1": 0}, at_limit=("c1.friction",))
    assert solution.at_limit == {"c1 slips": how}
    assert "  at the limit: a little further on c1 slips" in solution_text(solution).splitlines()


@pytest.mark.parametrize("mu", ["0.5773502691896", "0.577350269189625", "0.577350269189626", "0.5773502691897"])
def test_a_block_slips_where_its_coefficient_is_below_the_tangent_by_less_than_floats_tell(mu: str) -> None:
    """tan 30 deg = 1/sqrt(3), so that it slips for 3 mu^2 < 1, under the kinetic coefficient then."""
    found = mbs.solve(mbs.loads(HEAD + RAMP.replace("mu: 0.8", f"mu: {mu}")))
    slips = 3 * Fraction(mu) ** 2 < 1
    assert (found.states, found.at_limit) == ({"c1": "slide-" if slips else "stick"}, {})
    along = (0.5 * math.sqrt(3) / 2 - 0.5) * 10 if slips else 0.0
    wanted = [along * math.sqrt(3) / 2, along / 2]
    assert [a.value for a in found.accelerations.values()] == pytest.approx(wanted, abs=1e-14)


@pytest.mark.parametrize(("lift", "state"), [("20.000000000000004 N", "open"), ("19.999999999999996 N", "stick")])
def test_a_block_is_lifted_by_the_last_bit(lift: str, state: str) -> None:
    model = RAMP.replace("a: 30 deg", f"a: 0 deg, F: {lift}")
    model += "forces: {up: {type: force, on: block, value: [0, F, 0]}}\n"
    assert mbs.solve(mbs.loads(HEAD + model)).states == {"c1": state}


def test_near_the_limit_is_not_at_it() -> None:
    ramp = RAMP.replace("a: 30 deg", "a: 45 deg").replace("mu: 0.8", "mu: 1.0000000000000001")
    assert solved(ramp, {"c1": 0}, at_limit=("c1.friction",)).at_limit == {}


def test_rough_enough_says_how_much() -> None:
    enough = RAMP.replace("static: mu, kinetic: nu", "static: enough")
    solution = solved(enough, {"c1": 0})
    assert solution.needed["c1"].value == pytest.approx(0.5773502691896258, rel=1e-14)
    assert solution.as_json()["needed"]["c1"]["expression"] == "tan(a)"
    assert solution.found == ("c1 sticks: that needs a coefficient of tan(a) = 0.5773502692 or more",)
    assert solution.conditions == ("cos(a) >= 0", "g > 0")


@pytest.mark.parametrize(
    ("angle", "value", "limits"),
    [
        ("2*a", "0.1", {"abs(sin(2*a)) <= mu*cos(2*a)": "c1 slips"}),
        ("3*a", "0.3", {"cos(3*a) >= 0": "c1 opens", "sin(3*a) > mu*cos(3*a)": "c1 does not slide backward"}),
    ],
)
def test_conditions_name_the_multiple_of_an_angle_that_the_model_names(
    angle: str, value: str, limits: dict[str, str]
) -> None:
    text = """
name: steep
gravity: [0, -g, 0]
parameters: {g: {value: 10, positive: true}, m: {value: 2, positive: true}, mu: {value: 0.5, positive: true}, a: VALUE}
bodies: {p: {mass: m}, ground: {surfaces: {plane: {plane: [0, 0, 0], normal: [-sin(ANGLE), cos(ANGLE), 0]}}}}
joints: {free: {type: point, parent: ground, child: p, q: [x, y]}}
contacts: {c1: {between: [p, ground.plane], static: mu}}
"""
    solution = mbs.solve(mbs.loads("multibody_sym: 1" + text.replace("ANGLE", angle).replace("VALUE", value)))
    assert solution.limits == limits
    assert expression(solution, "c1", "normal") == f"g*m*cos({angle})"


LOADED = """multibody_sym: 1
name: loaded
gravity: [0, -g, 0]
parameters:
  g: {value: 10, positive: true}
  m: {value: 2 kg, positive: true}
  mu: {value: 0.5, positive: true}
  a: {value: 1 m, positive: true}
  h: {value: 1 m, positive: true}
  F: 3 N
"""
SLIDER = """
bodies: {block: {mass: m}}
joints: {J: {type: prismatic, parent: ground, child: block, axis: x}}
forces: {f: {type: friction, joint: J, static: mu}, push: {type: force, on: block, value: [F, 0, 0]}}
"""
PUSHED_BOX = """
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  box:
    mass: m
    com: [0, h/2, 0]
    inertia: {Izz: 1 kg*m^2}
    points: {top: [0, h, 0]}
    surfaces: {bottom: {segment: [[-a/2, 0, 0], [a/2, 0, 0]]}}
joints: {J: {type: planar, parent: ground, child: box}}
contacts: {c: {between: [box.bottom, ground.floor], static: mu}}
forces: {push: {type: force, on: box.top, value: [F, 0, 0]}}
"""


@pytest.mark.parametrize("force", ["3 N", "-3 N"])
def test_a_push_may_turn_into_a_pull_unless_it_is_declared_positive(force: str) -> None:
    """F = -30 N keeps F <= mu m g, and the block slides."""
    found = mbs.solve(mbs.loads(LOADED.replace("F: 3 N", f"F: {force}") + SLIDER))
    assert found.limits == {"abs(F) <= g*m*mu": "f slips"}


@pytest.mark.parametrize("force", ["3 N", "-3 N"])
def test_a_pushed_box_may_tip_about_either_edge(force: str) -> None:
    found = mbs.solve(mbs.loads(LOADED.replace("F: 3 N", f"F: {force}") + PUSHED_BOX))
    assert found.limits == {
        "a*g*m >= 2*F*h": "c.end1 opens",
        "2*F*h + a*g*m >= 0": "c.end2 opens",
        "abs(F) <= g*m*mu": "c slips",
    }


def test_a_push_that_is_declared_positive_has_one_side() -> None:
    declared = LOADED.replace("F: 3 N", "F: {value: 3 N, positive: true}")
    assert mbs.solve(mbs.loads(declared + SLIDER)).limits == {"g*m*mu >= F": "f slips"}


BALL_JOINT = """multibody_sym: 1
name: swinging_in_a_socket
gravity: [0, 0, -g]
parameters:
  g: {value: 10, positive: true}
  m: {value: 2 kg, positive: true}
  mu: {value: 0.3, positive: true}
  l: {value: 1 m, positive: true}
  r: {value: 0.1 m, positive: true}
bodies: {b: {mass: m, com: [0, 0, -l], inertia: {Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}}
joints: {S: {type: ball, parent: ground, child: b, initial: {u: [1, 0, 0]}}}
forces: {rub: {type: friction, joint: S, static: mu, radius: r}}
"""


def test_what_stands_under_a_root_has_its_condition() -> None:
    """J alpha = mu r N with N^2 = m^2 (g + l)^2 + (m l alpha)^2 has an N for J > mu r m l alone, J = m l^2 + 0.1."""
    found = mbs.solve(mbs.loads(BALL_JOINT))
    assert "sqrt" in str(found.accelerations["S_wx"].as_json()["expression"])
    assert found.conditions == ("m*l^2 + 0.1 > l*m*mu*r",)
