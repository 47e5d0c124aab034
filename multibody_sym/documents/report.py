"""What a report tells: the answers of the package to all that can be asked of a system, each or why there is none."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from html import escape
from textwrap import wrap
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.analysis.check import CheckReport, check
from multibody_sym.answers.free_bodies import CutFree, all_arrows, open_of, shown_components, sliding_of, values_of
from multibody_sym.answers.records import Solution
from multibody_sym.answers.solve import solve
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.force_letters import component_label
from multibody_sym.derivation.notation import breakable, escaped, latex_name
from multibody_sym.documents.animation.animate import player
from multibody_sym.documents.animation.frames import frames_of
from multibody_sym.documents.derivation import LONGEST, Equations, advice, derivation_body, result_steps
from multibody_sym.documents.draw import draw
from multibody_sym.documents.formulas import FIT, element, equation_lines, harmless, mathml_name, whole_document
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text, solution_text
from multibody_sym.documents.worked import worked_parts
from multibody_sym.errors import InputError, MultibodyError, Where
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.model.argument_checks import door
from multibody_sym.model.parameters import DimensionField
from multibody_sym.model.system import System, verify_system
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.simulate import simulate
from multibody_sym.pictures.draw import Figure, Shown
from multibody_sym.pictures.draw import draw as draw_scene
from multibody_sym.pictures.page.svg import svg
from multibody_sym.pictures.page.tikz import tikz
from multibody_sym.pictures.scene.items import ArrowItem
from multibody_sym.pictures.scene.scene import Scene, scene_of
from multibody_sym.program.target_layout import filled, template_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.printer import COMPONENTS, latex_width, text
from multibody_sym.text.values import SI, Units, chosen_units

# ----------------------------------------------------------------------------------------------------------------------
# Bodies cut free: a figure of each with all forces on it at the start, as numbers and geometry have them.


_ROLES: Final = ("body", "mass centre", "pulley", "gear")
MOST: Final = 12
"""Systems of more bodies have no figure of each: nobody would look at them."""


def free_bodies(system: System) -> Mapping[str, Figure]:
    """Return a figure of each body with the forces on it: weight, loads, joints, ropes, contacts.

    None for an impact and for many bodies. Raises what `solve` raises.
    """
    if len(system.bodies) > MOST or system.impact is not None:
        return {}
    scene = scene_of(system)
    solution = solve(system)
    known = values_of(solution), sliding_of(solution), open_of(solution)
    arrows = all_arrows(CutFree(system, scene, scene.motion(), *known))
    undrawn = _undrawn(scene, solution)
    return {
        body.name: _figure(scene, k, [arrow for arrow in arrows if arrow.at.body == k], undrawn.get(k, ()))
        for k, body in enumerate(scene.mechanism.bodies)
        if not (body.is_double or body.is_foot) and any(arrow.at.body == k for arrow in arrows)
    }


def _undrawn(scene: Scene, solution: Solution) -> Mapping[int, Sequence[str]]:
    """Return by body the letters of joints' reactions, and the names of ropes and rods, that are not unique."""
    seen, found = shown_components(scene), dict[int, list[str]]()
    bodies = {item.name: set(item.bodies) for item in scene.items if item.path[0] == "joints" and item.bodies}
    bodies |= {strand.name: {anchor.body for anchor in strand.anchors} for strand in scene.strands}
    for name, part in open_of(solution):
        of_joint = part in COMPONENTS
        if of_joint and not seen(part[0] == "m", np.eye(3)["xyz".index(part[1])]):
            continue
        for body in bodies.get(name, ()):
            found.setdefault(body, []).append(component_label(name, part).text if of_joint else name)
    return {body: sorted(names) for body, names in found.items()}


def _figure(scene: Scene, body: int, arrows: Sequence[ArrowItem], undrawn: Sequence[str]) -> Figure:
    """Return a body alone with the forces on it."""
    items = tuple(item for item in scene.items if item.body == body and item.role in _ROLES)
    name = scene.mechanism.bodies[body].name
    alone = replace(scene, name=name, items=items, strands=(), dimensions=(), angles=(), arrows=(), ropes=())
    shown = Shown(names=False, reactions=tuple(arrows), undrawn=tuple(undrawn))
    placed = replace(scene.at(), strands=(), vectors=np.zeros((0, 3)))
    return Figure(draw_scene(alone, placed, shown=shown))


# ----------------------------------------------------------------------------------------------------------------------

_T = TypeVar("_T")
_MOST_BODIES: Final = 24


@dataclass(frozen=True)
class Missing:
    """A part that cannot be had, and why."""

    reason: str


@dataclass(frozen=True)
class ParameterTold:
    """A parameter: its name and letter, what the model says, its number and unit."""

    name: str
    label: str
    declared: str
    number: float | None
    unit: str


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a report tells of a `system`; `command` makes it once more."""

    system: System
    command: str
    parameters: tuple[ParameterTold, ...]
    figure: Figure | Missing
    bodies: Mapping[str, Figure] | Missing
    equations: Equations | Missing
    solution: Solution | Missing
    check: CheckReport | Missing
    run: Trajectory | Missing


def findings(system: System, command: str, settings: Mapping[str, Any]) -> Findings:
    """Return what is found of a system; `settings` are those of the run."""
    return Findings(
        system=system,
        command=command,
        parameters=parameters_told(system),
        figure=_asked(lambda: draw(system)),
        bodies=_asked(lambda: free_bodies(system)),
        equations=_in_symbols(system, lambda: derive(system)),
        solution=_in_symbols(system, lambda: solve(system, steps=True)),
        check=_asked(lambda: check(system)),
        run=_asked(lambda: simulate(system, **settings)),
    )


def _in_symbols(system: System, question: Callable[[], _T]) -> _T | Missing:
    """Return an answer in symbols, none for systems whose equations nobody would read."""
    if len(system.bodies) > _MOST_BODIES:
        return Missing(f"{len(system.bodies)} bodies: formulas of so many are longer than a report")
    return _asked(question)


def _asked(question: Callable[[], _T]) -> _T | Missing:
    try:
        return question()
    except MultibodyError as error:
        return Missing(str(error).splitlines()[0])


def parameters_told(system: System) -> tuple[ParameterTold, ...]:
    """Return the parameters in the order of the model, with numbers of those that follow from others."""
    known: dict[Any, float] = {}
    pending, found = dict(system.parameters), {}
    for _ in range(len(pending)):
        for name, parameter in list(pending.items()):
            try:
                known[symbol(name)] = found[name] = float(evaluate_float([parameter.value], known)[0])
            except (KeyError, ArithmeticError, ValueError):
                continue
            del pending[name]
    return tuple(
        ParameterTold(
            name, parameter.label or name, text(parameter.value), found.get(name),
            "" if parameter.dimension is None else DimensionField().tree(parameter.dimension),
        )
        for name, parameter in system.parameters.items()
    )  # fmt: skip


# ----------------------------------------------------------------------------------------------------------------------
# A report as one page of HTML: pictures and scripts within it, nothing from elsewhere.


_BODIES: Final = "Bodies cut free"


def page(found: Findings, units: Units) -> str:
    """Return the whole page."""
    name = escape(found.system.name)
    sections = [
        ("", _html_figure(found.figure)),
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


def _html_figure(figure: Figure | Missing) -> str:
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


# ----------------------------------------------------------------------------------------------------------------------
# A report as a LaTeX document for pdflatex; formulas end their lines between terms.
#
# What is too wide even so is set smaller (`\fit`, `\fitbox`).


_TYPED: Final = 112
"""Characters of a line that is typed."""
_LETTER: Final = 90.0
"""Points that the letter of a parameter may take in the table."""
_PREAMBLE: Final = r"""\documentclass{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{textcomp}
\usepackage{amsmath}
\usepackage{graphicx}
\usepackage{longtable}
\usepackage{tikz}
\usepackage[margin=2cm]{geometry}
\allowdisplaybreaks
\setcounter{secnumdepth}{0}
\setcounter{MaxMatrixCols}{99}
\setlength{\parindent}{0pt}
\sloppy
\newcommand{\fitbox}[1]{\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{#1}}
\newcommand{\formula}[1]{\par\medskip\fit{#1}\par\medskip}
\newcommand{\continued}[1]{\hspace*{2em}\fit{#1}\par\medskip}
\newcommand{\typed}[1]{{\footnotesize\ttfamily\fitbox{#1}\par}}
"""


def document(found: Findings, units: Units, plot: str | None) -> str:
    """Return the whole document; `plot` is the file of the run's plot."""
    parts = [
        rf"\section*{{{breakable(found.system.name)}}}",
        rf"{{\itshape {breakable(found.system.description)}\par}}" if found.system.description else "",
        _latex_figure(found.figure),
        _latex_parameters(found.parameters),
        _titled("Equations of motion", found.equations, _equations),
        _titled("Solution at the start", found.solution, lambda solution: _latex_solution(found, solution, units)),
        _titled("Motion", found.run, lambda run: _plot(plot) + _typed(run_summary(run, units))),
        _titled("Checks", found.check, lambda check: _typed(check_text(check, units))),
        _titled("How this was made", found.command, _typed) if found.command else "",
    ]
    body = "\n\n".join(part for part in parts if part)
    return whole_document(f"{_PREAMBLE}{FIT}", body)


def _titled(title: str, found: Any, write: Any) -> str:
    content = breakable(found.reason) if isinstance(found, Missing) else write(found)
    return rf"\subsection{{{title}}}" + "\n" + content


def _latex_figure(figure: Figure | Missing) -> str:
    if isinstance(figure, Missing):
        return breakable(figure.reason)
    return _centred([tikz(figure.picture, alone=False)])


def _centred(pictures: Iterable[str]) -> str:
    shown = "\n\\quad\n".join(rf"\fitbox{{{picture}}}" for picture in pictures)
    return "\\begin{center}\n" + shown + "\n\\end{center}"


def _latex_parameters(parameters: tuple[ParameterTold, ...]) -> str:
    if not parameters:
        return ""
    rows = [
        rf"{_letter(each.label)} & \texttt{{{breakable(each.name)}}} & "
        rf"{'' if each.number is None else f'{each.number:.10g}'} & {escaped(each.unit)} \\"
        for each in parameters
    ]
    columns = r"@{}p{0.2\linewidth}p{0.4\linewidth}ll@{}"
    head = f"\\begin{{longtable}}[l]{{{columns}}}\n & name & value & unit \\\\ \\hline\n"
    return "\\subsection{Parameters}\n" + head + "\n".join(rows) + "\n\\end{longtable}"


def _letter(label: str) -> str:
    """Return a parameter's letter; words are what its name says already, unless they are short."""
    letter = latex_name(label)
    return f"${letter}$" if latex_width(letter) < _LETTER else ""


def _equations(equations: Equations) -> str:
    if equations.operations > LONGEST:
        return escaped(advice(equations))
    parts = []
    for step in result_steps(equations):
        lines = [_formula(equation_lines(equations.notation, e.left, e.right)) for e in step.equations]
        notes = [breakable(line) + r"\par" for line in step.note.splitlines()]
        parts.append("\n".join([rf"\textbf{{{escaped(step.title)}}}\par", *lines, *notes]))
    return "\n\n".join(parts)


def _formula(lines: list[str]) -> str:
    first, *others = lines
    return "\n".join([rf"\formula{{{first}}}", *(rf"\continued{{{other}}}" for other in others)])


def _latex_solution(found: Findings, solution: Any, units: Units) -> str:
    bodies = {} if isinstance(found.bodies, Missing) else found.bodies
    pictures = [tikz(figure.picture, alone=False) for figure in bodies.values()]
    free = ("\\textbf{Bodies cut free}\\par\n" + _centred(pictures)) if pictures else ""
    steps = [] if solution.steps is None else worked_parts(solution.steps, "latex", units)
    told = "\n".join(steps).replace(r"\subsection{", r"\subsubsection{")
    return "\n".join(part for part in (free, told, _typed(solution_text(solution, units))) if part)


def _plot(plot: str | None) -> str:
    size = r"width=\linewidth,height=0.85\textheight,keepaspectratio"
    return rf"\includegraphics[{size}]{{{plot}}}\par" + "\n" if plot else ""


def _typed(text: str) -> str:
    """Return lines of text as they are typed."""
    given = [line for line in text.splitlines() if line.strip()]
    lines = [part for line in given for part in wrap(line, _TYPED, subsequent_indent="    ", replace_whitespace=False)]
    spaced = (escaped(line).replace("  ", "~~") for line in lines)
    return "\n".join(rf"\typed{{{line}}}" for line in spaced)


# ----------------------------------------------------------------------------------------------------------------------
# `report`: a system as one document to hand in, HTML or LaTeX.


ENDINGS: Final = (".html", ".tex")


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    """What is known of a system, to be written as a page of HTML or as LaTeX; a notebook shows the page."""

    findings: Findings
    units: Units = SI

    def __repr__(self) -> str:
        parts = ("figure", "equations", "solution", "check", "run")
        there = [part for part in parts if not isinstance(getattr(self.findings, part), Missing)]
        return f"<Report of {self.findings.system.name}: {', '.join(there) or 'nothing found'}>"

    @cached_property
    def html(self) -> str:
        """The report as a page that needs nothing beside it."""

        return page(self.findings, self.units)

    @door
    def latex(self, plot: str | None = None) -> str:
        """Return the report as a LaTeX document; `plot` is the file of the run's plot that it shows."""

        return document(self.findings, self.units, plot)

    @door
    def write(self, path: str | os.PathLike[str]) -> list[str]:
        """Write it as .html or .tex and return the names of the files: LaTeX has the plot of the run beside it.

        Raises InputError for another ending, OutputError where a file cannot be written.
        """
        name = path_name(path)
        if report_ending(name) == ".html":
            write_whole(path, self.html.encode("utf-8"))
            return [name]
        files = [name]
        plot = os.path.splitext(name)[0] + "_plot.pdf"
        if isinstance(self.findings.run, Missing) or not len(self.findings.run):
            plot = ""
        else:
            self.findings.run.plot(plot, self.units)
            files.append(plot)
        write_whole(path, self.latex(os.path.basename(plot) or None).encode("utf-8"))
        return files


def report_ending(name: str) -> str:
    """Return the ending of a report's name. Raises InputError for one that is none."""
    ending = os.path.splitext(name)[1].lower()
    if ending not in ENDINGS:
        message = f"a report is written to {' or '.join(ENDINGS)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name), number="U103")
    return ending


def report(
    system: System,
    path: str | os.PathLike[str] | None = None,
    *,
    units: str | Units | None = None,
    command: str = "",
    parameters: Mapping[str, Any] | None = None,
    initial: Mapping[str, Any] | None = None,
    inputs: Mapping[str, Any] | None = None,
    coordinates: str | None = None,
    project: bool | None = None,
    formalism: str | None = None,
    **settings: Any,
) -> Report:
    """Return a report of a system, written to `path` (.html, .tex) if one is given.

    It holds the figure, the description, parameters, equations, the solution at the start step by step with the body
    cut free, the motion with its account of energy and constraints, what is redundant, and the `command` that made it.
    `parameters` .. `project`, what the call changes of the system (`Overrides`); `formalism` and `settings` (t_end,
    method, step, rtol, atol, samples, constraints, native, backend) are those of the run.
    Raises InputError, OutputError; what cannot be found is told in the report.
    """
    verify_system(system)
    told = chosen_units(units)
    if path is not None:
        report_ending(path_name(path))
    asked = Overrides(parameters, initial, inputs, coordinates, project).of(system)
    found = Report(findings(asked, command, {**settings, "formalism": formalism}), told)
    if path is not None:
        found.write(path)
    return found
