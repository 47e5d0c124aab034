"""What could be taken for something else is given by keyword, and an axis to slide along is never guessed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import multibody_sym as mbs

AXIS = {"axis": "y"}
JOINTS: dict[type[Any], dict[str, Any]] = {
    mbs.Revolute: {}, mbs.Prismatic: AXIS, mbs.Screw: {"pitch": 1, **AXIS}, mbs.Cylindrical: AXIS, mbs.Universal: {},
    mbs.Planar: {}, mbs.Spherical: {}, mbs.Free: {}, mbs.Custom: {"free": [{"rotate": "x"}]}, mbs.Fixed: {},
}


@pytest.mark.parametrize("cls", JOINTS, ids=lambda cls: cls.__name__)
def test_parent_and_child_alone_come_by_position(cls: type[Any]) -> None:
    joint = cls("ground", "bob", **JOINTS[cls])
    assert (joint.parent, joint.child) == ("ground", "bob")
    with pytest.raises(TypeError, match=r"takes 2 by their places \(parent, child\)"):
        cls("ground", "bob", "x", **JOINTS[cls])


@pytest.mark.parametrize(
    "call",
    [
        lambda: mbs.Surface(0.1),
        lambda: mbs.Direct("x"),
        lambda: mbs.Motor("A", 12, 2, 0.1),
        lambda: mbs.Settings(10, 0.01),
        lambda: mbs.Ask("x"),
        lambda: mbs.Stabilisation({"alpha": 1}),
    ],
)
def test_kinds_and_like_numbers_come_by_keyword(call: Callable[[], Any]) -> None:
    with pytest.raises(TypeError, match=r"takes (none by its place|1 by their places).*; give others by name"):
        call()


def test_the_same_in_python() -> None:
    for cls in (mbs.Prismatic, mbs.Screw, mbs.Cylindrical):
        with pytest.raises(mbs.ModelError, match="axis: it is missing"):
            cls("ground", "b", **{name: x for name, x in JOINTS[cls].items() if name != "axis"})
    assert mbs.Prismatic("ground", "b", axis="y").steps[0].axis == mbs.Prismatic("ground", "b", axis=[0, 1, 0]).axis


def test_a_hinge_turns_about_the_normal_of_the_plane() -> None:
    assert mbs.Revolute("ground", "b") == mbs.Revolute("ground", "b", axis="z")
