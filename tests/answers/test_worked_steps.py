"""`solve --steps`: every printed equation, read again, holds with the result's numbers; what it says, as a book."""

from __future__ import annotations

import re
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import pytest
from problem_files import PROBLEMS, read_problem

import multibody_sym as mbs
from multibody_sym.answers.records import Formula, Sentence, Worked
from multibody_sym.answers.worked import equations
from multibody_sym.answers.worked import equations as exactly
from multibody_sym.documents.document import worked_document, write_document
from multibody_sym.errors import ArgumentError, ExpressionError
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.parser import parse

EXAMPLES = Path(__file__).parents[2] / "examples"
TEXTBOOK = sorted((EXAMPLES / "textbook").glob("*.yaml"))
OTHERS = [
    "pendulum",
    "double_pendulum",
    "four_bar",
    "slider_crank",
    "elastic_pendulum",
    "rolling_coin",
    "swinging_atwood",
]
SHIPPED = sorted(path for path in EXAMPLES.glob("*.yaml") if path.stem not in OTHERS)


def steps(system: mbs.System) -> Worked:
    """Return the steps of a system's solution without those of questions."""
    found = mbs.solve(system.with_fields({"ask": {}}), steps=True).steps
    assert found is not None
    return found


def plain(words: str) -> str:
    """Return names with primes as names that the parser takes."""
    return words.replace("''", "_dd").replace("'", "_d")


def misses(worked: Worked) -> dict[str, float]:
    """Return by how much each printed equation is missed, relative to its terms, once it is read again.

    A difference within a term that vanishes is rounding of what it was before: terms are no smaller than a part of all.
    """
    write = worked.notation.text
    values = {symbol(plain(write(s))): value for s, value in worked.values.items()}
    least = 1e-4 * max(abs(value) for value in worked.values.values())
    found = {}
    for formula in worked.formulas:
        sides = [worked.notation.parts(side) for side in formula.sides]
        numbers = [
            [evaluate_float([parse(plain(term.removeprefix("+ ")))], values)[0] for term in side] for side in sides
        ]
        totals = [sum(side) for side in numbers][formula.assumed :]
        size = max(least, *(abs(x) for side in numbers for x in side))
        if formula.relation == "<=":
            totals = [max(totals[0], totals[1]), totals[1]]
        if formula.value is not None:
            totals.append(formula.value.number)
        found[" = ".join(map(write, formula.sides))] = (max(totals) - min(totals)) / size
    return found


def formulas(worked: Worked, title: str) -> list[str]:
    """Return the lines of mathematics of a step."""
    (step,) = (step for step in worked.steps if step.title == title)
    return [" = ".join(map(worked.notation.text, x.sides)) for x in step.lines if isinstance(x, Formula)]


def sentences(worked: Worked, title: str) -> list[str]:
    """Return the sentences of a step."""
    (step,) = (step for step in worked.steps if step.title == title)
    write = worked.notation.text
    lines = [line.words for line in step.lines if isinstance(line, Sentence)]
    return ["".join(x if isinstance(x, str) else write(x) for x in words) for words in lines]


def verify(worked: Worked) -> None:
    found = misses(worked)
    assert sum(formula.tag is not None for formula in worked.formulas) > 0
    assert {text: miss for text, miss in found.items() if not miss <= 1e-9} == {}


@pytest.mark.parametrize("path", TEXTBOOK, ids=lambda path: path.stem)
def test_printed_equations_hold_for_textbook_problems(path: Path) -> None:
    worked = steps(mbs.load(path))
    verify(worked)
    printed = [" = ".join(map(worked.notation.text, e.sides)) for e in worked.formulas if e.tag is not None]
    assert [text for text in printed if re.search(r"abs\(|sign\(|lambda", text)] == []
    assert max(map(len, write_document(worked_document(worked), "text").splitlines())) <= 120


@pytest.mark.parametrize("name", OTHERS)
def test_printed_equations_hold_for_examples(name: str) -> None:
    verify(steps(mbs.load(EXAMPLES / f"{name}.yaml")))


@pytest.mark.long
@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_printed_equations_hold_for_all_examples(path: Path) -> None:
    verify(steps(mbs.load(path)))


@pytest.mark.parametrize("path", sorted(PROBLEMS.glob("answers/textbook_*.yaml")), ids=lambda path: path.stem)
def test_printed_equations_hold_for_problems(path: Path) -> None:
    worked = steps(mbs.loads(read_problem(path)[0]))
    verify(worked)


def test_the_check_sees_a_wrong_equation() -> None:
    worked = steps(mbs.load(EXAMPLES / "textbook" / "t7_atwood.yaml"))
    tension = next(s for s in worked.values if worked.notation.text(s) == "T")
    wrong: dict[Any, float] = {**worked.values, tension: 13.4}
    assert max(misses(Worked(worked.name, worked.steps, worked.notation, wrong)).values()) > 1e-3


def test_two_loads_over_a_pulley_read_as_in_a_book() -> None:
    worked = steps(mbs.load(EXAMPLES / "textbook" / "t7_atwood.yaml"))
    assert sentences(worked, "left, cut free") == ["m1*g: weight, down", "T: tension of string, up"]
    assert formulas(worked, "left, cut free") == ["m1*y1'' = T - m1*g"]
    assert formulas(worked, "right, cut free") == ["m2*y2'' = T - m2*g"]
    assert formulas(worked, "Relations between accelerations") == ["y1'' + y2'' = 0"]
    assert formulas(worked, "Elimination") == [
        "y2'' = -y1''",
        "T = m1*y1'' + m1*g",
        "(m1 + m2)*y1'' = (m2 - m1)*g",
        "y1'' = (m2 - m1)*g/(m1 + m2)",
    ]
    assert formulas(worked, "Result")[-1] == "T = 2*m1*m2*g/(m1 + m2)"


def test_directions_are_those_of_the_guide_and_across() -> None:
    worked = steps(mbs.load(EXAMPLES / "textbook" / "incline_pulley.yaml"))
    assert formulas(worked, "block, cut free") == ["m1*s'' = T - m1*g*sin(alpha)", "0 = N - m1*g*cos(alpha)"]
    assert formulas(worked, "load, cut free") == ["m2*depth'' = m2*g - T"]


def test_ropes_have_numbers_and_letters_of_the_model_are_left_alone() -> None:
    worked = steps(mbs.load(EXAMPLES / "textbook" / "t8_blocks_in_a_row.yaml"))
    assert formulas(worked, "block2, cut free") == ["m2*x2'' = T2 - T1", "0 = N2 - m2*g"]
    model = (EXAMPLES / "textbook" / "t7_atwood.yaml").read_text(encoding="utf-8")
    taken = re.sub(r"\bm1\b", "T", model)
    assert formulas(steps(mbs.loads(taken)), "left, cut free") == ["T*y1'' = T_string - T*g"]


def test_a_hinged_body_has_moments_about_the_hinge() -> None:
    worked = steps(mbs.load(EXAMPLES / "pendulum.yaml"))
    assert formulas(worked, "bob, cut free")[-1] == "m*l^2*theta'' = -sqrt(3)*m*g*l/2"


def test_elimination_is_carried_through_where_its_formulas_are_short() -> None:
    # by hand: T = (m + M) r^2 phi'^2/2 and V = (3 m/2 + M) g r sin(phi), at 60 degrees
    worked = steps(mbs.load(EXAMPLES / "three_cranks.yaml"))
    assert formulas(worked, "Elimination")[-1] == "phi'' = -(2*M + 3*m)*g/(4*(m + M)*r)"


def test_a_loop_too_long_to_eliminate_tells_its_accelerations_in_letters() -> None:
    # by hand: s^2 - 2 r s cos(phi) + r^2 = l^2, differentiated twice, whatever phi'' is
    worked = steps(mbs.load(EXAMPLES / "slider_crank.yaml"))
    (elimination,) = (step for step in worked.steps if step.title == "Elimination")
    told = {str(x.sides[0]): x.sides[1] for x in elimination.lines if isinstance(x, Formula)}
    assert {"u_phi_rate", "u_s_rate", "u_psi_rate", "k_slider", "J_phi", "Q_phi"} <= set(told)
    assert formulas(worked, "Elimination")[-3] == "phi'' = Q_phi/J_phi"
    r, length, phi, w = 0.1, 0.3, pi / 6, 10.0
    s = r * cos(phi) + sqrt(length**2 - (r * sin(phi)) ** 2)
    below = s - r * cos(phi)
    assert float(told["k_slider"].subs(worked.values)) == pytest.approx(-r * s * sin(phi) / below, rel=1e-9)
    rate = -r * s * sin(phi) * w / below
    for chosen in (0.0, 7.0):
        values = {x: chosen if str(x) == "u_phi_rate" else value for x, value in worked.values.items()}
        values.update((x, told["u_psi_rate"].subs(values)) for x in worked.values if str(x) == "u_psi_rate")
        by_hand = -(rate**2 + 2 * r * rate * w * sin(phi) + r * s * (cos(phi) * w**2 + sin(phi) * chosen)) / below
        assert float(told["u_s_rate"].subs(values)) == pytest.approx(by_hand, rel=1e-9)


def test_without_being_asked_a_solution_has_no_steps() -> None:
    system = mbs.load(EXAMPLES / "textbook" / "t7_atwood.yaml")
    assert mbs.solve(system).steps is None
    with pytest.raises(ArgumentError, match="steps is to be True or False"):
        mbs.solve(system, steps="yes")  # type: ignore[arg-type]


def test_what_grows_too_long_has_numbers_in_place_of_letters(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exactly, "WORK", 50)
    worked = steps(mbs.load(EXAMPLES / "textbook" / "t8_blocks_in_a_row.yaml"))
    verify(worked)
    assert formulas(worked, "block2, cut free") == ["2*x2'' = T2 - T1", "0 = N2 - 20"]
    assert "stands in the equations as numbers" in write_document(worked_document(worked), "text")


def test_where_an_expression_has_no_value_only_what_is_given_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise ExpressionError("0/0 has no value")

    monkeypatch.setattr(equations, "motion_of", refuse)
    system = mbs.load(EXAMPLES / "textbook" / "t7_atwood.yaml").with_fields({"ask": {"a": "y1''"}})
    worked = mbs.solve(system, steps=True)
    assert worked.steps is not None
    text = write_document(worked_document(worked.steps), "text")
    assert "m1 = 1 kg" in text
    assert "the equations are not written out: 0/0 has no value\n\na: y1''" in text


@pytest.mark.parametrize("work", [exactly.WORK, 50])
def test_what_is_not_unique_has_no_value(work: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exactly, "WORK", work)
    model = (EXAMPLES / "textbook" / "t1_two_blocks.yaml").read_text(encoding="utf-8")
    twice = model.replace("path: [left, right]}", "path: [left, right]}\n  second: {type: rope, path: [left, right]}")
    worked = steps(mbs.loads(twice))
    assert [line for line in sentences(worked, "Result") if "not unique" in line] == [
        "T1, T2 are not unique: constraints depend on each other"
    ]


def test_a_rope_has_the_letter_that_its_label_says() -> None:
    path = EXAMPLES / "textbook" / "t7_atwood.yaml"
    plain = write_document(worked_document(steps(mbs.load(path))), "text")
    assert "T: tension of string, up" in plain
    labelled = steps(mbs.loads(path.read_text().replace("type: rope,", "type: rope, label: S_0,")))
    verify(labelled)
    text = write_document(worked_document(labelled), "text")
    assert "S_0: tension of string, up" in text
    assert "S_0 = 2*m1*m2*g/(m1 + m2)" in text
    assert "S_{0}" in write_document(worked_document(labelled), "latex")
    assert text.replace("S_0", "T") == plain


def test_a_particle_on_an_arm_that_turns_and_slides_has_all_accelerations() -> None:
    """No moment acts on a particle, so that none is handed on by its joint: phi'' follows from the sum across."""
    system = mbs.load(EXAMPLES / "kepler.yaml")
    text = write_document(worked_document(steps(system)), "text")
    assert "not unique" not in text
    assert "phi'' = 0" in text
    outward = mbs.solve(system, initial={"u_r": 2.0}, steps=True)
    assert outward.steps is not None
    assert "not unique" not in write_document(worked_document(outward.steps), "text")
    turning = next(iter(outward.accelerations.values())).value
    assert turning == pytest.approx(-2 * 2.0 * outward.speeds["u_phi"] / 0.7, rel=1e-12)
