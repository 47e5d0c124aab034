"""A mechanism in a mode: what holds one way only becomes ordinary rows, as far as it holds there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Final

from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import (
    ACTIVE,
    ALONG_VELOCITY,
    INACTIVE,
    STICKS,
    FrictionPart,
    Mode,
    OneWay,
)
from multibody_sym.model.mechanism.parameters import ParameterEntry, ParameterVector, Source
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.model.mechanism.sliding_rows import Sliding, SlidingRow
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, negate

_DIRECTION: Final = "direction of "
_SHARE: Final = "share of "


def in_mode(mechanism: Mechanism, mode: Mode, held: Iterable[int] = ()) -> Mechanism:
    """Return the mechanism in which active elements are rows, and friction sticks or slides, as a mode says.

    `held` are the places of speeds that stay zero there. Rows keep the order of the elements, after the mechanism's.
    """
    parameters = _with_chosen(mechanism.parameters, mode)
    rows = list(mechanism.rows)
    for element in mechanism.one_way:
        rows += rows_in_mode(element, mode, parameters)
    return replace(
        mechanism,
        rows=tuple(rows),
        parameters=parameters.with_rows(len(rows)),
        mode=mode,
        held=tuple(sorted(held)),
    )


def _with_chosen(parameters: ParameterVector, mode: Mode) -> ParameterVector:
    """Return the vector with what a run chooses in a mode."""
    added = (ParameterEntry(name, as_node(x), source=Source.CHOSEN) for name, x in chosen(mode).items())
    return ParameterVector((*parameters.entries, *added))


def chosen(mode: Mode) -> dict[str, float]:
    """Return what a run chooses in a mode, by the names of parameters.

    Directions in which slip in space starts from rest, and what rows carry whose forces are not unique.
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
    """Return by row of a mechanism in a mode what it carries at first, and the ways in which that changes.

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
    """Return the name of what a row carries at first whose force is not unique."""
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


def rows_in_mode(element: OneWay, mode: Mode, parameters: ParameterVector) -> Iterator[Row]:
    """Yield the rows of an element: those of normals, with sliding friction, and those of friction that sticks."""
    acts = mode.acts(element)
    if (element.unilateral and not acts) or element.name in mode.idle:
        return
    sliding = [part for part in element.frictions if _slides(part, mode)]
    for place, normal in enumerate(element.normals):
        pressed = mode.side(element, normal)
        frictions = tuple(
            _by_length(element, part, normal, _sliding(part, mode, parameters, ACTIVE))
            if part.norm
            else _sliding(part, mode, parameters, pressed)
            for part in sliding
            if place in part.normals and (part.norm or pressed != INACTIVE)
        )
        yield SlidingRow(normal.name, normal, frictions) if frictions else normal
    for part in element.frictions if acts else ():
        sticks = not _slides(part, mode) and part.name not in mode.carried
        if sticks and (part.enough or part.static is not ZERO):
            yield from (row for row in part.rows if row.name not in mode.carried)


def with_coefficients(mechanism: Mechanism, coefficient: Callable[[Sliding], Node]) -> Mechanism:
    """Return a mechanism in a mode in which what slides has other coefficients of friction."""

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


def _by_length(element: OneWay, part: FrictionPart, normal: Row, sliding: Sliding) -> Sliding:
    """Return friction that the length of a vector presses, of which one of its normals is a component."""
    return replace(sliding, beside=tuple(row.name for row in element.normals_of(part) if row is not normal))


def _sliding(part: FrictionPart, mode: Mode, parameters: ParameterVector, side: int) -> Sliding:
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
