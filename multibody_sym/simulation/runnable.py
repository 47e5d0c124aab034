"""A system ready to run: resolved, its parameters in numbers, its start assembled, its Programs compiled."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cached_property, partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from multibody_sym.dynamics.constraints.closing_programs import closes_by_programs
from multibody_sym.dynamics.constraints.row_numbers import CompiledRows
from multibody_sym.dynamics.programs.literals import with_constants
from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import examined, on_numbers
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import StartState, state_at, with_numbers_as_data
from multibody_sym.dynamics.start.undefined import ARITHMETIC
from multibody_sym.errors import MultibodyError
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import ALPHA, BETA, Source
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.simulation.recall import compiled, formalism_name, known
from multibody_sym.simulation.settings import form_of

if TYPE_CHECKING:
    from multibody_sym.program.programs import Form

_FEW: Final = 30
"""Speeds of a model that is soon walked through in Python: what is wrong with its start is told before it is compiled.
"""


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
        """The value of each parameter's symbol; numbers that the model writes have none."""
        entries = zip(self.mechanism.parameters, self.parameters.tolist(), strict=True)
        return {symbol(entry.name): value for entry, value in entries if entry.source is not Source.LITERAL}


@on_numbers
def runnable(
    system: System, formalism: str | None = None, *, native: bool = False, backend: Backend | None = None
) -> Runnable:
    """Return the system ready to run by a formalism, in C or Python (`runtime.loading.load`).

    Raises InputError for what the model contradicts, and NoSolutionError where no start satisfies the constraints or a
    free direction has no inertia.
    """
    verify_formalism(formalism)
    finding = _Programs(system, formalism, native, backend)
    state, made = _started(system, finding)
    state = with_numbers_as_data(state)
    name, programs = made or finding.made(state.mechanism)
    begin = state.start
    numbers = Numbers(*(np.array(values, dtype=float) for values in (begin.parameters, begin.q, begin.u)))
    return Runnable(state.mechanism, name, programs, numbers, partial(_known, system, state))


Made = tuple[str, Compiled]
"""The name of a formalism, and a mechanism's Programs by it."""


class _Programs(NamedTuple):
    """How a system's Programs are found: those of a mechanism `made`, or only recalled."""

    system: System
    formalism: str | None
    native: bool
    backend: Backend | None

    def made(self, mechanism: Mechanism) -> Made:
        name = formalism_name(self.formalism, mechanism)
        return name, compiled(mechanism, name, self._form(mechanism), native=self.native, backend=self.backend)

    def recalled(self, mechanism: Mechanism) -> Made | None:
        name = formalism_name(self.formalism, mechanism)
        found = known(mechanism, name, self._form(mechanism), native=self.native, backend=self.backend)
        return None if found is None else (name, found)

    def _form(self, mechanism: Mechanism) -> Form:
        rows = any(row.restricts for row in mechanism.rows)
        return form_of(self.system.simulation, constrained=rows, varies=mechanism.mode is not None)


def _started(system: System, programs: _Programs) -> tuple[StartState, Made | None]:
    """Return the state at the start, and the Programs if loops were closed by them, which they are where that can be.

    Whatever is wrong is told as where it cannot; of few bodies, before anything is compiled.
    """
    declared = examined(system)
    found = partial(state_at, declared, project=system.simulation.project)
    if not closes_by_programs(declared):
        return found(), None
    data = with_constants(declared)
    made = programs.recalled(data)
    if made is None and len(declared.speeds) <= _FEW:
        found()
    with suppress(MultibodyError, *ARITHMETIC):
        made = made or programs.made(data)
        compiled = CompiledRows(data, made[1].functions)
        return state_at(data, project=system.simulation.project, compiled=compiled), made
    return found(), made


def _known(system: System, state: StartState) -> tuple[System, StartState]:
    return system, state
