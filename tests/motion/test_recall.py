"""What is remembered between runs: the structure decides, numbers do not, and a recalled run imports nothing heavy."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs import system as derivation
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.spanning_tree import spanning_tree
from multibody_sym.motion.prepare.problem import structure_key

ROOT = Path(__file__).parents[2]
FOUR_BAR = ROOT / "examples" / "four_bar.yaml"
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
    usual = structure_key(mechanism(mbs.load(EXAMPLE)), "composite_body")
    assert structure_key(mechanism(changed(one=(piece, other))), "composite_body") == usual


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
    usual = structure_key(mechanism(mbs.load(EXAMPLE)), "composite_body")
    assert structure_key(mechanism(changed(one=(piece, other))), "composite_body") != usual


def test_formalism_changes_the_key() -> None:
    system = mechanism(mbs.load(EXAMPLE))
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
        "import sys, json; from multibody_sym.cli.main import main;"
        f"code = main(['simulate', {str(EXAMPLE)!r}, '-o', 'out.csv']);"
        f"print(json.dumps([code, [m for m in {HEAVY!r} if m in sys.modules]]))"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
    assert json.loads(done.stdout.splitlines()[-1]) == [0, []]
    assert len((tmp_path / "out.csv").read_text().splitlines()) == 1002


# --- what decides where a loop is cut ------------------------------------------------------------------------------

LOOP = """
multibody_sym: 1
name: loop
gravity: [0, -9.81, 0]
parameters: {k: 2}
bodies:
  ground: {points: {pivot: [0.5, 0, 0]}}
  crank: {shape: {rod: 0.2 m, mass: 1}, points: {end: [0.2, 0, 0]}}
  coupler: {shape: {rod: 0.5 m, mass: 1}, points: {end: [0.5, 0, 0]}}
  rocker: {shape: {rod: 0.4 m, mass: 1}, points: {end: [0.4, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, initial: {q: 60 deg, known: true}}
  B: {type: revolute, parent: crank.end, child: coupler, axis: z}
  D: {type: revolute, parent: ground.pivot, child: rocker, axis: z}
  C: {type: revolute, parent: coupler.end, child: rocker.end, axis: z}
"""
"""Both D and C lead to the rocker; nothing names either, and C is cut, for D is nearer to ground."""
END_OF_C = "rocker.end, axis: z}"

CUTTING = {
    "initial": (END_OF_C, "rocker.end, axis: z, initial: {q: 40 deg}}"),
    "cut": ("child: rocker, axis: z}", "child: rocker, axis: z, cut: true}"),
    "freedoms": ("D: {type: revolute", "D: {type: cylindrical"),
    "parent": ("parent: ground.pivot, child: rocker", "parent: coupler.end, child: rocker.end"),
    "ask": ("joints:", "ask: {angle: C}\njoints:"),
    "outputs": ("joints:", "outputs: {angle: C}\njoints:"),
    "stop": ("joints:", "stop: {turned: u_C > 3}\njoints:"),
    "inputs": ("joints:", "inputs: {signal: sin(C)}\njoints:"),
    "joint of a force": ("joints:", "forces: {motor: {type: torque, joint: C, value: k}}\njoints:"),
    "expression of a force": ("joints:", "forces: {motor: {type: torque, joint: A, value: k*C}}\njoints:"),
    "joints of a constraint": ("joints:", "constraints: {g: {type: gear, joints: [A, C], ratio: k}}\njoints:"),
    "expression of a constraint": ("joints:", "constraints: {g: {type: expression, zero: C - A}}\njoints:"),
}


@pytest.mark.parametrize(("piece", "other"), CUTTING.values(), ids=CUTTING)
def test_whatever_decides_where_a_loop_is_cut_changes_the_key(piece: str, other: str) -> None:
    assert piece in LOOP
    plain, changed = mbs.loads(LOOP), mbs.loads(LOOP.replace(piece, other))
    assert (spanning_tree(plain).cut, derived(plain)) != (spanning_tree(changed).cut, derived(changed))
    assert structure_key(mechanism(plain), "composite_body") != structure_key(mechanism(changed), "composite_body")


def derived(system: mbs.System) -> dict[str, str]:
    made = programs(mechanism(system), FORMALISMS["composite_body"]).as_mapping()
    return {name: program.digest.hex() for name, program in made.items()}


def test_a_start_moved_to_another_joint_is_not_answered_with_programs_of_the_old_tree(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = FOUR_BAR.read_text().replace("t_end: 10 s", "t_end: 0.01 s")
    at_d, at_c = "q: rocker_angle, initial: {q: 100 deg}}", "child: rocker.end, axis: z}"
    assert at_d in text
    assert at_c in text
    moved = text.replace(at_d, "q: rocker_angle}").replace(at_c, at_c.replace("}", ", initial: {q: 130 deg}}"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "one"))
    mbs.simulate(mbs.loads(text), backend="python")
    after = mbs.simulate(mbs.loads(moved), backend="python")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "another"))
    alone = mbs.simulate(mbs.loads(moved), backend="python")
    for name in ("tip", "crank_angle"):
        assert after[name].tolist() == alone[name].tolist()


def test_numbers_of_a_loop_leave_its_key_alone() -> None:
    usual = structure_key(mechanism(mbs.loads(LOOP)), "composite_body")
    for piece, other in (("k: 2", "k: 3"), ("q: 60 deg, known: true", "q: 10 deg, u: 3"), ("name: loop", "name: x")):
        assert structure_key(mechanism(mbs.loads(LOOP.replace(piece, other))), "composite_body") == usual


def test_the_key_is_the_same_in_every_process(tmp_path: Path) -> None:
    program = (
        "import multibody_sym as mbs; from multibody_sym.mechanics.resolve import mechanism;"
        "from multibody_sym.motion.prepare.problem import structure_key;"
        f"print(structure_key(mechanism(mbs.load({str(FOUR_BAR)!r})), 'block_ldl'))"
    )
    keys = set()
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONHASHSEED": seed}
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
        keys.add(done.stdout)
    assert len(keys) == 1
