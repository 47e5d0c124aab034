"""Points that meet without a normal strike along their relative velocity."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs

PARTICLES = """\
multibody_sym: 1
name: particles
parameters: {m1: {value: 2, positive: true}, m2: {value: 3, positive: true}, e: {value: 0.5, positive: true}}
bodies: {a: {mass: m1}, b: {mass: m2}}
joints:
  A: {type: point, parent: ground, child: a, q: [x1, y1], initial: {u: [4, 0]}}
  B: {type: point, parent: ground, child: b, q: [x2, y2], initial: {u: [0, 3]}}
impact: {between: [a, b], restitution: e}
"""


@pytest.mark.parametrize("pair", ["a, b", "b, a"])
def test_particles_lose_all_relative_speed_but_what_restitution_returns(pair: str) -> None:
    """v1 = (4, 0), v2 = (0, 3) in m/s: p = (1 + e) mu 5 with mu = 6/5 kg, against their relative velocity (4, -3)."""
    told = mbs.solve(mbs.loads(PARTICLES.replace("a, b", pair))).impact
    assert told is not None
    p = 1.5 * 6 / 5 * 5
    assert told.impulses["impact"]["normal"].value == pytest.approx(p, rel=1e-14)
    after = [told.after[f"u_{name}"].value for name in ("x1", "y1", "x2", "y2")]
    way = np.array([4, -3]) / 5
    np.testing.assert_allclose(after, [*([4, 0] - p / 2 * way), *([0, 3] + p / 3 * way)], rtol=1e-13, atol=1e-14)
    assert told.energy_lost.value == pytest.approx(0.75 * 6 / 5 * 25 / 2, rel=1e-14)


def test_on_a_line_the_faster_one_behind_strikes() -> None:
    """4 m/s meets 1 m/s from either side: the normal is none of the axis."""
    text = PARTICLES.replace("type: point", "type: prismatic, axis: x").replace("[4, 0]", "4").replace("[0, 3]", "1")
    told = mbs.solve(mbs.loads(text.replace("[x1, y1]", "x").replace("[x2, y2]", "y"))).impact
    assert told is not None
    assert told.impulses["impact"]["normal"].value == pytest.approx(1.5 * 6 / 5 * 3, rel=1e-14)
    assert told.after["u_y"].value - told.after["u_x"].value == pytest.approx(0.5 * 3, rel=1e-14)


def test_axes_that_friction_is_told_in_do_not_turn_the_normal() -> None:
    """Of a body that is turned, here by 0.7 rad: what the particles do is the same."""
    turned = PARTICLES.replace("bodies: {", "bodies: {c: {mass: 1, inertia: {Izz: 1}}, ").replace(
        "joints:", "joints:\n  C: {type: revolute, parent: ground, child: c, axis: z, q: phi, initial: {q: 0.7}}"
    )
    turned = turned.replace("between: [a, b],", "between: [a, b], frame: c,")
    straight, told = (mbs.solve(mbs.loads(text)).impact for text in (PARTICLES, turned))
    assert straight is not None
    assert told is not None
    for name, speed in straight.after.items():
        assert told.after[name].value == pytest.approx(speed.value, abs=1e-14)
