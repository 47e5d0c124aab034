"""A mechanism in all its modes: every row that may act is there, and numbers say which do and how they rub.

What a mode says becomes data of the Programs: 1 for each row that acts, the side on which each reaction presses, the
way in which each friction part slides, the direction in which slip in space starts, what rows share, and which speeds
stand still.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

from multibody_sym.model.mechanism.contact_rows import ContactRow, Edge, Flat, Tip
from multibody_sym.model.mechanism.limits import sided
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.modes import direction_names, in_mode, share_name, way_name
from multibody_sym.model.mechanism.once import once
from multibody_sym.model.mechanism.one_way import FrictionPart, Mode, OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.numerics.least_norm import PLAIN
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ONE, Node, slot

MODES: Final = "modes"
"""The array of these numbers."""


def every_row(mechanism: Mechanism) -> tuple[Row, ...]:
    """Return a mechanism's rows and those of its one-way elements after them."""
    return (*mechanism.rows, *(row for element in mechanism.one_way for row in element.rows))


@once
def friction_parts(mechanism: Mechanism) -> tuple[tuple[OneWay, FrictionPart], ...]:
    """Return the friction parts that rub, with their elements."""
    pairs = ((element, part) for element in mechanism.one_way for part in element.frictions)
    return tuple((x, part) for x, part in pairs if part.rubs)


def in_every_mode(mechanism: Mechanism, *, shares: bool = False) -> Mechanism:
    """Return a mechanism in no mode with every row and the names of the numbers that say which of them act.

    It has those of shares where forces may be shared, or as one contact of several has them.
    """
    rows = every_row(mechanism)
    names = [_acts(row.name) for row in rows]
    names += [_side(row.name) for element in mechanism.one_way for row in element.normals if not element.unilateral]
    for _, part in friction_parts(mechanism):
        names += [_slip(part.name), _at_limit(part.name), *(direction_names(part) if len(part.rows) > 1 else ())]
    if shares or may_share(mechanism):
        names += [share_name(row.name) for row in rows]
        names += [way_name(row.name, other.name) for group in _groups(mechanism) for row, other in _pairs(group)]
    names += [_held(speed.name) for speed in mechanism.speeds]
    names += [_ACTS, _STANDS, _LENGTHS, _SHARES]
    names += [_watched(function) for function in functions(mechanism)]
    return replace(
        mechanism,
        rows=rows,
        parameters=mechanism.parameters.with_rows(len(rows)),
        mode_numbers=tuple(names),
    )


@once
def functions(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the names of the switching functions that a mode may have."""
    return tuple(_functions(mechanism))


def _functions(mechanism: Mechanism) -> Iterator[str]:
    for element in mechanism.one_way:
        if not element.unilateral:
            yield from (f"turns {element.normals[k].name}" for k in sided(element))
            continue
        yield f"normal {element.name}"
        if has_end(element):
            yield f"edge {element.name}"
        if has_rim(element):
            yield f"flat {element.name}"
    for _, part in friction_parts(mechanism):
        yield f"slip {part.name}"
        if len(part.rows) > 1:
            yield f"onward {part.name}"
            yield f"back {part.name}"


def may_share(mechanism: Mechanism) -> bool:
    """Return whether forces may have shares where they are not unique: not where rows define what presses."""
    elements = [element for element in mechanism.one_way if element.unilateral]
    several = len(elements) > 1 or any(len(part.rows) > 1 for x in elements for part in x.frictions)
    return several and all(row.restricts for row in every_row(mechanism))


def _groups(mechanism: Mechanism) -> Iterator[tuple[Row, ...]]:
    """Yield the rows that may change what they carry together: those of each element, and the model's own alone."""
    yield from ((row,) for row in mechanism.rows)
    yield from (tuple(element.rows) for element in mechanism.one_way)


def _pairs(group: Sequence[Row]) -> Iterator[tuple[Row, Row]]:
    yield from ((row, other) for k, row in enumerate(group) for other in group[k:])


def has_end(element: OneWay) -> bool:
    """Return whether what touches may get past the end of a face."""
    row = element.normals[0] if element.normals else None
    return isinstance(row, ContactRow) and any(
        isinstance(skin, Edge | Tip) or (isinstance(skin, Flat) and bool(skin.ends or skin.beside))
        for skin in row.skins
    )


def has_rim(element: OneWay) -> bool:
    """Return whether what touches is the rim of a disc in space, which may come to lie flat."""
    row = element.normals[0] if element.normals else None
    return isinstance(row, ContactRow) and row.rim is not None


_ACTS: Final = "some row acts"
_STANDS: Final = "some speed is held"
_LENGTHS: Final = "some length presses"
_SHARES: Final = "some force is shared"


def _acts(row: str) -> str:
    return f"acts {row}"


def _side(row: str) -> str:
    return f"side {row}"


def _slip(part: str) -> str:
    return f"slip {part}"


def _at_limit(part: str) -> str:
    return f"at limit {part}"


def _held(speed: str) -> str:
    return f"held {speed}"


def _watched(function: str) -> str:
    return f"watched {function}"


@dataclass(frozen=True, eq=False)
class ModeNodes:
    """The numbers of a mode of a mechanism `in_every_mode` as Nodes."""

    mechanism: Mechanism

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: k for k, name in enumerate(self.mechanism.mode_numbers)}

    def _node(self, name: str) -> Node:
        return slot(MODES, self._places[name])

    def acts(self, row: Row) -> Node:
        """Return 1 where a row acts, else 0."""
        return self._node(_acts(row.name))

    def side(self, element: OneWay, row: Row) -> Node:
        """Return the sign of the force of a normal row, 0 where it does not press."""
        return ONE if element.unilateral else self._node(_side(row.name))

    def slip(self, part: FrictionPart) -> Node:
        """Return the way in which a part slides, 0 where it does not; in space 2."""
        return self._node(_slip(part.name))

    def at_limit(self, part: FrictionPart) -> Node:
        """Return 1 where a part that does not slide exerts its static limit as if it did."""
        return self._node(_at_limit(part.name))

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
        own = replace(self.mechanism, rows=rows[: _declared(self.mechanism)])
        for row, other in (pair for group in _groups(own) for pair in _pairs(group)):
            found[places[row.name]].append((places[other.name], self._node(way_name(row.name, other.name))))
        return found

    @property
    def any_length(self) -> Node:
        """Return 1 where the length of a reaction presses on something that slides."""
        return self._node(_LENGTHS)

    def held(self) -> list[Node]:
        """Return of each speed 1 where it stays zero."""
        return [self._node(_held(speed.name)) for speed in self.mechanism.speeds]

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
        return self._node(_watched(function))


def mode_numbers(mechanism: Mechanism, mode: Mode, held: Collection[int], watched: Iterable[str]) -> list[float]:
    """Return the numbers of a mode of a mechanism `in_every_mode`, which may end at the functions `watched`.

    What a run chooses in a mode, as the shares of rows, is another matter (`chosen`).
    """
    entered = in_mode(replace(mechanism, rows=mechanism.rows[: _declared(mechanism)]), mode)
    acts = 1.0 if mode.shares is None else PLAIN
    found = {_acts(row.name): acts for row in entered.rows}
    for element in mechanism.one_way:
        found |= {_side(row.name): float(mode.side(element, row)) for row in element.normals}
    parts = {tuple(row.name for row in part.rows): part for _, part in friction_parts(mechanism)}
    for sliding in _sliding(entered.rows):
        part = parts[tuple(row.name for row in sliding.rows)]
        found[_slip(part.name)] = float(sliding.sense)
        found[_at_limit(part.name)] = float(part.name in mode.carried)
        found[_LENGTHS] = max(found.get(_LENGTHS, 0.0), float(part.norm))
    found |= {way_name(row.name, row.name): 1.0 for row in mechanism.rows}
    found |= {_held(mechanism.speeds[k].name): 1.0 for k in held}
    found |= {_ACTS: float(bool(entered.rows)), _STANDS: float(bool(held)), _SHARES: float(mode.shares is not None)}
    found |= {_watched(function): 1.0 for function in watched}
    return [found.get(name, 0.0) for name in mechanism.mode_numbers]


def _declared(mechanism: Mechanism) -> int:
    """Return how many rows of a mechanism `in_every_mode` act in all modes, which come first."""
    return len(mechanism.rows) - sum(1 for element in mechanism.one_way for _ in element.rows)


def _sliding(rows: Iterable[Row]) -> Iterator[Sliding]:
    for row in rows:
        yield from row.frictions if isinstance(row, SlidingRow) else ()
