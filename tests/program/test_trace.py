"""Trace: the Program computes what the expressions say, each shared part once, and nothing that is not needed."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_programs import FUNCTIONS, ROUNDED, Maker

from multibody_sym.program.program import OPERATIONS, Program, integer_exponent, interpret
from multibody_sym.program.statements import Array, Assign, Call, ShapeError, Solve, UndefinedError
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.elementary import BUILD, postorder
from multibody_sym.scalars.floats import power
from multibody_sym.scalars.functions import cos, exp, maximum, sin, sqrt, where
from multibody_sym.scalars.node import PI, Node, number, symbol
from multibody_sym.scalars.tabulated import Tabulated, TabulatedRows

Q, T = Array("q", (3,)), Array("t")
q, (t,) = Q.slots, T.slots


def finished(*values: Node) -> Program:
    return Trace("f", [Q, T]).finish({"x": ((len(values),), values)})


def sizes(program: Program) -> list[int]:
    return [len(s.nodes) for s in program.statements if isinstance(s, Assign)]


@settings(deadline=None)
@given(st.integers(0, 10**9))
def test_a_program_computes_what_its_expressions_say(seed: int) -> None:
    """Second route: each expression evaluated by itself, by recursion, as it was before anything was named."""
    maker = Maker(seed, ROUNDED + FUNCTIONS, solves=False)
    pool: list[Node] = [*q, t, number(2), PI]
    for _ in range(40):
        pool += maker.operation(pool)
    values = pool[-5:]
    numbers = [maker.random.uniform(0.1, 2.0) for _ in range(4)]
    known = dict(zip([*q, t], numbers, strict=True))
    (found,) = interpret(finished(*values), numbers[:3], numbers[3])
    assert np.array_equal(found, [evaluated(value, known) for value in values], equal_nan=True)


def evaluated(node: Node, known: dict[Node, float]) -> float:
    if node.shadow is not None:
        return node.shadow
    if node not in known:
        values = [evaluated(a, known) for a in node.args]
        exponent = integer_exponent(node) if node.op == "pow" else None
        known[node] = OPERATIONS[node.op](*values) if exponent is None else power(values[0], exponent)
    return known[node]


@settings(deadline=None)
@given(st.integers(0, 10**9))
def test_every_operation_is_computed_once(seed: int) -> None:
    maker = Maker(seed, (*ROUNDED, *FUNCTIONS, "where", "max"), solves=False)
    pool: list[Node] = [*q, t, number(2), PI]
    for _ in range(60):
        pool += maker.operation(pool)
    program = finished(*pool[-3:])
    computed = [n for s in program.statements if isinstance(s, Assign) for n in s.nodes if n.op != "neg"]
    needed = {n for n in postorder(pool[-3:]) if n.args and n.shadow is None and n.op != "neg"}
    assert len(computed) == len(set(computed))
    assert set(computed) == needed


def test_what_is_used_once_stands_inline() -> None:
    assert sizes(finished(sin(q[0]) * q[1] + cos(t))) == [4]


def test_what_is_used_twice_has_a_statement() -> None:
    shared = sin(q[0])
    assert sizes(finished(shared * q[1] + cos(shared))) == [1, 3]


def test_a_sign_never_needs_a_statement_unless_it_is_a_result() -> None:
    program = finished(q[1] * exp(-q[0]), cos(t) - q[0], maximum(-q[0], t))
    assert all(s.value.op != "neg" for s in program.statements if isinstance(s, Assign))
    shared = q[0] * q[1]
    assert sizes(finished(maximum(-shared, t), maximum(-shared, q[2]))) == [1, 2, 2]
    assert sizes(finished(-shared)) == [2]


def test_the_same_sign_twice_in_one_statement() -> None:
    program = finished(where(t, -q[0], maximum(-q[0], 3)))
    assert interpret(program, [2.0, 0.0, 0.0], 0.0)[0] == [3.0]
    assert interpret(program, [2.0, 0.0, 0.0], 1.0)[0] == [-2.0]


def test_constants_are_atoms() -> None:
    program = finished(number(3), -PI, sqrt(number(2)), sqrt(number(2)) * q[0] - PI)
    assert sizes(program) == [2] or sizes(program) == [3]
    assert interpret(program, [1.0, 0.0, 0.0], 0.0)[0] == pytest.approx([3, -np.pi, 2**0.5, 2**0.5 - np.pi])


def test_long_expressions_are_broken_up() -> None:
    value: Node = t
    for k in range(200):
        value = sin(value) + q[k % 3]
    assert max(sizes(finished(value))) <= 40


def test_what_no_output_needs_is_left_out() -> None:
    callee = finished(sin(q[0]), t)
    trace = Trace("g", [Q, T])
    kept = trace.call(callee, [trace["q"], trace["t"]])[0]
    trace.call(callee, [[t, t, t], [q[0]]])
    solved = trace.solve([[kept[0], t]], [q[1]])
    trace.solve([[t]], [q[0] * q[1]])
    program = trace.finish({"x": ((), [solved.solution[1] * q[2]])})
    assert [type(s) for s in program.statements] == [Call, Solve, Assign]


def test_statements_of_any_kind_wait_for_what_they_need() -> None:
    callee = finished(q[0] + t, q[1] * t)
    trace = Trace("g", [Q, T])
    (first,) = trace.call(callee, [[sin(t), t, t], [t]])
    solved = trace.solve([[first[1] + 1]], [first[0]])
    (second,) = trace.call(callee, [[solved.solution[0]] * 3, [first[0] * t]])
    program = trace.finish({"x": ((2,), second)})
    x = (np.sin(0.5) + 0.5) / (0.25 + 1)
    f = (np.sin(0.5) + 0.5) * 0.5
    assert interpret(program, [0, 0, 0], 0.5)[0] == pytest.approx([x + f, x * f])


def test_a_leaf_that_is_no_input_is_refused() -> None:
    with pytest.raises(UndefinedError, match="m is used"):
        finished(symbol("m") * t)


def test_arguments_that_do_not_fit_are_refused() -> None:
    trace = Trace("g", [Q, T])
    (x,) = trace.call(finished(t), [[q[0]], [t]])
    with pytest.raises(ShapeError):
        trace.finish({"x": ((1,), x)})
    with pytest.raises(ShapeError):
        trace.finish({"x": ((2,), [t])})


def test_every_operation_has_an_interpretation() -> None:
    lines = Tabulated("f", TabulatedRows([0.0, 1.0], [1.0, 2.0], {}), "linear")
    for op, build in {**BUILD, "table": partial(BUILD["table"], lines, 0)}.items():
        arity = 1 if op == "table" else build.__code__.co_argcount
        program = finished(build(*[t + 2 if op == "acosh" else t, q[0], q[1]][:arity]))
        assert np.isfinite(interpret(program, [0.3, 0.4, 0.2], 0.5)[0]), op
