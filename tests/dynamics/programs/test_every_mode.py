"""The Programs of a mechanism in every mode against those of each mode alone, by the interpreter, in runs of random
models: accelerations, multipliers, switching functions, corrections, powers."""

from __future__ import annotations

import numpy as np
import pytest
from every_mode_runs import compared, modes_of
from random_models import random_model
from random_runs import seed_of

from multibody_sym.errors import MultibodyError

ALIKE = 1e-10
"""Relative to the largest value of its kind."""

SLIDES_IN_SPACE = """
multibody_sym: 1
name: crate on three feet
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  crate:
    shape: {box: [0.6, 0.4, 0.3], mass: 3}
    points: {a: [0.3, 0.2, -0.15], b: [-0.3, 0.2, -0.15], c: [0, -0.2, -0.15]}
joints:
  J: {type: free, parent: ground, child: crate, initial: {q: [0, 0, 0.15, 1, 0, 0, 0], u: [1.5, 0.4, 0, 0, 0, 2]}}
contacts:
  ca: {between: [crate.a, ground.floor], static: 0.4, kinetic: 0.3}
  cb: {between: [crate.b, ground.floor], static: 0.4, kinetic: 0.3}
  cc: {between: [crate.c, ground.floor], static: 0.4, kinetic: 0.3}
"""
STARTS_IN_SPACE = """
multibody_sym: 1
name: load that is pulled
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  load: {mass: 2}
joints: {J: {type: point, parent: ground, child: load, axes: xyz, q: [x, y, z]}}
contacts: {c: {between: [load, ground.floor], static: 0.3, kinetic: 0.2}}
forces: {pull: {type: force, on: load, value: [14*t, 6*t^2, 0]}}
"""


RESTS_ON_THREE = SLIDES_IN_SPACE.replace("u: [1.5, 0.4, 0, 0, 0, 2]", "u: [0, 0, 0, 0, 0, 0]").replace("[0,", "[1,", 1)
TURNS_ON_TWO = """
multibody_sym: 1
name: rod on two feet
gravity: [0, 0, -9.81]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  rod: {shape: {box: [0.6, 0.01, 0.01], mass: 3}, points: {a: [0.3, 0, 0], b: [-0.3, 0, 0]}}
joints: {J: {type: free, parent: ground, child: rod, initial: {u: [1, 0, 0, 0, 0, 2]}}}
contacts:
  ca: {between: [rod.a, ground.floor], static: 0.4, kinetic: 0.3}
  cb: {between: [rod.b, ground.floor], static: 0.4, kinetic: 0.3}
"""
ROUGH_PINS = """
multibody_sym: 1
name: four-bar with rough pins
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {d: [1, 0, 0]}}
  b0: {mass: 1, com: [0.2, 0, 0], inertia: {Izz: 0.01}, points: {e: [0.4, 0, 0]}}
  b1: {mass: 1, com: [0.5, 0, 0], inertia: {Izz: 0.08}, points: {e: [1, 0, 0]}}
  b2: {mass: 1, com: [0.4, 0, 0], inertia: {Izz: 0.05}, points: {e: [0.8, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: b0, axis: z, q: q0, initial: {q: 1, u: 0, known: true}}
  B: {type: revolute, parent: b0.e, child: b1, axis: z, q: q1}
  D: {type: revolute, parent: ground.d, child: b2, axis: z, q: q2, initial: {q: 1.5}}
  C: {type: revolute, parent: b1.e, child: b2.e, axis: z, cut: true}
forces:
  f1: {type: friction, joint: B, static: 0.1, kinetic: 0.1, radius: 0.01}
  f2: {type: friction, joint: D, static: 0.1, kinetic: 0.1, radius: 0.01}
"""
ROUGH_GUIDES = """
multibody_sym: 1
name: pendulum on a carriage between rough guides
gravity: [0, -9.81, 0]
bodies:
  ground: {}
  carriage: {mass: 1}
  bob: {mass: 0.5, com: [0, -0.4, 0], inertia: {Izz: 0.01}}
joints:
  S: {type: prismatic, parent: ground, child: carriage, axis: x, q: x, initial: {u: 0.2}}
  P: {type: revolute, parent: carriage, child: bob, axis: z, q: a, initial: {q: 1.4, u: 3}}
forces:
  f: {type: friction, joint: S, static: 0.3, kinetic: 0.2, length: 0.4}
  pin: {type: friction, joint: P, static: 0.2, kinetic: 0.15, radius: 0.02}
"""
ROUGH_WHEELS = """
multibody_sym: 1
name: rope over two rough drums
gravity: [0, -10, 0]
bodies:
  ground:
    points: {low: [-0.1, 0.1, 0], high: [0.1, 1.1, 0], side: [0.2, 0, 0]}
    surfaces: {table: {plane: [0, 0, 0], normal: y}}
  block: {mass: 10}
  load: {mass: 20}
joints:
  block: {type: point, parent: ground, child: block, q: [x, y], initial: {q: [-2, 0]}}
  line: {type: prismatic, parent: ground.side, child: load, axis: -y, q: depth}
pulleys: {drum1: {at: ground.low, radius: 0.1, rough: 0.2}, drum2: {at: ground.high, radius: 0.1, rough: 0.1}}
constraints: {rope: {type: rope, path: [block, drum1, drum2, load], slack: true}}
contacts: {c: {between: [block, ground.table], static: 0.2}}
"""


def assert_alike(text: str, until: float = 0.3) -> int:
    """Assert that all that is compared is alike; return the number of modes."""
    found = modes_of(text, until)
    for leg in found:
        for name, alone, every in compared(leg):
            size = max(1.0, float(np.abs(alone).max(initial=0.0)))
            assert np.abs(alone - every).max(initial=0.0) <= ALIKE * size, (name, leg.program.words)
    return len(found)


@pytest.mark.parametrize(("text", "modes"), [(SLIDES_IN_SPACE, 1), (STARTS_IN_SPACE, 2)], ids=["slides", "starts"])
def test_slip_in_space(text: str, modes: int) -> None:
    assert assert_alike(text, 1.0) >= modes


@pytest.mark.parametrize(
    ("text", "until", "modes"),
    [
        (RESTS_ON_THREE, 1e-3, 1),
        (TURNS_ON_TWO, 0.1, 1),
        (ROUGH_PINS, 0.4, 2),
        (ROUGH_GUIDES, 0.6, 3),
        (ROUGH_WHEELS, 0.1, 1),
    ],
    ids=["shares at rest", "shares in motion", "lengths press", "sides press", "means press"],
)
def test_forces_that_press_or_are_shared(text: str, until: float, modes: int) -> None:
    assert assert_alike(text, until) >= modes


def test_random_models() -> None:
    """Most have several modes; those that no common set of Programs serves are left out."""
    assert sum(map(_modes, (1, 4, 5, 8, 18))) >= 5


@pytest.mark.long
def test_many_random_models() -> None:
    assert sum(map(_modes, range(25, 400))) > 400


def _modes(number: int) -> int:
    try:
        return assert_alike(random_model(seed_of("every mode", number)))
    except MultibodyError:
        return 0
