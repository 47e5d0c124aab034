"""What a URDF file says about dynamics: links with inertia and joints, checked, every error with line and column.

Visual and collision geometry, transmissions and simulators' own elements are not read; meshes are never opened.
Source: the specification at http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Final

from multibody_sym.errors import InputError, ModelError
from multibody_sym.formats.xml_tree import XmlElement
from multibody_sym.model.declaration.values import Text
from multibody_sym.records import dataclass

Triple = tuple[float, float, float]

ONE_COORDINATE: Final = ("revolute", "continuous", "prismatic")
JOINT_TYPES: Final = (*ONE_COORDINATE, "fixed", "floating", "planar")
_READ: Final = ("link", "joint", "material")
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
class Limits:
    """The range of a joint's coordinate, the largest speed, the largest force or moment; None is no limit."""

    lower: float | None
    upper: float | None
    velocity: float | None
    effort: float | None


@dataclass(frozen=True)
class Mimic:
    """q = multiplier (q of `joint`) + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class UrdfJoint:
    """A joint of the file; the frame of the child is at `origin` in that of the parent, at zero coordinates."""

    type: str
    parent: str
    child: str
    origin: Origin
    axis: Triple
    damping: float
    friction: float
    limits: Limits
    mimic: Mimic | None


@dataclass(frozen=True)
class Robot:
    """Links and joints by name in the order of the file; `root` is the link that no joint carries.

    `skipped` names the kinds of elements beside links and joints that were not read, `meshed` the links with meshes.
    """

    name: str
    links: Mapping[str, Inertial | None]
    joints: Mapping[str, UrdfJoint]
    root: str
    skipped: tuple[str, ...]
    meshed: tuple[str, ...] = ()


def read_robot(tree: XmlElement, file_name: str) -> Robot:
    """Return the robot that a file describes; it is called `file_name` where the file does not say.

    Raises ModelError with line and column for missing and wrong values, and for links that make no tree.
    """
    with _inside(tree):
        _verify_robot(tree)
        name = Text().accept(tree.attributes.get("name", "").strip() or file_name)
    links, joints = _by_name(tree, "link"), _by_name(tree, "joint")
    read = {joint: _joint(joint, element) for joint, element in joints.items()}
    for joint, element in joints.items():
        with _inside(element, "joint", joint):
            _verify_links(read[joint], links)
    skipped = tuple(dict.fromkeys(child.tag for child in tree.children if child.tag not in _READ))
    masses = {link: _inertial(link, element) for link, element in links.items()}
    return Robot(name, masses, read, _root(links, joints, read), skipped, _meshed(links))


def _meshed(links: Mapping[str, XmlElement]) -> tuple[str, ...]:
    """Return the links whose shapes are meshes."""
    shapes = {
        name: [shape for part in link.children for geometry in part.named("geometry") for shape in geometry.children]
        for name, link in links.items()
    }
    return tuple(name for name, each in shapes.items() if any(shape.tag == "mesh" for shape in each))


# --- elements ---------------------------------------------------------------------------------------------------


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


def _verify_robot(tree: XmlElement) -> None:
    if tree.tag != "robot":
        raise ModelError(f"a URDF file holds a <robot>, this one a <{tree.tag}>", number="F105")
    unexpanded = [child.tag for child in tree.children if child.tag.startswith("xacro:")]
    if unexpanded:
        raise ModelError(f"<{unexpanded[0]}> is not expanded yet; run xacro on the file first", number="F105")
    if not tree.named("link"):
        raise ModelError("this <robot> has no <link>; did the program that wrote the file fail?", number="F105")


def _by_name(tree: XmlElement, tag: str) -> dict[str, XmlElement]:
    found: dict[str, XmlElement] = {}
    for element in tree.named(tag):
        with _inside(element, tag):
            name = Text().accept(_attribute(element, "name"))
            if name in found:
                raise ModelError(f"{name!r} stands here a second time; first in line {found[name].line}", number="M108")
            found[name] = element
    return found


def _inertial(name: str, link: XmlElement) -> Inertial | None:
    with _inside(link, "link", name):
        inertial = _child(link, "inertial")
        if inertial is None:
            return None
        with _inside(inertial, "inertial"):
            mass, inertia = _needed(inertial, "mass"), _needed(inertial, "inertia")
            value = _number(mass, "value")
            if value < 0:
                with _inside(mass, "mass"):
                    raise ModelError(f"a mass is not negative, this one is {value:g}", number="M109")
            return Inertial(value, tuple(_number(inertia, key, "0") for key in _INERTIA), _origin(inertial))


def _joint(name: str, joint: XmlElement) -> UrdfJoint:
    with _inside(joint, "joint", name):
        kind = _attribute(joint, "type")
        if kind not in JOINT_TYPES:
            raise ModelError(f"{kind!r} is no type of joint", number="M106", word=kind, known=JOINT_TYPES)
        dynamics = _child(joint, "dynamics")
        return UrdfJoint(
            kind,
            _attribute(_needed(joint, "parent"), "link").strip(),
            _attribute(_needed(joint, "child"), "link").strip(),
            _origin(joint),
            _axis(joint) if kind not in ("fixed", "floating") else (1.0, 0.0, 0.0),
            _number(dynamics, "damping", "0") if dynamics else 0.0,
            _number(dynamics, "friction", "0") if dynamics else 0.0,
            _limits(joint, kind),
            _mimic(joint),
        )


def _origin(element: XmlElement) -> Origin:
    origin = _child(element, "origin")
    return Origin() if origin is None else Origin(_triple(origin, "xyz"), _triple(origin, "rpy"))


def _axis(joint: XmlElement) -> Triple:
    element = _child(joint, "axis")
    axis = (1.0, 0.0, 0.0) if element is None else _triple(element, "xyz", "1 0 0")
    if math.hypot(*axis) == 0:
        with _inside(element or joint, "axis"):
            raise ModelError("the axis is zero", number="F105")
    return axis


def _limits(joint: XmlElement, kind: str) -> Limits:
    """Return what <limit> says; a speed or effort of zero stands for none, a bound that is left out for zero."""
    element = _child(joint, "limit")
    if element is None or kind not in ONE_COORDINATE:
        return Limits(None, None, None, None)
    velocity, effort = (_number(element, key, "0") or None for key in ("velocity", "effort"))
    if kind == "continuous" or not {"lower", "upper"} & set(element.attributes):
        return Limits(None, None, velocity, effort)
    lower, upper = _number(element, "lower", "0"), _number(element, "upper", "0")
    if lower > upper:
        with _inside(element, "limit"):
            raise ModelError(f"the lower limit {lower:g} is above the upper one {upper:g}", number="M109")
    return Limits(lower, upper, velocity, effort)


def _mimic(joint: XmlElement) -> Mimic | None:
    element = _child(joint, "mimic")
    if element is None:
        return None
    with _inside(element, "mimic"):
        other = _attribute(element, "joint").strip()
        return Mimic(other, _number(element, "multiplier", "1"), _number(element, "offset", "0"))


def _child(element: XmlElement, tag: str) -> XmlElement | None:
    found = element.named(tag)
    if len(found) > 1:
        with _inside(found[1], tag):
            raise ModelError(f"<{tag}> stands here a second time; first in line {found[0].line}", number="M108")
    return found[0] if found else None


def _needed(element: XmlElement, tag: str) -> XmlElement:
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


# --- the tree ---------------------------------------------------------------------------------------------------


def _verify_links(joint: UrdfJoint, links: Mapping[str, object]) -> None:
    for what, name in (("parent", joint.parent), ("child", joint.child)):
        if name not in links:
            raise ModelError(f"its {what}: no link is called {name!r}", number="M106", word=name, known=links)


def _root(
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


def _loop(parents: Mapping[str, str]) -> list[str]:
    """Return links of which each is the parent of the one before, the last's the first; empty where there are none."""
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
