"""Whole models with contacts find their state at the start, from files that say nothing of directions."""

from __future__ import annotations

import math

import pytest
from solved_starts import numbers_at_start

import multibody_sym as mbs
from multibody_sym.dynamics.start.state import StartState, state_at
from multibody_sym.mechanics.resolve import mechanism

G = 10.0
FLOOR = "ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}"


def begun(text: str) -> StartState:
    return state_at(mechanism(mbs.loads(f"multibody_sym: 1\nname: m\ngravity: [0, -10, 0]\n{text}")))


def numbers(found: StartState) -> dict[str, float]:
    return numbers_at_start(found.mechanism, found.start)


def closed(found: StartState) -> dict[str, str]:
    return {name: word for name, word in found.words.items() if word != "open"}


@pytest.mark.parametrize(
    ("place", "force", "words"),
    [
        ("top", 1.9, {"c.corner1": "stick", "c.corner2": "stick"}),
        ("top", 2.1, {"c.corner2": "stick"}),  # 1 m F > 0.2 m * 10 N: it tips about its right edge
        ("origin", 2.9, {"c.corner1": "stick", "c.corner2": "stick"}),
        ("origin", 3.1, {"c.corner1": "slide+", "c.corner2": "slide+"}),
        ("origin", -3.1, {"c.corner1": "slide-", "c.corner2": "slide-"}),
    ],
)
def test_a_pushed_box_stands_tips_or_slides(place: str, force: float, words: dict[str, str]) -> None:
    found = begun(f"""\
bodies:
  {FLOOR}
  box: {{shape: {{box: [0.4, 1, 1], mass: 1}}, points: {{top: [-0.2, 0.5, 0]}}}}
joints: {{J: {{type: planar, parent: ground, child: box, initial: {{q: [0, 0.5, 0]}}}}}}
forces: {{push: {{type: force, on: box, at: {place}, value: [{force}, 0, 0]}}}}
contacts: {{c: {{between: [box, ground.floor], static: 0.3}}}}
""")
    assert closed(found) == words


def test_a_box_beside_a_table_does_not_touch_its_level() -> None:
    found = begun("""\
bodies:
  ground: {surfaces: {table: {plane: [0, 0, 0], normal: y, between: [[-1, 0, 0], [0, 0, 0]]}}}
  box: {shape: {box: [0.4, 0.2, 1], mass: 1}}
joints: {J: {type: planar, parent: ground, child: box, initial: {q: [0.1, 0.1, 0]}}}
contacts: {c: {between: [box, ground.table], static: 0.3}}
""")
    assert set(closed(found)) == {"c.bottom.end2"}  # its centre is beyond the edge, about which it tips
    assert numbers(found)["u_J_theta"] < -1.0


def test_a_ball_in_space_begins_to_slide_from_speed_and_from_rest() -> None:
    text = """\
bodies: {%s, ball: {shape: {sphere: 0.5, mass: 2}}}
joints: {J: {type: free, parent: ground, child: ball, initial: {q: [0, 0.5, 0, 1, 0, 0, 0], u: [%s, 0, 0, 0]}}}
forces: {push: {type: force, on: ball, value: [%s]}}
contacts: {c: {between: [ball, ground.floor], static: 0.3}}
"""
    found = begun(text % (FLOOR, "3, 0, 4", "0, 0, 0"))
    assert closed(found) == {"c": "slide"}
    assert [numbers(found)[f"u_J_{x}"] for x in "xz"] == pytest.approx([-1.8, -2.4], rel=1e-9)
    pushed = begun(text % (FLOOR, "0, 0, 0", "24, 0, 32"))  # rolling would need 2/7 of 40 N: more than 6 N
    assert closed(pushed) == {"c": "slide"}
    assert [numbers(pushed)[f"u_J_{x}"] for x in "xz"] == pytest.approx([0.6 * 17, 0.8 * 17], rel=1e-9)


def test_a_ladder_rests_or_slides() -> None:
    """It rests if tan(theta) >= (1 - mu_f mu_w)/(2 mu_f)."""
    for mu, rests in ((0.36, True), (0.29, False)):
        limit = math.atan((1 - mu * 0.2) / (2 * mu))
        found = begun(f"""\
parameters: {{a: 0.95, mu: {mu}}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}, wall: {{plane: [0, 0, 0], normal: x}}}}}}
  ladder: {{shape: {{rod: 4, mass: 6}}}}
joints: {{J: {{type: planar, parent: ground, child: ladder, initial: {{q: [4*cos(a), 0, pi - a]}}}}}}
contacts: {{f: {{between: [ladder, ground.floor], static: mu}}, w: {{between: [ladder, ground.wall], static: 0.2}}}}
""")
        assert (limit < 0.95) is rests
        assert (abs(numbers(found)["u_J_theta"]) < 1e-12) is rests


def test_what_starts_inside_is_told() -> None:
    with pytest.raises(mbs.ModelError, match=r"contacts.c: block starts 0.002 m inside ground.floor; move it out"):
        begun(f"""\
bodies: {{{FLOOR}, block: {{mass: 1}}}}
joints: {{J: {{type: point, parent: ground, child: block, initial: {{q: [0, -0.002]}}}}}}
contacts: {{c: {{between: [block, ground.floor], static: 0.3}}}}
""")


@pytest.mark.parametrize("angle", [0.0, 1e-7, 0.3, -0.3, math.pi / 2])
def test_a_ball_in_a_bowl_has_tangents_wherever_it_is(angle: float) -> None:
    """It rolls as far as friction lets it: N = m g sin(angle) below the level of the centre, and slides with mu N."""
    x, y = 1.5 * math.cos(angle), -1.5 * math.sin(angle)
    found = begun(f"""\
bodies: {{ground: {{surfaces: {{bowl: {{sphere: 2, inside: true}}}}}}, ball: {{shape: {{sphere: 0.5, mass: 1}}}}}}
joints: {{J: {{type: free, parent: ground, child: ball, initial: {{q: [{x}, {y}, 0, 1, 0, 0, 0]}}}}}}
contacts: {{c: {{between: [ball, ground.bowl], static: 0.1}}}}
""")
    normal = max(G * math.sin(angle), 0.0)
    friction = min(2 / 7 * G * math.cos(angle), 0.1 * normal)
    along = numbers(found)["u_J_x"] * math.sin(angle) + numbers(found)["u_J_y"] * math.cos(angle)
    assert -along == pytest.approx(G * math.cos(angle) - friction, abs=1e-6)


def test_a_cylinder_that_lies_on_a_floor_rolls_on_both_rims() -> None:
    found = begun(f"""\
bodies: {{{FLOOR}, roll: {{shape: {{cylinder: [0.5, 2], mass: 1}}}}}}
joints: {{J: {{type: free, parent: ground, child: roll, initial: {{q: [0, 0.5, 0, 1, 0, 0, 0]}}}}}}
forces: {{push: {{type: force, on: roll, value: [2, 0, 0]}}}}
contacts: {{c: {{between: [roll, ground.floor], static: 0.3}}}}
""")
    assert closed(found) == {"c.rim1": "stick", "c.rim2": "stick"}
    assert numbers(found)["u_J_x"] == pytest.approx(2 / 1.5, rel=1e-9)


@pytest.mark.parametrize(("force", "lifts"), [(26.0, False), (27.5, True)])
def test_a_wheel_is_pulled_up_a_step(force: float, lifts: bool) -> None:
    """It turns about the step's edge as soon as F * 0.3 m > 20 N * 0.4 m."""
    found = begun(f"""\
bodies:
  ground:
    surfaces:
      floor: {{plane: [0, 0, 0], normal: y}}
      step: {{plane: [1, 0.2, 0], normal: y, between: [[0.4, 0.2, 0], [2, 0.2, 0]]}}
  w: {{shape: {{disc: 0.5, mass: 2}}}}
joints: {{J: {{type: planar, parent: ground, child: w, initial: {{q: [0, 0.5, 0]}}}}}}
forces: {{pull: {{type: force, on: w, value: [{force}, 0, 0]}}}}
contacts: {{f: {{between: [w, ground.floor], static: 0.5}}, s: {{between: [w, ground.step], static: 0.5}}}}
""")
    assert ("f" in closed(found)) is not lifts
    assert (numbers(found)["u_J_y"] > 0.01) is lifts
    assert closed(found)["s.end1"] == "stick"


def test_a_rod_that_leans_on_a_tables_edge_is_above_it() -> None:
    """Its side is the one on which the table is not, though the edge is on both; smooth, the edge pushes across it."""
    found = begun("""\
parameters: {a: 0.7}
bodies:
  ground:
    surfaces:
      floor: {plane: [0, 0, 0], normal: y}
      table: {plane: [2, 1, 0], normal: y, between: [[1, 1, 0], [3, 1, 0]]}
  rod: {shape: {rod: 3, mass: 2}}
joints: {J: {type: planar, parent: ground, child: rod, initial: {q: [1 - 1/tan(a), 0, a]}}}
contacts: {f: {between: [rod, ground.floor], static: enough}, e: {between: [rod, ground.table]}}
""")
    assert set(closed(found)) == {"f.end1", "e.right.end1"}
    pushed = 20 * 1.5 * math.cos(0.7) * math.sin(0.7)  # the moment of the weight about the foot, over 1 m / sin(a)
    assert numbers(found)["e.right.end1.normal"] == pytest.approx(pushed, rel=1e-9)


def test_parameters_may_name_those_declared_after_them() -> None:
    text = """
parameters: {alpha: asin(s), s: 0.6, mu: s/2}
gravity: [10*sin(alpha), -10*cos(alpha), 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, w: {mass: 2}}
joints: {j: {type: point, parent: ground, child: w, q: [x, y]}}
contacts: {c: {between: [w, ground.floor], static: mu}}
"""
    system = mbs.loads(f"multibody_sym: 1\nname: m\n{text}")
    found = numbers(state_at(mechanism(system)))
    assert found["u_x"] == pytest.approx(10 * 0.6 - 0.3 * 10 * 0.8)
    assert found["c.normal"] == pytest.approx(2 * 10 * 0.8)


def centred(surface: str) -> StartState:
    return begun(f"""
bodies: {{ground: {{surfaces: {{drum: {surface}}}}}, w: {{mass: 2}}}}
joints: {{j: {{type: point, parent: ground, child: w, q: [x, y]}}}}
contacts: {{c: {{between: [w, ground.drum], static: 0.3}}}}
""")


def test_what_starts_at_the_centre_of_a_drum_is_open_and_of_a_disc_inside() -> None:
    found = centred("{disc: 1, inside: true}")
    assert found.words == {"c": "open"}
    assert numbers(found)["u_y"] == pytest.approx(-10)
    with pytest.raises(mbs.ModelError, match=r"contacts\.c: w starts 1 m inside ground\.drum"):
        centred("{disc: 1}")


@pytest.mark.parametrize("start", ["u: [1, 0, 0]", "u: [0, 0, 10]"])
def test_what_never_slips_does_not_slip_at_the_start(start: str) -> None:
    wheel = f"""\
bodies:
  {FLOOR}
  wheel: {{shape: {{disc: 0.1, mass: 1}}}}
joints: {{J: {{type: planar, parent: ground, child: wheel, initial: {{q: [0, 0.1, 0], {start}}}}}}}
contacts: {{c: {{between: [wheel, ground.floor], static: enough}}}}
"""
    with pytest.raises(mbs.ModelError, match="c slips at 1 m/s at the start, but `static: enough` never lets it slip"):
        begun(wheel)
    assert closed(begun(wheel.replace(start, "u: [1, 0, -10]"))) == {"c": "stick"}
    falling = begun(wheel.replace(start, "u: [1, -1, 0]"))  # it strikes, which ends the slip
    assert falling.closing == {"c": 1.0}
