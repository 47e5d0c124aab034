"""Equations of motion in sympy, as records to be read, shown in a notebook, or evaluated with NumPy.

SymbolicEquations are in speeds, CanonicalEquations in momenta, by Hamilton or Routh.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from itertools import chain
from typing import Any, Final, NamedTuple

import numpy as np
import sympy
from numpy.typing import ArrayLike

from multibody_sym.algebra.quotients import Budget
from multibody_sym.algebra.simplify import Subexpressions, value_of
from multibody_sym.derivation.notation import (
    Equation,
    Label,
    ReadableEquations,
    Step,
    Symbols,
    latex_name,
)
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

    mass_matrix: Any
    forcing: Any
    constraint_jacobian: Any
    constraint_forcing: Any
    constraints: tuple[Any, ...]
    reactions: tuple[Any, ...]
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

    momenta: tuple[Any, ...]
    function: Any
    speeds: Mapping[Any, Any]
    rates: tuple[tuple[Any, ...], tuple[Any, ...]]
    constraints: tuple[Any, ...]
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


# ----------------------------------------------------------------------------------------------------------------------
# The Hamilton-Jacobi equation H(q, dW/dq) = E of Hamilton's equations, separated where that is possible.
#
#     S = W - E t        W = sum of W_k(q_k), each with its constant        p_k = dW_k/dq_k
#
# A cyclic coordinate has p_k = alpha_k. Another one separates where H = f + g F(q_k, p_k), with f and g of the others
# alone: F = alpha_k stands in its place. Two coordinates separate also where a factor g makes g (H - E) a sum of a
# function of each. The last one has H = E.
#
# Source: Goldstein, Classical Mechanics, sections 10.1 to 10.4.



_LONGEST: Final = 300
"""Operations of a Hamiltonian whose separation is looked for."""
ENERGY: Final = sympy.Symbol("energy of W", real=True)


class Separated(NamedTuple):
    """A coordinate with its momentum, and the equation left = right that contains no other one."""

    coordinate: Any
    momentum: Any
    left: Any
    right: Any

    @property
    def slope(self) -> Any:
        """p by the coordinate, with the positive root; None where that is of no second degree or less."""
        rest = sympy.Poly(sympy.expand(self.left - self.right), self.momentum)
        if rest.degree() == 1:
            return sympy.solve(rest.as_expr(), self.momentum)[0]
        a, b, c = (rest.coeff_monomial(self.momentum**n) for n in (2, 1, 0))
        if rest.degree() != 2 or b != 0:
            return None
        return sympy.sqrt(sympy.expand(-c / a))


def with_separation(equations: CanonicalEquations) -> CanonicalEquations:
    """Return equations with a step for the Hamilton-Jacobi equation; as they are where energy is not conserved."""
    symbols, H = equations.symbols, equations.function
    paired = len(symbols.coordinates) == len(symbols.speeds) == len(equations.momenta)
    timed = symbols.time in H.free_symbols
    if equations.method != "hamilton" or not paired or equations.constraints or equations.definitions or timed:
        return equations
    if any(x != 0 for x in equations.generalized_forces) or H.count_ops() > _LONGEST:
        return equations
    parts = separated(H, [*zip(symbols.coordinates, equations.momenta, strict=True)])
    names = {ENERGY: "E", **{_constant(q): f"alpha_{q.name}" for q in symbols.coordinates}}
    notation, taken = equations.notation, {label.text for label in equations.notation.spelling.values()}
    spelling = {x: name if name not in taken else f"{name}_" for x, name in names.items()}
    spelt = {**notation.spelling, **{x: Label(name, latex_name(name)) for x, name in spelling.items()}}
    first = min(place for place, _ in notation.places.values())
    places = {**notation.places, **{x: (first, -1 - k) for k, x in enumerate(names)}}
    steps = (*equations.steps, _step(H, parts, spelling[ENERGY]))
    return replace(equations, steps=steps, notation=replace(notation, spelling=spelt, places=places))


def separated(H: Any, pairs: list[tuple[Any, Any]]) -> list[Separated]:
    """Return the separated equations of a Hamiltonian in (q, p); empty where no separation is found."""
    left, waiting, found = sympy.expand(H), list(pairs), list[Separated]()
    while waiting:
        part = next(_peeled(left, waiting), None)
        if part is None:
            break
        each, left = part
        found.append(each)
        waiting = [pair for pair in waiting if pair[0] != each.coordinate]
    if not waiting:
        return found
    together = _by_a_factor(left, waiting) if len(waiting) == 2 else []
    return [*found, *together] if together else []


def _constant(q: Any) -> Any:
    return sympy.Symbol(f"constant of {q.name}", real=True)


def _peeled(left: Any, waiting: list[tuple[Any, Any]]) -> Iterator[tuple[Separated, Any]]:
    """Yield each coordinate that separates by itself, and what is left of H with its constant in the place of F."""
    for q, p in waiting:
        others = {x for pair in waiting if pair[0] != q for x in pair}
        dependent = sympy.Add(*(x for x in sympy.Add.make_args(left) if x.has(q, p)))
        rest, alpha = left - dependent, _constant(q)
        if not dependent.has(q):
            yield Separated(q, p, p, alpha), left.xreplace({p: alpha})
            continue
        if not others:
            yield Separated(q, p, left, ENERGY), sympy.S.Zero
            continue
        factor, own = sympy.factor(dependent).as_independent(q, p, as_Add=False)
        if not factor.has(*others):
            factor, own = sympy.S.One, dependent
        if not own.has(*others) and own.has(p):
            yield Separated(q, p, sympy.expand(own), alpha), sympy.expand(rest + factor * alpha)


def _by_a_factor(left: Any, waiting: list[tuple[Any, Any]]) -> list[Separated]:
    """Return both equations where a factor makes H - E a sum of a function of each; empty where none does."""
    (q, p), (r, s) = waiting
    over = sympy.fraction(sympy.together(left))[1]
    for factor in (over, *sympy.Mul.make_args(sympy.factor(over))):
        terms = sympy.Add.make_args(sympy.expand(sympy.cancel(factor * (left - ENERGY))))
        mixed = [x for x in terms if x.has(q, p) and x.has(r, s)]
        if not mixed:
            own = sympy.Add(*(x for x in terms if x.has(q, p)))
            return [
                Separated(q, p, own, _constant(q)),
                Separated(r, s, sympy.Add(*terms, -own), -_constant(q)),
            ]
    return []


def _step(H: Any, parts: list[Separated], energy: str) -> Step:
    """Return the step: the equation, the separated ones, and each momentum as a slope of W."""
    shown = [Equation(H, ENERGY)]
    if not parts:
        note = "p_k = dW/dq_k; no separation in these coordinates is found"
        return Step("Hamilton-Jacobi equation", tuple(shown), note)
    for each in parts:
        if each.left not in (each.momentum, H):
            shown.append(Equation(each.left, each.right))
        slope = each.slope
        name = each.coordinate.name
        if slope is not None:
            latex = rf"\mathrm{{d}} W_{{{latex_name(name)}}}/\mathrm{{d}} {latex_name(name)}"
            shown.append(Equation(Label(f"dW_{name}/d{name}", latex), slope))
    names = " + ".join(f"W_{each.coordinate.name}({each.coordinate.name})" for each in parts)
    note = f"p_k = dW/dq_k, S = W - {energy}*t, W = {names}, each with its constant"
    return Step("Hamilton-Jacobi equation", tuple(shown), note)
