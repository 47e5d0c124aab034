"""Velocities, accelerations and instantaneous centres that `ask` asks for, against differentiated positions."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.document import worked_document, write_document
from multibody_sym.pictures.page.picture import Arrow, Stroke

_SLIDER_CRANK = """
multibody_sym: 1
name: slider_crank
parameters: {r: 0.1 m, l: 0.3 m, w: 10 rad/s, theta: 0.7}
bodies: {crank: {points: {pin: [r, 0, 0]}}, rod: {points: {pin: [l, 0, 0]}}, slider: {}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, motion: theta + w*t}
  B: {type: revolute, parent: crank.pin, child: rod, axis: z, q: psi}
  D: {type: prismatic, parent: ground, child: slider, axis: x, q: s, initial: {q: 0.3}}
  C: {type: revolute, parent: rod.pin, child: slider, axis: z, cut: true}
ask: {v: {velocity: rod.pin}, a: {acceleration: rod.pin}, pole: {instant_center: rod}}
"""
_FOUR_BAR = """
multibody_sym: 1
name: four_bar
parameters: {a: 0.1 m, b: 0.3 m, c: 0.25 m, d: 0.35 m, w: 10 rad/s, theta: 0.7}
bodies:
  ground: {points: {D: [d, 0, 0]}}
  crank: {points: {pin: [a, 0, 0]}}
  coupler: {points: {pin: [b, 0, 0]}}
  rocker: {points: {pin: [c, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, motion: theta + w*t}
  B: {type: revolute, parent: crank.pin, child: coupler, axis: z, q: psi, initial: {q: -0.2}}
  D: {type: revolute, parent: ground.D, child: rocker, axis: z, q: chi, initial: {q: 1.9}}
  C: {type: revolute, parent: coupler.pin, child: rocker.pin, axis: z, cut: true}
ask: {v: {velocity: coupler.pin}, a: {acceleration: coupler.pin}, pole: {instant_center: coupler}}
"""
_WHEEL = """
multibody_sym: 1
name: wheel
parameters: {R: 0.3 m, v0: 2 m/s, b: 1 m/s^2}
bodies: {hub: {}, wheel: {points: {edge: [R, 0, 0]}}}
joints:
  H: {type: prismatic, parent: ground, child: hub, axis: x, motion: v0*t + b*t^2/2}
  A: {type: revolute, parent: hub, child: wheel, axis: z, q: phi}
constraints: {roll: {type: velocity, zero: u_phi*R + v0 + b*t}}
ask: {v: {velocity: wheel.edge}, a: {acceleration: wheel.edge}, pole: {instant_center: wheel}}
"""
_LADDER = """
multibody_sym: 1
name: ladder
parameters: {l: 3 m, v0: 0.5 m/s, x0: 1 m}
bodies: {foot: {}, ladder: {points: {top: [l, 0, 0]}}}
joints:
  F: {type: prismatic, parent: ground, child: foot, axis: x, motion: x0 + v0*t}
  A: {type: revolute, parent: foot, child: ladder, axis: z, q: phi, initial: {q: 110 deg}}
constraints: {wall: {type: point_on_line, point: ladder.top, line: {through: ground.origin, direction: y}}}
ask: {v: {velocity: ladder.top}, a: {acceleration: ladder.top}, pole: {instant_center: ladder}}
"""
_QUICK_RETURN = """
multibody_sym: 1
name: quick_return
parameters: {h: 0.3 m, r: 0.1 m, w: 5 rad/s, phi: 0.4}
bodies:
  ground: {points: {O: [0, h, 0]}}
  crank: {points: {pin: [r, 0, 0]}}
  block: {}
  arm: {points: {tip: [0.6, 0, 0]}}
joints:
  O: {type: revolute, parent: ground.O, child: crank, axis: z, motion: phi + w*t}
  A: {type: revolute, parent: ground, child: arm, axis: z, q: psi, initial: {q: 1.2}}
  S: {type: prismatic, parent: arm, child: block, axis: x, q: s, initial: {q: 0.35}}
  B: {type: revolute, parent: crank.pin, child: block, axis: z, cut: true}
ask: {v: {velocity: arm.tip}, a: {acceleration: arm.tip}, pole: {instant_center: block}}
"""


@cache
def _solved(text: str, *, steps: bool = False) -> mbs.Solution:
    return mbs.solve(mbs.loads(text), steps=steps)


# Positions as complex numbers by the geometry of each mechanism, at a time.


def _turned(length: float, angle: float) -> complex:
    return complex(length * np.cos(angle), length * np.sin(angle))


def _slider(t: float) -> complex:
    pin = _turned(0.1, 0.7 + 10.0 * t)
    return complex(pin.real + np.sqrt(0.09 - pin.imag**2))


def _coupler_pin(t: float) -> complex:
    """Return where circles of 0.3 about the crank's pin and of 0.25 about D meet, above the ground."""
    pin, ground = _turned(0.1, 0.7 + 10.0 * t), 0.35 + 0j
    apart = abs(ground - pin)
    way = (0.3**2 - 0.25**2 + apart**2) / (2.0 * apart)
    return pin + (way + 1j * np.sqrt(0.3**2 - way**2)) * (ground - pin) / apart


def _edge(t: float) -> complex:
    x = 2.0 * t + t * t / 2.0
    return x + _turned(0.3, -x / 0.3)


def _top(t: float) -> complex:
    return 1j * np.sqrt(9.0 - (1.0 + 0.5 * t) ** 2)


def _tip(t: float) -> complex:
    pin = 0.3j + _turned(0.1, 0.4 + 5.0 * t)
    return 0.6 * pin / abs(pin)


def _meeting(p: complex, along: complex, q: complex, other: complex) -> complex:
    """Return where two lines meet."""
    matrix = np.array([[along.real, -other.real], [along.imag, -other.imag]])
    k, _ = np.linalg.solve(matrix, [(q - p).real, (q - p).imag])
    return complex(p + k * along)


_PIN = 0.3j + _turned(0.1, 0.4)
_CASES = {  # by the theorem of Aronhold and Kennedy: centres of three bodies lie on a line
    "slider_crank": (_SLIDER_CRANK, 1e-4, _slider, _meeting(0, _turned(1, 0.7), _slider(0), 1j)),
    "four_bar": (_FOUR_BAR, 1e-4, _coupler_pin, _meeting(0, _turned(1, 0.7), 0.35, _coupler_pin(0) - 0.35)),
    "wheel": (_WHEEL, 1e-3, _edge, -0.3j),
    "ladder": (_LADDER, 5e-3, _top, _meeting(1, 1j, _top(0), 1)),
    "quick_return": (_QUICK_RETURN, 2e-4, _tip, _meeting(0.3j, _PIN - 0.3j, 0, 1j * _PIN)),
}


def _vector(found: mbs.Solution, name: str) -> complex:
    x, y = (found.answers[f"{name}.{axis}"].value for axis in "xy")
    assert x is not None
    assert y is not None
    return complex(x, y)


@pytest.mark.parametrize(("text", "step", "place", "pole"), _CASES.values(), ids=_CASES)
def test_motion_of_points_and_centre_of_bodies(
    text: str, step: float, place: Callable[[float], complex], pole: complex
) -> None:
    found = _solved(text)
    around = [place(k * step) for k in (-2, -1, 0, 1, 2)]
    v = (around[0] - 8 * around[1] + 8 * around[3] - around[4]) / (12 * step)
    a = (-around[0] + 16 * around[1] - 30 * around[2] + 16 * around[3] - around[4]) / (12 * step**2)
    assert abs(_vector(found, "v") - v) <= 1e-9 * abs(v)
    assert abs(_vector(found, "a") - a) <= 1e-7 * abs(a)
    assert abs(_vector(found, "pole") - pole) <= 1e-12
    for name, size in (("v", abs(v)), ("a", abs(a))):
        assert found.answers[name].value == pytest.approx(size, rel=1e-7)
    assert all(x.expression is not None for x in found.answers.values())
    assert found.reactions == {}  # no forces unless asked


def _lines(found: mbs.Solution) -> str:
    assert found.steps is not None
    return " ".join(write_document(worked_document(found.steps), "text").split())


def test_velocity_of_a_slider_is_as_short_as_in_a_book() -> None:
    found = _solved(_SLIDER_CRANK).answers["v.x"]
    assert str(found).rpartition(" = ")[0] == "-r*w*sin(theta)*(r*cos(theta)/sqrt(l^2 - r^2*sin(theta)^2) + 1)"


def test_steps_go_from_body_to_body() -> None:
    found = _solved(_QUICK_RETURN, steps=True)
    place = 0.3j + _turned(0.1, 0.4)
    assert str(found.assembled["s"]).startswith("sqrt(2*h*r*sin(phi) + h^2 + r^2) = ")
    assert found.assembled["s"].value == pytest.approx(abs(place), rel=1e-12)
    assert str(found.assembled["psi"]).startswith("atan2(h + r*sin(phi), r*cos(phi)) = ")
    lines = _lines(found)
    assert "from how loops close: s = sqrt(h^2 + r^2 + 2*h*r*sin(phi))" in lines
    assert "cut free" not in lines
    assert "Elimination" not in lines
    assert "along x: s'*cos(psi) - omega_arm*s*sin(psi) = -r*w*sin(phi)" in lines
    assert "so: omega_arm = r*w*cos(phi - psi)/s" in lines
    assert "- 2*omega_arm*s'*sin(psi)" in lines  # Coriolis


def test_plans_of_velocities_and_accelerations_are_to_scale() -> None:
    """The pin has r*w and r*w^2; the difference of both ends of the rod is square to it in the plan of velocities."""
    picture = mbs.draw(mbs.loads(_SLIDER_CRANK), diagrams=True).picture
    assert "Plan of velocities: crank.pin 1 m/s, rod.pin" in picture.description
    plans = {name: [x for x in picture.marks if x.role == "plan" and x.name == name] for name in _PLANS}
    for name, quantity in _PLANS.items():
        pin, end = (mark.points[1] - mark.points[0] for mark in plans[name] if isinstance(mark, Arrow))
        value = _solved(_SLIDER_CRANK).answers[quantity].value
        assert value is not None
        largest = {"velocities": 1.0, "accelerations": 10.0}[name]
        assert np.hypot(*end) / np.hypot(*pin) == pytest.approx(value / largest, rel=1e-9)
    (across,) = (mark.points for mark in plans["velocities"] if isinstance(mark, Stroke))
    rod = complex(_slider(0)) - _turned(0.1, 0.7)
    assert (across[1] - across[0]) @ [rod.real, rod.imag] == pytest.approx(0.0, abs=1e-9)


_PLANS = {"velocities": "v", "accelerations": "a"}


def test_loops_are_closed_first_and_their_speeds_keep_letters() -> None:
    """A Scotch yoke at 90 degrees has no cosine to divide by; steps define each letter of a four-bar's acceleration."""
    text = _SLIDER_CRANK.partition("bodies:")[0].replace("0.7", "90 deg") + """
bodies: {crank: {points: {pin: [r, 0, 0]}}, block: {}, yoke: {}}
joints:
  O: {type: revolute, parent: ground, child: crank, axis: z, motion: theta + w*t}
  Y: {type: prismatic, parent: ground, child: yoke, axis: x, q: x}
  S: {type: prismatic, parent: yoke, child: block, axis: y, q: y}
  B: {type: revolute, parent: crank.pin, child: block, axis: z, cut: true}
ask: {v: {velocity: yoke}, a: {acceleration: yoke}, turning: "angular_velocity(crank, z)"}
"""
    yoke = _solved(text, steps=True)
    assert yoke.answers["v.x"].value == pytest.approx(-1.0, rel=1e-12)
    assert yoke.reactions == {}  # an angular velocity needs no forces either
    assert "along x: x' = -r*w*sin(theta)" in _lines(yoke)
    assert "as for v, down to: y' = r*w*cos(theta)" in _lines(yoke)
    bar = _lines(_solved(_FOUR_BAR, steps=True))
    assert "along x: d + c*cos(chi) = a*cos(theta) + b*cos(theta + psi)" in bar
    assert "with: psi' = omega_coupler - w" in bar
    assert "a_psi" not in bar


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        ("{velocity: rod.pim}", "no point or body is called 'rod.pim'"),
        ("{instant_center: bar}", "no body is called 'bar'"),
        ("{velocity: rod.pin, after: 1 s}", "is no known question"),
    ],
)
def test_wrong_questions(ask: str, message: str) -> None:
    with pytest.raises(mbs.ModelError, match=message):
        mbs.solve(mbs.loads(_SLIDER_CRANK.replace("{velocity: rod.pin}", ask)))


_PLANET = """
multibody_sym: 1
name: planet
parameters: {r1: 40 mm, r2: 100 mm, w1: 30 rad/s, w2: -6 rad/s}
bodies:
  sun: {surfaces: {rim: {disc: r1}}}
  ring: {surfaces: {rim: {disc: r2, inside: true}}}
  arm: {points: {P: [(r1 + r2)/2, 0, 0]}}
  planet: {surfaces: {rim: {disc: (r2 - r1)/2}}, points: {rim: [0, (r2 - r1)/2, 0]}}
joints:
  S: {type: revolute, parent: ground, child: sun, motion: w1*t}
  R: {type: revolute, parent: ground, child: ring, motion: w2*t}
  C: {type: revolute, parent: ground, child: arm, q: c}
  P: {type: revolute, parent: arm.P, child: planet, q: p}
constraints:
  inner: {type: rolling, body: planet.rim, on: sun.rim}
  outer: {type: rolling, body: planet.rim, on: ring.rim}
ask:
  wp: angular_velocity(planet, z)
  wc: u_c
  v: {velocity: planet.rim}
  part: v.y/v
"""


def test_rolling_wheels_turn_by_the_velocities_of_their_points_of_contact() -> None:
    """The points of contact move with r1*w1 and r2*w2; the centre with their mean."""
    found = _solved(_PLANET, steps=True)
    inner, outer = 0.04 * 30.0, 0.1 * -6.0
    turning, centre = (outer - inner) / 0.06, (inner + outer) / 2
    v = complex(-0.03 * turning, centre)
    for name, value in {"wp": turning, "wc": centre / 0.07, "part": centre / abs(v)}.items():
        assert found.answers[name].value == pytest.approx(value, rel=1e-12)
    lines = _lines(found)
    assert "cut free" not in lines
    assert "inner: one velocity where both touch: (r2 - r1)*omega_planet/2 - (r1 + r2)*omega_arm/2 + r1*w1 = 0" in lines
    assert "so: omega_planet = (r2*w2 - r1*w1)/(r2 - r1)" in lines
    assert "wc: u_c as for wp" in lines


def test_gears_and_velocity_constraints_have_velocity_equations() -> None:
    """A rack drives a pinion, which drives a wheel: v = r*u_a and r*u_a = -R*u_b."""
    found = _solved(
        """
multibody_sym: 1
name: rack
parameters: {r: 0.1 m, R: 0.25 m, v: 0.4 m/s}
bodies: {rack: {}, pinion: {}, wheel: {}}
joints:
  S: {type: prismatic, parent: ground, child: rack, axis: x, motion: v*t}
  A: {type: revolute, parent: ground, child: pinion, q: a}
  B: {type: revolute, parent: ground, child: wheel, q: b}
constraints:
  teeth: {type: velocity, zero: v - r*u_a}
  mesh: {type: gear, joints: [B, A], ratio: -r/R}
ask: {wheel: "angular_velocity(wheel, z)"}
""",
        steps=True,
    )
    assert found.answers["wheel"].value == pytest.approx(-1.6, rel=1e-12)
    assert "teeth: velocity equation: -r*a' = -v mesh: velocity equation: r*a'/R + b' = 0 so: a' = v/r" in _lines(found)


def test_speeds_of_loops_are_no_answers() -> None:
    """A rod with two joints in place of the coupler: how the rocker turns has a formula without its own speed."""
    rod = "constraints: {B: {type: distance, between: [crank.A, rocker.B], value: b}}\n"
    bodies = "bodies:\n  ground: {points: {D: [d, 0, 0]}}\n  crank: {points: {A: [a, 0, 0]}}\n"
    joints = "joints:\n  A: {type: revolute, parent: ground, child: crank, motion: theta + w*t}\n"
    text = (
        f"{_FOUR_BAR.partition('bodies:')[0]}{bodies}  rocker: {{points: {{B: [c, 0, 0]}}}}\n{joints}"
        f"  D: {{type: revolute, parent: ground.D, child: rocker, q: chi, initial: {{q: 1.2}}}}\n{rod}"
        "ask: {w3: 'angular_velocity(rocker, z)', al3: chi''}\n"
    )
    found = _solved(text, steps=True)
    h = 1e-4  # s
    angle = [np.angle(_coupler_pin(k * h) - 0.35) for k in (-1, 0, 1)]
    assert found.answers["w3"].value == pytest.approx((angle[2] - angle[0]) / (2 * h), rel=1e-5)
    assert found.answers["al3"].value == pytest.approx((angle[2] - 2 * angle[1] + angle[0]) / h**2, rel=1e-5)
    assert "u_chi" not in str(found.answers["w3"].expression)
    lines = _lines(found)
    assert "B: velocity along it: " in lines
    assert "B: rate of its velocity equation: " in lines


def test_a_body_in_space_has_an_axis_and_no_centre() -> None:
    text = _WHEEL.replace("child: wheel, axis: z", "child: wheel, axis: y")
    with pytest.raises(mbs.ModelError, match="instantaneous centre where all moves in the plane"):
        mbs.solve(mbs.loads(text))


def test_a_body_that_only_slides_has_no_centre() -> None:
    found = mbs.solve(mbs.loads(_WHEEL.replace("instant_center: wheel", "instant_center: hub")))
    assert found.answers["pole"].value is None
    assert "pole: hub does not turn, and has no instantaneous centre" in found.conditions
