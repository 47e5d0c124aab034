"""What does a report know: all answers on a system, and what its description asks?

In: a System with settings of a run. Out: Findings, each answer or the reason why there is none; a Description.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.analysis.check import CheckReport, check
from multibody_sym.analysis.modes.modes import modes
from multibody_sym.analysis.modes.record import Modes
from multibody_sym.analysis.rest.range_of_rest import RangeOfRest, range_of_rest
from multibody_sym.answers.free_bodies import CutFree, all_arrows, at_start, open_of, shown_components
from multibody_sym.answers.records import Solution
from multibody_sym.answers.solve import solve
from multibody_sym.derivation.derive import derive
from multibody_sym.derivation.free_bodies import component_label
from multibody_sym.documents.derivation import ClosedForm
from multibody_sym.documents.draw import draw
from multibody_sym.documents.section_diagrams import section_diagrams
from multibody_sym.dynamics.start.parameters import known_values
from multibody_sym.errors import MultibodyError, NoSolutionError
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.parameters import DimensionField, Parameter
from multibody_sym.model.system import System
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.simulate import simulate
from multibody_sym.pictures.diagrams import below_figure
from multibody_sym.pictures.draw import Figure, FigureContent
from multibody_sym.pictures.draw import draw as draw_scene
from multibody_sym.pictures.scene.scene import scene_of
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.printer import COMPONENTS
from multibody_sym.text.values import Units

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
    cut = CutFree(system, scene, scene.motion(), *at_start(solution))
    arrows = all_arrows(cut)
    rests = not any(x.value for x in solution.accelerations.values()) and not any(solution.speeds.values())
    cones = tuple(cut.cones()) if rests else ()
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
            own = tuple(cone for cone in cones if cone.at.body == k)
            undrawn = tuple(sorted(letters.get(k, ())))
            shown = FigureContent(names="none", reactions=on_body, undrawn=undrawn, cones=own)
            placed = replace(scene.at(), strands=(), vectors=np.zeros((0, 3)))
            figures[body.name] = Figure(draw_scene(alone, placed, shown=shown))
    return figures


_MOST_INSTANTS: Final = 3


def instants(run: Trajectory, units: Units) -> Mapping[str, Figure]:
    """Return figures of a system in the course of a run, by their times: what paper shows in place of a film."""
    scene, shown = scene_of(run.ready.system), FigureContent(names="none")
    last = len(run) - 1
    places = dict.fromkeys(round(last * (k + 1) / _MOST_INSTANTS) for k in range(_MOST_INSTANTS)) if last > 0 else {}
    figures = {}
    for k in places:
        placed = scene.placed(scene.motion(run.q[k], run.u[k], float(run.t[k])))
        figures[f"t = {units.said(float(run.t[k]), 's')}"] = Figure(draw_scene(scene, placed, shown=shown))
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
    """A parameter: its name, its declaration, its number and SI unit."""

    name: str
    declared: Parameter
    number: float | None
    unit: str


@dataclass(frozen=True, eq=False)
class Findings:
    """All answers that a report holds of a `system`; `command` makes it once more.

    A system without questions has its small motions as `modes` if nothing is accelerated at the start, and as `rest`
    the values of its only coefficient of friction at which it rests if it starts without a speed.
    """

    system: System
    command: str
    parameters: tuple[ReportedParameter, ...]
    figure: Figure | Missing
    bodies: Mapping[str, Figure] | Missing
    diagrams: Figure | Missing
    equations: ClosedForm | Missing
    solution: Solution | Missing
    check: CheckReport | Missing
    run: Trajectory | Missing
    modes: Modes | Missing
    rest: RangeOfRest | Missing


_NOT_ASKED: Final = Missing("not asked for")


def findings(system: System, command: str, settings: Mapping[str, Any], *, exercise: bool = False) -> Findings:
    """Return the answers on a system; `settings` are those of the run. An exercise has no details."""
    solution = answer(lambda: _in_symbols(system, lambda: solve(system, steps=True)))
    unasked = None if isinstance(solution, Missing) or system.ask or solution.impact is not None else solution
    rough = None if unasked is None or any(unasked.speeds.values()) else only_coefficient(system)
    cut = not exercise and any(ask.section is not None for ask in system.ask.values())
    steady = unasked is not None and not (unasked.states or any(x.value for x in unasked.accelerations.values()))
    return Findings(
        system=system,
        command=command,
        parameters=reported_parameters(system),
        figure=answer(lambda: draw(system)),
        bodies=_NOT_ASKED if exercise else answer(lambda: free_bodies(system)),
        diagrams=answer(lambda: Figure(below_figure(None, section_diagrams(system)))) if cut else _NOT_ASKED,
        equations=_NOT_ASKED if exercise else answer(lambda: _in_symbols(system, lambda: derive(system))),
        solution=solution,
        check=_NOT_ASKED if exercise else answer(lambda: check(system)),
        run=answer(lambda: simulate(system, **settings)),
        modes=answer(lambda: modes(system)) if steady else _NOT_ASKED,
        rest=_NOT_ASKED if rough is None else answer(lambda: range_of_rest(system, rough)),
    )


def only_coefficient(system: System) -> str | None:
    """Return the one parameter that is a coefficient of friction; None for none or several."""
    rough = (*system.contacts.values(), *system.forces.values())
    given = [getattr(each, key, None) for each in rough for key in ("static", "kinetic")]
    names = {leaf.data for leaf in leaves([x for x in given if isinstance(x, Node)], "symbol")}
    return names.pop() if len(names) == 1 and names <= set(system.parameters) else None


def reported_parameters(system: System) -> tuple[ReportedParameter, ...]:
    """Return the parameters in the order of the model, with numbers of those that follow from others."""
    known = known_values(system)
    inferred = answer(lambda: MechanismUnits(mechanism(system)).parameters)
    units = {} if isinstance(inferred, Missing) else inferred
    stated = {name: x.dimension for name, x in system.parameters.items() if x.dimension is not None}
    units = {**units, **{name: DimensionField().tree(dimension) for name, dimension in stated.items()}}
    return tuple(
        ReportedParameter(name, parameter, known.get(symbol(name)), units.get(name, ""))
        for name, parameter in system.parameters.items()
    )


def _in_symbols(system: System, question: Callable[[], _T]) -> _T:
    """Return an answer in symbols. Raises NoSolutionError for systems whose equations nobody would read."""
    if len(system.bodies) > _MOST_BODIES:
        raise NoSolutionError(f"{len(system.bodies)} bodies: formulas of so many are longer than a report")
    return question()


def answer(question: Callable[[], _T]) -> _T | Missing:
    """Return an answer, or the first line of the reason why there is none."""
    try:
        return question()
    except MultibodyError as error:
        return Missing(str(error).splitlines()[0])


# ----------------------------------------------------------------------------------------------------------------------
# What the description says and asks.


_LONGEST_TITLE: Final = 90
_CLAUSE: Final = re.compile(r"(.+?)(?:[:;?]|,(?= )|\.(?=\s|$))", re.DOTALL)
_SENTENCE: Final = re.compile(r".+?(?:[.?!](?=\s|$)|$)", re.DOTALL)


class Description:
    """The description of a system: its title, its facts, and the questions in it."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._paragraphs = [" ".join(part.split()) for part in (system.description or "").split("\n\n")]

    @property
    def title(self) -> str:
        """The first clause of the description, the model's name where that is long or there is none."""
        match = _CLAUSE.match(re.sub(r" ?\([^)]*\)", "", self._paragraphs[0]))
        clause = "" if match is None else match[1].strip()
        return clause if 0 < len(clause) <= _LONGEST_TITLE else self._system.name

    @cached_property
    def paragraphs(self) -> list[tuple[str, str]]:
        """The paragraphs, each as its facts and the questions that end it."""
        found = []
        for paragraph in self._paragraphs:
            sentences = [part.strip() for part in _SENTENCE.findall(paragraph) if part.strip()]
            asked = [part for part in sentences if part.endswith("?")]
            found.append((" ".join(part for part in sentences if part not in asked), " ".join(asked)))
        return [pair for pair in found if any(pair)]



