"""Every error has a number with a page, and the file on the page fails with that number."""

from __future__ import annotations

import ast
import json
import re
from pathlib import Path
from typing import Any

import pytest
from package_trees import nodes

import multibody_sym as mbs
from multibody_sym.cli.error_pages import EXPLAINED, NEVER_ON_PURPOSE
from multibody_sym.cli.main import main
from multibody_sym.errors import MultibodyError

NUMBER = re.compile(r"[A-Z]1\d\d")
SHOWN = {number: told for number, told in EXPLAINED.items() if told.file or told.words[1:]}


def numbers_in_code() -> set[str]:
    """Return the numbers that stand in the code, wherever errors are made."""
    return {
        node.value
        for name, within in nodes().items()
        if Path(name).parent.name != "explained"
        for node in within
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and NUMBER.fullmatch(node.value)
    }


def below(cls: type[Any]) -> list[type[Any]]:
    return [one for sub in cls.__subclasses__() for one in (sub, *below(sub))]


def test_every_number_has_a_page_and_every_page_a_number() -> None:
    used = numbers_in_code() | {cls.number for cls in below(MultibodyError)}
    assert used == set(EXPLAINED)
    assert set(EXPLAINED) - set(SHOWN) - set(NEVER_ON_PURPOSE) == {n for n, told in EXPLAINED.items() if told.python}


@pytest.mark.parametrize("number", SHOWN)
def test_the_file_on_the_page_fails_with_its_number(
    number: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    told = EXPLAINED[number]
    command, *options = told.words
    words = [command, *options]
    if told.file:
        name = next((word for word in options if word.endswith(".urdf")), "model.yaml")
        Path(name).write_text(told.file, encoding="utf-8")
        words = [command, *([] if name == "robot.urdf" else [name]), *options]
    code = main([*words, "--json"])
    error = json.loads(capsys.readouterr().out).get("error", {})
    assert (error.get("number"), code != 0) == (number, True), error


@pytest.mark.parametrize("number", [n for n, told in EXPLAINED.items() if told.python])
def test_the_call_on_the_page_fails_with_its_number(number: str) -> None:
    with pytest.raises(MultibodyError) as error:
        eval(EXPLAINED[number].python, {"mbs": mbs, "PENDULUM": EXPLAINED["N104"].file})
    assert error.value.number == number


def test_text_for_people_ends_its_first_line_with_the_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "model.yaml").write_text(EXPLAINED["E101"].file, encoding="utf-8")
    assert main(["check", str(tmp_path / "model.yaml")]) == 2
    first, *excerpt = capsys.readouterr().err.splitlines()
    assert first.endswith(" [E101]")
    assert excerpt[-1].strip() == "^"


def test_explain_tells_cause_and_cure(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "m101"]) == 0
    told = capsys.readouterr().out
    assert "cause:" in told
    assert "cure:" in told
    assert "mas: m" in told
    assert main(["explain"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == len(EXPLAINED)
    assert main(["explain", "M999"]) == 2


def test_a_number_outlives_a_copy() -> None:
    import copy
    import pickle

    error = MultibodyError("x", number="M101")
    assert copy.copy(error).number == pickle.loads(pickle.dumps(error)).number == "M101"
