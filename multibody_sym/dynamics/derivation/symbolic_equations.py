"""SymbolicEquations: equations of motion in sympy, to be read, shown in a notebook, or evaluated with NumPy."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from multibody_sym.dynamics.derivation.notation import Notation, ReadableEquations
from multibody_sym.dynamics.derivation.numpy_function import declared_inputs, numpy_function
from multibody_sym.dynamics.derivation.record import Derivation, Equation
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.dynamics.formalisms.constrained import constrained
from multibody_sym.dynamics.formalisms.equations import Friction
from multibody_sym.dynamics.formalisms.forward_dynamics import in_floats
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, shown
from multibody_sym.model.declaration.doors import door
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import number, vector
from multibody_sym.numerics.rank import exact, rank
from multibody_sym.records import dataclass
from multibody_sym.scalars.ldl import factorized


@dataclass(frozen=True, repr=False)
class SymbolicEquations(ReadableEquations):
    """Equations of motion of a system with n speeds and s rows, derived by `method`.

        M udot = f + H^T lambda        H udot = gamma        f = Q - c

    `mass_matrix` M (n x n), `forcing` f (n x 1), `constraint_jacobian` H (s x n), `constraint_forcing` gamma (s x 1);
    `kinetic_energy` T, `potential_energy` V, `generalized_forces` (n) of all loads outside V, `constraints` phi (s);
    `equations` left = right as a student writes them: one for each speed or, by newton_euler, up to six for each body,
    with those of its `reactions` that do not vanish. All are sympy expressions in the symbols of `symbols` and in the
    names that `definitions` explains, each by earlier ones; `numbers` holds the values of symbols that stand for
    numbers. `steps` is the derivation, `notation` how it is written. `constants` are the values, at the declared
    start, of the parameters that a run measures there; none where that start cannot be assembled. `dissipation` is
    Rayleigh's function D of dampers, where there are any and all are linear: -dD/du is their part of the forces.

    Where something slides or joints rub, `exerted` C (s x n) and `coupling` D (s x s) are what stands for H^T and is
    added in M udot = f + C^T lambda, H udot + D lambda = gamma; else None. Rows that go `beside` others exert theirs
    times their part of the direction of the vector that all their multipliers make.
    """

    method: str
    mechanism: Mechanism
    symbols: Symbols
    kinetic_energy: Any
    potential_energy: Any
    generalized_forces: tuple[Any, ...]
    mass_matrix: Any
    forcing: Any
    constraint_jacobian: Any
    constraint_forcing: Any
    constraints: tuple[Any, ...]
    equations: tuple[Equation, ...]
    reactions: tuple[Any, ...]
    definitions: tuple[tuple[Any, Any], ...]
    numbers: Mapping[Any, Any]
    steps: Derivation
    notation: Notation
    constants: Mapping[Any, float] = field(default_factory=dict)
    exerted: Any = None
    coupling: Any = None
    beside: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    dissipation: Any = None

    @property
    def operations(self) -> int:
        """The number of operations in M, f, H and gamma, each shared sub-expression counted once."""
        upper = [self.mass_matrix[i, j] for i in range(self.mass_matrix.rows) for j in range(i + 1)]
        parts = [*upper, *self.forcing, *self.constraint_jacobian, *self.constraint_forcing]
        parts += [] if self.exerted is None else [*self.exerted, *self.coupling]
        return self._counted(parts)

    @door
    def lambdify(self, result: str = "accelerations") -> Callable[..., Any]:
        """Return a NumPy function of (q, u, t=0, parameters=None): arrays (nq,), (nu,), a number, (np,).

        With result "accelerations" it returns udot (n,), with "terms" the arrays (M, f, H, gamma). Parameters are in
        the order of `symbols.parameters`, those of the declared start by default; inputs take their expressions.
        Raises InputError, as the function does for what is no real number and for wrong lengths.
        """
        if not isinstance(result, str) or result not in ("accelerations", "terms"):
            raise InputError(f"result is 'accelerations' or 'terms', got {shown(result)}", number="M120")
        return Lambdified(self, result, self._arguments, self._compiled())

    def _arguments(self, q: Any, u: Any, t: Any, parameters: Any) -> tuple[float, Floats, Floats, Floats]:
        """Return t, q, u, parameters as real numbers; raises InputError."""
        s = self.symbols
        declared = zip(s.parameters, parameter_values(self.mechanism, {}), strict=True)
        values = [self.constants.get(x, value) for x, value in declared] if parameters is None else parameters
        state, rates = vector("q", q, len(s.coordinates)), vector("u", u, len(s.speeds))
        return number("t", t), state, rates, vector("parameters", values, len(s.parameters))

    def _compiled(self) -> Callable[..., Any]:
        """Return the compiled function of (t, q, u, parameters); every symbol becomes a Dummy, whatever its name."""
        s = self.symbols
        inputs, numbers = declared_inputs(self.mechanism, s)
        parts = (self.mass_matrix, self.forcing, self.constraint_jacobian, self.constraint_forcing)
        parts += () if self.exerted is None else (self.exerted, self.coupling)
        groups = (s.coordinates, s.speeds, s.parameters)
        lists = [list(part) for part in parts]
        return numpy_function(s.time, groups, [*inputs, *self.definitions], {**self.numbers, **numbers}, lists)


@dataclass(frozen=True, eq=False, repr=False)
class Lambdified:
    """Equations as a NumPy function (see `SymbolicEquations.lambdify`); what a pickle holds is the equations."""

    equations: SymbolicEquations
    result: str
    given: Callable[..., Any]
    evaluate: Callable[..., Any]

    def __call__(
        self, q: Sequence[float], u: Sequence[float], t: float = 0.0, parameters: Sequence[float] | None = None
    ) -> Any:
        """Return udot (n,), or M, f, H, gamma; raises InputError."""
        n = len(self.equations.symbols.speeds)
        found = (np.array(x, dtype=float) for x in self.evaluate(*self.given(q, u, t, parameters)))
        M, f, H, gamma, *friction = found
        terms = M.reshape(n, n), f.reshape(n), H.reshape(-1, n), gamma.reshape(-1)
        if self.result == "terms":
            return terms
        exerted, coupling = (x.reshape(len(gamma), -1).tolist() for x in friction) if friction else ([], [])
        rubbing = Friction(exerted, coupling, self.equations.beside) if friction else None
        return _accelerations(*terms, rubbing)

    def __reduce__(self) -> tuple[Any, ...]:
        return SymbolicEquations.lambdify, (self.equations, self.result)


def _accelerations(M: Floats, f: Floats, H: Floats, gamma: Floats, friction: Friction | None) -> Floats:
    """Return udot of M udot = f + H^T lambda, H udot = gamma, whatever the rank of H; or of those with friction.

    Where rows hold freedoms without mass, M + w H^T H and f + w H^T gamma stand for M and f: same udot, regular matrix.
    """
    if not len(gamma):
        return np.asarray(np.linalg.solve(M, f), dtype=float)
    weight = np.trace(M) if rank(M, exact(M)) < len(M) else 0.0
    factors = factorized((M + weight * H.T @ H).tolist())
    forcing = (f + weight * H.T @ gamma).tolist()
    found = constrained(factors, forcing, H.tolist(), gamma.tolist(), in_floats, friction=friction)
    return np.array(found.udot, dtype=float)
