"""A system ready to run: resolved, its parameters in numbers, its start assembled, its Programs compiled."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.dynamics.start.examined import on_numbers
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import StartState, examined_state
from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.parameters import ALPHA, BETA
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.loading import Backend, Compiled
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.simulation.recall import compiled, formalism_name
from multibody_sym.simulation.settings import form_of


@dataclass(frozen=True, eq=False)
class Runnable:
    """A system, its mechanism in its mode at the start, compiled Programs and start; `state` tells how it starts."""

    system: System
    mechanism: Mechanism
    formalism: str
    compiled: Compiled
    start: Start
    state: StartState

    def __repr__(self) -> str:
        return f"<Runnable of {self.mechanism.name} by {self.formalism}>"

    @cached_property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return np.array(self.start.parameters, dtype=float)

    @cached_property
    def q0(self) -> Floats:
        """The coordinates (nq,) at t = 0."""
        return np.array(self.start.q, dtype=float)

    @cached_property
    def u0(self) -> Floats:
        """The speeds (nu,) at t = 0."""
        return np.array(self.start.u, dtype=float)

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
    state = examined_state(system)
    name = formalism_name(formalism, state.mechanism)
    rows = any(row.restricts for row in state.mechanism.rows)
    form = form_of(system.simulation, constrained=rows, varies=bool(state.declared.one_way))
    programs = compiled(state.mechanism, name, form, native=native, backend=backend)
    return Runnable(system, state.mechanism, name, programs, state.start, state)
