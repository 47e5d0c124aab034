"""URDF robot descriptions as Systems: links become bodies, and joints keep their names.

The frame of a link is that of the joint that carries it.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import PurePath
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import InputError
from multibody_sym.formats.files import path_name, read_content
from multibody_sym.formats.urdf_file import (
    ONE_COORDINATE,
    Inertial,
    Mimic,
    Origin,
    Robot,
    Triple,
    UrdfJoint,
    read_robot,
)
from multibody_sym.formats.xml_tree import LARGEST_FILE, read_xml
from multibody_sym.model.declaration import doors
from multibody_sym.model.declaration.bodies import Frame
from multibody_sym.model.declaration.fields import Record
from multibody_sym.model.declaration.file_tree import VERSION, system_from_tree
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.joints import JOINTS
from multibody_sym.model.declaration.system import RESERVED, System
from multibody_sym.model.mechanism.mass import GROUND, pose_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, Node

Matrix = NDArray[np.float64]
Tree = dict[str, Any]

RIGHT_ANGLE: Final = 1e-9
"""Angles this near to a multiple of 90 degrees (rad), and unit axes this near to x, y or z, are exactly that."""
_GRAVITY: Final = (0, 0, -9.81)
_MOST_NAMED: Final = 4
_ROUNDING: Final = 1e-3
_ELEMENTS: Final = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


class UrdfNotice(UserWarning):
    """What a URDF file says that its System does not, what the System says beyond it, and what is odd in it."""


def load_urdf(
    path: str | os.PathLike[str], *, floating: bool = False, damping: bool = True, mimic: bool = True
) -> System:
    """Return the System that the URDF file at `path` describes, with gravity 9.81 m/s^2 along -z.

    The root link is fixed to ground, or free to move if `floating`. Joints with `damping` get dampers, unless it is
    False (Drake applies them, Pinocchio does not), those that `mimic` another one a coupler (Pinocchio leaves them
    free). Angles within 1e-9 of a multiple of 90 degrees are exactly that. Friction in joints is not read; a UrdfNotice
    says so.

    Raises InputError (with file, line and column) for a file that cannot be read or whose links make no tree.
    """
    name = path_name(path, "a robot description")
    given = {"floating": floating, "damping": damping, "mimic": mimic}
    floating, damping, mimic = (doors.flag(key, value) for key, value in given.items())
    try:
        robot = read_robot(read_xml(read_content(name, LARGEST_FILE), name), PurePath(name).stem)
        system = system_from_tree(tree_of(robot, floating=floating, damping=damping, mimic=mimic))
    except InputError as error:
        raise error.located(file=name) from None
    for note in notes(robot, damping=damping, mimic=mimic):
        warnings.warn(note, UrdfNotice, stacklevel=3)  # past the door of public functions
    return system


def tree_of(robot: Robot, *, floating: bool, damping: bool, mimic: bool) -> Tree:
    """Return the content of a model file that describes a robot."""
    bodies = _body_names(robot)
    attached = _attached(robot, bodies)
    return {
        "multibody_sym": VERSION,
        "name": robot.name,
        "gravity": _GRAVITY,
        "bodies": {bodies[link]: _body(inertial, attached.frames[link]) for link, inertial in robot.links.items()},
        "joints": _named(_joints(robot, bodies, attached, floating)),
        "forces": _dampers(robot) if damping else {},
        "constraints": _couplers(robot) if mimic else {},
    }


# --- links ------------------------------------------------------------------------------------------------------


def _body_names(robot: Robot) -> dict[str, str]:
    """Return the bodies' names: those of the links, none of which is the ground."""
    return {link: _unique(f"{link}_link", robot.links) if link == GROUND else link for link in robot.links}


def _unique(wanted: str, taken: Collection[str]) -> str:
    while wanted in taken:
        wanted += "_"
    return wanted


def _body(inertial: Inertial | None, frames: Mapping[str, Tree]) -> Tree:
    """Return a link as a body; without mass and inertia it is massless."""
    body: Tree = {
        "points": {name: frame["position"] for name, frame in frames.items() if not frame["rotate"]},
        "frames": {name: frame for name, frame in frames.items() if frame["rotate"]},
    }
    if inertial is None or not (inertial.mass or any(inertial.inertia)):
        return body
    if any(inertial.origin.xyz):
        body["com"] = inertial.origin.xyz
    if any(inertial.inertia):
        body["inertia"] = _in_body_axes(inertial)
    return {"mass": inertial.mass, **body}


def _in_body_axes(inertial: Inertial) -> tuple[float, ...]:
    """Return R J R^T (Ixx, Iyy, Izz, Ixy, Ixz, Iyz): as it is written where the axes are those of the body."""
    turns = _turns(inertial.origin)
    if not turns:
        return inertial.inertia
    frame = Record(Frame).accept({"rotate": turns})
    assert isinstance(frame, Frame)
    R = np.array([[x.shadow for x in row] for row in pose_of(frame).rotation], dtype=float)
    J = R @ _matrix(inertial.inertia) @ R.T
    return tuple(float(J[i, k]) for i, k in _ELEMENTS)


def _matrix(inertia: Sequence[float]) -> Matrix:
    J = np.empty((3, 3))
    for (i, k), element in zip(_ELEMENTS, inertia, strict=True):
        J[i, k] = J[k, i] = element
    return J


# --- joints -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Attached:
    """Where joints attach: the frames of each link by name, and each joint's parent and child as `body.frame`."""

    frames: Mapping[str, Mapping[str, Tree]]
    ends: Mapping[str, Tree]


def _attached(robot: Robot, bodies: Mapping[str, str]) -> _Attached:
    frames: dict[str, dict[str, Tree]] = {link: {} for link in robot.links}
    taken = set(bodies.values())

    def reference(link: str, joint: str, position: Triple, rotate: list[Tree]) -> str:
        if not rotate and not any(position):
            return bodies[link]
        name = joint.replace(".", "_")
        while name in frames[link] or f"{bodies[link]}.{name}" in taken:
            name += "_"
        frames[link][name] = {"position": position, "rotate": rotate}
        return f"{bodies[link]}.{name}"

    ends = {}
    for name, joint in robot.joints.items():
        tilt = _tilt(joint.axis) if joint.type == "planar" else []
        parent = reference(joint.parent, name, joint.origin.xyz, [*_turns(joint.origin), *tilt])
        ends[name] = {"parent": parent, "child": reference(joint.child, name, (0.0, 0.0, 0.0), tilt)}
    return _Attached(frames, ends)


def _joints(robot: Robot, bodies: Mapping[str, str], attached: _Attached, floating: bool) -> dict[str, Tree]:
    """Return the joints by name: that of the root first, which carries the root's name."""
    kind = "free" if floating else "fixed"
    root = {"type": kind, "parent": GROUND, "child": bodies[robot.root]}
    joints: dict[str, Tree] = {_unique(robot.root, robot.joints): root}
    for name, joint in robot.joints.items():
        joints[name] = {"type": joint.type, **attached.ends[name]}
        if joint.type in ONE_COORDINATE:
            joints[name]["axis"] = _unit(joint.axis)
            joints[name] |= _limits(joint)
    return joints


def _limits(joint: UrdfJoint) -> Tree:
    limits = {key: bound for key, bound in vars(joint.limits).items() if bound is not None}
    return {"limits": {**limits, "acts": False}} if limits else {}


def _named(joints: Mapping[str, Tree]) -> dict[str, Tree]:
    """Return the joints with coordinates whose names are symbols; a ball's speeds take theirs from the joint itself."""
    taken, named = set(RESERVED), dict[str, Tree]()
    for name, tree in joints.items():
        joint = JOINTS.accept(tree)
        assert isinstance(joint, Joint)
        word = re.sub("[^A-Za-z0-9_]", "_", name)
        stem = word if word[0].isalpha() else f"q_{word}"
        while taken & _symbols(stem, joint) or (stem != name and stem in joints):
            stem += "_"
        taken |= _symbols(stem, joint)
        coordinates = [stem + suffix for suffix in joint.coordinate_suffixes]
        own_speeds = any(suffix is not None for suffix in joint.speed_suffixes)
        if own_speeds or stem == name or not coordinates:
            named[stem if own_speeds else name] = tree
        else:
            named[name] = {**tree, "q": coordinates}
    return named


def _symbols(stem: str, joint: Joint) -> set[str]:
    """Return the names of coordinates and speeds that begin with `stem`."""
    coordinates = [stem + suffix for suffix in joint.coordinate_suffixes]
    return {*coordinates, *(f"u_{q}" for q in coordinates), *(stem + s for s in joint.speed_suffixes if s is not None)}


def _dampers(robot: Robot) -> Tree:
    """Return a damper for each joint with damping that one coordinate describes."""
    return {
        f"{name}_damping": {"type": "damper", "damping": joint.damping, "joint": name}
        for name, joint in _damped(robot).items()
    }


def _damped(robot: Robot) -> dict[str, UrdfJoint]:
    return {name: joint for name, joint in robot.joints.items() if joint.damping and joint.type in ONE_COORDINATE}


def _couplers(robot: Robot) -> Tree:
    """Return q - multiplier (q of the other joint) = offset for each joint that mimics one."""
    return {
        f"{name}_mimic": {"type": "coupler", "joints": _factors(robot, name, mimic), "value": mimic.offset}
        for name, mimic in _mimics(robot).items()
    }


def _factors(robot: Robot, name: str, mimic: Mimic) -> dict[str, float]:
    moves = robot.joints[mimic.joint].type in ONE_COORDINATE  # the coordinate of a fixed joint is zero
    return {name: 1.0, mimic.joint: -mimic.multiplier} if moves else {name: 1.0}


def _mimics(robot: Robot) -> dict[str, Mimic]:
    """Return what joints with one coordinate mimic, where that is another joint with one coordinate at most."""
    possible = {name for name, joint in robot.joints.items() if joint.type in (*ONE_COORDINATE, "fixed")}
    return {
        name: joint.mimic
        for name, joint in robot.joints.items()
        if joint.type in ONE_COORDINATE and joint.mimic and joint.mimic.joint in possible - {name}
    }


# --- directions -------------------------------------------------------------------------------------------------


def _turns(origin: Origin) -> list[Tree]:
    """Return a rotation as turns, each about axes that the ones before have turned: yaw, pitch, roll."""
    angles = [(axis, _angle(angle)) for axis, angle in zip("zyx", reversed(origin.rpy), strict=True)]
    return [{"axis": axis, "angle": angle} for axis, angle in angles if angle]


def _angle(angle: float) -> float | Node:
    """Return an angle, as a multiple of pi/2 where it is that but for rounding."""
    off = math.remainder(angle, math.pi / 2)
    if abs(off) > RIGHT_ANGLE:
        return angle
    return (0.0, PI / 2, PI, -PI / 2)[round((angle - off) / (math.pi / 2)) % 4]


def _unit(axis: Triple) -> Sequence[float]:
    """Return an axis as x, y, z, -x, -y or -z where it is that but for rounding, else as it is written."""
    length = math.hypot(*axis)
    near = [round(component / length) for component in axis]
    off = max(abs(component / length - whole) for component, whole in zip(axis, near, strict=True))
    return near if off <= RIGHT_ANGLE else axis


def _tilt(normal: Triple) -> list[Tree]:
    """Return the turn that carries z to a direction."""
    x, y, z = normal
    angle = _angle(math.atan2(math.hypot(x, y), z))
    return [{"axis": [-y, x, 0] if x or y else "x", "angle": angle}] if angle else []


# --- notes ------------------------------------------------------------------------------------------------------


def notes(robot: Robot, *, damping: bool, mimic: bool) -> list[str]:
    """Return what there is to say about a file, one line a kind."""
    joints = robot.joints.items()
    inertials = {link: inertial for link, inertial in robot.links.items() if inertial}
    damped = "damping is applied (other programs may ignore it): " if damping else "damping is not applied: "
    coupled = _mimics(robot) if mimic else {}
    kinds = {
        "not read: ": list(robot.skipped),
        "meshes are not read (declare surfaces for contacts): ": list(robot.meshed),
        "friction is not applied: ": [name for name, joint in joints if joint.friction],
        damped: list(_damped(robot)),
        "damping of joints with several freedoms is not applied: ": [
            name for name, joint in joints if joint.damping and joint.type in ("floating", "planar")
        ],
        "mimic ties joints (other programs may leave them free): ": list(coupled),
        "mimic is not applied: ": [
            name for name, joint in joints if joint.mimic and joint.type != "fixed" and name not in coupled
        ],
        "an inertia that no body can have: ": [link for link, x in inertials.items() if not _possible(x)],
        "moving joints that carry no mass: ": _without_mass(robot),
        "inertia without mass: ": [link for link, x in inertials.items() if any(x.inertia) and not x.mass],
    }
    return [what + _some(names) for what, names in kinds.items() if names]


def _without_mass(robot: Robot) -> list[str]:
    """Return the joints that can move, and beyond which no link has a mass or an inertia."""
    parents = {joint.child: joint.parent for joint in robot.joints.values()}
    heavy: set[str] = set()
    for link, inertial in robot.links.items():
        if inertial is not None and (inertial.mass or any(inertial.inertia)):
            while link in parents and link not in heavy:
                heavy.add(link)
                link = parents[link]
    return [name for name, joint in robot.joints.items() if joint.type != "fixed" and joint.child not in heavy]


def _possible(inertial: Inertial) -> bool:
    """Return whether the principal moments are those of some mass: 0 <= a <= b <= c <= a + b, but for rounding."""
    a, b, c = np.linalg.eigvalsh(_matrix(inertial.inertia))
    return bool(a >= -_ROUNDING * c and a + b >= c * (1 - _ROUNDING))


def _some(names: list[str]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
