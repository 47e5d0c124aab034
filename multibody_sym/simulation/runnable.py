"""A system ready to run: resolved, its parameters in numbers, its start assembled, its Programs compiled."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import on_numbers
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import StartState, examined_state, with_numbers_as_data
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import ALPHA, BETA
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.simulation.recall import compiled, formalism_name
from multibody_sym.simulation.settings import form_of


class Numbers(NamedTuple):
    """The numbers of a start: the parameter vector (np,), coordinates (nq,) and speeds (nu,) at t = 0."""

    parameters: Floats
    q0: Floats
    u0: Floats


@dataclass(frozen=True, eq=False)
class Runnable:
    """A mechanism in its mode at the start, with compiled Programs and the numbers that it starts with.

    `begin` tells its system and how it starts. Runs that differ in numbers alone have one mechanism, whose own numbers
    are those of the first.
    """

    mechanism: Mechanism
    formalism: str
    compiled: Compiled
    numbers: Numbers
    begin: Callable[[], tuple[System, StartState]]

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
        return np.array(self.mechanism.parameters.changed(self.start.parameters, {ALPHA: alpha, BETA: beta}))

    @property
    def parameter_values(self) -> dict[Node, float]:
        """The value of each parameter's symbol."""
        entries = zip(self.mechanism.parameters, self.parameters.tolist(), strict=True)
        return {symbol(entry.name): value for entry, value in entries}


@on_numbers
def runnable(
    system: System, formalism: str | None = None, *, native: bool = False, backend: Backend | None = None
) -> Runnable:
    """Return the system ready to run by a formalism, in C or Python (`runtime.loading.load`).

    Raises InputError for what the model contradicts, and NoSolutionError where no start satisfies the constraints or a
    free direction has no inertia.
    """
    verify_formalism(formalism)
    state = with_numbers_as_data(examined_state(system))
    name = formalism_name(formalism, state.mechanism)
    rows = any(row.restricts for row in state.mechanism.rows)
    form = form_of(system.simulation, constrained=rows, varies=bool(state.declared.one_way))
    programs = compiled(state.mechanism, name, form, native=native, backend=backend)
    begin = state.start
    numbers = Numbers(*(np.array(values, dtype=float) for values in (begin.parameters, begin.q, begin.u)))
    return Runnable(state.mechanism, name, programs, numbers, partial(_known, system, state))


def _known(system: System, state: StartState) -> tuple[System, StartState]:
    return system, state
