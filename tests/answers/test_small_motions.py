"""Small motions in symbols: frequencies as books print them, and as the eigenvalues of `linearize` are."""

from __future__ import annotations

import math
import pickle
from functools import cache

import numpy as np
import pytest
from small_motion_problems import PROBLEMS, Problem

import multibody_sym as mbs
from multibody_sym.algebra.quotient_functions import exact
from multibody_sym.algebra.quotients import PRECISE, Field, Letter
from multibody_sym.analysis.modes.state import place_of
from multibody_sym.documents.analysis import linearization_text, modes_text
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, NoSolutionError
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

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


def told(rows: object) -> list[list[str]]:
    return [[text(x.expression) for x in row] for row in rows]


def test_matrices_and_shapes_of_two_masses() -> None:
    modes = found("two_equal_masses_three_springs")
    assert modes.coordinates == ("x1", "x2")
    assert told(modes.mass) == [["m", "0"], ["0", "m"]]
    assert told(modes.stiffness) == [["k + kc", "-kc"], ["-kc", "k + kc"]]
    shapes = [{name: text(x.expression) for name, x in mode.shape.items()} for mode in modes.modes]
    assert shapes == [{"x1": "1", "x2": "1"}, {"x1": "1", "x2": "-1"}]
    assert modes.stable is True
    assert modes.about == "equilibrium"
    assert not modes.found


def test_shapes_solve_the_equations() -> None:
    for name in ("double_pendulum_of_two_masses", "linear_triatomic_molecule", "rod_on_a_string"):
        modes = found(name)
        M, K = (np.array([[x.value for x in row] for row in rows]) for rows in (modes.mass, modes.stiffness))
        for mode in modes.modes:
            v = np.array([x.value for x in mode.shape.values()])
            omega = 0.0 if mode.frequency is None else mode.frequency.value
            assert np.abs(K @ v - omega**2 * M @ v).max() < 1e-10 * np.abs(K).max()
            assert all(x.expression is not None for x in mode.shape.values())


def test_what_moves_off_is_told_apart() -> None:
    modes = found("linear_triatomic_molecule")
    assert [mode.motion for mode in modes.modes] == ["oscillates", "oscillates", "free"]
    assert modes.stable is None
    assert [x.value for x in modes.modes[2].shape.values()] == [1.0, 1.0, 1.0]


def test_conditions_of_stability() -> None:
    assert found("inverted_pendulum_on_a_torsional_spring").conditions == ("c > g*l*m",)
    assert found("bead_on_a_turning_hoop").conditions == ("R*W^2 > g",)
    assert found("bead_on_a_turning_hoop_below").conditions == ("g > R*W^2",)


def test_an_unstable_position_tells_how_it_is_left_and_why() -> None:
    system = mbs.loads(BY_NAME["inverted_pendulum_on_a_torsional_spring"].text)
    modes = mbs.modes(system, parameters={"c": 3})
    assert modes.stable is False
    assert modes.conditions == ("g*l*m > c",)
    (mode,) = modes.modes
    assert mode.motion == "grows"
    assert precise(mode.rate.expression, {"g": 9.81, "m": 2, "l": 0.5, "c": 3}) ** 2 == pytest.approx(
        (2 * 9.81 * 0.5 - 3) / (2 * 0.25), rel=1e-14
    )


def test_a_damper_slows_and_fades_one_freedom() -> None:
    modes = found("damped_oscillator")
    (mode,) = modes.modes
    assert text(mode.rate.expression) == "-c/(2*m)"
    assert abs(modes.eigenvalues[0].imag) == pytest.approx(mode.frequency.value, rel=1e-12)
    slow = mbs.modes(mbs.loads(BY_NAME["damped_oscillator"].text), parameters={"c": 100})
    assert [mode.motion for mode in slow.modes] == ["decays", "decays"]
    assert sorted(mode.rate.value for mode in slow.modes) == pytest.approx(sorted(x.real for x in slow.eigenvalues))


def test_of_several_freedoms_dampers_are_left_out_and_told() -> None:
    text_with = BY_NAME["two_equal_masses_three_springs"].text + "  d: {type: damper, joint: A, damping: 0.1}\n"
    modes = mbs.modes(mbs.loads(text_with))
    assert [text(x.expression) for x in modes.frequencies] == ["sqrt(k/m)", "sqrt((k + 2*kc)/m)"]
    assert any("dampers" in note for note in modes.notes)
    assert max(x.real for x in modes.eigenvalues) < 0.0


# --- the state ------------------------------------------------------------------------------------------------------


def test_an_equilibrium_is_found_beside_the_start_with_its_formula() -> None:
    system = mbs.loads(BY_NAME["bead_on_a_turning_hoop"].text)
    modes = mbs.modes(system, initial={"theta": 1.0})
    assert modes.found
    assert text(modes.at["theta"].expression) == "acos(g/(R*W^2))"
    assert modes.frequencies == found("bead_on_a_turning_hoop").frequencies


@pytest.mark.parametrize("start", [1.3, 2.0, 120 * math.pi / 180])
def test_a_place_with_a_formula_has_its_value(start: float) -> None:
    """What a search leaves of its way to theta = 0 is not told as the number of 0."""
    place = mbs.modes(mbs.loads(BY_NAME["simple_pendulum"].text), initial={"theta": start}).at["theta"]
    assert (text(place.expression), place.value, str(place)) == ("0", 0.0, "0 rad")


def test_a_steady_motion_is_found_with_the_momenta_of_the_start() -> None:
    """From r = R a little faster than a circular orbit: the circle of the same p has radius p^2/(m k)."""
    system = mbs.loads(BY_NAME["circular_orbit_of_keplers_force"].text)
    speed = math.sqrt(3 / (2 * 1.5**3)) * 1.1
    modes = mbs.modes(system, initial={"u_phi": speed})
    radius = (2 * 1.5**2 * speed) ** 2 / (2 * 3)
    assert modes.about == "steady motion"
    assert modes.found
    assert modes.held == ("phi",)
    assert modes.at["r"].value == pytest.approx(radius, rel=1e-12)
    assert modes.frequencies[0].value == pytest.approx(math.sqrt(3 / (2 * radius**3)), rel=1e-12)
    assert text(modes.frequencies[0].expression) == "sqrt(k/(m*r^3))"


def test_static_stretch_is_solved() -> None:
    problem = BY_NAME["elastic_pendulum"]
    modes = mbs.modes(mbs.loads(problem.text.replace("l + m*g/k", "l")))
    assert modes.found
    assert precise(modes.at["r"].expression, problem.values) == pytest.approx(0.5 + 2 * 9.81 / 200, rel=1e-14)
    assert modes.frequencies == found("elastic_pendulum").frequencies


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


def test_a_stable_equilibrium_is_looked_for_where_the_nearest_is_not() -> None:
    system = mbs.loads(BY_NAME["bead_on_a_turning_hoop"].text)
    modes = mbs.modes(system, initial={"theta": 0.01})
    assert modes.stable is True
    assert text(modes.at["theta"].expression) == "acos(g/(R*W^2))"
    assert mbs.modes(system, initial={"theta": 0.01}, at="equilibrium").stable is False


def test_a_motion_that_passes_a_rest_is_told_about_that() -> None:
    modes = mbs.modes(mbs.loads(BY_NAME["simple_pendulum"].text), initial={"u_theta": 1.0})
    assert modes.about == "equilibrium"
    assert text(modes.frequencies[0].expression) == "sqrt(g/l)"
    assert any("speeds are left out" in note for note in modes.notes)


TOP = """
multibody_sym: 1
name: sleeping_top
gravity: [0, 0, -g]
parameters: {g: {value: 9.81, positive: true}, m: {value: 2, positive: true}, l: {value: 0.3, positive: true},
  A: {value: 0.3, positive: true}, C: {value: 0.1, positive: true}, n: {value: 60, positive: true}}
bodies: {f1: {}, f2: {}, top: {mass: m, com: [0, 0, l], inertia: {Ixx: A - m*l^2, Iyy: A - m*l^2, Izz: C}}}
joints:
  a: {type: revolute, parent: ground, child: f1, axis: x, q: al}
  b: {type: revolute, parent: f1, child: f2, axis: y, q: be}
  c: {type: revolute, parent: f2, child: top, axis: z, q: ps, initial: {u: n}}
"""


@pytest.mark.parametrize(
    ("n", "stable", "condition"),
    [(60, True, "C^2*n^2 > 4*A*g*l*m"), (22, False, "4*A*g*l*m > C^2*n^2"), (5, False, "4*A*g*l*m > C^2*n^2")],
)
def test_a_top_sleeps_above_one_speed(n: float, stable: bool, condition: str) -> None:
    """C^2 n^2 > 4 A m g l, by the discriminant of its biquadratic equation (Routh)."""
    found = mbs.modes(mbs.loads(TOP), parameters={"n": n})
    assert found.stable is stable
    assert found.conditions == (condition,)


@pytest.mark.parametrize("W", [1, 6])
def test_a_mass_in_a_round_hollow_of_a_turntable_is_stable_at_any_speed(W: float) -> None:
    model = """
        multibody_sym: 1
        name: turntable
        parameters: {k: {value: 50, positive: true}, m: {value: 2, positive: true}, W: {value: 1, positive: true}}
        bodies: {table: {}, p: {mass: m}}
        joints:
          t: {type: revolute, parent: ground, child: table, axis: z, motion: W*t}
          j: {type: point, parent: table, child: p, q: [a, b]}
        forces: {s: {type: potential, on: p, value: k/2*(x^2 + y^2)}}
        """
    found = mbs.modes(mbs.loads(model), parameters={"W": W})
    assert (found.stable, found.conditions) == (True, ())
    assert [x.frequency.value for x in found.modes] == pytest.approx([abs(5 - W), 5 + W], rel=1e-12)


@pytest.mark.parametrize("k", [7.3, 2.1, 0.37])
def test_eigenvalues_that_meet_have_the_digits_that_hold(k: float) -> None:
    """Two critically damped oscillators, one driven by the other: -sqrt(k) is an eigenvalue four times.

    A matrix in doubles has eigenvalues some 1e-4 apart there. Printed numbers are right to half their last place, and
    those of two oscillators apart from each other, whose eigenvalues do not meet, have nine digits.
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
    swings = f"-0.1 +- {math.sqrt(k - 0.01):.9g} i"
    assert linearization_text(mbs.linearize(mbs.loads(light))).count(swings) == 2
