"""What notebooks show of results: figures, formulas and tables, by the type of each.

`SHOWN` is registered with IPython by the names of types, so that no layer below knows how it is written.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import Any, Final, NamedTuple

from multibody_sym.derivation.notation import dotted, latex_name
from multibody_sym.errors import MultibodyError
from multibody_sym.pictures.page.files import svg
from multibody_sym.text.values import SI, Value

_ROUNDING: Final = 1e-12
_GREEN, _RED = "#1a7f37", "#cf222e"
_LONGEST: Final = 400
"""A formula longer than this is left out for its number: nobody would read it."""


class ShownType(NamedTuple):
    """How a type is shown: as text/html or text/markdown, by the function of this module with that name."""

    module: str
    name: str
    kind: str
    function: str


SHOWN: Final = (
    ShownType("multibody_sym.model.system", "System", "text/html", "system_html"),
    ShownType("multibody_sym.motion.results.trajectory", "Trajectory", "text/html", "run_html"),
    ShownType("multibody_sym.text.tables", "Table", "text/html", "table_html"),
    ShownType("multibody_sym.answers.records", "Solution", "text/markdown", "solution_markdown"),
    ShownType("multibody_sym.analysis.linearize", "Linearization", "text/markdown", "linearization_markdown"),
    ShownType("multibody_sym.analysis.equilibrium", "Equilibrium", "text/markdown", "equilibrium_markdown"),
    ShownType("multibody_sym.dynamics.redundancy", "Redundancy", "text/html", "redundancy_html"),
    ShownType("multibody_sym.analysis.rest.range_of_rest", "RangeOfRest", "text/html", "rest_html"),
    ShownType("multibody_sym.analysis.rest.range_of_rest", "LeastForMotion", "text/html", "least_html"),
    ShownType("multibody_sym.analysis.linearize", "Multipliers", "text/html", "multipliers_html"),
    ShownType("multibody_sym.analysis.check", "CheckReport", "text/html", "check_html"),
    ShownType("multibody_sym.answers.records", "Worked", "text/html", "worked_html"),
    ShownType("multibody_sym.motion.sweep.study", "Study", "text/html", "study_html"),
)


def register(formatters: Mapping[str, Any]) -> None:
    """Register what is shown with the formatters of an IPython shell, by the kind of output."""
    for each in SHOWN:
        formatters[each.kind].for_type_by_name(each.module, each.name, _shower(each.function))


def _shower(name: str) -> Callable[[Any], str | None]:
    def show(found: Any) -> str | None:
        function: Callable[[Any], str | None] = globals()[name]
        return function(found)

    return show


# --- figures and text ------------------------------------------------------------------------------------------------


def system_html(system: Any) -> str:
    """Return the figure of a system at its start; where there is none, what it has."""
    from multibody_sym.documents.draw import draw

    try:
        figure = draw(system)
    except MultibodyError:
        return _text(repr(system))
    return svg(figure.picture, alone=False)


def run_html(run: Any) -> str:
    """Return the summary of a run and, where matplotlib is there, its plot."""
    from multibody_sym.documents.runs import run_summary

    return _text(run_summary(run)) + _plot(run, f"{run.ready.told.name} over time")


def study_html(study: Any) -> str:
    """Return the first and last runs of a study and, where it has one, its plot; why runs failed stands below."""
    from multibody_sym.motion.sweep.study import study_summary

    known = study.about.get("units", {})
    units = {name: known.get(name.removesuffix(" end").removesuffix(" min").removesuffix(" max")) for name in study}
    columns = {SI.named(name, units[name] or ""): study[name] for name in (*study.varied, *study.results)}
    failed = study_summary(study).partition(" runs failed:\n")
    told = _text(f"{len(study.failures)}{failed[1]}{failed[2]}") if failed[1] else ""
    over = f"{study.about['system']} over {', '.join(study.varied)}"
    return _rows_html(columns, len(study), "runs") + told + _plot(study, over)


def _plot(found: Any, words: str) -> str:
    """Return the plot of a result as an image, nothing where there is none or matplotlib is missing."""
    try:
        image = base64.b64encode(found.plot()._repr_png_()).decode()
    except MultibodyError:
        return ""
    return f'<img alt="{escape(words)}" src="data:image/png;base64,{image}">'


def table_html(table: Any) -> str:
    """Return the first and last rows of a table, with units."""
    rows = table.labelled()
    return _rows_html(rows.columns, len(rows), "rows")


def _rows_html(columns: Mapping[str, Any], count: int, words: str) -> str:
    shown = [*range(min(5, count)), *range(max(5, count - 5), count)]
    lines = [[f"{values[k]:.6g}" for values in columns.values()] for k in shown]
    if count > len(shown):
        lines.insert(5, ["..."] * len(columns))
    return f"{_cells_html(list(columns), lines)}<p>{count} {words}</p>"


def _cells_html(head: Iterable[str], lines: Iterable[Iterable[str]]) -> str:
    cells = "".join(f"<tr>{''.join(f'<td>{escape(x)}</td>' for x in line)}</tr>" for line in lines)
    return f"<table><tr>{''.join(f'<th>{escape(name)}</th>' for name in head)}</tr>{cells}</table>"


def redundancy_html(found: Any) -> str:
    """Return which constraints are redundant."""
    from multibody_sym.documents.notes import redundancy_lines

    return _text("\n".join(redundancy_lines(found)) or f"no redundant constraints (rank {found.rank})")


def rest_html(found: Any) -> str:
    """Return the values of a parameter at which rest is possible."""
    from multibody_sym.documents.analysis import rest_text

    return _text(rest_text(found))


def least_html(found: Any) -> str:
    """Return the least value of a parameter that moves a system, and where it is least."""
    from multibody_sym.documents.analysis import least_text

    return _text(least_text(found))


def multipliers_html(found: Any) -> str:
    """Return by what one period multiplies deviations."""
    from multibody_sym.documents.analysis import multipliers_text

    return _text(multipliers_text(found))


def check_html(found: Any) -> str:
    """Return the verdict, residuals of formalisms and theorems as tables, and the other lines of the report."""
    from multibody_sym.documents.solution import check_text

    verdict, *lines = check_text(found).splitlines()
    lines = [line for line in lines if not line.startswith(("formalisms (", "theorems ("))]
    residuals = [(name, f"{x:.2g}") for name, x in found.agreement.items()]
    misses = [(name.replace("_", " "), f"{x:.1e}") for name, x in found.theorems.items()]
    tables = [
        _cells_html(head, rows)
        for head, rows in ((("formalism", "scaled residual"), residuals), (("theorem", "relative residual"), misses))
        if rows
    ]
    colour = _GREEN if found.agrees else _RED
    return f'<p style="color: {colour}"><b>{escape(verdict)}</b></p>' + _text("\n".join(lines)) + "".join(tables)


def worked_html(found: Any) -> str:
    """Return a solution step by step, with formulas in MathML."""
    from multibody_sym.documents.document import HtmlWriter, worked_document

    return HtmlWriter(found.notation, level=4).body(worked_document(found))


def _text(lines: str) -> str:
    return f'<pre style="white-space: pre-wrap">{escape(lines)}</pre>'


# --- formulas --------------------------------------------------------------------------------------------------------


def solution_markdown(found: Any) -> str:
    """Return accelerations, forces, conditions and answers as formulas with their numbers."""
    each = [
        (rf"\text{{{_plain(name)}}}\ \text{{{_plain(part.replace('_', ' '))}}}", x)
        for name, parts in found.reactions.items()
        for part, x in parts.items()
    ]
    least = _ROUNDING * max((abs(x.value or 0.0) for _, x in each), default=0.0)
    forces = [(letters, x) for letters, x in each if abs(x.value or 0.0) > least or not x.unique]
    dots = {name: "ddot" if name in found.coordinates else "dot" for name in found.accelerations}
    lines = {
        "Answers": [(latex_name(name), x) for name, x in found.answers.items()],
        "Accelerations": [(dotted(latex_name(name), dots[name]), x) for name, x in found.accelerations.items()],
        "Rates": [(dotted(latex_name(name), "dot"), x) for name, x in found.rates.items()],
        "Forces": forces,
        "Where": [(latex_name(name), Value(x.value, x.expression, x.unit)) for name, x in found.where.items()],
    }
    sections = {title: [_equation(left, x, found.labels) for left, x in each] for title, each in lines.items()}
    state = [f"*{_plain(', '.join(found.found))}*"] if found.found else []
    where = [f"**Conditions**: {', '.join(f'`{each}`' for each in found.conditions)}"] if found.conditions else []
    if found.impact is not None:
        from multibody_sym.documents.solution import solution_text

        return f"```\n{solution_text(found)}\n```"
    aligned = {title: r" \\ ".join(lines) for title, lines in sections.items() if lines}
    blocks = [
        rf"**{title}**" + "\n\n" + rf"$$\begin{{aligned}}{rows}\end{{aligned}}$$" for title, rows in aligned.items()
    ]
    equations = [f"`{name}` from `{one.formula}`" for name, one in found.where.items() if one.equation is not None]
    blocks += [", ".join(equations)] if equations else []
    return "\n\n".join([f"**{_plain(found.name)}** at t = 0", *state, *blocks, *where])


def _equation(left: str, value: Value, labels: Mapping[str, str]) -> str:
    from multibody_sym.analysis.modes.record import node_latex

    number = Value(value.value, None, "", value.unique, error=value.error).told()
    parts = [rf"{number}\ \mathrm{{{value.unit}}}" if value.unit else rf"\text{{{number}}}"]
    formula = "" if value.expression is None else node_latex(value.expression, labels)
    if formula and len(formula) <= _LONGEST and formula != number:
        parts.insert(0, formula)
    return f"{left} &= {' = '.join(parts)}"


def linearization_markdown(found: Any) -> str:
    """Return x' = A x + B w with the matrices, and the eigenvalues."""
    if not found.states:
        return "nothing is free to move: there are no states"
    x, A = _column(latex_name(name) for name in found.states), _matrix(found.A.tolist())
    by = rf" + {_matrix(found.B.tolist())} {_column(latex_name(name) for name in found.inputs)}" if found.inputs else ""
    rates = rf"$$\frac{{d}}{{dt}} {x} = {A} {x}{by}$$"
    if not found.steady:
        return f"{rates}\n\nA is not constant: it has no eigenvalues that tell the motion"
    values = [["eigenvalue [1/s]", "frequency [Hz]", "damping ratio"]]
    for x in found.eigenvalues:
        if x.imag == 0:
            values.append([f"${x.real:.5g}$", "", ""])
        elif x.imag > 0:
            number = rf"${f'{x.real:.5g} ' if x.real else ''}\pm {x.imag:.5g}\,i$"
            values.append([number, f"{abs(x) / (2 * math.pi):.4g}", f"{0.0 - x.real / abs(x):.4g}"])
    return f"{rates}\n\n{_cells_markdown(values)}"


def equilibrium_markdown(found: Any) -> str:
    """Return the positions of equilibrium as a table, and notes below it."""
    from multibody_sym.documents.analysis import equilibrium_text

    if not found.positions:
        return f"```\n{equilibrium_text(found)}\n```"
    names = list(found.positions[0])
    words = {True: "stable", False: "unstable", None: "indifferent"}
    units = {name: f" [{found.units[name]}]" if found.units.get(name) else "" for name in names}
    head = ["", *(f"${latex_name(name)}${units[name]}" for name in names)]
    rows = [
        [words[stable], *(f"{position[name]:.6g}" for name in names)]
        for position, stable in zip(found.positions, found.stable, strict=True)
    ]
    notes = [f"*{_plain(line)}*" for line in equilibrium_text(found).splitlines() if line.startswith("note: ")]
    return "\n\n".join([_cells_markdown([head, *rows]), *notes])


def _cells_markdown(rows: Sequence[Sequence[str]]) -> str:
    head, *others = rows
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *others))


def _column(names: Iterable[str]) -> str:
    return r"\begin{bmatrix}" + r" \\ ".join(names) + r"\end{bmatrix}"


def _matrix(rows: Iterable[Iterable[float]]) -> str:
    return _column(" & ".join(f"{x:.4g}" for x in row) for row in rows)


def _plain(text: str) -> str:
    """Return text that neither Markdown nor LaTeX reads as more than text."""
    return "".join(c if c.isalnum() or c in " .,:;=()-'" else f"\\{c}" if c in "_#%&$" else " " for c in text)
