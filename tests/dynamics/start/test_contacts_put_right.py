"""What a start changes to close contacts that it nearly closes is told, as for loops; one deep inside is refused."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text, solution_text

FILE = """\
multibody_sym: 1
name: put_right
gravity: [0, -9.81, 0]
parameters: {y0: HEIGHT}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}, points: {far: [0, 3, 0]}}
  a: {mass: 2}
joints:
  A: {type: point, parent: ground, child: a, q: [x, y], initial: {q: [0, y0]}}
contacts: {c: {between: [a, ground.floor], static: 0.3}}
"""


@pytest.mark.parametrize("height", [-1e-3, 1e-3])
def test_what_closing_a_contact_changes_is_told(height: float) -> None:
    system = mbs.loads(FILE.replace("HEIGHT", f"{height} m"))
    told = f"given start values were changed to satisfy the constraints: y by {-height:.3g} m"
    solved, checked, run = mbs.solve(system), mbs.check(system), mbs.simulate(system, t_end=0.01)
    assert solved.shifts == pytest.approx({"y": -height}, abs=1e-15)
    assert checked.shifts == pytest.approx({"y": -height}, abs=1e-15)
    assert "y" in checked.assembled
    assert run.ready.shifts == pytest.approx({"y": -height}, abs=1e-15)
    assert all(told in text for text in (solution_text(solved), check_text(checked), run_summary(run)))


@pytest.mark.parametrize("height", [0.0, 0.5])
def test_nothing_is_told_where_nothing_changes(height: float) -> None:
    assert mbs.solve(mbs.loads(FILE.replace("HEIGHT", f"{height} m"))).shifts == {}


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


def test_a_start_deeper_inside_is_refused() -> None:
    with pytest.raises(mbs.ModelError, match=r"contacts.c: a starts 0.05 m inside ground.floor"):
        mbs.solve(mbs.loads(FILE.replace("HEIGHT", "-5 cm")))
