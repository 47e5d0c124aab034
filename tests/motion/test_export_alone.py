"""Exported Python stands alone: without this package it tests itself, and a plain loop integrates it."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main

EXAMPLES = Path(__file__).parents[2] / "examples"
BLOCKED = "import sys; sys.modules['multibody_sym'] = None; sys.modules['sympy'] = None; sys.path.insert(0, '.'); "
RK4 = """
import json
import model

with open("names.json", encoding="utf-8") as file:
    names = json.load(file)
parameters = [entry["value"] for entry in names["parameters"]]
q, u = ([entry["initial"] for entry in names[kind]] for kind in ("coordinates", "speeds"))


def rates(t, x):
    state = t, x[: len(q)], x[len(q) :], parameters
    (inputs,) = model.PROGRAMS["inputs"](*state)
    qdot, udot, *_ = model.PROGRAMS["state_derivative"](*state, inputs, [])
    return qdot + udot


def beside(x, h, k):
    return [a + h * b for a, b in zip(x, k)]


x, h = q + u, END / STEPS
for n in range(STEPS):
    t = n * h
    a = rates(t, x)
    b = rates(t + h / 2, beside(x, h / 2, a))
    c = rates(t + h / 2, beside(x, h / 2, b))
    d = rates(t + h, beside(x, h, c))
    x = [s + h / 6 * (i + 2 * j + 2 * k + l) for s, i, j, k, l in zip(x, a, b, c, d)]
print(json.dumps(x))
"""


def alone(code: str, folder: Path, *arguments: str) -> str:
    """Return what a fresh interpreter prints that can import neither this package nor sympy."""
    command = [sys.executable, "-I", "-c", BLOCKED + code, *arguments]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


def exported(name: str, folder: Path, **options: Any) -> mbs.System:
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    mbs.export(system, to="python", directory=folder, **options)
    return system


@pytest.mark.parametrize(("name", "fold"), [("four_bar", False), ("four_bar", True), ("rolling_coin", False)])
def test_it_tests_itself_and_imports_numpy_at_most(tmp_path: Path, name: str, fold: bool) -> None:
    exported(name, tmp_path, fold=fold)
    standard = {
        "__future__", "bisect", "collections", "dataclasses", "json", "math", "operator", "pathlib", "sys", "typing",
    }
    for file in tmp_path.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="ascii"))):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                found = [node.module] if isinstance(node, ast.ImportFrom) else [part.name for part in node.names]
                assert {str(module).partition(".")[0] for module in found} <= {*standard, "numpy", "model"}
    printed = alone("import model; sys.exit(model.main())", tmp_path)
    assert printed.count(": ok") == len(json.loads((tmp_path / "names.json").read_text())["programs"])


@pytest.mark.parametrize(("name", "end", "steps"), [("double_pendulum", 1.0, 1000), ("four_bar", 0.5, 1000)])
def test_a_plain_loop_reaches_what_simulate_does(tmp_path: Path, name: str, end: float, steps: int) -> None:
    """Closed loops included, whose accelerations come from the solve that tells their rank (and drift a little)."""
    system = exported(name, tmp_path)
    found = json.loads(alone(RK4.replace("END", repr(end)).replace("STEPS", str(steps)), tmp_path))
    run = mbs.simulate(system, t_end=end, samples=2, rtol=1e-11)
    assert found == pytest.approx([*run.q[-1], *run.u[-1]], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("name", "end"), [("four_bar", 0.5), ("tennis_racket", 0.2)])
def test_the_integrator_beside_it_keeps_constraints(tmp_path: Path, name: str, end: float) -> None:
    system = exported(name, tmp_path)
    printed = alone("import runpy; runpy.run_path('integrate.py', run_name='__main__')", tmp_path, repr(end), "1e-3")
    lines = dict(line.split(" = ", 1) for line in printed.splitlines())
    run = mbs.simulate(system, t_end=end, samples=2, rtol=1e-11)
    for kind in (run.final["coordinates"], run.final["speeds"]):
        for name, value in kind.items():
            assert float(lines[name].split()[0]) == pytest.approx(value, rel=1e-7, abs=1e-7)
    if "largest |phi|" in lines:
        assert float(lines["largest |phi|"]) < 1e-12


BALL = """
multibody_sym: 1
name: ball
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {shape: {sphere: 1, mass: 1}}
joints: {J: {type: planar, parent: ground, child: ball, q: [x, y, a], initial: {q: [0, 1, 0], u: [7, 0, 0]}}}
contacts: {c: {between: [ball, ground.floor], static: 0.5}}
"""


def test_the_integrator_stops_where_the_state_of_the_start_ends(tmp_path: Path) -> None:
    """A ball that slides at v0 rolls from t = 2 v0/(7 mu g) = 0.4 s on."""
    mbs.export(mbs.loads(BALL), to="python", directory=tmp_path)
    told = json.loads((tmp_path / "names.json").read_text())
    assert told["mode"] == {"c": "slide+"}
    assert "c stops" in told["mode_ends"]
    run = "import runpy; runpy.run_path('integrate.py', run_name='__main__')"
    before, after = (alone(run, tmp_path, end, "1e-2") for end in ("0.39", "1"))
    assert before.startswith("of the state at the start only: c slide+\n")
    assert "stopped" not in before
    assert "where that state ends: c stops" in after
    assert float(after.split("stopped at t = ")[1].split()[0]) == pytest.approx(0.4, abs=0.011)
    assert float(after.split("u_x = ")[1].split()[0]) == pytest.approx(5.0, abs=0.06)
    for given in (["inf"], ["nan"], ["one"], ["1", "0"]):
        command = [sys.executable, "-I", "-c", BLOCKED + run, *given]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
        assert (done.returncode, done.stdout) == (1, "")
        assert f"positive numbers of seconds, not {given[-1]}" in done.stderr
    (tmp_path / "names.json").unlink()
    done = subprocess.run([sys.executable, "integrate.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(r"there is no file .*names\.json, which has the start: .*\n", done.stderr)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("impacts/superball", "begins with an impact, which is left out; `impact` returns the speeds after it"),
        ("stages/rope_cut", "of the first stage only; the stages of `then` are left out"),
    ],
)
def test_the_command_names_what_it_leaves_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, words: str
) -> None:
    assert main(["export", str(EXAMPLES / f"{name}.yaml"), "--to", "javascript", "-o", str(tmp_path)]) == 0
    assert words in capsys.readouterr().out


def test_the_command_tells_of_which_state_its_files_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "ball.yaml").write_text(BALL, encoding="utf-8")
    assert main(["export", str(tmp_path / "ball.yaml"), "--to", "c", "-o", str(tmp_path / "out")]) == 0
    assert "of the state at the start only, {c: slide+}" in capsys.readouterr().out
