"""A system ready to run: resolved, its parameters in numbers, its start assembled, its Programs compiled."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from multibody_sym.dynamics.constraints.closing_programs import closes_by_programs
from multibody_sym.dynamics.constraints.row_numbers import CompiledRows
from multibody_sym.dynamics.programs.literals import with_constants
from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import examined, on_numbers
from multibody_sym.dynamics.start.state import StartState, state_at, with_numbers_as_data
from multibody_sym.dynamics.start.undefined import ARITHMETIC
from multibody_sym.errors import MultibodyError
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.simulation.recall import compiled, formalism_name, known, recalled_laws
from multibody_sym.simulation.runs.runnable import Numbers, Runnable
from multibody_sym.simulation.settings import form_of
from multibody_sym.stages import stage

if TYPE_CHECKING:
    from multibody_sym.program.programs import Form
    from multibody_sym.simulation.one_way.every import LawMechanism

_FEW: Final = 30
"""Speeds of a model that is soon walked through in Python: what is wrong with its start is told before it is compiled.
"""


@on_numbers
def runnable(
    system: System,
    formalism: str | None = None,
    *,
    native: bool = False,
    backend: Backend | None = None,
    modes: bool = False,
) -> Runnable:
    """Return the system ready to run by a formalism, in C or Python (`runtime.loading.load`).

    `modes`: its Programs are those of all modes of what holds one way only, where one set of them serves these; else
    they are those of the mode at its start. Raises InputError for what the model contradicts, and NoSolutionError where
    no start satisfies the constraints or a free direction has no inertia.
    """
    verify_formalism(formalism)
    finding = _Programs(system, formalism, native, backend)
    with stage("start"):
        state, made = _started(system, finding)
    state = with_numbers_as_data(state.before_a_run)
    laws = _laws(state, system) if modes and state.declared.one_way else None
    if laws is not None and laws.every is not None:
        name, programs = finding.of_all_modes(laws)
    else:
        laws, (name, programs) = None, made or finding.made(state.mechanism)
    begin = state.start
    numbers = Numbers(*(np.array(values, dtype=float) for values in (begin.parameters, begin.q, begin.u)))
    return Runnable(name, programs, numbers, partial(_known, system, state), laws=laws)


def _laws(state: StartState, system: System) -> LawMechanism:
    from multibody_sym.simulation.one_way.every import LawMechanism  # which few runs need

    return LawMechanism.of(state.declared, system.simulation)


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

    def of_all_modes(self, laws: LawMechanism) -> Made:
        assert laws.every is not None
        name = formalism_name(self.formalism, laws.every)
        form = form_of(self.system.simulation, constrained=True, varies=True)
        found = recalled_laws(laws.declared, (name, form), native=self.native, backend=self.backend)
        return name, found.compiled

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
