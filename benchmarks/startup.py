"""Wall and CPU time of commands as a user starts them, beside those of Python itself, in one run.

    python benchmarks/startup.py

Minimum of seven, each command in turn; `nothing cached` gets a new cache folder for every run. CPU seconds, those of
the compiler among them, are told beyond those of `import numpy`. Warm is a run that was made before; `other numbers`
have another parameter each time. The block on a belt sticks and slides 24 times. Python keeps compiled modules, as it
does where a package is installed.
"""

from __future__ import annotations

import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

ROUNDS = 7
EXAMPLES = Path(__file__).parent.parent / "examples"
MODEL = EXAMPLES / "double_pendulum.yaml"
BELT = EXAMPLES / "textbook" / "mass_on_a_belt.yaml"
COMMAND = shutil.which("multibody-sym", path=Path(sys.executable).parent) or "multibody-sym"


def chain(count: int) -> str:
    """Return the model file of a chain of hinges."""
    links = range(count)
    link = "{mass: m, com: [0, -l/2, 0], inertia: {Izz: m*l^2/12}, points: {end: [0, -l, 0]}}"
    bodies = [f"  b{k}: {link}" for k in links]
    ends = ["ground", *(f"b{k}.end" for k in links)]
    joints = [f"  j{k}: {{type: revolute, parent: {ends[k]}, child: b{k}, axis: z}}" for k in links]
    head = ["multibody_sym: 1", "name: chain", "gravity: [g, 0, 0]", "parameters: {m: 1, l: 0.01, g: 9.81}"]
    return "\n".join([*head, "bodies:", *bodies, "joints:", *joints, "simulation: {t_end: 0.01 s, samples: 11}", ""])


def seconds(command: list[str], cache: Path) -> tuple[float, float]:
    """Return the wall and the CPU time of a command with a cache folder."""
    kept = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(cache.parent / "modules")}
    environment = {**os.environ, **kept, "XDG_CACHE_HOME": str(cache)}
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=environment, check=True, capture_output=True)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Print the minima."""
    with tempfile.TemporaryDirectory() as folder:
        warm, links = Path(folder) / "warm", Path(folder) / "chain.yaml"
        links.write_text(chain(1000))
        motion = ["-o", str(Path(folder) / "motion.csv")]
        simulate = [COMMAND, "simulate", str(MODEL), *motion]
        long = [COMMAND, "simulate", str(links), *motion]
        sticks = [COMMAND, "simulate", str(BELT), *motion]
        rows = {
            "python -c pass": [sys.executable, "-c", "pass"],
            "import numpy": [sys.executable, "-c", "import numpy"],
            "multibody-sym --help": [COMMAND, "--help"],
            "simulate, warm": simulate,
            "simulate, other numbers": simulate,
            "simulate, nothing cached": simulate,
            "chain of 1,000, warm": long,
            "block on a belt, warm": sticks,
            "block on a belt, other numbers": sticks,
        }
        best = dict.fromkeys(rows, (math.inf, math.inf))
        seconds(simulate, warm)
        seconds(long, warm)
        seconds(sticks, warm)
        for k in range(ROUNDS):
            for name, command in rows.items():
                cache = Path(folder) / f"cold{k}" if name == "simulate, nothing cached" else warm
                changed = {"simulate, other numbers": f"m1={k + 2}", "block on a belt, other numbers": f"m={k + 2}"}
                other = ["--set", changed[name]] if name in changed else []
                took = seconds([*command, *other], cache)
                best[name] = min(best[name][0], took[0]), min(best[name][1], took[1])
    print(f"multibody_sym {version('multibody-sym')}, Python {sys.version.split()[0]}, minimum of {ROUNDS}")
    numpy = best["import numpy"][1]
    for name, (wall, cpu) in best.items():
        print(f"{name:30} {wall:6.3f} s, CPU {cpu:6.3f} s = numpy {cpu - numpy:+.3f} s")


if __name__ == "__main__":
    main()
