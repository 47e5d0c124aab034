"""A `velocity` constraint acts on all speeds that it names: a run that fails by one says so."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

CYLINDER = """
multibody_sym: 1
name: cylinder
parameters: {m: 100, A: 5e-4, V: 1e-4, E: 1.4e9, ref: 0.1, kv: 0.002}
bodies: {rod: {mass: m}, memory: {mass: 1 kg}}
joints:
  P: {type: prismatic, parent: ground, child: rod, axis: x, q: s}
  M: {type: prismatic, parent: ground, child: memory, axis: y, q: p}
constraints: {oil: {type: velocity, zero: "u_p - E/V*(kv*(ref - s) - A*u_s)", acts: in_joints}}
forces: {push: {type: force, on: rod, value: [p*A, 0, 0]}, d: {type: damper, joint: P, damping: 2000}}
simulation: {t_end: 2 s}
"""


def test_the_message_names_the_speeds_on_which_it_acts() -> None:
    with pytest.raises(mbs.MultibodyError, match=r"constraint oil .* acts on every speed that it names \(u_s, u_p\)"):
        mbs.simulate(mbs.loads(CYLINDER), backend="python")
