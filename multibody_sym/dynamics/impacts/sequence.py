"""Impacts one after the other, the fastest closing first, or again and again at once; and collapse where none ends.

One that closes afterwards is a new impact from where the last one has led. What strikes at the same time, but moves
nothing of each other, strikes as if it were alone. More than 100 + 20 n impacts of n connected contacts are too many:
they strike once more, all at once and without bouncing. So does what closes too slowly to count after impacts in turn,
which is the limit of those that would follow.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Final

import numpy as np

from multibody_sym.dynamics.impacts.account import Account
from multibody_sym.dynamics.impacts.giving_back import give_back
from multibody_sym.dynamics.impacts.one_contact import Single, routh
from multibody_sym.dynamics.impacts.together import newton, poisson
from multibody_sym.dynamics.laws.problem import Equality, LawProblem
from multibody_sym.dynamics.laws.scaled import Flags
from multibody_sym.errors import InputError, NoSolutionError
from multibody_sym.numerics.connected import connected
from multibody_sym.numerics.rank import scaled_rows

ALIKE: Final = 1e-9
"""Closing speeds that differ by less than this part are struck together."""
CONNECTED: Final = 1e-12
"""The part of their lengths below which what one row pushes does not move another."""
PATIENCE: Final = 2
"""How often the number of impacts after which contacts collapse is too many altogether."""


class _Counts:
    """How many impacts each connected cluster had."""

    def __init__(self, account: Account) -> None:
        self.account, self.near = account, _near(account.rows)
        self.cluster = _numbers(self.near)
        self.counts: dict[int, int] = {}

    def of(self, row: int) -> list[int]:
        """Return the unilateral rows that are connected with one."""
        return [k for k in self.account.unilateral if self.cluster[k] == self.cluster[row]]

    def islands(self, struck: Collection[int], held: Collection[int] = ()) -> list[list[int]]:
        """Return the rows that are struck, and held, by those that push each other beside what always acts."""
        rows = self.account.rows
        acting = {*struck, *held, *(k for k, law in enumerate(rows.laws) if isinstance(law, Equality))}
        parts = (part for part in rows.parts if acting.issuperset(part.normals))
        every = sorted(acting.union(*(part.rows for part in parts)))
        groups = ([every[k] for k in group] for group in connected(self.near[np.ix_(every, every)]))
        return [[k for k in group if k in struck or k in held] for group in groups if not set(struck).isdisjoint(group)]

    def number(self, row: int) -> int:
        """Return how many impacts the cluster of a row had."""
        return self.counts.get(self.cluster[row], 0)

    def has_collapsed(self, row: int) -> bool:
        """Count an impact of the cluster of a row; if there were too many, let it collapse, and say so."""
        account, rows = self.account, self.of(row)
        account.impacts += 1
        count = self.counts[self.cluster[row]] = self.counts.get(self.cluster[row], 0) + 1
        most = 100 + 20 * len(rows)
        if count <= most:
            return False
        names = ", ".join(account.problem.name(k) for k in rows)
        if count > PATIENCE * most:
            raise NoSolutionError(f"impacts do not end at {names}, without bouncing neither", number="N108")
        if account.restitution[rows].any():
            account.restitution[rows] = 0.0
            account.collapsed = True
            account.note(f"collapse: more than {most} impacts, so {names} struck at once without bouncing")
        poisson(account, rows)  # those that separate now too: something may drive them together again
        return True


def at_once(account: Account) -> None:
    """Strike all that touches where something closes, until nothing does."""
    counts, known = _Counts(account), dict[int, Single]()
    while closing := account.closing():
        cluster = counts.of(closing[0])
        if counts.has_collapsed(closing[0]):
            continue
        rows = [k for k in account.not_separating() if k in cluster]
        if account.problem.law == "stronge":
            rows = _single(account, [k for k in closing if k in cluster])
        for island in counts.islands(rows):
            _strike(account, island, known)


def _single(account: Account, closing: list[int]) -> list[int]:
    if len(closing) == 1:
        return closing
    names = ", ".join(account.problem.name(k) for k in closing)
    raise InputError(
        f"Stronge's coefficient is one of a single contact, but {names} close at once: say `sequence: one_by_one`, "
        "or `law: poisson`",
        number="M121",
    )


def one_by_one(account: Account) -> None:
    """Strike what closes fastest, with what closes as fast, until nothing closes; what does not bounce is held."""
    counts, known = _Counts(account), dict[int, Single]()
    while closing := account.closing():
        v = account.speeds()
        fastest = min(closing, key=lambda k: float(v[k]))
        if counts.has_collapsed(fastest):
            continue
        cluster = counts.of(fastest)
        rows = [k for k in closing if k in cluster and v[k] <= (1.0 - ALIKE) * v[fastest]]
        held = [k for k in cluster if abs(v[k]) <= account.allowed[k] and not account.restitution[k]]
        for island in counts.islands(rows, held):
            _strike(account, island, known)
    _to_their_limit(account, counts)


def _to_their_limit(account: Account, counts: _Counts) -> None:
    """Strike at once, without bouncing, what struck in turn until it closed by less than counts.

    Such impacts have no last one: speeds of closing and of slip shrink together, and none is left in the limit.
    """
    v = account.speeds()
    left = [k for k in account.not_separating() if counts.number(k) > 1]
    for first in {counts.cluster[k] for k in left if v[k] < -account.rounding[k]}:
        rows = [k for k in left if counts.cluster[k] == first]
        bounces = account.restitution
        account.restitution = np.zeros(len(bounces))
        poisson(account, rows)
        account.restitution = bounces


def _strike(account: Account, rows: Sequence[int], known: dict[int, Single]) -> None:
    """Strike rows by the law that is asked for, and let friction be given back; `known` rows have struck before."""
    before = account.copy()
    single = None
    if len(rows) == 1:
        single = known[rows[0]] = known.get(rows[0]) or Single(account, rows[0])
    _by_law(account, rows, single)
    give_back(account, rows, before)


def _by_law(account: Account, rows: Sequence[int], single: Single | None) -> None:
    law = account.problem.law
    if single is not None and single.followed:
        routh(account, single)
    elif law == "newton" or (law == "stronge" and not _rubs(account, rows)):
        newton(account, rows)
    else:
        names = ", ".join(account.problem.name(k) for k in sorted(rows))
        if len(rows) == 1:
            account.note(f"{names}: several things rub, in space: their slip is that at the ends of both phases")
        elif law == "stronge":
            account.note(f"{names} strike together, which Stronge's law does not tell with friction: by Poisson's")
        poisson(account, rows)


def _rubs(account: Account, rows: Collection[int]) -> bool:
    """Return whether anything rubs at rows, or in joints."""
    parts = [part for part in account.rows.parts if part.enough or part.static or part.kinetic]
    return any(set(part.normals) <= set(rows) or not set(part.normals) & set(account.unilateral) for part in parts)


def clusters(rows: LawProblem) -> list[int]:
    """Return for each row the number of its cluster: rows push each other there, over any others."""
    return _numbers(_near(rows))


def _numbers(near: Flags) -> list[int]:
    found = {k: group[0] for group in connected(near) for k in group}
    return [found[k] for k in range(len(near))]


def _near(rows: LawProblem) -> Flags:
    """Return which rows push each other (m, m)."""
    A, C = scaled_rows(rows.matrix)[1], scaled_rows(rows.exerted)[1]
    K = np.abs(A @ C.T) + np.abs(rows.coupling)
    near = K > CONNECTED
    for part in rows.parts:
        near[np.ix_([*part.rows, *part.normals], [*part.rows, *part.normals])] = True
    return near
