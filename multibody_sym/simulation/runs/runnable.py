"""A system ready to run, as runs and their results take it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Compiled
from multibody_sym.simulation.runs.told import Told, recalled

if TYPE_CHECKING:  # a run that is recalled needs none of it
    from multibody_sym.dynamics.start.start import Start
    from multibody_sym.dynamics.start.state import StartState
    from multibody_sym.model.declaration.system import System
    from multibody_sym.model.mechanism.mechanism import Mechanism
    from multibody_sym.scalars.node import Node
    from multibody_sym.simulation.one_way.every import LawMechanism


class Numbers(NamedTuple):
    """The numbers of a start: the parameter vector (np,), coordinates (nq,), speeds (nu,) at t = 0; of many, rows."""

    parameters: Floats
    q0: Floats
    u0: Floats

    def of(self, which: int | list[int]) -> Numbers:
        """Return the numbers of one start among many, or of some."""
        return Numbers(self.parameters[which], self.q0[which], self.u0[which])


@dataclass(frozen=True, eq=False)
class Runnable:
    """A mechanism in its mode at the start, with compiled Programs and the numbers that it starts with.

    `begin` tells its system and how it starts. Runs that differ in numbers alone share one mechanism, whose own numbers
    are those of the first, as are names and units. With `laws` the Programs serve all modes. Of a run that is
    recalled `begin` makes all that anew; `known` is
    what results tell of it.
    """

    formalism: str
    compiled: Compiled
    numbers: Numbers
    begin: Callable[[], tuple[System, StartState]]
    shared: Told | None = None
    known: Mapping[str, Any] | None = None
    laws: LawMechanism | None = None

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism in its mode at the start."""
        return self.state.mechanism if self.shared is None else self.shared.mechanism

    @property
    def told(self) -> Told:
        """What results tell of the mechanism."""
        return self._told if self.shared is None else self.shared

    @cached_property
    def _told(self) -> Told:
        return Told(self) if self.known is None else recalled(self.known["told"], self)

    @cached_property
    def begun_from(self) -> Mapping[str, Any]:
        """What of the start was kept, and what was found: `held`, `assembled` and `shifts` of a `Start`."""
        if self.known is not None:
            return dict(self.known["start"])
        return {name: getattr(self.start, name) for name in ("held", "assembled", "shifts")}

    @cached_property
    def wheels(self) -> Mapping[str, float]:
        """The least radius (m) of each row by which a wheel rolls that nothing but weight keeps down, zero without."""
        if self.known is not None:
            return dict(self.known["wheels"])
        from multibody_sym.model.mechanism.mechanism import normal_forces  # which few runs need
        from multibody_sym.scalars.functions import evaluate_float
        from multibody_sym.scalars.node import slot

        values = {slot("parameters", k): x for k, x in enumerate(self.parameters.tolist())}
        rows = normal_forces(self.mechanism).items()
        return {name: min(evaluate_float(row.radii, values), default=0.0) for name, row in rows}

    @property
    def shifts(self) -> Mapping[str, float]:
        """By how much start values that were given changed."""
        shifts: Mapping[str, float] = self.begun_from["shifts"]
        return shifts

    @cached_property
    def _begun(self) -> tuple[System, StartState]:
        return self.begin()

    @property
    def system(self) -> System:
        """The system as it was asked to run."""
        return self._begun[0]

    @property
    def state(self) -> StartState:
        """How it starts."""
        return self._begun[1]

    @property
    def start(self) -> Start:
        """The start of the mechanism in its mode."""
        return self.state.start

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self.numbers.parameters

    @property
    def q0(self) -> Floats:
        """The coordinates (nq,) at t = 0."""
        return self.numbers.q0

    @property
    def u0(self) -> Floats:
        """The speeds (nu,) at t = 0."""
        return self.numbers.u0

    def stabilised_by(self, alpha: float, beta: float) -> Floats:
        """Return the parameter vector (np,) with Baumgarte's coefficients (1/s)."""
        from multibody_sym.model.mechanism.parameters import ALPHA, BETA

        return np.array(self.mechanism.parameters.changed(self.start.parameters, {ALPHA: alpha, BETA: beta}))

    @property
    def parameter_values(self) -> dict[Node, float]:
        """The value of each parameter's symbol; numbers that the model writes have none."""
        from multibody_sym.model.mechanism.parameters import Source
        from multibody_sym.scalars.node import symbol

        entries = zip(self.mechanism.parameters, self.parameters.tolist(), strict=True)
        return {symbol(entry.name): value for entry, value in entries if entry.source is not Source.LITERAL}
