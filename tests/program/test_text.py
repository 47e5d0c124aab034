"""The readable text of a Program."""

from __future__ import annotations

from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import absolute, maximum, sin, where

TEXT = """\
program g(t, q[2], A[1, 2])
  z0 = sin(t)
  (z1), (z2, z3) = f((z0), (q[0], 0.5))
  (z4, z5), (z6), (z7, z8, z9) = solve(((A[0], A[1])), (z1))
  z10 = power(t, 5) - z4*(q[0] + q[1])
  z11 = where(t <= z2, max(t, q[1]), -abs(z3))
  x[2] = (z10, z11)
  rank = (z7)
  none[0] = ()"""


def test_a_program_reads_line_by_line() -> None:
    inner = Trace("f", [Array("a"), Array("b", (2,))])
    (a,), b = inner["a"], inner["b"]
    callee = inner.finish({"s": ((1,), [a * b[0]]), "v": ((2,), [a + b[0], b[1]])})
    trace = Trace("g", [Array("t"), Array("q", (2,)), Array("A", (1, 2))])
    (t,), q, A = trace["t"], trace["q"], trace["A"]
    s, v = trace.call(callee, [[sin(t)], [q[0], 0.5]])
    solved = trace.solve([A], s)
    values = [t**5 - (q[0] + q[1]) * solved.solution[0], where(t <= v[0], maximum(q[1], t), -absolute(v[1]))]
    program = trace.finish({"x": ((2,), values), "rank": ((), [solved.report[0]]), "none": ((0,), [])})
    assert str(program) == TEXT
