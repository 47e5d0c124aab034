"""Friction in joints of several freedoms: plates on planes and pins of universal joints, against other models."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from multibody_sym import ModelError, NoSolutionError, Solution, loads, range_of_rest, simulate, solve
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
BALL = (
    PENDULUM.replace("universal", "spherical")
    .replace("q: [0.7, 0]", "q: [cos(0.35), sin(0.35), 0, 0]")
    .replace("[1, 0]", "[1, 0, 0]")
)
GYRO = BALL.replace("[0, 0, -0.5]", "[0, 0, 0]").replace("[1, 0, 0]", "[2, -3, 6]")
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
    lines = write_document(worked_document(worked), "text")
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


def test_a_ring_that_slides_and_turns_slows_down_in_both_by_the_same_part() -> None:
    """With Izz = m r^2 the vector (v, r omega) of 13 m/s loses mu g a second in its own direction, until all rests."""
    found = solve(loads(RING))
    whole = np.array([3, 4, 12])  # m/s: 0.2 m * 60 rad/s
    expected = -MU * G * whole / 13 / [1, 1, 0.2]
    assert [a.value for a in found.accelerations.values()] == pytest.approx(expected, rel=1e-12)
    run = simulate(loads(RING), t_end=6)
    stop = 13 / (MU * G)
    assert [change["t"] for change in run.changes] == pytest.approx([stop], rel=1e-8)
    assert run.q[-1] == pytest.approx(whole / [1, 1, 0.2] * stop / 2, rel=1e-8)
    assert not run.u[run.t > stop].any()


@pytest.mark.parametrize(("part", "word"), [(0.999, "stick"), (1.001, "slide")])
def test_a_ring_holds_force_and_couple_together(part: float, word: str) -> None:
    most = 0.5 * 2 * G * part
    push = f"  push: {{type: force, on: b, value: [{0.48 * most}, {0.64 * most}, 0]}}\n"
    twist = f"  twist: {{type: torque, on: b, value: [0, 0, {0.6 * 0.2 * most}]}}\n"
    text = RING.replace("[3, 4, 60]", "[0, 0, 0]").replace("com: [0, 0, 0.1], ", "") + push + twist
    assert solve(loads(text)).states == {"rub": word}
    needed = solve(loads(text.replace("static: 0.5, kinetic: 0.3", "static: enough"))).needed["rub"].value
    assert needed == pytest.approx(0.5 * part, rel=1e-12)


def test_a_ball_swung_in_one_plane_rubs_as_a_hinge_does() -> None:
    ball, hinge = solve(loads(BALL)), solve(loads(HINGE))
    first = next(iter(hinge.accelerations.values())).value
    assert [a.value for a in ball.accelerations.values()] == pytest.approx([first, 0, 0], rel=1e-12, abs=1e-14)
    assert value(ball, "rub", "friction_1") == pytest.approx(value(hinge, "rub", "friction"), rel=1e-12)
    assert [note for note in ball.notes if "left out" in note] == []
    run, other = simulate(loads(BALL), t_end=2), simulate(loads(HINGE), t_end=2)
    angle = 2 * np.arctan2(run.q[:, 1], run.q[:, 0])
    assert angle == pytest.approx(other.q[:, 0], abs=1e-7)


def test_a_ball_that_turns_about_any_axis_stops_at_once_about_all_and_stays_to_the_last_bit() -> None:
    """The body hangs in its centre, with one moment of inertia J: omega loses mu r m g / J a second."""
    found = solve(loads(GYRO))
    loss = MU * 0.02 * 2 * G / 0.1
    assert [a.value for a in found.accelerations.values()] == pytest.approx(-loss * np.array([2, -3, 6]) / 7, rel=1e-12)
    run = simulate(loads(GYRO), t_end=8, samples=81)
    stop = 7 / loss
    assert [change["t"] for change in run.changes] == pytest.approx([stop], rel=1e-8)
    still = run.t > stop
    assert still.any()
    assert not run.u[still].any()
    assert (run.q[still] == run.q[still][0]).all()
    half = 7 * stop / 4  # the angle about the fixed axis is 7 t_stop / 2
    axis = np.array([2, -3, 6]) / 7
    turned = np.array([math.cos(half), *(math.sin(half) * axis)])
    begin = np.array([math.cos(0.35), math.sin(0.35), 0, 0])
    expected = np.array(
        [
            begin[0] * turned[0] - begin[1:] @ turned[1:],
            *(begin[0] * turned[1:] + turned[0] * begin[1:] + np.cross(begin[1:], turned[1:])),
        ]
    )
    assert run.q[-1] == pytest.approx(expected, abs=1e-7)


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


def test_the_slide_of_a_pin_in_a_slot_stops_and_stays_while_the_pin_turns_on() -> None:
    """Along the slot nothing presses on the pin from then on: -mu r m g / Izz, and the slide rests to the last bit."""
    run = simulate(loads(SLOT), t_end=5, samples=51)
    slide, later = 1 / (MU * G), MU * 0.02 * 2 * G / 0.1
    left = 5 - slide * MU * 0.02 * 2 * G * math.sqrt(1 + MU**2) / 0.1
    assert [(c["element"], c["kind"]) for c in run.changes] == [("rub.slide1", "stick"), ("rub.pin2", "stick")]
    assert [c["t"] for c in run.changes] == pytest.approx([slide, slide + left / later], rel=1e-9)
    still = run.t > slide
    assert not run.u[still, 0].any()
    assert (run.q[still, 0] == run.q[still][0, 0]).all()


def test_three_rings_of_a_gimbal_are_three_journals() -> None:
    """A body that hangs in its centre, level rings: m g is across two of the axes and along the third."""
    text = BALL.replace("spherical", "custom, free: [{rotate: x}, {rotate: y}, {rotate: z}]").replace(
        "q: [cos(0.35), sin(0.35), 0, 0], u: [1, 0, 0]", "u: [1, -1, 1]"
    )
    found = solve(loads(text.replace("com: [0, 0, -0.5], ", "")))
    assert [value(found, "rub", x) for x in ("pin1", "pin2", "pin3")] == pytest.approx(
        [-MU * 0.02 * 2 * G, MU * 0.02 * 2 * G, 0], rel=1e-12, abs=1e-12
    )


@pytest.mark.parametrize("joint", ["revolute, axis: x", "universal", "spherical"])
def test_how_rough_a_journal_must_be_is_told_as_a_coefficient(joint: str) -> None:
    """Level, the pin holds m g * 0.5 m with m g at 0.02 m: 25, without a unit."""
    start = {"spherical": "q: [cos(pi/4), sin(pi/4), 0, 0]", "universal": "q: [pi/2, 0]"}.get(joint, "q: pi/2")
    text = (
        HINGE.replace("revolute, axis: x", joint)
        .replace("q: 0.7, u: 1", start)
        .replace("static: 0.3", "static: enough")
    )
    (needed,) = [x for x in solve(loads(text)).needed.values() if x.value]
    assert (needed.value, needed.unit) == (pytest.approx(25, rel=1e-12), "")


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        (PUCK, f"[0, 0, -{G}]", f"[0, -{G}, 0]", "nothing presses along the normal of 'J'"),
        (PUCK, "static: 0.5", "static: 0.5, length: 1", "pads are for sliders and hinges"),
        (PENDULUM, ", radius: 0.02", "", "rubs on its two pins: give their radius"),
        (
            PUCK,
            "type: planar",
            "type: custom, free: [{rotate: x}, {rotate: y}, {rotate: z}]",
            "on a pin: give its radius",
        ),
        (PUCK, "type: planar", "type: point, axes: xyz", "is another"),
        (BALL, ", radius: 0.02", "", "a ball rubs at its radius: give it"),
        (
            RING,
            "type: planar",
            "type: custom, free: [{translate: x}, {translate: y}]",
            "does not turn, so that nothing",
        ),
    ],
)
def test_what_cannot_rub_is_told(text: str, old: str, new: str, message: str) -> None:
    text = text.replace(", 60]", "]") if "does not" in message else text
    with pytest.raises(ModelError, match=message):
        solve(loads(text.replace(old, new).replace("com: [0, 0, 0.1], ", "")))


def test_ranges_of_rest_know_planes_and_pins_and_say_that_balls_are_not_for_them() -> None:
    push = "  push: {type: force, on: b, value: [F, F, 0]}\n"
    plate = PUCK.replace("[3, 4, 0]", "[0, 0, 0]").replace("bodies:", "parameters: {F: 1}\nbodies:") + push
    ((_, high),) = range_of_rest(loads(plate), "F").ends
    assert high.value == pytest.approx(0.5 * 2 * G / math.sqrt(2), rel=1e-12)
    with pytest.raises(NoSolutionError, match="rub rubs with, or is pressed by, a vector in space: ask solve"):
        range_of_rest(loads(BALL.replace("bodies:", "parameters: {F: 1}\nbodies:")), "F")
