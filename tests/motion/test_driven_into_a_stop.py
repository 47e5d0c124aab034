"""A crank that a motion turns drives its slider into a stop: no impulse stops it, whatever rubs."""

import re

import numpy as np
import pytest
from scipy.optimize import brentq

import multibody_sym as mbs

CRANK, ROD, STOP, ANGLE, TURNING = 0.266, 0.804, 0.838, 0.689, 4.054
MODEL = f"""\
multibody_sym: 1
name: driven
gravity: [0, -9.81, 0]
bodies:
  ground: {{points: {{o: [0, 0, 0]}}}}
  crank: {{mass: 0, points: {{e: [{CRANK}, 0, 0]}}}}
  rod: {{shape: {{rod: {ROD}, mass: 6.9}}, points: {{e: [{ROD}, 0, 0]}}}}
  slider: {{mass: 0.29, inertia: {{Izz: 0.01}}}}
joints:
  drive: {{type: revolute, parent: ground.o, child: crank, motion: {ANGLE} + {TURNING}*t}}
  pin: {{type: revolute, parent: crank.e, child: rod, q: psi, initial: {{q: -0.9009}}}}
  guide:
    {{type: prismatic, parent: ground.o, child: slider, axis: x, q: s, initial: {{q: 0.99}}, limits: {{lower: {STOP}}}}}
  end: {{type: revolute, parent: rod.e, child: slider, cut: true}}
simulation: {{t_end: 1}}
"""
ROUGH = """\
forces:
  rub1: {type: friction, joint: guide, static: 0.7, kinetic: 0.42}
  rub2: {type: friction, joint: pin, static: 0.1, radius: 0.041}
"""


def slider(t: float) -> float:
    """The slider's way by hand."""
    angle = ANGLE + TURNING * t
    return float(CRANK * np.cos(angle) + np.sqrt(ROD**2 - (CRANK * np.sin(angle)) ** 2))


@pytest.mark.parametrize("friction", ["", ROUGH])
def test_no_impulse_stops_what_a_motion_drives(friction: str) -> None:
    """With friction in two joints it was blamed on that friction."""
    with pytest.raises(mbs.MultibodyError, match="prescribed motions alone determine its speed") as caught:
        mbs.simulate(mbs.loads(MODEL + friction))
    assert caught.value.number == "R101"
    (time,) = re.findall(r"at t = (\S+) s", str(caught.value))
    assert float(time) == pytest.approx(brentq(lambda t: slider(t) - STOP, 0.0, 0.3), abs=1e-6)
