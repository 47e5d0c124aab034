"""What friction in joints leaves out, told where it is there: couples that pads would bear, forces along an axis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.answers.instant import Solved
from multibody_sym.model.mechanism.force_rows import ReactionRow
from multibody_sym.model.mechanism.mass import ORIGIN
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.scalars.node import ONE

_ROUNDING: Final = 1e-9
_APART: Final = "give the length over which its pads or bearings are apart"


def left_out(solved: Solved) -> tuple[str, ...]:
    """Return what the reactions of joints that rub hold beside what their friction is made of, in numbers."""
    rubbing = [element for element in solved.mechanism.one_way if element.kind == "friction"]
    return tuple(note for element in rubbing for note in _notes(solved, element))


def _notes(solved: Solved, element: OneWay) -> Iterator[str]:
    normals = [row for row in element.normals if isinstance(row, ReactionRow)]
    body = next(body for body in solved.mechanism.bodies if body.joint_name == element.joint)
    turns, slides = any(step.turns for step in body.steps), any(step.slides for step in body.steps)
    if not all(row.share is ONE for row in normals):
        return  # on a thread force and couple go together
    axis = next(axis for step in body.steps for axis in (*step.slides, *step.turns))
    along = np.array(solved.numbers.motion.state.values(axis), dtype=float)
    along /= np.linalg.norm(along)
    reaction = solved.numbers.reactions[element.joint]
    force, moment = np.array([reaction[c] for c in COMPONENTS], dtype=float).reshape(2, 3)
    size = float(np.abs(force).sum() + np.abs(moment).sum())
    couple = float(np.linalg.norm(moment - (moment @ along) * along if turns else moment))
    if couple > _ROUNDING * size and all(row.moment is ORIGIN for row in normals):
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m there is left out ({_APART})"
    push = abs(float(force @ along))
    if turns and not slides and push > _ROUNDING * size:
        yield f"{element.name} rubs with the force across its axis; {push:.6g} N along the axis are left out"
