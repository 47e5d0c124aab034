"""A LawProblem with rows and forces of unit length, so that units and masses have no say, as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.dynamics.laws.problem import Equality, FrictionLaw, LawProblem, Unilateral
from multibody_sym.numerics.arrays import Floats

Places = NDArray[np.intp]
Flags = NDArray[np.bool_]

ENOUGH: Final = 1e4
"""The coefficient with which a mode is proposed for friction that is always enough: a foot at less than a thousandth of
a degree beside its normal. What it needs is not judged by it."""


@dataclass(frozen=True)
class Part:
    """A friction part: |z[rows]| <= mu N with N = sum |base z[normals]|, or with `norm` the length of that vector."""

    number: int
    rows: Places
    normals: Places
    base: Floats
    velocity: Floats
    static: float
    kinetic: float
    norm: bool
    enough: bool

    @property
    def rests(self) -> bool:
        return not self.velocity.any()

    @cached_property
    def moving(self) -> Floats:
        """The direction of its velocity, zeros at rest."""
        return self.velocity / (float(np.linalg.norm(self.velocity)) or 1.0)

    @property
    def in_space(self) -> bool:
        return len(self.rows) > 1

    def pressed(self, z: Floats) -> float:
        """Return N."""
        loads = self.base * z[self.normals]
        return float(np.linalg.norm(loads)) if self.norm else float(np.abs(loads).sum())


@dataclass(frozen=True)
class Scaled:
    """a = A x + D z - r, x = C^T z for rows of length one; `lengths` (m) of rows of A and `sizes` (m) of those of C.

    z here is `sizes` times that of the problem, a is its a over `lengths`. `kinematic` equalities restrict motion,
    `defining` ones define their multiplier. `both` are the rows of equalities that are normals: of either sign.
    """

    A: Floats
    C: Floats
    D: Floats
    r: Floats
    lengths: Floats
    sizes: Floats
    unilateral: Places
    kinematic: Places
    defining: Places
    both: Places
    parts: tuple[Part, ...]

    @property
    def count(self) -> int:
        return len(self.r)

    @cached_property
    def two_sided(self) -> Flags:
        """(m): which rows are `both`."""
        flags = np.zeros(self.count, dtype=bool)
        flags[self.both] = True
        return flags

    @cached_property
    def norms(self) -> Floats:
        """Lengths (m) of rows of A, one but for those that are zero."""
        return np.asarray(np.linalg.norm(self.A, axis=1), dtype=float)

    def terms(self, x: Floats, z: Floats) -> Floats:
        """Return (m) how large the terms of which a consists are."""
        return np.asarray(np.abs(self.A) @ np.abs(x) + np.abs(self.D) @ np.abs(z) + np.abs(self.r), dtype=float)


def scaled(problem: LawProblem) -> Scaled:
    """Return the problem with rows and forces of unit length; rows of a part in space share theirs."""
    laws, count = problem.laws, len(problem.laws)
    defines = np.any(problem.coupling != 0.0, axis=1)
    lengths = _lengths(problem.matrix, problem.parts)
    sizes = _lengths(problem.exerted, problem.parts)
    for part in problem.parts:
        own = [k for k in part.normals if isinstance(laws[k], Equality) and not problem.exerted[k].any()]
        sizes[own] = sizes[part.rows[0]]
    diagonal = np.abs(problem.coupling.diagonal()) / sizes
    lengths = np.where(defines & (diagonal > 0.0), np.maximum(diagonal, 0.0), lengths)
    equal = np.array([isinstance(law, Equality) for law in laws], dtype=bool).reshape(count)
    normal = np.zeros(count, dtype=bool)
    for part in problem.parts:
        normal[list(part.normals)] = True
    return Scaled(
        problem.matrix / lengths[:, None],
        problem.exerted / sizes[:, None],
        problem.coupling / np.outer(lengths, sizes),
        problem.right / lengths,
        lengths,
        sizes,
        np.flatnonzero([isinstance(law, Unilateral) for law in laws]),
        np.flatnonzero(equal & ~defines),
        np.flatnonzero(equal & defines),
        np.flatnonzero(equal & normal),
        tuple(_part(number, part, sizes) for number, part in enumerate(problem.parts)),
    )


def _lengths(rows: Floats, parts: Sequence[FrictionLaw]) -> Floats:
    """Return the lengths of rows, 1 where they are zero, the larger one for both rows of a part in space."""
    lengths = np.asarray(np.linalg.norm(rows, axis=1), dtype=float)
    lengths[lengths == 0.0] = 1.0
    for part in parts:
        lengths[list(part.rows)] = lengths[list(part.rows)].max()
    return lengths


def _part(number: int, part: FrictionLaw, sizes: Floats) -> Part:
    rows, normals = np.array(part.rows, dtype=np.intp), np.array(part.normals, dtype=np.intp)
    velocity = np.array([*part.velocity, *[0.0] * (len(rows) - len(part.velocity))], dtype=float)
    base, numbers = sizes[rows[0]] / sizes[normals], (part.static, part.kinetic)
    if part.enough:
        numbers = (ENOUGH, ENOUGH)
    return Part(number, rows, normals, base, velocity, *numbers, part.norm, part.enough)


@dataclass(frozen=True)
class Modes:
    """A mode in arrays: `sides` (m), `slips` (p), `directions` (p, 2), zeros where there is none."""

    sides: Places
    slips: Places
    directions: Floats

    def copy(self) -> Modes:
        return Modes(self.sides.copy(), self.slips.copy(), self.directions.copy())

    def touching(self, part: Part, both: Flags) -> bool:
        """Return whether anything presses the part: a closed contact, or a joint's reaction (`both`, m)."""
        return bool((both[part.normals] | (self.sides[part.normals] > 0)).any())
