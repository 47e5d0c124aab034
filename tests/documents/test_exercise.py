"""Exercises: other numbers for each seed, the same in the description, with answers that the formulas confirm."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.report import other_numbers

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_other_numbers_are_round_and_stand_in_the_description() -> None:
    system = mbs.load(EXAMPLES / "textbook" / "t6_double_incline.yaml")
    assert other_numbers(system, 3) == other_numbers(system, 3)
    seen = set()
    for seed in range(1, 6):
        found = other_numbers(system, seed)
        given = {name: str(parameter.given("value")) for name, parameter in found.parameters.items()}
        assert given["g"] == "10 m/s^2"  # gravity stays
        angles = [given[name].partition(" ")[0] for name in ("alpha", "beta")]
        assert found.description is not None
        told = f"slopes of {angles[0]} and {angles[1]} deg with mu = {given['mu']} lie {given['m']} each"
        assert told in found.description
        assert mbs.solve(found).states == mbs.solve(system).states
        seen.add(tuple(given.values()))
    assert len(seen) == 5


def test_the_sheet_of_answers_has_the_numbers_of_the_exercise(tmp_path: Path) -> None:
    """By the formulas of Atwood's machine."""
    system = mbs.load(EXAMPLES / "textbook" / "t7_atwood.yaml")
    exercise = mbs.report(system, exercise=True, numbers=4, t_end=0.1, samples=2, backend="python")
    names = [Path(name).name for name in exercise.write(tmp_path / "sheet.html")]
    assert names == ["sheet.html", "sheet_answers.html"]
    sheet, answers = ((tmp_path / name).read_text(encoding="utf-8") for name in names)
    m1, m2 = (float(str(exercise.findings.system.parameters[name].given("value")).split()[0]) for name in ("m1", "m2"))
    path = abs(m2 - m1) / (m1 + m2) * 10 * 25 / 2
    tension = 2 * m1 * m2 / (m1 + m2) * 10
    for told in (f"{m1:g} kg and {m2:g} kg hang", f"= {m1:g}&nbsp;kg", "How far do they go in 5 s"):
        assert told in sheet
        assert told in answers
    for number in (f"=&nbsp;{path:.4g}&nbsp;m", f"=&nbsp;{tension:.4g}&nbsp;N"):
        assert number not in sheet
        assert number in answers
    for title in ("Answers", "Solution", "Motion", "Details"):
        assert f">{title}<" not in sheet


def test_what_has_no_other_numbers_is_refused() -> None:
    joints = "joints: {j: {type: prismatic, parent: ground, child: b, axis: x}}"
    literal = f"{{multibody_sym: 1, name: a, bodies: {{b: {{mass: 1}}}}, {joints}}}"
    with pytest.raises(mbs.InputError, match="declare the numbers of the exercise under parameters"):
        mbs.report(mbs.loads(literal), exercise=True, numbers=1)
    with pytest.raises(mbs.InputError, match="numbers is a number of at least 1"):
        mbs.report(mbs.loads(literal), numbers=0)


def test_wrong_options_say_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(EXAMPLES / "pendulum.yaml")
    for words, message in (
        (["--numbers", "x"], "--numbers: expected a number from 1 on, such as 17, got 'x'"),
        (["--fragment", "-o", str(tmp_path / "a.html")], "a fragment is LaTeX: give it a name that ends with .tex"),
        (["--digits", "0"], "--digits: expected a number from 1 to 17, got '0'"),
    ):
        assert main(["report", file, *words]) == 2
        assert message in capsys.readouterr().err
    assert not re.search("html|tex", " ".join(x.name for x in tmp_path.iterdir()))
