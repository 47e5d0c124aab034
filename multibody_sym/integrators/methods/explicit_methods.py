"""The explicit Runge-Kutta methods; `EXPLICIT` makes each of them by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from types import MappingProxyType
from typing import Final

from multibody_sym.integrators.methods.runge_kutta import RungeKutta, Weights


def hermite(b: Sequence[Fraction]) -> tuple[Weights, ...]:
    """Return the cubic Hermite interpolant of x and f at both ends as an extension of weights `b` (end included).

    b_i(theta) = theta^2 (3 - 2 theta) b_i, plus theta (1 - theta)^2 for the first and theta^2 (theta - 1) for the
    last stage: order 3, or that of b if lower.
    """
    zero, one = Fraction(0), Fraction(1)
    rows = [[zero, 3 * x, -2 * x] for x in b]
    rows[0] = [r + e for r, e in zip(rows[0], (one, -2 * one, one), strict=True)]
    rows[-1] = [r + e for r, e in zip(rows[-1], (zero, -one, one), strict=True)]
    return tuple(map(tuple, rows))


def _quartic(b: Sequence[Fraction], d: Sequence[Fraction]) -> tuple[Weights, ...]:
    """Return the Hermite extension of `b` plus theta^2 (1 - theta)^2 d_i."""
    return tuple((linear, square + x, cube - 2 * x, x) for (linear, square, cube), x in zip(hermite(b), d, strict=True))


def _row(text: str) -> Weights:
    return tuple(map(Fraction, text.split()))


def _method(name: str, order: int, A: str, b_hat: str = "", error_order: int = 0) -> RungeKutta:
    """Return a method from the rows of `A` after the first (empty) one, separated by `;`, with Hermite extension."""
    rows = ((), *map(_row, A.split(";")))
    b = (*rows[-1], Fraction(0))
    return RungeKutta(
        name=name,
        A=rows,
        c=tuple(sum(row, Fraction(0)) for row in rows),
        order=order,
        dense=hermite(b),
        dense_order=min(order, 3),
        error=tuple(x - y for x, y in zip(b, _row(b_hat), strict=True)) if b_hat else None,
        error_order=error_order,
    )


def _dormand_prince() -> RungeKutta:
    """Return the 5(4) pair of J. R. Dormand and P. J. Prince (J. Comput. Appl. Math. 6, 1980), extended with order 4.

    The extensions of order 4 that share x and f with the step at both ends form one family, in the last number of
    d; taken is the member whose fifth-order error coefficients have the least mean square over the step. It is the
    one L. F. Shampine chose (Math. Comp. 46, 1986).
    """
    rows = (
        (),
        _row("1/5"),
        _row("3/40 9/40"),
        _row("44/45 -56/15 32/9"),
        _row("19372/6561 -25360/2187 64448/6561 -212/729"),
        _row("9017/3168 -355/33 46732/5247 49/176 -5103/18656"),
        _row("35/384 0 500/1113 125/192 -2187/6784 11/84"),
    )
    b = (*rows[-1], Fraction(0))
    b_hat = _row("5179/57600 0 7571/16695 393/640 -92097/339200 187/2100 1/40")
    d = _row(
        "-12715105075/11282082432 0 87487479700/32700410799 -10690763975/1880347072"
        " 701980252875/199316789632 -1453857185/822651844 69997945/29380423"
    )
    return RungeKutta(
        name="dormand_prince",
        A=rows,
        c=_row("0 1/5 3/10 4/5 8/9 1 1"),
        order=5,
        dense=_quartic(b, d),
        dense_order=4,
        error=tuple(x - y for x, y in zip(b, b_hat, strict=True)),
        error_order=4,
    )


def _dormand_prince_8() -> RungeKutta:
    from multibody_sym.integrators.methods.dormand_prince_8 import dormand_prince_8

    return dormand_prince_8()


EXPLICIT: Final[Mapping[str, Callable[[], RungeKutta]]] = MappingProxyType(
    {
        "explicit_euler": lambda: _method("explicit_euler", 1, "1"),
        "midpoint": lambda: _method("midpoint", 2, "1/2; 0 1"),
        "heun": lambda: _method("heun", 2, "1; 1/2 1/2"),
        "rk4": lambda: _method("rk4", 4, "1/2; 0 1/2; 0 0 1; 1/6 1/3 1/3 1/6"),
        "bogacki_shampine": lambda: _method(
            "bogacki_shampine", 3, "1/2; 0 3/4; 2/9 1/3 4/9", "7/24 1/4 1/3 1/8", 2
        ),
        "dormand_prince": _dormand_prince,
        "dormand_prince_8": _dormand_prince_8,
    }
)
