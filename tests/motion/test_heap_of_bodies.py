"""Four bodies that bounce on a floor and slide on each other, two pairs of them joined by springs: a run to its end."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

HEAP = """
multibody_sym: 1
name: heap
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  rod:
    mass: 0.5
    com: [0.218, 0, 0]
    inertia: {Ixx: 0.001, Iyy: 0.00792, Izz: 0.00792}
    points: {e: [0.436, 0, 0], h: [0.218, 0, 0]}
  crate: {shape: {box: [0.643, 0.467, 0.3], mass: 2.633}, points: {h: [-0.3215, 0.2335, 0]}}
  box: {shape: {box: [0.599, 0.679, 0.3], mass: 0.5}, points: {e: [0.2995, -0.3395, 0]}}
  wheel: {shape: {disc: 0.399, mass: 2}, points: {h: [0, -0.399, 0]}, surfaces: {rim: {disc: 0.399, axis: z}}}
joints:
  j0:
    type: planar
    parent: ground
    child: rod
    q: [x0, y0, p0]
    initial: {q: [0, 1.171, 0], u: [1.838, -1.867, 4.222]}
  j1:
    type: planar
    parent: ground
    child: crate
    q: [x1, y1, p1]
    initial: {q: [1.3, 0.805, 0.906], u: [2.06, -2.369, -1.731]}
  j2:
    type: planar
    parent: ground
    child: box
    q: [x2, y2, p2]
    initial: {q: [2.6, 1.319, 0.984], u: [0.374, -1.905, -3.019]}
  j3:
    type: planar
    parent: ground
    child: wheel
    q: [x3, y3, p3]
    initial: {q: [3.9, 1.265, -0.005], u: [-2.18, -1.746, 0.421]}
contacts:
  c0: {between: [rod.e, ground.floor], restitution: 0.7, open: true}
  cc0: {between: [rod, ground.floor], static: 0.2, kinetic: 0.2, restitution: 0.7, open: true}
  c1: {between: [crate, ground.floor], static: 0.3, kinetic: 0.3, restitution: 1, open: true}
  c2: {between: [box, ground.floor], static: 0.1, kinetic: 0.1, restitution: 0, open: true}
  k2: {between: [box, crate], static: 0.3, kinetic: 0.3, restitution: 0, open: true}
  c3: {between: [wheel.rim, ground.floor], static: 0.3, kinetic: 0.3, restitution: 0, open: true}
  k3: {between: [wheel.rim, box], static: 0.3, kinetic: 0.2, restitution: 0, open: true}
forces:
  s1: {type: spring_damper, between: [rod.e, crate.h], stiffness: 50, damping: 0.5, length: 0.339}
  s3: {type: spring_damper, between: [box.e, wheel.h], stiffness: 500, damping: 0.5, length: 0.774}
simulation: {t_end: 1, samples: 201}
"""


@pytest.mark.long
def test_it_keeps_its_account_of_energy_to_its_end() -> None:
    """No impact gives energy, and what stands in no event is lost to friction and dampers alone."""
    run = mbs.simulate(mbs.loads(HEAP))
    assert run.t[-1] == 1.0
    assert len(run.events) > 20
    assert all(loss >= -1e-9 for loss in run.impact_losses.values())
    assert abs(run.energy_residual) < 1e-5 * run.energy[0]
    assert run.drift["position"] < 1e-9
