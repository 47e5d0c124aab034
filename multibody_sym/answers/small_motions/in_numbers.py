"""Small motions in numbers: what eigenvalues and eigenvectors tell, and whether formulas give the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.linearization import Linearization
from multibody_sym.answers.small_motions.record import Mode
from multibody_sym.expressions.values import Value
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_directions

_AGREEMENT: Final = 1e-7
"""How near a root must come to the square of an eigenvalue, of which rounding takes more where two of them meet."""
_REST: Final = 1e-11
_STILL: Final = 1e-9
_APART: Final = 100.0
"""Eigenvalues at least this many errors apart count as different."""

Vector = npt.NDArray[np.complex128]


def agrees(squares: Sequence[complex], eigenvalues: Sequence[complex]) -> bool:
    """Return whether each omega^2 has an eigenvalue with lambda^2 = -omega^2."""
    found = [-(x * x) for x in eigenvalues]
    size = max((abs(x) for x in squares), default=0.0)
    return all(
        min((abs(x - y) for y in found), default=math.inf) <= _AGREEMENT * abs(x) + _REST * size for x in squares
    )


def undamped_eigenvalues(M: Floats, G: Floats, K: Floats) -> list[complex]:
    """Return the eigenvalues of M x'' + G x' + K x = 0."""
    size = len(M)
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ K, -inverse @ G]])
    return [complex(x) for x in np.linalg.eigvals(A)]


def shapes_in_numbers(M: Floats, G: Floats, K: Floats, square: complex, times: int) -> list[Vector]:
    """Return the vectors v of the motions v exp(i omega t), as many as omega is a root, each with 1 as its first part.

    Of several none has the first part of another.
    """
    rate = 1j * np.sqrt(complex(square))
    found = least_directions(K + rate * G + rate * rate * M, times)
    for k in range(times):
        lead = int(np.argmax((np.abs(found[k:]) > _STILL).any(axis=0)))
        first = k + int(np.argmax(np.abs(found[k:, lead])))
        found[[k, first]] = found[[first, k]]
        found[k] = found[k] / found[k, lead]
        others = [j for j in range(times) if j != k]
        found[others] = found[others] - np.outer(found[others, lead], found[k])
    return [scaled(v) for v in found]


def scaled(v: Vector) -> Vector:
    """Return a vector with 1 as the first of its parts that does not vanish, without what is rounding."""
    size = np.abs(v).max(initial=0.0)
    first = next((x for x in v if abs(x) > _STILL * size), None)
    found = v if first is None else v / first
    large = np.abs(found).max(initial=0.0)
    real = np.where(np.abs(found.real) <= _STILL * large, 0.0, found.real)
    imaginary = np.where(np.abs(found.imag) <= _STILL * large, 0.0, found.imag)
    return np.asarray(real + 1j * imaginary)


def modes_in_numbers(linear: Linearization, names: Sequence[str]) -> tuple[Mode, ...]:
    """Return the modes that eigenvalues and eigenvectors tell, deviations by `names`, those that oscillate first."""
    if not linear.steady or not len(linear.A):
        return ()
    values, vectors = np.linalg.eig(linear.A)
    clean = [int(np.argmin(np.abs(linear.eigenvalues - x))) for x in values]
    places = {name: k for k, name in enumerate(linear.states) if name in names}
    found = []
    for k, vector in zip(clean, vectors.T, strict=True):
        value, error = complex(linear.eigenvalues[k]), float(linear.eigenvalue_errors[k])
        if value.imag < 0.0:
            continue
        amplitudes = scaled(vector[list(places.values())])
        turned = _turned(linear, k) * float(np.abs(amplitudes).max(initial=0.0))
        found.append((value, _mode(value, error, dict(zip(places, amplitudes, strict=True)), turned)))
    found.sort(key=lambda pair: (pair[0].imag == 0.0, pair[0].imag, -pair[0].real))
    return tuple(mode for _, mode in found)


def _turned(linear: Linearization, k: int) -> float:
    """Return by how much (rad) rounding turns an eigenvector: more where others have almost its eigenvalue.

    Of those that cannot be told apart every combination is a mode.
    """
    error, apart = float(linear.eigenvalue_errors[k]), np.abs(linear.eigenvalues - linear.eigenvalues[k])
    others = apart[apart > _APART * error]
    return error / float(others.min()) if others.size else 0.0


def _mode(value: complex, error: float, shape: dict[str, complex], turned: float) -> Mode:
    parts = {name: Value(float(x.real), error=turned) for name, x in shape.items()}
    ahead = {name: Value(float(x.imag), error=turned) for name, x in shape.items()}
    quarter = ahead if any(x.imag for x in shape.values()) else {}
    rate = Value(value.real, None, "1/s", error=error)
    if value.imag == 0.0:
        motion = "free" if value.real == 0.0 else "grows" if value.real > 0.0 else "decays"
        return Mode(motion, rate=None if motion == "free" else rate, shape=parts)  # type: ignore[arg-type]
    period = 2 * math.pi / value.imag
    told = (
        Value(value.imag, None, "rad/s", error=error),
        Value(period, None, "s", error=period * error / value.imag),
    )
    return Mode("oscillates", *told, rate if value.real else None, parts, quarter)
