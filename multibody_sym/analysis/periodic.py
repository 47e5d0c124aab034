"""Periodic motions: the multipliers by which small deviations grow over one period (Floquet).

Where A is not constant its eigenvalues say nothing. The equations of deviations, z' = F(t) z, are integrated beside the
motion itself; with X spanning the constraints' tangents at the start and P picking the independent components, the
multipliers are the eigenvalues of P Z(T) X. The motion is stable where none is larger than one.
"""

from __future__ import annotations

from sys import float_info
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import Flow
from multibody_sym.errors import NoSolutionError
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass

if TYPE_CHECKING:
    from scipy.integrate import DOP853

_RTOL: Final = 1e-10
_REPEATS: Final = 1e-6
_MOST_STEPS: Final = 100_000
"""Steps over a period: about five minutes of a small mechanism."""
_PACE: Final = 1000
"""Steps after each of which it is foreseen how many a period takes."""
_MARGIN: Final = 10
"""How many times the most steps may be foreseen: a start may take shorter ones than the rest of the period."""


@dataclass(frozen=True, eq=False)
class Multipliers:
    """The `multipliers` of small changes of `states` over one `period` (s), the largest first."""

    states: tuple[str, ...]
    period: float
    multipliers: npt.NDArray[np.complex128]

    def as_json(self) -> dict[str, Any]:
        """Return the object that `linearize --period --json` prints."""
        found = [[float(x.real), float(x.imag)] for x in self.multipliers]
        return {"states": list(self.states), "period": self.period, "multipliers": found}


def multipliers_of(flow: Flow, q: Floats, u: Floats, period: float) -> Multipliers:
    """Return the multipliers over one period (s) of the motion from a state at t = 0.

    Raises NoSolutionError where the motion cannot be followed, or does not repeat itself in all that A depends on.
    """
    from scipy.integrate import DOP853  # scipy takes longer to import than most linearizations take

    found, tangents = flow.linearized(q, u), flow.tangents(q, u)
    sizes = len(q), len(u), len(tangents.places)

    def rates(t: float, y: Floats) -> Floats:
        at, speeds, Z = _parts(y, sizes)
        known = flow.known(at, speeds, t)
        by_state, _ = flow.derivatives(known)
        return np.concatenate([*flow.rates(known), np.ravel(by_state @ Z)])

    begin = np.concatenate([q, u, np.ravel(tangents.X)])
    try:
        at, speeds, Z = _parts(_followed(DOP853(rates, 0.0, begin, period, rtol=_RTOL, atol=_RTOL)), sizes)
        known = flow.known(at, speeds, period)
        by_state, _ = flow.derivatives(known)
        there = by_state[tangents.places] @ flow.span(known, tangents.places)
    except UNDEFINED as error:
        raise NoSolutionError(f"the motion cannot be followed over a period ({error})", number="N111") from None
    missed = float(np.abs(there - found.A).max(initial=0.0))
    if missed > _REPEATS * max(1.0, float(np.abs(found.A).max(initial=0.0))):
        raise NoSolutionError(
            f"the motion does not repeat itself after {period:g} s: A differs by {missed:.3g} from that at first",
            number="N111",
        )
    values = np.linalg.eigvals(Z[tangents.places]).astype(complex)
    return Multipliers(found.states, period, values[np.lexsort((values.imag, -np.abs(values)))])


def _followed(taking: DOP853) -> Floats:
    """Return the state at the end of a period. Raises NoSolutionError where steps become too small, or too many."""
    count, before = 0, 0.0
    while taking.status == "running":
        taking.step()
        count += 1
        if count % _PACE == 0 and taking.status == "running":
            foreseen = count + _PACE * (taking.t_bound - taking.t) / max(taking.t - before, float_info.min)
            if count >= _MOST_STEPS or foreseen > _MARGIN * _MOST_STEPS:
                raise _too_long(taking, count)
            before = taking.t
    if taking.status == "failed":
        raise NoSolutionError(
            f"the motion cannot be followed over a period past t = {taking.t:.6g} s: steps became too small, as where "
            "a force or a constraint has no finite slope",
            number="N105",
        )
    return np.asarray(taking.y, dtype=float)


def _too_long(taking: DOP853, count: int) -> NoSolutionError:
    return NoSolutionError(
        f"a period of {taking.t_bound:g} s takes too many steps: {count} led to t = {taking.t:.6g} s, as the motion, "
        "or a small deviation from it, changes that fast; give the shortest time after which the motion repeats itself",
        number="N111",
    )


def _parts(y: Floats, sizes: tuple[int, int, int]) -> tuple[Floats, Floats, Floats]:
    """Return q, u and Z (2 nu x m) from one vector."""
    nq, nu, count = sizes
    return y[:nq], y[nq : nq + nu], y[nq + nu :].reshape(2 * nu, count)
