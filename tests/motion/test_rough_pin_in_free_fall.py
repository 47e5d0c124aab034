"""A particle on an arm that begins to fall where its rough pin carries nothing.

With k = mu r / L the pin takes T = k |N| along the path and R = L phi'^2 - g sin(phi) along the arm for a unit mass, so
that T = k R / sqrt(1 - k^2), and L phi'' = T - g cos(phi) while the arm falls: both vanish at the start.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

ARM, RADIUS, MU, G = 7.0, 20.0, 0.3, 9.81
MODEL = f"""
multibody_sym: 1
name: arm
gravity: [0, -{G}, 0]
bodies: {{a: {{mass: 1, com: [{ARM}, 0, 0]}}}}
joints: {{pin: {{type: revolute, parent: ground, child: a, axis: z, q: phi}}}}
forces: {{rub: {{type: friction, joint: pin, static: {MU}, radius: {RADIUS}}}}}
"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_it_falls_as_by_hand(backend: str) -> None:
    k = MU * RADIUS / ARM

    def falls(t: float, y: np.ndarray) -> list[float]:
        radial = ARM * y[1] ** 2 - G * math.sin(y[0])
        return [y[1], (k * abs(radial) / math.sqrt(1 - k * k) - G * math.cos(y[0])) / ARM]

    run = mbs.simulate(mbs.loads(MODEL), t_end=0.8, samples=9, backend=backend)
    wanted = solve_ivp(falls, (0.0, 0.8), [0.0, 0.0], rtol=1e-11, atol=1e-12, t_eval=run.t).y
    assert (wanted[1][1:] < 0.0).all()
    assert run["phi"] == pytest.approx(wanted[0], abs=1e-7)
    assert run["u_phi"] == pytest.approx(wanted[1], abs=1e-7)
