"""What does a report hold: all answers on a system, each or why there is none; and how is it written?

In: a System with settings of a run. Out: a Report, written as a page of HTML or as LaTeX.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from html import escape
from textwrap import wrap
from typing import Any, Final, TypeVar, Unpack

import numpy as np

from multibody_sym.analysis.check import CheckReport, check
from multibody_sym.answers.free_bodies import CutFree, all_arrows, at_start, open_of, shown_components
from multibody_sym.answers.records import Solution
from multibody_sym.answers.solve import solve
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.free_bodies import component_label
from multibody_sym.derivation.notation import Equation, Notation, breakable, escaped, latex_name
from multibody_sym.documents.animation.animate import player
from multibody_sym.documents.animation.frames import frames_of
from multibody_sym.documents.derivation import ClosedForm, derivation_document
from multibody_sym.documents.document import Block, Document, HtmlWriter, LatexWriter, Section, worked_document
from multibody_sym.documents.draw import draw
from multibody_sym.documents.formulas import FIT, equation_lines, harmless, math_element, mathml_name, whole_document
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text, solution_text
from multibody_sym.errors import InputError, MultibodyError, Where
from multibody_sym.mechanics.changes import with_overrides
from multibody_sym.model.argument_checks import door, text
from multibody_sym.model.parameters import DimensionField
from multibody_sym.model.run_options import MODEL_OVERRIDES, RunOptions, spelled_out
from multibody_sym.model.system import System, verify_system
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.simulate import simulate
from multibody_sym.pictures.draw import Figure, FigureContent
from multibody_sym.pictures.draw import draw as draw_scene
from multibody_sym.pictures.page.vector_files import svg, tikz
from multibody_sym.pictures.scene.scene import scene_of
from multibody_sym.program.target_layout import fill_template, template_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.printer import COMPONENTS, latex_width
from multibody_sym.text.values import SI, Units, chosen_units

# ----------------------------------------------------------------------------------------------------------------------
# Bodies cut free: a figure of each with all forces on it at the start, as numbers and geometry have them.


_ROLES: Final = ("body", "mass centre", "pulley", "gear")
_MOST_FREE_BODIES: Final = 12
"""Systems of more bodies have no figure of each."""


def free_bodies(system: System) -> Mapping[str, Figure]:
    """Return a figure of each body with the forces on it: weight, loads, joints, ropes, contacts.

    None for an impact and for many bodies. Raises what `solve` raises.
    """
    if len(system.bodies) > _MOST_FREE_BODIES or system.impact is not None:
        return {}
    scene = scene_of(system)
    solution = solve(system)
    arrows = all_arrows(CutFree(system, scene, scene.motion(), *at_start(solution)))
    # the letters of joints' reactions, and the names of ropes and rods, that are not unique
    seen, letters = shown_components(scene), dict[int, list[str]]()
    bodies = {item.name: set(item.bodies) for item in scene.items if item.path[0] == "joints" and item.bodies}
    bodies |= {strand.name: {anchor.body for anchor in strand.anchors} for strand in scene.strands}
    for name, part in open_of(solution):
        of_joint = part in COMPONENTS
        if of_joint and not seen(part[0] == "m", np.eye(3)["xyz".index(part[1])]):
            continue
        for number in bodies.get(name, ()):
            letters.setdefault(number, []).append(component_label(name, part).text if of_joint else name)
    figures = {}
    for k, body in enumerate(scene.mechanism.bodies):
        on_body = tuple(arrow for arrow in arrows if arrow.at.body == k)
        if on_body and not (body.is_double or body.is_foot):
            items = tuple(item for item in scene.items if item.body == k and item.role in _ROLES)
            others: dict[str, Any] = dict.fromkeys(("strands", "dimensions", "angles", "arrows", "ropes"), ())
            alone = replace(scene, name=body.name, items=items, **others)
            shown = FigureContent(names="none", reactions=on_body, undrawn=tuple(sorted(letters.get(k, ()))))
            placed = replace(scene.at(), strands=(), vectors=np.zeros((0, 3)))
            figures[body.name] = Figure(draw_scene(alone, placed, shown=shown))
    return figures


# ----------------------------------------------------------------------------------------------------------------------
# The answers.


_T = TypeVar("_T")
_MOST_BODIES: Final = 24


@dataclass(frozen=True)
class Missing:
    """A part that cannot be had, and why."""

    reason: str


@dataclass(frozen=True)
class ReportedParameter:
    """A parameter: its name and letter, its number and unit."""

    name: str
    label: str
    number: float | None
    unit: str

    @property
    def digits(self) -> str:
        """The number in digits; empty where it has none."""
        return "" if self.number is None else f"{self.number:.10g}"


@dataclass(frozen=True, eq=False)
class Findings:
    """All answers that a report holds of a `system`; `command` makes it once more."""

    system: System
    command: str
    parameters: tuple[ReportedParameter, ...]
    figure: Figure | Missing
    bodies: Mapping[str, Figure] | Missing
    equations: ClosedForm | Missing
    solution: Solution | Missing
    check: CheckReport | Missing
    run: Trajectory | Missing


def findings(system: System, command: str, settings: Mapping[str, Any]) -> Findings:
    """Return the answers on a system; `settings` are those of the run."""
    # in the order of the model, with numbers of parameters that follow from others
    known: dict[Any, float] = {}
    pending, numbers = dict(system.parameters), {}
    for _ in range(len(pending)):
        for name, parameter in list(pending.items()):
            try:
                known[symbol(name)] = numbers[name] = float(evaluate_float([parameter.value], known)[0])
            except (KeyError, ArithmeticError, ValueError):
                continue
            del pending[name]
    return Findings(
        system=system,
        command=command,
        parameters=tuple(
            ReportedParameter(
                name,
                parameter.label or name,
                numbers.get(name),
                "" if parameter.dimension is None else DimensionField().tree(parameter.dimension),
            )
            for name, parameter in system.parameters.items()
        ),
        figure=_answer(lambda: draw(system)),
        bodies=_answer(lambda: free_bodies(system)),
        equations=_symbolic_answer(system, lambda: derive(system)),
        solution=_symbolic_answer(system, lambda: solve(system, steps=True)),
        check=_answer(lambda: check(system)),
        run=_answer(lambda: simulate(system, **settings)),
    )


def _symbolic_answer(system: System, question: Callable[[], _T]) -> _T | Missing:
    """Return an answer in symbols, none for systems whose equations nobody would read."""
    if len(system.bodies) > _MOST_BODIES:
        return Missing(f"{len(system.bodies)} bodies: formulas of so many are longer than a report")
    return _answer(question)


def _answer(question: Callable[[], _T]) -> _T | Missing:
    try:
        return question()
    except MultibodyError as error:
        return Missing(str(error).splitlines()[0])


# ----------------------------------------------------------------------------------------------------------------------
# The sections of a report, and the blocks that only reports have.


@dataclass(frozen=True)
class Pictures:
    """A figure, or below a title one of each name, side by side."""

    figures: Mapping[str, Figure]
    title: str = ""


@dataclass(frozen=True)
class ParameterTable:
    """Parameters with letters, names, numbers and units."""

    rows: tuple[ReportedParameter, ...]


@dataclass(frozen=True)
class Film:
    """The motion of a run: moving on a page, as a plot on paper."""

    run: Trajectory


@dataclass(frozen=True)
class Typed:
    """Text of a terminal; `title` stands above it on a page."""

    text: str
    title: str = ""


def _sections(found: Findings, units: Units) -> list[Section]:
    """Return a section for each question, with the answer or the reason why there is none."""
    free = {} if isinstance(found.bodies, Missing) else found.bodies
    pictures = [Pictures(free, "Bodies cut free")] if free else []
    sections = [
        _section("", found.figure, lambda figure: [Pictures({"": figure})]),
        _section("Parameters", found.parameters, lambda rows: [ParameterTable(rows)] if rows else []),
        _section("Equations of motion", found.equations, lambda equations: [derivation_document(equations)]),
        _section("Solution at the start", found.solution, lambda solution: [
            *pictures,
            *([] if solution.steps is None else [worked_document(solution.steps)]),
            Typed(solution_text(solution, units), "In short"),
        ]),
        _section("Motion", found.run, lambda run: [*([Film(run)] if len(run) else []), Typed(run_summary(run, units))]),
        _section("Checks", found.check, lambda report: [Typed(check_text(report, units))]),
        _section("How this was made", found.command, lambda command: [Typed(command)] if command else []),
    ]  # fmt: skip
    return [section for section in sections if section.blocks]


def _section(title: str, answer: Any, blocks_of: Callable[[Any], list[Block]]) -> Section:
    blocks = answer if isinstance(answer, Missing) else _answer(lambda: blocks_of(answer))
    return Section(title, (blocks,) if isinstance(blocks, Missing) else tuple(blocks))


class _ReportHtml(HtmlWriter):
    """A report as one page: pictures and scripts within it, nothing from elsewhere."""

    def report(self, system: System, sections: Iterable[Section]) -> str:
        """Return the whole page."""
        name = escape(system.name)
        paragraphs = (system.description or "").split("\n\n")
        statement = "\n".join(f'<p class="statement">{escape(paragraph)}</p>' for paragraph in paragraphs)
        body = "\n".join(map(self.section, sections))
        style = template_text("html/animation.css") + template_text("html/report.css")
        whole = f'<main class="report"><h1>{name}</h1>{statement}\n{body}</main>'
        return harmless(fill_template("html/page.html.in", title=name, style=style, body=whole))

    def section(self, section: Section) -> str:
        head = f"{self.heading(section.title)}\n" if section.title else ""
        return f"<section>\n{head}{''.join(map(self.block, section.blocks))}\n</section>"

    def block(self, block: Block) -> str:
        match block:
            case Missing():
                return f'<p class="missing">{escape(block.reason)}</p>'
            case Document():
                body = HtmlWriter(block.notation, self.units, level=3).body(block)
                return body if block.run_in else body.rstrip("\n")
            case Pictures():
                return self._pictures(block)
            case ParameterTable():
                return self._parameters(block.rows)
            case Film():
                moving = _answer(lambda: player(block.run, frames_of(block.run), None, None, None, self.units, 1.0))
                return self.block(moving) if isinstance(moving, Missing) else moving
            case Typed():
                title = f"<h3>{block.title}</h3>" if block.title else ""
                return f"{title}<pre>{escape(block.text)}</pre>"
        return super().block(block)

    def _pictures(self, pictures: Pictures) -> str:
        drawn = {name: svg(figure.picture, alone=False) for name, figure in pictures.figures.items()}
        if not pictures.title:
            return "".join(f"<figure>{each}</figure>" for each in drawn.values())
        captions = {name: f"<figcaption>{escape(name)}</figcaption>" for name in drawn}
        figures = "".join(f"<figure>{each}{captions[name]}</figure>" for name, each in drawn.items())
        return f'<h3>{pictures.title}</h3><div class="row">{figures}</div>'

    def _parameters(self, parameters: Iterable[ReportedParameter]) -> str:
        rows = [
            f"<tr><td>{math_element(mathml_name(each.label))}</td><td>{escape(each.name)}</td>"
            f"<td>{each.digits}</td><td>{escape(each.unit)}</td></tr>"
            for each in parameters
        ]
        return f"<table><tr><th></th><th>name</th><th>value</th><th>unit</th></tr>{''.join(rows)}</table>"


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


@dataclass(frozen=True)
class _ReportLatex(LatexWriter):
    r"""A report for pdflatex: lines end between terms, wider ones are set smaller (`\fit`, `\fitbox`)."""

    plot: str | None = None

    def report(self, system: System, sections: Iterable[Section]) -> str:
        """Return the whole document."""
        description = rf"{{\itshape {breakable(system.description)}\par}}" if system.description else ""
        parts = [rf"\section*{{{breakable(system.name)}}}", description, *map(self.section, sections)]
        return whole_document(f"{_PREAMBLE}{FIT}", "\n\n".join(part for part in parts if part))

    def block(self, block: Block) -> str:
        match block:
            case Missing():
                return breakable(block.reason)
            case Document():
                command = r"\textbf{%s}\par" if block.run_in else r"\subsubsection{%s}"
                writer = replace(self, notation=block.notation, command=command)
                written = ("\n\n" if block.run_in else "\n").join(map(writer.section, block.sections))
                return written or escaped(block.advice)
            case Pictures():
                pictures = (tikz(figure.picture, alone=False) for figure in block.figures.values())
                shown = "\n\\quad\n".join(rf"\fitbox{{{picture}}}" for picture in pictures)
                title = rf"\textbf{{{block.title}}}\par" + "\n" if block.title else ""
                return f"{title}\\begin{{center}}\n{shown}\n\\end{{center}}"
            case ParameterTable():
                return self._parameters(block.rows)
            case Film():
                size = r"width=\linewidth,height=0.85\textheight,keepaspectratio"
                return rf"\includegraphics[{size}]{{{self.plot}}}\par" if self.plot else ""
            case Typed():
                lines = [line for line in block.text.splitlines() if line.strip()]
                parts = (wrap(line, _TYPED, subsequent_indent="    ", replace_whitespace=False) for line in lines)
                return "\n".join(rf"\typed{{{escaped(part).replace('  ', '~~')}}}" for each in parts for part in each)
        return super().block(block)

    def equations(self, rows: Sequence[Equation]) -> str:
        lines = []
        for row in rows:
            first, *others = equation_lines(self.notation, row.left, row.right)
            lines += [rf"\formula{{{first}}}", *(rf"\continued{{{other}}}" for other in others)]
        return "\n".join(lines)

    def note(self, lines: Sequence[str]) -> str:
        return "\n".join(breakable(line) + r"\par" for line in lines)

    def _parameters(self, parameters: Iterable[ReportedParameter]) -> str:
        """Return the table; a letter as wide as words is left out, for the name says it."""
        letters = ((each, latex_name(each.label)) for each in parameters)
        rows = [
            rf"{f'${letter}$' if latex_width(letter) < _LETTER else ''} & \texttt{{{breakable(each.name)}}} & "
            rf"{each.digits} & {escaped(each.unit)} \\"
            for each, letter in letters
        ]
        head = r"\begin{longtable}[l]{@{}p{0.2\linewidth}p{0.4\linewidth}ll@{}}"
        return "\n".join([head, r" & name & value & unit \\ \hline", *rows, r"\end{longtable}"])


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
        writer = _ReportHtml(Notation({}, {}), self.units)
        return writer.report(self.findings.system, _sections(self.findings, self.units))

    @door
    def latex(self, plot: str | None = None) -> str:
        """Return the report as a LaTeX document; `plot` is the file of the run's plot that it shows.

        Raises InputError for a `plot` that is no name of a file.
        """
        plot = None if plot is None else text("plot", plot)
        writer = _ReportLatex(Notation({}, {}), self.units, plot=plot)
        return writer.report(self.findings.system, _sections(self.findings, self.units))

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


@spelled_out(RunOptions)
def report(
    system: System,
    path: str | os.PathLike[str] | None = None,
    *,
    units: str | Units | None = None,
    command: str = "",
    **options: Unpack[RunOptions],
) -> Report:
    """Return a report of a system, written to `path` (.html, .tex) if one is given.

    It holds the figure, the description, parameters, equations, the solution at the start step by step with the body
    cut free, the motion with its account of energy and constraints, what is redundant, and the `command` that made it.
    `parameters` .. `project`, what the call changes of the system (`Overrides`); `t_end` .. `constraints`, `formalism`,
    `native` and `backend`: as for `simulate`.
    Raises InputError, OutputError; what cannot be found is told in the report.
    """
    verify_system(system)
    told = chosen_units(units)
    if path is not None:
        report_ending(path_name(path))
    settings = {name: value for name, value in options.items() if name not in MODEL_OVERRIDES}
    found = Report(findings(with_overrides(system, options), command, settings), told)
    if path is not None:
        found.write(path)
    return found
