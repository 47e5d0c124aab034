"""Units of answers and multipliers: by hand, and by telling the same systems in other units of mass, length and time.

Values that are told in kg^a m^b s^c must be those of the same system in other units times that power of their ratios,
whatever the program thinks of dimensions.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.state import state_of
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.fields import Names
from multibody_sym.text.units import Dimension, parse_unit

PENDULUM = """
parameters: {m: 1.3 kg, l: 0.7 m, I: 0.2 kg*m^2, k: 3 N*m, c: 0.4 N*m*s, a0: 20 deg, w0: 2 rad/s, Q: 3*m*l^2}
bodies: {bob: {mass: m, com: [0, -l, 0], inertia: {Izz: I}}}
joints: {hinge: {type: revolute, parent: ground, child: bob, q: a, initial: {q: a0, u: w0}}}
forces: {spring: {type: spring_damper, joint: hinge, stiffness: k, damping: c}}
ask:
  energy: total_energy()
  by_hand: m*l^2*u_a^2/2 + I*u_a^2/2 - m*g*l*cos(a) + k*a^2/2
  pull: sqrt(reaction(hinge, fx)^2 + reaction(hinge, fy)^2)
  moment: k*a + c*u_a
  tip: position(bob, x)
  turn: angular_acceleration(bob, z)
  spin: angular_momentum(z)
  period: 2*pi*sqrt(l/g)
  Q: Q
  share: a/a0
  part: a*k/(m*g*l)
  faster: u_a - w0
  doubled: 2*a0
  bent: {find: a0, so: doubled == 1}
"""
CART = """
parameters: {M: 2 kg, m: 0.5 kg, l: 0.6 m, k: 30 N/m, c: 2 N*s/m, F0: 4 N, x0: 0.2 m, v0: 0.3 m/s}
bodies: {cart: {mass: M}, bob: {mass: m, com: [0, -l, 0]}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {q: x0, u: v0}}
  hinge: {type: revolute, parent: cart, child: bob, q: a, initial: {q: 0.3}}
forces:
  push: {type: force, on: cart, value: [F, 0, 0]}
  spring: {type: spring_damper, joint: rail, stiffness: k, damping: c}
inputs: {F: F0*cos(a)}
ask: {power: F*u_x, force: F - k*x - c*u_x, speed: u_x + l*u_a*cos(a), impulse: momentum(x), middle: (x + l*sin(a))/2}
"""
ATWOOD = """
parameters: {m1: 1 kg, m2: 1.5 kg, h: 2 m, R: 0.1 m}
bodies: {ground: {points: {top: [0, h, 0]}}, a: {mass: m1}, b: {mass: m2}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y, q: y1}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: y2}
pulleys: {P: {at: ground.top, radius: R}}
constraints: {string: {type: rope, path: [a, P, b]}}
ask: {tension: tension(string), both: 2*multiplier(string), path: {of: a, after: T}, when: {y1: h/4}}
"""
ROD = """
parameters: {m: 1.2 kg, l: 0.5 m, K: 40 N/m}
bodies: {ground: {points: {o: [0, l, 0]}}, bob: {mass: m}}
joints: {free: {type: planar, parent: ground, child: bob, q: [x, y, a], initial: {q: [l*sin(0.4), l - l*cos(0.4), 0]}}}
forces:
  spring: {type: spring_damper, joint: free, freedom: x, stiffness: K}
  hold: {type: torque, on: bob, value: [0, 0, -m*g*l*a]}
constraints: {circle: {type: expression, zero: x^2 + (y - l)^2 - l^2}, level: {type: expression, zero: a}}
"""
ROLLING = """
parameters: {m: 1.1 kg, r: 0.3 m, b: 0.4}
bodies:
  ground: {surfaces: {slope: {plane: [0, 0, 0], normal: [-sin(b), cos(b), 0]}}}
  wheel: {mass: m, inertia: {Izz: m*r^2/2}, surfaces: {rim: {disc: r, axis: z}}}
joints: {free: {type: planar, parent: ground, child: wheel, q: [x, y, a], initial: {q: [-r*sin(b), r*cos(b), 0]}}}
constraints: {roll: {type: rolling, body: wheel.rim, on: ground.slope}}
ask: {normal: multiplier(roll.n), grip: multiplier(roll.t1), work: multiplier(roll.t1)*x}
"""
GEARS = """
parameters: {I: 0.3 kg*m^2, r1: 0.1 m, r2: 0.2 m, M0: 2 N*m, m: 1 kg}
bodies:
  ground: {points: {o2: [r1 + r2, 0, 0]}}
  a: {mass: m, inertia: {Izz: I}}
  b: {mass: m, inertia: {Izz: 2*I}}
joints:
  A: {type: revolute, parent: ground, child: a, q: p}
  B: {type: revolute, parent: ground.o2, child: b, q: q}
forces: {motor: {type: torque, joint: A, value: M0}}
constraints: {mesh: {type: gear, joints: [A, B], ratio: -r2/r1, radii: [r1, r2]}}
ask: {tooth: multiplier(mesh)/r1, power: M0*u_p}
"""
DRUM = """
parameters: {I: 0.3 kg*m^2, r: 0.15 m, m: 2 kg}
bodies: {drum: {mass: m, inertia: {Izz: I}}, load: {mass: m}}
joints:
  A: {type: revolute, parent: ground, child: drum, q: a}
  B: {type: prismatic, parent: ground, child: load, axis: y, q: y}
constraints: {rope: {type: expression, zero: y - r*a, acts: in_joints}}
ask: {pull: multiplier(rope), side: "reaction(B, fx)", twist: "reaction(A, mz)"}
"""
SKATE = """
parameters: {m: 2 kg, I: 0.1 kg*m^2, F: 3 N, b: 0.3, v0: 1 m/s, s: 2 m}
bodies: {skate: {mass: m, inertia: {Izz: I}}}
joints:
  free:
    {type: planar, parent: ground, child: skate, q: [x, y, a], initial: {q: [0, 0, b], u: [v0*cos(b), v0*sin(b), v0/s]}}
forces: {push: {type: force, on: skate, value: [F, 0, 0]}}
constraints:
  blade: {type: velocity, zero: u_x*sin(a) - u_y*cos(a), acts: in_joints}
  turn: {type: velocity, zero: s*u_a - v0, acts: in_joints}
ask: {side: multiplier(blade), turning: multiplier(turn)*s}
"""
LOOP = """
parameters: {m: 1 kg, a: 0.3 m, b: 0.8 m, c: 0.6 m, d: 0.9 m, M0: 1.5 N*m, w: 3 rad/s}
bodies:
  ground: {points: {o: [d, 0, 0]}}
  crank: {mass: m, com: [a/2, 0, 0], inertia: {Izz: m*a^2/12}, points: {end: [a, 0, 0]}}
  rod: {mass: m, com: [b/2, 0, 0], inertia: {Izz: m*b^2/12}, points: {end: [b, 0, 0]}}
  rocker: {mass: m, com: [c/2, 0, 0], inertia: {Izz: m*c^2/12}, points: {end: [c, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, q: p, initial: {q: 60 deg, u: w, known: true}}
  B: {type: revolute, parent: crank.end, child: rod, q: q, initial: {q: -40 deg}}
  C: {type: revolute, parent: ground.o, child: rocker, q: s, initial: {q: 80 deg}}
  D: {type: revolute, parent: rod.end, child: rocker.end, cut: true}
forces: {motor: {type: torque, joint: A, value: M0}}
ask: {push: "reaction(D, fx)", reach: "distance(rod.end, ground)"}
"""
GUIDES = """
parameters: {m: 1 kg, h: 0.2 m, w: 4 rad/s, p: 0.05 m, I: 0.02 kg*m^2}
bodies:
  ground: {points: {o: [0, 0, 0]}}
  block: {mass: m, points: {pin: [h, 0, 0]}}
  nut: {mass: m, inertia: {Izz: I, Ixx: I, Iyy: I}}
  disc: {mass: m, inertia: {Izz: I, Ixx: I, Iyy: I}}
joints:
  free: {type: planar, parent: ground, child: block, q: [x, y, a], initial: {q: [-h, 0, 0]}}
  thread: {type: screw, parent: ground, child: nut, axis: y, pitch: p, q: n}
  spindle: {type: revolute, parent: ground, child: disc, q: d}
constraints:
  slot: {type: point_in_plane, point: block.pin, plane: {through: ground.o, normal: y}}
  drive: {type: motion, joint: spindle, value: w*t + (w*t)^2}
  tied: {type: coupler, joints: {spindle: 1, thread: -2}, acts: in_joints}
ask: {support: multiplier(slot), driving: multiplier(drive), tying: multiplier(tied), rate: w}
"""
MODELS = {
    "pendulum": PENDULUM, "cart": CART, "atwood": ATWOOD, "rod": ROD, "rolling": ROLLING, "gears": GEARS, "drum": DRUM,
    "skate": SKATE, "loop": LOOP, "guides": GUIDES,
}

BY_HAND = {
    "pendulum": {
        "energy": "J", "by_hand": "N*m", "pull": "N", "moment": "N*m", "tip": "m", "turn": "rad/s^2", "period": "s",
        "spin": "kg*m^2/s", "Q": "kg*m^2", "share": "", "part": "", "faster": "rad/s", "hinge": "N",
        "doubled": "rad", "bent": "rad",
    },
    "cart": {"power": "W", "force": "N", "speed": "m/s", "impulse": "kg*m/s", "middle": "m"},
    "atwood": {"tension": "N", "both": "N", "path": "m", "when": "s", "string": "N"},
    "rod": {"circle": "N/m", "level": "N*m"},
    "rolling": {"normal": "N", "grip": "N", "work": "N*m", "roll.n": "N", "roll.t1": "N"},
    "gears": {"tooth": "N", "power": "W", "mesh": "N*m"},
    "drum": {"pull": "N", "side": "N", "twist": "N*m", "rope": "N"},
    "skate": {"side": "N", "turning": "N*m", "blade": "N", "turn": "N"},
    "loop": {"push": "N", "reach": "m"},
    "guides": {
        "support": "N", "driving": "N*m", "tying": "N*m", "rate": "rad/s", "slot": "N", "drive": "N*m", "tied": "N*m",
    },
}

SCALES = (1.7, 2.3, 1.3)
"""How many of the other units one kilogram, metre and second is."""


def loaded(name: str) -> mbs.System:
    text = MODELS[name].replace("parameters: {", "parameters: {g: 9.81 m/s^2, T: 0.8 s, ")
    return mbs.loads(f"multibody_sym: 1\nname: {name}\ngravity: [0, -g, 0]\n{text}")


def scale(dimension: Dimension) -> float:
    return math.prod(size ** float(exponent) for size, exponent in zip(SCALES, dimension, strict=True))


def in_other_units(system: mbs.System) -> mbs.System:
    """Return the system with the numbers that its parameters have in the other units."""
    changed = {
        name: p if p.dimension is None else replace(p, value=p.value * scale(p.dimension))
        for name, p in system.parameters.items()
    }
    return replace(system, parameters=Names(changed))


def as_scaled(value: float | None, unit: str) -> float:
    assert value is not None
    return value * (scale(parse_unit(unit)[1]) if unit else 1.0)


@pytest.mark.parametrize("name", MODELS)
def test_answers_and_reactions_have_the_units_that_were_found_by_hand(name: str) -> None:
    found = mbs.solve(loaded(name))
    told = {key: value.unit for key, value in found.answers.items()}
    told |= {key: next(iter(values.values())).unit for key, values in found.reactions.items()}
    assert {key: told[key] for key in BY_HAND[name]} == BY_HAND[name]


@pytest.mark.parametrize("name", MODELS)
def test_answers_and_reactions_are_the_same_in_other_units(name: str) -> None:
    found, other = mbs.solve(loaded(name)), mbs.solve(in_other_units(loaded(name)))
    groups = [(found.accelerations, other.accelerations), (found.answers, other.answers)]
    groups += [(found.reactions[joint], other.reactions[joint]) for joint in found.reactions]
    for here, there in groups:
        for key, value in here.items():
            if value.unique and value.value is not None:
                expected = as_scaled(value.value, value.unit)
                assert there[key].value == pytest.approx(expected, rel=1e-7, abs=1e-9), (key, value)
                assert there[key].unit == value.unit


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
@pytest.mark.parametrize("name", MODELS)
def test_states_and_multipliers_are_the_same_in_other_units(name: str, coordinates: str) -> None:
    here, there = (_forces(system, coordinates) for system in (loaded(name), in_other_units(loaded(name))))
    assert len(here) > 2
    for key, (value, unit) in here.items():
        assert there[key] == (pytest.approx(as_scaled(value, unit), rel=1e-7, abs=1e-9), unit), key


def _forces(system: mbs.System, coordinates: str) -> dict[str, tuple[float, str]]:
    """Return coordinates, speeds, accelerations and multipliers (where they are unique) with their units."""
    resolved = mbs.mechanism(replace(system, simulation=replace(system.simulation, coordinates=coordinates)))
    begin, told = start(resolved), MechanismUnits(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(composite_body(resolved, state))
    names = [c.name for c in resolved.coordinates], [s.name for s in resolved.speeds]
    values = dict(zip([*names[0], *names[1]], [*begin.q, *begin.u], strict=True))
    result = {name: (value, told.state[name]) for name, value in values.items()}
    result |= {f"{s}'": (a, told.accelerations[s]) for s, a in zip(names[1], found.udot.tolist(), strict=True)}
    if found.report[0] == len(resolved.rows):
        rows = [row.name for row in resolved.rows]
        result |= {f"on {r}": (x, told.multipliers[r]) for r, x in zip(rows, found.multipliers.tolist(), strict=True)}
    return result


def test_absolute_coordinates_tell_joints_that_close_loops_too() -> None:
    system = loaded("loop")
    told = MechanismUnits(mbs.mechanism(replace(system, simulation=replace(system.simulation, coordinates="absolute"))))
    joints = dict.fromkeys(("p", "q", "s", "D"), "rad")
    assert told.outputs == {**joints, **{f"u_{name}": f"{unit}/s" for name, unit in joints.items()}}
    assert {told.state[name] for name in ("crank_x", "rod_y")} == {"m"}
    assert {told.state[name] for name in ("rocker_angle", "D")} == {"rad"}


def test_parameters_without_a_unit_leave_what_hangs_on_them_without_one() -> None:
    text = CART.replace("k: 30 N/m", "k: 30, g: 9.81")
    text = text.replace("ask: {", "ask: {spring: k*x, other: c*u_x, seven: 7*x, ")
    found = mbs.solve(mbs.loads(f"multibody_sym: 1\nname: cart\ngravity: [0, -g, 0]{text}")).answers
    expected = {"power": "W", "speed": "m/s", "impulse": "kg*m/s", "middle": "m", "other": "N"}
    assert {name: value.unit for name, value in found.items()} == {**expected, "force": "", "spring": "", "seven": ""}


TABLES = """
multibody_sym: 1
name: tables
parameters: {Fm: 4 N, m: 2 kg}
gravity: [0, 0, 0]
bodies: {b: {mass: m}}
inputs:
  F: {table: [[0, 1], [1, 2]], dimension: N}
  G: {table: [[0 s, 1 N], [1 s, 2 N]]}
  H: 3 N
  s: {table: [[0, 1], [1, 2]]}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x}}
forces: {f: {type: force, on: b, value: [F + Fm + G + H, 0, 0]}}
simulation: {t_end: 1 s}
ask: {F0: F, sum: F + Fm, G0: G, H0: H, late: {value: F*x, after: 0.5 s}, any: s, product: Fm*s}
"""


def test_inputs_with_a_dimension_have_its_unit() -> None:
    """Tables by rows or `dimension`, and numbers with a unit; a table without one may be in any."""
    answers = mbs.solve(mbs.loads(TABLES)).answers
    assert {name: x.unit for name, x in answers.items()} == {
        **dict.fromkeys(("F0", "sum", "G0", "H0"), "N"), "late": "N*m", "any": "", "product": "",
    }
