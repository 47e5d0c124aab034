"""A mass held in a wedge that moves on is pulled by a rope: what rounding leaves of common speeds is no impact."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.contact_laws.impact_problem import ImpactProblem
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.contact_laws.problem import FrictionLaw, FrictionRow, LawProblem, Unilateral

FASTER = 2.1081888  # 1/sqrt(m), m = 0.225 kg
LIGHTER = 3.1622777  # 1/sqrt(m), m = 0.1 kg
ROPE = 7
CLOSING = 3.6533468e-5


def pulled(noise: float) -> ImpactProblem:
    """Return four faces (three rough) that touch one mass, a rope that tightens; `allowed` has their speeds."""
    n1, n2, n3, t3 = (-0.332032, 0.943268), (0.943268, 0.332032), (-0.665075, 0.746776), (0.746776, 0.665075)
    rope = np.array([np.cos(0.41762), -np.sin(0.41762)])
    A = np.zeros((8, 4))
    A[:7, :2] = FASTER * np.array([n1, n2, n2, [-n1[0], -n1[1]], n3, t3, t3])
    A[ROPE] = np.concatenate([FASTER * rope, -LIGHTER * rope])
    right = np.zeros(8)
    right[[0, 2, 4, 6]] = noise * np.array([6.75, -0.2, 6.32, 2.38])
    right[ROPE] = CLOSING
    touching = (law for part in range(3) for law in (Unilateral(), FrictionRow(part)))
    laws = (*touching, Unilateral(), Unilateral())
    rough = (
        FrictionLaw((1,), (0,), 1.5, 0.9, (0.0,)),
        FrictionLaw((3,), (2,), 1e6, 1e6, (0.0,), enough=True),
        FrictionLaw((5,), (4,), 1e6, 1e6, (0.0,), enough=True),
    )
    rows = LawProblem(A, A, np.zeros((8, 8)), right, laws, rough)
    allowed = np.array([5e-9, 0.0, 5e-9, 0.0, 5e-9, 0.0, 5e-9, 1e-8])
    e = np.array([0.5, 0, 0, 0, 1, 0, 1, 0.0])
    return ImpactProblem(rows, e, law="poisson", sequence="one_by_one", allowed=allowed)


@pytest.mark.parametrize("noise", [1e-17, -1e-17])
def test_what_rounding_leaves_of_common_speeds_changes_nothing(noise: float) -> None:
    """The wedge keeps the mass: the rope moves the other one alone, by its own impulse, and does not close any more."""
    struck, still = strike(pulled(noise)), strike(pulled(0.0))
    assert struck.x == pytest.approx(still.x, abs=1e-15)
    assert struck.impulses == pytest.approx(still.impulses, abs=1e-15)
    assert struck.after[[0, 2, 4, 6]] == pytest.approx(np.zeros(4), abs=1e-15)
    assert struck.after[ROPE] == pytest.approx(-CLOSING + LIGHTER**2 * struck.impulses[ROPE], rel=1e-6)
    assert struck.after[ROPE] >= 0.0
    assert struck.impulses[[0, 2, 4, 6, ROPE]].min() >= 0.0
