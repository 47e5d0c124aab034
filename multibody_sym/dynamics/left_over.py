"""The record of redundant rows: a repeated run reads it without what finds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from multibody_sym.records import dataclass


@dataclass(frozen=True)
class Redundancy:
    """The rank of H without `doubles`, the rows it leaves over, and what that makes ambiguous, by name.

    `dependencies`: for each row left over the rows that depend on each other, in the order of declaration; one alone
    holds what nothing could move. `ambiguous`: joints with the components of their reactions that are not unique, and
    constraints that are no joints; `ambiguous_forces` are the names of these forces in expressions. `doubles`: massless
    bodies by which joints keep their coordinates, with their speeds, each of which a row of its own holds.
    """

    rank: int
    redundant: tuple[str, ...]
    not_unique: tuple[str, ...]
    dependencies: tuple[tuple[str, ...], ...] = ()
    ambiguous: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    doubles: Mapping[str, int] = field(default_factory=dict)
    ambiguous_forces: tuple[str, ...] = ()
