"""Files of `tests/problems`: a model, and below `expect:` the cases that `problems/test_problems.py` describes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

PROBLEMS = Path(__file__).parent / "problems"
COMMANDS = ("solve", "check", "equilibrium", "simulate", "derive", "modes", "draw", "linearize")
MODEL_KEYS = ("about", "replace", "everywhere", "append", "long")
ANSWER_KEYS = (
    "value", "rel", "abs", "where", "formula", "equal", "at", "exactly", "holds_for", "says", "silent",
    "error", "wrong", "line", "column",
)


def read_problem(path: Path) -> tuple[str, list[dict[str, Any]]]:
    """Return a problem's model, and its cases."""
    model, mark, expected = path.read_text(encoding="utf-8").partition("\nexpect:\n")
    assert mark, f"{path}: nothing is expected"
    cases = yaml.safe_load(expected)
    for case in cases:
        named = [key for key in case if key in COMMANDS]
        unknown = case.keys() - {*COMMANDS, *MODEL_KEYS, *ANSWER_KEYS}
        assert len(named) == 1, f"{path}: {case} has not one command"
        assert not unknown, f"{path}: unknown keys {unknown}"
        assert case.keys() & ANSWER_KEYS, f"{path}: {case} expects nothing"
    return model + "\n", cases
