"""Numbers of other kinds as Python's own: NumPy's, arrays without dimensions, decimals."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any, Final

from multibody_sym.errors import ExpressionError, shown

_LARGEST_EXPONENT: Final = 400


def unboxed(value: Any) -> Any:
    """Return what an array without dimensions or a number of NumPy's holds, a decimal exactly, all else as it is.

    Raises ExpressionError for a decimal that no float comes near to.
    """
    if isinstance(value, Decimal):
        return _exact(value)
    item = getattr(value, "item", None)
    if not callable(item) or getattr(value, "ndim", None) != 0:
        return value
    held = item()
    return float(held) if type(held) is type(value) and hasattr(held, "is_integer") else held  # a long double


def _exact(value: Decimal) -> Fraction | float:
    if not value.is_finite():
        return math.nan if value.is_nan() else float(value)
    if value and abs(value.adjusted()) > _LARGEST_EXPONENT:  # written out it might fill all memory
        raise ExpressionError(f"{shown(value)} is past what floating-point numbers hold", number="E105")
    return Fraction(value) if value else Fraction(0)
