"""Linear equations over exact quotients, by elimination with pivots that do not vanish at the sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from multibody_sym.algebra.quotients import NoClosedFormError, Quotient


@dataclass
class _Equation:
    """sum coefficients[k] x_k = right, zero coefficients left out."""

    coefficients: dict[int, Quotient]
    right: Quotient


def exact_solve(matrix: Sequence[Sequence[Quotient]], right: Sequence[Quotient]) -> list[Quotient]:
    """Return x with matrix x = right; unknowns that dependent equations leave open are 0.

    Raises NoClosedFormError where equations contradict, or depend on each other at the sample only.
    """
    waiting = [
        _Equation({k: a for k, a in enumerate(row) if not a.is_zero}, r) for row, r in zip(matrix, right, strict=True)
    ]
    done: list[tuple[int, _Equation]] = []
    while (found := _pivot(waiting)) is not None:
        equation, k = found
        waiting.remove(equation)
        for other in waiting:
            if k in other.coefficients:
                _eliminate(other, equation, k)
        done.append((k, equation))
    if any(equation.coefficients or not equation.right.is_zero for equation in waiting):
        raise NoClosedFormError("at the given values the equations depend on each other, which they do not in general")
    return _back_substituted(done, [right[0].field.constant(0)] * len(matrix[0]))


def _pivot(waiting: Sequence[_Equation]) -> tuple[_Equation, int] | None:
    """Return the entry that fills in least (Markowitz), among equals the shortest."""
    uses: dict[int, int] = {}
    for equation in waiting:
        for k in equation.coefficients:
            uses[k] = uses.get(k, 0) + 1
    entries = [
        (a.size > 2, (len(equation.coefficients) - 1) * (uses[k] - 1), a.size, i, k)
        for i, equation in enumerate(waiting)
        for k, a in equation.coefficients.items()
        if not a.vanishes
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
