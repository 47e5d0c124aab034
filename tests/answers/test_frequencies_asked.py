"""`ask: {omega: frequency(1), T: period(1)}`: small oscillations in questions, alone, in expressions and in `find`."""

from __future__ import annotations

import math

import pytest
from small_motion_problems import PROBLEMS

import multibody_sym as mbs
from multibody_sym.errors import InputError
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import text

BY_NAME = {problem.name: problem.text for problem in PROBLEMS}


def asked(name: str, *questions: str, **changes: object) -> mbs.Solution:
    return mbs.solve(mbs.loads(BY_NAME[name] + "ask:\n" + "".join(f"  {q}\n" for q in questions)), **changes)


def test_frequencies_and_periods_are_answers_with_formulas() -> None:
    answers = asked("two_equal_masses_three_springs", "omega: frequency(2)", "T: period(1)").answers
    assert text(answers["omega"].expression) == "sqrt((k + 2*kc)/m)"
    assert answers["omega"].value == pytest.approx(math.sqrt(5 / 2))
    assert text(answers["T"].expression) == "2*pi*sqrt(m/k)"
    assert (answers["omega"].unit, answers["T"].unit) == ("rad/s", "s")


def test_they_stand_in_expressions_and_other_answers() -> None:
    answers = asked("two_free_masses", "f: frequency(1)/(2*pi)", "n: 10*f", "T: period(1)").answers
    assert answers["f"].value == pytest.approx(1 / answers["T"].value, rel=1e-14)
    assert answers["n"].value == pytest.approx(10 * answers["f"].value, rel=1e-14)
    assert answers["f"].expression is not None


def test_an_extreme_that_names_a_frequency_has_the_unit_of_its_expression() -> None:
    answers = asked("two_free_masses", "top: {max: frequency(1)*x1}", "least: {min: period(1)*x1}").answers
    assert [answers[name].unit for name in ("top", "least")] == ["m/s", "m*s"]


def test_a_value_is_found_for_which_a_period_is_wanted() -> None:
    """2 pi sqrt(l/g) = 2 s: the seconds pendulum."""
    answers = asked("simple_pendulum", "T: period(1)", "l2: {find: l, so: T == 2, between: [0.1, 10]}").answers
    assert answers["l2"].value == pytest.approx(9.81 / math.pi**2, rel=1e-12)
    assert text(answers["l2"].expression) == "g/pi^2"


@pytest.mark.long
def test_where_there_is_no_formula_a_value_is_found_by_numbers() -> None:
    chain = "four_equal_masses_five_springs"
    model = BY_NAME[chain].replace("  b: {mass: m}\n", "  b: {mass: 3*m}\n")
    model += "ask: {T: period(1), heavy: {find: m, so: T == 10, between: [1, 10]}}\n"
    found = mbs.solve(mbs.loads(model)).answers
    assert found["heavy"].value == pytest.approx(2 * (10 / found["T"].value) ** 2, rel=1e-8)


def test_the_state_beside_the_start_is_told() -> None:
    solution = asked("simple_pendulum", "T: period(1)", initial={"theta": 0.3})
    assert solution.answers["T"].value == pytest.approx(2 * math.pi * math.sqrt(0.5 / 9.81))
    assert any("about the equilibrium at theta = 0 rad, beside the start" in each for each in solution.conditions)


def test_the_condition_of_stability_is_told() -> None:
    solution = asked("inverted_pendulum_on_a_torsional_spring", "omega: frequency(1)")
    assert "c > g*l*m, else small motions grow" in solution.conditions


def test_formulas_about_another_place_do_not_name_the_start() -> None:
    """The orbit found beside the start has the radius r, which at the start is another one."""
    solution = asked("circular_orbit_of_keplers_force", "w: frequency(1)", "w2: 2*frequency(1)", initial={"u_phi": 1.0})
    assert text(solution.answers["w"].expression) == "sqrt(k/(m*r^3))"
    assert solution.answers["w2"].expression is None
    assert solution.answers["w2"].value == pytest.approx(2 * solution.answers["w"].value, rel=1e-12)


@pytest.mark.parametrize(
    ("question", "said"),
    [
        ("frequency(0)", "by its number"),
        ("period(a)", "by its number"),
        ("frequency()", "frequency"),
    ],
)
def test_what_is_no_mode_is_refused(question: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        asked("two_equal_masses_three_springs", f"omega: {question}")


def test_a_mode_that_is_not_there_is_unknown_and_others_are_told() -> None:
    solution = asked("two_equal_masses_three_springs", "w3: frequency(3)", "w1: frequency(1)", "twice: 2*w3")
    assert solution.answers["w3"].value is None
    assert solution.answers["twice"].value is None
    assert solution.answers["w1"].value is not None
    assert "w3: frequency(3): 2 modes oscillate in small motions about the equilibrium" in solution.conditions


def test_frequencies_are_asked_in_ask_only() -> None:
    with pytest.raises(InputError, match="ask only"):
        mbs.mechanism(mbs.loads(BY_NAME["simple_pendulum"] + "outputs: {w: frequency(1)}\n"))


def test_without_an_equilibrium_the_answer_is_unknown_and_says_why() -> None:
    model = BY_NAME["simple_pendulum"].split("joints:")[0] + (
        "joints: {fall: {type: prismatic, parent: ground, child: bob, axis: y}}\nask: {T: period(1)}\n"
    )
    solution = mbs.solve(mbs.loads(model))
    assert solution.answers["T"].value is None
    assert any(each.startswith("T: ") for each in solution.conditions)


def test_they_are_written_as_they_are_read() -> None:
    assert text(parse("1/period(12) + 2*frequency(1)")) == "1/period(12) + 2*frequency(1)"
    system = mbs.loads(BY_NAME["simple_pendulum"] + "ask: {T: period(1)}\n")
    assert mbs.loads(mbs.dumps(system)) == system
