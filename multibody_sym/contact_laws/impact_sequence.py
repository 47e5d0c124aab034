"""Impacts of several contacts: one after the other, or all at once; and impulses of many contacts by sweeps.

In: an ImpactProblem (arrays). Out: the ImpactResult of `strike`. A single contact is followed by `routh_method`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.contact_laws.enumeration import SPHERE
from multibody_sym.contact_laws.impact_problem import (
    Chosen,
    ImpactProblem,
    ImpactProgress,
    ImpactResult,
    NoImpulsesError,
    Stage,
    dependent_rows,
    impulse_response,
    select_rows,
    start_impact,
)
from multibody_sym.contact_laws.problem import (
    IN_SPACE,
    STICKS,
    Equality,
    Flags,
    LawMode,
    LawProblem,
    LawState,
    LawStates,
    Places,
    Scaled,
    ScaledFriction,
    Unilateral,
    scaled,
)
from multibody_sym.contact_laws.routh_method import AT_REST, Single, give_back, routh
from multibody_sym.contact_laws.search import connected_groups, find, modes_of
from multibody_sym.contact_laws.solve_mode import Reduced, eliminate_equalities, fulfils, holds_equations, solve_mode
from multibody_sym.contact_laws.uniqueness import SEEN, admissible_solution, open_forces
from multibody_sym.errors import InputError, NoSolutionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import CONNECTED, TOGETHER, most, pressing
from multibody_sym.scalars.rank import DRAWN, exact, least_squares, null_space, scaled_rows

# ----------------------------------------------------------------------------------------------------------------------
# A mode of an impact at once, by sweeps over its contacts: each obeys its own law beside the impulses of the others.
#
# Nearly sure where directions of slip in space make proposals miss, and sooner than trying all modes: what they come
# near is solved exactly, and judged, by the search for modes.


MOST: Final = 2000
NEAR: Final = (50, 250)
"""Sweeps after which the mode is tried: its impulses may go on to change long after it."""
_TURNS: Final = 2.0 * np.pi * np.arange(24) / 24
WAYS: Final = {2: np.column_stack([np.cos(_TURNS), np.sin(_TURNS)]), 3: SPHERE}
"""Directions that are tried for each slip in space beside the one that sweeps were at."""
SETTLED: Final = 1e-13
"""Part of the largest impulse by which none changes in a sweep any more."""
CARRIES: Final = 1e-9
"""Part of the largest impulse below which there is none, and of the largest speed below which nothing slips."""


def sweep_to_modes(problem: LawProblem) -> Iterator[LawMode]:
    """Yield modes that sweeps are near, the last when nothing changes or there were too many; static friction holds."""
    system = scaled(problem)
    small = eliminate_equalities(system)
    normals = [(int(small.place[k]), float(small.a0[k]), small.K[k]) for k in system.unilateral]
    normals = [each for each in normals if each[2][each[0]] > 0.0]
    parts = [own for own in (_Own.of(part, small) for part in system.parts) if own.stiff > 0.0]
    f = np.zeros(len(small.own))
    for number in range(1, MOST + 1):
        before = f.copy()
        for i, a, row in normals:
            f[i] = max(0.0, f[i] - (a + row @ f) / row[i])
        for own in parts:
            f[own.places] = own.impulses(f)
        settled = float(np.abs(f - before).max(initial=0.0)) <= SETTLED * float(np.abs(f).max(initial=0.0))
        if settled or number in NEAR or number == MOST:
            yield _mode_of(system, small, f)
        if settled:
            break


def turn_slips(problem: LawProblem, mode: LawMode) -> LawMode | None:
    """Return a mode with one of its slips in space turn_slips, in which static friction holds; None where none does."""
    system = scaled(problem)
    mu = np.array([part.static for part in system.parts], dtype=float)
    for k, slip in enumerate(mode.directions):
        for way in () if slip is None else WAYS[len(slip)]:
            direction = tuple(float(x) for x in way)
            other = replace(mode, directions=(*mode.directions[:k], direction, *mode.directions[k + 1 :]))
            if _may_hold(system, other, mu):
                return other
    return None


def _may_hold(system: Scaled, mode: LawMode, mu: Floats) -> bool:
    """Return whether a mode fulfils the laws, with other impulses than those of a basic solution if need be."""
    trial = solve_mode(system, modes_of(system, mode), mu)
    if fulfils(trial) or not trial.idle.shape[1] or not holds_equations(trial):
        return fulfils(trial)
    other = admissible_solution(system, trial)
    return other is not None and fulfils(other)


@dataclass(frozen=True)
class _Own:
    """A friction part beside all impulses f: its own are at `places`, its speeds a + K f, its loads z + Z f.

    `stiff` is the most that one of its own changes its speed.
    """

    part: ScaledFriction
    places: Places
    a: Floats
    K: Floats
    z: Floats
    Z: Floats
    stiff: float

    @classmethod
    def of(cls, part: ScaledFriction, small: Reduced) -> _Own:
        """Return a part of a problem without equalities."""
        rows, normals, places = part.rows, part.normals, small.place[part.rows]
        K, base = small.K[rows], part.base
        stiff = float(np.linalg.norm(K[:, places], 2))
        return cls(part, places, small.a0[rows], K, base * small.z0[normals], base[:, None] * small.Z[normals], stiff)

    def impulses(self, f: Floats) -> Floats:
        """Return the impulses of its law beside all others; static friction holds."""
        wanted: Floats = f[self.places] - (self.a + self.K @ f) / self.stiff
        size, loads = math.hypot(*wanted.tolist()), (self.z + self.Z @ f).tolist()
        limit = most(self.part.static, pressing(loads, [0] * len(loads), norm=self.part.norm))
        return wanted * min(1.0, limit / size) if size else np.zeros(len(wanted))


def _mode_of(system: Scaled, small: Reduced, f: Floats) -> LawMode:
    z, a = small.z0 + small.Z @ f, small.a0 + small.K @ f
    force, speed = CARRIES * float(np.abs(z).max(initial=0.0)), CARRIES * float(np.abs(system.r).max(initial=0.0))
    sides = np.ones(system.count, dtype=int)
    sides[system.unilateral] = z[system.unilateral] > force
    sides[system.both] = np.where(z[system.both] < 0.0, -1, 1)
    slips, directions = list[int](), list[tuple[float, ...] | None]()
    for part in system.parts:
        slip = a[part.rows]
        moves = float(np.linalg.norm(slip)) > speed and not part.enough
        sides[part.rows] = not moves
        slips.append((IN_SPACE if part.in_space else int(np.sign(slip[0]))) if moves else STICKS)
        e = slip / np.linalg.norm(slip) if moves else slip
        directions.append(tuple(float(x) for x in e) if moves and part.in_space else None)
    return LawMode(tuple(int(k) for k in sides), tuple(slips), tuple(directions))


# ----------------------------------------------------------------------------------------------------------------------
# Several contacts at once: the laws of an instant for speeds, searched like those of accelerations.
#
# Newton: v+ + e v- >= 0 beside p >= 0, |p_t| <= mu p. Poisson, twice: compression, v_n >= 0 beside p >= 0, |p_t| <= mu
# p; from there restitution, v_n >= 0 beside p_E - e p_C >= 0, |p_t| <= mu p_E. What p_E has to have already, e p_C, is
# a row that defines its multiplier, exerts what the normal does, and presses beside it. Slip is in its directions at
# the end.


_CONTRADICT: Final = "the speeds wanted there contradict each other", True


def newton(account: ImpactProgress, closed: Collection[int]) -> None:
    """Strike rows at once by Newton's coefficients: by the smallest where different ones contradict each other.

    In a wedge what separates, though by next to nothing, contradicts what is to bounce: then it takes no part.
    """
    if _newton(account, closed):
        return
    v = account.v
    if _newton(account, [k for k in closed if v[k] <= account.rounding[k]]):
        return
    differ = _take_smallest(account, closed, "no impulses fulfil Newton's law with different coefficients")
    if not (differ and _newton(account, closed)):
        raise _no_impulses_error(account, closed)


def poisson(account: ImpactProgress, closed: Collection[int]) -> None:
    """Strike rows at once by Poisson's coefficients: by the smallest where different ones make energy."""
    kept = account.copy()
    _poisson(account, closed)
    if account.gains_since(kept):
        made = account.lost.sum() - kept.lost.sum()
        if _differ(account, closed):
            account.back_to(kept)
            _take_smallest(account, closed, f"different coefficients would make {-made:.3g} J")
            _poisson(account, closed)


def _differ(account: ImpactProgress, closed: Collection[int]) -> bool:
    return len(set(account.restitution[list(closed)].tolist())) > 1


def _take_smallest(account: ImpactProgress, closed: Collection[int], why: str) -> bool:
    """Let rows have the smallest of their coefficients; return whether they differ."""
    if not _differ(account, closed):
        return False
    rows = sorted(closed)
    least = float(account.restitution[rows].min())
    account.restitution[rows] = least
    names = ", ".join(account.problem.name(k) for k in rows)
    account.note(f"{why}: {names} have the smallest one, {least:g}")
    return True


def _newton(account: ImpactProgress, closed: Collection[int]) -> bool:
    """Strike rows at once; return whether that is possible."""
    wanted, rows, now = np.zeros(len(account.z)), list(closed), account.v
    wanted[rows] = -account.restitution[rows] * np.minimum(now[rows], 0.0)
    z = _search(account, closed, wanted, "at once")
    if z is not None:
        account.compression += z / (1.0 + account.restitution)
    return z is not None


def _poisson(account: ImpactProgress, closed: Collection[int]) -> None:
    z = _search(account, closed, np.zeros(len(account.z)), "compression")
    if z is None:
        if _stop_slip(account, closed) and not set(account.closing()).intersection(closed):
            return
        z = _find_impulses(account, closed, "compression")
    given = {k: float(account.restitution[k] * z[k]) for k in closed}
    given = {k: value for k, value in given.items() if value > 0.0}
    if not given:
        return
    if account.unsure.intersection(given) and (_differ(account, closed) or select_rows(account.rows, closed).parts):
        names = ", ".join(account.problem.name(k) for k in sorted(account.unsure.intersection(given)))
        account.note(f"impulses of compression at {names} are not unique; restitution follows the most even ones")
    _find_impulses(account, closed, "restitution", given)


def _stop_slip(account: ImpactProgress, closed: Collection[int]) -> bool:
    """Stop slip where friction is always enough, before anything presses; return whether there was any.

    So it is with one contact alone. Where that pushes contacts apart, friction has nothing that presses beside it.
    """
    some, v = select_rows(account.rows, closed), account.v
    rubs = some.problem.tangents
    moved = impulse_response(some, rubs)
    enough = [rubs.index(row) for part in some.problem.parts if part.enough for row in part.rows]
    slip = v[some.rows][rubs][enough]
    if not (np.abs(slip) > account.rounding[some.rows][rubs][enough]).any():
        return False
    f = np.zeros(len(rubs))
    f[enough] = least_squares(moved.K[np.ix_(enough, enough)], -slip)
    z = np.zeros(len(v))
    z[some.rows] = moved.Z @ f
    account.add("compression", closed, some.of_all((STICKS,) * len(some.parts), account.rows), (z, moved.X @ f))
    return True


def _find_impulses(
    account: ImpactProgress, closed: Collection[int], stage: Stage, given: Mapping[int, float] | None = None
) -> Floats:
    """Add and return the impulses (m) after which all laws hold. Raises NoSolutionError where there are none.

    What friction without bound would have to pull in to hold slips, as in the limit of large coefficients.
    """
    z = _search(account, closed, np.zeros(len(account.z)), stage, given)
    if z is None:
        z = _search(account, closed, np.zeros(len(account.z)), stage, given, slips=True)
    if z is None:
        raise _no_impulses_error(account, closed)
    return z


def _search(
    account: ImpactProgress,
    closed: Collection[int],
    wanted: Floats,
    stage: Stage,
    given: Mapping[int, float] | None = None,
    *,
    slips: bool = False,
) -> Floats | None:
    """Add and return the impulses (m) after which all laws hold for v+ - wanted; `given` are those of rows at least.

    Where friction without bound `slips` it has a large coefficient, but for what is pressed from both sides. Returns
    None where there are none.
    """
    given = given or {}
    some = select_rows(account.rows, closed)
    if slips:
        laws, parts = some.problem.laws, some.problem.parts  # what is pressed from one side holds by its coefficient
        one_way = [all(isinstance(laws[k], Unilateral) for k in part.normals) for part in parts]
        pairs = zip(parts, one_way, strict=True)
        loose = tuple(replace(part, held=part.held and not free) for part, free in pairs)
        some = replace(some, problem=replace(some.problem, parts=loose))
    now = account.v
    here = {some.rows.index(k): value for k, value in given.items()}
    right = _without_rounding(account, some, (wanted - now)[some.rows])
    problem = _with_given(replace(some.problem, right=right), here)
    found, count = _states(problem, account.problem.most), len(some.rows)
    if not found.states:
        account.nothing = _CONTRADICT if _contradict(problem) else (found.searched, found.proved)
        return None
    state = found.states[0]
    shared, unsure = _even_impulses(problem, state)
    z = np.zeros(len(now))
    z[some.rows] = shared[:count]
    for row, value in given.items():
        z[row] += value
    sides = zip(some.rows, state.mode.sides[:count], strict=True)
    pressed = [k for k, side in sides if k in closed and (side or k in given)]
    z = account.add(stage, pressed, some.of_all(state.mode.slips, account.rows), (z, state.x))
    account.unsure |= {some.rows[k] for k in unsure if k < count}
    return z


def _states(problem: LawProblem, most: int) -> LawStates:
    """Return what is found that fulfils the laws: near where sweeps come to, or among all modes if they are no more."""
    found = find(problem, every=False, most=0)
    if found.states:
        return found
    for mode in sweep_to_modes(problem):
        found = find(problem, mode, every=False, most=0)
        if found.states:
            return found
    if most:
        found = find(problem, every=False, most=most)
    if not found.states and most and (other := turn_slips(problem, mode)) is not None:
        found = find(problem, other, every=False)
    return found


def _contradict(problem: LawProblem) -> bool:
    """Return whether what holds both ways wants speeds that no motion has, whatever else acts."""
    both = [k for k in problem.equalities if not problem.coupling[k].any()]
    matrix, right = problem.matrix[both], problem.right[both]
    missed = matrix @ least_squares(matrix, right, exact(matrix)) - right
    return bool((np.abs(missed) > AT_REST * np.abs(right).max(initial=0.0)).any())


def _without_rounding(account: ImpactProgress, some: Chosen, right: Floats) -> Floats:
    """Return right sides without what rounding has left of speeds before: dependent rows contradict each other by it.

    After several impacts that is no longer little beside the speeds that are left. Rows that define an impulse are no
    speeds.
    """
    own = ~some.problem.coupling.any(axis=1)
    matrix, near = some.problem.matrix[own], right.copy()
    near[own] = matrix @ least_squares(matrix, right[own], exact(matrix))
    apart = np.abs(near - right) <= account.rounding[some.rows]
    return near if apart.all() else right


def _with_given(problem: LawProblem, given: Mapping[int, float]) -> LawProblem:
    """Return the problem with a row for each impulse that a row has beside its own."""
    if not given:
        return problem
    count, size = problem.matrix.shape
    more, rows = len(given), list(given)
    own = {row: count + k for k, row in enumerate(rows)}
    coupling = np.zeros((count + more, count + more))
    coupling[:count, :count] = problem.coupling
    coupling[count:, count:] = np.eye(more)
    coupling[:count, count:] = problem.coupling[:, rows]
    parts = (
        replace(part, normals=(*part.normals, *(own[k] for k in part.normals if k in own))) for part in problem.parts
    )
    return LawProblem(
        np.vstack([problem.matrix, np.zeros((more, size))]),
        np.vstack([problem.exerted, problem.exerted[rows]]),
        coupling,
        np.concatenate([problem.right, [given[k] for k in rows]]),
        (*problem.laws, *[Equality()] * more),
        tuple(parts),
    )


def _even_impulses(problem: LawProblem, state: LawState) -> tuple[Floats, list[int]]:
    """Return the impulses (m) for the same speeds that are shared most evenly, and the rows that may have others.

    Those of least length, forces at unit length, where they fulfil the laws; what holds both ways keeps its own.
    """
    system = scaled(problem)
    mu = [p.kinetic if p.number in state.kinetic else p.static for p in system.parts]
    trial = solve_mode(system, modes_of(system, state.mode), np.array(mu, dtype=float).reshape(len(mu)))
    here = replace(trial, x=state.x, z=state.z * system.sizes, a=state.a / system.lengths)
    unsure = np.flatnonzero(open_forces(system, trial, here)[0])
    if len(unsure):
        # Combinations that change no speed: what slides may be pushed.
        pushed = float(np.linalg.norm(trial.moved)) > SEEN * float(np.linalg.norm(trial.forces @ trial.idle))
        unmoved = null_space(trial.moved, DRAWN) if pushed else np.eye(trial.idle.shape[1])
        idle = trial.forces @ trial.idle @ unmoved
        free = idle @ null_space(idle[problem.equalities], DRAWN)
        even = replace(here, z=here.z - free @ least_squares(free, here.z))
        if fulfils(even):
            here = even
    return here.z / system.sizes, [int(k) for k in unsure]


def _no_impulses_error(account: ImpactProgress, closed: Collection[int]) -> NoSolutionError:
    names = ", ".join(account.problem.name(k) for k in sorted(closed)) or "what holds both ways"
    rubs = account.problem.law == "newton" and any(part.static or part.enough for part in account.rows.parts)
    advice = " (Newton's coefficient with friction may have no solution; `law: poisson` has one)" if rubs else ""
    searched, proved = account.nothing
    laws = f"fulfil the laws of the impact at {names}"
    if proved:
        return NoImpulsesError(f"no impulses {laws}: {searched}{advice}", number="N108")
    unproved = "it is not proved that there are none"
    told = f"no impulses were found that {laws}; tried were {searched}, and {unproved}{advice}"
    return NoSolutionError(told, number="N108")


# ----------------------------------------------------------------------------------------------------------------------
# Impacts one after the other, the fastest closing first, or again and again at once; and collapse where none ends.
#
# One that closes afterwards is a new impact from where the last one has led. What strikes at the same time, but moves
# nothing of each other, strikes as if it were alone. More than 100 + 20 n impacts of n connected contacts are too
# many: they strike once more, all at once and without bouncing. So does what closes too slowly to count after impacts
# in turn, which is the limit of those that would follow.


PATIENCE: Final = 2
"""How often the number of impacts after which contacts collapse is too many altogether."""


class _Counts:
    """How many impacts each connected cluster had."""

    def __init__(self, account: ImpactProgress) -> None:
        self.account, self.near = account, _near(account.rows)
        self.cluster = np.array(_numbers(self.near), dtype=np.intp)
        self.counts: dict[int, int] = {}
        self._sizes = np.bincount(self.cluster[account.unilateral], minlength=len(self.cluster)).tolist()

    def of(self, row: int) -> Places:
        """Return the unilateral rows that are connected with one."""
        every = self.account.unilateral
        found: Places = every[self.cluster[every] == self.cluster[row]]
        return found

    def islands(self, struck: Collection[int], held: Collection[int] = ()) -> list[list[int]]:
        """Return the rows that are struck, and held, by those that push each other beside what always acts."""
        rows = self.account.rows
        if len(struck) == 1 and not held:
            return [list(struck)]
        acting = {*struck, *held, *rows.equalities}
        parts = (part for part in rows.parts if acting.issuperset(part.normals))
        every = sorted(acting.union(*(part.rows for part in parts)))
        groups = ([every[k] for k in group] for group in connected_groups(self.near[np.ix_(every, every)]))
        return [[k for k in group if k in struck or k in held] for group in groups if not set(struck).isdisjoint(group)]

    def number(self, row: int) -> int:
        """Return how many impacts the cluster of a row had."""
        return self.counts.get(int(self.cluster[row]), 0)

    def has_collapsed(self, row: int) -> bool:
        """Count an impact of the cluster of a row; if there were too many, let it collapse, and say so."""
        account, cluster = self.account, int(self.cluster[row])
        account.impacts += 1
        count = self.counts[cluster] = self.counts.get(cluster, 0) + 1
        most = 100 + 20 * self._sizes[cluster]
        if count <= most:
            return False
        rows = self.of(row).tolist()
        names = ", ".join(account.problem.name(k) for k in rows)
        if count > PATIENCE * most:
            raise NoSolutionError(f"impacts do not end at {names}, without bouncing neither", number="N108")
        if account.restitution[rows].any():
            account.restitution[rows] = 0.0
            account.collapsed = True
            account.note(f"collapse: more than {most} impacts, so {names} struck at once without bouncing")
        poisson(account, rows)  # those that separate now too: something may drive them together again
        return True


def at_once(account: ImpactProgress) -> None:
    """Strike all that touches where something closes, until nothing does."""
    counts, known = _Counts(account), dict[int, Single]()
    while closing := account.closing().tolist():
        cluster = counts.of(closing[0])
        if counts.has_collapsed(closing[0]):
            continue
        rows = np.intersect1d(account.not_separating(), cluster).tolist()
        if account.problem.law == "stronge":
            rows = np.intersect1d(closing, cluster).tolist()
            if len(rows) > 1:
                names = ", ".join(account.problem.name(k) for k in rows)
                raise InputError(
                    f"Stronge's coefficient is one of a single contact, but {names} close at once: say "
                    "`sequence: one_by_one`, or `law: poisson`",
                    number="M121",
                )
        for island in counts.islands(rows):
            _strike(account, island, known)


def one_by_one(account: ImpactProgress) -> None:
    """Strike what closes fastest, with what closes as fast, until nothing closes; what does not bounce is held."""
    counts, known, still = _Counts(account), dict[int, Single](), account.still()
    while len(closing := account.closing()):
        speeds = account.v[closing]
        fastest = int(closing[speeds.argmin()])
        if counts.has_collapsed(fastest):
            still = account.still()
            continue
        own = counts.cluster[fastest]
        rows = [k for k in closing[speeds <= (1.0 - TOGETHER) * speeds.min()].tolist() if counts.cluster[k] == own]
        slow = still[np.abs(account.v[still]) <= account.allowed[still]] if len(still) else still
        held = [k for k in slow.tolist() if counts.cluster[k] == own]
        for island in counts.islands(rows, held):
            _strike(account, island, known)
    # What struck in turn until it closed by less than counts has no last impact: speeds of closing and of slip shrink
    # together, and none is left in the limit. It strikes at once, without bouncing.
    v = account.v
    left = [k for k in account.not_separating().tolist() if counts.number(k) > 1]
    for first in {int(counts.cluster[k]) for k in left if v[k] < -account.rounding[k]}:
        rows = [k for k in left if counts.cluster[k] == first]
        bounces = account.restitution
        account.restitution = np.zeros(len(bounces))
        poisson(account, rows)
        account.restitution = bounces


def _strike(account: ImpactProgress, rows: Sequence[int], known: dict[int, Single]) -> None:
    """Strike rows by the law that is asked for, and let friction be given back; `known` rows have struck before."""
    before = account.copy() if account.problem.gives_back else None
    single = None
    if len(rows) == 1:
        single = known[rows[0]] = known.get(rows[0]) or Single(account, rows[0])
    if single is not None and single.followed:
        routh(account, single)
    elif account.problem.law == "newton" or (account.problem.law == "stronge" and not _rubs(account, rows)):
        newton(account, rows)
    else:
        names = ", ".join(account.problem.name(k) for k in sorted(rows))
        if len(rows) == 1:
            account.note(f"{names}: several things rub, in space: their slip is that at the ends of both phases")
        elif account.problem.law == "stronge":
            account.note(f"{names} strike together, which Stronge's law does not tell with friction: by Poisson's")
        poisson(account, rows)
    if before is not None:
        give_back(account, rows, before)


def _rubs(account: ImpactProgress, rows: Sequence[int]) -> bool:
    """Return whether anything rubs that these rows press, or that is always pressed."""
    rough = [part for part in account.rows.parts if part.enough or part.static or part.kinetic]
    one_way = set(account.unilateral.tolist())
    return any(set(part.normals) <= set(rows) or not set(part.normals) & one_way for part in rough)


def clusters(rows: LawProblem) -> list[int]:
    """Return for each row the number of its cluster: rows push each other there, over any others."""
    return _numbers(_near(rows))


def _numbers(near: Flags) -> list[int]:
    found = {k: group[0] for group in connected_groups(near) for k in group}
    return [found[k] for k in range(len(near))]


def _near(rows: LawProblem) -> Flags:
    """Return which rows push each other (m, m)."""
    A, C = scaled_rows(rows.matrix)[1], scaled_rows(rows.exerted)[1]
    K = np.abs(A @ C.T) + np.abs(rows.coupling)
    near = K > CONNECTED
    for part in rows.parts:
        near[np.ix_([*part.rows, *part.normals], [*part.rows, *part.normals])] = True
    return near


# ----------------------------------------------------------------------------------------------------------------------

def strike(problem: ImpactProblem) -> ImpactResult:
    """Return what an impact does; where nothing closes and nothing is wanted, `phases` is empty.

    What holds both ways takes its wanted speeds first; then unilateral rows that close strike, at once with those that
    touch and do not separate, or one by one. One that separates takes no part, but if it closes afterwards, that is a
    new impact from there. A gain of energy, which Newton's law with friction may make, is told (`gained`), not refused.
    Raises NoSolutionError where the laws have no solution, or numbers are not finite, InputError for a coefficient that
    is not between 0 and 1, and for Stronge's law where several contacts close at once.
    """
    numbers = (problem.rows.matrix, problem.rows.exerted, problem.rows.coupling, problem.rows.right)
    if not all(np.isfinite(values).all() for values in numbers):
        raise NoSolutionError(
            "numbers of what strikes are not finite: a direction has no value, or a mass is zero", number="N105"
        )
    e = np.concatenate([np.asarray(problem.restitution, dtype=float), np.array(problem.tangential, dtype=float)])
    wrong = e[~((e >= 0.0) & (e <= 1.0))]
    if len(wrong):
        raise InputError(f"a coefficient of restitution is between 0 and 1, not {wrong[0]:g}", number="M121")
    account = start_impact(problem)
    if account.unfulfilled():
        _find_impulses(account, (), "joined")
    if problem.sequence == "simultaneous":
        at_once(account)
    else:
        one_by_one(account)
    account.unsure |= set(dependent_rows(problem.rows)) if account.phases else set()
    return account.result()


# ----------------------------------------------------------------------------------------------------------------------
# Impulses of many contacts at once, by sweeps over them: each obeys its own law beside the impulses of all others.
#
#     v = w + A x,   x = A^T z;   0 <= z_n, 0 <= v_n, z_n v_n = 0;   |z_t| <= mu z_n, against v_t where that is not zero
#
# w (m) are the speeds without these impulses, normal ones less the least that is allowed; A is that of an
# `ImpactProblem`. This is the projected Gauss-Seidel iteration of non-smooth contact dynamics (M. Jean, Comput. Methods
# Appl. Mech. Engrg. 177 (1999) 235-257). `templates/c/sweeps.c` gives the same bits.


Numbers = NDArray[np.intc]


@dataclass(frozen=True, eq=False)
class ContactRows:
    """Rows of contacts, A (m, n): first their normals, then those in which friction parts rub.

    Row j has the elements `matrix` from number `begins[j]` up to `begins[j + 1]`, each in its column of `places`, of
    `width` columns. Part k rubs in the rows from `rubs[k]` up to `rubs[k + 1]`, the first of which follows the normals,
    and is pressed by the normal `presses[k]`.
    """

    begins: Numbers
    places: Numbers
    matrix: Floats
    rubs: Numbers
    presses: Numbers
    width: int

    @property
    def normals(self) -> int:
        """The number of normals."""
        return int(self.rubs[0])

    @cached_property
    def squares(self) -> Floats:
        """The squares of the lengths of rows (m,): how a unit impulse changes the speed along its own row."""
        return self._sums(self.matrix * self.matrix)

    def times(self, x: Floats) -> Floats:
        """Return A x (m,)."""
        return self._sums(self.matrix * x[self.places])

    def transposed_times(self, z: Floats) -> Floats:
        """Return A^T z (n,)."""
        each = np.repeat(z, np.diff(self.begins))
        return np.bincount(self.places, self.matrix * each, minlength=self.width).astype(float)

    def _sums(self, values: Floats) -> Floats:
        counts = np.diff(self.begins)
        rows = np.repeat(np.arange(len(counts)), counts)
        return np.bincount(rows, values, minlength=len(counts)).astype(float)

    @cached_property
    def without_friction(self) -> ContactRows:
        """The normals alone."""
        count, end = self.normals, int(self.begins[self.normals])
        none, begins = np.zeros(0, dtype=np.intc), self.begins[: count + 1].copy()
        rubs = np.array([count], dtype=np.intc)
        return ContactRows(begins, self.places[:end].copy(), self.matrix[:end].copy(), rubs, none, self.width)


RELAXED: Final = 1.5
"""By how much more than is due normal impulses are changed: heaps settle in a third of the sweeps."""


def sweep(
    rows: ContactRows, speeds: Floats, coefficients: Floats, impulses: tuple[Floats, Floats], settled: float, most: int
) -> int:
    """Bring `impulses` z (m), and x = A^T z (n), near the laws, at speeds w (m); return how many sweeps that took.

    `coefficients` are those of friction parts. It ends after `most` sweeps, or once none changes anything by more than
    `settled`: impulses times the lengths of their rows, the root of twice an energy.
    """
    normals, parts, squares = rows.normals, len(rows.presses), rows.squares.tolist()
    begins, places, matrix = rows.begins.tolist(), rows.places.tolist(), rows.matrix.tolist()
    rubs, presses, mu = rows.rubs.tolist(), rows.presses.tolist(), coefficients.tolist()
    w, (z, now) = speeds.tolist(), (each.tolist() for each in impulses)
    spans = [range(begins[j], begins[j + 1]) for j in range(len(w))]

    def speed(j: int) -> float:
        v: float = w[j]
        for k in spans[j]:
            v += matrix[k] * now[places[k]]
        return v

    def change(j: int, impulse: float) -> float:
        more = impulse - z[j]
        z[j] = impulse
        if more != 0.0:
            for k in spans[j]:
                now[places[k]] += matrix[k] * more
        moved: float = abs(more) * math.sqrt(squares[j])
        return moved

    done = 0
    while done < most:
        done, largest = done + 1, 0.0
        for j in range(normals):
            if squares[j] > 0.0:
                wanted = z[j] - RELAXED * speed(j) / squares[j]
                largest = max(largest, change(j, wanted if wanted > 0.0 else 0.0))
        for part in range(parts):
            own = range(rubs[part], rubs[part + 1])
            largest = max(largest, _rub(own, squares, mu[part] * z[presses[part]], z, speed, change))
        if largest <= settled:
            break
    impulses[0][:], impulses[1][:] = z, now
    return done


def _rub(
    own: range,
    squares: Sequence[float],
    limit: float,
    z: Sequence[float],
    speed: Callable[[int], float],
    change: Callable[[int, float], float],
) -> float:
    """Let a part stick where its impulses stay within a limit, else slip; return the largest change."""
    stiff = 0.0
    for j in own:
        stiff += squares[j]
    if not stiff > 0.0:
        return 0.0
    wanted, square = [z[j] - speed(j) / stiff for j in own], 0.0
    for each in wanted:
        square += each * each
    size = math.sqrt(square)
    part = limit / size if size > limit else 1.0
    return max(change(j, part * each) for j, each in zip(own, wanted, strict=True))
