"""What a start changes to close contacts that it nearly closes is told, as for loops; one deep inside is refused."""

from __future__ import annotations

import pytest

import multibody_sym as mbs


@pytest.mark.parametrize(("count", "closed"), [(12, True), (13, False)])
def test_more_than_twelve_gaps_stay_as_given(count: int, closed: bool) -> None:
    """Trying which of many bodies move to close them took minutes for thirty discs."""
    bodies = {"ground": mbs.Body(surfaces={"floor": mbs.Surface(plane=[0, 0, 0], normal="y")})}
    joints, contacts = {}, {}
    for k in range(count):
        bodies[f"b{k}"] = mbs.Body(mass=1)
        joints[f"j{k}"] = mbs.PointJoint("ground", f"b{k}", axes="xy", q=[f"x{k}", f"y{k}"], initial={"q": [k, 1e-4]})
        contacts[f"c{k}"] = mbs.Contact(between=[f"b{k}", "ground.floor"])
    system = mbs.System("grains", gravity=[0, -9.81, 0], bodies=bodies, joints=joints, contacts=contacts)
    assert set(mbs.check(system).shifts) == ({f"y{k}" for k in range(count)} if closed else set())
