"""From a scene and the places of its bodies to a picture: view, scale, marks, places for letters, title."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import groupby
from typing import Any, Final

import numpy as np

from multibody_sym.errors import ArgumentError, InputError, Where, short_repr
from multibody_sym.model.argument_checks import door
from multibody_sym.pictures.marks.forces import (
    FrictionCone,
    arrow_marks,
    arrows_beside,
    cone_marks,
    free_axes,
    strand_marks,
)
from multibody_sym.pictures.marks.labels import Names, angle_marks, dimension_marks, label_marks, word_marks
from multibody_sym.pictures.marks.shapes import FORMS
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.marks.symbols import SYMBOLS
from multibody_sym.pictures.page.files import svg
from multibody_sym.pictures.page.layout import Runs, laid_out, legend_lines
from multibody_sym.pictures.page.picture import (
    AngleArc,
    Arc,
    Arrow,
    Hatch,
    LegendLine,
    Mark,
    Picture,
    Projection,
    Run,
    Stroke,
    Wish,
    letters,
    view_of,
)
from multibody_sym.pictures.scene.items import (
    ArrowItem,
    Item,
    NamedLength,
    Path,
    Placed,
    Sphere,
)
from multibody_sym.pictures.scene.scene import Scene
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.files import path_name, write_whole

# ----------------------------------------------------------------------------------------------------------------------
# What a picture shows beside the mechanism itself.


@dataclass(frozen=True)
class FigureContent:
    """What a picture shows: `names`, named lengths (`dimensions`), weights and other `forces`, `reactions` then.

    `not_unique` tells of which elements they could be others too, and how that is shown; `undrawn` are the letters of
    those that are left out. What is declared at or under a path of `marked` stands out, with a word beside it.
    `cones` are those of friction where contacts stick.
    """

    names: Names = "letters"
    dimensions: bool = True
    forces: bool = False
    reactions: tuple[ArrowItem, ...] = ()
    not_unique: tuple[str, ...] = ()
    undrawn: tuple[str, ...] = ()
    marked: Mapping[Path, str] = field(default_factory=dict)
    cones: tuple[FrictionCone, ...] = ()


# ----------------------------------------------------------------------------------------------------------------------
# The legend below a figure: what its dashes mean, what it leaves out, lengths that it has no room for.


_WORD: Final = re.compile(r"[A-Za-z]\w*")
_FEW: Final = 12
"""Of more parameters that are not drawn the legend has those that are asked about."""
MOST_LENGTHS: Final = 12
"""Of more lengths those to centres of mass stand in the legend."""
_CENTRE: Final = ".com"


def in_legend(scene: Scene) -> tuple[Scene, list[LegendLine]]:
    """Return a scene without the places of centres of mass, and these as a legend, where more lengths are named.

    Such are seen already, and of so many dimension lines nobody could tell whose each is.
    """
    centres = [each for each in scene.dimensions if each.name.endswith(_CENTRE)]
    if len([each for each in scene.dimensions if not each.coordinate]) <= MOST_LENGTHS or not centres:
        return scene, []
    kept = tuple(each for each in scene.dimensions if each not in centres)
    entries = [_centre_entry(scene, name, list(group)) for name, group in groupby(centres, key=lambda each: each.name)]
    words = "centres of mass, in the axes of their bodies: "
    return replace(scene, dimensions=kept), list(legend_lines("centres of mass", words, entries))


def _centre_entry(scene: Scene, name: str, given: Sequence[NamedLength]) -> Runs:
    """Return the name of a body with the components of its centre of mass, of a plane mechanism x and y."""
    end = np.array(given[0].b.point)
    told = ["0" if x == 0.0 else f"{x:.3g}".replace("-", "−") for x in end]
    for each in given:
        told[int(np.argmax(np.abs(end - np.array(each.a.point))))] = each.component
    shown: list[Run] = []
    for text in told[: 2 if scene.plane else 3]:
        sign: list[Run] = [("−", "roman")] if text[:1] == "-" else []
        shown += [(", ", "roman"), *sign, *letters(text[len(sign) :])]
    return (*letters(name.removesuffix(_CENTRE)), (" (", "roman"), *shown[1:], (")", "roman"))


def givens_not_drawn(scene: Scene, marks: Iterable[Mark], *, dimensions: bool) -> Iterator[LegendLine]:
    """Yield the parameters whose letters no mark has, with their numbers: those that are asked, others if they are few.

    Lengths are none of them where a figure has no `dimensions`.
    """
    drawn = [runs for mark in marks if (runs := getattr(mark, "runs", ()))]
    measured = {name for each in scene.dimensions if not dimensions for name in _WORD.findall(each.label)}
    lacking = [each for each in scene.givens if not any(contains(runs, letters(each.letter)) for runs in drawn)]
    lacking = [each for each in lacking if each.value and each.letter not in measured]
    asked = [each for each in lacking if each.name in scene.asked]
    shown = lacking if len(lacking) <= _FEW else asked
    if shown:
        entries = [(*letters(each.letter), (f" = {each.value}", "roman")) for each in shown]
        yield from legend_lines("given", "", entries)


def contains(runs: Sequence[Run], part: Sequence[Run]) -> bool:
    """Return whether runs contain those of a symbol, whole: m is not in m_1."""
    ends = (k + len(part) for k in range(len(runs) - len(part) + 1) if tuple(runs[k : k + len(part)]) == tuple(part))
    return any(end == len(runs) or runs[end][1] != "subscript" for end in ends)


# ----------------------------------------------------------------------------------------------------------------------
# A picture in words, for readers who cannot see it: the bodies, what joins them, what acts between them.


_DESCRIBED_MOST: Final = 30
_REACTIONS: Final = ("reaction", "couple")


def description(scene: Scene, placed: Placed, shown: FigureContent) -> str:
    """Return sentences that say what a picture shows."""
    view = "in its plane" if scene.plane else "in space"
    lengths = [label for each in scene.dimensions if (label := each.label or each.start_label)]
    told = [
        f"The mechanism {scene.name}, drawn {view}, at t = {placed.time:g} s.",
        _sentence("Bodies", scene.bodies),
        _sentence("Joints", _names_with_kinds(item for item in scene.items if item.role == "joint")),
        _sentence("Pulleys", _names_with_kinds(item for item in scene.items if item.role == "pulley")),
        _sentence("Contacts", _names_with_kinds(item for item in scene.items if item.role == "contact")),
        _sentence("Stops", [item.label for item in scene.items if item.role == "stop"]),
        _sentence(
            "Ropes, springs and the like",
            [
                *(f"{s.name} ({s.kind.replace('_', ' ')})" for s in scene.strands),
                *_names_with_kinds(item for item in scene.items if item.role == "force"),
            ],
        ),
        _sentence("Lengths and angles", _once([*lengths, *(angle.label for angle in scene.angles)])),
        _sentence("Forces", _once(a.name for a in scene.arrows if a.role not in (*_REACTIONS, "velocity"))),
        _sentence("Reactions", _once(a.name for a in scene.arrows if a.role in _REACTIONS)),
        _sentence("Friction cones", _once(cone.name for cone in shown.cones)),
        _sentence("Not unique, because constraints depend on each other", shown.not_unique),
        _sentence("Marked", [f"{'.'.join(path)}{f' ({word})' if word else ''}" for path, word in shown.marked.items()]),
    ]
    return " ".join(sentence for sentence in told if sentence)


def _names_with_kinds(items: Iterable[Item]) -> list[str]:
    """Return names once each, with what kind of symbol stands for them."""
    kinds: dict[str, str] = {}
    for item in items:
        kind = getattr(item.form, "kind", "")
        kinds[item.name] = kinds.get(item.name) or kind
    return [f"{name} ({kind.replace('_', ' ')})" if kind else name for name, kind in kinds.items()]


def _once(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


def _sentence(what: str, names: Sequence[str]) -> str:
    if not names:
        return ""
    more = f" and {len(names) - _DESCRIBED_MOST} more" if len(names) > _DESCRIBED_MOST else ""
    return f"{what}: {', '.join(names[:_DESCRIBED_MOST])}{more}."


# ----------------------------------------------------------------------------------------------------------------------
# What a scene looks like: the marks of all that is in it.


def scene_marks(
    scene: Scene,
    placed: Placed,
    projection: Projection,
    *,
    names: Names = "letters",
    dimensions: bool = True,
    marked: Mapping[Path, str] | None = None,
) -> list[Mark]:
    """Return the marks of a scene at a state, in points of a page whose origin is that of space; labels are wishes.

    `names` as of `Names`, none leaves out letters of lengths and angles too; `dimensions` shows named lengths; `marked`
    paths are drawn in another colour.
    """
    sheet = Sheet(scene, placed, scene.at(), projection, marked or {})
    found = [mark for item in scene.items if item.role != "frame" for mark in item_marks(sheet, item)]
    found += [mark for strand in placed.strands for mark in strand_marks(sheet, strand)]
    lines = [np.asarray(mark.points) for mark in found if isinstance(mark, (Stroke, Arc, Hatch))]
    top = np.max([*(points.max(axis=0) for points in lines), sheet.span[1]], axis=0)
    found += free_axes(sheet, found)
    found += arrow_marks(sheet, found)
    found += word_marks(sheet)
    if names != "none":
        lengths = [mark for mark in dimension_marks(sheet, names, found) if dimensions or mark.role != "dimension"]
        found += [*label_marks(sheet, names, found), *lengths, *angle_marks(sheet, names, found)]
    arrows = [np.asarray(mark.points)[:, 0].max() for mark in found if isinstance(mark, Arrow)]
    found += arrows_beside(sheet, np.array([max([top[0], *arrows]), top[1]]))
    if names == "none":
        found = [mark for mark in found if not isinstance(mark, AngleArc)]
    asked = [letters(each.letter) for each in scene.givens if each.name in scene.asked]
    for k, mark in enumerate(found):
        if isinstance(mark, Wish):
            rank = _SMALL_NAME if mark.runs[0][1] == "small" else _RANKS.get(mark.role, 1)
            found[k] = replace(mark, rank=0 if any(contains(mark.runs, each) for each in asked) else rank)
    return found


_RANKS: Final = {"force": 1, "torque": 1, "coordinate": 2, "angle": 3, "dimension": 4}
"""Which letters find room first, after those that are asked; bodies, springs and contacts come with forces."""
_SMALL_NAME: Final = 5


def item_marks(sheet: Sheet, item: Item) -> Iterator[Mark]:
    """Yield how one item looks."""
    if item.symbol is not None:
        yield from SYMBOLS[item.symbol.kind](sheet, item, item.symbol)
    else:
        yield from FORMS[type(item.form)](sheet, item, item.form)


# ----------------------------------------------------------------------------------------------------------------------

WIDEST: Final = 378.0
"""A page (pt) is at most 133 mm wide and high, as far as letters allow that: 10 pt letters have 6 pt on 80 mm."""
_UNSEEN: Final = frozenset(("couple",))
"""Arrows that a figure does not show unless it has forces."""
MOST_NAMED: Final = 40
"""Of more bodies no page has room for all names: the figure shows none, its description tells them."""
_PRINTED: Final = 0.9
"""How large the mechanism of a printed figure is beside that of a film: letters are legible where it is 80 mm wide."""
_TRIES: Final = 3
_USUAL, _LARGEST = 16.0, 1.5
"""So many letters a figure of the usual size has room for; one of more is larger, up to so many times."""
_STAGE: Final = 44.0
"""How high (pt) a body is drawn on whose face masses stand that have no size."""
_SPRING: Final = 120.0
"""How long (pt) a spring without a length is drawn where nothing else has a size."""


def draw(
    scene: Scene, placed: Placed, *, view: str | Sequence[float] | None = None, shown: FigureContent | None = None
) -> Picture:
    """Return the picture of a scene whose bodies are `placed`; the same picture every time.

    `view` is a name (front, back, top, right, left, iso), or azimuth and elevation in degrees; the scene's own
    otherwise. Raises InputError for another one.
    """
    wanted = shown or FigureContent()
    # gravity, declared loads and given motions always; the speeds of the start there alone
    kept = [k for k, arrow in enumerate(scene.arrows) if wanted.forces or arrow.role not in _UNSEEN]
    kept = [k for k in kept if scene.arrows[k].role != "velocity" or placed.time == 0.0]
    arrows = (*(scene.arrows[k] for k in kept), *wanted.reactions)
    vectors = np.vstack([placed.vectors[kept].reshape(-1, 3), *(arrow.vector for arrow in wanted.reactions)])
    scene, placed = replace(scene, arrows=arrows), replace(placed, vectors=vectors)
    usual, up = Projection(scene.view.right, scene.view.up, 1.0, scene.plane), np.asarray(scene.view.up)
    upward: Sequence[float] = scene.view.up
    if not scene.plane:  # along the nearest axis
        axis = int(np.argmax(np.abs(up)))
        upward = [float(x) for x in np.sign(up[axis]) * np.eye(3)[axis]]
    projection = view_of(view, usual, upward, scene.view.towards if scene.plane else None)
    named = {item.name for item in scene.items if item.role in ("body", "joint", "pulley")}
    count = len(named) + len(scene.strands) + len(scene.dimensions) + len(scene.angles)
    room = float(np.clip(np.sqrt(count / _USUAL), 1.0, _LARGEST)) if wanted.names != "none" else 1.0
    # what has a size: bodies, places of joints, strands
    found = [np.zeros((0, 3))]
    for item in scene.items:
        if not item.form.endless:
            found.append(placed.world(item.body, item.form.bounds))
    for strand in placed.strands:
        found.append(np.asarray(strand.pieces).reshape(-1, 3))
        found.extend(bow.points() for bow in strand.bows)
    points = np.vstack(found)
    bounds: Floats = points[np.isfinite(points).all(1)]
    projection = projection.scaled(bounds, _PRINTED * room, _largest_scale(scene))
    title, words = scene.name, description(scene, placed, wanted)
    picture = laid_out(_marks(scene, placed, projection, wanted), title, words)
    for _ in range(_TRIES):
        room = min(WIDEST / picture.width, WIDEST / picture.height)
        if room >= 1.0:
            break
        projection = replace(projection, scale=projection.scale * max(0.4, 0.97 * room))
        picture = laid_out(_marks(scene, placed, projection, wanted), title, words)
    return picture


def _marks(scene: Scene, placed: Placed, projection: Projection, shown: FigureContent) -> list[Mark]:
    names: Names = shown.names if len(scene.bodies) <= MOST_NAMED else "none"
    lettered, told = in_legend(scene) if names != "none" and shown.dimensions else (scene, [])
    wanted: dict[str, Any] = {"names": names, "dimensions": shown.dimensions}
    found = scene_marks(lettered, placed, projection, **wanted, marked=shown.marked)
    found += cone_marks(Sheet(lettered, placed, lettered.at(), projection), shown.cones)
    if names != "none":
        told.extend(givens_not_drawn(scene, [*found, *told], dimensions=shown.dimensions))
    # what is to be said of forces that are not unique: dashed ones, and those that are left out
    if any(arrow.open for arrow in shown.reactions):
        told += legend_lines("not unique", "dashed: not unique, other values would do as well", ())
    if shown.undrawn:
        told += legend_lines("undrawn", "not unique, so not drawn: ", [letters(each) for each in shown.undrawn])
    return [*found, *told]


_DROP: Final = 40.0
"""The largest radius of a drop with mist around it (pt)."""


def _largest_scale(scene: Scene) -> float:
    """Return the scale (pt/m) at which faces and springs are no larger than the masses without a size beside them."""
    misty = {item.body for item in scene.items if item.symbol is not None and item.symbol.kind == "mist"}
    drops = [item.form for item in scene.items if isinstance(item.form, Sphere) and item.body in misty]
    if drops:
        return min(_DROP / drop.radius for drop in drops)
    bodies = (item for item in scene.items if item.role == "body" and item.form.face is None)
    if not all(each.loose for each in scene.strands) or not all(item.symbol is not None for item in bodies):
        return np.inf
    heights = [0.0]
    for item in scene.items:
        masses = (i for i in scene.items if i.role == "contact" and item.body in i.bodies)
        if (face := item.form.face) is not None and face.endless and item.body >= 0 and any(masses):
            heights.append(abs(float(np.dot(face.through, face.normal))))
    loose = [float(np.linalg.norm(np.ptp(strand.pieces, axis=(0, 1)))) for strand in scene.at().strands]
    return min([_STAGE / max(heights) if max(heights) > 0.0 else np.inf, *(_SPRING / each for each in loose if each)])


# ----------------------------------------------------------------------------------------------------------------------
# A figure: a picture that shows itself in notebooks and writes itself in the format of a file's ending.


ENDINGS: Final = (".svg", ".png", ".pdf", ".tex")
"""The formats by the ending of a file's name; PNG and PDF take matplotlib."""


@dataclass(frozen=True, eq=False)
class Figure:
    """A drawn mechanism. `svg` and `tex` are documents; `description` says in words what is seen, for alt texts."""

    picture: Picture

    @property
    def svg(self) -> str:
        """The figure as an SVG document."""
        return svg(self.picture)

    @property
    def tex(self) -> str:
        """The figure as a LaTeX document with TikZ, which pdflatex makes a page of the figure's size of."""
        from multibody_sym.pictures.page.files import tikz

        return tikz(self.picture)

    @property
    def title(self) -> str:
        """The name of the system."""
        return self.picture.title

    @property
    def description(self) -> str:
        """What is seen, in words."""
        return self.picture.description

    @property
    def size(self) -> tuple[float, float]:
        """Width and height in points (1/72 inch)."""
        return self.picture.width, self.picture.height

    @door
    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the figure as SVG, PNG, PDF or TeX by the ending of `path`, the same bytes every time.

        Raises InputError for another ending, OutputError where it cannot be written or matplotlib is missing.
        """
        write_whole(path, self.content(ending_of(path)))

    @door
    def content(self, ending: str) -> bytes:
        """Return the figure as the content of a file with an ending of ENDINGS. Raises InputError, OutputError."""
        if not isinstance(ending, str) or ending not in ENDINGS:
            raise ArgumentError(f"ending: expected one of {', '.join(ENDINGS)}, got {short_repr(ending)}")
        if ending == ".svg":
            return self.svg.encode()
        if ending == ".tex":
            return self.tex.encode()
        from multibody_sym.pictures.page.files import raster

        return raster(self.picture, ending.removeprefix("."))

    def _repr_svg_(self) -> str:
        return svg(self.picture, alone=False)

    def __repr__(self) -> str:
        width, height = self.size
        return f"Figure({self.title!r}, {width:.0f} pt x {height:.0f} pt)"


def ending_of(path: str | os.PathLike[str]) -> str:
    """Return the ending of a figure's name. Raises InputError for one that is no format."""
    name = path_name(path)
    ending = os.path.splitext(name)[1].lower()
    if ending not in ENDINGS:
        message = f"a figure is written to {', '.join(ENDINGS)} files, by the ending of the name"
        raise InputError(message, where=Where(file=name))
    return ending
