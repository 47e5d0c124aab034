"""The Octave target: its functions, read by a small interpreter here, and by Octave where it is installed."""

from __future__ import annotations

import csv
import json
import math
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from random_programs import ARITHMETIC, FUNCTIONS, Maker

import multibody_sym as mbs
from multibody_sym.errors import InputError
from multibody_sym.program.octave_target import octave_source
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.statements import Array
from multibody_sym.program.target_layout import spread_samples

OCTAVE = shutil.which("octave-cli")
needs_octave = pytest.mark.skipif(OCTAVE is None, reason="no Octave")
EXAMPLES = Path(__file__).parents[2] / "examples"
TREES = ("double_pendulum", "gyroscope", "cart_pole")


class Elements:
    """Numbers that are called as Octave's arrays are: a(1), a(1, 2)."""

    def __init__(self, values: Any) -> None:
        self.values = np.asarray(values, dtype=float)

    def __call__(self, *places: int) -> float:
        return float(self.values[tuple(k - 1 for k in places)])


def array(text: str, names: dict[str, Any]) -> Any:
    """Return the value of [a, b; c, d], of zeros(m, n), or of an expression."""
    if not text.startswith("["):
        found = eval(text.replace("~=", "!=").replace("^", "**"), names)
        return Elements(found) if isinstance(found, np.ndarray) else found
    rows = [[array(x, names) for x in split(row, ",")] for row in split(text[1:-1], ";")]
    return Elements([row[0] for row in rows] if len(rows[0]) == 1 else rows)


def split(text: str, mark: str) -> list[str]:
    """Return the parts of a text between marks outside of parentheses."""
    parts, depth = [""], 0
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == mark and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def octave(files: dict[str, str], name: str, given: Sequence[Any]) -> list[Any]:
    """Return what a function of a file returns, for numbers and `Elements`."""
    head, *lines = files[f"{name}.m"].splitlines()
    match = re.fullmatch(r"function \[(.*)\] = \w+\((.*)\)", head)
    assert match is not None
    outputs, inputs = (split(part, ",") if part else [] for part in match.groups())
    own = {key: getattr(math, key) for key in FUNCTIONS if hasattr(math, key)}
    names: dict[str, Any] = own | {
        "mbs_choose": lambda c, a, b: a if c else b, "power": math.pow, "abs": abs, "max": max, "min": min,
        "sign": np.sign, "sqrt": math.sqrt, "pi": math.pi, "inf": math.inf, "nan": math.nan,
        "zeros": lambda *shape: np.zeros(shape),
    }  # fmt: skip
    names |= dict(zip(inputs, given, strict=True))
    for line in lines:
        if line.startswith("%"):
            continue
        left, right = line.removesuffix(";").split(" = ", 1)
        call = re.fullmatch(r"(mbs_\w+)\((.*)\)", right)
        if left.startswith("[") and call is not None:
            found = octave(files, call[1], [array(x, names) for x in split(call[2], ",")])
            names |= dict(zip(split(left[1:-1], ","), found, strict=True))
        else:
            names[left] = array(right, names)
    return [names[name] for name in outputs]


def assert_same(files: dict[str, str], name: str, program: Program, given: Sequence[Any]) -> None:
    wanted = interpret(program, *given)
    shown = [Elements(x) if array.shape else float(x) for x, array in zip(given, program.inputs, strict=True)]
    for got, right in zip(octave(files, f"mbs_{name}", shown), wanted, strict=True):
        values = got.values if isinstance(got, Elements) else got
        assert np.ravel(values) == pytest.approx(np.ravel(right), rel=1e-13, abs=1e-13)


def straight(seed: int) -> Program:
    """Return a Program without loops and solves, of moderate numbers."""
    smooth = (*(x for x in ARITHMETIC if x != "sqrt"), "sin", "cos", "tanh", "atan", "asinh", "sinh")
    inputs = [Array("t", ()), Array("q", (3,)), Array("sin", (2, 2))]
    return Maker(seed, smooth, solves=False).function("straight", inputs, {"x": (3,), "q": (2, 2), "y": ()}, 0, 30)


@pytest.mark.parametrize("seed", range(8))
def test_random_functions_have_the_numbers_of_the_interpreter(seed: int) -> None:
    program, maker = straight(seed), Maker(seed, ARITHMETIC)
    files = octave_source({"straight": program}, {})
    for _ in range(3):
        given = [np.asarray(x) for x in maker.arguments(program)]
        if all(np.isfinite(x).all() for x in interpret(program, *given)):
            assert_same(files, "straight", program, given)


@pytest.mark.parametrize("name", TREES)
def test_exported_trees_move_as_simulated(name: str, tmp_path: Path) -> None:
    """The functions in the interpreter here have the rates that a run has at its start."""
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    mbs.export(system, to="octave", directory=tmp_path)
    files = {file.name: file.read_text() for file in tmp_path.glob("*.m")}
    data = json.loads((tmp_path / "names.json").read_text())
    q, u = ([entry["initial"] for entry in data[kind]] for kind in ("coordinates", "speeds"))
    given = [0.0, *(Elements(x) for x in (q, u, [entry["value"] for entry in data["parameters"]]))]
    (inputs,) = octave(files, "mbs_inputs", given)
    qdot, udot, *_ = octave(files, "mbs_state_derivative", [*given, inputs, Elements([])])
    rates = mbs.function(system, "state_derivative", backend="python")(0.0, q, u)
    assert qdot.values == pytest.approx(rates.qdot, rel=1e-12, abs=1e-12)
    assert udot.values == pytest.approx(rates.udot, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("name", ["slider_crank", "chain", "textbook/ladder"])
def test_other_models_are_refused_in_words(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="trees of few bodies"):
        mbs.export(mbs.load(EXAMPLES / f"{name}.yaml"), to="octave", directory=tmp_path)
    assert not list(tmp_path.iterdir())


@needs_octave
@pytest.mark.parametrize("name", TREES)
def test_octave_agrees_and_integrates(name: str, tmp_path: Path) -> None:
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    mbs.export(system, to="octave", directory=tmp_path)
    for words in (["selftest.m"], ["integrate.m", "0.5"]):
        run = subprocess.run([str(OCTAVE), *words], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert run.returncode == 0, run.stderr
    last = [float(x) for x in list(csv.reader((tmp_path / "motion.csv").open()))[-1]]
    right = mbs.simulate(system, t_end=0.5, samples=2, rtol=1e-11, backend="python")
    assert last[1:] == pytest.approx([*right.q[-1], *right.u[-1]], rel=1e-3, abs=1e-6)


@needs_octave
def test_octave_finds_a_wrong_number(tmp_path: Path) -> None:
    programs = {"straight": straight(1)}
    files = octave_source(programs, spread_samples(programs))
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    wrong = re.sub(r"^(x = \[)", r"\g<1>1 + ", files["mbs_straight.m"], flags=re.MULTILINE)
    (tmp_path / "mbs_straight.m").write_text(wrong)
    run = subprocess.run([str(OCTAVE), "selftest.m"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode != 0
    assert "WRONG" in run.stderr
