"""Friction in joints of several freedoms: plates on planes and pins of universal joints, against other models."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from multibody_sym import NoSolutionError, Solution, loads, range_of_rest, simulate, solve
from multibody_sym.documents.document import worked_document, write_document

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
PENDULUM = f"""\
multibody_sym: 1
name: pendulum
gravity: [0, 0, -{G}]
bodies: {{b: {{mass: 2, com: [0, 0, -0.5], inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}}}}}
joints: {{J: {{type: universal, parent: ground, child: b, initial: {{q: [0.7, 0], u: [1, 0]}}}}}}
forces: {{rub: {{type: friction, joint: J, static: {MU}, radius: 0.02}}}}
"""
BALL = (
    PENDULUM.replace("universal", "spherical")
    .replace("q: [0.7, 0]", "q: [cos(0.35), sin(0.35), 0, 0]")
    .replace("[1, 0]", "[1, 0, 0]")
)
RING = (
    PUCK.replace("Izz: 0.1", "Izz: 0.08")
    .replace("[3, 4, 0]", "[3, 4, 60]")
    .replace("kinetic: 0.3", "kinetic: 0.3, radius: 0.2")
)
HINGE = PENDULUM.replace("universal", "revolute, axis: x").replace("[0.7, 0]", "0.7").replace("[1, 0]", "1")


def value(found: Solution, element: str, component: str) -> float:
    number = found.reactions[element][component].value
    assert number is not None
    return number


def test_the_steps_have_the_friction_of_a_plate_in_the_equations_of_its_body() -> None:
    worked = solve(loads(PUCK), steps=True).steps
    assert worked is not None
    lines = write_document(worked_document(worked), "text")
    assert re.search(r"along x: 2\*J_x'' = -3\*F/5\n", lines)
    assert re.search(r"along y: 2\*J_y'' = -4\*F/5\n", lines)


def test_pins_of_a_cross_that_turns_about_one_of_them_rub_as_a_hinge_does() -> None:
    cross, hinge = solve(loads(PENDULUM)), solve(loads(HINGE))
    assert cross.states["rub.pin2"] == "stick"
    first = next(iter(cross.accelerations.values())).value
    assert first == pytest.approx(next(iter(hinge.accelerations.values())).value, rel=1e-13)
    assert value(cross, "rub", "pin1") == pytest.approx(value(hinge, "rub", "friction"), rel=1e-13)
    run, other = simulate(loads(PENDULUM), t_end=2), simulate(loads(HINGE), t_end=2)
    assert run.q[:, 0] == pytest.approx(other.q[:, 0], abs=1e-8)
    assert not run.q[:, 1].any()


def test_each_pin_rubs_with_the_force_across_it() -> None:
    """From the joint's own reaction in the frame on the parent: pin 1 lies along x, pin 2 along y turned about x."""
    found = solve(loads(PENDULUM.replace("[0.7, 0]", "[0.4, 0.3]").replace("[1, 0]", "[1, -2]")))
    force = np.array([value(found, "J", c) for c in ("fx", "fy", "fz")])
    pins = np.array([[1, 0, 0], [0, math.cos(0.4), math.sin(0.4)]])
    moments = [MU * 0.02 * float(np.linalg.norm(force - (force @ pin) * pin)) for pin in pins]
    assert value(found, "rub", "pin1") == pytest.approx(-moments[0], rel=1e-12)
    assert value(found, "rub", "pin2") == pytest.approx(moments[1], rel=1e-12)
    moment = np.array([value(found, "J", c) for c in ("mx", "my", "mz")])
    assert pins @ moment == pytest.approx([-moments[0], moments[1]], rel=1e-12)


# --- rings and balls --------------------------------------------------------------------------------------------------


def test_a_ball_swung_in_one_plane_rubs_as_a_hinge_does() -> None:
    ball, hinge = solve(loads(BALL)), solve(loads(HINGE))
    first = next(iter(hinge.accelerations.values())).value
    assert [a.value for a in ball.accelerations.values()] == pytest.approx([first, 0, 0], rel=1e-12, abs=1e-14)
    assert value(ball, "rub", "friction_1") == pytest.approx(value(hinge, "rub", "friction"), rel=1e-12)
    assert [note for note in ball.notes if "left out" in note] == []
    run, other = simulate(loads(BALL), t_end=2), simulate(loads(HINGE), t_end=2)
    angle = 2 * np.arctan2(run.q[:, 1], run.q[:, 0])
    assert angle == pytest.approx(other.q[:, 0], abs=1e-7)


@pytest.mark.parametrize("text", [BALL, RING, PUCK], ids=["ball", "ring", "plate"])
def test_joints_without_coordinates_of_their_own_rub_the_same(text: str) -> None:
    """In absolute coordinates rows hold the joint, and their multipliers press; one component is zero by symmetry."""
    run, other = (simulate(loads(text), t_end=0.3, samples=4, coordinates=x) for x in ("relative", "absolute"))
    assert np.column_stack(list(other.speeds.values()))[-1, -3:] == pytest.approx(run.u[-1][-3:], rel=1e-7, abs=1e-9)


def test_a_ball_by_angles_rubs_as_one_by_a_quaternion() -> None:
    """The speeds are rates of angles: 2, -3 and 6 rad/s about the axes x, y and z, each turned by those before."""
    text = BALL.replace("spherical,", "spherical, angles: xyz,").replace(
        "q: [cos(0.35), sin(0.35), 0, 0], u: [1, 0, 0]", "q: [0.7, 0, 0], u: [2, -3, 6]"
    )
    about = np.array([2, -3 * math.cos(0.7) - 6 * math.sin(0.7), -3 * math.sin(0.7) + 6 * math.cos(0.7)])
    found = solve(loads(text))
    force = float(np.linalg.norm([value(found, "J", c) for c in ("fx", "fy", "fz")]))
    expected = -MU * 0.02 * force * about / np.linalg.norm(about)
    assert [value(found, "J", c) for c in ("mx", "my", "mz")] == pytest.approx(expected, rel=1e-12)
    assert [value(found, "rub", f"friction_{k}") for k in (1, 2, 3)] == pytest.approx(expected, rel=1e-12)


# --- freedoms one on the other ----------------------------------------------------------------------------------------

SLOT = f"""\
multibody_sym: 1
name: pin_in_slot
gravity: [0, -{G}, 0]
bodies: {{b: {{mass: 2, inertia: {{Izz: 0.1}}}}}}
joints:
  J: {{type: custom, free: [{{translate: x}}, {{rotate: z}}], parent: ground, child: b, initial: {{u: [1, 5]}}}}
forces: {{rub: {{type: friction, joint: J, static: {MU}, radius: 0.02}}}}
"""


@pytest.mark.parametrize("order", ["{translate: x}, {rotate: z}", "{rotate: z}, {translate: x}"])
def test_a_pin_in_a_slot_rubs_along_the_slot_and_on_the_pin(order: str) -> None:
    """m x'' = -mu N with N = m g, and the pin bears both: Izz phi'' = -mu r N sqrt(1 + mu^2).

    In the other order the slot turns with the body, whose centre is at the pin: there Coriolis's force presses too.
    """
    text = SLOT.replace("{translate: x}, {rotate: z}", order)
    turned = order.startswith("{rotate")
    found = solve(loads(text.replace("u: [1, 5]", "u: [5, 1]") if turned else text))
    slide, pin = ("slide2", "pin1") if turned else ("slide1", "pin2")
    assert (found.states[f"rub.{slide}"], found.states[f"rub.{pin}"]) == ("slide+", "slide+")
    across = abs(value(found, "J", "fy"))
    names = {part: value(found, "rub", part) for part in (slide, pin)}
    assert names[slide] == pytest.approx(-MU * across, rel=1e-12)
    whole = math.hypot(value(found, "J", "fx"), value(found, "J", "fy"))
    assert names[pin] == pytest.approx(-MU * 0.02 * whole, rel=1e-12)
    if not turned:
        accelerations = [x.value for x in found.accelerations.values()]
        expected = [-MU * G, -MU * 0.02 * 2 * G * math.sqrt(1 + MU**2) / 0.1]
        assert accelerations == pytest.approx(expected, rel=1e-12)


def test_ranges_of_rest_know_planes_and_pins_and_say_that_balls_are_not_for_them() -> None:
    push = "  push: {type: force, on: b, value: [F, F, 0]}\n"
    plate = PUCK.replace("[3, 4, 0]", "[0, 0, 0]").replace("bodies:", "parameters: {F: 1}\nbodies:") + push
    ((_, high),) = range_of_rest(loads(plate), "F").ends
    assert high.value == pytest.approx(0.5 * 2 * G / math.sqrt(2), rel=1e-12)
    with pytest.raises(NoSolutionError, match="rub rubs with, or is pressed by, a vector in space: ask solve"):
        range_of_rest(loads(BALL.replace("bodies:", "parameters: {F: 1}\nbodies:")), "F")
