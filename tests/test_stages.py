"""What stages of a run take: stages inside others count once, and nothing is measured unless somebody asks."""

from __future__ import annotations

import time

import pytest

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
