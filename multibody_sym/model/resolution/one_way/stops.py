"""Stops: the limits of joints that act, each a row phi >= 0 on the joint's coordinate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from multibody_sym.model.declaration.joint import Limits, MovingJoint
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import ExpressionRow
from multibody_sym.model.resolution.references import References
from multibody_sym.scalars.node import ZERO, Node

FREE: Final = "free"


def stops(references: References) -> Iterator[OneWay]:
    """Yield the stops of all joints: below, then above."""
    for name, joint in references.system.joints.items():
        limits = joint.stops if isinstance(joint, MovingJoint) else None
        if limits is None:
            continue
        coordinate = references.coordinate(name)
        if limits.lower is not None:
            yield _stop(name, "lower", coordinate - limits.lower, limits)
        if limits.upper is not None:
            yield _stop(name, "upper", limits.upper - coordinate, limits)


def _stop(joint: str, side: str, gap: Node, limits: Limits) -> OneWay:
    name = f"{joint}.{side}"
    return OneWay(
        name,
        "stop",
        ("joints", joint),
        (ExpressionRow(name, gap),),
        restitution=limits.restitution or ZERO,
        collides=limits.restitution is not None,
        words=(side, FREE),
        group=joint,
        joint=joint,
    )
