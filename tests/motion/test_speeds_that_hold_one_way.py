"""An element that holds a speed one way, as a ratchet does: its row has no phi, so it touches in any position."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

import multibody_sym as mbs
from multibody_sym.mechanics import resolve
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.references import References
from multibody_sym.mechanics.row_records import VelocityRow

MODEL = """\
multibody_sym: 1
name: ratchet
parameters: {T: 3 N*m, u: 2, m: 1, l: 1}
gravity: [0, -9.81, 0]
bodies: {b: {mass: m, com: [l, 0, 0]}}
joints: {j: {type: revolute, parent: ground, child: b, axis: z, q: phi, initial: {q: -60 deg, u: u}}}
forces: {push: {type: torque, joint: j, value: T}}
"""


@pytest.fixture(autouse=True)
def ratchets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let every joint go forward only."""

    def stops(references: References) -> Iterator[LawElement]:
        for name in references.system.joints:
            row = VelocityRow(f"{name}.pawl", references.freedom(name, None).rate)
            yield LawElement(row.name, "stop", ("joints", name), (row,), words=("held", "free"), group=name, joint=name)

    monkeypatch.setattr(resolve, "stops", stops)


def test_it_closes_where_the_speed_returns_to_zero_and_holds() -> None:
    run = mbs.simulate(mbs.loads(MODEL), parameters={"T": 0}, t_end=2, samples=5, backend="python")
    top = math.asin(math.sin(-math.pi / 3) + 2**2 / (2 * 9.81))  # where all of the kinetic energy is potential
    assert [(event["element"], event["kind"]) for event in run.events] == [("j.pawl", "held")], run.events
    assert run["phi"][-1] == pytest.approx(top, abs=1e-7)
    assert run["u_phi"][-1] == 0.0


def test_a_speed_backward_ends_in_an_impact() -> None:
    run = mbs.simulate(mbs.loads(MODEL), parameters={"T": 0, "u": -1}, t_end=0.5, samples=3, backend="python")
    assert "impact" in str(run.events[0])
    assert run["phi"][-1] == pytest.approx(-math.pi / 3, abs=1e-12)


def test_it_rests_as_long_as_nothing_lifts_the_body() -> None:
    solved = mbs.solve(mbs.loads(MODEL), parameters={"u": 0})
    assert solved.states == {"j.pawl": "held"}
    ((low, high),) = mbs.range_of_rest(mbs.loads(MODEL), "T", parameters={"u": 0}).rest
    assert (low, high) == (None, pytest.approx(9.81 * math.cos(math.pi / 3)))
