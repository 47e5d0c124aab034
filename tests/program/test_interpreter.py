"""The interpreter on numbers: shapes, calls, solves, and what is infinite or nan."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from multibody_sym.program.program import OPERATIONS, interpret
from multibody_sym.program.statements import Array, ShapeError
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.floats import power
from multibody_sym.scalars.node import number
from multibody_sym.scalars.tabulated import Tabulated, TabulatedRows

NUMBERS = st.floats() | st.sampled_from([0.0, -0.0, 1.0, -1.0, 2.0, 0.5, 1e308, -745.0, 1e-320])


def test_arrays_have_the_shapes_declared() -> None:
    trace = Trace("f", [Array("a", (2, 3)), Array("t")])
    a, (t,) = trace["a"], trace["t"]
    program = trace.finish({"x": ((3, 2), [a[3 * j + i] * t for i in range(3) for j in range(2)]), "y": ((), [t])})
    given_array = np.arange(6.0).reshape(2, 3)
    x, y = interpret(program, given_array, 2.0)
    assert np.array_equal(x, 2.0 * given_array.T)
    assert y.shape == ()
    for wrong in ([given_array.T, 2.0], [given_array, [2.0]], [given_array], [given_array, 2.0, 3.0]):
        with pytest.raises(ShapeError):
            interpret(program, *wrong)


def test_a_solve_gives_solution_multipliers_and_report() -> None:
    trace = Trace("f", [Array("r", (3,))])
    r = trace["r"]
    record = trace.solve([[number(2), number(0)], [number(0), number(0)], [number(4), number(0)]], r)
    program = trace.finish({"x": ((8,), [*record.solution, *record.multipliers, *record.report])})
    assert interpret(program, [2.0, 0.0, 6.0])[0] == pytest.approx([1, 0, 0.5, 0, 0, 1, 1, (1.5 - 1) / 1.5])


LINES = Tabulated("f", TabulatedRows([0.0, 1.0], [1.0, 2.0], {}), "linear")


@pytest.mark.parametrize("op", BUILD)
@given(a=NUMBERS, b=NUMBERS, c=NUMBERS)
def test_no_operation_ever_raises(op: str, a: float, b: float, c: float) -> None:
    arity = BUILD[op].__code__.co_argcount
    given = [LINES, 0, a] if op == "table" else [a, b, c][:arity]
    assert isinstance(OPERATIONS[op](*given), float)


@given(a=NUMBERS, b=NUMBERS)
def test_infinite_and_nan_results_are_those_of_ieee_arithmetic(a: float, b: float) -> None:
    with np.errstate(all="ignore"):
        wanted = {
            "div": np.divide(a, b), "pow": np.float_power(a, b), "sqrt": np.sqrt(a), "log": np.log(a), "exp": np.exp(a),
            "sinh": np.sinh(a), "cosh": np.cosh(a), "asin": np.arcsin(a), "acos": np.arccos(a), "tan": np.tan(a),
        }  # fmt: skip
    for op, value in wanted.items():
        found = OPERATIONS[op](*([a, b] if op in ("div", "pow") else [a]))
        same = math.isnan(found) and math.isnan(value)
        assert same or found == value or math.isclose(found, value, rel_tol=1e-13), op


@given(st.floats(-3, 3), st.integers(1, 40))
def test_powers_by_products(x: float, n: int) -> None:
    assert power(x, n) == pytest.approx(x**n, rel=1e-14, abs=1e-300)
    assert power(x, 2) == x * x
    assert power(x, 3) == x * x * x
