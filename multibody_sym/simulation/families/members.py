"""Runs of a family: numbers in arrays of many; what one of them was made of is put together when somebody asks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np

from multibody_sym.dynamics.start.start import Start
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.integration import Integration
from multibody_sym.runtime.native_runs import Each
from multibody_sym.runtime.problem import Problem
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.made import MadeAlone
from multibody_sym.simulation.runs.runnable import Numbers, Runnable
from multibody_sym.simulation.runs.told import Told


class Kin(Protocol):
    """What runs of a family have in common."""

    @property
    def told(self) -> Told: ...
    def ready(self, numbers: Numbers, declared: Numbers, start: Start | None) -> Runnable: ...
    def problem(self, ready: Runnable) -> Problem: ...


@dataclass(frozen=True, eq=False)
class Batch:
    """Runs of one `kin`: the numbers that are `declared`, those with which they begin, and what came of `each`.

    `starts`: how loops were closed, None where runs begin as they are declared. `each` is None where no single call
    integrates them.
    """

    kin: Kin
    declared: Numbers
    numbers: Numbers
    starts: Sequence[Start | None]
    each: Each | None

    def ready(self, k: int) -> Runnable:
        """Return run number k, ready."""
        return self.kin.ready(self.numbers.of(k), self.declared.of(k), self.starts[k])

    @property
    def integrated(self) -> Each:
        """What came of the runs, for those that are done."""
        assert self.each is not None
        return self.each


class Member:
    """Run number k of a batch."""

    parts: Final[Sequence[Part]] = ()
    modes: Final = None
    begun: Final[tuple[Mapping[str, Any], ...]] = ()
    failure: Final = None

    def __init__(self, batch: Batch, k: int) -> None:
        self._batch, self._k = batch, k

    def __reduce__(self) -> Any:
        """Return what copies it: a run made alone, without those that were integrated with it."""
        return MadeAlone, (self.ready, self.problem, self.integration)

    @property
    def done(self) -> bool:
        """Whether it is integrated already."""
        return self._batch.each is not None and self._batch.each.done[self._k]

    @property
    def told(self) -> Told:
        """What is told of the system."""
        return self._batch.kin.told

    @cached_property
    def ready(self) -> Runnable:
        """The system, ready to run."""
        return self._batch.ready(self._k)

    @cached_property
    def problem(self) -> Problem:
        """What is integrated."""
        return self._batch.kin.problem(self.ready)

    @cached_property
    def integration(self) -> Integration:
        """How that ended, if it is done."""
        return self._batch.integrated.integration(self._k)

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self.problem.parameters

    @property
    def t(self) -> Floats:
        """The times of samples (m,), if it is done."""
        return self._batch.integrated.t

    @property
    def q(self) -> Floats:
        """Coordinates (m, nq), if it is done."""
        found: Floats = self._batch.integrated.q[self._k]
        return found

    @property
    def u(self) -> Floats:
        """Speeds (m, nu), if it is done."""
        found: Floats = self._batch.integrated.u[self._k]
        return found


def numbers_of(starts: Sequence[Start]) -> Numbers:
    """Return the numbers with which runs begin: parameters (n, np), coordinates (n, nq) and speeds (n, nu)."""
    columns = ([getattr(start, name) for start in starts] for name in ("parameters", "q", "u"))
    return Numbers(*(np.array(rows, dtype=float) for rows in columns))
