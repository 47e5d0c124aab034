"""Every public callable under an audit hook: no text is run, and every wrong argument is answered by the toolkit."""

from __future__ import annotations

from pathlib import Path

import pytest
from hostile import verdict

FUZZ = Path(__file__).with_name("public_fuzz.py")
FEWEST_CALLABLES, FEWEST_PLACES = 115, 400


def assert_closed(folder: Path, seed: int, payloads: int, wrong: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every payload but for those of slow callables goes to every parameter, and `wrong` values to parameters."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    found = verdict(FUZZ, folder, [seed, payloads, wrong], patience=3600)
    assert found["missing"] == []
    assert found["events"] == []
    assert found["canaries"] == []
    assert found["bare"] == {}
    assert found["callables"] >= FEWEST_CALLABLES
    assert found["places"] >= FEWEST_PLACES
    assert found["count"]["refused"] > 0.4 * (payloads * found["places"] + wrong)


def test_payloads_and_wrong_arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert_closed(tmp_path, 1, 6, 600, monkeypatch)


@pytest.mark.long
def test_two_hundred_payloads_and_ten_thousand_wrong_arguments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert_closed(tmp_path, 2, 200, 10_000, monkeypatch)
