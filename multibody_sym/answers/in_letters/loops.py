"""What closes loops, over letters: equations between positions or speeds, and the forces that hold them.

A joint that was cut closes by the components in space of what its points are apart, whichever axes its rows have.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import Final

import numpy as np

from multibody_sym.algebra.exact_solve import exact_solve
from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.answers.in_letters.coordinates import TIME, Coordinates
from multibody_sym.answers.in_letters.letters import Letters, substituted
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.relative import direction
from multibody_sym.kinematics.rows import row_motion
from multibody_sym.model.mechanism.rows import DistanceRow, PositionRow, Row
from multibody_sym.model.mechanism.sliding_rows import SlidingRow
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import CLOSED, rank
from multibody_sym.records import dataclass
from multibody_sym.scalars.derivatives import gradient, tangents
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node
from multibody_sym.scalars.vectors import Vec, dot, subtract

_AXES: Final = "xyz"
MOST_DEPENDENT: Final = 5
"""How many places at most loops decide in formulas that are read."""
_LARGEST_BLOCK: Final = 3
"""How many equations at most are looked for that have as many unknowns."""


@dataclass(frozen=True)
class Closing:
    """An equation: `zero`, of positions (`holonomic`) or of speeds; times `factor` its rates are those of a row.

    `force` is the letter of what holds it, a force or moment as that of the row, and `says` what that is.
    """

    zero: Node
    force: Node
    says: str
    unit: str
    holonomic: bool = True
    factor: Node = ONE


def closings(motion: Motion, name: Callable[[str], Node]) -> tuple[list[Closing], list[Node]]:
    """Return the equations of a mechanism's rows, and the multiplier of each row over their forces.

    `name` gives free letters. Raises NoClosedFormError for rows that define forces or rub.
    """
    found: list[Closing] = []
    multipliers: list[Node] = []
    rows = motion.mechanism.rows
    bias = accelerations(motion, [0] * len(motion.state.u))
    spread: dict[object, list[Closing]] = {}
    for row in rows:
        if not row.restricts or isinstance(row, SlidingRow):
            raise NoClosedFormError("forces that rub or press in loops are numbers")
        together = [x for x in rows if isinstance(x, PositionRow) and x.frames == row.points]
        if isinstance(row, PositionRow) and len(together) > 1 and _fill_space(together):
            own = spread.get(row.frames)
            if own is None:
                own = spread[row.frames] = list(_apart(motion, row, name))
                found += own
            along = direction(motion, row.frames[0], row.axis)
            multipliers.append(as_node(sum((x * e for x, e in zip([c.force for c in own], along, strict=False)), ZERO)))
            continue
        closing = _of_row(motion, row, name(f"force_{row.name}"), bias)
        found.append(closing)
        multipliers.append(closing.force)
    return found, multipliers


def _fill_space(together: Sequence[PositionRow]) -> bool:
    """Return whether rows hold a point in all directions."""
    return len(together) == len(_AXES)


def _apart(motion: Motion, row: PositionRow, name: Callable[[str], Node]) -> Iterator[Closing]:
    """Yield the components in space of how far the two points of rows are apart, which hold them together."""
    first, second = row.frames
    element = row.name.rpartition(".")[0] or row.name
    apart = subtract(position(motion, second), position(motion, first))
    for axis, component in zip(_AXES, apart, strict=True):
        says = f"force of {element} along {axis} of ground"
        yield Closing(as_node(component), name(f"{element}_{axis}"), says, "N")


def _of_row(motion: Motion, row: Row, force: Node, bias: Sequence[tuple[Vec, Vec]]) -> Closing:
    unit = row.unit or ""
    if isinstance(row, DistanceRow) and row.straight is None:
        apart = subtract(position(motion, row.ends[1]), position(motion, row.ends[0]))
        (length,) = motion.state.values([row.value])
        zero = (dot(apart, apart) - length * length) / 2
        return Closing(as_node(zero), force, f"tension of {row.name}", "N", factor=-1 / as_node(length))
    moved = row_motion(row, motion, bias)
    says = f"force of {row.name}"
    if moved.holonomic:
        return Closing(as_node(moved.phi), force, says, unit)
    return Closing(as_node(moved.phidot), force, says, unit, holonomic=False)


class Loops:
    """The closings that are independent at the start, solved one after the other: each block for its own places.

    `free` and `dependent` places are those of `Coordinates.all`; a block of closings has as many places that no block
    before it has. Raises NoClosedFormError where formulas grow too long.
    """

    def __init__(
        self, coordinates: Coordinates, letters: Letters, assembled: Sequence[str], name: Callable[[str], Node]
    ) -> None:
        self.letters = letters
        found, self.multipliers = closings(coordinates.motion, name)
        self._rates = coordinates.rates
        self._places = [x.letters[0] for x in coordinates.all]
        self._turning = [x.letters[1] for x in coordinates.all]
        found = [replace(x, zero=letters.simplified(x.zero)) for x in found]
        rows = [self._row(x) for x in found]
        sizes = np.array([[float(a.sample) for a in row] for row in rows]).reshape(len(rows), len(self._places))
        kept = _independent(sizes)
        self.closings = [found[k] for k in kept]
        self.jacobian = [rows[k] for k in kept]
        names = [coordinates.mechanism.speeds[x.u].name for x in coordinates.all]
        order = sorted(range(len(names)), key=lambda k: (names[k] not in assembled, -k))
        self.dependent = sorted(order[k] for k in _independent(sizes[kept].T[order]))
        if len(self.dependent) > MOST_DEPENDENT:
            raise NoClosedFormError("loops have more parts than anyone reads formulas of")
        self.free = [k for k in range(len(names)) if k not in self.dependent]
        self.blocks = self._blocks()

    def _row(self, closing: Closing) -> list[Quotient]:
        along = self._places if closing.holonomic else self._turning
        return self.letters.of(gradient(closing.zero, along))

    def _blocks(self) -> list[tuple[list[int], list[int]]]:
        """Return the closings and the places of each block, the smallest that can be solved first."""
        found: list[tuple[list[int], list[int]]] = []
        rows, known = list(range(len(self.jacobian))), set(self.free)
        while rows:
            sizes = range(1, min(len(rows), _LARGEST_BLOCK) + 1)
            tried = (list(x) for size in sizes for x in combinations(rows, size))
            block = next((x for x in tried if len(self._unknown(x, known)) == len(x)), rows)
            places = self._unknown(block, known)
            found.append((block, places))
            rows = [row for row in rows if row not in block]
            known.update(places)
        return found

    def _unknown(self, rows: Sequence[int], known: Collection[int]) -> list[int]:
        return [k for k in self.dependent if k not in known and any(not self.jacobian[row][k].is_zero for row in rows)]

    def solved(
        self, free: Mapping[int, Quotient], right: Sequence[Quotient], told: Callable[[int, Quotient], Quotient]
    ) -> None:
        """Find what the dependent places must be for the closings to come to the right sides.

        Each is `told` as soon as it is found, and stands in the others as what that returns.
        """
        known = dict(free)
        for rows, places in self.blocks:
            matrix = [[self.jacobian[row][k] for k in places] for row in rows]
            found = exact_solve(matrix, [self._less(right[row], self.jacobian[row], known) for row in rows])
            known.update((k, told(k, x)) for k, x in zip(places, found, strict=True))

    @staticmethod
    def _less(right: Quotient, row: Sequence[Quotient], known: Mapping[int, Quotient]) -> Quotient:
        for k, x in known.items():
            right = right - row[k] * x
        return right

    @cached_property
    def drift(self) -> list[Quotient]:
        """The right sides for speeds."""
        rates = tangents([x.zero for x in self.closings], {TIME: ONE})
        at_rest = dict.fromkeys(self._turning, ZERO)
        still = [
            rate if x.holonomic else substituted(x.zero, at_rest) for x, rate in zip(self.closings, rates, strict=True)
        ]
        return [-x for x in self.letters.of(still)]

    @cached_property
    def bias(self) -> list[Quotient]:
        """The right sides for accelerations."""
        rates = tangents([x.zero for x in self.closings], self._rates)
        moving = [rate if x.holonomic else x.zero for x, rate in zip(self.closings, rates, strict=True)]
        return [-x for x in self.letters.of(tangents(moving, self._rates))]

    @property
    def nothing(self) -> list[Quotient]:
        """Right sides that are zero."""
        return [self.letters.field.constant(0)] * len(self.closings)

    def forces(self, wanted: Mapping[int, Quotient], told: Callable[[Closing, Quotient], Quotient]) -> None:
        """Find the forces of the closings that give generalised forces at the dependent places, the last ones first.

        Each is `told` as soon as it is found, and stands in the others as what that returns.
        """
        factors = self.letters.of([x.factor for x in self.closings])
        known: dict[int, Quotient] = {}
        for rows, places in reversed(self.blocks):
            matrix = [[self.jacobian[row][k] * factors[row] for row in rows] for k in places]
            right = []
            for k in places:
                column = {row: self.jacobian[row][k] * factors[row] for row in known}
                right.append(self._less(wanted[k], [column.get(row, wanted[k]) for row in range(len(factors))], known))
            found = exact_solve(matrix, right)
            known.update((row, told(self.closings[row], x)) for row, x in zip(rows, found, strict=True))


def _independent(rows: Floats) -> list[int]:
    """Return which rows are independent of those before them."""
    found: list[int] = []
    for k in range(len(rows)):
        if rank(rows[[*found, k]], CLOSED) == len(found) + 1:
            found.append(k)
    return found
