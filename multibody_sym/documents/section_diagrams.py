"""N, V and M along the beams of a system: diagrams below its figure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.answers.ask.sections import CutBeam
from multibody_sym.answers.instant.instant import SolvedInstant, solved_start
from multibody_sym.dynamics.programs.sections import LETTERS, UNITS
from multibody_sym.errors import ModelError, NoSolutionError
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.system import System
from multibody_sym.pictures.diagrams import Diagram, DiagramValue, named_values
from multibody_sym.scalars.elementary import leaves
from multibody_sym.text.printer import text
from multibody_sym.text.values import SI, Units, Value

_POINTS: Final = 49
_LONGEST: Final = 14
"""Letters of a formula that stands at a value; numbers stand for longer ones."""


def section_diagrams(system: System, units: Units = SI, *, needed: bool = True) -> list[Diagram]:
    """Return N, V and M of each beam at the start, those that are zero all along left out.

    Beams are those of the questions about sections; of a structure without one all bodies that loads cut in stretches.
    Raises NoSolutionError where there is no beam, though one is `needed`, or statics alone does not
    determine its sections; ModelError where a load has no place on it.
    """
    names = list(dict.fromkeys(x.section for x in system.ask.values() if x.section is not None))
    if not names and not needed:
        return []
    solved = solved_start(system)
    if not names:
        beams = list(_beams_of_structure(solved)) if solved.is_structure else []
        if not beams:
            message = "no beam to cut: ask for a section or a velocity, such as M: {section: beam, component: moment}"
            raise NoSolutionError(message, number="N111")
    else:
        beams = [(name, CutBeam(solved, name)) for name in names]
    found: list[Diagram] = []
    for name, beam in beams:
        if beam.undetermined:
            message = f"statics alone does not determine {beam.undetermined}, and so no diagrams of {name}"
            raise NoSolutionError(message, number="N111")
        own = [_diagram(name, beam, component, units) for component in LETTERS]
        found += [each for each in own if each.values]
    return found


def _beams_of_structure(solved: SolvedInstant) -> Iterator[tuple[str, CutBeam]]:
    for name in solved.system.bodies:
        if name == GROUND:
            continue
        try:
            yield name, CutBeam(solved, name)
        except ModelError:
            continue


def _diagram(name: str, beam: CutBeam, component: str, units: Units) -> Diagram:
    curves = []
    for stretch in beam.stretches:
        x = np.linspace(stretch.begin, stretch.end, _POINTS)
        curves.append((x, np.array([beam.number(component, stretch, at) for at in x])))
    values = [
        DiagramValue(each.place.value or 0.0, each.value.value or 0.0, _value_text(each.value, component, units))
        for each in beam.extremes(component)
    ]
    length = beam.stretches[-1].end - beam.stretches[0].begin
    return Diagram(name, LETTERS[component], curves, named_values(values, length), hangs=component == "moment")


def _value_text(value: Value, component: str, units: Units) -> str:
    """Return a value as its formula where that is short, else as a number with its unit."""
    if value.expression is not None and leaves([value.expression], "symbol"):
        formula = text(value.expression)
        if len(formula) <= _LONGEST:
            return formula
    return units.said(value.value or 0.0, UNITS[component], digits=5).replace("*", "\u2009")
