"""A terminal shows lines within its width, bold headings and coloured verdicts; files and pipes get plain text."""

from __future__ import annotations

import os
import re
import struct
import sys
import threading
from pathlib import Path

import pytest

from multibody_sym.cli.main import main
from multibody_sym.cli.terminal import Terminal, wrap_line

EXAMPLES = Path(__file__).parents[2] / "examples"
ROWS, COLUMNS = 24, 80
_CODE = re.compile(r"\x1b\[\d+m")


def shown(monkeypatch: pytest.MonkeyPatch, *words: str, columns: int = COLUMNS) -> list[str]:
    """Return the lines that a command prints in a terminal of so many columns, codes of colours included."""
    fcntl, pty, termios = (pytest.importorskip(name) for name in ("fcntl", "pty", "termios"))
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, columns, 0, 0))
    parts: list[bytes] = []

    def read() -> None:
        try:
            while part := os.read(master, 4096):
                parts.append(part)
        except OSError:  # the other end is closed
            pass

    reader = threading.Thread(target=read)
    reader.start()
    with monkeypatch.context() as patch, os.fdopen(slave, "w") as stream:
        patch.delenv("COLUMNS", raising=False)
        patch.setattr(sys, "stdout", stream)
        main(list(words))
    reader.join()
    os.close(master)
    return b"".join(parts).decode().replace("\r", "").splitlines()


ANSWERS = (
    (("solve", "questions/over_a_wall.yaml"), "  angle = "),
    (("solve", "textbook/t6_double_incline.yaml"), "  s1'' = "),
    (("solve", "slider_crank.yaml"), "  s'' = "),
    (("solve", "impacts/struck_four_bar.yaml"), "impulses"),
    (("check", "slider_crank.yaml"), "verdict: all agree"),
    (("modes", "double_pendulum.yaml"), "  omega2 = "),
    (("equilibrium", "double_pendulum.yaml"), "stable: theta1 = 0 rad, theta2 = 0 rad"),
    (("equilibrium", "textbook/ladder.yaml", "--vary", "mu"), "rest is possible for mu"),
    (("linearize", "stewart_platform.yaml"), "A"),
    (("linearize", "double_pendulum.yaml", "--at", "equilibrium"), "eigenvalues in 1/s"),
    (("simulate", "slider_crank.yaml"), "  pin_force "),
    (("simulate", "impacts/bouncing_ball.yaml"), "  t = 1.80609 s: c closed"),
    (("derive", "double_pendulum.yaml"), "Equations of motion"),
)
"""Commands with the beginning of a line that answers them."""


@pytest.mark.parametrize(("words", "answer"), ANSWERS, ids=lambda x: " ".join(x) if isinstance(x, tuple) else "")
def test_lines_fit_and_the_answer_is_on_the_first_screen(
    words: tuple[str, ...], answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    command, name, *others = words
    lines = [_CODE.sub("", line) for line in shown(monkeypatch, command, str(EXAMPLES / name), *others)]
    assert [line for line in lines if len(line) > COLUMNS] == []
    assert any(line.startswith(answer) for line in lines[: ROWS - 1])


@pytest.mark.parametrize(
    "words",
    [
        ("draw", "four_bar.yaml", "-o", "x.svg"),
        ("sweep", "double_pendulum.yaml", "--vary", "m1=1:2:2", "--t-end", "0.1"),
        ("export", "pendulum.yaml", "--to", "c", "-o", "code"),
        ("solve", "slider_crank.yaml", "--steps"),
        ("derive", "slider_crank.yaml", "--steps"),
        ("check", "missing.yaml"),
        ("explain",),
        ("explain", "M101"),
        ("solve", "--help"),
        ("--help",),
    ],
    ids=" ".join,
)
def test_lines_of_other_commands_fit(
    words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    words = tuple(str(EXAMPLES / word) if word.endswith(".yaml") else word for word in words)
    lines = [_CODE.sub("", line) for line in shown(monkeypatch, *words)]
    assert [line for line in lines if len(line) > COLUMNS] == []


@pytest.mark.parametrize("width", [30, 60, 80])
def test_wrapped_lines_keep_their_words(width: int, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", str(EXAMPLES / "slider_crank.yaml")]) == 0
    text = capsys.readouterr().out
    wrapped = Terminal(width, colours=False).show(text)
    assert "".join(wrapped.split()) == "".join(text.split())
    assert max(map(len, wrapped.splitlines())) <= width


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        ("  s'' = g*(mu*cos(alpha) - sin(alpha)) = -0.248968 m/s^2", ["  s'' = g*(mu*cos(alpha) - sin(alpha))",
                                                                      "      = -0.248968 m/s^2"]),
        ("about l1 = 0.72 m, l2 = 0.72 m, l3 = 0.72 m, l4 = 0.72 m", ["about l1 = 0.72 m, l2 = 0.72 m,",
                                                                      "    l3 = 0.72 m, l4 = 0.72 m"]),
        ("wrote /a/path/that/nobody/should/cut/because/it/is/copied.csv",
         ["wrote", "    /a/path/that/nobody/should/cut/because/it/is/copied.csv"]),
    ],
)  # fmt: skip
def test_lines_end_where_a_reader_pauses(line: str, parts: list[str]) -> None:
    assert list(wrap_line(line, 42)) == parts


def test_headings_are_bold_and_verdicts_coloured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    model = str(EXAMPLES / "double_pendulum.yaml")
    lines = shown(monkeypatch, "equilibrium", model)
    assert lines[0].startswith("\x1b[32mstable\x1b[0m: ")
    assert lines[1].startswith("\x1b[31munstable\x1b[0m: ")
    assert "\x1b[1maccelerations\x1b[0m" in shown(monkeypatch, "solve", model)
    assert not any(map(_CODE.search, shown(monkeypatch, "solve", model, "--color", "never")))
    assert not any(map(_CODE.search, shown(monkeypatch, "solve", model, "--json")))
    monkeypatch.setenv("NO_COLOR", "1")
    assert not any(map(_CODE.search, shown(monkeypatch, "solve", model)))


def test_pipes_get_plain_text_unless_colours_are_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["check", str(EXAMPLES / "slider_crank.yaml")]
    assert main(words) == 0
    plain = capsys.readouterr().out
    assert main([*words, "--color", "always"]) == 0
    coloured = capsys.readouterr().out
    assert not _CODE.search(plain)
    assert coloured.startswith("\x1b[32mverdict: all agree\x1b[0m")
    assert _CODE.sub("", coloured) == plain
    assert max(map(len, plain.splitlines())) > COLUMNS


def test_digits_are_those_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["solve", str(EXAMPLES / "pendulum.yaml")]
    printed = []
    for more in ([], ["--digits", "4"], ["--digits", "12"]):
        assert main([*words, *more]) == 0
        printed.append(re.findall(r"theta'' = .* = (-?[0-9.]+)", capsys.readouterr().out)[0])
    assert [len(number.replace("-", "").replace(".", "").lstrip("0")) for number in printed] == [6, 4, 12]
    assert main([*words, "--digits", "0"]) == 2
    assert "expected a number from 1 to 17" in capsys.readouterr().err


def test_source_is_not_wrapped(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = shown(monkeypatch, "derive", str(EXAMPLES / "double_pendulum.yaml"), "--format", "latex", columns=40)
    assert r"\documentclass" in lines[0]
    assert max(map(len, lines)) > 40
