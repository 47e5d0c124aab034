"""Files of `tests/problems`: a model, and below `expect:` the cases that `problems/test_problems.py` describes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""Of libyaml where PyYAML was built with it, which reads all problems ten times as fast."""
PROBLEMS = Path(__file__).parent / "problems"
EXAMPLES = Path(__file__).parents[1] / "examples"
WITH_DIGITS = ("solve", "check", "equilibrium", "modes", "linearize")
COMMANDS = (*WITH_DIGITS, "simulate", "derive", "draw")
MODEL_KEYS = ("about", "replace", "everywhere", "append", "long")
ANSWER_KEYS = (
    "value", "rel", "abs", "where", "within", "along", "events", "formula", "equal", "at", "exactly", "holds_for",
    "says", "silent", "error", "wrong", "line", "column",
)


def read_problem(path: Path) -> tuple[str, list[dict[str, Any]]]:
    """Return a problem's model, and its cases."""
    model, mark, expected = path.read_text(encoding="utf-8").partition("\nexpect:\n")
    assert mark, f"{path}: nothing is expected"
    if (last := model.splitlines()[-1]).startswith("example: "):
        model = (EXAMPLES / f"{last.removeprefix('example: ')}.yaml").read_text(encoding="utf-8")
    cases = [case for entry in yaml.load(expected, LOADER) for case in cases_of_entry(entry)]
    for case in cases:
        named = [key for key in case if key in COMMANDS]
        unknown = case.keys() - {*COMMANDS, *MODEL_KEYS, *ANSWER_KEYS}
        assert len(named) == 1, f"{path}: {case} has not one command"
        assert not unknown, f"{path}: unknown keys {unknown}"
        assert case.keys() & ANSWER_KEYS, f"{path}: {case} expects nothing"
    return model + "\n", cases


def cases_of_entry(entry: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cases of an entry: one for each part below `each`, with what the entry has beside it."""
    common = {key: value for key, value in entry.items() if key != "each"}
    return [joined(common, part) for part in entry.get("each", [{}])]


def joined(common: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """Return both, the part first; what is a map in both has the keys of both."""
    result = {**part, **{key: value for key, value in common.items() if key not in part}}
    for key in common.keys() & part.keys():
        if isinstance(common[key], dict) and isinstance(part[key], dict):
            result[key] = joined(common[key], part[key])
    return result
