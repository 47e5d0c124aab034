"""Operation counts by hand, and hashes that see structure and numbers but no names."""

from __future__ import annotations

import pytest
from random_programs import ARITHMETIC, Maker

from multibody_sym.program.program import OperationCount, Program, operation_count, program_hash
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import atan2, cos, minimum, sin
from multibody_sym.scalars.node import Node, number


def program(make, names: tuple[str, str] = ("q", "t"), name: str = "f", output: str = "x", shape=(2,)) -> Program:
    trace = Trace(name, [Array(names[0], (3,)), Array(names[1])])
    return trace.finish({output: (shape, make(trace[names[0]], trace[names[1]][0]))})


def test_operations_are_counted_by_kind() -> None:
    made = program(lambda q, t: [q[0] * q[1] - t / q[2], -((q[0] + t) ** 5) + sin(t)])
    assert operation_count(made) == OperationCount(1, 2, 4, 1, 1, 0)
    assert operation_count(made).total == 8


def test_callees_count_at_each_call() -> None:
    callee = program(lambda q, t: [q[0] + t, minimum(q[1], t)])
    trace = Trace("g", callee.inputs)
    (first,) = trace.call(callee, [trace["q"], trace["t"]])
    (second,) = trace.call(callee, [[*first, first[0]], trace["t"]])
    solved = trace.solve([second], [first[0]])
    made = trace.finish({"x": ((2,), solved.solution)})
    assert operation_count(made) == OperationCount(additions=2, functions=2, solves=1)


def structure(q: tuple[Node, ...], t: Node) -> list[Node]:
    return [cos(q[0] - 1) * t + q[2], t**2 - q[1]]


def test_names_do_not_enter_the_hash() -> None:
    wanted = program_hash(program(structure))
    assert len(wanted) == 64
    assert program_hash(program(structure, name="other", output="result")) == wanted


def test_names_of_inputs_enter_at_most_by_the_order_of_operands() -> None:
    def ordered(q: tuple[Node, ...], t: Node) -> list[Node]:
        return [cos(q[0]) / t, q[2] / q[1]]

    assert program_hash(program(ordered, ("alpha", "beta"))) == program_hash(program(ordered))


@pytest.mark.parametrize(
    "other",
    [
        lambda q, t: [cos(q[0] - 2) * t + q[2], t**2 - q[1]],
        lambda q, t: [cos(q[0] - 1.0000000000000002) * t + q[2], t**2 - q[1]],
        lambda q, t: [sin(q[0] - 1) * t + q[2], t**2 - q[1]],
        lambda q, t: [cos(q[0] - 1) * t + q[1], t**2 - q[1]],
        lambda q, t: [cos(q[0] - 1) * t + q[2], t**3 - q[1]],
        lambda q, t: structure(q, t)[::-1],
        lambda q, t: [structure(q, t)[0], number(0)],
    ],
)
def test_structure_and_numbers_do(other) -> None:
    assert program_hash(program(other)) != program_hash(program(structure))


def test_a_sign_that_stands_in_several_statements_keeps_its_number() -> None:
    def signs(turned: bool) -> Program:
        def make(q: tuple[Node, ...], t: Node) -> list[Node]:
            minus = -(q[0] * q[1])
            inner = atan2(minus, q[2])
            return [atan2(minus, t), atan2(inner, minus) if turned else atan2(minus, inner)]

        return program(make)

    assert program_hash(signs(True)) != program_hash(signs(False))


def test_shapes_do() -> None:
    hashes = {program_hash(program(structure, shape=shape)) for shape in [(2,), (2, 1), (1, 2)]}
    assert len(hashes) == 3


def test_callees_do() -> None:
    def caller(callee: Program) -> Program:
        trace = Trace("g", callee.inputs)
        return trace.finish({"x": ((2,), trace.call(callee, [trace["q"], trace["t"]])[0])})

    first, same = caller(program(structure)), caller(program(structure, name="another"))
    assert program_hash(first) == program_hash(same)
    assert program_hash(caller(program(lambda q, t: [q[0] * t, t]))) != program_hash(first)


def test_random_programs_have_hashes_of_their_own() -> None:
    programs = [Maker(seed, ARITHMETIC).program() for seed in range(100)]
    assert len({program_hash(p) for p in programs}) == len({str(p) for p in programs})
