"""Hostile expressions: nothing runs, nothing hangs, every refusal has its column."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from multibody_sym.errors import ExpressionError
from multibody_sym.expressions.parser import parse

FUZZ = Path(__file__).with_name("fuzz.py")
HANG = 300


def fuzzed(tmp_path: Path, seed: int, count: int, patience: float) -> dict:
    note = tmp_path / "tried"
    package = Path(sys.modules["multibody_sym.errors"].__file__).parents[1]
    environment = {**os.environ, "PYTHONPATH": str(package)}
    command = [sys.executable, str(FUZZ), str(note), str(seed), str(count)]
    try:
        run = subprocess.run(
            command, capture_output=True, text=True, cwd=tmp_path, env=environment, timeout=patience, check=False
        )
    except subprocess.TimeoutExpired:
        pytest.fail(f"hangs on {note.read_text(encoding='utf-8')[:500]}")
    assert run.returncode == 0, run.stderr + note.read_text(encoding="utf-8")[:500]
    return json.loads(run.stdout)


def assert_harmless(result: dict, tmp_path: Path, at_least: int) -> None:
    assert result["wrong"] == []
    assert result["events"] == []
    assert result["cases"] >= at_least
    assert 0.1 * at_least < result["read"] < 1.9 * at_least  # the generator makes both good and bad texts
    assert not list(tmp_path.glob("pwned*"))


def test_payloads_and_fuzzed_expressions(tmp_path):
    assert_harmless(fuzzed(tmp_path, 1, 5_000, HANG), tmp_path, 5_000)


@pytest.mark.long
def test_many_fuzzed_expressions(tmp_path):
    for start in range(10):
        assert_harmless(fuzzed(tmp_path, 10_000 * (start + 10), 10_000, 2 * HANG), tmp_path, 10_000)


@pytest.mark.parametrize("text", ["__import__('os').system('id')", "().__class__", "eval('1')", "[" * 9999])
def test_code_is_no_expression(text):
    with pytest.raises(ExpressionError):
        parse(text)
