"""Equations of motion in sympy, as records to be read, shown in a notebook, or evaluated with NumPy.

SymbolicEquations are in speeds, CanonicalEquations in momenta, by Hamilton or Routh.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import partial
from itertools import chain
from typing import Any

import numpy as np
import sympy
from numpy.typing import ArrayLike

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions, value_of
from multibody_sym.derivation.notation import Derivation, Equation, Notation, ReadableEquations, Symbols
from multibody_sym.dynamics.formalisms.constrained import in_floats, solve_constrained
from multibody_sym.dynamics.formalisms.equations import FrictionTerms
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, ModelError, short_repr
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.model.argument_checks import door
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import number, vector
from multibody_sym.scalars.rank import exact, rank
from multibody_sym.scalars.sympy_bridge import TableFunction
from multibody_sym.scalars.tabulated import Tabulated
from multibody_sym.scalars.vectors import factorize

# --- expressions as a NumPy function, in which every symbol is a Dummy: no name becomes code -------------------------


def declared_inputs(mechanism: Mechanism, symbols: Symbols) -> tuple[list[tuple[Any, Any]], dict[Any, Any]]:
    """Return the inputs of a mechanism as definitions, each after those that it names, and the numbers in them."""
    declared = Subexpressions("input ", Budget())
    inputs = declared.translated(list(mechanism.inputs.values()), symbols.slots)
    definitions = [*declared.definitions.items(), *zip(symbols.inputs, inputs, strict=True)]
    return definitions, {symbol: value_of(node) for symbol, node in declared.numbers.items()}


def numpy_function(
    time: Any,
    groups: Sequence[Sequence[Any]],
    definitions: Sequence[tuple[Any, Any]],
    numbers: Mapping[Any, Any],
    lists: Sequence[Sequence[Any]],
) -> Callable[..., Any]:
    """Return the function of time and of groups of symbols that gives lists of expressions.

    `definitions`: named parts of them, each after those that it names; `numbers`: symbols that stand for constants.
    """
    given = (time, *(x for group in groups for x in group))
    dummies = {x: sympy.Dummy() for x in (*given, *(x for x, _ in definitions))}
    replaced = {**{symbol: sympy.Float(float(value)) for symbol, value in numbers.items()}, **dummies}
    shared = [(dummies[x], e.xreplace(replaced)) for x, e in definitions]
    wanted = [[x.xreplace(replaced) for x in part] for part in lists]
    arguments = [dummies[time], *([dummies[x] for x in group] for group in groups)]
    expressions = [*(e for _, e in shared), *chain(*wanted)]
    functions = dict.fromkeys(part.func for e in expressions for part in e.atoms(TableFunction))
    own = {f: sympy.Function(f"table_{k}") for k, f in enumerate(functions, 1)}
    shared = [(x, _replace_functions(e, own)) for x, e in shared]
    wanted = [[_replace_functions(e, own) for e in part] for part in wanted]
    tables = {stand_in.__name__: partial(_table_values, *f.own) for f, stand_in in own.items()}
    compiled: Callable[..., Any] = sympy.lambdify(
        arguments, wanted, modules=[tables, "numpy"], cse=lambda expressions: (shared, list(expressions))
    )
    return compiled


def _replace_functions(expression: Any, own: Mapping[Any, Any]) -> Any:
    for f, stand_in in own.items():
        expression = expression.replace(f, stand_in)
    return expression


def _table_values(function: Tabulated, order: int, at: ArrayLike) -> Any:
    return np.reshape(function.values(order, np.ravel(at).tolist()), np.shape(at))


# --- equations in speeds ---------------------------------------------------------------------------------------------


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
    `state_rates` are those of the declared states, which are the last of `symbols.coordinates`.

    Where something slides or joints rub, `exerted` C (s x n) stands for H and `coupling` D (s x s) is added in
    M udot = f + C^T lambda, H udot + D lambda = gamma; else both are None. Rows `beside` others exert their force times
    their part of the direction of the vector of all their multipliers.
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
    state_rates: tuple[Any, ...] = ()

    @property
    def operations(self) -> int:
        """The number of operations in M, f, H, gamma and rates of states, each shared sub-expression counted once."""
        upper = [self.mass_matrix[i, j] for i in range(self.mass_matrix.rows) for j in range(i + 1)]
        parts = [*upper, *self.forcing, *self.constraint_jacobian, *self.constraint_forcing]
        parts += [*self.state_rates, *([] if self.exerted is None else [*self.exerted, *self.coupling])]
        return self._counted(parts)

    @door
    def lambdify(self, result: str = "accelerations") -> Callable[..., Any]:
        """Return a NumPy function of (q, u, t=0, parameters=None): arrays (nq,), (nu,), a number, (np,).

        With result "accelerations" it returns udot (n,), with "terms" the arrays (M, f, H, gamma). Parameters are in
        the order of `symbols.parameters`, those of the declared start by default; inputs take their expressions.
        Raises InputError, as the function does for what is no real number and for wrong lengths.
        """
        if not isinstance(result, str) or result not in ("accelerations", "terms"):
            raise InputError(f"result is 'accelerations' or 'terms', got {short_repr(result)}", number="M120")
        s = self.symbols
        inputs, numbers = declared_inputs(self.mechanism, s)
        parts = (self.mass_matrix, self.forcing, self.constraint_jacobian, self.constraint_forcing)
        parts += () if self.exerted is None else (self.exerted, self.coupling)
        groups = (s.coordinates, s.speeds, s.parameters)
        lists = [list(part) for part in parts]
        definitions = [*inputs, *self.definitions]
        return Lambdified(
            self, result, numpy_function(s.time, groups, definitions, {**self.numbers, **numbers}, lists)
        )


@dataclass(frozen=True, eq=False, repr=False)
class Lambdified:
    """Equations as a NumPy function (see `SymbolicEquations.lambdify`); a pickle holds the equations."""

    equations: SymbolicEquations
    result: str
    evaluate: Callable[..., Any]

    def __call__(
        self, q: Sequence[float], u: Sequence[float], t: float = 0.0, parameters: Sequence[float] | None = None
    ) -> Any:
        """Return udot (n,), or M, f, H, gamma; raises InputError."""
        s = self.equations.symbols
        n = len(s.speeds)
        values = _parameters(self.equations, parameters)
        given = vector("q", q, len(s.coordinates)), vector("u", u, n)
        lists = self.evaluate(number("t", t), *given, vector("parameters", values, len(s.parameters)))
        M, f, H, gamma, *friction = (np.array(x, dtype=float) for x in lists)
        terms = M.reshape(n, n), f.reshape(n), H.reshape(-1, n), gamma.reshape(-1)
        if self.result == "terms":
            return terms
        exerted, coupling = (x.reshape(len(gamma), -1).tolist() for x in friction) if friction else ([], [])
        rubbing = FrictionTerms(exerted, coupling, self.equations.beside) if friction else None
        return _accelerations(*terms, rubbing)

    def __reduce__(self) -> tuple[Any, ...]:
        return SymbolicEquations.lambdify, (self.equations, self.result)


def _parameters(equations: SymbolicEquations | CanonicalEquations, given: Any) -> Any:
    """Return the given parameters, or those of the declared start with its measured constants."""
    declared = zip(equations.symbols.parameters, parameter_values(equations.mechanism, {}), strict=True)
    return [equations.constants.get(x, value) for x, value in declared] if given is None else given


def _accelerations(M: Floats, f: Floats, H: Floats, gamma: Floats, friction: FrictionTerms | None) -> Floats:
    """Return udot of M udot = f + H^T lambda, H udot = gamma, whatever the rank of H; or of those with friction.

    Where rows hold freedoms without mass, M + w H^T H and f + w H^T gamma stand for M and f: same udot, regular matrix.
    """
    if not len(gamma):
        return np.asarray(np.linalg.solve(M, f), dtype=float)
    weight = np.trace(M) if rank(M, exact(M)) < len(M) else 0.0
    factors = factorize((M + weight * H.T @ H).tolist())
    forcing = (f + weight * H.T @ gamma).tolist()
    found = solve_constrained(factors, forcing, H.tolist(), gamma.tolist(), in_floats, friction=friction)
    return np.array(found.udot, dtype=float)


# --- equations in momenta --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FirstIntegral:
    """A conserved quantity: its `name` in outputs, its `expression` in q and p (sympy, or None), and its `symmetry`."""

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
        s = self.symbols
        inputs, numbers = declared_inputs(self.mechanism, s)
        definitions = in_order({**dict(inputs), **dict(self.definitions), **self.speeds})
        groups = (s.coordinates, self.momenta, s.parameters)
        evaluate = numpy_function(s.time, groups, definitions, {**self.numbers, **numbers}, self.rates)
        return LambdifiedCanonical(self, evaluate)

    def _ordered(self) -> list[tuple[Any, Any]]:
        """Return definitions and speeds in an order in which they can be evaluated."""
        return in_order({**dict(self.definitions), **self.speeds})


@dataclass(frozen=True, eq=False, repr=False)
class LambdifiedCanonical:
    """Hamilton's equations as a NumPy function (see `CanonicalEquations.lambdify`); a pickle holds the equations."""

    equations: CanonicalEquations
    evaluate: Callable[..., Any]

    def __call__(
        self, q: Sequence[float], p: Sequence[float], t: float = 0.0, parameters: Sequence[float] | None = None
    ) -> tuple[Floats, Floats]:
        """Return qdot (nq,), pdot (nu,); raises InputError."""
        s, values = self.equations.symbols, _parameters(self.equations, parameters)
        state, momenta = vector("q", q, len(s.coordinates)), vector("p", p, len(self.equations.momenta))
        qdot, pdot = self.evaluate(number("t", t), state, momenta, vector("parameters", values, len(s.parameters)))
        return np.array(qdot, dtype=float), np.array(pdot, dtype=float)

    def __reduce__(self) -> tuple[Any, ...]:
        return CanonicalEquations.lambdify, (self.equations,)


def in_order(definitions: Mapping[Any, Any]) -> list[tuple[Any, Any]]:
    """Return definitions so that each rests on earlier ones alone."""
    found: dict[Any, Any] = {}
    for first in definitions:
        stack = [first]
        while stack:
            name = stack[-1]
            needed = sorted(definitions[name].free_symbols, key=str) if name not in found else []
            before = [s for s in needed if s in definitions and s not in found]
            if before:
                stack.extend(before)
                continue
            stack.pop()
            found.setdefault(name, definitions[name])
    return list(found.items())
