"""What an impact does: the door."""

from __future__ import annotations

import numpy as np

from multibody_sym.dynamics.impacts.account import begun
from multibody_sym.dynamics.impacts.elimination import dependent
from multibody_sym.dynamics.impacts.problem import ImpactProblem, Struck
from multibody_sym.dynamics.impacts.sequence import at_once, one_by_one
from multibody_sym.dynamics.impacts.together import joined
from multibody_sym.errors import InputError, NoSolutionError


def strike(problem: ImpactProblem) -> Struck:
    """Return what an impact does; where nothing closes and nothing is wanted, `phases` is empty.

    What holds both ways takes its wanted speeds first; then unilateral rows that close strike, at once with those that
    touch and do not separate, or one by one. One that separates takes no part, but if it closes afterwards, that is a
    new impact from there. A gain of energy, which Newton's law with friction may make, is told (`gained`), not refused.
    Raises NoSolutionError where the laws have no solution, or numbers are not finite, InputError for a coefficient that
    is not between 0 and 1, and for Stronge's law where several contacts close at once.
    """
    _verify(problem)
    account = begun(problem)
    joined(account)
    if problem.sequence == "simultaneous":
        at_once(account)
    else:
        one_by_one(account)
    account.unsure |= set(dependent(problem.rows)) if account.phases else set()
    return account.told()


def _verify(problem: ImpactProblem) -> None:
    numbers = (problem.rows.matrix, problem.rows.exerted, problem.rows.coupling, problem.rows.right)
    if not all(np.isfinite(values).all() for values in numbers):
        raise NoSolutionError(
            "numbers of what strikes are not finite: a direction has no value, or a mass is zero", number="N105"
        )
    e = np.concatenate([np.asarray(problem.restitution, dtype=float), np.array(problem.tangential, dtype=float)])
    if not ((e >= 0.0).all() and (e <= 1.0).all()):
        raise InputError(
            f"a coefficient of restitution is between 0 and 1, not {e[~((e >= 0.0) & (e <= 1.0))][0]:g}", number="M121"
        )
