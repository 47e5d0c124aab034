"""Between a System and the plain tree (maps, lists, text) that a model file holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from multibody_sym.errors import ModelError, at, nearest
from multibody_sym.model.declaration.bodies import Body
from multibody_sym.model.declaration.fields import (
    Element,
    Record,
    fields_of,
    fields_tree,
    from_fields,
    holds,
    verify_keys,
)
from multibody_sym.model.declaration.joints import JOINTS
from multibody_sym.model.declaration.system import System
from multibody_sym.model.declaration.values import Count, Text, described, is_text
from multibody_sym.records import dataclass

VERSION: Final = "1"
VERSION_KEY: Final = "multibody_sym"
REPEAT_KEY: Final = "repeat"


def system_from_tree(tree: Any) -> System:
    """Return the System that a model file's content describes.

    Raises InputError with the path of the field in `where.path`.
    """
    if not isinstance(tree, Mapping):
        raise ModelError(f"a model file is a map, got {described(tree)}", number="F103")
    known = (VERSION_KEY, *fields_of(System), REPEAT_KEY)
    if VERSION_KEY not in tree:
        verify_keys([key for key in tree if nearest(str(key), known) == VERSION_KEY], known)
    version = tree.get(VERSION_KEY)
    if version != VERSION:
        with at(VERSION_KEY):
            raise ModelError(
                f"a model file says '{VERSION_KEY}: {VERSION}' first, got {described(version)}", number="F103"
            )
    verify_keys(tree, known)
    content = {key: x for key, x in tree.items() if key not in (VERSION_KEY, REPEAT_KEY)}
    for index, entry in _repeats(tree.get(REPEAT_KEY)):
        with at(REPEAT_KEY, *index):
            content = _with_chain(content, entry)
    system = from_fields(System, content)
    assert isinstance(system, System)
    return system


def tree_from_system(system: System) -> dict[str, Any]:
    """Return the content of a model file that describes the System."""
    return {VERSION_KEY: VERSION, **{key: part for key, part in fields_tree(system).items() if part != {}}}


@dataclass(frozen=True)
class AnyMap:
    """A map that is read later, once for each copy; in full it is what `like` reads."""

    like: Any

    def accept(self, value: Any) -> Mapping[str, Any]:
        if not isinstance(value, Mapping):
            raise ModelError(f"expected a map, got {described(value)}", number="M103")
        return value

    def tree(self, value: Mapping[str, Any]) -> Any:
        return value


@dataclass(frozen=True)
class Repeat(Element):
    """A chain of `count` like bodies: each joined by `joint` to the point `parent` of the one before.

    The first is joined to `start`. Bodies are called `<body_name>1`, `<body_name>2`, ..., joints `<joint_name>1`, ...
    """

    count: int = holds(Count(), says="how many copies there are", such="10")
    body: Mapping[str, Any] = holds(
        AnyMap(Record(Body)), says="the body of each copy",
        such="{mass: m, com: [0, -l/2, 0], points: {end: [0, -l, 0]}}",
    )
    joint: Mapping[str, Any] = holds(
        AnyMap(JOINTS), such="{type: revolute, parent: end}",
        says="the joint of each copy, without child; parent names a point of the copy before",
    )
    start: str = holds(Text(), "ground", says="what the first copy is joined to", such="ground.top")
    body_name: str = holds(Text(), "body", says="the bodies are called by this name and 1, 2, ..", such="rod")
    joint_name: str = holds(Text(), "joint", says="the joints are called by this name and 1, 2, ..", such="hinge")


MOST_REPEATS: Final = 10_000


def _repeats(value: Any) -> list[tuple[tuple[str, ...], Repeat]]:
    if value is None or is_text(value, ""):
        return []
    single: list[tuple[tuple[str, ...], Any]] = [((), value)]
    listed = [((str(i),), x) for i, x in enumerate(value)] if isinstance(value, list) else single
    read: list[tuple[tuple[str, ...], Repeat]] = []
    for index, entry in listed:
        with at(REPEAT_KEY, *index):
            repeat = Record(Repeat).accept(entry)
            assert isinstance(repeat, Repeat)
            if repeat.count > MOST_REPEATS:
                with at("count"):
                    raise ModelError(f"at most {MOST_REPEATS} copies", number="M109")
            read.append((index, repeat))
    return read


def _with_chain(tree: Mapping[str, Any], repeat: Repeat) -> dict[str, Any]:
    with at("body"):
        body = Record(Body).accept(repeat.body)
    joint, point = dict(repeat.joint), repeat.joint.get("parent")
    bodies, joints = dict(tree.get("bodies") or {}), dict(tree.get("joints") or {})
    for k in range(1, repeat.count + 1):
        names = f"{repeat.body_name}{k}", f"{repeat.joint_name}{k}"
        _refuse_taken(names[0], bodies)
        _refuse_taken(names[1], joints)
        before = f"{repeat.body_name}{k - 1}" + (f".{point}" if point else "")
        with at("joint"):
            ends = {"parent": repeat.start if k == 1 else before, "child": names[0]}
            joints[names[1]] = JOINTS.accept({**joint, **ends})
        bodies[names[0]] = body
    return {**tree, "bodies": bodies, "joints": joints}


def _refuse_taken(name: str, taken: Mapping[str, Any]) -> None:
    if name in taken:
        raise ModelError(
            f"the chain would declare {name!r} a second time; choose another body_name or joint_name", number="M108"
        )


_COPIED: Final = {"bodies": "body", "joints": "joint"}
"""Sections with copies, and under which key of a chain these stand, as they are called where it names none."""


def path_in_file(tree: Any, path: tuple[str, ...]) -> tuple[str, ...]:
    """Return the path in a file's content of what stands at a path of the system: of copies that of their chain."""
    section, name = (*path[:2], "", "")[:2]
    if section not in _COPIED or not isinstance(tree, Mapping):
        return path
    declared, chains = tree.get(section), tree.get(REPEAT_KEY)
    if isinstance(declared, Mapping) and name in declared:
        return path
    part = _COPIED[section]
    listed = [((str(i),), x) for i, x in enumerate(chains)] if isinstance(chains, list) else [((), chains)]
    for index, chain in listed:
        begin = str(chain.get(f"{part}_name", part)) if isinstance(chain, Mapping) else None
        if begin is not None and name.removeprefix(begin).isdecimal() and name.startswith(begin):
            return (REPEAT_KEY, *index, part, *path[2:])
    return path
