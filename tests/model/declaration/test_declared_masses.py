"""Masses that vary, as they are declared: the words, the errors with their place, and the way back into a file."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError

FILE = """
multibody_sym: 1
name: rocket
parameters: {{m0: 100 kg, k: 2 kg/s, c: 2000 m/s, r: 0.5 m}}
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
        "mass: {value: m0 - k*y, absolute_velocity: [0, 0, 0]}, com: [0, y/2, 0]",
        "mass: {value: m0 - k*t, relative_velocity: [0, -c*t, k*y], frame: ground, at: n}, points: {n: [0, -r, 0]}",
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


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("mass: m0 - k*t", "bodies.rocket.mass: 't' is the time"),
        ("mass: m0 - k*t", "mass: {value: m0 - k*t, relative_velocity: [-c, 0, 0]}"),
        ("mass: m0 - k*y", "a mass that varies says how what leaves or joins moves"),
        ("mass: m0, com: [0, r*t, 0]", "com and inertia vary with it only"),
        ("mass: m0, inertia: {Izz: m0*r^2*t}", "com and inertia vary with it only"),
        ("mass: {value: m0 - k*t}", "either relative_velocity"),
        ("mass: {value: m0, relative_velocity: [0, 0, 0], absolute_velocity: [0, 0, 0]}", "either relative_velocity"),
        ("mass: {value: m0 - k*t, velocity: [0, -c, 0]}", "write relative_velocity (to the body)"),
        ("mass: {mass: m0 - k*t, relative_velocity: [0, -c, 0]}", "did you mean value?"),
        ("mass: {value: m0 - k*t, relative_velocity: [0, -k, 0]}", "here one in m/s is wanted"),
        ("mass: {value: c, relative_velocity: [0, -c, 0]}", "here one in kg is wanted"),
        ("mass: {value: m0*u_y, relative_velocity: [0, -c, 0]}", "'u_y' is a speed"),
        ("mass: {value: m0 - k*t, relative_velocity: [0, -c, 0], at: nozzle}", "no point or frame 'nozzle'"),
        ("mass: {value: m0 - k*t, relative_velocity: [0, -c, 0], frame: moon}", "no body is called 'moon'"),
        (
            "mass: {value: m0 - k*y, relative_velocity: [0, -c, 0], at: n}, points: {n: [0, r, 0]}",
            "leave out at, where a coordinate tells",
        ),
        ("mass: {value: k*t - m0, relative_velocity: [0, -c, 0]}", "the mass of rocket is -100 kg"),
    ],
)
def test_wrong_words(body: str, told: str) -> None:
    with pytest.raises(ModelError) as caught:
        mbs.solve(loaded(body))
    assert told in str(caught.value)
    assert caught.value.where.path[:2] == ("bodies", "rocket")


def test_nothing_is_fixed_at_a_centre_of_mass_that_moves_in_its_body() -> None:
    text = FILE.format(body=f"{MASS}, com: [0, r*t, 0]") + "  next: {type: fixed, parent: rocket.com, child: flag}\n"
    with pytest.raises(ModelError, match="the centre of mass of rocket moves in it"):
        mbs.mechanism(mbs.loads(text.replace("bodies:", "bodies:\n  flag: {mass: 1}")))


def test_ground_has_no_mass_that_varies() -> None:
    text = FILE.format(body=MASS).replace("bodies:", f"bodies:\n  ground: {{{MASS}}}")
    with pytest.raises(ModelError, match="ground moves as prescribed"):
        mbs.mechanism(mbs.loads(text))
