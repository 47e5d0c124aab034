"""First integrals of canonical equations: what the system conserves, with its expression in coordinates and momenta.

Which quantities these are, and the symmetry behind each, says `conserved`; here they get their expressions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, Final

import sympy

from multibody_sym.algebra.quotients import Budget, NoClosedFormError
from multibody_sym.algebra.simplify import Readable, WrittenOut, value_of
from multibody_sym.derivation.lagrange import known_nodes
from multibody_sym.derivation.legendre import BookForms
from multibody_sym.derivation.notation import Equation, Label, Step, upright
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, FirstIntegral
from multibody_sym.dynamics.start.start import start
from multibody_sym.dynamics.theorems.conserved import Candidate, Conserved, candidates, conserved, freedom_name
from multibody_sym.errors import ExpressionError, MultibodyError
from multibody_sym.scalars.node import Node

FIRST_INTEGRALS: Final = "First integrals"
_LARGEST: Final = 20_000
"""The denominator up to which a coefficient is taken for a fraction."""


def with_first_integrals(equations: CanonicalEquations, *, project: bool = False) -> CanonicalEquations:
    """Return the equations with the quantities that stay constant; none where there is no start to look from."""
    try:
        kept = conserved(equations.mechanism, start(equations.mechanism, project=project))
    except MultibodyError:
        return equations
    values = {each.name: each for each in candidates(equations.mechanism)}
    found = tuple(FirstIntegral(x.name, _expression(equations, x, values), x.symmetry) for x in kept)
    if not found:
        return equations
    shown = [Equation(_label(x.name), x.expression) for x in found if x.expression is not None]
    note = "\n".join(f"{x.name}: {x.symmetry}" for x in found)
    return replace(
        equations, first_integrals=found, steps=(*equations.steps, Step(FIRST_INTEGRALS, tuple(shown), note))
    )


def _label(name: str) -> Label:
    return Label(name, upright(name))


def _expression(equations: CanonicalEquations, kept: Conserved, values: Mapping[str, Candidate]) -> Any:
    """Return a conserved quantity in coordinates and momenta; None where it adds up along a run, or is too large."""
    parts = [(values[name], c) for name, c in kept.coefficients.items()]
    if any(part.kind == "energy" and part.place for part, _ in parts):
        return None
    total = sum((_of(equations, part) * _number(c) for part, c in parts), sympy.S.Zero)
    return None if total is sympy.nan else total


def _number(c: float) -> Any:
    exact = Fraction(c).limit_denominator(_LARGEST)
    return sympy.Rational(exact.numerator, exact.denominator) if abs(float(exact) - c) < 1e-12 else sympy.Float(c)


def _of(equations: CanonicalEquations, part: Candidate) -> Any:
    """Return a candidate in sympy, in momenta; nan where that would be too large."""
    hamilton = equations.method == "hamilton"
    if part.kind == "energy" and equations.energy is not None:
        return equations.energy
    if part.kind == "jacobi" and (hamilton or equations.energy is not None):
        return equations.function if hamilton else equations.energy
    momenta = {p.name: p for p in equations.momenta}
    if part.kind == "speed" and (hamilton or f"p_{_freedom(equations, part)}" in momenta):
        return equations.momenta[part.place] if hamilton else momenta[f"p_{_freedom(equations, part)}"]
    return sympy.nan if equations.definitions else _in_momenta(equations, part.value)


def _freedom(equations: CanonicalEquations, part: Candidate) -> str:
    return freedom_name(equations.mechanism, part.place)


def _in_momenta(equations: CanonicalEquations, node: Node) -> Any:
    """Return what a Node is in coordinates and momenta, as a book has it where exact quotients give that."""
    symbols, mechanism = equations.symbols, equations.mechanism
    circles = tuple(tuple(symbols.coordinates[k] for k in q) for b in mechanism.bodies for q in b.quaternions)
    readable = Readable(frozenset(symbols.speeds), circles)
    names = WrittenOut(symbols.free_prefix, Budget(), readable)
    (found,) = names.translated([node], known_nodes(mechanism, symbols))
    found = names.name(found).xreplace({symbol: value_of(number) for symbol, number in names.numbers.items()})
    found = readable(found.xreplace(dict(equations.speeds)))
    try:
        if circles:
            return found
        forms = BookForms([found])
        written = forms.written(forms.of(found))
    except (NoClosedFormError, ExpressionError):
        return found
    return written if written.count_ops() < found.count_ops() else found
