"""x' = f(t, x) of a Function of accelerations, with its Jacobian, for solvers of ordinary differential equations."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.dynamics.programs.function_derivatives import state_jacobian
from multibody_sym.dynamics.programs.state_functions import with_declared_inputs
from multibody_sym.errors import InputError
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.model.argument_checks import door
from multibody_sym.motion.function_results import Rates
from multibody_sym.motion.prepare.arguments import array_of
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.program import Program
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import number


@dataclass(frozen=True, eq=False)
class OrdinaryEquations:
    """`rhs(t, x)` -> x' (nq + nu,), `rhs.jac(t, x)` -> d x'/dx: `solve_ivp(rhs, span, x0, jac=rhs.jac)`.

    Quaternions count by their directions: x' is that of the state in which they have length one, so that what rounding
    does to their lengths does not grow. x may be (n, nq + nu). Inputs and parameters are as declared.
    """

    _rates: Callable[[Any, Floats, Floats], Rates]
    _program: Program
    _mechanism: Mechanism
    _parameters: Floats
    _code: Native

    @door
    def __call__(self, t: float, x: ArrayLike) -> Floats:
        """Return x' (nx,) at time t (s) and x (nx,), or (n, nx) of n states. Raises InputError for other shapes."""
        q, u = self._parts(x)
        for places in self._balls:
            q[..., places] /= np.linalg.norm(q[..., places], axis=-1, keepdims=True)
        found = self._rates(number("t", t), q, u)
        return np.concatenate([found.qdot, found.udot], axis=-1)

    @door
    def jac(self, t: float, x: ArrayLike) -> Floats:
        """Return d x'/dx (nx, nx) at time t (s) and one state x (nx,). Raises InputError for other shapes."""
        q, u = self._parts(x)
        if q.ndim != 1:
            raise InputError(f"x has the shape {np.shape(x)}, not (nx,): jac takes one state")
        sizes = [float(np.linalg.norm(q[places])) for places in self._balls]
        for places, size in zip(self._balls, sizes, strict=True):
            q[places] /= size
        given = number("t", t), q, u, self._parameters, np.zeros(len(self._mechanism.inputs)), np.empty(0)
        found: Floats = self._jacobian["jacobian"](*given)[0]
        for places, size in zip(self._balls, sizes, strict=True):
            way = q[places]
            found[:, places] = (found[:, places] - np.outer(found[:, places] @ way, way)) / size
        return found

    @property
    def _balls(self) -> list[list[int]]:
        return [list(places) for body in self._mechanism.bodies for places in body.quaternions]

    def _parts(self, x: ArrayLike) -> tuple[Floats, Floats]:
        """Return copies of q and u."""
        nq, nu = len(self._mechanism.coordinates), len(self._mechanism.speeds)
        values = array_of("x", x, nq + nu)
        return values[..., :nq].copy(), values[..., nq:].copy()

    @cached_property
    def _jacobian(self) -> Compiled:
        program = with_declared_inputs(self._mechanism, state_jacobian(self._mechanism, self._program))
        return load({"jacobian": program}, self._code)
