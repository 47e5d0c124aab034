"""What a loop fills of an output stands there at once in functions of generated C that only generated code calls."""

from __future__ import annotations

import re

import numpy as np
import pytest

from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace

SIZE = 12


def doubled_where(name: str, inner: Program | None = None) -> Program:
    """A Program that doubles its input where its gate is open, itself or by another one."""
    trace = Trace(name, [Array("gate"), Array("x", (SIZE,))])
    (gate,), x = trace["gate"], trace["x"]
    if inner is not None:
        (found,) = trace.call(inner, [[gate], x])
    else:
        twice = Trace("twice", [Array("x", (SIZE,))])
        program = twice.finish({"y": ((SIZE,), [2 * value for value in twice["x"]])})
        (found,) = trace.call_where(gate, program, [x])
    return trace.finish({"y": ((SIZE,), found)})


def test_only_where_no_caller_may_hand_over_one_array_for_both() -> None:
    inner = doubled_where("inner")
    alone, called = c_source({"inner": inner}), c_source({"outer": doubled_where("outer", inner)})
    in_place = re.compile(r"double \*r\d+_\d+ = y")
    assert not in_place.search("".join(alone.values()))
    assert len(in_place.findall("".join(called.values()))) == 1


@pytest.mark.parametrize("gate", [0.0, 1.0])
def test_values_are_those_of_the_interpreter(gate: float) -> None:
    outer = doubled_where("outer", doubled_where("inner"))
    x = np.arange(1.0, SIZE + 1.0)
    (wanted,) = interpret(outer, gate, x)
    np.testing.assert_array_equal(wanted, 2 * x * gate)
    np.testing.assert_array_equal(load({"outer": outer}, Native(backend="c"))["outer"](gate, x)[0], wanted)
