"""Hamilton's equations of a system as compiled functions of coordinates and momenta."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.programs.canonical import canonical_programs
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import brief
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import vector
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.simulation.arguments import Arguments, Values


@dataclass(frozen=True)
class CanonicalQuestion:
    """What is to be compiled: Hamilton's equations of a system."""

    system: System


def canonical_equations(system: System) -> CanonicalQuestion:
    """Return Hamilton's equations of a system, for `compile`: x' of x = (q, p), linear in the number of bodies."""
    verify_system(system)
    return CanonicalQuestion(system)


@dataclass(frozen=True, eq=False)
class CanonicalFunction:
    """`rhs(t, x)` -> x', both (nq + nu,), x = (q, p); `names` of its components, `x0` the system's start.

    `momenta` p of the speeds, `speeds` u of the momenta, `hamiltonian` H(q, p). Momenta of angular velocities in body
    axes are those along these axes. With constraints, Baumgarte's coefficients are zero.
    """

    arguments: Arguments
    q0: Floats
    u0: Floats

    def __repr__(self) -> str:
        name = self.arguments.mechanism.name
        return f"<CanonicalFunction of {name}: rhs(t, x) with x = ({', '.join(brief(self.names))})>"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of coordinates and momenta, in the order of x."""
        mechanism = self.arguments.mechanism
        of = {u: mechanism.coordinates[q].name for body in mechanism.bodies for q, u in body.rate_pairs}
        momenta = (f"p_{of.get(k, speed.name)}" for k, speed in enumerate(mechanism.speeds))
        return (*(c.name for c in mechanism.coordinates), *momenta)

    @property
    def x0(self) -> Floats:
        """The start (nq + nu,)."""
        return np.concatenate([self.q0, self.momenta(0.0, self.q0, self.u0)])

    def __call__(self, t: float, x: ArrayLike, parameters: Values = None, inputs: Values = None) -> Floats:
        """Return x' at time t; parameters and inputs as for a state derivative.

        Raises InputError for an unknown name, a wrong length, and what is no real number.
        """
        given, _ = self._given(t, *self._split(x), parameters, inputs)
        qdot, pdot, *_ = self.arguments.compiled["canonical"](*given)
        return np.concatenate([qdot, pdot])

    def momenta(
        self, t: float, q: ArrayLike, u: ArrayLike, parameters: Values = None, inputs: Values = None
    ) -> Floats:
        """Return the momenta p (nu,) of speeds."""
        given = self.arguments.complete(t, q, u, parameters, inputs)
        return np.asarray(self.arguments.compiled["momenta"](*given)[0])

    def speeds(
        self, t: float, q: ArrayLike, p: ArrayLike, parameters: Values = None, inputs: Values = None
    ) -> Floats:
        """Return the speeds u (nu,) of momenta."""
        _, u = self._given(t, q, p, parameters, inputs)
        return u

    def hamiltonian(self, t: float, x: ArrayLike, parameters: Values = None, inputs: Values = None) -> float:
        """Return H(q, p, t) = p . u - T + V."""
        given, _ = self._given(t, *self._split(x), parameters, inputs)
        return float(self.arguments.compiled["hamiltonian"](*given)[0])

    def _split(self, x: ArrayLike) -> tuple[Floats, Floats]:
        state, coordinates = vector("x", x, len(self.names)), len(self.arguments.mechanism.coordinates)
        return state[:coordinates], state[coordinates:]

    def _given(
        self, t: float, q: ArrayLike, p: ArrayLike, parameters: Values, inputs: Values
    ) -> tuple[tuple[float, Floats, Floats, Floats, Floats, Floats], Floats]:
        """Return what the Programs of p take, and the speeds, on which declared inputs may depend."""
        momenta = vector("p", p, len(self.arguments.mechanism.speeds))
        before = self.arguments.complete(t, q, np.zeros(len(momenta)), parameters, inputs)
        (u,) = self.arguments.compiled["speeds"](before[0], before[1], momenta, *before[3:])
        time, state, _, *rest = self.arguments.complete(t, q, u, parameters, inputs)
        return (time, state, momenta, rest[0], rest[1], rest[2]), np.asarray(u)


def canonical_function(
    question: CanonicalQuestion, *, native: bool = False, backend: Backend | None = None
) -> CanonicalFunction:
    """Return Hamilton's equations as compiled functions. Raises what `canonical_programs` does, and for a bad start."""
    state = examined_state(question.system)
    compiled = _compiled(state.mechanism, native=native, backend=backend)
    arguments = Arguments(state.mechanism, compiled, np.array(state.start.parameters, dtype=float))
    return CanonicalFunction(arguments, np.array(state.start.q, dtype=float), np.array(state.start.u, dtype=float))


def _compiled(mechanism: Mechanism, *, native: bool, backend: Backend | None) -> Compiled:
    made = load(canonical_programs(mechanism), native=native, backend=backend)
    return replace(made, remake=partial(_compiled, mechanism))
