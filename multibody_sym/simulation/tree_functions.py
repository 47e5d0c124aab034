"""Mass matrix, inverse and hybrid dynamics as compiled functions of the state."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.dynamics.programs.tree import hybrid_dynamics_program, inverse_dynamics_program, mass_matrix_program
from multibody_sym.dynamics.start.examined import examined
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError
from multibody_sym.model.declaration.doors import names as listed_names
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import vector
from multibody_sym.program.program import Program
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.simulation.arguments import Arguments, Values


@dataclass(frozen=True)
class MassMatrix:
    """What is to be compiled: the mass matrix of a system."""

    system: System

    def program(self, resolved: Mechanism) -> Program:
        """Return the Program."""
        return mass_matrix_program(resolved)


@dataclass(frozen=True)
class InverseDynamics:
    """What is to be compiled: the forces that given accelerations of all joints need."""

    system: System

    def program(self, resolved: Mechanism) -> Program:
        """Return the Program."""
        return inverse_dynamics_program(resolved)


@dataclass(frozen=True)
class HybridDynamics:
    """What is to be compiled: accelerations of free joints, and forces of joints with `given` accelerations."""

    system: System
    given: tuple[str, ...]

    def program(self, resolved: Mechanism) -> Program:
        """Return the Program."""
        return hybrid_dynamics_program(resolved, self.given)


TreeQuestion = MassMatrix | InverseDynamics | HybridDynamics


def mass_matrix(system: System) -> MassMatrix:
    """Return the mass matrix of a system, for `compile`: M = f(t, q, u) (nu, nu)."""
    verify_system(system)
    return MassMatrix(system)


def inverse_dynamics(system: System) -> InverseDynamics:
    """Return the inverse dynamics of a tree, for `compile`: forces = f(t, q, u, udot) (nu).

    forces = M udot + c - Q: what the accelerations need on top of the declared forces and the weight, one component a
    speed. `compile` raises ModelError where constraints restrict the tree.
    """
    verify_system(system)
    return InverseDynamics(system)


def hybrid_dynamics(system: System, given: Iterable[str] | str) -> HybridDynamics:
    """Return the hybrid dynamics of a tree, for `compile`: udot, forces = f(t, q, u, udot) (2, nu).

    The joints named in `given` have the accelerations udot; the others move freely under the declared forces, and what
    stands in udot for them is not read. `forces` hold the given ones, zero elsewhere. Raises InputError for a name that
    is no joint's.
    """
    verify_system(system)
    names = listed_names("given", given)
    for name in names:
        if name not in system.joints:
            raise InputError(f"there is no joint {name!r}", number="M106", word=name, known=system.joints)
    return HybridDynamics(system, names)


@dataclass(frozen=True, eq=False)
class TreeFunction:
    """A compiled `program` of the state and, where it takes them, accelerations."""

    arguments: Arguments
    program: str

    def __call__(
        self,
        t: float,
        q: ArrayLike,
        u: ArrayLike,
        udot: ArrayLike | None = None,
        *,
        parameters: Values = None,
        inputs: Values = None,
    ) -> Floats:
        """Return the Program's value, several outputs stacked; parameters and inputs as for a state derivative.

        Raises InputError for an unknown name, a wrong length, or accelerations missing or not wanted.
        """
        given = self.arguments.complete(t, q, u, parameters, inputs)
        takes_udot = self.program != "mass_matrix"
        if takes_udot != (udot is not None):
            raise InputError(f"{self.program} {'needs' if takes_udot else 'takes no'} udot")
        accelerations = () if udot is None else (vector("udot", udot, len(self.arguments.mechanism.speeds)),)
        outputs = self.arguments.compiled[self.program](*given, *accelerations)
        return np.stack(outputs) if len(outputs) > 1 else outputs[0]


def tree_function(question: TreeQuestion, *, native: bool = False, backend: Backend | None = None) -> TreeFunction:
    """Return a question about a tree as a compiled function."""
    resolved = examined(question.system)
    compiled = _compiled(question, resolved, native=native, backend=backend)
    (name,) = (name for name in compiled.functions if name != "inputs")
    return TreeFunction(Arguments(resolved, compiled, np.array(parameter_values(resolved, {}))), name)


def _compiled(question: TreeQuestion, resolved: Mechanism, *, native: bool, backend: Backend | None) -> Compiled:
    program = question.program(resolved)
    made = load({"inputs": inputs_program(resolved), program.name: program}, native=native, backend=backend)
    return replace(made, remake=partial(_compiled, question, resolved))
