"""`solve` of loops: formulas in named letters where there were numbers, each letter with what it stands for."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.algebra.quotients import NoClosedFormError
from multibody_sym.answers.instant.letters import Letters
from multibody_sym.cli.main import main
from multibody_sym.documents.notebook import solution_markdown
from multibody_sym.documents.solution import solution_text
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, as_node, symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text
from multibody_sym.text.values import Value

EXAMPLES = Path(__file__).parents[2] / "examples"

SLIDER_CRANK = """
multibody_sym: 1
name: press
gravity: [0, -g, 0]
parameters:
  g: 9.81 m/s^2
  r: {value: 0.1 m, positive: true}
  l: {value: 0.3 m, positive: true}
  m1: 1 kg
  m2: 0.5 kg
  m3: 0.8 kg
  M0: 2 N*m
  p: 30 N
bodies:
  crank: {mass: m1, com: [r/2, 0, 0], inertia: {Izz: m1*r^2/12}, points: {pin: [r, 0, 0]}}
  rod: {mass: m2, com: [l/2, 0, 0], inertia: {Izz: m2*l^2/12}, points: {pin: [l, 0, 0]}}
  piston: {mass: m3}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: theta, initial: {q: 40 deg, u: 8, known: true}}
  B: {type: revolute, parent: crank.pin, child: rod, axis: z, q: psi, initial: {q: -53 deg}}
  D: {type: prismatic, parent: ground, child: piston, axis: x, q: s, initial: {q: 0.37 m}}
  C: {type: revolute, parent: rod.pin, child: piston, axis: z, cut: true}
forces:
  motor: {type: torque, joint: A, value: M0}
  gas: {type: force, on: piston, value: [-p, 0, 0]}
ask:
  acceleration_of_piston: {value: "acceleration(piston, x)"}
  turning_of_rod: {value: "angular_velocity(rod, z)"}
  side_force: {value: "reaction(D, fy)"}
  twice: {value: "2*side_force"}
"""


def values_of(solution: mbs.Solution) -> dict[str, Value]:
    """All values of a solution by names."""
    forces = {f"{name} {part}": x for name, parts in solution.reactions.items() for part, x in parts.items()}
    start = {f"start {name}": x for name, x in solution.assembled.items()}
    return {**solution.accelerations, **forces, **solution.answers, **start}


def numbers_at(system: mbs.System, given: Mapping[str, float], start: Mapping[str, float]) -> dict[str, float]:
    """The state that a start leads to, its accelerations and reactions, in floats alone."""
    mechanism, begin = examined_state(Overrides(given, start).of(system)).in_joints
    state = state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(composite_body(mechanism, state))
    instant = StateQuantities(motion_of(mechanism, state), found.udot.tolist(), found.multipliers.tolist())
    forces = {f"{name} {part}": x for name, parts in instant.reactions.items() for part, x in parts.items()}
    named = [(c.name, x) for c, x in zip(mechanism.coordinates, begin.q, strict=True)]
    named += [(u.name, x) for u, x in zip(mechanism.speeds, begin.u, strict=True)]
    rates = {f"{c.name}''": x for c, x in zip(mechanism.coordinates, instant.udot, strict=True)}
    return {**dict(named), **rates, **forces}


def with_letters(solution: mbs.Solution, known: Mapping[str, float]) -> dict[Node, float]:
    """Values of all letters of a solution's formulas where these are known, the others by their formulas."""
    values = {symbol(name): x for name, x in known.items()}
    waiting = {name: one.expression for name, one in solution.where.items() if symbol(name) not in values}
    for _ in range(len(waiting)):
        for name, form in list(waiting.items()):
            assert form is not None, name
            if all(x in values for x in leaves([form], "symbol")):
                values[symbol(name)] = evaluate_float([parse(text(form))], values)[0]
                del waiting[name]
    assert not waiting
    return values


def agrees(solution: mbs.Solution, known: Mapping[str, float], there: Mapping[str, float], most: float) -> int:
    """Compare all formulas in letters of accelerations and reactions with numbers elsewhere; return how many.

    `known` are the parameters there; letters of the state are as there, all others by their formulas.
    """
    state = {name: x for name, x in there.items() if name.isidentifier()}
    values = with_letters(solution, {**known, **state})
    size, count = max(map(abs, there.values())), 0
    told = values_of(solution)
    for name, number in there.items():
        value = told.get(name.removesuffix("''")) if name not in state else None
        if value is not None and value.expression is not None and value.value:
            found = evaluate_float([parse(text(value.expression))], values)[0]
            assert abs(found - number) <= most * (abs(number) + 0.01 * size), (name, found, number)
            count += 1
    for name, one in solution.where.items():
        if one.equation is not None:
            left, right = evaluate_float(one.equation, values)
            assert left == pytest.approx(right, rel=1e-12, abs=1e-13), name
    return count


@pytest.fixture(scope="module")
def crank() -> mbs.Solution:
    return mbs.solve(mbs.loads(SLIDER_CRANK))


def test_all_answers_of_a_slider_crank_are_formulas_that_hold_at_twenty_positions(crank: mbs.Solution) -> None:
    system, rng = mbs.loads(SLIDER_CRANK), np.random.default_rng(3)
    assert all(x.expression is not None for x in crank.accelerations.values())
    assert all(x.expression is not None for x in crank.answers.values())
    for _ in range(20):
        given = {"r": rng.uniform(0.05, 0.15), "l": rng.uniform(0.2, 0.5)}
        given |= {"M0": rng.uniform(-5, 5), "m3": rng.uniform(0.2, 3)}
        start = {"theta": rng.uniform(-math.pi, math.pi), "u_theta": rng.uniform(-20, 20)}
        beta = math.asin(given["r"] * math.sin(start["theta"]) / given["l"])
        way = given["r"] * math.cos(start["theta"]) + given["l"] * math.cos(beta)
        place = {"psi": -beta - start["theta"], "s": way}
        values = {"g": 9.81, "m1": 1.0, "m2": 0.5, "p": 30.0, **given}
        assert agrees(crank, values, numbers_at(system, given, {**start, **place}), 1e-12) > 9


def test_the_piston_accelerates_as_in_the_textbook(crank: mbs.Solution) -> None:
    """s = r cos(theta) + sqrt(l^2 - r^2 sin(theta)^2), differentiated twice by hand."""
    r, l, theta, u, a = 0.1, 0.3, math.radians(40), 8.0, crank.accelerations["theta"].value
    assert a is not None
    w = math.sqrt(l**2 - (r * math.sin(theta)) ** 2)
    along = math.sin(theta) + r * math.sin(2 * theta) / (2 * w)
    steady = math.cos(theta) + r * math.cos(2 * theta) / w + r**3 * math.sin(2 * theta) ** 2 / (4 * w**3)
    values = {"g": 9.81, "m1": 1.0, "m2": 0.5, "m3": 0.8, "p": 30.0, "M0": 2.0, "r": r, "l": l}
    known = with_letters(crank, {**values, **crank.coordinates, **crank.speeds})
    answer = crank.answers["acceleration_of_piston"].expression
    assert answer is not None
    assert evaluate_float([answer], known)[0] == pytest.approx(-r * (a * along + u**2 * steady), rel=1e-12)
    assert text(answer) == text(crank.accelerations["s"].expression)  # type: ignore[arg-type]


def test_the_rod_of_a_slider_crank_has_its_angle_as_a_formula(crank: mbs.Solution) -> None:
    assert text(crank.where["psi"].expression) == "-(asin(r*sin(theta)/l) + theta)"  # type: ignore[arg-type]
    assert crank.where["psi"].value == pytest.approx(crank.coordinates["psi"], abs=1e-15)


@pytest.fixture(scope="module")
def four_bar() -> mbs.Solution:
    return mbs.solve(mbs.load(EXAMPLES / "four_bar.yaml"))


def test_a_four_bar_turns_by_sines_of_differences(four_bar: mbs.Solution) -> None:
    """Loop closure as complex numbers, differentiated twice, solved in floats: another route to all numbers."""
    d, a, b, c = 0.5, 0.2, 0.5, 0.4
    alpha = four_bar.coordinates["crank_angle"]
    beta = alpha + four_bar.coordinates["coupler_angle"]
    delta, u = four_bar.coordinates["rocker_angle"], 10.0
    assert abs(a * np.exp(1j * alpha) + b * np.exp(1j * beta) - d - c * np.exp(1j * delta)) < 1e-13
    given = {"d": d, "a": a, "b": b, "c": c, "g": 9.81, "rho": 2.0, "torque": 0.5}
    known = with_letters(four_bar, {**given, **four_bar.coordinates, **four_bar.speeds})
    matrix = np.array([[-b * math.sin(beta), c * math.sin(delta)], [b * math.cos(beta), -c * math.cos(delta)]])
    w = np.linalg.solve(matrix, [a * u * math.sin(alpha), -a * u * math.cos(alpha)])
    turning = [parse("u_crank_angle + u_coupler_angle"), parse("u_rocker_angle")]
    assert evaluate_float(turning, known) == pytest.approx(w)
    rates = [x.expression for x in (four_bar.assembled["u_coupler_angle"], four_bar.assembled["u_rocker_angle"])]
    assert evaluate_float([x for x in rates if x is not None], known) == pytest.approx([w[0] - u, w[1]], rel=1e-12)
    turned = known[symbol("a_crank_angle")]
    left = a * (1j * turned - u**2) * np.exp(1j * alpha) - b * w[0] ** 2 * np.exp(1j * beta)
    left += c * w[1] ** 2 * np.exp(1j * delta)
    found = np.linalg.solve(matrix, [-left.real, -left.imag])
    forms = [four_bar.accelerations[x].expression for x in ("coupler_angle", "rocker_angle")]
    values = evaluate_float([x for x in forms if x is not None], known)
    assert values == pytest.approx([found[0] - turned, found[1]], rel=1e-12)
    assert text(four_bar.assembled["u_rocker_angle"].expression) == (  # type: ignore[arg-type]
        "a*u_crank_angle*sin(coupler_angle)/(c*sin(coupler_angle + crank_angle - rocker_angle))"
    )


def test_formulas_of_a_four_bar_hold_at_twenty_positions(four_bar: mbs.Solution) -> None:
    system, rng = mbs.load(EXAMPLES / "four_bar.yaml"), np.random.default_rng(5)
    known: dict[str, float] = {"g": 9.81, "rho": 2.0}
    for _ in range(20):
        given = {"d": 0.5, "a": rng.uniform(0.1, 0.2), "b": rng.uniform(0.45, 0.55), "c": rng.uniform(0.38, 0.42)}
        start = {"crank_angle": rng.uniform(0.7, 1.3), "u_crank_angle": rng.uniform(-10, 10)}
        there = numbers_at(system, {**given, "torque": 0.5}, start)
        assert agrees(four_bar, {**known, **given, "torque": 0.5}, there, 1e-12) > 9


def test_every_letter_of_a_formula_is_of_the_model_or_defined(four_bar: mbs.Solution) -> None:
    names = {"g", "d", "a", "rho", "b", "c", "torque", *four_bar.where}
    for value in (*values_of(four_bar).values(), *four_bar.where.values()):
        parts = [] if value.expression is None else [value.expression]
        assert {str(x.data) for x in leaves(parts, "symbol")} <= names


def test_letters_leave_names_of_the_model_alone() -> None:
    taken = SLIDER_CRANK.replace("m1: 1 kg", "m1: 1 kg\n  a_theta: 3 s\n  C_x: 2 m\n  J_theta: 4")
    found = mbs.solve(mbs.loads(taken))
    assert not {"a_theta", "C_x", "J_theta"} & set(found.where)
    assert {"a_theta_2", "C_x_2", "J_theta_2"} <= set(found.where)


def test_an_answer_may_name_another_that_is_in_letters(crank: mbs.Solution) -> None:
    found = crank.answers
    assert found["side_force"].value is not None
    assert found["twice"].value == pytest.approx(2 * found["side_force"].value, rel=1e-12)
    once, twice = (found[x].expression for x in ("side_force", "twice"))
    assert once is not None
    assert twice is not None
    values = {x: k + 1.5 for k, x in enumerate(leaves([once], "symbol"))}
    assert evaluate_float([twice], values)[0] == pytest.approx(2 * evaluate_float([once], values)[0], rel=1e-14)


def test_what_has_a_closed_form_keeps_it_and_needs_no_letters() -> None:
    found = mbs.solve(mbs.load(EXAMPLES / "double_pendulum.yaml"))
    assert found.where == {}
    assert found.as_json()["where"] == {}


def test_a_loop_in_space_stays_a_number_or_tells_all_its_letters() -> None:
    found = mbs.solve(mbs.load(EXAMPLES / "spatial_four_bar.yaml"))
    known = {symbol(name): one.value for name, one in found.where.items()}
    for value in values_of(found).values():
        if value.expression is not None and value.value is not None:
            missing = set(leaves([value.expression], "symbol")) - set(known)
            names = {"g", "a", "alpha", "b", "beta", "k", *found.coordinates, *found.speeds}
            assert {str(x.data) for x in missing} <= names


def test_letters_are_told_in_text_json_and_notebooks(
    four_bar: mbs.Solution, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = solution_text(four_bar).split("where, as formulas name it\n")[1]
    assert "  crank_angle = pi/3 = 60 deg\n" in lines
    assert "  rocker_angle = 83.2514 deg, from c*sin(rocker_angle) = a*sin(crank_angle)" in lines
    assert "  a_rocker_angle = rocker_angle''\n" in lines
    assert "**Where**" in solution_markdown(four_bar)
    assert "`rocker_angle` from `c*sin(rocker_angle) = " in solution_markdown(four_bar)
    assert main(["solve", str(EXAMPLES / "four_bar.yaml"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["where"]
    assert told["rocker_angle"]["expression"] is None
    assert told["rocker_angle"]["equation"].startswith("c*sin(rocker_angle) = ")
    assert told["k_rocker"] == {
        "value": pytest.approx(0.329403256, rel=1e-9),
        "expression": "a*sin(coupler_angle)/(c*sin(coupler_angle + crank_angle - rocker_angle))",
        "equation": None,
        "unit": "",
        "says": "how fast rocker moves for a unit speed of crank_angle",
    }


def test_loops_of_many_parts_stay_numbers() -> None:
    """Seven bodies in three loops: letters of letters would be long to find and longer to read."""
    found = mbs.solve(mbs.load(EXAMPLES / "andrews_squeezer.yaml"))
    assert found.where == {}
    assert all(x.value is not None for x in found.accelerations.values())


def test_a_loop_whose_closure_is_long_is_left_before_it_is_written() -> None:
    """Of loops in space with more than thirty terms all that follows grows too long, which took most of the time."""
    letters = Letters({})
    names = [symbol(f"x{k}") for k in range(31)]
    for k, name in enumerate(names):
        letters.add(name, 1.0 + k / 7)
    assert evaluate_float([letters.simplified(as_node(sum(names[:29])))], letters.values)[0] == pytest.approx(
        sum(1.0 + k / 7 for k in range(29)), rel=1e-12
    )
    with pytest.raises(NoClosedFormError, match="how a loop closes is too long"):
        letters.simplified(as_node(sum(names)))


DRIVEN = """
multibody_sym: 1
name: driven
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {O: [0.689, 0, 0]}}
  crank: {mass: 0.838, inertia: {Izz: 0.01}, points: {pin: [0.249, 0, 0]}}
  coupler: {mass: 7.15, inertia: {Izz: 0.2}, points: {pin: [0.62, 0, 0]}}
  rocker: {mass: 1.99, inertia: {Izz: 0.05}, points: {pin: [0.565, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, motion: 1.707 + 3.94*t}
  B: {type: revolute, parent: crank.pin, child: coupler, q: psi, initial: {q: -1.22}}
  D: {type: revolute, parent: ground.O, child: rocker, q: phi, initial: {q: 1.89}}
  C: {type: revolute, parent: coupler.pin, child: rocker.pin, cut: true}
"""
TRIPOD = """
multibody_sym: 1
name: tripod
gravity: [0, 0, -g]
parameters: {g: 9.81 m/s^2, m: 2 kg, h: {value: 1.2 m, positive: true}, r: {value: 0.6 m, positive: true}}
bodies:
  ground: {points: {A: [r, 0, 0], B: [-r/2, r*sqrt(3)/2, 0], C: [-r/2, -r*sqrt(3)/2, 0]}}
  head: {mass: m}
joints: {free: {type: point, axes: xyz, parent: ground, child: head, q: [x, y, z], initial: {q: [0, 0, 1.2 m]}}}
constraints:
  la: {type: distance, between: [ground.A, head], value: sqrt(r^2 + h^2)}
  lb: {type: distance, between: [ground.B, head], value: sqrt(r^2 + h^2)}
  lc: {type: distance, between: [ground.C, head], value: sqrt(r^2 + h^2)}
forces: {wind: {type: force, on: head, value: [5, 0, 0]}}
"""


def test_a_driven_linkage_without_freedom_accelerates_as_its_closure() -> None:
    """Loop closure as complex numbers, differentiated twice; the letters have no freedom to solve for."""
    found = mbs.solve(mbs.loads(DRIVEN))
    alpha, w, a, b, c = 1.707, 3.94, 0.249, 0.62, 0.565
    beta, delta = alpha + found.coordinates["psi"], found.coordinates["phi"]
    p, q, s = b * 1j * np.exp(1j * beta), -c * 1j * np.exp(1j * delta), a * np.exp(1j * alpha)
    assert abs(s + p / 1j + q / 1j - 0.689) < 1e-13
    matrix = np.array([[p.real, q.real], [p.imag, q.imag]])
    u = np.linalg.solve(matrix, [-(1j * w * s).real, -(1j * w * s).imag])
    left = w**2 * s - 1j * p * u[0] ** 2 - 1j * q * u[1] ** 2
    turned = np.linalg.solve(matrix, [left.real, left.imag])
    values = [found.accelerations[x].value for x in ("psi", "phi")]
    assert values == pytest.approx([turned[0], turned[1]], rel=1e-11)


def test_a_head_on_three_rods_is_held_by_statics() -> None:
    found = mbs.solve(mbs.loads(TRIPOD))
    assert [x.value for x in found.accelerations.values()] == pytest.approx([0, 0, 0], abs=1e-13)
    tops = np.array([[0.6, 0, 0], [-0.3, 0.3 * 3**0.5, 0], [-0.3, -0.3 * 3**0.5, 0]]) - [0, 0, 1.2]
    pulls = np.linalg.solve((tops / np.linalg.norm(tops, axis=1)[:, None]).T, [-5, 0, 2 * 9.81])
    values = [found.reactions[name]["tension"].value for name in ("la", "lb", "lc")]
    assert values == pytest.approx(list(pulls), rel=1e-12)
    printed = solution_text(found)
    assert "a_z" not in printed  # accelerations that vanish are no letters: their legend read a_z = 0 = -1.18e-30
    for name in ("la", "lb", "lc"):
        form = found.reactions[name]["tension"].expression
        assert form is not None
        known = {symbol(x): v for x, v in {"g": 9.81, "m": 2, "h": 1.2, "r": 0.6, "x": 0, "y": 0, "z": 1.2}.items()}
        assert evaluate_float([form], known)[0] == pytest.approx(found.reactions[name]["tension"].value, rel=1e-12)
