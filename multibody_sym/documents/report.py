"""`report`: a system as one document to hand in or to hand out, HTML or LaTeX."""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from decimal import Decimal
from functools import cached_property
from html import escape
from random import Random
from typing import Any, Final, Unpack

from multibody_sym.answers.solve import solve
from multibody_sym.derivation.notation import Notation, breakable, escaped
from multibody_sym.documents.animation.animate import player
from multibody_sym.documents.animation.frames import frames_of
from multibody_sym.documents.document import Block, Document, HtmlWriter, LatexWriter, Section
from multibody_sym.documents.formulas import harmless, in_known_letters, whole_document
from multibody_sym.documents.letters import SystemLetters
from multibody_sym.documents.report_content import (
    BlocksInLetters,
    Boxed,
    Command,
    Description,
    Film,
    Findings,
    Folded,
    Givens,
    Missing,
    Pictures,
    Statement,
    WordTable,
    answer,
    answer_sections,
    exercise_sections,
    findings,
    sections,
)
from multibody_sym.errors import InputError, MultibodyError, Where
from multibody_sym.mechanics.changes import with_overrides, with_values
from multibody_sym.model.argument_checks import door, flag, text, whole_number
from multibody_sym.model.run_options import MODEL_OVERRIDES, RunOptions, spelled_out
from multibody_sym.model.system import System, angles_of, verify_system
from multibody_sym.pictures.draw import Figure
from multibody_sym.pictures.page.files import figure_content, svg, tikz
from multibody_sym.program.target_layout import fill_template, template_text
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.values import SI, Units, chosen_units

ENDINGS: Final = (".html", ".tex")


DIGITS: Final = 4
_MOST_DIGITS: Final = 17
_CONTENT: Final = {"report": sections, "exercise": exercise_sections, "answers": answer_sections}


# ----------------------------------------------------------------------------------------------------------------------
# The writers: a page of HTML that reads on a screen and on paper, and LaTeX.


_OPENED: Final = (
    "for (const [when, open] of [['beforeprint', true], ['afterprint', false]]) addEventListener(when, () => "
    "document.querySelectorAll('details').forEach((x) => {"
    " if (open && !x.open) { x.open = true; x.dataset.shut = ''; }"
    " else if (!open && 'shut' in x.dataset) { x.open = false; delete x.dataset.shut; } }));"
)
"""Details are open on paper, and on the page afterwards as they were."""


class ReportHtml(HtmlWriter):
    """A report as one page: pictures and scripts within it, nothing from elsewhere."""

    def report(self, title: str, sections: Iterable[Section]) -> str:
        """Return the whole page."""
        body = "\n".join(f"<section>\n{self.section(section)}\n</section>" for section in sections)
        style = template_text("html/animation.css") + template_text("html/report.css")
        whole = f'<main class="report"><h1>{escape(title)}</h1>\n{body}</main><script>{_OPENED}</script>'
        return harmless(fill_template("html/page.html.in", title=escape(title), style=style, body=whole))

    def block(self, block: Block) -> str:
        match block:
            case Missing():
                return f'<p class="missing">{escape(block.reason)}</p>'
            case BlocksInLetters():
                return "".join(map(ReportHtml(block.notation, self.units, self.level).block, block.blocks))
            case Document():
                return ReportHtml(block.notation, self.units, level=3).body(block)
            case Boxed():
                inside = "".join(map(self.block, block.blocks))
                return f'<div class="answers"><h2>{escape(block.title)}</h2>{inside}</div>'
            case Folded():
                inside = "".join(map(self.block, block.blocks))
                return f"<details><summary>{escape(block.title)}</summary>{inside}</details>"
            case Statement():
                return "".join(self._paragraph(*each) for each in block.paragraphs)
            case Pictures():
                return self._pictures(block.figures, block.title)
            case Givens():
                items = (f"<li>{self.inline(name)} = {self.words(value)}</li>" for name, value in block.rows)
                return f'<ul class="given">{"".join(items)}</ul>'
            case WordTable():
                return self._grid(block)
            case Film():
                return self._film(block)
            case Command():
                return f'<p class="command"><code>{escape(block.text)}</code></p>'
        return super().block(block)

    def _paragraph(self, facts: str, questions: str) -> str:
        asked = f"<strong>{escape(questions)}</strong>" if questions else ""
        return f'<p class="statement">{" ".join(part for part in (escape(facts), asked) if part)}</p>'

    def _pictures(self, figures: Mapping[str, Figure], title: str = "") -> str:
        drawn = {name: svg(figure.picture, alone=False) for name, figure in figures.items()}
        captions = {name: f"<figcaption>{escape(name)}</figcaption>" if name else "" for name in drawn}
        shown = "".join(f"<figure>{each}{captions[name]}</figure>" for name, each in drawn.items())
        head = f"<h3>{title}</h3>" if title else ""
        return f'{head}<div class="row">{shown}</div>' if len(drawn) > 1 or title else shown

    def _grid(self, grid: WordTable) -> str:
        head = "".join(f"<th>{escape(each)}</th>" for each in grid.head)
        rows = "".join(f"<tr>{''.join(f'<td>{self.words(cell)}</td>' for cell in row)}</tr>" for row in grid.rows)
        return f"<h3>{escape(grid.title)}</h3><table>{f'<tr>{head}</tr>' if head else ''}{rows}</table>"

    def _film(self, film: Film) -> str:
        """Return the player, for screens, and what paper shows in its place: some instants and the plot."""
        run = film.run
        moving = answer(lambda: player(run, frames_of(run), None, None, None, self.units, 1.0))
        screen = self.block(moving) if isinstance(moving, Missing) else moving
        plot = answer(lambda: base64.b64encode(figure_content(run.plot(None, self.units), "svg")).decode("ascii"))
        image = f'<img alt="the motion over time" src="data:image/svg+xml;base64,{plot}">'
        curves = "" if isinstance(plot, Missing) else f"<figure>{image}</figure>"
        return f'<div class="screen">{screen}</div><div class="paper">{self._pictures(film.stills)}{curves}</div>'


_PACKAGES: Final = ("textcomp", "longtable", "tikz")
_NEEDS: Final = "% needs \\usepackage{amsmath,graphicx,longtable,tikz}; equations have the labels"
_TEXT_WIDTH: Final = 480.0
"""The width of the text in points; figures side by side have a part of it."""
_HALF: Final = 220.0
_THIRD: Final = 145.0
_MOST_BOXED: Final = 12


@dataclass(frozen=True)
class ReportLatex(LatexWriter):
    """A report for pdflatex, or a fragment that a document of one's own takes in."""

    plot: str | None = None

    def report(self, title: str, sections: Iterable[Section]) -> str:
        """Return the whole document."""
        parts = [rf"\section*{{{breakable(title)}}}", *map(self.section, sections)]
        return whole_document("\n\n".join(part for part in parts if part), *_PACKAGES)

    def fragment(self, title: str, sections: Iterable[Section]) -> str:
        r"""Return what `\input` takes: a section with a label, its equations with labels."""
        parts = [rf"\section{{{breakable(title)}}}\label{{{self.prefix}}}", *map(self.section, sections)]
        head = f"{_NEEDS} {self.prefix}:1, {self.prefix}:2, ..\n"
        body = in_known_letters("\n\n".join(part for part in parts if part))
        return f"{head}\\begingroup\\sloppy\\setlength{{\\parindent}}{{0pt}}\n{body}\n\\par\\endgroup\n"

    def block(self, block: Block) -> str:
        match block:
            case Missing():
                return breakable(block.reason)
            case BlocksInLetters():
                return replace(self, notation=block.notation).section(Section("", block.blocks))
            case Document():
                writer = replace(self, notation=block.notation, command=r"\subsubsection*{%s}")
                return "\n".join(map(writer.section, block.sections)) or escaped(block.advice)
            case Boxed():
                return self._boxed(block)
            case Folded():
                inside = "\n".join(map(self.block, block.blocks))
                return f"\\subsection*{{{escaped(block.title)}}}\n{inside}"
            case Statement():
                return "\n\n".join(
                    " ".join([breakable(facts), rf"\textbf{{{breakable(asked)}}}" if asked else ""]).strip()
                    for facts, asked in block.paragraphs
                )
            case Pictures():
                return self._pictures(block.figures, block.title, _HALF if len(block.figures) > 1 else _TEXT_WIDTH)
            case Givens():
                each = (rf"\mbox{{{self.inline(name)} $=$ {self.words(value)}}}" for name, value in block.rows)
                return ", \\quad\n".join(each) + r"\par"
            case WordTable():
                return self._grid(block)
            case Film():
                size = r"width=\linewidth,height=0.45\textheight,keepaspectratio"
                plot = rf"\includegraphics[{size}]{{{self.plot}}}\par" if self.plot else ""
                return f"{self._pictures(block.stills, room=_THIRD)}\n{plot}"
            case Command():
                return rf"\texttt{{{breakable(block.text)}}}\par"
        return super().block(block)

    def _boxed(self, block: Boxed) -> str:
        inside = "\n".join(map(self.block, block.blocks))
        count = sum(len(getattr(each, "blocks", (each,))) for each in block.blocks)
        if count > _MOST_BOXED:
            return f"\\subsection*{{{escaped(block.title)}}}\n{inside}"
        box = r"\begin{minipage}{\dimexpr\linewidth-2\fboxsep-2\fboxrule\relax}"
        title = rf"\textbf{{{escaped(block.title)}}}\par"
        return f"\n\\medskip\\noindent\\fbox{{{box}\n{title}\n{inside}\n\\end{{minipage}}}}\\medskip\n"

    def _pictures(self, figures: Mapping[str, Figure], title: str = "", room: float = _TEXT_WIDTH) -> str:
        if not figures:
            return ""
        shown = "\n\\quad\n".join(self._picture(name, figure, room) for name, figure in figures.items())
        head = rf"\subsubsection*{{{title}}}" + "\n" if title else ""
        return f"{head}\\begin{{center}}\n{shown}\n\\end{{center}}"

    def _picture(self, name: str, figure: Figure, room: float) -> str:
        """Return a figure, one that is wider than its room scaled to it."""
        drawn = tikz(figure.picture, alone=False).strip()
        if figure.picture.width > room:
            drawn = rf"\scalebox{{{room / figure.picture.width:.3f}}}{{{drawn}}}"
        return rf"\shortstack{{{drawn}\\{escaped(name)}}}" if name else drawn

    def note(self, lines: Any) -> str:
        return "\n".join(breakable(line) + r"\par" for line in lines)

    def _grid(self, grid: WordTable) -> str:
        columns = "l" * max(map(len, grid.rows), default=1)
        head = [" & ".join(map(escaped, grid.head)) + r" \\ \hline"] if grid.head else []
        rows = [" & ".join(map(self.words, row)) + r" \\" for row in grid.rows]
        table = [rf"\begin{{longtable}}[l]{{@{{}}{columns}@{{}}}}", *head, *rows, r"\end{longtable}"]
        return "\n".join([rf"\subsubsection*{{{escaped(grid.title)}}}", *table])


@dataclass(frozen=True, eq=False, repr=False)
class Report:
    r"""What is known of a system, to be written as a page of HTML or as LaTeX; a notebook shows the page.

    `kind`: a whole `report`, an `exercise` without answers, or the `answers` alone. LaTeX is a `fragment` for `\\input`
    or a whole document. `variant` names the numbers of an exercise.
    """

    findings: Findings
    units: Units = SI
    kind: str = "report"
    fragment: bool = False
    variant: str = ""

    def __repr__(self) -> str:
        parts = ("figure", "equations", "solution", "check", "run")
        there = [part for part in parts if not isinstance(getattr(self.findings, part), Missing)]
        return f"<Report of {self.findings.system.name}: {', '.join(there) or 'nothing found'}>"

    @property
    def _title(self) -> str:
        added = ", ".join(part for part in (self.variant, "answers" if self.kind == "answers" else "") if part)
        return Description(self.findings.system).title + (f" ({added})" if added else "")

    def _content(self) -> tuple[list[Section], Notation]:
        """Return the sections, and the notation of all letters outside of documents of their own."""
        found = self.findings
        coordinates = () if isinstance(found.solution, Missing) else found.solution.coordinates
        if not coordinates and not isinstance(found.run, Missing):
            coordinates = found.run.final["coordinates"]
        letters = SystemLetters(found.system, coordinates)
        written = _CONTENT[self.kind](found, self.units, letters)
        return written, letters.notation

    @cached_property
    def html(self) -> str:
        """The report as a page that needs nothing beside it."""
        written, notation = self._content()
        return ReportHtml(notation, self.units).report(self._title, written)

    @door
    def latex(self, plot: str | None = None) -> str:
        """Return the report as LaTeX; `plot` is the file of the run's plot that it shows.

        Raises InputError for a `plot` that is no name of a file.
        """
        plot = None if plot is None else text("plot", plot)
        written, notation = self._content()
        prefix = re.sub(r"[^A-Za-z0-9]+", "-", self.findings.system.name) if self.fragment else ""
        writer = ReportLatex(notation, self.units, plot=plot, prefix=prefix)
        return (writer.fragment if self.fragment else writer.report)(self._title, written)

    @door
    def write(self, path: str | os.PathLike[str]) -> list[str]:
        """Write it as .html or .tex and return the names of the files: LaTeX has the plot of the run beside it.

        An exercise with numbers of its own has its answers beside it, as NAME_answers.
        Raises InputError for another ending, OutputError where a file cannot be written.
        """
        name = path_name(path)
        stem, ending = os.path.splitext(name)
        if report_ending(name, fragment=self.fragment) == ".html":
            write_whole(path, self.html.encode("utf-8"))
            files = [name]
        else:
            run, files, plot = self.findings.run, [name], ""
            if self.kind == "report" and not isinstance(run, Missing) and len(run):
                plot = f"{stem}_plot.pdf"
                run.plot(plot, self.units)
                files.append(plot)
            write_whole(path, self.latex(os.path.basename(plot) or None).encode("utf-8"))
        if self.kind == "exercise" and self.variant:
            files += replace(self, kind="answers").write(f"{stem}_answers{ending}")
        return files


def report_ending(name: str, *, fragment: bool = False) -> str:
    """Return the ending of a report's name. Raises InputError for one that is none, or no LaTeX for a fragment."""
    ending = os.path.splitext(name)[1].lower()
    if ending not in ENDINGS:
        message = f"a report is written to {' or '.join(ENDINGS)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name), number="U103")
    if fragment and ending != ".tex":
        message = "a fragment is LaTeX: give it a name that ends with .tex"
        raise InputError(message, where=Where(file=name), number="U103")
    return ending


@spelled_out(RunOptions)
def report(
    system: System,
    path: str | os.PathLike[str] | None = None,
    *,
    units: str | Units | None = None,
    digits: int = DIGITS,
    exercise: bool = False,
    numbers: int | None = None,
    fragment: bool = False,
    command: str = "",
    **options: Unpack[RunOptions],
) -> Report:
    r"""Return a report of a system, written to `path` (.html, .tex) if one is given.

    It begins with the question (the description), the figure and the answers: those to `ask`, or the results that the
    words of the question name. Then the solution at the start step by step with bodies cut free, the motion with its
    greatest reactions, and details: equations of motion, checks, method, the `command` that made it. Numbers have
    `digits` digits; parameters have their declared units. An `exercise` has only figure, givens and question.
    `numbers`, a seed, takes other round numbers for the parameters, for which contacts and friction start in the same
    states, also in the description; written, such an exercise has its answers beside it. A `fragment` is LaTeX for
    `\\input`, whose section and equations have labels.
    `parameters` to `project` change the system for this call; `t_end` .. `constraints`, `formalism`,
    `native` and `backend`: as for `simulate`.
    Raises InputError, OutputError; the report states which answers are missing, and why.
    """
    verify_system(system)
    told = replace(chosen_units(units), digits=whole_number("digits", digits, _MOST_DIGITS))
    told = replace(told, angles=told.angles or angles_of(system))
    wanted, part = flag("exercise", exercise), flag("fragment", fragment)
    seed = None if numbers is None else whole_number("numbers", numbers)
    if path is not None:
        report_ending(path_name(path), fragment=part)
    settings = {name: value for name, value in options.items() if name not in MODEL_OVERRIDES}
    asked = with_overrides(system, options)
    if seed is not None:
        asked = other_numbers(asked, seed)
    variant = "" if seed is None else f"numbers {seed}"
    found = Report(
        findings(asked, command, settings, exercise=wanted), told, "exercise" if wanted else "report", part, variant
    )
    if path is not None:
        found.write(path)
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Which other numbers may an exercise have: round ones near the declared, for which the answer keeps its form?


_TRIES: Final = 30
_LOWEST, _HIGHEST = Decimal("0.6"), Decimal("1.5")
"""The parts of a declared number between which others are."""
_STEPS: Final = tuple(map(Decimal, ("5", "1", "0.5", "0.1")))
"""What numbers are multiples of, in units of the declared number's last place: the first that leaves a choice."""
_FEWEST: Final = 4
_RIGHT_ANGLE: Final = Decimal(90)
_NUMBER: Final = re.compile(r"(-?\d+(?:\.\d+)?)(?: ?([A-Za-z1][\w/*^()-]*))?")


@dataclass(frozen=True)
class _Varied:
    """Parameters that are declared by one text, whose number and unit it is."""

    names: tuple[str, ...]
    number: Decimal
    unit: str

    def drawn(self, random: Random) -> Decimal:
        """Return another number, as round as the declared one as far as that leaves a choice."""
        last = Decimal(1).scaleb(int(self.number.as_tuple().exponent))
        steps = (part * last for part in _STEPS if part <= 1 or self.number % (part * last) == 0)
        return random.choice(next(x for x in map(self._between, steps) if len(x) >= _FEWEST))

    def _between(self, step: Decimal) -> list[Decimal]:
        low, high = sorted((self.number * _LOWEST / step, self.number * _HIGHEST / step))
        every = [k * step for k in range(-int(-low // 1), int(high // 1) + 1)]
        acute = self.unit == "deg" and abs(self.number) < _RIGHT_ANGLE
        return [x for x in every if x != self.number and x and not (acute and abs(x) >= _RIGHT_ANGLE)]

    def text(self, number: Decimal) -> str:
        return f"{number.normalize():f} {self.unit}".strip()

    def said(self, description: str, number: str) -> str:
        """Return a description with another number where it names this one: `6 kg`, `45 and 30 deg`, `mu = 0.1`."""
        old = rf"(?<![\d.]){re.escape(str(self.number))}"
        if self.unit:
            unit = re.escape(self.unit) + r"(?![\w/^])"
            return re.sub(rf"{old}(?=\s+{unit}|(?:,| and| or|,? to)\s+[\d.]+\s+{unit})", number, description)
        named = "|".join(map(re.escape, self.names))
        return re.sub(rf"\b({named}) = {old}(?![\d.]*\d)", rf"\1 = {number}", description)


def other_numbers(system: System, seed: int) -> System:
    """Return the system with other numbers of its parameters; the same for the same seed.

    Numbers of gravity and pure counts stay. Parameters declared by one text, such as two of `1 kg`, stay equal. The
    states of contacts, ropes and friction at the start stay as they are, so that the question keeps its answer's form.
    Raises InputError for a model without such parameters, and where no such numbers were found.
    """
    varied = _varied(system)
    if not varied:
        message = "no parameter has a number that may differ: declare the numbers of the exercise under parameters"
        raise InputError(message, number="M106")
    random, wanted = Random(seed), _kind(system)
    for _ in range(_TRIES):
        drawn = [(each, each.drawn(random)) for each in varied]
        try:
            changed = with_values(system, {name: each.text(x) for each, x in drawn for name in each.names})
            found = _kind(changed)
        except MultibodyError:
            continue
        if found == wanted:
            return replace(changed, description=_described(system.description, drawn))
    message = f"none of {_TRIES} sets of numbers leaves contacts and friction in the states of the declared ones"
    raise InputError(f"{message}; try another seed, or declare numbers farther from where a state ends", number="M106")


def _varied(system: System) -> list[_Varied]:
    falls = {leaf.data for leaf in leaves(system.gravity or (), "symbol")}
    texts: dict[tuple[Decimal, str], list[str]] = {}
    for name, parameter in system.parameters.items():
        given = parameter.given("value")
        told = str(given).strip() if isinstance(given, (str, int, float)) and not isinstance(given, bool) else ""
        typed = None if name in falls else _NUMBER.fullmatch(told)
        if typed is not None and Decimal(typed[1]) and (typed[2] or "." in typed[1]):
            texts.setdefault((Decimal(typed[1]), typed[2] or ""), []).append(name)
    return [_Varied(tuple(names), *key) for key, names in texts.items()]


def _kind(system: System) -> Any:
    """Return in which states everything is at the start; None where there is no solution in numbers."""
    try:
        found = solve(system)
    except InputError:
        raise
    except MultibodyError:
        return None
    known = tuple(name for name, value in found.answers.items() if value.value is not None)
    struck = {} if found.impact is None else dict(found.impact.states)
    return dict(found.states), struck, found.verdict, known


def _described(description: str | None, drawn: Iterable[tuple[_Varied, Decimal]]) -> str | None:
    """Return a description in which all numbers change at once."""
    if description is None:
        return None
    marks = {}
    for k, (each, number) in enumerate(drawn):  # a number that was put in is not looked at again
        marks[f"\0{k}\0"] = f"{number.normalize():f}"
        description = each.said(description, f"\0{k}\0")
    for mark, told in marks.items():
        description = description.replace(mark, told)
    return description
