"""Closed-form equations for a reader: as text, as LaTeX, and as the data of `derive --json`."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any, Final

import sympy

from multibody_sym.derivation.notation import READABLE, Equation, Step, escaped
from multibody_sym.derivation.prepare import SIDES
from multibody_sym.derivation.symbolic_equations import CanonicalEquations, SymbolicEquations
from multibody_sym.derivation.theorems import CONSERVED
from multibody_sym.documents.formulas import (
    MathmlScript,
    elements,
    equation_lines,
    html_document,
    latex_document,
    mathml_script,
)
from multibody_sym.documents.notes import withheld_lines
from multibody_sym.mechanics.gears import reasons
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.scalars.sympy_bridge import from_sympy
from multibody_sym.text.printer import text as in_model_language

Equations = SymbolicEquations | CanonicalEquations
LONGEST: Final = 20_000
"""Operations past which equations are not printed: their size and the advice to take a recursive formalism are."""
_WIDTH: Final = 100


_ON_THE_WAY: Final = (
    "Coordinates", "Positions and velocities", "Momenta", "Their rates", "Gradient of T", "Gradient of V",
    "Speeds by momenta", "Matrix form",
)
"""Steps that no result needs."""


# --- text ----------------------------------------------------------------------------------------------------------


def derivation_text(equations: Equations, *, steps: bool = False) -> str:
    """Return T, V and the equations of motion as text; with `steps` the whole derivation."""
    if equations.operations > LONGEST:
        return f"{_headline(equations)}\n{advice(equations)}"
    shown = equations.steps if steps else _result(equations)
    shown = [*_withheld(equations), *shown]
    parts = [_headline(equations), *(_step_text(equations, step) for step in shown), _names_text(equations)]
    if equations.operations > READABLE:
        parts.append(advice(equations))
    return "\n\n".join(part for part in parts if part)


def advice(equations: Equations) -> str:
    """Return what to choose where closed forms are too long to be read."""
    return (
        f"{equations.operations} operations in {len(equations.definitions)} named sub-expressions: to simulate or to "
        "generate code choose a recursive formalism (--formalism composite_body or block_ldl)"
    )


def _headline(equations: Equations) -> str:
    routes = {
        "lagrange": "Lagrange's equations of the second kind",
        "multipliers": "Lagrange's equations with multipliers",
        "newton_euler": "Newton's and Euler's equations, body by body",
        "composite_body": "composite bodies and recursive Newton-Euler",
        "hamilton": "Hamilton's canonical equations",
        "routh": "Routh's equations without the cyclic coordinates",
    }
    return f"{equations.mechanism.name}: {routes[equations.method]}"


def _withheld(equations: Equations) -> list[Step]:
    """Return that reactions in the equations are not determined, because constraints do not say where they act."""
    withheld = equations.mechanism.withheld
    if equations.method != "newton_euler" or not withheld:
        return []
    first, *others = withheld_lines({name: x.components for name, x in withheld.items()}, reasons(withheld))
    as_if = "the equations have such a force drive each joint along its own axis"
    return [Step("Reactions", (), "\n".join([f"not determined: {first}; {as_if}", *others]))]


def _result(equations: Equations) -> list[Step]:
    """Return the steps that stand for the result: the energies, the loads, the constraints, the equations."""
    steps = [step for step in equations.steps if step.equations or step.title in (SIDES, CONSERVED)]
    return [step for step in steps if step.title not in _ON_THE_WAY]


def result_steps(equations: Equations, *, whole: bool = False) -> list[Step]:
    """Return the steps that are told, the names of sub-expressions last; `whole` all of them."""
    shown = [*_withheld(equations), *(equations.steps if whole else _result(equations))]
    if equations.definitions:
        shown.append(Step("Names", tuple(Equation(name, e) for name, e in equations.definitions)))
    return shown


def _step_text(equations: Equations, step: Step) -> str:
    lines = [f"    {line}" for e in step.equations for line in _equation_text(equations, e)]
    notes = [f"    {line}" for line in step.note.splitlines()]
    return "\n".join([step.title, *(notes if not lines else []), *lines, *(notes if lines else [])])


def _equation_text(equations: Equations, e: Equation) -> Iterator[str]:
    left, right = equations.notation.text(e.left), equations.notation.text(e.right)
    if not isinstance(e.right, sympy.MatrixBase) or len(left) + len(right) <= _WIDTH:
        yield f"{left} = {right}"
        return
    for i, j in _elements(e.right):
        yield f"{left}{_place(e.right, i, j)} = {equations.notation.text(e.right[i, j])}"


def _place(matrix: Any, i: int, j: int) -> str:
    if 1 not in matrix.shape:
        return f"[{i + 1},{j + 1}]"
    return f"[{max(i, j) + 1}]" if max(matrix.shape) > 1 else ""


def _elements(matrix: Any) -> list[tuple[int, int]]:
    """Return the places of a matrix's elements that are not zero; of a symmetric one those of the upper triangle."""
    half = matrix.rows > 1 and matrix.is_symmetric(simplify=False)
    places = [(i, j) for i in range(matrix.rows) for j in range(i if half else 0, matrix.cols)]
    return [(i, j) for i, j in places if matrix[i, j] != 0]


def _names_text(equations: Equations) -> str:
    write = equations.notation.text
    lines = [f"    {write(name)} = {write(e)}" for name, e in equations.definitions]
    return "\n".join(["where", *lines]) if lines else ""


# --- LaTeX ---------------------------------------------------------------------------------------------------------


def derivation_latex(equations: Equations, *, steps: bool = False) -> str:
    r"""Return the same as LaTeX for a document with amsmath: a \paragraph for each step."""
    if equations.operations > LONGEST:
        return rf"\paragraph{{{escaped(_headline(equations))}}} {escaped(advice(equations))}."
    shown = result_steps(equations, whole=steps)
    return "\n".join([f"% {_headline(equations)}", *(_step_latex(equations, step) for step in shown)]) + "\n"


def _step_latex(equations: Equations, step: Step) -> str:
    written = [
        " \\\\\n".join([f"  {first}", *(rf"  & \quad {other}" for other in others)])
        for first, *others in (equation_lines(equations.notation, e.left, e.right, "&") for e in step.equations)
    ]
    lines = " \\\\\n".join(written)
    body = f"\\begin{{align*}}\n{lines}\n\\end{{align*}}" if lines else ""
    note = r" \\ ".join(escaped(line) for line in step.note.splitlines())
    return "\n".join(part for part in (rf"\paragraph{{{escaped(step.title)}}}", body, note) if part)


def derivation_document(equations: Equations, *, steps: bool = False) -> str:
    """Return the same as a whole LaTeX document."""
    return latex_document(equations.mechanism.name, derivation_latex(equations, steps=steps))


# --- HTML ----------------------------------------------------------------------------------------------------------


def derivation_html(equations: Equations, *, steps: bool = False) -> str:
    """Return the same as a page of HTML that needs nothing beside it."""
    return html_document(_headline(equations), derivation_body(equations, steps=steps))


def derivation_body(equations: Equations, *, steps: bool = False) -> str:
    """Return the same as a part of a page of HTML."""
    if equations.operations > LONGEST:
        return f"<p>{escape(advice(equations))}</p>\n"
    shown = result_steps(equations, whole=steps)
    script = mathml_script(equations.notation)
    return "\n".join(_step_html(script, step) for step in shown) + "\n"


def _step_html(script: MathmlScript, step: Step) -> str:
    lines = [f'<p class="formula">{elements(script, e.left, e.right)}</p>' for e in step.equations]
    notes = [f"<p>{escape(line)}</p>" for line in step.note.splitlines()]
    return "\n".join([f"<h2>{escape(step.title)}</h2>", *lines, *notes])


# --- data ----------------------------------------------------------------------------------------------------------


def derivation_data(equations: Equations) -> dict[str, Any]:
    """Return everything as plain data: expressions in the model's own language, equations and steps as they are read.

    Equations and steps that nobody would read (past `LONGEST` operations) are left out.
    """
    shown = equations.operations <= LONGEST
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
        "steps": [_step(equations, step) for step in equations.steps if shown],
        "operations": equations.operations,
        "units": _units(equations.mechanism),
    }


def _in_speeds(equations: SymbolicEquations) -> dict[str, Any]:
    return {
        "reactions": [symbol.name for symbol in equations.reactions],
        "dissipation": None if equations.dissipation is None else _expression(equations, equations.dissipation),
        "mass_matrix": _matrix(equations, equations.mass_matrix),
        "forcing": [row[0] for row in _matrix(equations, equations.forcing)],
        "constraint_jacobian": _matrix(equations, equations.constraint_jacobian),
        "constraint_forcing": [row[0] for row in _matrix(equations, equations.constraint_forcing)],
        "letters": {s.name: equations.notation.text(s) for s in _forces(equations)},
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


def _forces(equations: SymbolicEquations) -> tuple[Any, ...]:
    """Return the symbols of unknown forces: multipliers, and reactions where bodies are cut free."""
    return (*equations.symbols.multipliers, *equations.reactions)


def _units(mechanism: Mechanism) -> dict[str, dict[str, str]]:
    """Return the SI units that are known of what the equations name."""
    told = MechanismUnits(mechanism)
    return {"state": told.state, "multipliers": told.multipliers, "parameters": told.parameters, "inputs": told.inputs}


def _expression(equations: Equations, e: Any) -> str:
    return in_model_language(from_sympy(e.xreplace(dict(equations.numbers))))


def _matrix(equations: Equations, matrix: Any) -> list[list[str]]:
    return [[_expression(equations, x) for x in row] for row in matrix.tolist()]


def _step(equations: Equations, step: Step) -> dict[str, Any]:
    return {"title": step.title, "note": step.note, "equations": [_equation(equations, e) for e in step.equations]}


def _equation(equations: Equations, e: Equation) -> dict[str, str]:
    write = equations.notation
    return {
        "text": f"{write.text(e.left)} = {write.text(e.right)}",
        "latex": f"{write.latex(e.left)} = {write.latex(e.right)}",
    }
