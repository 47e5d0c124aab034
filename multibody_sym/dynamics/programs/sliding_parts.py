"""Friction in Programs of all modes: what rows exert, and their multipliers, with what slides.

A sliding part exerts its limit along its slip, for a unit of what presses it: its normals bring that along.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ZERO, Node, as_node, real
from multibody_sym.scalars.vectors import S

_SHORT: Final = real(1e-300)
"""The square of a force that has no direction."""

Row = dict[int, Node]
"""The elements of a row of a matrix that may differ from zero, by their columns."""


@dataclass(frozen=True)
class Friction:
    """A part that rubs: the places of its normals, each with its side, and of its tangents with the forces along them.

    These are for a unit normal force, zero where it does not slide. `norm`: the length of the normals presses.
    """

    normals: list[int]
    sides: list[Node]
    tangents: list[int]
    forces: Sequence[Node]
    norm: bool

    def by_sides(self) -> Iterator[tuple[int, int, Node]]:
        """Yield places of a normal and a tangent, with the force along this for a unit of the normal's multiplier."""
        for normal, side in zip(self.normals, self.sides, strict=True):
            for tangent, force in zip(self.tangents, self.forces, strict=True):
                yield normal, tangent, side * force

    def along(self, multipliers: Sequence[Node]) -> Friction:
        """Return the part with the direction of its reaction for sides: |F| = d . F with the direction d of F."""
        F = [multipliers[k] for k in self.normals]
        size = as_node(sqrt(sum((x * x for x in F), _SHORT)))
        return replace(self, sides=[x / size for x in F]) if self.norm else self


def with_sliding(exerted: Sequence[Row], frictions: Iterable[Friction]) -> list[Row]:
    """Return what the rows exert: normals bring friction along where something slides."""
    found = [dict(row) for row in exerted]
    for normal, tangent, force in (each for friction in frictions for each in friction.by_sides()):
        for k, x in exerted[tangent].items():
            found[normal][k] = found[normal].get(k, ZERO) + force * x
    return found


def with_friction(multipliers: Sequence[Node], frictions: Iterable[Friction]) -> list[Node]:
    """Return the multipliers of all rows with those of what slides."""
    found = list(multipliers)
    for normal, tangent, force in (each for friction in frictions for each in friction.by_sides()):
        found[tangent] = found[tangent] + force * multipliers[normal]
    return found


def combination(parts: Iterable[tuple[S, Row]]) -> Row:
    """Return the sum of rows, each times its factor."""
    found: Row = {}
    for factor, row in parts:
        for k, x in row.items():
            found[k] = found.get(k, ZERO) + factor * x
    return found


def times(row: Row, x: Sequence[Node]) -> Node:
    """Return the product of a row with x."""
    return sum((a * x[k] for k, a in sorted(row.items())), ZERO)
