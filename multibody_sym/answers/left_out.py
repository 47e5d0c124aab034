"""What is left out, told where it is there: impacts, couples that pads of joints would bear, forces along an axis."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from multibody_sym.answers.instant import Solved
from multibody_sym.dynamics.programs.one_way_forces import is_active
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.force_rows import BrakingRow, ReactionRow
from multibody_sym.model.mechanism.mass import ORIGIN
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.scalars.node import ONE

_ROUNDING: Final = 1e-9
_LEFT: Final = ".left"
_RIGHT: Final = ".right"
_APART: Final = "give the length over which its pads or bearings are apart"


def left_out(solved: Solved) -> tuple[str, ...]:
    """Return what strikes at the start, and what reactions of joints that rub hold beside what their friction is of."""
    rubbing = [element for element in solved.mechanism.one_way if element.kind == "friction"]
    struck = [solved.decided.strikes] if solved.decided.strikes else []
    return (*struck, *_clamped(solved), *(note for element in rubbing for note in _notes(solved, element)))


def _clamped(solved: Solved) -> Iterator[str]:
    """Yield what touches both sides of a thin bar in a plane model, as a slot without play would."""
    acting = {x.name for x in solved.mechanism.one_way if x.unilateral and is_active(solved.mechanism, x)}
    for left in sorted(name for name in acting if name.endswith(_LEFT)):
        if (right := left.removesuffix(_LEFT) + _RIGHT) in acting:
            yield (
                f"{left} and {right} press at once, the two sides of a thin bar, as a slot without play does: give its "
                "segment the normal of the side that is touched, if that is one only"
            )


def _notes(solved: Solved, element: OneWay) -> Iterator[str]:
    normals = [row for row in element.normals if isinstance(row, ReactionRow)]
    body = next(body for body in solved.mechanism.bodies if body.joint_name == element.joint)
    turns, slides = any(step.turns for step in body.steps), any(step.slides for step in body.steps)
    if not all(row.share is ONE for row in normals) or sum(len(step.turns) for step in body.steps) == 3:
        return  # on a thread force and couple go together, a ball bears forces only
    held = _Held(solved, element.joint)
    if len(element.frictions) > 1 and all(row.moment is ORIGIN for row in normals):
        yield from _of_pins(held, element)
        return
    if sum(bool(step.slides) for step in body.steps) > 1:
        yield from _of_plate(held, element, normals[0], turns=turns)
        return
    axis = next(axis for step in body.steps for axis in (*step.slides, *step.turns))
    along = held.unit(axis)
    couple = float(np.linalg.norm(held.moment - (held.moment @ along) * along if turns else held.moment))
    if couple > _ROUNDING * held.size and all(row.moment is ORIGIN for row in normals):
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m there is left out ({_APART})"
    push = abs(float(held.force @ along))
    if turns and not slides and push > _ROUNDING * held.size:
        yield f"{element.name} rubs with the force across its axis; {push:.6g} N along the axis are left out"


class _Held:
    """What a joint holds: force and moment on its child, about its point there, in the frame on its parent."""

    def __init__(self, solved: Solved, joint: str) -> None:
        self._state = solved.numbers.motion.state
        reaction = solved.numbers.reactions[joint]
        self.force, self.moment = np.array([reaction[c] for c in COMPONENTS], dtype=float).reshape(2, 3)
        self.size = float(np.abs(self.force).sum() + np.abs(self.moment).sum())

    def unit(self, axis: Point) -> Floats:
        """Return the unit vector along an axis."""
        along = np.array(self._state.values(axis), dtype=float)
        return np.asarray(along / np.linalg.norm(along), dtype=float)


def _of_plate(held: _Held, element: OneWay, row: ReactionRow, *, turns: bool) -> Iterator[str]:
    """Yield the couple that moves the normal force away from the joint's point."""
    normal = held.unit(row.force)
    couple = float(np.linalg.norm(held.moment - (held.moment @ normal) * normal))
    if couple > _ROUNDING * held.size:
        pressing = abs(float(held.force @ normal))
        where = f", which moves that force {couple / pressing:.6g} m aside," if pressing > _ROUNDING * held.size else ""
        yield (
            f"{element.name} rubs with the force along its normal alone; the couple of {couple:.6g} N*m there{where} "
            "is left out"
        )
    twist = abs(float(held.moment @ normal))
    if not turns and twist > _ROUNDING * held.size:
        yield f"{element.name} rubs with its force alone; the couple of {twist:.6g} N*m about its normal is left out"


def _of_pins(held: _Held, element: OneWay) -> Iterator[str]:
    """Yield the couple that pins and guides one on the other transmit, and the forces along the pins."""
    pins: dict[str, Floats] = {}
    for part in element.frictions:
        rows = element.normals_of(part)
        first, second = (held.unit(row.force) for row in rows if isinstance(row, ReactionRow)) if part.norm else (0, 0)
        if isinstance(part.rows[0], BrakingRow):
            pins[part.name] = np.cross(first, second)
    axes = np.array(list(pins.values())).reshape(-1, 3).T
    free = axes @ least_squares(axes, held.moment) if pins else np.zeros(3)
    couple = float(np.linalg.norm(held.moment - free))
    if couple > _ROUNDING * held.size:
        yield f"{element.name} rubs with its force alone; the couple of {couple:.6g} N*m that it transmits is left out"
    for name, pin in pins.items():
        push = abs(float(held.force @ pin))
        if push > _ROUNDING * held.size:
            yield f"{name} rubs with the force across it; {push:.6g} N along the pin are left out"
