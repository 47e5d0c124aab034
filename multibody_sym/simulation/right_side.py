"""The equations of motion as a function x' = f(t, x) that any integrator takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multibody_sym.dynamics.start import parameter_values
from multibody_sym.errors import InputError
from multibody_sym.model.slots import suggestion
from multibody_sym.model.system import System
from multibody_sym.runtime.loading import Backend
from multibody_sym.simulation.runnable import Runnable, runnable
from multibody_sym.simulation.settings import run_settings

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StateDerivative:
    """What is to be compiled: the rates of a system's coordinates and speeds by a formalism (None: the cheapest)."""

    system: System
    formalism: str | None = None


def state_derivative(system: System, *, formalism: str | None = None) -> StateDerivative:
    """Return the state derivative x' of a system, x = (q, u), for `compile`."""
    return StateDerivative(system, formalism)


@dataclass(frozen=True, eq=False)
class RightSide:
    """`rhs(t, x)` -> x', both (nq + nu,); `names` of the state's components, `x0` the system's start.

    With constraints, Baumgarte's coefficients are those that the system's settings state, or zero.
    """

    ready: Runnable
    parameters: Floats

    @property
    def names(self) -> tuple[str, ...]:
        """The names of coordinates and speeds, in the order of x."""
        mechanism = self.ready.mechanism
        return (*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds))

    @property
    def x0(self) -> Floats:
        """The start (nq + nu,)."""
        return np.concatenate([self.ready.q0, self.ready.u0])

    def __call__(
        self,
        t: float,
        x: ArrayLike,
        parameters: Mapping[str, float] | ArrayLike | None = None,
        inputs: Mapping[str, float] | ArrayLike | None = None,
    ) -> Floats:
        """Return x' at time t.

        `parameters`: values by name in place of the system's, which other parameters that depend on them follow, or all
        of them as a vector; `inputs`: likewise, in place of what the system declares.
        Raises InputError for an unknown name or a wrong length.
        """
        state, coordinates = np.asarray(x, dtype=float), len(self.ready.mechanism.coordinates)
        if state.shape != (len(self.names),):
            raise InputError(f"x has the shape {state.shape}, not ({len(self.names)},)")
        given = (t, state[:coordinates], state[coordinates:], self._parameter_vector(parameters))
        forced = self._input_vector(inputs, given)
        qdot, udot, *_ = self.ready.compiled["state_derivative"](*given, forced, np.empty(0))
        return np.concatenate([qdot, udot])

    def _parameter_vector(self, given: Mapping[str, float] | ArrayLike | None) -> Floats:
        if given is None:
            return self.parameters
        if not isinstance(given, Mapping):
            return _whole("parameters", [p.name for p in self.ready.mechanism.parameters], given)
        values = np.array(parameter_values(self.ready.mechanism, given))
        undeclared = [k for k, entry in enumerate(self.ready.mechanism.parameters) if entry.value is None]
        values[undeclared] = self.parameters[undeclared]
        return values

    def _input_vector(self, given: Mapping[str, float] | ArrayLike | None, state: tuple[Any, ...]) -> Floats:
        names = list(self.ready.mechanism.inputs)
        if given is not None and not isinstance(given, Mapping):
            return _whole("inputs", names, given)
        values, = self.ready.compiled["inputs"](*state)
        for name, value in (given or {}).items():
            if name not in names:
                raise InputError(f"there is no input {name!r}{suggestion(name, names)}")
            values[names.index(name)] = value
        return values


def _whole(kind: str, names: list[str], given: ArrayLike) -> Floats:
    vector = np.asarray(given, dtype=float)
    if vector.shape != (len(names),):
        raise InputError(f"there are {len(names)} {kind} ({', '.join(names)}), got the shape {vector.shape}")
    return vector


def compile(derivative: StateDerivative, *, native: bool = False, backend: Backend | None = None) -> RightSide:
    """Return a state derivative as a compiled function; `native` and `backend` as for `simulate`.

    Raises InputError for what the model contradicts, and NoSolutionError where no start satisfies the constraints.
    """
    ready = runnable(derivative.system, derivative.formalism, native=native, backend=backend)
    asked = run_settings(ready.system.simulation, ready.parameter_values).baumgarte
    if not ready.mechanism.rows or asked is None:
        return RightSide(ready, ready.parameters)
    return RightSide(ready, np.array([*ready.parameters[:-2], asked.alpha or 0.0, asked.beta or 0.0]))
