"""`draw`: the figure of a system at its start, or where its motion has brought it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, Unpack, get_args

import numpy as np

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.redundancy import redundancy
from multibody_sym.dynamics.start.number_checks import numbers_of
from multibody_sym.errors import ArgumentError, InputError, Where
from multibody_sym.errors import at as within
from multibody_sym.errors import short_repr as shown_value
from multibody_sym.mechanics.changes import with_overrides
from multibody_sym.mechanics.motion import Motion
from multibody_sym.model.argument_checks import callback, flag, text
from multibody_sym.model.fields import scalar
from multibody_sym.model.run_options import ModelOptions, spelled_out
from multibody_sym.model.system import System
from multibody_sym.pictures.diagrams import below_figure
from multibody_sym.pictures.draw import Figure, FigureContent, ending_of
from multibody_sym.pictures.draw import draw as draw_scene
from multibody_sym.pictures.marks.labels import Names
from multibody_sym.pictures.scene.items import Path
from multibody_sym.pictures.scene.scene import Scene, scene_of, stripped

if TYPE_CHECKING:  # a figure at the start needs no run
    from multibody_sym.motion.results.trajectory import Trajectory

_SECTIONS: Final = ("bodies", "joints", "constraints", "forces", "contacts", "pulleys")
_STILL: Final = 1e-6
"""m/s, rad/s: what is slower rests, as far as its figure says."""
_MOMENT: Final = 1e-9
"""How long (s) a run lasts from which the forces at the start are taken."""


@spelled_out(ModelOptions)
def draw(
    system: System,
    path: str | os.PathLike[str] | None = None,
    *,
    at: Any = 0.0,
    view: str | Sequence[float] | None = None,
    forces: bool = False,
    reactions: bool = False,
    names: Names = "letters",
    dimensions: bool = True,
    redundant: bool = False,
    diagrams: bool = False,
    phase: str | None = None,
    mark: Mapping[str, str] | Sequence[str] | None = None,
    strip: str | Sequence[str] = (),
    on_progress: Callable[[float], None] | None = None,
    **options: Unpack[ModelOptions],
) -> Figure:
    """Return the figure of a system, which a notebook shows; written to `path` (.svg, .png, .pdf, .tex) if it is given.

    Arguments: `at`, a time (s, or text such as `0.5 s`) to which the system is simulated; `view`: front, back, top,
    right, left, iso, or azimuth and elevation in degrees, else the plane of motion or a look from in front and above;
    declared forces and torques are always shown; `forces` add weights, pulls of springs and drags, `reactions` what
    joints exert on their children, contacts, ropes and rods, by the letters of `solve`'s steps, with the cones of
    friction of contacts that stick at rest (the figure's description says which are not unique); `names`: the problem's
    `letters` (of masses, springs, coefficients, pins A, B), `all`, names of bodies, joints and ropes too, or `none`;
    what finds no room, and what is given without a place, stands in a legend; `dimensions` are named lengths;
    `redundant` marks joints and constraints with rows that follow from others; `diagrams` draws N, V and M along beams
    below, of which `ask` names a section, else along those of a structure, and plans of the velocities and
    accelerations that `ask` names; `phase`: instead the phase portrait of this coordinate, with closed curves, the
    separatrix and fixed points, or Poinsot's ellipsoid with its polhodes of this body, which turns freely; `mark` what
    stands at places of the model such as `joints.A`, with a word each if it is a mapping; `strip`, text or several with
    which names begin and that letters leave out (`panda_`); `parameters` to `project` change the system for this call;
    `formalism` for a run, of which `on_progress` is called with the part that is done; Ctrl-C ends it.
    Raises InputError, NoSolutionError where there is no start, RunError, OutputError.
    """
    flags = {"forces": forces, "dimensions": dimensions, "reactions": reactions, "redundant": redundant}
    wanted = {name: flag(name, value) for name, value in (flags | {"diagrams": diagrams}).items()}
    _verify_names(names)
    if path is not None:
        ending_of(path)
    asked = with_overrides(system, options)
    if phase is not None:
        return _written(_phase_portrait(asked, phase), path)
    with numbers_of(asked):
        scene = stripped(scene_of(asked), _prefixes(strip))
        progress = callback("on_progress", on_progress)
        run = _run(asked, at, options.get("formalism"), progress, reactions=wanted["reactions"])
        motion = scene.motion()
        if run is not None:  # a moment after the start is the start
            k = 0 if run.t[-1] <= _MOMENT else -1
            motion = scene.motion(run.q[k], run.u[k], float(run.t[k]))
        content = FigureContent(names=names, marked=_marked_paths(asked, mark))
        shown = _with_wanted(content, asked, scene, motion, run, wanted)
        figure = Figure(draw_scene(scene, scene.placed(motion), view=view, shown=shown))
        figure = _with_diagrams(figure, asked) if wanted["diagrams"] else figure
    return _written(figure, path)


def _written(figure: Figure, path: str | os.PathLike[str] | None) -> Figure:
    if path is not None:
        figure.write(path)
    return figure


def _with_wanted(
    content: FigureContent,
    asked: System,
    scene: Scene,
    motion: Motion,
    run: Trajectory | None,
    wanted: Mapping[str, bool],
) -> FigureContent:
    """Return the content of a figure with the forces, reactions, dimensions and redundant rows that it shall show."""
    shown = replace(content, dimensions=wanted["dimensions"], forces=wanted["forces"])
    if wanted["forces"] or wanted["reactions"]:
        shown = replace(shown, **_arrows(asked, scene, motion, run, wanted))
    if wanted["reactions"] and run is not None:
        shown = _with_open(shown, run, scene)
    if wanted["redundant"]:
        shown = replace(shown, marked={**_redundant_paths(asked, scene), **shown.marked})
    return shown


def _phase_portrait(asked: System, of: str) -> Figure:
    """Return the phase portrait of a coordinate, or the polhodes of a body."""
    from multibody_sym.analysis.phase_plane import PhasePlane
    from multibody_sym.documents.diagrams import polhodes_of

    with numbers_of(asked), within("phase"):
        if text("phase", of) in asked.bodies:
            return Figure(polhodes_of(asked, of).picture(asked.name))
        return Figure(PhasePlane.of(asked, of).portrait().picture(asked.name))


def _with_diagrams(figure: Figure, asked: System) -> Figure:
    """Return a figure with the plans of its velocities and accelerations below, and with N, V and M along its beams."""
    from multibody_sym.documents.diagrams import motion_diagrams, section_diagrams

    plans = motion_diagrams(asked)
    return Figure(below_figure(figure.picture, [*plans, *section_diagrams(asked, needed=not plans)]))


def _verify_names(names: Any) -> None:
    if not isinstance(names, str) or names not in get_args(Names):
        raise ArgumentError(f"names: expected {', '.join(get_args(Names))}, got {shown_value(names)}").under("names")


def _redundant_paths(system: System, scene: Scene) -> dict[Path, str]:
    """Return the joints and constraints that have rows which follow from others at the start."""
    motion = scene.motion()
    found = redundancy(motion, composite_body(scene.mechanism, motion.state))
    owners = {name.rpartition(".")[0] or name for name in found.redundant} | set(found.redundant)
    return {place: "redundant" for place in _paths(system) if place[1] in owners}


def _prefixes(strip: str | Sequence[str]) -> tuple[str, ...]:
    """Return the beginnings of names that letters leave out. Raises ArgumentError."""
    found = (strip,) if isinstance(strip, str) else strip
    if not isinstance(found, (list, tuple)) or not all(isinstance(each, str) for each in found):
        raise ArgumentError(f"strip: expected text such as 'panda_', got {shown_value(strip)}").under("strip")
    return tuple(found)


def _run(
    system: System, at: Any, formalism: str | None, on_progress: Callable[[float], None] | None, *, reactions: bool
) -> Trajectory | None:
    """Return the run that leads to a time, a moment at the start where forces are asked for there; else none.

    Raises InputError where the run ends before that time.
    """
    with within("at"):
        time = scalar(at, "s").shadow
    if time is not None and not time >= 0.0:
        raise InputError(f"expected a time from 0 on, got {shown_value(at)}", where=Where(path=("at",)))
    if time == 0.0 and not reactions:
        return None
    from multibody_sym.motion.simulate import simulate

    try:
        run = simulate(
            system,
            t_end=at if time != 0.0 else _MOMENT,
            samples=2,
            formalism=formalism,
            on_progress=None if on_progress is None else lambda _samples, part: on_progress(part),
        )
    except InputError as error:
        if error.where.path[-1:] == ("t_end",):
            error.where = replace(error.where, path=("at",))
        raise
    if run.interrupted:
        raise KeyboardInterrupt(f"the run had come to t = {run.t_final:g} s: nothing is drawn")
    if time != 0.0 and run.stop is not None:
        message = f"the motion ends at t = {run.t[-1]:g} s ({run.stop['element']}), before the time that is asked for"
        raise InputError(message, where=Where(path=("at",)))
    return run


def _arrows(
    system: System, scene: Scene, motion: Motion, run: Trajectory | None, wanted: Mapping[str, bool]
) -> dict[str, Any]:
    """Return what acts on bodies beside declared forces: weights and springs, reactions at a run's end, their cones."""
    from multibody_sym.answers.free_bodies import CutFree, applied_arrows, at_end, reaction_arrows

    if run is None or not wanted["reactions"]:
        return {"reactions": applied_arrows(CutFree(system, scene, motion, {}))}
    cut = CutFree(system, scene, motion, *at_end(run))
    arrows = (*(applied_arrows(cut) if wanted["forces"] else ()), *reaction_arrows(cut))
    rests = not any(abs(u) > _STILL for u in motion.state.u)
    return {"reactions": arrows, "cones": tuple(cut.cones()) if rests else ()}


def _with_open(shown: FigureContent, run: Trajectory, scene: Scene) -> FigureContent:
    """Return what is shown with what is not unique: the elements, each once, whether they are drawn and how."""
    from multibody_sym.answers.free_bodies import shown_components
    from multibody_sym.derivation.free_bodies import component_label
    from multibody_sym.text.parser import force_name

    seen, dashed = shown_components(scene), {arrow.name for arrow in shown.reactions if arrow.open}
    elements = {row.name: element for element in run.ready.mechanism.one_way for row in element.rows}
    told: dict[str, str] = {}
    undrawn: list[str] = []
    for name, components in run.redundancy.ambiguous.items():
        element = elements.get(name)
        kept = [each for each in components if seen(each[0] == "m", np.eye(3)["xyz".index(each[1])])]
        if element is not None and element.kind != "rope":
            word = "dashed" if element.path[1] in dashed else "their sum is drawn"
            told[element.name] = f"{element.name} ({word})"
        elif kept or not components:
            told[name] = f"{', '.join([force_name(name, each) for each in kept]) or name} (not drawn)"
            undrawn += [component_label(name, each).text for each in kept] or [name]
    return replace(shown, not_unique=tuple(told.values()), undrawn=tuple(undrawn))


def _marked_paths(system: System, marked: Mapping[str, str] | Sequence[str] | None) -> dict[Path, str]:
    """Return paths with words of what is to stand out. Raises InputError for a place that the model does not have."""
    if isinstance(marked, str):
        marked = [marked]
    if marked is not None and not isinstance(marked, (Mapping, list, tuple)):
        raise ArgumentError(f"mark: expected places such as joints.A, got {shown_value(marked)}").under("mark")
    words = dict(marked) if isinstance(marked, Mapping) else {str(place): "" for place in marked or ()}
    known = {".".join(path): path for path in _paths(system)}
    for place in words:
        if place not in known:
            message = f"there is nothing at {shown_value(place)}"
            raise InputError(message, where=Where(path=("mark",)), word=str(place), known=known)
    return {known[place]: str(word) for place, word in words.items()}


def _paths(system: System) -> Iterator[Path]:
    for section in _SECTIONS:
        for name in getattr(system, section):
            yield section, name
