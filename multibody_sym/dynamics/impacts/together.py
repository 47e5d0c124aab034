"""Several contacts at once: the laws of an instant for speeds, searched like those of accelerations.

Newton: v+ + e v- >= 0 beside p >= 0, |p_t| <= mu p. Poisson, twice: compression, v_n >= 0 beside p >= 0, |p_t| <= mu p;
from there restitution, v_n >= 0 beside p_E - e p_C >= 0, |p_t| <= mu p_E. What p_E has to have already, e p_C, is a row
that defines its multiplier, exerts what the normal does, and presses beside it. Slip is in its directions at the end.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.dynamics.impacts.account import Account, Chosen, NoImpulsesError, chosen
from multibody_sym.dynamics.impacts.elimination import moved_by
from multibody_sym.dynamics.impacts.pace import AT_REST
from multibody_sym.dynamics.impacts.problem import Stage
from multibody_sym.dynamics.impacts.sweeps import settled, turned
from multibody_sym.dynamics.laws.judgement import fulfils
from multibody_sym.dynamics.laws.mode_solve import Trial, solve_mode
from multibody_sym.dynamics.laws.problem import STICKS, Equality, Found, Friction, LawProblem, LawState, Unilateral
from multibody_sym.dynamics.laws.scaled import scaled
from multibody_sym.dynamics.laws.search import find, modes_of
from multibody_sym.dynamics.laws.uniqueness import SEEN, undetermined
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import DRAWN, exact, least_squares, null_space

_CONTRADICT: Final = "the speeds wanted there contradict each other", True


def joined(account: Account) -> None:
    """Let what holds both ways take the speeds that are wanted of it, where they are not there already."""
    if account.unfulfilled():
        _found(account, (), "joined")


def newton(account: Account, closed: Collection[int]) -> None:
    """Strike rows at once by Newton's coefficients: by the smallest where different ones contradict each other.

    In a wedge what separates, though by next to nothing, contradicts what is to bounce: then it takes no part.
    """
    if _newton(account, closed):
        return
    v = account.speeds()
    if _newton(account, [k for k in closed if v[k] <= account.rounding[k]]):
        return
    differ = _take_smallest(account, closed, "no impulses fulfil Newton's law with different coefficients")
    if not (differ and _newton(account, closed)):
        raise _nothing(account, closed)


def poisson(account: Account, closed: Collection[int]) -> None:
    """Strike rows at once by Poisson's coefficients: by the smallest where different ones make energy."""
    kept = account.copy()
    _poisson(account, closed)
    if account.gains_since(kept):
        made = account.lost.sum() - kept.lost.sum()
        if _differ(account, closed):
            account.back_to(kept)
            _take_smallest(account, closed, f"different coefficients would make {-made:.3g} J")
            _poisson(account, closed)


def _differ(account: Account, closed: Collection[int]) -> bool:
    return len(set(account.restitution[list(closed)].tolist())) > 1


def _take_smallest(account: Account, closed: Collection[int], why: str) -> bool:
    """Let rows have the smallest of their coefficients; return whether they differ."""
    if not _differ(account, closed):
        return False
    rows = sorted(closed)
    least = float(account.restitution[rows].min())
    account.restitution[rows] = least
    names = ", ".join(account.problem.name(k) for k in rows)
    account.note(f"{why}: {names} have the smallest one, {least:g}")
    return True


def _newton(account: Account, closed: Collection[int]) -> bool:
    """Strike rows at once; return whether that is possible."""
    wanted, rows, now = np.zeros(len(account.z)), list(closed), account.speeds()
    wanted[rows] = -account.restitution[rows] * np.minimum(now[rows], 0.0)
    z = _search(account, closed, wanted, "at once")
    if z is not None:
        account.compression = account.compression + z / (1.0 + account.restitution)
    return z is not None


def _poisson(account: Account, closed: Collection[int]) -> None:
    z = _search(account, closed, np.zeros(len(account.z)), "compression")
    if z is None:
        if _stopped_at_once(account, closed) and not set(account.closing()).intersection(closed):
            return
        z = _found(account, closed, "compression")
    given = {k: float(account.restitution[k] * z[k]) for k in closed}
    given = {k: value for k, value in given.items() if value > 0.0}
    if not given:
        return
    if account.unsure.intersection(given) and (_differ(account, closed) or chosen(account.rows, closed).parts):
        names = ", ".join(account.problem.name(k) for k in sorted(account.unsure.intersection(given)))
        account.note(f"impulses of compression at {names} are not unique; restitution follows the most even ones")
    _found(account, closed, "restitution", given)


def _stopped_at_once(account: Account, closed: Collection[int]) -> bool:
    """Stop slip where friction is always enough, before anything presses; return whether there was any.

    So it is with one contact alone. Where that pushes contacts apart, friction has nothing that presses beside it.
    """
    some, v = chosen(account.rows, closed), account.speeds()
    rubs = [k for k, law in enumerate(some.problem.laws) if isinstance(law, Friction)]
    moved = moved_by(some, rubs)
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


def _found(account: Account, closed: Collection[int], stage: Stage, given: Mapping[int, float] | None = None) -> Floats:
    """Add and return the impulses (m) after which all laws hold. Raises NoSolutionError where there are none.

    What friction without bound would have to pull in to hold slips, as in the limit of large coefficients.
    """
    z = _search(account, closed, np.zeros(len(account.z)), stage, given)
    if z is None:
        z = _search(account, closed, np.zeros(len(account.z)), stage, given, slips=True)
    if z is None:
        raise _nothing(account, closed)
    return z


def _search(
    account: Account,
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
    some = chosen(account.rows, closed)
    if slips:
        some = replace(some, problem=_slipping(some.problem))
    now = account.speeds()
    here = {some.rows.index(k): value for k, value in given.items()}
    right = _consistent(account, some, (wanted - now)[some.rows])
    problem = _with_given(replace(some.problem, right=right), here)
    found, count = _states(problem, account.problem.most), len(some.rows)
    if not found.states:
        account.nothing = _CONTRADICT if _contradict(problem) else (found.searched, found.proved)
        return None
    state = found.states[0]
    shared, unsure = _shared(problem, state)
    z = np.zeros(len(now))
    z[some.rows] = shared[:count]
    for row, value in given.items():
        z[row] += value
    sides = zip(some.rows, state.mode.sides[:count], strict=True)
    pressed = [k for k, side in sides if k in closed and (side or k in given)]
    z = account.add(stage, pressed, some.of_all(state.mode.slips, account.rows), (z, state.x))
    account.unsure |= {some.rows[k] for k in unsure if k < count}
    return z


def _states(problem: LawProblem, most: int) -> Found:
    """Return what is found that fulfils the laws: near where sweeps come to, or among all modes if they are no more."""
    found = find(problem, every=False, most=0)
    if found.states:
        return found
    mode = settled(problem)
    found = find(problem, mode, every=False, most=0)
    if not found.states and most:
        found = find(problem, every=False, most=most)
    if not found.states and most and (other := turned(problem, mode)) is not None:
        found = find(problem, other, every=False)
    return found


def _slipping(problem: LawProblem) -> LawProblem:
    """Return the problem in which friction that is pressed from one side holds no more than its coefficient says."""
    one_way = [all(isinstance(problem.laws[k], Unilateral) for k in part.normals) for part in problem.parts]
    parts = zip(problem.parts, one_way, strict=True)
    return replace(problem, parts=tuple(replace(part, held=part.held and not free) for part, free in parts))


def _contradict(problem: LawProblem) -> bool:
    """Return whether what holds both ways wants speeds that no motion has, whatever else acts."""
    both = [k for k, law in enumerate(problem.laws) if isinstance(law, Equality) and not problem.coupling[k].any()]
    matrix, right = problem.matrix[both], problem.right[both]
    missed = matrix @ least_squares(matrix, right, exact(matrix)) - right
    return bool((np.abs(missed) > AT_REST * np.abs(right).max(initial=0.0)).any())


def _consistent(account: Account, some: Chosen, right: Floats) -> Floats:
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


def _shared(problem: LawProblem, state: LawState) -> tuple[Floats, list[int]]:
    """Return the impulses (m) for the same speeds that are shared most evenly, and the rows that may have others.

    Those of least length, forces at unit length, where they fulfil the laws; what holds both ways keeps its own.
    """
    system = scaled(problem)
    mu = [p.kinetic if p.number in state.kinetic else p.static for p in system.parts]
    trial = solve_mode(system, modes_of(system, state.mode), np.array(mu, dtype=float).reshape(len(mu)))
    here = replace(trial, x=state.x, z=state.z * system.sizes, a=state.a / system.lengths)
    unsure = np.flatnonzero(undetermined(system, trial, here)[0])
    if len(unsure):
        idle = trial.forces @ trial.idle @ _unmoved(trial)
        equal = [k for k, law in enumerate(problem.laws) if isinstance(law, Equality)]
        free = idle @ null_space(idle[equal], DRAWN)
        even = replace(here, z=here.z - free @ least_squares(free, here.z))
        if fulfils(system, even):
            here = even
    return here.z / system.sizes, [int(k) for k in unsure]


def _unmoved(trial: Trial) -> Floats:
    """Return combinations (j, k) of impulses that no equation sees that change no speed: what slides may be pushed."""
    pushed = float(np.linalg.norm(trial.moved)) > SEEN * float(np.linalg.norm(trial.forces @ trial.idle))
    return null_space(trial.moved, DRAWN) if pushed else np.eye(trial.idle.shape[1])


def _nothing(account: Account, closed: Collection[int]) -> NoSolutionError:
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
