"""Ordinary files whose values are swept end with an answer, or with an error that has a place in the file."""

from __future__ import annotations

import json
import random
import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from swept import BASES, bases, swept, text_of, words

from multibody_sym.cli.main import main

ROOT = Path(__file__).parents[2]
LARGE = ("stewart_platform", "elastic_rod", "andrews_squeezer", "chain", "spatial_chain", "bicycle")
LATE = "late"


class LateError(BaseException):
    """A command that takes longer than the test is for."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise LateError after a time of computing."""

    def late(*_arguments: object) -> None:
        raise LateError

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


def outcome(seed: int, models: dict[str, Any], folder: Path, capfd: Any, seconds: float) -> str | int:
    """Return the exit code of a command on one swept file; what is wrong has a place in the file, or an option's."""
    rng = random.Random(seed)
    small = list(BASES)
    name = rng.choice(small if rng.random() < 0.6 else [x for x in models if x not in small and x not in LARGE])
    file = folder / "m.yaml"
    file.write_text(text_of(swept(rng, models[name])))
    command = [*words(rng, str(file)), "--json"]
    try:
        with limited(seconds):
            code = main(command)
    except LateError:
        capfd.readouterr()
        return LATE
    out, err = capfd.readouterr()
    assert out.startswith("{"), (seed, name, command[0], out[:200])
    printed = json.loads(out)
    assert "Traceback" not in err
    assert code != 70, (seed, name, command[0], err)
    if code == 2:
        assert printed["error"]["where"]["line"], (seed, name, command[0], err)
    return code


def run(seeds: range, folder: Path, capfd: Any, seconds: float) -> Counter[str | int]:
    models = bases(ROOT / "examples")
    for command in ("check", "solve", "linearize", "equilibrium", "derive"):  # what is imported is whole before limits
        assert main([command, str(ROOT / "examples" / "pendulum.yaml"), "--json"]) == 0
    capfd.readouterr()
    return Counter(outcome(seed, models, folder, capfd, seconds) for seed in seeds)


def test_commands_answer_whatever_the_numbers_are(tmp_path: Path, capfd: Any) -> None:
    codes = run(range(5000, 5024), tmp_path, capfd, 2)
    assert set(codes) <= {0, 2, 3, LATE}
    assert codes[LATE] <= 5
    assert min(codes[0], codes[2], codes[3]) > 0


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 3000, 300))
def test_commands_answer_whatever_the_numbers_are_long(first: int, tmp_path: Path, capfd: Any) -> None:
    codes = run(range(first, first + 300), tmp_path, capfd, 20)
    with capfd.disabled():
        print(f"\nswept values {first} to {first + 299}: {dict(codes)}")
    assert set(codes) <= {0, 2, 3, LATE}
    assert codes[LATE] <= 6
