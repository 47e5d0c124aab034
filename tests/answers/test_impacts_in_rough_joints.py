"""Friction in joints exerts impulses too: by hand, by bodies cut free, and as in runs."""

from __future__ import annotations

import math

import pytest
from impact_models import STRUCK, impact_of

import multibody_sym as mbs

WALL = """
parameters: {m: 2, l: 1, mu: 0.6, r: 0.1, e: 0.5, f: 0}
bodies:
  rod: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {tip: [l, 0, 0]}}
  ground: {surfaces: {wall: {plane: [0, -1, 0], normal: [0.6, 0.8, 0]}}}
joints: {H: {type: revolute, parent: ground, child: rod, axis: z, q: a, initial: {q: "0 - pi/2", u: -3}}}
forces: {rub: {type: friction, joint: H, kinetic: mu, radius: r}}
contacts: {c: {between: [rod.tip, ground.wall], restitution: e, kinetic: f}}
"""


def test_a_journal_and_a_wall_by_the_body_cut_free() -> None:
    """The tip strikes a slanting wall: compression by hand, then Poisson's part of it, both with mu r |R|."""
    m, l, mu, r, e, w = 2.0, 1.0, 0.6, 0.1, 0.5, -3.0
    n = (0.6, 0.8)
    # The tip is at (0, -l): it moves along x by l w, and p n has the moment n_x l about the hinge.
    # Hinge: R = m v_com' - p n, v_com' = (l/2 dw, 0), and mu r |R| against w < 0.
    def left(dw: float, p: float) -> float:
        size = math.hypot(m * l / 2 * dw - p * n[0], -p * n[1])
        return m * l * l / 3 * dw - p * n[0] * l - mu * r * size

    low, high = 0.0, 100.0
    for _ in range(200):  # p that stops it: dw = -w
        p = (low + high) / 2
        low, high = (p, high) if left(-w, p) > 0 else (low, p)
    told = impact_of(STRUCK + WALL + "impact: {law: poisson}\n")
    compressed = p
    assert told.impulses["c"]["normal"].value == pytest.approx((1 + e) * compressed, rel=1e-12)
    after = told.after["u_a"].value
    assert after > 0  # the journal rubs the other way while it bounces
    rest = e * compressed
    size = math.hypot(m * l / 2 * after - rest * n[0], -rest * n[1])
    assert m * l * l / 3 * after == pytest.approx(rest * n[0] * l - mu * r * size, rel=1e-11)


@pytest.mark.parametrize("f", [0, 0.3])
@pytest.mark.parametrize("e", [0, 0.5, 1])
def test_solve_and_runs_have_one_answer(e: float, f: float) -> None:
    model = mbs.loads(STRUCK + WALL)
    changed = {"e": e, "f": f}
    run = mbs.simulate(model, parameters=changed, t_end=1e-9)
    told = mbs.solve(mbs.loads(STRUCK + WALL + "impact: closing\n"), parameters=changed).impact
    assert told is not None
    assert told.law == "poisson"
    assert told.impulses["c"]["normal"].value == pytest.approx(run.events[0]["impulse"], rel=1e-12)
    assert told.after["u_a"].value == pytest.approx(run["u_a"][-1], rel=1e-8, abs=1e-12)


def test_what_bounces_in_a_run_rubs_in_its_joints() -> None:
    """An impulse in proportion to the speed, as by the body cut free above: a smooth hinge would ask for 7/6 of it."""
    smooth = WALL.replace(", kinetic: f}", "}")
    model = mbs.loads(STRUCK + smooth + "gravity: [0, -9.81, 0]\nsimulation: {samples: 20001}\n")
    run = mbs.simulate(model, initial={"a": -0.9, "u_a": -3}, t_end=0.5)
    hit = next(event for event in run.events if "impulse" in event)
    before = float(run["u_a"][int(run.t.searchsorted(hit["t"])) - 1])
    told = impact_of(STRUCK + WALL + "impact: {law: poisson}\n").impulses["c"]["normal"].value
    assert hit["impulse"] / before == pytest.approx(told / -3.0, rel=1e-3)
