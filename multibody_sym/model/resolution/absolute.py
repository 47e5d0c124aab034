"""Absolute coordinates: every body moves freely relative to ground, and every declared joint restricts that.

In the plane a body's coordinates are its centre of mass (x, y) and an angle, in space that and a unit quaternion (of a
body in which the centre of mass moves, as its mass varies, its origin instead). What
a joint's own coordinates are called is measured then: an expression of the coordinates of the bodies that it joins.
Quaternions tell no whole turns, though: in space a joint that turns about axes keeps its coordinates beside the others.
"""

from __future__ import annotations

import re
from collections.abc import Container, Iterable, Mapping
from dataclasses import replace
from typing import Final

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.bodies import Body, Frame
from multibody_sym.model.declaration.contacts import copies
from multibody_sym.model.declaration.curves.foot import Foot
from multibody_sym.model.declaration.fields import Names
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.declaration.joints import Free, Planar
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mass import GROUND, ORIGIN, centre_moves, mass_of
from multibody_sym.model.resolution.cuts import has_rows
from multibody_sym.model.resolution.measured import has_formula
from multibody_sym.model.resolution.plane import in_plane
from multibody_sym.model.resolution.spanning_tree import coordinate_names, speed_names
from multibody_sym.records import dataclass

_CENTRE: Final = "centre of mass"
_MOST: Final = 8
"""How many names an error lists."""
_IN_PLANE: Final = ("x", "y", "angle")
_IN_SPACE: Final = ("x", "y", "z", "qw", "qx", "qy", "qz")


@dataclass(frozen=True)
class Freed:
    """A system whose bodies are carried by joints from ground that leave them free, all its own joints being cut.

    Of these the `measured` ones have coordinates that follow from the poses of the bodies; `doubled` ones keep their
    own, which poses do not tell or no rows can stand for.
    """

    system: System
    plane: bool
    doubled: frozenset[str]
    measured: frozenset[str]


def freed_bodies(system: System, carrying: Iterable[str]) -> Freed:
    """Return a system with its bodies freed, whose joints `carrying` bodies have coordinates of their own.

    `_free` follows a body's name where its coordinates' would be taken, or a contact has it.
    """
    plane = in_plane(system)
    bodies = {
        name: _with_centre(body, system.parameters) if name != GROUND else body
        for name, body in system.bodies.items()
    }
    touching = {name for _, name, _ in copies(system.contacts)}
    carriers: dict[str, Joint] = {}
    feet = {joint.child for joint in system.joints.values() if isinstance(joint, Foot)}  # which follow other bodies
    for name in (name for name in system.bodies if name != GROUND and name not in feet):
        taken = _names({**system.joints, **carriers}) | {*system.parameters, *system.inputs, *system.joints, *touching}
        word = _word(name)
        while not taken.isdisjoint((word, *_names({word: _carrier(name, word, plane)}))):
            word += "_free"
        carriers[word] = _carrier(name, word, plane)
    cut = {
        name: joint if isinstance(joint, Foot) else replace(joint, cut=True) for name, joint in system.joints.items()
    }
    freed = replace(system, bodies=Names(bodies), joints=Names({**carriers, **cut}))
    joints = system.joints.items()
    told = frozenset(name for name, joint in joints if has_rows(joint) and has_formula(joint, plane=plane))
    return Freed(freed, plane, frozenset(carrying) - told, told)


def unknown_coordinate(name: str, system: System, known: Iterable[str]) -> ModelError:
    """Return the error for a name that no coordinate or speed of a system's joints has; `known` are those they have."""
    freed = freed_bodies(system, ()).system.joints.items()
    if name in _names({key: joint for key, joint in freed if key not in system.joints}):
        listed = list(known)
        names = ", ".join(listed[:_MOST]) + (" .." if len(listed) > _MOST else "")
        return ModelError(
            f"{name!r} is of a body in absolute coordinates; a state is given in those of joints: {names}; "
            "runs and equilibria in relative coordinates tell it in them",
            number="M117",
        )
    return ModelError(f"no coordinate or speed is called {name!r}", number="M117", word=name, known=known)


def _with_centre(body: Body, parameters: Container[str]) -> Body:
    """Return a body with a frame at its centre of mass, at its origin where that moves in the body."""
    place = ORIGIN if centre_moves(body, parameters) else mass_of(body).com
    return replace(body, frames=Names({**body.frames, _CENTRE: Frame(position=place)}))


def _carrier(body: str, word: str, plane: bool) -> Joint:
    """Return what leaves a body free; the names of its coordinates begin with `word`."""
    kind, letters = (Planar, _IN_PLANE) if plane else (Free, _IN_SPACE)
    return kind(GROUND, f"{body}.{_CENTRE}", q=tuple(f"{word}_{letter}" for letter in letters))


def _word(name: str) -> str:
    """Return a body's name as it can stand in expressions."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if plain[0].isalpha() else f"body_{plain}"


def _names(joints: Mapping[str, Joint]) -> set[str]:
    """Return the names of all coordinates and speeds of joints."""
    pairs = joints.items()
    return {called for name, joint in pairs for called in (*coordinate_names(name, joint), *speed_names(name, joint))}
