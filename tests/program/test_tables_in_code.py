"""Tables in generated code: every language has the bits of the interpreter, and holds each table once."""

from __future__ import annotations

import json

import numpy as np
import pytest

from multibody_sym.program.backend import Backend, Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.list_target import python_source
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program, interpret, program_hash
from multibody_sym.program.statements import Array
from multibody_sym.program.target_layout import NUMBERS_FILE
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.elementary import table
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.tabulated import Kind, Tabulated, TabulatedRows

X = np.sort(np.random.default_rng(4).uniform(-1, 1, 40))
KINDS: tuple[Kind, ...] = ("linear", "cubic", "knots")


def tabulating(y: np.ndarray) -> Program:
    """Return x -> all derivatives of all kinds of tables at x."""
    trace = Trace("tables", (Array("x"),))
    (x,) = trace["x"]
    functions = [Tabulated("f", TabulatedRows(X, y, {}), kind) for kind in KINDS]
    values: list[Node] = [table(f, order, x) for f in functions for order in range(5)]
    return trace.finish({"y": ((len(values),), values)})


@pytest.mark.parametrize("backend", ["c", "python"])
def test_compiled_tables_have_the_bits_of_the_interpreter(backend: Backend) -> None:
    program = tabulating(np.sin(3 * X))
    compiled = load({"tables": program}, Native(backend=backend))["tables"]
    for x in (*np.random.default_rng(5).uniform(-1.2, 1.2, 100), *X, np.inf, -np.inf):
        assert compiled(x)[0].tobytes() == interpret(program, x)[0].tobytes(), x


def test_a_table_stands_once_in_a_text_and_beside_it_where_numbers_do() -> None:
    programs = [tabulating(y) for y in (np.sin(3 * X), np.cos(3 * X))]
    assert program_hash(programs[0]) != program_hash(programs[1])
    written, alone = c_source({"tables": programs[0]})["model.c"], python_source({"tables": programs[0]}, alone=True)
    for text in (written, alone):
        assert text.count(repr(float(np.sin(3 * X[7])))) == 2  # of lines, and of the spline
    apart = [c_source({"tables": program}, apart=True) for program in programs]
    numbers = [json.loads(files.pop(NUMBERS_FILE)) for files in apart]
    assert apart[0] == apart[1]
    assert len(numbers[0]) < 7 * len(X)
