"""Accelerations of bodies that move freely in space, sought along their own axes.

The speeds of a free joint are along the parent's axes, so that their partial velocities turn with the body. With
udot = T x, where x is along the body's axes, these are constant: (T^T M T) x = T^T f.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from multibody_sym.kinematics.motion import Motion
from multibody_sym.model.mechanism.mechanism import TreeBody
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import UNIT_MATRIX, Mat, S, apply, apply_transposed


@dataclass(frozen=True)
class BodyAxes:
    """Three `speeds` of a body along directions at right angles, the rows of `directions` in the body's axes."""

    speeds: tuple[int, ...]
    directions: Mat

    def rates(self, x: Sequence[S]) -> list[S]:
        """Return T x."""
        return self._with(x, apply(self.directions, [x[k] for k in self.speeds]))

    def forces(self, right: Sequence[S]) -> list[S]:
        """Return T^T right."""
        return self._with(right, apply_transposed(self.directions, [right[k] for k in self.speeds]))

    def _with(self, x: Sequence[S], values: Sequence[S]) -> list[S]:
        changed = list(x)
        for k, value in zip(self.speeds, values, strict=True):
            changed[k] = value
        return changed


def along_body_axes(motion: Motion) -> tuple[Motion, tuple[BodyAxes, ...]]:
    """Return the motion with partial velocities of free bodies along their own axes, and T of these bodies."""
    bodies, axes = list(motion.bodies), []
    for index, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        if _is_free(body):
            x, y, z, *others = moved.linear
            axes.append(BodyAxes(body.u[:3], (x, y, z)))
            bodies[index] = replace(moved, linear=(*UNIT_MATRIX, *others))
    return replace(motion, bodies=tuple(bodies)), tuple(axes)


def _is_free(body: TreeBody) -> bool:
    """Return whether a body moves along x, y and z, in any order, and then turns."""
    moves, turns = body.steps[:3], body.steps[3:]
    axes = [[abs(x.shadow or 0.0) for x in axis] for step in moves for axis in step.slides]
    return (
        sorted(axes, reverse=True) == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        and not any(step.turns or not step.is_independent for step in moves)
        and not any(step.slides for step in turns)
        and bool(turns)
        and not any(body.given)
    )
