"""The problem that an impact poses, its result, and its progress on the way.

For m rows over n weighted coordinates (M = G^T G, x = G (u+ - u-), A = H G^-1) an impact obeys the laws of an instant
(`contact_laws.problem`) with speeds in place of accelerations:

    v+ = A x + D z - r        x = C^T z        r = -v-

z (m) are impulses: of what holds both ways, normal ones, friction. v- (m) are the speeds before: of a unilateral row
that at which it opens (it closes where that is negative), of a part's rows v_t, of a row that holds both ways its speed
beside the wanted one: zero where it held before, that with which it is caught where it begins, minus the jump of a
prescribed speed. Given impulses have acted: r = -v- after them.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np

from multibody_sym.contact_laws.enumeration import MOST
from multibody_sym.contact_laws.problem import STICKS, LawProblem, Places, Unilateral, scaled, select
from multibody_sym.contact_laws.solve_mode import eliminate_equalities
from multibody_sym.errors import NoSolutionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.pivoted_qr import pivoted_qr
from multibody_sym.scalars.rank import DRAWN, ROUNDED, idle, rank, scaled_rows

ImpactLaw = Literal["newton", "poisson", "stronge"]
"""What a coefficient of restitution is: a ratio of speeds, of impulses, or its square one of works."""
Order = Literal["simultaneous", "one_by_one"]

CLOSING: Final = 1e-9
"""The part of the largest speed up to which rows that touch do not close: speeds for rows of unit length in A."""
ARITHMETIC: Final = 1e-5
"""Rounding of the speeds of bodies, as a part of the speeds up to which rows do not close."""
AFRESH: Final = 50
"""After so many impulses of single contacts speeds are computed afresh from x: their sum has as many roundings."""


@dataclass(frozen=True)
class ImpactProblem:
    """What strikes: rows at the level of speeds, their restitution, and by which law.

    `rows`: A, C, D, right = -v- and laws. Friction parts need no velocity: `right` has it. `restitution` (m) is e of
    unilateral rows, 0 for all others; `tangential` (one a friction part, or none at all) how much of the friction
    impulse is given back. `allowed` (m) are closing speeds up to which rows touch without closing, by default `CLOSING`
    of the largest. `speeds` (n) are G u-, without which the work of rows that exert another force than their own is not
    known. `pushed` (m, or none) is what given impulses have added to v-: what holds both ways acts while they do, and
    its work counts from the speeds before them. `names` (m, or none) are what notes and errors call the rows. At most
    `most` modes are tried where none fits near what sweeps come to.
    """

    rows: LawProblem
    restitution: Floats
    tangential: tuple[float, ...] = ()
    law: ImpactLaw = "newton"
    sequence: Order = "simultaneous"
    allowed: Floats | None = None
    speeds: Floats | None = None
    names: tuple[str, ...] = ()
    pushed: Floats | None = None
    most: int = MOST

    def name(self, row: int) -> str:
        """Return what a row is called."""
        return self.names[row] if self.names else f"row {row}"

    @cached_property
    def gives_back(self) -> bool:
        """Whether friction is given back anywhere."""
        return any(self.tangential)

    def given_back(self, part: int) -> float:
        """Return the tangential restitution of a friction part."""
        return self.tangential[part] if self.tangential else 0.0


Stage = Literal["joined", "compression", "restitution", "at once", "given back"]


@dataclass(frozen=True)
class ImpactPhase:
    """A stretch of an impact in which nothing changes its mode.

    `stage`: what holds both ways is `joined` first; the normal speeds fall (`compression`) and rise (`restitution`),
    or both `at once`; friction is `given back` last. `rows` are the unilateral rows that are struck, `slips` (by part)
    0 for what sticks or takes no part, 1 or -1 the sign of v_t, 2 in space; of `count` rows z of those at `places` grew
    by `added`. Several impacts one after the other are counted by `number`.
    """

    stage: Stage
    rows: tuple[int, ...]
    slips: tuple[int, ...]
    places: Places
    added: Sequence[float] | Floats
    count: int
    number: int = 0

    @cached_property
    def impulses(self) -> Floats:
        """What the phase adds to z (m)."""
        z = np.zeros(self.count)
        z[self.places] = self.added
        return z


@dataclass(frozen=True)
class ImpactResult:
    """What an impact does.

    `x` (n) is the weighted jump of speeds, `impulses` (m) and those `compression` (m) had of them, `before` and `after`
    (m) the speeds of the rows, `lost` (m, J) what each row took of the energy: minus the work of its impulse on the way
    (of a drive: beside its new speed; of rows that exert another force than their own, without `speeds`: nan). A sum
    below zero is a gain, which Newton's law with friction may have. `closed` are the unilateral rows that took part,
    `restitution` (m) the e that was used. `phases` tell the course (none: nothing strikes), `impacts` how many there
    were. `not_unique` are rows whose impulses may have other values beside the same x. `collapsed`: there were too many
    impacts, and the last one struck all at once without bouncing. `notes` say what was decided otherwise than asked.
    """

    x: Floats
    impulses: Floats
    compression: Floats
    before: Floats
    after: Floats
    lost: Floats
    closed: tuple[int, ...]
    restitution: Floats
    phases: tuple[ImpactPhase, ...]
    impacts: int
    not_unique: tuple[int, ...] = ()
    collapsed: bool = False
    notes: tuple[str, ...] = ()

    @property
    def energy_lost(self) -> float:
        """The kinetic energy (J) that the impact takes."""
        return float(self.lost.sum())

    @property
    def gained(self) -> float:
        """The kinetic energy (J) that the impact makes, beyond rounding: 0 but for Newton's law with friction."""
        made = -self.energy_lost
        return made if made > GAIN * float(abs(self.lost).sum() + (self.x @ self.x) / 2.0) else 0.0

    def course(self, part: int) -> tuple[int, ...]:
        """Return how a friction part slips on the way, phase by phase, each once: (-1, 0, 1) is a reversed slip."""
        slips = [phase.slips[part] for phase in self.phases if phase.stage not in ("joined", "given back")]
        return tuple(slip for k, slip in enumerate(slips) if not k or slips[k - 1] != slip)


GAIN: Final = 1e-12
"""Energy that an impact makes counts above this part of the energies that it moves."""


# ----------------------------------------------------------------------------------------------------------------------
# What has become of the rows so far: impulses, speeds, energy, and the phases they come from; and which rows act.


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
        found = [STICKS] * len(rows.parts)
        for k, slip in zip(self.parts, slips, strict=True):
            found[k] = slip
        return tuple(found)


def select_rows(problem: LawProblem, closed: Collection[int]) -> Chosen:
    """Return the problem of what always acts, constraints and friction in joints, and of some unilateral rows.

    Parts that are smooth are left out.
    """
    acting = {*problem.equalities, *map(int, closed)}
    rough = {k for row in acting for k in problem.rough_parts.get(row, ())}
    parts = sorted(k for k in rough if acting.issuperset(problem.parts[k].normals))
    rows = sorted(acting | {row for k in parts for row in problem.parts[k].rows})
    alone = select(problem, rows, parts)
    at_rest = (replace(part, velocity=(0.0,) * len(part.rows), held=part.enough) for part in alone.parts)
    return Chosen(rows, parts, replace(alone, parts=tuple(at_rest)))


@dataclass(eq=False)
class ImpactProgress:
    """An impact on its way: x (n), z (m), the speeds v (m), what compression had of z, and the energy that rows took.

    Speeds of `unilateral` rows below `allowed` (m) do not close; `rounding` (m) is what arithmetic leaves of speeds.
    `nothing`: what was searched where no impulses were found at last, and whether that proves that there are none.
    """

    problem: ImpactProblem
    x: Floats
    z: Floats
    v: Floats
    compression: Floats
    lost: Floats
    restitution: Floats
    allowed: Floats
    rounding: Floats
    unilateral: Places
    phases: list[ImpactPhase] = field(default_factory=list)
    impacts: int = 0
    struck: set[int] = field(default_factory=set)
    unsure: set[int] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    collapsed: bool = False
    nothing: tuple[str, bool] = ("", False)
    _pushes: int = 0

    @property
    def rows(self) -> LawProblem:
        return self.problem.rows

    def closing(self) -> Places:
        """Return the unilateral rows that close now."""
        return self.unilateral[self.v[self.unilateral] < self._floor]

    @cached_property
    def _floor(self) -> Floats:
        """The speeds of unilateral rows below which they close."""
        return -self.allowed[self.unilateral]

    def still(self) -> Places:
        """Return the unilateral rows that do not bounce."""
        found: Places = self.unilateral[self.restitution[self.unilateral] == 0.0]
        return found

    def unfulfilled(self) -> bool:
        """Return whether what holds both ways has another speed than the wanted one."""
        both = self.rows.equalities
        return bool((np.abs(self.v[both]) > self.allowed[both]).any())

    def not_separating(self) -> Places:
        """Return the unilateral rows that close now, or touch without separating."""
        return self.unilateral[self.v[self.unilateral] <= self.allowed[self.unilateral]]

    def note(self, text: str) -> None:
        """Add a note once."""
        if text not in self.notes:
            self.notes.append(text)

    def copy(self) -> ImpactProgress:
        """Return a copy to come back to."""
        kept = replace(self)
        kept.x, kept.z, kept.v, kept.compression = (each.copy() for each in (self.x, self.z, self.v, self.compression))
        kept.restitution, kept.lost = self.restitution.copy(), self.lost.copy()
        kept.phases, kept.notes = list(self.phases), list(self.notes)
        kept.struck, kept.unsure = set(self.struck), set(self.unsure)
        return kept

    def back_to(self, kept: ImpactProgress) -> None:
        """Go back to a copy."""
        self.__dict__.update(kept.copy().__dict__)

    def gains_since(self, kept: ImpactProgress) -> bool:
        """Return whether energy has grown since a copy, beyond rounding of the energies that the impact moves."""
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
        x, before, moved = impulses[1], self.v, np.abs(impulses[0]) * self._sizes
        z = np.where((self._sizes > 0.0) & (moved <= ROUNDED * moved.max(initial=0.0)), 0.0, impulses[0])
        self.v = speeds(self.rows, self.x + x, self.z + z)
        self.lost += self._taken(z, x, before, stage) if lost is None else lost
        self.x = self.x + x
        self._note(stage, tuple(sorted(rows)), slips, np.arange(len(z)), z)
        return z

    def push(self, push: Push, row: int, phases: Sequence[PushPhase], lost: Sequence[float]) -> None:
        """Add phases of impulses at a row, which is struck, and its tangents; `lost` (k) is what these rows took."""
        total = np.zeros(len(push.own))
        for stage, slips, f in phases:
            total += f
            self._note(stage, (row,), slips, push.rows, push.impulses(f))
        self.x[push.columns] += push.X @ total
        self.v[push.moved] += push.V @ total
        self.lost[push.own] += lost
        self._pushes += 1
        if self._pushes % AFRESH == 0:
            self.v = speeds(self.rows, self.x, self.z)

    def _note(
        self,
        stage: Stage,
        rows: tuple[int, ...],
        slips: tuple[int, ...],
        places: Places,
        added: Sequence[float] | Floats,
    ) -> None:
        self.z[places] += added
        self.struck.update(rows)
        self.phases.append(ImpactPhase(stage, rows, slips, places, added, len(self.z), self.impacts))
        if stage == "compression":
            self.compression[places] += added

    def _taken(self, z: Floats, x: Floats, before: Floats, stage: Stage) -> Floats:
        """Return the energy (m) that rows take while impulses grow in proportion from before to now: minus their work.

        What is joined first does so together with given impulses.
        """
        pushed = self.problem.pushed if stage == "joined" and not self.phases else None
        taken = -z * (before - (0.0 if pushed is None else pushed) + self.v) / 2.0
        others = self._others
        if len(others):
            exerted, w = self.rows.exerted[others], self.problem.speeds
            moving = np.full(len(others), np.nan) if w is None else exerted @ (w + self.x + x / 2.0)
            taken[others] = -z[others] * moving
        return np.where(self._sizes > 0.0, taken, 0.0)

    @cached_property
    def pushes_back(self) -> bool:
        """Whether all rows exert their own force, and none defines a multiplier."""
        return not (self.rows.couples or self._others)

    @cached_property
    def _sizes(self) -> Floats:
        """How much each row (m) exerts."""
        return np.asarray(np.linalg.norm(self.rows.exerted, axis=1), dtype=float)

    @cached_property
    def _others(self) -> list[int]:
        """The rows that exert another force than their own."""
        return np.flatnonzero(np.any(self.rows.exerted != self.rows.matrix, axis=1)).tolist()

    def result(self) -> ImpactResult:
        """Return the impact as it is now."""
        return ImpactResult(
            self.x,
            self.z,
            self.compression,
            -self.rows.right,
            speeds(self.rows, self.x, self.z),
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


def start_impact(problem: ImpactProblem) -> ImpactProgress:
    """Return the account of an impact in which nothing has happened yet."""
    rows = problem.rows
    count, size = rows.matrix.shape
    unilateral = np.array([k for k, law in enumerate(rows.laws) if isinstance(law, Unilateral)], dtype=np.intp)
    lengths = scaled_rows(rows.matrix)[0]
    defines = rows.coupling.any(axis=1)
    largest = float(np.abs(rows.right / lengths)[~defines].max(initial=0.0))
    pressing = float(np.abs(rows.right)[defines].max(initial=0.0))
    usual = CLOSING * np.where(defines, pressing, largest * lengths)
    allowed = usual if problem.allowed is None else np.asarray(problem.allowed, dtype=float)
    zeros, e = np.zeros(count), np.array(problem.restitution, dtype=float)
    rounding = np.maximum(ROUNDED * largest * lengths, ARITHMETIC * allowed)
    x = np.zeros(size)
    v = speeds(rows, x, zeros)
    return ImpactProgress(problem, x, zeros, v, zeros.copy(), zeros.copy(), e, allowed, rounding, unilateral)


# ----------------------------------------------------------------------------------------------------------------------
# What impulses at one contact do when all that holds both ways follows them: projected columns, not M's inverse.
#
# With A_E^T = Q R of the rows that hold both ways the columns of the contact are B = (E - Q Q^T) C^T, its speeds
# change by K = B^T B, and 1/K_nn is its apparent mass. Rows of Q R that depend on others take no impulse.


@dataclass(frozen=True)
class ImpulseResponse:
    """x = X f, z = Z f and v = K f for impulses f (k) at the rows `own` of a problem of m rows: normal, tangents."""

    own: list[int]
    X: Floats
    Z: Floats
    K: Floats


@dataclass(frozen=True)
class Push:
    """What impulses f (k) at rows `own` change in all: z of `rows` by Z f, x at `columns` by X f, v of `moved` by V f.

    `sizes` is how much each of the `rows` exerts. `alone`: no other row takes an impulse.
    """

    own: Places
    rows: Places
    columns: Places
    moved: Places
    Z: Floats
    X: Floats
    V: Floats
    sizes: list[float]
    alone: bool

    def impulses(self, f: Sequence[float]) -> list[float]:
        """Return those of the `rows`: none where the effect is a rounding of that of the largest one."""
        z: list[float] = list(f) if self.alone else (self.Z @ f).tolist()
        moved = [abs(x) * size for x, size in zip(z, self.sizes, strict=True)]
        least = ROUNDED * max(moved)
        return [x if effect > least else 0.0 for x, effect in zip(z, moved, strict=True)]

    @staticmethod
    def of(problem: LawProblem, some: Chosen, response: ImpulseResponse) -> Push:
        """Return what the impulses of a response of some rows change, none of which defines a multiplier."""
        takes, columns = np.flatnonzero(response.Z.any(axis=1)), np.flatnonzero(response.X.any(axis=1))
        every, X = np.array(some.rows), response.X[columns]
        V = problem.matrix[:, columns] @ X
        moved = np.flatnonzero(V.any(axis=1))
        sizes: list[float] = np.linalg.norm(some.problem.exerted[takes], axis=1).tolist()
        alone = takes.tolist() == response.own
        return Push(every[response.own], every[takes], columns, moved, response.Z[takes], X, V[moved], sizes, alone)


PushPhase = tuple[Stage, tuple[int, ...], Sequence[float]]
"""A stage, the slips of all parts, and the impulses (k)."""


def impulse_response(some: Chosen, own: list[int]) -> ImpulseResponse:
    """Return what impulses at some rows of a chosen problem do; no other row that holds one way has any.

    Each row of friction is to be among them, as nothing that rubs follows.
    """
    problem, equal = some.problem, some.problem.equalities
    if problem.couples or not np.array_equal(problem.exerted[equal], problem.matrix[equal]):
        system = scaled(replace(problem, right=np.zeros(len(problem.right))))
        small = eliminate_equalities(system)
        sizes, place = system.sizes[small.own], small.place[own]
        K = system.lengths[own, None] * (small.K[own] * sizes)
        X, Z = (small.X * sizes)[:, place], (small.Z * sizes / system.sizes[:, None])[:, place]
        return ImpulseResponse(own, X, Z, K[:, place])
    lengths, unit = scaled_rows(problem.matrix[equal]) if equal else (np.zeros(0), problem.matrix[equal])
    pushes = problem.exerted[own].T
    Z = np.zeros((len(problem.laws), len(own)))
    Z[own, np.arange(len(own))] = 1.0
    X = pushes.copy()
    if equal:
        Q, R, order, rank = pivoted_qr(unit.T, least=1.0)
        Q, kept = Q[:, :rank], order[:rank]
        for _ in range(2):  # what is left of a column is at right angles to Q only after a second pass
            X -= Q @ (Q.T @ X)
        Z[np.array(equal)[kept]] = -np.linalg.solve(R[:rank, :rank], Q.T @ pushes) / lengths[kept, None]
    alike = np.array_equal(problem.exerted[own], problem.matrix[own])
    return ImpulseResponse(own, X, Z, X.T @ X if alike else problem.matrix[own] @ X)


def verify_moves(some: Chosen, row: int, name: str) -> None:
    """Raise NoImpulsesError where constraints and prescribed motions alone determine the speed of a unilateral row.

    Its row is then a combination of theirs. Rows that define an impulse determine no speed.
    """
    problem = some.problem
    defining = np.abs(problem.coupling).sum(axis=1) > 0.0
    kept = [k for k in problem.equalities if not defining[k]]
    if not kept and problem.matrix[row].any():
        return
    rows = scaled_rows(problem.matrix[[*kept, row]])[1]  # what is rounding beside the row that is struck holds nothing
    if rank(rows, ROUNDED) > rank(rows[:-1], ROUNDED):
        return
    message = (
        f"{name} closes, but constraints and prescribed motions alone determine its speed: no impulse stops it "
        "(end the run before, or let a force drive what a motion drives)"
    )
    raise NoImpulsesError(message, number="N108")


def dependent_rows(problem: LawProblem) -> list[int]:
    """Return the rows that hold both ways and have a part in a combination of them that exerts nothing."""
    equal = [k for k in problem.equalities if problem.exerted[k].any()]
    unit = scaled_rows(problem.exerted[equal])[1]
    if not equal or (count := pivoted_qr(unit.T, least=1.0).rank) == len(equal):
        return []
    shares = np.abs(idle(unit, count)).max(axis=0)
    return [k for k, share in zip(equal, shares, strict=True) if share > DRAWN]
