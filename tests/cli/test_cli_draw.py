"""`draw` and `show` as users type them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command import PENDULUM

from multibody_sym.cli.main import main


def test_draw_writes_the_figure_beside_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["draw", PENDULUM]) == 0
    assert (tmp_path / "pendulum.svg").read_text().startswith("<?xml")
    told = capsys.readouterr().out
    assert "wrote pendulum.svg" in told
    assert "Joints: " in told


def test_a_phase_portrait_stands_beside_the_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["draw", PENDULUM]) == 0
    figure = (tmp_path / "pendulum.svg").read_bytes()
    assert main(["draw", PENDULUM, "--phase", "theta"]) == 0
    assert (tmp_path / "pendulum.svg").read_bytes() == figure
    assert "Phase portrait of theta" in (tmp_path / "pendulum_phase_theta.svg").read_text()


@pytest.mark.parametrize("word", ["draw", "show"])
def test_its_object_tells_what_was_written(word: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = str(tmp_path / "p.tex")
    words = [word, PENDULUM, "-o", target, "--at", "0.2 s", "--view", "30,20", "--forces", "--set", "l=2", "--json"]
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["written"] == [target]
    assert "t = 0.2 s" in told["description"]
    assert 0 < told["size_mm"][0] < 151


@pytest.mark.parametrize(
    ("words", "place", "message"),
    [
        (["--view", "topp"], "--view", "did you mean top?"),
        (["--at", "soon"], "", "'soon' is not declared"),
        (["--at", "-1"], "--at", "a time from 0 on"),
        (["--mark", "joints.hinje"], "--mark", "nothing at 'joints.hinje'"),
        (["-o", "x.gif"], "", ".svg, .png, .pdf, .tex"),
        (["-o", PENDULUM + "/x.svg"], "", "cannot"),
        (["--viw", "top"], "", "did you mean --view?"),
        (["--names", "some"], "--names", "letters"),
    ],
)
def test_what_is_wrong_is_told_with_its_option(
    words: list[str], place: str, message: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    given = words if "-o" in words else [*words, "-o", str(tmp_path / "x.svg")]
    assert main(["draw", PENDULUM, *given]) in (2, 4)
    told = capsys.readouterr().err
    assert message in told
    assert place in told


def test_a_figure_does_not_replace_its_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "m.svg"
    model.write_text(Path(PENDULUM).read_text())
    assert main(["draw", str(model), "-o", str(model)]) == 2
    assert "give the result another name" in capsys.readouterr().err
