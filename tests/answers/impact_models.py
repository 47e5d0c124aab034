"""Model files with impacts that several tests ask, and what `solve` finds of the impact of a model."""

from __future__ import annotations

from typing import Any

import multibody_sym as mbs
from multibody_sym.answers.records import ImpactFound

STRUCK = "multibody_sym: 1\nname: struck\n"
"""The first lines of a model without gravity."""

TWO_BALLS = """
multibody_sym: 1
name: two balls on a line
parameters:
  m1: {value: 2 kg, positive: true}
  m2: {value: 3 kg, positive: true}
  v1: 4 m/s
  v2: 1 m/s
  e: 0.5
bodies: {a: {mass: m1}, b: {mass: m2}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: x1, initial: {u: v1}}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: x2, initial: {u: v2}}
impact: {between: [a, b], normal: -x, restitution: e}
"""

CHAIN = """
multibody_sym: 1
name: struck chain
parameters: {m: {value: 1 kg, positive: true}, a: pi/10, e: 1}
repeat: {count: 4, body: {shape: {rod: 1, mass: m}, points: {end: [1, 0, 0], middle: [0.5, 0, 0]}},
  joint: {type: revolute, axis: z, parent: end, initial: {q: -a}}, body_name: rod, joint_name: h}
bodies: {ball: {mass: m}}
joints:
  B: {type: point, parent: ground, child: ball, axes: xy,
      initial: {q: [cos(a) + cos(2*a) + cos(3*a)/2, -sin(a) - sin(2*a) - sin(3*a)/2], u: [-sin(3*a), -cos(3*a)]}}
impact: {between: [ball, rod3.middle], normal: [sin(3*a), cos(3*a), 0], restitution: e}
"""


def impact_of(model: str, **options: Any) -> ImpactFound:
    """Return the impact of a model file's text, solved with the options of `solve`."""
    found = mbs.solve(mbs.loads(model), **options).impact
    assert found is not None
    return found
