"""Scene: all that there is to see of a system; `scene_of` builds it and `at` places it at a state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.dynamics.start.start import Start
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion, motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism as resolved
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.forces import SpringDamper
from multibody_sym.model.joints import CurveJoint
from multibody_sym.model.parameters import in_letters
from multibody_sym.model.system import System, verify_system
from multibody_sym.pictures.scene.bodies import (
    body_items,
    constraint_items,
    contact_items,
    force_items,
    guided_lengths,
    marker_items,
    pulley_items,
)
from multibody_sym.pictures.scene.forces import (
    ArrowLaw,
    Runs,
    arrow_items,
    drum_items,
    drum_radii,
    placed_rope,
    ropes_of,
    speed_items,
    strands,
)
from multibody_sym.pictures.scene.items import (
    AngleMark,
    ArrowItem,
    Axes,
    Bowl,
    Item,
    NamedLength,
    Placed,
    PlacedStrand,
    Strand,
    View,
)
from multibody_sym.pictures.scene.joints import angles, dimensions, joint_items, stop_items, ways
from multibody_sym.pictures.scene.letters import (
    Given,
    asked_names,
    curve_equation,
    givens,
    is_letter,
    is_static,
    letters,
)
from multibody_sym.pictures.scene.masses import flow_items
from multibody_sym.pictures.scene.stage import (
    PlacedSystem,
    drawn_start,
    edge_items,
    natural_view,
    places,
    poses_of,
    riser_items,
    struck_items,
    support_items,
    surface_items,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

Numbers = Sequence[float] | Floats | None


@dataclass(frozen=True, eq=False)
class Scene:
    """What there is to see of a system: `plane` says whether all of it moves in one, which the `view` shows.

    `size` (m) is how far its declared places reach at the `begin`, the state of its start. `items` stand on bodies,
    `strands` run between them, `dimensions` and `angles` name lengths and coordinates, `arrows` are forces. `asked` are
    the names in the model's questions, `givens` its parameters, `book` the letters of parameters and coordinates by
    name. Nothing of what is `static` is said to move.
    """

    name: str
    plane: bool
    view: View
    size: float
    items: tuple[Item, ...]
    strands: tuple[Strand, ...]
    dimensions: tuple[NamedLength, ...]
    angles: tuple[AngleMark, ...]
    arrows: tuple[ArrowItem, ...]
    mechanism: Mechanism
    begin: Start
    ropes: tuple[Runs, ...] = ()
    laws: tuple[ArrowLaw, ...] = ()
    asked: frozenset[str] = frozenset()
    givens: tuple[Given, ...] = ()
    book: Mapping[str, str] = field(default_factory=dict)
    static: bool = False

    @property
    def up(self) -> tuple[float, float, float]:
        """The direction upward on the page (world)."""
        return self.view.up

    @property
    def gravity(self) -> tuple[float, float, float]:
        """The vector of gravity (world)."""
        return next((arrow.vector for arrow in self.arrows if arrow.role == "gravity"), (0.0, 0.0, 0.0))

    @property
    def bodies(self) -> tuple[str, ...]:
        """The names of the bodies, in the order of the poses."""
        return tuple(body.name for body in self.mechanism.bodies)

    def at(self, q: Numbers = None, u: Numbers = None, t: float = 0.0, parameters: Numbers = None) -> Placed:
        """Return the scene at a state: coordinates q (nq), speeds u (nu), parameters (np); those of the start else."""
        return self.placed(self.motion(q, u, t, parameters))

    def motion(self, q: Numbers = None, u: Numbers = None, t: float = 0.0, parameters: Numbers = None) -> Motion:
        """Return the motion of the mechanism at a state; what is not given is that of the start."""
        begin = self.begin
        pairs = (q, begin.q), (u, begin.u), (parameters, begin.parameters)
        given = (own if values is None else [float(x) for x in values] for values, own in pairs)
        return motion_of(self.mechanism, state_of(self.mechanism, float, float(t), *given))

    def placed(self, motion: Motion) -> Placed:
        """Return the scene where a motion of its mechanism has led it."""
        poses = poses_of(motion)
        (time,) = (value for slot, value in motion.state.slots.items() if slot.op == "slot" and slot.data == ("t", 0))
        vectors = np.array([law.vector(motion) for law in self.laws]).reshape(-1, 3)
        bare = Placed(float(time), poses, (), vectors)
        return replace(bare, strands=tuple(self._strand(strand, motion, bare) for strand in self.strands))

    def _strand(self, strand: Strand, motion: Motion, placed: Placed) -> PlacedStrand:
        """Return a strand in the world: straight from anchor to anchor, or over its pulleys."""
        ends = [placed.point(anchor) for anchor in strand.anchors]
        if strand.rope is not None:
            return placed_rope(strand, self.ropes[strand.rope], motion, ends)
        return PlacedStrand(strand, np.array([ends[k : k + 2] for k in range(len(ends) - 1)]))


def scene_of(system: System) -> Scene:
    """Return what there is to see of a system. Raises ModelError, NoSolutionError where there is no start."""
    verify_system(system)
    mechanism = resolved(system)
    stage = PlacedSystem(system, mechanism, drawn_start(mechanism, project=system.simulation.project))
    found = places(stage)
    curves = {name: joint.curve for name, joint in system.joints.items() if isinstance(joint, CurveJoint)}
    round_ = {name for name, curve in curves.items() if curve.unit_of_parameter == "rad"}  # with a length of their own
    wires = [item for item in joint_items(stage) if item.role == "guide" and item.path[1] in round_]
    stage.ended.extend(stage.world(item.body, point) for item in wires for point in item.form.bounds)
    stage.lengths["size"] = size = _size(stage, [*body_items(stage, found), *wires], found)
    bodies = list(body_items(stage, found))  # curves without ends reach as far as the rest
    ropes, pairs = ropes_of(stage.mechanism), [*arrow_items(stage), *speed_items(stage)]
    book, (view, plane) = letters_of(stage.system), natural_view(stage, found)
    measured = (*dimensions(stage, found), *drum_radii(stage), *guided_lengths(stage, bodies))
    lengths = [_spelt(each, book) for each in measured]
    moved = [_spelt(each, book) for each in ways(stage, [each.label for each in lengths])]
    numbers = {name: k for k, name in enumerate(ropes)}
    supports = list(support_items(stage, bodies))
    stood_on = {item.path for item in supports}
    items = (
        *(each for i in surface_items(stage, "ground") if i.path not in stood_on for each in _with_equation(stage, i)),
        *supports,
        *riser_items(stage),
        *struck_items(stage),
        *edge_items(stage),
        *bodies,
        *drum_items(stage),
        *pulley_items(stage),
        *constraint_items(stage),
        *joint_items(stage),
        *force_items(stage),
        *contact_items(stage),
        *flow_items(stage),
        *stop_items(stage, bodies, found),
        *marker_items(stage),
    )
    return Scene(
        name=stage.system.name,
        plane=plane,
        view=view,
        size=size,
        items=tuple(_spelt(item, book, _LETTERS) for item in items),
        strands=tuple(
            _spelt(_with_length(stage, x, [*lengths, *moved]), book, _LETTERS) for x in strands(stage, numbers)
        ),
        dimensions=(*(replace(x, component=in_letters(x.component, book)) for x in lengths), *moved),
        angles=tuple(_spelt(each, book) for each in angles(stage, found)),
        arrows=tuple(_spelt(arrow, book) for arrow, _ in pairs),
        mechanism=stage.mechanism,
        begin=stage.begin,
        ropes=tuple(ropes.values()),
        laws=tuple(law for _, law in pairs),
        asked=asked_names(system),
        givens=givens(stage, book),
        book=book,
        static=is_static(system),
    )


def _with_equation(stage: PlacedSystem, item: Item) -> Iterator[Item]:
    """Yield a surface of ground, with the equation of its curve and the axes of that, if it has one."""
    curve = stage.declared(GROUND).surfaces[item.path[-1]].guide
    equation = "" if curve is None else curve_equation(curve)
    yield replace(item, letters=equation)
    if equation:
        axes = Axes((0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), ("x", "y"), of_equation=True)
        yield replace(item, form=axes)


def _with_length(stage: PlacedSystem, strand: Strand, lengths: Sequence[NamedLength]) -> Strand:
    """Return a spring with the letter of its length without load too, unless a dimension has that."""
    element = stage.system.forces.get(strand.name)
    letter = letters(element.length) if isinstance(element, SpringDamper) else ""
    shown = letter and is_letter(stage.system, letter) and strand.letters
    if not shown or any(letter in (each.label, each.start_label) for each in lengths):
        return strand
    return replace(strand, letters=f"{strand.letters}, {letter}")


_LETTERS: Final = ("letters", "damping")
"""The fields of items and strands that show letters of parameters; their labels are names."""
_Named = TypeVar("_Named", NamedLength, AngleMark, ArrowItem, Item, Strand)


def stripped(scene: Scene, prefixes: Sequence[str]) -> Scene:
    """Return a scene whose labels do not begin with any of the prefixes, as those of robots do with their name."""

    def short(label: str) -> str:
        for prefix in prefixes:
            label = label.removeprefix(prefix) or label
        return label

    def each(things: tuple[_Named, ...]) -> tuple[_Named, ...]:
        return tuple(replace(thing, label=short(thing.label)) for thing in things)

    if not prefixes:
        return scene
    forms = [
        replace(item.form, names=tuple(map(short, item.form.names))) if isinstance(item.form, Axes) else item.form
        for item in scene.items
    ]
    items = tuple(replace(item, form=form) for item, form in zip(scene.items, forms, strict=True))
    return replace(
        scene,
        items=each(items),
        strands=each(scene.strands),
        dimensions=each(scene.dimensions),
        angles=each(scene.angles),
        arrows=each(scene.arrows),
    )


def _spelt(
    each: _Named, book: Mapping[str, str], words: Sequence[str] = ("label", "angle", "start_label")
) -> _Named:
    """Return what is named by parameters and coordinates with the letters that the book has for them."""
    spelt: dict[str, Any] = {word: in_letters(text, book) for word in words if (text := getattr(each, word, ""))}
    return replace(each, **spelt) if spelt else each


def _size(stage: PlacedSystem, items: Sequence[Item], found: Mapping[str, Sequence[Sequence[float]]]) -> float:
    """Return how far places of bodies and their forms reach at the start (m); 1 where all is at one place."""
    points = [stage.world(stage.number_of(name), place) for name, each in found.items() for place in each]
    for item in items:
        line = item.form.open_line
        curve = line is not None and len(line.points) > 2
        if not item.form.sized or (item.role in ("surface", "body") and (curve or isinstance(item.form, Bowl))):
            continue  # what reaches as far as the rest does says nothing of how far that is
        points += [stage.world(item.body, point) for point in item.form.bounds]
    points = [point for point in points if np.all(np.isfinite(point))]
    if not points:
        return 1.0
    spread = np.max(points, axis=0) - np.min(points, axis=0)
    size = float(np.linalg.norm(spread))
    return size if size > 0.0 else 1.0
