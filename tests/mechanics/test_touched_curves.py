"""Rows of what touches curves: against 50-digit differences of the gap and the slip, the foot found by itself."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.row_kinematics import RowMotion, row_motions

STEP = mpmath.mpf(10) ** -12
RADIUS = mpmath.mpf("0.1")


def rows_of(system: mbs.System, q: list[float], u: list[float]) -> dict[str, RowMotion]:
    resolved = mbs.mechanism(system)
    state = state_of(resolved, float, 0.0, q, u, [])
    return {row.name: moved for row, moved in zip(resolved.rows, row_motions(motion_of(resolved, state)), strict=True)}


def rates(of: Callable[[Any], Any]) -> tuple[float, float, float]:
    """Return a value at zero, its rate and the rate of that."""
    a, b, c = of(-STEP), of(mpmath.mpf(0)), of(STEP)
    return float(b), float((c - a) / (2 * STEP)), float((a - 2 * b + c) / STEP**2)


@pytest.mark.parametrize("seed", range(6))
def test_a_disc_over_a_random_curve(seed: int) -> None:
    """The disc moves freely; phi of the normal row is its distance, psi along t1 the velocity of its lowest place."""
    rng = np.random.default_rng(seed)
    a, b, c, d = (float(x) for x in np.round(rng.uniform(0.3, 0.9, 4), 3))
    curve = mbs.Curve(x=f"s + {a}*sin({b}*s)", y=f"{c}*s^2 - {d}*s", parameter="s", unit="m")
    system = mbs.System(
        "disc",
        bodies={
            "ground": mbs.Body(surfaces={"hill": mbs.Surface(curve=curve)}),
            "disc": mbs.Body(shape=mbs.Shape("disc", float(RADIUS), 1)),
        },
        joints={"free": mbs.Planar("ground", "disc", q=["x", "y", "phi"])},
        constraints={"rolls": mbs.Rolling("disc", "ground.hill")},
    )
    s0, *v = (float(x) for x in rng.uniform(-0.3, 0.3, 7))
    over = float(rng.uniform(0.15, 0.3))

    def place(s: Any) -> tuple[Any, Any]:
        return s + a * mpmath.sin(b * s), c * s**2 - d * s

    def way(s: Any) -> tuple[Any, Any]:
        x, y = 1 + a * b * mpmath.cos(b * s), 2 * c * s - d
        size = mpmath.sqrt(x * x + y * y)
        return x / size, y / size

    with mpmath.workdps(50):
        (cx, cy), (tx, ty) = place(mpmath.mpf(s0)), way(mpmath.mpf(s0))
        begin = cx - over * ty, cy + over * tx

        def centre(t: Any) -> list[Any]:
            return [p + vel * t + acc * t * t / 2 for p, vel, acc in zip((*begin, 0), v[:3], v[3:], strict=True)]

        def foot(t: Any) -> Any:
            x, y, _ = centre(t)

            def across(s: Any) -> Any:
                (px, py), (wx, wy) = place(s), way(s)
                return wx * (x - px) + wy * (y - py)

            return mpmath.findroot(across, mpmath.mpf(s0), tol=mpmath.mpf(10) ** -90)

        def gap(t: Any) -> Any:
            (px, py), (wx, wy), (x, y, _) = place(foot(t)), way(foot(t)), centre(t)
            return -wy * (x - px) + wx * (y - py) - RADIUS

        def slip(t: Any) -> Any:
            wx, wy = way(foot(t))
            vx, vy, w = (vel + acc * t for vel, acc in zip(v[:3], v[3:], strict=True))
            return wx * vx + wy * vy + RADIUS * w

        s, s1, s2 = rates(foot)
        distance, approach, approach_rate = rates(gap)
        sliding, sliding_rate, _ = rates(slip)
        q = [*(float(x) for x in begin), 0.0, s]
    rows = rows_of(system, q, [*v[:3], s1])
    udot = np.array([*v[3:], s2])

    def second(row: RowMotion) -> float:
        return float(np.dot(np.array(row.jacobian, dtype=float), udot) - row.gamma)

    normal, along, follows = rows["rolls.n"], rows["rolls.t1"], rows["rolls.foot.t"]
    assert [normal.phi, normal.phidot, second(normal)] == pytest.approx([distance, approach, approach_rate], abs=1e-12)
    assert [along.phidot, second(along)] == pytest.approx([sliding, sliding_rate], abs=1e-12)
    assert [follows.phi, follows.phidot, second(follows)] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert abs(approach_rate) > 1e-4
