"""A scene has all that is declared, where kinematics says that it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.scene.items import Disc, Polyline, Rail, Symbol
from multibody_sym.pictures.scene.scene import Scene, scene_of

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))


def scene(name: str) -> Scene:
    return scene_of(mbs.load(next(path for path in EXAMPLES if path.stem == name)))


def symbols(drawn: Scene, role: str) -> dict[str, str]:
    return {i.name: i.form.kind for i in drawn.items if i.role == role and isinstance(i.form, Symbol)}


def test_a_double_pendulum_is_two_rods_with_bobs_on_a_pivot_and_a_pin() -> None:
    drawn = scene("double_pendulum")
    rods = [item.form.points for item in drawn.items if isinstance(item.form, Polyline)]
    assert rods == [((0.0, 0.0, 0.0), (0.0, -1.0, 0.0))] * 2
    assert symbols(drawn, "joint") == {"shoulder": "pivot", "elbow": "pin"}
    assert symbols(drawn, "body") == {"upper": "bob", "lower": "bob"}
    assert [dimension.label for dimension in drawn.dimensions] == ["l1", "l2"]
    assert [angle.label for angle in drawn.angles] == ["theta1", "theta2"]


def test_a_double_pendulum_stands_where_its_angles_lead() -> None:
    drawn = scene("double_pendulum")
    placed = drawn.at([0.3, 0.5])
    ends = [placed.world(body, np.array([[0.0, -1.0, 0.0]]))[0] for body in (0, 1)]
    assert np.allclose(ends[0], [np.sin(0.3), -np.cos(0.3), 0.0])
    assert np.allclose(ends[1] - ends[0], [np.sin(0.8), -np.cos(0.8), 0.0])


def test_a_slider_runs_on_its_rail_as_far_as_it_is_at_the_start() -> None:
    drawn = scene("slider_crank")
    (rail,) = [item.form for item in drawn.items if isinstance(item.form, Rail)]
    r, l, phi = 0.1, 0.3, np.pi / 6
    assert rail.reach == pytest.approx((0.0, r * np.cos(phi) + np.sqrt(l**2 - (r * np.sin(phi)) ** 2)))
    assert symbols(drawn, "body")["slider"] == "block"


def test_what_hangs_on_a_rope_has_no_rail_to_be_seen_and_a_block_on_a_slope_has() -> None:
    drawn = scene("t5_incline")
    rails = {item.name: item.form for item in drawn.items if isinstance(item.form, Rail)}
    assert rails["line"].light
    assert not rails["plane"].light
    assert np.allclose(rails["plane"].axis, [np.sqrt(0.5), np.sqrt(0.5), 0.0])


def test_a_rope_over_a_heavy_pulley_is_two_straight_pieces_and_half_the_rim() -> None:
    drawn = scene("heavy_pulley")
    (rope,) = drawn.at().strands
    (bow,) = rope.bows
    assert bow.angle == pytest.approx(np.pi)
    assert np.allclose(np.abs(rope.pieces[:, :, 0]), 0.1)  # plumb, at the rim
    assert rope.length == pytest.approx(2 * 2.0 + np.pi * 0.1)
    assert any(isinstance(item.form, Disc) and item.role == "pulley" for item in drawn.items)


def test_gravity_points_down_in_every_view_in_which_it_lies() -> None:
    for name in ("double_pendulum", "governor", "t5_incline"):
        drawn = scene(name)
        gravity = np.array(next(arrow.vector for arrow in drawn.arrows if arrow.role == "gravity"))
        right, up = drawn.view.project(gravity)
        assert up < 0
        assert abs(right) < 1e-9


def test_labels_of_parameters_are_what_stands_at_lengths_forces_and_contacts() -> None:
    text = """
multibody_sym: 1
name: labelled
gravity: [0, -9.81, 0]
parameters:
  reach: {value: 2 m, label: l}
  pull: {value: 3 N, label: F_0}
  rough: {value: 0.2, label: mu}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  rod: {mass: 1, inertia: {Izz: 1}, points: {tip: [reach/2, 0, 0]}}
joints: {free: {type: planar, parent: ground, child: rod, q: [x, y, phi]}}
contacts: {c: {between: [rod.tip, ground.floor], kinetic: rough}}
forces: {f: {type: force, on: rod.tip, value: [pull, 0, 0]}}
"""
    scene = scene_of(mbs.loads(text))
    assert [each.label for each in scene.dimensions] == ["l/2"]
    assert {each.label for each in scene.arrows} == {"gravity"[:1], "F_0"}
    assert [item.letters for item in scene.items if item.role == "contact"] == ["mu"]
