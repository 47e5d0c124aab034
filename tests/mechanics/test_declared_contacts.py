"""Contacts as declared: which parts of bodies touch, with which rows; what cannot touch is told with its place."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_records import PlaneSurface, RoundSurface
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node

FILE = """\
multibody_sym: 1
name: incline
gravity: [0, -g, 0]
parameters: {{g: 10, a: 0.4, mu: 0.2, h: 0.2, nu: 0.1}}
bodies:
  ground: {{surfaces: {{ramp: {{plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}}}
  block: {{mass: 2}}
  box: {{shape: {{box: [0.4, h, 1], mass: 1}}}}
  wheel: {{shape: {{disc: 0.3, mass: 1}}}}
  rod: {{shape: {{rod: 2, mass: 1}}}}
  cart: {{mass: 1, surfaces: {{top: {{plane: [0, 0.1, 0], normal: y}}}}}}
  hollow: {{mass: 1, inertia: {{Izz: 1}}, surfaces: {{in: {{disc: 1, inside: true}}, out: {{disc: 1.1}}}}}}
joints:
  J: {{type: point, parent: ground, child: block}}
  B: {{type: planar, parent: ground, child: box}}
  W: {{type: planar, parent: ground, child: wheel}}
  R: {{type: planar, parent: ground, child: rod}}
  C: {{type: prismatic, parent: ground, child: cart, axis: x}}
  H: {{type: fixed, parent: cart, child: hollow}}
constraints: {{string: {{type: distance, between: [block, box], value: 1}}}}
contacts:
  {contact}
"""
SAMPLES = (10, 0.4, 0.2, 0.2, 0.1)


def found(contact: str) -> Sequence[LawElement]:
    return mechanism(mbs.loads(FILE.format(contact=contact))).one_way


def value(node: Node | Sequence[Node]) -> list[float]:
    nodes = [node] if isinstance(node, Node) else list(node)
    names = mechanism(mbs.loads(FILE.format(contact="c: {between: [block, ground.ramp]}"))).symbols.values()
    slots = dict(zip((s for s in names if s.data[0] == "parameters"), SAMPLES, strict=True))
    return evaluate_float(nodes, slots)


def test_a_block_on_a_ramp() -> None:
    (c,) = found("c1: {between: [block, ground.ramp], static: mu, kinetic: nu, restitution: 0.5}")
    assert (c.name, c.group, c.kind, c.path, c.words) == ("c1", "c1", "contact", ("contacts", "c1"), ("closed", "open"))
    assert [row.name for row in c.rows] == ["c1.normal", "c1.friction"]
    (part,) = c.frictions
    assert (value(part.static), value(part.kinetic), value(c.restitution)) == ([0.2], [0.1], [0.5])
    assert value(part.rows[0].across) == pytest.approx([0.921060994, 0.389418342, 0.0])  # uphill


@pytest.mark.parametrize(
    ("words", "static", "kinetic", "enough"),
    [("static: mu", 0.2, 0.2, False), ("kinetic: mu", 0.2, 0.2, False), ("static: enough", 1e6, 1e6, True)],
)
def test_coefficients_that_are_not_given(words: str, static: float, kinetic: float, enough: bool) -> None:
    (c,) = found(f"c1: {{between: [block, ground.ramp], {words}}}")
    part = c.frictions[0]
    assert (value(part.static), value(part.kinetic), part.enough) == ([static], [kinetic], enough)


def test_without_coefficients_it_is_smooth() -> None:
    (c,) = found("c1: {between: [block, ground.ramp], open: true}")
    assert (c.frictions, c.open) == ((), True)


def test_the_tangent_may_be_turned_around() -> None:
    for tangent, sense in (("x", 1.0), ("-x", -1.0), ("[cos(a), sin(a), 0]", 1.0), ("-y", -1.0)):
        (c,) = found(f"c1: {{between: [block, ground.ramp], static: 0.1, tangent: {tangent}}}")
        assert value(c.frictions[0].rows[0].across)[0] == pytest.approx(sense * 0.921060994)


def test_the_normal_leads_to_the_first_of_between() -> None:
    (c,) = found("c1: {between: [ground.ramp, block], static: 0.1}")
    assert isinstance(c.normals[0].skins[0], PlaneSurface)
    assert value(c.frictions[0].rows[0].across)[0] == pytest.approx(-0.921060994)


@pytest.mark.parametrize(
    ("ends", "names", "places"),
    [
        (
            "box, ground.ramp",
            ["c1.corner1", "c1.corner2", "c1.corner3", "c1.corner4"],
            [[-0.2, -0.1, 0], [0.2, -0.1, 0], [0.2, 0.1, 0], [-0.2, 0.1, 0]],
        ),
        ("ground.ramp, rod", ["c1.end1", "c1.end2"], [[0, 0, 0], [2, 0, 0]]),
        ("wheel, cart.top", ["c1"], [[0, 0, 0]]),
        ("box.com, cart.top", ["c1"], [[0, 0, 0]]),
        ("cart, ground.ramp", ["c1"], [[0, 0, 0]]),
    ],
)
def test_what_of_a_body_touches(ends: str, names: list[str], places: list[list[float]]) -> None:
    rolls = ", rolling_resistance: 0.01" if "wheel" in ends else ""
    made = found(f"c1: {{between: [{ends}], static: mu{rolls}}}")
    assert [c.name for c in made] == names
    assert {c.group for c in made} == {"c1"}
    skins = [next(skin for skin in c.normals[0].skins if isinstance(skin, RoundSurface)) for c in made]
    assert [value(skin.place.pose.position) for skin in skins] == [pytest.approx(place) for place in places]
    parts = [part.name for c in made for part in c.frictions]
    assert parts == (["c1", "c1.rolling"] if "wheel" in ends else names)


def test_in_space_friction_has_two_rows() -> None:
    text = """\
multibody_sym: 1
name: brick
gravity: [0, 0, -10]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  brick: {shape: {box: [1, 2, 3], mass: 1}}
  p: {mass: 1}
joints: {J: {type: free, parent: ground, child: brick}, P: {type: point, axes: xyz, parent: ground, child: p}}
contacts:
  c1: {between: [brick, ground.floor], static: 0.3}
  c2: {between: [p, ground.floor], static: 0.3}
"""
    made = mechanism(mbs.loads(text)).one_way
    assert [c.name for c in made] == [*(f"c1.corner{k}" for k in range(1, 9)), "c2"]
    assert [row.name for row in made[-1].rows] == ["c2.normal", "c2.friction1", "c2.friction2"]
    assert [float(x.shadow) for x in made[0].normals[0].skins[0].place.pose.position] == [-0.5, -1, -1.5]
    assert made[-1].frictions[0].rows[0].across[0].shadow == 1.0


def test_contacts_repeat() -> None:
    text = """\
multibody_sym: 1
name: row
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
repeat:
  count: 3
  body: {mass: 1, surfaces: {right: {plane: [1, 0, 0], normal: x}}}
  joint: {type: point}
  body_name: b
contacts:
  on: {between: [b#, ground.floor], static: 0.1, repeat: 3}
  beside: {between: [b#+1, b#.right], repeat: 2}
  last: {between: [b#+2, b#.right], repeat: 1}
"""
    system = mbs.loads(text)
    made = mechanism(system).one_way
    assert [c.name for c in made] == ["on1", "on2", "on3", "beside1", "beside2", "last1"]
    ends = [tuple(skin.place.name for skin in c.normals[0].skins) for c in made[3:]]
    assert ends == [("b2", "b1.right"), ("b3", "b2.right"), ("b3", "b1.right")]
    assert mbs.loads(mbs.dumps(system)) == system


def test_numbers_of_contacts_that_repeat_stand_where_their_name_has_them() -> None:
    """So that expressions can name each, and what the legs of one body bear together."""
    text = """
multibody_sym: 1
name: table
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  table: {mass: 10, inertia: {Izz: 1}, points: {leg1: [-1, -1, 0], leg2: [1, -1, 0]}}
joints: {T: {type: planar, parent: ground, child: table, q: [x, y, p], initial: {q: [0, 1, 0]}}}
contacts: {leg#: {between: [table.leg#, ground.floor], repeat: 2}}
ask: {one: normal(leg2), both: normal(leg)}
"""
    solved = mbs.solve(mbs.loads(text))
    assert [solved.answers[name].value for name in ("one", "both")] == pytest.approx([50.0, 100.0])


def test_what_contacts_that_repeat_exert_can_be_asked_of_each_and_of_all() -> None:
    """Two bodies slide on a floor, with friction of 5 N and speeds of 1 and 2 m/s."""
    text = """
multibody_sym: 1
name: row
gravity: [0, -10 m/s^2, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, d1: {mass: 1}, d2: {mass: 1}}
joints:
  A: {type: point, parent: ground, child: d1, initial: {u: [1, 0]}}
  B: {type: point, parent: ground, child: d2, initial: {u: [2, 0]}}
contacts: {f#: {between: [d#, ground.floor], kinetic: 0.5, repeat: 2}}
parameters: {F: 1 N}
ask: {one: power(f1), other: power(f2), both: power(f)}
"""
    solved = mbs.solve(mbs.loads(text))
    powers = [solved.answers[name].value for name in ("one", "other", "both")]
    assert powers == pytest.approx([-5.0, -10.0, -15.0])
    wrong = text.replace("power(f1)", "A_x + friction(f1)")
    with pytest.raises(mbs.InputError, match=r"friction\(f1\) is in N, A_x is in m"):
        mbs.solve(mbs.loads(wrong))


def test_a_particle_needs_no_inertia() -> None:
    system = mbs.System(
        "p",
        gravity=[0, -10, 0],
        bodies={"p": mbs.Body(mass=2)},
        joints={"J": mbs.PointJoint("ground", "p", initial={"u": [3, 4]})},
    )
    assert mbs.check(system).degrees_of_freedom == 2
    run = mbs.simulate(system, t_end=1)
    assert (run["J_x"][-1], run["J_y"][-1]) == (pytest.approx(3.0), pytest.approx(-1.0))


def test_all_that_is_declared_is_written_back() -> None:
    text = FILE.format(contact="""\
c1: {between: [block, ground.ramp], static: enough, kinetic: mu, restitution: 0.5, tangent: -x, open: true}
  c2: {between: [wheel, hollow.out], static: 0.3, rolling_resistance: 1 mm}
  c3: {between: [box, cart.top]}""")
    extra = """\
  ground: {surfaces: {bowl: {revolution: h*s^2 - s^3, axis: y}, bar: {segment: [[0, 0, 0], [1, 0, 0]], normal: -y},
    edge: {plane: [0, 0, 0], normal: y, between: [[0, 0, 0], [1, 0, 0]]}, tip: {point: [0, 1, 0]},"""
    system = mbs.loads(text.replace("  ground: {surfaces: {", extra))
    assert mbs.loads(mbs.dumps(system)) == system
    assert [c.name for c in mechanism(system).one_way][:2] == ["c1", "c2"]


def test_ground_by_itself_is_its_only_surface() -> None:
    (c,) = found("c1: {between: [block, ground]}")
    assert isinstance(c.normals[0].skins[1], PlaneSurface)
    wall = "{wall: {plane: [1, 0, 0], normal: -x}, ramp:"
    text = FILE.format(contact="c1: {between: [block, ground]}").replace("{ramp:", wall)
    with pytest.raises(mbs.ModelError, match=r"between.1: ground has several surfaces; say which: ground.wall, "):
        mechanism(mbs.loads(text))


def test_a_plane_model_has_no_use_for_a_plane_across_it() -> None:
    text = """
multibody_sym: 1
name: m
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0]}}}, w: {mass: 2}}
joints: {j: {type: point, parent: ground, child: w, q: [x, y]}}
contacts: {c: {between: [w, ground.floor]}}
"""
    with pytest.raises(mbs.ModelError, match=r"between.1: ground.floor has the normal z, .*Give it .*normal: y"):
        mechanism(mbs.loads(text))
    (lying,) = mechanism(mbs.loads(text.replace("point,", "prismatic, axis: z,").replace("[x, y]", "z"))).one_way
    assert isinstance(lying.normals[0].skins[1], PlaneSurface)


def test_a_contact_may_have_the_name_of_a_body_in_absolute_coordinates_too() -> None:
    text = FILE.format(contact="block: {between: [block, ground.ramp], static: mu}")
    freed = mechanism(mbs.loads(text + "simulation: {coordinates: absolute}\n"))
    assert [x.name for x in mechanism(mbs.loads(text)).one_way] == [x.name for x in freed.one_way] == ["block"]
    assert {"block_free_x", "box_x"} <= {c.name for c in freed.coordinates}
