"""Arithmetic on floats as C performs it, and values between the rows of tables.

The text of this file stands in exported Python, and imports the standard library only: NumPy would slow down `--help`.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from typing import Any, Final

# ----------------------------------------------------------------------------------------------------------------------
# Operations as C performs them: infinities and nan where Python's own would raise.


def divide(a: float, b: float) -> float:
    """Return a / b."""
    try:
        return a / b
    except ZeroDivisionError:
        return a * math.copysign(math.inf, b)


def power(x: float, n: int) -> float:
    """Return x^n, n >= 1, as the product of those of x, x^2, x^4, x^8 ... that make it up."""
    result = x if n & 1 else 1.0
    n >>= 1
    while n:
        x *= x
        if n & 1:
            result *= x
        n >>= 1
    return result


def pow(a: float, b: float) -> float:
    """Return a^b for any b."""
    try:
        return math.pow(a, b)
    except OverflowError:
        return -math.inf if a < 0.0 and abs(b) % 2.0 == 1.0 else math.inf
    except ValueError:
        if a != 0.0:
            return math.nan
        return math.copysign(math.inf, a) if abs(b) % 2.0 == 1.0 else math.inf


def log(a: float) -> float:
    """Return the natural logarithm of a."""
    if a == 0.0:
        return -math.inf
    return math.log(a) if a > 0.0 else math.nan


def exp(a: float) -> float:
    """Return e^a."""
    try:
        return math.exp(a)
    except OverflowError:
        return math.inf


def sinh(a: float) -> float:
    """Return the hyperbolic sine of a."""
    try:
        return math.sinh(a)
    except OverflowError:
        return math.copysign(math.inf, a)


def cosh(a: float) -> float:
    """Return the hyperbolic cosine of a."""
    try:
        return math.cosh(a)
    except OverflowError:
        return math.inf


def atanh(a: float) -> float:
    """Return the inverse hyperbolic tangent of a."""
    try:
        return math.atanh(a)
    except ValueError:
        return math.copysign(math.inf, a) if abs(a) == 1.0 else math.nan


def sign(a: float) -> float:
    """Return -1, 0 or 1."""
    return float((a > 0.0) - (a < 0.0))


def _nan_outside(function: Callable[[float], float]) -> Callable[[float], float]:
    def total(a: float) -> float:
        try:
            return function(a)
        except ValueError:
            return math.nan

    return total


sqrt: Final = _nan_outside(math.sqrt)
sin: Final = _nan_outside(math.sin)
cos: Final = _nan_outside(math.cos)
tan: Final = _nan_outside(math.tan)
asin: Final = _nan_outside(math.asin)
acos: Final = _nan_outside(math.acos)
acosh: Final = _nan_outside(math.acosh)


# ----------------------------------------------------------------------------------------------------------------------
# The values between the rows of a table: straight lines, a natural cubic spline, the distance from a knot.
#
# Beyond the rows a line and a spline keep their last value. `order` is that of the derivative by the argument.
# Generated C does the same operations in the same order.


def line(order: int, d: Any, h: Any, y0: Any, y1: Any) -> Any:
    """Return the line from y0 to y1 (h further on) at the distance d from y0."""
    if order == 0:
        return y0 + (y1 - y0) / h * d
    return (y1 - y0) / h if order == 1 else 0.0


def cubic(order: int, d: Any, h: Any, y0: Any, y1: Any, m0: Any, m1: Any) -> Any:
    """Return the polynomial of degree 3 with these values and second derivatives m0, m1 at both ends."""
    c = (m1 - m0) / (6.0 * h)
    if order >= 2:
        return m0 + 6.0 * c * d if order == 2 else 6.0 * c if order == 3 else 0.0
    b = (y1 - y0) / h - h * (2.0 * m0 + m1) / 6.0
    return y0 + d * (b + d * (m0 / 2.0 + d * c)) if order == 0 else b + d * (m0 + 3.0 * d * c)


def on_lines(rows: Sequence[Sequence[float]], order: int, at: float) -> float:
    """Return the value of straight lines between rows; `rows` holds arguments and values."""
    x, y = rows
    k = bisect_right(x, at)
    if 0 < k < len(x):
        return float(line(order, at - x[k - 1], x[k] - x[k - 1], y[k - 1], y[k]))
    return 0.0 if order else y[-1 if k else 0]


def on_spline(rows: Sequence[Sequence[float]], order: int, at: float) -> float:
    """Return the value of a spline; `rows` holds arguments, values and second derivatives."""
    x, y, m = rows
    k = bisect_right(x, at)
    if 0 < k < len(x):
        return float(cubic(order, at - x[k - 1], x[k] - x[k - 1], y[k - 1], y[k], m[k - 1], m[k]))
    return 0.0 if order else y[-1 if k else 0]


def to_knot(rows: Sequence[Sequence[float]], order: int, at: float) -> float:
    """Return the distance from the nearest knot, which changes its sign at each; `rows` holds the knots."""
    (x,) = rows
    k = bisect_right(x, at)
    side = 1.0 if k % 2 else -1.0
    if k == len(x) or (k > 0 and at - x[k - 1] <= x[k] - at):
        return side * (at - x[k - 1] if order == 0 else 1.0)
    return side * (x[k] - at if order == 0 else -1.0)
