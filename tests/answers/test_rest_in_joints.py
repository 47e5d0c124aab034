"""Ranges of rest with friction in joints: what jams, locks itself or holds a lever, to limits known by hand."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import brentq

import multibody_sym as mbs
from multibody_sym.text.printer import text

HEAD = "multibody_sym: 1\nname: joint\n"

BRACKET = (
    HEAD
    + """\
gravity: [0, -g, 0]
parameters: {g: {value: 10, positive: true}, mu: 0.3, d: 0.5, l: 0.1, m: {value: 3 kg, positive: true}}
bodies: {bracket: {mass: m, com: [d, 0, 0], inertia: {Izz: 0.1}}}
joints: {column: {type: prismatic, parent: ground, child: bracket, axis: y}}
forces: {rub: {type: friction, joint: column, static: mu, length: l}}
"""
)

DRAWER = (
    HEAD
    + """\
parameters: {F: 5 N, e: 0.3, mu: 0.4, l: 0.4}
bodies: {drawer: {mass: 2 kg, inertia: {Izz: 0.1}, points: {handle: [l/2, e, 0]}}}
joints: {guide: {type: prismatic, parent: ground, child: drawer, axis: x}}
forces:
  rub: {type: friction, joint: guide, static: mu, length: l}
  pull: {type: force, on: drawer, at: handle, value: [F, 0, 0]}
"""
)

LEVER = (
    HEAD
    + """\
gravity: [0, -g, 0]
parameters:
  {g: {value: 10, positive: true}, r: 0.02, mu: 0.5, a: 0.3, b: 0.4, m: {value: 1 kg, positive: true}, k: 0.75, H: 3 N}
bodies: {lever: {mass: m, com: [-a, 0, 0], inertia: {Izz: 0.1}, points: {end: [b, 0, 0]}}}
joints: {hinge: {type: revolute, parent: ground, child: lever, axis: z}}
forces:
  rub: {type: friction, joint: hinge, static: mu, radius: r}
  load: {type: force, on: lever, at: end, value: [H, -k*m*g, 0]}
"""
)

SCREW = (
    HEAD
    + """\
gravity: [0, 0, -g]
parameters:
  {g: {value: 10, positive: true}, r: 0.02, mu: 0.15, lead: 0.002, m: {value: 100 kg, positive: true}, T: 0 N*m}
bodies: {jack: {mass: m, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}}
joints: {thread: {type: screw, parent: ground, child: jack, axis: z, pitch: lead}}
forces: {rub: {type: friction, joint: thread, static: mu, radius: r}, turn: {type: torque, joint: thread, value: T}}
"""
)

GUIDE = (
    HEAD
    + """\
gravity: [0, -g, 0]
parameters: {g: {value: 10, positive: true}, a: 10 deg, mu: 0.3, m: {value: 3 kg, positive: true}}
bodies: {ground: {frames: {f: {rotate: [{axis: z, angle: a}]}}}, slider: {mass: m}}
joints: {guide: {type: prismatic, parent: ground.f, child: slider, axis: x}}
forces: {rub: {type: friction, joint: guide, static: mu}}
"""
)


def found(file: str, vary: str, **parameters: float) -> mbs.RangeOfRest:
    return mbs.range_of_rest(mbs.loads(file), vary, parameters=parameters)


def test_a_bracket_holds_where_its_load_hangs_far_enough_out():
    """Pads at a distance l: d >= l / (2 mu), on either side of the column, whatever the load."""
    answer = found(BRACKET, "d")
    limit = 0.1 / 0.6
    assert answer.rest == [(None, pytest.approx(-limit, rel=1e-13)), (pytest.approx(limit, rel=1e-13), None)]
    assert [text(x.expression) for x in (answer.ends[0][1], answer.ends[1][0])] == ["-l/(2*mu)", "l/(2*mu)"]
    assert answer.ends[1][0].gives_way == ("slips at rub",)
    assert found(BRACKET, "m").rest == [(0.0, None)]
    assert found(BRACKET, "m", d=0.16).rest == []
    assert found(BRACKET, "mu").rest == [(pytest.approx(0.1, rel=1e-13), None)]


def test_a_drawer_jams_however_hard_it_is_pulled():
    answer = found(DRAWER, "e")
    assert answer.rest == [(None, pytest.approx(-0.5, rel=1e-13)), (pytest.approx(0.5, rel=1e-13), None)]
    assert text(answer.ends[1][0].expression) == "l/(2*mu)"
    assert found(DRAWER, "F", e=0.6).rest == [(None, None)]
    assert found(DRAWER, "F", e=0.4).rest == [(0.0, 0.0)]


def unbalanced(k: float, H: float, sense: float) -> float:
    """Return the moment about the journal less what its own reaction lets friction hold: mu r |F|."""
    return 10 * (0.3 - 0.4 * k) - sense * 0.5 * 0.02 * math.hypot(H, 10 * (1 + k))


def test_a_journal_rubs_with_the_length_of_its_reaction():
    answer = found(LEVER, "k")
    wanted = [
        brentq(unbalanced, *ends, args=(3, sense), xtol=1e-15) for ends, sense in (((0.5, 0.75), 1), ((0.75, 0.9), -1))
    ]
    assert answer.rest == [pytest.approx(wanted, rel=1e-12)]
    assert all(end.expression is not None for end in answer.ends[0])
    side = math.sqrt((10 * (0.3 - 0.28) / 0.01) ** 2 - 17**2)
    two = found(LEVER, "H", k=0.7)
    assert two.rest == [(None, pytest.approx(-side, rel=1e-12)), (pytest.approx(side, rel=1e-12), None)]
    least = found(LEVER, "mu", k=0.7)
    assert least.rest == [(pytest.approx(0.2 / 0.02 / math.hypot(3, 17), rel=1e-12), None)]
    assert text(least.ends[0][0].exact) == "5*sqrt(298)/149"


def test_a_screw_locks_itself():
    """mu >= tan(lead angle); the moments that lower and lift a load are Q r tan(a -+ rho)."""
    lead_angle, rho = math.atan(0.002 / (2 * math.pi * 0.02)), math.atan(0.15)
    assert found(SCREW, "mu").rest == [(pytest.approx(math.tan(lead_angle), rel=1e-12), None)]
    moments = [1000 * 0.02 * math.tan(lead_angle + sense * rho) for sense in (-1, 1)]
    assert found(SCREW, "T").rest == [pytest.approx(moments, rel=1e-12)]


def test_a_guide_presses_on_either_side():
    angles = found(GUIDE, "a").rest
    limit = math.atan(0.3)
    assert [x for pair in angles for x in pair] == pytest.approx(
        [-limit, limit, math.pi - limit, math.pi + limit], rel=1e-13
    )
    assert text(found(GUIDE, "mu").ends[0][0].expression) == "tan(a)"


CAPSTAN = (
    HEAD
    + """\
gravity: [0, -g, 0]
parameters: {g: 10, mu: 0.3, m1: {value: 2 kg, positive: true}, m2: {value: 4 kg, positive: true}, R: 0.2}
bodies: {ground: {points: {pa: [-R, -1, 0], pb: [R, -1, 0]}}, a: {mass: m1}, b: {mass: m2}}
joints:
  A: {type: prismatic, parent: ground.pa, child: a, axis: y, q: ya}
  B: {type: prismatic, parent: ground.pb, child: b, axis: y, q: yb}
pulleys: {P: {at: ground, radius: R, rough: mu}}
constraints: {rope: {type: rope, path: [a, P, b]}}
"""
)

BAND = (
    HEAD
    + """\
parameters: {mu: 0.3, F: 100, R: 0.2, T: 0}
bodies:
  ground: {points: {hub: [0, 0, 0], pin: [0.2, -1, 0], fulcrum: [-0.6, -1, 0]}}
  drum: {shape: {disc: R, mass: 50}}
  lever: {mass: 0.5, inertia: {Izz: 0.1}, points: {band: [0.4, 0, 0], end: [1.2, 0, 0]}}
joints:
  axle: {type: revolute, parent: ground.hub, child: drum}
  lever: {type: revolute, parent: ground.fulcrum, child: lever}
pulleys: {drum: {body: drum, radius: R, rough: mu}}
constraints: {band: {type: rope, path: [lever.band, drum, ground.pin]}}
forces:
  hand: {type: force, on: lever, at: end, value: [0, -F, 0]}
  turn: {type: torque, joint: axle, value: T}
"""
)


def test_a_rope_over_a_rough_drum_holds_by_euler_and_eytelwein():
    least = found(CAPSTAN, "mu")
    assert least.rest == [(pytest.approx(math.log(2) / math.pi, rel=1e-13), None)]
    assert [text(x) for x in (least.ends[0][0].expression, least.ends[0][0].exact)] == ["log(m2/m1)/pi", "log(2)/pi"]
    assert least.ends[0][0].gives_way == ("slips at P",)
    masses = found(CAPSTAN, "m1")
    assert masses.rest == [pytest.approx([4 * math.exp(sense * 0.3 * math.pi) for sense in (-1, 1)], rel=1e-13)]


def test_a_band_brakes_more_one_way_than_the_other():
    """The lever pulls with 300 N on one end: the other has between exp(-mu pi) and exp(mu pi) times that."""
    answer = found(BAND, "T")
    wanted = sorted(0.2 * 300 * (math.exp(sense * 0.3 * math.pi) - 1) for sense in (-1, 1))
    assert answer.rest == [pytest.approx(wanted, rel=1e-12)]
    assert [end.gives_way for end in answer.ends[0]] == [("slips at drum",), ("slips at drum",)]
    assert found(BAND, "F", T=50).rest == [(pytest.approx(50 / 0.6 / (math.exp(0.3 * math.pi) - 1), rel=1e-12), None)]


STOPS = (
    HEAD
    + """\
gravity: [0, -g, 0]
parameters: {g: 10, F: 5 N, k: 3, m: {value: 2 kg, positive: true}}
bodies: {ground: {points: {hook: [0, 3, 0]}}, flap: {mass: m, com: [1, 0, 0], inertia: {Izz: 1}}, bob: {mass: m}}
joints:
  hinge: {type: revolute, parent: ground, child: flap, axis: z, limits: {lower: 0}}
  line: {type: prismatic, parent: ground, child: bob, axis: y}
constraints: {string: {type: rope, path: [bob, ground.hook], slack: true}}
forces:
  lift: {type: force, on: flap, at: com, value: [0, F, 0]}
  raise: {type: force, on: bob, value: [0, k*F, 0]}
"""
)


def test_stops_and_slack_ropes_only_push_and_only_pull():
    """The stop carries the flap up to F = m g, the string the bob up to k F = m g: what gives way first is named."""
    high = found(STOPS, "F").ends[0][1]
    assert (high.value, high.gives_way) == (pytest.approx(20 / 3, rel=1e-13), ("string slackens",))
    high = found(STOPS, "F", k=0.5).ends[0][1]
    assert (high.value, high.gives_way) == (pytest.approx(20, rel=1e-13), ("hinge leaves its stop",))
    assert text(high.expression) == "g*m"


WEDGE = (
    HEAD
    + """\
gravity: [0, -g, 0]
parameters: {g: 10, mu: 0.2, a: 0.3, m: {value: 50 kg, positive: true}}
bodies:
  wedge: {mass: 1e-9, inertia: {Izz: 1}, surfaces: {face: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  load: {mass: m}
joints:
  floor: {type: prismatic, parent: ground, child: wedge, axis: x}
  shaft: {type: prismatic, parent: ground, child: load, axis: y}
forces: {rub: {type: friction, joint: floor, static: mu}}
contacts: {c: {between: [load, wedge.face], static: mu}}
"""
)


def test_a_wedge_locks_itself_below_twice_the_friction_angle():
    """The load drives the wedge out for a > 2 rho; the wedge itself weighs next to nothing."""
    limit = 2 * math.atan(0.2)
    angles = found(WEDGE, "a").rest
    assert any(
        high == pytest.approx(limit, rel=1e-9) and low == pytest.approx(-limit, rel=1e-9) for low, high in angles
    )
    least = found(WEDGE, "mu")
    assert least.rest == [(pytest.approx(math.tan(0.15), rel=1e-9), None)]
    assert set(least.ends[0][0].gives_way) == {"slips at rub", "slips at c"}
