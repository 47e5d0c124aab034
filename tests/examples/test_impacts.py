"""Each example of an impact against the formula of its comment, at the values of its file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs

FOLDER = Path(__file__).parents[2] / "examples/impacts"

FORMULAS = {
    "ballistic_pendulum": {
        "after.u_phi": "m*v*l/(J + (M + m)*l**2)",
        "joint_impulses.stuck.fx": "-m*v*(J + M*l**2)/(J + (M + m)*l**2)",
        "joint_impulses.axle.fx": "-m*v*J/(J + (M + m)*l**2)",
        "energy_lost": "m*v**2/2*(J + M*l**2)/(J + (M + m)*l**2)",
    },
    "newtons_cradle": {
        "after.u_x1": "0",
        "after.u_x4": "0",
        "after.u_x5": "v",
        "impulses.c3.normal": "m*v",
    },
    "struck_four_bar": {
        "after.u_phi": "-3*I/((2*m + 3*M)*a)",
        "joint_impulses.B.fx": "-I*m/(2*m + 3*M)",
        "joint_impulses.C.fx": "I*m/(2*m + 3*M)",
        "joint_impulses.A.fx": "I*m/(2*m + 3*M)/2",
        "joint_impulses.D0.fx": "I*m/(2*m + 3*M)/2",
        "joint_impulses.A.fy": "D*(1 - s/b)",
        "joint_impulses.B.fy": "D*(1 - s/b)",
        "joint_impulses.D0.fy": "D*s/b",
        "joint_impulses.C.fy": "-D*s/b",
    },
    "billiards": {
        "after.u_x": "I/m",
        "after.u_y": "0",
        "after.u_phi": "-5*I*c/(2*m*r**2)",
    },
    "dropped_rod": {
        "apparent_mass.hit": "m/(1 + 12*s**2/l**2)",
        "impulses.hit.normal": "m*v*(1 + e)/(1 + 12*s**2/l**2)",
        "after.u_y": "v*(e - 12*s**2/l**2)/(1 + 12*s**2/l**2)",
        "after.u_phi": "12*s*v*(1 + e)/(l**2 + 12*s**2)",
        "energy_lost": "(1 - e**2)/2*m*v**2/(1 + 12*s**2/l**2)",
    },
    "slammed_door": {
        "impulses.impact.normal": "(1 + e)*m*b**2*w/(3*c)",
        "joint_impulses.hinge.fy": "(1 + e)*m*b*w*(1/2 - b/(3*c))",
        "centres_of_percussion.door": "2*b/3",
        "after.u_phi": "e*w",
    },
    "moving_racket": {
        "after.u_x": "A*W + e*(A*W + v)",
        "joint_impulses.hand.fx": "m*(1 + e)*(A*W + v)",
    },
    "superball": {
        "after.u_x": "u - 4*(u + r*w)/7",
        "after.u_y": "v",
        "after.u_phi": "w - 10*(u + r*w)/(7*r)",
        "impulses.c.friction": "-4*m*(u + r*w)/7",
        "energy_lost": "0",
    },
    "two_chains": {
        "impulses.impact.normal": "2*m1*m2*(1 + e)*v/(7*(m1 + m2))",
        "joint_impulses.A2.fy": "-m1*m2*(1 + e)*v/(14*(m1 + m2))",
        "joint_impulses.B2.fy": "m1*m2*(1 + e)*v/(14*(m1 + m2))",
        "energy_lost": "m1*m2*(1 - e**2)*v**2/(7*(m1 + m2))",
    },
}


def loaded(name: str) -> mbs.System:
    return mbs.load(FOLDER / f"{name}.yaml")


def values(system: mbs.System, **changed: float) -> dict[str, Any]:
    """The parameters by name, and what formulas here call by name."""
    given = {name: p.value.shadow for name, p in system.parameters.items()}
    return {**given, **changed, "sqrt": math.sqrt}


def told(found: Any, path: str) -> float:
    for part in path.split("."):
        found = found[part] if isinstance(found, dict) else getattr(found, part)
    return found.value


def agree(name: str, formulas: dict[str, str], **changed: float) -> None:
    system = loaded(name)
    found = mbs.solve(system, parameters=changed).impact
    for path, formula in formulas.items():
        expected = eval(formula, values(system, **changed))
        assert told(found, path) == pytest.approx(expected, rel=1e-12, abs=1e-12), path


@pytest.mark.parametrize("name", FORMULAS)
def test_an_example_is_its_formula(name: str) -> None:
    agree(name, FORMULAS[name])


def test_the_pendulum_swings_up_with_its_bullet() -> None:
    system = loaded("ballistic_pendulum")
    run = mbs.simulate(system, samples=5)
    known = {**values(system), "phi": run["phi"][-1], "u": run["u_phi"][-1], "cos": math.cos}
    assert run["x"][-1] == pytest.approx(math.sin(run["phi"][-1]), abs=1e-9)
    assert run["u_phi"][0] == pytest.approx(eval("m*v*l/(J + (M + m)*l**2)", known), rel=1e-12)
    gained = eval("(J + (M + m)*l**2)*((m*v*l/(J + (M + m)*l**2))**2 - u**2)/2", known)
    assert gained == pytest.approx(eval("(M + m)*g*l*(1 - cos(phi))", known), rel=1e-8)


@pytest.mark.parametrize("c", [0.3, 0.9])
def test_a_door_stopped_elsewhere_tears_at_its_hinge(c: float) -> None:
    agree("slammed_door", FORMULAS["slammed_door"], c=c)
    assert abs(told(mbs.solve(loaded("slammed_door"), parameters={"c": c}).impact, "joint_impulses.hinge.fy")) > 1


@pytest.mark.parametrize("e", [1.0, 0.5])
def test_the_cradle_struck_at_once(e: float) -> None:
    written = (FOLDER / "newtons_cradle.yaml").read_text(encoding="utf-8")
    system = mbs.loads(written.replace("impact: closing", "impact: {sequence: simultaneous}"))
    after = mbs.solve(system, parameters={"e": e}).impact.after
    others = 2 * (1 + e) / 5
    assert [x.value for x in after.values()] == pytest.approx([2 * (1 - 4 * e) / 5, *[others] * 4], rel=1e-12)


def test_the_cradle_runs_one_by_one() -> None:
    """From after the impact as told, and where it is left to the run to find it."""
    written = (FOLDER / "newtons_cradle.yaml").read_text(encoding="utf-8")
    found = mbs.simulate(mbs.loads(written.replace("impact: closing\n", "")), t_end=0.1, samples=2)
    assert [event["element"] for event in found.events] == ["c1", "c2", "c3", "c4"]
    for run in (found, mbs.simulate(loaded("newtons_cradle"), t_end=0.1, samples=2)):
        assert list(run.final["speeds"].values()) == pytest.approx([0, 0, 0, 0, 2], abs=1e-12)


def test_a_bouncing_ball_comes_to_rest_in_time() -> None:
    system = loaded("bouncing_ball")
    known = values(system)
    run = mbs.simulate(system, samples=5)
    first, last = run.events[0], run.events[-1]
    assert first["impulse"] == pytest.approx(eval("m*(1 + e)*sqrt(2*g*h)", known), rel=1e-9)
    assert last["kind"] == "closed"
    assert last["t"] == pytest.approx(eval("sqrt(2*h/g)*(1 + e)/(1 - e)", known), rel=1e-9)
    assert run["y"][-1] == pytest.approx(0, abs=1e-12)


def test_a_ball_struck_by_a_cue_rolls_at_last() -> None:
    system = loaded("billiards")
    known = values(system)
    run = mbs.simulate(system, samples=5)
    speed = eval("5/7*I/m*(1 + c/r)", known)
    (rolls,) = run.events
    assert (rolls["element"], rolls["kind"]) == ("table", "stick")
    assert rolls["t"] == pytest.approx(eval("(speed - I/m)/(mu*g)", {**known, "speed": speed}), rel=1e-9)
    assert run["u_x"][-1] == pytest.approx(speed, rel=1e-9)
    assert run["u_phi"][-1] == pytest.approx(-speed / known["r"], rel=1e-9)


def test_a_cue_at_two_fifths_of_the_radius_lets_the_ball_roll_at_once() -> None:
    after = mbs.solve(loaded("billiards"), parameters={"c": 0.012}).impact.after
    assert after["u_x"].value + 0.03 * after["u_phi"].value == pytest.approx(0, abs=1e-12)


def test_a_falling_load_jerks_the_other_up() -> None:
    system = loaded("falling_load")
    known = values(system)
    run = mbs.simulate(system, samples=5)
    taut = next(event for event in run.events if event["kind"] == "taut")
    assert taut["t"] == pytest.approx(eval("sqrt(2*h/g)", known), rel=1e-9)
    assert taut["impulse"] == pytest.approx(eval("m*M*sqrt(2*g*h)/(m + M)", known), rel=1e-9)
    assert taut["lost"] == pytest.approx(eval("m*M*g*h/(m + M)", known), rel=1e-9)
    speed = eval("m*sqrt(2*g*h)/(m + M) - g*(M - m)/(m + M)*after", {**known, "after": run.t[-1] - taut["t"]})
    assert run["u_y2"][-1] == pytest.approx(speed, rel=1e-9)
    assert run["u_y1"][-1] == pytest.approx(-speed, rel=1e-9)


@pytest.mark.parametrize("k", [1.0, 0.0, -1.0])
def test_two_billiard_balls_roll_at_last_after_a_follow_a_stun_and_a_draw_shot(k: float) -> None:
    """Angular momentum of each ball about the line of the cloth on which it runs: J = 2/5 m r^2 and what p gave it."""
    system = loaded("two_billiard_balls")
    known = {**values(system), "k": k, "s": (k > 0) - (k < 0)}
    p = eval("(1 + e)*m*v/(2 - s*f*mu)", known)
    found = mbs.solve(system, parameters={"k": k}).impact.impulses["balls"]
    assert found["normal"].value == pytest.approx(p, rel=1e-12)
    assert found["friction"].value == pytest.approx(known["s"] * known["f"] * p, abs=1e-15)
    run = mbs.simulate(system, parameters={"k": k}, samples=3)
    rolled = {"cloth1", "cloth2"}
    assert {event["element"] for event in run.events if event["kind"] == "stick"} == rolled
    for ball, formula in (("1", "(5 + 2*k)*v/7 - 5*(1 + s*f)*p/(7*m)"), ("2", "5*(1 - s*f)*p/(7*m)")):
        speed = eval(formula, {**known, "p": p})
        assert run[f"u_x{ball}"][-1] == pytest.approx(speed, rel=1e-9)
        assert run[f"u_phi{ball}"][-1] == pytest.approx(-speed / known["r"], rel=1e-9)
        assert run[f"u_y{ball}"][-1] == pytest.approx(0.0, abs=1e-12)
