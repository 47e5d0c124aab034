"""CanonicalEquations: equations of motion in momenta, by Hamilton or Routh, to be read, shown or evaluated."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
import sympy

from multibody_sym.dynamics.derivation.notation import Notation, ReadableEquations
from multibody_sym.dynamics.derivation.numpy_function import declared_inputs, numpy_function
from multibody_sym.dynamics.derivation.record import Derivation, Equation
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import ModelError
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import number, vector
from multibody_sym.records import dataclass


@dataclass(frozen=True)
class FirstIntegral:
    """A quantity that stays constant: its `name` in outputs, its `expression` (sympy; None where it has none in q and
    p), and the `symmetry` behind it."""

    name: str
    expression: Any
    symmetry: str


@dataclass(frozen=True, repr=False)
class CanonicalEquations(ReadableEquations):
    """Equations of motion in momenta, derived by `method` "hamilton" or "routh".

        hamilton:  H(q, p, t) = p . u - L        q' = dH/dp        p' = -dH/dq + Q + H^T lambda
        routh:     R = L - p_c . u_c over the coordinates that are not cyclic, p_c constant

    `function` is H, or R; `momenta` the symbols p, of all speeds, or of the cyclic ones; `speeds` what the speeds are
    in them, by symbol; `rates` (qdot, pdot) of Hamilton's, in order. `equations` left = right as they are read;
    `energy` is T + V in momenta where T is quadratic in the speeds, so that H is that, else None;
    `effective_potential` (routh) V_R(q; p). `constraints` phi or psi of each row. All are sympy expressions in the
    symbols of `symbols`, the momenta, and names that `definitions` explains. `first_integrals` are the quantities that
    stay constant. `constants` as in `SymbolicEquations`.
    """

    method: str
    mechanism: Mechanism
    symbols: Symbols
    momenta: tuple[Any, ...]
    kinetic_energy: Any
    potential_energy: Any
    generalized_forces: tuple[Any, ...]
    function: Any
    speeds: Mapping[Any, Any]
    rates: tuple[tuple[Any, ...], tuple[Any, ...]]
    constraints: tuple[Any, ...]
    equations: tuple[Equation, ...]
    definitions: tuple[tuple[Any, Any], ...]
    numbers: Mapping[Any, Any]
    steps: Derivation
    notation: Notation
    constants: Mapping[Any, float] = field(default_factory=dict)
    energy: Any = None
    effective_potential: Any = None
    first_integrals: tuple[FirstIntegral, ...] = ()

    @property
    def operations(self) -> int:
        """The number of operations in the function and the equations, each shared sub-expression counted once."""
        parts = [self.function, *(x for e in self.equations for x in (e.left, e.right) if isinstance(x, sympy.Basic))]
        return self._counted(parts)

    def lambdify(self) -> Callable[..., tuple[Floats, Floats]]:
        """Return a NumPy function of (q, p, t=0, parameters=None): qdot (nq,) and pdot (nu,) of Hamilton's equations.

        Raises ModelError for Routh's, and where rows restrict the system: their multipliers follow from accelerations
        (`compile(canonical_equations(system))`).
        """
        if self.method != "hamilton" or self.mechanism.rows:
            raise ModelError(
                "these equations do not give all rates: take Hamilton's of a system without constraints, or "
                "compile(canonical_equations(system))",
                number="M120",
            )
        return LambdifiedCanonical(self, self._compiled())

    def _ordered(self) -> list[tuple[Any, Any]]:
        """Return definitions and speeds in an order in which they can be evaluated."""
        return in_order({**dict(self.definitions), **self.speeds})

    def _compiled(self) -> Callable[..., Any]:
        s = self.symbols
        inputs, numbers = declared_inputs(self.mechanism, s)
        definitions = in_order({**dict(inputs), **dict(self.definitions), **self.speeds})
        groups = (s.coordinates, self.momenta, s.parameters)
        return numpy_function(s.time, groups, definitions, {**self.numbers, **numbers}, self.rates)


@dataclass(frozen=True, eq=False, repr=False)
class LambdifiedCanonical:
    """Hamilton's equations as a NumPy function (see `CanonicalEquations.lambdify`); a pickle holds the equations."""

    equations: CanonicalEquations
    evaluate: Callable[..., Any]

    def __call__(
        self, q: Sequence[float], p: Sequence[float], t: float = 0.0, parameters: Sequence[float] | None = None
    ) -> tuple[Floats, Floats]:
        """Return qdot (nq,), pdot (nu,); raises InputError."""
        equations, s = self.equations, self.equations.symbols
        declared = zip(s.parameters, parameter_values(equations.mechanism, {}), strict=True)
        values = [equations.constants.get(x, value) for x, value in declared] if parameters is None else parameters
        state, momenta = vector("q", q, len(s.coordinates)), vector("p", p, len(equations.momenta))
        found = self.evaluate(number("t", t), state, momenta, vector("parameters", values, len(s.parameters)))
        return np.array(found[0], dtype=float), np.array(found[1], dtype=float)

    def __reduce__(self) -> tuple[Any, ...]:
        return CanonicalEquations.lambdify, (self.equations,)


def in_order(definitions: Mapping[Any, Any]) -> list[tuple[Any, Any]]:
    """Return definitions so that each rests on earlier ones alone."""
    found: dict[Any, Any] = {}

    def waiting(name: Any) -> Iterable[Any]:
        return [s for s in sorted(definitions[name].free_symbols, key=str) if s in definitions and s not in found]

    for first in definitions:
        stack = [first]
        while stack:
            name = stack[-1]
            before = waiting(name) if name not in found else []
            if before:
                stack.extend(before)
                continue
            stack.pop()
            found.setdefault(name, definitions[name])
    return list(found.items())
