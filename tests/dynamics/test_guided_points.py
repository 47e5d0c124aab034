"""Points on random curves, in the plane and in space: every route, and in absolute coordinates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs


def pendulum_on_a_curve(seed: int, *, plane: bool) -> mbs.System:
    """Return two bodies, the second hinged to the first, one point of which is on a curve of ground or of the other."""
    rng = np.random.default_rng(seed)
    a, b, c, d = (float(x) for x in np.round(rng.uniform(0.3, 1.0, 4), 3))
    curve = mbs.Curve(x=f"{a}*s + sin(s)", y=f"{b}*s^2 + {a}*sin(t)", z="0" if plane else f"{c}*cos(s)", parameter="s")
    carrier: Any = mbs.Planar if plane else mbs.Free
    inertia, end = {"Ixx": 1, "Iyy": 1.2, "Izz": 1.4}, [c, d, 0 if plane else a]
    bodies = {
        name: mbs.Body(mass=1 + a, com=[b, c, 0], inertia=inertia, points={"end": end}) for name in ("first", "second")
    }
    return mbs.System(
        "pendulum on a curve",
        gravity=[0, -9.81, 0],
        bodies=bodies,
        joints={"free": carrier("ground", "first"), "hinge": mbs.Revolute("first.end", "second", axis="z")},
        constraints={"guide": mbs.OnCurve("second.end", curve, "ground")},
    )


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
@pytest.mark.parametrize(("seed", "plane"), [(1, True), (2, True), (3, False)])
def test_points_on_curves_move_alike_by_every_route(seed: int, plane: bool, coordinates: str) -> None:
    report = mbs.check(pendulum_on_a_curve(seed, plane=plane), coordinates=coordinates)
    assert report.agrees
    assert max(report.agreement.values()) < 100
    assert report.degrees_of_freedom == (3 if plane else 5)
