"""What a loaded program takes and returns, and arrays arranged accordingly."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import floats
from multibody_sym.records import dataclass

if TYPE_CHECKING:
    from multibody_sym.program.program import Program

Shaped = tuple[tuple[str, tuple[int, ...]], ...]


@dataclass(frozen=True)
class Signature:
    """The name of a program and the names and shapes of its inputs and outputs; shape () is a scalar."""

    program: str
    inputs: Shaped
    outputs: Shaped

    @staticmethod
    def of(name: str, program: Program) -> Signature:
        """Return the signature of `program`, which is known as `name`."""
        inputs = tuple((array.name, array.shape) for array in program.inputs)
        return Signature(name, inputs, tuple((output.name, output.shape) for output in program.outputs))

    @staticmethod
    def from_json(entry: Any) -> Signature:
        """Return the signature that `as_json` wrote; raises KeyError, TypeError or ValueError for anything else."""
        inputs, outputs = (
            tuple((str(name), tuple(map(int, shape))) for name, shape in entry[side]) for side in ("inputs", "outputs")
        )
        return Signature(str(entry["program"]), inputs, outputs)

    def as_json(self) -> dict[str, Any]:
        """Return the signature as JSON values."""
        return {"program": self.program, "inputs": self.inputs, "outputs": self.outputs}

    def sizes(self, side: str) -> list[int]:
        """Return the sizes of the `inputs` or `outputs`."""
        return [math.prod(shape) for _, shape in getattr(self, side)]

    def arranged(self, arrays: Sequence[ArrayLike]) -> list[Floats]:
        """Return the inputs as contiguous arrays of floats; raises ValueError where number or shape differ."""
        self._require_number(arrays)
        result = []
        for (name, shape), array in zip(self.inputs, arrays, strict=True):
            values = np.asarray(floats(name, array), order="C")
            if values.shape != shape:
                raise ValueError(f"{self.program}: {name} has the shape {values.shape}, not {shape}")
            result.append(values)
        return result

    def stacked(self, arrays: Sequence[ArrayLike]) -> tuple[int, list[Floats], list[bool]]:
        """Return the number of samples, the inputs as contiguous arrays, and which of them change with the sample.

        Those have one axis in front of their own; the others are the same for all samples. Raises ValueError.
        """
        self._require_number(arrays)
        values = [np.asarray(floats(self.program, array), order="C") for array in arrays]
        changing = [v.ndim == len(shape) + 1 for v, (_, shape) in zip(values, self.inputs, strict=True)]
        for v, many, (name, shape) in zip(values, changing, self.inputs, strict=True):
            if v.shape[many:] != shape:
                raise ValueError(f"{self.program}: {name} has the shape {v.shape}, not {shape} or (samples, *{shape})")
        counts = {len(v) for v, many in zip(values, changing, strict=True) if many}
        if len(counts) != 1:
            raise ValueError(f"{self.program}: the inputs have {sorted(counts)} samples, not one number of them")
        return counts.pop(), values, changing

    def _require_number(self, arrays: Sequence[ArrayLike]) -> None:
        if len(arrays) != len(self.inputs):
            names = ", ".join(name for name, _ in self.inputs)
            raise ValueError(f"{self.program} takes {len(self.inputs)} arrays ({names}), not {len(arrays)}")
