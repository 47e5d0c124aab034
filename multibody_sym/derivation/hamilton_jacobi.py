"""The Hamilton-Jacobi equation H(q, dW/dq) = E of Hamilton's equations, separated where that is possible.

    S = W - E t        W = sum of W_k(q_k), each with its constant        p_k = dW_k/dq_k

A cyclic coordinate has p_k = alpha_k. Another one separates where H = f + g F(q_k, p_k), with f and g of the others
alone: F = alpha_k stands in its place. Two coordinates separate also where a factor g makes g (H - E) a sum of a
function of each. The last one has H = E.

Source: Goldstein, Classical Mechanics, sections 10.1 to 10.4.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Final, NamedTuple

import sympy

from multibody_sym.derivation.notation import Equation, Label, Step, latex_name
from multibody_sym.derivation.symbolic_equations import CanonicalEquations

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
