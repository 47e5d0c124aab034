"""Friction that is given back (a superball): p_t is reversed, up to the cone, and to the work that friction took.

What sticks at the end of an impact has stored the part of p_t that its tangential coefficient says, and gives it back
along p_t. What slips then has stored nothing. Without the last limit it could make energy where normal impulses move
the tangents too; for a sphere it is none: v_t+ = -e_t v_t-.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np

from multibody_sym.dynamics.impacts.account import Account, Chosen, chosen
from multibody_sym.dynamics.impacts.elimination import moved_by
from multibody_sym.dynamics.laws.problem import Friction
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.limits import pressing, room


def give_back(account: Account, closed: Collection[int], before: Account) -> None:
    """Give back the friction of an impact of rows that sticks now; `before` is the account before it."""
    if not any(account.problem.tangential):
        return
    some = chosen(account.rows, closed)
    z, stored = account.z - before.z, np.zeros(len(account.z))
    parts = [k for k in range(len(some.parts)) if _sticks(account, some, k)]
    for k in parts:
        own, normals = _rows(some, k)
        part, size = some.problem.parts[k], float(np.linalg.norm(z[own]))
        N = pressing(z[normals].tolist(), [1] * len(normals))
        if size > 0.0:
            back = account.problem.given_back(some.parts[k]) * size
            left = math.inf if part.enough else room(part.static, N, [size])
            stored[own] = z[own] * max(min(back, left), 0.0) / size
    if not stored.any():
        return
    own = [k for k, law in enumerate(some.problem.laws) if isinstance(law, Friction)]
    moved, f = moved_by(some, own), stored[some.rows][own]
    taken = sum(float((account.lost - before.lost)[_rows(some, k)[0]].sum()) for k in parts)
    needed = float(f @ moved.K @ f) / 2.0 + float(f @ account.speeds()[some.rows][own])
    f = f * min(1.0, math.sqrt(max(taken, 0.0) / needed)) if needed > 0.0 else f
    if f.any():
        _add(account, some, (moved.Z @ f, moved.X @ f))


def _rows(some: Chosen, k: int) -> tuple[list[int], list[int]]:
    """Return the rows of a part, and its normals, among those of all."""
    part = some.problem.parts[k]
    return [some.rows[row] for row in part.rows], [some.rows[row] for row in part.normals]


def _sticks(account: Account, some: Chosen, k: int) -> bool:
    own, normals = _rows(some, k)
    v = account.speeds()
    small = float(np.maximum(account.allowed, account.rounding)[own].max())
    at_rest = float(np.linalg.norm(v[own])) <= small
    return at_rest and account.problem.given_back(some.parts[k]) > 0.0 and set(normals) <= set(account.unilateral)


def _add(account: Account, some: Chosen, impulses: tuple[Floats, Floats]) -> None:
    z = np.zeros(len(account.z))
    z[some.rows] = impulses[0]
    sticks = (0,) * len(some.parts)
    account.add("given back", (), some.of_all(sticks, account.rows), (z, impulses[1]))
