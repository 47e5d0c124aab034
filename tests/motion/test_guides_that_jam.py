"""Friction in a guide that presses either way: where its reaction turns, the laws may have no state beyond."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError

ANGLE, LIGHT, HEAVY, MU, TURNS = math.radians(30), 0.1, 2.0, 1.5, 0.3
GUIDE = f"""
multibody_sym: 1
name: guide
gravity: [0, 0, 0]
bodies:
  carrier: {{mass: {LIGHT}, frames: {{slope: {{rotate: [{{axis: z, angle: {ANGLE}}}]}}}}}}
  block: {{mass: {HEAVY}}}
joints:
  rides: {{type: prismatic, parent: ground, child: carrier, axis: x, q: x}}
  slides: {{type: prismatic, parent: carrier.slope, child: block, axis: x, q: s, initial: {{u: SPEED}}}}
forces:
  rubs: {{type: friction, joint: slides, static: {MU}}}
  across: {{type: force, on: block, value: [0, "-5*({TURNS} - t)", 0], frame: carrier.slope}}
simulation: {{t_end: 1}}
"""


def test_a_guide_whose_reaction_turns_is_named_where_neither_side_has_a_state() -> None:
    """By hand N (a + s b sign(N)) = 5 (0.3 - t) with a = 1/m + sin^2/M, b = mu sin cos/M, times m: b > a.

    So for the sense s in which N > 0 slides there is a state while the force across presses that way, none after it.
    """
    a = 1.0 / HEAVY + math.sin(ANGLE) ** 2 / LIGHT
    b = MU * math.sin(ANGLE) * math.cos(ANGLE) / LIGHT
    assert b > a > 0.0
    why = r"nothing that may act.* all 2 modes .* at t = 0\.3 s"
    with pytest.raises(FailedRunError, match=why):
        mbs.simulate(mbs.loads(GUIDE.replace("SPEED", "5")))


def test_a_guide_of_less_friction_changes_its_side() -> None:
    """With b < a the run passes that instant."""
    run = mbs.simulate(mbs.loads(GUIDE.replace("SPEED", "5").replace(f"static: {MU}", "static: 0.5")), t_end=0.5)
    assert 0.5 * math.cos(ANGLE) / LIGHT * math.sin(ANGLE) < 1.0 / HEAVY + math.sin(ANGLE) ** 2 / LIGHT
    assert [x["element"] for x in run.events if abs(x["t"] - TURNS) < 1e-6] == []
    assert run.t[-1] == 0.5


LEANING = """
multibody_sym: 1
name: leaning
gravity: [0, -9.81, 0]
bodies:
  b1: {shape: {rod: 0.458, mass: 0.159}, points: {e: [0.458, 0, 0], f: [0, 0, 0]}}
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  b2: {mass: 1.37, inertia: {Izz: 0.01}}
joints:
  j1: {type: planar, parent: ground, child: b1, q: [x, y, a], initial: {q: [0.458*cos(1.173), 0, pi - 1.173]}}
  j2:
    type: prismatic
    parent: b1
    child: b2
    axis: x
    q: s
    initial: {q: 0.229}
    limits: {lower: 0.1, upper: 0.412, restitution: 0}
contacts:
  c1: {between: [b1.f, ground.floor], static: 0.3, restitution: 0.5}
  c2: {between: [b1.e, ground.wall], static: 0.1, restitution: 0.5}
forces:
  rub: {type: friction, joint: j2, static: 1.5}
  push: {type: force, on: b1, value: [w, 0, 0]}
inputs:
  w:
    table: [[0, 0], [0.25, 5.649], [0.5, 10.1498], [0.75, 12.5875], [1, 12.4668], [1.25, 9.812]]
    interpolation: cubic
simulation: {t_end: 0.75}
"""


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_where_friction_leaves_forces_undetermined_a_run_ends_whatever_its_steps(tolerance: float) -> None:
    """A run that steps across gets forces there that hang on rounding, and misses energy by up to 1 J."""
    why = r"friction jams at t = 0\.709689 s: .* c1\.normal, rub\.normal .*Painleve.*no change of their sign was found"
    with pytest.raises(FailedRunError, match=why):
        mbs.simulate(mbs.loads(LEANING), rtol=tolerance, atol=tolerance)
    until = mbs.simulate(mbs.loads(LEANING), rtol=tolerance, atol=tolerance, t_end=0.709)
    assert until.energy_residual == pytest.approx(0.0, abs=100 * tolerance)
