"""Forces that are not unique beside friction in guides: a run takes some that stay within their bounds."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs

PUSHED = """
multibody_sym: 1
name: pushed
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {o: [1, 0, 0]}}
  a: {shape: {box: [0.2, 0.2, 0.2], mass: 1.5}}
  b: {shape: {box: [0.2, 0.2, 0.2], mass: 9}, points: {l: [-0.1, 0, 0]}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: qa, initial: {q: 0.78, u: 1}}
  B: {type: prismatic, parent: ground.o, child: b, axis: x, q: qb}
forces:
  rub: {type: friction, joint: A, static: 0.3, kinetic: 0.18}
  push: {type: force, on: a, value: [60, 0, 0]}
contacts:
  c: {between: [b.l, a.right], static: 0.3, restitution: 0}
"""

HELD_TWICE = """
multibody_sym: 1
name: held_twice
gravity: [0, -9.81, 0]
parameters: {{a: {angle}}}
bodies:
  bar: {{mass: 2, com: {centre}, inertia: {{Ixx: 0.01, Iyy: 0.1, Izz: 0.1}}, points: {{e: [1, 0, 0]}}}}
  ground: {{points: {{w: [cos(a), sin(a), 0]}}}}
joints:
  pin: {{type: revolute, parent: ground, child: bar, initial: {{q: [a]}}}}
  far: {{type: spherical, parent: ground.w, child: bar.e, cut: true}}
forces: {{rub: {{type: friction, joint: pin, static: 0.1, radius: 0.02}}}}
outputs: {{carried: fx(far)*cos(a + pi/2) + fy(far)*sin(a + pi/2)}}
"""


def test_a_contact_that_could_carry_a_guided_body_exerts_what_its_limit_allows() -> None:
    """Its friction f, up to 0.3 of what pushes b, carries a part of the weight that presses a's guide: a is not unique.

    Every answer lies between those of f = -0.3 N and of 0.3 N; the rate at which energy goes is that of its friction.
    """
    run = mbs.simulate(mbs.loads(PUSHED), t_end=0.5, samples=51)
    pushed = run.t > 0.1
    took = np.diff(run["u_qb"][pushed]) / np.diff(run.t[pushed])
    least, most = sorted((60 - 0.18 * 1.5 * 9.81) / (10.5 + side * 0.18 * 0.3 * 9) for side in (1, -1))
    assert (took > least - 1e-9).all()
    assert (took < most + 1e-9).all()
    assert took == pytest.approx(took[0], rel=1e-6)
    assert run["u_qa"][pushed] == pytest.approx(run["u_qb"][pushed], abs=1e-9)
    assert abs(run.energy_residual) < 1e-9


@pytest.mark.parametrize(
    ("angle", "centre"), [(-1.181, [0.18, 0.012, 0]), (-1.318, [0.388, 0.302, 0]), (0.7, [0.3, 0, 0])]
)
def test_a_bar_that_is_held_at_both_ends_rests_without_friction(angle: float, centre: list[float]) -> None:
    """Any friction within its limit balances it, with some force at the far end along the bar and across it."""
    run = mbs.simulate(mbs.loads(HELD_TWICE.format(angle=angle, centre=centre)), t_end=0.1, samples=3)
    assert (run["pin"] == angle).all()
    lever = centre[0] * np.cos(angle) - centre[1] * np.sin(angle)
    assert run["carried"] == pytest.approx(2 * 9.81 * lever, rel=1e-12)


PROPPED = """
multibody_sym: 1
name: propped
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, -0.739, 0], normal: y}}}
  b1: {shape: {rod: 0.448, mass: 2.19}, points: {e: [0.448, 0, 0]}}
  b2: {shape: {rod: 0.532, mass: 6.75}, points: {e: [0.532, 0, 0]}}
joints:
  j1: {type: revolute, parent: ground, child: b1, q: p, initial: {q: -1.0577893461}}
  j2: {type: revolute, parent: b1.e, child: b2, q: r, initial: {q: 0.3430840547}}
forces: {rub: {type: friction, joint: j1, static: 1.5, radius: 0.046}}
contacts: {c: {between: [b2.e, ground.floor], static: enough, restitution: 0.5}}
outputs: {N: normal(c), f: friction(c), M: friction(rub), X: fx(j1), Y: fy(j1), x: "position(b2.e, x)"}
simulation: {t_end: 0.2 s, samples: 3}
"""


def test_two_rods_are_propped_by_friction_up_to_the_cone_of_their_pin() -> None:
    """The forces balance the rods, and the friction of the pin stays within its limit."""
    run = mbs.simulate(mbs.loads(PROPPED))
    assert not run.u.any()
    N, f, M, X, Y, x = (float(run[name][-1]) for name in "NfMXYx")
    p, r = float(run["p"][-1]), float(run["r"][-1])
    elbow = 0.448 * np.array([np.cos(p), np.sin(p)])
    tip = elbow + 0.532 * np.array([np.cos(p + r), np.sin(p + r)])
    weights = 9.81 * np.array([2.19, 6.75])
    middles = np.array([elbow / 2, (elbow + tip) / 2])
    assert (X + f, Y + N - weights.sum()) == pytest.approx((0.0, 0.0), abs=1e-9)
    about_elbow = (tip - elbow)[0] * N - (tip - elbow)[1] * f - (middles[1] - elbow)[0] * weights[1]
    assert about_elbow == pytest.approx(0.0, abs=1e-9)
    assert M + tip[0] * N - tip[1] * f - middles[:, 0] @ weights == pytest.approx(0.0, abs=1e-9)
    assert abs(M) <= 1.5 * 0.046 * np.hypot(X, Y) * (1 + 1e-9)
    assert N >= 0.0
    assert x == pytest.approx(tip[0], abs=1e-9)
