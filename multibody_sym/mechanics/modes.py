"""What is a mechanism in a mode: which elements act as ordinary rows, how do they rub, and in which words?"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final, Literal

from multibody_sym.errors import InputError, at
from multibody_sym.mechanics.law_elements import (
    ACTIVE,
    ALONG_VELOCITY,
    INACTIVE,
    STICKS,
    FrictionPart,
    LawElement,
    Mode,
    sided_normals,
)
from multibody_sym.mechanics.mechanism import Mechanism, ParameterEntry, ParameterVector, Source, once
from multibody_sym.mechanics.row_records import Edge, RopeRow, Row, Sliding, SlidingRow, Vertex
from multibody_sym.model.state_words import STRIKES, VERBS
from multibody_sym.records import dataclass
from multibody_sym.scalars.least_norm import PLAIN
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, negate, slot

_DIRECTION: Final = "direction of "
_SHARE: Final = "share of "


def in_mode(mechanism: Mechanism, mode: Mode, held: Iterable[int] = ()) -> Mechanism:
    """Return the mechanism in which active elements are rows, and friction sticks or slides, as a mode says.

    `held` are the places of speeds that stay zero there. Rows keep the order of the elements, after the mechanism's.
    """
    added = (ParameterEntry(name, as_node(x), source=Source.CHOSEN) for name, x in chosen_parameters(mode).items())
    parameters = ParameterVector((*mechanism.parameters.entries, *added))
    rows = list(mechanism.rows)
    for element in taking_part(mechanism, mode):
        rows += rows_in_mode(element, mode, parameters)
    return replace(
        mechanism,
        rows=tuple(rows),
        parameters=parameters.with_rows(len(rows)),
        mode=mode,
        held=tuple(sorted(held)),
    )


@once
def element_numbers(mechanism: Mechanism) -> dict[str, int]:
    """Return the number of each one-way element by its name."""
    return {element.name: k for k, element in enumerate(mechanism.one_way)}


@once
def _two_sided(mechanism: Mechanism) -> frozenset[int]:
    return frozenset(k for k, element in enumerate(mechanism.one_way) if not element.unilateral)


def taking_part(mechanism: Mechanism, mode: Mode) -> list[LawElement]:
    """Return the elements that touch, are taut or may act at any time in a mode: all but those that are apart."""
    places = element_numbers(mechanism)
    named = (*(name for name, side in mode.sides.items() if side != INACTIVE), *mode.idle)
    found = {places[name] for name in named if name in places} | _two_sided(mechanism)
    return [mechanism.one_way[k] for k in sorted(found)]


def chosen_parameters(mode: Mode) -> dict[str, float]:
    """Return the values that a run chooses in a mode, by the names of parameters.

    Directions in which slip in space starts from rest, and shares of forces that are not unique.
    """
    found = {
        _direction_name(name, k): x for name, direction in mode.directions.items() for k, x in enumerate(direction)
    }
    for share in mode.shares.elements if mode.shares is not None else ():
        found |= {share_name(row): force for row, force in zip(share.rows, share.forces, strict=True)}
        for k, way in enumerate(share.ways):
            found |= {way_name(share.rows[k], row): x for row, x in zip(share.rows[k:], way, strict=True)}
    return found


def shared_forces(mechanism: Mechanism) -> tuple[list[Node], list[list[tuple[int, Node]]]] | None:
    """Return the force that each row of a mechanism in a mode carries at first, and the ways in which forces change.

    A way is some rows by number, each with its part. None where forces are unique or zero for dependent rows.
    """
    mode, slot = mechanism.mode, mechanism.parameters.slot
    if mode is None or mode.shares is None:
        return None
    places = {row.name: k for k, row in enumerate(mechanism.rows)}
    forces = [ZERO] * len(places)
    ways = [[(k, ONE)] for k in range(len(places))]
    for share in mode.shares.elements:
        for k, row in enumerate(share.rows):
            forces[places[row]] = slot(share_name(row))
            ways[places[row]] = [(places[other], slot(way_name(row, other))) for other in share.rows[k:]]
    return forces, ways


def share_name(row: str) -> str:
    """Return the name of the force that a row carries at first, where forces are not unique."""
    return _SHARE + row


def way_name(row: str, other: str) -> str:
    """Return the name of the part of another row in the way that takes the place of a row."""
    return f"{_SHARE}{row} with {other}"


def _direction_name(part: str, component: int) -> str:
    return f"{_DIRECTION}{part} {component + 1}"


def direction_names(part: FrictionPart) -> list[str]:
    """Return the names of the components of the direction in which a part starts to slide in space."""
    return [_direction_name(part.name, k) for k in range(len(part.rows))]


def is_direction(name: str) -> bool:
    """Return whether a parameter is a component of the direction in which something starts to slide in space."""
    return name.startswith(_DIRECTION)


def rows_in_mode(element: LawElement, mode: Mode, parameters: ParameterVector) -> Iterator[Row]:
    """Yield the rows of an element: those of normals, with sliding friction, and those of friction that sticks."""
    acts = mode.acts(element)
    if (element.unilateral and not acts) or element.name in mode.idle:
        return
    sliding = [part for part in element.frictions if _slides(part, mode)]
    for place, normal in enumerate(element.normals):
        pressed = mode.side(element, normal)
        frictions = []
        for part in (part for part in sliding if place in part.normals):
            if part.norm:  # the length of a vector presses, of which this normal is a component
                beside = tuple(row.name for row in element.normals_of(part) if row is not normal)
                frictions.append(replace(_slide(part, mode, parameters, ACTIVE), beside=beside))
            elif pressed != INACTIVE:
                frictions.append(_slide(part, mode, parameters, pressed))
        yield SlidingRow(normal.name, normal, tuple(frictions)) if frictions else normal
    for part in element.frictions if acts else ():
        sticks = not _slides(part, mode) and part.name not in mode.carried
        if sticks and (part.enough or part.static is not ZERO):
            yield from (row for row in part.rows if row.name not in mode.carried)


def with_coefficients(mechanism: Mechanism, coefficient: Callable[[Sliding], Node]) -> Mechanism:
    """Return a mechanism in a mode with other coefficients of sliding friction."""

    def changed(row: Row) -> Row:
        if not isinstance(row, SlidingRow):
            return row
        return replace(row, frictions=tuple(replace(f, coefficient=coefficient(f)) for f in row.frictions))

    return replace(mechanism, rows=tuple(map(changed, mechanism.rows)))


def _slides(part: FrictionPart, mode: Mode) -> bool:
    return part.regularised is not None or slip_of(part, mode) != STICKS


def slip_of(part: FrictionPart, mode: Mode) -> int:
    """Return how the force of a friction part goes: as it slips, or as if where it is at its static limit."""
    return mode.slip(part) or mode.carried.get(part.name, STICKS)


def _slide(part: FrictionPart, mode: Mode, parameters: ParameterVector, side: int) -> Sliding:
    """Return how a part slides; a reaction that presses on the negative side rubs by its size."""
    limit = part.static if part.name in mode.carried else part.kinetic
    coefficient: Node = limit if side > 0 else negate(limit)
    if part.regularised is not None:
        return Sliding(part.rows, coefficient, 1, part.wrap, regularised=part.regularised)
    slip = slip_of(part, mode)
    starts = None
    if slip == ALONG_VELOCITY and part.name in mode.directions:
        starts = tuple(parameters.slot(_direction_name(part.name, k)) for k in range(len(part.rows)))
    return Sliding(part.rows, coefficient, slip, part.wrap, starts)


# ----------------------------------------------------------------------------------------------------------------------
# A mechanism in all its modes: every row that may act is there, and numbers say which do and how they rub.
#
# A mode becomes data of the Programs: 1 for each row that acts, the side on which each reaction presses, the way in
# which each friction part slides, the direction in which slip in space starts, shares of rows, speeds that stand still.

MODES: Final = "modes"
"""The array of these numbers."""


def every_row(mechanism: Mechanism) -> tuple[Row, ...]:
    """Return a mechanism's rows and those of its one-way elements after them."""
    return (*mechanism.rows, *(row for element in mechanism.one_way for row in element.rows))


@once
def friction_parts(mechanism: Mechanism) -> tuple[tuple[LawElement, FrictionPart], ...]:
    pairs = ((element, part) for element in mechanism.one_way for part in element.frictions)
    return tuple((x, part) for x, part in pairs if part.rubs)


def in_every_mode(mechanism: Mechanism, *, shares: bool = False) -> Mechanism:
    """Return a mechanism in no mode with every row and the names of the numbers that say which of them act.

    It has those of shares where forces may be shared, or as one contact of several has them.
    """
    rows = every_row(mechanism)
    return replace(
        mechanism,
        rows=rows,
        parameters=mechanism.parameters.with_rows(len(rows)),
        mode_numbers=tuple(mode_numbers(mechanism, shares=shares or may_share(mechanism))),
    )


def mode_numbers(mechanism: Mechanism, *, shares: bool) -> list[str]:
    """Return the names of the numbers of a mode, with those of shares or without."""
    rows = every_row(mechanism)
    names = [_entry("acts", row.name) for row in rows]
    for element in mechanism.one_way:
        names += [] if element.unilateral else [_entry("side", row.name) for row in element.normals]
    for _, part in friction_parts(mechanism):
        names += [_entry("slip", part.name), _entry("at limit", part.name)]
        names += direction_names(part) if len(part.rows) > 1 else []
    if shares:
        names += [share_name(row.name) for row in rows]
        names += [way_name(row.name, other.name) for group in _groups(mechanism) for row, other in _pairs(group)]
    names += [_entry("held", speed.name) for speed in mechanism.speeds]
    names += [_ACTS, _STANDS, _LENGTHS, _SHARES]
    return [*names, *(_entry("watched", function) for function in functions(mechanism))]


@once
def functions(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of the switching functions that a mode may have."""
    normals = (name for element in mechanism.one_way for name in _functions_of_normals(element))
    return (*normals, *(name for _, part in friction_parts(mechanism) for name in _functions_of_slip(part)))


def functions_of(element: LawElement) -> list[str]:
    """Return the names of the switching functions of an element."""
    slips = (name for part in element.frictions if part.rubs for name in _functions_of_slip(part))
    return [*_functions_of_normals(element), *slips]


def _functions_of_normals(element: LawElement) -> list[str]:
    if not element.unilateral:
        return [f"turns {element.normals[k].name}" for k in sided_normals(element)]
    ends = [f"edge {element.name}"] * has_end(element) + [f"flat {element.name}"] * has_rim(element)
    return [f"normal {element.name}", *ends]


def _functions_of_slip(part: FrictionPart) -> list[str]:
    turned = [f"onward {part.name}", f"back {part.name}"] if len(part.rows) > 1 else []
    return [f"slip {part.name}", *turned]


def may_share(mechanism: Mechanism) -> bool:
    """Return whether forces may have shares where they are not unique: not where rows define forces."""
    elements = [element for element in mechanism.one_way if element.unilateral]
    several = len(elements) > 1 or any(len(part.rows) > 1 for x in elements for part in x.frictions)
    return several and all(row.restricts for row in every_row(mechanism))


def _groups(mechanism: Mechanism) -> Iterator[tuple[Row, ...]]:
    """Yield the rows whose forces may change together: those of each element, and the model's own alone."""
    yield from ((row,) for row in mechanism.rows)
    yield from (tuple(element.rows) for element in mechanism.one_way)


def _pairs(group: Sequence[Row]) -> Iterator[tuple[Row, Row]]:
    yield from ((row, other) for k, row in enumerate(group) for other in group[k:])


def has_end(element: LawElement) -> bool:
    """Return whether a contact may get past the end of a face."""
    return any(
        isinstance(skin, Edge | Vertex) or (skin.plane is not None and bool(skin.plane.ends or skin.plane.beside))
        for skin in element.surfaces or ()
    )


def has_rim(element: LawElement) -> bool:
    """Return whether a contact is of the rim of a disc in space, which may come to lie flat."""
    return bool(element.normals) and element.normals[0].rim is not None


_ACTS: Final = "some row acts"
_STANDS: Final = "some speed is held"
_LENGTHS: Final = "some length presses"
_SHARES: Final = "some force is shared"


def _entry(kind: Literal["acts", "side", "slip", "at limit", "held", "watched"], name: str) -> str:
    """Return the name of a number that says something of a row, a friction part, a speed or a switching function."""
    return f"{kind} {name}"


@dataclass(frozen=True, eq=False)
class ModeNodes:
    """The numbers of a mode of a mechanism `in_every_mode` as Nodes."""

    mechanism: Mechanism

    def _node(self, name: str) -> Node:
        return slot(MODES, number_places(self.mechanism)[name])

    def acts(self, row: Row) -> Node:
        """Return 1 where a row acts, else 0."""
        return self._node(_entry("acts", row.name))

    def side(self, element: LawElement, row: Row) -> Node:
        """Return the sign of the force of a normal row, 0 where it does not press."""
        return ONE if element.unilateral else self._node(_entry("side", row.name))

    def slip(self, part: FrictionPart) -> Node:
        """Return the way in which a part slides, 0 where it does not; in space 2."""
        return self._node(_entry("slip", part.name))

    def at_limit(self, part: FrictionPart) -> Node:
        """Return 1 where a part that does not slide exerts its static limit as if it did."""
        return self._node(_entry("at limit", part.name))

    def direction(self, part: FrictionPart) -> list[Node]:
        """Return the direction in which slip in space starts, zeros where it does not start."""
        return [self._node(name) for name in direction_names(part)]

    def carried(self) -> list[Node]:
        """Return what each row carries at first."""
        return [self._node(share_name(row.name)) for row in self.mechanism.rows]

    def ways(self) -> list[list[tuple[int, Node]]]:
        """Return the ways, one in the place of each row, in which that changes: rows by number with their parts."""
        rows = self.mechanism.rows
        found: list[list[tuple[int, Node]]] = [[] for _ in rows]
        places = {row.name: k for k, row in enumerate(rows)}
        # the rows that act in every mode come first
        always = len(rows) - sum(1 for element in self.mechanism.one_way for _ in element.rows)
        own = replace(self.mechanism, rows=rows[:always])
        for row, other in (pair for group in _groups(own) for pair in _pairs(group)):
            found[places[row.name]].append((places[other.name], self._node(way_name(row.name, other.name))))
        return found

    @property
    def any_length(self) -> Node:
        """Return 1 where the length of a reaction presses on something that slides."""
        return self._node(_LENGTHS)

    def held(self) -> list[Node]:
        """Return of each speed 1 where it stays zero."""
        return [self._node(_entry("held", speed.name)) for speed in self.mechanism.speeds]

    @property
    def any_shares(self) -> Node:
        """Return 1 where forces that are not unique are shared."""
        return self._node(_SHARES)

    @property
    def any_acts(self) -> Node:
        """Return 1 where some row acts."""
        return self._node(_ACTS)

    @property
    def any_held(self) -> Node:
        """Return 1 where some speed stays zero."""
        return self._node(_STANDS)

    def watched(self, function: str) -> Node:
        """Return 1 where a mode may end at a switching function."""
        return self._node(_entry("watched", function))


def own_numbers(mechanism: Mechanism, entered: Mechanism, watched: Mapping[str, float]) -> dict[int, float]:
    """Return the numbers, by places, in which a mechanism `in_every_mode` is as one `entered`, beside `usual_numbers`.

    `watched`: 1 for functions at which it may end, and 0. What a run chooses in a mode, as the shares of rows, is
    another matter (`chosen_parameters`).
    """
    mode = entered.mode
    assert mode is not None
    acts = 1.0 if mode.shares is None else PLAIN
    found = {_entry("acts", row.name): acts for row in entered.rows}
    for element in (mechanism.one_way[k] for k in _two_sided(mechanism)):
        found |= {_entry("side", row.name): float(mode.side(element, row)) for row in element.normals}
    parts = _parts_by_rows(mechanism)
    for sliding in (sliding for row in entered.rows for sliding in row.sliding):
        part = parts[tuple(row.name for row in sliding.rows)]
        found[_entry("slip", part.name)] = float(sliding.sense)
        found[_entry("at limit", part.name)] = float(part.name in mode.carried)
        found[_LENGTHS] = max(found.get(_LENGTHS, 0.0), float(part.norm))
    found |= {_entry("held", mechanism.speeds[k].name): 1.0 for k in entered.held}
    found |= {_ACTS: float(bool(entered.rows)), _STANDS: float(bool(entered.held))}
    found |= {_SHARES: float(mode.shares is not None)}
    found |= {_entry("watched", function): x for function, x in watched.items()}
    places = number_places(mechanism)
    return {places[name]: x for name, x in found.items() if name in places}


@once
def number_places(mechanism: Mechanism) -> dict[str, int]:
    """Return the places of the numbers of a mode by their names."""
    return {name: k for k, name in enumerate(mechanism.mode_numbers)}


@once
def usual_numbers(mechanism: Mechanism) -> dict[int, float]:
    """Return the numbers, by places, that all modes have where others are zero: each row changes by itself."""
    own, places = {way_name(row.name, row.name) for row in mechanism.rows}, number_places(mechanism)
    return {places[name]: 1.0 for name in own if name in places}


@once
def _parts_by_rows(mechanism: Mechanism) -> dict[tuple[str, ...], FrictionPart]:
    return {tuple(row.name for row in part.rows): part for _, part in friction_parts(mechanism)}


# ----------------------------------------------------------------------------------------------------------------------
# Ropes that hold both ways, and the words for a mode: one for each element, and for friction parts beside it.


def taut_ropes(mechanism: Mechanism) -> Iterator[tuple[int, RopeRow]]:
    """Yield by number the rows of ropes that hold both ways, as declared: they must not push."""
    own = {row.name for element in mechanism.one_way for row in element.rows}
    for k, row in enumerate(mechanism.rows):
        if row.rope_run is not None and row.name not in own:
            yield k, row.rope_run


_ENDINGS: Final = {1: "+", -1: "-", ALONG_VELOCITY: ""}
_SLIPS: Final = {ending: slip for slip, ending in _ENDINGS.items() if ending}


def mode_words(elements: Iterable[LawElement], mode: Mode) -> dict[str, str]:
    """Return the state of each element by name, and of friction parts that have a name of their own.

    Contacts `stick`, `slide+`, `slide-`, `slide` (in space), `closed` where nothing rubs, `open`; ropes and stops
    the words they have; friction in joints as contacts; rolling `roll`, `slip+`, `slip-`; wheels `grip`.
    """
    found: dict[str, str] = {}
    for element in elements:
        active = not element.unilateral or mode.acts(element)
        rubbing = [part for part in element.frictions if part.rubs]
        if not active or all(part.name != element.name for part in rubbing):
            found[element.name] = element.words[0 if active else 1]
        for part in rubbing if active else ():
            rests, moves = _friction_words(element, part)
            slip = mode.slip(part)
            found[part.name] = rests if slip == STICKS else moves + _ENDINGS[slip]
    return found


def changed_words(mechanism: Mechanism, before: Mode, now: Mode) -> dict[str, str]:
    """Return the words of `mode_words` in which a mode differs from one before."""
    either = {x.name for mode in (before, now) for x in taking_part(mechanism, mode)}
    places = element_numbers(mechanism)
    elements = [mechanism.one_way[k] for k in sorted(places[name] for name in either)]
    words = mode_words(elements, before)
    return {name: word for name, word in mode_words(elements, now).items() if words.get(name) != word}


def possible_words(elements: Iterable[LawElement]) -> dict[str, set[str]]:
    """Return the words of all states in which elements, and friction parts with a name of their own, may be.

    What may close may strike too.
    """
    found: dict[str, set[str]] = {}
    for element in elements:
        rubbing = [part for part in element.frictions if part.rubs]
        acts = () if any(part.name == element.name for part in rubbing) else element.words[:1]
        words = (*acts, *element.words[1:], *VERBS[STRIKES]) if element.unilateral else acts
        found.setdefault(element.name, set()).update(words)
        for part in rubbing:
            rests, moves = _friction_words(element, part)
            ways = [_ENDINGS[ALONG_VELOCITY]] if len(part.rows) > 1 else [_ENDINGS[1], _ENDINGS[-1]]
            found.setdefault(part.name, set()).update((rests, *(moves + way for way in ways)))
    return found


def mode_of_words(elements: Sequence[LawElement], words: Mapping[str, str]) -> Mode:
    """Return the mode with these words; elements without one are open, and friction without one sticks.

    Raises InputError for unknown names and words.
    """
    known = possible_words(elements)
    for name, word in words.items():
        with at("mode"):
            if name not in known:
                raise InputError(f"{name!r} is nothing that holds or lets go", number="M106", word=name, known=known)
            states = sorted(known[name].difference(VERBS[STRIKES]))
            if word not in states:
                raise InputError(f"{name} is no {word!r}; it may be {', '.join(states)}", number="M106")
    sides, slips = dict[str, int](), dict[str, int]()
    for element in elements:
        acts = not element.unilateral or any(
            words.get(name, element.words[1]) != element.words[1] for name in (element.name, element.group)
        )
        sides[element.name] = ACTIVE if acts else INACTIVE
        for part in element.frictions if acts else ():
            word = words.get(part.name, "")
            if word.startswith(("slide", "slip")):
                slips[part.name] = _SLIPS.get(word[-1], ALONG_VELOCITY)
    return Mode(sides, slips)


def _friction_words(element: LawElement, part: FrictionPart) -> tuple[str, str]:
    """Return the words for friction that holds, and for a part that slides."""
    if part.name.endswith(".rolling") or (element.kind == "contact" and element.path[0] == "constraints"):
        return "roll", "slip"
    return ("grip", "slip") if element.kind == "rope" else ("stick", "slide")
