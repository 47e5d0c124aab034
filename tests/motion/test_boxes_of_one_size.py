"""Boxes of one size that meet flush: every corner of one is at the very end of a face of the other."""

from __future__ import annotations

import math

import pytest
from scipy.integrate import solve_ivp

import multibody_sym as mbs

BOTH = pytest.mark.parametrize("backend", ["c", "python"])

ON_A_LINE = """\
multibody_sym: 1
name: on_a_line
gravity: {gravity}
bodies: {{a: {{shape: {{box: [0.1, 0.1, 0.1], mass: 1}}}}, b: {{shape: {{box: [0.1, {height}, 0.1], mass: 2}}}}}}
joints:
  ja: {{type: prismatic, parent: ground, child: a, axis: x, q: xa, initial: {{q: 0, u: 3}}}}
  jb: {{type: prismatic, parent: ground, child: b, axis: x, q: xb, initial: {{q: 0.5}}}}
contacts: {{ab: {{between: [a, b], open: true, restitution: {e}}}}}
simulation: {{t_end: 0.4, samples: 2}}
"""


IN_A_PLANE, IN_SPACE = "[0, -9.81, 0]", "[0, 0, -9.81]"


@BOTH
@pytest.mark.parametrize(
    ("gravity", "e", "height"),
    [
        *((IN_A_PLANE, 0, "0.1"), (IN_A_PLANE, 0.5, "0.1"), (IN_A_PLANE, 1, "0.1"), (IN_A_PLANE, 0.5, "0.1 - 1e-12")),
        *((IN_A_PLANE, 0.5, "0.1 + 1e-9"), (IN_SPACE, 0.5, "0.1"), (IN_SPACE, 0.5, "0.1 - 1e-12")),
    ],
)
def test_boxes_on_a_line_strike_each_other(backend: str, gravity: str, e: float, height: str) -> None:
    """They keep their momentum, 3 kg m/s, and part with e times 3 m/s."""
    run = mbs.simulate(mbs.loads(ON_A_LINE.format(e=e, height=height, gravity=gravity)), backend=backend)
    assert run.u[-1] == pytest.approx([1 - 2 * e, 1 + e], abs=1e-12)
    assert run.events[0]["t"] == pytest.approx(0.4 / 3, abs=1e-12)


ON_A_FLOOR = """\
multibody_sym: 1
name: on_a_floor
gravity: [0, -10, 0]
bodies:
  a: {{shape: {{box: [0.1, 0.1, 0.1], mass: 1}}}}
  b: {{shape: {{box: [0.1, 0.1, 0.1], mass: 2}}}}
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
joints:
  ja: {{type: planar, parent: ground, child: a, q: [xa, ya, pa], initial: {{q: [0, 0.05, 0], u: [3, 0, 0]}}}}
  jb: {{type: planar, parent: ground, child: b, q: [xb, yb, pb], initial: {{q: [0.5, 0.05, 0]}}}}
contacts:
  fa: {{between: [a, ground.floor], static: 0.2}}
  fb: {{between: [b, ground.floor], static: 0.2}}
  ab: {{between: [a, {struck}], open: true, restitution: 0.5}}
simulation: {{t_end: 2, samples: 2}}
"""


@pytest.mark.parametrize("struck", ["b", "b.left"])
def test_a_crate_strikes_an_equal_one_flush(struck: str) -> None:
    """With v^2 = 9 - 2 mu g 0.4 at the impact a stops there; b slides on with v/2, and stops after (v/2)^2/(2 mu g)."""
    rubs = 0.2 * 10
    way = (9 - 2 * rubs * 0.4) / 4 / (2 * rubs)
    found = mbs.simulate(mbs.loads(ON_A_FLOOR.format(struck=struck))).q[-1]
    assert found == pytest.approx([0.4, 0.05, 0, 0.5 + way, 0.05, 0], abs=1e-9)


DROPPED = """\
multibody_sym: 1
name: dropped
gravity: [0, -10, 0]
bodies: {{a: {{shape: {{box: [0.1, 0.1, 0.1], mass: 1}}}}, b: {{shape: {{box: [{width}, 0.1, 0.1], mass: 2}}}}}}
joints:
  ja: {{type: planar, parent: ground, child: a, q: [x, y, p], initial: {{q: [{x}, 0.2, 0]}}}}
  jb: {{type: fixed, parent: ground, child: b}}
contacts: {{ab: {{between: [a, b], open: true, static: 0.2, restitution: {e}}}}}
simulation: {{t_end: 0.25, samples: 2}}
"""


@pytest.mark.parametrize(("x", "width"), [(0, 0.1), (1e-15, 0.1), (-1e-12, 0.1), (1e-10, 0.1), (1e-9, 0.1), (0.1, 0.3)])
def test_a_crate_dropped_flush_lies_flat(x: float, width: float) -> None:
    found = mbs.simulate(mbs.loads(DROPPED.format(x=x, width=width, e=0))).q[-1]
    assert found == pytest.approx([x, 0.1, 0], abs=1e-12)


def test_a_crate_dropped_flush_bounces_upright() -> None:
    """It falls 0.1 m in sqrt(0.02) s and comes up with half its speed."""
    run, t = mbs.simulate(mbs.loads(DROPPED.format(x=0, width=0.1, e=0.5))), 0.25 - math.sqrt(0.02)
    assert run.q[-1] == pytest.approx([0, 0.1 + math.sqrt(2) / 2 * t - 5 * t**2, 0], abs=1e-9)


TILES = """\
multibody_sym: 1
name: tiles
gravity: [0, -10, 0]
bodies:
  a: {shape: {box: [0.1, 0.1, 0.1], mass: 1}}
  left: {shape: {box: [0.3, 0.1, 0.1], mass: 1}}
  right: {shape: {box: [0.3, 0.1, 0.1], mass: 1}}
  ground: {points: {l: [-0.15, 0, 0], r: [0.15, 0, 0]}}
joints:
  ja: {type: planar, parent: ground, child: a, q: [x, y, p], initial: {q: [-0.1, 0.1, 0], u: [1, 0, 0]}}
  jl: {type: fixed, parent: ground.l, child: left}
  jr: {type: fixed, parent: ground.r, child: right}
contacts: {l: {between: [a, left], static: 0.1}, r: {between: [a, right], open: true, static: 0.1}}
simulation: {t_end: 0.2, samples: 2}
"""


def test_a_crate_slides_from_one_box_onto_the_next_one() -> None:
    """The corner of the crate passes the corner of the next box, whose left side begins there, without an impact."""
    run = mbs.simulate(mbs.loads(TILES))
    assert run.q[-1] == pytest.approx([-0.1 + 0.2 - 0.02, 0.1, 0], abs=1e-9)
    assert not run.impact_losses


BOARDS = """\
multibody_sym: 1
name: boards
gravity: [0, -10, 0]
bodies:
  a: {shape: {box: [0.4, 0.2, 0.2], mass: 2}}
  left: {shape: {box: [4, 0.4, 1], mass: 50}}
  right: {shape: {box: [4, 0.4, 1], mass: 50}}
  ground: {points: {l: [-2, -0.2, 0], r: [2, -0.2, 0]}}
joints:
  ja: {type: planar, parent: ground, child: a, q: [x, y, p], initial: {q: [-0.5, 0.1, 0], u: [2, 0, 0]}}
  jl: {type: fixed, parent: ground.l, child: left}
  jr: {type: fixed, parent: ground.r, child: right}
contacts: {l: {between: [a, left.top], kinetic: 0.2}, r: {between: [a, right], kinetic: 0.2}}
simulation: {t_end: 1.2, samples: 2}
"""


def test_a_crate_slides_over_the_seam_of_boards_much_longer_than_it_is() -> None:
    """A billionth of the model is near, and far for small faces: the crate stops after v^2/(2 mu g) = 1 m."""
    run = mbs.simulate(mbs.loads(BOARDS))
    assert run.q[-1] == pytest.approx([0.5, 0.1, 0], abs=1e-9)
    assert not run.impact_losses


ON_A_CART = """\
multibody_sym: 1
name: on_a_cart
gravity: [0, -10, 0]
bodies: {cart: {shape: {box: [0.2, 0.2, 1], mass: 50}}, b: {shape: {box: [0.2, 0.5, 0.2], mass: 3}}}
joints:
  jc: {type: prismatic, parent: ground, child: cart, axis: x, motion: 4.2*t^2/2}
  jb: {type: planar, parent: ground, child: b, q: [x, y, p], initial: {q: [0, 0.35, 0]}}
contacts: {c: {between: [b, cart.top], static: 0.8}}
simulation: {t_end: 0.6, samples: 2}
"""


def test_a_box_tips_from_the_start_on_a_cart_as_wide_as_it_is() -> None:
    """It turns about the corner at which both bodies have one, whose rows are alike at the start alone."""
    inertia = (0.2**2 + 0.5**2) / 12 + 0.1**2 + 0.25**2

    def rate(_: float, y: list[float]) -> list[float]:
        along, above = (0.1 * math.cos(y[0]) - 0.25 * math.sin(y[0]), 0.1 * math.sin(y[0]) + 0.25 * math.cos(y[0]))
        return [y[1], (4.2 * above - 10 * along) / inertia]

    turned = solve_ivp(rate, (0, 0.6), [0, 0], rtol=1e-10, atol=1e-12).y[0, -1]
    assert mbs.simulate(mbs.loads(ON_A_CART)).q[-1, 2] == pytest.approx(turned, abs=1e-8)


ENDS = """\
multibody_sym: 1
name: faces_that_end
gravity: [0, 0, 0]
bodies:
  a: {mass: 1, surfaces: {right: {plane: [0, 0, 0], normal: x, between: [[0, 1, 0], [0, 0, 0]]}}}
  b: {mass: 1, surfaces: {left: {plane: [0, 0, 0], normal: -x, between: [[0, 0, 0], [0, 1, 0]]}}}
joints:
  ja: {type: prismatic, parent: ground, child: a, axis: x, q: xa, initial: {u: 1}}
  jb: {type: prismatic, parent: ground, child: b, axis: x, q: xb, initial: {q: 1}}
contacts: {hit: {between: [a.right, b.left], restitution: 0.3}}
simulation: {t_end: 2, samples: 2}
"""


def test_planes_that_end_strike_each_other_flush() -> None:
    """Faces and ends of both have names of their own."""
    run = mbs.simulate(mbs.loads(ENDS))
    assert run.u[-1] == pytest.approx([0.35, 0.65], abs=1e-12)
    names = {event["element"] for event in run.events}
    assert names == {"hit.face.end1", "hit.face.end2", "hit.end1.face", "hit.end2.face"}
