"""Floating-point operations as C performs them: infinities and nan where Python's own would raise.

The text of this file stands in exported Python, and imports the standard library only.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final


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
