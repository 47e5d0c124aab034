"""Statics: beams on supports and frames, by hand, by bodies cut free (d'Alembert) and by virtual work."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.text.printer import text

ROUTES = {"bodies cut free": "newton_euler", "virtual work": "dalembert_lagrange", "recursion": "composite_body"}

BEAM = """\
multibody_sym: 1
name: beam
gravity: [0, -g, 0]
parameters: {g: {value: 10, positive: true}, l: {value: 4 m, positive: true}, a: 1 m, m: {value: 30 kg, positive: true},
  F: 200 N, q0: 50 N/m}
bodies:
  ground: {points: {left: [0, 0, 0], right: [l - a, 0, 0]}}
  beam: {shape: {rod: l, mass: m}, points: {under: [l - a, 0, 0], tip: [l, 0, 0], third: [2*l/3, 0, 0]}}
joints: {A: {type: revolute, parent: ground.left, child: beam, axis: z}}
constraints: {B: {type: point_in_plane, point: beam.under, plane: {through: ground.right, normal: y}}}
forces:
  end: {type: force, on: beam, at: tip, value: [0, -F, 0]}
  triangle: {type: force, on: beam, at: third, value: [0, -q0*l/2, 0]}   # a load that grows to q0: its resultant
"""

ARCH = """\
multibody_sym: 1
name: three hinges
gravity: [0, 0, 0]
parameters: {a: {value: 2 m, positive: true}, h: {value: 3 m, positive: true}, P: 120 N, Q: 40 N}
bodies:
  ground: {points: {right: [2*a, 0, 0]}}
  left: {mass: 1, inertia: {Izz: 1}, points: {top: [a, h, 0], loaded: [a/2, h, 0]}}
  half: {mass: 1, inertia: {Izz: 1}, points: {top: [-a, h, 0], side: [0, h/2, 0]}}
joints:
  A: {type: revolute, parent: ground, child: left, axis: z}
  B: {type: revolute, parent: ground.right, child: half, axis: z}
  C: {type: revolute, parent: left.top, child: half.top, axis: z, cut: true}
forces:
  down: {type: force, on: left, at: loaded, value: [0, -P, 0]}
  wind: {type: force, on: half, at: side, value: [-Q, 0, 0]}
"""


@pytest.mark.parametrize("route", ROUTES)
def test_a_beam_on_two_supports(route):
    """Moments about A: B (l - a) = m g l/2 + F l + (q0 l/2) (2 l/3)."""
    found = mbs.solve(mbs.loads(BEAM), formalism=ROUTES[route])
    B = (30 * 10 * 2 + 200 * 4 + 100 * 8 / 3) / 3
    A = 300 + 200 + 100 - B
    (support,) = found.reactions["B"].values()
    assert support.value == pytest.approx(B, rel=1e-12)
    assert found.reactions["A"]["fy"].value == pytest.approx(A, rel=1e-12)
    assert found.reactions["A"]["fx"].value == pytest.approx(0.0, abs=1e-12)
    assert {x.value for x in found.accelerations.values()} == {0.0}
    assert "l - a" in text(support.expression)


@pytest.mark.parametrize("route", ROUTES)
def test_a_frame_with_three_hinges(route):
    """Moments about A of all, and about C of the right half alone."""
    found = mbs.solve(mbs.loads(ARCH), formalism=ROUTES[route])
    a, h, P, Q = 2.0, 3.0, 120.0, 40.0
    By = (P * a / 2 - Q * h / 2) / (2 * a)
    Bx = (Q * h / 2 - By * a) / h  # about C: By a + Bx h - Q h/2 = 0, Bx to the right
    at_B, at_A = found.reactions["B"], found.reactions["A"]
    assert (at_B["fx"].value, at_B["fy"].value) == pytest.approx((Bx, By), rel=1e-12)
    assert (at_A["fx"].value, at_A["fy"].value) == pytest.approx((Q - Bx, P - By), rel=1e-12)


def test_a_propped_beam_tells_that_its_reactions_are_not_unique():
    """A third support makes it indeterminate: reactions of rigid bodies are withheld, not made up."""
    more = ", C: {type: point_in_plane, point: beam.tip, plane: {through: ground, normal: y}}}"
    third = BEAM.replace("normal: y}}}\nforces", "normal: y}}" + more + "\nforces")
    found = mbs.solve(mbs.loads(third))
    assert not any(x.unique for name in ("B", "C") for x in found.reactions[name].values())
    assert set(found.not_unique) >= {"B", "C"}


def test_supports_that_only_push_say_which_load_lifts_the_beam():
    """On two trestles it tips where the load beyond the right one outweighs it: F a = m g (l/2 - a)."""
    trestles = BEAM[: BEAM.index("joints:")].replace("{left: [0, 0, 0], right: [l - a, 0, 0]}", "{o: [0, 0, 0]}")
    trestles = trestles.replace("ground: {points", "ground: {surfaces: {top: {plane: [0, 0, 0], normal: y}}, points")
    trestles = (
        trestles.replace("points: {under", "points: {first: [0, 0, 0], under")
        + """\
joints: {A: {type: planar, parent: ground, child: beam}}
contacts:
  left: {between: [beam.first, ground.top], static: 0.3}
  right: {between: [beam.under, ground.top], static: 0.3}
forces: {end: {type: force, on: beam, at: tip, value: [0, -F, 0]}}
"""
    )
    found = mbs.range_of_rest(mbs.loads(trestles), "F")
    high = found.ends[0][1]
    assert high.value == pytest.approx(300 * (2 - 1) / 1, rel=1e-12)
    assert high.gives_way == ("lifts off at left",)
    assert text(high.expression) in ("g*m*(l - 2*a)/(2*a)", "g*m*(l/2 - a)/a")
