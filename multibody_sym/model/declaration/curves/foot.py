"""What follows the place where a curve is touched: made of declarations, never declared itself."""

from __future__ import annotations

from typing import ClassVar

from multibody_sym.model.declaration.fields import ListOf, holds
from multibody_sym.model.declaration.joints import CurveJoint
from multibody_sym.model.declaration.values import Count, Text
from multibody_sym.records import dataclass


@dataclass(frozen=True, kw_only=True)
class Foot(CurveJoint):
    """The joint of a massless frame whose x is the tangent of a curve where that is nearest to something else.

    It belongs to the contact or constraint `owner`, and follows the curve that the end number `end` of its two ends
    `between` names.
    """

    kind: ClassVar[str] = "foot"
    owner: str = holds(Text(), says="the contact or constraint whose place it follows", such="c1")
    between: tuple[str, ...] = holds(ListOf(Text(), 2, 2), says="the two ends of that contact", such="[a, b]")
    end: int = holds(Count(0), says="which of the two is the curve", such="0")
