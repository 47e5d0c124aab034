"""Programs as generated Python, loaded from a file in the cache: what runs where there is no C compiler."""

from __future__ import annotations

import importlib.machinery
import importlib.util
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.signature import Signature


@dataclass(frozen=True)
class PythonFunction:
    """One program of a generated module: a function of numbers and lists of numbers that returns the like."""

    signature: Signature
    function: Callable[..., Sequence[Any]]

    def __call__(self, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs, shaped as declared, for the inputs in their declared order; raises ValueError."""
        return self._call(self.signature.arranged(arrays))

    def map(self, *arrays: ArrayLike) -> tuple[Floats, ...]:
        """Return the outputs (samples, *shape) for inputs that are stacked by sample or the same for all."""
        samples, inputs, changing = self.signature.stacked(arrays)
        outputs = tuple(np.empty((samples, *shape)) for _, shape in self.signature.outputs)
        for sample in range(samples):
            row = [values[sample] if many else values for values, many in zip(inputs, changing, strict=True)]
            for output, values in zip(outputs, self._call(row), strict=True):
                output[sample] = values
        return outputs

    def _call(self, inputs: Sequence[Floats]) -> tuple[Floats, ...]:
        returned = self.function(*[values.ravel().tolist() if values.ndim else float(values) for values in inputs])
        shapes = (shape for _, shape in self.signature.outputs)
        return tuple(np.array(v, dtype=float).reshape(s) for v, s in zip(returned, shapes, strict=True))


class _PlainLoader(importlib.machinery.SourceFileLoader):
    """Loads source and leaves no compiled file behind, which would be read back without a check of its content."""

    def set_data(self, path: str, data: Any, *, _mode: int = 0o666) -> None:
        """Write nothing."""


def open_module(path: Path, signatures: Sequence[Signature]) -> Mapping[str, PythonFunction]:
    """Return the programs of the generated module at `path` by name; raises ValueError if one is missing."""
    name = f"multibody_sym_generated_{path.stem.replace('-', '_')}"
    loader = _PlainLoader(name, str(path))
    spec = importlib.util.spec_from_loader(name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    missing = [s.program for s in signatures if s.program not in module.PROGRAMS]
    if missing:
        raise ValueError(f"{path} has no program {missing[0]}")
    return {s.program: PythonFunction(s, module.PROGRAMS[s.program]) for s in signatures}
