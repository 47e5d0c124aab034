"""Questions are written as they are read: about a motion, about states, about small motions."""

from __future__ import annotations

from small_motion_problems import PROBLEMS

import multibody_sym as mbs
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

THROWN = """
multibody_sym: 1
name: thrown
gravity: [0, -g, 0]
parameters: {g: 9.81 m/s^2, v: 20 m/s, a: 60 deg}
bodies: {ball: {mass: 1 kg}}
joints: {j: {type: point, parent: ground, child: ball, q: [x, y], initial: {u: [v*cos(a), v*sin(a)]}}}
simulation: {t_end: 6 s}
ask:
"""
SLIDING = """
multibody_sym: 1
name: thrown
gravity: [0, -g, 0]
parameters: {g: 10 m/s^2, a: 30 deg, mu: 0.9, m: 2 kg, v: 5 m/s}
bodies: {ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}, block: {mass: m}}
joints: {J: {type: point, parent: ground, child: block, initial: {u: [v*cos(a), v*sin(a)]}}}
contacts: {c1: {between: [block, ground.ramp], static: mu}}
simulation: {t_end: 3 s}
"""
SWINGING = """
multibody_sym: 1
name: swinging
parameters: {m: {value: 2 kg, positive: true}, k: {value: 8 N/m, positive: true}, x0: 0.3 m, v0: 0.5 m/s}
bodies: {a: {mass: m}}
joints: {A: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {q: x0, u: v0}}}
forces: {s: {type: spring_damper, joint: A, stiffness: k}}
simulation: {t_end: 10 s}
"""


def test_questions_about_a_motion_are_written_back() -> None:
    asked = [
        "a: {max: y, after: 1 s, until: y < 0}", "b: {value: x, when: {y: 1}}", "c: y < 0 and x > 2",
        "d: {of: ball, after: 1 s, along: x}", "e: {find: v, so: 'max(y) + min(x, y) == 2*min(x)', between: [1, 9]}",
        "f: {formula: y}", "g: {min: x, until: 2 s}",
    ]
    system = mbs.loads(THROWN + "".join(f"  {question}\n" for question in asked))
    assert mbs.loads(mbs.dumps(system)).ask == system.ask


def test_states_are_written_back() -> None:
    system = mbs.loads(SLIDING + "stop: {rests: c1 sticks}\nask: {turn: c1 sticks, speed: {of: block, at: c1 slides}}")
    again = mbs.loads(mbs.dumps(system))
    assert (again.stop, again.ask) == (system.stop, system.ask)


def test_frequencies_are_written_back() -> None:
    assert text(parse("1/period(12) + 2*frequency(1)")) == "1/period(12) + 2*frequency(1)"
    pendulum = next(problem.text for problem in PROBLEMS if problem.name == "simple_pendulum")
    system = mbs.loads(pendulum + "ask: {T: period(1)}\n")
    assert mbs.loads(mbs.dumps(system)) == system


def test_an_equation_with_a_unit_is_written_as_it_is_read() -> None:
    system = mbs.loads(SWINGING + "ask: {far: {max: x}, f: {find: v0, so: far == 50 cm}}\n")
    assert mbs.loads(mbs.dumps(system)) == system


def test_an_angle_beside_a_pure_number_has_no_unit() -> None:
    system = mbs.loads(SWINGING + "ask: {far: {max: x/x0}, f: {find: v0, so: far == 60 deg}}\n")
    assert "1" not in str(system.ask["f"].so).replace("pi/3", "")
