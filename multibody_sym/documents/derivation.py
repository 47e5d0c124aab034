"""Closed-form equations for a reader: as a document, and as the data of `derive --json`."""

from __future__ import annotations

from typing import Any, Final

from multibody_sym.derivation.notation import READABLE, Equation
from multibody_sym.derivation.prepare import SIDES
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, SymbolicEquations
from multibody_sym.derivation.theorems import CONSERVED
from multibody_sym.documents.document import Document, EquationRows, PlainLines, Section
from multibody_sym.documents.notes import withheld_lines
from multibody_sym.mechanics.gears import reasons
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.scalars.sympy_bridge import from_sympy
from multibody_sym.text.printer import text as in_model_language

ClosedForm = SymbolicEquations | CanonicalEquations
_LONGEST: Final = 20_000
"""Operations past which equations are not printed: their size and the advice to take a recursive formalism are."""
_ROUTES: Final = {
    "lagrange": "Lagrange's equations of the second kind",
    "multipliers": "Lagrange's equations with multipliers",
    "newton_euler": "Newton's and Euler's equations, body by body",
    "composite_body": "composite bodies and recursive Newton-Euler",
    "hamilton": "Hamilton's canonical equations",
    "routh": "Routh's equations without the cyclic coordinates",
}
_ON_THE_WAY: Final = (
    "Coordinates", "Positions and velocities", "Momenta", "Their rates", "Gradient of T", "Gradient of V",
    "Speeds by momenta", "Matrix form",
)
"""Steps that no result needs."""


def derivation_document(equations: ClosedForm, *, steps: bool = False) -> Document:
    """Return the document of T, V and the equations of motion, with `steps` of the whole derivation.

    Equations past `_LONGEST` operations have no sections, but the advice to take a recursive formalism.
    """
    count = equations.operations
    advice = (
        f"{count} operations in {len(equations.definitions)} named sub-expressions: to simulate or to "
        "generate code choose a recursive formalism (--formalism composite_body or block_ldl)"
    )
    sections = _sections(equations, steps) if count <= _LONGEST else []
    return Document(
        equations.mechanism.name, _ROUTES[equations.method], tuple(sections), equations.notation,
        advice=advice if count > READABLE else "", run_in=True,
    )  # fmt: skip


def _sections(equations: ClosedForm, steps: bool) -> list[Section]:
    """Return which reactions are not determined, the steps, and the names of sub-expressions."""
    sections, withheld = [], equations.mechanism.withheld
    if equations.method == "newton_euler" and withheld:
        first, *others = withheld_lines({name: x.components for name, x in withheld.items()}, reasons(withheld))
        as_if = "the equations have such a force drive each joint along its own axis"
        sections.append(Section("Reactions", (PlainLines((f"not determined: {first}; {as_if}", *others)),)))
    for step in equations.steps:
        is_result = bool(step.equations) or step.title in (SIDES, CONSERVED)
        if steps or (is_result and step.title not in _ON_THE_WAY):
            rows = [EquationRows(step.equations)] if step.equations else []
            note = [PlainLines(tuple(step.note.splitlines()))] if step.note else []
            sections.append(Section(step.title, (*rows, *note)))
    if equations.definitions:
        names = EquationRows(tuple(Equation(name, e) for name, e in equations.definitions))
        sections.append(Section("Names", (names,), text_title="where"))
    return sections


def derivation_data(equations: ClosedForm) -> dict[str, Any]:
    """Return everything as plain data: expressions in the model's own language, equations and steps as they are read.

    Equations and steps that nobody would read (past `_LONGEST` operations) are left out.
    """
    shown = equations.operations <= _LONGEST
    units = MechanismUnits(equations.mechanism)
    own = _in_momenta(equations) if isinstance(equations, CanonicalEquations) else _in_speeds(equations)
    return {
        "method": equations.method,
        "coordinates": [c.name for c in equations.mechanism.coordinates],
        "speeds": [s.name for s in equations.mechanism.speeds],
        "multipliers": [row.name for row in equations.mechanism.rows],
        "kinetic_energy": _expression(equations, equations.kinetic_energy),
        "potential_energy": _expression(equations, equations.potential_energy),
        **own,
        "constants": {symbol.name: value for symbol, value in equations.constants.items()},
        "definitions": {str(name): _expression(equations, e) for name, e in equations.definitions},
        "equations": [_equation(equations, e) for e in equations.equations if shown],
        "steps": [
            {"title": x.title, "note": x.note, "equations": [_equation(equations, e) for e in x.equations]}
            for x in equations.steps
            if shown
        ],
        "operations": equations.operations,
        "units": {
            "state": units.state,
            "multipliers": units.multipliers,
            "parameters": units.parameters,
            "inputs": units.inputs,
        },
    }


def _in_speeds(equations: SymbolicEquations) -> dict[str, Any]:
    unknown = (*equations.symbols.multipliers, *equations.reactions)
    return {
        "reactions": [symbol.name for symbol in equations.reactions],
        "dissipation": None if equations.dissipation is None else _expression(equations, equations.dissipation),
        "mass_matrix": _matrix(equations, equations.mass_matrix),
        "forcing": [row[0] for row in _matrix(equations, equations.forcing)],
        "constraint_jacobian": _matrix(equations, equations.constraint_jacobian),
        "constraint_forcing": [row[0] for row in _matrix(equations, equations.constraint_forcing)],
        "state_rates": [_expression(equations, x) for x in equations.state_rates],
        "letters": {s.name: equations.notation.text(s) for s in unknown},
        "withheld": {name: list(x.components) for name, x in equations.mechanism.withheld.items()},
        "withheld_reasons": reasons(equations.mechanism.withheld),
    }


def _in_momenta(equations: CanonicalEquations) -> dict[str, Any]:
    """Return the momenta, H or R, what speeds are in momenta, the rates (Hamilton) and the first integrals."""
    word = "hamiltonian" if equations.method == "hamilton" else "routhian"
    potential = equations.effective_potential
    return {
        "momenta": [p.name for p in equations.momenta],
        word: _expression(equations, equations.function),
        **({} if potential is None else {"effective_potential": _expression(equations, potential)}),
        "speeds_by_momenta": {u.name: _expression(equations, e) for u, e in equations.speeds.items()},
        "rates": [[_expression(equations, e) for e in part] for part in equations.rates],
        "constraints": [_expression(equations, e) for e in equations.constraints],
        "first_integrals": [
            {
                "name": x.name,
                "expression": None if x.expression is None else _expression(equations, x.expression),
                "symmetry": x.symmetry,
            }
            for x in equations.first_integrals
        ],
    }


def _expression(equations: ClosedForm, e: Any) -> str:
    return in_model_language(from_sympy(e.xreplace(dict(equations.numbers))))


def _matrix(equations: ClosedForm, matrix: Any) -> list[list[str]]:
    return [[_expression(equations, x) for x in row] for row in matrix.tolist()]


def _equation(equations: ClosedForm, e: Equation) -> dict[str, str]:
    write = equations.notation
    return {
        "text": f"{write.text(e.left)} = {write.text(e.right)}",
        "latex": f"{write.latex(e.left)} = {write.latex(e.right)}",
    }
