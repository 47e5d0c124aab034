"""Derivatives of Programs: forward against reverse, against differences, through calls, solves and choices."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_programs import SMOOTH, Maker

from multibody_sym.program.derivatives import gradient, jacobian
from multibody_sym.program.program import Program, interpret, operation_count
from multibody_sym.program.statements import Array, ShapeError, UndefinedError
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import absolute, atan2, exp, log, maximum, minimum, sign, sin, sqrt, tan, where
from multibody_sym.scalars.node import Node

Arrays = list[np.ndarray]
Outputs = dict[str, tuple[tuple[int, ...], list[Node]]]


def differences(program: Program, output: str, name: str, arrays: Arrays) -> np.ndarray:
    """Return d output / d input by central differences of two step sizes (Richardson)."""
    place = [a.name for a in program.inputs].index(name)
    result = [o.name for o in program.outputs].index(output)
    columns = []
    for k in range(arrays[place].size):
        quotients = []
        for h in (2e-5, 1e-5):
            step = np.zeros(arrays[place].size)
            step[k] = h
            values = []
            for side in (1, -1):
                moved = [a + side * step.reshape(a.shape) if i == place else a for i, a in enumerate(arrays)]
                values.append(interpret(program, *moved)[result])
            quotients.append((values[0] - values[1]) / (2 * h))
        columns.append((4 * quotients[1] - quotients[0]) / 3)
    shape = (*program.output(output).shape, *program.input(name).shape)
    return np.moveaxis(np.array(columns), 0, -1).reshape(shape) if columns else np.zeros(shape)


def assert_derivatives(program: Program, arrays: Arrays, tolerance: float = 1e-7) -> None:
    """Compare every jacobian with differences, and with the gradient where there is one."""
    for output in program.outputs:
        for array in program.inputs:
            made = jacobian(program, output.name, array.name)
            assert made.inputs == program.inputs
            (found,) = interpret(made, *arrays)
            wanted = differences(program, output.name, array.name, arrays)
            scale = 1.0 + np.abs(wanted).max(initial=0.0)
            assert np.abs(found - wanted).max(initial=0.0) <= tolerance * scale, (output.name, array.name)
            if len(output.values) == 1:
                (reverse,) = interpret(gradient(program, output.name, array.name), *arrays)
                assert reverse.shape == array.shape
                assert np.allclose(reverse.ravel(), found.ravel(), rtol=1e-10, atol=1e-12 * scale)


def finished(inputs: Sequence[Array], make: Callable[[Trace], Outputs]) -> Program:
    trace = Trace("f", inputs)
    return trace.finish(make(trace))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**9))
def test_forward_and_reverse_agree_on_random_programs(seed: int) -> None:
    maker = Maker(seed, SMOOTH, solves=False)
    program = maker.program(steps=20)
    arrays = [np.clip(a, -1.5, 1.5) for a in maker.arguments(program)]
    assume(all(np.abs(x).max(initial=0.0) < 1e3 for x in interpret(program, *arrays)))
    for output in program.outputs:
        scalar = total(program, output.name)
        for array in program.inputs:
            forward = interpret(jacobian(program, output.name, array.name), *arrays)[0]
            reverse = interpret(gradient(scalar, "sum", array.name), *arrays)[0]
            summed = forward.reshape(len(output.values), array.size).sum(axis=0)
            scale = 1.0 + np.abs(forward).sum()
            assert np.abs(reverse.ravel() - summed).max(initial=0.0) <= 1e-10 * scale


def total(program: Program, output: str) -> Program:
    """Return the Program that calls `program` and adds the elements of one output."""
    trace = Trace("total", program.inputs)
    results = trace.call(program, [trace[a.name] for a in program.inputs])
    values = results[[o.name for o in program.outputs].index(output)]
    added = values[0] if values else 0
    for value in values[1:]:
        added = added + value
    return trace.finish({"sum": ((), [added])})


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**9))
def test_random_programs_against_differences(seed: int) -> None:
    maker = Maker(seed, SMOOTH, solves=False)
    program = maker.program(depth=1, steps=12)
    arrays = [np.clip(a, -1.0, 1.0) for a in maker.arguments(program)]
    assume(all(np.abs(x).max(initial=0.0) < 10 for x in interpret(program, *arrays)))
    biggest = max(np.abs(interpret(jacobian(program, o.name, a.name), *arrays)[0]).max(initial=0.0)
                  for o in program.outputs for a in program.inputs)  # fmt: skip
    assume(biggest < 30)
    assert_derivatives(program, arrays, tolerance=1e-5)


def test_operations_that_bend() -> None:
    def make(trace: Trace) -> Outputs:
        (a, b, c), (t,) = trace["q"], trace["t"]
        values = [
            absolute(a) * maximum(b, c) + minimum(a * b, t),
            where(a < b, sin(a * t), c**3) + sign(c) * b,
            log(b) * exp(a) / sqrt(c) + atan2(a, b) + tan(t) + b**c,
        ]
        return {"x": ((3,), values), "y": ((), [values[1] * values[2]])}

    program = finished([Array("q", (3,)), Array("t")], make)
    for q in ([-0.4, 0.7, 1.3], [0.9, 0.5, 0.4]):
        assert_derivatives(program, [np.array(q), np.array(0.6)])


def test_a_sign_that_stands_in_several_statements() -> None:
    def make(trace: Trace) -> Outputs:
        (a, b, c), (t,) = trace["q"], trace["t"]
        first, second = atan2(-(a * b), t), atan2(-(a * b), c)
        return {"y": ((), [first * sin(first) + second * exp(second)])}

    assert_derivatives(finished([Array("q", (3,)), Array("t")], make), [np.array([0.4, 0.7, 1.3]), np.array(0.6)])


SOLVE_INPUTS = [Array("A", (2, 4)), Array("r", (2,))]


def solving(trace: Trace) -> Outputs:
    A, r = trace["A"], trace["r"]
    record = trace.solve([A[:4], A[4:]], r)
    x, multipliers = record.solution, record.multipliers
    return {
        "x": ((4,), list(x)),
        "multipliers": ((2,), list(multipliers)),
        "mixed": ((), [x[0] * multipliers[1] + sin(x[2]) * A[3] + record.report[0]]),
    }


def test_minimum_norm_solutions_and_multipliers() -> None:
    random = np.random.default_rng(3)
    assert_derivatives(finished(SOLVE_INPUTS, solving), [random.normal(size=(2, 4)), random.normal(size=2)])


def test_square_and_empty_systems() -> None:
    def make(trace: Trace) -> Outputs:
        A, r = trace["A"], trace["r"]
        square = trace.solve([[A[0], A[1]], [A[4], sin(A[5])]], r)
        empty = trace.solve([], [], columns=2)
        return {"x": ((4,), [*square.solution, *(v * A[0] for v in empty.solution)])}

    random = np.random.default_rng(4)
    assert_derivatives(finished(SOLVE_INPUTS, make), [random.normal(size=(2, 4)), random.normal(size=2)])


def test_dependent_rows_keep_the_set_of_kept_rows() -> None:
    """Three rows, the second twice the first for every input: the derivative is that of the other two."""

    def make(trace: Trace) -> Outputs:
        (a, b, c, d), (r, s) = trace["A"], trace["r"]
        record = trace.solve([[a, b, c], [2 * a, 2 * b, 2 * c], [b, d, a]], [r, 2 * r, s])
        return {"x": ((3,), list(record.solution)), "y": ((), [record.multipliers[0] * record.solution[1]])}

    program = finished([Array("A", (4,)), Array("r", (2,))], make)
    assert_derivatives(program, [np.array([0.7, -0.3, 1.1, 0.4]), np.array([0.5, -1.2])])


def test_calls_within_calls_with_solves_inside() -> None:
    inner = finished(SOLVE_INPUTS, solving)

    def make(trace: Trace) -> Outputs:
        A, r = trace["A"], trace["r"]
        x, _, mixed = trace.call(inner, [[sin(a) + 1 for a in A[:4]] + list(A[4:]), [r[0], mixed_in(A)]])
        again = trace.call(inner, [[*x, *A[4:]], [mixed[0], r[1]]])
        return {"x": ((2,), [again[0][0], again[2][0]]), "y": ((), [again[2][0] * mixed[0]])}

    def mixed_in(A: Sequence[Node]) -> Node:
        return A[7] * A[0]

    middle = finished(SOLVE_INPUTS, make)

    def outermost(trace: Trace) -> Outputs:
        _, y = trace.call(middle, [trace["A"], [trace["r"][1], 1]])
        return {"y": ((), [y[0] * trace["r"][0]])}

    random = np.random.default_rng(5)
    arrays = [random.normal(size=(2, 4)), random.normal(size=2)]
    assert_derivatives(middle, arrays, tolerance=1e-6)
    assert_derivatives(finished(SOLVE_INPUTS, outermost), arrays, tolerance=1e-6)


def test_second_derivatives_are_symmetric_and_right() -> None:
    def make(trace: Trace) -> Outputs:
        inner = trace.call(finished(SOLVE_INPUTS, solving), [trace["A"], trace["r"]])
        return {"y": ((), [inner[2][0] * inner[0][1]])}

    program = finished(SOLVE_INPUTS, make)
    random = np.random.default_rng(6)
    arrays = [random.normal(size=(2, 4)), random.normal(size=2)]
    first = gradient(program, "y", "A")
    second = interpret(jacobian(first, "gradient", "A"), *arrays)[0].reshape(8, 8)
    assert np.allclose(second, second.T, atol=1e-9 * np.abs(second).max())
    wanted = differences(first, "gradient", "A", arrays).reshape(8, 8)
    assert np.allclose(second, wanted, atol=1e-6 * np.abs(wanted).max())


def test_what_does_not_depend_costs_nothing() -> None:
    def make(trace: Trace) -> Outputs:
        inner = trace.call(finished(SOLVE_INPUTS, solving), [trace["A"], [1, 2]])
        return {"x": ((4,), list(inner[0]))}

    made = jacobian(finished(SOLVE_INPUTS, make), "x", "r")
    assert made.statements == ()
    assert operation_count(made).solves == 0


def test_a_gradient_costs_one_pass() -> None:
    inputs = [Array("q", (50,))]
    program = finished(inputs, lambda trace: {"y": ((), [sum((sin(x) ** 2 for x in trace["q"][1:]), trace["q"][0])])})
    assert operation_count(gradient(program, "y", "q")).total < 6 * operation_count(program).total


def test_unknown_names_and_gradients_of_many_are_refused() -> None:
    program = finished(SOLVE_INPUTS, solving)
    with pytest.raises(UndefinedError, match="no output is called 'z'"):
        jacobian(program, "z", "A")
    with pytest.raises(UndefinedError, match="no input is called 'q'"):
        gradient(program, "mixed", "q")
    with pytest.raises(ShapeError):
        gradient(program, "x", "A")


def chosen(f: Callable[[Node, Node], Node]) -> Program:
    trace = Trace("chosen", [Array("x"), Array("y")])
    return trace.finish({"f": ((), [f(trace["x"][0], trace["y"][0])])})


@pytest.mark.parametrize(
    ("f", "on", "slopes"),
    [
        (lambda x, y: where(x > 0, sqrt(x), 0), 4.0, (0.25, 0)),
        (lambda x, y: where(x > 0, y * log(x), y), 2.0, (1.5, np.log(2))),
        (lambda x, y: where(x > 0, sqrt(x) + y * sqrt(x) ** 2, y**2), 4.0, (3.25, 4)),
        (lambda x, y: where(x > 0, x**1.5, where(y > 0, 2 * y, log(y))), 4.0, (3, 0)),
        (lambda x, y: where(x > 0, sqrt(x), 0) + where(x > 3, sqrt(x) * y, 0), 4.0, (1, 2)),
        (lambda x, y: where(x > 0, where(x > 1, y / sqrt(x), 1), 0) + where(x > 0, 1 / sqrt(x), 0), 4.0, (-0.25, 0.5)),
        (lambda x, y: y * maximum(0, where(x > 0, sqrt(x) - 1, -1)), 4.0, (0.75, 1)),
    ],
)
def test_a_branch_that_is_not_taken_has_no_slope(
    f: Callable[[Node, Node], Node], on: float, slopes: tuple[float, float]
) -> None:
    """At x = `on` the derivatives are those by hand; at x = -1, where the branch is no number, those of the other."""
    program, y = chosen(f), np.array(3.0)
    for name, slope in zip("xy", slopes, strict=True):
        made = gradient(program, "f", name)
        assert float(interpret(made, np.array(on), y)[0]) == pytest.approx(slope, abs=1e-15)
        off = float(interpret(made, np.array(-1.0), y)[0])
        assert off == float(interpret(jacobian(program, "f", name), np.array(-1.0), y)[0])
        assert np.isfinite(off)
