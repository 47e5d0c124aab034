"""Masses that vary, as they are declared: the words, the errors with their place, and the way back into a file."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

FILE = """
multibody_sym: 1
name: rocket
parameters: {{m0: 100 kg, k: 2 kg/s, kappa: 2 kg/m, w: 2 1/s, c: 2000 m/s, b: 2000 m/s^2, r: 0.5 m}}
bodies:
  rocket: {{{body}}}
joints:
  way: {{type: prismatic, parent: ground, child: rocket, axis: y, q: y, initial: {{q: 1 m}}}}
"""
MASS = "mass: {value: m0 - k*t, relative_velocity: [0, -c, 0]}"


def loaded(body: str) -> mbs.System:
    return mbs.loads(FILE.format(body=body))


@pytest.mark.parametrize(
    "body",
    [
        MASS,
        "mass: {value: m0 - kappa*y, absolute_velocity: [0, 0, 0]}, com: [0, y/2, 0]",
        "mass: {value: m0 - k*t, relative_velocity: [0, -b*t, w*y], frame: ground, at: n}, points: {n: [0, -r, 0]}",
        "shape: {sphere: r, mass: {value: m0 - k*t, relative_velocity: [0, -c, 0]}}",
    ],
)
def test_the_way_back_into_a_file(body: str) -> None:
    system = loaded(body)
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.solve(system).as_json() == mbs.solve(mbs.loads(mbs.dumps(system))).as_json()


def test_the_class_has_the_fields_of_the_file() -> None:
    m0, k, c = mbs.parameters("m0 k c", ["100 kg", "2 kg/s", "2000 m/s"])
    body = mbs.Body(mass=mbs.VariableMass(m0 - k * mbs.t, relative_velocity=[0, -c, 0]))
    way = mbs.Prismatic("ground", "rocket", axis="y", q="y", initial={"q": 1})
    system = mbs.System("rocket", bodies={"rocket": body}, joints={"way": way})
    found = mbs.solve(system).accelerations["y"]
    assert found.as_json()["expression"] == mbs.solve(loaded(MASS)).accelerations["y"].as_json()["expression"]
    assert found.value == pytest.approx(40.0, rel=1e-15)
