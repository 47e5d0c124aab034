"""What locks itself and what jams: screws, drawers, wedges and a brake, in closed form and at their limits."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs

JACK = """\
multibody_sym: 1
name: jack
gravity: [0, 0, -g]
parameters:
  m: {value: 2, positive: true}
  g: {value: 9.81, positive: true}
  r: {value: 0.03, positive: true}
  p: {value: 0.02, positive: true}
  mu: {value: MU, positive: true}
  J: {value: 0.01, positive: true}
bodies: {b: {mass: m, inertia: {Ixx: 0.1, Iyy: 0.1, Izz: J}}}
joints: {S: {type: screw, parent: ground, child: b, axis: z, pitch: p, q: phi}}
forces: {rub: {type: friction, joint: S, static: mu, radius: r}}
"""
DRAWER = """\
multibody_sym: 1
name: drawer
parameters:
  mu: {value: MU, positive: true}
  l: {value: 0.4, positive: true}
  e: {value: 0.3, positive: true}
  F: {value: 20, positive: true}
  m: {value: 2, positive: true}
bodies: {b: {mass: m, inertia: {Izz: 0.1}, points: {p: [0.1, e, 0]}}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: x, q: x}}
forces:
  push: {type: force, on: b, value: [F, 0, 0], at: p}
  rub: {type: friction, joint: J, static: mu, length: l}
"""
BRACKET = """\
multibody_sym: 1
name: bracket
parameters:
  mu: {value: 0.3, positive: true}
  l: {value: 0.2, positive: true}
  a: {value: A, positive: true}
  W: {value: 100, positive: true}
bodies: {b: {mass: 0.01, inertia: {Izz: 0.1}, points: {p: [a, 0, 0]}}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: y, q: y}}
forces:
  load: {type: force, on: b, value: [0, -W, 0], at: p}
  rub: {type: friction, joint: J, static: mu, length: l}
"""
WEDGE = """\
multibody_sym: 1
name: wedge
parameters:
  mu: {value: MU, positive: true}
  a: {value: 20 deg, positive: true}
  W: {value: 50, positive: true}
bodies:
  wedge: {mass: 1, surfaces: {face: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  load: {mass: 1}
  ground: {surfaces: {floor: {plane: [0, -1, 0], normal: y}}}
joints:
  A: {type: point, parent: ground, child: wedge, q: [x, h]}
  B: {type: prismatic, parent: ground, child: load, axis: y, q: y}
forces: {press: {type: force, on: load, value: [0, -W, 0]}}
contacts:
  top: {between: [load, wedge.face], static: mu}
  base: {between: [wedge.heel, ground.floor], static: mu}
""".replace("normal: [-sin(a), cos(a), 0]}}}", "normal: [-sin(a), cos(a), 0]}}, points: {heel: [0, -1, 0]}}")


def solved(text: str, **values: float) -> mbs.Solution:
    for name, value in values.items():
        text = text.replace(name, repr(value))
    return mbs.solve(mbs.loads(text))


def state(text: str, element: str, **values: float) -> str:
    return solved(text, **values).as_json()["states"][element]


def test_a_screw_locks_itself_above_the_tangent_of_its_lead() -> None:
    limit = 0.02 / (2 * math.pi * 0.03)
    assert state(JACK, "rub", MU=limit * (1 + 1e-9)) == "stick"
    assert state(JACK, "rub", MU=limit * (1 - 1e-9)) == "slide-"
    found = solved(JACK, MU=0.2).as_json()
    assert found["conditions"] == ["2*mu*pi*r >= p"]
    friction, normal = (found["reactions"]["rub"][c]["value"] for c in ("friction", "normal"))
    assert friction / normal == pytest.approx(limit, rel=1e-12)
    assert found["reactions"]["rub"]["friction"]["unit"] == "N"


def test_a_drawer_moves_with_what_its_pads_leave() -> None:
    found = solved(DRAWER, MU=0.5).as_json()
    assert found["accelerations"]["x"]["expression"] == "F*(l - 2*e*mu)/(l*m)"
    assert found["conditions"] == ["l > 2*e*mu"]
    jammed = solved(DRAWER, MU=0.7).as_json()
    assert (jammed["states"]["rub"], jammed["conditions"]) == ("stick", ["2*e*mu >= l"])


def test_a_bracket_holds_on_its_column_if_the_load_is_far_enough_out() -> None:
    """Two pads a height l apart: W a = N l and 2 mu N >= W, so a >= l/(2 mu), whatever the load."""
    limit = 0.2 / (2 * 0.3)
    assert state(BRACKET, "rub", A=limit * (1 + 1e-9)) == "stick"
    assert state(BRACKET, "rub", A=limit * (1 - 1e-9)) == "slide-"
    assert solved(BRACKET, A=0.5).as_json()["conditions"] == ["2*a*mu >= l"]


def test_a_wedge_stays_under_its_load_up_to_twice_the_angle_of_friction() -> None:
    """Between floor and face both forces are along one line: its angles to their normals add up to the wedge's."""
    limit = math.tan(math.radians(20) / 2)
    assert state(WEDGE, "base", MU=limit * (1 + 1e-9)) == "stick"
    assert state(WEDGE, "base", MU=limit * (1 - 1e-9)) != "stick"


SELF_ENERGISING = """\
multibody_sym: 1
name: lever_brake
parameters: {J: {value: 0.8, positive: true}, R: {value: 0.25, positive: true}, a: {value: 0.3, positive: true},
  c: {value: 0.1, positive: true}, L: {value: 0.9, positive: true}, F: {value: 50, positive: true},
  mu: {value: 0.4, positive: true}, omega: 30}
bodies:
  ground: {points: {axle: [a, -c-R, 0]}}
  lever: {mass: 1, inertia: {Izz: 0.1}, com: [L/2, 0, 0], points: {shoe: [a, -c, 0], grip: [L, 0, 0]}}
  drum: {mass: 20, inertia: {Izz: J}, surfaces: {rim: {disc: R, axis: z}}}
joints:
  pin: {type: revolute, parent: ground, child: lever, q: theta}
  axle: {type: revolute, parent: ground.axle, child: drum, q: phi, initial: {u: omega}}
forces: {hand: {type: force, on: lever, at: grip, value: [0, -F, 0]}}
contacts: {shoe: {between: [lever.shoe, drum.rim], static: mu}}
"""


def test_beyond_the_sign_of_what_forces_are_divided_by_no_shoe_opens() -> None:
    """The laws find no state there: what the condition says happens is what does."""
    found = mbs.solve(mbs.loads(SELF_ENERGISING))
    assert "a > c*mu" in found.conditions
    assert found.limits["a > c*mu"] == "shoe: no state or several, as with Painleve's rod"
    with pytest.raises(mbs.NoSolutionError, match="nothing that may act, stick or slide fulfils the laws"):
        mbs.solve(mbs.loads(SELF_ENERGISING.replace("mu: {value: 0.4", "mu: {value: 3.5")))
