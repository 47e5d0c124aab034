"""Ropes that go taut and rebound: times, speeds and energies against closed forms, up to a load that hangs."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

G, MASS, LENGTH = 9.81, 2.0, 1.5


def load(e, rope="{path: [ground.hook, load], length: L, slack: true, restitution: e}", extra=""):
    """A load that falls straight down from where its rope is fixed."""
    return mbs.loads(f"""
multibody_sym: 1
name: load
gravity: [0, -{G}, 0]
parameters: {{e: {e}, L: {LENGTH}, h: 1e-3}}
bodies: {{ground: {{points: {{hook: [0, 0, 0]}}}}, load: {{mass: {MASS}}}}}
joints: {{fall: {{type: prismatic, parent: ground, child: load, axis: -y, q: s, initial: {{q: h}}}}}}
constraints: {{cord: {{type: rope, {rope[1:]}}}
{extra}""")


def test_a_rope_keeps_its_restitution_in_a_file_and_in_python():
    model = load(0.5)
    assert mbs.loads(mbs.dumps(model)) == model
    assert "restitution: e" in mbs.dumps(model)
    rope = mbs.Rope(("ground.hook", "load"), length="L", slack=True, restitution="e")
    assert model.constraints["cord"] == rope


IN_A_CORNER = """
multibody_sym: 1
name: in_a_corner
gravity: [0, -9.81, 0]
bodies:
  ground:
    surfaces:
      low: {plane: [0, 0, 0], normal: [-0.342581, 0.939488, 0]}
      steep: {plane: [0, 0, 0], normal: [0.939488, 0.342581, 0]}
  anchor: {mass: 0.162}
  load: {mass: 10}
joints:
  a: {type: point, parent: ground, child: anchor, q: [ax, ay]}
  b: {type: point, parent: ground, child: load, q: [x, y], initial: {q: [0.8, 0.3]}}
forces:
  pull: {type: force, on: anchor, value: [-2.553, -0.778, 0]}
  weight: {type: force, on: load, value: [0, -7.431, 0]}
contacts:
  c: {between: [anchor, ground.low], static: 1.5, restitution: 0}
  d: {between: [anchor, ground.steep], static: 0.3, restitution: 0.5}
constraints:
"""
TWO = """\
  dead: {type: rope, path: [anchor, load], slack: true, restitution: 0}
  lively: {type: rope, path: [anchor, load], slack: true, restitution: 1}
"""
ONE = "  one: {type: rope, path: [anchor, load], slack: true, restitution: 0.5}\n"


def test_ropes_come_to_rest_where_their_anchor_is_held_by_more_friction_than_it_needs() -> None:
    """Impulses that friction shares as it likes do not pull at the steep face, which nothing leaves.

    As one rope of 0.5 they leave the load swinging; without that rest they strike on.
    """
    two, one = (mbs.simulate(mbs.loads(IN_A_CORNER + ropes), t_end=0.6, samples=301) for ropes in (TWO, ONE))
    for name in ("x", "y", "u_x", "u_y"):
        assert two[name][-1] == pytest.approx(one[name][-1], abs=1e-9), name
    assert len(two.events) < 70
