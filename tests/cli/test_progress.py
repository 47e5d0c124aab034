"""On a terminal every stage that lasts is shown with what it does; Ctrl-C ends each within a short time."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from io import StringIO
from pathlib import Path

import pytest

from multibody_sym import stages
from multibody_sym.cli import terminal
from multibody_sym.cli.terminal import ProgressLine

EXAMPLES = Path(__file__).parents[2] / "examples"


class Screen(StringIO):
    """A terminal of 60 columns."""

    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that a test sets."""
    now = [0.0]
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_the_line_has_the_stage_its_work_and_what_is_done(clock: list[float]) -> None:
    screen = Screen()
    progress = ProgressLine(screen, begin=0.0)
    with stages.watched(progress, "simulate"):
        with stages.stage("derive"):
            stages.log("derive %s by %s", "crane", "sweep")
            clock[0] = 0.5
            progress.draw()
            assert screen.getvalue() == ""  # it is early
            clock[0] = 3.0
            progress.draw()
            assert screen.getvalue() == "\rderive crane by sweep, 3 s"
        with stages.stage("compile"):
            clock[0] = 7.0
            assert progress.line(7.0) == "compile, 4 s; done: derive 3 s"
            assert list(stages.counted("ab", "file")) == ["a", "b"]
            assert progress.line(7.0).startswith("compile: file 2 of 2, 4 s")
        with stages.stage("integrate"):
            stages.reached(0.25)
            assert progress.line(9.0) == f"integrate [{'#' * 8}{'.' * 22}]  25 %, 6 s left"
            stages.log("%s", "x" * 200)
            progress.draw()
            assert len(screen.getvalue().split("\r")[-1].rstrip()) < 60
    progress.wipe()
    assert screen.getvalue().endswith("\r")


def test_threads_draw_while_a_stage_does_nothing_but_last(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(terminal, "_PATIENCE", 0.0)
    monkeypatch.setattr(terminal, "_EVERY", 0.01)
    monkeypatch.setenv("COLUMNS", "60")
    screen = Screen()
    with terminal.progress_on(screen, "solve"), stages.stage("reactions"):
        until = time.monotonic() + 10.0
        while "reactions, 0 s" not in screen.getvalue() and time.monotonic() < until:
            pass
    assert "reactions, 0 s" in screen.getvalue()
    assert screen.getvalue().endswith("\r")


def test_nothing_is_shown_where_no_terminal_is(capsys: pytest.CaptureFixture[str]) -> None:
    from multibody_sym.cli.main import main

    assert main(["check", str(EXAMPLES / "pendulum.yaml")]) == 0
    assert "\r" not in capsys.readouterr().err


LONG = {
    "derive": ["derive", "{long}", "--budget", "500"],
    "solve": ["solve", "{long}"],
    "check": ["check", "{long}"],
    "simulate": ["simulate", "{long}", "--t-end", "1000", "--method", "rk4", "--step", "1e-5"],
    "equilibrium": ["equilibrium", "{long}"],
}
"""Commands that take longer than the test waits, by what they do then."""


def long_chain(folder: Path, count: int = 14) -> Path:
    bodies = ", ".join(f"b{k}: {{mass: m, com: [l/2, 0, 0], inertia: {{Izz: m*l^2/12}}}}" for k in range(count))
    joints = [
        f"  j{k}: {{type: revolute, parent: {'ground' if k == 0 else f'b{k - 1}.tip'}, child: b{k}, q: q{k}, "
        f"initial: {{q: {0.1 * (k + 1)}}}}}"
        for k in range(count)
    ]
    frames = bodies.replace("inertia", "frames: {tip: {position: [l, 0, 0]}}, inertia")
    text = "\n".join([
        "multibody_sym: 1", "name: chain", "gravity: [0, -9.81, 0]", "parameters: {m: 1 kg, l: 1 m}",
        f"bodies: {{{frames}}}", "joints:", *joints,
    ])  # fmt: skip
    path = folder / "chain.yaml"
    path.write_text(text)
    return path


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize(("name", "after"), [*((name, 3.0) for name in LONG), ("simulate", 1.0)])
def test_ctrl_c_ends_a_command_soon(name: str, after: float, tmp_path: Path) -> None:
    chain = long_chain(tmp_path, 60 if name == "derive" else 14)
    words = [word.format(long=chain) for word in LONG[name]]
    started = subprocess.Popen(
        [sys.executable, "-m", "multibody_sym", *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    try:
        started.wait(after)
        pytest.skip("it was done before")
    except subprocess.TimeoutExpired:
        began = time.monotonic()
        started.send_signal(signal.SIGINT)
    _, told = started.communicate(timeout=60)
    assert time.monotonic() - began < 10.0
    assert started.returncode == 130, told
    assert re.search("^interrupted", told, re.MULTILINE) or name == "simulate"
