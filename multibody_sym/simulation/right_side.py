"""The equations of motion as a function x' = f(t, x) that any integrator takes."""

from __future__ import annotations

from typing import get_args, overload

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.routes import verify_formalism
from multibody_sym.errors import ArgumentError, InputError, brief, shown
from multibody_sym.model.declaration.doors import flag
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import vector
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend
from multibody_sym.simulation.arguments import Arguments, Values
from multibody_sym.simulation.canonical.function import CanonicalFunction, CanonicalQuestion, canonical_function
from multibody_sym.simulation.impact_function import ImpactFunction, ImpactQuestion, impact_function
from multibody_sym.simulation.runnable import runnable
from multibody_sym.simulation.runs.runnable import Runnable
from multibody_sym.simulation.settings import run_settings
from multibody_sym.simulation.tree_functions import TreeFunction, TreeQuestion, tree_function


@dataclass(frozen=True)
class StateDerivative:
    """What is to be compiled: the rates of a system's coordinates and speeds by a formalism (None: the cheapest)."""

    system: System
    formalism: str | None = None


def state_derivative(system: System, *, formalism: str | None = None) -> StateDerivative:
    """Return the state derivative x' of a system, x = (q, u), for `compile`."""
    verify_system(system)
    verify_formalism(formalism)
    return StateDerivative(system, formalism)


@dataclass(frozen=True, eq=False)
class RightSide:
    """`rhs(t, x)` -> x', both (nq + nu,); `names` of the state's components, `x0` the system's start.

    With constraints, Baumgarte's coefficients are those that the system's settings state, or zero.
    """

    ready: Runnable
    arguments: Arguments

    def __repr__(self) -> str:
        return f"<RightSide of {self.ready.mechanism.name}: rhs(t, x) with x = ({', '.join(brief(self.names))})>"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of coordinates and speeds, in the order of x."""
        mechanism = self.ready.mechanism
        return (*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds))

    @property
    def x0(self) -> Floats:
        """The start (nq + nu,)."""
        return np.concatenate([self.ready.q0, self.ready.u0])

    def __call__(self, t: float, x: ArrayLike, parameters: Values = None, inputs: Values = None) -> Floats:
        """Return x' at time t.

        `parameters`: values by name in place of the system's, which other parameters that depend on them follow, or all
        of them as a vector; `inputs`: likewise, in place of what the system declares.
        Raises InputError for an unknown name, a wrong length, and what is no real number, complex ones too.
        """
        state, coordinates = vector("x", x, len(self.names)), len(self.ready.mechanism.coordinates)
        given = self.arguments.complete(t, state[:coordinates], state[coordinates:], parameters, inputs)
        qdot, udot, *_ = self.ready.compiled["state_derivative"](*given)
        return np.concatenate([qdot, udot])


@overload
def compile(wanted: StateDerivative, *, native: bool = False, backend: Backend | None = None) -> RightSide: ...


@overload
def compile(
    wanted: CanonicalQuestion, *, native: bool = False, backend: Backend | None = None
) -> CanonicalFunction: ...


@overload
def compile(wanted: ImpactQuestion, *, native: bool = False, backend: Backend | None = None) -> ImpactFunction: ...


@overload
def compile(wanted: TreeQuestion, *, native: bool = False, backend: Backend | None = None) -> TreeFunction: ...


def compile(
    wanted: StateDerivative | CanonicalQuestion | TreeQuestion | ImpactQuestion,
    *,
    native: bool = False,
    backend: Backend | None = None,
) -> RightSide | CanonicalFunction | TreeFunction | ImpactFunction:
    """Return a state derivative, Hamilton's equations, inverse or hybrid dynamics, M or an impact, as a function.

    `native` and `backend` as for `simulate`. Raises InputError for what the model contradicts, and NoSolutionError
    where no start satisfies the constraints of a state derivative.
    """
    if isinstance(wanted, System):
        raise InputError("a System is not compiled itself; compile(state_derivative(system)), mass_matrix(system) ...")
    native = flag("native", native)
    if isinstance(wanted, ImpactQuestion):
        return impact_function(wanted, native=native, backend=backend)
    if isinstance(wanted, CanonicalQuestion):
        return canonical_function(wanted, native=native, backend=backend)
    if not isinstance(wanted, (StateDerivative, *get_args(TreeQuestion))):
        raise ArgumentError(f"expected state_derivative(system), mass_matrix(system) or the like, got {shown(wanted)}")
    if not isinstance(wanted, StateDerivative):
        return tree_function(wanted, native=native, backend=backend)
    ready = runnable(wanted.system, wanted.formalism, native=native, backend=backend)
    asked = run_settings(ready.system.simulation, ready.parameter_values).baumgarte
    values = ready.parameters
    if ready.mechanism.rows and asked is not None:
        values = ready.stabilised_by(asked.alpha or 0.0, asked.beta or 0.0)
    return RightSide(ready, Arguments(ready.mechanism, ready.compiled, values))
