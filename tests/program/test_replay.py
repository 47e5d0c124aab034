"""Programs performed with the operations of another tool, for which Python's own stand here."""

from __future__ import annotations

import math

import numpy as np
import pytest
from random_programs import SMOOTH, Maker
from random_scans import WIDTH, Passes

from multibody_sym.errors import ModelError
from multibody_sym.program.program import OPERATIONS, Program, interpret
from multibody_sym.program.replay import replay
from multibody_sym.program.statements import TARGETS, Array, Output, Rows, Solve
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.node import as_node, slots

FORCE = 0.3, -0.2, 2.0
"""The direction in which the second constraint acts if friction tilts it."""
TALL = Array("a", (2, 3)), Array("r", (2,))


def solving(most: float = 2.0, acting: tuple[float, ...] = ()) -> Program:
    """Return a Program that solves two equations for three unknowns."""
    (matrix, right), found = TALL, slots(TARGETS, 8)
    rows = Rows.of([list(matrix.slots[3 * k : 3 * k + 3]) for k in range(2)])
    exerted = Rows.of([list(matrix.slots[:3]), [as_node(x) for x in FORCE]])
    acts = tuple(map(as_node, acting))
    unknown = found[:3], found[3:5], found[5:]
    solve = Solve(rows, right.slots, as_node(most), *unknown, acts, exerted if acting else Rows((), ()))
    outputs = (Output("x", (3,), found[:3]), Output("lam", (2,), found[3:5]), Output("report", (3,), found[5:]))
    return Program("solving", TALL, (solve,), outputs)


def test_independent_rows_are_solved_as_the_interpreter_does() -> None:
    given = np.array([[1.0, 2.0, -1.0], [0.5, 0.0, 3.0]]), np.array([2.0, -1.0])
    for program in (solving(), solving(acting=(1.0, 1.0)), solving(acting=(0.0, 1.0))):
        found = replay(program, [x.ravel().tolist() for x in given], OPERATIONS)
        for mine, wanted in zip(found, interpret(program, *given), strict=True):
            np.testing.assert_allclose(mine, wanted, atol=1e-14)


def test_rows_that_depend_on_each_other_have_no_number() -> None:
    x, multipliers, _ = replay(solving(), [[1.0, 2.0, -1.0, 2.0, 4.0, -2.0], [1.0, 2.0]], OPERATIONS)
    assert all(map(math.isnan, x + multipliers))
    with pytest.raises(ModelError, match="depend on each other"):
        replay(solving(1.0), [[1.0, 2.0, -1.0, 2.0, 4.0, -2.0], [1.0, 2.0]], OPERATIONS)


@pytest.mark.parametrize("seed", range(12))
def test_random_passes_over_trees_have_the_bits_of_the_interpreter(seed: int) -> None:
    maker, count = Maker(seed, SMOOTH, solves=False), 1 + seed % 7
    trace = Trace("f", [Array("own", (WIDTH * count,)), Array("shared")])
    passes = Passes.random(maker.random, maker.function, count, chain=seed % 3 == 0)
    values = passes.scanned(trace, trace["own"], trace["shared"][0])
    program = trace.finish({"rows": ((len(values),), values)})
    given = maker.arguments(program)
    (found,), (wanted,) = replay(program, [x.ravel().tolist() for x in given], OPERATIONS), interpret(program, *given)
    np.testing.assert_array_equal(found, wanted)
