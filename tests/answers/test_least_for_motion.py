"""Least forces that end rest: at the friction angle, and where a box tips before it slips; boxes on boxes."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from scipy.optimize import minimize_scalar

import multibody_sym as mbs
from multibody_sym.analysis.rest import ranges
from multibody_sym.cli.main import main
from multibody_sym.documents.analysis import least_text
from multibody_sym.errors import InputError, NoSolutionError
from multibody_sym.text.printer import text

PULL = """\
multibody_sym: 1
name: pull
gravity: [0, -g, 0]
parameters:
  {g: {value: 10, positive: true}, m: {value: 30, positive: true}, mu: 0.5, a: 0.2, F: 50 N, beta: 20 deg, b: 0.4, h: 1}
bodies:
  ground: {surfaces: {slope: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  block: {mass: m}
joints: {free: {type: point, parent: ground, child: block}}
contacts: {c: {between: [block, ground.slope], static: mu}}
forces: {pull: {type: force, on: block, value: [F*cos(a + beta), F*sin(a + beta), 0]}}
"""
BOX = PULL.replace("block: {mass: m}", "block: {shape: {box: [b, h, 1], mass: m}, points: {top: [b/2, h/2, 0]}}")
BOX = BOX.replace("type: point, parent: ground, child: block", "type: planar, parent: ground, child: block, initial: I")
BOX = (
    BOX.replace("initial: I", "initial: {q: [0, h/2, 0]}")
    .replace("a: 0.2", "a: 0")
    .replace("on: block", "on: block, at: top")
)

STACK = """\
multibody_sym: 1
name: stack
gravity: [10*sin(a), -10*cos(a), 0]
parameters: {a: 0.1, mu: 0.4, nu: 0.3}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  low: {shape: {box: [1, 0.4, 1], mass: 8}}
  up: {shape: {box: [0.6, 0.4, 0.6], mass: 4}}
joints:
  A: {type: planar, parent: ground, child: low, initial: {q: [0, 0.2, 0]}}
  B: {type: planar, parent: ground, child: up, initial: {q: [0, 0.6, 0]}}
contacts: {c1: {between: [low, ground.floor], static: mu}, c2: {between: [up, low], static: nu}}
"""


def test_a_block_is_drawn_up_a_slope_best_at_the_friction_angle():
    """F = m g sin(a + rho) at beta = rho above the slope, tan rho = mu; down it takes less, F = m g sin(rho - a)."""
    rho = math.atan(0.5)
    down = mbs.least_for_motion(mbs.loads(PULL), "F", "beta")
    assert down.value.value == pytest.approx(300 * math.sin(rho - 0.2), rel=1e-13)
    assert abs(down.at.value) == pytest.approx(math.pi - rho, rel=1e-13)
    assert down.value.gives_way == ("slips at c",)
    assert text(down.at.expression) in ("pi - atan(mu)", "atan(mu) - pi")
    assert text(down.value.expression) == "g*m*(mu*cos(a) - sin(a))/sqrt(mu^2 + 1)"


def test_on_level_ground_its_closed_form_is_that_of_books():
    level = mbs.loads(PULL.replace("a: 0.2, ", "").replace("-sin(a), cos(a)", "0, 1").replace("a + beta", "beta"))
    found = mbs.least_for_motion(level, "F", "beta")
    assert found.value.value == pytest.approx(300 * 0.5 / math.hypot(1, 0.5), rel=1e-14)
    assert found.at.value == pytest.approx(math.atan(0.5), rel=1e-14)
    forms = found.value.expression, found.value.exact, found.at.expression
    assert [text(form) for form in forms] == ["g*m*mu/sqrt(mu^2 + 1)", "60*sqrt(5)", "atan(mu)"]
    assert (found.unit, found.vary_unit) == ("N", "rad")


def test_a_tall_box_tips_first():
    """Pulled at its upper edge the moment about the lower one, F (h cos beta), needs b/2 m g; 0 < beta < pi / 2."""
    found = mbs.least_for_motion(mbs.loads(BOX), "F", "beta")

    def force(beta: float) -> float:
        along, up, weight = math.cos(beta), math.sin(beta), 300.0
        slips = 0.5 * weight / (abs(along) + 0.5 * up)
        right = weight * 0.2 / (along * 1.0) if along > 0 else math.inf  # about the lower right edge
        lever = -along * 1.0 + up * 0.4  # about the lower left edge
        left = weight * 0.2 / lever if lever > 0 else math.inf
        return min(x for x in (slips, right, left) if x > 0)

    best = min(
        (minimize_scalar(force, bounds=(x, x + 0.1), method="bounded") for x in [-3.1 + 0.1 * k for k in range(62)]),
        key=lambda x: x.fun,
    )
    assert found.value.value == pytest.approx(best.fun, rel=1e-9)
    assert found.at.value == pytest.approx(best.x, abs=1e-4)
    assert "tips about its" in found.value.gives_way[0]


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "pull.yaml"
    file.write_text(PULL.replace("a: 0.2, ", "").replace("-sin(a), cos(a)", "0, 1").replace("a + beta", "beta"))
    assert main(["equilibrium", str(file), "--least", "F", "--vary", "beta", "--json"]) == 0
    printed = capsys.readouterr()
    answer = json.loads(printed.out)
    assert (answer["parameter"], answer["least"]["parameter"]) == ("beta", "F")
    assert answer["least"]["expression"] == "g*m*mu/sqrt(mu^2 + 1)"
    assert answer["at"]["value"] == pytest.approx(math.atan(0.5), rel=1e-14)
    assert "rest ends first at F = g*m*mu/sqrt(mu^2 + 1) = 60*sqrt(5) = 134.1640786 N (slips at c)" in printed.err
    assert "where beta = atan(mu)" in printed.err
    assert main(["equilibrium", str(file), "--least", "F"]) == 2
    assert "such as --vary beta" in capsys.readouterr().err


def test_what_nothing_moves_is_told() -> None:
    wall = mbs.loads(PULL.replace("static: mu", "static: enough").replace("F*sin(a + beta)", "-F"))
    with pytest.raises(NoSolutionError, match="nothing moves it"):
        mbs.least_for_motion(wall, "F", "beta")
    with pytest.raises(InputError, match="there is no parameter 'G'"):
        mbs.least_for_motion(wall, "G", "beta")


@pytest.mark.parametrize("mu", [0.1, 0.0])
def test_where_zero_does_not_hold_the_least_that_holds_is_found_too(monkeypatch, mu: float) -> None:
    """On a slope steeper than phi = atan(mu): W sin(a - phi) at beta = -phi holds, W sin(a + phi) at phi moves it up.

    Each angle is looked at once: the search took half a minute.
    """
    looked = []
    first_range = ranges.first_range
    monkeypatch.setattr(ranges, "first_range", lambda *given: looked.append(given) or first_range(*given))
    phi = math.atan(mu)
    found = mbs.least_for_motion(mbs.loads(PULL), "F", "beta", parameters={"mu": mu})
    assert found.holds is not None
    assert found.holds_at is not None
    assert found.holds.value == pytest.approx(300 * math.sin(0.2 - phi), rel=1e-13)
    assert found.holds_at.value == pytest.approx(-phi, rel=1e-13, abs=1e-15)
    assert found.value.value == pytest.approx(300 * math.sin(0.2 + phi), rel=1e-13)
    assert found.at.value == pytest.approx(phi, rel=1e-13, abs=1e-15)
    assert (found.holds.gives_way, found.value.gives_way) == (("slips at c",), ("slips at c",))
    if mu:
        assert text(found.holds.expression) == "g*m*(sin(a) - mu*cos(a))/sqrt(mu^2 + 1)"
        assert text(found.value.expression) == "g*m*(mu*cos(a) + sin(a))/sqrt(mu^2 + 1)"
        assert least_text(found).startswith("the least that holds is F = g*m*(sin(a) - mu*cos(a))/sqrt(mu^2 + 1) = ")
        assert found.as_json()["holds_at"]["expression"] == "-atan(mu)"
    assert len(looked) < 200


def test_the_least_over_slopes_is_zero_where_one_slope_rests_by_itself() -> None:
    """Over the slope itself: rest at F = 0 where |a| <= phi; the force that ends rest falls to 0 as a goes to -phi."""
    found = mbs.least_for_motion(mbs.loads(PULL), "F", "a", parameters={"mu": 0.1})
    assert found.holds is not None
    assert (found.holds.value, found.holds.gives_way) == (0.0, ())
    assert found.value.value == pytest.approx(0.0, abs=1e-6)
    assert found.at.value == pytest.approx(-math.atan(0.1), rel=1e-8)


def test_what_no_force_holds_is_refused() -> None:
    pressed = mbs.loads(PULL.replace("F*cos(a + beta), F*sin(a + beta)", "F*sin(a)*cos(beta), -F*cos(a)*cos(beta)"))
    with pytest.raises(NoSolutionError, match="rest is possible at no F >= 0, whatever beta is"):
        mbs.least_for_motion(pressed, "F", "beta", parameters={"mu": 0})


def test_values_at_which_the_model_has_no_start_are_no_rest() -> None:
    """m*g*l*sin(th) = 0: neither a mass point on its hinge nor a body without mass is a pendulum; g = 0 is."""
    pendulum = mbs.loads("""\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {H: {type: revolute, parent: ground, child: bob, initial: {q: 120 deg}}}
""")
    with pytest.raises(NoSolutionError, match="rest is possible at no m >= 0, whatever l is"):
        mbs.least_for_motion(pendulum, "m", "l")
    with pytest.raises(NoSolutionError, match="where rest is possible at a value of g, it is so at every m"):
        mbs.least_for_motion(pendulum, "m", "g")
    assert mbs.least_for_motion(pendulum, "g", "l").value.value == 0.0


def test_what_falls_without_end_has_no_least_value() -> None:
    """Pushed at height y a box tips at m g b / (2 y), ever sooner: zero is not reached, least of all at y = 0."""
    level = BOX.replace("a: 0, ", "y: 1 m, ").replace("-sin(a), cos(a)", "0, 1").replace("a + beta", "0")
    pushed = mbs.loads(
        level.replace("[b/2, h/2, 0]", "[b/2, y - h/2, 0]").replace("y: 1 m", "y: {value: 1, positive: true}")
    )
    with pytest.raises(NoSolutionError, match=r"it falls as far as was looked, to 0.006 N at y = 10000"):
        mbs.least_for_motion(pushed, "F", "y")


@pytest.mark.parametrize(("vary", "slips"), [("nu", "c2"), ("mu", "c1")])
def test_a_box_on_a_box_rests_on_the_corners_that_touch_whatever_the_others_face(vary, slips):
    """Corners of the lower one are inside of what the upper one's sides would be without ends: tan(a) <= mu, nu."""
    answer = mbs.range_of_rest(mbs.loads(STACK), vary)
    assert answer.rest == [(pytest.approx(math.tan(0.1), rel=1e-13), None)]
    assert answer.ends[0][0].gives_way == (f"slips at {slips}",)
