"""Which joint carries each body, and which ones are cut where joints close loops."""

from __future__ import annotations

from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError
from multibody_sym.mechanics.spanning_tree import spanning_tree
from multibody_sym.model.joints import Joint


def hinge(parent: str, child: str, **keys: Any) -> Joint:
    return mbs.Revolute(parent, child, **keys)


def four_bar(**changed: Joint) -> mbs.System:
    joints = {
        "A": hinge("ground", "crank"),
        "B": hinge("crank", "coupler"),
        "C": hinge("coupler", "rocker"),
        "D": hinge("ground", "rocker"),
    }
    bodies = {name: mbs.Body(mass=1, points={"end": [1, 0, 0]}) for name in ("crank", "coupler", "rocker")}
    return mbs.System("four-bar", bodies=bodies, joints={**joints, **changed})


def test_a_body_is_carried_by_the_joint_nearest_to_ground() -> None:
    tree = spanning_tree(four_bar())
    assert tree.carrying == ("A", "B", "D")
    assert tree.cut == ("C",)


def test_a_marked_joint_is_cut() -> None:
    assert spanning_tree(four_bar(D=hinge("ground", "rocker", cut=True))).cut == ("D",)


def test_a_joint_with_a_start_value_is_kept() -> None:
    assert spanning_tree(four_bar(C=hinge("coupler", "rocker", initial={"q": 0.3}))).cut == ("D",)


def test_a_joint_whose_coordinate_is_used_is_kept() -> None:
    system = four_bar(C=hinge("coupler", "rocker", q="psi"))
    forces = {"motor": mbs.Torque("2*cos(psi)", joint="C")}
    assert spanning_tree(mbs.System("x", bodies=system.bodies, joints=system.joints, forces=forces)).cut == ("D",)


def test_a_joint_with_few_freedoms_is_kept() -> None:
    assert spanning_tree(four_bar(D=mbs.Spherical("ground", "rocker"))).cut == ("D",)


def test_order_is_from_ground_outward_and_as_declared() -> None:
    joints = {"3": hinge("b", "c"), "1": hinge("ground", "a"), "2": hinge("a", "b"), "4": hinge("ground", "d")}
    system = mbs.System("order", bodies={name: mbs.Body(mass=1) for name in "abcd"}, joints=joints)
    assert spanning_tree(system).carrying == ("1", "2", "3", "4")


def test_every_joint_to_a_body_cut_is_an_error() -> None:
    with pytest.raises(ModelError, match="every joint that leads to 'crank' is cut"):
        spanning_tree(four_bar(A=hinge("ground", "crank", cut=True)))


def test_a_circle_that_never_reaches_ground_is_an_error() -> None:
    system = mbs.System(
        "circle", bodies={name: mbs.Body(mass=1) for name in "ab"}, joints={"1": hinge("a", "b"), "2": hinge("b", "a")}
    )
    with pytest.raises(ModelError, match="circle of joints"):
        spanning_tree(system)


def test_a_cut_joint_whose_coordinate_is_used_keeps_it() -> None:
    """A torque in the cut joint needs the joint's angle and speed: a massless double of the child carries them."""
    system = four_bar(C=hinge("coupler", "rocker", cut=True, q="psi"))
    forces = {"motor": mbs.Torque("2*cos(psi)", joint="C")}
    resolved = mbs.mechanism(mbs.System("x", bodies=system.bodies, joints=system.joints, forces=forces))
    assert [c.name for c in resolved.coordinates] == ["A", "B", "D", "psi"]
    assert [row.name for row in resolved.rows] == ["C.x", "C.y", "C.z", "C.rx", "C.ry", "C.rz"]
