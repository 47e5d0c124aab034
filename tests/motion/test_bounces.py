"""What bounces in runs: times, speeds and energies against closed forms, up to rest."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact.contact_problem import Scale
from multibody_sym.motion.switching.impact import BounceMemory

G = 9.81


def ball(e, height=1.0, *, slope=0.0, across=0.0):
    """A point above a smooth plane that leans by an angle, from rest or with a speed along x."""
    return mbs.loads(f"""
multibody_sym: 1
name: ball
gravity: [0, -{G}, 0]
parameters: {{e: {e}, h: {height}, a: {slope}, v: {across}}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: ["-sin(a)", "cos(a)", 0]}}}}}}
  ball: {{mass: 2}}
joints: {{free: {{type: point, parent: ground, child: ball, q: [x, y], initial: {{q: [0, h], u: [v, 0]}}}}}}
contacts: {{c: {{between: [ball, ground.floor], restitution: e}}}}
""")


def test_a_gap_that_opens_crosses_zero_by_rounding_once_a_time():
    """It is no event that ends a mode, whether it has bounced before or not; twice at one time is for laws to tell."""
    laws = mbs.simulate(ball(0.5), t_end=0.1, backend="python").modes.switches.laws
    facts = laws.at(0.3, np.array([0.0, -1e-17]), np.array([0.0, 1e-6]), Scale(1.0, 4.0))
    (floor,) = facts.laws.unilateral
    bounces = BounceMemory()
    assert bounces.leaving(facts, floor) is facts.q
    assert bounces.leaving(facts, floor) is None
    below = laws.at(0.4, np.array([0.0, -1e-12]), np.array([0.0, 1e-6]), Scale(1.0, 4.0))
    assert bounces.leaving(below, floor) == pytest.approx([0.0, 0.0], abs=1e-16)


def test_both_backends_bounce_alike():
    first, other = (mbs.simulate(ball(0.7), t_end=3.0, samples=31, backend=name) for name in ("c", "python"))
    times = [[event["t"] for event in run.events] for run in (first, other)]
    assert times[0] == pytest.approx(times[1], rel=1e-12)
    np.testing.assert_allclose(first.q, other.q, atol=1e-12)


def line(speeds, masses, e, *, gap, walls):
    """Blocks of length 1 - gap on a smooth line, one at each metre, perhaps between walls."""
    n = len(speeds)
    right = (
        f"ground: {{surfaces: {{left: {{plane: [0, 0, 0], normal: x}}, right: {{plane: [{n}, 0, 0], normal: -x}}}}}}"
    )
    text = ["multibody_sym: 1", "name: line", "gravity: [0, 0, 0]", "bodies:", f"  {right}"]
    face, size = "surfaces: {face: {plane: [0, 0, 0], normal: -x}}", 1.0 - gap
    text += [f"  b{k}: {{mass: {m!r}, points: {{end: [{size!r}, 0, 0]}}, {face}}}" for k, m in enumerate(masses)]
    start = gap / 2 if walls else 0.0
    text += ["joints:"] + [
        f"  j{k}: {{type: prismatic, parent: ground, child: b{k}, axis: x, q: x{k}, "
        f"initial: {{q: {k + start!r}, u: {u!r}}}}}"
        for k, u in enumerate(speeds)
    ]
    pairs = [(f"b{k}.end", f"b{k + 1}.face") for k in range(n - 1)]
    pairs += [("b0", "ground.left"), (f"b{n - 1}.end", "ground.right")] if walls else []
    text += ["contacts:"] + [f"  c{k}: {{between: [{a}, {b}], restitution: {e!r}}}" for k, (a, b) in enumerate(pairs)]
    return mbs.loads("\n".join(text) + "\n")


def struck_in_turn(speeds, masses, e, gap, end):
    """Positions and speeds at a time, from impact to impact in exact fractions."""
    n, e, size = len(speeds), Fraction(e), Fraction(1.0 - gap)
    x, v, m = [Fraction(k + gap / 2) for k in range(n)], [*map(Fraction, speeds)], [*map(Fraction, masses)]
    left = Fraction(end)
    while True:
        gaps = [x[0], *(b - a - size for a, b in pairwise(x)), n - x[-1] - size]
        rates = [v[0], *(b - a for a, b in pairwise(v)), -v[-1]]
        time, k = min((g / -r, k) for k, (g, r) in enumerate(zip(gaps, rates, strict=True)) if r < 0)
        x = [a + b * min(time, left) for a, b in zip(x, v, strict=True)]
        if time >= left:
            return x, v
        left -= time
        if k in (0, n):
            v[k - (k == n)] *= -e
        else:
            p = (1 + e) * (v[k - 1] - v[k]) / (1 / m[k - 1] + 1 / m[k])
            v[k - 1], v[k] = v[k - 1] - p / m[k - 1], v[k] + p / m[k]
        x, v = ([Fraction(round(y * 10**60), 10**60) for y in values] for values in (x, v))


@pytest.mark.parametrize(("count", "e"), [(6, 1.0), (6, 0.95), pytest.param(50, 1.0, marks=pytest.mark.long)])
def test_unequal_blocks_between_walls_strike_each_other_in_turn(count, e):
    rng = np.random.default_rng(3)
    masses, speeds = (10 ** rng.uniform(-0.5, 0.5, count)).tolist(), rng.normal(size=count).tolist()
    run = mbs.simulate(line(speeds, masses, e, gap=0.5, walls=True), t_end=10.0, samples=2)
    x, v = struck_in_turn(speeds, masses, e, 0.5, 10)
    assert [run[f"x{k}"][-1] for k in range(count)] == pytest.approx([float(a) for a in x], abs=1e-10)
    assert [run[f"u_x{k}"][-1] for k in range(count)] == pytest.approx([float(a) for a in v], abs=1e-10)
