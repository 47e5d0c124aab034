"""`live`: a model that moves in a browser by equations of its own, with its parameters at hand."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import Any, Final, Unpack

import numpy as np

from multibody_sym.derivation.derive import derive
from multibody_sym.documents.animation.animate import (
    drawn_stage,
    framed,
    json_in_page,
    page,
    speed_options,
    three,
)
from multibody_sym.documents.animation.frames import ARC, Frames, frames_of
from multibody_sym.documents.derivation import derivation_document
from multibody_sym.documents.document import HtmlWriter
from multibody_sym.errors import InputError, ModelError, MultibodyError, Where
from multibody_sym.mechanics.changes import with_overrides
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, Mechanism
from multibody_sym.mechanics.motion import Motion, arrays, motion_of, slot_state
from multibody_sym.model.argument_checks import door
from multibody_sym.model.fields import fields_tree
from multibody_sym.model.run_options import ModelOptions, spelled_out
from multibody_sym.model.system import System
from multibody_sym.motion.prepare.export import ExportedModel
from multibody_sym.motion.results.trajectory import Trajectory
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.motion.simulate import simulate
from multibody_sym.pictures.marks.ropes import course
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.picture import Projection, letters
from multibody_sym.pictures.scene.forces import rope_points, ropes_of
from multibody_sym.pictures.scene.items import Anchor, PlacedStrand
from multibody_sym.pictures.scene.letters import names_in
from multibody_sym.program.program import Program, elements_read
from multibody_sym.program.target_layout import fill_template, template_text
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, as_node, slot
from multibody_sym.scalars.vectors import Vec, add, apply
from multibody_sym.text.files import path_name, write_whole

_ENDING: Final = ".html"
_BUDGET: Final = 20.0
"""CPU time (s) for the equations that stand below the picture."""
_SPEEDS: Final = (0.1, 0.25, 0.5, 1.0, 2.0, 5.0)
_SCRIPTS: Final = ("animation", "names")
_WRITTEN: Final = ("poses", "ropes", "pieces")
"""What the page computes itself."""


@dataclass(frozen=True, repr=False)
class LivePage:
    """A model as a page of HTML that needs nothing beside it and computes its motion itself; a notebook shows it."""

    name: str
    html: str

    def __repr__(self) -> str:
        return f"<LivePage of {self.name}: {len(self.html) // 1000} kB>"

    def _repr_html_(self) -> str:
        return framed(self.html)

    @door
    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the page. Raises InputError for a name that does not end in .html, OutputError."""
        verify_page_name(path)
        write_whole(path, self.html.encode("utf-8"))


def verify_page_name(path: str | os.PathLike[str]) -> None:
    """Raise InputError for a name that does not end in .html."""
    name = path_name(path)
    if os.path.splitext(name)[1].lower() != _ENDING:
        raise InputError("a live page is an .html file", where=Where(file=name), number="U103")


@spelled_out(ModelOptions)
def live(
    system: System,
    path: str | os.PathLike[str] | None = None,
    *,
    view: str | Sequence[float] | None = None,
    **options: Unpack[ModelOptions],
) -> LivePage:
    """Return a page on which a model moves, written to `path` (.html) if one is given.

    The page integrates the equations of motion in JavaScript, by the method of Dormand and Prince with adaptive steps.
    Its reader changes parameters and coordinates, drags bodies, and sees energies and any two quantities against each
    other. The address of the page holds its state. `view` is that of `draw`.
    `parameters` to `project` change the system for this call.
    Raises ModelError for models with contacts, stops, dry friction or impacts, and where nothing can move,
    NoSolutionError without a start, InputError, OutputError.
    """
    system = with_overrides(system, options)
    model = ExportedModel.of(system, options.get("formalism"))
    _verify(system, model)
    frames = frames_of(_run(system))
    made = LivePage(system.name, _page(system, model, frames, frames.projection(view)))
    if path is not None:
        made.write(path)
    return made


def _verify(system: System, model: ExportedModel) -> None:
    mechanism = model.mechanism
    if not mechanism.coordinates:
        raise ModelError("nothing can move: no joint has freedom", number="M117").under("joints")
    if mechanism.one_way or system.impact is not None or model.placed.closing:
        what = "contacts, stops, dry friction and impacts"
        message = f"a live page holds none of {what}; `animate` shows such a motion"
        raise ModelError(message, number="M110")
    if system.then:
        raise ModelError("a live page holds one stage; `animate` shows all of them", number="M110").under("then")


def _run(system: System) -> Trajectory:
    """Return the motion at the declared numbers, into which the picture fits."""
    try:
        return simulate(system)
    except FailedRunError as error:
        return error.trajectory


def _page(system: System, model: ExportedModel, frames: Frames, projection: Projection) -> str:
    """Return the page: stage, controls, data and scripts."""
    drawn, moved = _stage(frames, projection)
    data = {key: value for key, value in moved.items() if key not in _WRITTEN}
    kind = "plane" if projection.flat else "space"
    program, counts = picture_program(frames, model.mechanism, flat=projection.flat)
    follow, followers = follow_program(model.mechanism)
    texts = model.with_others({"picture": program, "follow": follow}).texts("javascript")
    table = model.table
    shown = [k for k in _read(table["parameters"], [*model.programs.values(), program, follow]) if k not in followers]
    data |= {
        "counts": counts,
        "model": {
            **{key: table[key] for key in ("coordinates", "speeds", "parameters")},
            "mode_ends": [*model.mechanism.stops],
        },
        "positive": [k for k, entry in enumerate(model.mechanism.parameters) if entry.positive],
        "shown": shown,
        "followers": followers,
        "outputs": [
            {"name": name, "unit": unit} for name, unit in zip(table["outputs"], table["units"]["outputs"], strict=True)
        ],
        "runs": _runs(table),
    }
    body = fill_template(
        "html/live.html.in",
        kind=kind,
        title=escape(system.name),
        drawn=drawn,
        speeds=speed_options(_SPEEDS, 1.0),
        equations=_equations(system),
        hint="Drag a body to where the motion shall begin." if projection.flat else "Drag to turn the view.",
        kept=_kept_sizes(system, [table["parameters"][k]["name"] for k in shown]),
        data=json_in_page(data),
        library="" if projection.flat else f"<script>{three()}</script>",
        scripts="".join(template_text(f"html/{name}.js") for name in (*_SCRIPTS, kind, "live")),
        model=_script(texts["model.mjs"]) + _script(texts["integrate.mjs"]),
    )
    return page(system.name, system.description, body, "live")


def _script(module: str) -> str:
    """Return a module as a part of a script: without imports, exports, and what it does in node."""
    text = module.partition("\nif (typeof process")[0]
    text = re.sub(r"^import .*\n", "", text, flags=re.MULTILINE)
    return re.sub(r"^export ", "", text, flags=re.MULTILINE).replace("</", "<\\/")


def _equations(system: System) -> str:
    """Return the equations of motion, typeset; a sentence where there is no closed form that can be read."""
    try:
        document = derivation_document(derive(system, budget=_BUDGET))
    except MultibodyError:
        return "<p>The equations have no closed form that can be read.</p>"
    rows = [section for section in document.sections if section.title in ("Equations of motion", "Names")]
    return HtmlWriter(document.notation, level=3).body(replace(document, sections=tuple(rows)))


def _read(parameters: Sequence[Mapping[str, Any]], programs: Sequence[Program]) -> list[int]:
    """Return the numbers of the parameters that change a motion, without those of the method."""
    read = {slot.data for program in programs for each in elements_read(program).values() for x in each for slot in x}
    own = (INDEPENDENT, ALPHA, BETA)
    return [k for k, x in enumerate(parameters) if ("parameters", k) in read and x["name"] not in own]


def follow_program(mechanism: Mechanism) -> tuple[Program, list[int]]:
    """Return -> values (n,): the parameters that depend on others, and their numbers."""
    numbers = {slot("parameters", k): k for k in range(len(mechanism.parameters))}
    values = {x: mechanism.parameters[k].value for x, k in numbers.items()}
    depend = {x: v for x, v in values.items() if v is not None and not numbers.keys().isdisjoint(leaves([v], "slot"))}

    def free(leaf: Node) -> Node:
        return evaluate([depend[leaf]], free)[0] if leaf in depend else leaf

    made = Trace("follow", arrays(mechanism)).finish({"values": ((len(depend),), [free(x) for x in depend])})
    return made, [numbers[x] for x in depend]


def _kept_sizes(system: System, parameters: Collection[str]) -> str:
    """Return a sentence on the parameters by which bodies are drawn as they are declared, nothing without such."""
    names = set[str]()
    for body in fields_tree(system).get("bodies", {}).values():
        names |= {*names_in({key: part for key, part in body.items() if key not in ("mass", "inertia")})}
    for _ in system.parameters:  # and those on which these depend
        declared = (x.value for name, x in system.parameters.items() if name in names)
        names |= {leaf.data for leaf in leaves(declared, "symbol")}
    sizes = [name for name in parameters if name in names]
    return f"The picture keeps the sizes of the declared {escape(', '.join(sizes))}." if sizes else ""


def _runs(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the names of all quantities as letters; the speed of a coordinate has a dash."""
    names = [each["name"] for key in ("coordinates", "speeds", "parameters") for each in table[key]]
    rates = {f"u_{each['name']}": (*letters(each["name"]), ("\u2032", "roman")) for each in table["coordinates"]}
    return {name: rates.get(name) or letters(name) for name in (*names, *table["outputs"])}


# ----------------------------------------------------------------------------------------------------------------------
# The picture: a Program of where bodies and strands are, and how places in the world lie on the page.


def picture_program(frames: Frames, mechanism: Mechanism, *, flat: bool) -> tuple[Program, list[int]]:
    """Return -> poses (bodies, 12), rotation by rows and place, and points of strands (n, 3) in the world.

    With it goes how many points each strand has: a rope those where it meets wheels, and of its bows on them. A `flat`
    picture lays strands itself: around the wheels that it has on the page.
    """
    trace = Trace("picture", arrays(mechanism))
    motion = motion_of(mechanism, slot_state(mechanism))
    poses = [x for rotation, place in motion.poses for x in (*(x for row in rotation for x in row), *place)]
    ropes = list(ropes_of(mechanism).values())
    lines = [
        [_anchored(motion, anchor) for anchor in strand.anchors]
        if strand.rope is None
        else rope_points(ropes[strand.rope], motion, ARC)
        for strand in (() if flat else frames.scene.strands)
    ]
    points = [x for line in lines for point in line for x in point]
    outputs = {"poses": ((len(motion.poses), 12), poses), "strands": ((len(points) // 3, 3), points)}
    made = trace.finish({name: (shape, [as_node(x) for x in values]) for name, (shape, values) in outputs.items()})
    return made, [len(line) for line in lines]


def _anchored(motion: Motion, anchor: Anchor) -> Vec:
    if anchor.body < 0:
        return anchor.point
    rotation, place = motion.poses[anchor.body]
    return add(place, apply(rotation, anchor.point))


def _stage(frames: Frames, projection: Projection) -> tuple[str, dict[str, Any]]:
    """Return the drawn stage and its data; on a plane one also how the world lies on the page (pt)."""
    drawn, data = drawn_stage(frames, projection, None)
    if not projection.flat:
        return drawn, data
    scene, home, seen = frames.scene, frames.placed[0], frames.window(projection).projection
    sheet = Sheet(scene, home, home, seen, others=frames.looked_at)
    right = np.array(seen.right)
    data["seen"] = {
        "sides": [[seen.scale * x for x in side] for side in (seen.right, seen.up)],
        "shifts": [list(map(float, sheet.settled.bodies.get(k, (0.0, 0.0)))) for k in range(len(scene.bodies))],
        "across": [list(map(float, home.poses[k, :, :3].T @ right)) for k in range(len(scene.bodies))],
        "courses": [_laid(sheet, placed) for placed in home.strands],
    }
    return drawn, data


def _laid(sheet: Sheet, placed: PlacedStrand) -> list[dict[str, Any]]:
    """Return what a strand runs along: wheels, of radius 0 at its ends, at places of bodies at the start (pt)."""
    found, strand = course(sheet, placed), placed.strand
    bodies = [anchor.body for anchor in strand.anchors]
    if len(found) > 2 and strand.rope is not None:
        runs = sheet.scene.ropes[strand.rope]
        bodies = [bend.at.body for k, run in enumerate(runs) for bend in run.path[min(k, 1) :]]
    between = bodies[1:-1] if len(bodies) == len(found) else [-1] * (len(found) - 2)
    return [
        {"body": body, "at": [float(x) for x in each.centre], "turn": each.side * each.radius, "turns": each.turns}
        for body, each in zip((bodies[0], *between, bodies[-1]), found, strict=True)
    ]
