"""Impulses of many contacts at once, by sweeps over them: each obeys its own law beside the impulses of all others.

    v = w + A x,   x = A^T z;   0 <= z_n, 0 <= v_n, z_n v_n = 0;   |z_t| <= mu z_n, against v_t where that is not zero

w (m) are the speeds without these impulses, normal ones less the least that is allowed; A is that of an
`ImpactProblem`. This is the projected Gauss-Seidel iteration of non-smooth contact dynamics (M. Jean, Comput. Methods
Appl. Mech. Engrg. 177 (1999) 235-257). `templates/c/sweeps.c` gives the same bits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

Numbers = NDArray[np.intc]


@dataclass(frozen=True, eq=False)
class ContactRows:
    """Rows of contacts, A (m, n): first their normals, then those in which friction parts rub.

    Row j has the elements `matrix` from number `begins[j]` up to `begins[j + 1]`, each in its column of `places`, of
    `width` columns. Part k rubs in the rows from `rubs[k]` up to `rubs[k + 1]`, the first of which follows the normals,
    and is pressed by the normal `presses[k]`.
    """

    begins: Numbers
    places: Numbers
    matrix: Floats
    rubs: Numbers
    presses: Numbers
    width: int

    @property
    def normals(self) -> int:
        """The number of normals."""
        return int(self.rubs[0])

    @cached_property
    def squares(self) -> Floats:
        """The squares of the lengths of rows (m,): how a unit impulse changes the speed along its own row."""
        return self._sums(self.matrix * self.matrix)

    def times(self, x: Floats) -> Floats:
        """Return A x (m,)."""
        return self._sums(self.matrix * x[self.places])

    def transposed_times(self, z: Floats) -> Floats:
        """Return A^T z (n,)."""
        each = np.repeat(z, np.diff(self.begins))
        return np.bincount(self.places, self.matrix * each, minlength=self.width).astype(float)

    def _sums(self, values: Floats) -> Floats:
        counts = np.diff(self.begins)
        rows = np.repeat(np.arange(len(counts)), counts)
        return np.bincount(rows, values, minlength=len(counts)).astype(float)

    @cached_property
    def without_friction(self) -> ContactRows:
        """The normals alone."""
        count, end = self.normals, int(self.begins[self.normals])
        none, begins = np.zeros(0, dtype=np.intc), self.begins[: count + 1].copy()
        rubs = np.array([count], dtype=np.intc)
        return ContactRows(begins, self.places[:end].copy(), self.matrix[:end].copy(), rubs, none, self.width)


RELAXED: Final = 1.5
"""By how much more than is due normal impulses are changed: heaps settle in a third of the sweeps."""


def sweep(
    rows: ContactRows, speeds: Floats, coefficients: Floats, impulses: tuple[Floats, Floats], settled: float, most: int
) -> int:
    """Bring `impulses` z (m), and x = A^T z (n), near the laws, at speeds w (m); return how many sweeps that took.

    `coefficients` are those of friction parts. It ends after `most` sweeps, or once none changes anything by more than
    `settled`: impulses times the lengths of their rows, the root of twice an energy.
    """
    normals, parts, squares = rows.normals, len(rows.presses), rows.squares.tolist()
    begins, places, matrix = rows.begins.tolist(), rows.places.tolist(), rows.matrix.tolist()
    rubs, presses, mu = rows.rubs.tolist(), rows.presses.tolist(), coefficients.tolist()
    w, (z, now) = speeds.tolist(), (each.tolist() for each in impulses)
    spans = [range(begins[j], begins[j + 1]) for j in range(len(w))]

    def speed(j: int) -> float:
        v: float = w[j]
        for k in spans[j]:
            v += matrix[k] * now[places[k]]
        return v

    def change(j: int, impulse: float) -> float:
        more = impulse - z[j]
        z[j] = impulse
        if more != 0.0:
            for k in spans[j]:
                now[places[k]] += matrix[k] * more
        moved: float = abs(more) * math.sqrt(squares[j])
        return moved

    done = 0
    while done < most:
        done, largest = done + 1, 0.0
        for j in range(normals):
            if squares[j] > 0.0:
                wanted = z[j] - RELAXED * speed(j) / squares[j]
                largest = max(largest, change(j, wanted if wanted > 0.0 else 0.0))
        for part in range(parts):
            own = range(rubs[part], rubs[part + 1])
            largest = max(largest, _rub(own, squares, mu[part] * z[presses[part]], z, speed, change))
        if largest <= settled:
            break
    impulses[0][:], impulses[1][:] = z, now
    return done


def _rub(
    own: range,
    squares: Sequence[float],
    limit: float,
    z: Sequence[float],
    speed: Callable[[int], float],
    change: Callable[[int, float], float],
) -> float:
    """Let a part stick where its impulses stay within a limit, else slip; return the largest change."""
    stiff = 0.0
    for j in own:
        stiff += squares[j]
    if not stiff > 0.0:
        return 0.0
    wanted, square = [z[j] - speed(j) / stiff for j in own], 0.0
    for each in wanted:
        square += each * each
    size = math.sqrt(square)
    part = limit / size if size > limit else 1.0
    return max(change(j, part * each) for j, each in zip(own, wanted, strict=True))
