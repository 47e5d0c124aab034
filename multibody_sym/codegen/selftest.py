"""Stored inputs and results with which generated code tests itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.program.interpreter import interpret
from multibody_sym.program.program import Program

Samples = Mapping[str, Sequence[Sequence[ArrayLike]]]
"""For each program the samples to test it with; a sample holds one array for each input."""

TOLERANCE: Final = 1e-9
"""How far results may lie apart, relative to the largest of an output, or to one: functions differ between systems."""
_GOLDEN: Final = 0.6180339887498949


def spread_samples(programs: Mapping[str, Program], count: int = 3) -> Samples:
    """Return `count` samples for each program whose numbers lie spread between 0.25 and 0.75, the same every time."""
    return {name: [_spread(program, k) for k in range(count)] for name, program in programs.items()}


def _spread(program: Program, sample: int) -> list[np.ndarray]:
    arrays, first = [], 1 + 1009 * sample
    for array in program.inputs:
        numbers = np.arange(first, first + array.size) * _GOLDEN
        arrays.append((0.25 + 0.5 * (numbers % 1.0)).reshape(array.shape))
        first += array.size
    return arrays


def stored_numbers(program: Program, samples: Sequence[Sequence[ArrayLike]]) -> list[float]:
    """Return for each sample its inputs and the interpreter's results, all in one row."""
    numbers: list[float] = []
    for sample in samples:
        for values in (*sample, *interpret(program, *sample)):
            numbers += np.asarray(values, dtype=float).ravel().tolist()
    return numbers
