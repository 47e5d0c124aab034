"""One contact through compression and restitution: Routh's integration over its normal impulse.

While it slips one way, or sticks, all impulses and speeds are linear in p_n: exact, and changed where slip stops. In
space the direction of slip turns (`in_space`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.dynamics.impacts.account import Account, chosen
from multibody_sym.dynamics.impacts.elimination import Moved, struck_at, verify_moves
from multibody_sym.dynamics.impacts.in_space import turned, turns
from multibody_sym.dynamics.impacts.pace import AT_REST, Pace, alone, among
from multibody_sym.dynamics.impacts.problem import Stage
from multibody_sym.dynamics.impacts.restitution import COMPRESSED, Goal, Normal, let_go
from multibody_sym.dynamics.laws.problem import IN_SPACE, STICKS, FrictionLaw
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares, scaled_rows

MOST: Final = 1000
"""Stretches of one impact. One part slips, sticks, slips back: three; a dozen joints that rub have a few each."""


class Single:
    """One row that strikes alone: the problem of what acts with it, what its impulses move. No speeds are in it."""

    def __init__(self, account: Account, row: int) -> None:
        self.some = chosen(account.rows, (row,))
        self.name, self.row = account.problem.name(row), self.some.rows.index(row)
        parts = self.some.problem.parts
        self._simple = not parts or (len(parts) == 1 and parts[0].normals == (self.row,) and len(parts[0].rows) < 3)

    @property
    def followed(self) -> bool:
        """Whether its impact can be followed: not where several parts rub of which one does in space."""
        return self._simple or all(len(part.rows) == 1 for part in self.some.problem.parts)

    @property
    def part(self) -> FrictionLaw | None:
        """The friction of the contact, if nothing else rubs."""
        return next(iter(self.some.problem.parts), None) if self._simple else None

    @cached_property
    def moved(self) -> Moved | None:
        """What impulses at the contact move; None where other parts rub than its own, or several."""
        verify_moves(self.some, self.row, self.name)
        return struck_at(self.some, self.row) if self._simple else None

    @cached_property
    def lengths(self) -> Floats:
        """The lengths (m) of the rows."""
        return scaled_rows(self.some.problem.matrix)[0]


def routh(account: Account, single: Single) -> None:
    """Strike one row alone, with its friction and that in joints."""
    course = _Course(account, single)
    first = Normal(float(course.v[course.row]))
    course.stop_at_once()
    left = Normal(float(course.v[course.row]))  # what stops along the surface may push along the normal
    if left.v >= 0.0:
        return
    compressed = course.through("compression", COMPRESSED, left)
    e = float(account.restitution[single.some.rows[single.row]])
    if e > 0.0:
        course.through("restitution", let_go(account.problem.law, e, first.v, compressed), compressed)


class _Course:
    """A contact on its way: present speeds v (m) of the chosen rows; the account has the impulses.

    `moved` is None where other parts rub than that of the contact, or several; else `part` is the contact's, if any.
    """

    def __init__(self, account: Account, single: Single) -> None:
        self.account, self.some, self.row, self.name = account, single.some, single.row, single.name
        self.moved, self.part = single.moved, single.part
        self.tangents = list(self.part.rows) if self.part else []
        self.v = account.speeds()[self.some.rows]
        self.small: Floats = AT_REST * float(np.abs(self.v / single.lengths).max(initial=0.0)) * single.lengths

    def through(self, stage: Stage, goal: Goal, at: Normal) -> Normal:
        """Go through a stage to its end, and return the normal state there."""
        for _ in range(MOST):
            slip = self.v[self.tangents]
            if self.part and self.moved and self._turns(slip):
                at, ended = self._around(stage, goal, at)
            else:
                at, ended = self._straight(stage, goal, at)
            if ended:
                return at
        raise NoSolutionError(
            f"the impact at {self.name} does not end: friction in several places changes on and on",
            number="N108",
        )

    def _slips(self, v: Floats) -> bool:
        return bool(np.linalg.norm(v) > self.small[self.tangents].max(initial=0.0))

    def _turns(self, v: Floats) -> bool:
        if self.part is None or self.moved is None or len(v) < 2 or not self._slips(v):
            return False
        return turns(self.moved.K, self.part.kinetic, v)

    # --- straight ways ------------------------------------------------------------------------------------------------

    def _pace(self) -> Pace:
        if self.moved is None:
            return among(self.account, self.some, self.row, self.v, self.small)
        pace = alone(self.moved, self.part, self.v, float(self.small[self.tangents].max(initial=0.0)))
        if pace.slips == (IN_SPACE,) and self._slips(slip := self.v[self.tangents]):
            e = slip / np.linalg.norm(slip)
            pace.v[self.tangents] = e * float(e @ pace.v[self.tangents])
        return pace

    def _straight(self, stage: Stage, goal: Goal, at: Normal) -> tuple[Normal, bool]:
        """Go straight on to the end of the stage, or to where slip stops."""
        pace = self._pace()
        rate = float(pace.v[self.row])
        stop, stopping = self._next_stop(pace)
        end = goal.ahead(at, rate)
        ended = end <= stop
        dp = end if ended else stop
        if not math.isfinite(dp):
            raise NoSolutionError(self._wedged(rate), number="N108")
        at = at.on(dp, rate)
        at = goal.met(at) if ended else at
        if not ended and abs(at.v) <= self.small[self.row]:  # it stops as the slip does
            at = replace(at, v=0.0)
        if dp > 0.0:
            self._add(stage, pace.slips, (dp * pace.z, dp * pace.x))
        self.v = self.v + dp * pace.v
        self.v[self.row] = at.v
        if stop <= dp:
            self.v[stopping] = 0.0
        return at, ended

    def _wedged(self, rate: float) -> str:
        """Return that no impulse ends the impact: proved where the contact alone rubs, as its course is then unique."""
        does = f"closes it faster by {-rate:.3g} m/s" if rate < 0.0 else "does not move it"
        why = f"an impulse of 1 N s with its friction {does}, however large it grows"
        known = "" if self.moved is not None else "; proved for the way in which other parts slip or stick here only"
        return f"the impact at {self.name} has no end: its friction wedges it ({why}{known})"

    def _next_stop(self, pace: Pace) -> tuple[float, list[int]]:
        """Return the dp after which the first part stops to slip, and its rows."""
        first, rows = math.inf, list[int]()
        for part in self.some.problem.parts:
            own = list(part.rows)
            speed = float(np.linalg.norm(self.v[own]))
            if speed > self.small[own].max():
                slower = -float(self.v[own] @ pace.v[own]) / speed
                if slower > 0.0 and speed / slower < first:
                    first, rows = speed / slower, own
        return first, rows

    def _add(
        self, stage: Stage, slips: tuple[int, ...], impulses: tuple[Floats, Floats], lost: Floats | None = None
    ) -> None:
        z, taken = np.zeros(len(self.account.z)), None
        z[self.some.rows] = impulses[0]
        if lost is not None:
            taken = np.zeros(len(z))
            taken[self.some.rows] = lost
        self.account.add(
            stage, [self.some.rows[self.row]], self.some.of_all(slips, self.account.rows), (z, impulses[1]), taken
        )

    # --- slip that turns, and that stops at once ----------------------------------------------------------------------

    def _around(self, stage: Stage, goal: Goal, at: Normal) -> tuple[Normal, bool]:
        assert self.moved is not None
        assert self.part is not None
        way = turned(self.moved.K, self.part.kinetic, self.v[self.tangents], at, goal)
        f = np.concatenate([[way.at.p - at.p], way.impulse])
        lost = np.zeros(len(self.v))
        lost[self.row] = at.W - way.at.W
        lost[self.tangents] = way.lost * self._shares(way.impulse)
        self._add(stage, (IN_SPACE,), (self.moved.Z @ f, self.moved.X @ f), lost)
        self.v[self.row], self.v[self.tangents] = way.at.v, way.velocity
        return way.at, way.ended

    def _shares(self, impulse: Floats) -> Floats:
        """Return how the work of friction in space is shared by its two rows: by the squares of their impulses."""
        square = float(impulse @ impulse)
        return impulse * impulse / square if square else np.array([1.0, 0.0])

    def stop_at_once(self) -> None:
        """Stop slip where friction is always enough."""
        if self.part is None or self.moved is None or not self.part.enough or not self._slips(self.v[self.tangents]):
            return
        K = self.moved.K
        held = least_squares(K[1:, 1:], -self.v[self.tangents])
        f = np.concatenate([[0.0], held])
        self._add("compression", (STICKS,), (self.moved.Z @ f, self.moved.X @ f))
        self.v = self.account.speeds()[self.some.rows]
        self.v[self.tangents] = 0.0
        if abs(self.v[self.row]) <= self.small[self.row]:  # where both move together it stops too
            self.v[self.row] = 0.0
