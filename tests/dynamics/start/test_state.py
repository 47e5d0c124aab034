"""The mode at the start: what touches, acts, sticks and slides there, against bodies cut free by hand."""

from __future__ import annotations

import math

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.state import StartState, examined_state
from multibody_sym.errors import NoSolutionError

G = 9.81
INCLINE = f"""\
multibody_sym: 1
name: incline
gravity: [0, -{G}, 0]
parameters: {{mu: 0.3, a: 30 deg}}
bodies:
  b: {{mass: 2, points: {{p: [0, 0, 0]}}}}
  ground: {{surfaces: {{face: {{plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}}}}
joints: {{J: {{type: point, parent: ground, child: b, initial: {{q: [1, tan(a)], u: [0, 0]}}}}}}
contacts: {{c: {{between: [b.p, ground.face], static: mu}}}}
"""
ROD = f"""\
multibody_sym: 1
name: rod
gravity: [0, -{G}, 0]
bodies:
  rod: {{mass: 1, com: [1, 0, 0], inertia: {{Izz: 1/3}}, points: {{end: [0, 0, 0]}}}}
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
joints: {{J: {{type: planar, parent: ground, child: rod, initial: {{q: [0, 0, THETA], u: [-8, 0, OMEGA]}}}}}}
contacts: {{c: {{between: [rod.end, ground.floor], static: 2}}}}
"""


def at_start(text: str, **changes: str) -> StartState:
    for old, new in changes.items():
        text = text.replace(old, new)
    return examined_state(mbs.loads(text))


def test_speeds_that_are_not_given_follow_what_touches() -> None:
    """A ramp that moves with a given speed lifts the block on it, whose own speed is not given."""
    text = INCLINE.replace("  ground: {surf", "  ramp: {mass: 1, surf").replace("ground.face", "ramp.face")
    ramp = "  R: {type: prismatic, parent: ground, child: ramp, axis: x, initial: {u: 2}}"
    text = text.replace(", u: [0, 0]}}}", f"}}}}\n{ramp}")
    text = text.replace("joints: {J: {", "joints:\n  J: {", 1)
    found = at_start(text)
    assert found.words["c"] in ("stick", "slide+", "slide-")
    u = dict(zip((s.name for s in found.mechanism.speeds), found.start.u, strict=True))
    assert u["u_R"] == 2
    assert -math.sin(math.pi / 6) * (u["u_J_x"] - 2) + math.cos(math.pi / 6) * u["u_J_y"] == pytest.approx(0, abs=1e-14)


def test_painleve_s_rod_has_no_state_or_several() -> None:
    """LAWS: theta = 1.3, omega = 0 leaves no state, theta = 0.9, omega = -4 several; the floor is rough, mu = 2."""
    found = at_start(ROD, THETA="1.3", OMEGA="0")
    assert (found.modes, found.found.verdict) == ((), "none")
    with pytest.raises(NoSolutionError, match=r"contact and friction .* declare a restitution") as caught:
        _ = found.mode
    assert caught.value.where.path == ("contacts", "c")
    found = at_start(ROD, THETA="0.9", OMEGA="-4")
    assert found.found.verdict == "several"
    assert {mode.sides["c"] for mode in found.modes} == {0, 1}


