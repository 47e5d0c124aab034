"""Many processes on one cold cache that is too small for them: everything is compiled once, and nobody falls back."""

from __future__ import annotations

import itertools
import os
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from multibody_sym.program import cache
from multibody_sym.program.target_layout import runtime_sources

ROOT = Path(__file__).parents[2]
LIMIT = 20
RUN = """
import sys, warnings
warnings.simplefilter("error")
import multibody_sym as mbs
from multibody_sym.program import cache
cache._MOST_FILES = int(sys.argv[1])
sys.stdin.readline()
run = mbs.simulate(mbs.loads(sys.argv[2]), backend=None)
assert run.ready.compiled.notice is None
print(run.ready.compiled.backend, float(run["x"][-1]))
"""
MODEL = """
{{multibody_sym: 1, name: m, parameters: {{m: 1}}, bodies: {{b: {{mass: m}}}},
  joints: {{j: {{type: prismatic, axis: x, parent: ground, child: b, q: x}}}},
  forces: {{f: {{type: torque, joint: j, value: {push}*m}}}},
  simulation: {{t_end: 1, samples: 2}}}}
"""


@pytest.mark.parametrize(
    ("processes", "keys", "rounds"), [(4, 2, 1), pytest.param(64, 8, 10, marks=pytest.mark.long)]
)
def test_one_compilation_a_key_and_no_fallback(tmp_path: Path, processes: int, keys: int, rounds: int) -> None:
    for number in range(rounds):
        place = tmp_path / str(number)
        compiled, answers = raced(place, processes, keys)
        assert answers == [("c", pytest.approx((k % keys + 1) / 2)) for k in range(processes)]
        assert compiled == {"model": keys, **dict.fromkeys((name[:-2] for name in runtime_sources(())), 1)}
        assert not list((place / "multibody_sym").glob("new-*"))


def raced(place: Path, processes: int, keys: int) -> tuple[dict[str, int], list[tuple[str, float]]]:
    """Return how often each file was compiled, and what each process answered, a cold cache being full of old files."""
    folder, log, logged = place / "multibody_sym", place / "log", place / "cc"
    folder.mkdir(parents=True, mode=0o700)
    for number in range(LIMIT):
        (folder / f"{number}-old.so").write_bytes(b"old")
        os.utime(folder / f"{number}-old.so", (number, number))
    logged.write_text(f'#!/bin/sh\necho "$@" >> {log}\nexec {shutil.which("cc")} "$@" -O0\n')
    logged.chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(place), "CC": str(logged)}
    started = [
        subprocess.Popen(
            [sys.executable, "-c", RUN, str(LIMIT), MODEL.format(push=k % keys + 1)],
            cwd=place, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for k in range(processes)
    ]
    for process in started:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    answers = [process.communicate()[0].split() for process in started]
    lines = log.read_text().splitlines()
    compiled = Counter(words[words.index("-c") + 1][:-2] for words in map(str.split, lines) if "-c" in words)
    return dict(compiled), [(backend, float(x)) for backend, x in answers]


def test_a_cache_that_many_used_is_small_again_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(cache, "_MOST_FILES", LIMIT)
    monkeypatch.setattr(cache, "_STORES", itertools.count(-LIMIT))
    for number in range(LIMIT):
        cache.store(f"key {number}", cache.keep(b"%d" % number, "origin", ".so"), {})
    assert len(os.listdir(cache.folder())) >= 2 * LIMIT
    later = np.nextafter(cache._IN_USE, np.inf)
    monkeypatch.setattr(cache.time, "time", lambda now=cache.time.time: now() + later)
    cache.store("one more", cache.keep(b"one more", "origin", ".so"), {})
    assert len(os.listdir(cache.folder())) <= LIMIT
