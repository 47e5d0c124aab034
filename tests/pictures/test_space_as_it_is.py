"""Figures in space: a view in which no leg hides another, tops as cones, arcs of angles, links from joint to joint."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.page.layout import distances
from multibody_sym.pictures.page.picture import HIDDEN, Arrow, Picture, Stroke, TextMark
from multibody_sym.pictures.scene.items import ConeBody, Polyline
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"
TRIPOD = """
multibody_sym: 1
name: tripod
gravity: [0, 0, -9.81]
bodies:
  ground: {points: {a: [1, 0, 0], b: [-0.5, 0.866, 0], c: [-0.5, -0.866, 0]}}
  head: {mass: 1}
joints: {free: {type: point, axes: xyz, parent: ground, child: head, initial: {q: [0, 0, 1.5]}}}
constraints:
  la: {type: distance, between: [head, ground.a], value: 1.802776}
  lb: {type: distance, between: [head, ground.b], value: 1.802747}
  lc: {type: distance, between: [head, ground.c], value: 1.802747}
"""


def picture(name: str) -> Picture:
    return mbs.draw(mbs.load(EXAMPLES / f"{name}.yaml")).picture


def test_no_leg_of_a_tripod_hides_another() -> None:
    """Their feet, and the middles of the legs, are far from the other legs on the page."""
    scene = scene_of(mbs.loads(TRIPOD))
    legs = [scene.view.project(strand.pieces[0]) for strand in scene.at().strands]
    for one, other in combinations(legs, 2):
        middle = one.mean(axis=0)
        assert distances(np.array([one[1], middle]), other.reshape(1, 4)).min() > 0.15


@pytest.mark.parametrize("name", ["spinning_top", "oscillations/nutating_top"])
def test_a_top_is_a_cone_that_has_its_centre_of_mass_and_its_moment(name: str) -> None:
    """A cone of mass m, radius R and height H has its centre at 3/4 H and the moment 3/10 m R^2."""
    scene = scene_of(mbs.load(EXAMPLES / f"{name}.yaml"))
    (top,) = [item.form for item in scene.items if item.role == "body"]
    assert isinstance(top, ConeBody)
    assert 0.75 * top.height == pytest.approx(0.04)
    assert 0.3 * 0.3 * top.radius**2 == pytest.approx(2e-4)


@pytest.mark.parametrize("name", ["spatial_chain", "textbook/ball_in_socket"])
def test_a_link_that_is_thin_and_a_lamp_that_hangs_are_no_tops(name: str) -> None:
    scene = scene_of(mbs.load(EXAMPLES / f"{name}.yaml"))
    assert not [item for item in scene.items if isinstance(item.form, ConeBody)]


def test_an_angle_in_space_leads_from_its_line_of_reference_to_its_rod() -> None:
    """The governor's arms hang from its shaft, at 30 deg to it: from the shaft to each arm."""
    shown = picture("oscillations/governor")
    for name, arm in (("theta", "left"), ("psi", "right")):
        marks = [mark for mark in shown.marks if (mark.role, mark.name) == ("angle", name)]
        (arc,) = [np.asarray(mark.points) for mark in marks if isinstance(mark, Arrow)]
        (line,) = [np.asarray(mark.points) for mark in marks if isinstance(mark, Stroke) and mark.pen == HIDDEN]
        assert float(distances(arc[:1], line.reshape(1, 4))[0, 0]) < 0.5
        rod = next(m.points for m in shown.marks if isinstance(m, Stroke) and (m.role, m.name) == ("body", arm))
        around = np.vstack((rod, rod[:1]))
        assert float(distances(arc[-1:], np.hstack((around[:-1], around[1:]))).min()) < 2.5


LINK = """
multibody_sym: 1
name: link
bodies:
  one: {mass: 1, com: [0.5, BESIDE, 0], inertia: {Ixx: 1, Iyy: 1, Izz: 1}, points: {end: [1, 0, 0]}}
  two: {mass: 1, com: [0.5, 0, 0], inertia: {Ixx: 1, Iyy: 1, Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: one, axis: z, q: a}
  B: {type: revolute, parent: one.end, child: two, axis: x, q: b}
"""


@pytest.mark.parametrize(("beside", "count"), [("0.2", 2), ("0.8", 3)])
def test_a_link_of_a_robot_leads_from_joint_to_joint_though_its_centre_is_beside(beside: str, count: int) -> None:
    scene = scene_of(mbs.loads(LINK.replace("BESIDE", beside)))
    (form,) = [item.form for item in scene.items if (item.role, item.name) == ("body", "one")]
    assert isinstance(form, Polyline)
    assert len(form.points) == count


def words(system: mbs.System, **options: object) -> list[str]:
    marks = mbs.draw(system, **options).picture.marks  # type: ignore[arg-type]
    return ["".join(run for run, _ in mark.runs) for mark in marks if isinstance(mark, TextMark)]


def test_with_what_all_names_of_a_robot_begin_is_left_out() -> None:
    written = LINK.replace("BESIDE", "0.2")
    for name in ("one", "two"):
        written = written.replace(f"  {name}:", f"  arm_{name}:").replace(f": {name}", f": arm_{name}")
    system = mbs.loads(written)
    assert not [word for word in words(system, strip="arm_") if "arm" in word]
    assert [word for word in words(system) if "arm" in word]
    assert words(system, strip=["leg_", "arm_"]) == words(system, strip="arm_")
    assert words(system, strip="arm_one") != []  # what is nothing else is kept
    with pytest.raises(mbs.InputError, match="strip: expected text such as 'panda_', got 3"):
        mbs.draw(system, strip=3)  # type: ignore[arg-type]
