"""`report`: a system as one document to hand in or to hand out, HTML or LaTeX."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from functools import cached_property
from typing import Final, Unpack

from multibody_sym.derivation.notation import Notation
from multibody_sym.documents.document import Section
from multibody_sym.documents.exercise import other_numbers
from multibody_sym.documents.letters import SystemLetters
from multibody_sym.documents.report_content import answer_sections, exercise_sections, sections
from multibody_sym.documents.report_findings import Description, Findings, Missing, findings
from multibody_sym.documents.report_pages import ReportHtml, ReportLatex
from multibody_sym.errors import InputError, Where
from multibody_sym.mechanics.changes import with_overrides
from multibody_sym.model.argument_checks import door, flag, text, whole_number
from multibody_sym.model.run_options import MODEL_OVERRIDES, RunOptions, spelled_out
from multibody_sym.model.system import System, angles_of, verify_system
from multibody_sym.records import dataclass
from multibody_sym.text.files import path_name, write_whole
from multibody_sym.text.values import SI, Units, chosen_units

ENDINGS: Final = (".html", ".tex")


DIGITS: Final = 4
_MOST_DIGITS: Final = 17
_CONTENT: Final = {"report": sections, "exercise": exercise_sections, "answers": answer_sections}


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
