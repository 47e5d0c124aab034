"""Problems: files of a model as a user writes it, with what a command answers to it under `expect:`.

A problem is a file `AREA/NAME.yaml` in this folder. `expect:` stands at its end, is cut off before the model is read,
and is a list; each of its entries is a test, which runs one command in this process and looks at what that prints::

    # What is asked, and where the answer comes from.
    multibody_sym: 1
    name: thrown
    ...
    ask: {T: y < 0, far: {value: x, when: y < 0}}
    expect:
    - solve: {}
      value: {answers.T: 2*v*sin(a)/g, answers.far: 21.6}
      equal: {answers.far: v^2*sin(2*a)/g}
      says: far =
    - {replace: {"mass: m": "mass: M"}, solve: {}, error: E102, line: 4, column: 21, says: did you mean m?}

In place of a model may stand `example: NAME`, for a file of `examples`. The model of an entry: `replace: {OLD: NEW}`
puts other texts into the file, each in place of one that is there (the first, or all with `everywhere: true`), and
`append: TEXT` adds lines. The command: its name with a map of its options, such as
`simulate: {t_end: 2 s, set: {m: 3}}`; true stands for an option without a value. `each: [PART, ..]` makes a test of
each part, which has the rest of the entry too; maps of both are joined.

What is expected, where PATH leads into the object that `--json` prints (`answers.T`, `accelerations.x`, `phi.-1`):

- `value: {PATH: NUMBER}` within `rel` (1e-9) and `abs` (1e-12): a number, null for none, or an expression in the
  model's parameters and functions of Python's `math`, or either with a tolerance of its own, `EXPRESSION +- NUMBER`;
  `where: {NAME: EXPRESSION}` gives intermediate results names. A list stands for a list of as many, such as
  `rest: [[0, null]]`.
- `within: {PATH: BOUND}` or `{PATH: [LEAST, MOST]}`: every number there is at most so large, or between these.
- `events: [KIND ELEMENT, KIND ELEMENT at EXPRESSION, ..]`: all events of a run in turn, at such times. In
  other expressions `event(k)` is the time of one of them.
- `along: {NAME: EXPRESSION}`: a coordinate, speed or output has this value at every sample of a run, where `t` is the
  time, the names of others are their values, and `NAME_end` is a value at the end.
- `formula: {PATH: TEXT}`: the formula is printed so; null: there is none.
- `equal: {PATH: EXPRESSION}`: the formula has that value at the model's parameters, at others nearby, and at those of
  `at: {NAME: NUMBER}`, which may give `t` to formulas of time too.
- `exactly: {PATH: VALUE}`: what stands there, such as `states.c: stick`, `conditions: []` or `errors.0.where.line: 3`.
- `holds_for: {NAME: NUMBER}`: solved again with these parameters, every number is that of the formula printed before.
- `says`, `silent`: a text, or a list of them, that the print has, and that it has not.
- `error`: the number of the first error, with which alone a command may fail. `wrong: [PLACE, ..]`: where in the model
  all errors are, in their order, as `joints.j.axis` or the end of that. `line` and `column`: where in the file the line
  points that has all of `says`; below it that line of the file is shown.
"""

from __future__ import annotations

import json
import random
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from problem_files import (
    PROBLEMS,
    at_path,
    calculate,
    command_of_case,
    compared,
    letters_of,
    model_of_case,
    number,
    options_of,
    read_problem,
    with_results,
    words_of_options,
)

from multibody_sym.cli.main import main

OTHERS = 3
"""At how many other parameter sets a formula is compared."""


def every_case() -> list[Any]:
    """Return the cases of all problems, under their files' names and their numbers there."""
    found = []
    for path in sorted(PROBLEMS.glob("*/*.yaml")):
        model, cases = read_problem(path)
        for place, case in enumerate(cases, 1):
            name = f"{path.parent.name}/{path.stem}-{place}"
            marks = [pytest.mark.long] if case.get("long") else []
            found.append(pytest.param(path.name, model, case, id=name, marks=marks))
    return found


def verify_values(found: Any, case: Mapping[str, Any], letters: Mapping[str, Any]) -> None:
    """Compare numbers."""
    for path, value, expected in compared(found, case, letters):
        if expected is None:
            assert value is None, path
        else:
            assert value == expected, path
    known = with_results(letters, case) if "within" in case else {}
    for path, bound in case.get("within", {}).items():
        ends = bound if isinstance(bound, list) else [f"-({bound})", bound]
        least, most = (calculate(end, known) for end in ends)
        values = list(numbers(at_path(found, path)))
        assert values, f"{path} has no numbers"
        assert least <= min(values) <= max(values) <= most, path


def numbers(found: Any) -> Iterator[float]:
    """Yield all numbers of a part of an object."""
    if isinstance(found, dict | list):
        for part in found.values() if isinstance(found, dict) else found:
            yield from numbers(part)
    elif isinstance(found, int | float):
        yield found


def verify_run(found: Any, case: Mapping[str, Any], letters: Mapping[str, Any]) -> None:
    """Compare the events of a run, and its columns with functions of time and of each other."""
    if "events" in case:
        wanted = [event.partition(" at ") for event in case["events"]]
        told = [(event, f"{event['kind']} {event['element']}") for event in found["events"]]
        assert [words for _, words in told] == [words for words, _, _ in wanted]
        for (event, words), (_, _, time) in zip(told, wanted, strict=True):
            assert not time or event["t"] == number(time, with_results(letters, case), case), words
    if "along" in case:
        columns = {**found["coordinates"], **found["speeds"], **found["outputs"], "t": found["t"]}
        known = {**letters, **{f"{name}_end": column[-1] for name, column in columns.items()}}
        for values in ({name: column[k] for name, column in columns.items()} for k in range(len(found["t"]))):
            there = with_results({**known, **values}, case)
            for name, expression in case["along"].items():
                assert values[name] == number(expression, there, case), f"{name} at t = {values['t']}"


def verify_formulas(found: Any, case: Mapping[str, Any], letters: Mapping[str, float]) -> None:
    """Compare formulas with those of the case: as texts, and as functions of the parameters."""
    for path, text in case.get("formula", {}).items():
        assert at_path(found, path)["expression"] == text, path
    draw = random.Random(1)
    others = [{name: x * draw.uniform(0.9, 1.1) for name, x in letters.items()} for _ in range(OTHERS)]
    others += [{**letters, **case["at"]}] if "at" in case else []
    for path, expression in case.get("equal", {}).items():
        formula = at_path(found, path)["expression"]
        assert formula is not None, f"{path} has no formula"
        for values in (letters, *others):
            wanted = calculate(expression, with_results(values, case))
            assert calculate(formula, values) == pytest.approx(wanted, rel=1e-9, abs=1e-12), (path, formula)


def verify_print(printed: str, case: Mapping[str, Any]) -> None:
    """Look for the words that a case expects in the print, and for those that a line with a place of the file has."""
    says, silent = (case.get(key, []) for key in ("says", "silent"))
    lines = printed.splitlines()
    words = [says] if isinstance(says, str) else says
    for word in words:
        assert word in printed, printed
    if "line" in case:
        shown = [line for line in lines if all(word in line for word in words)]
        assert shown, f"no line has all of {words} in:\n{printed}"
        place = f":{case['line']}:{case['column']}:" if "column" in case else f":{case['line']}:"
        assert place in shown[0], shown[0]
        assert lines[lines.index(shown[0]) + 1].startswith("  "), "the place in the file is not shown"
    for word in [silent] if isinstance(silent, str) else silent:
        assert word not in printed


def verify_errors(found: Any, code: int, case: Mapping[str, Any], printed: str) -> None:
    """Compare the number of the first error, and the places of all."""
    assert code != 0
    assert found["error"]["number"] == case["error"], printed
    if "wrong" in case:
        places = [error["where"]["path"] for error in found["errors"]]
        assert len(places) == len(case["wrong"]), places
        for place, end in zip(places, case["wrong"], strict=True):
            assert f".{place}".endswith(f".{end}"), places


def quantities(found: Any, path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield all quantities with a value, below their paths."""
    if isinstance(found, dict) and isinstance(found.get("value"), float) and "expression" in found:
        yield path, found
    elif isinstance(found, dict | list):
        for key, part in found.items() if isinstance(found, dict) else enumerate(found):
            yield from quantities(part, f"{path}.{key}".lstrip("."))


def verify_elsewhere(found: Any, elsewhere: Any, letters: Mapping[str, float]) -> None:
    """Compare numbers that were solved for at other parameters with the formulas found at the model's."""
    formulas = {path: quantity["expression"] for path, quantity in quantities(found)}
    values = {**letters, **elsewhere["coordinates"], **elsewhere["speeds"]}
    for path, quantity in quantities(elsewhere):
        if formulas[path] is not None:
            assert calculate(formulas[path], values) == pytest.approx(quantity["value"], rel=1e-9, abs=1e-9), path


@pytest.mark.parametrize(("name", "model", "case"), every_case())
def test_a_command_answers_as_expected(
    name: str, model: str, case: dict[str, Any], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    text = model_of_case(model, case)
    Path(name).write_text(text, encoding="utf-8")
    command = command_of_case(name, case)
    code = main(command)
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    verify_print(printed.err, case)
    if "error" in case:
        verify_errors(found, code, case, printed.err)
    else:
        assert "error" not in found, printed.err
    computed = case.keys() & {"value", "within", "events", "along", "equal"}
    letters = letters_of(text, options_of(case).get("set", {})) if computed else {}
    letters = {**case.get("at", {}), **letters}
    known = {**letters, "event": lambda k: found["events"][k]["t"]}
    verify_values(found, case, known)
    verify_run(found, case, known)
    verify_formulas(found, case, letters)
    for path, value in case.get("exactly", {}).items():
        assert at_path(found, path) == value, path
    if other := case.get("holds_for"):
        assert main([command[0], name, "--json", *words_of_options({**options_of(case), "set": other})]) == 0
        verify_elsewhere(found, json.loads(capsys.readouterr().out), letters_of(text, other))
