"""Run commands on random models, each in a process of its own, and keep a table of outcomes.

    python tests/random_runs.py TABLE --seed TEXT --models 2000

TABLE is a file of JSON lines, one for each command on each model; a run that is started again goes on after what stands
there. TEXT, such as the hash of a commit, chooses the models: model k of a text is always the same. Every seventh model
goes through all commands, the others through `check` and `simulate`. `--folder` keeps the models whose outcome is
neither an answer nor a refusal; `--summary` prints the table's counts alone.
"""

from __future__ import annotations

import argparse
import collections
import faulthandler
import gc
import hashlib
import importlib
import json
import math
import os
import pkgutil
import re
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import pytest
from quick_compiler import compile_soon
from random_models import random_model

import multibody_sym
from multibody_sym.cli.main import main as main_of_command

SECONDS: Final = 60
"""CPU time of a command."""
MEMORY: Final = 2 * 2**30
WAIT: Final = 400
"""Seconds after which a command ends that neither computes nor ends."""
ACCOUNT: Final = 1e-6
"""What the energy account of a run may miss, relative to 1 J and the energies in it."""
DRIFT: Final = 1e-8
"""By how much constraints may be violated, in m, m/s, rad or rad/s."""
COMMANDS: Final = {
    "check": ["check"],
    "simulate": ["simulate", "--t-end", "1", "--json"],
    "solve": ["solve"],
    "equilibrium": ["equilibrium"],
    "draw": ["draw", "-o", "figure.svg"],
    "report": ["report", "-o", "report.html"],
    "verify": ["simulate", "--t-end", "1", "--verify"],
}
"""Commands by name; all but the first two on some models only."""


def seed_of(text: str, number: int) -> int:
    """Return the seed of a model by its number."""
    return int.from_bytes(hashlib.sha256(f"{text} {number}".encode()).digest()[:4])


def outcome(command: str, file: Path) -> dict[str, Any]:
    """Run a command on a file in a process of its own; return its class, exit code, CPU time, stage and text."""
    with tempfile.TemporaryDirectory() as place:
        begun = time.monotonic()
        if not (child := os.fork()):
            _command([*COMMANDS[command][:1], str(file), *COMMANDS[command][1:]], place)
        status = usage = None
        while status is None:
            found, code, used = os.wait4(child, os.WNOHANG)
            if found:
                status, usage = code, used
            elif time.monotonic() > begun + WAIT:
                os.kill(child, signal.SIGKILL)
            else:
                time.sleep(0.01)
        out, err = (Path(place, name).read_text(errors="replace") for name in ("out", "err"))
    assert usage is not None
    row = {"seconds": round(usage.ru_utime + usage.ru_stime, 2), "exit": os.waitstatus_to_exitcode(status)}
    return {**row, **_judged(command, row["exit"], out, err)}


def _command(words: Sequence[str], place: str) -> None:
    """Be the command: limit memory and time, print into files."""
    code = 71
    try:
        for number, name in ((1, "out"), (2, "err")):
            os.dup2(os.open(os.path.join(place, name), os.O_WRONLY | os.O_CREAT), number)
        os.chdir(place)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 2))
        faulthandler.enable()
        faulthandler.register(signal.SIGXCPU, chain=False)
        code = main_of_command(list(words))
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


def _judged(command: str, code: int, out: str, err: str) -> dict[str, Any]:
    """Return the class of an outcome and the text that shows it."""
    text = (err or out)[-2000:]
    if "most recent call first" in err:
        frames = re.findall(r'File ".*?multibody_sym/(\S+)", line (\d+) in (\w+)', err)
        stage = " < ".join(f"{file}:{line} {name}" for file, line, name in frames[:12])
        return {"class": "abort" if "Fatal" in err else "over the limit of time", "text": stage}
    if code == -signal.SIGKILL:
        return {"class": "over the limit of time", "text": text}
    if code < 0:
        return {"class": "abort", "text": text}
    if "Traceback" in err:
        return {"class": "traceback", "text": text}
    if code in (2, 3) and "DISAGREE" in out:
        return {"class": "disagree", "text": out[-2000:]}
    if code in (2, 3):
        told = re.search(r"error: [^\n]*", err) if command != "simulate" else None
        text = told.group() if told else text
        started = re.search(r"(?:at|from) t = (\S+)", text)
        later = started is not None and float(started.group(1).rstrip(",:;") or 0) > 0
        mid = later and code == 3 and "simulate" in COMMANDS[command]
        ends = '"number": "R101"' in out or "[R101]" in err
        return {"class": "refusal" if not mid else "end of the motion" if ends else "refusal in mid-run", "text": text}
    if code:
        return {"class": f"exit {code}", "text": text}
    if re.search(r"\b(nan|inf|NaN|Infinity)\b", out):
        return {"class": "nan", "text": out[-2000:]}
    return {"class": "answer"} if command != "simulate" else judged_run(json.loads(out))


def judged_run(run: dict[str, Any], t_end: float = 1.0) -> dict[str, Any]:
    """Return the class of a run by what it conserves, its constraints and its end."""
    energy = run["outputs"]["E"]
    scale = 1 + max(map(abs, energy)) + sum(map(abs, run["impact_losses"].values()))
    missed, drift = run["energy_residual"], run["drift"]
    found = {"events": len(run["events"]), "account": missed, "drift": drift["position"]}
    if missed is not None and abs(missed) > ACCOUNT * scale:
        return {"class": "energy", **found, "text": f"the energy account misses {missed:.3g} J of {scale:.3g}"}
    worst = max((abs(drift[key]) for key in ("position", "velocity")), default=0.0)
    if not worst <= DRIFT * (1 + max((abs(x) for u in run["speeds"].values() for x in u), default=0.0)):
        return {"class": "drift", **found, "text": f"constraints are missed by {drift}"}
    if not math.isclose(run["final"]["t"], t_end) and run["events"][-1]["kind"] != "stop":
        return {"class": "ends early", **found, "text": str(run["final"]["t"])}
    return {"class": "answer", **found}


def rows_of(table: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in table.read_text().splitlines()] if table.exists() else []


def summary(rows: Sequence[dict[str, Any]]) -> str:
    """Return how many outcomes of each class each command has, and in percent."""
    lines = []
    for command in COMMANDS:
        found = collections.Counter(row["class"] for row in rows if row["command"] == command)
        counts = ", ".join(f"{name} {n} ({n / found.total():.1%})" for name, n in found.most_common())
        lines.append(f"{command:12} {found.total():5} {counts}")
    return "\n".join(lines)


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", type=Path)
    parser.add_argument("--seed", default="0")
    parser.add_argument("--models", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--every", type=int, default=7, help="every so many-th model goes through all commands")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--summary", action="store_true")
    asked = parser.parse_args(words)
    known = {(row["model"], row["command"]) for row in rows_of(asked.table) if row["seed"] == asked.seed}
    _import_all()
    with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as place:
        compile_soon(patch)
        patch.setenv("XDG_CACHE_HOME", place)
        for number in range(asked.first, 0 if asked.summary else asked.first + asked.models):
            commands = list(COMMANDS) if number % asked.every == 0 else list(COMMANDS)[:2]
            if wanted := [command for command in commands if (number, command) not in known]:
                _one_model(asked, number, wanted, Path(place, "model.yaml"))
    print(summary(rows_of(asked.table)))


def _import_all() -> None:
    """Import the package before processes part, so that none of them does."""
    for module in pkgutil.walk_packages(multibody_sym.__path__, "multibody_sym."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    gc.freeze()


def _one_model(asked: argparse.Namespace, number: int, commands: Sequence[str], file: Path) -> None:
    text = random_model(seed_of(asked.seed, number))
    file.write_text(text)
    name = text.splitlines()[1].removeprefix("name: ")
    for command in commands:
        row = {"seed": asked.seed, "model": number, "name": name, "command": command, **outcome(command, file)}
        with asked.table.open("a") as table:
            table.write(json.dumps(row) + "\n")
        if asked.folder and row["class"] not in ("answer", "refusal", "end of the motion"):
            asked.folder.mkdir(exist_ok=True)
            (asked.folder / f"{number}_{command}_{name}.yaml").write_text(text)


if __name__ == "__main__":
    main()
