"""Extremes at kinks of tables, jumps of forces and impacts, where no sample is: by hand and by scipy's spline."""

from __future__ import annotations

import math
from typing import Any

import pytest
from scipy.interpolate import CubicSpline

import multibody_sym as mbs

SLIDE = """
multibody_sym: 1
name: pushed
parameters: {m: 2 kg, F: 10 N}
bodies: {a: {mass: m}}
joints: {A: {type: prismatic, axis: x, parent: ground, child: a, q: x, initial: {q: 0, u: 1}}}
forces: {f: {type: torque, joint: A, value: FORCE}}
inputs: {w: {table: [[0, 0], [1.1, 2], [2.3, -1], [3.1, 4], [4, 0]], interpolation: KIND, dimension: N}}
simulation: {t_end: 6 s}
ask:
"""


def answers(text: str) -> dict[str, Any]:
    return mbs.solve(mbs.loads(text)).answers


def test_a_force_that_jumps_turns_the_speed_at_its_jump() -> None:
    text = SLIDE.replace("FORCE", '"where(t < 1.3, F, -F)"').replace("KIND", "linear")
    found = answers(
        f"{text}  top: {{max: u_x}}\n  power: {{max: \"F*u_x*where(t < 1.3, 1, 0.5)\"}}\n"
        "  F0: {find: F, so: top == 10, between: [5, 20]}\n  near: {min: abs(x - 1.7)}\n"
    )
    assert (found["top"].value, found["top"].t) == pytest.approx((7.5, 1.3), rel=1e-12)
    assert (found["power"].value, found["power"].t) == pytest.approx((75.0, 1.3), rel=1e-9)
    assert found["F0"].value == pytest.approx(18 / 1.3, rel=1e-9)
    assert found["near"].value == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("kind", ["linear", "cubic"])
def test_a_table_has_its_extremes_at_its_knots(kind: str) -> None:
    found = answers(f"{SLIDE.replace('FORCE', 'w').replace('KIND', kind)}  least: {{min: w}}\n  most: {{max: w}}\n")
    x, y = [0, 1.1, 2.3, 3.1, 4], [0, 2, -1, 4, 0]
    if kind == "linear":
        assert (found["least"].value, found["least"].t) == pytest.approx((-1.0, 2.3), rel=1e-12)
        assert (found["most"].value, found["most"].t) == pytest.approx((4.0, 3.1), rel=1e-12)
        return
    spline = CubicSpline(x, y, bc_type="natural")
    turns = [t for t in spline.derivative().roots() if 0 < t < 4]
    for name, which in (("least", min), ("most", max)):
        assert found[name].value == pytest.approx(which(float(spline(t)) for t in turns), rel=1e-9)


def test_a_ball_is_fastest_behind_an_impact() -> None:
    """A ball on a floor is struck by one above it, so that it bounces back up faster than it fell."""
    text = """
multibody_sym: 1
name: stack
gravity: [0, -g, 0]
parameters: {g: 9.81, e: 0.6}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  a: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
  b: {mass: 2}
joints:
  A: {type: prismatic, axis: y, parent: ground, child: a, q: ya, initial: {q: 1}}
  B: {type: prismatic, axis: y, parent: ground, child: b, q: yb, initial: {q: 1.7}}
contacts:
  floor: {between: [a, ground.floor], restitution: e, open: true}
  head: {between: [b, a.top], restitution: e, open: true}
ask: {fastest: {max: u_ya, until: 0.7 s}}
simulation: {t_end: 1 s}
"""
    t, g, e, m, heavy, ya, yb, ua, ub, speeds = 0.0, 9.81, 0.6, 1.0, 2.0, 1.0, 1.7, 0.0, 0.0, []
    for _ in range(6):
        lands = (ua + math.sqrt(ua * ua + 2 * g * ya)) / g
        meets = (yb - ya) / (ua - ub) if ua > ub and yb > ya + 1e-12 else math.inf
        step = min(lands, meets)
        ya, yb = ya + (ua - g * step / 2) * step, yb + (ub - g * step / 2) * step
        ua, ub, t = ua - g * step, ub - g * step, t + step
        if lands < meets:
            ya, ua = 0.0, -e * ua
        else:
            p = (1 + e) * (ua - ub) * m * heavy / (m + heavy)
            ua, ub, yb = ua - p / m, ub + p / heavy, ya
        speeds.append((ua, t))
    found = answers(text)["fastest"]
    assert (found.value, found.t) == pytest.approx(max(speeds), rel=1e-9)


BOUNCING = """
multibody_sym: 1
name: bouncing
gravity: [0, -9.81, 0]
bodies: {b: {mass: 1 kg}}
joints:
  h: {type: prismatic, parent: ground, child: b, axis: y, q: w, initial: {q: 0.1}, limits: {lower: 0, restitution: E}}
"""


def test_a_bouncing_ball_is_lowest_first_at_its_first_impact() -> None:
    asked = "low: {min: w, until: 1 s}, up: {max: u_w}, later: {min: w, after: 0.2 s}, f: {max: force(h.lower)}"
    found = answers(BOUNCING.replace("E", "0.4") + f"ask: {{{asked}}}\nsimulation: {{t_end: 1 s}}\n")
    first = math.sqrt(2 * 0.1 / 9.81)
    assert found["low"].t == pytest.approx(first, rel=1e-9)
    assert str(found["low"]) == f"0 m at t = {first:.10g} s"
    assert found["up"].value == pytest.approx(0.4 * 9.81 * first, rel=1e-9)
    assert found["up"].t == pytest.approx(first, rel=1e-9)
    assert found["later"].t == pytest.approx(1.8 * first, rel=1e-9)
    assert (found["f"].value, found["f"].t) == pytest.approx((9.81, first * (1 + 2 * 0.4 / 0.6)), rel=1e-9)


def test_of_equal_speeds_beside_impacts_the_first_is_told() -> None:
    asked = "ask: {up: {max: u_w}, down: {min: u_w}, again: {max: u_w, after: 0.3 s}, high: {max: w, after: 0.1 s}}\n"
    found = answers(BOUNCING.replace("E", "1") + asked + "simulation: {t_end: 4 s}\n")
    first = math.sqrt(2 * 0.1 / 9.81)
    for name, value, t in (
        ("up", 9.81 * first, first),
        ("down", -9.81 * first, first),
        ("again", 9.81 * first, 3 * first),
        ("high", 0.1, 2 * first),
    ):
        assert found[name].value == pytest.approx(value, rel=1e-8), name
        assert found[name].t == pytest.approx(t, rel=1e-7), name


def test_a_weight_on_a_rope_that_bounces_is_lowest_first_where_it_tautens_first() -> None:
    text = """
multibody_sym: 1
name: rope
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {h: [0, 0, 0]}}
  w: {mass: 1 kg}
joints: {j: {type: point, parent: ground, child: w, initial: {q: [0, -0.5]}}}
constraints: {r: {type: rope, path: [ground.h, w], length: 1 m, slack: true, restitution: 0.5}}
stop: {done: r tautens}
ask: {low: {min: j_y}}
"""
    found = answers(text)["low"]
    assert (found.value, found.t) == pytest.approx((-1.0, math.sqrt(2 * 0.5 / 9.81)), rel=1e-9)


@pytest.mark.parametrize(
    ("force", "least", "most"),
    [
        ("where(t < 0.7123, t, where(t < 1.4246, t - 0.7123, 0))", (0.0, 0.0), (0.7123, 0.7123)),
        ("where(t < 0.3, 0, where(t < 0.94, 2, where(t < 1.11, -1, where(t < 1.5, 2, -1))))", (-1.0, 0.94), (2.0, 0.3)),
    ],
)
def test_of_equal_values_at_jumps_the_first_is_told(
    force: str, least: tuple[float, float], most: tuple[float, float]
) -> None:
    """The expression leaps back as often as it comes to its extremes, between samples."""
    text, asked = SLIDE.replace("FORCE", "F").replace("KIND", "linear"), f'"{force}", until: 2 s'
    found = answers(f"{text}  least: {{min: {asked}}}\n  most: {{max: {asked}}}\n")
    assert (found["least"].value, found["least"].t) == pytest.approx(least, rel=1e-9, abs=1e-12)
    assert (found["most"].value, found["most"].t) == pytest.approx(most, rel=1e-9)


def test_of_equal_knots_of_a_table_the_first_is_told() -> None:
    text = SLIDE.replace("FORCE", "w").replace("KIND", "linear")
    text = text.replace("[1.1, 2], [2.3, -1], [3.1, 4], [4, 0]", "[1.10041, 2], [2, -1], [3.1, 2], [4, -1]")
    found = answers(f"{text}  least: {{min: w}}\n  most: {{max: w}}\n")
    assert [(found[x].value, found[x].t) for x in ("least", "most")] == [(-1.0, 2.0), (2.0, 1.10041)]


def test_a_force_of_a_motion_by_a_spline_is_largest_at_a_knot_of_it() -> None:
    x, y = [0, 0.3, 0.9, 1.5, 2], [0, 0.1, 0.4, 0.2, 0.3]
    text = f"""
multibody_sym: 1
name: carried
bodies: {{b: {{mass: 2 kg}}}}
joints: {{jb: {{type: prismatic, parent: ground, child: b, axis: x, motion: prof}}}}
inputs: {{prof: {{table: {[list(row) for row in zip(x, y, strict=True)]}, interpolation: cubic, dimension: m}}}}
ask: {{most: {{max: fx(jb), until: 2 s}}, least: {{min: fx(jb), until: 2 s}}}}
simulation: {{t_end: 2 s}}
"""
    forces = 2 * CubicSpline(x, y, bc_type="natural")(x, 2)
    found = answers(text)
    for name, k in (("most", forces.argmax()), ("least", forces.argmin())):
        assert found[name].value == pytest.approx(float(forces[k]), rel=1e-11)
        assert found[name].t == x[k]
        assert str(found[name]).endswith(f"at t = {x[k]} s")


PUSHED = """
multibody_sym: 1
name: pushed
gravity: [0, -9.81, 0]
parameters: {al: 0.3, k: 3}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: [-sin(al), cos(al), 0]}}}
  b: {mass: 1 kg}
joints: {h: {type: point, parent: ground, child: b, initial: {u: [3*cos(al), 3*sin(al)]}}}
contacts: {c: {between: [b, ground.floor], static: 0.5}}
forces: {f: {type: force, on: b, value: [k*t, 0, 0]}}
ask: {least: {min: friction(c)}, sticks: c sticks}
simulation: {t_end: 0.7 s}
"""


def test_extremes_on_a_line_under_a_force_that_grows() -> None:
    """Its power depends on time, which is no letter of formulas of energy."""
    found, g, mu, k = mbs.solve(mbs.loads(PUSHED)).answers, 9.81, 0.5, 3.0
    sine, cosine = math.sin(0.3), math.cos(0.3)
    slower, faster = g * (sine + mu * cosine), k * (cosine - mu * sine)  # the speed is 3 - slower t + faster t^2/2
    end = (slower - math.sqrt(slower * slower - 6.0 * faster)) / faster
    assert found["sticks"].value == pytest.approx(end, rel=1e-9)
    assert found["least"].value == pytest.approx(-mu * (g * cosine + k * sine * end), rel=1e-9)


@pytest.mark.parametrize("t_end", [2, 5, 10])
def test_a_ball_with_drag_is_fastest_up_behind_its_first_impact(t_end: int) -> None:
    """Runs of other lengths take other steps, and meet the impact at times that differ by rounding."""
    text = f"""
multibody_sym: 1
name: bounces with drag
gravity: [0, -9.81, 0]
bodies: {{b: {{mass: 2}}, ground: {{surfaces: {{f: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{J: {{type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {{q: 1}}}}}}
contacts: {{c: {{between: [b, ground.f], restitution: 0.5, open: true}}}}
forces: {{air: {{type: drag, on: b, quadratic: 0.1}}}}
ask: {{up: {{max: u_y}}, down: {{min: u_y}}, momentum: {{max: momentum(y)}}, work: {{min: power(air)}}}}
simulation: {{t_end: {t_end} s}}
"""
    found, m, g, c = answers(text), 2.0, 9.81, 0.1
    falls = math.sqrt(m * g / c * (1.0 - math.exp(-2.0 * c / m)))
    lands = math.acosh(math.exp(c / m)) / math.sqrt(g * c / m)
    for name, value in (("up", falls / 2), ("down", -falls), ("momentum", m * falls / 2), ("work", -c * falls**3)):
        assert found[name].value == pytest.approx(value, rel=1e-9), name
        assert found[name].t == pytest.approx(lands, rel=1e-9), name


def test_an_expression_that_jumps_with_the_state_is_largest_on_one_side() -> None:
    text = """
multibody_sym: 1
name: thrown up with drag
gravity: [0, -9.81, 0]
bodies: {ball: {mass: 1}}
joints: {J: {type: prismatic, parent: ground, child: ball, axis: y, q: y, initial: {u: 15}}}
forces: {air: {type: drag, on: ball, quadratic: 0.02}}
ask:
  before: {max: "where(u_y > 3, y, 2)", until: 2 s}
  behind: {max: "where(u_y > 3, 0, y - 2)", until: 1.1 s}
  least: {min: "where(u_y > 3, -y, y - 8)", until: 2 s}
  timed: {max: "where(t < 1, y, -y)", until: 2 s}
  lower: {max: "where(y < 5, y, -y)", until: 1 s}
  kink: {min: "abs(y - 5)*1000 + 7", until: 1 s}
  both: {max: "min(y, 12 - 2*y)", until: 1 s}
"""
    g, c, u0 = 9.81, 0.02, 15.0
    w = math.sqrt(c / g)

    def height(u: float) -> float:
        return math.log((g + c * u0**2) / (g + c * u**2)) / (2.0 * c)

    def speed(y: float) -> float:
        return math.sqrt(((g + c * u0**2) * math.exp(-2.0 * c * y) - g) / c)

    def time(u: float) -> float:
        return (math.atan(w * u0) - math.atan(w * u)) / (w * g)

    later = math.tan(math.atan(w * u0) - w * g) / w
    last = math.tan(math.atan(w * u0) - 1.1 * w * g) / w
    found = answers(text)
    for name, value, t in (
        ("before", height(3.0), time(3.0)),
        ("behind", height(last) - 2.0, 1.1),
        ("least", -height(3.0), time(3.0)),
        ("timed", height(later), 1.0),
        ("lower", 5.0, time(speed(5.0))),
        ("kink", 7.0, time(speed(5.0))),
        ("both", 4.0, time(speed(4.0))),
    ):
        assert found[name].value == pytest.approx(value, rel=1e-9), name
        assert found[name].t == pytest.approx(t, rel=1e-9), name


def test_the_power_of_a_motor_is_largest_at_a_knot_of_its_curve() -> None:
    """M = 5 + (u - 50)/80 up to 90 rad/s, so that it grows as exp(t/(80 J)) from when u is 50 rad/s."""
    text = """
multibody_sym: 1
name: motor
bodies: {rotor: {mass: 1, inertia: {Izz: 0.05}}}
joints: {A: {type: revolute, parent: ground, child: rotor, q: phi}}
inputs: {M: {table: [[0, 4], [50, 5], [90, 5.5], [110, 0]], of: u_phi}}
forces: {m: {type: torque, joint: A, value: M}}
ask: {P: {max: power(m)}, E: {max: "M*u_phi", until: 2 s}}
"""
    found, knot = answers(text), 2.5 * math.log(5 / 4) + 4.0 * math.log(5.5 / 5.0)
    for name in ("P", "E"):
        assert found[name].value == pytest.approx(495.0, rel=1e-12), name
        assert found[name].t == pytest.approx(knot, rel=1e-11), name


def test_an_extreme_that_comes_back_has_a_time_of_four_digits_at_least() -> None:
    """A block that bounces on a spring without loss: coarser runs come to another of its equal lowest places."""
    answers = mbs.solve(mbs.loads("""
multibody_sym: 1
name: bouncing
bodies: {b: {mass: 1}}
joints: {J: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {q: 1}}}
forces: {s: {type: force, on: b, value: [0, "max(-1000*y, 0) - 9.81", 0]}}
ask: {low: {min: y}}
simulation: {t_end: 60}
""")).answers
    pressed = 9.81e-3 + math.sqrt(9.81e-3**2 + 2 * 9.81e-3)
    still = math.sqrt(2 / 9.81) + (math.pi / 2 + math.atan(9.81 / math.sqrt(2 * 9.81 * 1000))) / math.sqrt(1000)
    assert answers["low"].value == pytest.approx(-pressed, rel=1e-8)
    assert answers["low"].t == pytest.approx(still, rel=1e-5)
    assert answers["low"].t_error < 1e-4
