"""`report`: a system as one document to hand in, HTML or LaTeX."""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from typing import Any, Final

from multibody_sym.errors import InputError, Where
from multibody_sym.expressions.chosen_units import SI, Units, chosen_units
from multibody_sym.formats.files import path_name, write_whole
from multibody_sym.model.declaration.doors import door
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.model.resolution.changes import Changes
from multibody_sym.records import dataclass
from multibody_sym.writing.report.findings import Findings, Missing, findings

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
        from multibody_sym.writing.report.html import page

        return page(self.findings, self.units)

    @door
    def latex(self, plot: str | None = None) -> str:
        """Return the report as a LaTeX document; `plot` is the file of the run's plot that it shows."""
        from multibody_sym.writing.report.latex import document

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
    `parameters` .. `project`, what the call changes of the system (`Changes`); `formalism` and `settings` (t_end,
    method, step, rtol, atol, samples, constraints, native, backend) are those of the run.
    Raises InputError, OutputError; what cannot be found is told in the report.
    """
    verify_system(system)
    told = chosen_units(units)
    if path is not None:
        report_ending(path_name(path))
    asked = Changes(parameters, initial, inputs, coordinates, project).of(system)
    found = Report(findings(asked, command, {**settings, "formalism": formalism}), told)
    if path is not None:
        found.write(path)
    return found
