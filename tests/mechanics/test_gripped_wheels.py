"""Ropes that turn wheels: rows against finite differences, along runs, and the free bodies of textbook machines."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import coordinate_rates, motion_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.mechanics.state import state_of

SWINGING = """\
multibody_sym: 1
name: swinging
gravity: [0, -9.81, 0]
bodies:
  arm: {mass: 1, inertia: {Izz: 1}, points: {axle: [0.7, 0.2, 0], idler: [-0.4, 0.5, 0]}}
  wheel: {shape: {disc: 0.3, mass: 2}}
  bob: {mass: 1.5, inertia: {Izz: 1}}
  load: {mass: 1, inertia: {Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: arm, q: a, initial: {q: 0.3, u: 0.4}}
  B: {type: revolute, parent: arm.axle, child: wheel, axis: [0, 0, -1], q: w, initial: {u: 1}}
  C: {type: planar, parent: ground, child: bob, q: [x, y, turn], initial: {q: [2.5, -1.5, 0], u: [0.3, 0, 0]}}
  D: {type: planar, parent: ground, child: load, q: [X, Y, turning], initial: {q: [-1.5, -1.2, 0]}}
pulleys:
  idler: {at: arm.idler, radius: 0.1}
  wheel: {body: wheel, radius: 0.3}
constraints:
  rope: {type: rope, path: [bob, wheel, idler, load]}
"""


def rows_at(system: mbs.System, q: np.ndarray, u: np.ndarray) -> tuple:
    resolved = mechanism(system)
    begin = start(resolved)
    motion = motion_of(resolved, state_of(resolved, float, 0.0, q.tolist(), u.tolist(), begin.parameters))
    return resolved, row_motions(motion)


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_rows_of_a_wheel_on_a_moving_arm_are_the_derivatives_of_what_is_wound(coordinates: str) -> None:
    """phi, phidot = H u + phi_t and gamma by finite differences along u, at states beside the start."""
    system = mbs.loads(SWINGING + f"simulation: {{coordinates: {coordinates}}}\n")
    resolved = mechanism(system)
    begin = start(resolved)
    rng = np.random.default_rng(4)
    for _ in range(5):
        q = np.array(begin.q) + rng.uniform(-0.2, 0.2, len(begin.q))
        u = rng.uniform(-1, 1, len(begin.u))
        rate = np.array(coordinate_rates(resolved, q.tolist(), u.tolist()), dtype=float)
        here = rows_at(system, q, u)[1]
        h = 1e-5
        ahead, behind = (rows_at(system, q + s * rate, u)[1] for s in (h, -h))
        for k, row in enumerate(here):
            assert row.phidot == pytest.approx((ahead[k].phi - behind[k].phi) / (2 * h), abs=1e-8)
            assert row.phidot == pytest.approx(float(np.dot(row.jacobian, u)), abs=1e-12)
            assert row.gamma == pytest.approx(-(ahead[k].phidot - behind[k].phidot) / (2 * h), abs=1e-8)


def test_wheel_may_turn_more_than_once_and_nothing_jumps() -> None:
    system = mbs.loads(SWINGING)
    begin = start(mechanism(system))
    u = np.zeros(len(begin.u))
    place = [c.name for c in mechanism(system).coordinates].index("w")
    found = []
    for turn in np.linspace(0.0, 4 * math.pi, 9):
        q = np.array(begin.q)
        q[place] += turn
        found.append([row.phi for row in rows_at(system, q, u)[1]])
    steps = np.diff(np.array(found), axis=0)
    assert np.abs(steps) == pytest.approx(0.3 * math.pi / 2), "R pi/2 up on one side, off on the other"
    assert np.abs(steps.sum(axis=1)).max() < 1e-12


def test_energy_stays_along_a_run_in_which_the_bob_swings_and_the_wheel_turns() -> None:
    run = mbs.simulate(mbs.loads(SWINGING), t_end=0.4, rtol=1e-10)
    assert abs(run.drift["energy"]) < 1e-8
    assert abs(float(run["w"][-1] - run["w"][0])) > 0.3


ATWOOD = """\
multibody_sym: 1
name: heavy_pulley
gravity: [0, -g, 0]
parameters:
  g: {value: 9.81, positive: true}
  m1: {value: 1, positive: true}
  m2: {value: 2, positive: true}
  M: {value: 3, positive: true}
  R: {value: 0.1, positive: true}
bodies:
  ground: {points: {top: [0, 3, 0], left: [-R, 0, 0], right: [R, 0, 0]}}
  wheel: {shape: {disc: R, mass: M}}
  one: {mass: m1}
  two: {mass: m2}
joints:
  hub: {type: revolute, parent: ground.top, child: wheel, q: phi}
  L: {type: prismatic, parent: ground.left, child: one, axis: y, q: y1}
  N: {type: prismatic, parent: ground.right, child: two, axis: y, q: y2}
pulleys: {P: {body: wheel, radius: R}}
constraints: {string: {type: rope, path: [one, P, two]}}
outputs: {first: "tension(string, 1)"}
"""


def test_a_heavy_pulley_turns_with_its_rope_and_its_bearing_carries_all() -> None:
    """Free bodies: (T2 - T1) R = I alpha, m1 a = T1 - m1 g, m2 a = m2 g - T2, bearing = M g + T1 + T2."""
    found = mbs.solve(mbs.loads(ATWOOD))
    m1, m2, M, g = 1.0, 2.0, 3.0, 9.81
    a = g * (m2 - m1) / (m1 + m2 + M / 2)
    T1, T2 = m1 * (g + a), m2 * (g - a)
    assert found.accelerations["y1"].value == pytest.approx(a, rel=1e-13)
    assert found.accelerations["phi"].value == pytest.approx(-a / 0.1, rel=1e-13)
    tensions = found.reactions["string"]
    assert [tensions[k].value for k in ("tension1", "tension2")] == pytest.approx([T1, T2], rel=1e-13)
    assert found.reactions["hub"]["fy"].value == pytest.approx(M * g + T1 + T2, rel=1e-13)
    assert tensions["tension1"].as_json()["expression"] == "g*m1*(M + 4*m2)/(M + 2*m1 + 2*m2)"
    assert found.conditions == (), "both tensions are positive whatever the parameters are"


def test_the_tension_of_a_run_is_asked_by_its_number() -> None:
    run = mbs.simulate(mbs.loads(ATWOOD), t_end=0.2)
    assert run["first"][0] == pytest.approx(1.0 * (9.81 + 9.81 / 4.5), rel=1e-9)
    with pytest.raises(mbs.ModelError, match=r"on each side.*ask tension\(string, 1\) to tension\(string, 2\)"):
        mbs.solve(mbs.loads(ATWOOD.replace('"tension(string, 1)"', "tension(string)")))


YOYO = """\
multibody_sym: 1
name: yoyo
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {finger: [0, 0, 0]}}
  reel: {mass: 0.2, inertia: {Izz: 5e-5}}
joints:
  fall: {type: planar, parent: ground, child: reel, q: [x, y, phi], initial: {q: [0.01, -0.5, 0]}}
pulleys: {drum: {body: reel, radius: 0.01}}
constraints: {string: {type: rope, path: [ground.finger, drum], wind: drum, wrap: "+"}}
"""


@pytest.mark.parametrize(("wrap", "x"), [("+", 0.01), ("-", -0.01)])
def test_a_yoyo_falls_and_turns(wrap: str, x: float) -> None:
    """m a = m g - T, T r = I a / r; the string hangs straight, touching the drum on its inner side."""
    text = YOYO.replace('wrap: "+"', f'wrap: "{wrap}"').replace("[0.01, -0.5, 0]", f"[{x}, -0.5, 0]")
    found = mbs.solve(mbs.loads(text))
    a = 9.81 / (1 + 5e-5 / (0.2 * 0.01**2))
    assert found.accelerations["y"].value == pytest.approx(-a, rel=1e-12)
    assert found.accelerations["x"].value == pytest.approx(0.0, abs=1e-12)
    assert found.accelerations["phi"].value == pytest.approx(math.copysign(a / 0.01, -x), rel=1e-12)
    assert found.reactions["string"]["tension"].value == pytest.approx(0.2 * (9.81 - a), rel=1e-12)


HOIST = """\
multibody_sym: 1
name: hoist
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {axle: [0, 5, 0]}}
  drum: {mass: 40, inertia: {Izz: 1.2}}
  load: {mass: 100, inertia: {Izz: 1}}
  counter: {mass: 60, inertia: {Izz: 1}}
joints:
  hub: {type: revolute, parent: ground.axle, child: drum, q: phi}
  L: {type: planar, parent: ground, child: load, q: [x, y, turn], initial: {q: [0.4, 0, 0]}}
  C: {type: planar, parent: ground, child: counter, q: [X, Y, turning], initial: {q: [-0.25, 1, 0]}}
pulleys: {big: {body: drum, radius: 0.4}, small: {body: drum, radius: 0.25}}
forces: {motor: {type: torque, joint: hub, value: 150}}
constraints:
  rope: {type: rope, path: [load, big], wind: big, wrap: "+"}
  other: {type: rope, path: [small, counter], wind: small, wrap: "+"}
"""


def test_wheel_and_axle_carry_two_ropes_on_one_body() -> None:
    """I alpha = M - T1 R + T2 r, with m1 a1 = T1 - m1 g, a1 = alpha R, m2 a2 = m2 g - T2, a2 = alpha r."""
    found = mbs.solve(mbs.loads(HOIST))
    I, R, r, m1, m2, g = 1.2, 0.4, 0.25, 100.0, 60.0, 9.81
    alpha = (150 - m1 * g * R + m2 * g * r) / (I + m1 * R**2 + m2 * r**2)
    assert found.accelerations["phi"].value == pytest.approx(alpha, rel=1e-12)
    assert found.accelerations["y"].value == pytest.approx(alpha * R, rel=1e-12)
    assert found.accelerations["Y"].value == pytest.approx(-alpha * r, rel=1e-12)
    T1, T2 = m1 * (g + alpha * R), m2 * (g - alpha * r)
    assert found.reactions["rope"]["tension"].value == pytest.approx(T1, rel=1e-12)
    assert found.reactions["hub"]["fy"].value == pytest.approx(40 * g + T1 + T2, rel=1e-12)


def test_a_heavy_movable_pulley_hangs_in_its_rope() -> None:
    """Rope from a hook under the disc up to ground: M a = M g + m g .. with both runs vertical, T1 and T2 apart."""
    system = mbs.loads("""\
multibody_sym: 1
name: movable
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {hook: [-0.2, 4, 0], top: [0.2, 4, 0], side: [0.2, 0, 0]}}
  disc: {shape: {disc: 0.2, mass: 6}}
  weight: {mass: 4}
joints:
  D: {type: planar, parent: ground, child: disc, q: [x, y, phi], initial: {q: [0, 1, 0]}}
  W: {type: prismatic, parent: ground.side, child: weight, axis: y, q: Y, initial: {q: 1}}
pulleys: {low: {body: disc, radius: 0.2}, high: {at: ground.top}}
constraints: {rope: {type: rope, path: [ground.hook, low, high, weight]}}
outputs: {axle: "reaction(high, fy)"}
""")
    found = mbs.solve(system)
    # disc: M a = T1 + T2 - M g, I alpha = (T2 - T1) R with a = alpha R; weight: m A = T2 - m g, A = -2 a
    M, m, g = 6.0, 4.0, 9.81
    a = (2 * m * g - M * g) / (4 * m + 1.5 * M)
    T2 = m * (g - 2 * a)
    T1 = M * (a + g) - T2
    assert found.accelerations["y"].value == pytest.approx(a, rel=1e-12)
    assert found.accelerations["x"].value == pytest.approx(0.0, abs=1e-12)
    assert [x.value for x in found.reactions["rope"].values()] == pytest.approx([T1, T2], rel=1e-12)
    top = [found.reactions["high"][c].value for c in ("fx", "fy", "fz", "mx", "my", "mz")]
    assert top == pytest.approx([0, 2 * T2, 0, 0, 0, 0], rel=1e-12, abs=1e-12)
    assert mbs.simulate(system, t_end=0.1)["axle"][0] == pytest.approx(2 * T2, rel=1e-9)


CRANE = """\
multibody_sym: 1
name: crane
gravity: [0, 0, -9.81]
bodies:
  tower:
    {mass: 10, inertia: {Ixx: 1, Iyy: 1, Izz: 2}, frames: {tip: {position: [2, 0, 3], rotate: [{axis: z, angle: 0.4}]},
     foot: {position: [2, 0, 0], rotate: [{axis: z, angle: 0.4}]}}}
  wheel: {mass: 2, inertia: {Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}
  load: {mass: 3}
  cart: {mass: 3}
joints:
  A: {type: revolute, parent: ground, child: tower, axis: z, q: yaw, initial: {u: 0.5}}
  B: {type: revolute, parent: tower.tip, child: wheel, axis: y, q: w}
  C: {type: prismatic, parent: tower.foot, child: load, axis: [0.3, 0, 1], q: z, initial: {q: 1}}
  D: {type: prismatic, parent: tower.tip, child: cart, axis: x, q: x, initial: {q: -1.5}}
pulleys: {P: {body: wheel, radius: 0.3, axis: y}}
constraints: {rope: {type: rope, path: [load, P, cart]}}
"""


@pytest.mark.parametrize(
    "pulley",
    ["body: wheel, radius: 0.3, axis: y", "at: tower.tip, radius: 0.3, axis: [-sin(0.4), cos(0.4), 0]"],
)
def test_a_rope_in_a_plane_that_turns_in_space(pulley: str) -> None:
    """A tangent keeps to the plane across the wheel's axis, which a crane that swings carries along."""
    system = mbs.loads(CRANE.replace("body: wheel, radius: 0.3, axis: y", pulley))
    resolved = mechanism(system)
    begin = start(resolved)
    rng = np.random.default_rng(1)
    for _ in range(3):
        q = np.array(begin.q) + rng.uniform(-0.2, 0.2, len(begin.q))
        u = rng.uniform(-1, 1, len(begin.u))
        rate, h = np.array(coordinate_rates(resolved, q.tolist(), u.tolist()), dtype=float), 1e-5
        here = rows_at(system, q, u)[1]
        ahead, behind = (rows_at(system, q + k * rate, u)[1] for k in (h, -h))
        for k, row in enumerate(here):
            assert row.phidot == pytest.approx((ahead[k].phi - behind[k].phi) / (2 * h), abs=1e-8)
            assert row.gamma == pytest.approx(-(ahead[k].phidot - behind[k].phidot) / (2 * h), abs=1e-8)
