"""Runs that begin with an impact: what they tell of it, and that rounding of it is no motion."""

from __future__ import annotations

from pathlib import Path

import pytest

import multibody_sym as mbs

FOLDER = Path(__file__).parents[2] / "examples" / "impacts"


@pytest.mark.parametrize("law", ["one_by_one", "simultaneous"])
def test_nothing_happens_after_newtons_cradle(law: str) -> None:
    """What rounding leaves of speeds opens nothing, and the impact itself is told at t = 0."""
    written = (FOLDER / "newtons_cradle.yaml").read_text(encoding="utf-8")
    system = mbs.loads(written.replace("impact: closing", f"impact: {{sequence: {law}}}"))
    run = mbs.simulate(system, t_end=2.0, samples=3)
    assert [(event["t"], event["kind"], event["element"]) for event in run.events] == [
        (0.0, "impact", name) for name in ("c1", "c2", "c3", "c4")
    ]
    told = mbs.solve(system).impact
    assert told is not None
    for event in run.events:
        assert event["impulse"] == pytest.approx(told.impulses[event["element"]]["normal"].value, rel=1e-12)
        assert event["lost"] == pytest.approx(told.lost_by[event["element"]].value, abs=1e-12)
