"""What an impact does: the door."""

from __future__ import annotations

import numpy as np

from multibody_sym.dynamics.impacts.account import Account, begun
from multibody_sym.dynamics.impacts.problem import ImpactProblem, Struck
from multibody_sym.dynamics.impacts.together import joined, newton
from multibody_sym.errors import NoSolutionError


def strike(problem: ImpactProblem) -> Struck:
    """Return what an impact does.

    What holds both ways takes its wanted speeds first; then unilateral rows that close strike, with those that touch.
    One that separates takes no part, but if it closes afterwards, that is a new impact from there.
    Raises NoSolutionError where the laws have no solution, and for numbers that are not finite.
    """
    _verify(problem)
    account = begun(problem)
    joined(account)
    _at_once(account)
    return account.told()


def _at_once(account: Account) -> None:
    while account.closing():
        account.impacts += 1
        newton(account, account.touching())


def _verify(problem: ImpactProblem) -> None:
    e = np.asarray(problem.restitution, dtype=float)
    if not (np.isfinite(e).all() and (e >= 0.0).all() and (e <= 1.0).all()):
        raise NoSolutionError("a coefficient of restitution is between 0 and 1")
