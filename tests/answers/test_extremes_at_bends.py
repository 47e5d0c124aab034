"""Extremes at kinks of tables, jumps of forces and impacts, where no sample is: by hand and by scipy's spline."""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy.interpolate import CubicSpline

import multibody_sym as mbs

SLIDE = """
multibody_sym: 1
name: pushed
parameters: {m: 2 kg, F: 10 N}
bodies: {a: {mass: m}}
joints: {A: {type: prismatic, axis: x, parent: ground, child: a, q: x, initial: {q: 0, u: 1}}}
forces: {f: {type: torque, joint: A, value: FORCE}}
inputs: {w: {table: [[0, 0], [1.1, 2], [2.3, -1], [3.1, 4], [4, 0]], interpolation: KIND, dimension: N}}
simulation: {t_end: 6 s}
ask:
"""


def answers(text: str) -> dict[str, Any]:
    return mbs.solve(mbs.loads(text)).answers


def test_a_force_that_jumps_turns_the_speed_at_its_jump() -> None:
    text = SLIDE.replace("FORCE", '"where(t < 1.3, F, -F)"').replace("KIND", "linear")
    found = answers(
        f"{text}  top: {{max: u_x}}\n  power: {{max: \"F*u_x*where(t < 1.3, 1, 0.5)\"}}\n"
        "  F0: {find: F, so: top == 10, between: [5, 20]}\n  near: {min: abs(x - 1.7)}\n"
    )
    assert (found["top"].value, found["top"].t) == pytest.approx((7.5, 1.3), rel=1e-12)
    assert (found["power"].value, found["power"].t) == pytest.approx((75.0, 1.3), rel=1e-9)
    assert found["F0"].value == pytest.approx(18 / 1.3, rel=1e-9)
    assert found["near"].value == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_a_table_has_its_extremes_at_its_knots(kind: str) -> None:
    found = answers(f"{SLIDE.replace('FORCE', 'w').replace('KIND', kind)}  least: {{min: w}}\n  most: {{max: w}}\n")
    x, y = [0, 1.1, 2.3, 3.1, 4], [0, 2, -1, 4, 0]
    if kind == "linear":
        assert (found["least"].value, found["least"].t) == pytest.approx((-1.0, 2.3), rel=1e-12)
        assert (found["most"].value, found["most"].t) == pytest.approx((4.0, 3.1), rel=1e-12)
        return
    spline = CubicSpline(x, y, bc_type="natural")
    turns = [t for t in spline.derivative().roots() if 0 < t < 4]
    for name, which in (("least", min), ("most", max)):
        assert found[name].value == pytest.approx(which(float(spline(t)) for t in turns), rel=1e-9)


def test_a_ball_is_fastest_behind_an_impact() -> None:
    """A ball on a floor is struck by one above it, so that it bounces back up faster than it fell."""
    text = """
multibody_sym: 1
name: stack
gravity: [0, -g, 0]
parameters: {g: 9.81, e: 0.6}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  a: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
  b: {mass: 2}
joints:
  A: {type: prismatic, axis: y, parent: ground, child: a, q: ya, initial: {q: 1}}
  B: {type: prismatic, axis: y, parent: ground, child: b, q: yb, initial: {q: 1.7}}
contacts:
  floor: {between: [a, ground.floor], restitution: e, open: true}
  head: {between: [b, a.top], restitution: e, open: true}
ask: {fastest: {max: u_ya, until: 0.7 s}}
simulation: {t_end: 1 s}
"""
    t, g, e, m, heavy, ya, yb, ua, ub, speeds = 0.0, 9.81, 0.6, 1.0, 2.0, 1.0, 1.7, 0.0, 0.0, []
    for _ in range(6):
        lands = (ua + math.sqrt(ua * ua + 2 * g * ya)) / g
        meets = (yb - ya) / (ua - ub) if ua > ub and yb > ya + 1e-12 else math.inf
        step = min(lands, meets)
        ya, yb = ya + (ua - g * step / 2) * step, yb + (ub - g * step / 2) * step
        ua, ub, t = ua - g * step, ub - g * step, t + step
        if lands < meets:
            ya, ua = 0.0, -e * ua
        else:
            p = (1 + e) * (ua - ub) * m * heavy / (m + heavy)
            ua, ub, yb = ua - p / m, ub + p / heavy, ya
        speeds.append((ua, t))
    found = answers(text)["fastest"]
    assert (found.value, found.t) == pytest.approx(max(speeds), rel=1e-9)
