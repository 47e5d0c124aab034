"""The JavaScript target in node: its self-test of random Programs, solves, loops, tables; wrong results are found."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from random_programs import ARITHMETIC, ARITY, FUNCTIONS, Maker

import multibody_sym as mbs
from multibody_sym.program.list_target import javascript_source
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.statements import Array, ProgramError
from multibody_sym.program.target_layout import spread_samples
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.node import number

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="no node")


def run(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [str(NODE), "selftest.mjs"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def write(folder: Path, texts: dict[str, str]) -> None:
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="ascii")


def solving(seed: int) -> Program:
    """Solve equations of which some rows depend on others, or vanish."""
    random = np.random.default_rng(seed)
    count, columns = int(random.integers(7)), int(random.integers(7))
    trace = Trace("rows", [Array("a", (count, columns)), Array("r", (count,))])
    rows = np.array(trace["a"], dtype=object).reshape(count, columns)
    rows[random.random((count, columns)) < 0.3] = number(0)
    if count > 2 and seed % 2:
        rows[-1] = rows[0] + rows[1]
    found = trace.solve(rows.tolist(), trace["r"], columns)
    return trace.finish({"x": ((columns,), found.solution), "l": ((count,), found.multipliers)})


def of_one_number() -> Program:
    """All functions of x, of -x and of 2 x: the last two have no logarithm, or no angle."""
    trace = Trace("functions", [Array("x")])
    (x,) = trace["x"]
    values = [BUILD[name](*[y] * ARITY.get(name, 1)) for y in (x, -x, 2 * x) for name in FUNCTIONS]
    return trace.finish({"y": ((len(values),), values)})


@needs_node
def test_random_programs_with_loops_and_solves_agree_with_the_interpreter(tmp_path: Path) -> None:
    programs = {f"p{seed}": Maker(seed, ARITHMETIC, solves=False).program() for seed in range(12)}
    programs |= {f"rows{seed}": solving(seed) for seed in range(30)}
    programs["functions"] = of_one_number()
    trace = Trace("f", [Array("class"), Array("x", (2,)), Array("min")])
    a, x, m = (trace[array.name] for array in trace.inputs)
    programs["f"] = trace.finish({"x": ((), [(a[0] + x[0]) ** 7 + m[0]]), "y": ((0,), [])})
    texts = javascript_source(programs, spread_samples(programs))
    write(tmp_path, texts)
    done = run(tmp_path)
    worst = [float(x) for x in re.findall(r": ok, largest difference (\S+)", done.stdout)]
    assert (done.returncode, len(worst)) == (0, len(programs)), done.stdout + done.stderr
    assert max(worst) < 1e-12
    wrong = re.sub(r"(function mbs_f\((?s:.*?)= )", r"\g<1>1e-3 + ", texts["model.mjs"], count=1)
    write(tmp_path, {"model.mjs": wrong})
    done = run(tmp_path)
    assert done.returncode == 1
    assert re.findall(r"^(\w+): WRONG", done.stdout, re.MULTILINE) == ["f"]


MODEL = """
multibody_sym: 1
name: table
gravity: [0, -9.81, 0]
parameters: {m: 2 kg}
bodies: {a: {mass: m, inertia: {Izz: 1}}, b: {mass: m, inertia: {Izz: 1}}}
joints: {J: {type: planar, parent: ground, child: a, q: [x, y, f]}, K: {type: weld, parent: a, child: b}}
inputs:
  push: {table: [[0, 0], [0.3, 3], [0.5, -4], [2, 1]]}
  pull: {table: [[0, 0], [0.3, 3], [0.5, -4], [2, 1]], interpolation: cubic}
forces: {motor: {type: force, on: a, value: [push, pull, 0]}}
constraints: {rod: {type: distance, between: [ground, a], value: 1}}
"""


@needs_node
def test_an_exported_model_tests_itself_with_tables_and_a_constraint(tmp_path: Path) -> None:
    files = mbs.export(mbs.loads(MODEL), "javascript", tmp_path)
    assert {file.name for file in files} == {"model.mjs", "selftest.mjs", "integrate.mjs", "names.json"}
    done = run(tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(": ok") == 7


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


@needs_node
def test_the_integrator_ends_where_the_state_of_the_start_does(tmp_path: Path) -> None:
    """A ball that slides at v0 rolls from t = 2 v0/(7 mu g) on, with 5/7 v0, at x = 12 v0^2/(49 mu g)."""
    mbs.export(mbs.loads(BALL), "javascript", tmp_path)
    done = subprocess.run(
        [str(NODE), "integrate.mjs", "1"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    assert "where the state of the start ends: c stops" in done.stdout
    assert float(done.stdout.split("stopped at t = ")[1].split()[0]) == pytest.approx(0.4, abs=1e-8)
    values = dict(line.split(" = ") for line in done.stdout.splitlines()[1:])
    assert float(values["x"].split()[0]) == pytest.approx(2.4, abs=1e-8)
    assert float(values["u_x"].split()[0]) == pytest.approx(5.0, abs=1e-8)
    for given in (["Infinity"], ["nan"], ["1", "0"]):
        done = subprocess.run(
            [str(NODE), "integrate.mjs", *given], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False
        )
        assert (done.returncode, done.stdout) == (2, "")
        assert f"is a positive number{'' if len(given) > 1 else ' of seconds'}, not {given[-1]}" in done.stderr
    (tmp_path / "names.json").unlink()
    done = subprocess.run([str(NODE), "integrate.mjs"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("there is no file names.json")


def test_what_it_cannot_solve_is_refused() -> None:
    trace = Trace("f", [Array("a", (2,))])
    found = trace.solve([trace["a"]], [number(1)], 2, acting=[number(1)])
    program = trace.finish({"x": ((2,), found.solution)})
    assert np.isfinite(interpret(program, [1.0, 2.0])[0]).all()
    with pytest.raises(ProgramError, match="no solve of which some rows act"):
        javascript_source({"f": program}, {})
