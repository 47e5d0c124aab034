"""One freedom with linear dampers: M x'' + C x' + K x = 0 swings with sqrt(K/M - d^2), d = C/(2 M), and fades as -d."""

from __future__ import annotations

from multibody_sym.algebra.quotients import PRECISE
from multibody_sym.answers.small_motions.formulas import Formulas
from multibody_sym.answers.small_motions.matrices import Matrices
from multibody_sym.answers.small_motions.record import Mode
from multibody_sym.answers.small_motions.spectrum import Root, root_of
from multibody_sym.expressions.values import Value


def damped_modes(given: Matrices, formulas: Formulas, name: str) -> tuple[list[Mode], list[Root]]:
    """Return the modes of one freedom with a damper, and omega^2 of that which swings (none where it does not)."""
    M, C, K = (matrix[0][0] for matrix in (given.mass, given.rates, given.stiffness))
    fading = C / (2 * M)
    square = K / M - fading * fading
    shape = {name: Value(1.0)}
    if square.vanishes:
        return [Mode("decays", rate=formulas.value(-fading, "1/s"), shape=shape)], []
    if square.sample > 0:
        root = root_of(square)
        rate = formulas.value(-fading, "1/s")
        return [Mode("oscillates", formulas.frequency(root), formulas.period(root), rate, shape)], [root]
    spread = PRECISE.sqrt(-square.sample)
    rates = [Value(float(-fading.sample + side * spread), None, "1/s") for side in (1, -1)]
    words = ("grows" if x.value and x.value > 0.0 else "decays" for x in rates)
    return [Mode(word, rate=rate, shape=shape) for word, rate in zip(words, rates, strict=True)], []  # type: ignore[arg-type]
