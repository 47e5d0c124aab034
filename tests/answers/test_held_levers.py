"""Motion beside what is held where it is: brake levers, trusses; and formulas of the moments at which states begin."""

from __future__ import annotations

import math
import random
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.constraints.redundancy import held_coordinates
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol

BRAKE = """
multibody_sym: 1
name: brake
gravity: [0, -g, 0]
parameters: {g: {value: 9.81 m/s^2, positive: true}, J: {value: 0.8 kg*m^2, positive: true},
  R: {value: 0.15 m, positive: true}, a: {value: 0.3 m, positive: true}, b: {value: 0.9 m, positive: true},
  P: {value: 200 N, positive: true}, mu: {value: 0.35, positive: true}, w0: {value: 40 rad/s, positive: true}}
bodies:
  ground: {points: {pin: [-a, R, 0]}}
  drum: {mass: 10 kg, inertia: {Izz: J}, surfaces: {rim: {disc: R, axis: z}}}
  lever: {mass: 0.001 kg, inertia: {Izz: 0.001 kg*m^2}, points: {pad: [a, 0, 0], end: [b, 0, 0]}}
joints:
  axle: {type: revolute, parent: ground, child: drum, axis: z, q: phi, initial: {u: w0}}
  pin: {type: revolute, parent: ground.pin, child: lever, axis: z, q: psi}
contacts: {c: {between: [lever.pad, drum.rim], static: mu, kinetic: mu}}
forces: {press: {type: force, on: lever, at: end, value: [0, -P, 0]}}
ask: {time: {value: t, when: c sticks}, turns: {value: "phi/(2*pi)", when: c sticks}, course: {formula: phi},
  lever: {formula: psi}, half: {value: t, when: u_phi < w0/2}, around: {when: {phi: 2*pi}}}
simulation: {t_end: 2 s}
"""


def test_a_drum_is_braked_by_a_lever_that_touches_it() -> None:
    answers = mbs.solve(mbs.loads(BRAKE)).answers
    draw = random.Random(3)
    for _ in range(5):
        given = {name: draw.uniform(0.5, 2.0) for name in ("J", "R", "a", "b", "P", "mu", "w0")}
        J, R, a, b, P, mu, w0 = given.values()
        slowing, t = mu * R * P * b / a / J, 0.37
        told = {name: value(answers[name], {**given, "t": t}) for name in answers if name != "around"}
        assert told["time"] == pytest.approx(w0 / slowing, rel=1e-14)
        assert told["turns"] == pytest.approx(w0**2 / (4 * math.pi * slowing), rel=1e-14)
        assert told["course"] == pytest.approx(w0 * t - slowing * t**2 / 2, rel=1e-13)
        assert told["half"] == pytest.approx(w0 / slowing / 2, rel=1e-14)
        assert told["lever"] == 0.0
    slowing = 0.35 * 0.15 * 200 * 3 / 0.8
    assert answers["around"].value == pytest.approx((40 - math.sqrt(1600 - 4 * math.pi * slowing)) / slowing, rel=1e-12)
    assert answers["around"].expression is not None


def value(answer: Any, given: dict[str, float]) -> float:
    assert answer.expression is not None
    return evaluate_float([answer.expression], {symbol(name): x for name, x in given.items()})[0]


LIFTED = """
multibody_sym: 1
name: lifted
gravity: [0, -g, 0]
parameters:
  {g: {value: 9.81 m/s^2, positive: true}, m: {value: 2 kg, positive: true}, k: {value: 5 N/s, positive: true}}
bodies: {b: {mass: m}}
joints: {j: {type: planar, parent: ground, child: b, q: [x, y], motion: [null, null, 0], initial: {u: [1, 0]}}}
contacts: {c: {between: [b, ground.floor]}}
forces: {lift: {type: force, on: b, value: [0, "k*t", 0]}}
ask: {up: {value: t, when: c opens}, place: {value: x, when: c opens}}
simulation: {t_end: 5 s}
"""


def test_when_a_load_leaves_the_floor() -> None:
    model = LIFTED.replace("bodies: {", "bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, ")
    answers = mbs.solve(mbs.loads(model)).answers
    given = {"g": 9.0, "m": 3.0, "k": 7.0}
    for name in ("up", "place"):
        assert answers[name].value == pytest.approx(2 * 9.81 / 5, rel=1e-9)
        assert value(answers[name], given) == pytest.approx(27 / 7, rel=1e-14)


TRUSS = """
multibody_sym: 1
name: truss
bodies:
  ground: {points: {far: [1, 0, 0]}}
  p: {mass: 1, inertia: {Izz: 1}, points: {end: [0.6, 0, 0]}}
  q: {mass: 1, inertia: {Izz: 1}, points: {end: [0.8, 0, 0]}}
  r: {mass: 1, inertia: {Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: p, axis: z, q: one, initial: {q: 0.9}}
  B: {type: revolute, parent: ground.far, child: q, axis: z, q: two, initial: {q: 2.5}}
  C: {type: revolute, parent: ground, child: r, axis: z, q: free, initial: {u: 1}}
JOINED
"""
PIN = "  D: {type: revolute, parent: p.end, child: q.end, axis: z}"
ROD = "constraints: {rod: {type: distance, between: [p.end, q.end], value: LENGTH}, OTHER}"
OTHER = "other: {type: distance, between: [p.end, ground.far], value: 0.75}"


@pytest.mark.parametrize(
    ("joined", "held"),
    [
        (PIN, {0, 1}),
        (ROD.replace("LENGTH", "0.3").replace("OTHER", OTHER), {0, 1}),
        (ROD.replace("LENGTH", "0.3 + t/9").replace("OTHER", OTHER), {0}),
        (ROD.replace("LENGTH", "0.3").replace(", OTHER", ""), set()),
    ],
)
def test_what_so_many_rows_as_coordinates_join_is_held(joined: str, held: set[int]) -> None:
    mechanism, begin = examined_state(mbs.loads(TRUSS.replace("JOINED", joined))).in_joints
    assert held_coordinates(mechanism, begin.q, begin.parameters) == held
