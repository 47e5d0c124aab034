"""Every kind of element of the model language has a sign, and what has a size has the size that it says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.load_records import BodyTorque, JointForce, PointForce
from multibody_sym.model.bodies import SHAPES, Surface
from multibody_sym.model.constraints import CONSTRAINTS
from multibody_sym.model.forces import FORCES, Force, Torque
from multibody_sym.model.joints import JOINTS
from multibody_sym.pictures.scene import bodies, forces, joints, stage
from multibody_sym.pictures.scene import bodies as machines
from multibody_sym.pictures.scene.items import Bowl, Disc, Polyline, Symbol
from multibody_sym.pictures.scene.scene import Scene, scene_of


def test_no_kind_of_element_is_forgotten() -> None:
    assert set(JOINTS.table) == set(joints._SIGNS)
    assert set(SHAPES) == set(bodies._SHAPES)
    seen = {*forces._STRANDS, *machines._CONSTRAINTS, *machines._IN_JOINTS}
    assert set(CONSTRAINTS.table.values()) <= seen
    by_arrows = {Force, Torque, mbs.Drag, mbs.Distributed}
    assert set(FORCES.table.values()) <= seen | by_arrows
    assert {PointForce, BodyTorque, JointForce} <= set(forces._LAWS)
    kinds = {"sphere", "disc", "plane", "segment", "point", "revolution", "curve", "outline"}
    assert kinds == set(stage._FORMS)
    assert kinds <= set(Surface.__dataclass_fields__)


def scene(joints: dict[str, Any], *, gravity: Any = (0, -9.81, 0), **more: Any) -> Scene:
    return scene_of(mbs.System("elements", gravity=list(gravity), joints=joints, **more))


def geared(**gear: Any) -> Scene:
    wheels = {name: mbs.Body(mass=1, inertia={"Izz": 1}) for name in ("pinion", "wheel")}
    return scene(
        {"A": mbs.Revolute("ground", "pinion"), "B": mbs.Revolute("ground.two", "wheel")},
        bodies={"ground": mbs.Body(points={"two": [0.3, 0, 0]}), **wheels},
        constraints={"mesh": mbs.Gear(["A", "B"], **gear)},
    )


@pytest.mark.parametrize("gear", [{"ratio": -2, "radii": [0.1, 0.2]}, {"ratio": -2}])
def test_pitch_circles_of_gears_touch(gear: dict[str, Any]) -> None:
    discs = [i.form for i in geared(**gear).items if isinstance(i.form, Disc) and i.form.teeth]
    assert [disc.radius for disc in discs] == pytest.approx([0.1, 0.2])


def test_the_pinion_of_a_rack_has_the_radius_that_its_ratio_says() -> None:
    drawn = scene(
        {"A": mbs.Revolute("ground.up", "pinion"), "B": mbs.Prismatic("ground", "rack", axis="x")},
        bodies={
            "ground": mbs.Body(points={"up": [0, 0.1, 0]}),
            "pinion": mbs.Body(mass=1, inertia={"Izz": 1}),
            "rack": mbs.Body(mass=1),
        },
        constraints={"mesh": mbs.Gear(["A", "B"], ratio=10)},
    )
    gears = [item.form for item in drawn.items if item.role == "gear"]
    assert isinstance(gears[0], Disc)
    assert gears[0].radius == pytest.approx(0.1)
    assert isinstance(gears[1], Symbol)
    assert (gears[1].kind, gears[1].along) == ("rack", (1.0, 0.0, 0.0))


def test_a_homogeneous_body_stands_about_its_centre_of_mass() -> None:
    rod = mbs.Body(shape=mbs.Shape("rod", [0.4], 1), com=[0, 0, 0])
    drawn = scene({"A": mbs.Revolute("ground", "rod")}, bodies={"rod": rod})
    (form,) = [i.form for i in drawn.items if i.role == "body" and isinstance(i.form, Polyline)]
    assert form.points == ((-0.2, 0.0, 0.0), (0.2, 0.0, 0.0))


def test_a_plate_is_bounded_by_the_joints_that_hold_it() -> None:
    points = {"a": [0, 0, 0], "b": [1, 0, 0], "c": [0.5, 0.8, 0]}
    plate = mbs.Body(mass=1, com=[0.5, 0.3, 0], inertia={"Izz": 1}, points=points)
    drawn = scene({"A": mbs.Revolute("ground", "plate")}, bodies={"plate": plate})
    (form,) = [i.form for i in drawn.items if isinstance(i.form, Polyline)]
    assert form.closed
    assert {tuple(np.round(point, 12)) for point in form.points} == {(0, 0, 0), (1, 0, 0), (0.5, 0.8, 0)}


def test_a_bowl_in_space_is_its_profile_about_its_axis() -> None:
    drawn = scene(
        {"free": mbs.PointJoint("ground", "bead", axes="xyz", initial={"q": [0.5, 0, 0.125]})},
        gravity=(0, 0, -9.81),
        bodies={
            "ground": mbs.Body(surfaces={"bowl": mbs.Surface(revolution="0.5*s^2")}),
            "bead": mbs.Body(mass=1),
        },
        contacts={"c": mbs.Contact(["bead", "ground.bowl"])},
    )
    (bowl,) = [item.form for item in drawn.items if isinstance(item.form, Bowl)]
    assert [height for _, height in bowl.profile] == pytest.approx([0.5 * s**2 for s, _ in bowl.profile])
    assert not drawn.plane


@pytest.mark.parametrize(
    ("joint", "kinds"),
    [
        (mbs.Universal("ground", "body"), {"cardan"}),
        (mbs.Spherical("ground", "body"), {"ball_pivot"}),
        (mbs.Cylindrical("ground", "body", axis="z"), {"sleeve"}),
        (mbs.Screw("ground", "body", axis="z", pitch=0.1), {"nut"}),
        (mbs.Custom("ground", "body", free=[{"rotate": "z"}, {"rotate": "x"}]), {"cardan"}),
        (mbs.Fixed("ground", "body"), {"weld"}),
    ],
)
def test_joints_in_space_have_their_signs(joint: Any, kinds: set[str]) -> None:
    body = mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})
    drawn = scene({"J": joint}, gravity=(0, 0, -9.81), bodies={"body": body})
    assert {i.form.kind for i in drawn.items if i.role == "joint" and isinstance(i.form, Symbol)} == kinds


def test_a_rope_has_a_bow_between_each_two_pieces_of_no_length_at_a_point() -> None:
    drawn = scene(
        {
            "A": mbs.Prismatic("ground", "left", axis="y"),
            "B": mbs.Prismatic("ground.right", "load", axis="y"),
        },
        bodies={
            "ground": mbs.Body(points={"up": [0, 2, 0], "axle": [1, 2, 0], "right": [1.1, 0, 0]}),
            "left": mbs.Body(mass=1),
            "load": mbs.Body(mass=2),
        },
        pulleys={"P": mbs.Pulley(at="ground.up"), "Q": mbs.Pulley(at="ground.axle", radius=0.1)},
        constraints={"rope": mbs.Rope(["left", "P", "Q", "load"])},
    )
    (rope,) = drawn.at().strands
    assert [bow.radius for bow in rope.bows] == [0.0, 0.1]
    assert rope.turns == rope.bows[1:]
    slope = np.arcsin(0.1 / 1.0)  # the tangent from the point to the wheel, which it leaves plumb
    assert rope.length == pytest.approx(2 + np.cos(slope) + 0.1 * (np.pi / 2 + slope) + 2)


def test_a_system_without_gravity_joints_or_sizes_is_a_scene_too() -> None:
    alone = scene({"free": mbs.PointJoint("ground", "a")}, gravity=(0, 0, 0), bodies={"a": mbs.Body(mass=1)})
    assert alone.size == 1.0
    assert np.all(np.isfinite(alone.at().poses))
    empty = scene({}, bodies={})
    assert empty.at().poses.shape == (1, 3, 4)


def test_a_length_that_is_a_long_name_is_named_and_a_long_expression_is_not() -> None:
    (length,) = mbs.parameters("length_of_the_whole_arm", [1.0])
    arm = mbs.Body(mass=1, com=[length, 0, 0], points={"p": [0, length * 2 + length**2, 0]})
    drawn = scene({"A": mbs.Revolute("ground", "arm")}, bodies={"arm": arm})
    assert [dimension.label for dimension in drawn.dimensions] == ["length_of_the_whole_arm"]


@pytest.mark.parametrize(("friction", "kind"), [({"kinetic": 0.3}, "block"), ({"restitution": 0.8}, "bob")])
@pytest.mark.parametrize(("end", "repeat"), [("shoe1", None), ("shoe#", 1)])
def test_what_rubs_is_a_block_and_what_bounces_a_ball(
    friction: dict[str, Any], kind: str, end: str, repeat: int | None
) -> None:
    drum = mbs.Body(mass=1, inertia={"Izz": 1}, surfaces={"rim": mbs.Surface(disc=0.4)})
    drawn = scene(
        {
            "axle": mbs.Revolute("ground", "drum"),
            "guide": mbs.Prismatic("ground", "shoe1", axis="y", initial={"q": 0.4}),
        },
        bodies={"drum": drum, "shoe1": mbs.Body(mass=1)},
        contacts={"c": mbs.Contact([end, "drum.rim"], repeat=repeat, **friction)},
    )
    assert [i.form.kind for i in drawn.items if i.role == "body" and isinstance(i.form, Symbol)] == [kind]


@pytest.mark.parametrize(("end", "repeat"), [("stone1", None), ("stone#", 1)])
def test_a_particle_that_lies_on_a_face_is_a_block(end: str, repeat: int | None) -> None:
    floor = mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")})
    drawn = scene(
        {"J": mbs.PointJoint("ground", "stone1")},
        bodies={"ground": floor, "stone1": mbs.Body(mass=1)},
        contacts={"c": mbs.Contact([end, "ground.floor"], static=0.3, repeat=repeat)},
    )
    assert [i.form.kind for i in drawn.items if i.role == "body" and isinstance(i.form, Symbol)] == ["block"]


def test_a_body_that_is_moved_in_its_plane_is_no_skate() -> None:
    """A planar joint with a prescribed motion has no speeds of its own, in which a velocity could be held."""
    system = mbs.loads(
        "{multibody_sym: 1, name: moved, bodies: {plate: {mass: 1, inertia: {Izz: 1}}, wheel: {mass: 1, inertia: {Izz:"
        " 1}}}, joints: {table: {type: planar, parent: ground, child: plate, motion: [t, 0, 0]}, axle: {type: revolute,"
        " parent: plate, child: wheel, axis: z, q: phi, initial: {u: 2}}},"
        " constraints: {steady: {type: velocity, zero: u_phi - 2}}}"
    )
    assert [item.name for item in scene_of(system).items if getattr(item.form, "kind", "") == "skate"] == []


@pytest.mark.parametrize("motion", [None, "A*t"])
def test_what_is_driven_along_a_rail_is_drawn_as_what_slides_there(motion: str | None) -> None:
    rail = mbs.Prismatic("ground", "trolley", axis="x", motion=motion)
    made = scene({"rail": rail}, bodies={"trolley": mbs.Body(mass=1)}, parameters={"A": 1})
    assert [item.role for item in made.items if item.name == "rail"] == ["guide", "joint"]
