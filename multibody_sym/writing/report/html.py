"""A report as one page of HTML: pictures and scripts within it, nothing from elsewhere."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import Any, Final

from multibody_sym.answers.solution import Solution
from multibody_sym.checking.check import CheckReport
from multibody_sym.codegen.templates import filled, template_text
from multibody_sym.drawing.figure import Figure
from multibody_sym.drawing.svg import svg
from multibody_sym.errors import MultibodyError
from multibody_sym.expressions.chosen_units import Units
from multibody_sym.simulation.trajectory import Trajectory
from multibody_sym.writing.animation.animate import player
from multibody_sym.writing.animation.frames import frames_of
from multibody_sym.writing.check import check_text
from multibody_sym.writing.derivation import derivation_body
from multibody_sym.writing.formulas.mathml import element, mathml_name
from multibody_sym.writing.formulas.signs import harmless
from multibody_sym.writing.report.findings import Findings, Missing, ParameterTold
from multibody_sym.writing.run_summary import run_summary
from multibody_sym.writing.solution import solution_text
from multibody_sym.writing.worked import worked_parts

_BODIES: Final = "Bodies cut free"


def page(found: Findings, units: Units) -> str:
    """Return the whole page."""
    name = escape(found.system.name)
    sections = [
        ("", _figure(found.figure)),
        ("Parameters", _parameters(found.parameters)),
        ("Equations of motion", _part(found.equations, lambda equations: _lower(derivation_body(equations)))),
        ("Solution at the start", _part(found.solution, lambda solution: _solution(found, solution, units))),
        ("Motion", _part(found.run, lambda run: _motion(run, units))),
        ("Checks", _part(found.check, lambda check: _checks(check, units))),
        ("How this was made", f"<pre>{escape(found.command)}</pre>" if found.command else ""),
    ]
    body = "\n".join(_section(title, content) for title, content in sections if content)
    said = (found.system.description or "").split("\n\n")
    statement = "\n".join(f'<p class="statement">{escape(paragraph)}</p>' for paragraph in said)
    style = template_text("html/animation.css") + template_text("html/report.css")
    whole = f'<main class="report"><h1>{name}</h1>{statement}\n{body}</main>'
    return harmless(filled("html/page.html.in", title=name, style=style, body=whole))


def _section(title: str, content: str) -> str:
    head = f"<h2>{escape(title)}</h2>\n" if title else ""
    return f"<section>\n{head}{content}\n</section>"


def _part(found: Any, write: Any) -> str:
    """Return a part as it is written, or why there is none."""
    if isinstance(found, Missing):
        return f'<p class="missing">{escape(found.reason)}</p>'
    try:
        return str(write(found))
    except MultibodyError as error:
        return f'<p class="missing">{escape(str(error).splitlines()[0])}</p>'


def _figure(figure: Figure | Missing) -> str:
    if isinstance(figure, Missing):
        return f'<p class="missing">{escape(figure.reason)}</p>'
    return f"<figure>{svg(figure.picture, alone=False)}</figure>"


def _parameters(parameters: Iterable[ParameterTold]) -> str:
    rows = [
        f"<tr><td>{element(mathml_name(each.label))}</td><td>{escape(each.name)}</td>"
        f"<td>{'' if each.number is None else f'{each.number:.10g}'}</td><td>{escape(each.unit)}</td></tr>"
        for each in parameters
    ]
    head = "<tr><th></th><th>name</th><th>value</th><th>unit</th></tr>"
    return f"<table>{head}{''.join(rows)}</table>" if rows else ""


def _solution(found: Findings, solution: Solution, units: Units) -> str:
    steps = [] if solution.steps is None else worked_parts(solution.steps, "html", units)
    told = f"<h3>In short</h3><pre>{escape(solution_text(solution, units))}</pre>"
    return _free_bodies(found) + _lower("\n".join(steps)) + told


def _lower(part: str) -> str:
    """Return a part of a page with its headings one level lower."""
    return part.replace("<h2>", "<h3>").replace("</h2>", "</h3>")


def _free_bodies(found: Findings) -> str:
    if isinstance(found.bodies, Missing) or not found.bodies:
        return ""
    figures = "".join(
        f"<figure>{svg(figure.picture, alone=False)}<figcaption>{escape(name)}</figcaption></figure>"
        for name, figure in found.bodies.items()
    )
    return f'<h3>{_BODIES}</h3><div class="row">{figures}</div>'


def _motion(run: Trajectory, units: Units) -> str:
    told = f"<pre>{escape(run_summary(run, units))}</pre>"
    if not len(run):
        return told
    return player(run, frames_of(run), None, None, None, units, 1.0) + told


def _checks(check: CheckReport, units: Units) -> str:
    return f"<pre>{escape(check_text(check, units))}</pre>"
