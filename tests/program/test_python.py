"""The Python target against the interpreter, to the last bit, solves included; its self-test."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_programs import ARITHMETIC, FUNCTIONS, Maker

from multibody_sym.program.list_target import OWN_ARITHMETIC, python_source
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.statements import Array, ProgramError
from multibody_sym.program.target_layout import spread_samples
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import log, sqrt, where
from multibody_sym.scalars.node import number


def loaded(programs: dict[str, Program]) -> dict[str, Callable[..., Any]]:
    names: dict[str, Any] = {}
    exec(compile(python_source(programs), "model", "exec"), names)  # our own text
    functions: dict[str, Callable[..., Any]] = names["PROGRAMS"]
    return functions


def listed(arrays: list[np.ndarray]) -> list[Any]:
    return [a.ravel().tolist() if a.ndim else float(a) for a in arrays]


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**9))
def test_all_operations_calls_and_solves_have_the_bits_of_the_interpreter(seed: int) -> None:
    maker = Maker(seed, ARITHMETIC + FUNCTIONS)
    program = maker.program()
    function = loaded({"p": program})["p"]
    for _ in range(3):
        arrays = maker.arguments(program)
        wanted = interpret(program, *arrays)
        found = function(*listed(arrays))
        assert len(found) == len(wanted)
        for x, y in zip(found, wanted, strict=True):
            assert isinstance(x, list) == (y.ndim > 0)
            assert np.array_equal(x, y.ravel() if y.ndim else y, equal_nan=True)


def test_what_c_computes_without_a_trap_raises_nothing_here() -> None:
    trace = Trace("f", [Array("t")])
    (t,) = trace["t"]
    guarded = where(t <= 0, 0, 1 / t)
    program = trace.finish({"x": ((4,), [guarded, log(t), sqrt(t - 1), 1 / t])})
    assert loaded({"f": program})["f"](0.0)[0][:2] == [0.0, -np.inf]
    assert np.isnan(loaded({"f": program})["f"](0.0)[0][2])
    assert loaded({"f": program})["f"](-0.0)[0][3] == -np.inf


def test_awkward_names() -> None:
    trace = Trace("f", [Array("lambda"), Array("min", (2,)), Array("power")])
    a, m, p = (trace[array.name] for array in trace.inputs)
    program = trace.finish({"x": ((), [(a[0] + m[0]) ** 7 + p[0]]), "y": ((0,), [])})
    assert loaded({"f": program})["f"](1.0, [1.0, 2.0], 0.5) == (128.5, [])
    nothing = Trace("g", []).finish({})
    assert loaded({"g": nothing})["g"]() == ()


def test_names_that_are_none_are_refused() -> None:
    with pytest.raises(ProgramError):
        python_source({})
    with pytest.raises(ProgramError):
        python_source({"f(): import os #": Trace("g", []).finish({})})


def test_self_test_passes_and_finds_a_wrong_constant(tmp_path) -> None:
    programs = {f"p{seed}": Maker(seed, ARITHMETIC).program() for seed in range(8)}
    trace = Trace("f", [Array("t"), Array("q", (2,))])
    programs["f"] = trace.finish({"x": ((), [sum(trace["q"], number(0)) * trace["t"][0]])})
    path = tmp_path / "model.py"
    for source, code in ((python_source(programs, samples=spread_samples(programs)), 0), ("", 1)):
        text = source or re.sub(r"(def mbs_f\((?s:.*?)= )", r"\g<1>1e-3 + ", path.read_text(), count=1)
        path.write_text(text, encoding="ascii")
        run = subprocess.run([sys.executable, path], capture_output=True, text=True, timeout=60, check=False)
        assert run.returncode == code, run.stdout + run.stderr
        assert ("f: WRONG" in run.stdout) == bool(code)


def test_exported_arithmetic_imports_nothing_that_is_not_exported() -> None:
    """But `dataclass`, in whose place exported text has that of Python, and what functions take that no model calls."""
    exported = {module.__name__: Path(str(module.__file__)).read_text() for module in OWN_ARITHMETIC}
    imports = (node for text in exported.values() for node in ast.walk(ast.parse(text)))
    needed = {node.module or "" for node in imports if isinstance(node, ast.ImportFrom)}
    of_package = {module for module in needed if module.startswith("multibody_sym")}
    assert of_package - set(exported) == {"multibody_sym.records", "multibody_sym.scalars.elimination"}
