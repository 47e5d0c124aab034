"""The plan of a study: which values each run has, by its number alone."""

from __future__ import annotations

import json
from typing import Any, Final

import numpy as np

from multibody_sym.errors import InputError, Where, shown
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.studies.axes import Axis, digits

_BLOCK: Final = 256
"""Random samples are drawn in blocks, each from a generator of its own: a block costs about as much as one number."""
_LARGEST: Final = 2**63 - 1
_MOST: Final = 2**30
"""Points of a Sobol sequence as scipy makes them; of no study so many runs are ever done."""


@dataclass(frozen=True)
class Plan:
    """All combinations of the values of the `axes` (grid: the last varies fastest), or a number of `samples` of them.

    Samples are drawn from a `seed`: `random` ones independently, those of Sobol's scrambled sequence evenly.
    """

    axes: tuple[Axis, ...]
    method: str = "grid"
    samples: int = 0
    seed: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(axis.name for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """How many values each axis has, of a grid; the number of samples."""
        return tuple(axis.size for axis in self.axes) if self.method == "grid" else (self.samples,)

    def __len__(self) -> int:
        total = 1
        for size in self.shape:
            total *= size
        return total

    def values(self, first: int, count: int) -> Floats:
        """Return the values (count, axes) of the runs from number `first` on."""
        numbers = np.arange(first, first + count)
        if self.method == "grid":
            places = np.unravel_index(numbers, self.shape)
            columns = [axis.value(place) for axis, place in zip(self.axes, places, strict=True)]
        else:
            parts = self._random(first, count) if self.method == "random" else self._sobol(first, count)
            columns = [axis.drawn(part) for axis, part in zip(self.axes, parts.T, strict=True)]
        return np.column_stack(columns)

    def _random(self, first: int, count: int) -> Floats:
        blocks = range(first // _BLOCK, (first + count - 1) // _BLOCK + 1)
        width = len(self.axes)
        drawn = [np.random.Generator(np.random.Philox(key=[self.seed, k])).random((_BLOCK, width)) for k in blocks]
        begin = first - blocks.start * _BLOCK
        return np.concatenate(drawn)[begin : begin + count]

    def _sobol(self, first: int, count: int) -> Floats:
        import warnings

        from scipy.stats import qmc

        engine = qmc.Sobol(len(self.axes), scramble=True, seed=self.seed)
        if first:
            engine.fast_forward(first)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it wants powers of two, and a part of the sequence is none
            found: Floats = engine.random(count)
        return found

    @property
    def text(self) -> str:
        """The plan as one line that differs from that of every other."""
        axes = [
            [axis.name, axis.kind, [x.hex() for x in axis.values], axis.low.hex(), axis.high.hex(), axis.count]
            for axis in self.axes
        ]
        return json.dumps([axes, self.method, self.samples, self.seed])

    @property
    def words(self) -> list[str]:
        """What draws the samples, as words of a command."""
        if self.method == "grid":
            return []
        return [f"--sample {self.samples}", f"--seed {self.seed}", *(["--sobol"] if self.method == "sobol" else [])]


def plan_of(axes: tuple[Axis, ...], sample: Any = None, seed: Any = None, sobol: bool = False) -> Plan:
    """Return the plan of a study. Raises InputError for what does not go together."""
    if sample is None:
        for name, given in (("seed", seed is not None), ("sobol", sobol)):
            if given:
                raise InputError(f"{name} is for samples: say how many (sample)", where=_at(name))
        return _grid(axes)
    samples = _whole("sample", sample, least=1, most=_MOST)
    return Plan(axes, "sobol" if sobol else "random", samples, _whole("seed", 0 if seed is None else seed, least=0))


def _grid(axes: tuple[Axis, ...]) -> Plan:
    for axis in axes:
        if not axis.size:
            message = f"how many values are there from {axis.low:g} to {axis.high:g}? Give a count, or draw samples"
            raise InputError(message, where=Where(path=("vary", axis.name)))
    plan = Plan(axes)
    if len(plan) > _MOST:
        raise InputError(f"{len(plan)} runs are too many; draw samples instead", where=_at("vary"))
    return plan


def _whole(name: str, given: Any, least: int, most: int = _LARGEST) -> int:
    text = digits(given)
    if not text or not least <= int(text) <= most:
        message = f"expected a whole number, at least {least} and at most {most}, got {shown(given)}"
        raise InputError(message, where=_at(name))
    return int(text)


def _at(name: str) -> Where:
    return Where(path=(name,))
