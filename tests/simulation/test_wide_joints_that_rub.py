"""Friction in joints of several freedoms: plates on planes and pins of universal joints, against other models."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from multibody_sym import ModelError, Solution, loads, simulate, solve
from multibody_sym.writing.worked import worked_text

G, MU = 9.81, 0.3
PUCK = f"""\
multibody_sym: 1
name: puck
gravity: [0, 0, -{G}]
bodies: {{b: {{mass: 2, com: [0, 0, 0.1], inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}}}}}
joints: {{J: {{type: planar, parent: ground, child: b, initial: {{u: [3, 4, 0]}}}}}}
forces:
  rub: {{type: friction, joint: J, static: 0.5, kinetic: {MU}}}
"""
PARTICLE = f"""\
multibody_sym: 1
name: particle
gravity: [0, 0, -{G}]
bodies:
  b: {{mass: 2}}
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: z}}}}}}
joints: {{J: {{type: point, axes: xyz, parent: ground, child: b, initial: {{u: [3, 4, 0]}}}}}}
contacts: {{c: {{between: [b, ground.floor], static: 0.5, kinetic: {MU}}}}}
"""
PENDULUM = f"""\
multibody_sym: 1
name: pendulum
gravity: [0, 0, -{G}]
bodies: {{b: {{mass: 2, com: [0, 0, -0.5], inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}}}}}
joints: {{J: {{type: universal, parent: ground, child: b, initial: {{q: [0.7, 0], u: [1, 0]}}}}}}
forces: {{rub: {{type: friction, joint: J, static: {MU}, radius: 0.02}}}}
"""
HINGE = PENDULUM.replace("universal", "revolute, axis: x").replace("[0.7, 0]", "0.7").replace("[1, 0]", "1")


def value(found: Solution, element: str, component: str) -> float:
    number = found.reactions[element][component].value
    assert number is not None
    return number


def test_a_plate_rubs_against_its_velocity_with_its_normal_force() -> None:
    found = solve(loads(PUCK))
    assert [a.value for a in found.accelerations.values()] == pytest.approx([-MU * G * 0.6, -MU * G * 0.8, 0])
    assert value(found, "rub", "normal") == pytest.approx(2 * G, rel=1e-14)
    assert value(found, "rub", "friction_1") == pytest.approx(-MU * 2 * G * 0.6, rel=1e-14)
    couple = 0.1 * MU * 2 * G  # of friction about the joint's point, 0.1 m below the centre of mass
    assert f"{couple:.6g} N*m there, which moves that force {couple / (2 * G):.6g} m aside" in found.notes[0]


def test_a_plate_stops_where_a_particle_on_a_plane_does_and_stays_to_the_last_bit() -> None:
    run, other = simulate(loads(PUCK), t_end=3), simulate(loads(PARTICLE), t_end=3)
    stop = 5 / (MU * G)  # to a billionth of the largest speed, below which slip in space has no direction
    assert [change["t"] for change in run.changes] == pytest.approx([stop], rel=1e-8)
    assert run.q[-1][:2] == pytest.approx(other.q[-1][:2], rel=1e-9)
    assert math.hypot(*run.q[-1][:2]) == pytest.approx(25 / (2 * MU * G), rel=1e-9)
    still = run.t > stop
    assert not run.u[still].any()
    assert (run.q[still] == run.q[still][0]).all()


def test_the_steps_have_the_friction_of_a_plate_in_the_equations_of_its_body() -> None:
    worked = solve(loads(PUCK), steps=True).steps
    assert worked is not None
    lines = worked_text(worked)
    assert re.search(r"along x: 2\*J_x'' = -3\*F/5\n", lines)
    assert re.search(r"along y: 2\*J_y'' = -4\*F/5\n", lines)


@pytest.mark.parametrize(("push", "word"), [(0.5 * 2 * G * 0.999, "stick"), (0.5 * 2 * G * 1.001, "slide")])
def test_a_plate_sticks_within_the_circle(push: float, word: str) -> None:
    force = f"  push: {{type: force, on: b, value: [{0.28 * push}, {-0.96 * push}, 0]}}\n"
    found = solve(loads(PUCK.replace("[3, 4, 0]", "[0, 0, 0]") + force))
    assert found.states == {"rub": word}


def test_pins_of_a_cross_that_turns_about_one_of_them_rub_as_a_hinge_does() -> None:
    cross, hinge = solve(loads(PENDULUM)), solve(loads(HINGE))
    assert cross.states["rub.pin2"] == "stick"
    first = next(iter(cross.accelerations.values())).value
    assert first == pytest.approx(next(iter(hinge.accelerations.values())).value, rel=1e-13)
    assert value(cross, "rub", "friction") == pytest.approx(value(hinge, "rub", "friction"), rel=1e-13)
    run, other = simulate(loads(PENDULUM), t_end=2), simulate(loads(HINGE), t_end=2)
    assert run.q[:, 0] == pytest.approx(other.q[:, 0], abs=1e-8)
    assert not run.q[:, 1].any()


def test_each_pin_rubs_with_the_force_across_it() -> None:
    """From the joint's own reaction in the frame on the parent: pin 1 lies along x, pin 2 along y turned about x."""
    found = solve(loads(PENDULUM.replace("[0.7, 0]", "[0.4, 0.3]").replace("[1, 0]", "[1, -2]")))
    force = np.array([value(found, "J", c) for c in ("fx", "fy", "fz")])
    pins = np.array([[1, 0, 0], [0, math.cos(0.4), math.sin(0.4)]])
    moments = [MU * 0.02 * float(np.linalg.norm(force - (force @ pin) * pin)) for pin in pins]
    assert value(found, "rub", "friction") == pytest.approx(-moments[0], rel=1e-12)
    assert value(found, "rub", "pin2") == pytest.approx(moments[1], rel=1e-12)
    moment = np.array([value(found, "J", c) for c in ("mx", "my", "mz")])
    assert pins @ moment == pytest.approx([-moments[0], moments[1]], rel=1e-12)


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        (PUCK, f"[0, 0, -{G}]", f"[0, -{G}, 0]", "nothing presses along the normal of 'J'"),
        (PUCK, "static: 0.5", "static: 0.5, length: 1", "pads are for sliders and hinges"),
        (PENDULUM, ", radius: 0.02", "", "rubs on its two pins: give their radius"),
        (
            PUCK,
            "type: planar",
            "type: custom, free: [{translate: x}, {translate: [1, 1, 0]}, {rotate: z}]",
            "is another",
        ),
        (PUCK, "type: planar", "type: spherical, angles: xyz", "is another"),
    ],
)
def test_what_cannot_rub_is_told(text: str, old: str, new: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        solve(loads(text.replace(old, new).replace("com: [0, 0, 0.1], ", "")))
