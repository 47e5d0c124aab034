"""A journal that is damaged is refused by name, whatever is wrong with it; no study believes it, none waits for it."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.errors import InputError, OutputError
from multibody_sym.studies.journal import _HEAD, ENDING, _checksum

SYSTEM = """
multibody_sym: 1
name: falling
bodies: {b: {mass: 1}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: 1}}}
simulation: {t_end: 1, samples: 2}
"""
GOOD = {"first": 0, "count": 1, "names": ["x"], "texts": {"events": {}, "failure": {}}}
CONTENTS = {
    "no JSON": b"{\n",
    "no bytes of text": b"\xff\n",
    "a list": b"[]\n",
    "a number": b"1\n",
    "no names": json.dumps({k: v for k, v in GOOD.items() if k != "names"}).encode() + b"\n" + bytes(8),
    "names that are none": json.dumps(GOOD | {"names": [1]}).encode() + b"\n" + bytes(8),
    "too few numbers": json.dumps(GOOD).encode() + b"\n",
    "a count that is text": json.dumps(GOOD | {"count": "1"}).encode() + b"\n" + bytes(8),
    "a number before the first": json.dumps(GOOD | {"first": -3}).encode() + b"\n" + bytes(8),
    "texts that are a list": json.dumps(GOOD | {"texts": []}).encode() + b"\n" + bytes(8),
    "deep": b"[" * 100_000 + b"\n",
}


def part(content: bytes) -> bytes:
    return _HEAD.pack(len(content), _checksum(content)) + content


@pytest.fixture
def study(tmp_path: Path) -> Callable[[], mbs.Study]:
    """A study of six runs whose journal is there already, as an interrupted call leaves it."""
    system, out = mbs.loads(SYSTEM), tmp_path / "o.csv"

    def again(stop: bool = False) -> mbs.Study:
        def counted(done: int, total: int) -> None:
            if stop and done > 1:
                raise KeyboardInterrupt

        return mbs.sweep(system, {"x": (1, 2, 6)}, output=out, workers=1, on_progress=counted)

    with pytest.raises(KeyboardInterrupt, match="runs are kept in"):
        again(stop=True)
    return again


@pytest.mark.parametrize("content", CONTENTS.values(), ids=CONTENTS)
def test_content_that_is_no_rows_is_refused(content: bytes, study: Callable[[], mbs.Study], tmp_path: Path) -> None:
    journal = tmp_path / f"o.csv{ENDING}"
    before = journal.read_bytes() + part(content)
    journal.write_bytes(before)
    with pytest.raises(InputError, match=f"{ENDING}.*damaged"):
        study()
    assert journal.read_bytes() == before


def test_a_part_that_changed_in_the_middle_is_refused(study: Callable[[], mbs.Study], tmp_path: Path) -> None:
    journal = tmp_path / f"o.csv{ENDING}"
    content = bytearray(journal.read_bytes())
    begin = content.index(b"\n") + 1
    length = struct.unpack_from("<Q", content, begin)[0]
    assert begin + _HEAD.size + length < len(content)  # there are parts behind it
    content[begin + _HEAD.size + 3] ^= 1
    journal.write_bytes(content)
    with pytest.raises(InputError, match="damaged"):
        study()


def test_runs_that_are_there_twice_are_refused(study: Callable[[], mbs.Study], tmp_path: Path) -> None:
    journal = tmp_path / f"o.csv{ENDING}"
    content = journal.read_bytes()
    journal.write_bytes(content + content[content.index(b"\n") + 1 :])
    with pytest.raises(InputError, match="damaged"):
        study()


def test_a_torn_end_is_dropped(study: Callable[[], mbs.Study], tmp_path: Path) -> None:
    journal = tmp_path / f"o.csv{ENDING}"
    journal.write_bytes(journal.read_bytes()[:-5])
    assert 0 < study().computed < 6


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes")
def test_a_pipe_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / f"p.csv{ENDING}")
    with pytest.raises(InputError, match="no regular file"):
        mbs.sweep(mbs.loads(SYSTEM), {"x": [1, 2]}, output=tmp_path / "p.csv")


def test_a_full_disk_leaves_no_empty_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("multibody_sym.studies.journal._write", full)
    with pytest.raises(OutputError):
        mbs.sweep(mbs.loads(SYSTEM), {"x": [1, 2]}, output=tmp_path / "o.csv")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_study_without_a_file_says_that_nothing_is_kept() -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match="no run is kept") as raised:
        mbs.sweep(mbs.loads(SYSTEM), {"x": (1, 2, 3)}, workers=1, on_progress=stop)
    assert type(raised.value) is KeyboardInterrupt
