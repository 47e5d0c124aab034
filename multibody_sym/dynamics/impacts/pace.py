"""At what rates impulses and speeds of one contact change with its normal impulse, while it slips or sticks.

    v' = K f',   f' = (1, p_t'),   p_t' = -mu v_t/|v_t|;  at rest v_t' = 0 with |p_t'| <= mu, else along v_t'

In several places (a joint that rubs, rolling resistance) the rates themselves obey the laws of an instant: p_n' = 1 is
a row that defines its multiplier.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from multibody_sym.dynamics.impacts.account import Account, Chosen
from multibody_sym.dynamics.impacts.elimination import Moved
from multibody_sym.dynamics.laws.problem import IN_SPACE, STICKS, Equality, FrictionLaw
from multibody_sym.dynamics.laws.search import find
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.records import dataclass
from multibody_sym.scalars.limits import room, sliding

AT_REST = 1e-12
"""Part of the largest speed below which v_t is rounding."""


@dataclass(frozen=True)
class Pace:
    """Rates by the normal impulse, over the rows of a chosen problem: z' (m), x' (n), v' (m); `slips` by its parts."""

    z: Floats
    x: Floats
    v: Floats
    slips: tuple[int, ...]


def alone(moved: Moved, part: FrictionLaw | None, v: Floats, small: float) -> Pace:
    """Return the rates of a contact with one friction part, or none, at speeds v (m); below `small` v_t is at rest."""
    K = moved.K
    f, slip = np.zeros(len(moved.own)), STICKS
    f[0] = 1.0
    if part is not None:
        f[1:], slip = _tangential(K, part, v[list(part.rows)], small)
    rates = np.zeros(len(v))
    rates[moved.own] = K @ f
    if part is not None and slip == STICKS:
        rates[list(part.rows)] = 0.0
    return Pace(moved.Z @ f, moved.X @ f, rates, () if part is None else (slip,))


def _tangential(K: Floats, part: FrictionLaw, v: Floats, small: float) -> tuple[Floats, int]:
    """Return p_t' and how the part slips."""
    speed = float(np.linalg.norm(v))
    if not speed > small:
        held = least_squares(K[1:, 1:], -K[1:, 0])
        if part.enough or room(part.static, 1.0 + AT_REST, [float(np.linalg.norm(held))]) >= 0.0:
            return held, STICKS
        v = np.sign(K[1, :1]) if len(v) == 1 else departing(K, part.kinetic)
        speed = 1.0
    return np.array(sliding(part.kinetic, v.tolist(), speed)), IN_SPACE if len(v) > 1 else int(np.sign(v[0]))


def departing(K: Floats, mu: float) -> Floats:
    """Return the unit vector e in which slip starts from rest: K_tn - mu K_tt e = c e with c > 0.

    |(mu K_tt + c)^-1 K_tn| falls with c, from more than 1 at c = 0 since it does not stick.
    """
    sizes, axes = np.linalg.eigh((K[1:, 1:] + K[1:, 1:].T) / 2.0)
    along = axes.T @ K[1:, 0]
    low, high = 0.0, float(np.linalg.norm(along))
    for _ in range(200):
        c = (low + high) / 2.0
        if not low < c < high:
            break
        longer = float(np.linalg.norm(along / (mu * sizes + c))) > 1.0
        low, high = (c, high) if longer else (low, c)
    e = axes @ (along / (mu * sizes + high))
    return np.asarray(e / np.linalg.norm(e), dtype=float)


def among(account: Account, some: Chosen, row: int, v: Floats, small: Floats) -> Pace:
    """Return the rates where several parts rub, for the contact at `row` of a chosen problem at speeds v (m).

    A part whose speeds are below `small` (m) is at rest.
    """
    problem = some.problem
    matrix, coupling, right = problem.matrix.copy(), problem.coupling.copy(), np.zeros(len(v))
    matrix[row], coupling[row] = 0.0, 0.0
    coupling[row, row] = right[row] = 1.0
    laws = tuple(Equality() if k == row else law for k, law in enumerate(problem.laws))
    parts = tuple(replace(part, velocity=_velocity(part, v, small)) for part in problem.parts)
    posed = replace(problem, matrix=matrix, coupling=coupling, right=right, laws=laws, parts=parts)
    found = find(posed, every=False)
    if not found.states:
        name = account.problem.name(some.rows[row])
        jams = f"the impact at {name} cannot go on: friction in several places jams there"
        unknown = f"no way was found in which the impact at {name} goes on past friction in several places"
        raise NoSolutionError(jams if found.proved else f"{unknown}; tried were {found.searched}", number="N108")
    state = found.states[0]
    return Pace(state.z, state.x, problem.matrix @ state.x + problem.coupling @ state.z, state.mode.slips)


def _velocity(part: FrictionLaw, v: Floats, small: Floats) -> tuple[float, ...]:
    rows = list(part.rows)
    rests = float(np.linalg.norm(v[rows])) <= float(small[rows].max())
    return (0.0,) * len(rows) if rests else tuple(float(x) for x in v[rows])
