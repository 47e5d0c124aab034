"""Files of `tests/problems`: a model, and below `expect:` the cases that `problems/test_problems.py` describes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path
from types import CodeType
from typing import Any

import pytest
import yaml

import multibody_sym as mbs
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol

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


FUNCTIONS = {
    **vars(math), "abs": abs, "min": min, "max": max, "deg": math.pi / 180, "__builtins__": {}
}
"""What expressions may name beside the letters of a model."""


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


def model_of_case(model: str, case: Mapping[str, Any]) -> str:
    """Return the model with the replacements and additions of a case."""
    for old, new in case.get("replace", {}).items():
        assert old in model, f"{old!r} does not stand in the model"
        model = model.replace(old, str(new), -1 if case.get("everywhere") else 1)
    return model + case.get("append", "")


def words_of_options(options: Mapping[str, Any]) -> list[str]:
    """Return options as they are typed."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if isinstance(value, Mapping):
            words += [word for key, x in value.items() for word in (option, f"{key}={x}")]
        else:
            words += [option] if value is True else [option, str(value)]
    return words


def at_path(found: Any, path: str) -> Any:
    """Return what stands at a path of keys and places, in which a key may have dots of its own."""
    if not path:
        return found
    if isinstance(found, list):
        head, _, rest = path.partition(".")
        return at_path(found[int(head)], rest)
    fitting = [key for key in found if path == key or path.startswith(f"{key}.")]
    assert fitting, f"{path!r} is none of {list(found)}"
    key = max(fitting, key=len)
    return at_path(found[key], path[len(key) + 1 :])


@cache
def code_of(expression: str) -> CodeType:
    """Return an expression as Python's code."""
    return compile(expression.replace("^", "**"), expression, "eval")


def calculate(expression: Any, letters: Mapping[str, Any]) -> float:
    """Return the value of a number or of an expression, by Python."""
    if isinstance(expression, int | float):
        return float(expression)
    return float(eval(code_of(str(expression)), FUNCTIONS, letters))


def number(expected: Any, letters: Mapping[str, Any], case: Mapping[str, Any]) -> Any:
    """Return a number or an expression, `EXPRESSION +- TOLERANCE` too, as an approximate value."""
    expression, own, tolerance = str(expected).rpartition(" +- ")
    if own:
        return pytest.approx(calculate(expression, letters), rel=0.0, abs=float(tolerance))
    rel, absolute = float(case.get("rel", 1e-9)), float(case.get("abs", 1e-12))
    return pytest.approx(calculate(expected, letters), rel=rel, abs=absolute)


@lru_cache(maxsize=1)
def parameters_of(model: str) -> dict[str, Node]:
    """Return the parameters of a model, which the cases of a file share, as nodes."""
    return {name: parameter.value for name, parameter in mbs.loads(model).parameters.items()}


def letters_of(model: str, given: Mapping[str, Any]) -> dict[str, float]:
    """Return the model's parameters in numbers, some of which are given."""
    waiting = dict(parameters_of(model))
    letters = {name: calculate(x, {}) for name, x in given.items()}
    while waiting := {name: node for name, node in waiting.items() if name not in letters}:
        known = {symbol(name): x for name, x in letters.items()}
        ready = {name: node for name, node in waiting.items() if {*leaves([node], "symbol")} <= known.keys()}
        if not ready:
            break
        letters |= {name: evaluate_float([node], known)[0] for name, node in ready.items()}
    return letters


def with_results(letters: Mapping[str, Any], case: Mapping[str, Any]) -> dict[str, Any]:
    """Return letters with the intermediate results of a case."""
    found = dict(letters)
    for name, expression in case.get("where", {}).items():
        found[name] = calculate(expression, found)
    return found


def options_of(case: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the options of a case's command."""
    return next(case[key] for key in COMMANDS if key in case) or {}


def command_of_case(name: str, case: Mapping[str, Any]) -> list[str]:
    """Return the command line of a case for the model in a file."""
    command = next(key for key in COMMANDS if key in case)
    digits = ["--digits", "10"] if command in WITH_DIGITS else []
    return [command, name, "--json", *digits, *words_of_options(options_of(case))]


def compared(found: Any, case: Mapping[str, Any], letters: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Yield the path of each value of a case, with the one found and the one expected, which has its tolerance."""
    known = with_results(letters, case) if "value" in case else {}
    pairs = [(path, at_path(found, path), expected) for path, expected in case.get("value", {}).items()]
    for path, there, expected in pairs:
        value = there["value"] if isinstance(there, dict) else there
        if isinstance(expected, list):
            assert len(value) == len(expected), (path, value)
            pairs += [(f"{path}.{k}", *both) for k, both in enumerate(zip(value, expected, strict=True))]
        else:
            yield path, value, None if expected is None else number(expected, known, case)
