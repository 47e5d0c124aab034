"""`solve`: textbook problems as books print them, formulas that hold beyond their sample, and questions."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import solution_text
from multibody_sym.scalars.elementary import postorder
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.values import Value

HEAD = "multibody_sym: 1\nname: problem\n"


def problem(model: str) -> mbs.System:
    """Return the system of a model file without its head."""
    return mbs.loads(HEAD + model)


def values(solution: mbs.Solution) -> dict[str, Value]:
    """Return everything that was found, as `accelerations.x`, `answers.path`, `joint.fx`, `rope.tension`."""
    found = {f"accelerations.{name}": value for name, value in solution.accelerations.items()}
    found |= {f"answers.{name}": value for name, value in solution.answers.items()}
    found |= {f"{e}.{c}": value for e, parts in solution.reactions.items() for c, value in parts.items()}
    return found


def number(value: Value) -> float:
    assert value.value is not None
    return value.value


# --- the textbook's own ----------------------------------------------------------------------------------------------

# --- what cannot be answered by a formula ----------------------------------------------------------------------------

LOOP = """
gravity: [0, -9.81, 0]
parameters: {r: {value: 0.1 m, positive: true}, l: {value: 0.3 m, positive: true}, m: 1 kg}
bodies:
  crank: {mass: m, com: [r/2, 0, 0], inertia: {Izz: m*r^2/12}, points: {pin: [r, 0, 0]}}
  rod: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {pin: [l, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, q: phi, initial: {q: 30 deg, u: 10, known: true}}
  B: {type: revolute, parent: crank.pin, child: rod, axis: z, q: psi}
constraints: {guide: {type: expression, zero: r*sin(phi) + l*sin(phi + psi)}}
"""


def test_assembled_coordinates_keep_their_names() -> None:
    """A coordinate that was found numerically stands in the formula as a letter; the formula holds there."""
    system = problem(LOOP)
    solution = mbs.solve(system)
    psi = -math.asin(0.1 * 0.5 / 0.3) - math.pi / 6
    assert solution.coordinates["psi"] == pytest.approx(psi, rel=1e-12)
    letters = {symbol("r"): 0.1, symbol("l"): 0.3, symbol("m"): 1.0}
    letters |= {symbol(name): x for name, x in (*solution.coordinates.items(), *solution.speeds.items())}
    formula = solution.reactions["guide"]["multiplier"].expression
    if formula is not None:
        assert evaluate_float([formula], letters)[0] == pytest.approx(number(solution.reactions["guide"]["multiplier"]))
    run = mbs.simulate(system, t_end=1e-4, samples=3, backend="python", rtol=1e-12)
    rate = (run["u_psi"][2] - run["u_psi"][0]) / 1e-4 - 0.0
    assert number(solution.accelerations["psi"]) == pytest.approx(rate, rel=1e-2)


def test_components_that_are_not_unique_stand_in_no_row_of_a_joint() -> None:
    told = solution_text(mbs.solve(mbs.load(Path(__file__).parents[2] / "examples" / "three_cranks.yaml")))
    assert "  fy(B1) = -M*g*m/(12*(M + m)) = -0.654 N\n" in told
    assert "fx(A1) =" not in told
    assert "  fx, fy, fz, mx, my of A1, A2, A3; fx, fz, mx, my of B1, B2, B3\n" in told


# --- questions -------------------------------------------------------------------------------------------------------

PENDULUM = """
gravity: [0, -g, 0]
parameters: {m: 1 kg, g: 10, l: {value: 2, positive: true}}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {q: 30 deg}}}
"""


def test_a_pendulum_s_path_time_and_speed_come_from_a_simulation() -> None:
    asked = "ask: {path: {of: bob, after: 3 s}, time: {phi: 0}, speed: {of: bob, at: {phi: 0}}, never: {phi: 1}}\n"
    solution = mbs.solve(problem(PENDULUM + asked))
    quarter = math.sqrt(2 / 10) * 1.5981420021347  # K(sin 15 deg): a quarter of the period
    swings, rest = divmod(3, quarter)
    assert number(solution.answers["time"]) == pytest.approx(quarter, rel=1e-9)
    assert number(solution.answers["speed"]) == pytest.approx(math.sqrt(2 * 10 * 2 * (1 - math.sqrt(3) / 2)), rel=1e-9)
    arc = 2 * math.pi / 6
    k = math.sin(math.pi / 12)
    from scipy.special import ellipj

    turned = 2 * math.asin(k * float(ellipj(rest * math.sqrt(5) + 1.5981420021347 * (swings + 1), k**2)[0]))
    left = abs(turned) * 2 if int(swings) % 2 else arc - abs(turned) * 2
    assert number(solution.answers["path"]) == pytest.approx(swings * arc + left, rel=1e-8)
    assert solution.answers["never"].value is None
    assert any("never" in condition for condition in solution.conditions)
    assert str(solution.answers["speed"]).startswith("sqrt(g*l*(2 - sqrt(3))) = ")
    assert all(solution.answers[name].expression is None for name in ("path", "time", "never"))


BOWL = """
multibody_sym: 1
name: bowl
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 1, R: {value: 0.5, positive: true}, r: {value: 0.1, positive: true}}
bodies: {arm: {points: {end: ["0", "r - R", "0"]}}, ball: {mass: m, inertia: {Izz: 2/5*m*r^2}}}
joints:
  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta, initial: {q: 30 deg}}
  B: {type: revolute, parent: arm.end, child: ball, axis: z, q: psi, initial: {q: R/r*pi/6}}
constraints: {roll: {type: expression, zero: "r*psi - R*theta", acts: in_joints}}
"""


def test_what_stands_below_is_positive_at_the_values_of_the_model() -> None:
    system, rng = mbs.loads(BOWL), np.random.default_rng(5)
    found = mbs.solve(system)
    together = {**found.accelerations, **found.reactions["A"]}
    formulas = {name: x.expression for name, x in together.items() if x.value and x.expression is not None}
    assert formulas.keys() >= {"theta", "psi", "fx", "fy"}
    at = {symbol(name): value for name, value in (("g", 9.81), ("m", 1.0), ("R", 0.5), ("r", 0.1))}
    for formula in formulas.values():
        quotients = [n for n in postorder([formula]) if n.op == "div"]
        assert quotients
        assert all(x > 0 for x in evaluate_float([n.args[1] for n in quotients], at))
    for _ in range(4):
        given = {"g": 9.81, "m": rng.uniform(1, 2), "R": rng.uniform(0.5, 1), "r": rng.uniform(0.1, 0.4)}
        letters = {symbol(name): value for name, value in given.items()}
        elsewhere = mbs.solve(system, given)
        again = {**elsewhere.accelerations, **elsewhere.reactions["A"]}
        expected = [number(again[name]) for name in formulas]
        assert evaluate_float(list(formulas.values()), letters) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_the_joint_that_closes_a_loop_has_a_reaction_like_the_others(coordinates: str) -> None:
    model = mbs.load(Path(__file__).parents[2] / "examples" / "four_bar.yaml")
    settings = replace(model.simulation, coordinates=coordinates)
    system = replace(model, simulation=settings)
    solution, run = mbs.solve(system), mbs.simulate(model, t_end=0.01, samples=2)
    largest = max(float(np.abs(x).max()) for parts in run.reactions.values() for x in parts.values())
    for name in model.joints:
        expected = {component: float(values[0]) for component, values in run.reactions[name].items()}
        found = {component: value.value for component, value in solution.reactions[name].items()}
        for component in ("fx", "fy", "mz"):
            assert found[component] == pytest.approx(expected[component], rel=1e-9, abs=1e-10 * largest)
