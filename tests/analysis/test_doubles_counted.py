"""Degrees of freedom count the speeds of bodies; massless doubles, by which joints keep their angles, count apart."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

import multibody_sym as mbs
from multibody_sym.analysis import check as checking
from multibody_sym.documents.solution import check_text

CORNERS = [(1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1), (0, 0, 0)]
AXES = "zxyzxy"
ROD = {"Ixx": 0.01, "Iyy": 0.02, "Izz": 0.03}


def bricard(coordinates: str) -> mbs.System:
    """Return Bricard's linkage along edges of a cube: five rods and ground, six hinges across the rods they join."""
    bodies, joints, parent = {}, {}, "ground"
    for k in range(5):
        along = [b - a for a, b in zip(CORNERS[k], CORNERS[k + 1], strict=True)]
        com = [x / 2 for x in along]
        bodies[f"rod{k + 1}"] = mbs.Body(mass=1, com=com, inertia=ROD, points={"end": along})
        joints[f"J{k + 1}"] = mbs.Revolute(parent, f"rod{k + 1}", axis=AXES[k])
        parent = f"rod{k + 1}.end"
    joints["J6"] = mbs.Revolute("ground", parent, axis=AXES[5], cut=True)
    bodies["ground"] = mbs.Body(points={"start": CORNERS[0]})
    joints["J1"] = mbs.Revolute("ground.start", "rod1", axis=AXES[0])
    settings = mbs.Settings(coordinates=coordinates)
    return mbs.System("bricard", gravity=[0, 0, -9.81], bodies=bodies, joints=joints, simulation=settings)


@pytest.fixture(autouse=True)
def only_what_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look for no conserved quantities: they have no say in what is counted, and take a third."""
    monkeypatch.setattr(checking, "find_conserved", lambda *_: [])


@cache
def checked() -> mbs.CheckReport:
    """What `check` finds in absolute coordinates, which takes some seconds."""
    return mbs.check(bricard("absolute"))


def test_bricards_linkage_in_absolute_coordinates() -> None:
    """Five bodies have 30 speeds; one freedom is left, so that the rank is 29. Six hinges have 30 rows, one redundant.

    Five hinges keep their angles by doubles: five speeds more, and as much rank.
    """
    found = checked()
    assert (found.degrees_of_freedom, found.rank, len(found.redundant)) == (1, 29, 1)
    assert found.doubles == {f"J{k}": 1 for k in range(1, 6)}
    told = check_text(found)
    assert "degrees of freedom: 1 (30 speeds, constraints of rank 29)" in told
    assert "J1, J2, J3, J4, J5 keep their coordinates beside them, by massless doubles of their children" in told
    assert "(with these: 35 speeds, constraints of rank 34)" in told
    assert found.as_json()["doubles"] == found.doubles


def test_bricards_linkage_in_coordinates_of_its_joints() -> None:
    """Five angles, a loop of five rows, one freedom left: the rank is 4."""
    found = mbs.check(bricard("relative"))
    assert (found.degrees_of_freedom, found.rank, len(found.redundant)) == (1, 4, 1)
    assert found.doubles == {}
    assert "double" not in check_text(found)


def test_a_run_counts_as_check_does() -> None:
    run = mbs.simulate(bricard("absolute"), t_end=1e-6, samples=2, rtol=1e-3, backend="python")
    told = run.as_json()["redundancy"]
    assert (told["rank"], told["rows"], len(told["redundant"])) == (29, 30, 1)
    assert told["doubles"] == {f"J{k}": 1 for k in range(1, 6)}
    assert run.redundancy.rank == checked().rank


@pytest.mark.long
def test_a_run_without_redundant_rows_counts_alike() -> None:
    """Without its last hinge the chain has five bodies, 30 speeds, and 25 rows that leave five freedoms."""
    opened = bricard("absolute")
    joints = {name: joint for name, joint in opened.joints.items() if name != "J6"}
    run = mbs.simulate(replace(opened, joints=joints), t_end=1e-6, samples=2, rtol=1e-3, backend="python")
    told = run.as_json()["redundancy"]
    assert (told["rank"], told["rows"], told["redundant"], len(told["doubles"])) == (25, 25, (), 5)
