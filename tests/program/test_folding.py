"""Folded Programs give what the Programs give with those numbers, and no longer read the input."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.errors import ExpressionError
from multibody_sym.program.program import Program, interpret, operation_count
from multibody_sym.program.statements import Array, UndefinedError
from multibody_sym.program.trace import Trace, fold_input
from multibody_sym.scalars.functions import cos, sqrt

ARRAYS = (Array("x", (2,)), Array("p", (3,)))


def inner() -> Program:
    trace = Trace("inner", ARRAYS)
    (x, y), (a, b, c) = trace["x"], trace["p"]
    solved = trace.solve([[a * x, b], [y, c]], [x + y, a])
    return trace.finish({"s": ((2,), [v * sqrt(b) for v in solved.solution])})


def outer() -> Program:
    trace = Trace("outer", ARRAYS)
    (z, w), = trace.call(inner(), [trace["x"], trace["p"]])
    (other, _), = trace.call(inner(), [trace["x"], trace["p"][::-1]])
    return trace.finish({"r": ((2,), [z * cos(trace["p"][0]) + other, w * trace["x"][1]])})


@pytest.mark.parametrize("program", [inner(), outer()], ids=["inner", "outer"])
def test_folding_keeps_values_and_forgets_the_input(program: Program) -> None:
    numbers, x = [0.7, 2.0, 1.3], [0.4, -1.1]
    constant = fold_input(program, "p", numbers)
    assert np.allclose(interpret(constant, x, [np.nan] * 3)[0], interpret(program, x, numbers)[0], rtol=1e-14)
    assert constant.inputs == program.inputs
    assert operation_count(constant).functions < operation_count(program).functions


def test_exact_numbers_fold_away() -> None:
    trace = Trace("f", ARRAYS)
    (x, _), (a, b, c) = trace["x"], trace["p"]
    program = trace.finish({"r": ((), [a * x + b * x**2 + c])})
    assert str(fold_input(program, "p", [1.0, 0.0, 0.0])).count("*") == 0


def test_an_input_that_is_not_there() -> None:
    with pytest.raises(UndefinedError):
        fold_input(inner(), "q", [1.0])


def test_a_constant_without_a_value_is_refused() -> None:
    trace = Trace("f", ARRAYS)
    program = trace.finish({"r": ((), [trace["x"][0] / trace["p"][0]])})
    with pytest.raises(ExpressionError, match="zero"):
        fold_input(program, "p", [0.0, 0.0, 0.0])
