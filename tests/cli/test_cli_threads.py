"""The command line asks linear algebra for one thread: its solves are small, and threads wait for busy cores."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

NAMES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
ROOT = Path(__file__).parents[2]
TOLD = """
import json, os, sys
{0}
print(json.dumps([os.environ.get(name) for name in {1}] + [len(os.listdir("/proc/self/task"))]))
"""
COMMAND = """
import contextlib, io
from multibody_sym.cli.main import main
sys.argv = ["multibody-sym", "check", "examples/slider_crank.yaml"]
with contextlib.redirect_stdout(io.StringIO()):
    assert main() == 0
import numpy
"""


def told(code, **given):
    kept = {name: value for name, value in os.environ.items() if name not in NAMES}
    start = [sys.executable, "-c", TOLD.format(code, NAMES)]
    done = subprocess.run(start, env={**kept, **given}, cwd=ROOT, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="threads are counted in /proc")
def test_a_command_has_one_thread() -> None:
    assert told(COMMAND) == ["1", "1", "1", 1]


def test_a_users_own_number_of_threads_is_kept() -> None:
    assert told(COMMAND, OMP_NUM_THREADS="2")[:3] == [None, "2", None]


def test_a_library_leaves_threads_to_whoever_uses_it() -> None:
    code = 'import multibody_sym as mbs\nmbs.check(mbs.load("examples/slider_crank.yaml"))'
    assert told(code)[:3] == [None, None, None]
    assert told('from multibody_sym.cli.main import main\nmain(["check", "--help"])')[:3] == [None, None, None]
