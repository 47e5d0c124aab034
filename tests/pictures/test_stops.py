"""Stops of joints are drawn where what they stop comes to in a motion, with their limit beside them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from geometry import faults, shown, texts

import multibody_sym as mbs
from multibody_sym.pictures.draw import draw, item_marks
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.picture import BOLD, ROD, Arc, Hatch, Mark, Projection, Stroke
from multibody_sym.pictures.scene.scene import scene_of

SCALE = 200.0
CART = """
multibody_sym: 1
name: cart
gravity: [0, -9.81, 0]
parameters: {a: 0.8 m, l: 0.5 m}
bodies: {cart: BODY, rod: {mass: 0.2, points: {end: [0, -l, 0]}, com: [0, -l, 0]}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {q: 0.2 m, u: 4}, limits: LIMITS}
  hinge: {type: revolute, parent: cart, child: rod, axis: z, q: phi, limits: {lower: -50 deg, upper: 60 deg}}
simulation: {t_end: 1 s}
"""
CART = CART.replace("LIMITS", "{lower: -0.6 m, upper: a}")
BOX = "{shape: {box: [0.3 m, 0.2 m, 0.2 m], mass: 1}}"
PENDULUM = (
    "{multibody_sym: 1, name: p, gravity: [0, -9.81, 0], bodies: {bob: {mass: 1, com: [0, -0.5, 0]MORE}}, joints: "
    "{A: {type: revolute, parent: ground, child: bob, axis: AXIS, q: phi, "
    "limits: {lower: -1.2, upper: 40 deg, acts: ACTS}}}}"
)
ARM = """
multibody_sym: 1
name: arm
gravity: [0, 0, -9.81]
bodies: {upper: {mass: 1, com: [0.25, 0, 0], points: {end: [0.5, 0, 0]}}, fore: {mass: 0.5, com: [0.4, 0, 0]}}
joints:
  shoulder: {type: revolute, parent: ground, child: upper, axis: y, q: q2, limits: {lower: -80 deg, upper: 45 deg}}
  elbow: {type: revolute, parent: upper.end, child: fore, axis: z, q: q3, limits: {lower: 0, upper: 120 deg}}
"""
SLIDES = """
multibody_sym: 1
name: slides
gravity: [0, 0, -9.81]
bodies: {table: {mass: 1, com: [0.1, 0, 0], points: {end: [0.4, 0, 0]}}, tool: {mass: 1, com: [0, 0.3, 0]}}
joints:
  across: {type: prismatic, parent: ground, child: table, axis: x, q: x, limits: {lower: 0, upper: 0.3 m}}
  up: {type: prismatic, parent: table.end, child: tool, axis: z, q: z, limits: {upper: 0.2 m}}
"""


def sheet_at(system: mbs.System, q: Sequence[float] | None = None) -> Sheet:
    """Return a sheet on which the scene stands at coordinates."""
    scene = scene_of(system)
    seen = Projection(scene.view.right, scene.view.up, SCALE, scene.plane)
    return Sheet(scene, scene.at(q), scene.at(), seen)


def marks_of(sheet: Sheet, role: str, name: str) -> list[Mark]:
    return [m for i in sheet.scene.items if (i.role, i.name) == (role, name) for m in item_marks(sheet, i)]


@pytest.mark.parametrize("body", ["{mass: 1}", BOX], ids=["without a size", "a box"])
def test_the_front_of_a_cart_is_at_the_stop_that_a_run_brings_it_to(body: str) -> None:
    system = mbs.loads(CART.replace("BODY", body))
    run = mbs.simulate(system, samples=101)
    assert run["x"].max() == pytest.approx(0.8, abs=1e-9)
    k = int(np.argmax(run["x"]))
    sheet = sheet_at(system, run.q[k])
    (bar,) = [m for m in marks_of(sheet, "stop", "rail.upper") if isinstance(m, Hatch)]
    (block,) = [m for m in marks_of(sheet, "body", "cart") if isinstance(m, Stroke)]
    assert np.asarray(bar.points)[:, 0] == pytest.approx(np.asarray(block.points)[:, 0].max())
    heights = np.asarray(block.points)[:, 1]
    assert np.asarray(bar.points)[:, 1].min() < heights.min() < heights.max() < np.asarray(bar.points)[:, 1].max()


ENDS = [("z", "upper", 40.0), ("z", "lower", np.degrees(-1.2)), ("-z", "upper", 40.0)]


@pytest.mark.parametrize(("axis", "limit", "word"), ENDS)
def test_the_side_of_a_rod_lies_at_the_bar_at_its_limit(axis: str, limit: str, word: float) -> None:
    system = mbs.loads(PENDULUM.replace("AXIS", axis).replace("ACTS", "true").replace("MORE", ""))
    angle = np.radians(word)
    sheet = sheet_at(system, [angle])
    (bar,) = [m for m in marks_of(sheet, "stop", f"A.{limit}") if isinstance(m, Hatch)]
    way = np.array([np.sin(angle), -np.cos(angle)]) * (np.array([-1.0, 1.0]) if axis == "-z" else 1.0)
    aside = np.asarray(bar.points) @ np.array([-way[1], way[0]])
    assert aside == pytest.approx(np.full(2, aside[0]))
    assert abs(aside[0]) == pytest.approx(ROD / 2 + BOLD.width / 2)
    rising = np.sign(angle) * (-1.0 if axis == "-z" else 1.0)  # counterclockwise: its bar is to the left of the rod
    assert np.sign(aside[0]) == rising
    assert np.all(np.asarray(bar.points) @ way > 10.0)


def test_the_edge_of_a_plate_and_not_its_middle_comes_to_a_stop() -> None:
    """A triangle with a corner at the hinge, 0.2 m to the right of its longest way."""
    points = ", points: {p: [0.2, -0.4, 0], end: [0, -1, 0]}"
    system = mbs.loads(PENDULUM.replace("AXIS", "z").replace("ACTS", "true").replace("MORE", points))
    sheet = sheet_at(system, [np.radians(40.0)])
    outlines = [np.asarray(m.points) for m in marks_of(sheet, "body", "bob") if isinstance(m, Stroke) and m.closed]
    (bar,) = [np.asarray(m.points) for m in marks_of(sheet, "stop", "A.upper") if isinstance(m, Hatch)]
    along = (bar[1] - bar[0]) / np.linalg.norm(bar[1] - bar[0])
    corners = np.vstack([each for each in outlines if len(each) > 2])
    beyond = corners @ np.array([-along[1], along[0]])
    assert beyond.max() == pytest.approx(0.0, abs=1.0)  # all of the plate is on one side of the bar, and touches it


def test_limits_that_do_not_act_and_that_nothing_shows_are_no_stops() -> None:
    def stops(text: str) -> list[str]:
        return [item.name for item in scene_of(mbs.loads(text)).items if item.role == "stop"]

    assert stops(PENDULUM.replace("AXIS", "z").replace("ACTS", "false").replace("MORE", "")) == []
    rod = PENDULUM.replace("AXIS", "z").replace("ACTS", "true").replace("MORE", "")
    assert stops(rod.replace("mass: 1, com: [0, -0.5, 0]", "shape: {disc: 0.2 m, mass: 1}")) == []
    assert stops(rod) == ["A.lower", "A.upper"]


@pytest.mark.parametrize("text", [CART.replace("BODY", BOX), ARM, SLIDES], ids=["cart", "arm", "slides"])
def test_figures_with_stops_have_their_limits_and_nothing_over_each_other(text: str) -> None:
    scene = scene_of(mbs.loads(text))
    picture = draw(scene, scene.at())
    assert faults(picture) == []
    told = {shown(each) for each in texts(picture) if each.role == "stop"}
    expected = {
        "cart": {"x ≥ −0.6 m", "x ≤ a", "φ ≥ −50°", "φ ≤ 60°"},
        "arm": {"q2 ≥ −80°", "q2 ≤ 45°", "q3 ≥ 0", "q3 ≤ 120°"},
        "slides": {"x ≥ 0", "x ≤ 0.3 m", "z ≤ 0.2 m"},
    }
    assert told == expected[scene.name]
    assert all(each in picture.description for each in ("Stops: ", " ≤ "))


def test_in_space_a_slider_comes_to_its_collar_and_a_bar_holds_a_rod() -> None:
    sheet = sheet_at(mbs.loads(SLIDES), [0.3, 0.0])
    (collar,) = [i for i in sheet.scene.items if i.name == "across.upper"]
    marks = [m for m in item_marks(sheet, collar) if isinstance(m, (Arc, Stroke))]
    middle = np.mean([np.asarray(m.points).mean(axis=0) for m in marks], axis=0)
    way = sheet.way(-1, (1.0, 0.0, 0.0))
    ahead = (middle - sheet.at(0, (0.0, 0.0, 0.0))) @ way / (way @ way)
    assert 6.0 < ahead < 12.0  # in front of a sleeve of 13 pt
    bars = [i for i in sheet_at(mbs.loads(ARM)).scene.items if i.role == "stop"]
    assert [i.on_ground for i in bars] == [True, True, False, False]


def test_a_bead_on_a_wire_and_a_screw_have_stops_where_their_coordinates_end() -> None:
    wire = (
        "{multibody_sym: 1, name: w, gravity: [0, -9.81, 0], bodies: {bead: {mass: 1}}, joints: {w: {type: curve, "
        "parent: ground, child: bead, curve: {y: x^2}, q: x, limits: {upper: 0.5}}}}"
    )
    (stop,) = [i for i in scene_of(mbs.loads(wire)).items if i.role == "stop"]
    assert stop.form.at == pytest.approx((0.5, 0.25, 0.0))
    assert stop.form.axis == pytest.approx(np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0))
    screw = (
        "{multibody_sym: 1, name: s, bodies: {nut: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}}, joints: {turn: {"
        "type: screw, parent: ground, child: nut, axis: z, pitch: 2 mm, limits: {lower: -3600 deg}}}}"
    )
    (stop,) = [i for i in scene_of(mbs.loads(screw)).items if i.role == "stop"]
    assert (stop.form.at, stop.form.axis) == (pytest.approx((0, 0, -0.02)), pytest.approx((0, 0, -1)))
