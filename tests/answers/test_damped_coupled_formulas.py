"""x(t) of coupled damped and driven systems: put into equations written by hand, and integrated."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest
from exact import exactly
from scipy.integrate import solve_ivp

import multibody_sym as mbs
from multibody_sym.scalars.calculus import derivative
from multibody_sym.scalars.functions import evaluate, evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse

T = symbol("t")
VALUES = {"m": "2", "M": "3", "k": "8", "h": "3", "c": "1/2", "b": "1/5", "F": "4", "w": "7/10", "a": "1/10",
    "v": "1/5", "T": "4/5", "n": "3/4"}  # fmt: skip
PARAMETERS = {symbol(x): symbol(x) for x in (*VALUES, "t")}
SYSTEMS: dict[str, tuple[int, str, list[str], list[str], list[str]]] = {
    # name: unknowns, forces, equations x'' = .., start values, start speeds; every letter a parameter
    "dampers everywhere": (2,
        "S1 k b, S2 k b, S12 h c",
        ["-k*x1/m - b*u1/m + h*(x2 - x1)/m + c*(u2 - u1)/m", "-k*x2/m - b*u2/m + h*(x1 - x2)/m + c*(u1 - u2)/m"],
        ["a", "0"], ["0", "v"]),
    "driven": (2,
        "S1 k 0, S2 k 0, S12 h 0, F1 F*cos(w*t)",
        ["(-k*x1 + h*(x2 - x1) + F*cos(w*t))/m", "(-k*x2 + h*(x1 - x2))/m"], ["a", "0"], ["0", "0"]),
    "driven and damped": (2,
        "S1 k b, S2 k b, S12 h 0, F2 F*sin(w*t)",
        ["(-k*x1 - b*u1 + h*(x2 - x1))/m", "(-k*x2 - b*u2 + h*(x1 - x2) + F*sin(w*t))/m"], ["0", "0"], ["0", "0"]),
    "free": (2,
        "S12 h c", ["(h*(x2 - x1) + c*(u2 - u1))/m", "(h*(x1 - x2) + c*(u1 - u2))/M"], ["a", "0"], ["0", "v"]),
    "drags without springs": (2,
        "S12 0 c, F1 F", ["(c*(u2 - u1) + F)/m", "c*(u1 - u2)/M"], ["a", "0"], ["0", "v"]),
    "a pulse": (2,
        "S12 h 0, F1 F*exp(-t/T)", ["(h*(x2 - x1) + F*exp(-t/T))/m", "h*(x1 - x2)/M"], ["0", "0"], ["0", "0"]),
    "in a magnetic field": (2,
        "F1 n*u2, F2 -n*u1 + F", ["n*u2/m", "(-n*u1 + F)/m"], ["a", "0"], ["0", "v"]),
    "turning frame": (2,
        "S1 k 0, S2 k 0, F1 n*u2, F2 -n*u1", ["(-k*x1 + n*u2)/m", "(-k*x2 - n*u1)/m"], ["a", "0"], ["0", "0"]),
    "three": (3,
        "S1 k b, S12 k 0, S23 k 0, S3 k b, S2 k b",
        ["(-2*k*x1 + k*x2 - b*u1)/m", "(k*x1 - 3*k*x2 + k*x3 - b*u2)/m", "(k*x2 - 2*k*x3 - b*u3)/m"],
        ["a", "0", "0"], ["0", "0", "v"]),
    "a constant force": (2,
        "S1 k b, S12 h 0, S2 k b, F2 F",
        ["(-k*x1 - b*u1 + h*(x2 - x1))/m", "(-k*x2 - b*u2 + h*(x1 - x2) + F)/m"], ["a", "a"], ["0", "0"]),
}  # fmt: skip
MASSES = {"free": "mM", "drags without springs": "mM", "a pulse": "mM"}


def model(name: str) -> str:
    size, forces, _, places, speeds = SYSTEMS[name]
    masses = MASSES.get(name, "mmm")
    given = ", ".join(f"{x}: {{value: {y}, positive: true}}" for x, y in VALUES.items())
    lines = ["multibody_sym: 1", "name: pair", f"parameters: {{{given}}}", "bodies:"]
    lines += [f"  p{k}: {{mass: {masses[k - 1]}}}" for k in range(1, size + 1)]
    lines += ["joints:"]
    for k in range(1, size + 1):
        start = f"initial: {{q: {places[k - 1]}, u: {speeds[k - 1]}}}"
        lines += [f"  J{k}: {{type: prismatic, parent: ground, child: p{k}, axis: x, q: x{k}, {start}}}"]
    lines += ["forces:"]
    for force in forces.split(", "):
        word, *rest = force.split(" ", 1)
        if word[0] == "F":
            value = re.sub("u(?=[12])", "u_x", rest[0])
            lines += [f"  {word}: {{type: torque, joint: J{word[1]}, value: {value}}}"]
        else:
            stiffness, damping = rest[0].split()
            where = f"joint: J{word[1]}" if len(word) == 2 else f"between: [p{word[1]}, p{word[2]}]"
            lines += [f"  {word}: {{type: spring_damper, {where}, stiffness: {stiffness}, damping: {damping}}}"]
    asked = [f"x{k}: {{formula: x{k}}}" for k in range(1, size + 1)]
    asked += ["v1: {formula: u_x1}"] if name != "driven and damped" else []  # that one is too long to be told
    return "\n".join([*lines, f"ask: {{{', '.join(asked)}}}", "simulation: {t_end: 3 s}"])


CHEAP = ("driven", "free", "drags without springs", "in a magnetic field")


@pytest.fixture(scope="module", params=[x if x in CHEAP else pytest.param(x, marks=pytest.mark.long) for x in SYSTEMS])
def solved(request: pytest.FixtureRequest) -> tuple[str, dict[str, Node]]:
    solution = mbs.solve(mbs.loads(model(request.param)))
    formulas = {name: answer.expression for name, answer in solution.answers.items()}
    assert all(formulas.values()), [x for x in solution.conditions if "no solution" in x]
    assert not [x for x in solution.conditions if "while" in x]
    return request.param, formulas


def test_they_satisfy_the_equations_written_by_hand(solved: tuple[str, dict[str, Node]]) -> None:
    name, formulas = solved
    size, _, equations, places, speeds = SYSTEMS[name]
    put = {f"x{k}": formulas[f"x{k}"] for k in range(1, size + 1)}
    put |= {f"u{k}": derivative(formulas[f"x{k}"], T) for k in range(1, size + 1)}
    for k, equation in enumerate(equations, 1):
        (right,) = evaluate([parse(equation)], {symbol(x): y for x, y in put.items()} | PARAMETERS)
        missed = [derivative(put[f"u{k}"], T) - right, put["u1"] - formulas.get("v1", put["u1"])]
        for t in (Fraction(1, 3), Fraction(17, 10)):
            assert max(abs(x) for x in exactly(missed, VALUES, t)) < 1e-40
        start = [put[f"x{k}"] - parse(places[k - 1]), put[f"u{k}"] - parse(speeds[k - 1])]
        assert max(abs(x) for x in exactly(start, VALUES, Fraction(0))) < 1e-40


def test_they_are_what_integration_shows(solved: tuple[str, dict[str, Node]]) -> None:
    name, formulas = solved
    size, _, equations, places, speeds = SYSTEMS[name]
    values = {symbol(x): float(Fraction(y)) for x, y in VALUES.items()}
    x, u = ([symbol(f"{letter}{k}") for k in range(1, size + 1)] for letter in "xu")
    right = [parse(each) for each in equations]

    def rates(t: float, y: np.ndarray) -> list[float]:
        there = {**values, **dict(zip((*x, *u), y, strict=True)), T: t}
        return [*y[size:], *evaluate_float(right, there)]

    start = evaluate_float([parse(each) for each in (*places, *speeds)], values)
    run = solve_ivp(rates, (0.0, 2.0), start, "DOP853", [2.0], rtol=1e-12, atol=1e-13)
    told = evaluate_float([formulas[f"x{k}"] for k in range(1, size + 1)], {**values, T: 2.0})
    assert told == pytest.approx(run.y[:size, -1], abs=1e-9)
