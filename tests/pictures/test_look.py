"""Each thing of a scene has a look, at its place on the page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.draw import item_marks, scene_marks
from multibody_sym.pictures.marks.forces import zigzag
from multibody_sym.pictures.marks.labels import Names
from multibody_sym.pictures.marks.sheet import Sheet, points_drawn
from multibody_sym.pictures.page.picture import (
    MARKED,
    AngleArc,
    Arc,
    Arrow,
    Hatch,
    Mark,
    Measure,
    Projection,
    Stroke,
    Wish,
)
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def look(name: str, names: Names = "letters") -> tuple[list[Mark], Projection]:
    return look_of(mbs.load(EXAMPLES / f"{name}.yaml"), names)


def look_of(system: mbs.System, names: Names = "letters") -> tuple[list[Mark], Projection]:
    scene = scene_of(system)
    placed = scene.at()
    seen = Projection(scene.view.right, scene.view.up, 1.0, scene.plane).scaled(points_drawn(scene, placed))
    return scene_marks(scene, placed, seen, names=names), seen


def test_the_pins_of_a_four_bar_are_white_circles_where_its_rods_meet() -> None:
    marks, seen = look("four_bar")
    pins = {m.name: m.centre for m in marks if isinstance(m, Arc) and m.role == "joint"}
    a, d = 0.2, 0.5
    assert np.allclose(pins["A"], [0.0, 0.0])
    assert np.allclose(pins["B"], seen.scale * a * np.array([0.5, np.sqrt(0.75)]))
    assert np.allclose(pins["D"], seen.scale * np.array([d, 0.0]))
    assert [m.name for m in marks if isinstance(m, Hatch)] == ["A", "D"]  # what stands on ground, and nothing else
    assert {m.name.split(".")[0] for m in marks if isinstance(m, Measure)} == {"crank", "coupler", "rocker", "ground"}


def test_the_angles_of_a_double_pendulum_open_from_the_rod_before() -> None:
    marks, _ = look("double_pendulum")
    first, second = (m for m in marks if isinstance(m, AngleArc))
    assert (second.start, second.stop > 0.5) == (pytest.approx(0.0), True)  # zero: a bow shows which way it counts
    assert (first.start, first.stop, first.tip) == (pytest.approx(-np.pi / 2), pytest.approx(0.0), 1)


def test_a_rope_bends_around_a_small_wheel_where_its_pulley_has_no_radius() -> None:
    marks, _ = look("textbook/t5_incline")
    (rope,) = [m for m in marks if isinstance(m, Stroke) and m.role == "rope"]
    (wheel,) = [m for m in marks if isinstance(m, Arc) and m.name == "pulley" and m.radius > 5.0]
    distances = np.linalg.norm(rope.points - wheel.centre, axis=1)
    assert distances.min() == pytest.approx(wheel.radius)
    assert (distances < wheel.radius * 1.001).sum() > 10


def test_a_spring_is_a_zigzag_from_end_to_end() -> None:
    points = zigzag(np.array([0.0, 0.0]), np.array([100.0, 0.0]))
    assert np.allclose(points[[0, -1]], [[0.0, 0.0], [100.0, 0.0]])
    turns = np.diff(np.sign(np.diff(points[:, 1])))
    assert np.count_nonzero(turns) >= 12


def test_names_are_wishes_of_what_they_name() -> None:
    marks, _ = look("slider_crank", "all")
    names = {(m.role, m.name) for m in marks if isinstance(m, Wish)}
    assert {("body", "crank"), ("body", "rod"), ("body", "slider"), ("joint", "A"), ("joint", "D")} <= names


def test_a_block_without_a_size_stands_on_its_plane_and_its_rope_runs_beside_that() -> None:
    marks, _ = look("textbook/t4_table_edge")
    (block,) = [m for m in marks if isinstance(m, Stroke) and (m.role, m.name) == ("body", "block")]
    (table,) = [m for m in marks if isinstance(m, Hatch) and m.name == "ground.table"]
    (rope,) = [m for m in marks if isinstance(m, Stroke) and m.role == "rope"]
    assert block.points[:, 1].min() == pytest.approx(table.points[0, 1])
    assert rope.points[0, 1] == pytest.approx(block.points[:, 1].mean())
    assert rope.points[1, 1] == pytest.approx(rope.points[0, 1])  # level up to the wheel


def test_two_loads_on_a_rope_over_a_point_hang_beside_each_other() -> None:
    marks, _ = look("textbook/t7_atwood")
    blocks = {m.name: m.points[:, 0] for m in marks if isinstance(m, Stroke) and m.role == "body"}
    assert blocks["left"].max() < blocks["right"].min()
    (rope,) = [m for m in marks if isinstance(m, Stroke) and m.role == "rope"]
    assert rope.points[0, 0] == pytest.approx(blocks["left"].mean())
    assert rope.points[-1, 0] == pytest.approx(blocks["right"].mean())


def test_a_centre_of_force_a_drive_and_joints_that_are_tied_are_seen() -> None:
    marks, _ = look("kepler")
    assert any(isinstance(m, Arc) and m.name == "sun" and np.allclose(m.centre, 0.0) for m in marks)
    marks, _ = look("variable_mass/hopper")
    assert any(isinstance(m, Arrow) and (m.role, m.name) == ("velocity", "run") for m in marks)
    marks, _ = look("oscillations/governor")
    assert ("constraint", "sleeve") in {(m.role, m.name) for m in marks}


def test_a_marked_body_is_drawn_in_another_colour_and_nothing_else_is() -> None:
    scene = scene_of(mbs.load(EXAMPLES / "four_bar.yaml"))
    seen = Projection(scene.view.right, scene.view.up, 100.0, scene.plane)
    marks = scene_marks(scene, scene.at(), seen, marked={("bodies", "crank"): "here"})
    coloured = [m for m in marks if isinstance(m, (Arc, Stroke)) and m.pen == MARKED]
    assert {(m.role, m.name) for m in coloured} == {("body", "crank")}
    assert [m.runs[0][0] for m in marks if isinstance(m, Wish) and m.role == "mark"] == ["here"]


def test_a_dot_stands_where_bodies_touch_and_none_where_they_are_apart() -> None:
    apart, _ = look("impacts/bouncing_ball")
    assert not [m for m in apart if isinstance(m, Arc) and m.role == "contact"]
    box, _ = look("textbook/pulled_box")
    (dot,) = [m for m in box if isinstance(m, Arc) and m.role == "contact"]
    (outline,) = [m for m in box if isinstance(m, Stroke) and m.role == "body"]
    assert dot.centre == pytest.approx([outline.points[:, 0].mean(), outline.points[:, 1].min()])


def test_a_rail_reaches_as_far_as_what_slides_on_it_goes_in_a_motion() -> None:
    scene = scene_of(mbs.load(EXAMPLES / "cart_pole.yaml"))
    home, (_, *others) = scene.at(), scene.begin.q
    seen = Projection(scene.view.right, scene.view.up, 100.0, scene.plane)
    sheet = Sheet(scene, home, home, seen, others=(home, scene.at([3.0, *others])))
    (rail,) = (item for item in scene.items if item.role == "guide" and item.name == "track")
    (line,) = (mark for mark in item_marks(sheet, rail) if isinstance(mark, Hatch))
    assert 300.0 < line.points[:, 0].max() < 350.0


INSIDE_AND_BELOW = """
multibody_sym: 1
name: touched
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {loop: {disc: 0.8, inside: true}}}
  bar: {mass: 1, com: [0.3, 0, 0], inertia: {Izz: 1}, surfaces: {under: {plane: [0, 0, 0], normal: -y}}}
joints: {hinge: {type: revolute, parent: ground, child: bar, q: a, initial: {q: 35 deg}}}
"""


def test_what_is_touched_inside_is_seen_all_around_and_a_body_lies_behind_its_face() -> None:
    marks, seen = look_of(mbs.loads(INSIDE_AND_BELOW))
    (loop,) = [m.points for m in marks if isinstance(m, Hatch) and m.name == "ground.loop"]
    assert np.hypot(*loop.T) == pytest.approx(0.8 * seen.scale)
    ways = np.unwrap(np.arctan2(loop[:, 1], loop[:, 0]))
    assert abs(ways[-1] - ways[0]) == pytest.approx(2 * np.pi)
    (bar,) = [m.points for m in marks if isinstance(m, Stroke) and (m.role, m.name) == ("body", "bar")]
    out = np.array([np.sin(np.deg2rad(35)), -np.cos(np.deg2rad(35))])  # -y of the bar
    assert (bar @ out).max() == pytest.approx(0.0, abs=1e-9)
    assert (bar @ out).min() < -5.0


@pytest.mark.parametrize("count", [4, 8])
def test_welds_and_dampers_in_hinges_have_no_names_where_there_are_many(count: int) -> None:
    """Of each link a body, a hinge, a damper, and a plate that is welded to it: 16 or 32 bodies and joints."""
    numbers = range(1, count + 1)
    hinge = "{type: revolute, child: b%d, axis: y, parent: %s}"
    link = "{mass: 1, com: [0.5, 0, 0], points: {end: [1, 0, 0]}}"
    bodies = [f"b{k}: {link}, plate{k}: {{mass: 1}}" for k in numbers]
    ends = ["ground", *(f"b{k}.end" for k in numbers)]
    joints = [f"h{k}: {hinge % (k, end)}, w{k}: {{type: fixed, parent: b{k}.end, child: plate{k}}}"
              for k, end in zip(numbers, ends, strict=False)]  # fmt: skip
    forces = [f"d{k}: {{type: damper, joint: h{k}, damping: 1}}" for k in numbers]
    system = mbs.loads(
        f"{{multibody_sym: 1, name: robot, bodies: {{{', '.join(bodies)}}}, joints: {{{', '.join(joints)}}}, "
        f"forces: {{{', '.join(forces)}}}}}"
    )
    marks, _ = look_of(system, "all")
    named = {mark.name for mark in marks if isinstance(mark, Wish)}
    assert {"b1", "h1", "plate1"} <= named
    assert ({"w1", "d1"} <= named) == (count == 4)
    assert not {"w1", "d1"} & named or count == 4
