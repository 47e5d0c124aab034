"""Names, lengths and angles: what wants letters beside it, for the layout to place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np

from multibody_sym.pictures.marks.forces import (
    COORDINATE_LENGTH,
    clear_start,
    coordinate_arrow,
    driven_points,
    lines_of,
    outline_drawn,
)
from multibody_sym.pictures.marks.ropes import drawn_pieces
from multibody_sym.pictures.marks.shapes import line_ends, outline_of, rail_lines, sleeve_place, stop_line
from multibody_sym.pictures.marks.sheet import Sheet, left, unit2
from multibody_sym.pictures.marks.symbols import ring_pins, touching_place
from multibody_sym.pictures.page.layout import distances
from multibody_sym.pictures.page.picture import (
    COORDINATE,
    HIDDEN,
    LAYER_ARROW,
    LAYER_TEXT,
    MARKED,
    THIN,
    AngleArc,
    Arc,
    Arrow,
    Mark,
    Measure,
    Run,
    Stroke,
    Wish,
    formula,
    letters,
    small,
    words,
)
from multibody_sym.pictures.scene.items import (
    AngleMark,
    Axes,
    Disc,
    Item,
    NamedLength,
    Rail,
    Stop,
    Strand,
    Symbol,
    TurnStop,
    unit,
)
from multibody_sym.pictures.scene.scene import Scene
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.printer import SYMBOL, is_word, read_parts

_TURNED, _BOW, _COUNTED = 0.07, 1.2, 0.55
"""From which angle on (rad) an arc shows it, and the bows that show the sense of a smaller one in space, in a plane."""
_COUNTED_REACH: Final = 36.0
"""The largest radius (pt) of such a bow in a plane."""
_ARC, _BEYOND = 32.0, 1.3
"""The radius of such an arc (pt), and how many times as long its line of reference is."""
_UNTURNED: Final = 1e-6
"""An angle (rad) below is zero."""
_SHORTEST: Final = 9.0
"""The shortest length (pt) that gets a dimension line."""
_SEEN: Final = 6.0
"""How near (pt) a line is that shows from where a coordinate counts."""
_SAME: Final = 3.0
"""Within this distance (pt) places are one."""
_BOTH: Final = 13.0
"""How far (pt) from the middle line the letters of a spring and a damper side by side stand."""
_NEAR_BLOCK: Final = 22.0
"""How far from its block (pt) the name of a slider stands on what it slides along."""
_NAMED: Final = ("body", "joint", "pulley", "guide", "contact", "force", "limit", "stop")
_SILENT: Final = ("tie", "point", "used_point", "jet")
"""Symbols without a name on the figure."""
_SECOND: Final = ("weld", "torsion_damper", "torsion_spring", "motor", "friction")
_ALIKE: Final = 6
"""Of so many bodies, springs or contacts with the same letters one has them."""
_MANY: Final = 20
"""Of more bodies and joints the welds, and springs, dampers and motors in hinges, have no names."""


_NOTHING: Final[tuple[Run, ...]] = ()
Names = Literal["letters", "all", "none"]
"""Which names a figure shows: the letters of the problem; those of bodies, joints, ropes and so on too; none."""


def name_runs(scene: Scene, item: Item | Strand, names: Names) -> tuple[Run, ...]:
    """Return what stands beside a body, joint or strand: the letters of the problem, its name, both or nothing.

    Names are small beside letters. Among letters only what the model gives a label has a name, pins such as A, stops,
    bodies where none of several has a letter, or that are named by one (K1), and of several alike those that a question
    asks about.
    """
    mine = formula(item.letters) if item.letters else ()
    if isinstance(item, Item) and isinstance(item.form, (Stop, TurnStop)):
        return letters(item.label)
    bare = isinstance(item, Item) and item.heavy and not mine
    wanted = item.name in scene.asked and not is_alone(scene, item)
    if not item.label or not (names == "all" or item.titled or wanted or (bare and _is_named(scene, item.name))):
        return mine
    if not mine:
        return letters(item.label) if names == "all" or item.titled else small(item.label)
    return (*mine, (" ", "small"), *small(item.label))


def _is_named(scene: Scene, name: str) -> bool:
    """Return whether a body without a letter has its name: one in letters, in space, or where no body has a letter."""
    heavy = [(each.name, each.letters) for each in scene.items if each.role == "body" and each.heavy]
    several = any(other != name and not found for other, found in heavy)
    lettered = any(each.letters for each in scene.items if each.role == "body")
    return several and not (scene.plane and lettered and is_word(read_parts(name)[0]))


def is_alone(scene: Scene, item: Item | Strand) -> bool:
    """Return whether no name tells an item from others: nothing looks alike with the same letters, or all are named so.

    A slider's letters are those of its body and its coordinate.
    """
    if isinstance(item, Item) and (item.role == "guide" or (item.symbol and item.symbol.kind in ("slider", "hanger"))):
        return len(item.name) > 1
    every: Sequence[Item | Strand] = scene.strands if isinstance(item, Strand) else scene.items
    looks: dict[str, set[tuple[str, str, str]]] = {}  # a body may have several signs
    for each in every:
        if isinstance(item, Strand) or (isinstance(each, Item) and each.role == item.role):
            looks.setdefault(each.name, set()).add(_looks(each))
    alike = [each for each in every if each.name != item.name and looks.get(each.name) == looks[item.name]]
    return not alike or (item.label != item.name and any(each.label == item.label for each in alike))


def _looks(item: Item | Strand) -> tuple[str, str, str]:
    """Return by what things are alike: bodies by their letters, form and size, joints by their sign."""
    if isinstance(item, Strand):
        return item.kind, "", item.letters
    sign = item.symbol.kind if item.symbol is not None else ""
    if item.role == "body":
        sign = f"{type(item.form).__name__} {sign} {float(np.linalg.norm(np.ptp(item.form.bounds, axis=0))):.3g}"
    return item.role, sign if item.role in ("body", "joint") else "", item.letters


def label_marks(sheet: Sheet, names: Names = "letters", drawn: Sequence[Mark] = ()) -> Iterator[Mark]:
    """Yield the letters and names of bodies, joints, pulleys and strands, of masses on what is `drawn` of them."""
    named: set[tuple[str, str]] = {("force", arrow.name) for arrow in sheet.scene.arrows}
    many = len({(i.role, i.name) for i in sheet.scene.items if i.role in ("body", "joint")}) > _MANY
    silent = (*_SILENT, *(_SECOND if many else ()))
    shared = _Shared(sheet.scene, names)
    for item in sheet.scene.items:
        key, runs = (item.role, ".".join(item.path) if item.role == "contact" else item.name), _NOTHING
        if (item.role in _NAMED or item.letters) and key not in named and not isinstance(item.form, Axes):
            runs = name_runs(sheet.scene, item, names)
        if not runs or (item.symbol is not None and item.symbol.kind in silent):
            continue
        if _is_apart(sheet, item) or shared.has(item, runs):
            continue
        joined = item.role == "guide" and not item.letters
        if joined and any(i.role == "joint" and i.name == item.name for i in sheet.scene.items):
            continue
        named.add(key)
        if not isinstance(item.form, (Stop, TurnStop)):
            yield _name(sheet, item, runs, _middle(item, drawn) if item.letters else None)
            continue
        line, form = stop_line(sheet, item, item.form), item.form
        if line is not None:
            x, y = sheet.way(item.body, form.axis if isinstance(form, Stop) else np.cross(form.axis, form.way))
            prefer, text = (float(x), float(y)), _text(item.role, item.name)
            yield Wish(line.mean(axis=0)[None, :], runs, prefer=prefer, clear=7.0, **text)
    yield from _strand_names(sheet, names, shared)


class _Shared:
    """Which letters of bodies, springs and so on are drawn already that so many share that one has them for all."""

    def __init__(self, scene: Scene, names: Names) -> None:
        every: tuple[Item | Strand, ...] = (*scene.items, *scene.strands)
        each = {(_looks(i)[0], i.letters, i.name) for i in every if i.letters}
        count = Counter((kind, letters) for kind, letters, _ in each)
        self._many = {key for key, n in count.items() if n >= _ALIKE and names == "letters"}
        self._first: dict[tuple[str, str], str] = {}

    def has(self, item: Item | Strand, runs: Sequence[Run]) -> bool:
        """Return whether another one has these letters already."""
        key = _looks(item)[0], item.letters
        if key not in self._many or tuple(runs) != formula(item.letters):
            return False
        return self._first.setdefault(key, item.name) != item.name


def _is_apart(sheet: Sheet, item: Item) -> bool:
    """Return whether a contact is open while another one with its letters is closed."""
    if item.role != "contact" or item.symbol is None or touching_place(sheet, item, item.symbol) is not None:
        return False
    alike = (i for i in sheet.scene.items if i.role == "contact" and i.letters == item.letters and i.name != item.name)
    return any(i.symbol is not None and touching_place(sheet, i, i.symbol) is not None for i in alike)


def _middle(item: Item, drawn: Sequence[Mark]) -> Floats | None:
    """Return the middle of the largest area that is drawn of a body, None where it is all lines."""
    if item.role != "body":
        return None
    own = (mark for mark in drawn if (mark.role, mark.name) == (item.role, item.name))
    areas = [np.asarray(mark.points) for mark in own if isinstance(mark, (Stroke, Arc)) and mark.fill is not None]
    largest = max(areas, key=lambda area: float(np.prod(np.ptp(area, axis=0))), default=None)
    return None if largest is None else np.asarray(largest.mean(axis=0))


def _strand_names(sheet: Sheet, names: Names, shared: _Shared) -> Iterator[Mark]:
    for placed in sheet.placed.strands:
        pieces, runs = drawn_pieces(sheet, placed), name_runs(sheet.scene, placed.strand, names)
        seen = placed.strand.kind != "tie" or float(np.ptp(pieces, axis=(0, 1)).max()) > _SAME
        if shared.has(placed.strand, runs):
            continue
        if runs and len(pieces) and np.all(np.isfinite(pieces)) and seen:
            longest = max(pieces, key=lambda piece: float(np.linalg.norm(piece[1] - piece[0])))
            strand, middle = placed.strand, longest[0] + np.outer((0.3, 0.7), longest[1] - longest[0])
            if strand.damping and not sheet.flat:
                runs = (*runs, (", ", "roman"), *formula(strand.damping))
            elif strand.damping:  # a letter on either side
                x, y = left(unit2(longest[1] - longest[0]))
                text = _text(strand.kind, strand.name)
                yield Wish(middle, formula(strand.damping), (-x, -y), _BOTH, **text)
                yield Wish(middle, runs, (x, y), _BOTH, **text)
                continue
            centres = [end for anchor, end in zip(strand.anchors, longest, strict=False) if anchor.body in sheet.ground]
            about = np.array(centres) if strand.kind == "attraction" and centres else middle
            yield Wish(about, runs, clear=6.0, **_text(strand.kind, strand.name))


def word_marks(sheet: Sheet) -> Iterator[Mark]:
    """Yield the word of each marked path beside the first thing that it is the path of."""
    for path, word in sheet.marked.items():
        item = next((i for i in sheet.scene.items if i.path[: len(path)] == path), None)
        if item is not None and word:
            about = sheet.page(item.body, item.form.bounds).mean(axis=0)[None, :]
            yield Wish(about, words(word), clear=10.0, colour=MARKED.colour, **_text("mark", "/".join(path)))


def _text(role: str, name: str) -> dict[str, Any]:
    return {"role": role, "name": name, "layer": LAYER_TEXT}


def _name(sheet: Sheet, item: Item, runs: tuple[Run, ...], inside: Floats | None) -> Wish:
    bounds = sheet.page(item.body, item.form.bounds)
    if item.role == "contact" and item.symbol is not None:
        place = touching_place(sheet, item, item.symbol)
        bounds = bounds if place is None else place[None, :]
    round_it = isinstance(item.form, Disc) and (item.form.hollow or _turns_at_middle(sheet, item, item.form))
    about = bounds if len(bounds) == 2 or round_it else bounds.mean(axis=0)[None, :]
    if item.role == "body" and item.form.endless and sheet.flat:
        about = outline_of(sheet, item).mean(axis=0)[None, :]
    if item.role in ("guide", "surface") and item.letters:  # the equation of a curve, near its end
        about = bounds[len(bounds) // 12 : len(bounds) // 4]
    if item.symbol is not None:
        about = _beside(sheet, item, item.symbol, about)
    clear = 7.0 if item.symbol is not None and len(about) == 1 else 5.0
    return Wish(about, runs, clear=clear, inside=inside, **_text(item.role, item.name))


def _turns_at_middle(sheet: Sheet, item: Item, disc: Disc) -> bool:
    """Return whether a hinge, whose name stands there, is in the middle of a body that is round."""
    centre = sheet.at(item.body, disc.centre)
    signs = (i for i in sheet.scene.items if i.role == "joint" and item.role == "body" and item.body in i.bodies)
    places = (sheet.at(i.body, i.symbol.at) for i in signs if i.symbol is not None)
    return any(float(np.linalg.norm(place - centre)) < _SAME for place in places)


def _beside(sheet: Sheet, item: Item, symbol: Symbol, otherwise: Floats) -> Floats:
    """Return what the name of a symbol stands beside (n, 2): the rail of a slider, the arrow of what is driven."""
    if symbol.kind == "friction":
        sliders = (i for i in sheet.scene.items if i.role == "joint" and {*i.bodies} == {*item.bodies})
        for other in sliders:
            if other.symbol is not None and other.symbol.kind in ("slider", "hanger"):
                return _beside(sheet, other, other.symbol, sheet.page(other.body, other.form.bounds))
    pins = ring_pins(sheet, item, symbol) if symbol.kind in ("pin", "pivot") else None
    if pins is not None:
        return sheet.page(item.body, pins[1:])
    if symbol.kind in ("drive_about", "drive_along"):
        return driven_points(sheet, item, symbol)[-2:]
    if symbol.kind == "slider" and not sheet.flat:
        return sheet.page(item.body, [sleeve_place(sheet, item, symbol)])
    if symbol.kind in ("slider", "hanger"):
        rails = (i for i in sheet.scene.items if i.path == item.path and isinstance(i.form, Rail))
        rail = next(rails, None)
        if rail is not None and sheet.flat:
            line = np.vstack(rail_lines(sheet, rail)[:1])
            if symbol.kind == "hanger":
                return line
            along, length = unit2(line[1] - line[0]), float(np.linalg.norm(line[1] - line[0]))
            middle = float((otherwise[0] - line[0]) @ along)  # near the block: others may share the rail
            ways = np.clip([middle - _NEAR_BLOCK, middle + _NEAR_BLOCK], 0.0, length)
            return np.asarray(line[0] + np.outer(ways, along))
    return otherwise


# --- lengths and angles --------------------------------------------------------------------------------------------


def dimension_marks(sheet: Sheet, names: Names = "letters", drawn: Sequence[Mark] = ()) -> Iterator[Mark]:
    """Yield the lengths that the model names, and the coordinates of sliders, clear of what is `drawn`.

    A coordinate is measured from a place that is seen. Its value at the start, if it has a letter, is a length there;
    then, near zero or where nothing is seen at its datum it is a short arrow beside its body.
    """
    lines, taken = lines_of(drawn), [np.zeros((0, 4))]
    told = {each.label for each in sheet.scene.dimensions if not each.coordinate}
    for each in sheet.scene.dimensions:
        own, given = _own_label(each, names), each.start_label if sheet.placed.time == 0.0 else ""
        given = "" if given in told else given
        if not own and not given:
            continue
        a, b = _measured_ends(sheet, each)
        length = float(np.linalg.norm(b - a))
        if each.radius:
            text = _text("dimension", each.name)
            if length >= _SHORTEST:
                yield Arrow(np.array([a, b]), THIN, head=4.0, **{**text, "layer": LAYER_ARROW})
            yield Wish(np.array([(a + b) / 2]), formula(own), clear=1.5, **text)
            continue
        begun = given and (length >= COORDINATE_LENGTH or not each.coordinate)
        seen = len(lines) and float(distances(a[None], lines).min()) < _SEEN
        short = each.coordinate and (length < COORDINATE_LENGTH or not seen or _shares_line(sheet, each))
        if begun:
            told.add(given)
        if begun or not short:
            across = float(sheet.way(each.a.body, each.beyond) @ left(unit2(b - a))) if sheet.flat else 0.0
            counted = each.coordinate and not begun
            text = _text("coordinate" if counted else "dimension", each.name)
            beyond = abs(across) * sheet.projection.scale
            yield Measure(a, b, formula(given if begun else own), datum=counted, beyond=beyond, **text)
        if each.coordinate and (short or begun) and (own or not begun):
            found = list(_coordinate(sheet, each, drawn, own or given, np.vstack([lines, *taken])))
            taken.append(lines_of(found))
            yield from found


def _own_label(each: AngleMark | NamedLength, names: Names) -> str:
    """Return what stands at a length or angle at any time, nothing where that would be the name of a joint."""
    return "" if each.unnamed and names != "all" else each.label


def _measured_ends(sheet: Sheet, each: NamedLength) -> tuple[Floats, Floats]:
    """Return both ends of a length on the page; one from ground is measured beside what is displaced, straight."""
    a, b = sheet.at(each.a.body, each.a.point), sheet.at(each.b.body, each.b.point)
    if not each.coordinate or each.a.body not in sheet.ground:
        return a, b
    shift = sheet.settled.bodies.get(each.b.body, np.zeros(2))
    along = unit2(b - shift - a)
    aside = shift - float(shift @ along) * along
    return a + aside, b - shift + aside


def _shares_line(sheet: Sheet, each: NamedLength) -> bool:
    """Return whether another slider has its coordinate on the same line of the page: lengths would be mixed up."""
    a, b = sheet.at(each.a.body, each.a.point), sheet.at(each.b.body, each.b.point)
    across = left(unit2(b - a))
    for other in sheet.scene.dimensions:
        if other is each or not other.coordinate or other.unnamed or other.b.body == each.a.body:
            continue
        ends = [sheet.at(end.body, end.point) - a for end in (other.a, other.b)]
        if all(abs(float(end @ across)) < _SAME for end in ends):
            return True
    return False


def _coordinate(sheet: Sheet, each: NamedLength, drawn: Sequence[Mark], label: str, lines: Floats) -> Iterator[Mark]:
    """Yield the direction of a slider's coordinate beside its body, from a dot."""
    guides = (i for i in sheet.scene.items if i.role == "guide" and each.b.body in i.bodies)
    axes = (sheet.way(i.body, i.form.axis) for i in guides if isinstance(i.form, Rail))
    place = sheet.at(each.b.body, each.b.point)
    way = unit2(next(axes, place - sheet.at(each.a.body, each.a.point)))
    outline = outline_drawn(sheet, each.b.body, drawn, place)
    start = clear_start(outline if len(outline) else place[None], way, lines)
    named: dict[str, Any] = {"role": "coordinate", "name": each.name, "layer": LAYER_ARROW}
    yield from coordinate_arrow(start, start + COORDINATE_LENGTH * way, formula(label), named)


def angle_marks(sheet: Sheet, names: Names = "letters", drawn: Sequence[Mark] = ()) -> Iterator[Mark]:
    """Yield the angles of hinges and slopes: arcs in the plane, in space at the joint or at a `drawn` edge."""
    for each in sheet.scene.angles:
        now = each.start_label if sheet.placed.time == 0.0 else ""  # the letter that the model gives it at the start
        label = now or _own_label(each, names)
        if not label or not (each.coordinate or sheet.flat or not any(each.axis)):
            continue
        at = sheet.at(each.at.body, each.at.point) if each.coordinate else _foot(sheet, each, drawn)
        if not sheet.flat:
            yield from _turn_in_space(sheet, each, at, label)
            continue
        start, stop = (sheet.way(end.body, end.point) for end in (each.start, each.stop))
        first, second = (float(np.arctan2(way[1], way[0])) for way in (start, stop))
        turn = (second - first + np.pi) % (2 * np.pi) - np.pi
        if abs(turn) < _UNTURNED and not SYMBOL.fullmatch(label):
            continue  # of an expression or a value that is zero nothing can be seen
        counted = each.coordinate and abs(turn) < _TURNED and any(each.axis)
        if counted:  # a bow shows which way it counts
            axis = sheet.placed.turned(each.at.body, each.axis)
            turn, label = np.copysign(_COUNTED, float(axis @ sheet.projection.toward)), each.label or label
        low, high = (first, first + turn) if turn > 0.0 else (first + turn, first)
        ends = (turn > 0.0, turn < 0.0)  # a thin line from which the angle is counted, or to which it would turn
        ends = ends[::-1] if counted else ends
        tip = (1 if turn > 0.0 else 0) if each.coordinate else None
        found = AngleArc(at, low, high, formula(label), ends, tip, role="angle", name=each.name, layer=LAYER_TEXT)
        yield replace(found, reach=_COUNTED_REACH) if counted else found


def _foot(sheet: Sheet, each: AngleMark, drawn: Sequence[Mark]) -> Floats:
    """Return where the angle of a slope is written: at the low end of the rail or face that has it."""
    along = sheet.way(each.stop.body, each.stop.point)
    if not sheet.flat:
        own = (np.asarray(m.points) for m in drawn if isinstance(m, Stroke) and m.closed and m.role == "surface")
        corners = np.vstack([sheet.at(each.at.body, each.at.point)[None], *own])
        return np.asarray(min(corners[1:], key=lambda x: (round(float(x @ along), 3), -x[0]), default=corners[0]))
    for item in sheet.scene.items:
        ends = line_ends(sheet, item) if item.body == each.at.body else None
        if ends is None:
            continue
        if isinstance(item.form, Rail):  # its lines are beside its axis
            ends = np.vstack(rail_lines(sheet, item))
        way = unit2(ends[1] - ends[0])
        if abs(float(way[0] * along[1] - way[1] * along[0])) < 1e-3:
            return np.asarray(max(ends, key=lambda end: float(end @ sheet.down)))
    return sheet.at(each.at.body, each.at.point)


def _turn_in_space(sheet: Sheet, each: AngleMark, at: Floats, label: str) -> Iterator[Mark]:
    """Yield an angle in space with its letter: an arc from a line of reference, a bow while it is zero."""
    turns = each.coordinate and any(each.axis)
    axis = sheet.placed.turned(each.at.body, each.axis)
    start = sheet.placed.turned(each.start.body, each.start.point)
    stop = sheet.placed.turned(each.stop.body, each.stop.point)
    axis = axis if turns else np.array(unit(np.cross(start, stop)))
    other = np.cross(axis, start)
    angle = float(np.arctan2(stop @ other, stop @ start))
    turned = abs(angle) > _TURNED
    if not turned and not turns:
        return  # nothing says about what it would turn
    angles = np.linspace(0.0, angle if turned else _BOW, 20)[:, None]
    rim = np.cos(angles) * start + np.sin(angles) * other
    points = at + (_ARC if turned else _ARC / 2.0) * sheet.projection.page(rim) / sheet.projection.scale
    if float(np.ptp(points, axis=0).max()) < 4.0:
        return
    if turned:  # the line from which the angle is counted
        line = at + np.outer([0.0, _BEYOND], points[0] - at)
        yield Stroke(line, HIDDEN, role="angle", name=each.name, layer=LAYER_ARROW)
    arc = Arrow(points, COORDINATE, head=4.0) if each.coordinate else Stroke(points, THIN)
    yield replace(arc, role="angle", name=each.name, layer=LAYER_ARROW)
    middle = points[len(points) // 2][None, :]
    yield Wish(middle, formula(label), role="angle", name=each.name, layer=LAYER_TEXT)
