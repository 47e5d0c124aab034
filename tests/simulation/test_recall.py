"""What is remembered between runs: the structure decides, numbers do not, and a recalled run imports nothing heavy."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics import programs as derivation
from multibody_sym.simulation.recall import structure_key

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "double_pendulum.yaml"
HEAVY = ("sympy", "scipy", "matplotlib", "pyarrow", "jinja2")


def changed(**pieces: str) -> mbs.System:
    text = EXAMPLE.read_text()
    for piece, other in pieces.values():
        assert piece in text
        text = text.replace(piece, other)
    return mbs.loads(text)


@pytest.mark.parametrize(
    ("piece", "other"),
    [
        ("name: double_pendulum", "name: other"),
        ("m1: {value: 1 kg", "m1: {value: 3 kg"),
        ("g: 9.81", "g: 10*l1"),
        ("initial: {q: 90 deg}", "initial: {q: 1, u: 2}"),
        ("simulation: {t_end: 10 s}", "simulation: {t_end: 2 s, method: rk4, step: 0.01}"),
    ],
)
def test_numbers_start_and_settings_leave_the_key_alone(piece: str, other: str) -> None:
    usual = structure_key(mbs.load(EXAMPLE), "composite_body")
    assert structure_key(changed(one=(piece, other)), "composite_body") == usual


@pytest.mark.parametrize(
    ("piece", "other"),
    [
        ("com: [0, -l2, 0]", "com: [l2, 0, 0]"),
        ("gravity: [0, -g, 0]", "gravity: [0, 0, -g]"),
        ("total_energy()", "2*total_energy()"),
        ("  g: 9.81", "  g: 9.81\n  k: 1"),
        ("parent: upper.end", "parent: upper"),
        ("m1: {value: 1 kg, positive: true}", "m1: {value: 1 kg}"),
    ],
)
def test_structure_changes_the_key(piece: str, other: str) -> None:
    usual = structure_key(mbs.load(EXAMPLE), "composite_body")
    assert structure_key(changed(one=(piece, other)), "composite_body") != usual


def test_formalism_changes_the_key() -> None:
    system = mbs.load(EXAMPLE)
    assert structure_key(system, "composite_body") != structure_key(system, "block_ldl")


def test_a_second_run_derives_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    system = changed(one=("total_energy()", "3*total_energy()"))
    first = mbs.simulate(system, t_end=1)

    def derive(*_arguments: object, **_options: object) -> None:
        raise AssertionError("derived again")

    monkeypatch.setattr(derivation, "programs", derive)
    second = mbs.simulate(system, t_end=1, parameters={"l2": 2})
    assert second.ready.compiled.path == first.ready.compiled.path
    with pytest.raises(AssertionError, match="derived again"):
        mbs.simulate(changed(one=("total_energy()", "4*total_energy()")), t_end=1)


def test_a_recalled_run_imports_nothing_heavy(tmp_path: Path) -> None:
    program = (
        "import sys, json; from multibody_sym.cli import main;"
        f"code = main(['simulate', {str(EXAMPLE)!r}, '-o', 'out.csv']);"
        f"print(json.dumps([code, [m for m in {HEAVY!r} if m in sys.modules]]))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
    assert json.loads(done.stdout.splitlines()[-1]) == [0, []]
    assert len((tmp_path / "out.csv").read_text().splitlines()) == 1002
