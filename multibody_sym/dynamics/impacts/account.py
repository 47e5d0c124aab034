"""What has become of the rows so far: impulses, speeds, energy, and the phases they come from; and which rows act."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from multibody_sym.dynamics.impacts.problem import ARITHMETIC, CLOSING, GAIN, ImpactProblem, Phase, Stage, Struck
from multibody_sym.dynamics.laws.problem import STICKS, Equality, Friction, LawProblem, Unilateral
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import ROUNDED, scaled_rows
from multibody_sym.records import dataclass


class NoImpulsesError(NoSolutionError):
    """It is proved that no impulses fulfil the laws of an impact: a motion that comes there ends."""


@dataclass(frozen=True)
class Chosen:
    """Some `rows` and `parts` of a problem as a problem of their own: numbers of rows and of parts in the whole."""

    rows: list[int]
    parts: list[int]
    problem: LawProblem

    def of_all(self, slips: tuple[int, ...], rows: LawProblem) -> tuple[int, ...]:
        """Return the slips of its parts as those of all parts; what takes no part counts as sticking."""
        whole = dict(zip(self.parts, slips, strict=True))
        return tuple(whole.get(k, STICKS) for k in range(len(rows.parts)))


def chosen(problem: LawProblem, closed: Collection[int]) -> Chosen:
    """Return the problem of what always acts, constraints and friction in joints, and of some unilateral rows.

    Parts that are smooth are left out.
    """
    acting = {k for k, law in enumerate(problem.laws) if isinstance(law, Equality)} | set(closed)
    rough = [k for k, part in enumerate(problem.parts) if part.enough or part.static or part.kinetic]
    parts = [k for k in rough if acting.issuperset(problem.parts[k].normals)]
    rows = sorted(acting | {row for k in parts for row in problem.parts[k].rows})
    place = {row: k for k, row in enumerate(rows)}
    number = {part: k for k, part in enumerate(parts)}
    laws = [problem.laws[k] for k in rows]
    frictions = (problem.parts[k] for k in parts)
    return Chosen(
        rows,
        parts,
        LawProblem(
            problem.matrix[rows],
            problem.exerted[rows],
            problem.coupling[np.ix_(rows, rows)],
            problem.right[rows],
            tuple(replace(law, part=number[law.part]) if isinstance(law, Friction) else law for law in laws),
            tuple(
                replace(
                    part,
                    rows=tuple(place[k] for k in part.rows),
                    normals=tuple(place[k] for k in part.normals),
                    velocity=(0.0,) * len(part.rows),
                    held=part.enough,
                )
                for part in frictions
            ),
        ),
    )


@dataclass(eq=False)
class Account:
    """An impact on its way: x (n), z (m), what compression had of z, and the energy that each row took.

    Speeds of `unilateral` rows below `allowed` (m) do not close; `rounding` (m) is what arithmetic leaves of speeds.
    `nothing`: what was searched where no impulses were found at last, and whether that proves that there are none.
    """

    problem: ImpactProblem
    x: Floats
    z: Floats
    compression: Floats
    lost: Floats
    restitution: Floats
    allowed: Floats
    rounding: Floats
    unilateral: tuple[int, ...]
    phases: list[Phase] = field(default_factory=list)
    impacts: int = 0
    struck: set[int] = field(default_factory=set)
    unsure: set[int] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    collapsed: bool = False
    nothing: tuple[str, bool] = ("", False)

    @property
    def rows(self) -> LawProblem:
        return self.problem.rows

    def speeds(self) -> Floats:
        """Return the present speeds (m) of the rows."""
        return speeds(self.rows, self.x, self.z)

    def closing(self) -> list[int]:
        """Return the unilateral rows that close now."""
        v = self.speeds()
        return [k for k in self.unilateral if v[k] < -self.allowed[k]]

    def unfulfilled(self) -> bool:
        """Return whether what holds both ways has another speed than the wanted one."""
        v = self.speeds()
        return any(isinstance(law, Equality) and abs(v[k]) > self.allowed[k] for k, law in enumerate(self.rows.laws))

    def not_separating(self) -> list[int]:
        """Return the unilateral rows that close now, or touch without separating."""
        v = self.speeds()
        return [k for k in self.unilateral if v[k] <= self.allowed[k]]

    def note(self, text: str) -> None:
        """Tell something once."""
        if text not in self.notes:
            self.notes.append(text)

    def copy(self) -> Account:
        """Return the account as it is now, to come back to."""
        kept = replace(self)
        kept.restitution, kept.lost = self.restitution.copy(), self.lost.copy()
        kept.phases, kept.notes = list(self.phases), list(self.notes)
        kept.struck, kept.unsure = set(self.struck), set(self.unsure)
        return kept

    def back_to(self, kept: Account) -> None:
        """Take everything back to what was kept."""
        self.__dict__.update(kept.copy().__dict__)

    def gains_since(self, kept: Account) -> bool:
        """Return whether there is more energy than at a kept account, beyond rounding of what the impact moves."""
        moved = float(np.abs(self.lost).sum() + self.x @ self.x / 2.0)
        return float((self.lost - kept.lost).sum()) < -GAIN * moved

    def add(
        self,
        stage: Stage,
        rows: Collection[int],
        slips: tuple[int, ...],
        impulses: tuple[Floats, Floats],
        lost: Floats | None = None,
    ) -> Floats:
        """Add the impulses dz (m), dx (n) of a phase, and return dz; without `lost` (m) they grow in proportion.

        An impulse is none where its effect is a rounding of that of the largest one.
        """
        x, moved = impulses[1], np.abs(impulses[0]) * self._sizes
        z = np.where((self._sizes > 0.0) & (moved <= ROUNDED * moved.max(initial=0.0)), 0.0, impulses[0])
        self.lost += self._taken(z, x, stage) if lost is None else lost
        self.x, self.z = self.x + x, self.z + z
        self.struck |= set(rows)
        self.phases.append(Phase(stage, tuple(sorted(rows)), slips, z, self.impacts))
        if stage == "compression":
            self.compression = self.compression + z
        return z

    def _taken(self, z: Floats, x: Floats, stage: Stage) -> Floats:
        """Return the energy (m) that rows take while impulses grow in proportion: minus the work of each.

        What is joined first does so together with given impulses.
        """
        pushed = self.problem.pushed if stage == "joined" and not self.phases else None
        before = self.speeds() - (0.0 if pushed is None else pushed)
        after = speeds(self.rows, self.x + x, self.z + z)
        taken = -z * (before + after) / 2.0
        others = self._others
        if len(others):
            exerted, w = self.rows.exerted[others], self.problem.speeds
            moving = np.full(len(others), np.nan) if w is None else exerted @ (w + self.x + x / 2.0)
            taken[others] = -z[others] * moving
        return np.where(self._sizes > 0.0, taken, 0.0)

    @cached_property
    def _sizes(self) -> Floats:
        """How much each row (m) exerts."""
        return np.asarray(np.linalg.norm(self.rows.exerted, axis=1), dtype=float)

    @cached_property
    def _others(self) -> list[int]:
        """The rows that exert another force than their own."""
        return np.flatnonzero(np.any(self.rows.exerted != self.rows.matrix, axis=1)).tolist()

    def told(self) -> Struck:
        """Return what has happened."""
        return Struck(
            self.x,
            self.z,
            self.compression,
            -self.rows.right,
            self.speeds(),
            self.lost,
            tuple(sorted(self.struck)),
            self.restitution,
            tuple(self.phases),
            self.impacts,
            tuple(sorted(self.unsure)),
            self.collapsed,
            tuple(self.notes),
        )


def speeds(rows: LawProblem, x: Floats, z: Floats) -> Floats:
    """Return (m) the speeds of rows after a jump and impulses."""
    return np.asarray(rows.matrix @ x + rows.coupling @ z - rows.right, dtype=float)


def begun(problem: ImpactProblem) -> Account:
    """Return the account of an impact in which nothing has happened yet."""
    rows = problem.rows
    count, size = rows.matrix.shape
    unilateral = tuple(k for k, law in enumerate(rows.laws) if isinstance(law, Unilateral))
    lengths = scaled_rows(rows.matrix)[0]
    defines = rows.coupling.any(axis=1)
    largest = float(np.abs(rows.right / lengths)[~defines].max(initial=0.0))
    pressing = float(np.abs(rows.right)[defines].max(initial=0.0))
    usual = CLOSING * np.where(defines, pressing, largest * lengths)
    allowed = usual if problem.allowed is None else np.asarray(problem.allowed, dtype=float)
    zeros, e = np.zeros(count), np.array(problem.restitution, dtype=float)
    rounding = np.maximum(ROUNDED * largest * lengths, ARITHMETIC * allowed)
    return Account(problem, np.zeros(size), zeros, zeros, zeros.copy(), e, allowed, rounding, unilateral)
