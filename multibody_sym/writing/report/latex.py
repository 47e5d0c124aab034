r"""A report as a LaTeX document for pdflatex; formulas end their lines between terms.

What is too wide even so is set smaller (`\fit`, `\fitbox`).
"""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap
from typing import Any, Final

from multibody_sym.drawing.figure import Figure
from multibody_sym.drawing.tikz import tikz
from multibody_sym.dynamics.derivation.notation import breakable, escaped, latex_name
from multibody_sym.expressions.chosen_units import Units
from multibody_sym.expressions.latex_width import latex_width
from multibody_sym.writing.check import check_text
from multibody_sym.writing.derivation import LONGEST, Equations, advice, result_steps
from multibody_sym.writing.documents import FIT, whole_document
from multibody_sym.writing.formulas.latex import equation_lines
from multibody_sym.writing.report.findings import Findings, Missing, ParameterTold
from multibody_sym.writing.run_summary import run_summary
from multibody_sym.writing.solution import solution_text
from multibody_sym.writing.worked import worked_parts

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
        _figure(found.figure),
        _parameters(found.parameters),
        _titled("Equations of motion", found.equations, _equations),
        _titled("Solution at the start", found.solution, lambda solution: _solution(found, solution, units)),
        _titled("Motion", found.run, lambda run: _plot(plot) + _typed(run_summary(run, units))),
        _titled("Checks", found.check, lambda check: _typed(check_text(check, units))),
        _titled("How this was made", found.command, _typed) if found.command else "",
    ]
    body = "\n\n".join(part for part in parts if part)
    return whole_document(f"{_PREAMBLE}{FIT}", body)


def _titled(title: str, found: Any, write: Any) -> str:
    content = breakable(found.reason) if isinstance(found, Missing) else write(found)
    return rf"\subsection{{{title}}}" + "\n" + content


def _figure(figure: Figure | Missing) -> str:
    if isinstance(figure, Missing):
        return breakable(figure.reason)
    return _centred([tikz(figure.picture, alone=False)])


def _centred(pictures: Iterable[str]) -> str:
    shown = "\n\\quad\n".join(rf"\fitbox{{{picture}}}" for picture in pictures)
    return "\\begin{center}\n" + shown + "\n\\end{center}"


def _parameters(parameters: tuple[ParameterTold, ...]) -> str:
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


def _solution(found: Findings, solution: Any, units: Units) -> str:
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
