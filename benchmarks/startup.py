"""Wall time of commands as a user starts them, beside those of Python itself, in one run.

    python benchmarks/startup.py

Minimum of seven, each command in turn; `nothing cached` gets a new cache folder for every run. Python keeps compiled
modules, as it does where a package is installed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

ROUNDS = 7
MODEL = Path(__file__).parent.parent / "examples" / "double_pendulum.yaml"
COMMAND = shutil.which("multibody-sym", path=Path(sys.executable).parent) or "multibody-sym"


def seconds(command: list[str], cache: Path) -> float:
    """Return the wall time of a command with a cache folder."""
    kept = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(cache.parent / "modules")}
    environment = {**os.environ, **kept, "XDG_CACHE_HOME": str(cache)}
    start = time.perf_counter()
    subprocess.run(command, env=environment, check=True, capture_output=True)
    return time.perf_counter() - start


def main() -> None:
    """Print the minima."""
    with tempfile.TemporaryDirectory() as folder:
        warm = Path(folder) / "warm"
        simulate = [COMMAND, "simulate", str(MODEL), "-o", str(Path(folder) / "motion.csv")]
        rows = {
            "python -c pass": [sys.executable, "-c", "pass"],
            "import numpy": [sys.executable, "-c", "import numpy"],
            "multibody-sym --help": [COMMAND, "--help"],
            "simulate, warm": simulate,
            "simulate, nothing cached": simulate,
        }
        best = dict.fromkeys(rows, float("inf"))
        seconds(simulate, warm)
        for k in range(ROUNDS):
            for name, command in rows.items():
                cache = Path(folder) / f"cold{k}" if name == "simulate, nothing cached" else warm
                best[name] = min(best[name], seconds(command, cache))
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}, minimum of {ROUNDS}")
    for name, value in best.items():
        print(f"{name:26} {value:6.3f} s")


if __name__ == "__main__":
    main()
