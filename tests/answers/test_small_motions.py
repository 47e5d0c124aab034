"""Small motions in symbols: frequencies as books print them, and as the eigenvalues of `linearize` are."""

from __future__ import annotations

import math
import pickle
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from small_motion_problems import PROBLEMS, Problem

import multibody_sym as mbs
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter
from multibody_sym.analysis.modes.matrices import place_of
from multibody_sym.documents.analysis import linearization_text, modes_text
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, NoSolutionError
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text
from multibody_sym.text.values import chosen_units

NAMES = [problem.name for problem in PROBLEMS]
SOME = [pytest.param(n, marks=[] if k % 3 == 0 else pytest.mark.long) for k, n in enumerate(NAMES)]
"""Every third problem on each run, all of them in long ones."""
BY_NAME = dict(zip(NAMES, PROBLEMS, strict=True))


@cache
def found(name: str) -> mbs.Modes:
    return mbs.modes(mbs.loads(BY_NAME[name].text))


def drawn(problem: Problem, random: np.random.Generator) -> dict[str, float]:
    """Return random values of the parameters with which the printed formulas hold; decimals of three digits."""
    signs = [parse(sign) for sign in problem.signs]
    while True:
        values = {name: float(f"{x * random.uniform(0.5, 2.0):.3g}") for name, x in problem.values.items()}
        known = {symbol(name): x for name, x in values.items()}
        if all(x > 0.0 for x in evaluate_float(signs, known)):
            return values


def precise(node: Node, values: dict[str, float]) -> PRECISE.mpf:
    """Return the value of an expression with 50 digits."""
    field = Field(10**7)
    known = {}
    for name, x in values.items():
        letter = symbol(name)
        known[letter] = field.letter(letter, Letter(letter, PRECISE.mpf(repr(x)), True))
    return exact(field, [node], known)[0].sample


@pytest.mark.parametrize("name", SOME)
def test_frequencies_are_those_of_books(name: str) -> None:
    problem, modes = BY_NAME[name], found(name)
    assert len(modes.frequencies) == len(problem.printed)
    random = np.random.default_rng(NAMES.index(name))
    points = [drawn(problem, random) for _ in range(20)]
    for k, printed in problem.printed.items():
        frequency, period = modes.frequencies[k - 1], modes.periods[k - 1]
        book = parse(printed)
        assert frequency.expression is not None
        assert period.expression is not None
        assert len(text(frequency.expression)) <= 1.5 * len(text(book))
        for values in points:
            omega, wanted = precise(frequency.expression, values), precise(book, values)
            assert abs(omega - wanted) <= 1e-40 * wanted
            assert abs(omega * precise(period.expression, values) - 2 * PRECISE.pi) < 1e-40


def are_eigenvalues(name: str, count: int) -> None:
    """Compare formulas with eigenvalues of A at random parameters, the state by its own formulas."""
    problem, modes = BY_NAME[name], found(name)
    place = place_of(mbs.loads(problem.text), None)
    flow, size = place.flow, len(place.flow.mechanism.speeds)
    places = flow.tangents(np.array(place.begin.q), np.array(place.begin.u)).places
    names = [*(c.name for c in flow.mechanism.coordinates), *(s.name for s in flow.mechanism.speeds)]
    zero = parse("0")
    nodes = [modes.at[n].expression or zero if n in modes.at else zero for n in names]
    formulas = [x.expression for x in modes.frequencies]
    random = np.random.default_rng(1000 + NAMES.index(name))
    for _ in range(count):
        values = drawn(problem, random)
        known = {symbol(n): x for n, x in values.items()}
        state = evaluate_float(nodes, known)
        q, u = state[: len(names) - size], state[len(names) - size :]
        at = flow.known(q, u, parameters=parameter_values(flow.mechanism, values))
        A = (flow.derivatives(at)[0] @ flow.span(at, places))[places]
        told = np.linalg.eigvals(A)
        for omega in evaluate_float([x for x in formulas if x is not None], known):
            assert np.abs(np.abs(told.imag) - omega).min() <= 1e-10 * omega


@pytest.mark.parametrize("name", SOME)
def test_frequencies_are_eigenvalues(name: str) -> None:
    are_eigenvalues(name, 10)


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_frequencies_are_eigenvalues_at_many_parameters(name: str) -> None:
    are_eigenvalues(name, 100)


# --- matrices, shapes, stability ------------------------------------------------------------------------------------


def test_shapes_solve_the_equations() -> None:
    for name in ("double_pendulum_of_two_masses", "linear_triatomic_molecule", "rod_on_a_string"):
        modes = found(name)
        M, K = (np.array([[x.value for x in row] for row in rows]) for rows in (modes.mass, modes.stiffness))
        for mode in modes.modes:
            v = np.array([x.value for x in mode.shape.values()])
            omega = 0.0 if mode.frequency is None else mode.frequency.value
            assert np.abs(K @ v - omega**2 * M @ v).max() < 1e-10 * np.abs(K).max()
            assert all(x.expression is not None for x in mode.shape.values())


# --- the state ------------------------------------------------------------------------------------------------------


def test_another_place_can_be_asked_for() -> None:
    system = mbs.loads(BY_NAME["simple_pendulum"].text)
    assert mbs.modes(system, at={"theta": "pi"}).stable is False
    with pytest.raises(NoSolutionError, match="speeds change"):
        mbs.modes(system, at={"theta": 1})
    with pytest.raises(InputError):
        mbs.modes(system, at="nowhere")


def test_a_rigid_system_has_no_modes() -> None:
    rigid = mbs.System("rigid", bodies={"a": mbs.Body(mass=1)}, joints={"A": mbs.Fixed("ground", "a")})
    with pytest.raises(NoSolutionError, match="free to move"):
        mbs.modes(rigid)


def test_what_has_no_formula_has_numbers() -> None:
    problem = BY_NAME["four_equal_masses_five_springs"]
    system = mbs.loads(problem.text.replace("  b: {mass: m}\n", "  b: {mass: 3*m}\n"))
    modes = mbs.modes(system)
    squares = sorted(x.imag**2 for x in modes.eigenvalues if x.imag > 0.0)
    assert [x.value**2 for x in modes.frequencies] == pytest.approx(squares, rel=1e-10)
    assert all(x.expression is None for x in modes.frequencies)
    assert all(len(mode.shape) == 4 for mode in modes.modes)


def test_the_record_shows_pickles_and_prints() -> None:
    modes = found("double_pendulum")
    assert pickle.loads(pickle.dumps(modes)) == modes
    assert "sqrt(g*(2 - sqrt(2))/l)" in repr(modes)
    assert r"\omega_{1} &= " in modes._repr_latex_()
    data = modes.as_json()
    assert data["frequencies"][0]["expression"] == "sqrt(g*(2 - sqrt(2))/l)"
    assert data["M"][0][1] == {"value": 1.0, "expression": "2*m*l^2", "unit": ""}


@pytest.mark.parametrize("k", [7.3, 2.1, 0.37])
def test_eigenvalues_that_meet_have_the_digits_that_hold(k: float) -> None:
    """Two critically damped oscillators, one driven by the other: -sqrt(k) is an eigenvalue four times.

    A matrix in doubles has eigenvalues some 1e-4 apart there. Printed numbers are right to half their last place, and
    those of two oscillators apart from each other, whose eigenvalues do not meet, have the six digits of all commands.
    """
    model = f"""
multibody_sym: 1
name: pair
parameters: {{k: {k}, c: {2 * math.sqrt(k)!r}}}
bodies: {{a: {{mass: 1}}, b: {{mass: 1}}}}
joints:
  A: {{type: prismatic, parent: ground, child: a, axis: x, q: x}}
  B: {{type: prismatic, parent: ground, child: b, axis: x, q: y}}
forces:
  s: {{type: spring_damper, joint: A, stiffness: k, damping: c}}
  r: {{type: spring_damper, joint: B, stiffness: k, damping: c}}
  e: {{type: force, on: b, value: [x, 0, 0]}}
"""
    texts = linearization_text(mbs.linearize(mbs.loads(model))), modes_text(mbs.modes(mbs.loads(model)))
    titles = (("eigenvalues in 1/s", "A"), ("eigenvalues, dampers included", "notes"))
    for page, (title, after) in zip(texts, titles, strict=True):
        told = [x.split()[0] for x in page.partition(f"{title}\n")[2].partition(f"\n{after}\n")[0].splitlines()]
        assert len(told) == 4
        for number in told:
            places = len(number.partition(".")[2])
            assert abs(float(number) + math.sqrt(k)) <= 0.5 * 10.0**-places, number
    light = model.replace("damping: c", "damping: 0.2").replace("[x, 0, 0]", "[0, 0, 0]")
    swings = f"-0.1 +- {math.sqrt(k - 0.01):.6g} i"
    assert linearization_text(mbs.linearize(mbs.loads(light))).count(swings) == 2


def test_outputs_have_rows_of_c_and_d_in_chosen_units() -> None:
    """acc = (F - k x)/m: -4 in C and 0.5 in D by hand; a force of 1 N moves 500 mm/s^2."""
    system = mbs.loads("""
multibody_sym: 1
name: cart
gravity: [0, 0, 0]
parameters: {m: 2 kg, k: 8 N/m}
inputs: {F: 0 N}
bodies: {cart: {mass: m}}
joints: {way: {type: prismatic, parent: ground, child: cart, axis: x, q: x}}
forces: {s: {type: spring_damper, joint: way, stiffness: k}, push: {type: force, on: cart, value: [F, 0, 0]}}
outputs: {place: 2*x, acc: "acceleration(cart, x)"}
""")
    found = mbs.linearize(system)
    page = linearization_text(found)
    assert page.endswith("C (of place [m], acc [m/s^2])\n   2  0\n  -4  0\nD\n    0\n  0.5")
    assert linearization_text(found, chosen_units("mm")).endswith("D\n    0\n  500")


def test_frequencies_whose_matrices_have_no_formula_have_no_lines_in_steps() -> None:
    """A plank on rollers that turn: its rows of friction leave no matrices to print."""
    plank = mbs.load(Path(__file__).parents[2] / "examples" / "textbook" / "plank_on_rollers.yaml")
    assert "swing as" not in str(mbs.solve(plank, steps=True).steps)
