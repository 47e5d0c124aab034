"""Potentials: the force is their slope, the energy counts, and orbits are those of Kepler, Rutherford and Henon."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.energy import potential_energy
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import State, motion_of, state_of
from multibody_sym.scalars.calculus import antiderivative, derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

TIGHT = {"rtol": 1e-12, "atol": 1e-13, "method": "dormand_prince_8"}


def particle(forces: Mapping[str, Any], q: Any, u: Any, axes: str = "xy", **more: Any) -> mbs.System:
    """A particle of mass 0.5 that moves freely in a plane or in space."""
    return mbs.System(
        "particle",
        parameters={"k": {"value": 2.0}, "l": {"value": 0.3}, **more.pop("parameters", {})},
        bodies={"p": mbs.Body(mass=0.5), "ground": mbs.Body(points={"o": [0, 0, 0], "h": [0.3, -0.2, 0.1]})},
        joints={"j": mbs.PointJoint("ground", "p", axes=axes, q=list("abc"[: len(axes)]), initial={"q": q, "u": u})},
        forces=forces,
        outputs={"e": "total_energy()", "v": "potential_energy()"},
        **more,
    )


def state(mechanism: Mechanism, q: Any, u: Any) -> State:
    begin = start(mechanism)
    return state_of(mechanism, float, 0.0, list(q), list(u), list(begin.parameters))


def slope_by_differences(mechanism: Mechanism, q: np.ndarray) -> np.ndarray:
    """Return -dV/dq by central differences."""
    found, h = [], 1e-5
    for k in range(len(q)):
        step = np.eye(len(q))[k] * h
        values = [potential_energy(motion_of(mechanism, state(mechanism, x, 0 * q))) for x in (q + step, q - step)]
        found.append(-(values[0] - values[1]) / (2 * h))
    return np.array(found)


FORCES = {
    "between": mbs.Potential("-k/distance + l*distance^3", between=["ground.h", "p"]),
    "joint": mbs.Potential("k*a^4/4 + sin(b)*c", joint="j"),
    "place": mbs.Potential("k*(x^2 + y^2)/2 + x^2*y - y^3/3 + exp(z)", on="p", frame="ground.h"),
    "newton": mbs.Gravitation(["ground.o", "p"], constant=1.5, masses=[2, "l"]),
    "coulomb": mbs.Coulomb(["ground.o", "p"], charges=[1, "-l"], constant=3),
    "pull": mbs.Pull(["ground.o", "p"], "k*(distance - l) + 1/distance^2"),
}


@pytest.mark.parametrize("name", FORCES)
def test_force_is_the_slope_of_the_energy(name: str) -> None:
    q = np.array([0.7, -0.4, 0.5])
    mechanism = mbs.mechanism(particle({name: FORCES[name]}, q.tolist(), [0, 0, 0], "xyz"))
    found = composite_body(mechanism, state(mechanism, q, 0 * q)).applied
    assert np.allclose(found, slope_by_differences(mechanism, q), rtol=1e-7, atol=1e-8)


def test_a_potential_in_a_frame_that_moves_pushes_back_on_it() -> None:
    """Energy, momentum and angular momentum of two free bodies in each other's potential stay."""
    system = mbs.System(
        "pair",
        bodies={
            "a": mbs.Body(mass=1, com=[0.1, 0, 0], inertia=[1, 2, 2.5, 0, 0, 0]),
            "b": mbs.Body(mass=2, points={"tip": [0.2, 0.1, 0]}, inertia=[1, 1.2, 1.5, 0, 0, 0]),
        },
        joints={
            "fa": mbs.Free("ground", "a", initial={"u": [0, 0.1, 0, 0.3, 0.2, 1]}),
            "fb": mbs.Free("ground", "b", initial={"q": [0.6, 0.5, 0.4, 1, 0, 0, 0], "u": [0.1, 0, 0, 0, 0.4, 0.1]}),
        },
        forces={"well": mbs.Potential("3*x^2 + 2*y^2 + x*y*z + z^4", on="b", at="tip", frame="a")},
        outputs={"e": "total_energy()", "p": "momentum(y)", "h": "angular_momentum(z)"},
    )
    run = mbs.simulate(system, t_end=2, samples=41, **TIGHT)
    for name in ("e", "p", "h"):
        assert np.ptp(run[name]) <= 1e-10 * np.abs(run[name]).max()
    report = mbs.check(system)
    assert max(report.agreement.values()) < 10
    assert max(report.theorems.values()) < 1e-9


def test_keplers_orbit_has_its_closed_form() -> None:
    """M = E - e sin E, x = a (cos E - e), y = a sqrt(1 - e^2) sin E, from the perihelion on; T^2 = 4 pi^2 a^3/(G M)."""
    a, e, gm = 1.3, 0.6, 2.0
    fastest = math.sqrt(gm / a * (1 + e) / (1 - e))
    system = particle(
        {"sun": mbs.Gravitation(["ground", "p"], constant=gm / 2, masses=[2, 0.5])}, [a * (1 - e), 0], [0, fastest]
    )
    period = 2 * math.pi * math.sqrt(a**3 / gm)
    run = mbs.simulate(system, t_end=period, samples=41, **TIGHT)
    anomaly = 2 * np.pi * run.t / period
    E = anomaly.copy()
    for _ in range(60):
        E -= (E - e * np.sin(E) - anomaly) / (1 - e * np.cos(E))
    assert np.abs(run["a"] - a * (np.cos(E) - e)).max() < 1e-9
    assert np.abs(run["b"] - a * math.sqrt(1 - e * e) * np.sin(E)).max() < 1e-9
    assert np.ptp(run["e"]) <= 1e-10 * abs(run["e"][0])
    assert run["e"][0] == pytest.approx(-gm * 0.5 / (2 * a), rel=1e-13)


def test_rutherfords_angle() -> None:
    """A charge that comes with speed v, aimed to pass another at b, leaves at the angle 2 atan(K/(m v^2 b))."""
    m, v, b, strength, far = 0.5, 2.0, 0.4, 3 * 0.3 * 1.0, 4e3
    system = particle({"c": mbs.Coulomb(["ground", "p"], charges=[1, 0.3], constant=3)}, [-far, b], [v, 0])
    run = mbs.simulate(system, t_end=2 * far / v, samples=3, **TIGHT)
    u, w = run["u_a"][-1], run["u_b"][-1]
    assert math.atan2(w, u) == pytest.approx(2 * math.atan(strength / (m * v * v * b)), abs=5e-4)
    assert np.ptp(run["e"]) <= 1e-10 * abs(run["e"][0])


def test_apsides_advance_by_a_further_term() -> None:
    """V = -c/r + d/r^2: the apsidal angle is pi/sqrt(1 + 2 m d/L^2), as the inverse square adds to L^2."""
    m, c, d, speed = 0.5, 1.0, 0.05, 1.7
    law = mbs.Potential(f"-{c}/distance + {d}/distance^2", between=["ground", "p"])
    system = particle({"s": law}, [1, 0], [0, speed])
    inward = mbs.simulate(system, t_end=40, samples=8001, **TIGHT)
    L = m * speed
    rate = inward["a"] * inward["u_a"] + inward["b"] * inward["u_b"]
    turn = np.unwrap(np.arctan2(inward["b"], inward["a"]))
    places = [k for k in range(1, len(rate) - 1) if rate[k] * rate[k + 1] < 0]
    at = [turn[k] + (turn[k + 1] - turn[k]) * rate[k] / (rate[k] - rate[k + 1]) for k in places]
    assert len(at) >= 3
    assert np.diff(at) == pytest.approx(math.pi / math.sqrt(1 + 2 * m * d / L**2), abs=1e-5)


def test_henon_and_heiles() -> None:
    law = mbs.Potential("(x^2 + y^2)/2 + x^2*y - y^3/3", on="p")
    by_place = particle({"v": law}, [0.1, 0.2], [0.3, 0.1])
    in_joint = particle({"v": mbs.Potential("(a^2 + b^2)/2 + a^2*b - b^3/3", joint="j")}, [0.1, 0.2], [0.3, 0.1])
    runs = [mbs.simulate(x, t_end=20, samples=41, **TIGHT) for x in (by_place, in_joint)]
    assert np.abs(runs[0]["a"] - runs[1]["a"]).max() < 1e-9
    assert np.ptp(runs[0]["e"]) <= 1e-10 * abs(runs[0]["e"][0])
    f = np.array(mbs.compile(mbs.state_derivative(by_place))(0.0, [0.1, 0.2, 0, 0])[2:]) * 0.5
    assert f == pytest.approx([-(0.1 + 2 * 0.1 * 0.2), -(0.2 + 0.1**2 - 0.2**2)], rel=1e-13)


def test_two_joints_share_a_potential_in_relative_and_absolute_coordinates() -> None:
    system = mbs.System(
        "arms",
        bodies={"one": mbs.Body(mass=1, com=[0.5, 0, 0]), "two": mbs.Body(mass=2, com=[0.4, 0, 0])},
        joints={
            "A": mbs.Revolute("ground", "one", axis="z", q="phi", initial={"q": 0.4}),
            "B": mbs.Revolute("one", "two", axis="z", q="psi", initial={"q": -0.8}),
        },
        forces={"v": mbs.Potential("3*(phi - 2*psi)^2/2 + cos(phi*psi)", joints=["A", "B"])},
        outputs={"e": "total_energy()", "m": "reaction(A, fx)"},
    )
    runs = [mbs.simulate(system, t_end=2, samples=21, coordinates=c, **TIGHT) for c in ("relative", "absolute")]
    for name in ("phi", "e", "m"):
        assert np.abs(runs[0][name] - runs[1][name]).max() < 1e-8
    assert np.ptp(runs[0]["e"]) <= 1e-10 * abs(runs[0]["e"][0])
    assert not any("work" in name for name in mbs.check(system).conserved)


def test_gravitation_takes_the_masses_of_the_bodies_at_their_centres() -> None:
    system = mbs.System(
        "moons",
        bodies={
            "a": mbs.Body(mass=2, com=[0.1, 0, 0], inertia=[0, 0, 1, 0, 0, 0]),
            "b": mbs.Body(mass=3, com=[0, 0.2, 0], inertia=[0, 0, 1, 0, 0, 0]),
        },
        joints={
            "ja": mbs.Planar("ground", "a", q=["xa", "ya", "fa"]),
            "jb": mbs.Planar("ground", "b", q=["xb", "yb", "fb"], initial={"q": [1, 0, 0]}),
        },
        forces={"g": mbs.Gravitation(["a", "b"])},
        outputs={"v": "potential_energy(g)"},
    )
    mechanism = mbs.mechanism(system)
    found = potential_energy(motion_of(mechanism, state(mechanism, start(mechanism).q, np.zeros(6))))
    assert found == pytest.approx(-6.6743e-11 * 6 / math.hypot(0.9, 0.2), rel=1e-14)


def test_equilibrium_and_its_stability_follow_from_the_potential() -> None:
    system = particle({"v": mbs.Potential("(a^2 - 1)^2 + 3*b^2", joint="j")}, [0.6, 0.1], [0, 0])
    found = mbs.equilibrium(system)
    places = {round(p["a"], 9): stable for p, stable in zip(found.positions, found.stable, strict=True)}
    assert places.get(1.0) is True
    A = np.array(mbs.linearize(system, at={"a": 1, "b": 0}).A)
    assert (A[2, 0], A[3, 1]) == pytest.approx((-8 / 0.5, -6 / 0.5))


def test_what_time_and_inputs_move() -> None:
    """V(t) changes the energy at dV/dt; what an input stands in does work instead."""
    timed = particle({"v": mbs.Potential("(2 + sin(t))*a^2", joint="j")}, [1, 0], [0, 0])
    run = mbs.simulate(timed, t_end=2, samples=2001, **TIGHT)
    work = np.trapezoid(np.cos(run.t) * run["a"] ** 2, run.t)
    assert run["e"][-1] - run["e"][0] == pytest.approx(work, abs=1e-6)
    fed = particle({"v": mbs.Potential("w*a^2", joint="j")}, [1, 0], [0, 0], inputs={"w": "2 + sin(t)"})
    again = mbs.simulate(fed, t_end=2, samples=2001, **TIGHT)
    assert np.abs(again["a"] - run["a"]).max() < 1e-10
    assert np.abs(again["v"]).max() == 0.0


@pytest.mark.parametrize(
    "law",
    [
        "k/d^2", "7*(d - 0.4)", "7*(d - l)^3", "k*d*exp(-d/l)", "k*sin(l*d) + d^2*cos(k*d)", "max(0, 8*(d - l))",
        "k*d/(d^2 + l^2)^(3/2)", "12*(l^12/d^13 - l^6/d^7)", "k*(d - l)/d", "2*k*(1 - exp(-l*(d - k)))*exp(-l*(d - k))",
        "abs(d - l)*k", "tanh(d/l)", "k", "k*sqrt(d)", "k*d/(d^2 + l)", "min(0, k - d)",
    ],
)  # fmt: skip
def test_antiderivatives_differentiate_back(law: str) -> None:
    d, found = symbol("d"), antiderivative(parse(law), symbol("d"))
    assert found is not None
    for place in (0.21, 0.64, 1.9, 3.3):
        given = {d: place, symbol("k"): 1.3, symbol("l"): 0.7}
        left, right = evaluate_float([derivative(found, d), parse(law)], given)
        assert left == pytest.approx(right, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize("law", ["exp(-d^3)", "k*d^l", "sin(d)/d", "tan(d)", "exp(-d/l)/d"])
def test_laws_without_a_rule_have_none(law: str) -> None:
    assert antiderivative(parse(law), symbol("d")) is None


def test_a_pull_of_distance_alone_counts_as_energy_and_others_as_work() -> None:
    kept = particle({"f": mbs.Pull(["ground", "p"], "k/distance^2")}, [1, 0], [0, 1.1])
    run = mbs.simulate(kept, t_end=5, samples=41, **TIGHT)
    assert np.ptp(run["e"]) <= 1e-10 * abs(run["e"][0])
    assert run["v"][0] == pytest.approx(-2.0)
    lost = particle({"f": mbs.Pull(["ground", "p"], "k*distance^l")}, [1, 0], [0, 1.1])
    assert np.abs(mbs.simulate(lost, t_end=1, samples=5, **TIGHT)["v"]).max() == 0.0


# --- errors -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("force", "words"),
    [
        (lambda: mbs.Potential("k"), "one of the distance of two points"),
        (lambda: mbs.Potential("k*x", on="p", joint="j"), "one of the distance of two points"),
        (lambda: mbs.Potential("k*a", joint="j", at="o"), "at goes with on"),
        (lambda: mbs.Potential("u_a^2", joint="j"), "'u_a' is a speed"),
        (lambda: mbs.Potential("k", joints=[]), "it names no joint"),
        (lambda: mbs.Potential("k*a", between=["ground", "p"]), "coordinate of joint 'j'; this is a potential of th"),
        (lambda: mbs.Potential("k*a", on="p"), "a coordinate of joint 'j'; this is a potential of the place"),
        (lambda: mbs.Potential("k*distnce", between=["ground", "p"]), "'distnce' is not declared"),
        (lambda: mbs.Potential("k*a", joint="jj"), "no joint is called 'jj'"),
        (lambda: mbs.Potential("k*x", on="q"), "no body is called 'q'"),
        (lambda: mbs.Potential("k*x", on="p", frame="grund"), "no body is called 'grund'"),
        (lambda: mbs.Gravitation(["ground", "p"]), "'ground' has no mass that could attract"),
        (lambda: mbs.Gravitation(["ground", "p"], masses=[1]), "2"),
    ],
)
def test_errors(force: Any, words: str) -> None:
    with pytest.raises(mbs.MultibodyError) as caught:
        mbs.mechanism(particle({"f": force()}, [1, 0], [0, 0]))
    assert words in str(caught.value)


def test_a_place_is_not_mixed_up_with_coordinates_of_the_same_name() -> None:
    system = mbs.System(
        "named",
        bodies={"p": mbs.Body(mass=1)},
        joints={"j": mbs.PointJoint("ground", "p", axes="xy", q=["x", "y"])},
        forces={"v": mbs.Potential("x^2", on="p")},
    )
    with pytest.raises(mbs.ModelError, match="give the potential in the joint"):
        mbs.mechanism(system)


def test_singular_places_are_told() -> None:
    system = particle({"sun": mbs.Gravitation(["ground", "p"], constant=1, masses=[1, 1])}, [0, 0], [0, 0])
    with pytest.raises(mbs.MultibodyError, match="at the same place at the start"):
        mbs.simulate(system, t_end=1)
    falling = particle({"sun": mbs.Gravitation(["ground", "p"], constant=1, masses=[1, 0.5])}, [1, 0], [0, 0])
    with pytest.raises(mbs.RunError, match="ground and p meet there, and sun between them"):
        mbs.simulate(falling, t_end=3, backend="python")
    place = particle({"v": mbs.Potential("1/sqrt(x^2 + y^2)", on="p")}, [0, 0], [0, 0])
    with pytest.raises(mbs.MultibodyError, match=r"forces\.v"):
        mbs.simulate(place, t_end=1)


def test_files_hold_potentials() -> None:
    system = particle(FORCES, [0.7, -0.4, 0.5], [0, 0, 0], "xyz")
    assert mbs.loads(mbs.dumps(system)) == system
    with_unit = particle({"v": mbs.Potential("E", joint="j")}, [0, 0], [0, 0], parameters={"E": {"value": "2 kg"}})
    with pytest.raises(mbs.ModelError, match="J"):
        mbs.mechanism(with_unit)
