"""Masses that vary, as they are declared: the words, the errors with their place, and the way back into a file."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError

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


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("mass: m0 - k*t", "bodies.rocket.mass: 't' is the time"),
        ("mass: m0 - k*t", "mass: {value: m0 - k*t, relative_velocity: [-c, 0, 0]}"),
        ("mass: m0 - kappa*y", "a mass that varies says how what leaves or joins moves"),
        ("mass: m0, com: [0, r*w*t, 0]", "com and inertia vary with it only"),
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
            "mass: {value: m0 - kappa*y, relative_velocity: [0, -c, 0], at: n}, points: {n: [0, r, 0]}",
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
    text = FILE.format(body=f"{MASS}, com: [0, r*w*t, 0]") + "  next: {type: fixed, parent: rocket.com, child: flag}\n"
    with pytest.raises(ModelError, match="the centre of mass of rocket moves in it"):
        mbs.mechanism(mbs.loads(text.replace("bodies:", "bodies:\n  flag: {mass: 1}")))


def test_ground_has_no_mass_that_varies() -> None:
    text = FILE.format(body=MASS).replace("bodies:", f"bodies:\n  ground: {{{MASS}}}")
    with pytest.raises(ModelError, match="ground moves as prescribed"):
        mbs.mechanism(mbs.loads(text))


def without_units(body: str) -> mbs.System:
    return mbs.loads(FILE.replace("100 kg", "100").replace("2 kg/s", "2").replace("2000 m/s", "2000").format(body=body))


@pytest.mark.parametrize(
    ("body", "told", "path"),
    [
        (
            "mass: {value: 'where(t < 1.5, m0, m0/2)', relative_velocity: [0, -c, 0]}",
            "jumps at t = 1.5, from 100 to 50 kg",
            "mass.value",
        ),
        (
            "mass: {value: 'm0 - k*where(t < 1, t, 2*t)', relative_velocity: [0, 0, 0]}",
            "jumps at t = 1, from 98 to 96 kg",
            "mass.value",
        ),
        (
            "mass: {value: 'm0 + k*sign(y - 7)', absolute_velocity: [0, 0, 0]}",
            "jumps at y = 7, from 98 to 102 kg",
            "mass.value",
        ),
        (
            "mass: {value: 'where(y < 3000, m0, m0 - kappa*y/1000)', absolute_velocity: [0, 0, 0]}",
            "jumps at y = 3000, from 100 to 94 kg",
            "mass.value",
        ),
        (
            "mass: {value: m0 - k*t, relative_velocity: [0, -c, 0]}, com: [0, 'where(t < 1, 0, r)', 0]",
            "jumps at t = 1, from 0 to 0.5 m",
            "com.1",
        ),
        (
            "shape: {sphere: r, mass: {value: 'where(t < 1.5, m0, m0/2)', relative_velocity: [0, -c, 0]}}",
            "jumps at t = 1.5, from 100 to 50 kg",
            "shape.mass.value",
        ),
    ],
)
def test_a_mass_that_jumps_is_refused_with_what_to_declare(body: str, told: str, path: str) -> None:
    with pytest.raises(ModelError, match="what leaves or joins at once takes momentum along") as caught:
        mbs.simulate(without_units(body), t_end=3)
    assert told in str(caught.value)
    assert caught.value.where.path == ("bodies", "rocket", *path.split("."))


@pytest.mark.parametrize(
    "law",
    [
        "where(t < 1.5, m0 - k*t, m0 - 1.5*k)",
        "m0 - k*min(t, 1.5)",
        "m0 - k*abs(y - 2)",
        "where(y < 3, m0 + kappa*y, m0 + 3*k)",
        "where(t < 9, m0, m0/2)",
    ],
)
def test_a_mass_with_a_kink_or_a_jump_after_the_end_goes_on(law: str) -> None:
    body = f"mass: {{value: '{law}', relative_velocity: [0, -c, 0]}}"
    assert mbs.simulate(without_units(body), t_end=3, samples=3).t[-1] == 3.0
