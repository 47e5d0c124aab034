"""Linear equations over exact quotients, by elimination with pivots that do not vanish at the sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient
from multibody_sym.records import dataclass

_PIVOT: Final = 1e-8
"""The part of an equation's largest coefficient below which another one may be what vanishes at a double's sample."""


@dataclass
class _Equation:
    """sum coefficients[k] x_k = right, zero coefficients left out."""

    coefficients: dict[int, Quotient]
    right: Quotient

    def __post_init__(self) -> None:
        self.size: Any = max((abs(a.sample) for a in self.coefficients.values()), default=0)
        """The largest size of a coefficient at the sample, as the equation was given."""


def exact_solve(matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient]) -> list[Quotient]:
    """Return x with matrix x = right; unknowns that dependent equations leave open are 0.

    No equations have no unknowns. Raises NoClosedFormError where equations contradict, or depend on each other at the
    sample only.
    """
    done, waiting = _eliminated(matrix, right)
    if any(equation.coefficients or not equation.right.is_zero for equation in waiting):
        raise NoClosedFormError("at the given values the equations depend on each other, which they do not in general")
    return _back_substituted(done, [right[0].field.constant(0)] * len(matrix[0]) if matrix else [])


def conditions_left(matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient]) -> list[Quotient]:
    """Return what must vanish for there to be an x with matrix x = right, where it nearly vanishes at the sample.

    Raises NoClosedFormError where equations depend on each other at the sample only.
    """
    waiting = _eliminated(matrix, right, _PIVOT)[1]
    if any(equation.coefficients for equation in waiting):
        raise NoClosedFormError("at the given values the equations depend on each other, which they do not in general")
    return [equation.right for equation in waiting if not equation.right.is_zero]


def _eliminated(
    matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient], least: float = 0.0
) -> tuple[list[tuple[int, _Equation]], list[_Equation]]:
    """Return the equations that give an unknown each, and those that are left over.

    No pivot is less than the part `least` of the largest entry of its equation.
    """
    waiting = [
        _Equation({k: a for k, a in enumerate(row) if not a.is_zero}, r) for row, r in zip(matrix, right, strict=True)
    ]
    done: list[tuple[int, _Equation]] = []
    while (found := _pivot(waiting, least)) is not None:
        equation, k = found
        waiting.remove(equation)
        for other in waiting:
            if k in other.coefficients:
                _eliminate(other, equation, k)
        done.append((k, equation))
    return done, waiting


def _pivot(waiting: Sequence[_Equation], least: float) -> tuple[_Equation, int] | None:
    """Return the entry that fills in least (Markowitz), among equals the shortest."""
    uses: dict[int, int] = {}
    for equation in waiting:
        for k in equation.coefficients:
            uses[k] = uses.get(k, 0) + 1
    entries = [
        (a.size > 2, (len(equation.coefficients) - 1) * (uses[k] - 1), a.size, i, k)
        for i, equation in enumerate(waiting)
        for k, a in equation.coefficients.items()
        if not a.vanishes and abs(a.sample) >= least * equation.size
    ]
    if not entries:
        return None
    _, _, _, i, k = min(entries)
    return waiting[i], k


def _eliminate(equation: _Equation, pivot: _Equation, k: int) -> None:
    factor = equation.coefficients.pop(k) / pivot.coefficients[k]
    for j, a in pivot.coefficients.items():
        if j == k:
            continue
        changed = equation.coefficients[j] - factor * a if j in equation.coefficients else -(factor * a)
        if changed.is_zero:
            equation.coefficients.pop(j, None)
        else:
            equation.coefficients[j] = changed
    equation.right = equation.right - factor * pivot.right


def _back_substituted(done: list[tuple[int, _Equation]], x: list[Quotient]) -> list[Quotient]:
    for k, equation in reversed(done):
        rest = equation.right
        for j, a in equation.coefficients.items():
            if j != k:
                rest = rest - a * x[j]
        x[k] = rest / equation.coefficients[k]
    return x
