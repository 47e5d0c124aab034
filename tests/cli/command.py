"""The command line as users run it, a process of its own; and the same in this process, for what is no matter of it."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from multibody_sym.cli.main import main

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
PENDULUM = str(EXAMPLES / "pendulum.yaml")
LONG = ("--t-end", "1e6", "--samples", "2000001", "--rtol", "1e-12")
"""Settings with which a pendulum runs for minutes."""


def environment(**more: str) -> dict[str, str]:
    """Return the environment of a process that finds the checkout."""
    return {**os.environ, "PYTHONPATH": str(ROOT), **more}


def command(*words: str, cwd: Path | None = None, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run `multibody-sym WORDS`; nothing it prints may be a traceback."""
    start = [sys.executable, "-m", "multibody_sym", *words]
    given = {"env": environment(), "capture_output": True, "text": True, "timeout": 120, **options}
    done = subprocess.run(start, cwd=cwd, check=False, **given)
    assert "Traceback" not in (done.stderr or "")
    return done


def here(*words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run the same in this process, which takes no second to begin."""
    out, err = io.StringIO(), io.StringIO()
    with chdir(cwd or Path.cwd()), redirect_stdout(out), redirect_stderr(err):
        code = main(words)
    assert "Traceback" not in err.getvalue()
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


def answer(done: subprocess.CompletedProcess[str]) -> Any:
    """Return the one JSON object on standard output."""
    return json.loads(done.stdout)
