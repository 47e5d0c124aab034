"""Hostile expressions: nothing runs, nothing hangs, every refusal has its column."""

from pathlib import Path

import pytest
from hostile import verdict

from multibody_sym.errors import ExpressionError
from multibody_sym.text.parser import parse

FUZZ = Path(__file__).with_name("fuzz.py")


def assert_harmless(tmp_path: Path, seed: int, count: int) -> None:
    result = verdict(FUZZ, tmp_path, [seed, count])
    assert result["wrong"] == []
    assert result["events"] == []
    assert result["cases"] >= count
    assert 0.1 * count < result["read"] < 1.9 * count  # of two readings each: the generator makes good and bad texts
    assert [path.name for path in tmp_path.iterdir()] == ["tried"]


def test_payloads_and_fuzzed_expressions(tmp_path):
    assert_harmless(tmp_path, 1, 5_000)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(100_000, 200_000, 10_000))
def test_many_fuzzed_expressions(tmp_path, seed):
    assert_harmless(tmp_path, seed, 10_000)


@pytest.mark.parametrize("text", ["__import__('os').system('id')", "().__class__", "eval('1')", "[" * 9999])
def test_code_is_no_expression(text):
    with pytest.raises(ExpressionError):
        parse(text)
