"""What stages of a run take: stages inside others count once, and nothing is measured unless somebody asks."""

from __future__ import annotations

import logging
import subprocess
import sys
import time
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.stages import Times, stage, time_stages


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that a test sets."""
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    return now


def _runs(clock: list[float]) -> None:
    with stage("integrate"):
        clock[0] += 1.0
        for seconds in (2.0, 4.0):
            with stage("decide"):
                clock[0] += seconds
                with stage("compile"):
                    clock[0] += 8.0
        clock[0] += 16.0


def test_a_stage_counts_without_those_inside_it(clock: list[float]) -> None:
    with time_stages("other") as times:
        _runs(clock)
        clock[0] += 32.0
    assert times.seconds == {"integrate": 17.0, "decide": 6.0, "compile": 16.0, "other": 32.0}
    assert str(times) == "took 71 s: compile 16 (2 times), decide 6 (2 times), integrate 17, other 32"


def _fails(clock: list[float]) -> None:
    with stage("decide"):
        clock[0] += 1.0
        raise ValueError("no")


def test_a_stage_that_fails_counts_too(clock: list[float]) -> None:
    with pytest.raises(ValueError, match="no"), time_stages("other") as times:
        _fails(clock)
    assert times.seconds == {"decide": 1.0, "other": 0.0}


def test_nothing_is_measured_unless_asked(clock: list[float]) -> None:
    _runs(clock)
    assert Times().seconds == {}


BALL = """multibody_sym: 1
name: dropped
gravity: [0, -10, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, ball: {mass: 1}}
joints: {free: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [0, 1], u: [1, 0]}}}
contacts: {c: {between: [ball, ground.floor], static: 0.5, kinetic: 0.4}}
simulation: {t_end: 1, samples: 3}
"""


def test_one_logger_tells_what_a_run_does(caplog: pytest.LogCaptureFixture) -> None:
    """From 1 m the ball falls for sqrt(0.2) s, then it slides with 4 m/s^2 less, of 1 m/s less what the impact took."""
    system = mbs.loads(BALL)
    with caplog.at_level(logging.DEBUG, "multibody_sym"):
        run = mbs.simulate(system, backend="python")
        mbs.simulate(system, backend="python")
    assert {record.name for record in caplog.records} == {"multibody_sym"}
    assert {record.levelname for record in caplog.records} == {"DEBUG"}
    text = [record.getMessage() for record in caplog.records]
    for begin in (
        "derive the laws of dropped", "write Python: ", "recalled without deriving (python): ",
        "integrate dropped to t = 1 s by dormand_prince", "t = 0 s: c open", "leg 2 from t = 0.447214 s",
        f"DONE at t = 1 s: {run.statistics['steps']} steps",
    ):  # fmt: skip
        assert any(line.startswith(begin) for line in text), begin
    struck = [line for line in text if line.startswith("t = 0.447214 s: ")]
    assert "impact" in struck[0]
    assert text.index(struck[0]) < text.index("leg 2 from t = 0.447214 s")


def test_nothing_is_printed_unless_somebody_reads_the_log(tmp_path: Path) -> None:
    (tmp_path / "ball.yaml").write_text(BALL)
    code = "import logging, multibody_sym as mbs; mbs.simulate(mbs.load('ball.yaml'), backend='python')"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
