"""CanonicalEquations: equations of motion in momenta, by Hamilton or Routh, to be read, shown or evaluated."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy

from multibody_sym.algebra.budget import Budget
from multibody_sym.algebra.subexpressions import Subexpressions, needed, value_of
from multibody_sym.dynamics.derivation.notation import Notation
from multibody_sym.dynamics.derivation.numpy_function import numpy_function
from multibody_sym.dynamics.derivation.record import Derivation, Equation
from multibody_sym.dynamics.derivation.symbolic_equations import READABLE
from multibody_sym.dynamics.derivation.symbols import Symbols
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import ArgumentError, ModelError, shown
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.numbers import number, vector


@dataclass(frozen=True)
class FirstIntegral:
    """A quantity that stays constant: its `name` in outputs, its `expression` (sympy; None where it has none in q and
    p), and the `symmetry` behind it."""

    name: str
    expression: Any
    symmetry: str


@dataclass(frozen=True)
class CanonicalEquations:
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
        definitions = dict(self.definitions)
        return sum(int(e.count_ops()) for e in (*parts, *(definitions[s] for s in needed(definitions, parts))))

    def explicit(self, expression: Any) -> Any:
        """Return an expression in q, p and the speeds that are kept, with what every name stands for in its place."""
        if not isinstance(expression, (sympy.Basic, sympy.MatrixBase)):
            raise ArgumentError(f"expected an expression or matrix of sympy, got {shown(expression)}")
        known = dict(self.numbers)
        definitions = dict(self._ordered())
        for name in needed(definitions, [expression]):
            known[name] = definitions[name].xreplace(known)
        return expression.xreplace(known)

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
        declared = Subexpressions("input ", Budget())
        inputs = declared.translated(list(self.mechanism.inputs.values()), s.slots)
        given_inputs = dict(zip(s.inputs, inputs, strict=True))
        numbers = {**self.numbers, **{symbol: value_of(node) for symbol, node in declared.numbers.items()}}
        definitions = in_order({**declared.definitions, **given_inputs, **dict(self.definitions), **self.speeds})
        return numpy_function(s.time, (s.coordinates, self.momenta, s.parameters), definitions, numbers, self.rates)

    def __repr__(self) -> str:
        return f"<CanonicalEquations of {self.mechanism.name} by {self.method}: {self.operations} operations>"

    def __str__(self) -> str:
        """Return the equations as text, one a line; names first."""
        write = self.notation.text
        named = [f"{write(name)} = {write(e)}" for name, e in self.definitions]
        return "\n".join([*named, *(f"{write(e.left)} = {write(e.right)}" for e in self.equations)])

    def _repr_latex_(self) -> str:
        """Return what a notebook shows: the equations, or their size where nobody would read them."""
        if self.operations > READABLE:
            size = rf"\text{{{self.operations} operations in {len(self.definitions)} named sub-expressions}}"
            return rf"$\displaystyle {size}$"
        write = self.notation.latex
        lines = [rf"{write(name)} &= {write(e)}" for name, e in self.definitions]
        lines += [rf"{write(e.left)} &= {write(e.right)}" for e in self.equations]
        return r"$\displaystyle \begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}$"


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
