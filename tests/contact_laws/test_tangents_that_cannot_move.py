"""A rod on a slide falls on a stop and a floor at once: nothing moves along the floor, and joints rub by reactions."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.contact_laws.impact_problem import ImpactProblem
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import Equality, FrictionLaw, FrictionRow, LawProblem, Unilateral

FLOOR, STOP, PRESSED, RUBS = 0, 3, 7, 9
MU = 0.004


def landing(noise: float) -> ImpactProblem:
    """Return slide and rod (2 speeds) at -1.7 and -0.43, weighted; rounding of tangents and reactions is `noise`."""
    rng, vanishing = np.random.default_rng(1), noise * np.ones(2)
    A = np.array(
        [[-0.6122, 2.4375], [0, 0], [0, 0], [1.2612, 0], [0, 0], [0, 0], [1.2612, 0], [0.1623, 0.6094], [0, 0], [0, 0]]
    )
    A[RUBS] = [-3.9893, 5.1906]
    A[[2, 4, 5, 8]] += rng.normal(size=(4, 2)) * vanishing
    defines = (4, 5, PRESSED, 8)
    C, D = A.copy(), np.zeros((10, 10))
    C[list(defines)] = 0.0
    D[defines, defines] = -1.0
    D[4, 1], D[5, 2], D[PRESSED, FLOOR], D[8, 1], D[8, 2] = -1.0, 1.0, -1.0, 0.8, 0.6
    u = np.array([-1.7, -1.7 * 0.6122 / 2.4375])
    right = -A @ u
    right[list(defines)] = 0.0
    right[1] = noise
    laws = [Equality()] * 10
    laws[FLOOR] = laws[STOP] = Unilateral()
    laws[1], laws[2], laws[6], laws[RUBS] = FrictionRow(0), FrictionRow(0, 1), FrictionRow(1), FrictionRow(2)
    parts = (
        FrictionLaw((1, 2), (FLOOR,), 0.5, 0.1, (0.0, 0.0)),
        FrictionLaw((6,), (4, 5), 0.3, 0.2, norm=True),
        FrictionLaw((RUBS,), (PRESSED, 8), 0.006, MU, norm=True),
    )
    e = np.where(np.arange(10) == STOP, 0.5, 0.0)
    rows = LawProblem(A, C, D, right, tuple(laws), parts)
    return ImpactProblem(rows, e, law="poisson", sequence="one_by_one", allowed=np.full(10, 1e-9))


@pytest.mark.parametrize("noise", [0.0, 1e-17, 1e-33])
def test_they_stop_and_what_the_stop_gives_back_lifts_the_slide_against_friction(noise: float) -> None:
    """In restitution the pin turns: the floor's N holds its end, T = mu |R| with R = A_r x - N rubs."""
    problem = landing(noise)
    struck, A = strike(problem), problem.rows.matrix
    given, T, N, x = 0.5 * struck.compression[STOP], 0.0, 0.0, np.zeros(2)
    for _ in range(60):
        N = -(A[FLOOR] @ (A[STOP] * given + A[RUBS] * T)) / (A[FLOOR] @ A[FLOOR])
        x = A[STOP] * given + A[RUBS] * T + A[FLOOR] * N
        T = -MU * abs(A[PRESSED] @ x - N) * np.sign(A[RUBS] @ x)
    assert N > 0.0
    after = A @ x
    assert struck.after[[FLOOR, STOP, RUBS]] == pytest.approx(after[[FLOOR, STOP, RUBS]], abs=1e-12)
    assert struck.impulses[RUBS] - struck.compression[RUBS] == pytest.approx(T, rel=1e-9)
