"""Scans against the same passes unrolled: values, derivatives, folding, operations; and what a scan must not do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_programs import SMOOTH, Maker
from random_scans import WIDTH, Passes

from multibody_sym.program.c_target import c_source
from multibody_sym.program.derivatives import gradient, jacobian
from multibody_sym.program.program import Program, interpret, operation_count, program_hash
from multibody_sym.program.statements import (
    Array,
    DefinedTwiceError,
    Kernel,
    Loop,
    Progression,
    ShapeError,
    Window,
    progression,
    progression_through,
)
from multibody_sym.program.trace import Trace, fold_input
from multibody_sym.scalars.node import ZERO

SEEDS = st.integers(0, 10**9)


def both(seed: int, count: int) -> tuple[Program, Program, list[np.ndarray]]:
    """Return random passes over a random tree scanned and unrolled, and arguments."""
    maker = Maker(seed, SMOOTH, solves=False)
    passes = Passes.random(maker.random, maker.function, count, chain=maker.random.random() < 0.3)
    programs = []
    for run in (passes.scanned, passes.unrolled):
        trace = Trace("f", [Array("own", (WIDTH * count,)), Array("shared")])
        values = run(trace, trace["own"], trace["shared"][0])
        total = sum((x * x for x in values), ZERO)
        programs.append(trace.finish({"rows": ((len(values),), values), "total": ((), [total])}))
    return programs[0], programs[1], [np.clip(a, -1.0, 1.0) for a in maker.arguments(programs[0])]


def assert_close(found: Sequence[np.ndarray], wanted: Sequence[np.ndarray]) -> None:
    for a, b in zip(found, wanted, strict=True):
        assert np.abs(a - b).max(initial=0.0) <= 1e-10 * (1.0 + np.abs(b).max(initial=0.0))


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(0, 7))
def test_values(seed: int, count: int) -> None:
    scanned, unrolled, arrays = both(seed, count)
    assert_close(interpret(scanned, *arrays), interpret(unrolled, *arrays))


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 5))
def test_derivatives(seed: int, count: int) -> None:
    scanned, unrolled, arrays = both(seed, count)
    for name in ("own", "shared"):
        wanted = interpret(jacobian(unrolled, "total", name), *arrays)
        assert_close(interpret(jacobian(scanned, "total", name), *arrays), wanted)
        assert_close(interpret(gradient(scanned, "total", name), *arrays), wanted)


def test_a_second_derivative_forward_over_backward() -> None:
    scanned, unrolled, arrays = both(5, 3)
    twice = [jacobian(gradient(f, "total", "own"), "gradient", "own") for f in (scanned, unrolled)]
    found, wanted = (interpret(f, *arrays)[0] for f in twice)
    assert_close([found], [wanted])
    assert_close([found], [found.T])


def written_in(seed: int, count: int) -> tuple[Program, Program, list[np.ndarray]]:
    """Return a drawn Program, the same with its numbers folded into it, and the numbers."""
    scanned, _, arrays = both(seed, count)
    return scanned, fold_input(fold_input(scanned, "shared", [float(arrays[1])]), "own", arrays[0].tolist()), arrays


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(1, 5))
def test_folding(seed: int, count: int) -> None:
    scanned, ready, arrays = written_in(seed, count)
    assert_close(interpret(ready, np.full(WIDTH * count, np.nan), np.nan), interpret(scanned, *arrays))


def test_folding_takes_operations_away() -> None:
    """Of most Programs; a factor that folding brings to the front can keep a product from being shared."""
    pairs = [written_in(seed, 1 + seed % 5)[:2] for seed in range(30)]
    taken = [operation_count(scanned).total - operation_count(ready).total for scanned, ready in pairs]
    assert sum(taken) > 50
    assert sum(x < 0 for x in taken) <= 1


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.integers(0, 7))
def test_operations_are_those_of_every_iteration(seed: int, count: int) -> None:
    maker = Maker(seed, SMOOTH, solves=False)
    passes = Passes.random(maker.random, maker.function, count)
    trace = Trace("f", [Array("own", (WIDTH * count,)), Array("shared")])
    values = passes.scanned(trace, trace["own"], trace["shared"][0])
    wanted: Counter[str] = Counter(additions=(1 + WIDTH) * count + 1)  # a share, a sum for the parent; one at the end
    wanted += Counter(additions=sum(passes.opens), multiplications=sum(passes.opens))  # of gates
    for kind in passes.kinds:
        wanted += Counter(asdict(operation_count(passes.down[kind])))
        wanted += Counter(asdict(operation_count(passes.up[kind])))
    counted = asdict(operation_count(trace.finish({"rows": ((len(values),), values)})))
    assert counted == {name: wanted[name] for name in counted}


def test_text_and_hash() -> None:
    first, second, other = both(3, 4)[0], both(3, 4)[0], both(3, 5)[0]
    assert program_hash(first) == program_hash(second) != program_hash(other)
    lines = str(first).splitlines()
    assert sum("for k < 4" in line for line in lines) == 3
    assert sum("for k < 4 where" in line for line in lines) == 1
    assert any("= up_0(a0[" in line or "up_0(a0[" in line for line in lines)


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        ([], Progression((0,))),
        ([4], Progression((4,))),
        ([7, 7, 7], Progression((7,))),
        ([5, 3, 1, -1], Progression((5,), -2)),
        ([0, 3, 4, 7, 8, 11], Progression((0, 3), 4)),
        ([0, 1, 0, 1, 0], Progression((0, 1))),
    ],
)
def test_progressions_are_found(values: list[int], wanted: Progression) -> None:
    assert progression(values) == wanted
    assert wanted.values(len(values)).tolist() == values


@given(st.lists(st.integers(-3, 3), min_size=1, max_size=200))
def test_any_table_is_a_progression(values: list[int]) -> None:
    found = progression(values)
    assert found.values(len(values)).tolist() == values
    assert [found.at(k) for k in range(len(values))] == values


@given(st.lists(st.booleans(), min_size=1, max_size=100), st.integers(1, 5), st.integers(-3, 3))
def test_a_progression_through_some_places_only(there: list[bool], period: int, step: int) -> None:
    places = np.nonzero(there)[0]
    wanted = Progression(tuple(range(period)), step)
    found = progression_through(places, wanted.values(len(there))[places])
    assert [found.at(k) for k in places] == [wanted.at(k) for k in places]
    assert len(found.pattern) <= period


def doubled(name: str = "x") -> Program:
    trace = Trace("double", [Array(name)])
    return trace.finish({"y": ((), [2 * trace[name][0]])})


def scan(read: Window, write: Window, *choice: int) -> Program:
    trace = Trace("f", [Array("q", (4,))])
    kernel = Kernel(doubled(), (read,), (write,))
    loop = Loop(3, (kernel, kernel), Progression(choice or (0, 1)))
    (result,) = trace.scan([trace["q"]], [4], [], [loop])
    return trace.finish({"x": ((4,), result)})


def test_one_loop() -> None:
    steps = Progression((0,), 1), Progression((1,), 1)
    assert interpret(scan(Window(0, steps[0]), Window(1, steps[0])), [1, 2, 3, 4])[0].tolist() == [2, 4, 6, 0]
    assert interpret(scan(Window(1, steps[0]), Window(1, steps[1])), [1, 2, 3, 4])[0].tolist() == [0, 0, 0, 0]
    total = scan(Window(0, steps[0]), Window(1, Progression((2,)), adds=True))
    assert interpret(total, [1, 2, 3, 4])[0].tolist() == [0, 0, 12, 0]


def test_an_iteration_behind_a_gate_runs_where_this_is_open() -> None:
    trace = Trace("f", [Array("q", (4,)), Array("open", (4,))])
    one_by_one = Progression((0,), 1)
    kernel = Kernel(doubled(), (Window(0, one_by_one),), (Window(2, one_by_one),))
    (result,) = trace.scan([trace["q"], trace["open"]], [4], [], [Loop(3, (kernel,), gate=Window(1, one_by_one))])
    program = trace.finish({"x": ((4,), result)})
    assert interpret(program, [1, np.nan, 3, 4], [-1, 0, 2, 1])[0].tolist() == [2, 0, 6, 0]
    assert "for k < 3 where a1[0 + 1k]" in str(program)
    assert program_hash(program) != program_hash(scan(Window(0, one_by_one), Window(1, one_by_one)))


def test_what_nobody_reads_behind_a_closed_gate_is_undefined() -> None:
    """The interpreter shows it by nan; C leaves out the zeros."""

    def program(unread: Sequence[int], *, adds: bool = False) -> Program:
        trace = Trace("f", [Array("q", (4,)), Array("open", (4,))])
        one_by_one = Progression((0,), 1)
        kernel = Kernel(doubled(), (Window(0, one_by_one),), (Window(2, one_by_one, adds),))
        loop = Loop(4, (kernel,), gate=Window(1, one_by_one))
        (result,) = trace.scan([trace["q"], trace["open"]], [4], [], [loop], unread)
        return trace.finish({"x": ((4,), result)})

    zeros, undefined = program(()), program([0])
    np.testing.assert_array_equal(interpret(undefined, [1, 2, 3, 4], [1, 0, 2, 0])[0], [2, np.nan, 6, np.nan])
    assert "unread (0,)" in str(undefined)
    assert program_hash(zeros) != program_hash(undefined)
    of_zeros, of_undefined = (c_source({"f": each})["model.c"] for each in (zeros, undefined))
    assert "] = 0.0;" in of_zeros
    assert "] = 0.0;" not in of_undefined
    with pytest.raises(DefinedTwiceError, match="array 2 is added to, and undefined where gates are closed"):
        program([0], adds=True)


def test_a_call_behind_a_gate_gives_zeros_where_this_is_closed() -> None:
    trace = Trace("f", [Array("x"), Array("open")])
    ((found,),) = trace.call_where(trace["open"][0], doubled(), [trace["x"]])
    program = trace.finish({"y": ((), [found])})
    assert [interpret(program, 3, gate)[0].item() for gate in (0, 1, -0.5)] == [0, 6, 6]


@pytest.mark.parametrize(
    ("error", "make", "message"),
    [
        (ShapeError, lambda: scan(Window(0, Progression((2,), 1)), Window(1, Progression((0,), 1))), "beyond array 0"),
        (ShapeError, lambda: scan(Window(0, Progression((0,))), Window(1, Progression((0,), -1))), "beyond array 1"),
        (ShapeError, lambda: scan(Window(2, Progression((0,))), Window(1, Progression((0,), 1))), "no array 2"),
        (ShapeError, lambda: scan(Window(0, Progression((0,))), Window(1, Progression((0,), 1)), 0, 2), "2 kernels"),
        (DefinedTwiceError, lambda: scan(Window(1, Progression((0,))), Window(0, Progression((0,), 1))), "is given"),
        (DefinedTwiceError, lambda: scan(Window(0, Progression((0,))), Window(1, Progression((0,)))), "stored twice"),
        (DefinedTwiceError, lambda: scan(Window(1, Progression((0,), 1)), Window(1, Progression((0,), 1))),
         "after it is read"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused(error, make, message) -> None:
    with pytest.raises(error, match=message):
        make()


def test_a_kernel_with_a_window_too_few_is_refused() -> None:
    trace = Trace("f", [Array("q", (4,))])
    kernel = Kernel(doubled(), (), (Window(1, Progression((0,), 1)),))
    (result,) = trace.scan([trace["q"]], [4], [], [Loop(3, (kernel,))])
    with pytest.raises(ShapeError, match="kernel double has 0 windows"):
        trace.finish({"x": ((4,), result)})
