"""Random model files are read; the long run gives them to commands."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from random_models import KINDS, random_model
from random_runs import main, rows_of, seed_of

import multibody_sym as mbs

REFUSED = {"answer", "refusal"}


def test_files_are_read_and_hold_every_kind() -> None:
    kinds = set()
    for number in range(60):
        text = random_model(seed_of("read", number))
        kinds |= {kind for kind in KINDS if kind in text.splitlines()[1]}
        assert mbs.mechanism(mbs.loads(text)).bodies
    assert kinds == set(KINDS)


@pytest.mark.long
def test_commands_answer_or_refuse(tmp_path: Path) -> None:
    table = tmp_path / "table"
    main([str(table), "--seed", os.environ.get("RANDOM_MODELS", "0"), "--models", "200", "--folder", str(tmp_path)])
    assert [row for row in rows_of(table) if row["class"] not in REFUSED] == []
