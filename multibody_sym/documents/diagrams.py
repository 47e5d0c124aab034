"""What is drawn below a figure or in its place: N, V and M along beams, plans of velocities, Poinsot's ellipsoid."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Final

import numpy as np

from multibody_sym.answers.ask.principal_axes import inertia_in_numbers
from multibody_sym.answers.ask.sections import CutBeam
from multibody_sym.answers.instant.instant import SolvedInstant, solved_start
from multibody_sym.dynamics.programs.sections import LETTERS, UNITS
from multibody_sym.errors import ModelError, NoSolutionError
from multibody_sym.mechanics.references import moves_in_plane
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.fields import AXES
from multibody_sym.model.joints import Revolute
from multibody_sym.model.system import System
from multibody_sym.pictures.diagrams import Diagram, DiagramValue, VectorPlan, named_values
from multibody_sym.pictures.phase_portrait import Polhodes
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import quantity
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


# ----------------------------------------------------------------------------------------------------------------------
# Plans of velocities and accelerations of a linkage whose questions name some: vectors to scale from one origin.


_KINDS: Final = {"velocity": ("velocities", "m/s"), "acceleration": ("accelerations", "m/s^2")}


def motion_diagrams(system: System) -> list[VectorPlan]:
    """Return a plan of each kind that questions are about, of plane models: moving pins, and the points asked for."""
    asked = {kind: [x for ask in system.ask.values() if (x := getattr(ask, kind)) is not None] for kind in _KINDS}
    if not any(asked.values()) or not moves_in_plane(system):
        return []
    solved, pins = solved_start(system), list(_pins(system))
    found = []
    for kind, names in asked.items():
        if names:
            points = {name: _vector(solved, kind, name) for name in dict.fromkeys([*(pin for pin, _ in pins), *names])}
            if any(x or y for x, y in points.values()):
                found.append(VectorPlan(*_KINDS[kind], points, list(_joined(points, pins))))
    return found


def _pins(system: System) -> Iterator[tuple[str, str]]:
    """Yield the points of moving bodies about which others turn, with these bodies."""
    for joint in system.joints.values():
        if isinstance(joint, Revolute) and "." in joint.parent and joint.parent.partition(".")[0] != GROUND:
            yield joint.parent, joint.child.partition(".")[0]


def _joined(points: dict[str, tuple[float, float]], pins: list[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield neighbours among the points of each body."""
    of_body: dict[str, list[str]] = {}
    for pin, child in pins:
        of_body.setdefault(child, []).append(pin)
    for name in points:
        of_body.setdefault(name.partition(".")[0], []).append(name)
    for names in of_body.values():
        yield from pairwise(dict.fromkeys(names))


def _vector(solved: SolvedInstant, kind: str, name: str) -> tuple[float, float]:
    return solved.number(quantity(kind, (name, "x"))), solved.number(quantity(kind, (name, "y")))


# ----------------------------------------------------------------------------------------------------------------------
# Poinsot's construction for a body that turns without moments, from its start.


_FREE: Final = 1e-9
"""The part of omega x J omega and J alpha below which their sum is no moment."""


def polhodes_of(system: System, body: str) -> Polhodes:
    """Return the polhodes of a body. Raises ModelError for an unknown one, NoSolutionError where it is not free."""
    solved = solved_start(system)
    motion, place = solved.numbers.motion, solved.mechanism.body_index(body)
    world = np.array(motion.poses[place][0], dtype=float)
    tensor = inertia_in_numbers(motion, (place,))
    omega, alpha = (
        world.T @ np.array([solved.number(quantity(name, (body, axis))) for axis in AXES])
        for name in ("angular_velocity", "angular_acceleration")
    )
    turning, grown = np.cross(omega, tensor @ omega), tensor @ alpha
    if np.abs(turning + grown).max() > _FREE * float(np.abs([turning, grown]).max()):
        raise NoSolutionError(f"moments about its centre of mass act on {body}: it does not turn freely", number="N111")
    moments, axes = np.linalg.eigh(tensor)
    if not omega.any() or not moments[0] > 0.0:
        why = "does not turn" if not omega.any() else "has a moment of inertia that is zero"
        raise NoSolutionError(f"{body} {why}: it has no energy ellipsoid", number="N111")
    return Polhodes(body, moments, axes.T @ omega)
