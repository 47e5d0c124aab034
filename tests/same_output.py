"""Record all that comes out of a wide set of models; compare two records. What is text is the same, numbers to 1e-10.

    python tests/same_output.py record BEFORE        # then, after a change:
    python tests/same_output.py record AFTER
    python tests/same_output.py compare BEFORE AFTER

BEFORE and AFTER are folders with one file for each model; `record` goes on where it ended. The models are all examples,
every model text in the tests, and 200 random ones with elements that hold one way only. Texts, generated C and Python,
figures, names and order of events are compared as they are, decimal numbers in what commands print by their value. This
file imports the program's entry alone, so that it runs before and after anything that moves.
"""

from __future__ import annotations

import argparse
import ast
import gzip
import hashlib
import json
import math
import os
import re
import resource
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from random_models import random_model
from random_runs import seed_of

from multibody_sym.__main__ import main

TESTS: Final = Path(__file__).parent
EXAMPLES: Final = TESTS.parent / "examples"
RANDOM: Final = 200
TOLERANCE: Final = 1e-10
"""Relative, and absolute below 1."""
SECONDS: Final = 120
"""CPU time of a command; one that takes longer is recorded as unfinished."""
NUMBER: Final = re.compile(r"-?\d+\.\d+(?:e[+-]?\d+)?|-?\d+e[+-]?\d+")
UNLIKE: Final = {"seconds", "statistics", "time", "version"}
"""Members of printed objects that differ from run to run."""

SHORT: Final = ["--t-end", "0.2", "--samples", "11"]
ALL: Final = {
    "derive": ["derive", "--steps"],
    "solve": ["solve", "--json"],
    "check": ["check", "--json"],
    "equilibrium": ["equilibrium", "--json"],
    "linearize": ["linearize", "--json"],
    "modes": ["modes", "--json"],
    "draw": ["draw", "-o", "figure.svg"],
    "simulate": ["simulate", "--json", "-o", "table.csv", *SHORT],
    "c": ["export", "--to", "c", "-o", "c"],
    "python": ["export", "--to", "python", "-o", "python"],
}
OF_TEXTS: Final = ("solve", "draw")
OF_RANDOM: Final = ("solve", "check", "simulate", "python")


def models() -> Iterator[tuple[str, str, Sequence[str]]]:
    """Yield the models: a name, the text or the file's path, and the commands that they go through."""
    for file in sorted(EXAMPLES.rglob("*.yaml")):
        yield "example_" + "_".join(file.relative_to(EXAMPLES).with_suffix("").parts), str(file), tuple(ALL)
    for text in sorted(texts_of_tests()):
        yield "text_" + hashlib.sha256(text.encode()).hexdigest()[:12], text, OF_TEXTS
    for number in range(RANDOM):
        yield f"random_{number}", random_model(seed_of("same output", number)), OF_RANDOM


def texts_of_tests() -> set[str]:
    """Return the string constants of the tests that are whole models."""
    texts = set()
    for file in TESTS.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                lines = node.value.splitlines()
                if any(line.startswith("bodies:") for line in lines) and any(
                    line.startswith("joints:") for line in lines
                ):
                    texts.add(node.value)
    return texts


def record(folder: Path, only: str) -> None:
    """Write the answers on every model of such a name that has none in the folder yet."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, model, commands in models():
        if not name.startswith(only) or (file := folder / f"{name}.json.gz").exists():
            continue
        answers = {command: answer(ALL[command], model) for command in commands}
        seconds = {command: value.pop("seconds") for command, value in answers.items()}
        file.write_bytes(gzip.compress(json.dumps(answers).encode(), mtime=0))
        print(name, " ".join(f"{command} {value}" for command, value in seconds.items()), flush=True)


def answer(command: Sequence[str], model: str) -> dict[str, Any]:
    """Run a command in a process of its own; return its exit code, its texts less their numbers, the numbers, its CPU
    time in s.
    """
    with tempfile.TemporaryDirectory() as place:
        if not (child := os.fork()):
            _run(command, model, Path(place))
        _, status, usage = os.wait4(child, 0)
        texts = {
            str(file.relative_to(place)): file.read_text(errors="replace").replace(place, "")
            for file in sorted(Path(place).rglob("*"))
            if file.is_file() and file.name != "model.yaml"
        }
    numbers = {name: NUMBER.findall(text) for name, text in texts.items() if name in {"out", "errors", "table.csv"}}
    return {
        "exit": os.waitstatus_to_exitcode(status),
        "texts": {name: NUMBER.sub("#", text) if name in numbers else text for name, text in texts.items()},
        "numbers": numbers,
        "seconds": round(usage.ru_utime + usage.ru_stime, 2),
    }


def _run(command: Sequence[str], model: str, place: Path) -> None:
    """Run a command in a folder, its output in files `out` and `errors` there, and end the process."""
    os.chdir(place)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 5))
    code = 1
    try:
        sys.stdout = Path("out").open("w")  # noqa: SIM115
        sys.stderr = Path("errors").open("w")  # noqa: SIM115
        file = model
        if "\n" in model:
            Path("model.yaml").write_text(model)
            file = "model.yaml"
        code = main([command[0], file, *command[1:]])
        sys.stdout.flush()
        sys.stderr.flush()
        if "--json" in command:
            Path("out").write_text(json.dumps(_lasting(json.loads(Path("out").read_text())), indent=0))
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _lasting(value: Any) -> Any:
    """Return a printed object without the members that differ from run to run."""
    if isinstance(value, dict):
        return {key: _lasting(part) for key, part in value.items() if key not in UNLIKE}
    return [_lasting(part) for part in value] if isinstance(value, list) else value


def compare(before: Path, after: Path) -> int:
    """Print what differs between two records; return by how many answers they differ."""
    names = [{file.name for file in folder.glob("*.json.gz")} for folder in (before, after)]
    print(*(f"{name}: in one record only" for name in sorted(names[0] ^ names[1])), sep="\n")
    different = 0
    for name in sorted(names[0] & names[1]):
        old, new = (json.loads(gzip.decompress((folder / name).read_bytes())) for folder in (before, after))
        for command in old:
            if difference := _difference(old[command], new.get(command, {"exit": None})):
                different += 1
                print(name.removesuffix(".json.gz"), command, difference)
    print(f"{different} of the answers on {len(names[0] & names[1])} models differ")
    return different


def _difference(old: dict[str, Any], new: dict[str, Any]) -> str:
    """Return the first difference of two answers, empty where there is none."""
    if old["exit"] != new["exit"]:
        return f"exit {old['exit']}, then {new['exit']}"
    if unlike := sorted(set(old["texts"]) ^ set(new["texts"])):
        return f"files {unlike}"
    for name, text in old["texts"].items():
        if text != new["texts"][name]:
            pairs = zip([*text.splitlines(), ""], [*new["texts"][name].splitlines(), ""], strict=False)
            line, (first, second) = next((k, pair) for k, pair in enumerate(pairs, 1) if pair[0] != pair[1])
            return f"{name}:{line}: {first[:100]!r}, then {second[:100]!r}"
        worst = max(
            (_distance(*pair) for pair in zip(old["numbers"].get(name, ()), new["numbers"].get(name, ()), strict=True)),
            default=0.0,
        )
        if worst > TOLERANCE:
            return f"{name}: a number differs by {worst:.1e}"
    return ""


def _distance(first: str, second: str) -> float:
    """Return by how much two numbers differ, relative to the larger where that is above 1."""
    a, b = float(first), float(second)
    return 0.0 if first == second else abs(a - b) / max(1.0, abs(a), abs(b)) if math.isfinite(a + b) else math.inf


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("what", choices=("record", "compare"))
    arguments.add_argument("folders", nargs="+", type=Path)
    arguments.add_argument("--only", default="", help="models whose names begin so: example, text, random")
    given = arguments.parse_args()
    if given.what == "compare":
        sys.exit(bool(compare(*given.folders)))
    for each in given.folders:
        record(each, given.only)
