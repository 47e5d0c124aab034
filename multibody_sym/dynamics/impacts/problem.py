"""The problem that an impact poses, and what became of it: records only.

For m rows over n weighted coordinates (M = G^T G, x = G (u+ - u-), A = H G^-1) an impact obeys the laws of an instant
(`laws.problem`) with speeds in place of accelerations:

    v+ = A x + D z - r        x = C^T z        r = -v-

z (m) are impulses: of what holds both ways, normal ones, friction. v- (m) are the speeds before: of a unilateral row
that at which it opens (it closes where that is negative), of a part's rows v_t, of a row that holds both ways its speed
beside the wanted one: zero where it held before, that with which it is caught where it begins, minus the jump of a
prescribed speed. Given impulses have acted: r = -v- after them.
"""

from __future__ import annotations

from typing import Final, Literal

from multibody_sym.dynamics.laws.enumeration import MOST
from multibody_sym.dynamics.laws.problem import LawProblem
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

ImpactLaw = Literal["newton", "poisson", "stronge"]
"""What a coefficient of restitution is: a ratio of speeds, of impulses, or its square one of works."""
Order = Literal["simultaneous", "one_by_one"]

CLOSING: Final = 1e-9
"""The part of the largest speed up to which rows that touch do not close: speeds for rows of unit length in A."""
ARITHMETIC: Final = 1e-5
"""Rounding of the speeds of bodies, as a part of the speeds up to which rows do not close."""


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

    def given_back(self, part: int) -> float:
        """Return the tangential restitution of a friction part."""
        return self.tangential[part] if self.tangential else 0.0


Stage = Literal["joined", "compression", "restitution", "at once", "given back"]


@dataclass(frozen=True)
class Phase:
    """A stretch of an impact in which nothing changes its mode.

    `stage`: what holds both ways is `joined` first; the normal speeds fall (`compression`) and rise (`restitution`),
    or both `at once`; friction is `given back` last. `rows` are the unilateral rows that are struck, `slips` (by part)
    0 for what sticks or takes no part, 1 or -1 the sign of v_t, 2 in space; `impulses` (m) what it adds to z. Several
    impacts one after the other are counted by `number`.
    """

    stage: Stage
    rows: tuple[int, ...]
    slips: tuple[int, ...]
    impulses: Floats
    number: int = 0


@dataclass(frozen=True)
class Struck:
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
    phases: tuple[Phase, ...]
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
