"""What comes out of every example and of 200 random systems, one hash a line: a change that moves code changes none.

    python tests/same_output.py > before.txt      # then, after the change, again, and compare the files

Each line tells a system, what was asked of it, and the hash of the answer: the C, the generated Python less its import
lines, the derivation with its steps, what `solve`, `check` and `linearize` find as JSON rounded to 10 digits, and the
bits of a short motion. An answer that is an error is hashed as its message.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from mechanisms import random_case

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.codegen.python import python_source
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.routes import FORMALISMS
from multibody_sym.simulation.recall import formalism_name

EXAMPLES: Final = Path(__file__).parent.parent / "examples"
RANDOM: Final = 200
DIGITS: Final = 10


def rounded(value: Any) -> Any:
    """Return what `--json` prints with every number cut to ten digits; counts of time and code are left out."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items() if key not in {"seconds", "statistics"}}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    if isinstance(value, float):
        return f"{value:.{DIGITS - 1}e}" if math.isfinite(value) else repr(value)
    return value


def command(*words: str) -> str:
    """Return what a command prints on standard output: JSON rounded, text as it is."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        code = main(words)
    text = out.getvalue()
    with contextlib.suppress(ValueError):
        text = json.dumps(rounded(json.loads(text)), sort_keys=True)
    return f"{code} {text}"


def c_files(system: mbs.System) -> str:
    """Return the files of exported C one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        files = sorted(Path(file) for file in mbs.export(system, to="c", directory=folder))
        return "\n".join(line for file in files for line in (file.name, *file.read_text().splitlines()))


def python_module(system: mbs.System) -> str:
    """Return the Python that runs are made of, without what it imports from this package."""
    resolved = mbs.mechanism(system)
    made = programs(resolved, FORMALISMS[formalism_name(None, resolved)]).as_mapping()
    return "\n".join(line for line in python_source(made).splitlines() if "import" not in line)


def motion(system: mbs.System, backend: str) -> str:
    """Return the bits of a short motion."""
    run = mbs.simulate(system, t_end=0.05, samples=6, backend=backend)
    return "".join(column.tobytes().hex() for column in (run.t, *run.coordinates.values(), *run.speeds.values()))


def questions(system: mbs.System, file: str, backend: str) -> Iterator[tuple[str, Callable[[], str]]]:
    """Yield what is asked of a system: a name, and a function that answers."""
    yield "c", lambda: c_files(system)
    yield "python", lambda: python_module(system)
    for name in ("solve", "check", "linearize"):
        yield name, lambda name=name: command(name, file, "--json")
    yield "motion", lambda: motion(system, backend)


def told(name: str, asked: str, answer: Callable[[], str]) -> None:
    """Print the line of one answer."""
    try:
        text = answer()
    except mbs.MultibodyError as error:
        text = f"{type(error).__name__}: {error}"
    print(name, asked, hashlib.sha256(text.encode()).hexdigest()[:16], flush=True)


def examples() -> None:
    """Print the lines of every example."""
    for file in sorted(EXAMPLES.rglob("*.yaml")):
        system = mbs.load(file)
        told(file.stem, "steps", lambda file=file: command("derive", str(file), "--steps"))
        for asked, answer in questions(system, str(file), "c"):
            told(file.stem, asked, answer)


def random_systems() -> None:
    """Print the lines of random systems, every other one with constraint rows."""
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(RANDOM):
            system = random_case(seed, bodies=(1, 6), rows=bool(seed % 2)).system
            file = Path(folder, "random.yaml")
            mbs.dump(system, file)
            for asked, answer in questions(system, str(file), "python"):
                told(f"random_{seed}", asked, lambda answer=answer: answer().replace(folder, ""))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    examples()
    random_systems()
    sys.exit(0)
