"""Numbers beside compiled code: random Programs have the bits of the interpreter, and other numbers the same text."""

from __future__ import annotations

import json

import numpy as np
import pytest
from random_programs import ARITHMETIC, Maker

from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load
from multibody_sym.program.native import open_library
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.statements import Array
from multibody_sym.program.target_layout import NUMBERS_FILE
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import sin
from multibody_sym.scalars.node import as_node


def scaled(*numbers: float) -> Program:
    """Return x -> (sin(a x0 + b) - x1 c, then 100 numbers among zeros, ones and values of x)."""
    trace = Trace("scaled", (Array("x", (2,)),))
    x, (a, b, c, *_) = trace["x"], numbers
    spread = [as_node(numbers[k % len(numbers)] + k) if k % 3 else x[0] for k in range(150)]
    return trace.finish({"y": ((), [sin(a * x[0] + b) - x[1] * c]), "table": ((152,), [x[1], *spread, as_node(1)])})


@pytest.mark.parametrize("first", [100, 200])
def test_random_programs_have_the_bits_of_the_interpreter(first: int) -> None:
    makers = {f"p{seed}": Maker(seed, ARITHMETIC, solves=False) for seed in range(first, first + 4)}
    programs = {name: maker.program() for name, maker in makers.items()}
    compiled = load(programs, Native(backend="c"))
    assert compiled.numbers
    for name, program in programs.items():
        arrays = makers[name].arguments(program)
        for found, wanted in zip(compiled[name](*arrays), interpret(program, *arrays), strict=True):
            assert np.array_equal(found, wanted, equal_nan=True)


def test_programs_that_differ_in_numbers_are_one_text_and_have_their_own() -> None:
    """Both are in use at the same time, from copies of one library; equal numbers have places of their own."""
    numbers = (2.5, 0.75, 3.5), (7.25, 2.5, 2.5)
    programs = [scaled(*given) for given in numbers]
    texts = [c_source({"scaled": program}, apart=True) for program in programs]
    assert texts[0].pop(NUMBERS_FILE) != texts[1].pop(NUMBERS_FILE)
    assert texts[0] == texts[1]
    first, second = (load({"scaled": program}, Native(backend="c")) for program in programs)
    assert first.path != second.path
    x = np.array([0.3, -1.2])
    for _ in range(2):
        for compiled, program in ((first, programs[0]), (second, programs[1])):
            for found, wanted in zip(compiled["scaled"](x), interpret(program, x), strict=True):
                assert np.array_equal(found, wanted)


def test_exported_code_has_its_numbers_in_the_text() -> None:
    files = c_source({"scaled": scaled(2.5, 0.75, 3.5)})
    assert NUMBERS_FILE not in files
    assert "2.5*x[0]" in files["model.c"]
    assert "numbers[" not in files["model.c"]


def test_a_library_takes_as_many_numbers_as_it_names() -> None:
    program = scaled(2.5, 0.75, 3.5)
    compiled = load({"scaled": program}, Native(backend="c"))
    stored = json.loads(c_source({"scaled": program}, apart=True)[NUMBERS_FILE])
    assert list(compiled.numbers) == stored
    with pytest.raises(ValueError, match="names other numbers"):
        open_library(compiled.path, [compiled["scaled"].signature], stored[1:])


def test_native_code_has_its_numbers_in_the_text() -> None:
    program = scaled(2.5, 0.75, 3.5)
    compiled = load({"scaled": program}, Native(True, "c"))
    assert not compiled.numbers
    x = np.array([0.3, -1.2])
    for found, wanted in zip(compiled["scaled"](x), interpret(program, x), strict=True):
        assert np.allclose(found, wanted, rtol=1e-14)
