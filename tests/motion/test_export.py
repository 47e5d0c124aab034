"""Exported folders: they compile without a warning, test themselves, and integrate without this package."""

from __future__ import annotations

import json
import os
import re
import shutil
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.program.target_layout import EXPORTED_PARTS, runtime_files

EXAMPLES = Path(__file__).parents[2] / "examples"
COMPILER = shutil.which("cc") or shutil.which("gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler")
HELD = """
multibody_sym: 1
name: held $name {with} "quotes"
gravity: [0, -g, 0]
parameters: {g: 9.81, l: 1 m, k: 3}
bodies: {bob: {mass: 2 kg, inertia: {Izz: 1}}}
joints: {plane: {type: planar, parent: ground, child: bob, q: [x, y, turn], initial: {q: [l, 0, 0]}}}
forces: {push: {type: torque, on: bob, value: [0, 0, P]}}
constraints: {rod: {type: distance, between: [ground, bob], value: l}}
inputs: {P: k*sin(t)}
outputs: {pull: tension(rod)}
"""


def shell(line: str, folder: Path) -> str:
    return subprocess.run(line, shell=True, cwd=folder, capture_output=True, text=True, check=True, timeout=120).stdout


@needs_compiler
@pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler")
def test_headers_serve_programs_in_cpp(tmp_path: Path) -> None:
    mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)
    (tmp_path / "main.cpp").write_text('#include "model.h"\nint main() { return mbs_programs[0].n_in < 1; }\n')
    shell(f"{COMPILER} -c model.c solve.c && c++ -Wall -Werror main.cpp model.o solve.o -lm && ./a.out", tmp_path)


@needs_compiler
@pytest.mark.parametrize("fold", [False, True])
def test_c_compiles_as_its_head_says_and_tests_itself(tmp_path: Path, fold: bool) -> None:
    further = ["mass_matrix", "state_derivative_by_q_u_inputs"]
    files = mbs.export(mbs.loads(HELD), to="c", directory=tmp_path / "out", fold=fold, functions=further)
    runtime = runtime_files(EXPORTED_PARTS)
    assert {file.name for file in files} == {"model.c", "model.h", *runtime, "selftest.c", "names.json"}
    line = re.search(r"Self-test: (cc .*)$", (tmp_path / "out" / "model.c").read_text(), re.MULTILINE)[1]
    printed = shell(line.replace("cc ", f"{COMPILER} -Wall -Wextra -Werror -pedantic ", 1), tmp_path / "out")
    assert printed.count("ok") == 8
    assert all(f"{name}: ok" in printed for name in ("project_position", *further))


@pytest.mark.parametrize("fold", [False, True])
def test_python_tests_itself(tmp_path: Path, fold: bool) -> None:
    mbs.export(mbs.loads(HELD), to="python", directory=tmp_path, fold=fold)
    root = Path(mbs.__file__).parents[1]
    printed = shell(f"PYTHONPATH={root} {sys.executable} model.py", tmp_path)
    assert printed.count("ok") == 6


def test_folded_code_reads_no_parameter(tmp_path: Path) -> None:
    texts = {}
    for fold in (False, True):
        mbs.export(mbs.loads(HELD), to="c", directory=tmp_path, fold=fold, parameters={"g": "1.625"})
        texts[fold] = (tmp_path / "model.c").read_text()
    assert "parameters[" in texts[False]
    assert "parameters[" not in texts[True]
    assert "1.625" in texts[True]
    assert "1.625" not in texts[False]


def test_names_tell_what_the_arrays_hold(tmp_path: Path) -> None:
    mbs.export(mbs.loads(HELD), to="c", directory=tmp_path, parameters={"l": 2})
    names = json.loads((tmp_path / "names.json").read_text())
    assert names["coordinates"][0] == {"name": "x", "unit": "m", "initial": 2.0}
    chosen = ["most independent rows", "Baumgarte alpha", "Baumgarte beta"]
    assert [p["name"] for p in names["parameters"]] == ["g", "l", "k", *chosen]
    assert (names["inputs"], names["outputs"], names["constraints"]) == (["P"], ["pull"], ["rod"])
    assert [p["unit"] for p in names["parameters"]][:3] == ["", "m", ""]
    assert names["units"] == {"inputs": {"P": ""}, "outputs": {"pull": "N"}, "constraints": {"rod": "N"}}
    wanted = {"qdot": [3], "udot": [3], "multipliers": [1], "report": [3]}
    assert names["programs"]["state_derivative"]["outputs"] == wanted


def test_no_name_of_the_user_is_in_the_code(tmp_path: Path) -> None:
    mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)
    renamed = HELD.replace("held $name {with} \"quotes\"", "other").replace("rod", "bar").replace("P", "push_in")
    renamed = re.sub(r"\b(g|l|k|x|y|turn|bob|pull)\b", r"other_\1", renamed)
    mbs.export(mbs.loads(renamed), to="c", directory=tmp_path / "renamed")
    for file in ("model.c", "model.h", "selftest.c"):
        assert (tmp_path / file).read_bytes() == (tmp_path / "renamed" / file).read_bytes()


@needs_compiler
def test_a_foreign_driver_reaches_the_same_state(tmp_path: Path) -> None:
    """Explicit Euler by a C program of a few lines against the same steps with the compiled state derivative.

    The slopes of the accelerations and the Jacobian of a frame at the end are those of Python.
    """
    system = mbs.load(EXAMPLES / "double_pendulum.yaml")
    slopes = mbs.function(system, "state_derivative").derivative("q", "u")
    tip = mbs.function(system, "jacobian", frame=list(system.bodies)[-1])
    mbs.export(system, to="c", directory=tmp_path, functions={"slopes": slopes, "tip": tip})
    (tmp_path / "driver.c").write_text(
        """
        #include <stdio.h>
        #include "model.h"
        int main(void) {
            double x[4] = {1.0, 0.5, 0.0, 0.0}, d[4], p[5] = {1, 1, 1, 1, 9.81}, report[3], none[1], s[20], J[24];
            for (int i = 0; i < 1000; ++i) {
                mbs_state_derivative(0.0, x, x + 2, p, none, none, d, d + 2, none, report);
                for (int k = 0; k < 4; ++k) x[k] += 1e-3 * d[k];
            }
            printf("%.17g %.17g\\n", x[0], x[1]);
            mbs_slopes(0.0, x, x + 2, p, none, none, s, s + 8, none);
            mbs_tip(0.0, x, x + 2, p, none, none, J, J + 12);
            for (int k = 0; k < 16; ++k) printf("%.17g ", s[k]);
            for (int k = 0; k < 24; ++k) printf("%.17g ", J[k]);
        }
        """
    )
    printed = shell(f"{COMPILER} -O2 -ffp-contract=off driver.c model.c solve.c -lm -o driver && ./driver", tmp_path)
    rhs, x = mbs.compile(mbs.state_derivative(system)), [1.0, 0.5, 0.0, 0.0]
    for _ in range(1000):
        x = [a + 1e-3 * b for a, b in zip(x, rhs(0.0, x).tolist(), strict=True)]
    q, u = np.split(np.array(x), 2)
    further = np.concatenate([np.ravel(part) for f in (slopes, tip) for part in f(0.0, q, u)])
    assert list(map(float, printed.split())) == pytest.approx([*x[:2], *further], rel=1e-11, abs=1e-12)


def test_wrong_targets_and_folders(tmp_path: Path) -> None:
    system = mbs.load(EXAMPLES / "pendulum.yaml")
    with pytest.raises(mbs.InputError, match="did you mean"):
        mbs.export(system, to="pyton", directory=tmp_path)
    wrong: list[tuple[Any, str]] = [
        (["mas_matrix"], "no function 'mas_matrix'; did you mean mass_matrix"),
        (["mass_matrix_by_x"], "no function of 'x'; known: t, q, u"),
        ({"energy": mbs.function(system, "energies")}, "functions: 'energy' cannot name another function"),
        ({"M": mbs.function(mbs.loads(HELD), "mass_matrix")}, "functions: 'M' is no Function of this system"),
        ({"M": "mass_matrix"}, "functions: 'M' is no Function of this system"),
    ]
    for functions, message in wrong:
        with pytest.raises(mbs.InputError, match=message):
            mbs.export(system, to="c", directory=tmp_path, functions=functions)
    with pytest.raises(mbs.InputError, match="functions: an FMU has parameters and no other functions"):
        mbs.export(system, to="fmu", directory=tmp_path / "x.fmu", functions=["mass_matrix"])
    (tmp_path / "file").write_text("")
    with pytest.raises(mbs.OutputError):
        mbs.export(system, to="c", directory=tmp_path / "file")


def contents(folder: Path) -> dict[str, bytes]:
    return {file.name: file.read_bytes() for file in folder.iterdir()}


@pytest.mark.parametrize("name", ["model.c", "selftest.c", "names.json"])
@pytest.mark.parametrize("content", [b"my own work", b"", b"{}", b'{"written": {"names.json": "0"}}'])
def test_a_file_of_the_users_own_is_not_overwritten(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(mbs.InputError, match=rf"{re.escape(name)}: this file is not as an export wrote it"):
        mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)
    assert contents(tmp_path) == {name: content}


def test_files_of_an_earlier_export_are_replaced_unless_they_were_changed(tmp_path: Path) -> None:
    heavier = mbs.loads(HELD.replace("g: 9.81", "g: 1.62"))
    mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)
    before = contents(tmp_path)
    mbs.export(heavier, to="python", directory=tmp_path)
    mbs.export(heavier, to="c", directory=tmp_path, fold=True)
    after = contents(tmp_path)
    assert after["model.c"] != before["model.c"]
    mbs.export(heavier, to="c", directory=tmp_path, fold=True)
    assert contents(tmp_path) == after
    for name in ("model.c", "names.json"):
        (tmp_path / name).write_bytes(after[name].replace(b"0", b"1", 1))
        changed = contents(tmp_path)
        with pytest.raises(mbs.InputError, match="move it away"):
            mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)
        assert contents(tmp_path) == changed
        (tmp_path / name).write_bytes(after[name])
    mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)


def test_an_export_reads_no_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "model.c")
    os.mkfifo(tmp_path / "names.json")
    with pytest.raises(mbs.InputError, match="this file is not as an export wrote it"):
        mbs.export(mbs.loads(HELD), to="c", directory=tmp_path)
    assert stat.S_ISFIFO((tmp_path / "model.c").stat().st_mode)
