"""Speeds at the start, steady drives, drags: each that a model declares has its arrow, with a letter, where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.page.picture import Arrow
from multibody_sym.pictures.scene.items import ArrowItem, ConeBody
from multibody_sym.pictures.scene.scene import Scene, scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def scene(name: str) -> Scene:
    return scene_of(mbs.load(EXAMPLES / f"{name}.yaml"))


def speeds(shown: Scene) -> dict[str, ArrowItem]:
    return {arrow.label: arrow for arrow in shown.arrows if arrow.role == "velocity"}


HINGES = """
multibody_sym: 1
name: hinges
gravity: [0, -9.81, 0]
parameters: {spin: 7 rad/s}
bodies:
  a: {mass: 1, com: [0.5, 0, 0], inertia: {Izz: 1}, points: {end: [1, 0, 0]}}
  b: {mass: 1, com: [0.5, 0, 0], inertia: {Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: a, axis: z, q: phi, FIRST}
  B: {type: revolute, parent: a.end, child: b, axis: z, q: psi, initial: {u: SECOND}}
"""


@pytest.mark.parametrize(
    ("first", "second", "found"),
    [
        ("initial: {u: 0}", "-spin", {"omega_0": -7.0}),
        ("initial: {u: 2}", "spin", {"omega_phi": 2.0, "omega_psi": 7.0}),
        ("initial: {u: 0}", "0", {}),
    ],
)
def test_each_hinge_that_turns_at_the_start_has_its_angular_velocity(
    first: str, second: str, found: dict[str, float]
) -> None:
    shown = speeds(scene_of(mbs.loads(HINGES.replace("FIRST", first).replace("SECOND", second))))
    assert {label: arrow.vector[2] for label, arrow in shown.items()} == found
    assert all(arrow.turning for arrow in shown.values())


def test_a_driven_hinge_has_its_steady_speed() -> None:
    driven = HINGES.replace("q: phi, FIRST", "motion: spin*t").replace("SECOND", "0")
    (arrow,) = [a for a in scene_of(mbs.loads(driven)).arrows if a.role == "velocity"]
    assert (arrow.label, arrow.vector) == ("omega", (0.0, 0.0, 7.0))


def test_a_top_spins_about_its_axis_above_it_and_precesses_about_the_vertical() -> None:
    shown = scene("oscillations/nutating_top")
    spin, precession = speeds(shown)["omega_0"], speeds(shown)["W"]
    (cone,) = [item.form for item in shown.items if isinstance(item.form, ConeBody)]
    axis = shown.at().turned(spin.at.body, cone.axis)
    assert np.cross(spin.vector, axis) == pytest.approx(np.zeros(3), abs=1e-9)
    assert float(np.dot(spin.at.point, cone.axis)) > cone.height
    assert precession.vector == pytest.approx((0.0, 0.0, 5.0))
    assert precession.at.point == pytest.approx((0.0, 0.0, 0.0))


def test_the_bob_of_a_spherical_pendulum_has_its_velocity() -> None:
    """v = r phi' at 3 rad/s and the distance r from the vertical, level and across the string."""
    shown = scene("spherical_pendulum")
    (arrow,) = speeds(shown).values()
    assert "v_0" not in speeds(scene("spatial_chain"))  # whose links are rods
    bob = shown.at().point(arrow.at)
    assert arrow.label == "v_0"
    assert abs(float(np.dot(arrow.vector, bob))) < 1e-9
    assert float(np.linalg.norm(arrow.vector)) == pytest.approx(3.0 * float(np.hypot(bob[0], bob[1])))


@pytest.mark.parametrize("name", ["kepler", "oscillations/nearly_a_circle"])
def test_a_planet_has_its_velocity_across_the_line_to_its_sun(name: str) -> None:
    """By v^2/r = GM/r^2 (1 + e) in the perihelion, and v^2/R = k/(m R^n) on the circle."""
    (arrow,) = speeds(scene(name)).values()
    speed = np.sqrt(4.0 * np.pi**2 * 1.3 / 0.7) if name == "kepler" else np.sqrt(3.0)
    assert (arrow.label, arrow.vector) == ("v_0", pytest.approx((0.0, speed, 0.0)))
    assert not arrow.turning
    (angle,), (distance,) = ([x for x in each if x.coordinate] for each in (scene(name).angles, scene(name).dimensions))
    assert (angle.label, distance.label) == ("phi", "r")


@pytest.mark.parametrize(
    ("name", "label", "way"),
    [("questions/parachutist", "k*v^2", (0.0, 1.0, 0.0)), ("variable_mass/rocket_sled", "b*v", (-1.0, 0.0, 0.0))],
)
def test_a_drag_acts_against_what_sets_a_body_at_rest_in_motion(name: str, label: str, way: tuple[float, ...]) -> None:
    shown = scene(name)
    (drag,) = [arrow for arrow in shown.arrows if arrow.role == "drag"]
    assert (drag.label, drag.way, drag.vector) == (label, way, (0.0, 0.0, 0.0))
    (drawn,) = [m for m in mbs.draw(mbs.load(EXAMPLES / f"{name}.yaml")).picture.marks if m.role == "drag"][:1]
    assert isinstance(drawn, Arrow)
    assert np.diff(np.asarray(drawn.points), axis=0)[0] @ np.array(way[:2]) > 0.0


def test_the_length_of_a_guide_is_measured_at_the_box_that_rubs() -> None:
    for name, sizes in (("jamming_drawer", [0.4, 0.84]), ("bracket_on_column", [0.12, 0.2])):
        shown = scene(f"textbook/{name}")
        (box,) = [i.form for i in shown.items if i.role == "body" and type(i.form).__name__ == "Block"]
        assert np.ptp(box.bounds, axis=0)[:2] == pytest.approx(sizes)
        (length,) = [each for each in shown.dimensions if each.label == "l"]
        assert float(np.linalg.norm(np.subtract(length.a.point, length.b.point))) == pytest.approx(box.sizes[0])
