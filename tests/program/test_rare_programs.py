"""Programs that are called only when a run begins are compiled as they are written: sooner, and to the same bits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.motion.prepare import problem as recall
from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import cos, sqrt

EXAMPLES = Path(__file__).parents[2] / "examples"
BEGIN, END = '#pragma GCC optimize ("O0")', "#pragma GCC pop_options"


def program(name: str, turns: int) -> Program:
    """Return x -> cos(cos(.. x + 1 ..)) + sqrt(2)."""
    trace = Trace(name, (Array("x", (1,)),))
    value = trace["x"][0]
    for _ in range(turns):
        value = cos(value + 1)
    return trace.finish({"y": ((), [value + sqrt(trace["x"][0] * 2)])})


def test_only_what_is_rare_stands_where_nothing_is_worked_on() -> None:
    often, rare = {"often": program("often", 2)}, {"rare": program("rare", 3)}
    text = c_source(often, rare=rare)["model.c"]
    before, _, after = text.partition(BEGIN)
    within, _, rest = after.partition(END)
    assert "void mbs_often(" in before
    assert "void mbs_rare(" in within
    assert "void mbs_often(" not in within
    assert "mbs_programs[]" in rest
    assert BEGIN not in c_source(often | rare)["model.c"]


@pytest.mark.parametrize("backend", ["c", "python"])
def test_both_are_callable_and_have_the_bits_of_others(backend: str) -> None:
    often, rare = {"often": program("often", 2)}, {"rare": program("rare", 40)}
    apart, together = load(often, Native(backend=backend), rare=rare), load(often | rare, Native(backend=backend))
    for x in np.linspace(0.1, 5.0, 50):
        for name in ("often", "rare"):
            assert apart[name]([x])[0].item() == together[name]([x])[0].item()
    assert apart["rare"]([0.5])[0].item() != apart["often"]([0.5])[0].item()


def test_the_programs_of_the_start_of_a_loop_are_rare(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[str, set[str]] = {}

    def load(programs: dict[str, Program], _code: object, **options: object) -> None:
        asked.update(often=set(programs), rare=set(options["rare"]))  # type: ignore[call-overload]
        raise RuntimeError("told")

    monkeypatch.setattr(recall.loading, "load", load)
    monkeypatch.setattr(recall, "recall_programs", lambda *_given, **_options: None)
    with pytest.raises(RuntimeError, match="told"):
        recall.compile_mechanism(mechanism(mbs.load(EXAMPLES / "four_bar.yaml")), "composite_body")
    assert {"state_derivative", "missed", "put_back", "energy", "outputs"} <= asked["often"]
    assert {"closing", "closing_places"} <= asked["rare"]
    assert not asked["often"] & asked["rare"]
