"""Rows and forces that have no value at the start: which, and why."""

from __future__ import annotations

import math
from itertools import pairwise

from multibody_sym.errors import ModelError, at
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.ropes import NoDirectionError
from multibody_sym.kinematics.rows import row_motion
from multibody_sym.model.declaration.contacts import verify_rod_length
from multibody_sym.model.mechanism.loads import Load
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.traversal import leaves


def verify_lengths(motion: Motion) -> None:
    """Raise ModelError naming the first rod or rope whose length is negative, or a rod's zero, wherever bodies are."""
    for k, row in enumerate(motion.mechanism.rows):
        declared = row.declared_length
        if declared is None or any(leaf.data[0] == "q" for leaf in leaves([declared], "slot")):
            continue
        with at(*motion.mechanism.row_path(k)):
            try:
                length = float(motion.state.values([declared])[0])
            except UNDEFINED:
                continue
            if length < 0.0:
                raise ModelError(f"its length is {length:g} m at the start, and no length is negative", number="M109")
            if row.multiplier == "rod":
                verify_rod_length(length)


def verify_values(motion: Motion) -> None:
    """Raise ModelError naming the first row that has no value at a state, and why it has none."""
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    for k, row in enumerate(motion.mechanism.rows):
        with at(*motion.mechanism.row_path(k)):
            _verify_direction(row, motion)
            try:
                found = row_motion(row, motion, bias)
                values = (found.phi or 0.0, found.phidot, found.gamma, *found.jacobian)
                valued = all(math.isfinite(x) for x in values)
            except NoDirectionError:
                raise
            except UNDEFINED:
                valued = False
            if not valued:
                raise ModelError(
                    "it, its rate or its acceleration has no finite value at the start; correct the expression, or "
                    "start from another position (initial: {q: ..})",
                    number="M119",
                )


def verify_direction(motion: Motion, load: Load) -> None:
    """Raise ModelError for a force along the line between points that coincide.

    A spring pulls with k times the way between its ends where it has neither a rest length nor a damper.
    """
    if load.line is None:
        return
    a, b = load.line
    if position(motion, a) == position(motion, b):
        other = ", or the spring neither a length nor damping: it needs no direction then"
        other *= load.spring is not None
        raise ModelError(
            f"{a.name} and {b.name} are at the same place at the start, and what pulls them together has no direction; "
            f"give them different positions (initial: {{q: ..}}){other}",
            number="M119",
        )


def _verify_direction(row: Row, motion: Motion) -> None:
    for a, b in pairwise(row.line):
        if position(motion, a) == position(motion, b):
            same = a.body == b.body
            advice = "join other points" if same else "give them different positions (initial: {q: ..})"
            when = "always" if same else "at the start"
            raise ModelError(
                f"{a.name} and {b.name} are at the same place {when}, and what joins them has no direction; {advice}",
                number="M119",
            )
