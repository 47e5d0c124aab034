"""What a caller hands over as numbers: real ones, as arrays of floats."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.errors import ArgumentError, InputError, short_repr
from multibody_sym.scalars.arrays import Floats

_REAL: Final = "fiub"
_OBJECTS: Final = "O"
LARGEST: Final = 1e150
"""The largest number whose square is finite, about."""


def floats(name: str, given: Any) -> Floats:
    """Return an argument as an array of floats; raises ArgumentError for text, complex numbers and what is no number.

    NumPy alone would read text, and drop imaginary parts and masks.
    """
    if isinstance(given, np.ndarray):
        if type(given) is not np.ndarray and np.ma.is_masked(given):
            raise ArgumentError(f"{name} has masked elements, which have no number: leave them out, or give filled(..)")
        if given.dtype == np.float64:
            return np.asarray(given)
    try:
        found = np.asarray(given)
        if found.dtype.kind in _REAL:
            return found.astype(float)
        if found.dtype.kind == _OBJECTS and not any(isinstance(x, (str, bytes, complex)) for x in found.flat):
            return np.array([float(x) for x in found.flat]).reshape(found.shape)
    except (TypeError, ValueError, ArithmeticError):
        pass
    raise ArgumentError(f"{name} is to be real numbers, got {_describe(given)}")


def complexes(name: str, given: Any) -> npt.NDArray[np.complex128]:
    """Return an argument as an array of complex numbers; raises ArgumentError for what is no number."""
    try:
        found = np.asarray(given)
        if found.dtype.kind in _REAL + "c":
            return found.astype(complex)
    except (TypeError, ValueError, ArithmeticError):
        pass
    raise ArgumentError(f"{name} is to be numbers, real or complex, got {short_repr(given)}")


def number(name: str, given: Any) -> float:
    """Return an argument as a float; raises ArgumentError."""
    if type(given) is float:
        return given
    found = floats(name, given)
    if found.ndim:
        raise ArgumentError(f"{name} is to be one of the real numbers, got an array of shape {found.shape}")
    return float(found)


def vector(name: str, given: Any, size: int) -> Floats:
    """Return an argument as a vector of a size; raises InputError."""
    values = floats(name, given)
    if values.shape != (size,):
        raise InputError(f"{name} has the shape {values.shape}, not ({size},)")
    return values


def verify_finite(name: str, values: Floats) -> None:
    """Raise InputError where a value is not finite, or so large that its square is not."""
    if not np.isfinite(values).all():
        raise InputError(f"{name} is to be finite, got {short_repr(values.tolist())}")
    if (np.abs(values) > LARGEST).any():
        message = f"{name} is too large to compute with, got {short_repr(values.tolist())}: at most {LARGEST:g}"
        raise InputError(message, number="M119")


def _describe(given: Any) -> str:
    try:
        return "complex ones" if np.asarray(given).dtype.kind == "c" else short_repr(given)
    except (TypeError, ValueError):
        return short_repr(given)
