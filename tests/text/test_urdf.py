"""URDF files: the tree, poses and inertias they mean by another route, names, notes, every mistake with its place."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hostile import verdict
from scipy.spatial.transform import Rotation

from multibody_sym.answers.solve import solve
from multibody_sym.errors import InputError, ModelError
from multibody_sym.mechanics.model_files import dumps, load, loads
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import pose_of
from multibody_sym.model.system import System
from multibody_sym.model.urdf import UrdfNotice, load_urdf
from multibody_sym.motion.prepare.functions import compile, hybrid_dynamics, inverse_dynamics

ARM = Path(__file__).parent / "data" / "arm.urdf"
MUTATE = Path(__file__).with_name("mutate_urdf.py")
LINK = '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
HINGE = '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/>{}</joint>'


def arm(**options: bool) -> System:
    """Return the system of the file that has everything."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UrdfNotice)
        return load_urdf(ARM, **options)


def robot(folder: Path, *content: str) -> Path:
    """Return a file that holds a robot of these elements, from line 2 on, each on a line of its own."""
    path = folder / "robot.urdf"
    path.write_text("\n".join(['<robot name="r">', *content, "</robot>"]))
    return path


def axis_of(path: Path, joint: str = "A") -> Any:
    """Return the axis that a joint has by declaration, in numbers."""
    return [x.shadow for x in load_urdf(path).joints[joint].axis]


# --- what a file means ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", [{}, {"floating": True}, {"damping": False}, {"mimic": False}])
def test_the_model_that_is_written_is_the_one_that_was_read(options: dict[str, bool]) -> None:
    system = arm(**options)
    assert loads(dumps(system)) == system
    mechanism(system)


def test_poses_are_those_of_fixed_axis_angles() -> None:
    resolved = mechanism(arm())
    q = np.zeros(len(resolved.coordinates))
    names = [c.name for c in resolved.coordinates]
    q[names.index("let_go_qw")] = 1
    q[names.index("shoulder_pan")] = 0.4
    q[names.index("q_1st_slider")] = 0.25
    motion = motion_of(resolved, state_of(resolved, float, 0.0, list(q), [0.0] * len(resolved.speeds), []))
    numbers = {body.name: k for k, body in enumerate(resolved.bodies)}
    slide = np.array([1, 2, 3]) / np.sqrt(14)
    shoulder = Rotation.from_euler("xyz", [0, np.pi / 2, -np.pi]) * Rotation.from_rotvec([0, -0.4, 0])
    hand = shoulder * Rotation.from_euler("xyz", [0.1, 0.2, 0.3])
    R, p = motion.poses[numbers["hand"]]
    np.testing.assert_allclose(np.array(R, dtype=float), hand.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(np.array(p, dtype=float), np.array([0, 0, 0.1]) + hand.apply(0.25 * slide), atol=1e-14)
    for name, turn in (("disc", Rotation.identity()), ("drone", Rotation.identity()), ("camera", hand)):
        np.testing.assert_allclose(np.array(motion.poses[numbers[name]][0], dtype=float), turn.as_matrix(), atol=1e-14)


def test_a_planar_joint_moves_across_its_axis() -> None:
    resolved = mechanism(arm())
    names = [c.name for c in resolved.coordinates]
    q = np.zeros(len(names))
    q[names.index("let_go_qw")] = 1
    q[[names.index("puck_x"), names.index("puck_y"), names.index("puck_theta")]] = 0.2, -0.3, 0.5
    motion = motion_of(resolved, state_of(resolved, float, 0.0, list(q), [0.0] * len(resolved.speeds), []))
    R, p = motion.poses[[body.name for body in resolved.bodies].index("disc")]
    normal = np.array([1, 1, 0]) / np.sqrt(2)
    moved = np.array(p, dtype=float) - [0.3, 0, 0]
    assert abs(moved @ normal) < 1e-15
    assert np.linalg.norm(moved) == pytest.approx(np.hypot(0.2, 0.3))
    np.testing.assert_allclose(np.array(R, dtype=float), Rotation.from_rotvec(0.5 * normal).as_matrix(), atol=1e-15)


def test_inertias_are_turned_into_body_axes() -> None:
    def matrix(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> np.ndarray:
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    bodies = arm().bodies
    R = Rotation.from_euler("xyz", [0.3, -0.4, 0.5]).as_matrix()
    wanted = R @ matrix(0.03, 0.04, 0.05, 0.001, -0.002, 0.003) @ R.T
    found = matrix(*(x.shadow for x in bodies["base"].inertia or ()))
    np.testing.assert_allclose(found, wanted, rtol=1e-14, atol=1e-17)
    right = [x.shadow for x in bodies["upper.arm"].inertia or ()]
    assert right == [0.02, 0.04, 0.03, -0.002, 0.001, -0.003]


def test_rounded_right_angles_and_axes_are_exact() -> None:
    system = arm()
    rotation = pose_of(system.bodies["base"].frames["shoulder-pan"]).rotation
    assert [[x.shadow for x in row] for row in rotation] == [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]
    assert [x.shadow for x in system.joints["shoulder-pan"].axis] == [0, -1, 0]


def test_angles_that_are_not_right_stay_as_they_are(tmp_path: Path) -> None:
    origin = '<origin rpy="1.5708 0 1.00000001e-9"/>'
    path = robot(tmp_path, LINK.format("a"), LINK.format("b"), HINGE.format("A", "a", "b", origin))
    turns = load_urdf(path).bodies["a"].frames["A"].rotate
    assert [turn.angle.shadow for turn in turns] == [1.00000001e-9, 1.5708]


def test_joints_turn_about_x_unless_the_file_says_otherwise(tmp_path: Path) -> None:
    links = LINK.format("a"), LINK.format("b")
    assert axis_of(robot(tmp_path, *links, HINGE.format("A", "a", "b", ""))) == [1, 0, 0]
    assert axis_of(robot(tmp_path, *links, HINGE.format("A", "a", "b", '<axis xyz="0 3 4"/>'))) == [0, 3, 4]


# --- names and options ------------------------------------------------------------------------------------------


def test_elements_keep_their_names_and_coordinates_get_symbols() -> None:
    system = arm()
    assert list(system.bodies) == ["base", "upper.arm", "hand", "ground_link", "disc", "drone", "camera"]
    assert list(system.joints) == ["base", "shoulder-pan", "1st slider", "wheel", "puck", "let_go", "tool"]
    names = [c.name for c in mechanism(system).coordinates]
    assert names[:4] == ["shoulder_pan", "q_1st_slider", "wheel", "puck_x"]


def test_names_that_would_be_the_same_symbol_do_not_meet(tmp_path: Path) -> None:
    links = [LINK.format(name) for name in "abcde"]
    names = "j-1", "j 1", "u_j_1", "t"
    joints = [HINGE.format(name, "a", link, "") for name, link in zip(names, "bcde", strict=True)]
    coordinates = [c.name for c in mechanism(load_urdf(robot(tmp_path, *links, *joints))).coordinates]
    assert len(set(coordinates)) == 4
    assert coordinates[0] == "j_1"


def test_a_floating_root_has_six_more_speeds() -> None:
    fixed, free = mechanism(arm()), mechanism(arm(floating=True))
    assert len(free.speeds) == len(fixed.speeds) + 6
    assert [c.name for c in free.coordinates][:4] == ["base_x", "base_y", "base_z", "base_qw"]


def test_damping_is_a_force_or_left_out() -> None:
    forces = arm().forces
    assert {name: (f.joint, f.damping.shadow) for name, f in forces.items()} == {
        "shoulder-pan_damping": ("shoulder-pan", 0.7),
        "1st slider_damping": ("1st slider", 3),
    }
    assert not arm(damping=False).forces


def test_limits_are_those_of_the_file() -> None:
    joints = arm().joints
    limits = {name: joints[name].limits for name in ("shoulder-pan", "wheel", "1st slider")}
    bounds = {
        name: [x and x.shadow for x in (given.lower, given.upper, given.velocity, given.effort)]
        for name, given in limits.items()
        if given is not None
    }
    assert bounds == {"shoulder-pan": [-1, 2, 1, 10], "wheel": [None, None, 20, 5]}
    assert not any(given.acts for given in limits.values() if given is not None)  # a robot's file only tells them


def test_mimic_is_a_coupler_or_left_out() -> None:
    coupler = arm().constraints["wheel_mimic"]
    assert {name: factor.shadow for name, factor in coupler.joints.items()} == {"wheel": 1, "1st slider": 30}
    assert coupler.value.shadow == 0.1
    assert not arm(mimic=False).constraints


def test_joints_that_mimic_move_as_one(tmp_path: Path) -> None:
    """Along z, masses 1 and 2 with q2 = 0.1 - 2 q1: (m1 + 4 m2) q1'' = -(m1 - 2 m2) g."""
    axis = '<axis xyz="0 0 1"/>'
    both = HINGE.format(*"Aab", axis), HINGE.format(*"Bac", axis + '<mimic joint="A" multiplier="-2" offset="0.1"/>')
    joints = [joint.replace("revolute", "prismatic") for joint in both]
    heavy = LINK.format("c").replace('mass value="1"', 'mass value="2"')
    with pytest.warns(UrdfNotice, match="mimic ties joints .*: B"):
        system = load_urdf(robot(tmp_path, A, B, heavy, *joints))
    found = solve(system).accelerations
    assert found["A"].value == pytest.approx(3 * 9.81 / 9, rel=1e-12)
    assert found["B"].value == pytest.approx(-6 * 9.81 / 9, rel=1e-12)


def test_inverse_dynamics_says_how_to_leave_out_what_mimics(tmp_path: Path) -> None:
    """Without the coupler a slider along z carries what is above it: (m1 + m2) (a1 + g) + m2 a2 at the first."""
    axis = '<axis xyz="0 0 1"/>'
    both = HINGE.format(*"Aab", axis), HINGE.format(*"Bbc", axis + '<mimic joint="A"/>')
    joints = [joint.replace("revolute", "prismatic") for joint in both]
    path = robot(tmp_path, A, B, LINK.format("c").replace('mass value="1"', 'mass value="2"'), *joints)
    with pytest.warns(UrdfNotice, match="mimic"):
        tied = load_urdf(path)
    for question in (inverse_dynamics(tied), hybrid_dynamics(tied, ["A"])):
        with pytest.raises(ModelError, match=r"^constraints\.B_mimic: 'B_mimic' restricts .* mimic=False"):
            compile(question, backend="python")
    with pytest.warns(UrdfNotice, match="mimic"):
        free = load_urdf(path, mimic=False)
    forces = compile(inverse_dynamics(free), backend="python")(0, [0.1, 0.2], [0, 0], [0.5, 0.25])
    assert forces == pytest.approx([3 * (0.5 + 9.81) + 2 * 0.25, 2 * (0.75 + 9.81)], rel=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ("A", "A", r":4:\d+: joint\.A\.mimic: it mimics itself: A -> A \(mimic=False"),
        ("nobody", "A", r":4:\d+: joint\.A\.mimic: no joint is called 'nobody' \(mimic=False"),
        ("B", "A", r":4:\d+: joint\.A\.mimic: it mimics itself: A -> B -> A \(mimic=False"),
    ],
)
def test_a_joint_mimics_another_one(first: str, second: str, message: str, tmp_path: Path) -> None:
    joints = (HINGE.format(name, *ends, f'<mimic joint="{other}"/>') for name, ends, other in
              (("A", "ab", first), ("B", "bc", second)))
    path = robot(tmp_path, A, B, *joints, LINK.format("c"))
    with pytest.raises(ModelError, match=message):
        load_urdf(path)
    with pytest.warns(UrdfNotice, match="^mimic is not applied: A, B$"):
        assert not load_urdf(path, mimic=False).constraints  # a robot of example-robot-data is such a file


def test_a_joint_in_a_plane_mimics_none(tmp_path: Path) -> None:
    other = HINGE.format("F", "a", "c", "").replace("revolute", "planar")
    path = robot(tmp_path, A, B, LINK.format("c"), HINGE.format("A", "a", "b", '<mimic joint="F"/>'), other)
    with pytest.warns(UrdfNotice, match="^mimic is not applied: A$"):
        assert not load_urdf(path).constraints


def test_what_mimics_a_fixed_joint_stays_at_its_offset(tmp_path: Path) -> None:
    fixed = HINGE.format("F", "a", "c", "").replace("revolute", "fixed")
    mimics = HINGE.format("A", "a", "b", '<mimic joint="F" offset="0.5"/>')
    path = robot(tmp_path, A, B, LINK.format("c"), fixed, mimics)
    with pytest.warns(UrdfNotice):
        coupler = load_urdf(path).constraints["A_mimic"]
    assert [*coupler.joints] == ["A"]
    assert coupler.value.shadow == 0.5


def test_what_is_not_imported_is_told() -> None:
    with pytest.warns(UrdfNotice) as told:
        load_urdf(ARM)
    notes = [str(note.message) for note in told]
    assert "not read: gazebo" in notes
    assert "friction is not applied: shoulder-pan" in notes
    assert any(note.startswith("damping is applied") for note in notes)


def test_joints_without_mass_are_told(tmp_path: Path) -> None:
    links = [LINK.format("a"), '<link name="b"/>', '<link name="c"/>', '<link name="d"/>', LINK.format("e")]
    joints = [HINGE.format(name, *ends, "") for name, ends in {"A": "ab", "B": "bc", "C": "ad", "D": "de"}.items()]
    with pytest.warns(UrdfNotice, match="^moving joints that carry no mass: A, B$"):
        load_urdf(robot(tmp_path, *links, *joints))


def test_strange_inertias_are_told(tmp_path: Path) -> None:
    bent = LINK.replace('izz="1"', 'izz="2.1"').format("bent")
    bare = LINK.replace('mass value="1"', 'mass value="0"').format("bare")
    path = robot(tmp_path, bent, bare, HINGE.format("A", "bent", "bare", ""))
    with pytest.warns(UrdfNotice) as told:
        load_urdf(path)
    notes = [str(note.message) for note in told]
    assert notes == ["an inertia that no body can have: bent", "inertia without mass: bare"]


# --- mistakes ---------------------------------------------------------------------------------------------------

BACK = HINGE.format("B", "b", "a", "")
A, B = LINK.format("a"), LINK.format("b")
MISTAKES = {
    "4:1: joint.A: its parent: no link is called 'x'": [A, B, HINGE.format("A", "x", "b", "")],
    "2:1: link.a: it carries itself: a <- b <- a": [A, B, HINGE.format("A", "a", "b", ""), BACK],
    "3:1: link.b: no joint carries this link, nor 'a'": [A, B],
    "3:1: link: 'a' stands here a second time; first in line 2": [A, A],
    "5:1: joint.B: 'b' is carried by joint 'A' already": [A, B, *(HINGE.format(j, "a", "b", "") for j in "AB")],
    "4:68: joint.A.origin.xyz: '1,2' is not a number": [A, B, HINGE.format("A", "a", "b", '<origin xyz="1,2 0 0"/>')],
    "joint.A.origin.xyz: 'nan' is not a number": [A, B, HINGE.format("A", "a", "b", '<origin xyz="0 0 nan"/>')],
    "joint.A.origin.xyz: expected 3 numbers, got 2": [A, B, HINGE.format("A", "a", "b", '<origin xyz="0 0"/>')],
    "'${d}' is not a number; run xacro": [A, B, HINGE.format("A", "a", "b", '<origin xyz="0 0 ${d}"/>')],
    "joint.A.axis: the axis is zero": [A, B, HINGE.format("A", "a", "b", '<axis xyz="0 0 0"/>')],
    "link.a.inertial.mass: a mass is not negative": [A.replace('mass value="1"', 'mass value="-1"')],
    "link.a.inertial: <inertial> needs a <mass>": [A.replace('<mass value="1"/>', "")],
    "joint.A: 'hinge' is no type of joint": [A, B, HINGE.format("A", "a", "b", "").replace("revolute", "hinge")],
    "joint.A: <joint> needs a <child>": [A, B, HINGE.format("A", "a", "b", "").replace("child", "daughter")],
    "<joint> needs name=": [A, B, HINGE.format("A", "a", "b", "").replace(' name="A"', "")],
    "joint.A.axis: <axis> stands here a second time": [A, B, HINGE.format("A", "a", "b", "<axis/><axis/>")],
    "joint.A.limit: the lower limit 1 is above": [A, B, HINGE.format("A", "a", "b", '<limit lower="1"/>')],
    "1:1: this <robot> has no <link>": [],
    "<xacro:macro> is not expanded yet": ["<xacro:macro/>"],
    "this is not XML: mismatched tag": ["<link>"],
}


@pytest.mark.parametrize("message", MISTAKES)
def test_a_mistake_has_its_place(message: str, tmp_path: Path) -> None:
    path = robot(tmp_path, *MISTAKES[message])
    with pytest.raises(InputError) as caught:
        load_urdf(path)
    assert str(caught.value).startswith(f"{path}:")
    assert message in str(caught.value)


HOSTILE = {
    "DOCTYPE": b'<!DOCTYPE r [<!ENTITY a "b">]><robot name="&a;"/>',
    "DOCTYPE, and": b'<!DOCTYPE r SYSTEM "file:///etc/passwd"><robot/>',
    "inside each other": b"<a>" * 200_000,
    "or 200000 in all": b"<a>" + b"<b/>" * 200_001,
    "undefined entity": b"<robot name='&lol;'/>",
    "encoding": b"<?xml version='1.0' encoding='utf-7'?><robot/>",
    "not XML": b"\x00" * 50,
    "holds a <robot>, this one a <sdf>": b"<sdf/>",
    "at most": b" " * (1 << 25),
}


@pytest.mark.parametrize("message", HOSTILE)
def test_hostile_files_are_refused(message: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_bytes(HOSTILE[message])
    with pytest.raises(InputError, match=message):
        load_urdf(path)


def test_load_says_what_reads_urdf() -> None:
    with pytest.raises(InputError, match="load_urdf"):
        load(ARM)


def assert_harmless(tmp_path: Path, seed: int, count: int) -> None:
    result = verdict(MUTATE, tmp_path, [seed, count, ARM])
    assert result["wrong"] == []
    assert result["events"] == []
    assert 0.1 * count < result["read"] < 0.9 * count
    assert sorted(os.listdir(tmp_path)) == ["robot.urdf", "tried"]


def test_damaged_files(tmp_path: Path) -> None:
    assert_harmless(tmp_path, 1, 100)


@pytest.mark.long
def test_many_damaged_urdf_files(tmp_path: Path) -> None:
    assert_harmless(tmp_path, 10_000, 10_000)


def test_a_robot_whose_shapes_are_meshes_says_that_these_are_not_read(tmp_path: Path) -> None:
    mesh = '<visual><geometry><mesh filename="base.stl"/></geometry></visual>'
    (tmp_path / "r.urdf").write_text(f'<robot name="r"><link name="base">{mesh}</link></robot>')
    with pytest.warns(UrdfNotice, match=r"meshes are not read \(declare surfaces for contacts\): base"):
        load_urdf(tmp_path / "r.urdf")
