"""Whole runs of contacts as a user starts them: from an empty cache, and again with another end of the run.

    python benchmarks/contact_starts.py [--rounds N] [MODEL.yaml ..]

A block on a block, 12 discs in a box and a robot on four feet (see `evaluations.py`), and further model files. Of each
the least wall and CPU time (compilers included), and how many libraries were compiled. The last column is a run in
Python alone. Python keeps compiled modules, as it does where a package is installed; objects of the runtime are those
that the package brings, if it brings some. Needs example-robot-data (extra `peers`).
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

T9 = Path(__file__).parent.parent / "examples" / "textbook" / "t9_block_on_block.yaml"
SHORTER = 0.97
"""The part of the motion that is asked for again."""


def run(name: str, part: float) -> None:
    """Run a part of a case by its name."""
    import evaluations

    import multibody_sym as mbs

    if name == "discs":
        mbs.simulate(evaluations.discs(evaluations.FLIGHT, evaluations.STILL, evaluations.DOWN), t_end=part)
    else:
        mbs.simulate(evaluations.robot(), t_end=0.3 * part, initial=evaluations.STANDING)


def took(command: Sequence[str], cache: Path) -> tuple[float, float, int]:
    """Return wall and CPU time (s) of a command with a cache folder, and how many libraries it added there."""
    kept = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(cache.parent / "modules")}
    environment = {**os.environ, **kept, "XDG_CACHE_HOME": str(cache)}
    before, begun, begin = resource.getrusage(resource.RUSAGE_CHILDREN), libraries(cache), time.perf_counter()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    wall, after = time.perf_counter() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, cpu, len(libraries(cache) - begun)


def libraries(cache: Path) -> set[bytes]:
    """Return what tells the libraries in a cache folder apart; some are there by two names."""
    return {hashlib.sha256(file.read_bytes()).digest() for file in cache.rglob("*.so")}


def commands(models: Sequence[str]) -> dict[str, tuple[list[str], list[str]]]:
    """Return by name the commands of a whole and of a shorter run."""
    own = [sys.executable, __file__, "--run"]
    found = {name: ([*own, name, "1"], [*own, name, str(SHORTER)]) for name in ("discs", "robot")}
    for model in (str(T9), *models):
        simulate = [sys.executable, "-m", "multibody_sym", "simulate", model]
        found[Path(model).stem] = simulate, [*simulate, "--t-end", "0.9"]
    return found


def main() -> None:
    """Print a row for each case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="*")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--run", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.run:
        run(given.run[0], float(given.run[1]))
        return
    print("| run | cold: wall, CPU, libraries | again, shorter: wall, CPU, libraries | in Python: wall, CPU |")
    print("|---|--:|--:|--:|")
    with tempfile.TemporaryDirectory() as folder:
        for name, (whole, shorter) in commands(given.models).items():
            rounds = []
            for k in range(given.rounds):
                cache = Path(folder) / f"{name}{k}"
                rounds.append([took(whole, cache), took(shorter, cache)])
                if whole[-1].endswith(".yaml"):
                    rounds[-1].append(took([*whole, "--backend", "python"], Path(folder) / f"{name}{k} python"))
            cells = []
            for each in zip(*rounds, strict=True):
                wall, cpu, added = (min(column) for column in zip(*each, strict=True))
                cells.append(f"{wall:.2f}, {cpu:.2f}, {added}")
            print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
