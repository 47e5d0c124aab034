"""Impacts: what strikes and how, and the rows that make jumps of speeds of accelerations.

An impact is the mechanism at rest without loads: with u = 0, no gravity, no forces but the given impulses, and for
gamma the jump that a row is to have, udot are the jumps of the speeds, multipliers the impulses and reactions the
impulses in the joints. `dynamics/contact/impact_problem.py` makes that mechanism.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar, Final

from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.load_records import Load
from multibody_sym.mechanics.row_records import Marker, Multiplier, Row, RowAround
from multibody_sym.model.fields import Point
from multibody_sym.model.steps import is_upright
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node, slot

MEETING: Final = "meeting"
"""The array of relative velocities, second against first, of points that meet without a normal: three for each pair."""


@dataclass(frozen=True)
class MeetingRow(Row):
    """Two points that meet: their relative velocity, first to second, along a unit vector in the axes of a frame.

    Along their normal it `closes`, and phi is how far they are apart; along tangents it rubs.
    """

    unit: ClassVar[str | None] = "N"
    multiplier: ClassVar[Multiplier] = "force"
    laws: ClassVar[tuple[Node, ...]] = ()

    ends: tuple[Marker, Marker]
    axis: Point
    frame: Marker
    closes: bool = True

    @property
    def is_holonomic(self) -> bool:
        return self.closes

    @property
    def acts_in_plane(self) -> bool:
        return not is_upright(self.axis)

    @property
    def points(self) -> tuple[Marker, ...]:
        return self.ends


@dataclass(frozen=True)
class JumpRow(RowAround):
    """A row in an impact: its speed is to change by `wanted`, and its multiplier is an impulse."""

    row: Row
    wanted: Node

    @property
    def of(self) -> Row:
        return self.row

    @property
    def laws(self) -> tuple[Node, ...]:
        return (*self.row.laws, self.wanted)


@dataclass(frozen=True)
class GivenRow(JumpRow):
    """A row in an impact that restricts nothing: its multiplier, an impulse, is `wanted`."""

    restricts: ClassVar[bool] = False


@dataclass(frozen=True)
class SpeedJump:
    """A prescribed motion whose rate jumps by `by`: that of a joint that moves as prescribed, or of a row."""

    name: str
    joint: str
    row: str
    by: Node


@dataclass(frozen=True)
class StruckImpacts:
    """An `impact:` section, resolved.

    `meetings` are its own pairs of points; `contacts` names declared elements that strike (None: all that close, if
    nothing else is declared). `loads` are given impulses and couples as forces. `begins` names the joints and
    constraints that did not hold before, with the rows of each; `jumps` prescribed motions. `restitutions` and
    `tangential` are coefficients that the section gives to declared contacts. `paths` say where each is declared.
    """

    meetings: tuple[LawElement, ...]
    contacts: tuple[str, ...] | None
    loads: tuple[Load, ...]
    begins: Mapping[str, tuple[str, ...]]
    jumps: tuple[SpeedJump, ...]
    restitutions: Mapping[str, Node] = field(default_factory=dict)
    tangential: Mapping[str, Node] = field(default_factory=dict)
    law: str | None = None
    sequence: str | None = None
    paths: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


INSTANT: Final = slot("instant", 0)
"""The time of an impact, which stands still while it lasts."""
JUMPED: Final = slot("jumped", 0)
"""0 before an impact and 1 after it, for prescribed motions whose rates jump."""
JUMP: Final = "jump"
"""The array of the jumps that rows of an impact are to have."""


def jump_leaf(row: int) -> Node:
    """Return the leaf for the jump of the speed of row number `row` of an impact."""
    return slot(JUMP, row)
