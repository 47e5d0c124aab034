"""URDF robot descriptions as Systems: links become bodies, and joints keep their names.

The frame of a link is that of the joint that carries it.
"""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field
from pathlib import PurePath
from typing import Any, Final
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import InputError, ModelError, Where
from multibody_sym.model import argument_checks
from multibody_sym.model.bodies import GROUND, Frame, pose_of
from multibody_sym.model.fields import Record, Text
from multibody_sym.model.joints import JOINTS, Joint
from multibody_sym.model.system import RESERVED, VERSION, System, system_from_tree
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import PI, Node
from multibody_sym.text.files import path_name, read_content

# ----------------------------------------------------------------------------------------------------------------------
# XML to a plain tree of elements with their places; nothing but the given bytes is ever read.
#
# Document type declarations are refused, and with them entities, external files and every way to make a small text
# large.


LARGEST_FILE: Final = 1 << 24
DEEPEST: Final = 100
MOST_ELEMENTS: Final = 200_000


@dataclass(frozen=True)
class XmlElement:
    """An element: its tag, attributes and children in order, and where it begins (line and column from 1)."""

    tag: str
    attributes: Mapping[str, str]
    line: int
    column: int
    children: list[XmlElement] = field(default_factory=list)

    def named(self, tag: str) -> list[XmlElement]:
        return [child for child in self.children if child.tag == tag]


def read_xml(content: bytes, name: str) -> XmlElement:
    """Return the root element of an XML file's bytes; `name` stands in the errors.

    Raises InputError (with line and column) for what is not XML, and for what is too large, too deep or has a DOCTYPE.
    """
    if len(content) > LARGEST_FILE:
        message = f"a file of this kind has at most {LARGEST_FILE} bytes"
        raise InputError(message, where=Where(file=name, line=1, column=1), number="F105")
    builder = _Builder()
    try:
        builder.parser.Parse(content, True)
    except expat.ExpatError as error:
        where = Where(file=name, line=error.lineno, column=error.offset + 1)
        raise InputError(f"this is not XML: {expat.ErrorString(error.code)}", where=where, number="F105") from None
    except (LookupError, ValueError) as error:
        raise InputError(
            f"the encoding cannot be read: {error}", where=Where(file=name, line=1, column=1), number="F105"
        ) from None
    except InputError as error:
        raise error.located(file=name) from None
    return builder.root[0]


class _Builder:
    """Expat's handlers, which build the tree."""

    def __init__(self) -> None:
        self.root: list[XmlElement] = []
        self.open: list[XmlElement] = []
        self.count = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.StartDoctypeDeclHandler = self.doctype

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if len(self.open) == DEEPEST or self.count > MOST_ELEMENTS:
            raise self.refused(f"more than {DEEPEST} elements inside each other, or {MOST_ELEMENTS} in all")
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        element = XmlElement(tag, attributes, line, column)
        (self.open[-1].children if self.open else self.root).append(element)
        self.open.append(element)

    def end(self, _tag: str) -> None:
        self.open.pop()

    def doctype(self, *_declared: Any) -> None:
        raise self.refused("a DOCTYPE, and with it entities, has no place here; remove it")

    def refused(self, message: str) -> InputError:
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        return InputError(message, where=Where(line=line, column=column), number="F105")


# ----------------------------------------------------------------------------------------------------------------------
# What a URDF file says about dynamics: links with inertia and joints, checked, every error with line and column.
#
# Visual and collision geometry and simulators' own elements are not read, of transmissions the joints that they drive;
# meshes are never opened.
# Source: the specification at http://wiki.ros.org/urdf/XML.


Triple = tuple[float, float, float]

ONE_COORDINATE: Final = ("revolute", "continuous", "prismatic")
JOINT_TYPES: Final = (*ONE_COORDINATE, "fixed", "floating", "planar")
_READ: Final = ("link", "joint", "material", "transmission")
_WITHOUT_MIMIC: Final = "mimic=False, or --no-mimic, leaves joints free"
"""The remedy in errors about what joints mimic."""
_DECIMAL: Final = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_LARGEST: Final = 1e100  # its square is a number yet
_INERTIA: Final = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True)
class Origin:
    """A pose: position, and roll, pitch, yaw about fixed axes, R = Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz: Triple = (0.0, 0.0, 0.0)
    rpy: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Inertial:
    """Mass and inertia (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) about the centre of mass, in the axes of `origin`."""

    mass: float
    inertia: tuple[float, ...]
    origin: Origin


@dataclass(frozen=True)
class Mimic:
    """q = multiplier (q of `joint`) + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of the file; the frame of the child is at `origin` in that of the parent, at zero coordinates.

    `limits` holds those that it has: lower, upper, velocity, effort.
    """

    type: str
    parent: str
    child: str
    origin: Origin
    axis: Triple
    damping: float
    friction: float
    limits: Mapping[str, float]
    mimic: Mimic | None


@dataclass(frozen=True)
class Robot:
    """Links and joints by name in the order of the file; `root` is the link that no joint carries.

    `skipped` names the kinds of elements beside links and joints that were not read, `meshed` the links with meshes,
    `driven` the joints that transmissions drive.
    """

    name: str
    links: Mapping[str, Inertial | None]
    joints: Mapping[str, UrdfJoint]
    root: str
    skipped: tuple[str, ...]
    meshed: tuple[str, ...] = ()
    driven: tuple[str, ...] = ()

    @property
    def moved_by_one(self) -> dict[str, UrdfJoint]:
        """The joints with one coordinate."""
        return {name: joint for name, joint in self.joints.items() if joint.type in ONE_COORDINATE}


def read_robot(tree: XmlElement, file_name: str, *, mimic: bool) -> Robot:
    """Return the robot that a file describes; it is called `file_name` where the file does not say.

    Raises ModelError with line and column for missing and wrong values, for links that make no tree, and where `mimic`
    is to be applied for a joint that mimics itself or one that is not there.
    """
    with _inside(tree):
        if tree.tag != "robot":
            raise ModelError(f"a URDF file holds a <robot>, this one a <{tree.tag}>", number="F105")
        unexpanded = [child.tag for child in tree.children if child.tag.startswith("xacro:")]
        if unexpanded:
            raise ModelError(f"<{unexpanded[0]}> is not expanded yet; run xacro on the file first", number="F105")
        if not tree.named("link"):
            raise ModelError("this <robot> has no <link>; did the program that wrote the file fail?", number="F105")
        name = Text().accept(tree.attributes.get("name", "").strip() or file_name)
    links, elements = _by_name(tree, "link"), _by_name(tree, "joint")
    joints = {joint: _read_joint(joint, element) for joint, element in elements.items()}
    for joint, element in elements.items():
        with _inside(element, "joint", joint):
            for end, link in (("parent", joints[joint].parent), ("child", joints[joint].child)):
                if link not in links:
                    raise ModelError(f"its {end}: no link is called {link!r}", number="M106", word=link, known=links)
    if mimic:
        _verify_mimics(elements, joints)
    skipped = tuple(dict.fromkeys(child.tag for child in tree.children if child.tag not in _READ))
    masses = {link: _read_inertial(link, element) for link, element in links.items()}
    meshed = []
    for link, element in links.items():
        geometries = [geometry for part in element.children for geometry in part.named("geometry")]
        if any(geometry.named("mesh") for geometry in geometries):
            meshed.append(link)
    ends = (end for transmission in tree.named("transmission") for end in transmission.named("joint"))
    driven = tuple(dict.fromkeys(end.attributes.get("name", "").strip() for end in ends))
    return Robot(name, masses, joints, _find_root(links, elements, joints), skipped, tuple(meshed), driven)


@contextmanager
def _inside(element: XmlElement, *path: str) -> Iterator[None]:
    """Give errors raised inside the place of `element`, unless they have one, and its path."""
    try:
        yield
    except InputError as error:
        error.located(line=element.line, column=element.column)
        for step in reversed(path):
            error.under(step)
        raise


def _by_name(tree: XmlElement, tag: str) -> dict[str, XmlElement]:
    found: dict[str, XmlElement] = {}
    for element in tree.named(tag):
        with _inside(element, tag):
            name = Text().accept(_attribute(element, "name"))
            if name in found:
                raise ModelError(f"{name!r} stands here a second time; first in line {found[name].line}", number="M108")
            found[name] = element
    return found


def _read_inertial(name: str, link: XmlElement) -> Inertial | None:
    with _inside(link, "link", name):
        inertial = _child(link, "inertial")
        if inertial is None:
            return None
        with _inside(inertial, "inertial"):
            mass, inertia = _require_child(inertial, "mass"), _require_child(inertial, "inertia")
            value = _number(mass, "value")
            if value < 0:
                with _inside(mass, "mass"):
                    raise ModelError(f"a mass is not negative, this one is {value:g}", number="M109")
            return Inertial(value, tuple(_number(inertia, key, "0") for key in _INERTIA), _origin(inertial))


def _read_joint(name: str, joint: XmlElement) -> UrdfJoint:
    with _inside(joint, "joint", name):
        kind = _attribute(joint, "type")
        if kind not in JOINT_TYPES:
            raise ModelError(f"{kind!r} is no type of joint", number="M106", word=kind, known=JOINT_TYPES)
        dynamics = _child(joint, "dynamics")
        parent, child = (_attribute(_require_child(joint, end), "link").strip() for end in ("parent", "child"))
        origin, axis, mimic = _origin(joint), (1.0, 0.0, 0.0), None
        if kind not in ("fixed", "floating") and (direction := _child(joint, "axis")) is not None:
            axis = _triple(direction, "xyz", "1 0 0")
            if math.hypot(*axis) == 0:
                with _inside(direction, "axis"):
                    raise ModelError("the axis is zero", number="F105")
        damping, friction = (_number(dynamics, key, "0") if dynamics else 0.0 for key in ("damping", "friction"))
        limits = _read_limits(joint, kind)
        if (coupling := _child(joint, "mimic")) is not None:
            with _inside(coupling, "mimic"):
                other = _attribute(coupling, "joint").strip()
                mimic = Mimic(other, _number(coupling, "multiplier", "1"), _number(coupling, "offset", "0"))
        return UrdfJoint(kind, parent, child, origin, axis, damping, friction, limits, mimic)


def _origin(element: XmlElement) -> Origin:
    origin = _child(element, "origin")
    return Origin() if origin is None else Origin(_triple(origin, "xyz"), _triple(origin, "rpy"))


def _read_limits(joint: XmlElement, kind: str) -> dict[str, float]:
    """Return what <limit> says; a speed or effort of zero stands for none, a bound that is left out for zero."""
    element = _child(joint, "limit")
    if element is None or kind not in ONE_COORDINATE:
        return {}
    strengths = {key: x for key in ("velocity", "effort") if (x := _number(element, key, "0"))}
    if kind == "continuous" or not {"lower", "upper"} & set(element.attributes):
        return strengths
    lower, upper = _number(element, "lower", "0"), _number(element, "upper", "0")
    if lower > upper:
        with _inside(element, "limit"):
            raise ModelError(f"the lower limit {lower:g} is above the upper one {upper:g}", number="M109")
    return {"lower": lower, "upper": upper, **strengths}


def _child(element: XmlElement, tag: str) -> XmlElement | None:
    found = element.named(tag)
    if len(found) > 1:
        with _inside(found[1], tag):
            raise ModelError(f"<{tag}> stands here a second time; first in line {found[0].line}", number="M108")
    return found[0] if found else None


def _require_child(element: XmlElement, tag: str) -> XmlElement:
    found = _child(element, tag)
    if found is None:
        raise ModelError(f"<{element.tag}> needs a <{tag}>", number="F105")
    return found


def _attribute(element: XmlElement, key: str) -> str:
    if key not in element.attributes:
        with _inside(element):
            raise ModelError(f"<{element.tag}> needs {key}=", number="F105")
    return element.attributes[key]


def _number(element: XmlElement, key: str, default: str | None = None) -> float:
    return _numbers(element, key, 1, default)[0]


def _triple(element: XmlElement, key: str, default: str = "0 0 0") -> Triple:
    x, y, z = _numbers(element, key, 3, default)
    return x, y, z


def _numbers(element: XmlElement, key: str, count: int, default: str | None) -> list[float]:
    """Return the numbers of an attribute: decimal, as many as are wanted; what is nearly nothing is zero."""
    with _inside(element, element.tag, key):
        words = (_attribute(element, key) if default is None else element.attributes.get(key, default)).split()
        for word in words:
            if not _DECIMAL.fullmatch(word):
                hint = "; run xacro on the file first" if "$" in word else ""
                raise ModelError(f"{word[:40]!r} is not a number{hint}", number="F105")
            if abs(float(word)) > _LARGEST:
                raise ModelError(f"{word[:40]} is too large", number="F105")
        if len(words) != count:
            raise ModelError(f"expected {count} number{'s' if count > 1 else ''}, got {len(words)}", number="M103")
    return [float(word) if abs(float(word)) > 1 / _LARGEST else 0.0 for word in words]


def _find_root(
    links: Mapping[str, XmlElement], elements: Mapping[str, XmlElement], joints: Mapping[str, UrdfJoint]
) -> str:
    """Return the link that no joint carries; raise unless the links make a tree upon it."""
    carrier: dict[str, str] = {}
    for name, joint in joints.items():
        if joint.child in carrier:
            with _inside(elements[name], "joint", name):
                raise ModelError(
                    f"{joint.child!r} is carried by joint {carrier[joint.child]!r} already: no tree", number="F105"
                )
        carrier[joint.child] = name
    roots = [link for link in links if link not in carrier]
    if len(roots) > 1:
        with _inside(links[roots[1]], "link", roots[1]):
            raise ModelError(f"no joint carries this link, nor {roots[0]!r}; a robot has one root", number="F105")
    parents = {link: joints[carrier[link]].parent for link in links if link in carrier}
    loop = _loop(parents)
    if loop:
        with _inside(links[loop[0]], "link", loop[0]):
            raise ModelError(f"it carries itself: {' <- '.join([*loop, loop[0]][:6])}", number="F105")
    return roots[0]


def _verify_mimics(elements: Mapping[str, XmlElement], joints: Mapping[str, UrdfJoint]) -> None:
    """Raise ModelError where a joint mimics one that the file does not have, or joints mimic each other in a loop."""
    others = {name: joint.mimic.joint for name, joint in joints.items() if joint.mimic}
    loop = _loop(others)
    for name, other in others.items():
        with _inside(_require_child(elements[name], "mimic"), "joint", name, "mimic"):
            if other not in joints:
                message = f"no joint is called {other!r} ({_WITHOUT_MIMIC})"
                raise ModelError(message, number="M106", word=other, known=joints)
            if loop[:1] == [name]:
                message = f"it mimics itself: {' -> '.join([*loop, name][:6])} ({_WITHOUT_MIMIC})"
                raise ModelError(message, number="F105")


def _loop(parents: Mapping[str, str]) -> list[str]:
    """Return names of which each is the parent of the one before, the last's the first; empty where there are none."""
    grounded: set[str] = set()
    for start in parents:
        path: dict[str, None] = {}
        link = start
        while link in parents and link not in grounded:
            if link in path:
                return list(path)[list(path).index(link) :]
            path[link] = None
            link = parents[link]
        grounded.update(path)
    return []


# ----------------------------------------------------------------------------------------------------------------------

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
    path: str | os.PathLike[str],
    *,
    floating: bool = False,
    damping: bool = True,
    mimic: bool = True,
    torques: bool = False,
    friction: bool = False,
) -> System:
    """Return the System that the URDF file at `path` describes, with gravity 9.81 m/s^2 along -z.

    The root link is fixed to ground, or free to move if `floating`. Joints with `damping` get dampers, unless it is
    False (Drake applies them, Pinocchio does not), those that `mimic` another one a coupler (Pinocchio leaves them
    free). With `torques` each joint with one coordinate that mimics none, and that a transmission drives if there are
    any, has an input tau_<coordinate>, zero unless it is given: its torque (N m) or, of a slide, force (N), whose limit
    is `system.joints[name].limits.effort`. Angles within 1e-9 of a multiple of 90 degrees are exactly that. With
    `friction` joints rub with the constant force or moment that the file gives; else a UrdfNotice names them.

    Raises InputError (with file, line and column) for a file that cannot be read, whose links make no tree, or in which
    a joint mimics itself or one that is not there, unless `mimic` is False.
    """
    name = path_name(path, "a robot description")
    given = {"floating": floating, "damping": damping, "mimic": mimic, "torques": torques, "friction": friction}
    chosen = {key: argument_checks.flag(key, value) for key, value in given.items()}
    try:
        robot = read_robot(read_xml(read_content(name, LARGEST_FILE), name), PurePath(name).stem, mimic=chosen["mimic"])
        system = system_from_tree(tree_of(robot, **chosen))
    except InputError as error:
        raise error.located(file=name) from None
    for note in notes(robot, **{name: chosen[name] for name in ("damping", "mimic", "friction")}):
        warnings.warn(note, UrdfNotice, stacklevel=3)  # past the door of public functions
    return system


def tree_of(
    robot: Robot, *, floating: bool, damping: bool, mimic: bool, torques: bool = False, friction: bool = False
) -> Tree:
    """Return the content of a model file that describes a robot.

    A link without mass and inertia is a massless body. Joints with damping or friction that one coordinate describes
    get dampers and friction; a mimic is q - multiplier (q of the other joint) = offset.
    """
    bodies = {link: _unique(f"{link}_link", robot.links) if link == GROUND else link for link in robot.links}
    frames, ends = _attach_joints(robot, bodies)
    dampers, couplers = {}, {}
    moving = robot.moved_by_one
    for name, joint in moving.items():
        if damping and joint.damping:
            dampers[f"{name}_damping"] = {"type": "damper", "damping": joint.damping, "joint": name}
    for name, joint in moving.items():
        if friction and joint.friction:
            dampers[f"{name}_friction"] = {"type": "friction", "joint": name, "force": joint.friction}
    for name, other in _mimics(robot).items() if mimic else ():
        factors = {name: 1.0, other.joint: -other.multiplier}
        if other.joint not in moving:  # the coordinate of a fixed joint is zero
            del factors[other.joint]
        couplers[f"{name}_mimic"] = {"type": "coupler", "joints": factors, "value": other.offset}
    joints = _with_symbols(_declare_joints(robot, bodies, ends, floating))
    inputs = _torque_inputs(robot, joints, couplers) if torques else {}
    drives = {f"{name}_torque": {"type": "torque", "joint": name, "value": tau} for name, tau in inputs.items()}
    return {
        "multibody_sym": VERSION,
        "name": robot.name,
        "gravity": _GRAVITY,
        "bodies": {bodies[link]: _declare_body(x, frames[link]) for link, x in robot.links.items()},
        "joints": joints,
        "inputs": dict.fromkeys(inputs.values(), 0),
        "forces": dampers | drives,
        "constraints": couplers,
    }


def _torque_inputs(robot: Robot, joints: Mapping[str, Tree], couplers: Mapping[str, Tree]) -> dict[str, str]:
    """Return the name of the input that drives each joint with one coordinate that mimics none.

    Where the file has transmissions those are the joints that they drive.
    """
    moving = (name for name in robot.moved_by_one if name in robot.driven or not robot.driven)
    driven = [name for name in moving if f"{name}_mimic" not in couplers]
    symbols = {q for name, tree in joints.items() for q in tree.get("q", [name])}
    return {name: _unique(f"tau_{joints[name].get('q', [name])[0]}", symbols) for name in driven}


def _unique(wanted: str, taken: Collection[str]) -> str:
    while wanted in taken:
        wanted += "_"
    return wanted


def _declare_body(inertial: Inertial | None, frames: Mapping[str, Tree]) -> Tree:
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


def _attach_joints(robot: Robot, bodies: Mapping[str, str]) -> tuple[dict[str, dict[str, Tree]], dict[str, Tree]]:
    """Return the frames of each link by name, where joints attach; each joint's parent and child as `body.frame`."""
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
        tilt = []
        if joint.type == "planar":  # a turn that carries z to the normal
            x, y, z = joint.axis
            if angle := _angle(math.atan2(math.hypot(x, y), z)):
                tilt = [{"axis": [-y, x, 0] if x or y else "x", "angle": angle}]
        parent = reference(joint.parent, name, joint.origin.xyz, [*_turns(joint.origin), *tilt])
        ends[name] = {"parent": parent, "child": reference(joint.child, name, (0.0, 0.0, 0.0), tilt)}
    return frames, ends


def _declare_joints(
    robot: Robot, bodies: Mapping[str, str], ends: Mapping[str, Tree], floating: bool
) -> dict[str, Tree]:
    """Return the joints by name: that of the root first, which carries the root's name."""
    kind = "free" if floating else "fixed"
    root = {"type": kind, "parent": GROUND, "child": bodies[robot.root]}
    joints: dict[str, Tree] = {_unique(robot.root, robot.joints): root}
    for name, joint in robot.joints.items():
        joints[name] = {"type": joint.type, **ends[name]}
        if joint.type in ONE_COORDINATE:
            # x, y, z, -x, -y or -z where the axis is that but for rounding
            unit = [component / math.hypot(*joint.axis) for component in joint.axis]
            near = [round(component) for component in unit]
            off = max(abs(component - whole) for component, whole in zip(unit, near, strict=True))
            joints[name]["axis"] = near if off <= RIGHT_ANGLE else joint.axis
            if joint.limits:
                joints[name]["limits"] = {**joint.limits, "acts": False}
    return joints


def _with_symbols(joints: Mapping[str, Tree]) -> dict[str, Tree]:
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


def _mimics(robot: Robot) -> dict[str, Mimic]:
    """Return what joints with one coordinate mimic, where that is another joint with one coordinate at most."""
    possible = {name for name, joint in robot.joints.items() if joint.type in (*ONE_COORDINATE, "fixed")}
    pairs = ((name, joint.mimic) for name, joint in robot.moved_by_one.items())
    return {name: mimic for name, mimic in pairs if mimic and mimic.joint in possible}


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


def notes(robot: Robot, *, damping: bool, mimic: bool, friction: bool = False) -> list[str]:
    """Return the remarks on a file, one line a kind."""
    joints, moving = robot.joints.items(), robot.moved_by_one
    inertials = {link: inertial for link, inertial in robot.links.items() if inertial}
    damped = "damping is applied (other programs may ignore it): " if damping else "damping is not applied: "
    coupled = _mimics(robot) if mimic else {}
    kinds = {
        "not read: ": list(robot.skipped),
        "meshes are not read (declare surfaces for contacts): ": list(robot.meshed),
        "transmissions drive no such joint: ": [name for name in robot.driven if name not in robot.joints],
        "friction is not applied: ": [
            name for name, joint in joints if joint.friction and not (friction and name in moving)
        ],
        damped: [name for name, joint in moving.items() if joint.damping],
        "damping of joints with several freedoms is not applied: ": [
            name for name, joint in joints if joint.damping and joint.type in ("floating", "planar")
        ],
        "mimic ties joints (other programs may leave them free): ": list(coupled),
        "mimic is not applied: ": [
            name for name, joint in joints if joint.mimic and joint.type != "fixed" and name not in coupled
        ],
        "an inertia that no body can have: ": [link for link, x in inertials.items() if not _is_possible(x)],
        "moving joints that carry no mass: ": _without_mass(robot),
        "inertia without mass: ": [link for link, x in inertials.items() if any(x.inertia) and not x.mass],
    }
    lines = []
    for what, names in kinds.items():
        if names:
            more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
            lines.append(what + ", ".join(names[:_MOST_NAMED]) + more)
    return lines


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


def _is_possible(inertial: Inertial) -> bool:
    """Return whether the principal moments are those of some mass: 0 <= a <= b <= c <= a + b, but for rounding."""
    a, b, c = np.linalg.eigvalsh(_matrix(inertial.inertia))
    return bool(a >= -_ROUNDING * c and a + b >= c * (1 - _ROUNDING))
