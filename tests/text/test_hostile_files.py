"""Hostile and damaged model files: nothing runs, nothing hangs, every refusal has file, line and column."""

import os
from pathlib import Path

import pytest
from hostile import verdict

MUTATE = Path(__file__).with_name("mutate.py")
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))
DATA = sorted((Path(__file__).parent / "data").glob("*.yaml"))


def assert_harmless(tmp_path: Path, seed: int, count: int) -> None:
    result = verdict(MUTATE, tmp_path, [seed, count, *EXAMPLES, *DATA])
    assert result["wrong"] == []
    assert result["events"] == []
    assert result["cases"] >= count
    assert 0.02 * count < result["read"] < 0.9 * count  # some damage does no harm, most does
    assert sorted(os.listdir(tmp_path)) == ["model.yaml", "tried"]


def test_payloads_and_damaged_files(tmp_path):
    assert_harmless(tmp_path, 1, 100)


@pytest.mark.long
def test_many_damaged_files(tmp_path):
    assert_harmless(tmp_path, 10_000, 5_000)
